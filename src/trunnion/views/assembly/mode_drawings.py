"""The ways in which the groups of a mechanism can be assembled, each as a small drawing of the whole mechanism."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.algebra.dual import primal
from trunnion.cycle.analyse import analyse
from trunnion.errors import Finding, MechanismError
from trunnion.model.mechanism import Mechanism
from trunnion.solve.assembly_modes import AssemblyMode, GroupModes, choices, put_together
from trunnion.solve.forward import forward
from trunnion.solve.run import Run, prepare
from trunnion.views.assembly.mode_drawings_space import space_ways
from trunnion.views.assembly.mode_panels import panels
from trunnion.views.assembly.modes import some
from trunnion.views.common.cycle import Array, layout
from trunnion.views.common.drawing import Picture, framed, name_points, sketch
from trunnion.views.common.figures import MUTED, new
from trunnion.views.common.labels import Labels
from trunnion.views.common.lettering import plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["ways"]

COLUMNS = 4  # at most, of drawings
WIDTH = 2.4  # of a drawing, in
MOST_DRAWN = 24  # ways of one group
SYMBOLS = 1.25  # size of joints and bearings, as if the mechanism were so much larger
STEPS = 90  # positions of a turn, of the paths
MOST_STEPS = 1440


@dataclass(frozen=True)
class ModeDrawing:
    """One way: its picture, the position at which the mechanism is drawn, and links that have no place there."""

    way: AssemblyMode
    shown: Picture
    index: int
    missing: tuple[str, ...]


def ways(mechanism: Mechanism, found: Sequence[GroupModes] | None = None) -> Figure:
    """A drawing for every way of every group that has several, with the paths of the points; the taken one is marked.

    Each is what the mechanism becomes if that way is named in the file and all else is left, so later groups follow
    their own hints. A row is a group, or more rows if it has more than four ways. found: the choices, if known.
    Raises MechanismError if there is nothing to choose or to draw.
    """
    found = choices(prepare(mechanism)) if found is None else found
    if not found:
        what = "no group has more than one assembly mode: there is nothing to draw"
        raise MechanismError(Finding(what, remedy="draw the mechanism with `trunnion plot --kind mechanism`"))
    if mechanism.space == "spatial":
        return space_ways(mechanism, found)
    result = analyse(mechanism, 1)
    rows = [[_drawn(mechanism, layout(result), choice, way) for way in some(choice, MOST_DRAWN)] for choice in found]
    box = _box([one.shown for row in rows for one in row])
    columns = min(COLUMNS, max(map(len, rows)))
    lines = [math.ceil(len(row) / columns) for row in rows]
    high = WIDTH * min(max((box[3] - box[1]) / (box[2] - box[0]), 0.45), 1.6) + 0.28
    width = max(columns * WIDTH, 2 * WIDTH) + 0.2
    figure = new("Assembly modes", result, 0.6 + sum(0.3 + line * high for line in lines), width)
    parts = figure.subfigures(len(found), 1, squeeze=False, height_ratios=[0.3 + line * high for line in lines])[:, 0]
    labels = Labels(figure)
    size = float(np.hypot(box[2] - box[0], box[3] - box[1]))
    for part, choice, row in zip(parts, found, rows, strict=True):
        for axes, one in zip(panels(part, choice, [one.way for one in row], columns, box), row, strict=True):
            _one(axes, one, size, labels)
    labels.place()
    return figure


def _drawn(mechanism: Mechanism, stated: dict[str, Any], choice: GroupModes, way: AssemblyMode) -> ModeDrawing:
    """The whole mechanism with one group put together in one way, as far as it can be assembled."""
    run = _run(mechanism, choice, way)
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
    picture = framed(stated, tracks, angles)
    return ModeDrawing(way, replace(picture, weight=0.5, only=choice.links), index, missing)


def _run(mechanism: Mechanism, choice: GroupModes, way: AssemblyMode) -> Run:
    """The mechanism put together in a way; without the names of other groups' ways if those then do not exist."""
    changed = put_together(mechanism, choice, way)
    try:
        return prepare(changed)
    except MechanismError:
        stated = changed.data()
        hints = {key: hint for key, hint in changed.assembly.items() if key == choice.link or not isinstance(hint, str)}
        kept = {key: stated["assembly"][key] for key in hints}
        return prepare(Mechanism(**{**stated, "assembly": kept}))


def _box(pictures: Sequence[Picture]) -> tuple[float, float, float, float]:
    """Around all that the pictures show, so that they have one scale, with a margin."""
    boxes = np.array([picture.box for picture in pictures])
    low, high = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
    size = float(np.hypot(*(high - low))) or 1.0
    (left, below), (right, above) = (low - 0.08 * size).tolist(), (high + 0.08 * size).tolist()
    return left, below - 0.03 * size, right, above  # a bearing reaches below its joint


def _one(axes: Axes, one: ModeDrawing, size: float, labels: Labels) -> None:
    """One drawing."""
    shown = replace(one.shown, size=SYMBOLS * size)
    sketch(axes, shown, one.index)
    name_points(axes, shown, one.index, labels, list(one.way.joints))
    if one.missing:
        text = f"not assembled here: {', '.join(one.missing)}"
        axes.text(0.03, 0.03, plain(text), transform=axes.transAxes, fontsize=7, color=MUTED, zorder=8)
