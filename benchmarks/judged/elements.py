"""Elements of spatial joints and what is measured between them; positions are the last axis throughout."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from benchmarks.judged.verdict import Array, Data

__all__ = [
    "AXES",
    "MATRIX",
    "SQUARE",
    "Element",
    "along",
    "carried_at_ends",
    "cosine",
    "cross",
    "dot",
    "element",
    "matrix",
    "size",
    "unrolled",
]

AXES = {"revolute": (0, 1, 2), "helical": (0, 1), "prismatic": (0, 1), "cylindrical": (0, 1), "planar": (2,)}
SQUARE = {  # an axis of the first element and one of the second that stay at right angles
    "revolute": ((0, 2), (1, 2)),
    "cylindrical": ((0, 2), (1, 2)),
    "helical": ((0, 2), (1, 2)),
    "planar": ((0, 2), (1, 2)),
    "prismatic": ((0, 2), (1, 2), (0, 1)),
    "fixed": ((0, 2), (1, 2), (0, 1)),
    "universal": ((2, 2),),
    "spherical": (),
}
MATRIX = (("xx", "xy", "xz"), ("xy", "yy", "yz"), ("xz", "yz", "zz"))


def cross(a: Array, b: Array) -> Array:
    return np.asarray(np.cross(a, b, axis=0))


def dot(a: Array, b: Array) -> Array:
    return np.asarray(np.sum(a * b, axis=0))


def size(a: Array) -> Array:
    return np.asarray(np.sqrt(dot(a, a)))


class Element(NamedTuple):
    """A joint's frame on one link: axes (column, component, position), place with derivatives, spin with its rate."""

    axes: Array
    place: Array
    velocity: Array
    acceleration: Array
    spin: Array
    spin_rate: Array

    def vector(self, k: int) -> tuple[Array, Array, Array]:
        """An axis with its derivatives."""
        e = self.axes[k]
        rate = cross(self.spin, e)
        return e, rate, cross(self.spin_rate, e) + cross(self.spin, rate)


def matrix(q: Array) -> Array:
    """Axes (column, component, position) of unit quaternions (component, position)."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
            [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
            [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def element(point: Any) -> tuple[Array, Array]:
    """Place and axes (column, component) of a joint's point on a link, z along `axis`, x as near to `x` as may be."""
    point = point if isinstance(point, dict) else {"at": point}
    z = np.asarray(point.get("axis", (0, 0, 1)), float)
    z = z / np.linalg.norm(z)
    x = np.asarray(point.get("x", (0, 1, 0) if abs(z[0]) > 0.999 else (1, 0, 0)), float)
    x = x - z * (z @ x)
    x = x / np.linalg.norm(x)
    return np.asarray(point["at"], float), np.array([x, np.cross(z, x), z])


def unrolled(data: Data) -> tuple[dict[str, Data], dict[tuple[str, str], tuple[Array, Array]]]:
    """Joints of a loop with their links, and the elements of both in the frames of the links."""
    joints: dict[str, Data] = {}
    elements: dict[tuple[str, str], tuple[Array, Array]] = {}
    rows = data["loop"]
    for k, row in enumerate(rows):
        before, after = rows[k - 1], rows[(k + 1) % len(rows)]
        joints[row["joint"]] = {**row, "links": [before["link"], row["link"]]}
        c, s = np.cos(row.get("twist", 0.0)), np.sin(row.get("twist", 0.0))
        way, turn = np.array([row.get("distance", 0.0), 0, 0]), np.array([[1, 0, 0], [0, c, s], [0, -s, c]])
        home = data["links"].get(row["link"], {}).get("frame", row["joint"])
        if row["link"] == "ground" or home == after["joint"]:  # the link has the frame of the next joint
            elements[row["link"], row["joint"]] = -(turn @ way), turn.T
            elements[row["link"], after["joint"]] = np.zeros(3), np.eye(3)
        else:
            elements[row["link"], row["joint"]] = np.zeros(3), np.eye(3)
            elements[row["link"], after["joint"]] = way, turn
    return joints, elements


def along(one: Element, two: Element, k: int) -> tuple[Array, Array, Array]:
    """Distance of the origins along an axis of the first, with its derivatives."""
    e, de, dde = one.vector(k)
    d, v, a = two.place - one.place, two.velocity - one.velocity, two.acceleration - one.acceleration
    return dot(e, d), dot(de, d) + dot(e, v), dot(dde, d) + 2 * dot(de, v) + dot(e, a)


def cosine(one: Element, two: Element, i: int, k: int) -> tuple[Array, Array, Array]:
    """Of the angle between an axis of the first and one of the second, with its derivatives."""
    e, de, dde = one.vector(i)
    f, df, ddf = two.vector(k)
    return dot(e, f), dot(de, f) + dot(e, df), dot(dde, f) + 2 * dot(de, df) + dot(e, ddf)


def carried_at_ends(force: Array, moment: Array, u: Array, length: float, law: Data) -> Array:
    """Normal load of a bearing about u: |Q₁| + |Q₂| of its two ends, or the sum of Pezzuti et al."""
    across, couple = force - dot(force, u) * u, moment - dot(moment, u) * u
    if law.get("model") == "pezzuti":
        return size(across) + 2 * size(couple) / length
    g = cross(couple, u) / length
    return size(across / 2 - g) + size(across / 2 + g)
