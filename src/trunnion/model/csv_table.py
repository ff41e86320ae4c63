"""Points of drivers and tables from CSV files: those that the user names, and those that a model names.

A model may name a file in its own folder only, see `text.in_folder`.

Two columns, first time or drive coordinate, then value; separated by semicolon, tab or comma, the first of these that
the first line has. With semicolon or tab a number may have a decimal comma. A first row of texts is a header, whose
units stand in brackets: `time [ms], angle [deg]`; numbers without a unit are SI. Empty lines and lines with # are
passed over. Of a file with more columns a model names two by their headers, see `_named_columns`.
"""

from __future__ import annotations

import csv
import io
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from trunnion.errors import Finding, MechanismError
from trunnion.joints.pairs import PAIRS
from trunnion.model.expression import literal
from trunnion.model.names import nearest
from trunnion.model.quantity import Quantity
from trunnion.model.text import MOST_FILES, OF_A_FILE, in_folder, read_text, stated_files
from trunnion.model.units import ANY, KINDS, NUMBER, Kind, UnitError, dimension_text, unit

__all__ = ["TableFiles", "TablePoints", "column", "place_findings", "with_own_points", "with_points"]

TableFiles = Mapping[str, str | os.PathLike[str]]  # file by name of a driver or table

MAX_BYTES = 1_000_000
MAX_ROWS = 10_000  # points of a spline; an analysis of 360 positions then takes seconds
MAX_OWN_ROWS = 20_000  # of all files that a model names: reading them takes some seconds
SHOWN = 8  # findings about one file; the rest is counted
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?", re.ASCII)
_IN_BRACKETS = re.compile(r"\[([^\[\]]*)\]\s*$")
_IN_PARENTHESES = re.compile(r"\(([^()]*)\)\s*$")
_NO_UNIT = ("", "-", "–", "1")

Row = tuple[int, list[str]]  # line and cells


class TablePoints(NamedTuple):
    """Points from a file: where they belong in the model, and the line of each."""

    where: str
    file: str
    rows: list[list[float | str]]
    lines: list[int]


def with_points(data: Mapping[str, Any], files: TableFiles) -> tuple[dict[str, Any], list[TablePoints]]:
    """Plain data of a model with the points of drivers and tables replaced by those of files.

    A driver of another motion law becomes one of law `table`. MechanismError with every finding in every file.
    """
    changed, read = dict(data), []
    findings: list[Finding] = []
    for name, path in files.items():
        try:
            section, key = _holder(data, name)
            points = _points(Path(path), f"{section}.{key}.points", _kinds(data, section, key))
        except MechanismError as error:
            findings += error.findings
            continue
        read.append(points)
        _put(changed, section, key, points)
    if findings:
        raise MechanismError(findings)
    return changed, read


def _put(data: dict[str, Any], section: str, key: str, points: TablePoints) -> None:
    """Points in place of those that a driver or table states, or of the file that it names."""
    entry = data[section][key]
    rest = {key: value for key, value in entry.items() if key not in OF_A_FILE} if isinstance(entry, Mapping) else {}
    if section == "drivers" and rest.get("law") != "table":
        rest = {"law": "table"}
    data[section] = {**data[section], key: {**rest, "points": points.rows}}


def with_own_points(data: Mapping[str, Any], model: Path) -> tuple[dict[str, Any], list[TablePoints]]:
    """Plain data of a model file with the points from the files in its folder that drivers and tables name.

    MechanismError with every finding: about a name where it stands in the model, about the content with file and line.
    """
    changed, read = dict(data), list[TablePoints]()
    findings: list[Finding] = []
    size = 0
    for count, (section, key, name) in enumerate(stated_files(data), start=1):
        where, entry = f"{section}.{key}", data[section][key]
        names = entry.get("columns")
        try:
            if names is not None and not (isinstance(names, list) and list(map(type, names)) == [str, str]):
                what, remedy = "is not the headers of two columns", "write two texts: columns: [time, pressure]"
                raise MechanismError(Finding(what, f"{where}.columns", remedy))
            if "points" in entry:
                raise MechanismError(Finding("states both points and a file", where, "remove one of them"))
            path = in_folder(model.resolve().parent, name, f"{where}.file")
            size += path.stat().st_size
            if count > MOST_FILES or size > MAX_BYTES or sum(len(points.rows) for points in read) > MAX_OWN_ROWS:
                what = f"the files that the model names are too many or too long: more than {MOST_FILES} files, over "
                what += f"{MAX_BYTES / 1e6:g} MB or {MAX_OWN_ROWS} rows"
                findings.append(Finding(what, f"{where}.file", "use fewer points: values between are interpolated"))
                break
            points = _points(path, f"{where}.points", _kinds(data, section, key), str(model.parent / name), names)
        except MechanismError as error:
            findings += error.findings
            continue
        read.append(points)
        _put(changed, section, key, points)
    if findings:
        raise MechanismError(findings)
    return changed, read


