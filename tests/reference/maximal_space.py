"""Motion of a spatial mechanism in maximal coordinates, from plain model data (SI numbers), without Trunnion.

Every moving link has a place and a rotation matrix. A joint is a few scalar equations between vectors fixed in its two
elements: "no gap along a", "a of one is square to b of the other", "turned by so much". Newton closes them, their
first derivatives give the velocities, their second the accelerations. Loops, groups and joint coordinates do not occur.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]
Data = dict[str, Any]
TURN = 2 * np.pi
Row = tuple[Any, Any, Any]  # numbers, or one for each of several motions


class Frame(NamedTuple):
    """Place of the origin, m, and axes x, y, z as columns."""

    place: Array
    axes: Array

    def __matmul__(self, other: "Frame") -> "Frame":  # type: ignore[override]
        return Frame(self.place + self.axes @ other.place, self.axes @ other.axes)

    def inverse(self) -> "Frame":
        return Frame(-self.axes.T @ self.place, self.axes.T)


class Motion(NamedTuple):
    """A link's frame; velocity and acceleration of its origin and of its rotation. All global."""

    frame: Frame
    velocity: Array
    spin: Array
    acceleration: Array
    spin_rate: Array


class Drive(NamedTuple):
    """Coordinate, rate and second derivative of a driven joint."""

    value: float
    rate: float = 0.0
    second: float = 0.0


REST = Motion(Frame(np.zeros(3), np.eye(3)), *np.zeros((4, 3)))
TWISTS = np.eye(6).reshape(2, 3, 6)  # velocities and spins of the six unit twists


def rotation(axis: Any, angle: float) -> Array:
    """Turn by an angle about an axis of any length."""
    u = np.asarray(axis, float) / np.linalg.norm(axis)
    skew = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
    return np.eye(3) + np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew


def element(link: Data, name: str) -> Frame:
    """Element of a joint on a link in the link's frame: z along `axis`, x as near to `x` as may be."""
    point = link["points"][name]
    point = point if isinstance(point, dict) else {"at": point}
    z = np.asarray(point.get("axis", [0, 0, 1]), float)
    z = z / np.linalg.norm(z)
    x = np.asarray(point.get("x", [0, 1, 0] if abs(z[0]) > 0.999 else [1, 0, 0]), float)
    x = x - z * (z @ x)
    x = x / np.linalg.norm(x)
    return Frame(np.asarray(point["at"], float), np.column_stack([x, cross(z, x), z]))


def unrolled(data: Data) -> Data:
    """A model with a `loop` as one with points on links and joints: what the rows of the table say, in numbers."""
    if "loop" not in data:
        return data
    rows, links = data["loop"], dict(data.get("links", {}))
    count = len(rows)
    shift = [Frame(np.array([r.get("distance", 0.0), 0, 0]), rotation([1, 0, 0], r.get("twist", 0.0))) for r in rows]
    joints: Data = {}
    for k, row in enumerate(rows):
        following, before = rows[(k + 1) % count], rows[k - 1]
        joints[row["joint"]] = {n: row[n] for n in row if n in ("type", "pitch", "pin", "guide", "friction")}
        joints[row["joint"]]["links"] = [before["link"], row["link"]]
        link = dict(links.get(row["link"], {}))
        fixed = row["link"] == "ground"
        home = link.pop("frame", following["joint"] if fixed else row["joint"])
        own, next_one = (
            (Frame(np.zeros(3), np.eye(3)), shift[k]) if home == row["joint"] else (shift[k].inverse(), REST.frame)
        )
        constant = Frame(
            np.array([0, 0, following.get("slide", 0.0)]), rotation([0, 0, 1], following.get("rotation", 0.0))
        )
        link["points"] = {row["joint"]: point(own), following["joint"]: point(next_one @ constant)}
        links[row["link"]] = link
    return {**{key: part for key, part in data.items() if key != "loop"}, "links": links, "joints": joints}


def pose_of(frame: Any, i: int = 0) -> Frame:
    """One of the poses of a link in Trunnion's results, in plane or space."""

    def here(number: Any) -> float:
        return float(np.ravel(number)[i if np.size(number) > 1 else 0])

    if hasattr(frame, "c"):
        x, y, c, s = (here(n) for n in frame)
        return Frame(np.array([x, y, 0.0]), np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]))
    return Frame(np.array([here(n) for n in frame.place]), np.array([[here(n) for n in axis] for axis in frame[:3]]).T)


