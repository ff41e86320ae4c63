"""The class II group with a pin between two sliders (dyad PRP): its position in closed form.

    h ==B== i --C-- j ==D== k        h, k: known links with the guides B and D

Joint order B, C, D, sides (h, i), (i, j), (k, j). Both links keep the directions of their guides, so C is where
its two paths, along u (guide B) and v (guide D), meet: one assembly.
"""

from __future__ import annotations

from collections.abc import Sequence

from trunnion.algebra.linalg import cross, dot
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import compose, relative
from trunnion.groups.dyad import Dyad, DyadPose, Elements, shifted

__all__ = ["PRP"]


class PRP(Dyad):
    """Condition: 2/|sin| of the angle between the guides."""

    letters = "PRP"
    BRANCHES = (1,)

    def position(self, elements: Elements, assembly: int = 1, drive: Sequence[Number] = ()) -> DyadPose:
        """Pose of both sliders; there is one."""
        (b, b_i), (c_i, c_j), (d, d_j) = elements
        u, v = (b.c, b.s), (d.c, d.s)
        rest_i, rest_j = relative(b, b_i), relative(d, d_j)
        first, two = compose(rest_i, c_i), compose(rest_j, c_j)
        apart = (two.x - first.x, two.y - first.y)
        inverse = 1 / cross(u, v)
        frame_i = shifted(rest_i, u, cross(apart, v) * inverse)
        frame_j = shifted(rest_j, v, cross(apart, u) * inverse)
        on_i, on_j = compose(frame_i, c_i), compose(frame_j, c_j)
        xp = namespace(on_i.x, on_j.x)
        gap = xp.abs(on_i.x - on_j.x) + xp.abs(on_i.y - on_j.y)
        return self.posed(elements, (frame_i, frame_j), on_j, dot(u, v), 1.0, gap)
