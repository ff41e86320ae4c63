"""The dyad of three cylindrical pairs in space: its position in closed form, by the kernel of `groups.ccc`.

    h --B-- i --C-- j --D-- k        h, k: known links; i, j: the group

The kernel finds the axis ĉ from the known axes b̂, d̂ and the dual angles that the links keep between their two axes. An
axis and its neighbour then fix each link. Velocities, accelerations and reactions are those of the general group.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from trunnion.algebra.lines import dual_angle, line
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.space import Frame, compose, relative, vector_minus
from trunnion.algebra.vector import Vector3, cross, dot, plus, scaled, unit, vector_parts
from trunnion.groups import ccc
from trunnion.groups.spatial import SpatialGroup
from trunnion.groups.tree import OUTER, Element, Pose


class CylindricalDyad(SpatialGroup):
    """Joints in the order outer, inner, outer; links: that of the first outer joint, then the other."""

    BRANCHES = (1, -1)

    def position(self, elements: Sequence[Element], assembly: int, drive: Sequence[Number] = (), late: int = 0) -> Pose:
        """Pose of the assembly ±1: the sign of ĉ · (b̂ × d̂); NaN where the axes do not reach each other."""
        with np.errstate(all="ignore"):
            outer = [self._of(elements, k, OUTER) for k in (0, 2)]
            local = [[self._of(elements, k, link) for k in (link, link + 1)] for link in (0, 1)]
            b, d = (line(frame.place, frame.z) for frame in outer)
            sides = [[line(frame.place, frame.z) for frame in pair] for pair in local]
            bc, cd = (dual_angle(*pair) for pair in sides)
            c = ccc.meet(b, d, bc, cd, assembly)
            frames = [
                relative(_triad(*found_axes), _triad(*side))
                for found_axes, side in zip(((b, c), (c, d)), sides, strict=True)
            ]
            q = [self._coordinates(elements, frames, k) for k in range(3)]
            return self._posed(elements, q, self.size(elements))

    def _of(self, elements: Sequence[Element], joint: int, link: int) -> Frame:
        """The element of a joint on a link."""
        frame: Frame = elements[joint][self.joints[joint].sides.index(link)]
        return frame

    def _coordinates(self, elements: Sequence[Element], frames: Sequence[Frame], k: int) -> list[Number]:
        """Turn and slide of a joint from the frames of the links."""
        first, second = (
            elements[k][side] if link == OUTER else compose(frames[link], elements[k][side])
            for side, link in enumerate(self.joints[k].sides)
        )
        sine, cosine = dot(second.x, first.y), dot(second.x, first.x)
        turn = namespace(sine, cosine).arctan2(sine, cosine)
        return [turn, dot(vector_minus(second.place, first.place), first.z)]


def _triad(first: Vector3, second: Vector3) -> Frame:
    """The frame of two lines: x along the first, z along their common perpendicular, which it lies on."""
    u, m = vector_parts(first)
    n, k = vector_parts(unit(cross(first, second)))
    place = plus(cross(u, m), scaled(dot(k, cross(u, n)), u))
    return Frame(u, cross(n, u), n, place)
