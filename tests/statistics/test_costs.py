"""Costs of tolerances: every entry of the table by its own derivative, convexity and findings."""

import numpy as np
import pytest

from trunnion.statistics.costs import COST_MODELS, Cost

GIVEN = {"A": 1.0, "B": 20.0, "k": 0.7, "unit": 1e-3}


@pytest.mark.parametrize("name", COST_MODELS)
@pytest.mark.parametrize("t", [2e-6, 1e-4, 3e-3])
def test_slope_is_the_derivative_of_a_cost_that_falls_and_is_convex(name, t):
    cost, h = Cost(name, GIVEN), 1e-4 * t
    slope = (cost.value(t + h) - cost.value(t - h)) / (2 * h)
    assert cost.slope(t) == pytest.approx(slope, rel=1e-6)
    assert cost.slope(t - h) < cost.slope(t) < cost.slope(t + h) < 0


def test_values_by_hand():
    assert Cost("power", {"B": 3.0, "k": 0.5, "unit": 1e-3}).value(4e-3) == pytest.approx(1.5)
    assert Cost("exponential", {**GIVEN, "k": 2.0}).value(0.5e-3) == pytest.approx(1 + 20 * np.exp(-1))
    assert Cost("power", GIVEN).value(0.0) == np.inf
    assert Cost("exponential", GIVEN).value(0.0) == 21.0


@pytest.mark.parametrize("model", sorted(COST_MODELS))
def test_cost_that_no_tolerance_changes(model):
    """Without B a tolerance of 0 costs A, and its slope is 0."""
    assert COST_MODELS[model].of(0.0, A=2.0, B=0.0, k=0.5, unit=1e-3) == (2.0, 0.0)
