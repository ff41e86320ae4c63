"""The text of a STEP file (ISO 10303-21): its entities by number, read when they are asked for.

`#12=CARTESIAN_POINT('',(0.,1.,2.));` is the entity 12 of the kind CARTESIAN_POINT with the arguments
`['', [0., 1., 2.]]`; a complex entity has several kinds.
"""

from __future__ import annotations

import re
from collections import defaultdict
from pathlib import Path
from typing import Any

from trunnion.exchange.draft import few, refused

__all__ = ["Entity", "Part21", "Ref", "quoted"]

LARGEST = 400_000  # entities of a file that is read; an assembly of a hundred parts has about half of it

_START = re.compile(r"#(\d+)\s*+=\s*+")
# text, comments and what stands between them, up to the semicolon; nothing is tried twice
_BODY = re.compile(r"(?:[^;'/]++|'[^']*+'|/\*(?:[^*]++|\*(?!/))*+\*/|/(?!\*))*+;")
_KIND = re.compile(r"\s*([A-Z][A-Z0-9_]*)\s*\(")
_TOKEN = re.compile(
    r"\s*+(?:/\*.*?\*/\s*+)*(?:(?P<string>'(?:[^']|'')*')|#(?P<ref>\d+)|(?P<number>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"
    r"|\.(?P<enum>\w+)\.|(?P<kind>[A-Za-z_]\w*)|(?P<sign>[()$*,])|\"(?P<binary>[0-9A-F]*)\")",
    re.DOTALL,
)
_WIDE = re.compile(r"\\X2\\((?:[0-9A-F]{4})+)\\X0\\|\\X\\([0-9A-F]{2})|\\S\\(.)")

Entity = dict[str, list[Any]]  # kind → arguments


class Ref(int):
    """The number of another entity."""


class Part21:
    """A STEP file.

    Parameters
    ----------
    path : the file.

    Raises
    ------
    MechanismError : if it is no STEP file, is cut off or has too many entities.
    """

    def __init__(self, path: Path) -> None:
        raw = path.read_bytes()
        if b"ISO-10303-21" not in raw[:4096]:
            raise refused("is not a STEP file: it does not begin with ISO-10303-21")
        if b"ENDSEC" not in raw[-4096:]:
            raise refused("is cut off: its end is missing")
        few(raw.count(b"="), LARGEST, "entities")
        self.text = raw.decode("utf-8", errors="replace")
        self.spans: dict[int, tuple[int, int]] = {}
        self._kinds: dict[str, list[int]] = defaultdict(list)
        self._read: dict[int, Entity] = {}
        start = _START.search(self.text)
        while start is not None:
            number, body = int(start[1][:18]), _BODY.match(self.text, start.end())
            if body is None:
                raise refused(f"is damaged at #{number}: the entity has no end")
            self.spans[number] = start.end(), body.end() - 1
            kind = _KIND.match(body[0])
            for name in [kind[1]] if kind else re.findall(r"([A-Z][A-Z0-9_]*)\s*\(", body[0]):
                self._kinds[name].append(number)
            start = _START.search(self.text, body.end())
        if not self.spans:
            raise refused("has no entities")

    def of(self, kind: str) -> list[int]:
        """Numbers of all entities of a kind, in the order of the file."""
        return self._kinds.get(kind, [])

    def __getitem__(self, number: int) -> Entity:
        """An entity: its arguments by kind."""
        entity = self._read.get(number)
        if entity is None:
            if number not in self.spans:
                raise refused(f"refers to #{number}, which it does not have")
            start, end = self.spans[number]
            entity = self._read[number] = self._parsed(number, self.text[start:end])
        return entity

    def kind(self, number: int) -> str:
        """The kind of an entity, of a complex one the first."""
        return next(iter(self[number]))

    def args(self, number: Any, kind: str) -> list[Any]:
        """The arguments of an entity that must be of a kind."""
        entity = self[number] if isinstance(number, Ref | int) else {}
        if kind not in entity:
            raise refused(f"has {', '.join(entity) or 'nothing'} at #{number} where {kind} belongs")
        return entity[kind]

    def references(self, number: int) -> set[int]:
        """Numbers that the text of an entity names."""
        start, end = self.spans.get(number, (0, 0))
        bare = re.sub(r"'[^']*'", "", self.text[start:end])
        return {int(digits) for digits in re.findall(r"#(\d+)", bare)}

    def _parsed(self, number: int, text: str) -> Entity:
        values: list[Any] = []
        stack: list[list[Any]] = [values]
        kinds: list[str] = []  # the kind in front of each open list; empty if none
        pending = ""
        position, end = 0, len(text.rstrip())
        while position < end:
            token = _TOKEN.match(text, position)
            if token is None:
                raise refused(f"cannot be read at #{number}: '{text[position : position + 30].strip()}'")
            position = token.end()
            name = token.lastgroup or "sign"
            value: str = token[name]
            if name == "kind":
                pending = value.upper()
            elif value == "(" and name == "sign":
                stack.append([])
                kinds.append(pending)
                pending = ""
            elif value == ")" and name == "sign":
                if len(stack) < 2:
                    raise refused(f"has a bracket too many at #{number}")
                inner, kind = stack.pop(), kinds.pop()
                stack[-1].append((kind, inner) if kind else inner)
            elif name == "sign":
                if value != ",":
                    stack[-1].append(None)
            else:
                stack[-1].append(_value(name, value))
        records = values[0] if len(values) == 1 and isinstance(values[0], list) else values
        if len(stack) > 1 or not all(isinstance(record, tuple) for record in records):
            raise refused(f"cannot be read at #{number}: its brackets do not match")
        return dict(records)


def _value(name: str, text: str) -> Any:
    """A token as a Python value; in a text \\X2\\…\\X0\\ are signs in UTF-16, \\X\\… and \\S\\… those of ISO 8859-1."""

    def decoded(match: re.Match[str]) -> str:
        if match[1]:
            return bytes.fromhex(match[1]).decode("utf-16-be", errors="replace")
        return chr(int(match[2], 16)) if match[2] else chr(ord(match[3]) + 128)

    if name == "string":
        return _WIDE.sub(decoded, text[1:-1].replace("''", "'")).replace("\\\\", "\\")
    if name == "ref":
        return Ref(text)
    if name == "number":
        return float(text)
    return text == "T" if name == "enum" and text in ("T", "F") else text


def quoted(text: str) -> str:
    """A text as a string of a STEP file."""
    signs = text.replace("\\", "\\\\").replace("'", "''")
    coded = (c if " " <= c <= "~" else f"\\X2\\{c.encode('utf-16-be').hex().upper()}\\X0\\" for c in signs)
    return f"'{''.join(coded)}'"
