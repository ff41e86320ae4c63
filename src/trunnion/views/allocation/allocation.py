"""What an allocation found, as tables, figures and a report: what to buy, what it does then, what accuracy costs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.results.attributes import attribute
from trunnion.results.dataset import units_along
from trunnion.statistics.costs import Cost
from trunnion.views.allocation.cost import PriceCurve, tolerance_cost, trade_off
from trunnion.views.allocation.tables import bought, headed, offers_table, room, tables, trials
from trunnion.views.common.cycle import names
from trunnion.views.page import Section
from trunnion.views.readings import readings
from trunnion.views.texts import is_play
from trunnion.views.tolerance import KINDS as OF_TOLERANCES
from trunnion.views.tolerance import figure as tolerance_figure
from trunnion.views.tolerance import report as tolerance_report

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["KINDS", "check_kind", "figure", "report", "tables"]

KINDS = ("cost", "trade-off", *OF_TOLERANCES)
POINTS = 120  # of the curve of a cost
AROUND = 4.0  # how many times narrower and wider than the chosen tolerance the curve goes


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
    pairs = zip(result["trade_off_factor"].values.tolist(), result["trade_off_cost"].values.tolist(), strict=True)
    return trade_off(result, list(pairs), _limit(result), stepped=_all_choices(result))


def _all_choices(result: xr.Dataset) -> bool:
    """Whether every tolerance is chosen from processes, so that the cost goes in steps."""
    return result.attrs["choices"] == "discrete" and not any(one["model"] for one in attribute(result, "prices"))


def _limit(result: xr.Dataset) -> tuple[str, float, str] | None:
    """The one limit there is, if it is one to either side."""
    found = [(read.name, read.limits[1], read.unit) for read in readings(result) if read.limited]
    read = readings(result)[0]
    alike = len(found) == 1 and read.limits[0] == -read.limits[1] and not any(map(math.isfinite, read.bounds))
    return found[0] if alike else None


def prices(result: xr.Dataset) -> list[PriceCurve]:
    """What each tolerance with a cost would cost at other half widths."""
    units = dict(zip(names(result, "parameter"), units_along(result["tolerance"], "parameter"), strict=True))
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
                path, units[path], (t, cost), *curve, processes=made, group=str(one["group"]), play=is_play(path)
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
    told = [bought(result).titled(""), room(result)]
    told += [trials(result)] if "trial_yield" in result else []
    first = [Section("Allocated tolerances", headed(result), pictures, told[:2], told[2:])]
    if "trade_off_cost" in result:
        about = "Minimum cost if all limits are multiplied by the same factor."
        curve = [("Minimum cost over accuracy", figure(result, "trade-off"))]
        first.append(Section("Cost over accuracy", about, curve, [offers_table(result).titled("")]))
    return tolerance_report(result, first, kicker)
