"""Gear pairs: a constant ratio between the rotations of two joints, φ₂ = i φ₁ + φ₀.

Where the two joints share a link, the carrier, the other two links are the gears. They touch at the pitch point,
where their velocities agree, and press on each other there: F = f n across the line of centres, and a force |f| tan α
along it that the inclined flanks (pressure angle α) add, which pushes the gears apart and does no work. Without a
common link the pair stands for a whole train, which passes torques alone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import Acceleration, Frame, Twist, Wrench, times

__all__ = ["NUMBERS", "ONE", "GearPair", "GearRow", "Mesh", "ToothForces", "actions", "apart", "mesh", "rotation"]

ONE = 1.0  # the factor that need not be multiplied by
NUMBERS = 3  # that a module is given for each gear pair, after its drive: ratio, phase, rotation φ₁ to the nearest turn
Pairs = Sequence[tuple[Frame, Frame]]


class GearPair(NamedTuple):
    """A gear pair of a module: its two joints, and for each the side of its carrier (0, 1), if they share one."""

    first: int
    second: int
    carriers: tuple[int, int] | None = None


class ToothForces(NamedTuple):
    """What a gear pair does to the link on one side of one of its joints, about a place (global, m)."""

    joint: int
    side: int
    wrench: Wrench
    at: Frame


class Mesh(NamedTuple):
    """Where two gears touch: pitch point; unit vectors along the line of centres and across it; f/λ, 1/m; whether
    the teeth push the second gear on along the line of centres (+1, external) or back (−1, internal)."""

    pitch: Frame
    along: tuple[Number, Number]
    across: tuple[Number, Number]
    factor: Number
    apart: Number


class GearRow(NamedTuple):
    """The constraint of a gear pair. slot: where its numbers stand in the drive; step: of φ₁ in the tree, −1 if not."""

    gear: GearPair
    slot: int
    step: int
    is_length: bool = False

    def terms(self, drive: Sequence[Number]) -> list[tuple[int, Number]]:
        """Joints whose relative motion opens it, with factors."""
        return [(self.gear.second, ONE), (self.gear.first, -drive[self.slot])]

    def gap(self, placed: Pairs, q: Sequence[Number], drive: Sequence[Number]) -> Number:
        """φ₂ − i φ₁ − φ₀, within half a turn."""
        ratio, phase, near = drive[self.slot : self.slot + NUMBERS]
        first = q[self.step] if self.step >= 0 else near + _turn(placed[self.gear.first], near)
        return _turn(placed[self.gear.second], ratio * first + phase)

    def entry(self, first: Frame, screw: Twist) -> Number:
        """Rate of a rotation for a relative motion."""
        return screw.w

    def rate(self, placed: Pairs, ends: Callable[[int], tuple[Twist, Twist]], drive: Sequence[Number]) -> Number:
        """Rate of the gap."""
        return self._difference(ends, drive)

    def second(
        self,
        placed: Pairs,
        ends: Callable[[int], tuple[Twist, Twist]],
        seconds: Callable[[int], tuple[Acceleration, Acceleration]],
        drive: Sequence[Number],
    ) -> Number:
        """Second derivative of the gap."""
        return self._difference(seconds, drive)

    def _difference(
        self, ends: Callable[[int], tuple[Twist | Acceleration, Twist | Acceleration]], drive: Sequence[Number]
    ) -> Number:
        total: Number = 0.0
        for joint, factor in self.terms(drive):
            one, two = ends(joint)
            total = total + factor * (two.w - one.w)
        return total


def rotation(pair: tuple[Frame, Frame]) -> Number:
    """Rotation of the second element against the first, within half a turn."""
    c, s = _direction(pair)
    return namespace(s, c).arctan2(s, c)


def _direction(pair: tuple[Frame, Frame]) -> tuple[Number, Number]:
    """Cosine and sine of the rotation of the second element against the first."""
    first, second = pair
    return first.c * second.c + first.s * second.s, first.c * second.s - first.s * second.c


def _turn(pair: tuple[Frame, Frame], less: Number) -> Number:
    """Rotation of the second element against the first less an angle, within half a turn."""
    c, s = _direction(pair)
    xp = namespace(less)
    cos, sin = xp.cos(less), xp.sin(less)
    c, s = c * cos + s * sin, s * cos - c * sin
    return namespace(s, c).arctan2(s, c)


def mesh(gear: GearPair, pairs: tuple[tuple[Frame, Frame], tuple[Frame, Frame]], ratio: Number) -> Mesh:
    """Pitch point and directions of a gear pair with a carrier, from the elements of its two joints (global).

    Seen from the carrier the gears turn at ω₁ and ω₂ = ρ ω₁; the point P = A + t (D − A) with t = ρ/(ρ − 1) has the
    same velocity on both. A torque λ in the second joint is a force f = ±λ (ρ − 1)/|AD| at P.
    """
    if gear.carriers is None:
        raise ValueError("a gear pair without a common link has no pitch point")
    one, two = (1.0 if side == 0 else -1.0 for side in gear.carriers)
    relative = one * two * ratio
    a, d = pairs[0][gear.carriers[0]], pairs[1][gear.carriers[1]]
    dx, dy = d.x - a.x, d.y - a.y
    xp = namespace(dx, dy)
    centres = xp.hypot(dx, dy)
    along = dx / centres, dy / centres
    share = relative / (relative - 1.0)
    pitch = Frame(a.x + share * dx, a.y + share * dy)
    factor = two * (relative - 1.0) / centres
    return Mesh(pitch, along, (-along[1], along[0]), factor, -namespace(relative).sign(relative))


def actions(gear: GearPair, placed: Pairs, ratio: Number, torque: Number) -> list[ToothForces]:
    """What the pair does to the links when it puts `torque` (N m) into its second joint, separating force apart."""
    pairs = placed[gear.first], placed[gear.second]
    if gear.carriers is not None:
        touch = mesh(gear, pairs, ratio)
        force = torque * touch.factor
        push = Wrench(force * touch.across[0], force * touch.across[1], 0.0)
        return _on_gears(gear, push, touch.pitch)
    found = []
    for joint, pair, moment in ((gear.second, pairs[1], torque), (gear.first, pairs[0], -ratio * torque)):
        found += [
            ToothForces(joint, side, Wrench(0.0, 0.0, s * moment), pair[side]) for side, s in ((1, 1.0), (0, -1.0))
        ]
    return found


def apart(gear: GearPair, touch: Mesh, size: Number) -> list[ToothForces]:
    """What a separating force of `size` (N) does to the gears."""
    push = Wrench(size * touch.apart * touch.along[0], size * touch.apart * touch.along[1], 0.0)
    return _on_gears(gear, push, touch.pitch)


def _on_gears(gear: GearPair, push: Wrench, at: Frame) -> list[ToothForces]:
    """A force on the second gear at the pitch point, and its opposite on the first."""
    one, two = (1 - side for side in gear.carriers or (0, 0))
    return [ToothForces(gear.second, two, push, at), ToothForces(gear.first, one, times(-1.0, push), at)]
