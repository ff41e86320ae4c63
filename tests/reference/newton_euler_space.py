"""Newton–Euler equations of a spatial mechanism as one dense system: an oracle sharing nothing with Trunnion.

Maximal coordinates: every body has its six equations, every joint its unknown reaction components (a revolute 5, a
cylindrical 4, a spherical 3 …), every drive its effort, every body with a free spin an unknown moment about the line
of that spin, which shows whether the given spin is one that nothing has to hold. The motion is given. Three links of a
closed chain are 18 equations. No modules, no elimination; friction is given, or found by `solve_with_friction`.

Signs. Everything a joint transmits is stated as it acts *on the second body, by the first*, in global axes, moments
about the joint's point. The ground is the body None. SI units.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

Vector = NDArray[np.float64]
NONE = np.zeros(3)

__all__ = ["Body", "Joint", "Load", "Rubbing", "Solution", "solve", "solve_with_friction"]


@dataclass(frozen=True)
class Load:
    """Applied load on a body: a force (N) at a global point (m) and a free moment (N m)."""

    point: ArrayLike = (0.0, 0.0, 0.0)
    force: ArrayLike = (0.0, 0.0, 0.0)
    moment: ArrayLike = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Body:
    """A moving body at one position, everything in global axes.

    mass kg; inertia (3 × 3) about the centre of mass, kg m²; centre m; acceleration of the centre, m/s²; velocity and
    acceleration of its rotation, rad/s and rad/s². free_spin: line about which nothing holds it, if there is one.
    """

    mass: float
    inertia: ArrayLike
    centre: ArrayLike
    acceleration: ArrayLike
    angular_velocity: ArrayLike
    angular_acceleration: ArrayLike
    loads: Sequence[Load] = field(default=())
    free_spin: ArrayLike | None = None


@dataclass(frozen=True)
class Joint:
    """A joint at one position.

    first, second: names of the bodies, None is the ground. point: global point at which the reaction acts and its
    moment counts. axes: columns x, y, z of the element on the second body; z is the axis, the direction of the slide,
    the normal of a planar pair, the second pin of a universal one. other: the first pin of a universal joint.
    friction: force and moment (6) on the second body. driven: an unknown effort along z.
    """

    kind: str
    first: str | None
    second: str | None
    point: ArrayLike
    axes: Vector = field(default_factory=lambda: np.eye(3))
    other: ArrayLike = (1.0, 0.0, 0.0)
    pitch: float = 0.0
    friction: ArrayLike = (0.0,) * 6
    driven: bool = False


@dataclass(frozen=True)
class Solution:
    """Reactions on the second body of each joint without friction and drive, drive efforts, by joint name.

    spin: moments that the given free spins would need, N m. residual: largest |A x − b| against the largest |b|.
    """

    force: dict[str, Vector]
    moment: dict[str, Vector]
    effort: dict[str, float]
    spin: dict[str, float]
    residual: float


def wrenches(joint: Joint) -> tuple[list[Vector], Vector]:
    """What the joint can transmit for unit values of its unknowns, and its unit effort: force and moment (6)."""
    x, y, z = joint.axes.T
    forces = [np.concatenate([n, NONE]) for n in (x, y, z)]
    moments = [np.concatenate([NONE, n]) for n in (x, y, z)]
    along, about = forces[2], moments[2]
    cross = np.cross(_vector(joint.other), z)
    thread = along - joint.pitch / (2 * np.pi) * about  # no power: F_z ṡ + M_z θ̇ = 0 with ṡ = pitch θ̇/2π
    table = {
        "revolute": ([*forces, *moments[:2]], about),
        "prismatic": ([*forces[:2], *moments], along),
        "cylindrical": ([*forces[:2], *moments[:2]], about),
        "spherical": (forces, np.zeros(6)),
        "universal": ([*forces, np.concatenate([NONE, cross])], np.zeros(6)),
        "helical": ([*forces[:2], thread, *moments[:2]], about),
        "planar": ([forces[2], *moments[:2]], np.zeros(6)),
        "fixed": ([*forces, *moments], np.zeros(6)),
    }
    return table[joint.kind]


def solve(bodies: Mapping[str, Body], joints: Mapping[str, Joint], gravity: ArrayLike = NONE) -> Solution:
    """All joint reactions and drive efforts at one position.

    For each body  Σ F = m a  and, about its centre,  Σ (M + r × F) = J α + ω × J ω, with the unknowns on the left.
    Raises ValueError if the equations are not as many as the unknowns.
    """
    equations = _Equations(bodies)
    owners, A = equations.left(joints)
    b = equations.right(joints, _vector(gravity))
    x = np.linalg.solve(A, b)
    force, moment = ({name: np.zeros(3) for name in joints} for _ in range(2))
    single: dict[str, dict[str, float]] = {"effort": {}, "spin": {}}
    for (name, what, unit), value in zip(owners, x, strict=True):
        if what == "reaction":
            force[name] = force[name] + value * unit[:3]
            moment[name] = moment[name] + value * unit[3:]
        else:
            single[what][name] = float(value)
    residual = float(np.abs(A @ x - b).max() / max(np.abs(b).max(), np.finfo(float).tiny))
    return Solution(force, moment, single["effort"], single["spin"], residual)


class _Equations:
    """Six rows for each body: forces, then moments about its centre."""

    def __init__(self, bodies: Mapping[str, Body]) -> None:
        self.bodies = bodies
        self.rows = {name: 6 * k for k, name in enumerate(bodies)}
        self.columns: list[Vector] = []

    def left(self, joints: Mapping[str, Joint]) -> tuple[list[tuple[str, str, Vector]], Vector]:
        """Of every unknown its owner, what it is and its unit wrench; and the matrix. ValueError if it is not square.

        Friction is no part of it.
        """
        owners = []
        for name, joint in joints.items():
            units, effort = wrenches(joint)
            for unit in units:
                owners.append((name, "reaction", unit))
                self.column(joint, unit)
            if joint.driven:
                owners.append((name, "effort", effort))
                self.column(joint, effort)
        for name, body in self.bodies.items():
            if body.free_spin is not None:
                held = Joint("fixed", None, name, body.centre)
                owners.append((name, "spin", np.zeros(6)))
                self.column(held, np.concatenate([NONE, _vector(body.free_spin)]))
        A = np.array(self.columns).T
        if A.shape[0] != A.shape[1]:
            raise ValueError(f"{A.shape[0]} equations but {A.shape[1]} unknowns: not determinate")
        return owners, A

    def column(self, joint: Joint, wrench: Vector) -> None:
        """What a wrench of the joint does to the bodies."""
        column = np.zeros(6 * len(self.bodies))
        self.add(column, joint, wrench)
        self.columns.append(column)

    def add(self, target: Vector, joint: Joint, wrench: Vector) -> None:
        """Add a wrench at the joint's point to the second body, and its opposite to the first."""
        for name, sign in ((joint.second, 1.0), (joint.first, -1.0)):
            if name is None:
                continue
            row, r = self.rows[name], _vector(joint.point) - _vector(self.bodies[name].centre)
            target[row : row + 3] += sign * wrench[:3]
            target[row + 3 : row + 6] += sign * (wrench[3:] + np.cross(r, wrench[:3]))

    def right(self, joints: Mapping[str, Joint], gravity: Vector) -> Vector:
        """Rates of momentum less what is known of the loads."""
        b = np.zeros(6 * len(self.bodies))
        for name, body in self.bodies.items():
            row, inertia, w = self.rows[name], _vector(body.inertia), _vector(body.angular_velocity)
            b[row : row + 3] = body.mass * (_vector(body.acceleration) - gravity)
            b[row + 3 : row + 6] = inertia @ _vector(body.angular_acceleration) + np.cross(w, inertia @ w)
            for load in body.loads:
                r, force = _vector(load.point) - _vector(body.centre), _vector(load.force)
                b[row : row + 3] -= force
                b[row + 3 : row + 6] -= _vector(load.moment) + np.cross(r, force)
        for joint in joints.values():
            self.add(b, joint, -_vector(joint.friction))
        return b


