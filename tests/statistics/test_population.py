"""Many numbers drawn together: each as by itself, correlated ones jointly normal."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from trunnion.statistics.population import Marginal, Population
from trunnion.statistics.streams import correlated, factor, uniforms

MARGINALS = [
    Marginal("normal", -1e-5, 3e-5, {"cp": 1.33}),
    Marginal("uniform", -1.0, 1.0),
    Marginal("normal", -2.0, 2.0),
    Marginal("sample", options={"values": (0.3, -0.1, 0.2)}),
    Marginal("beta", 0.0, 5.0, {"alpha": 2.0, "beta": 5.0}),
    Marginal("direction"),
    Marginal("triangular", -1.0, 2.0),
]
MATRIX = np.eye(7)
for i, j, r in ((0, 2, 0.6), (0, 1, -0.4), (2, 4, 0.3)):
    MATRIX[i, j] = MATRIX[j, i] = r
U = uniforms(2, 5, 7, 200_000)


def test_independent_as_each_by_itself() -> None:
    drawn = Population(MARGINALS).draw(U)
    for row, marginal in enumerate(MARGINALS):
        np.testing.assert_array_equal(drawn[row], marginal.quantile(U[row]))


def test_correlated_as_by_the_copula() -> None:
    population = Population(MARGINALS, MATRIX)
    drawn, u = population.draw(U), correlated(U, factor(MATRIX))
    for row, marginal in enumerate(MARGINALS):
        expected = marginal.quantile(u[row] if row in (0, 1, 2, 4) else U[row])
        np.testing.assert_allclose(drawn[row], expected, rtol=1e-9, atol=1e-11 * marginal.deviation)
    np.testing.assert_allclose(drawn.mean(axis=1), population.means, atol=0.01 * population.deviations.max())
    scale = np.outer(population.deviations, population.deviations)
    np.testing.assert_allclose(np.cov(drawn) / scale, population.covariance() / scale, atol=0.012)
    one, two = ((drawn[row] - population.means[row]) / population.deviations[row] for row in (0, 2))
    assert stats.kstest(one - two, "norm", (0, np.sqrt(2 - 2 * 0.6))).pvalue > 1e-3


def test_covariance_in_closed_form() -> None:
    """Normal: ρ σ σ. Uniform with uniform: (6/π) asin(ρ/2) times the variances; with normal: ρ √(3/π)."""
    marginals = [
        Marginal("normal", -3, 3),
        Marginal("uniform", -1, 1),
        Marginal("uniform", -1, 1),
        Marginal("normal", 0, 1),
    ]
    matrix = np.array([[1, 0.5, 0.2, 1.0], [0.5, 1, 0.8, 0.5], [0.2, 0.8, 1, 0.2], [1.0, 0.5, 0.2, 1]])
    population = Population(marginals, matrix)
    s, covariance = population.deviations, population.covariance()
    assert covariance[1, 2] == pytest.approx(6 / np.pi * np.arcsin(0.4) * s[1] * s[2], rel=1e-6)
    assert covariance[0, 1] == pytest.approx(0.5 * np.sqrt(3 / np.pi) * s[0] * s[1], rel=1e-6)
    assert covariance[0, 3] == pytest.approx(s[0] * s[3], rel=1e-9)
    np.testing.assert_array_equal(Population(marginals).covariance(), np.diag(s**2))
    drawn = population.draw(uniforms(1, 1, 4, 50))
    np.testing.assert_allclose(drawn[3], 0.5 + drawn[0] / 6, rtol=1e-12)


def test_same_bits_for_part_of_a_block() -> None:
    population = Population(MARGINALS, MATRIX)
    np.testing.assert_array_equal(
        population.draw(uniforms(1, 3, 7, 227))[:, :31], population.draw(uniforms(1, 3, 7, 31))
    )


def test_nothing_to_draw() -> None:
    population = Population([])
    assert population.draw(uniforms(1, 0, 0, 5)).shape == (0, 5)
    assert population.means.shape == population.deviations.shape == (0,)
