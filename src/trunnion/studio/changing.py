"""Changing a drawing: values, what goes, other names, and several links at once, wherever a part is referred to.

Links are shifted, mirrored and copied with the joints, loads, springs and gears between them through one map of the
plane, p' = (sx x + a, sy y + b) with signs sx, sy. A mirrored link keeps its frame at its points: its y changes sign,
and the rotation of a joint on the ground, which was q, becomes π − q or −q. What is no coordinate, angle, force or
moment is not mirrored but refused.
"""

from __future__ import annotations

import copy
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import degrees, pi
from typing import Any

from trunnion.model.quantity import Quantity
from trunnion.model.rewrite import renamed
from trunnion.model.units import KINDS, unit
from trunnion.studio.drawing import NUMBER, acted_on, free, letter, names_in_use, numbered, rename_point, vector
from trunnion.studio.findings import spoken
from trunnion.studio.sketch import LIMITS, Sketch, coordinates, refused

Fields = Mapping[str, Any]
SECTIONS = {
    "links": "link", "joints": "joint", "loads": "load", "springs": "spring", "drivers": "driver", "gears": "gear pair"
}  # fmt: skip
NAMED = ("links", "joints", "dimensions", "loads", "springs", "gears")
SIDES = ("links", "joints")  # of "link.point"
DEFINED = re.compile(r"\s*([^\W\d]\w*)\s*=(.+)")  # crank = 30 mm
PLAIN = re.compile(r"([\d.]+([eE][-+]?\d+)?\s*([^\W\d]*|°)|[^\W\d]\w*)")  # a number or a name, without a sign
DRIVEN = {"speed", "start", "range", "law", "ends"}  # of a driver that is mirrored
SIDED = ("gears", "measures", "errors", "tolerances")  # what may speak of a side that a mirror changes
DIRECTED = {"seat", "seat_on", "misalignment", "only", "backward"}  # keys that do


# ---- values -----------------------------------------------------------------------------------------------------


def put_value(sketch: Sketch, gesture: Fields) -> str:
    """An entry gets a value; without one it goes."""
    *parents, last = gesture["path"]
    section, name, *inner = gesture["path"] if len(parents) > 1 else ("", "")
    if section in SECTIONS:  # a value is not enough to make a part: what is gone stays gone
        in_loop = {row.get("link") for row in sketch.rows if section == "links"}  # links that need not be stated
        point = inner[1] if section == "links" and inner[0] == "points" and len(inner) > 1 else None
        if name not in sketch.names(section) | in_loop or (point is not None and point not in sketch.points(name)):
            raise refused("is not there", ".".join(map(str, gesture["path"])), "choose what is drawn")
    group: Any = sketch.entries
    for key in parents:
        group = group[key] if isinstance(group, list) else group.setdefault(key, {})
        if not isinstance(group, (dict, list)):
            raise refused("is a single value", ".".join(map(str, parents)), "change it in the text of the model")
    named = [*parents, last]
    if parents[:1] == ["loop"] and len(parents) > 1:
        named[1] = sketch.rows[parents[1]].get("joint")
    path, value = ".".join(map(str, named)), gesture.get("value")
    words = spoken(path)
    if value is not None:
        group[last] = value = _written(sketch, value, path not in ("name", "notes") and parents != ["dimensions"])
        text_of_value = ("no", "yes")[value] if isinstance(value, bool) else value
        return f"Set {words} to {', '.join(map(str, value)) if isinstance(value, list) else text_of_value}"
    if parents[:1] == ["gears"] and last in ("ratio", "radius", "lead"):
        raise refused("is what makes a gear pair", path, "type another, or delete the gear pair")
    if isinstance(group, dict):
        group.pop(last, None)
    return f"Remove {words}"


