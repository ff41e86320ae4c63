"""Points of drivers and tables from CSV files, and other files of strangers: text of bounded size.

A model may name a file in its own folder only, whatever links say, see `in_folder`.

Two columns, first time or drive coordinate, then value. With semicolon or tab between them a number may have a decimal
comma. A first row of texts is a header with units; numbers without a unit are SI. Of a file with more columns a model
names two by their headers, see `_named_columns`.

The separator of any CSV file is the first of semicolon, tab and comma that a header has. A unit stands in brackets
behind the name, `T1 [V]`; one that is in use also as `T1 (V)`, `T1 / V` and `T1 in V`; or in a row of its own below the
names. Lines that begin with # are passed over.
"""

from __future__ import annotations

import csv
import io
import os
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path, PureWindowsPath
from typing import Any, NamedTuple

from trunnion.errors import Finding, MechanismError, counted
from trunnion.files import reading
from trunnion.joints.pairs import PAIRS
from trunnion.model.expression import literal
from trunnion.model.names import nearest, unguarded
from trunnion.model.units import ANY, KINDS, NUMBER, Kind, UnitError, dimension_text, unit

TableFiles = Mapping[str, str | os.PathLike[str]]  # file by name of a driver or table

MAX_BYTES = 1_000_000  # of a file, and of all that a model names
MAX_ROWS = 10_000  # points of a spline; an analysis of 360 positions then takes seconds
MAX_OWN_ROWS = 20_000  # of all files that a model names: reading them takes some seconds
MOST_FILES = 50
SHOWN = 8  # findings about one file
OF_A_FILE = ("file", "columns")  # the keys of a table or driver whose points are in a file
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?", re.ASCII)

Row = tuple[int, list[str]]  # line and cells


class TablePoints(NamedTuple):
    """Points from a file: where they belong in the model, and the line of each."""

    where: str
    file: str
    rows: list[list[float | str]]
    lines: list[int]


def with_points(
    data: Mapping[str, Any], files: TableFiles | None = None, model: Path | None = None
) -> tuple[dict[str, Any], list[TablePoints]]:
    """Plain data of a model with the points of drivers and tables replaced by those of files.

    files: by name of a driver or table; a driver of another motion law becomes one of law `table`. model: instead of
    these, the file of the data, whose drivers and tables name files in its folder. MechanismError with every finding:
    about a name where it stands in the model, about the content with file and line.
    """
    named_files = {f"{section}.{key}": file for section, key, file in stated_files(data)} if model else {}
    changed, read, findings = dict(data), list[TablePoints](), list[Finding]()
    for name, file in (files or named_files).items():
        try:
            section, key = _holder(data, name)
            entry, where = changed[section][key], f"{section}.{key}"
            path, columns = Path(file), None
            if model:
                path, columns = in_folder(model.resolve().parent, str(file), f"{where}.file"), entry.get("columns")
                size = path.stat().st_size + sum(Path(points.file).stat().st_size for points in read)
                rows = sum(len(points.rows) for points in read)
                if len(named_files) > MOST_FILES or size > MAX_BYTES or rows > MAX_OWN_ROWS:
                    what = f"the files that the model names are too many or too long: more than {MOST_FILES} files, "
                    what += f"over {MAX_BYTES / 1e6:g} MB or {MAX_OWN_ROWS} rows"
                    findings.append(Finding(what, f"{where}.file", "use fewer points: values between are interpolated"))
                    break
            label = str(model.parent / file if model else file)
            points = _points(path, f"{where}.points", _kinds(data, section, key), label, columns)
        except MechanismError as error:
            findings += error.findings
            continue
        read.append(points)
        rest = {k: value for k, value in entry.items() if k not in OF_A_FILE} if isinstance(entry, Mapping) else {}
        if section == "drivers" and rest.get("law") != "table":
            rest = {"law": "table"}
        changed[section] = {**changed[section], key: {**rest, "points": points.rows}}
    if findings:
        raise MechanismError(findings)
    return changed, read


