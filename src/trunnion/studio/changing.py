"""Changing a drawing: values, what goes, and other names, wherever a part is spoken of."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

from trunnion.model.renaming import renamed
from trunnion.studio.findings import spoken
from trunnion.studio.sketch import Sketch
from trunnion.studio.strokes import NUMBER, free, letter, numbered, refused, rename_point, taken

__all__ = ["add_row", "delete", "put_value", "rename"]

Given = Mapping[str, Any]
SECTIONS = {
    "links": "link", "joints": "joint", "loads": "load", "springs": "spring", "drivers": "driver", "gears": "gear pair"
}  # fmt: skip
NAMED = ("links", "joints", "dimensions", "loads", "springs", "gears")
SIDES = ("links", "joints")  # of "link.point"
DEFINED = re.compile(r"\s*([^\W\d]\w*)\s*=(.+)")  # crank = 30 mm


def put_value(sketch: Sketch, gesture: Given) -> str:
    """An entry gets a value; without one it goes."""
    *parents, last = gesture["path"]
    _refuse_missing(sketch, gesture["path"])
    group: Any = sketch.entries
    for key in parents:
        group = group[key] if isinstance(group, list) else group.setdefault(key, {})
        if not isinstance(group, (dict, list)):
            raise refused("is a single value", ".".join(map(str, parents)), "change it in the text of the model")
    in_loop = parents[:1] == ["loop"] and len(parents) > 1
    way_told = [parents[0], sketch.rows[parents[1]].get("joint"), *parents[2:]] if in_loop else parents
    path, value = ".".join(map(str, [*way_told, last])), gesture.get("value")
    words = spoken(path)
    if value is not None:
        if path not in ("name", "notes") and parents != ["dimensions"]:
            value = _defined(sketch, value)
        group[last] = _typed(value)
        text_of_value = ("no", "yes")[value] if isinstance(value, bool) else value
        return f"Set {words} to {', '.join(map(str, value)) if isinstance(value, list) else text_of_value}"
    if parents[:1] == ["gears"] and last in ("ratio", "radius", "lead"):
        raise refused("is what makes a gear pair", path, "type another, or delete the gear pair")
    if isinstance(group, dict):
        group.pop(last, None)
    return f"Remove {words}"


def _refuse_missing(sketch: Sketch, path: list[Any]) -> None:
    """A value is no way to make a part: one that is gone does not come back as a group without its links."""
    section, name, *inner = path if len(path) > 2 else ("", "")
    if section not in SECTIONS:
        return
    rows = sketch.entries.get("loop") if section == "links" else None  # its links need not be stated
    links = {row.get("link") for row in rows or () if isinstance(row, dict)}
    point = inner[1] if section == "links" and inner[0] == "points" and len(inner) > 1 else None
    if name not in {*sketch.section(section), *links} or (point is not None and point not in sketch.points(name)):
        raise refused("is not there", ".".join(map(str, path)), "choose what is drawn")


def _defined(sketch: Sketch, value: Any) -> Any:
    """The name of a dimension that "crank = 30 mm" makes."""
    if isinstance(value, list):
        return [_defined(sketch, part) for part in value]
    match = DEFINED.fullmatch(value) if isinstance(value, str) else None
    if not match:
        return value
    sketch.section("dimensions")[match[1]] = _typed(match[2].strip())
    return match[1]


def _typed(value: Any) -> Any:
    """What was typed, as it is written: "0.3" as a number."""
    if isinstance(value, list):
        return [_typed(part) for part in value]
    if isinstance(value, str) and NUMBER.fullmatch(value.strip()):
        number = float(value)
        return int(number) if number.is_integer() and abs(number) < 1e15 and "." not in value else number
    return value


def delete(sketch: Sketch, gesture: Given) -> str:
    """An entry goes, and what cannot be without it."""
    section, name = map(str, gesture["what"])
    if section == "points":
        link, point = free(sketch, name)
        del sketch.section("links")[link]["points"][point]
        _drop(sketch, "loads", lambda load: load.get("link") == link and load.get("at") == point)
        _drop(sketch, "springs", lambda spring: name in (spring.get("between") or ()))
        return f"Delete point {point}"
    if section in ("joints", "links") and any(row.get(section[:-1]) == name for row in sketch.rows):
        return _delete_row(sketch, section[:-1], name)
    if section not in SECTIONS or name not in sketch.section(section):
        raise refused("is not there", f"{section}.{name}", "choose what is drawn")
    if section == "links" and name == sketch.ground:
        raise refused("is the ground", name, "delete its joints")
    blocks = [item for item in sketch.of("links") if item != sketch.ground and _block(sketch, item)]
    del sketch.section(section)[name]
    gone = [name] if section == "joints" else []
    if section == "links":
        gone = [joint for joint, item in sketch.joints.items() if name in item["links"]]
        _drop(sketch, "joints", lambda joint: name in (joint.get("links") or ()))
        _drop(sketch, "loads", lambda load: load.get("link") == name)
        _drop(sketch, "springs", lambda spring: any(end.startswith(f"{name}.") for end in spring.get("between") or ()))
    for joint in gone:
        _without_joint(sketch, joint)
    for block in blocks:
        types = {item.get("type", "revolute") for item in sketch.joints.values() if block in item["links"]}
        if len(types) < 2 and block in sketch.of("links"):  # slides no longer, or nothing is pinned to it
            delete(sketch, {"what": ["links", block]})
    return f"Delete {SECTIONS[section]} {name}"


def add_row(sketch: Sketch, gesture: Given) -> str:
    """A row of the table of a loop, before that of the ground: a revolute joint, a link without twist or distance."""
    joint, link = letter(sketch), numbered(sketch, "links", "link")
    sketch.entries["loop"].insert(-1, {"joint": joint, "type": "revolute", "link": link, "twist": 0, "distance": 0})
    sketch.made = ("joints", joint)
    return f"Add joint {joint}"


def _delete_row(sketch: Sketch, key: str, name: str) -> str:
    """A joint of a loop goes with the link after it; that before it where the ground comes after it."""
    index, row = next((index, row) for index, row in enumerate(sketch.rows) if row.get(key) == name)
    if len(sketch.rows) < 3 or (key, name) == ("link", sketch.ground):
        raise refused("cannot go: the loop would not close", name, "change its type, twist or distance")
    link = row.get("link")
    if link == sketch.ground:
        link, sketch.rows[index - 1]["link"] = sketch.rows[index - 1]["link"], link
    del sketch.entries["loop"][index]
    _without_joint(sketch, str(row["joint"]))
    sketch.section("links").pop(str(link), None)
    return f"Delete {key} {name}"


def _block(sketch: Sketch, link: str) -> bool:
    """Whether a link is a block of a guide: all its points on one spot, one of them with the axis of the guide."""
    points = sketch.points(link)
    axes = [point for point in points.values() if isinstance(point, dict) and "axis" in point]
    spots = [point.get("at") if isinstance(point, dict) else point for point in points.values()]
    return len(points) > 1 and bool(axes) and all(spot == [0, 0] for spot in spots)


def _without_joint(sketch: Sketch, joint: str) -> None:
    """What a joint that is gone leaves behind: its driver and hint go, and its point on the ground."""
    for section in ("drivers", "assembly"):
        if isinstance(sketch.entries.get(section), dict):
            sketch.entries[section].pop(joint, None)
    ground = sketch.section("links").get(sketch.ground, {})
    used = {end for spring in sketch.of("springs").values() for end in spring.get("between") or ()}
    if f"{sketch.ground}.{joint}" not in used:
        ground.get("points", {}).pop(joint, None)
    for link in sketch.of("links"):  # the guide of a slot
        entry = sketch.points(link).get(joint)
        if isinstance(entry, dict) and "axis" in entry:
            del sketch.section("links")[link]["points"][joint]
    _drop(sketch, "gears", lambda gear: joint in (gear.get("joints") or ()))
    _drop(sketch, "loads", lambda load: load.get("joint") == joint)
    _drop(sketch, "springs", lambda spring: spring.get("joint") == joint)


def _drop(sketch: Sketch, section: str, gone: Callable[[Mapping[str, Any]], bool]) -> None:
    for name, item in sketch.of(section).items():
        if gone(item):
            del sketch.section(section)[name]


# ---- renamed --------------------------------------------------------------------------------------------------------


def rename(sketch: Sketch, gesture: Given) -> str:
    """A part gets another name wherever it is spoken of; a driver has that of its joint."""
    (section, old), new = map(str, gesture["what"]), str(gesture["to"]).strip()
    section = "joints" if section == "drivers" else section
    in_rows = section in SIDES and any(row.get(section[:-1]) == old for row in sketch.rows)
    exists = section == "points" or in_rows or (section in NAMED and old in sketch.section(section))
    if not exists:
        raise refused("is not there", f"{section}.{old}", "choose what is drawn")
    siblings = sketch.section(section) if section != "points" else {}
    if not new or "." in new or new in taken(sketch) or new in siblings:
        raise refused(f"'{new}' is not a free name", f"{section}.{old}", "choose another")
    if section == "points":
        rename_point(sketch, old, new)
        return f"Rename {old} to {new}"
    sketch.entries = dict(renamed(sketch.entries, section, old, new))
    if section == "links" and old == sketch.ground:
        sketch.entries["ground"] = new
    if section in SIDES:
        sketch.places = {_key(key, section, old, new): place for key, place in sketch.places.items()}
        sketch.locked = {_key(key, section, old, new) for key in sketch.locked}
    return f"Rename {old} to {new}"


def _key(key: str, section: str, old: str, new: str) -> str:
    """The key "link.P" of a point, or the name of a joint, after a link or joint is renamed."""
    link, dot, point = key.rpartition(".")
    if section == "links":
        return f"{new if link == old else link}{dot}{point}"
    return f"{link}{dot}{new if point == old else point}"
