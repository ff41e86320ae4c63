"""Moments, intervals and capability against SciPy; intervals of 95 % cover in 95 ± 3 % over 200 seeds."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from scipy.special import ndtr

from trunnion.statistics.distributions import Marginal, Population, sobol, uniforms
from trunnion.statistics.intervals import (
    by_replicates,
    capability,
    moments_of,
    of_deviation,
    of_mean,
    of_quantile,
    share,
    share_by_replicates,
)


@pytest.mark.parametrize("middle", [0.0, 1e6])
def test_moments_are_those_of_scipy(middle):
    values = middle + np.random.default_rng(3).gamma(2.0, size=(3, 500))
    values[1, ::7] = np.nan
    found = moments_of(values)
    for i, row in enumerate(values):
        x = row[~np.isnan(row)]
        assert found.number[i] == len(x)
        assert found.mean[i] == pytest.approx(np.mean(x), rel=1e-14)
        assert found.deviation[i] == pytest.approx(np.std(x, ddof=1), rel=1e-9)
        assert found.skewness[i] == pytest.approx(stats.skew(x), rel=1e-8)
        assert found.kurtosis[i] == pytest.approx(stats.kurtosis(x, fisher=False), rel=1e-8)


def test_what_does_not_exist_is_nan():
    found = moments_of(np.array([[np.nan, np.nan], [np.nan, 2.0], [2.0, 2.0], [np.inf, 1.0]]))
    np.testing.assert_array_equal(found.number, [0, 1, 2, 2])
    np.testing.assert_array_equal(found.mean, [np.nan, 2.0, 2.0, np.inf])
    np.testing.assert_array_equal(found.deviation, [np.nan, np.nan, 0.0, np.nan])
    assert np.all(np.isnan(found.skewness))


RUNS = 4000
GENERATOR = np.random.default_rng(8)


@given(st.integers(1, 10**6), st.floats(0, 1))
def test_wilson_as_in_scipy(n, part):
    passed = round(part * n)
    known = stats.binomtest(passed, n).proportion_ci(0.95, "wilson")
    low, high = share(passed, n)
    assert (float(low), float(high)) == pytest.approx((known.low, known.high), abs=1e-12)
    assert 0 <= low <= passed / n <= high <= 1


def test_replicates_as_a_t_test():
    values = GENERATOR.normal(size=(3, 8))
    known = stats.ttest_1samp(values, 0, axis=1).confidence_interval(0.95)
    np.testing.assert_allclose(by_replicates(values), [known.low, known.high], rtol=1e-12)
    assert np.isnan(by_replicates([1.0])).all()


def test_shares_of_replicates():
    """Far from the ends it is the t interval of the shares; at the ends Wilson's of all points."""
    passed = np.array([5003, 4990, 5011, 4998, 5007, 4995, 5001, 4992])
    np.testing.assert_allclose(share_by_replicates(passed, 10_000), by_replicates(passed / 10_000), atol=1e-8)
    np.testing.assert_array_equal(share_by_replicates([100] * 8, 100), share(800, 800))
    np.testing.assert_array_equal(share_by_replicates([0] * 8, 100), share(0, 800))
    low, high = share_by_replicates([90] * 8, 100)
    assert 0.897 < low < 0.9 < high < 0.903


def test_mean_and_deviation_of_normal_values():
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


def test_binomial_quantiles_as_in_scipy():
    n = np.array([1, 2, 10, 777, 10**6, 10**12])
    for q in (0.00135, 0.3, 0.5, 0.99865):
        low, high = of_quantile(q, n)
        known = stats.binom.ppf(0.025, n, q), stats.binom.ppf(0.975, n, q) + 1
        np.testing.assert_allclose(low * n, np.where(known[0] >= 1, known[0], np.nan), rtol=1e-9)
        np.testing.assert_allclose(high * n, np.where(known[1] <= n, known[1], np.nan), rtol=1e-9)


