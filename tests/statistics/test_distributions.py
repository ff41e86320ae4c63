"""Every distribution: quantile and its inverse, moments, tails; against scipy.stats, integration and mpmath."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from trunnion.statistics.distributions import DISTRIBUTIONS, normal_parameters

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
