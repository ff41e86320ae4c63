"""The flat columns of every kind of result but cycles and motions: studies, measured courses, the test rig.

Of `compare`, `x.csv` has one row a position of a condition: `condition`, what was set, `phase`, the drive, `status`,
and of each channel `<channel>.measured`, `.scatter`, `.uncertainty`, `.expanded`, `.model`, `.residual`, `.compared`;
`x.figures.csv` one a channel in a condition: `rms`, `largest`, `bias`, `within`, `verdict`, …, and the efficiency. Of
`identify`, `x.csv` has one row a parameter, `x.fit.csv` one a channel and condition, `x.residuals.csv` one a position
of these. Of `tolerance`, `x.csv` has one row a measure, `x.parameters.csv` one a toleranced number, `x.positions.csv`
one a position, `x.histogram.csv` one a bin of a measure, `x.convergence.csv` one a number of samples; of `allocate`
`x.csv` has one row a toleranced number, and `x.offers.csv` one a point of cost over accuracy. All in SI, but for what
the drive of a tolerance is at: degrees, mm or s. A unit that is not one for a whole column is in the column `unit`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Status
from trunnion.results.attributes import attribute
from trunnion.results.dataset import UNITS_OF_EACH, Column, flat, unit_of, units_along
from trunnion.results.tables.cycle import status_column, time_column

if TYPE_CHECKING:
    import xarray as xr

COURSES = ("measured", "scatter", "uncertainty", "expanded", "model", "residual", "compared")
FIGURES = ("start", "estimate", "standard_uncertainty", "lower", "upper")
FITS = ("rms_before", "rms_after", "rms_expected", "held_out_before", "held_out_after", "held_out_expected")
COUNTS = ("turns", "used", "left_out", "held_out_turns")
CURVES = ("measured", "residual_before", "residual_after", "residual_uncertainty")
BY_MEASURE = ("sensitivity", "contribution_worst_case", "contribution_rss", "contribution_variance",
              "corner_lower", "corner_upper", "first_order", "first_order_low", "first_order_high", "total_order",
              "total_order_low", "total_order_high")  # fmt: skip
SHARES = (
    "yield", "used", "contribution_rss", "contribution_variance", "first_order", "total_order", "convergence_yield",
    "cp", "skewness", "kurtosis",
)  # fmt: skip
Table = Callable[[Any], list[Column]]


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
                result.attrs["drive_unit"] if unit_named == "drive" else unit_named,
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


def _pairs(result: xr.Dataset, along_positions: bool) -> list[Column]:
    """Of every channel and condition with data the figures, or its curves at every position that was measured."""
    pairs = np.argwhere(result["turns"].values + result["held_out_turns"].values > 0)
    if along_positions:
        measured = np.isfinite(result["measured"].values)
        rows = [(i, k, m) for i, k in pairs for m in np.flatnonzero(measured[i, k])]
        pairs = np.array(rows, np.intp).reshape(-1, 3)
    index = tuple(pairs.T)
    columns = [
        *(Column(dim, "", _texts(result[dim].values)[index[k]]) for k, dim in enumerate(("channel", "condition"))),
        Column("unit", "", _texts(attribute(result, "channel_units"))[index[0]]),
    ]
    if along_positions:
        columns.append(Column("phase", "1", result["phase"].values[index[1:]]))
    return [*columns, *(Column(key, "", result[key].values[index])
                        for key in (CURVES if along_positions else (*FITS, *COUNTS)))]  # fmt: skip


COMPARISON: dict[str, Table] = {"courses": _compared, "figures": _verdicts}
IDENTIFICATION: dict[str, Table] = {
    "parameters": _parameters,
    "fit": lambda result: _pairs(result, along_positions=False),
    "residuals": lambda result: _pairs(result, along_positions=True),
}


# ---- tolerances -----------------------------------------------------------------------------------------------


def _members(result: xr.Dataset, dim: str, variable: str) -> list[tuple[str, str]]:
    """Names along a dimension, each with the unit that a variable has there."""
    return list(zip(result[dim].values.astype(str).tolist(), units_along(result[variable], dim), strict=True))


def _subjects(result: xr.Dataset, dim: str, variable: str) -> list[Column]:
    names, units = zip(*_members(result, dim, variable), strict=True)
    return [Column(dim, "", np.array(names)), Column("unit", "", np.array(units))]


def _common(result: xr.Dataset, dim: str, variable: str) -> str:
    """The unit of all; empty if there are several."""
    units = set(units_along(result[variable], dim))
    return units.pop() if len(units) == 1 else ""


def _stated(variable: Any) -> str:
    """The unit of all of a variable; empty if there are several."""
    return "" if UNITS_OF_EACH in variable.attrs else str(variable.attrs.get("units", ""))


def _by(unit: str, other: str) -> str:
    return f"{unit}/{other}" if unit and other else ""


def _measures(result: xr.Dataset) -> list[Column]:
    """One row a measure: its figures; quantiles as `quantile_0.05`; limits and bounds as they are stated."""
    columns, stated = _subjects(result, "measure", "nominal"), list[Column]()
    for key, ends in (("limits", ("limit_lower", "limit_upper")), ("bounds", ("at_least", "at_most"))):
        pairs = attribute(result, key)
        for k, name in enumerate(ends if pairs else ()):
            column = [np.nan if pair is None or pair[k] is None else float(pair[k]) for pair in pairs]
            stated.append(Column(name, _common(result, "measure", "nominal"), np.array(column)))
    limited = np.any([np.isfinite(column.values) for column in stated], axis=0) if stated else True
    columns += stated
    for variable, array in result.data_vars.items():
        key = str(variable)
        if array.dims == ("measure",):
            values = np.where(limited, array.values, np.nan) if key.startswith("yield") else np.asarray(array.values)
            columns.append(Column(key, "1" if key.startswith(SHARES) else _stated(array), values))
        elif array.dims == ("measure", "quantile"):
            stem = key.replace("quantile_value", "quantile")
            levels = result["quantile"].values
            columns += [
                Column(f"{stem}_{at:g}", _stated(array), row) for at, row in zip(levels, array.values.T, strict=True)
            ]
    return columns


def _numbers(result: xr.Dataset) -> list[Column]:
    """One row a toleranced number; what is of a measure is `<measure>.sensitivity`, …."""
    columns = _subjects(result, "parameter", "parameter_nominal")
    for variable, array in result.data_vars.items():
        if array.dims == ("parameter",):
            columns.append(Column(str(variable).removeprefix("parameter_"), _stated(array), np.asarray(array.values)))
    unit_of_all = _common(result, "parameter", "parameter_nominal")
    for i, (measure, unit) in enumerate(_members(result, "measure", "nominal")):
        units = {"sensitivity": _by(unit, unit_of_all), "contribution_worst_case": unit, "corner_lower": unit_of_all,
                 "corner_upper": unit_of_all}  # fmt: skip
        keys = [key for key in BY_MEASURE if key in result]
        columns += [Column(f"{measure}.{key}", units.get(key, "1"), result[key].values[i]) for key in keys]
    return columns


def _positions(result: xr.Dataset) -> list[Column]:
    """One row a position: of each measure its curve, what the tolerances do to it, and its sensitivities.

    The unit of a course is not that of its figure: a dead centre is an angle of the drive.
    """
    columns = [Column(key, str(result[key].attrs.get("units", "")), result[key].values)
               for key in ("time", "drive") if key in result.coords]  # fmt: skip
    numbers = _members(result, "parameter", "parameter_nominal")
    for i, (measure, unit) in enumerate(_members(result, "measure", "curve")):
        for key, array in result.data_vars.items():
            name = str(key).replace("curve", "").strip("_")
            name = f"{measure}.{name}" if name else measure
            if array.dims == ("measure", "position"):
                columns.append(Column(name, unit, array.values[i]))
            elif array.dims == ("measure", "quantile", "position"):
                levels = result["quantile"].values
                columns += [Column(f"{name}_{level:g}", unit, array.values[i, k]) for k, level in enumerate(levels)]
            elif array.dims == ("measure", "parameter", "position"):
                end = str(key).removeprefix("curve_")
                parts = zip(numbers, array.values[i], strict=True)
                columns += [Column(f"{measure}.{path}.{end}", _by(unit, other), row) for (path, other), row in parts]
    return columns


def _histogram(result: xr.Dataset) -> list[Column]:
    """One row a bin of a measure: its edges and its count."""
    if "histogram" not in result:
        return [Column(name, "", np.empty(0)) for name in ("measure", "from", "to", "count")]
    counts, edges, unit = result["histogram"].values, result["edge"].values, _stated(result["edge"])
    return [
        Column("measure", "", np.repeat(result["measure"].values.astype(str), counts.shape[1])),
        Column("from", unit, edges[:, :-1].ravel()),
        Column("to", unit, edges[:, 1:].ravel()),
        Column("count", "1", counts.ravel()),
    ]


def _convergence(result: xr.Dataset) -> list[Column]:
    """One row a number of samples: mean, deviation and yield of each measure so far."""
    columns = flat(result, "convergence_samples", "samples") or [Column("samples", "1", np.empty(0))]
    for i, (measure, unit) in enumerate(_members(result, "measure", "nominal")):
        for key in (key for key in ("mean", "deviation", "yield") if f"convergence_{key}" in result):
            row = result[f"convergence_{key}"].values[i]
            columns.append(Column(f"{measure}.{key}", "1" if key == "yield" else unit, row))
    return columns


def _offers(result: xr.Dataset) -> list[Column]:
    """One row a point of cost over accuracy: what limits are multiplied by, the cost, and each tolerance."""
    if "trade_off_cost" not in result:
        return [Column(name, "1", np.empty(0)) for name in ("factor", "cost")]
    columns = [Column(key, "1", result[f"trade_off_{key}"].values) for key in ("factor", "cost")]
    for j, (path, unit) in enumerate(_members(result, "parameter", "parameter_nominal")):
        if result["bought"].values[j]:
            columns.append(Column(path, unit, result["trade_off_tolerance"].values[:, j]))
    return columns


TOLERANCE: Mapping[str, Table] = {
    "measures": _measures,
    "parameters": _numbers,
    "positions": _positions,
    "histogram": _histogram,
    "convergence": _convergence,
    "offers": _offers,
}
