"""The class II group with a prismatic pair between two links on outer pins (dyad RPR): its position in closed form.

    h --B-- i ==C== j --D-- k        h, k: known links; C: the guide on i, in which j slides

Joint order B, C, D, sides (h, i), (i, j), (k, j). Both links have one direction: that of the unit vector u along
the slide, with n = z × u. B→D = X u + e n with the constant offset e, so X = ± √(|BD|² − e²).
"""

from __future__ import annotations

from collections.abc import Sequence

from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import Frame, relative, turned_vector
from trunnion.groups.dyad import Dyad, DyadPose, Elements, root

__all__ = ["RPR"]


class RPR(Dyad):
    """Condition: 2 |BD|/|X|: a dead centre is where the slide is across BD."""

    letters = "RPR"

    def position(self, elements: Elements, assembly: int, drive: Sequence[Number] = ()) -> DyadPose:
        """Pose of both links. assembly: ±1, D ahead of B along the slide's axis or behind it."""
        (b, b_i), (c_i, c_j), (d, d_j) = elements
        # places of the pins in the frame of the slide: x along it, origin at the link's element of C
        b_along, b_across = turned_vector(c_i.c, -c_i.s, b_i.x - c_i.x, b_i.y - c_i.y)
        d_along, d_across = turned_vector(c_j.c, -c_j.s, d_j.x - c_j.x, d_j.y - c_j.y)
        offset = d_across - b_across
        x, y = d.x - b.x, d.y - b.y
        square = x * x + y * y
        xp = namespace(square, offset)
        along = assembly * root(square - offset * offset, square)
        u = ((along * x + offset * y) / square, (along * y - offset * x) / square)
        to_b, to_d = turned_vector(*u, b_along, b_across), turned_vector(*u, d_along, d_across)
        on_j = Frame(d.x - to_d[0], d.y - to_d[1], *u)
        frames = relative(Frame(b.x - to_b[0], b.y - to_b[1], *u), c_i), relative(on_j, c_j)
        gap = xp.abs((x * u[1] - y * u[0]) + offset)
        return self.posed(elements, frames, on_j, offset, xp.sqrt(square), gap)
