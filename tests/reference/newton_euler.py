"""Newton–Euler equations of a mechanism in plane or space as one dense system: an oracle sharing nothing with Trunnion.

Maximal coordinates: every body has its equations (three in the plane, six in space), every joint its unknown reaction
components, every drive its effort, every body with a free spin an unknown moment about the line of that spin, which
shows whether the given spin is one that nothing has to hold. The motion (poses, accelerations) is given. No modules, no
elimination; friction is given, or found by `solve_with_friction`.

Signs. Everything a joint transmits is stated as it acts *on the second body, by the first*, in global axes, moments
about the joint's point. A wrench is force and moment together: (x, y, m) or six numbers. The ground is the body None.
Angles and moments in the plane are counter-clockwise positive. SI units.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Vector = NDArray[np.float64]

__all__ = ["Body", "Joint", "Load", "Rubbing", "Solution", "solve", "solve_with_friction"]


@dataclass(frozen=True)
class Load:
    """Applied load on a body: a force (N) at a global point (m) and a free moment (N m)."""

    point: ArrayLike
    force: ArrayLike
    moment: ArrayLike


@dataclass(frozen=True)
class Body:
    """A moving body at one position, everything in global axes.

    mass kg; inertia about the centre of mass, kg m² (in space 3 × 3); centre m; acceleration of the centre, m/s²;
    acceleration and velocity of its rotation, rad/s² and rad/s. free_spin: line about which nothing holds it, if any.
    """

    mass: float
    inertia: ArrayLike
    centre: ArrayLike
    acceleration: ArrayLike
    angular_acceleration: ArrayLike
    angular_velocity: ArrayLike = 0.0
    loads: Sequence[Load] = field(default=())
    free_spin: ArrayLike | None = None


@dataclass(frozen=True)
class Joint:
    """A joint at one position.

    first, second: names of the bodies. point: global point at which the reaction acts and its moment counts (of a guide
    the joint's point on the second body). axes: in the plane the direction of the slide; in space columns x, y, z of
    the element on the second body, z being the axis, the direction of the slide, the normal of a planar pair or the
    second pin of a universal one. other: the first pin of a universal joint. friction: wrench on the second body.
    driven: an unknown effort along the freedom. A contact in the plane transmits a force along its axis.
    """

    kind: str
    first: str | None
    second: str | None
    point: ArrayLike
    axes: ArrayLike
    other: ArrayLike = (1.0, 0.0, 0.0)
    pitch: float = 0.0
    friction: ArrayLike = 0.0
    driven: bool = False


@dataclass(frozen=True)
class Solution:
    """Reactions on the second body of each joint without friction and drive, drive efforts, by joint name.

    spin: moments that the given free spins would need, N m.
    """

    force: dict[str, Vector]
    moment: dict[str, Any]
    effort: dict[str, float]
    spin: dict[str, float]


def wrenches(joint: Joint) -> tuple[list[Vector], Vector]:
    """What the joint can transmit for unit values of its unknowns, and its unit effort."""
    axes = np.asarray(joint.axes, float)
    if len(np.ravel(joint.point)) == 2:
        (x, y, turn), (c, s) = np.eye(3), axes / np.linalg.norm(axes)
        along, across = np.array([c, s, 0.0]), np.array([-s, c, 0.0])
        plane = {"revolute": ([x, y], turn), "prismatic": ([across, turn], along), "contact": ([along], across)}
        return plane[joint.kind]
    none = np.zeros(3)
    forces = [np.concatenate([n, none]) for n in axes.T]
    moments = [np.concatenate([none, n]) for n in axes.T]
    along, about = forces[2], moments[2]
    cross = np.cross(np.asarray(joint.other, float), axes[:, 2])
    thread = along - joint.pitch / (2 * np.pi) * about  # no power: F_z ṡ + M_z θ̇ = 0 with ṡ = pitch θ̇/2π
    table = {
        "revolute": ([*forces, *moments[:2]], about),
        "prismatic": ([*forces[:2], *moments], along),
        "cylindrical": ([*forces[:2], *moments[:2]], about),
        "spherical": (forces, np.zeros(6)),
        "universal": ([*forces, np.concatenate([none, cross])], np.zeros(6)),
        "helical": ([*forces[:2], thread, *moments[:2]], about),
        "planar": ([forces[2], *moments[:2]], np.zeros(6)),
        "fixed": ([*forces, *moments], np.zeros(6)),
        "pin": (forces[:2], about),  # these two of links that a planar pair each holds in their plane
        "slot": ([forces[1], moments[0]], along),
    }
    return table[joint.kind]


def about(point: ArrayLike, centre: ArrayLike, wrench: Vector) -> Vector:
    """A wrench at a point as one about a centre."""
    r, count = np.asarray(point, float) - np.asarray(centre, float), len(wrench) // 2 + len(wrench) % 2
    force, moment = wrench[:count], wrench[count:]
    turned = [r[0] * force[1] - r[1] * force[0]] if count == 2 else np.cross(r, force)
    return np.concatenate([force, moment + turned])


def effect(bodies: Mapping[str, Body], joint: Joint, wrench: Vector) -> Vector:
    """What a wrench at the joint's point adds to the equations of the second body, and its opposite of the first."""
    parts = {name: np.zeros(len(wrench)) for name in bodies}
    for name, sign in ((joint.second, 1.0), (joint.first, -1.0)):
        if name is not None:
            parts[name] += sign * about(joint.point, bodies[name].centre, wrench)
    return np.concatenate(list(parts.values()))


Unknown = tuple[str, str, Vector]  # its joint or body, what it is, its unit wrench


def left(bodies: Mapping[str, Body], joints: Mapping[str, Joint]) -> tuple[list[Unknown], Vector]:
    """The unknowns and the matrix of the equations. ValueError if it is not square."""
    unknowns: list[Unknown] = []
    columns = []
    for name, joint in joints.items():
        units, effort = wrenches(joint)
        unknowns += [(name, "reaction", unit) for unit in units] + [(name, "effort", effort)] * joint.driven
        columns += [effect(bodies, joint, unit) for unit in (*units, effort)[: len(units) + joint.driven]]
    for name, body in bodies.items():
        if body.free_spin is not None:
            spin = np.concatenate([np.zeros(3), np.asarray(body.free_spin, float)])
            unknowns.append((name, "spin", spin))
            columns.append(effect(bodies, Joint("fixed", None, name, body.centre, np.eye(3)), spin))
    A = np.array(columns).T
    if A.shape[0] != A.shape[1]:
        raise ValueError(f"{A.shape[0]} equations but {A.shape[1]} unknowns: not determinate")
    return unknowns, A


def right(bodies: Mapping[str, Body], joints: Mapping[str, Joint], gravity: ArrayLike) -> Vector:
    """Rates of momentum less what is known of the loads: m a, and about the centre J α + ω × J ω."""
    parts = []
    for body in bodies.values():
        inertia, w = np.asarray(body.inertia, float), np.asarray(body.angular_velocity, float)
        turned = np.atleast_1d(np.dot(inertia, body.angular_acceleration))
        if inertia.ndim:
            turned = turned + np.cross(w, inertia @ w)
        pushed = body.mass * (np.asarray(body.acceleration, float) - np.asarray(gravity, float))
        part = np.concatenate([pushed, turned])
        for load in body.loads:
            part -= about(load.point, body.centre, np.append(load.force, load.moment))
        parts.append(part)
    b = np.concatenate(parts)
    for joint in joints.values():
        if np.any(joint.friction):
            b -= effect(bodies, joint, np.asarray(joint.friction, float))
    return b


def solve(bodies: Mapping[str, Body], joints: Mapping[str, Joint], gravity: ArrayLike) -> Solution:
    """All joint reactions and drive efforts at one position, from Σ F = m a and, about each centre, Σ M.

    Raises ValueError if the equations are not as many as the unknowns (mobility ≠ number of drives).
    """
    unknowns, A = left(bodies, joints)
    x = np.linalg.solve(A, right(bodies, joints, gravity))
    size = len(A) // len(bodies)
    reaction = {name: np.zeros(size) for name in joints}
    single: dict[str, dict[str, float]] = {"effort": {}, "spin": {}}
    for (name, what, unit), value in zip(unknowns, x, strict=True):
        if what == "reaction":
            reaction[name] += value * unit
        else:
            single[what][name] = float(value)
    axes = 2 if size == 3 else 3
    force = {name: wrench[:axes] for name, wrench in reaction.items()}
    moment = {name: wrench[axes] if axes == 2 else wrench[axes:] for name, wrench in reaction.items()}
    return Solution(force, moment, single["effort"], single["spin"])


@dataclass(frozen=True)
class Rubbing:
    """Friction of one bearing of a joint in space: its size is a function of the reaction, its direction is given.

    size: of (reaction force, moment) on the second body, N; wrench: friction on the second body for size 1, against
    the slip. felt: the reaction it is a function of has the joint's own friction in it.
    """

    joint: str
    size: Callable[[Vector, Vector], float]
    wrench: Vector
    felt: bool = False


def solve_with_friction(
    bodies: Mapping[str, Body],
    joints: Mapping[str, Joint],
    rubbing: Sequence[Rubbing],
    gravity: ArrayLike,
    limit: float = 1e-13,
) -> tuple[Solution, dict[str, Vector]]:
    """The same with friction that obeys its law: sizes n with n = size(reactions(n)), by Newton.

    What the joints state as friction stays as a given load beside it. For given sizes the equations are linear, so the
    reactions are those without friction and, times its size, those to each bearing's friction alone. The Jacobian is by
    central differences. Returns friction by joint too. AssertionError if it does not settle, as where the mechanism is
    locked.
    """
    alone, each = _reactions(bodies, joints, rubbing, gravity)

    def law(sizes: Vector) -> Vector:
        felt = alone + each @ sizes  # (bearing, 6)
        return np.array([bearing.size(*np.split(load, 2)) for bearing, load in zip(rubbing, felt, strict=True)])

    n = law(np.zeros(len(rubbing)))
    for _ in range(60):
        sizes = law(n)
        scale = max(float(np.max(np.abs(sizes), initial=0.0)), np.finfo(float).tiny)
        if np.max(np.abs(sizes - n), initial=0.0) <= limit * scale:
            friction = {name: np.zeros(6) for name in joints}
            for bearing, size in zip(rubbing, sizes, strict=True):
                friction[bearing.joint] += size * bearing.wrench
            loaded = {name: replace(joint, friction=joint.friction + friction[name]) for name, joint in joints.items()}
            return solve(bodies, loaded, gravity), friction
        steps = 1e-6 * scale * np.eye(len(n))
        slope = np.array([(law(n + h) - law(n - h)) / (2e-6 * scale) for h in steps]).T
        n = n + np.linalg.solve(np.eye(len(n)) - slope, sizes - n)
    raise AssertionError("friction does not settle")


def _reactions(
    bodies: Mapping[str, Body], joints: Mapping[str, Joint], rubbing: Sequence[Rubbing], gravity: ArrayLike
) -> tuple[Vector, Vector]:
    """What a bearing feels without friction (bearing, 6), and to friction of size 1 in each (bearing, 6, bearing)."""
    unknowns, A = left(bodies, joints)
    sides = [right(bodies, joints, gravity)]
    sides += [-effect(bodies, joints[bearing.joint], bearing.wrench) for bearing in rubbing]
    x = np.linalg.solve(A, np.array(sides).T)
    felt = np.zeros((len(rubbing), 6, len(sides)))
    for row, bearing in enumerate(rubbing):
        for (name, what, unit), values in zip(unknowns, x, strict=True):
            if what == "reaction" and name == bearing.joint:
                felt[row] += np.outer(unit, values)
        for column, other in enumerate(rubbing, start=1):
            if bearing.felt and other.joint == bearing.joint:
                felt[row, :, column] += other.wrench
    return felt[..., 0], felt[..., 1:]
