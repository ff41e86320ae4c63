"""Joints with play: where the pin can lie in its hole, where its load presses it, and how that moves the pair's frame.

The pin-hole pair of [P 11-14]: the pin is on the first link of a joint, the hole on the second. In the hole's frame
(z its axis, origin at mid-length) the pin's axis passes the ends z = −H/2 and z = +H/2 at the offsets c₁ and c₂,
|cᵢ| ≤ ρ = R − r:

    u = (c₂ − c₁, H)/L,  L = hypot(H, |c₂ − c₁|),  midpoint (c₁ + c₂)/2,  Â: hole's frame → pin's frame

These are the unknowns; [P]'s angles β and ξ describe them: the directions of c₁ and c₂ are ξ + β/2 and ξ − β/2 [P
12, 13]. No formula has a seam or an arc cosine: the shift is exact to rounding for any offsets, β = 0 and β = π
included.

A play is a list of ends; at each the offset fills a disc (an interval, a ball) of some radius. The work of a load on
a small shift is Σ Qᵢ · cᵢ with the load Qᵢ at each end, so the seat under a load is cᵢ = ρᵢ Qᵢ/|Qᵢ|, and the most
that the play can do is Σ ρᵢ |Qᵢ|. In the plane β = 0. A guide has two ends across its slide, a ball one end of three
components.

[P] E. Pezzuti et al., Int. J. Numer. Meth. Eng. 65 (2006) 1735-1748, doi:10.1002/nme.1504.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from trunnion.algebra import plane
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.space import Frame
from trunnion.algebra.vector import IDENTITY, Vector3, cross, dot, minus, scaled
from trunnion.joints.contact_loads import length_of

Vector = tuple[Number, ...]  # of as many components as its end has
Offsets = Sequence[Vector]  # one vector for each end


@dataclass(frozen=True)
class ClearanceModel:
    """The play of one kind of pair.

    ends: for each end the names of its components, "end.axis" in the hole's frame. axial: which ends are held by the
    end float alone, not by the radial clearance. loads: `(force, moment, length)` → load at each end, from the force
    (N) and the moment (N m) about mid-length of the pin on the hole, in the hole's frame; shift: `(offsets, length)`
    → the pin's frame in the hole's, a `Frame` of `algebra.space` or `algebra.plane`; size: the part and its key whose
    number is the length H; turns: whether the pair does nothing but turn, so that a seat that stays on the link of the
    pin is another than one that stays on that of the hole.
    """

    ends: tuple[tuple[str, ...], ...]
    loads: Callable[[Vector, Vector, Number], list[Vector]]
    shift: Callable[[Offsets, Number], Any]
    size: tuple[str, tuple[str, ...]] | None = None
    axial: tuple[int, ...] = ()
    turns: bool = False

    def offsets(self, values: Mapping[str, Number], path: str) -> list[Vector] | None:
        """The offsets that stand under a path (`path.1.x` …); None if there are none."""
        if not any(f"{path}.{key}" in values for end in self.ends for key in end):
            return None
        return [tuple(values.get(f"{path}.{key}", 0.0) for key in end) for end in self.ends]

    def paths(self, path: str, offsets: Offsets) -> dict[str, Number]:
        """The offsets by path."""
        return {
            f"{path}.{key}": number
            for end, vector in zip(self.ends, offsets, strict=True)
            for key, number in zip(end, vector, strict=True)
        }


# ---- shifts ---------------------------------------------------------------------------------------------------


def leaning(across: Vector, along: Number = 0.0, place: Vector = (0.0, 0.0)) -> Frame:
    """The frame whose z has the direction (across, 1), turned there from z by the shortest way, at `place` and z =
    along.

    R = I + [v]× + [v]×²/(1 + u_z) with v = z × u: no digit is lost however small the angle.
    """
    tx, ty = across
    xp = namespace(tx, ty)
    uz = 1 / xp.sqrt(1 + tx * tx + ty * ty)
    ux, uy = tx * uz, ty * uz
    share = 1 / (1 + uz)
    mixed = -(ux * uy * share)
    return Frame(
        (1 - ux * ux * share, mixed, -ux), (mixed, 1 - uy * uy * share, -uy), (ux, uy, uz), (place[0], place[1], along)
    )


def _pin_shift(offsets: Offsets, length: Number) -> Frame:
    """Â of the end-centre offsets, and of the end float if there is one."""
    (x1, y1), (x2, y2), *more = offsets
    along = more[0][0] if more else 0.0
    return leaning(((x2 - x1) / length, (y2 - y1) / length), along, (0.5 * (x1 + x2), 0.5 * (y1 + y2)))


def pin_transform(clearance: Number, length: Number, beta: Number, xi: Number) -> Frame:
    """Â of the pin-hole pair from [P]'s description, hole's frame → pin's frame.  [P 12-14]

    clearance ρ and length H, m; β, ξ, rad, broadcast. Same as Z(ξ) X(α̂) Z(−ξ) with tan α = (2ρ/H) sin(β/2) and
    d = ρ cos(β/2), and not by way of the end offsets: their difference has no digits left where β is small.
    """
    xp = namespace(clearance, length, beta, xi)
    c, s = xp.cos(xi), xp.sin(xi)
    slope, aside = 2 * clearance / length * xp.sin(0.5 * beta), clearance * xp.cos(0.5 * beta)
    return leaning((slope * s, -(slope * c)), 0.0, (aside * c, aside * s))


# ---- description ----------------------------------------------------------------------------------------------


def described(radius: Number, beta: Number, xi: Number) -> list[Vector]:
    """End offsets c₁ = ρ(cos(ξ + β/2), sin(ξ + β/2)), c₂ = ρ(cos(ξ − β/2), sin(ξ − β/2)), m.  [P 12, 13]"""
    xp = namespace(xi, beta)
    return [(radius * xp.cos(angle), radius * xp.sin(angle)) for angle in (xi + 0.5 * beta, xi - 0.5 * beta)]


def describing(first: Vector, second: Vector) -> tuple[Number, Number]:
    """β in (−π, π] and ξ in (−π, π] of two end offsets, rad; of pins that lie at their holes' walls [P 12, 13].

    β is the angle from c₂ to c₁; from c₂ × (c₁ − c₂), so that β near 0 keeps the digits of the offsets.
    """
    (x1, y1), (x2, y2) = first, second
    sine = x2 * (y1 - y2) - y2 * (x1 - x2)
    beta = np.arctan2(np.where(sine == 0, 0.0, sine), x1 * x2 + y1 * y2)  # −0 would make −π of π
    xi = np.arctan2(y2, x2) + 0.5 * beta
    return beta, np.where(xi > np.pi, xi - 2 * np.pi, np.where(xi <= -np.pi, xi + 2 * np.pi, xi))


def ellipse_error(clearance: Number, radius: Number, length: Number, beta: Number = np.pi) -> Number:
    """How far taking the ends' projected circles for circles errs, as a share of the clearance: (2rρ/H²) sin⁴(β/2)."""
    sine = np.sin(0.5 * beta)
    return 2 * (radius / length) * (clearance / length) * sine**4  # the square of a tiny length would be 0


