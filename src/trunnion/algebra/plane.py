"""The few planar quantities that pass between modules, and rigid-body motion of a point.

All entries are numbers of `algebra.namespace` that broadcast over (sample, position). SI units, global axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from trunnion.algebra import literal
from trunnion.algebra.dual import primal
from trunnion.algebra.literal import is_zero, less
from trunnion.algebra.namespace import Number, namespace

__all__ = [
    "NO_MOMENT",
    "NULL",
    "ORIGIN",
    "STILL",
    "ZERO_LOAD",
    "Acceleration",
    "Frame",
    "Twist",
    "Wrench",
    "about",
    "accelerated",
    "added",
    "along_slide",
    "both_ends",
    "compose",
    "load",
    "minus",
    "moved",
    "moving",
    "pinned",
    "point",
    "point_of",
    "power",
    "relative",
    "root",
    "rotated",
    "rotated_moment",
    "shifted",
    "spin",
    "times",
    "turned",
]


ROUNDING = 1e-15  # of the terms of a difference: a few units in the last place


class Frame(NamedTuple):
    """A pose: origin (x, y), m, and direction of the x axis (c, s) = (cos φ, sin φ).

    As an element of a joint: its point, and for a prismatic pair the direction of the slide.
    """

    x: Number
    y: Number
    c: Number = 1.0
    s: Number = 0.0

    def normalised(self) -> Frame:
        """With a direction of length one."""
        length = namespace(self.c, self.s).hypot(self.c, self.s)
        return Frame(self.x, self.y, self.c / length, self.s / length)


class Twist(NamedTuple):
    """Velocity of a point of a body (m/s) and the body's angular velocity w (rad/s)."""

    x: Number
    y: Number
    w: Number


class Acceleration(NamedTuple):
    """Acceleration of a point of a body (m/s²) and the body's angular acceleration w (rad/s²)."""

    x: Number
    y: Number
    w: Number


_Motion = TypeVar("_Motion", Twist, Acceleration)
Vector2 = tuple[Number, Number]


class Wrench(NamedTuple):
    """Force (N) and moment (N m) about a stated point."""

    x: Number
    y: Number
    m: Number


_Triple = TypeVar("_Triple", Twist, Wrench)
ZERO_LOAD = Wrench(0.0, 0.0, 0.0)
ORIGIN = Frame(0.0, 0.0, 1.0, 0.0)
NULL = (0.0, 0.0)
NO_MOMENT = 0.0
STILL = Twist(0.0, 0.0, 0.0), Acceleration(0.0, 0.0, 0.0)  # the motion of the ground


def turned(c: Number, s: Number, x: Number, y: Number) -> tuple[Number, Number]:
    """(x, y) turned by the angle whose cosine and sine are c, s."""
    if is_zero(y):
        return literal.times(c, x), literal.times(s, x)
    if is_zero(x):
        return -(s * y), c * y
    return c * x - s * y, s * x + c * y


def point(frame: Frame, x: Number, y: Number) -> tuple[Number, Number]:
    """Global place of the point with local coordinates (x, y)."""
    if is_zero(x) and is_zero(y):
        return frame.x, frame.y
    dx, dy = turned(frame.c, frame.s, x, y)
    return frame.x + dx, frame.y + dy


def point_of(frame: Frame, local: Vector2) -> Vector2:
    """Global place of a point given in a frame."""
    return point(frame, *local)


def rotated(frame: Frame, v: Vector2) -> Vector2:
    """A direction given in a frame."""
    return turned(frame.c, frame.s, *v)


def rotated_moment(frame: Frame, moment: Number) -> Number:
    """A moment given in a frame: the same in all."""
    return moment


def compose(frame: Frame, local: Frame) -> Frame:
    """Global frame of an element given in local coordinates of a link."""
    x, y = point(frame, local.x, local.y)
    c, s = turned(frame.c, frame.s, local.c, local.s)
    return Frame(x, y, c, s)


def relative(element: Frame, local: Frame) -> Frame:
    """Frame of the link whose element with the local frame `local` lies at the global frame `element`."""
    c, s = turned(element.c, element.s, local.c, -local.s)
    dx, dy = turned(c, s, local.x, local.y)
    return Frame(element.x - dx, element.y - dy, c, s)


def pinned(
    pin: Frame, local: Frame, reach: tuple[Number, Number], side: tuple[Number, Number], square: Number
) -> tuple[Frame, tuple[Number, Number]]:
    """Frame of a link whose pin (`local`) has a known place and whose side, `side` in local axes, lies along `reach`.

    square: squared length of the side, m². Also the vector from the frame's origin to the pin.
    """
    c, s = turned(side[0] / square, -side[1] / square, *reach)
    arm = turned(c, s, local.x, local.y)
    return Frame(pin.x - arm[0], pin.y - arm[1], c, s), arm


