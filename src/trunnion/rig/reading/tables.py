"""Columns of data files as numbers: CSV, Parquet and TDMS by their extension, the same numbers whichever it is.

Only the columns that are asked for are read. What is no number in them is NaN and counted, never replaced.

In CSV the separator is the first of semicolon, tab and comma that the header has; with semicolon or tab a number may
have a decimal comma. Units stand in brackets behind the name, `T1 [V]`, or in a row of their own below the names. Lines
that begin with # are passed over, and so is what a logger writes above the header. Pandas reads the rows.
"""

from __future__ import annotations

import codecs
import csv
import importlib.util
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime, time
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.files import reading
from trunnion.model.names import nearest, unguarded
from trunnion.model.units import UnitError
from trunnion.rig.reading.units import alike, dimensions

__all__ = ["FORMATS", "Column", "DataTable", "read_table", "ungrouped"]

Array = NDArray[np.float64]
SHOWN = 40  # columns named in a message
MOST = 100_000_000  # numbers of a binary file in memory, 0.8 GB: a small file may unfold to any size


@dataclass(frozen=True)
class Column:
    """Numbers of one column. unit: as the file states it; texts: cells that are text, with the first of them.

    stamp: the first time of day or time stamp of a column of such; its values are seconds since then.
    """

    values: Array
    unit: str = ""
    texts: int = 0
    example: str = ""
    stamp: str = ""

    def factor(self, where: str, name: str, stated: str | None, si: str, say: Callable[[Finding], None]) -> float:
        """What a 1 in the column is, SI: in the unit that is stated, else in the file's, else it is SI.

        where: the entry that names the column, `time` or `angle`; say: takes a note that there is no unit.
        """
        unit = stated or self.unit
        if not unit:
            what = f"the column '{name}' has no unit; {si} is assumed"
            say(Finding(what, where, f"state {where}.unit", Severity.NOTE, code=f"data.{where}.no_unit"))
        try:
            factor, kind = dimensions(unit or si)
        except UnitError as error:
            remedy = f"state {where}.unit in the mapping; in the file, {error.remedy}"
            raise MechanismError(Finding(f"the column '{name}': {error.what}", where, remedy)) from None
        if not alike(kind, dimensions(si)[1]):
            what = f"the column '{name}' has the unit '{unit}', which is no {where}"
            raise MechanismError(Finding(what, where, "name another column"))
        return factor


@dataclass(frozen=True)
class DataTable:
    """The columns of a file that were asked for, all of one length.

    interval: (start, step) of evenly spaced samples in s, if the file itself states it; encoding: of a text file.
    """

    file: str
    columns: Mapping[str, Column]
    interval: tuple[float, float] | None = None
    encoding: str = "utf-8"

    @property
    def rows(self) -> int:
        """How many rows there are."""
        return next((column.values.size for column in self.columns.values()), 0)


def read_table(path: Path, names: Iterable[str], optional: Iterable[str] = ()) -> DataTable:
    """Read columns of a data file.

    Parameters
    ----------
    path : of a CSV, Parquet or TDMS file, told by its extension.
    names : of the columns.
    optional : columns that may be missing.

    Raises
    ------
    MechanismError
        Where the file cannot be read; where a column is missing, its figures name it.
    """
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        raise _failed(path, f"the extension '{suffix}' is not one of a data file", f"use {', '.join(FORMATS)}")
    reader, package, extra = FORMATS[suffix]
    if package and importlib.util.find_spec(package) is None:
        raise _failed(path, f"{suffix} needs {package}", f"pip install 'trunnion[{extra}]'")
    if not path.is_file():
        what = "is not a file" if path.exists() else "cannot be read: there is no such file"
        raise _failed(path, what, "check the path")
    if path.stat().st_size == 0:
        raise _failed(path, "is empty", "check that the recording was saved")
    reading(path)
    try:
        table = reader(path, list(dict.fromkeys(names)), list(dict.fromkeys(optional)))
    except OSError as error:
        raise _failed(path, f"cannot be read: {error.strerror or error}", "check the file") from None
    if table.rows == 0:
        raise _failed(path, "has a header but no rows of numbers", "check that the recording was saved")
    return table


def _failed(path: Path, what: str, remedy: str, line: int | None = None) -> MechanismError:
    return MechanismError(Finding(what, file=str(path), line=line, remedy=remedy))


