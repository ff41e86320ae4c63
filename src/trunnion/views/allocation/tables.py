"""What an allocation found, as tables: what to buy, how the limits are kept, what accuracy costs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from trunnion.results.attributes import attribute
from trunnion.results.dataset import units_along
from trunnion.results.quantities import drawn_in, joined
from trunnion.views.common.cycle import names
from trunnion.views.readings import readings
from trunnion.views.table import Table
from trunnion.views.texts import is_play, share, share_interval
from trunnion.views.tolerance import tables as tolerance_tables

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["bought", "headed", "offers_table", "room", "tables", "trials"]

CRITERIA = {"worst-case": "worst case", "rss": "root of the sum of squares", "yield": "yield"}


def tables(result: xr.Dataset) -> list[Table]:
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
        if "yield_checked" in result:
            checked, *ends = (float(result[f"yield_checked{end}"]) for end in ("", "_low", "_high"))
            told += f", yield of fresh samples {share_interval(checked, *ends)}"
        return told
    return f"{told}, {'global optimum to first order' if result.attrs['proven'] else 'best found'}"


def bought(result: xr.Dataset) -> Table:
    """Each tolerance that has a cost: what it is to be, what it costs, and what it was."""
    rows = []
    units = units_along(result["tolerance"], "parameter")
    paths, choices = names(result, "parameter"), [str(one) for one in result["choice"].values]
    keys = ("bought", "tolerance", "cost", "cost_share", "tolerance_before", "cost_before")
    columns = {key: np.asarray(result[key].values, float) for key in keys}
    groups = {str(one["path"]): str(one["group"]) for one in attribute(result, "prices")}
    for j in np.flatnonzero(columns["bought"]):
        t, cost, part, was, paid = (float(columns[key][j]) for key in keys[1:])
        sign = "" if is_play(paths[j]) else "±"
        rows.append(
            [paths[j], half_width(t, units[j], sign), choices[j], groups.get(paths[j], ""), _known(cost),
             share(part, 1), half_width(was, units[j], sign), _known(paid)]
        )  # fmt: skip
    total, before = float(result["cost_total"]), float(result["cost_total_before"])
    rows.append(["all", "", "", "", _known(total), share(1.0), "", _known(before)])
    head = ["parameter", "tolerance", "made", "group", "cost", "share", "as stated", "cost as stated"]
    return _without_empty(Table(headed(result), head, rows))


def half_width(t: float, unit: str, sign: str = "±") -> str:
    """A half width in mm or degrees, to five digits."""
    if not math.isfinite(t):
        return "—"
    factor, shown = drawn_in(t, unit)
    return joined(f"{sign}{t * factor:.5g}", shown)


def _known(cost: float) -> str:
    return f"{cost:.6g}" if math.isfinite(cost) else "—"


def _without_empty(table: Table) -> Table:
    """Without columns that say nothing."""
    kept = [k for k in range(len(table.head)) if k == 0 or any(row[k] not in ("", "—") for row in table.rows)]
    return Table(table.title, [table.head[k] for k in kept], [[row[k] for k in kept] for row in table.rows])


def room(result: xr.Dataset) -> Table:
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
            [read.name, read.limits_said, _share(read.value("used")), margin,
             _share(max(found, default=math.nan)), _share(read.value("yield")),
             "—" if math.isnan(wider) else f"{wider:.4g}"]
        )  # fmt: skip
    head = ["measure", "limits", "used", "margin", "worst case found", "yield", "1\u00a0% wider saves"]
    return _without_empty(Table("share of the limits that is used", head, rows))


def _share(value: float) -> str:
    return "—" if math.isnan(value) else f"{100 * value:.4g}\u00a0%"


def trials(result: xr.Dataset) -> Table:
    """What was sampled on the way to a yield."""
    keys = ("trial_margin", "trial_cost", "trial_yield", "trial_yield_low", "trial_yield_high")
    rows = [
        [f"{z:.5g} σ", _known(cost), *(_share(one) for one in shares)]
        for z, cost, *shares in zip(*(np.asarray(result[key].values, float).tolist() for key in keys), strict=True)
    ]
    several = int(np.sum(np.isfinite(result["yield_margin"].values))) > 1
    margin = "mean margin of the limits" if several else "margin of every limit"
    return Table("trials", [margin, "cost", "yield", "at least", "at most"], rows)


def offers_table(result: xr.Dataset) -> Table:
    """Cost over accuracy."""
    rows = [
        [f"{100 * factor:.4g}\u00a0%", _known(cost) if math.isfinite(cost) else "infeasible"]
        for factor, cost in zip(result["trade_off_factor"].values, result["trade_off_cost"].values, strict=True)
    ]
    return Table("cost over accuracy", ["limits, relative to stated", "minimum cost"], rows)
