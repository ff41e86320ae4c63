"""Motion in time against MuJoCo: its kinematics, mass matrix and bias in place of Trunnion's walks.

The engine closes the loop of its own spanning tree by Newton, q̇ = B ω and q̈ = B α + c; then Bᵀ (M q̈ + bias) is what
motor and load give along B. SciPy integrates the crank angle with the α of that equation.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mechanisms import Array
from reference.mujoco_engine import Engine, mj
from trunnion import simulate
from trunnion.model.mechanism import Mechanism

STALL, NO_LOAD, ROTOR, LOAD = 8.0, 157.0, 1e-3, 40.0  # N m, rad/s, kg m², N
AXIS = {"at": [0, 0], "axis": [1, 0]}
DATA: dict[str, Any] = {  # a slider-crank; the flywheel is in the crank's inertia
    "gravity": [0, -9.81],
    "links": {
        "ground": {"points": {"O": [0, 0], "S": AXIS}},
        "crank": {"points": {"O": [0, 0], "P": [0.035, 0]}, "mass": 1.0, "centre": [0.01, 0.0], "inertia": 0.02},
        "rod": {"points": {"P": [0, 0], "Q": [0.12, 0]}, "mass": 0.5, "centre": [0.04, 0.0], "inertia": 1e-3},
        "piston": {"points": {"Q": [0, 0], "S": AXIS}, "mass": 0.6, "centre": [0.0, 0.0], "inertia": 1e-4},
    },
    "joints": {
        "O": {"type": "revolute", "links": ["ground", "crank"]},
        "P": {"type": "revolute", "links": ["crank", "rod"]},
        "Q": {"type": "revolute", "links": ["rod", "piston"]},
        "S": {"type": "prismatic", "links": ["ground", "piston"]},
    },
    "drivers": {"O": {"speed": 100}},
    "assembly": {"Q": [0.155, 0]},
}


def by_engine(start: tuple[float, float], times: Array) -> Array:
    """Crank angle and rate at some times, (2, time)."""
    engine = Engine(DATA, 0.0, 0.0)
    lean = -np.arcsin(0.035 / 0.12 * np.sin(start[0]))  # of the rod, which tells the assembly
    guesses, q = {"S": 0.14, "P": lean - start[0], "Q": -lean}, np.zeros(engine.size)
    for name, dof in engine.dof.items():
        q[dof] = engine.sense[name] * guesses.get(name, 0.0)

    def rate(_: float, y: Array) -> list[float]:
        engine.move(q, [(float(y[0]), float(y[1]))])
        q[:] = engine.state.qpos
        along = np.linalg.solve(engine.rows(), np.eye(engine.size)[-1])  # B: of a unit rate of the driver
        momentum, pushed = np.zeros(engine.size), np.zeros((3, engine.size))
        mj.mj_mulM(engine.model, engine.state, momentum, along)
        mj.mj_jac(engine.model, engine.state, pushed, None, engine.place("piston", "Q"), engine.body("piston"))
        given = STALL * (1 - y[1] / NO_LOAD) - LOAD * pushed[0] @ along
        resting = along @ engine.state.qfrc_inverse  # with α = 0
        return [float(y[1]), float((given - resting) / (along @ momentum + ROTOR))]

    found = solve_ivp(rate, (0, times[-1]), start, t_eval=times, rtol=1e-9, atol=1e-10, method="DOP853")
    return np.asarray(found.y)


def test_a_start_with_a_motor_is_mujocos() -> None:
    """From rest 1 rad from the dead centre: angle and rate to 1e-6."""
    motor = {"kind": "linear", "stall_effort": STALL, "no_load_speed": NO_LOAD, "inertia": ROTOR}
    driver = {"O": {"speed": 100, "start": 1.0, "motor": motor}}
    load = {"work": {"link": "piston", "at": "Q", "force": [-LOAD, 0]}}
    result = simulate(Mechanism(**{**DATA, "drivers": driver, "loads": load}), 0.4, 4, 1e-10)
    times = result["time"].values
    wanted = by_engine((1.0, 0.0), times)
    assert result["drive_coordinate"].values[0] == pytest.approx(wanted[0], rel=1e-6)
    assert result["drive_rate"].values[0] == pytest.approx(wanted[1], rel=1e-6)
    assert wanted[0, -1] > 4 * np.pi
