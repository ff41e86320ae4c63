"""General groups along the cycle: all assemblies at some positions, and one of them followed from there: its `Track`.

Any batch starts Newton's method from the track, all lanes in parallel; a lane that ends on another branch is not
assembled.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, each, namespace
from trunnion.groups.tree import Tree
from trunnion.solve.forward import Forward
from trunnion.solve.system import System, Values

Array = NDArray[np.float64]
Places = NDArray[np.intp]  # positions of the grid
Elements = Sequence[Any]  # per joint: both its elements, as nested tuples of numbers

GUESSES = 512
TOUCHING = 1e-6  # of 1/condition: below it two assemblies meet
MOST_CONDITION = 1e6  # of an assembly that counts: in those above, two may meet
SAME = 1e-6  # of what tells assemblies apart: nearer ones are one
SEED = 20060704  # of the guesses: the same assemblies every time
TURN_JUMP = 0.35  # rad between neighbours of the grid: more is another branch
SLIDE_JUMP = 0.25  # of the group's size, likewise
STRIDE = 24  # positions of the grid from one to the next that is followed first
WIDE = 8  # of these at a time
NEAR_LIMIT = 24  # more rounds of Newton from a guess nearby: halving a step brings it to 1e-7 where branches meet
HALVES = np.exp2(-np.arange(6.0))  # of the way between two positions of the grid, where Newton strays


# ---- all assemblies -------------------------------------------------------------------------------------------


class Assemblies(NamedTuple):
    """Poses of a group solved from many guesses at some positions, lane by lane: all guesses of one, then the next.

    closed: (lane,) which are assemblies; q: (kept, lane) coordinates; key: (entry, lane) what tells them apart.
    """

    pose: Any
    closed: NDArray[np.bool_]
    q: Array
    key: Array

    def full(self) -> Any:
        """The pose with its frames and orientation in every lane."""
        shape = self.closed.shape
        frames = each(self.pose.frames, lambda n: np.broadcast_to(primal(n), shape))
        return self.pose._replace(frames=frames, orientation=np.broadcast_to(self.pose.orientation, shape))


def closed_at(
    group: Tree, elements: Elements, drive: Sequence[Number], places: Sequence[int] | Places, guesses: int
) -> Assemblies:
    """What a number of guesses at each of some positions of the grid leads to."""
    lanes = places[0] if len(places) == 1 else np.repeat(np.asarray(places), guesses)
    shape = (len(places) * guesses,)
    elements = at(elements, lanes)
    spread = extent(group, elements)
    rng = np.random.default_rng(SEED)
    start = [rng.uniform(-reach, reach, shape) for reach in guess_reaches(group, spread)]
    pose = group.position(elements, start, [lane_of(number, lanes) for number in drive])
    q = np.array([np.broadcast_to(pose.q[i], shape) for i in group.kept])
    key = np.array([np.broadcast_to(n, shape) for n in group.signature(pose, spread)])
    closed = np.isfinite(key).all(axis=0) & np.isfinite(q).all(axis=0)
    return Assemblies(pose, closed & (np.broadcast_to(pose.condition, shape) < MOST_CONDITION), q, key)


def each_once(group: Tree, solved: Assemblies) -> list[int]:
    """Lanes that hold every assembly of one position once, in an order that does not depend on the guesses."""
    closed, key = solved.closed, solved.key
    geared = {gear.first for gear in getattr(group, "gears", ()) if gear.slide != 0}
    for joint in group.order:
        if joint in geared - set(group.driven):  # whole turns more would be another tooth
            closed = closed & (np.abs(np.broadcast_to(solved.pose.q[group.starts[joint]], closed.shape)) <= np.pi)
    lanes: list[int] = []
    for lane in np.flatnonzero(closed):
        if all(np.max(np.abs(key[:, lane] - key[:, other])) > SAME for other in lanes):
            lanes.append(int(lane))
    return sorted(lanes, key=lambda lane: tuple(np.round(key[:, lane], 6)))


def guess_reaches(group: Tree, spread: float) -> list[float]:
    """How far a guess of each coordinate may lie from 0."""
    return [{"turn": np.pi, "slide": 2 * spread, "part": 1.0}[kind] for kind in group.kept_kinds]


def extent(group: Tree, elements: Elements) -> float:
    """How far a slide may reach: the largest size of the group over the lanes, m."""
    sizes = group.size(elements)
    return float(np.max(sizes[np.isfinite(sizes)], initial=0.0)) or 1.0


def lane_of(number: Number, index: int | Places) -> Number:
    """A number at some positions of the grid."""
    return number[index] if np.ndim(number) else number


def at(elements: Elements, index: int | Places) -> list[Any]:
    """The elements at some positions of the grid."""
    return [each(pair, lambda n: lane_of(n, index)) for pair in elements]


# ---- one of them, followed -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Follower:
    """Follows one assembly of a general group over the grid: rows (kept, grid) of its coordinates, NaN where unknown.

    orientation: sign of det J on its branch; stride: of the positions that are followed first.
    """

    group: Tree
    elements: Elements
    drive: Sequence[Number]
    orientation: float
    stride: int = STRIDE

    def both_ways(self, rows: Array, begin: int, periodic: bool) -> None:
        """Fill the rows from one position forward and back, and over the end of a periodic cycle."""
        grid = rows.shape[1]
        self.run(rows, np.arange(begin, grid))
        self.run(rows, np.arange(begin, -1, -1))
        if periodic:  # start and end are one position, turned by whole turns
            ends = rows[:, [0, -1]]
            rows[:, [0, -1]] = np.where(np.isfinite(ends), ends, ends[:, ::-1])
            if np.isfinite(rows[0, -1]) and not np.isfinite(rows[0]).all():
                self.run(rows, np.arange(grid - 1, -1, -1))

    def run(self, rows: Array, order: Places) -> None:
        """Fill the rows along an order of positions, the first of which is known, to where the branch ends.

        Wide strides come first; where they stray, narrower ones, and in the end parts of the way to the next position.
        """
        place, slope, stride, after_part = 0, np.zeros(len(rows)), 0, self.stride
        while place + 1 < len(order):
            q, ahead = rows[:, order[place]], order[place + 1 : place + 1 + 4 * WIDE * max(stride, 1)]
            filled = np.flatnonzero(np.isfinite(rows[0, ahead]))
            if len(filled) and filled[0] == 0:
                followed = rows[:, ahead[:1]]
            elif stride:
                ahead = ahead[: filled[0]] if len(filled) else ahead
                followed = self._stridden(q, slope, ahead, stride)
                complete = followed.shape[1] == len(ahead)
                stride, after_part = (min(2 * stride, self.stride) if complete else stride // 4), 1
            else:
                part = self._by_parts(q, slope, order[place], ahead[0])
                if part is None:
                    return
                followed, stride = part[:, None], after_part
            count = followed.shape[1]
            rows[:, ahead[:count]] = followed
            if count:
                slope = followed[:, -1] - (followed[:, -2] if count > 1 else q)
            place += count

    def _stridden(self, q: Array, slope: Array, ahead: Places, stride: int) -> Array:
        """Coordinates (kept, k) at the first k of some positions that follow q smoothly, where they change by slope.

        Some far apart are followed first, then all are solved at once from what lies between these.
        """
        knots = np.append(np.arange(0, len(ahead), stride), len(ahead))  # counted in positions after that of q
        through, change = q[:, None], slope[:, None]
        while (done := through.shape[1]) < len(knots):
            steps = knots[done : done + WIDE] - knots[done - 1]
            solved, good = self._at(ahead[steps + knots[done - 1] - 1], through[:, -1:] + change * steps)
            count = _leading(good)
            if not count:
                break
            through = np.append(through, solved[:, :count], axis=1)
            change = (through[:, -1:] - through[:, -2:-1]) / (knots[done + count - 1] - knots[done + count - 2])
        inside = ahead[: knots[through.shape[1] - 1]]
        if not len(inside):
            return through[:, :0]
        # guesses between the knots: cubic, with the slopes of the neighbours
        knots, places = knots[: through.shape[1]], np.arange(1, len(inside) + 1)
        slopes = np.gradient(through, knots, axis=1)
        low = np.minimum(np.searchsorted(knots, places, side="right") - 1, len(knots) - 2)
        width = knots[low + 1] - knots[low]
        s = (places - knots[low]) / width
        guess = through[:, low] * (1 + 2 * s) * (1 - s) ** 2 + through[:, low + 1] * s**2 * (3 - 2 * s)
        guess = guess + width * (slopes[:, low] * s * (1 - s) ** 2 + slopes[:, low + 1] * s**2 * (s - 1))
        solved, good = self._at(inside, guess)
        change = np.diff(solved, axis=1, prepend=q[:, None])
        bend = np.abs(np.diff(change, axis=1, prepend=change[:, :1]))
        most = limits(self.group, extent(self.group, at(self.elements, inside)))[:, None]
        good = good & np.all((np.abs(change) <= most) & (bend <= most / 4), axis=0)
        return solved[:, : _leading(good)]

    def _by_parts(self, q: Array, slope: Array, here: int, after: int) -> Array | None:
        """Coordinates at the next position, by parts of the way that are halved where Newton strays; None if too small.

        All halvings are tried at once: Newton costs about as much for many lanes as for one.
        """
        share = 0.0
        while share < 1.0:
            ends: Array = share + (1 - share) * HALVES
            ends = ends[ends - share >= HALVES[-1]]
            elements = [_part(pair, here, after, ends) for pair in self.elements]
            drive = [_mixed(number, here, after, ends) for number in self.drive]
            guess = q[:, None] + slope[:, None] * (ends - share)
            solved, good = self._solved(elements, drive, guess, NEAR_LIMIT)
            most = limits(self.group, extent(self.group, elements))[:, None]
            good = good & np.all(np.abs(solved - q[:, None]) <= most, axis=0)
            if not np.any(good):
                return None
            farthest = int(np.argmax(good))
            q, share = solved[:, farthest], float(ends[farthest])
        return q

    def _at(self, places: Places, guess: Array, late: int = 0) -> tuple[Array, NDArray[np.bool_]]:
        """Coordinates at some positions, and where they are of the right sense.

        Those that a few rounds do not settle are left to narrower strides: past the end of a branch Newton's method
        wanders as long as it is let, `late` rounds more.
        """
        return self._solved(at(self.elements, places), [lane_of(n, places) for n in self.drive], guess, late)

    def solved_from(self, place: int, guess: Array) -> Array | None:
        """Coordinates at a position, by Newton from a guess, (kept,); None if they are not of the right sense."""
        solved, good = self._at(np.array([place]), guess[:, None], NEAR_LIMIT)
        return solved[:, 0] if good[0] else None

    def broken(self, rows: Array, times: Array) -> list[float]:
        """Times, s, midway between two positions of which one does not lead to the other."""
        steps = np.abs(np.diff(rows, axis=1)) <= limits(self.group, extent(self.group, self.elements))[:, None]
        exist = np.isfinite(rows[0])
        ends = np.flatnonzero((exist[:-1] | exist[1:]) & ~np.all(steps, axis=0))
        return [float(moment) for moment in (times[ends] + times[ends + 1]) / 2]

    def turned_over(self, rows: Array, places: Places, times: Array, near: float) -> float:
        """The time at which det J passes zero between some positions, s, by their 1/condition; else that near by."""
        drive = [lane_of(n, places) for n in self.drive]
        pose = self.group.position(at(self.elements, places), list(rows[:, places]), drive)
        signed: Array = np.broadcast_to(pose.orientation / pose.condition, places.shape)
        rising = signed * np.sign(signed[-1])
        if not np.all(np.diff(rising) > 0.0):
            return near
        return near + float(carried_on(rising, (times[places] - near)[None], 0.0)[0])

    def _solved(
        self, elements: Elements, drive: Sequence[Number], guess: Array, late: int
    ) -> tuple[Array, NDArray[np.bool_]]:
        pose = self.group.position(elements, list(guess), drive, late=late)
        shape = guess.shape[1:]
        solved = np.array([np.broadcast_to(pose.q[i], shape) for i in self.group.kept])
        return solved, np.broadcast_to(pose.orientation, shape) == self.orientation

    def keys(self, rows: Array, places: Places) -> Array:
        """What tells the assembly from others at some positions, (entry, place)."""
        elements = at(self.elements, places)
        pose = self.group.position(elements, list(rows), [lane_of(n, places) for n in self.drive])
        numbers = self.group.signature(pose, extent(self.group, elements))
        return np.array([np.broadcast_to(n, places.shape) for n in numbers])


def _leading(good: NDArray[np.bool_]) -> int:
    """How many are good before the first that is not."""
    return len(good) if good.all() else int(np.argmin(good))


def _mixed(number: Number, here: int, after: int, share: Array) -> Number:
    return number[here] + share * (number[after] - number[here]) if np.ndim(number) else number


def _part(pair: Any, here: int, after: int, share: Array) -> Any:
    """Both elements of a joint part of the way between two positions; axes stay of length one."""
    mixed = each(pair, lambda n: _mixed(n, here, after, share))
    parts: list[Any] = [side.normalised() if hasattr(side, "normalised") else side for side in mixed]
    return type(pair)(*parts) if hasattr(pair, "_fields") else tuple(parts)


def limits(group: Tree, size: float) -> Array:
    """Largest change of each coordinate that an assembly states, between neighbours of the grid, rad or m."""
    most = {"turn": TURN_JUMP, "slide": SLIDE_JUMP * size, "part": TURN_JUMP / 2}
    return np.array([most[kind] for kind in group.kept_kinds])


# ---- the track ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Track:
    """An assembly along the nominal cycle: the coordinates of a general group, or a closed form that goes over to its
    other branch at change points, so that its links move on smoothly.

    times: (grid,) s; coordinates: free ones of the tree, (free, grid), NaN where the group cannot be assembled, none of
    a closed form. orientation: sign of det J, or the branch, at the time `begin`, s. turns: rotations, whole turns
    counted, that gear pairs ask for and the group does not hold, by their place in the drive. ways: frames of its links
    in every assembly found at `begin`, in the order of their names; taken: which of them is followed. passed: times of
    change points, s, at which the sign changes on the smooth way on.
    """

    times: Array
    coordinates: Array
    orientation: float
    periodic: bool
    clock: TrackClock
    turns: Mapping[int, Array]
    begin: float = 0.0
    ways: tuple[Any, ...] = ()
    taken: int = 0
    passed: tuple[float, ...] = ()

    def sense(self, moment: Number) -> Number:
        """Sign of det J, or the branch, at times of the nominal cycle, s."""
        if not self.passed:
            return self.orientation
        again = alternating(self.passed, moment) * float(alternating(self.passed, np.float64(self.begin)))
        return self.orientation * again

    def pose(self, group: Any, elements: Sequence[Any], drive: Sequence[Number], walk: Forward, time: Number) -> Any:
        """Pose, of a general group by Newton from the track; NaN in the lanes that left its branch."""
        moment = primal(self.clock.nominal(walk, time))
        moment = np.mod(moment, self.times[-1]) if self.periodic else moment
        if group.BRANCHES:
            return group.position(elements, self.sense(moment), drive)
        near = np.clip(np.searchsorted(self.times, moment), 1, len(self.times) - 1) if len(self.times) > 1 else 0
        between = _curved if self.passed else _interpolated  # beside a change point a guess must tell assemblies apart
        guess = [between(self.times, row, moment, near) for row in self.coordinates]
        drive = list(drive)
        for slot, row in self.turns.items():
            drive[slot] = _interpolated(self.times, row, moment, near)
        pose = group.position(elements, guess, drive)
        stays = pose.orientation == self.sense(moment)
        if self.passed:  # where assemblies meet, rounding tells the sign: the position is singular, and not open
            stays = stays | (primal(pose.condition) > 1 / TOUCHING)
        size = group.size(elements)
        reach = 4 * limits(group, 1.0)
        for i, kind, most, from_ in zip(group.kept, group.kept_kinds, reach, guess, strict=True):
            stays = stays & (np.abs(primal(pose.q[i]) - from_) < (most * size if kind == "slide" else most))
        if np.all(stays):
            return pose
        hole = np.where(stays, 0.0, np.nan)
        return pose._replace(frames=each(pose.frames, lambda n: n + hole))


class TrackClock(NamedTuple):
    """How a track is read: by a driver of constant speed, and where and how fast that went in the nominal cycle.

    A run at another speed passes the same coordinates at other times. Without such a driver (speed 0) it is read
    by time, in shares of the cycle of the first.
    """

    driver: str
    start: float
    speed: float
    duration: float

    @classmethod
    def of(cls, system: System, values: Values) -> TrackClock:
        """The first driver's of constant speed, else the first one's."""
        drivers = system.mechanism.drivers
        for name in [*(name for name, driver in drivers.items() if driver.law == "constant"), *drivers]:
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


def carried_on(times: Array, rows: Array, time: float) -> Array:
    """Numbers at a time, (row,), by the polynomial through some times, rows (row, time)."""
    apart = times[:, None] - times[None] + np.eye(len(times))
    ahead = np.where(np.eye(len(times), dtype=bool), 1.0, (time - times)[None] / apart)
    return np.asarray(rows @ np.prod(ahead, axis=1))


def alternating(passed: Sequence[float], moment: Number) -> Number:
    """1 at times up to the first of some that rise, then −1 and 1 in turn."""
    signs = 1.0 - 2.0 * (np.arange(len(passed) + 1) % 2)
    return namespace(moment).take(signs, np.searchsorted(np.array(passed), moment))


def _curved(times: Array, row: Array, moment: Array, near: Places | int) -> Array:
    """The cubic through four neighbours of an even grid; linear where one of these does not exist."""
    if len(times) < 4:
        return _interpolated(times, row, moment, near)
    take, first = namespace(moment).take, np.clip(near, 2, len(times) - 2) - 2
    x = (moment - take(times, first)) / (times[1] - times[0])
    y = [take(row, first + k) for k in range(4)]
    cubic = ((1 - x) * (2 - x) * (3 - x) * y[0] - x * (x - 1) * (2 - x) * y[3]) / 6
    cubic = cubic + (x * (2 - x) * (3 - x) * y[1] - x * (1 - x) * (3 - x) * y[2]) / 2
    return np.where(np.isfinite(cubic), cubic, _interpolated(times, row, moment, near))


def _interpolated(times: Array, row: Array, moment: Array, near: Places | int) -> Array:
    """Linear between the grid's neighbours; from the one that exists where the other does not."""
    if len(times) == 1:
        return np.broadcast_to(row[0], np.shape(moment))
    take = namespace(moment).take
    before, after = take(row, near - 1), take(row, near)
    start = take(times, near - 1)
    share = (moment - start) / (take(times, near) - start)
    mixed: Array = before + share * (after - before)
    return np.where(np.isfinite(mixed), mixed, np.where(np.isfinite(before), before, after))
