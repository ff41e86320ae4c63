"""Rack, chain and screw in the plane against virtual work, statics by hand and the textbook's screw."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

import trunnion
from brief import brief
from geared import screwed_strut
from mechanisms import Data, build, findings, positions_of
from mechanisms_parts import prismatic, revolute, slide
from trunnion import Mechanism, MechanismError, Status

RADIUS, TORQUE = 0.008, 80.0


def steering(driver: Data, gear: Data | None = None) -> Data:
    """Half of a rack steering: the tie rod turns a knuckle against a torque. The rack lies below the pinion."""
    return {
        "gravity": [0, 0],
        "links": {
            "frame": {"points": {"P": [0, RADIUS], "S": slide(0, 0), "K": [0.6, 0.15]}},
            "pinion": {"points": {"P": [0, 0]}},
            "rack": {"points": {"S": slide(0, 0), "T": [0.3, 0]}},
            "rod": {"points": {"T": [0, 0], "A": [0.285, 0]}},
            "knuckle": {"points": {"K": [0, 0], "A": [-0.02, -0.14]}},
        },
        "joints": {
            "P": revolute("frame", "pinion"),
            "S": prismatic("frame", "rack"),
            "T": revolute("rack", "rod"),
            "A": revolute("rod", "knuckle"),
            "K": revolute("frame", "knuckle"),
        },
        "gears": {"mesh": {"joints": ["P", "S"], "radius": RADIUS, **(gear or {})}},
        "drivers": driver,
        "loads": {"tyre": {"joint": "K", "resisting_torque": TORQUE}},
        "assembly": {"A": [0.58, 0.01]},
    }


def at(result: Any, variable: str, axis: str | None = None, **where: str) -> Any:
    chosen = result[variable].sel(**where, **({"axis": axis} if axis else {}))
    return chosen.values


def knuckle_by_hand(rack: Any) -> Any:
    """Angle of the knuckle for a place of the rack: circles about T and K meet in A, on the lower side."""
    tx, ty, kx, ky = 0.3 + rack, 0.0, 0.6, 0.15
    arm, rod, apart = np.hypot(0.02, 0.14), 0.285, np.hypot(kx - tx, ky - ty)
    along = (rod**2 - arm**2 + apart**2) / (2 * apart)
    across = np.sqrt(rod**2 - along**2)
    ux, uy = (kx - tx) / apart, (ky - ty) / apart
    ax, ay = tx + along * ux + across * uy, ty + along * uy - across * ux
    return np.arctan2(ay - ky, ax - kx) - np.arctan2(-0.14, -0.02)


@pytest.mark.parametrize("order", [("P", "S"), ("S", "P")])
@pytest.mark.parametrize("angle", [20.0, 14.5, 0.0])
def test_rack_steering(order: tuple[str, str], angle: float) -> None:
    """Torque · ω = tyre torque · ω of the knuckle, by differences of the geometry; a tooth presses with F/cos α."""
    gear = {"joints": list(order), "pressure_angle": np.radians(angle), "phase": 0.001}
    result = brief(Mechanism(**steering({"P": {"speed": 2.0, "range": [-5.0, 5.0]}}, gear)), 11)
    rack = RADIUS * np.linspace(-5.0, 5.0, 11) + 0.001
    np.testing.assert_allclose(at(result, "joint_slide", joint="S"), rack, atol=1e-15)
    h = 1e-4
    rate = (8 * (knuckle_by_hand(rack + h) - knuckle_by_hand(rack - h))
            - (knuckle_by_hand(rack + 2 * h) - knuckle_by_hand(rack - 2 * h))) / (12 * h)  # fmt: skip
    force = TORQUE * np.abs(rate)  # along the rack, by virtual work
    np.testing.assert_allclose(at(result, "drive_effort", driver="P"), force * RADIUS, rtol=1e-9)
    np.testing.assert_allclose(at(result, "gear_torque", gear="mesh"), -force * RADIUS, rtol=1e-9)
    tilt = np.tan(np.radians(angle))
    np.testing.assert_allclose(at(result, "gear_force", "x", gear="mesh"), force, rtol=1e-9)
    # the flanks push the rack down, away from the pinion, and the pinion up
    np.testing.assert_allclose(at(result, "gear_force", "y", gear="mesh"), -force * tilt, rtol=1e-9, atol=1e-9)
    reaction = np.hypot(*(at(result, "reaction_force", axis, joint="P") for axis in "xy"))
    np.testing.assert_allclose(reaction, force / np.cos(np.radians(angle)), rtol=1e-9)
    rod = at(result, "reaction_force", "y", joint="T")  # on the rod by the rack
    np.testing.assert_allclose(at(result, "reaction_force", "y", joint="S"), force * tilt + rod, rtol=1e-9, atol=1e-6)


def wheel_and_rack(driver: Data) -> Data:
    data = steering(driver)
    data["loads"] = {"wind": {"joint": "P", "resisting_torque": 3.0}}
    data["links"] = {name: data["links"][name] for name in ("frame", "pinion", "rack")}
    data["joints"] = {name: data["joints"][name] for name in ("P", "S")}
    data["links"]["frame"]["points"].pop("K")
    data["assembly"] = {}
    return data


def test_driven_rack_turns_the_pinion() -> None:
    """The pair the other way round: the rack drives, a torque on the pinion asks for T/r on the rack."""
    data = wheel_and_rack({"S": {"speed": 0.02, "range": [-0.1, 0.1]}})
    result = brief(Mechanism(**data), 9)
    np.testing.assert_allclose(at(result, "drive_effort", driver="S"), 3.0 / RADIUS, rtol=1e-12)
    np.testing.assert_allclose(at(result, "gear_torque", gear="mesh"), 3.0, rtol=1e-12)
    np.testing.assert_allclose(at(result, "gear_force", "x", gear="mesh"), -3.0 / RADIUS, rtol=1e-12)
    # two turns and more to either side, not taken back to one
    turned = at(result, "link_angle", link="pinion")
    np.testing.assert_allclose(turned - turned[4], np.linspace(-0.1, 0.1, 9) / RADIUS, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("joint", "ends"), [("P", (0.0, 1000.0)), ("S", (200.0, 210.0)), ("P", (-900.0, -1000.0)), ("S", (-900.0, -1000.0))]
)
def test_many_turns_away(joint: str, ends: tuple[float, float]) -> None:
    """Thousands of radii from where the rack is drawn, and turns by hundreds from one position to the next."""
    rotation = 2 * np.pi * np.linspace(*ends, 90)
    coordinate = rotation if joint == "P" else RADIUS * rotation
    driver = {"speed": float(np.sign(ends[1] - ends[0])), "range": [float(coordinate[0]), float(coordinate[-1])]}
    result = brief(Mechanism(**wheel_and_rack({joint: driver})), 90)
    np.testing.assert_allclose(at(result, "joint_slide", joint="S"), RADIUS * rotation, rtol=1e-12, atol=1e-12)
    off = at(result, "joint_rotation", joint="P") - rotation
    np.testing.assert_allclose(np.exp(1j * off), 1.0, atol=1e-9)


def test_motion_of_the_knuckle_stated() -> None:
    """The pinion is driven by what the knuckle is to do, turns of its own included; the efforts are the same."""
    law = {"moves": "K", "speed": 0.5, "range": [-0.25, 0.25]}
    data = steering({"P": law})
    data["assembly"] = {"A": [0.58, 0.01], "T": [0.3, 0.0]}
    result = brief(Mechanism(**data), 9)
    rack = at(result, "joint_slide", joint="S")
    np.testing.assert_allclose(knuckle_by_hand(rack), np.linspace(-0.25, 0.25, 9), atol=1e-9)
    assert np.abs(rack[0] / RADIUS) > np.pi
    h = 1e-5
    rate = (knuckle_by_hand(rack + h) - knuckle_by_hand(rack - h)) / (2 * h)
    np.testing.assert_allclose(at(result, "drive_effort", driver="P"), TORQUE * RADIUS * np.abs(rate), rtol=1e-7)


def hoist(**wheel: Any) -> Data:
    return {
        "gravity": [0, -9.81],
        "links": {
            "frame": {"points": {"A": [0, 0], "S": slide(0.06, -1.0, np.pi / 2)}},
            "wheel": {"points": {"A": [0, 0]}, "inertia": 0.05},
            "load": {"points": {"S": slide(0, 0, np.pi / 2)}, "mass": 100.0, "useful": True},
        },
        "joints": {"A": {**revolute("frame", "wheel"), **wheel}, "S": prismatic("frame", "load")},
        "gears": {"chain": {"joints": ["A", "S"], "radius": 0.06, "teeth": False}},
        "drivers": {"A": {"speed": np.pi, "range": [0.0, 12.0]}},
    }


def test_chain_hoist() -> None:
    """m g r at the wheel, m g in its bearing and nothing at the guide; friction of the bearing adds f r_pin m g."""
    weight = 100.0 * 9.81
    result = brief(Mechanism(**hoist()), 5)
    np.testing.assert_allclose(at(result, "drive_effort", driver="A"), weight * 0.06, rtol=1e-12)
    np.testing.assert_allclose(at(result, "reaction_force", "y", joint="A"), weight, rtol=1e-12)
    np.testing.assert_allclose(at(result, "reaction_force", "x", joint="A"), 0.0, atol=1e-9)
    np.testing.assert_allclose(at(result, "reaction_moment", joint="S"), 0.0, atol=1e-9)
    rough = trunnion.analyse(Mechanism(**hoist(pin={"radius": 0.01}, friction=0.1)), 5)
    np.testing.assert_allclose(at(rough, "drive_effort", driver="A"), weight * (0.06 + 0.1 * 0.01), rtol=1e-12)
    assert float(rough["efficiency"]) == pytest.approx(0.06 / 0.061, rel=1e-12)


@pytest.mark.parametrize(("peak", "slack"), [(0.5, False), (1.5, True)])
def test_a_rope_that_would_push(peak: float, slack: bool) -> None:
    """A load that swings with A ω² = 0.5 g and 1.5 g pulls with m (g ∓ A ω²): the second would push with m g/2."""
    data = hoist()
    rate = 2 * np.pi
    data["drivers"]["A"] = {
        "law": "harmonic", "mean": 1.0, "amplitude": peak * 9.81 / (0.06 * rate**2), "period": 1.0, "phase": 0.0
    }  # fmt: skip
    notes = [one for one in findings(trunnion.analyse(Mechanism(**data), 5)) if one["code"] == "gears.slack"]
    assert len(notes) == int(slack)
    for note in notes:
        weight = 100.0 * 9.81
        forces = sorted(abs(note["figures"][key]) for key in ("lower", "upper"))
        assert forces == pytest.approx([0.5 * weight, 2.5 * weight], rel=1e-9)


def test_a_falling_load_turns_its_wheel() -> None:
    """s̈ = g m r²/(m r² + J), the wheel's motion free."""
    data = hoist()
    data["drivers"]["A"] = {"speed": 1.0, "free": True, "range": [-60.0, 5.0], "initial": {"coordinate": 0, "speed": 0}}
    result = trunnion.simulate(Mechanism(**data), 0.4, 4)
    second = 9.81 * 100.0 * 0.06 / (100.0 * 0.06**2 + 0.05)
    time = result["time"].values
    np.testing.assert_allclose(at(result, "drive_coordinate", driver="A"), -second * time**2 / 2, atol=1e-10)


