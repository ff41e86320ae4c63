"""Where the pins lie in their holes over the cycle: seats that are given, and those that the reactions press them into.

A seat and the reactions depend on each other: the seat moves the links by some ρ/l of their size, the reactions change
by as much, and so does the seat. So both are iterated at any time by itself; the reactions are those of pins held in
their seats. Between the places at which a load jumps, a joint turns round or a pin crosses its hole (`end_loads`) the
offsets are smooth: they are courses, found once. How fast the seats travel, and with them the links, are derivatives of
these.

Held pins take what resists a joint in the sense in which it moves without play. Where the travel of the pins turns that
sense round, for the little while before or after the joint does, no seat agrees with its own friction.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from trunnion.algebra.course import Accuracy, Courses
from trunnion.algebra.dual import Dual, primal, single
from trunnion.algebra.namespace import Number
from trunnion.algebra.nested import each, flat
from trunnion.algebra.panels import FIT, ORDER, POINTS
from trunnion.joints.clearance import pressed, turned_by_friction
from trunnion.solve.backward import Backward, Sense
from trunnion.solve.end_loads import NO_LOAD, EndLoads, end_loads, loads_of, reactions
from trunnion.solve.forward import Travel, posed
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.switches import accuracy_of, breaks_between

if TYPE_CHECKING:
    from trunnion.solve.run import Run

__all__ = ["ROUNDS", "SETTLED", "UNSETTLED", "Halt", "Seated", "Seating", "seating_of"]

ROUNDS = 12  # most of the iteration
EXACT = 1e-12  # change that one more round would make of a seat, of its clearance, at which it has settled
TOLERANCE = 1e-6  # likewise, beyond which it has not, however many the rounds
SETTLED, FLOATING, UNSETTLED, UNKNOWN = range(4)  # states of the courses
RESOLVED = Accuracy(1e-10, 1e-10, shortest=1e-6, rounds=12, most=256)  # second derivatives of offsets lose four digits
IDLE = 1e-3  # of the largest load of the cycle: positions with less are like those without
ASIDE, MOST = 0.5, 3.0  # cosine by which the travel of a pin may turn its load, and how many times it may change it
ROUNDING = 1e-9  # of a load: one that points away from the wall, not along it but for rounding

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Seated:
    """Pins in their seats at some times.

    back: motion and forces, as the pins travel; states: how the seats came to be; sticks: where the travel of the seats
    turns round the sense of a joint; rounds: most that a seat about that time took.
    """

    back: Backward
    states: NDArray[np.intp]
    sticks: NDArray[np.bool_]
    rounds: NDArray[np.intp]

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Where every pin has settled and presses against its wall."""
        return np.asarray((self.states != FLOATING) & (self.states != UNSETTLED))


class Halt(NamedTuple):
    """A time, s, from and to, in which the pin of a joint cannot travel as its seat does: its load does not hold it."""

    joint: str
    low: float
    high: float


