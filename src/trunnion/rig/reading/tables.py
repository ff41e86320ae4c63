"""Columns of data files as numbers: CSV, Parquet, TDMS and NetCDF by extension, the same numbers whichever it is.

Only the columns that are asked for are read. What is no number in them is NaN and counted, never replaced.

In CSV what a logger writes above the header is passed over; `csv_text` says what the header tells. With semicolon or
tab a number may have a decimal comma. Pandas reads the rows.
"""

from __future__ import annotations

import importlib
import importlib.util
import re
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError
from trunnion.files import reading
from trunnion.model.csv_table import NOTHING, TIME, bare, cells_of, heading, number, numbered, separator_of, units_below
from trunnion.rig.reading.units import dimensions

Array = NDArray[np.float64]
NAMED = 40  # columns in a message


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
        ticks = since.astype("timedelta64[ns]").to_numpy().astype(np.int64)  # exact, unlike seconds since 1970
        return np.where(times.notna(), ticks * 1e-9, np.nan)


@dataclass(frozen=True)
class DataTable:
    """The columns of a file that were asked for, all of one length.

    interval: (start, step) of evenly spaced samples in s, if the file itself states it; encoding: of a text file.
    """

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
    path : of a CSV, Parquet, TDMS or NetCDF file, told by its extension.
    names : of the columns.
    optional : columns that may be missing.

    Raises
    ------
    MechanismError
        Where the file cannot be read, or a column is missing.
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
    reading(path)
    try:
        table = reader(path, list(dict.fromkeys(names)), list(dict.fromkeys(optional)))
    except MechanismError:
        raise
    except OSError as error:
        raise _failed(path, f"cannot be read: {error.strerror or error}", "check the file") from None
    except Exception as error:  # what parsing of a broken file meets: struct, Value-, Key-, EOF-, Arrow-, TypeError
        what = f"is not {suffix} that can be read: {(str(error).splitlines() or [type(error).__name__])[0][:120]}"
        raise _failed(path, what, "check the file") from None
    if table.rows == 0:
        raise _failed(path, "has a header but no rows of numbers", "check that the recording was saved")
    return table


def _failed(path: Path, what: str, remedy: str, line: int | None = None) -> MechanismError:
    return MechanismError(Finding(what, file=str(path), line=line, remedy=remedy))


def _places(path: Path, present: Sequence[str], names: Sequence[str], optional: Sequence[str]) -> dict[str, int]:
    """Place of each column among those that are present; one finding for all that are missing."""
    if missing := [name for name in names if name not in present]:
        listed = ", ".join(f"'{name}'" for name in present[:NAMED]) + (", …" if len(present) > NAMED else "")
        what = f"there is no column {', '.join(map(repr, missing))}; the file has {listed or 'none'}"
        raise _failed(path, what, "name one of these in the mapping")
    columns = [name for name in (*names, *optional) if name in present]
    if doubled := [name for name in columns if present.count(name) > 1]:
        raise _failed(path, f"the column '{doubled[0]}' stands there {present.count(doubled[0])} times", "rename one")
    return {name: present.index(name) for name in columns}


# ---- cells ----------------------------------------------------------------------------------------------------

_COMMA = re.compile(r"[-+]?(?:\d{1,3}(?:[.\u00a0\u202f ]\d{3})+|\d*),\d+(?:[eE][-+]?\d+)?")
_GROUPED = {  # with a sign between thousands: only where decimals tell which of point and comma it is
    ",": re.compile(r"[-+]?\d{1,3}(?:([.\u00a0\u202f ])\d{3})+,\d+"),
    ".": re.compile(r"[-+]?\d{1,3}(?:([,\u00a0\u202f ])\d{3})+\.\d+"),
}
_WHOLE = re.compile(r"\d:\d\d:\d\d(?![\d.])", re.ASCII)  # seconds without a fraction
_DAYTIME, _YEAR = re.compile(r"\d{1,2}:", re.ASCII), re.compile(r"\d{4}-", re.ASCII)


