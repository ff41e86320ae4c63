"""The uncertainty of a measured course: of each position, in its parts, and of means over positions; GUM."""

from __future__ import annotations

from dataclasses import dataclass
from math import erf, sqrt

import numpy as np
from numpy.typing import NDArray

from trunnion.rig.reading.measurement import Signal

__all__ = [
    "Uncertainty", "at_positions", "expanded", "mean_expanded", "nearly_whole", "probability", "uncertainty_of",
]  # fmt: skip

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Standard uncertainty of a course, (position,), in its parts.

    random: of the mean over the turns; local: what else each position has of its own, such as the resolution; shared:
    (part, position), of the zero and of the gain, each the same at all positions; turns: deviations of the turns from
    their mean, (turn, position).
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
        """Effective degrees of freedom by Welch and Satterthwaite: ν u⁴/u_A⁴, infinite without scatter. GUM, G.4.1."""
        with np.errstate(all="ignore"):
            share = self.random**2 / np.where(self.total > 0, self.total, np.nan) ** 2
            found = (self.count - 1) / np.where(share > 0, share, np.nan) ** 2
        return np.where(np.isfinite(found), found, np.inf)


def probability(coverage: float) -> float:
    """Share of a normal distribution within ± so many standard deviations: 0.9545 for 2."""
    return erf(coverage / sqrt(2.0))


def expanded(standard: Array, freedom: Array, coverage: float) -> Array:
    """U = k_p u, with k_p of Student's distribution; GUM, G.3.2."""
    from scipy.special import stdtrit

    factor = stdtrit(np.where(np.isinf(freedom), 1e12, freedom), 0.5 + probability(coverage) / 2)
    return np.asarray(np.where(np.isinf(freedom), coverage, factor) * standard)


def uncertainty_of(course: Signal) -> Uncertainty:
    """The parts of a course's uncertainty."""
    zero = np.full_like(course.mean, np.hypot(course.accuracy.zero, course.accuracy.cut))
    shared = np.array([zero, course.accuracy.gain * course.read])
    random = course.scatter / np.sqrt(np.maximum(course.count, 1))
    local = np.sqrt(np.maximum(course.uncertainty**2 - random**2 - np.sum(shared**2, axis=0), 0.0))
    return Uncertainty(random, local, shared, course.count, course.turns - course.mean)


def at_positions(of: Uncertainty, where: NDArray[np.bool_]) -> Uncertainty:
    """The uncertainty at some of the positions."""
    return Uncertainty(of.random[where], of.local[where], of.shared[:, where], of.count[where], of.turns[:, where])


def nearly_whole(turns: Array) -> Array:
    """The turns of which at least half is there, with no deviation where a position is missing."""
    there = np.mean(np.isfinite(turns), axis=1) >= 0.5
    return np.asarray(np.nan_to_num(turns[there]))


def mean_expanded(of: Uncertainty, coverage: float) -> float:
    """U of the mean residual: scatter of the means of the turns, zero and gain; NaN with fewer than two turns."""
    means = np.mean(nearly_whole(of.turns), axis=1)
    if len(means) < 2:
        return float("nan")
    random = np.array([np.std(means, ddof=1) / np.sqrt(len(means))])
    local = np.array([np.sqrt(np.mean(of.local**2) / len(of.local))])
    shared = np.mean(of.shared, axis=1, keepdims=True)
    own = Uncertainty(random, local, shared, np.array([len(means)]), of.turns[:, :1])
    return float(expanded(own.total, own.freedom, coverage)[0])
