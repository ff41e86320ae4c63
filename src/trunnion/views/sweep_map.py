"""Contour maps of a sweep: one number of the cycle over two names, and what hinders it where there is none.

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
from scipy.ndimage import maximum_filter

from trunnion.errors import Status
from trunnion.views.charts import Chart
from trunnion.views.common.cycle import Array
from trunnion.views.common.figures import INK, MUTED
from trunnion.views.scales import ALIKE, NOTHING, Field, Scale, axis_of, cause, middles, on_scale, rings

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from trunnion.views.draw import Board

__all__ = ["draw"]

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
        return [np.concatenate([values[:1], middles(scale, values), values[-1:]])
                for scale, values in zip(self.scales, self.places, strict=True)]  # fmt: skip


def draw(board: Board, field: Field) -> None:
    """The map of every panel, one scale of colours for all."""
    x, other = field.plan.x, field.plan.other
    assert other is not None  # as `sweep.figure` sees to
    across, upward = (np.unique(values, return_index=True)[1] for values in (field.x, other.values))
    finite = field.values[np.isfinite(field.values)]
    levels, extend = _levels(finite, field.scope)
    norm = BoundaryNorm(levels, COLOURS.N, extend=extend)
    alone = len(field.panels) == 1
    sides = axis_of(x, field.room, 0.0), axis_of(other, 60 if alone else 32, 0.0)
    ground = Ground((x, other), (field.x[across], other.values[upward]))
    for k, title in enumerate(field.panels):
        where = np.ix_(across, upward)
        values, status = field.values[:, :, k][where], field.status[:, :, k][where]
        axes = board.draw(k, Chart(*sides, [], legend=None, title="" if alone else title))
        _panel(axes, ground, values, status, norm, 7.5 if alone else 6.5, field.nothing)
        rows, columns = np.nonzero((status == Status.CONTACT_LOST) & np.isfinite(values))
        size = float(np.clip(160 / max(status.shape), 1.5, 8))  # as large as there is room, also over the frame
        lost = rings(ground.places[0][rows], ground.places[1][columns], size, beyond=True) if rows.size else []
        board.add(k, Chart(*sides, [*lost, *field.beyond(k)]))
    board.finish()
    if finite.size:
        constant = bool(np.ptp(finite) <= ALIKE * np.abs(finite).max())
        places = levels.mean(keepdims=True) if constant else levels
        say = _numbers(places)
        bar = board.colour_bar(ScalarMappable(norm, COLOURS), field.label, places)
        bar.ax.set_yticks(places, [say(value) for value in places])


def _levels(levels_of: Array, scope: float) -> tuple[Array, Beyond]:
    """Round edges of a few bands over what is shown, and the side on which there is more."""
    if not levels_of.size:
        return np.array([0.0, 1.0]), "neither"
    low, high = max(float(levels_of.min()), -scope), min(float(levels_of.max()), scope)
    if high - low <= ALIKE * max(abs(low), abs(high)):
        half = 0.05 * max(abs(low), abs(high)) or 1.0
        return np.array([low - half, high + half]), "neither"
    levels = np.asarray(MaxNLocator(BANDS, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high), float)
    below, above = levels_of.min() < levels[0], levels_of.max() > levels[-1]
    return levels, "both" if below and above else "min" if below else "max" if above else "neither"


def _panel(
    axes: Axes, over: Ground, values: Array, status: NDArray[np.int8], norm: BoundaryNorm, size: float, nothing: str
) -> None:
    """One map: values and status (x, y), x and y rising; size: of the numbers at the lines."""
    missing = ~np.isfinite(values)
    axes.grid(False)
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
    at_gaps = maximum_filter(missing, 3, mode="constant") & ~missing
    where = np.argwhere(at_gaps)
    if where.size:
        boxes = [_box(edges, i, i + 1, k) for i, k in where]
        colours = COLOURS(norm(values[at_gaps]))
        patches = PolyCollection(boxes, facecolors=colours, edgecolors=colours, linewidths=0.3, zorder=0.8)
        axes.add_collection(patches, autolim=False)


def _box(edges: list[Array], start: int, stop: int, k: int) -> list[tuple[float, float]]:
    left, right, low, high = edges[0][start], edges[0][stop], edges[1][k], edges[1][k + 1]
    return [(left, low), (right, low), (right, high), (left, high), (left, low)]


def _lines(axes: Axes, x: Array, y: Array, field: Any, levels: Array, size: float) -> None:
    """Lines between the bands with their numbers, but where these would crowd or be cut off."""
    within = [level for level in levels if float(field.min()) < level < float(field.max())]
    if not within:
        return
    contours = axes.contour(
        x, y, field.T, levels=within, colors=INK, linewidths=0.6, linestyles="-", corner_mask=False, zorder=2
    )
    boxes: list[tuple[float, float]] = []
    inside = axes.transData + axes.transAxes.inverted()
    for text in axes.clabel(contours, fontsize=size, fmt=_numbers(levels), inline=False):
        h, v = inside.transform(text.get_position())
        crowded = any(abs(h - across) < 0.08 and abs(v - upward) < 0.06 for across, upward in boxes)
        if crowded or not (0.03 < h < 0.97 and 0.03 < v < 0.97):
            text.remove()
            continue
        boxes.append((h, v))
        text.set_path_effects([withStroke(linewidth=2.2, foreground="white", alpha=0.85)])


def _numbers(levels: Array) -> Callable[[float], str]:
    """How numbers are written: with as many decimals as the edges of the bands ask for."""
    steps = np.diff(levels) * 10.0 ** np.arange(7).reshape(-1, 1)  # (decimals, step)
    enough = np.flatnonzero(np.all(np.abs(steps - np.round(steps)) < 1e-6 * np.abs(steps), axis=1) & (len(levels) > 1))
    form = f".{enough[0]}f" if enough.size and np.max(np.abs(levels)) < 1e6 else ".4g"
    return lambda value: f"{value + 0.0:{form}}".replace("-", "−")


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
