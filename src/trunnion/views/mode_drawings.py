"""The ways in which the groups of a mechanism can be assembled, each as a small drawing of the whole mechanism."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from trunnion.cycle.analyse import analyse
from trunnion.errors import Finding, MechanismError
from trunnion.model.mechanism import Mechanism
from trunnion.solve.assembly_modes import AssemblyMode, GroupModes, choices, put_together
from trunnion.solve.run import prepare
from trunnion.views import sketch
from trunnion.views.assembly import some
from trunnion.views.axis import Array
from trunnion.views.bodies import Scenery, scenery, space
from trunnion.views.draw import INK, MUTED, RULE, new, plain

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_DRAWN = 24  # ways of one group in the plane, half of them in space
SYMBOLS = 1.25  # size of joints and bearings, as if the mechanism were so much larger
STEPS = 90  # positions of the paths
Cell = tuple[AssemblyMode, sketch.Picture | Scenery | None, int]  # a way, its drawing if it has one, and the position


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
    spatial, camera, rows = mechanism.space == "spatial", None, list[list[Cell]]()
    for choice in groups:
        rows.append([])
        for mode in some(choice, MOST_DRAWN // 2 if spatial else MOST_DRAWN):
            try:
                drawing, index = _drawing(_run(mechanism, choice, mode), choice, camera)
            except MechanismError:
                rows[-1].append((mode, None, 0))
                continue
            camera = drawing.camera if isinstance(drawing, Scenery) else None  # of the first, from which all are seen
            rows[-1].append((mode, drawing, index))
    columns, width = (3, 2.9) if spatial else (4, 2.4)
    columns = min(columns, max(map(len, rows)))
    boxes = np.array([cell[1].box for row in rows for cell in row if cell[1]] or [(0.0, 0.0, 1.0, 1.0)])
    low, high = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
    size = float(np.hypot(*(high - low))) or 1.0
    low, high = low - np.array([0.08, 0.11]) * size, high + 0.08 * size  # a bearing reaches below its joint
    across, up = high - low
    heights = [0.3 + math.ceil(len(row) / columns) * (width * min(max(up / across, 0.45), 1.6) + 0.28) for row in rows]
    result = analyse(mechanism.with_friction("off"), 1)
    figure = new("Assembly modes", result, 0.6 + sum(heights), max(columns, 2) * width + 0.2)
    strips = figure.subfigures(len(groups), 1, squeeze=False, height_ratios=heights)[:, 0]
    for strip, choice, row in zip(strips, groups, rows, strict=True):
        where = f", at {choice.where}" if choice.where else ""
        more = f", {len(row)} of {len(choice.ways)} assembly modes" if len(row) < len(choice.ways) else ""
        head = f"{choice.label}    {', '.join(choice.links)}{where}{more}"
        strip.suptitle(plain(head), x=0.012, ha="left", fontsize=9, color=INK)
        grid = strip.subplots(math.ceil(len(row) / columns), columns, squeeze=False).ravel().tolist()
        for axes in grid[len(row) :]:
            axes.set_visible(False)
        for axes, cell in zip(grid, row, strict=False):
            axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xticks=[], yticks=[], aspect="equal")
            _draw(axes, choice, cell, SYMBOLS * float(np.hypot(across, up)))
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


def _drawing(result: xr.Dataset, choice: GroupModes, camera: Array | None) -> tuple[sketch.Picture | Scenery, int]:
    """What draws a result, in space from a camera or the best side, and the position at which its group is chosen."""
    usable = np.arange(result.sizes["position"])
    if "link_rotation" in result:
        bodies = space(result)
        drawing: sketch.Picture | Scenery = scenery(bodies, camera)
        usable = np.flatnonzero(bodies.drawable)
    else:
        drawing = replace(sketch.picture(result), weight=0.5, only=choice.links)
    return drawing, int(usable[np.argmin(np.abs(result["time"].values[usable] - choice.time))])


def _draw(axes: Axes, choice: GroupModes, cell: Cell, size: float) -> None:
    """The whole mechanism, as far as it is assembled, with the names of the joints of the group; size: of symbols."""
    mode, drawing, index = cell
    used, remark = mode.taken, ""  # the frame of the one that is taken is bold
    axes.spines[:].set(color=INK if used else RULE, linewidth=1.8 if used else 1.0)
    title = plain(f"{choice.link}: {mode.name}" + "  used" * used)
    axes.set_title(title, fontsize=8.5, fontweight="bold" if used else "normal", color=INK, loc="left", pad=4)
    if drawing is None:
        remark = "cannot be assembled in this mode"
    elif isinstance(drawing, Scenery):
        sketch.paint(axes, drawing, index, choice.links)
        sketch.name_joints(axes, drawing, index, tuple(mode.joints), 7.5)
    else:
        symbols, none = replace(drawing, size=size), np.zeros(index + 1)
        sketch.sketch(axes, symbols, index)
        sketch.name_points(axes, symbols, index, list(mode.joints))
        missing = [link for link in drawing.moving if not np.isfinite(drawing.angles.get(link, none)[index])]
        remark = f"not assembled here: {', '.join(missing)}" if missing else ""
    axes.text(0.03, 0.03, plain(remark), transform=axes.transAxes, fontsize=7, color=MUTED, zorder=8)