def place_findings(findings: Sequence[Finding], read: Sequence[TablePoints]) -> list[Finding]:
    """The findings, those about points with the file and line that these came from and a few for each file."""
    placed = [finding for finding in findings if not any(_speaks_of(finding, points) for points in read)]
    for points in read:
        own_findings = [finding for finding in findings if _speaks_of(finding, points)]
        placed += _few([finding.at(points.file, _line(finding, points)) for finding in own_findings])
    return placed


def _speaks_of(finding: Finding, points: TablePoints) -> bool:
    return f"{finding.where}.".startswith(f"{points.where}.")


def _line(finding: Finding, points: TablePoints) -> int:
    index = finding.where[len(points.where) + 1 :].partition(".")[0]
    return points.lines[int(index) if index.isdecimal() else 0]


def _few(findings: list[Finding]) -> list[Finding]:
    """The first few findings, and how many more there are."""
    if len(findings) <= SHOWN:
        return findings
    more = Finding(f"and {len(findings) - SHOWN} more like these", findings[0].where, "correct those above first")
    return [*findings[:SHOWN], more.at(findings[0].file, findings[SHOWN].line)]


def _holder(data: Mapping[str, Any], name: str) -> tuple[str, str]:
    """Section and name of the driver or table that a name means; `drivers.A` and `tables.A` tell two apart."""
    sections = {section: data.get(section) for section in ("drivers", "tables")}
    names = {section: list(part) if isinstance(part, Mapping) else [] for section, part in sections.items()}
    section, dot, key = name.partition(".")
    if dot and key in names.get(section, ()):
        return section, key
    holders = [holder for holder in names if name in names[holder]]
    if len(holders) == 2:
        raise MechanismError(
            Finding(f"'{name}' is a driver and a table", remedy=f"say drivers.{name} or tables.{name}")
        )
    if not holders:
        remedy = nearest(name, [*names["drivers"], *names["tables"]])
        raise MechanismError(Finding(f"there is no driver or table '{name}'", remedy=remedy))
    return holders[0], name


def _kinds(data: Mapping[str, Any], section: str, key: str) -> tuple[Kind, Kind]:
    """What the two columns measure; a model that does not tell is refused elsewhere."""
    entry, drivers, joints = data[section][key], data.get("drivers"), data.get("joints")
    in_time = section == "drivers" or (isinstance(entry, Mapping) and entry.get("over") == "time")
    joint = key if section == "drivers" else next(iter(drivers), "") if isinstance(drivers, Mapping) else ""
    stated = joints.get(joint) if isinstance(joints, Mapping) else None
    pair = PAIRS.get(str(stated.get("type"))) if isinstance(stated, Mapping) else None
    either = KINDS["angle"] | KINDS["length"]
    coordinate = either if pair is None else KINDS["angle" if pair.turns else "length"]
    return KINDS["time"] if in_time else coordinate, coordinate if section == "drivers" else ANY


# ---- the file -------------------------------------------------------------------------------------------------