# capability
@pytest.mark.parametrize(
    ("limits", "mean", "sigma", "expected"),
    [
        ((-3.0, 3.0), 0.0, 1.0, (1, 1)), ((-3.0, 3.0), 1.0, 1.0, (1, 2 / 3)), ((-3.0, 3.0), -2.0, 0.5, (2, 2 / 3)),
        ((-3.0, 3.0), 0.0, 0.0, (np.nan, np.nan)), ((-np.inf, 3.0), 1.0, 1.0, (np.nan, 2 / 3)),
        ((-np.inf, np.inf), 1.0, 1.0, (np.nan, np.nan)),
    ],
)  # fmt: skip
def test_capability(limits, mean, sigma, expected):
    np.testing.assert_allclose(capability(*limits, mean, sigma), expected)


POPULATION = Population([Marginal("normal", -3.0, 3.0)] * 3)
WEIGHTS = np.array([0.8, -0.5, 0.33166247903554])  # their squares add up to 1
REPLICATES = 16
HONEST = pytest.approx(0.95, abs=0.03 + 1e-12)


def yield_of(limit):
    return float(ndtr(limit) - ndtr(-limit))


def passed(u, limit):
    return int(np.count_nonzero(np.abs(WEIGHTS @ POPULATION.draw(u)) <= limit))


def coverage(low, high, true):
    return float(np.mean((low <= true) & (true <= high)))


@pytest.mark.parametrize(("limit", "count"), [(1.0, 500), (2.0, 2000), (3.0, 5000)])
def test_plain_samples(limit, count):
    counts = [passed(uniforms(seed, 0, 3, count), limit) for seed in range(1, 201)]
    assert coverage(*share(counts, count), yield_of(limit)) == HONEST


def counts_of(limit, count):
    """Samples within ±limit, (seed, replicate)."""
    replicates = range(REPLICATES)
    return np.array([[passed(sobol(s, r, 3, 0, count), limit) for r in replicates] for s in range(1, 201)])


@pytest.mark.spread(1)
@pytest.mark.parametrize(("limit", "count"), [(1.0, 128), (2.0, 256), (3.0, 1024)])
def test_sobol_by_replicates(limit, count):
    counts, true = counts_of(limit, count), yield_of(limit)
    assert coverage(*by_replicates(counts / count), true) == HONEST
    assert coverage(*share_by_replicates(counts, count), true) == HONEST
    # And they are narrower than those of as many plain samples.
    low, high = share_by_replicates(counts, count)
    plain_low, plain_high = share(counts.sum(axis=1), REPLICATES * count)
    assert np.mean(high - low) < 0.8 * np.mean(plain_high - plain_low)


@pytest.mark.spread(1)
@pytest.mark.parametrize("law", ["normal", "uniform", "exponential"])
def test_mean_and_deviation_are_covered(law):
    n, (mean, sigma) = 2000, {"normal": (0, 1), "uniform": (0.5, 12**-0.5), "exponential": (1, 1)}[law]
    x = getattr(GENERATOR, law)(size=(RUNS, n))
    s, d = x.std(axis=1, ddof=1), x - x.mean(axis=1)[:, None]
    kurtosis = (d**4).mean(axis=1) / (d**2).mean(axis=1) ** 2
    low, high = of_mean(x.mean(axis=1), s, n)
    assert np.mean((low <= mean) & (mean <= high)) == pytest.approx(0.95, abs=0.015)
    low, high = of_deviation(s, kurtosis, n)
    assert np.mean((low <= sigma) & (sigma <= high)) == pytest.approx(0.95, abs=0.015)


@pytest.mark.slow
def test_hardly_any_failure():
    """One failure expected in all: the counts of replicates are 0 or 1, and t alone would cover in 2 of 3 studies."""
    counts, true = counts_of(4.0, 1024), yield_of(4.0)
    assert coverage(*by_replicates(counts / 1024), true) < 0.75
    assert coverage(*share_by_replicates(counts, 1024), true) > 0.95
