"""Random spatial mechanisms as plain model data: chains of any pairs drawn in a pose, cranks that turn fully, shafts.

A chain is drawn assembled: links and joints lie anywhere, each joint's second element where a random motion of its pair
takes it. Its driver goes a short way from there. Linkages with a crank, Cardan joints as built and spherical four-bars
turn fully. Everything is a plain SI number.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.drawn.plane import friction

__all__ = ["FAMILIES", "drawn"]

Data = dict[str, Any]
Array = NDArray[np.float64]
Frame = tuple[Array, Array]  # place and axes as columns
KINDS = {
    "R": "revolute",
    "P": "prismatic",
    "C": "cylindrical",
    "S": "spherical",
    "U": "universal",
    "H": "helical",
    "E": "planar",
    "F": "fixed",
}
TENSOR = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
CHAINS = ("RSSR", "RSSP", "RCCC", "RRRSR", "RSUR", "RSSH", "HUSR", "PSUR", "RUSP", "CRSR", "RECR", "RSFRC", "RRRRRRR")
FAMILIES = {
    **dict.fromkeys(CHAINS, 1),
    "two loops": 1,
    "two RSSR": 1,
    "crank RSSR": 4,
    "crank RSSP": 3,
    "Cardan": 5,
    "spherical four-bar": 3,
}
TWO_LOOPS = {"A": "R 0 1", "B": "S 1 2", "C": "U 2 3", "D": "C 0 3", "E": "S 4 2", "F": "C 4 0"}
TWO_RSSR = {"A": "R 0 1", "B": "S 1 2", "C": "S 2 3", "D": "R 3 0", "E": "S 3 4", "F": "S 5 4", "G": "R 0 5"}


def turn(axis: Any, angle: float) -> Array:
    """Rotation about an axis."""
    u = np.asarray(axis, float) / np.linalg.norm(axis)
    skew = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew)


def product(one: Frame, two: Frame) -> Frame:
    return one[0] + one[1] @ two[0], one[1] @ two[1]


def within(outer: Frame, frame: Frame) -> Frame:
    """A frame in the axes of another."""
    return outer[1].T @ (frame[0] - outer[0]), outer[1].T @ frame[1]


def numbers(v: Any) -> list[float]:
    return [float(n) for n in v]


class Space:
    """A mechanism in the making; lengths in its size."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.size = float(10 ** rng.uniform(-2.0, 1.0))
        self.pace = float(10 ** rng.uniform(-0.5, 2.0)) * float(rng.choice([-1, 1]))
        self.mass = float(1000 * self.size**3 * 10 ** rng.uniform(-2.5, -0.5))
        self.most = 0.6
        self.common = friction(rng, 0.05 * abs(self.pace) * self.size, self.most)
        self.model = str(rng.choice(["two-contact", "pezzuti"], p=[0.7, 0.3]))
        self.home: dict[str, Frame] = {"ground": (np.zeros(3), np.eye(3))}
        gravity = numbers(rng.normal(0, 6, 3)) if rng.random() < 0.7 else [0.0, 0.0, 0.0]
        self.data: Data = {
            "space": "spatial",
            "gravity": gravity,
            "links": {"ground": {"points": {}}},
            "joints": {},
            "drivers": {},
            "loads": {},
            "assembly": {},
        }

    def frame(self) -> Frame:
        """Anywhere, turned anyhow."""
        axes, _ = np.linalg.qr(self.rng.normal(size=(3, 3)))
        return self.rng.uniform(-1, 1, 3) * self.size, axes * np.sign(np.linalg.det(axes))

    def link(self, name: str, frame: Frame | None = None) -> None:
        self.home[name] = frame or self.frame()
        self.data["links"][name] = {"points": {}, **self.body()}

    def body(self) -> Data:
        """Mass, centre and a physically possible inertia in no particular axes, about the centre or the origin."""
        rng = self.rng
        mass = self.mass * float(10 ** rng.uniform(-1, 0.5))
        axes, second = self.frame()[1], mass * (self.size * rng.uniform(0.05, 0.25, 3)) ** 2
        inertia = axes @ np.diag(np.sum(second) - second) @ axes.T
        centre = rng.uniform(-0.2, 0.2, 3) * self.size
        about = "origin" if rng.random() < 0.3 else "centre"
        if about == "origin":
            inertia = inertia + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        named = {key: float(inertia[i, j]) for key, (i, j) in TENSOR.items()}
        return {"mass": mass, "centre": numbers(centre), "inertia": named, "inertia_about": about}

    def joint(
        self, name: str, kind: str, first: str, second: str, at: Frame, motion: Frame, pitch: float = 0.0
    ) -> None:
        """A joint with its first element at a frame, its second where a motion takes it."""
        for link, place in ((first, at), (second, product(at, motion))):
            where, axes = within(self.home[link], place)
            self.data["links"][link]["points"][name] = {
                "at": numbers(where),
                "axis": numbers(axes[:, 2]),
                "x": numbers(axes[:, 0]),
            }
        self.data["joints"][name] = {"type": kind, "links": [first, second], **self.contact(kind)}
        if kind == "helical":
            self.data["joints"][name]["pitch"] = pitch

    def contact(self, kind: str) -> Data:
        """Dimensions of a pair's contact and its friction."""
        rng = self.rng
        if kind in ("planar", "fixed"):
            return {}
        found: Data = {"friction": self.rubs(kind)}
        if kind == "prismatic":
            found["guide"] = {"length": self.size * float(rng.uniform(0.2, 0.8))}
            if rng.random() < 0.7:
                found["guide"]["width"] = self.size * float(rng.uniform(0.1, 0.4))
            return found
        pin: Data = {"radius": self.size * float(10 ** rng.uniform(-2.3, -1.3))}
        if kind != "spherical":
            pin["bearing"] = self.size * float(rng.uniform(0.15, 0.5))
        if kind not in ("spherical", "universal"):
            pin["offset"] = self.size * float(rng.uniform(-0.1, 0.1))
        return {**found, "pin": pin}

    def rubs(self, kind: str) -> Data | float:
        chance = self.rng.random()
        if chance < 0.1:
            return 0.0
        found = friction(self.rng, 0.05 * abs(self.pace) * self.size, self.most) if chance < 0.3 else dict(self.common)
        if kind == "prismatic" and found["law"] == "rolling-bearing":
            found = {"law": "coulomb", "coefficient": found["coefficient"]}
        if kind in ("revolute", "cylindrical", "universal", "prismatic"):
            found["model"] = self.model
        return found

    def drive(self, joint: str, coordinate: float, extent: float) -> None:
        """Over a short range from where it stands."""
        kind = self.data["joints"][joint]["type"]
        extent *= float(np.sign(self.pace)) * (self.size if kind == "prismatic" else 1.0)
        self.data["drivers"][joint] = {
            "speed": abs(self.pace) * extent / 0.3,
            "range": [coordinate, coordinate + extent],
        }

    def rods(self) -> list[str]:
        """Links that nothing but two balls hold: slender rods, for their spin is free."""
        found = []
        for link in self.home:
            if link == "ground":
                continue
            names = [name for name, joint in self.data["joints"].items() if link in joint["links"]]
            if len(names) == 2 and all(self.data["joints"][name]["type"] == "spherical" for name in names):
                found.append(link)
                points = self.data["links"][link]["points"]
                one, two = (np.array(points[name]["at"]) for name in names)
                u = (two - one) / np.linalg.norm(two - one)
                mass = float(self.data["links"][link]["mass"])
                across = mass * float(np.sum((two - one) ** 2)) / 12
                inertia = across * (np.eye(3) - 0.9 * np.outer(u, u))
                named = {key: float(inertia[i, j]) for key, (i, j) in TENSOR.items()}
                self.data["links"][link] |= {
                    "centre": numbers(one + 0.4 * (two - one)),
                    "inertia": named,
                    "inertia_about": "centre",
                }
                points["grip"] = numbers(one + 0.3 * (two - one))
        return found

    def loaded(self, hints: bool = True) -> None:
        """Forces, moments, what resists, and where the points are at the start."""
        rng = self.rng
        rods = self.rods()
        force = self.mass * self.size * self.pace**2 * float(10 ** rng.uniform(-1.5, 1.5))
        moving = [link for link in self.home if link != "ground"]
        for link in moving:
            points = self.data["links"][link]["points"]
            points.setdefault("grip", numbers(rng.uniform(-0.3, 0.3, 3) * self.size))
            if rng.random() < 0.5 or link == moving[-1]:
                load: Data = {"link": link, "at": "grip", "force": numbers(rng.normal(0, force, 3))}
                if rng.random() < 0.3:
                    load["frame"] = "link"
                if rng.random() < 0.4 and link not in rods:
                    load["moment"] = numbers(rng.normal(0, 0.5 * force * self.size, 3))
                self.data["loads"][f"on {link}"] = load
        self.resist(force)
        if hints:
            for link in moving:
                for name, point in self.data["links"][link]["points"].items():
                    at = point["at"] if isinstance(point, dict) else point
                    place, axes = self.home[link]
                    self.data["assembly"][f"{link}.{name}"] = numbers(place + axes @ np.array(at))

    def resist(self, force: float) -> None:
        """Now and then what opposes the last joint on one axis."""
        rng = self.rng
        kinds = {name: joint["type"] for name, joint in self.data["joints"].items() if name not in self.data["drivers"]}
        able = [name for name, kind in kinds.items() if kind in ("revolute", "prismatic", "cylindrical")]
        if not able or rng.random() < 0.6:
            return
        size, name = float(abs(rng.normal(0, force))), able[-1]
        key, value = ("force", size) if kinds[name] == "prismatic" else ("torque", size * self.size)
        self.data["loads"]["work"] = {"joint": name, f"resisting_{key}": value, "useful": True}