@dataclass(frozen=True)
class Seating:
    """The seats of a run over its cycle.

    fixed: offsets that the model states; loads: of pins in the middle; courses: offsets of the pins that loads seat, m,
    by `paths`, then what their travel adds to the twist and to the acceleration of each of `links`; halts: in which
    pins are held; turned: times, s, from and to, in which the travel turns round the sense of a joint, (2, time);
    rounds: most that any seat of a panel took; change: the largest, of its clearance, that one more would make, by
    state.
    """

    run: Run
    method: FrictionMethod
    fixed: dict[str, float]
    loads: EndLoads
    courses: Courses
    paths: Sequence[str]
    links: Sequence[str]
    halts: Sequence[Halt]
    turned: Array
    rounds: NDArray[np.intp]
    change: Array

    @property
    def breaks(self) -> Array:
        """Times, s, at which seats or their rates may jump."""
        halts = [time for halt in self.halts for time in halt[1:]]
        return np.concatenate([self.courses.breaks, halts, self.turned.ravel()])

    @property
    def gaps(self) -> Array:
        """Times, s, from and to, in which a pin does not lie at its wall; (2, gap)."""
        return np.concatenate([self.loads.gaps, np.array([halt[1:] for halt in self.halts], float).reshape(-1, 2).T], 1)

    def at(self, time: Array, method: FrictionMethod | None = None) -> Seated:
        """Motion and forces at times, s, with every pin in its seat; method: that of the seats if not given."""
        time = self._within(time)
        rows, states, still = self._rows(time), self.states(time), self.run.system.algebra.STILL
        added = iter(np.where(states == SETTLED, rows[len(self.paths) :], 0.0))
        travel = {link: _shaped(still, added) for link in self.links}
        back = self.run.at(time, self._placed(rows), method or self.method, travel=travel)
        return Seated(back, states, self.sticks(time), self.rounds[self.courses.panel(time)])

    def sticks(self, time: Array) -> NDArray[np.bool_]:
        """Where the travel of the seats turns round the sense of a joint."""
        time = self._within(time)
        return np.asarray(np.any((self.turned[0] <= time[:, None]) & (time[:, None] < self.turned[1]), axis=1))

    def offsets(self, time: Array) -> dict[str, Array]:
        """Where the pins lie at times, s, m, by the names of `shifts`."""
        return self._placed(self._rows(self._within(time)))

    def _rows(self, time: Array) -> Array:
        return np.nan_to_num(self.courses.at(time))

    def _placed(self, rows: Array) -> dict[str, Array]:
        fixed = {path: np.full(rows.shape[1], number) for path, number in self.fixed.items()}
        return fixed | dict(zip(self.paths, rows, strict=False))

    def states(self, time: Array) -> NDArray[np.intp]:
        """How the seats of times, s, came to be."""
        time = self._within(time)
        states: NDArray[np.intp] = self.courses.states[self.courses.panel(time)]
        for _, low, high in self.halts:
            states[(low <= time) & (time < high) & (states == SETTLED)] = FLOATING
        return states

    def _within(self, time: Array) -> Array:
        """Times of the cycle that stand for any."""
        duration = self.run.cycle.duration
        if duration <= 0:
            return 0.0 * time
        return np.asarray(np.mod(time, duration) if self.run.cycle.periodic else np.clip(time, 0.0, duration))


def seating_of(run: Run, method: FrictionMethod | None = None) -> Seating:
    """The seats of a run, found once; what was asked of the margin of the method is left out."""
    quick = replace(method or FrictionMethod(), margin_up_to=0.0)
    return run.once(("seating", quick), lambda: _seating(run, quick))


@np.errstate(all="ignore")
def _seating(run: Run, method: FrictionMethod) -> Seating:
    settling = _Settling(run, method)
    if settling.paths:
        courses = Courses.of(settling, settling.breaks(), settling.like, accuracy_of(run.cycle, RESOLVED))
    else:
        edges = settling.breaks()[[0, -1]]
        courses = Courses(edges, np.zeros((1, 0, ORDER)), np.zeros(1, np.intp), edges, np.zeros(0), 0)
    rounds, (courses, links, halts, turned) = settling.rounds(courses.edges), settling.travelling(courses)
    return Seating(
        run, method, settling.fixed, settling.loads, courses, settling.paths, links, halts, turned, rounds,
        settling.change,
    )  # fmt: skip


