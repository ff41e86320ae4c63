"""Names in a drawing, each on that side of its place where least is drawn, with a leader where it stands further off.

The drawing is painted once without names; what is dark there is in the way. So a name keeps off links, springs, ground,
arrows, curves and titles alike, whatever draws them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from numpy.typing import NDArray

from trunnion.views.common.figures import INK, MUTED
from trunnion.views.common.lettering import plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Annotation

__all__ = ["Labels"]

Array = NDArray[np.float64]

SIDES = np.array([[np.cos(angle), np.sin(angle)] for angle in np.radians(np.arange(0, 360, 15))])
GAPS = (5.0, 8.0, 12.0, 18.0, 26.0)  # points from the place to the name
FURTHER = 0.07  # what a gap more costs, beside the share of the name's box that is not empty
LED = 3  # number of the gap from which on a leader tells whose name it is
DARK = 3.0  # pale bodies count almost as much as lines
LEAST = 6.0  # points around every place that are its joint's, however pale its symbol is
MARGIN = 1.5  # points that are to be empty around a name
CROSSED, CUT = 5.0, 100.0  # costs of lying on another name, and outside the figure
STRAY = 0.4  # cost of lying nearer to another place than to its own


class _Name(NamedTuple):
    axes: Axes
    text: str
    place: Array
    size: float
    symbol: float
    weight: str

    def reach(self) -> float:
        """Half width of its symbol, pixels."""
        ends = self.axes.transData.transform([[0.0, 0.0], [self.symbol, 0.0]])
        return float(np.hypot(*(ends[1] - ends[0])))


@dataclass
class Labels:
    """The names of one figure: added while it is drawn, placed when all else is there."""

    figure: Figure
    wanted: list[_Name] = field(default_factory=list)

    def add(
        self, axes: Axes, text: str, place: Array, size: float = 10.0, symbol: float = 0.0, weight: str = "bold"
    ) -> None:
        """A name of a place in the coordinates of the axes. size: of its letters, points; symbol: half width of what is
        drawn there, in the same coordinates."""
        if np.all(np.isfinite(place)):
            self.wanted.append(_Name(axes, plain(text), np.asarray(place, float), size, symbol, weight))

    def place(self) -> None:
        """Write all names; the figure is painted once for it."""
        if not self.wanted:
            return
        canvas = FigureCanvasAgg(self.figure)
        canvas.draw()  # type: ignore[no-untyped-call]
        spots = np.array([name.axes.transData.transform(name.place) for name in self.wanted])
        pixels = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
        board = _Board(pixels, self.figure.dpi / 72, spots, [name.reach() for name in self.wanted])
        notes = [self._note(name) for name in self.wanted]
        renderer = canvas.get_renderer()  # type: ignore[no-untyped-call]
        halves = [0.5 * np.asarray(note.get_window_extent(renderer).size, float) for note in notes]
        least = [float(np.min(board.costs(spot, half))) for spot, half in zip(spots, halves, strict=True)]
        for k in np.argsort(-np.array(least), kind="stable"):  # the most crowded first
            others = np.delete(spots, k, axis=0)
            offset, gap = board.put(spots[k], halves[k], others)
            notes[k].set_position(tuple(offset / board.scale))
            if gap >= LED:
                self._lead(self.wanted[k], offset, halves[k], board.scale)

    @staticmethod
    def _note(name: _Name) -> Annotation:
        """The name at its place, to be moved; it takes no part in the layout, which it would change."""
        note = name.axes.annotate(
            name.text, (name.place[0], name.place[1]), xytext=(0, 0), textcoords="offset points", ha="center",
            va="center", fontsize=name.size, fontweight=name.weight, color=INK, zorder=8, annotation_clip=False,
            bbox={"boxstyle": "round,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.75},
        )  # fmt: skip
        note.set_in_layout(False)
        return note

    @staticmethod
    def _lead(name: _Name, offset: Array, half: Array, scale: float) -> None:
        """A thin line from the place to the edge of the name's box."""
        share = 1 - float(np.min(half / np.maximum(np.abs(offset), 1e-9)))
        line = name.axes.annotate(
            "", (name.place[0], name.place[1]), xytext=tuple(share * offset / scale), textcoords="offset points",
            annotation_clip=False, zorder=7.5,
            arrowprops={"arrowstyle": "-", "color": MUTED, "linewidth": 0.7, "shrinkA": 0,
                        "shrinkB": max(3.0, name.reach() / scale)},
        )  # fmt: skip
        line.set_in_layout(False)


class _Board:
    """How much is drawn in any box of a painted figure, and the boxes that names have taken; pixels from below left."""

    def __init__(self, pixels: NDArray[np.uint8], scale: float, spots: Array, symbols: list[float]) -> None:
        self.scale = scale  # pixels per point
        dark = np.clip(DARK * (1 - pixels[::-1, :, :3].min(axis=2) / 255), 0, 1)
        self.height, self.width = dark.shape
        for (column, row), symbol in zip(np.rint(spots).astype(int), symbols, strict=True):
            reach = round(max(LEAST * scale, symbol))
            dark[max(row - reach, 0) : max(row + reach, 0), max(column - reach, 0) : max(column + reach, 0)] = 1.0
        self.sums = np.zeros((self.height + 1, self.width + 1))
        self.sums[1:, 1:] = np.cumsum(np.cumsum(dark, axis=0), axis=1)
        self.taken: list[tuple[Array, Array]] = []

    def offsets(self, half: Array) -> Array:
        """Where a name may lie from its place: (gap, side, 2), pixels."""
        reach = np.array(GAPS)[:, None, None] * self.scale
        return np.asarray(SIDES * reach + half * SIDES / np.max(np.abs(SIDES), axis=1, keepdims=True))

    def costs(self, spot: Array, half: Array) -> Array:
        """Of every way to lie, (gap, side): the share of the box that is drawn on, and what else speaks against it."""
        room = half + MARGIN * self.scale
        low, high = spot + self.offsets(half) - room, spot + self.offsets(half) + room
        size = np.array([self.width, self.height])
        a, b = (np.clip(np.rint(end), 0, size).astype(int) for end in (low, high))
        drawn = self.sums[b[..., 1], b[..., 0]] - self.sums[a[..., 1], b[..., 0]]
        drawn += self.sums[a[..., 1], a[..., 0]] - self.sums[b[..., 1], a[..., 0]]
        outside = np.any((low < 0) | (high > size), axis=-1)
        costs = drawn / np.prod(2 * room) + CUT * outside + FURTHER * np.arange(len(GAPS))[:, None]
        for middle, extent in self.taken:
            costs = costs + CROSSED * np.all(np.abs(spot + self.offsets(half) - middle) < room + extent, axis=-1)
        return np.asarray(costs)

    def put(self, spot: Array, half: Array, others: Array) -> tuple[Array, int]:
        """The best way to lie, from the place, and the number of its gap; its box is taken then."""
        costs, offsets = self.costs(spot, half), self.offsets(half)
        for other in others:
            far = np.linalg.norm(spot + offsets - other, axis=-1)
            costs = costs + STRAY * (far < np.linalg.norm(offsets, axis=-1))
        gap, side = np.unravel_index(int(np.argmin(costs)), costs.shape)
        self.taken.append((spot + offsets[gap, side], half))
        return offsets[gap, side], int(gap)
