"""Means over a cycle: of powers, of friction, of the squares of efforts, and the efficiency that follows from them.

They are integrals between the places where the model switches (`switches`), so that they do not depend on how many
positions were asked for, and each has the error of its integral. A mean that this error, or rounding, may have made is
0: power that a load gives and takes back.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.quadrature import CANCELLED, Effort, integrals
from trunnion.errors import Status
from trunnion.model.mechanism import Mechanism
from trunnion.solve.loads import has_useful_work
from trunnion.solve.switches import Mechanisms, edges

__all__ = ["AVERAGED", "IDEAL", "MOST_SUPPOSED", "SUPPOSED", "Mean", "Means", "Powers", "means_of", "still", "unknown"]

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
Powers = Callable[[Rows, Array], Mapping[str, Array]]

# what `Powers` has of each lane and node, NaN where there is no answer
AVERAGED = ("drive_power", "useful_power", "friction_power", "drive_effort", "power_residual")
IDEAL = (*AVERAGED, "status")  # what the means of the ideal mechanism are made of
SUPPOSED = "supposed_power"  # and may have, W: by how much that through the drivers differs from what stands in for it
MOST_SUPPOSED = 0.05  # of the power through the drivers: with more of it the means have no answer
NEGLIGIBLE = 1e-9  # of the largest power: what is below it need not be known to many digits
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


def means_of(
    of: Mechanisms, powers: Powers, between: Sequence[Array] | None = None, effort: Effort | None = None
) -> list[Means]:
    """The means of every mechanism over its cycle.

    powers: what `AVERAGED` names, (…, lane, node), at the times (lane, node), s, of one mechanism a lane. between:
    times in rising order that the integrals are parted at, those of `switches` if not given.
    """
    drivers = len(of.system.mechanism.drivers)

    def functions(rows: Rows, time: Array) -> Array:
        found = powers(rows, time)
        driven, lost = np.sum(found["drive_power"], axis=0), found["friction_power"]
        known = [driven, found["useful_power"], np.sum(lost, axis=0), np.abs(found["power_residual"])]
        whole = np.abs(driven)
        both = [whole, found.get(SUPPOSED, np.zeros_like(whole))]
        return np.concatenate([np.stack(known), found["drive_effort"] ** 2, lost, np.stack(both)])

    def floor(sizes: Array) -> Array:
        """Powers that are nothing beside the others; how even the residual is does not matter."""
        least = np.empty_like(sizes)
        least[:] = NEGLIGIBLE * np.max(sizes[:3], axis=0)
        least[3] = np.inf
        least[4 : 4 + drivers] = NEGLIGIBLE * np.max(sizes[4 : 4 + drivers], axis=0, initial=0.0)
        least[-2:] = np.inf
        return least

    between = edges(of) if between is None else between
    found = integrals(functions, between, floor, effort)
    told, useful_work = [], has_useful_work(of.system.mechanism)
    for k, times in enumerate(between):
        value, error, size = (part[:, k] / (times[-1] - times[0]) for part in (found.value, found.error, found.size))
        rounding = np.maximum(CANCELLED * size, RESIDUALS * value[3])
        rounding[2] = max(rounding[2], CANCELLED * np.max(size[:3]))
        driven, useful, lost = (Mean(*(float(one[i]) for one in (value, error, size, rounding))) for i in range(3))
        efforts, share = np.sqrt(value[4 : 4 + drivers]), float(value[-1] / value[-2]) if value[-2] > 0 else 0.0
        told.append(Means(driven, useful, lost, value[4 + drivers : -2], efforts, share, useful_work))
    return told


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
