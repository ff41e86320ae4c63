"""Capability of a process and the yield that a normal distribution has between limits."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

__all__ = ["cp", "cpk", "normal_yield", "two_sided"]

Floats = NDArray[np.float64]


def cp(lower: Any, upper: Any, sigma: Any) -> Floats:
    """Capability C_p = (upper − lower)/(6 σ): what the limits leave against what the process spreads. NaN if a limit is
    infinite; ∞ for σ = 0. Source: V. E. Kane, Process capability indices, J. Quality Technology 18 (1986) 41-52,
    doi:10.1080/00224065.1986.11978984.
    """
    width = np.asarray(upper, dtype=np.float64) - np.asarray(lower, dtype=np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(np.isfinite(width), width / (6 * np.asarray(sigma, dtype=np.float64)), np.nan)


def cpk(lower: Any, upper: Any, mean: Any, sigma: Any) -> Floats:
    """C_pk = min(upper − mean, mean − lower)/(3 σ), the capability towards the nearer limit; an infinite limit does not
    count, and with none it is NaN. Source: as `cp`.
    """
    mean = np.asarray(mean, dtype=np.float64)
    room = np.minimum(np.asarray(upper, dtype=np.float64) - mean, mean - np.asarray(lower, dtype=np.float64))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(np.isfinite(room), room / (3 * np.asarray(sigma, dtype=np.float64)), np.nan)


def two_sided(lower: Any, upper: Any, mean: Any, sigma: Any) -> tuple[Floats, Floats]:
    """(C_p, C_pk) of a figure with mean and standard deviation between limits; of one limit alone C_p is NaN."""
    return cp(lower, upper, sigma), cpk(lower, upper, mean, sigma)


def normal_yield(lower: Any, upper: Any, mean: Any, sigma: Any) -> Floats:
    """Share of a normal distribution between the limits, Φ((upper − mean)/σ) − Φ((lower − mean)/σ); they may be ±∞."""
    with np.errstate(divide="ignore", invalid="ignore"):
        a = (np.asarray(lower, dtype=np.float64) - mean) / sigma
        b = (np.asarray(upper, dtype=np.float64) - mean) / sigma
    # 0/0: without spread and right at a limit, which is within it.
    a, b = np.where(np.isnan(a), -np.inf, a), np.where(np.isnan(b), np.inf, b)
    # Beyond the mean the difference is taken in the left tail, where it keeps its digits.
    right = a > -b
    a, b = np.where(right, -b, a), np.where(right, -a, b)
    return np.asarray(special.ndtr(b) - special.ndtr(a), dtype=np.float64)
