"""Joints that lock in motion beside others that move on, several accelerations, and the rest of all free drivers."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from timed import wheel
from trunnion.dynamics.simulate import simulate
from trunnion.model.mechanism import Mechanism
from trunnion.results.attributes import summary_of

G = 9.81
AXIS = {"at": [0, 0], "axis": [1, 0]}


def events(data: Any) -> list[tuple[str, str, float, float | None]]:
    """Kind, joint, time, s, and figure of all events."""
    rows = json.loads(data.attrs["events"])
    return [(kind, of, float(time), figure)
            for (kind, of, figure, *_), time in zip(rows, data.event_time.values, strict=True)]  # fmt: skip


def findings(data: Any) -> dict[str, dict[str, Any]]:
    return {one["code"]: one["figures"] for one in json.loads(data.attrs["findings"])}


# ---- a slider that jams, with a block on it -------------------------------------------------------------------

LOW, HIGH, ARM, GUIDE, F = 2.0, 1.0, 0.3, 0.2, 0.5
JAM = 2 * F * ARM / GUIDE  # friction per inertia of what slides with its mass centre beside the guide: above 1


def blocks(force: str, upper: float = 0.0, gravity: float = 0.0, above: float = -1.0) -> Mechanism:
    """A slider with its mass centre beside its guide, pushed along it, and a block that slides on it."""
    return Mechanism(
        gravity=[0, -gravity],
        links={
            "ground": {"points": {"A": AXIS}},
            "low": {"points": {"A": AXIS, "B": AXIS}, "mass": LOW, "centre": [0, ARM]},
            "high": {"points": {"B": AXIS}, "mass": HIGH},
        },
        joints={
            "A": {"type": "prismatic", "links": ["ground", "low"], "friction": F, "guide": {"length": GUIDE}},
            "B": {"type": "prismatic", "links": ["low", "high"], "friction": upper, "guide": {"length": 20}},
        },
        drivers={
            name: {"speed": 1, "range": [-50, 50], "free": True, "initial": {"coordinate": 0, "speed": speed}}
            for name, speed in (("A", 1.0), ("B", above))
        },
        loads={"push": {"link": "low", "at": "A", "force": [force, 0]}},
    )


@pytest.mark.slow
def test_a_slider_jams_where_its_push_turns_round_and_the_block_on_it_keeps_its_momentum() -> None:
    """m q̈ + κ m |q̈| = T with κ > 1: pushed ahead q̈ = T/(m (1 + κ)); braked there is no q̈, and it stops at once; then
    it is pushed back. The block on it, without friction, stands still in space all the time."""
    data = simulate(blocks("1 N - time/(1 s)*2 N"), 1.0, 8)
    mass, half = LOW * (1 + JAM), 0.5
    top = 1.0 + half**2 / mass
    (lock, back) = events(data)
    assert lock[:3] == ("lock", "A", pytest.approx(half, abs=1e-8))
    assert lock[3] == pytest.approx(0.5 * LOW * top**2, rel=1e-9)
    assert back[:2] == ("break-away", "A")
    time, low, high = data.time.values, *data.drive_rate.values
    after = time > half
    assert low[time < half] == pytest.approx((1 + (time - time**2) / mass)[time < half], abs=1e-9)
    assert low[after] == pytest.approx(-((time - half) ** 2)[after] / mass, abs=1e-9)
    known = np.isfinite(low)
    assert (low + high)[known] == pytest.approx(0.0, abs=1e-9)
    assert float(abs(data.energy_residual).max()) < 1e-9
    assert float(data.work_friction[-1]) > float(lock[3] or 0.0)
    assert findings(data)["simulate.joints_lock"]["joints"] == ["A"]
    assert findings(data)["simulate.several_accelerations"]["time"] == 0.0  # also T/(m (1 − κ)) obeys


def test_what_sticks_to_a_slider_that_jams_is_torn_away() -> None:
    """Braked by more than its friction at low accelerations, the slider has no acceleration, and jams; the block that
    stuck to it slides on with the speed that it had, and with its own friction."""
    data = simulate(blocks("-200 N", 0.2, G, 0.0), 0.05, 10)
    (kind, of, time, lost) = next(one for one in events(data) if one[0] == "lock")
    assert (kind, of, time) == ("lock", "A", 0.0)
    assert lost == pytest.approx(0.5 * LOW, rel=1e-9)
    assert float(data.drive_rate[1, 0]) == pytest.approx(1.0, abs=1e-9)
    over = data.drive_rate.values.sum(axis=0)  # speed in space
    assert over == pytest.approx(1.0 - 0.2 * G * data.time.values, abs=1e-8)
    assert float(abs(data.energy_residual).max()) < 1e-8


# ---- the slider alone: one free coordinate --------------------------------------------------------------------


def slider(force: str, friction: float | dict[str, Any] = F) -> Mechanism:
    """The slider without the block."""
    data = blocks(force).data()
    del data["links"]["high"], data["joints"]["B"], data["drivers"]["B"]
    data["joints"]["A"]["friction"] = friction
    return Mechanism(**data)


def test_a_slider_alone_jams_where_its_push_turns_round() -> None:
    """As above: q̈ = T/(m (1 + κ)) ahead, a stop at once, and back by as much."""
    data = simulate(slider("1 N - time/(1 s)*2 N"), 1.0, 8)
    mass, half, time = LOW * (1 + JAM), 0.5, data.time.values
    (lock, back) = events(data)
    assert lock == ("lock", "A", pytest.approx(half, abs=1e-8), pytest.approx(LOW / 2 * (1 + half**2 / mass) ** 2))
    assert back[:2] == ("break-away", "A")
    wanted = np.where(time < half, 1 + (time - time**2) / mass, -((time - half) ** 2) / mass)
    assert data.drive_rate.values[0][time != half] == pytest.approx(wanted[time != half], abs=1e-9)
    assert float(abs(data.energy_residual).max()) < 1e-9
    assert findings(data)["simulate.locks"]["time"] == pytest.approx(half, abs=1e-8)
    assert findings(data)["simulate.several_accelerations"]["time"] == 0.0  # also T/(m (1 − κ)) obeys


def test_without_rest_there_is_no_acceleration_and_the_figure_says_by_how_much() -> None:
    """A law that is smooth at rest cannot hold it: the motion ends, with ∂E/∂q̈ = m (1 − κ) of m."""
    smooth = {"law": "brown-mcphee", "coefficient": F, "static": F, "transition_speed": 1e-3}
    data = simulate(slider("1 N - time/(1 s)*2 N", smooth), 1.0, 8)
    found = findings(data)["simulate.no_acceleration"]
    assert found["growth"] == pytest.approx(1 - JAM, rel=1e-3)
    assert found["time"] == pytest.approx(0.5, abs=1e-6)
    known = np.isfinite(data.drive_rate.values[0])
    assert known.tolist() == (data.time.values <= found["time"]).tolist()


# ---- Painlevé's rod -------------------------------------------------------------------------------------------

ROD, HALF, SLIDER, ROUGH = 1.0, 0.5, 0.02, 2.0
AROUND = ROD * HALF**2 * 4 / 3
ANGLE = np.pi / 3


def rod(torque: float, friction: float = 0.0, rough: float = ROUGH) -> Mechanism:
    """A rod hinged to a light slider in a rough guide; a moment turns it."""
    return Mechanism(
        gravity=[0, -G],
        links={
            "ground": {"points": {"A": AXIS}},
            "slider": {"points": {"A": AXIS, "B": [0, 0]}, "mass": SLIDER},
            "rod": {"points": {"B": [0, 0]}, "mass": ROD, "inertia": ROD * HALF**2 / 3, "centre": [HALF, 0]},
        },
        joints={
            "A": {"type": "prismatic", "links": ["ground", "slider"], "friction": rough, "guide": {"length": 5}},
            "B": {"type": "revolute", "links": ["slider", "rod"], "pin": {"radius": 0.02}, "friction": friction},
        },
        drivers={
            "A": {"speed": 1, "range": [-5, 5], "free": True, "initial": {"coordinate": 0, "speed": 1}},
            "B": {"speed": 1, "free": True, "initial": {"coordinate": ANGLE, "speed": 0}},
        },
        loads={"turn": {"link": "rod", "moment": torque}},
    )


def solutions(torque: float, rough: float) -> int:
    """How many accelerations Newton's laws have at the start, with the guide pushing up or down (P. Painlevé, 1895)."""
    count, sine, cosine = 0, np.sin(ANGLE), np.cos(ANGLE)
    for side in (1.0, -1.0):
        matrix = np.array([
            [ROD + SLIDER, -ROD * HALF * sine, rough * side],
            [-ROD * HALF * sine, AROUND, 0.0],
            [0.0, -ROD * HALF * cosine, 1.0],
        ])  # fmt: skip
        normal = np.linalg.solve(matrix, [0.0, torque - ROD * G * HALF * cosine, (ROD + SLIDER) * G])[2]
        count += bool(side * normal > 0.0)
    return count


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_painleves_rod_stops_by_the_momentum_about_its_pin(friction: float) -> None:
    """No acceleration: the slider stops at once. Of J Δω − m a sin φ Δv = ∓ f r |S|, S the impulse on the rod's end,
    follows ω; without friction in the pin it is Müller's condition."""
    assert solutions(-10.0, ROUGH) == 0
    data = simulate(rod(-10.0, friction), 0.01, 2)
    (time, lost) = next((time, lost) for kind, of, time, lost in events(data) if (kind, of) == ("lock", "A"))
    assert time == 0.0
    sine, cosine, omega = np.sin(ANGLE), np.cos(ANGLE), 0.0
    for _ in range(60):
        impulse = ROD * np.hypot(-1.0 - HALF * sine * omega, HALF * cosine * omega)
        omega = (-ROD * HALF * sine + friction * 0.02 * impulse) / AROUND
    assert data.drive_rate.values[:, 0] == pytest.approx([0.0, omega], abs=1e-9)
    # ½ m v² of all before; the rod's centre moves on about the pin after
    assert lost == pytest.approx(0.5 * (ROD + SLIDER) - 0.5 * AROUND * omega**2, rel=1e-9)
    assert (lost or 0.0) > 0.0
    assert float(abs(data.energy_residual).max()) < 1e-8