def _points(
    path: Path, where: str, kinds: tuple[Kind, Kind], label: str = "", names: Sequence[str] | None = None
) -> TablePoints:
    """The points of a file; MechanismError with file and line of every finding, a few of each file.

    label: what the file is called in findings; names: the headers of the two columns, of a file that has more.
    """
    units, rows = _columns(path, kinds, label or str(path), names)
    if names:  # of another program, which writes numbers of SI without their unit
        plain = (KINDS["time"], KINDS["angle"], KINDS["length"])
        units = [text or kind.unit * (kind in plain) for text, kind in zip(units, kinds, strict=True)]
    points: list[list[float | str]] = [
        [f"{cell} {unit}" if unit else float(cell) for cell, unit in zip(cells, units, strict=True)]
        for _, cells in rows
    ]
    return TablePoints(where, label or str(path), points, [line for line, _ in rows])


def column(path: Path, kind: Kind) -> list[float]:
    """The numbers of a file that has one column, SI; MechanismError with file and line of every finding.

    A header may state the unit as in a table; numbers may have a decimal comma.
    """
    units, rows = _columns(path, (kind,), str(path))
    return [literal(cells[0], units[0]).value for _, cells in rows]


# by the number of columns: what a file is, of what it has a row, an example of one, and what to do about too many
_TABLE = ("table", "a row for each point", "0; 12.5", "use fewer points: values between them are interpolated")
_SAMPLE = ("sample", "a deviation in each line", "0.012", "use a random subset")


def _columns(
    path: Path, kinds: Sequence[Kind], label: str, names: Sequence[str] | None = None
) -> tuple[list[str], list[Row]]:
    """The units of one or two columns, and their rows of plain numbers; MechanismError as `_points`."""
    noun, each, example, fewer = _TABLE if len(kinds) == 2 else _SAMPLE
    try:
        text = read_text(path, f"a {noun}", MAX_BYTES, f"write {each}, such as {example}")
        numbered = [(number, line) for number, line in enumerate(io.StringIO(text, newline=None), start=1)
                  if line.strip() and not line.lstrip().startswith("#")]  # fmt: skip
        if not numbered:
            raise MechanismError(Finding("has only comments", remedy=f"write {each}", line=1))
        if len(numbered) > MAX_ROWS + 1:
            raise MechanismError(Finding(f"has {len(numbered)} rows, a {noun} at most {MAX_ROWS}", remedy=fewer))
        separator = next((mark for mark in ";\t" if mark in numbered[0][1]), "," if len(kinds) == 2 else ";")
        rows = [(number, _cells(line, separator)) for number, line in numbered]
        if names:
            rows = _with_units(_named_columns(rows, names))
        if len(rows[0][1]) != len(kinds):
            what = f"has {len(rows[0][1])} column{'s' * (len(rows[0][1]) > 1)}, a {noun} has {len(kinds)}"
            raise MechanismError(Finding(what, remedy=_OTHER_COLUMNS[len(kinds)], line=rows[0][0]))
        headed = bool(names) or not any(_number(cell, separator) for cell in rows[0][1])
        units = _units(rows[0], kinds) if headed else [""] * len(kinds)
        numbers = rows[1:] if headed else rows
        if len(numbers) < 2:
            what = f"has {len(numbers) or 'no'} row{'s' * (not numbers)} of numbers, a {noun} needs two"
            raise MechanismError(Finding(what, remedy=f"add rows such as {example}", line=rows[-1][0]))
        if findings := list(_unreadable(numbers, separator, len(kinds))):
            raise MechanismError(_few(findings))
    except csv.Error as error:
        raise MechanismError(
            Finding(f"is not CSV: {error}", remedy="check that it is a text file", file=label)
        ) from None
    except MechanismError as error:
        raise MechanismError([finding.at(label, finding.line) for finding in error.findings]) from None
    return units, [(line, [_number(cell, separator) for cell in cells]) for line, cells in numbers]


_OTHER_COLUMNS = {
    1: "keep the column of the deviations; a table of two columns is given by --table",
    2: "write time or drive coordinate, then value, and between them a comma, or beside decimal commas ; or a tab; of "
    "more columns name two: columns: [time, pressure]",
}


