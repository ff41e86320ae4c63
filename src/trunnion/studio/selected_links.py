"""Several links at once: shifted, mirrored, copied, deleted, with the joints, loads, springs and gears between them.

All goes through one map of the plane, p' = (sx x + a, sy y + b) with signs sx, sy. A mirrored link keeps its frame at
its own points: its y changes sign, and the rotation of a joint on the ground, which was q, becomes π − q or −q. What is
no coordinate, angle, force or moment is not mirrored but refused.
"""

from __future__ import annotations

import copy
import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import degrees, pi
from typing import Any

from trunnion.model.quantity import Quantity
from trunnion.model.renaming import renamed
from trunnion.model.units import KINDS, unit
from trunnion.studio.changing import delete
from trunnion.studio.sketch import LIMITS, Sketch, Vector
from trunnion.studio.strokes import letter, numbered, refused, spoken_of, vector

__all__ = ["group"]

Given = Mapping[str, Any]
PLAIN = re.compile(r"([\d.]+([eE][-+]?\d+)?\s*([^\W\d]*|°)|[^\W\d]\w*)")  # a number or a name, without a sign
DRIVEN = {"speed", "start", "range", "law", "ends"}  # of a driver that is mirrored
SIDED = ("gears", "measures", "errors", "tolerances")  # what may speak of a side that a mirror changes
DIRECTED = {"seat", "seat_on", "misalignment", "only", "backward"}  # keys that do


def group(sketch: Sketch, gesture: Given) -> str:
    """Links are changed together, `what`: "shift" by `by`, m; "mirror" over a line through `at`, upright or `level`;
    "copy", which is shifted by `by` or, with `at`, mirrored; "delete". start: whether the sketch has the places of the
    start, by which a mirrored mechanism without hints is assembled.
    """
    links, what = list(dict.fromkeys(str(name) for name in gesture["links"])), str(gesture["what"])
    if not links or any(name not in sketch.of("links") or name == sketch.ground for name in links):
        raise refused("is no link that moves", ", ".join(links), "choose links that are drawn")
    if sketch.entries.get("space") == "spatial":
        raise refused("is of a mechanism in space", ", ".join(links), "change it in the table or the text")
    title = links[0] if len(links) == 1 else f"{len(links)} links"
    if what == "delete":
        for name in links:
            if name in sketch.of("links"):  # a block goes with what it slides on
                delete(sketch, {"what": ["links", name]})
        return f"Delete {title}"
    if what == "copy":
        links = _copied(sketch, links)
        sketch.made = ("group", " ".join(links))
    if gesture.get("at") is None:
        _Moving(sketch, links, (1, 1), vector(gesture["by"])).do()
    else:
        x, y = vector(gesture["at"])
        signs, offset = ((1, -1), (0.0, 2 * y)) if gesture.get("level") else ((-1, 1), (2 * x, 0.0))
        hints = sketch.section("assembly")
        for name, item in sketch.joints.items():  # without hints the other assembly may be taken
            place = sketch.places.get(f"{item['links'][1]}.{name}") if gesture.get("start") else None
            if place and set(item["links"]) <= set(links) and name not in hints:
                hints[name] = [sketch.length(part) for part in place]
        _Moving(sketch, links, signs, offset).do()
    return f"{ {'shift': 'Move', 'mirror': 'Mirror'}.get(what, 'Copy') } {title}"


