"""What a drive asks of its motor and flywheel: mean and largest power, RMS effort, swing of its energy.

All are read of the course of its effort and its power over the cycle.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from trunnion.algebra.panels import CANCELLED, INTEGRAL
from trunnion.cycle.course import Mean, course_of, magnitude
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run

__all__ = ["Motor", "motor"]


class Motor(NamedTuple):
    """Of one driver over a cycle: RMS of its effort, N m or N; largest magnitude and mean of its power, W; largest
    change of its energy about the mean, J. NaN where positions have no answer."""

    rms_effort: float = 0.0
    peak_power: float = 0.0
    mean_power: float = 0.0
    energy_swing: float = 0.0


def motor(run: Run, driver: str) -> Motor:
    """Figures of a driver."""
    i = list(run.system.mechanism.drivers).index(driver)
    course = course_of(run, FrictionMethod(), names=("drive_effort", "drive_power"))
    power, peak = course.picked("drive_power", i), course.extreme("drive_power", i, of=magnitude)
    with np.errstate(all="ignore"):
        square = course.picked("drive_effort", i).mean(np.square)[0]
        value, size = float(power.mean()[0]), float(power.mean(np.abs)[0])
    mean = Mean(value, float(power.error()[0]), size, CANCELLED * size).net
    # the energy is level where the power is the mean, or at an edge
    cut = power.parted(power.passages(0, mean))
    energy = np.cumsum(np.append(0.0, cut.half * (cut.coefficients[:, 0] @ INTEGRAL - 2.0 * mean)))
    return Motor(float(np.sqrt(square)), 0.0 if peak is None else peak.value, mean, float(np.ptp(energy)))
