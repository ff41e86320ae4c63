"""One position of a cycle in its figures: which one a place names, and how curves mark it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.model.quantity import Quantity
from trunnion.model.units import ANY, KINDS, UnitError
from trunnion.views.common.cycle import abscissa
from trunnion.views.common.figures import INK
from trunnion.views.common.lettering import plain

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["OVER_DRIVE", "mark", "position_at"]

# kinds of figures all of whose panels are over the drive
OVER_DRIVE = (
    "torque",
    "speed",
    "friction-power",
    "reactions",
    "power",
    "motion",
    "error",
    "beta",
    "locking",
    "measures",
)
LONGEST = 1.5  # steps: a place further from every position is not one of the cycle
KIND_OF = {"°": KINDS["angle"], "mm": KINDS["length"], "s": KINDS["time"]}


def position_at(result: xr.Dataset, place: str | float) -> int:
    """The number of the position nearest to a place: a coordinate of the drive, or a time with its unit.

    A number without unit is SI. MechanismError of a text that names no place, or of one beyond the cycle.
    """
    try:
        quantity = Quantity.read(place, ANY)
        if quantity.names:
            raise UnitError(f"'{place}' is no place", "write 60deg, 20mm or 0.1s")
        timed = isinstance(place, str) and quantity.check({}) == KINDS["time"].dimensions[0]
        unit = str(result["drive"].attrs["units"]) if "drive" in result.coords and not timed else "s"
        kind = KIND_OF.get(unit, KINDS["time"])
        value = float(np.asarray(Quantity.read(place, kind).evaluate()))
    except UnitError as error:
        raise MechanismError(Finding(error.what, "--at", error.remedy or "write 60deg, 20mm or 0.1s")) from None
    values = np.asarray(result["time" if unit == "s" else "drive"].values, dtype=float)
    wanted = value * {"°": 180 / np.pi, "mm": 1e3}.get(unit, 1.0)
    return _nearest(result, values, wanted, unit)


def _nearest(result: xr.Dataset, values: np.ndarray, wanted: float, unit: str) -> int:
    away = np.abs(values - wanted)
    if unit == "°" and result.attrs.get("periodic"):  # the same place after each turn
        away = np.abs((values - wanted + 180) % 360 - 180)
    step = abs(float(values[1] - values[0])) if values.size > 1 else np.inf
    if not np.min(away) <= LONGEST * step:
        low, high = float(np.min(values)), float(np.max(values))
        what = f"{wanted:.4g}{unit} is not in the cycle"
        raise MechanismError(Finding(what, "--at", f"name a place from {low:.4g}{unit} to {high:.4g}{unit}"))
    return int(np.argmin(away))


def mark(figure: Figure, result: xr.Dataset, index: int) -> Figure:
    """The figure with a line at a position in every panel over the drive, named in the first."""
    over = abscissa(result)
    x = float(over.values[index])
    for number, axes in enumerate(figure.axes):
        axes.axvline(x, color=INK, linewidth=1.0, linestyle=(0, (4, 2, 1, 2)), zorder=2.5)
        if number == 0:
            box = {"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}
            axes.annotate(
                plain(over.say(index)), (x, 0.0), xycoords=axes.get_xaxis_transform(), xytext=(4, 4),
                textcoords="offset points", fontsize=8, color=INK, bbox=box, zorder=5,
            )  # fmt: skip
    return figure
