"""What the figures of a sweep share: the numbers to be drawn, a panel for each value of further names, axes, legend."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from textwrap import fill, wrap
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator, ScalarFormatter
from numpy.typing import NDArray

from trunnion.results.quantities import prefixed
from trunnion.views.common.cycle import Array
from trunnion.views.common.figures import INK, MUTED, dress, legend, new
from trunnion.views.common.lettering import plain
from trunnion.views.common.peaks import ease_of_status, usual_peak
from trunnion.views.cycle.deviations import angle_scale
from trunnion.views.cycle.deviations_plot import LOST
from trunnion.views.scales import Arrangement, Scale, arrange, grid, meaning, statuses, thinned, written

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.colorbar import Colorbar
    from matplotlib.figure import Figure

__all__ = [
    "ALIKE",
    "Board",
    "Field",
    "Panel",
    "board",
    "ends",
    "field",
    "on_scale",
    "ring",
    "scale_of_colours",
    "tell",
    "ticks",
]

MOST_PANELS = 12
MOST_COLUMNS = 4  # of panels
# characters along a panel, and their size in its title, by how many panels stand side by side
ROOM = {1: 70, 2: 40, 3: 28, 4: 24}
SIZE = {1: 8.5, 2: 8.5, 3: 8.0, 4: 7.2}
WIDE = 74  # characters of a title in a line
NOTHING = -1  # beside the statuses: sound, and yet without a number
ALIKE = 1e-9  # of the largest: numbers that differ by less are taken as one


@dataclass(frozen=True)
class Field:
    """A figure of a sweep as it is drawn: numbers in SI, (axis, curve, panel), the axis rising.

    scope: the magnitude that is shown; factor, shown: what brings it to the unit of the drawing, and that unit.
    panels: their titles; hidden: how many more there are; columns: how many belong side by side, 0 if that is the same.
    nothing: what a sound point without a number has: "∞" or "no value".
    """

    plan: Arrangement
    x: Array
    values: Array
    ideal: Array | None
    status: NDArray[np.int8]
    unit: str
    title: str
    scope: float
    factor: float
    shown: str
    panels: list[str]
    hidden: int
    columns: int
    nothing: str

    @property
    def label(self) -> str:
        """The figure with its unit."""
        return f"{self.title} [{self.shown}]" if self.shown else self.title

    @property
    def peak(self) -> float:
        known = np.abs(self.values[np.isfinite(self.values)])
        return float(known.max(initial=0.0))


class Panel(NamedTuple):
    """One drawing of a figure: its axes and its place among the panels of the field."""

    axes: Axes
    place: int


class Board(NamedTuple):
    """A figure with its panels, and a strip above several of them for their legend."""

    sheet: Figure
    panels: list[Panel]
    strip: Axes | None

    @property
    def alone(self) -> bool:
        return len(self.panels) == 1


def field(result: xr.Dataset, measure: str, x: str = "", family: str = "") -> Field:
    """The numbers of a figure, brought into order; of too many panels some."""
    plan = arrange(result, x, family)
    unit, values = grid(result, plan, measure)
    nothing = "∞" if np.isinf(values).any() else "no value"  # a margin beyond the last that is looked for
    values = np.where(np.isfinite(values), values, np.nan)
    ideal = grid(result, plan, f"{measure}_ideal")[1] if f"{measure}_ideal" in result else None
    order = np.argsort(plan.x.values, kind="stable")
    places, count = _places(plan)
    picked: list[Any] = [(order, slice(None), *place) for place in places]

    def panelled(array: NDArray[Any]) -> NDArray[Any]:
        return np.stack([array[place] for place in picked], axis=-1)

    values, status = panelled(values), panelled(statuses(result, plan))
    ideal = None if ideal is None else panelled(ideal)
    scope = usual_peak(ease_of_status(result, status), values, ideal)
    factor, shown = angle_scale(scope) if unit == "rad" else prefixed(scope, unit)
    named = [", ".join(one.told(i) for one, i in zip(plan.facets, place, strict=True)) for place in places]
    columns = len({place[-1] for place in places}) if len(plan.facets) == 2 else 0
    return Field(
        plan, plan.x.values[order], values, ideal, status, unit, meaning(measure, unit), scope, factor, shown,
        named, count - len(places), columns, nothing,
    )  # fmt: skip


def _places(plan: Arrangement) -> tuple[list[tuple[int, ...]], int]:
    """Indices along the facets of the panels that are drawn, and how many there are in all."""
    counts = [len(one.values) for one in plan.facets]
    every = int(np.prod(counts, dtype=int))
    while np.prod(counts, dtype=int) > MOST_PANELS:
        counts[int(np.argmax(counts))] -= 1
    picked = [thinned(len(one.values), count) for one, count in zip(plan.facets, counts, strict=True)]
    return list(product(*picked)), every


# ---- panels ---------------------------------------------------------------------------------------------------


def board(result: xr.Dataset, told: Field, title: str, upward: str) -> Board:
    """An empty figure with its panels, titled, labelled along their outer edges."""
    at, count = told.plan.at(), len(told.panels)
    title = f"{title[:1].upper()}{title[1:]}{f' at {at}' if at else ''}"
    if told.hidden:
        title += f" ({count} of {count + told.hidden} panels)"
    title = fill(title, WIDE, break_long_words=False)
    columns = _columns(told)
    rows = -(-count // columns)
    height = (4.3 if count == 1 else 1.6 + {1: 2.5, 2: 2.1}.get(rows, 1.9) * rows) + 0.2 * title.count("\n")
    sheet = new(title, result, height)
    space = sheet.add_gridspec(rows + 1, columns, height_ratios=[0.01] + [1.0] * rows)
    panels: list[Panel] = []
    for k in range(count):
        lowest, leftmost = k + columns >= count, k % columns == 0
        shared = panels[0].axes if panels else None
        where = space[1 + k // columns, k % columns] if count > 1 else space[:, :]
        axes = sheet.add_subplot(where, sharex=shared, sharey=shared)
        across = _wrapped(told.plan.x.label, ROOM[columns]) if lowest else ""
        dress(axes, across, _wrapped(upward, 60 if count == 1 else 32) if leftmost else "")
        axes.tick_params(labelbottom=lowest, labelleft=leftmost)
        if count > 1:
            axes.set_title(_within(told.panels[k], ROOM[columns]), fontsize=SIZE[columns], loc="left", color=INK)
        panels.append(Panel(axes, k))
    strip = sheet.add_subplot(space[0, :]) if count > 1 else None
    if strip is not None:
        strip.set_axis_off()
    return Board(sheet, panels, strip)


def _wrapped(text: str, room: int) -> str:
    return "\n".join(plain(line) for line in wrap(text, room, break_long_words=False))


def _columns(told: Field) -> int:
    """How many panels stand side by side: all values of the last of two names, or a block nearly square."""
    count = len(told.panels)
    if 1 < told.columns <= MOST_COLUMNS:
        return told.columns
    if count <= 3:
        return count
    return 2 if count == 4 else 3 if count <= 6 or count == 9 else MOST_COLUMNS


def _within(text: str, room: int) -> str:
    """A title of a panel in lines of so many characters, broken after commas, too long names by their ends."""
    parts = [_short(part, room) for part in text.split(", ")]
    lines = [parts[0]]
    for part in parts[1:]:
        if len(lines[-1]) + len(part) + 2 <= room:
            lines[-1] += f", {part}"
        else:
            lines[-1] += ","
            lines.append(part)
    return "\n".join(plain(line) for line in lines)


def _short(text: str, room: int) -> str:
    """An equation without so many of the first parts of its name: "…friction.coefficient = 0.1"."""
    while len(text) > room and "." in text.split(" = ")[0].lstrip("…"):
        text = f"…{text.lstrip('…').partition('.')[2]}"
    return text if len(text) <= room else f"…{text[1 - room :]}"


def tell(shown: Board, least: int = 1) -> None:
    """A legend of everything that is named in any panel: above the only one, or above all of them."""
    if shown.strip is None:
        legend(shown.panels[0].axes, least=least)
        return
    named: dict[str, Any] = {}
    entries = [entry for axes, _ in shown.panels for entry in zip(*axes.get_legend_handles_labels(), strict=True)]
    for handle, label in sorted(entries, key=lambda entry: not isinstance(entry[0], Line2D)):  # curves before areas
        named.setdefault(label, handle)
    if len(named) < least:
        shown.strip.remove()
        return
    columns = max(1, min(len(named), 100 // (max(map(len, named)) + 7)))
    shown.strip.legend(
        list(named.values()), list(named), loc="lower left", bbox_to_anchor=(0.0, 0.0), ncols=columns, frameon=False,
        fontsize=8.5, labelcolor=INK, handlelength=2.2, columnspacing=1.6, borderaxespad=0.0,
    )  # fmt: skip


def scale_of_colours(shown: Board, colours: ScalarMappable, label: str, ticks: Any = None) -> Colorbar:
    """A bar beside all panels."""
    rows = len({round(panel.axes.get_subplotspec().rowspan.start) for panel in shown.panels})  # type: ignore[union-attr]
    bar = shown.sheet.colorbar(
        colours,
        ax=[panel.axes for panel in shown.panels],
        pad=0.02,
        aspect=30 if shown.alone else 24 * rows,
        ticks=ticks,
    )
    bar.set_label(plain(label), fontsize=9, color=INK)
    bar.ax.tick_params(labelsize=8.5, colors=MUTED, labelcolor=INK)
    bar.ax.minorticks_off()
    return bar


def ring(axes: Axes, x: Array, y: Array, size: float, beyond: bool = False) -> None:
    """Rings of a size around points at which contact is lost, also over the frame; in the legend one that is seen."""
    look: dict[str, Any] = {"color": LOST, "markerfacecolor": "none", "linestyle": "", "marker": "o"}
    axes.plot([], [], markersize=7, markeredgewidth=1.2, label="contact lost at some position", **look)
    axes.plot(x, y, markersize=size, markeredgewidth=0.15 * size, zorder=4, clip_on=not beyond, **look)


# ---- axes -----------------------------------------------------------------------------------------------------


def on_scale(scale: Scale) -> str:
    """ "log" if the values of a name are positive, span ten times or more and are spaced by ratios; else "linear"."""
    values = np.unique(scale.values)
    if values.size < 3 or values[0] <= 0 or values[-1] < 10 * values[0]:
        return "linear"
    ratios, steps = np.diff(np.log(values)), np.diff(values)
    return "log" if ratios.max() / ratios.min() < min(4.0, steps.max() / steps.min()) else "linear"


def ends(scale: Scale, margin: float = 0.015) -> tuple[float, float]:
    """Ends of an axis: a little beyond the first and the last value."""
    low, high = float(scale.values.min()), float(scale.values.max())
    if on_scale(scale) == "log":
        more = (high / low) ** margin
        return low / more, high * more
    more = margin * (high - low) if high > low else 0.5 * abs(low) or 0.5
    return low - more, high + more


def ticks(axes: Axes, scale: Scale, along: str = "x", margin: float = 0.015) -> None:
    """Scale, limits and marks of an axis along which a swept name runs."""
    axis = axes.xaxis if along == "x" else axes.yaxis
    kind = on_scale(scale)
    (axes.set_xscale if along == "x" else axes.set_yscale)(kind)
    (axes.set_xlim if along == "x" else axes.set_ylim)(*ends(scale, margin))
    values = np.unique(scale.values)
    if values.size == 1:
        axis.set_ticks(values, [written(values[0])])
    elif kind == "log" and values.size <= 7:  # the values themselves, as they were given
        axis.set_ticks(values, [written(value) for value in values])
        axis.set_minor_locator(NullLocator())
    elif kind == "linear":
        form = ScalarFormatter(useMathText=True)
        form.set_powerlimits((-4, 6))
        axis.set_major_formatter(form)
        axis.get_offset_text().set(fontsize=8, color=MUTED)
