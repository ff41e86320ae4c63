"""Linkages in space whose pins and balls lie where their loads press them, without Trunnion.

Motion in maximal coordinates (`maximal_space`), forces from the Newton–Euler equations of all links (`space_oracle`),
elements moved by the seats in the model data (`moved`), seats and reactions in turn until nothing changes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from reference.maximal_space import Array, Data, Drive, Frame, Motion, element, point, rotation
from reference.newton_euler import Solution
from reference.space_oracle import Oracle

__all__ = ["Settled", "moved", "settle"]


def moved(data: Data, seats: dict[str, float]) -> Data:
    """The model in space with second elements moved as the offsets say."""
    links = {name: {**link, "points": dict(link["points"])} for name, link in data["links"].items()}
    defaults = data.get("joint_defaults", {})
    for name, joint in data["joints"].items():
        own = {key.removeprefix(f"seats.{name}."): n for key, n in seats.items() if key.startswith(f"seats.{name}.")}
        if not own:
            continue
        pin, guide = ({**defaults.get(key, {}), **joint.get(key, {})} for key in ("pin", "guide"))
        link = joint["links"][1]
        if joint["type"] == "spherical":
            shift = Frame(np.array([own[f"1.{axis}"] for axis in "xyz"]), np.eye(3))
        else:
            length = guide["length"] if joint["type"] == "prismatic" else pin.get("length", pin.get("bearing"))
            (x1, y1), (x2, y2) = ([own[f"{end}.{axis}"] for axis in "xy"] for end in (1, 2))
            lean = np.array([x2 - x1, y2 - y1]) / length
            axis, size = np.array([-lean[1], lean[0], 0]), float(np.hypot(*lean))
            place = np.array([(x1 + x2) / 2, (y1 + y2) / 2, own.get("3.z", 0.0)])
            shift = Frame(place, rotation(axis, float(np.arctan(size))) if size else np.eye(3))
            middle = Frame(np.array([0, 0, pin.get("offset", 0.0)]), np.eye(3))
            shift = middle @ shift @ middle.inverse()
        links[link]["points"][name] = point(element(links[link], name) @ shift)
    return {**data, "links": links}


@dataclass(frozen=True)
class Settled:
    """A position with its pins in their seats: offsets and loads by joint, (end, axis); motion, forces, rounds."""

    offsets: dict[str, Array]
    loads: dict[str, Array]
    motions: Mapping[str, Motion]
    solution: Solution
    friction: dict[str, Array]
    rounds: int


def settle(data: Data, home: Mapping[str, Frame], drive: Mapping[str, Drive], limit: float = 1e-11) -> Settled:
    """Seats of revolute, cylindrical and spherical joints by substitution; AssertionError if they do not settle.

    home: frames of the links near the position.
    """
    playing = [name for name in data["joints"] if _clearance(data, name) > 0]
    offsets = {name: np.zeros((1 if _ball(data, name) else 2, 3)) for name in playing}
    for rounds in range(60):
        shifted = Oracle(moved(data, _values(data, offsets)))
        motions = shifted.move(home, drive)
        found, friction = shifted.rub(motions)
        loads = {name: _loads(data, motions, shifted, found, name) for name in playing}
        wanted = {name: _seat(data, motions, loads[name], shifted, name) for name in playing}
        change = max(np.max(np.abs(wanted[name] - offsets[name])) / _clearance(data, name) for name in playing)
        if change <= limit:
            return Settled(offsets, loads, motions, found, friction, rounds)
        offsets = wanted
    raise AssertionError(f"the seats do not settle: {change:.2g} of the clearance")


def _ball(data: Data, name: str) -> bool:
    return bool(data["joints"][name]["type"] == "spherical")


def _pin(data: Data, name: str) -> dict[str, Any]:
    return {**data.get("joint_defaults", {}).get("pin", {}), **data["joints"][name].get("pin", {})}


def _clearance(data: Data, name: str) -> float:
    return float(_pin(data, name).get("clearance", 0.0))


def _values(data: Data, offsets: Mapping[str, Array]) -> dict[str, float]:
    """By the names that `moved` takes."""
    return {
        f"seats.{name}.{end + 1}.{axis}": float(vector[k])
        for name, ends in offsets.items()
        for end, vector in enumerate(ends)
        for k, axis in enumerate("xyz" if _ball(data, name) else "xy")
    }


def _hole(data: Data, motions: Mapping[str, Motion], name: str) -> Frame:
    """The second element where the pin lies in the middle of its hole."""
    second = data["joints"][name]["links"][1]
    own = element(data["links"][second], name)
    return motions[second].frame @ own if second in motions else own


def _loads(data: Data, motions: Mapping[str, Motion], oracle: Oracle, found: Solution, name: str) -> Array:
    """Q of each end in the frame of the hole, whose middle the moment counts about."""
    hole = _hole(data, motions, name)
    force = hole.axes.T @ found.force[name]
    if _ball(data, name):
        return np.array([force])
    pin = _pin(data, name)
    middle = hole.place + pin.get("offset", 0.0) * hole.axes[:, 2]
    _, two = oracle.elements(motions, name)
    about = two.frame.place + pin.get("offset", 0.0) * two.frame.axes[:, 2]
    moment = hole.axes.T @ (found.moment[name] + np.cross(about - middle, found.force[name]))
    # Q₁ + Q₂ = F across, (H/2) z × (Q₂ − Q₁) = M
    length = float(pin.get("length", pin.get("bearing", np.nan)))
    pair = np.array([moment[1], -moment[0], 0.0]) / length
    flat = np.array([force[0], force[1], 0.0]) / 2
    return np.array([flat - pair, flat + pair])


def _seat(data: Data, motions: Mapping[str, Motion], loads: Array, oracle: Oracle, name: str) -> Array:
    """c = ρ n: Q = N (n − μ t), t the way the hole slips past the pin at n."""
    mu, rho = oracle.coefficient(name) * _across(data, motions, oracle, name), _clearance(data, name)
    one, two = oracle.elements(motions, name)
    hole = _hole(data, motions, name)
    spin = hole.axes.T @ (two.spin - one.spin)
    seats = np.zeros_like(loads)
    for end, load in enumerate(loads):
        n = load / np.linalg.norm(load)
        seats[end] = rho * (_ball_contact(n, mu, spin) if _ball(data, name) else _pin_contact(n, mu, spin[2]))
    return seats


def _across(data: Data, motions: Mapping[str, Motion], oracle: Oracle, name: str) -> float:
    """Share of the friction that acts across the axis: all of it but where a pin slides along its hole too."""
    if data["joints"][name]["type"] != "cylindrical":
        return 1.0
    slip = oracle.slip(motions, name)
    return float(abs(slip.turn) / np.hypot(slip.turn, slip.slide / _pin(data, name)["radius"]))


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
