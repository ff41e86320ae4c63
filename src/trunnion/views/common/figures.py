"""One look for all matplotlib figures: sizes, palette, axes, legends, and the shading of positions without an answer.

Only the object-oriented interface is used, so figures can be made in any thread and leave no global state.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import AutoMinorLocator, MaxNLocator, MultipleLocator

from trunnion.views.common.cycle import Abscissa
from trunnion.views.common.lettering import Sheet, plain

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, MUTED, RULE, SHADE = "#1b1f24", "#5d6670", "#d9dde2", "#eceef1"
# Okabe and Ito's colours, which people with any colour vision tell apart; yellow is left out, it fades on white.
PALETTE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
WIDTH = 7.4


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