# ---- screws ---------------------------------------------------------------------------------------------------

ARM, LEAD, MEAN, LOAD = 0.15, 0.004, 0.006, 5000.0
SLOPE = np.arctan(LEAD / (2 * np.pi * MEAN))


def jack(friction: float | None, speed: float, order: str = "WS") -> Data:
    """A scissor jack whose screw turns in one block and pulls the nut in the other, from 40 deg on."""
    c, s = ARM * np.cos(np.radians(40)), ARM * np.sin(np.radians(40))
    ends = [0.0, 60.0] if speed > 0 else [60.0, 0.0]
    thread = {} if friction is None else {"friction": friction, "pin": {"radius": MEAN}}
    return {
        "gravity": [0, 0],
        "links": {
            "ground": {"points": {"A": [0, 0], "B": [0, 0], "G": slide(0, 0, np.pi / 2)}},
            "lower_left": {"points": {"A": [0, 0], "C": [ARM, 0]}},
            "lower_right": {"points": {"B": [0, 0], "D": [ARM, 0]}},
            "upper_left": {"points": {"E": [0, 0], "H": [ARM, 0]}},
            "upper_right": {"points": {"F": [0, 0], "K": [ARM, 0]}},
            "saddle": {"points": {"E": [0, 0], "F": [0, 0], "G": slide(0, 0, np.pi / 2)}},
            "nut": {"points": {"C": [0, 0], "H": [0, 0], "S": slide(0, 0)}},
            "block": {"points": {"D": [0, 0], "K": [0, 0], "S": slide(0, 0), "W": [0.04, 0]}},
            "screw": {"points": {"W": [0, 0]}},
        },
        "joints": {
            "A": revolute("ground", "lower_left"),
            "B": revolute("ground", "lower_right"),
            "C": revolute("lower_left", "nut"),
            "D": revolute("lower_right", "block"),
            "H": revolute("upper_left", "nut"),
            "K": revolute("upper_right", "block"),
            "E": revolute("saddle", "upper_left"),
            "F": revolute("saddle", "upper_right"),
            "G": prismatic("ground", "saddle"),
            "S": prismatic("nut", "block"),
            "W": {**revolute("block", "screw"), **thread},
        },
        "gears": {"thread": {"joints": list(order), "lead": -LEAD, "phase": 2 * c}},
        "drivers": {"W": {"speed": speed, "range": ends}},
        "loads": {"car": {"link": "saddle", "at": "E", "force": [0, -LOAD], "useful": True}},
        "assembly": {"C": [-c, s], "D": [c, s], "E": [0, 2 * s]},
    }


