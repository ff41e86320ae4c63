"""Screws as dual vectors v̂ = θ̂ û, û a line and θ̂ = θ + ε s: a turn θ about it and a slide s along it.

The same six numbers are a twist ω + ε v (v of the point at the origin) and a wrench F + ε M (M about the origin).
`exp` makes a screw a pose, `log` a pose the shortest screw. Written on dual numbers they are Rodrigues' formula and
its inverse, so with plain numbers they are those of rotations.
"""

from __future__ import annotations

from typing import cast

import numpy as np

from trunnion.algebra.dual import primal
from trunnion.algebra.line import reciprocal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.vector import Matrix3, Vector3, cross, dot, scaled, transpose, where

__all__ = ["bracket", "exp", "log", "power"]

SMALL = 0.25  # θ² below which sin θ/θ and (1 − cos θ)/θ² are summed: eight terms leave 1e-16
SMALL_SINE = 0.01  # sin²θ below which θ/sin θ is summed: eight terms leave 1e-17
OBTUSE = -0.5  # cos θ below which the axis is read from the symmetric part of the matrix

# 1/(2k + 1)!, 1/(2k + 2)! with alternating signs, and the coefficients of arcsin(x)/x in x²
SINE = [1.0, -1 / 6, 1 / 120, -1 / 5040, 1 / 362880, -1 / 39916800, 1 / 6227020800, -1 / 1307674368000]
COSINE = [1 / 2, -1 / 24, 1 / 720, -1 / 40320, 1 / 3628800, -1 / 479001600, 1 / 87178291200, -1 / 20922789888000]
ARCSINE = [1.0, 1 / 6, 3 / 40, 15 / 336, 105 / 3456, 945 / 42240, 10395 / 599040, 135135 / 9676800]


def exp(screw: Vector3) -> Matrix3:
    """Pose I + (sin θ̂/θ̂) [v̂]× + ((1 − cos θ̂)/θ̂²) [v̂]×² of a screw v̂ = θ̂ û.

    Both factors are functions of θ̂² = v̂ · v̂ without a singularity, summed near 0. [v̂]×² = v̂ v̂ᵀ − θ̂² I.
    """
    square = dot(screw, screw)
    a, b = _rodrigues(square)
    x, y, z = screw
    xy, yz, zx = b * (x * y), b * (y * z), b * (z * x)
    diagonal = 1 - b * square
    return (
        (diagonal + b * (x * x), xy - a * z, zx + a * y),
        (xy + a * z, diagonal + b * (y * y), yz - a * x),
        (zx - a * y, yz + a * x, diagonal + b * (z * z)),
    )


def _rodrigues(square: Number) -> tuple[Number, Number]:
    """sin θ/θ and (1 − cos θ)/θ² of θ²."""
    xp = namespace(square)
    near = np.less(primal(square), SMALL)
    angle = xp.sqrt(xp.where(near, 1.0, square))  # 1: any value that has a root; the sum is taken there
    half = xp.sin(0.5 * angle) / angle
    few = xp.where(near, square, 0.0)
    return (
        xp.where(near, _sum(SINE, few), xp.sin(angle) / angle),
        xp.where(near, _sum(COSINE, few), 2 * half * half),
    )


def _sum(coefficients: list[float], x: Number) -> Number:
    total: Number = coefficients[-1]
    for coefficient in reversed(coefficients[:-1]):
        total = coefficient + x * total
    return total


def log(pose: Matrix3) -> Vector3:
    """Screw θ̂ û of a pose, θ in [0, π] rad; at π, where ± û are the same pose, one of the two.

    Half the skew part of Â holds sin θ̂ û and (trace − 1)/2 is cos θ̂. Near θ = 0 the factor θ̂/sin θ̂ is summed; beyond
    120° the axis is the largest column of the symmetric part, cos θ̂ I + (1 − cos θ̂) û ûᵀ.
    """
    axis = (
        0.5 * (pose[2][1] - pose[1][2]),
        0.5 * (pose[0][2] - pose[2][0]),
        0.5 * (pose[1][0] - pose[0][1]),
    )
    cosine = 0.5 * (pose[0][0] + pose[1][1] + pose[2][2] - 1)
    obtuse = np.less(primal(cosine), OBTUSE)
    vector = scaled(_acute(axis, cosine, obtuse), axis)
    return where(obtuse, _obtuse(pose, axis, cosine, obtuse), vector) if np.any(obtuse) else vector


def _acute(axis: Vector3, cosine: Number, obtuse: Number) -> Number:
    """θ̂/sin θ̂ of sin θ̂ û and cos θ̂."""
    square = dot(axis, axis)
    xp = namespace(square, cosine)
    near = np.less(primal(square), SMALL_SINE) & ~obtuse
    few = xp.where(near, square, 0.0)
    sine = xp.sqrt(xp.where(near | np.equal(primal(square), 0), 1.0, square))
    return xp.where(near, _sum(ARCSINE, few), xp.arctan2(sine, cosine) / sine)


def _obtuse(pose: Matrix3, axis: Vector3, cosine: Number, obtuse: Number) -> Vector3:
    """Screw of a turn near π; in the other lanes anything finite."""
    xp = namespace(cosine, *axis)
    versine = xp.where(obtuse, 1 - cosine, 1.0)
    columns = [_axis_column(pose, k, cosine, versine) for k in range(3)]
    column, size = columns[0], columns[0][0]
    for k in (1, 2):
        longer = primal(columns[k][k]) > primal(size)
        column, size = where(longer, columns[k], column), xp.where(longer, columns[k][k], size)
    line = scaled(1 / xp.sqrt(xp.where(obtuse, size, 1.0)), column)
    sine = dot(axis, line)
    sense = np.where(primal(sine) < 0, -1.0, 1.0)
    return scaled(sense * xp.arctan2(sense * sine, cosine), line)


def _axis_column(pose: Matrix3, k: int, cosine: Number, versine: Number) -> Vector3:
    """Column k of û ûᵀ."""
    across = transpose(pose)
    entries = [0.5 * (pose[i][k] + across[i][k]) - (cosine if i == k else 0.0) for i in range(3)]
    return cast(Vector3, tuple(entry / versine for entry in entries))


def power(wrench: Vector3, twist: Vector3) -> Number:
    """F · v + M · ω, W, of a wrench F + ε M and a twist ω + ε v about the same origin."""
    return reciprocal(wrench, twist)


def bracket(first: Vector3, second: Vector3) -> Vector3:
    """Lie bracket v̂ × ŵ of two screws: the rate at which the second is carried round by the first."""
    return cross(first, second)
