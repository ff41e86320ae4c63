"""How the reaction of a spatial joint presses on its contact: bearings, balls, guides and threads.

A reaction is the flat tuple (F_x, F_y, F_z, M_x, M_y, M_z) of the wrench that the joint transmits, about the origin of
the global frame, N and N m. Every normal load here is a seminorm of it, as the certificate of `friction.Problem` asks.

A bearing of length L about the axis u carries the load F⊥, M⊥ across its axis, M⊥ about its middle:

    pezzuti       N = |F⊥| + 2 |M⊥|/L                                                  [P 15-19]
    two-contact   N = |Q₁| + |Q₂|,  Q₁,₂ = F⊥/2 ∓ g,  g = M⊥ × u/L                     [THEORY of the docs, "Friction"]

The second is exact for a load carried at both ends; the first is its bound by the triangle inequality.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.rigid import vector_minus
from trunnion.algebra.space import Vector3, cross, dot, plus, scaled
from trunnion.joints.pairs import Reaction

__all__ = ["BallLoad", "BearingLoad", "halves"]

NULL: Vector3 = (0.0, 0.0, 0.0)


def halves(reaction: Reaction) -> tuple[Vector3, Vector3]:
    """Force and moment of a reaction."""
    fx, fy, fz, mx, my, mz = reaction
    return (fx, fy, fz), (mx, my, mz)


def _length(a: Vector3) -> Number:
    """|a|; of a dual vector without a derivative where a is 0."""
    square = dot(a, a)
    xp = namespace(square)
    if xp is np:
        return np.sqrt(square)
    there = primal(square) > 0
    return xp.where(there, xp.sqrt(xp.where(there, square, 1.0)), 0.0)


def _along(a: Vector3, size: Number) -> Vector3:
    """a/|a|; 0 where a is."""
    return scaled(1 / namespace(size).where(primal(size) > 0, size, np.inf), a)


@dataclass(frozen=True)
class BallLoad:
    """A ball: N = |F|."""

    def normal(self, reaction: Reaction) -> Number:
        """N."""
        return _length(halves(reaction)[0])

    def gradient(self, reaction: Reaction, normal: Number) -> Reaction:
        """∂N/∂reaction."""
        return (*_along(halves(reaction)[0], normal), 0.0, 0.0, 0.0)

    def bound(self, reaction: Reaction) -> Number:
        """At least the most by which this reaction can change N."""
        return self.normal(reaction)

    def feels(self, reaction: Reaction) -> bool:
        """Whether N may depend on it."""
        return True

    def mapped(self, change: Callable[[Number], Number]) -> BallLoad:
        """The same: it has no numbers."""
        return self


@dataclass(frozen=True)
class BearingLoad:
    """A pin in its bearing, a slider in its guide, or a nut on its thread.

    axis: unit vector u; place: middle of the bearing, m; length: L, m. summed: [P]'s sum instead of the two contacts.
    width: of a guide, over which a pair of forces carries the torsion about it, N + 2 |M_u|/width; None of others.
    radius: mean radius of a thread, whose flanks also carry N + √(F_u² + (M_u/r)²); None of others.
    """

    axis: Vector3
    place: Vector3
    length: Number
    summed: bool = False
    width: Number | None = None
    radius: Number | None = None

    def _across(self, reaction: Reaction) -> tuple[Vector3, Vector3, Number, Number]:
        """F⊥ and g, and the components F_u and M_u along the axis."""
        force, moment = halves(reaction)
        moment = vector_minus(moment, cross(self.place, force))
        along = dot(force, self.axis)
        couple = scaled(1 / self.length, cross(moment, self.axis))
        return vector_minus(force, scaled(along, self.axis)), couple, along, dot(moment, self.axis)

    def normal(self, reaction: Reaction) -> Number:
        """N."""
        force, couple, along, torsion = self._across(reaction)
        if self.summed:
            found = _length(force) + 2 * _length(couple)
        else:
            half = scaled(0.5, force)
            found = _length(vector_minus(half, couple)) + _length(plus(half, couple))
        if self.width is not None:
            found = found + 2 * namespace(torsion).abs(torsion) / self.width
        if self.radius is not None:
            found = found + _length((along, torsion / self.radius, 0.0))
        return found

    def gradient(self, reaction: Reaction, normal: Number) -> Reaction:
        """∂N/∂reaction: by the directions of the contact forces, carried over to the origin."""
        force, couple, along, torsion = self._across(reaction)
        if self.summed:
            push, turn = _along(force, _length(force)), scaled(2.0, _along(couple, _length(couple)))
        else:
            half = scaled(0.5, force)
            one, two = vector_minus(half, couple), plus(half, couple)
            one, two = _along(one, _length(one)), _along(two, _length(two))
            push, turn = scaled(0.5, plus(one, two)), vector_minus(two, one)
        moment = scaled(1 / self.length, cross(self.axis, turn))  # g = M × u/L, so t · dg = dM · (u × t)/L
        if self.width is not None:
            moment = plus(moment, scaled(2 * namespace(torsion).sign(torsion) / self.width, self.axis))
        if self.radius is not None:
            flank = _length((along, torsion / self.radius, 0.0))
            share = _along((along, torsion / self.radius, 0.0), flank)
            push = plus(push, scaled(share[0], self.axis))
            moment = plus(moment, scaled(share[1] / self.radius, self.axis))
        return (*vector_minus(push, cross(moment, self.place)), *moment)

    def bound(self, reaction: Reaction) -> Number:
        """At least the most by which this reaction can change N."""
        return self.normal(reaction)

    def feels(self, reaction: Reaction) -> bool:
        """Whether N may depend on it."""
        return True

    def mapped(self, change: Callable[[Number], Number]) -> BearingLoad:
        """The same with `change` applied to every number."""

        def each(a: Vector3) -> Vector3:
            return cast(Vector3, tuple(change(n) for n in a))

        return replace(
            self,
            axis=each(self.axis),
            place=each(self.place),
            length=change(self.length),
            width=None if self.width is None else change(self.width),
            radius=None if self.radius is None else change(self.radius),
        )
