"""Distributions of a deviation from nominal between limits, random numbers, and the numbers that are drawn by them.

A deviation and its limits (lower ≤ upper, signed, measured from nominal) have the unit of the number they belong to.
A distribution is one entry of `DISTRIBUTIONS`: functions of (u, lower, upper, options) where options are the
numbers of the entry's `parameters`; those left out have the default there (None: worked out from the others, as the
function says). Every quantile is finite for u in (0, 1) and keeps the precision of 1 − u near 1 as that of u near 0.
By hand and not by scipy.stats, which takes 1.6 s to import and loses six digits of the deviation where a normal
distribution is cut far out.

`uniforms` gives the random numbers of a block from (seed, block), `sobol` those of a point from (seed, replicate,
index): any process may work out any part, in any order, and finds the same bits. Arrays are (dims, count). All are odd
multiples of 2⁻⁵³ or 2⁻³³ in (0, 1): never 0 or 1, and 1 − u is exact.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

Floats = NDArray[np.float64]
Options = Mapping[str, Any]
BITS, SOBOL_BITS = 52, 32  # of random numbers
BELOW_ONE = 1 - 2.0**-53


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


# ---- random numbers ---------------------------------------------------------------------------------------------


def uniforms(seed: int, block: int, dims: int, count: int) -> Floats:
    """Numbers uniform in (0, 1) of one block, (dims, count); a shorter block holds the first columns of a longer one.

    Philox4x64-10 with the seed as key; the block is the third word of the counter, so blocks never overlap.
    Source: J. K. Salmon, M. A. Moraes, R. O. Dror, D. E. Shaw, Parallel random numbers: as easy as 1, 2, 3, Proc. SC11
    (2011), doi:10.1145/2063384.2063405. seed: 0 ≤ seed < 2¹²⁸; block: 0 ≤ block < 2⁶⁴.
    """
    if not 0 <= seed < 1 << 128:
        raise ValueError(f"seed {seed} is not in 0 ... 2^128 - 1")
    key = np.array([seed & 0xFFFFFFFFFFFFFFFF, seed >> 64], dtype=np.uint64)
    counter = np.array([0, 0, block, 0], dtype=np.uint64)
    words = np.random.Philox(key=key, counter=counter).random_raw(dims * count) >> np.uint64(64 - BITS)
    # drawn sample by sample, so that the first samples stay the same when a block is filled further
    return np.ascontiguousarray(((words.astype(np.float64) + 0.5) * 2.0**-BITS).reshape(count, dims).T)


def sobol(seed: int, replicate: int, dims: int, first: int, count: int) -> Floats:
    """Points first ≤ index < first + count of a Sobol sequence scrambled by (seed, replicate), (dims, count).

    Each point alone is uniform, the points of a replicate together are even (every 2ᵐ from the start are a net), and
    replicates are independent: the mean over replicates has no bias, and their spread gives its error.
    By `scipy.stats.qmc.Sobol`: directions of S. Joe, F. Y. Kuo, SIAM J. Sci. Comput. 30 (2008) 2635-2654,
    doi:10.1137/070709359; linear matrix scramble and digital shift of J. Matoušek, J. Complexity 14 (1998) 527-556,
    doi:10.1006/jcom.1998.0489.
    """
    from scipy.stats import qmc  # takes longer to import than all the rest here

    engine: Any = qmc.Sobol(dims, bits=SOBOL_BITS, rng=np.random.default_rng([seed, replicate]))
    if first:
        engine.fast_forward(first)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # that so many points are no net
        points: Floats = engine.random(count)
    return np.ascontiguousarray(points.T) + 2.0 ** -(SOBOL_BITS + 1)


def factor(correlation: Any) -> Floats:
    """Lower triangle L with L Lᵀ = correlation, of a positive semidefinite matrix; ValueError if it is not.

    Cholesky's; a number that those before it determine (pivot 0 to rounding) has a zero on the diagonal.
    """
    matrix = np.asarray(correlation, dtype=np.float64)
    size = len(matrix)
    lower, rounding = np.zeros((size, size)), 1e-12 * size
    for j in range(size):
        rest = matrix[j:, j] - lower[j:, :j] @ lower[j, :j]
        if rest[0] > rounding:
            lower[j:, j] = rest / np.sqrt(rest[0])
        elif rest[0] < -rounding or np.any(np.abs(rest) > np.sqrt(rounding)):
            raise ValueError("the correlations contradict one another: their matrix is not positive semidefinite")
    return lower


def mixed(scores: Floats, matrix: Floats) -> Floats:
    """M z, summed in fixed order: a matrix product of a library may depend on the number of columns in its last bit."""
    mixed = np.zeros_like(scores)
    for place, score in enumerate(scores):
        mixed += matrix[:, place, None] * score
    return mixed


def correlated(u: Floats, matrix: Floats) -> Floats:
    """Uniform numbers whose normal scores Φ⁻¹(u) are mixed: Φ(M Φ⁻¹(u)), a Gaussian copula. (dims, count).

    u: independent, in (0, 1); matrix: L of `factor` to correlate them, or a rotation, which leaves them independent.
    The result is kept in (0, 1).
    """
    shares = special.ndtr(mixed(special.ndtri(u), matrix))
    return np.asarray(np.clip(shares, 2.0**-1000, BELOW_ONE), dtype=np.float64)


# ---- numbers with a distribution --------------------------------------------------------------------------------


@dataclass(frozen=True)
class Marginal:
    """Distribution of one number: name of the kind, limits of its deviation and the options of the kind."""

    distribution: str
    lower: float = 0.0
    upper: float = 0.0
    options: Options = field(default_factory=dict)

    @property
    def kind(self) -> Distribution:
        """Its entry of `DISTRIBUTIONS`."""
        return DISTRIBUTIONS[self.distribution]

    @property
    def mean(self) -> float:
        """Mean deviation from nominal."""
        return self.kind.moments(self.lower, self.upper, self.options)[0]

    @property
    def deviation(self) -> float:
        """Standard deviation."""
        return float(np.sqrt(self.kind.moments(self.lower, self.upper, self.options)[1]))

    def quantile(self, u: Any) -> Floats:
        """Deviation that the share u does not exceed."""
        return self.kind.quantile(np.asarray(u, dtype=np.float64), self.lower, self.upper, self.options)

    def of_scores(self, z: Floats) -> Floats:
        """Deviation of normal scores z = Φ⁻¹(u); for a normal distribution without the way through u."""
        if self.distribution == "normal":
            mean, sigma = normal_parameters(self.lower, self.upper, self.options)
            return mean + sigma * z
        return self.quantile(np.clip(special.ndtr(z), 2.0**-1000, BELOW_ONE))


class Population:
    """Numbers with their distributions, joined by a Gaussian copula.

    correlation: of the normal scores, (n, n), positive semidefinite; None: independent. Normal numbers are then jointly
    normal with that correlation exactly. Source: M. C. Cario, B. L. Nelson,
    Modeling and generating random vectors with arbitrary marginal distributions and correlation matrix, Northwestern
    University (1997).
    """

    def __init__(self, marginals: Sequence[Marginal], correlation: Any = None) -> None:
        self.marginals = tuple(marginals)
        self.dims = len(self.marginals)
        self.correlation = np.eye(self.dims) if correlation is None else np.asarray(correlation, dtype=np.float64)
        off = self.correlation - np.diag(np.diag(self.correlation))
        joined = np.any(off != 0, axis=1)
        scored = joined | np.array([each.distribution == "normal" for each in self.marginals], bool)
        self._joined, self._scored = np.flatnonzero(joined), np.flatnonzero(scored)
        self._among = np.flatnonzero(joined[scored])  # places of the former among the latter
        self._factor = factor(self.correlation[np.ix_(self._joined, self._joined)])

    @cached_property
    def means(self) -> Floats:
        """Mean deviations, (dims,)."""
        return np.array([marginal.mean for marginal in self.marginals], dtype=np.float64)

    @cached_property
    def deviations(self) -> Floats:
        """Standard deviations, (dims,)."""
        return np.array([marginal.deviation for marginal in self.marginals], dtype=np.float64)

    def covariance(self) -> Floats:
        """Covariance of the deviations, (dims, dims): of a pair Σ ρᵏ a_k b_k, k = 1 ... 60.

        a_k = E[x(z) h_k(z)] with the normalised Hermite polynomials h_k of the normal score z (Mehler's formula), by
        the trapezoidal rule; for normal numbers ρ σ σ exactly. Variances, on the diagonal, are those of the marginals.
        """
        covariance = np.diag(self.deviations**2)
        if not self._joined.size:
            return covariance
        z = np.arange(-1064, 1065) / 128  # ±8.3
        weight = np.exp(-z * z / 2) / (128 * np.sqrt(2 * np.pi))
        x = np.stack([self.marginals[row].of_scores(z) for row in self._joined.tolist()])
        before, polynomial = np.zeros_like(z), np.ones_like(z)
        rho = self.correlation[np.ix_(self._joined, self._joined)]
        power, total = np.ones_like(rho), np.zeros_like(rho)
        for degree in range(60):
            before, polynomial = polynomial, (z * polynomial - np.sqrt(degree) * before) / np.sqrt(degree + 1)
            part = x @ (weight * polynomial)
            power = power * rho
            total += power * np.outer(part, part)
        covariance[np.ix_(self._joined, self._joined)] = total
        np.fill_diagonal(covariance, self.deviations**2)
        return covariance

    def draw(self, u: Floats) -> Floats:
        """Deviations of independent uniform numbers u in (0, 1), (dims, count) both."""
        scores = special.ndtri(u[self._scored])
        scores[self._among] = mixed(scores[self._among], self._factor)
        by_row = dict(zip(self._scored.tolist(), scores, strict=True))
        drawn = np.empty_like(u)
        for row, marginal in enumerate(self.marginals):
            drawn[row] = marginal.of_scores(by_row[row]) if row in by_row else marginal.quantile(u[row])
        return drawn
