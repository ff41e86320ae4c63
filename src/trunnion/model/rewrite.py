"""A model file with some entries changed: its comments, its order and the way it is written stay where they can."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator, Mapping, MutableMapping
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from trunnion.errors import Finding, MechanismError
from trunnion.files import whole
from trunnion.model.file import composed, entries_of, read_entries, text_of
from trunnion.model.mechanism import Mechanism, read_mechanism
from trunnion.model.text import OF_A_FILE, stated_files

__all__ = ["changed_text", "rewrite_mechanism"]

YAMLS = (".yaml", ".yml")
Location = tuple[str | int, ...]


class Renamed(NamedTuple):
    """The new name of an entry."""

    name: str


class Gone(NamedTuple):
    """Of an entry that is left out."""


def rewrite_mechanism(
    mechanism: Mechanism, source: str | os.PathLike[str], path: str | os.PathLike[str], over: bool = False
) -> None:
    """Write a mechanism that was made of the file `source`, with the comments of that file if both are YAML.

    over: `path` may be the source itself. MechanismError if it is and may not, or if it cannot be written.
    """
    source, path = Path(source), Path(path)
    if not over and path.exists() and path.samefile(source):
        raise MechanismError(Finding("is the model itself", str(path), "name another file, or add --force"))
    both_yaml = {source.suffix.lower(), path.suffix.lower()} <= set(YAMLS)
    same_folder = source.resolve().parent == path.resolve().parent
    with whole(path) as temporary:
        for text in _texts(mechanism, source, same_folder) if both_yaml else ():
            temporary.write_text(text, encoding="utf-8", newline="\n")
            if _holds(temporary, mechanism):
                return
        mechanism.write(temporary)  # a way of writing that was not foreseen: without the comments then


def changed_text(text: str, after: Mapping[str, Any]) -> str:
    """A YAML text of a model with other entries, given as plain data; comments and order stay where they can.

    MechanismError if the text cannot be read.
    """
    before = entries_of(text)[0]
    if before == after:
        return text
    for change in (_edited, _rewritten):
        try:
            edited = change(text, before, after)
            if edited is not None and entries_of(edited)[0] == after:
                return edited
        except (MechanismError, YAMLError, ValueError, TypeError, LookupError):
            continue  # a way of writing that was not foreseen
    return text_of(after)


def _holds(path: Path, mechanism: Mechanism) -> bool:
    try:
        return read_mechanism(path) == mechanism
    except MechanismError:
        return False


def _texts(mechanism: Mechanism, source: Path, same_folder: bool) -> Iterator[str]:
    """Texts of the mechanism that are to be tried, the one that is most like the source first.

    same_folder: whether it is to stand in the folder of the source, where the files are that this names.
    """
    try:
        text, before = source.read_text("utf-8"), read_mechanism(source).data()
        _name_files(before, mechanism.data(), source, same_folder)
        edited = _edited(text, before, mechanism.data())
    except (MechanismError, YAMLError, OSError, ValueError, TypeError, LookupError):
        return
    if edited is not None:
        yield edited
    again = _rewritten(text, before, mechanism.data())
    if again is not None:
        yield again


def _name_files(before: dict[str, Any], after: Mapping[str, Any], source: Path, same_folder: bool) -> None:
    """Let the data of the source name the files again whose points are to be written out: others, or elsewhere."""
    entries = read_entries(source)[0]
    for section, name, _ in stated_files(entries):
        entry = before[section][name]
        if not same_folder or after.get(section, {}).get(name, {}).get("points") != entry.get("points"):
            of_the_file = {key: value for key, value in entries[section][name].items() if key in OF_A_FILE}
            before[section][name] = {key: value for key, value in entry.items() if key != "points"} | of_the_file


# ---- values alone ---------------------------------------------------------------------------------------------


def _edited(text: str, before: Mapping[str, Any], after: Mapping[str, Any]) -> str | None:
    """The text with values changed where they stand, and entries renamed, added and left out; None if there is more."""
    root = composed(text)
    edits = [_edit(text, root, location, value) for location, value in _changed(before, after)]
    for edit in sorted((change for change in edits if change), key=lambda change: change[0])[::-1]:
        start, end, new = edit
        rest = text[end:]
        blanks = len(rest) - len(rest.lstrip(" "))
        if end > start and rest[blanks : blanks + 1] == "#":  # the comment behind it stays in its column
            rest = " " * max(1, blanks + end - start - len(new)) + rest[blanks:]
        text = text[:start] + new + rest
    return None if None in edits else text


def _edit(text: str, root: Node, location: Location, value: Any) -> tuple[int, int, str] | None:
    """From where to where a text is to be replaced by what; None if a value cannot be put in so."""
    if not location:
        return None
    node, parent, key = _node(root, location), _node(root, location[:-1]), location[-1]
    if isinstance(value, Renamed | Gone):
        return _entry(text, parent, str(key), value) if isinstance(parent, MappingNode) else None
    if isinstance(node, ScalarNode) and isinstance(value, (str, int, float)):
        return node.start_mark.index, node.end_mark.index, _scalar(value, quoted=bool(node.style))
    if node is not None or not isinstance(parent, MappingNode) or not parent.value or value is None:
        return None
    entry = f"{_scalar(key, quoted=False)}: {_flow(value)}"
    if parent.flow_style:
        end = parent.end_mark.index - 1
        return end, end, f", {entry}"
    if parent is root and isinstance(value, Mapping):
        lines = (f"  {_scalar(name, quoted=False)}: {_flow(child)}\n" for name, child in value.items())
        return len(text), len(text), f"{'' if text.endswith(chr(10)) else chr(10)}{key}:\n{''.join(lines)}"
    first, last = parent.value[0][0], parent.value[-1][1]
    if not (isinstance(last, ScalarNode) or last.flow_style):
        return None
    end = text.find("\n", last.end_mark.index)
    end = len(text) if end < 0 else end
    return end, end, f"\n{' ' * first.start_mark.column}{entry}"


def _entry(text: str, parent: MappingNode, name: str, change: Renamed | Gone) -> tuple[int, int, str] | None:
    """The same for an entry that is renamed or left out; None for one that stands alone."""
    place = next((place for place, (key, _) in enumerate(parent.value) if key.value == name), None)
    if place is None:
        return None
    key, node = parent.value[place]
    if isinstance(change, Renamed):
        return key.start_mark.index, key.end_mark.index, _scalar(change.name, quoted=bool(key.style))
    if len(parent.value) == 1:
        return None
    if parent.flow_style:
        if place:
            return parent.value[place - 1][1].end_mark.index, node.end_mark.index, ""
        return key.start_mark.index, parent.value[1][0].start_mark.index, ""
    while not (isinstance(node, ScalarNode) or node.flow_style):  # a block ends behind the blank lines after it
        node = node.value[-1][1] if isinstance(node, MappingNode) else node.value[-1]
    end = text.find("\n", node.end_mark.index) + 1
    return text.rfind("\n", 0, key.start_mark.index) + 1, end or len(text), ""


def _flow(value: Any) -> str:
    """A value on one line."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_scalar(key, quoted=False)}: {_flow(item)}" for key, item in value.items()) + "}"
    return f"[{', '.join(map(_flow, value))}]" if isinstance(value, list) else _scalar(value, quoted=False)


