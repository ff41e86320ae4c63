"""Charts drawn by matplotlib: `figure` as panels under a title, `grid` side by side on common axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps, patches, ticker
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import BoundaryNorm, Colormap, ListedColormap, LogNorm, Normalize, to_hex, to_rgba

from trunnion.views import charts
from trunnion.views.charts import Axis, Chart, ColourScale, Contours, Line, Look, Mark, Note, Panel, Rule
from trunnion.views.common.cycle import Abscissa, Array
from trunnion.views.common.figures import (
    INK,
    MUTED,
    PALETTE,
    RULE,
    SHADE,
    WIDTH,
    Labels,
    along,
    dress,
    legend,
    new,
    plain,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["figure", "grid"]

COLOURS = {"ink": INK, "muted": MUTED, "rule": RULE, "shade": SHADE, "limit": "#a1260d", "pale": "#b9c3cd"}
DASHES: dict[str, Any] = {"solid": "-", "long": (0, (5, 2)), "dashed": (0, (3, 2)), "short": (0, (2, 1.5)),
                          "dotted": (0, (1, 1.5)), "dash-dot": (0, (6, 2, 1.5, 2)),
                          "none": "none"}  # fmt: skip
BANDED = colormaps["viridis"]
# without the end that fades on white
RISING: Colormap = ListedColormap(colormaps["viridis"](np.linspace(0.0, 0.9, 256)), "viridis to green")
PAGE = {1: WIDTH, 2: 12.6, 3: 14.4}  # width of a figure by its columns, inches


# ---- figures ------------------------------------------------------------------------------------------------------


def figure(
    title: str, result: xr.Dataset, panels: Sequence[Panel], columns: int = 1, width: float = 0.0, note: str = ""
) -> Figure:
    """Panels in rows of so many columns under a title; the charts of a panel below one another.

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
    parts, labels = sheet.subfigures(len(rows), columns, squeeze=False, height_ratios=heights).ravel(), Labels(sheet)
    for place, panel in zip(parts, panels, strict=False):
        if not panel.charts:  # of a measure that lacks this figure
            continue
        if panel.title and len(panels) > 1:
            place.suptitle(_lines(panel.title), x=0.012, ha="left", fontsize=9.5, color=INK)
        ratios = list(panel.parts) or [1.0] * len(panel.charts)
        stacked = place.subplots(len(panel.charts), 1, sharex=True, squeeze=False, height_ratios=ratios)[:, 0]
        for axes, spec in zip(stacked, panel.charts, strict=True):
            _chart(axes, spec, min(1.0, sheet.get_figwidth() / columns / WIDTH))
            if axes is not stacked[-1]:
                axes.set_xlabel("")
                axes.tick_params(labelbottom=False)
            for mark in spec.marks:
                if isinstance(mark, Note) and mark.beside:
                    labels.add(axes, mark.text, np.array([mark.x, mark.y]), mark.size, weight="normal")
    labels.place()
    if note:
        sheet.text(0.012, 0.005, plain(note), fontsize=7.5, color=MUTED)
    return sheet