def _places(path: Path, present: Sequence[str], names: Sequence[str], optional: Sequence[str]) -> dict[str, int]:
    """Place of each column among those that are present; one finding for all that are missing."""
    missing = [name for name in names if name not in present]
    if missing:
        listed = ", ".join(f"'{name}'" for name in present[:SHOWN]) + (", …" if len(present) > SHOWN else "")
        what = f"there is no column {', '.join(map(repr, missing))}; the file has {listed or 'none'}"
        near = nearest(missing[0], present)
        like = near.startswith("did you mean") and len(missing[0]) > 3  # T1 is not meant where T2 is written
        remedy = near if like else "name one of these in the mapping"
        raise MechanismError(Finding(what, file=str(path), remedy=remedy, figures={"missing": missing}))
    wanted = [name for name in (*names, *optional) if name in present]
    doubled = [name for name in wanted if present.count(name) > 1]
    if doubled:
        raise _failed(path, f"the column '{doubled[0]}' stands there {present.count(doubled[0])} times", "rename one")
    return {name: present.index(name) for name in wanted}


# ---- cells ----------------------------------------------------------------------------------------------------

NOTHING = frozenset({"", "nan", "n/a", "na", "#n/a", "null", "none", "-nan", "inf", "-inf", "+inf", "infinity"})
GROUPED = {  # thousands with a sign between them; of a point or a comma only where decimals tell which of them it is
    ",": re.compile(r"[-+]?\d{1,3}(?:(?:\.\d{3})+,\d+|(?:['’\u00a0\u202f ]\d{3})+(?:,\d+)?)"),
    ".": re.compile(r"[-+]?\d{1,3}(?:(?:,\d{3})+\.\d+|(?:['’\u00a0\u202f ]\d{3})+(?:\.\d+)?)"),
}
_BETWEEN = re.compile(r"[.,'’\u00a0\u202f ](?=\d{3}(?:\D|$))")


def _number(text: object) -> float:
    """The number of a cell; NaN if it is none."""
    try:
        return float(text)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return np.nan


def ungrouped(text: str, decimal: str) -> str:
    """A number without signs between thousands and with a decimal point: 1450.33 of `1.450,33`."""
    if GROUPED[decimal].fullmatch(text):
        integer, sign, fraction = text.partition(decimal)
        text = _BETWEEN.sub("", integer) + sign + fraction
    return text if decimal == "." else text.replace(decimal, ".")


def _column(cells: Any, unit: str = "", decimal: str = ".") -> Column:
    """Cells of any kind as floats, infinite ones as they are; time stamps as seconds since the first."""
    cells = np.asarray(cells)
    if cells.dtype.kind in "fiub":
        return Column(np.asarray(cells, dtype=np.float64), unit)
    if cells.dtype.kind in "mM":
        known = ~np.isnat(cells)
        if cells.dtype.kind == "M":
            cells = cells.astype("datetime64[ns]")
            cells = cells - (cells[known][0] if known.any() else np.datetime64(0, "ns"))
        seconds = cells.astype("timedelta64[ns]").astype(np.int64) * 1e-9
        return Column(np.where(known, seconds, np.nan), unit)
    texts, example = 0, ""
    values = np.empty(cells.size)
    for place, cell in enumerate(rows := [str(cell) if isinstance(cell, time) else cell for cell in cells.tolist()]):
        text = ungrouped(cell.strip().replace("−", "-"), decimal) if isinstance(cell, str) else cell
        values[place] = _number(text)
        if np.isnan(values[place]) and isinstance(text, str) and text.casefold() not in NOTHING:
            texts, example = texts + 1, example or str(cell).strip()[:40]
    if texts and _TIME.fullmatch(example) and not np.isfinite(values).any():
        return Column(_seconds(rows), unit, texts, example, example)
    return Column(values, unit, texts, example)


_TIME = re.compile(
    r"(?:(?P<date>\d{1,4}[-./]\d{1,2}[-./]\d{1,4})[ T]\s*)?"
    r"(?P<hour>\d{1,2}):(?P<minute>[0-5]\d):(?P<second>[0-5]\d)(?:[.,](?P<part>\d{1,12}))?"
    r"(?:\s?(?P<noon>[AaPp])[Mm])?(?:\s?(?:Z|(?P<zone>[-+]\d\d):?(?P<off>\d\d)))?",
    re.ASCII,
)
DAY = 86_400 * 10**9