def place_findings(findings: Sequence[Finding], read: Sequence[TablePoints]) -> list[Finding]:
    """The findings, those about points with the file and line that these came from and a few for each file."""
    placed = list(findings)
    for points in read:
        of_points = [finding for finding in placed if f"{finding.where}.".startswith(f"{points.where}.")]
        placed = [finding for finding in placed if finding not in of_points]
        for finding in of_points[:SHOWN]:
            index = finding.where[len(points.where) + 1 :].partition(".")[0]
            placed.append(finding.at(points.file, points.lines[int(index) if index.isdecimal() else 0]))
    return placed


def _holder(data: Mapping[str, Any], name: str) -> tuple[str, str]:
    """Section and name of the driver or table that a name means; `drivers.A` and `tables.A` tell two apart."""
    parts = {section: part for section in ("drivers", "tables") if isinstance(part := data.get(section), Mapping)}
    holders = [(section, key) for section in parts for key in parts[section] if name in (key, f"{section}.{key}")]
    if len(holders) == 1:
        return holders[0]
    if holders:
        what, remedy = f"'{name}' is a driver and a table", f"say drivers.{name} or tables.{name}"
    else:
        what, remedy = f"there is no driver or table '{name}'", nearest(name, [*chain.from_iterable(parts.values())])
    raise MechanismError(Finding(what, remedy=remedy))


def _kinds(data: Mapping[str, Any], section: str, key: str) -> tuple[Kind, Kind]:
    """What the two columns measure; a model that does not tell is refused elsewhere."""
    entry, drivers, joints = data[section][key], data.get("drivers"), data.get("joints")
    in_time = section == "drivers" or (isinstance(entry, Mapping) and entry.get("over") == "time")
    joint = key if section == "drivers" else next(iter(drivers), "") if isinstance(drivers, Mapping) else ""
    stated = joints.get(joint) if isinstance(joints, Mapping) else None
    pair = PAIRS.get(str(stated.get("type"))) if isinstance(stated, Mapping) else None
    coordinate = KINDS["angle"] | KINDS["length"] if pair is None else KINDS["angle" if pair.turns else "length"]
    return KINDS["time"] if in_time else coordinate, coordinate if section == "drivers" else ANY


# ---- the file -------------------------------------------------------------------------------------------------


def _points(
    path: Path, where: str, kinds: tuple[Kind, Kind], label: str, names: Sequence[str] | None = None
) -> TablePoints:
    """The points of a file; MechanismError with file and line of every finding, a few of each file.

    label: what the file is called in findings; names: the headers of the two columns, of a file that has more.
    """
    units, rows = _columns(path, kinds, label, names)
    if names:  # of another program, which writes numbers of SI without their unit
        plain = (KINDS["time"], KINDS["angle"], KINDS["length"])
        units = [text or kind.unit * (kind in plain) for text, kind in zip(units, kinds, strict=True)]
    points = TablePoints(where, label, [], [line for line, _ in rows])
    for _, cells in rows:
        points.rows.append([f"{cell} {unit}" if unit else float(cell) for cell, unit in zip(cells, units, strict=True)])
    return points


def column(path: Path, kind: Kind) -> list[float]:
    """The numbers of a file that has one column, SI; MechanismError with file and line of every finding.

    A header may state the unit as in a table; numbers may have a decimal comma.
    """
    units, rows = _columns(path, (kind,), str(path))
    return [literal(cells[0], units[0]).value for _, cells in rows]


# by the number of columns: what a file is, of what it has a row, an example of one, and what is of another number
_FILES = {
    1: ("sample", "a deviation in each line", "0.012", "a table of two columns is given by --table"),
    2: ("table", "a row for each point", "0; 12.5",
        "write time or drive coordinate, then value, and between them a comma, or beside decimal commas ; or a tab; of "
        "more columns name two: columns: [time, pressure]"),
}  # fmt: skip


