"""A mechanism in space as bodies that move: poses of the links, frames of the joints, solids fixed in the links.

Vectors have their component first: places are (3, position), rotations (3, 3, position) from the link's frame to the
global one. What no position has is NaN. A link is rods between its joints; a joint is a symbol by its type: revolute a
sleeve between two collars, cylindrical a sleeve on a long shaft, helical one on a thread, prismatic a block on a rail,
spherical a ball, universal a cross in two forks, planar a slab on a plate, fixed a cube. What the ground carries stands
on a hatched foot. Static figure and browser draw the same list.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import minimum_spanning_tree

from trunnion.algebra.space import rotation_matrix
from trunnion.errors import Finding, MechanismError
from trunnion.joints.pairs import PAIRS
from trunnion.results.attributes import attribute
from trunnion.views.axis import Array, Drawn, layout, members, numbers

if TYPE_CHECKING:
    import xarray as xr

THICKEST = 14.0  # a mechanism is drawn at least as large as so many radii of its thickest pin
SMALLEST = 1e-9  # m, of a mechanism that has a size
# shares of the size of the mechanism
TOGETHER = 0.1  # joints whose points lie closer are drawn apart
APART, ASIDE = 0.34, 0.16  # as far from their common point, where all axes meet in one, or only some do
BAR, FINE, SHAFT, SLEEVE, HALF, BALL, BLOCK = 0.0125, 0.005, 0.0095, 0.022, 0.03, 0.024, 0.024
COLLAR, FOOT = 0.0165, 0.05
PIN, FORK = 0.05, 0.1  # half a pin of a cross, and how far the base of a fork is from its middle
NEAR, SQUARE = 0.2, 0.25  # of the axes of a fork or a cross: apart, and cosine between them
TURNS, STEPS = 5, 10  # of a thread, and its corners a turn
ARC = np.radians(9)  # of a rod that is part of an arc
UP = np.array([0.0, 0.0, 1.0])


# ---- poses ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class BodyPose:
    """Where a link is: matrix (3, 3, position) and origin (3, position), m."""

    matrix: Array
    origin: Array

    def place(self, point: Array) -> Array:
        """A point of the link, (3,) in its frame, in the global one, (3, position)."""
        return np.asarray(self.origin + np.einsum("ijn,j->in", self.matrix, point), dtype=float)

    def direction(self, vector: Array) -> Array:
        """A direction fixed in the link, in the global frame, (3, position)."""
        return np.asarray(np.einsum("ijn,j->in", self.matrix, vector), dtype=float)

    @property
    def known(self) -> NDArray[np.bool_]:
        """Whether it has a place, (position,)."""
        return np.asarray(np.isfinite(self.matrix).all(axis=(0, 1)) & np.isfinite(self.origin).all(axis=0))


@dataclass(frozen=True)
class Space(Drawn):
    """What is needed to draw a spatial result at any position.

    poses: of every link; free: "link.point" → place in the link's frame, of points that are no
    joints; thickest: radius of the thickest pin, 0 if none is told, m.
    """

    poses: dict[str, BodyPose]
    free: dict[str, Array]
    thickest: float = 0.0

    @cached_property
    def joints(self) -> dict[str, dict[str, Any]]:
        """The joints whose links have poses."""
        joints = self.stated["joints"].items()
        return {name: entry for name, entry in joints if set(entry["links"]) <= self.poses.keys()}

    def element(self, joint: str, side: int) -> Array:
        """Point, z and x of a joint's element on its first (0) or second (1) link, rows (3, 3), in the link's frame."""
        return np.array(self.joints[joint]["frames"][side], dtype=float)

    def at(self, joint: str, side: int = 1) -> Array:
        """Track of the joint's point on a link, (3, position)."""
        return self.poses[self.joints[joint]["links"][side]].place(self.element(joint, side)[0])

    def axis(self, joint: str, side: int = 1) -> Array:
        """Direction of the axis of a joint's element, (3, position)."""
        return self.poses[self.joints[joint]["links"][side]].direction(self.element(joint, side)[1])

    def slides(self, joint: str) -> Array:
        """How far the point on the second link is along the axis of the first, (position,) m."""
        apart = self.at(joint, 1) - self.at(joint, 0)
        return np.asarray((apart * self.axis(joint, 0)).sum(axis=0), dtype=float)

    def reach(self, joint: str) -> tuple[float, float]:
        """Least and greatest slide, m."""
        slides = self.slides(joint)
        return float(np.nanmin(slides)), float(np.nanmax(slides))

    @cached_property
    def middle(self) -> Array:
        """Middle of the box around all places, (3,) m."""
        low, high = self.spots.min(axis=0), self.spots.max(axis=0)
        return np.asarray((low + high) / 2, dtype=float)

    def track(self, key: str) -> Array:
        """Track of a free point, (3, position)."""
        return self.poses[key.split(".", 1)[0]].place(self.free[key])

    @cached_property
    def drawable(self) -> NDArray[np.bool_]:
        """Whether every link has a place, (position,)."""
        return np.asarray(np.all([pose.known for pose in self.poses.values()], axis=0))

    @cached_property
    def spots(self) -> Array:
        """All places of joints and points over the run, (n, 3)."""
        tracks = [self.at(name, side) for name in self.joints for side in (0, 1)]
        tracks += [self.track(key) for key in self.free]
        spots = np.concatenate([track.T for track in tracks]) if tracks else np.empty((0, 3))
        return np.asarray(spots[np.isfinite(spots).all(axis=1)], dtype=float)

    @cached_property
    def extent(self) -> float:
        """Diagonal of the box around all that moves, or what the pins ask for, m; 0 where nothing has a length."""
        extent = float(np.linalg.norm(np.ptp(self.spots, axis=0))) if len(self.spots) else 0.0
        extent = max(extent, THICKEST * self.thickest)
        return extent if extent > SMALLEST else 0.0

    @property
    def size(self) -> float:
        """The extent; 1 m where there is none, as where all axes meet in one point and no pin has a radius."""
        return self.extent or 1.0

    @cached_property
    def shifts(self) -> dict[str, float]:
        """How far along its axis each joint is drawn from its point, m, so that joints on one spot are told apart.

        They are joints with an axis whose point lies on that of another joint of one of their links, with another axis.
        """
        shifts: dict[str, float] = dict.fromkeys(self.joints, 0.0)
        places = [self.at(name)[:, self.drawable] for name in self.joints]
        spread = float(np.linalg.norm(np.ptp(np.hstack(places), axis=1))) if places else 0.0
        share, index = APART if spread < APART * self.size else ASIDE, int(np.argmax(self.drawable))
        at, axes = ({name: of(name)[:, index] for name in self.joints} for of in (self.at, self.axis))
        one_axis = {name: PAIRS[joint["type"]].one_axis for name, joint in self.joints.items()}
        for name, joint in self.joints.items():
            crowded = one_axis[name] and any(  # else its symbol may lie anywhere on the axis
                other != name and set(joint["links"]) & set(self.joints[other]["links"])
                and np.linalg.norm(at[name] - at[other]) < TOGETHER * self.size
                and (np.linalg.norm(np.cross(axes[name], axes[other])) > 0.02 or not one_axis[other])
                for other in self.joints
            )  # fmt: skip
            if crowded:
                before = sum((np.sign(shift) * axes[other] for other, shift in shifts.items()
                              if shift and self.ground in self.joints[other]["links"]), np.zeros(3))  # fmt: skip
                # along the axis, a joint of the ground away from those of the ground before it
                turned = self.ground in joint["links"] and float(axes[name] @ before) > 0
                shifts[name] = share * self.size * (-1.0 if turned else 1.0)
        return shifts

    def seat(self, joint: str, side: int = 1) -> Array:
        """Place of a joint's symbol on a link, (3,) in the link's frame."""
        point, z, _ = self.element(joint, side)
        return np.asarray(point + self.shifts[joint] * z, dtype=float)

    def seated(self, joint: str) -> Array:
        """Track of a joint's symbol, (3, position)."""
        return self.poses[self.joints[joint]["links"][1]].place(self.seat(joint))


