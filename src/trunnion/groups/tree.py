"""Any module: links between known links, joined by any pairs, some perhaps driven; in the plane and in space.

A tree of joints hangs the links on the known ones; each joint that the tree leaves out, a chord, closes a loop. J holds
the screws of the free coordinates, seen at the chords.  [THEORY, "One Jacobian, four uses"]

    position      J δq = −gap             (Newton)
    velocity      J q̇ = −gap rate with q̇ = 0
    acceleration  J q̈ = −gap acceleration with q̈ = 0, which holds the Lie brackets of the twists with the screws
    reactions     Jᵀ λ = −(power of the outboard loads on each screw); the rest link by link

Twists and wrenches are about the origin of the global frame. What a chord asks for, and what a module has beside its
joints, is said by `groups.general` for the plane and by `groups.spatial` for space.
"""

from __future__ import annotations

import functools
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra import linalg
from trunnion.algebra.dual import depth, primal
from trunnion.algebra.namespace import Number, apart, each, flat, looped, namespace, replaced
from trunnion.groups import redundant
from trunnion.groups.gear import NUMBERS
from trunnion.groups.redundant import Support
from trunnion.joints.pairs import PAIRS, Pair, PairMotion

OUTER = -1  # stands for every link outside the module: all are known, so they count as one
QUICK = 8  # rounds for all lanes
NEWTON_LIMIT = 60  # more for those that need them
NEARLY = 1e-7  # of its largest allowed step: from here one more round reaches rounding
LIMITS = {"turn": 0.4, "slide": 0.3}  # rad, or of the size, a step: keeps Newton on the branch it starts on
CLOSED = 1e-9  # rad, or of the size: a gap that redundant equations leave at most

Coordinates = list[list[Number]]  # of every joint of a module


class GroupJoint(NamedTuple):
    """A joint of a module: its kind and the links (or OUTER) of its first and second side."""

    kind: str
    sides: tuple[int, int]

    @property
    def pair(self) -> Pair:
        """Its row of the table."""
        return PAIRS[self.kind]


class Step(NamedTuple):
    """One edge of the tree: `child` hangs on `parent` by `joint`, whose side `near` belongs to the parent."""

    joint: int
    parent: int
    child: int
    near: int


class Element(NamedTuple):
    """A joint's element on its first and on its second link, and its lead: slide for one radian of a helical pair."""

    first: Any
    second: Any
    lead: Number = 0.0


class Pose(NamedTuple):
    """Frames of the links; elements of the joints and the screws of their freedoms (global); coordinates q; J and J⁻¹.

    size: a length typical of each lane, in which J has its lengths; orientation: sign of det J, which is the same all
    along one branch of assembly; gap: largest opening of a loop, m; ratios: of the gear pairs.
    """

    frames: tuple[Any, ...]
    elements: tuple[Element, ...]
    screws: tuple[list[Any], ...]
    q: tuple[Number, ...]
    jacobian: list[list[Number]]
    inverse: list[list[Number]]
    size: Number
    gap: Number
    condition: Number
    orientation: Number
    ratios: tuple[Number, ...] = ()


