"""Shares of the variance: of the deviation that is told, correlated or not, in numbers, tables, chart and columns."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
import xarray as xr

import trunnion
from toleranced import FOURBAR, fourbar, fourbar_angle, slider_crank
from trunnion import Mechanism
from trunnion.results.attributes import summary_of
from trunnion.views.tolerance import tables

WIDE = 0.05e-3 / 3  # σ of each length


def study(rho: float, methods: tuple[str, ...] = ("linear",), **options: Any) -> xr.Dataset:
    rows = [{"of": ["l2", "l3"], "coefficient": rho}, {"of": ["l3", "l4"], "coefficient": -rho / 2}]
    return trunnion.tolerance(fourbar(correlations=rows, **options), methods=methods, samples=4000)


def drawn(rho: float, samples: int = 400_000) -> tuple[np.ndarray, np.ndarray]:
    """Deviations of the four lengths, and the angle of each four-bar by its closed form."""
    matrix = np.eye(4)
    matrix[1, 2] = matrix[2, 1] = rho
    matrix[2, 3] = matrix[3, 2] = -rho / 2
    off = WIDE * np.linalg.cholesky(matrix) @ np.random.default_rng(3).standard_normal((4, samples))
    return off, fourbar_angle(*(value + row for value, row in zip(FOURBAR.values(), off, strict=True)))


@pytest.mark.parametrize("rho", [0.0, 0.6, -0.7, 0.85])
def test_shares_are_covariances_with_the_measure(rho: float) -> None:
    """Of samples: a number's part is its slope times its covariance with the angle; together the variance."""
    found = study(rho)
    off, angle = drawn(rho)
    slopes = found["sensitivity"].values[0]
    wanted = slopes * np.array([np.cov(row, angle)[0, 1] for row in off]) / np.var(angle)
    np.testing.assert_allclose(found["contribution_variance"].values[0], wanted, atol=5e-3)
    assert found["contribution_variance"].sum().item() == pytest.approx(1, abs=1e-12)
    assert found["deviation_linear"].item() == pytest.approx(np.std(angle), rel=5e-3)


def test_shares_with_plays_and_directions_add_up() -> None:
    """Zones are independent of the lengths, and their share is that of the deviation with all correlations."""
    joints = fourbar().data()["joints"]
    joints["C"] |= {"pin": {"clearance": "0.03 mm"}}
    joints["B"] |= {"misalignment": {"offset": "0.02 mm", "offset_towards": "40 deg"}}
    tolerances = dict.fromkeys(FOURBAR, "±0.05 mm")
    tolerances |= {"joints.B.misalignment.offset": "±0.01 mm"}
    tolerances |= {"joints.B.misalignment.offset_towards": {"distribution": "direction"}}
    found = study(0.8, ("linear", "monte-carlo"), joints=joints, tolerances=tolerances)
    shares = found["contribution_variance"].isel(measure=0)
    assert shares.sum().item() == pytest.approx(1, abs=1e-12)
    plays = shares.sel(parameter="joints.C.clearance").item() * found["deviation_linear"].item() ** 2
    alone = found["sensitivity"].sel(parameter="joints.C.clearance").item() * 0.03e-3 / 2
    assert plays == pytest.approx(alone**2, rel=1e-9)
    assert found["deviation"].item() == pytest.approx(found["deviation_linear"].item(), rel=0.04)


def test_sizes_of_one_direction_go_with_each_other() -> None:
    """Two numbers make the offset that points anywhere: correlated they widen it, by samples as by first order."""
    data = slider_crank().data()
    data["dimensions"] |= {"e1": "0.2 mm", "e2": "0.1 mm"}
    data["joints"]["B"]["misalignment"] = {"offset": "e1 + e2", "offset_towards": "90 deg"}
    data["tolerances"] = {"e1": "±0.2 mm", "e2": "±0.1 mm"}
    data["tolerances"] |= {"joints.B.misalignment.offset_towards": {"distribution": "direction"}}
    data["correlations"] = [{"of": ["e1", "e2"], "coefficient": 0.95}]
    found = trunnion.tolerance(Mechanism(**data), methods=["linear", "monte-carlo"], samples=20_000)
    assert found["deviation_linear"].item() == pytest.approx(found["deviation"].item(), rel=0.02)
    assert found["contribution_variance"].sum().item() == pytest.approx(1, abs=1e-12)


def test_rss_says_that_it_leaves_correlation_out() -> None:
    found = study(0.85)
    table = tables(found)[0]
    assert any(row[0] == "RSS, uncorrelated" for row in table.rows)
    assert any("RSS, without correlation" in figure.label for figure in summary_of(found))
    assert any(row["code"] == "tolerance.correlations_left_out" for row in json.loads(found.attrs["findings"]))
    plain = study(0.0)
    assert not any("uncorrelated" in row[0] for row in tables(plain)[0].rows)
    assert not any("correlations" in row["code"] for row in json.loads(plain.attrs["findings"]))