def space(result: xr.Dataset) -> Space:
    """Gather what the drawings need; raises MechanismError if no position can be drawn."""
    bodies = gathered(result)
    if not bodies.drawable.any():
        what = "no position of the mechanism can be assembled: there is nothing to draw"
        raise MechanismError(Finding(what, remedy="change the lengths or the range of the driver"))
    return bodies


def gathered(result: xr.Dataset) -> Space:
    """The same, whether or not a position can be drawn."""
    facts, count = layout(result), result.sizes["position"]
    turns, origins = members(result, "link_rotation", "link"), members(result, "link_position", "link")
    poses = {link: BodyPose(rotation_matrix(turns[link]), origins[link]) for link in turns}
    still = np.broadcast_to(np.eye(3)[:, :, None], (3, 3, count)), np.zeros((3, count))
    poses[facts["ground"]] = BodyPose(*still)  # the global frame, also where nothing else is known
    free = {}
    for key, track in members(result, "point_position", "point").items():
        link, point = key.split(".", 1)
        if link in poses and point not in facts["joints"]:
            pose = poses[link]
            for index in np.flatnonzero(np.isfinite(track).all(axis=0) & pose.known)[:1]:  # the first that is known
                free[key] = np.asarray(pose.matrix[:, :, index].T @ (track[:, index] - pose.origin[:, index]), float)
    radii = [float(row["value"]) for row in attribute(result, "inputs")
             if str(row["path"]).endswith("pin.radius") and isinstance(row.get("value"), int | float)]  # fmt: skip
    return Space(facts, poses, free, max(radii, default=0.0))


