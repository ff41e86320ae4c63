"""Drawing: links, pins, guides and slots, points, and ends that are joined; with names that are free.

An end is a joint "J", a free point "link.P", {on: link, at: place} for a place on a link, {ground: place} for a place
on the ground, or a place [x, y], m.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Mapping, Sequence
from math import atan2, cos, hypot, isfinite, sin
from typing import Any

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.model.quantity import Quantity
from trunnion.model.units import KINDS, UnitError
from trunnion.studio.sketch import TOGETHER, Frame, Sketch, Vector

__all__ = [
    "NUMBER", "add_point", "bar", "begin", "free", "held", "join", "letter", "line_near", "link", "move", "numbered",
    "pinned", "place_of", "point_of", "refused", "rename_point", "slide", "spoken_of", "taken", "typed", "vector",
]  # fmt: skip

Given = Mapping[str, Any]
NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
SHORTEST = 1e-9  # m


def refused(what: str, where: str, remedy: str) -> MechanismError:
    """The error of a gesture that cannot be done."""
    return MechanismError(Finding(what, where, remedy))


def vector(value: Any) -> Vector:
    """A place of the page, m."""
    x, y = map(float, value)
    if not (isfinite(x) and isfinite(y)):
        raise ValueError(f"({x}, {y}) is no place")
    return x, y


def typed(text: Any, kind: str, where: str, unit: str = "") -> float:
    """A quantity as it was typed, SI; unit: of a plain number. MechanismError where it is none."""
    text = str(text or "").strip()
    try:
        read = Quantity.read(f"{text} {unit}" if unit and NUMBER.fullmatch(text) else text, KINDS[kind])
        value = float(np.asarray(read.evaluate()))
        if not isfinite(value):
            raise ValueError(text)
    except (UnitError, ValueError, TypeError, KeyError, ZeroDivisionError) as error:
        remedy = getattr(error, "remedy", "") or f"type it as {KINDS[kind].example}"
        raise refused(f"'{text[:30]}' is no {kind}", where, remedy) from None
    return value


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
    names = (sign + number for number in ("", *map(str, range(2, 1000))) for sign in LETTERS)
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
    """Where an end is."""
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


def spoken_of(entry: Given) -> set[str]:
    """What a load, spring or gear pair acts on: links, joints, and points "link.P"."""
    link, at = entry.get("link"), entry.get("at")
    names = {*(entry.get("between") or ()), *(entry.get("joints") or ()), entry.get("joint"), link}
    return {str(name) for name in names if name} | ({f"{link}.{at}"} if link and at else set())


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


def connect(sketch: Sketch, ends: Sequence[tuple[str, str]], place: Vector) -> str:
    """A pin between two links: its name, that of a free end, of the first before the second, else a new one.

    ends: (link, its point there); without a point the link gets one. A point that is a joint already is doubled.
    """
    free_names = (
        point for link, point in ends if point and point not in sketch.joints
        and all(point not in sketch.points(other) for other in sketch.of("links") if other != link)
    )  # fmt: skip
    name = next(free_names, None) or letter(sketch)
    for link, point in ends:
        if not point:
            put(sketch, link, name, place)
        elif point in sketch.joints:
            entry = sketch.points(link)[point]
            sketch.section("links")[link]["points"][name] = list(entry["at"] if isinstance(entry, dict) else entry)
            sketch.places[f"{link}.{name}"] = sketch.places[f"{link}.{point}"]
        elif point != name:
            rename_point(sketch, f"{link}.{point}", name)
    sketch.forget()
    pin(sketch, name, ends[0][0], ends[1][0], place)
    return name


def _on(sketch: Sketch, end: Any) -> tuple[str, str]:
    """Link and point of an end; no point of a place on a link or on the ground."""
    return held(sketch, end) if isinstance(end, str) else (str(end.get("on", sketch.ground)), "")


def put(sketch: Sketch, link: str, point: str, place: Vector, axis: float | None = None) -> None:
    """A point on a link where a place is; axis: its direction in the plane, rad."""
    frame = sketch.frame(link)
    least = max(SHORTEST, sketch.fine / 20.0)  # a smaller one is what rounding left
    at = [sketch.length(value) if abs(value) > least else 0 for value in frame.into(place)]
    entry: Any = at
    if axis is not None:
        c, s = cos(axis), sin(axis)
        parts = (frame.c * c + frame.s * s, frame.c * s - frame.s * c)  # in the frame of the link
        entry = {"at": at, "axis": [_short(part) for part in parts]}
    sketch.section("links")[link]["points"][point] = entry
    sketch.places[f"{link}.{point}"] = place
    sketch.forget()


def _short(part: float) -> float | int:
    """A component of a direction, without the noise of rounding."""
    rounded = round(part, 12) + 0.0
    return int(rounded) if rounded.is_integer() else rounded


def pin(sketch: Sketch, name: str, first: str, second: str, place: Vector) -> None:
    """A revolute joint; where it is at the start chooses the assembly."""
    sketch.section("joints")[name] = {"type": "revolute", "links": [first, second]}
    sketch.places[f"{second}.{name}"] = place
    if first != sketch.ground:
        sketch.section("assembly")[name] = [sketch.length(part) for part in place]


def line_near(sketch: Sketch, link: str, place: Vector) -> tuple[Vector, Vector, float]:
    """The line through two points of a link that passes nearest to a place; of several the longest.

    Where it begins, m, its direction, and how far left of it the place lies, m.
    """
    spots = [sketch.places[key] for point in sketch.points(link) if (key := f"{link}.{point}") in sketch.places]
    lines: list[tuple[float, float, tuple[Vector, Vector, float]]] = []
    for (x, y), (a, b) in itertools.combinations(spots, 2):
        length = hypot(a - x, b - y)
        if length > TOGETHER * sketch.size:
            c, s = (a - x) / length, (b - y) / length
            offset = c * (place[1] - y) - s * (place[0] - x)
            lines.append((round(abs(offset) / sketch.size, 6), -length, ((x, y), (c, s), offset)))
    if not lines:
        raise refused("has no two points that a slot could go along", f"links.{link}", "add a point to it first")
    return min(lines, key=lambda row: row[:2])[2]


# ---- gestures -----------------------------------------------------------------------------------------------------


def link(sketch: Sketch, gesture: Given) -> str:
    """A bar from one end to another; ends on joints, points and links are joined with them.

    length: as it was typed, if it was; it says the same as the places.
    """
    return f"Draw {bar(sketch, gesture['from'], gesture['to'], length=gesture.get('length'))}"


def bar(sketch: Sketch, *ends: Any, length: Any = None) -> str:
    """A new link between two ends; its name."""
    begin(sketch)
    (x, y), (a, b) = places = [place_of(sketch, end) for end in ends]
    far = hypot(a - x, b - y)
    if far <= SHORTEST:
        raise refused("the link has no length", "", "click at two places")
    name = numbered(sketch, "links", "link")
    frame = Frame(x, y, (a - x) / far, (b - y) / far)
    sketch.section("links")[name] = {"points": {}}
    for end, place, local in zip(ends, places, (0, length or sketch.length(far)), strict=True):
        on_something = isinstance(end, (str, Mapping))
        point = connect(sketch, (_on(sketch, end), (name, "")), place) if on_something else letter(sketch)
        sketch.section("links")[name]["points"][point] = [local, 0]
        sketch.forget()
    sketch.show(name, frame)
    return name


def pinned(sketch: Sketch, gesture: Given) -> str:
    """A free point becomes a pin on the ground; given {on: link, at: place} instead, a new point of that link."""
    end = gesture["point"]
    if isinstance(end, Mapping) and end["on"] == sketch.ground:
        raise refused("is the ground", sketch.ground, "choose a link that moves")
    begin(sketch)
    owner = _on(sketch, end) if isinstance(end, Mapping) else free(sketch, end)
    name = connect(sketch, ((sketch.ground, ""), owner), place_of(sketch, end))
    return f"Pin {name} to the ground"


def add_point(sketch: Sketch, gesture: Given) -> str:
    """A point on a link."""
    begin(sketch)
    point = letter(sketch)
    put(sketch, str(gesture["link"]), point, vector(gesture["at"]))
    sketch.made = ("points", f"{gesture['link']}.{point}")  # and so its velocity and acceleration are shown
    return f"Add point {point}"


# ---- guides and slots -----------------------------------------------------------------------------------------


def slide(sketch: Sketch, gesture: Given) -> str:
    """A point slides, by a block that is pinned to it; given {on: link, at: place} instead, that link itself.

    It slides along the ground in the direction of `angle`, rad, or in a slot of the link `along`: on the line through
    two of that link's points, and beside it by as much as it is drawn there, if that is more than `near`, m.
    """
    begin(sketch)
    carrier, slid = str(gesture.get("along") or sketch.ground), gesture["joint"]
    if carrier != sketch.ground and carrier not in sketch.of("links"):
        raise refused("is not there", f"links.{carrier}", "choose a link that is drawn")
    place = place_of(sketch, slid)
    if isinstance(slid, Mapping):
        slider = str(slid["on"])
        if slider in (carrier, sketch.ground):
            raise refused("cannot slide along itself", f"links.{slider}", "choose two links")
        name, angle = _guided(sketch, carrier, place, gesture)
        sketch.section("joints")[name] = {"type": "prismatic", "links": [carrier, slider]}
        put(sketch, slider, name, place, angle)
        return f"Guide {slider}" if carrier == sketch.ground else f"Slide {slider} along {carrier}"
    end = _end_to_slide(sketch, str(slid), carrier)
    block, (name, angle) = numbered(sketch, "links", "block"), _guided(sketch, carrier, place, gesture)
    sketch.section("links")[block] = {"points": {}}
    sketch.section("joints")[name] = {"type": "prismatic", "links": [carrier, block]}
    point = connect(sketch, (end, (block, "")), place)
    sketch.section("links")[block]["points"] = {point: [0, 0], name: {"at": [0, 0], "axis": [1, 0]}}
    sketch.forget()
    sketch.show(block, Frame(*place, cos(angle), sin(angle)))
    return f"Guide {point}" if carrier == sketch.ground else f"Slide {point} along {carrier}"


def _guided(sketch: Sketch, carrier: str, place: Vector, gesture: Given) -> tuple[str, float]:
    """The guide of a new sliding joint on the link that carries it: name of the joint, and its angle, rad."""
    name = letter(sketch)
    if carrier == sketch.ground:
        angle = float(gesture.get("angle", 0.0))
        put(sketch, carrier, name, place, angle)
        return name, angle
    (x, y), (c, s), beside = line_near(sketch, carrier, place)
    offset = beside if abs(beside) > float(gesture.get("near", 0.0)) else 0.0
    put(sketch, carrier, name, (x - s * offset, y + c * offset), atan2(s, c))
    along = c * (place[0] - x) + s * (place[1] - y)
    sketch.section("assembly")[name] = sketch.length(along)  # on which side of the point the block is
    return name, atan2(s, c)


def _end_to_slide(sketch: Sketch, name: str, carrier: str) -> tuple[str, str]:
    """Link and point that a block is pinned to. A pin on the carrier of the guide becomes the pin on the block."""
    if name not in sketch.joints:
        slider, point = free(sketch, name)
        if slider == carrier:
            raise refused("cannot slide along itself", f"links.{slider}", "choose two links")
        return slider, point
    joint = sketch.joints[name]
    if joint.get("type", "revolute") != "revolute":
        raise refused("slides already", f"joints.{name}", "choose a pin, or the free end of a link")
    if carrier not in joint["links"]:
        return held(sketch, name)
    slider = next(other for other in joint["links"] if other != carrier)
    for section, what in (("loads", "load"), ("springs", "spring")):
        for other, entry in sketch.of(section).items():
            if f"{carrier}.{name}" in spoken_of(entry):
                raise refused(f"carries the {what} {other}", f"joints.{name}", f"delete that {what} first")
    del sketch.section("joints")[name]
    for section in ("drivers", "assembly"):
        sketch.section(section).pop(name, None)
    sketch.section("links")[carrier]["points"].pop(name, None)
    sketch.places.pop(f"{carrier}.{name}", None)
    sketch.forget()
    return slider, name


# ---- ends that are drawn already ------------------------------------------------------------------------------


def join(sketch: Sketch, gesture: Given) -> str:
    """Two ends are pinned together where the second is; the first goes there, unless it is a place on a link."""
    begin(sketch)
    first, second = gesture["ends"]
    place = place_of(sketch, second)
    (link, _), (other, _) = ends = [_on(sketch, end) for end in (first, second)]
    owners = [sketch.links_at(end)[0] if isinstance(end, str) else [str(end["on"])] for end in (first, second)]
    if set(owners[0]) & set(owners[1]):
        raise refused("would be joined with itself", link, "choose ends of two links")
    for name, joint in sketch.joints.items():
        if {link, other} == set(joint["links"]):
            raise refused(f"and {other} are joined at {name} already", link, "choose two other links")
    if isinstance(first, str):
        move(sketch, {"point": first, "to": place})
    sketch.made = ("joints", connect(sketch, ends[::-1], place))
    return f"Join {link} with {other}"


# ---- what is drawn already ------------------------------------------------------------------------------------------


def move(sketch: Sketch, gesture: Given) -> str:
    """A joint or point goes to a place; in space by so much, as the links are turned at a position."""
    if "by" in gesture:
        return _move_in_space(sketch, gesture)
    point, to = str(gesture["point"]), vector(gesture["to"])
    changes = sketch.moved(point, to, bool(gesture.get("keep")))
    sketch.write(changes)
    hints = sketch.entries.get("assembly") or {}
    if isinstance(hints.get(point), list) and not gesture.get("index"):
        hints[point] = [sketch.length(part) for part in to]
    links, name = sketch.links_at(point)
    for link in links:
        sketch.places[f"{link}.{name}"] = to
    for link in links:
        sketch.show(link, sketch.frame(link))
    return f"Move {point}" if changes else f"Move {point}: no length changes"


def _move_in_space(sketch: Sketch, gesture: Given) -> str:
    point, by, index = str(gesture["point"]), [float(part) for part in gesture["by"]], int(gesture.get("index") or 0)
    if len(by) != 3 or not all(map(isfinite, by)):
        raise ValueError(f"{by} is no way")
    sketch.size = float(gesture["size"])
    turns = sketch.turns(index)
    hint = (sketch.entries.get("assembly") or {}).get(point)
    if isinstance(hint, list) and index == 0:
        pairs = zip(sketch.vector(f"assembly.{point}", "xyz"), by, strict=True)
        sketch.entries["assembly"][point] = [sketch.length(sum(pair)) for pair in pairs]
    sketch.write(sketch.shifted(point, by, turns))
    return f"Move {point}"


def rename_point(sketch: Sketch, old: str, new: str) -> None:
    """A point of a link that is no joint, with the loads and springs at it."""
    link, point = free(sketch, old)
    entry = sketch.section("links")[link]
    entry["points"] = {(new if name == point else name): at for name, at in entry["points"].items()}
    for load in sketch.of("loads").values():
        if (load.get("link"), load.get("at")) == (link, point):
            load["at"] = new
    for spring in sketch.of("springs").values():
        if "between" in spring:
            spring["between"] = [f"{link}.{new}" if end == old else end for end in spring["between"]]
    hints = sketch.section("assembly")
    if old in hints:
        hints[f"{link}.{new}"] = hints.pop(old)
    if old in sketch.places:
        sketch.places[f"{link}.{new}"] = sketch.places.pop(old)