def _written(sketch: Sketch, value: Any, defines: bool) -> Any:
    """What was typed, as it is written: "0.3" as a number; "crank = 30 mm" makes a dimension and is its name."""
    if isinstance(value, list):
        return [_written(sketch, part, defines) for part in value]
    match = DEFINED.fullmatch(value) if defines and isinstance(value, str) else None
    if match:
        sketch.section("dimensions")[match[1]] = _written(sketch, match[2].strip(), False)
        return match[1]
    if isinstance(value, str) and NUMBER.fullmatch(value.strip()):
        number = float(value)
        return int(number) if number.is_integer() and abs(number) < 1e15 and "." not in value else number
    return value


# ---- what goes --------------------------------------------------------------------------------------------------


def delete(sketch: Sketch, gesture: Fields) -> str:
    """An entry goes, and what cannot be without it."""
    section, name = map(str, gesture["what"])
    before = _orphans(sketch)  # of an unfinished file: it stays
    in_loop = [(index, row) for index, row in enumerate(sketch.rows) if row.get(section[:-1]) == name]
    if section == "points":
        link, name = free(sketch, name)
        del sketch.section("links")[link]["points"][name]
    elif section in SIDES and in_loop:
        # a joint goes with the link after it, that before it where the ground comes after
        (index, row), *_ = in_loop
        if len(sketch.rows) < 3 or (section, name) == ("links", sketch.ground):
            raise refused("cannot go: the loop would not close", name, "change its type, twist or distance")
        if row.get("link") == sketch.ground:
            sketch.rows[index - 1]["link"] = sketch.ground
        del sketch.entries["loop"][index]
    else:
        if section not in SECTIONS or name not in sketch.section(section):
            raise refused("is not there", f"{section}.{name}", "choose what is drawn")
        if section == "links" and name == sketch.ground:
            raise refused("is the ground", name, "delete its joints")
        del sketch.section(section)[name]
    while gone := _orphans(sketch) - before:
        for *parents, last in sorted(gone, key=len, reverse=True):  # points before their link
            group = sketch.entries
            for key in parents:
                group = group[key]
            del group[last]
        sketch.forget()
    return f"Delete {SECTIONS.get(section, 'point')} {name}"


def _orphans(sketch: Sketch) -> set[tuple[str, ...]]:
    """Paths of entries that are nothing by themselves: what they join or act on is not there."""
    links, pairs, ground = sketch.of("links"), sketch.joints, sketch.ground
    in_loop = {row.get("link") for row in sketch.rows}
    joints = {*pairs, *(row.get("joint") for row in sketch.rows)}
    needs = {(section, name): acted_on(item) for section in ("loads", "springs", "gears")
             for name, item in sketch.of(section).items()}  # fmt: skip
    parts = {*joints, *links, *in_loop, *(f"{link}.{point}" for link in links for point in sketch.points(link))}
    orphans: set[tuple[str, ...]] = {path for path, acted in needs.items() if not acted <= parts}
    orphans |= {("joints", name) for name, item in pairs.items() if not set(item["links"]) <= set(links)}
    of_joints = ("drivers", "assembly", "joints") if in_loop else ("drivers", "assembly")
    orphans |= {(section, name) for section in of_joints for name in sketch.names(section) - joints}
    orphans |= {("links", name) for name in links if in_loop and name not in in_loop}
    used = joints.union(*needs.values())
    for link in links:
        points = sketch.points(link)
        axes = [name for name, entry in points.items() if isinstance(entry, dict) and "axis" in entry]
        lost = points if link == ground else axes
        orphans |= {("links", link, "points", name) for name in lost if not {name, f"{link}.{name}"} & used}
        types = {item.get("type", "revolute") for item in pairs.values() if link in item["links"]}
        on_one_spot = len(points) > 1 and all(coordinates(entry) == [0, 0] for entry in points.values())
        if axes and on_one_spot and len(types) < 2 and link != ground:
            orphans.add(("links", link))  # a block that slides no longer, or nothing is pinned to it
    return orphans


# ---- a row of a loop, names ---------------------------------------------------------------------------------------


def add_row(sketch: Sketch, gesture: Fields) -> str:
    """A row of the table of a loop, before that of the ground: a revolute joint, a link without twist or distance."""
    joint, link = letter(sketch), numbered(sketch, "links", "link")
    sketch.entries["loop"].insert(-1, {"joint": joint, "type": "revolute", "link": link, "twist": 0, "distance": 0})
    sketch.made = ("joints", joint)
    return f"Add joint {joint}"


