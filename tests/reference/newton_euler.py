"""Newton–Euler equations of a planar mechanism as one dense system: an oracle sharing nothing with Trunnion.

Maximal coordinates: every body has its three equations, every joint its two unknown reaction components,
every drive its effort. The motion (poses, accelerations) is given. No modules, no elimination, no iteration.

Signs. Everything a joint transmits is stated as it acts *on the second body, by the first*, in global axes.
A drive effort and a friction load are stated the same way: torque about the pin, or force along the guide.
The ground is the body None. Angles and moments are counter-clockwise positive. SI units.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Vector = NDArray[np.float64]
PARTS = {"revolute": ("first", "second"), "prismatic": ("first", "second"), "contact": ("first",)}

__all__ = ["Body", "Joint", "Load", "Solution", "solve"]


@dataclass(frozen=True)
class Load:
    """Applied load on a body: a force (N) at a global point (m) and a free moment (N m)."""

    point: ArrayLike = (0.0, 0.0)
    force: ArrayLike = (0.0, 0.0)
    moment: float = 0.0


@dataclass(frozen=True)
class Body:
    """A moving body at one position.

    mass kg; inertia about the centre of mass, kg m²; centre: global position, m; acceleration: of the centre,
    m/s²; angular_acceleration: rad/s².
    """

    mass: float
    inertia: float
    centre: ArrayLike
    acceleration: ArrayLike
    angular_acceleration: float
    loads: Sequence[Load] = field(default=())


@dataclass(frozen=True)
class Joint:
    """A revolute or prismatic joint at one position.

    first, second: names of the bodies, None is the ground. point: global point at which the reaction acts and
    about which its moment counts (prismatic: the joint's point on the second body). axis: global direction of
    the guide, positive slide of the second body (prismatic only, any length). friction: torque (revolute) or
    force along the axis (prismatic) on the second body. driven: the joint carries an unknown drive effort.
    A contact transmits a force along its axis; its friction is a known force a quarter turn from the axis.
    """

    kind: Literal["revolute", "prismatic", "contact"]
    first: str | None
    second: str | None
    point: ArrayLike
    axis: ArrayLike = (1.0, 0.0)
    friction: float = 0.0
    driven: bool = False


@dataclass(frozen=True)
class Solution:
    """Reactions on the second body of each joint, and drive efforts, by joint name.

    force: what the constraint transmits, N, global axes (a guide: across it only, no friction, no drive).
    moment: of the constraint about the joint's point, N m (a pin: 0). effort: N m or N. residual: largest
    |A x − b| against the largest |b|. condition: of the equations with forces and moments as they come.
    """

    force: dict[str, Vector]
    moment: dict[str, float]
    effort: dict[str, float]
    residual: float
    condition: float


def solve(bodies: Mapping[str, Body], joints: Mapping[str, Joint], gravity: ArrayLike = (0.0, 0.0)) -> Solution:
    """All joint reactions and drive efforts at one position.

    For each body  Σ F = m a  and, about its centre,  Σ (M + r × F) = J α, with the unknowns on the left.
    Raises ValueError if the equations are not as many as the unknowns (mobility ≠ number of drives).
    """
    rows = {name: 3 * k for k, name in enumerate(bodies)}
    columns: list[tuple[str, str]] = [(name, part) for name, joint in joints.items() for part in PARTS[joint.kind]]
    columns += [(name, "effort") for name, joint in joints.items() if joint.driven]
    if len(columns) != 3 * len(bodies):
        raise ValueError(f"{3 * len(bodies)} equations but {len(columns)} unknowns: not determinate")

    A = np.zeros((len(columns), len(columns)))
    for k, (name, part) in enumerate(columns):
        _add_pair(A[:, k], bodies, rows, joints[name], *_unit_load(joints[name], part))

    b = np.zeros(len(columns))
    for name, body in bodies.items():
        acceleration = _vector(body.acceleration) - _vector(gravity)
        b[rows[name] : rows[name] + 2] = body.mass * acceleration
        b[rows[name] + 2] = body.inertia * body.angular_acceleration
        for load in body.loads:
            r = _vector(load.point) - _vector(body.centre)
            b[rows[name] : rows[name] + 2] -= _vector(load.force)
            b[rows[name] + 2] -= load.moment + _cross(r, _vector(load.force))
    for joint in joints.values():
        force, moment = _unit_load(joint, "effort")  # friction acts where a drive would
        _add_pair(b, bodies, rows, joint, -joint.friction * force, -joint.friction * moment)

    x = _vector(np.linalg.solve(A, b))
    return _solution(joints, columns, x, A, b)


def _unit_load(joint: Joint, part: str) -> tuple[Vector, float]:
    """Force and moment on the second body for a unit value of one unknown of the joint.

    Revolute: "first" and "second" are the force components x and y, "effort" the torque.
    Prismatic: "first" is the force across the guide, "second" the moment, "effort" the force along the guide.
    """
    if joint.kind == "revolute":
        x, y, effort = (np.array([1.0, 0.0]), 0.0), (np.array([0.0, 1.0]), 0.0), (np.zeros(2), 1.0)
        return {"first": x, "second": y, "effort": effort}[part]
    axis = _vector(joint.axis) / np.hypot(*_vector(joint.axis))
    across = np.array([-axis[1], axis[0]])
    if joint.kind == "contact":
        return {"first": (axis, 0.0), "effort": (across, 0.0)}[part]
    return {"first": (across, 0.0), "second": (np.zeros(2), 1.0), "effort": (axis, 0.0)}[part]


def _add_pair(
    target: Vector, bodies: Mapping[str, Body], rows: Mapping[str, int], joint: Joint, force: Vector, moment: float
) -> None:
    """Add a load at the joint's point to the equations of the second body, and its opposite to the first."""
    for name, sign in ((joint.second, 1.0), (joint.first, -1.0)):
        if name is None:
            continue
        r = _vector(joint.point) - _vector(bodies[name].centre)
        target[rows[name] : rows[name] + 2] += sign * force
        target[rows[name] + 2] += sign * (moment + _cross(r, force))


def _solution(
    joints: Mapping[str, Joint], columns: Sequence[tuple[str, str]], x: Vector, A: Vector, b: Vector
) -> Solution:
    """The unknowns sorted by joint."""
    force = {name: np.zeros(2) for name in joints}
    moment = dict.fromkeys(joints, 0.0)
    effort: dict[str, float] = {}
    for (name, part), value in zip(columns, x, strict=True):
        if part == "effort":
            effort[name] = float(value)
            continue
        unit_force, unit_moment = _unit_load(joints[name], part)
        force[name] = force[name] + value * unit_force
        moment[name] += float(value) * unit_moment
    residual = float(np.abs(A @ x - b).max() / max(np.abs(b).max(), np.finfo(float).tiny))
    return Solution(force, moment, effort, residual, float(np.linalg.cond(A)))


def _vector(value: ArrayLike) -> Vector:
    return np.asarray(value, dtype=np.float64)


def _cross(r: Vector, f: Vector) -> float:
    """Moment r × F about the z axis."""
    return float(r[0] * f[1] - r[1] * f[0])
