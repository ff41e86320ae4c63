"""How a mechanism is put together: a choice stated once, at the start of the cycle, and then carried.

A closed-form group has the branches +1 and −1. A general group is solved from many guesses at the start, and the one
that is chosen is followed along the nominal cycle (`solve.track`). A hint names an assembly, as `check` lists it, or
states where a point is or how far a joint has moved: then the nearest is taken, at the first position at which the
assemblies are apart. `assembly_modes` lists them at that same position, so that all it tells can be stated as a hint.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number
from trunnion.algebra.nested import each, zipped
from trunnion.errors import Finding, MechanismError, agreeing
from trunnion.groups.gear import NUMBERS, rotation
from trunnion.groups.tree import OUTER, Element
from trunnion.joints.pairs import PAIRS
from trunnion.model.names import as_key
from trunnion.model.parts import FOLDS
from trunnion.results.quantities import quantity
from trunnion.solve import change_points
from trunnion.solve.alike import alike
from trunnion.solve.drawn import drawn_at, hinted_at, off_drawing
from trunnion.solve.forward import Forward, pose_of, start
from trunnion.solve.onward import followed_through, through
from trunnion.solve.system import Cycle, System, Values, driven_coordinates
from trunnion.solve.track import (
    GUESSES,
    SAME,
    STRIDE,
    Assemblies,
    Follower,
    Track,
    TrackClock,
    closed_at,
    each_once,
    extent,
    key_of,
    lane_of,
)
from trunnion.solve.track import at as elements_at
from trunnion.structure.decompose import Module

__all__ = [
    "Chosen", "choose", "coordinate", "distance", "grid", "hints", "joint_rows", "named_way", "way_name",
    "ways_of",
]  # fmt: skip

Array = NDArray[np.float64]
Rows = dict[str, tuple[bool, list[Array]]]  # of a joint: whether by its turn; its numbers in every assembly

GRID = 720  # intervals of one turn of the fastest driver, along which general groups are followed
MOST_INTERVALS = 720_000
NEARER = 1e-9  # of how far it is from a hint, and of the size: an assembly that is nearer by less is as near
LOOKED = 2  # of the grid every which position the assemblies are compared at
TRIED = 64  # guesses at each place where it is tried whether there is an assembly at all
SPREAD = 25  # such places


@dataclass(frozen=True)
class Chosen:
    """Assembly of every module (±1, Track, None for a driver), how many there were, and what there is to say.

    meetings: of modules, by their number, where two assemblies meet in the nominal cycle; mirrored: whether a module is
    in its other assembly after it, so that twice the cycle brings it back.
    """

    assembly: tuple[Any, ...]
    found: tuple[int, ...]
    findings: tuple[Finding, ...]
    meetings: Mapping[int, change_points.Meetings] = field(default_factory=dict)
    mirrored: bool = False


class Decision(NamedTuple):
    """Assembly of a module, how many there were, what there is to say, and the position at which it is so."""

    assembly: Any
    ways: int
    findings: Sequence[Finding] = ()
    lane: int = 0


def choose(system: System, values: Values, cycle: Cycle) -> Chosen:
    """The assembly of every module that its hints name, or that lies nearest to them, with nominal values.

    Raises MechanismError where a hint names an assembly that there is not.
    """
    findings: list[Finding] = []  # wrong names, of all modules whose number of assemblies is known beforehand
    for module, group in zip(system.plan.modules, system.groups, strict=True):
        if module.rank == 1 or group.BRANCHES:
            findings += _misnamed(system, module, len(group.BRANCHES))
    if findings:
        raise MechanismError(findings)
    times = grid(cycle)
    walk = start(system, values)
    drawn = drawn_at(walk, times)
    chosen: list[Any] = []
    counts: list[int] = []
    meetings: dict[int, change_points.Meetings] = {}
    with np.errstate(all="ignore"):
        for number, module in enumerate(system.plan.modules):
            group = system.groups[number]
            if module.rank == 1 or not (group.BRANCHES or getattr(group, "kept", ())):  # nothing to choose
                decision = Decision(None, 1)
            elif group.BRANCHES:
                decision = _closed_form(walk, number, times, drawn)
            else:
                decision = _general(walk, number, times, cycle.periodic, drawn)
            assembly, count, remarks, lane = decision
            findings += remarks
            chosen.append(assembly)
            walk.assembly.append(assembly)
            counts.append(count)
            if isinstance(assembly, Track) and count == 0:
                findings.append(_never(system, module))
            assembled = module.rank > 1 and (group.BRANCHES or (isinstance(assembly, Track) and count > 0))
            if not assembled and number == len(system.plan.modules) - 1:  # nothing stands on it
                continue
            pose = pose_of(walk, number, assembly, times)
            if assembled:
                go = through if group.BRANCHES else followed_through
                chosen[number], met, remarks = go(walk, number, assembly, lane, times, pose, cycle)
                findings += remarks
                if met.at:
                    meetings[number] = met
                if chosen[number] is not assembly:
                    walk.assembly[number] = chosen[number]
                    pose = pose_of(walk, number, chosen[number], times)
            walk.stand(number, pose)  # an assembly is a matter of places
    mirrored = any(len(met.crossed) % 2 and not met.folds for met in meetings.values()) and cycle.periodic
    return Chosen(tuple(chosen), tuple(counts), tuple(findings), meetings, mirrored)


def grid(cycle: Cycle) -> Array:
    """Times, s, at which assemblies are compared and followed."""
    turns = math.ceil(cycle.turns) if math.isfinite(cycle.turns) else 1  # NaN of a motion near the end of the floats
    intervals = min(GRID * max(1, turns), MOST_INTERVALS) if cycle.duration > 0 else 0
    return np.linspace(0.0, cycle.duration, intervals + 1)


# ---- closed forms ---------------------------------------------------------------------------------------------


def _closed_form(walk: Forward, number: int, times: Array, drawn: int | None) -> Decision:
    """+1 or −1: the one that is named, else the one nearest the hints by place, else the one that is drawn."""
    system, module = walk.system, walk.system.plan.modules[number]
    branches = system.groups[number].BRANCHES
    named, count = named_way(system, module, len(branches)), len(branches)
    if drawn is not None and count > 1 and named is None and not hints(walk, module):
        poses = [pose_of(walk, number, branch, times) for branch in branches]
        if len(lanes := _apart(walk, number, poses, times)[1].nonzero()[0]):
            near = int(lanes[np.argmin(np.abs(lanes - drawn))])
            off = [_off_drawing(walk, number, pose, near) for pose in poses]
            if len(tied := _tied(walk, np.array(off))) == 1:
                return Decision(branches[tied[0]], count, (), near)
    lane, frames = ways_of(walk, number, times)
    if count == 1 or not hints(walk, module):
        undecided = [_undecided(walk, module, count)] * (count > 1 and named is None)
        return Decision(branches[named or 0], count, undecided, lane or 0)
    tied = _tied(walk, distance(walk, module, frames, lane or 0)) if lane is not None else [0]
    best = tied[0] if named is None else named
    return Decision(branches[best], count, _said(walk, module, count, frames, lane or 0, named, tied), lane or 0)


def _off_drawing(walk: Forward, number: int, pose: Any, lane: int | NDArray[np.intp]) -> Array:
    """How far a module is from where it is drawn in a pose at a position, or in a lane of many, m²."""
    group = walk.system.groups[number]
    frames = each(pose.frames, lambda part: lane_of(primal(part), lane))
    spun = sorted({link for spin in getattr(group, "spinning", ()) for link in group.spun(*spin)})
    lengths: Iterator[tuple[Number, Number]] = iter(())
    if spun:
        places = each(pose.elements, lambda part: lane_of(primal(part), lane))
        drawn = [
            Element(*(walk.local[link, place.joint] for link in place.links)) for place in walk.system.places[number]
        ]
        lengths = zip(group.unturned(places), group.unturned(drawn), strict=True)
    return off_drawing(walk, frames, spun, list(lengths))


def ways_of(walk: Forward, number: int, times: Array) -> tuple[int | None, Any]:
    """Where the links of a closed form lie in all of its assemblies, and the position at which that is.

    It is the first, or nearest to where the hints hold, at which all assemblies exist and are apart; where they meet
    all along, at which they exist; None if there is none.
    """
    poses = [pose_of(walk, number, branch, times) for branch in walk.system.groups[number].BRANCHES]
    exist, differ = _apart(walk, number, poses, times)
    apart = np.flatnonzero(differ[::LOOKED]) * LOOKED
    lanes = apart if len(apart) else np.flatnonzero(exist)
    lane = int(lanes[np.argmin(np.abs(lanes - hinted_at(walk, times)))]) if len(lanes) else None
    frames = [each(pose.frames, lambda part: lane_of(primal(part), lane or 0)) for pose in poses]
    return lane, zipped(lambda *numbers: np.array(numbers), *frames)


def _apart(
    walk: Forward, number: int, poses: Sequence[Any], times: Array
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """At which times all poses of a module exist, and are apart."""
    spread = float(np.max(primal(walk.size)))
    shape = times.shape
    keys = [
        np.array([np.broadcast_to(primal(n), shape) for n in key_of(walk.system.groups[number], pose, spread)])
        for pose in poses
    ]
    exist = np.asarray(np.isfinite(keys).all(axis=(0, 1)))
    return exist, exist & (np.ptp(keys, axis=0).max(axis=0) > SAME)


# ---- general groups -------------------------------------------------------------------------------------------


def _general(walk: Forward, number: int, times: Array, periodic: bool, drawn: int | None) -> Decision:
    """The assembly that is named, nearest the hints or drawn, followed both ways from the first position with any."""
    system, module = walk.system, walk.system.plan.modules[number]
    group, places, grid = system.groups[number], system.places[number], len(times)
    drive, _, _ = driven_coordinates(system, module, places, walk.values, times)
    elements = walk.pairs(places)
    turns = _turns(walk, module, group, elements, times)
    drive = [turns.get(slot, number) for slot, number in enumerate(drive)]
    rows = np.full((len(group.kept), grid), np.nan)
    clock, nowhere = TrackClock.of(system, walk.values), np.array([], np.intp)
    begin, solved = _first_closed(group, elements, drive, grid, hinted_at(walk, times))
    lanes = each_once(group, solved)
    sets = alike(walk, number, solved, lanes)
    ways, set_of = len(sets), {place: k for k, places in enumerate(sets) for place in places}
    if not ways:
        return Decision(Track(times, rows, 0.0, periodic, clock, turns, nowhere), 0)
    shape = solved.closed.shape
    frames = each(solved.pose.frames, lambda n: np.broadcast_to(n, shape)[lanes])
    named = named_way(system, module, ways)
    nearest = _tied(walk, np.broadcast_to(distance(walk, module, frames, begin), (len(lanes),)))
    if drawn is not None and named is None and not hints(walk, module):
        follower = Follower(group, elements, drive, 0.0, STRIDE)
        nearest = _drawn(walk, number, follower, solved, lanes, begin, drawn, grid, periodic) or nearest
    best = nearest[0] if named is None else sets[named][0]
    chosen_set, tied = set_of[best], sorted({set_of[place] for place in nearest})
    shows = [best if k == chosen_set else places[0] for k, places in enumerate(sets)]
    frames = each(frames, lambda n: n[shows])
    orientation = float(np.broadcast_to(solved.pose.orientation, shape)[lanes[best]])
    rows[:, begin] = solved.q[:, lanes[best]]
    follower = Follower(group, elements, drive, orientation, STRIDE)
    follower.both_ways(rows, begin, periodic)
    if getattr(group, "spinning", ()) and not np.all(np.isfinite(rows)):
        # what such a link has spun up to where it is first assembled hangs on the steps back to there: they stay narrow
        follower = replace(follower, stride=1)
        rows[:, np.arange(grid) != begin] = np.nan
        follower.both_ways(rows, begin, periodic)
    track = Track(times, rows, orientation, periodic, clock, turns, nowhere, float(times[begin]), frames, chosen_set)
    return Decision(track, ways, _said(walk, module, ways, frames, begin, named, tied))


def _drawn(
    walk: Forward, number: int, follower: Follower, solved: Assemblies, lanes: Sequence[int], begin: int, drawn: int,
    grid: int, periodic: bool,
) -> list[int]:  # fmt: skip
    """Of the assemblies at a position, by their lanes, that which leads to where links are drawn; none if none does.

    It is the nearest where the drivers are as drawn, followed from there.
    """
    group, arrived, lanes_there = follower.group, solved, list(lanes)
    if drawn != begin:
        arrived = closed_at(group, follower.elements, follower.drive, [drawn], GUESSES)
        lanes_there = each_once(group, arrived)
    if not lanes_there:
        return []
    shape = arrived.closed.shape
    frames = each(arrived.pose.frames, lambda n: np.broadcast_to(primal(n), shape))
    off = _off_drawing(walk, number, arrived.pose._replace(frames=frames), np.array(lanes_there))
    nearest = _tied(walk, np.broadcast_to(off, (len(lanes_there),)))
    if len(nearest) > 1 or drawn == begin:
        return nearest if len(nearest) == 1 else []
    lane, index = lanes_there[nearest[0]], np.array([begin])
    follower = replace(follower, orientation=float(np.broadcast_to(arrived.pose.orientation, shape)[lane]))
    elements, drive = elements_at(follower.elements, index), [lane_of(n, index) for n in follower.drive]
    direction = 1 if begin > drawn else -1
    orders = [np.arange(drawn, begin + direction, direction)]
    if periodic:  # the last position of the grid is the first
        orders.append(np.arange(drawn, begin - direction * grid, -direction) % (grid - 1))
    for order in orders:
        rows = np.full((len(group.kept), grid), np.nan)
        rows[:, drawn] = arrived.q[:, lane]
        follower.run(rows, order)
        pose = group.position(elements, list(rows[:, index]), drive)
        key = np.array([np.ravel(n)[0] for n in key_of(group, pose, extent(group, elements))])
        if same := [k for k, other in enumerate(lanes) if np.max(np.abs(solved.key[:, other] - key)) < SAME]:
            return same[:1]
    return []


def _first_closed(
    group: Any, elements: Sequence[Any], drive: Sequence[Number], grid: int, first: int
) -> tuple[int, Assemblies]:
    """A position, else the nearest of some spread over the cycle at which the group has an assembly."""
    solved = closed_at(group, elements, drive, [first], GUESSES)
    if each_once(group, solved) or grid == 1:
        return first, solved
    places = np.unique(np.linspace(0, grid - 1, SPREAD).astype(np.intp))
    places = places[np.argsort(np.abs(places - first), kind="stable")]
    tried = closed_at(group, elements, drive, places, TRIED).closed.reshape(-1, TRIED)
    for place in places[tried.any(axis=1)]:
        solved = closed_at(group, elements, drive, [int(place)], GUESSES)
        if each_once(group, solved):
            return int(place), solved
    return first, solved


def _turns(walk: Forward, module: Module, group: Any, elements: Sequence[Any], times: Array) -> dict[int, Array]:
    """Rotations of the known joints that gear pairs speak of and nothing drives, followed from that nearest to 0."""
    turns = {}
    for i, (name, gear) in enumerate(zip(module.gears, getattr(group, "gears", ()), strict=True)):
        driven = walk.system.gear_joints(name)[0] in walk.system.mechanism.drivers
        if not driven and gear.slide != 0 and group.joints[gear.first].sides == (OUTER, OUTER):
            angle = np.broadcast_to(primal(rotation(elements[gear.first])), times.shape)
            solved = np.isfinite(angle)
            unwrapped = np.full(times.shape, np.nan)
            unwrapped[solved] = np.unwrap(angle[solved])
            turns[len(group.driven) + NUMBERS * i + NUMBERS - 1] = unwrapped
    return turns


# ---- hints ----------------------------------------------------------------------------------------------------


def way_name(index: int) -> str:
    """The name of an assembly, as `check` lists it and a hint may choose it."""
    return f"way-{index + 1}"


def _names(system: System, module: Module) -> dict[str, str]:
    """The hints that name an assembly of a module, by link."""
    hints_stated = system.mechanism.assembly
    return {
        key: hint
        for key, hint in hints_stated.items()
        if key in module.links and isinstance(hint, str) and hint != FOLDS
    }


def named_way(system: System, module: Module, count: int) -> int | None:
    """Which of `count` assemblies of a module its hints name, from 0 on; None if none does.

    Raises MechanismError if there is no such assembly.
    """
    if findings := _misnamed(system, module, count):
        raise MechanismError(findings)
    return next((_number(name) for name in _names(system, module).values()), None)


def _number(name: str) -> int:
    """The place of an assembly, from 0 on, by its name."""
    return int(name.partition("-")[2]) - 1


def _misnamed(system: System, module: Module, count: int) -> list[Finding]:
    """What is wrong with the hints that name one of `count` assemblies of a module."""
    findings: list[Finding] = []
    named = _names(system, module)
    links = f"the link {module.links[0]} has" if len(module.links) == 1 else f"the links {', '.join(module.links)} have"
    ways = ", ".join(way_name(i) for i in range(count))
    for key, name in named.items():
        first = next(iter(named))
        if module.rank == 1:
            what = f"the link '{key}' follows the driver {module.driven[0]}: it has only one assembly mode"
            findings.append(Finding(what, f"assembly.{key}", "remove it"))
        elif _number(name) >= count:
            remedy = f"the modes are {ways}; without this line `check` shows them" if count else "check the lengths"
            findings.append(Finding(f"{links} no assembly mode '{name}'", f"assembly.{key}", remedy))
        elif name != named[first]:
            what = f"'{name}' contradicts '{named[first]}' of the link '{first}', which is in the same group"
            findings.append(Finding(what, f"assembly.{key}", "state the assembly mode of a group for one of its links"))
    return findings


def hints(walk: Forward, module: Module) -> list[tuple[str, str, tuple[Number, ...]]]:
    """(link, point, place) or ("", joint, (angle or slide,)) of the hints that tell assemblies of a module apart."""
    rows: list[tuple[str, str, tuple[Number, ...]]] = []
    for key in walk.system.mechanism.assembly:
        path = f"assembly.{key}"
        if f"{path}.x" in walk.values:
            link, name = _point_of(walk.system, module, key)
            if link:
                place = tuple(walk.values[f"{path}.{axis}"] for axis in "xyz" if f"{path}.{axis}" in walk.values)
                rows.append((link, name, place))
        elif key in module.joints:
            rows.append(("", key, (walk.values[path],)))
    return rows


def _point_of(system: System, module: Module, key: str) -> tuple[str, str]:
    """The link of the module that carries the hinted point, if the place of the point is not known without it."""
    if key in system.joints:
        kind, links = system.joints[key]
        inside = [link for link in links if link in module.links]
        settled = key in module.joints and PAIRS[kind].meets and len(inside) == 1
        return ("", "") if not inside or settled else (inside[-1], key)
    link, _, name = key.partition(".")
    return (link, name) if link in module.links else ("", "")


def distance(walk: Forward, module: Module, frames: Sequence[Any], lane: int | None = None) -> Array:
    """Sum of the squared distances of an assembly from the hints, m² and rad².

    frames: of the module's links, at the position `lane` of the walk; None if at all of them.
    """
    total: Any = 0.0
    for link, name, place in hints(walk, module):
        if link:
            i = module.links.index(link)
            total = total + _away(walk, module, frames, i, walk.placed(frames[i], link, name), place)
            continue
        away = coordinate(walk, module, frames, name, lane) - place[0]
        total = total + (np.arctan2(np.sin(away), np.cos(away)) if walk.system.turns(name) else away) ** 2
    return np.asarray(total, float)


def _away(
    walk: Forward, module: Module, frames: Sequence[Any], link: int, point: Sequence[Number], place: Sequence[Number]
) -> Number:
    """Squared distance of a point of a link from a place, m²; of a link that spins freely the least while it spins."""
    group = walk.system.groups[walk.system.plan.modules.index(module)]
    spins = [(group.spun(*spin), spin[1:]) for spin in getattr(group, "spinning", ())]
    of_link = [spin for spin in spins if link in spin[0]]
    if of_link:
        members, ends = min(of_link, key=lambda spin: len(spin[0]))
        elements = {}
        for k in ends:
            i = next(side for side in group.joints[k].sides if side in members)
            element = walk.algebra.compose(frames[i], walk.local[module.links[i], module.joints[k]])
            elements[k] = Element(element, element)
        point, place = (group.from_line(elements, *ends, at) for at in (point, place))
    return sum((is_ - hinted) ** 2 for is_, hinted in zip(point, place, strict=True))


def coordinate(walk: Forward, module: Module, frames: Sequence[Any], joint: str, lane: int | None) -> Number:
    """Turn or slide of a joint of a module whose links lie in these frames."""

    def element(link: str) -> Any:
        if link in module.links:
            return walk.algebra.compose(frames[module.links.index(link)], walk.local[link, joint])
        outer = walk.element(link, joint)
        return outer if lane is None else each(outer, lambda n: lane_of(n, lane))

    first, second = walk.system.joints[joint][1]
    return walk.coordinate(joint, element(first), element(second))


def _tied(walk: Forward, distances: Array) -> list[int]:
    """The assemblies that are as near the hints as the nearest, but for rounding. distances: m² and rad²."""
    away = np.sqrt(np.nan_to_num(distances, nan=np.inf))
    least = np.min(away)
    return np.flatnonzero(away <= least + NEARER * (least + np.max(primal(walk.size)))).tolist()


# ---- what there is to say -------------------------------------------------------------------------------------


def _said(
    walk: Forward, module: Module, count: int, frames: Any, lane: int, named: int | None, tied: Sequence[int]
) -> list[Finding]:
    """Of an assembly among `count` that is chosen by name, or as one of those that are nearest the hints."""
    if named is not None:
        return _told_twice(walk, module, named, tied[0] if len(tied) == 1 else None)
    if len(tied) == 1:
        return []
    return [_undecided(walk, module, count, tied, _difference(walk, module, count, frames, lane, tied))]


def _difference(walk: Forward, module: Module, count: int, frames: Any, lane: int, ways: Sequence[int]) -> str:
    """Where a joint that tells some assemblies apart is in each of them."""
    size = float(np.max(primal(walk.size)))
    for joint, (turned, numbers) in joint_rows(walk, module, count, frames, lane).items():
        rows = np.array(numbers)[:, ways]
        compared = np.concatenate([np.cos(rows), np.sin(rows)]) if turned else rows / size
        if np.max(np.ptp(compared, axis=1)) > SAME:
            places = [", ".join(quantity(part, "rad" if turned else "m") for part in place) for place in rows.T]
            brackets = "({})" if len(rows) > 1 else "{}"
            texts = [f"{brackets.format(place)} in {way_name(mode)}" for place, mode in zip(places, ways, strict=True)]
            return f": {joint} is at {', '.join(texts)}"
    return ""


def joint_rows(walk: Forward, module: Module, count: int, frames: Sequence[Any], lane: int) -> Rows:
    """The joints of a module, each as a hint can state it: whether that is its turn, and its numbers in every assembly.

    In space a joint that turns about an axis is told by its turn, known links included, others between two links of the
    module by the place of their point, or their slide.
    """
    spatial = walk.system.mechanism.space == "spatial"
    group = walk.system.groups[walk.system.plan.modules.index(module)]
    spins = [({module.links[i] for i in group.spun(*spin)}, spin[1:]) for spin in getattr(group, "spinning", ())]
    rows: Rows = {}
    for name in sorted(set(module.joints).difference(module.driven), key=walk.system.order.__getitem__):
        kind, links = walk.system.joints[name]
        turned = spatial and PAIRS[kind].turns and not PAIRS[kind].ball
        if not turned and not set(links).issubset(module.links):
            continue
        turns_with = [members.issuperset(links) and not turned and not PAIRS[kind].guided for members, _ in spins]
        if any(turns_with) or any(module.joints.index(name) in ends and not PAIRS[kind].ball for _, ends in spins):
            continue  # where a spin has taken it tells nothing
        if turned or PAIRS[kind].guided:
            numbers = [coordinate(walk, module, frames, name, lane)]
        else:
            numbers = list(walk.placed(frames[module.links.index(links[-1])], links[-1], name))
        rows[name] = turned, [np.broadcast_to(primal(n), (count,)) for n in numbers]
    return rows


def _told_twice(walk: Forward, module: Module, named: int, placed: int | None) -> list[Finding]:
    """Of an assembly that is chosen by name and by place. placed: the one that the place chooses."""
    places = [name for _, name, _ in hints(walk, module)]
    if not places:
        return []
    links, (key, name) = list(module.links), next(iter(_names(walk.system, module).items()))
    where = f"assembly.{key}"
    if placed is None or placed == named:
        what = f"the assembly mode of the links {', '.join(links)} is stated by name and by the place of "
        what += f"{', '.join(places)}"
        return [Finding.note("assembly.told_twice", where, what, "one is enough", links=links, places=places)]
    mode = way_name(placed)
    what = f"the assembly mode of the links {', '.join(links)} is stated by name, {name}, and by the place of "
    what += f"{', '.join(places)}, which means {mode}; the name is used"
    figures = {"links": links, "places": places, "way": mode, "name": name}
    return [Finding.warning("assembly.contradiction", where, what, "remove one of the two", **figures)]


def _undecided(walk: Forward, module: Module, count: int, tied: Sequence[int] = (), difference: str = "") -> Finding:
    """Where neither a name nor a place decides: there is no hint, or one that does not tell the assemblies apart.

    tied: those that it does not tell apart, of which the first is used; difference: what does.
    """
    system = walk.system
    hinted = list(dict.fromkeys(name for _, name, _ in hints(walk, module)))
    unhinted = [key for key in system.mechanism.assembly if key in module.joints and key not in hinted]
    why, names = "no assembly hint selects one", hinted or unhinted
    if names:
        why = f"the {agreeing(len(names), 'hint', 'hints')} of {' and '.join(names)} "
        them = "them" if len(tied) in (0, count) else " and ".join(way_name(mode) for mode in tied)
        why += f"{agreeing(len(names), 'does', 'do')} not distinguish {them}"
        why += difference if hinted else f": {agreeing(len(names), 'its place is', 'their places are')} the same in all"
    free = [joint for joint in module.joints if joint not in unhinted] or list(module.joints)
    joint = module.joints[len(module.joints) // 2]
    joint = joint if joint in free else free[0]
    key = as_key(joint)
    place, hint = "where a point is", f"{{{key}: [x, y]}}"
    if system.mechanism.space == "spatial":
        met = PAIRS[system.joints[joint][0]].meets and not system.mechanism.loop
        place, hint = (place, f"{{{key}: [x, y, z]}}") if met else ("how far a joint has turned", f"{{{key}: 60 deg}}")
    remedy = f"state roughly {place} at the start, e.g. assembly: {hint}, or one of the names listed by `check`"
    if hinted:
        remedy = "give a hint that is nearer to one of them, or one of the names listed by `check`"
    links, used = list(module.links), way_name(tied[0]) if tied else "the first one"
    what = f"links {', '.join(links)} have {count} assembly modes and {why}; {used} is used"
    return Finding.warning("assembly.choice", "assembly", what, remedy, links=links, ways=count)


def _never(system: System, module: Module) -> Finding:
    links = list(module.links)
    if not module.redundant:
        what = f"links {', '.join(links)} cannot be assembled at any position of the cycle"
        remedy = "check the lengths, or give a better assembly hint"
        return Finding.warning("assembly.never", "links", what, remedy, links=links)
    if system.mechanism.has_errors:
        what = f"links {', '.join(links)} with their errors do not close as rigid parts at any position of the cycle"
        remedy = "they need play to fit together: see `trunnion assemble FILE` for how much"
        return Finding.warning("assembly.never_rigid", "links", what, remedy, links=links)
    plan, drivers = system.plan, len(system.mechanism.drivers)
    spinning = f" ({len(plan.passive)} of them passive)" if plan.passive else ""
    what = f"links {', '.join(links)} cannot be assembled at any position of the cycle; the mobility is "
    what += f"{plan.mobility} by Grübler's formula{spinning} and the number of drivers {drivers}"
    remedy = "check the lengths, or give a better assembly hint; so many constraints are consistent with special "
    remedy += "dimensions only: remove a driver or free a joint"
    figures = {"links": links, "formula": plan.mobility, "drivers": drivers}
    return Finding.warning("assembly.over_constrained", "links", what, remedy, **figures)