def published(result: Any, link: str, i: int) -> Frame:
    """The pose of a link at one position of a result in space."""
    place, turn = (result[f"link_{what}"].sel(link=link).values[:, i] for what in ("position", "rotation"))
    return Frame(place, Rotation.from_quat(np.roll(turn, -1)).as_matrix())


def raised(data: Data) -> Data:
    """A planar model in space: z across the plane, pins along z; inertia about x and y is that of a thin plate."""

    def lifted(stated: Any, joint: Data | None) -> Data:
        at = [*(stated["at"] if isinstance(stated, dict) else stated), 0.0]
        if joint and joint["type"] == "prismatic":
            return {"at": at, "axis": [*stated["axis"], 0.0], "x": [0, 0, -1]}  # y to the left of the slide
        return {"at": at, "axis": [0, 0, 1], "x": [1, 0, 0]} if joint else {"at": at}

    links: Data = {}
    for name, link in data["links"].items():
        points = {at: lifted(stated, data["joints"].get(at)) for at, stated in link["points"].items()}
        links[name] = {**link, "points": points}
        if "centre" in link:
            links[name]["centre"] = [*link["centre"], 0.0]
        if "inertia" in link:
            links[name]["inertia"] = {"xx": link["inertia"] / 2, "yy": link["inertia"] / 2, "zz": link["inertia"]}
    loads = {name: dict(load) for name, load in data.get("loads", {}).items()}
    for load in loads.values():
        load |= {"force": [*load["force"], 0.0]} if "force" in load else {}
        load |= {"moment": [0.0, 0.0, load["moment"]]} if "moment" in load else {}
    hints = {name: [*hint, 0.0] if isinstance(hint, list) else hint for name, hint in data.get("assembly", {}).items()}
    gravity = [*data["gravity"], 0.0]
    return {**data, "space": "spatial", "gravity": gravity, "links": links, "loads": loads, "assembly": hints}


def in_planes(data: Data) -> Data:
    """A planar model in space, as what this module, but no other, can move: a planar pair holds every link in its
    plane, and a joint holds what is left of its freedoms there."""
    data = raised(data)
    kinds = {"revolute": "pin", "prismatic": "slot"}
    joints = {name: {**joint, "type": kinds[joint["type"]]} for name, joint in data["joints"].items()}
    upright = point(REST.frame)
    links = {name: {**link, "points": dict(link["points"])} for name, link in data["links"].items()}
    for name in [name for name in links if name != "ground"]:
        ideal = {"friction": 0.0, "pin": {"clearance": 0.0}}
        joints[f"plane of {name}"] = {"type": "planar", "links": ["ground", name], **ideal}
        for link in ("ground", name):
            links[link]["points"][f"plane of {name}"] = upright
    return {**data, "links": links, "joints": joints}


def point(frame: Frame) -> Data:
    """A point of a model, of a frame in its link."""
    return {"at": list(frame.place), "axis": list(frame.axes[:, 2]), "x": list(frame.axes[:, 0])}


# rows of a joint: gaps along axes of the first element; pairs (axis of the first, axis of the second) that stay square
GAPS = {"prismatic": (0, 1), "cylindrical": (0, 1), "planar": (2,), "helical": (0, 1), "pin": (0, 1), "slot": (1,)}
ALIGNED = ((0, 2), (1, 2))
SQUARE: dict[str, tuple[tuple[int, int], ...]] = {
    "revolute": ALIGNED, "prismatic": (*ALIGNED, (0, 1)), "cylindrical": ALIGNED, "spherical": (),
    "universal": ((2, 2),), "helical": ALIGNED, "planar": ALIGNED, "fixed": (*ALIGNED, (0, 1)), "pin": (),
    "slot": ((1, 2),),
}  # fmt: skip
SLIDING = ("prismatic", "slot")  # a drive moves them along z, the others about it


