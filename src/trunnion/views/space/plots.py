"""Curves of spatial results: reactions with their moments, polar diagrams in three planes, motion of joints and links.

The figures of `plots.py` hold for a spatial result too; these are the three whose vectors have three components.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.joints.pairs import PAIRS
from trunnion.results.quantities import prefixed
from trunnion.views.common.cycle import Abscissa, Array, abscissa, column, layout, names
from trunnion.views.common.figures import along, curve, frame_peak, legend, new, shade, style_of
from trunnion.views.common.joined import joined
from trunnion.views.common.lettering import plain
from trunnion.views.common.peaks import ease, usual_peak

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["PLANES", "motion", "reactions", "turned_from_start"]

PLANES = (("x", "y"), ("x", "z"), ("y", "z"))
ROOM = 44  # characters in a row of the legend of a panel that is one of several


def _sizes(result: xr.Dataset, variable: str, dim: str, name: str) -> Array | None:
    """Length of a vector, (position,)."""
    values = column(result, variable, **{dim: name})
    return None if values is None else np.linalg.norm(values, axis=0)


def reactions(result: xr.Dataset, ideal: xr.Dataset | None, free: dict[str, Any]) -> Figure:
    """Magnitudes of the reaction and of its moment about the middle of the bearing, one panel each.

    Joints with the same force and moment are one curve in either panel, for the legend is that of both.
    free: the look of curves without friction.
    """
    over, joints = abscissa(result), names(result, "joint")
    figure = new("Joint reactions", result, 6.6)
    panels = figure.subplots(2, 1, sharex=True)
    shared = _shared(result, joints)
    for axes, variable, unit, what in zip(
        panels, ("reaction_force", "reaction_moment"), ("N", "N m"), ("force", "moment"), strict=True
    ):
        columns = {joint: _sizes(result, variable, "joint", joint) for joint in joints}
        others = {} if ideal is None else {joint: _sizes(ideal, variable, "joint", joint) for joint in joints}
        scope = usual_peak(ease(result), *columns.values(), *others.values())
        factor, shown = prefixed(scope, unit)
        along(axes, over, f"{what} of the reaction [{shown}]")
        shade(axes, result, over)
        for label, first in shared:
            values = columns[joints[first]]
            if values is not None:
                curve(axes, over, values * factor, label, **style_of(first))
        for index, values in enumerate(others.values()):
            if values is not None:
                curve(axes, over, values * factor, "without friction" if index == 0 else None, **free)
        frame_peak(axes, max(_peak(columns), _peak(others)), scope, factor, unit)
    panels[0].set_xlabel("")
    legend(panels[0])
    return figure


def _shared(result: xr.Dataset, joints: list[str]) -> list[tuple[str, int]]:
    """Joints with the same force and moment: their names, and the number of the first."""
    both: dict[str, list[Array]] = {joint: [] for joint in joints}
    for variable in ("reaction_force", "reaction_moment"):
        sizes = {joint: _sizes(result, variable, "joint", joint) for joint in joints}
        largest = max(_peak(sizes), 1e-300)
        for joint, values in sizes.items():
            both[joint].append(np.zeros(0) if values is None else values / largest)
    known = {joint: np.concatenate(parts) for joint, parts in both.items()}
    return [(label, first) for label, first, _ in joined(known)]


def _peak(columns: dict[str, Array | None]) -> float:
    return max((float(np.abs(_known(values)).max(initial=0.0)) for values in columns.values()), default=0.0)


def motion(result: xr.Dataset) -> Figure:
    """Rotations and slides of the joints and how the links turn, with rates; a column for each that there is."""
    over, stated = abscissa(result), layout(result)
    kinds = {name: one["type"] for name, one in stated["joints"].items() if name in names(result, "joint")}
    turning = [name for name, kind in kinds.items() if PAIRS[kind].turns and _moves(result, "joint_rotation", name)]
    sliding = [name for name, kind in kinds.items() if PAIRS[kind].slides and _moves(result, "joint_slide", name)]
    links = [link for link in names(result, "link") if link != stated["ground"]]
    columns = [("joint rotation", "rad", _of_joints(result, "joint_rotation", turning))] if turning else []
    columns += [("joint slide", "m", _of_joints(result, "joint_slide", sliding))] if sliding else []
    columns.append(("turn of the link", "rad", _of_links(result, links)))
    rows = max(-(-len(members) // _abreast(members)) for _, _, members in columns)
    figure = new(
        "Motion", result, 6.2 + 0.2 * rows, 4.0 + 3.6 * (len(columns) - 1) + (2.4 if len(columns) == 1 else 0.0)
    )
    grid = figure.subplots(3, len(columns), sharex=True, squeeze=False)
    for panels, (noun, unit, members) in zip(grid.T, columns, strict=True):
        _rates(list(panels), result, over, noun, unit, members)
    return figure


def _abreast(members: Members) -> int:
    """Entries in a row of the legend."""
    return max(1, ROOM // (max(map(len, members), default=0) + 7))


Members = dict[str, list[Array | None]]


def _moves(result: xr.Dataset, variable: str, name: str) -> bool:
    values = column(result, variable, joint=name)
    known = _known(values)
    return known.size == 1 or (known.size > 1 and bool(np.ptp(known) > 1e-9 * max(1.0, np.abs(known).max())))


def _of_joints(result: xr.Dataset, variable: str, joints: list[str]) -> Members:
    """A quantity of each joint with its first and second rate."""
    return {joint: [column(result, variable + rate, joint=joint) for rate in ("", "_velocity", "_acceleration")]
            for joint in joints}  # fmt: skip


def _of_links(result: xr.Dataset, links: list[str]) -> Members:
    """By how much each link is turned from where it starts, how fast it turns, and the size of its acceleration."""
    return {
        link: [
            turned_from_start(column(result, "link_rotation", link=link)),
            _sizes(result, "link_angular_velocity", "link", link),
            _sizes(result, "link_angular_acceleration", "link", link),
        ]
        for link in links
    }


def turned_from_start(rotation: Array | None) -> Array | None:
    """Angle (rad, 0 to π) between the orientation (w, x, y, z; position) and the first that is known."""
    if rotation is None:
        return None
    known = np.flatnonzero(np.isfinite(rotation).all(axis=0))
    if not known.size:
        return np.full(rotation.shape[1], np.nan)
    first = rotation[:, known[0]]
    w = np.abs(first @ rotation)
    x, y, z = np.cross(first[1:], rotation[1:].T).T * -1 + first[0] * rotation[1:] - first[1:, None] * rotation[0]
    return np.asarray(2 * np.arctan2(np.sqrt(x * x + y * y + z * z), w), dtype=float)


def _known(values: Array | None) -> Array:
    """The values that are numbers; none if there are no values."""
    return np.empty(0) if values is None else values[np.isfinite(values)]


def _rates(panels: list[Axes], result: xr.Dataset, over: Abscissa, noun: str, unit: str, members: Members) -> None:
    """Three panels: the quantity and its first and second rate."""
    link = noun.startswith("turn")
    for order, axes in enumerate(panels):
        columns = {name: values[order] for name, values in members.items()}
        scope = usual_peak(ease(result), *columns.values())
        scale, shown = prefixed(scope, unit) if order == 0 or unit == "m" else (1.0, unit)
        rates = ("angular velocity", "angular acceleration") if link else ("velocity", "acceleration")
        title = noun if order == 0 else rates[order - 1]
        along(axes, over, f"{title} [{shown}{('', '/s', '/s²')[order]}]")
        shade(axes, result, over)
        for index, (name, values) in enumerate(columns.items()):
            if values is not None:
                curve(axes, over, values * scale, name, close=order > 0 or unit == "m" or link, **style_of(index))
        frame_peak(axes, _peak(columns), scope, scale, unit + ("", "/s", "/s²")[order])
        if order < 2:
            axes.set_xlabel("")
    legend(panels[0], most=_abreast(members), room=ROOM)
    if len(members) == 1:
        panels[0].set_title(plain(next(iter(members))), fontsize=8.5, loc="left")
