"""Figures of an allocation: what accuracy costs, and what each tolerance costs with the chosen one marked.

What a tolerance costs is a `PriceCurve`: a curve, or the processes that can be chosen from.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from trunnion.results.quantities import joined, number, scaled
from trunnion.views.common.cycle import Array
from trunnion.views.common.figures import INK, MUTED, PALETTE, dress, legend, new
from trunnion.views.common.lettering import plain

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["MOST_PRICES", "PriceCurve", "tolerance_cost", "trade_off"]

MOST_PRICES = 12
NAME = 30  # characters of a name over a panel
COLUMNS, SIDE = 3, 2.3  # panels in a row, height of one in inches
POINT: dict[str, Any] = {"marker": "D", "color": PALETTE[1], "markersize": 6.5, "linestyle": "none", "zorder": 5}


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


def trade_off(
    result: xr.Dataset,
    points: Sequence[tuple[float, float]],
    limit: tuple[str, float, str] | None = None,
    stepped: bool = False,
) -> Figure:
    """Least cost over accuracy, the stated limits marked.

    result: whose name stands beneath; points: share of the stated limits, and the least cost that keeps them, NaN if
    nothing does; limit: (measure, half width, SI unit) of the one limit there is: the axis is then
    that limit, else its share of the stated ones. stepped: as with processes to choose from: what keeps a limit keeps
    any wider one too.
    """
    drawn = new("Minimum cost of all tolerances over accuracy", result)
    axes = drawn.subplots()
    share, cost = (np.array([one[k] for one in sorted(points)], float) for k in (0, 1))
    if limit is None:
        factor, title = 100.0, "limits relative to the stated ones [%]"
    else:
        name, half, si = limit
        scale, unit = scaled(half, si)
        factor, title = half * scale, f"limit of {name} ± [{unit}]" if unit else f"limit of {name} ±"
    dress(axes, plain(title), "minimum cost")
    steps: dict[str, Any] = {"drawstyle": "steps-post"} if stepped else {}
    axes.plot(factor * share, cost, color=PALETTE[0], linewidth=1.8, marker="o", markersize=3.2,
              label="minimum cost", **steps)  # fmt: skip
    known = np.isfinite(cost)
    if known.any():
        stated = float(np.interp(1.0, share[known], cost[known]))
        inside = share[known][0] <= 1.0 <= share[known][-1]
        if inside:
            axes.plot([factor], [stated], label=f"stated limits: {number(stated)}", **POINT)
    lost = share[~known]
    if lost.size:
        low, high = factor * share[0], factor * float(lost.max())
        axes.axvspan(low, high, facecolor="none", edgecolor="#d9dde2", hatch="///", linewidth=0, zorder=0.5)
        axes.text((low + high) / 2, 0.5, "infeasible", transform=axes.get_xaxis_transform(), rotation=90,
                  ha="center", va="center", fontsize=8, color=MUTED)  # fmt: skip
    if known.any():
        axes.set_ylim(bottom=0.0 if cost[known].min() > 0 else None)
    axes.yaxis.set_major_locator(MaxNLocator(nbins=7))
    legend(axes, least=1)
    return drawn


def tolerance_cost(result: xr.Dataset, prices: Sequence[PriceCurve]) -> Figure:
    """A panel for each tolerance, the dearest first: its cost over its half width, the chosen one marked."""
    order = sorted(prices, key=lambda one: -one.chosen[1] if math.isfinite(one.chosen[1]) else math.inf)
    shown = order[:MOST_PRICES]
    columns = min(len(shown), 2 if len(shown) in (2, 4) else COLUMNS)
    rows = -(-len(shown) // columns)
    drawn = new(
        "Cost of each tolerance over its half width", result, 1.0 + rows * SIDE * (1.25 if columns < COLUMNS else 1.0)
    )
    grid = drawn.subplots(rows, columns, squeeze=False).ravel()
    for axes in grid[len(shown) :]:
        axes.set_visible(False)
    for k, (axes, price) in enumerate(zip(grid, shown, strict=False)):
        _panel(axes, price, k % columns == 0, columns < COLUMNS)
    if len(shown) < len(prices):
        drawn.text(0.012, 0.005, f"the {len(shown)} most expensive of {len(prices)}", fontsize=7.5, color=MUTED)
    return drawn


def _panel(axes: Axes, price: PriceCurve, first: bool, roomy: bool) -> None:
    known = [t for _, t, _ in price.processes] or [*price.tolerances.tolist(), price.chosen[0]]
    factor, unit = scaled(max((t for t in known if math.isfinite(t)), default=1.0), price.unit)
    sign = "clearance" if price.play else "±"
    dress(axes, f"{sign} [{unit}]" if unit else sign, "cost" if first else "")
    lines = [_headed(price), *_told(price, factor, unit)]
    axes.set_title("\n".join(plain(line) for line in lines), fontsize=8.5, color=INK, loc="left")
    if price.tolerances.size:
        axes.plot(price.tolerances * factor, price.costs, color=PALETTE[0], linewidth=1.7)
    middle = math.sqrt(max(known) * min(known)) if known and min(known) > 0 else 0.0
    for name, t, cost in price.processes:
        axes.plot([t * factor], [cost], "o", color=PALETTE[0], markersize=4.5)
        if roomy:
            side = -1 if t > middle else 1
            axes.annotate(plain(name), (t * factor, cost), xytext=(6 * side, 5), textcoords="offset points",
                          fontsize=7.5, color=INK, ha="right" if side < 0 else "left")  # fmt: skip
    t, cost = price.chosen
    if math.isfinite(t) and math.isfinite(cost):
        axes.plot([t * factor], [cost], **POINT)
    _across(axes, [one * factor for one in known if one > 0 and math.isfinite(one)])
    axes.margins(x=0.1, y=0.16)
    axes.yaxis.set_major_locator(MaxNLocator(nbins=4))


def _told(price: PriceCurve, factor: float, unit: str) -> list[str]:
    """What is chosen, what it costs, and by which process: "±0.0105 mm, cost 9"."""
    t, cost = price.chosen
    if not math.isfinite(t + cost):
        return ["none chosen"]
    found = [name for name, half, _ in price.processes if half == t]
    told = joined(f"{'' if price.play else '±'}{t * factor:.4g}", unit)
    return [f"{told}, cost {number(cost)}", *(_end(name) for name in found[:1])]


def _end(name: str) -> str:
    return name if len(name) <= NAME else f"…{name[1 - NAME :]}"


def _headed(price: PriceCurve) -> str:
    """Name of a tolerance, with its group: the end of a long one, so that those of one group differ."""
    return f"{_end(price.name)} ({_end(price.group)})" if price.group else _end(price.name)


def _across(axes: Axes, known: list[float]) -> None:
    """A logarithmic axis where the tolerances differ much, with plain numbers."""
    if not known or max(known) < 4 * min(known):
        axes.xaxis.set_major_locator(MaxNLocator(nbins=4))
        return
    axes.set_xscale("log")
    decades = math.log10(max(known) / min(known))
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if decades < 2 else (1.0,), numticks=6))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
