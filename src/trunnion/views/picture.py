"""The figure of a spatial mechanism: bodies in parallel projection, coupler curves, names, reactions, axes."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.patches import FancyArrowPatch
from matplotlib.patheffects import Normal, Stroke

from trunnion.errors import Finding, MechanismError
from trunnion.results.dataset import without_noise
from trunnion.results.quantities import prefixed
from trunnion.views.axis import Array, members
from trunnion.views.bodies import HALF, Scenery, Solid, Space, scenery, space
from trunnion.views.curves import ease, usual_peak
from trunnion.views.draw import INK, MUTED, PALETTE, Labels, new
from trunnion.views.sketch import PALE_LINK, bare, closes, facts, short

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

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
    margin = 0.07 * look.diagonal  # around all that may be seen, with the key below, and no narrow strip
    reach = np.array([look.box[:2], look.box[2:], *(end for _, end in arrows)])
    low, high = reach.min(axis=0) - margin * np.array([1.0, 2.6]), reach.max(axis=0) + margin
    width, height = high - low
    more = np.array([max(0.0, height * 7.2 / HEIGHTS[1] - width), max(0.0, width * HEIGHTS[0] / 7.2 - height)]) / 2
    low, high = low - more, high + more
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


def sketch(axes: Axes, look: Scenery, index: int, only: tuple[str, ...] = ()) -> None:
    """Bodies and curves at a position, without a letter; only: links that have a colour, all if none is named.

    What is nearer is painted over what is farther, by the depths of the middles of small facets. The outline of a body
    is what looks away of a body a little larger.
    """
    bodies, camera = look.shown, look.camera
    faces, depths, colours = list[Array](), list[Array](), list[Array]()
    strokes = [(_pieces(bodies.track(key)), INK, 1.2) for key in bodies.free if key.split(".", 1)[0] != bodies.ground]
    strokes += [(_pieces(bodies.seated(name))[::2], MUTED, 0.7) for name, joint in bodies.joints.items()
                if bodies.ground not in joint["links"] and not bodies.shifts[name]]  # fmt: skip
    for solid in look.solids:
        matrix, origin = (of[..., index] for of in (bodies.poses[solid.link].matrix, bodies.poses[solid.link].origin))
        if solid.kind == "wire":
            points = solid.points @ matrix.T + origin
            strokes.append((np.stack([points[:-1], points[1:]], axis=1), INK, 0.7))
            continue
        paint = np.array(to_rgb(_colour(bodies, solid.paint, only)))
        for grown in (OUTLINE * bodies.size, 0.0):
            corners = camera.seen(facets(solid, bodies.size, grown) @ matrix.T + origin)
            normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
            lengths = np.linalg.norm(normals, axis=1, keepdims=True)  # 0 where two corners fall together
            normals /= np.where(lengths > 0, lengths, 1.0)
            seen = (normals[:, 2] > 0) == (grown == 0.0)
            faces.append(corners[seen][..., :2])
            depths.append(corners[seen][..., 2].mean(axis=1))
            if grown:
                colours.append(np.broadcast_to(to_rgb(INK), (int(seen.sum()), 3)))
                continue
            bright = np.clip(normals[seen] @ LIGHT, 0.0, 1.0)[:, None]  # lighter towards the light, darker away from it
            lit = paint * (0.62 + 0.38 * bright)
            colours.append(lit + (1 - lit) * 0.38 * np.maximum(0.0, bright - 0.55) / 0.45)
    polygons, edges = [*np.concatenate(faces)], [*np.concatenate(colours)]
    depth, widths, fills = [*np.concatenate(depths)], [0.35] * len(edges), [(*edge, 1.0) for edge in edges]
    for pieces, colour, width in strokes:  # lines among the bodies, a little nearer than they are
        lines = camera.seen(pieces)
        polygons += [*lines[..., :2]]
        depth += [*(lines[..., 2].mean(axis=1) + 0.003 * bodies.size)]
        edges, widths = edges + [np.array(to_rgb(colour))] * len(lines), widths + [width] * len(lines)
        fills += [(0.0, 0.0, 0.0, 0.0)] * len(lines)
    order = np.argsort(depth, kind="stable").tolist()
    rows = ([values[k] for k in order] for values in (polygons, fills, edges, widths))
    drawn, inside, rims, wide = rows
    axes.add_collection(PolyCollection(drawn, closed=False, facecolors=inside, edgecolors=rims, linewidths=wide,
                                       zorder=3, joinstyle="round", capstyle="round"))  # fmt: skip


def _colour(bodies: Space, name: str, only: tuple[str, ...]) -> str:
    if not name:
        return JOINT
    if name == bodies.ground:
        return GREY
    if only and name not in only:
        return PALE_LINK
    return PALETTE[bodies.moving.index(name) % len(PALETTE)]


def _pieces(track: Array) -> Array:
    """A track (3, position) as straight pieces (n, 2, 3), closed where its end lies no farther off than its steps."""
    line = track[:, :: -(-track.shape[1] // FEW)]
    line = (np.hstack([line, line[:, :1]]) if closes(line) else line).T
    pieces = np.stack([line[:-1], line[1:]], axis=1)
    return np.asarray(pieces[np.isfinite(pieces).all(axis=(1, 2))], dtype=float)


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
    """A triad of the global axes, a bar of a round length and, where reactions reach `most` N, an arrow of a round
    force."""
    (x0, x1), y0, letters = axes.get_xlim(), axes.get_ylim()[0], {"fontsize": 8, "color": MUTED, "va": "center"}
    y, arm = y0 + 0.025 * look.diagonal, 0.05 * look.diagonal
    if most > 0:
        factor, unit = prefixed(0.6 * most, "N")
        size = _round(0.6 * most * factor)
        left = x1 - size / factor / most * LENGTH * look.diagonal - 0.01 * look.diagonal
        _arrow(axes, np.array([left, y]), np.array([x1 - 0.01 * look.diagonal, y]), REACTION)
        axes.text(left - 0.2 * arm, y, f"load {size:g} {unit}", ha="right", **letters)  # type: ignore[arg-type]
    origin = np.array([x0, y0]) + 1.6 * arm
    for name, axis in zip("xyz", look.camera.matrix.T, strict=True):
        end = origin + arm * axis[:2]
        axes.annotate("", (end[0], end[1]), xytext=(origin[0], origin[1]), zorder=7,
                      arrowprops={"arrowstyle": "-|>", "color": MUTED, "linewidth": 1.1, "shrinkA": 0, "shrinkB": 0,
                                  "mutation_scale": 7})  # fmt: skip
        if (size := float(np.hypot(*axis[:2]))) > 0.15:  # else it points at the viewer
            place = end + 0.32 * arm * axis[:2] / size
            axes.text(place[0], place[1], name, ha="center", style="italic", **letters)  # type: ignore[arg-type]
    left, text = origin[0] + 2.1 * arm, "all axes meet in one point: drawn on a sphere"
    if look.shown.extent:
        factor, unit = prefixed(0.18 * (x1 - x0), "m")
        length = _round(0.18 * (x1 - x0) * factor)
        axes.plot([left, left + length / factor], [y, y], "|-", color=MUTED, linewidth=1.1, markersize=5, zorder=6)
        left, text = left + length / factor + 0.2 * arm, f"{length:g} {unit}"
    axes.text(left, y, text, ha="left", **letters)  # type: ignore[arg-type]


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
TURN = np.linspace(0, 2 * np.pi, SIDES + 1)


def facets(solid: Solid, size: float, grown: float = 0.0) -> Array:
    """Facets (n, corner, 3) in the link's frame, counter-clockwise from outside; grown: larger all round, m."""
    radius = solid.radius + grown
    if solid.kind == "rod":
        return _rod(solid.points, radius, grown, STEP * size)
    if solid.kind == "wire":
        return np.empty((0, 4, 3))
    if solid.kind == "ball":
        up = np.linspace(-np.pi / 2, np.pi / 2, RINGS + 1)[:, None]
        sphere = [np.cos(up) * np.cos(TURN), np.cos(up) * np.sin(TURN), np.sin(up) + 0 * TURN]
        return _between(solid.points[0] + radius * np.stack(sphere, axis=-1))
    middle, *halves = solid.points
    u, v, w = (half * (1 + grown / np.linalg.norm(half)) for half in halves)
    w = w if np.cross(u, v) @ w > 0 else -w
    sides = []
    for a, b, c in ((u, v, w), (v, w, u), (w, u, v)):
        for sense in (1, -1):
            across, up = (np.linspace(-1, 1, 1 + int(np.ceil(2 * np.linalg.norm(side) / (STEP * size))))
                          for side in (a, b))  # fmt: skip
            sides.append(_between(middle + sense * (c + up[:, None, None] * b) + across[:, None] * a))
    return np.concatenate(sides)


