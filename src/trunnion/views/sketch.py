"""The mechanism in the plane as a drawing: links as bodies, ground hatched, joints named, coupler curves, ghosts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Circle, Polygon, Rectangle
from matplotlib.transforms import Affine2D
from scipy.spatial import ConvexHull, QhullError

from trunnion.errors import Finding, MechanismError, Status
from trunnion.joints.pairs import GUIDED, PAIRS
from trunnion.views.axis import Array, abscissa, layout, members, status_text
from trunnion.views.draw import INK, MUTED, PALETTE, Labels, new, plain

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

GHOSTS = 8
PISTON, ASIDE = 0.95, 0.01  # length of a cylinder's rod, of the least distance of its eyes; of the size: off the guide
PALE_LINK = "#b4bac1"  # of links that are not spoken of
BLOCK = 0.022  # half height of a block, of the size
COILS = np.array([[0.0, 0.18, *np.linspace(0.2, 0.8, 16), 0.82, 1.0], [0, 0, *np.tile([1.0, -1.0], 8), 0, 0]])


@dataclass(frozen=True)
class Picture:
    """What is needed to draw a result at any position: its layout, tracks of points, angles of links, a size.

    tracks: "link.point" → (axis, position) m; angles: link → (position,) rad; size: diagonal of all of it, m.
    weight: of lines, 1 in a figure of its own; only: links that have a colour, all if none is named; pulls: spring →
    (position,) N or N m, 0 where one that acts one way does not act.
    """

    stated: dict[str, Any]
    tracks: dict[str, Array]
    angles: dict[str, Array]
    size: float
    box: tuple[float, float, float, float]
    weight: float = 1.0
    only: tuple[str, ...] = ()
    pulls: dict[str, Array] = field(default_factory=dict)

    @property
    def ground(self) -> str:
        """The name of the fixed link."""
        return str(self.stated["ground"])

    @property
    def moving(self) -> list[str]:
        """The names of the other links."""
        return [link for link in self.stated["links"] if link != self.ground]

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
    """The mechanism at a position, over ghosts of others and the coupler curves, with its names.

    index: if not given, a telling one: an eighth into what can be drawn, so that links do not lie in one line.
    """
    drawing = picture(result)
    if index is None:
        drawable = np.flatnonzero(np.all([np.isfinite(track).all(axis=0) for track in drawing.tracks.values()], axis=0))
        index = int(drawable[drawable.size // 8]) if drawable.size else 0
    low, high = np.array(drawing.box[:2]) - 0.09 * drawing.size, np.array(drawing.box[2:]) + 0.09 * drawing.size
    width, height = high - low
    figure = new("Mechanism", result, min(max(7.0 * height / width, 2.6), 8.0) + 0.5)
    axes = bare(figure.subplots(), low, high, facts(result, index))
    count = result.sizes["position"]
    for other in {(index + round(step * count / GHOSTS)) % count for step in range(1, GHOSTS)} - {index}:
        for link in drawing.moving:
            if (corners := _corners(drawing, link, other)) is not None:
                closed = np.vstack([corners, corners[:1]]) if len(corners) > 2 else corners
                axes.plot(*closed.T, color=MUTED, linewidth=0.6, alpha=0.35, zorder=2, solid_joinstyle="round")
    labels = Labels(figure)
    sketch(axes, drawing, index)
    name_points(axes, drawing, index, labels)
    labels.place()
    return figure


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
        pin = Circle(
            (place[0], place[1]), 0.0095 * drawing.size, facecolor="white", edgecolor=INK, linewidth=1.3, zorder=6
        )
        axes.add_patch(pin)


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


def name_points(axes: Axes, drawing: Picture, index: int, labels: Labels, only: Sequence[str] | None = None) -> None:
    """Names of joints and points, all or only some, those on one spot as one; points that are no joints get a dot."""
    places, joints = dict[str, Array](), drawing.stated["joints"]
    for key, track in drawing.tracks.items():
        link, point = key.split(".", 1)
        if np.isfinite(track[:, index]).all() and (point not in joints or joints[point]["links"][1] == link):
            places[point] = track[:, index]
            if point not in joints and link != drawing.ground:
                axes.plot(*track[:, index], "o", markersize=4.5 * drawing.weight, color=INK, zorder=6)
    groups: list[list[str]] = []
    for point, place in places.items() if only is None else ((name, places[name]) for name in places if name in only):
        near = (group for group in groups if np.hypot(*(places[group[0]] - place)) < 0.02 * drawing.size)
        home = next(near, None)
        if home is None:
            groups.append(home := [])
        home.append(point)
    for group in groups:
        block = any(joints.get(point, {}).get("type") in GUIDED for point in group)
        labels.add(axes, ", ".join(map(short, group)), places[group[0]], 10 * max(drawing.weight, 0.75),
                   0.036 * drawing.size if block else 0.0)  # fmt: skip


def short(name: str) -> str:
    """A name that fits into the drawing."""
    return name if len(name) <= 18 else f"{name[:17]}…"
