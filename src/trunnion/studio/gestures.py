"""What a hand does to a drawing, as changes of the model's plain data: one function for each gesture."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Mapping
from math import atan2, cos, degrees, hypot, sin
from typing import Any

from trunnion.errors import Finding, MechanismError
from trunnion.studio.sketch import Frame, Sketch, Vector

__all__ = ["GESTURES", "Gesture", "done"]

Given = Mapping[str, Any]
Gesture = Callable[[Sketch, Given], str]

SECTIONS = {"links": "link", "joints": "joint", "loads": "load", "springs": "spring", "drivers": "driver"}
LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
SHORTEST = 1e-9  # m
NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


def done(sketch: Sketch, given: Given) -> str:
    """Do a gesture; what it is called. MechanismError if it cannot be done."""
    gesture = GESTURES.get(str(given.get("do")))
    if gesture is None:
        raise MechanismError(Finding(f"'{given.get('do')}' is no gesture", "studio", f"use {', '.join(GESTURES)}"))
    try:
        said = gesture(sketch, given)
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        if isinstance(error, MechanismError):
            raise
        what = f"the gesture '{given['do']}' does not fit the model ({error})"
        raise MechanismError(Finding(what, "studio", "undo, or correct the text of the model")) from error
    sketch.forget()
    return said


def _refused(what: str, where: str, remedy: str) -> MechanismError:
    return MechanismError(Finding(what, where, remedy))


def _vector(given: Any) -> Vector:
    x, y = given
    return float(x), float(y)


# ---- names ----------------------------------------------------------------------------------------------------


def _taken(sketch: Sketch) -> set[str]:
    links = sketch.of("links")
    points = (name for link in links for name in sketch.points(link))
    return {*sketch.joints, *points, *links, *sketch.of("dimensions")}


def _letter(sketch: Sketch) -> str:
    """The next free name of a point: A, B, …, Z, A2, …"""
    taken = _taken(sketch)
    names = (letter + number for number in ("", *map(str, range(2, 1000))) for letter in LETTERS)
    return next(name for name in names if name not in taken)


def _numbered(sketch: Sketch, section: str, stem: str) -> str:
    taken = {*sketch.section(section), *_taken(sketch)}
    return next(name for number in itertools.count(1) if (name := f"{stem}{number}") not in taken)


# ---- drawing --------------------------------------------------------------------------------------------------


def _link(sketch: Sketch, given: Given) -> str:
    """A bar from one end to another; ends on joints and points are joined with them."""
    _ground(sketch)
    ends = [_end(sketch, given[key]) for key in ("from", "to")]
    (x, y), (a, b) = places = [place for place, _ in ends]
    length = hypot(a - x, b - y)
    if length <= SHORTEST:
        raise _refused("the link has no length", "links", "click at two places")
    name = _numbered(sketch, "links", "link")
    frame = Frame(x, y, (a - x) / length, (b - y) / length)
    sketch.section("links")[name] = {"points": {}}
    for (_, join), place, along in zip(ends, places, (0.0, length), strict=True):
        local = [0, 0] if along == 0.0 else [sketch.length(along), 0]
        sketch.forget()
        point = _joined(sketch, name, join, place)
        sketch.section("links")[name]["points"][point] = local
    sketch.forget()
    sketch.show(name, frame)
    return f"Draw {name}"


def _ground(sketch: Sketch) -> None:
    """The fixed link is there."""
    sketch.section("links").setdefault(sketch.ground, {"points": {}})
    sketch.section("links")[sketch.ground].setdefault("points", {})
    sketch.section("joints")


def _end(sketch: Sketch, end: Any) -> tuple[Vector, Any]:
    """Where an end of a link is, and what it is joined to."""
    if isinstance(end, str):
        link, point = _holder(sketch, end)
        return sketch.places[f"{link}.{point}"], end
    if isinstance(end, Mapping):
        return _vector(end["ground"]), "ground"
    return _vector(end), None


def _holder(sketch: Sketch, name: str) -> tuple[str, str]:
    """Link and point of a joint, or of a free point "link.P"."""
    if name in sketch.joints:
        return sketch.joints[name]["links"][1], name
    link, _, point = name.partition(".")
    if point not in sketch.points(link):
        raise _refused("is not a joint or a point", name, "choose one that is drawn")
    return link, point


def _joined(sketch: Sketch, link: str, join: Any, place: Vector) -> str:
    """The name of an end of a new link, and the joint that it makes."""
    if join is None:
        return _letter(sketch)
    if join == "ground":
        point = _letter(sketch)
        _put(sketch, sketch.ground, point, place)
        _pin(sketch, point, sketch.ground, link, place)
        return point
    other, point = _holder(sketch, join)
    if join in sketch.joints or point in sketch.joints:  # a second pin on that spot
        here, point = point, _letter(sketch)
        sketch.section("links")[other]["points"][point] = _coordinates(sketch, other, here)
        sketch.forget()
    sketch.places[f"{other}.{point}"] = place
    _pin(sketch, point, other, link, place)
    return point


def _coordinates(sketch: Sketch, link: str, point: str) -> list[Any]:
    """The stated coordinates of a point."""
    stated = sketch.points(link)[point]
    return list(stated["at"] if isinstance(stated, dict) else stated)


def _put(sketch: Sketch, link: str, point: str, place: Vector, axis: float | None = None) -> None:
    """A point on a link where a place is; axis: its direction in the plane, rad."""
    local = sketch.frame(link).into(place)
    at = [sketch.length(value) if abs(value) > SHORTEST else 0 for value in local]
    stated = at if axis is None else {"at": at, "axis": [round(cos(axis), 12), round(sin(axis), 12)]}
    sketch.section("links")[link]["points"][point] = stated
    sketch.places[f"{link}.{point}"] = place
    sketch.forget()


def _pin(sketch: Sketch, name: str, first: str, second: str, place: Vector) -> None:
    """A revolute joint; where it is at the start chooses the assembly."""
    sketch.section("joints")[name] = {"type": "revolute", "links": [first, second]}
    sketch.places[f"{second}.{name}"] = place
    if first != sketch.ground:
        sketch.section("assembly")[name] = [sketch.length(part) for part in place]


def _pinned(sketch: Sketch, given: Given) -> str:
    """A free point becomes a pin on the ground."""
    link, point = _free(sketch, given["point"])
    _ground(sketch)
    place = sketch.places[f"{link}.{point}"]
    _put(sketch, sketch.ground, point, place)
    _pin(sketch, point, sketch.ground, link, place)
    return f"Pin {point} to the ground"


def _free(sketch: Sketch, name: str) -> tuple[str, str]:
    link, _, point = str(name).partition(".")
    if point not in sketch.points(link):
        raise _refused("is not a free point", str(name), "choose the free end of a link")
    if point in sketch.joints:
        raise _refused("is a joint already", str(name), "delete the joint first, or draw another link from it")
    return link, point


def _slide(sketch: Sketch, given: Given) -> str:
    """A free point is guided along a line on the ground: by a block that is pinned to it."""
    link, point = _free(sketch, given["joint"])
    _ground(sketch)
    place, angle = sketch.places[f"{link}.{point}"], float(given.get("angle", 0.0))
    block, guide = _numbered(sketch, "links", "block"), _letter(sketch)
    sketch.section("links")[block] = {"points": {point: [0, 0], guide: {"at": [0, 0], "axis": [1, 0]}}}
    sketch.forget()
    _put(sketch, sketch.ground, guide, place, angle)
    sketch.section("joints")[guide] = {"type": "prismatic", "links": [sketch.ground, block]}
    _pin(sketch, point, link, block, place)
    sketch.show(block, Frame(*place, cos(angle), sin(angle)))
    return f"Guide {point}"


def _added_point(sketch: Sketch, given: Given) -> str:
    """A point on a link."""
    _ground(sketch)
    point = _letter(sketch)
    _put(sketch, str(given["link"]), point, _vector(given["at"]))
    return f"Add point {point}"


# ---- what acts on it --------------------------------------------------------------------------------------------


def _driver(sketch: Sketch, given: Given) -> str:
    """A joint is driven, from where it is shown."""
    joint = str(given["joint"])
    if joint not in sketch.joints:
        raise _refused("is not a joint", joint, "choose a joint")
    if not given.get("add"):
        for other in list(sketch.section("drivers")):
            del sketch.section("drivers")[other]
    kind, (first, second) = sketch.joints[joint].get("type"), sketch.joints[joint]["links"]
    if kind == "prismatic":
        entry = {"speed": given.get("speed") or "10 mm/s", "range": [0, sketch.length(0.2 * sketch.size)]}
    else:
        turn = [atan2(frame.s, frame.c) for frame in (sketch.frame(first), sketch.frame(second))]
        start = round(degrees(turn[1] - turn[0]) % 360.0, 4) % 360.0
        entry = {"speed": given.get("speed") or "60 rpm"} | ({"start": f"{start:g} deg"} if start else {})
    sketch.section("drivers")[joint] = entry
    return f"Drive {joint}"


def _load(sketch: Sketch, given: Given) -> str:
    """A force at a point of a link."""
    name = _numbered(sketch, "loads", "load")
    sketch.section("loads")[name] = {"link": given["link"], "at": given["at"], "force": list(given["force"])}
    return f"Add {name}"


def _spring(sketch: Sketch, given: Given) -> str:
    """A spring between two points, without force as it is drawn."""
    name, ends = _numbered(sketch, "springs", "spring"), [str(end) for end in given["between"]]
    (x, y), (a, b) = (sketch.places[end] for end in ends)
    entry = {"between": ends, "stiffness": given.get("stiffness") or "1 N/mm"}
    sketch.section("springs")[name] = entry | {"free_length": sketch.length(hypot(a - x, b - y))}
    return f"Add {name}"


# ---- changing -----------------------------------------------------------------------------------------------------


def _move(sketch: Sketch, given: Given) -> str:
    """A joint or point goes to a place."""
    point, to = str(given["point"]), _vector(given["to"])
    sketch.write(sketch.moved(point, to))
    hints = sketch.entries.get("assembly") or {}
    if isinstance(hints.get(point), list) and not given.get("index"):
        hints[point] = [sketch.length(part) for part in to]
    for link in dict.fromkeys(_links_at(sketch, point)):
        sketch.places[f"{link}.{point.rpartition('.')[2]}"] = to
    for link in _links_at(sketch, point):
        sketch.show(link, sketch.frame(link))
    return f"Move {point}"


def _links_at(sketch: Sketch, point: str) -> list[str]:
    return list(sketch.joints[point]["links"]) if point in sketch.joints else [point.partition(".")[0]]


def _set(sketch: Sketch, given: Given) -> str:
    """An entry gets a value; without one it goes."""
    *way, last = given["path"]
    group: Any = sketch.entries
    for key in way:
        group = group[key] if isinstance(group, list) else group.setdefault(key, {})
        if not isinstance(group, (dict, list)):
            raise _refused("is a single value", ".".join(map(str, way)), "change it in the text of the model")
    stated, value = ".".join(map(str, given["path"])), given.get("value")
    if value is not None:
        group[last] = _typed(value)
        return f"Set {stated} to {', '.join(map(str, value)) if isinstance(value, list) else value}"
    if isinstance(group, dict):
        group.pop(last, None)
    return f"Remove {stated}"


def _typed(value: Any) -> Any:
    """What was typed, as it is written: "0.3" as a number."""
    if isinstance(value, list):
        return [_typed(part) for part in value]
    if isinstance(value, str) and NUMBER.fullmatch(value.strip()):
        number = float(value)
        return int(number) if number.is_integer() and abs(number) < 1e15 and "." not in value else number
    return value


def _delete(sketch: Sketch, given: Given) -> str:
    """An entry goes, and what cannot be without it."""
    section, name = map(str, given["what"])
    if section == "points":
        link, point = _free(sketch, name)
        del sketch.section("links")[link]["points"][point]
        _drop(sketch, "loads", lambda load: load.get("link") == link and load.get("at") == point)
        _drop(sketch, "springs", lambda spring: name in (spring.get("between") or ()))
        return f"Delete point {point}"
    if section not in SECTIONS or name not in sketch.of(section):
        raise _refused("is not there", f"{section}.{name}", "choose what is drawn")
    if section == "links" and name == sketch.ground:
        raise _refused("is the ground", name, "delete its joints")
    del sketch.section(section)[name]
    gone = [name] if section == "joints" else []
    if section == "links":
        gone = [joint for joint, one in sketch.joints.items() if name in one["links"]]
        _drop(sketch, "joints", lambda joint: name in (joint.get("links") or ()))
        _drop(sketch, "loads", lambda load: load.get("link") == name)
        _drop(sketch, "springs", lambda spring: any(end.startswith(f"{name}.") for end in spring.get("between") or ()))
    for joint in gone:
        _without_joint(sketch, joint)
    return f"Delete {SECTIONS[section]} {name}"


def _without_joint(sketch: Sketch, joint: str) -> None:
    """What a joint that is gone leaves behind: its driver and hint go, and its point on the ground."""
    for section in ("drivers", "assembly"):
        if isinstance(sketch.entries.get(section), dict):
            sketch.entries[section].pop(joint, None)
    ground = sketch.section("links").get(sketch.ground, {})
    ground.get("points", {}).pop(joint, None)


def _drop(sketch: Sketch, section: str, gone: Callable[[Mapping[str, Any]], bool]) -> None:
    for name, one in sketch.of(section).items():
        if gone(one):
            del sketch.section(section)[name]


# ---- renaming -----------------------------------------------------------------------------------------------------


def _rename(sketch: Sketch, given: Given) -> str:
    """A link, joint or dimension gets another name wherever it is spoken of."""
    (section, old), new = map(str, given["what"]), str(given["to"]).strip()
    if section not in ("links", "joints", "dimensions") or old not in sketch.section(section):
        raise _refused("is not there", f"{section}.{old}", "choose a link, joint or dimension")
    if new in _taken(sketch) or not new or "." in new:
        raise _refused(f"'{new}' is not a free name", f"{section}.{old}", "choose another")
    sketch.entries = dict(_renamed(sketch.entries, section, old, new))
    if section == "links" and old == sketch.ground:
        sketch.entries["ground"] = new
    side = 0 if section == "links" else 1
    for key in [key for key in sketch.places if key.split(".")[side] == old] if section != "dimensions" else ():
        parts = key.split(".")
        parts[side] = new
        sketch.places[".".join(parts)] = sketch.places.pop(key)
    return f"Rename {old} to {new}"


def _renamed(group: Any, section: str, old: str, new: str, way: tuple[str, ...] = ()) -> Any:
    """The entries with another name in keys and in what speaks of it."""
    if isinstance(group, dict):
        named = _named(section, way)
        return {
            (new if named and key == old else key): _renamed(one, section, old, new, (*way, key))
            for key, one in group.items()
        }
    if isinstance(group, list):
        return [_renamed(one, section, old, new, way) for one in group]
    return _respoken(group, section, old, new, way) if isinstance(group, str) else group


def _named(section: str, way: tuple[str, ...]) -> bool:
    """Whether the keys of a group are names of the section."""
    if way == (section,):
        return True
    of_joints = way in (("drivers",), ("assembly",)) or (len(way) == 3 and way[0] == "links" and way[2] == "points")
    return section == "joints" and of_joints


def _respoken(text: str, section: str, old: str, new: str, way: tuple[str, ...]) -> str:
    """A text that speaks of a name, with the new one."""
    last = way[-1] if way else ""
    if section == "links":
        if last == "between":
            return re.sub(rf"^{re.escape(old)}(?=\.)", new, text)
        return new if text == old and last in ("links", "link", "ground") else text
    if section == "joints":
        if last == "between":
            return re.sub(rf"(?<=\.){re.escape(old)}$", new, text)
        return new if text == old and last in ("at", "joint", "joints") else text
    stated = way[:1] not in (("name",), ("notes",), ("references",)) and last not in ("links", "link", "at", "type")
    return re.sub(rf"(?<![\w.]){re.escape(old)}(?![\w.])", new, text) if stated else text


GESTURES: dict[str, Gesture] = {
    "link": _link,
    "pin": _pinned,
    "slide": _slide,
    "add-point": _added_point,
    "driver": _driver,
    "load": _load,
    "spring": _spring,
    "move": _move,
    "set": _set,
    "delete": _delete,
    "rename": _rename,
}
