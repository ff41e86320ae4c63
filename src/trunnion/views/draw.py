"""Charts drawn by matplotlib: `chart` on axes, `figure` as panels under a title."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import singledispatch
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import BoundaryNorm, Colormap, ListedColormap, LogNorm, Normalize, to_hex, to_rgba
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patches import Circle, Rectangle
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter, NullLocator, ScalarFormatter

from trunnion.views.charts import (
    Arrow,
    Axis,
    Band,
    Bars,
    Chart,
    ColourScale,
    Contours,
    Line,
    Look,
    Note,
    Panel,
    Plot,
    Ring,
    Rule,
    Stairs,
    Stripe,
)
from trunnion.views.common.cycle import Abscissa, Array, thin
from trunnion.views.common.figures import (
    INK,
    MUTED,
    PALETTE,
    RULE,
    SHADE,
    WIDTH,
    Labels,
    Sheet,
    along,
    dress,
    legend,
    new,
    plain,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, FigureBase

__all__ = ["chart", "figure", "grid", "plot", "small"]

COLOURS = {"ink": INK, "muted": MUTED, "rule": RULE, "shade": SHADE, "limit": "#a1260d", "pale": "#b9c3cd"}
DASHES: dict[str, Any] = {"solid": "-", "long": (0, (5, 2)), "dashed": (0, (3, 2)), "short": (0, (2, 1.5)),
                          "dotted": (0, (1, 1.5)), "dash-dot": (0, (6, 2, 1.5, 2)),
                          "none": "none"}  # fmt: skip
BANDED = colormaps["viridis"]
# without the end that fades on white
RISING: Colormap = ListedColormap(colormaps["viridis"](np.linspace(0.0, 0.9, 256)), "viridis to green")
PAGE = {1: WIDTH, 2: 12.6, 3: 14.4}  # width of a figure by its columns, inches
BOX: dict[str, Any] = {"boxstyle": "round,pad=0.2", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}


def figure(
    title: str, result: xr.Dataset, panels: Sequence[Panel], columns: int = 1, width: float = 0.0, note: str = ""
) -> Figure:
    """Panels in rows of so many columns under a title.

    Parameters
    ----------
    title : of the whole figure, also of the only panel
    result : whose mechanism is named beneath
    panels : what is drawn, row by row
    columns : panels side by side
    width : inches; that of all figures, or of a page of several columns, if 0
    note : of what is not drawn, beneath
    """
    columns = min(columns, len(panels))
    rows = [panels[k : k + columns] for k in range(0, len(panels), columns)]
    heights = [max(panel.height for panel in row) for row in rows]
    sheet = new(title, result, 0.55 + sum(heights), width or PAGE[columns])
    parts = sheet.subfigures(len(rows), columns, squeeze=False, height_ratios=heights).ravel()
    drawn = [(place, panel) for place, panel in zip(parts, panels, strict=False) if panel.charts]
    labels = Labels(sheet)
    for place, panel in drawn:  # but those of measures that lack this figure
        if panel.title and len(panels) > 1:
            place.suptitle(_lines(panel.title), x=0.012, ha="left", fontsize=9.5, color=INK)
        _panel(place, panel, min(1.0, sheet.get_figwidth() / columns / WIDTH), labels)
    labels.place()
    if note:
        sheet.text(0.012, 0.005, plain(note), fontsize=7.5, color=MUTED)
    return sheet


def plot(drawn: Plot, result: xr.Dataset) -> Figure:
    """A figure of a result as it is described."""
    return figure(drawn.title, result, drawn.panels, drawn.columns, drawn.width, drawn.note)


def small(panel: Panel, width: float = 4.4) -> Figure:
    """One panel for a page that has several side by side, without the name of the mechanism."""
    layout = ConstrainedLayoutEngine(w_pad=0.05, h_pad=0.04, hspace=0.03, wspace=0.03)
    sheet = Sheet(figsize=(width, panel.height), dpi=150, facecolor="white", layout=layout)
    FigureCanvasAgg(sheet)
    sheet.suptitle(_lines(panel.title), x=0.012, ha="left", fontsize=9, color=INK)
    _panel(sheet, panel, width / WIDTH, Labels(sheet))
    return sheet


def _panel(place: FigureBase, panel: Panel, wide: float, labels: Labels) -> None:
    """The charts of a panel below one another; texts that are to hide nothing wait until all else is there."""
    ratios = list(panel.parts) or [1.0] * len(panel.charts)
    rows_of_axes = place.subplots(len(panel.charts), 1, sharex=True, squeeze=False, height_ratios=ratios)[:, 0]
    for axes, spec in zip(rows_of_axes, panel.charts, strict=True):
        chart(axes, spec, wide)
        if axes is not rows_of_axes[-1]:
            axes.set_xlabel("")
            axes.tick_params(labelbottom=False)
        for mark in spec.marks:
            if isinstance(mark, Note) and mark.beside:
                labels.add(axes, mark.text, np.array([mark.x, mark.y]), mark.size, weight="normal")


def grid(
    title: str, result: xr.Dataset, charts: Sequence[Chart], columns: int, colours: ColourScale | None = None
) -> Figure:
    """Charts with common axes in rows, titled along the outer ones; their legend and the scale of colours at the right.

    Parameters
    ----------
    title : of the whole figure, of one line or more
    result : whose mechanism is named beneath
    charts : what is drawn, row by row
    columns : charts side by side
    colours : what the colours of all charts mean
    """
    rows = -(-len(charts) // columns)
    height = (4.0 if rows == 1 else 0.9 + 2.1 * rows) + 0.2 * title.count("\n")
    sheet = new(title, result, height, WIDTH if len(charts) == 1 else 9.4)
    places = sheet.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel().tolist()
    named: dict[str, Any] = {}
    for k, (axes, spec) in enumerate(zip(places, charts, strict=False)):
        chart(axes, spec if len(charts) == 1 else replace(spec, legend=None))
        lowest, leftmost = k + columns >= len(charts), k % columns == 0
        axes.tick_params(labelbottom=lowest, labelleft=leftmost)
        axes.set_xlabel(axes.get_xlabel() if lowest else "")
        axes.set_ylabel(axes.get_ylabel() if leftmost else "")
        named |= dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
    for axes in places[len(charts) :]:
        axes.remove()
    if len(charts) > 1 and named:
        sheet.legend(list(named.values()), list(named), loc="outside right upper", frameon=False, fontsize=8.5,
                     labelcolor=INK)  # fmt: skip
    if colours is not None:
        _colour_bar(sheet, places[: len(charts)], colours)
    return sheet


def _colour_bar(sheet: Figure, axes: Any, scale: ColourScale) -> None:
    """A scale of colours beside axes."""
    colours = ScalarMappable((LogNorm if scale.log else Normalize)(scale.low, scale.high), RISING)
    bar = sheet.colorbar(_bands(scale) if scale.levels else colours, ax=axes, pad=0.02, aspect=30,
                         ticks=scale.levels or None)  # fmt: skip
    bar.set_label(plain(scale.title), fontsize=9, color=INK)
    bar.ax.tick_params(labelsize=8.5, colors=MUTED, labelcolor=INK)
    bar.outline.set_visible(False)


def _bands(scale: ColourScale) -> ScalarMappable:
    """The colours of bands between levels, with more at either end where a number is beyond."""
    below, above = scale.low < scale.levels[0], scale.high > scale.levels[-1]
    extend: Any = "both" if below and above else "min" if below else "max" if above else "neither"
    return ScalarMappable(BoundaryNorm(scale.levels, BANDED.N, extend=extend), BANDED)


def chart(axes: Axes, spec: Chart, wide: float = 1.0) -> None:
    """One chart on axes; wide: of the width of all figures, which its legend has room in."""
    if isinstance(spec.x, Abscissa):
        along(axes, spec.x, _lines(spec.y.title), zero=spec.zero)
    else:
        dress(axes, _lines(spec.x.title), _lines(spec.y.title))
        _axis(axes, "x", spec.x)
        if spec.zero:
            axes.axhline(0, color=MUTED, linewidth=0.8, zorder=1.5)
    if spec.equal:
        axes.set_aspect("equal", adjustable="box" if spec.y.limits[0] is not None else "datalim")
    _axis(axes, "y", spec.y)
    for mark in sorted(spec.marks, key=lambda mark: isinstance(mark, Rule)):
        if isinstance(mark, Rule):  # in view or not: the limits must stand
            _limits(axes, spec)
        _mark(mark, axes, spec)
    _limits(axes, spec)
    if spec.bare:
        axes.spines["left"].set_visible(False)
        axes.tick_params(axis="y", length=0)
        axes.grid(visible=False, axis="y")
    if spec.title:
        axes.set_title(_lines(spec.title), fontsize=8.5, color=INK, loc="left")
    if spec.aside:
        axes.set_title(plain(spec.aside), fontsize=7.5, color=MUTED, loc="right", pad=2)
    if spec.colours is not None:
        _colour_bar(axes.figure, axes, spec.colours)  # type: ignore[arg-type]
    if spec.legend is not None:
        legend(axes, spec.legend.most, int(wide * spec.legend.room), spec.legend.least, spec.legend.lift)


# ---- axes ---------------------------------------------------------------------------------------------------------


def _lines(text: str) -> str:
    return "\n".join(map(plain, text.split("\n")))


def _axis(axes: Axes, name: str, axis: Axis) -> None:
    """Scale and marks of an axis."""
    side = axes.xaxis if name == "x" else axes.yaxis
    if axis.log:
        (axes.set_xscale if name == "x" else axes.set_yscale)("log")
    if axis.places is not None:
        side.set_ticks([at for at, _ in axis.places], [plain(text) for _, text in axis.places])
        side.set_minor_locator(NullLocator())
        for label in side.get_ticklabels() if axis.turned else ():
            label.set(rotation=axis.turned, ha="right" if axis.turned < 90 else "center", rotation_mode="anchor")
    elif axis.log and axis.count:
        subs = (1.0, 2.0, 5.0) if axis.count > 1 else (1.0,)
        side.set_major_locator(LogLocator(subs=subs, numticks=6))
        side.set_minor_formatter(NullFormatter())
    elif axis.angles:
        side.set_major_locator(MaxNLocator(nbins=8, steps=[1, 1.5, 3, 4.5, 9, 10]))
    elif axis.count or axis.integer:
        side.set_major_locator(MaxNLocator(integer=axis.integer, nbins=axis.count or 6))
    if axis.powers:
        form = ScalarFormatter(useMathText=True)
        form.set_powerlimits((-4, 6))
        side.set_major_formatter(form)
        side.get_offset_text().set(fontsize=8, color=MUTED)
    if axis.form is not None:
        written: Callable[[float], str] = axis.form
        side.set_major_formatter(FuncFormatter(lambda value, _: written(value)))
    elif axis.count and not axis.log:
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


def colour(name: int | float | str) -> str:
    """A colour of the palette, of the scale of colours, of the names, or as it is."""
    if isinstance(name, float):
        return to_hex(RISING(name))
    return PALETTE[name % len(PALETTE)] if isinstance(name, int) else COLOURS.get(name, name)


def line_style(look: Look) -> dict[str, Any]:
    """The look of a line as matplotlib takes it."""
    paint = colour(look.colour)
    style: dict[str, Any] = {"color": paint, "linewidth": look.width, "linestyle": DASHES[look.dash],
                             "zorder": look.order, "alpha": look.alpha, "clip_on": not look.unclipped}  # fmt: skip
    if look.mark:
        style |= {"marker": look.mark, "markersize": look.size}
    if look.hollow:
        style |= {"markerfacecolor": "none", "markeredgewidth": min(1.3, 0.2 * look.size)}
    return style


def _area(look: Look) -> dict[str, Any]:
    """The look of an area; hatched instead of filled where it has a hatch and a rule for a colour."""
    if look.hatch and look.colour in ("rule", "shade"):
        return {"facecolor": "none", "edgecolor": colour("rule"), "hatch": look.hatch, "linewidth": 0,
                "zorder": look.order}  # fmt: skip
    hatch = {"hatch": look.hatch} if look.hatch else {}
    return {"facecolor": colour(look.colour), "alpha": look.alpha, "linewidth": 0, "zorder": look.order, **hatch}


def _name(name: str | None) -> str | None:
    return None if name is None else plain(name)


def _closed(spec: Chart, x: Array, close: bool, *rows: Array, turn: float = 0.0) -> list[Array]:
    """x and rows, over a whole turn led on to their first values and the turns that they have gained."""
    if not (close and isinstance(spec.x, Abscissa) and spec.x.closed):
        return [x, *rows]
    turns = [turn * round((row[-1] - row[0]) / turn) if turn and np.isfinite(row[-1] - row[0]) else 0.0 for row in rows]
    ends = [np.append(row, row[0] + gained) for row, gained in zip(rows, turns, strict=True)]
    return [np.append(x, x[0] + spec.x.period), *ends]


@singledispatch
def _mark(mark: object, axes: Axes, spec: Chart) -> None:
    raise TypeError(mark)


@_mark.register(Line)
def _line(mark: Line, axes: Axes, spec: Chart) -> None:
    style = line_style(mark.look)
    x, y = _closed(spec, mark.x, mark.close, np.asarray(mark.y, float), turn=mark.turn)
    if mark.low is not None and mark.high is not None:
        axes.errorbar(x, y, [mark.low, mark.high], label=_name(mark.name), capsize=3, elinewidth=1.1,
                      fmt="none" if not mark.look.mark else "", **style)  # fmt: skip
        return
    if mark.shares is not None:
        pieces = np.stack([np.stack([x[:-1], y[:-1]], 1), np.stack([x[1:], y[1:]], 1)], 1)
        paints = RISING((mark.shares[:-1] + mark.shares[1:]) / 2)
        axes.add_collection(
            LineCollection(list(pieces), colors=paints, linewidths=mark.look.width, zorder=mark.look.order)
        )
        return
    if isinstance(spec.x, Abscissa) and mark.look.dash != "none":  # a dense course, without losing a peak
        picked = thin(y)
        x, y = x[picked], y[picked]
    drawstyle: dict[str, Any] = {"drawstyle": "steps-post"} if mark.steps else {}
    axes.plot(x, y, label=_name(mark.name), solid_joinstyle="round", **style, **drawstyle)
    finite = np.isfinite(y)
    alone = finite & ~np.append(False, finite[:-1]) & ~np.append(finite[1:], False)
    if alone.any() and not mark.look.mark:  # a single position makes no line; a dashed curve's dots are open
        face = "none" if mark.look.dash != "solid" else style["color"]
        axes.plot(x[alone], y[alone], "o", markersize=4.5, color=style["color"], markerfacecolor=face)


@_mark.register(Band)
def _band(mark: Band, axes: Axes, spec: Chart) -> None:
    x, low, high = _closed(spec, mark.x, mark.close, mark.low, mark.high)
    picked = np.union1d(thin(low), thin(high))
    axes.fill_between(x[picked], low[picked], high[picked], label=_name(mark.name), **_area(mark.look))


@_mark.register(Stairs)
def _stairs(mark: Stairs, axes: Axes, spec: Chart) -> None:
    drawn = axes.stairs(mark.counts, mark.edges, fill=True, color=colour(mark.look.colour), zorder=mark.look.order,
                        label=_name(mark.name))  # fmt: skip
    if mark.window is not None:
        low, high = mark.window
        top = 2 * float(mark.counts.max())
        drawn.set_clip_path(Rectangle((low, 0), max(high - low, 0.0), top, transform=axes.transData))


@_mark.register(Bars)
def _bars(mark: Bars, axes: Axes, spec: Chart) -> None:
    axes.barh(mark.at, mark.sizes, mark.thickness, color=colour(mark.look.colour), label=_name(mark.name),
              zorder=mark.look.order)  # fmt: skip


@_mark.register(Rule)
def _rule(mark: Rule, axes: Axes, spec: Chart) -> None:
    if not mark.upright:
        axes.axhline(mark.at, label=_name(mark.name), **line_style(mark.look))
        return
    low, high = sorted(axes.get_xlim())
    if low <= mark.at <= high:
        axes.axvline(mark.at, label=_name(mark.name), **line_style(mark.look))


@_mark.register(Stripe)
def _stripe(mark: Stripe, axes: Axes, spec: Chart) -> None:
    axes.axvspan(mark.low, mark.high, label=_name(mark.name), **_area(mark.look))
    if mark.text:
        log = axes.get_xscale() == "log"
        middle = np.sqrt(mark.low * mark.high) if log else (mark.low + mark.high) / 2
        axes.text(middle, 0.5, plain(mark.text), transform=axes.get_xaxis_transform(), rotation=90,
                  ha="center", va="center", fontsize=8, color=MUTED, zorder=3, clip_on=True)  # fmt: skip


@_mark.register(Arrow)
def _arrow(mark: Arrow, axes: Axes, spec: Chart) -> None:
    style = {"arrowstyle": "-|>", "color": colour(mark.look.colour), "linewidth": mark.look.width, "shrinkA": 0,
             "shrinkB": 0, "mutation_scale": 9}  # fmt: skip
    axes.annotate("", xy=mark.end, xytext=mark.start, arrowprops=style, zorder=mark.look.order)


@_mark.register(Ring)
def _ring(mark: Ring, axes: Axes, spec: Chart) -> None:
    paint, (x, y), r = colour(mark.look.colour), mark.middle, mark.radius
    edge = to_rgba(paint, mark.look.alpha or 1)
    style: dict[str, Any] = {"facecolor": to_rgba(paint, mark.filled), "edgecolor": edge, "zorder": mark.look.order,
                             "linewidth": mark.look.width, "linestyle": DASHES[mark.look.dash]}  # fmt: skip
    axes.add_patch(Rectangle((x - r, y - r), 2 * r, 2 * r, **style) if mark.square else Circle((x, y), r, **style))


@_mark.register(Note)
def _note(mark: Note, axes: Axes, spec: Chart) -> None:
    if mark.beside:  # when all else is there
        return
    axes.annotate(
        _lines(mark.text), (mark.x, mark.y), xycoords="data" if mark.data else "axes fraction", xytext=mark.shift,
        textcoords="offset points", ha=mark.across, va=mark.up, fontsize=mark.size, color=colour(mark.colour),
        zorder=4, bbox=BOX if mark.boxed else None,
    )  # fmt: skip


@_mark.register(Contours)
def _contours(mark: Contours, axes: Axes, spec: Chart) -> None:
    """Bands within cells that have a number at each corner, over the surroundings of each point that has one."""
    axes.grid(False)
    bands = _bands(mark.colours)
    known = np.ma.masked_invalid(mark.values).T
    look: dict[str, Any] = {"cmap": BANDED, "norm": bands.norm}
    axes.pcolormesh(mark.x_edges, mark.y_edges, known, zorder=0.8, **look)
    if known.count():
        levels = mark.colours.levels
        axes.contourf(mark.x, mark.y, known, levels, extend=bands.norm.extend, corner_mask=False,  # type: ignore[attr-defined]
                      antialiased=False, zorder=1, **look)  # fmt: skip
        within = [level for level in levels if known.min() < level < known.max()]
        if within:
            axes.contour(mark.x, mark.y, known, within, colors=INK, linewidths=0.6, linestyles="-",
                         corner_mask=False, zorder=2)  # fmt: skip
    for name, hatch, where in mark.gaps:
        boxes = [[(mark.x_edges[i + a], mark.y_edges[k + b]) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
                 for i, k in np.argwhere(where)]  # fmt: skip
        fill = "none" if np.isfinite(mark.values[where]).all() else SHADE  # a number that is known is seen
        axes.add_collection(PolyCollection(boxes, facecolors=fill, edgecolors=MUTED, hatch=hatch, linewidths=0,
                                           label=plain(name), zorder=1.5), autolim=False)  # fmt: skip
