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
`results.tables.comparison` and `results.tables.identification`. What `assemble` finds has one row a position:
`<driver>.coordinate`, `needed_share`, `needed_clearance`, …, `<joint>.uniform_1_x` of end 1, …, `status`. Measured
courses have one row a condition and position: `condition`, what was set, `phase`, `<channel>.mean`, `.scatter`,
`.uncertainty`, `.turns`.
"""

from __future__ import annotations

import importlib.util
import json
import math
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, ExitStack, contextmanager
from io import FileIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from trunnion.errors import Finding, MechanismError
from trunnion.files import whole
from trunnion.model.names import guarded
from trunnion.results.attributes import KEPT
from trunnion.results.model_units import in_model_units
from trunnion.results.tables import KINDS, Column, kind_of, table_of
from trunnion.results.tables import columns as flat_columns
from trunnion.results.tables.selection import selected
from trunnion.results.workbook import write_workbook

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from _typeshed import ReadableBuffer

__all__ = ["FORMATS", "UNITS", "check_format", "check_units", "frame", "in_parts", "save", "saving"]

Columns = Callable[["xr.Dataset", str], list[Column]]  # of a table by name; of the file's own if that is empty
Add = Callable[["xr.Dataset"], None]  # writes a result, or the next positions of one
UNITS = ("si", "model")
BY_ROW = ("tolerance", "allocation", "comparison", "identification", "measurement")  # no column has one unit there
ROWS = 20_000  # written at a time, so that memory does not grow with the number of positions


def frame(result: xr.Dataset, table: str = "", units: str = "si") -> pd.DataFrame:
    """The flat columns of a table, the first if none is named; units as for `save`."""
    import pandas as pd

    found = flat_columns(result, table)
    found = in_model_units(result, found) if units == "model" else found
    return pd.DataFrame({name: values(slice(None)) for name, _, values in found})


def frames(found: Sequence[Column]) -> Iterator[pd.DataFrame]:
    """The flat columns, some rows at a time."""
    import pandas as pd

    count = len(found[0][2](slice(None)))
    for low in range(0, max(count, 1), ROWS):  # one window at least, so that the names are written
        window = slice(low, low + ROWS)
        yield pd.DataFrame({name: values(window) for name, _, values in found})


def _guarded(frame: pd.DataFrame) -> pd.DataFrame:
    """The frame with no text that a spreadsheet would take for a formula."""
    frame = frame.rename(columns=guarded)
    for place, kind in enumerate(frame.dtypes):
        if kind.kind not in "fiub":
            name = frame.columns[place]
            frame[name] = [guarded(cell) if isinstance(cell, str) else cell for cell in frame[name]]
    return frame


@contextmanager
def _csv(path: Path, units_row: bool, columns: Columns, in_parts: bool) -> Iterator[Add]:
    with path.open("w", encoding="utf-8", newline="") as file:
        begun = False

        def add(result: xr.Dataset) -> None:
            nonlocal begun
            found = columns(result, "")
            for frame in map(_guarded, frames(found)):
                if not begun:
                    frame.head(0).to_csv(file, index=False)
                if not begun and units_row:
                    import csv

                    units = [guarded(unit) for _, unit, _ in found]
                    csv.writer(file, lineterminator="\n").writerow(units)
                begun = True
                frame.to_csv(file, index=False, header=False)

        yield add


@contextmanager
def _parquet(path: Path, units_row: bool, columns: Columns, in_parts: bool) -> Iterator[Add]:
    import pyarrow as pa
    import pyarrow.parquet as pq

    with ExitStack() as stack:
        writer = None

        def add(result: xr.Dataset) -> None:
            nonlocal writer
            for frame in frames(columns(result, "")):
                rows = pa.Table.from_pandas(frame, preserve_index=False)
                writer = writer or stack.enter_context(pq.ParquetWriter(path, rows.schema))
                writer.write_table(rows)

        yield add


def _hdf() -> bool:
    """Whether the packages for NetCDF 4 are installed."""
    return all(importlib.util.find_spec(package) for package in ("h5netcdf", "h5py"))


@contextmanager
def _netcdf(path: Path, units_row: bool, columns: Columns, in_parts: bool) -> Iterator[Add]:
    engine: Literal["h5netcdf", "scipy"] = "h5netcdf" if _hdf() else "scipy"
    begun = False

    def add(result: xr.Dataset) -> None:
        nonlocal begun
        if engine == "scipy" and KEPT in result.attrs:  # SciPy's writer takes this name for its own variables
            result = result.copy(deep=False)
            result.attrs[f"kept_{KEPT}"] = result.attrs.pop(KEPT)
        if begun:
            _uninterrupted(_append, result, path)
        else:
            endless = ["position"] if in_parts else None
            try:
                made = result.to_netcdf(engine=engine, unlimited_dims=endless)
            except ValueError:  # of an xarray that cannot make it in memory
                result.to_netcdf(path, engine=engine, unlimited_dims=endless)
            else:  # by Python: where the disk is full, the HDF5 library takes the process with it
                path.write_bytes(made)
        begun = True

    yield add


def _uninterrupted(write: Callable[..., object], *arguments: object) -> None:
    """Write in a thread of its own, to its end: a signal raises in the main thread alone.

    Inside of HDF5 an exception ends the process, and Zarr goes on writing behind one.
    """
    with ThreadPoolExecutor(1) as thread:
        thread.submit(write, *arguments).result()


def _append(result: xr.Dataset, path: Path) -> None:
    """Further positions at the end of a NetCDF file, and what the result says now."""
    import h5netcdf

    with _Disk(path, "r+") as disk, h5netcdf.File(disk, "a") as file:
        before = file.dimensions["position"].size
        file.resize_dimension("position", before + result.sizes["position"])
        for name, variable in result.variables.items():
            if "position" in variable.dims:
                file.variables[str(name)][..., before:] = variable.values
        file.attrs.update(result.attrs)
    if disk.refused is not None:
        raise disk.refused


class _Disk(FileIO):
    """A file that notes that it cannot be written and takes what comes: at an error the HDF5 library ends the process.

    refused: the first error.
    """

    refused: OSError | None = None

    def write(self, data: ReadableBuffer, /) -> int:
        """Write all of it, or note why not."""
        left = memoryview(data).cast("B")
        size = left.nbytes
        with self._noting():
            while left:
                left = left[super().write(left) :]
        return size

    def truncate(self, size: int | None = None, /) -> int:
        """Set the size, or note why not."""
        with self._noting():
            return super().truncate(size)
        return size or 0

    @contextmanager
    def _noting(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            self.refused = self.refused or error


@contextmanager
def _zarr(path: Path, units_row: bool, columns: Columns, in_parts: bool) -> Iterator[Add]:
    path.unlink()  # a Zarr store is a folder
    begun = False

    def add(result: xr.Dataset) -> None:
        nonlocal begun
        own = [name for name, one in result.variables.items() if begun and "position" not in one.dims]
        along = "position" if begun else None
        rest = result.drop_vars(own)
        # format 3 has no stable text arrays yet
        _uninterrupted(lambda: rest.to_zarr(path, append_dim=along, zarr_format=2))
        begun = True

    yield add


@contextmanager
def _json(path: Path, units_row: bool, columns: Columns, in_parts: bool) -> Iterator[Add]:
    def add(result: xr.Dataset) -> None:
        data = result.to_dict()
        for section in ("coords", "data_vars"):
            for entry in data[section].values():
                entry["data"] = _plain(entry["data"])
        with path.open("w", encoding="utf-8") as file:
            json.dump(data, file, ensure_ascii=False, allow_nan=False)

    yield add


def _plain(value: Any) -> Any:
    """Nested lists with null in place of a number that is none: JSON has no NaN."""
    if isinstance(value, list):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


@contextmanager
def _xlsx(path: Path, units_row: bool, columns: Columns, in_parts: bool) -> Iterator[Add]:
    def add(result: xr.Dataset) -> None:
        tables = {name: columns(result, name) for name in KINDS[kind_of(result)]}
        write_workbook(path, tables, str(result.attrs.get("name", "")))

    yield add


Writer = Callable[[Path, bool, Columns, bool], AbstractContextManager[Add]]

# extension: writer, the package it needs and the extra that brings it
FORMATS: dict[str, tuple[Writer, str, str]] = {
    ".csv": (_csv, "", ""),
    ".json": (_json, "", ""),
    ".nc": (_netcdf, "", ""),
    ".zarr": (_zarr, "zarr", "zarr"),
    ".parquet": (_parquet, "pyarrow", "parquet"),
    ".xlsx": (_xlsx, "xlsxwriter", "xlsx"),
}
IN_PARTS = (".csv", ".nc", ".zarr", ".parquet")


def in_parts(path: str | os.PathLike[str]) -> bool:
    """Whether a file can be written some positions at a time."""
    suffix = Path(path).suffix.lower()
    return suffix in IN_PARTS and (suffix != ".nc" or _hdf())


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


def check_units(units: str) -> None:
    """MechanismError for units that tables are not written in."""
    if units not in UNITS:
        raise MechanismError(
            Finding(f"tables are not written in '{units}' units", "units", f"use {' or '.join(UNITS)}")
        )


def save(
    result: xr.Dataset,
    path: str | os.PathLike[str],
    units_row: bool = False,
    columns: Sequence[str] | None = None,
    units: str = "si",
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
    check_units(units)
    if units == "model" and kind_of(result) in BY_ROW:
        what = f"tables of a result of kind {kind_of(result)} name the unit in each row"
        raise MechanismError(Finding(what, "units", "write them in SI, without units='model'"))
    with saving(path, units_row, columns, units) as add:
        add(result)


@contextmanager
def saving(
    path: str | os.PathLike[str],
    units_row: bool = False,
    columns: Sequence[str] | None = None,
    units: str = "si",
    in_parts: bool = False,
) -> Iterator[Add]:
    """What writes a result by the file's extension, whole or not at all; see `save`.

    in_parts: a cycle, some positions at a time, one after the other; only in a format of IN_PARTS.
    """
    check_format(path)
    check_units(units)
    suffix = Path(path).suffix.lower()
    writer, _, _ = FORMATS[suffix]
    if suffix == ".zarr" and Path(path).is_dir():
        raise MechanismError(Finding("exists already", str(path), "remove it or choose another name"))

    def chosen(result: xr.Dataset, table: str) -> list[Column]:
        """The columns of a table; what was asked for holds for the one that the file is named for."""
        own = table_of(path, result)
        found = selected(result, columns if table in ("", own) else None, table or own)
        return in_model_units(result, found) if units == "model" else found

    with whole(path) as temporary, writer(temporary, units_row, chosen, in_parts) as add:
        yield add
