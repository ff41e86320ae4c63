"""One look for all matplotlib figures: sizes, palette, axes, legends, and the shading of positions without an answer.

Only the object-oriented interface is used, so figures can be made in any thread and leave no global state.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import AutoMinorLocator, MaxNLocator, MultipleLocator

from trunnion.errors import Status
from trunnion.results.quantities import quantity
from trunnion.views.common.cycle import Abscissa, Array, intervals, thin
from trunnion.views.common.lettering import Sheet, plain

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, MUTED, RULE, SHADE = "#1b1f24", "#5d6670", "#d9dde2", "#eceef1"
# Okabe and Ito's colours, which people with any colour vision tell apart; yellow is left out, it fades on white.
PALETTE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
DASHES = ("-", (0, (6, 2)), (0, (2, 1.5)), (0, (6, 2, 1.5, 2)))
WIDTH = 7.4


def style_of(index: int) -> dict[str, Any]:
    """Colour and dash of the n-th series; colours repeat with another dash."""
    return {"color": PALETTE[index % len(PALETTE)], "linestyle": DASHES[index // len(PALETTE) % len(DASHES)]}


def new(title: str, result: xr.Dataset, height: float = 4.3, width: float = WIDTH) -> Figure:
    """An empty figure with its title, of one line or more, and, smaller, the name of the mechanism."""
    layout = ConstrainedLayoutEngine(w_pad=0.08, h_pad=0.06, hspace=0.03, wspace=0.04)
    figure = Sheet(figsize=(width, height), dpi=150, facecolor="white", layout=layout)
    FigureCanvasAgg(figure)
    name = str(result.attrs.get("name", ""))
    figure.suptitle(
        "\n".join(map(plain, title.split("\n"))), x=0.012, ha="left", fontsize=12, fontweight="bold", color=INK
    )
    if name:
        figure.supxlabel(plain(name), x=0.99, ha="right", fontsize=7.5, color=MUTED)
    return figure


def dress(axes: Axes, x: str = "", y: str = "") -> None:
    """Quiet axes: a light grid below the curves, a frame left and below only, labels with units."""
    axes.set_axisbelow(True)
    axes.grid(True, color=RULE, linewidth=0.6)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(MUTED)
        axes.spines[side].set_linewidth(0.8)
    axes.tick_params(colors=MUTED, labelcolor=INK, labelsize=8.5, width=0.8, length=3.5)
    axes.tick_params(which="minor", length=2, width=0.6, color=MUTED)
    axes.set_xlabel(x, fontsize=9, color=INK)
    axes.set_ylabel(y, fontsize=9, color=INK)


def along(axes: Axes, over: Abscissa, y: str, *, zero: bool = True) -> None:
    """Axes over the drive: whole degrees at round angles, limits at the ends of the run; zero: with a line there."""
    dress(axes, plain(over.title), y)
    span = over.span
    if over.unit == "°" and span >= 90:
        axes.xaxis.set_major_locator(MultipleLocator(_round_angle(span)))
    elif over.unit == "":
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.xaxis.set_minor_locator(AutoMinorLocator(2))
    if over.values.size == 1:  # one position, one tick
        axes.set_xticks([float(over.values[0])])
        axes.set_xticks([], minor=True)
    elif span > 0:
        low = float(over.values.min() if over.period >= 0 else over.values.max() + over.period)
        axes.set_xlim(low, low + span)
    if zero:
        axes.axhline(0, color=MUTED, linewidth=0.8, zorder=1.5)


def _round_angle(span: float) -> float:
    return next((step for step in (15, 30, 45, 60, 90, 180, 360) if span / step <= 9), 720)


def curve(axes: Axes, over: Abscissa, values: Array, label: str | None, *, close: bool = True, **style: Any) -> None:
    """One curve over the drive: thinned without losing a peak, a dot where a position stands alone.

    close: over a whole turn lead the curve on to its first value; not for angles, which gain a turn.
    """
    x, y = over.values, np.asarray(values, dtype=float)
    if over.closed and close:
        x, y = np.append(x, x[0] + over.period), np.append(y, y[0])
    picked = thin(y)
    x, y = x[picked], y[picked]
    look: dict[str, Any] = {"linewidth": 1.6, "solid_joinstyle": "round"} | style
    axes.plot(x, y, label=None if label is None else plain(label), **look)
    known = np.isfinite(y)
    alone = known & ~np.append(False, known[:-1]) & ~np.append(known[1:], False)
    if alone.any():  # a single position makes no line; a dashed curve's dots are open
        face = "none" if look.get("linestyle", "-") != "-" else None
        paint = style.get("color", INK)
        axes.plot(x[alone], y[alone], "o", markersize=4.5, color=paint, markerfacecolor=face or paint)


def shade(axes: Axes, result: xr.Dataset, over: Abscissa) -> None:
    """Grey where positions have no answer, with the cause written once for each cause; hatched where one is not valid,
    for a pin loses contact."""
    runs = intervals(result)
    lost = [run for run in intervals(result, Status.CONTACT_LOST) if run.status == Status.CONTACT_LOST]
    x = over.values
    half = abs(float(x[1] - x[0])) / 2 if x.size > 1 else 0.5
    for run in lost:
        low, high = sorted((float(x[run.start]), float(x[run.stop - 1])))
        axes.axvspan(low - half, high + half, facecolor="none", edgecolor=SHADE, hatch="////", linewidth=0, zorder=0.5)
    if lost:
        _write_cause(axes, float(x[lost[0].start] + x[lost[0].stop - 1]) / 2, "not valid")
    said: set[str] = set()
    for run in runs:
        low, high = sorted((float(x[run.start]), float(x[run.stop - 1])))
        axes.axvspan(low - half, high + half, color=SHADE, linewidth=0, zorder=0.5)
        for edge in (low - half, high + half):
            axes.axvline(edge, color=MUTED, linewidth=0.6, linestyle=(0, (2, 2)), zorder=0.6)
        if run.text not in said:
            said.add(run.text)
            _write_cause(axes, (low + high) / 2, run.text)


def _write_cause(axes: Axes, x: float, text: str) -> None:
    short = text.split(":")[0]
    axes.text(
        x, 0.5, short, transform=axes.get_xaxis_transform(), rotation=90, ha="center", va="center",
        fontsize=8, color=MUTED, zorder=3, clip_on=True,
    )  # fmt: skip


def frame_peak(axes: Axes, most: float, shown: float, factor: float, unit: str) -> None:
    """Cut the vertical axis at `shown` where the curves rise far above it to `most`, and say so in the frame.

    shown: of `peaks.usual_peak`.
    """
    if shown >= most:
        return
    low, high, room = axes.dataLim.y0, axes.dataLim.y1, 1.05
    axes.set_ylim(max(min(low, 0.0), -shown * factor) * room, min(max(high, 0.0), shown * factor) * room)
    outside(axes, most, unit)


def outside(axes: Axes, most: float, unit: str) -> None:
    text = f"peak {quantity(most, unit)} is outside the frame,\nnear a dead centre; --uncut shows it"
    box = {"boxstyle": "round,pad=0.2", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}
    axes.text(0.99, 0.97, text, transform=axes.transAxes, ha="right", va="top", fontsize=8, color=MUTED, bbox=box)


def square(axes: Axes, most: float, shown: float, factor: float, unit: str) -> None:
    """Equal scales on both axes; where a vector grows far beyond `shown`, the window around the origin of that size."""
    if shown >= most:
        axes.set_aspect("equal", adjustable="datalim")
        axes.margins(0.13)
        return
    half = shown * factor
    axes.set_aspect("equal", adjustable="box")
    axes.set(xlim=(-half, half), ylim=(-half, half))
    outside(axes, most, unit)


def legend(axes: Axes, most: int = 6, room: int = 90, least: int = 2, lift: float = 0.0) -> None:
    """A legend in rows above the axes, where it hides no curve; room: characters that a row holds; none of fewer than
    `least` entries; lift: height of what stands between axes and legend, points.
    """
    handles, labels = axes.get_legend_handles_labels()
    if len(handles) < least:
        return
    fits = sum(map(len, labels)) + 7 * len(labels) <= room  # with the line samples
    columns = len(labels) if fits else max(1, min(most, (room + 10) // (max(map(len, labels)) + 7)))
    axes.legend(
        handles, labels, loc="lower left", bbox_to_anchor=(-0.02, 1.0), ncols=columns, frameon=False, fontsize=8.5,
        labelcolor=INK, handlelength=2.2, columnspacing=1.6, borderaxespad=0.3 + lift / 8.5,
    )  # fmt: skip
