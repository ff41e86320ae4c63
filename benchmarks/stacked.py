"""The Newton-Euler equations of all links of any planar mechanism at once, as stacks solved by NumPy: no modules.

What a general tool without Assur groups would do: three equations a link, two unknowns a joint and one a drive,
solved once for the loads and for unit friction in each joint; then successive approximation by superposition.
Motion is given, taken from Trunnion's walk before the clock runs: poses, accelerations and directions of slip.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.solve.run import Run

Array = NDArray[np.float64]
TOLERANCE = 1e-8  # of the largest reaction, as Trunnion's
MAX_ITERATIONS = 100
CHUNK = 2048

__all__ = ["Given", "given", "solve"]


class Given(NamedTuple):
    """The motion of one chunk of N positions, and what the joints are.

    centre, acceleration: (link, 2, N); angular: (link, N); sides: the links of each joint, −1 the ground; place of its
    second point and direction of its slide: (joint, 2, N); sign of the slip (joint, N); length: of the guide, 0 for a
    pin; factor: coefficient × radius (1 for a guide); driven: joints with an effort; loads: force and moment about the
    centre (link, 3, N); mass, inertia: (link,).
    """

    centre: Array
    acceleration: Array
    angular: Array
    sides: list[tuple[int, int]]
    place: Array
    axis: Array
    sign: Array
    length: list[float]
    factor: list[float]
    driven: list[int]
    loads: Array
    mass: list[float]
    inertia: list[float]


def given(run: Run, time: Array) -> Given:
    """The motion at some times (s), and the model's numbers, from Trunnion."""
    back = run.solve(time)
    walk, values, mechanism = back.walk, run.values, run.system.mechanism
    links = [link for link in mechanism.links if link != mechanism.fixed_link]
    number = {link: k for k, link in enumerate(links)} | {mechanism.fixed_link: -1}

    def rows(*numbers: Any) -> Array:
        return np.array([np.broadcast_to(n, time.shape) for n in numbers])

    centres = [walk.at(link, run.system.centre(values, link)) for link in links]
    masses = [values[f"links.{link}.mass"] for link in links]
    weight = [values[f"gravity.{axis}"] for axis in "xy"]
    loads = np.array([rows(mass * weight[0], mass * weight[1], 0.0) for mass in masses])
    for name, load in mechanism.loads.items():
        k = number[load.link or ""]
        if f"loads.{name}.force.x" in values:
            force = (values[f"loads.{name}.force.x"], values[f"loads.{name}.force.y"])
            arm = rows(*walk.point(links[k], load.at or "").place) - rows(*centres[k].place)
            loads[k] += rows(*force, arm[0] * force[1] - arm[1] * force[0])
        loads[k, 2] += values.get(f"loads.{name}.moment", 0.0)
    joints = run.system.joints
    ends = {name: [walk.element(link, name) for link in joint.links] for name, joint in joints.items()}
    pins = {name: joint.type == "revolute" for name, joint in joints.items()}
    return Given(
        np.array([rows(*centre.place) for centre in centres]),
        np.array([rows(*centre.acceleration) for centre in centres]),
        np.array([rows(walk.motions[link].acceleration.w)[0] for link in links]),
        [tuple(number[link] for link in joint.links) for joint in joints.values()],
        np.array([rows(end.x, end.y) for _, end in ends.values()]),
        np.array([rows(end.c, end.s) for end, _ in ends.values()]),
        rows(*(np.where(back.resting[name], 0.0, np.sign(back.walk.speed(name))) for name in joints)),
        [0.0 if pins[name] else values[f"joints.{name}.guide.length"] for name in joints],
        [_strength(values, name, pin) for name, pin in pins.items()],
        [list(joints).index(name) for name in mechanism.drivers],
        loads,
        masses,
        [values[f"links.{link}.inertia"] for link in links],
    )


