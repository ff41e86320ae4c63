"""Change points: positions where two assemblies of a module meet, and nothing says which way it goes on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.errors import Finding
from trunnion.solve.forward import Forward, pose_of, posed
from trunnion.solve.system import System, Values
from trunnion.structure.decompose import Module

__all__ = ["TOUCHING", "Meeting", "find", "finding", "suspects", "touched"]

Array = NDArray[np.float64]

Meeting = tuple[float, float]  # first and last time, s
ROW = 3  # positions of the grid at which two assemblies meet: no single place
TOUCHING = 1e-6  # of 1/condition: below it two assemblies meet
SECTIONS, GOLDEN = 60, (np.sqrt(5) - 1) / 2


def finding(system: System, values: Values, module: Module, at: Sequence[Meeting]) -> Finding:
    """What to say of change points at these times, and over these ranges of them."""
    places = []
    for first, last in at:
        dial = system.dial(values, np.array([first, last]))
        places.append(dial.between(0, 1).removeprefix("at "))
    links, joint = list(module.links), module.joints[1]
    alone = ", ".join(place for place in places if not place.startswith("between"))
    where = ", ".join([f"at {alone}"] * bool(alone) + [place for place in places if place.startswith("between")])
    what = f"change point {where}: two assembly modes of the links {', '.join(links)} coincide there"
    remedy = f"the motion beyond it is not determined; here {joint} stays on its side. Change a length, or limit the "
    remedy += "range of the driver"
    return Finding.error("assembly.change_point", f"links {', '.join(links)}", what, remedy, places=places, links=links)


def suspects(margin: Array) -> NDArray[np.bool_]:
    """Where 1/condition may touch zero, of all places along the last axis but the first and the last.

    A minimum that the slope of its neighbours would reach.
    """
    before, here, after = margin[..., :-2], margin[..., 1:-1], margin[..., 2:]
    steep = np.maximum(np.abs(here - before), np.abs(after - here))
    return np.asarray((here <= before) & (here <= after) & (here <= 1.1 * steep))


def find(walk: Forward, number: int, assembly: Any, times: Array, pose: Any) -> list[Meeting]:
    """First and last time at which two assemblies of a module meet, s: the same where it passes such a position.

    Over a range 1/condition is zero at positions of the grid in a row; single places are those of `touched`.
    """
    if len(times) < 3:
        return []
    group = walk.system.groups[number]
    margin = np.broadcast_to(1 / primal(group.condition(pose)), times.shape)

    def margin_at(moments: Array) -> Array:
        trial = posed(walk.system, walk.values, walk.assembly[:number], moments)
        condition = primal(group.condition(pose_of(trial, number, assembly, moments)))
        return np.broadcast_to(1 / condition, moments.shape)

    ranges = _in_a_row(margin < TOUCHING)
    near = suspects(margin)
    for first, last in ranges:
        near[max(first - 2, 0) : last + 1] = False  # it lacks the first and the last of the grid
    moments = touched(margin_at, times, np.flatnonzero(near) + 1)
    return sorted([*((one, one) for one in moments), *((float(times[a]), float(times[b])) for a, b in ranges)])


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
