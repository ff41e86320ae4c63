"""The class II group with three revolute pairs (dyad RRR): its position in closed form.  [D fig. 5]

    h --B-- i --C-- j --D-- k        h, k: known links; i, j: the group

Joint order B, C, D: `elements` is ((B on h, B on i), (C on i, C on j), (D on k, D on j)), so the sides are
(h, i), (i, j), (k, j). The rest is that of every dyad, see `groups.dyad`: its two equations for the force in C are the
moments about B on link i and about D on link j, BC × F_ij = M_i and DC × F_ij = −M_j, which is [D 12-13] with [D 6-7]
inserted. [D] S. Durango, G. Calle, O. Ruiz, J. Braz. Soc. Mech. Sci. & Eng. (2010).
"""

from __future__ import annotations

from collections.abc import Sequence

from trunnion.algebra.linalg import dot
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import Frame, Vector2
from trunnion.groups.dyad import Dyad, DyadPose, Elements, pinned, root

__all__ = ["RRR", "meet"]


def meet(b: Vector2, d: Vector2, bc: Number, cd: Number, branch: int) -> Vector2:
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


class RRR(Dyad):
    """Condition: 2/|sin μ|, μ the transmission angle between BC and DC; lost is the cosine of it."""

    letters = "RRR"

    def position(self, elements: Elements, assembly: int, drive: Sequence[Number] = ()) -> DyadPose:
        """Pose of both links. assembly: ±1, C left or right of B→D."""
        (b, b_i), (c_i, c_j), (d, d_j) = elements
        side_i = (c_i.x - b_i.x, c_i.y - b_i.y)
        side_j = (c_j.x - d_j.x, c_j.y - d_j.y)
        xp = namespace(*side_i, *side_j)
        lengths = xp.hypot(*side_i), xp.hypot(*side_j)
        bc = meet((b.x, b.y), (d.x, d.y), *lengths, assembly)
        dc = (bc[0] - (d.x - b.x), bc[1] - (d.y - b.y))
        frames = (
            pinned(b, b_i, bc, side_i, lengths[0] * lengths[0]),
            pinned(d, d_j, dc, side_j, lengths[1] * lengths[1]),
        )
        pin = Frame(b.x + bc[0], b.y + bc[1])
        xp = namespace(*bc)
        gap = xp.abs(xp.sqrt(dot(bc, bc)) - lengths[0]) + xp.abs(xp.sqrt(dot(dc, dc)) - lengths[1])
        return self.posed(elements, frames, pin, dot(bc, dc), lengths[0] * lengths[1], gap)
