"""Closed forms and published figures of common linkages: positions and sensitivities by dual numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import trunnion
from brief import brief
from mechanisms import body, build, revolute, slider_crank
from trunnion.algebra.dual import Dual, derivative, primal
from trunnion.solve.run import prepare

MM = 1e-3
LENGTHS = {"L1": 100.0, "L2": 30.0, "L3": 90.0, "L4": 70.0}  # ground, crank, coupler, rocker, mm


def four_bar_in_mm() -> Any:
    return build(
        {
            "dimensions": {name: f"{value} mm" for name, value in LENGTHS.items()},
            "links": {
                "ground": {"points": {"A": [0, 0], "D": ["L1", 0]}},
                "crank": body({"A": [0, 0], "B": ["L2", 0]}, 1, 0.03),
                "coupler": body({"B": [0, 0], "C": ["L3", 0]}, 2, 0.09),
                "rocker": body({"D": [0, 0], "C": ["L4", 0]}, 3, 0.07),
            },
            "joints": {
                "A": revolute("ground", "crank"),
                "B": revolute("crank", "coupler"),
                "C": revolute("coupler", "rocker"),
                "D": revolute("ground", "rocker"),
            },
            "drivers": {"A": {"speed": 1.0, "start": "60 deg"}},
            "assembly": {"C": ["90 mm", "70 mm"]},
        }
    )


def angle(run: Any, link: str, values: Any = None) -> Any:
    frame = run.solve(np.array([0.0]), values).walk.motions[link].frame
    from trunnion.algebra.namespace import namespace

    return namespace(frame.s, frame.c).arctan2(frame.s, frame.c)


def test_rocker_angle() -> None:
    assert np.degrees(angle(prepare(four_bar_in_mm()), "rocker"))[0] == pytest.approx(95.195700, abs=5e-7)


@pytest.mark.parametrize(
    ("name", "expected"), [("L1", 0.013654), ("L2", -0.013401), ("L3", -0.015623), ("L4", 0.006323)]
)
def test_sensitivity_of_the_rocker_angle(name: str, expected: float) -> None:
    """∂θ₄/∂l, rad/mm."""
    mechanism = four_bar_in_mm()
    values = mechanism.parameters({name: Dual(LENGTHS[name] * MM, 1.0)})
    found = derivative(angle(prepare(mechanism), "rocker", values))
    assert float(np.ravel(found)[0]) * MM == pytest.approx(expected, abs=5e-7)


@pytest.mark.parametrize(("dimension", "expected"), [("r", 0.307945), ("l", 1.024295), ("e", 0.221766)])
def test_sensitivity_of_the_slider(dimension: str, expected: float) -> None:
    """Slider-crank r = 50, l = 200, e = 0, θ = 60°: ∂x/∂(r, l, e).

    e as the sheet has it lowers the crank against the slide, so that x = r cos θ + √(l² − (r sin θ + e)²)
    has the slope −0.22 with e; a raised guide has the opposite sign.
    """
    data = slider_crank(50 * MM, 200 * MM, 0.0)
    data["drivers"]["A"] = {"speed": 1.0, "start": float(np.pi / 3)}
    data["assembly"] = {"P": [0.22, 0.0]}
    path, value = {
        "r": ("links.crank.points.B.x", 50 * MM),
        "l": ("links.rod.points.P.x", 200 * MM),
        "e": ("links.ground.points.C.y", 0.0),
    }[dimension]
    mechanism = build(data)
    run = prepare(mechanism)
    back = run.solve(np.array([0.0]), mechanism.parameters({path: Dual(value, 1.0)}))
    x = back.walk.point("piston", "P").place[0]
    assert float(np.ravel(derivative(x))[0]) == pytest.approx(expected, abs=5e-7)
    sine = 50 * MM * np.sin(np.pi / 3)
    assert float(np.ravel(primal(x))[0]) == pytest.approx(0.025 + np.sqrt(0.04 - sine**2), abs=1e-15)


def test_slider_crank_motion_in_closed_form() -> None:
    r, length, e, rate = 0.3, 1.0, 0.1, -6.0
    result = brief(build(slider_crank(r, length, e)), 90)
    q = rate * result["time"].values
    root = np.sqrt(length**2 - (e - r * np.sin(q)) ** 2)
    x = r * np.cos(q) + root
    drop = (e - r * np.sin(q)) * r * np.cos(q) / root
    v = rate * (-r * np.sin(q) + drop)
    found = result.sel(point="piston.P", axis="x")
    np.testing.assert_allclose(found["point_position"], x, rtol=0, atol=1e-14)
    np.testing.assert_allclose(found["point_velocity"], v, rtol=0, atol=1e-13)
    slide = result["joint_slide"].sel(joint="C")
    np.testing.assert_allclose(np.diff(slide), np.diff(x), rtol=0, atol=1e-14)
    np.testing.assert_allclose(result["joint_slide_velocity"].sel(joint="C"), v, rtol=0, atol=1e-13)
    a = result["joint_slide_acceleration"].sel(joint="C").values
    s = (e - r * np.sin(q)) * r * np.cos(q) / root
    second = -r * np.cos(q) + (-(r**2) * np.cos(q) ** 2 - (e - r * np.sin(q)) * r * np.sin(q) - s**2) / root
    np.testing.assert_allclose(a, rate**2 * second, rtol=0, atol=1e-12)


def test_pendulum_driver_holds_a_weight() -> None:
    """One link on a driven pin: T = m g l cos φ + J_A α, here without acceleration; R = m (a − g)."""
    mechanism = trunnion.Mechanism(
        gravity=[0, -9.81],
        links={
            "ground": {"points": {"A": [0, 0]}},
            "arm": {"points": {"A": [0, 0]}, "mass": 3.0, "centre": [0.5, 0], "inertia": 0.2},
        },
        joints={"A": {**revolute("ground", "arm"), "pin": {"radius": 0.02}, "friction": 0.1}},
        drivers={"A": {"speed": 2.0}},
    )
    result = trunnion.analyse(mechanism, 16)
    q = 2.0 * result["time"].values
    fx = -3.0 * 0.5 * 4.0 * np.cos(q)
    fy = 3.0 * 9.81 - 3.0 * 0.5 * 4.0 * np.sin(q)
    force = result["reaction_force"].values[0]
    np.testing.assert_allclose(force, [fx, fy], rtol=0, atol=1e-12)
    friction = 0.1 * 0.02 * np.hypot(fx, fy)
    np.testing.assert_allclose(result["friction_torque"].values[0], -friction, rtol=0, atol=1e-14)
    np.testing.assert_allclose(
        result["drive_effort"].values[0], 3.0 * 9.81 * 0.5 * np.cos(q) + friction, rtol=0, atol=1e-12
    )
    assert result.attrs["formula"] == "I(0,1)R"
