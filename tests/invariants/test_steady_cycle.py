"""The steady cycle of motions in time: closed forms, limits, energy, and the motion that goes on from it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import trunnion
from timed import LINEAR, mass_on_a_belt, slider_crank, wheel
from trunnion.dynamics.steady_cycle import UnsteadyError

AWAY = [*range(1, 60), *range(61, 120)]


def figures(result: Any) -> dict[str, float]:
    return {one.name: one.value for one in result.trunnion.summary}


def shaker(inertia: float, **motor: Any) -> trunnion.Mechanism:
    """A motor with an unbalance of 2 kg at 50 mm on a carriage of 10 kg, on a spring and a damper."""
    slide = {"at": [0, 0], "axis": [1, 0]}
    return trunnion.Mechanism(
        links={
            "ground": {"points": {"S": slide, "W": [-1, 0]}},
            "carriage": {"points": {"S": slide, "A": [0, 0]}, "mass": 10},
            "rotor": {"points": {"A": [0, 0]}, "mass": 2, "centre": [0.05, 0], "inertia": inertia},
        },
        joints={
            "S": {"type": "prismatic", "links": ["ground", "carriage"]},
            "A": {"type": "revolute", "links": ["carriage", "rotor"]},
        },
        drivers={
            "A": {"speed": 20, "motor": {"kind": "linear", "stall_effort": 4, "no_load_speed": 20, **motor},
                  "initial": {"speed": 20}},
            "S": {"range": [-1, 1], "speed": 1, "free": True, "initial": {"coordinate": 0}},
        },
        springs={"k": {"between": ["ground.W", "carriage.A"], "stiffness": 3000, "free_length": 1, "damping": 60}},
        gravity=[0, 0],
    )  # fmt: skip


def test_a_wheel_with_a_direct_current_motor() -> None:
    """T_s (1 − ω/ω₀) = drag, so ω = 150 (1 − 0.6/4) = 127.5; a difference decays as e^(−t T_s/(J ω₀)), over 2π/ω."""
    told = figures(trunnion.simulate(wheel(LINEAR), steps=12, steady=True))
    assert told["A.speed_mean"] == pytest.approx(127.5, rel=1e-9)
    assert told["cycle_time"] == pytest.approx(2 * np.pi / 127.5, rel=1e-9)
    assert told["decay"] == pytest.approx(np.exp(-2 * np.pi / 127.5 / 1.875), rel=1e-5)
    backward = figures(
        trunnion.simulate(wheel({**LINEAR, "stall_effort": -4, "no_load_speed": -150}), steps=12, steady=True)
    )
    assert backward["A.speed_mean"] == pytest.approx(127.5, rel=1e-9)


def test_a_controller_holds_the_speed_with_its_integral() -> None:
    """No error is left: ω is the target, and the integral gives the drag."""
    servo = {"kind": "speed-control", "target": 100, "proportional": 0.5, "integral": 2, "limit": 5}
    result = trunnion.simulate(wheel(servo), steps=12, steady=True)
    assert figures(result)["A.speed_mean"] == pytest.approx(100.0, rel=1e-9)
    assert result["drive_effort"].values == pytest.approx(0.6, rel=1e-9)


def test_an_unbalanced_rotor_shakes_its_carriage() -> None:
    """Forced vibration: X = m e ω²/√((k − M ω²)² + (c ω)²); the motor gives what the damper takes, T ω = c (X ω)²/2.

    The inertia of the rotor holds its speed even, to m e X/J = 3e-7.
    """
    result = trunnion.simulate(shaker(1e4), duration=8.0, steps=360, steady=True)
    speed = figures(result)["A.speed_mean"]
    amplitude = 2 * 0.05 * speed**2 / np.hypot(3000 - 12 * speed**2, 60 * speed)
    slide = result["joint_slide"].sel(joint="S").values
    assert 2 * abs(np.fft.rfft(slide)[1]) / 360 == pytest.approx(amplitude, rel=1e-6)
    assert 4 * (1 - speed / 20) == pytest.approx(60 * amplitude**2 * speed / 2, rel=1e-6)


@pytest.mark.parametrize("friction", [0.0, pytest.param(0.1, marks=pytest.mark.slow)])
def test_the_motion_goes_on_as_it_is(friction: float) -> None:
    """Integrated on from the first position of the cycle it repeats; works and efforts are those of the cycle."""
    data = slider_crank(friction).data()
    data["drivers"]["O"]["initial"] = {"speed": 118}
    result = trunnion.simulate(trunnion.Mechanism(**data), duration=0.3, steps=120, steady=True)
    told = figures(result)
    speed = float(result["joint_rotation_velocity"].sel(joint="O")[0])
    data["drivers"]["O"]["initial"] = {"coordinate": 0, "speed": speed}
    after = trunnion.simulate(trunnion.Mechanism(**data), duration=told["cycle_time"], steps=120, tolerance=1e-12)
    rate = after["drive_rate"].sel(driver="O").values
    assert rate[120] == pytest.approx(speed, rel=1e-8)
    assert np.max(np.abs(rate[:120] - result["joint_rotation_velocity"].sel(joint="O").values)) < 1e-8 * speed
    for name in ("reaction_force", "drive_effort"):
        of_both = [np.moveaxis(np.asarray(one[name].values), -1, 0)[1:60] for one in (result, after)]
        assert np.max(np.abs(of_both[0] - of_both[1])) < 1e-6 * np.max(np.abs(of_both[1])), name
    works = {name: float(after[f"work_{name}"][120]) for name in ("drive", "loads", "friction")}
    left = works["drive"] + works["loads"] - works["friction"]
    assert abs(left) < 1e-8 * works["drive"]  # no energy is left over
    assert float(result["drive_power_mean"]) * told["cycle_time"] == pytest.approx(works["drive"], rel=1e-7)
    assert told["efficiency"] == pytest.approx(-works["loads"] / works["drive"], rel=1e-7)


def test_a_heavy_flywheel_gives_the_analysis_at_constant_speed() -> None:
    """The difference to `analyse` at the mean speed falls as 1/J."""
    misses = []
    for inertia in (20.0, 200.0):
        crank = slider_crank(friction=0.0)
        data = crank.data()
        data["links"]["crank"]["inertia"] = inertia
        data["drivers"]["O"]["initial"] = {"speed": 140.0}
        cycle = trunnion.simulate(trunnion.Mechanism(**data), steps=120, steady=True)
        even = trunnion.analyse(crank.with_values({"O.speed": figures(cycle)["O.speed_mean"]}), steps=120)
        # not where the slider turns round, and its load with it
        pins = [
            one["reaction_force"].sel(joint=["P", "Q"]).transpose(..., "position").values[..., AWAY]
            for one in (cycle, even)
        ]
        misses.append(float(np.max(np.abs(pins[0] - pins[1])) / np.max(np.abs(pins[1]))))
    assert misses[0] < 0.01
    assert misses[1] == pytest.approx(misses[0] / 10, rel=0.05)


def test_the_cycle_goes_to_every_view(tmp_path: Any) -> None:
    """It is a cycle like another: tables, figures and report."""
    result = trunnion.simulate(wheel(LINEAR), steps=24, steady=True)
    assert result.trunnion.kind == "cycle"
    assert set(trunnion.analyse(wheel(LINEAR), 24).variables) == set(result.variables)
    assert trunnion.report(result).startswith("<!doctype html>")
    assert trunnion.plot(result, "polar") is not None
    trunnion.save(result, tmp_path / "cycle.csv")
    assert len((tmp_path / "cycle.csv").read_text().splitlines()) == 25


@pytest.mark.parametrize(
    ("made", "code"),
    [
        (wheel({**LINEAR, "stall_effort": 0.5}), "simulate.not_round"),
        (wheel(initial={"speed": 10}), "simulate.not_round"),
        (wheel({"kind": "constant", "effort": 1}, drag=0.5), "simulate.not_repeating"),
    ],
)
def test_no_steady_cycle_is_told_with_its_cause(made: trunnion.Mechanism, code: str) -> None:
    with pytest.raises(UnsteadyError) as told:
        trunnion.simulate(made, steady=True)
    assert told.value.findings[0].code == code


@pytest.mark.parametrize(
    ("made", "where"),
    [
        (wheel({**LINEAR, "off_from": 2}), "drivers.A.motor.off_from"),
        (wheel({"kind": "table", "over": "time", "points": [[0, 4], [1, 3]]}), "drivers.A.motor.over"),
        (wheel(LINEAR, drag="0.6 N m * between(time, 0 s, 9 s)"), "loads.drag.resisting_torque"),
        (mass_on_a_belt(), "drivers.B"),
    ],
)
def test_what_cannot_be_a_cycle_is_refused(made: trunnion.Mechanism, where: str) -> None:
    with pytest.raises(trunnion.MechanismError) as told:
        trunnion.simulate(made, steady=True)
    assert told.value.findings[0].where == where