def grid(
    title: str, result: xr.Dataset, specs: Sequence[Chart], columns: int, colours: ColourScale | None = None
) -> Figure:
    """Charts with common axes in rows, titled along the outer ones; their legend and the scale of colours at the right.

    Parameters
    ----------
    title : of the whole figure, of one line or more
    result : whose mechanism is named beneath
    specs : what is drawn, row by row
    columns : charts side by side
    colours : what the colours of all charts mean
    """
    rows = -(-len(specs) // columns)
    height = (4.0 if rows == 1 else 0.9 + 2.1 * rows) + 0.2 * title.count("\n")
    sheet = new(title, result, height, WIDTH if len(specs) == 1 else 9.4)
    places = sheet.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel().tolist()
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
    if colours is not None:
        risen = ScalarMappable((LogNorm if colours.log else Normalize)(colours.low, colours.high), RISING)
        bar = sheet.colorbar(_bands(colours) if colours.levels else risen, ax=places[: len(specs)], pad=0.02, aspect=30,
                             ticks=colours.levels or None)  # fmt: skip
        bar.set_label(plain(colours.title), fontsize=9, color=INK)
        bar.ax.tick_params(labelsize=8.5, colors=MUTED, labelcolor=INK)
        bar.outline.set_visible(False)
    return sheet


def _bands(scale: ColourScale) -> ScalarMappable:
    """The colours of bands between levels, with more at either end where a number is beyond."""
    below, above = scale.low < scale.levels[0], scale.high > scale.levels[-1]
    extend: Any = "both" if below and above else "min" if below else "max" if above else "neither"
    return ScalarMappable(BoundaryNorm(scale.levels, BANDED.N, extend=extend), BANDED)


# ---- a chart ------------------------------------------------------------------------------------------------------


def _chart(axes: Axes, spec: Chart, wide: float = 1.0) -> None:
    """A chart on axes; wide: of the width of all figures, which its legend has room in."""
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
        if isinstance(mark, Rule):
            _limits(axes, spec)
            name, (low, high) = None if mark.name is None else plain(mark.name), sorted(axes.get_xlim())
            if not mark.upright:
                axes.axhline(mark.at, label=name, **_stroke(mark.look))
            elif low <= mark.at <= high:  # in view: the limits must stand
                axes.axvline(mark.at, label=name, **_stroke(mark.look))
        elif isinstance(mark, Line):
            _line(mark, axes, spec)
        elif isinstance(mark, Contours):
            _contours(mark, axes)
        else:
            _mark(mark, axes, spec)
    _limits(axes, spec)
    if spec.bare:
        axes.spines["left"].set_visible(False)
        axes.tick_params(axis="y", length=0)
        axes.grid(visible=False, axis="y")
    axes.set_title(_lines(spec.title), fontsize=8.5, color=INK, loc="left")
    axes.set_title(plain(spec.aside), fontsize=7.5, color=MUTED, loc="right", pad=2)
    if spec.legend is not None:
        legend(axes, spec.legend.most, int(wide * spec.legend.room), spec.legend.least)


def _lines(text: str) -> str:
    return "\n".join(map(plain, text.split("\n")))


def _axis(axes: Axes, name: str, axis: Axis) -> None:
    """Scale and marks of an axis."""
    side = axes.xaxis if name == "x" else axes.yaxis
    if axis.log:
        (axes.set_xscale if name == "x" else axes.set_yscale)("log")
    if axis.places is not None:
        side.set_ticks([at for at, _ in axis.places], [plain(text) for _, text in axis.places])
        side.set_minor_locator(ticker.NullLocator())
        for label in side.get_ticklabels() if axis.turned else ():
            label.set(rotation=axis.turned, ha="right", rotation_mode="anchor")
    elif axis.angles:
        side.set_major_locator(ticker.MaxNLocator(nbins=8, steps=[1, 1.5, 3, 4.5, 9, 10]))
    elif axis.count or axis.integer:
        side.set_major_locator(ticker.MaxNLocator(integer=axis.integer, nbins=axis.count or 6))
        axes.ticklabel_format(axis=name, useOffset=False)  # type: ignore[arg-type]  # "x" or "y"
    if axis.powers:
        form = ticker.ScalarFormatter(useMathText=True)
        form.set_powerlimits((-4, 6))
        side.set_major_formatter(form)
        side.get_offset_text().set(fontsize=8, color=MUTED)


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
                             "zorder": look.order, "alpha": look.alpha, "clip_on": not look.unclipped}  # fmt: skip
    if look.mark:
        style |= {"marker": look.mark, "markersize": look.size}
    if look.hollow:
        style |= {"markerfacecolor": "none", "markeredgewidth": min(1.3, 0.2 * look.size)}
    return style


def _area(look: Look) -> dict[str, Any]:
    """The look of an area; hatched instead of filled where it has a hatch and a rule for a colour."""
    if look.hatch and look.colour in ("rule", "shade"):
        return {"facecolor": "none", "edgecolor": COLOURS["rule"], "hatch": look.hatch, "linewidth": 0,
                "zorder": look.order}  # fmt: skip
    hatch = {"hatch": look.hatch} if look.hatch else {}
    return {"facecolor": _colour(look.colour), "alpha": look.alpha, "linewidth": 0, "zorder": look.order, **hatch}


def _closed(spec: Chart, x: Array, close: bool, *rows: Array, turn: float = 0.0) -> list[Array]:
    """x and rows, over a whole turn led on to their first values and the turns that they have gained."""
    if not (close and isinstance(spec.x, Abscissa) and spec.x.closed):
        return [x, *rows]
    turns = [turn * round((row[-1] - row[0]) / turn) if turn and np.isfinite(row[-1] - row[0]) else 0.0 for row in rows]
    ends = [np.append(row, row[0] + gained) for row, gained in zip(rows, turns, strict=True)]
    return [np.append(x, x[0] + spec.x.period), *ends]


