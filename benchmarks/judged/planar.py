"""Is a planar result right? Joints that close, links in balance, friction by its law, powers that add up.

All from the published numbers and the model's data. The frame of a link is made of its published angle and the place of
one of its points. Every joint acts on its second link at the joint's point there, on its first with the opposite.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.judged.verdict import Array, Data, Results, Verdict, friction_of, prescribed, slope

__all__ = ["judge"]


def turned(angle: Array, v: Any) -> Array:
    """A vector of a turned frame in global axes."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * v[0] - s * v[1], s * v[0] + c * v[1]])


def quarter(v: Array) -> Array:
    """Turned by +90°."""
    return np.array([-v[1], v[0]])


def cross(a: Array, b: Array) -> Array:
    return np.asarray(a[0] * b[1] - a[1] * b[0])


def dot(a: Array, b: Array) -> Array:
    return np.asarray(a[0] * b[0] + a[1] * b[1])


def size(v: Array) -> Array:
    return np.asarray(np.hypot(v[0], v[1]))


class Planar:
    """A mechanism with its result."""

    def __init__(self, data: Data, result: Results) -> None:
        self.data, self.result = data, result
        self.links = {name: link for name, link in data["links"].items() if name != "ground"}
        self.count = len(result.status)
        self.plays = any("seat" in joint for joint in data["joints"].values())
        self.verdict = Verdict(result.status)
        self.still = np.zeros(self.count)
        self.angle, self.spin, self.spin_rate = (
            {"ground": self.still} | {name: result(f"link_angle{rate}", name) for name in self.links}
            for rate in ("", "_velocity", "_acceleration")
        )
        points = [size(self.at(link, point)) for link, body in data["links"].items() for point in body["points"]]
        self.length = np.max(points, axis=0)
        self.speed = np.max(
            [size(self.moves(link, point)) for link in self.links for point in self.points(link)], axis=0
        )
        self.pull = np.max(
            [size(self.pulls(link, point)) for link in self.links for point in self.points(link)], axis=0
        )
        # forces and moments by link: (force, moment about the link's mass centre), and the sizes of all that act
        self.force = {link: np.zeros((2, self.count)) for link in self.links}
        self.moment = {link: np.zeros(self.count) for link in self.links}
        self.largest_force = np.zeros(self.count)
        self.largest_moment = np.zeros(self.count)
        self.apart: dict[str, tuple[Array, Array]] = {}  # what pushes gears apart, as given and as wanted
        self.power = np.zeros(self.count)
        self.largest_power = np.zeros(self.count)

    # ---- motion ---------------------------------------------------------------------------------------------

    def points(self, link: str) -> dict[str, Any]:
        return dict(self.data["links"][link]["points"])

    def local(self, link: str, point: str) -> Array:
        stated = self.data["links"][link]["points"][point]
        return np.asarray(stated["at"] if isinstance(stated, dict) else stated, float)

    def at(self, link: str, point: str) -> Array:
        return self.result("point_position", f"{link}.{point}")

    def moves(self, link: str, point: str) -> Array:
        return self.result("point_velocity", f"{link}.{point}")

    def pulls(self, link: str, point: str) -> Array:
        return self.result("point_acceleration", f"{link}.{point}")

    def carried(self, link: str, local: Any) -> tuple[Array, Array, Array]:
        """Place, velocity and acceleration of a place of a link, from its first point and its angle."""
        first = next(iter(self.points(link)))
        r = turned(self.angle[link], np.asarray(local, float) - self.local(link, first))
        w, a = self.spin[link], self.spin_rate[link]
        return (
            self.at(link, first) + r,
            self.moves(link, first) + w * quarter(r),
            self.pulls(link, first) + a * quarter(r) - w**2 * r,
        )

    def rigid(self) -> None:
        """Points keep their places on their links, the ground keeps its own."""
        for link in self.data["links"]:
            for point in self.points(link):
                found = self.carried(link, self.local(link, point))
                given = self.at(link, point), self.moves(link, point), self.pulls(link, point)
                self.close(f"{link}.{point}", [a - b for a, b in zip(found, given, strict=True)])
        for point in self.points("ground"):
            off = self.at("ground", point) - self.local("ground", point)[:, None]
            self.close(f"ground.{point}", [off, self.moves("ground", point), self.pulls("ground", point)])

    def close(self, what: str, gaps: list[Array]) -> None:
        """Gaps of place, velocity and acceleration."""
        for gap, scale in zip(gaps, (self.length, self.speed, self.pull), strict=True):
            self.verdict.note("motion", what, size(gap) if np.ndim(gap) == 2 else np.abs(gap), scale)

    def joined(self) -> None:
        """Joints close, in place, velocity and acceleration."""
        for name, joint in self.data["joints"].items():
            one, two = joint["links"]
            if "seat" in joint:
                self.seated(name, joint)
            if self.plays:  # how fast seats travel is not published
                continue
            gaps = [f(two, name) - f(one, name) for f in (self.at, self.moves, self.pulls)]
            if joint["type"] == "revolute":
                self.close(name, gaps)
                self.rotation(name, one, two)
            else:
                self.slides(name, one, two, gaps)
        self.driven()

    def seated(self, name: str, joint: Data) -> None:
        """The pin of a joint touches its hole, and the loads of its ends are those of the reaction.

        Where it touches is told by the loads with the pins held (`docs/theory/joints-with-errors.md`), which are not
        published, so the direction is not judged.
        """
        one, two = joint["links"]
        offset, load = self.result("seat_offset", name), self.result("end_force", name)
        reaction = self.result("reaction_force", name)
        largest = np.max([size(self.result("reaction_force", other)) for other in self.data["joints"]], axis=0)
        if joint["type"] == "prismatic":
            radius, reach = float(joint["guide"]["clearance"]), np.max(np.abs(offset[:, 1]), axis=0)
            across = dot(reaction, self.normal(name))
            self.verdict.note("balance", name, np.sum(load[:, 1], axis=0) - across, largest)
        else:
            radius, reach = float(joint["pin"]["clearance"]), size(offset[0])
            self.verdict.note("motion", name, size(self.place(name) - self.at(one, name)), self.length)
            self.verdict.note("balance", name, size(turned(self.angle[two], load[0]) - reaction), largest)
        self.verdict.note("motion", name, reach - radius, radius)

    def normal(self, joint: str) -> Array:
        """Across a guide, by its second link."""
        two = self.data["joints"][joint]["links"][1]
        axis = turned(self.angle[two], self.data["links"][two]["points"][joint]["axis"])
        return quarter(axis / size(axis))

    def place(self, joint: str) -> Array:
        """Where a joint acts: its point on the second link; with a seat the axis of the pin there, moved by that."""
        two = self.data["joints"][joint]["links"][1]
        at = self.at(two, joint)
        if "seat" not in self.data["joints"][joint]:
            return at
        offset = self.result("seat_offset", joint)
        if self.data["joints"][joint]["type"] == "revolute":
            return np.asarray(at + turned(self.angle[two], offset[0]))
        return np.asarray(at + np.mean(offset[:, 1], axis=0) * self.normal(joint))

    def rotation(self, name: str, one: str, two: str) -> None:
        """Published rates of a joint are those of its links."""
        for rate, turn in (("_velocity", self.spin), ("_acceleration", self.spin_rate)):
            found = self.result(f"joint_rotation{rate}", name)
            scale = np.max([np.abs(n) for n in turn.values()], axis=0)
            self.verdict.note("motion", name, found - (turn[two] - turn[one]), scale)

    def slides(self, name: str, one: str, two: str, gaps: list[Array]) -> None:
        """The second point stays on the line of the first, which keeps its direction in both links."""
        axes = [turned(self.angle[link], self.data["links"][link]["points"][name]["axis"]) for link in (one, two)]
        u = axes[0] / size(axes[0])
        self.close(name, [cross(u, axes[1]) * self.length, self.still, self.still])
        for turn, scale in ((self.spin, self.speed), (self.spin_rate, self.pull)):
            self.verdict.note("motion", name, (turn[two] - turn[one]) * self.length, scale)
        w, a = self.spin[one], self.spin_rate[one]
        n = quarter(u)
        d, v, pull = gaps
        slide = dot(u, d)
        # in the axes of the first link: velocity v − ω × d, acceleration a − α × d − ω × (ω × d) − 2 ω × v_rel
        relative = v - w * quarter(d)
        second = pull - a * quarter(d) + w**2 * d - 2 * w * quarter(relative)
        self.close(name, [dot(n, d), dot(n, relative), dot(n, second)])
        for rate, found in (("", slide), ("_velocity", dot(u, relative)), ("_acceleration", dot(u, second))):
            scale = {"": self.length, "_velocity": self.speed, "_acceleration": self.pull}[rate]
            self.verdict.note("motion", name, self.result(f"joint_slide{rate}", name) - found, scale)

    def driven(self) -> None:
        """Drivers are where their laws say, gears where their ratios do."""
        for name, driver in self.data["drivers"].items():
            what = "joint_rotation" if self.data["joints"][name]["type"] == "revolute" else "joint_slide"
            q, rate, second = prescribed(driver, self.result.time)
            scales = [
                np.maximum(1.0, np.abs(n)) if what == "joint_rotation" else s
                for n, s in zip((q, rate, second), (self.length, self.speed, self.pull), strict=True)
            ]
            for suffix, wanted, scale in zip(
                ("", "_velocity", "_acceleration"), (q, rate, second), scales, strict=True
            ):
                if self.plays and suffix == "_acceleration":
                    continue  # a difference of neighbours as well
                self.verdict.note("motion", f"driver {name}", self.result(what + suffix, name) - wanted, scale)
        for gear in self.data.get("gears", {}).values():
            one, two = self.turns_first(gear)
            way, ratio = ("slide", gear["radius"]) if "radius" in gear else ("rotation", gear["ratio"])
            for rate in ("_velocity", "_acceleration"):
                a, b = self.result(f"joint_rotation{rate}", one), self.result(f"joint_{way}{rate}", two)
                self.verdict.note("motion", f"gears {one}, {two}", b - ratio * a, np.abs(ratio * a) + np.abs(b))
            off = self.result(f"joint_{way}", two) - ratio * self.result("joint_rotation", one) - gear["phase"]
            # the rotations that the results tell are known but for whole turns
            step = ratio if way == "slide" else abs(ratio) % 1
            turn = 2 * np.pi * (step if 0 < step < 1 else 1)
            scale = self.length if way == "slide" else np.maximum(1.0, np.abs(off))
            self.verdict.note("motion", f"gears {one}, {two}", (off + turn / 2) % turn - turn / 2, scale)

    # ---- forces ---------------------------------------------------------------------------------------------

    def act(self, link: str, at: Array, force: Array, moment: Array | float = 0.0, power: bool = True) -> None:
        """A force at a place and a moment, on a link."""
        if link == "ground":
            return
        centre, _, _ = self.centre(link)
        arm = at - centre
        self.force[link] = self.force[link] + force
        total = cross(arm, force) + moment
        self.moment[link] = self.moment[link] + total
        self.largest_force = np.maximum(self.largest_force, size(force))
        self.largest_moment = np.maximum(self.largest_moment, size(arm) * size(force) + np.abs(moment))

    def centre(self, link: str) -> tuple[Array, Array, Array]:
        return self.carried(link, self.data["links"][link].get("centre", (0.0, 0.0)))

    def gives(self, power: Array) -> None:
        """Power that goes into the mechanism."""
        self.power = self.power + power
        self.largest_power = np.maximum(self.largest_power, np.abs(power))

    def weights(self) -> None:
        """Gravity and inertia."""
        gravity = np.asarray(self.data.get("gravity", (0.0, 0.0)), float)[:, None]
        for link, body in self.links.items():
            mass, inertia = float(body.get("mass", 0.0)), float(body.get("inertia", 0.0))
            centre, velocity, acceleration = self.centre(link)
            if body.get("inertia_about") == "origin":
                inertia -= mass * float(np.sum(np.square(body.get("centre", (0.0, 0.0)))))
            weight = mass * gravity * np.ones(self.count)
            self.act(link, centre, weight)
            self.act(link, centre, -mass * acceleration, -inertia * self.spin_rate[link])
            self.gives(dot(weight, velocity))
            self.gives(-mass * dot(acceleration, velocity))
            self.gives(-inertia * self.spin_rate[link] * self.spin[link])

    def loads(self) -> None:
        """Forces and moments on links, and what resists in joints."""
        for load in self.data.get("loads", {}).values():
            if "joint" in load:
                self.resisting(load)
                continue
            link = load["link"]
            force = np.asarray(load.get("force", (0.0, 0.0)), float)[:, None] * np.ones(self.count)
            if load.get("frame") == "link":
                force = turned(self.angle[link], force)
            place, velocity, _ = self.carried(link, self.local(link, load["at"]) if "at" in load else (0.0, 0.0))
            moment = float(load.get("moment", 0.0)) * np.ones(self.count)
            self.act(link, place, force, moment)
            self.gives(dot(force, velocity) + moment * self.spin[link])

    def resisting(self, load: Data) -> None:
        """Against the motion of a joint, one way only if it says so."""
        name = load["joint"]
        rate = self.rate(name)
        sense = np.sign(rate)
        if "only" in load:
            sense = np.where(sense == (1 if load["only"] == "positive" else -1), sense, 0.0)
        self.in_joint(name, -sense * float(load.get("resisting_torque", load.get("resisting_force", 0.0))))

    def rate(self, joint: str) -> Array:
        turns = self.data["joints"][joint]["type"] == "revolute"
        return self.result("joint_rotation_velocity" if turns else "joint_slide_velocity", joint)

    def in_joint(self, name: str, effort: Array, gives: bool = True) -> None:
        """An effort along the freedom of a joint."""
        one, two = self.data["joints"][name]["links"]
        at = self.place(name)
        if self.data["joints"][name]["type"] == "revolute":
            for link, sign in ((two, 1), (one, -1)):
                self.act(link, at, np.zeros((2, self.count)), sign * effort)
        else:
            for link, sign in ((two, 1), (one, -1)):
                self.act(link, at, sign * effort * self.axis(name))
        if gives:
            self.gives(effort * self.rate(name))

    def axis(self, joint: str) -> Array:
        """Direction of a slide, by its first link."""
        one = self.data["joints"][joint]["links"][0]
        u = turned(self.angle[one], self.data["links"][one]["points"][joint]["axis"])
        return np.asarray(u / size(u))

    def springs(self) -> None:
        """Springs and dampers by their stiffness, length and rate."""
        for name, spring in self.data.get("springs", {}).items():
            stiffness, damping = float(spring.get("stiffness", 0.0)), float(spring.get("damping", 0.0))
            if "joint" in spring:
                turns = self.data["joints"][spring["joint"]]["type"] == "revolute"
                coordinate = self.result("joint_rotation" if turns else "joint_slide", spring["joint"])
                beyond = coordinate - spring.get("free_angle", spring.get("free_length", 0.0))
                if turns and spring["joint"] not in self.data["drivers"]:
                    beyond = (beyond + np.pi) % (2 * np.pi) - np.pi
                pull = stiffness * beyond + damping * self.rate(spring["joint"])
                self.in_joint(spring["joint"], -pull)
            else:
                ends = [end.split(".") for end in spring["between"]]
                (a, b), (va, vb) = ([f(*end) for end in ends] for f in (self.at, self.moves))
                length = size(b - a)
                u = (b - a) / length
                rate = dot(vb - va, u)
                pull = stiffness * (length - spring.get("free_length", 0.0)) + damping * rate
                self.act(ends[0][0], a, pull * u)
                self.act(ends[1][0], b, -pull * u)
                self.gives(-pull * rate)
            scale = np.nanmax(np.abs(pull), initial=0.0)
            self.verdict.note("balance", f"spring {name}", self.result("spring_force", name) - pull, scale)

    def joints(self) -> None:
        """Reactions, friction and drive efforts as published."""
        for name, joint in self.data["joints"].items():
            one, two = joint["links"]
            force = self.result("reaction_force", name)
            slides = joint["type"] == "prismatic"
            moment = self.result("reaction_moment", name)
            for link, sign in ((two, 1), (one, -1)):
                self.act(link, self.place(name), sign * force, sign * moment)
            friction = self.result("friction_force" if slides else "friction_torque", name)
            self.in_joint(name, friction, gives=False)
            self.gives(-self.result("friction_power", name))
            if name in self.data["drivers"]:
                self.in_joint(name, self.result("drive_effort", name))

    def bare(self) -> None:
        """A reaction does no work in its joint; friction only takes."""
        for name, joint in self.data["joints"].items():
            force = self.result("reaction_force", name)
            slides = joint["type"] == "prismatic"
            if slides:
                self.verdict.note("balance", name, dot(force, self.axis(name)), self.largest_force)
            else:
                self.verdict.note("balance", name, self.result("reaction_moment", name), self.largest_moment)
            friction = self.result("friction_force" if slides else "friction_torque", name)
            lost = self.result("friction_power", name)
            if self.plays:  # then it also holds what the load does on the way of the seat
                continue
            self.verdict.note("power", name, lost + friction * self.rate(name), self.largest_power)
            self.verdict.note("power", name, np.minimum(lost, 0.0), self.largest_power)

    def turns_first(self, gear: Data) -> list[str]:
        """The joints of a gear pair; of a rack that which turns comes first, however they are listed."""
        return sorted(gear["joints"], key=lambda joint: self.data["joints"][joint]["type"] == "prismatic")

    def rack(self, name: str, gear: Data) -> None:
        """The teeth of a rack press where the pinion rolls on it, inclined by the pressure angle."""
        turning, sliding = self.turns_first(gear)
        first, second = (self.data["joints"][joint]["links"] for joint in (turning, sliding))
        carrier = next(link for link in first if link in second)
        pinion, toothed = (next(link for link in pair if link != carrier) for pair in (first, second))
        u, force = self.axis(sliding), self.result("gear_force", name)  # on the rack
        sense = (1 if first[1] == pinion else -1) * (1 if second[1] == toothed else -1)
        out = -sense * quarter(u)  # from the middle of the pinion
        self.act(toothed, self.at(carrier, turning) + gear["radius"] * out, force)
        self.act(pinion, self.at(carrier, turning) + gear["radius"] * out, -force)
        angle = float(gear.get("pressure_angle", np.radians(20)))
        self.apart[f"gear {name}"] = dot(force, out), np.abs(dot(force, u)) * np.tan(angle)
        about = -gear["radius"] * cross(out, force) * (1 if first[1] == pinion else -1)
        torque = self.result("gear_torque", name)
        self.verdict.note("balance", f"gear {name}", about - torque, np.abs(torque) + size(force) * self.length)

    def gears(self) -> None:
        """Teeth press at the pitch point, inclined by the pressure angle; a train passes torques."""
        for name, gear in self.data.get("gears", {}).items():
            if "radius" in gear:
                self.rack(name, gear)
                continue
            first, second = (self.data["joints"][joint]["links"] for joint in gear["joints"])
            torque, ratio = self.result("gear_torque", name), gear["ratio"]
            nothing = np.zeros((2, self.count))
            if not gear.get("teeth", True):
                for links, moment in ((second, torque), (first, -ratio * torque)):
                    for link, sign in ((links[1], 1), (links[0], -1)):
                        self.act(link, nothing, nothing, sign * moment)
                continue
            carrier = next(link for link in first if link in second)
            wheels = [next(link for link in pair if link != carrier) for pair in (first, second)]
            centres = [self.at(carrier, joint) for joint in gear["joints"]]
            spins = [1.0, (1 if first[0] == carrier else -1) * (1 if second[0] == carrier else -1) * ratio]
            along = centres[1] - centres[0]
            pitch = centres[0] + along * spins[1] / (spins[1] - spins[0])
            force = self.result("gear_force", name)
            self.act(wheels[1], pitch, force)
            self.act(wheels[0], pitch, -force)
            u = along / size(along)
            angle = float(gear.get("pressure_angle", np.radians(20)))
            tangential, apart = dot(force, quarter(u)), dot(force, u)
            outward = (
                1.0 if spins[1] < 0 else -1.0
            )  # the second gear goes away from the first, or further into its ring
            wanted = outward * np.abs(tangential) * np.tan(angle)
            self.apart[f"gear {name}"] = apart, wanted
            about = cross(pitch - centres[1], force) * (1 if second[1] == wheels[1] else -1)
            self.verdict.note("balance", f"gear {name}", about - torque, np.abs(torque) + size(force) * size(along))

    def in_balance(self) -> None:
        """Forces and moments of every link add up to nothing."""
        for link in self.links:
            self.verdict.note("balance", link, size(self.force[link]), self.largest_force)
            self.verdict.note("balance", link, self.moment[link], self.largest_moment)
        self.verdict.note("power", "all", self.power, self.largest_power)

    def rubs(self) -> None:
        """Friction by its law from load and slip, of the largest friction there is at the position."""
        found = dict(self.apart)
        for name, joint in self.data["joints"].items():
            law = friction_of(joint, self.data.get("joint_defaults"))
            slides = joint["type"] == "prismatic"
            friction = self.result("friction_force" if slides else "friction_torque", name)
            if law is None:
                found[name] = friction, np.zeros(self.count)
                continue
            force = self.result("reaction_force", name)
            if slides:
                across = dot(force, quarter(self.axis(name)))
                couple = self.result("reaction_moment", name) / joint["guide"]["length"]
                load, lever = np.abs(across / 2 + couple) + np.abs(across / 2 - couple), 1.0
            else:
                load, lever = size(force), float(joint["pin"]["radius"])
            found[name] = friction / lever, slope(law, lever * self.rate(name)) * load
        largest = np.max([np.abs(wanted) for _, wanted in found.values()], axis=0)
        for name, (given, wanted) in found.items():
            self.verdict.note("law", name, given - wanted, largest)
        self.verdict.note_published(self.result, largest)


def judge(data: Data, result: Results) -> Verdict:
    """Every check of a planar result."""
    with np.errstate(all="ignore"):
        found = Planar(data, result)
        found.rigid()
        found.joined()
        found.weights()
        found.loads()
        found.springs()
        found.joints()
        found.gears()
        found.in_balance()
        found.bare()
        found.rubs()
    return found.verdict
