"""How a pin and a guide move in the plane: the two rows of the table of `joints.spatial` that the plane knows."""

from __future__ import annotations

from trunnion.algebra.plane import Twist, line_of, slid, turned
from trunnion.joints.spatial import PairMotion

__all__ = ["MOTIONS"]

MOTIONS: dict[str, PairMotion] = {
    "revolute": PairMotion(
        ("turn",),
        ("turn",),
        lambda frame, q, lead=0.0: turned(frame, q[0]),
        lambda frame, q, lead=0.0: turned(frame, -q[0]),
        lambda first, second, lead=0.0: [line_of(second)],
    ),
    "prismatic": PairMotion(
        ("slide",),
        ("slide",),
        lambda frame, q, lead=0.0: slid(frame, q[0]),
        lambda frame, q, lead=0.0: slid(frame, -q[0]),
        lambda first, second, lead=0.0: [Twist(first.c, first.s, 0.0)],
    ),
}
