"""Views of an allocation: what to buy, what it does then, what accuracy costs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.results.attributes import attribute
from trunnion.results.dataset import units_along
from trunnion.results.quantities import drawn_in, joined, number
from trunnion.views import tolerance
from trunnion.views.charts import Axis, Chart, Legend, Line, Look, Mark, Panel, Stripe, check_kind
from trunnion.views.common.cycle import names
from trunnion.views.page import NONE, Section, Table
from trunnion.views.readings import is_play, readings, share, share_interval

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["KINDS", "figure", "headed", "report", "tables", "trade_off"]

KINDS = ("trade-off", *tolerance.KINDS)
CRITERIA = {"worst-case": "worst case", "rss": "root of the sum of squares", "yield": "yield"}


# ---- tables -----------------------------------------------------------------------------------------------------


def tables(result: xr.Dataset) -> list[Table]:
    """What to buy, how the limits are kept, what accuracy costs, and then the tables of `tolerance`."""
    if not result.attrs["found"]:
        return []
    parts = [bought(result).titled(headed(result)), room(result)]
    parts += [offers_table(result)] if "trade_off_cost" in result else []
    return [*parts, *tolerance.tables(result)]


def headed(result: xr.Dataset) -> str:
    """The criterion, the cost, and what is known of the optimum."""
    by_yield = result.attrs["criterion"] == "yield"
    text = CRITERIA[str(result.attrs["criterion"])]
    if by_yield:
        text += f" of {share(float(result.attrs['target']))}"
        sampled = float(result["yield_all"]) if "yield_all" in result else math.nan
        if sampled < float(result.attrs["target"]):
            text += f" (sampled {_percent(sampled)})"
    cost, before = float(result["cost_total"]), float(result["cost_total_before"])
    text += f": cost {cost:.8g}"
    text += f", as stated {before:.8g}" if math.isfinite(before) else ""
    if not by_yield:
        return f"{text}, {'global optimum to first order' if result.attrs['proven'] else 'best found'}"
    if "yield_checked" in result:
        checked, *ends = (float(result[f"yield_checked{end}"]) for end in ("", "_low", "_high"))
        text += f", yield of fresh samples {share_interval(checked, *ends)}"
    return text


def bought(result: xr.Dataset) -> Table:
    """Each tolerance that has a cost: what it is to be, what it costs, and what it was."""
    units, paths = units_along(result["tolerance"], "parameter"), names(result, "parameter")
    groups = {str(row["path"]): str(row["group"]) for row in attribute(result, "prices")}
    rows = []
    for j in np.flatnonzero(result["bought"].values):
        t, cost, part, was, paid = (
            float(result[key].values[j])
            for key in ("tolerance", "cost", "cost_share", "tolerance_before", "cost_before")
        )
        made, group = str(result["choice"].values[j]), groups.get(paths[j], "")
        halves, sign = [], "" if is_play(paths[j]) else "±"
        for half in (t, was):  # in mm or degrees, to five digits
            factor, display_unit = drawn_in(half, units[j])
            halves.append(joined(f"{sign}{half * factor:.5g}", display_unit) if math.isfinite(half) else NONE)
        now, then = halves
        rows.append([paths[j], now, made, group, _cost(cost), share(part, 1), then, _cost(paid)])
    totals = (_cost(float(result[key])) for key in ("cost_total", "cost_total_before"))
    rows.append(["all", "", "", "", next(totals), share(1.0), "", next(totals)])
    head = ["parameter", "tolerance", "made", "group", "cost", "share", "as stated", "cost as stated"]
    return Table("allocated tolerances", head, rows).without_empty()


def room(result: xr.Dataset) -> Table:
    """Of each measure how much of its room is taken by the criterion, and found by search and samples."""
    rows = []
    split = "yield_margin" in result and int(np.sum(np.isfinite(result["yield_margin"].values))) > 1
    for read in readings(result):
        margin = f"{read.value('yield_margin'):.4g} σ" if split and read.limited else NONE
        lower, upper = (read.limits[0], read.room[1]) if read.is_size else read.room
        sides = ((read.value("searched_lower"), lower), (read.value("searched_upper"), upper))
        shares = [max(part / end, 0.0) for part, end in sides if math.isfinite(part + end) and end != 0]
        ends = [abs(end) for end in (lower, upper) if math.isfinite(end)]
        wider = 0.01 * read.value("saving") * min(ends) if ends else math.nan
        rows.append(
            [read.name, read.limits_said, _percent(read.value("used")), margin, _percent(max(shares, default=math.nan)),
             _percent(read.value("yield")), NONE if math.isnan(wider) else f"{wider:.4g}"]
        )  # fmt: skip
    head = ["measure", "limits", "used", "margin", "worst case found", "yield", "1\u00a0% wider saves"]
    return Table("share of the limits that is used", head, rows).without_empty()


def offers_table(result: xr.Dataset) -> Table:
    """Cost over accuracy."""
    rows = [
        [f"{100 * factor:.4g}\u00a0%", _cost(cost) if math.isfinite(cost) else "infeasible"]
        for factor, cost in zip(result["trade_off_factor"].values, result["trade_off_cost"].values, strict=True)
    ]
    return Table("cost over accuracy", ["limits, relative to stated", "minimum cost"], rows)


def _cost(cost: float) -> str:
    return f"{cost:.6g}" if math.isfinite(cost) else NONE


def _percent(value: float) -> str:
    return NONE if math.isnan(value) else f"{100 * value:.4g}\u00a0%"


# ---- figures ----------------------------------------------------------------------------------------------------


def figure(result: xr.Dataset, kind: str | None = None) -> Figure:
    """A kind of figure; if none is named, cost over accuracy where that was computed, else all of the tolerances.

    Raises
    ------
    MechanismError : if there is no such kind, or the result has nothing for it
    """
    if not result.attrs["found"]:
        raise MechanismError(Finding("there is no allocation to draw", "--out", "widen the infeasible limits"))
    if kind is None and "trade_off_cost" not in result:
        return tolerance.sheet(result)
    check_kind(kind or "trade-off", KINDS)
    if kind in tolerance.KINDS:
        return tolerance.figure(result, kind)
    if "trade_off_cost" not in result:
        raise MechanismError(Finding("no measure has a figure 'trade-off'", "--kind", "add --curve 21"))
    points = zip(result["trade_off_factor"].values.tolist(), result["trade_off_cost"].values.tolist(), strict=True)
    models = any(row["model"] for row in attribute(result, "prices"))
    return trade_off(result, list(points), result.attrs["choices"] == "discrete" and not models)


CHOSEN = Look(1, dash="none", mark="D", size=6.5, order=5)


def trade_off(
    result: xr.Dataset,
    points: Sequence[tuple[float, float]],
    stepped: bool = False,
) -> Figure:
    """Least cost over accuracy, the stated limits marked.

    Parameters
    ----------
    result : whose name stands beneath
    points : share of the stated limits, and the least cost that keeps them, NaN if nothing does
    stepped : as with processes to choose from: what keeps a limit keeps any wider one too
    """
    from trunnion.views.draw import figure as draw

    part, cost = (np.array(column, float) for column in zip(*sorted(points), strict=True))
    marks: list[Mark] = [Line(100 * part, cost, "minimum cost", Look(0, 1.8, mark="o", size=3.2), steps=stepped)]
    feasible, bottom = np.isfinite(cost), None
    if feasible.any():
        bottom = 0.0 if cost[feasible].min() > 0 else None
        if part[feasible][0] <= 1.0 <= part[feasible][-1]:
            stated_cost = float(np.interp(1.0, part[feasible], cost[feasible]))
            label = f"stated limits: {number(stated_cost)}"
            marks.append(Line(np.array([100.0]), np.array([stated_cost]), label, CHOSEN))
    if not feasible.all():
        lost = float(part[~feasible].max())
        ends = 100 * part[0], 100 * float(min(part[feasible & (part > lost)], default=lost))
        marks.append(Stripe(ends[0], ends[1], "infeasible", Look("rule", hatch="///", order=0.5)))
    chart = Chart(
        Axis("limits relative to the stated ones [%]"),
        Axis("minimum cost", (bottom, None), count=7),
        marks,
        legend=Legend(least=1),
    )
    return draw("Minimum cost of all tolerances over accuracy", result, [Panel("", [chart], 3.75)])


# ---- report -----------------------------------------------------------------------------------------------------


def report(result: xr.Dataset) -> str:
    """The report of the mechanism with the tolerances found, what to buy first."""
    kicker = "Tolerances of minimum cost for a linkage"
    if not result.attrs["found"]:
        return tolerance.report(result, kicker=kicker)
    parts = [Section("Allocated tolerances", headed(result), tables=[bought(result), room(result)])]
    if "trade_off_cost" in result:
        about = "Minimum cost if all limits are multiplied by the same factor."
        curve = [("Minimum cost over accuracy", figure(result, "trade-off"))]
        parts.append(Section("Cost over accuracy", about, curve, [offers_table(result)]))
    return tolerance.report(result, parts, kicker)
