"""Figures of a study at their edge: what first order cannot know, what does not exist, what a band is about."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from toleranced import FOURBAR, fourbar, fourbar_angle, rssr
from trunnion import tolerance

ERROR = {"transmission_error": "D"}
PATH = {"path_error": "coupler.C"}


def studied(measure: dict[str, Any], methods: tuple[str, ...] = ("linear", "worst-case", "monte-carlo")) -> Any:
    model = fourbar(measures={"it": measure})
    return tolerance(model, methods=methods, samples=1000, steps=36, jobs=1).isel(measure=0)


@pytest.mark.parametrize("statistic", ["maximum", "mean", "peak-to-peak"])
def test_band_of_a_transmission_error_is_about_nominal(statistic: str) -> None:
    """Half of the samples lie within ±0.6745 σ of no error, at every position, whatever figure is made of them."""
    found = studied({**ERROR, "as": statistic})
    quarter = 0.6745 * found.curve_deviation.values
    assert found.band.sel(quantile=0.25).values == pytest.approx(-quarter, rel=0.2)
    assert found.band.sel(quantile=0.75).values == pytest.approx(quarter, rel=0.2)


@pytest.mark.spread(6)
@pytest.mark.parametrize(
    "measure",
    [{**PATH, "as": one} for one in ("mean", "rms", "minimum", "peak-to-peak", "place-of-maximum")]
    + [{**ERROR, "as": one} for one in ("rms", "place-of-minimum")],
)
def test_first_order_of_what_has_no_derivative(measure: dict[str, Any]) -> None:
    """It says that it has none; a worst case is found all the same, no less than any sample."""
    found = studied(measure)
    for name in ("worst_case_upper", "rss", "deviation_linear"):
        assert np.isnan(found[name])
    if not measure["as"].startswith("place"):
        assert found.searched_upper >= found.most - found.nominal - 1e-9 * abs(found.most)
        assert found.searched_lower <= found.least - found.nominal + 1e-9 * abs(found.most)


def test_mean_path_error_by_corners() -> None:
    """The worst mean distance of a point of the coupler is that of the worst of all 16 corners."""
    found = studied({**PATH, "as": "mean"}, ("worst-case",))
    crank = 2 * np.pi * np.arange(36) / 36

    def path(sizes: tuple[float, ...]) -> Any:
        return sizes[0] + sizes[3] * np.exp(1j * fourbar_angle(*sizes, crank))

    nominal = tuple(FOURBAR.values())
    signs = np.array(np.meshgrid(*[(-1, 1)] * 4)).reshape(4, -1).T
    means = [np.mean(np.abs(path(tuple(np.array(nominal) + 5e-5 * one)) - path(nominal))) for one in signs]
    assert found.searched_upper.item() == pytest.approx(max(means), rel=1e-9)


def test_figure_that_does_not_exist() -> None:
    """No turning back between 10 and 20°: no nominal figure, no derivative, no worst case, and it is said."""
    found = studied({"dead_centre": "C", "over": ["10 deg", "20 deg"]})
    for name in ("nominal", "worst_case_upper", "deviation_linear", "searched_lower", "searched_upper", "mean"):
        assert np.isnan(found[name]), name
    assert found["yield"] == 0
    assert "undefined for the nominal mechanism" in found.attrs["findings"]


def test_nominal_outside_its_limits_is_no_worst_case() -> None:
    """Limits far from nominal at which nothing goes together: the nominal mechanism is not among the mechanisms."""
    model = fourbar(tolerances={"l1": "+0.9/+0.8 m"}, measures={"it": {"angle": "rocker"}})
    found = tolerance(model, methods=("worst-case",), steps=12)
    assert np.all(np.isnan([found.searched_lower, found.searched_upper]))


@pytest.mark.slow
@pytest.mark.parametrize("statistic", ["maximum", "peak-to-peak"])
def test_turn_of_a_link_in_space(statistic: str) -> None:
    """It is a deviation from nominal, 0 throughout: its extreme has the derivative of where it scatters most."""
    model = rssr(measures={"it": {"angle": "rod", "axis": "z", "as": statistic}})
    found = tolerance(model, methods=("linear", "worst-case"), steps=24).isel(measure=0)
    searched = max(-found.searched_lower.item(), found.searched_upper.item())
    size = max(-found.worst_case_lower.item(), found.worst_case_upper.item())
    assert size == pytest.approx(searched, rel=0.02)
