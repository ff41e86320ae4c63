"""Parts of random planar mechanisms as plain model data: drivers, groups, masses, loads, springs, friction.

A mechanism is drawn in a pose, so that it can be assembled at the start of its cycle on the branch that its hints name,
and with proportions by which most run through. Everything is a plain SI number: what is judged can be read from it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

__all__ = ["LAWS", "Data", "Plane", "friction", "unit"]

Data = dict[str, Any]
Place = np.ndarray[Any, np.dtype[np.float64]]
LAWS = ("coulomb", "coulomb", "coulomb", "viscous", "stribeck", "brown-mcphee", "rolling-bearing")
TURN = 2 * np.pi


def unit(angle: float) -> Place:
    """Unit vector."""
    return np.array([np.cos(angle), np.sin(angle)])


def friction(rng: np.random.Generator, slip: float, most: float = 1.0) -> Data:
    """A law of friction with a coefficient from 0.01 on. slip: about how fast contacts slip, m/s."""
    law = str(rng.choice(LAWS))
    f = float(10 ** rng.uniform(-2, np.log10(most)) if rng.random() < 0.7 else rng.uniform(0.1, most))
    rise, speed = float(rng.uniform(0, 0.3)) * f / slip, float(slip * 10 ** rng.uniform(-1.5, 0.5))
    static = float(min(f * rng.uniform(1, 1.6), 1.2))
    more: dict[str, Data] = {
        "coulomb": {"pair_factor": 4 / 3} if rng.random() < 0.2 else {},
        "viscous": {"viscous": rise},
        "stribeck": {"static": static, "stribeck_speed": speed, "viscous": rise},
        "brown-mcphee": {"static": static, "transition_speed": speed / 3, "viscous": rise},
        "rolling-bearing": {},
    }
    return {"law": law, "coefficient": f, **more[law]}


class Plane:
    """Links in their poses, joints at places between them, and what the model file says of them."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.size = float(10 ** rng.uniform(-2.5, 1.3))  # of the mechanism, m
        self.pace = float(10 ** rng.uniform(-0.5, 2.0)) * (1 if rng.random() < 0.5 else -1)  # of its driver, rad/s
        self.mass = float(1000 * self.size**3 * 10 ** rng.uniform(-2.5, -0.5))
        self.pose: dict[str, tuple[float, float, float]] = {"ground": (0.0, 0.0, 0.0)}
        self.data: Data = {"links": {"ground": {"points": {}}}, "joints": {}, "drivers": {}, "assembly": {}}
        slip = abs(self.pace) * self.size
        self.common = friction(rng, 0.1 * slip)
        self.slip = slip
        self.busy = True  # with loads on any link, what resists, springs
        # as mechanisms are drawn rather than found: slides through pins, guides about them, friction in guides alone
        self.clean = float(rng.choice([0.0, 0.3, 1.0]))
        self.bare_pins = rng.random() < 0.7 * self.clean + 0.1
        self.to_and_fro = rng.random() < 0.3  # of drivers over a range

    # ---- links and joints -----------------------------------------------------------------------------------

    def link(self) -> str:
        """A new link, its frame anywhere."""
        name = f"link-{len(self.pose)}"
        x, y, angle = self.rng.uniform(-1, 1, 3)
        self.pose[name] = (self.size * float(x), self.size * float(y), np.pi * float(angle))
        self.data["links"][name] = {"points": {}}
        return name

    def local(self, link: str, v: Any, free: bool = False) -> list[float]:
        """A global place, or a direction (free), in the frame of a link."""
        x, y, angle = self.pose[link]
        dx, dy = v if free else (v[0] - x, v[1] - y)
        c, s = np.cos(angle), np.sin(angle)
        return [float(c * dx + s * dy), float(c * dy - s * dx)]

    def pin(self, one: str, two: str, at: Place) -> str:
        """A revolute joint, its links named in either order."""
        name = f"J{len(self.data['joints'])}"
        first, second = (one, two) if self.rng.random() < 0.5 else (two, one)
        for link in (first, second):
            self.data["links"][link]["points"][name] = self.local(link, at)
        self.data["joints"][name] = {"type": "revolute", "links": [first, second]}
        if not self.bare_pins:
            radius = self.size * float(10 ** self.rng.uniform(-2.5, -1.3))
            self.data["joints"][name] |= {"pin": {"radius": radius}, "friction": self.rubs(pin=True)}
        return name

    def guide(self, one: str, two: str, at: Place, axis: Place, length: float = 0.0) -> str:
        """A prismatic joint whose line passes `at`, its middle within a length of it, which may be given."""
        name = f"J{len(self.data['joints'])}"
        first, second = (one, two) if self.rng.random() < 0.5 else (two, one)
        axis = axis * (1 if self.rng.random() < 0.5 else -1)
        length = length or self.size * float(10 ** self.rng.uniform(-1.0, 0.2))
        middle = at if self.rng.random() < self.clean else at + length * float(self.rng.uniform(-1.0, 1.0)) * axis
        for link, place in ((second, middle), (first, at + self.along(0.5) * axis)):
            entry = {"at": self.local(link, place), "axis": self.local(link, axis, free=True)}
            self.data["links"][link]["points"][name] = entry
        self.data["joints"][name] = {"type": "prismatic", "links": [first, second], "guide": {"length": length}}
        self.data["joints"][name]["friction"] = self.rubs()
        return name

    def rubs(self, pin: bool = False) -> Data | float:
        """Friction of a joint: the mechanism's, one of its own, now and then none."""
        chance = self.rng.random()
        if chance < 0.1:
            return 0.0
        found = friction(self.rng, 0.1 * self.slip) if chance < 0.3 else dict(self.common)
        if not pin and found["law"] == "rolling-bearing":
            return float(found["coefficient"])
        return found

    # ---- what drives ----------------------------------------------------------------------------------------

    def crank(self, radius: float, swing: bool = False) -> tuple[str, Place]:
        """A crank on the ground about the origin and the place of its pin; it swings if `swing`, else it may."""
        link, angle = self.link(), self.direction()
        joint = self.pin("ground", link, np.zeros(2))
        if swing or self.rng.random() < 0.15:
            self.drive(joint, float(self.rng.uniform(0.1, 0.5)))
        else:
            self.data["drivers"][joint] = {"speed": self.pace, "start": self.coordinate(joint)}
        return link, self.size * radius * unit(angle)

    def drive(self, joint: str, extent: float) -> None:
        """Move a joint from where it stands over a range (rad, or of the size), all drivers in the same time."""
        extent *= 1.0 if self.data["joints"][joint]["type"] == "revolute" else self.size
        start = self.coordinate(joint)
        if self.to_and_fro:
            phase, period = float(self.rng.uniform(0.03, 0.2)), TURN / abs(self.pace)
            mean = start - extent * float(np.sin(phase))
            stated: Data = {"law": "harmonic", "mean": mean, "amplitude": extent, "period": period, "phase": phase}
        else:
            extent *= float(np.sign(self.pace))
            stated = {"speed": extent * abs(self.pace) / 0.3, "range": [start, start + extent]}
        self.data["drivers"][joint] = stated

    def coordinate(self, joint: str) -> float:
        """Rotation or slide of a joint as it is drawn."""
        first, second = self.data["joints"][joint]["links"]
        if self.data["joints"][joint]["type"] == "revolute":
            turn = self.pose[second][2] - self.pose[first][2]
            return float(np.arctan2(np.sin(turn), np.cos(turn)))
        points = [self.data["links"][link]["points"][joint] for link in (first, second)]
        ends = [self.placed(link, np.array(point["at"])) for link, point in zip((first, second), points, strict=True)]
        tip = self.placed(first, np.array(points[0]["axis"])) - self.placed(first, np.zeros(2))
        return float((ends[1] - ends[0]) @ tip)

    # ---- groups ---------------------------------------------------------------------------------------------

    def rrr(self, base: str, b: Place, other: str, reach: float) -> list[str]:
        """Two rods with a pin between them. reach: distance of the outer pins."""
        towards = self.direction()
        d = b + reach * unit(towards)
        angle = float(self.rng.uniform(0.9, 1.9))  # between the rods
        share = float(self.rng.uniform(0.7, 1.3))
        length = reach / np.sqrt(1 + share**2 - 2 * share * np.cos(angle))
        at_b = np.arctan2(share * np.sin(angle), 1 - share * np.cos(angle))
        c = b + length * unit(towards + at_b * (1 if self.rng.random() < 0.5 else -1))
        one, two = self.link(), self.link()
        for pair in ((base, one, b), (one, two, c), (two, other, d)):
            self.pin(*pair)
        return [one, two]

    def rrp(self, base: str, b: Place, other: str, reach: float, offset: bool = True) -> list[str]:
        """A rod and a slider."""
        towards = self.direction()
        lean = float(self.rng.uniform(-0.5, 0.5)) if offset else 0.0
        p = b + reach * unit(towards + lean)
        aside = self.aside(0.3) if offset else 0.0
        rod, slider = self.link(), self.link()
        self.pin(base, rod, b)
        self.pin(rod, slider, p)
        axis = unit(towards)
        self.guide(slider, other, p + aside * np.array([-axis[1], axis[0]]), axis)
        return [rod, slider]

    def rpr(self, base: str, b: Place, other: str, reach: float) -> list[str]:
        """A block that slides on a swinging arm."""
        towards = self.direction()
        d = b + reach * unit(towards)
        axis = unit(towards + float(self.rng.uniform(-0.3, 0.3)))
        aside = self.aside(0.15)
        block, arm = self.link(), self.link()
        self.pin(base, block, b)
        at = b + aside * np.array([-axis[1], axis[0]])
        self.guide(block, arm, at, axis, self.size * float(self.rng.uniform(0.15, 0.8)))
        self.pin(arm, other, d)
        return [block, arm]

    def rpp(self, base: str, b: Place, other: str, reach: float) -> list[str]:
        """A block in the slot of a yoke that slides."""
        towards = self.direction()
        slot, guide = unit(towards), unit(towards + float(self.rng.uniform(1.0, 2.1)))
        block, yoke = self.link(), self.link()
        self.pin(base, block, b)
        self.guide(block, yoke, b, slot)
        self.guide(yoke, other, b, guide)
        return [block, yoke]

    def prp(self, base: str, b: Place, other: str, reach: float) -> list[str]:
        """A slide on the base, pinned to a slide on the other link."""
        towards = self.direction()
        one, two = unit(towards), unit(towards + float(self.rng.uniform(0.9, 2.2)))
        block, slider = self.link(), self.link()
        self.guide(base, block, b, one)
        self.pin(block, slider, b)
        self.guide(slider, other, b, two)
        return [block, slider]

    def triad(self, base: str, b: Place, reach: float) -> list[str]:
        """A ternary link on three rods, or two rods and a slider, to the base and twice to the ground."""
        plate = self.link()
        turn = self.direction()
        middle = b + reach * unit(turn)
        found = []
        slider = int(self.rng.integers(1, 3)) if self.rng.random() < 0.4 else 0
        for k, lean in enumerate((np.pi, -np.pi / 3, np.pi / 3)):
            angle = turn + lean + float(self.rng.uniform(-0.3, 0.3))
            corner = middle + 0.45 * reach * unit(angle) * float(self.rng.uniform(0.7, 1.2))
            # the lines of the rods must not meet in one point
            way = unit(angle + float(self.rng.uniform(0.5, 0.9)))
            rod = self.link()
            found.append(rod)
            self.pin(plate, rod, corner)
            if k == 0:
                self.pin(base, rod, b)
            elif k == slider:
                self.guide(rod, "ground", corner, np.array([-way[1], way[0]]))
            else:
                self.pin(rod, "ground", corner + reach * float(self.rng.uniform(0.7, 1.2)) * way)
        return [*found, plate]

    def direction(self) -> float:
        """An angle, rad."""
        return float(self.rng.uniform(-np.pi, np.pi))

    def aside(self, share: float) -> float:
        """A random distance, now and then none, m."""
        return 0.0 if self.rng.random() < self.clean else self.along(share)

    def along(self, share: float) -> float:
        """A random distance, m."""
        return self.size * float(self.rng.uniform(-share, share))

    # ---- what acts ------------------------------------------------------------------------------------------

    def loaded(self) -> None:
        """Masses, gravity, forces, moments, what resists in joints, springs and dampers."""
        rng = self.rng
        if rng.random() < 0.7:
            self.data["gravity"] = [float(n) for n in rng.normal(0, 6, 2)]
        else:
            self.data["gravity"] = [0.0, 0.0]
        force = self.mass * self.size * self.pace**2 * float(10 ** rng.uniform(-1.5, 1.5))
        loads: Data = self.data.get("loads", {})
        moving = [link for link in self.pose if link != "ground"]
        for link in moving:
            self.weigh(link)
        for link in moving:
            if self.busy and (rng.random() < 0.5 or link == moving[-1]):
                self.push(loads, link, force)
        if self.busy:
            self.resist(loads, force)
        self.data["loads"] = loads
        if self.busy and rng.random() < 0.3:
            self.data["springs"] = self.springs(force)
        for link in moving:
            for name, point in list(self.data["links"][link]["points"].items())[:2]:
                at = np.array(point["at"] if isinstance(point, dict) else point)
                self.data["assembly"][f"{link}.{name}"] = [float(n) for n in self.placed(link, at)]

    def placed(self, link: str, at: Place) -> Place:
        """A place of a link's frame in the plane."""
        x, y, angle = self.pose[link]
        c, s = np.cos(angle), np.sin(angle)
        return np.array([x + c * at[0] - s * at[1], y + s * at[0] + c * at[1]])

    def weigh(self, link: str) -> None:
        """Mass and inertia, about the centre or the origin; some links have none, some are points."""
        rng, chance = self.rng, self.rng.random()
        if chance < 0.1:
            return
        mass = self.mass * float(10 ** rng.uniform(-1, 0.5))
        centre = [float(n) for n in rng.uniform(-0.5, 0.5, 2) * self.size]
        inertia = mass * self.size**2 * float(rng.uniform(0.02, 0.3))
        self.data["links"][link] |= {"mass": mass, "centre": centre}
        if chance < 0.2:
            about = mass * (centre[0] ** 2 + centre[1] ** 2)
            self.data["links"][link] |= {"inertia": inertia + about, "inertia_about": "origin"}
        elif chance < 0.95:
            self.data["links"][link]["inertia"] = inertia

    def push(self, loads: Data, link: str, force: float) -> None:
        """A force at a point of a link and a moment, in global axes or the link's."""
        rng = self.rng
        points = self.data["links"][link]["points"]
        points["T"] = [float(n) for n in self.local(link, self.placed(link, np.zeros(2)) + self.at_random())]
        load: Data = {"link": link, "at": "T", "force": [float(n) for n in rng.normal(0, force, 2)]}
        if rng.random() < 0.3:
            load["frame"] = "link"
        if rng.random() < 0.4:
            load["moment"] = float(rng.normal(0, force * self.size))
        loads[f"on {link}"] = load

    def at_random(self) -> Place:
        return np.array(self.rng.uniform(-0.5, 0.5, 2) * self.size)

    def resist(self, loads: Data, force: float) -> None:
        """Now and then what opposes the motion of the last joint."""
        rng = self.rng
        free = [name for name in self.data["joints"] if name not in self.data["drivers"]]
        if rng.random() < 0.6 or not free:
            return
        joint = free[-1]
        turns = self.data["joints"][joint]["type"] == "revolute"
        size = float(abs(rng.normal(0, force)))
        load: Data = {"joint": joint, "useful": True}
        load |= {"resisting_torque": size * self.size} if turns else {"resisting_force": size}
        if rng.random() < 0.3:
            load["only"] = str(rng.choice(["positive", "negative"]))
        loads["work"] = load

    def springs(self, force: float) -> Data:
        """A spring between two points or in a joint, some with a damper."""
        rng = self.rng
        stiffness, damping = force / self.size, force / (self.size * abs(self.pace)) * float(rng.uniform(0, 0.5))
        if rng.random() < 0.6:
            link = str(rng.choice([link for link in self.pose if link != "ground"]))
            point = str(rng.choice(list(self.data["links"][link]["points"])))
            far = 2.5 * self.size * unit(self.direction())
            self.data["links"]["ground"]["points"]["hook"] = [float(n) for n in far]
            ends = ["ground.hook", f"{link}.{point}"]
            spring: Data = {"between": ends if rng.random() < 0.5 else ends[::-1], "free_length": self.size}
        else:
            name = str(rng.choice(list(self.data["joints"])))
            turns = self.data["joints"][name]["type"] == "revolute"
            free = float(rng.uniform(-0.5, 0.5))
            lever = self.size**2 if turns else 1.0
            stiffness, damping = stiffness * lever, damping * lever
            spring = {"joint": name, **({"free_angle": free} if turns else {"free_length": free * self.size})}
        return {"spring": {**spring, "stiffness": stiffness, "damping": damping}}
