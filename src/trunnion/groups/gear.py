"""Gear pairs: a constant ratio between the coordinates of two joints, φ₂ = i φ₁ + φ₀.

Where the two joints share a link, the carrier, the other two links are the gears. They touch at the pitch point,
where their velocities agree, and press on each other there: F = f n across the line of centres, and a force |f| tan α
along it that the inclined flanks (pressure angle α) add, which pushes the gears apart and does no work. Without a
common link the pair stands for a whole train, which passes torques alone.

One of the joints may slide: i is then a length for one radian, or its inverse. A rack, chain or rope pulls along its
slide at the pitch point of the wheel; a screw passes a torque in the joint that turns, a force along that which slides.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from trunnion.algebra.literal import is_zero
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import Frame, Vector2, Wrench, about, times

# that a module is given for each gear pair, after its drive: ratio, phase, coordinate φ₁ to the nearest turn
NUMBERS = 3


class GearPair(NamedTuple):
    """A gear pair of a module: its two joints, for each the side of its carrier (0, 1) if they touch on one, and which
    of the two (0, 1) slides, None if both turn."""

    first: int
    second: int
    carriers: tuple[int, int] | None = None
    slide: int | None = None

    @property
    def joints(self) -> tuple[tuple[int, bool], tuple[int, bool]]:
        """Both joints, each with whether it slides."""
        return (self.first, self.slide == 0), (self.second, self.slide == 1)


class ToothForce(NamedTuple):
    """What a gear pair does to the link on one side of one of its joints: a wrench about the origin."""

    joint: int
    side: int
    wrench: Wrench


class Mesh(NamedTuple):
    """Where two gears touch: pitch point; unit vectors along the line of centres and across it; f/λ, 1/m; whether
    the teeth push the second gear on along the line of centres (+1, external) or back (−1, internal)."""

    pitch: Vector2
    along: Vector2
    across: Vector2
    factor: Number
    apart: Number


def rotation(pair: Sequence[Frame]) -> Number:
    """Rotation of the second element against the first, within half a turn."""
    return turn_from(pair[0], pair[1], 0.0)


def slide_of(pair: Sequence[Frame]) -> Number:
    """Slide of the second element along the axis of the first, m."""
    first, second = pair[:2]
    return first.c * (second.x - first.x) + first.s * (second.y - first.y)


def turn_from(first: Frame, second: Frame, less: Number) -> Number:
    """Rotation of the second element against the first less an angle, within half a turn."""
    c, s = first.c * second.c + first.s * second.s, first.c * second.s - first.s * second.c
    if not is_zero(less):
        xp = namespace(less)
        cos, sin = xp.cos(less), xp.sin(less)
        c, s = c * cos + s * sin, s * cos - c * sin
    return namespace(s, c).arctan2(s, c)


def mesh(gear: GearPair, elements: Sequence[Any], ratio: Number) -> Mesh:
    """Pitch point and directions of a gear pair with a carrier, from the elements of a module's joints (global).

    Seen from the carrier the gears turn at ω₁ and ω₂ = ρ ω₁; the point P = A + t (D − A) with t = ρ/(ρ − 1) has the
    same velocity on both. A torque λ in the second joint is a force f = ±λ (ρ − 1)/|AD| at P.
    """
    if gear.carriers is None:
        raise ValueError("a gear pair without a common link has no pitch point")
    first, two = (1.0 if side == 0 else -1.0 for side in gear.carriers)
    if gear.slide is not None:
        return _mesh_with_rack(gear, elements, first * two * (ratio if gear.slide == 1 else 1 / ratio), ratio)
    relative = first * two * ratio
    a, d = elements[gear.first][gear.carriers[0]], elements[gear.second][gear.carriers[1]]
    dx, dy = d.x - a.x, d.y - a.y
    xp = namespace(dx, dy)
    centres = xp.hypot(dx, dy)
    along = dx / centres, dy / centres
    share = relative / (relative - 1.0)
    pitch = a.x + share * dx, a.y + share * dy
    factor = two * (relative - 1.0) / centres
    return Mesh(pitch, along, (-along[1], along[0]), factor, -namespace(relative).sign(relative))


def _mesh_with_rack(gear: GearPair, elements: Sequence[Any], radius: Number, ratio: Number) -> Mesh:
    """Where a wheel touches a rack that slides by `radius` for one radian, both as the carrier sees them.

    Turned by ω, the point at r (u_y, −u_x) from the wheel's centre moves with r ω u along the slide u.
    """
    sides = gear.carriers or (0, 0)
    wheel, rack = (gear.first, gear.second) if gear.slide == 1 else (gear.second, gear.first)
    centre, axis = elements[wheel][sides[0 if gear.slide == 1 else 1]], elements[rack][0]
    towards = radius * axis.s, -radius * axis.c
    pitch = centre.x + towards[0], centre.y + towards[1]
    # from the first gear to the second
    from_wheel = namespace(radius).sign(radius) * (1.0 if gear.slide == 1 else -1.0)
    sense = 1.0 if sides[gear.slide or 0] == 0 else -1.0
    factor = sense if gear.slide == 1 else sense * ratio
    return Mesh(pitch, (from_wheel * axis.s, -from_wheel * axis.c), (axis.c, axis.s), factor, 1.0)


def actions(gear: GearPair, elements: Sequence[Any], ratio: Number, effort: Number) -> list[ToothForce]:
    """What the pair does to the links with an `effort` (N m or N) in its second joint, separating force apart."""
    if gear.carriers is not None:
        touch = mesh(gear, elements, ratio)
        force = effort * touch.factor
        return _on_gears(gear, about((force * touch.across[0], force * touch.across[1]), 0.0, touch.pitch))
    first, second = gear.joints
    return [
        ToothForce(joint, side, _effort(elements[joint], slides, sign * size))
        for (joint, slides), size in ((second, effort), (first, -ratio * effort))
        for side, sign in ((1, 1.0), (0, -1.0))
    ]


def _effort(pair: Sequence[Frame], slides: bool, size: Number) -> Wrench:
    """A torque, N m, or a force along the slide of a joint, N."""
    if not slides:
        return Wrench(0.0, 0.0, size)
    first, second = pair[:2]
    return about((size * first.c, size * first.s), 0.0, (second.x, second.y))


def thread_forces(gear: GearPair, elements: Sequence[Any], torque: Number, force: Number) -> list[ToothForce]:
    """What a torque, N m, in the joint of a screw that turns and a force, N, in that which slides do to the links."""
    return [
        ToothForce(joint, side, _effort(elements[joint], slides, sign * (force if slides else torque)))
        for joint, slides in gear.joints
        for side, sign in ((1, 1.0), (0, -1.0))
    ]


def apart(gear: GearPair, touch: Mesh, size: Number) -> list[ToothForce]:
    """What a separating force of `size` (N) does to the gears."""
    push = size * touch.apart
    return _on_gears(gear, about((push * touch.along[0], push * touch.along[1]), 0.0, touch.pitch))


def _on_gears(gear: GearPair, push: Wrench) -> list[ToothForce]:
    """A force on the second gear, and its opposite on the first."""
    first, two = (1 - side for side in gear.carriers or (0, 0))
    return [ToothForce(gear.second, two, push), ToothForce(gear.first, first, times(-1.0, push))]
