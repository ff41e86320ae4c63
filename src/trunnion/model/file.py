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
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import AliasEvent, CollectionEndEvent, CollectionStartEvent
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode
from ruamel.yaml.parser import Parser

from trunnion.errors import Finding, MechanismError
from trunnion.files import whole
from trunnion.model.csv_table import TableFiles, place_findings, with_own_points, with_points
from trunnion.model.text import read_text

__all__ = [
    "Lines", "composed", "entries_of", "place", "placed", "read_entries", "read_model", "text_of",
    "version_findings", "write_model", "yaml_writer",
]  # fmt: skip

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
        data, own_points = with_own_points(data, path)
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
    path, findings = Path(path), list(findings)
    if not findings:
        return []
    only = set(sections)
    text = read_text(path, "a model file", MAX_BYTES, "start from one of the examples")
    data, lines = entries_of(text, _file_type(path))
    rows = _rows(data)
    placed_findings: list[Finding] = []
    for finding in findings:
        section, *names = finding.where.split(".")
        entry = ".".join([section, *names[:1]])
        present = entry in rows or (section in data and entry in lines)
        if present and not finding.file and (not only or section in only):
            finding = finding.at(str(path), _line(finding.where, lines, rows))
        placed_findings.append(finding)
    return placed_findings


def write_model(data: Mapping[str, Any], path: str | os.PathLike[str]) -> None:
    """Write the plain data of a model as YAML or JSON, whole or not at all; MechanismError if it cannot be written."""
    path = Path(path)
    kind = _file_type(path)
    if kind == "TOML":
        raise MechanismError(Finding("TOML is read but not written", file=str(path), remedy="write .yaml or .json"))
    with whole(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as stream:
        if kind == "JSON":
            json.dump(data, stream, indent=2, ensure_ascii=False)
            stream.write("\n")
        else:
            yaml_writer().dump(data, stream)


def text_of(data: Mapping[str, Any]) -> str:
    """The plain data of a model as YAML."""
    stream = StringIO()
    yaml_writer().dump(data, stream)
    return stream.getvalue()


def yaml_writer() -> YAML:
    """What writes plain data: the innermost groups on one line."""
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.allow_unicode = True
    yaml.width = 110
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]  # keys as stated
    return yaml


def version_findings(data: Mapping[str, Any]) -> list[Finding]:
    """That a file does not state its version."""
    missing = Finding("the version of the file is missing", "trunnion", "begin the file with trunnion: 1", line=1)
    return [] if "trunnion" in data else [missing]


def _file_type(path: Path) -> str:
    suffix = path.suffix.lower()
    if suffix not in _TYPES:
        raise MechanismError(
            Finding(
                f"the extension '{suffix}' is not one of a model file",
                file=str(path),
                remedy=f"use {', '.join(_TYPES)}",
            )
        )
    return _TYPES[suffix]


def entries_of(text: str, kind: str = "YAML") -> tuple[dict[str, Any], Lines]:
    """Plain data of a text in YAML, JSON or TOML, and the line of every path in it; MechanismError if it is none."""
    try:
        return _parse_toml(text) if kind == "TOML" else _parse_yaml(text, kind)
    except RecursionError:
        raise MechanismError(Finding("is nested too deeply", remedy="check brackets")) from None


def _parse_toml(text: str) -> tuple[dict[str, Any], Lines]:
    if deep := _DEEP_KEY.search(text):  # tomllib takes a time with the square of the dots
        at = text.count("\n", 0, deep.start()) + 1
        raise MechanismError(Finding("is nested too deeply", remedy="check the dots in the key", line=at))
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        match = re.search(r"at line (\d+), column \d+", str(error))
        raise MechanismError(
            Finding(f"is not TOML: {error}", remedy="correct it there", line=int(match[1]) if match else None)
        ) from error
    except ValueError as error:  # of a whole number that Python does not read
        raise MechanismError(Finding(f"is not TOML: {error}", remedy="write a number as 1.25e1")) from error
    if _depth(data) > MAX_DEPTH:
        raise MechanismError(Finding("is nested too deeply", remedy="check brackets and the dots in keys"))
    return data, {}  # tomllib keeps no lines


def _depth(data: Any) -> int:
    """How deeply groups and lists are nested."""
    depth, layer = 0, [data]
    while layer:
        depth += 1
        groups = (node.values() if isinstance(node, dict) else node for node in layer)
        layer = [node for group in groups for node in group if isinstance(node, (dict, list))]
    return depth


def _parse_yaml(text: str, kind: str) -> tuple[dict[str, Any], Lines]:
    if kind == "JSON":
        text = text.replace("\t", " ")  # allowed between the tokens of JSON, not of YAML
    try:
        root = composed(text)
    except MechanismError:
        raise
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        what = f"is not {kind}: {error.problem or error.context}" + (f" (column {mark.column + 1})" if mark else "")
        remedy = "check indentation, brackets and quotes; a name with brackets stands in quotation marks"
        raise MechanismError(Finding(what, remedy=remedy, line=mark.line + 1 if mark else None)) from error
    except YAMLError as error:
        what = f"is not {kind}: {str(error).splitlines()[0]}"
        raise MechanismError(Finding(what, remedy="check that it is a text file")) from error
    except (ValueError, TypeError, LookupError, AttributeError, AssertionError, ArithmeticError) as error:
        # ruamel lets some of Python's own errors pass on text that is no YAML
        raise MechanismError(Finding(f"is not {kind}: {error}", remedy="check that it is a text file")) from error
    if not isinstance(root, MappingNode):
        what = "is not a group of entries (key: value) at its top"
        raise MechanismError(Finding(what, remedy="start from one of the examples", line=1))
    builder = _Builder(text)
    data = builder.build(root, "")
    if builder.findings:
        raise MechanismError(builder.findings)
    return data, builder.lines


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
            what = f"the alias *{event.anchor} is not allowed"
            raise MechanismError(Finding(what, remedy="write it out, or name a dimension", line=line))
        if tag and tag not in _PLAIN_TAGS and tag != "!":  # a tag can name code
            raise MechanismError(Finding(f"the tag {tag} is not allowed", remedy="remove the tag", line=line))
        if self.nesting > MAX_DEPTH:
            what, remedy = "is nested too deeply", "check brackets and indentation"
            raise MechanismError(Finding(what, remedy=remedy, line=line))
        return event


