"""The ways in which the groups of a spatial mechanism can be assembled, each as a small drawing from one side."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from trunnion.cycle.analyse import analyse
from trunnion.errors import MechanismError
from trunnion.model.mechanism import Mechanism
from trunnion.solve.assembly_modes import AssemblyMode, GroupModes, put_together
from trunnion.views.assembly.mode_panels import panels
from trunnion.views.assembly.modes import some
from trunnion.views.common.figures import MUTED, new
from trunnion.views.common.labels import Labels
from trunnion.views.space.bodies import Space, space
from trunnion.views.space.camera import best, looking
from trunnion.views.space.figure import name_joints, sketch
from trunnion.views.space.scenery import Scenery, scenery

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["space_ways"]

COLUMNS = 3  # of drawings
WIDTH = 2.9  # of a drawing, in
MOST_DRAWN = 12  # ways of one group
STEPS = 48  # positions, of the paths

Drawn = tuple[AssemblyMode, Space | None, int]  # a way, the mechanism in it if it can be put together, the position


def space_ways(mechanism: Mechanism, found: Sequence[GroupModes]) -> Figure:
    """A drawing for every way of every group that has several, all from one side; the one that is taken is marked."""
    result = analyse(mechanism.with_friction("off"), 1)
    rows = [[_drawn(mechanism, choice, way) for way in some(choice, MOST_DRAWN)] for choice in found]
    known = [shown for row in rows for _, shown, _ in row if shown is not None]
    camera = looking(*best(known[0])) if known else looking(-1.0, 0.5)
    looks = [scenery(shown, camera) for shown in known]
    box = np.array([look.box for look in looks] or [(0.0, 0.0, 1.0, 1.0)])
    low, high = box[:, :2].min(axis=0), box[:, 2:].max(axis=0)
    margin = 0.08 * float(np.hypot(*(high - low)))
    frame = (*(low - margin), *(high + margin))
    columns = min(COLUMNS, max(map(len, rows)))
    lines = [math.ceil(len(row) / columns) for row in rows]
    tall = WIDTH * min(max((frame[3] - frame[1]) / (frame[2] - frame[0]), 0.45), 1.4) + 0.28
    figure = new(
        "Assembly modes", result, 0.6 + sum(0.3 + line * tall for line in lines), max(columns, 2) * WIDTH + 0.2
    )
    parts = figure.subfigures(len(found), 1, squeeze=False, height_ratios=[0.3 + line * tall for line in lines])[:, 0]
    labels = Labels(figure)
    for part, choice, row in zip(parts, found, rows, strict=True):
        for axes, (way, shown, index) in zip(
            panels(part, choice, [way for way, _, _ in row], columns, frame), row, strict=True
        ):
            _one(axes, choice, way, next((look for look in looks if look.shown is shown), None), index, labels)
    labels.place()
    return figure


def _drawn(mechanism: Mechanism, choice: GroupModes, way: AssemblyMode) -> Drawn:
    """The whole mechanism with one group put together in one way."""
    try:
        result = analyse(put_together(mechanism, choice, way).with_friction("off"), STEPS)
        shown = space(result)
    except MechanismError:
        return way, None, 0
    known = np.flatnonzero(shown.drawable)
    times = np.asarray(result["time"].values, dtype=float)
    return way, shown, int(known[np.argmin(np.abs(times[known] - choice.time))])


def _one(axes: Axes, choice: GroupModes, way: AssemblyMode, look: Scenery | None, index: int, labels: Labels) -> None:
    """One drawing."""
    if look is None:
        axes.text(
            0.03, 0.03, "cannot be assembled in this mode", transform=axes.transAxes, fontsize=7, color=MUTED, zorder=8
        )
        return
    sketch(axes, look, index, choice.links)
    name_joints(axes, look, index, labels, tuple(way.joints), 7.5)
