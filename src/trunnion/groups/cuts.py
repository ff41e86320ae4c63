"""The constraints of a cut joint: what must be zero for a loop to be closed.

A cut revolute pair asks its two points to meet (x, y); a cut prismatic pair asks the second point to stay on the
axis of the first (across) and their directions to agree (turn). A driven one also prescribes its coordinate:
turn for a revolute pair, along for a prismatic one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import Acceleration, Frame, Twist, Wrench, accelerated, moved, turned
from trunnion.groups.gear import NUMBERS, ONE, GearPair, GearRow
from trunnion.groups.tree import OUTER, GroupJoint, Step

__all__ = ["CutRow", "rows"]

Pairs = Sequence[tuple[Frame, Frame]]


class CutRow(NamedTuple):
    """One constraint. drive: index of the prescribed coordinate it holds, −1 if none.

    The methods take the elements of the joint's first and second side and their motion (global axes).
    """

    joint: int
    kind: str
    drive: int

    @property
    def is_length(self) -> bool:
        """Whether it is measured in metres, not radians."""
        return self.kind != "turn"

    def _driven(self, drive: Sequence[Number]) -> Number:
        return drive[self.drive] if self.drive >= 0 else 0.0

    def direction(self, first: Frame) -> tuple[Number, Number]:
        """Unit vector along which a length is measured."""
        if self.kind == "x":
            return 1.0, 0.0
        if self.kind == "y":
            return 0.0, 1.0
        return (first.c, first.s) if self.kind == "along" else (-first.s, first.c)

    def component(self, first: Frame, x: Number, y: Number) -> Number:
        """Component of a vector along `direction`."""
        if self.kind == "x":
            return x
        if self.kind == "y":
            return y
        ux, uy = self.direction(first)
        return ux * x + uy * y

    def terms(self, drive: Sequence[Number]) -> list[tuple[int, Number]]:
        """Joints whose relative motion opens it, with factors."""
        return [(self.joint, ONE)]

    def gap(self, placed: Pairs, q: Sequence[Number], drive: Sequence[Number]) -> Number:
        """By how much the joint is open, m or rad (turned back by the prescribed angle, within half a turn)."""
        first, second = placed[self.joint]
        if self.kind != "turn":
            return self.component(first, second.x - first.x, second.y - first.y) - self._driven(drive)
        driven = self._driven(drive)
        xp = namespace(driven)
        c, s = turned(xp.cos(driven), -xp.sin(driven), second.c, second.s)
        sine, cosine = first.c * s - first.s * c, first.c * c + first.s * s
        return namespace(sine, cosine).arctan2(sine, cosine)

    def entry(self, first: Frame, screw: Twist) -> Number:
        """Rate of the gap when the second side moves by `screw` (of the second point) against the first."""
        return screw.w if self.kind == "turn" else self.component(first, screw.x, screw.y)

    def rate(self, placed: Pairs, ends: Callable[[int], tuple[Twist, Twist]], drive: Sequence[Number]) -> Number:
        """Rate of the gap. ends: velocities of the two elements of a joint."""
        (first, second), (one, two) = placed[self.joint], ends(self.joint)
        if self.kind == "turn":
            return two.w - one.w - self._driven(drive)
        carried = moved(one, second.x - first.x, second.y - first.y)
        return self.component(first, two.x - carried.x, two.y - carried.y) - self._driven(drive)

    def second(
        self,
        placed: Pairs,
        ends: Callable[[int], tuple[Twist, Twist]],
        seconds: Callable[[int], tuple[Acceleration, Acceleration]],
        drive: Sequence[Number],
    ) -> Number:
        """Second derivative of the gap; across a slide it holds the Coriolis term 2 ω ṡ."""
        (first, second), (v1, v2), (one, two) = placed[self.joint], ends(self.joint), seconds(self.joint)
        if self.kind == "turn":
            return two.w - one.w - self._driven(drive)
        dx, dy = second.x - first.x, second.y - first.y
        carried = accelerated(one, v1.w, dx, dy)
        gap = self.component(first, two.x - carried.x, two.y - carried.y) - self._driven(drive)
        if self.kind != "across":
            return gap
        v1 = moved(v1, dx, dy)
        return gap - 2 * v1.w * (first.c * (v2.x - v1.x) + first.s * (v2.y - v1.y))

    def wrench(self, first: Frame, size: Number) -> Wrench:
        """The wrench on the second side, about its point, that the multiplier of this constraint stands for."""
        if self.kind == "turn":
            return Wrench(0.0, 0.0, size)
        x, y = self.direction(first)
        return Wrench(size * x, size * y, 0.0)


def rows(
    joints: Sequence[GroupJoint], steps: Sequence[Step], driven: Sequence[int], gears: Sequence[GearPair]
) -> tuple[CutRow | GearRow, ...]:
    """Constraints of the joints that the tree leaves out and of the gear pairs, in the order of the rows of J."""
    found: list[CutRow | GearRow] = []
    place = {step.joint: i for i, step in enumerate(steps)}
    for k, joint in enumerate(joints):
        if k in place or joint.sides == (OUTER, OUTER):
            continue
        turns = joint.pair.turns
        found += [CutRow(k, kind, -1) for kind in (("x", "y") if turns else ("across", "turn"))]
        if k in driven:
            found.append(CutRow(k, "turn" if turns else "along", driven.index(k)))
    for i, gear in enumerate(gears):
        found.append(GearRow(gear, len(driven) + NUMBERS * i, place.get(gear.first, -1)))
    return tuple(found)