# ---- solids ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Solid:
    """One body fixed in a link, lengths in m in the link's frame.

    kind: "rod" (along the line through the points, with a radius), "ball" (at points[0]), "box" (points[0] its middle,
    the other three its half edges), "wire" (a line through the points); paint: the link whose colour it has, "" for the
    colour of joints.
    """

    kind: str
    link: str
    points: Array
    radius: float = 0.0
    paint: str = ""

    def data(self) -> dict[str, Any]:
        """As JSON, with seven digits."""
        return {"kind": self.kind, "link": self.link, "points": [numbers(point) for point in self.points],
                "radius": numbers(np.array([self.radius]))[0], "paint": self.paint}  # fmt: skip


def solids(bodies: Space) -> list[Solid]:
    """All bodies of a mechanism."""
    shapes = [solid for link in bodies.moving for solid in _body(bodies, link)]
    for name, joint in bodies.joints.items():
        shapes += SYMBOLS[PAIRS[joint["type"]].body](bodies, name)
        if bodies.ground in joint["links"]:
            shapes += _foot(bodies, name)
    return shapes


def _rod(link: str, start: Array, end: Array, radius: float, paint: str = "") -> Solid:
    return Solid("rod", link, np.array([start, end]), radius, paint)


def _box(link: str, middle: Array, halves: Array, paint: str = "") -> Solid:
    return Solid("box", link, np.array([middle, *halves]), 0.0, paint)


# ---- links ----------------------------------------------------------------------------------------------------


def _body(bodies: Space, link: str) -> list[Solid]:
    """Rods along the shortest tree through the joints of a link, finer ones to its free points."""
    sides = {name: joint["links"].index(link) for name, joint in bodies.joints.items() if link in joint["links"]}
    seats = {name: bodies.seat(name, side) for name, side in sides.items()}
    shapes, forked = _of_cardan(bodies, link, sides), set[str]()
    joints, places = list(seats), np.array(list(seats.values())).reshape(-1, 3)
    gaps = np.linalg.norm(places[:, None] - places, axis=2) + np.finfo(float).tiny  # 0 would be no edge
    for i, k in [] if shapes else np.transpose(minimum_spanning_tree(gaps).nonzero()):
        first, two = joints[i], joints[k]
        route = np.array(_route(bodies, (first, sides[first]), (two, sides[two])))
        for name, end, direction in ((first, 0, route[1] - route[0]), (two, -1, route[-2] - route[-1])):
            if PAIRS[bodies.joints[name]["type"]].body == "cross":  # it meets its fork; others hide in their symbols
                route[end] += direction * min(FORK * bodies.size / max(float(np.linalg.norm(direction)), 1e-300), 1 / 3)
                if name not in forked:
                    forked.add(name)
                    shapes += _fork(bodies, link, bodies.element(name, sides[name])[1], seats[name], route[end])
        if np.linalg.norm(np.diff(route, axis=0), axis=1).min() > 1e-6 * bodies.size:
            shapes.append(Solid("rod", link, route, BAR * bodies.size, link))
    for key, place in bodies.free.items():
        if key.split(".", 1)[0] == link and seats:
            spots = list(seats.values())  # on the link's rods or at its joints, of which the nearest
            for start, end in (piece for rod in shapes for piece in pairwise(rod.points)):
                along = end - start
                spots.append(start + np.clip((place - start) @ along / (along @ along), 0.0, 1.0) * along)
            base = spots[int(np.argmin(np.linalg.norm(np.array(spots) - place, axis=1)))]
            shapes.append(_rod(link, base, place, FINE * bodies.size, link))
            shapes.append(Solid("ball", link, place[None], 0.011 * bodies.size, link))
    return shapes


