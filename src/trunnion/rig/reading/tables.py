"""Columns of data files as numbers: CSV, Parquet and TDMS by their extension, the same numbers whichever it is.

Only the columns that are asked for are read. What is no number in them is NaN and counted, never replaced.

In CSV the separator is the first of semicolon, tab and comma that the header has; with semicolon or tab a number may
have a decimal comma. Units stand in brackets behind the name, `T1 [V]`, or in a row of their own below the names. Lines
that begin with # are passed over, and so is what a logger writes above the header. Pandas reads the rows.
"""

from __future__ import annotations

import csv
import importlib.util
import re
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
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


@dataclass(frozen=True)
class Column:
    """Numbers of one column. unit: as the file states it; texts: cells that are text, with the first of them.

    stamps: the cells themselves where these are times of day or time stamps; there are no numbers then.
    """

    values: Array
    unit: str = ""
    texts: int = 0
    example: str = ""
    stamps: tuple[str, ...] = ()

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

    def seconds(self, dayfirst: bool = True) -> Array:
        """Seconds since the first time stamp, or since the first time of day; NaN of what is neither."""
        import pandas as pd

        texts = pd.Series(self.stamps).str.replace(",", ".").str.replace(_WHOLE, r"\g<0>.0", regex=True)
        if _DAYTIME.match(self.example):
            times = pd.to_timedelta(texts, errors="coerce")
        else:  # in the order of ISO 8601 no day comes first
            order: dict[str, Any] = {"format": "ISO8601"} if _YEAR.match(self.example) else {"dayfirst": dayfirst}
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)  # of an order that the first stamp shows to be another
                times = pd.to_datetime(texts, errors="coerce", utc=True, **order)
        since = times - times.loc[times.first_valid_index()] if times.notna().any() else times
        whole = since.astype("timedelta64[ns]").to_numpy().astype(np.int64)  # exact, unlike seconds since 1970
        return np.where(times.notna(), whole * 1e-9, np.nan)


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
    ",": re.compile(r"[-+]?\d{1,3}(?:(?:\.\d{3})+,\d+|(?:[\u00a0\u202f ]\d{3})+(?:,\d+)?)"),
    ".": re.compile(r"[-+]?\d{1,3}(?:(?:,\d{3})+\.\d+|(?:[\u00a0\u202f ]\d{3})+(?:\.\d+)?)"),
}
_BETWEEN = re.compile(r"[.,\u00a0\u202f ](?=\d{3}(?:\D|$))")
_COMMA = re.compile(r"[-+]?(?:\d{1,3}(?:[.\u00a0\u202f ]\d{3})+|\d*),\d+(?:[eE][-+]?\d+)?")
_POINT = re.compile(r"[-+]?\d*\.\d+(?:[eE][-+]?\d+)?")
_WHOLE = re.compile(r"\d:\d\d:\d\d(?![\d.])", re.ASCII)  # seconds without a fraction
_DAYTIME, _YEAR = re.compile(r"\d{1,2}:", re.ASCII), re.compile(r"\d{4}-", re.ASCII)
_TIME = re.compile(r"(?:\d{1,4}[-./]\d{1,2}[-./]\d{1,4}[ T]\s*)?\d{1,2}:[0-5]\d:[0-5]\d.*", re.ASCII)


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
        there = ~np.isnat(cells)
        ticks = cells.astype(f"{'timedelta' if cells.dtype.kind == 'm' else 'datetime'}64[ns]").astype(np.int64)
        since = ticks[there][0] if cells.dtype.kind == "M" and there.any() else 0
        return Column(np.where(there, (ticks - since) * 1e-9, np.nan), unit)
    rows = ["" if cell is None or (isinstance(cell, float) and np.isnan(cell)) else str(cell).strip() for cell in cells]
    values = np.array([_number(ungrouped(row.replace("−", "-"), decimal)) for row in rows])
    texts = [row for row, value in zip(rows, values, strict=True) if np.isnan(value) and row.casefold() not in NOTHING]
    if texts and _TIME.fullmatch(texts[0]) and not np.isfinite(values).any():
        return Column(values, unit, len(texts), texts[0], tuple(rows))
    return Column(values, unit, len(texts), texts[0][:40] if texts else "")


# ---- text -----------------------------------------------------------------------------------------------------

FIRST = 200  # lines in which the header may stand, and as many rows that show how numbers are written
LONGEST = 1 << 24  # signs in which a line has to end
WIDE = 40  # columns from which those that are not asked for are passed over, and too many cells in a row not seen
GERMAN = ("Grad", "U/min", "Umin", "Umdr./min")  # units in headings, if not all are read without the mapping's word
_NO_UNIT = ("", "-", "–", "1")
_UNIT = re.compile(r"^(.*?)\s*\[([^\[\]]*)\]\s*$", re.DOTALL)
_BEHIND = re.compile(r"^(.*?\S)\s*(?:\(([^()]+)\)|(?:\s/|\sin)\s+(\S.*))$", re.DOTALL)  # T (V), T / V, T in V


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
                what = (
                    f"decimal and thousands signs are mixed: '{point.strip()[:20]}' in '{name}' beside decimal commas"
                )
                remedy = "export it without a sign between thousands, and with one sign for decimals"
                raise _failed(path, what, remedy)
        columns[name] = _column(cells, layout.units[place], layout.decimal)
    return DataTable(str(path), columns, encoding=layout.encoding)


