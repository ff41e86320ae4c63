"""Change points: positions where two assemblies of a module meet, and lengths do not say which way it goes on.

The links of a linkage that moves go on smoothly, as their momentum would have it: past a change point an assembly is
the one to which the positions before it lead, unless the group is stated to fold. A closed form goes over to its other
assembly where its own has a kink; a general group is followed on with the other sign of det J.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.errors import Finding
from trunnion.groups.spatial import SpatialGroup, unspun
from trunnion.model.names import as_key
from trunnion.model.parts import FOLDS
from trunnion.solve.forward import Forward, pose_of, posed
from trunnion.solve.system import Cycle, System, driven_coordinates
from trunnion.solve.track import SAME, TOUCHING, Follower, Track, TrackClock, carried_on
from trunnion.structure.decompose import Module

Array = NDArray[np.float64]

Meeting = tuple[float, float]  # first and last time, s
ROW = 3  # positions of the grid at which two assemblies meet: no single place
SECTIONS, GOLDEN = 60, (np.sqrt(5) - 1) / 2
LOOKED = 0.25  # of an interval of the grid: from one to the next of the places before a change point
CLOSE = 1e-3  # of an interval: from where on both sides it is located
SAME_PLACE = 1e-7  # of the cycle
BEFORE = 4  # positions before a change point that lead over it
SMOOTH = 0.1  # of the last change: by how much the way on beyond the end of an assembly misses where it led
NEARBY = 0.3  # of an interval of the grid: nearer to a change point Newton may take one assembly for the other


class Meetings(NamedTuple):
    """Times at which assemblies of a module meet, s, and at which of them it crosses over.

    folds: whether it is stated to keep its own assembly there; smooth: whether its links go on smoothly at all of them.
    """

    at: tuple[Meeting, ...]
    crossed: tuple[float, ...]
    folds: bool
    smooth: bool


def folds(system: System, module: Module) -> bool:
    """Whether a module is stated to stay on its side of its change points."""
    return any(system.mechanism.assembly.get(link) == FOLDS for link in module.links)


def _findings(walk: Forward, module: Module, meetings: Meetings) -> list[Finding]:
    """What to say of change points at these times, and over these ranges of them."""
    if not meetings.at:
        return []
    dials = (walk.system.dial(walk.values, np.array(ends)) for ends in meetings.at)
    places = [dial.between(0, 1).removeprefix("at ") for dial in dials]
    links, joint = list(module.links), module.joints[1]
    alone = ", ".join(place for place in places if not place.startswith("between"))
    where = ", ".join([f"at {alone}"] * bool(alone) + [place for place in places if place.startswith("between")])
    what = f"change point {where}: two assembly modes of the links {', '.join(links)} coincide there"
    figures = {"places": places, "links": links, "smooth": meetings.smooth}
    on, say = f"links {', '.join(links)}", Finding.warning
    if meetings.smooth:
        what += "; the links go on smoothly, as their momentum carries them"
        remedy = "lengths alone do not hold them to it and reactions grow without bound there: guide them by a second "
        remedy += f"crank; to see them fold over, add {as_key(links[0])}: {FOLDS} to assembly"
    else:
        what += f"; {joint} stays on its side" + (" and speeds jump" if meetings.crossed else "")
        remedy = f"without {FOLDS} in assembly they go on smoothly"
        if not meetings.folds:
            say = Finding.error
            remedy = "the motion beyond it is not determined. Change a length, or limit the range of the driver"
    return [say("assembly.change_point", on, what, remedy, **figures)]


# ---- where assemblies meet --------------------------------------------------------------------------------------


def suspects(margin: Array) -> NDArray[np.bool_]:
    """Where 1/condition may touch zero, of all places along the last axis but the first and the last.

    A minimum that the slope of its neighbours would reach.
    """
    before, here, after = margin[..., :-2], margin[..., 1:-1], margin[..., 2:]
    steep = np.maximum(np.abs(here - before), np.abs(after - here))
    return np.asarray((here <= before) & (here <= after) & (here <= 1.1 * steep))


def _meetings(walk: Forward, number: int, assembly: Any, times: Array, pose: Any, cycle: Cycle) -> list[Meeting]:
    """First and last time at which two assemblies of a module meet, s: the same where it passes such a position.

    Over a range 1/condition is zero at positions of the grid in a row; single places are those of `touched`. One at the
    start of a cycle that comes again counts as its start.
    """
    if len(times) < 3:
        return []
    group, duration = walk.system.groups[number], cycle.duration
    margin = np.broadcast_to(1 / primal(group.condition(pose)), times.shape)
    if cycle.periodic:
        times, margin = np.append(times, duration + times[1]), np.append(margin, margin[1])

    def margin_at(moments: Array) -> Array:
        moments = np.mod(moments, duration) if cycle.periodic else moments
        trial = posed(walk.system, walk.values, walk.assembly[:number], moments)
        condition = primal(group.condition(pose_of(trial, number, assembly, moments)))
        return np.broadcast_to(1 / condition, moments.shape)

    turns = np.flatnonzero(np.diff((margin < TOUCHING).astype(int), prepend=0, append=0))
    ranges = [(int(low), int(high) - 1) for low, high in turns.reshape(-1, 2) if high - low >= ROW]
    near = suspects(margin)
    for first, last in ranges:
        near[max(first - 2, 0) : last + 1] = False  # it lacks the first and the last of the grid
    moments = touched(margin_at, times, np.flatnonzero(near) + 1)
    if cycle.periodic:
        moments = [0.0 if abs(moment - duration) < SAME_PLACE * duration else moment % duration for moment in moments]
    ends = np.minimum(times, duration)
    return sorted([*((moment, moment) for moment in moments), *((float(ends[a]), float(ends[b])) for a, b in ranges)])


def touched(margin: Callable[[Array], Array], times: Array, places: NDArray[np.intp]) -> list[float]:
    """Times, s, at which 1/condition touches zero, by golden section between the neighbours of some places of a grid:
    where the slope of the neighbours would reach zero (`suspects`)."""
    low, high = times[places - 1], times[places + 1]
    for _ in range(SECTIONS if len(places) else 0):
        left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        before, after = np.split(np.nan_to_num(margin(np.concatenate([left, right])), nan=1.0), 2)
        low, high = np.where(before < after, low, left), np.where(before < after, right, high)
    moments = (low + high) / 2
    return moments[margin(moments) < TOUCHING].tolist() if len(places) else []


# ---- over them ----------------------------------------------------------------------------------------------------


def _crossed(numbers: Callable[[int, Array], Array], moment: float, step: float, cycle: Cycle) -> float | None:
    """The time near another, s, at which the way on that is smooth is that of the other assembly; None if none is.

    numbers: of the links in one of the two assemblies, (entry, time), finite where they lie apart; step: between
    positions of the grid, s.
    """
    away = step * np.array([*LOOKED * np.array([-4.0, -3.0, -2.0, -1.0, 1.0]), -CLOSE, CLOSE])
    places = moment + away
    if cycle.periodic:
        places = np.mod(places, cycle.duration)
    elif places[0] < 0.0 or places[4] > cycle.duration:
        return None
    ours, others = numbers(0, places), numbers(1, places)
    ahead = carried_on(away[:4], ours[:, :4], away[4])
    if not np.max(np.abs(others[:, 4] - ahead)) < np.max(np.abs(ours[:, 4] - ahead)):
        return None
    before, after = np.max(np.abs(others - ours)[:, 5:], axis=0)  # they part evenly to both sides
    exact = moment + CLOSE * step * (before - after) / (before + after) if before + after > 0.0 else moment
    return float(exact if np.isfinite(exact) else moment)


def through(
    walk: Forward, number: int, branch: int, lane: int, times: Array, pose: Any, cycle: Cycle
) -> tuple[Any, Meetings, list[Finding]]:
    """A closed form through its change points: in the branch that it has at a position of the grid, and from there on,
    unless it folds, in the other one wherever that goes on smoothly. With what there is to say of them."""
    system, module, group = walk.system, walk.system.plan.modules[number], walk.system.groups[number]
    at = _meetings(walk, number, branch, times, pose, cycle)
    size = float(np.max(primal(walk.size)))

    def numbers(which: int, moments: Array) -> Array:
        trial = posed(system, walk.values, walk.assembly[:number], moments)
        pose = pose_of(trial, number, group.BRANCHES[which], moments)
        return np.array([np.broadcast_to(primal(n), moments.shape) for n in group.signature(pose, size)])

    places, crossed, others = list[Meeting](), list[float](), len(group.BRANCHES) > 1
    for first, last in at:
        exact = _crossed(numbers, first, times[1], cycle) if first == last and others else None
        crossed += [] if exact is None else [exact]
        places.append((first, last) if exact is None else (exact, exact))
    folding = folds(system, module)
    smooth = not (crossed and folding) and all(first == last for first, last in at)
    met = Meetings(tuple(places), tuple(crossed), folding, smooth)
    remarks = _findings(walk, module, met)
    if folding or not crossed:
        return branch, met, remarks
    clock, none = TrackClock.of(system, walk.values), np.zeros((0, len(times)))
    track = Track(times, none, branch, cycle.periodic, clock, {}, float(times[lane]), passed=tuple(crossed))
    return track, met, remarks


def followed_through(
    walk: Forward, number: int, track: Track, lane: int, times: Array, pose: Any, cycle: Cycle
) -> tuple[Track, Meetings, list[Finding]]:
    """A general group through its change points, both ways from where it was put together, with what there is to say.

    Beyond one it is followed from where the coordinates before it lead, there with the other sign of det J. Free spins
    are taken out.
    """
    system, module, group = walk.system, walk.system.plan.modules[number], walk.system.groups[number]
    drive, _, _ = driven_coordinates(system, module, system.places[number], walk.values, times)
    drive = [track.turns.get(slot, coordinate) for slot, coordinate in enumerate(drive)]
    follower = Follower(group, walk.pairs(system.places[number]), drive, track.orientation)
    at, folding = _meetings(walk, number, track, times, pose, cycle), folds(system, module)
    kinks = False
    for direction in () if group.redundant or folding else (1, -1):  # the least-squares way on is smooth by itself
        last = track.begin
        while True:
            places = [(direction * moment, False) for moment in follower.broken(track.coordinates, times)]
            places += [(direction * first, True) for first, end in at if first == end]
            places = [place for place in places if place[0] > direction * last + NEARBY * times[1]]
            if not places:
                break
            ahead, met = min(places)
            last = direction * ahead
            past, ends = _beyond(follower, track, times, last, met, direction)
            kinks = kinks or (met and ends)
            if past is not None:
                track, last = past, direction * max(ahead, direction * past.passed[-1 if direction > 0 else 0])
                at = _meetings(walk, number, track, times, pose_of(walk, number, track, times), cycle)
    if track.passed and cycle.periodic and (0.0, 0.0) in at and _comes_round(follower, track, times):
        track = replace(track, passed=(*track.passed, cycle.duration))
    if isinstance(group, SpatialGroup):
        track = replace(track, coordinates=unspun(group, follower.elements, track.coordinates, drive))
    smooth = bool(group.redundant) or not (folding or kinks or any(first != end for first, end in at))
    met_at = Meetings(tuple(at), track.passed, folding, smooth)
    return track, met_at, _findings(walk, module, met_at)


def _beyond(
    follower: Follower, track: Track, times: Array, moment: float, met: bool, direction: int
) -> tuple[Track | None, bool]:
    """The track on over a change point near a time, s, if it is smoother there, and whether no assembly leads on so.

    met: whether the assemblies meet there; else the old one ends, maybe for good, and a new one is as smooth as it was.
    direction: 1 onward from where it was put together, -1 back.
    """
    order = np.arange(len(times))[::direction]
    before = order[direction * times[order] < direction * moment - NEARBY * times[1]][-BEFORE:]
    past = order[direction * times[order] > direction * moment + NEARBY * times[1]]
    if len(before) < BEFORE or direction * times[before[0]] < direction * track.begin or not len(past):
        return None, False
    rows, place = track.coordinates.copy(), past[0]
    guess = carried_on(times[before], rows[:, before], float(times[place]))
    follower = replace(follower, orientation=-float(track.sense(times[before[-1]])))
    fresh = follower.solved_from(place, guess)
    kink = np.max(np.abs(rows[:, place] - guess))
    if not met or not np.isfinite(kink):
        kink = SMOOTH * np.max(np.abs(guess - rows[:, before[-1]]))
    if fresh is None or not np.max(np.abs(fresh - guess)) < kink:
        return None, fresh is None
    for between in range(before[-1] + direction, place, direction):
        rows[:, between] = carried_on(times[before], rows[:, before], float(times[between]))
    rows[:, past] = np.nan
    rows[:, place] = fresh
    follower.run(rows, past)
    exact = follower.turned_over(rows, np.append(before, past[:BEFORE]), times, moment)
    return replace(track, coordinates=rows, passed=tuple(sorted((*track.passed, exact)))), False


def _comes_round(follower: Follower, track: Track, times: Array) -> bool:
    """Whether a track goes over a change point at the end of the cycle to where it began, with the other sign there."""
    before = np.flatnonzero(times < times[-1] - NEARBY * times[1])[-BEFORE:]
    guess = carried_on(times[before], track.coordinates[:, before], float(times[-1] + times[1]))
    follower = replace(follower, orientation=-float(track.sense(times[before[-1]])))
    fresh = follower.solved_from(1, guess)
    smooth = SMOOTH * np.max(np.abs(guess - track.coordinates[:, before[-1]]))
    if fresh is None or not np.max(np.abs(fresh - guess)) < smooth:
        return False
    ends = follower.keys(np.array([fresh, track.coordinates[:, 1]]).T, np.array([1, 1]))
    return bool(np.max(np.abs(ends[:, 1] - ends[:, 0])) < SAME)
