"""Many numbers at once: each with its distribution, some of them correlated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

from trunnion.statistics.distributions import DISTRIBUTIONS, Distribution, Options, normal_parameters
from trunnion.statistics.streams import factor, mixed

__all__ = ["Marginal", "Population"]

Floats = NDArray[np.float64]
_BELOW_ONE = 1 - 2.0**-53


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
        return self.kind.mean(self.lower, self.upper, self.options)

    @property
    def deviation(self) -> float:
        """Standard deviation."""
        return float(np.sqrt(self.kind.variance(self.lower, self.upper, self.options)))

    def quantile(self, u: Any) -> Floats:
        """Deviation that the share u does not exceed."""
        return self.kind.quantile(np.asarray(u, dtype=np.float64), self.lower, self.upper, self.options)

    def of_scores(self, z: Floats) -> Floats:
        """Deviation of normal scores z = Φ⁻¹(u); for a normal distribution without the way through u."""
        if self.distribution == "normal":
            mean, sigma = normal_parameters(self.lower, self.upper, self.options)
            return mean + sigma * z
        return self.quantile(np.clip(special.ndtr(z), 2.0**-1000, _BELOW_ONE))


def _prepared(marginal: Marginal) -> Marginal:
    """With measured values sorted once and not at every draw."""
    if "values" not in marginal.options:
        return marginal
    values = np.sort(np.asarray(marginal.options["values"], dtype=np.float64))
    return replace(marginal, options={**marginal.options, "values": values})


class Population:
    """Numbers with their distributions, joined by a Gaussian copula.

    correlation: of the normal scores, (n, n), positive semidefinite; None: independent. Normal numbers are then jointly
    normal with that correlation exactly. Source: M. C. Cario, B. L. Nelson,
    Modeling and generating random vectors with arbitrary marginal distributions and correlation matrix, Northwestern
    University (1997).
    """

    def __init__(self, marginals: Sequence[Marginal], correlation: Any = None) -> None:
        self.marginals = tuple(_prepared(marginal) for marginal in marginals)
        self.dims = len(self.marginals)
        self.correlation = np.eye(self.dims) if correlation is None else np.asarray(correlation, dtype=np.float64)
        off = self.correlation - np.diag(np.diag(self.correlation))
        self._joined = np.flatnonzero(np.any(off != 0, axis=1))
        self._factor = factor(self.correlation[np.ix_(self._joined, self._joined)])
        joined = set(self._joined.tolist())
        names = [marginal.distribution for marginal in self.marginals]
        self._normal = np.array([row for row, name in enumerate(names) if name == "normal"], dtype=np.intp)
        self._others = [row for row, name in enumerate(names) if name != "normal" and row not in joined]
        parameters = [
            normal_parameters(m.lower, m.upper, m.options) for m in self.marginals if m.distribution == "normal"
        ]
        self._means, self._sigmas = np.array(parameters, dtype=np.float64).reshape(-1, 2, 1).transpose(1, 0, 2)

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
        drawn = np.empty_like(u)
        scores: Mapping[int, Floats] = {}
        if self._joined.size:
            z = mixed(special.ndtri(u[self._joined]), self._factor)
            scores = dict(zip(self._joined.tolist(), z, strict=True))
        if self._normal.size:
            z = special.ndtri(u[self._normal])
            for place, row in enumerate(self._normal.tolist()):
                if row in scores:
                    z[place] = scores[row]
            drawn[self._normal] = self._means + self._sigmas * z
        for row in self._others:
            drawn[row] = self.marginals[row].quantile(u[row])
        for row, z in scores.items():
            if self.marginals[row].distribution != "normal":
                drawn[row] = self.marginals[row].of_scores(z)
        return drawn
