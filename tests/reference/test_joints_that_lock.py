"""Joints that lock in motion beside others that move on, several accelerations, and the rest of all free drivers."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import clarabel
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.sparse import csc_matrix

from mechanisms_parts import joined
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
        joints=joined(
            "ground =A= low =B= high",
            A={"friction": F, "guide": {"length": GUIDE}},
            B={"friction": upper, "guide": {"length": 20}},
        ),
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
    assert findings(data)["simulate.locks"]["joints"] == ["A"]
    assert findings(data)["simulate.several_accelerations"]["time"] == 0.0  # also T/(m (1 − κ)) obeys


@pytest.mark.slow
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


@pytest.mark.slow
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
        joints=joined(
            "ground =A= slider -B- rod",
            A={"friction": rough, "guide": {"length": 5}},
            B={"pin": {"radius": 0.02}, "friction": friction},
        ),
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


@pytest.mark.spread(1)
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
    assert "simulate.locks" not in found


# ---- rest -----------------------------------------------------------------------------------------------------


def beside(one: Mechanism, speed: float = 3.0) -> Mechanism:
    """A mechanism with a wheel beside it, that is free as well."""
    data = one.data()
    ground = one.fixed_link
    links = {**data["links"], "disc": {"points": {"W": [0, 0]}, "inertia": 0.05}}
    links[ground] = {**links[ground], "points": {**links[ground]["points"], "W": [1, 1]}}
    joints = {**data["joints"], "W": {"type": "revolute", "links": [ground, "disc"], "friction": 0}}
    drivers = {**data["drivers"], "W": {"speed": 100, "free": True, "initial": {"speed": speed}}}
    return Mechanism(**{**data, "links": links, "joints": joints, "drivers": drivers})


def wheels(motor: dict[str, Any] | None = None, speed: float = 3.0) -> Mechanism:
    """Two wheels beside each other, each with its drag."""
    data = beside(wheel(motor, drag=0.6, initial={"speed": 2 * speed}), speed).data()
    return Mechanism(**{**data, "loads": {**data["loads"], "seal": {"joint": "W", "resisting_torque": 0.6}}})


def test_all_free_drivers_come_to_rest() -> None:
    data = simulate(wheels({"kind": "constant", "effort": 0.45}), 3.0, 30)
    done = 6.0 * 0.05 / (0.6 - 0.45)
    assert [(kind, of) for kind, of, *_ in events(data)] == [("stick", "W"), ("stick", "A"), ("rest", "A")]
    assert events(data)[-1][2] == pytest.approx(done, abs=1e-8)
    assert data.resting.values.tolist() == [int(time > done) for time in data.time.values]
    told = findings(data)["simulate.stalls"]
    assert (told["joint"], told["drivers"]) == ("A", ["A"])
    assert told["share"] == pytest.approx(0.45 / 0.6, rel=1e-9)
    ways = {one.name: one.value for one in summary_of(data) if one.name.endswith(("run_down", "run_down_way"))}
    assert ways["W.run_down"] == pytest.approx(done, abs=1e-8)
    assert ways["W.run_down_way"] == pytest.approx(0.5 * 3.0 * 3.0 * 0.05 / 0.6, rel=1e-8)
    switched = simulate(wheels({"kind": "constant", "effort": 0.45, "off_from": 1.5}), 3.0, 3)
    assert "simulate.rests" in findings(switched)


def test_nothing_starts() -> None:
    data = simulate(wheels({"kind": "constant", "effort": 0.45}, speed=0.0), 1.0, 4)
    assert findings(data)["simulate.stays_at_rest"]["share"] == pytest.approx(0.75)
    assert data.resting.values.all()
    assert not data.drive_rate.values.any()


Array = NDArray[np.float64]
ROUGHNESS = 0.3


def times_of(data: Any) -> list[tuple[str, str, float]]:
    """Kind, joint and time, s, of all events."""
    return [one[:3] for one in events(data)]


@dataclass
class Reference:
    """Motion of M q̈ + h = −Wᵀ(friction), friction ± its limit or what keeps W q̇ at 0, from event to event.

    parts: M and h; limits: of the state and the accelerations; ways: W, (joint, coordinate); modes: of the joints, +1
    or −1 where they slide, 0 where they stick.
    """

    parts: Callable[[Array], tuple[Array, Array]]
    limits: Callable[[Array, Array], Array]
    ways: Array
    modes: list[int] = field(default_factory=list)

    def solved(self, y: Array, modes: Sequence[int]) -> tuple[Array, Array]:
        """Accelerations and friction in the joints: limits follow the accelerations, by repeated substitution."""
        mass, rest = self.parts(y)
        count, held = len(rest), [k for k, mode in enumerate(modes) if mode == 0]
        second, force = np.zeros(count), np.zeros(len(modes))
        rows = self.ways[held]
        matrix = np.block([[mass, rows.T], [rows, np.zeros((len(held), len(held)))]])
        for _ in range(60):
            force = np.array(modes) * self.limits(y, second)
            answer = np.linalg.solve(matrix, np.concatenate([-rest - self.ways.T @ force, np.zeros(len(held))]))
            second = answer[:count]
            force[held] = answer[count:]
        return second, force

    def consistent(self, y: Array, crossed: int | None = None) -> list[int]:
        """The first case of sticking and sliding that friction and accelerations allow."""
        rates = self.ways @ y[len(y) // 2 :]
        free = [k for k, one in enumerate(rates) if abs(one) < 1e-7 or k == crossed]
        left = crossed is not None and self.modes[crossed] == 0
        for case in itertools.product((0, 1, -1), repeat=len(free)):
            tried = [int(np.sign(one)) for one in rates]
            for k, mode in zip(free, case, strict=True):
                tried[k] = mode
            second, force = self.solved(y, tried)
            limit = self.limits(y, second)
            held = (abs(force[k]) <= limit[k] * (1 + 1e-9) for k in free if tried[k] == 0)
            slid = (tried[k] * (self.ways[k] @ second) >= -1e-6 for k in free if tried[k])
            if all(held) and all(slid) and not (left and tried[crossed or 0] == 0):
                return tried
        raise AssertionError("no case is consistent")

    def watched(self, k: int) -> Callable[[float, Array], float]:
        """What stays above 0 until the k-th joint does something else."""

        def own(t: float, y: Array) -> float:
            if self.modes[k]:
                return self.modes[k] * float(self.ways[k] @ y[len(y) // 2 :]) + 1e-11
            second, force = self.solved(y, self.modes)
            return float(self.limits(y, second)[k] - abs(force[k])) + 1e-11

        own.terminal, own.direction = True, -1.0  # type: ignore[attr-defined]
        return own

    def run(self, state: Array, end: float) -> tuple[Array, list[tuple[str, int, float]]]:
        """The state at the end, and the events."""
        time, count, found = 0.0, len(state) // 2, list[tuple[str, int, float]]()
        self.modes = self.consistent(state)
        while True:
            part = solve_ivp(
                lambda t, y: np.concatenate([y[count:], self.solved(y, self.modes)[0]]), (time, end), state,
                method="DOP853", rtol=1e-11, atol=1e-12, events=[self.watched(k) for k in range(len(self.ways))],
                max_step=0.02,
            )  # fmt: skip
            time, state = float(part.t[-1]), part.y[:, -1].copy()
            hit = [k for k, times in enumerate(part.t_events) if len(times)]
            if not hit:
                return state, found
            was, self.modes = self.modes, self.consistent(state, hit[0])
            for i, (before, after) in enumerate(zip(was, self.modes, strict=True)):
                if bool(before) != bool(after):
                    found.append(("stick" if before else "break-away", i, time))


# ---- blocks ----------------------------------------------------------------------------------------------------

LOWER, UPPER, STIFF = 2.0, 1.0, 60.0


def stacked() -> Mechanism:
    """Two blocks on the ground, the lower one held by a spring, the upper one by friction alone."""
    axis = {"at": [0, 0], "axis": [1, 0]}
    return Mechanism(
        gravity=[0, -G],
        links={
            "ground": {"points": {"A": axis}},
            "low": {"points": {"A": axis, "B": axis}, "mass": LOWER},
            "high": {"points": {"B": axis}, "mass": UPPER},
        },
        joints=joined(
            "ground =A= low =B= high",
            A={"friction": 0.05, "guide": {"length": 20}},
            B={"friction": ROUGHNESS, "guide": {"length": 20}},
        ),
        drivers={
            name: {"speed": 1, "range": [-1, 1], "free": True, "initial": {"coordinate": start, "speed": 0}}
            for name, start in (("A", 0.4), ("B", 0))
        },
        springs={"k": {"joint": "A", "stiffness": STIFF, "free_length": 0}},
    )


def test_blocks_stick_and_slip_as_their_equations_say() -> None:
    data = simulate(stacked(), 1.3, 20)
    mass = np.array([[LOWER + UPPER, UPPER], [UPPER, UPPER]])
    limit = np.array([0.05 * (LOWER + UPPER) * G, ROUGHNESS * UPPER * G])
    one = Reference(lambda y: (mass, np.array([STIFF * y[0], 0.0])), lambda y, a: limit, np.eye(2))
    end, told = one.run(np.array([0.4, 0.0, 0.0, 0.0]), 1.3)
    found = [one for one in times_of(data) if one[2] > 0]
    assert [(kind, "AB"[k]) for kind, k, _ in told] == [(kind, of) for kind, of, _ in found]
    assert [time for *_, time in found] == pytest.approx([time for *_, time in told], abs=1e-7)
    assert data.drive_coordinate[:, -1].values == pytest.approx(end[:2], abs=1e-7)
    assert float(abs(data.energy_residual).max()) < 1e-8 * float(data.work_friction[-1])
    sticks = [kind for kind, of, _ in found if of == "B"]
    assert sticks == ["stick", "break-away"]
    assert data.sticking.sel(joint="B").values.sum() == 1  # of the rows, 65 ms apart
    assert not data.sticking.sel(joint="A").values.any()


# ---- a double pendulum ----------------------------------------------------------------------------------------

LENGTH, PIN = 0.5, 0.06
M, J, C = (1.0, 0.8), (0.02, 0.015), (0.25, 0.2)


def pendulum() -> Mechanism:
    """Two links that hang from thick pins; relative angles are the coordinates."""
    bars = {name: {"mass": M[i], "inertia": J[i], "centre": [C[i], 0]} for i, name in enumerate(("upper", "lower"))}
    return Mechanism(
        gravity=[0, -G],
        links={
            "ground": {"points": {"A": [0, 0]}},
            "upper": {"points": {"A": [0, 0], "B": [LENGTH, 0]}, **bars["upper"]},
            "lower": {"points": {"B": [0, 0]}, **bars["lower"]},
        },
        joints=joined("ground -A- upper -B- lower"),
        joint_defaults={"pin": {"radius": PIN}, "friction": ROUGHNESS},
        drivers={
            name: {"speed": 1, "free": True, "initial": {"coordinate": start, "speed": 0}}
            for name, start in (("A", -0.3), ("B", 0.5))
        },
    )


# ---- coordinates that know nothing of each other --------------------------------------------------------------


def test_a_braked_motor_with_a_lossy_gear_stops_as_its_closed_form_says() -> None:
    motor = {"kind": "constant", "effort": 2, "efficiency": 0.8, "off_from": 1.0, "brake": 0.4, "brake_from": 1.0}
    data = simulate(beside(wheel(motor, drag=0.6)), 3.0, 30)
    assert ("stick", "A", pytest.approx(2.0, abs=1e-8)) in times_of(data)
    assert data.drive_coordinate.sel(driver="A").values[-1] == pytest.approx(20.0, abs=1e-7)  # 10 on either side of 1 s
    assert data.drive_rate.sel(driver="W").values[-1] == pytest.approx(3.0, abs=1e-9)


# ---- many at once -----------------------------------------------------------------------------------------------


@pytest.mark.spread(1)
@pytest.mark.parametrize("seed", range(2))
def test_a_stack_at_rest_accelerates_so_that_gauss_constraint_is_least(seed: int) -> None:
    """Four stacked on each other, each pushed: of all accelerations that with the least ½ aᵀMa − Fᵀa + Σ μ N |Δa|, a
    convex function whose minimum is found by clarabel, apart from this code."""
    random, axis = np.random.default_rng(seed), {"at": [0, 0], "axis": [1, 0]}
    names = ["A", "B", "C", "D"]
    masses, rough, pushes = random.uniform(1, 3, 4), random.uniform(0.05, 0.6, 4), random.normal(0, 12, 4)
    bodies = ["ground", *(f"block{k}" for k in range(4))]
    links: dict[str, Any] = {body: {"points": {}} for body in bodies}
    for k, name in enumerate(names):
        links[bodies[k]]["points"][name] = links[bodies[k + 1]]["points"][name] = axis
        links[bodies[k + 1]]["mass"] = masses[k]
    model = Mechanism(
        gravity=[0, -G],
        links=links,
        joints={name: {"type": "prismatic", "links": [bodies[k], bodies[k + 1]], "friction": rough[k],
                       "guide": {"length": 1e3}} for k, name in enumerate(names)},
        drivers={name: {"speed": 1, "range": [-50, 50], "free": True, "initial": {"coordinate": 0, "speed": 0}}
                 for name in names},
        loads={f"push{k}": {"link": bodies[k + 1], "at": name, "force": [float(pushes[k]), 0]}
               for k, name in enumerate(names)},
    )  # fmt: skip
    normal = np.cumsum(masses[::-1])[::-1] * G
    across = np.eye(4) - np.eye(4, k=-1)  # Δa of each joint
    # min ½ aᵀMa − Fᵀa + (μN)ᵀt with −t ≤ Δa ≤ t
    quadratic = np.zeros((8, 8))
    quadratic[:4, :4] = np.diag(masses)
    rows = np.block([[across, -np.eye(4)], [-across, -np.eye(4)]])
    settings = clarabel.DefaultSettings()
    settings.verbose, settings.tol_gap_abs, settings.tol_gap_rel, settings.tol_feas = False, 1e-12, 1e-12, 1e-12
    solved = clarabel.DefaultSolver(
        csc_matrix(quadratic), np.concatenate([-pushes, rough * normal]), csc_matrix(rows), np.zeros(8),
        [clarabel.NonnegativeConeT(8)], settings,
    ).solve()  # fmt: skip
    data = simulate(model, 0.1, 1)
    assert data.drive_rate.values[:, -1] == pytest.approx(0.1 * across @ np.array(solved.x[:4]), abs=1e-6)
