"""Seat diagrams: how the pin of each joint lies in its hole, drawn with the play magnified by a number that is stated.

The play is to scale; the radii of pin and hole are not, or the play could not be seen beside them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Colormap, LinearSegmentedColormap, Normalize
from matplotlib.patches import Circle, Rectangle
from numpy.typing import NDArray

from trunnion.results.quantities import number, prefixed, quantity
from trunnion.views.common.cycle import Abscissa, Array, abscissa
from trunnion.views.common.figures import INK, MUTED, PALETTE, SHADE, dress, new
from trunnion.views.common.lettering import plain
from trunnion.views.cycle.deviations import Seats, need, seated

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["seat"]

PIN = 1.1  # radius of the pin as drawn, of the clearance
WALL = 0.25  # thickness of the hole's wall as drawn
ARROW = 0.8  # length of the largest load
ROOM = 1.0 + PIN + ARROW  # half width of a diagram without its labels
BESIDE = 0.26  # in; room for labels around it
NEAR = 0.07  # in; tips that are nearer share a label
DEEP = 2.4  # half height of that of a guide
FACTORS = (
    1.0,
    1.1,
    1.2,
    1.3,
    1.4,
    1.5,
    1.6,
    1.8,
    2.0,
    2.2,
    2.5,
    2.8,
    3.0,
    3.2,
    3.5,
    4.0,
    4.5,
    5.0,
    5.5,
    6.0,
    7.0,
    8.0,
    9.0,
)
INCH = 0.0254
ALONG = (-0.75, -0.4, 0.4, 0.75)  # where the labels of a guide stand, clear of where its bars cross
LONGEST = 16  # signs of a link's name
# round the turn and back to the first colour; from the palette of the curves
TURN = LinearSegmentedColormap.from_list("turn", [PALETTE[k] for k in (0, 2, 4, 1, 3, 0)])


@dataclass(frozen=True)
class Cell:
    """One diagram: a joint's seat at one end, seen along an axis of its hole.

    plane: the axes across and up; offset, force (2, position) m and N; peak: largest load of the joint, N.
    """

    seats: Seats
    end: int
    plane: tuple[int, int]
    offset: Array
    force: Array
    peak: float

    @property
    def title(self) -> str:
        """The joint, and which end of it or which of its projections."""
        joint = self.seats.joint
        if self.seats.kind == "ball":
            return f"{joint}: {''.join('xyz'[axis] for axis in self.plane)}"
        return f"{joint}, end {self.end + 1}" if len(self.seats.offsets) == 2 and not self.seats.planar_guide else joint


@dataclass(frozen=True)
class Hue:
    """Colours of the positions: over the drive, closed into a ring over a whole turn. inch: about what a clearance is
    drawn as.
    """

    over: Abscissa
    colours: Colormap
    scale: Normalize
    inch: float

    def of(self, values: Any) -> Any:
        return self.colours(self.scale(values))


def seat(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Figure:
    """Pin in hole for every joint and end: locus of the pin's centre over the drive, marked positions, their loads."""
    need(result, "seats", "seat")
    over = abscissa(result)
    cells = [cell for one in seated(result) for cell in _cells(one)]
    across = _across(cells)
    rows = max(-(-len(cells) // across), 1)
    width = {1: 4.6, 4: 10.4}.get(across, 7.4)
    square = (width - 1.2) / across - 0.62  # in; what labels leave of a column
    figure = new("Seats of the pins in their holes", result, 0.55 + rows * (square + 1.05), width)
    grid = figure.subplots(rows, across, squeeze=False)
    hue = _hue(over, (square / 2 - BESIDE) / ROOM)
    for axes in grid.ravel()[len(cells) :]:
        axes.set_visible(False)
    for axes, cell in zip(grid.ravel(), cells, strict=False):
        if cell.seats.planar_guide:
            _guide(axes, cell, hue)
        else:
            _disc(axes, cell, hue)
    bar = figure.colorbar(ScalarMappable(hue.scale, hue.colours), ax=list(grid.ravel()), pad=0.015, aspect=40)
    bar.set_label(plain(over.title), fontsize=9, color=INK)
    bar.ax.tick_params(labelsize=8.5, colors=MUTED, labelcolor=INK)
    if over.unit == "°" and over.closed:
        low, high = hue.scale.vmin or 0.0, hue.scale.vmax or 0.0
        bar.set_ticks(np.arange(np.ceil(low / 90) * 90, high + 1, 90).tolist())
    _magnify(figure, list(zip(grid.ravel(), cells, strict=False)))
    return figure


def _cells(seats: Seats) -> list[Cell]:
    sizes = np.linalg.norm(np.nan_to_num(seats.forces), axis=1)
    peak = float(sizes.max(initial=0.0))

    def cell(end: int, plane: tuple[int, int]) -> Cell:
        return Cell(seats, end, plane, seats.offsets[end, list(plane)], seats.forces[end, list(plane)], peak)

    if seats.kind == "ball":
        return [cell(0, (0, 1)), cell(0, (0, 2))]
    if seats.planar_guide:
        return [cell(0, (0, 1))]
    return [cell(end, (0, 1)) for end in range(len(seats.offsets))]


def _across(cells: list[Cell]) -> int:
    """Diagrams in a row: both ends of a joint stay side by side."""
    pairs = any(
        (len(cell.seats.offsets) == 2 and not cell.seats.planar_guide) or cell.seats.kind == "ball" for cell in cells
    )
    if pairs:
        return 2 if len(cells) <= 2 else 4
    return len(cells) if len(cells) <= 2 else 2 if len(cells) == 4 else 3


def _hue(over: Abscissa, inch: float) -> Hue:
    low = float(over.values.min(initial=np.inf))
    high = float(over.values.max(initial=-np.inf))
    if over.closed:
        low, high = sorted((float(over.values[0]), float(over.values[0] + over.period)))
    return Hue(
        over, TURN if over.closed else colormaps["viridis"], Normalize(low, high if high > low else low + 1), inch
    )


def _marked(over: Abscissa, known: NDArray[np.bool_]) -> list[int]:
    """Positions that are told by name: every quarter of a turn, or start, middle and end of a way."""
    if not known.any():
        return []
    if over.closed:
        angles = over.values[0] + over.period * np.arange(4) / 4
        picked = [int(np.argmin(np.abs(over.values - angle))) for angle in angles]
    else:
        picked = [0, over.values.size // 2, over.values.size - 1]
    return [index for index in dict.fromkeys(picked) if known[index]]


# ---- one diagram ----------------------------------------------------------------------------------------------


def _disc(axes: Axes, cell: Cell, hue: Hue) -> None:
    """Pin in hole: wall, clearance, locus, and at the marked positions the pin with its load."""
    clearance = cell.seats.clearance
    factor, unit = prefixed(clearance, "m")
    rho, offset = clearance * factor, cell.offset * factor
    dress(axes, *(f"{'xyz'[axis]} [{unit}]" for axis in cell.plane))
    axes.grid(False)
    axes.set_box_aspect(1)
    _wall(axes, cell, rho)
    axes.plot([0], [0], "+", color=MUTED, markersize=7, markeredgewidth=0.9, zorder=2)
    known = np.asarray(np.isfinite(offset).all(axis=0))
    _locus(axes, offset, hue, 1.0 * rho)
    tips: dict[int, Array] = {}
    for index in _marked(hue.over, known):
        colour = hue.of(hue.over.values[index])
        _pin(axes, cell, offset[:, index], rho, colour)
        tip = _load(axes, cell, index, rho, factor, colour)
        if tip is not None:
            tips[index] = tip
    _say(axes, cell, tips, rho / hue.inch, hue.over)
    ticks = [-rho, 0.0, rho]
    axes.set_xticks(ticks, [_tick(-rho), "", _tick(rho)])  # 0 has no room beside them in a small hole
    axes.set_yticks(ticks, [_tick(tick) for tick in ticks])
    if cell.seats.along > 0:
        slack = cell.seats.offsets[cell.end, 2] * factor
        if np.isfinite(slack).any():
            text = f"along the axis {number(float(np.nanmin(slack)), 3)} to {number(float(np.nanmax(slack)), 3)} {unit}"
            axes.text(0.02, 0.02, text, transform=axes.transAxes, fontsize=7, color=MUTED)


def _tick(value: float) -> str:
    return f"{value:.3g}".replace("-", "−")


def _wall(axes: Axes, cell: Cell, rho: float) -> None:
    """The hole as a ring around what the pin may fill, and the border of what its centre may reach."""
    size = (1 + PIN) * rho
    look: dict[str, Any] = {"facecolor": "white", "edgecolor": INK, "linewidth": 1.4, "zorder": 0.8}
    outer: dict[str, Any] = {"facecolor": SHADE, "edgecolor": "none", "zorder": 0.7}
    border: dict[str, Any] = {
        "facecolor": "none",
        "edgecolor": MUTED,
        "linewidth": 0.8,
        "linestyle": (0, (3, 2)),
        "zorder": 2,
    }
    wide = size + WALL * rho
    if cell.seats.kind == "guide":
        for half, one in ((wide, outer), (size, look), (rho, border)):
            axes.add_patch(Rectangle((-half, -half), 2 * half, 2 * half, **one))
        return
    for radius, one in ((wide, outer), (size, look), (rho, border)):
        axes.add_patch(Circle((0, 0), radius, **one))


def _pin(axes: Axes, cell: Cell, place: Array, rho: float, colour: Any) -> None:
    radius = PIN * rho
    look: dict[str, Any] = {
        "facecolor": (*colour[:3], 0.07),
        "edgecolor": (*colour[:3], 0.85),
        "linewidth": 1.1,
        "zorder": 1.5,
    }
    if cell.seats.kind == "guide":
        axes.add_patch(Rectangle((place[0] - radius, place[1] - radius), 2 * radius, 2 * radius, **look))
    else:
        axes.add_patch(Circle((place[0], place[1]), radius, **look))
    axes.plot(*place, "o", color=colour, markersize=5.5, markeredgecolor="white", markeredgewidth=0.7, zorder=5)


def _locus(axes: Axes, offset: Array, hue: Hue, jump: float) -> None:
    """The track of the pin's centre in the colours of the drive, broken at jumps; a dot where one stands alone."""
    x = hue.over.values
    if hue.over.closed:
        offset, x = np.hstack([offset, offset[:, :1]]), np.append(x, x[0] + hue.over.period)
    steps = np.linalg.norm(np.diff(offset, axis=1), axis=0)
    drawn = np.flatnonzero(steps < jump)  # NaN is not
    pieces = np.stack([offset[:, drawn].T, offset[:, drawn + 1].T], axis=1)
    if drawn.size:
        lines = LineCollection(list(pieces), colors=hue.of((x[drawn] + x[drawn + 1]) / 2), linewidths=2.6, zorder=3)
        axes.add_collection(lines, autolim=False)
    known = np.isfinite(offset).all(axis=0)
    alone = known & ~np.append(False, steps < jump) & ~np.append(steps < jump, False)
    axes.scatter(offset[0, alone], offset[1, alone], c=hue.of(x[alone]), s=14, zorder=3, linewidths=0)


def _load(axes: Axes, cell: Cell, index: int, rho: float, factor: float, colour: Any) -> Array | None:
    """The load on the hole at a position, outwards from where the pin touches it; its tip, None of one too small."""
    force, place = cell.force[:, index], cell.offset[:, index] * factor
    if not np.hypot(*force) > 0.02 * cell.peak:
        return None
    way = np.hypot(*place)
    start = place * (1 + PIN * rho / way) if way > 1e-9 * rho else place
    tip = np.asarray(start + force / cell.peak * ARROW * rho)
    arrow = {"arrowstyle": "-|>", "color": colour, "linewidth": 1.5, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 9}
    axes.annotate("", xy=(tip[0], tip[1]), xytext=(start[0], start[1]), arrowprops=arrow, zorder=6)
    return tip


def _say(axes: Axes, cell: Cell, tips: dict[int, Array], inch: float, over: Abscissa) -> None:
    """The positions beyond the tips of their loads, moved aside from one another; tips that coincide share a label.

    inch: on paper, in the units of the axes.
    """
    groups: list[list[int]] = []
    for index, tip in tips.items():
        near = (group for group in groups if np.hypot(*(tips[group[0]] - tip)) < NEAR * inch)
        group = next(near, None)
        if group:
            group.append(index)
        else:
            groups.append([index])
    shown: list[tuple[Array, Array]] = []  # middle and half size of every label
    mean = np.sum(list(tips.values()), axis=0) if tips else np.zeros(2)
    # in their order around the hole, so that moving one aside puts it past no other
    groups.sort(
        key=lambda group: np.arctan2(mean[0] * tips[group[0]][1] - mean[1] * tips[group[0]][0], mean @ tips[group[0]])
    )
    for index, *more in groups:
        way = cell.force[:, index] / np.hypot(*cell.force[:, index])
        words = [over.say(one) for one in (index, *more)]
        stacked = abs(way[0]) > abs(way[1])
        wide = max(map(len, words)) if stacked else sum(map(len, words)) + 2 * len(more)
        half = np.array([0.034 * wide, 0.065 * (len(words) if stacked else 1)]) * inch
        middle = tips[index] + way * (half + 0.045 * inch)
        aside = 0.04 * inch * np.array([-way[1], way[0]])
        places = (middle + sign * step * aside for step in range(16) for sign in (1, -1))
        free = (at for at in places if not any((np.abs(at - one) < half + size).all() for one, size in shown))
        place = next(free, middle)
        shown.append((place, half))
        text = ("\n" if stacked else ", ").join(words)
        said = axes.text(
            place[0], place[1], text, fontsize=7.5, color=INK, ha="center", va="center", zorder=7, linespacing=1.1
        )
        said.set_in_layout(False)  # its place is in the diagram: it asks for no room


def _guide(axes: Axes, cell: Cell, hue: Hue) -> None:
    """A guide of the plane: the middle line of the bar between its limits, across magnified, along to another scale."""
    seats = cell.seats
    factor, unit = prefixed(seats.clearance, "m")
    length = seats.length or 1.0
    long, long_unit = prefixed(length, "m")
    rho, half = seats.clearance * factor, 0.5 * length * long
    dress(axes, f"along the guide [{long_unit}]", f"across [{unit}]")
    axes.grid(False)
    axes.set_box_aspect(1)
    for sign in (1, -1):
        axes.plot([-half, half], [sign * rho] * 2, color=INK, linewidth=1.4, zorder=1)
        axes.fill_between([-half, half], sign * rho, sign * 1.2 * rho, color=SHADE, linewidth=0, zorder=0.7)
    axes.plot([-half, half], [0, 0], color=MUTED, linewidth=0.8, linestyle=(0, (8, 2, 1.5, 2)), zorder=0.8)
    ends = seats.offsets[:, 1] * factor
    known = np.asarray(np.isfinite(ends).all(axis=0))
    for order, index in enumerate(_marked(hue.over, known)):
        colour = hue.of(hue.over.values[index])
        axes.plot([-half, half], ends[:, index], color=colour, linewidth=2.2, zorder=3, marker="o", markersize=4)
        for end, side in enumerate((-1, 1)):
            force = float(seats.forces[end, 1, index])
            if abs(force) > 0.02 * cell.peak:
                x, tip = side * half, float(ends[end, index]) + force / cell.peak * 0.8 * rho
                arrow = {"arrowstyle": "-|>", "color": colour, "linewidth": 1.5, "shrinkA": 0, "shrinkB": 0}
                axes.annotate("", xy=(x, tip), xytext=(x, float(ends[end, index])), arrowprops=arrow, zorder=6)
        along = ALONG[order] * half
        middle = float(np.interp(along, [-half, half], ends[:, index]))
        look: dict[str, Any] = {
            "textcoords": "offset points",
            "fontsize": 7.5,
            "color": INK,
            "ha": "center",
            "zorder": 7,
            "bbox": {"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.6},
        }
        axes.annotate(hue.over.say(index), (along, middle), xytext=(0, 5), **look)
    axes.set_xlim(-1.2 * half, 1.2 * half)
    axes.set_yticks([-rho, 0, rho], [_tick(tick) for tick in (-rho, 0.0, rho)])


# ---- magnification --------------------------------------------------------------------------------------------


def _magnify(figure: Figure, drawn: list[tuple[Axes, Cell]]) -> None:
    """Give every diagram the largest round magnification that it has room for, and say it."""
    if not drawn:
        return
    for axes, cell in drawn:
        _name(axes, cell)
        axes.set_title("× 1000", fontsize=8.5, loc="right")  # as high as what will stand there
        _limit(axes, cell, ROOM * cell.seats.clearance)
    for _ in range(2):  # only then is it known how wide they are on paper
        figure.draw_without_rendering()
    figure.set_layout_engine("none")  # and so they stay
    for axes, cell in drawn:
        size = axes.get_window_extent().height / figure.dpi * INCH
        guide = cell.seats.planar_guide
        most = size / (2 * DEEP) if guide else (size / 2 - BESIDE * INCH) / ROOM
        factor = _round_below(most / cell.seats.clearance)
        _limit(axes, cell, 0.5 * size / factor)
        axes.set_title(f"{'across ' if guide else ''}× {number(factor, 2)}", fontsize=8.5, color=MUTED, loc="right")


def _round_below(value: float) -> float:
    base = 10.0 ** np.floor(np.log10(value))
    return float(max(one * base for one in FACTORS if one * base <= value * (1 + 1e-9)))


def _limit(axes: Axes, cell: Cell, half: float) -> None:
    factor, _ = prefixed(cell.seats.clearance, "m")
    axes.set_ylim(-half * factor, half * factor)
    if not cell.seats.planar_guide:
        axes.set_xlim(-half * factor, half * factor)


def _name(axes: Axes, cell: Cell) -> None:
    """Joint and end above; below what lies in what, and the load that the longest arrow stands for."""
    axes.set_title(plain(cell.title), fontsize=9.5, fontweight="bold", color=INK, loc="left")
    first, second = (_short(link) for link in cell.seats.links)
    lines = [axes.get_xlabel().split("\n")[0], plain(f"{cell.seats.kind} of {first} in {second}"),
             f"longest load {quantity(cell.peak, 'N')}"]  # fmt: skip
    axes.set_xlabel("\n".join(lines), fontsize=8, color=INK, linespacing=1.35)


def _short(name: str) -> str:
    return name if len(name) <= LONGEST else f"{name[: LONGEST - 1]}…"