def both_ends(outer: Sequence[_Motion | None], group: str) -> tuple[_Motion, _Motion]:
    """Motion of the outer elements of a dyad, first and last of its joints; ValueError if one is not given."""
    first, _, last = outer
    if first is None or last is None:
        raise ValueError(f"the {group} group needs the motion of both its outer joints")
    return first, last


def root(square: Number, scale: Number) -> Number:
    """√square, where a dead centre makes it 0: what rounding leaves below 0, of the terms `scale`, counts as 0.

    Anything further below is NaN: there is no position.
    """
    xp = namespace(square, scale)
    return xp.sqrt(xp.where((square < 0) & (square > -ROUNDING * scale), 0.0, square))


def shifted(frame: Frame, direction: tuple[Number, Number], by: Number) -> Frame:
    """The frame moved along a direction."""
    return Frame(frame.x + by * direction[0], frame.y + by * direction[1], frame.c, frame.s)


def along_slide(
    carried: Acceleration, w: Number, direction: tuple[Number, Number], speed: Number, second: Number
) -> Acceleration:
    """Acceleration of a point that slides on a body turning at w: that of the body there, Coriolis, and its own."""
    coriolis = 2 * w * speed
    return Acceleration(
        carried.x - coriolis * direction[1] + second * direction[0],
        carried.y + coriolis * direction[0] + second * direction[1],
        carried.w,
    )


def moved(velocity: Twist, dx: Number, dy: Number) -> Twist:
    """Velocity of the point that lies (dx, dy) from the one given, on the same body."""
    if is_zero(dx) and is_zero(dy):
        return velocity
    return Twist(velocity.x - velocity.w * dy, velocity.y + velocity.w * dx, velocity.w)


def accelerated(acceleration: Acceleration, w: Number, dx: Number, dy: Number) -> Acceleration:
    """Acceleration of the point that lies (dx, dy) from the one given, on a body that turns at w."""
    if is_zero(dx) and is_zero(dy):
        return acceleration
    ww = w * w
    return Acceleration(
        acceleration.x - acceleration.w * dy - ww * dx,
        acceleration.y + acceleration.w * dx - ww * dy,
        acceleration.w,
    )


def moving(frame: Frame, twist: Twist, acceleration: Acceleration, local: Vector2) -> tuple[Vector2, Vector2, Vector2]:
    """Place, velocity and acceleration of the point of a moving frame with local coordinates."""
    place = point(frame, *local)
    arm = place[0] - frame.x, place[1] - frame.y
    return place, moved(twist, *arm)[:2], accelerated(acceleration, twist.w, *arm)[:2]


def spin(twist: Twist) -> Number:
    """Angular speed, rad/s; its real part."""
    return np.abs(primal(twist.w))


def about(wrench: Wrench, dx: Number, dy: Number) -> Wrench:
    """The wrench about the point that lies (dx, dy) from its present one."""
    if (is_zero(wrench.x) and is_zero(wrench.y)) or (is_zero(dx) and is_zero(dy)):  # a pure moment, or the same point
        return wrench
    return Wrench(wrench.x, wrench.y, wrench.m - (dx * wrench.y - dy * wrench.x))


def load(frame: Frame, force: Vector2, moment: Number, place: Vector2) -> Wrench:
    """What a force at a place and a moment do to the link with a frame: the wrench about its origin."""
    return about(Wrench(*force, moment), frame.x - place[0], frame.y - place[1])


def added(a: Wrench, b: Wrench) -> Wrench:
    """a + b, both about the same point."""
    return Wrench(literal.plus(a.x, b.x), literal.plus(a.y, b.y), literal.plus(a.m, b.m))


def minus(a: Wrench, b: Wrench) -> Wrench:
    """a − b, both about the same point."""
    return Wrench(less(a.x, b.x), less(a.y, b.y), less(a.m, b.m))


def times(factor: Number, a: _Triple) -> _Triple:
    """factor · a."""
    return type(a)(*(literal.times(factor, n) for n in a))


def power(wrench: Wrench, twist: Twist) -> Number:
    """F · v + M ω of a wrench about a point and the velocity of that point, W."""
    force = literal.plus(literal.times(wrench.x, twist.x), literal.times(wrench.y, twist.y))
    return literal.plus(force, literal.times(wrench.m, twist.w))
