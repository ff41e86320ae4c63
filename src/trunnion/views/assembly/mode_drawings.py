"""The ways in which the groups of a mechanism can be assembled, each as a small drawing of the whole mechanism."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from trunnion.algebra.dual import primal
from trunnion.cycle.analyse import analyse
from trunnion.errors import Finding, MechanismError
from trunnion.model.mechanism import Mechanism
from trunnion.solve.assembly_modes import AssemblyMode, GroupModes, choices, put_together
from trunnion.solve.forward import forward
from trunnion.solve.run import Run, prepare
from trunnion.views.assembly.modes import some
from trunnion.views.common.cycle import Array, layout
from trunnion.views.common.drawing import Picture, framed, name_points
from trunnion.views.common.drawing import sketch as sketch_plane
from trunnion.views.common.figures import INK, MUTED, RULE, Labels, new, plain
from trunnion.views.space.bodies import space
from trunnion.views.space.figure import name_joints
from trunnion.views.space.figure import sketch as sketch_space
from trunnion.views.space.solids import Scenery, best, looking, scenery

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

__all__ = ["ways"]

MOST_DRAWN = 24  # ways of one group
SYMBOLS = 1.25  # size of joints and bearings, as if the mechanism were so much larger
STEPS, STEPS_SPACE = 90, 48  # positions of a turn, of the paths
MOST_STEPS = 1440


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
    if mechanism.space == "spatial":
        result = analyse(mechanism.with_friction("off"), 1)
        return _sheet(result, groups, _in_space(mechanism, groups), columns=3, width=2.9)
    result = analyse(mechanism, 1)
    drawn = [
        [_drawn(mechanism, layout(result), choice, assembly_mode) for assembly_mode in some(choice, MOST_DRAWN)]
        for choice in groups
    ]
    cells = [[Cell(mode.way, mode.shown.box, mode.draw) for mode in row] for row in drawn]
    return _sheet(result, groups, cells, columns=4, width=2.4)


def _sheet(
    result: xr.Dataset, groups: Sequence[GroupModes], rows: list[list[Cell]], columns: int, width: float
) -> Figure:
    """The drawings in rows of at most so many columns, each so wide, inches, all in one scale."""
    boxes = np.array([cell.box for row in rows for cell in row if cell.box] or [(0.0, 0.0, 1.0, 1.0)])
    low, high = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
    size = float(np.hypot(*(high - low))) or 1.0
    (left, below), (right, above) = (low - 0.08 * size).tolist(), (high + 0.08 * size).tolist()
    box = (left, below - 0.03 * size, right, above)  # a bearing reaches below its joint
    columns = min(columns, max(map(len, rows)))
    tall = width * min(max((box[3] - box[1]) / (box[2] - box[0]), 0.45), 1.6) + 0.28
    heights = [0.3 + math.ceil(len(row) / columns) * tall for row in rows]
    figure = new("Assembly modes", result, 0.6 + sum(heights), max(columns, 2) * width + 0.2)
    parts = figure.subfigures(len(groups), 1, squeeze=False, height_ratios=heights)[:, 0]
    labels, extent = Labels(figure), float(np.hypot(box[2] - box[0], box[3] - box[1]))
    for part, choice, row in zip(parts, groups, rows, strict=True):
        for axes, cell in zip(_panels(part, choice, [cell.way for cell in row], columns, box), row, strict=True):
            cell.draw(axes, extent, labels)
    labels.place()
    return figure


def _panels(
    part: SubFigure, choice: GroupModes, modes: Sequence[AssemblyMode], columns: int, box: Sequence[float]
) -> list[Axes]:
    """Axes for each of the modes that are drawn, under their names; the frame of the one that is used is bold.

    box: left, below, right, above of all of them, m.
    """
    where = f", at {choice.where}" if choice.where else ""
    more = f", {len(modes)} of {len(choice.ways)} assembly modes" if len(modes) < len(choice.ways) else ""
    head = f"{choice.label}    {', '.join(choice.links)}{where}{more}"
    part.suptitle(plain(head), x=0.012, ha="left", fontsize=9, color=INK)
    grid = part.subplots(math.ceil(len(modes) / columns), columns, squeeze=False).ravel().tolist()
    for axes in grid[len(modes) :]:
        axes.set_visible(False)
    for axes, mode in zip(grid, modes, strict=False):
        axes.set_aspect("equal")
        axes.set(xlim=(box[0], box[2]), ylim=(box[1], box[3]), xticks=[], yticks=[])
        for spine in axes.spines.values():
            spine.set(color=INK if mode.taken else RULE, linewidth=1.8 if mode.taken else 1.0)
        title = f"{choice.link}: {mode.name}" + "  used" * mode.taken
        weight = "bold" if mode.taken else "normal"
        axes.set_title(plain(title), fontsize=8.5, fontweight=weight, color=INK, loc="left", pad=4)
    return list(grid[: len(modes)])


# ---- in the plane -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class ModeDrawing:
    """One way: its picture, the position at which the mechanism is drawn, and links that have no place there."""

    way: AssemblyMode
    shown: Picture
    index: int
    missing: tuple[str, ...]

    def draw(self, axes: Axes, size: float, labels: Labels) -> None:
        """The mechanism with the names of the joints of the group; size: of the box around all drawings, m."""
        symbols = replace(self.shown, size=SYMBOLS * size)
        sketch_plane(axes, symbols, self.index)
        name_points(axes, symbols, self.index, labels, list(self.way.joints))
        if self.missing:
            _remark(axes, f"not assembled here: {', '.join(self.missing)}")


def _remark(axes: Axes, text: str) -> None:
    axes.text(0.03, 0.03, plain(text), transform=axes.transAxes, fontsize=7, color=MUTED, zorder=8)


def _drawn(mechanism: Mechanism, layout_of: dict[str, Any], choice: GroupModes, mode: AssemblyMode) -> ModeDrawing:
    """The whole mechanism with one group put together in one way, as far as it can be assembled."""
    run = _run(mechanism, choice, mode)
    turns = max(1, math.ceil(run.cycle.turns)) if run.cycle.duration > 0 else 1
    times = np.union1d(run.cycle.times(min(STEPS * turns, MOST_STEPS)), choice.time)
    walk = forward(run.system, run.values, run.chosen.assembly, times)
    tracks: dict[str, Array] = {}
    for link, name in run.system.points:
        place = walk.point(link, name).place
        tracks[f"{link}.{name}"] = np.array([np.broadcast_to(primal(n), times.shape) for n in place])
    angles = {
        link: np.broadcast_to(np.arctan2(primal(motion.frame.s), primal(motion.frame.c)), times.shape)
        for link, motion in walk.motions.items()
        if link != mechanism.fixed_link
    }
    index = int(np.searchsorted(times, choice.time))
    missing = tuple(link for link, angle in angles.items() if not np.isfinite(angle[index]))
    picture = framed(layout_of, tracks, angles)
    return ModeDrawing(mode, replace(picture, weight=0.5, only=choice.links), index, missing)


def _run(mechanism: Mechanism, choice: GroupModes, mode: AssemblyMode) -> Run:
    """The mechanism put together in a way; without the names of other groups' ways if those then do not exist."""
    changed = put_together(mechanism, choice, mode)
    try:
        return prepare(changed)
    except MechanismError:
        data = changed.data()
        hints = {key: hint for key, hint in changed.assembly.items() if key == choice.link or not isinstance(hint, str)}
        hints_kept = {key: data["assembly"][key] for key in hints}
        return prepare(Mechanism(**{**data, "assembly": hints_kept}))