@pytest.mark.parametrize(("torque", "rough", "known"), [(0.0, ROUGH, 2), (0.0, 1.0, 1), (-10.0, 1.0, 1)])
def test_several_accelerations_are_told(torque: float, rough: float, known: int) -> None:
    assert solutions(torque, rough) == known
    found = findings(simulate(rod(torque, rough=rough), 1e-4, 1))
    assert ("simulate.several_accelerations" in found) == (known > 1)
    assert "simulate.joints_lock" not in found


# ---- rest -----------------------------------------------------------------------------------------------------


def wheels(motor: dict[str, Any] | None = None, speed: float = 3.0) -> Mechanism:
    """Two wheels beside each other, each with its drag."""
    data = wheel(motor, drag=0.6, initial={"speed": 2 * speed}).data()
    links = {**data["links"], "disc": {"points": {"W": [0, 0]}, "inertia": 0.05}}
    links["ground"] = {"points": {"A": [0, 0], "W": [1, 1]}}
    joints = {**data["joints"], "W": {"type": "revolute", "links": ["ground", "disc"]}}
    drivers = {**data["drivers"], "W": {"speed": 100, "free": True, "initial": {"speed": speed}}}
    loads = {**data["loads"], "seal": {"joint": "W", "resisting_torque": 0.6}}
    return Mechanism(**{**data, "links": links, "joints": joints, "drivers": drivers, "loads": loads})


