"""Any module in space: links between known links, joined by any lower pairs, some perhaps driven.

Every joint keeps its coordinates q. A tree of joints hangs the links on the known ones; each joint that the tree leaves
out closes a loop: its second element must be where its coordinates, seen from the first, put it [P 8]. That is six
equations, a twist, for each loop. J (6 L × n) has the screws of the free coordinates as columns, seen at the loops.

    position      J δq = −gap             (Newton)
    velocity      J q̇ = −gap rate with q̇ = 0
    acceleration  J q̈ = −gap acceleration with q̈ = 0, which holds the Lie brackets of the twists with the screws
    reactions     Jᵀ λ = −(power of the outboard loads on each screw); the rest link by link

A link whose spin is free (both its joints are spherical) adds one row: it does not spin about the line of its joints.
Where the loops ask for more than the coordinates can give (`redundant`), the equations are solved by least squares and
the reactions are those of least size, see `groups.redundant`.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra import linalg
from trunnion.algebra.dual import depth, primal
from trunnion.algebra.namespace import Number, apart, looped, namespace
from trunnion.algebra.nested import each, flat, replaced
from trunnion.algebra.space import ZERO, Frame, Screw, added, bracket, minus, moment_at, power, times
from trunnion.algebra.vector import cross, dot, plus, scaled
from trunnion.groups import redundant
from trunnion.groups.spatial_tree import Element, SpatialTree, entries
from trunnion.groups.tree import OUTER
from trunnion.joints.spatial import MOTIONS

__all__ = ["SpatialGroup", "SpatialPose"]

QUICK = 8  # rounds for all lanes
NEWTON_LIMIT = 60  # more for those that need them
NEARLY = 1e-7  # of its largest allowed step: from here one more round reaches rounding
TURN_LIMIT = 0.4  # rad a step: keeps Newton on the branch it starts on
SLIDE_LIMIT = 0.3  # of the size
CLOSED = 1e-9  # rad, or of the size: a gap that redundant equations leave at most


class SpatialPose(NamedTuple):
    """Frames of the links; elements of the joints and the screws of their freedoms (global); coordinates q; J and J⁻¹.

    size: a length typical of each lane, in which J has its lengths; orientation: sign of det J, which is the same all
    along one branch of assembly; gap: largest opening of a loop, m, an angle counted as angle times size.
    """

    frames: tuple[Frame, ...]
    elements: tuple[Element, ...]
    screws: tuple[list[Screw], ...]
    q: tuple[Number, ...]
    jacobian: list[list[Number]]
    inverse: list[list[Number]]
    size: Number
    gap: Number
    condition: Number
    orientation: Number


@dataclass(frozen=True)
class SpatialGroup(SpatialTree):
    """The module with the given joints. redundant: whether the loops may ask for more than the coordinates can give."""

    redundant: bool = False
    BRANCHES: tuple[int, ...] = ()

    # ---- position -------------------------------------------------------------------------------------------

    def position(
        self,
        elements: Sequence[Element],
        assembly: Sequence[Number] | None,
        drive: Sequence[Number] = (),
        late: int = NEWTON_LIMIT,
    ) -> SpatialPose:
        """Pose by Newton from the coordinates `assembly` of all joints but the prescribed (rad, m, quaternions).

        late: most rounds for lanes that are still open after QUICK. NaN in the lanes that do not close. Dual inputs:
        one more step at the solution for each level of ε.
        """
        with np.errstate(all="ignore"):
            real = [each(one, primal) for one in elements]
            size = self.size(real)
            q = self.coordinates([primal(v) for v in assembly or ()], [primal(v) for v in drive])
            q = self._newton(real, q, size, late)
            numbers = [*drive, *(n for one in elements for n in flat(one))]
            found = [value for joint in q for value in joint]
            q = self.coordinates([found[i] for i in self.kept], drive)
            for _ in range(depth(numbers)):
                q = self._step(elements, q, size)
            return self._posed(elements, q, size)

    def _posed(self, elements: Sequence[Element], q: list[list[Number]], size: Number) -> SpatialPose:
        frames, placed, screws = self.place(elements, q)
        jacobian = self.jacobian(placed, screws, size)
        orientation: Number = 1.0
        gap = self.opening(placed, q, size)
        if self.chords and not self.free:  # held fast: either it closes as it is or not at all
            hole = np.where(gap <= CLOSED * size, 0.0, np.nan)
            frames = each(frames, lambda n: n + hole)
        if not jacobian or not self.free:
            inverse: list[list[Number]] = []
            orientation = np.where(gap <= CLOSED * size, 1.0, np.nan)  # no coordinate could close what is open
        elif self.redundant:
            inverse = redundant.pseudo_inverse(jacobian)
        else:
            inverse = linalg.inverse(jacobian)
            if not self.BRANCHES:  # a closed form stays on its branch by itself
                orientation = np.sign(primal(linalg.determinant(jacobian)))
        condition = redundant.condition(jacobian) if self.redundant and inverse else _condition(jacobian, inverse)
        all_q = tuple(value for joint in q for value in joint)
        return SpatialPose(frames, placed, screws, all_q, jacobian, inverse, size, gap, condition, orientation)

    def _newton(
        self, elements: Sequence[Element], q: list[list[Number]], size: Number, rounds: int
    ) -> list[list[Number]]:
        """Newton on real numbers; lanes that do not converge are NaN. rounds: for those that are late."""
        q = [[namespace(v).asarray(v, float) for v in joint] for joint in q]
        if not self.free or not self.chords:
            return q
        q, moved_by = self._iterate(elements, q, size, QUICK)
        late = ~(moved_by <= NEARLY)
        if rounds and apart(late):
            q, moved_by = self._finish_late(elements, q, size, late, rounds)
        q = self._step(elements, q, size)  # quadratic: from NEARLY to rounding
        placed = self.place(elements, q)[1]
        closed = (moved_by <= NEARLY) & (self.opening(placed, q, size) <= CLOSED * size)
        return [[np.where(closed, value, np.nan) for value in joint] for joint in q]

    def _iterate(
        self, elements: Sequence[Element], q: list[list[Number]], size: Number, rounds: int
    ) -> tuple[list[list[Number]], Number]:
        """Newton steps until no lane moves by more than NEARLY (of its limit), at most `rounds`."""

        def nested(numbers: Sequence[Number]) -> list[list[Number]]:
            rest = iter(numbers)
            return [[next(rest) for _ in joint] for joint in q]

        def step(state: list[Number]) -> list[Number]:
            after, moved_by = self._limited_step(elements, nested(state[:-1]), size)
            return [*(v for joint in after for v in joint), moved_by]

        start = [*(v for joint in q for v in joint), np.inf]
        *numbers, last = looped(step, start, rounds, lambda state: np.logical_not(state[-1] > NEARLY))
        q = nested(numbers)
        return q, np.broadcast_to(last, np.broadcast_shapes(np.shape(last), *(np.shape(v) for j in q for v in j)))

    def _limited_step(
        self, elements: Sequence[Element], q: list[list[Number]], size: Number
    ) -> tuple[list[list[Number]], Number]:
        """One Newton step, shortened as a whole where an entry would exceed its limit; the largest in terms of it."""
        steps = self._steps(elements, q, size)
        last = self._largest(steps)
        shrink = 1 / np.maximum(last, 1.0)
        return self._advanced(q, [[s * shrink for s in joint] for joint in steps], size), last

    def _largest(self, steps: list[list[Number]]) -> Number:
        """Largest entry of scaled steps in terms of its limit."""
        moves = [
            np.abs(s) / (TURN_LIMIT if kind == "turn" else SLIDE_LIMIT)
            for joint, values in zip(self.joints, steps, strict=True)
            for s, kind in zip(values, MOTIONS[joint.kind].steps, strict=True)
        ]
        return functools.reduce(np.maximum, moves)

    def _finish_late(
        self, elements: Sequence[Element], q: list[list[Number]], size: Number, late: Number, rounds: int
    ) -> tuple[list[list[Number]], Number]:
        """Go on with the lanes that are still open, and with those alone: they are few or beyond help."""
        shape = late.shape

        def part(number: Number) -> Number:
            return np.broadcast_to(number, shape)[late]

        # a number that is the same in all lanes stays one: of its zeros and ones no products are made
        some = [each(one, lambda number: part(number) if np.ndim(number) else number) for one in elements]
        found, last = self._iterate(some, [[part(v) for v in joint] for joint in q], part(size), rounds)
        moved_by = np.zeros(shape)
        moved_by[late] = last
        merged = [
            [replaced(value, late, better) for value, better in zip(joint, new, strict=True)]
            for joint, new in zip(q, found, strict=True)
        ]
        return merged, moved_by

    def _step(self, elements: Sequence[Element], q: list[list[Number]], size: Number) -> list[list[Number]]:
        """One whole Newton step."""
        return self._advanced(q, self._steps(elements, q, size), size)

    def _steps(self, elements: Sequence[Element], q: list[list[Number]], size: Number) -> list[list[Number]]:
        """Newton's step in every freedom, slides in units of the size; 0 for the driven."""
        _, placed, screws = self.place(elements, q)
        gaps = self.gaps(placed, q, size)
        jacobian = self.jacobian(placed, screws, size)
        if self.redundant:
            found = redundant.least_squares(jacobian, gaps)
        else:
            (found,) = linalg.solve(jacobian, gaps)
        steps: list[list[Number]] = [[0.0] * len(MOTIONS[joint.kind].steps) for joint in self.joints]
        for (k, i), step in zip(self.free, found, strict=True):
            steps[k][i] = -step
        return steps

    def _advanced(self, q: list[list[Number]], steps: list[list[Number]], size: Number) -> list[list[Number]]:
        found = []
        for joint, values, step in zip(self.joints, q, steps, strict=True):
            motion = MOTIONS[joint.kind]
            scaled_ = [s * size if kind == "slide" else s for s, kind in zip(step, motion.steps, strict=True)]
            found.append(motion.advanced(values, scaled_))
        return found

    # ---- velocity and acceleration --------------------------------------------------------------------------

    def rates(
        self, pose: SpatialPose, outer: Sequence[Screw | None], drive: Sequence[Number] = ()
    ) -> list[list[Number]]:
        """Rate of every freedom of every joint, rad/s and m/s."""
        rates = self._driven_only(drive)
        twists = self.twists(pose, outer, rates)
        known = Outside(self, pose, twists, outer)
        rows: list[Number] = []
        for k in self.chords:
            relative_ = minus(known.of(k, 1), known.of(k, 0))
            for screw, rate in zip(pose.screws[k], rates[k], strict=True):
                relative_ = minus(relative_, times(rate, screw))
            rows += entries(relative_, pose.elements[k].second.place, pose.size, slides=False)
        rows += [dot(self.spin_axis(pose.elements, a, b), twists[link].u) for link, a, b in self.spinning]
        return self._closing(pose, rates, rows)

    def _driven_only(self, drive: Sequence[Number]) -> list[list[Number]]:
        rates: list[list[Number]] = [[0.0] * len(MOTIONS[joint.kind].steps) for joint in self.joints]
        for k, value in zip(self.driven, drive, strict=True):
            rates[k][0] = value
        return rates

    def _closing(self, pose: SpatialPose, rates: list[list[Number]], rows: Sequence[Number]) -> list[list[Number]]:
        """The rates with those of the free coordinates that close what is open."""
        for (k, i), line in zip(self.free, pose.inverse, strict=True) if rows else ():
            value = -linalg.weighted(line, rows)
            rates[k][i] = value * pose.size if self.slides(k, i) else value
        return rates

    def twists(
        self, pose: SpatialPose, outer: Sequence[Screw | None], rates: Sequence[Sequence[Number]]
    ) -> list[Screw]:
        """Twists of the links from the rates of all freedoms."""
        twists: dict[int, Screw] = {}
        for step in self.steps:
            k = step.joint
            twist = (outer[k] or ZERO) if step.parent == OUTER else twists[step.parent]
            for screw, rate in zip(pose.screws[k], rates[k], strict=True):
                twist = added(twist, times(rate if step.near == 0 else -rate, screw))
            twists[step.child] = twist
        return [twists[link] for link in range(self.links)]

    def acceleration(
        self,
        pose: SpatialPose,
        twists: Sequence[Screw],
        outer_twists: Sequence[Screw | None],
        outer: Sequence[Screw | None],
        drive: Sequence[Number],
        speeds: Sequence[Sequence[Number]],
    ) -> list[Screw]:
        """Derivatives of the twists. drive: second derivatives of the driven coordinates; speeds: see `rates`."""
        known = Outside(self, pose, twists, outer_twists)
        carried = [self._carried(pose, speeds[k], k, known.of(k, 0)) for k in range(len(self.joints))]
        second = self._driven_only(drive)
        found = self._accelerations(pose, outer, second, carried)
        after = Outside(self, pose, found, outer)
        rows: list[Number] = []
        for k in self.chords:
            relative_ = minus(minus(after.of(k, 1), after.of(k, 0)), carried[k])
            for screw, value in zip(pose.screws[k], second[k], strict=True):
                relative_ = minus(relative_, times(value, screw))
            rows += entries(relative_, pose.elements[k].second.place, pose.size, slides=False)
        for link, a, b in self.spinning:
            rows.append(
                dot(self.spin_axis(pose.elements, a, b), found[link].u)
            )  # ω · u = 0 and u̇ = ω × u: no further term
        second = self._closing(pose, second, rows)
        return self._accelerations(pose, outer, second, carried)

    def _carried(self, pose: SpatialPose, speeds: Sequence[Number], k: int, base: Screw) -> Screw:
        """Σ q̇ (V × s) of a joint: its screws are carried along by its first link and by the freedoms before them."""
        motion = MOTIONS[self.joints[k].kind]
        found, twist = ZERO, base
        for screw, speed in zip(pose.screws[k], speeds, strict=True):
            part = times(speed, screw)
            found = added(found, bracket(twist, part))
            if not motion.together:
                twist = added(twist, part)
        return found

    def _accelerations(
        self,
        pose: SpatialPose,
        outer: Sequence[Screw | None],
        second: Sequence[Sequence[Number]],
        carried: Sequence[Screw],
    ) -> list[Screw]:
        found: dict[int, Screw] = {}
        for step in self.steps:
            k = step.joint
            base = (outer[k] or ZERO) if step.parent == OUTER else found[step.parent]
            part = carried[k]
            for screw, value in zip(pose.screws[k], second[k], strict=True):
                part = added(part, times(value, screw))
            found[step.child] = added(base, part) if step.near == 0 else minus(base, part)
        return [found[link] for link in range(self.links)]

    # ---- reactions ------------------------------------------------------------------------------------------

    def reactions(self, pose: SpatialPose, loads: Sequence[Screw]) -> list[Screw]:
        """Wrench on the second link of each joint by the first, about the origin.

        loads: everything else that acts on each link, inertia included. The component along a driven freedom is the
        drive effort. Cut wrenches from Jᵀ λ = −(outboard power on each screw), the others link by link.
        """
        multipliers = self._multipliers(pose, loads)
        if self.redundant and multipliers:

            def reactions(under: Sequence[Number], loaded: bool) -> NDArray[np.float64]:
                return _weighed(pose, self.link_by_link(pose, loads if loaded else [ZERO] * len(loads), under))

            multipliers = redundant.least(pose.jacobian, reactions, multipliers)
        return self.link_by_link(pose, loads, multipliers)

    def link_by_link(self, pose: SpatialPose, loads: Sequence[Screw], multipliers: Sequence[Number]) -> list[Screw]:
        """The wrenches of all joints from those of the loops."""
        carried = dict(enumerate(loads))
        found: dict[int, Screw] = {}
        for n, k in enumerate(self.chords):
            found[k] = wrench = self.cut_wrench(pose, k, multipliers[6 * n : 6 * n + 6])
            first, second = self.joints[k].sides
            if second != OUTER:
                carried[second] = added(carried[second], wrench)
            if first != OUTER:
                carried[first] = minus(carried[first], wrench)
        for (link, a, b), torque in zip(self.spinning, multipliers[6 * len(self.chords) :], strict=True):
            spin = Screw((0.0, 0.0, 0.0), scaled(torque, self.spin_axis(pose.elements, a, b)))
            carried[link] = added(carried[link], spin)
        for step in reversed(self.steps):
            total = carried[step.child]
            found[step.joint] = times(-1.0 if step.near == 0 else 1.0, total)
            if step.parent != OUTER:
                carried[step.parent] = added(carried[step.parent], total)
        return [found[k] for k in range(len(self.joints))]

    def cut_wrench(self, pose: SpatialPose, k: int, sizes: Sequence[Number]) -> Screw:
        """The wrench of six multipliers, moment and force at the place where the loop is closed, about the origin."""
        mx, my, mz, *force = sizes
        x, y, z = (part / pose.size for part in force)
        place = pose.elements[k].second.place
        return Screw((x, y, z), plus((mx, my, mz), cross(place, (x, y, z))))

    def spin_torques(self, pose: SpatialPose, loads: Sequence[Screw]) -> list[Number]:
        """Torque about its line that each link with a free spin would need to keep from spinning, N m."""
        return self._multipliers(pose, loads)[6 * len(self.chords) :]

    def _multipliers(self, pose: SpatialPose, loads: Sequence[Screw]) -> list[Number]:
        """λ of every row."""
        if not pose.inverse:
            return [0.0] * len(pose.jacobian)
        outboard = dict(enumerate(loads))
        for step in reversed(self.steps):
            if step.parent != OUTER:
                outboard[step.parent] = added(outboard[step.parent], outboard[step.child])
        child = {step.joint: step for step in self.steps}
        powers: list[Number] = []
        for k, i in self.free:
            if k not in child:
                powers.append(0.0)
                continue
            value = power(outboard[child[k].child], pose.screws[k][i])
            value = value * pose.size if self.slides(k, i) else value
            powers.append(value if child[k].near == 0 else -value)
        rows = range(len(pose.inverse[0]))
        return [-linalg.weighted([line[j] for line in pose.inverse], powers) for j in rows]

    def closure(self, pose: SpatialPose) -> Number:
        """Largest distance by which a loop is open, m; an angle counts as angle times size."""
        return pose.gap

    def condition(self, pose: SpatialPose) -> Number:
        """2/n ‖J‖·‖J⁻¹‖ (Frobenius) with lengths in units of the size: 2 at best."""
        return pose.condition

    def signature(self, pose: SpatialPose, spread: float) -> list[Number]:
        """Numbers that tell assemblies apart: axes and places of the links; of a spinning one its two joints."""
        spun = {link for link, _, _ in self.spinning}
        found: list[Number] = []
        for link, frame in enumerate(pose.frames):
            if link not in spun:
                found += [*frame.x, *frame.y, *frame.z, *(n / spread for n in frame.place)]
        for _, a, b in self.spinning:
            found += [n / spread for k in (a, b) for n in pose.elements[k].second.place]
        return found


