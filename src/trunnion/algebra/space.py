"""Frames and screws in space by their real parts: what a pose R + ε [p]× R and a dual vector u + ε m are made of.

The general group of space works on these: a frame composed with another costs a third of the product of two dual
matrices. A screw is a twist ω + ε v or a wrench F + ε M, always about the origin of the global frame, so that twists
of one link against the next, and wrenches on one link, simply add up.  [P 1, 7, 20]
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra import vector
from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.vector import IDENTITY, Vector3, cross, dot, plus, scaled, transpose


class Frame(NamedTuple):
    """A frame: its axes as the columns of R, and its origin p, m."""

    x: Vector3
    y: Vector3
    z: Vector3
    place: Vector3

    def normalised(self) -> Frame:
        """The nearest frame with axes of length one at right angles, for axes that nearly are so; z keeps its place."""
        z = _unit(self.z)
        x = vector_minus(self.x, scaled(dot(self.x, z), z))
        x = _unit(x)
        return Frame(x, cross(z, x), z, self.place)


class Screw(NamedTuple):
    """u + ε m: a twist ω + ε v, with v of the point at the origin, or a wrench F + ε M, with M about the origin."""

    u: Vector3
    m: Vector3


NULL = NO_MOMENT = (0.0, 0.0, 0.0)
ORIGIN = Frame(*IDENTITY, NULL)
ZERO = ZERO_LOAD = Screw(NULL, NULL)
STILL = ZERO, ZERO  # the motion of the ground


def _unit(a: Vector3) -> Vector3:
    size = dot(a, a)
    return scaled(1 / namespace(size).sqrt(size), a)


vector_minus = vector.minus  # `minus` is that of screws


# ---- frames ---------------------------------------------------------------------------------------------------


def rotated(frame: Frame, v: Vector3) -> Vector3:
    """R v: a direction given in a frame."""
    return plus(plus(scaled(v[0], frame.x), scaled(v[1], frame.y)), scaled(v[2], frame.z))


rotated_moment = rotated  # a moment is a direction, too


def point_of(frame: Frame, v: Vector3) -> Vector3:
    """p + R v: a point given in a frame."""
    return plus(frame.place, rotated(frame, v))


def compose(frame: Frame, local: Frame) -> Frame:
    """A frame that is given in another."""
    return Frame(
        rotated(frame, local.x), rotated(frame, local.y), rotated(frame, local.z), point_of(frame, local.place)
    )


def relative(far: Frame, local: Frame) -> Frame:
    """The frame in which `local` is where `far` is: far ∘ local⁻¹."""
    columns = transpose((local.x, local.y, local.z))  # rows of Rᵀ, that is: columns of the inverse's rotation
    x, y, z = (rotated(far, column) for column in columns)
    frame = Frame(x, y, z, NULL)
    return frame._replace(place=vector_minus(far.place, rotated(frame, local.place)))


def turned(frame: Frame, angle: Number) -> Frame:
    """The frame turned about its own z."""
    xp = namespace(angle)
    c, s = xp.cos(angle), xp.sin(angle)
    x, y = frame.x, frame.y
    return frame._replace(x=plus(scaled(c, x), scaled(s, y)), y=vector_minus(scaled(c, y), scaled(s, x)))


def slid(frame: Frame, distance: Number) -> Frame:
    """The frame moved along its own z."""
    return frame._replace(place=plus(frame.place, scaled(distance, frame.z)))


def element(place: Vector3, axis: Vector3, x: Vector3 | None) -> Frame:
    """The frame at a point with z along an axis and x in the plane of z and `x`; both of any length.

    Without x the frame's x axis is taken, or its y axis where the axis is within 2.6° of that (|cos| > 0.999).
    """
    z = _unit(axis)
    if x is None:
        upright = np.asarray(np.abs(primal(z[0])) > 0.999)
        if np.all(upright == np.ravel(upright)[0]):
            x = (0.0, 1.0, 0.0) if np.ravel(upright)[0] else (1.0, 0.0, 0.0)
        else:
            x = (np.where(upright, 0.0, 1.0), np.where(upright, 1.0, 0.0), 0.0)
    x = vector_minus(x, scaled(dot(x, z), z))
    x = _unit(x)
    return Frame(x, cross(z, x), z, place)


def quaternion(frame: Frame) -> tuple[Number, Number, Number, Number]:
    """Unit quaternion (w, x, y, z) of the axes, w ≥ 0; of the four formulas that with the largest divisor."""
    (xx, yx, zx), (xy, yy, zy), (xz, yz, zz) = (  # x axis: R_xx, R_yx, R_zx
        tuple(primal(entry) + 0.0 for entry in axis) for axis in frame[:3]
    )
    squares = (1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz)
    rows = (
        (squares[0], zy - yz, xz - zx, yx - xy),
        (zy - yz, squares[1], yx + xy, xz + zx),
        (xz - zx, yx + xy, squares[2], zy + yz),
        (yx - xy, xz + zx, zy + yz, squares[3]),
    )
    largest, picked = squares[0], rows[0]
    for square, row in zip(squares[1:], rows[1:], strict=True):
        larger = np.greater(square, largest)
        picked = tuple(np.where(larger, a, b) for a, b in zip(row, picked, strict=True))
        largest = np.where(larger, square, largest)
    w, x, y, z = picked
    with np.errstate(invalid="ignore"):
        size = np.sqrt(w * w + x * x + y * y + z * z)
        scale = np.where(np.less(w, 0), -size, size)
        return w / scale, x / scale, y / scale, z / scale


def rotation_matrix(quaternion: NDArray[np.float64]) -> NDArray[np.float64]:
    """Matrix (3, 3, …) of unit quaternions (4, …), w first: the inverse of `quaternion`."""
    w, x, y, z = quaternion
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def line_of(frame: Frame) -> Screw:
    """The z axis as a line u + ε p × u."""
    return Screw(frame.z, cross(frame.place, frame.z))


def place_of(frame: Frame) -> Vector3:
    """The origin of a frame."""
    return frame.place


def distance(a: Frame, b: Frame) -> Number:
    """Between the origins of two frames, m; its real part."""
    apart = vector_minus(b.place, a.place)
    return np.sqrt(primal(dot(apart, apart)))


# ---- screws ---------------------------------------------------------------------------------------------------


def added(a: Screw, b: Screw) -> Screw:
    """a + b."""
    return Screw(plus(a.u, b.u), plus(a.m, b.m))


def minus(a: Screw, b: Screw) -> Screw:
    """a − b."""
    return Screw(vector_minus(a.u, b.u), vector_minus(a.m, b.m))


def times(factor: Number, a: Screw) -> Screw:
    """factor · a."""
    return Screw(scaled(factor, a.u), scaled(factor, a.m))


def bracket(a: Screw, b: Screw) -> Screw:
    """Lie bracket a × b, the dual cross product: the rate of a screw b that is carried along with the twist a."""
    return Screw(cross(a.u, b.u), plus(cross(a.u, b.m), cross(a.m, b.u)))


def power(wrench: Screw, twist: Screw) -> Number:
    """F · v + M · ω, W."""
    return dot(wrench.u, twist.m) + dot(wrench.m, twist.u)


def about(force: Vector3, moment: Vector3, place: Vector3) -> Screw:
    """The wrench of a force at a place and a moment, about the origin."""
    return Screw(force, plus(moment, cross(place, force)))


def moment_at(a: Screw, place: Vector3) -> Vector3:
    """Moment of a wrench about a place, or velocity of a twist at it: m − p × u = m + u × p."""
    return plus(a.m, cross(a.u, place))


velocity_at = moment_at  # the same of a twist


def on_axis(wrench: Screw, joint: Frame, middle: Number = 0.0) -> tuple[Vector3, tuple[Number], Vector3]:
    """Force across and along the axis of a joint, and moment about the point at `middle` along it from the joint's."""
    along = dot(wrench.u, joint.z)
    moment = moment_at(wrench, plus(joint.place, scaled(middle, joint.z)))
    return vector_minus(wrench.u, scaled(along, joint.z)), (along,), moment


def spin(twist: Screw) -> Number:
    """Angular speed, rad/s; its real part."""
    return np.sqrt(primal(dot(twist.u, twist.u)))


def moving(frame: Frame, twist: Screw, acceleration: Screw, local: Vector3) -> tuple[Vector3, Vector3, Vector3]:
    """Place, velocity, acceleration of a point of a moving frame: v = v₀ + ω × p, a = a₀ + ω̇ × p + ω × v."""
    place = point_of(frame, local)
    velocity = moment_at(twist, place)
    return place, velocity, plus(moment_at(acceleration, place), cross(twist.u, velocity))