def motion_of(kind: str, rng: np.random.Generator, size: float, pitch: float) -> tuple[Frame, float]:
    """A random relative motion of a pair, and its coordinate."""
    angle, way = float(rng.uniform(-2.5, 2.5)), size * float(rng.uniform(0.1, 0.4))
    z, none = np.array([0.0, 0.0, 1.0]), np.zeros(3)
    about = turn(z, angle)
    ball, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    cross = about @ turn([1, 0, 0], np.pi / 2) @ turn(z, float(rng.uniform(-2.5, 2.5)))
    table: dict[str, tuple[Frame, float]] = {
        "revolute": ((none, about), angle),
        "prismatic": ((way * z, np.eye(3)), way),
        "cylindrical": ((way * z, about), angle),
        "helical": ((pitch * angle / (2 * np.pi) * z, about), angle),
        "universal": ((none, cross), 0.0),
        "planar": ((np.array([*rng.uniform(-0.2, 0.2, 2), 0.0]) * size, about), 0.0),
        "fixed": ((none, np.eye(3)), 0.0),
        "spherical": ((none, ball * np.sign(np.linalg.det(ball))), 0.0),
    }
    return table[kind]


def chained(space: Space, joints: Mapping[str, str]) -> None:
    """Joints as 'kind first second', in random places; the first is driven."""
    rng = space.rng
    names = {"0": "ground"}
    for text in joints.values():
        for number in text.split()[1:]:
            if number not in names:
                names[number] = f"link-{number}"
                space.link(names[number])
    for name, text in joints.items():
        symbol, *ends = text.split()
        first, second = (names[n] for n in (ends if rng.random() < 0.5 else ends[::-1]))
        pitch = space.size * float(rng.uniform(0.1, 0.4)) * float(rng.choice([-1, 1]))
        motion, coordinate = motion_of(KINDS[symbol], rng, space.size, pitch)
        at = space.frame()
        space.joint(name, KINDS[symbol], first, second, at, motion, pitch)
        if name == "A":
            space.drive(name, coordinate, float(rng.uniform(0.03, 0.2)))
    space.loaded()


