"""Useful work: a weight that is lifted against the same weight as a load, and work that enters beside the drive."""

from __future__ import annotations

import json
from math import pi
from typing import Any

import numpy as np
import pytest

import trunnion
from mechanisms_parts import Data, revolute
from trunnion import Mechanism, analyse
from trunnion.errors import Finding

LIFTED, HELPED, HINDERED = 10.0, 4.0, 5.0  # J: constant forces, N, over a rise of 1 m


def crank(**loads: float) -> list[Finding]:
    """The findings of a crank of 1 m, from level to upright; loads: vertical forces at its end, N; `weight` is useful;
    with `mass` a weight at its end that it lets down instead."""
    mass = loads.pop("mass", 0.0)
    points = {"A": [0, 0], "P": [1, 0]}
    data: Data = {
        "links": {"ground": {"points": {"A": [0, 0]}}, "crank": {"points": points, "mass": mass, "centre": [1, 0]}},
        "joints": {"A": revolute("ground", "crank")},
        "drivers": {"A": {"speed": 1.0, "range": [0.0, pi / 2]}},
        "gravity": [0.0, 1.0],
        "loads": {
            name: {"link": "crank", "at": "P", "force": [0.0, force], "useful": name == "weight"}
            for name, force in loads.items()
        },
    }
    found = analyse(Mechanism(trunnion=1, **data), steps=8).trunnion.findings
    return [one for one in found if one.code in ("efficiency.above_one", "load.not_counted")]


def test_an_efficiency_above_one_is_a_warning_with_the_work_of_each_source() -> None:
    (one,) = crank(weight=-LIFTED, hand=HELPED)
    assert one.severity == "warning"
    assert one.code == "efficiency.above_one"
    assert one.figures["efficiency"] == pytest.approx(LIFTED / (LIFTED - HELPED), rel=1e-9)
    assert one.figures["drive"] == pytest.approx(LIFTED - HELPED, rel=1e-9)
    assert one.figures["work"] == pytest.approx({"load hand": HELPED}, rel=1e-9)


def test_masses_that_help_are_a_source() -> None:
    (one,) = crank(weight=-LIFTED, mass=HELPED)
    assert one.figures["work"] == pytest.approx({"weight and inertia": HELPED}, rel=1e-9)


def press(**more: Any) -> Mechanism:
    """A crank press whose work begins 5 mm before its dead centre."""
    pin, work = {"radius": 0.01, "clearance": 35e-6}, "250 kN * between(ram.Q.y, 399 mm, 404 mm)"
    data: Data = {
        "links": {
            "frame": {"points": {"O": [0, 0.7], "S": {"at": [0, 0.7], "axis": [0, -1]}}},
            "crank": {"points": {"O": [0, 0], "P": [0.04, 0]}},
            "rod": {"points": {"P": [0, 0], "Q": [0.26, 0]}, "mass": 60.0, "centre": [0.09, 0], "inertia": 0.6},
            "ram": {"points": {"Q": [0, 0], "S": {"at": [0, 0], "axis": [0, -1]}}, "mass": 180.0},
        },
        "joints": {
            "O": revolute("frame", "crank") | {"pin": pin},
            "P": revolute("crank", "rod") | {"pin": pin},
            "Q": revolute("rod", "ram") | {"pin": pin},
            "S": {"type": "prismatic", "links": ["frame", "ram"], "guide": {"length": 0.32}},
        },
        "drivers": {"O": {"speed": "60 rpm", "start": "90 deg"}},
        "gravity": [0.0, -9.81],
        "loads": {"blank": {"joint": "S", "resisting_force": work, "only": "positive", "useful": True}},
        "assembly": {"Q": [0, 0.48]},
    }
    return Mechanism(trunnion=1, **data, **more)


def test_what_seats_leave_is_no_efficiency_above_one() -> None:
    """Without friction the efficiency is 1; pins that float as the work sets in leave more than the integrals do."""
    result = analyse(press(joint_defaults={"seat": "loaded"}), steps=36)
    excess = float(result.efficiency) - 1
    assert abs(excess) > 1e-9
    assert abs(excess) < float(result.efficiency_error) < 0.05
    assert "efficiency.above_one" not in [one.code for one in result.trunnion.findings]


def test_below_one_a_load_beside_the_drive_that_supplies_work_is_a_note() -> None:
    (one,) = crank(weight=-LIFTED, hand=HELPED, scrap=-HINDERED)
    assert (one.code, one.where, one.severity) == ("load.not_counted", "loads.hand", "note")
    assert one.figures == pytest.approx({"work": HELPED, "drive": LIFTED - HELPED + HINDERED}, rel=1e-9)


@pytest.mark.parametrize("loads", [{"weight": -LIFTED}, {"weight": -LIFTED, "scrap": -HINDERED}, {"hand": HELPED}])
def test_nothing_is_said_where_the_drives_alone_supply_work(loads: dict[str, float]) -> None:
    assert not crank(**loads)


G, MASS = 9.81, 1500.0


def lift(space: str, friction: float, weight: dict[str, Any], gravity: float, **more: Any) -> Mechanism:
    """A slider on an inclined guide, driven up it by a motion that begins and ends at rest."""
    guide = {"guide": {"length": 0.8}}
    slope = [np.cos(0.6), np.sin(0.6)]
    flat = [0.0] if space == "spatial" else []
    centre = [0.1, 0.3, *flat]
    element = {"at": [0, 0, *flat], "axis": [*slope, *flat]}
    load = {"loads": {"weight": {"link": "cage", "at": "C", "force": [0, -MASS * G, *flat], "useful": True}}}
    return Mechanism(
        space=space,
        gravity=[0, -gravity, *flat],
        links={
            "ground": {"points": {"S": element}},
            "cage": {"points": {"S": element, "C": centre}, "mass": MASS, "centre": centre, **weight},
        },
        joints={"S": {"type": "prismatic", "links": ["ground", "cage"], "friction": friction, **guide}},
        drivers={"S": {"law": "cycloidal", "range": [0, 2], "duration": 4, "returns": False}},
        **({} if gravity else load),
        **more,
    )


@pytest.mark.parametrize("space", ["planar", "spatial"])
@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_a_weight_is_useful_as_a_load_is(space: str, friction: float) -> None:
    one = trunnion.analyse(lift(space, friction, {"useful": True}, G), steps=20)
    other = trunnion.analyse(lift(space, friction, {}, 0.0), steps=20)
    for name in ("efficiency", "useful_power", "efficiency_instant"):
        assert one[name].values == pytest.approx(other[name].values, rel=1e-9, nan_ok=True), name
    assert float(one.efficiency) == pytest.approx(1.0, rel=1e-9) if friction == 0 else 0.3 < float(one.efficiency) < 1


def test_locking_counts_it() -> None:
    """Backward the weight drives: the efficiency backward of an incline of 0.6 rad is 2 − 1/η, of useful weight too."""
    numbers = [
        {row["name"]: row["value"] for row in json.loads(trunnion.locking(model, steps=12).attrs["summary"])}
        for model in (lift("planar", 0.05, {"useful": True}, G), lift("planar", 0.05, {}, 0.0))
    ]
    assert 0 < numbers[0]["efficiency_reverse"] < 1
    assert numbers[0]["efficiency_reverse"] == pytest.approx(numbers[1]["efficiency_reverse"], rel=1e-6)
