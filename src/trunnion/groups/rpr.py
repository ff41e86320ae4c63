"""The class II group with a prismatic pair between two links on outer pins (dyad RPR), in closed form.

    h --B-- i ==C== j --D-- k        h, k: known links; C: the guide on i, in which j slides

Joint order B, C, D, sides (h, i), (i, j), (k, j). Both links have one direction: that of the unit vector u along
the slide, with n = z × u. B→D = X u + e n with the constant offset e, so X = ± √(|BD|² − e²).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from trunnion.algebra.linalg import Vector
from trunnion.algebra.literal import less
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import (
    Acceleration,
    Frame,
    Twist,
    Wrench,
    about,
    accelerated,
    both_ends,
    moved,
    relative,
    root,
    turned,
)
from trunnion.groups.protocol import Elements

__all__ = ["BRANCHES", "RPRPose", "acceleration", "closure", "condition", "position", "reactions", "velocity"]

BRANCHES = (1, -1)


class RPRPose(NamedTuple):
    """Frames of i, j; u; X, e of B→D = X u + e n; from the origins: i → B, j → D; from D to C on j; |BD|."""

    frames: tuple[Frame, Frame]
    u: Vector
    along: Number
    offset: Number
    b: Vector
    d: Vector
    to_c: Vector
    length: Number
    closure: Number


def position(elements: Elements, assembly: int, drive: Sequence[Number] = ()) -> RPRPose:
    """Pose of both links. assembly: ±1, D ahead of B along the slide's axis or behind it.

    elements: (B on h, B on i), (C on i, C on j), (D on k, D on j); those on h and k global, else local; m.
    """
    (b, b_i), (c_i, c_j), (d, d_j) = elements
    # places of the pins in the frame of the slide: x along it, origin at the link's element of C
    b_along, b_across = turned(c_i.c, -c_i.s, b_i.x - c_i.x, b_i.y - c_i.y)
    d_along, d_across = turned(c_j.c, -c_j.s, d_j.x - c_j.x, d_j.y - c_j.y)
    offset = d_across - b_across
    x, y = d.x - b.x, d.y - b.y
    square = x * x + y * y
    xp = namespace(square, offset)
    along = assembly * root(square - offset * offset, square)
    u = ((along * x + offset * y) / square, (along * y - offset * x) / square)
    to_b, to_d = turned(*u, b_along, b_across), turned(*u, d_along, d_across)
    frame_i = relative(Frame(b.x - to_b[0], b.y - to_b[1], *u), c_i)
    frame_j = relative(Frame(d.x - to_d[0], d.y - to_d[1], *u), c_j)
    arm_b, arm_d = turned(frame_i.c, frame_i.s, b_i.x, b_i.y), turned(frame_j.c, frame_j.s, d_j.x, d_j.y)
    gap = xp.abs((x * u[1] - y * u[0]) + offset)
    return RPRPose((frame_i, frame_j), u, along, offset, arm_b, arm_d, (-to_d[0], -to_d[1]), xp.sqrt(square), gap)


def velocity(pose: RPRPose, outer: Sequence[Twist | None], drive: Sequence[Number] = ()) -> list[Twist]:
    """Velocities from v_D − v_B = Ẋ u + ω × BD; outer: (of B, None, of D)."""
    b, d = both_ends(outer, "RPR")
    w, _ = _rates(pose, (d.x - b.x, d.y - b.y))
    return [
        moved(Twist(b.x, b.y, w), -pose.b[0], -pose.b[1]),
        moved(Twist(d.x, d.y, w), -pose.d[0], -pose.d[1]),
    ]


def acceleration(
    pose: RPRPose,
    twists: Sequence[Twist],
    outer_twists: Sequence[Twist | None],
    outer: Sequence[Acceleration | None],
    drive: Sequence[Number] = (),
    rates: Sequence[Number] = (),
) -> list[Acceleration]:
    """Accelerations from a_D − a_B = Ẍ u + 2 ω × Ẋ u + α × BD − ω² BD."""
    (b, d), (b_twist, d_twist) = both_ends(outer, "RPR"), both_ends(outer_twists, "RPR")
    u, w = pose.u, twists[0].w
    _, slide = _rates(pose, (d_twist.x - b_twist.x, d_twist.y - b_twist.y))
    reach = (pose.along * u[0] - pose.offset * u[1], pose.along * u[1] + pose.offset * u[0])
    jump = (
        d.x - b.x + w * w * reach[0] + 2 * w * slide * u[1],
        d.y - b.y + w * w * reach[1] - 2 * w * slide * u[0],
    )
    alpha, _ = _rates(pose, jump)
    return [
        accelerated(Acceleration(b.x, b.y, alpha), w, -pose.b[0], -pose.b[1]),
        accelerated(Acceleration(d.x, d.y, alpha), w, -pose.d[0], -pose.d[1]),
    ]


def _rates(pose: RPRPose, jump: Vector) -> tuple[Number, Number]:
    """(ω, Ẋ) with ω × BD + Ẋ u = jump; no solution where the slide is across BD (X = 0)."""
    u = pose.u
    w = (u[0] * jump[1] - u[1] * jump[0]) / pose.along
    return w, u[0] * jump[0] + u[1] * jump[1] + w * pose.offset


def reactions(pose: RPRPose, loads: Sequence[Wrench]) -> list[Wrench]:
    """Reactions F_hi, (N n, M)_ij and F_kj: the slide carries N across it, and X N = M_i about B + M_j about D."""
    u = pose.u
    on_i, on_j = about(loads[0], *pose.b), about(loads[1], *pose.d)
    normal = (on_i.m + on_j.m) / pose.along
    x, y = -normal * u[1], normal * u[0]
    moment = -on_j.m - (pose.to_c[0] * y - pose.to_c[1] * x)  # that on j about D is −M_j; here about C
    return [
        Wrench(less(x, on_i.x), less(y, on_i.y), 0.0),
        Wrench(x, y, moment),
        Wrench(less(-x, on_j.x), less(-y, on_j.y), 0.0),
    ]


def closure(pose: RPRPose) -> Number:
    """By how much the two axes of the slide are apart, m."""
    return pose.closure


def condition(pose: RPRPose) -> Number:
    """2 |BD|/|X|: a dead centre is where the slide is across BD."""
    return 2 * pose.length / namespace(pose.along).abs(pose.along)
