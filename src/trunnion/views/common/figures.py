"""One look for all matplotlib figures: sizes, palette, axes, legends, and the shading of positions without an answer.

Only the object-oriented interface is used, so figures can be made in any thread and leave no global state.
"""

from __future__ import annotations

import io
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING
from unicodedata import category

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, fontManager, get_font
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.text import Text
from matplotlib.ticker import AutoMinorLocator, MaxNLocator, MultipleLocator

from trunnion.views.common.cycle import Abscissa, Array

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.backend_bases import RendererBase
    from matplotlib.text import Annotation

__all__ = ["Labels", "Sheet", "plain"]


# ---- letters --------------------------------------------------------------------------------------------------------


HOME = "DejaVu Sans"  # comes with matplotlib
# Common fonts for the scripts it lacks; those that are installed are asked in this order.
OTHERS = (
    "Noto Sans CJK SC", "Noto Sans CJK JP", "Noto Sans SC", "Noto Sans JP", "Noto Sans KR", "Source Han Sans SC",
    "Microsoft YaHei", "Yu Gothic", "Malgun Gothic", "PingFang SC", "Hiragino Sans", "Apple SD Gothic Neo",
    "WenQuanYi Zen Hei", "WenQuanYi Micro Hei", "Droid Sans Fallback", "Noto Sans Devanagari", "Noto Sans Thai",
    "Arial Unicode MS",
)  # fmt: skip


class Sheet(Figure):
    """A figure whose texts find their signs in whichever of the installed fonts has them."""

    _lettered = False  # since the last drawing

    def draw(self, renderer: RendererBase) -> None:
        """Give every text the fonts, then draw.

        Matplotlib draws a figure that has a layout twice, the first time with the renderer's methods replaced by
        empty ones. That pass only has to arrange the figure; all its paths would be prepared for nothing.
        """
        if not self._lettered:
            for text in self.findobj(Text):
                text.set_fontfamily(list(families()))
        engine = self.get_layout_engine()
        self._lettered = engine is not None and "draw_path" in vars(renderer)
        if self._lettered and engine is not None:
            engine.execute(self)
            for axes in self.axes:
                axes.apply_aspect()
        else:
            super().draw(renderer)

    def _repr_png_(self) -> bytes:
        """What a notebook shows; matplotlib tells it only of figures that pyplot has made."""
        buffer = io.BytesIO()
        self.savefig(buffer, format="png", dpi=100)
        return buffer.getvalue()


@cache
def families() -> tuple[str, ...]:
    """The fonts to look in, in order."""
    installed = {font.name for font in fontManager.ttflist}
    return (HOME, *(name for name in OTHERS if name in installed))


@cache
def _signs() -> frozenset[int]:
    """All signs that can be drawn both upright and bold."""
    signs = set[int]()
    for name in families():
        upright, bold = (set(get_font(findfont(FontProperties(family=name, weight=weight))).get_charmap())
                         for weight in ("normal", "bold"))  # fmt: skip
        signs |= upright & bold
    return frozenset(signs)


def plain(name: str) -> str:
    r"""A name that matplotlib shows as it is: `$` starts no formula, a leading `_` hides no legend entry.

    A sign that no font has, or that is invisible, is told by its code: \u66f2, as YAML and JSON write it too.
    """
    codes = (f"\\u{ord(sign):04x}" if ord(sign) < 0x10000 else f"\\U{ord(sign):08x}" for sign in name)
    text = "".join(sign if ord(sign) in _signs() and category(sign)[0] != "C" else code
                   for sign, code in zip(name, codes, strict=True)).replace("$", r"\$")  # fmt: skip
    return f"\u2009{text}" if text.startswith("_") else text


# ---- axes -----------------------------------------------------------------------------------------------------------


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
        axes.xaxis.set_major_locator(
            MultipleLocator(next((step for step in (15, 30, 45, 60, 90, 180, 360) if span / step <= 9), 720))
        )
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