def with_two_threads(data: Data) -> Data:
    """The same with a right-hand thread in one block and a left-hand one in the other: both nuts move."""
    data = copy.deepcopy(data)
    data["links"]["spindle"] = {"points": {"S": slide(0, 0), "R": slide(0, 0), "W": [0, 0]}}
    data["links"]["block"]["points"] = {"D": [0, 0], "K": [0, 0], "R": slide(0, 0)}
    data["joints"] |= {"S": prismatic("nut", "spindle"), "R": prismatic("spindle", "block")}
    data["joints"]["W"]["links"] = ["spindle", "screw"]
    half = {"lead": -LEAD, "phase": data["gears"]["thread"]["phase"] / 2}
    data["gears"] = {"left": {"joints": ["W", "S"], **half}, "right": {"joints": ["R", "W"], **half}}
    return data


@pytest.mark.parametrize(("friction", "order"), [(None, "WS"), (0.05, "SW"), (0.15, "WS"), (0.3, "SW")])
def test_scissor_jack(friction: float | None, order: str) -> None:
    """P r tan(λ + φ) raises and P r tan(λ − φ) lowers, with the screw's pull P = F w/h; one turn moves the lead."""
    angle = np.arctan(friction or 0.0)
    for speed, tangent in ((-10.0, np.tan(SLOPE - angle)), (10.0, np.tan(SLOPE + angle))):
        result = trunnion.analyse(Mechanism(**jack(friction, speed, order)), 7)
        turned = np.linspace(*((0.0, 60.0) if speed > 0 else (60.0, 0.0)), 7)
        width = 2 * ARM * np.cos(np.radians(40)) - LEAD * turned / (2 * np.pi)
        pull = LOAD * width / np.sqrt(4 * ARM**2 - width**2)
        np.testing.assert_allclose(at(result, "joint_slide", joint="S"), width, rtol=1e-12)
        np.testing.assert_allclose(at(result, "drive_effort", driver="W"), pull * MEAN * tangent, rtol=1e-12)
        np.testing.assert_allclose(at(result, "gear_torque", gear="thread"), -pull * MEAN * tangent, rtol=1e-12)
        np.testing.assert_allclose(at(result, "gear_force", "x", gear="thread"), -pull, rtol=1e-12)
        assert np.abs(result["power_residual"]).max() < 1e-12 * np.abs(result["drive_power"]).max()
    assert float(result["efficiency"]) == pytest.approx(np.tan(SLOPE) / np.tan(SLOPE + angle), rel=1e-12)


