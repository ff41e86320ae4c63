"""Whether a model lies within the uncertainty of what was measured, position by position and as a whole.

The expanded uncertainty U = k_p u of a position has the coverage probability that `coverage` (2) has of a normal
distribution: k_p is Student's for the effective degrees of freedom of u (GUM, JCGM 100:2008, G.4 and G.6.4), so that it
is 2 where turns are many or the sensor's own uncertainty prevails, and more where turns are few. Of a true model about
that share of the positions lies within ±U. How far a single course may stay below it depends on how many of its
positions are independent of each other, which the turns tell (`independent`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Coded
from trunnion.rig.comparison.uncertainty import (
    Uncertainty,
    at_positions,
    expanded,
    mean_expanded,
    nearly_whole,
    probability,
    uncertainty_of,
)
from trunnion.rig.reading.measurement import Signal

__all__ = [
    "SignalAssessment", "Uncertainty", "Verdict", "difference", "expanded", "going_on", "independent", "judge",
    "probability", "uncertainty_of",
]  # fmt: skip

Array = NDArray[np.float64]
SURE = 2.326  # standard deviations: the share of a true model falls below its least in 1 % of courses
FEWEST_TURNS = 5  # that tell whether errors go on from turn to turn
ROUNDING = 1e-9  # of the size of a course: differences below it are none


class Verdict(Coded):
    """What a comparison of one course comes to."""

    WITHIN = 0, "within"
    OFFSET = 1, "offset only"
    NOT = 2, "not within"
    UNKNOWN = 3, "U unknown"
    NOTHING = 4, "no data"


@dataclass(frozen=True)
class SignalAssessment:
    """Figures of a residual, measured less model, over the positions that can be compared; NaN where not known.

    largest: the residual of the largest size; place: its position, −1 if there is none; least: the share within ±U
    from which the course is taken to be within; bias_expanded: U of the bias; within_unbiased: the share within ±U once
    the bias is taken off.
    """

    compared: int = 0
    rms: float = np.nan
    largest: float = np.nan
    place: int = -1
    bias: float = np.nan
    bias_expanded: float = np.nan
    rms_unbiased: float = np.nan
    within: float = np.nan
    least: float = np.nan
    correlation: float = np.nan
    verdict: Verdict = Verdict.NOTHING
    within_unbiased: float = np.nan


def judge(course: Signal, model: Array, comparable: NDArray[np.bool_], coverage: float = 2.0) -> SignalAssessment:
    """Measured against the model at the positions that can be compared."""
    where = comparable & np.isfinite(course.mean) & np.isfinite(model)
    if not np.any(where):
        return SignalAssessment()
    measured, theirs = course.mean[where], model[where]
    residual = difference(measured, theirs)
    size = float(np.max(np.abs(np.append(measured, theirs))))
    bias = float(np.mean(residual))
    of = at_positions(uncertainty_of(course), where)
    worst = int(np.argmax(np.abs(residual)))
    share, least = _share(residual, of, coverage, ROUNDING * size)
    # a constant is taken out: what is left is against the scatter and what the gain makes of the shape
    shape = replace(of, shared=(of.shared - np.mean(of.shared, axis=1, keepdims=True))[1:])
    unbiased = residual - bias
    share_0, least_0 = _share(unbiased, shape, coverage, ROUNDING * size)
    verdict = Verdict.NOT
    if not np.isfinite(share):
        verdict = Verdict.UNKNOWN
    elif share >= least:
        verdict = Verdict.WITHIN
    elif share_0 >= least_0:
        verdict = Verdict.OFFSET
    return SignalAssessment(
        int(np.count_nonzero(where)), _rms(residual), float(residual[worst]), int(np.flatnonzero(where)[worst]),
        bias, mean_expanded(of, coverage), _rms(unbiased), share, least, _correlation(measured, theirs), verdict,
        share_0,
    )  # fmt: skip


def difference(measured: Array, model: Array) -> Array:
    """Measured less model, 0 where it is rounding."""
    residual = measured - model
    size = float(np.nanmax(np.abs(np.append(measured, model)), initial=0.0))
    return np.where(np.abs(residual) <= ROUNDING * size, 0.0, residual)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _share(residual: Array, of: Uncertainty, coverage: float, least: float) -> tuple[float, float]:
    """Share of the positions within ±U, and how small that of a true model may be; NaN if no uncertainty is known."""
    wide = expanded(of.total, of.freedom, coverage)
    told = np.isfinite(wide)
    if not np.any(told):
        return np.nan, np.nan
    share = float(np.mean(np.abs(residual[told]) <= wide[told] + least))
    p = probability(coverage)
    return share, p - SURE * float(np.sqrt(p * (1 - p) / independent(at_positions(of, told))))


def independent(of: Uncertainty) -> float:
    """How many positions are as good as independent of each other: N²/Σρᵢⱼ², from 1 to N.

    Correlated are the parts shared by all positions, and the scatter as the turns show it; its Σρ² is that of n turns
    less what chance makes of n, by Srivastava (2005), J. Japan Statist. Soc. 35, 251-272.
    With two turns there is no telling: taken as 1.
    """
    total = of.total
    count = len(total)
    turns = nearly_whole(of.turns)
    if not np.any(total > 0) or not np.any(of.random > 0):
        return 1.0
    freedom = len(turns) - 1
    if freedom < 2:
        return 1.0
    unit = np.where(total > 0, total, 1.0)
    rows = turns / unit / np.sqrt(len(turns) * freedom)  # Σ rows² is the random share of the variance of each position
    gram = rows @ rows.T if len(rows) < count else rows.T @ rows  # the smaller has the same trace, and its square
    trace, square = float(np.trace(gram)), float(np.sum(gram**2))
    scatter = freedom**2 / ((freedom - 1) * (freedom + 2)) * (square - trace**2 / freedom)
    parts = of.shared / unit
    mixed = 2 * float(np.sum((rows @ parts.T) ** 2))
    both = max(scatter, 0.0) + mixed + float(np.sum((parts @ parts.T) ** 2))
    return float(np.clip(count**2 / max(both, count), 1.0, count))


def going_on(course: Signal) -> tuple[float, int]:
    """Correlation of the mean error of a turn with that of the next, and of how many; (NaN, 0) of fewer than five.

    That of n independent turns is −1/n in the mean, which is taken off, and scatters by 1/√n.
    """
    turns = nearly_whole(course.turns - course.mean)
    if len(turns) < FEWEST_TURNS:
        return float("nan"), 0
    means = np.mean(turns, axis=1) - np.mean(turns)
    square = float(np.sum(means**2))
    if square <= (ROUNDING * float(np.nanmax(np.abs(course.mean), initial=0.0))) ** 2:
        return float("nan"), 0
    return float(np.sum(means[1:] * means[:-1])) / square + 1 / len(means), len(means)


def _correlation(measured: Array, model: Array) -> float:
    """Pearson's; NaN where one of them is flat."""
    one, two = measured - np.mean(measured), model - np.mean(model)
    flat = ROUNDING * float(np.max(np.abs(np.append(measured, model)), initial=0.0))
    if np.max(np.abs(one)) <= flat or np.max(np.abs(two)) <= flat:
        return float("nan")
    return float(np.sum(one * two) / np.sqrt(np.sum(one**2) * np.sum(two**2)))
