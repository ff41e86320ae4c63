"""Gear pairs, racks, chains and screws against geometry, virtual work, statics by hand and the textbook's screw."""

import copy

import numpy as np
import pytest

import trunnion
from brief import brief, judged
from mechanisms import analyse, geared_five_bar, geared_loop, planet_drive, positions_of, rocker_train, screwed_strut
from mechanisms_parts import corner, joined, slide
from trunnion import Mechanism, Status
from trunnion.results.attributes import findings_of
from trunnion.solve.run import prepare

TOOTHED = {"five-bar": geared_five_bar, "planet": planet_drive, "loop": geared_loop}


def test_two_wheels():
    """A train of two wheels on the ground: torque by the ratio, tooth force 1/cos α of torque by radius."""
    angle, torque = np.radians(25.0), 30.0
    data = {
        "links": {
            "ground": {"points": {"A": [0, 0], "E": [0.3, 0]}},
            "pinion": {"points": {"A": [0, 0]}},
            "wheel": {"points": {"E": [0, 0]}},
        },
        "joints": joined("ground -A- pinion, ground -E- wheel"),
        "gears": {"mesh": {"joints": ["A", "E"], "ratio": "-1/2", "pressure_angle": "25 deg"}},
        "drivers": {"A": {"speed": 10.0}},
        "loads": {"brake": {"joint": "E", "resisting_torque": torque}},
    }
    result = brief(Mechanism(**data), 8)
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


@pytest.mark.parametrize("name", TOOTHED)
def test_teeth_change_reactions_only(name):
    """A train of the same ratio asks for the same drive torque: teeth do no work."""
    other = copy.deepcopy(TOOTHED[name]())
    for gear in other["gears"].values():
        gear["teeth"] = False
        gear.pop("pressure_angle", None)
    toothed, train = positions_of(TOOTHED[name](), 24, friction=None), positions_of(other, 24, friction=None)
    np.testing.assert_allclose(train["drive_effort"], toothed["drive_effort"], atol=1e-9)
    np.testing.assert_allclose(train["gear_torque"], toothed["gear_torque"], atol=1e-9)
    assert np.abs(train["reaction_force"] - toothed["reaction_force"]).max() > 1.0


def test_ratio_is_kept_over_all_turns():
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