def _between(grid: Array) -> Array:
    """The facets between neighbours of a grid of points, (row, column, 3)."""
    corners = [grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]]
    return np.stack(corners, axis=2).reshape(-1, 4, 3)


def _rod(points: Array, radius: float, grown: float, step: float) -> Array:
    """A round rod along a line through points, cut into pieces, and its two ends, wide ones in rings."""
    line = points[:1]
    for start, end in pairwise(points):
        count = max(1, int(np.ceil(np.linalg.norm(end - start) / step)))
        line = np.vstack([line, start + np.linspace(0, 1, count + 1)[1:, None] * (end - start)])
    pieces = np.diff(line, axis=0)
    pieces /= np.linalg.norm(pieces, axis=1)[:, None]
    line[0] -= grown * pieces[0]
    line[-1] += grown * pieces[-1]
    along = np.vstack([pieces[:1], pieces[:-1] + pieces[1:], pieces[-1:]])  # across a corner lies its mitre
    x, rings = np.eye(3)[int(np.argmin(np.abs(pieces[0])))], list[Array]()
    for place, before, mitre in zip(line, np.vstack([pieces[:1], pieces]), along, strict=True):
        x = x - (x @ before) * before
        x /= np.linalg.norm(x)
        ring = radius * (np.cos(TURN)[:, None] * x + np.sin(TURN)[:, None] * np.cross(before, x))
        ring -= (ring @ mitre / (before @ mitre))[:, None] * before
        rings.append(place + ring)
        x = ring[0]  # on the next piece the same line of the surface
    shares = np.linspace(1.0, 0.0, 1 + max(1, int(radius // step)))[:, None, None]
    ends = [place + shares * (ring - place) for place, ring in zip(line[[0, -1]], (rings[0], rings[-1]), strict=True)]
    return np.concatenate([_between(np.array(rings)), _between(ends[0][::-1]), _between(ends[1])])
