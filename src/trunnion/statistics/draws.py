"""Random numbers that depend on their place alone, and what they are turned into: distributions of several numbers.

`uniforms` gives the numbers of a block from (seed, block), `sobol` those of a point from (seed, replicate, index): any
process may work out any part, in any order, and finds the same bits. Arrays are (dims, count). All numbers are odd
multiples of 2⁻⁵³ or 2⁻³³ in (0, 1): never 0 or 1, and 1 − u is exact.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

from trunnion.statistics.distributions import DISTRIBUTIONS, Distribution, Options, normal_parameters

Floats = NDArray[np.float64]
BITS, SOBOL_BITS = 52, 32  # of random numbers
BELOW_ONE = 1 - 2.0**-53


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
        self.marginals = tuple(  # measured values sorted once and not at every draw
            replace(each, options={**each.options, "values": np.sort(np.asarray(each.options["values"], float))})
            if "values" in each.options else each for each in marginals
        )  # fmt: skip
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
