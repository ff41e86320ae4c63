"""Solids as facets, shaded and sorted by depth: farther ones are painted first and nearer ones over them.

Each solid is drawn twice: a little larger in ink, of which only the facets that look away are kept, and as it is. What
is left to see of the first is its outline.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection

from trunnion.views.common.cycle import Array
from trunnion.views.common.figures import INK
from trunnion.views.space.camera import Camera
from trunnion.views.space.solids import Solid

__all__ = ["Strokes", "facets", "normal_of", "paint"]

SIDES = 16  # of a rod
RINGS = 10  # of a ball
STEP = 0.03  # rods are cut into pieces of this share of the size: with twice that, crossing bars sort wrongly
OUTLINE = 0.0026  # share of the size
LIGHT = np.array([-0.35, 0.55, 0.76])  # from the left and above, in the picture's frame
JOINT = "#f7f8fa"


@dataclass(frozen=True)
class Strokes:
    """Lines drawn among the solids: (n, 2, 3) pieces in the global frame, colour, width in points."""

    pieces: Array
    colour: str
    width: float


def facets(solid: Solid, size: float, grown: float = 0.0) -> list[Array]:
    """Polygons (corner, 3) in the link's frame, counter-clockwise from outside; grown: larger all round, m."""
    if solid.kind == "rod":
        return _rod(solid.points, solid.radius + grown, grown, STEP * size)
    if solid.kind == "ball":
        return _ball(solid.points[0], solid.radius + grown)
    return _box(solid.points, grown, STEP * size) if solid.kind == "box" else []


def _rod(points: Array, radius: float, grown: float, step: float) -> list[Array]:
    """A round rod along a line through points, mitred at its corners, and its two ends."""
    line = _cut(points, step)
    ways = np.diff(line, axis=0)
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    line = np.vstack([line[0] - grown * ways[0], line[1:-1], line[-1] + grown * ways[-1]])
    x = np.cross(ways[0], np.eye(3)[int(np.argmin(np.abs(ways[0])))])  # from the middle to a line along the surface
    angle = np.linspace(0, 2 * np.pi, SIDES + 1)[:, None]
    rings = []
    for place, before, after in zip(line, [ways[0], *ways], [*ways, ways[-1]], strict=True):
        x /= np.linalg.norm(x)
        ring = radius * (np.cos(angle) * x + np.sin(angle) * np.cross(before, x))
        middle = before + after  # the plane of the mitre lies across it
        ring -= (ring @ middle / (before @ middle))[:, None] * before
        rings.append(place + ring)
        x = ring[0] - (ring[0] @ after) * after  # on the next piece the same line of the surface
    sides = [
        np.array([low[i], low[i + 1], high[i + 1], high[i]]) for low, high in pairwise(rings) for i in range(SIDES)
    ]
    return [*sides, *_cap(rings[0][:0:-1], step), *_cap(rings[-1][:-1], step)]


