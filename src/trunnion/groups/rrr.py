"""The class II group with three revolute pairs (dyad RRR), in closed form.  [D 2-13]

    h --B-- i --C-- j --D-- k        h, k: known links; i, j: the group

Joint order B, C, D: `elements` is ((B on h, B on i), (C on i, C on j), (D on k, D on j)), so the sides are
(h, i), (i, j), (k, j). [D] S. Durango, G. Calle, O. Ruiz, J. Braz. Soc. Mech. Sci. & Eng. (2010).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from trunnion.algebra.linalg import Vector, cross, dot
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
    moved,
    pinned,
    root,
)
from trunnion.groups.protocol import Elements

__all__ = ["BRANCHES", "RRRPose", "acceleration", "closure", "condition", "meet", "position", "reactions", "velocity"]

BRANCHES = (1, -1)


class RRRPose(NamedTuple):
    """Frames of the links i, j; B→C, D→C, and from the frame origins to B and D, global axes, m; |BC|, |CD|.

    area: 1/(BC × DC), 1/m²; infinite in a dead centre. closure: opening of the pin C, m.
    """

    frames: tuple[Frame, Frame]
    bc: Vector
    dc: Vector
    b: Vector
    d: Vector
    lengths: tuple[Number, Number]
    area: Number
    closure: Number


def meet(b: Vector, d: Vector, bc: Number, cd: Number, branch: int) -> Vector:
    """B→C for the pin C of an RRR group between known pins B and D.

    |C − B| = bc, |C − D| = cd; branch +1 puts C left of B→D, −1 right of it.  [D fig. 5]
    b, d: (x, y) m; bc, cd: m; all broadcast over (sample, position). NaN where the circles do not meet.
    """
    x, y = d[0] - b[0], d[1] - b[1]
    square = x * x + y * y
    along = (square + (bc - cd) * (bc + cd)) / (2 * square)
    reach = bc * bc / square
    across = branch * root(reach - along * along, reach)
    return along * x - across * y, along * y + across * x


def position(elements: Elements, assembly: int, drive: Sequence[Number] = ()) -> RRRPose:
    """Pose of both links. assembly: ±1, C left or right of B→D.

    elements: (B on h, B on i), (C on i, C on j), (D on k, D on j); those on h and k global, else local; m.
    """
    (b, b_i), (c_i, c_j), (d, d_j) = elements
    side_i = (c_i.x - b_i.x, c_i.y - b_i.y)
    side_j = (c_j.x - d_j.x, c_j.y - d_j.y)
    xp = namespace(*side_i, *side_j)
    lengths = xp.hypot(*side_i), xp.hypot(*side_j)
    bc = meet((b.x, b.y), (d.x, d.y), *lengths, assembly)
    dc = (bc[0] - (d.x - b.x), bc[1] - (d.y - b.y))
    frame_i, arm_b = pinned(b, b_i, bc, side_i, lengths[0] * lengths[0])
    frame_j, arm_d = pinned(d, d_j, dc, side_j, lengths[1] * lengths[1])
    xp = namespace(*bc)
    gap = xp.abs(xp.sqrt(dot(bc, bc)) - lengths[0]) + xp.abs(xp.sqrt(dot(dc, dc)) - lengths[1])
    return RRRPose((frame_i, frame_j), bc, dc, arm_b, arm_d, lengths, 1 / cross(bc, dc), gap)


def velocity(pose: RRRPose, outer: Sequence[Twist | None], drive: Sequence[Number] = ()) -> list[Twist]:
    """Velocities from v_B + ω_i × BC = v_D + ω_j × DC; outer: (of B, None, of D)."""
    b, d = both_ends(outer, "RRR")
    w_i, w_j = _rates(pose, (d.x - b.x, d.y - b.y))
    return [
        moved(Twist(b.x, b.y, w_i), -pose.b[0], -pose.b[1]),
        moved(Twist(d.x, d.y, w_j), -pose.d[0], -pose.d[1]),
    ]


def acceleration(
    pose: RRRPose,
    twists: Sequence[Twist],
    outer_twists: Sequence[Twist | None],
    outer: Sequence[Acceleration | None],
    drive: Sequence[Number] = (),
    rates: Sequence[Number] = (),
) -> list[Acceleration]:
    """Accelerations from a_B + α_i × BC − ω_i² BC = a_D + α_j × DC − ω_j² DC."""
    b, d = both_ends(outer, "RRR")
    w_i, w_j = twists[0].w, twists[1].w
    wi2, wj2 = w_i * w_i, w_j * w_j
    jump = (
        d.x - b.x + wi2 * pose.bc[0] - wj2 * pose.dc[0],
        d.y - b.y + wi2 * pose.bc[1] - wj2 * pose.dc[1],
    )
    a_i, a_j = _rates(pose, jump)
    return [
        accelerated(Acceleration(b.x, b.y, a_i), w_i, -pose.b[0], -pose.b[1]),
        accelerated(Acceleration(d.x, d.y, a_j), w_j, -pose.d[0], -pose.d[1]),
    ]


def _rates(pose: RRRPose, jump: Vector) -> tuple[Number, Number]:
    """(p, q) with p × BC − q × DC = jump; × means z × vector. No solution where B, C, D are in line."""
    return dot(jump, pose.dc) * pose.area, dot(jump, pose.bc) * pose.area


def reactions(pose: RRRPose, loads: Sequence[Wrench]) -> list[Wrench]:
    """Reactions F_hi at B, F_ij at C, F_kj at D.  [D 2-7, with friction among the loads 12-13]

    Moments about B on link i and about D on link j hold only F_ij:
        BC × F_ij = M_i,  DC × F_ij = −M_j
    which is [D 12-13] with [D 6-7] inserted; then F_hi and F_kj follow from [D 6-7].
    """
    on_i = about(loads[0], *pose.b)
    on_j = about(loads[1], *pose.d)
    x, y = _shared(on_i.m, on_j.m, pose)
    return [
        Wrench(less(x, on_i.x), less(y, on_i.y), 0.0),
        Wrench(x, y, 0.0),
        Wrench(less(-x, on_j.x), less(-y, on_j.y), 0.0),
    ]


def _shared(m_i: Number, m_j: Number, pose: RRRPose) -> Vector:
    """F_ij from the moments on both links; a literal zero among them, as in a unit friction load, costs nothing."""
    if is_zero(m_j):
        q = m_i * pose.area
        return q * pose.dc[0], q * pose.dc[1]
    p = m_j * pose.area
    if is_zero(m_i):
        return p * pose.bc[0], p * pose.bc[1]
    q = m_i * pose.area
    return p * pose.bc[0] + q * pose.dc[0], p * pose.bc[1] + q * pose.dc[1]


def closure(pose: RRRPose) -> Number:
    """By how much the pin C found misses the two circles, m."""
    return pose.closure


def condition(pose: RRRPose) -> Number:
    """2/|sin μ|, μ the transmission angle between BC and DC: Frobenius condition of their unit vectors."""
    xp = namespace(*pose.bc)
    return 2 * pose.lengths[0] * pose.lengths[1] * xp.abs(pose.area)
