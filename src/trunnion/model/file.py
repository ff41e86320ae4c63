"""Reading and writing model files: YAML 1.2, JSON (which is YAML) and TOML.

A file is data from a stranger: its size, nesting, tags and aliases are bounded before anything is built from it.
Every finding gets the file and the line of the entry it concerns.
"""

from __future__ import annotations

import json
import os
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from io import StringIO
from pathlib import Path
from typing import Any, TypeVar

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError
from ruamel.yaml.events import AliasEvent, CollectionEndEvent, CollectionStartEvent
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode
from ruamel.yaml.parser import Parser

from trunnion.errors import Finding, MechanismError
from trunnion.files import whole
from trunnion.model.csv_table import TableFiles, place_findings, read_text, with_points

MAX_BYTES = 1_000_000  # some ten thousand links; parsing takes seconds
MAX_DEPTH = 30
_TYPES = {".yaml": "YAML", ".yml": "YAML", ".json": "JSON", ".toml": "TOML"}
_DEEP_KEY = re.compile(rf"(?<![\w.\"'-])(?:[\w\"'-]++\s*+\.\s*+){{{MAX_DEPTH},}}")
_TAG = "tag:yaml.org,2002:"
_PLAIN_TAGS = frozenset(_TAG + name for name in ("str", "int", "float", "bool", "null", "map", "seq"))

KINDS = {"trunnion": "a model file", "trunnion-data": "a mapping file", "trunnion-rig": "a rig file"}
Lines = dict[str, int]
Model = TypeVar("Model")


def read_model(
    path: str | os.PathLike[str], build: Callable[[dict[str, Any]], Model], tables: TableFiles | None = None
) -> Model:
    """What is built of the entries of a file, by its extension .yaml, .yml, .json or .toml.

    The points of CSV files in its folder that it names become part of it. tables: CSV files with the points of drivers
    and tables, by name, see `Mechanism.with_table`; they go before those that the model names.
    MechanismError with every finding of severity error, each with file, line, what and remedy.
    """
    path = Path(path)
    data, lines = read_entries(path)
    findings = [version_finding.at(str(path), 1) for version_finding in version_findings(data)]
    data, read = with_points(data, tables or {})
    try:
        data, own_points = with_points(data, model=path)
        read += own_points
        model = build(data)
    except MechanismError as error:
        findings += place_findings(error.findings, read)
    if findings:
        raise MechanismError(place(findings, str(path), lines, data)) from None
    return model


def read_entries(
    path: Path, noun: str = "a model file", start_from: str = "start from one of the examples"
) -> tuple[dict[str, Any], Lines]:
    """Plain data of a file of entries, and the line of every path in it.

    noun: what the file should be, with its article; start_from: remedy for an empty one. MechanismError with the file
    in every finding.
    """
    try:
        kind = _file_type(path)
        data, lines = entries_of(read_text(path, noun, MAX_BYTES, start_from), kind)
        other = next((own for key, own in KINDS.items() if key in data and own != noun), "")
        for key in (key for key, own in KINDS.items() if own == noun and other and key not in data):
            what = f"is no {noun.removeprefix('a ')} but {other}"
            raise MechanismError(Finding(what, remedy=f"name {noun} here, which begins with {key}: 1", line=1))
        return data, lines
    except MechanismError as error:
        raise MechanismError(finding.at(str(path), finding.line) for finding in error.findings) from None


def placed(findings: Iterable[Finding], path: str | os.PathLike[str], sections: Iterable[str] = ()) -> list[Finding]:
    """Findings of a later stage with the file and the line of the entry they speak of, where the file has it.

    sections: those of the model to which this is limited; all if there is none.
    """
    path, findings, only = Path(path), list(findings), set(sections)
    if not findings:
        return []
    data, lines = read_entries(path)
    rows = _rows(data)

    def stands(finding: Finding) -> bool:
        section, *names = finding.where.split(".")
        entry = ".".join([section, *names[:1]])
        present = entry in rows or (section in data and entry in lines)
        return present and not finding.file and (not only or section in only)

    return [finding.at(str(path), _line(finding.where, lines, rows)) if stands(finding) else finding
            for finding in findings]  # fmt: skip


