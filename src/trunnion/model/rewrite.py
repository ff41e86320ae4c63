"""A model file with some entries changed: its comments, its order and the way it is written stay where they can."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from ruamel.yaml.error import YAMLError
from ruamel.yaml.nodes import MappingNode, ScalarNode, SequenceNode

from trunnion.errors import Finding, MechanismError
from trunnion.files import whole
from trunnion.model.csv_table import OF_A_FILE, stated_files
from trunnion.model.file import composed, entries_of, read_entries, text_of
from trunnion.model.mechanism import Mechanism, read_mechanism

YAMLS = {".yaml", ".yml"}
# of a way of writing that was not foreseen: the model is written anew, without its comments
UNFORESEEN = (MechanismError, YAMLError, OSError, ValueError, TypeError, LookupError)
Edit = tuple[int, int, str]  # from where to where a text is replaced, and by what


def rewrite_mechanism(
    mechanism: Mechanism, source: str | os.PathLike[str], path: str | os.PathLike[str], over: bool = False
) -> None:
    """Write a mechanism that was made of the file `source`, with the comments of that file if both are YAML.

    over: `path` may be the source itself. MechanismError if it is and may not, or if it cannot be written.
    """
    source, path = Path(source), Path(path)
    if not over and path.exists() and path.samefile(source):
        raise MechanismError(Finding("is the model itself", str(path), "name another file, or add --force"))
    text = ""
    if {source.suffix.lower(), path.suffix.lower()} <= YAMLS:
        with suppress(OSError, MechanismError):  # of a source that is there no more
            text = changed_text(source.read_text("utf-8"), _naming_files(mechanism, source, path))
    with whole(path) as temporary:
        if text:
            temporary.write_text(text, encoding="utf-8", newline="\n")
        else:
            mechanism.write(temporary)


def changed_text(text: str, after: Mapping[str, Any]) -> str:
    """A YAML text of a model with other entries, given as plain data; comments and order stay where they can.

    MechanismError if the text cannot be read.
    """
    before = entries_of(text)[0]
    with suppress(*UNFORESEEN):
        edited = _edited(text, before, after)
        if entries_of(edited)[0] == after:
            return edited
    return text_of(after)


def _naming_files(mechanism: Mechanism, source: Path, path: Path) -> dict[str, Any]:
    """The data of the mechanism, which go on to name files of points where these are the same and `path` is beside
    the source.
    """
    data, entries = mechanism.data(), read_entries(source)[0]
    files = [*stated_files(entries)] if source.resolve().parent == path.resolve().parent else []
    before = read_mechanism(source).data() if files else {}
    for section, name, _ in files:
        entry = data.get(section, {}).get(name, {})
        if entry.get("points") == before[section][name]["points"]:
            of_the_file = {key: value for key, value in entries[section][name].items() if key in OF_A_FILE}
            data[section][name] = {key: value for key, value in entry.items() if key != "points"} | of_the_file
    return data


# ---- where the text changes -----------------------------------------------------------------------------------


def _edited(text: str, before: Mapping[str, Any], after: Mapping[str, Any]) -> str:
    """The text with what differs put in where it stands."""
    for start, end, new in sorted(_edits(text, composed(text), before, after), reverse=True):
        rest = text[end:]
        blanks = len(rest) - len(rest.lstrip(" "))
        if end > start and rest[blanks : blanks + 1] == "#":  # the comment behind it stays in its column
            rest = " " * max(1, blanks + end - start - len(new)) + rest[blanks:]
        text = text[:start] + new + rest
    return text


def _edits(text: str, node: Any, before: Any, after: Any) -> Iterator[Edit]:
    """What brings a node from one state to another: of a group its entries, of a list its items, else all of it."""
    if before == after:
        return
    if isinstance(node, MappingNode) and isinstance(before, Mapping) and isinstance(after, Mapping):
        places = {key.value: place for place, (key, _) in enumerate(node.value)}
        gone, come = [key for key in before if key not in after], [key for key in after if key not in before]
        names = dict(zip(come, gone, strict=True)) if len(gone) == len(come) == 1 else {}
        apart = len(gone) < 2 if node.flow_style else len(gone) < len(node.value)  # no edit touches another
        if {*map(str, before)} <= places.keys() and (names or (apart and len(gone) < len(node.value))):
            for new, old in names.items():  # where one entry goes and another comes, it is renamed
                key = node.value[places[str(old)]][0]
                yield key.start_mark.index, key.end_mark.index, _scalar(new, quoted=bool(key.style))
            for key, value in after.items():
                old = names.get(key, key)
                if old in before:
                    yield from _edits(text, node.value[places[str(old)]][1], before[old], value)
                else:
                    yield _added(text, node, key, value)
            yield from (_removed(text, node, places[str(key)]) for key in gone if key not in names.values())
            return
    if isinstance(node, SequenceNode) and isinstance(after, list) and len(node.value) == len(before) == len(after):
        for item, old, new in zip(node.value, before, after, strict=True):
            yield from _edits(text, item, old, new)
        return
    indent = "\n" + " " * node.start_mark.column
    inline = isinstance(node, ScalarNode) or node.flow_style or not isinstance(after, Mapping | list)
    style = bool(getattr(node, "style", None))
    new = _flow(after, quoted=style) if inline else indent.join(text_of(after).splitlines())
    yield node.start_mark.index, _last(node).end_mark.index, new


def _added(text: str, parent: MappingNode, key: Any, value: Any) -> Edit:
    """An entry behind the last one of a group; a group of the model with a line for each of its entries."""
    last = _last(parent)
    entry = f"{_scalar(key)}: {_flow(value)}"
    if parent.flow_style:
        end = parent.end_mark.index - 1
        return end, end, f", {entry}"
    end = text.find("\n", last.end_mark.index)
    end, column = len(text) if end < 0 else end, parent.start_mark.column
    if not column and isinstance(value, Mapping):
        lines = [f"  {_scalar(name)}: {_flow(child)}" for name, child in value.items()]
        entry = "\n".join([f"{_scalar(key)}:", *lines])
    return end, end, f"\n{' ' * column}{entry}"


def _removed(text: str, parent: MappingNode, place: int) -> Edit:
    """An entry taken out of a group that has others."""
    key, node = parent.value[place]
    if parent.flow_style:
        if place == 0:
            return key.start_mark.index, parent.value[1][0].start_mark.index, ""
        return parent.value[place - 1][1].end_mark.index, node.end_mark.index, ""
    end = text.find("\n", _last(node).end_mark.index) + 1
    return text.rfind("\n", 0, key.start_mark.index) + 1, end or len(text), ""


def _last(node: Any) -> Any:
    """The node that ends where this one does in the text: a block itself ends behind the blank lines after it."""
    while not isinstance(node, ScalarNode) and not node.flow_style:
        node = node.value[-1][1] if isinstance(node, MappingNode) else node.value[-1]
    return node


def _flow(value: Any, quoted: bool = False) -> str:
    """A value on one line."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_scalar(key)}: {_flow(item)}" for key, item in value.items()) + "}"
    return f"[{', '.join(map(_flow, value))}]" if isinstance(value, list) else _scalar(value, quoted=quoted)


def _scalar(value: float | str, *, quoted: bool = False) -> str:
    """A value as it stands in a file, in quotation marks if they were there or are needed."""
    if not isinstance(value, str):
        return json.dumps(value)
    plain = re.fullmatch(r"[\w±+.-][^\n:#,\[\]{}\"']*", value) and value == value.strip()
    return value if plain and not quoted else json.dumps(value, ensure_ascii=False)


# ---- another name for a part, wherever the data speak of it -----------------------------------------------------


def renamed(group: Any, section: str, old: str, new: str, way: tuple[str, ...] = ()) -> Any:
    """The plain data of a model file, or of a part of it at the path `way`, with another name for a part of the model.

    section: that of the part: links, joints (and points of links), dimensions, loads, springs or gears.
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