def _column(cells: Any, unit: str = "", decimal: str = ".") -> Column:
    """Cells of any kind as floats, infinite ones as they are; time stamps as seconds since the first.

    decimal: sign in texts; another point or comma is passed over where a cell of the column shows that it stands
    between thousands, and makes no number elsewhere.
    """
    cells = np.asarray(cells)
    if cells.dtype.kind in "fiub":
        return Column(np.asarray(cells, dtype=np.float64), unit)
    if cells.dtype.kind in "mM":
        dated = ~np.isnat(cells)
        ticks = cells.astype(f"{'timedelta' if cells.dtype.kind == 'm' else 'datetime'}64[ns]").astype(np.int64)
        since = ticks[dated][0] if cells.dtype.kind == "M" and dated.any() else 0
        return Column(np.where(dated, (ticks - since) * 1e-9, np.nan), "s")
    rows = ["" if cell is None or (isinstance(cell, float) and np.isnan(cell)) else str(cell).strip() for cell in cells]
    between = {match[1]: "" for row in rows if (match := _GROUPED[decimal].fullmatch(row))}
    signs = str.maketrans({".": "?", ",": "?", "−": "-"} | between | {decimal: "."})
    values = np.array([number(row.translate(signs)) for row in rows])
    texts = [row for row, value in zip(rows, values, strict=True) if np.isnan(value) and row.casefold() not in NOTHING]
    stamps = texts and TIME.fullmatch(texts[0]) and not np.isfinite(values).any()
    example = re.sub(r"[\x00-\x1f\x7f-\x9f]+", "�", texts[0])[:40] if texts else ""  # NUL of a torn file
    return Column(values, unit, len(texts), example, tuple(rows) if stamps else ())


# ---- text -----------------------------------------------------------------------------------------------------

FIRST = 200  # lines in which the header may stand, and as many rows that show how numbers are written
LONGEST = 1 << 24  # signs in which a line has to end
WIDE = 40  # columns from which those that are not asked for are passed over, and too many cells in a row not seen
GERMAN = ("Grad", "U/min", "Umin", "Umdr./min")  # units in headings, if not all are read without the mapping's word


def _read_text(path: Path, names: Sequence[str], optional: Sequence[str]) -> DataTable:
    """The columns of a text file. Header, separator, decimal sign and units are told by its first lines."""
    import pandas as pd

    lines, encoding = _first_lines(path)
    wanted = {*names, *optional}
    header, separator, heads = _header(path, lines, wanted)
    labels, units = map(list, zip(*heads, strict=True))
    places = _places(path, labels, names, optional)
    rows = [(place, cells_of(line, separator)) for place, line in lines if place > header]
    if rows and (more_units := units_below(units, rows[0][1])):
        header, units = rows.pop(0)[0], more_units
    sample = [row[place] for _, row in rows[:FIRST] for place in places.values() if place < len(row)]
    decimal = "," if separator != "," and any(_COMMA.fullmatch(cell) for cell in sample) else "."
    version = tuple(int(part) for part in re.findall(r"\d+", pd.__version__)[:2])
    exact: dict[str, Any] = {} if version >= (3, 1) else {"float_precision": "round_trip"}
    width = max(len(heads), *(len(row) for _, row in rows)) if rows else len(heads)  # separators end some lines
    columns_used = sorted(set(places.values())) if width > WIDE else None
    try:
        frame = pd.read_csv(
            path, sep=separator, decimal=decimal, header=None, names=list(range(width)),
            usecols=columns_used,
            skiprows=header + 1, comment="#", encoding=encoding, encoding_errors="replace", low_memory=False,
            skipinitialspace=True, **exact,
        )  # fmt: skip
    except pd.errors.EmptyDataError:
        frame = pd.DataFrame(columns=list(range(width)), dtype=float)
    except pd.errors.ParserError as error:  # "Expected 2 fields in line 502, saw 3"
        cells = re.search(r"Expected (\d+) fields in line (\d+), saw (\d+)", str(error))
        what = f"has {cells[3]} cells instead of {cells[1]}" if cells else f"is not CSV: {str(error)[-120:]}"
        raise _failed(path, what, "correct that line", int(cells[2]) if cells else None) from None
    more = [place for place in frame if place >= len(heads)]
    if (longer := np.flatnonzero(frame[more].notna().any(axis=1))).size:
        what = f"row {longer[0] + 1} below the header has more cells than its {len(heads)}"
        remedy = "correct it; numbers with a decimal comma need a semicolon or tab between them"
        raise _failed(path, what, remedy)
    columns = {name: _column(frame[place].to_numpy(), units[place], decimal)
               for name, place in places.items()}  # fmt: skip
    return DataTable(columns, encoding=encoding)


