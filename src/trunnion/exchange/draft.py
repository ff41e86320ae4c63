"""A mechanism as other programs hold it: bodies and pairs that all lie in one frame, as drawn.

Every reader makes a Draft of its file, and `model_text` makes the model of it; every writer gets a Draft of the
mechanism at a position. Places are in m, in the global frame; vectors and matrices are NumPy arrays.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.joints.pairs import PAIRS

__all__ = ["Array", "Body", "Draft", "Pair", "about", "free_name", "moved", "perpendicular", "steiner", "united"]

Array = NDArray[np.float64]
FARTHEST = 1e9  # m; what lies farther is a mistake of the file
PARALLEL = 1e-6  # rad, between axes that count as parallel


@dataclass
class Body:
    """A rigid body.

    Parameters
    ----------
    name : name of the part, later of the link.
    mass : kg; 0 if the file says nothing of it.
    centre : mass centre, m, (3,).
    inertia : tensor about the mass centre in global axes, kg m², (3, 3).
    points : further points of interest, m, by name.
    comments : how the numbers were found, a line each; they stand above the link in the model file.
    """

    name: str
    mass: float = 0.0
    centre: Array = field(default_factory=lambda: np.zeros(3))
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))
    points: dict[str, Array] = field(default_factory=dict)
    comments: list[str] = field(default_factory=list)


@dataclass
class Pair:
    """A pair between two bodies.

    Parameters
    ----------
    name : later of the joint.
    type : of `joints.pairs.PAIRS`.
    links : names of the two bodies; coordinates and rates are of the second against the first.
    at : a point of the pair, m, (3,): on its axis, centre of its ball or cross, middle of its bearing.
    axis : direction of its axis, or normal of a planar pair; of a universal joint of the pin in the first body.
    second_axis : of a universal joint, direction of the pin in the second body.
    pin_radius, hole_radius : of the pin or ball, and of what it runs in, m; of a slider and its guide half the widths.
    pin_limits, hole_limits : lower and upper deviation of these radii that the file states, m.
    length : of a bearing or guide, m.
    elements : place, m, and axis of its element on each body, by name, where they are not the same.
    pitch : of a helical pair, m for a turn.
    limits : range of its coordinate from where it is drawn, rad or m.
    comments : how it was found, a line each; they stand above the joint in the model file.
    """

    name: str
    type: str
    links: tuple[str, str]
    at: Array
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    second_axis: Array | None = None
    pin_radius: float | None = None
    hole_radius: float | None = None
    pin_limits: tuple[float, float] | None = None
    hole_limits: tuple[float, float] | None = None
    length: float | None = None
    elements: dict[str, tuple[Array, Array]] = field(default_factory=dict)
    pitch: float | None = None
    limits: tuple[float, float] | None = None
    comments: list[str] = field(default_factory=list)

    def element(self, body: str) -> tuple[Array, Array]:
        """Place, m, and axis of its element on a body."""
        if body in self.elements:
            return self.elements[body]
        second = self.second_axis is not None and body == self.links[1]
        return self.at, self.second_axis if second else self.axis  # type: ignore[return-value]

    @property
    def clearance(self) -> float | None:
        """Radius of the hole less that of the pin, m."""
        return None if self.pin_radius is None or self.hole_radius is None else self.hole_radius - self.pin_radius


@dataclass
class Draft:
    """Bodies, pairs and drives of a mechanism at one position.

    Parameters
    ----------
    name : of the mechanism.
    bodies, pairs : by name, in the order of the file.
    ground : name of the body that does not move; empty if the file does not say it.
    gravity : m/s², (3,); None if the file does not say it.
    drives : rate of a driven joint, rad/s or m/s, by its name.
    plane : whether it is known to move in the plane z = 0.
    source : the file it comes from, for the comment on top.
    findings : what is doubtful; lost : names of what is left out, by what it is.
    """

    name: str = ""
    bodies: dict[str, Body] = field(default_factory=dict)
    pairs: dict[str, Pair] = field(default_factory=dict)
    ground: str = ""
    gravity: Array | None = None
    drives: dict[str, float] = field(default_factory=dict)
    plane: bool = False
    source: str = ""
    findings: list[Finding] = field(default_factory=list)
    lost: dict[str, list[str]] = field(default_factory=dict)

    def lose(self, what: str, *names: str) -> None:
        """Leave something out: `checked` says in one finding all that is."""
        self.lost.setdefault(what, []).extend(names)

    def warn(self, code: str, where: str, what: str, remedy: str = "", **figures: Any) -> None:
        """Note a doubt; code: of the list in the manual, `exchange.…`."""
        weighed = Finding.weighed(Severity.WARNING, code, where, what, remedy, **figures)
        self.findings.append(weighed)

    def note(self, code: str, where: str, what: str, remedy: str = "", **figures: Any) -> None:
        """Note something that is lost or assumed."""
        weighed = Finding.weighed(Severity.NOTE, code, where, what, remedy, **figures)
        self.findings.append(weighed)

    def pairs_of(self, body: str) -> list[Pair]:
        """The pairs that a body takes part in."""
        return [pair for pair in self.pairs.values() if body in pair.links]

    def mobility(self, planar: bool = False) -> int:
        """Mobility by Grübler's formula, of a mechanism in space or in a plane."""
        moving, most = len(self.bodies) - 1, 3 if planar else 6
        return most * moving - sum(most - (1 if planar else PAIRS[pair.type].count) for pair in self.pairs.values())

    def welded(self) -> Draft:
        """The same with bodies that fixed pairs join made one; the ground, else the first, gives its name."""
        leader = {name: name for name in self.bodies}

        def first(name: str) -> str:
            while leader[name] != name:
                name = leader[name]
            return name

        for pair in (pair for pair in self.pairs.values() if pair.type == "fixed"):
            one_end, other = first(pair.links[0]), first(pair.links[1])
            if other == first(self.ground) if self.ground else False:
                one_end, other = other, one_end
            leader[other] = one_end
        bodies: dict[str, Body] = {}
        for name, body in self.bodies.items():
            lead = first(name)
            bodies[lead] = body if lead not in bodies else united(bodies[lead], body, lead)
            if lead != name or bodies[lead].name != lead:
                bodies[lead] = replace(bodies[lead], name=lead)
        pairs = {}
        for name, pair in self.pairs.items():
            links = first(pair.links[0]), first(pair.links[1])
            if pair.type != "fixed" and links[0] != links[1]:
                pairs[name] = replace(pair, links=links)
        ground = first(self.ground) if self.ground else ""
        drives = {name: rate for name, rate in self.drives.items() if name in pairs}
        return replace(self, bodies=bodies, pairs=pairs, ground=ground, drives=drives)

    def plane_normal(self) -> Array | None:
        """The normal of the plane that all bodies move in parallel to; None if there is none.

        Axes of turning pairs are parallel to it, slides of prismatic pairs normal to it. Balls are pins of the plane
        where the mechanism could not move otherwise, as in a loop that a format closes by a point.
        """
        turning = [pair.axis for pair in self.pairs.values() if pair.type in ("revolute", "cylindrical", "planar")]
        sliding = [pair.axis for pair in self.pairs.values() if pair.type == "prismatic"]
        if self.plane:
            return np.array([0.0, 0.0, 1.0])
        types = {pair.type for pair in self.pairs.values()}
        if types & {"universal", "helical"} or not types or ("spherical" in types and self.mobility() > 0):
            return None
        if turning:
            normal = turning[0] / np.linalg.norm(turning[0])
        elif len(sliding) > 1:
            normal = np.cross(sliding[0], sliding[1])
            if np.linalg.norm(normal) < PARALLEL:
                return None
            normal = normal / np.linalg.norm(normal)
        else:
            return None
        for axis in turning:
            if np.linalg.norm(np.cross(axis, normal)) > PARALLEL * np.linalg.norm(axis):
                return None
        for axis in sliding:
            if abs(axis @ normal) > PARALLEL * np.linalg.norm(axis):
                return None
        largest = int(np.argmax(abs(normal)))
        return np.asarray(normal * np.sign(normal[largest]), dtype=float)

    def checked(self) -> Draft:
        """The same, with a finding of all that is left out; MechanismError if a body or pair is none of a mechanism."""
        findings = []
        if self.lost:
            named = {what: ", ".join(names[:10]) + " …" * (len(names) > 10) for what, names in self.lost.items()}
            all_lost = "; ".join(f"{what} ({names})" if names else what for what, names in named.items())
            self.note("exchange.lost", "", f"is read without {all_lost}", "add to the model what moves or loads it")
        for pair in self.pairs.values():
            if pair.type not in PAIRS:
                findings.append(Finding(f"has the type {pair.type!r}, which is no pair", f"joints.{pair.name}"))
            numbers = np.concatenate([pair.at, pair.axis])
            if not np.abs(pair.at).max() < FARTHEST:
                what = f"lies {np.abs(pair.at).max():.3g} m away"
                findings.append(Finding(what, f"joints.{pair.name}", "mend the file"))
            if not np.isfinite(numbers).all() or not np.linalg.norm(pair.axis) > 0:
                findings.append(Finding("has no place or no axis", f"joints.{pair.name}", "mend the file"))
            strange = [link for link in pair.links if link not in self.bodies]
            findings += [Finding(f"joins {link!r}, which it does not have", f"joints.{pair.name}") for link in strange]
        for body in self.bodies.values():
            if not (np.isfinite(body.mass) and np.isfinite(body.centre).all() and np.isfinite(body.inertia).all()):
                findings.append(Finding("has a mass, centre or inertia that is no number", f"links.{body.name}"))
            if body.mass < 0:
                findings.append(Finding(f"has the mass {body.mass:g} kg", f"links.{body.name}", "mend the file"))
        if findings:
            raise MechanismError([replace(finding, file=self.source) for finding in findings])
        return self