class Linkage:
    """A mechanism; `move` it to a position."""

    def __init__(self, data: Data) -> None:
        self.data, self.joints, self.links = data, data["joints"], data["links"]
        self.moving = [link for link in self.links if link != "ground"]
        self.drivers = list(data.get("drivers", {}))
        self.placed = {
            (link, name): element(self.links[link], name) for name in self.joints for link in self.joints[name]["links"]
        }
        self.free = {link: ends for link in self.moving if (ends := self._ball_ends(link))}

    def _ball_ends(self, link: str) -> list[str]:
        """Its two joints if both are spherical and it has no others."""
        names = [name for name, joint in self.joints.items() if link in joint["links"]]
        return names if len(names) == 2 and all(self.joints[name]["type"] == "spherical" for name in names) else []

    def elements(self, motions: Mapping[str, Motion], joint: str) -> tuple[Motion, Motion]:
        """The two elements of a joint as they move."""
        first, second = (carried(motions.get(n, REST), self.placed[n, joint]) for n in self.joints[joint]["links"])
        return first, second

    def line(self, motions: Mapping[str, Motion], link: str) -> Array:
        """Unit vector along the line of the free spin of a link."""
        one, two = (motions[link].frame.axes @ self.placed[link, joint].place for joint in self.free[link])
        return (two - one) / np.linalg.norm(two - one)

    def equations(
        self, motions: Mapping[str, Motion], drive: Mapping[str, Drive], spin: Mapping[str, tuple[float, float]]
    ) -> tuple[Array, Array, Array]:
        """What is zero, its first and second derivative, with the drives (and given free spins) taken off."""
        found = [row for name in self.joints for row in self.rows(name, motions, drive)]
        for link in self.free:
            motion, u = motions[link], self.line(motions, link)
            rate, second = spin.get(link, (0.0, 0.0))
            # the angle of the spin is left as it comes; d(ω · u)/dt = α · u, as u is fixed in the link
            found.append((0.0, float(motion.spin @ u) - rate, float(motion.spin_rate @ u) - second))
        value, velocity, acceleration = np.array(found).T
        return value, velocity, acceleration

    def rows(self, name: str, motions: Mapping[str, Motion], drive: Mapping[str, Drive]) -> list[Row]:
        """The equations of one joint, and of its drive."""
        kind = self.joints[name]["type"]
        one, two = self.elements(motions, name)
        found = [gap(one, two, n) for n in GAPS.get(kind, (0, 1, 2))]
        found += [square(one, two, *pair) for pair in SQUARE[kind]]
        if kind == "helical":
            lead = TURN / self.joints[name]["pitch"]
            rest = [t - lead * s for t, s in zip(turned(one, two), gap(one, two, 2), strict=True)]
            found.append((wrapped(rest[0]), rest[1], rest[2]))
        if name in drive:
            coordinate = gap(one, two, 2) if kind in SLIDING else turned(one, two)
            off = [a - b for a, b in zip(coordinate, drive[name], strict=True)]
            found.append((off[0] if kind in SLIDING else wrapped(off[0]), off[1], off[2]))
        return found

    def placed_by(self, guess: Mapping[str, Frame], drive: Mapping[str, Drive]) -> dict[str, Frame]:
        """Position alone, by Newton from a guess of the links' frames."""
        count, frames = 6 * len(self.moving), dict(guess)
        size = np.inf
        for _ in range(30):
            still = {link: Motion(frames[link], *np.zeros((4, 3))) for link in self.moving}
            value, _, _ = self.equations(still, drive, {})
            jacobian = self.jacobian(frames)
            if jacobian.shape != (count, count):
                raise ValueError(f"{jacobian.shape[0]} equations for {count} coordinates: not determinate")
            step = np.linalg.solve(jacobian, -value)
            frames = {link: stepped(frames[link], step[6 * k : 6 * k + 6]) for k, link in enumerate(self.moving)}
            size, before = float(np.max(np.abs(step))), size
            if size < 1e-14 or 0.1 * before < size < 1e-12:  # rounding, which no step makes smaller
                return frames
        raise AssertionError("not assembled")

    def move(
        self,
        guess: Mapping[str, Frame],
        drive: Mapping[str, Drive],
        spin: Mapping[str, tuple[float, float]] | None = None,
    ) -> dict[str, Motion]:
        """Position by Newton from a guess of the links' frames, then velocity and acceleration.

        spin: rate and its derivative of the links whose spin is free, about the line of their ball joints.
        """
        spin, frames = spin or {}, self.placed_by(guess, drive)
        jacobian, none = self.jacobian(frames), np.zeros((4, 3))
        _, rate, _ = self.equations({n: Motion(frames[n], *none) for n in self.moving}, drive, spin)
        twists = np.linalg.solve(jacobian, -rate).reshape(-1, 2, 3)
        moved = {n: Motion(frames[n], *twists[k], *none[2:]) for k, n in enumerate(self.moving)}
        _, _, second = self.equations(moved, drive, spin)
        rates = np.linalg.solve(jacobian, -second).reshape(-1, 2, 3)
        return {n: Motion(frames[n], *twists[k], *rates[k]) for k, n in enumerate(self.moving)}

    def jacobian(self, frames: Mapping[str, Frame]) -> Array:
        """Rates of the equations for unit twists (velocity of the origin, spin) of the links."""
        drive = {name: Drive(0.0) for name in self.drivers}
        blocks = []
        for name, joint in self.joints.items():
            moving = [link for link in joint["links"] if link != "ground"]
            still = {link: Motion(frames[link], *np.zeros((4, 3, 1))) for link in moving}
            still["ground"] = Motion(REST.frame, *np.zeros((4, 3, 1)))
            kind = joint["type"]
            count = len(GAPS.get(kind, (0, 1, 2))) + len(SQUARE[kind]) + (kind == "helical") + (name in drive)
            block = np.zeros((count, 6 * len(self.moving)))
            for link in moving:  # its six unit twists at once
                motions = {**still, link: Motion(frames[link], *TWISTS, *np.zeros((2, 3, 1)))}
                first = 6 * self.moving.index(link)
                block[:, first : first + 6] = [row[1] for row in self.rows(name, motions, drive)]
            blocks.append(block)
        still = {link: Motion(frames[link], *np.zeros((4, 3))) for link in self.moving}
        for link in self.free:
            row, first = np.zeros((1, 6 * len(self.moving))), 6 * self.moving.index(link)
            row[0, first + 3 : first + 6] = self.line(still, link)
            blocks.append(row)
        return np.concatenate(blocks)


