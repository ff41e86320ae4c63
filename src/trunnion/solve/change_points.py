"""Change points: positions where two assemblies of a closed form meet, and nothing says which way it goes on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding
from trunnion.results.sentences import finding_for
from trunnion.solve.forward import Forward, pose_of, start
from trunnion.solve.system import System, Values
from trunnion.structure.decompose import Module

__all__ = ["find", "finding", "suspects"]

Array = NDArray[np.float64]

TOUCHING = 1e-6  # of 1/condition: below it two assemblies meet


def finding(system: System, values: Values, module: Module, at: Sequence[float]) -> Finding:
    """What to say of change points at these times."""
    places = [system.dial(values, np.array([moment])).at(0) for moment in at]
    links, joint = list(module.links), module.joints[1]
    return finding_for("assembly.change_point", f"links {', '.join(links)}", places=places, links=links, joint=joint)


def suspects(margin: Array) -> NDArray[np.bool_]:
    """Where 1/condition may touch zero, of all places along the last axis but the first and the last.

    A minimum that the slope of its neighbours would reach.
    """
    before, here, after = margin[..., :-2], margin[..., 1:-1], margin[..., 2:]
    steep = np.maximum(np.abs(here - before), np.abs(after - here))
    return np.asarray((here <= before) & (here <= after) & (here <= 1.1 * steep))


def find(walk: Forward, number: int, assembly: Any, times: Array, pose: Any) -> list[float]:
    """Times at which a closed form passes a position where its assemblies meet, s.

    There 1/condition touches zero between two assembled positions: found on the grid as a minimum that its
    neighbours' slope would reach, then by golden section.
    """
    if len(times) < 3:
        return []
    margin = np.broadcast_to(1 / walk.system.groups[number].condition(pose), times.shape)

    def margin_at(moment: float) -> float:
        trial = start(walk.system, walk.values)
        for earlier in range(number):
            trial.stand(earlier, pose_of(trial, earlier, walk.assembly[earlier], moment))
        found = 1 / walk.system.groups[number].condition(pose_of(trial, number, assembly, moment))
        return float(np.nan_to_num(np.ravel(found)[0], nan=1.0))

    moments = [_lowest(margin_at, times[k - 1], times[k + 1]) for k in np.flatnonzero(suspects(margin)) + 1]
    return [moment for moment in moments if margin_at(moment) < TOUCHING]


def _lowest(function: Callable[[float], float], low: float, high: float) -> float:
    """Where a function with one minimum in an interval has it, by golden section."""
    ratio = (np.sqrt(5) - 1) / 2
    for _ in range(60):
        left, right = high - ratio * (high - low), low + ratio * (high - low)
        low, high = (low, right) if function(left) < function(right) else (left, high)
    return float((low + high) / 2)
