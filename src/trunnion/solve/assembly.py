"""How a mechanism is put together: a choice stated once, at the start of the cycle, and then carried.

A closed-form group has the branches +1 and −1. A general group is solved from many guesses at the start, and the one
that is chosen is followed along the nominal cycle (`solve.track`), through its change points (`solve.change_points`).
A hint by place takes the nearest, at the first position at which the assemblies are apart. `assembly_modes` lists them
at that same position, so that all it tells can be stated as a hint (`solve.hints`).
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import each, zipped
from trunnion.errors import Finding, MechanismError
from trunnion.groups.gear import NUMBERS, rotation
from trunnion.groups.spatial import SpatialGroup
from trunnion.groups.tree import OUTER
from trunnion.solve.change_points import Meetings, followed_through, through
from trunnion.solve.forward import Forward, pose_of, start
from trunnion.solve.hints import (
    distance,
    drawn_at,
    hinted_at,
    hints,
    misnamed,
    named_way,
    off_drawing,
    remarks,
    spun_sets,
)
from trunnion.solve.system import Cycle, System, Values, driven_coordinates
from trunnion.solve.track import (
    GUESSES,
    SAME,
    Assemblies,
    Follower,
    Track,
    TrackClock,
    closed_at,
    each_once,
    extent,
    lane_of,
)
from trunnion.structure.decompose import Module

Array = NDArray[np.float64]

GRID = 720  # intervals of one turn of the fastest driver, along which general groups are followed
MOST_INTERVALS = 720_000
NEARER = 1e-9  # of how far it is from a hint, and of the size: an assembly that is nearer by less is as near
LOOKED = 2  # of the grid every which position the assemblies are compared at
TRIED = 64  # guesses at each place where it is tried whether there is an assembly at all
SPREAD = 25  # such places
SPEAKS = ("loads", "springs", "measures", "gears", "errors", "tolerances", "costs")  # sections that may name a link


@dataclass(frozen=True)
class Chosen:
    """Assembly of every module (±1, Track, None for a driver), how many there were, and what there is to say.

    meetings: of modules, by their number, where two assemblies meet in the nominal cycle; mirrored: whether a module is
    in its other assembly after it, so that twice the cycle brings it back.
    """

    assembly: tuple[Any, ...]
    found: tuple[int, ...]
    findings: tuple[Finding, ...]
    meetings: Mapping[int, Meetings] = field(default_factory=dict)
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
            findings += misnamed(system, module, len(group.BRANCHES))
    if findings:
        raise MechanismError(findings)
    times = grid(cycle)
    walk = start(system, values)
    drawn = drawn_at(walk, times)
    chosen: list[Any] = []
    counts: list[int] = []
    meetings: dict[int, Meetings] = {}
    with np.errstate(all="ignore"):
        for number, module in enumerate(system.plan.modules):
            group = system.groups[number]
            if module.rank == 1 or not (group.BRANCHES or getattr(group, "kept", ())):  # nothing to choose
                decision = Decision(None, 1)
            elif group.BRANCHES:
                decision = _closed_form(walk, number, times, drawn)
            else:
                decision = _general(walk, number, times, cycle.periodic, drawn)
            assembly, count, said, lane = decision
            findings += said
            chosen.append(assembly)
            walk.assembly.append(assembly)
            counts.append(count)
            if isinstance(assembly, Track) and count == 0:
                findings.append(_never(module))
            assembled = module.rank > 1 and (group.BRANCHES or (isinstance(assembly, Track) and count > 0))
            if not assembled and number == len(system.plan.modules) - 1:  # nothing stands on it
                continue
            pose = pose_of(walk, number, assembly, times)
            if assembled:
                go = through if group.BRANCHES else followed_through
                chosen[number], met, said = go(walk, number, assembly, lane, times, pose, cycle)
                findings += said
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


def _tied(walk: Forward, distances: Array) -> list[int]:
    """The assemblies that are as near as the nearest, but for rounding. distances: m² and rad²."""
    away = np.sqrt(np.nan_to_num(distances, nan=np.inf))
    least = np.min(away)
    return np.flatnonzero(away <= least + NEARER * (least + np.max(primal(walk.size)))).tolist()


# ---- closed forms ---------------------------------------------------------------------------------------------


def _closed_form(walk: Forward, number: int, times: Array, drawn: int | None) -> Decision:
    """+1 or −1: the one that is named, else the one nearest the hints by place, else the one that is drawn."""
    system, module = walk.system, walk.system.plan.modules[number]
    branches = system.groups[number].BRANCHES
    named, count, hinted = named_way(system, module, len(branches)), len(branches), hints(walk, module)
    if drawn is not None and count > 1 and named is None and not hinted:
        poses = [pose_of(walk, number, branch, times) for branch in branches]
        if len(lanes := _apart(walk, number, poses, times)[1].nonzero()[0]):
            near = int(lanes[np.argmin(np.abs(lanes - drawn))])
            off = [off_drawing(walk, number, pose, near) for pose in poses]
            if len(tied := _tied(walk, np.array(off))) == 1:
                return Decision(branches[tied[0]], count, (), near)
    lane, frames = ways_of(walk, number, times)
    if count == 1 or not hinted:
        said = remarks(walk, module, count, named) if count > 1 else []
        return Decision(branches[named or 0], count, said, lane or 0)
    tied = _tied(walk, distance(walk, module, frames, lane or 0)) if lane is not None else [0]
    said = remarks(walk, module, count, named, tied)
    return Decision(branches[tied[0] if named is None else named], count, said, lane or 0)


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
    spread, shape = float(np.max(primal(walk.size))), times.shape
    rows = (walk.system.groups[number].signature(pose, spread) for pose in poses)
    keys = [np.array([np.broadcast_to(primal(n), shape) for n in numbers]) for numbers in rows]
    exist = np.asarray(np.isfinite(keys).all(axis=(0, 1)))
    return exist, exist & (np.ptp(keys, axis=0).max(axis=0) > SAME)


# ---- general groups -------------------------------------------------------------------------------------------


def _general(walk: Forward, number: int, times: Array, periodic: bool, drawn: int | None) -> Decision:
    """The assembly that is named, nearest the hints or drawn, followed both ways from the first position with any."""
    system, module = walk.system, walk.system.plan.modules[number]
    group, places, count = system.groups[number], system.places[number], len(times)
    elements = walk.pairs(places)
    turns = _turns(walk, module, group, elements, times)
    drive, _, _ = driven_coordinates(system, module, places, walk.values, times)
    follower = Follower(group, elements, [turns.get(slot, number) for slot, number in enumerate(drive)], 0.0)
    rows, clock = np.full((len(group.kept), count), np.nan), TrackClock.of(system, walk.values)
    begin, solved = _first_closed(follower, count, hinted_at(walk, times))
    lanes = each_once(group, solved)
    sets = _alike(walk, number, solved, lanes)
    ways, set_of = len(sets), {place: k for k, members in enumerate(sets) for place in members}
    if not ways:
        return Decision(Track(times, rows, 0.0, periodic, clock, turns), 0)
    shape = solved.closed.shape
    frames = each(solved.pose.frames, lambda n: np.broadcast_to(n, shape)[lanes])
    named = named_way(system, module, ways)
    nearest = _tied(walk, np.broadcast_to(distance(walk, module, frames, begin), (len(lanes),)))
    if drawn is not None and named is None and not hints(walk, module):
        nearest = _drawn(walk, number, follower, solved, lanes, begin, drawn, count, periodic) or nearest
    best = nearest[0] if named is None else sets[named][0]
    chosen_set, tied = set_of[best], sorted({set_of[place] for place in nearest})
    shows = [best if k == chosen_set else members[0] for k, members in enumerate(sets)]
    frames = each(frames, lambda n: n[shows])
    orientation = float(np.broadcast_to(solved.pose.orientation, shape)[lanes[best]])
    rows[:, begin] = solved.q[:, lanes[best]]
    follower = replace(follower, orientation=orientation)
    follower.both_ways(rows, begin, periodic)
    if getattr(group, "spinning", ()) and not np.all(np.isfinite(rows)):
        # what such a link has spun up to where it is first assembled hangs on the steps back to there: they stay narrow
        rows[:, np.arange(count) != begin] = np.nan
        replace(follower, stride=1).both_ways(rows, begin, periodic)
    track = Track(times, rows, orientation, periodic, clock, turns, float(times[begin]), frames, chosen_set)
    return Decision(track, ways, remarks(walk, module, ways, named, tied))


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
    off = off_drawing(walk, number, arrived.full(), np.array(lanes_there))
    nearest = _tied(walk, np.broadcast_to(off, (len(lanes_there),)))
    if len(nearest) > 1 or drawn == begin:
        return nearest if len(nearest) == 1 else []
    lane = lanes_there[nearest[0]]
    follower = replace(follower, orientation=float(arrived.full().orientation[lane]))
    direction = 1 if begin > drawn else -1
    orders = [np.arange(drawn, begin + direction, direction)]
    if periodic:  # the last position of the grid is the first
        orders.append(np.arange(drawn, begin - direction * grid, -direction) % (grid - 1))
    for order in orders:
        rows = np.full((len(group.kept), grid), np.nan)
        rows[:, drawn] = arrived.q[:, lane]
        follower.run(rows, order)
        key = follower.keys(rows[:, [begin]], np.array([begin]))[:, 0]
        if same := [k for k, other in enumerate(lanes) if np.max(np.abs(solved.key[:, other] - key)) < SAME]:
            return same[:1]
    return []


def _first_closed(follower: Follower, grid: int, first: int) -> tuple[int, Assemblies]:
    """A position, else the nearest of some spread over the cycle at which the group has an assembly."""
    group, elements, drive = follower.group, follower.elements, follower.drive
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


# ---- assemblies that move alike -------------------------------------------------------------------------------


def _alike(walk: Forward, number: int, solved: Assemblies, lanes: Sequence[int]) -> list[list[int]]:
    """Places among some lanes that hold a module's assemblies, those that move alike together, in their order.

    In one of these a plain link, as a leg between two points, is turned half round. What it does is done by the places
    of its joints and the lines of their axes: it has no mass, no other points, and nothing in the model speaks of it.
    """
    group = walk.system.groups[number]
    spun = {member for members, _ in spun_sets(group) for member in members}
    plain = _plain(walk, walk.system.plan.modules[number]) - spun if isinstance(group, SpatialGroup) else set()
    if not plain:
        return [[place] for place in range(len(lanes))]
    pose, spread = solved.pose, extent(group, solved.pose.elements)
    numbers: list[Any] = [n / spread for n in group.unturned(pose.elements)]
    for link, frame in enumerate(pose.frames):
        if link not in plain and link not in spun:
            numbers += [*frame.x, *frame.y, *frame.z, *(n / spread for n in frame.place)]
    for k, joint in enumerate(group.joints):
        for side in (0, 1):
            if joint.sides[side] in plain:
                element = pose.elements[k][side]
                numbers += [n / spread for n in element.place]
                if not joint.pair.ball:
                    numbers += [element.z[i] * element.z[j] for i in range(3) for j in range(i, 3)]
    outlines = np.array([np.broadcast_to(primal(n), solved.closed.shape)[lanes] for n in numbers], float)
    sets: list[list[int]] = []
    for place, outline in enumerate(outlines.T):
        same = [members for members in sets if np.max(np.abs(outlines[:, members[0]] - outline)) <= SAME]
        if same:
            same[0].append(place)
        else:
            sets.append([place])
    return sets


def _plain(walk: Forward, module: Module) -> set[int]:
    """The plain links of a module."""
    mechanism, plain = walk.system.mechanism, set[int]()
    data = mechanism.data()
    numbers = [name for name, hint in mechanism.assembly.items() if not isinstance(hint, tuple)]
    spoken = set(re.findall(r"[\w-]+", json.dumps([[data.get(name) for name in SPEAKS], numbers], default=str)))
    for i, name in enumerate(module.links):
        link = mechanism.effective_links[name]
        joints = {key: joint for key, joint in walk.system.joints.items() if name in joint.links}
        bare = link.mass.source == 0 and "inertia" not in link.model_fields_set and set(link.points) <= joints.keys()
        inside = joints.keys() <= set(module.joints) and spoken.isdisjoint({name, *joints})
        shifted = any(joint.pin is not None and joint.pin.offset is not None for joint in joints.values())
        if bare and inside and not shifted and not mechanism.loop:
            plain.add(i)
    return plain


def _never(module: Module) -> Finding:
    """Of a module that has no assembly."""
    links = list(module.links)
    what = f"links {', '.join(links)} cannot be assembled at any position of the cycle"
    remedy = "check the lengths, or give a better assembly hint"
    if module.redundant:
        what += "; with more constraints than freedoms they fit together with special dimensions or with play only"
        remedy += "; see `trunnion assemble FILE` for how much play they need, or remove a driver or free a joint"
    return Finding.warning("assembly.never", "links", what, remedy, links=links)
