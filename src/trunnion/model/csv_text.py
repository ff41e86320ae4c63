"""The lines of CSV files: which count, what separates their cells, and headings with units.

The separator is the first of semicolon, tab and comma that a header has. A unit stands in brackets behind the name,
`T1 [V]`; one that is in use also as `T1 (V)`, `T1 / V` and `T1 in V`; or in a row of its own below the names. Lines
that begin with # are passed over.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Collection, Iterable, Sequence

from trunnion.model.names import unguarded
from trunnion.model.units import UnitError

__all__ = ["NOTHING", "TIME", "bare", "cells_of", "heading", "number", "numbered", "separator_of", "units_below"]

NOTHING = frozenset({"", "nan", "n/a", "na", "#n/a", "null", "none", "-nan", "inf", "-inf", "+inf", "infinity"})
TIME = re.compile(r"(?:\d{1,4}[-./]\d{1,2}[-./]\d{1,4}[ T]\s*)?\d{1,2}:[0-5]\d:[0-5]\d.*", re.ASCII)
_NO_UNIT = ("", "-", "–", "1")
_HEADING = re.compile(
    r"(?P<name>.*?)\s*\[(?P<sure>[^\[\]]*)\]|(?P<before>.*?\S)\s*(?:\((?P<round>[^()]+)\)|(?:\s/|\sin)\s+(?P<last>\S.*))",
    re.DOTALL,
)


def numbered(lines: Iterable[str]) -> list[tuple[int, str]]:
    """The lines that are neither empty nor comments, by their numbers from 1."""
    return [
        (number, line.rstrip("\n"))
        for number, line in enumerate(lines, start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]


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
