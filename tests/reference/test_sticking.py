"""Joints that stick one by one where several coordinates are free, against equations of textbooks."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from trunnion.dynamics.simulate import simulate
from trunnion.model.mechanism import Mechanism

Array = NDArray[np.float64]
G = 9.81
F = 0.3


def events(data: Any) -> list[tuple[str, str, float]]:
    """Kind, joint and time, s, of all events."""
    return [(kind, of, float(time)) for (kind, of, *_), time in zip(json.loads(data.attrs["events"]), data.event_time, strict=True)]


def reference(
    state: Array, end: float, parts: Callable[[Array], tuple[Array, Array, Array]],
    limits: Callable[[Array, Array], Array], ways: Array,
) -> tuple[Array, list[tuple[str, int, float]]]:  # fmt: skip
    """Motion of M q̈ + h = −Wᵀ(friction), friction ± its limit or what keeps W q̇ at 0, from event to event.

    parts: mass matrix, h, their coordinates; limits: of the state and the accelerations; ways: W, (joint, coordinate).
    """
    count, time, found = len(state) // 2, 0.0, []
    modes = [int(np.sign(one)) if abs(one) > 1e-9 else 0 for one in ways @ state[count:]]

    def solved(y: Array, modes: Sequence[int]) -> tuple[Array, Array]:
        """Accelerations and friction in the joints: limits follow the accelerations, by repeated substitution."""
        mass, rest, _ = parts(y)
        second, force = np.zeros(count), np.zeros(len(ways))
        for _ in range(60):
            limit = limits(y, second)
            held = [k for k, mode in enumerate(modes) if mode == 0]
            slid = sum((ways[k] * mode * limit[k] for k, mode in enumerate(modes)), np.zeros(count))
            matrix = np.block([[mass, ways[held].T], [ways[held], np.zeros((len(held), len(held)))]])
            answer = np.linalg.solve(matrix, np.concatenate([-rest - slid, np.zeros(len(held))]))
            second = answer[:count]
            force = np.array([mode * limit[k] for k, mode in enumerate(modes)])
            force[held] = answer[count:]
        return second, force

    def consistent(y: Array, crossed: int | None, left: bool) -> list[int]:
        free = [k for k, one in enumerate(ways @ y[count:]) if abs(one) < 1e-7 or k == crossed]
        for case in itertools.product((0, 1, -1), repeat=len(free)):
            tried = [int(np.sign(one)) for one in ways @ y[count:]]
            for k, mode in zip(free, case, strict=True):
                tried[k] = mode
            second, force = solved(y, tried)
            if left and tried[crossed] == 0:  # type: ignore[call-overload]
                continue
            limit = limits(y, second)
            if all(abs(force[k]) <= limit[k] * (1 + 1e-9) if tried[k] == 0 else
                   tried[k] * (ways[k] @ second) >= -1e-6 for k in free):  # fmt: skip
                return tried
        raise AssertionError("no case is consistent")

    modes = consistent(state, None, False)
    while time < end:
        def watch(k: int) -> Callable[[float, Array], float]:
            def own(t: float, y: Array) -> float:
                if modes[k]:
                    return modes[k] * float(ways[k] @ y[count:]) + 1e-11
                second, force = solved(y, modes)
                return float(limits(y, second)[k] - abs(force[k])) + 1e-11

            own.terminal, own.direction = True, -1.0  # type: ignore[attr-defined]
            return own

        now = list(modes)
        part = solve_ivp(
            lambda t, y: np.concatenate([y[count:], solved(y, now)[0]]), (time, end), state,
            method="DOP853", rtol=1e-11, atol=1e-12, events=[watch(k) for k in range(len(ways))], max_step=0.02,
        )  # fmt: skip
        time, state = float(part.t[-1]), part.y[:, -1].copy()
        hit = [k for k, times in enumerate(part.t_events) if len(times)]
        if not hit:
            break
        (k,) = hit[:1]
        left = modes[k] == 0
        was, modes = modes, consistent(state, k, left)
        for i in range(len(ways)):
            if was[i] and not modes[i]:
                state[count:] -= np.linalg.lstsq(ways[[i]], ways[[i]] @ state[count:])[0]
            if bool(was[i]) != bool(modes[i]):
                found.append(("break-away" if was[i] == 0 else "stick", i, time))
    return state, found


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
    data = simulate(blocks(), 2.5, 50)
    mass = np.array([[LOW + HIGH, HIGH], [HIGH, HIGH]])
    limit = np.array([0.05 * (LOW + HIGH) * G, F * HIGH * G])
    end, told = reference(
        np.array([0.4, 0.0, 0.0, 0.0]), 2.5, lambda y: (mass, np.array([STIFF * y[0], 0.0]), y), lambda y, a: limit,
        np.eye(2),
    )  # fmt: skip
    found = [one for one in events(data) if one[2] > 0]
    assert [(kind, "AB"[k]) for kind, k, _ in told] == [(kind, of) for kind, of, _ in found]
    assert [time for *_, time in found] == pytest.approx([time for *_, time in told], abs=1e-7)
    assert data.drive_coordinate[:, -1].values == pytest.approx(end[:2], abs=1e-7)
    assert float(abs(data.energy_residual).max()) < 1e-8 * float(data.work_friction[-1])


# ---- a double pendulum ----------------------------------------------------------------------------------------

ARM, PIN = 0.5, 0.06
M, J, C = (1.0, 0.8), (0.02, 0.015), (0.25, 0.2)


def pendulum(friction: float = F, **more: Any) -> Mechanism:
    """Two links that hang from thick pins; relative angles are the coordinates."""
    bars = {
        name: {"mass": M[i], "inertia": J[i], "centre": [C[i], 0]} for i, name in enumerate(("upper", "lower"))
    }
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


def _pendulum_parts(y: Array) -> tuple[Array, Array, Array]:
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
    return mass, h, y


def _pendulum_limits(y: Array, second: Array) -> Array:
    """f r |F| of both pins, from Newton's law for the centres of mass."""
    a, b, u, v = y
    one, other = np.exp(1j * a), np.exp(1j * (a + b))
    first = (1j * second[0] - u * u) * one
    last = ARM * first + C[1] * (1j * (second[0] + second[1]) - (u + v) ** 2) * other
    at_b = M[1] * (last + 1j * G)
    at_a = at_b + M[0] * (C[0] * first + 1j * G)
    return F * PIN * np.abs([at_a, at_b])


def test_a_double_pendulum_comes_to_rest_in_friction_as_its_equations_say() -> None:
    data = simulate(pendulum(), 3.0, 50)
    end, told = reference(np.array([-0.3, 0.5, 0.0, 0.0]), 3.0, _pendulum_parts, _pendulum_limits, np.eye(2))
    found = [one for one in events(data) if one[2] > 0]
    assert [(kind, "AB"[k]) for kind, k, _ in told] == [(kind, of) for kind, of, _ in found]
    assert len(told) > 3
    assert [time for *_, time in found] == pytest.approx([time for *_, time in told], abs=1e-6)
    assert data.drive_coordinate[:, -1].values == pytest.approx(end[:2], abs=1e-6)
    assert float(abs(data.energy_residual).max()) < 1e-8 * float(data.work_friction[-1])
