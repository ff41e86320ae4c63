"""Motion stated at one joint, effort at another: against closed forms, virtual work and the way in two runs."""

import json

import numpy as np
import pytest

import trunnion
from brief import brief
from mechanisms import four_bar
from mechanisms_parts import joined, slide
from trunnion import Mechanism, Status
from trunnion.algebra.dual import Dual, derivative
from trunnion.solve.run import prepare

R, L = 0.03, 0.2  # crank and rod of a press, m
RAM = {"law": "cycloidal", "range": ["180 mm", "225 mm"], "duration": "0.5 s", "dwell": "0.1 s"}


def press(drivers, friction=0.1, **more):
    """A crank press: the crank's pin O, the ram's guide S."""
    data = {
        "gravity": [0, -9.81],
        "links": {
            "frame": {"points": {"O": [0, 0], "S": slide(0, 0)}},
            "crank": {"points": {"O": [0, 0], "P": [R, 0]}, "mass": 2.0, "inertia": 1e-3},
            "rod": {"points": {"P": [0, 0], "Q": [L, 0]}, "mass": 1.0, "centre": [L / 2, 0], "inertia": 3e-3},
            "ram": {"points": {"Q": [0, 0], "S": slide(0, 0)}, "mass": 5.0},
        },
        "joints": joined("frame -O- crank -P- rod -Q- ram, frame =S= ram", S={"guide": {"length": 0.15}}),
        "joint_defaults": {"pin": {"radius": 0.025}, "friction": friction},
        "drivers": drivers,
        "loads": {"cut": {"joint": "S", "resisting_force": "5 kN", "useful": True}},
        "assembly": {"Q": [0.18, 0], "P": [0, 0.03]},
    }
    return Mechanism(**{**data, **more})


def test_the_crank_of_a_ram_that_moves_by_a_law():
    """cos θ = (s² + r² − l²)/(2 r s), differentiated along the motion of the ram."""
    own = prepare(press({"O": {"moves": "S", **RAM}}))
    ram = prepare(press({"S": RAM}))
    time = np.linspace(0.02, 0.48, 24)
    s, v, a = ram.system.drive(ram.values, "S", time)
    cosine = (s**2 + R**2 - L**2) / (2 * R * s)
    slope = (s**2 - R**2 + L**2) / (2 * R * s**2)
    bend = -(L**2 - R**2) / (R * s**3)
    angle, sine = np.arccos(cosine), np.sqrt(1 - cosine**2)
    rate = -slope * v / sine
    second = -(bend * v**2 + slope * a + cosine * rate**2) / sine
    for found, wanted in zip(own.system.drive(own.values, "O", time), (angle, rate, second), strict=True):
        assert found == pytest.approx(wanted, rel=1e-10)
    assert own.cycle.duration == ram.cycle.duration


@pytest.mark.parametrize(("example", "driver", "moved"), [("watt-six-bar", "", ""), ("four-bar", "A", "D")])
def test_power_is_the_same_at_whatever_joint_it_enters(example, driver, moved):
    """Without friction the effort times the rate of the driver is that of a driver at the joint that moves."""
    data = four_bar() if example == "four-bar" else trunnion.read(f"examples/{example}.yaml").data()
    data["joint_defaults"] = {}
    data["joints"] = {name: {**joint, "friction": 0} for name, joint in data["joints"].items()}
    plain = Mechanism(**data)
    driver = driver or next(iter(plain.drivers))
    start = brief(plain, steps=360)
    moved = moved or next(
        name for name, joint in plain.joints.items()
        if plain.fixed_link in joint.links and name != driver and joint.type == "revolute"
    )  # fmt: skip
    begin = float(start.joint_rotation.sel(joint=moved)[30])
    law = {"law": "cycloidal", "duration": 1.0, "returns": False,
           "range": [begin, float(start.joint_rotation.sel(joint=moved)[45])]}  # fmt: skip
    places = {name: start.point_position.sel(point=name).isel(position=30).values for name in start.point.values}
    hints = {joint: list(places[f"{plain.joints[joint].links[1]}.{joint}"]) for joint in plain.joints}
    data["assembly"] = {joint: list(map(float, at)) for joint, at in hints.items() if joint not in (driver, moved)}
    data.pop("measures", None)
    driven = brief(Mechanism(**{**data, "drivers": {moved: law}}), steps=50)
    found = brief(Mechanism(**{**data, "drivers": {driver: {"moves": moved, **law}}}), steps=50)
    size = float(np.max(np.abs(driven.drive_power.values)))
    assert found.drive_power.values == pytest.approx(driven.drive_power.values, abs=1e-9 * size)
    assert found.joint_rotation.sel(joint=moved).values == pytest.approx(
        driven.joint_rotation.sel(joint=moved).values, abs=1e-11
    )


