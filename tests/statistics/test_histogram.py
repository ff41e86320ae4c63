"""Bins by the bits of a float: edges, counts, quantiles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from trunnion.statistics.histogram import Bins, count, quantile
from trunnion.statistics.streams import uniforms


@given(st.lists(st.floats(-1e4, 1e4), min_size=1, max_size=50), st.integers(2, 8))
def test_every_value_lies_in_its_bin(values: list[float], fineness: int) -> None:
    bins = Bins(0.0, 1.0, fineness)
    x, edges, index = np.array(values), bins.edges(), bins.index(values)
    far = 1 + np.abs(x)  # 1 + |t| is rounded once
    assert (edges[index] <= x + 1e-15 * far).all()
    assert (x - 1e-15 * far <= edges[index + 1]).all()
    assert (edges[index + 1] - edges[index] <= 2.0**-fineness * far * (1 + 1e-12)).all()


def test_edges() -> None:
    edges = Bins(10.0, 2.0, fineness=1, octaves=3).edges()
    np.testing.assert_array_equal((edges - 10) / 2, [-7, -5, -3, -2, -1, -0.5, 0, 0.5, 1, 2, 3, 5, 7])
    assert (np.diff(Bins(0.0, 1.0).edges()) > 0).all()


def test_all_are_counted_except_nan() -> None:
    bins = Bins(0.0, 1.0)
    counts = count([np.inf, -np.inf, 1e300, -1e300, np.nan, 0.0, -0.0, 5e-324, -5e-324], bins)
    assert counts.dtype == np.int64
    assert counts.shape == (bins.number,)
    assert (counts[0], counts[-1], counts.sum()) == (2, 2, 8)
    assert quantile(counts, bins, 1.0, most=np.inf) == np.inf


def test_figures_each_with_their_bins() -> None:
    values = uniforms(1, 0, 3, 500) * np.array([[1e-6], [1.0], [1e6]])
    values[1, 7] = np.nan
    centre, scale = np.array([0.0, 0.5, 1e5]), np.array([1e-6, 0.3, 2e5])
    bins = Bins(centre, scale, 5, 8)
    counts = count(values, bins)
    np.testing.assert_array_equal(counts, count(values.T, bins, axis=0))
    np.testing.assert_array_equal(counts.sum(axis=1), [500, 499, 500])
    q = np.array([[0.1, 0.5], [0.9, np.nan]])
    found = quantile(counts, bins, q)
    assert found.shape == (3, 2, 2)
    for row in range(3):
        one = Bins(centre[row], scale[row], 5, 8)
        np.testing.assert_array_equal(counts[row], count(values[row], one))
        np.testing.assert_array_equal(found[row], quantile(counts[row], one, q))
    assert np.isnan(found[:, 1, 1]).all()


@pytest.mark.parametrize("law", [stats.norm(3, 0.01), stats.uniform(-1, 5), stats.t(2), stats.gamma(2, scale=1e-7)])
@pytest.mark.parametrize("off", [0.0, 0.7, -3.0])
def test_quantiles_to_a_fraction_of_a_bin(law: Any, off: float) -> None:
    """With a centre wrong by 3 deviations and a scale that is 5 times too small or great: to a bin's width, and to a
    quarter of it where the density does not jump in the bin.
    """
    x = law.ppf((np.arange(200_000) + 0.5) / 200_000)
    spread = law.ppf(0.84) - law.ppf(0.5)
    q = np.array([0.00135, 0.005, 0.025, 0.05, 0.25, 0.5, 0.75, 0.95, 0.975, 0.995, 0.99865])
    for factor in (0.2, 1.0, 5.0):
        bins = Bins.around(law.ppf(0.5) + off * spread, spread * factor)
        counts = count(x, bins)
        edges, index = bins.edges(), bins.index(law.ppf(q))
        width = edges[index + 1] - edges[index]
        found = quantile(counts, bins, q, x.min(), x.max())
        jumps = law.dist.name == "uniform"
        assert (np.abs(found - law.ppf(q)) <= np.maximum((1 if jumps else 0.25) * width, 1e-3 * spread)).all()


def test_ends_are_the_extremes() -> None:
    x = np.array([0.1, 0.2, 0.33])
    bins = Bins.around(0.0, 1.0)
    np.testing.assert_array_equal(quantile(count(x, bins), bins, [0.0, 1.0], x.min(), x.max()), [0.1, 0.33])


def test_nothing_counted() -> None:
    bins = Bins(0.0, 1.0)
    assert np.isnan(quantile(count([], bins), bins, 0.5))


@pytest.mark.parametrize(("centre", "deviation"), [(0.0, 0.0), (5.0, 0.0), (5.0, np.nan), (np.nan, np.inf)])
def test_without_an_expected_spread(centre: float, deviation: float) -> None:
    bins = Bins.around(centre, deviation)
    x = np.full(100, 5.0)
    found = quantile(count(x, bins), bins, [0.01, 0.99], x.min(), x.max())
    np.testing.assert_array_equal(found, 5.0)


def test_bins_narrower_than_rounding() -> None:
    """Values whose spread is lost in the rounding of their centre still have quantiles, and no warning."""
    bins = Bins(0.5, 1e-22)
    values = 0.5 + np.array([[-2.0, -1.0, 0.0, 1.0, 2.0]]) * 2.0**-52
    found = quantile(count(values, bins), bins, [0.1, 0.5, 0.9], values.min(), values.max())
    assert np.all(np.abs(found - 0.5) <= 2.0**-51)
