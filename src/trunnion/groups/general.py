"""Any planar module: what its chords ask for, and gear pairs.

The coordinates are those of the tree. A pin that the tree leaves out asks two points to meet, a guide asks a point to
stay on the axis and two directions to agree; a driven one also prescribes its coordinate.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from trunnion.algebra import plane
from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number
from trunnion.algebra.plane import Frame, Twist, Wrench, about, place_of, velocity_at
from trunnion.groups.gear import NUMBERS, GearPair, actions, slide_of, turn_from
from trunnion.groups.tree import Coordinates, Element, Pose, Tree
from trunnion.joints.pairs import MOTIONS, PairMotion


@dataclass(frozen=True)
class General(Tree):
    """The planar module with the given joints and gear pairs.

    A joint between known links that a gear pair speaks of is listed too, at the end, with both sides OUTER. After the
    driven coordinates the drive holds three numbers for each gear pair (see `gear.NUMBERS`). After the reactions of the
    joints come the gear pairs, each with the torque, or force along the slide, that it puts into its second joint, as a
    moment.
    """

    gears: tuple[GearPair, ...] = ()
    algebra: ClassVar[Any] = plane
    motions: ClassVar[Mapping[str, PairMotion]] = MOTIONS["planar"]

    @property
    def first(self) -> Sequence[int]:
        """Driven joints, then those that gear pairs start from, whose turns are then counted."""
        return [*self.driven, *(gear.first for gear in self.gears)]

    @cached_property
    def order(self) -> tuple[int, ...]:
        """Joints of the tree, and driven chords, whose coordinates are prescribed."""
        inside = tuple(step.joint for step in self.steps)
        return inside + tuple(k for k in self.driven if k not in inside)

    @property
    def asks(self) -> bool:
        """Whether a chord or a gear pair does."""
        return bool(self.chords or self.gears)

    def count(self, chord: int) -> int:
        """A driven chord holds its second element as a whole."""
        return 3 if chord in self.driven else 2

    def gaps(self, placed: Sequence[Element], q: Coordinates, size: Number, drive: Sequence[Number]) -> list[Number]:
        """Lengths over the size, and turns in rad, taken back by the prescribed angle, within half a turn."""
        rows: list[Number] = []
        for k in self.chords:
            first, second = placed[k][:2]
            aim = self.motion(k).place(first, q[k]) if k in self.driven else first
            aligned = k in self.driven or not self.joints[k].pair.turns  # it asks for a direction, too
            gap = Twist(second.x - aim.x, second.y - aim.y, turn_from(aim, second, 0.0) if aligned else 0.0)
            rows += self._components(k, first, gap, size)
        for i, gear in enumerate(self.gears):  # φ₂ − i φ₁ − φ₀, of a turn within half a turn
            slot = len(self.driven) + NUMBERS * i
            ratio, phase, near = drive[slot : slot + NUMBERS]
            if any(step.joint == gear.first for step in self.steps):
                start = q[gear.first][0]
            elif gear.slide == 0:
                start = slide_of(placed[gear.first])
            else:
                start = near + turn_from(*placed[gear.first][:2], near)
            aim, second = ratio * start + phase, placed[gear.second][:2]
            rows.append((slide_of(second) - aim) / size if gear.slide == 1 else turn_from(*second, aim))
        return rows

    def _components(self, chord: int, first: Frame, gap: Twist, size: Number) -> list[Number]:
        """The rows of a chord of how its point on the second link moves, or is off, and how that link turns."""
        if chord in self.driven:
            return [gap.x / size, gap.y / size, gap.w]
        if self.joints[chord].pair.turns:
            return [gap.x / size, gap.y / size]
        return [(first.c * gap.y - first.s * gap.x) / size, gap.w]

    def opening(self, placed: Sequence[Element], q: Coordinates, size: Number) -> Number:
        """Largest distance by which a chord is open, m."""
        worst: Number = 0.0
        for k in self.chords:
            first, second = placed[k][:2]
            aim = self.motion(k).place(first, q[k]) if k in self.driven else first
            rows = self._components(k, first, Twist(second.x - aim.x, second.y - aim.y, 0.0), 1.0)
            for length in rows if self.joints[k].pair.turns or k in self.driven else rows[:1]:
                worst = np.maximum(worst, np.abs(primal(length)))
        return worst

    def entries(self, chord: int, pair: Element, screw: Twist, size: Number, slides: bool = False) -> list[Number]:
        """See `Tree.entries`."""
        velocity = Twist(*velocity_at(screw, place_of(pair[1])), screw.w)
        return self._components(chord, pair[0], velocity, 1.0 if slides else size)

    def cut_wrench(self, pose: Pose, chord: int, multipliers: Sequence[Number]) -> Wrench:
        """See `Tree.cut_wrench`."""
        first, second = pose.elements[chord][:2]
        force: tuple[Number, Number]
        moment: Number = 0.0
        if chord in self.driven or self.joints[chord].pair.turns:
            force = multipliers[0] / pose.size, multipliers[1] / pose.size
            moment = multipliers[2] if chord in self.driven else 0.0
        else:
            across = multipliers[0] / pose.size
            force, moment = (-first.s * across, first.c * across), multipliers[1]
        return about(force, moment, place_of(second))

    def own_rates(self, pose: Pose, chord: int, rates: Sequence[Number], relative: Twist) -> Sequence[Number]:
        """Of a chord that is not driven from the twist across it."""
        if chord in self.driven:
            return rates
        if self.joints[chord].pair.turns:
            return [relative.w]
        first, second = pose.elements[chord][:2]
        x, y = velocity_at(relative, place_of(second))
        return [first.c * x + first.s * y]

    # ---- gear pairs -------------------------------------------------------------------------------------------

    def _newton(
        self, elements: Sequence[Any], q: Coordinates, size: Number, drive: Sequence[Number], rounds: int
    ) -> Coordinates:
        """From where a known wheel tells its rack to be, or the reverse: that may be many sizes and turns away."""
        inside = {step.joint for step in self.steps}
        q = [list(values) for values in q]
        for i, gear in enumerate(self.gears):
            if gear.slide is None or gear.second not in inside or gear.second in self.driven:
                continue
            ratio, phase, near = drive[len(self.driven) + NUMBERS * i :][:NUMBERS]
            if gear.first in self.driven:
                q[gear.second] = [ratio * q[gear.first][0] + phase]
            elif gear.first not in inside:
                q[gear.second] = [ratio * (slide_of(elements[gear.first]) if gear.slide == 0 else near) + phase]
        return super()._newton(elements, q, size, drive, rounds)

    def further_rows(
        self, placed: Sequence[Element], screws: Sequence[list[Twist]], drive: Sequence[Number], size: Number
    ) -> list[list[Number]]:
        """Rate of φ₂ − i φ₁ of each gear pair, lengths over the size."""
        rows = []
        for gear, ratio in zip(self.gears, drive[len(self.driven) :: NUMBERS], strict=True):
            row: list[Number] = []
            for k, i in self.free:
                entry: Number = 0.0
                for (joint, slides), factor in zip(gear.joints, (-ratio, 1.0), strict=True):
                    if weight := self.weight(k, joint):
                        entry = entry + weight * factor * _rate(placed[joint], screws[k][i], slides)
                if gear.slide is not None:
                    entry = entry * (size if self.slides(k, i) else 1.0) / (size if gear.slide == 1 else 1.0)
                row.append(entry)
            rows.append(row)
        return rows

    def further_rates(self, pose: Pose, twists: Sequence[Twist], outer: Sequence[Any]) -> list[Number]:
        """Of each gear pair, from the turns and slides of its joints; what carries a slide along lies across it."""
        rates = []
        for gear, ratio in zip(self.gears, pose.ratios, strict=True):
            first, second = (
                _rate(pose.elements[k], self.across(k, twists, outer), slides) for k, slides in gear.joints
            )
            rate = second - ratio * first
            rates.append(rate / pose.size if gear.slide == 1 else rate)
        return rates

    def _efforts(self, pose: Pose, multipliers: Sequence[Number]) -> list[Number]:
        """Torque, N m, or force, N, that each gear pair puts into its second joint."""
        last = multipliers[len(multipliers) - len(self.gears) :]
        return [
            effort / pose.size if gear.slide == 1 else effort for gear, effort in zip(self.gears, last, strict=True)
        ]

    def further_loads(self, pose: Pose, multipliers: Sequence[Number]) -> list[tuple[int, Wrench]]:
        """Tooth forces, or torques alone."""
        return [
            (self.joints[force.joint].sides[force.side], force.wrench)
            for gear, ratio, effort in zip(self.gears, pose.ratios, self._efforts(pose, multipliers), strict=True)
            for force in actions(gear, pose.elements, ratio, effort)
        ]

    def link_by_link(self, pose: Pose, loads: Sequence[Wrench], multipliers: Sequence[Number]) -> list[Wrench]:
        """Of the joints, then what each gear pair puts into its second joint."""
        efforts = self._efforts(pose, multipliers)
        return super().link_by_link(pose, loads, multipliers) + [Wrench(0.0, 0.0, effort) for effort in efforts]

    def signature(self, pose: Pose, spread: float) -> list[Number]:
        """Places and directions of the links."""
        return [n for frame in pose.frames for n in (frame.x / spread, frame.y / spread, frame.c, frame.s)]


def _rate(pair: Element, relative: Twist, slides: bool) -> Number:
    """Rate of the turn or slide of a joint whose second link moves like that against its first."""
    if not slides:
        return relative.w
    x, y = velocity_at(relative, place_of(pair.second))
    return pair.first.c * x + pair.first.s * y
