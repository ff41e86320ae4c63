"""What an allocation found, as tables, figures and a report: what to buy, what it does then, what accuracy costs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.results.attributes import attribute
from trunnion.results.quantities import scaled
from trunnion.statistics.costs import Cost
from trunnion.views.allocation.cost import Offer, PriceCurve, tolerance_cost, trade_off
from trunnion.views.common.cycle import names
from trunnion.views.common.table import TextTable
from trunnion.views.tolerance.figure import KINDS as OF_TOLERANCES
from trunnion.views.tolerance.figure import figure as tolerance_figure
from trunnion.views.tolerance.readings import readings, share
from trunnion.views.tolerance.report import Section
from trunnion.views.tolerance.report import report as tolerance_report
from trunnion.views.tolerance.tables import tables as tolerance_tables

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["KINDS", "check_kind", "figure", "report", "tables"]

KINDS = ("cost", "trade-off", *OF_TOLERANCES)
POINTS = 120  # of the curve of a cost
AROUND = 4.0  # how many times narrower and wider than the chosen tolerance the curve goes
CRITERIA = {"worst-case": "worst case", "rss": "root of the sum of squares", "yield": "yield"}


def tables(result: xr.Dataset) -> list[TextTable]:
    """What to buy, how the limits are kept, what accuracy costs, and then the tables of `tolerance`."""
    if not result.attrs["found"]:
        return []
    found = [bought(result), room(result)]
    found += [trials(result)] if "trial_yield" in result else []
    found += [offers_table(result)] if "trade_off_cost" in result else []
    return [*found, *tolerance_tables(result)]


def headed(result: xr.Dataset) -> str:
    """The criterion, the cost, and what is known of the optimum."""
    criterion = CRITERIA[str(result.attrs["criterion"])]
    if result.attrs["criterion"] == "yield":
        criterion += f" of {share(float(result.attrs['target']))}"
        sampled = float(result["yield_all"]) if "yield_all" in result else math.nan
        if sampled < float(result.attrs["target"]):
            criterion += f" (sampled {_share(sampled)})"
    cost, before = float(result["cost_total"]), float(result["cost_total_before"])
    told = f"{criterion}: cost {cost:.8g}"
    told += f", as stated {before:.8g}" if math.isfinite(before) else ""
    if result.attrs["criterion"] == "yield":
        return told
    return f"{told}, {'global optimum to first order' if result.attrs['proven'] else 'best found'}"


def bought(result: xr.Dataset) -> TextTable:
    """Each tolerance that has a cost: what it is to be, what it costs, and what it was."""
    rows = []
    units = attribute(result, "parameter_units")
    paths, choices = names(result, "parameter"), [str(one) for one in result["choice"].values]
    keys = ("bought", "tolerance", "cost", "cost_share", "tolerance_before", "cost_before")
    columns = {key: np.asarray(result[key].values, float) for key in keys}
    groups = {str(one["path"]): str(one["group"]) for one in attribute(result, "prices")}
    for j in np.flatnonzero(columns["bought"]):
        t, cost, part, was, paid = (float(columns[key][j]) for key in keys[1:])
        sign = "" if _is_play(paths[j]) else "±"
        rows.append(
            [paths[j], half_width(t, units[j], sign), choices[j], groups.get(paths[j], ""), _known(cost),
             share(part, 1), half_width(was, units[j], sign), _known(paid)]
        )  # fmt: skip
    total, before = float(result["cost_total"]), float(result["cost_total_before"])
    rows.append(["all", "", "", "", _known(total), share(1.0), "", _known(before)])
    head = ["parameter", "tolerance", "made", "group", "cost", "share", "as stated", "cost as stated"]
    return _without_empty(TextTable(headed(result), head, rows))


def half_width(t: float, unit: str, sign: str = "±") -> str:
    """A half width in mm or degrees, to five digits."""
    if not math.isfinite(t):
        return "—"
    factor, shown = (1e3, "mm") if unit == "m" else scaled(t, unit)
    gap = "" if shown in ("°", "") else "\u00a0"
    return f"{sign}{t * factor:.5g}{gap}{shown}"


def _is_play(path: str) -> bool:
    return path.startswith("joints.") and path.endswith(".clearance") and path.count(".") == 2


def _known(cost: float) -> str:
    return f"{cost:.6g}" if math.isfinite(cost) else "—"


def _without_empty(table: TextTable) -> TextTable:
    """Without columns that say nothing."""
    kept = [k for k in range(len(table.head)) if k == 0 or any(row[k] not in ("", "—") for row in table.rows)]
    return TextTable(table.title, [table.head[k] for k in kept], [[row[k] for k in kept] for row in table.rows])


def room(result: xr.Dataset) -> TextTable:
    """Of each measure how much of its room is taken by the criterion, and found by search and samples."""
    rows = []
    split = "yield_margin" in result and int(np.sum(np.isfinite(result["yield_margin"].values))) > 1
    for read in readings(result):
        margin = f"{read.value('yield_margin'):.4g} σ" if split and read.limited else "—"
        lower, upper = (read.limits[0], read.room[1]) if read.is_size else read.room
        sides = ((read.value("searched_lower"), lower), (read.value("searched_upper"), upper))
        known = [(part, end) for part, end in sides if math.isfinite(part) and math.isfinite(end) and end != 0]
        found = [max(part / end, 0.0) for part, end in known]
        ends = [abs(end) for end in (lower, upper) if math.isfinite(end)]
        wider = 0.01 * read.value("saving") * min(ends) if ends else math.nan
        rows.append(
            [read.name, read.told_limits, _share(read.value("used")), margin,
             _share(max(found, default=math.nan)), _share(read.value("yield")),
             "—" if math.isnan(wider) else f"{wider:.4g}"]
        )  # fmt: skip
    head = ["measure", "limits", "used", "margin", "worst case found", "yield", "1\u00a0% wider saves"]
    return _without_empty(TextTable("share of the limits that is used", head, rows))


def _share(value: float) -> str:
    return "—" if math.isnan(value) else f"{100 * value:.4g}\u00a0%"


def trials(result: xr.Dataset) -> TextTable:
    """What was sampled on the way to a yield."""
    keys = ("trial_margin", "trial_cost", "trial_yield", "trial_yield_low", "trial_yield_high")
    rows = [
        [f"{z:.5g} σ", _known(cost), *(_share(one) for one in shares)]
        for z, cost, *shares in zip(*(np.asarray(result[key].values, float).tolist() for key in keys), strict=True)
    ]
    several = int(np.sum(np.isfinite(result["yield_margin"].values))) > 1
    margin = "mean margin of the limits" if several else "margin of every limit"
    return TextTable("trials", [margin, "cost", "yield", "at least", "at most"], rows)


def offers_table(result: xr.Dataset) -> TextTable:
    """Cost over accuracy."""
    rows = [
        [f"{100 * factor:.4g}\u00a0%", _known(cost) if math.isfinite(cost) else "infeasible"]
        for factor, cost in zip(result["trade_off_factor"].values, result["trade_off_cost"].values, strict=True)
    ]
    return TextTable("cost over accuracy", ["limits, relative to stated", "minimum cost"], rows)


# ---- figures ----------------------------------------------------------------------------------------------------


def check_kind(kind: str) -> None:
    """MechanismError if there is no such kind of figure."""
    if kind not in KINDS:
        raise MechanismError(Finding(f"there is no figure '{kind}'", "--kind", f"use one of {', '.join(KINDS)}"))


def figure(result: xr.Dataset, kind: str | None = None) -> Figure:
    """A kind of figure; cost over accuracy where it was asked for, else what the tolerances cost, if none is named."""
    if not result.attrs["found"]:
        raise MechanismError(Finding("there is no allocation to draw", "--out", "widen the infeasible limits"))
    kind = kind or ("trade-off" if "trade_off_cost" in result else "cost")
    check_kind(kind)
    if kind == "cost":
        return tolerance_cost(result, prices(result))
    if kind != "trade-off":
        return tolerance_figure(result, kind)
    if "trade_off_cost" not in result:
        raise MechanismError(Finding("no measure has a figure 'trade-off'", "--kind", "add --curve 21"))
    return trade_off(result, offers(result), _limit(result), stepped=_all_choices(result))


def _all_choices(result: xr.Dataset) -> bool:
    """Whether every tolerance is chosen from processes, so that the cost goes in steps."""
    return result.attrs["choices"] == "discrete" and not any(one["model"] for one in attribute(result, "prices"))


def offers(result: xr.Dataset) -> list[Offer]:
    """The points of cost over accuracy."""
    pairs = zip(result["trade_off_factor"].values.tolist(), result["trade_off_cost"].values.tolist(), strict=True)
    return [Offer(factor, cost) for factor, cost in pairs]


def _limit(result: xr.Dataset) -> tuple[str, float, str] | None:
    """The one limit there is, if it is one to either side."""
    found = [(read.name, read.limits[1], read.unit) for read in readings(result) if read.limited]
    read = readings(result)[0]
    alike = len(found) == 1 and read.limits[0] == -read.limits[1] and not any(map(math.isfinite, read.bounds))
    return found[0] if alike else None


def prices(result: xr.Dataset) -> list[PriceCurve]:
    """What each tolerance with a cost would cost at other half widths."""
    units = dict(zip(names(result, "parameter"), attribute(result, "parameter_units"), strict=True))
    place = {name: j for j, name in enumerate(names(result, "parameter"))}
    found = []
    for one in attribute(result, "prices"):
        path = str(one["path"])
        t, cost = (float(result[key].values[place[path]]) for key in ("tolerance", "cost"))
        made = tuple((str(each["name"]), float(each["tolerance"]), float(each["cost"])) for each in one["choices"])
        curve = np.empty(0), np.empty(0)
        if one["model"] and t > 0:
            low, high = max(t / AROUND, float(one["least"])), min(t * AROUND, float(one["most"] or math.inf))
            over = np.geomspace(low, high, POINTS)
            model = Cost(str(one["model"]), one["parameters"])
            curve = over, np.array([model.value(float(at)) for at in over])
        found.append(
            PriceCurve(
                path, units[path], (t, cost), *curve, processes=made, group=str(one["group"]), play=_is_play(path)
            )
        )
    return found


# ---- report -----------------------------------------------------------------------------------------------------


def report(result: xr.Dataset) -> str:
    """The report of the mechanism with the tolerances found, what to buy first."""
    kicker = "Tolerances of minimum cost for a linkage"
    if not result.attrs["found"]:
        return tolerance_report(result, kicker=kicker)
    pictures = [("Cost of each tolerance, the chosen one marked", figure(result, "cost"))]
    told = [bought(result)._replace(title=""), room(result)]
    told += [trials(result)] if "trial_yield" in result else []
    first = [Section("Allocated tolerances", headed(result), pictures, told)]
    if "trade_off_cost" in result:
        about = "Minimum cost if all limits are multiplied by the same factor."
        curve = [("Minimum cost over accuracy", figure(result, "trade-off"))]
        first.append(Section("Cost over accuracy", about, curve, [offers_table(result)._replace(title="")]))
    return tolerance_report(result, first, kicker)
