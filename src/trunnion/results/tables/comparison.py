"""The flat columns of a result of `compare`: tables, of which the file's name says which.

`x.csv` has one row a position of a condition: `condition`, what was set, `phase`, the drive, `status`, and of each
channel `<channel>.measured`, `.scatter`, `.uncertainty`, `.expanded`, `.model`, `.residual`, `.compared`.
`x.figures.csv` has one row a channel in a condition: `rms`, `largest`, `bias`, `within`, `verdict`, …, and the
efficiency. SI.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.results.attributes import attribute

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["TABLES"]

Flat = list[tuple[str, str, NDArray[Any]]]
COURSES = ("measured", "scatter", "uncertainty", "expanded", "model", "residual", "compared")


def _named(result: xr.Dataset, what: str, codes: NDArray[Any]) -> NDArray[Any]:
    """Codes in words."""
    values, names = (result.attrs[f"{what}_{part}"].split() for part in ("values", "meanings"))
    words = dict(zip((int(value) for value in values), names, strict=True))
    return np.array([words[int(code)] for code in codes.ravel()], dtype=object)


def _set(result: xr.Dataset, times: int) -> Flat:
    """What was set, each condition so many times over."""
    units = attribute(result, "set_units")
    rows = result["value"].values
    return [
        (str(name), unit, np.repeat(rows[i], times))
        for i, (name, unit) in enumerate(zip(result["set"].values, units, strict=True))
    ]


def _courses(result: xr.Dataset) -> Flat:
    there = np.isfinite(result["phase"].values).ravel()
    positions = result.sizes["position"]
    found: Flat = [("condition", "", np.repeat(result["condition"].values.astype(object), positions))]
    found += _set(result, positions)
    found.append(("phase", "1", result["phase"].values.ravel()))
    found.append(("drive", str(result.attrs["drive_unit"]), result["drive"].values.ravel()))
    found.append(("status", "", _named(result, "flag", result["status"].values)))
    for i, (channel, unit) in enumerate(zip(result["channel"].values, attribute(result, "channel_units"), strict=True)):
        for name in COURSES:
            own = "1" if name == "compared" else unit
            found.append((f"{channel}.{name}", own, result[name].values[i].ravel()))
    return [(name, unit, values[there]) for name, unit, values in found]


def _figures(result: xr.Dataset) -> Flat:
    channels, conditions = result.sizes["channel"], result.sizes["condition"]
    units = [str(unit) for unit in attribute(result, "channel_units")]

    def by_condition(values: NDArray[Any]) -> NDArray[Any]:
        return values.T.ravel()

    found: Flat = [("condition", "", np.repeat(result["condition"].values.astype(object), channels))]
    found += _set(result, channels)
    found.append(("channel", "", np.tile(result["channel"].values.astype(object), conditions)))
    found.append(("unit", "", np.tile(np.array(units, dtype=object), conditions)))
    for name, one in result.data_vars.items():
        if one.dims == ("channel", "condition"):
            values = by_condition(one.values)
            stated = str(one.attrs["units"])
            unit = str(result.attrs["drive_unit"]) if stated == "drive" else stated
            found.append((str(name), unit, _named(result, "verdict", values) if name == "verdict" else values))
        elif one.dims == ("condition",):
            found.append((str(name), str(one.attrs["units"]), np.repeat(one.values, channels)))
    return found


TABLES = {"courses": _courses, "figures": _figures}