@dataclass
class _Moving:
    """A map of the plane for some links."""

    sketch: Sketch
    links: list[str]
    signs: tuple[int, int]
    offset: Vector

    def do(self) -> None:
        """Change what the file states of them."""
        sketch, ground = self.sketch, self.sketch.ground
        mine = {name: item for name, item in sketch.joints.items() if set(item["links"]) & set(self.links)}
        outside = [name for name, item in mine.items() if not set(item["links"]) <= {*self.links, ground}]
        for name in outside:
            if sketch.kind(name) != "revolute":
                raise refused("slides along a link that is not chosen", f"joints.{name}", "choose both links")
        if self.signs != (1, 1):
            self._refuse(mine, outside)
            self._flip(mine)
        pinned = {name for name, item in mine.items() if ground in item["links"]} | _fastened(sketch, self.links)
        fixed, hints = sketch.points(ground), sketch.section("assembly")
        for point in pinned & set(fixed):
            sketch.section("links")[ground]["points"][point] = self._placed(fixed[point])
        for name in mine.keys() & hints.keys():
            if isinstance(hints[name], list):
                hints[name] = self._placed(hints[name])
            elif self.signs != (1, 1) and sketch.kind(name) == "revolute":
                hints[name] = self._angle(name, hints[name])
        moving = {f"{link}.{point}" for link in self.links for point in sketch.points(link)}
        for key in (moving | {f"{ground}.{point}" for point in pinned}) & set(sketch.places):
            x, y = sketch.places[key]
            sketch.places[key] = (self.signs[0] * x + self.offset[0], self.signs[1] * y + self.offset[1])
        sketch.forget()
        for name in outside:
            self._follow(name)

    def _follow(self, joint: str) -> None:
        """The link outside follows with its end; its other joints stay."""
        sketch = self.sketch
        pair = sketch.joints[joint]["links"]
        inside, other = pair if pair[0] in self.links else reversed(pair)
        sketch.write(list(sketch.followed(other, [joint], sketch.places[f"{inside}.{joint}"])))
        sketch.places[f"{other}.{joint}"] = sketch.places[f"{inside}.{joint}"]
        sketch.show(other, sketch.frame(other))

    # ---- numbers ---------------------------------------------------------------------------------------------

    def _value(self, stated: Any, kind: str) -> float:
        """A number or text of the file, SI."""
        dimensions = {path.partition(".")[2]: value for path, value in self.sketch.numbers.items()
                      if path.startswith("dimensions.")}  # fmt: skip
        return float(Quantity.read(stated, KINDS[kind]).evaluate(dimensions))

    def _placed(self, stated: Any) -> Any:
        """A place, perhaps with an axis, on the ground."""
        if isinstance(stated, dict):
            axis = {"axis": _signed(stated["axis"], self.signs)} if "axis" in stated else {}
            return {**stated, "at": self._placed(stated["at"]), **axis}
        parts = []
        for part, sign, by in zip(stated, self.signs, self.offset, strict=True):
            before, name = self._value(part, "length"), self.sketch.unit
            value = round((sign * before + by) / float(unit(name)[0]), 12) + 0.0
            moved = f"{value:.15g} {name}{_limits(part)}" if value or _limits(part) else 0
            parts.append(part if sign * before + by == before else moved)
        return parts

    def _angle(self, joint: str, value: Any) -> Any:
        """The rotation of a joint when it is mirrored: −q, or from the ground over an upright line ±π − q."""
        first, second = self.sketch.joints[joint]["links"]
        half = 0.0 if self.signs[0] > 0 else {first: pi, second: -pi}.get(self.sketch.ground, 0.0)
        return f"{round(degrees(half - self._value(value, 'angle')), 12) + 0.0:.15g} deg{_limits(value)}"

    # ---- mirrored --------------------------------------------------------------------------------------------

    def _refuse(self, joints: Mapping[str, Any], outside: list[str]) -> None:
        """What would not be mirrored with the drawing."""
        sketch, names = self.sketch, {*self.links, *joints}
        if outside:
            what = "is at a link that is not chosen, which would be bent"
            raise refused(what, ", ".join(f"joints.{name}" for name in outside), "choose the links up to the ground")
        if "at" in sketch.section("assembly"):
            raise refused("says where the driver is", "assembly.at", "mirror it in the text")
        for section in ("joint_defaults", "joints", "drivers", "springs", "loads", *SIDED):
            for name, item in (sketch.entries.get(section) or {}).items():
                words = set(re.findall(r"\w+", f"{name} {item}"))
                sided = (section in SIDED and "±" not in str(item)) or (section == "drivers" and set(item) - DRIVEN)
                turning = section == "springs" and sketch.kind(str(item.get("joint"))) == "revolute"
                touched = words & names or section == "joint_defaults"
                if touched and (sided or turning or words & DIRECTED):
                    raise refused("is not mirrored", f"{section}.{name}", "mirror it in the text")

    def _flip(self, joints: Mapping[str, Any]) -> None:
        """Frames of links, drivers and loads, as a mirror shows them."""
        sketch = self.sketch
        for link in self.links:
            entry = sketch.section("links")[link]
            entry["points"] = {point: _mirrored(place) for point, place in sketch.points(link).items()}
            entry |= {"centre": _mirrored(entry["centre"])} if "centre" in entry else {}
        for name in joints.keys() & sketch.of("drivers").keys():
            driver = sketch.section("drivers")[name]
            if sketch.kind(name) == "revolute":
                driver |= {"speed": _negated(driver["speed"])} if "speed" in driver else {}
                if "range" in driver:
                    driver["range"] = [self._angle(name, end) for end in driver["range"]]
                else:
                    driver["start"] = self._angle(name, driver.get("start", 0))
        for name, load in sketch.of("loads").items():
            if load.get("link") in self.links:
                parts = [part for part in (*load.get("force", ()), load.get("moment")) if isinstance(part, str)]
                symbols = {symbol for part in parts for symbol in Quantity.read(part).names}
                if symbols - set(sketch.section("dimensions")):
                    raise refused("follows the motion by a formula", f"loads.{name}", "mirror it in the text")
                signs = (1, -1) if load.get("frame") == "link" else self.signs
                load |= {"force": _signed(load["force"], signs)} if "force" in load else {}
                load |= {"moment": _negated(load["moment"])} if "moment" in load else {}