def rename(sketch: Sketch, gesture: Fields) -> str:
    """A part gets another name wherever it is referred to; a driver has that of its joint."""
    (section, old), new = map(str, gesture["what"]), str(gesture["to"]).strip()
    section = "joints" if section == "drivers" else section
    in_rows = section in SIDES and any(row.get(section[:-1]) == old for row in sketch.rows)
    if not (section == "points" or in_rows or (section in NAMED and old in sketch.section(section))):
        raise refused("is not there", f"{section}.{old}", "choose what is drawn")
    if not new or "." in new or new in names_in_use(sketch) | sketch.names(section):
        raise refused(f"'{new}' is not a free name", f"{section}.{old}", "choose another")
    if section == "points":
        rename_point(sketch, old, new)
        return f"Rename {old} to {new}"
    sketch.entries = dict(renamed(sketch.entries, section, old, new))
    if section == "links" and old == sketch.ground:
        sketch.entries["ground"] = new
    if section in SIDES:
        side = SIDES.index(section)
        for key in list(sketch.places):
            parts = key.split(".")
            parts[side] = new if parts[side] == old else parts[side]
            sketch.places[".".join(parts)] = sketch.places.pop(key)
    return f"Rename {old} to {new}"


# ---- several links at once ----------------------------------------------------------------------------------------


def group(sketch: Sketch, gesture: Fields) -> str:
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
        _Map(sketch, links, (1, 1), vector(gesture["by"])).apply()
    else:
        at, level = vector(gesture["at"]), gesture.get("level")
        hints = sketch.section("assembly")
        for name, item in sketch.joints.items():  # without hints the other assembly may be taken
            place = sketch.places.get(f"{item['links'][1]}.{name}") if gesture.get("start") else None
            if place is not None and set(item["links"]) <= set(links) and name not in hints:
                hints[name] = sketch.place(place)
        signs, offset = ((1, -1), complex(0.0, 2 * at.imag)) if level else ((-1, 1), complex(2 * at.real))
        _Map(sketch, links, signs, offset).apply()
    return f"{ {'shift': 'Move', 'mirror': 'Mirror'}.get(what, 'Copy') } {title}"


