"""Ends of what is drawn: names that are free, points on links, and the joints that ends make."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Mapping
from math import cos, hypot, isfinite, sin
from typing import Any, NamedTuple

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.model.quantity import Quantity
from trunnion.model.units import KINDS
from trunnion.studio.sketch import TOGETHER, Sketch, Vector

__all__ = [
    "NUMBER", "SHORTEST", "Line", "begin", "doubled", "free", "held", "joined", "letter", "line_near", "numbered",
    "pin", "place_of", "point_of", "put", "refused", "taken", "typed", "vector",
]  # fmt: skip

NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
SHORTEST = 1e-9  # m


def refused(what: str, where: str, remedy: str) -> MechanismError:
    """The error of a gesture that cannot be done."""
    return MechanismError(Finding(what, where, remedy))


def vector(given: Any) -> Vector:
    """A place of the page, m."""
    x, y = map(float, given)
    if not (isfinite(x) and isfinite(y)):
        raise ValueError(f"({x}, {y}) is no place")
    return x, y


def typed(text: Any, kind: str, unit: str = "") -> float:
    """A quantity as it was typed, SI; unit: of a plain number. UnitError or ValueError where it is none."""
    text = str(text or "").strip()
    plain = unit and NUMBER.fullmatch(text)
    return float(np.asarray(Quantity.read(f"{text} {unit}" if plain else text, KINDS[kind]).evaluate()))


# ---- names ----------------------------------------------------------------------------------------------------


def taken(sketch: Sketch) -> set[str]:
    """Names of joints, points, links and dimensions."""
    links = sketch.of("links")
    points = (name for link in links for name in sketch.points(link))
    rows = (str(row.get(key)) for row in sketch.rows for key in ("joint", "link"))
    return {*sketch.joints, *points, *links, *rows, *sketch.of("dimensions"), *sketch.section("dimensions")}


def letter(sketch: Sketch, also: Iterable[str] = ()) -> str:
    """The next free name of a point: A, B, …, Z, A2, …; also: names that are spoken for."""
    used = {*taken(sketch), *also}
    names = (one + number for number in ("", *map(str, range(2, 1000))) for one in LETTERS)
    return next(name for name in names if name not in used)


def numbered(sketch: Sketch, section: str, stem: str) -> str:
    """The next free name of a link, load, spring or gear pair: link1, link2, …"""
    used = {*sketch.section(section), *taken(sketch)}
    return next(name for number in itertools.count(1) if (name := f"{stem}{number}") not in used)


# ---- ends -----------------------------------------------------------------------------------------------------


def begin(sketch: Sketch) -> None:
    """The fixed link is there."""
    sketch.section("links").setdefault(sketch.ground, {"points": {}})
    sketch.section("links")[sketch.ground].setdefault("points", {})
    sketch.section("joints")


def place_of(sketch: Sketch, end: Any) -> Vector:
    """Where an end is.

    An end is a joint "J", a free point "link.P", {on: link, at: place} for a place on a link, {ground: place} for a
    place on the ground, or a place [x, y], m.
    """
    if isinstance(end, str):
        return sketch.places[".".join(held(sketch, end))]
    if isinstance(end, Mapping):
        return vector(end["at"] if "on" in end else end["ground"])
    return vector(end)


def held(sketch: Sketch, name: str) -> tuple[str, str]:
    """Link and point of a joint, or of a free point "link.P"."""
    (*_, link), point = sketch.links_at(name)
    if name not in sketch.joints and point not in sketch.points(link):
        raise refused("is not a joint or a point", name, "choose one that is drawn")
    return link, point


def free(sketch: Sketch, name: str) -> tuple[str, str]:
    """Link and name of a point that is no joint."""
    link, _, point = str(name).partition(".")
    if point not in sketch.points(link):
        raise refused("is not a free point", str(name), "choose the free end of a link")
    if point in sketch.joints:
        remedy = "delete the joint first, or draw another link from it"
        raise refused("is a joint already", f"links.{link}.points.{point}", remedy)
    return link, point


def point_of(sketch: Sketch, end: Any) -> tuple[str, str]:
    """Link and point of an end, where a force acts or a spring is fastened: on the moving link of a pin on the ground.

    A place on a link, or on the ground, becomes a point of it.
    """
    if isinstance(end, str):
        link, point = held(sketch, end)
        other = sketch.joints[end]["links"][0] if end in sketch.joints else link
        return (other, point) if link == sketch.ground and point in sketch.points(other) else (link, point)
    begin(sketch)
    link = str(end["on"]) if isinstance(end, Mapping) and "on" in end else sketch.ground
    point = letter(sketch)
    put(sketch, link, point, place_of(sketch, end))
    return link, point


def joined(sketch: Sketch, link: str, end: Any, place: Vector) -> str:
    """The name of an end of a new link, and the joint that it makes."""
    if isinstance(end, Mapping):
        point, other = letter(sketch), str(end.get("on", sketch.ground))
        put(sketch, other, point, place)
        pin(sketch, point, other, link, place)
        return point
    if not isinstance(end, str):
        return letter(sketch)
    other, point = held(sketch, end)
    if point in sketch.joints:
        point = doubled(sketch, other, point)
    sketch.places[f"{other}.{point}"] = place
    pin(sketch, point, other, link, place)
    return point


def doubled(sketch: Sketch, link: str, point: str, name: str = "") -> str:
    """Another point of a link on the spot of one that is a joint already, for a second pin there: its name."""
    stated, name = sketch.points(link)[point], name or letter(sketch)
    sketch.section("links")[link]["points"][name] = list(stated["at"] if isinstance(stated, dict) else stated)
    sketch.places[f"{link}.{name}"] = sketch.places[f"{link}.{point}"]
    sketch.forget()
    return name


def put(sketch: Sketch, link: str, point: str, place: Vector, axis: float | None = None) -> None:
    """A point on a link where a place is; axis: its direction in the plane, rad."""
    frame = sketch.frame(link)
    least = max(SHORTEST, sketch.fine / 20.0)  # a smaller one is what rounding left
    at = [sketch.length(value) if abs(value) > least else 0 for value in frame.into(place)]
    stated: Any = at
    if axis is not None:
        c, s = cos(axis), sin(axis)
        parts = (frame.c * c + frame.s * s, frame.c * s - frame.s * c)  # in the frame of the link
        stated = {"at": at, "axis": [_short(part) for part in parts]}
    sketch.section("links")[link]["points"][point] = stated
    sketch.places[f"{link}.{point}"] = place
    sketch.forget()


def _short(part: float) -> float | int:
    """A component of a direction, without the noise of rounding."""
    found = round(part, 12) + 0.0
    return int(found) if found.is_integer() else found


def pin(sketch: Sketch, name: str, first: str, second: str, place: Vector) -> None:
    """A revolute joint; where it is at the start chooses the assembly."""
    sketch.section("joints")[name] = {"type": "revolute", "links": [first, second]}
    sketch.places[f"{second}.{name}"] = place
    if first != sketch.ground:
        sketch.section("assembly")[name] = [sketch.length(part) for part in place]


class Line(NamedTuple):
    """A line of a link: where it begins, m, its direction, and how far left of it a place lies, m."""

    start: Vector
    direction: Vector
    beside: float


def line_near(sketch: Sketch, link: str, place: Vector) -> Line:
    """The line through two points of a link that passes nearest to a place; of several the longest."""
    spots = [sketch.places[key] for point in sketch.points(link) if (key := f"{link}.{point}") in sketch.places]
    found: list[tuple[float, float, Line]] = []
    for (x, y), (a, b) in itertools.combinations(spots, 2):
        length = hypot(a - x, b - y)
        if length > TOGETHER * sketch.size:
            c, s = (a - x) / length, (b - y) / length
            beside = c * (place[1] - y) - s * (place[0] - x)
            found.append((round(abs(beside) / sketch.size, 6), -length, Line((x, y), (c, s), beside)))
    if not found:
        raise refused("has no two points that a slot could go along", f"links.{link}", "add a point to it first")
    return min(found, key=lambda row: row[:2])[2]