def _cap(rim: Array, step: float) -> list[Array]:
    """The end of a rod; a wide one, as of a disc, in rings of pieces that sort."""
    middle = rim.mean(axis=0)
    count = int(np.linalg.norm(rim[0] - middle) // step)
    if count < 2:
        return [rim]
    shares = np.linspace(1.0, 1.0 / count, count)
    rings = [middle + share * (np.vstack([rim, rim[:1]]) - middle) for share in shares]
    pieces = [np.array([out[i], out[i + 1], inner[i + 1], inner[i]]) for out, inner in pairwise(rings)
              for i in range(len(rim))]  # fmt: skip
    return [*pieces, rings[-1][:-1]]


def _cut(points: Array, step: float) -> Array:
    """The line through the points with more of them, none farther from the next than a step."""
    found = [points[:1]]
    for start, end in pairwise(points):
        count = max(1, int(np.ceil(np.linalg.norm(end - start) / step)))
        found.append(start + np.linspace(0, 1, count + 1)[1:, None] * (end - start))
    return np.concatenate(found)


def _ball(middle: Array, radius: float) -> list[Array]:
    up = np.linspace(-np.pi / 2, np.pi / 2, RINGS + 1)
    around = np.linspace(0, 2 * np.pi, SIDES + 1)
    points = middle + radius * np.stack(
        [np.cos(up)[:, None] * np.cos(around), np.cos(up)[:, None] * np.sin(around), np.sin(up)[:, None] + 0 * around],
        -1,
    )
    return [
        np.array([points[i, j], points[i, j + 1], points[i + 1, j + 1], points[i + 1, j]])
        for i in range(RINGS)
        for j in range(SIDES)
    ]


def _box(points: Array, grown: float, step: float) -> list[Array]:
    """A box, its sides cut into pieces."""
    middle, *halves = points
    u, v, w = (half * (1 + grown / np.linalg.norm(half)) for half in halves)
    if np.cross(u, v) @ w < 0:
        w = -w
    found = []
    for a, b, c in ((u, v, w), (v, w, u), (w, u, v)):
        across, up = (np.linspace(-1, 1, 1 + int(np.ceil(2 * np.linalg.norm(one) / step))) for one in (a, b))
        for left, right in pairwise(across):
            for low, high in pairwise(up):
                piece = np.array([left * a + low * b, right * a + low * b, right * a + high * b, left * a + high * b])
                found += [middle + c + piece, middle - c + piece[::-1]]
    return found


def paint(
    axes: Axes,
    camera: Camera,
    bodies: Iterable[tuple[Solid, Array, Array, str]],
    strokes: Iterable[Strokes],
    size: float,
) -> None:
    """Draw solids, each with the matrix (3, 3) and origin (3,) of its link and its colour, and lines among them."""
    pieces: list[tuple[float, Array, str, str, float]] = []  # depth, corners, face, edge, width
    for solid, matrix, origin, colour in bodies:
        if solid.kind == "wire":
            line = camera.seen(solid.points @ matrix.T + origin)
            pieces += _lines(np.stack([line[:-1], line[1:]], axis=1), INK, 0.7, 0.003 * size)
            continue
        for grown in (OUTLINE * size, 0.0):
            for corners in facets(solid, size, grown):
                seen = camera.seen(corners @ matrix.T + origin)
                normal = normal_of(seen)
                if (normal[2] > 0) == (grown == 0.0):  # the outline is what looks away, the body what looks here
                    face = shaded(colour, normal) if grown == 0.0 else INK
                    pieces.append((float(seen[:, 2].mean()), np.vstack([seen, seen[:1]])[:, :2], face, face, 0.35))
    for one in strokes:
        pieces += _lines(camera.seen(one.pieces), one.colour, one.width, 0.0)
    pieces.sort(key=lambda piece: piece[0])
    axes.add_collection(
        PolyCollection(
            [piece[1] for piece in pieces], closed=False, facecolors=[piece[2] for piece in pieces],
            edgecolors=[piece[3] for piece in pieces], linewidths=[piece[4] for piece in pieces], zorder=3,
            joinstyle="round", capstyle="round",
        )
    )  # fmt: skip


def _lines(pieces: Array, colour: str, width: float, forward: float) -> list[tuple[float, Array, str, str, float]]:
    """Lines as open polygons without a face, a little nearer than they are."""
    return [(float(piece[:, 2].mean()) + forward, piece[:, :2], "none", colour, width) for piece in pieces]


def normal_of(corners: Array) -> Array:
    """Unit normal of a polygon, also where two corners fall together."""
    across = np.cross(corners[2] - corners[0], corners[3 % len(corners)] - corners[1])
    return np.asarray(across / (np.linalg.norm(across) or 1.0), dtype=float)


def shaded(colour: str, normal: Array) -> str:
    """The colour under the light: lighter towards it, darker away from it."""
    bright = float(np.clip(normal @ LIGHT, 0.0, 1.0))
    parts = np.array([int(colour[place : place + 2], 16) for place in (1, 3, 5)], dtype=float)
    lit = parts * (0.62 + 0.38 * bright)
    lit += (255 - lit) * 0.38 * max(0.0, bright - 0.55) / 0.45
    return "#" + "".join(f"{round(part):02x}" for part in lit)
