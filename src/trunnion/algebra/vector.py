"""Vectors and matrices of three numbers, each written once: of plain numbers directions, of dual numbers lines.

A vector is (x, y, z), a matrix three rows of three; every entry broadcasts over the whole batch. With dual entries
a unit vector is a line, an orthogonal matrix a pose, and the product of two is one pose after the other: nothing
here tells the two apart.  [P 1, 5, 7]
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

from trunnion.algebra import literal
from trunnion.algebra.dual import parts, primal, spatial
from trunnion.algebra.namespace import Number, namespace

Vector3 = tuple[Number, Number, Number]
Matrix3 = tuple[Vector3, Vector3, Vector3]

IDENTITY: Matrix3 = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def dot(a: Vector3, b: Vector3) -> Number:
    """a · b; of two lines û · v̂ = cos θ̂."""
    return literal.plus(literal.plus(literal.times(a[0], b[0]), literal.times(a[1], b[1])), literal.times(a[2], b[2]))


def cross(a: Vector3, b: Vector3) -> Vector3:
    """a × b; of two lines û × v̂ = sin θ̂ n̂, n̂ their common perpendicular."""
    return (
        literal.less(literal.times(a[1], b[2]), literal.times(a[2], b[1])),
        literal.less(literal.times(a[2], b[0]), literal.times(a[0], b[2])),
        literal.less(literal.times(a[0], b[1]), literal.times(a[1], b[0])),
    )


def plus(a: Vector3, b: Vector3) -> Vector3:
    """a + b."""
    return literal.plus(a[0], b[0]), literal.plus(a[1], b[1]), literal.plus(a[2], b[2])


def minus(a: Vector3, b: Vector3) -> Vector3:
    """a − b."""
    return literal.less(a[0], b[0]), literal.less(a[1], b[1]), literal.less(a[2], b[2])


def scaled(factor: Number, a: Vector3) -> Vector3:
    """factor · a."""
    return literal.times(factor, a[0]), literal.times(factor, a[1]), literal.times(factor, a[2])


def length(a: Vector3) -> Number:
    """|a|; of dual vectors √(â · â), NaN where the real part of a is 0."""
    xp = namespace(*a)
    return xp.sqrt(dot(a, a))


def unit(a: Vector3) -> Vector3:
    """a/|a|; NaN where a (its real part) is 0. Of a dual vector: the line of the screw, whatever its pitch."""
    size = length(a)
    xp = namespace(size)
    return divided(a, xp.where(primal(size) == 0, float("nan"), size))


def divided(a: Vector3, divisor: Number) -> Vector3:
    """a/divisor; NaN in every component where the divisor is NaN, literal zeros included."""
    factor = 1 / divisor
    return factor * a[0], factor * a[1], factor * a[2]


def where(condition: Number, a: Vector3, b: Vector3) -> Vector3:
    """a in the lanes where the condition holds, b in the others."""
    xp = namespace(*a, *b)
    return cast(Vector3, tuple(xp.where(condition, x, y) for x, y in zip(a, b, strict=True)))


def spatial_vector(real: Vector3, moment: Vector3) -> Vector3:
    """real + ε moment."""
    return spatial(real[0], moment[0]), spatial(real[1], moment[1]), spatial(real[2], moment[2])


def vector_parts(a: Vector3) -> tuple[Vector3, Vector3]:
    """Real part and moment of a dual vector, each with the derivatives it carries."""
    (x, mx), (y, my), (z, mz) = (parts(entry) for entry in a)
    return (x, y, z), (mx, my, mz)


def skew(a: Vector3) -> Matrix3:
    """[a]×, so that [a]× b = a × b.  [P 6]"""
    x, y, z = a
    return (0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)


def transpose(a: Matrix3) -> Matrix3:
    """Aᵀ; of a pose its inverse."""
    return cast(Matrix3, tuple(zip(*a, strict=True)))


def apply(a: Matrix3, v: Vector3) -> Vector3:
    """A v; of a pose and a line: the line given in the moved frame, in the frame it was moved from."""
    return dot(a[0], v), dot(a[1], v), dot(a[2], v)


def product(first: Matrix3, *others: Matrix3) -> Matrix3:
    """A B …; of poses one after the other, each in the frame reached so far."""
    matrix = first
    for other in others:
        columns = transpose(other)
        matrix = cast(Matrix3, tuple(_row(row, columns) for row in matrix))
    return matrix


def _row(row: Vector3, columns: Sequence[Vector3]) -> Vector3:
    return dot(row, columns[0]), dot(row, columns[1]), dot(row, columns[2])