def test_a_hand_that_two_drivers_move():
    """Two cranks A and D, two rods to a hand, led along two slides: the motors' power is that of forces at the hand."""
    x, y = {"at": [0, 0], "axis": [1, 0]}, {"at": [0, 0], "axis": [0, 1]}
    bars = {"left": ("A", "B", 0.4, 0.15), "right": ("D", "C", 0.4, 0.15), "rod": ("B", "H", 0.3, 0.18),
            "other": ("C", "J", 0.3, 0.18)}  # fmt: skip
    links = {
        one: {"points": {near: [0, 0], far: [length, 0]}, "mass": mass, "centre": [length / 2, 0], "inertia": 1e-3}
        for one, (near, far, mass, length) in bars.items()
    }
    links |= {
        "ground": {"points": {"A": [0, 0], "D": [0.15, 0], "X": x}},
        "sledge": {"points": {"X": x, "Y": y}, "mass": 1},
        "hand": {"points": {"Y": y, "H": [0, 0], "J": [0, 0]}, "mass": 2.0},
    }
    joints = joined("ground -A- left -B- rod -H- hand, ground -D- right -C- other -J- hand, ground =X= sledge =Y= hand")
    hints = {"B": [-0.08, 0.12], "C": [0.23, 0.12], "H": [0.05, 0.2]}
    data = {"gravity": [0, -9.81], "links": links, "joints": joints, "assembly": hints}
    led = {"X": {"law": "cycloidal", "range": [0.05, 0.12], "duration": 1.0, "returns": False},
           "Y": {"law": "cycloidal", "range": [0.2, 0.16], "duration": 1.0, "returns": False}}  # fmt: skip
    driven = brief(Mechanism(**{**data, "drivers": led}), steps=40)
    motors = {"A": {"moves": "X", **led["X"]}, "D": {"moves": "Y", **led["Y"]}}
    found = brief(Mechanism(**{**data, "drivers": motors}), steps=40)
    power = driven.drive_power.sum("driver").values
    assert found.drive_power.sum("driver").values == pytest.approx(power, abs=1e-9 * np.max(np.abs(power)))
    for joint in ("X", "Y"):
        slides = (one.joint_slide.sel(joint=joint).values for one in (found, driven))
        np.testing.assert_allclose(*slides, atol=1e-12)


def test_past_a_dead_centre_there_is_no_position():
    """A ram that turns a crank: past its dead centre the same place of the ram is another of the crank."""
    turning = {"moves": "O", "start": "30 deg", "speed": "60 rpm"}
    engine = press({"S": turning}, friction=0.0, loads={}, assembly={"O": "30 deg", "P": [0.026, 0.015]})
    found = trunnion.analyse(engine, steps=24)
    angle = np.degrees(found.joint_rotation.sel(joint="O").values)
    turn = np.arange(24) * 15 + 30
    past, between = (turn > 180) & (turn < 360), turn % 180 != 0
    assert np.array_equal(np.isnan(angle)[between], past[between])
    assert np.all(found.status.values[past] == Status.NOT_ASSEMBLED)
    codes = [finding["code"] for finding in json.loads(found.attrs["findings"])]
    assert "assembly.past_dead_centre" in codes


def test_its_derivatives_are_those_of_differences():
    run = prepare(press({"O": {"moves": "S", **RAM}}))
    path, time = "links.crank.points.P.x", np.linspace(0.05, 0.45, 9)

    def efforts(radius):
        return run.solve(time, {**run.values, path: radius}).efforts["O"]

    slope = (efforts(R + 1e-7) - efforts(R - 1e-7)) / 2e-7
    assert derivative(efforts(Dual(R, 1.0))) == pytest.approx(slope, rel=1e-5)
    several = efforts(np.array([[R - 1e-4], [R], [R + 1e-4]]))
    assert several.shape == (3, 9)
    assert several[2] == pytest.approx(efforts(R + 1e-4), rel=1e-12)
