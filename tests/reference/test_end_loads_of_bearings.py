"""Loads on the ends of bearings and guides, against statics of a beam on two supports."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

import trunnion
from brief import brief
from trunnion import Mechanism, MechanismError
from trunnion.results.tables.cycle import positions

G = 9.81


def overhung(length: float, **more: Any) -> Mechanism:
    """A shaft about z that carries a mass of 2 kg, 0.3 m beyond the middle of its bearing; gravity along −y."""
    return Mechanism(
        space="spatial",
        gravity=[0, -G, 0],
        links={
            "ground": {"points": {"A": {"at": [0, 0, 0], "axis": [0, 0, 1]}}},
            "shaft": {"points": {"A": {"at": [0, 0, 0], "axis": [0, 0, 1]}}, "mass": 2.0, "centre": [0, 0, 0.3]},
        },
        joints={"A": {"type": "revolute", "links": ["ground", "shaft"], "pin": {"radius": 0.01, "bearing": length}}},
        drivers={"A": {"speed": 1.0}},
        measures={"end": {"end_load": "A", "as": "maximum"}},
        **more,
    )


@pytest.mark.parametrize("length", [0.02, 0.1, 0.6])
def test_an_overhung_shaft(length: float) -> None:
    """m g (a/L + 1/2) on the nearer end, a being how far the weight is from the middle."""
    found = trunnion.analyse(overhung(length), steps=4)
    assert float(found.measure_figure[0]) == pytest.approx(2 * G * (0.3 / length + 0.5), rel=1e-12)


def test_a_guide_in_the_plane() -> None:
    """A slider 0.4 m long that carries 100 N, 0.5 m beyond its middle: 100 N·(0.5/0.4 + 1/2) on the nearer end."""
    model = Mechanism(
        gravity=[0, 0],
        links={
            "ground": {"points": {"S": {"at": [0, 0], "axis": [1, 0]}}},
            "slider": {"points": {"S": {"at": [0, 0], "axis": [1, 0]}, "E": [0.5, 0]}},
        },
        joints={"S": {"type": "prismatic", "links": ["ground", "slider"], "guide": {"length": 0.4}}},
        drivers={"S": {"speed": 1.0, "range": [0, 0.2]}},
        loads={"weight": {"link": "slider", "at": "E", "force": [0, -100]}},
        measures={"end": {"end_load": "S", "as": "maximum"}},
    )
    assert float(trunnion.analyse(model, steps=4).measure_figure[0]) == pytest.approx(175.0, rel=1e-12)


def test_a_bearing_in_space_by_its_reaction() -> None:
    """|F⊥/2 ∓ M⊥ × u/L|, of the force and moment in the table of the result."""
    model = trunnion.read("examples/rssr.yaml").data()
    model["measures"] = {"end": {"end_load": "D"}}
    found = trunnion.analyse(Mechanism(**model), steps=12)
    force, moment = (found[name].sel(joint="D").values for name in ("reaction_force", "reaction_moment"))
    axis = np.array([0, -np.sin(np.pi / 3), np.cos(np.pi / 3)])
    across, bending = (vector - np.outer(axis, axis @ vector) for vector in (force, moment))
    g = np.cross(bending.T, axis).T / 0.03
    sizes = [np.linalg.norm(across / 2 + sign * g, axis=0) for sign in (-1, 1)]
    assert found.measure_value.sel(measure="end").values == pytest.approx(np.max(sizes, axis=0), rel=1e-12)


def test_the_cross_of_a_cardan_joint() -> None:
    """A cross passes on a moment at right angles to both pins, a pair of forces M/L on the ends of each, and F/2."""
    model = trunnion.read("examples/double-cardan.yaml").data()
    model["measures"] = {"end": {"end_load": "B"}}
    model["joint_defaults"] = {}
    found = trunnion.analyse(Mechanism(**model).with_friction("off"), steps=12)
    force, moment = (
        np.linalg.norm(found[name].sel(joint="B"), axis=0) for name in ("reaction_force", "reaction_moment")
    )
    ends = found.measure_value.sel(measure="end").values
    assert np.all(np.abs(ends - moment / 0.07) <= force / 2 * (1 + 1e-9))
    assert np.all(ends > 10 * force)


def test_what_has_no_ends_is_a_finding() -> None:
    data = overhung(0.1).data()
    data["joints"]["A"].pop("pin")
    with pytest.raises(MechanismError, match="has no ends"):
        Mechanism(**data)


def sizes(found: Any, joint: str) -> Any:
    """The load on every end of a joint, (end, position), N."""
    return np.linalg.norm(found["end_load"].sel(joint=joint), axis=1)


def test_the_table_has_both_ends_and_the_pressure() -> None:
    """Levers: m g (1/2 ± a/L); the end that bears more, over half of the projected area, is the pressure."""
    found = trunnion.analyse(overhung(0.1), steps=4)
    both = 2 * G * np.array([3.5, 2.5])
    assert np.sort(sizes(found, "A")[:, 0])[::-1] == pytest.approx(both, rel=1e-12)
    assert found["pin_pressure"].values == pytest.approx(np.full((1, 4), both[0] / (0.02 * 0.05)), rel=1e-12)
    summary = {row["name"]: row for row in json.loads(found.attrs["summary"])}
    assert summary["A.end_load_max"]["value"] == pytest.approx(both[0], rel=1e-12)
    assert summary["A.pin_pressure_max"]["value"] == pytest.approx(both[0] / (0.02 * 0.05), rel=1e-12)


def test_the_pressure_of_a_pin_in_the_plane() -> None:
    """F/(d b) of the reaction; of pins whose length is not stated there is none."""
    data = trunnion.read("examples/durango-fourbar.yaml").data()
    data["joints"]["C"]["pin"] = {"radius": "0.1 m", "length": "50 mm"}
    found = trunnion.analyse(Mechanism(**data), steps=12)
    force = np.linalg.norm(found["reaction_force"].sel(joint="C"), axis=0)
    assert found["pin_pressure"].sel(joint="C").values == pytest.approx(force / (0.2 * 0.05), rel=1e-12)
    assert np.all(np.isnan(found["pin_pressure"].sel(joint="B")))
    columns = [column.name for column in positions(found)]
    assert "C.pin_pressure" in columns
    assert not any(name.startswith(("B.pin", "C.end")) for name in columns)


def pins_of_the_first_cross(found: Any) -> tuple[Any, Any]:
    """Directions of the two pins of joint B of the double Cardan shaft, (axis, position), by its geometry."""
    turn = found["joint_rotation"].sel(joint="A").values
    first = np.array([-np.sin(turn), np.cos(turn), 0 * turn])
    second = np.cross([0.2, 0, np.sqrt(0.6**2 - 0.2**2)], first.T).T
    return first, second / np.linalg.norm(second, axis=0)


def test_a_massless_cross_by_its_normal() -> None:
    """Without mass and friction it passes on M along its normal n; the input has T = M n·e, each end M/L."""
    data = trunnion.read("examples/double-cardan.yaml").data()
    data.pop("gravity")
    for link in ("input", "middle", "output"):
        for key in ("mass", "inertia", "centre"):
            data["links"][link].pop(key)
    found = brief(Mechanism(**data).with_friction("off"), steps=24)
    first, second = pins_of_the_first_cross(found)
    moment = found["drive_effort"].values[0] / np.cross(first.T, second.T)[:, 2]
    assert sizes(found, "B") == pytest.approx(np.tile(np.abs(moment) / 0.07, (4, 1)), rel=1e-9)
    assert np.ptp(moment) > 5.0


@pytest.mark.parametrize("engine", ["numpy", "compiled"])
def test_friction_of_a_cross_counts_these_loads(engine: Any) -> None:
    """μ r Σ|Q| ω of each pin: the friction of one bears on the other."""
    found = trunnion.analyse(trunnion.read("examples/double-cardan.yaml"), steps=40, engine=engine)
    spin = [found["link_angular_velocity"].sel(link=link).values for link in ("input", "middle")]
    rates = [np.abs(np.sum((spin[1] - spin[0]) * pin, axis=0)) for pin in pins_of_the_first_cross(found)]
    load = sizes(found, "B")
    lost = 0.05 * 0.008 * (load[:2].sum(axis=0) * rates[0] + load[2:].sum(axis=0) * rates[1])
    assert found["friction_power"].sel(joint="B").values == pytest.approx(lost, rel=1e-7)


@pytest.mark.parametrize(
    ("name", "joint", "engine"),
    [
        ("double-cardan", "A", "numpy"),
        ("rssr", "D", "compiled"),
        ("offset-slider-crank", "S", "numpy"),
        ("offset-slider-crank", "S", "compiled"),
    ],
)
def test_friction_counts_these_loads(name: str, joint: str, engine: Any) -> None:
    """μ r Σ|Q| ω of a bearing, μ Σ|Q| v of a guide."""
    model = trunnion.read(f"examples/{name}.yaml")
    found, numbers = trunnion.analyse(model, steps=40, engine=engine), model.parameters()
    motion, lever = ("slide", 1.0) if joint == "S" else ("rotation", numbers[f"joints.{joint}.pin.radius"])
    slip = lever * np.abs(found[f"joint_{motion}_velocity"].sel(joint=joint).values)
    lost = numbers[f"joints.{joint}.friction.coefficient"] * np.nansum(sizes(found, joint), axis=0) * slip
    assert found["friction_power"].sel(joint=joint).values == pytest.approx(lost, rel=1e-7, abs=1e-9)


def test_loads_of_both_signs_are_followed() -> None:
    """The largest of the summary does not depend on the rows; at a place of rest it is that beside it."""
    model = trunnion.read("examples/double-cardan.yaml")
    coarse, fine = (trunnion.analyse(model, steps=steps) for steps in (7, 3600))
    summary = {row["name"]: row["value"] for row in json.loads(coarse.attrs["summary"])}
    for joint in "ABCD":
        most = np.nanmax(sizes(fine, joint))
        assert most * (1 - 1e-12) <= summary[f"{joint}.end_load_max"] <= most * (1 + 1e-3)
