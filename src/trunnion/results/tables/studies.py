"""The flat columns of the results of `play`, `assemble` and `sweep`, and of measured courses."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Status
from trunnion.results.attributes import attribute
from trunnion.results.dataset import unit_of, units_along
from trunnion.results.tables.column import Column, column, status_column, time_column

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["courses", "fitted", "played", "swept"]


def played(result: xr.Dataset) -> list[Column]:
    """Of the play of joints: each measure, its worst case, RSS, standard deviation, and each joint's part in them."""
    found: list[Column] = [time_column(result)]
    found.append(("drive", str(result["drive"].attrs["units"]), lambda window: result["drive"].values[window]))
    for i, measure in enumerate(result["measure"].values):
        keys = {"value": "", "worst_case_total": ".worst_case", "rss": ".rss", "deviation_total": ".deviation"}
        parts: list[tuple[str, str, tuple[int, ...]]] = [(key, f"{measure}{end}", (i,)) for key, end in keys.items()]
        for j, joint in enumerate(result["joint"].values):
            parts += [(key, f"{measure}.{joint}.{key}", (i, j)) for key in ("worst_case", "deviation")]
        found += [column(result, *part) for part in parts]
    return [*found, status_column(result)]


def fitted(result: xr.Dataset) -> list[Column]:
    """Of whether a mechanism goes together: needs, openings, then offsets of the ends that have a play."""
    found: list[Column] = [time_column(result)]
    drivers = enumerate(result["driver"].values)
    found += [column(result, "drive_coordinate", f"{driver}.coordinate", (i,)) for i, driver in drivers]
    flat = [str(name) for name, one in result.data_vars.items() if one.dims == ("position",) and name != "status"]
    found += [column(result, name, name, ()) for name in flat]
    joints, ends, axes = (result[dim].values for dim in ("joint", "end", "axis"))
    for kind in ("stated", "uniform"):
        offsets = result[f"{kind}_offset"]
        known = np.isfinite(offsets.values).any(axis=-1)
        for i, k, m in np.argwhere(known):
            found.append(column(result, f"{kind}_offset", f"{joints[i]}.{kind}_{ends[k]}_{axes[m]}", (i, k, m)))
    names = dict(zip(result.attrs["flag_values"].split(), result.attrs["flag_meanings"].split(), strict=True))
    told = np.array([names[str(code)] for code in result["status"].values])
    return [*found, ("status", "", lambda window: told[window])]


def courses(result: xr.Dataset) -> Iterator[tuple[str, str, NDArray[Any]]]:
    """Of measured courses: condition, what was set, share of the cycle, then each channel; positions run fastest."""
    positions = result.sizes["position"]
    yield "condition", "", np.repeat(result["condition"].values, positions)
    for i, name in enumerate(result["setting"].values):
        yield str(name), "", np.repeat(result["set"].values[:, i], positions)
    yield "phase", "1", np.tile(result["phase"].values, result.sizes["condition"])
    units = units_along(result["mean"], "channel")
    for i, (channel, unit) in enumerate(zip(result["channel"].values, units, strict=True)):
        for figure in ("mean", "scatter", "uncertainty", "turns"):
            yield f"{channel}.{figure}", "1" if figure == "turns" else unit, result[figure].values[:, i].ravel()


def swept(sweep: xr.Dataset) -> dict[str, tuple[str, NDArray[Any]]]:
    """(unit, values, one a point of the grid, the last name running fastest) of a sweep, by the name of the column."""
    swept = attribute(sweep, "swept")
    shape = tuple(sweep.sizes[name] for name in swept)
    grid = np.meshgrid(*(sweep[name].values for name in swept), indexing="ij")
    flat = {name: (str(sweep[name].attrs["units"]), axis.ravel()) for name, axis in zip(swept, grid, strict=True)}
    for name, figure in sweep.data_vars.items():
        key = str(name)
        subject = next((str(dim) for dim in figure.dims if dim not in swept), "")
        rows = figure.transpose(..., *swept).values.reshape(-1, int(np.prod(shape)))
        if not subject:
            flat[key] = (unit_of(figure), rows[0])
            continue
        for member, unit, row in zip(sweep[subject].values, units_along(figure, subject), rows, strict=True):
            flat[f"{member}.{key.removeprefix('drive_')}"] = (unit, row)
    flat["status"] = ("", np.array([status.name.lower() for status in Status])[flat["status"][1]])
    return flat
