"""Change points: positions where two assemblies of a module meet, and lengths do not say which way it goes on.

The links of a linkage that moves go on smoothly, as their momentum would have it. A closed form follows them by going
over to its other assembly where its own has a kink, see `crosses`; one that `folds` keeps its own.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.errors import Finding
from trunnion.model.names import as_key
from trunnion.model.parts import FOLDS
from trunnion.solve.forward import Forward, pose_of, posed
from trunnion.solve.system import Cycle, System, Values
from trunnion.structure.decompose import Module

__all__ = ["TOUCHING", "Meeting", "Meetings", "carried_on", "crosses", "find", "finding", "suspects", "touched"]

Array = NDArray[np.float64]

Meeting = tuple[float, float]  # first and last time, s
ROW = 3  # positions of the grid at which two assemblies meet: no single place
TOUCHING = 1e-6  # of 1/condition: below it two assemblies meet
SECTIONS, GOLDEN = 60, (np.sqrt(5) - 1) / 2
LOOKED = 0.25  # of an interval of the grid: from one to the next of the places before a change point
CLOSE = 1e-3  # of an interval: from where on both sides it is located
SAME_PLACE = 1e-7  # of the cycle


class Meetings(NamedTuple):
    """Times at which assemblies of a module meet, s, and at which of them it `crosses`.

    folds: whether it is stated to keep its own assembly there; smooth: whether its links go on smoothly at all of them.
    """

    at: tuple[Meeting, ...]
    crossed: tuple[float, ...]
    folds: bool
    smooth: bool


def finding(system: System, values: Values, module: Module, meetings: Meetings) -> Finding:
    """What to say of change points at these times, and over these ranges of them."""
    at, goes_on = meetings.at, meetings.smooth
    places = []
    for first, last in at:
        dial = system.dial(values, np.array([first, last]))
        places.append(dial.between(0, 1).removeprefix("at "))
    links, joint = list(module.links), module.joints[1]
    alone = ", ".join(place for place in places if not place.startswith("between"))
    where = ", ".join([f"at {alone}"] * bool(alone) + [place for place in places if place.startswith("between")])
    what = f"change point {where}: two assembly modes of the links {', '.join(links)} coincide there"
    figures = {"places": places, "links": links, "smooth": goes_on}
    if goes_on:
        what += "; the links go on smoothly, as their momentum carries them"
        remedy = "lengths alone do not hold them to it and reactions grow without bound there: guide them by a second "
        remedy += f"crank; to see them fold over, add {as_key(links[0])}: {FOLDS} to assembly"
        return Finding.warning("assembly.change_point", f"links {', '.join(links)}", what, remedy, **figures)
    what += f"; {joint} stays on its side" + (" and speeds jump" if meetings.crossed else "")
    remedy = "the motion beyond it is not determined. Change a length, or limit the range of the driver"
    if meetings.folds:
        remedy = f"without {FOLDS} in assembly they go on smoothly"
        return Finding.warning("assembly.change_point", f"links {', '.join(links)}", what, remedy, **figures)
    return Finding.error("assembly.change_point", f"links {', '.join(links)}", what, remedy, **figures)


def suspects(margin: Array) -> NDArray[np.bool_]:
    """Where 1/condition may touch zero, of all places along the last axis but the first and the last.

    A minimum that the slope of its neighbours would reach.
    """
    before, here, after = margin[..., :-2], margin[..., 1:-1], margin[..., 2:]
    steep = np.maximum(np.abs(here - before), np.abs(after - here))
    return np.asarray((here <= before) & (here <= after) & (here <= 1.1 * steep))


def find(walk: Forward, number: int, assembly: Any, times: Array, pose: Any, cycle: Cycle) -> list[Meeting]:
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

    ranges = _in_a_row(margin < TOUCHING)
    near = suspects(margin)
    for first, last in ranges:
        near[max(first - 2, 0) : last + 1] = False  # it lacks the first and the last of the grid
    moments = touched(margin_at, times, np.flatnonzero(near) + 1)
    if cycle.periodic:
        moments = [0.0 if abs(moment - duration) < SAME_PLACE * duration else moment % duration for moment in moments]
    ends = np.minimum(times, duration)
    return sorted([*((moment, moment) for moment in moments), *((float(ends[a]), float(ends[b])) for a, b in ranges)])


def carried_on(times: Array, rows: Array, time: float) -> Array:
    """Numbers at a time, (row,), by the polynomial through some times, rows (row, time)."""
    apart = times[:, None] - times[None] + np.eye(len(times))
    ahead = np.where(np.eye(len(times), dtype=bool), 1.0, (time - times)[None] / apart)
    return np.asarray(rows @ np.prod(ahead, axis=1))


def crosses(numbers: Callable[[int, Array], Array], moment: float, step: float, cycle: Cycle) -> float | None:
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


def _in_a_row(touches: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last of some positions in a row, where they are more than pass one meeting point."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], touches, [False]]).astype(int)))
    return [(int(low), int(high) - 1) for low, high in zip(edges[::2], edges[1::2], strict=True) if high - low >= ROW]