def cross(a: Array, b: Array) -> Array:
    """a × b; what NumPy has takes ten times as long on three numbers."""
    (p, q, r), (x, y, z) = a, b
    return np.array([q * z - r * y, r * x - p * z, p * y - q * x])


def dot(a: Array, b: Array) -> Any:
    """a · b over the first axis."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def carried(motion: Motion, element: Frame) -> Motion:
    """The motion of a frame fixed in a link."""
    frame = motion.frame @ element
    r, w, a = frame.place - motion.frame.place, motion.spin, motion.spin_rate
    velocity = motion.velocity + cross(w, r)
    acceleration = motion.acceleration + cross(a, r) + cross(w, cross(w, r))
    return Motion(frame, velocity, w, acceleration, a)


def fixed_vector(motion: Motion, axis: int) -> tuple[Array, Array, Array]:
    """An axis of a frame, with its derivatives."""
    e, w = motion.frame.axes[:, axis], motion.spin
    rate = cross(w, e)
    return e, rate, cross(motion.spin_rate, e) + cross(w, rate)


def gap(one: Motion, two: Motion, axis: int) -> Row:
    """Distance of the origins along an axis of the first, with its derivatives."""
    e, de, dde = fixed_vector(one, axis)
    d, v, a = two.frame.place - one.frame.place, two.velocity - one.velocity, two.acceleration - one.acceleration
    return dot(e, d), dot(de, d) + dot(e, v), dot(dde, d) + 2 * dot(de, v) + dot(e, a)


def square(one: Motion, two: Motion, first: int, second: int) -> Row:
    """Cosine between an axis of the first and one of the second, with its derivatives."""
    e, de, dde = fixed_vector(one, first)
    f, df, ddf = fixed_vector(two, second)
    return dot(e, f), dot(de, f) + dot(e, df), dot(dde, f) + 2 * dot(de, df) + dot(e, ddf)


def turned(one: Motion, two: Motion) -> Row:
    """Angle of the second about the z axis that both share, with its derivatives."""
    x, y, z = one.frame.axes.T
    angle = float(np.arctan2(y @ two.frame.axes[:, 0], x @ two.frame.axes[:, 0]))
    relative = two.spin - one.spin
    return angle, dot(z, relative), dot(cross(one.spin, z), relative) + dot(z, two.spin_rate - one.spin_rate)


def wrapped(angle: float) -> float:
    return float((angle + np.pi) % TURN - np.pi)


def stepped(frame: Frame, step: Array) -> Frame:
    """A frame moved by a small twist."""
    angle = float(np.linalg.norm(step[3:]))
    axes = rotation(step[3:], angle) @ frame.axes if angle > 0 else frame.axes
    u, _, v = np.linalg.svd(axes)  # rounding must not gather
    return Frame(frame.place + step[:3], u @ v)
