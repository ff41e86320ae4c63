"""The figure of a spatial mechanism: bodies in parallel projection, coupler curves, names, reactions, axes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.patches import FancyArrowPatch
from matplotlib.patheffects import Normal, Stroke

from trunnion.errors import Finding, MechanismError
from trunnion.results.quantities import prefixed
from trunnion.results.scales import without_noise
from trunnion.views.common.cycle import Array, members
from trunnion.views.common.drawing import PALE, bare, closes, facts, short
from trunnion.views.common.figures import INK, MUTED, PALETTE, Labels, new
from trunnion.views.common.peaks import ease, usual_peak
from trunnion.views.space.bodies import Space, space
from trunnion.views.space.solids import HALF, Camera, Scenery, Solid, scenery

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["Strokes", "facets", "mechanism", "normal_of", "paint", "sketch"]


GREY = "#9aa3ad"  # of the ground
REACTION = "#c01f2e"
HEIGHTS = 3.2, 8.0  # in, of the drawing, which is 7.2 in wide
LENGTH = 0.3  # of the longest reaction, share of the size of the picture
FEW = 400  # pieces of a curve


def mechanism(result: xr.Dataset, index: int | None = None) -> Figure:
    """The mechanism at a position: that of the largest reaction that can be drawn, if not told."""
    result = without_noise(result)
    look, telling = scenery(space(result)), index is None
    index = _telling(result, look.shown) if index is None else index
    if not look.shown.drawable[index]:
        what = f"position {index} cannot be assembled: there is nothing to draw"
        raise MechanismError(Finding(what, "index", "choose a solved position"))
    arrows, most = _reactions(look, result, index)
    low, high = _limits(look, arrows)
    figure = new("Mechanism", result, float(np.clip(7.2 * (high - low)[1] / (high - low)[0], *HEIGHTS)) + 0.7)
    where, *others = facts(result, index)
    where += ", where the load of a joint is largest" * bool(arrows and telling)
    apart = "coincident joints drawn apart" * any(look.shown.shifts.values())
    axes = bare(figure.subplots(), low, high, [where, *others, apart])
    sketch(axes, look, index)
    for start, end in arrows:
        _arrow(axes, start, end, REACTION)
    labels = Labels(figure)
    name_joints(axes, look, index, labels)
    _key(axes, look, most)
    labels.place()
    return figure


def _limits(look: Scenery, arrows: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Corners below left and above right of the figure (m): all that may be seen, the key below, no narrow strip."""
    margin = 0.07 * look.diagonal
    reach = np.array([look.box[:2], look.box[2:], *(end for _, end in arrows)])
    low, high = reach.min(axis=0) - margin, reach.max(axis=0) + margin
    low[1] -= 1.6 * margin
    width, height = high - low
    wider = max(0.0, height * 7.2 / HEIGHTS[1] - width) / 2
    taller = max(0.0, width * HEIGHTS[0] / 7.2 - height) / 2
    more = np.array([wider, taller])
    return low - more, high + more


