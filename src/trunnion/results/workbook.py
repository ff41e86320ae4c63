"""A result as an Excel workbook: a sheet for each table, with the names and the units above the numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.results.dataset import Column

__all__ = ["write_workbook"]

MOST_ROWS, MOST_COLUMNS = 1_048_576, 16_384  # of a sheet, by the format
HEADS = 2  # rows of names and units
NAME = 31  # letters of a sheet's name, at most
PLAIN = {"strings_to_formulas": False, "strings_to_urls": False, "strings_to_numbers": False}  # a name stays a name


def write_workbook(path: Path, tables: Mapping[str, Sequence[Column]], title: str) -> None:
    """Write the tables by name; numbers that are none are empty cells. The same result gives the same file.

    Raises MechanismError for a table that does not fit a sheet.
    """
    from xlsxwriter import Workbook

    for name, columns in tables.items():
        _check(path, name, columns)
    made = BytesIO()  # written by Python: where the disk is full, the package raises what is no OSError
    book = Workbook(made, {**PLAIN, "in_memory": True})
    book.set_properties({"title": title, "comments": "written by Trunnion", "created": datetime(2000, 1, 1)})
    head, unit = (
        book.add_format({"bold": True, "bottom": 1}),
        book.add_format({"italic": True, "font_color": "#5a636e"}),
    )
    for name, columns in tables.items():
        sheet = book.add_worksheet(name[:NAME])
        sheet.freeze_panes(HEADS, 1)
        for place, (label, of, values) in enumerate(columns):
            sheet.write_string(0, place, label, head)
            sheet.write_string(1, place, of, unit)
            sheet.set_column(place, place, max(10, min(len(label) + 2, 40)))
            _fill(sheet, place, np.asarray(values))
    book.close()
    path.write_bytes(made.getbuffer())


def _check(path: Path, name: str, columns: Sequence[Column]) -> None:
    rows = len(columns[0].values) if columns else 0
    if rows + HEADS > MOST_ROWS or len(columns) > MOST_COLUMNS:
        what = f"{rows} rows of {len(columns)} columns do not fit a sheet"
        raise MechanismError(Finding(what, f"{path.name}: {name}", "write .csv or .parquet, or fewer steps or columns"))


def _fill(sheet: Any, place: int, values: np.ndarray) -> None:
    """One column below its heads."""
    if values.dtype.kind in "fiub":
        for row, value in enumerate(values.tolist(), HEADS):
            if np.isfinite(value):
                sheet.write_number(row, place, value)
    else:
        for row, value in enumerate(values.tolist(), HEADS):
            sheet.write_string(row, place, str(value))
