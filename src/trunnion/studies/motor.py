"""What a drive asks of its motor and flywheel: mean and largest power, RMS effort, swing of its energy.

Integrals between the places where the model switches (`switches`) and extremes between positions (`corners`): none
depends on how many positions there are.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.quadrature import CANCELLED, integrals, nodes
from trunnion.cycle.means import Mean
from trunnion.measures.corners import BESIDE
from trunnion.measures.evaluation import courses_of
from trunnion.measures.measures import Measure
from trunnion.measures.over_cycle import figures_of
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run

__all__ = ["Motor", "motor"]

Array = NDArray[np.float64]
HALVINGS = 30  # of a gap in which the power passes its mean, where the energy is level


class Motor(NamedTuple):
    """Of one driver over a cycle: RMS of its effort, N m or N; largest magnitude and mean of its power, W; largest
    change of its energy about the mean, J. NaN where positions have no answer."""

    rms_effort: float = 0.0
    peak_power: float = 0.0
    mean_power: float = 0.0
    energy_swing: float = 0.0


def motor(run: Run, driver: str, steps: int) -> Motor:
    """Figures of a driver. steps: equally spaced positions between which the largest power is located."""
    method, power, effort = FrictionMethod(), Measure("power", "power", driver), Measure("effort", "effort", driver)
    largest = Measure("largest", "power", driver, statistic="largest")
    peak = figures_of(run, [largest], method)["largest"]
    if run.cycle.duration <= 0:
        rest = courses_of(run, [effort], np.zeros(1), method)[0]["effort"][0]
        return Motor(float(np.abs(np.ravel(rest)[0])), peak, 0.0, 0.0)

    def courses(moments: Array) -> Array:
        """Power and effort, (2, …)."""
        found = courses_of(run, [power, effort], moments.ravel(), method)[0]
        both = [np.broadcast_to(np.asarray(found[name][0], float), moments.size) for name in ("power", "effort")]
        return np.reshape(both, (2, *moments.shape))

    def integrands(_: object, moments: Array) -> Array:
        driven, turned = courses(moments)
        return np.stack([driven, turned**2])

    duration = run.cycle.duration
    beside = (run.edges[:, None] + BESIDE * duration * np.array([-1.0, 1.0])).ravel()
    beside = beside % duration if run.cycle.periodic else np.clip(beside, 0.0, duration)
    peak = float(np.fmax(peak, np.max(np.abs(courses(np.sort(beside))[0]))))  # of a load shorter than a step
    found = integrals(integrands, [run.edges])
    value, error, size = (part[:, 0] / run.cycle.duration for part in (found.value, found.error, found.size))
    mean = Mean(float(value[0]), float(error[0]), float(size[0]), CANCELLED * float(size[0])).net
    swing = _swing(lambda moments: courses(moments)[0] - mean, run.edges)
    return Motor(float(np.sqrt(value[1])), peak, mean, swing)


def _swing(surplus: Callable[[Array], Array], edges: Array) -> float:
    """Largest less least energy, J, of a power less its mean, W: it is level where that is 0, or at an edge.

    edges: times, s, from the start to the end of the cycle, between which the power is smooth.
    """
    time = np.union1d(edges, nodes(edges).at)
    above = surplus(time) > 0
    passed = np.flatnonzero(above[1:] != above[:-1])
    low, high, before = time[passed], time[passed + 1], above[passed]
    for _ in range(HALVINGS if len(passed) else 0):
        middle = (low + high) / 2
        same = (surplus(middle) > 0) == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    between = [np.array(pair) for pair in pairwise(np.union1d(edges, high))]
    parts = integrals(lambda _, moments: surplus(moments)[None], between, lambda size: np.full_like(size, np.max(size)))
    energy = np.concatenate([[0.0], np.cumsum(parts.value[0])])
    return float(np.max(energy) - np.min(energy))