def _telling(result: xr.Dataset, bodies: Space) -> int:
    """The position of the largest usual force in a joint, or one in the first eighth where there is none."""
    drawable = np.flatnonzero(bodies.drawable)
    forces = _forces(result)
    if forces:
        sizes = np.array([np.fmax.reduce(np.linalg.norm(of, axis=1)) for of in forces.values()])
        most = usual_peak(ease(result), sizes)
        each = np.where(np.isfinite(sizes) & (sizes <= most * (1 + 1e-12)), sizes, -1.0).max(axis=0)[drawable]
        if most > 0 and each.max() > 0 and np.ptp(each) > 1e-6 * most:
            return int(drawable[each.argmax()])
    return int(drawable[drawable.size // 8])


def sketch(axes: Axes, look: Scenery, index: int, only: tuple[str, ...] = (), curves: bool = True) -> None:
    """Bodies and curves at a position, without a letter; only: links that have a colour, all if none is named."""
    gathered = look.shown
    bodies = [
        (solid, gathered.poses[solid.link].matrix[:, :, index], gathered.poses[solid.link].origin[:, index],
         _colour(gathered, solid.paint, only))
        for solid in look.solids
    ]  # fmt: skip
    strokes: list[Strokes] = []
    if curves:
        free = [key for key in gathered.free if key.split(".", 1)[0] != gathered.ground]
        inner = [name for name, joint in gathered.joints.items()
                 if gathered.ground not in joint["links"] and not gathered.shifts[name]]  # fmt: skip
        strokes += [Strokes(_pieces(gathered.track(key)), INK, 1.2) for key in free]
        strokes += [Strokes(_dashed(gathered.seated(name), 0.013 * gathered.size), MUTED, 0.7) for name in inner]
    paint(axes, look.camera, bodies, strokes, gathered.size)


def _colour(bodies: Space, name: str, only: tuple[str, ...]) -> str:
    if not name:
        return JOINT
    if name == bodies.ground:
        return GREY
    if only and name not in only:
        return PALE
    return PALETTE[bodies.moving.index(name) % len(PALETTE)]


def _pieces(track: Array) -> Array:
    """A track (3, position) as straight pieces (n, 2, 3), closed where its end lies no farther off than its steps."""
    line = track[:, :: -(-track.shape[1] // FEW)]
    line = (np.hstack([line, line[:, :1]]) if closes(line) else line).T
    pieces = np.stack([line[:-1], line[1:]], axis=1)
    return np.asarray(pieces[np.isfinite(pieces).all(axis=(1, 2))], dtype=float)


def _dashed(track: Array, dash: float) -> Array:
    """Every second piece of a track cut into pieces of one length (m), (n, 2, 3)."""
    pieces = _pieces(track)
    lengths = np.linalg.norm(pieces[:, 1] - pieces[:, 0], axis=1)
    ends = np.concatenate([[0.0], np.cumsum(lengths)])
    if ends[-1] < dash:
        return pieces[:0]
    marks = np.arange(0.0, ends[-1], dash)
    line = np.vstack([pieces[:1, 0], pieces[:, 1]])
    cut = np.array([np.interp(marks, ends, axis) for axis in line.T]).T
    return np.stack([cut[:-1], cut[1:]], axis=1)[::2]


def _reactions(look: Scenery, result: xr.Dataset, index: int) -> tuple[list[tuple[Array, Array]], float]:
    """Start and end of the arrows of each joint's forces that can be seen, and the largest of all, N."""
    here = {name: of[..., index] for name, of in _forces(result).items()}
    sizes = {name: np.linalg.norm(of, axis=1) for name, of in here.items()}
    most = max((float(size) for of in sizes.values() for size in of if np.isfinite(size)), default=0.0)
    arrows = []
    for name, forces in here.items():
        if name not in look.shown.joints:
            continue
        middle, half = look.shown.seated(name)[:, index], HALF * look.shown.size * look.shown.axis(name, 0)[:, index]
        # two forces are loads on the ends of a bearing, that at −u first
        places = [middle - half, middle + half] if len(forces) == 2 else [middle] * len(forces)
        for place, force, size in zip(places, forces, sizes[name], strict=True):
            if not size > 0.01 * most:
                continue
            start = look.camera.seen(place)[:2]
            end = start + look.camera.seen(force)[:2] * LENGTH * look.diagonal / most
            if np.hypot(*(end - start)) > 0.01 * look.diagonal:
                arrows.append((start, end))
    return arrows, most


def _forces(result: xr.Dataset) -> dict[str, Array]:
    """Of each joint the loads on the ends of its bearing or guide, its reaction where it has none, (force, axis,
    position), N: a small reaction may bear on both ends of a pin with large forces."""
    forces, ends = members(result, "reaction_force", "joint"), members(result, "end_load", "joint")
    solid = {joint: rows[np.any(np.isfinite(rows), axis=(1, 2))] for joint, rows in ends.items()}
    return {joint: solid[joint] if len(solid.get(joint, ())) else force[None] for joint, force in forces.items()}


def _arrow(axes: Axes, start: Array, end: Array, colour: str) -> None:
    axes.add_patch(FancyArrowPatch((start[0], start[1]), (end[0], end[1]), arrowstyle="-|>,head_length=5,head_width=2",
                                   shrinkA=0, shrinkB=0, linewidth=1.7, color=colour, zorder=6, mutation_scale=1.1,
                                   path_effects=[Stroke(linewidth=3.2, foreground="white"), Normal()]))  # fmt: skip


def _round(value: float) -> float:
    """The round number next below: 1, 2 or 5 times a power of ten."""
    base = 10.0 ** np.floor(np.log10(value))
    return float(next(step * base for step in (5, 2, 1) if step * base <= value * (1 + 1e-9)))


def _key(axes: Axes, look: Scenery, most: float) -> None:
    """A triad of the global axes, bars of a round length and, where reactions reach `most` N, of a round force."""
    (x0, x1), y0 = axes.get_xlim(), axes.get_ylim()[0]
    if most > 0:
        factor, unit = prefixed(0.6 * most, "N")
        size = _round(0.6 * most * factor) / factor
        y, long = y0 + 0.025 * look.diagonal, size / most * LENGTH * look.diagonal
        start = np.array([x1 - long - 0.01 * look.diagonal, y])
        _arrow(axes, start, start + np.array([long, 0.0]), REACTION)
        axes.annotate(f"load {size * factor:g} {unit}", (start[0], y), xytext=(-5, 0), textcoords="offset points",
                      ha="right", va="center", fontsize=8, color=MUTED)  # fmt: skip
    arm = 0.05 * look.diagonal
    origin = np.array([x0 + 1.6 * arm, y0 + 1.6 * arm])
    for name, axis in zip("xyz", look.camera.matrix.T, strict=True):
        end = origin + arm * axis[:2]
        axes.annotate("", (end[0], end[1]), xytext=(origin[0], origin[1]), zorder=7,
                      arrowprops={"arrowstyle": "-|>", "color": MUTED, "linewidth": 1.1, "shrinkA": 0, "shrinkB": 0,
                                  "mutation_scale": 7})  # fmt: skip
        away = end + 0.32 * arm * axis[:2] / (np.hypot(*axis[:2]) or 1.0)
        if np.hypot(*axis[:2]) > 0.15:
            axes.text(away[0], away[1], name, ha="center", va="center", fontsize=8, style="italic", color=MUTED)
    if not look.shown.extent:
        axes.text(origin[0] + 1.8 * arm, y0 + 0.025 * look.diagonal, "all axes meet in one point: drawn on a sphere",
                  fontsize=8, color=MUTED, va="center")  # fmt: skip
        return
    factor, unit = prefixed(0.18 * (x1 - x0), "m")
    length = _round(0.18 * (x1 - x0) * factor) / factor
    left, y, tick = origin[0] + 2.1 * arm, y0 + 0.025 * look.diagonal, 0.006 * look.diagonal
    axes.plot([left, left, left, left + length, left + length, left + length],
              [y - tick, y + tick, y, y, y - tick, y + tick], color=MUTED, linewidth=1.1, zorder=6)  # fmt: skip
    axes.annotate(f"{length * factor:g} {unit}", (left + length, y), xytext=(5, 0), textcoords="offset points",
                  ha="left", va="center", fontsize=8, color=MUTED)  # fmt: skip


def name_joints(
    axes: Axes, look: Scenery, index: int, labels: Labels, only: tuple[str, ...] = (), size: float = 9.5
) -> None:
    """Names of joints and free points, all or only some."""
    bodies, camera = look.shown, look.camera
    spots = {name: camera.seen(bodies.seated(name)[:, index])[:2] for name in bodies.joints}
    dots = {key.split(".", 1)[1]: camera.seen(bodies.track(key)[:, index])[:2] for key in bodies.free
            if not key.startswith(f"{bodies.ground}.")}  # fmt: skip
    for name, spot in (spots | dots).items():
        if not only or name in only:
            labels.add(axes, short(name), spot, size, 0.022 * bodies.size)


# ---- solids as facets -----------------------------------------------------------------------------------------------


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
    pieces = [points[:1]]
    for start, end in pairwise(points):
        count = max(1, int(np.ceil(np.linalg.norm(end - start) / step)))
        pieces.append(start + np.linspace(0, 1, count + 1)[1:, None] * (end - start))
    return np.concatenate(pieces)


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
    faces = []
    for a, b, c in ((u, v, w), (v, w, u), (w, u, v)):
        across, up = (np.linspace(-1, 1, 1 + int(np.ceil(2 * np.linalg.norm(side) / step))) for side in (a, b))
        for left, right in pairwise(across):
            for low, high in pairwise(up):
                piece = np.array([left * a + low * b, right * a + low * b, right * a + high * b, left * a + high * b])
                faces += [middle + c + piece, middle - c + piece[::-1]]
    return faces


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
                projected = camera.seen(corners @ matrix.T + origin)
                normal = normal_of(projected)
                if (normal[2] > 0) == (grown == 0.0):  # the outline is what looks away, the body what looks here
                    face = shaded(colour, normal) if grown == 0.0 else INK
                    pieces.append(
                        (float(projected[:, 2].mean()), np.vstack([projected, projected[:1]])[:, :2], face, face, 0.35)
                    )
    for stroke in strokes:
        pieces += _lines(camera.seen(stroke.pieces), stroke.colour, stroke.width, 0.0)
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
