"""A result as a file: CSV, JSON, NetCDF, Zarr or Parquet, by extension.

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
number, see `results.columns.tolerances`; so it does of a comparison with measurements and of what `identify` finds, see
`results.columns.comparison` and `results.columns.identification`. What `assemble` finds has one row a position:
`<driver>.coordinate`, `needed_share`, `needed_clearance`, …, `<joint>.uniform_1_x` of end 1, …, `status`. Measured
courses have one row a condition and position: `condition`, what was set, `phase`, `<channel>.mean`, `.scatter`,
`.uncertainty`, `.turns`.
"""

from __future__ import annotations

import importlib.util
import json
import math
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Status
from trunnion.files import whole
from trunnion.joints.pairs import PAIRS
from trunnion.model.names import guarded
from trunnion.results.attributes import attribute
from trunnion.results.columns import tables_of

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

__all__ = ["FORMATS", "check_format", "columns", "figures", "save"]

ROWS = 20_000  # written at a time, so that memory does not grow with the number of positions

Column = tuple[str, str, Callable[[slice], NDArray[Any]]]


def columns(result: xr.Dataset, table: str = "measures") -> list[Column]:
    """(name, unit, values of a window of rows) of every flat column; table: which one, of a result of `tolerance`."""
    if (tables := tables_of(result)) is not None:
        return [(name, unit, values.__getitem__) for name, unit, values in tables.flat(result, table)]
    if "swept" in result.attrs:
        return [(name, unit, values.__getitem__) for name, (unit, values) in figures(result).items()]
    if "measure" in result.dims:
        return _played(result)
    if "assembling" in result.attrs:
        return _fit(result)
    if "measured" in result.attrs:
        return [(name, unit, values.__getitem__) for name, unit, values in _courses(result)]
    stated = attribute(result, "scene", "{}")
    spatial = stated.get("space") == "spatial"
    kinds = {name: joint["type"] for name, joint in stated["joints"].items()}
    found: list[Column] = [("time", "s", lambda window: result["time"].values[window])]
    for i, joint in enumerate(result["joint"].values):
        of_joint = _spatial_joint if spatial else _planar_joint
        found += of_joint(result, i, str(joint), kinds[str(joint)])
        found.append(_column(result, "friction_power", f"{joint}.friction_power", (i,)))
        found += _errors_of_joint(result, i, str(joint), kinds[str(joint)])
    found += _drivers(result) + _springs(result)
    for i, gear in enumerate(result["gear"].values if "gear" in result.dims else ()):
        found.append(_column(result, "gear_torque", f"{gear}.torque", (i,)))
        found += _vector(result, "gear_force", f"{gear}.force_", i)
    for i, link in enumerate(result["link"].values):
        found += _spatial_link(result, i, str(link)) if spatial else _planar_link(result, i, str(link))
    for i, point in enumerate(result["point"].values):
        found += _vector(result, "point_position", f"{point}.", i)
        if "point_error" in result:
            found += _vector(result, "point_error", f"{point}.error_", i)
    drive = result["drive_power"].values
    found.append(("power_in", "W", lambda window: drive[:, window].sum(axis=0)))
    found.append(_column(result, "useful_power", "power_useful", ()))
    if "seat_rounds" in result:
        found.append(_column(result, "seat_rounds", "seat_rounds", ()))
    names = np.array([status.name.lower() for status in Status])
    found.append(("status", "", lambda window: names[result["status"].values[window]]))
    return found


def _played(result: xr.Dataset) -> list[Column]:
    """Of the play of joints: each measure, its worst case, RSS, standard deviation, and each joint's part in them."""
    found: list[Column] = [("time", "s", lambda window: result["time"].values[window])]
    found.append(("drive", str(result["drive"].attrs["units"]), lambda window: result["drive"].values[window]))
    for i, (measure, unit) in enumerate(zip(result["measure"].values, attribute(result, "measure_units"), strict=True)):
        keys = {"value": "", "worst_case_total": ".worst_case", "rss": ".rss", "deviation_total": ".deviation"}
        parts: list[tuple[str, str, tuple[int, ...]]] = [(key, f"{measure}{end}", (i,)) for key, end in keys.items()]
        for j, joint in enumerate(result["joint"].values):
            parts += [(key, f"{measure}.{joint}.{key}", (i, j)) for key in ("worst_case", "deviation")]
        found += [(name, unit, _column(result, key, name, index)[2]) for key, name, index in parts]
    names = np.array([status.name.lower() for status in Status])
    found.append(("status", "", lambda window: names[result["status"].values[window]]))
    return found


