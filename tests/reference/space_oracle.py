"""Forces of a spatial mechanism of plain data: loads and contacts of the model handed to the Newton–Euler equations.

Friction is by the formulas of the documentation, written here once more from the picture of two contacts at the ends
of a bearing: Pezzuti et al. (2006), eqs. 15–19, and the vector sum in its place.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from reference.maximal_space import SLIDING, Array, Data, Frame, Linkage, Motion, gap, turned
from reference.newton_euler import Body, Joint, Load, Rubbing, Solution, solve, solve_with_friction

__all__ = ["Oracle", "Slip", "merged"]

NONE = np.zeros(3)
MATRIX = (("xx", "xy", "xz"), ("xy", "yy", "yz"), ("xz", "yz", "zz"))


def merged(data: Data, joint: str) -> Data:
    """A joint with the model's defaults."""
    found, defaults = dict(data["joints"][joint]), data.get("joint_defaults", {})
    for key in ("pin", "guide"):
        found[key] = {**defaults.get(key, {}), **found.get(key, {})}
    friction = found.get("friction", defaults.get("friction", 0.0))
    found["friction"] = friction if isinstance(friction, dict) else {"coefficient": friction}
    return found


class Slip(NamedTuple):
    """Rates of a joint's freedoms: turn and slide along z, and the whole relative rotation."""

    turn: float
    slide: float
    spin: Array


