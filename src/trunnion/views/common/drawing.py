"""The mechanism as a drawing: links as bodies, ground hatched, joints named, coupler curves, ghost positions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.patches import Circle, Polygon, Rectangle
from matplotlib.transforms import Affine2D
from scipy.spatial import ConvexHull, QhullError

from trunnion.errors import Finding, MechanismError, Status
from trunnion.joints.pairs import GUIDED, PAIRS
from trunnion.views.axis import Array, abscissa, layout, members, status_text
from trunnion.views.draw import INK, MUTED, PALETTE, Labels, plain

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

GHOSTS = 8
PISTON, ASIDE = 0.95, 0.01  # length of a cylinder's rod, of the least distance of its eyes; of the size: off the guide
PALE = "#b4bac1"  # of links that are not spoken of


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
    def letters(self) -> float:
        """The size of letters, which must stay readable, 1 in a figure of its own."""
        return max(self.weight, 0.75)

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
            return PALE
        return PALETTE[self.moving.index(link) % len(PALETTE)]

    def joints(self, link: str) -> list[str]:
        """Keys of a link's points that are drawn as its body."""
        return [f"{link}.{point}" for point in self.stated["links"][link]["points"] if f"{link}.{point}" in self.tracks]

    def axis(self, name: str, index: int) -> float:
        """Direction of a prismatic joint's guide in the global frame, rad."""
        joint = self.stated["joints"][name]
        x, y = (joint.get("axis") or [1.0, 0.0])[:2]
        first = self.angles.get(joint["links"][0])
        return float(np.arctan2(y, x) + (0.0 if first is None else first[index]))


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


def draw(axes: Axes, drawing: Picture, index: int, labels: Labels) -> None:
    """Everything at position `index`, over the ghosts and the coupler curves; the names are still to be placed."""
    _ghosts(axes, drawing, index)
    sketch(axes, drawing, index)
    name_points(axes, drawing, index, labels)


def sketch(axes: Axes, drawing: Picture, index: int) -> None:
    """Links, springs, gears and joints at position `index` over the coupler curves, without a letter."""
    _curves(axes, drawing)
    cylinders = {link for name, joint in drawing.stated["joints"].items()
                 if PAIRS[joint["type"]].guided and cylinder(drawing, name) for link in joint["links"]}  # fmt: skip
    for link in sorted(
        {*drawing.moving} - cylinders, key=lambda link: (link in drawing.only, drawing.moving.index(link))
    ):
        _body(axes, drawing, link, index, drawing.colour(link))
    for name, spring in drawing.stated["springs"].items():
        _spring(axes, drawing, spring.get("between") or (), index, drawing.pulls.get(name))
    for circle in (circle for pair in drawing.stated["gears"].values() for circle in pair):
        x, y = drawing.tracks[circle["at"]][:, index]
        if np.isfinite(x + y):  # the pitch circle, dash-dotted as on a drawing
            axes.add_patch(Circle((x, y), circle["radius"], fill=False, edgecolor=INK, linestyle=(0, (8, 2, 1.5, 2)),
                                  zorder=3.5))  # fmt: skip
    for name, joint in drawing.stated["joints"].items():
        _joint(axes, drawing, name, joint, index)


def _ghosts(axes: Axes, drawing: Picture, index: int) -> None:
    count = next(iter(drawing.tracks.values())).shape[1]
    for step in range(1, GHOSTS):
        other = (index + round(step * count / GHOSTS)) % count
        for link in drawing.stated["links"]:
            corners = _corners(drawing, link, other)
            if link != drawing.ground and corners is not None and other != index:
                closed = np.vstack([corners, corners[:1]]) if len(corners) > 2 else corners
                axes.plot(*closed.T, color=MUTED, linewidth=0.6, alpha=0.35, zorder=2, solid_joinstyle="round")


def _curves(axes: Axes, drawing: Picture) -> None:
    """Tracks of points that are no joints, and thinly those of the moving joints."""
    for key, track in drawing.tracks.items():
        link, point = key.split(".", 1)
        if link == drawing.ground:
            continue
        free = point not in drawing.stated["joints"]
        x, y = np.hstack([track, track[:, :1]]) if closes(track) else track
        if free:
            axes.plot(x, y, color=INK, linewidth=1.3 * drawing.weight, zorder=2.5)
        else:
            axes.plot(x, y, color=MUTED, linewidth=0.7, linestyle=(0, (1, 2)), zorder=2.5)


def closes(track: Array) -> bool:
    """Whether the end of a track, (axis, position), is no farther from its start than its steps are long."""
    if track.shape[1] < 8 or not np.isfinite(track).all():
        return False
    steps = np.linalg.norm(np.diff(track, axis=1), axis=0)
    return bool(np.linalg.norm(track[:, 0] - track[:, -1]) <= 2.0 * steps.max())


def _corners(drawing: Picture, link: str, index: int) -> Array | None:
    """A link's points as the corners of its convex body, (corner, axis); None where it has no place."""
    keys = drawing.joints(link)
    points = np.array([drawing.tracks[key][:, index] for key in keys]).reshape(-1, 2)
    if not len(points) or not np.isfinite(points).all():
        return None
    return hull(points)


