"""Answers as bytes: a JSON header, then columns of numbers as float32, then files.

uint32 n (little-endian), n bytes of header (a multiple of 4), columns. In the header a column is
`{"column": [first, count]}`, in numbers from the end of the header; NaN stands where there is none. `{"sum": [first,
count]}` is the sum of two columns, one behind the other, which has 48 binary digits. `{"grid": [first, count], "names":
…, "keys": …}` are columns of so many numbers for each name of each key, or for each key where `names` is null. A file
is `{"bytes": [first, count]}`, in bytes from there.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

__all__ = ["Exact", "packed"]

SHORTEST = 16  # numbers: shorter lists stay in the header


@dataclass(frozen=True)
class Exact:
    """A column whose numbers are to arrive with more digits than a float32 has."""

    numbers: np.ndarray


def packed(header: Mapping[str, Any]) -> bytes:
    """A header with its arrays, long lists of numbers and bytes moved into columns."""
    columns: list[np.ndarray] = []
    files: list[bytes] = []
    count = 0
    places: list[dict[str, Any]] = []  # of files: they are counted from the end of the columns

    def column(numbers: np.ndarray) -> dict[str, Any]:
        nonlocal count
        columns.append(np.ravel(numbers))
        count += numbers.size
        return {"column": [count - numbers.size, int(numbers.size)]}

    def plain(value: Any) -> Any:
        if isinstance(value, Mapping):
            rows = list(value.values())
            if (alike := _columns_of(rows)) is not None:
                first, size = column(np.array(alike))["column"]
                names = list(rows[0]) if isinstance(rows[0], dict) else None
                return {"grid": [first, size // len(alike)], "names": names, "keys": list(map(str, value))}
            return {str(key): plain(item) for key, item in value.items()}
        if isinstance(value, np.ndarray):
            return column(value)
        if isinstance(value, Exact):
            high = value.numbers.astype("<f4").astype(float)
            first, size = column(np.concatenate([high, value.numbers - high]))["column"]
            return {"sum": [first, size // 2]}
        if isinstance(value, bytes):
            files.append(value)
            places.append({"bytes": [0, len(value)]})
            return places[-1]
        if isinstance(value, (list, tuple)):
            if len(value) >= SHORTEST and set(map(type, value)) <= {int, float, type(None)}:
                return column(np.array(value, float))
            return [plain(item) for item in value]
        if isinstance(value, float) and not np.isfinite(value):
            return None
        return value.item() if isinstance(value, np.generic) else value

    head = plain(header)
    body = np.concatenate(columns).astype("<f4").tobytes() if columns else b""
    first = len(body)
    for place in places:
        place["bytes"][0] = first
        first += place["bytes"][1]
    text = json.dumps(head, allow_nan=False).encode()  # ASCII: half a character of the page's text comes back as it was
    text += b" " * (-len(text) % 4)
    return struct.pack("<I", len(text)) + text + body + b"".join(files)


def _columns_of(rows: list[Any]) -> list[np.ndarray] | None:
    """The columns of many entries that are alike, a column each or some by name; None of others."""
    if len(rows) < SHORTEST:
        return None
    columns = rows
    if isinstance(rows[0], dict):
        if not all(isinstance(row, dict) and row.keys() == rows[0].keys() for row in rows):
            return None
        columns = [column for row in rows for column in row.values()]
    alike = all(type(column) is np.ndarray and column.shape == columns[0].shape for column in columns)
    return columns if columns and alike else None