def _seconds(cells: Sequence[Any]) -> Array:
    """Seconds since the first of times of day and time stamps, NaN where there is none.

    In whole nanoseconds: seconds since a year as floats would be off by more than a sample. Without a date a step back
    by more than half a day is midnight. ValueError, in words, where the dates do not show their order.
    """
    found = [_TIME.fullmatch(cell.strip()) if isinstance(cell, str) else None for cell in cells]
    stamps = {place: stamp for place, stamp in enumerate(found) if stamp is not None and int(stamp["hour"]) < 24}
    days = _day_numbers(list(dict.fromkeys(stamp["date"] or "" for stamp in stamps.values())))
    when = np.empty(len(stamps), np.int64)
    for k, stamp in enumerate(stamps.values()):
        hour, minute = int(stamp["hour"]), int(stamp["minute"])
        if stamp["noon"]:
            hour = hour % 12 + 12 * (stamp["noon"] in "Pp")
        if stamp["zone"]:
            hour, minute = hour - int(stamp["zone"]), minute - int(stamp["zone"][0] + stamp["off"])
        part = int((stamp["part"] or "").ljust(9, "0")[:9])
        when[k] = days[stamp["date"] or ""] * DAY + (3600 * hour + 60 * minute + int(stamp["second"])) * 10**9 + part
    if list(days) == [""]:
        when += DAY * np.concatenate([[0], np.cumsum(np.diff(when) < -DAY // 2)])
    values = np.full(len(cells), np.nan)
    values[list(stamps)] = (when - when[:1]) * 1e-9
    return values


def _day_numbers(dates: Sequence[str]) -> dict[str, int]:
    """Number of the day of every date; 0 where there is none. ValueError if they may be read in two ways."""
    if dates == [""]:
        return {"": 0}
    sign = next((one for one in "./-" if one in dates[0]), "-")
    read: list[list[int]] = []
    for order in ("%Y-%m-%d", "%d-%m-%Y", "%m-%d-%Y", "%d-%m-%y", "%m-%d-%y"):
        with suppress(ValueError):
            read.append([datetime.strptime(one, order.replace("-", sign)).toordinal() for one in dates])
    if not read:
        raise ValueError(f"the dates, such as {dates[0] or dates[-1]}, are not all dates of one form")
    if sign != "." and len({tuple(np.subtract(days, days[0])) for days in read}) > 1:
        raise ValueError(f"the dates, such as {dates[0]}, may begin with the day or with the month")
    return {date: day - read[0][0] for date, day in zip(dates, read[0], strict=True)}


# ---- text -----------------------------------------------------------------------------------------------------

HEAD = 1 << 16  # bytes in which the header and the first rows are looked for, and more where the lines are long
LINES = 20  # that are read at least
LONGEST = 1 << 24  # bytes in which the first lines have to end
FIRST = 200  # lines in which the header may stand, and rows that show how numbers are written
WIDE = 40  # columns from which those that are not asked for are passed over, and too many cells in a row not seen
MOST_ABOVE = 3  # rows of units and remarks between names and numbers
GERMAN = ("Grad", "U/min", "Umin", "Umdr./min")  # units in headings, if not all are read without the mapping's word
_NO_UNIT = ("", "-", "–", "1")
_UNIT = re.compile(r"^(.*?)\s*\[([^\[\]]*)\]\s*$", re.DOTALL)
_BEHIND = re.compile(r"^(.*?\S)\s*(?:\(([^()]+)\)|(?:\s/|\sin)\s+(\S.*))$", re.DOTALL)  # T (V), T / V, T in V
_COMMA = re.compile(r"[-+]?(?:\d{1,3}(?:\.\d{3})+|\d{1,3}(?:['’\u00a0\u202f ]\d{3})+|\d*),\d+(?:[eE][-+]?\d+)?")
_POINT = re.compile(r"[-+]?\d*\.\d+(?:[eE][-+]?\d+)?")


@dataclass(frozen=True)
class _Layout:
    """How a text file is written. skip: lines before the first row; width: cells of a row."""

    names: list[str]
    units: list[str]
    separator: str
    decimal: str
    encoding: str
    skip: int
    width: int


def _read_text(path: Path, names: Sequence[str], optional: Sequence[str]) -> DataTable:
    """The columns of a text file."""
    import pandas as pd

    layout = _layout(path, {*names, *optional})
    places = _places(path, layout.names, names, optional)
    version = tuple(int(part) for part in re.findall(r"\d+", pd.__version__)[:2])
    exact: dict[str, Any] = {} if version >= (3, 1) else {"float_precision": "round_trip"}
    try:
        frame = pd.read_csv(
            path, sep=layout.separator, decimal=layout.decimal, header=None, names=list(range(layout.width)),
            usecols=sorted(set(places.values())) if layout.width > WIDE else None, skiprows=layout.skip, comment="#",
            encoding=layout.encoding, encoding_errors="replace", low_memory=False, skipinitialspace=True, **exact,
        )  # fmt: skip
    except pd.errors.EmptyDataError:
        frame = pd.DataFrame(columns=list(range(layout.width)), dtype=float)
    except pd.errors.ParserError as error:
        row = re.search(r"Expected (\d+) fields in line (\d+), saw (\d+)", str(error))
        what = f"has {row[3]} cells, the header has {row[1]}" if row else f"is not CSV: {str(error).strip()[-120:]}"
        raise _failed(path, what, "correct that line", int(row[2]) if row else None) from None
    columns = {}
    for name, place in places.items():
        cells = frame[place].to_numpy()
        if layout.decimal == "," and cells.dtype.kind not in "fiub":
            points = (cell for cell in cells.tolist() if isinstance(cell, str) and _POINT.fullmatch(cell.strip()))
            if (point := next(points, None)) is not None:  # of thousands or of decimals
                told = f"'{point.strip()[:20]}' in '{name}' beside decimal commas"
                what = f"decimal and thousands signs are mixed: {told}"
                remedy = "export it without a sign between thousands, and with one sign for decimals"
                raise _failed(path, what, remedy)
        columns[name] = _with_times(path, name, cells, layout.units[place], layout.decimal)
    return DataTable(str(path), columns, encoding=layout.encoding)


def _with_times(path: Path, name: str, cells: Any, unit: str, decimal: str = ".") -> Column:
    """A column; MechanismError where its dates may be read in two ways."""
    try:
        return _column(cells, unit, decimal)
    except ValueError as error:
        remedy = "write them as 2026-11-22 11:40:00.0002, or state time: {rate: …}"
        raise _failed(path, f"{name}: {error}", remedy) from None


def _first_lines(path: Path) -> tuple[list[str], str]:
    """The first lines and their encoding."""
    with path.open("rb") as file:
        raw = file.read(HEAD)
        while max(raw.count(b"\n"), raw.count(b"\r")) < LINES and len(raw) < LONGEST and (more := file.read(len(raw))):
            raw += more
        if not (b"\n" in raw or b"\r" in raw) and file.read(1):
            what = f"has no end of a line in its first {LONGEST >> 20} MiB"
            raise _failed(path, what, "check that it is CSV, with a row of the table in each line", 1)
    encodings = ["utf-16"] if raw.startswith((b"\xff\xfe", b"\xfe\xff")) else ["utf-8-sig", "cp1252", "latin-1"]
    if b"\0" in raw and encodings[0] != "utf-16":
        raise _failed(path, "is not a text file", "check that it is CSV; use .tdms or .parquet for binary files")
    for encoding in encodings:
        with suppress(UnicodeDecodeError):
            text = codecs.getincrementaldecoder(encoding)().decode(raw)  # the last sign may be cut in two
            return text.replace("\r\n", "\n").replace("\r", "\n").split("\n"), encoding
    raise _failed(path, "is not a text file", "save it as UTF-8")


def _layout(path: Path, wanted: set[str]) -> _Layout:
    """Names, units and signs of a file from its first lines."""
    lines, encoding = _first_lines(path)
    stated = [(place, line) for place, line in enumerate(lines) if line.strip() and not line.lstrip().startswith("#")]
    if not stated:
        raise _failed(path, "has only comments", "check that the recording was saved", 1)

    def split(line: str) -> tuple[str, list[str]]:
        bare = re.sub(r'"[^"]*"', "", line)
        separator = next((sign for sign in ";\t" if sign in bare), ",")
        return separator, _cells(line, separator)

    def hits(place: int) -> int:
        return len({_named(cell, wanted)[0] for cell in split(stated[place][1])[1]} & wanted)

    header = max(range(min(len(stated), FIRST)), key=hits)  # loggers write some lines above the header
    separator, cells = split(stated[header][1])
    named = [_named(cell, wanted) for cell in cells]
    if hits(header) == 0 and sum(bool(name) for name, _ in named) < len(wanted):
        first = " / ".join(line.strip()[:60] for _, line in stated[:3])
        what = f"no line has the columns {', '.join(map(repr, sorted(wanted)))}; the first lines are: {first}"
        raise _failed(path, what, "write the names of the columns above the numbers, or name another file", 1)
    if all(not np.isnan(_number(ungrouped(name, ","))) for name, _ in named if name):
        remedy = "write the names of the columns in the first line, such as t [s],T1 [V]"
        what = f"has no header: its first line is {', '.join(cells[:4])}"
        raise _failed(path, what, remedy, stated[header][0] + 1)
    rows = [(place, _cells(line, separator)) for place, line in stated[header + 1 :][:FIRST]]
    above = [
        ["" if cell.strip("[]() ") in _NO_UNIT else cell.strip("[]() ") for cell in row]
        for row in takewhile(_words, [row for _, row in rows[:MOST_ABOVE]])
    ]
    of_row = next((row for row in above if any(map(_is_unit, row))), above[0] if above else [])
    units = [unit or (of_row[k] if k < len(of_row) else "") for k, (_, unit) in enumerate(named)]
    rows, skip = rows[len(above) :], stated[header + len(above)][0] + 1
    sample = [cell for _, row in rows for (name, _), cell in zip(named, row, strict=False) if name in wanted]
    comma = separator != "," and any(_COMMA.fullmatch(cell) for cell in sample)
    for place, row in rows:
        if any(row[len(cells) :]):
            remedy = "correct that line; numbers with a decimal comma need a semicolon or tab between them"
            raise _failed(path, f"has {len(row)} cells, the header has {len(cells)}", remedy, place + 1)
    width = max([len(cells), *(len(row) for _, row in rows)])  # separators at the end of lines
    return _Layout([name for name, _ in named], units, separator, "," if comma else ".", encoding, skip, width)


def _cells(line: str, separator: str) -> list[str]:
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]
    except (csv.Error, StopIteration):
        return [line]


def _named(cell: str, wanted: set[str]) -> tuple[str, str]:
    """Name and unit of a header's cell: `T [V]`, and where it is a unit `T / V`, `T in V` or `T (V)`.

    A name that is wanted with its unit in it stays whole.
    """
    cell = unguarded(cell.strip().strip('"').strip())
    if found := _UNIT.match(cell):
        unit = "" if found[2].strip() in _NO_UNIT else found[2].strip()
        return (cell if cell in wanted else found[1]), unit
    found = _BEHIND.match(cell)
    unit = (found[2] or found[3]).strip() if found else ""
    if not found or not (_is_unit(unit) or unit in GERMAN):
        return cell, ""
    return (cell if cell in wanted else found[1]), unit


def _words(cells: Sequence[str]) -> bool:
    """Whether there is no number and no time in a row, and at least one word."""
    if any(not np.isnan(_number(cell.replace(",", "."))) or _TIME.fullmatch(cell) for cell in cells if cell != "1"):
        return False
    return any(re.search(r"[^\W\d_]|[°%‰]", cell) and cell.casefold() not in NOTHING for cell in cells)


def _is_unit(text: str) -> bool:
    try:
        return bool(text) and bool(dimensions(text))
    except UnitError:
        return False


# ---- Parquet and TDMS -----------------------------------------------------------------------------------------


def _check_size(path: Path, rows: int, columns: int) -> None:
    """MechanismError for a file that unfolds to more than memory is to be asked for, before it is read."""
    if rows * columns > MOST:
        what = f"{rows:,} rows of {columns} columns unfold to {8e-9 * rows * columns:.3g} GB"
        most = f"at most {MOST / 1e6:,.0f} million numbers ({8e-9 * MOST:.2g} GB) are read"
        raise _failed(path, f"{what}; {most}", "split it by time or working condition, or sample more slowly")


def _read_parquet(path: Path, names: Sequence[str], optional: Sequence[str]) -> DataTable:
    """The columns of a Parquet file; a unit is the entry `unit` or `units` of the column's metadata."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        schema = pq.read_schema(path)
        places = _places(path, list(schema.names), names, optional)
        nested = [name for name in places if pa.types.is_nested(schema.field(name).type)]
        if nested:
            what = f"the column '{nested[0]}' has {schema.field(nested[0]).type} in each cell, not a number"
            raise _failed(path, what[:200], "write one column for each number")
        _check_size(path, pq.read_metadata(path).num_rows, len(places))
        words = [name for name in places if not pa.types.is_primitive(schema.field(name).type)]
        columns = {}
        for name in places:  # one after the other: memory is that of the numbers; a text that repeats is held once
            with pq.ParquetFile(path, read_dictionary=words) as file:
                cells = file.read(columns=[name]).column(name).unify_dictionaries().combine_chunks()
            if pa.types.is_dictionary(cells.type):
                texts = np.array([*cells.dictionary.to_pylist(), None], dtype=object)
                cells = texts[cells.indices.fill_null(len(texts) - 1).to_numpy()]
            else:
                cells = cells.to_pandas()
            meta = schema.field(name).metadata or {}
            unit = (meta.get(b"unit") or meta.get(b"units") or b"").decode("utf-8", "replace")
            columns[name] = _with_times(path, name, cells, unit)
    except pa.ArrowException as error:
        raise _failed(path, f"is not Parquet: {str(error).splitlines()[0][:120]}", "check the file") from None
    return DataTable(str(path), columns)


def _read_tdms(path: Path, names: Sequence[str], optional: Sequence[str]) -> DataTable:
    """Channels of a TDMS file, by `group/channel` or by the channel's name where only one group has it.

    Unit: the property unit_string; sampling: wf_start_offset and wf_increment of waveforms.
    """
    from nptdms import TdmsFile

    try:
        with path.open("rb") as stream, TdmsFile.open(stream) as file:
            return _channels(path, file, names, optional)
    except (MechanismError, OSError):
        raise
    except Exception as error:  # nptdms raises what its parsing of a broken file meets: struct, Value-, Key-, EOFError
        raise _failed(path, f"is not TDMS: {str(error)[:120] or type(error).__name__}", "check the file") from None


def _channels(path: Path, file: Any, names: Sequence[str], optional: Sequence[str]) -> DataTable:
    full = {f"{group.name}/{channel.name}": channel for group in file.groups() for channel in group.channels()}
    short = [channel.name for channel in full.values()]
    present = [channel.name if short.count(channel.name) == 1 else name for name, channel in full.items()]
    channels = dict(zip(present, full.values(), strict=True))
    alias = dict(zip(full, present, strict=True))
    asked = {name: alias.get(name, name) for name in (*names, *optional)}
    _places(path, present, [asked[name] for name in names], [asked[name] for name in optional])
    asked = {name: own for name, own in asked.items() if own in channels}
    lengths = {name: len(channels[own]) for name, own in asked.items()}
    if len(set(lengths.values())) > 1:
        told = ", ".join(f"'{name}' {size:,}" for name, size in lengths.items())
        raise _failed(path, f"its channels have different numbers of samples: {told}", "record them at one rate")
    _check_size(path, max(lengths.values(), default=0), len(asked))
    columns, intervals = {}, set()
    for name, own in asked.items():
        properties = channels[own].properties
        columns[name] = _with_times(path, name, channels[own][:], str(properties.get("unit_string", "") or ""))
        step = properties.get("wf_increment")
        if isinstance(step, (int, float)) and step > 0:
            intervals.add((float(properties.get("wf_start_offset", 0.0)), float(step)))
    if len({round(step, 15) for _, step in intervals}) > 1:
        told = " and ".join(f"{1 / step:g} Hz" for _, step in sorted(intervals))
        raise _failed(path, f"its channels are sampled at {told}", "record them at one rate")
    return DataTable(str(path), columns, next(iter(sorted(intervals)), None))


Reader = Callable[[Path, Sequence[str], Sequence[str]], DataTable]

# extension: reader, the package it needs and the extra that brings it
FORMATS: dict[str, tuple[Reader, str, str]] = {
    ".csv": (_read_text, "", ""),
    ".txt": (_read_text, "", ""),
    ".tsv": (_read_text, "", ""),
    ".parquet": (_read_parquet, "pyarrow", "parquet"),
    ".tdms": (_read_tdms, "nptdms", "tdms"),
}
