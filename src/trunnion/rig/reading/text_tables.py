"""Tables of text: what separates the cells, how decimals are written, names, units, and the numbers in pieces.

The separator is the first of semicolon, tab and comma that the header has; with semicolon or tab a number may have a
decimal comma. Units stand in brackets behind the name, `T1 [V]`, or in a row of their own below the names. Lines that
begin with # are passed over, and so is what a logger writes above the header.

Pandas reads the rows. What stands above them is read by hand: clevercsv would tell the separator alone, not the header
among a logger's lines, the units and the sign of decimals.
"""

from __future__ import annotations

import csv
import io
import re
from collections import deque
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from trunnion.model.names import unguarded
from trunnion.model.units import UnitError
from trunnion.rig.reading.clock import Clock, is_time
from trunnion.rig.reading.columns import (
    NOTHING,
    Column,
    DataTable,
    choose,
    clock_of,
    failed,
    number,
    numbers,
    ungrouped,
)
from trunnion.rig.reading.sensor_quantity import dimensions

__all__ = ["read_csv"]

HEAD = 1 << 16  # bytes in which the header and the first rows are looked for, and more where the lines are long
LINES = 20  # that are read at least
LONGEST = 1 << 24  # bytes in which the first lines have to end
ROWS = 250_000  # read at a time, so that memory does not grow with the columns that are not wanted
WIDE = 40  # columns from which those that are not wanted are passed over, and too many cells in a row not seen
_UNIT = re.compile(r"^(.*?)\s*\[([^\[\]]*)\]\s*$", re.DOTALL)
_BEHIND = re.compile(r"^(.*?\S)\s*(?:\(([^()]+)\)|(?:\s/|\sin)\s+(\S.*))$", re.DOTALL)  # T (V), T / V, T in V
_COMMA = re.compile(r"[-+]?(?:\d{1,3}(?:\.\d{3})+|\d{1,3}(?:['’\u00a0\u202f ]\d{3})+|\d*),\d+(?:[eE][-+]?\d+)?")
_QUOTED = re.compile(r'"[^"]*"')
_POINT = re.compile(r"[-+]?\d*\.\d+(?:[eE][-+]?\d+)?")
_NO_UNIT = ("", "-", "–", "1")
GERMAN = ("Grad", "U/min", "Umin", "Umdr./min")  # units in headings, if not all are read without the mapping's word
MOST_BELOW = 5  # lines of words below the numbers
MOST_ABOVE = 3  # rows of units and remarks between names and numbers


@dataclass(frozen=True)
class _Layout:
    """How a file is written. skip: lines before the first row; width: cells of the header."""

    names: list[str]
    units: list[str]
    separator: str
    decimal: str
    encoding: str
    skip: int
    width: int


def read_csv(path: Path, wanted: Sequence[str], optional: Sequence[str]) -> DataTable:
    """The columns of a text file, read in pieces, so that memory is that of the columns asked for."""
    layout = _layout(path, {*wanted, *optional})
    places = choose(path, layout.names, wanted, optional)
    units = {name: layout.units[place] for name, place in places.items()}
    pieces: dict[str, list[Any]] = {name: [] for name in places}
    texts, examples = dict.fromkeys(places, 0), dict.fromkeys(places, "")
    clocks: dict[str, Clock | None] = {}
    for frame in _frames(path, layout, sorted(set(places.values()))):
        for name, place in places.items():
            cells = frame[place].to_numpy()
            if layout.decimal == ",":
                _check_signs(path, name, cells)
            values, found, example = numbers(cells, layout.decimal)
            if name not in clocks:
                clocks[name] = clock_of(cells, found, example)
            elif (clock := clocks[name]) is not None:
                clock.add(cells.tolist())
            pieces[name].append(values)
            texts[name] += found
            examples[name] = examples[name] or example
    columns = {}
    for name in places:
        values = np.concatenate(pieces.pop(name) or [np.empty(0)])
        columns[name] = Column(values, units[name], texts[name], examples[name], clocks.get(name))
    columns, ends = _without_end(path, layout, columns, places)
    notes = [] if layout.encoding.startswith("utf-8") else [f"read in the encoding {layout.encoding}"]
    return DataTable(str(path), columns, notes=notes, ends=ends)


