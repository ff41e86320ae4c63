"""Lines, poses and screws as dual vectors and matrices of `algebra.vector`.  [P 1-7, 9, 10]

A line is a unit dual vector û = u + ε p × u. Two lines meet in the dual angle θ̂ = θ + ε s about their common
perpendicular n̂:

    û · v̂ = cos θ̂ = cos θ − ε s sin θ,   û × v̂ = sin θ̂ n̂

so the angle is atan2(|û × v̂|, û · v̂), good at every angle; parallel lines have no one common perpendicular.

A pose is a dual orthogonal matrix Â = R + ε [p]× R: the frame at p turned by R. The product of two is one after the
other, the transpose the inverse, and `apply(pose, line)` gives a line, screw, twist or wrench of the moved frame in the
frame it was moved from. With plain angles the same functions are rotations.

A screw is a dual vector v̂ = θ̂ û: a turn θ about a line and a slide s along it. The same six numbers are a twist
ω + ε v (v of the point at the origin) and a wrench F + ε M (M about the origin); their Lie bracket, the rate at which
one carries the other round, is `cross`. `exp` makes a screw a pose, `log` a pose the shortest screw.
"""

from __future__ import annotations

from typing import NamedTuple, cast

import numpy as np

from trunnion.algebra.dual import parts, primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.vector import (
    Matrix3,
    Vector3,
    cross,
    dot,
    plus,
    product,
    scaled,
    spatial_vector,
    transpose,
    unit,
    vector_parts,
    where,
)

PARALLEL = 1e-12  # of |sin θ|: the perpendicular then holds 4 digits, as rounding of the cross product is 1e-16
SMALL = 0.25  # θ² below which sin θ/θ and (1 − cos θ)/θ² are summed: eight terms leave 1e-16
SMALL_SINE = 0.01  # sin²(θ/2) below which the angle over its sine is summed: eight terms leave 1e-17

# 1/(2k + 1)!, 1/(2k + 2)! with alternating signs, and the coefficients of arcsin(x)/x in x²
SINE = [1.0, -1 / 6, 1 / 120, -1 / 5040, 1 / 362880, -1 / 39916800, 1 / 6227020800, -1 / 1307674368000]
COSINE = [1 / 2, -1 / 24, 1 / 720, -1 / 40320, 1 / 3628800, -1 / 479001600, 1 / 87178291200, -1 / 20922789888000]
ARCSINE = [1.0, 1 / 6, 3 / 40, 15 / 336, 105 / 3456, 945 / 42240, 10395 / 599040, 135135 / 9676800]


# ---- lines ----------------------------------------------------------------------------------------------------


class Perpendicular(NamedTuple):
    """What two lines have in common.

    line: n̂, its direction that of u × v; angle: θ̂ = θ + ε s about it, θ in [0, π] rad, s along it, m; feet: the
    points (x, y, z) on both lines, m.
    """

    line: Vector3
    angle: Number
    feet: tuple[Vector3, Vector3]


def line(point: Vector3, direction: Vector3) -> Vector3:
    """The line through a point along a direction of any length: u + ε p × u.  [P 1: V̂ = v + ε w]

    point: m; the moment w = p × u is that about the origin. NaN where the direction is 0.
    """
    u = unit(direction)
    return spatial_vector(u, cross(point, u))


def reciprocal(first: Vector3, second: Vector3) -> Number:
    """u₁ · m₂ + m₁ · u₂, the dual part of the scalar product: of two lines −s sin θ, of wrench and twist the power, W,
    F · v + M · ω about any common origin."""
    return parts(dot(first, second))[1]


def angle_about(axis: Vector3, first: Vector3, second: Vector3) -> Number:
    """Dual angle θ + ε s from one line to another about a common perpendicular.  [P 2]

    θ in (−π, π] rad, counterclockwise about the axis; s along it, m. The axis meets both lines at right angles.
    """
    sine, cosine = dot(axis, cross(first, second)), dot(first, second)
    return namespace(sine, cosine).arctan2(sine, cosine)


def dual_angle(first: Vector3, second: Vector3) -> Number:
    """Dual angle θ̂ = θ + ε s of two lines, θ in [0, π] rad about their own perpendicular from 1 to 2.  [P 2]"""
    return perpendicular(first, second).angle