def test_cycle_of_a_chain_of_gear_pairs():
    """½ · ½ · ½ of a turn: eight turns of the driver, with the pairs stated in any direction."""
    names = "ABCD"
    data = {
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
    cycle, result = prepare(Mechanism(**data)).cycle, brief(Mechanism(**data), 80)
    assert (cycle.duration, cycle.periodic) == (pytest.approx(8.0), True)
    turned = result["joint_rotation"].sel(joint="D").values / (2 * np.pi)
    np.testing.assert_allclose(turned, -result["time"].values / 8, atol=1e-9)


RADIUS, TORQUE = 0.008, 80.0


def steering(driver, gear=None):
    """Half of a rack steering: the tie rod turns a knuckle against a torque. The rack lies below the pinion."""
    return {
        "gravity": [0, 0],
        "links": {
            "ground": {"points": {"P": [0, RADIUS], "S": slide(0, 0), "K": [0.6, 0.15]}},
            "pinion": {"points": {"P": [0, 0]}},
            "rack": {"points": {"S": slide(0, 0), "T": [0.3, 0]}},
            "rod": {"points": {"T": [0, 0], "A": [0.285, 0]}},
            "knuckle": {"points": {"K": [0, 0], "A": [-0.02, -0.14]}},
        },
        "joints": joined("ground -P- pinion, ground =S= rack -T- rod -A- knuckle, ground -K- knuckle"),
        "gears": {"mesh": {"joints": ["P", "S"], "radius": RADIUS, **(gear or {})}},
        "drivers": driver,
        "loads": {"tyre": {"joint": "K", "resisting_torque": TORQUE}},
        "assembly": {"A": [0.58, 0.01]},
    }


def at(result, variable, axis=None, **where):
    return result[variable].sel(**where, **({"axis": axis} if axis else {})).values


def knuckle_by_hand(rack):
    """Angle of the knuckle for a place of the rack: circles about T and K meet in A, on the lower side."""
    a = corner(0.3 + np.asarray(rack), 0.6 + 0.15j, 0.285, np.hypot(0.02, 0.14), -1)
    return np.angle((a - (0.6 + 0.15j)) / (-0.02 - 0.14j))


@pytest.mark.parametrize(("order", "angle"), [(("P", "S"), 20.0), (("S", "P"), 14.5)])
def test_rack_steering(order, angle):
    """Torque · ω = tyre torque · ω of the knuckle, by differences of the geometry; all forces are right."""
    gear = {"joints": list(order), "pressure_angle": np.radians(angle), "phase": 0.001}
    data = steering({"P": {"speed": 2.0, "range": [-5.0, 5.0]}}, gear)
    result = brief(Mechanism(**data), 11)
    rack = RADIUS * np.linspace(-5.0, 5.0, 11) + 0.001
    np.testing.assert_allclose(at(result, "joint_slide", joint="S"), rack, atol=1e-15)
    h = 1e-4
    rate = (8 * (knuckle_by_hand(rack + h) - knuckle_by_hand(rack - h))
            - (knuckle_by_hand(rack + 2 * h) - knuckle_by_hand(rack - 2 * h))) / (12 * h)  # fmt: skip
    force = TORQUE * np.abs(rate)  # along the rack, by virtual work
    np.testing.assert_allclose(at(result, "drive_effort", driver="P"), force * RADIUS, rtol=1e-9)
    judged(data, result)


def wheel_and_rack(driver):
    data = steering(driver)
    data["loads"] = {"wind": {"joint": "P", "resisting_torque": 3.0}}
    data["links"] = {name: data["links"][name] for name in ("ground", "pinion", "rack")}
    data["joints"] = {name: data["joints"][name] for name in ("P", "S")}
    data["links"]["ground"]["points"].pop("K")
    data["assembly"] = {}
    return data


def test_driven_rack_turns_the_pinion():
    """The pair the other way round: the rack drives, a torque on the pinion asks for T/r on the rack."""
    result = brief(Mechanism(**wheel_and_rack({"S": {"speed": 0.02, "range": [-0.1, 0.1]}})), 9)
    np.testing.assert_allclose(at(result, "drive_effort", driver="S"), 3.0 / RADIUS, rtol=1e-12)
    np.testing.assert_allclose(at(result, "gear_torque", gear="mesh"), 3.0, rtol=1e-12)
    np.testing.assert_allclose(at(result, "gear_force", "x", gear="mesh"), -3.0 / RADIUS, rtol=1e-12)
    # two turns and more to either side, not taken back to one
    turned = at(result, "link_angle", link="pinion")
    np.testing.assert_allclose(turned - turned[4], np.linspace(-0.1, 0.1, 9) / RADIUS, rtol=1e-9, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("joint", "ends"), [("P", (0.0, 1000.0)), ("S", (-900.0, -1000.0))])
def test_many_turns_away(joint, ends):
    """Thousands of radii from where the rack is drawn, and turns by hundreds from one position to the next."""
    rotation = 2 * np.pi * np.linspace(*ends, 90)
    coordinate = rotation if joint == "P" else RADIUS * rotation
    driver = {"speed": float(np.sign(ends[1] - ends[0])), "range": [float(coordinate[0]), float(coordinate[-1])]}
    result = brief(Mechanism(**wheel_and_rack({joint: driver})), 90)
    np.testing.assert_allclose(at(result, "joint_slide", joint="S"), RADIUS * rotation, rtol=1e-12, atol=1e-12)
    off = at(result, "joint_rotation", joint="P") - rotation
    np.testing.assert_allclose(np.exp(1j * off), 1.0, atol=1e-9)


def hoist(**wheel):
    return {
        "gravity": [0, -9.81],
        "links": {
            "frame": {"points": {"A": [0, 0], "S": slide(0.06, -1.0, np.pi / 2)}},
            "wheel": {"points": {"A": [0, 0]}, "inertia": 0.05},
            "load": {"points": {"S": slide(0, 0, np.pi / 2)}, "mass": 100.0, "useful": True},
        },
        "joints": joined("frame -A- wheel, frame =S= load", A=wheel),
        "gears": {"chain": {"joints": ["A", "S"], "radius": 0.06, "teeth": False}},
        "drivers": {"A": {"speed": np.pi, "range": [0.0, 12.0]}},
    }


def test_chain_hoist():
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


@pytest.mark.parametrize("lift", [0.0, 900.0, 2000.0])
def test_a_rope_that_would_push_is_named_with_its_force(lift):
    """m g − F sin of the angle, closed form."""
    force = {"link": "load", "at": "S", "force": [0, f"{lift} N * sin(drive)"]}
    result = trunnion.analyse(Mechanism(**hoist() | {"loads": {"lift": force}}), 7)
    slack = [found.figures for found in findings_of(result) if found.code == "gears.slack"]
    assert len(slack) == (lift > 100.0 * 9.81)
    for figures in slack:
        ends = sorted(abs(figures[end]) for end in ("lower", "upper"))
        np.testing.assert_allclose(ends, [lift - 981.0, lift + 981.0], rtol=1e-9)


def test_a_falling_load_turns_its_wheel():
    """s̈ = g m r²/(m r² + J), the wheel's motion free."""
    data = hoist()
    data["drivers"]["A"] = {"speed": 1.0, "free": True, "range": [-60.0, 5.0], "initial": {"coordinate": 0, "speed": 0}}
    result = trunnion.simulate(Mechanism(**data), 0.4, 4)
    second = 9.81 * 100.0 * 0.06 / (100.0 * 0.06**2 + 0.05)
    time = result["time"].values
    np.testing.assert_allclose(at(result, "drive_coordinate", driver="A"), -second * time**2 / 2, atol=1e-10)


MEAN = 0.006  # radius of the thread, m


def press(friction, driver, lead=0.02, **more):
    """A nut on a guide, whose screw turns in the frame."""
    return {
        "gravity": [0, 0],
        "links": {
            "ground": {"points": {"W": [0, 0], "S": slide(0, 0, 0.9)}},
            "wheel": {"points": {"W": [0, 0]}, "inertia": 1e-3},
            "nut": {"points": {"S": slide(0, 0)}, "mass": 2.0},
        },
        "joints": joined("ground -W- wheel, ground =S= nut", W={"friction": friction, "pin": {"radius": MEAN}}),
        "gears": {"screw": {"joints": ["W", "S"], "lead": lead}},
        "drivers": driver,
        **more,
    }


@pytest.mark.parametrize("friction", [0.1, 0.6])
def test_driven_at_the_nut(friction):
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


@pytest.mark.spread(1)
@pytest.mark.parametrize(("friction", "torque"), [(0.05, 0.0), (0.05, 1.5), (0.6, 0.4)])
def test_a_free_screw(friction, torque):
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


def test_a_screw_is_a_driven_slide():
    """Without friction the strut bears the same forces where its slide is driven as the screw moves it."""
    rate = 0.006 / (2 * np.pi)
    turned, plain = screwed_strut(), screwed_strut()
    turned["links"]["wheel"] = {"points": {"W": [0, 0]}}  # without mass: the other has no wheel
    del plain["links"]["wheel"], plain["joints"]["W"], plain["links"]["tube"]["points"]["W"], plain["gears"]
    plain["drivers"] = {"S": {"speed": 20.0 * rate, "range": [0.3, 0.3 + 120.0 * rate]}}
    screw = positions_of(turned, 9, friction=None)
    driven = positions_of(plain, 9, friction=None)
    for joint in "ACD":
        forces = (at(one, "reaction_force", joint=joint) for one in (screw, driven))
        np.testing.assert_allclose(*forces, rtol=1e-9, atol=1e-9)
    torque, force = at(screw, "drive_effort", driver="W"), at(driven, "drive_effort", driver="S")
    np.testing.assert_allclose(torque, force * rate, rtol=1e-9)


def test_a_turn_of_a_screw_is_no_cycle_that_comes_back():
    """The nut rises by one pitch, and the work of the drive lifts it."""
    pitch, mass, axis = 0.006, 400.0, {"at": [0, 0, 0], "axis": [0, 0, 1], "x": [1, 0, 0]}
    nut = {"points": {"H": axis}, "mass": mass, "centre": [0, 0, 0], "inertia": dict.fromkeys(("xx", "yy", "zz"), 1.0)}
    mechanism = Mechanism(
        space="spatial",
        gravity=[0, 0, -9.81],
        joint_defaults={"friction": 0},
        links={"ground": {"points": {"H": axis}}, "nut": nut},
        joints={"H": {"type": "helical", "pitch": pitch, "links": ["ground", "nut"]}},
        drivers={"H": {"speed": "60 rpm"}},
    )
    result = trunnion.analyse(mechanism, steps=25)
    z = result["point_position"].sel(point="nut.H", axis="z").values
    assert z[-1] - z[0] == pytest.approx(pitch, rel=1e-9)
    np.testing.assert_allclose(np.abs(result["drive_effort"].values), mass * 9.81 * pitch / (2 * np.pi), rtol=1e-9)
    assert [one.code for one in result.trunnion.findings].count("cycle.not_common") == 1
