"""The ways in which the groups of a mechanism can be assembled, each as a small drawing of the whole mechanism."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from trunnion.cycle.analyse import analyse
from trunnion.errors import Finding, MechanismError
from trunnion.model.mechanism import Mechanism
from trunnion.solve.assembly_modes import AssemblyMode, GroupModes, choices, put_together
from trunnion.solve.run import prepare
from trunnion.views import picture, sketch
from trunnion.views.assembly import some
from trunnion.views.bodies import Camera, best, looking, scenery, space
from trunnion.views.draw import INK, MUTED, RULE, Labels, new, plain

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_DRAWN = 24  # ways of one group
SYMBOLS = 1.25  # size of joints and bearings, as if the mechanism were so much larger
STEPS = 90  # positions of the paths


class Cell(NamedTuple):
    """One drawing: the way that it is of, the box around what it shows, m, and what draws it into axes."""

    way: AssemblyMode
    box: tuple[float, float, float, float] | None
    draw: Callable[[Axes, float, Labels], None]


def ways(mechanism: Mechanism, groups: Sequence[GroupModes] | None = None) -> Figure:
    """A drawing for every way of every group that has several, with the paths of the points; the taken one is marked.

    Each is what the mechanism becomes if that way is named in the file and all else is left, so later groups follow
    their own hints. A row is a group, or more rows if it has many ways. groups: the choices, if known.
    Raises MechanismError if there is nothing to choose or to draw.
    """
    groups = choices(prepare(mechanism)) if groups is None else groups
    if not groups:
        what = "no group has more than one assembly mode: there is nothing to draw"
        raise MechanismError(Finding(what, remedy="draw the mechanism with `trunnion plot --kind mechanism`"))
    spatial, cameras, rows = mechanism.space == "spatial", list[Camera](), []
    result = analyse(mechanism.with_friction("off"), 1)
    for choice in groups:
        rows.append(list[Cell]())
        for mode in some(choice, MOST_DRAWN // 2 if spatial else MOST_DRAWN):
            try:
                found = _run(mechanism, choice, mode)
                rows[-1].append(_in_space(found, choice, mode, cameras) if spatial else _in_plane(found, choice, mode))
            except MechanismError:
                rows[-1].append(Cell(mode, None, lambda axes, *_: _remark(axes, "cannot be assembled in this mode")))
    columns, width = (3, 2.9) if spatial else (4, 2.4)
    return _sheet(result, groups, rows, min(columns, max(map(len, rows))), width)


def _sheet(
    result: xr.Dataset, groups: Sequence[GroupModes], rows: list[list[Cell]], columns: int, width: float
) -> Figure:
    """The drawings in rows of at most so many columns, each so wide, inches, all in one scale."""
    boxes = np.array([cell.box for row in rows for cell in row if cell.box] or [(0.0, 0.0, 1.0, 1.0)])
    low, high = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
    size = float(np.hypot(*(high - low))) or 1.0
    low, high = low - np.array([0.08, 0.11]) * size, high + 0.08 * size  # a bearing reaches below its joint
    across, up = high - low
    heights = [0.3 + math.ceil(len(row) / columns) * (width * min(max(up / across, 0.45), 1.6) + 0.28) for row in rows]
    figure = new("Assembly modes", result, 0.6 + sum(heights), max(columns, 2) * width + 0.2)
    strips = figure.subfigures(len(groups), 1, squeeze=False, height_ratios=heights)[:, 0]
    labels = Labels(figure)
    for strip, choice, row in zip(strips, groups, rows, strict=True):
        where = f", at {choice.where}" if choice.where else ""
        more = f", {len(row)} of {len(choice.ways)} assembly modes" if len(row) < len(choice.ways) else ""
        head = f"{choice.label}    {', '.join(choice.links)}{where}{more}"
        strip.suptitle(plain(head), x=0.012, ha="left", fontsize=9, color=INK)
        grid = strip.subplots(math.ceil(len(row) / columns), columns, squeeze=False).ravel().tolist()
        for axes in grid[len(row) :]:
            axes.set_visible(False)
        for axes, cell in zip(grid, row, strict=False):
            axes.set_aspect("equal")
            axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xticks=[], yticks=[])
            used = cell.way.taken  # its frame is bold
            axes.spines[:].set(color=INK if used else RULE, linewidth=1.8 if used else 1.0)
            title = plain(f"{choice.link}: {cell.way.name}" + "  used" * used)
            axes.set_title(title, fontsize=8.5, fontweight="bold" if used else "normal", color=INK, loc="left", pad=4)
            cell.draw(axes, float(np.hypot(across, up)), labels)
    labels.place()
    return figure


def _run(mechanism: Mechanism, choice: GroupModes, mode: AssemblyMode) -> xr.Dataset:
    """The mechanism put together in a way; without the names of other groups' ways if those then do not exist."""
    changed = put_together(mechanism, choice, mode).with_friction("off")
    try:
        return analyse(changed, STEPS)
    except MechanismError:
        data = changed.data()
        hints = {key for key, hint in changed.assembly.items() if key == choice.link or not isinstance(hint, str)}
        return analyse(Mechanism(**{**data, "assembly": {key: data["assembly"][key] for key in hints}}), STEPS)


def _remark(axes: Axes, text: str) -> None:
    axes.text(0.03, 0.03, plain(text), transform=axes.transAxes, fontsize=7, color=MUTED, zorder=8)


def _in_plane(result: xr.Dataset, choice: GroupModes, mode: AssemblyMode) -> Cell:
    """The whole mechanism, as far as it is assembled, with the names of the joints of the group."""
    drawing = replace(sketch.picture(result), weight=0.5, only=choice.links)
    index = int(np.argmin(np.abs(result["time"].values - choice.time)))
    missing = [link for link in drawing.moving if not np.isfinite(drawing.angles.get(link, np.zeros(index + 1))[index])]

    def draw(axes: Axes, size: float, labels: Labels) -> None:
        symbols = replace(drawing, size=SYMBOLS * size)
        sketch.sketch(axes, symbols, index)
        sketch.name_points(axes, symbols, index, labels, list(mode.joints))
        if missing:
            _remark(axes, f"not assembled here: {', '.join(missing)}")

    return Cell(mode, drawing.box, draw)


def _in_space(result: xr.Dataset, choice: GroupModes, mode: AssemblyMode, cameras: list[Camera]) -> Cell:
    """The same in space; cameras: that of the first drawing, from which all are seen."""
    bodies = space(result)
    cameras[:] = cameras or [looking(*best(bodies))]
    look, places = scenery(bodies, cameras[0]), np.flatnonzero(bodies.drawable)
    index = int(places[np.argmin(np.abs(result["time"].values[places] - choice.time))])

    def draw(axes: Axes, size: float, labels: Labels) -> None:
        picture.sketch(axes, look, index, choice.links)
        picture.name_joints(axes, look, index, labels, tuple(mode.joints), 7.5)

    return Cell(mode, look.box, draw)
