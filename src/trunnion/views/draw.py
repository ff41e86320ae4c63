"""Charts drawn by matplotlib, in one look for all figures: sizes, palette, axes, legends, names in drawings.

Only the object-oriented interface is used, so figures can be made in any thread and leave no global state.
"""

from __future__ import annotations

import io
import os
import re
import warnings
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps, patches, rc_context, ticker
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import BoundaryNorm, Colormap, ListedColormap, LogNorm, Normalize, to_hex, to_rgba
from matplotlib.figure import Figure
from matplotlib.font_manager import fontManager
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.text import Text

from trunnion.errors import Finding, MechanismError
from trunnion.files import whole
from trunnion.views import charts
from trunnion.views.axis import Abscissa, Array
from trunnion.views.charts import Axis, Chart, ColourScale, Contours, Line, Look, Mark, Note, Plot, Rule

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.backend_bases import RendererBase

INK, MUTED, RULE, SHADE, LIMIT, PALE = "#1b1f24", "#5d6670", "#d9dde2", "#eceef1", "#a1260d", "#b9c3cd"
COLOURS = {"ink": INK, "muted": MUTED, "rule": RULE, "shade": SHADE, "limit": LIMIT, "pale": PALE}
# Okabe and Ito's colours, which people with any colour vision tell apart; yellow is left out, it fades on white.
PALETTE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
DASHES: dict[str, Any] = {"solid": "-", "long": (0, (5, 2)), "dashed": (0, (3, 2)), "short": (0, (2, 1.5)),
                          "dotted": (0, (1, 1.5)), "dash-dot": (0, (6, 2, 1.5, 2)),
                          "none": "none"}  # fmt: skip
BANDED = colormaps["viridis"]
# without the end that fades on white
RISING: Colormap = ListedColormap(colormaps["viridis"](np.linspace(0.0, 0.9, 256)), "viridis to green")
WIDTH = 7.4
PAGE = {1: WIDTH, 2: 12.6, 3: 14.4}  # width of a figure by its columns, inches
# fonts for the scripts that matplotlib's own lacks; those that are installed are asked in this order
FONTS = ("DejaVu Sans", "Noto Sans CJK SC", "Noto Sans CJK JP", "Noto Sans SC", "Noto Sans JP", "Noto Sans KR",
         "Microsoft YaHei", "Yu Gothic", "Malgun Gothic", "PingFang SC", "Hiragino Sans", "WenQuanYi Zen Hei",
         "Droid Sans Fallback", "Noto Sans Devanagari", "Noto Sans Thai", "Arial Unicode MS")  # fmt: skip
CONTROL = re.compile(r"[\x00-\x09\x0b-\x1f\x7f]")
FORMATS = ("png", "svg", "pdf", "jpg", "jpeg")


# ---- sheets ---------------------------------------------------------------------------------------------------------


class Sheet(Figure):
    """A figure whose texts find their signs in whichever of the installed fonts has them."""

    def draw(self, renderer: RendererBase) -> None:
        """Give every text the fonts, then draw; a sign that no font has is a box."""
        for text in self.findobj(Text):
            text.set_fontfamily(list(families()))
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Glyph")
            super().draw(renderer)

    def _repr_png_(self) -> bytes:
        """What a notebook shows; matplotlib does this only for figures that pyplot has made."""
        buffer = io.BytesIO()
        self.savefig(buffer, format="png", dpi=100)
        return buffer.getvalue()


@cache
def families() -> tuple[str, ...]:
    """The fonts to look in, in order."""
    installed = {font.name for font in fontManager.ttflist}
    return tuple(name for name in FONTS if name in installed)


def plain(text: str) -> str:
    """A text that matplotlib shows as it is: `$` starts no formula, a leading `_` hides no legend entry."""
    text = CONTROL.sub(" ", text).replace("$", r"\$")
    return f"\u2009{text}" if text.startswith("_") else text


def new(title: str, result: xr.Dataset, height: float = 4.3, width: float = WIDTH) -> Figure:
    """An empty figure with its title, of one line or more, and, smaller, the name of the mechanism."""
    layout = ConstrainedLayoutEngine(w_pad=0.08, h_pad=0.06, hspace=0.03, wspace=0.04)
    sheet = Sheet(figsize=(width, height), dpi=150, facecolor="white", layout=layout)
    FigureCanvasAgg(sheet)
    sheet.suptitle(plain(title), x=0.012, ha="left", fontsize=12, fontweight="bold", color=INK)
    if name := str(result.attrs.get("name", "")):
        sheet.supxlabel(plain(name), x=0.99, ha="right", fontsize=7.5, color=MUTED)
    return sheet