@dataclass(frozen=True)
class Tree(ABC):
    """The module with the given joints; `driven` lists those whose first coordinate is prescribed.

    redundant: whether the loops may ask for more than the coordinates can give; its equations are then solved by least
    squares, and its reactions are those of least elastic energy, see `groups.redundant`.

    algebra, motions: of the frames and screws, and of the pairs. BRANCHES: the assemblies of a closed form.
    """

    links: int
    joints: tuple[GroupJoint, ...]
    driven: tuple[int, ...] = ()
    redundant: bool = field(default=False, kw_only=True)
    BRANCHES: ClassVar[tuple[int, ...]] = ()
    algebra: ClassVar[Any]
    motions: ClassVar[Mapping[str, PairMotion]]

    # ---- links, joints and coordinates ------------------------------------------------------------------------

    @property
    def first(self) -> Sequence[int]:
        """Joints that are to be in the tree where they can be."""
        return self.driven

    @cached_property
    def steps(self) -> tuple[Step, ...]:
        """The tree, outermost link last."""
        return grow(self.links, self.joints, self.first)

    @cached_property
    def chords(self) -> tuple[int, ...]:
        """The joints that the tree leaves out, but for those between two known links."""
        inside = {step.joint for step in self.steps}
        return tuple(k for k, joint in enumerate(self.joints) if k not in inside and joint.sides != (OUTER, OUTER))

    @property
    @abstractmethod
    def order(self) -> tuple[int, ...]:
        """The joints whose coordinates are in q, in the order in which they are."""

    @cached_property
    def starts(self) -> dict[int, int]:
        """Where the coordinates of each joint begin in q."""
        counts = [len(self.motion(k).kinds) for k in self.order]
        return {k: sum(counts[:place]) for place, k in enumerate(self.order)}

    @cached_property
    def kinds(self) -> tuple[str, ...]:
        """What each entry of q is: "turn", "slide", or "part" of a quaternion."""
        return tuple(kind for k in self.order for kind in self.motion(k).kinds)

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
            (k, i) for k in self.order for i in range(len(self.motion(k).steps)) if not (k in self.driven and i == 0)
        )

    def motion(self, joint: int) -> PairMotion:
        """How a joint moves."""
        return self.motions[self.joints[joint].kind]

    def slides(self, joint: int, freedom: int) -> bool:
        """Whether a freedom is measured in metres."""
        return self.motion(joint).steps[freedom] == "slide"

    def coordinates(self, start: Sequence[Number], drive: Sequence[Number]) -> Coordinates:
        """Coordinates of each joint, from those of `kept` and the prescribed ones; none of a joint that is not in q."""
        values: list[Number] = [0.0] * len(self.kinds)
        for i, value in zip(self.kept, start, strict=True):
            values[i] = value
        for k, value in zip(self.driven, drive, strict=False):  # then come the numbers of gear pairs
            values[self.starts[k]] = value
        return self._by_joint(values)

    def _by_joint(self, values: Sequence[Number]) -> Coordinates:
        counts = {k: len(self.motion(k).kinds) for k in self.order}
        parts = {k: list(values[begin : begin + counts[k]]) for k, begin in self.starts.items()}
        return [parts.get(k, []) for k in range(len(self.joints))]

    def _in_row(self, q: Coordinates) -> list[Number]:
        return [value for k in self.order for value in q[k]]

    @cached_property
    def paths(self) -> dict[int, dict[int, int]]:
        """For each link the joints between it and the known links, each with the sign its screws count with."""
        paths: dict[int, dict[int, int]] = {OUTER: {}}
        for step in self.steps:
            paths[step.child] = {**paths[step.parent], step.joint: 1 if step.near == 0 else -1}
        return paths

    def weight(self, joint: int, across: int) -> int:
        """Sign with which the freedoms of a joint move what is second of the joint `across` against what is first.

        Of a chord its own freedoms count against it: they bring its second element where they say. 0 if they do not.
        """
        first, second = (self.paths[link] for link in self.joints[across].sides)
        return second.get(joint, 0) - first.get(joint, 0) - (joint == across and joint in self.chords)

    def size(self, elements: Sequence[Any]) -> Number:
        """A length typical of each lane, m: the widest spread of joint elements on one link, or of the known ones."""
        places: dict[int, list[Any]] = {}
        for joint, pair in zip(self.joints, elements, strict=True):
            for side, link in enumerate(joint.sides):
                places.setdefault(link, []).append(pair[side])
        size: Number = 0.0
        for first, *others in places.values():
            for other in others:
                size = np.fmax(size, self.algebra.distance(first, other))
        return np.where(size > 0, size, 1.0)

    def place(
        self, elements: Sequence[Any], q: Coordinates
    ) -> tuple[tuple[Any, ...], tuple[Element, ...], tuple[list[Any], ...]]:
        """Frames of all links, elements of all joints (global) and the screws of their freedoms."""
        frames: dict[int, Any] = {}
        element_frames: dict[tuple[int, int], Any] = {}

        def placed(k: int, side: int) -> Any:
            if (k, side) not in element_frames:
                link, local = self.joints[k].sides[side], elements[k][side]
                element_frames[k, side] = local if link == OUTER else self.algebra.compose(frames[link], local)
            return element_frames[k, side]

        for step in self.steps:
            k, motion = step.joint, self.motion(step.joint)
            move = motion.place if step.near == 0 else motion.unplace
            far = move(placed(k, step.near), q[k], *elements[k][2:])
            element_frames[k, 1 - step.near] = far
            frames[step.child] = self.algebra.relative(far, elements[k][1 - step.near])
        pairs = tuple(Element(placed(k, 0), placed(k, 1), *elements[k][2:]) for k in range(len(self.joints)))
        screws = tuple(self.motion(k).screws(*pair) for k, pair in enumerate(pairs))
        return tuple(frames[link] for link in range(self.links)), pairs, screws

    # ---- what a loop asks for ---------------------------------------------------------------------------------

    @property
    def asks(self) -> bool:
        """Whether anything is to be closed."""
        return bool(self.chords)

    @abstractmethod
    def count(self, chord: int) -> int:
        """How many rows a chord has."""

    @abstractmethod
    def gaps(self, placed: Sequence[Element], q: Coordinates, size: Number, drive: Sequence[Number]) -> list[Number]:
        """By how much each row is open: rad, and lengths in units of the size. The rows of the chords come first."""

    @abstractmethod
    def opening(self, placed: Sequence[Element], q: Coordinates, size: Number) -> Number:
        """Largest opening of a loop, m."""

    @abstractmethod
    def entries(self, chord: int, pair: Element, screw: Any, size: Number, slides: bool = False) -> Sequence[Number]:
        """Rates of the rows of a chord for a motion of its second side against the first, lengths over the size.

        slides: whether the motion is a slide, to be counted in units of the size.
        """

    @abstractmethod
    def cut_wrench(self, pose: Pose, chord: int, multipliers: Sequence[Number]) -> Any:
        """The wrench on the second side of a chord that the multipliers of its rows stand for."""

    def further_rows(
        self, placed: Sequence[Element], screws: Sequence[list[Any]], drive: Sequence[Number], size: Number
    ) -> list[list[Number]]:
        """Rows of J beyond those of the chords: of gear pairs, of links that must not spin."""
        return []

    def further_rates(self, pose: Pose, twists: Sequence[Any], outer: Sequence[Any]) -> list[Number]:
        """Rates of these rows, or second derivatives from those of the twists."""
        return []

    def further_carried(self, pose: Pose, twists: Sequence[Any], outer: Sequence[Any]) -> list[Number]:
        """What their second derivatives have beside, by the twists alone; none if nothing."""
        return []

    def further_loads(self, pose: Pose, multipliers: Sequence[Number]) -> list[tuple[int, Any]]:
        """What the multipliers of these rows do to the links."""
        return []

    def own_rates(self, pose: Pose, chord: int, rates: Sequence[Number], relative: Any) -> Sequence[Number]:
        """Rates of the freedoms of a chord. rates: as far as they are in q; relative: twist across it."""
        return rates

    # ---- position ---------------------------------------------------------------------------------------------

    def position(
        self, elements: Sequence[Any], assembly: Any, drive: Sequence[Number] = (), late: int = NEWTON_LIMIT
    ) -> Pose:
        """Pose by Newton from the coordinates `assembly` of `kept` (rad, m, quaternions).

        late: most rounds for lanes that are still open after QUICK. NaN in the lanes that do not close. Dual inputs:
        one more step at the solution for each level of ε.
        """
        with np.errstate(all="ignore"):
            real, real_drive = [each(pair, primal) for pair in elements], [primal(v) for v in drive]
            size = self.size(real)
            q = self.coordinates([primal(v) for v in assembly or ()], real_drive)
            q = self._newton(real, q, size, real_drive, late)
            numbers = [*drive, *(n for pair in elements for n in flat(pair))]
            row = self._in_row(q)
            q = self.coordinates([row[i] for i in self.kept], drive)
            for _ in range(depth(numbers)):
                q = self.advanced(q, self._steps(elements, q, size, drive), size)
            return self._posed(elements, q, size, drive)

    def _posed(self, elements: Sequence[Any], q: Coordinates, size: Number, drive: Sequence[Number] = ()) -> Pose:
        """The pose at its coordinates, with J⁻¹, its condition, and the sign of det J."""
        frames, placed, screws = self.place(elements, q)
        jacobian, gap = self.jacobian(placed, screws, size, drive), self.opening(placed, q, size)
        inverse: list[list[Number]] = []
        condition: Number = 1.0
        orientation: Number = 1.0
        if not jacobian or not self.free:  # held fast: either it closes as it is or not at all
            orientation = np.where(gap <= CLOSED * size, 1.0, np.nan)
            frames = each(frames, lambda n: n * orientation) if self.chords else frames
        elif self.redundant:
            inverse, condition = redundant.pseudo_inverse(jacobian), redundant.condition(jacobian)
        else:
            inverse, determinant = linalg.inverse(jacobian)
            condition = frobenius(jacobian, inverse)
            orientation = 1.0 if self.BRANCHES else np.sign(primal(determinant))  # a closed form stays on its branch
        row = tuple(self._in_row(q))
        ratios = tuple(drive[len(self.driven) :: NUMBERS])
        return Pose(frames, placed, screws, row, jacobian, inverse, size, gap, condition, orientation, ratios)

    def _newton(
        self, elements: Sequence[Any], q: Coordinates, size: Number, drive: Sequence[Number], rounds: int
    ) -> Coordinates:
        """Newton on real numbers; lanes that do not converge are NaN. rounds: for those that are late.

        Those go on alone: they are few or beyond help. Least squares end where the loops are open least, not always
        closed.
        """
        q = [[namespace(v).asarray(v, float) for v in joint] for joint in q]
        if not self.free or not self.asks:
            return q
        q, moved_by = self._iterate(elements, q, size, drive, QUICK)
        late = ~(moved_by <= NEARLY)
        if rounds and apart(late):
            shape = late.shape

            def part(number: Number) -> Number:
                # a number that is the same in all lanes stays one: of its zeros and ones no products are made
                return np.broadcast_to(number, shape)[late] if np.ndim(number) else number

            begin = [[np.broadcast_to(value, shape)[late] for value in joint] for joint in q]
            few = [each(pair, part) for pair in elements]
            better, last = self._iterate(few, begin, part(size), [part(v) for v in drive], rounds)
            moved_by = np.zeros(shape)
            moved_by[late] = last
            q = [
                [replaced(value, late, new) for value, new in zip(joint, after, strict=True)]
                for joint, after in zip(q, better, strict=True)
            ]
        q = self.advanced(q, self._steps(elements, q, size, drive), size)  # quadratic: from NEARLY to rounding
        closed = moved_by <= NEARLY
        if self.redundant:
            closed = closed & (self.opening(self.place(elements, q)[1], q, size) <= CLOSED * size)
        return [[np.where(closed, value, np.nan) for value in joint] for joint in q]

    def _iterate(
        self, elements: Sequence[Any], q: Coordinates, size: Number, drive: Sequence[Number], rounds: int
    ) -> tuple[Coordinates, Number]:
        """Newton steps until no lane moves by more than NEARLY (of its limit), at most `rounds`."""

        def step(state: list[Number]) -> list[Number]:
            now = self._by_joint(state[:-1])
            steps = self._steps(elements, now, size, drive)
            moves = [
                np.abs(value) / LIMITS[kind]
                for k, values in enumerate(steps)
                for value, kind in zip(values, self.motion(k).steps, strict=False)
            ]
            last = functools.reduce(np.maximum, moves)
            shrink = 1 / np.maximum(last, 1.0)  # as a whole, so that the direction stays
            after = self.advanced(now, [[value * shrink for value in values] for values in steps], size)
            further, there = [*self._in_row(after), last], arrived(state)
            if not np.any(there):
                return further
            return [np.where(there, *pair) for pair in zip(state, further, strict=True)]

        def arrived(state: list[Number]) -> Number:
            return np.logical_not(state[-1] > NEARLY)

        *row, last = looped(step, [*self._in_row(q), np.inf], rounds, arrived)
        return self._by_joint(row), np.broadcast_to(last, np.broadcast_shapes(*(np.shape(v) for v in (last, *row))))

    def _steps(self, elements: Sequence[Any], q: Coordinates, size: Number, drive: Sequence[Number]) -> Coordinates:
        """Newton's step in every freedom, slides in units of the size; 0 for the driven."""
        _, placed, screws = self.place(elements, q)
        jacobian, gaps = self.jacobian(placed, screws, size, drive), self.gaps(placed, q, size, drive)
        moves = redundant.least_squares(jacobian, gaps) if self.redundant else linalg.solve(jacobian, gaps)[0][0]
        steps = self.unmoved()
        for (k, i), move in zip(self.free, moves, strict=True):
            steps[k][i] = -move
        return steps

    def unmoved(self, driven: Sequence[Number] = ()) -> Coordinates:
        """A number for every freedom, those of the driven ones and else 0."""
        numbers: Coordinates = [[0.0] * len(self.motion(k).steps) for k in range(len(self.joints))]
        for k, value in zip(self.driven, driven, strict=False):
            numbers[k][0] = value
        return numbers

    def advanced(self, q: Coordinates, steps: Coordinates, size: Number) -> Coordinates:
        """The coordinates after steps in the freedoms, slides in units of the size."""
        moved: Coordinates = []
        for k, (values, step) in enumerate(zip(q, steps, strict=True)):
            motion = self.motion(k)
            scaled_step = [s * size if kind == "slide" else s for s, kind in zip(step, motion.steps, strict=True)]
            moved.append(motion.advanced(values, scaled_step) if values else [])
        return moved

    def jacobian(
        self, placed: Sequence[Element], screws: Sequence[list[Any]], size: Number, drive: Sequence[Number] = ()
    ) -> list[list[Number]]:
        """Rate of every row for a unit rate of every free coordinate, slides in units of the size."""
        matrix: list[list[Number]] = []
        for chord in self.chords:
            columns: list[Sequence[Number]] = []
            for k, i in self.free:
                weight = self.weight(k, chord)
                column: Sequence[Number] = ()
                if weight:
                    column = self.entries(chord, placed[chord], screws[k][i], size, self.slides(k, i))
                    column = column if weight == 1 else [weight * entry for entry in column]
                columns.append(column)
            matrix += [[column[row] if column else 0.0 for column in columns] for row in range(self.count(chord))]
        return matrix + self.further_rows(placed, screws, drive, size)

    # ---- velocity and acceleration ----------------------------------------------------------------------------

    def moved(
        self,
        pose: Pose,
        outer: Sequence[Any],
        outer_seconds: Sequence[Any],
        drive: Sequence[Number] = (),
        seconds: Sequence[Number] = (),
    ) -> tuple[list[Any], list[Any]]:
        """Twists of the links and their derivatives.

        outer, outer_seconds: those of the known link of each joint, None if it has none; of a joint between two known
        links those of its second against its first. drive, seconds: rates and second derivatives of the driven joints.
        """
        speeds = self.rates(pose, outer, drive)
        twists = self.twists(pose, outer, speeds)
        carried = [self._carried(pose, k, speeds[k], twists, outer) for k in range(len(self.joints))]
        driven = self.unmoved(seconds)
        second_motions = self.twists(pose, outer_seconds, driven, carried)
        rows: list[Number] = []
        for k in self.chords:
            relative = self.algebra.minus(self.across(k, second_motions, outer_seconds), carried[k])
            rows += self._opened(pose, k, relative, driven[k])
        more = self.further_carried(pose, twists, outer)
        further = self.further_rates(pose, second_motions, outer_seconds)
        rows += [rate + change for rate, change in zip(further, more, strict=True)] if more else further
        return twists, self.twists(pose, outer_seconds, self._closing(pose, driven, rows), carried)

    def rates(self, pose: Pose, outer: Sequence[Any], drive: Sequence[Number] = ()) -> Coordinates:
        """Rate of every freedom of every joint, rad/s and m/s."""
        rates = self.unmoved(drive)
        if not self.free:
            return rates
        twists = self.twists(pose, outer, rates)
        rows: list[Number] = []
        for k in self.chords:
            rows += self._opened(pose, k, self.across(k, twists, outer), rates[k])
        return self._closing(pose, rates, rows + self.further_rates(pose, twists, outer))

    def _opened(self, pose: Pose, chord: int, relative: Any, rates: Sequence[Number]) -> Sequence[Number]:
        """Rates of the rows of a chord that moves like that, of which its own freedoms take a part."""
        for screw, rate in zip(pose.screws[chord], rates, strict=True):
            relative = self.algebra.minus(relative, self.algebra.times(rate, screw))
        return self.entries(chord, pose.elements[chord], relative, pose.size)

    def _closing(self, pose: Pose, rates: Coordinates, rows: Sequence[Number]) -> Coordinates:
        """The rates with those of the free coordinates that close what is open."""
        closing = [list(values) for values in rates]
        for (k, i), line in zip(self.free, pose.inverse, strict=True) if rows else ():
            value = -linalg.weighted(line, rows)
            closing[k][i] = value * pose.size if self.slides(k, i) else value
        return closing

    def twists(
        self, pose: Pose, outer: Sequence[Any], rates: Sequence[Sequence[Number]], carried: Sequence[Any] = ()
    ) -> list[Any]:
        """Twists of the links from the rates of all freedoms; or their derivatives from second derivatives of these,
        and what carries the screws of each joint along."""
        algebra, twists = self.algebra, dict[int, Any]()
        for step in self.steps:
            k = step.joint
            base = (outer[k] or algebra.ZERO) if step.parent == OUTER else twists[step.parent]
            parts = [algebra.times(rate, screw) for screw, rate in zip(pose.screws[k], rates[k], strict=True)]
            add = algebra.added if step.near == 0 else algebra.minus
            twists[step.child] = functools.reduce(add, [*carried[k : k + 1], *parts], base)
        return [twists[link] for link in range(self.links)]

    def of(self, k: int, side: int, twists: Sequence[Any], outer: Sequence[Any]) -> Any:
        """Twist, or its derivative, of the link at one side of a joint, a known one included."""
        link = self.joints[k].sides[side]
        return (outer[k] or self.algebra.ZERO) if link == OUTER else twists[link]

    def across(self, k: int, twists: Sequence[Any], outer: Sequence[Any]) -> Any:
        """Twist of the second link of a joint against the first."""
        if self.joints[k].sides == (OUTER, OUTER):
            return outer[k]
        return self.algebra.minus(self.of(k, 1, twists, outer), self.of(k, 0, twists, outer))

    def _carried(self, pose: Pose, k: int, rates: Sequence[Number], twists: Sequence[Any], outer: Sequence[Any]) -> Any:
        """Σ q̇ (V × s) of a joint: its screws are carried along by its first link and by the freedoms before them."""
        algebra, motion = self.algebra, self.motion(k)
        bracket = algebra.bracket
        if k in self.chords:
            rates = self.own_rates(pose, k, rates, self.across(k, twists, outer))
        total, twist = algebra.ZERO, self.of(k, 0, twists, outer)
        for screw, rate in zip(pose.screws[k], rates, strict=True):
            part = algebra.times(rate, screw)
            total = algebra.added(total, bracket(twist, part))
            if not motion.together:
                twist = algebra.added(twist, part)
        return total

    # ---- reactions --------------------------------------------------------------------------------------------

    def reactions(self, pose: Pose, loads: Sequence[Any], supports: Sequence[Support] = ()) -> list[Any]:
        """Wrench on the second link of each joint by the first.

        loads: everything else that acts on each link, inertia included. The component along a driven freedom is the
        drive effort. Cut wrenches from Jᵀ λ = −(outboard power on each screw), the others link by link. supports: of
        the joints, which share what statics leaves open.
        """
        multipliers = self.multipliers(pose, loads)
        if self.redundant and multipliers:

            def energy(under: Sequence[Number], loaded: bool) -> NDArray[np.float64]:
                acting = loads if loaded else [self.algebra.ZERO_LOAD] * len(loads)
                wrenches = self.link_by_link(pose, acting, under)
                return redundant.weighed(self.algebra, wrenches, pose.elements, supports, pose.size)

            multipliers = redundant.least(pose.jacobian, energy, multipliers)
        return self.link_by_link(pose, loads, multipliers)

    def link_by_link(self, pose: Pose, loads: Sequence[Any], multipliers: Sequence[Number]) -> list[Any]:
        """The wrenches of all joints from those of the loops."""
        algebra, carried, reactions = self.algebra, dict(enumerate(loads)), dict[int, Any]()
        rest = iter(multipliers)
        for k in self.chords:
            reactions[k] = wrench = self.cut_wrench(pose, k, [next(rest) for _ in range(self.count(k))])
            first, second = self.joints[k].sides
            if second != OUTER:
                carried[second] = algebra.added(carried[second], wrench)
            if first != OUTER:
                carried[first] = algebra.minus(carried[first], wrench)
        for link, load in self.further_loads(pose, list(rest)):
            if link != OUTER:
                carried[link] = algebra.added(carried[link], load)
        for step in reversed(self.steps):
            total = carried[step.child]
            reactions[step.joint] = algebra.times(-1.0 if step.near == 0 else 1.0, total)
            if step.parent != OUTER:
                carried[step.parent] = algebra.added(carried[step.parent], total)
        return [reactions.get(k, algebra.ZERO_LOAD) for k in range(len(self.joints))]

    def multipliers(self, pose: Pose, loads: Sequence[Any]) -> list[Number]:
        """λ of every row."""
        if not pose.inverse:
            return [0.0] * len(pose.jacobian)
        algebra, outboard = self.algebra, dict(enumerate(loads))
        for step in reversed(self.steps):
            if step.parent != OUTER:
                outboard[step.parent] = algebra.added(outboard[step.parent], outboard[step.child])
        hung = {step.joint: step for step in self.steps}
        powers: list[Number] = []
        for k, i in self.free:
            if k not in hung:
                powers.append(0.0)
                continue
            value = algebra.power(outboard[hung[k].child], pose.screws[k][i])
            value = value * pose.size if self.slides(k, i) else value
            powers.append(value if hung[k].near == 0 else -value)
        return [-linalg.weighted([line[j] for line in pose.inverse], powers) for j in range(len(pose.inverse[0]))]

    def closure(self, pose: Pose) -> Number:
        """Largest distance by which a loop is open, m."""
        return pose.gap

    def condition(self, pose: Pose) -> Number:
        """2/n ‖J‖·‖J⁻¹‖ (Frobenius) with lengths in units of the size: 2 at best."""
        return pose.condition

    @abstractmethod
    def signature(self, pose: Pose, spread: float) -> list[Number]:
        """Numbers that tell assemblies apart."""


