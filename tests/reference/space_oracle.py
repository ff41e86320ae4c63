"""Forces of a spatial mechanism of plain data: loads and contacts of the model handed to the Newton–Euler equations.

Friction is by the formulas of the documentation, written here once more from the picture of two contacts at the ends
of a bearing: Pezzuti et al. (2006), eqs. 15–19, and the vector sum in its place.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from reference.maximal_space import SLIDING, Array, Data, Frame, Linkage, Motion, gap, turned
from reference.newton_euler import Body, Joint, Load, Rubbing, Solution, solve_with_friction

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
            _, two = self.elements(motions, name)
            first, second = (None if link == "ground" else link for link in data["links"])
            axes = two.frame.axes
            middle = two.frame.place + data["pin"].get("offset", 0.0) * axes[:, 2]
            slip, known = self.slip(motions, name), np.array(friction.get(name, np.zeros(6)), float)
            for load in self.data.get("loads", {}).values():
                if load.get("joint") == name:
                    known[3:] -= np.sign(slip.turn) * load.get("resisting_torque", 0.0) * axes[:, 2]
                    known[:3] -= np.sign(slip.slide) * load.get("resisting_force", 0.0) * axes[:, 2]
            found[name] = Joint(data["type"], first, second, middle, axes, known, name in self.drivers)
        return found

    def rub(self, motions: Mapping[str, Motion]) -> tuple[Solution, dict[str, Array]]:
        """Reactions, efforts and friction by its law."""
        rubbing = [self.rubbing(motions, name) for name in self.joint if self.coefficient(name)]
        return solve_with_friction(self.bodies(motions), self.joints_at(motions, {}), rubbing, self.gravity)

    def rubbing(self, motions: Mapping[str, Motion], name: str) -> Rubbing:
        """Friction against the slip: of a ball by its load, of a bearing or a guide by the loads of its two ends."""
        kind, f, slip = self.joint[name]["type"], self.coefficient(name), self.slip(motions, name)
        part = self.joint[name]["guide" if kind in SLIDING else "pin"]
        r, length = float(part.get("radius", 0.0)), float(part.get("bearing", part.get("length", np.inf)))
        z = self.elements(motions, name)[1].frame.axes[:, 2]
        if kind == "spherical":
            spin = r * slip.spin / np.linalg.norm(slip.spin)
            return Rubbing(name, lambda F, M: f * float(np.linalg.norm(F)), -np.append(np.zeros(3), spin))
        turn, slide = r * np.sign(slip.turn), 0.0
        if kind in SLIDING:
            turn, slide = 0.0, np.sign(slip.slide)
        elif kind == "cylindrical":
            v = np.hypot(r * slip.turn, slip.slide)
            turn, slide = r * r * slip.turn / v, slip.slide / v
        return Rubbing(name, lambda F, M: f * ends(F, M, z, length), -np.append(slide * z, turn * z))


def ends(F: Array, M: Array, u: Array, length: float) -> float:
    """|Q₁| + |Q₂|: the load carried at the two ends of a bearing about u."""
    half, g = (F - u * (u @ F)) / 2, np.cross(M, u) / length
    return float(np.linalg.norm(half - g) + np.linalg.norm(half + g))