def _columns(
    path: Path, kinds: Sequence[Kind], label: str, names: Sequence[str] | None = None
) -> tuple[list[str], list[Row]]:
    """The units of one or two columns, and their rows of plain numbers; MechanismError as `_points`."""
    noun, each, example, columns = _FILES[len(kinds)]
    try:
        text = read_text(path, f"a {noun}", MAX_BYTES, f"write {each}, such as {example}")
        lines = numbered(io.StringIO(text, newline=None))
        if not 1 <= len(lines) <= MAX_ROWS + 1:
            what = f"has {len(lines) or 'no'} rows, a {noun} from 2 to {MAX_ROWS}"
            raise MechanismError(Finding(what, remedy=f"write {each}; of too many points a random subset"))
        separator = separator_of(lines[0][1], "," if len(kinds) == 2 else ";")
        rows = [(number, _cells(line, separator)) for number, line in lines]
        heads, units = list[str](), [""] * len(rows[0][1])
        if names or not any(_number(cell, separator) for cell in rows[0][1]):
            heads, units = map(list, zip(*(heading(cell, unit, names or ()) for cell in rows[0][1]), strict=True))
        if names:
            if len(rows) > 1 and (below := units_below(units, rows[1][1])):
                units = below
                del rows[1]
            units, rows = _named_columns(rows, heads, units, names)
        if len(units) != len(kinds):
            what = f"has {counted(len(units), 'column')}, a {noun} has {len(kinds)}"
            raise MechanismError(Finding(what, remedy=columns, line=rows[0][0]))
        numbers = rows[1:] if heads else rows
        if len(numbers) < 2:
            what = f"has {len(numbers) or 'no'} row{'s' * (not numbers)} of numbers, a {noun} needs two"
            raise MechanismError(Finding(what, remedy=f"add rows such as {example}", line=rows[-1][0]))
        if findings := [*_wrong_units(rows[0], units, kinds)] or [*_unreadable(numbers, separator, len(kinds))]:
            raise MechanismError(findings[:SHOWN])
    except MechanismError as error:
        raise MechanismError([finding.at(label, finding.line) for finding in error.findings]) from None
    return units, [(line, [_number(cell, separator) for cell in cells]) for line, cells in numbers]


def _named_columns(
    rows: Sequence[Row], heads: Sequence[str], units: Sequence[str], names: Sequence[str]
) -> tuple[list[str], list[Row]]:
    """The units and cells of two columns: below the headers that are these names, which may leave out the unit.

    MechanismError if none or several have a name.
    """
    line, header = rows[0]
    places: list[int] = []
    findings = [Finding(f"has {len(cells)} cells, the header has {len(header)}", line=number)
                for number, cells in rows[1:] if len(cells) > len(header)]  # fmt: skip
    for name in names:
        fitting = [i for i, cell in enumerate(header) if cell == name]
        fitting = fitting or [i for i, head in enumerate(heads) if head == name]
        if len(fitting) != 1:
            what = f"{'has no column' if not fitting else f'has {len(fitting)} columns'} '{name[:60]}'"
            remedy = nearest(name, heads) if not fitting else "give each column a name of its own"
            findings.append(Finding(what, remedy=remedy, line=line))
        places += fitting[:1]
    if findings:
        raise MechanismError(findings[:SHOWN])
    picked = [(number, [cells[i] if i < len(cells) else "" for i in places]) for number, cells in rows]
    return [units[i] for i in places], picked


def _cells(line: str, separator: str) -> list[str]:
    cells = cells_of(line, separator)
    while len(cells) > 1 and not cells[-1]:  # a separator at the end of a line
        cells.pop()
    return cells


def _number(cell: str, separator: str) -> str:
    """The cell as a plain number; empty if it is none."""
    text = cell.replace("−", "-").removesuffix(",")
    if separator != "," and text.count(",") == 1 and "." not in text:
        text = text.replace(",", ".")
    return text if _NUMBER.fullmatch(text) and abs(float(text)) < float("inf") else ""