@pytest.mark.parametrize("friction", [None, 0.15])
def test_jack_with_two_threads(friction: float | None) -> None:
    """2 P r tan(λ + φ)."""
    result = brief(Mechanism(**with_two_threads(jack(friction, 10.0))), 7)
    width = 2 * ARM * np.cos(np.radians(40)) - 2 * LEAD * np.linspace(0.0, 60.0, 7) / (2 * np.pi)
    pull = LOAD * width / np.sqrt(4 * ARM**2 - width**2)
    torque = 2 * pull * MEAN * np.tan(SLOPE + np.arctan(friction or 0.0))
    np.testing.assert_allclose(at(result, "drive_effort", driver="W"), torque, rtol=1e-12)


def test_jack_by_the_height_it_lifts_to() -> None:
    """The saddle's motion is stated: the screw makes P r tan(λ + φ) at each height, P = F w/h."""
    data = jack(0.15, 10.0)
    data["drivers"] = {"W": {"moves": "G", "speed": 0.005, "range": [0.2, 0.24]}}
    data["assembly"]["S"] = 0.2
    result = brief(Mechanism(**data), 9)
    height = np.linspace(0.2, 0.24, 9)
    np.testing.assert_allclose(at(result, "joint_slide", joint="G"), height, rtol=1e-9)
    pull = LOAD * np.sqrt(4 * ARM**2 - height**2) / height
    torque = pull * MEAN * np.tan(SLOPE + np.arctan(0.15))
    np.testing.assert_allclose(at(result, "drive_effort", driver="W"), torque, rtol=1e-9)


