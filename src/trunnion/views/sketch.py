"""The mechanism as a drawing with coupler curves, joints named.

In the plane links are bodies on hatched ground, over ghosts of other positions; in space bodies in parallel projection,
with reactions and a key of axes and scales.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.patches import Circle, FancyArrowPatch, Polygon, Rectangle
from matplotlib.patheffects import Normal, Stroke
from matplotlib.transforms import Affine2D
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from trunnion.errors import Finding, MechanismError, Status
from trunnion.joints.pairs import GUIDED, PAIRS
from trunnion.results.dataset import without_noise
from trunnion.results.quantities import prefixed
from trunnion.views.axis import Array, Drawn, abscissa, is_spatial, layout, members, status_text
from trunnion.views.bodies import HALF, Scenery, Solid, Space, scenery, space
from trunnion.views.draw import INK, MUTED, PALETTE, name_beside, new, plain

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

GHOSTS = 8
PISTON, ASIDE = 0.95, 0.01  # length of a cylinder's rod, of the least distance of its eyes; of the size: off the guide
PALE_LINK = "#b4bac1"  # of links that are not spoken of
BLOCK = 0.022  # half height of a block, of the size
COILS = np.array([[0.0, 0.18, *np.linspace(0.2, 0.8, 16), 0.82, 1.0], [0, 0, *np.tile([1.0, -1.0], 8), 0, 0]])


@dataclass(frozen=True)
class Picture(Drawn):
    """What is needed to draw a result at any position: its layout, tracks of points, angles of links, a size.

    tracks: "link.point" → (axis, position) m; angles: link → (position,) rad; size: diagonal of all of it, m.
    weight: of lines, 1 in a figure of its own; only: links that have a colour, all if none is named; pulls: spring →
    (position,) N or N m, 0 where one that acts one way does not act.
    """

    tracks: dict[str, Array]
    angles: dict[str, Array]
    size: float
    box: tuple[float, float, float, float]
    weight: float = 1.0
    only: tuple[str, ...] = ()
    pulls: dict[str, Array] = field(default_factory=dict)

    def colour(self, link: str) -> str:
        """What a moving link is drawn in."""
        if self.only and link not in self.only:
            return PALE_LINK
        return PALETTE[self.moving.index(link) % len(PALETTE)]

    def joints(self, link: str) -> list[str]:
        """Keys of a link's points that are drawn as its body."""
        return [f"{link}.{point}" for point in self.stated["links"][link]["points"] if f"{link}.{point}" in self.tracks]

    def along(self, name: str) -> Array:
        """Direction of a prismatic joint's guide in the global frame, (axis, position)."""
        joint = self.stated["joints"][name]
        x, y = (joint.get("axis") or [1.0, 0.0])[:2]
        count = next(iter(self.tracks.values())).shape[1]
        turns = np.arctan2(y, x) + self.angles.get(joint["links"][0], np.zeros(count))
        return np.array([np.cos(turns), np.sin(turns)])


def picture(result: xr.Dataset) -> Picture:
    """Gather what the drawings need, with the box around it; raises MechanismError if no position can be drawn."""
    stated, tracks = layout(result), members(result, "point_position", "point")
    points = [track.T for track in tracks.values()]
    for circle in (circle for pair in stated["gears"].values() for circle in pair):
        points += [tracks[circle["at"]].T + sign * circle["radius"] for sign in (-1, 1)]
    places = np.concatenate(points) if points else np.empty((0, 2))
    places = places[np.isfinite(places).all(axis=1)]
    if not places.size:
        what = "no position of the mechanism can be assembled: there is nothing to draw"
        raise MechanismError(Finding(what, remedy="change the lengths or the range of the driver"))
    (x0, y0), (x1, y1) = places.min(axis=0).tolist(), places.max(axis=0).tolist()
    angles, pulls = members(result, "link_angle", "link"), members(result, "spring_force", "spring")
    return Picture(stated, tracks, angles, float(np.hypot(x1 - x0, y1 - y0)) or 1.0, (x0, y0, x1, y1), pulls=pulls)


