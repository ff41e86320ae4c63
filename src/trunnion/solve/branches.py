"""Which way a mechanism is put together: a choice stated once, at the start of the cycle, and then carried.

A closed-form group has the branches +1 and −1. A general group is solved at the start from many guesses, the
assembly nearest the hint is taken, and that one is followed along the nominal cycle: the `Track`. Any batch then
starts Newton from the track, all lanes in parallel, and a lane that ends on another branch is not assembled.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.nested import each
from trunnion.errors import Finding, MechanismError, agreeing
from trunnion.groups.gear import NUMBERS, rotation
from trunnion.groups.spatial import SpatialGroup
from trunnion.groups.spins import unspun
from trunnion.groups.tree import OUTER
from trunnion.joints.pairs import PAIRS
from trunnion.model.names import as_key
from trunnion.results.sentences import finding_for
from trunnion.solve import change_points
from trunnion.solve.branch_tracking import Follower, assemblies, at, closing, lane_of, limits
from trunnion.solve.forward import Forward, pose_of, start
from trunnion.solve.hints import distance, first, hints, misnamed, named_way, nth, told_twice
from trunnion.solve.system import Cycle, Dial, Positions, System, Values, driven_coordinates
from trunnion.structure.decompose import Module

__all__ = ["Chosen", "Track", "choose"]

Array = NDArray[np.float64]

GRID = 720  # intervals of one turn of the fastest driver, along which general groups are followed
MOST_INTERVALS = 720_000


@dataclass(frozen=True)
class Track:
    """Free tree coordinates of a general group along the nominal cycle, and the sign of det J on its branch.

    times: (grid,) s; coordinates: (free, grid), NaN where the group cannot be assembled. turns: rotations, whole
    turns counted, that gear pairs ask for and the group does not hold, by their place in the drive. again: places in
    the grid where it was put together anew after it had come apart. ways: frames of its links in every assembly found
    at the time `begin`, s, in the order of their names; taken: which of them is followed.
    """

    times: Array
    coordinates: Array
    orientation: float
    periodic: bool
    clock: TrackClock
    turns: Mapping[int, Array]
    again: Positions
    begin: float = 0.0
    ways: tuple[Any, ...] = ()
    taken: int = 0

    def pose(
        self,
        group: Any,
        elements: Sequence[Any],
        drive: Sequence[Number],
        walk: Forward,
        time: Number,
    ) -> Any:
        """Pose by Newton from the track; NaN in the lanes that left its branch."""
        moment = primal(self.clock.nominal(walk, time))
        moment = np.mod(moment, self.times[-1]) if self.periodic else moment
        near = np.clip(np.searchsorted(self.times, moment), 1, len(self.times) - 1) if len(self.times) > 1 else 0
        guess = [_interpolated(self.times, row, moment, near) for row in self.coordinates]
        drive = list(drive)
        for slot, row in self.turns.items():
            drive[slot] = _interpolated(self.times, row, moment, near)
        pose = group.position(elements, guess, drive)
        stays = pose.orientation == self.orientation
        size = group.size(elements)
        reach = 4 * limits(group, 1.0)
        for i, kind, most, from_ in zip(group.kept, group.kept_kinds, reach, guess, strict=True):
            stays = stays & (np.abs(primal(pose.q[i]) - from_) < (most * size if kind == "slide" else most))
        return pose._replace(frames=_kept(pose.frames, stays))


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
    take = namespace(moment).take
    before, after = take(row, near - 1), take(row, near)
    start = take(times, near - 1)
    share = (moment - start) / (take(times, near) - start)
    mixed: Array = before + share * (after - before)
    return np.where(np.isfinite(mixed), mixed, np.where(np.isfinite(before), before, after))


def _kept(frames: tuple[Any, ...], lanes: Number) -> tuple[Any, ...]:
    if np.all(lanes):
        return frames
    hole = np.where(lanes, 0.0, np.nan)
    return each(frames, lambda n: n + hole)


class Decision(NamedTuple):
    """Assembly of a module, how many there were, whether a name or hint decides, and what there is to say.

    pose: of the module in it at all times, where it was needed to decide.
    """

    assembly: Any
    ways: int
    decided: bool
    findings: Sequence[Finding] = ()
    pose: Any = None


@dataclass(frozen=True)
class Chosen:
    """Assembly of every module (±1, Track, None for a driver), how many there were, and what there is to say.

    meetings: of modules, by their number, the times at which two assemblies meet in the nominal cycle, s.
    """

    assembly: tuple[Any, ...]
    found: tuple[int, ...]
    findings: tuple[Finding, ...]
    meetings: Mapping[int, Sequence[change_points.Meeting]] = field(default_factory=dict)


def choose(system: System, values: Values, cycle: Cycle) -> Chosen:
    """The assembly of every module that is named, or lies nearest the hints at the start, with nominal values.

    Raises MechanismError where a hint names an assembly that there is not.
    """
    if findings := _misnamed(system):
        raise MechanismError(findings)
    intervals = min(GRID * max(1, math.ceil(cycle.turns)), MOST_INTERVALS) if cycle.duration > 0 else 0
    times = np.linspace(0.0, cycle.duration, intervals + 1)
    walk = start(system, values)
    chosen: list[Any] = []
    counts: list[int] = []
    meetings: dict[int, Sequence[change_points.Meeting]] = {}
    with np.errstate(all="ignore"):
        for number, module in enumerate(system.plan.modules):
            group = system.groups[number]
            if module.rank == 1 or not (group.BRANCHES or getattr(group, "kept", ())):  # nothing to choose
                decision = Decision(None, 1, True)
            elif not group.BRANCHES:
                drive, _, _ = driven_coordinates(system, module, system.places[number], values, times)
                decision = _track(walk, number, group, drive, times, cycle.periodic)
            else:
                decision = _branch(walk, number, times)
            assembly, count, decided, said, pose = decision
            findings += said
            if count > 1 and not decided:
                findings.append(_unstated(walk, module, count))
            chosen.append(assembly)
            walk.assembly.append(assembly)
            counts.append(count)
            if isinstance(assembly, Track) and count == 0:
                findings.append(_never(system, module))
            if isinstance(assembly, Track) and len(assembly.again):
                findings.append(_anew(module, system.dial(values, times), assembly.again))
            assembled = module.rank > 1 and (group.BRANCHES or (isinstance(assembly, Track) and count > 0))
            if not assembled and number == len(system.plan.modules) - 1:  # nothing stands on it
                continue
            pose = pose_of(walk, number, assembly, times) if pose is None else pose
            walk.stand(number, pose)  # an assembly is a matter of places
            if assembled and (meeting := change_points.find(walk, number, assembly, times, pose)):
                findings.append(change_points.finding(system, values, module, meeting))
                meetings[number] = meeting
    return Chosen(tuple(chosen), tuple(counts), tuple(findings), meetings)


def _misnamed(system: System) -> list[Finding]:
    """Wrong names of assemblies, of all modules whose number of assemblies is known before they are assembled."""
    found: list[Finding] = []
    for module, group in zip(system.plan.modules, system.groups, strict=True):
        if module.rank == 1 or group.BRANCHES:
            found += misnamed(system, module, len(group.BRANCHES))
    return found


def _unstated(walk: Forward, module: Module, count: int) -> Finding:
    """Where neither a name nor a place decides: there is no hint, or one that does not tell the assemblies apart."""
    system = walk.system
    given = list(dict.fromkeys(name for _, name, _ in hints(walk, module)))
    known = [key for key in system.mechanism.assembly if key in module.joints and key not in given]
    why, names = "no assembly hint selects one", given or known
    if names:
        why = f"the {agreeing(len(names), 'hint', 'hints')} of {' and '.join(names)} "
        why += agreeing(len(names), "does", "do") + " not distinguish them"
        why += "" if given else f": {agreeing(len(names), 'its place is', 'their places are')} the same in all"
    free = [joint for joint in module.joints if joint not in known] or list(module.joints)
    joint = module.joints[len(module.joints) // 2]
    joint = joint if joint in free else free[0]
    key = as_key(joint)
    place, hint = "where a point is", f"{{{key}: [x, y]}}"
    if system.mechanism.space == "spatial":
        met = PAIRS[system.joints[joint][0]].meets and not system.mechanism.loop
        place, hint = (place, f"{{{key}: [x, y, z]}}") if met else ("how far a joint has turned", f"{{{key}: 60 deg}}")
    remedy = f"state roughly {place} at the start, e.g. assembly: {hint}, or one of the names listed by `check`"
    if given:
        remedy = "give a hint that is nearer to one of them, or one of the names listed by `check`"
    phrases = {"why": why, "remedy": remedy}
    return finding_for("assembly.choice", "assembly", links=list(module.links), ways=count, phrases=phrases)


def _anew(module: Module, dial: Dial, positions: Positions) -> Finding:
    return finding_for("assembly.anew", "links", links=list(module.links), at=dial.intervals(positions))


def _never(system: System, module: Module) -> Finding:
    links = list(module.links)
    if not module.redundant:
        return finding_for("assembly.never", "links", links=links)
    if system.mechanism.has_errors:
        return finding_for("assembly.never_rigid", "links", links=links)
    plan, drivers = system.plan, len(system.mechanism.drivers)
    spinning = f" ({len(plan.passive)} of them spins of a single link)" if plan.passive else ""
    return finding_for(
        "assembly.over_constrained", "links", links=links, formula=plan.mobility, drivers=drivers,
        phrases={"spinning": spinning},
    )  # fmt: skip


# ---- closed forms ---------------------------------------------------------------------------------------------


def _branch(walk: Forward, number: int, times: Array) -> Decision:
    """+1 or −1: the one that is named, else the one that the hints by place choose."""
    module = walk.system.plan.modules[number]
    branches = walk.system.groups[number].BRANCHES
    if len(branches) == 1 or not hints(walk, module):
        named = named_way(walk.system, module, len(branches))
        return Decision(branches[named or 0], len(branches), named is not None)
    poses = [pose_of(walk, number, branch, times) for branch in branches]
    placed, decided = _placed(walk, number, times, poses)
    named = named_way(walk.system, module, len(branches))
    way = branches.index(placed)
    if named is None:
        return Decision(placed, len(branches), decided, pose=poses[way])
    told = told_twice(walk, module, named, way if decided else None)
    return Decision(branches[named], len(branches), True, told, poses[named])


def _placed(walk: Forward, number: int, times: Array, poses: Sequence[Any]) -> tuple[int, bool]:
    """+1 or −1 by the hints, and whether they decide it. poses: in either assembly at all times.

    It is the nearer at the start; where it does not close there, the side the hint lies on; where both assemblies
    meet there, in a dead centre, the nearer at the first position at which they do not.
    """
    module = walk.system.plan.modules[number]
    branches = walk.system.groups[number].BRANCHES
    distances = [distance(walk, module, pose.frames, first, first) for pose in poses]
    if not np.all(np.isfinite(distances)) and module.kind == "RRR":
        return _side(walk, number), True
    apart = np.broadcast_to(1 / walk.system.groups[number].condition(poses[0]), times.shape) > change_points.TOUCHING
    for lane in range(len(times)):  # the start if it closes there and the two do not meet, else the first that does
        distances = [distance(walk, module, pose.frames, nth(lane), nth(lane)) for pose in poses]
        if np.all(np.isfinite(distances)) and apart[lane]:
            break
    return branches[0] if not distances[1] < distances[0] else branches[1], _differ(distances)


def _differ(distances: Sequence[Any] | Array) -> bool:
    """Whether the nearest assembly is nearer than the next, but for rounding."""
    least, second = np.sort(np.nan_to_num(np.asarray(distances), nan=np.inf))[:2]
    return bool(second - least > 1e-9 * (second + least))


def _side(walk: Forward, number: int) -> int:
    """Side of the line between the outer pins on which the hinted inner pin lies."""
    module, places = walk.system.plan.modules[number], walk.system.places[number]
    (b, _), _, (d, _) = walk.pairs(places)
    for _, name, place in hints(walk, module):
        if name == module.joints[1] and len(place) == 2:
            x, y = first(b.x), first(b.y)
            side = (first(d.x) - x) * (place[1] - y) - (first(d.y) - y) * (place[0] - x)
            return 1 if side >= 0 else -1
    return 1


# ---- general groups -------------------------------------------------------------------------------------------


def _track(walk: Forward, number: int, group: Any, drive: Sequence[Number], times: Array, periodic: bool) -> Decision:
    """The assembly that is named or nearest the hints, followed both ways from the first position where there is one.

    Where it ends and the links can be assembled again farther on, in the same sense, the assembly nearest to what
    was left is taken there and followed too.
    """
    module, places = walk.system.plan.modules[number], walk.system.places[number]
    elements = walk.pairs(places)
    turns = _turns(walk, module, group, elements, times)
    drive = [turns.get(slot, number) for slot, number in enumerate(drive)]
    grid = len(times)
    rows = np.full((len(group.kept), grid), np.nan)
    clock = TrackClock.of(walk.system, walk.values)
    nowhere = np.array([], np.intp)
    if not group.kept:  # joints without a free coordinate: there is nothing to choose or to follow
        return Decision(Track(times, rows, 1.0, periodic, clock, turns, nowhere), 1, True)
    for begin in _starts(group, elements, drive, grid):
        found = assemblies(group, at(elements, begin), [lane_of(q, begin) for q in drive])
        if found.orientation.size:
            break
    else:
        return Decision(Track(times, rows, 0.0, periodic, clock, turns, nowhere), 0, True)
    ways = len(found.orientation)
    named = named_way(walk.system, module, ways)
    every = np.broadcast_to(distance(walk, module, found.frames, lambda n: n, nth(begin)), (ways,))
    decided, nearest = ways > 1 and _differ(every), int(np.argmin(every))
    best = nearest if named is None else named
    orientation = float(found.orientation[best])
    rows[:, begin] = [found.q[i][best] for i in group.kept]
    follower = Follower(group, elements, drive, orientation)
    follower.both_ways(rows, begin, periodic)
    if getattr(group, "spinning", ()) and not np.all(np.isfinite(rows)):
        # what such a link has spun up to where it is first assembled hangs on the steps back to there: they stay narrow
        follower = replace(follower, leaps=False)
        rows[:, np.arange(grid) != begin] = np.nan
        follower.both_ways(rows, begin, periodic)
    again = follower.revisit(rows, periodic)
    if isinstance(group, SpatialGroup):
        rows = unspun(group, elements, rows, drive)
    track = Track(times, rows, orientation, periodic, clock, turns, again, float(times[begin]), found.frames, best)
    if named is None:
        return Decision(track, ways, decided)
    return Decision(track, ways, True, told_twice(walk, module, named, nearest if decided or ways == 1 else None))


def _turns(walk: Forward, module: Module, group: Any, elements: Sequence[Any], times: Array) -> dict[int, Array]:
    """Rotations of the known joints that gear pairs speak of and nothing drives, followed from that nearest to 0."""
    found = {}
    for i, (name, gear) in enumerate(zip(module.gears, getattr(group, "gears", ()), strict=True)):
        driven = walk.system.gear_joints(name)[0] in walk.system.mechanism.drivers
        if not driven and group.joints[gear.first].sides == (OUTER, OUTER):
            angle = np.broadcast_to(primal(rotation(elements[gear.first])), times.shape)
            solved = np.isfinite(angle)
            unwrapped = np.full(times.shape, np.nan)
            unwrapped[solved] = np.unwrap(angle[solved])
            found[len(group.driven) + NUMBERS * i + NUMBERS - 1] = unwrapped
    return found


def _starts(group: Any, elements: Sequence[Any], drive: Sequence[Number], grid: int) -> Iterator[int]:
    """The start of the cycle, then those of some positions spread over it where the group closes."""
    yield 0
    if grid > 1:
        yield from closing(group, elements, drive, sorted({int(i) for i in np.linspace(0, grid - 1, 25)} - {0}))
