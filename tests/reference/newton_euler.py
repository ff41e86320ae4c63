"""Newton–Euler equations of a mechanism in space as one dense system: an oracle sharing nothing with Trunnion.

Maximal coordinates: every body has its six equations, every joint its unknown reaction components (a revolute 5, a
cylindrical 4, a spherical 3 …), every drive its effort, every body with a free spin an unknown moment about the line
of that spin, which shows whether the given spin is one that nothing has to hold. The motion is given. Three links of a
closed chain are 18 equations. No modules, no elimination; friction is given, or found by `solve_with_friction`.

Signs. Everything a joint transmits is stated as it acts *on the second body, by the first*, in global axes, moments
about the joint's point. A wrench is force and moment together, six numbers. The ground is the body None. SI units.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Load:
    """Applied load on a body: a force (N) at a global point (m) and a free moment (N m)."""

    point: ArrayLike
    force: ArrayLike
    moment: ArrayLike


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

    first, second: names of the bodies. point: global point at which the reaction acts and its moment counts. axes:
    columns x, y, z of the element on the second body; z is the axis, the direction of the slide, the normal of a planar
    pair. friction: wrench on the second body. driven: an unknown effort along z.
    """

    kind: str
    first: str | None
    second: str | None
    point: ArrayLike
    axes: Vector
    friction: ArrayLike = 0.0
    driven: bool = False


@dataclass(frozen=True)
class Solution:
    """Reactions on the second body of each joint without friction and drive, drive efforts, by joint name.

    spin: moments that the given free spins would need, N m.
    """

    force: dict[str, Vector]
    moment: dict[str, Vector]
    effort: dict[str, float]
    spin: dict[str, float]


def wrenches(joint: Joint) -> tuple[list[Vector], Vector]:
    """What the joint can transmit for unit values of its unknowns, and its unit effort."""
    forces = [np.append(n, np.zeros(3)) for n in joint.axes.T]
    moments = [np.append(np.zeros(3), n) for n in joint.axes.T]
    table = {
        "revolute": ([*forces, *moments[:2]], moments[2]),
        "cylindrical": ([*forces[:2], *moments[:2]], moments[2]),
        "spherical": (forces, np.zeros(6)),
        "planar": ([forces[2], *moments[:2]], np.zeros(6)),
        "pin": (forces[:2], moments[2]),  # these two of links that a planar pair each holds in their plane
        "slot": ([forces[1], moments[0]], forces[2]),
    }
    return table[joint.kind]


def about(point: ArrayLike, centre: ArrayLike, wrench: Vector) -> Vector:
    """A wrench at a point as one about a centre."""
    r = np.asarray(point, float) - np.asarray(centre, float)
    return np.concatenate([wrench[:3], wrench[3:] + np.cross(r, wrench[:3])])


def effect(bodies: Mapping[str, Body], joint: Joint, wrench: Vector) -> Vector:
    """What a wrench at the joint's point adds to the equations of the second body, and its opposite of the first."""
    parts = {name: np.zeros(6) for name in bodies}
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
            columns.append(effect(bodies, Joint("spin", None, name, body.centre, np.eye(3)), spin))
    A = np.array(columns).T
    if A.shape[0] != A.shape[1]:
        raise ValueError(f"{A.shape[0]} equations but {A.shape[1]} unknowns: not determinate")
    return unknowns, A


def right(bodies: Mapping[str, Body], joints: Mapping[str, Joint], gravity: ArrayLike) -> Vector:
    """Rates of momentum less what is known of the loads: m a, and about the centre J α + ω × J ω."""
    parts = []
    for body in bodies.values():
        inertia, w = np.asarray(body.inertia, float), np.asarray(body.angular_velocity, float)
        turned = inertia @ np.asarray(body.angular_acceleration, float) + np.cross(w, inertia @ w)
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
    reaction = {name: np.zeros(6) for name in joints}
    single: dict[str, dict[str, float]] = {"effort": {}, "spin": {}}
    for (name, what, unit), value in zip(unknowns, x, strict=True):
        if what == "reaction":
            reaction[name] += value * unit
        else:
            single[what][name] = float(value)
    force, moment = ({name: wrench[part] for name, wrench in reaction.items()} for part in (slice(3), slice(3, 6)))
    return Solution(force, moment, single["effort"], single["spin"])


@dataclass(frozen=True)
class Rubbing:
    """Friction of one bearing of a joint: its size is a function of the reaction, its direction is given.

    size: of (reaction force, moment) on the second body, N; wrench: friction on the second body for size 1, against
    the slip.
    """

    joint: str
    size: Callable[[Vector, Vector], float]
    wrench: Vector


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
    alone, each = loads_of_bearings(bodies, joints, rubbing, gravity)

    def law(sizes: Vector) -> Vector:
        loads = alone + each @ sizes  # (bearing, 6)
        return np.array([bearing.size(*np.split(load, 2)) for bearing, load in zip(rubbing, loads, strict=True)])

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


def loads_of_bearings(
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
    return felt[..., 0], felt[..., 1:]
