"""Dahl's and the LuGre law: published curves, and the state along a cycle against a stiff integrator."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mechanisms import Array, build, four_bar, positions_of, slider_crank
from trunnion.algebra.dual import Dual, derivative
from trunnion.errors import Status
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.solve.bristles import _chained
from trunnion.solve.run import prepare

DAHL = {"law": "dahl", "coefficient": 0.12, "stiffness": 4e3}
LUGRE = {
    "law": "lugre", "coefficient": 0.1, "static": 0.16, "stribeck_speed": 2e-3, "stiffness": 2e4, "damping": 0.3,
    "viscous": 0.2,
}  # fmt: skip


def state_by_integrator(run: Any, joint: str, law: dict[str, Any], turns: int) -> tuple[Array, Array]:
    """(time, deflection) over the last of some turns from rest, by Radau, the speed asked of the walk itself."""
    lever = run.values.get(f"joints.{joint}.pin.radius", 1.0)
    duration = run.cycle.duration

    def speed(time: float) -> float:
        slip = run.solve(np.array([time % duration])).walk.speed(joint)
        return float(np.ravel(lever * slip)[0])

    fine = np.linspace(0, duration, 4001)
    speeds = np.ravel(lever * run.solve(fine).walk.speed(joint))

    def v_of(time: float) -> float:
        return float(np.interp(time % duration, fine, speeds))

    def curve(v: float) -> float:
        if law["law"] == "dahl":
            return float(law["coefficient"])
        peak = law["static"] - law["coefficient"]
        return float(law["coefficient"] + peak * np.exp(-((v / law["stribeck_speed"]) ** 2)))

    def rate(time: float, z: Array) -> list[float]:
        v = v_of(time)
        return [v - law["stiffness"] * abs(v) / curve(v) * z[0]]

    wanted = (turns - 1) * duration + np.linspace(0, duration, 90, endpoint=False)
    found = solve_ivp(
        rate, (0, turns * duration), [0.0], "Radau", wanted, rtol=1e-8, atol=1e-13, max_step=duration / 400
    )
    assert speed(0.1 * duration) == pytest.approx(v_of(0.1 * duration), rel=1e-4)
    return wanted - (turns - 1) * duration, found.y[0]


@pytest.mark.slow
@pytest.mark.parametrize("law", [DAHL, LUGRE], ids=["dahl", "lugre"])
@pytest.mark.parametrize(("data", "joint"), [(four_bar(), "D"), (slider_crank(), "P")])
def test_state_against_a_stiff_integrator(data: Any, joint: str, law: dict[str, Any]) -> None:
    """In a rocker's pin and a slider's guide, both of which turn back twice a turn, once the start is forgotten."""
    run = prepare(build(data, friction=law))
    time, expected = state_by_integrator(run, joint, law, 2)
    found = run._past[joint].at(time)
    largest = np.abs(expected).max()
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-4 * largest)


@pytest.mark.spread(1)
@pytest.mark.parametrize("law", [DAHL, LUGRE], ids=["dahl", "lugre"])
def test_state_is_periodic_and_settled_whatever_the_steps(law: dict[str, Any]) -> None:
    run = prepare(build(four_bar(), friction=law))
    history, duration = run._past["D"], run.cycle.duration
    time = np.linspace(0, 1, 37) * duration
    np.testing.assert_allclose(history.at(time + 3 * duration), history.at(time), rtol=1e-9, atol=1e-15)
    few, many = positions_of(four_bar(), 18, friction=law), positions_of(four_bar(), 36, friction=law)
    np.testing.assert_allclose(many["drive_effort"].values[:, ::2], few["drive_effort"].values, rtol=1e-12)


def test_dahl_from_rest() -> None:
    """Over a range the bristles start at rest: F = f N (1 − exp(−κ x/f)), exactly."""
    data = {
        "links": {
            "ground": {"points": {"S": {"at": [0, 0], "axis": [1, 0]}}},
            "block": {"points": {"S": {"at": [0, 0], "axis": [1, 0]}}, "mass": 2.0},
        },
        "joints": {"S": {"type": "prismatic", "links": ["ground", "block"]}},
        "drivers": {"S": {"speed": 1e-4, "range": [0.0, 2e-4]}},
    }
    result = positions_of(data, 41, friction=DAHL, guide=0.3)
    slide = result["joint_slide"].sel(joint="S").values
    expected = 0.12 * 2.0 * 9.81 * (1 - np.exp(-4e3 * slide / 0.12))
    np.testing.assert_allclose(-result["friction_force"].sel(joint="S").values, expected, rtol=1e-9, atol=1e-12)


def test_lugre_slides_steadily_by_stribecks_curve() -> None:
    """A fast drive leaves no trace of the bristles between reversals: the pin A always turns one way."""
    steady = {**LUGRE, "law": "stribeck"}
    for key in ("stiffness", "damping"):
        del steady[key]
    bristles, curve = positions_of(four_bar(), 24, friction=LUGRE), positions_of(four_bar(), 24, friction=steady)
    ratios = [
        one["friction_torque"].sel(joint="A").values / np.hypot(*one["reaction_force"].sel(joint="A").values)
        for one in (bristles, curve)
    ]
    np.testing.assert_allclose(*ratios, rtol=1e-3)


def test_presliding_is_a_spring() -> None:
    """Far below the turning way f/κ the contact is a spring of stiffness κ N."""
    law = FRICTION_LAWS["lugre"].function
    options = {key: value for key, value in LUGRE.items() if key != "law"} | {"damping": 0.0, "viscous": 0.0}
    assert law(50.0, 1e-12, deflection=1e-7, **options) == pytest.approx(-2e4 * 1e-7 * 50.0, rel=1e-6)


@pytest.mark.spread(1)
@pytest.mark.parametrize("law", [DAHL, LUGRE], ids=["dahl", "lugre"])
def test_power_balance_and_loss_over_the_cycle(law: dict[str, Any]) -> None:
    """Bristles store a little and give it back; over the cycle they only lose."""
    result = positions_of(slider_crank(), 720, friction=law)
    assert float(np.abs(result["power_residual"]).max()) < 1e-9
    assert float(result["friction_power"].mean("position").min()) > 0


@pytest.mark.parametrize("law", [DAHL, LUGRE], ids=["dahl", "lugre"])
def test_bristles_in_a_linkage_with_gaps(law: dict[str, Any]) -> None:
    """Where it cannot be assembled there is no state; after the gap the bristles start at rest."""
    result = positions_of(four_bar(2.0, 1.5, 1.5, 4.0), 72, friction=law)
    solved = result["status"].values < Status.NOT_CONVERGED
    assert 0 < np.count_nonzero(solved) < 72
    assert np.all(np.isfinite(result["drive_effort"].values[:, solved]))


@pytest.mark.slow
def test_stiff_bristles_slide_steadily() -> None:
    """κ → ∞ leaves Stribeck's curve at every position, beside reversals too."""
    law = {**LUGRE, "stiffness": 1e9, "damping": 0.0, "stribeck_speed": 0.05}
    steady = {key: value for key, value in law.items() if key not in ("stiffness", "damping")} | {"law": "stribeck"}
    bristles, curve = (positions_of(slider_crank(), 360, friction=one) for one in (law, steady))
    same = bristles["status"].values == curve["status"].values
    np.testing.assert_allclose(
        bristles["friction_force"].sel(joint="P").values[same],
        curve["friction_force"].sel(joint="P").values[same],
        rtol=2e-4,
        atol=1e-6,
    )