def test_all_free_drivers_come_to_rest() -> None:
    data = simulate(wheels({"kind": "constant", "effort": 0.45}), 3.0, 30)
    done = 6.0 * 0.05 / (0.6 - 0.45)
    assert [(kind, of) for kind, of, *_ in events(data)] == [("stick", "W"), ("stick", "A"), ("rest", "A")]
    assert events(data)[-1][2] == pytest.approx(done, abs=1e-8)
    assert data.resting.values.tolist() == [int(time > done) for time in data.time.values]
    told = findings(data)["simulate.all_stall"]
    assert (told["joint"], told["drivers"]) == ("A", ["A"])
    assert told["share"] == pytest.approx(0.45 / 0.6, rel=1e-9)
    ways = {one.name: one.value for one in summary_of(data) if one.name.endswith(("run_down", "run_down_way"))}
    assert ways["W.run_down"] == pytest.approx(done, abs=1e-8)
    assert ways["W.run_down_way"] == pytest.approx(0.5 * 3.0 * 3.0 * 0.05 / 0.6, rel=1e-8)
    switched = simulate(wheels({"kind": "constant", "effort": 0.45, "off_from": 1.5}), 3.0, 3)
    assert "simulate.all_rest" in findings(switched)


def test_nothing_starts() -> None:
    data = simulate(wheels({"kind": "constant", "effort": 0.45}, speed=0.0), 1.0, 4)
    assert findings(data)["simulate.none_starts"]["share"] == pytest.approx(0.75)
    assert data.resting.values.all()
    assert not data.drive_rate.values.any()
