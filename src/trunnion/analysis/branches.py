"""Which way a mechanism is put together: a choice stated once, at the start of the cycle, and then carried.

A closed-form group has the branches +1 and −1. A general group is solved at the start from many guesses, the
assembly nearest the hint is taken, and that one is followed along the nominal cycle: the `Track`. Any batch then
starts Newton from the track, all lanes in parallel, and a lane that ends on another branch is not assembled.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number
from trunnion.analysis import change_points
from trunnion.analysis.kinematics import Forward, pairs_of, pose_of, start, take
from trunnion.analysis.system import System, Values, driven_coordinates
from trunnion.errors import Finding, Severity
from trunnion.groups.general import General, Pose, size_of
from trunnion.groups.planar import Frame, compose, point
from trunnion.structure.decompose import Module

__all__ = ["Chosen", "Track", "choose"]

Array = NDArray[np.float64]
Pick = Callable[[Number], Any]

GRID = 720  # intervals of one turn of the fastest driver, along which general groups are followed
MOST_INTERVALS = 720_000
GUESSES = 512
SEED = 20060704  # of the guesses: the same assemblies every time
TURN_JUMP = 0.35  # rad between neighbours of the grid: more is another branch
SLIDE_JUMP = 0.25  # of the group's size, likewise
BLOCK = 32  # grid points tried at a time


@dataclass(frozen=True)
class Track:
    """Free tree coordinates of a general group along the nominal cycle, and the sign of det J on its branch.

    times: (grid,) s; coordinates: (free, grid), NaN where the group cannot be assembled.
    """

    times: Array
    coordinates: Array
    orientation: float
    periodic: bool
    clock: Clock

    def pose(
        self,
        group: General,
        elements: Sequence[tuple[Frame, Frame]],
        drive: Sequence[Number],
        walk: Forward,
        time: Number,
    ) -> Pose:
        """Pose by Newton from the track; NaN in the lanes that left its branch."""
        moment = primal(self.clock.nominal(walk, time))
        moment = np.mod(moment, self.times[-1]) if self.periodic else moment
        near = np.clip(np.searchsorted(self.times, moment), 1, len(self.times) - 1) if len(self.times) > 1 else 0
        guess = [_interpolated(self.times, row, moment, near) for row in self.coordinates]
        pose = group.position(elements, guess, drive)
        stays = pose.orientation == self.orientation
        size = size_of(group, elements)
        for i, from_ in zip(group.free, guess, strict=True):
            revolute = group.joints[group.steps[i].joint].kind == "revolute"
            reach = 4 * TURN_JUMP if revolute else 4 * SLIDE_JUMP * size
            stays = stays & (np.abs(primal(pose.q[i]) - from_) < reach)
        return pose._replace(frames=tuple(_kept(frame, stays) for frame in pose.frames))


class Clock(NamedTuple):
    """How a track is read: by a driver of constant speed, and where and how fast that went in the nominal cycle.

    A run at another speed passes the same coordinates at other times. Without such a driver (speed 0) it is read
    by time, in shares of the cycle of the first.
    """

    driver: str
    start: float
    speed: float
    duration: float

    @classmethod
    def of(cls, system: System, values: Values) -> Clock:
        """The first driver's of constant speed, else the first one's."""
        drivers = system.mechanism.drivers
        for name in [*(name for name, one in drivers.items() if one.law == "constant"), *drivers]:
            start, speed, _ = (float(np.ravel(primal(n))[0]) for n in system.drive(values, name, 0.0))
            duration = float(np.ravel(system.span(values, name).duration)[0])
            return cls(name, start, speed if drivers[name].law == "constant" else 0.0, duration)
        return cls("", 0.0, 0.0, 1.0)

    def nominal(self, walk: Forward, time: Number) -> Number:
        """The time at which the nominal cycle has the coordinate that this run has at `time`, s."""
        if not self.driver:
            return time
        if not self.speed:
            return time * (self.duration / walk.system.span(walk.values, self.driver).duration)
        return (walk.system.drive(walk.values, self.driver, time)[0] - self.start) / self.speed


def _interpolated(times: Array, row: Array, moment: Array, near: NDArray[np.intp] | int) -> Array:
    """Linear between the grid's neighbours; from the one that exists where the other does not."""
    if len(times) == 1:
        return np.broadcast_to(row[0], np.shape(moment))
    before, after = row[near - 1], row[near]
    share = (moment - times[near - 1]) / (times[near] - times[near - 1])
    mixed: Array = before + share * (after - before)
    return np.where(np.isfinite(mixed), mixed, np.where(np.isfinite(before), before, after))