class _Settling:
    """The seats that loads press pins into, at any times: rows of offsets, m."""

    def __init__(self, run: Run, method: FrictionMethod) -> None:
        self.run, self.method, self.loads = run, method, end_loads(run, method)
        self.fixed: dict[str, float] = {}
        for seat in run.seats:
            if seat.given is not None:
                offsets = seat.play.model.paths(f"seats.{seat.joint}", seat.given)
                self.fixed |= {path: single(number) for path, number in offsets.items()}
        self.seats = [seat for seat in run.seats if seat.given is None]
        self.paths = [f"seats.{seat.joint}.{key}" for seat in self.seats for end in seat.play.model.ends for key in end]
        self.change = np.zeros(4)
        # low, high, s, polynomials and most rounds of the panels that settled
        self._panels: list[tuple[float, float, Array, int]] = []

    def breaks(self) -> Array:
        """Both ends of the cycle and what lies between them, s."""
        edges = self.loads.courses.breaks
        jumps = [cross.time for cross in self.loads.crossings if not cross.lasts]
        times = np.concatenate([edges, jumps, self.loads.gaps.ravel()])
        return breaks_between(self.run.cycle, times) if self.run.cycle.duration > 0 else edges

    def like(self, sizes: Array) -> Array:
        """The size of what is like each row: the offsets of the same end."""
        radii = np.zeros(len(sizes))
        for end in self.loads.ends:
            radii[end.rows] = end.radius
        return radii

    # ---- the iteration ----------------------------------------------------------------------------------------

    def __call__(self, time: Array) -> tuple[Array, NDArray[np.integer]]:
        """Offsets, (row, time), and states at the nodes of panels, s."""
        first, last = time[::ORDER], time[ORDER - 1 :: ORDER]
        middle, half = (first + last) / 2, (last - first) / 2 / POINTS[-1]
        panels = list(zip(middle - half, middle + half, np.split(np.arange(len(time)), len(first)), strict=True))
        start = np.zeros((len(self.paths), len(time)))
        for low, high, nodes in panels:  # from the polynomials of the last wider panel that has settled
            slack = 1e-9 * (high - low)
            wider = [panel for panel in self._panels if panel[0] <= low + slack and high - slack <= panel[1]]
            if wider:
                begin, end, polynomials, _ = wider[-1]
                start[:, nodes] = chebyshev.chebval(2 * (time[nodes] - begin) / (end - begin) - 1, polynomials.T)
        offsets, rounds, change, unknown = self._settled(time * (self.run.cycle.duration > 0), start)
        states = np.where(change > TOLERANCE, UNSETTLED, SETTLED)
        for low, high in self.loads.gaps.T:
            states[(time > low) & (time < high)] = FLOATING
        states[unknown] = UNKNOWN
        np.maximum.at(self.change, states, change)
        self._panels += [
            (low, high, offsets[:, nodes] @ FIT.T, int(np.max(rounds[nodes])))
            for low, high, nodes in panels if np.all(states[nodes] <= FLOATING)
        ]  # fmt: skip
        return offsets, states

    def rounds(self, edges: Array) -> NDArray[np.intp]:
        """The most rounds that a seat took between edges, s; of panels that have not settled all there are."""
        rounds = np.full(len(edges) - 1, ROUNDS if self.paths else 0)
        for low, high, _, most in self._panels:  # the last is the narrowest
            rounds[(low <= (edges[1:] + edges[:-1]) / 2) & ((edges[1:] + edges[:-1]) / 2 <= high)] = most
        return rounds

    def _settled(self, time: Array, offsets: Array) -> tuple[Array, NDArray[np.intp], Array, NDArray[np.bool_]]:
        """Offsets, rounds, change that one more would make, and where there are no loads; offsets: to begin with.

        A round gains about as much as the one before it, so what one more would change is known from two. The steps are
        extrapolated from the last two (Anderson's method with one step of memory, D. G. Anderson, J. ACM 12 (1965)
        547-560, doi:10.1145/321296.321305).
        """
        rounds, change, unknown = np.zeros(len(time), np.intp), np.full(len(time), np.inf), np.zeros(len(time), bool)
        left, last, smooth = np.arange(len(time)), np.full(len(time), np.nan), offsets.copy()
        before: tuple[Array, Array] | None = None
        for k in range(1, ROUNDS + 1):
            here = offsets[:, left]
            goal = self._pressed(time[left], here)
            lost = ~np.all(np.isfinite(goal), axis=0)
            goal[:, lost] = 0.0
            now = np.where(lost, 0.0, self._apart(here, goal))
            rounds[left], unknown[left[lost]] = k, True
            change[left] = now * np.fmin(now / last, 1.0)
            if k == 1:
                smooth = goal.copy()  # of loads without play, or those of a wider panel
            done = (change[left] <= EXACT) | lost
            offsets[:, left] = goal if before is None or k == ROUNDS else self._extrapolated(*before, here, goal)
            offsets[:, left[done]] = goal[:, done]
            before, last, left = (here[:, ~done], goal[:, ~done]), now[~done], left[~done]
            if not len(left):
                break
        offsets[:, change > TOLERANCE] = smooth[:, change > TOLERANCE]
        return offsets, rounds, change, unknown

    def _static(self, time: Array, offsets: Array) -> Backward:
        """Motion and forces with the pins held at offsets, in the sense of the motion without play."""
        senses: dict[str, Sense] = {joint: tuple(rows) for joint, rows in self.loads.sensed(time).items()}
        return self.run.at(time, self._placed(offsets), self.method, senses, rests=dict.fromkeys(senses, False))

    def _placed(self, offsets: Array) -> dict[str, Array | float]:
        return {**self.fixed, **dict(zip(self.paths, offsets, strict=True))}

    def _pressed(self, time: Array, offsets: Array) -> Array:
        """Where the loads press the pins that are held at offsets, friction taken into account; NaN without loads."""
        back, senses = self._static(time, offsets), self.loads.sensed(time)
        loads = {seat.joint: loads_of(back, seat) for seat in self.seats}
        size = reactions(back, [part for ends in loads.values() for load in ends for part in load])
        least = NO_LOAD * np.maximum(size, IDLE * self.loads.largest)
        seats = np.zeros_like(offsets) + 0.0 * size
        for end in self.loads.ends:
            joint = end.seat.joint
            load, floor = self.loads.across(end, time, loads[joint][end.number], least)
            if (share := _share(back, joint)) is not None:
                spin = back.walk.hole_spin(joint)  # about one axis with the sense that is taken
                load = turned_by_friction(load, share, (*spin[:-1], senses[joint][0]) if joint in senses else spin)
            seats[end.rows] = pressed(load, end.radius, floor)
        return np.asarray(seats)

    def _apart(self, before: Array, after: Array) -> Array:
        """The largest way of a pin from seat to seat, of the radius of its end."""
        ways = [np.linalg.norm((after - before)[end.rows], axis=0) / end.radius for end in self.loads.ends]
        return np.asarray(functools.reduce(np.maximum, ways, np.zeros(before.shape[1])))

    def _extrapolated(self, before: Array, after: Array, here: Array, goal: Array) -> Array:
        """The seats to which two rounds, before → after and here → goal, lead if the map between is a straight one; as
        far from the middle as the last."""
        step, last = goal - here, after - before
        square = np.sum((step - last) ** 2, axis=0)
        share = np.sum(step * (step - last), axis=0) / np.where(square > 0, square, np.inf)
        ahead = np.asarray(goal - share * (goal - after))
        for end in self.loads.ends:
            size, far = (np.linalg.norm(place[end.rows], axis=0) for place in (ahead, goal))
            ahead[end.rows] *= np.where(size > 0, far / np.where(size > 0, size, 1.0), 0.0)
        return ahead

    # ---- how the links move while the seats travel ------------------------------------------------------------

    def travelling(self, courses: Courses) -> tuple[Courses, list[str], list[Halt], Array]:
        """More rows: what the travel of the offsets adds to twist and acceleration of every link; these links, where
        pins cannot travel so, and where the travel turns round the sense of a joint.

        The twist comes of the poses, which are fed the rates of the offsets as ε parts. What play adds to the twist,
        beside that of pins in the middle, is a course by itself, and its derivative what play adds to the acceleration.
        """
        run, settled = self.run, courses.states == SETTLED
        if not (self.loads.pressed and np.any(settled)):
            return courses, [], [], np.zeros((2, 0))
        time, offsets = courses.nodes(settled), courses.on_nodes(settled)
        rates, back = courses.rates(offsets, settled), self._static(time, offsets)
        static, middle = back.walk.motions, run.walk(time).motions
        places = {path: Dual(*both) for path, *both in zip(self.paths, offsets, rates, strict=True)}
        twists: dict[str, Any] = {}  # of every link by the ε parts of the offsets; poses alone are worked out
        if np.any(rates):
            walk = posed(run.system, {**run.values, **self.fixed, **places}, time=time, assembly=run.chosen.assembly)
            fixed = run.system.mechanism.fixed_link
            twists = {link: walk.frame_rate(motion.frame) for link, motion in walk.motions.items() if link != fixed}
            for number, pose in enumerate(walk.poses):
                twists |= walk.unspun(number, pose, twists)
        travel, more = {}, np.zeros((0, len(time)))
        for link, twist in twists.items():
            rows = [_rows(part, time) for part in (twist, *static[link][1:], *middle[link][1:])]
            added = courses.rates(rows[1] + rows[0] - rows[3], settled) + rows[4] - rows[2]
            both = np.nan_to_num([rows[0], added])
            travel[link] = _shaped(static[link][1:], iter(both.reshape(-1, len(time))))
            more = np.concatenate([more, *both])
        moving = run.at(time, self._placed(offsets), self.method, travel=travel)
        joints = dict.fromkeys(end.seat.joint for end, _ in self.loads.pressed)
        halts = [
            Halt(joint, *times.tolist())
            for joint in joints for times in _below(courses, self._contact(joint, time, offsets, back, moving)).T
        ]  # fmt: skip
        turned = _below(courses, self._senses(time, moving))
        return courses.extended(more, settled), list(travel), halts, turned

    def _contact(self, joint: str, time: Array, offsets: Array, back: Backward, moving: Backward) -> list[Array]:
        """Numbers below 0 where the load of an end of a joint points away from the wall that its pin lies at, or the
        travel turns the load far aside, or outdoes it; back: with pins held."""
        signs = []
        for end, peak in self.loads.pressed:
            if end.seat.joint == joint:
                static, moved = (
                    _rows(tuple(loads_of(walk, end.seat)[end.number]), time) / peak for walk in (back, moving)
                )
                sizes = np.linalg.norm(static, axis=0) * np.linalg.norm(moved, axis=0)
                signs.append(np.sum(static * offsets[end.rows], axis=0) / end.radius)
                signs.append(np.sum(static * moved, axis=0) - ASIDE * sizes)
                signs.append(np.sum(static**2 - ((moved - static) / MOST) ** 2, axis=0))
        return signs

    def _senses(self, time: Array, moving: Backward) -> list[Array]:
        """Numbers below 0 where joints do not move in the sense that is taken."""
        signs = []
        for joint, senses in self.loads.sensed(time).items():
            for sense, number in zip(senses, moving.walk.signed_rates(joint), strict=True):
                rate = np.broadcast_to(number, time.shape) / max(float(np.nanmax(np.abs(number), initial=0.0)), 1e-300)
                signs.append(np.where(sense != 0, rate * sense, -np.abs(rate)))
        return signs


