"""Links whose spin is free, carried along a track of poses without spinning.

Which way such links have turned about their line moves nothing else, so position by Newton's method leaves it as it was
guessed. The velocity is that of no spin, ω · u = 0; a track on which a link does so as well is had by turning it, with
those that spin with it, at each of its poses by what it has spun since the start.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.groups.tree import Element

if TYPE_CHECKING:
    from trunnion.groups.spatial import SpatialGroup

__all__ = ["unspun"]

Array = NDArray[np.float64]
ROUNDS = 4  # each of which leaves the third power
BEFORE, AFTER = slice(None, -1), slice(1, None)


def unspun(group: SpatialGroup, elements: Sequence[Element], rows: Array, drive: Sequence[Any]) -> Array:
    """Coordinates (kept, grid) of a track with the same poses but for the spins, which are taken out."""
    if not group.spinning or rows.shape[1] < 2:
        return rows
    grid = rows.shape[1]
    place = {i: n for n, i in enumerate(group.kept)}
    rows = rows.copy()
    sets = sorted(((group.spun(*spin), *spin) for spin in group.spinning), key=lambda spin: -len(spin[0]))
    pose, stale = group.position(elements, list(rows), drive), set[int]()
    for members, link, a, b in sets:
        if stale.intersection(members):  # of links that another spin has turned
            pose, stale = group.position(elements, list(rows), drive), set()
        stale.update(members)
        axis = _full(group.spin_axis(pose.elements, a, b), grid)
        centre = _full(pose.elements[a if group.joints[a].pair.ball else b].second.place, grid)
        spun = _spun(axis, np.array([_full(side, grid) for side in pose.frames[link][:3]]))
        for k in (a, b):
            first, second, _ = pose.elements[k]
            sense = -1.0 if group.joints[k].sides[1] in members else 1.0  # back by what it has spun
            begin = group.starts[k]
            if group.joints[k].pair.ball:
                local = np.array(
                    [np.sum(axis * _full(direction, grid), axis=0) for direction in (first.x, first.y, first.z)]
                )
                where = [place[begin + i] for i in range(4)]
                rows[where] = _turned(rows[where], local, sense * spun)
            elif group.joints[k].kind == "planar":
                ends = [
                    _Plate(_full(end.x, grid), _full(end.y, grid), _full(end.place, grid)) for end in (first, second)
                ]
                turns = int(group.joints[k].sides[1] in members)
                ends[turns] = _Plate(
                    _about(ends[turns].x, axis, -spun), _about(ends[turns].y, axis, -spun),
                    centre + _about(ends[turns].place - centre, axis, -spun),
                )  # fmt: skip
                rows[[place[begin + i] for i in range(3)]] = _planar(*ends)
            elif begin in place:
                rows[place[begin]] += sense * spun
    return rows


class _Plate(NamedTuple):
    """Axes in the plane and place of an element of a planar joint, each (3, grid)."""

    x: Array
    y: Array
    place: Array


def _planar(first: _Plate, second: _Plate) -> Array:
    """Both slides and the turn of a planar joint, (3, grid)."""
    apart = second.place - first.place
    slides = [np.sum(apart * axis, axis=0) for axis in (first.x, first.y)]
    turn = np.arctan2(np.sum(second.x * first.y, axis=0), np.sum(second.x * first.x, axis=0))
    return np.array([*slides, np.unwrap(turn)])


def _about(vector: Array, axis: Array, angle: Array) -> Array:
    """Vectors turned about unit axes (Rodrigues), (3, grid)."""
    along = np.sum(vector * axis, axis=0) * axis
    return np.asarray(along + np.cos(angle) * (vector - along) + np.sin(angle) * np.cross(axis, vector, axis=0))


def _full(vector: Sequence[Any], grid: int) -> Array:
    return np.array([np.broadcast_to(n, (grid,)) for n in vector], float)


def _spun(axis: Array, sides: Array) -> Array:
    """Angle by which a link has spun since the first pose of a run without gaps, rad; (3, grid), sides: (3, 3, grid).

    Each step of what is left is a turn about the line midway: u · the turn from one pose to the next, by sin and cos.
    """
    midway = axis[:, :-1] + axis[:, 1:]
    midway = midway / np.linalg.norm(midway, axis=0)
    spun = np.zeros(axis.shape[1])
    for _ in range(ROUNDS):
        before, after = (np.array([_about(side, axis, -spun)[:, part] for side in sides]) for part in (BEFORE, AFTER))
        sine = np.sum(midway * np.sum(np.cross(before, after, axis=1), axis=0), axis=0)
        cosine = np.sum(before * after, axis=(0, 1)) - 1.0
        spun += np.concatenate([[0.0], np.cumsum(np.nan_to_num(np.arctan2(sine, cosine)))])
    return spun


def _turned(q: Array, axis: Array, angle: Array) -> Array:
    """Quaternion (4, grid) of a turn about an axis after the turn q: the product of both."""
    c, v = np.cos(angle / 2), np.sin(angle / 2) * axis
    w, u = q[0], q[1:]
    return np.vstack([c * w - np.sum(v * u, axis=0), c * u + w * v + np.cross(v, u, axis=0)])
