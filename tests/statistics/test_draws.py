"""Random numbers by place: Philox worked out here, Sobol nets, correlated numbers; any part the same bits."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from trunnion.statistics.draws import Marginal, Population, correlated, factor, sobol, uniforms

MASK = (1 << 64) - 1


def philox(counter, key):
    """Philox4x64-10 of Salmon et al. (2011), in whole numbers."""
    c, k = list(counter), list(key)
    for _ in range(10):
        first, second = 0xD2E7470EE14C6C93 * c[0], 0xCA5A826395121157 * c[2]
        c = [second >> 64 ^ c[1] ^ k[0], second & MASK, first >> 64 ^ c[3] ^ k[1], first & MASK]
        k = [k[0] + 0x9E3779B97F4A7C15 & MASK, k[1] + 0xBB67AE8584CAA73B & MASK]
    return c


def test_philox_known_answer():
    """The authors' test vector for counter 0, key 0 (Random123, kat_vectors)."""
    known = [0x16554D9ECA36314C, 0xDB20FE9D672D0FDC, 0xD7E772CEE186176B, 0x7E68B68AEC7BA23B]
    assert philox([0, 0, 0, 0], [0, 0]) == known


@pytest.mark.parametrize("seed", [0, 1, 2**64 + 5, 2**128 - 1])
@pytest.mark.parametrize("block", [0, 7, 2**40])
def test_uniforms_are_philox(seed, block):
    words = [w for n in range(1, 4) for w in philox([n, 0, block, 0], [seed & MASK, seed >> 64])]
    expected = (np.array([w >> 12 for w in words], dtype=np.float64) + 0.5) / 2**52
    np.testing.assert_array_equal(uniforms(seed, block, 4, 3), expected.reshape(3, 4).T)


def test_seed_out_of_range():
    with pytest.raises(ValueError, match="seed -1"):
        uniforms(-1, 0, 1, 1)


# Sobol
@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**50), st.integers(0, 50), st.integers(1, 9), st.integers(0, 2**14), st.integers(1, 40))
def test_any_part_the_same_bits(seed, replicate, dims, first, count):
    together = sobol(seed, replicate, dims, first, count + 7)
    np.testing.assert_array_equal(sobol(seed, replicate, dims, first + 7, count), together[:, 7:])


@pytest.mark.parametrize("replicate", [0, 3])
def test_scrambled_points_are_a_net(replicate):
    """Every 2ᵐ points from a multiple of 2ᵐ on have one in each 2ᵐth of every axis; 1, 2 are a (0, m, 2)-net."""
    for first in (0, 1 << 10, 7 << 10):
        points = sobol(5, replicate, 20, first, 1 << 10)
        assert (np.sort(np.floor(points * 2**10), axis=1) == np.arange(2**10)).all()
        for power in range(11):
            cell = np.floor(points[0] * 2**power) * 2 ** (10 - power) + np.floor(points[1] * 2 ** (10 - power))
            assert len(set(cell)) == 2**10
    assert (points > 0).all()
    assert (points < 1).all()


# correlation
@given(st.integers(0, 1000), st.integers(1, 8), st.integers(1, 8))
def test_factor_of_any_rank(seed, size, rank):
    rows = np.random.default_rng(seed).normal(size=(size, rank))
    rows /= np.linalg.norm(rows, axis=1)[:, None]
    lower = factor(rows @ rows.T)
    np.testing.assert_allclose(lower @ lower.T, rows @ rows.T, atol=1e-7)
    assert (np.triu(lower, 1) == 0).all()


@pytest.mark.parametrize(
    "matrix",
    [[[1, 1.1], [1.1, 1]], [[1, 1, 0], [1, 1, 0.5], [0, 0.5, 1]], [[1, 0.9, -0.9], [0.9, 1, 0.9], [-0.9, 0.9, 1]]],
)
def test_contradictory_correlations(matrix):
    with pytest.raises(ValueError, match="contradict"):
        factor(matrix)


def test_correlated_normal_scores():
    matrix = np.array([[1, 0.5, -0.3], [0.5, 1, 0.2], [-0.3, 0.2, 1]])
    u = correlated(uniforms(4, 0, 3, 200_000), factor(matrix))
    assert all(stats.kstest(row, "uniform").pvalue > 1e-3 for row in u)
    np.testing.assert_allclose(np.corrcoef(stats.norm.ppf(u)), matrix, atol=0.01)


MARGINALS = [
    Marginal("normal", -1e-5, 3e-5, {"cp": 1.33}), Marginal("uniform", -1.0, 1.0), Marginal("normal", -2.0, 2.0),
    Marginal("sample", options={"values": (0.3, -0.1, 0.2)}), Marginal("beta", 0.0, 5.0, {"alpha": 2.0, "beta": 5.0}),
    Marginal("direction"), Marginal("triangular", -1.0, 2.0),
]  # fmt: skip
MATRIX = np.eye(7)
for i, j, r in ((0, 2, 0.6), (0, 1, -0.4), (2, 4, 0.3)):
    MATRIX[i, j] = MATRIX[j, i] = r
U = uniforms(2, 5, 7, 200_000)


def test_correlated_as_by_the_copula():
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


def test_covariance_in_closed_form():
    """Normal: ρ σ σ. Uniform with uniform: (6/π) asin(ρ/2) times the variances; with normal: ρ √(3/π)."""
    marginals = [
        Marginal("normal", -3, 3), Marginal("uniform", -1, 1), Marginal("uniform", -1, 1), Marginal("normal", 0, 1),
    ]  # fmt: skip
    matrix = np.array([[1, 0.5, 0.2, 1.0], [0.5, 1, 0.8, 0.5], [0.2, 0.8, 1, 0.2], [1.0, 0.5, 0.2, 1]])
    population = Population(marginals, matrix)
    s, covariance = population.deviations, population.covariance()
    assert covariance[1, 2] == pytest.approx(6 / np.pi * np.arcsin(0.4) * s[1] * s[2], rel=1e-6)
    assert covariance[0, 1] == pytest.approx(0.5 * np.sqrt(3 / np.pi) * s[0] * s[1], rel=1e-6)
    assert covariance[0, 3] == pytest.approx(s[0] * s[3], rel=1e-9)
    np.testing.assert_array_equal(Population(marginals).covariance(), np.diag(s**2))
    drawn = population.draw(uniforms(1, 1, 4, 50))
    np.testing.assert_allclose(drawn[3], 0.5 + drawn[0] / 6, rtol=1e-12)