def figure(result: xr.Dataset, plot: Plot) -> Figure:
    """A plot as a figure, with the name of the mechanism of the result beneath."""
    columns = min(plot.columns, len(plot.panels)) or 1
    rows = [plot.panels[k : k + columns] for k in range(0, len(plot.panels), columns)]
    heights = [max(panel.height for panel in row) for row in rows]
    above = 0.55 + 0.2 * plot.title.count("\n")
    sheet = new(plot.title, result, above + sum(heights), plot.width or PAGE.get(columns, PAGE[3]))
    if plot.shared:
        _shared(sheet, plot, columns)
    else:
        wide = min(1.0, sheet.get_figwidth() / columns / WIDTH)  # of the width of all figures
        parts = sheet.subfigures(len(rows), columns, squeeze=False, height_ratios=heights).ravel()
        for part, panel in zip(parts, plot.panels, strict=False):
            if not panel.charts:  # of a measure that lacks this figure
                continue
            if panel.title and (len(plot.panels) > 1 or not plot.title):
                part.suptitle(plain(panel.title), x=0.012, ha="left", fontsize=9.5, color=INK)
            ratios = list(panel.parts) or [1.0] * len(panel.charts)
            stacked = part.subplots(len(panel.charts), 1, sharex=True, squeeze=False, height_ratios=ratios)[:, 0]
            for axes, spec in zip(stacked, panel.charts, strict=True):
                _chart(axes, spec, wide)
                if axes is not stacked[-1]:
                    axes.set_xlabel("")
                    axes.tick_params(labelbottom=False)
    return sheet