def grow(links: int, joints: Sequence[GroupJoint], first: Sequence[int]) -> tuple[Step, ...]:
    """Spanning tree rooted at the outer links, parents before children; joints in `first` go in if they can.

    Raises ValueError if a link hangs on nothing.
    """
    leader = {link: link for link in (OUTER, *range(links))}

    def lead(link: int) -> int:
        while leader[link] != link:
            link = leader[link]
        return link

    chosen: list[int] = []
    for k in [*first, *(k for k in range(len(joints)) if k not in first)]:
        a, b = (lead(link) for link in joints[k].sides)
        if a != b:
            leader[a] = b
            chosen.append(k)
    steps: list[Step] = []
    reached = {OUTER}
    while len(reached) <= links:
        before = len(reached)
        for k in chosen:
            for near in (0, 1):
                parent, child = joints[k].sides[near], joints[k].sides[1 - near]
                if parent in reached and child not in reached:
                    steps.append(Step(k, parent, child, near))
                    reached.add(child)
        if len(reached) == before:
            raise ValueError("a link of the module is joined to nothing")
    return tuple(steps)


def frobenius(jacobian: Sequence[Sequence[Number]], inverse: Sequence[Sequence[Number]]) -> Number:
    """2/n ‖J‖·‖J⁻¹‖, real parts; a literal zero costs nothing."""
    squares: list[Number] = []
    for matrix in (jacobian, inverse):
        total: Number = 0.0
        for real in (primal(value) for line in matrix for value in line):
            if not (isinstance(real, float) and real == 0.0):
                total = total + real * real
        squares.append(total)
    return 2 * np.sqrt(squares[0] * squares[1]) / len(inverse)
