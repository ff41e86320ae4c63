"""The flat columns of the results of `play`, `assemble` and `sweep`, of measured courses, and of the test rig.

Of `compare`, `x.csv` has one row a position of a condition: `condition`, what was set, `phase`, the drive, `status`,
and of each channel `<channel>.measured`, `.scatter`, `.uncertainty`, `.expanded`, `.model`, `.residual`, `.compared`;
`x.figures.csv` one a channel in a condition: `rms`, `largest`, `bias`, `within`, `verdict`, …, and the efficiency. Of
`identify`, `x.csv` has one row a parameter, `x.fit.csv` one a channel and condition, `x.residuals.csv` one a position
of these. SI; a unit that is not one for a whole column is in the column `unit`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Status
from trunnion.results.attributes import attribute
from trunnion.results.dataset import Column, flat, unit_of, units_along
from trunnion.results.tables.cycle import status_column, time_column

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["COMPARISON", "CURVES", "IDENTIFICATION", "courses", "fitted", "played", "points", "swept"]

COURSES = ("measured", "scatter", "uncertainty", "expanded", "model", "residual", "compared")
FIGURES = ("start", "estimate", "standard_uncertainty", "lower", "upper")
FITS = ("rms_before", "rms_after", "rms_expected", "held_out_before", "held_out_after", "held_out_expected")
COUNTS = ("turns", "used", "left_out", "held_out_turns")
CURVES = ("measured", "residual_before", "residual_after", "residual_uncertainty")


def played(result: xr.Dataset) -> list[Column]:
    """Of the play of joints: each measure, its worst case, RSS, standard deviation, and each joint's part in them."""
    columns = [*time_column(result), *flat(result, "drive", "drive")]
    for i, measure in enumerate(result["measure"].values):
        keys = {"value": "", "worst_case_total": ".worst_case", "rss": ".rss", "deviation_total": ".deviation"}
        for key, end in keys.items():
            columns += flat(result, key, f"{measure}{end}", (i,))
        for j, joint in enumerate(result["joint"].values):
            for key in ("worst_case", "deviation"):
                columns += flat(result, key, f"{measure}.{joint}.{key}", (i, j))
    return [*columns, status_column(result)]


def fitted(result: xr.Dataset) -> list[Column]:
    """Of whether a mechanism goes together: needs, openings, then offsets of the ends that have a play."""
    columns = time_column(result)
    for i, driver in enumerate(result["driver"].values):
        columns += flat(result, "drive_coordinate", f"{driver}.coordinate", (i,))
    for name, variable in result.data_vars.items():
        if variable.dims == ("position",) and name != "status":
            columns += flat(result, str(name), str(name))
    joints, ends, axes = (result[dim].values for dim in ("joint", "end", "axis"))
    for kind in ("stated", "uniform"):
        offsets = result[f"{kind}_offset"]
        for i, k, m in np.argwhere(np.isfinite(offsets.values).any(axis=-1)):
            columns += flat(result, f"{kind}_offset", f"{joints[i]}.{kind}_{ends[k]}_{axes[m]}", (i, k, m))
    return [*columns, Column("status", "", _words(result, "flag", result["status"].values))]


def _words(result: xr.Dataset, what: str, codes: NDArray[Any]) -> NDArray[Any]:
    """Codes in words."""
    values, names = (result.attrs[f"{what}_{part}"].split() for part in ("values", "meanings"))
    words = dict(zip((int(value) for value in values), names, strict=True))
    return np.array([words[int(code)] for code in codes.ravel()], dtype=object)


def swept(sweep: xr.Dataset) -> dict[str, tuple[str, NDArray[Any]]]:
    """(unit, values, one a point of the grid, the last name running fastest) of a sweep, by the name of the column."""
    names = attribute(sweep, "swept")
    grid = np.meshgrid(*(sweep[name].values for name in names), indexing="ij")
    columns = {name: (str(sweep[name].attrs["units"]), axis.ravel()) for name, axis in zip(names, grid, strict=True)}
    for name, figure in sweep.data_vars.items():
        key = str(name)
        subject = next((str(dim) for dim in figure.dims if dim not in names), "")
        rows = figure.transpose(..., *names).values.reshape(-1, grid[0].size)
        if not subject:
            columns[key] = (unit_of(figure), rows[0])
            continue
        for member, unit, row in zip(sweep[subject].values, units_along(figure, subject), rows, strict=True):
            columns[f"{member}.{key.removeprefix('drive_')}"] = (unit, row)
    columns["status"] = ("", np.array([status.name.lower() for status in Status])[columns["status"][1]])
    return columns


def points(result: xr.Dataset) -> list[Column]:
    """Of a sweep, one row a point of its grid."""
    return [Column(name, unit, values) for name, (unit, values) in swept(result).items()]


# ---- the test rig ---------------------------------------------------------------------------------------------