class Oracle(Linkage):
    """A mechanism with its forces."""

    def __init__(self, data: Data) -> None:
        super().__init__(data)
        self.joint = {name: merged(data, name) for name in self.joints}
        self.gravity = np.asarray(data.get("gravity", np.zeros(3)), float)

    def coefficient(self, name: str) -> float:
        friction = self.joint[name]["friction"]
        return float(friction.get("coefficient", 0.0)) * float(friction.get("pair_factor", 1.0))

    def centre(self, link: str, motion: Motion) -> tuple[Array, Array]:
        """Place and acceleration of the mass centre."""
        r = motion.frame.axes @ np.asarray(self.links[link].get("centre", np.zeros(3)), float)
        w = motion.spin
        return motion.frame.place + r, motion.acceleration + np.cross(motion.spin_rate, r) + np.cross(w, np.cross(w, r))

    def inertia(self, link: str, frame: Frame) -> Array:
        """About the mass centre, global axes."""
        data = self.links[link]
        stated = data.get("inertia", {})
        own = np.array([[float(stated.get(key, 0.0)) for key in row] for row in MATRIX])
        if data.get("inertia_about", "centre") == "origin":
            c = np.asarray(data["centre"], float)
            own = own - data["mass"] * (c @ c * np.eye(3) - np.outer(c, c))
        return np.asarray(frame.axes @ own @ frame.axes.T)

    def slip(self, motions: Mapping[str, Motion], name: str) -> Slip:
        one, two = self.elements(motions, name)
        return Slip(turned(one, two)[1], gap(one, two, 2)[1], two.spin - one.spin)

    def bodies(self, motions: Mapping[str, Motion]) -> dict[str, Body]:
        found = {}
        for link in self.moving:
            motion, data = motions[link], self.links[link]
            centre, acceleration = self.centre(link, motion)
            loads = [self.load(one, motion) for one in self.data.get("loads", {}).values() if one.get("link") == link]
            free = self.line(motions, link) if link in self.free else None
            inertia = self.inertia(link, motion.frame)
            mass = float(data.get("mass", 0.0))
            found[link] = Body(mass, inertia, centre, acceleration, motion.spin, motion.spin_rate, loads, free)
        return found

    def load(self, load: Data, motion: Motion) -> Load:
        """A force at a point and a moment, in global axes or those of the link."""
        axes = motion.frame.axes if load.get("frame") == "link" else np.eye(3)
        at = np.zeros(3)
        if "at" in load:
            point = self.links[load["link"]]["points"][load["at"]]
            at = np.asarray(point["at"] if isinstance(point, dict) else point, float)
        force, moment = (axes @ np.asarray(load.get(key, np.zeros(3)), float) for key in ("force", "moment"))
        return Load(motion.frame.place + motion.frame.axes @ at, force, moment)

    def joints_at(self, motions: Mapping[str, Motion], friction: Mapping[str, Array]) -> dict[str, Joint]:
        """Joints with friction (6) and what resists in them."""
        found = {}
        for name, data in self.joint.items():
            one, two = self.elements(motions, name)
            first, second = (None if link == "ground" else link for link in data["links"])
            axes = two.frame.axes
            middle = two.frame.place + data["pin"].get("offset", 0.0) * axes[:, 2]
            slip, known = self.slip(motions, name), np.array(friction.get(name, np.zeros(6)), float)
            for load in self.data.get("loads", {}).values():
                if load.get("joint") == name:
                    known[3:] -= np.sign(slip.turn) * load.get("resisting_torque", 0.0) * axes[:, 2]
                    known[:3] -= np.sign(slip.slide) * load.get("resisting_force", 0.0) * axes[:, 2]
            z, pitch, driven = one.frame.axes[:, 2], data.get("pitch", 0.0), name in self.drivers
            found[name] = Joint(data["type"], first, second, middle, axes, z, pitch, known, driven)
        return found

    def balance(self, motions: Mapping[str, Motion], friction: Mapping[str, Array] | None = None) -> Solution:
        """Reactions and efforts with given friction (6, on the second link about the middle of the bearing)."""
        return solve(self.bodies(motions), self.joints_at(motions, friction or {}), self.gravity)

    def rub(self, motions: Mapping[str, Motion]) -> tuple[Solution, dict[str, Array]]:
        """Reactions, efforts and friction by its law."""
        rubbing = [one for name in self.joint if self.coefficient(name) for one in self.rubbing(motions, name)]
        return solve_with_friction(self.bodies(motions), self.joints_at(motions, {}), rubbing, self.gravity)

    def rubbing(self, motions: Mapping[str, Motion], name: str) -> list[Rubbing]:
        """The bearings of a joint."""
        data, f = self.joint[name], self.coefficient(name)
        kind, pin, guide = data["type"], data["pin"], data["guide"]
        _, two = self.elements(motions, name)
        z, slip, r = two.frame.axes[:, 2], self.slip(motions, name), float(pin.get("radius", 0.0))
        length = float(pin.get("bearing", pin.get("length", np.inf)))
        if kind == "spherical":
            return [against(name, lambda F, M: f * np.linalg.norm(F), spin=r * unit(slip.spin))]
        if kind in SLIDING:
            long, width = float(guide["length"]), float(guide.get("width", np.inf))
            return [
                against(
                    name, lambda F, M: f * (ends(F, M, z, long) + 2 * abs(M @ z) / width), slide=np.sign(slip.slide) * z
                )
            ]
        if kind == "helical":
            lead = data["pitch"] / (2 * np.pi * r)
            c, s = 1 / np.hypot(1, lead), lead / np.hypot(1, lead)
            sense = np.sign(slip.turn)
            return [
                against(
                    name,
                    lambda F, M: f * (abs(F @ z) / c + ends(F, M, z, length)),
                    slide=sense * s * z,
                    spin=sense * r * c * z,
                )
            ]
        if kind == "universal":
            return self._rubbing_cross(motions, name, f, r, length)
        load = upper if data["friction"].get("model") == "pezzuti" else ends
        if kind == "cylindrical" and load is upper:
            turn, slide = np.sign(slip.turn) * r * z, np.sign(slip.slide) * z
        elif kind == "cylindrical":
            v = float(np.hypot(r * slip.turn, slip.slide))
            turn, slide = r * (r * slip.turn / v) * z, slip.slide / v * z
        else:
            turn, slide = np.sign(slip.turn) * r * z, np.zeros(3)
        return [against(name, lambda F, M: f * load(F, M, z, length), slide=slide, spin=turn)]

    def _rubbing_cross(
        self, motions: Mapping[str, Motion], name: str, f: float, r: float, length: float
    ) -> list[Rubbing]:
        """A universal joint: the pins of its massless cross, each across itself loaded by the friction of the other."""
        one, two = self.elements(motions, name)
        pins, relative = (one.frame.axes[:, 2], two.frame.axes[:, 2]), two.spin - one.spin

        def pin(u: Array) -> Rubbing:
            spin = np.sign(relative @ u) * r * u
            return against(name, lambda F, M: f * ends(F, M, u, length), spin=spin, felt=True)

        return [pin(u) for u in pins]


def against(name: str, size: Any, slide: Any = NONE, spin: Any = NONE, felt: bool = False) -> Rubbing:
    """Friction of one bearing against the slip: force `slide` and moment `spin` for size 1, turned round."""
    return Rubbing(name, size, -np.concatenate([np.asarray(slide, float), np.asarray(spin, float)]), felt)


def unit(a: Array) -> Array:
    return a / np.linalg.norm(a)


def across(a: Array, u: Array) -> Array:
    return a - u * (u @ a)


def ends(F: Array, M: Array, u: Array, length: float) -> float:
    """|Q₁| + |Q₂|: the load carried at the two ends of a bearing about u."""
    half, g = across(F, u) / 2, np.cross(M, u) / length
    return float(np.linalg.norm(half - g) + np.linalg.norm(half + g))


def upper(F: Array, M: Array, u: Array, length: float) -> float:
    """|F| + 2 |M|/L across u: eqs. 17 and 19 of Pezzuti et al."""
    return float(np.linalg.norm(across(F, u)) + 2 * np.linalg.norm(across(M, u)) / length)
