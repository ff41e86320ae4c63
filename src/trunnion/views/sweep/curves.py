"""Families of curves: one number of the cycle over a swept name, a curve for each value of a second."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.transforms import blended_transform_factory

from trunnion.errors import Status
from trunnion.views.common.cycle import Array
from trunnion.views.common.figures import INK, MUTED, SHADE, outside, style_of
from trunnion.views.common.lettering import plain
from trunnion.views.scales import Scale, cause
from trunnion.views.sweep.panels import (
    ALIKE,
    NOTHING,
    Board,
    Field,
    Panel,
    ends,
    on_scale,
    ring,
    scale_of_colours,
    tell,
    ticks,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

__all__ = ["draw"]

# of the mechanism without errors
IDEAL: dict[str, Any] = {"color": INK, "linestyle": (0, (4, 2)), "linewidth": 1.0, "markersize": 2.2}
MOST_NAMED = 8  # curves that are told apart by a legend; more by a scale of colours
MARKS = "os^DvPX*"  # so that curves are told apart in grey, too
HATCH = "#d3d7dd"
MOST_MARKED = 40  # points of a curve that are marked
# without the end that fades on white
RISING = ListedColormap(colormaps["viridis"](np.linspace(0.0, 0.9, 256)), "viridis to green")


def draw(shown: Board, told: Field) -> None:
    """The curves of every panel, their frame, and what tells them apart."""
    for panel in shown.panels:
        _panel(panel, told, shown.alone)
    _frame(shown.panels, told)
    tell(shown)
    other = told.plan.other
    if other is not None and len(other.values) > MOST_NAMED:
        scale_of_colours(shown, _colours(other), other.label).outline.set_visible(False)


def _panel(panel: Panel, told: Field, alone: bool) -> None:
    axes, other = panel.axes, told.plan.other
    x, y, status = told.x, told.values[:, :, panel.place], told.status[:, :, panel.place]
    ideal = None if told.ideal is None else told.ideal[:, :, panel.place]
    empty = ~np.isfinite(y) & (status < Status.NOT_CONVERGED) & bool(np.isfinite(y).any())
    _shade(axes, told.plan.x, x, np.where(empty, NOTHING, status), alone, told.nothing)
    count = y.shape[1]
    for k in range(count):
        look = _look(k, count, x.size, ideal is not None) if count <= MOST_NAMED else _coloured(other, k)
        label = "as built" if ideal is not None else None
        if other is not None:  # many are told apart by the scale of colours
            label = plain(other.told(k)) if count <= MOST_NAMED else None
        _curve(axes, x, y[:, k] * told.factor, label, look)
        if ideal is not None:
            name = "ideal" if other is None else "ideal, dashed"
            _curve(axes, x, ideal[:, k] * told.factor, name if k == count - 1 else None, {**look, **IDEAL})
    _lost(axes, x, y * told.factor, status)
    ticks(axes, told.plan.x)
    if not np.isfinite(y).any() and not (status >= Status.NOT_CONVERGED).any():
        axes.text(
            0.5, 0.5, f"{told.nothing} at all points", transform=axes.transAxes, ha="center", fontsize=8, color=MUTED
        )


def _look(index: int, count: int, points: int, beside: bool) -> dict[str, Any]:
    """Colour of a curve, and its marks or, of curves without, its dashes; beside ideal ones none."""
    look = style_of(index)
    if points <= MOST_MARKED:
        return {**look, "marker": MARKS[index], "linestyle": "-"}
    dashes = ("-", (0, (6, 2)), (0, (2, 1.5)), (0, (6, 2, 1.5, 2)))
    return {**look, "linestyle": "-" if beside or count == 1 else dashes[index % 4]}


def _coloured(other: Scale | None, index: int) -> dict[str, Any]:
    assert other is not None  # there are many curves only over a second name
    return {"color": _colours(other).to_rgba(other.values[index]), "linewidth": 1.2, "marker": ""}


def _colours(other: Scale) -> ScalarMappable:
    low, high = float(other.values.min()), float(other.values.max())
    if on_scale(other) == "log":
        return ScalarMappable(LogNorm(low, high), RISING)
    if low == high:  # one value many times
        low, high = ends(other)
    return ScalarMappable(Normalize(low, high), RISING)


def _curve(axes: Axes, x: Array, y: Array, label: str | None, look: dict[str, Any]) -> None:
    """One curve; few points are marked, and those beside a gap with a cross."""
    marks: dict[str, Any] = {"marker": "o", "markersize": 3.5} if x.size <= MOST_MARKED else {}
    if x.size == 1:
        marks = {"marker": "o", "markersize": 5}
        look = {key: value for key, value in look.items() if key != "marker" or value}
    axes.plot(x, y, label=label, **{"linewidth": 1.6, **marks, **look})
    known = np.isfinite(y)
    edges = known & (np.append(False, ~known[:-1]) | np.append(~known[1:], False))
    if edges.any():
        size = 7 if "marker" not in look or look["marker"] else 3.5  # of a curve among many
        axes.plot(x[edges], y[edges], "x", markersize=size, color=look["color"], markeredgewidth=0.23 * size, zorder=4)


def _lost(axes: Axes, x: Array, y: Array, status: NDArray[np.int8]) -> None:
    """Rings around points of whose cycle a position loses contact: what stands there is not to be built on."""
    rows, columns = np.nonzero((status == Status.CONTACT_LOST) & np.isfinite(y))
    if rows.size:
        ring(axes, x[rows], y[rows, columns], float(np.clip(8 * np.sqrt(60 / rows.size), 2, 8)))


def _frame(panels: list[Panel], told: Field) -> None:
    """One scale upwards for all panels, cut where some rise far above the rest; flat curves in the middle of it."""
    both = told.values if told.ideal is None else np.append(told.values, told.ideal)
    known = both[np.isfinite(both)] * told.factor
    axes = panels[0].axes
    if not known.size:
        axes.set_yticks([])
        return
    low, high, scope = float(known.min()), float(known.max()), told.scope * told.factor
    most = max(abs(low), abs(high))
    if high - low <= ALIKE * most:
        half = 0.1 * most or 1.0
        axes.set_ylim(low - half, high + half)
    if scope >= most:
        return
    axes.set_ylim(max(min(low, 0.0), -scope) * 1.05, min(max(high, 0.0), scope) * 1.05)
    for panel in panels:
        here = np.abs(told.values[:, :, panel.place])
        peak = float(np.nanmax(here, initial=0.0))
        if peak > told.scope:
            outside(panel.axes, peak, told.unit)


# ---- where there is no answer ---------------------------------------------------------------------------------


def _shade(
    axes: Axes, scale: Scale, x: Array, status: NDArray[np.int8], alone: bool, nothing: str = "no value"
) -> None:
    """Grey where no curve has an answer, hatched where some have none; the cause beside it or, in panels, above.

    status: or NOTHING, where a point with an answer has no number.
    """
    missing = (status >= Status.NOT_CONVERGED) | (status == NOTHING)
    low, high = ends(scale)
    middle = np.sqrt(x[:-1] * x[1:]) if on_scale(scale) == "log" else (x[:-1] + x[1:]) / 2
    edges = np.concatenate([[low], middle, [high]])
    kind = np.where(missing.all(axis=1), 2, np.where(missing.any(axis=1), 1, 0))
    codes = np.where(missing, status, NOTHING).max(axis=1)
    changes = np.flatnonzero(np.diff(np.append(0, kind)) != 0)
    said: set[str] = set()
    for start in (int(one) for one in changes if kind[one]):
        stop = next((i for i in range(start, len(kind)) if kind[i] != kind[start]), len(kind))
        all_of_it = kind[start] == 2
        look: dict[str, Any] = (
            {"color": SHADE} if all_of_it else {"facecolor": "none", "edgecolor": HATCH, "hatch": "///"}
        )
        code = int(codes[start:stop].max())
        text = (nothing if code == NOTHING else cause(code)) + ("" if all_of_it else " for some")
        axes.axvspan(edges[start], edges[stop], linewidth=0, zorder=0.5, **look)
        if alone:
            place = _middle(scale, edges[start], edges[stop])
            _write(axes, place, text, again=text in said, wide=(stop - start) / len(kind) > 0.03)
        elif text not in said:
            axes.fill_between([], [], label=text, **({**look, "linewidth": 0}))
        said.add(text)


def _middle(scale: Scale, low: float, high: float) -> float:
    return float(np.sqrt(low * high)) if on_scale(scale) == "log" else (low + high) / 2


def _write(axes: Axes, x: float, text: str, again: bool, wide: bool) -> None:
    """The cause upright in its stripe; a second time only where there is room for it."""
    if again and not wide:
        return
    over = blended_transform_factory(axes.transData, axes.transAxes)
    axes.text(
        x, 0.5, text, transform=over, rotation=90, ha="center", va="center", fontsize=8, color=MUTED, zorder=3,
        clip_on=True,
    )  # fmt: skip