def _kept(frame: Frame, lanes: Number) -> Frame:
    if np.all(lanes):
        return frame
    hole = np.where(lanes, 0.0, np.nan)
    return Frame(*(n + hole for n in frame))


@dataclass(frozen=True)
class Chosen:
    """Assembly of every module (±1, Track, None for a driver), how many there were, and what there is to say."""

    assembly: tuple[Any, ...]
    found: tuple[int, ...]
    findings: tuple[Finding, ...]


def choose(system: System, values: Values) -> Chosen:
    """The assembly of every module that lies nearest the hints, at the nominal values and the start of the cycle."""
    cycle = system.cycle(values)
    intervals = min(GRID * max(1, math.ceil(cycle.turns)), MOST_INTERVALS) if cycle.duration > 0 else 0
    times = np.linspace(0.0, cycle.duration, intervals + 1)
    walk = start(system, values)
    chosen: list[Any] = []
    counts: list[int] = []
    findings: list[Finding] = []
    with np.errstate(all="ignore"):
        for number, module in enumerate(system.plan.modules):
            group = system.groups[number]
            assembly: Any
            if module.rank == 1:
                assembly, count = None, 1
            elif isinstance(group, General):
                drive, _, _ = driven_coordinates(system, module, system.places[number], values, times)
                assembly, count = _track(walk, number, group, drive, times, cycle.periodic)
            else:
                assembly, count = _branch(walk, number, times), len(group.BRANCHES)
            if module.rank > 1 and count > 1 and not _hints(walk, module):
                findings.append(_unstated(module, count))
            chosen.append(assembly)
            walk.assembly.append(assembly)
            counts.append(count)
            if isinstance(assembly, Track) and not np.any(np.isfinite(assembly.coordinates)):
                findings.append(_never(module))
            pose = pose_of(walk, number, assembly, times)
            take(walk, number, pose, times)
            if module.rank > 1 and group.BRANCHES:
                meeting = change_points.find(walk, number, assembly, times, pose)
                findings += [change_points.finding(system, values, module, meeting)] if meeting else []
    return Chosen(tuple(chosen), tuple(counts), tuple(findings))


