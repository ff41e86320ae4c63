"""Locking over the cycle, read of courses: ranges of its states, the margin, the joint that decides, the way back, and
the friction that holds the loads.

Powers of the mechanism passed forward and backward are rows over time. Its state changes where one of these passes zero
or a module locks, whatever positions are asked for.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import floor, isfinite, isnan, log10
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Accuracy, Place
from trunnion.algebra.dual import primal, single
from trunnion.algebra.panels import CANCELLED
from trunnion.cycle.course import CycleCourse, course_of, margin_of
from trunnion.cycle.scales import scales_of
from trunnion.errors import Coded, Status
from trunnion.results.attributes import MORE_THAN, Figure
from trunnion.results.quantities import readable
from trunnion.solve import continuation
from trunnion.solve.backward import Backward, Given, backward, status_of
from trunnion.solve.bristles import histories
from trunnion.solve.continuation import largest
from trunnion.solve.forward import Forward
from trunnion.solve.friction import FrictionProblem, frictionless, scaled
from trunnion.solve.friction_method import MARGIN, FrictionMethod
from trunnion.solve.loads import has_useful_work, useful_powers
from trunnion.solve.margin import least_beside, margin_in
from trunnion.solve.switches import MARGINS, root
from trunnion.solve.system import felt, law_of, scale_of

if TYPE_CHECKING:
    from trunnion.solve.run import Run

Array = NDArray[np.float64]
NEAR = 1.5  # a locking margin below it counts as near locking, unless another is stated
HEAD = ("state", "from", "to", "smallest margin", "at")  # of the table of ranges
TIMES = "times the friction"  # what a locking margin is
LITTLE = 1e-3  # of what the useful loads give: what masses, other loads and springs may supply beside it
BACK = Accuracy(1e-8, shortest=1e-8, rounds=14, most=32)  # beside a locked position each one takes long
HOLDING = 1e-13  # of a multiple of all friction: how near that is found at which friction begins to hold
NODES = 9  # multiples among which the first that holds is looked for
UNLOCKED = 1e-9  # of the multiple at which it locks: with less by that it does not
SHORT = 3e-5  # of the cycle, as 0.01° of a turn: a range that is less is none, and an end as near to a break is at it
BITS = 48  # joints that are told apart by the state of their critical multiples
MOST_PLACES = 3  # named in one figure
SIDE = 1e-7  # of the cycle: beside a break
BESIDE = 1e-8  # of the cycle: a position that is next to an end is behind it
CLOSE = 1e-3  # degrees of the drive to which an end is told: two decimals are shown
SHARE = 1e-5  # of the drive's travel, where that is not in degrees


class LockingState(Coded):
    """What friction does at a position, forward and when all speeds are reversed.

    The loads are all that acts: loads and springs, useful or not, weight and inertia.
    """

    RUNS = 0, "loads do not push"  # neither backward nor forward
    BACKDRIVABLE = 1, "can be backdriven"  # the loads drive it backward, and the drive brakes it
    SELF_LOCKING = 2, "self-locking"  # the loads push it backward, but do not overcome friction
    LOCKED_BACKWARD = 3, "locked backward"  # no drive effort can move it backward
    LOCKED = 4, "locked"  # no drive effort can move it forward
    JAMMED = 5, "jammed"  # locked forward and backward
    UNSOLVED = 6, "not solved"
    SELF_LOCKING_FORWARD = 7, "self-locking, pushed forward"  # by the loads, which do not overcome friction
    DRIVEN_ON = 8, "loads drive it on"  # and the drive brakes it


STATES = list(LockingState)  # by their codes
HELD = {LockingState.SELF_LOCKING, LockingState.SELF_LOCKING_FORWARD}
PUSHES = {*HELD, LockingState.BACKDRIVABLE, LockingState.DRIVEN_ON}
HELD_AND_DRIVEN = {LockingState.SELF_LOCKING_FORWARD, LockingState.DRIVEN_ON}
NO_MARGIN = (LockingState.LOCKED, LockingState.JAMMED, LockingState.UNSOLVED)  # these are not near locking
BACK_LOCKED = (LockingState.LOCKED_BACKWARD, LockingState.JAMMED)


# ---- passed forward and backward ------------------------------------------------------------------------------


class Passage(NamedTuple):
    """Positions passed forward or backward: effort of every driver, where it locks, and what flows where.

    delivered: power that the drivers take out, W; acting: power that loads, springs, weight and inertia put in, W;
    given: that of the useful loads and springs alone.
    """

    efforts: dict[str, Array]
    locked: NDArray[np.bool_]
    delivered: Array
    acting: Array
    given: Array

    @classmethod
    def of(cls, back: Backward) -> Passage:
        """As the positions are passed in the direction of a walk that is solved."""
        walk, shape = back.walk, np.shape(back.walk.time)
        efforts = {name: np.broadcast_to(effort, shape) for name, effort in back.efforts.items()}
        delivered = -sum((effort * walk.rate(name) for name, effort in efforts.items()), np.zeros(shape))
        useful = useful_powers(walk, back.load_powers, back.springs)
        every = [back.body_power, *back.load_powers.values(), *(spring.power for spring in back.springs.values())]
        useful_power, acting = (
            sum((np.broadcast_to(power, shape) for power in powers), np.zeros(shape)) for powers in (useful, every)
        )
        locked = np.broadcast_to(np.less(back.share, 1.0), shape)
        return cls(efforts, locked, delivered, acting, useful_power)


def passed(run: Run, walk: Forward, method: FrictionMethod) -> Passage:
    """Positions of a walk, in its direction.

    Of one that goes `backward` speeds are turned round, friction and all that resists with them; inertia stays, for
    accelerations do.
    """
    return Passage.of(solved_along(run, walk, method))


def solved_along(run: Run, walk: Forward, method: FrictionMethod) -> Backward:
    """Forces at positions of a walk, in its direction."""
    turned, time = walk.direction < 0, np.asarray(walk.time, float)
    past = histories(run.system, run.values, run.chosen.assembly, run.cycle, turned)
    time = run.cycle.duration - time if turned else time
    deflections = {joint: history.at(time) for joint, history in past.items()}
    with np.errstate(all="ignore"):
        return backward(walk, method, Given({}, deflections))


# ---- multiples of the friction --------------------------------------------------------------------------------


def critical_multiples(back: Backward, most: float) -> dict[str, Array]:
    """For each joint the multiple of its own friction at which it locks its module, the others' being as they are.

    ∞ where it does not up to `most`, 0 where the module locks even without friction in this joint, NaN where it has no
    loads, because another one locks.
    """
    system, positions = back.walk.system, np.shape(back.walk.time)
    multiples: dict[str, Array] = {}
    for number, settled in zip(reversed(range(len(system.plan.modules))), back.settled, strict=True):
        if settled.problem is None:
            continue
        contacts = settled.problem.contacts
        places = list(dict.fromkeys(contact.joint for contact in contacts if contact.rubs))
        if not places:  # nothing but gears pushed apart
            continue
        masks = np.array([[contact.joint == place for contact in contacts] for place in places], bool)
        loads = largest(settled.problem.state([0.0] * len(contacts)).normals)
        for place, multiple in zip(places, _alone(settled.problem, masks, most), strict=True):
            multiple = np.where(np.isfinite(loads), multiple, np.nan)
            multiples[system.rubbing_joint(number, place)] = np.broadcast_to(multiple, positions)
    return {joint: multiples[joint] for joint in system.joints if joint in multiples}


def multiples_at(run: Run, time: Array, most: float) -> dict[str, Array]:
    """`critical_multiples` at times, s; where a joint turns round they are the less of those just before and after."""

    def solved(at: Array) -> Backward:
        return run.solve(at, method=FrictionMethod())

    back = solved(time)
    multiples = critical_multiples(back, most)
    rests = [np.broadcast_to(resting, time.shape) for resting in back.resting.values()]
    turning = np.flatnonzero(np.any(rests, axis=0))
    if not multiples or not len(turning) or not run.cycle.duration > 0:
        return multiples
    rows = np.array(list(multiples.values()))
    least = least_beside(
        lambda sides: np.array(list(critical_multiples(sides, most).values())), solved, time[turning], run.cycle
    )
    rows[:, turning] = np.where(np.isnan(least), rows[:, turning], least)
    return dict(zip(multiples, rows, strict=True))


def multiple_of(rows: Array) -> Array:
    """A multiple of friction, which is 0 at least: polynomials through its values pass that by their tolerance."""
    return np.asarray(np.maximum(rows[0], 0.0))


def least_margin(course: CycleCourse) -> Place | None:
    """Where the locking margin of a course is the least; None where it is beyond what was looked for."""
    return course.extreme("locking_margin", of=multiple_of, sign=-1.0, panels=course.valid)


def _alone(problem: FrictionProblem, masks: NDArray[np.bool_], most: float) -> Array:
    """The multiples for the contacts of each joint: the others' friction is raised to full first, then theirs.

    masks: which contacts are those of the joint, (joint, contact). The joints are followed side by side, each in lanes
    of its own.
    """
    every, lanes = problem.picked(True)
    bounds = [np.asarray(problem.bound([most if mine else 1.0 for mine in mask])) for mask in masks]
    doubtful = np.array([np.broadcast_to(np.isfinite(bound) & (bound >= 1.0), lanes.shape) for bound in bounds])
    result = np.full(doubtful.shape, np.inf)
    joint, lane = np.nonzero(doubtful.reshape(len(masks), -1))
    if len(lane):
        part, mine = every.mapped(lambda number: number[lane]), masks[joint].T

        def weights(share: Array) -> Sequence[Array]:
            return list(np.where(mine, np.maximum(share - 1.0, 0.0), np.minimum(share, 1.0)))

        _, reached = continuation.follow(scaled(part, weights), frictionless(part), 1.0 + most)
        result[doubtful] = np.where(reached >= 1.0 + most, np.inf, np.maximum(reached - 1.0, 0.0))
    return result


def holding_multiples(run: Run, time: Array) -> Array:
    """Multiple of all friction down to which friction holds the loads, at each time, s; NaN where it does not.

    There the power delivered to the drivers, in the direction in which the loads push, falls to 0, or it locks. 0 where
    it is held without the friction that follows loads.
    """
    multiples, least = np.full(len(time), np.nan), scales_of(run).floor("W")
    walk = run.walk(time)
    for direction in (walk, walk.backward()):
        back = solved_along(run, direction, FrictionMethod())
        full = Passage.of(back)
        holding = np.flatnonzero((full.acting > least) & (full.locked | (full.delivered <= 0)))
        if not len(holding):
            continue

        def delivered(lane: NDArray[np.intp], multiple: Array, turned: bool = direction.direction < 0) -> Array:
            """Power delivered to the drivers for multiples of all friction; below 0 where it locks."""
            part = run.walk(time[lane])
            through = passed(run, part.backward() if turned else part, FrictionMethod(multiple=multiple))
            return np.where(through.locked, -np.abs(through.acting), through.delivered)

        with np.errstate(all="ignore"):
            margins = np.broadcast_to(np.asarray(margin_in(back, 1.0), float), time.shape)[holding]
            last = np.where(margins <= 1.0, margins * (1.0 - UNLOCKED), 1.0)  # there it does not lock yet
            nodes = last[:, None] * np.linspace(0.0, 1.0, NODES)
            power = delivered(np.repeat(holding, NODES), nodes.ravel()).reshape(nodes.shape)
            holds = power <= 0.0
            first = np.argmax(holds, axis=1)
            multiples_held = np.where(np.any(holds, axis=1), 0.0, margins)
            inside = np.flatnonzero(first > 0)
            if len(inside):
                ends = [(inside, first[inside] - 1), (inside, first[inside])]
                (low, high), (at_low, at_high) = ([rows[end] for end in ends] for rows in (nodes, power))
                near = np.full(len(low), HOLDING)
                multiples_held[inside] = root(partial(delivered, holding[inside]), low, high, at_low, at_high, near)
        multiples[holding] = multiples_held
    return multiples


# ---- over the cycle -------------------------------------------------------------------------------------------


class LockingRange(NamedTuple):
    """A part of the cycle in one state, or with a margin below the one that counts as near locking.

    state: None of the latter; low, high: its ends, s; margin: the smallest locking margin in it, ∞ beyond what is
    looked for, NaN if it is not known; at: where, in words; ends, places: on the dial of the drive, and in words.
    """

    state: LockingState | None
    low: float
    high: float
    margin: float
    at: str
    ends: list[float]
    places: list[str]

    def cells(self, near: float = NEAR) -> list[str]:
        """The row of the table with HEAD."""
        state = f"margin below {near:g}" if self.state is None else self.state.text
        margin = readable(self.margin) if isfinite(self.margin) else f"more than {MARGIN:g}"
        return [state, *self.places, "—" if isnan(self.margin) else margin, self.at]


def locking_course(run: Run, method: FrictionMethod) -> LockingCourse | None:
    """Locking over the cycle of a run, found once; None without a driver."""
    if not run.system.mechanism.drivers:
        return None
    return run.once(("locking", method), lambda: LockingCourse(run, method))


@dataclass(frozen=True)
class LockingCourse:
    """Locking over the cycle. method: how friction is settled, and how far the margin is looked for."""

    run: Run
    method: FrictionMethod

    @cached_property
    def course(self) -> CycleCourse:
        """Power, W: delivered to the drivers forward, and put in by all that acts; the same backward; there that of the
        useful loads, and of all else; then the effort of every driver backward. The states of the panels are codes of
        `LockingState`, pins in the middle of their play.
        """
        run, plain = self.run, replace(self.method, name="newton", margin_up_to=0.0)
        seated = course_of(run, replace(self.method, margin_up_to=0.0)) if run.seats else None
        least, drivers = scales_of(run).floor("W"), run.system.mechanism.drivers

        def look(time: Array) -> tuple[Array, NDArray[np.integer]]:
            back = run.solve(time, method=plain)
            ahead, other = Passage.of(back), passed(run, back.walk.backward(), plain)
            status: NDArray[np.integer] = status_of(back, time.shape)
            locked = ahead.locked
            if seated is not None:  # where it locks pins are in their seats
                status = seated.status[seated.courses.panel(time + BESIDE * seated.courses.span)]
                locked = status == Status.LOCKED
            answered = ((status < Status.NOT_CONVERGED) | (status == Status.LOCKED)) & np.isfinite(other.acting)
            forward = np.where(ahead.locked | locked, np.nan, [ahead.delivered, ahead.acting])
            powers = [*forward, other.delivered, other.acting, other.given, other.acting - other.given]
            state_codes = np.where(answered, 2 * locked + other.locked, 4)  # 0: runs both ways; 3: neither
            return np.stack([*powers, *(other.efforts[name] for name in drivers)]), state_codes

        def like(sizes: Array) -> Array:
            return np.concatenate([np.full(6, np.max(sizes[:6])), np.full(len(drivers), np.max(sizes[6:]))])

        bends = [*(bend.time for bend in run.bends), *(seated.courses.breaks if seated else ())]
        courses = run.courses(look, bends, BACK, like)
        levels = (-least, least, 0.0, least)
        times = np.concatenate([courses.passages(row, level) for row, level in enumerate(levels)])
        # a power that is 0 at a break passes there
        away = np.min(np.abs(times[:, None] - courses.breaks), axis=1)
        cut = courses.parted(times[away > SHORT * courses.span])
        delivered, acting, back_delivered, back_acting, *_ = cut.at(cut.edges[:-1] + cut.half)
        driven, pushing = back_acting > least, acting > least
        cases = [
            (cut.states == 4, LockingState.UNSOLVED),
            (cut.states == 3, LockingState.JAMMED),
            (cut.states == 2, LockingState.LOCKED),
            (cut.states == 1, LockingState.LOCKED_BACKWARD),
            (driven & (back_delivered > 0), LockingState.BACKDRIVABLE),
            (pushing & (delivered >= -least), LockingState.DRIVEN_ON),
            (driven, LockingState.SELF_LOCKING),
            (pushing, LockingState.SELF_LOCKING_FORWARD),
        ]
        where, codes = zip(*cases, strict=True)
        states = np.select(where, [int(code) for code in codes], int(LockingState.RUNS))
        breaks = np.union1d(courses.breaks, cut.edges[1:-1][np.diff(states) != 0])
        shapes = {"forward": (2,), "delivered": (), "acting": (), "given": (), "others": (), "effort": (len(drivers),)}
        return CycleCourse(run, shapes, replace(cut, states=states, breaks=breaks))

    def all_states(self) -> set[LockingState]:
        """The states that there are."""
        return {STATES[code] for code in np.unique(self.course.status)}

    def pushed(self) -> bool:
        """Whether anything acts on it."""
        return bool(np.nanmax(np.abs(self.course.courses.coefficients[:, 3:6]), initial=0.0) > 0)

    def states_at(self, time: Array) -> NDArray[np.int8]:
        """The code of the state at times, s; where it changes that of what follows."""
        courses = self.course.courses
        return self.course.status[courses.panel(time + BESIDE * courses.span)].astype(np.int8)

    def reverse_figure(self) -> Figure | None:
        """Power that reaches the drivers over that of the useful loads and springs; None if these do not drive.

        A mean over the cycle, so it is called self-locking only if friction holds the loads wherever they push.
        """
        run, courses = self.run, self.course.courses.picked(np.array([2, 4, 5]))
        name, subject = "efficiency_reverse", "efficiency when backdriven by the useful loads" + centred(run)
        if not has_useful_work(run.system.mechanism):
            return None
        error, means = np.maximum(courses.error(), CANCELLED * courses.mean(np.abs)), courses.mean()
        delivered, useful, others = np.where(np.abs(means) <= error, 0.0, means)
        if np.isfinite(useful) and not useful > 0:
            return None
        states, others_help = self.all_states(), others > max(np.sum(error[:2]), LITTLE * useful)
        unsolved = LockingState.UNSOLVED in states or not np.isfinite(delivered + useful)
        none = [
            ("it locks", courses.share(np.isin(courses.states, BACK_LOCKED)) > SHORT),
            ("not every position is solved", unsolved),
            ("other loads, masses or springs supply work too", others_help),
        ]
        if note := next((reason for reason, holds in none if holds), ""):
            return Figure(name, subject, None, note=note)
        pushes = self.all_states() & PUSHES
        value = min(float(delivered / useful), 1.0)
        note = "the mean; see the ranges of `locking`" * bool(len(pushes) > 1 and felt(run.system, run.values))
        if value <= 0:
            holding = pushes <= {LockingState.SELF_LOCKING}
            note = "self-locking" if holding else "it takes work on the whole; see the ranges of `locking`"
        return Figure(name, subject, value, note=note)

    def reversing_figures(self) -> Iterator[Figure]:
        """The largest effort that each driver has to supply to go back over its range, as to open a clamp."""
        run, scales, courses = self.run, scales_of(self.run), self.course.courses
        if run.cycle.periodic:
            return
        for i, name in enumerate(run.system.mechanism.drivers):
            unit = "N m" if run.system.turns(name) else "N"
            # a drive supplies effort against the sense in which it went forward; it goes one way where it has a dial
            middles = courses.edges[:-1] + courses.half
            sense = np.sign(primal(run.system.drive(run.values, name, middles)[1])) * np.ones(len(middles))
            tops = []
            for sign in (1.0, -1.0):
                top = self.course.extreme("effort", i, sign=-sign, panels=sense == sign, unit=unit)
                tops += [] if top is None else [(-sign * top.value, top)]
            supplied, top = max(tops, key=lambda pair: pair[0], default=(0.0, None))
            if top is not None and supplied > scales.floor(unit):
                subject = f"drive {'torque' if unit == 'N m' else 'force'} of {name} to reverse the motion"
                yield self.course.figure(f"{name}.effort_reverse", subject, top, unit, "largest")

    # ---- ranges -----------------------------------------------------------------------------------------------

    def ranges(self, near: float = NEAR) -> list[LockingRange]:
        """The parts of the cycle in which its state stays the same, in their order; after them those that run, but with
        a margin below `near`."""
        courses = self.course.courses
        parts: list[tuple[LockingState | None, float, float]] = [
            (STATES[code], low, high)
            for code, low, high in _merged(courses.edges, courses.states, SHORT * courses.span)
        ]
        if self.margins is not None:  # where it runs with a margin below `near`
            margins = self.margins.courses
            cut = margins.parted(np.concatenate([courses.edges, margins.passages(0, near)]))
            middles = cut.edges[:-1] + cut.half
            close = (cut.at(middles)[0] < near) & ~np.isin(self.states_at(middles), NO_MARGIN)
            ranges = _merged(cut.edges, close.astype(int), SHORT * cut.span)
            parts += [(None, low, high) for below, low, high in ranges if below]
        # ends on the dial of the drive, as accurately as they are known, and as a person reads them
        times = [end for _, *ends in parts for end in ends]
        dial = self.run.system.dial(self.run.values, np.array([*times, 0.0, self.run.cycle.duration]))
        accuracy = CLOSE if dial.unit == "°" else SHARE * float(np.ptp(dial.values[-2:]))
        digits = floor(-log10(accuracy)) if accuracy > 0 else 15
        values = [round(float(value), digits) + 0.0 for value in dial.values[:-2]]  # so that an end at 0 is 0
        places = [f"{value:.5g}{dial.unit}" for value in values]
        if dial.unit == "°":
            places = [f"{round(value, 2) + 0.0:.2f}".rstrip("0").rstrip(".") + "°" for value in values]
        return [
            LockingRange(state, low, high, *self._least(low, high), values[k : k + 2], places[k : k + 2])
            for k, (state, low, high) in zip(range(0, len(times), 2), parts, strict=True)
        ]

    def _least(self, low: float, high: float) -> tuple[float, str]:
        """The smallest margin between two times, s, and where."""
        if self.margins is None:
            return np.nan, ""
        part = self.margins.courses.between(low, high)
        valid = self.margins.valid[self.margins.courses.panel(part.edges[:-1] + part.half)]
        least = part.extreme(multiple_of, -1.0, valid)
        if least is not None:
            return least.value, self.margins.told(least).removeprefix("at ")
        return (np.inf if np.any(valid & (part.states < Status.LOAD_UNDEFINED)) else np.nan), ""

    def attribute(self, time: Array, near: float = NEAR) -> dict[str, Any]:
        """The ranges for the attribute `locking_ranges` of a result: see `docs/reference/results.md`."""
        dial, duration = self.run.system.dial(self.run.values, time), self.run.cycle.duration or 1.0
        rows, margin = [], BESIDE * duration
        for part in self.ranges(near):
            first = int(np.searchsorted(time, part.low - margin))
            last = len(time) if part.high >= duration else int(np.searchsorted(time, part.high - margin))
            state = "" if part.state is None else part.state.name.lower()
            place = {"first": first, "count": last - first, "times": [part.low, part.high]}
            rows.append({"state": state, **place, "cells": part.cells(near), "ends": part.ends})
        return {"of": dial.of, "unit": dial.unit.strip(), "positions": len(time), "near": near, "rows": rows}

    # ---- the margin and the joint that decides ----------------------------------------------------------------

    @cached_property
    def margins(self) -> CycleCourse | None:
        """The course of the locking margin; None if it is not looked for."""
        return margin_of(self.run, self.method) if self.method.margin_up_to else None

    def margin_figure(self, subject: str = "locking margin", note: str = TIMES) -> Figure | None:
        """The least multiple of all friction at which it locks; `margin_up_to` is as far as that is looked for."""
        name, margins = "locking_margin", self.margins
        if margins is None:
            return None
        least = least_margin(margins)
        if least is not None:
            return Figure(name, subject, least.value, aspect="minimum", place=margins.told(least), note=note)
        if np.any(margins.valid & (margins.status < Status.LOAD_UNDEFINED)):
            return Figure(name, subject, self.method.margin_up_to, aspect=MORE_THAN, note=note)
        return Figure(name, subject, None, note=note)

    @cached_property
    def responsible(self) -> tuple[str, float] | None:
        """The joint whose friction, changed alone, decides at the place of the least margin, and the multiple of it.

        Of a mechanism that runs, the first to lock it; of one that is locked, the one that need be lowered the least.
        """
        margins = self.margins
        if margins is None:
            return None
        least = least_margin(margins)
        if least is None:
            return None
        beside = least.side * SIDE * margins.courses.span  # of a break that the margin has this value at
        time = np.array([0.0 if least.everywhere else least.time + beside])
        with np.errstate(all="ignore"):
            multiples = multiples_at(self.run, time, self.method.margin_up_to)
        finite = [(float(multiple[0]), joint) for joint, multiple in multiples.items() if np.isfinite(multiple[0])]
        locked = [pair for pair in finite if pair[0] < 1.0]
        choose, pairs = (max, locked) if locked else (min, finite)
        multiple, joint = choose(pairs, key=lambda pair: pair[0], default=(0.0, ""))
        return (joint, multiple) if joint and (multiple > 0 or not locked) else None

    def critical_figures(self) -> Iterator[Figure]:
        """The least critical multiple of each joint whose friction is not 0, and its friction there."""
        run, joints = self.run, felt(self.run.system, self.run.values)
        unbounded = np.zeros(len(joints), bool)  # where a joint does not lock up to the margin

        def look(time: Array) -> tuple[Array, NDArray[np.int64]]:
            multiples = critical_multiples(run.solve(time, method=FrictionMethod()), MARGIN)
            rows = np.array([multiples.get(joint, np.full(time.shape, np.nan)) for joint in joints])
            unbounded[np.any(np.isinf(rows), axis=1)] = True
            rows = np.where(np.isfinite(rows), rows, np.nan)
            return rows, np.tensordot(1 << (np.arange(len(joints)) % BITS), np.isfinite(rows), 1)

        if not joints:
            return
        breaks = self.course.courses.breaks
        course = CycleCourse(
            run, {"multiple": (len(joints),)},
            run.courses(look, breaks, MARGINS, joints=len(run.system.joints) * len(joints)),
        )  # fmt: skip
        every = np.ones(len(course.status), bool)
        for i, joint in enumerate(joints):
            name, subject = f"{joint}.critical_multiple", f"critical multiple of {joint} alone"
            least = course.extreme("multiple", i, of=multiple_of, sign=-1.0, panels=every)
            if least is None:
                yield Figure(name, subject, MARGIN if unbounded[i] else None, aspect=MORE_THAN * bool(unbounded[i]))
                continue
            alone = critical_figure(run, joint, least.value, course.told(least))
            if least.value > 0:
                yield Figure(name, subject, least.value, aspect="minimum", place=course.told(least))
            if alone.name != name or not least.value > 0:
                yield alone

    # ---- friction that holds the loads ------------------------------------------------------------------------

    def holding_figures(self) -> list[Figure]:
        """From which friction on it holds: wherever the loads push, if it does, else at the end of its range, if there.

        None where it holds even without, as where masses take more than the loads give.
        """
        run, pushes = self.run, self.all_states() & PUSHES
        everywhere = bool(pushes) and pushes <= HELD
        if not everywhere and run.cycle.periodic:
            return []
        end = np.array([run.cycle.duration])
        if everywhere:

            def look(time: Array) -> tuple[Array, NDArray[np.int64]]:
                multiples = holding_multiples(run, time)
                return multiples[None], np.isfinite(multiples).astype(int)

            courses = run.courses(look, self.course.courses.breaks, MARGINS._replace(tolerance=1e-9))
            course = CycleCourse(run, {"multiple": ()}, courses)
            top = course.extreme("multiple", panels=np.ones(len(course.status), bool))
            multiple, place = (0.0, "") if top is None else (top.value, course.told(top))
        else:
            multiple, place = float(holding_multiples(run, end)[0]), f"at {run.system.dial(run.values, end).at(0)}"
        if not multiple > 0:
            return []
        aspect, subject = "maximum" * everywhere, "down to which it is self-locking" + centred(run)
        forward = self.states_at(end)[0] == LockingState.SELF_LOCKING_FORWARD
        note = "below it the loads drive it on, onto a stop there" * bool(forward and not run.cycle.periodic)
        more = ("1", aspect, place, note)
        figures = [Figure("holding_multiple", f"multiple of all friction {subject}", multiple, *more)]
        rubbing = {joint: scale_of(run.system, run.values, joint) for joint in felt(run.system, run.values)}
        alike = set(rubbing.values()) == {"coefficient"}
        paths = {f"joints.{joint}.friction.{scale}" for joint, scale in rubbing.items() if alike}
        same = {single(run.values[path]) if path in run.values else np.nan for path in paths}
        if len(same) == 1 and np.isfinite(value := same.pop()):
            subject = f"friction coefficient {subject}"
            figures.append(Figure("holding_coefficient", subject, multiple * value, *more))
        return figures


# ---- words ----------------------------------------------------------------------------------------------------


def critical_figure(run: Run, joint: str, multiple: float, place: str) -> Figure:
    """The critical friction of a joint alone: its coefficient if its law is proportional to one, else the multiple."""
    parameter = scale_of(run.system, run.values, joint)
    if not multiple > 0 or not parameter:
        subject = f"critical multiple of the friction of {joint} alone" + " (it locks even without)" * (
            not multiple > 0
        )
        return Figure(f"{joint}.critical_multiple", subject, multiple, place=place)
    value = single(run.values[f"joints.{joint}.friction.{parameter}"])
    subject = f"critical friction {parameter} of {joint} alone"
    unit = law_of(run.system, joint).parameters[parameter].unit or "1"
    return Figure(f"{joint}.critical_{parameter}", subject, multiple * value, unit, place=place)


def centred(run: Run) -> str:
    """What ranges and the way back are of: of the mechanism without play."""
    return ", pins centred" * bool(run.seats)


def _merged(edges: Array, codes: NDArray[np.integer], shortest: float) -> list[tuple[int, float, float]]:
    """Code, begin and end of the stretches of one code; what is shorter than `shortest` is of what follows."""
    stretches: list[tuple[int, float, float]] = []
    low = float(edges[0])
    for k, code in enumerate(codes.tolist()):
        high = float(edges[k + 1])
        if k + 1 < len(codes) and codes[k + 1] == code:
            continue
        if high - low <= shortest and k + 1 < len(codes):
            continue  # the next begins here
        if stretches and (stretches[-1][0] == code or high - low <= shortest):
            stretches[-1] = (*stretches[-1][:2], high)
        else:
            stretches.append((code, low, high))
        low = high
    return stretches
