"""Play in words: what each joint has in the worst case of a measure, as tables for the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from trunnion.results.attributes import attribute
from trunnion.results.dataset import units_along
from trunnion.results.quantities import quantity
from trunnion.results.scales import without_noise
from trunnion.views.common.cycle import Abscissa
from trunnion.views.table import Table

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Table", "abscissa_of", "tables"]

FLOATING = 3  # ends of a pin: two across and that of the float
SUMS = ("all, worst case, first order", "all, RSS", "all, standard deviation")
HEAD = ["joint", "play", "effect ±", "share"]


def tables(result: xr.Dataset) -> list[Table]:
    """For each measure: the joints with their play, effect and share at the place of the measure."""
    result = without_noise(result)
    units, places = units_along(result["value"], "measure"), attribute(result, "places")
    return [
        _table(result.isel(measure=i), str(name), unit, *place)
        for i, (name, unit, place) in enumerate(zip(result["measure"].values, units, places, strict=True))
    ]


def _table(result: xr.Dataset, name: str, unit: str, kind: str, where: str) -> Table:
    effects, deviations = (result[f"extreme_{key}"].values for key in ("worst_case", "deviation"))
    total, rows = float(np.sum(effects)), list[list[str]]()
    if not np.isfinite(total):
        return Table(f"{name}: not solved at {where}", HEAD, [])
    for j, (joint, effect) in enumerate(zip(result["joint"].values, effects, strict=True)):
        share = f"{100 * effect / total:.1f} %" if total > 0 else "—"
        rows.append([str(joint), _play(result, j), quantity(float(effect), unit), share])
    sums = total, np.sqrt(np.sum(effects**2)), np.sqrt(np.sum(deviations**2))
    for label, number in zip(SUMS, sums, strict=True):
        rows.append([label, "", quantity(float(number), unit), ""])
    return Table(f"{name}, {kind}{' ' * bool(kind)}at {where}", HEAD, rows)


def _play(result: xr.Dataset, j: int) -> str:
    """How far the pin of a joint can go to either side, its end float apart; nothing said of a float of 0."""
    radii = [float(radius) for radius in result["radius"].values[j] if np.isfinite(radius)]
    across, along = (radii[:2], radii[2:]) if len(radii) == FLOATING else (radii, [])
    found = [f"±{quantity(radius, 'm')}" for radius in dict.fromkeys(across)]
    return ", ".join([*found, *(f"float ±{quantity(radius, 'm')}" for radius in along if radius > 0)])


def abscissa_of(result: xr.Dataset) -> Abscissa:
    """The places of a result: the coordinate of the drive, or times."""
    values, unit, driver = result["drive"].values, result.attrs["drive_unit"], result.attrs["drive"]
    if not driver:
        return Abscissa("time", unit, values)
    step = float(values[1] - values[0]) if len(values) > 2 else 0.0
    turn = step * len(values)
    closed = bool(result.attrs["periodic"]) and unit == "°" and abs(abs(turn) - 360.0) < 1e-6 * 360.0
    return Abscissa(f"drive {'angle' if unit == '°' else 'slide'} {driver}", unit, values, closed, turn * closed)