def hull(points: Array) -> Array:
    """The convex hull of a few points (corner, axis), counter-clockwise; its two ends where they lie in one line."""
    points = np.unique(points, axis=0)
    if len(points) < 3:
        return points
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except QhullError:
        along = (points - points[0]) @ (points[-1] - points[0])
        return np.asarray(points[[along.argmin(), along.argmax()]])


def _body(axes: Axes, drawing: Picture, link: str, index: int, colour: str) -> None:
    """A rounded plate around the link's points: the same outline drawn wide, then less wide in a tint."""
    corners = _corners(drawing, link, index)
    if corners is None or len(corners) < 2:
        return
    for width, paint in ((12.0, colour), (9.6, tint(colour))):
        width *= drawing.weight
        if len(corners) == 2:
            axes.plot(*corners.T, color=paint, linewidth=width, solid_capstyle="round", zorder=4)
        else:
            axes.add_patch(Polygon(corners, closed=True, facecolor=paint, edgecolor=paint, linewidth=width,
                                   joinstyle="round", zorder=4))  # fmt: skip


def tint(colour: str, share: float = 0.28) -> str:
    """The colour mixed with white."""
    parts = (int(colour[place : place + 2], 16) for place in (1, 3, 5))
    return "#" + "".join(f"{round(255 - share * (255 - part)):02x}" for part in parts)


COILS = np.array([[0.0, 0.18, *np.linspace(0.2, 0.8, 16), 0.82, 1.0], [0, 0, *np.tile([1.0, -1.0], 8), 0, 0]])


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


def _joint(axes: Axes, drawing: Picture, name: str, joint: dict[str, Any], index: int) -> None:
    first, second = joint["links"]
    track = drawing.tracks.get(f"{second}.{name}")
    if track is None or not np.isfinite(track[:, index]).all():
        return
    if f"{first}.{name}" in drawing.tracks and not np.isfinite(drawing.tracks[f"{first}.{name}"][:, index]).all():
        return  # its first link has no place
    place = track[:, index]
    grounded = drawing.ground in (first, second)
    if PAIRS[joint["type"]].guided:
        _slider(axes, drawing, name, index, place, grounded)
        return
    if grounded:
        _support(axes, place, 0.022 * drawing.size)
    r = 0.0095 * drawing.size
    axes.add_patch(Circle((place[0], place[1]), r, facecolor="white", edgecolor=INK, linewidth=1.3, zorder=6))


def _support(axes: Axes, place: Array, r: float) -> None:
    """A fixed bearing: a triangle on a hatched line."""
    x, y = place
    axes.add_patch(Polygon([(x, y), (x - 1.2 * r, y - 2 * r), (x + 1.2 * r, y - 2 * r)], closed=True,
                           facecolor="white", edgecolor=INK, linewidth=1.2, joinstyle="round", zorder=3))  # fmt: skip
    _hatched(axes, place + np.array([0, -2 * r]), 0.0, 2.2 * r, r)


