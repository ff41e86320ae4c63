"""The class II group with a pin between two sliders (dyad PRP), in closed form.

    h ==B== i --C-- j ==D== k        h, k: known links with the guides B and D

Joint order B, C, D, sides (h, i), (i, j), (k, j). Both links keep the directions of their guides, so C is where
its two paths, along u (guide B) and v (guide D), meet: one assembly.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from trunnion.algebra.linalg import Vector, cross
from trunnion.algebra.literal import less
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import (
    Acceleration,
    Frame,
    Twist,
    Wrench,
    about,
    accelerated,
    along_slide,
    both_ends,
    compose,
    moved,
    relative,
    shifted,
)
from trunnion.groups.protocol import Elements

__all__ = ["BRANCHES", "PRPPose", "acceleration", "closure", "condition", "position", "reactions", "velocity"]

BRANCHES = (1,)


class PRPPose(NamedTuple):
    """Frames of i, j; u, v; 1/(u × v); from the origins: i → B, C; j → C, D; from the guides' points to C; gap."""

    frames: tuple[Frame, Frame]
    u: Vector
    v: Vector
    inverse: Number
    b: Vector
    c: tuple[Vector, Vector]
    d: Vector
    from_guides: tuple[Vector, Vector]
    closure: Number


def position(elements: Elements, assembly: int = 1, drive: Sequence[Number] = ()) -> PRPPose:
    """Pose of both sliders; there is one.

    elements: (B on h, B on i), (C on i, C on j), (D on k, D on j); those on h and k global, else local; m.
    """
    (b, b_i), (c_i, c_j), (d, d_j) = elements
    u, v = (b.c, b.s), (d.c, d.s)
    rest_i, rest_j = relative(b, b_i), relative(d, d_j)
    one, two = compose(rest_i, c_i), compose(rest_j, c_j)
    apart = (two.x - one.x, two.y - one.y)
    inverse = 1 / cross(u, v)
    s, t = cross(apart, v) * inverse, cross(apart, u) * inverse
    frame_i, frame_j = shifted(rest_i, u, s), shifted(rest_j, v, t)
    on_i, on_j = compose(frame_i, c_i), compose(frame_j, c_j)
    at_b, at_d = compose(frame_i, b_i), compose(frame_j, d_j)
    xp = namespace(s, t)
    return PRPPose(
        (frame_i, frame_j),
        u,
        v,
        inverse,
        (at_b.x - frame_i.x, at_b.y - frame_i.y),
        ((on_i.x - frame_i.x, on_i.y - frame_i.y), (on_j.x - frame_j.x, on_j.y - frame_j.y)),
        (at_d.x - frame_j.x, at_d.y - frame_j.y),
        ((on_i.x - b.x, on_i.y - b.y), (on_j.x - d.x, on_j.y - d.y)),
        xp.abs(on_i.x - on_j.x) + xp.abs(on_i.y - on_j.y),
    )


def velocity(pose: PRPPose, outer: Sequence[Twist | None], drive: Sequence[Number] = ()) -> list[Twist]:
    """Velocities from v_h(C) + ṡ u = v_k(C) + ṫ v; outer: (of B on h, None, of D on k)."""
    b, d = both_ends(outer, "PRP")
    one, two = moved(b, *pose.from_guides[0]), moved(d, *pose.from_guides[1])
    s, t = _rates(pose, (two.x - one.x, two.y - one.y))
    on_i = Twist(one.x + s * pose.u[0], one.y + s * pose.u[1], b.w)
    on_j = Twist(two.x + t * pose.v[0], two.y + t * pose.v[1], d.w)
    return [moved(on_i, -pose.c[0][0], -pose.c[0][1]), moved(on_j, -pose.c[1][0], -pose.c[1][1])]


def acceleration(
    pose: PRPPose,
    twists: Sequence[Twist],
    outer_twists: Sequence[Twist | None],
    outer: Sequence[Acceleration | None],
    drive: Sequence[Number] = (),
    rates: Sequence[Number] = (),
) -> list[Acceleration]:
    """Accelerations from a_h(C) + 2 ω_h × ṡ u + s̈ u = a_k(C) + 2 ω_k × ṫ v + ẗ v."""
    (b, d), (b_twist, d_twist) = both_ends(outer, "PRP"), both_ends(outer_twists, "PRP")
    one, two = moved(b_twist, *pose.from_guides[0]), moved(d_twist, *pose.from_guides[1])
    s, t = _rates(pose, (two.x - one.x, two.y - one.y))
    at_i = along_slide(accelerated(b, b_twist.w, *pose.from_guides[0]), b_twist.w, pose.u, s, 0.0)
    at_j = along_slide(accelerated(d, d_twist.w, *pose.from_guides[1]), d_twist.w, pose.v, t, 0.0)
    s2, t2 = _rates(pose, (at_j.x - at_i.x, at_j.y - at_i.y))
    on_i = Acceleration(at_i.x + s2 * pose.u[0], at_i.y + s2 * pose.u[1], b.w)
    on_j = Acceleration(at_j.x + t2 * pose.v[0], at_j.y + t2 * pose.v[1], d.w)
    return [
        accelerated(on_i, b_twist.w, -pose.c[0][0], -pose.c[0][1]),
        accelerated(on_j, d_twist.w, -pose.c[1][0], -pose.c[1][1]),
    ]


def _rates(pose: PRPPose, jump: Vector) -> tuple[Number, Number]:
    """(s, t) with s u − t v = jump; no solution where the guides are parallel."""
    return cross(jump, pose.v) * pose.inverse, cross(jump, pose.u) * pose.inverse


def reactions(pose: PRPPose, loads: Sequence[Wrench]) -> list[Wrench]:
    """Reactions (F, M)_hi, F_ij, (F, M)_kj: F_ij · u = F_i · u on i, F_ij · v = −F_j · v on j."""
    on_i, on_j = about(loads[0], *pose.b), about(loads[1], *pose.d)
    u, v = pose.u, pose.v
    p = (on_i.x * u[0] + on_i.y * u[1]) * pose.inverse
    q = -(on_j.x * v[0] + on_j.y * v[1]) * pose.inverse
    x, y = p * v[1] - q * u[1], q * u[0] - p * v[0]
    arm_i = (pose.c[0][0] - pose.b[0], pose.c[0][1] - pose.b[1])
    arm_j = (pose.c[1][0] - pose.d[0], pose.c[1][1] - pose.d[1])
    m_i = on_i.m - (arm_i[0] * y - arm_i[1] * x)
    m_j = on_j.m + arm_j[0] * y - arm_j[1] * x
    return [
        Wrench(less(x, on_i.x), less(y, on_i.y), -m_i),
        Wrench(x, y, 0.0),
        Wrench(less(-x, on_j.x), less(-y, on_j.y), -m_j),
    ]


def closure(pose: PRPPose) -> Number:
    """By how much the two sides of the pin C are apart, m."""
    return pose.closure


def condition(pose: PRPPose) -> Number:
    """2/|sin| of the angle between the guides."""
    return 2 * namespace(pose.inverse).abs(pose.inverse)
