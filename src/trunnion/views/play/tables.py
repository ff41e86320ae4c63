"""Play in words: what each joint has in the worst case of a measure, as tables for the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from trunnion.results.attributes import attribute
from trunnion.results.dataset import units_along
from trunnion.results.quantities import quantity
from trunnion.results.scales import without_noise
from trunnion.studies.play.result import relied_on
from trunnion.views.common.cycle import Abscissa, Array
from trunnion.views.common.table import TextTable

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["TextTable", "abscissa_of", "tables"]

FLOATING = 3  # ends of a pin: two across and that of the float
SUMS = ("all, worst case, first order", "all, RSS", "all, standard deviation")
HEAD = ["joint", "play", "largest effect ±", "at", "share"]


def tables(result: xr.Dataset) -> list[TextTable]:
    """For each measure: the joints with their play, largest effect and where, and share in the largest worst case."""
    result = without_noise(result)
    units, over = units_along(result["value"], "measure"), abscissa_of(result)
    return [
        _table_there(result.isel(measure=i), str(name), unit, *there)
        if there
        else _table(result.isel(measure=i), over, str(name), unit)
        for i, (name, unit, there) in enumerate(zip(result["measure"].values, units, _extremes(result), strict=True))
    ]


def _table(result: xr.Dataset, over: Abscissa, name: str, unit: str) -> TextTable:
    total = _relied_on(result, "worst_case_total")
    if not np.isfinite(total).any():
        return TextTable(f"{name}: no position is solved", HEAD, [])
    top, rows, effects = int(np.nanargmax(total)), list[list[str]](), _relied_on(result, "worst_case")
    for j, joint in enumerate(result["joint"].values):
        effect = effects[j]
        where = over.say(int(np.nanargmax(effect))) if np.nanmax(effect) > 0 else "—"
        share = f"{100 * effect[top] / total[top]:.1f} %" if total[top] > 0 else "—"
        rows.append([str(joint), _play(result, j), quantity(float(np.nanmax(effect)), unit), where, share])
    for label, key in zip(SUMS, ("worst_case_total", "rss", "deviation_total"), strict=True):
        row = _relied_on(result, key)
        best = int(np.nanargmax(row))
        rows.append([label, "", quantity(float(row[best]), unit), over.say(best), ""])
    low, high = (quantity(float(pick(result["value"].values)), unit) for pick in (np.nanmin, np.nanmax))
    course = f"from {low} to {high}" if result.sizes["position"] > 1 else low
    return TextTable(f"{name}, {course}; shares are at {over.say(top)}", HEAD, rows)


def _extremes(result: xr.Dataset) -> list[list[str]]:
    """Of each measure the word for its extreme and where it is; empty of others, and in results of before."""
    return attribute(result, "extremes") if "extremes" in result.attrs else [[]] * result.sizes["measure"]


def _table_there(result: xr.Dataset, name: str, unit: str, word: str, where: str) -> TextTable:
    """The same of a measure that is a maximum or minimum, or at a stated place: all effects are those there."""
    effects, deviations = (result[f"extreme_{key}"].values for key in ("worst_case", "deviation"))
    total, rows = float(np.sum(effects)), list[list[str]]()
    for j, (joint, effect) in enumerate(zip(result["joint"].values, effects, strict=True)):
        share = f"{100 * effect / total:.1f} %" if total > 0 else "—"
        rows.append([str(joint), _play(result, j), quantity(float(effect), unit), where, share])
    sums = total, np.sqrt(np.sum(effects**2)), np.sqrt(np.sum(deviations**2))
    for label, number in zip(SUMS, sums, strict=True):
        rows.append([label, "", quantity(float(number), unit), where, ""])
    title = f"{name}, at {where}" if word == "value" else f"{name}: the {word}, at {where}"
    return TextTable(title, ["joint", "play", "effect ±", "at", "share"], rows)


def _relied_on(result: xr.Dataset, name: str) -> Array:
    return relied_on(result[name].values, result["status"].values)


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
