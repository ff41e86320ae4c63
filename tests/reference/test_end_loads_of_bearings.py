"""Loads on the ends of bearings and guides, against statics of a beam on two supports."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import trunnion
from trunnion import Mechanism, MechanismError

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
