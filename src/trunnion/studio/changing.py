"""Changing a drawing: values, what goes, and other names, wherever a part is spoken of."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from trunnion.model.renaming import renamed
from trunnion.studio.findings import spoken
from trunnion.studio.sketch import Sketch
from trunnion.studio.strokes import NUMBER, free, letter, numbered, refused, rename_point, spoken_of, taken

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
    named = [*parents, last]
    if parents[:1] == ["loop"] and len(parents) > 1:
        named[1] = sketch.rows[parents[1]].get("joint")
    path, value = ".".join(map(str, named)), gesture.get("value")
    words = spoken(path)
    if value is not None:
        value = _written(sketch, value, path not in ("name", "notes") and parents != ["dimensions"])
        group[last] = value
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


def delete(sketch: Sketch, gesture: Given) -> str:
    """An entry goes, and what cannot be without it."""
    section, name = map(str, gesture["what"])
    before = _orphans(sketch)  # of an unfinished file: it stays
    if section == "points":
        link, point = free(sketch, name)
        del sketch.section("links")[link]["points"][point]
        title = f"point {point}"
    elif section in SIDES and any(row.get(section[:-1]) == name for row in sketch.rows):
        _delete_row(sketch, section[:-1], name)
        title = f"{section[:-1]} {name}"
    else:
        if section not in SECTIONS or name not in sketch.section(section):
            raise refused("is not there", f"{section}.{name}", "choose what is drawn")
        if section == "links" and name == sketch.ground:
            raise refused("is the ground", name, "delete its joints")
        del sketch.section(section)[name]
        title = f"{SECTIONS[section]} {name}"
    while gone := _orphans(sketch) - before:
        for *parents, last in sorted(gone, key=len, reverse=True):  # points before their link
            group = sketch.entries
            for key in parents:
                group = group[key]
            del group[last]
    return f"Delete {title}"


def _orphans(sketch: Sketch) -> set[tuple[str, ...]]:
    """Paths of entries that are nothing by themselves: what they join or act on is not there."""
    links, pairs = sketch.of("links"), sketch.joints
    joints = {*pairs, *(row.get("joint") for row in sketch.rows)}
    points = {f"{link}.{point}" for link in links for point in sketch.points(link)}
    acting = [(section, name, spoken_of(item)) for section in ("loads", "springs", "gears")
              for name, item in sketch.of(section).items()]  # fmt: skip
    parts = {*joints, *links, *(row.get("link") for row in sketch.rows), *points}
    orphans: set[tuple[str, ...]] = {(section, name) for section, name, needs in acting if not needs <= parts}
    orphans |= {("joints", name) for name, item in pairs.items() if not set(item["links"]) <= set(links)}
    orphans |= {(section, name) for section in ("drivers", "assembly", *(("joints",) if sketch.rows else ()))
                for name in sketch.section(section) if name not in joints}  # fmt: skip
    if sketch.rows:
        orphans |= {("links", name) for name in links if name not in {row.get("link") for row in sketch.rows}}
    used = joints.union(*(needs for *_, needs in acting))
    for link in links:
        of_link = sketch.points(link)
        axes = [name for name, entry in of_link.items() if isinstance(entry, dict) and "axis" in entry]
        lost = list(of_link) if link == sketch.ground else axes
        orphans |= {("links", link, "points", name) for name in lost if not {name, f"{link}.{name}"} & used}
        types = {item.get("type", "revolute") for item in pairs.values() if link in item["links"]}
        spots = [entry["at"] if isinstance(entry, dict) else entry for entry in of_link.values()]
        on_one_spot = len(spots) > 1 and all(spot == [0, 0] for spot in spots)
        if axes and on_one_spot and len(types) < 2 and link != sketch.ground:
            orphans.add(("links", link))  # a block that slides no longer, or nothing is pinned to it
    return orphans


def add_row(sketch: Sketch, gesture: Given) -> str:
    """A row of the table of a loop, before that of the ground: a revolute joint, a link without twist or distance."""
    joint, link = letter(sketch), numbered(sketch, "links", "link")
    sketch.entries["loop"].insert(-1, {"joint": joint, "type": "revolute", "link": link, "twist": 0, "distance": 0})
    sketch.made = ("joints", joint)
    return f"Add joint {joint}"


def _delete_row(sketch: Sketch, key: str, name: str) -> None:
    """A joint of a loop goes with the link after it; that before it where the ground comes after it."""
    index, row = next((index, row) for index, row in enumerate(sketch.rows) if row.get(key) == name)
    if len(sketch.rows) < 3 or (key, name) == ("link", sketch.ground):
        raise refused("cannot go: the loop would not close", name, "change its type, twist or distance")
    if row.get("link") == sketch.ground:
        sketch.rows[index - 1]["link"] = sketch.ground
    del sketch.entries["loop"][index]


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
        side = SIDES.index(section)
        for key in list(sketch.places):
            parts = key.split(".")
            parts[side] = new if parts[side] == old else parts[side]
            sketch.places[".".join(parts)] = sketch.places.pop(key)
    return f"Rename {old} to {new}"
