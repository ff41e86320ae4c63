"""The class II group with an outer pin and two prismatic pairs (dyad RPP), in closed form.

    h --B-- i ==C== j ==D== k        h, k: known links; C: guide on i, D: guide on k

Joint order B, C, D, sides (h, i), (i, j), (k, j). Both links keep the direction that the guide D gives them, so the
link i is known from its pin, and j is where the slides along u (guide C) and v (guide D) meet: one assembly.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from trunnion.algebra.linalg import Vector, cross, dot
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
    turned,
)
from trunnion.groups.protocol import Elements

__all__ = ["BRANCHES", "RPPPose", "acceleration", "closure", "condition", "position", "reactions", "velocity"]

BRANCHES = (1,)


class RPPPose(NamedTuple):
    """Frames of i, j; u, v; 1/(u × v); from the origins: i → B, j → C, j → D; to C on j from B and from D on k; gap."""

    frames: tuple[Frame, Frame]
    u: Vector
    v: Vector
    inverse: Number
    b: Vector
    c: Vector
    d: Vector
    to_c: tuple[Vector, Vector]
    closure: Number


def position(elements: Elements, assembly: int = 1, drive: Sequence[Number] = ()) -> RPPPose:
    """Pose of both links; there is one.

    elements: (B on h, B on i), (C on i, C on j), (D on k, D on j); those on h and k global, else local; m.
    """
    (b, b_i), (c_i, c_j), (d, d_j) = elements
    rest_j = relative(d, d_j)
    guide = compose(rest_j, c_j)  # direction of the slide C; its place only once j is placed
    aligned = relative(Frame(0.0, 0.0, guide.c, guide.s), c_i)
    arm_b = turned(aligned.c, aligned.s, b_i.x, b_i.y)
    frame_i = Frame(b.x - arm_b[0], b.y - arm_b[1], aligned.c, aligned.s)
    on_i = compose(frame_i, c_i)
    u, v = (guide.c, guide.s), (d.c, d.s)
    inverse = 1 / cross(u, v)
    frame_j = shifted(rest_j, v, cross((guide.x - on_i.x, guide.y - on_i.y), u) * inverse)
    on_j, at_d = compose(frame_j, c_j), compose(frame_j, d_j)
    return RPPPose(
        (frame_i, frame_j),
        u,
        v,
        inverse,
        arm_b,
        (on_j.x - frame_j.x, on_j.y - frame_j.y),
        (at_d.x - frame_j.x, at_d.y - frame_j.y),
        ((on_j.x - b.x, on_j.y - b.y), (on_j.x - d.x, on_j.y - d.y)),
        namespace(on_j.x).abs(cross((on_j.x - on_i.x, on_j.y - on_i.y), u)),
    )


def velocity(pose: RPPPose, outer: Sequence[Twist | None], drive: Sequence[Number] = ()) -> list[Twist]:
    """Velocities from v_i(C) + ṡ u = v_k(C) + ṫ v with ω_i = ω_j = ω_k; outer: (of B, None, of D on k)."""
    b, d = both_ends(outer, "RPP")
    on_i = Twist(b.x, b.y, d.w)
    _, t = _rates(pose, on_i, d)
    carried = moved(d, *pose.to_c[1])
    on_j = Twist(carried.x + t * pose.v[0], carried.y + t * pose.v[1], d.w)
    return [moved(on_i, -pose.b[0], -pose.b[1]), moved(on_j, -pose.c[0], -pose.c[1])]


def acceleration(
    pose: RPPPose,
    twists: Sequence[Twist],
    outer_twists: Sequence[Twist | None],
    outer: Sequence[Acceleration | None],
    drive: Sequence[Number] = (),
    rates: Sequence[Number] = (),
) -> list[Acceleration]:
    """Accelerations from a_i(C) + 2 ω × ṡ u + s̈ u = a_k(C) + 2 ω × ṫ v + ẗ v."""
    (b, d), (b_twist, d_twist) = both_ends(outer, "RPP"), both_ends(outer_twists, "RPP")
    w = d_twist.w
    s, t = _rates(pose, Twist(b_twist.x, b_twist.y, w), d_twist)
    on_i = Acceleration(b.x, b.y, d.w)
    at_i = along_slide(accelerated(on_i, w, *pose.to_c[0]), w, pose.u, s, 0.0)
    at_j = along_slide(accelerated(d, w, *pose.to_c[1]), w, pose.v, t, 0.0)
    t2 = cross((at_j.x - at_i.x, at_j.y - at_i.y), pose.u) * pose.inverse
    on_j = Acceleration(at_j.x + t2 * pose.v[0], at_j.y + t2 * pose.v[1], d.w)
    return [accelerated(on_i, w, -pose.b[0], -pose.b[1]), accelerated(on_j, w, -pose.c[0], -pose.c[1])]


def _rates(pose: RPPPose, b: Twist, d: Twist) -> tuple[Number, Number]:
    """(ṡ, ṫ) of the slides C and D; none where the guides are parallel."""
    one, two = moved(b, *pose.to_c[0]), moved(d, *pose.to_c[1])
    jump = (two.x - one.x, two.y - one.y)
    return cross(jump, pose.v) * pose.inverse, cross(jump, pose.u) * pose.inverse


def reactions(pose: RPPPose, loads: Sequence[Wrench]) -> list[Wrench]:
    """Reactions F_hi, (N n, M)_ij, (F, M)_kj: N n · v = −F_j · v on j, and moments about B on i."""
    on_i, on_j = about(loads[0], *pose.b), about(loads[1], *pose.d)
    u, v = pose.u, pose.v
    normal = -dot((on_j.x, on_j.y), v) * pose.inverse  # n · v = u × v
    x, y = -normal * u[1], normal * u[0]
    about_c = on_i.m - cross(pose.to_c[0], (x, y))  # the couple i puts on j, about C on j
    arm = (pose.c[0] - pose.d[0], pose.c[1] - pose.d[1])
    moment = on_j.m + about_c + cross(arm, (x, y))
    return [
        Wrench(less(x, on_i.x), less(y, on_i.y), 0.0),
        Wrench(x, y, about_c),
        Wrench(less(-x, on_j.x), less(-y, on_j.y), -moment),
    ]


def closure(pose: RPPPose) -> Number:
    """By how much the slide C is off its axis, m."""
    return pose.closure


def condition(pose: RPPPose) -> Number:
    """2/|sin| of the angle between the guides."""
    return 2 * namespace(pose.inverse).abs(pose.inverse)
