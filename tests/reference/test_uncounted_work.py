"""Work that enters beside the drive: a crank lifts a weight by a quarter turn while a hand helps, against its work."""

from __future__ import annotations

from math import pi

import pytest

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


def test_below_one_a_load_beside_the_drive_that_supplies_work_is_a_note() -> None:
    (one,) = crank(weight=-LIFTED, hand=HELPED, scrap=-HINDERED)
    assert (one.code, one.where, one.severity) == ("load.not_counted", "loads.hand", "note")
    assert one.figures == pytest.approx({"work": HELPED, "drive": LIFTED - HELPED + HINDERED}, rel=1e-9)


@pytest.mark.parametrize("loads", [{"weight": -LIFTED}, {"weight": -LIFTED, "scrap": -HINDERED}, {"hand": HELPED}])
def test_nothing_is_said_where_the_drives_alone_supply_work(loads: dict[str, float]) -> None:
    assert not crank(**loads)