def _line(mark: Line, axes: Axes, spec: Chart) -> None:
    """A curve or points."""
    style, label = _stroke(mark.look), None if mark.name is None else plain(mark.name)
    x, y = _closed(spec, mark.x, mark.close, np.asarray(mark.y, float), turn=mark.turn)
    if mark.low is not None and mark.high is not None:
        axes.errorbar(x, y, [mark.low, mark.high], label=label, capsize=3, elinewidth=1.1,
                      fmt="none" if not mark.look.mark else "", **style)  # fmt: skip
        return
    if mark.shares is not None:
        pieces = np.stack([np.stack([x[:-1], y[:-1]], 1), np.stack([x[1:], y[1:]], 1)], 1)
        paints = RISING((mark.shares[:-1] + mark.shares[1:]) / 2)
        lines = LineCollection(list(pieces), colors=paints, linewidths=mark.look.width, zorder=mark.look.order)
        axes.add_collection(lines)
        return
    drawstyle: dict[str, Any] = {"drawstyle": "steps-post"} if mark.steps else {}
    axes.plot(x, y, label=label, solid_joinstyle="round", **style, **drawstyle)
    finite = np.isfinite(y)
    alone = finite & ~np.append(False, finite[:-1]) & ~np.append(finite[1:], False)
    if alone.any() and not mark.look.mark:  # a single position makes no line; a dashed curve's dots are open
        face = "none" if mark.look.dash != "solid" else style["color"]
        axes.plot(x[alone], y[alone], "o", markersize=4.5, color=style["color"], markerfacecolor=face)


def _mark(mark: Mark, axes: Axes, spec: Chart) -> None:
    """An area, a shape or a text."""
    name = getattr(mark, "name", None)
    named: dict[str, Any] = {"label": None if name is None else plain(name)}
    match mark:
        case charts.Band(x, low, high):
            x, low, high = _closed(spec, x, mark.close, low, high)
            axes.fill_between(x, low, high, **named, **_area(mark.look))
        case charts.Stairs(counts, edges):
            bars = axes.stairs(
                counts, edges, fill=True, color=_colour(mark.look.colour), zorder=mark.look.order, **named
            )
            if mark.window is not None:
                start, end = mark.window
                height = 2 * float(counts.max())
                clip = patches.Rectangle((start, 0), max(end - start, 0.0), height, transform=axes.transData)
                bars.set_clip_path(clip)
        case charts.Bars(at, sizes, thickness):
            axes.barh(at, sizes, thickness, color=_colour(mark.look.colour), zorder=mark.look.order, **named)
        case charts.Stripe(start, end, text):
            axes.axvspan(start, end, **named, **_area(mark.look))
            middle = np.sqrt(start * end) if axes.get_xscale() == "log" else (start + end) / 2
            if text:
                axes.text(middle, 0.5, plain(text), transform=axes.get_xaxis_transform(), rotation=90, ha="center",
                          va="center", fontsize=8, color=MUTED, zorder=3, clip_on=True)  # fmt: skip
        case charts.Arrow(begin, tip):
            arrow = {"arrowstyle": "-|>", "color": _colour(mark.look.colour), "linewidth": mark.look.width,
                     "shrinkA": 0, "shrinkB": 0, "mutation_scale": 9}  # fmt: skip
            axes.annotate("", xy=tip, xytext=begin, arrowprops=arrow, zorder=mark.look.order)
        case charts.Ring((x0, y0), r):
            paint = _colour(mark.look.colour)
            shape: dict[str, Any] = {
                "facecolor": to_rgba(paint, mark.filled), "edgecolor": to_rgba(paint, mark.look.alpha or 1),
                "zorder": mark.look.order, "linewidth": mark.look.width, "linestyle": DASHES[mark.look.dash],
            }  # fmt: skip
            square = patches.Rectangle((x0 - r, y0 - r), 2 * r, 2 * r, **shape)
            axes.add_patch(square if mark.square else patches.Circle((x0, y0), r, **shape))
        case Note(text, x0, y0) if not mark.beside:  # else when all else is there
            box = {"boxstyle": "round,pad=0.2", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}
            axes.annotate(
                _lines(text), (x0, y0), xycoords="data" if mark.data else "axes fraction", xytext=mark.shift,
                textcoords="offset points", ha=mark.across, va=mark.up, fontsize=mark.size,
                color=_colour(mark.colour), zorder=4, bbox=box if mark.boxed else None,
            )  # fmt: skip


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