def perpendicular(first: Vector3, second: Vector3) -> Perpendicular:
    """Common perpendicular, dual angle and feet of two lines; NaN where these are parallel, |sin θ| < `PARALLEL`."""
    across = cross(first, second)
    with np.errstate(divide="ignore", invalid="ignore"):
        x, y, z = (primal(entry) for entry in across)
        gone = np.where(np.sqrt(x * x + y * y + z * z) < PARALLEL, np.nan, 1.0)
        n = scaled(gone, unit(across))
        sine, cosine = dot(n, across), dot(first, second)
        (u, m), (v, k), (normal, moment) = (vector_parts(each) for each in (first, second, n))
    feet = _meeting(u, m, normal, moment), _meeting(v, k, normal, moment)
    return Perpendicular(n, namespace(sine, cosine).arctan2(sine, cosine), feet)


def _meeting(u: Vector3, m: Vector3, n: Vector3, k: Vector3) -> Vector3:
    """Where the lines u + ε m and n + ε k meet at right angles: f × u = m and f × n = k."""
    return plus(cross(u, m), scaled(dot(k, cross(u, n)), u))


# ---- poses ----------------------------------------------------------------------------------------------------


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


def adjoint(a: Matrix3) -> list[list[Number]]:
    """Six rows [R 0; [p]× R  R]: what a pose does to the parts (u, m) of a dual vector."""
    both = [[parts(entry) for entry in row] for row in a]
    upper = [[*(real for real, _ in row), 0.0, 0.0, 0.0] for row in both]
    lower = [[*(dual for _, dual in row), *(real for real, _ in row)] for row in both]
    return upper + lower


# ---- screws ---------------------------------------------------------------------------------------------------


def exp(screw: Vector3) -> Matrix3:
    """Pose I + (sin θ̂/θ̂) [v̂]× + ((1 − cos θ̂)/θ̂²) [v̂]×² of a screw v̂ = θ̂ û.

    Both factors are functions of θ̂² = v̂ · v̂ without a singularity, summed near 0. [v̂]×² = v̂ v̂ᵀ − θ̂² I.
    """
    square = dot(screw, screw)
    xp, near = namespace(square), np.less(primal(square), SMALL)
    angle = xp.sqrt(xp.where(near, 1.0, square))  # 1: any value that has a root; the sum is taken there
    half, few = xp.sin(0.5 * angle) / angle, xp.where(near, square, 0.0)
    a = xp.where(near, _sum(SINE, few), xp.sin(angle) / angle)
    b = xp.where(near, _sum(COSINE, few), 2 * half * half)
    x, y, z = screw
    xy, yz, zx = b * (x * y), b * (y * z), b * (z * x)
    diagonal = 1 - b * square
    return (
        (diagonal + b * (x * x), xy - a * z, zx + a * y),
        (xy + a * z, diagonal + b * (y * y), yz - a * x),
        (zx - a * y, yz + a * x, diagonal + b * (z * z)),
    )


def log(pose: Matrix3) -> Vector3:
    """Screw θ̂ û of a pose, θ in [0, π] rad; at π, where ± û are the same pose, one of the two.

    By the unit quaternion (cos θ̂/2, sin θ̂/2 û): of its four formulas that with the largest divisor. Near θ = 0 the
    angle over its sine is summed.
    """
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = pose
    rows = (
        (1 + xx + yy + zz, zy - yz, xz - zx, yx - xy),
        (zy - yz, 1 + xx - yy - zz, yx + xy, xz + zx),
        (xz - zx, yx + xy, 1 - xx + yy - zz, zy + yz),
        (yx - xy, xz + zx, zy + yz, 1 - xx - yy + zz),
    )
    scalar, vector, largest = rows[0][0], rows[0][1:], rows[0][0]
    for k in (1, 2, 3):
        larger = np.greater(primal(rows[k][k]), primal(largest))
        xp = namespace(*rows[k], largest)
        scalar, largest = xp.where(larger, rows[k][0], scalar), xp.where(larger, rows[k][k], largest)
        vector = where(larger, rows[k][1:], vector)
    xp = namespace(scalar, *vector)
    sign = xp.where(np.less(primal(scalar), 0), -1.0, 1.0)
    scalar, vector = sign * scalar, scaled(sign, vector)
    square = dot(vector, vector)
    size = xp.sqrt(scalar * scalar + square)
    share = square / (size * size)
    near = np.less(primal(share), SMALL_SINE)
    sine = xp.sqrt(xp.where(near, 1.0, square))
    few = xp.where(near, share, 0.0)
    return scaled(2 * xp.where(near, _sum(ARCSINE, few) / size, xp.arctan2(sine, scalar) / sine), vector)


def _sum(coefficients: list[float], x: Number) -> Number:
    total: Number = coefficients[-1]
    for coefficient in reversed(coefficients[:-1]):
        total = coefficient + x * total
    return total