# ---- in space -----------------------------------------------------------------------------------------------------


def _in_space(mechanism: Mechanism, groups: Sequence[GroupModes]) -> list[list[Cell]]:
    """The drawings of all ways from one side; of those that cannot be assembled a remark."""
    rows = []
    camera = None
    for choice in groups:
        rows.append(list[Cell]())
        for mode in some(choice, MOST_DRAWN // 2):
            try:
                result = analyse(put_together(mechanism, choice, mode).with_friction("off"), STEPS_SPACE)
                bodies = space(result)
            except MechanismError:
                rows[-1].append(Cell(mode, None, lambda axes, *_: _remark(axes, "cannot be assembled in this mode")))
                continue
            camera = camera or looking(*best(bodies))
            look = scenery(bodies, camera)
            drawable = np.flatnonzero(bodies.drawable)
            times = np.asarray(result["time"].values, dtype=float)
            index = int(drawable[np.argmin(np.abs(times[drawable] - choice.time))])
            rows[-1].append(Cell(mode, look.box, _drawing(choice, mode, look, index)))
    return rows


def _drawing(
    choice: GroupModes, mode: AssemblyMode, look: Scenery, index: int
) -> Callable[[Axes, float, Labels], None]:
    def draw(axes: Axes, size: float, labels: Labels) -> None:
        sketch_space(axes, look, index, choice.links)
        name_joints(axes, look, index, labels, tuple(mode.joints), 7.5)

    return draw