def _first_lines(path: Path) -> tuple[list[tuple[int, str]], str]:
    """The first lines that are no comments, by their places, and their encoding: UTF-16 by its mark, else UTF-8 or
    Windows-1252."""
    with path.open("rb") as file:
        marked = file.read(2) in (b"\xff\xfe", b"\xfe\xff")
    lines: list[str] = []
    for encoding in ["utf-16"] if marked else ["utf-8-sig", "cp1252", "latin-1"]:
        try:
            with path.open(encoding=encoding) as stream:
                lines = [stream.readline(LONGEST) for _ in range(2 * FIRST)]
            break
        except UnicodeDecodeError:
            continue
    if any("\0" in line or len(line) == LONGEST for line in lines):
        remedy = "check that it is CSV, with a row of the table in each line"
        raise _failed(path, f"is not a text file: a NUL, or no end of a line in {LONGEST >> 20} MiB", remedy, 1)
    if not (counted := numbered(lines)):
        raise _failed(path, "is empty but for comments", "check that the recording was saved", 1)
    return [(line - 1, text) for line, text in counted], encoding


def _header(path: Path, lines: list[tuple[int, str]], columns: set[str]) -> tuple[int, str, list[tuple[str, str]]]:
    """Place, separator, and names with units of the line that has the most of the columns; loggers write above it."""
    best: tuple[int, int, str, list[tuple[str, str]]] = (0, 0, "", [])
    for place, line in lines[:FIRST]:
        separator = separator_of(line)
        cells = cells_of(line, separator)
        heads = [heading(cell, lambda unit: unit in GERMAN or dimensions(unit), columns) for cell in cells]
        hits = len({name for name, _ in heads} & columns)
        if hits > best[0]:
            best = hits, place, separator, heads
    if not best[0]:
        first = " / ".join(line.strip()[:60] for _, line in lines[:3])
        what = f"no line has the columns {', '.join(map(repr, sorted(columns)))}; the first lines are: {first}"
        remedy = "name the columns of the file in the mapping, or write their names above the numbers"
        raise _failed(path, what, remedy, 1)
    return best[1:]


# ---- Parquet, TDMS and NetCDF ---------------------------------------------------------------------------------


def _read_parquet(path: Path, names: Sequence[str], optional: Sequence[str]) -> DataTable:
    """The columns of a Parquet file; a unit is the entry `unit` or `units` of the column's metadata."""
    import pyarrow.parquet as pq

    with pq.ParquetFile(path) as file:
        schema = file.schema_arrow
        places = _places(path, list(schema.names), names, optional)
        table = file.read(columns=list(places))
    columns = {}
    for name in places:
        meta = schema.field(name).metadata or {}
        unit = (meta.get(b"unit") or meta.get(b"units") or b"").decode("utf-8", "replace")
        columns[name] = _column(table.column(name).to_pandas(), unit)
    return DataTable(columns)