def _fork(bodies: Space, link: str, axis: Array, middle: Array, base: Array) -> list[Solid]:
    """The fork of a link on its pin of a cross: two prongs from the base, and an eye around either end of the pin."""
    size, direction = bodies.size, base - middle
    across = direction - (direction @ axis) * axis
    if np.linalg.norm(across) < 0.3 * np.linalg.norm(direction):  # the shaft lies along the pin
        return []
    shapes = []
    for sense in (-1.0, 1.0):
        eye = middle + sense * PIN * size * axis
        corner = eye + 0.55 * across
        shapes.append(Solid("rod", link, np.array([base, corner, eye]), BAR * size, link))
        shapes.append(_rod(link, eye - 0.013 * size * axis, eye + 0.013 * size * axis, 0.019 * size, link))
    return shapes


def _of_cardan(bodies: Space, link: str, sides: dict[str, int]) -> list[Solid]:
    """A link of a Cardan joint, both of whose axes cross squarely in one place: the cross between two moving links, or
    the fork of a shaft in the ground. Nothing of other links.
    """
    if len(sides) != 2 or not all(bodies.shifts[name] for name in sides):
        return []
    size, (first, second) = bodies.size, (bodies.element(name, side) for name, side in sides.items())
    if np.linalg.norm(first[0] - second[0]) > NEAR * size or abs(float(first[1] @ second[1])) > SQUARE:
        return []
    shafts = [name for name in sides if bodies.ground in bodies.joints[name]["links"]]
    pins = [name for name in sides if name not in shafts]
    if not shafts:
        arms = {name: (abs(bodies.shifts[name]) + HALF * size) * bodies.element(name, sides[name])[1] for name in pins}
        middles = {name: bodies.element(name, sides[name])[0] for name in pins}
        return [_rod(link, middles[name] - arm, middles[name] + arm, BAR * size, link) for name, arm in arms.items()]
    if len(pins) != 1:
        return []
    (shaft,), (pin,) = shafts, pins
    start, centre = bodies.seat(shaft, sides[shaft]), bodies.element(shaft, sides[shaft])[0]
    middle, axis, _ = bodies.element(pin, sides[pin])
    ends = [bodies.seat(pin, sides[pin]), 2 * middle - bodies.seat(pin, sides[pin])]
    prongs = [Solid("rod", link, np.array(_arc(start, end, centre, middle)), BAR * size, link) for end in ends]
    eye = _rod(link, ends[1] - HALF * size * axis, ends[1] + HALF * size * axis, SLEEVE * size)
    return [*prongs, eye]


def _route(bodies: Space, first: tuple[str, int], two: tuple[str, int]) -> list[Array]:
    """Corners of the rods from joint to joint: around the common point, else along an axis first and then across it."""
    start, end = bodies.seat(*first), bodies.seat(*two)
    if bodies.shifts[first[0]] and bodies.shifts[two[0]]:
        centres = bodies.element(*first)[0], bodies.element(*two)[0]
        if np.linalg.norm(centres[0] - centres[1]) < 0.2 * bodies.size:
            return _arc(start, end, *centres)
    for (name, side), here, after in ((first, start, end), (two, end, start)):
        if PAIRS[bodies.joints[name]["type"]].body == "sleeve":
            axis = bodies.element(name, side)[1]
            along = float((after - here) @ axis)
            across = float(np.linalg.norm(after - here - along * axis))
            if HALF * bodies.size < abs(along) < 4 * across:
                corners = [here, here + along * axis, after]
                return corners if here is start else corners[::-1]
    return [start, end]