def test_samples_of_speed_and_duals_of_the_law() -> None:
    run = prepare(build(four_bar(), friction=LUGRE))
    time = np.linspace(0.1, 0.9, 7) * run.cycle.duration
    plain = np.broadcast_to(run.solve(time).efforts["A"], time.shape)
    values = run.system.mechanism.parameters({"drivers.A.speed": np.full((5, 1), run.values["drivers.A.speed"])})
    many = np.broadcast_to(run.solve(time, values).efforts["A"], (5, 7))
    np.testing.assert_allclose(many, np.broadcast_to(plain, (5, 7)), rtol=1e-9)
    for key in ("coefficient", "static", "stiffness", "stribeck_speed"):
        path = f"joints.B.friction.{key}"
        value, h = run.values[path], 1e-5 * run.values[path]
        found = derivative(run.solve(time, run.system.mechanism.parameters({path: Dual(value, 1.0)})).efforts["A"])
        ends = [
            run.solve(time, run.system.mechanism.parameters({path: value + sign * h})).efforts["A"] for sign in (1, -1)
        ]
        expected = (ends[0] - ends[1]) / (2 * h)
        scale = np.abs(expected).max() + np.abs(plain).max() / value * 1e-3
        np.testing.assert_allclose(np.broadcast_to(found, time.shape), expected, rtol=0, atol=1e-4 * scale)


def test_maps_of_intervals_are_chained_and_closed() -> None:
    """z ↦ z/2 + 1, then z ↦ 0.8 z + 2: over both z ↦ 0.4 z + 2.8, which comes back to z₀ = 2.8/0.6; from rest 0."""
    keep, gain = np.array([0.5, 0.8]), np.array([1.0, 2.0])
    start = 2.8 / 0.6
    np.testing.assert_allclose(_chained(keep, gain, True), [start, start / 2 + 1, start], rtol=1e-15)
    np.testing.assert_allclose(_chained(keep, gain, False), [0.0, 1.0, 2.8], rtol=1e-15)
