"""Joints that stick one by one where several coordinates are free, against equations of textbooks."""

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

from timed import slider_crank, wheel
from trunnion.dynamics.simulate import simulate
from trunnion.model.mechanism import Mechanism

Array = NDArray[np.float64]
G = 9.81
F = 0.3


def events(data: Any) -> list[tuple[str, str, float]]:
    """Kind, joint and time, s, of all events."""
    return [
        (kind, of, float(time))
        for (kind, of, *_), time in zip(json.loads(data.attrs["events"]), data.event_time, strict=True)
    ]


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


# ---- blocks ---------------------------------------------------------------------------------------------------

LOW, HIGH, STIFF = 2.0, 1.0, 60.0


def blocks(**more: Any) -> Mechanism:
    """Two blocks stacked on the ground, the lower one held by a spring, the upper one by friction alone."""
    axis = {"at": [0, 0], "axis": [1, 0]}
    data: dict[str, Any] = {
        "gravity": [0, -G],
        "links": {
            "ground": {"points": {"A": axis}},
            "low": {"points": {"A": axis, "B": axis}, "mass": LOW},
            "high": {"points": {"B": axis}, "mass": HIGH},
        },
        "joints": {
            "A": {"type": "prismatic", "links": ["ground", "low"], "friction": 0.05, "guide": {"length": 20}},
            "B": {"type": "prismatic", "links": ["low", "high"], "friction": F, "guide": {"length": 20}},
        },
        "drivers": {
            "A": {"speed": 1, "range": [-1, 1], "free": True, "initial": {"coordinate": 0.4, "speed": 0}},
            "B": {"speed": 1, "range": [-1, 1], "free": True, "initial": {"coordinate": 0, "speed": 0}},
        },
        "springs": {"k": {"joint": "A", "stiffness": STIFF, "free_length": 0}},
    }
    return Mechanism(**{**data, **more})


def test_blocks_stick_and_slip_as_their_equations_say() -> None:
    data = simulate(blocks(), 1.3, 20)
    mass = np.array([[LOW + HIGH, HIGH], [HIGH, HIGH]])
    limit = np.array([0.05 * (LOW + HIGH) * G, F * HIGH * G])
    one = Reference(lambda y: (mass, np.array([STIFF * y[0], 0.0])), lambda y, a: limit, np.eye(2))
    end, told = one.run(np.array([0.4, 0.0, 0.0, 0.0]), 1.3)
    found = [one for one in events(data) if one[2] > 0]
    assert [(kind, "AB"[k]) for kind, k, _ in told] == [(kind, of) for kind, of, _ in found]
    assert [time for *_, time in found] == pytest.approx([time for *_, time in told], abs=1e-7)
    assert data.drive_coordinate[:, -1].values == pytest.approx(end[:2], abs=1e-7)
    assert float(abs(data.energy_residual).max()) < 1e-8 * float(data.work_friction[-1])
    sticks = [kind for kind, of, _ in found if of == "B"]
    assert sticks == ["stick", "break-away"]
    assert data.sticking.sel(joint="B").values.sum() == 1  # of the rows, 65 ms apart
    assert not data.sticking.sel(joint="A").values.any()


# ---- a double pendulum ----------------------------------------------------------------------------------------

ARM, PIN = 0.5, 0.06
M, J, C = (1.0, 0.8), (0.02, 0.015), (0.25, 0.2)


def pendulum(friction: float = F, **more: Any) -> Mechanism:
    """Two links that hang from thick pins; relative angles are the coordinates."""
    bars = {name: {"mass": M[i], "inertia": J[i], "centre": [C[i], 0]} for i, name in enumerate(("upper", "lower"))}
    data: dict[str, Any] = {
        "gravity": [0, -G],
        "links": {
            "ground": {"points": {"A": [0, 0]}},
            "upper": {"points": {"A": [0, 0], "B": [ARM, 0]}, **bars["upper"]},
            "lower": {"points": {"B": [0, 0]}, **bars["lower"]},
        },
        "joints": {
            "A": {"type": "revolute", "links": ["ground", "upper"]},
            "B": {"type": "revolute", "links": ["upper", "lower"]},
        },
        "joint_defaults": {"pin": {"radius": PIN}, **({"friction": friction} if friction else {})},
        "drivers": {
            "A": {"speed": 1, "free": True, "initial": {"coordinate": -0.3, "speed": 0}},
            "B": {"speed": 1, "free": True, "initial": {"coordinate": 0.5, "speed": 0}},
        },
    }
    return Mechanism(**{**data, **more})


def _pendulum_parts(y: Array) -> tuple[Array, Array]:
    """Lagrange's equations in relative angles: M q̈ + h = 0."""
    (a, b, u, v) = y
    couple = M[1] * ARM * C[1]
    lower = M[1] * C[1] ** 2 + J[1]
    upper = M[0] * C[0] ** 2 + J[0] + M[1] * ARM**2
    mass = np.array([
        [upper + lower + 2 * couple * np.cos(b), lower + couple * np.cos(b)],
        [lower + couple * np.cos(b), lower],
    ])  # fmt: skip
    weight = M[1] * G * C[1] * np.cos(a + b)
    h = np.array([
        -couple * np.sin(b) * (2 * u * v + v * v) + (M[0] * C[0] + M[1] * ARM) * G * np.cos(a) + weight,
        couple * np.sin(b) * u * u + weight,
    ])  # fmt: skip
    return mass, h