def chain(symbols: str) -> dict[str, str]:
    """A closed chain."""
    count = len(symbols)
    return {"ABCDEFG"[k]: f"{symbol} {k} {(k + 1) % count}" for k, symbol in enumerate(symbols)}


def cranked(space: Space, last: str) -> None:
    """A crank that turns fully, a rod with two balls, and a rocker or a ram."""
    rng, size = space.rng, space.size
    radius, rod = size * float(rng.uniform(0.1, 0.25)), size * float(rng.uniform(0.9, 1.4))
    for name in ("crank", "rod", "output"):
        space.link(name)
    shaft = space.frame()
    ball = shaft[0] + shaft[1] @ np.array([radius, 0.0, size * float(rng.uniform(-0.1, 0.1))])
    way = rng.normal(size=3)
    far = ball + rod * way / np.linalg.norm(way)
    start = motion_of("revolute", rng, size, 0.0)
    speed = {"speed": space.pace, "start": start[1]}
    space.joint("A", "revolute", *two(rng, "ground", "crank"), shaft, start[0])
    if space.data["joints"]["A"]["links"][0] != "ground":
        speed["start"] = start[1]
    space.data["drivers"]["A"] = speed
    space.joint(
        "B", "spherical", *two(rng, "crank", "rod"), (ball, space.frame()[1]), motion_of("spherical", rng, size, 0)[0]
    )
    space.joint(
        "C", "spherical", *two(rng, "rod", "output"), (far, space.frame()[1]), motion_of("spherical", rng, size, 0)[0]
    )
    u = (far - ball) / rod
    side = np.linalg.qr(np.column_stack([u, rng.normal(size=(3, 2))]))[0]
    lean = float(rng.uniform(0.0, 0.5))
    if last == "R":  # the rocker's arm about square to the rod, its axis about square to both
        arm = np.cos(lean) * side[:, 1] + np.sin(lean) * u
        axis = np.cross(u, arm) + 0.3 * rng.normal(size=3)
        axis = axis / np.linalg.norm(axis)
        pivot = far - size * float(rng.uniform(0.5, 0.9)) * arm
        at = pivot, np.linalg.qr(np.column_stack([axis, rng.normal(size=(3, 2))]))[0][:, [1, 2, 0]]
    else:
        axis = np.cos(lean) * u + np.sin(lean) * side[:, 1]
        at = (
            far + 0.2 * size * rng.normal(size=3),
            np.linalg.qr(np.column_stack([axis, rng.normal(size=(3, 2))]))[0][:, [1, 2, 0]],
        )
    at[1][:, 0] *= np.sign(np.linalg.det(at[1]))
    kind = KINDS[last]
    space.joint("D", kind, *two(rng, "output", "ground"), at, motion_of(kind, rng, size, 0.0)[0])
    space.loaded()