def press(friction: float, driver: Data, lead: float = 0.02, **more: Any) -> Data:
    """A nut on a guide, whose screw turns in the frame."""
    return {
        "gravity": [0, 0],
        "links": {
            "ground": {"points": {"W": [0, 0], "S": slide(0, 0, 0.9)}},
            "wheel": {"points": {"W": [0, 0]}, "inertia": 1e-3},
            "nut": {"points": {"S": slide(0, 0)}, "mass": 2.0},
        },
        "joints": {
            "W": {**revolute("ground", "wheel"), "friction": friction, "pin": {"radius": MEAN}},
            "S": prismatic("ground", "nut"),
        },
        "gears": {"screw": {"joints": ["W", "S"], "lead": lead}},
        "drivers": driver,
        **more,
    }


@pytest.mark.parametrize("friction", [0.1, 0.3, 0.6])
def test_driven_at_the_nut(friction: float) -> None:
    """F r tan(λ − φ) turns the screw; from φ = λ on it locks, at tan λ/f of the friction."""
    slope = np.arctan(0.02 / (2 * np.pi * MEAN))
    driver, brake = {"S": {"speed": 0.01, "range": [0.0, 0.1]}}, {"b": {"joint": "W", "resisting_torque": 1.0}}
    result = brief(Mechanism(**press(friction, driver, loads=brake)), 5)
    np.testing.assert_allclose(result["locking_margin"], np.tan(slope) / friction, rtol=1e-6)
    if friction > np.tan(slope):
        assert np.all(result["status"] == Status.LOCKED)
    else:
        force = 1.0 / (MEAN * np.tan(slope - np.arctan(friction)))
        np.testing.assert_allclose(at(result, "drive_effort", driver="S"), force, rtol=1e-10)


@pytest.mark.parametrize("torque", [0.0, 0.2, 0.4, 1.5])
@pytest.mark.parametrize("friction", [0.05, 0.6])
def test_a_free_screw(friction: float, torque: float) -> None:
    """(J + m p r tan(λ ± φ)) ω̇ = T − F r tan(λ ± φ), p = lead/2π; at rest between the two torques."""
    p, force, phi = 0.02 / (2 * np.pi), 100.0, np.arctan(friction)
    slope = np.arctan(p / MEAN)
    free = {"W": {"speed": 1, "free": True, "range": [-60, 60], "initial": {"coordinate": 0, "speed": 0}}}
    loads = {
        "weight": {"link": "nut", "at": "S", "force": [-force * np.cos(0.9), -force * np.sin(0.9)]},
        "hand": {"link": "wheel", "moment": torque},
    }
    result = trunnion.simulate(Mechanism(**press(friction, free, loads=loads)), 0.2, 5)
    up, down = MEAN * np.tan(slope + phi), MEAN * np.tan(slope - phi)
    lever = up if torque > force * up else down if torque < force * down else None
    second = 0.0 if lever is None else (torque - force * lever) / (1e-3 + 2.0 * p * lever)
    expected = second * result["time"].values ** 2 / 2
    np.testing.assert_allclose(at(result, "drive_coordinate", driver="W"), expected, rtol=1e-9, atol=1e-12)