def _wrong_units(header: Row, units: Sequence[str], kinds: Sequence[Kind]) -> Iterator[Finding]:
    """Units of a header that are not those of the columns."""
    for cell, text, kind in zip(header[1], units, kinds, strict=True):
        try:
            dimension = unit(text)[1] if text else None
            if not kind.accepts(dimension):
                what = f"its unit is that of {dimension_text(dimension or NUMBER)}, the column is of {kind.name}"
                raise UnitError(what)
        except UnitError as error:
            remedy = f"write a unit of {kind.name} in the brackets, or none for SI"
            yield Finding(f"{cell[:40]}: {error.what[:120]}", remedy=remedy, line=header[0])


def _unreadable(rows: Sequence[Row], separator: str, columns: int) -> Iterator[Finding]:
    """Rows that are no pair of numbers, or no number in a single column."""
    for line, cells in rows:
        bad = [cell for cell in cells if not _number(cell, separator)]
        if len(cells) != columns:
            yield Finding(f"has {counted(len(cells), 'cell')}, the rows before have {columns}", line=line)
        elif bad:
            what = f"'{bad[0][:40]}' is not a finite number" if bad[0] else "a number is missing"
            yield Finding(what, remedy="write a number such as 12.5 or 1.25e1, units in the header", line=line)


def read_text(path: Path, kind: str, limit: int, start_from: str) -> str:
    """The content of a file, at most `limit` bytes; MechanismError says what it is not.

    kind: what it should be, with its article; start_from: remedy for an empty one.
    """
    reading(path)
    line: int | None = None
    try:
        if path.exists() and not path.is_file():
            raise OSError("it is not a file")
        with path.open("rb") as stream:
            raw = stream.read(limit + 1)
        text = raw.decode("utf-8-sig") if len(raw) <= limit else ""
    except UnicodeDecodeError as error:
        what, remedy = f"is not UTF-8 text (byte {error.start})", "save it as UTF-8"
        line = raw.count(b"\n", 0, error.start) + 1
    except (OSError, ValueError) as error:
        what, remedy = f"cannot be read: {getattr(error, 'strerror', None) or error}", "check the path"
    else:
        if text.strip():
            return text
        what, remedy, line = "is empty", start_from, 1
        if len(raw) > limit:
            what = f"has {max(path.stat().st_size, len(raw)) / 1e6:.1f} MB, {kind} at most {limit / 1e6:.1f} MB"
            remedy, line = f"check that it is {kind}, or make it smaller", None
    raise MechanismError(Finding(what, remedy=remedy, line=line))


MOST_SIGNS = 200  # of a name
_DEVICES = {"CON", "PRN", "AUX", "NUL", *(f"{port}{n}" for port in ("COM", "LPT") for n in range(10))}  # of Windows


def stated_files(data: Mapping[str, Any]) -> Iterator[tuple[str, str, str]]:
    """Section, name and file of every table, and driver of law `table`, that names a file.

    Those stated wrongly are left to the sections' classes.
    """
    for section in ("drivers", "tables"):
        entries = data.get(section)
        for name, entry in entries.items() if isinstance(entries, Mapping) else ():
            if not isinstance(entry, Mapping) or not isinstance(entry.get("file"), str) or "points" in entry:
                continue
            columns = entry.get("columns", ["", ""])
            texts = isinstance(columns, list) and list(map(type, columns)) == [str, str]
            if texts and (section == "tables" or entry.get("law") == "table"):
                yield section, str(name), entry["file"]


