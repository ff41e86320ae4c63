"""Whether a model lies within the uncertainty of what was measured, position by position and as a whole.

The expanded uncertainty U = k_p u of a position has the coverage probability that `coverage` (2) has of a normal
distribution: k_p is Student's for the effective degrees of freedom of u (GUM, JCGM 100:2008, G.4 and G.6.4). Of a true
model about that share of the positions lies within ±U. How far a single course may stay below it depends on how many
of its positions are independent of each other, which the turns show (`independent`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import erf, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Coded
from trunnion.rig.reading.measurement import Signal, rms, student

__all__ = ["Uncertainty", "Verdict", "expanded", "independent", "judge", "probability", "uncertainty_of"]

Array = NDArray[np.float64]
SURE = 2.326  # standard deviations: the share of a true model falls below its least in 1 % of courses
ROUNDING = 1e-9  # of the size of a course: differences below it are none
FAR = 3.0  # times the RMS of U, beyond which the RMS of a residual is no chance even where all positions err alike


class Verdict(Coded):
    """What a comparison of one course comes to."""

    WITHIN = 0, "within"
    OFFSET = 1, "offset only"
    NOT = 2, "not within"
    UNKNOWN = 3, "U unknown"
    NOTHING = 4, "no data"


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Standard uncertainty of a course, (position,), in its parts.

    random: of the mean over the turns; local: what else each position has by itself, such as the resolution; shared:
    (part, position), of the zero, the gain and the angle, each the same at all positions; turns: deviations of the
    turns from their mean, (turn, position).
    """

    random: Array
    local: Array
    shared: Array
    count: NDArray[np.intp]
    turns: Array

    @property
    def total(self) -> Array:
        """All together, NaN with fewer than two turns."""
        return np.asarray(np.sqrt(self.random**2 + self.local**2 + np.sum(self.shared**2, axis=0)))

    @property
    def freedom(self) -> Array:
        """Effective degrees of freedom by Welch and Satterthwaite, infinite without scatter; GUM, G.4.1."""
        with np.errstate(all="ignore"):
            freedom = (self.count - 1) / (self.random**2 / self.total**2) ** 2
        return np.where(np.isfinite(freedom), freedom, np.inf)

    def at(self, where: NDArray[np.bool_]) -> Uncertainty:
        """That of some of the positions."""
        return Uncertainty(*(part[..., where] for part in vars(self).values()))


def uncertainty_of(signal: Signal, angle: Array | float = 0.0) -> Uncertainty:
    """The parts of a signal's uncertainty; angle: (position,), that by the angle of the drive."""
    zero = np.full_like(signal.mean, np.hypot(signal.accuracy.zero, signal.accuracy.cut))
    random = signal.scatter / np.sqrt(np.maximum(signal.count, 1))
    local = np.hypot(np.full_like(random, signal.unresolved), signal.local)
    shared = np.array([zero, signal.accuracy.gain * signal.read, np.broadcast_to(angle, zero.shape)])
    return Uncertainty(random, local, shared, signal.count, signal.turns - signal.mean)


def probability(coverage: float) -> float:
    """Share of a normal distribution within ± so many standard deviations: 0.9545 for 2."""
    return erf(coverage / sqrt(2.0))


def expanded(standard: Array, freedom: Array, coverage: float) -> Array:
    """U = k_p u, with k_p of Student's distribution; GUM, G.3.2."""
    return np.asarray(student(freedom, coverage) * standard)