class _Builder:
    """Plain data from YAML nodes, with the line of every path, and what is wrong on the way."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.lines: Lines = {}
        self.findings: list[Finding] = []

    def build(self, node: Node, path: str) -> Any:
        """The value of a node at a path."""
        self.lines.setdefault(path, node.start_mark.line + 1)
        if isinstance(node, MappingNode):
            return self._mapping(node, path)
        if isinstance(node, SequenceNode):
            items = self._uncut(node, [(item, f"{path}.{index}") for index, item in enumerate(node.value)])
            return [self.build(item, below) for item, below in items]
        assert isinstance(node, ScalarNode)  # there are no other nodes
        return self._scalar(node, path)

    def _uncut(self, node: MappingNode | SequenceNode, items: list[tuple[Node, str]]) -> list[tuple[Node, str]]:
        """The values of a list or group, by path, without those that YAML cut out of an expression at its commas."""
        pieces, until = [], 0
        for item, path in items:
            start = item.start_mark.index
            if start < until:
                continue
            pieces.append((item, path))
            plain = node.flow_style and isinstance(item, ScalarNode) and not item.style
            if plain and item.value.count("(") > item.value.count(")"):
                inner = _balanced(self.text[start : node.end_mark.index - 1])
                until = start + len(inner)
                if inner:
                    excerpt, kind = " ".join(inner.split()), "braces" if isinstance(node, MappingNode) else "brackets"
                    what = f"'{excerpt[:80]}' has a comma, which ends a value in {kind}"
                    mark = "'" if '"' in excerpt else '"'
                    remedy = f"put it in quotation marks: {mark}{excerpt}{mark}"
                    self.findings.append(Finding(what, path, remedy, line=item.start_mark.line + 1))
        return pieces

    def _mapping(self, node: MappingNode, path: str) -> dict[str, Any]:
        values: dict[str, Any] = {}
        parts = [(value, f"{path}.{key.value}".lstrip(".")) for key, value in node.value]
        uncut = {id(value) for value, _ in self._uncut(node, parts)}
        for key_node, value_node in node.value:
            if id(value_node) not in uncut:
                continue
            line = key_node.start_mark.line + 1
            if not isinstance(key_node, ScalarNode):
                self.findings.append(Finding("a key is not a text", path, "write key: value", line=line))
                continue
            key = self._text(key_node, path)
            below = f"{path}.{key}" if path else key
            if key in values:
                what = f"the key '{key}' is given twice, first in line {self.lines[below]}"
                self.findings.append(Finding(what, below, "remove one of them", line=line))
                continue
            self.lines[below] = line
            values[key] = self.build(value_node, below)
        return values

    def _text(self, node: ScalarNode, path: str) -> str:
        """What a node says; half a sign, which JSON can escape, is in no text that can be written again."""
        text = str(node.value)
        encodable = text.encode("utf-8", "replace").decode()
        if encodable != text:
            line = node.start_mark.line + 1
            self.findings.append(
                Finding(f"'{encodable[:40]}' has half a sign (\\ud800 …)", path, "remove it", line=line)
            )
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
            remedy = "write a number as 12.5 or 1.25e1"
            line = node.start_mark.line + 1
            self.findings.append(Finding(f"'{text[:40]}' is not a number", path, remedy, line=line))
        return text


def _balanced(text: str) -> str:
    """The beginning of a text up to the first comma outside parentheses; empty if some are left open."""
    depth = 0
    for place, sign in enumerate(text):
        depth += (sign == "(") - (sign == ")")
        if sign == "," and depth == 0:
            return text[:place].rstrip()
    return "" if depth else text.rstrip()


def place(findings: Iterable[Finding], file: str, lines: Lines, data: Mapping[str, Any]) -> list[Finding]:
    """Findings with their file and line, in the order of the file."""
    rows = _rows(data)
    placed = [
        finding if finding.file else finding.at(file, finding.line or _line(finding.where, lines, rows))
        for finding in findings
    ]
    return sorted(placed, key=lambda finding: (finding.file != file, finding.file, finding.line or 0))


def _rows(data: Mapping[str, Any]) -> dict[str, str]:
    """Where the rows of the loop stand, by the paths that findings have for them: loop.JOINT and joints.JOINT."""
    rows = {f"loop.{row.get('joint')}": f"loop.{index}" for index, row in _groups(data.get("loop"))}
    return rows | {f"joints.{name.partition('.')[2]}": row for name, row in rows.items()}


def _groups(items: Any) -> list[tuple[int, dict[str, Any]]]:
    """The groups of entries in a list, with their index."""
    return [
        (index, item) for index, item in enumerate(items if isinstance(items, list) else ()) if isinstance(item, dict)
    ]


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
