"""Distributions of a deviation from nominal between limits, each by its quantile function.

A deviation and its limits (lower ≤ upper, signed, measured from nominal) have the unit of the number they belong to.
A distribution is one entry of `DISTRIBUTIONS`: functions of (u, lower, upper, options) where options are the
numbers of the entry's `parameters`; those left out have the default there (None: worked out from the others, as the
function says). Every quantile is finite for u in (0, 1) and keeps the precision of 1 − u near 1 as that of u near 0.

By hand and not by scipy.stats, which takes 1.6 s to import and loses six digits of the deviation where a normal
distribution is cut far out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

Floats = NDArray[np.float64]
Options = Mapping[str, Any]


@dataclass(frozen=True)
class Distribution:
    """A kind of distribution of deviations.

    parameters: names of the options with their defaults; None: worked out, or (`values`) must be given.
    quantile: (u, lower, upper, options) → array of the shape of u; moments: (lower, upper, options) → mean, variance.
    bounded: whether no deviation lies outside its limits; sample and direction are bounded by their own values.
    """

    name: str
    long_name: str
    quantile: Callable[[Floats, float, float, Options], Floats]
    moments: Callable[[float, float, Options], tuple[float, float]]
    parameters: Mapping[str, float | None] = field(default_factory=dict)
    bounded: bool = True


def _number(options: Options, name: str, default: float) -> float:
    value = options.get(name)
    return default if value is None else float(value)


# ---- normal ---------------------------------------------------------------------------------------------------


def normal_parameters(lower: float, upper: float, options: Options) -> tuple[float, float]:
    """Mean and standard deviation of a normal distribution from limits and capability.

    σ = (upper − lower)/(6 C_p); mean = (lower + upper)/2 + shift. A shift that is not given is 3 σ (C_p − C_pk): the
    mean lies on the side of the upper limit. C_p = 1 and C_pk = C_p unless given. Source of the indices:
    V. E. Kane, Process capability indices, J. Quality Technology 18 (1986) 41-52,
    doi:10.1080/00224065.1986.11978984.
    """
    cp = _number(options, "cp", 1.0)
    sigma = (upper - lower) / (6 * cp)
    shift = _number(options, "shift", 3 * sigma * (cp - _number(options, "cpk", cp)))
    return (lower + upper) / 2 + shift, sigma


def _normal_quantile(u: Floats, lower: float, upper: float, options: Options) -> Floats:
    """mean + σ Φ⁻¹(u)."""
    mean, sigma = normal_parameters(lower, upper, options)
    return np.asarray(mean + sigma * special.ndtri(u), dtype=np.float64)


def _normal_moments(lower: float, upper: float, options: Options) -> tuple[float, float]:
    mean, sigma = normal_parameters(lower, upper, options)
    return mean, sigma**2


# ---- triangular -----------------------------------------------------------------------------------------------


def _mode(lower: float, upper: float, options: Options) -> float:
    return min(max(_number(options, "mode", (lower + upper) / 2), lower), upper)


def _triangular_quantile(u: Floats, lower: float, upper: float, options: Options) -> Floats:
    """lower + √(u w (mode − lower)) left of the mode, upper − √((1 − u) w (upper − mode)) right of it, w = width."""
    u, mode, width = np.asarray(u), _mode(lower, upper, options), upper - lower
    left = lower + np.sqrt(u * (width * (mode - lower)))
    right = upper - np.sqrt((1 - u) * (width * (upper - mode)))
    return np.clip(np.where(u * width < mode - lower, left, right), lower, upper)


def _triangular_moments(lower: float, upper: float, options: Options) -> tuple[float, float]:
    """Mean, and variance (w² − (mode − lower)(upper − mode))/18, w = upper − lower."""
    mode = _mode(lower, upper, options)
    return (lower + upper + mode) / 3, ((upper - lower) ** 2 - (mode - lower) * (upper - mode)) / 18


# ---- truncated normal -----------------------------------------------------------------------------------------


def _truncation(lower: float, upper: float, options: Options) -> tuple[float, float, float, float, float]:
    """Mean and σ before the cut, the cuts a < b in units of σ from the mean, and −1 if both were mirrored to a + b ≤ 0.

    Mirrored, the greater part of what is cut off is on the right, and probabilities are those of the left tail, which
    is the one that floats resolve.
    """
    mean, sigma = normal_parameters(lower, upper, options)
    a, b = (lower - mean) / sigma, (upper - mean) / sigma
    return (mean, sigma, -b, -a, -1.0) if a + b > 0 else (mean, sigma, a, b, 1.0)


def _truncated_quantile(u: Floats, lower: float, upper: float, options: Options) -> Floats:
    """Quantile of a normal distribution cut off at its limits: Φ(z) = Φ(a) + u (Φ(b) − Φ(a)) in whichever tail is near.

    With a whole range in the left tail (b ≤ 0) logarithms are taken: it is finite however far the mean lies outside.
    """
    u = np.asarray(u, dtype=np.float64)
    if upper == lower:
        return np.full_like(u, lower)
    mean, sigma, a, b, sign = _truncation(lower, upper, options)
    u, v = (u, 1 - u) if sign > 0 else (1 - u, u)
    if b <= 0:
        ratio = math.exp(special.log_ndtr(a) - special.log_ndtr(b))
        z = special.ndtri_exp(special.log_ndtr(b) + np.log(u + v * ratio))
    else:
        below, above = special.ndtr(a), special.ndtr(-b)
        left, right = v * below + u * special.ndtr(b), u * above + v * special.ndtr(-a)
        near = left < right
        z = special.ndtri(np.where(near, left, right))
        z = np.where(near, z, -z)
    return np.asarray(np.clip(mean + (sign * sigma) * z, lower, upper), dtype=np.float64)


def _truncated_moments(lower: float, upper: float, options: Options) -> tuple[float, float]:
    """Mean and variance by Gauss-Legendre quadrature; closed forms lose their digits when the cut is narrow or far out.

    In z = −b … −a the density is exp(−z²/2); beyond exp(−40) of its greatest value it is left out.
    """
    if upper == lower:
        return lower, 0.0
    mean, sigma, a, b, sign = _truncation(lower, upper, options)
    peak = min(b, 0.0)
    reach = math.sqrt(peak * peak + 80)
    start, end = max(a, -reach), min(b, reach)
    nodes, weights = np.polynomial.legendre.leggauss(120)
    z = (start + end) / 2 + (end - start) / 2 * nodes
    weights = weights * np.exp((peak - z) * (peak + z) / 2)
    weights /= weights.sum()
    middle = float(weights @ z)
    return mean + sign * sigma * middle, sigma * sigma * float(weights @ (z - middle) ** 2)


# ---- beta -----------------------------------------------------------------------------------------------------


def _shapes(options: Options) -> tuple[float, float]:
    return _number(options, "alpha", 2.0), _number(options, "beta", 2.0)


def _beta_quantile(u: Floats, lower: float, upper: float, options: Options) -> Floats:
    """lower + w I⁻¹(u; α, β), above the middle upper − w I⁻¹(1 − u; β, α): neither tail is lost beside the other."""
    (alpha, beta), u, width = _shapes(options), np.maximum(u, 2.0**-60), upper - lower  # of rarer ones there is none
    below = lower + width * special.betaincinv(alpha, beta, np.minimum(u, 0.5))
    above = upper - width * special.betaincinv(beta, alpha, np.minimum(1 - u, 0.5))
    return np.asarray(np.where(u <= 0.5, below, above), dtype=np.float64)


def _beta_moments(lower: float, upper: float, options: Options) -> tuple[float, float]:
    """Mean, and variance w² α β/((α + β)² (α + β + 1))."""
    alpha, beta = _shapes(options)
    both = alpha + beta
    return (lower * beta + upper * alpha) / both, (upper - lower) ** 2 * alpha * beta / (both**2 * (both + 1))


# ---- sample ---------------------------------------------------------------------------------------------------


def _values(options: Options) -> Floats:
    return np.sort(np.asarray(options["values"], dtype=np.float64))


def _sample_quantile(u: Floats, lower: float, upper: float, options: Options) -> Floats:
    """Inverse of the empirical distribution function: the ⌈n u⌉th smallest of the n values, each with chance 1/n."""
    values = _values(options)
    place = np.ceil(np.asarray(u) * values.size).astype(np.int64) - 1
    return values[np.clip(place, 0, values.size - 1)]


CAPABILITY: Mapping[str, float | None] = {"cp": 1.0, "cpk": None, "shift": None}
DISTRIBUTIONS: dict[str, Distribution] = {entry.name: entry for entry in (
    Distribution(
        "normal", "normal, spread by the capability of the process", _normal_quantile, _normal_moments, CAPABILITY,
        bounded=False,
    ),
    Distribution(
        "uniform", "uniform between the limits",
        lambda u, lower, upper, options: lower + (upper - lower) * np.asarray(u),
        lambda lower, upper, options: ((lower + upper) / 2, (upper - lower) ** 2 / 12),
    ),
    Distribution(
        "triangular", "triangular between the limits", _triangular_quantile, _triangular_moments, {"mode": None},
    ),
    Distribution("truncated", "normal, cut off at the limits", _truncated_quantile, _truncated_moments, CAPABILITY),
    Distribution(
        "beta", "beta between the limits", _beta_quantile, _beta_moments, {"alpha": 2.0, "beta": 2.0},
    ),
    # of measured values as a population: they are all there is to be drawn, so the divisor of the variance is n
    Distribution(
        "sample", "drawn from measured values", _sample_quantile,
        lambda lower, upper, options: (float(np.mean(_values(options))), float(np.var(_values(options)))),
        {"values": None},
    ),
    Distribution(  # the limits do not matter
        "direction", "any angle with the same chance",
        lambda u, lower, upper, options: -math.pi + (math.pi - -math.pi) * np.asarray(u),
        lambda lower, upper, options: (0.0, math.pi**2 / 3),
    ),
)}  # fmt: skip
