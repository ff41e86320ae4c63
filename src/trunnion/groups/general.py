"""Any planar module: links between known links, joined by revolute and prismatic pairs, some perhaps driven.

Cut one joint of every loop: what is left is a tree that hangs on the known links, and its joint coordinates q
are the unknowns. A cut revolute pair asks two points to meet, a cut prismatic pair asks a point to stay on the
axis and two directions to agree, a driven pair also prescribes its coordinate. J holds the joint screws, seen
at the cuts.  [THEORY, "One Jacobian, four uses"]

    position      J δq = −gap             (Newton)
    velocity      J q̇ = −gap rate with q̇ = 0
    acceleration  J q̈ = −gap acceleration with q̈ = 0
    reactions     Jᵀ λ = −(power of the outboard loads on each screw); the rest link by link
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np

from trunnion.algebra import linalg
from trunnion.algebra.dual import depth, primal
from trunnion.algebra.namespace import Number, apart, looped, namespace
from trunnion.algebra.nested import each, flat, replaced
from trunnion.algebra.plane import (
    ZERO_LOAD,
    Acceleration,
    Frame,
    Twist,
    Wrench,
    about,
    accelerated,
    added,
    compose,
    minus,
    moved,
    relative,
    times,
)
from trunnion.groups import tree as spanning
from trunnion.groups.cuts import CutRow, rows
from trunnion.groups.gear import NUMBERS, ONE, GearPair, GearRow, actions
from trunnion.groups.protocol import Elements
from trunnion.groups.tree import OUTER, GroupJoint, Step, across, size_of

__all__ = ["OUTER", "General", "GeneralPose", "GroupJoint"]

Numbers = Sequence[Number]

QUICK = 8  # rounds for all lanes
NEWTON_LIMIT = 60  # more for those that need them
NEARLY = 1e-7  # of its largest allowed step: from here one more round reaches rounding
TURN_LIMIT = 0.4  # rad a step: keeps Newton on the branch it starts on


class GeneralPose(NamedTuple):
    """Frames of the links; both elements of each joint (global); tree coordinates q; J⁻¹; gap; condition.

    orientation: sign of det J, which is the same all along one branch of assembly; ratios: of the gear pairs.
    """

    frames: tuple[Frame, ...]
    elements: tuple[tuple[Frame, Frame], ...]
    q: tuple[Number, ...]
    inverse: list[list[Number]]
    gap: Number
    condition: Number
    orientation: Number
    ratios: tuple[Number, ...] = ()


@dataclass(frozen=True)
class General:
    """The module with the given joints; `driven` lists the indices of joints whose coordinate is prescribed.

    A joint between known links that a gear pair speaks of is listed too, at the end, with both sides OUTER. After the
    driven coordinates `drive` holds three numbers for each gear pair (see `gear.NUMBERS`).
    """

    links: int
    joints: tuple[GroupJoint, ...]
    driven: tuple[int, ...] = ()
    gears: tuple[GearPair, ...] = ()
    BRANCHES: ClassVar[tuple[int, ...]] = ()

    @cached_property
    def steps(self) -> tuple[Step, ...]:
        """The tree, outermost link last; driven joints are kept in it where they can be."""
        return spanning.grow(self.links, self.joints, [*self.driven, *(gear.first for gear in self.gears)])

    @cached_property
    def free(self) -> tuple[int, ...]:
        """Positions in `steps` of the unknown coordinates."""
        return tuple(i for i, step in enumerate(self.steps) if step.joint not in self.driven)

    @property
    def kept(self) -> tuple[int, ...]:
        """The entries of q that an assembly states: the free ones."""
        return self.free

    @cached_property
    def kept_kinds(self) -> tuple[str, ...]:
        """What each of them is, "turn" or "slide"."""
        return tuple("turn" if self.joints[self.steps[i].joint].pair.turns else "slide" for i in self.free)

    def size(self, elements: Elements) -> Number:
        """A length typical of each lane, m."""
        return size_of(self.joints, elements)

    def signature(self, pose: GeneralPose, spread: float) -> list[Number]:
        """Numbers that tell assemblies apart: places and directions of the links."""
        return [n for frame in pose.frames for n in (frame.x / spread, frame.y / spread, frame.c, frame.s)]

    @cached_property
    def _paths(self) -> dict[int, frozenset[int]]:
        """For each link the steps between it and the known links."""
        paths: dict[int, frozenset[int]] = {OUTER: frozenset()}
        for i, step in enumerate(self.steps):
            paths[step.child] = paths[step.parent] | {i}
        return paths

    def coordinates(self, elements: Elements, assembly: Sequence[Number], drive: Sequence[Number]) -> list[Number]:
        """All tree coordinates from the free ones and the prescribed ones."""
        q: list[Number] = [0.0] * len(self.steps)
        for i, value in zip(self.free, assembly, strict=True):
            q[i] = value
        prescribed = dict(zip(self.driven, drive, strict=False))
        for i, step in enumerate(self.steps):
            if step.joint in prescribed:
                q[i] = prescribed[step.joint]
        return q

    # ---- position -------------------------------------------------------------------------------------------

    def position(
        self, elements: Elements, assembly: Numbers, drive: Numbers = (), late: int = NEWTON_LIMIT
    ) -> GeneralPose:
        """Pose by Newton from the free tree coordinates `assembly` (rad, m; order of `free`).

        late: most rounds for lanes that are still open after QUICK. NaN in the lanes that do not close. Dual inputs:
        one more step at the solution for each level of ε.
        """
        with np.errstate(all="ignore"):
            q = self._newton(
                [each(pair, primal) for pair in elements],
                [primal(value) for value in assembly],
                [primal(value) for value in drive],
                late,
            )
            numbers = [*drive, *(n for pair in elements for n in flat(pair))]
            q = self.coordinates(elements, [q[i] for i in self.free], drive)
            for _ in range(depth(numbers)):
                q = self._step(elements, q, drive)
            frames, placed = self._place(elements, q)
            jacobian = self._jacobian(placed, drive)
            inverse = linalg.inverse(jacobian) if jacobian else []
            gap = self._gap(placed, q, drive)
            lengths = [n for n, row in zip(gap, self._rows, strict=True) if row.is_length]
            size = size_of(self.joints, elements)
            orientation = np.sign(primal(linalg.determinant(jacobian)))
        xp = namespace(*lengths) if lengths else np
        opening: Number = 0.0
        for value in lengths:
            opening = xp.maximum(opening, xp.abs(value))
        condition = self._condition(jacobian, inverse, size)
        ratios = tuple(drive[len(self.driven) :: NUMBERS])
        return GeneralPose(frames, placed, tuple(q), inverse, opening, condition, orientation, ratios)

    def _newton(self, elements: Elements, start: Numbers, drive: Numbers, rounds: int) -> list[Number]:
        """Newton on real numbers from `start`; lanes that do not converge are NaN. rounds: for those that are late."""
        q = [namespace(v).asarray(v, float) for v in self.coordinates(elements, start, drive)]
        if not self.free:
            return list(q)
        size = self.size(elements)
        scale = [TURN_LIMIT if kind == "turn" else 0.3 * size for kind in self.kept_kinds]
        q, moved_by = self._iterate(elements, q, drive, scale, QUICK)
        late = ~(moved_by <= NEARLY)
        if rounds and apart(late):
            q, moved_by = self._finish_late(elements, q, drive, scale, late, rounds)
        q = self._step(elements, q, drive, scale)  # quadratic: from NEARLY to rounding
        closed = moved_by <= NEARLY
        return [np.where(closed, value, np.nan) for value in q]

    def _iterate(
        self, elements: Elements, q: list[Number], drive: Numbers, scale: Numbers, rounds: int
    ) -> tuple[list[Number], Number]:
        """Newton steps until no lane moves by more than NEARLY (of its scale), at most `rounds`."""

        def step(state: list[Number]) -> list[Number]:
            *before, _ = state
            after = self._step(elements, before, drive, scale)
            moves = (np.abs(after[i] - before[i]) / s for i, s in zip(self.free, scale, strict=True))
            return [*after, functools.reduce(np.maximum, moves)]

        *q, last = looped(step, [*q, np.inf], rounds, lambda state: np.logical_not(state[-1] > NEARLY))
        return q, last

    def _finish_late(
        self, elements: Elements, q: list[Number], drive: Numbers, scale: Numbers, late: Number, rounds: int
    ) -> tuple[list[Number], Number]:
        """Go on with the lanes that are still open, and with those alone: they are few or beyond help."""
        shape = late.shape

        def part(number: Number) -> Number:
            return np.broadcast_to(number, shape)[late]

        some = [each(pair, part) for pair in elements]
        found, last = self._iterate(
            some, [part(v) for v in q], [part(v) for v in drive], [part(s) for s in scale], rounds
        )
        moved_by = np.zeros(shape)
        moved_by[late] = last
        return [replaced(value, late, new) for value, new in zip(q, found, strict=True)], moved_by

    def _step(self, elements: Elements, q: Numbers, drive: Numbers, limits: Numbers | None = None) -> list[Number]:
        """One Newton step, shortened as a whole where an entry would exceed its limit."""
        _, placed = self._place(elements, q)
        (step,) = linalg.solve(self._jacobian(placed, drive), self._gap(placed, q, drive))
        if limits is not None:
            worst = functools.reduce(np.maximum, (np.abs(s) / limit for s, limit in zip(step, limits, strict=True)))
            shrink = 1 / np.maximum(worst, 1.0)
            step = [s * shrink for s in step]
        q = list(q)
        for i, s in zip(self.free, step, strict=True):
            q[i] = q[i] - s
        return q

    def _place(self, elements: Elements, q: Numbers) -> tuple[tuple[Frame, ...], tuple[tuple[Frame, Frame], ...]]:
        """Frames of all links and of both elements of all joints for the tree coordinates q."""
        frames: dict[int, Frame] = {}

        def placed(k: int, side: int) -> Frame:
            link = self.joints[k].sides[side]
            return elements[k][side] if link == OUTER else compose(frames[link], elements[k][side])

        for value, step in zip(q, self.steps, strict=True):
            near = placed(step.joint, step.near)
            turn = value if step.near == 0 else -value
            far = across(self.joints[step.joint].kind, near, turn)
            frames[step.child] = relative(far, elements[step.joint][1 - step.near])
        pairs = tuple((placed(k, 0), placed(k, 1)) for k in range(len(self.joints)))
        return tuple(frames[link] for link in range(self.links)), pairs

    # ---- the Jacobian ---------------------------------------------------------------------------------------

    @cached_property
    def _rows(self) -> tuple[CutRow | GearRow, ...]:
        return rows(self.joints, self.steps, self.driven, self.gears)

    def _gap(self, placed: Sequence[tuple[Frame, Frame]], q: Numbers, drive: Numbers) -> list[Number]:
        """By how much each constraint of the cuts is open, m or rad."""
        return [row.gap(placed, q, drive) for row in self._rows]

    def _screws(self, placed: Sequence[tuple[Frame, Frame]], at: Frame) -> list[Twist]:
        """Motion of the point `at` of the outboard side for a unit rate of each tree coordinate."""
        screws = []
        for step in self.steps:
            pivot = placed[step.joint][0]
            sign = 1.0 if step.near == 0 else -1.0
            if self.joints[step.joint].pair.turns:
                screws.append(Twist(-sign * (at.y - pivot.y), sign * (at.x - pivot.x), sign))
            else:
                screws.append(Twist(sign * pivot.c, sign * pivot.s, 0.0))
        return screws

    def _jacobian(self, placed: Sequence[tuple[Frame, Frame]], drive: Numbers) -> list[list[Number]]:
        """Rate of every gap for a unit rate of every free coordinate; square for an Assur group."""
        matrix: list[list[Number]] = []
        cut = {joint for row in self._rows for joint, _ in row.terms(drive)}
        seen = {joint: self._screws(placed, placed[joint][1]) for joint in cut}
        for row in self._rows:
            entries: list[Number] = [0.0] * len(self.free)
            for joint, factor in row.terms(drive):
                to_first, to_second = (self._paths[link] for link in self.joints[joint].sides)
                for place, i in enumerate(self.free):
                    weight = (i in to_second) - (i in to_first)
                    if weight:
                        entry = weight * row.entry(placed[joint][0], seen[joint][i])
                        entries[place] = entries[place] + (entry if factor is ONE else factor * entry)
            matrix.append(entries)
        return matrix

    def _condition(self, jacobian: Sequence[Numbers], inverse: Sequence[Numbers], size: Number) -> Number:
        """2/n ‖S J‖·‖(S J)⁻¹‖ (Frobenius, n × n) with lengths measured in `size`: 2 at best, as for a dyad."""
        if not jacobian:
            return 1.0
        rows = [1.0 / size if row.is_length else 1.0 for row in self._rows]
        columns = [1.0 if self.joints[self.steps[i].joint].pair.turns else size for i in self.free]
        direct = sum(
            (primal(v) * r * c) ** 2
            for line, r in zip(jacobian, rows, strict=True)
            for v, c in zip(line, columns, strict=True)
        )
        reverse = sum(
            (primal(v) / (r * c)) ** 2
            for line, c in zip(inverse, columns, strict=True)
            for v, r in zip(line, rows, strict=True)
        )
        with np.errstate(all="ignore"):
            return 2 * np.sqrt(direct * reverse) / len(jacobian)

    # ---- velocity and acceleration --------------------------------------------------------------------------

    def velocity(self, pose: GeneralPose, outer: Sequence[Twist | None], drive: Sequence[Number] = ()) -> list[Twist]:
        """Velocities of the frame origins: outer motion and driven rates give the gaps' rates, J⁻¹ closes them."""
        rates = self.rates(pose, outer, drive)
        return self._twists(pose, outer, rates)

    def rates(self, pose: GeneralPose, outer: Sequence[Twist | None], drive: Sequence[Number] = ()) -> list[Number]:
        """Rates of all tree coordinates, rad/s and m/s."""
        rates = self.coordinates((), [0.0] * len(self.free), drive)
        twists = self._twists(pose, outer, rates)

        def ends(k: int) -> tuple[Twist, Twist]:
            return self._at(pose, twists, outer, k, 0), self._at(pose, twists, outer, k, 1)

        open_rates = [row.rate(pose.elements, ends, drive) for row in self._rows]
        for i, line in zip(self.free, pose.inverse, strict=True):
            rates[i] = -linalg.weighted(line, open_rates)
        return rates

    def _twists(self, pose: GeneralPose, outer: Sequence[Twist | None], rates: Sequence[Number]) -> list[Twist]:
        twists: dict[int, Twist] = {}
        for rate, step in zip(rates, self.steps, strict=True):
            near, far = pose.elements[step.joint][step.near], pose.elements[step.joint][1 - step.near]
            base = self._at(pose, twists, outer, step.joint, step.near)
            signed = rate if step.near == 0 else -rate
            if self.joints[step.joint].pair.turns:
                at = Twist(base.x, base.y, base.w + signed)
            else:
                at = moved(base, far.x - near.x, far.y - near.y)
                at = Twist(at.x + near.c * signed, at.y + near.s * signed, at.w)
            frame = pose.frames[step.child]
            twists[step.child] = moved(at, frame.x - far.x, frame.y - far.y)
        return [twists[link] for link in range(self.links)]

    def _at(
        self,
        pose: GeneralPose,
        twists: dict[int, Twist] | list[Twist],
        outer: Sequence[Twist | None],
        k: int,
        side: int,
    ) -> Twist:
        """Velocity of the element of joint k on one side; between two known links that of the second to the first."""
        link = self.joints[k].sides[side]
        if side == 0 and self.joints[k].sides == (OUTER, OUTER):
            return Twist(0.0, 0.0, 0.0)
        known = outer[k] if link == OUTER else None
        if known is not None:
            return known
        frame, element = pose.frames[link], pose.elements[k][side]
        return moved(twists[link], element.x - frame.x, element.y - frame.y)

    def acceleration(
        self,
        pose: GeneralPose,
        twists: Sequence[Twist],
        outer_twists: Sequence[Twist | None],
        outer: Sequence[Acceleration | None],
        drive: Sequence[Number] = (),
        rates: Sequence[Number] = (),
    ) -> list[Acceleration]:
        """Accelerations of the frame origins. drive: second derivatives of the driven coordinates, rates: first."""
        known = _Motion(pose, list(twists), outer_twists, outer)
        speeds = self.rates(pose, outer_twists, rates)
        second = self.coordinates((), [0.0] * len(self.free), drive)
        gaps = self._gap_accelerations(known, self._accelerations(known, speeds, second), drive)
        for i, line in zip(self.free, pose.inverse, strict=True):
            second[i] = -linalg.weighted(line, gaps)
        return self._accelerations(known, speeds, second)

    def _accelerations(self, known: _Motion, speeds: Sequence[Number], second: Sequence[Number]) -> list[Acceleration]:
        pose, found = known.pose, dict[int, Acceleration]()
        for speed, value, step in zip(speeds, second, self.steps, strict=True):
            near, far = pose.elements[step.joint][step.near], pose.elements[step.joint][1 - step.near]
            base = self._acceleration_at(known, found, step.joint, step.near)
            sign = 1.0 if step.near == 0 else -1.0
            w = known.twists[step.child].w
            if self.joints[step.joint].pair.turns:
                at = Acceleration(base.x, base.y, base.w + sign * value)
            else:
                at = accelerated(base, w, far.x - near.x, far.y - near.y)
                along, coriolis = sign * value, 2 * sign * w * speed
                at = Acceleration(
                    at.x + near.c * along - near.s * coriolis, at.y + near.s * along + near.c * coriolis, at.w
                )
            frame = pose.frames[step.child]
            found[step.child] = accelerated(at, w, frame.x - far.x, frame.y - far.y)
        return [found[link] for link in range(self.links)]

    def _acceleration_at(
        self, known: _Motion, found: dict[int, Acceleration] | list[Acceleration], k: int, side: int
    ) -> Acceleration:
        """Acceleration of the element of joint k on one side; see `_at`."""
        link = self.joints[k].sides[side]
        if side == 0 and self.joints[k].sides == (OUTER, OUTER):
            return Acceleration(0.0, 0.0, 0.0)
        given = known.outer[k] if link == OUTER else None
        if given is not None:
            return given
        frame, element = known.pose.frames[link], known.pose.elements[k][side]
        return accelerated(found[link], known.twists[link].w, element.x - frame.x, element.y - frame.y)

    def _gap_accelerations(self, known: _Motion, found: list[Acceleration], drive: Sequence[Number]) -> list[Number]:
        def ends(k: int) -> tuple[Twist, Twist]:
            v1, v2 = (self._at(known.pose, known.twists, known.outer_twists, k, side) for side in (0, 1))
            return v1, v2

        def seconds(k: int) -> tuple[Acceleration, Acceleration]:
            return self._acceleration_at(known, found, k, 0), self._acceleration_at(known, found, k, 1)

        return [row.second(known.pose.elements, ends, seconds, drive) for row in self._rows]

    # ---- reactions ------------------------------------------------------------------------------------------

    def reactions(self, pose: GeneralPose, loads: Sequence[Wrench]) -> list[Wrench]:
        """Cut wrenches from Jᵀ λ = −(outboard power on each screw), the others link by link from outside in.

        After the joints come the gear pairs, each with the torque it puts into its second joint.
        """
        carried = {link: _moved_to(pose, loads[link], pose.frames[link]) for link in range(self.links)}
        multipliers = self._multipliers(pose, carried)
        found = {k: ZERO_LOAD for k, joint in enumerate(self.joints) if joint.sides == (OUTER, OUTER)}
        torques: list[Number] = []
        for row, size in zip(self._rows, multipliers, strict=True):
            if isinstance(row, GearRow):
                torques.append(size)
            else:
                wrench = row.wrench(pose.elements[row.joint][0], size)
                found[row.joint] = added(found.get(row.joint, ZERO_LOAD), wrench)
        for k, wrench in found.items():
            first, second = self.joints[k].sides
            at = pose.elements[k][1]
            for link, add in ((second, added), (first, minus)):
                if link != OUTER:
                    carried[link] = add(carried[link], _moved_to(pose, wrench, at))
        for gear, ratio, torque in zip(self.gears, pose.ratios, torques, strict=True):
            for joint, side, wrench, place in actions(gear, pose.elements, ratio, torque):
                link = self.joints[joint].sides[side]
                if link != OUTER:
                    carried[link] = added(carried[link], _moved_to(pose, wrench, place))
        for step in reversed(self.steps):
            at = pose.elements[step.joint][1]
            total = carried[step.child]
            sign = -1.0 if step.near == 0 else 1.0
            found[step.joint] = times(sign, _moved_from(pose, total, at))
            if step.parent != OUTER:
                carried[step.parent] = added(carried[step.parent], total)
        return [found[k] for k in range(len(self.joints))] + [Wrench(0.0, 0.0, torque) for torque in torques]

    def _multipliers(self, pose: GeneralPose, carried: dict[int, Wrench]) -> list[Number]:
        """λ of every constraint."""
        powers: list[Number] = []
        screws = self._screws(pose.elements, _reference(pose))
        for i in self.free:
            outboard = ZERO_LOAD
            for link, path in self._paths.items():
                if i in path:
                    outboard = added(outboard, carried[link])
            powers.append(screws[i].x * outboard.x + screws[i].y * outboard.y + screws[i].w * outboard.m)
        return [-linalg.weighted([line[j] for line in pose.inverse], powers) for j in range(len(self._rows))]

    def closure(self, pose: GeneralPose) -> Number:
        """Largest distance by which a cut joint is open, m."""
        return pose.gap

    def condition(self, pose: GeneralPose) -> Number:
        """Frobenius condition of J with lengths measured in the size of the group."""
        return pose.condition


class _Motion(NamedTuple):
    pose: GeneralPose
    twists: list[Twist]
    outer_twists: Sequence[Twist | None]
    outer: Sequence[Acceleration | None]


def _reference(pose: GeneralPose) -> Frame:
    """A point of the group about which wrenches are added up: near, so that no digits are lost."""
    return pose.elements[0][0]


def _moved_to(pose: GeneralPose, wrench: Wrench, at: Frame) -> Wrench:
    """A wrench about `at`, about the common reference point."""
    reference = _reference(pose)
    return about(wrench, reference.x - at.x, reference.y - at.y)


def _moved_from(pose: GeneralPose, wrench: Wrench, at: Frame) -> Wrench:
    """A wrench about the common reference point, about `at`."""
    reference = _reference(pose)
    return about(wrench, at.x - reference.x, at.y - reference.y)
