"""What a drive asks of its motor and flywheel: mean and largest power, RMS effort, swing of its energy.

All are read of the courses of power and effort; none depends on how many positions a table has.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from trunnion.algebra.course import Courses
from trunnion.algebra.panels import CANCELLED
from trunnion.cycle.means import Mean
from trunnion.measures.evaluation import courses_of
from trunnion.measures.measures import Measure
from trunnion.measures.over_cycle import settled
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run

__all__ = ["Motor", "motor"]

Array = NDArray[np.float64]


class Motor(NamedTuple):
    """Of one driver over a cycle: RMS of its effort, N m or N; largest magnitude and mean of its power, W; largest
    change of its energy about the mean, J. NaN where positions have no answer."""

    rms_effort: float = 0.0
    peak_power: float = 0.0
    mean_power: float = 0.0
    energy_swing: float = 0.0


def motor(run: Run, driver: str) -> Motor:
    """Figures of a driver."""
    measures = [Measure(kind, kind, driver) for kind in ("power", "effort")]
    if run.cycle.duration <= 0:
        both = courses_of(run, measures, np.zeros(1), FrictionMethod())[0]
        power, effort = (abs(float(np.ravel(both[one.name][0])[0])) for one in measures)
        return Motor(effort, power, 0.0, 0.0)
    with np.errstate(all="ignore"):
        courses = settled(run, measures, FrictionMethod()).courses
        if np.any(np.isnan(courses.coefficients)):
            return Motor(*[float("nan")] * 4)
        size = float(courses.mean(lambda rows: np.abs(rows[0])))
        mean = Mean(float(courses.mean()[0]), float(courses.error()[0]), size, CANCELLED * size).net
        effort = float(np.sqrt(courses.mean(lambda rows: rows[1] ** 2)))
        tops = [courses.extreme(lambda rows: np.abs(rows[0]))]
        peak = max(top.value for top in tops if top is not None)
        return Motor(effort, peak, mean, _swing(courses, mean))


def _swing(courses: Courses, mean: float) -> float:
    """Largest less least energy, J, of a power less its mean, W: it is level where that is 0, or at an edge."""
    surplus = courses.coefficients[:, 0].copy()
    surplus[:, 0] -= mean
    energy = courses.half[:, None] * chebyshev.chebint(surplus, lbnd=-1, axis=1)
    before = np.concatenate([[0.0], np.cumsum(np.sum(energy, axis=1))])
    times = courses.passages(0, mean)
    panel = np.clip(np.searchsorted(courses.edges, times, side="right") - 1, 0, len(energy) - 1)
    spot = (times - courses.edges[panel]) / courses.half[panel] - 1.0
    level = before[panel] + np.sum(chebyshev.chebvander(spot, energy.shape[1] - 1) * energy[panel], axis=1)
    return float(np.ptp(np.concatenate([before, level])))
