"""Every distribution against scipy.stats, integration and mpmath; random numbers by place, nets and correlation."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from trunnion.statistics.distributions import (
    DISTRIBUTIONS,
    Marginal,
    Population,
    correlated,
    factor,
    normal_parameters,
    sobol,
    uniforms,
)  # fmt: skip

LOW, HIGH = -2e-5, 5e-5
CASES = [
    ("normal", {}, stats.norm(1.5e-5, 7e-5 / 6)),
    ("normal", {"cp": 1.5}, stats.norm(1.5e-5, 7e-5 / 9)),
    ("normal", {"cp": 1.33, "cpk": 1.0}, stats.norm(1.5e-5 + 0.33 * 7e-5 / 6 / 1.33 * 3, 7e-5 / 6 / 1.33)),
    ("normal", {"cp": 1.33, "cpk": 1.0, "shift": -3e-6}, stats.norm(1.2e-5, 7e-5 / 6 / 1.33)),
    ("uniform", {}, stats.uniform(LOW, HIGH - LOW)),
    ("triangular", {}, stats.triang(0.5, LOW, HIGH - LOW)),
    ("triangular", {"mode": -1e-5}, stats.triang(1 / 7, LOW, HIGH - LOW)),
    ("triangular", {"mode": HIGH}, stats.triang(1, LOW, HIGH - LOW)),
    ("triangular", {"mode": LOW}, stats.triang(0, LOW, HIGH - LOW)),
    ("truncated", {}, stats.truncnorm(-3, 3, 1.5e-5, 7e-5 / 6)),
    ("truncated", {"cp": 0.3, "shift": 1e-5}, stats.truncnorm(-4.5 / 7 * 1.8, 2.5 / 7 * 1.8, 2.5e-5, 7e-5 / 1.8)),
    ("truncated", {"cp": 2, "shift": 5e-5}, stats.truncnorm(-8.5 / 7 * 12, -1.5 / 7 * 12, 6.5e-5, 7e-5 / 12)),
    ("beta", {}, stats.beta(2, 2, LOW, HIGH - LOW)),
    ("beta", {"alpha": 5, "beta": 0.7}, stats.beta(5, 0.7, LOW, HIGH - LOW)),
    ("beta", {"alpha": 0.3, "beta": 40}, stats.beta(0.3, 40, LOW, HIGH - LOW)),
    ("direction", {}, stats.uniform(-np.pi, 2 * np.pi)),
]
IDS = [f"{name}-{'-'.join(f'{k}{v}' for k, v in options.items())}" for name, options, _ in CASES]
GRID = np.concatenate([2.0 ** -np.arange(1, 54), 1 - 2.0 ** -np.arange(2, 54), np.linspace(0.001, 0.999, 999)])
SAMPLE = (3e-6, -1e-6, 2e-6, 2e-6)


@pytest.mark.parametrize(("name", "options", "known"), CASES, ids=IDS)
def test_as_in_scipy(name, options, known):
    kind, scale = DISTRIBUTIONS[name], known.std()
    middle = GRID[(GRID > 1e-9) & (GRID < 1 - 1e-9)]
    np.testing.assert_allclose(
        kind.quantile(middle, LOW, HIGH, options), known.ppf(middle), rtol=0, atol=2e-8 * scale, strict=True
    )
    assert kind.moments(LOW, HIGH, options)[0] == pytest.approx(known.mean(), abs=1e-9 * scale)
    assert kind.moments(LOW, HIGH, options)[1] == pytest.approx(known.var(), rel=1e-9)


MIRRORED = {"normal": "shift", "truncated": "shift", "triangular": "mode"}


@pytest.mark.parametrize(("name", "options", "known"), CASES, ids=IDS)
def test_mirrored_to_the_last_bits(name, options, known):
    """−x has the mirrored distribution: the upper tail is as exact as the lower."""
    kind, mirrored = DISTRIBUTIONS[name], dict(options)
    if name == "beta":
        mirrored = {"alpha": options.get("beta", 2.0), "beta": options.get("alpha", 2.0)}
    elif key := MIRRORED.get(name):
        mean, _ = normal_parameters(LOW, HIGH, options)
        value = mean - (LOW + HIGH) / 2 if key == "shift" else options.get(key, (LOW + HIGH) / 2)
        mirrored[key] = -value
    assert np.isfinite(kind.quantile(np.array([5e-324, 1e-300]), LOW, HIGH, options)).all()
    one, other = kind.quantile(GRID, LOW, HIGH, options), -kind.quantile(1 - GRID, -HIGH, -LOW, mirrored)
    assert np.isfinite(one).all()
    assert (np.diff(one[np.argsort(GRID)]) >= 0).all()
    np.testing.assert_allclose(one, other, rtol=0, atol=2e-15 if name == "direction" else 1e-17)


@pytest.mark.parametrize("shift", [-2e-4, 1.5e-4, 3.0])
def test_cut_off_far_from_the_mean(shift):
    """A mean far beyond a limit: against mpmath; so far that only logarithms are left (3 m): exponential."""
    mpmath = pytest.importorskip("mpmath")
    kind, options = DISTRIBUTIONS["truncated"], {"cp": 1.0, "shift": shift}
    mean, sigma = normal_parameters(LOW, HIGH, options)
    u = np.array([1e-12, 1e-3, 0.2, 0.5, 0.9])
    x = kind.quantile(u, LOW, HIGH, options)
    if abs(shift) < 1:
        with mpmath.workdps(120):
            a, b = (mpmath.mpf(v - mean) / mpmath.mpf(sigma) for v in (LOW, HIGH))
            Fa, Fb = mpmath.ncdf(a), mpmath.ncdf(b)
            z = [(mpmath.mpf(v) - mpmath.mpf(mean)) / mpmath.mpf(sigma) for v in x]
            back = [float((mpmath.ncdf(v) - Fa) / (Fb - Fa)) for v in z]
            exact = [float(mpmath.quad(lambda t, k=k: t**k * mpmath.npdf(t), [a, b]) / (Fb - Fa)) for k in (1, 2)]
        np.testing.assert_allclose(back[1:], u[1:], rtol=1e-9)
        assert kind.moments(LOW, HIGH, options)[0] == pytest.approx(mean + sigma * exact[0], rel=1e-10)
        assert kind.moments(LOW, HIGH, options)[1] == pytest.approx(sigma**2 * (exact[1] - exact[0] ** 2), rel=1e-8)
    else:
        rate = shift / sigma**2
        np.testing.assert_allclose(HIGH - x, -np.log(u) / rate, rtol=1e-3)
        assert HIGH - kind.moments(LOW, HIGH, options)[0] == pytest.approx(1 / rate, rel=1e-4)
        assert kind.moments(LOW, HIGH, options)[1] == pytest.approx(1 / rate**2, rel=1e-4)


@given(st.lists(st.floats(-1, 1), min_size=1, max_size=30))
def test_sample_is_the_empirical_distribution(values):
    """Every value is drawn by an equal part of (0, 1), in order of size."""
    kind, options = DISTRIBUTIONS["sample"], {"values": tuple(values)}
    n = len(values)
    u = (np.arange(n * 8) + 0.5) / (n * 8)
    np.testing.assert_array_equal(kind.quantile(u, 0, 0, options), np.repeat(np.sort(values), 8))
    assert kind.moments(0, 0, options)[0] == pytest.approx(np.mean(values), abs=1e-15)
    assert kind.moments(0, 0, options)[1] == pytest.approx(np.var(values), abs=1e-15)


def test_quantile_of_a_sample_at_its_steps():
    """The least value with F(x) ≥ u: at u = k/n the kth smallest, the next one just above."""
    kind, values = DISTRIBUTIONS["sample"], (5.0, -2.0, 7.0, 1.0)
    steps = np.arange(1, 5) / 4
    np.testing.assert_array_equal(kind.quantile(steps, 0, 0, {"values": values}), [-2, 1, 5, 7])
    np.testing.assert_array_equal(kind.quantile(steps[:-1] + 1e-12, 0, 0, {"values": values}), [1, 5, 7])
    np.testing.assert_array_equal(kind.quantile(np.array([0.0, 1.0]), 0, 0, {"values": values}), [-2, 7])


# ---- random numbers and what is drawn ---------------------------------------------------------------------------

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
