"""Variance-based indices: of a nearly linear measure the shares of first order, of a product what its formula says."""

from __future__ import annotations

import numpy as np
import pytest

from trunnion import Mechanism, tolerance

ROD = {
    "links": {
        "ground": {"points": {"O": [0, 0], "G": {"at": [0, "h"], "axis": [1, 0]}}},
        "rod": {"points": {"O": [0, 0], "P": ["a + b", 0]}},
        "block": {"points": {"P": [0, 0], "G": {"at": [0, 0], "axis": [1, 0]}}},
    },
    "joints": {
        "O": {"type": "revolute", "links": ["ground", "rod"]},
        "P": {"type": "revolute", "links": ["rod", "block"]},
        "G": {"type": "prismatic", "links": ["ground", "block"]},
    },
    "assembly": {"P": [0.09, 0.04]},
    "dimensions": {"a": "60 mm", "b": "40 mm", "h": "40 mm"},
    "measures": {"angle": {"angle": "rod"}},
}


def test_shares_of_a_nearly_linear_measure() -> None:
    """sin(angle) = h/(a + b): with small tolerances the indices are those of first order, alone and in total."""
    mechanism = Mechanism(**ROD, tolerances={"a": 1e-6, "b": 2e-6, "h": 1e-6})
    result = tolerance(mechanism, methods=["linear", "quasi-monte-carlo", "sobol"], samples=20_000)
    share = result["contribution_variance"].values
    for order in ("first_order", "total_order"):
        assert result[order].values == pytest.approx(share, abs=0.01)
        assert np.all(result[f"{order}_low"].values <= share)
        assert np.all(share <= result[f"{order}_high"].values)


def test_same_seed_same_indices() -> None:
    mechanism = Mechanism(**ROD, tolerances={"a": 1e-4, "b": 2e-4, "h": 1e-4})
    one, two = (tolerance(mechanism, methods=["linear", "sobol"], samples=2_000, seed=3) for _ in range(2))
    for name in ("first_order", "first_order_low", "total_order_high"):
        assert np.array_equal(one[name].values, two[name].values)