def courses(result: xr.Dataset) -> list[Column]:
    """Of measured courses: condition, what was set, share of the cycle, then each channel; positions run fastest."""
    positions = result.sizes["position"]
    columns = [Column("condition", "", np.repeat(result["condition"].values, positions))]
    for i, name in enumerate(result["setting"].values):
        columns.append(Column(str(name), "", np.repeat(result["set"].values[:, i], positions)))
    columns.append(Column("phase", "1", np.tile(result["phase"].values, result.sizes["condition"])))
    units = units_along(result["mean"], "channel")
    for i, (channel, unit) in enumerate(zip(result["channel"].values, units, strict=True)):
        for figure in ("mean", "scatter", "uncertainty", "turns"):
            own_unit = "1" if figure == "turns" else unit
            columns.append(Column(f"{channel}.{figure}", own_unit, result[figure].values[:, i].ravel()))
    return columns


def _conditions(result: xr.Dataset, times: int) -> list[Column]:
    """Each condition so many times over, with what was set."""
    columns = [Column("condition", "", np.repeat(result["condition"].values.astype(object), times))]
    names, units = result["set"].values, attribute(result, "set_units")
    for name, unit, row in zip(names, units, result["value"].values, strict=True):
        columns.append(Column(str(name), unit, np.repeat(row, times)))
    return columns


def _compared(result: xr.Dataset) -> list[Column]:
    measured = np.isfinite(result["phase"].values).ravel()
    columns = _conditions(result, result.sizes["position"])
    columns.append(Column("phase", "1", result["phase"].values.ravel()))
    columns.append(Column("drive", str(result.attrs["drive_unit"]), result["drive"].values.ravel()))
    columns.append(Column("status", "", _words(result, "flag", result["status"].values)))
    for i, (channel, unit) in enumerate(zip(result["channel"].values, attribute(result, "channel_units"), strict=True)):
        for name in COURSES:
            own_unit = "1" if name == "compared" else unit
            columns.append(Column(f"{channel}.{name}", own_unit, result[name].values[i].ravel()))
    return [column._replace(values=column.values[measured]) for column in columns]


def _verdicts(result: xr.Dataset) -> list[Column]:
    channels, conditions = result.sizes["channel"], result.sizes["condition"]
    units = np.array([str(unit) for unit in attribute(result, "channel_units")], dtype=object)
    columns = _conditions(result, channels)
    columns.append(Column("channel", "", np.tile(result["channel"].values.astype(object), conditions)))
    columns.append(Column("unit", "", np.tile(units, conditions)))
    for name, variable in result.data_vars.items():
        unit_named = str(variable.attrs["units"])
        if variable.dims == ("channel", "condition"):
            unit, values = (
                str(result.attrs["drive_unit"]) if unit_named == "drive" else unit_named,
                variable.values.T.ravel(),
            )
            columns.append(Column(str(name), unit, _words(result, "verdict", values) if name == "verdict" else values))
        elif variable.dims == ("condition",):
            columns.append(Column(str(name), unit_named, np.repeat(variable.values, channels)))
    return columns


def _texts(values: Any) -> NDArray[Any]:
    return np.asarray(values, dtype=str)


def _parameters(result: xr.Dataset) -> list[Column]:
    names = _texts(result["parameter"].values)
    columns = [
        Column("parameter", "", names),
        Column("paths", "", _texts([" ".join(paths) for paths in attribute(result, "parameter_paths")])),
        Column("unit", "", _texts(attribute(result, "parameter_units"))),
        *(Column(key, "", result[key].values) for key in FIGURES),
        *(Column(key, "1", result[key].values) for key in ("degrees_of_freedom", "limit", "told")),
    ]
    for what, labels in (("correlation", names), ("share", _texts(result["source"]))):
        columns += [Column(f"{what}.{name}", "1", result[what].values[:, k]) for k, name in enumerate(labels)]
    return columns


def _of_pairs(result: xr.Dataset, pairs: NDArray[np.intp]) -> list[Column]:
    """The subjects of some pairs of channel and condition, (pair, 2)."""
    channel, condition = pairs[:, 0], pairs[:, 1]
    return [
        Column("channel", "", _texts(result["channel"].values)[channel]),
        Column("condition", "", _texts(result["condition"].values)[condition]),
        Column("unit", "", _texts(attribute(result, "channel_units"))[channel]),
    ]


def _pairs(result: xr.Dataset) -> NDArray[np.intp]:
    """(channel, condition) of which there are data, (pair, 2)."""
    return np.asarray(np.argwhere(result["turns"].values + result["held_out_turns"].values > 0))


def _fits(result: xr.Dataset) -> list[Column]:
    pairs = _pairs(result)
    figures = [Column(key, "", result[key].values[tuple(pairs.T)]) for key in (*FITS, *COUNTS)]
    return [*_of_pairs(result, pairs), *figures]


def _residuals(result: xr.Dataset) -> list[Column]:
    measured = result["measured"].values
    rows = [(i, k, m) for i, k in _pairs(result) for m in np.flatnonzero(np.isfinite(measured[i, k]))]
    index = np.array(rows, np.intp).reshape(-1, 3)
    phase = Column("phase", "1", result["phase"].values[index[:, 1], index[:, 2]])
    return [*_of_pairs(result, index), phase, *(Column(key, "", result[key].values[tuple(index.T)]) for key in CURVES)]


COMPARISON = {"courses": _compared, "figures": _verdicts}
IDENTIFICATION = {"parameters": _parameters, "fit": _fits, "residuals": _residuals}