# ---- loads ----------------------------------------------------------------------------------------------------


def _pin_loads(force: Vector, moment: Vector, length: Number) -> list[Vector]:
    """Q₁,₂ = F/2 ∓ g with g = (M_y, −M_x)/H: what the pin presses on the ends of its hole."""
    gx, gy = moment[1] / length, -(moment[0] / length)
    hx, hy = 0.5 * force[0], 0.5 * force[1]
    return [(hx - gx, hy - gy), (hx + gx, hy + gy)]


def pressed(load: Vector, radius: Number, least: Number = 0.0) -> Vector:
    """Where a load presses the pin at one end: c = ρ Q/|Q|, m; the maximiser of Q · c over |c| ≤ ρ.

    least: load, N, below which the seat goes straight through the middle instead of jumping, c = ρ Q/least.
    """
    square: Number = sum((part * part for part in load), 0.0)
    xp = namespace(square)
    square = xp.where(square > least * least, square, least * least)
    positive = square > 0
    share = xp.where(positive, radius / xp.sqrt(xp.where(positive, square, 1.0)), 0.0)
    return tuple(share * part for part in load)


def worst_case(loads: Sequence[Vector], radii: Sequence[Number]) -> Number:
    """Most work of the loads over the whole play: Σ ρᵢ |Qᵢ|, in their unit times m."""
    return sum((radius * length_of(*load) for load, radius in zip(loads, radii, strict=True)), 0.0)


# ---- friction -------------------------------------------------------------------------------------------------


