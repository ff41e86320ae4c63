"""The first-class mechanism: one link on one driven pair, revolute or prismatic.  [D 14-16]

Joint order: the driven joint, sides (base, driven link). Its coordinate is the turn (rad) or slide (m) of the
second link against the first; the reaction includes the drive effort along the freedom [D 15].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import Acceleration, Frame, Twist, Wrench, about, accelerated, moved, relative, turned
from trunnion.groups.protocol import Elements

__all__ = ["PRISMATIC", "REVOLUTE", "DriverGroup", "DriverPose"]


class DriverPose(NamedTuple):
    """Frame of the driven link; its joint element (point, direction of the slide); base point → element."""

    frames: tuple[Frame]
    element: Frame
    slide: tuple[Number, Number]


@dataclass(frozen=True)
class DriverGroup:
    """A driver; `slides` tells a prismatic pair from a revolute one."""

    slides: bool
    BRANCHES: ClassVar[tuple[int, ...]] = (1,)

    def position(self, elements: Elements, assembly: object, drive: Sequence[Number] = ()) -> DriverPose:
        """Pose of the driven link from the base element (global), its own (local) and the coordinate."""
        ((base, local),) = elements
        (q,) = drive
        if self.slides:
            slide = (base.c * q, base.s * q)
            element = Frame(base.x + slide[0], base.y + slide[1], base.c, base.s)
        else:
            xp = namespace(q)
            slide = (0.0, 0.0)
            c, s = turned(xp.cos(q), xp.sin(q), base.c, base.s)
            element = Frame(base.x, base.y, c, s)
        return DriverPose((relative(element, local),), element, slide)

    def velocity(self, pose: DriverPose, outer: Sequence[Twist | None], drive: Sequence[Number] = ()) -> list[Twist]:
        """outer: velocity of the base element's point; drive: rate of the coordinate."""
        (base,), (rate,) = outer, drive
        if base is None:
            raise ValueError("a driver needs the motion of its base")
        if self.slides:
            at = moved(base, *pose.slide)
            at = Twist(at.x + pose.element.c * rate, at.y + pose.element.s * rate, at.w)
        else:
            at = Twist(base.x, base.y, base.w + rate)
        return [moved(at, *self._to_origin(pose))]

    def acceleration(
        self,
        pose: DriverPose,
        twists: Sequence[Twist],
        outer_twists: Sequence[Twist | None],
        outer: Sequence[Acceleration | None],
        drive: Sequence[Number] = (),
        rates: Sequence[Number] = (),
    ) -> list[Acceleration]:
        """drive: second derivative of the coordinate; rates: its first (Coriolis term of a slide)."""
        (base,), (second,), (rate,) = outer, drive, rates
        if base is None:
            raise ValueError("a driver needs the motion of its base")
        w = twists[0].w
        if self.slides:
            at = accelerated(base, w, *pose.slide)
            c, s = pose.element.c, pose.element.s
            coriolis = 2 * w * rate
            at = Acceleration(at.x + c * second - s * coriolis, at.y + s * second + c * coriolis, at.w)
        else:
            at = Acceleration(base.x, base.y, base.w + second)
        return [accelerated(at, w, *self._to_origin(pose))]

    def reactions(self, pose: DriverPose, loads: Sequence[Wrench]) -> list[Wrench]:
        """F_0h = −F_h [D 14] and the moment that balances the link about the joint [D 15]."""
        dx, dy = self._to_origin(pose)
        load = about(loads[0], -dx, -dy)
        return [Wrench(-load.x, -load.y, -load.m)]

    def closure(self, pose: DriverPose) -> Number:
        """Nothing closes: 0."""
        return 0.0

    def condition(self, pose: DriverPose) -> Number:
        """A driver has no dead centre: 1."""
        return 1.0

    @staticmethod
    def _to_origin(pose: DriverPose) -> tuple[Number, Number]:
        (frame,) = pose.frames
        return frame.x - pose.element.x, frame.y - pose.element.y


REVOLUTE = DriverGroup(slides=False)
PRISMATIC = DriverGroup(slides=True)
