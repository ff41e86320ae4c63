"""Links on a tree of joints in space, and how far the loops that the other joints close are open."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.space import Frame, Screw, compose, moment_at, relative, vector_minus
from trunnion.algebra.vector import Vector3, cross, dot, plus, scaled
from trunnion.groups import tree as spanning
from trunnion.groups.tree import OUTER, GroupJoint, Step
from trunnion.joints.spatial import MOTIONS

__all__ = ["Element", "SpatialTree", "entries"]


class Element(NamedTuple):
    """A joint's element on its first and on its second link, and its lead: slide for one radian of a helical pair."""

    first: Frame
    second: Frame
    lead: Number = 0.0

    def side(self, i: int) -> Frame:
        """The element on the first (0) or second (1) link."""
        return self.second if i else self.first


@dataclass(frozen=True)
class SpatialTree:
    """Links, joints and coordinates of a module.

    driven: indices of joints whose first coordinate is prescribed; spinning: links whose spin is free, each with its
    two joints.
    """

    links: int
    joints: tuple[GroupJoint, ...]
    driven: tuple[int, ...] = ()
    spinning: tuple[tuple[int, int, int], ...] = ()

    @cached_property
    def steps(self) -> tuple[Step, ...]:
        """The tree, outermost link last; driven joints are kept in it where they can be."""
        return spanning.grow(self.links, self.joints, self.driven)

    @cached_property
    def chords(self) -> tuple[int, ...]:
        """The joints that the tree leaves out."""
        inside = {step.joint for step in self.steps}
        return tuple(k for k in range(len(self.joints)) if k not in inside)

    @cached_property
    def starts(self) -> tuple[int, ...]:
        """Where the coordinates of each joint begin in q, and where they end."""
        counts = [len(MOTIONS[joint.kind].kinds) for joint in self.joints]
        return tuple(sum(counts[:k]) for k in range(len(counts) + 1))

    @cached_property
    def kinds(self) -> tuple[str, ...]:
        """What each entry of q is: "turn", "slide", or "part" of a quaternion."""
        return tuple(kind for joint in self.joints for kind in MOTIONS[joint.kind].kinds)

    @cached_property
    def kept(self) -> tuple[int, ...]:
        """The entries of q that an assembly states: all but the prescribed."""
        prescribed = {self.starts[k] for k in self.driven}
        return tuple(i for i in range(len(self.kinds)) if i not in prescribed)

    @cached_property
    def kept_kinds(self) -> tuple[str, ...]:
        """What each of them is."""
        return tuple(self.kinds[i] for i in self.kept)

    @cached_property
    def free(self) -> tuple[tuple[int, int], ...]:
        """(joint, freedom) of the unknowns."""
        return tuple(
            (k, i)
            for k, joint in enumerate(self.joints)
            for i in range(len(MOTIONS[joint.kind].steps))
            if not (k in self.driven and i == 0)
        )

    def coordinates(self, start: Sequence[Number], drive: Sequence[Number]) -> list[list[Number]]:
        """Coordinates of each joint, from those of `kept` and the prescribed ones."""
        values: list[Number] = [0.0] * len(self.kinds)
        for i, value in zip(self.kept, start, strict=True):
            values[i] = value
        for k, value in zip(self.driven, drive, strict=True):
            values[self.starts[k]] = value
        return [values[a:b] for a, b in pairwise(self.starts)]

    @cached_property
    def _paths(self) -> dict[int, dict[int, int]]:
        """For each link the joints between it and the known links, each with the sign its screws count with."""
        paths: dict[int, dict[int, int]] = {OUTER: {}}
        for step in self.steps:
            paths[step.child] = {**paths[step.parent], step.joint: 1 if step.near == 0 else -1}
        return paths

    def weight(self, joint: int, row: int) -> int:
        """Sign with which the freedoms of a joint open the loop that joint `row` closes; 0 if they do not."""
        first, second = (self._paths[link] for link in self.joints[row].sides)
        return second.get(joint, 0) - first.get(joint, 0) - (joint == row)

    def place(
        self, elements: Sequence[Element], q: Sequence[Sequence[Number]]
    ) -> tuple[tuple[Frame, ...], tuple[Element, ...], tuple[list[Screw], ...]]:
        """Frames of all links, elements of all joints (global) and the screws of their freedoms."""
        frames: dict[int, Frame] = {}
        known: dict[tuple[int, int], Frame] = {}

        def placed(k: int, side: int) -> Frame:
            if (k, side) not in known:
                link, local = self.joints[k].sides[side], elements[k].side(side)
                known[k, side] = local if link == OUTER else compose(frames[link], local)
            return known[k, side]

        for step in self.steps:
            k, motion = step.joint, MOTIONS[self.joints[step.joint].kind]
            move = motion.place if step.near == 0 else motion.unplace
            known[k, 1 - step.near] = far = move(placed(k, step.near), q[k], elements[k].lead)
            frames[step.child] = relative(far, elements[k].side(1 - step.near))
        pairs = tuple(Element(placed(k, 0), placed(k, 1), elements[k].lead) for k in range(len(self.joints)))
        screws = tuple(MOTIONS[joint.kind].screws(*pair) for joint, pair in zip(self.joints, pairs, strict=True))
        return tuple(frames[link] for link in range(self.links)), pairs, screws

    def size(self, elements: Sequence[Element]) -> Number:
        """A length typical of each lane, m: the widest spread of joint elements on one link, or of the known ones."""
        places: dict[int, list[Vector3]] = {}
        for joint, one in zip(self.joints, elements, strict=True):
            for side, link in enumerate(joint.sides):
                places.setdefault(link, []).append(one.side(side).place)
        size: Number = 0.0
        for first, *others in places.values():
            for other in others:
                apart = vector_minus(other, first)
                size = np.fmax(size, np.sqrt(primal(dot(apart, apart))))
        return np.where(size > 0, size, 1.0)

    # ---- loops ----------------------------------------------------------------------------------------------

    def _loops(self, placed: Sequence[Element], q: Sequence[Sequence[Number]]) -> Iterator[tuple[Vector3, Vector3]]:
        """Turn and way from where each loop's last joint puts its second element to where that is."""
        for k in self.chords:
            one = placed[k]
            aim = MOTIONS[self.joints[k].kind].place(one.first, q[k], one.lead)
            turn = plus(plus(cross(aim.x, one.second.x), cross(aim.y, one.second.y)), cross(aim.z, one.second.z))
            yield scaled(0.5, turn), vector_minus(one.second.place, aim.place)

    def gaps(self, placed: Sequence[Element], q: Sequence[Sequence[Number]], size: Number) -> list[Number]:
        """By how much each row is open: rad, and lengths in units of the size; a spin is never open."""
        rows: list[Number] = []
        for turn, way in self._loops(placed, q):
            rows += [*turn, *(length / size for length in way)]
        return rows + [0.0] * len(self.spinning)

    def opening(self, placed: Sequence[Element], q: Sequence[Sequence[Number]], size: Number) -> Number:
        """Largest opening of a loop, m; an angle, taken from the axes themselves, counts as angle times size."""
        worst: Number = 0.0
        for k in self.chords:
            one = placed[k]
            aim = MOTIONS[self.joints[k].kind].place(one.first, q[k], one.lead)
            for found, wanted, scale in zip(one.second, aim, (size, size, size, 1.0), strict=True):
                for a, b in zip(found, wanted, strict=True):
                    worst = np.maximum(worst, scale * np.abs(primal(a) - primal(b)))
        return worst

    def jacobian(self, placed: Sequence[Element], screws: Sequence[list[Screw]], size: Number) -> list[list[Number]]:
        """Rate of every row for a unit rate of every free coordinate, slides in units of the size."""
        matrix: list[list[Number]] = []
        for row in self.chords:
            place = placed[row].second.place
            block: list[list[Number]] = [[] for _ in range(6)]
            for k, i in self.free:
                weight = self.weight(k, row)
                numbers = entries(screws[k][i], place, size, self.slides(k, i)) if weight else (0.0,) * 6
                for line, entry in zip(block, numbers, strict=True):
                    line.append(entry if weight == 1 else -entry if weight == -1 else weight * entry)
            matrix += block
        for link, a, b in self.spinning:
            axis = self.spin_axis(placed, a, b)
            path = self._paths[link]
            matrix.append([path.get(k, 0) * dot(axis, screws[k][i].u) for k, i in self.free])
        return matrix

    def spin_axis(self, placed: Sequence[Element], a: int, b: int) -> Vector3:
        """Unit vector of the line about which a link can spin: from ball to ball, or the axis of its other joint."""
        for k in (a, b):
            if not self.joints[k].pair.ball:
                return placed[k].second.z
        apart = vector_minus(placed[b].second.place, placed[a].second.place)
        square = dot(apart, apart)
        xp = namespace(square)
        there = primal(square) > 0  # a link without a length has no line
        return scaled(1 / xp.sqrt(xp.where(there, square, 1.0)), apart)

    def slides(self, joint: int, freedom: int) -> bool:
        return MOTIONS[self.joints[joint].kind].steps[freedom] == "slide"


def entries(screw: Screw, place: Vector3, size: Number, slides: bool) -> tuple[Number, ...]:
    """Turn and velocity at a place that a screw gives, lengths in units of the size; a slide is counted in it too."""
    if slides:
        return (0.0, 0.0, 0.0, *screw.m)
    x, y, z = moment_at(screw, place)
    return (*screw.u, x / size, y / size, z / size)
