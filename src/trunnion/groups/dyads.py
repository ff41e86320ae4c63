"""The dyads, groups of class II in the plane: their positions in closed form.

    h --B-- i --C-- j --D-- k        h, k: known links; i, j: the group; letters: of the joints B, C, D

Joint order B, C, D, sides (h, i), (i, j), (k, j): `elements` is ((B on h, B on i), (C on i, C on j), (D on k, D on j)).
The rest is that of every dyad, see `groups.dyad`: its two equations for the force in C are, of RRR, the moments about B
on link i and about D on link j, BC × F_ij = M_i and DC × F_ij = −M_j, which is [D 12-13] with [D 6-7] inserted.

[D] S. Durango, G. Calle, O. Ruiz, J. Braz. Soc. Mech. Sci. & Eng. (2010).
"""

from __future__ import annotations

from collections.abc import Sequence

from trunnion.algebra.linalg import cross, dot
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import Frame, Vector2, compose, point_of, relative, turned_vector
from trunnion.groups.dyad import Dyad, DyadPose, Elements, pinned, root, shifted


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


class RRP(Dyad):
    """A connecting rod and a slider on the guide D.

    With the unit vectors u along the guide and n = z × u, the rod is B→C = r u + p n: p is known, since the slider j
    keeps its direction, and r = ± √(|BC|² − p²). Offsets, guides at any angle and on moving links are in p.

    Condition: 2 |BC|/|r|: a dead centre is where the rod stands across the guide. [extends D 2-13 to the slider]
    """

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


class RPR(Dyad):
    """Two links on outer pins, j sliding in the guide C on i.

    Both links have one direction: that of the unit vector u along the slide, with
    n = z × u. B→D = X u + e n with the constant offset e, so X = ± √(|BD|² − e²).

    Condition: 2 |BD|/|X|: a dead centre is where the slide is across BD.
    """

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


class PRP(Dyad):
    """A pin between two sliders.

    Both links keep the directions of their guides, so C is where its two paths, along u (guide B) and v (guide D),
    meet: one assembly.

    Condition: 2/|sin| of the angle between the guides.
    """

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


class RPP(Dyad):
    """An outer pin and two slides.

    Both links keep the direction that the guide D on k gives them, so the link i is known from its pin, and j is where
    the slides along u (guide C on i) and v (guide D) meet: one assembly.

    Condition: 2/|sin| of the angle between the guides.
    """

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