def in_folder(folder: Path, name: str, where: str) -> Path:
    """The plain file of a name that a model states; MechanismError for any that is not below the model's folder.

    where: the entry that states it.
    """
    parts = PureWindowsPath(name)  # knows both kinds of slash, and drives
    odd = len(name) > MOST_SIGNS or not name.strip() or not name.isprintable() or "\\" in name
    device = any(part.split(".")[0].strip().upper() in _DEVICES for part in parts.parts)
    remedy = "put the file into the folder of the model and give its name, such as gas.csv"
    what = ""
    if parts.drive or parts.root or ".." in parts.parts:
        what = "leads out of the folder of the model"
    elif odd or device or parts.suffix.lower() != ".csv":
        what = "is no name of a CSV file that every system reads, with / between folders"
    else:
        try:
            home = folder.resolve()
            path = (home / name).resolve()
            if not path.is_relative_to(home):
                what = "leads out of the folder of the model by a link"
            elif path.is_file():
                return path
            else:
                what = "is no file in the folder of the model"
        except (OSError, RuntimeError, ValueError) as error:  # a link to itself, a folder that may not be entered
            what = f"cannot be reached: {getattr(error, 'strerror', None) or error}"
    raise MechanismError(Finding(f"'{name[:60]}' {what}", where, remedy))


# ---- the lines of any CSV file: which count, what separates their cells, headings with units --------------------

NOTHING = frozenset({"", "nan", "n/a", "na", "#n/a", "null", "none", "-nan", "inf", "-inf", "+inf", "infinity"})
TIME = re.compile(r"(?:\d{1,4}[-./]\d{1,2}[-./]\d{1,4}[ T]\s*)?\d{1,2}:[0-5]\d:[0-5]\d.*", re.ASCII)
_NO_UNIT = ("", "-", "–", "1")
_HEADING = re.compile(
    r"(?P<name>.*?)\s*\[(?P<sure>[^\[\]]*)\]|(?P<before>.*?\S)\s*(?:\((?P<round>[^()]+)\)|(?:\s/|\sin)\s+(?P<last>\S.*))",
    re.DOTALL,
)


def numbered(lines: Iterable[str]) -> list[tuple[int, str]]:
    """The lines that are neither empty nor comments, by their numbers from 1."""
    return [(number, line.rstrip("\n")) for number, line in enumerate(lines, start=1)
            if line.strip() and not line.lstrip().startswith("#")]  # fmt: skip


def separator_of(line: str, usual: str = ",") -> str:
    """What separates the cells of a line; usual: where it has neither semicolon nor tab."""
    outside = re.sub(r'"[^"]*"', "", line)
    return next((sign for sign in ";\t" if sign in outside), usual)


def cells_of(line: str, separator: str) -> list[str]:
    """The cells of a line, without blanks about them."""
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]
    except (csv.Error, StopIteration):
        return [line]


def number(text: object) -> float:
    """The number of a cell; NaN if it is none."""
    try:
        return float(text)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return float("nan")


def bare(cell: str) -> str:
    """A unit without brackets; empty where it says that there is none."""
    text = cell.strip("[]() ")
    return "" if text in _NO_UNIT else text


def heading(cell: str, unit_of: Callable[[str], object], names: Collection[str] = ()) -> tuple[str, str]:
    """Name and unit of a header's cell. One of the names with a unit in it stays whole.

    unit_of: raises UnitError of what is no unit that is in use.
    """
    cell = unguarded(cell.strip().strip('"').strip())
    match = _HEADING.fullmatch(cell)
    if match is None:
        return cell, ""
    unit = match["sure"] if match["sure"] is not None else match["round"] or match["last"]
    if match["sure"] is None:
        try:
            unit_of(unit.strip())
        except UnitError:
            return cell, ""
    return cell if cell in names else match["name"] or match["before"] or "", bare(unit)


def units_below(units: Sequence[str], cells: Sequence[str]) -> list[str] | None:
    """The units of headings, of those without one from the row below; None if that is no row of units.

    It is one if it has no number and no time, and at least one unit or more words than one.
    """
    texts = [text for cell in cells if (text := cell.strip("[]() ")) and text != "1"]
    if any((value := number(text.replace(",", "."))) == value or TIME.fullmatch(text) for text in texts):
        return None
    if not any(re.search(r"[^\W\d_]|[°%‰]", text) and text.casefold() not in NOTHING for text in texts):
        return None
    return [unit or text for unit, text in zip(units, [*map(bare, cells), *[""] * len(units)], strict=False)]