def _named_columns(rows: Sequence[Row], names: Sequence[str]) -> list[Row]:
    """The rows with two of their cells: below the headers that are these names, which may leave out the unit.

    MechanismError if none or several have a name.
    """
    line, header = rows[0]
    plain = [re.sub(_IN_BRACKETS, "", cell).strip() for cell in header]
    places: list[int] = []
    findings: list[Finding] = []
    for name in names:
        fitting = [i for i, cell in enumerate(header) if cell == name] or [
            i for i, cell in enumerate(plain) if cell == name
        ]
        if len(fitting) != 1:
            what = f"{'has no column' if not fitting else f'has {len(fitting)} columns'} '{name[:60]}'"
            remedy = nearest(name, plain) if not fitting else "give each column a name of its own"
            findings.append(Finding(what, remedy=remedy, line=line))
        places += fitting[:1]
    findings += [
        Finding(f"has {len(cells)} cells, the header has {len(header)}", remedy=_OTHER_COLUMNS[2], line=number)
        for number, cells in rows[1:] if len(cells) > len(header)
    ]  # fmt: skip
    if findings:
        raise MechanismError(_few(findings))
    return [(number, [cells[i] if i < len(cells) else "" for i in places]) for number, cells in rows]


def _with_units(rows: Sequence[Row]) -> list[Row]:
    """The rows without one of units below the header, whose cells then stand in the header's brackets."""
    (line, header), *others = rows
    below = others[0][1] if others else [""]
    if not all(cell in _NO_UNIT or _is_unit(cell) for cell in below) or not any(map(_is_unit, below)):
        return list(rows)
    columns = zip(header, below, strict=True)
    return [(line, [f"{cell} [{unit}]" if unit and not _IN_BRACKETS.search(cell) else cell for cell, unit in columns]),
            *others[1:]]  # fmt: skip


def _cells(line: str, separator: str) -> list[str]:
    cells = [cell.strip() for cell in next(csv.reader([line.rstrip("\n")], delimiter=separator, skipinitialspace=True))]
    while len(cells) > 1 and not cells[-1]:  # a separator at the end of a line
        cells.pop()
    return cells


def _number(cell: str, separator: str) -> str:
    """The cell as a plain number; empty if it is none."""
    text = cell.replace("−", "-").removesuffix(",")
    if separator != "," and text.count(",") == 1 and "." not in text:
        text = text.replace(",", ".")
    return text if _NUMBER.fullmatch(text) and abs(float(text)) < float("inf") else ""


def _unreadable(rows: Sequence[Row], separator: str, columns: int) -> Iterator[Finding]:
    """What is no pair of numbers, or no number in a single column."""
    for line, cells in rows:
        if len(cells) != columns:
            what = f"has {len(cells)} cell{'s' * (len(cells) > 1)}, the rows before have {columns}"
            yield Finding(what, remedy="write as many numbers", line=line)
            continue
        for cell in cells:
            if not _number(cell, separator):
                what = f"'{cell[:40]}' is not a finite number" if cell else "a number is missing"
                yield Finding(what, remedy="write a number such as 12.5 or 1.25e1, units in the header", line=line)


def _units(header: Row, kinds: Sequence[Kind]) -> list[str]:
    """The units of a header, empty where there is none; MechanismError if they are not those of the columns."""
    line, cells = header
    units, findings = [], []
    for cell, kind in zip(cells, kinds, strict=True):
        bracketed, rounded = _IN_BRACKETS.search(cell), _IN_PARENTHESES.search(cell)
        text = bracketed[1].strip() if bracketed else ""
        units.append("" if text in _NO_UNIT else text)
        remedy = f"write a unit of {kind.name} in the brackets, or none for SI"
        try:
            if rounded and not bracketed and _is_unit(rounded[1]):
                remedy = f"write [{rounded[1]}]"
                raise UnitError("a unit stands in brackets")
            if units[-1] and not kind.accepts(dimension := Quantity.read(f"1 {text}").check({})):
                what = f"its unit is that of {dimension_text(dimension or NUMBER)}, the column is of {kind.name}"
                raise UnitError(what)
        except UnitError as error:
            findings.append(Finding(f"{cell[:40]}: {error.what[:120]}", remedy=remedy, line=line))
    if findings:
        raise MechanismError(findings)
    return units


def _is_unit(text: str) -> bool:
    try:
        return text.strip() not in _NO_UNIT and bool(unit(text.strip()))
    except UnitError:
        return False
