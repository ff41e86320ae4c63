"""Frames, twists and wrenches in the plane, under the names that `space` has for those in space.

A twist is the velocity of a body's point at the origin of the global frame, with the angular velocity; a wrench has
its moment about that origin. So twists of one link against the next, and wrenches on one link, simply add up, and the
derivative of a twist is one, too. Entries are numbers of `algebra.namespace` that broadcast over (sample, position).
"""

from __future__ import annotations

from typing import NamedTuple, TypeVar

import numpy as np

from trunnion.algebra import literal
from trunnion.algebra.dual import primal
from trunnion.algebra.literal import is_zero, less, plus
from trunnion.algebra.namespace import Number, namespace

Vector2 = tuple[Number, Number]


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
    """Velocity of a body's point at the origin, m/s, and angular velocity w, rad/s; or the derivative of both."""

    x: Number
    y: Number
    w: Number


class Wrench(NamedTuple):
    """Force, N, and moment, N m, about the origin or a stated point."""

    x: Number
    y: Number
    m: Number


_Triple = TypeVar("_Triple", Twist, Wrench)
NULL = (0.0, 0.0)
NO_MOMENT = 0.0
ORIGIN = Frame(0.0, 0.0, 1.0, 0.0)
ZERO, ZERO_LOAD = Twist(0.0, 0.0, 0.0), Wrench(0.0, 0.0, 0.0)
STILL = ZERO, ZERO  # the motion of the ground


# ---- frames ---------------------------------------------------------------------------------------------------


def turned_vector(c: Number, s: Number, x: Number, y: Number) -> Vector2:
    """(x, y) turned by the angle whose cosine and sine are c, s."""
    if is_zero(y):
        return literal.times(c, x), literal.times(s, x)
    if is_zero(x):
        return -(s * y), c * y
    return c * x - s * y, s * x + c * y


def place_of(frame: Frame) -> Vector2:
    """The origin of a frame."""
    return frame.x, frame.y


def rotated(frame: Frame, v: Vector2) -> Vector2:
    """A direction given in a frame."""
    return turned_vector(frame.c, frame.s, *v)


def rotated_moment(frame: Frame, moment: Number) -> Number:
    """A moment given in a frame: the same in all."""
    return moment


def point_of(frame: Frame, v: Vector2) -> Vector2:
    """Global place of a point given in a frame."""
    if is_zero(v[0]) and is_zero(v[1]):
        return frame.x, frame.y
    dx, dy = turned_vector(frame.c, frame.s, *v)
    return frame.x + dx, frame.y + dy


def compose(frame: Frame, local: Frame) -> Frame:
    """A frame that is given in another."""
    return Frame(*point_of(frame, (local.x, local.y)), *turned_vector(frame.c, frame.s, local.c, local.s))


def relative(far: Frame, local: Frame) -> Frame:
    """The frame in which `local` is where `far` is: far ∘ local⁻¹."""
    c, s = turned_vector(far.c, far.s, local.c, -local.s)
    dx, dy = turned_vector(c, s, local.x, local.y)
    return Frame(far.x - dx, far.y - dy, c, s)


def turned(frame: Frame, angle: Number) -> Frame:
    """The frame turned in its place."""
    xp = namespace(angle)
    return Frame(frame.x, frame.y, *turned_vector(xp.cos(angle), xp.sin(angle), frame.c, frame.s))


def slid(frame: Frame, distance: Number) -> Frame:
    """The frame moved along its own x axis."""
    return Frame(frame.x + frame.c * distance, frame.y + frame.s * distance, frame.c, frame.s)


def distance(a: Frame, b: Frame) -> Number:
    """Between the origins of two frames, m; its real part."""
    return np.hypot(primal(b.x) - primal(a.x), primal(b.y) - primal(a.y))


# ---- twists and wrenches --------------------------------------------------------------------------------------


def line_of(frame: Frame) -> Twist:
    """The twist of a turn of 1 rad/s about the origin of a frame."""
    return Twist(frame.y, -frame.x, 1.0)


def added(a: _Triple, b: _Triple) -> _Triple:
    """a + b."""
    return type(a)(plus(a[0], b[0]), plus(a[1], b[1]), plus(a[2], b[2]))


def minus(a: _Triple, b: _Triple) -> _Triple:
    """a − b."""
    return type(a)(less(a[0], b[0]), less(a[1], b[1]), less(a[2], b[2]))


def times(factor: Number, a: _Triple) -> _Triple:
    """factor · a."""
    return type(a)(literal.times(factor, a[0]), literal.times(factor, a[1]), literal.times(factor, a[2]))


def bracket(a: Twist, b: Twist) -> Twist:
    """Lie bracket a × b: the rate of a twist b that is carried along with the twist a."""
    x = less(literal.times(b.w, a.y), literal.times(a.w, b.y))
    y = less(literal.times(a.w, b.x), literal.times(b.w, a.x))
    return Twist(x, y, 0.0)


def power(wrench: Wrench, twist: Twist) -> Number:
    """F · v + M ω, W."""
    force = plus(literal.times(wrench.x, twist.x), literal.times(wrench.y, twist.y))
    return plus(force, literal.times(wrench.m, twist.w))


def velocity_at(twist: Twist, place: Vector2) -> Vector2:
    """Velocity that a twist has at a place, m/s: v + ω × p."""
    return less(twist.x, literal.times(twist.w, place[1])), plus(twist.y, literal.times(twist.w, place[0]))


def acceleration_at(twist: Twist, second: Twist, place: Vector2) -> Vector2:
    """Acceleration at a place, m/s², of a body with a twist and its derivative: a₀ + ω̇ × p + ω × v."""
    velocity, (x, y) = velocity_at(twist, place), velocity_at(second, place)
    return less(x, literal.times(twist.w, velocity[1])), plus(y, literal.times(twist.w, velocity[0]))


def moment_at(wrench: Wrench, place: Vector2) -> Number:
    """Moment of a wrench about a place: M − p × F."""
    return less(wrench.m, less(literal.times(place[0], wrench.y), literal.times(place[1], wrench.x)))


def on_axis(wrench: Wrench, joint: Frame, _: Number = 0.0) -> tuple[Vector2, tuple[()], tuple[Number]]:
    """Force across the axis of a joint, which stands on the plane, none along it, and moment about its point."""
    return (wrench.x, wrench.y), (), (moment_at(wrench, place_of(joint)),)


def about(force: Vector2, moment: Number, place: Vector2) -> Wrench:
    """The wrench of a force at a place and a moment, about the origin."""
    arm = less(literal.times(place[0], force[1]), literal.times(place[1], force[0]))
    return Wrench(force[0], force[1], plus(moment, arm))


def spin(twist: Twist) -> Number:
    """Angular speed, rad/s; its real part."""
    return np.abs(primal(twist.w))


def moving(frame: Frame, twist: Twist, acceleration: Twist, local: Vector2) -> tuple[Vector2, Vector2, Vector2]:
    """Place, velocity, acceleration of a point of a moving frame: v = v₀ + ω × p, a = a₀ + ω̇ × p + ω × v."""
    place = point_of(frame, local)
    return place, velocity_at(twist, place), acceleration_at(twist, acceleration, place)