def _without_end(
    path: Path, layout: _Layout, columns: dict[str, Column], places: Mapping[str, int]
) -> tuple[dict[str, Column], dict[int, str]]:
    """The columns without lines of words below the last row of numbers, as loggers write them, and these lines."""
    known = [np.isfinite(one.values) | (one.clock.known() if one.clock else False) for one in columns.values()]
    rows = np.flatnonzero(np.any(known, axis=0)) if known else np.empty(0)
    extra = known[0].size - int(rows[-1]) - 1 if rows.size else 0
    if not 0 < extra <= MOST_BELOW:
        return columns, {}
    last: deque[tuple[int, str]] = deque(maxlen=extra)
    with path.open(encoding=layout.encoding, errors="replace") as file:
        for number_of_line, line in enumerate(file, 1):
            if line.strip() and not line.lstrip().startswith("#"):
                last.append((number_of_line, line.strip()))
    cells = [_cells(line, layout.separator) for _, line in last]
    if not all(_words(row) for row in cells):
        return columns, {}
    found = {}
    for name, one in columns.items():
        own = [row[places[name]] for row in cells if len(row) > places[name]]
        texts = one.texts - sum(bool(cell) and cell.casefold() not in NOTHING for cell in own)
        if one.clock is not None:
            one.clock.cut(one.values.size - extra)
        example = one.example if texts else ""
        found[name] = replace(one, values=one.values[:-extra], texts=texts, example=example)
    return found, {place: " ".join(filter(None, row)) for (place, _), row in zip(last, cells, strict=True)}


def _check_signs(path: Path, name: str, cells: Any) -> None:
    """MechanismError for a decimal point in a file that has decimal commas: one of them parts thousands."""
    if cells.dtype.kind in "fiub":
        return
    found = next((one for one in cells.tolist() if isinstance(one, str) and _POINT.fullmatch(one.strip())), None)
    if found is not None:
        what = f"decimal and thousands signs are mixed: '{found.strip()[:20]}' in '{name}' beside decimal commas"
        raise failed(path, what, "export it without a sign between thousands, and with one sign for decimals")


def _frames(path: Path, layout: _Layout, places: list[int]) -> Any:
    """Frames of some rows; MechanismError with the line of a row that is no row."""
    import pandas as pd

    version = tuple(int(part) for part in re.findall(r"\d+", pd.__version__)[:2])
    exact: dict[str, Any] = {} if version >= (3, 1) else {"float_precision": "round_trip"}
    found = None
    try:
        found = pd.read_csv(
            path, sep=layout.separator, decimal=layout.decimal, header=None, names=list(range(layout.width)),
            usecols=places if layout.width > WIDE else None, skiprows=layout.skip, comment="#",
            encoding=layout.encoding, encoding_errors="replace", chunksize=ROWS, low_memory=False,
            skipinitialspace=True, **exact,
        )  # fmt: skip
        yield from found
    except pd.errors.EmptyDataError:
        return
    except pd.errors.ParserError as error:
        text = str(error)
        line = re.search(r"line (\d+)", text)
        row = re.search(r"Expected (\d+) fields in line (\d+), saw (\d+)", text)
        what = f"has {row[3]} cells, the header has {row[1]}" if row else f"is not CSV: {text.strip()[-120:]}"
        raise failed(path, what, "correct that line", int(line[1]) if line else None) from None
    finally:
        if found is not None:
            found.close()


def _decoded(path: Path) -> tuple[list[str], str]:
    """The first lines, whole ones but for the last of a long file, and how they are encoded."""
    with path.open("rb") as file:
        raw = file.read(HEAD)
        while _ends(raw) < LINES and len(raw) < LONGEST and (more := file.read(len(raw))):
            raw += more
        if not _ends(raw) and file.read(1):
            what = f"has no end of a line in its first {LONGEST >> 20} MiB"
            raise failed(path, what, "check that it is CSV, with a row of the table in each line", 1)
    encodings = ["utf-16"] if raw.startswith((b"\xff\xfe", b"\xfe\xff")) else ["utf-8-sig", "cp1252", "latin-1"]
    if b"\0" in raw and encodings[0] != "utf-16":
        raise failed(path, "is not a text file", "check that it is CSV; use .tdms or .parquet for binary files")
    for encoding in encodings:
        for cut in range(4):  # the last sign may be cut in two
            try:
                text = raw[: len(raw) - cut].decode(encoding)
            except UnicodeDecodeError:
                continue
            return io.StringIO(text, newline=None).read().split("\n"), encoding
    raise failed(path, "is not a text file", "save it as UTF-8")


def _ends(raw: bytes) -> int:
    return raw.count(b"\n") or raw.count(b"\r")