def test_a_screw_is_a_driven_slide() -> None:
    """Without friction the strut bears the same forces where its slide is driven as the screw moves it."""
    rate = 0.006 / (2 * np.pi)
    turned, plain = screwed_strut(), screwed_strut()
    turned["links"]["wheel"] = {"points": {"W": [0, 0]}}  # without mass: the other has no wheel
    del plain["links"]["wheel"], plain["joints"]["W"], plain["links"]["tube"]["points"]["W"], plain["gears"]
    plain["drivers"] = {"S": {"speed": 20.0 * rate, "range": [0.3, 0.3 + 120.0 * rate]}}
    screw = positions_of(turned, 9, friction=None)
    driven = positions_of(plain, 9, friction=None)
    for joint in "ACD":
        for axis in "xy":
            np.testing.assert_allclose(
                at(screw, "reaction_force", axis, joint=joint),
                at(driven, "reaction_force", axis, joint=joint),
                rtol=1e-9,
                atol=1e-9,
            )
    torque, force = at(screw, "drive_effort", driver="W"), at(driven, "drive_effort", driver="S")
    np.testing.assert_allclose(torque, force * rate, rtol=1e-9)


# ---- what cannot be -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "where", "what"),
    [
        ({"lead": 0.005}, "gears.mesh", "radius and lead are stated"),
        ({"radius": None}, "gears.mesh", "no ratio, radius or lead is stated"),
        ({"ratio": 2.0}, "gears.mesh", "ratio and radius are stated"),
        ({"radius": 0}, "gears.mesh.radius", "is 0"),
        ({"radius": None, "lead": 0}, "gears.mesh.lead", "is 0"),
        ({"joints": ["P", "K"]}, "gears.mesh", "both joints turn, and radius is stated"),
        ({"joints": ["A", "S"]}, "gears.mesh", "have no link in common that carries the wheel"),
        ({"joints": ["S", "S"]}, "gears.mesh.joints", "names the joint 'S' twice"),
        ({"radius": None, "lead": 0.005, "pressure_angle": 0.3}, "gears.mesh.pressure_angle", "no pitch point"),
        ({"teeth": False, "pressure_angle": 0.3}, "gears.mesh.pressure_angle", "has no effect without teeth"),
        ({"phase": "20 deg"}, "gears.mesh.phase", "where a length is needed"),
    ],
)
def test_impossible_racks(change: Data, where: str, what: str) -> None:
    data = steering({"P": {"speed": 2.0, "range": [-5.0, 5.0]}}, change)
    data["gears"]["mesh"] = {key: value for key, value in data["gears"]["mesh"].items() if value is not None}
    with pytest.raises(MechanismError) as error:
        build(data)
    assert [finding.where for finding in error.value.findings] == [where]
    assert what in error.value.findings[0].what


def test_a_thread_with_the_friction_of_pins() -> None:
    """What defaults say of pins is told of a thread; with its own mean radius and friction it is not."""
    defaults = {"friction": 0.2, "pin": {"radius": 0.02}, "guide": {"length": 0.1}}
    data = press(0.1, {"W": {"speed": 1.0, "range": [0, 1]}}, joint_defaults=defaults)
    assert not [finding for finding in Mechanism(**data).checked if finding.where == "gears.screw"]
    del data["joints"]["W"]["pin"]
    (warning,) = (finding for finding in Mechanism(**data).checked if finding.where == "gears.screw")
    assert "by joint_defaults" in warning.what


def test_two_slides() -> None:
    data = press(0.1, {"S": {"speed": 1.0, "range": [0, 1]}})
    data["links"]["ground"]["points"]["R"] = data["links"]["wheel"]["points"]["R"] = slide(0, 0)
    data["joints"] = {"S": data["joints"]["S"], "R": prismatic("ground", "wheel")}
    data["gears"]["screw"]["joints"] = ["R", "S"]
    with pytest.raises(MechanismError) as error:
        Mechanism(**data)
    assert [finding.what for finding in error.value.findings] == ["both joints slide"]


def test_a_rack_that_goes_on_is_no_cycle() -> None:
    """A pinion that turns for ever does not bring the rack back: a warning, as of a nut."""
    result = trunnion.analyse(Mechanism(**press(0.1, {"W": {"speed": 1.0}})), 12)
    assert not result.attrs["periodic"]
    assert any(finding["code"] == "cycle.not_common" for finding in findings(result))


def test_check_tells_the_wheel() -> None:
    checked = trunnion.check(Mechanism(**steering({"P": {"speed": 2.0, "range": [-5.0, 5.0]}})), 12)
    (pair,) = checked.gears
    assert pair.radii == (("pinion", RADIUS),)
    assert (checked.mobility, checked.rank_mobility) == (1, 1)