def write_model(data: Mapping[str, Any], path: str | os.PathLike[str]) -> None:
    """Write the plain data of a model as YAML or JSON, whole or not at all; MechanismError if it cannot be written."""
    path = Path(path)
    kind = _file_type(path)
    if kind == "TOML":
        raise MechanismError(Finding("TOML is read but not written", file=str(path), remedy="write .yaml or .json"))
    with whole(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as stream:
        stream.write(json.dumps(data, indent=2, ensure_ascii=False) + "\n" if kind == "JSON" else text_of(data))


def text_of(data: Mapping[str, Any]) -> str:
    """The plain data of a model as YAML, the innermost groups on one line."""
    yaml, stream = YAML(typ="safe", pure=True), StringIO()
    yaml.default_flow_style = None
    yaml.allow_unicode = True
    yaml.width = 110
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]  # keys as stated
    yaml.dump(data, stream)
    return stream.getvalue()


def version_findings(data: Mapping[str, Any]) -> list[Finding]:
    """That a file does not state its version."""
    missing = Finding("the version of the file is missing", "trunnion", "begin the file with trunnion: 1", line=1)
    return [] if "trunnion" in data else [missing]


def _file_type(path: Path) -> str:
    suffix = path.suffix.lower()
    if suffix not in _TYPES:
        what, remedy = f"the extension '{suffix}' is not one of YAML, JSON or TOML", f"use {', '.join(_TYPES)}"
        raise MechanismError(Finding(what, file=str(path), remedy=remedy))
    return _TYPES[suffix]


def entries_of(text: str, kind: str = "YAML") -> tuple[dict[str, Any], Lines]:
    """Plain data of a text in YAML, JSON or TOML, and the line of every path in it; MechanismError if it is none."""
    try:
        if kind == "TOML":  # tomllib keeps no lines, and takes a time with the square of the dots in a key
            deep = _DEEP_KEY.search(text)
            data = {} if deep else tomllib.loads(text)
            if deep or _depth(data) > MAX_DEPTH:
                raise RecursionError
            return data, {}
        root = composed(text.replace("\t", " ") if kind == "JSON" else text)  # a tab is allowed in JSON, not in YAML
    except MechanismError:
        raise
    except RecursionError:
        raise MechanismError(Finding("is nested too deeply", remedy="check brackets, and dots in keys")) from None
    except (YAMLError, ValueError, TypeError, LookupError, AttributeError, AssertionError, ArithmeticError) as error:
        # ruamel lets some of Python's own errors pass on text that is no YAML
        mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
        line = re.search(r"at line (\d+), column \d+", str(error))  # of TOML
        why = getattr(error, "problem", None) or getattr(error, "context", None) or str(error).partition("\n")[0]
        what = f"is not {kind}: {why}" + (f" (column {mark.column + 1})" if mark else "")
        remedy = "check indentation, brackets and quotes; a name with brackets stands in quotation marks"
        at = mark.line + 1 if mark else int(line[1]) if line else None
        raise MechanismError(Finding(what, remedy=remedy, line=at)) from error
    if not isinstance(root, MappingNode):
        what = "is not a group of entries (key: value) at its top"
        raise MechanismError(Finding(what, remedy="start from one of the examples", line=1))
    builder = _Builder()
    data = builder.build(root, "")
    if builder.findings:
        raise MechanismError(builder.findings)
    return data, builder.lines


def _depth(data: Any) -> int:
    """How deeply groups and lists are nested."""
    below = data.values() if isinstance(data, dict) else data
    return 1 + max(map(_depth, below), default=0) if isinstance(data, dict | list) else 0


@lru_cache(maxsize=2)  # a verb reads its model for the numbers, and again for the lines of findings
def composed(text: str) -> Node:
    """The nodes of a YAML text with where each stands, not to be changed; MechanismError on what no model file has."""
    reader = YAML(typ="safe", pure=True)
    reader.Parser = _Parser
    reader.composer.warn_double_anchors = False  # nothing may refer to one
    root: Node = reader.compose(text)
    return root


