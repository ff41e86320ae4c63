"""Views of an allocation: what to buy, what it does then, what accuracy costs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.results.attributes import attribute
from trunnion.results.dataset import units_along
from trunnion.results.quantities import drawn_in, joined, number, scaled
from trunnion.statistics.costs import Cost
from trunnion.views import tolerance
from trunnion.views.charts import Axis, Chart, Legend, Line, Look, Mark, Note, Panel, Stripe, check_kind
from trunnion.views.common.cycle import Array, names
from trunnion.views.page import NONE, Section, Table
from trunnion.views.readings import MeasureReading, ending, is_play, readings, share, share_interval

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["KINDS", "PriceCurve", "figure", "headed", "prices", "report", "tables", "tolerance_cost",
           "trade_off"]  # fmt: skip

KINDS = ("cost", "trade-off", *tolerance.KINDS)
CRITERIA = {"worst-case": "worst case", "rss": "root of the sum of squares", "yield": "yield"}
POINTS = 120  # of the curve of a cost
AROUND = 4.0  # how many times narrower and wider than the chosen tolerance the curve goes
MOST_PRICES = 12
WIDTH = 7.4  # of the figure of costs, inches
NAME = 30  # characters of a name over a panel


# ---- tables -----------------------------------------------------------------------------------------------------


def tables(result: xr.Dataset) -> list[Table]:
    """What to buy, how the limits are kept, what accuracy costs, and then the tables of `tolerance`."""
    if not result.attrs["found"]:
        return []
    parts = [bought(result).titled(headed(result)), room(result)]
    parts += [trials(result)] if "trial_yield" in result else []
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
        halves = (_half_width(half, units[j], "" if is_play(paths[j]) else "±") for half in (t, was))
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


def trials(result: xr.Dataset) -> Table:
    """What was sampled on the way to a yield."""
    keys = ("trial_margin", "trial_cost", "trial_yield", "trial_yield_low", "trial_yield_high")
    rows = [
        [f"{z:.5g} σ", _cost(cost), *map(_percent, shares)]
        for z, cost, *shares in zip(*(np.asarray(result[key].values, float).tolist() for key in keys), strict=True)
    ]
    several = int(np.sum(np.isfinite(result["yield_margin"].values))) > 1
    margin = "mean margin of the limits" if several else "margin of every limit"
    return Table("trials", [margin, "cost", "yield", "at least", "at most"], rows)


def offers_table(result: xr.Dataset) -> Table:
    """Cost over accuracy."""
    rows = [
        [f"{100 * factor:.4g}\u00a0%", _cost(cost) if math.isfinite(cost) else "infeasible"]
        for factor, cost in zip(result["trade_off_factor"].values, result["trade_off_cost"].values, strict=True)
    ]
    return Table("cost over accuracy", ["limits, relative to stated", "minimum cost"], rows)


def _half_width(t: float, unit: str, sign: str) -> str:
    """A half width in mm or degrees, to five digits."""
    if not math.isfinite(t):
        return NONE
    factor, display_unit = drawn_in(t, unit)
    return joined(f"{sign}{t * factor:.5g}", display_unit)


def _cost(cost: float) -> str:
    return f"{cost:.6g}" if math.isfinite(cost) else NONE


def _percent(value: float) -> str:
    return NONE if math.isnan(value) else f"{100 * value:.4g}\u00a0%"


# ---- figures ----------------------------------------------------------------------------------------------------


def figure(result: xr.Dataset, kind: str | None = None) -> Figure:
    """A kind of figure; cost over accuracy where it was asked for, else what the tolerances cost, if none is named.

    Raises
    ------
    MechanismError : if there is no such kind, or the result has nothing for it
    """
    if not result.attrs["found"]:
        raise MechanismError(Finding("there is no allocation to draw", "--out", "widen the infeasible limits"))
    kind = kind or ("trade-off" if "trade_off_cost" in result else "cost")
    check_kind(kind, KINDS)
    if kind == "cost":
        return tolerance_cost(result, prices(result))
    if kind != "trade-off":
        return tolerance.figure(result, kind)
    if "trade_off_cost" not in result:
        raise MechanismError(Finding("no measure has a figure 'trade-off'", "--kind", "add --curve 21"))
    points = zip(result["trade_off_factor"].values.tolist(), result["trade_off_cost"].values.tolist(), strict=True)
    models = any(row["model"] for row in attribute(result, "prices"))
    return trade_off(result, list(points), _only_limit(result), result.attrs["choices"] == "discrete" and not models)


def _only_limit(result: xr.Dataset) -> tuple[str, float, str] | None:
    """The one limit there is, if it is one to either side: its measure, half width and SI unit."""
    limited: list[MeasureReading] = [read for read in readings(result) if read.limited]
    if len(limited) != 1 or any(map(math.isfinite, limited[0].bounds)):
        return None
    (read,) = limited
    return (read.name, read.limits[1], read.unit) if read.limits[0] == -read.limits[1] else None


@dataclass(frozen=True)
class PriceCurve:
    """What the half width t of one tolerance costs.

    name: its path; unit: SI, of t; tolerances, costs: points of the curve, t rising; processes: (name, t, cost) of each
    that can be chosen; chosen: (t, cost), NaN if there is none; group: what is bought with it, at one t for all.
    play: whether t is the clearance of a joint, and no half width.
    """

    name: str
    unit: str
    chosen: tuple[float, float]
    tolerances: Array = field(default_factory=lambda: np.empty(0))
    costs: Array = field(default_factory=lambda: np.empty(0))
    processes: tuple[tuple[str, float, float], ...] = ()
    group: str = ""
    play: bool = False


def prices(result: xr.Dataset) -> list[PriceCurve]:
    """What each tolerance with a cost would cost at other half widths."""
    paths = names(result, "parameter")
    units = dict(zip(paths, units_along(result["tolerance"], "parameter"), strict=True))
    curves = []
    for row in attribute(result, "prices"):
        path = str(row["path"])
        t, cost = (float(result[key].values[paths.index(path)]) for key in ("tolerance", "cost"))
        over, costs = np.empty(0), np.empty(0)
        if row["model"] and t > 0:
            low, high = max(t / AROUND, float(row["least"])), min(t * AROUND, float(row["most"] or math.inf))
            over, model = np.geomspace(low, high, POINTS), Cost(str(row["model"]), row["parameters"])
            costs = np.array([model.value(float(at)) for at in over])
        made = tuple((str(each["name"]), float(each["tolerance"]), float(each["cost"])) for each in row["choices"])
        curves.append(PriceCurve(path, units[path], (t, cost), over, costs, made, str(row["group"]), is_play(path)))
    return curves


CHOSEN = Look(1, dash="none", mark="D", size=6.5, order=5)


def trade_off(
    result: xr.Dataset,
    points: Sequence[tuple[float, float]],
    limit: tuple[str, float, str] | None = None,
    stepped: bool = False,
) -> Figure:
    """Least cost over accuracy, the stated limits marked.

    Parameters
    ----------
    result : whose name stands beneath
    points : share of the stated limits, and the least cost that keeps them, NaN if nothing does
    limit : (measure, half width, SI unit) of the one limit there is, along which the cost is drawn
    stepped : as with processes to choose from: what keeps a limit keeps any wider one too
    """
    from trunnion.views.draw import figure as draw

    part, cost = (np.array(column, float) for column in zip(*sorted(points), strict=True))
    factor, title = 100.0, "limits relative to the stated ones [%]"
    if limit is not None:
        name, half, si = limit
        scale, unit = scaled(half, si)
        factor, title = half * scale, f"limit of {name} ± [{unit}]" if unit else f"limit of {name} ±"
    marks: list[Mark] = [Line(factor * part, cost, "minimum cost", Look(0, 1.8, mark="o", size=3.2), steps=stepped)]
    feasible, bottom = np.isfinite(cost), None
    if feasible.any():
        bottom = 0.0 if cost[feasible].min() > 0 else None
        if part[feasible][0] <= 1.0 <= part[feasible][-1]:
            stated_cost = float(np.interp(1.0, part[feasible], cost[feasible]))
            label = f"stated limits: {number(stated_cost)}"
            marks.append(Line(np.array([factor]), np.array([stated_cost]), label, CHOSEN))
    if not feasible.all():
        lost = float(part[~feasible].max())
        ends = factor * part[0], factor * float(min(part[feasible & (part > lost)], default=lost))
        marks.append(Stripe(ends[0], ends[1], "infeasible", Look("rule", hatch="///", order=0.5)))
    chart = Chart(Axis(title), Axis("minimum cost", (bottom, None), count=7), marks, legend=Legend(least=1))
    return draw("Minimum cost of all tolerances over accuracy", result, [Panel("", [chart], 3.75)])


def tolerance_cost(result: xr.Dataset, curves: Sequence[PriceCurve]) -> Figure:
    """A panel for each tolerance, the dearest first: its cost over its half width, the chosen one marked."""
    from trunnion.views.draw import figure as draw

    order = sorted(curves, key=lambda price: -price.chosen[1] if math.isfinite(price.chosen[1]) else math.inf)
    largest = order[:MOST_PRICES]
    columns = min(len(largest), 2 if len(largest) in (2, 4) else 3)
    charts = [_price(price, k % columns == 0, columns < 3) for k, price in enumerate(largest)]
    panels = [Panel("", [chart], 3.2 if columns < 3 else 2.55) for chart in charts]
    more = f"the {len(largest)} most expensive of {len(curves)}" if len(largest) < len(curves) else ""
    return draw("Cost of each tolerance over its half width", result, panels, columns, WIDTH, more)


def _price(price: PriceCurve, first: bool, named: bool) -> Chart:
    """The cost of one tolerance; first: in its row, with a title of the costs; named: with room for the processes."""
    t, cost = price.chosen
    halves = [half for _, half, _ in price.processes] or [*price.tolerances.tolist(), t]
    finite = [half for half in halves if math.isfinite(half)]
    factor, unit = scaled(max(finite, default=1.0), price.unit)
    positive = [half for half in finite if half > 0]
    marks: list[Mark] = []
    if price.tolerances.size:
        marks.append(Line(price.tolerances * factor, price.costs, None, Look(0, 1.7)))
    middle = math.sqrt(max(positive) * min(positive)) if len(positive) == len(halves) else 0.0
    for name, half, each in price.processes:
        marks.append(Line(np.array([half * factor]), np.array([each]), None, Look(0, dash="none", mark="o")))
        left = half > middle
        if named:
            marks.append(Note(name, half * factor, each, "right" if left else "left", "bottom", data=True, colour="ink",
                              size=7.5, shift=(-6 if left else 6, 5)))  # fmt: skip
    chosen = ["none chosen"]
    if math.isfinite(t + cost):
        marks.append(Line(np.array([t * factor]), np.array([cost]), None, CHOSEN))
        width = joined(f"{'' if price.play else '±'}{t * factor:.4g}", unit)
        process = [ending(name, NAME) for name, half, _ in price.processes if half == t][:1]
        chosen = [f"{width}, cost {number(cost)}", *process]
    log = bool(positive) and max(positive) >= 4 * min(positive)
    dense = log and max(positive) < 100 * min(positive)
    sign = "clearance" if price.play else "±"
    across = Axis(f"{sign} [{unit}]" if unit else sign, log=log, count=(2 if dense else 1) if log else 3, margin=0.1,
                  form=(lambda value: f"{value:g}") if log else None)  # fmt: skip
    headed = f"{ending(price.name, NAME)} ({ending(price.group, NAME)})" if price.group else ending(price.name, NAME)
    side = Axis("cost" if first else "", count=4, margin=0.16)
    return Chart(across, side, marks, legend=None, title="\n".join([headed, *chosen]))


# ---- report -----------------------------------------------------------------------------------------------------


def report(result: xr.Dataset) -> str:
    """The report of the mechanism with the tolerances found, what to buy first."""
    kicker = "Tolerances of minimum cost for a linkage"
    if not result.attrs["found"]:
        return tolerance.report(result, kicker=kicker)
    pictures = [("Cost of each tolerance, the chosen one marked", figure(result, "cost"))]
    others = [trials(result)] if "trial_yield" in result else []
    parts = [Section("Allocated tolerances", headed(result), pictures, [bought(result), room(result)], others)]
    if "trade_off_cost" in result:
        about = "Minimum cost if all limits are multiplied by the same factor."
        curve = [("Minimum cost over accuracy", figure(result, "trade-off"))]
        parts.append(Section("Cost over accuracy", about, curve, [offers_table(result)]))
    return tolerance.report(result, parts, kicker)
