"""Intervals against scipy and by simulation; capability."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from trunnion.statistics.intervals import (
    by_replicates,
    capability,
    of_deviation,
    of_mean,
    of_quantile,
    share,
    share_by_replicates,
)

RUNS = 4000
GENERATOR = np.random.default_rng(8)


@given(st.integers(1, 10**6), st.floats(0, 1), st.sampled_from([0.9, 0.95, 0.99]))
def test_wilson_as_in_scipy(n: int, part: float, confidence: float) -> None:
    passed = round(part * n)
    known = stats.binomtest(passed, n).proportion_ci(confidence, "wilson")
    low, high = share(passed, n, confidence)
    assert (float(low), float(high)) == pytest.approx((known.low, known.high), abs=1e-12)
    assert 0 <= low <= passed / n <= high <= 1


def test_share_of_none_and_of_arrays() -> None:
    low, high = share(np.array([0, 0, 5]), np.array([0, 5, 5]))
    assert np.isnan([low[0], high[0]]).all()
    assert (low[1], high[2]) == (0, 1)
    assert high[1] == pytest.approx(1 - low[2])


def test_replicates_as_a_t_test() -> None:
    values = GENERATOR.normal(size=(3, 8))
    known = stats.ttest_1samp(values, 0, axis=1).confidence_interval(0.95)
    np.testing.assert_allclose(by_replicates(values), [known.low, known.high], rtol=1e-12)
    assert np.isnan(by_replicates([1.0])).all()


def test_shares_of_replicates() -> None:
    """Far from the ends it is the t interval of the shares; at the ends Wilson's of all points."""
    passed = np.array([5003, 4990, 5011, 4998, 5007, 4995, 5001, 4992])
    np.testing.assert_allclose(share_by_replicates(passed, 10_000), by_replicates(passed / 10_000), atol=1e-8)
    np.testing.assert_array_equal(share_by_replicates([100] * 8, 100), share(800, 800))
    np.testing.assert_array_equal(share_by_replicates([0] * 8, 100), share(0, 800))
    low, high = share_by_replicates([90] * 8, 100)
    assert 0.897 < low < 0.9 < high < 0.903


def test_mean_and_deviation_of_normal_values() -> None:
    n = 12
    x = GENERATOR.normal(size=n)
    known = stats.ttest_1samp(x, 0).confidence_interval(0.95)
    np.testing.assert_allclose(of_mean(x.mean(), x.std(ddof=1), n), [known.low, known.high])
    np.testing.assert_allclose(
        of_deviation(2.0, 3 * (n - 1) / (n - 1), n),
        2 * np.sqrt(2 * n / (3 - 9 / 11) / stats.chi2.ppf([0.975, 0.025], 2 * n / (3 - 9 / 11))),
    )
    assert 2 * n / (3 - 9 / 11) == pytest.approx(n - 1)
    assert np.isnan(of_mean(1.0, 1.0, 1)).all()
    assert np.isnan(of_deviation(1.0, np.nan, 50)).all()


@pytest.mark.spread(1)
@pytest.mark.parametrize("law", ["normal", "uniform", "exponential"])
def test_mean_and_deviation_are_covered(law: str) -> None:
    n, (mean, sigma) = 2000, {"normal": (0, 1), "uniform": (0.5, 12**-0.5), "exponential": (1, 1)}[law]
    x = getattr(GENERATOR, law)(size=(RUNS, n))
    s, d = x.std(axis=1, ddof=1), x - x.mean(axis=1)[:, None]
    kurtosis = (d**4).mean(axis=1) / (d**2).mean(axis=1) ** 2
    low, high = of_mean(x.mean(axis=1), s, n)
    assert np.mean((low <= mean) & (mean <= high)) == pytest.approx(0.95, abs=0.015)
    low, high = of_deviation(s, kurtosis, n)
    assert np.mean((low <= sigma) & (sigma <= high)) == pytest.approx(0.95, abs=0.015)


@pytest.mark.parametrize("q", [0.00135, 0.05, 0.5, 0.995])
@pytest.mark.parametrize("n", [300, 5000])
def test_quantile_is_covered(q: float, n: int) -> None:
    """By the binomial distribution itself: K values below the quantile, covered if l ≤ K < u."""
    low, high = of_quantile(q, n)
    law = stats.binom(n, q)
    if np.isnan(low):
        assert law.pmf(0) > 0.025
    if np.isnan(high):
        assert law.pmf(n) > 0.025
    first, last = np.nan_to_num(low, nan=0.0) * n, n + 1 if np.isnan(high) else high * n
    chance = law.cdf(round(last) - 1) - law.cdf(round(first) - 1)
    assert 0.95 <= chance < 1
    if not np.isnan(low + high):
        assert law.cdf(round(first)) > 0.025  # a narrower interval would not do
        assert chance < 0.99


def test_binomial_quantiles_as_in_scipy() -> None:
    n = np.array([1, 2, 10, 777, 10**6, 10**12])
    for q in (0.00135, 0.3, 0.5, 0.99865):
        low, high = of_quantile(q, n)
        known = stats.binom.ppf(0.025, n, q), stats.binom.ppf(0.975, n, q) + 1
        np.testing.assert_allclose(low * n, np.where(known[0] >= 1, known[0], np.nan), rtol=1e-9)
        np.testing.assert_allclose(high * n, np.where(known[1] <= n, known[1], np.nan), rtol=1e-9)


# ---- capability -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("limits", "mean", "sigma", "expected"),
    [
        ((-3.0, 3.0), 0.0, 1.0, (1, 1)),
        ((-3.0, 3.0), 1.0, 1.0, (1, 2 / 3)),
        ((-3.0, 3.0), -2.0, 0.5, (2, 2 / 3)),
        ((-3.0, 3.0), 0.0, 0.0, (np.nan, np.nan)),
        ((-np.inf, 3.0), 1.0, 1.0, (np.nan, 2 / 3)),
        ((-np.inf, np.inf), 1.0, 1.0, (np.nan, np.nan)),
    ],
)
def test_capability(limits: tuple[float, float], mean: float, sigma: float, expected: tuple[float, float]) -> None:
    np.testing.assert_allclose(capability(*limits, mean, sigma), expected)
