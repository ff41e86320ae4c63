"""The class II group with two revolute pairs and an outer prismatic one (dyad RRP): its position in closed form.

    h --B-- i --C-- j ==D== k        h, k: known links; i: the connecting rod, j: the slider; D: the guide on k

Joint order B, C, D, sides (h, i), (i, j), (k, j). With the unit vectors u along the guide and n = z × u, the rod
is B→C = r u + p n: p is known, since j keeps its direction, and r = ± √(|BC|² − p²). Offsets, guides at any angle
and on moving links are in p.  [extends D 2-13 to the slider; checked against the general group]
"""

from __future__ import annotations

from collections.abc import Sequence

from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import Frame, compose, point_of, relative
from trunnion.groups.dyad import Dyad, DyadPose, Elements, pinned, root

__all__ = ["RRP"]


class RRP(Dyad):
    """Condition: 2 |BC|/|r|: a dead centre is where the rod stands across the guide."""

    letters = "RRP"

    def position(self, elements: Elements, assembly: int, drive: Sequence[Number] = ()) -> DyadPose:
        """Pose of rod and slider. assembly: ±1, C ahead of B (along the guide's axis) or behind it."""
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
        pin = Frame(b.x + bc[0], b.y + bc[1])
        slider = Frame(rest.x + (pin.x - at_rest.x), rest.y + (pin.y - at_rest.y), rest.c, rest.s)
        x, y = point_of(slider, (d_j.x, d_j.y))
        gap = xp.abs((y - d.y) * u[0] - (x - d.x) * u[1])
        return self.posed(elements, (pinned(b, b_i, bc, side, square), slider), pin, p, xp.sqrt(square), gap)