def judge(
    signal: Signal,
    model: Array,
    comparable: NDArray[np.bool_],
    drive: Array,
    coverage: float = 2.0,
    angle: Array | float = 0.0,
) -> dict[str, Any]:
    """Compare a signal with the model at the positions where that can be done.

    Parameters
    ----------
    signal : what was measured, turn by turn.
    model : (position,), the course of the model.
    comparable : (position,), where the model has one number.
    drive : (position,), coordinate of the driver.
    coverage : factor k of U = k u where turns are many.
    angle : (position,), standard uncertainty by the angle of the drive.

    Returns
    -------
    Courses, figures of the residual and verdict, by the name of the variable of a comparison; no figures where nothing
    can be compared.
    """
    where, every = comparable & np.isfinite(signal.mean) & np.isfinite(model), uncertainty_of(signal, angle)
    courses: dict[str, Any] = {
        "measured": signal.mean, "scatter": signal.scatter, "uncertainty": every.total,
        "expanded": expanded(every.total, every.freedom, coverage), "model": model,
        "residual": difference(signal.mean, model), "compared": where, "turns": len(signal.turns),
        "accuracy_zero": signal.accuracy.zero, "accuracy_gain": signal.accuracy.gain, "verdict": Verdict.NOTHING,
    }  # fmt: skip
    if not np.any(where):
        return courses
    measured, modelled, of = signal.mean[where], model[where], every.at(where)
    residual, size = difference(measured, modelled), float(np.max(np.abs([measured, modelled])))
    bias, bias_expanded, correlation = float(np.mean(residual)), np.nan, np.nan
    means = np.mean(_nearly_complete(of.turns), axis=1)
    if len(means) > 1:  # of the mean residual: scatter of the means of the turns, resolution, zero and gain
        random = np.array([np.std(means, ddof=1) / np.sqrt(len(means))])
        local = np.array([np.sqrt(np.mean(of.local**2) / len(of.local))])
        shared = np.mean(of.shared, axis=1, keepdims=True)
        mean = Uncertainty(random, local, shared, np.array([len(means)]), of.turns[:, :1])
        bias_expanded = float(expanded(mean.total, mean.freedom, coverage)[0])
    if min(np.max(np.abs(course - np.mean(course))) for course in (measured, modelled)) > ROUNDING * size:
        correlation = float(np.corrcoef(measured, modelled)[0, 1])  # Pearson's; of none that is flat
    worst = int(np.argmax(np.abs(residual)))
    share, least, near = _share(residual, of, coverage, ROUNDING * size)
    # a constant is taken out: what is left is against the scatter and what the gain makes of the shape
    shape = replace(of, shared=(of.shared - np.mean(of.shared, axis=1, keepdims=True))[1:])
    unbiased_share, unbiased_least, alike = _share(residual - bias, shape, coverage, ROUNDING * size)
    verdict = Verdict.OFFSET if alike and unbiased_share >= unbiased_least else Verdict.NOT
    verdict = Verdict.UNKNOWN if np.isnan(share) else Verdict.WITHIN if near and share >= least else verdict
    return courses | {
        "rms": rms(residual), "largest": float(residual[worst]), "largest_at": float(drive[where][worst]),
        "bias": bias, "bias_expanded": bias_expanded, "rms_unbiased": rms(residual - bias), "within": share,
        "within_least": least, "correlation": correlation, "verdict": verdict,
    }  # fmt: skip


def difference(measured: Array, model: Array) -> Array:
    """Measured less model, 0 where it is rounding."""
    residual = measured - model
    size = float(np.nanmax(np.abs(np.append(measured, model)), initial=0.0))
    return np.where(np.abs(residual) <= ROUNDING * size, 0.0, residual)


def _share(residual: Array, of: Uncertainty, coverage: float, rounding: float) -> tuple[float, float, bool]:
    """Share of the positions within ±U, and how small that of a true model may be; NaN if no uncertainty is known.

    And whether the residual as a whole is less than `FAR`: the share says nothing of how far off the others are.
    """
    limit, p = expanded(of.total, of.freedom, coverage), probability(coverage)
    finite = np.isfinite(limit)
    if not np.any(finite):
        return np.nan, np.nan, False
    share = float(np.mean(np.abs(residual[finite]) <= limit[finite] + rounding))
    least = p - SURE * float(np.sqrt(p * (1 - p) / independent(of.at(finite))))
    return share, least, rms(residual[finite]) <= FAR * rms(limit[finite] + rounding)


def independent(of: Uncertainty) -> float:
    """How many positions are as good as independent of each other: N²/Σρᵢⱼ², from 1 to N.

    Correlated are the parts shared by all positions, and the scatter as the turns show it; its Σρ² is that of n turns
    less what chance makes of n, by Srivastava (2005), J. Japan Statist. Soc. 35, 251-272. Two turns do not show it:
    then it is 1.
    """
    total, turns = of.total, _nearly_complete(of.turns)
    count, freedom = len(total), len(turns) - 1
    if freedom < 2 or not np.any(of.random > 0):
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


def _nearly_complete(turns: Array) -> Array:
    """The turns that have at least half of their positions, with no deviation where a position is missing."""
    return np.asarray(np.nan_to_num(turns[np.mean(np.isfinite(turns), axis=1) >= 0.5]))
