"""Views of what play does: the worst case of a measure over the turn, and what each joint has in it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.results.attributes import attribute
from trunnion.results.dataset import units_along, without_noise
from trunnion.results.quantities import prefixed, quantity
from trunnion.views.axis import abscissa, names
from trunnion.views.charts import Axis, Band, Chart, Line, Look, Mark, Panel, Plot, Rule
from trunnion.views.curves import ease, outside, silent, usual_peak
from trunnion.views.page import NONE, Section, Table, counts, page

if TYPE_CHECKING:
    import xarray as xr

MOST_PANELS = 6
PANEL = 3.4  # height, inches
HATCHES, COLOURS = ("", "//", "..", "xx"), 6  # of the palette, after which the next joints are hatched
FLOATING = 3  # ends of a pin: two across and that of the float
ABOUT = "worst case: every pin where it moves the measure most, to first order; RSS: independent joints"
HEAD = ["joint", "play", "effect ±", "share"]


def tables(result: xr.Dataset) -> list[Table]:
    """For each measure: the joints with their play, effect and share at the place of the measure."""
    result = without_noise(result)
    units, places, parts = units_along(result["value"], "measure"), attribute(result, "places"), []
    for i, (name, unit, (kind, where)) in enumerate(zip(names(result, "measure"), units, places, strict=True)):
        effects, deviations = (result[f"extreme_{key}"].values[i] for key in ("worst_case", "deviation"))
        total = float(np.sum(effects))
        if not np.isfinite(total):
            parts.append(Table(f"{name}: no value", HEAD, []))
            continue
        rows = [[joint, _play(result["radius"].values[j]), quantity(float(effect), unit),
                 f"{100 * effect / total:.1f} %" if total > 0 else NONE]
                for j, (joint, effect) in enumerate(zip(names(result, "joint"), effects, strict=True))]  # fmt: skip
        sums = {"all, worst case, first order": total, "all, RSS": np.sqrt(np.sum(effects**2)),
                "all, standard deviation": np.sqrt(np.sum(deviations**2))}  # fmt: skip
        rows += [[label, "", quantity(float(value), unit), ""] for label, value in sums.items()]
        parts.append(Table(f"{name}, {kind}{' ' * bool(kind)}at {where}", HEAD, rows))
    return parts


def _play(ends: np.ndarray) -> str:
    """How far the pin of a joint can go to either side, its end float apart; nothing of a float of 0."""
    radii = [float(radius) for radius in ends if np.isfinite(radius)]
    across, along = (radii[:2], radii[2:]) if len(radii) == FLOATING else (radii, [])
    sides = [f"±{quantity(radius, 'm')}" for radius in dict.fromkeys(across)]
    return ", ".join([*sides, *(f"float ±{quantity(radius, 'm')}" for radius in along if radius > 0)])


def figure(result: xr.Dataset, measures: Sequence[int] | None = None) -> Plot:
    """A panel for each measure: the joints' worst cases on top of one another, their RSS dashed.

    measures: their numbers, all if not given; MechanismError if they are more than MOST_PANELS.
    """
    result = without_noise(result)
    picked = range(result.sizes["measure"]) if measures is None else measures
    if len(picked) > MOST_PANELS:
        what = f"{len(picked)} measures do not fit one figure"
        raise MechanismError(Finding(what, "--measure", f"name at most {MOST_PANELS}"))
    return Plot("Effect of the play of the joints", [_panel(result, i) for i in picked])


def _panel(every: xr.Dataset, i: int) -> Panel:
    """The worst case of one measure over the drive."""
    result, over, unit = every.isel(measure=i), abscissa(every), units_along(every["value"], "measure")[i]
    rows, total, rss = (result[key].values for key in ("worst_case", "worst_case_total", "rss"))
    most, usual = float(np.nanmax(total, initial=0.0)), usual_peak(ease(result), total)
    factor, label = prefixed(usual, unit)
    x, floor, marks = over.values, np.zeros(len(total)), list[Mark]()
    for k, (joint, row) in enumerate(zip(names(result, "joint"), rows * factor, strict=True)):
        if np.nanmax(row, initial=0.0) > 0:
            look = Look(k, alpha=0.75, hatch=HATCHES[k // COLOURS % len(HATCHES)])
            marks.append(Band(x, floor, floor + row, joint, look, close=True))
        floor = floor + row
    marks.append(Line(x, floor, "sum: worst case, first order", Look("ink", 1.4), close=True))
    marks.append(Line(x, rss * factor, "RSS", Look("ink", 1.2, "long"), close=True))
    if (limit := attribute(every, "limits")[i]) is not None:
        marks.append(Rule(limit * factor, "limit", Look(1, 1.2, "dotted"), upright=False))
    extreme = float(np.sum(result["extreme_worst_case"].values))
    if np.isfinite(extreme):
        time, places = (np.append(row, 2 * row[-1] - row[-2 % len(row)]) for row in (result["time"].values, x))
        place = np.interp(
            [float(result["extreme_time"])], time, places
        )  # of a closed cycle also behind its last position
        name = " at ".join(attribute(every, "places")[i]).strip()
        marks.append(Line(place, np.array([extreme * factor]), name, Look("ink", dash="none", mark="o", size=6)))
    marks += [*silent(every, over), *([outside(most, unit)] if usual < most else [])]
    top = 1.05 * usual * factor if usual < most else None
    title = f"worst case of {every['measure'].values[i]} [{label}]"
    return Panel("", [Chart(over, Axis(title, (0.0, top)), marks, zero=True)], PANEL)


def report(result: xr.Dataset) -> str:
    """The whole report as HTML: a figure and a table for each measure."""
    parts = []
    for i, (name, table) in enumerate(zip(names(result, "measure"), tables(result), strict=True)):
        untitled = table.titled(table.title.removeprefix(name).lstrip(",: "))
        parts.append(Section(name, ABOUT, [(f"worst case of {name}", figure(result, [i]))], after=[untitled]))
    facts = counts(*((result.sizes[dim], dim) for dim in ("measure", "joint", "position")))
    return page(result, "Effect of the play of the joints", facts, parts)