def _shared(sheet: Figure, plot: Plot, columns: int) -> None:
    """Charts with common axes, titled along the outer ones; their legend and the scale of colours at the right."""
    specs = [panel.charts[0] for panel in plot.panels]
    places = sheet.subplots(-(-len(specs) // columns), columns, sharex=True, sharey=True, squeeze=False).ravel()
    named: dict[str, Any] = {}
    for k, (axes, spec) in enumerate(zip(places, specs, strict=False)):
        _chart(axes, spec if len(specs) == 1 else replace(spec, legend=None))
        lowest, leftmost = k + columns >= len(specs), k % columns == 0
        axes.tick_params(labelbottom=lowest, labelleft=leftmost)
        axes.set_xlabel(axes.get_xlabel() if lowest else "")
        axes.set_ylabel(axes.get_ylabel() if leftmost else "")
        named |= dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
    for axes in places[len(specs) :]:
        axes.remove()
    if len(specs) > 1 and named:
        sheet.legend(list(named.values()), list(named), loc="outside right upper", frameon=False, fontsize=8.5,
                     labelcolor=INK)  # fmt: skip
    if (colours := plot.colours) is not None:
        scale = _bands(colours) if colours.levels else ScalarMappable(
            (LogNorm if colours.log else Normalize)(colours.low, colours.high), RISING)  # fmt: skip
        bar = sheet.colorbar(scale, ax=list(places[: len(specs)]), pad=0.02, aspect=30, ticks=colours.levels or None)
        bar.set_label(plain(colours.title), fontsize=9, color=INK)
        bar.ax.tick_params(labelsize=8.5, colors=MUTED, labelcolor=INK)
        bar.outline.set_visible(False)


# ---- a chart ------------------------------------------------------------------------------------------------------


def _chart(axes: Axes, spec: Chart, wide: float = 1.0) -> None:
    """A chart on axes; wide: of the width of all figures, which its legend has room in."""
    axes.set_axisbelow(True)  # quiet: a light grid below the curves, a frame left and below only
    axes.grid(True, color=RULE, linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set(color=MUTED, linewidth=0.8)
    axes.tick_params(colors=MUTED, labelcolor=INK, labelsize=8.5, width=0.8, length=3.5)
    axes.tick_params(which="minor", length=2, width=0.6, color=MUTED)
    axes.set_xlabel(plain(spec.x.title), fontsize=9, color=INK)
    axes.set_ylabel(plain(spec.y.title), fontsize=9, color=INK)
    if isinstance(spec.x, Abscissa):
        _along(axes, spec.x)
    else:
        _axis(axes, "x", spec.x)
    if spec.zero:
        axes.axhline(0, color=MUTED, linewidth=0.8, zorder=1.5)
    if spec.equal:
        axes.set_aspect("equal", adjustable="box" if spec.y.limits[0] is not None else "datalim")
    _axis(axes, "y", spec.y)
    for mark in spec.marks:
        if not isinstance(mark, Rule):
            _mark(mark, axes, spec)
    _limits(axes, spec)
    for mark in (mark for mark in spec.marks if isinstance(mark, Rule)):
        name, (low, high) = None if mark.name is None else plain(mark.name), sorted(axes.get_xlim())
        if not mark.upright:
            axes.axhline(mark.at, label=name, **_stroke(mark.look))
        elif low <= mark.at <= high:  # in view: the limits must stand
            axes.axvline(mark.at, label=name, **_stroke(mark.look))
    _limits(axes, spec)
    if spec.bare:
        axes.spines["left"].set_visible(False)
        axes.tick_params(axis="y", length=0)
        axes.grid(visible=False, axis="y")
    axes.set_title(plain(spec.title), fontsize=8.5, color=INK, loc="left")
    axes.set_title(plain(spec.aside), fontsize=7.5, color=MUTED, loc="right", pad=2)
    handles, texts = axes.get_legend_handles_labels()
    if spec.legend is not None and len(handles) >= spec.legend.least:  # in rows above the axes, where it hides no curve
        room, longest = int(wide * spec.legend.room), max(map(len, texts))
        fits = sum(map(len, texts)) + 7 * len(texts) <= room  # with the line samples
        axes.legend(
            handles, texts, loc="lower left", bbox_to_anchor=(-0.02, 1.0), frameon=False, fontsize=8.5, labelcolor=INK,
            ncols=len(texts) if fits else max(1, (room + 10) // (longest + 7)), handlelength=2.2, columnspacing=1.6,
            borderaxespad=0.3,
        )  # fmt: skip


def _along(axes: Axes, over: Abscissa) -> None:
    """An axis over the drive: whole degrees at round angles, limits at the ends of the run."""
    span = over.span
    if over.unit == "°" and span >= 90:
        step = next((step for step in (15, 30, 45, 60, 90, 180, 360) if span / step <= 9), 720)
        axes.xaxis.set_major_locator(ticker.MultipleLocator(step))
    elif over.unit == "":
        axes.xaxis.set_major_locator(ticker.MaxNLocator(integer=True))
    axes.xaxis.set_minor_locator(ticker.AutoMinorLocator(2))
    if over.values.size == 1:  # one position, one tick
        axes.set_xticks([float(over.values[0])])
        axes.set_xticks([], minor=True)
    elif span > 0:
        low = float(over.values.min() if over.period >= 0 else over.values.max() + over.period)
        axes.set_xlim(low, low + span)


def _axis(axes: Axes, name: str, axis: Axis) -> None:
    """Scale and marks of an axis."""
    side = axes.xaxis if name == "x" else axes.yaxis
    if axis.log:
        (axes.set_xscale if name == "x" else axes.set_yscale)("log")
    if axis.places is not None:
        side.set_ticks([at for at, _ in axis.places], [plain(text) for _, text in axis.places])
        side.set_minor_locator(ticker.NullLocator())
    elif axis.count:
        side.set_major_locator(ticker.MaxNLocator(nbins=axis.count))
        axes.ticklabel_format(axis=name, useOffset=False)  # type: ignore[arg-type]  # "x" or "y"


def _limits(axes: Axes, spec: Chart) -> None:
    """Ends of both axes."""
    for name, axis in (("x", spec.x), ("y", spec.y)):
        if isinstance(axis, Axis):
            if axis.margin is not None:
                axes.margins(**{name: axis.margin})  # type: ignore[arg-type]  # x or y
            low, high = axis.limits
            if low is not None or high is not None:
                (axes.set_xlim if name == "x" else axes.set_ylim)(low, high)


# ---- marks --------------------------------------------------------------------------------------------------------


def _colour(name: int | float | str) -> str:
    """A colour of the palette, of the scale of colours, of the names, or as it is."""
    if isinstance(name, float):
        return to_hex(RISING(name))
    return PALETTE[name % len(PALETTE)] if isinstance(name, int) else COLOURS.get(name, name)


def _stroke(look: Look) -> dict[str, Any]:
    """The look of a line as matplotlib takes it."""
    style: dict[str, Any] = {"color": _colour(look.colour), "linewidth": look.width, "linestyle": DASHES[look.dash],
                             "zorder": look.order, "alpha": look.alpha}  # fmt: skip
    if look.mark:
        style |= {"marker": look.mark, "markersize": look.size}
    if look.hollow:
        style |= {"markerfacecolor": "none", "markeredgewidth": min(1.3, 0.2 * look.size)}
    return style


def _area(look: Look) -> dict[str, Any]:
    """The look of an area; hatched instead of filled where it has a hatch and a rule for a colour."""
    hollow = bool(look.hatch) and look.colour in ("rule", "shade")
    paint = {"facecolor": "none", "edgecolor": RULE} if hollow else {"facecolor": _colour(look.colour),
                                                                     "alpha": look.alpha}  # fmt: skip
    return {**paint, **({"hatch": look.hatch} if look.hatch else {}), "linewidth": 0, "zorder": look.order}


def _closed(spec: Chart, x: Array, close: bool, *rows: Array, turn: float = 0.0) -> list[Array]:
    """x and rows, over a whole turn led on to their first values and the turns that they have gained."""
    if not (close and isinstance(spec.x, Abscissa) and spec.x.closed):
        return [x, *rows]
    turns = [turn * round((row[-1] - row[0]) / turn) if turn and np.isfinite(row[-1] - row[0]) else 0.0 for row in rows]
    ends = [np.append(row, row[0] + gained) for row, gained in zip(rows, turns, strict=True)]
    return [np.append(x, x[0] + spec.x.period), *ends]


def _line(mark: Line, axes: Axes, spec: Chart, label: str | None) -> None:
    """A curve or points."""
    style = _stroke(mark.look)
    x, y = _closed(spec, mark.x, mark.close, np.asarray(mark.y, float), turn=mark.turn)
    if mark.low is not None and mark.high is not None:
        axes.errorbar(x, y, [mark.low, mark.high], label=label, capsize=3, elinewidth=1.1,
                      fmt="none" if not mark.look.mark else "", **style)  # fmt: skip
        return
    if mark.arrow:
        arrow = {"arrowstyle": "-|>", "color": style["color"], "linewidth": mark.look.width, "shrinkA": 0, "shrinkB": 0,
                 "mutation_scale": 9}  # fmt: skip
        axes.annotate("", xy=(x[-1], y[-1]), xytext=(x[0], y[0]), arrowprops=arrow, zorder=mark.look.order)
        return
    axes.plot(x, y, label=label, solid_joinstyle="round", drawstyle="steps-post" if mark.steps else "default", **style)
    finite = np.isfinite(y)
    alone = finite & ~np.append(False, finite[:-1]) & ~np.append(finite[1:], False)
    if alone.any() and not mark.look.mark:  # a single position makes no line; a dashed curve's dots are open
        face = "none" if mark.look.dash != "solid" else style["color"]
        axes.plot(x[alone], y[alone], "o", markersize=4.5, color=style["color"], markerfacecolor=face)


def _mark(mark: Mark, axes: Axes, spec: Chart) -> None:
    """A mark of any kind but a rule."""
    name = getattr(mark, "name", None)
    label = None if name is None else plain(name)
    match mark:
        case Line():
            _line(mark, axes, spec, label)
        case charts.Band(x, low, high):
            x, low, high = _closed(spec, x, mark.close, low, high)
            axes.fill_between(x, low, high, label=label, step="post" if mark.steps else None, **_area(mark.look))
        case charts.Bars(at, sizes, thickness):
            axes.barh(at, sizes, thickness, color=_colour(mark.look.colour), zorder=mark.look.order, label=label)
        case charts.Stripe(start, end, text):
            axes.axvspan(start, end, label=label, **_area(mark.look))
            middle = np.sqrt(start * end) if axes.get_xscale() == "log" else (start + end) / 2
            if text:
                axes.text(middle, 0.5, plain(text), transform=axes.get_xaxis_transform(), rotation=90, ha="center",
                          va="center", fontsize=8, color=MUTED, zorder=3, clip_on=True)  # fmt: skip
        case charts.Ring((x0, y0), r):
            paint = _colour(mark.look.colour)
            shape: dict[str, Any] = {
                "facecolor": to_rgba(paint, mark.filled), "edgecolor": to_rgba(paint, mark.look.alpha or 1),
                "zorder": mark.look.order, "linewidth": mark.look.width, "linestyle": DASHES[mark.look.dash],
            }  # fmt: skip
            square = patches.Rectangle((x0 - r, y0 - r), 2 * r, 2 * r, **shape)
            axes.add_patch(square if mark.square else patches.Circle((x0, y0), r, **shape))
        case Note(text, x0, y0) if mark.outwards:
            name_beside(axes, text, np.array([x0, y0]), np.array([x0, y0]), mark.size, weight="normal")
        case Note(text, x0, y0):
            box = {"boxstyle": "round,pad=0.2", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}
            axes.annotate(
                plain(text), (x0, y0), xycoords="data" if mark.data else "axes fraction", xytext=mark.shift,
                textcoords="offset points", ha=mark.across, va=mark.up, fontsize=mark.size,
                color=_colour(mark.colour), zorder=4, bbox=box if mark.boxed else None,
            )  # fmt: skip
        case Contours():
            _contours(mark, axes)


def _bands(scale: ColourScale) -> ScalarMappable:
    """The colours of bands between levels, with more at either end where a number is beyond."""
    below, above = scale.low < scale.levels[0], scale.high > scale.levels[-1]
    extend: Any = "both" if below and above else "min" if below else "max" if above else "neither"
    return ScalarMappable(BoundaryNorm(scale.levels, BANDED.N, extend=extend), BANDED)


def _contours(mark: Contours, axes: Axes) -> None:
    """Bands within cells that have a number at each corner, over the surroundings of each point that has one."""
    axes.grid(False)
    bands, known = _bands(mark.colours), np.ma.masked_invalid(mark.values).T
    look: dict[str, Any] = {"cmap": BANDED, "norm": bands.norm}
    axes.pcolormesh(mark.x_edges, mark.y_edges, known, zorder=0.8, **look)
    if known.count():
        axes.contourf(mark.x, mark.y, known, mark.colours.levels, extend=bands.norm.extend,  # type: ignore[attr-defined]
                      corner_mask=False, antialiased=False, zorder=1, **look)  # fmt: skip
        within = [level for level in mark.colours.levels if known.min() < level < known.max()]
        if within:
            axes.contour(mark.x, mark.y, known, within, colors=INK, linewidths=0.6, linestyles="-",
                         corner_mask=False, zorder=2)  # fmt: skip
    for name, hatch, where in mark.gaps:
        boxes = [[(mark.x_edges[i + a], mark.y_edges[k + b]) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
                 for i, k in np.argwhere(where)]  # fmt: skip
        fill = "none" if np.isfinite(mark.values[where]).all() else SHADE  # a number that is known is seen
        axes.add_collection(PolyCollection(boxes, facecolors=fill, edgecolors=MUTED, hatch=hatch, linewidths=0,
                                           label=plain(name), zorder=1.5), autolim=False)  # fmt: skip


# ---- names in a drawing --------------------------------------------------------------------------------------------

OFFSET = 7.0  # points from a place to its name
ASLANT = 0.4  # of a direction: below it a name stands centred


def name_beside(
    axes: Axes, text: str, place: Array, away: Array, size: float = 10.0, symbol: float = 0.0, weight: str = "bold"
) -> None:
    """A name at a fixed distance from a place, in the direction `away` from all else.

    symbol: half width of what is drawn there, in the coordinates of the axes; size: of the letters, points.
    """
    if not np.all(np.isfinite(place)):
        return
    x, y = np.asarray(away) / (np.hypot(*away) or 1.0)
    across: Any = "left" if x > ASLANT else "right" if x < -ASLANT else "center"
    up: Any = "bottom" if y > ASLANT else "top" if y < -ASLANT else "center"
    note = axes.annotate(
        plain(text), (place[0] + symbol * x, place[1] + symbol * y), xytext=(OFFSET * x, OFFSET * y),
        textcoords="offset points", ha=across, va=up, fontsize=size, fontweight=weight, color=INK, zorder=8,
        annotation_clip=False, bbox={"boxstyle": "round,pad=0.1", "facecolor": "white", "edgecolor": "none",
                                     "alpha": 0.75},
    )  # fmt: skip
    note.set_in_layout(False)  # which it would change


# ---- files --------------------------------------------------------------------------------------------------------


def check_figure(path: Path) -> str:
    """The format that a figure would be written in, by the extension; MechanismError if it is none."""
    kind = path.suffix.lower().lstrip(".")
    if kind not in FORMATS:
        raise MechanismError(Finding("is no kind of figure", str(path), "end the name in .png, .svg, .pdf or .jpg"))
    return kind


def save(drawing: Figure, path: str | os.PathLike[str]) -> Path:
    """Write a figure by its extension, whole or not at all; the same figure gives the same file.

    Raises MechanismError for another extension than .png, .svg, .pdf and .jpg, and where it cannot be written.
    """
    target = Path(path)
    kind = check_figure(target)
    undated = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind)
    made = io.BytesIO()  # written by Python: where the disk is full, matplotlib's PDF raises what is no OSError
    with whole(target) as draft:
        with rc_context({"svg.hashsalt": "trunnion"}):
            drawing.savefig(made, format=kind, dpi=200, metadata=undated)
        draft.write_bytes(made.getbuffer())
    return target


def svg(drawing: Figure, salt: str = "trunnion") -> str:
    """A figure as the text of an SVG file; salt: what makes its ids."""
    text = io.StringIO()
    with rc_context({"svg.hashsalt": salt}):
        drawing.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()
