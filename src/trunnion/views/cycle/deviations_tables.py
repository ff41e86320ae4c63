"""The tables of a report that say what errors do: as built beside ideal, and where pins lose contact."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from trunnion.results.attributes import units_of
from trunnion.results.dataset import units_along
from trunnion.results.quantities import Units, number, quantity
from trunnion.results.scales import without_noise
from trunnion.views.common.cycle import Abscissa, Array, abscissa, column, mean_friction, names, valid
from trunnion.views.cycle.deviations import losses, outputs, worst_points

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["error_rows", "loss_rows"]

MOST_PLACES = 12
Row = dict[str, str]


def error_rows(result: xr.Dataset) -> list[Row]:
    """Label, as built, ideal, difference and place of what errors change; none of a mechanism without errors."""
    if "point_error" not in result:
        return []
    result = without_noise(result)
    over = abscissa(result)
    rows = [
        _error(f"Position error of {key}, largest", valid(result, error), "m", over)
        for key, error in worst_points(result).items()
    ]
    rows += [
        _error(f"Transmission error, {one.label}, largest", valid(result, one.error), one.unit, over)
        for one in outputs(result)
    ]
    for driver, unit in zip(names(result, "driver"), units_along(result["drive_effort"], "driver"), strict=True):
        noun = "force" if unit == "N" else "torque"
        rows.append(_change(result, "drive_effort", "driver", driver, f"Drive {noun} of {driver}, largest", unit, over))
    changes = [_change(result, "reaction_force", "joint", joint, f"Reaction of {joint}, largest", "N", over)
               for joint in names(result, "joint")]  # fmt: skip
    return [*rows, *changes, _mean_friction(result), _efficiency(result)]


def _row(label: str, built: str, ideal: str, difference: str, place: str = "") -> Row:
    return {"label": label, "built": built, "ideal": ideal, "difference": difference, "place": place}


def _error(label: str, error: Array, unit: str, over: Abscissa) -> Row:
    """The largest of an error, which the ideal mechanism has not."""
    if not np.isfinite(error).any():
        return _row(label, "", "", "—")
    index = int(np.nanargmax(np.abs(error)))
    value = float(error[index])
    return _row(label, "", "", quantity(value, unit), over.say(index))


def _change(result: xr.Dataset, name: str, dim: str, member: str, label: str, unit: str, over: Abscissa) -> Row:
    """The largest magnitude of a result as built and ideal, and where it is as built."""
    built, change = column(result, name, **{dim: member}), column(result, f"{name}_change", **{dim: member})
    if built is None or change is None or not np.isfinite(built).any():
        return _row(label, "—", "—", "—")
    columns = (built, built - change)
    sizes = [valid(result, np.abs(one) if one.ndim == 1 else np.linalg.norm(one, axis=0)) for one in columns]
    if not np.isfinite(sizes[0]).any():
        return _row(label, "—", "—", "—")
    index = int(np.nanargmax(sizes[0]))
    most = [float(np.nanmax(size)) if np.isfinite(size).any() else float("nan") for size in sizes]
    units = units_of(result)
    built_as, ideally = (quantity(one, unit, units) for one in most)
    return _row(label, built_as, ideally, _signed(most[0] - most[1], unit, units), over.say(index))


def _signed(value: float, unit: str, units: Units | None = None) -> str:
    return ("+" if value > 0 else "") + quantity(value, unit, units)


def _mean_friction(result: xr.Dataset) -> Row:
    joints = names(result, "joint")
    one, two = (sum(mean_friction(result, joint, of) for joint in joints) for of in ("", "_ideal"))
    if not np.isfinite([one, two]).all():
        return _row("Friction power, mean", "—", "—", "—")
    units = units_of(result)
    figures = quantity(one, "W", units), quantity(two, "W", units), _signed(one - two, "W", units)
    return _row("Friction power, mean", *figures)


def _efficiency(result: xr.Dataset) -> Row:
    one, two = (column(result, name) for name in ("efficiency", "efficiency_ideal"))
    told = [float("nan") if value is None else float(value) for value in (one, two)]
    return _row("Efficiency of the cycle", number(told[0]), number(told[1]), _signed(told[0] - told[1], "1"))


def loss_rows(result: xr.Dataset) -> list[Row]:
    """Joints that lose contact, with the positions, and the largest contact loss number."""
    over, rows = abscissa(result), []
    for joint, places in losses(result).items():
        shown = ", ".join(over.say(int(index)) for index in places[:MOST_PLACES])
        more = len(places) - MOST_PLACES
        rates = column(result, "contact_loss_number", joint=joint)
        known = rates is not None and np.isfinite(rates).any()
        most = f"{number(float(np.nanmax(rates)), 3)}\u00a0rad/(N\u00a0s)" if rates is not None and known else "—"
        rows.append({"joint": joint, "places": f"{shown} and {more} more" if more > 0 else shown, "number": most})
    return rows
