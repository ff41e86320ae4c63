"""The class II group with an outer pin and two prismatic pairs (dyad RPP): its position in closed form.

    h --B-- i ==C== j ==D== k        h, k: known links; C: guide on i, D: guide on k

Joint order B, C, D, sides (h, i), (i, j), (k, j). Both links keep the direction that the guide D gives them, so the
link i is known from its pin, and j is where the slides along u (guide C) and v (guide D) meet: one assembly.
"""

from __future__ import annotations

from collections.abc import Sequence

from trunnion.algebra.linalg import cross, dot
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import Frame, compose, relative, turned_vector
from trunnion.groups.dyad import Dyad, DyadPose, Elements, shifted

__all__ = ["RPP"]


class RPP(Dyad):
    """Condition: 2/|sin| of the angle between the guides."""

    letters = "RPP"
    BRANCHES = (1,)

    def position(self, elements: Elements, assembly: int = 1, drive: Sequence[Number] = ()) -> DyadPose:
        """Pose of both links; there is one."""
        (b, b_i), (c_i, c_j), (d, d_j) = elements
        rest_j = relative(d, d_j)
        guide = compose(rest_j, c_j)  # direction of the slide C; its place only once j is placed
        aligned = relative(Frame(0.0, 0.0, guide.c, guide.s), c_i)
        arm = turned_vector(aligned.c, aligned.s, b_i.x, b_i.y)
        frame_i = Frame(b.x - arm[0], b.y - arm[1], aligned.c, aligned.s)
        on_i = compose(frame_i, c_i)
        u, v = (guide.c, guide.s), (d.c, d.s)
        frame_j = shifted(rest_j, v, cross((guide.x - on_i.x, guide.y - on_i.y), u) / cross(u, v))
        on_j = compose(frame_j, c_j)
        gap = namespace(on_j.x).abs(cross((on_j.x - on_i.x, on_j.y - on_i.y), u))
        return self.posed(elements, (frame_i, frame_j), on_j, dot(u, v), 1.0, gap)