def _fit(result: xr.Dataset) -> list[Column]:
    """Of whether a mechanism goes together: needs, openings, then offsets of the ends that have a play."""
    found: list[Column] = [("time", "s", lambda window: result["time"].values[window])]
    units = attribute(result, "coordinate_units")
    for i, (driver, unit) in enumerate(zip(result["driver"].values, units, strict=True)):
        _, _, values = _column(result, "drive_coordinate", "", (i,))
        found.append((f"{driver}.coordinate", unit, values))
    flat = [str(name) for name, one in result.data_vars.items() if one.dims == ("position",) and name != "status"]
    found += [_column(result, name, name, ()) for name in flat]
    joints, ends, axes = (result[dim].values for dim in ("joint", "end", "axis"))
    for kind in ("stated", "uniform"):
        offsets = result[f"{kind}_offset"]
        known = np.isfinite(offsets.values).any(axis=-1)
        for i, k, m in np.argwhere(known):
            found.append(_column(result, f"{kind}_offset", f"{joints[i]}.{kind}_{ends[k]}_{axes[m]}", (i, k, m)))
    names = dict(zip(result.attrs["flag_values"].split(), result.attrs["flag_meanings"].split(), strict=True))
    told = np.array([names[str(code)] for code in result["status"].values])
    return [*found, ("status", "", lambda window: told[window])]


def _courses(result: xr.Dataset) -> Iterator[tuple[str, str, NDArray[Any]]]:
    """Of measured courses: condition, what was set, share of the cycle, then each channel; positions run fastest."""
    positions = result.sizes["position"]
    yield "condition", "", np.repeat(result["condition"].values, positions)
    for i, name in enumerate(result["setting"].values):
        yield str(name), "", np.repeat(result["set"].values[:, i], positions)
    yield "phase", "1", np.tile(result["phase"].values, result.sizes["condition"])
    units = attribute(result["mean"], "member_units")
    for i, (channel, unit) in enumerate(zip(result["channel"].values, units, strict=True)):
        for figure in ("mean", "scatter", "uncertainty", "turns"):
            yield f"{channel}.{figure}", "1" if figure == "turns" else unit, result[figure].values[:, i].ravel()


def _planar_joint(result: xr.Dataset, i: int, joint: str, kind: str) -> list[Column]:
    slides = not PAIRS[kind].turns
    flat = [("joint_rotation", "rotation"), ("joint_rotation_velocity", "rotation_velocity")]
    flat += [("joint_slide", "slide"), ("joint_slide_velocity", "slide_velocity")] if slides else []
    found = [_column(result, variable, f"{joint}.{name}", (i,)) for variable, name in flat]
    found += _vector(result, "reaction_force", f"{joint}.reaction_", i)
    if slides:
        found.append(_column(result, "reaction_moment", f"{joint}.reaction_moment", (i,)))
        found.append(_column(result, "friction_force", f"{joint}.friction_force", (i,)))
    else:
        found.append(_column(result, "friction_torque", f"{joint}.friction_torque", (i,)))
    return found


def _spatial_joint(result: xr.Dataset, i: int, joint: str, kind: str) -> list[Column]:
    """Of a joint in space: its motion, force and moment of the reaction, friction along each freedom."""
    moves = {"rotation": PAIRS[kind].turns, "slide": PAIRS[kind].slides}
    found = [
        _column(result, f"joint_{motion}{rate}", f"{joint}.{motion}{rate}", (i,))
        for motion, there in moves.items()
        for rate in ("", "_velocity")
        if there
    ]
    found += _vector(result, "reaction_force", f"{joint}.reaction_", i)
    found += _vector(result, "reaction_moment", f"{joint}.reaction_moment_", i)
    freedoms = {"torque": moves["rotation"], "force": moves["slide"]}
    found += [
        _column(result, f"friction_{what}", f"{joint}.friction_{what}", (i,)) for what, is_ in freedoms.items() if is_
    ]
    return found


