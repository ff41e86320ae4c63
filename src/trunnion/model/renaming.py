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
        of_joints = way in (("drivers",), ("assembly",)) or (way[:1] == ("links",) and way[2:] == ("points",))
        named = way == (section,) or (section == "joints" and of_joints)
        return {(new if named and key == old else key): renamed(item, section, old, new, (*way, key))
                for key, item in group.items()}  # fmt: skip
    if isinstance(group, list):
        return [renamed(item, section, old, new, way) for item in group]
    if not isinstance(group, str) or not way:
        return group
    name, last = re.escape(old), way[-1]
    if section in ("loads", "springs", "gears"):
        if group == old and way[0] == "measures":
            return new
        return re.sub(rf"\b{section}\.{name}(?=\.)", f"{section}.{new}", group)
    if section in ("links", "joints") and last == "between":
        return re.sub(rf"^{name}(?=\.)" if section == "links" else rf"(?<=\.){name}$", new, group)
    if section == "links":
        return new if group == old and last in ("links", "link", "ground") else group
    if section == "joints":
        spoken = last in ("frame", "joint", "joints") or (last == "at" and way[0] != "links")  # there it is a place
        return new if group == old and spoken else group
    # dimensions: in what is neither for readers nor the name of a part
    names_part = last in ("links", "link", "joint", "joints", "frame", "between", "type")
    if way[0] in ("name", "notes", "references") or names_part or (last == "at" and way[0] != "links"):
        return group
    return re.sub(rf"(?<![\w.]){name}(?![\w.])", new, group)
