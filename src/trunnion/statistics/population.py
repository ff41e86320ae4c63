"""Many numbers at once: each with its distribution, some of them correlated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
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

    @property
    def means(self) -> Floats:
        """Mean deviations, (dims,)."""
        return np.array([marginal.mean for marginal in self.marginals], dtype=np.float64)

    @property
    def deviations(self) -> Floats:
        """Standard deviations, (dims,)."""
        return np.array([marginal.deviation for marginal in self.marginals], dtype=np.float64)

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