def _changed(before: Any, after: Any, location: Location = ()) -> Iterator[tuple[Location, Any]]:
    """Where two sets of plain data differ, and what the second has there.

    Where one entry of a group goes and another comes, it is renamed.
    """
    if before == after:
        return
    if isinstance(before, Mapping) and isinstance(after, Mapping):
        gone, come = [key for key in before if key not in after], [key for key in after if key not in before]
        names: dict[Any, Any] = dict(zip(come, gone, strict=True)) if len(gone) == len(come) == 1 else {}
        for key, value in after.items():
            old: Any = names.get(key, key)
            if key in names:
                yield (*location, old), Renamed(key)
            if old in before:
                yield from _changed(before[old], value, (*location, old))
            else:
                yield (*location, key), value
        yield from (((*location, key), Gone()) for key in gone if key not in names.values())
    elif isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        for index, value in enumerate(after):
            yield from _changed(before[index], value, (*location, index))
    else:
        yield location, after


def _node(root: Node, location: Location) -> Node | None:
    """The node of a value; None if there is none, as where the file has a short form of it."""
    node = root
    for key in location:
        if isinstance(node, MappingNode):
            child = next((value for name, value in node.value if name.value == str(key)), None)
        else:
            inside = isinstance(node, SequenceNode) and isinstance(key, int) and key < len(node.value)
            child = node.value[key] if inside else None
        if child is None:
            return None
        node = child
    return node