def _first_lines(path: Path) -> tuple[list[str], str]:
    """The first lines and their encoding: UTF-16 by its mark, UTF-8 where that can be, else Windows-1252."""
    with path.open("rb") as file:
        marked = file.read(2) in (b"\xff\xfe", b"\xfe\xff")
    for encoding in ["utf-16"] if marked else ["utf-8-sig", "cp1252", "latin-1"]:
        try:
            with path.open(encoding=encoding) as stream:
                lines = [stream.readline(LONGEST) for _ in range(2 * FIRST)]
        except UnicodeDecodeError:
            continue
        if any("\0" in line for line in lines):
            raise _failed(path, "is not a text file", "check that it is CSV; use .tdms or .parquet for binary files")
        if any(len(line) == LONGEST for line in lines):
            what = f"has no end of a line in its first {LONGEST >> 20} MiB"
            raise _failed(path, what, "check that it is CSV, with a row of the table in each line", 1)
        return [line.rstrip("\n") for line in lines], encoding
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
    skip, units = stated[header][0] + 1, [unit for _, unit in named]
    if rows and _words(rows[0][1]):  # a row of units
        below = ["" if cell.strip("[]() ") in _NO_UNIT else cell.strip("[]() ") for cell in rows[0][1]]
        units = [unit or (below[k] if k < len(below) else "") for k, unit in enumerate(units)]
        skip, rows = rows[0][0] + 1, rows[1:]
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
    match, unit = _UNIT.match(cell), ""
    if match:
        unit = "" if match[2].strip() in _NO_UNIT else match[2].strip()
    elif match := _BEHIND.match(cell):
        unit = (match[2] or match[3]).strip()
        if not (_is_unit(unit) or unit in GERMAN):
            return cell, ""
    return (cell if cell in wanted or match is None else match[1]), unit


def _words(cells: Sequence[str]) -> bool:
    """Whether there is no number and no time in a row, and at least one unit or more words than one."""
    texts = [cell.strip("[]() ") for cell in cells if cell and cell != "1"]
    if any(not np.isnan(_number(cell.replace(",", "."))) or _TIME.fullmatch(cell) for cell in texts):
        return False
    return any(re.search(r"[^\W\d_]|[°%‰]", cell) and cell.casefold() not in NOTHING for cell in texts)


def _is_unit(text: str) -> bool:
    try:
        return bool(text) and bool(dimensions(text))
    except UnitError:
        return False


# ---- Parquet and TDMS -----------------------------------------------------------------------------------------


def _read_parquet(path: Path, names: Sequence[str], optional: Sequence[str]) -> DataTable:
    """The columns of a Parquet file; a unit is the entry `unit` or `units` of the column's metadata."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        with pq.ParquetFile(path) as file:
            schema = file.schema_arrow
            places = _places(path, list(schema.names), names, optional)
            table = file.read(columns=list(places))
    except pa.ArrowException as error:
        raise _failed(path, f"is not Parquet: {str(error).splitlines()[0][:120]}", "check the file") from None
    columns = {}
    for name in places:
        if pa.types.is_nested(schema.field(name).type):
            what = f"the column '{name}' has {schema.field(name).type} in each cell, not a number"
            raise _failed(path, what[:200], "write one column for each number")
        meta = schema.field(name).metadata or {}
        unit = (meta.get(b"unit") or meta.get(b"units") or b"").decode("utf-8", "replace")
        columns[name] = _column(table.column(name).to_pandas(), unit)
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
    alias = {name: one.name if short.count(one.name) == 1 else name for name, one in full.items()}
    channels = {alias[name]: channel for name, channel in full.items()}
    asked = {name: alias.get(name, name) for name in (*names, *optional)}
    _places(path, list(alias.values()), [asked[name] for name in names], [asked[name] for name in optional])
    chosen = {name: channels[short] for name, short in asked.items() if short in channels}
    if len({len(channel) for channel in chosen.values()}) > 1:
        lengths = ", ".join(f"'{name}' {len(channel):,}" for name, channel in chosen.items())
        raise _failed(path, f"its channels have different numbers of samples: {lengths}", "record them at one rate")
    columns, intervals = {}, set()
    for name, channel in chosen.items():
        columns[name] = _column(channel[:], str(channel.properties.get("unit_string", "") or ""))
        step = channel.properties.get("wf_increment")
        if isinstance(step, (int, float)) and step > 0:
            intervals.add((float(channel.properties.get("wf_start_offset", 0.0)), float(step)))
    if len({round(step, 15) for _, step in intervals}) > 1:
        rates = " and ".join(f"{1 / step:g} Hz" for _, step in sorted(intervals))
        raise _failed(path, f"its channels are sampled at {rates}", "record them at one rate")
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
