"""Means over a cycle: of powers, of friction, of the squares of efforts, and the efficiency that follows from them.

They are read of the course of the cycle (`course`), so that they do not depend on how many positions were asked for,
and each has the error of its integral. A mean that this error, or rounding, may have made is
0: power that a load gives and takes back.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.panels import CANCELLED
from trunnion.errors import Status
from trunnion.model.mechanism import Mechanism
from trunnion.solve.loads import has_useful_work

__all__ = ["IDEAL", "MOST_SUPPOSED", "RESIDUALS", "SUPPOSED", "Mean", "Means", "still", "unknown"]

Array = NDArray[np.float64]
# what the means of the ideal mechanism are made of
IDEAL = ("drive_power", "useful_power", "friction_power", "drive_effort", "power_residual", "status")
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


def unknown(means: Means) -> Means:
    """The same means without an answer; what share of them is supposed stays."""
    no = Mean(np.nan, np.nan, np.nan, np.nan)
    lost, efforts = (np.full_like(one, np.nan) for one in (means.friction_power_mean, means.drive_effort_rms))
    return Means(no, no, no, lost, efforts, means.supposed, means.has_useful_work)


def still(arrays: Mapping[str, Array], mechanism: Mechanism) -> Means:
    """The means of a mechanism that stands, in its one position; NaN where positions have no answer."""
    alone = len(arrays["status"]) == 1 and arrays["status"][0] < Status.NOT_CONVERGED
    driven, useful, lost, efforts = (
        arrays[name][..., 0] + (0.0 if alone else np.nan)
        for name in ("drive_power", "useful_power", "friction_power", "drive_effort")
    )

    def of(number: Array) -> Mean:
        value = float(np.sum(number))
        return Mean(value, 0.0, abs(value), CANCELLED * abs(value))

    return Means(of(driven), of(useful), of(lost), lost, np.abs(efforts), has_useful_work=has_useful_work(mechanism))