def _arc(start: Array, end: Array, first: Array, second: Array) -> list[Array]:
    """From start, seen from the point `first`, to end, seen from `second`, turning about both alike."""
    a, b = start - first, end - second
    angle = np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)
    if not ARC < angle < np.radians(175):
        return [start, end]
    share = np.linspace(0.0, 1.0, 1 + int(np.ceil(angle / ARC)))[:, None]
    turned = (np.sin((1 - share) * angle) * a + np.sin(share * angle) * b) / np.sin(angle)
    return list(turned + first + share * (second - first))


# ---- joints ---------------------------------------------------------------------------------------------------


def _outer(bodies: Space, name: str) -> int:
    """Side of the link that holds sleeve, rail or plate: the ground's, else the second of a pair that turns."""
    joint = bodies.joints[name]
    if bodies.ground in joint["links"]:
        return int(joint["links"].index(bodies.ground))
    return 0 if "slide" in PAIRS[joint["type"]].freedoms[:1] else 1


def _seats(bodies: Space, name: str) -> tuple[Array, tuple[float, float], int]:
    """Of a pair that slides: middle of the outer part in its link, its reach along the axis of the inner link, side.

    The reach is told from the seat on the inner link, along the axis there.
    """
    low, high = bodies.reach(name)
    outer = _outer(bodies, name)
    seat, axis = bodies.seat(name, outer), bodies.element(name, outer)[1]
    if outer == 1:
        return seat, (low, high), outer
    middle = (low + high) / 2
    return seat + middle * axis, (middle - high, middle - low), outer


def _turning(bodies: Space, name: str) -> list[Solid]:
    """Sleeve of the outer link on the shaft of the inner one; a revolute pair has collars, a helical one a thread."""
    size, joint = bodies.size, bodies.joints[name]
    pair, (middle, (low, high), outer) = PAIRS[joint["type"]], _seats(bodies, name)
    links, z = joint["links"], bodies.element(name, outer)[1]
    inner = 1 - outer
    seat, axis = bodies.seat(name, inner), bodies.element(name, inner)[1]
    paint = bodies.ground if links[outer] == bodies.ground else ""
    shapes = [_rod(links[outer], middle - HALF * size * z, middle + HALF * size * z, SLEEVE * size, paint)]
    stub = (HALF + (0.03 if pair.slides else 0.012)) * size
    ends = seat + (min(low, 0.0) - stub) * axis, seat + (max(high, 0.0) + stub) * axis
    shapes.append(_rod(links[inner], *ends, SHAFT * size, links[inner]))
    if not pair.slides:
        for side in (-1, 1):
            near = seat + ((low if side < 0 else high) + side * (HALF + 0.002) * size) * axis
            shapes.append(_rod(links[inner], near, near + side * 0.008 * size * axis, COLLAR * size, links[inner]))
    if pair.threaded:
        # a helix around the shaft; its turns only tell that it is a thread
        radius, x, whole = SHAFT * 1.35 * size, bodies.element(name, inner)[2], ends[1] - ends[0]
        turns = max(TURNS, round(float(np.linalg.norm(whole)) / (2.2 * radius)))
        angle = np.linspace(0, 2 * np.pi * turns, STEPS * turns + 1)[:, None]
        around = np.cos(angle) * x + np.sin(angle) * np.cross(whole / np.linalg.norm(whole), x)
        shapes.append(Solid("wire", links[inner], ends[0] + angle / angle[-1] * whole + radius * around))
    return shapes