@dataclass(frozen=True)
class Outside:
    """Twists (or their derivatives) of the links at both sides of each joint, known links included."""

    group: SpatialGroup
    pose: SpatialPose
    twists: Sequence[Screw]
    outer: Sequence[Screw | None]

    def of(self, k: int, side: int) -> Screw:
        """That of the link at one side of joint k."""
        link = self.group.joints[k].sides[side]
        return (self.outer[k] or ZERO) if link == OUTER else self.twists[link]


def _condition(jacobian: Sequence[Sequence[Number]], inverse: Sequence[Sequence[Number]]) -> Number:
    if not inverse:
        return 1.0
    direct: Number = 0.0
    reverse: Number = 0.0
    for matrix in (jacobian, inverse):
        total: Number = 0.0
        for line in matrix:
            for value in line:
                real = primal(value)
                if not (isinstance(real, float) and real == 0.0):
                    total = total + real * real
        direct, reverse = (total, reverse) if matrix is jacobian else (direct, total)
    return 2 * np.sqrt(direct * reverse) / len(inverse)


def _weighed(pose: SpatialPose, wrenches: Sequence[Screw]) -> NDArray[np.float64]:
    """(lane, entry): forces and moments at the joints over the size, of all joints."""
    rows: list[Number] = []
    for wrench, one in zip(wrenches, pose.elements, strict=True):
        moment = moment_at(wrench, one.second.place)
        rows += [*wrench.u, *(part / pose.size for part in moment)]
    flat = np.broadcast_arrays(*(np.asarray(primal(row), float) for row in rows), np.zeros(1))[:-1]
    return np.stack(flat, axis=-1)
