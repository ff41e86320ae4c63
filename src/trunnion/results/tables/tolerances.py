"""The flat columns of a result of `tolerance` or `allocate`: tables, of which the file's name says which.

`x.csv` (or `x.measures.csv`) has one row a measure, `x.parameters.csv` one a toleranced number, `x.positions.csv` one
a position, `x.histogram.csv` one a bin of a measure, `x.convergence.csv` one a number of samples. Of an allocation
`x.csv` has one row a toleranced number, and `x.offers.csv` one a point of cost over accuracy. All in SI, but for what
the drive is at: degrees, mm or s. A unit that is not one for a whole column is in the column `unit`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.results.attributes import attribute
from trunnion.results.dataset import UNITS_OF_EACH, Column, units_along

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["TABLES"]

BY_MEASURE = ("sensitivity", "contribution_worst_case", "contribution_rss", "contribution_variance",
              "corner_lower", "corner_upper", "first_order", "first_order_low", "first_order_high", "total_order",
              "total_order_low", "total_order_high")  # fmt: skip
SHARES = (
    "yield", "used", "contribution_rss", "contribution_variance", "first_order", "total_order", "convergence_yield",
    "cp", "skewness", "kurtosis",
)  # fmt: skip


def _units(result: xr.Dataset) -> list[str]:
    return units_along(result["nominal"], "measure")


def _course_units(result: xr.Dataset) -> list[str]:
    """Of the course of each measure; that of a dead centre is no angle of the drive."""
    return units_along(result["curve"], "measure")


def _parameter_units(result: xr.Dataset) -> list[str]:
    return units_along(result["parameter_nominal"], "parameter")


def _common(units: list[str]) -> str:
    """The unit of all; empty if there are several."""
    return units[0] if len(set(units)) == 1 else ""


def _stated(variable: Any) -> str:
    """The unit of all of a variable; empty if there are several."""
    return "" if UNITS_OF_EACH in variable.attrs else str(variable.attrs.get("units", ""))


def _by(unit: str, other: str) -> str:
    return f"{unit}/{other}" if unit and other else ""


def _names(result: xr.Dataset, dim: str) -> list[str]:
    return [str(name) for name in result[dim].values]


def _measures(result: xr.Dataset) -> list[Column]:
    """One row a measure: its figures; quantiles as `quantile_0.05`; limits and bounds as they are stated."""
    columns: list[Column] = [
        Column("measure", "", np.array(_names(result, "measure"))),
        Column("unit", "", np.array(_units(result))),
    ]
    for key, ends in (("limits", ("limit_lower", "limit_upper")), ("bounds", ("at_least", "at_most"))):
        pairs = attribute(result, key)
        for k, name in enumerate(ends):
            column = [np.nan if pair is None or pair[k] is None else float(pair[k]) for pair in pairs]
            columns += [Column(name, _common(_units(result)), np.array(column))] if column else []
    limited = np.any([np.isfinite(column) for _, _, column in columns[2:]], axis=0) if len(columns) > 2 else True
    for variable, array in result.data_vars.items():
        key = str(variable)
        if array.dims == ("measure",):
            values = np.where(limited, array.values, np.nan) if key.startswith("yield") else np.asarray(array.values)
            columns.append(Column(key, "1" if key.startswith(SHARES) else _stated(array), values))
        elif array.dims == ("measure", "quantile"):
            levels = result["quantile"].values
            stem = key.replace("quantile_value", "quantile")
            columns += [
                Column(f"{stem}_{level:g}", _stated(array), array.values[:, k]) for k, level in enumerate(levels)
            ]
    return columns


def _parameters(result: xr.Dataset) -> list[Column]:
    """One row a toleranced number; what is of a measure is `<measure>.sensitivity`, …."""
    columns: list[Column] = [Column("parameter", "", np.array(_names(result, "parameter")))]
    columns.append(Column("unit", "", np.array(_parameter_units(result))))
    for variable, array in result.data_vars.items():
        if array.dims == ("parameter",):
            columns.append(Column(str(variable).removeprefix("parameter_"), _stated(array), np.asarray(array.values)))
    unit_of_all = _common(_parameter_units(result))
    for i, (measure, unit) in enumerate(zip(_names(result, "measure"), _units(result), strict=True)):
        units = {"sensitivity": _by(unit, unit_of_all), "contribution_worst_case": unit, "corner_lower": unit_of_all,
                "corner_upper": unit_of_all}  # fmt: skip
        keys = [key for key in BY_MEASURE if key in result]
        columns += [Column(f"{measure}.{key}", units.get(key, "1"), result[key].values[i]) for key in keys]
    return columns


def _positions(result: xr.Dataset) -> list[Column]:
    """One row a position: of each measure its curve, what the tolerances do to it, and its sensitivities."""
    columns: list[Column] = [Column(key, str(result[key].attrs.get("units", "")), result[key].values)
                   for key in ("time", "drive") if key in result.coords]  # fmt: skip
    numbers = list(zip(_names(result, "parameter"), _parameter_units(result), strict=True))
    for i, (measure, unit) in enumerate(zip(_names(result, "measure"), _course_units(result), strict=True)):
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
    counts, edges = result["histogram"].values, result["edge"].values
    names = np.repeat(_names(result, "measure"), counts.shape[1])
    low, high = (edges[:, part].ravel() for part in (slice(0, -1), slice(1, None)))
    unit = _stated(result["edge"])
    return [
        Column("measure", "", names),
        Column("from", unit, low),
        Column("to", unit, high),
        Column("count", "1", counts.ravel()),
    ]


def _convergence(result: xr.Dataset) -> list[Column]:
    """One row a number of samples: mean, deviation and yield of each measure so far."""
    columns: list[Column] = []
    if "convergence_samples" in result:
        columns.append(Column("samples", "1", result["convergence_samples"].values))
    for i, (measure, unit) in enumerate(zip(_names(result, "measure"), _units(result), strict=True)):
        for key in (key for key in ("mean", "deviation", "yield") if f"convergence_{key}" in result):
            row = result[f"convergence_{key}"].values[i]
            columns.append(Column(f"{measure}.{key}", "1" if key == "yield" else unit, row))
    return columns or [Column("samples", "1", np.empty(0))]


def _offers(result: xr.Dataset) -> list[Column]:
    """One row a point of cost over accuracy: what limits are multiplied by, the cost, and each tolerance."""
    if "trade_off_cost" not in result:
        return [Column(name, "1", np.empty(0)) for name in ("factor", "cost")]
    columns: list[Column] = [Column(key, "1", result[f"trade_off_{key}"].values) for key in ("factor", "cost")]
    for j, (path, unit) in enumerate(zip(_names(result, "parameter"), _parameter_units(result), strict=True)):
        if result["bought"].values[j]:
            columns.append(Column(path, unit, result["trade_off_tolerance"].values[:, j]))
    return columns


TABLES: dict[str, Callable[[Any], list[Column]]] = {
    "measures": _measures,
    "parameters": _parameters,
    "positions": _positions,
    "histogram": _histogram,
    "convergence": _convergence,
    "offers": _offers,
}
