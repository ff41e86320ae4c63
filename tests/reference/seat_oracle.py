"""Linkages whose pins, balls and guides lie where their loads press them, without Trunnion.

Motion in maximal coordinates (`maximal_space`), forces from the Newton–Euler equations of all links (`space_oracle`),
elements moved by the seats in the model data (`moved`), seats and reactions in turn until nothing changes. A planar
linkage is one whose links planar pairs hold (`in_planes`): a pin has one end, a guide two that move across alone.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from reference.maximal_space import SLIDING, Array, Data, Drive, Frame, Motion, element, point, rotation
from reference.newton_euler import Solution
from reference.space_oracle import Oracle, merged

ENDS = {"spherical": [[0, 1, 2]], "pin": [[0, 1]], "slot": [[1], [1]]}  # axes along which each end may move


def axes_of(data: Data, name: str) -> list[list[int]]:
    return ENDS.get(data["joints"][name]["type"], [[0, 1], [0, 1]])


def size_of(data: Data, name: str) -> dict[str, Any]:
    """Sizes of the pin, or of the guide."""
    joint = merged(data, name)
    return dict(joint["guide" if joint["type"] in SLIDING else "pin"])


def clearance(data: Data, name: str) -> float:
    return float(size_of(data, name).get("clearance", 0.0))


def length_of(data: Data, name: str) -> float:
    size = size_of(data, name)
    return float(size.get("length", size.get("bearing", np.nan)))


def moved(data: Data, seats: dict[str, float]) -> Data:
    """The model in space with second elements moved as the offsets say."""
    links = {name: {**link, "points": dict(link["points"])} for name, link in data["links"].items()}
    for name, joint in data["joints"].items():
        own = {key.removeprefix(f"seats.{name}."): n for key, n in seats.items() if key.startswith(f"seats.{name}.")}
        if not own:
            continue
        link = joint["links"][1]
        one, two = (np.array([own.get(f"{end}.{axis}", 0.0) for axis in "xyz"]) for end in (1, 2))
        if joint["type"] in ("spherical", "pin"):
            shift = Frame(one, np.eye(3))
        else:
            lean = (two - one)[:2] / length_of(data, name)
            axis, size = np.array([-lean[1], lean[0], 0]), float(np.hypot(*lean))
            place = np.array([*(one + two)[:2] / 2, own.get("3.z", 0.0)])
            shift = Frame(place, rotation(axis, float(np.arctan(size))) if size else np.eye(3))
            middle = Frame(np.array([0, 0, size_of(data, name).get("offset", 0.0)]), np.eye(3))
            shift = middle @ shift @ middle.inverse()
        links[link]["points"][name] = point(element(links[link], name) @ shift)
    return {**data, "links": links}


@dataclass(frozen=True)
class Settled:
    """A position with its pins in their seats: offsets and loads by joint, (end, axis); motion, forces, rounds."""

    oracle: Oracle
    offsets: dict[str, Array]
    loads: dict[str, Array]
    motions: Mapping[str, Motion]
    solution: Solution
    friction: dict[str, Array]
    rounds: int


def settle(data: Data, home: Mapping[str, Frame], drive: Mapping[str, Drive], limit: float = 1e-11) -> Settled:
    """Seats of all joints with play by substitution; AssertionError if they do not settle.

    home: frames of the links near the position.
    """
    offsets = {name: np.zeros((len(axes_of(data, name)), 3)) for name in data["joints"] if clearance(data, name) > 0}
    for rounds in range(200):
        values = {f"seats.{name}.{end + 1}.{axis}": float(vector[k]) for name, ends in offsets.items()
                  for end, vector in enumerate(ends) for k, axis in enumerate("xyz")}  # fmt: skip
        oracle = Oracle(moved(data, values))
        motions = oracle.move(home, drive)
        found, friction = oracle.rub(motions)
        loads = {name: _loads(data, motions, oracle, found, name) for name in offsets}
        seats = {name: _seat(data, motions, loads[name], oracle, name) for name in offsets}
        change = max(np.max(np.abs(seats[name] - offsets[name])) / clearance(data, name) for name in offsets)
        if change <= limit:
            return Settled(oracle, offsets, loads, motions, found, friction, rounds)
        offsets = seats
    raise AssertionError(f"the seats do not settle: {change:.2g} of the clearance")


def travelling(data: Data, home: Mapping[str, Frame], driver: str, angle: float, speed: float) -> Settled:
    """A position with the whole motion of its links: differences of fourth order of their settled places."""
    step = 2e-3  # rad of the driver
    five = [settle(data, home, {driver: Drive(angle + k * step, speed)}, 1e-12) for k in (-2, -1, 0, 1, 2)]
    first = np.array([1, -8, 0, 8, -1]) * speed / (12 * step)
    rates = np.array([first, np.array([-1, 16, -30, 16, -1]) * speed**2 / (12 * step**2)])
    motions = {}
    for link in five[2].motions:
        frames = [settled.motions[link].frame for settled in five]
        turns = [Rotation.from_matrix(frame.axes @ frames[2].axes.T).as_rotvec() for frame in frames]
        (velocity, second), (spin, spin_rate) = (rates @ np.array(n) for n in ([f.place for f in frames], turns))
        motions[link] = Motion(frames[2], velocity, spin, second, spin_rate)
    found, friction = five[2].oracle.rub(motions)
    return replace(five[2], motions=motions, solution=found, friction=friction)


def _loads(data: Data, motions: Mapping[str, Motion], oracle: Oracle, found: Solution, name: str) -> Array:
    """Q of each end in the frame of the hole, where the pin lies in its middle, which the moment counts about."""
    hole, axes = _hole(data, motions, name), axes_of(data, name)
    force = hole.axes.T @ found.force[name]
    loads = np.zeros((len(axes), 3))
    if len(axes) == 1:
        loads[0, axes[0]] = force[axes[0]]
        return loads
    offset = size_of(data, name).get("offset", 0.0)
    middle = hole.place + offset * hole.axes[:, 2]
    _, two = oracle.elements(motions, name)
    about = two.frame.place + offset * two.frame.axes[:, 2]
    moment = hole.axes.T @ (found.moment[name] + np.cross(about - middle, found.force[name]))
    # Q₁ + Q₂ = F across, (H/2) z × (Q₂ − Q₁) = M
    pair = np.array([moment[1], -moment[0], 0.0]) / length_of(data, name)
    for end, sign in enumerate((-1, 1)):
        loads[end, axes[end]] = (force / 2 + sign * pair)[axes[end]]
    return loads


def _hole(data: Data, motions: Mapping[str, Motion], name: str) -> Frame:
    """The second element where the pin lies in the middle of its hole."""
    second = data["joints"][name]["links"][1]
    own = element(data["links"][second], name)
    return motions[second].frame @ own if second in motions else own


def _seat(data: Data, motions: Mapping[str, Motion], loads: Array, oracle: Oracle, name: str) -> Array:
    """c = ρ n: Q = N (n − μ t), t the way the hole slips past the pin at n; along a guide that turns nothing."""
    kind, slip = data["joints"][name]["type"], oracle.slip(motions, name)
    spin = _hole(data, motions, name).axes.T @ slip.spin
    mu = 0.0 if kind in SLIDING else oracle.coefficient(name)
    if kind == "cylindrical":  # the share of the friction that acts across the axis
        mu *= abs(slip.turn) / np.hypot(slip.turn, slip.slide / size_of(data, name)["radius"])
    seats = np.zeros_like(loads)
    for end, load in enumerate(loads):
        n = load / np.linalg.norm(load)
        seats[end] = _ball_contact(n, mu, spin) if kind == "spherical" else _pin_contact(n, mu, spin[2])
    return clearance(data, name) * seats


def _pin_contact(q: Array, mu: float, rate: float) -> Array:
    """q turned by atan μ about z, with the hole."""
    angle = np.arctan(mu) * np.sign(rate)
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * q[0] - s * q[1], s * q[0] + c * q[1], 0.0])


def _ball_contact(q: Array, mu: float, spin: Array) -> Array:
    """n with n − μ t ∥ q by substitution; on the pole where q is within atan μ of the spin's axis."""
    if mu == 0 or not np.any(spin):
        return q
    axis = spin / np.linalg.norm(spin)
    if np.linalg.norm(np.cross(axis, q)) < mu * abs(axis @ q):
        return np.asarray(np.sign(axis @ q) * axis)
    n = q
    for _ in range(500):
        t = np.cross(axis, n)
        new = q * np.hypot(1, mu) + mu * t / np.linalg.norm(t)
        new = new / np.linalg.norm(new)
        if np.max(np.abs(new - n)) < 1e-15:
            break
        n = new
    return np.asarray(n)