def mechanism(result: xr.Dataset, index: int | None = None) -> Figure:
    """The mechanism at a position, over the coupler curves, with its names; in the plane over ghosts of others.

    index: if not given, an eighth into what can be drawn, so that links do not lie in one line. MechanismError where
    there is no such position, or nothing to draw.
    """
    count = result.sizes["position"]
    if index is not None and not 0 <= index < count:
        what, remedy = f"there is no position {index} among the {count}", f"name one from 0 to {count - 1}"
        raise MechanismError(Finding(what, "index", remedy))
    if is_spatial(result):
        return _in_space(without_noise(result), index)
    drawing = picture(result)
    if index is None:
        index = _eighth(np.all([np.isfinite(track).all(axis=0) for track in drawing.tracks.values()], axis=0))
    low, high = np.array(drawing.box[:2]) - 0.09 * drawing.size, np.array(drawing.box[2:]) + 0.09 * drawing.size
    width, height = high - low
    figure = new("Mechanism", result, min(max(7.0 * height / width, 2.6), 8.0) + 0.5)
    axes = bare(figure.subplots(), low, high, facts(result, index))
    for other in {(index + round(step * count / GHOSTS)) % count for step in range(1, GHOSTS)} - {index}:
        for link in drawing.moving:
            if (corners := _corners(drawing, link, other)) is not None:
                closed = np.vstack([corners, corners[:1]]) if len(corners) > 2 else corners
                axes.plot(*closed.T, color=MUTED, linewidth=0.6, alpha=0.35, zorder=2, solid_joinstyle="round")
    sketch(axes, drawing, index)
    name_points(axes, drawing, index)
    return figure


