"""Play in figure and table: the worst case of a measure over the turn, and what each joint has in it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.results.attributes import attribute
from trunnion.results.quantities import prefixed, quantity
from trunnion.studies.play.result import relied_on
from trunnion.views.common.cycle import Abscissa, Array, thin
from trunnion.views.common.figures import INK, PALETTE, along, frame_peak, legend, new, shade
from trunnion.views.common.lettering import plain
from trunnion.views.common.peaks import ease, usual_peak
from trunnion.views.common.table import TextTable

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["MOST_PANELS", "TextTable", "figure", "tables"]

MOST_PANELS = 6
PANEL = 3.3  # height, inches
FLOATING = 3  # ends of a pin: two across and that of the float
HATCHES = ("", "//", "..", "xx")


def figure(result: xr.Dataset) -> Figure:
    """A panel for each measure: the joints' worst cases on top of one another, their RSS dashed."""
    over, names = _over(result), result["measure"].values[:MOST_PANELS]
    sheet = new("Effect of the play of the joints", result, height=1.0 + PANEL * len(names))
    units, limits = (attribute(result, key) for key in ("measure_units", "limits"))
    panels = sheet.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    for i, (axes, name) in enumerate(zip(panels, names, strict=True)):
        _panel(axes, result.isel(measure=i), over, str(name), units[i], limits[i])
        shade(axes, result, over)
        if axes is not panels[-1]:
            axes.set_xlabel("")
    return sheet


def _panel(axes: Axes, result: xr.Dataset, over: Abscissa, name: str, unit: str, limit: float | None) -> None:
    rows, total, rss = (result[key].values for key in ("worst_case", "worst_case_total", "rss"))
    most, shown = float(np.nanmax(total, initial=0.0)), usual_peak(ease(result), total)
    factor, label = prefixed(shown, unit)
    along(axes, over, plain(f"worst case of {name} [{label}]"))
    picked = thin(total)
    x, lanes = over.values[picked], [row[picked] * factor for row in (*rows, rss)]
    if over.closed:
        x, lanes = np.append(x, x[0] + over.period), [np.append(row, row[0]) for row in lanes]
    floor = np.zeros(len(x))
    for k, (joint, row) in enumerate(zip(result["joint"].values, lanes[:-1], strict=True)):
        if np.nanmax(row, initial=0.0) > 0:
            look: dict[str, Any] = {
                "facecolor": PALETTE[k % len(PALETTE)],
                "hatch": HATCHES[k // len(PALETTE) % len(HATCHES)],
            }
            axes.fill_between(x, floor, floor + row, label=plain(str(joint)), alpha=0.75, linewidth=0, **look)
        floor = floor + row
    axes.plot(x, floor, color=INK, linewidth=1.4, label="sum: worst case, first order", **_marks(x))
    axes.plot(x, lanes[-1], color=INK, linewidth=1.2, linestyle=(0, (5, 2)), label="RSS")
    if limit is not None:
        axes.axhline(limit * factor, color=PALETTE[1], linewidth=1.2, linestyle=(0, (1, 1.5)), label="limit")
    if "extreme_worst_case" in result and np.isfinite(there := float(np.sum(result["extreme_worst_case"].values))):
        # the curve is of the whole course, the figure of this place
        axes.plot([_place(result, over)], [there * factor], "o", color=INK, label="at the extreme", clip_on=False)
    axes.set_ylim(bottom=0.0)
    frame_peak(axes, most, shown, factor, unit)
    legend(axes)


def _place(result: xr.Dataset, over: Abscissa) -> float:
    """Where an extreme is on the abscissa, which goes on beyond the last position of a cycle as it does before it."""
    at, time, values = float(result["extreme_time"]), result["time"].values, over.values
    k = int(np.clip(np.searchsorted(time, at), 1, max(len(time) - 1, 1)))
    if len(time) < 2:
        return float(values[0])
    return float(values[k - 1] + (values[k] - values[k - 1]) * (at - time[k - 1]) / (time[k] - time[k - 1]))


def _marks(x: Array) -> dict[str, Any]:
    """A single position makes no line."""
    return {"marker": "o"} if len(x) == 1 else {}


def _over(result: xr.Dataset) -> Abscissa:
    values, unit, driver = result["drive"].values, result.attrs["drive_unit"], result.attrs["drive"]
    if not driver:
        return Abscissa("time", unit, values)
    step = float(values[1] - values[0]) if len(values) > 2 else 0.0
    turn = step * len(values)
    closed = bool(result.attrs["periodic"]) and unit == "°" and abs(abs(turn) - 360.0) < 1e-6 * 360.0
    return Abscissa(f"drive {'angle' if unit == '°' else 'slide'} {driver}", unit, values, closed, turn * closed)


# ---- table ----------------------------------------------------------------------------------------------------


SUMS = ("all, worst case, first order", "all, RSS", "all, standard deviation")
HEAD = ["joint", "play", "largest effect ±", "at", "share"]


def tables(result: xr.Dataset) -> list[TextTable]:
    """For each measure: the joints with their play, largest effect and where, and share in the largest worst case."""
    units, over = attribute(result, "measure_units"), _over(result)
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
    """The same of a measure that is a maximum or minimum: all effects are those at its place."""
    effects, deviations = (result[f"extreme_{key}"].values for key in ("worst_case", "deviation"))
    total, rows = float(np.sum(effects)), list[list[str]]()
    for j, (joint, effect) in enumerate(zip(result["joint"].values, effects, strict=True)):
        share = f"{100 * effect / total:.1f} %" if total > 0 else "—"
        rows.append([str(joint), _play(result, j), quantity(float(effect), unit), where, share])
    sums = total, np.sqrt(np.sum(effects**2)), np.sqrt(np.sum(deviations**2))
    for label, number in zip(SUMS, sums, strict=True):
        rows.append([label, "", quantity(float(number), unit), where, ""])
    return TextTable(f"{name}: the {word}, at {where}", ["joint", "play", "effect ±", "at", "share"], rows)


def _relied_on(result: xr.Dataset, name: str) -> Array:
    return relied_on(result[name].values, result["status"].values)


def _play(result: xr.Dataset, j: int) -> str:
    """How far the pin of a joint can go to either side, its end float apart; nothing said of a float of 0."""
    radii = [float(radius) for radius in result["radius"].values[j] if np.isfinite(radius)]
    across, along = (radii[:2], radii[2:]) if len(radii) == FLOATING else (radii, [])
    found = [f"±{quantity(radius, 'm')}" for radius in dict.fromkeys(across)]
    return ", ".join([*found, *(f"float ±{quantity(radius, 'm')}" for radius in along if radius > 0)])
