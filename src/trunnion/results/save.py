"""A result as a file: CSV, JSON, NetCDF, Zarr, Parquet or a workbook, by extension.

CSV, Parquet and workbooks have flat columns in SI, one row a position (of a motion a time, of a sweep a point, of
tolerances a measure, …); the file's name says which of several tables it holds, see `results.tables`. The other formats
hold the whole Dataset.
"""

from __future__ import annotations

import csv
import importlib.util
import json
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
import xarray as xr

from trunnion.errors import Finding, MechanismError
from trunnion.files import whole
from trunnion.model.arguments import strict_arguments
from trunnion.model.names import guarded
from trunnion.model.units import TableUnits
from trunnion.results.attributes import plain
from trunnion.results.dataset import Column
from trunnion.results.tables import KINDS, in_model_units, kind_of, selected, table_of
from trunnion.results.tables import columns as flat_columns

if TYPE_CHECKING:
    import pandas as pd

Columns = Callable[[xr.Dataset, str], list[Column]]  # of a table by name; of the file's own if that is empty
BY_ROW = ("tolerance", "allocation", "comparison", "identification", "measurement")  # no column has one unit there

MOST_ROWS, MOST_COLUMNS = 1_048_576, 16_384  # of a sheet, by the format
HEADS = 2  # rows of names and units
NAME = 31  # letters of a sheet's name, at most
PLAIN = {"strings_to_formulas": False, "strings_to_urls": False, "strings_to_numbers": False}  # a name stays a name


def frame(result: xr.Dataset, table: str = "", units: str = "si") -> pd.DataFrame:
    """The flat columns of a table, the first if none is named; units as for `save`."""
    every = flat_columns(result, table)
    return _frame(in_model_units(result, every) if units == "model" else every)


def _frame(every: Sequence[Column]) -> pd.DataFrame:
    import pandas as pd

    return pd.DataFrame({column.name: column.values for column in every})


def _csv(result: xr.Dataset, path: Path, units_row: bool, columns: Columns) -> None:
    """With no text that a spreadsheet would take for a formula."""
    every = columns(result, "")
    rows = _frame(every).rename(columns=guarded)
    for place, kind in enumerate(rows.dtypes):
        if kind.kind not in "fiub":
            name = rows.columns[place]
            rows[name] = [guarded(cell) if isinstance(cell, str) else cell for cell in rows[name]]
    with path.open("w", encoding="utf-8", newline="") as file:
        rows.head(0).to_csv(file, index=False)
        if units_row:
            csv.writer(file, lineterminator="\n").writerow([guarded(column.unit) for column in every])
        rows.to_csv(file, index=False, header=False)


def _parquet(result: xr.Dataset, path: Path, units_row: bool, columns: Columns) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(pa.Table.from_pandas(_frame(columns(result, "")), preserve_index=False), path)


def _netcdf(result: xr.Dataset, path: Path, units_row: bool, columns: Columns) -> None:
    four = all(importlib.util.find_spec(package) for package in ("h5netcdf", "h5py"))  # else NetCDF 3
    engine: Literal["h5netcdf", "scipy"] = "h5netcdf" if four else "scipy"
    try:
        made = result.to_netcdf(engine=engine)
    except ValueError:  # of an xarray that cannot make it in memory
        result.to_netcdf(path, engine=engine)
    else:  # by Python: where the disk is full, the HDF5 library takes the process with it
        path.write_bytes(made)


def _zarr(result: xr.Dataset, path: Path, units_row: bool, columns: Columns) -> None:
    path.unlink()  # a Zarr store is a folder
    with ThreadPoolExecutor(1) as thread:  # to the end: a signal raises in the main thread, and Zarr would go on
        thread.submit(lambda: result.to_zarr(path, zarr_format=2)).result()  # 3 has no stable text arrays yet


def _json(result: xr.Dataset, path: Path, units_row: bool, columns: Columns) -> None:
    data = result.to_dict()
    for section in ("coords", "data_vars"):
        for entry in data[section].values():
            entry["data"] = plain(entry["data"])
    with path.open("w", encoding="utf-8") as file:
        json.dump(data, file, ensure_ascii=False, allow_nan=False)