def turned_by_friction(load: Vector, friction: Number, spin: Vector) -> Vector:
    """The normal part of a load on the hole that friction shares: the seat's direction, of the length of the load.

    friction: friction force against the slip over normal force; spin: angular velocity of the hole against the pin
    in the hole's frame, about z of a pin (ω,), a vector of a ball; only its direction counts, and with spin 0
    nothing turns. With Q = N (n − μ t), t the direction in which the hole slips at the contact n: n is Q turned by
    atan μ along t.
    """
    if len(load) == 2:
        slope = friction * namespace(spin[-1]).sign(spin[-1])
        share = 1 / namespace(slope).sqrt(1 + slope * slope)
        x, y = load
        return share * (x - slope * y), share * (y + slope * x)
    if len(load) == 3:
        return _turned_ball(load, friction, (spin[0], spin[1], spin[2]))
    return load


def _turned_ball(load: Vector, friction: Number, spin: Vector3) -> Vector3:
    """Of a ball: n = α a + √(1 − α²) p, a along the spin; Q⟂ is p turned back about a by atan(μ/√(1 − α²)).

    Where the load is within atan μ of the spin's axis the ball bears on its pole and does not slip there.
    """
    pull: Vector3 = (load[0], load[1], load[2])
    rate = dot(spin, spin)
    xp = namespace(rate, *load)
    spins = rate > 0
    scale = 1 / xp.sqrt(xp.where(spins, rate, 1.0))
    a = scaled(scale, spin)
    size = length_of(*load)
    normal = size / xp.sqrt(1 + friction * friction)
    along = dot(pull, a)
    flat = minus(pull, scaled(along, a))
    left = normal * normal - along * along  # N² (1 − α²)
    slips = (left > 0) & spins
    root = xp.sqrt(xp.where(slips, left, 1.0))
    # p ∥ Q⟂ + (μ/√(1 − α²)) a × Q⟂
    slope = friction * normal / root
    ahead = cross(a, flat)
    share = 1 / xp.sqrt(1 + slope * slope)
    turned = [share * (f + slope * g) for f, g in zip(flat, ahead, strict=True)]
    width = length_of(*flat)
    fit = root / xp.where(width > 0, width, 1.0)
    grown = size / xp.where(normal > 0, normal, 1.0)
    parts = [
        xp.where(slips, grown * (along * part + fit * q), xp.where(spins, size * xp.sign(along) * part, component))
        for part, q, component in zip(a, turned, load, strict=True)
    ]
    return parts[0], parts[1], parts[2]


# ---- the table ------------------------------------------------------------------------------------------------


def _guide_shift_in_plane(offsets: Offsets, length: Number) -> plane.Frame:
    (y1,), (y2,) = offsets
    slope = (y2 - y1) / length
    c = 1 / namespace(slope).sqrt(1 + slope * slope)
    return plane.Frame(0.0, 0.5 * (y1 + y2), c, slope * c)


PIN_ENDS = (("1.x", "1.y"), ("2.x", "2.y"))
PIN_LENGTH = ("pin", ("length", "bearing"))
GUIDE_LENGTH = ("guide", ("length",))
CLEARANCE_MODELS: dict[str, dict[str, ClearanceModel]] = {
    "planar": {
        "revolute": ClearanceModel(
            (("1.x", "1.y"),),
            lambda force, moment, length: [(force[0], force[1])],
            lambda offsets, length: plane.Frame(*offsets[0]),
            turns=True,
        ),
        "prismatic": ClearanceModel(
            (("1.y",), ("2.y",)),
            lambda force, moment, length: [(0.5 * force[1] + sign * moment[-1] / length,) for sign in (-1.0, 1.0)],
            _guide_shift_in_plane,
            GUIDE_LENGTH,
        ),
    },
    "spatial": {
        "revolute": ClearanceModel(
            (*PIN_ENDS, ("3.z",)),
            lambda force, moment, length: [*_pin_loads(force, moment, length), (force[2],)],
            _pin_shift,
            PIN_LENGTH,
            axial=(2,),
            turns=True,
        ),
        "cylindrical": ClearanceModel(PIN_ENDS, _pin_loads, _pin_shift, PIN_LENGTH),
        "prismatic": ClearanceModel(
            (("1.x",), ("1.y",), ("2.x",), ("2.y",)),
            lambda force, moment, length: [(part,) for end in _pin_loads(force, moment, length) for part in end],
            lambda offsets, length: _pin_shift([(*offsets[0], *offsets[1]), (*offsets[2], *offsets[3])], length),
            GUIDE_LENGTH,
        ),
        "spherical": ClearanceModel(
            (("1.x", "1.y", "1.z"),),
            lambda force, moment, length: [(force[0], force[1], force[2])],
            lambda offsets, length: Frame(*IDENTITY, (offsets[0][0], offsets[0][1], offsets[0][2])),
            turns=True,
        ),
    },
}