def _sliding(bodies: Space, name: str) -> list[Solid]:
    """A block of the inner link on the rail of the outer one."""
    size, links = bodies.size, bodies.joints[name]["links"]
    low, high = bodies.reach(name)
    outer = _outer(bodies, name)
    _, z, x = bodies.element(name, outer)
    if outer == 1:  # the block is on the first link: seen from the second it goes the other way
        low, high = -high, -low
    shift = bodies.shifts[name]
    reach = (shift + low - 2.2 * BLOCK * size, shift + high + 2.2 * BLOCK * size)
    base = bodies.element(name, outer)[0]
    rail = [(reach[1] - reach[0]) / 2 * z, 0.011 * size * x, 0.011 * size * np.cross(z, x)]
    shapes = [_box(links[outer], base + (reach[0] + reach[1]) / 2 * z, np.array(rail), links[outer])]
    _, w, v = bodies.element(name, 1 - outer)
    block = np.array([1.3 * BLOCK * size * w, BLOCK * size * v, BLOCK * size * np.cross(w, v)])
    shapes.append(_box(links[1 - outer], bodies.seat(name, 1 - outer), block))
    return shapes


def _cross(bodies: Space, name: str) -> list[Solid]:
    """The two pins of a cross, each along the axis of its link; only the ground has eyes here, others a fork."""
    size, shapes = bodies.size, []
    for side, link in enumerate(bodies.joints[name]["links"]):
        middle, z, _ = bodies.element(name, side)
        arm = (PIN + 0.016) * size * z
        shapes.append(_rod(link, middle - arm, middle + arm, 0.012 * size))
        if link == bodies.ground:
            shapes += [_rod(link, middle + end * 0.72 * arm, middle + end * arm, 0.019 * size, link) for end in (-1, 1)]
    return [*shapes, Solid("ball", bodies.joints[name]["links"][1], bodies.seat(name)[None], 0.019 * size)]


def _flat(bodies: Space, name: str) -> list[Solid]:
    """A slab of the inner link on a disc of the outer one, as wide as it travels."""
    size, links = bodies.size, bodies.joints[name]["links"]
    outer = _outer(bodies, name)
    point, z, x = bodies.element(name, outer)
    y = np.cross(z, x)
    frame = bodies.poses[links[outer]]
    apart = bodies.at(name, 1 - outer) - frame.place(point)
    across = [np.einsum("in,in->n", apart, frame.direction(axis)) for axis in (x, y)]
    radius = max(float(np.nanmax(np.hypot(*across))) + 1.6 * BLOCK * size, 3 * BLOCK * size)
    shapes = [_rod(links[outer], point - 0.018 * size * z, point - 0.01 * size * z, radius, links[outer])]
    _, w, v = bodies.element(name, 1 - outer)
    slab = np.array([1.3 * BLOCK * size * v, 1.3 * BLOCK * size * np.cross(w, v), 0.01 * size * w])
    return [*shapes, _box(links[1 - outer], bodies.seat(name, 1 - outer), slab)]


SYMBOLS: dict[str, Callable[[Space, str], list[Solid]]] = {
    "sleeve": _turning, "rail": _sliding, "cross": _cross, "plate": _flat,
    "ball": lambda bodies, name: [
        Solid("ball", bodies.joints[name]["links"][1], bodies.seat(name)[None], BALL * bodies.size)],
    "cube": lambda bodies, name: [
        _box(bodies.joints[name]["links"][1], bodies.seat(name), 0.02 * bodies.size * np.eye(3))],
}  # fmt: skip


# ---- ground ---------------------------------------------------------------------------------------------------


def _foot(bodies: Space, name: str) -> list[Solid]:
    """A post from the joint to a hatched plate: downwards, or along an axis that stands upright."""
    size, ground, body = bodies.size, bodies.ground, PAIRS[bodies.joints[name]["type"]].body
    side = bodies.joints[name]["links"].index(ground)
    seat = _seats(bodies, name)[0] if body == "sleeve" else bodies.seat(name, side)
    _, z, x = bodies.element(name, side)
    if body == "rail":
        low, high = bodies.reach(name)  # of the rail from its seat
        seat = seat + np.clip(0.0, *((low, high) if side == 0 else (-high, -low))) * z
    down = -UP + (UP @ z) * z
    if body in ("ball", "cube"):
        z, x, down = np.eye(3)[1], np.eye(3)[0], -UP
    if body == "plate" or np.linalg.norm(down) < 0.45:
        down, x = -z if z[2] >= 0 or body == "plate" else z, x
    else:
        down, x = down / np.linalg.norm(down), z
    y = np.cross(down, x)
    plate = seat + FOOT * size * down
    half = 0.04 * size
    shapes = [
        _rod(ground, seat, plate, 0.011 * size, ground),
        _box(ground, plate, np.array([half * x, half * y, 0.0035 * size * down]), ground),
    ]
    rim = plate + 0.0035 * size * down
    for along, across in ((x, y), (y, x), (x, -y), (y, -x)):  # strokes away from the edges of the plate
        starts = [rim + half * ((share + 0.4) * along + across) for share in np.linspace(-1, 1, 6)[:-1]]
        stroke = 0.45 * half * (down - 0.7 * along)
        shapes += [Solid("wire", ground, np.array([start, start + stroke]), 0.0, ground) for start in starts]
    return shapes