def _layout(path: Path, wanted: set[str]) -> _Layout:
    """Names, units and signs of a file from its first lines."""
    lines, encoding = _decoded(path)
    stated = [(place, line) for place, line in enumerate(lines) if line.strip() and not line.lstrip().startswith("#")]
    if not stated:
        raise failed(path, "has only comments", "check that the recording was saved", 1)
    best, header, cells, separator = -1, 0, [""], ","
    for order, (_, line) in enumerate(stated[:200]):  # loggers write some lines above the header
        bare = _QUOTED.sub("", line)
        sign = next((one for one in ";\t" if one in bare), ",")
        found = _cells(line, sign)
        hits = len({_named(cell, wanted)[0] for cell in found} & wanted)
        if hits > max(best, 0) or best < 0:
            best, header, cells, separator = hits, order, found, sign
    named = [_named(cell, wanted) for cell in cells]
    if best == 0 and sum(bool(name) for name, _ in named) < len(wanted):
        first = " / ".join(line.strip()[:60] for _, line in stated[:3])
        what = f"no line has the columns {', '.join(map(repr, sorted(wanted)))}; the first lines are: {first}"
        raise failed(path, what, "write the names of the columns above the numbers, or name another file", 1)
    if all(not np.isnan(number(ungrouped(name, ","))) for name, _ in named if name):
        first = ", ".join(cells[:4])
        remedy = "write the names of the columns in the first line, such as t [s],T1 [V]"
        raise failed(path, f"has no header: its first line is {first}", remedy, stated[header][0] + 1)
    units = [unit for _, unit in named]
    rows = stated[header + 1 :]
    above = _above_numbers([_cells(line, separator) for _, line in rows[: MOST_ABOVE + 1]])
    row = next((one for one in above if any(map(_is_unit, one))), above[0] if above else [])
    units = [own or (row[k] if k < len(row) else "") for k, own in enumerate(units)]
    rows, skip = rows[len(above) :], header + len(above)
    read = [k for k, (name, _) in enumerate(named) if name in wanted]
    sample = [cell for _, line in rows[:200] for k, cell in enumerate(_cells(line, separator)) if k in read]
    comma = separator != "," and any(_COMMA.fullmatch(cell) for cell in sample)
    width = len(cells)
    for place, line in rows[:200]:
        found = _cells(line, separator)
        if any(found[len(cells) :]):
            remedy = "correct that line; numbers with a decimal comma need a semicolon or tab between them"
            raise failed(path, f"has {len(found)} cells, the header has {len(cells)}", remedy, place + 1)
        width = max(width, len(found))  # separators at the end of lines
    return _Layout([name for name, _ in named], units, separator, "," if comma else ".", encoding,
                   stated[skip][0] + 1, width)  # fmt: skip


def _cells(line: str, separator: str) -> list[str]:
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]
    except (csv.Error, StopIteration):
        return [line]


def _named(cell: str, wanted: Container[str]) -> tuple[str, str]:
    """Name and unit of a header's cell: `T [V]`, and where it is a unit `T / V`, `T in V` or `T (V)`.

    A name that is wanted with its unit in it stays whole.
    """
    cell = unguarded(cell.strip().strip('"').strip())
    found = _UNIT.match(cell)
    if found:
        unit = "" if found[2].strip() in _NO_UNIT else found[2].strip()
        return (cell if cell in wanted else found[1]), unit
    found = _BEHIND.match(cell)
    unit = (found[2] or found[3]).strip() if found else ""
    if not found or not (_is_unit(unit) or unit in GERMAN):
        return cell, ""
    return (cell if cell in wanted else found[1]), unit


def _above_numbers(rows: Sequence[Sequence[str]]) -> list[list[str]]:
    """The rows of words between names and numbers, as units; a first row with a unit is one whatever follows.

    What is no unit is one as well, if it stands where they do: that it is unknown is told of the column that has it.
    """
    found: list[list[str]] = []
    for cells in rows[:MOST_ABOVE]:
        bare = [cell.strip().strip("[]()").strip() for cell in cells]
        if not _words(bare):
            break
        found.append(["" if cell in _NO_UNIT else cell for cell in bare])
    sure = next((k + 1 for k, one in enumerate(found) if any(map(_is_unit, one))), 0)
    return found if len(rows) > len(found) and any(map(_is_number, rows[len(found)])) else found[:sure]


def _words(cells: Sequence[str]) -> bool:
    """Whether there is no number and no time in a row, and at least one word."""
    if any(_is_number(cell) for cell in cells if cell != "1"):
        return False
    return any(re.search(r"[^\W\d_]|[°%‰]", cell) and cell.casefold() not in NOTHING for cell in cells)


def _is_number(cell: str) -> bool:
    return not np.isnan(number(cell.replace(",", "."))) or is_time(cell)


def _is_unit(text: str) -> bool:
    try:
        return bool(text) and bool(dimensions(text))
    except UnitError:
        return False