def _read_tdms(path: Path, names: Sequence[str], optional: Sequence[str]) -> DataTable:
    """Channels of a TDMS file, by `group/channel` or by the channel's name where only one group has it.

    Unit: the property unit_string; sampling: wf_start_offset and wf_increment of waveforms.
    """
    from nptdms import TdmsFile

    with path.open("rb") as stream, TdmsFile.open(stream) as file:
        every = [channel for group in file.groups() for channel in group.channels()]
        short = [channel.name for channel in every]
        full = {f"{channel.group_name}/{channel.name}": channel for channel in every}
        present = [channel.name if short.count(channel.name) == 1 else name for name, channel in full.items()]
        channels = {**full, **dict(zip(present, full.values(), strict=True))}
        listed = [*present, *(name for name in (*names, *optional) if name in full and name not in present)]
        chosen = {name: channels[name] for name in _places(path, listed, names, optional)}
        waves = [channel.properties for channel in chosen.values() if channel.properties.get("wf_increment")]
        steps = {(float(wave.get("wf_start_offset", 0.0)), float(wave["wf_increment"])) for wave in waves}
        if len({len(channel) for channel in chosen.values()}) > 1 or len({round(step, 15) for _, step in steps}) > 1:
            lengths = ", ".join(f"'{name}' {len(channel):,}" for name, channel in chosen.items())
            what = f"its channels have different numbers of samples or rates: {lengths}"
            raise _failed(path, what, "record them at one rate")
        columns = {name: _column(channel[:], str(channel.properties.get("unit_string", "") or ""))
                   for name, channel in chosen.items()}  # fmt: skip
    return DataTable(columns, min((pair for pair in steps if pair[1] > 0), default=None))


def _read_netcdf(path: Path, names: Sequence[str], optional: Sequence[str]) -> DataTable:
    """Variables and coordinates of one dimension, with their attribute `units`; only those that are named are decoded.

    SciPy reads the classic format, h5netcdf that of version 4.
    """
    import xarray as xr

    with path.open("rb") as stream:
        classic = stream.read(3) == b"CDF"
    if not classic and not all(importlib.util.find_spec(package) for package in ("h5netcdf", "h5py")):
        raise _failed(path, ".nc of version 4 needs h5netcdf", "pip install 'trunnion[netcdf]'")
    if not classic:  # where h5netcdf fails at the first attributes, it prints a traceback when it is cleared away
        with importlib.import_module("h5py").File(path, "r") as whole:
            whole.attrs.get("_nc3_strict")
    with xr.open_dataset(path, engine="scipy" if classic else "h5netcdf", decode_cf=False) as file:
        places = _places(path, [str(name) for name in file.variables], names, optional)
        chosen = xr.decode_cf(file.drop_vars(file.variables.keys() - places.keys()), decode_timedelta=False)
        sizes = [dict(chosen[name].sizes) for name in places]
        if any(len(size) != 1 or size != sizes[0] for size in sizes):
            each = ", ".join(f"{name} {size}" for name, size in zip(places, sizes, strict=True))
            what = f"its variables are not all of one dimension, the same for all: {each}"
            raise _failed(path, what, "write each column as a variable of that dimension alone")
        columns = {name: _column(chosen[name].values, bare(str(chosen[name].attrs.get("units", ""))))
                   for name in places}  # fmt: skip
    return DataTable(columns)


Reader = Callable[[Path, Sequence[str], Sequence[str]], DataTable]

# extension: reader, the package it needs and the extra that brings it
FORMATS: dict[str, tuple[Reader, str, str]] = {
    ".csv": (_read_text, "", ""),
    ".txt": (_read_text, "", ""),
    ".tsv": (_read_text, "", ""),
    ".parquet": (_read_parquet, "pyarrow", "parquet"),
    ".tdms": (_read_tdms, "nptdms", "tdms"),
    ".nc": (_read_netcdf, "", ""),
}
