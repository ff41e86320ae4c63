"""Numbers on the screen follow the units of the model; files and other models do not."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trunnion
from mechanisms import four_bar
from trunnion import Mechanism
from trunnion.cli.app import app
from trunnion.cli.edge import status_of
from trunnion.model.screen import shown_as
from trunnion.results.attributes import units_of
from trunnion.results.quantities import between, drawn_in, parts, quantity, read_in, readable

FEET = {"m": "ft", "N": "lbf", "rad": "deg"}


def in_feet() -> Mechanism:
    """A crank with a mass that hangs, stated in feet and pounds."""
    return Mechanism(
        gravity=["0 ft/s^2", "-32.174 ft/s^2"],
        links={
            "ground": {"points": {"A": ["0 ft", "0 ft"]}},
            "crank": {"points": {"A": ["0 ft", "0 ft"], "B": ["2 ft", "0 ft"]}, "mass": "10 lb", "centre": ["2 ft", 0]},
        },
        joints={"A": {"type": "revolute", "links": ["ground", "crank"], "pin": {"radius": "0.1 ft"}, "friction": 0.1}},
        drivers={"A": {"speed": "60 rpm"}},
        loads={"side": {"link": "crank", "at": "B", "force": ["5 lbf", "0 lbf"]}},
    )


def test_units_by_hand() -> None:
    """1 lbf = 4.4482216152605 N, 1 ft = 0.3048 m."""
    with shown_as(FEET):
        assert parts(4.4482216152605, "N") == ("1", "lbf")
        assert parts(1.3558179483314004, "N m") == ("1", "lbf ft")
        assert parts(0.3048, "m") == ("1", "ft")
        assert parts(304.8, "mm") == ("1", "ft")
        assert readable(6894.757293168361, "Pa") == "1 psi"
        assert readable(1.3558179483314004, "W") == "1 lbf ft/s"
        assert between(4.4482216152605, 8.896443230521, "N") == "between 1 and 2 lbf"
        assert drawn_in(1.0, "m")[1] == read_in("m")[1] == "ft"
        assert quantity(np.pi, "rad") == "180.0°"
    assert parts(4.4482216152605, "N") == ("4.44822", "N")
    with shown_as({"m": "in", "N": "N"}):
        assert parts(0.0254, "m") == ("1", "in")
        assert parts(5000.0, "N") == ("5", "kN")
    with shown_as({"m": "inch", "N m": "in lbf"}):
        assert parts(0.1129848290276167, "N m") == ("1", "in lbf")
    with shown_as({"m": "mm", "N": "kN"}):
        assert parts(0.02, "m") == ("20", "mm")


def test_a_result_is_shown_as_its_model_is_stated() -> None:
    found = trunnion.analyse(in_feet(), steps=8)
    assert {units_of(found)[si][1] for si in ("m", "N", "N m", "W")} == {"ft", "lbf", "lbf ft", "lbf ft/s"}
    page = trunnion.report(found)
    assert "lbf ft" in page
    assert " N m" not in page.replace("kN m", " N m").split("<script")[0]
    figure = trunnion.plot(found, "torque")
    assert "lbf ft" in figure.axes[0].get_ylabel()
    assert float(found["drive_effort"].max()) > 20  # the numbers themselves are SI: 10 lb 2 ft are 27 N m


def test_commands_print_the_units_of_the_model(tmp_path: Path, capsys: Any) -> None:
    """The next command about another model is not told of them."""
    (tmp_path / "feet.json").write_text(json.dumps(in_feet().data()), encoding="utf-8")
    told = []
    for model in (str(tmp_path / "feet.json"), "examples/slider-crank.yaml"):
        assert status_of(lambda model=model: app(["analyse", model, "--steps", "8"])) == 0
        told.append(capsys.readouterr().out)
    assert "lbf ft" in told[0]
    assert "N m" not in told[0]
    assert "N m" in told[1]
    assert "lbf" not in told[1]


def test_rounding_is_not_told_as_a_force() -> None:
    """A spring at its free length, alone: what is left of k (l − l₀) is 0."""
    data = copy.deepcopy(four_bar())
    for section in ("loads", "gravity"):
        data.pop(section, None)
    data["links"] = {name: {"points": link["points"]} for name, link in data["links"].items()}
    data["joint_defaults"] = {"pin": {"radius": 0.01}, "friction": 0.1}
    data["springs"] = {"s": {"between": ["ground.D", "rocker.C"], "stiffness": 100.0, "free_length": 0.7}}
    found = trunnion.analyse(Mechanism(**data), steps=24)
    values = [row["value"] for row in json.loads(found.attrs["summary"]) if row["unit"] in ("N", "N m", "W")]
    assert values
    assert not any(values)


@pytest.mark.parametrize(("pin", "noted"), [({"length": 0.05}, True), ({"length": 0.05, "radius": 0.01}, False)])
def test_a_length_that_tells_the_pressure_is_used(pin: Any, noted: bool) -> None:
    data = copy.deepcopy(four_bar())
    data["joints"]["B"]["pin"] = pin
    notes = [finding for finding in Mechanism(**data).checked if "not used" in finding.what]
    assert bool(notes) == noted