# ---- from where it is looked at -------------------------------------------------------------------------------------


HEIGHTS = (20.0, 28.0, 36.0, 46.0, 58.0)  # degrees above the horizon that are tried
SIDES = [side + off for side in (-135.0, -45.0, 45.0, 135.0) for off in range(-20, 21, 10)]  # around z: no axis end-on
MOST_SPOTS = 3000  # that are weighed


def looking(around: float, above: float) -> Array:
    """A camera at an angle around z (0: on the x axis, rad) and above the x–y plane; z points up in the picture.

    Its columns are right, up and towards the viewer, in the global frame: points (…, 3) times it are as they are seen.
    """
    c, s = np.cos(around), np.sin(around)
    towards = np.array([np.cos(above) * c, np.cos(above) * s, np.sin(above)])
    right = np.array([-s, c, 0.0])
    return np.array([right, np.cross(towards, right), towards]).T


def best(bodies: Space) -> tuple[float, float]:
    """Angles (rad) around z and above the horizon from which the mechanism is spread widest, never seen on its edge.

    The widest spread is the largest area of the ellipse of inertia of all places in the picture. A view from the front
    right at 28° is preferred where others gain little.
    """
    spots = bodies.spots[:: -(-len(bodies.spots) // MOST_SPOTS) or 1]
    seats = [bodies.seated(name)[:, bodies.drawable].T for name in bodies.joints]
    spots = np.concatenate([spots, *(seat[:: -(-len(seat) // 50) or 1] for seat in seats)])
    spots = spots - spots.mean(axis=0)
    scores = {}
    for above in np.radians(HEIGHTS):
        for around in np.radians(SIDES):
            x, y, _ = (spots @ looking(around, above)).T
            spread = np.linalg.det(np.cov(x, y)) if len(spots) > 2 else 0.0
            gentle = 1.0 - 0.15 * (1 - np.cos(around + np.radians(60))) / 2 - 0.1 * abs(above - np.radians(28))
            scores[float(around), float(above)] = np.sqrt(max(spread, 0.0)) * gentle + 1e-9 * gentle
    return max(scores, key=scores.__getitem__)


# ---- all of the picture ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Scenery:
    """A mechanism with its solids and the camera; box: left, below, right, above (m) of all that may be seen."""

    shown: Space
    solids: list[Solid]
    camera: Array
    box: tuple[float, float, float, float]

    @property
    def diagonal(self) -> float:
        """Size of the picture, m."""
        left, below, right, above = self.box
        return float(np.hypot(right - left, above - below))


def scenery(bodies: Space, camera: Array | None = None) -> Scenery:
    """Look at a mechanism, from the best side if not told."""
    camera = looking(*best(bodies)) if camera is None else camera
    shapes = solids(bodies)
    corners = []
    picked = np.flatnonzero(bodies.drawable)
    picked = picked[:: max(1, picked.size // 60)]
    for solid in shapes:
        pose = bodies.poses[solid.link]
        points = solid.points
        if solid.kind == "box":
            points = points[0] + np.array(list(product((-1.0, 1.0), repeat=3))) @ points[1:]
        places = np.einsum("ijn,kj->nki", pose.matrix[:, :, picked], points) + pose.origin[:, picked].T[:, None]
        projected = places.reshape(-1, 3) @ camera[:, :2]
        corners += [projected.min(axis=0) - solid.radius, projected.max(axis=0) + solid.radius]
    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    return Scenery(bodies, shapes, camera, (float(low[0]), float(low[1]), float(high[0]), float(high[1])))
