"""Gear pairs against geometry, the power balance and the law of the separating force."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

import trunnion
from brief import brief
from geared import geared_five_bar, geared_loop, planet_drive, rocker_train
from mechanisms import Data, analyse, build, findings, model, positions_of
from trunnion import Mechanism, MechanismError
from trunnion.solve.run import prepare

TOOTHED = {"five-bar": geared_five_bar, "planet": planet_drive, "loop": geared_loop}


def straight_line_gears(radius: float) -> Data:
    """Cardan's circles: a planet of half the ring's radius; a point of its pitch circle runs on a diameter."""
    return {
        "links": {
            "ground": {"points": {"A": [0, 0]}},
            "carrier": {"points": {"A": [0, 0], "B": [radius, 0]}},
            "planet": {"points": {"B": [0, 0], "P": [radius, 0]}, "mass": 2.0},
        },
        "joints": {
            "A": {"type": "revolute", "links": ["ground", "carrier"]},
            "B": {"type": "revolute", "links": ["carrier", "planet"]},
        },
        "gears": {"ring": {"joints": ["A", "B"], "ratio": -2, "phase": 0}},
        "drivers": {"A": {"speed": 2.0}},
    }


def test_cardan_circles() -> None:
    """x = 2 r cos θ, y = 0 (La Hire, 1706)."""
    result = brief(Mechanism(**straight_line_gears(0.07)), 60)
    theta = 2.0 * result["time"].values
    np.testing.assert_allclose(
        result["point_position"].sel(point="planet.P", axis="x"), 0.14 * np.cos(theta), atol=1e-15
    )
    np.testing.assert_allclose(result["point_position"].sel(point="planet.P", axis="y"), 0.0, atol=1e-15)


def test_two_wheels() -> None:
    """A train of two wheels on the ground: torque by the ratio, tooth force 1/cos α of torque by radius."""
    angle, torque = np.radians(25.0), 30.0
    data = {
        "links": {
            "ground": {"points": {"A": [0, 0], "E": [0.3, 0]}},
            "pinion": {"points": {"A": [0, 0]}},
            "wheel": {"points": {"E": [0, 0]}},
        },
        "joints": {
            "A": {"type": "revolute", "links": ["ground", "pinion"]},
            "E": {"type": "revolute", "links": ["ground", "wheel"]},
        },
        "gears": {"mesh": {"joints": ["A", "E"], "ratio": "-1/2", "pressure_angle": "25 deg"}},
        "drivers": {"A": {"speed": 10.0}},
        "loads": {"brake": {"joint": "E", "resisting_torque": torque}},
    }
    result = brief(Mechanism(**data), 8)  # type: ignore[arg-type]
    assert result["time"].values[-1] == pytest.approx(2 * 2 * np.pi / 10 * 7 / 8)  # two turns of the pinion
    np.testing.assert_allclose(result["drive_effort"].sel(driver="A"), torque / 2, rtol=1e-12)
    tangential, apart = torque / 0.2, torque / 0.2 * np.tan(angle)
    force = result["gear_force"].sel(gear="mesh")
    # the pinion turns left, so its teeth push the wheel's upward at the pitch point, and away from itself
    np.testing.assert_allclose(force.sel(axis="y"), tangential, rtol=1e-12)
    np.testing.assert_allclose(force.sel(axis="x"), apart, rtol=1e-12)
    np.testing.assert_allclose(result["reaction_force"].sel(joint="E", axis="x"), -apart, rtol=1e-12)
    np.testing.assert_allclose(result["reaction_force"].sel(joint="A", axis="x"), apart, rtol=1e-12)
    np.testing.assert_allclose(result["reaction_force"].sel(joint="A", axis="y"), tangential, rtol=1e-12)


@pytest.mark.parametrize("friction", [None, 0.15])
@pytest.mark.parametrize("name", TOOTHED)
def test_separating_force(name: str, friction: float | None) -> None:
    """The tooth force leans by the pressure angle from the tangent of the pitch circles, and pushes the gears apart."""
    data = model(TOOTHED[name](), friction=friction)
    run = prepare(build(TOOTHED[name](), friction=friction))
    back = run.solve(np.linspace(0.1, 0.9, 30) * run.cycle.duration)
    for gear, stated in data["gears"].items():
        angle = stated.get("pressure_angle", np.radians(20.0))
        (carrier,) = set.intersection(*(set(run.system.joints[joint][1]) for joint in stated["joints"]))
        a, d = (back.walk.element(carrier, joint) for joint in stated["joints"])
        x, y = d.x - a.x, d.y - a.y
        fx, fy = back.gears[gear].force
        along, across = (fx * x + fy * y) / np.hypot(x, y), (fy * x - fx * y) / np.hypot(x, y)
        external = -1.0 if name == "planet" else 1.0  # the planet lies inside the ring, which pushes it to the centre
        np.testing.assert_allclose(along, external * np.abs(across) * np.tan(angle), rtol=1e-6)


@pytest.mark.parametrize("name", TOOTHED)
def test_teeth_change_reactions_only(name: str) -> None:
    """A train of the same ratio asks for the same drive torque: teeth do no work."""
    other = copy.deepcopy(TOOTHED[name]())
    for gear in other["gears"].values():
        gear["teeth"] = False
        gear.pop("pressure_angle", None)
    toothed, train = positions_of(TOOTHED[name](), 24, friction=None), positions_of(other, 24, friction=None)
    np.testing.assert_allclose(train["drive_effort"], toothed["drive_effort"], atol=1e-9)
    np.testing.assert_allclose(train["gear_torque"], toothed["gear_torque"], atol=1e-9)
    assert np.abs(train["reaction_force"] - toothed["reaction_force"]).max() > 1.0


def test_ratio_is_kept_over_all_turns() -> None:
    result = analyse(geared_five_bar(), 200)
    rotation = result["joint_rotation"]
    slip = rotation.sel(joint="E") - 0.5 * rotation.sel(joint="A") - 0.4
    np.testing.assert_allclose(np.angle(np.exp(1j * slip)), 0.0, atol=1e-13)
    assert result.attrs["periodic"]
    assert result["time"].values[-1] == pytest.approx(4 * np.pi / 3 * 199 / 200)
    train = positions_of(rocker_train(), 90)
    turned = train["joint_rotation"].sel(joint="E") - 0.7 * train["joint_rotation"].sel(joint="D") + 2.5
    np.testing.assert_allclose(np.angle(np.exp(1j * turned)), 0.0, atol=1e-13)
    assert train["time"].values[-1] == pytest.approx(2 * np.pi / 5 * 89 / 90)  # the rocker makes no whole turn


@pytest.mark.parametrize(
    ("change", "where", "what"),
    [
        ({"joints": ["A", "X"]}, "gears.mesh.joints", "there is no joint 'X'"),
        ({"joints": ["A", "A"]}, "gears.mesh.joints", "names the joint 'A' twice"),
        ({"joints": ["A", "C"]}, "gears.mesh", "have no link in common"),
        ({"ratio": 0}, "gears.mesh.ratio", "is 0"),
        ({"ratio": -1}, "gears.mesh.ratio", "they have no pitch point"),
        ({"pressure_angle": "95 deg"}, "gears.mesh.pressure_angle", "is 95 deg"),
        ({"teeth": False, "pressure_angle": 0.3}, "gears.mesh.pressure_angle", "has no effect without teeth"),
    ],
)
def test_impossible_gears(change: dict[str, Any], where: str, what: str) -> None:
    data = geared_five_bar()
    data["gears"]["mesh"].update(change)
    with pytest.raises(MechanismError) as error:
        build(data)
    assert [f.where for f in error.value.findings] == [where]
    assert what in error.value.findings[0].what


def test_a_gear_pair_too_many() -> None:
    data = geared_five_bar()
    data["gears"]["other"] = {"joints": ["A", "B"], "ratio": 2, "teeth": False}
    with pytest.raises(MechanismError) as error:
        trunnion.analyse(build(data))
    assert "mobility is 0" in error.value.findings[0].what


def test_turns_that_never_come_back() -> None:
    """A ratio without a common turn: one turn of the drive, and a warning."""
    data = geared_five_bar()
    data["gears"]["mesh"]["ratio"] = 0.5123
    result = analyse(data, 36)
    assert not result.attrs["periodic"]
    assert any(finding["code"] == "cycle.not_common" for finding in findings(result))


def cycle_of(data: Data) -> float:
    return float(prepare(build(data)).cycle.duration)


def test_cycle_whichever_way_a_gear_pair_is_stated() -> None:
    """φ_E = ½ φ_A + 0.4 and φ_A = 2 φ_E − 0.8 are one gear pair: two turns of the crank."""
    one, other = geared_five_bar(), geared_five_bar()
    other["gears"]["mesh"] = {"joints": ["E", "A"], "ratio": 2.0, "phase": -0.8}
    assert cycle_of(one) == pytest.approx(2 * 2 * np.pi / 3)
    assert cycle_of(other) == pytest.approx(cycle_of(one))
    plain, turned = positions_of(one, 60), positions_of(other, 60)
    np.testing.assert_allclose(turned["drive_effort"], plain["drive_effort"], rtol=1e-9)


def test_cycle_of_a_chain_of_gear_pairs() -> None:
    """½ · ½ · ½ of a turn: eight turns of the driver, with the pairs stated in any direction."""
    names = "ABCD"
    data: Data = {
        "links": {
            "ground": {"points": {name: [0.3 * i, 0.0] for i, name in enumerate(names)}},
            **{f"g{i}": {"points": {name: [0, 0]}, "mass": 1.0} for i, name in enumerate(names)},
        },
        "joints": {name: {"type": "revolute", "links": ["ground", f"g{i}"]} for i, name in enumerate(names)},
        "gears": {
            "o": {"joints": ["C", "D"], "ratio": -0.5},
            "n": {"joints": ["C", "B"], "ratio": -2.0},
            "m": {"joints": ["A", "B"], "ratio": -0.5},
        },
        "drivers": {"A": {"speed": 2 * np.pi}},
    }
    mechanism = Mechanism(**data)
    run = prepare(mechanism)
    assert run.cycle.duration == pytest.approx(8.0)
    assert run.cycle.periodic
    result = brief(mechanism, 80)
    turned = result["joint_rotation"].sel(joint="D").values / (2 * np.pi)
    np.testing.assert_allclose(turned, -result["time"].values / 8, atol=1e-9)


def test_gears_without_room() -> None:
    data = geared_five_bar()
    data["links"]["ground"]["points"]["E"] = [0, 0]
    with pytest.raises(MechanismError) as error:
        build(data)
    assert any("the centre distance is zero" in finding.what for finding in error.value.findings)


def test_check_tells_internal_from_external() -> None:
    (mesh,) = trunnion.check(build(geared_five_bar()), 12).gears
    assert not mesh.internal
    assert sum(radius for _, radius in mesh.radii) == pytest.approx(np.hypot(1.2, 0.1))
    (ring,) = trunnion.check(build(planet_drive()), 12).gears
    assert ring.internal
    assert dict(ring.radii) == pytest.approx({"ground": 0.6, "planet": 0.2})
