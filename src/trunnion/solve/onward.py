"""Modules onward from where they are put together: through change points, smoothly, and over gaps."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.errors import Finding
from trunnion.groups.spatial import SpatialGroup
from trunnion.groups.spins import unspun
from trunnion.model.parts import FOLDS
from trunnion.solve import change_points
from trunnion.solve.forward import Forward, pose_of, posed
from trunnion.solve.system import Cycle, Dial, Positions, System, driven_coordinates
from trunnion.solve.track import SAME, STRIDE, Follower, Passing, Track, TrackClock, alternating, key_of
from trunnion.structure.decompose import Module

__all__ = ["folds", "followed_through", "through"]

Array = NDArray[np.float64]

BEFORE = 4  # positions before a change point that lead over it
SMOOTH = 0.1  # of the last change: by how much the way on beyond the end of an assembly misses where it led
NEARBY = 0.3  # of an interval of the grid: nearer to a change point Newton may take one assembly for the other


def folds(system: System, module: Module) -> bool:
    """Whether a module is stated to stay on its side of its change points."""
    return any(system.mechanism.assembly.get(link) == FOLDS for link in module.links)


def through(
    walk: Forward, number: int, branch: int, lane: int, times: Array, pose: Any, cycle: Cycle
) -> tuple[Any, change_points.Meetings, list[Finding]]:
    """A closed form through its change points: in the branch that it has at a position of the grid, and from there on,
    unless it folds, in the other one wherever that goes on smoothly. With what there is to say of them."""
    system, module, group = walk.system, walk.system.plan.modules[number], walk.system.groups[number]
    at = change_points.find(walk, number, branch, times, pose, cycle)
    size = float(np.max(primal(walk.size)))

    def numbers(which: int, moments: Array) -> Array:
        trial = posed(system, walk.values, walk.assembly[:number], moments)
        pose = pose_of(trial, number, group.BRANCHES[which], moments)
        return np.array([np.broadcast_to(primal(n), moments.shape) for n in key_of(group, pose, size)])

    places, crossed, others = list[change_points.Meeting](), list[float](), len(group.BRANCHES) > 1
    for first, last in at:
        exact = change_points.crosses(numbers, first, times[1], cycle) if first == last and others else None
        crossed += [] if exact is None else [exact]
        places.append((first, last) if exact is None else (exact, exact))
    folding = folds(system, module)
    smooth = not (crossed and folding) and all(first == last for first, last in at)
    met = change_points.Meetings(tuple(places), tuple(crossed), folding, smooth)
    remarks = [change_points.finding(system, walk.values, module, met)] if at else []
    if folding or not crossed:
        return branch, met, remarks
    clock, duration = TrackClock.of(system, walk.values), cycle.duration if cycle.periodic else None
    first = branch * int(alternating(crossed, times[lane]))
    return Passing(first, tuple(crossed), duration, clock), met, remarks


def followed_through(
    walk: Forward, number: int, track: Track, lane: int, times: Array, pose: Any, cycle: Cycle
) -> tuple[Track, change_points.Meetings, list[Finding]]:
    """A general group through its change points, both ways from where it was put together, with what there is to say.

    Beyond one it is followed from where the coordinates before it lead, there with the other sign of det J. Without any
    it is put together anew where it can be, in the same sense, nearest to what was left; free spins are taken out.
    """
    system, module, group = walk.system, walk.system.plan.modules[number], walk.system.groups[number]
    drive, _, _ = driven_coordinates(system, module, system.places[number], walk.values, times)
    drive = [track.turns.get(slot, coordinate) for slot, coordinate in enumerate(drive)]
    follower = Follower(group, walk.pairs(system.places[number]), drive, track.orientation, STRIDE)
    at, folding = change_points.find(walk, number, track, times, pose, cycle), folds(system, module)
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
                at = change_points.find(walk, number, track, times, pose_of(walk, number, track, times), cycle)
    if track.passed and cycle.periodic and (0.0, 0.0) in at and _comes_round(follower, track, times):
        track = replace(track, passed=(*track.passed, cycle.duration))
    rows = track.coordinates.copy()
    if not track.passed and len(again := follower.revisit(rows, cycle.periodic)):
        track = replace(track, coordinates=rows, again=again)
        at = change_points.find(walk, number, track, times, pose_of(walk, number, track, times), cycle)
    if isinstance(group, SpatialGroup):
        track = replace(track, coordinates=unspun(group, follower.elements, track.coordinates, drive))
    smooth = bool(group.redundant) or not (folding or kinks or any(first != end for first, end in at))
    met_at = change_points.Meetings(tuple(at), track.passed, folding, smooth)
    remarks = [_anew(module, system.dial(walk.values, times), track.again)] if len(track.again) else []
    if at:
        remarks.append(change_points.finding(system, walk.values, module, met_at))
    return track, met_at, remarks


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
    guess = change_points.carried_on(times[before], rows[:, before], float(times[place]))
    follower = replace(follower, orientation=-float(track.sense(times[before[-1]])))
    fresh = follower.solved_from(place, guess)
    kink = np.max(np.abs(rows[:, place] - guess))
    if not met or not np.isfinite(kink):
        kink = SMOOTH * np.max(np.abs(guess - rows[:, before[-1]]))
    if fresh is None or not np.max(np.abs(fresh - guess)) < kink:
        return None, fresh is None
    for between in range(before[-1] + direction, place, direction):
        rows[:, between] = change_points.carried_on(times[before], rows[:, before], float(times[between]))
    rows[:, past] = np.nan
    rows[:, place] = fresh
    follower.run(rows, past)
    exact = follower.turned_over(rows, np.append(before, past[:BEFORE]), times, moment)
    return replace(track, coordinates=rows, passed=tuple(sorted((*track.passed, exact)))), False


def _comes_round(follower: Follower, track: Track, times: Array) -> bool:
    """Whether a track goes over a change point at the end of the cycle to where it began, with the other sign there."""
    before = np.flatnonzero(times < times[-1] - NEARBY * times[1])[-BEFORE:]
    guess = change_points.carried_on(times[before], track.coordinates[:, before], float(times[-1] + times[1]))
    follower = replace(follower, orientation=-float(track.sense(times[before[-1]])))
    fresh = follower.solved_from(1, guess)
    smooth = SMOOTH * np.max(np.abs(guess - track.coordinates[:, before[-1]]))
    if fresh is None or not np.max(np.abs(fresh - guess)) < smooth:
        return False
    ends = follower.keys(np.array([fresh, track.coordinates[:, 1]]).T, np.array([1, 1]))
    return bool(np.max(np.abs(ends[:, 1] - ends[:, 0])) < SAME)


def _anew(module: Module, dial: Dial, positions: Positions) -> Finding:
    what = f"links {', '.join(module.links)} cannot stay assembled throughout the cycle and are assembled again "
    what += f"{dial.intervals(positions)}"
    remedy = "the assembly mode of the same sense nearest to the last one is used there; limit the range of the "
    remedy += "driver"
    figures = {"links": list(module.links), "at": dial.intervals(positions)}
    return Finding.warning("assembly.anew", "links", what, remedy, **figures)
