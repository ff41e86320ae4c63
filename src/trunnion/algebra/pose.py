"""Poses as dual orthogonal matrices Â = R + ε [p]× R: the frame at p turned by R.  [P 3-7, 9, 10]

A pose is a matrix of `algebra.vector`: the product of two is one after the other, the transpose the inverse, and
`apply(pose, line)` gives a line of the moved frame in the frame it was moved from. With plain angles the same
functions are rotations.
"""

from __future__ import annotations

from typing import cast

from trunnion.algebra.dual import parts
from trunnion.algebra.line import line
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.vector import (
    IDENTITY,
    Matrix3,
    Vector3,
    apply,
    cross,
    dot,
    plus,
    product,
    scaled,
    spatial_vector,
    transpose,
    unit,
    vector_parts,
)

__all__ = [
    "adjoint", "compose", "frame", "inverse", "link", "moved_point", "pose", "rotation_and_point", "transform",
    "turn_x", "turn_z",
]  # fmt: skip


def turn_z(angle: Number) -> Matrix3:
    """Z(θ + ε s): turn by θ about z and slide by s along it, the motion of a cylindrical pair.  [P 9]"""
    xp = namespace(angle)
    c, s = xp.cos(angle), xp.sin(angle)
    return (c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)


def turn_x(angle: Number) -> Matrix3:
    """X(α + ε a): turn by α about x and go a along it, from one axis of a link to the next."""
    xp = namespace(angle)
    c, s = xp.cos(angle), xp.sin(angle)
    return (1.0, 0.0, 0.0), (0.0, c, -s), (0.0, s, c)


def link(angle: Number, twist: Number) -> Matrix3:
    """Z(θ̂) X(α̂): a joint and the link after it, in the parameters of Denavit and Hartenberg."""
    return product(turn_z(angle), turn_x(twist))


def frame(point: Vector3, x: Vector3, z: Vector3) -> Matrix3:
    """Pose of the frame at a point P with its z axis along z and its x axis in the plane of x and z.

    [P 3] î = i + ε [P]× i, [P 4] k̂ = k + ε [P]× k, [P 5] ĵ = k̂ × î; [P 7] î, ĵ, k̂ are the columns.
    point: m; x, z: of any length, x not along z (NaN there). [P 6], [P]×, is `algebra.vector.skew`.
    """
    k = unit(z)
    i = unit(plus(x, scaled(-dot(x, k), k)))
    x_axis, z_axis = line(point, i), line(point, k)
    return transpose((x_axis, cross(z_axis, x_axis), z_axis))


def pose(rotation: Matrix3, point: Vector3) -> Matrix3:
    """R + ε [p]× R of a rotation matrix R and a point p, m."""
    columns = transpose(rotation)
    return transpose(cast(Matrix3, tuple(spatial_vector(column, cross(point, column)) for column in columns)))


def rotation_and_point(a: Matrix3) -> tuple[Matrix3, Vector3]:
    """R and p of a pose: p is half the sum of u × m over its columns u + ε m."""
    columns = [vector_parts(column) for column in transpose(a)]
    total = plus(plus(cross(*columns[0]), cross(*columns[1])), cross(*columns[2]))
    rotation = transpose(cast(Matrix3, tuple(u for u, _ in columns)))
    return rotation, scaled(0.5, total)


def compose(*poses: Matrix3) -> Matrix3:
    """Â B̂ …: one after the other, each in the frame reached so far; the identity if there is none."""
    return product(*poses) if poses else IDENTITY


def inverse(a: Matrix3) -> Matrix3:
    """Âᵀ, the way back."""
    return transpose(a)


def transform(a: Matrix3, v: Vector3) -> Vector3:
    """Â v̂: a line, screw, twist or wrench of the moved frame, in the frame it was moved from."""
    return apply(a, v)


def moved_point(a: Matrix3, point: Vector3) -> Vector3:
    """p + R q: a point of the moved frame, in the frame it was moved from; m."""
    rotation, origin = rotation_and_point(a)
    return plus(origin, apply(rotation, point))


def adjoint(a: Matrix3) -> list[list[Number]]:
    """Six rows [R 0; [p]× R  R]: what `transform` does to the parts (u, m) of a dual vector."""
    both = [[parts(entry) for entry in row] for row in a]
    upper = [[*(real for real, _ in row), 0.0, 0.0, 0.0] for row in both]
    lower = [[*(dual for _, dual in row), *(real for real, _ in row)] for row in both]
    return upper + lower