def united(first: Body, other: Body, name: str) -> Body:
    """Two bodies as one."""
    mass = first.mass + other.mass
    centre = (first.mass * first.centre + other.mass * other.centre) / mass if mass else first.centre
    inertia = sum(body.inertia + body.mass * steiner(body.centre - centre) for body in (first, other))
    return Body(
        name, mass, centre, np.asarray(inertia), {**first.points, **other.points}, [*first.comments, *other.comments]
    )


def steiner(offset: Array) -> Array:
    """d² 1 − d dᵀ: what the parallel axes theorem adds to an inertia for each kg, m² (3, 3)."""
    return np.asarray(offset @ offset * np.eye(3) - np.outer(offset, offset))


def about(body: Body, point: Array) -> Array:
    """The inertia of a body about a point, kg m² (3, 3)."""
    return body.inertia + body.mass * steiner(point - body.centre)


def moved(draft: Draft, rotation: Array, shift: Array) -> Draft:
    """The whole draft turned by a rotation matrix about the origin, then shifted."""

    def place(point: Array) -> Array:
        return rotation @ point + shift

    bodies = {
        name: replace(
            body,
            centre=place(body.centre),
            inertia=rotation @ body.inertia @ rotation.T,
            points={key: place(point) for key, point in body.points.items()},
        )
        for name, body in draft.bodies.items()
    }
    pairs = {
        name: replace(
            pair,
            at=place(pair.at),
            axis=rotation @ pair.axis,
            second_axis=None if pair.second_axis is None else rotation @ pair.second_axis,
            elements={link: (place(at), rotation @ axis) for link, (at, axis) in pair.elements.items()},
        )
        for name, pair in draft.pairs.items()
    }
    gravity = None if draft.gravity is None else rotation @ draft.gravity
    return replace(draft, bodies=bodies, pairs=pairs, gravity=gravity)


def perpendicular(axis: Array) -> Array:
    """A unit vector at a right angle to an axis, towards the global axis that lies furthest from it."""
    unit = axis / np.linalg.norm(axis)
    base = np.eye(3)[int(np.argmin(abs(unit)))]
    across = base - (base @ unit) * unit
    return np.asarray(across / np.linalg.norm(across), dtype=float)


def free_name(text: str, used: Iterable[str], default: str = "part") -> str:
    """A name that a model file accepts and that is not taken yet: short, printable, without a dot."""
    name = "".join(sign for sign in text.replace(".", "-") if sign.isprintable()).strip().lstrip("=+-@ ")[:40].strip()
    name = name or default
    used = set(used)
    if name not in used:
        return name
    number = 2
    while f"{name}-{number}" in used:
        number += 1
    return f"{name}-{number}"
