"""Is a spatial result right? Pairs that close, links in balance, friction by its law, powers that add up.

All from the published numbers and the model's data. Frames of links are their published places and quaternions. What a
joint transmits acts on its second link about the middle of its bearing, the opposite on the first.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.judged.elements import (
    AXES,
    MATRIX,
    SQUARE,
    Element,
    along,
    carried_at_ends,
    cosine,
    cross,
    dot,
    element,
    matrix,
    size,
    unrolled,
)
from benchmarks.judged.verdict import Array, Data, Results, Verdict, friction_of, prescribed, slope

__all__ = ["judge"]


class Spatial:
    """A mechanism with its result."""

    def __init__(self, data: Data, result: Results) -> None:
        self.data, self.result = data, result
        self.count = len(result.status)
        self.verdict = Verdict(result.status)
        self.bodies: dict[str, Data] = dict(data["links"])
        if "loop" in data:
            self.joints, self.local = unrolled(data)
            for row in data["loop"]:
                self.bodies.setdefault(row["link"], {})
        else:
            self.joints = dict(data["joints"])
            self.local = {
                (link, name): element(self.bodies[link]["points"][name])
                for name, joint in self.joints.items()
                for link in joint["links"]
            }
        self.links = [link for link in self.bodies if link != "ground"]
        still = np.zeros((3, self.count))
        self.still = still
        self.axes = {"ground": np.eye(3)[:, :, None] * np.ones(self.count)}
        self.spin, self.rate = {"ground": still}, {"ground": still}
        for link in self.links:
            self.axes[link] = matrix(result("link_rotation", link))
            self.spin[link] = result("link_angular_velocity", link)
            self.rate[link] = result("link_angular_acceleration", link)
        self.scales()
        self.force = dict.fromkeys(self.links, still)
        self.moment = dict.fromkeys(self.links, still)
        self.largest_force, self.largest_moment = np.zeros(self.count), np.zeros(self.count)
        self.power, self.largest_power = np.zeros(self.count), np.zeros(self.count)

    # ---- motion ---------------------------------------------------------------------------------------------

    def scales(self) -> None:
        """The largest places, velocities and accelerations of points, and rates of links."""
        points = [
            (link, name)
            for link in self.bodies
            for name in [*self.bodies[link].get("points", {}), *(j for (owner, j) in self.local if owner == link)]
        ]
        self.points = list(dict.fromkeys(points))
        self.length, self.speed, self.pull = (
            np.max([size(self.published(kind, *point)) for point in self.points], axis=0)
            for kind in ("position", "velocity", "acceleration")
        )
        self.pace = np.max([size(w) for w in self.spin.values()], axis=0)
        self.jerk = np.max([size(w) for w in self.rate.values()] + [self.pace**2], axis=0)
        self.speed = np.maximum(self.speed, self.pace * self.length)
        self.pull = np.maximum(self.pull, self.jerk * self.length)

    def published(self, kind: str, link: str, point: str) -> Array:
        return self.result(f"point_{kind}", f"{link}.{point}")

    def place_of(self, link: str, point: str) -> Array:
        """In the link's frame."""
        if (link, point) in self.local:
            return self.local[link, point][0]
        stated = self.bodies[link]["points"][point]
        return np.asarray(stated["at"] if isinstance(stated, dict) else stated, float)

    def turned(self, link: str, v: Any) -> Array:
        """A vector of a link in global axes."""
        return np.asarray(np.tensordot(np.asarray(v, float), self.axes[link], axes=(0, 0)))

    def carried(self, link: str, local: Any) -> tuple[Array, Array, Array]:
        """Place, velocity and acceleration of a place of a link, from its frame and one of its points."""
        point = next(name for owner, name in self.points if owner == link)
        r = self.turned(link, np.asarray(local, float) - self.place_of(link, point))
        w = self.spin[link]
        return (
            self.published("position", link, point) + r,
            self.published("velocity", link, point) + cross(w, r),
            self.published("acceleration", link, point) + cross(self.rate[link], r) + cross(w, cross(w, r)),
        )

    def rigid(self) -> None:
        """Points keep their places on their links."""
        for link, point in self.points:
            found = self.carried(link, self.place_of(link, point))
            kinds = ("position", "velocity", "acceleration")
            for kind, one, scale in zip(kinds, found, (self.length, self.speed, self.pull), strict=True):
                self.verdict.note("motion", f"{link}.{point}", size(one - self.published(kind, link, point)), scale)
            if link == "ground":
                off = self.published("position", link, point) - self.place_of(link, point)[:, None]
                self.verdict.note("motion", f"{link}.{point}", size(off), self.length)
            else:
                origin = self.result("link_position", link) + self.turned(link, self.place_of(link, point))
                self.verdict.note("motion", f"{link}.{point}", size(origin - found[0]), self.length)

    def element(self, link: str, joint: str) -> Element:
        place, axes = self.local[link, joint]
        turned = np.array([self.turned(link, axis) for axis in axes])
        return Element(turned, *self.carried(link, place), self.spin[link], self.rate[link])

    def joined(self) -> None:
        """Pairs close, in place, velocity and acceleration."""
        self.ends = {
            name: tuple(self.element(link, name) for link in joint["links"]) for name, joint in self.joints.items()
        }
        for name, joint in self.joints.items():
            one, two = self.ends[name]
            kind = joint["type"]
            for k in AXES.get(kind, (0, 1, 2)):
                for gap, scale in zip(along(one, two, k), (self.length, self.speed, self.pull), strict=True):
                    self.verdict.note("motion", name, gap, scale)
            for i, k in SQUARE[kind]:
                for gap, scale in zip(cosine(one, two, i, k), (1.0, self.pace, self.jerk), strict=True):
                    self.verdict.note("motion", name, gap, scale)
            self.rates(name, kind, one, two)
        self.driven()

    def rates(self, name: str, kind: str, one: Element, two: Element) -> None:
        """Published rates of a joint are those of its elements; a thread slides as it turns."""
        slide = along(one, two, 2)
        z, dz, _ = one.vector(2)
        relative, change = two.spin - one.spin, two.spin_rate - one.spin_rate
        turn = dot(z, relative), dot(dz, relative) + dot(z, change)
        if kind in ("revolute", "cylindrical", "helical", "prismatic"):
            for what, found, scale in (
                ("joint_slide", slide[0], self.length),
                ("joint_slide_velocity", slide[1], self.speed),
                ("joint_slide_acceleration", slide[2], self.pull),
                ("joint_rotation_velocity", turn[0], self.pace),
                ("joint_rotation_acceleration", turn[1], self.jerk),
            ):
                self.verdict.note("motion", name, self.result(what, name) - found, scale)
        if kind == "helical":
            lead = self.joints[name]["pitch"] / (2 * np.pi)
            x, y = one.axes[0], one.axes[1]
            angle = np.arctan2(dot(y, two.axes[0]), dot(x, two.axes[0]))
            off = (slide[0] / lead - angle + np.pi) % (2 * np.pi) - np.pi
            self.verdict.note("motion", name, off * lead, self.length)
            self.verdict.note("motion", name, slide[1] - lead * turn[0], self.speed)
            self.verdict.note("motion", name, slide[2] - lead * turn[1], self.pull)

    def driven(self) -> None:
        """Drivers are where their laws say."""
        for name, driver in self.data["drivers"].items():
            slides = self.joints[name]["type"] == "prismatic"
            scales = (
                (self.length, self.speed, self.pull)
                if slides
                else (np.maximum(1.0, self.pace * 0), self.pace, self.jerk)
            )
            what = "joint_slide" if slides else "joint_rotation"
            wanted = prescribed(driver, self.result.time)
            for suffix, value, scale in zip(("", "_velocity", "_acceleration"), wanted, scales, strict=True):
                off = self.result(what + suffix, name) - value
                self.verdict.note("motion", f"driver {name}", off, scale + (np.abs(value) if suffix == "" else 0.0))
            one, two = self.ends[name]
            if not slides:
                angle = np.arctan2(dot(one.axes[1], two.axes[0]), dot(one.axes[0], two.axes[0]))
                off = (angle - wanted[0] + np.pi) % (2 * np.pi) - np.pi
                self.verdict.note("motion", f"driver {name}", off, 1.0 + np.abs(wanted[0]))

    # ---- forces ---------------------------------------------------------------------------------------------

    def centre(self, link: str) -> tuple[Array, Array, Array]:
        return self.carried(link, self.bodies[link].get("centre", np.zeros(3)))

    def act(self, link: str, at: Array, force: Array, moment: Array) -> None:
        """A force at a place and a moment, on a link."""
        if link == "ground":
            return
        arm = at - self.centre(link)[0]
        self.force[link] = self.force[link] + force
        self.moment[link] = self.moment[link] + moment + cross(arm, force)
        self.largest_force = np.maximum(self.largest_force, size(force))
        self.largest_moment = np.maximum(self.largest_moment, size(arm) * size(force) + size(moment))

    def between(self, joint: str, force: Array, moment: Array) -> None:
        """On the second link of a joint, about the middle of its bearing, and the opposite on the first."""
        one, two = self.joints[joint]["links"]
        middle = self.middle(joint)
        self.act(two, middle, force, moment)
        self.act(one, middle, -force, -moment)

    def middle(self, joint: str) -> Array:
        second = self.ends[joint][1]
        offset = float(self.joints[joint].get("pin", {}).get("offset", 0.0))
        return np.asarray(second.place + offset * second.axes[2])

    def slips(self, joint: str) -> tuple[Array, Array]:
        """Velocity of the second link against the first in the middle of the bearing, and relative spin."""
        one, two = self.ends[joint]
        middle = self.middle(joint)
        moves = [e.velocity + cross(e.spin, middle - e.place) for e in (one, two)]
        return moves[1] - moves[0], two.spin - one.spin

    def gives(self, power: Array) -> None:
        self.power = self.power + power
        self.largest_power = np.maximum(self.largest_power, np.abs(power))

    def weights(self) -> None:
        """Gravity, inertia and the gyroscopic moment."""
        gravity = np.asarray(self.data.get("gravity", np.zeros(3)), float)[:, None]
        for link in self.links:
            body, mass = self.bodies[link], float(self.bodies[link].get("mass", 0.0))
            place, velocity, acceleration = self.centre(link)
            stated = body.get("inertia", {})
            own = np.array([[float(stated.get(key, 0.0)) for key in row] for row in MATRIX])
            if body.get("inertia_about") == "origin":
                c = np.asarray(body["centre"], float)
                own = own - mass * (c @ c * np.eye(3) - np.outer(c, c))
            axes, w, a = self.axes[link], self.spin[link], self.rate[link]
            about_w, about_a = (np.einsum("iap,ij,jbp,bp->ap", axes, own, axes, v) for v in (w, a))
            moment = -(about_a + cross(w, about_w))
            self.act(link, place, mass * gravity + self.still, self.still)
            self.act(link, place, -mass * acceleration, moment)
            for power in (mass * dot(gravity, velocity), -mass * dot(acceleration, velocity), dot(moment, w)):
                self.gives(power)

    def loads(self) -> None:
        """Forces and moments on links, and what resists in joints."""
        for load in self.data.get("loads", {}).values():
            if "joint" in load:
                self.resisting(load)
                continue
            link = load["link"]
            force, moment = (np.asarray(load.get(key, np.zeros(3)), float) for key in ("force", "moment"))
            if load.get("frame") == "link":
                force, moment = self.turned(link, force), self.turned(link, moment)
            else:
                force, moment = force[:, None] + self.still, moment[:, None] + self.still
            place, velocity, _ = self.carried(link, self.place_of(link, load["at"]) if "at" in load else np.zeros(3))
            self.act(link, place, force, moment)
            self.gives(dot(force, velocity) + dot(moment, self.spin[link]))

    def resisting(self, load: Data) -> None:
        name = load["joint"]
        if "resisting_torque" in load:
            self.in_joint(
                name, -np.sign(self.result("joint_rotation_velocity", name)) * load["resisting_torque"], False
            )
        else:
            self.in_joint(name, -np.sign(self.result("joint_slide_velocity", name)) * load["resisting_force"], True)

    def in_joint(self, name: str, effort: Array, slides: bool) -> None:
        """An effort about or along the axis of a joint."""
        z = self.ends[name][1].axes[2]
        velocity, spin = self.slips(name)
        self.between(name, effort * z if slides else self.still, self.still if slides else effort * z)
        self.gives(effort * dot(z, velocity if slides else spin))

    def pairs(self) -> None:
        """Reactions, friction and drive efforts as published."""
        losses = []
        for name, joint in self.joints.items():
            z = self.ends[name][1].axes[2]
            velocity, spin = self.slips(name)
            force, moment = self.result("reaction_force", name), self.result("reaction_moment", name)
            self.between(name, force, moment)
            rub, rub_moment = self.result("friction_force", name) * z, self.result("friction_moment", name)
            self.between(name, rub, rub_moment)
            lost = self.result("friction_power", name)
            self.gives(-lost)
            taken = -(dot(rub, velocity) + dot(rub_moment, spin))
            self.verdict.note(
                "power", name, lost - taken, np.abs(taken) + size(rub) * size(velocity) + size(rub_moment) * size(spin)
            )
            losses.append((name, lost))
            if name in self.data["drivers"]:
                self.in_joint(name, self.result("drive_effort", name), joint["type"] == "prismatic")
        for name, lost in losses:  # friction only takes
            self.verdict.note("power", name, np.minimum(lost, 0.0), self.largest_power)

    def bare(self) -> None:
        """A reaction does no work in its joint."""
        for name, joint in self.joints.items():
            one, two = self.ends[name]
            kind, z = joint["type"], two.axes[2]
            force, moment = self.result("reaction_force", name), self.result("reaction_moment", name)
            forces, moments = [], []
            if kind in ("cylindrical", "prismatic"):
                forces.append(dot(force, z))
            if kind in ("revolute", "cylindrical", "planar"):
                moments.append(dot(moment, z))
            if kind == "spherical":
                moments.append(size(moment))
            if kind == "universal":
                moments += [dot(moment, one.axes[2]), dot(moment, z)]
            if kind == "planar":
                forces += [dot(force, axis) for axis in two.axes[:2]]
            if kind == "helical":
                moments.append(dot(moment, z) + joint["pitch"] / (2 * np.pi) * dot(force, z))
            # of a shaft under great torques and small forces the rounding is that of the torques
            scale = np.maximum(self.largest_force, self.largest_moment / self.length)
            for part in forces:
                self.verdict.note("balance", name, part, scale)
            for part in moments:
                self.verdict.note("balance", name, part, self.largest_moment)

    def in_balance(self) -> None:
        """Forces and moments of every link add up to nothing, but about the line of a spin that nothing holds."""
        for link in self.links:
            moment = self.moment[link]
            balls = [name for name, joint in self.joints.items() if link in joint["links"]]
            if len(balls) == 2 and all(self.joints[name]["type"] == "spherical" for name in balls):
                a, b = (self.published("position", link, name) for name in balls)
                u = (b - a) / size(b - a)
                moment = moment - dot(moment, u) * u
            self.verdict.note("balance", link, size(self.force[link]), self.largest_force)
            self.verdict.note("balance", link, size(moment), self.largest_moment)
        self.verdict.note("power", "all", self.power, self.largest_power)

    # ---- friction -------------------------------------------------------------------------------------------

    def rubs(self) -> None:
        """Friction by its law, in forces at the contacts: of all joints the published and that from loads and slips."""
        found: list[tuple[str, Array, Array, float]] = []
        for name, joint in self.joints.items():
            given = self.result("friction_force", name), self.result("friction_moment", name)
            law = friction_of(joint, self.data.get("joint_defaults"))
            lever = float(joint.get("pin", {}).get("radius", 1.0))
            wanted = (np.zeros(self.count), self.still) if law is None else self.wanted(name, joint, law)
            found.append(
                (name, np.array([given[0], *(given[1] / lever)]), np.array([wanted[0], *(wanted[1] / lever)]), lever)
            )
        largest = np.max([np.sqrt(np.sum(wanted**2, axis=0)) for _, _, wanted, _ in found], axis=0)
        self.verdict.note_published(self.result, largest)
        for name, given, wanted, _ in found:
            self.verdict.note("law", name, np.sqrt(np.sum((given - wanted) ** 2, axis=0)), largest)

    def wanted(self, name: str, joint: Data, law: Data) -> tuple[Array, Array]:
        """Friction force along z and friction moment that the law asks for."""
        one, two = self.ends[name]
        kind, z = joint["type"], two.axes[2]
        force, moment = self.result("reaction_force", name), self.result("reaction_moment", name)
        velocity, spin = self.slips(name)
        slide, turn = dot(z, velocity), dot(z, spin)
        none = np.zeros(self.count)
        if kind in ("planar", "fixed"):
            return none, self.still
        if kind == "prismatic":
            guide = joint["guide"]
            load = carried_at_ends(force, moment, z, guide["length"], law)
            if "width" in guide:
                load = load + 2 * np.abs(dot(moment, z)) / guide["width"]
            return slope(law, slide) * load, self.still
        r = float(joint["pin"]["radius"])
        if kind == "spherical":
            speed = size(spin)
            way = np.where(speed > 0, spin / np.where(speed > 0, speed, 1.0), 0.0)
            return none, slope(law, r * speed) * r * size(force) * way
        length = joint["pin"]["bearing"]
        if kind == "universal":
            total = moment + self.result("friction_moment", name)  # each pin carries the friction of the other
            return none, sum(
                (
                    slope(law, r * dot(spin, u)) * r * carried_at_ends(force, total, u, length, law) * u
                    for u in (one.axes[2], z)
                ),
                self.still,
            )
        load = carried_at_ends(force, moment, z, length, law)
        if kind == "revolute":
            return none, slope(law, r * turn) * r * load * z
        if kind == "helical":
            lead = joint["pitch"] / (2 * np.pi)
            way = float(np.hypot(r, lead))
            load = load + np.abs(dot(force, z)) * way / r
            push = slope(law, way * turn) * load
            return push * lead / way, push * r / way * r * z
        if law.get("model") == "pezzuti":
            return slope(law, slide) * load, slope(law, r * turn) * r * load * z
        speed = np.hypot(r * turn, slide)
        push = slope(law, speed) * load
        return push * slide / speed, push * r * turn / speed * r * z


def judge(data: Data, result: Results) -> Verdict:
    """Every check of a spatial result."""
    with np.errstate(all="ignore"):
        found = Spatial(data, result)
        found.rigid()
        found.joined()
        found.weights()
        found.loads()
        found.pairs()
        found.in_balance()
        found.bare()
        found.rubs()
    return found.verdict