@dataclass(frozen=True)
class Rubbing:
    """Friction of one bearing of a joint: its size is a function of the reaction, its direction is given.

    size: of (reaction force, moment) on the second body, N; wrench: friction (6) on the second body for
    size 1, against the slip. felt: the reaction it is a function of has the joint's own friction in it.
    """

    joint: str
    size: Callable[[Vector, Vector], float]
    wrench: Vector
    felt: bool = False


def solve_with_friction(
    bodies: Mapping[str, Body],
    joints: Mapping[str, Joint],
    rubbing: Sequence[Rubbing],
    gravity: ArrayLike = NONE,
    limit: float = 1e-13,
) -> tuple[Solution, dict[str, Vector]]:
    """The same with friction that obeys its law: sizes n with n = size(reactions(n)), by Newton.

    What the joints state as friction stays as a given load beside it. For given sizes the equations are linear, so the
    reactions are those without friction and, times its size, those to each bearing's friction alone. The Jacobian is by
    central differences. Returns friction (6) by joint too. AssertionError if it does not settle, as where the
    mechanism is locked.
    """
    alone, each = _reactions(bodies, joints, rubbing, gravity)

    def asked(sizes: Vector) -> Vector:
        felt = alone + each @ sizes  # (bearing, 6)
        return np.array([one.size(*np.split(load, 2)) for one, load in zip(rubbing, felt, strict=True)])

    n = asked(np.zeros(len(rubbing)))
    for _ in range(60):
        wanted = asked(n)
        scale = max(float(np.max(np.abs(wanted), initial=0.0)), np.finfo(float).tiny)
        if np.max(np.abs(wanted - n), initial=0.0) <= limit * scale:
            friction = {name: np.zeros(6) for name in joints}
            for one, size in zip(rubbing, wanted, strict=True):
                friction[one.joint] = friction[one.joint] + size * one.wrench
            whole = {name: _vector(joint.friction) + friction[name] for name, joint in joints.items()}
            loaded = {name: replace(joint, friction=whole[name]) for name, joint in joints.items()}
            return solve(bodies, loaded, gravity), friction
        steps = 1e-6 * scale * np.eye(len(n))
        slope = np.array([(asked(n + h) - asked(n - h)) / (2e-6 * scale) for h in steps]).T
        n = n + np.linalg.solve(np.eye(len(n)) - slope, wanted - n)
    raise AssertionError("friction does not settle")


def _reactions(
    bodies: Mapping[str, Body], joints: Mapping[str, Joint], rubbing: Sequence[Rubbing], gravity: ArrayLike
) -> tuple[Vector, Vector]:
    """What a bearing feels without friction (bearing, 6), and to friction of size 1 in each (bearing, 6, bearing)."""
    equations = _Equations(bodies)
    owners, A = equations.left(joints)
    sides = [equations.right(joints, _vector(gravity))]
    for one in rubbing:
        side = np.zeros(len(A))
        equations.add(side, joints[one.joint], -one.wrench)
        sides.append(side)
    x = np.linalg.solve(A, np.array(sides).T)
    felt = np.zeros((len(rubbing), 6, len(sides)))
    for row, one in enumerate(rubbing):
        for (name, what, unit), values in zip(owners, x, strict=True):
            if what == "reaction" and name == one.joint:
                felt[row] += np.outer(unit, values)
        for column, other in enumerate(rubbing, start=1):
            if one.felt and other.joint == one.joint:
                felt[row, :, column] += other.wrench
    return felt[..., 0], felt[..., 1:]


def _vector(value: ArrayLike) -> Vector:
    return np.asarray(value, dtype=np.float64)