def _errors_of_joint(result: xr.Dataset, i: int, joint: str, kind: str) -> list[Column]:
    """Of a joint of a mechanism with errors: what moves it against the ideal one, and where its pin lies."""
    found: list[Column] = []
    if "joint_rotation_error" in result and (PAIRS[kind].turns or PAIRS[kind].angle):
        found.append(_column(result, "joint_rotation_error", f"{joint}.rotation_error", (i,)))
    if "joint_slide_error" in result and PAIRS[kind].slides:
        found.append(_column(result, "joint_slide_error", f"{joint}.slide_error", (i,)))
    if "reaction_force_change" in result:
        found += _vector(result, "reaction_force_change", f"{joint}.reaction_change_", i)
    if "seat_offset" not in result or not np.any(np.isfinite(result["seat_offset"].values[i])):
        return found
    for end, name in enumerate(result["end"].values):
        if np.any(np.isfinite(result["seat_offset"].values[i, end])):
            for variable, said in (
                ("seat_offset", "seat"),
                ("end_force", "end_force"),
                ("contact_position", "contact"),
            ):
                found += [
                    _column(result, variable, f"{joint}.{said}_{name}_{axis}", (i, end, k))
                    for k, axis in enumerate(result["axis"].values)
                ]
    found += [_column(result, f"seat_{angle}", f"{joint}.seat_{angle}", (i,)) for angle in ("beta", "xi", "xi_pin")]
    return [*found, _column(result, "contact_lost", f"{joint}.contact_lost", (i,))]


def _planar_link(result: xr.Dataset, i: int, link: str) -> list[Column]:
    variables = ("link_angle", "link_angle_velocity", "link_angle_acceleration")
    return [_column(result, one, f"{link}.{one.removeprefix('link_')}", (i,)) for one in variables]


def _spatial_link(result: xr.Dataset, i: int, link: str) -> list[Column]:
    """Pose of a link, origin and quaternion, and how it turns."""
    found = _vector(result, "link_position", f"{link}.", i)
    found += [_column(result, "link_rotation", f"{link}.rotation_{one}", (i, k)) for k, one in enumerate("wxyz")]
    for rate in ("velocity", "acceleration"):
        found += _vector(result, f"link_angular_{rate}", f"{link}.angular_{rate}_", i)
    return found


def _drivers(result: xr.Dataset) -> list[Column]:
    """Effort of each driver with the ends of its interval, in the unit of the driver."""
    found: list[Column] = []
    for i, (driver, unit) in enumerate(zip(result["driver"].values, attribute(result, "driver_units"), strict=True)):
        for end in ("", "_lower", "_upper"):
            name, _, values = _column(result, f"drive_effort{end}", f"{driver}.effort{end}", (i,))
            found.append((name, unit, values))
        if "drive_effort_change" in result:
            name, _, values = _column(result, "drive_effort_change", f"{driver}.effort_change", (i,))
            found.append((name, unit, values))
    return found


def _springs(result: xr.Dataset) -> list[Column]:
    found: list[Column] = []
    for i, spring in enumerate(result["spring"].values if "spring" in result.dims else ()):
        for variable, unit in zip(("force", "elongation"), attribute(result, "spring_units")[i], strict=True):
            name, _, values = _column(result, f"spring_{variable}", f"{spring}.{variable}", (i,))
            found.append((name, unit, values))
        found.append(_column(result, "spring_power", f"{spring}.spring_power", (i,)))
        found.append(_column(result, "damping_power", f"{spring}.damping_power", (i,)))
    return found


def _vector(result: xr.Dataset, variable: str, name: str, i: int) -> list[Column]:
    """The components of a vector: its name with each axis behind it."""
    return [_column(result, variable, f"{name}{axis}", (i, k)) for k, axis in enumerate(result["axis"].values)]


def _column(result: xr.Dataset, variable: str, name: str, index: tuple[int, ...]) -> Column:
    array = result[variable]
    values = array.values[index]
    return name, str(array.attrs["units"]), lambda window: values[window]


def figures(sweep: xr.Dataset) -> dict[str, tuple[str, NDArray[Any]]]:
    """(unit, values, one a point of the grid, the last name running fastest) of a sweep, by the name of the column."""
    swept = attribute(sweep, "swept")
    shape = tuple(sweep.sizes[name] for name in swept)
    efforts = attribute(sweep, "driver_units")
    grid = np.meshgrid(*(sweep[name].values for name in swept), indexing="ij")
    flat = {name: (str(sweep[name].attrs["units"]), axis.ravel()) for name, axis in zip(swept, grid, strict=True)}
    for name, figure in sweep.data_vars.items():
        unit, key = str(figure.attrs["units"]), str(name)
        subject = next((str(dim) for dim in figure.dims if dim not in swept), "")
        rows = figure.transpose(..., *swept).values.reshape(-1, int(np.prod(shape)))
        if not subject:
            flat[key] = (unit, rows[0])
        own = efforts if subject == "driver" else attribute(figure, "member_units")
        for i, member in enumerate(sweep[subject].values if subject else ()):
            flat[f"{member}.{key.removeprefix('drive_')}"] = (own[i] if own else unit, rows[i])
    flat["status"] = ("", np.array([status.name.lower() for status in Status])[flat["status"][1]])
    return flat


