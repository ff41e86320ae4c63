"""The spherical group with three revolute pairs, in closed form; on lines and dual angles it is the group CCC.

    h --B-- i --C-- j --D-- k        h, k: known links; i, j: the group; b̂, ĉ, d̂: axes of the joints

With directions and plain angles the axes meet in one point and the joints turn: a spherical linkage. With lines
and dual angles (twist α + ε distance a) they are cylindrical and the linkage is spatial: the principle of
transference. Nothing in a kernel tells the two apart. [THEORY of the docs, "Dual algebra"; I. S. Fischer, Dual-Number
Methods in Kinematics, Statics and Dynamics, CRC Press 1998]

Where the axes b, d are parallel, so also in a planar linkage, there is no value: NaN. Pairs whose slide is
prescribed are not free in this sense and need the general group.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from trunnion.algebra.dual import parts, primal
from trunnion.algebra.lines import link, turn_x
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.vector import Vector3, apply, cross, dot, length, plus, product, scaled, transpose
from trunnion.groups.dyad import root

BRANCHES = (1, -1)


class Loop(NamedTuple):
    """Joint angles θ̂₁..₄ = θ + ε s of a closed chain of four, θ in (−π, π] rad and s in m; axes: b̂, ĉ, d̂."""

    angles: tuple[Number, Number, Number, Number]
    axes: tuple[Vector3, Vector3, Vector3]


def meet(b: Vector3, d: Vector3, bc: Number, cd: Number, branch: int) -> Vector3:
    """Axis ĉ at the dual angles bc from b̂ and cd from d̂: ĉ · b̂ = cos bc, ĉ · d̂ = cos cd.

    branch: sign of ĉ · (b̂ × d̂); the other one is the mirror image in the plane of b and d. With γ the angle
    of b and d and σ = ½(bc + cd + γ), half-angle formulas of the spherical triangle of sides bc, cd, γ give the angle
    B at b:
        sin bc sin γ cos B = sin σ sin(σ − cd) − sin(σ − bc) sin(σ − γ)
        sin bc sin γ sin B = 2 √(sin σ sin(σ − bc) sin(σ − cd) sin(σ − γ))
    They keep their digits where all three angles are small. NaN where the triangle does not close, where b and d are
    parallel, and at a dead centre, where it closes flat, for dual angles.
    """
    across = cross(b, d)
    sine = _nonzero(length(across))
    xp = namespace(sine, bc, cd)
    gamma = xp.arctan2(sine, dot(b, d))
    half = 0.5 * (bc + cd + gamma)
    outer = xp.sin(half) * xp.sin(half - cd)
    inner = xp.sin(half - bc) * xp.sin(half - gamma)
    with np.errstate(invalid="ignore"):
        height = branch * 2 * root(outer * inner, outer * outer + inner * inner) / sine
    normal = scaled(1 / sine, across)
    level = scaled((outer - inner) / sine, cross(normal, b))
    return plus(plus(scaled(xp.cos(bc), b), level), scaled(height, normal))


def position(first: Number, twists: Sequence[Number], branch: int) -> Loop:
    """Joint angles of the loop Z(θ̂₁) X(α̂₁) Z(θ̂₂) X(α̂₂) Z(θ̂₃) X(α̂₃) Z(θ̂₄) X(α̂₄) = I with θ̂₁ given.

    twists: α̂₁..₄ = twist + ε distance of the links 12, 23, 34, 41; rad, m. Joint 1 is at home in the frame of the
    loop, so b̂ = Z(θ̂₁) X(α̂₁) ẑ and d̂ = X(α̂₄)ᵀ ẑ. A turn θ̂ is read from an axis seen in the frame before it:
    Z(θ̂) X(α̂) ẑ = (sin θ̂ sin α̂, −cos θ̂ sin α̂, cos α̂).
    branch: sign of −sin α₂ sin θ₃ sin α₃. NaN where sin α₂ or sin α₃ is 0.
    """
    axis: Vector3 = (0.0, 0.0, 1.0)
    before = link(first, twists[0])
    home = turn_x(twists[3])
    b, d = apply(before, axis), apply(transpose(home), axis)
    c = meet(b, d, twists[1], twists[2], branch)
    second = _turn(apply(transpose(before), c), twists[1])
    third = _turn(apply(transpose(product(before, link(second, twists[1]))), d), twists[2])
    x, y, z = apply(home, c)  # Z(θ̂₄)ᵀ X(α̂₃)ᵀ ẑ = (sin θ̂₄ sin α̂₃, cos θ̂₄ sin α̂₃, cos α̂₃)
    return Loop((first, second, third, _turn((x, -y, z), twists[2])), (b, c, d))


def _turn(axis: Vector3, twist: Number) -> Number:
    """θ̂ of Z(θ̂) X(α̂) ẑ."""
    sine = _nonzero(namespace(twist).sin(twist))
    x, y = axis[0] / sine, -axis[1] / sine
    return namespace(x, y).arctan2(x, y)


def rates(axes: tuple[Vector3, Vector3, Vector3], twist: Vector3) -> Vector3:
    """Rates θ̂̇_B, θ̂̇_C, θ̂̇_D with θ̂̇_B b̂ + θ̂̇_C ĉ + θ̂̇_D d̂ = `twist`, that of k against h.

    By the adjugate: θ̂̇_B = twist · (ĉ × d̂)/(b̂ · ĉ × d̂) and so on round. In a closed chain of four with joint 1 driven
    the twist is −θ̂̇₁ ẑ₁. NaN at a dead centre, where the axes lie in one plane.
    """
    b, c, d = axes
    normals = cross(c, d), cross(d, b), cross(b, c)
    volume = _nonzero(dot(b, normals[0]))
    return dot(twist, normals[0]) / volume, dot(twist, normals[1]) / volume, dot(twist, normals[2]) / volume


def closure(loop: Loop, twists: Sequence[Number]) -> tuple[Number, Number]:
    """By how much a loop misses closing: the largest entry of the product less I, real and dual part; rad, m."""
    closed = product(*(link(angle, twist) for angle, twist in zip(loop.angles, twists, strict=True)))
    gaps = [parts(entry - (1.0 if i == j else 0.0)) for i, row in enumerate(closed) for j, entry in enumerate(row)]
    real, dual = (np.broadcast_arrays(*map(primal, half)) for half in zip(*gaps, strict=True))
    return np.max(np.abs(real), axis=0), np.max(np.abs(dual), axis=0)


def condition(axes: tuple[Vector3, Vector3, Vector3]) -> Number:
    """1/|b · c × d|, the reciprocal volume of the three directions: ∞ at a dead centre; real parts only."""
    b, c, d = axes
    volume = np.abs(primal(dot(b, cross(c, d))))
    with np.errstate(divide="ignore"):
        return 1.0 / volume


def _nonzero(number: Number) -> Number:
    """The number with NaN where it is 0, plain numbers included: there the group has no value."""
    return namespace(number).where(primal(number) == 0, np.nan, number)
