"""Means over a cycle: of powers, of friction, of the squares of efforts, and the efficiency that follows from them.

They are read of the course of the cycle (`course`), so that they do not depend on how many positions were asked for,
and each has the error of its integral. A mean that this error, or rounding, may have made is
0: power that a load gives and takes back.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["MOST_SUPPOSED", "RESIDUALS", "SUPPOSED", "Mean", "Means", "unknown"]

Array = NDArray[np.float64]
SUPPOSED = "supposed_power"  # W: by how much that through the drivers differs from what stands in for it
MOST_SUPPOSED = 0.05  # of the power through the drivers: with more of it the means have no answer
RESIDUALS = 4.0  # of the mean residual of the power balance: what rounding leaves of a power that cancels


class Mean(NamedTuple):
    """A mean, the error of its integral, the mean of the magnitude, and what may be no more than rounding."""

    value: float
    error: float
    size: float
    rounding: float

    @property
    def net(self) -> float:
        """The value; 0 where it is no more than its error or rounding."""
        return 0.0 if abs(self.value) <= max(self.error, self.rounding) else self.value


@dataclass(frozen=True)
class Means:
    """Means over one cycle, W; NaN where any place of it has no answer.

    drive_power: of all drivers; useful_power: that the useful loads take; friction_power: lost in all joints;
    friction_power_mean: in each joint; drive_effort_rms: root mean square of each driver, N m or N; supposed: share
    of the power through the drivers by which it differs from that which stands in for it (`SUPPOSED`);
    has_useful_work: whether it is stated what work is useful.
    """

    drive_power: Mean
    useful_power: Mean
    friction_power: Mean
    friction_power_mean: Array
    drive_effort_rms: Array
    supposed: float = 0.0
    has_useful_work: bool = True

    @property
    def drive_power_mean(self) -> float:
        """Of all drivers, W."""
        return self.drive_power.net

    @property
    def useful_power_mean(self) -> float:
        """Taken by the useful loads, W."""
        return self.useful_power.net

    @property
    def efficiency(self) -> float:
        """Useful work over drive work of the cycle [D 1]; NaN where the loads drive, a place has no answer, or nothing
        is useful."""
        work = self.drive_power.net
        return self.useful_power.net / work if work > 0 and self.has_useful_work else float("nan")

    @property
    def integration_error(self) -> float:
        """How far the errors of both integrals may have moved the efficiency."""
        work, value = self.drive_power.net, self.efficiency
        return (self.useful_power.error + abs(value) * self.drive_power.error) / work if work > 0 else float("nan")

    @property
    def efficiency_error(self) -> float:
        """The same, with the share of the drive work that is supposed where pins do not settle."""
        return self.integration_error + abs(self.efficiency) * self.supposed


def unknown(drivers: int, joints: int, supposed: float = 0.0, has_useful_work: bool = True) -> Means:
    """Means without an answer; what share of them is supposed stays."""
    none = Mean(np.nan, np.nan, np.nan, np.nan)
    return Means(none, none, none, np.full(joints, np.nan), np.full(drivers, np.nan), supposed, has_useful_work)
