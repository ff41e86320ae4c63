"""Contour maps: one number of the cycle over two swept names, and what hinders it where there is none.

Contours are drawn only within cells of the grid that have a number at all four corners. Around other points that have
one, up to half-way to the next, its band is drawn; points without one get the fill and hatch of their cause.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import BoundaryNorm
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator

from trunnion.errors import Finding, MechanismError, Status
from trunnion.views.common.cycle import Array
from trunnion.views.common.figures import INK, MUTED, outside
from trunnion.views.scales import Scale, cause
from trunnion.views.sweep.panels import ALIKE, NOTHING, Board, Field, on_scale, ring, scale_of_colours, tell, ticks

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

__all__ = ["draw", "need_two"]

Beyond = Literal["neither", "both", "min", "max"]

BANDS = 10
COLOURS = colormaps["viridis"]
FINER = 8  # parts of a cell along a logarithmic axis
# fill and hatch of what has no number, to be told apart without colours
LOOKS: dict[int, tuple[str, str]] = {
    Status.NOT_CONVERGED: ("#f3f4f6", "..."),
    Status.LOCKED: ("#dfe2e6", "////"),
    Status.LOAD_UNDEFINED: ("#f3f4f6", "||||"),
    Status.SINGULAR: ("#dfe2e6", "----"),
    Status.NOT_ASSEMBLED: ("#eceef1", "xxx"),
}


class Ground(NamedTuple):
    """What a map is drawn over: the two names, and their values rising, each once."""

    scales: tuple[Scale, Scale]
    places: tuple[Array, Array]

    def edges(self) -> list[Array]:
        """Where the surroundings of each value end: half-way to the next, at the first and last value at these."""
        found = []
        for scale, values in zip(self.scales, self.places, strict=True):
            log = on_scale(scale) == "log"
            middle = np.sqrt(values[:-1] * values[1:]) if log else (values[:-1] + values[1:]) / 2
            found.append(np.concatenate([values[:1], middle, values[-1:]]))
        return found


def need_two(told: Field) -> None:
    """MechanismError if there are not two names with two values or more to draw a map over."""
    plan = told.plan
    short = [one.name for one in (plan.x, plan.other) if one is not None and np.unique(one.values).size < 2]
    if plan.other is None or short:
        what = f"'{short[0]}' has one value" if short else f"'{plan.x.name}' alone is swept"
        remedy = "sweep over two names with several values each, or draw curves"
        raise MechanismError(Finding(f"{what}: a map needs two that vary", "--kind map", remedy))


def draw(shown: Board, told: Field) -> None:
    """The map of every panel, one scale of colours for all."""
    need_two(told)
    other = told.plan.other
    assert other is not None  # need_two
    across, upward = _first(told.x), _first(other.values)
    known = told.values[np.isfinite(told.values)] * told.factor
    levels, extend = _levels(known, told.scope * told.factor)
    norm = BoundaryNorm(levels, COLOURS.N, extend=extend)
    for axes, place in shown.panels:
        where = np.ix_(across, upward)
        values, status = told.values[:, :, place][where], told.status[:, :, place][where]
        over = Ground((told.plan.x, other), (told.x[across], other.values[upward]))
        _panel(axes, over, values * told.factor, status, norm, 7.5 if shown.alone else 6.5, told.nothing)
        peak = float(np.nanmax(np.abs(values), initial=0.0))
        if peak > told.scope:
            outside(axes, peak, told.unit)
    tell(shown)
    if known.size:
        constant = bool(np.ptp(known) <= ALIKE * np.abs(known).max())
        marks = levels.mean(keepdims=True) if constant else levels
        say = _numbers(marks)
        bar = scale_of_colours(shown, ScalarMappable(norm, COLOURS), told.label, marks)
        bar.ax.set_yticks(marks, [say(value) for value in marks])


def _first(values: Array) -> NDArray[np.intp]:
    """Indices of the values, rising, each once."""
    return np.unique(values, return_index=True)[1]


def _levels(known: Array, scope: float) -> tuple[Array, Beyond]:
    """Round edges of a few bands over what is shown, and the side on which there is more."""
    if not known.size:
        return np.array([0.0, 1.0]), "neither"
    low, high = max(float(known.min()), -scope), min(float(known.max()), scope)
    if high - low <= ALIKE * max(abs(low), abs(high)):
        half = 0.05 * max(abs(low), abs(high)) or 1.0
        return np.array([low - half, high + half]), "neither"
    levels = np.asarray(MaxNLocator(BANDS, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high), float)
    below, above = known.min() < levels[0], known.max() > levels[-1]
    return levels, "both" if below and above else "min" if below else "max" if above else "neither"


def _panel(
    axes: Axes, over: Ground, values: Array, status: NDArray[np.int8], norm: BoundaryNorm, size: float, nothing: str
) -> None:
    """One map: values and status (x, y), x and y rising; size: of the numbers at the lines."""
    missing = ~np.isfinite(values)
    axes.grid(False)
    ticks(axes, over.scales[0], "x", 0.0)
    ticks(axes, over.scales[1], "y", 0.0)
    edges = over.edges()
    _beside_gaps(axes, edges, values, missing, norm)
    if not missing.all():
        x, y, field = _refined(over, np.where(missing, np.nan, values))
        axes.contourf(
            x, y, field.T, levels=norm.boundaries, cmap=COLOURS, norm=norm, extend=norm.extend, corner_mask=False,
            antialiased=False, zorder=1,
        )  # fmt: skip
        _lines(axes, x, y, field, norm.boundaries, size)
    codes = np.where(status >= Status.NOT_CONVERGED, status, np.where(missing, NOTHING, 0))
    for code in (NOTHING, *LOOKS):
        word = cause(code) if code != NOTHING else nothing
        _hinder(axes, edges, codes == code, code, word, filled=bool(missing[codes == code].any()))
    _lost(axes, *over.places, (status == Status.CONTACT_LOST) & ~missing)


def _refined(over: Ground, values: Array) -> tuple[Array, Array, Any]:
    """The field, masked where it is not known; along a logarithmic axis with points between, straight there."""
    places = list(over.places)
    for axis, scale in enumerate(over.scales):
        if on_scale(scale) != "log":
            continue
        size = places[axis].size
        count = np.arange(FINER * (size - 1) + 1) / FINER
        below = np.minimum(count.astype(int), size - 2)
        share = (count - below).reshape((-1, 1) if axis == 0 else (1, -1))
        low, high = np.take(values, below, axis), np.take(values, below + 1, axis)
        # at the points themselves their own number, though the neighbour may have none
        values = np.where(share == 0, low, np.where(share == 1, high, low + share * (high - low)))
        places[axis] = np.exp(np.interp(count, np.arange(size), np.log(places[axis])))
        places[axis][::FINER] = over.places[axis]
    return places[0], places[1], np.ma.masked_invalid(values)


def _beside_gaps(axes: Axes, edges: list[Array], values: Array, missing: NDArray[np.bool_], norm: BoundaryNorm) -> None:
    """Below the contours: the surroundings of points next to one without a number, in the colour of their band."""
    grown = np.zeros(np.add(missing.shape, 2), bool)
    for i in range(3):
        for k in range(3):
            grown[i : i + missing.shape[0], k : k + missing.shape[1]] |= missing
    where = np.argwhere(grown[1:-1, 1:-1] & ~missing)
    if where.size:
        boxes = [_box(edges, i, i + 1, k) for i, k in where]
        colours = COLOURS(norm(values[tuple(where.T)]))
        found = PolyCollection(boxes, facecolors=colours, edgecolors=colours, linewidths=0.3, zorder=0.8)
        axes.add_collection(found, autolim=False)


def _box(edges: list[Array], start: int, stop: int, k: int) -> list[tuple[float, float]]:
    left, right, low, high = edges[0][start], edges[0][stop], edges[1][k], edges[1][k + 1]
    return [(left, low), (right, low), (right, high), (left, high), (left, low)]


def _lines(axes: Axes, x: Array, y: Array, field: Any, levels: Array, size: float) -> None:
    """Lines between the bands with their numbers, but where these would crowd or be cut off."""
    within = [level for level in levels if float(field.min()) < level < float(field.max())]
    if not within:
        return
    found = axes.contour(
        x, y, field.T, levels=within, colors=INK, linewidths=0.6, linestyles="-", corner_mask=False, zorder=2
    )
    taken: list[tuple[float, float]] = []
    inside = axes.transData + axes.transAxes.inverted()
    for text in axes.clabel(found, fontsize=size, fmt=_numbers(levels), inline=False):
        h, v = inside.transform(text.get_position())
        crowded = any(abs(h - across) < 0.08 and abs(v - upward) < 0.06 for across, upward in taken)
        if crowded or not (0.03 < h < 0.97 and 0.03 < v < 0.97):
            text.remove()
            continue
        taken.append((h, v))
        text.set_path_effects([withStroke(linewidth=2.2, foreground="white", alpha=0.85)])


def _numbers(levels: Array) -> Callable[[float], str]:
    """How numbers are written: with as many decimals as the edges of the bands ask for."""
    steps = np.diff(levels) * 10.0 ** np.arange(7).reshape(-1, 1)  # (decimals, step)
    enough = np.all(np.abs(steps - np.round(steps)) < 1e-6 * np.abs(steps), axis=1) if len(levels) > 1 else np.zeros(1)
    digits = int(np.argmax(enough))

    def say(value: float) -> str:
        known = enough.any() and abs(value) < 1e6
        return (f"{value + 0.0:.{digits}f}" if known else f"{value + 0.0:.4g}").replace("-", "−")

    return say


def _hinder(axes: Axes, edges: list[Array], where: NDArray[np.bool_], code: int, word: str, filled: bool) -> None:
    """Fill and hatch of the surroundings of points with one cause; only the hatch over numbers that are known."""
    if not where.any():
        return
    boxes = []
    for k in range(where.shape[1]):
        changes = np.flatnonzero(np.diff(np.concatenate([[0], where[:, k].astype(np.int8), [0]])))
        boxes += [_box(edges, start, stop, k) for start, stop in changes.reshape(-1, 2)]
    outline = [Path.MOVETO, Path.LINETO, Path.LINETO, Path.LINETO, Path.CLOSEPOLY]
    path = Path(np.concatenate(boxes), outline * len(boxes))
    fill, hatch = LOOKS.get(code, ("white", "oo"))
    look: dict[str, Any] = {
        "facecolor": fill if filled else "none", "edgecolor": MUTED if code != NOTHING else "#b4bac1", "hatch": hatch,
        "linewidth": 0,
    }  # fmt: skip
    axes.add_patch(PathPatch(path, zorder=1.5, label=word, **look))


def _lost(axes: Axes, x: Array, y: Array, where: NDArray[np.bool_]) -> None:
    """Rings around points of whose cycle a position loses contact, as large as there is room."""
    rows, columns = np.nonzero(where)
    if rows.size:
        ring(axes, x[rows], y[columns], float(np.clip(160 / max(where.shape), 1.5, 8)), beyond=True)