def _pendulum_limits(y: Array, second: Array) -> Array:
    """f r |F| of both pins, from Newton's law for the centres of mass."""
    a, b, u, v = y
    one, other = np.exp(1j * a), np.exp(1j * (a + b))
    first = (1j * second[0] - u * u) * one
    last = ARM * first + C[1] * (1j * (second[0] + second[1]) - (u + v) ** 2) * other
    at_b = M[1] * (last + 1j * G)
    at_a = at_b + M[0] * (C[0] * first + 1j * G)
    return F * PIN * np.abs([at_a, at_b])


@pytest.mark.slow
def test_a_double_pendulum_comes_to_rest_in_friction_as_its_equations_say() -> None:
    data = simulate(pendulum(), 3.0, 50)
    end, told = Reference(_pendulum_parts, _pendulum_limits, np.eye(2)).run(np.array([-0.3, 0.5, 0.0, 0.0]), 3.0)
    found = [one for one in events(data) if one[2] > 0]
    assert [(kind, "AB"[k]) for kind, k, _ in told] == [(kind, of) for kind, of, _ in found]
    assert len(told) > 3
    assert [time for *_, time in found] == pytest.approx([time for *_, time in told], abs=1e-6)
    assert data.drive_coordinate[:, -1].values == pytest.approx(end[:2], abs=1e-6)
    assert float(abs(data.energy_residual).max()) < 1e-8 * float(data.work_friction[-1])


@pytest.mark.slow
def test_the_pendulum_in_space_is_that_in_the_plane() -> None:
    plane = pendulum()
    data = plane.data()
    links = {
        name: {
            **link, "points": {key: {"at": [*at, 0], "axis": [0, 0, 1]} for key, at in link["points"].items()},
            **({"centre": [*link["centre"], 0], "inertia": dict.fromkeys(("xx", "yy", "zz"), J[i - 1])} if i else {}),
        }
        for i, (name, link) in enumerate(data["links"].items())
    }  # fmt: skip
    pin = {"joint_defaults": {"pin": {"radius": PIN, "length": 1}, "friction": F}}
    space = Mechanism(**{**data, "space": "spatial", "gravity": [0, -G, 0], "links": links, **pin})
    one, other = simulate(plane, 0.75, 15), simulate(space, 0.75, 15)
    assert [kind for kind, *_ in events(other)].count("stick") == 1
    assert other.event_time.values == pytest.approx(one.event_time.values, abs=1e-7)
    assert other.drive_coordinate.values == pytest.approx(one.drive_coordinate.values, abs=1e-7)


# ---- coordinates that know nothing of each other --------------------------------------------------------------


def beside(one: Mechanism) -> Mechanism:
    """A mechanism with a wheel beside it, that is free as well."""
    data = one.data()
    ground = one.fixed_link
    links = {**data["links"], "disc": {"points": {"W": [0, 0]}, "inertia": 0.05}}
    links[ground] = {**links[ground], "points": {**links[ground]["points"], "W": [1, 1]}}
    joints = {**data["joints"], "W": {"type": "revolute", "links": [ground, "disc"], "friction": 0}}
    drivers = {**data["drivers"], "W": {"speed": 100, "free": True, "initial": {"speed": 3.0}}}
    return Mechanism(**{**data, "links": links, "joints": joints, "drivers": drivers})


def test_a_braked_motor_with_a_lossy_gear_stops_as_its_closed_form_says() -> None:
    motor = {"kind": "constant", "effort": 2, "efficiency": 0.8, "off_from": 1.0, "brake": 0.4, "brake_from": 1.0}
    data = simulate(beside(wheel(motor, drag=0.6)), 3.0, 30)
    assert ("stick", "A", pytest.approx(2.0, abs=1e-8)) in events(data)
    assert data.drive_coordinate.sel(driver="A").values[-1] == pytest.approx(20.0, abs=1e-7)  # 10 on either side of 1 s
    assert data.drive_rate.sel(driver="W").values[-1] == pytest.approx(3.0, abs=1e-9)


@pytest.mark.slow
def test_a_linkage_breaks_away_beside_another_as_alone() -> None:
    """At rest four joints stick in one freedom: the friction of all together holds it, as long as it can."""
    motor = {"kind": "table", "over": "time", "points": [[0, 0], [0.1, 8]]}
    drivers = {"O": {"speed": 100, "motor": motor, "initial": {"coordinate": 1.0, "speed": 0}}}
    alone = simulate(one := slider_crank(0.1, drivers=drivers), 0.06, 12, tolerance=1e-10)
    both = simulate(beside(one), 0.06, 12, tolerance=1e-10)
    (left,) = (time for kind, of, time in events(alone) if kind == "break-away")
    assert [time for kind, of, time in events(both) if (kind, of) == ("break-away", "O")] == pytest.approx([left])
    for key in ("drive_coordinate", "drive_rate"):
        assert both[key].sel(driver="O").values == pytest.approx(alone[key].sel(driver="O").values, abs=1e-7)


# ---- many at once -----------------------------------------------------------------------------------------------


@pytest.mark.spread(1)
@pytest.mark.parametrize("seed", range(6))
def test_a_stack_at_rest_accelerates_so_that_gauss_constraint_is_least(seed: int) -> None:
    """Four blocks on each other, each pushed: of all accelerations that with the least ½ aᵀMa − Fᵀa + Σ μ N |Δa|, a
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