def frames(result: xr.Dataset, table: str = "measures") -> Iterator[pd.DataFrame]:
    """The flat columns, some rows at a time."""
    import pandas as pd

    found = columns(result, table)
    for low in range(0, _count(result, found), ROWS):
        window = slice(low, low + ROWS)
        yield pd.DataFrame({name: values(window) for name, _, values in found})


def _count(result: xr.Dataset, found: list[Column]) -> int:
    """How many rows the columns have; one at least, so that their names are written."""
    if tables_of(result) is not None:
        return max(len(found[0][2](slice(None))), 1)
    if "measured" in result.attrs:
        return result.sizes["condition"] * result.sizes["position"]
    swept = attribute(result, "swept")
    return result.sizes.get("position") or int(np.prod([result.sizes[name] for name in swept]))


def _guarded(frame: pd.DataFrame) -> pd.DataFrame:
    """The frame with no text that a spreadsheet would take for a formula."""
    frame = frame.rename(columns=guarded)
    for place, kind in enumerate(frame.dtypes):
        if kind.kind not in "fiub":
            name = frame.columns[place]
            frame[name] = [guarded(cell) if isinstance(cell, str) else cell for cell in frame[name]]
    return frame


def _csv(result: xr.Dataset, path: Path, units_row: bool, table: str) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        for number, frame in enumerate(map(_guarded, frames(result, table))):
            if number == 0:
                frame.head(0).to_csv(file, index=False)
                if units_row:
                    import csv

                    units = [guarded(unit) for _, unit, _ in columns(result, table)]
                    csv.writer(file, lineterminator="\n").writerow(units)
            frame.to_csv(file, index=False, header=False)


def _parquet(result: xr.Dataset, path: Path, units_row: bool, table: str) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    writer = None
    for frame in frames(result, table):
        rows = pa.Table.from_pandas(frame, preserve_index=False)
        writer = writer or pq.ParquetWriter(path, rows.schema)
        writer.write_table(rows)
    if writer:
        writer.close()


def _netcdf(result: xr.Dataset, path: Path, units_row: bool, table: str) -> None:
    modern = all(importlib.util.find_spec(package) for package in ("h5netcdf", "h5py"))
    engine: Literal["h5netcdf", "scipy"] = "h5netcdf" if modern else "scipy"
    try:
        made = result.to_netcdf(engine=engine)
    except ValueError:  # of an xarray that cannot make it in memory
        result.to_netcdf(path, engine=engine)
        return
    path.write_bytes(made)  # by Python: where the disk is full, the HDF5 library takes the process with it


def _zarr(result: xr.Dataset, path: Path, units_row: bool, table: str) -> None:
    path.unlink()  # a Zarr store is a folder
    try:
        result.to_zarr(path, zarr_format=2)  # version 3 has no stable text arrays yet
    except BaseException:
        shutil.rmtree(path, ignore_errors=True)
        raise


def _json(result: xr.Dataset, path: Path, units_row: bool, table: str) -> None:
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


Writer = Callable[["xr.Dataset", Path, bool, str], None]

# extension: writer, the package it needs and the extra that brings it
FORMATS: dict[str, tuple[Writer, str, str]] = {
    ".csv": (_csv, "", ""),
    ".json": (_json, "", ""),
    ".nc": (_netcdf, "", ""),
    ".zarr": (_zarr, "zarr", "zarr"),
    ".parquet": (_parquet, "pyarrow", "parquet"),
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


def save(result: xr.Dataset, path: str | os.PathLike[str], units_row: bool = False) -> None:
    """Write a result by the file's extension, whole or not at all.

    units_row: a second header row with the units (CSV). Raises MechanismError for an unknown extension, a missing
    package, or a place that cannot be written.
    """
    check_format(path)
    writer, _, _ = FORMATS[Path(path).suffix.lower()]
    if Path(path).suffix.lower() == ".zarr" and Path(path).is_dir():
        raise MechanismError(Finding("exists already", str(path), "remove it or choose another name"))
    with whole(path) as temporary:
        tables = tables_of(result)
        table = "" if tables is None else tables.table_of(path, result)
        writer(result, temporary, units_row, table)
