"""Lines as unit dual vectors û = u + ε p × u, and what two of them have in common.  [P 1, 2]

Two lines meet in the dual angle θ̂ = θ + ε s about their common perpendicular n̂:

    û · v̂ = cos θ̂ = cos θ − ε s sin θ,   û × v̂ = sin θ̂ n̂

so the angle is atan2(|û × v̂|, û · v̂), good at every angle. Parallel lines have a distance but no one common
perpendicular: they take a branch of their own. Lines are taken for parallel below |sin θ| = `PARALLEL`.
"""

from __future__ import annotations

from typing import NamedTuple, cast

import numpy as np

from trunnion.algebra.dual import Dual, parts, primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.vector import (
    Vector3,
    cross,
    divided,
    dot,
    plus,
    scaled,
    spatial_vector,
    unit,
    vector_parts,
    where,
)

__all__ = ["PARALLEL", "Perpendicular", "angle_about", "dual_angle", "foot", "line", "perpendicular", "reciprocal"]

PARALLEL = 1e-12  # the direction of the perpendicular then holds 4 digits: rounding of the cross product is 1e-16


class Perpendicular(NamedTuple):
    """What two lines have in common.

    line: n̂, its direction that of u × v, of parallel lines from the first to the second; angle: θ̂ = θ + ε s about it,
    θ in [0, π] rad, s along it, m; feet: the points (x, y, z) on both lines, m.
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


def foot(at: Vector3) -> Vector3:
    """Point of the line nearest to the origin, u × m; m."""
    u, m = vector_parts(at)
    return cross(u, m)


def reciprocal(first: Vector3, second: Vector3) -> Number:
    """u₁ · m₂ + m₁ · u₂, the dual part of the scalar product; of two lines −s sin θ, of wrench and twist the power."""
    return parts(dot(first, second))[1]


def angle_about(axis: Vector3, first: Vector3, second: Vector3) -> Number:
    """Dual angle θ + ε s from one line to another about a common perpendicular.  [P 2]

    θ in (−π, π] rad, counterclockwise about the axis; s along it, m. The axis meets both lines at right angles.
    """
    sine, cosine = dot(axis, cross(first, second)), dot(first, second)
    return namespace(sine, cosine).arctan2(sine, cosine)


def dual_angle(first: Vector3, second: Vector3) -> Number:
    """Dual angle θ̂ = θ + ε s of two lines, θ in [0, π] rad about their own perpendicular from 1 to 2.  [P 2]

    Parallel lines: θ = 0 or π and s their distance, m; derivatives of both are NaN there.
    """
    return perpendicular(first, second).angle


def perpendicular(first: Vector3, second: Vector3) -> Perpendicular:
    """Common perpendicular, dual angle and feet of two lines.

    Parallel lines: the perpendicular through the point of the first nearest to the origin; derivatives are NaN. The
    same line twice: the angle is 0 + ε 0 and the perpendicular NaN.
    """
    across = cross(first, second)
    alike = _size(across) < PARALLEL
    with np.errstate(divide="ignore", invalid="ignore"):
        crossed = _crossed(first, second, across)
        if not np.any(alike):
            return crossed
        parallel = _parallel(first, second)
    xp = namespace(crossed.angle, parallel.angle)
    return Perpendicular(
        where(alike, parallel.line, crossed.line),
        xp.where(alike, parallel.angle, crossed.angle),
        (where(alike, parallel.feet[0], crossed.feet[0]), where(alike, parallel.feet[1], crossed.feet[1])),
    )


def _crossed(first: Vector3, second: Vector3, across: Vector3) -> Perpendicular:
    """That of lines that are not parallel; across: û × v̂."""
    n = unit(across)
    sine, cosine = dot(n, across), dot(first, second)
    normal, moment = vector_parts(n)
    u, m = vector_parts(first)
    v, k = vector_parts(second)
    feet = _meeting(u, m, normal, moment), _meeting(v, k, normal, moment)
    return Perpendicular(n, namespace(sine, cosine).arctan2(sine, cosine), feet)


def _meeting(u: Vector3, m: Vector3, n: Vector3, k: Vector3) -> Vector3:
    """Where the lines u + ε m and n + ε k meet at right angles: f × u = m and f × n = k."""
    return plus(cross(u, m), scaled(dot(k, cross(u, n)), u))


def _parallel(first: Vector3, second: Vector3) -> Perpendicular:
    """That of parallel lines: there the dual part of û × v̂ is ± the step from the first line to the second."""
    u, v = (cast(Vector3, tuple(_value(entry) for entry in item)) for item in (first, second))
    sense = np.sign(primal(dot(u, v)))
    step = scaled(sense, vector_parts(cross(u, v))[1])
    distance = _size(step)
    base = foot(u)
    theta = np.where(sense > 0, 0.0, np.pi)
    common = line(base, divided(step, np.where(distance == 0, np.nan, distance)))
    feet = base, plus(base, step)
    depth = max(number.depth if isinstance(number, Dual) else 0 for number in (*first, *second))
    if depth == 0:
        return Perpendicular(vector_parts(common)[0], theta, feet)
    angle = _mark(Dual(theta, distance), depth)
    return Perpendicular(_marked(common, depth), angle, (_marked(feet[0], depth - 1), _marked(feet[1], depth - 1)))


def _size(a: Vector3) -> Number:
    """|a| of the values alone."""
    x, y, z = primal(a[0]), primal(a[1]), primal(a[2])
    return np.sqrt(x * x + y * y + z * z)


def _value(number: Number) -> Number:
    """The number with the ε of space alone."""
    while isinstance(number, Dual) and number.depth > 1:
        number = number.real
    return number


def _marked(a: Vector3, depth: int) -> Vector3:
    return _mark(a[0], depth), _mark(a[1], depth), _mark(a[2], depth)


def _mark(number: Number, depth: int) -> Number:
    """The number with NaN for its derivatives up to a depth."""
    while (number.depth if isinstance(number, Dual) else 0) < depth:
        number = Dual(number, np.nan)
    return number