class _Parser(Parser):
    """The events of a model file; what none has is refused before anything is made of it."""

    def __init__(self, loader: Any) -> None:
        super().__init__(loader)
        self.nesting = 0

    def get_event(self) -> Any:
        """The next event; MechanismError on aliases (a few bytes can mean gigabytes), tags and deep nesting."""
        event = super().get_event()
        line = event.start_mark.line + 1
        self.nesting += isinstance(event, CollectionStartEvent) - isinstance(event, CollectionEndEvent)
        tag = str(getattr(event, "tag", None) or "")
        if isinstance(event, AliasEvent):
            what, remedy = f"the alias *{event.anchor} is not allowed", "write it out, or name a dimension"
        elif tag and tag not in _PLAIN_TAGS and tag != "!":  # a tag can name code
            what, remedy = f"the tag {tag} is not allowed", "remove the tag"
        elif self.nesting > MAX_DEPTH:
            what, remedy = "is nested too deeply", "check brackets and indentation"
        else:
            return event
        raise MechanismError(Finding(what, remedy=remedy, line=line))


class _Builder:
    """Plain data from YAML nodes, with the line of every path, and what is wrong on the way."""

    def __init__(self) -> None:
        self.lines: Lines = {}
        self.findings: list[Finding] = []

    def build(self, node: Node, path: str) -> Any:
        """The value of a node at a path."""
        self.lines.setdefault(path, node.start_mark.line + 1)
        if isinstance(node, SequenceNode):
            return [self.build(item, f"{path}.{index}") for index, item in enumerate(node.value)]
        if isinstance(node, ScalarNode):
            return self._scalar(node, path)
        values: dict[str, Any] = {}
        for key_node, value_node in node.value:
            key = self._text(key_node, path) if isinstance(key_node, ScalarNode) else ""
            below = f"{path}.{key}".lstrip(".")
            if not isinstance(key_node, ScalarNode):
                self._wrong(key_node, path, "a key is not a text", "write key: value")
            elif key in values:
                what = f"the key '{key}' is given twice, first in line {self.lines[below]}"
                self._wrong(key_node, below, what, "remove one of them")
            else:
                self.lines[below] = key_node.start_mark.line + 1
                values[key] = self.build(value_node, below)
        return values

    def _wrong(self, node: Node, path: str, what: str, remedy: str) -> None:
        self.findings.append(Finding(what, path, remedy, line=node.start_mark.line + 1))

    def _text(self, node: ScalarNode, path: str) -> str:
        """What a node says; half a sign, which JSON can escape, is in no text that can be written again."""
        text = str(node.value)
        encodable = text.encode("utf-8", "replace").decode()
        if encodable != text:
            self._wrong(node, path, f"'{encodable[:40]}' has half a sign (\\ud800 …)", "remove it")
        return encodable

    def _scalar(self, node: ScalarNode, path: str) -> Any:
        text = self._text(node, path)
        try:
            match str(node.tag).removeprefix(_TAG):
                case "int":
                    return int(text.replace("_", ""), 0 if re.match(r"[-+]?0[xob]", text) else 10)
                case "float":
                    return float(re.sub(r"(?i)\.(?=inf|nan)", "", text.replace("_", "")))
                case "bool":
                    return text.lower() == "true"
                case "null":
                    return None
        except ValueError:
            self._wrong(node, path, f"'{text[:40]}' is not a number", "write a number as 12.5 or 1.25e1")
        return text


def place(findings: Iterable[Finding], file: str, lines: Lines, data: Mapping[str, Any]) -> list[Finding]:
    """Findings with their file and line, in the order of the file."""
    rows = _rows(data)
    placed = [finding if finding.file else finding.at(file, finding.line or _line(finding.where, lines, rows))
              for finding in findings]  # fmt: skip
    return sorted(placed, key=lambda finding: (finding.file != file, finding.file, finding.line or 0))


def _rows(data: Mapping[str, Any]) -> dict[str, str]:
    """Where the rows of the loop stand, by the paths that findings have for them: loop.JOINT and joints.JOINT."""
    stated = data.get("loop")
    names = [(row["joint"], f"loop.{index}") for index, row in enumerate(stated if isinstance(stated, list) else ())
             if isinstance(row, dict) and row.get("joint") is not None]  # fmt: skip
    return {f"{section}.{name}": row for name, row in names for section in ("loop", "joints")}


def _line(where: str, lines: Lines, rows: Mapping[str, str]) -> int | None:
    """The line of a path, or of the nearest part that contains it; a row of the loop is spoken of by its joint."""
    rest = ""
    while where:
        for path in (where + rest, rows.get(where, where) + rest, where, rows.get(where, where)):
            if path in lines:
                return lines[path]
        where, _, last = where.rpartition(".")
        rest = f".{last}{rest}"
    return lines.get("")