@dataclass
class _Map:
    """A map of the plane for some links."""

    sketch: Sketch
    links: list[str]
    signs: tuple[int, int]
    offset: complex

    @cached_property
    def dimensions(self) -> Mapping[str, Any]:
        """Dimensions of the model by their names, SI."""
        numbers = self.sketch.numbers.items()
        return {path.partition(".")[2]: value for path, value in numbers if path.startswith("dimensions.")}

    def apply(self) -> None:
        """Change what the file states of them."""
        sketch, ground, mirrors = self.sketch, self.sketch.ground, self.signs != (1, 1)
        joints = {name: item for name, item in sketch.joints.items() if set(item["links"]) & set(self.links)}
        outside = [name for name, item in joints.items() if not set(item["links"]) <= {*self.links, ground}]
        for name in outside:
            if sketch.kind(name) != "revolute":
                raise refused("slides along a link that is not chosen", f"joints.{name}", "choose both links")
        if mirrors:
            self._refuse(joints, outside)
            self._flip(joints)
        pinned = {name for name, item in joints.items() if ground in item["links"]} | _fastened(sketch, self.links)
        fixed, hints = sketch.points(ground), sketch.section("assembly")
        for point in pinned & set(fixed):
            sketch.section("links")[ground]["points"][point] = self._placed(fixed[point])
        for name in joints.keys() & hints.keys():
            if isinstance(hints[name], list):
                hints[name] = self._placed(hints[name])
            elif mirrors and sketch.kind(name) == "revolute":
                hints[name] = self._angle(name, hints[name])
        moving = {f"{link}.{point}" for link in self.links for point in sketch.points(link)}
        for key in (moving | {f"{ground}.{point}" for point in pinned}) & set(sketch.places):
            place = sketch.places[key]
            sketch.places[key] = complex(self.signs[0] * place.real, self.signs[1] * place.imag) + self.offset
        sketch.forget()
        for name in outside:  # the link outside follows with its end; its other joints stay
            first, second = sketch.joints[name]["links"]
            inside, other = (first, second) if first in self.links else (second, first)
            place = sketch.places[f"{inside}.{name}"]
            sketch.write(sketch.followed(other, [name], place))
            sketch.places[f"{other}.{name}"] = place
            sketch.show(other, sketch.frame(other))

    def _value(self, stated: Any, kind: str) -> float:
        """A number or text of the file, SI."""
        return float(Quantity.read(stated, KINDS[kind]).evaluate(self.dimensions))

    def _placed(self, stated: Any) -> Any:
        """A place, perhaps with an axis, on the ground."""
        if isinstance(stated, dict):
            axis = {"axis": _signed(stated["axis"], self.signs)} if "axis" in stated else {}
            return {**stated, "at": self._placed(stated["at"]), **axis}
        parts, name = [], self.sketch.unit
        for part, sign, by in zip(stated, self.signs, (self.offset.real, self.offset.imag), strict=True):
            before = self._value(part, "length")
            value = round((sign * before + by) / float(unit(name)[0]), 12) + 0.0
            moved = f"{value:.15g} {name}{_limits(part)}" if value or _limits(part) else 0
            parts.append(part if sign * before + by == before else moved)
        return parts

    def _angle(self, joint: str, value: Any) -> Any:
        """The rotation of a joint when it is mirrored: −q, or from the ground over an upright line ±π − q."""
        first, second = self.sketch.joints[joint]["links"]
        half = 0.0 if self.signs[0] > 0 else {first: pi, second: -pi}.get(self.sketch.ground, 0.0)
        return f"{round(degrees(half - self._value(value, 'angle')), 12) + 0.0:.15g} deg{_limits(value)}"

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
                if symbols - sketch.names("dimensions"):
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


def _copied(sketch: Sketch, links: list[str]) -> list[str]:
    """The links again, on the spot, with what is between them, under names that are free.

    All entries are copied with the links and their points renamed; what is new in that copy is added.
    """
    ground, part = sketch.ground, copy.deepcopy(sketch.entries)
    inner = [name for name, item in sketch.joints.items()
             if set(item["links"]) <= {*links, ground} and set(item["links"]) & set(links)]  # fmt: skip
    names: dict[str, str] = {}
    for link in links:
        names[link] = numbered(sketch, "links", link.rstrip("0123456789") or link, names.values())
    points: dict[str, str] = {}
    of_links = [point for link in links for point in sketch.points(link)]
    for point in dict.fromkeys([*inner, *of_links, *sorted(_fastened(sketch, links))]):
        points[point] = letter(sketch, {*names.values(), *points.values()})
    for section, pairs in (("links", names), ("joints", points)):
        for old, new in pairs.items():
            part = renamed(part, section, old, new)
    for section in ("links", "joints", "drivers", "assembly"):
        present, copied = sketch.section(section), part.get(section) or {}
        present |= {name: item for name, item in copied.items() if name in {*names.values(), *points.values()}}
    fixed, copied = sketch.section("links")[ground]["points"], part["links"][ground]["points"]
    fixed |= {name: at for name, at in copied.items() if name in points.values()}
    parts = {*names.values(), *points.values(), ground}
    for section in ("loads", "springs", "gears"):
        for name, item in (part.get(section) or {}).items():
            acted = {end.partition(".")[0] for end in acted_on(item)}
            if acted <= parts and item != sketch.section(section)[name]:
                sketch.section(section)[numbered(sketch, section, name.rstrip("0123456789") or name)] = item
    for key, place in list(sketch.places.items()):
        link, _, point = key.rpartition(".")
        if link in {*names, ground} and point in points:
            sketch.places[f"{names.get(link, link)}.{points[point]}"] = place
    sketch.forget()
    return list(names.values())
