"""The class II group with two revolute pairs and an outer prismatic one (dyad RRP), in closed form.

    h --B-- i --C-- j ==D== k        h, k: known links; i: the connecting rod, j: the slider; D: the guide on k

Joint order B, C, D, sides (h, i), (i, j), (k, j). With the unit vectors u along the guide and n = z × u, the rod
is B→C = r u + p n: p is known, since j keeps its direction, and r = ± √(|BC|² − p²). Offsets, guides at any angle
and on moving links are in p.  [extends D 2-13 to the slider; checked against the general group]
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from trunnion.algebra.linalg import Vector, dot
from trunnion.algebra.literal import is_zero, less
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import (
    Acceleration,
    Frame,
    Twist,
    Wrench,
    about,
    accelerated,
    both_ends,
    compose,
    moved,
    pinned,
    relative,
    root,
    turned,
)
from trunnion.groups.protocol import Elements

__all__ = ["BRANCHES", "RRPPose", "acceleration", "closure", "condition", "position", "reactions", "velocity"]

BRANCHES = (1, -1)


class RRPPose(NamedTuple):
    """Frames of i, j; u; r, p of B→C = r u + p n; from the origins: i → B, j → C, j → D; from D on k: → C, → D on j."""

    frames: tuple[Frame, Frame]
    u: Vector
    r: Number
    p: Number
    b: Vector
    c: Vector
    d: Vector
    length: Number
    to_c: Vector
    to_d: Vector
    closure: Number


def position(elements: Elements, assembly: int, drive: Sequence[Number] = ()) -> RRPPose:
    """Pose of rod and slider. assembly: ±1, C ahead of B (along the guide's axis) or behind it.

    elements: (B on h, B on i), (C on i, C on j), (D on k, D on j); those on h and k global, else local; m.
    """
    (b, b_i), (c_i, c_j), (d, d_j) = elements
    side = (c_i.x - b_i.x, c_i.y - b_i.y)
    u = (d.c, d.s)
    rest = relative(d, d_j)  # the slider's frame with its element at the guide's point
    at_rest = compose(rest, c_j)
    p = u[0] * (at_rest.y - b.y) - u[1] * (at_rest.x - b.x)
    xp = namespace(p, *side)
    square = side[0] * side[0] + side[1] * side[1]
    r = assembly * root(square - p * p, square)
    bc = (r * u[0] - p * u[1], r * u[1] + p * u[0])
    frame_i, arm_b = pinned(b, b_i, bc, side, square)
    shift = (b.x + bc[0] - at_rest.x, b.y + bc[1] - at_rest.y)
    frame_j = Frame(rest.x + shift[0], rest.y + shift[1], rest.c, rest.s)
    arm_c, arm_d = (turned(rest.c, rest.s, local.x, local.y) for local in (c_j, d_j))
    to_d = (frame_j.x + arm_d[0] - d.x, frame_j.y + arm_d[1] - d.y)
    to_c = (frame_j.x + arm_c[0] - d.x, frame_j.y + arm_c[1] - d.y)
    gap = xp.abs(to_d[1] * u[0] - to_d[0] * u[1])
    return RRPPose((frame_i, frame_j), u, r, p, arm_b, arm_c, arm_d, xp.sqrt(square), to_c, to_d, gap)


def velocity(pose: RRPPose, outer: Sequence[Twist | None], drive: Sequence[Number] = ()) -> list[Twist]:
    """Velocities from v_B + ω_i × BC = v_k(C) + ṡ u; outer: (of B, None, of D on k)."""
    b, d = both_ends(outer, "RRP")
    carried = moved(d, *pose.to_c)
    w, slide = _rates(pose, (carried.x - b.x, carried.y - b.y))
    c = Twist(carried.x + slide * pose.u[0], carried.y + slide * pose.u[1], d.w)
    return [moved(Twist(b.x, b.y, w), -pose.b[0], -pose.b[1]), moved(c, -pose.c[0], -pose.c[1])]


def acceleration(
    pose: RRPPose,
    twists: Sequence[Twist],
    outer_twists: Sequence[Twist | None],
    outer: Sequence[Acceleration | None],
    drive: Sequence[Number] = (),
    rates: Sequence[Number] = (),
) -> list[Acceleration]:
    """Accelerations from a_B + α_i × BC − ω_i² BC = a_k(C) + 2 ω_k × ṡ u + s̈ u."""
    (b, d), (b_twist, d_twist) = both_ends(outer, "RRP"), both_ends(outer_twists, "RRP")
    w, wk, u = twists[0].w, d_twist.w, pose.u
    speed = moved(d_twist, *pose.to_c)
    _, slide = _rates(pose, (speed.x - b_twist.x, speed.y - b_twist.y))
    carried = accelerated(d, wk, *pose.to_c)
    x, y = carried.x - 2 * wk * slide * u[1], carried.y + 2 * wk * slide * u[0]
    bc = (pose.r * u[0] - pose.p * u[1], pose.r * u[1] + pose.p * u[0])
    alpha, along = _rates(pose, (x - b.x + w * w * bc[0], y - b.y + w * w * bc[1]))
    c = Acceleration(x + along * u[0], y + along * u[1], d.w)
    return [
        accelerated(Acceleration(b.x, b.y, alpha), w, -pose.b[0], -pose.b[1]),
        accelerated(c, wk, -pose.c[0], -pose.c[1]),
    ]


def _rates(pose: RRPPose, jump: Vector) -> tuple[Number, Number]:
    """(ω, ṡ) with ω × BC − ṡ u = jump; no solution where the rod is across the guide (r = 0)."""
    across = pose.u[0] * jump[1] - pose.u[1] * jump[0]
    w = across / pose.r
    return w, -pose.p * w - dot(jump, pose.u)


def reactions(pose: RRPPose, loads: Sequence[Wrench]) -> list[Wrench]:
    """Reactions F_hi, F_ij and (F, M)_kj: moments about B on the rod, forces along the guide on the slider.

    BC × F_ij = M_i about B, (F_ij + F_j) · u = 0; then forces on i and on j, and moments about D on j.
    """
    u = pose.u
    on_i = about(loads[0], *pose.b)
    on_j = about(loads[1], *pose.d)
    pure_moment = is_zero(on_j.x) and is_zero(on_j.y)  # as in a unit friction load of a pin: three passes spared
    along = 0.0 if pure_moment else -(on_j.x * u[0] + on_j.y * u[1])
    across = (on_i.m if pure_moment else on_i.m + pose.p * along) / pose.r
    x, y = turned(*u, along, across)
    at_c = Wrench(x, y, 0.0)
    moment = less(on_j.m, about(at_c, pose.c[0] - pose.d[0], pose.c[1] - pose.d[1]).m)
    return [
        Wrench(less(x, on_i.x), less(y, on_i.y), 0.0),
        at_c,
        Wrench(less(-x, on_j.x), less(-y, on_j.y), -moment),
    ]


def closure(pose: RRPPose) -> Number:
    """By how much the slider is off its guide, m."""
    return pose.closure


def condition(pose: RRPPose) -> Number:
    """2 |BC|/|r|: a dead centre is where the rod stands across the guide."""
    return 2 * pose.length / namespace(pose.r).abs(pose.r)