def _strength(values: Mapping[str, Any], joint: str, pin: bool) -> float:
    """Friction for each newton of normal load, N m or N."""
    path = f"joints.{joint}"
    coefficient = values[f"{path}.friction.pair_factor"] * values[f"{path}.friction.coefficient"]
    return float(coefficient * (values[f"{path}.pin.radius"] if pin else 1.0))


def solve(motion: Given) -> Mapping[str, Array]:
    """Reactions (N, joint, 2), friction (N, joint) and drive efforts (N, driver).

    The two unknowns of a pin are the force's x and y, of a guide the force across it and the moment about its point.
    """
    A, b, friction = _equations(motion)
    joints = len(motion.sides)
    x = np.linalg.solve(A, np.concatenate([b[..., None], friction], axis=2))
    ideal, response = x[..., 0], x[..., 1:]
    pins = [k for k in range(joints) if not motion.length[k]]
    guides = [k for k in range(joints) if motion.length[k]]
    strength = -(motion.sign * np.array(motion.factor)[:, None]).T
    force: Array = np.zeros((len(b), joints))
    normal, last = np.empty_like(force), np.zeros_like(force)
    for _ in range(MAX_ITERATIONS):
        found = ideal + (response @ force[..., None])[..., 0]
        pairs = found[:, : 2 * joints].reshape(len(b), joints, 2)
        normal[:, pins] = np.hypot(pairs[:, pins, 0], pairs[:, pins, 1])
        for k in guides:
            half, turn = pairs[:, k, 0] / 2, pairs[:, k, 1] / motion.length[k]
            normal[:, k] = np.abs(half + turn) + np.abs(half - turn)
        force = strength * normal
        if np.all(np.abs(normal - last).max(axis=1) <= TOLERANCE * normal.max(axis=1)):
            break
        last = normal.copy()
    return {"reaction": pairs, "friction": force, "effort": found[:, 2 * joints :]}


def _equations(motion: Given) -> tuple[Array, Array, Array]:
    """A (N, 3n, 3n) x = b (N, 3n), and the right side of unit friction in each joint (N, 3n, joints)."""
    links, size = len(motion.mass), motion.angular.shape[1]
    joints = len(motion.sides)
    A = np.zeros((size, 3 * links, 2 * joints + len(motion.driven)))
    friction = np.zeros((size, 3 * links, joints))
    for k, sides in enumerate(motion.sides):
        ux, uy = motion.axis[k]
        for link, sign in zip(sides, (-1.0, 1.0), strict=True):
            if link < 0:
                continue
            fx, fy, m = 3 * link, 3 * link + 1, 3 * link + 2
            rx, ry = motion.place[k] - motion.centre[link]
            if not motion.length[k]:
                A[:, fx, 2 * k] = A[:, fy, 2 * k + 1] = sign
                A[:, m, 2 * k], A[:, m, 2 * k + 1] = -sign * ry, sign * rx
                friction[:, m, k] = -sign
            else:
                A[:, fx, 2 * k], A[:, fy, 2 * k] = -sign * uy, sign * ux
                A[:, m, 2 * k], A[:, m, 2 * k + 1] = sign * (rx * ux + ry * uy), sign
                friction[:, fx, k], friction[:, fy, k] = -sign * ux, -sign * uy
                friction[:, m, k] = -sign * (rx * uy - ry * ux)
    for j, k in enumerate(motion.driven):
        A[:, :, 2 * joints + j] = -friction[:, :, k]
    b = np.empty((size, 3 * links))
    for link, (mass, inertia) in enumerate(zip(motion.mass, motion.inertia, strict=True)):
        b[:, 3 * link] = mass * motion.acceleration[link, 0] - motion.loads[link, 0]
        b[:, 3 * link + 1] = mass * motion.acceleration[link, 1] - motion.loads[link, 1]
        b[:, 3 * link + 2] = inertia * motion.angular[link] - motion.loads[link, 2]
    return A, b, friction
