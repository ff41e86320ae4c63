"""Moments against SciPy's, with gaps and far from zero."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from trunnion.statistics.moments import moments_of


@pytest.mark.parametrize("middle", [0.0, 1e6])
def test_moments_are_those_of_scipy(middle: float) -> None:
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


@pytest.mark.parametrize("size", [1e-150, 1e150])
def test_powers_stay_within_the_floats(size: float) -> None:
    values = np.random.default_rng(5).gamma(2.0, size=(1, 200))
    plain, scaled = moments_of(values), moments_of(size * values)
    np.testing.assert_allclose(scaled.deviation / size, plain.deviation, rtol=1e-12)
    np.testing.assert_allclose(scaled[3:], plain[3:], rtol=1e-9)


def test_what_does_not_exist_is_nan() -> None:
    found = moments_of(np.array([[np.nan, np.nan], [np.nan, 2.0], [2.0, 2.0], [np.inf, 1.0]]))
    np.testing.assert_array_equal(found.number, [0, 1, 2, 2])
    np.testing.assert_array_equal(found.mean, [np.nan, 2.0, 2.0, np.inf])
    np.testing.assert_array_equal(found.deviation, [np.nan, np.nan, 0.0, np.nan])
    assert np.all(np.isnan(found.skewness))