def _signed(parts: list[Any], signs: tuple[int, int]) -> list[Any]:
    return [part if sign > 0 else _negated(part) for part, sign in zip(parts, signs, strict=True)]


def _mirrored(value: Any) -> Any:
    """A place in the frame of a link, perhaps with an axis: its x stays."""
    if isinstance(value, list):
        return _signed(value, (1, -1))
    angle = {"angle": _negated(value["angle"])} if "angle" in value else {}
    return {**value, **{key: _mirrored(value[key]) for key in ("at", "axis") if key in value}, **angle}


def _negated(stated: Any) -> Any:
    """A number or text of the file with the other sign; limits that are alike on both sides stay."""
    if not isinstance(stated, str):
        return -stated if stated else stated
    limits = _limits(stated)
    value = stated.removesuffix(limits).strip()
    if value.startswith("-") and PLAIN.fullmatch(value[1:].strip()):
        return f"{value[1:].strip()}{limits}"
    return f"-{value}{limits}" if PLAIN.fullmatch(value) else f"-({value}){limits}"


def _limits(value: Any) -> str:
    """The limits of a text of the file; refused where they differ, for they would be on other sides."""
    limits = LIMITS.search(value) if isinstance(value, str) else None
    if limits and "±" not in limits[0]:
        raise refused(f"'{value}' has limits that differ", "a number", "change it in the text")
    return limits[0] if limits else ""


def _fastened(sketch: Sketch, links: list[str]) -> set[str]:
    """Points of the ground that springs of some links are fastened to."""
    ends = [[str(end).split(".") for end in item.get("between") or ()] for item in sketch.of("springs").values()]
    return {point for pair in ends if any(link in links for link, *_ in pair)
            for link, point in pair if link == sketch.ground}  # fmt: skip


# ---- copied ---------------------------------------------------------------------------------------------------


def _copied(sketch: Sketch, links: list[str]) -> list[str]:
    """The links again, on the spot, with what is between them, under names that are free.

    All entries are copied with the links and their points renamed; what is new in that copy is added.
    """
    ground, part = sketch.ground, copy.deepcopy(sketch.entries)
    inner = [name for name, item in sketch.joints.items()
             if set(item["links"]) <= {*links, ground} and set(item["links"]) & set(links)]  # fmt: skip
    names: dict[str, str] = {}
    for link in links:
        names[link] = numbered(sketch, "links", link.rstrip("0123456789") or link)
        sketch.section("links")[names[link]] = {"points": {}}  # its name is spoken for
    points: dict[str, str] = {}
    of_links = [point for link in links for point in sketch.points(link)]
    for point in dict.fromkeys([*inner, *of_links, *sorted(_fastened(sketch, links))]):
        points[point] = letter(sketch, points.values())
    for section, pairs in (("links", names), ("joints", points)):
        for old, new in pairs.items():
            part = renamed(part, section, old, new)
    _add(sketch, part, names, points)
    for key, place in list(sketch.places.items()):
        link, _, point = key.rpartition(".")
        if link in {*names, ground} and point in points:
            sketch.places[f"{names.get(link, link)}.{points[point]}"] = place
    sketch.forget()
    return list(names.values())


def _add(sketch: Sketch, part: Mapping[str, Any], names: Mapping[str, str], points: Mapping[str, str]) -> None:
    """Add what has new names in a copy of the entries, and what acts between those."""
    ground, links, joints = sketch.ground, set(names.values()), set(points.values())
    for section, copied in (("links", links), ("joints", joints), ("drivers", joints), ("assembly", joints)):
        entries = part.get(section) or {}
        sketch.section(section).update({name: item for name, item in entries.items() if name in copied})
    fixed = part["links"].get(ground, {}).get("points", {})
    sketch.section("links")[ground]["points"] |= {name: at for name, at in fixed.items() if name in joints}
    for section in ("loads", "springs", "gears"):
        for name, item in (part.get(section) or {}).items():
            parts = {part.partition(".")[0] for part in spoken_of(item)}
            if parts <= {*links, *joints, ground} and item != sketch.section(section)[name]:
                sketch.section(section)[numbered(sketch, section, name.rstrip("0123456789") or name)] = item
