"""The panels of the drawings of assembly modes: a row for each group under its label, a frame for each mode."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from trunnion.solve.assembly_modes import AssemblyMode, GroupModes
from trunnion.views.common.figures import INK, RULE
from trunnion.views.common.lettering import plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import SubFigure

__all__ = ["panels"]


def panels(
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
