"""How the reaction of a joint presses on its contact: pins, balls, bearings, guides and threads.

A reaction is the flat tuple (F_x, F_y, M), in space (F_x, F_y, F_z, M_x, M_y, M_z), of the wrench about the origin of
the global frame, N and N m. Every normal load here is a seminorm of it, as the certificate of
`friction.FrictionProblem.bound` asks.

A bearing of length L about the axis u carries the load F⊥, M⊥ across its axis, M⊥ about its middle:

    pezzuti       N = |F⊥| + 2 |M⊥|/L                                                  [P 15-19]
    two-contact   N = |Q₁| + |Q₂|,  Q₁,₂ = F⊥/2 ∓ g,  g = M⊥ × u/L                     [THEORY of the docs, "Friction"]

The second is exact for a load carried at both ends; the first is its bound by the triangle inequality.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np

from trunnion.algebra import plane
from trunnion.algebra.dual import primal
from trunnion.algebra.literal import is_zero
from trunnion.algebra.namespace import Number, each, namespace
from trunnion.algebra.space import Frame
from trunnion.algebra.vector import Vector3, cross, dot, minus

Reaction = tuple[Number, ...]


@dataclass(frozen=True)
class ContactLoad(ABC):
    """The normal load N ≥ 0, N, of a contact; all methods but `felt` take what that makes of the reaction."""

    def felt(self, reaction: Reaction) -> Reaction:
        """The components, linear in the reaction, that the normal load depends on."""
        return reaction

    @abstractmethod
    def normal(self, reaction: Reaction) -> Number:
        """N."""

    @abstractmethod
    def gradient(self, reaction: Reaction, normal: Number) -> Reaction:
        """∂N/∂reaction; zero where the load is. normal: N of this reaction, to save computing it again."""

    def bound(self, reaction: Reaction) -> Number:
        """At least the most by which this reaction, added to any other, can change N."""
        return self.normal(reaction)

    def feels(self, reaction: Reaction) -> bool:
        """Whether a change of the reaction by this one changes N at all."""
        return True

    def mapped(self, change: Callable[[Number], Number]) -> Self:
        """The same with `change` applied to every number."""
        entries = {entry.name: getattr(self, entry.name) for entry in fields(self)}
        numbers = {name: entry for name, entry in entries.items() if entry is not None and not isinstance(entry, bool)}
        return replace(self, **{name: each(number, change) for name, number in numbers.items()})


def halves(reaction: Reaction) -> tuple[Vector3, Vector3]:
    """Force and moment of a reaction in space."""
    fx, fy, fz, mx, my, mz = reaction
    return (fx, fy, fz), (mx, my, mz)


def length_of(*parts: Number) -> Number:
    """√Σ aᵢ²; of dual numbers without a derivative where all are 0."""
    square = parts[0] * parts[0]
    for part in parts[1:]:
        square = square + part * part
    xp = np if type(square) is np.ndarray else namespace(square)  # to ask which kind it is takes as long as a root
    if xp is np:
        return np.sqrt(square)
    positive = primal(square) > 0
    return xp.where(positive, xp.sqrt(xp.where(positive, square, 1.0)), 0.0)


def _shares(size: Number, *parts: Number) -> tuple[Number, ...]:
    """aᵢ/|a|; 0 where a is."""
    xp = np if type(size) is np.ndarray else namespace(size)
    factor = 1 / xp.where(primal(size) > 0, size, np.inf)
    return tuple([part * factor for part in parts])


class PinLoad(ContactLoad):
    """A pin of the plane, or a ball: N = |F|; it feels no moment.  [D 8]"""

    def felt(self, reaction: Reaction) -> Reaction:
        """The force: of three numbers two, of six three."""
        return reaction[: (len(reaction) + 1) // 2]

    def normal(self, reaction: Reaction) -> Number:
        """|F|."""
        return length_of(*reaction)

    def gradient(self, reaction: Reaction, normal: Number) -> Reaction:
        """F/|F|."""
        return _shares(normal, *reaction)

    def bound(self, reaction: Reaction) -> Number:
        """|F_x| + |F_y| in the plane."""
        return np.abs(reaction[0]) + np.abs(reaction[1]) if len(reaction) == 2 else length_of(*reaction)

    def feels(self, reaction: Reaction) -> bool:
        """Whether there is a force."""
        return not all(map(is_zero, reaction))


@dataclass(frozen=True)
class GuideLoad(ContactLoad):
    """A guide of a length L, m, loaded off its middle, carries on its two ends, as a bearing does in space:

    N = |F_n/2 + M/L| + |F_n/2 − M/L| = max(|F_n|, 2 |M|/L), F_n along the unit vector `across`, M about the middle.
    """

    across: tuple[Number, Number]
    length: Number
    middle: tuple[Number, Number] = (0.0, 0.0)

    def felt(self, reaction: Reaction) -> Reaction:
        """F_n and 2 M/L."""
        x, y, m = reaction
        moment = plane.moment_at(plane.Wrench(x, y, m), self.middle)
        return x * self.across[0] + y * self.across[1], moment * (2 / self.length)

    def normal(self, reaction: Reaction) -> Number:
        """The larger of both."""
        xp = namespace(*reaction)
        return xp.maximum(*map(xp.abs, reaction))

    def gradient(self, reaction: Reaction, normal: Number) -> Reaction:
        """By that which is larger."""
        push, couple = reaction
        xp = namespace(push, couple)
        larger = xp.abs(push) >= xp.abs(couple)
        return xp.where(larger, xp.sign(push), 0.0), xp.where(larger, 0.0, xp.sign(couple))


@dataclass(frozen=True)
class BearingLoad(ContactLoad):
    """A pin in its bearing, a slider in its guide, or a nut on its thread.

    frame: axes x, y across and z along the axis u, origin in the middle of the bearing; length: L, m. summed: [P]'s sum
    instead of the two contacts. width: of a guide, over which a pair of forces carries the torsion about it, which adds
    2 |M_u|/width; None of others. flank: of a thread, the secant of its angle of lead, whose flanks add flank |F_u|;
    None of others. By F_u alone: M_u may hold the torque of a drive, which the flanks do not carry.
    It feels F⊥, g in the axes x, y and, of a guide or thread, F_u and M_u.
    """

    frame: Frame
    length: Number
    summed: bool = False
    width: Number | None = None
    flank: Number | None = None

    def felt(self, reaction: Reaction) -> Reaction:
        """F_x, F_y, g_x = M_y/L, g_y = −M_x/L, then F_u and M_u if they count."""
        force, moment = halves(reaction)
        moment = minus(moment, cross(self.frame.place, force))
        x, y, z, _ = self.frame
        across = (dot(force, x), dot(force, y), dot(moment, y) / self.length, -(dot(moment, x) / self.length))
        return across if self.width is None and self.flank is None else (*across, dot(force, z), dot(moment, z))

    def normal(self, reaction: Reaction) -> Number:
        """N."""
        fx, fy, gx, gy, *more = reaction
        if self.summed:
            normal = length_of(fx, fy) + 2 * length_of(gx, gy)
        else:
            hx, hy = 0.5 * fx, 0.5 * fy
            normal = length_of(hx - gx, hy - gy) + length_of(hx + gx, hy + gy)
        if self.width is not None:
            normal = normal + 2 * namespace(more[1]).abs(more[1]) / self.width
        if self.flank is not None:
            normal = normal + self.flank * namespace(more[0]).abs(more[0])
        return normal

    def gradient(self, reaction: Reaction, normal: Number) -> Reaction:
        """∂N/∂ of what it feels: by the directions of the contact forces."""
        fx, fy, gx, gy, *more = reaction
        if self.summed:
            px, py = _shares(length_of(fx, fy), fx, fy)
            tx, ty = (2 * share for share in _shares(length_of(gx, gy), gx, gy))
        else:
            hx, hy = 0.5 * fx, 0.5 * fy
            mx, my, qx, qy = hx - gx, hy - gy, hx + gx, hy + gy
            ax, ay = _shares(length_of(mx, my), mx, my)
            bx, by = _shares(length_of(qx, qy), qx, qy)
            px, py, tx, ty = 0.5 * (ax + bx), 0.5 * (ay + by), bx - ax, by - ay
        if not more:
            return px, py, tx, ty
        torsion = 0.0 if self.width is None else 2 * namespace(more[1]).sign(more[1]) / self.width
        along = 0.0 if self.flank is None else self.flank * namespace(more[0]).sign(more[0])
        return px, py, tx, ty, along, torsion
