"""A result as a file: CSV, JSON, NetCDF, Zarr, Parquet or a workbook, by extension.

CSV (and Parquet) have one row a position and flat columns: `time`, `<joint>.rotation`, `<joint>.slide`,
`<joint>.reaction_x|y`, `<joint>.friction_torque`, `<driver>.effort`, `<link>.<point>.x|y`, `power_in`,
`power_useful`, `status` and so on, in SI; the other formats hold the whole Dataset. In space also z, and
`<joint>.reaction_moment_x|y|z`, `<joint>.friction_force`, `<link>.x|y|z`, `<link>.rotation_w|x|y|z`,
`<link>.angular_velocity_x|y|z`. Of a mechanism with errors also `<joint>.rotation_error`, `<joint>.slide_error`,
`<link>.<point>.error_x|y`, `<joint>.reaction_change_x|y`, `<driver>.effort_change`; of pins in their seats
`<joint>.seat_1_x` …, `<joint>.end_force_1_x` …, `<joint>.contact_1_x` …, `<joint>.seat_beta`, `<joint>.seat_xi`,
`<joint>.seat_xi_pin`, `<joint>.contact_lost`. A sweep has one row a point of its grid: the swept numbers by the names
they were given, then `efficiency`, `<driver>.effort_max`, `<joint>.reaction_max`, …, `status`. The play of joints has
`drive`, `<measure>`, `<measure>.worst_case`, `<measure>.rss`, `<measure>.deviation`, `<measure>.<joint>.worst_case`,
…. Of tolerances the file's name says which table it holds: one row a measure, or of `x.parameters.csv` one a toleranced
number, see `results.tables.tolerances`; so it does of a comparison with measurements and of what `identify` finds, see
`results.tables.studies`. What `assemble` finds has one row a position:
`<driver>.coordinate`, `needed_share`, `needed_clearance`, …, `<joint>.uniform_1_x` of end 1, …, `status`. Measured
courses have one row a condition and position: `condition`, what was set, `phase`, `<channel>.mean`, `.scatter`,
`.uncertainty`, `.turns`.
"""

from __future__ import annotations

import csv
import importlib.util
import json
import math
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import xarray as xr

from trunnion.errors import Finding, MechanismError
from trunnion.files import whole
from trunnion.model.arguments import strict_arguments
from trunnion.model.names import guarded
from trunnion.model.units import TableUnits
from trunnion.results.attributes import KEPT
from trunnion.results.dataset import Column
from trunnion.results.tables import KINDS, in_model_units, kind_of, selected, table_of
from trunnion.results.tables import columns as flat_columns
from trunnion.results.workbook import write_workbook

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["FORMATS", "check_format", "frame", "save"]

Columns = Callable[[xr.Dataset, str], list[Column]]  # of a table by name; of the file's own if that is empty
BY_ROW = ("tolerance", "allocation", "comparison", "identification", "measurement")  # no column has one unit there


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
    if engine == "scipy" and KEPT in result.attrs:  # SciPy's writer takes this name for its own variables
        result = result.copy(deep=False)
        result.attrs[f"kept_{KEPT}"] = result.attrs.pop(KEPT)
    try:
        made = result.to_netcdf(engine=engine)
    except ValueError:  # of an xarray that cannot make it in memory
        result.to_netcdf(path, engine=engine)
    else:  # by Python: where the disk is full, the HDF5 library takes the process with it
        path.write_bytes(made)


def _zarr(result: xr.Dataset, path: Path, units_row: bool, columns: Columns) -> None:
    path.unlink()  # a Zarr store is a folder
    _uninterrupted(lambda: result.to_zarr(path, zarr_format=2))  # 3 has no stable text arrays yet


def _uninterrupted(write: Callable[[], object]) -> None:
    """Write to the end in a thread of its own: a signal raises in the main thread, and Zarr would go on behind it."""
    with ThreadPoolExecutor(1) as thread:
        thread.submit(write).result()


def _json(result: xr.Dataset, path: Path, units_row: bool, columns: Columns) -> None:
    data = result.to_dict()
    for section in ("coords", "data_vars"):
        for entry in data[section].values():
            entry["data"] = _plain(entry["data"])
    with path.open("w", encoding="utf-8") as file:
        json.dump(data, file, ensure_ascii=False, allow_nan=False)


def _plain(value: Any) -> Any:
    """Nested lists with null in place of a number that is none: JSON has no NaN."""
    if isinstance(value, list):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _xlsx(result: xr.Dataset, path: Path, units_row: bool, columns: Columns) -> None:
    tables = {name: columns(result, name) for name in KINDS[kind_of(result)]}
    write_workbook(path, tables, str(result.attrs.get("name", "")))


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
        known = ", ".join((*FORMATS, *others))
        raise MechanismError(Finding(f"cannot write a result as '{suffix}'", str(path), f"use one of {known}"))
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
        own = table_of(path, result)
        found = selected(result, columns if table in ("", own) else None, table or own)
        return in_model_units(result, found) if units == "model" else found

    with whole(path) as temporary:
        writer(result, temporary, units_row, chosen)