def _below(courses: Courses, signs: Sequence[Array]) -> Array:
    """Times, s, from and to, (2, time), in which one of some numbers at the nodes of settled panels is below 0."""
    if not signs:
        return np.zeros((2, 0))
    marked = courses.extended(np.nan_to_num(signs, nan=1.0), courses.states == SETTLED, elsewhere=1.0)
    return marked.below(range(courses.coefficients.shape[1], marked.coefficients.shape[1]), ROUNDING).T


def _rows(numbers: Any, time: Array) -> Array:
    """The numbers of a tuple at every time, (row, time)."""
    return np.array([np.broadcast_to(primal(number), time.shape) for number in flat(numbers)], float)


def _shaped(like: Any, rows: Iterator[Array]) -> Travel:
    """Rows as the numbers of a twist and an acceleration."""
    return Travel(*each(like, lambda _: next(rows)))


def _share(back: Backward, joint: str) -> Number | None:
    """Friction force about the axis, against the slip, over the normal force at a contact; None without friction.

    Negative where it drives, as bristles do that have not yet bent round after a reversal.

    The coefficient itself: a pair factor stands for a spread contact, whose resultant is turned by atan μ all the
    same.
    """
    if joint not in back.turning:
        return None
    factor = back.walk.values.get(f"joints.{joint}.friction.pair_factor", 1.0)
    slope, slip = back.turning[joint]
    return -primal(slope) * np.sign(primal(slip)) / factor
