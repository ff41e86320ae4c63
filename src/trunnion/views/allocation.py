"""Views of an allocation: what to buy, what it does then, what accuracy costs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.results.attributes import attribute
from trunnion.results.dataset import units_along
from trunnion.results.quantities import drawn_in, joined, number
from trunnion.views import tolerance
from trunnion.views.axis import names
from trunnion.views.charts import Axis, Chart, Legend, Line, Look, Mark, Panel, Plot, Stripe
from trunnion.views.curves import check_kind
from trunnion.views.page import NONE, Section, Table
from trunnion.views.readings import is_play, plain, readings, share, share_interval

if TYPE_CHECKING:
    import xarray as xr

KINDS = ("trade-off", *tolerance.KINDS)
CRITERIA = {"worst-case": "worst case", "rss": "root of the sum of squares", "yield": "yield"}


# ---- tables -----------------------------------------------------------------------------------------------------


def tables(result: xr.Dataset) -> list[Table]:
    """What to buy, how the limits are kept, what accuracy costs, and then the tables of `tolerance`."""
    if not result.attrs["found"]:
        return []
    parts = [bought(result).titled(headed(result)), room(result)]
    parts += [offers(result)] if "trade_off_cost" in result else []
    return [*parts, *tolerance.tables(result)]


def headed(result: xr.Dataset) -> str:
    """The criterion, the cost, and what is known of the optimum."""
    by_yield, text = result.attrs["criterion"] == "yield", CRITERIA[str(result.attrs["criterion"])]
    if by_yield:
        text += f" of {share(float(result.attrs['target']))}"
        sampled = float(result["yield_all"]) if "yield_all" in result else math.nan
        if sampled < float(result.attrs["target"]):
            text += f" (sampled {_percent(sampled)})"
    cost, before = float(result["cost_total"]), float(result["cost_total_before"])
    text += f": cost {cost:.8g}" + (f", as stated {before:.8g}" if math.isfinite(before) else "")
    if not by_yield:
        text += f", {'global optimum to first order' if result.attrs['proven'] else 'best found'}"
    elif "yield_checked" in result:
        ends = (float(result[f"yield_checked{end}"]) for end in ("", "_low", "_high"))
        text += f", yield of fresh samples {share_interval(*ends)}"
    return text


def bought(result: xr.Dataset) -> Table:
    """Each tolerance that has a cost: what it is to be, in mm or degrees, what it costs, and what it was."""
    units, paths = units_along(result["tolerance"], "parameter"), names(result, "parameter")
    groups = {str(row["path"]): str(row["group"]) for row in attribute(result, "prices")}
    rows = []
    for j in np.flatnonzero(result["bought"].values).tolist():
        widths = []
        for width in (float(result[key].values[j]) for key in ("tolerance", "tolerance_before")):
            factor, unit = drawn_in(width, units[j])
            text = f"{'' if is_play(paths[j]) else '±'}{width * factor:.5g}"
            widths.append(joined(text, unit) if math.isfinite(width) else NONE)
        cost, part, before = (float(result[key].values[j]) for key in ("cost", "cost_share", "cost_before"))
        rows.append([paths[j], widths[0], str(result["choice"].values[j]), groups.get(paths[j], ""), plain(cost, ".6g"),
                     share(part, 1), widths[1], plain(before, ".6g")])  # fmt: skip
    total, before = (float(result[key]) for key in ("cost_total", "cost_total_before"))
    rows.append(["all", "", "", "", plain(total, ".6g"), share(1.0), "", plain(before, ".6g")])
    head = ["parameter", "tolerance", "made", "group", "cost", "share", "as stated", "cost as stated"]
    return Table("allocated tolerances", head, rows).without_empty()


def room(result: xr.Dataset) -> Table:
    """Of each measure how much of its room is taken by the criterion, and found by search and samples."""
    rows = []
    split = "yield_margin" in result and int(np.sum(np.isfinite(result["yield_margin"].values))) > 1
    for read in readings(result):
        margin = f"{read.value('yield_margin'):.4g} σ" if split and read.limits_said else NONE
        lower, upper = (read.limits[0], read.room[1]) if read.is_size else read.room
        sides = ((read.value("searched_lower"), lower), (read.value("searched_upper"), upper))
        shares = [max(part / end, 0.0) for part, end in sides if math.isfinite(part + end) and end != 0]
        wider = 0.01 * read.value("saving") * min(abs(lower), abs(upper))
        rows.append([read.name, read.limits_said, _percent(read.value("used")), margin,
                     _percent(max(shares, default=math.nan)), _percent(read.value("yield")),
                     plain(wider, ".4g")])  # fmt: skip
    head = ["measure", "limits", "used", "margin", "worst case found", "yield", "1\u00a0% wider saves"]
    return Table("share of the limits that is used", head, rows).without_empty()


def offers(result: xr.Dataset) -> Table:
    """Cost over accuracy."""
    rows = [
        [f"{100 * factor:.4g}\u00a0%", plain(cost, ".6g") if math.isfinite(cost) else "infeasible"]
        for factor, cost in zip(result["trade_off_factor"].values, result["trade_off_cost"].values, strict=True)
    ]
    return Table("cost over accuracy", ["limits, relative to stated", "minimum cost"], rows)


def _percent(value: float) -> str:
    return NONE if math.isnan(value) else f"{100 * value:.4g}\u00a0%"


# ---- figures and report -----------------------------------------------------------------------------------------


def figure(result: xr.Dataset, kind: str | None = None) -> Plot:
    """A kind of figure; if none is named, cost over accuracy where that was computed, else all of the tolerances.

    Raises
    ------
    MechanismError : if there is no such kind, or the result has nothing for it
    """
    if not result.attrs["found"]:
        raise MechanismError(Finding("there is no allocation to draw", "--out", "widen the infeasible limits"))
    kind = kind or ("trade-off" if "trade_off_cost" in result else None)
    if kind is not None:
        check_kind(kind, KINDS)
    if kind != "trade-off":
        return tolerance.figure(result, kind)
    if "trade_off_cost" not in result:
        raise MechanismError(Finding("no measure has a figure 'trade-off'", "--kind", "add --curve 21"))
    return trade_off(result)


def trade_off(result: xr.Dataset) -> Plot:
    """Least cost over accuracy, the stated limits marked, what no tolerances keep shaded.

    A choice among processes alone makes a stair: what keeps a limit keeps any wider one too.
    """
    order = np.argsort(result["trade_off_factor"].values)
    part, cost = (result[f"trade_off_{key}"].values[order].astype(float) for key in ("factor", "cost"))
    stair = result.attrs["choices"] == "discrete" and not any(row["model"] for row in attribute(result, "prices"))
    marks: list[Mark] = [Line(100 * part, cost, "minimum cost", Look(0, 1.8, mark="o", size=3.2), steps=stair)]
    feasible = np.isfinite(cost)
    if feasible.any() and part[feasible][0] <= 1.0 <= part[feasible][-1]:
        stated = np.interp([1.0], part[feasible], cost[feasible])
        look = Look(1, dash="none", mark="D", size=6.5, order=5)
        marks.append(Line(np.array([100.0]), stated, f"stated limits: {number(float(stated[0]))}", look))
    if not feasible.all():
        lost = float(part[~feasible].max())
        high = float(min(part[feasible & (part > lost)], default=lost))
        marks.append(Stripe(100 * part[0], 100 * high, "infeasible", Look("rule", hatch="///", order=0.5)))
    bottom = 0.0 if np.nanmin(cost, initial=np.inf) > 0 else None
    across, up = Axis("limits relative to the stated ones [%]"), Axis("minimum cost", (bottom, None), count=7)
    chart = Chart(across, up, marks, legend=Legend(1))
    return Plot("Minimum cost of all tolerances over accuracy", [Panel("", [chart], 3.75)])


def report(result: xr.Dataset) -> str:
    """The report of the mechanism with the tolerances found, what to buy first."""
    kicker = "Tolerances of minimum cost for a linkage"
    if not result.attrs["found"]:
        return tolerance.report(result, kicker=kicker)
    parts = [Section("Allocated tolerances", headed(result), tables=[bought(result), room(result)])]
    if "trade_off_cost" in result:
        about = "Minimum cost if all limits are multiplied by the same factor."
        curve = [("Minimum cost over accuracy", trade_off(result))]
        parts.append(Section("Cost over accuracy", about, curve, [offers(result)]))
    return tolerance.report(result, parts, kicker)
