"""Views of what play does: the worst case of a measure over the turn, and what each joint has in it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.results.attributes import attribute
from trunnion.results.dataset import units_along
from trunnion.results.quantities import prefixed, quantity
from trunnion.results.scales import without_noise
from trunnion.views.charts import Axis, Band, Chart, Line, Look, Mark, Panel, Rule, outside, silent
from trunnion.views.common.cycle import Abscissa, abscissa
from trunnion.views.common.peaks import ease, usual_peak
from trunnion.views.page import NONE, Section, Table, counts, page

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["MOST_PANELS", "figure", "report", "tables"]

MOST_PANELS = 6
PANEL = 3.4  # height, inches
HATCHES = ("", "//", "..", "xx")
COLOURS = 6  # of the palette, after which the next joints are hatched
FLOATING = 3  # ends of a pin: two across and that of the float
ABOUT = "worst case: every pin where it moves the measure most, to first order; RSS: independent joints"


# ---- tables -------------------------------------------------------------------------------------------------------


def tables(result: xr.Dataset) -> list[Table]:
    """For each measure: the joints with their play, effect and share at the place of the measure."""
    result = without_noise(result)
    units, places = units_along(result["value"], "measure"), attribute(result, "places")
    return [
        _table(result.isel(measure=i), str(name), unit, *place)
        for i, (name, unit, place) in enumerate(zip(result["measure"].values, units, places, strict=True))
    ]


def _table(result: xr.Dataset, name: str, unit: str, kind: str, where: str) -> Table:
    head = ["joint", "play", "effect ±", "share"]
    effects, deviations = (result[f"extreme_{key}"].values for key in ("worst_case", "deviation"))
    total = float(np.sum(effects))
    if not np.isfinite(total):
        return Table(f"{name}: no value at {where}", head, [])
    rows = []
    for j, (joint, effect) in enumerate(zip(result["joint"].values, effects, strict=True)):
        share = f"{100 * effect / total:.1f} %" if total > 0 else NONE
        rows.append([str(joint), _play(result, j), quantity(float(effect), unit), share])
    sums = {"all, worst case, first order": total, "all, RSS": np.sqrt(np.sum(effects**2)),
            "all, standard deviation": np.sqrt(np.sum(deviations**2))}  # fmt: skip
    rows += [[label, "", quantity(float(value), unit), ""] for label, value in sums.items()]
    return Table(f"{name}, {kind}{' ' * bool(kind)}at {where}", head, rows)


def _play(result: xr.Dataset, j: int) -> str:
    """How far the pin of a joint can go to either side, its end float apart; nothing of a float of 0."""
    radii = [float(radius) for radius in result["radius"].values[j] if np.isfinite(radius)]
    across, along = (radii[:2], radii[2:]) if len(radii) == FLOATING else (radii, [])
    sides = [f"±{quantity(radius, 'm')}" for radius in dict.fromkeys(across)]
    return ", ".join([*sides, *(f"float ±{quantity(radius, 'm')}" for radius in along if radius > 0)])


# ---- figure -------------------------------------------------------------------------------------------------------


def figure(result: xr.Dataset, measures: Sequence[int] | None = None) -> Figure:
    """A panel for each measure: the joints' worst cases on top of one another, their RSS dashed.

    measures: their numbers, all if not given; MechanismError if they are more than MOST_PANELS.
    """
    from trunnion.views.draw import figure as draw

    result = without_noise(result)
    picked = range(result.sizes["measure"]) if measures is None else measures
    if len(picked) > MOST_PANELS:
        what = f"{len(picked)} measures do not fit one figure"
        raise MechanismError(Finding(what, "--measure", f"name at most {MOST_PANELS}"))
    return draw("Effect of the play of the joints", result, [_panel(result, i) for i in picked])


def _panel(every: xr.Dataset, i: int) -> Panel:
    """The worst case of one measure over the drive."""
    result, over, unit = every.isel(measure=i), abscissa(every), units_along(every["value"], "measure")[i]
    rows, total, rss = (result[key].values for key in ("worst_case", "worst_case_total", "rss"))
    most, usual = float(np.nanmax(total, initial=0.0)), usual_peak(ease(result), total)
    factor, label = prefixed(usual, unit)
    x, floor, marks = over.values, np.zeros(len(total)), list[Mark]()
    for k, (joint, row) in enumerate(zip(result["joint"].values, rows * factor, strict=True)):
        if np.nanmax(row, initial=0.0) > 0:
            look = Look(k, alpha=0.75, hatch=HATCHES[k // COLOURS % len(HATCHES)])
            marks.append(Band(x, floor, floor + row, str(joint), look, close=True))
        floor = floor + row
    dot = "o" if len(x) == 1 else ""  # a single position makes no line
    marks.append(Line(x, floor, "sum: worst case, first order", Look("ink", 1.4, mark=dot), close=True))
    marks.append(Line(x, rss * factor, "RSS", Look("ink", 1.2, "long"), close=True))
    limit = attribute(every, "limits")[i]
    if limit is not None:
        marks.append(Rule(limit * factor, "limit", Look(1, 1.2, "dotted"), upright=False))
    extreme = float(np.sum(result["extreme_worst_case"].values))
    if np.isfinite(extreme):
        # of an extreme the curve has the pins where they are, the figure also this place, which they may move
        at = np.array([_place(result, over)])
        place = " at ".join(attribute(every, "places")[i]).strip()
        look = Look("ink", dash="none", mark="o", size=6, unclipped=usual >= most)  # on the frame, but not beyond it
        marks.append(Line(at, np.array([extreme * factor]), place, look))
    marks += silent(every, over)
    top = None
    if usual < most:
        top = 1.05 * usual * factor
        marks.append(outside(most, unit))
    title = f"worst case of {every['measure'].values[i]} [{label}]"
    return Panel("", [Chart(over, Axis(title, (0.0, top)), marks, zero=True)], PANEL)


def _place(result: xr.Dataset, over: Abscissa) -> float:
    """Where an extreme is on the abscissa, which goes on beyond the last position of a cycle as it does before it."""
    at, time, values = float(result["extreme_time"]), result["time"].values, over.values
    k = int(np.clip(np.searchsorted(time, at), 1, max(len(time) - 1, 1)))
    if len(time) < 2:
        return float(values[0])
    return float(values[k - 1] + (values[k] - values[k - 1]) * (at - time[k - 1]) / (time[k] - time[k - 1]))


# ---- report -------------------------------------------------------------------------------------------------------


def report(result: xr.Dataset) -> str:
    """The whole report as HTML: a figure and a table for each measure."""
    parts = []
    for i, table in enumerate(tables(result)):
        name = str(result["measure"].values[i])
        untitled = table.titled(table.title.removeprefix(name).lstrip(",: "))
        parts.append(Section(name, ABOUT, [(f"worst case of {name}", figure(result, [i]))], after=[untitled]))
    facts = counts(*((result.sizes[dim], dim) for dim in ("measure", "joint", "position")))
    return page(result, "Effect of the play of the joints", facts, parts)
