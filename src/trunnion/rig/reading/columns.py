"""Columns of data files: which are wanted, and their cells as numbers."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError
from trunnion.model.names import nearest
from trunnion.rig.reading.clock import Clock, is_time

__all__ = ["NOTHING", "SHOWN", "Column", "DataTable", "choose", "clock_of", "failed", "number", "numbers", "of_text"]


Array = NDArray[np.float64]
SHOWN = 40  # columns named in a message


@dataclass(frozen=True)
class Column:
    """Numbers of one column. unit: as the file states it; texts: cells that are text, with the first of them.

    clock: times of day or time stamps, where the texts are such.
    """

    values: Array
    unit: str = ""
    texts: int = 0
    example: str = ""
    clock: Clock | None = None


@dataclass(frozen=True)
class DataTable:
    """The columns of a file that were asked for, all of one length.

    interval: (start, step) of evenly spaced samples in s, if the file itself tells; ends: lines of text below the last
    row of numbers, by their number in the file.
    """

    file: str
    columns: Mapping[str, Column]
    interval: tuple[float, float] | None = None
    notes: Sequence[str] = field(default_factory=tuple)
    ends: Mapping[int, str] = field(default_factory=dict)

    @property
    def rows(self) -> int:
        """How many rows there are."""
        return next((column.values.size for column in self.columns.values()), 0)


def failed(path: Path, what: str, remedy: str, line: int | None = None) -> MechanismError:
    return MechanismError(Finding(what, file=str(path), line=line, remedy=remedy))


def choose(path: Path, names: Sequence[str], wanted: Sequence[str], optional: Sequence[str]) -> dict[str, int]:
    """Place of each column that is wanted among those of the file; one finding for all that are missing."""
    places = {name: place for place, name in reversed(list(enumerate(names)))}
    missing = [name for name in wanted if name not in places]
    if missing:
        told = ", ".join(f"'{name}'" for name in missing)
        listed = ", ".join(f"'{name}'" for name in names[:SHOWN]) + (", …" if len(names) > SHOWN else "")
        what = f"there is no column {told}; the file has {listed or 'none'}"
        near = nearest(missing[0], names)
        like = near.startswith("did you mean") and len(missing[0]) > 3  # T1 is not meant where T2 is written
        remedy = near if like else "name one of these in the mapping"
        raise failed(path, what, remedy)
    doubled = [name for name in (*wanted, *optional) if names.count(name) > 1]
    if doubled:
        raise failed(path, f"the column '{doubled[0]}' stands there {names.count(doubled[0])} times", "rename one")
    return {name: places[name] for name in (*wanted, *optional) if name in places}


def number(text: object) -> float:
    """The number of a cell; NaN if it is none."""
    try:
        return float(text)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return np.nan


NOTHING = frozenset({"", "nan", "n/a", "na", "#n/a", "null", "none", "-nan", "inf", "-inf", "+inf", "infinity"})


def numbers(cells: Any, decimal: str = ".") -> tuple[Array, int, str]:
    """Cells of any kind as floats, infinite ones as they are; how many are texts, and the first of these."""
    cells = np.asarray(cells)
    if cells.dtype.kind in "fiub":
        return np.asarray(cells, dtype=np.float64), 0, ""
    if cells.dtype.kind in "mM":
        seconds = cells.astype("datetime64[ns]" if cells.dtype.kind == "M" else "timedelta64[ns]")
        first = seconds[~np.isnat(seconds)][:1]
        since = seconds - first[0] if cells.dtype.kind == "M" and first.size else seconds
        return np.where(np.isnat(seconds), np.nan, since.astype("timedelta64[ns]").astype(np.int64) * 1e-9), 0, ""
    texts, example = 0, ""
    values = np.empty(cells.size)
    for place, cell in enumerate(cells.tolist()):
        text = cell.strip().replace("−", "-") if isinstance(cell, str) else cell
        if isinstance(text, str):
            text = ungrouped(text, decimal)
        values[place] = number(text)
        if np.isnan(values[place]) and isinstance(text, str) and text.casefold() not in NOTHING:
            texts, example = texts + 1, example or str(cell).strip()[:40]
    return values, texts, example


def of_text(where: str, table: DataTable, name: str) -> Finding | None:
    """An error of a column most of whose cells are text, and no times; where: the entry that names it."""
    column = table.columns[name]
    numbers = int(np.count_nonzero(~np.isnan(column.values)))
    if column.clock is not None or column.texts <= numbers:
        return None
    what = (
        f"'{name}' has text in {column.texts:,} cells and a number in {numbers:,}; the first text is '{column.example}'"
    )
    unit = _WITH_UNIT.fullmatch(column.example)
    remedy = "name a column of numbers"
    if unit:
        key = f"{where.removesuffix('column')}unit"
        remedy = f"remove the unit from the cells; state {key}: {unit[1]} if the heading has none"
    figures = {"texts": column.texts, "numbers": numbers}
    return Finding(what, where, remedy, file=table.file, code="data.readings.text", figures=figures)


_WITH_UNIT = re.compile(r"[-+−]?\d[\d.,'’ ]*(?:[eE][-+]?\d+)?\s*([^\d\s.,;:][^\d;:]*)")


GROUPED = {  # thousands with a sign between them; of a point or a comma only where decimals tell which of them it is
    ",": re.compile(r"[-+]?\d{1,3}(?:(?:\.\d{3})+,\d+|(?:['’\u00a0\u202f ]\d{3})+(?:,\d+)?)"),
    ".": re.compile(r"[-+]?\d{1,3}(?:(?:,\d{3})+\.\d+|(?:['’\u00a0\u202f ]\d{3})+(?:\.\d+)?)"),
}
_BETWEEN = re.compile(r"[.,'’\u00a0\u202f ](?=\d{3}(?:\D|$))")


def ungrouped(text: str, decimal: str) -> str:
    """A number without signs between thousands and with a decimal point: 1450.33 of `1.450,33`."""
    if GROUPED[decimal].fullmatch(text):
        whole, sign, part = text.partition(decimal)
        text = _BETWEEN.sub("", whole) + sign + part
    return text if decimal == "." else text.replace(decimal, ".")


def clock_of(cells: Any, texts: int, example: str) -> Clock | None:
    """The clock of a column whose first cell of text is a time; None if it is no such column."""
    if not texts or not is_time(example):
        return None
    clock = Clock()
    clock.add(np.asarray(cells).tolist())
    return clock