def _xlsx(result: xr.Dataset, path: Path, units_row: bool, columns: Columns) -> None:
    """A sheet for each table, with names and units above the numbers; the same result gives the same file.

    Raises MechanismError for a table that does not fit a sheet.
    """
    import pandas as pd

    tables = {name: columns(result, name) for name in KINDS[kind_of(result)]}
    for name, table in tables.items():
        rows = len(table[0].values) if table else 0
        if rows + HEADS > MOST_ROWS or len(table) > MOST_COLUMNS:
            what = f"{rows} rows of {len(table)} columns do not fit a sheet"
            remedy = "write .csv or .parquet, or fewer steps or columns"
            raise MechanismError(Finding(what, f"{path.name}: {name}", remedy))
    made = BytesIO()  # written by Python: where the disk is full, the package raises what is no OSError
    with pd.ExcelWriter(made, "xlsxwriter", engine_kwargs={"options": {**PLAIN, "in_memory": True}}) as writer:
        book = writer.book
        title = str(result.attrs.get("name", ""))
        book.set_properties({"title": title, "comments": "written by Trunnion", "created": datetime(2000, 1, 1)})
        head = book.add_format({"bold": True, "bottom": 1})
        below = book.add_format({"italic": True, "font_color": "#5a636e"})
        for name, table in tables.items():
            rows = _frame(table).replace([np.inf, -np.inf], np.nan)  # numbers that are none are empty cells
            rows.to_excel(writer, sheet_name=name[:NAME], startrow=HEADS, header=False, index=False)
            sheet = writer.sheets[name[:NAME]]
            sheet.freeze_panes(HEADS, 1)
            for place, (label, unit, _) in enumerate(table):
                sheet.write_string(0, place, label, head)
                sheet.write_string(1, place, unit, below)
                sheet.set_column(place, place, max(10, min(len(label) + 2, 40)))
    path.write_bytes(made.getbuffer())


Writer = Callable[["xr.Dataset", Path, bool, Columns], None]

# extension: writer, the package it needs and the extra that brings it
FORMATS: dict[str, tuple[Writer, str, str]] = {
    ".csv": (_csv, "", ""),
    ".json": (_json, "", ""),
    ".nc": (_netcdf, "", ""),
    ".zarr": (_zarr, "zarr", "zarr"),
    ".parquet": (_parquet, "pyarrow", "parquet"),
    ".xlsx": (_xlsx, "xlsxwriter", "xlsx"),
}


def check_format(path: str | os.PathLike[str], others: tuple[str, ...] = ()) -> None:
    """MechanismError if the file's extension is not one of FORMATS or its package is not installed.

    others: extensions that would do as well, for the message.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in FORMATS:
        formats = ", ".join((*FORMATS, *others))
        raise MechanismError(Finding(f"cannot write a result as '{suffix}'", str(path), f"use one of {formats}"))
    _, package, extra = FORMATS[suffix]
    if package and importlib.util.find_spec(package) is None:
        raise MechanismError(Finding(f"{suffix} needs {package}", str(path), f"pip install 'trunnion[{extra}]'"))


@strict_arguments
def save(
    result: xr.Dataset,
    path: str | os.PathLike[str],
    units_row: bool = False,
    columns: Sequence[str] | None = None,
    units: TableUnits = "si",
) -> None:
    """Write a result by the file's extension, whole or not at all.

    result: of any function that returns a Dataset; path: .csv .json .nc .zarr .parquet .xlsx. units_row: a second
    header row with the units (CSV; a workbook has it always). columns: of a cycle, the columns of CSV, Parquet and
    workbook: usual, motion (with velocities and accelerations), all, or names and patterns such as `crank.B.*`. units:
    of these tables: si, or model, those that the model is written in, in columns named with them (`rod.C.x [mm]`). The
    other formats hold the whole Dataset, in SI. Raises MechanismError for an unknown extension, column or choice of
    units, a missing package, or a place that cannot be written.
    """
    check_format(path)
    if units == "model" and kind_of(result) in BY_ROW:
        what = f"tables of a result of kind {kind_of(result)} name the unit in each row"
        raise MechanismError(Finding(what, "units", "write them in SI, without units='model'"))
    suffix = Path(path).suffix.lower()
    writer, _, _ = FORMATS[suffix]
    if suffix == ".zarr" and Path(path).is_dir():
        raise MechanismError(Finding("exists already", str(path), "remove it or choose another name"))

    def chosen(result: xr.Dataset, table: str) -> list[Column]:
        """The columns of a table; what was asked for holds for the one that the file is named for."""
        named_table = table_of(path, result)
        every = selected(result, columns if table in ("", named_table) else None, table or named_table)
        return in_model_units(result, every) if units == "model" else every

    with whole(path) as temporary:
        writer(result, temporary, units_row, chosen)