def _hatched(axes: Axes, middle: Array, angle: float, half: float, r: float) -> None:
    """A line with hatching below it: the ground."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    ends = (turn @ np.array([[-half, half], [0.0, 0.0]])).T + middle
    axes.plot(*ends.T, color=INK, linewidth=1.3, zorder=3, solid_capstyle="butt")
    for along in np.linspace(-half + 0.55 * r, half, max(2, round(2 * half / (0.62 * r)))):
        stroke = (turn @ np.array([[along, along - 0.55 * r], [0.0, -0.6 * r]])).T + middle
        axes.plot(*stroke.T, color=INK, linewidth=0.8, zorder=3)


def _slider(axes: Axes, drawing: Picture, name: str, index: int, place: Array, grounded: bool) -> None:
    """A block on its guide; the guide is hatched if it is fixed."""
    angle = drawing.axis(name, index)
    r = 0.022 * drawing.size
    if grounded:
        track = drawing.tracks[f"{drawing.stated['joints'][name]['links'][1]}.{name}"]
        direction = np.array([np.cos(angle), np.sin(angle)]) @ track
        low, high = float(np.nanmin(direction)), float(np.nanmax(direction))
        here = float(np.array([np.cos(angle), np.sin(angle)]) @ place)
        middle = place + ((low + high) / 2 - here) * np.array([np.cos(angle), np.sin(angle)])
        below = np.array([np.sin(angle), -np.cos(angle)]) * r
        _hatched(axes, middle + below, angle, (high - low) / 2 + 2.4 * r, r)
    elif (parts := cylinder(drawing, name)) is not None:
        _cylinder(axes, drawing, name, index, parts)
        return
    else:
        _slot(axes, drawing, name, index, 2.4 * r)
    turned = Affine2D().rotate(angle).translate(*place) + axes.transData
    axes.add_patch(Rectangle((-1.7 * r, -r), 3.4 * r, 2 * r, transform=turned, facecolor="white", edgecolor=INK,
                             linewidth=1.3, zorder=5))  # fmt: skip


class Cylinder(NamedTuple):
    """A driven slide between two links that are pinned at their other ends: a barrel and the piston rod in it.

    barrel, rod: their eyes, as keys of points; long: length of the rod and of the barrel, m.
    """

    barrel: str
    rod: str
    long: tuple[float, float]


def cylinder(drawing: Picture, name: str) -> Cylinder | None:
    """The cylinder that a slide is; None where no driver moves it, where its links have more than two joints, where the
    eyes do not lie on the guide, or where the stroke is longer than a barrel could be.
    """
    parts_drawn, eyes = drawing.stated, list[str]()
    for link in parts_drawn["joints"][name]["links"]:
        keys = [key for key in drawing.joints(link) if key != f"{link}.{name}"]
        if link == drawing.ground or len(keys) != 1 or keys[0].split(".", 1)[1] not in parts_drawn["joints"]:
            return None
        eyes += keys
    if name not in parts_drawn.get("drivers", ()):
        return None
    apart = drawing.tracks[eyes[1]] - drawing.tracks[eyes[0]]
    turns = np.array([drawing.axis(name, position) for position in range(apart.shape[1])])
    width = np.nanmax(np.abs(apart[1] * np.cos(turns) - apart[0] * np.sin(turns)), initial=0.0)
    low, high = (float(end(np.hypot(*apart))) for end in (np.nanmin, np.nanmax))
    rod = PISTON * low
    barrel = high - rod + (1 - PISTON) * low
    return Cylinder(eyes[0], eyes[1], (rod, barrel)) if barrel < low and width < ASIDE * drawing.size else None


def _cylinder(axes: Axes, drawing: Picture, name: str, index: int, parts: Cylinder) -> None:
    """The rod, and over it the barrel that it comes out of."""
    start, end = drawing.tracks[parts.barrel][:, index], drawing.tracks[parts.rod][:, index]
    along = (end - start) / np.hypot(*(end - start))
    barrel, rod = drawing.stated["joints"][name]["links"]
    for ends, width, link in (((end - parts.long[0] * along, end), 7.0, rod),
                              ((start, start + parts.long[1] * along), 17.0, barrel)):  # fmt: skip
        for edge, paint in ((0.0, drawing.colour(link)), (2.4, tint(drawing.colour(link)))):
            axes.plot(*np.array(ends).T, color=paint, linewidth=(width - edge) * drawing.weight,
                      zorder=4.2 if link == rod else 4.3, solid_capstyle="round")  # fmt: skip


def _slot(axes: Axes, drawing: Picture, name: str, index: int, overrun: float) -> None:
    """The guide on a moving first link: as long as the block travels in it, and a little beyond."""
    first, second = drawing.stated["joints"][name]["links"]
    on, at = drawing.tracks[f"{first}.{name}"], drawing.tracks[f"{second}.{name}"]
    turns = np.array([drawing.axis(name, position) for position in range(on.shape[1])])
    along = np.array([np.cos(turns), np.sin(turns)])
    slide = np.sum((at - on) * along, axis=0)
    travel = np.array([np.nanmin(slide) - overrun, np.nanmax(slide) + overrun])
    body = np.array([min(travel[0], 0.0), max(travel[1], 0.0)])  # as far as the link's own point
    colour = drawing.colour(first)
    for reach, width, paint in ((body, 12.0, colour), (body, 9.6, tint(colour)), (travel, 2.4, "white")):
        ends = on[:, index, None] + along[:, index, None] * reach
        axes.plot(*ends, color=paint, linewidth=width * drawing.weight, solid_capstyle="round", zorder=4.2)


def name_points(axes: Axes, drawing: Picture, index: int, labels: Labels, only: Sequence[str] | None = None) -> None:
    """Names of joints and points, all or only some; points that are no joints get a dot."""
    places: dict[str, Array] = {}
    for key, track in drawing.tracks.items():
        link, point = key.split(".", 1)
        joint = drawing.stated["joints"].get(point)
        if np.isfinite(track[:, index]).all() and (joint is None or joint["links"][1] == link):
            places[point] = track[:, index]
            if joint is None and link != drawing.ground:
                axes.plot(*track[:, index], "o", markersize=4.5 * drawing.weight, color=INK, zorder=6)
    places = places if only is None else {point: place for point, place in places.items() if point in only}
    for text, points in _together(places, 0.02 * drawing.size):
        joints = [drawing.stated["joints"].get(point, {}) for point in points]
        block = any(joint.get("type") in GUIDED for joint in joints)
        labels.add(axes, text, places[points[0]], 10 * drawing.letters, 0.036 * drawing.size if block else 0.0)


def _together(places: dict[str, Array], near: float) -> list[tuple[str, list[str]]]:
    """Names of points that lie on one spot, joined to one label."""
    groups: list[list[str]] = []
    for point, place in places.items():
        home = next((group for group in groups if np.hypot(*(places[group[0]] - place)) < near), None)
        if home is None:
            groups.append(home := [])
        home.append(point)
    return [(", ".join(map(short, group)), group) for group in groups]


def short(name: str) -> str:
    """A name that fits into the drawing."""
    return name if len(name) <= 18 else f"{name[:17]}…"