def _unstated(module: Module, count: int) -> Finding:
    links = ", ".join(module.links)
    what = f"links {links} can be assembled in {count} ways and no hint says which; one was taken"
    joint = module.joints[len(module.joints) // 2]
    remedy = f"say roughly where a point is at the start, e.g. assembly: {{{joint}: [x, y]}}"
    return Finding(what, "assembly", remedy, Severity.WARNING)


def _never(module: Module) -> Finding:
    what = f"links {', '.join(module.links)} cannot be assembled anywhere along the cycle"
    return Finding(what, "links", "check the lengths, or give a better assembly hint", Severity.WARNING)


# ---- hints ----------------------------------------------------------------------------------------------------


def _hints(walk: Forward, module: Module) -> list[tuple[str, str, tuple[Number, ...]]]:
    """(link, point, (x, y)) or ("", joint, (angle,)) of the hints that tell assemblies of this module apart."""
    found: list[tuple[str, str, tuple[Number, ...]]] = []
    values = walk.values
    for key in walk.system.mechanism.assembly:
        path = f"assembly.{key}"
        if f"{path}.x" in values:
            link, name = _point_of(walk.system, module, key)
            if link:
                found.append((link, name, (values[f"{path}.x"], values[f"{path}.y"])))
        elif key in module.joints:
            found.append(("", key, (values[path],)))
    return found


def _point_of(system: System, module: Module, key: str) -> tuple[str, str]:
    """The link of the module that carries the hinted point, if the place of the point is not known without it."""
    if key in system.joints:
        links = system.joints[key][1]
        inside = [link for link in links if link in module.links]
        known = key in module.joints and system.joints[key][0] == "revolute" and len(inside) == 1
        return ("", "") if not inside or known else (inside[-1], key)
    link, _, name = key.partition(".")
    return (link, name) if link in module.links else ("", "")


def _distance(walk: Forward, module: Module, frames: Sequence[Frame], pick: Pick, known: Pick) -> Array:
    """Sum of the squared distances of an assembly from the hints, m² and rad².

    pick, known: take the position looked at from the numbers of the module's links and of the known ones.
    """
    total: Any = 0.0
    for link, name, place in _hints(walk, module):
        if link:
            path = f"links.{link}.points.{name}"
            frame = frames[module.links.index(link)]
            x, y = point(frame, walk.values[f"{path}.x"], walk.values[f"{path}.y"])
            total = total + (pick(x) - place[0]) ** 2 + (pick(y) - place[1]) ** 2
            continue
        kind, links = walk.system.joints[name]
        first, second = (_element(walk, module, frames, side, name, pick, known) for side in links)
        if kind == "prismatic":
            slide = first.c * (second.x - first.x) + first.s * (second.y - first.y)
            total = total + (slide - place[0]) ** 2
        else:
            turn = np.arctan2(second.s, second.c) - np.arctan2(first.s, first.c) - place[0]
            total = total + np.arctan2(np.sin(turn), np.cos(turn)) ** 2
    return np.asarray(total, float)


def _element(
    walk: Forward, module: Module, frames: Sequence[Frame], link: str, joint: str, pick: Pick, known: Pick
) -> Frame:
    """Global element of a joint on one of its links, in the module or known, at the position looked at."""
    if link not in module.links:
        return Frame(*(known(n) for n in walk.element(link, joint)))
    element = compose(frames[module.links.index(link)], walk.local[link, joint])
    return Frame(*(pick(n) for n in element))


def _nth(lane: int) -> Pick:
    """Picks the value at one position of the cycle."""

    def pick(number: Number) -> Any:
        values = np.ravel(number)
        return values[min(lane, len(values) - 1)]

    return pick


_first = _nth(0)


# ---- closed forms ---------------------------------------------------------------------------------------------


def _branch(walk: Forward, number: int, times: Array) -> int:
    """+1 or −1: the nearer to the hints at the start; where it does not close there, the side the hint lies on."""
    module = walk.system.plan.modules[number]
    branches = walk.system.groups[number].BRANCHES
    if len(branches) == 1 or not _hints(walk, module):
        return branches[0]
    poses = [pose_of(walk, number, branch, times) for branch in branches]
    distances = [_distance(walk, module, pose.frames, _first, _first) for pose in poses]
    if not np.all(np.isfinite(distances)) and module.kind == "RRR":
        return _side(walk, number)
    for lane in range(len(times)):  # the start if it closes there, else the first position that does
        distances = [_distance(walk, module, pose.frames, _nth(lane), _nth(lane)) for pose in poses]
        if np.all(np.isfinite(distances)):
            break
    return branches[0] if not distances[1] < distances[0] else branches[1]


def _side(walk: Forward, number: int) -> int:
    """Side of the line between the outer pins on which the hinted inner pin lies."""
    module, places = walk.system.plan.modules[number], walk.system.places[number]
    (b, _), _, (d, _) = pairs_of(walk, places)
    for _, name, place in _hints(walk, module):
        if name == module.joints[1] and len(place) == 2:
            x, y = _first(b.x), _first(b.y)
            side = (_first(d.x) - x) * (place[1] - y) - (_first(d.y) - y) * (place[0] - x)
            return 1 if side >= 0 else -1
    return 1


# ---- general groups -------------------------------------------------------------------------------------------


def _track(
    walk: Forward, number: int, group: General, drive: Sequence[Number], times: Array, periodic: bool
) -> tuple[Track, int]:
    """The assembly nearest the hints, followed both ways from the first position where there is one."""
    module, places = walk.system.plan.modules[number], walk.system.places[number]
    elements = pairs_of(walk, places)
    grid = len(times)
    rows = np.full((len(group.free), grid), np.nan)
    clock = Clock.of(walk.system, walk.values)
    for first in _starts(grid):
        found = _assemblies(group, _at(elements, first), [_lane(q, first) for q in drive])
        if found.q[0].size:
            break
    else:
        return Track(times, rows, 0.0, periodic, clock), 0
    every = _distance(walk, module, found.frames, lambda n: n, _nth(first))
    distance = np.broadcast_to(every, found.orientation.shape)
    best = int(np.argmin(distance))
    orientation = float(found.orientation[best])
    here = np.array([found.q[i][best] for i in group.free])
    rows[:, first] = here
    follower = _Follower(group, elements, drive, orientation)
    follower.run(rows, list(range(first, grid)))
    follower.run(rows, list(range(first, -1, -1)))
    if periodic:
        _wrap(rows, group)
        follower.run(rows, _gap_backward(rows))
    return Track(times, rows, orientation, periodic, clock), len(distance)


def _starts(grid: int) -> Iterator[int]:
    """The start of the cycle, then positions spread over it."""
    yield from sorted({int(i) for i in np.linspace(0, grid - 1, 25)}) if grid > 1 else (0,)


def _wrap(rows: Array, group: General) -> None:
    """Carry the start over to the end of a periodic cycle: the same position, turned by whole turns."""
    if np.isfinite(rows[0, 0]) and not np.isfinite(rows[0, -1]):
        rows[:, -1] = rows[:, 0]
    elif np.isfinite(rows[0, -1]) and not np.isfinite(rows[0, 0]):
        rows[:, 0] = rows[:, -1]


def _gap_backward(rows: Array) -> list[int]:
    """Indices from the end of the cycle down to the first gap, if the end was reached only by wrapping."""
    if np.all(np.isfinite(rows[0])) or not np.isfinite(rows[0, -1]):
        return []
    return list(range(rows.shape[1] - 1, -1, -1))


def _assemblies(group: General, elements: Sequence[tuple[Frame, Frame]], drive: Sequence[Number]) -> Pose:
    """All assemblies found at one position from many guesses, each once, along the last axis."""
    rng = np.random.default_rng(SEED)
    spread = _extent(group, elements)
    guesses = [
        rng.uniform(-np.pi, np.pi, GUESSES)
        if group.joints[group.steps[i].joint].kind == "revolute"
        else rng.uniform(-2 * spread, 2 * spread, GUESSES)
        for i in group.free
    ]
    pose = group.position(elements, guesses, drive)
    shape = (GUESSES,)
    key = np.array(
        [
            np.broadcast_to(n, shape)
            for frame in pose.frames
            for n in (frame.x / spread, frame.y / spread, frame.c, frame.s)
        ]
    )
    good = np.flatnonzero(np.isfinite(key).all(axis=0) & (np.broadcast_to(pose.condition, shape) < 1e8))
    kept: list[int] = []
    for lane in good:
        if all(np.max(np.abs(key[:, lane] - key[:, other])) > 1e-6 for other in kept):
            kept.append(int(lane))
    frames = tuple(Frame(*(np.broadcast_to(n, shape)[kept] for n in frame)) for frame in pose.frames)
    return pose._replace(
        frames=frames,
        q=tuple(np.broadcast_to(q, shape)[kept] for q in pose.q),
        orientation=np.broadcast_to(pose.orientation, shape)[kept],
    )


def _extent(group: General, elements: Sequence[tuple[Frame, Frame]]) -> float:
    """How far a slide may reach: the largest size of the group over the lanes, m."""
    sizes = size_of(group, elements)
    return float(np.max(sizes[np.isfinite(sizes)], initial=0.0)) or 1.0


def _lane(number: Number, index: int | NDArray[np.intp]) -> Number:
    return number[index] if np.ndim(number) else number


def _at(elements: Sequence[tuple[Frame, Frame]], index: int) -> list[tuple[Frame, Frame]]:
    return [(_frame_at(a, index), _frame_at(b, index)) for a, b in elements]


def _frame_at(frame: Frame, index: int | NDArray[np.intp]) -> Frame:
    return Frame(*(_lane(n, index) for n in frame))


@dataclass(frozen=True)
class _Follower:
    """Follows one assembly of a general group from grid point to grid point."""

    group: General
    elements: Sequence[tuple[Frame, Frame]]
    drive: Sequence[Number]
    orientation: float

    def run(self, rows: Array, order: Sequence[int]) -> None:
        """Fill `rows` (free, grid) along `order`, whose first column is known, up to where the branch ends.

        Several grid points are tried at a time, all lanes in parallel, and kept as far as they follow smoothly.
        """
        slope = np.zeros(len(rows))
        block, place = 1, 0
        while place + 1 < len(order):
            here, ahead = order[place], list(order[place + 1 : place + 1 + block])
            if np.isfinite(rows[0, ahead[0]]):
                slope = rows[:, ahead[0]] - rows[:, here]
                place += 1
                continue
            found = self._block(rows[:, here], slope, ahead)
            kept = found.shape[1]
            if kept == 0 and block == 1:
                found_one = self._advance(rows[:, here], slope, here, ahead[0], 0.0, 1.0)
                if found_one is None:
                    return
                found, kept = found_one[:, None], 1
            if kept:
                rows[:, ahead[:kept]] = found
                before = rows[:, ahead[kept - 2]] if kept > 1 else rows[:, here]
                slope = found[:, -1] - before
            place += kept
            block = min(2 * block, BLOCK) if kept == len(ahead) else max(1, kept)

    def _block(self, q: Array, slope: Array, ahead: Sequence[int]) -> Array:
        """Coordinates (free, k) at the first k points of `ahead`, k as far as they follow q smoothly."""
        guess = q[:, None] + slope[:, None] * np.arange(1, len(ahead) + 1)
        indices = np.asarray(ahead)
        elements = [(_frame_at(a, indices), _frame_at(b, indices)) for a, b in self.elements]
        pose = self.group.position(elements, list(guess), [_lane(n, indices) for n in self.drive])
        found = np.array([np.broadcast_to(pose.q[i], indices.shape) for i in self.group.free])
        change = np.diff(found, axis=1, prepend=q[:, None])
        bend = np.abs(np.diff(change, axis=1, prepend=change[:, :1]))
        limits = self._limits(_extent(self.group, elements))[:, None]
        good = np.all((np.abs(change) <= limits) & (bend <= limits / 4), axis=0)
        good = good & (np.broadcast_to(pose.orientation, indices.shape) == self.orientation)
        return found[:, : len(ahead) if good.all() else int(np.argmin(good))]

    def _limits(self, size: float) -> Array:
        """Largest change of each free coordinate between neighbours of the grid, rad or m."""
        kinds = [self.group.joints[self.group.steps[i].joint].kind for i in self.group.free]
        return np.array([TURN_JUMP if kind == "revolute" else SLIDE_JUMP * size for kind in kinds])

    def _advance(self, q: Array, slope: Array, here: int, there: int, low: float, high: float) -> Array | None:
        """From share `low` to `high` of the way between two grid points, halving the step where Newton strays."""
        found = self._solve(q + slope * (high - low), q, here, there, high)
        if found is not None:
            return found
        if high - low < 1 / 16:
            return None
        middle = (low + high) / 2
        half = self._advance(q, slope, here, there, low, middle)
        return None if half is None else self._advance(half, slope, here, there, middle, high)

    def _solve(self, guess: Array, before: Array, here: int, there: int, share: float) -> Array | None:
        elements = [(_mixed(a, here, there, share), _mixed(b, here, there, share)) for a, b in self.elements]
        drive = [_between(q, here, there, share) for q in self.drive]
        pose = self.group.position(elements, list(guess), drive)
        found = np.array([float(pose.q[i]) for i in self.group.free])
        if not np.all(np.isfinite(found)) or pose.orientation != self.orientation:
            return None
        limits = self._limits(_extent(self.group, elements))
        return found if np.all(np.abs(found - before) <= limits) else None


def _between(number: Number, here: int, there: int, share: float) -> Number:
    return number[here] + share * (number[there] - number[here]) if np.ndim(number) else number


def _mixed(frame: Frame, here: int, there: int, share: float) -> Frame:
    """A frame part of the way between two grid points; directions stay unit vectors."""
    x, y, c, s = (_between(n, here, there, share) for n in frame)
    length = np.hypot(c, s)
    return Frame(x, y, c / length, s / length)
