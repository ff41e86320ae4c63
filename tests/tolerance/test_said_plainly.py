"""What a study of tolerances and an allocation say beside their figures: codes and numbers, each once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import trunnion
from trunnion import Mechanism
from trunnion.results.attributes import findings_of
from trunnion.views.tolerance import tables

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
SLIDER = {
    "dimensions": {"r": "60 mm ± 0.1 mm", "k": "200 mm ± 0.15 mm"},
    "links": {
        "ground": {"points": {"O": [0, 0], "S": {"at": [0, 0], "axis": [1, 0]}}},
        "crank": {"points": {"O": [0, 0], "P": ["r", 0]}},
        "rod": {"points": {"P": [0, 0], "Q": ["k", 0]}},
        "ram": {"points": {"Q": [0, 0], "S": {"at": [0, 0], "axis": [1, 0]}, "T": ["k", 0]}},
    },
    "joints": {
        "O": {"type": "revolute", "links": ["ground", "crank"]},
        "P": {"type": "revolute", "links": ["crank", "rod"]},
        "Q": {"type": "revolute", "links": ["rod", "ram"]},
        "S": {"type": "prismatic", "links": ["ground", "ram"]},
    },
    "joint_defaults": {"pin": {"radius": "15 mm", "clearance": "20 um"}},
    "drivers": {"O": {"speed": "60 rpm"}},
    "assembly": {"Q": ["260 mm", 0]},
    "measures": {"tip": {"point": "ram.T", "axis": "x", "limit": "±0.6 mm"}},
    "tolerances": {"O.pin.clearance": "+0.01/0 mm"},
    "costs": {
        "k": {"model": "power", "B": 1, "k": 0.5, "unit": "mm", "least": "0.01 mm", "most": "0.3 mm"},
        "O.clearance": {"model": "power", "B": 0.3, "k": 0.5, "unit": "mm", "least": "0.01 mm", "most": "0.05 mm"},
    },
}  # fmt: skip


def slider(**more: Any) -> Mechanism:
    return Mechanism(**{"trunnion": 1, **SLIDER, **more})


def coded(result: Any, code: str) -> list[Any]:
    found = findings_of(result) if "findings" in getattr(result, "attrs", {}) else result.findings
    return [one for one in found if one.code == code]


def test_a_dimension_of_two_links_is_named_by_check_and_by_tolerance() -> None:
    """k is the length of the rod and that of the ram: one number for two parts."""
    for result in (trunnion.check(slider()), trunnion.tolerance(slider(), methods=["linear"], steps=12)):
        (found,) = coded(result, "tolerance.shared_dimension")
        assert found.where == "dimensions.k"
        assert found.figures["links"] == ["rod", "ram"]
        assert "rod.Q.x" in found.what
        assert "ram.T.x" in found.what


def test_a_dimension_of_one_link_or_without_tolerance_is_not() -> None:
    plain = slider(dimensions={"r": "60 mm ± 0.1 mm", "k": "200 mm"}, costs={})
    assert not coded(trunnion.check(plain), "tolerance.shared_dimension")
    roller = trunnion.read(EXAMPLES / "one-way-clutch.yaml")  # its radius stands beside other dimensions of two links
    assert not coded(trunnion.check(roller), "tolerance.shared_dimension")


def test_an_allocated_clearance_keeps_its_stated_tolerance_and_that_is_said() -> None:
    """Both are in the worst case: 0.05 mm allocated and 0.01 mm stated make a play of 0.06 mm."""
    result = trunnion.allocate(slider(), steps=12, samples=0)
    (found,) = coded(result, "allocation.play_tolerance")
    assert found.where == "costs.O.clearance"
    assert (found.figures["lower_um"], found.figures["upper_um"]) == pytest.approx((0.0, 10.0))
    play = result.sel(parameter="joints.O.clearance")
    size = float(play["tolerance"]) + 10e-6
    assert float(play["parameter_upper"]) == pytest.approx(size)
    worst = float(play["contribution_worst_case"].sel(measure="tip"))
    assert worst == pytest.approx(size * abs(float(play["sensitivity"].sel(measure="tip"))), rel=1e-6)


def test_the_largest_part_is_named_and_a_play_is_within_its_radius() -> None:
    """At 0° the rod and the ram have 30 µm, three pins 20 µm each, the crank 10 µm."""
    tip = {"point": "ram.T", "axis": "x", "at": "0 deg", "limit": "±0.05 mm"}
    dimensions = {"r": "60 mm ± 0.01 mm", "k": "200 mm ± 0.015 mm"}
    model = slider(dimensions=dimensions, tolerances={}, measures={"tip": tip})
    result = trunnion.tolerance(model, methods=["linear"], steps=12)
    (found,) = coded(result, "limit.missed")
    assert "'dimensions.k', 30 % of" in found.remedy
    rows = next(one.rows for one in tables(result) if one.title.startswith("contributions"))
    told = {row[0]: row[1].replace("\u00a0", " ") for row in rows}
    assert (told["k"], told["O.clearance"]) == ("±0.015 mm", "within 0.02 mm")


def test_a_sensitivity_is_by_the_unit_of_the_tolerance() -> None:
    dimensions = {**SLIDER["dimensions"], "F": "250 kN ± 5 kN"}
    loads = {"work": {"joint": "S", "resisting_force": "F"}}
    more = {"tolerances": {}, "measures": {"torque": {"effort": "O", "at": "60 deg"}}}
    result = trunnion.tolerance(slider(dimensions=dimensions, loads=loads, **more), methods=["linear"], steps=12)
    rows = next(one.rows for one in tables(result) if one.title.startswith("contributions"))
    (row,) = [[cell.replace("\u00a0", " ") for cell in one] for one in rows if one[0] == "F"]
    torque, half = float(result["nominal"][0]), 5 / 250
    assert row[1] == "±5 kN"
    assert row[2].endswith("/kN")
    assert float(row[3].split()[0]) == pytest.approx(abs(torque) * half * 1e-3, abs=1e-4)  # kN m
    assert float(row[2].split()[0].replace("−", "-")) == pytest.approx(torque / 250e3, rel=1e-3)