def two(rng: np.random.Generator, one: str, other: str) -> tuple[str, str]:
    """In either order."""
    return (one, other) if rng.random() < 0.5 else (other, one)


def looped(space: Space, rows: list[Data], links: list[str]) -> None:
    """A loop of rows turned by its first joint, loaded at its last."""
    rng, size = space.rng, space.size
    space.data["loop"] = rows
    del space.data["joints"], space.data["assembly"]
    space.data["links"] = {
        name: {"points": {"grip": numbers(rng.uniform(-0.2, 0.2, 3) * size)}, **space.body()} for name in links
    }
    space.data["drivers"] = {rows[0]["joint"]: {"speed": space.pace, "start": float(rng.uniform(-3, 3))}}
    force = space.mass * size * space.pace**2 * float(10 ** rng.uniform(-1.0, 1.5))
    space.data["loads"] = {"brake": {"joint": rows[-1]["joint"], "resisting_torque": force * size, "useful": True}}
    for name in links:
        if rng.random() < 0.4:
            load = {"link": name, "at": "grip", "force": numbers(rng.normal(0, 0.3 * force, 3))}
            space.data["loads"][f"on {name}"] = load


def cardan(space: Space) -> None:
    """A Cardan joint as built: a revolute and three cylindrical joints whose axes nearly meet, nearly square."""
    rng, size = space.rng, space.size
    error, gap = 10 ** rng.uniform(-4, -1.7), size * 10 ** rng.uniform(-4, -2)
    between = float(rng.uniform(0.05, 1.0))
    rows: list[Data] = []
    links = ["input-shaft", "cross", "output-shaft"]
    names = ("input", "pin-1", "pin-2", "output")
    for k, (name, link) in enumerate(zip(names, [*links, "ground"], strict=True)):
        kind = "revolute" if k == 0 else "cylindrical"
        twist = np.pi / 2 if k < 3 else np.pi - between
        row: Data = {"joint": name, "type": kind, "link": link, "twist": float(twist + error * rng.normal())}
        contact = space.contact(kind)
        contact["pin"]["offset"] = float(contact["pin"]["offset"] * 0.1)
        rows.append({**row, "distance": float(gap * rng.normal()), **contact})
    looped(space, rows, links)


def spherical(space: Space) -> None:
    """Four pins whose axes meet in one point, a crank that turns fully: over-constrained, least reactions, no friction
    since statics does not say what presses on the pins."""
    rng = space.rng
    crank = float(rng.uniform(0.2, 0.5))
    arcs = [crank, *(float(n) for n in rng.uniform(1.0, 1.5, 2)), float(rng.uniform(1.0, 1.5))]
    links = ["crank", "coupler", "rocker"]
    rows: list[Data] = []
    for name, link, arc in zip("ABCD", [*links, "ground"], arcs, strict=True):
        contact = {**space.contact("revolute"), "friction": 0}
        rows.append({"joint": name, "type": "revolute", "link": link, "twist": arc, **contact})
    looped(space, rows, links)
    space.data["over_constraint"] = "minimum-norm"
    space.data["assembly"] = {"coupler": str(rng.choice(["way-1", "way-2"]))}


BUILT: dict[str, Callable[[Space], None]] = {
    **{symbols: lambda space, symbols=symbols: chained(space, chain(symbols)) for symbols in CHAINS},  # type: ignore[misc]
    "two loops": lambda space: chained(space, TWO_LOOPS),
    "two RSSR": lambda space: chained(space, TWO_RSSR),
    "crank RSSR": lambda space: cranked(space, "R"),
    "crank RSSP": lambda space: cranked(space, "P"),
    "Cardan": cardan,
    "spherical four-bar": spherical,
}


def drawn(seed: int) -> tuple[str, Data]:
    """The family and the model of a seed."""
    rng = np.random.default_rng([20_27, seed])
    share = np.array(list(FAMILIES.values()), float)
    family = str(rng.choice(list(FAMILIES), p=share / share.sum()))
    space = Space(rng)
    BUILT[family](space)
    return family, space.data