def _scalar(value: float | str, *, quoted: bool) -> str:
    """A value as it stands in a file, in quotation marks if they were there or are needed."""
    if not isinstance(value, str):
        return json.dumps(value)
    plain = re.fullmatch(r"[\w±+.-][^\n:#,\[\]{}\"']*", value) and value == value.strip()
    return value if plain and not quoted else json.dumps(value, ensure_ascii=False)


# ---- entries that came or went --------------------------------------------------------------------------------


def _rewritten(text: str, before: Mapping[str, Any], after: Mapping[str, Any]) -> str | None:
    """The text of the source with what is different put in; None if it cannot be had."""
    yaml = YAML(typ="rt", pure=True)
    yaml.preserve_quotes = True
    yaml.allow_unicode = True
    yaml.width = 4096  # lines stay as long as they are
    try:
        yaml.composer.warn_double_anchors = False  # nothing may refer to one
        tree = yaml.load(text)
        _change(tree, before, after)
        stream = StringIO()
        yaml.dump(tree, stream)
    except (MechanismError, YAMLError, OSError, ValueError, TypeError, KeyError):
        return None
    return stream.getvalue()


def _change(tree: MutableMapping[Any, Any], before: Mapping[str, Any], after: Mapping[str, Any]) -> None:
    """Bring a group of entries from one state to another, both as `Mechanism.data` gives them."""
    keys = {str(key): key for key in tree}
    for key in [key for key in before if key not in after]:
        del tree[keys[key]]
    for key, value in after.items():
        if key in before and before[key] == value:
            continue
        entry_key = keys.get(key, key)
        current = tree.get(entry_key)
        if isinstance(current, MutableMapping) and isinstance(value, Mapping) and isinstance(before.get(key), Mapping):
            _change(current, before[key], value)
        elif not _rows_changed(current, before.get(key), value):
            tree[entry_key] = _laid_out(_short(value))


def _rows_changed(current: Any, before: Any, after: Any) -> bool:
    """Take rows out of a list of groups and put others in, whose other rows stay as written; whether that was all."""
    lists = [parts for parts in (current, before, after) if isinstance(parts, list)]
    if len(lists) < 3 or not all(isinstance(row, Mapping) for parts in lists for row in parts):
        return False
    rows = list(before)
    for index in range(len(rows) - 1, -1, -1):
        if rows[index] not in after:
            del current[index], rows[index]
    for index, row in enumerate(after):
        if rows[index : index + 1] != [row]:
            current.insert(index, _laid_out(row))
            rows.insert(index, row)
    return bool(rows == after)


def _laid_out(value: Any) -> Any:
    """A new value as models are usually written: lists, and the innermost groups, on one line."""
    if isinstance(value, list):
        row = CommentedSeq(map(_laid_out, value))
        row.fa.set_flow_style()
        return row
    if not isinstance(value, Mapping):
        return value
    group = CommentedMap((key, _laid_out(item)) for key, item in value.items())
    if not any(isinstance(item, Mapping) for item in value.values()):
        group.fa.set_flow_style()
    return group


def _short(value: Any) -> Any:
    """Limits alone as they are usually written."""
    return value["limits"] if isinstance(value, Mapping) and list(value) == ["limits"] else value