def _eighth(drawable: NDArray[np.bool_]) -> int:
    """The position that is drawn if none is named; 0 if no position has a place for all links."""
    places = np.flatnonzero(drawable)
    return int(places[places.size // 8]) if places.size else 0


def bare(axes: Axes, low: Array, high: Array, title: Sequence[str]) -> Axes:
    """Axes of one scale without a frame between two corners, with facts above."""
    axes.set_aspect("equal")
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    axes.axis("off")
    axes.set_title(plain("    ".join(filter(None, title))), fontsize=8.5, color=MUTED, loc="left")
    return axes


def facts(result: xr.Dataset, index: int) -> list[str]:
    """Where a position is, the structural formula, and why it has no answer."""
    over, status = abscissa(result), int(result["status"].values[index])
    cause = status_text(status).split(":")[0] if status >= Status.NOT_CONVERGED else ""
    return [f"{over.label} = {over.say(index)}", str(result.attrs.get("formula", "")), cause]


def sketch(axes: Axes, drawing: Picture, index: int) -> None:
    """Links, springs, gears and joints at position `index` over the coupler curves, without a letter."""
    joints = drawing.stated["joints"]
    for key, track in drawing.tracks.items():  # of points that are no joints, and thinly those of the moving joints
        link, point = key.split(".", 1)
        if link != drawing.ground:
            x, y = np.hstack([track, track[:, :1]]) if closes(track) else track
            thin: dict[str, Any] = {"color": MUTED, "linewidth": 0.7, "linestyle": (0, (1, 2))}
            free = {"color": INK, "linewidth": 1.3 * drawing.weight}
            axes.plot(x, y, zorder=2.5, **(thin if point in joints else free))
    cylinders = {link for name, joint in joints.items()
                 if PAIRS[joint["type"]].guided and cylinder(drawing, name) for link in joint["links"]}  # fmt: skip
    for link in sorted({*drawing.moving} - cylinders,
                       key=lambda link: (link in drawing.only, drawing.moving.index(link))):  # fmt: skip
        corners = _corners(drawing, link, index)
        if corners is not None and len(corners) > 1:
            _plate(axes, corners, drawing.colour(link), 12.0 * drawing.weight, 2.4 * drawing.weight, 4)
    for name, spring in drawing.stated["springs"].items():
        _spring(axes, drawing, spring.get("between") or (), index, drawing.pulls.get(name))
    for circle in (circle for pair in drawing.stated["gears"].values() for circle in pair):
        x, y = drawing.tracks[circle["at"]][:, index]
        if np.isfinite(x + y):  # the pitch circle, dash-dotted as on a drawing
            axes.add_patch(Circle((x, y), circle["radius"], fill=False, edgecolor=INK, linestyle=(0, (8, 2, 1.5, 2)),
                                  zorder=3.5))  # fmt: skip
    for name, joint in joints.items():
        first, second = joint["links"]
        tracks = [drawing.tracks.get(f"{link}.{name}") for link in (first, second)]
        if tracks[1] is None or any(track is not None and not np.isfinite(track[:, index]).all() for track in tracks):
            continue  # one of its links has no place
        grounded, place = drawing.ground in (first, second), tracks[1][:, index]
        if PAIRS[joint["type"]].guided:
            _slider(axes, drawing, name, index, place, grounded)
            continue
        if grounded:  # a fixed bearing: a triangle on a hatched line
            r = BLOCK * drawing.size
            triangle = place + r * np.array([(0.0, 0.0), (-1.2, -2.0), (1.2, -2.0)])
            axes.add_patch(Polygon(triangle, closed=True, facecolor="white", edgecolor=INK, linewidth=1.2,
                                   joinstyle="round", zorder=3))  # fmt: skip
            _hatched(axes, place + np.array([0, -2 * r]), np.array([1.0, 0.0]), 2.2 * r, r)
        look: dict[str, Any] = {"facecolor": "white", "edgecolor": INK, "linewidth": 1.3, "zorder": 6}
        axes.add_patch(Circle((place[0], place[1]), 0.0095 * drawing.size, **look))


def closes(track: Array) -> bool:
    """Whether the end of a track, (axis, position), is no farther from its start than its steps are long."""
    if track.shape[1] < 8 or not np.isfinite(track).all():
        return False
    steps = np.linalg.norm(np.diff(track, axis=1), axis=0)
    return bool(np.linalg.norm(track[:, 0] - track[:, -1]) <= 2.0 * steps.max())


def _corners(drawing: Picture, link: str, index: int) -> Array | None:
    """A link's points as the corners of its convex body, counter-clockwise, (corner, axis), its two ends where they lie
    in one line; None where it has no place."""
    points = np.array([drawing.tracks[key][:, index] for key in drawing.joints(link)]).reshape(-1, 2)
    if not len(points) or not np.isfinite(points).all():
        return None
    points = np.unique(points, axis=0)
    if len(points) < 3:
        return points
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except QhullError:
        along = (points - points[0]) @ (points[-1] - points[0])
        return np.asarray(points[[along.argmin(), along.argmax()]])


def _plate(axes: Axes, corners: Array, colour: str, width: float, edge: float, order: float) -> None:
    """A rounded plate around points: the same outline drawn wide, then less wide in a tint."""
    tint = "#" + "".join(f"{round(255 - 0.28 * (255 - int(colour[k : k + 2], 16))):02x}" for k in (1, 3, 5))
    for paint, wide in ((colour, width), (tint, width - edge)):
        if len(corners) == 2:
            axes.plot(*corners.T, color=paint, linewidth=wide, solid_capstyle="round", zorder=order)
        else:
            axes.add_patch(Polygon(corners, closed=True, facecolor=paint, edgecolor=paint, linewidth=wide,
                                   joinstyle="round", zorder=order))  # fmt: skip


def _spring(axes: Axes, drawing: Picture, ends: Sequence[str], index: int, pull: Array | None) -> None:
    """A zigzag between the ends of a spring, dotted where it does not act."""
    places = [drawing.tracks[end][:, index] for end in ends if end in drawing.tracks]
    if len(places) < 2 or not np.isfinite(places).all():
        return
    along = places[1] - places[0]
    across = np.array([-along[1], along[0]]) / (np.hypot(*along) or 1.0) * 0.012 * drawing.size
    path = places[0][:, None] + np.outer(along, COILS[0]) + np.outer(across, COILS[1])
    line = ":" if pull is not None and pull[index] == 0 else "-"
    axes.plot(*path, color=MUTED, linewidth=1.1, linestyle=line, zorder=4.5, solid_joinstyle="round")


def _hatched(axes: Axes, middle: Array, along: Array, half: float, r: float) -> None:
    """A line with hatching below it: the ground."""
    turn = np.array([[along[0], -along[1]], [along[1], along[0]]])
    axes.plot(*(turn @ np.array([[-half, half], [0.0, 0.0]]) + middle[:, None]), color=INK, linewidth=1.3, zorder=3,
              solid_capstyle="butt")  # fmt: skip
    for at in np.linspace(-half + 0.55 * r, half, max(2, round(2 * half / (0.62 * r)))):
        stroke = turn @ np.array([[at, at - 0.55 * r], [0.0, -0.6 * r]]) + middle[:, None]
        axes.plot(*stroke, color=INK, linewidth=0.8, zorder=3)


def _slider(axes: Axes, drawing: Picture, name: str, index: int, place: Array, grounded: bool) -> None:
    """A block on its guide, hatched if that is fixed, else a slot as long as the block travels; or a cylinder."""
    first, second = drawing.stated["joints"][name]["links"]
    guide, r, ends = drawing.along(name), BLOCK * drawing.size, drawing.tracks[f"{second}.{name}"]
    along = guide[:, index]
    if grounded:
        travel = along @ ends
        low, high = float(np.nanmin(travel)), float(np.nanmax(travel))
        middle = place + ((low + high) / 2 - float(along @ place)) * along
        _hatched(axes, middle + np.array([along[1], -along[0]]) * r, along, (high - low) / 2 + 2.4 * r, r)
    elif (barrel_and_rod := cylinder(drawing, name)) is not None:
        eyes, barrel, rod = barrel_and_rod
        start, end = (drawing.tracks[key][:, index] for key in eyes)
        way = (end - start) / np.hypot(*(end - start))
        _plate(axes, np.array([end - rod * way, end]), drawing.colour(second), 7.0 * drawing.weight,
               2.4 * drawing.weight, 4.2)  # fmt: skip
        _plate(axes, np.array([start, start + barrel * way]), drawing.colour(first), 17.0 * drawing.weight,
               2.4 * drawing.weight, 4.3)  # fmt: skip
        return
    else:
        on = drawing.tracks[f"{first}.{name}"]
        slide = np.sum((ends - on) * guide, axis=0)
        travel = np.array([np.nanmin(slide) - 2.4 * r, np.nanmax(slide) + 2.4 * r])
        body = np.array([min(travel[0], 0.0), max(travel[1], 0.0)])  # as far as the link's own point
        sides = [(on[:, index, None] + along[:, None] * reach).T for reach in (body, travel)]
        _plate(axes, sides[0], drawing.colour(first), 12.0 * drawing.weight, 2.4 * drawing.weight, 4.2)
        axes.plot(*sides[1].T, color="white", linewidth=2.4 * drawing.weight, solid_capstyle="round", zorder=4.2)
    turned = Affine2D().rotate(np.arctan2(along[1], along[0])).translate(*place) + axes.transData
    axes.add_patch(Rectangle((-1.7 * r, -r), 3.4 * r, 2 * r, transform=turned, facecolor="white", edgecolor=INK,
                             linewidth=1.3, zorder=5))  # fmt: skip


def cylinder(drawing: Picture, name: str) -> tuple[list[str], float, float] | None:
    """The cylinder that a driven slide between two links pinned at their other ends is: keys of the eyes of barrel and
    piston rod, and the lengths of barrel and rod, m.

    None where no driver moves it, where its links have more than two joints, where the eyes do not lie on the guide, or
    where the stroke is longer than a barrel could be.
    """
    stated, eyes = drawing.stated, list[str]()
    for link in stated["joints"][name]["links"]:
        keys = [key for key in drawing.joints(link) if key != f"{link}.{name}"]
        if link == drawing.ground or len(keys) != 1 or keys[0].split(".", 1)[1] not in stated["joints"]:
            return None
        eyes += keys
    if name not in stated.get("drivers", ()):
        return None
    apart, (x, y) = drawing.tracks[eyes[1]] - drawing.tracks[eyes[0]], drawing.along(name)
    width = np.nanmax(np.abs(apart[1] * x - apart[0] * y), initial=0.0)
    low, high = (float(end(np.hypot(*apart))) for end in (np.nanmin, np.nanmax))
    rod = PISTON * low
    barrel = high - rod + (1 - PISTON) * low
    return (eyes, barrel, rod) if barrel < low and width < ASIDE * drawing.size else None


def name_points(axes: Axes, drawing: Picture, index: int, only: Sequence[str] | None = None) -> None:
    """Names of joints and points, all or only some, those on one spot as one; points that are no joints get a dot.

    A name stands on the side away from the middle of all points, beside the foot of a fixed bearing.
    """
    places, joints = dict[str, Array](), drawing.stated["joints"]
    for key, track in drawing.tracks.items():
        link, point = key.split(".", 1)
        if np.isfinite(track[:, index]).all() and (point not in joints or joints[point]["links"][1] == link):
            places[point] = track[:, index]
            if point not in joints and link != drawing.ground:
                axes.plot(*track[:, index], "o", markersize=4.5 * drawing.weight, color=INK, zorder=6)
    middle, groups = np.mean(list(places.values()) or np.zeros((1, 2)), axis=0), list[list[str]]()
    for point, place in places.items() if only is None else ((name, places[name]) for name in places if name in only):
        near = (group for group in groups if np.hypot(*(places[group[0]] - place)) < 0.02 * drawing.size)
        home = next(near, None)
        if home is None:
            groups.append(home := [])
        home.append(point)
    for group in groups:
        place, about = places[group[0]], [joints[point] for point in group if point in joints]
        block = any(joint["type"] in GUIDED for joint in about)
        fixed = any(drawing.ground in joint["links"] for joint in about)
        away = place - middle
        if fixed and not block:
            away = np.array([np.copysign(1.0, away[0]), 0.0])
        name_beside(axes, ", ".join(map(short, group)), place, away, 10 * max(drawing.weight, 0.75),
                    0.036 * drawing.size if block else 0.0)  # fmt: skip


def short(name: str) -> str:
    """A name that fits into the drawing."""
    return name if len(name) <= 18 else f"{name[:17]}…"


# ---- in space ----------------------------------------------------------------------------------------------------

GREY = "#9aa3ad"  # of the ground
REACTION = "#c01f2e"
HEIGHTS = 3.2, 8.0  # in, of the drawing, which is 7.2 in wide
LENGTH = 0.3  # of the longest reaction, share of the size of the picture
FEW = 400  # pieces of a curve


def _in_space(result: xr.Dataset, index: int | None) -> Figure:
    """The mechanism at a position, with its reactions."""
    look = scenery(space(result))
    index = _eighth(look.shown.drawable) if index is None else index
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
    apart = "coincident joints drawn apart" * any(look.shown.shifts.values())
    axes = bare(figure.subplots(), low, high, [*facts(result, index), apart])
    paint(axes, look, index)
    for start, end in arrows:
        _arrow(axes, start, end, REACTION)
    name_joints(axes, look, index)
    _key(axes, look, most)
    return figure


def paint(axes: Axes, look: Scenery, index: int, only: tuple[str, ...] = ()) -> None:
    """Bodies and curves at a position, without a letter; only: links that have a colour, all if none is named.

    What is nearer is painted over what is farther, by the depths of the middles of small facets.
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
        corners = (facets(solid, bodies.size) @ matrix.T + origin) @ camera
        normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)  # 0 where two corners fall together
        normals /= np.where(lengths > 0, lengths, 1.0)
        front = normals[:, 2] > 0
        faces.append(corners[front][..., :2])
        depths.append(corners[front][..., 2].mean(axis=1))
        bright = np.clip(normals[front] @ LIGHT, 0.0, 1.0)[:, None]  # lighter towards the light, darker away from it
        lit = paint * (0.52 + 0.48 * bright)
        colours.append(lit + (1 - lit) * 0.38 * np.maximum(0.0, bright - 0.55) / 0.45)
    polygons, edges = [*np.concatenate(faces)], [*np.concatenate(colours)]
    depth, widths, fills = [*np.concatenate(depths)], [0.35] * len(edges), [(*edge, 1.0) for edge in edges]
    for pieces, colour, width in strokes:  # lines among the bodies, a little nearer than they are
        lines = pieces @ camera
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
    """Start and end of the arrows of each joint's forces that can be seen, and the largest of all, N.

    They are the loads on the ends of its bearing or guide, its reaction where it has none: a small reaction may bear on
    both ends of a pin with large forces.
    """
    here = {name: row[None, :, index] for name, row in members(result, "reaction_force", "joint").items()}
    for name, ends in members(result, "end_load", "joint").items():
        solid = ends[np.isfinite(ends).any(axis=(1, 2)), :, index]
        here |= {name: solid} if len(solid) else {}
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
            start = (place @ look.camera)[:2]
            end = start + (force @ look.camera)[:2] * LENGTH * look.diagonal / most
            if np.hypot(*(end - start)) > 0.01 * look.diagonal:
                arrows.append((start, end))
    return arrows, most


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
    for name, axis in zip("xyz", look.camera, strict=True):
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


def name_joints(axes: Axes, look: Scenery, index: int, only: tuple[str, ...] = (), size: float = 9.5) -> None:
    """Names of joints and free points, all or only some."""
    bodies, camera = look.shown, look.camera
    spots = {name: (bodies.seated(name)[:, index] @ camera)[:2] for name in bodies.joints}
    dots = {key.split(".", 1)[1]: (bodies.track(key)[:, index] @ camera)[:2] for key in bodies.free
            if not key.startswith(f"{bodies.ground}.")}  # fmt: skip
    spots |= dots
    middle = np.nanmean(list(spots.values()), axis=0)
    for name, spot in spots.items():
        if not only or name in only:
            name_beside(axes, short(name), spot, spot - middle, size, 0.04 * bodies.size)


# ---- solids as facets -----------------------------------------------------------------------------------------------


SIDES = 16  # of a rod
RINGS = 10  # of a ball
STEP = 0.03  # rods are cut into pieces of this share of the size: with twice that, crossing bars sort wrongly
LIGHT = np.array([-0.35, 0.55, 0.76])  # from the left and above, in the picture's frame
JOINT = "#f7f8fa"
TURN = np.linspace(0, 2 * np.pi, SIDES + 1)


def facets(solid: Solid, size: float) -> Array:
    """Facets (n, corner, 3) in the link's frame, counter-clockwise from outside."""
    if solid.kind == "rod":
        return _rod(solid.points, solid.radius, STEP * size)
    if solid.kind == "wire":
        return np.empty((0, 4, 3))
    if solid.kind == "ball":
        up = np.linspace(-np.pi / 2, np.pi / 2, RINGS + 1)[:, None]
        sphere = [np.cos(up) * np.cos(TURN), np.cos(up) * np.sin(TURN), np.sin(up) + 0 * TURN]
        return _between(solid.points[0] + solid.radius * np.stack(sphere, axis=-1))
    middle, u, v, w = solid.points
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


def _rod(points: Array, radius: float, step: float) -> Array:
    """A round rod along a line through points, cut into pieces, and its two ends, wide ones in rings."""
    line = points[:1]
    for start, end in pairwise(points):
        count = max(1, int(np.ceil(np.linalg.norm(end - start) / step)))
        line = np.vstack([line, start + np.linspace(0, 1, count + 1)[1:, None] * (end - start)])
    pieces = np.diff(line, axis=0)
    pieces /= np.linalg.norm(pieces, axis=1)[:, None]
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
