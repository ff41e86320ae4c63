"""The flat columns of a result of `identify`: tables, of which the file's name says which.

`x.csv` has one row a parameter, `x.fit.csv` one a channel and condition, `x.residuals.csv` one a position of these. All
in SI; a unit that is not one for a whole column is in the column `unit`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.results.attributes import attribute

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["CURVES", "TABLES"]

Flat = list[tuple[str, str, NDArray[Any]]]
FIGURES = ("start", "estimate", "standard_uncertainty", "lower", "upper")
FITS = ("rms_before", "rms_after", "rms_expected", "held_out_before", "held_out_after", "held_out_expected")
COUNTS = ("turns", "used", "left_out", "held_out_turns")
CURVES = ("measured", "residual_before", "residual_after", "residual_uncertainty")


def _texts(values: Any) -> NDArray[Any]:
    return np.asarray(values, dtype=str)


def _parameters(result: xr.Dataset) -> Flat:
    names = _texts(result["parameter"].values)
    found: Flat = [
        ("parameter", "", names),
        ("paths", "", _texts([" ".join(one) for one in attribute(result, "parameter_paths")])),
        ("unit", "", _texts(attribute(result, "parameter_units"))),
        *((key, "", result[key].values) for key in FIGURES),
        ("degrees_of_freedom", "1", result["degrees_of_freedom"].values),
        ("limit", "1", result["limit"].values),
        ("told", "1", result["told"].values),
    ]
    found += [(f"correlation.{name}", "1", result["correlation"].values[:, q]) for q, name in enumerate(names)]
    shares = result["share"].values
    return found + [(f"share.{name}", "1", shares[:, s]) for s, name in enumerate(_texts(result["source"].values))]


def _pairs(result: xr.Dataset) -> NDArray[np.intp]:
    """(channel, condition) of which there are data, (pair, 2)."""
    there = result["turns"].values + result["held_out_turns"].values > 0
    return np.asarray(np.argwhere(there))


def _subjects(result: xr.Dataset, pairs: NDArray[np.intp]) -> Flat:
    units = _texts(attribute(result, "channel_units"))
    return [
        ("channel", "", _texts(result["channel"].values)[pairs[:, 0]]),
        ("condition", "", _texts(result["condition"].values)[pairs[:, 1]]),
        ("unit", "", units[pairs[:, 0]]),
    ]


def _fits(result: xr.Dataset) -> Flat:
    pairs = _pairs(result)
    found = _subjects(result, pairs)
    return found + [(key, "", result[key].values[pairs[:, 0], pairs[:, 1]]) for key in (*FITS, *COUNTS)]


def _residuals(result: xr.Dataset) -> Flat:
    measured = result["measured"].values
    pairs = _pairs(result)
    rows = [(i, k, m) for i, k in pairs for m in np.flatnonzero(np.isfinite(measured[i, k]))]
    index = np.array(rows, np.intp).reshape(-1, 3)
    found = _subjects(result, index)
    found.append(("phase", "1", result["phase"].values[index[:, 1], index[:, 2]]))
    return found + [(key, "", result[key].values[tuple(index.T)]) for key in CURVES]


TABLES = {"parameters": _parameters, "fit": _fits, "residuals": _residuals}
