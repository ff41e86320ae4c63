"""Panels of what each toleranced number has in a measure: contributions to first order, and Sobol indices."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from trunnion.views.common.cycle import names
from trunnion.views.common.figures import INK, MUTED, PALETTE, dress, legend
from trunnion.views.common.lettering import plain
from trunnion.views.tolerance.readings import ContributionRow, MeasureReading

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import FigureBase

__all__ = ["MOST_BARS", "contributions", "rows_of", "rows_of_sobol", "sobol"]

MOST_BARS = 16  # numbers that have a bar of their own
LEAST, LEAST_INDEX = 0.001, 0.005  # shares below it have none
PALE = "#b9c3cd"
ROOM = 44  # characters that the legend beside long names has
INSIDE = 0.09  # share of a bar that holds its number
NAME = 34  # characters of a name beside a bar


def rows_of(read: MeasureReading) -> int:
    """How many rows of bars the contributions to this measure take."""
    shown, rest = _kept(read)
    return len(shown) + bool(rest)


def rows_of_sobol(read: MeasureReading) -> int:
    """How many rows of bars its Sobol indices take."""
    return len(_kept_indices(read))


def _kept(read: MeasureReading) -> tuple[list[ContributionRow], list[ContributionRow]]:
    """What has a bar of its own, and the rest: what is small, or too much."""
    found = read.contributions
    large = [one for one in found if one.largest_share >= LEAST]
    shown = large[:MOST_BARS] or found[:1]
    if len(found) == len(shown) + 1:  # one more takes no more room than its being left out
        shown = found
    return shown, [one for one in found if one not in shown]


def _kept_indices(read: MeasureReading) -> list[int]:
    """Numbers whose Sobol indices have bars, the largest first."""
    total = np.where(np.isfinite(read.row("total_order")), read.row("total_order"), -1.0)
    order = [int(k) for k in np.argsort(-total, kind="stable")]
    large = [k for k in order if total[k] >= LEAST_INDEX][: MOST_BARS + 1]
    return large or order[:1]


def contributions(parent: FigureBase, read: MeasureReading) -> None:
    """Share of each number in the sum of squares, sorted, with the running total; beside it those in the worst case,
    and in the variance where they are others."""
    axes = parent.subplots()
    shown, rest = _kept(read)
    labels = [f"{_short(one.short)}  {one.limits}".rstrip() for one in shown]
    keys = ("rss_share", "worst_share", "variance_share")
    rss, worst, variance = ([getattr(one, key) for one in shown] for key in keys)
    if rest:
        labels.append(f"{len(rest)} others")
        for row, key in zip((rss, worst, variance), keys, strict=True):
            row.append(float(np.nansum([getattr(one, key) for one in rest])))
    place = np.arange(len(labels))
    dress(axes, "share [%]", "")
    alone = "RSS², uncorrelated" if read.correlated else "RSS²"
    axes.barh(place - 0.17, 100 * np.array(rss), 0.4, color=PALETTE[0], label=alone, zorder=2)
    if read.shares_apart:
        axes.barh(place + 0.12, 100 * np.array(variance), 0.18, color=PALETTE[2], label="variance", zorder=2)
        axes.barh(place + 0.3, 100 * np.array(worst), 0.18, color=PALE, label="worst case", zorder=2)
    else:
        axes.barh(place + 0.23, 100 * np.array(worst), 0.28, color=PALE, label="worst case", zorder=2)
    running = 100 * np.nancumsum(rss)
    axes.plot(running, place - 0.17, color=INK, linewidth=1.2, marker="o", markersize=3.5, zorder=3,
              label="RSS², added up")  # fmt: skip
    told = [100 * part for part in variance if math.isfinite(part)] if read.shares_apart else []
    most = max([100.0, float(running.max(initial=0.0)), *told])
    _frame(axes, labels, most, min([0.0, *told]))
    if min([0.0, *told]) < 0:
        axes.axvline(0, color=MUTED, linewidth=0.8)
    for y, part in zip(place, rss, strict=True):
        if math.isfinite(part):
            wide = part > INSIDE
            axes.annotate(f"{100 * part:.1f}", (100 * part, y - 0.17), xytext=(-6 if wide else 4, 0), va="center",
                          textcoords="offset points", ha="right" if wide else "left", fontsize=7.5,
                          color="white" if wide else INK, zorder=4)  # fmt: skip
    legend(axes, room=ROOM)


def sobol(parent: FigureBase, read: MeasureReading) -> None:
    """First-order and total share of each number in the variance, with 95 % intervals, sorted by the total."""
    axes = parent.subplots()
    paths = names(read.result, "parameter")
    first, total = read.row("first_order"), read.row("total_order")
    kept, about = _kept_indices(read), {one.name: one.short for one in read.contributions}
    place = np.arange(len(kept))
    dress(axes, "share of the variance [%]", "")
    for values, key, offset, colour, label in (
        (total, "total_order", 0.2, PALE, "total, with all interactions"),
        (first, "first_order", -0.2, PALETTE[0], "first order, alone"),
    ):
        low, high = read.row(f"{key}_low"), read.row(f"{key}_high")
        spread = 100 * np.stack([values - low, high - values])[:, kept] if low.size and high.size else None
        spread = None if spread is None else np.where(spread > 0, spread, 0.0)
        axes.barh(place + offset, 100 * values[kept], 0.36, color=colour, label=label, zorder=2, xerr=spread,
                  error_kw={"ecolor": INK, "elinewidth": 1.0, "capsize": 2.5})  # fmt: skip
    highs = [read.row(f"{key}_high") for key in ("first_order", "total_order")]
    most = float(np.nanmax(np.concatenate([first, total, *highs]), initial=0.0))
    left = len(paths) - len(kept)
    _frame(axes, [_short(about[paths[k]]) for k in kept], 100 * max(most, 0.05))
    if left:
        axes.text(0.99, 0.02, f"{left} smaller are not shown", transform=axes.transAxes, ha="right", va="bottom",
                  fontsize=8, color=MUTED)  # fmt: skip
    axes.axvline(0, color=MUTED, linewidth=0.8)
    legend(axes, room=ROOM)


def _short(name: str) -> str:
    """A name that leaves room for the bars: the end of a long one."""
    return name if len(name) <= NAME else f"…{name[1 - NAME :]}"


def _frame(axes: Axes, labels: list[str], most: float, least: float = 0.0) -> None:
    """Names down the side, the largest on top."""
    axes.set_yticks(range(len(labels)), [plain(label) for label in labels])
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")
    axes.set_ylim(len(labels) - 0.4, -0.6)
    axes.set_xlim(1.04 * least, 1.04 * most)
