"""Another name for a part of a model, wherever its plain data speak of it."""

from __future__ import annotations

import re
from typing import Any

__all__ = ["renamed"]


def renamed(group: Any, section: str, old: str, new: str, way: tuple[str, ...] = ()) -> Any:
    """Return the entries of a model with another name for a part, in keys and in what speaks of it.

    Parameters
    ----------
    group : dict, list or str
        The plain data of a model file, or of a part of it at the path `way`.
    section : str
        That of the part: links, joints (and points of links), dimensions, loads, springs or gears.
    old, new : str
        Its names.
    """
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