def legend(axes: Axes, most: int = 6, room: int = 90, least: int = 2) -> None:
    """A legend in rows above the axes, where it hides no curve; room: characters that a row holds; none of fewer than
    `least` entries.
    """
    handles, labels = axes.get_legend_handles_labels()
    if len(handles) < least:
        return
    fits = sum(map(len, labels)) + 7 * len(labels) <= room  # with the line samples
    columns = len(labels) if fits else max(1, min(most, (room + 10) // (max(map(len, labels)) + 7)))
    axes.legend(
        handles, labels, loc="lower left", bbox_to_anchor=(-0.02, 1.0), ncols=columns, frameon=False, fontsize=8.5,
        labelcolor=INK, handlelength=2.2, columnspacing=1.6, borderaxespad=0.3,
    )  # fmt: skip


# ---- names in a drawing --------------------------------------------------------------------------------------------

SIDES = np.array([[np.cos(angle), np.sin(angle)] for angle in np.radians(np.arange(0, 360, 15))])
GAPS = (5.0, 8.0, 12.0, 18.0, 26.0)  # points from the place to the name
FURTHER = 0.07  # what a gap more costs, beside the share of the name's box that is not empty
DARK = 3.0  # pale bodies count almost as much as lines
LEAST = 6.0  # points around every place that are its joint's, however pale its symbol is
MARGIN = 1.5  # points that are to be empty around a name
CROSSED, CUT, STRAY = 5.0, 100.0, 0.4  # costs of lying on another name, outside the figure, nearer to another place


@dataclass
class Labels:
    """The names of one figure: added while it is drawn, placed when all else is there.

    The figure is painted once without names; what is dark there is in the way. So a name keeps off links, springs,
    ground, arrows, curves and titles alike, whatever draws them.
    """

    figure: Figure
    waiting: list[tuple[Annotation, float]] = field(default_factory=list)

    def add(
        self, axes: Axes, text: str, place: Array, size: float = 10.0, symbol: float = 0.0, weight: str = "bold"
    ) -> None:
        """A name of a place in the coordinates of the axes. size: of its letters, points; symbol: half width of what is
        drawn there, in the same coordinates."""
        if not np.all(np.isfinite(place)):
            return
        note = axes.annotate(
            plain(text), (place[0], place[1]), xytext=(0, 0), textcoords="offset points", ha="center", va="center",
            fontsize=size, fontweight=weight, color=INK, zorder=8, annotation_clip=False, visible=False,
            bbox={"boxstyle": "round,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.75},
        )  # fmt: skip
        note.set_in_layout(False)  # which it would change
        self.waiting.append((note, symbol))

    def place(self) -> None:
        """Move every name to where it covers least of what is drawn, and of the names before it."""
        if not self.waiting:
            return
        canvas, scale = FigureCanvasAgg(self.figure), self.figure.dpi / 72
        canvas.draw()  # type: ignore[no-untyped-call]
        pixels = np.asarray(canvas.buffer_rgba())[::-1, :, :3]  # type: ignore[no-untyped-call]  # rows from below
        dark = np.clip(DARK * (1 - pixels.min(axis=2) / 255), 0, 1)
        edge, spots = np.array(dark.shape)[::-1], list[Array]()
        for note, symbol in self.waiting:
            ends = note.axes.transData.transform(np.add([note.xy] * 2, [(0.0, 0.0), (symbol, 0.0)]))  # type: ignore[union-attr]
            spots.append(ends[0])
            _fill(dark, ends[0], max(LEAST * scale, float(np.hypot(*(ends[1] - ends[0])))), 1.0)
        for k, (note, _) in enumerate(self.waiting):
            note.set_visible(True)
            extent = note.get_window_extent(canvas.get_renderer())  # type: ignore[no-untyped-call]
            half = 0.5 * np.array([extent.width, extent.height]) + MARGIN * scale
            others, best = np.array(spots[:k] + spots[k + 1 :]).reshape(-1, 2), (np.inf, np.zeros(2))
            for far, gap in enumerate(GAPS):
                for side in SIDES:
                    offset = gap * scale * side + half * side / np.abs(side).max()
                    low, high = (np.rint(spots[k] + offset + sign * half).astype(int) for sign in (-1, 1))
                    beyond = bool(np.any((low < 0) | (high > edge)))
                    stray = bool(np.any(np.linalg.norm(spots[k] + offset - others, axis=1) < np.hypot(*offset)))
                    box = dark[max(low[1], 0) : max(high[1], 1), max(low[0], 0) : max(high[0], 1)]
                    cost = (box.mean() if box.size else 1.0) + FURTHER * far + CUT * beyond + STRAY * stray
                    best = min(best, (float(cost), offset), key=lambda pair: pair[0])
            note.set_position(tuple(best[1] / scale))
            _fill(dark, spots[k] + best[1], half, CROSSED)


def _fill(dark: Array, middle: Array, half: Array | float, value: float) -> None:
    """Make a box of the pixels dark."""
    low, high = (np.maximum(np.rint(middle + sign * half).astype(int), 0) for sign in (-1, 1))
    dark[low[1] : high[1], low[0] : high[0]] = value
