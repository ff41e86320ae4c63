"""Groups of class II in the plane: what all dyads have in common once their links are placed.

    h --B-- i --C-- j --D-- k        h, k: known links; i, j: the group

Joint order B, C, D, sides (h, i), (i, j), (k, j). The links move by one freedom each against a known link, so that
V_i = V_h + p s_B and V_j = V_k + q s_D with the screws of B and D. C passes two unit wrenches W, on whose way it does
not move: W · (V_j − V_i) = 0 are two equations for p and q. Derived once they give the accelerations, and their
transpose the wrench λ₁ W₁ + λ₂ W₂ in C: with it the loads of i do no work on s_B, those of j none on s_D.
This is the chord C of `groups.tree`, written out for two links; each dyad adds its position in closed form.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar, NamedTuple

import numpy as np

from trunnion.algebra import literal
from trunnion.algebra.literal import less
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import (
    Frame,
    Twist,
    Vector2,
    Wrench,
    about,
    added,
    bracket,
    line_of,
    minus,
    place_of,
    power,
    times,
    turned_vector,
    velocity_at,
)

Elements = Sequence[tuple[Frame, Frame]]  # per joint: its element on the first and on the second link
ROUNDING = 1e-15  # of the terms of a difference: a few units in the last place


class DyadPose(NamedTuple):
    """Frames of i, j; screws of B, C, D; the wrenches that C passes; their powers and 1/determinant of these.

    place: of C; lost: what is lost of the force that one link puts on the other, as 1/area is what moves; scale: of
    both together; closure: opening of the dyad, m.
    """

    frames: tuple[Frame, Frame]
    screws: tuple[Twist, Twist, Twist]
    walls: tuple[Wrench, Wrench]
    matrix: tuple[Vector2, Vector2]
    area: Number
    place: Vector2
    lost: Number
    scale: Number
    closure: Number


class Dyad(ABC):
    """A dyad; letters: of its joints B, C, D."""

    letters: ClassVar[str]
    BRANCHES: ClassVar[tuple[int, ...]] = (1, -1)

    @abstractmethod
    def position(self, elements: Elements, assembly: int, drive: Sequence[Number] = ()) -> DyadPose:
        """Pose of both links in an assembly ±1; NaN where there is none.

        elements: (B on h, B on i), (C on i, C on j), (D on k, D on j); those on h and k global, else local; m.
        """

    def posed(
        self,
        elements: Elements,
        frames: tuple[Frame, Frame],
        inner: Frame,
        lost: Number,
        scale: Number,
        closure: Number,
    ) -> DyadPose:
        """The pose from the frames of the links. inner: the element of C on j, global; lost, scale: see `DyadPose`."""
        b, d = elements[0][0], elements[2][0]
        slides = [letter == "P" for letter in self.letters]
        s_b, s_c, s_d = (
            Twist(frame.c, frame.s, 0.0) if slide else line_of(frame)
            for frame, slide in zip((b, inner, d), slides, strict=True)
        )
        place = place_of(inner)
        walls = Wrench(1.0, 0.0, -place[1]), Wrench(0.0, 1.0, place[0])
        if slides[1]:
            walls = about((-inner.s, inner.c), 0.0, place), Wrench(0.0, 0.0, 1.0)
        matrix = (-power(walls[0], s_b), power(walls[0], s_d)), (-power(walls[1], s_b), power(walls[1], s_d))
        moves = less(literal.times(matrix[0][0], matrix[1][1]), literal.times(matrix[0][1], matrix[1][0]))
        area = 1 / (np.float64(moves) if isinstance(moves, float) else moves)  # of Python's own 0 it would raise
        return DyadPose(frames, (s_b, s_c, s_d), walls, matrix, area, place, lost, scale, closure)

    def moved(
        self,
        pose: DyadPose,
        outer: Sequence[Any],
        outer_seconds: Sequence[Any],
        drive: Sequence[Number] = (),
        seconds: Sequence[Number] = (),
    ) -> tuple[list[Twist], list[Twist]]:
        """Twists of the links and their derivatives, from those of h and k; see `Tree.moved`."""
        (h, _, k), (s_b, s_c, s_d) = outer, pose.screws
        p, q = self._rates(pose, minus(h, k))
        first, two = times(p, s_b), times(q, s_d)
        twists = [added(h, first), added(k, two)]
        across = minus(twists[1], twists[0])
        rate = across.w
        if self.letters[1] == "P":
            x, y = velocity_at(across, pose.place)
            rate = s_c.x * x + s_c.y * y
        carried = [bracket(h, first), bracket(twists[0], times(rate, s_c)), bracket(k, two)]
        on_i, on_j = added(outer_seconds[0], carried[0]), added(outer_seconds[2], carried[2])
        p, q = self._rates(pose, minus(added(on_i, carried[1]), on_j))
        return twists, [added(on_i, times(p, s_b)), added(on_j, times(q, s_d))]

    def _rates(self, pose: DyadPose, jump: Twist) -> Vector2:
        """(p, q) with W · (q s_D − p s_B) = W · jump for both wrenches; none in a dead centre."""
        first, second = power(pose.walls[0], jump), power(pose.walls[1], jump)
        (a, b), (c, d) = pose.matrix
        times_ = literal.times
        return (
            times_(less(times_(first, d), times_(b, second)), pose.area),
            times_(less(times_(a, second), times_(c, first)), pose.area),
        )

    def reactions(self, pose: DyadPose, loads: Sequence[Wrench]) -> list[Wrench]:
        """Reactions on i at B, on j at C and at D, about the origin.

        loads: all else that acts on i and j, inertia and friction included.  [D 2-7, with friction 12-13]
        """
        (s_b, _, s_d), ((a, b), (c, d)) = pose.screws, pose.matrix
        p, q = (literal.times(power(load, screw), pose.area) for load, screw in zip(loads, (s_b, s_d), strict=True))
        first = less(literal.times(q, c), literal.times(p, d))
        second = less(literal.times(p, b), literal.times(q, a))
        at_c = added(times(first, pose.walls[0]), times(second, pose.walls[1]))
        return [minus(at_c, loads[0]), at_c, times(-1.0, added(at_c, loads[1]))]

    def signature(self, pose: DyadPose, spread: float) -> list[Number]:
        """Numbers that tell assemblies apart: places, over the spread, and directions of the links."""
        return [n for frame in pose.frames for n in (frame.x / spread, frame.y / spread, frame.c, frame.s)]

    def closure(self, pose: DyadPose) -> Number:
        """By how much the dyad is open, m."""
        return pose.closure

    def condition(self, pose: DyadPose) -> Number:
        """Frobenius condition of the unit vectors of its dead centre: 2 at best, without bound there."""
        return 2 * pose.scale * namespace(pose.area).abs(pose.area)


def pinned(pin: Frame, local: Frame, reach: Vector2, side: Vector2, square: Number) -> Frame:
    """Frame of a link whose pin (`local`) has a known place and whose side, `side` in local axes, lies along `reach`.

    square: squared length of the side, m².
    """
    c, s = turned_vector(side[0] / square, -side[1] / square, *reach)
    arm = turned_vector(c, s, local.x, local.y)
    return Frame(pin.x - arm[0], pin.y - arm[1], c, s)


def shifted(frame: Frame, direction: Vector2, by: Number) -> Frame:
    """The frame moved along a direction."""
    return Frame(frame.x + by * direction[0], frame.y + by * direction[1], frame.c, frame.s)


def root(square: Number, scale: Number) -> Number:
    """√square, where a dead centre makes it 0: what rounding leaves below 0, of the terms `scale`, counts as 0.

    Anything further below is NaN: there is no position.
    """
    xp = namespace(square, scale)
    return xp.sqrt(xp.where((square < 0) & (square > -ROUNDING * scale), 0.0, square))
