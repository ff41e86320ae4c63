"""Another name for a part of a drawing, wherever it is spoken of."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from trunnion.studio.ends import free, refused, taken
from trunnion.studio.sketch import Sketch

__all__ = ["rename", "rename_point", "renamed"]

Given = Mapping[str, Any]
NAMED = ("links", "joints", "dimensions", "loads", "springs", "gears")
SIDES = ("links", "joints")  # of "link.point"


def rename(sketch: Sketch, given: Given) -> str:
    """A part gets another name wherever it is spoken of; a driver has that of its joint."""
    (section, old), new = map(str, given["what"]), str(given["to"]).strip()
    section = "joints" if section == "drivers" else section
    in_rows = section in SIDES and any(row.get(section[:-1]) == old for row in sketch.rows)
    known = section == "points" or in_rows or (section in NAMED and old in sketch.section(section))
    if not known:
        raise refused("is not there", f"{section}.{old}", "choose what is drawn")
    beside = sketch.section(section) if section != "points" else {}
    if not new or "." in new or new in taken(sketch) or new in beside:
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


def rename_point(sketch: Sketch, old: str, new: str) -> None:
    """A point of a link that is no joint, with the loads and springs at it."""
    link, point = free(sketch, old)
    entry = sketch.section("links")[link]
    entry["points"] = {(new if one == point else one): at for one, at in entry["points"].items()}
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
    sketch.locked = {f"{link}.{new}" if key == old else key for key in sketch.locked}


def renamed(group: Any, section: str, old: str, new: str, way: tuple[str, ...] = ()) -> Any:
    """The entries with another name in keys and in what speaks of it."""
    if isinstance(group, dict):
        named = _named(section, way)
        return {
            (new if named and key == old else key): renamed(one, section, old, new, (*way, key))
            for key, one in group.items()
        }
    if isinstance(group, list):
        return [renamed(one, section, old, new, way) for one in group]
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
    if section in ("loads", "springs", "gears"):
        return (
            new
            if text == old and way[:1] == ("measures",)
            else re.sub(rf"\b{section}\.{re.escape(old)}(?=\.)", f"{section}.{new}", text)
        )
    if section == "links":
        if last == "between":
            return re.sub(rf"^{re.escape(old)}(?=\.)", new, text)
        return new if text == old and last in ("links", "link", "ground") else text
    if section == "joints":
        if last == "between":
            return re.sub(rf"(?<=\.){re.escape(old)}$", new, text)
        spoken = last in ("frame", "joint", "joints") or (last == "at" and way[0] != "links")  # there it is a place
        return new if text == old and spoken else text
    return re.sub(rf"(?<![\w.]){re.escape(old)}(?![\w.])", new, text) if _names_dimensions(way) else text


def _names_dimensions(way: tuple[str, ...]) -> bool:
    """Whether a text of the file may name dimensions: it is neither for readers nor the name of a part."""
    names_part = way[-1] in ("links", "link", "joint", "joints", "frame", "between", "type")
    return way[0] not in ("name", "notes", "references") and not names_part and (way[-1] != "at" or way[0] == "links")
