"""Where the pins lie in their holes over the cycle: seats that are given, and those that the reactions press them into.

The loads of pins in the middle of their holes, `EndLoads`, say beforehand where a seat has to jump, for it follows them
but for the little that the seats themselves change: where the load of an end jumps across the hole, or falls to what
the play itself changes of it. There the pin crosses its hole, and a massless link stands for it no longer.

A seat and the reactions depend on each other: the seat moves the links by some ρ/l of their size, the reactions change
by as much, and so does the seat. So both are iterated at any time by itself; the reactions are those of pins held in
their seats. Between the places at which a load jumps, a joint turns round or a pin crosses its hole the offsets are
smooth: they are courses, found once. How fast the seats travel, and with them the links, are derivatives of these.

Held pins take what resists a joint in the sense in which it moves without play. Where the travel of the pins turns that
sense round, for the little while before or after the joint does, no seat agrees with its own friction.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.linalg import norm
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from trunnion.algebra.course import Accuracy, Courses
from trunnion.algebra.dual import Dual, primal, single
from trunnion.algebra.namespace import Number, each, flat
from trunnion.algebra.panels import FIT, ON_GRID, ORDER, POINTS
from trunnion.errors import Status
from trunnion.joints.clearance import pressed, turned_by_friction
from trunnion.solve.backward import Backward, Sense, status_of
from trunnion.solve.forward import Travel, posed
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.shifts import GivenSeat
from trunnion.solve.switches import accuracy_of, breaks_between
from trunnion.solve.system import rubbing

if TYPE_CHECKING:
    from trunnion.solve.run import Run

Array = NDArray[np.float64]
NO_LOAD = 1e-9  # of the largest reaction: a load below it is rounding and presses nothing anywhere
JUMP = 0.1  # of the largest load of an end: a jump that passes as near to zero crosses the hole
CROSSING = 5.0  # times play over size, of the reactions: a load that is less changes by the seat nearly as it presses
QUIET = 0.01  # of the largest reaction of the cycle: what counts as one where all are small
WIDEST = 1 / 480  # of the cycle: to either side of a crossing
NOTHING = 1e-7  # of the largest load of an end: zero
STILL = 1e-9  # of the largest rate of a joint: below it, it stands
EDGE = 1e-9  # of a panel: beyond its ends

ROUNDS = 12  # most of the iteration
EXACT = 1e-12  # change that one more round would make of a seat, of its clearance, at which it has settled
TOLERANCE = 1e-6  # likewise, beyond which it has not, however many the rounds
SETTLED, FLOATING, UNSETTLED, UNKNOWN = range(4)  # states of the courses
RESOLVED = Accuracy(1e-10, 1e-10, shortest=1e-6, rounds=12, most=256)  # second derivatives of offsets lose four digits
IDLE = 1e-3  # of the largest load of the cycle: positions with less are like those without
ASIDE, MOST = 0.5, 3.0  # cosine by which the travel of a pin may turn its load, and how many times it may change it
ROUNDING = 1e-9  # of a load: one that points away from the wall, not along it but for rounding


# ---- loads of pins in the middle of their holes -------------------------------------------------------------------


class End(NamedTuple):
    """An end of a joint that its load seats: its number among those of its play, rows of its load, radius, m."""

    seat: GivenSeat
    number: int
    rows: list[int]
    radius: float

    @property
    def place(self) -> int:
        """1, 2, 3 of what is along the axis; 0 of a play with one end."""
        ends = self.seat.play.model.ends
        return int(ends[self.number][0][0]) if len(ends) > 1 else 0


class Crossing(NamedTuple):
    """Where a pin crosses its hole: which end, when, from and to, s, its load there and its largest load, N.

    level: the load at which the crossing begins, N; 0 of a jump. A jump takes no time, and a pin that lies at one of
    two sides changes them in none.
    """

    end: End
    time: float
    low: float
    high: float
    least: float
    peak: float
    level: float

    @property
    def lasts(self) -> bool:
        """Whether the pin is on its way for a time."""
        return self.high > self.low and len(self.end.rows) > 1


@dataclass(frozen=True)
class EndLoads:
    """The loads of a run's ends with every pin in the middle of its hole, over the cycle.

    courses: loads, N, in the frame of each hole; the size of all reactions, N; reaction of every joint, N; rates of the
    joints whose sense of motion decides a load. ends: those that loads seat; total: row of the size; senses: rows of
    the rates; vectors: of every joint, rows of what presses it: its reaction, in space the force on either end.
    """

    run: Run
    courses: Courses
    ends: list[End]
    total: int
    senses: dict[str, slice]
    vectors: list[list[list[int]]]

    @functools.cached_property
    def largest(self) -> float:
        """The largest size of all reactions in the cycle, N."""
        return self.peak([self.total])

    def peak(self, rows: list[int]) -> float:
        """The largest size of a vector of rows."""
        most = self.courses.extreme(lambda all_rows: norm(all_rows[rows], axis=0))
        return 0.0 if most is None else abs(most.value)

    @functools.cached_property
    def pressed(self) -> list[tuple[End, float]]:
        """The ends that anything presses, with their largest load, N."""
        peaks = [(end, self.peak(end.rows)) for end in self.ends]
        return [(end, peak) for end, peak in peaks if peak > NO_LOAD * self.largest]

    @functools.cached_property
    def crossings(self) -> list[Crossing]:
        """Where pins cross their holes, in the order of time; those of each end that touch are one."""
        crossings, joins = list[Crossing](), self.courses.edges[1:]
        for end, peak in self.pressed:
            ends = np.array([self.courses.ends(row) for row in end.rows])
            before, after = ends[:, 0], np.roll(ends[:, 1], -1, axis=1)  # of the last panel that after a period
            step = after - before
            with np.errstate(all="ignore"):
                share = np.clip(-np.sum(before * step, axis=0) / np.sum(step * step, axis=0), 0.0, 1.0)
            least = norm(before + share * step, axis=0)
            over = (np.sum(before * after, axis=0) < 0) & (least <= JUMP * peak)
            over &= np.minimum(norm(before, axis=0), norm(after, axis=0)) > self._level(end, joins)
            over[-1] &= self.run.cycle.periodic
            for time, load in zip(joins[over].tolist(), least[over].tolist(), strict=True):
                crossings.append(Crossing(end, time, time, time, load, peak, 0.0))
            crossings += _merged(list(self._dips(end, peak)))
        return sorted(crossings, key=lambda crossing: crossing.time)

    @functools.cached_property
    def idle(self) -> list[tuple[End, float, float]]:
        """The times, s, from and to, in which nothing presses an end that is pressed elsewhere."""
        times = []
        for end, _ in self.pressed:
            turns = np.flatnonzero(np.diff(self._empty(end), prepend=False, append=False))
            times += [(end, low, high) for low, high in self.courses.edges[turns].reshape(-1, 2).tolist()]
        return times

    def _empty(self, end: End) -> NDArray[np.bool_]:
        """The panels in which nothing presses an end."""
        sizes = np.sum(np.abs(self.courses.coefficients[:, end.rows]), axis=-1)
        return np.asarray(np.max(sizes, axis=-1) <= NO_LOAD * self.largest)

    @functools.cached_property
    def rates(self) -> Courses:
        """The rates of all rows."""
        return self.courses.derivative()

    def sensed(self, time: Array) -> dict[str, Array]:
        """The sense, −1 to 1, of the motion that decides a friction or a load, of every joint, (freedom, time).

        Where a joint turns round that which it takes up.
        """
        courses = self.courses
        after = courses.edges[courses.panel(time)] + courses.half[courses.panel(time)]
        senses = [
            np.where(np.abs(rows) > STILL * courses.sizes[:, None], np.sign(rows), 0.0)
            for rows in (courses.at(time), courses.at(after))
        ]
        return {
            joint: np.where(senses[0][rows] != 0, senses[0][rows], senses[1][rows])
            for joint, rows in self.senses.items()
        }

    def across(self, end: End, time: Array, load: Sequence[Number], least: Array) -> tuple[tuple[Array, ...], Array]:
        """The load that seats an end, N, and the least one that presses it to its wall.

        That of pins in the middle while the pin crosses its hole: it lies as far off the middle as the load is of that
        with which it leaves the wall.
        """
        parts = np.array([np.broadcast_to(primal(part), time.shape) for part in load], float)
        floor = np.broadcast_to(least, time.shape).copy()
        for cross in self.crossings:
            lanes = (time > cross.low) & (time < cross.high)
            if cross.end == end and np.any(lanes):
                parts[:, lanes] = self.courses.at(time[lanes])[end.rows]
                if cross.lasts:
                    floor[lanes] = cross.level
        return tuple(np.asarray(row) for row in parts), np.asarray(floor)

    @functools.cached_property
    def passages(self) -> list[Crossing]:
        """The crossings that are not the begin or end of a time without a load."""
        return [
            cross for cross in self.crossings
            if not any(end == cross.end and low <= cross.high and cross.low <= high for end, low, high in self.idle)
        ]  # fmt: skip

    @functools.cached_property
    def gaps(self) -> Array:
        """Times, s, from and to, in which a pin is on its way across its hole or floats in it; (2, gap)."""
        times = [(cross.low, cross.high) for cross in self.crossings if cross.lasts]
        return np.array([*times, *((low, high) for _, low, high in self.idle)], float).reshape(-1, 2).T

    def _level(self, end: End, time: Array) -> Array:
        """The load of an end, N, that the play itself changes nearly as much as it is."""
        size, play = self.courses.at(time)[self.total], end.seat.play
        length = single(play.length) if play.model.size else 0.0  # over which a moment is a pair of loads
        share = CROSSING * end.radius / max(single(self.run.system.size(self.run.values)), length)
        return np.asarray(share * np.maximum(np.nan_to_num(size), QUIET * self.largest))

    def _dips(self, end: End, peak: float) -> Iterator[Crossing]:
        """Where a load falls to zero within what the play changes of it, and rises again."""
        courses = self.courses
        shallow = np.min(norm(courses.coefficients[:, end.rows] @ ON_GRID, axis=1), axis=1) <= 2 * JUMP * peak
        for k in np.flatnonzero(shallow & ~self._empty(end)):
            spots, loads, rates = _least(courses.coefficients[k, end.rows])
            times = courses.edges[k] + courses.half[k] * (spots + 1.0)
            level = self._level(end, np.clip(times, courses.edges[k], courses.edges[k + 1] * (1 - 1e-15)))
            for time, load, rate, most in zip(
                times, norm(loads, axis=0), norm(rates, axis=0) / courses.half[k], level, strict=True
            ):
                if load < most and (len(loads) > 1 or load <= NOTHING * peak):
                    reach = min(np.sqrt(most**2 - load**2) / max(rate, 1e-300), WIDEST * courses.span)
                    low, high = np.clip([time - reach, time + reach], courses.edges[0], courses.edges[-1])
                    yield Crossing(end, float(time), float(low), float(high), float(load), peak, float(most))


def _merged(crossings: list[Crossing]) -> list[Crossing]:
    """Those that touch as one, of the least load of them."""
    merged: list[Crossing] = []
    for crossing in sorted(crossings, key=lambda crossing: crossing.low):
        if merged and crossing.low <= merged[-1].high:
            last = merged.pop()
            least = min(last, crossing, key=lambda crossing: crossing.least)
            crossing = least._replace(low=last.low, high=max(last.high, crossing.high))
        merged.append(crossing)
    return merged


def _least(coefficients: Array) -> tuple[Array, Array, Array]:
    """Places of a panel at which a vector, (component, coefficient), is least, inside or at an end of the panel; the
    vector there, and its derivative by the place."""
    slope = functools.reduce(
        chebyshev.chebadd, (chebyshev.chebmul(part, chebyshev.chebder(part)) for part in coefficients)
    )
    roots = chebyshev.chebroots(chebyshev.chebtrim(slope, 1e-14 * np.max(np.abs(slope))))
    real = np.real(roots[(np.abs(np.imag(roots)) <= 1e-4) & (np.abs(np.real(roots)) <= 1.0 + EDGE)])
    spots = np.unique(np.clip(np.concatenate([real, [-1.0, 1.0]]), -1.0, 1.0))
    bends = chebyshev.chebval(spots, chebyshev.chebder(slope)) if len(slope) > 1 else np.zeros(len(spots))
    spots = spots[(bends > 0) | (np.abs(spots) == 1.0)]
    values, slopes = (chebyshev.chebval(spots, part) for part in (coefficients.T, chebyshev.chebder(coefficients.T)))
    return spots, np.asarray(values), np.asarray(slopes)


def loads_of(back: Backward, seat: GivenSeat) -> list[tuple[Number, ...]]:
    """Load of the pin on each end of its hole, N, in the hole's frame."""
    force, moment = back.walk.in_hole(seat.joint, back.reactions[seat.joint])
    return seat.play.model.loads(force, moment, seat.play.length)


def reactions(back: Backward, loads: Sequence[Number]) -> Number:
    """Size of all reaction forces and loads of ends together, N."""
    count = back.walk.system.mechanism.coordinates
    forces = (part for reaction in back.reactions.values() for part in tuple(flat(tuple(reaction)))[:count])
    return np.sqrt(functools.reduce(operator.add, (primal(part) ** 2 for part in (*loads, *forces)), 0.0))


def end_loads(run: Run, method: FrictionMethod) -> EndLoads:
    """The loads of the ends of all joints that their loads seat."""
    seats, joints = sorted(run.seats, key=lambda seat: seat.given is not None), list[str]()
    system, count = run.system, run.system.mechanism.coordinates
    for joint in dict.fromkeys([*rubbing(system), *system.resisted]):  # each contact of them is that of one freedom
        pair, summed = system.joints[joint].pair, system.summed(joint) and joint not in system.resisted
        if pair.one_axis and (len(pair.freedoms) == 1 or summed):
            joints.append(joint)
    ends, first = [], 0
    for seat in seats:
        for number, (end, radius) in enumerate(zip(seat.play.model.ends, seat.play.radii, strict=True)):
            ends.append(End(seat, number, list(range(first, first + len(end))), single(radius)))
            first += len(end)
    rates = first + 1 + count * len(system.joints)
    senses, last = {}, rates
    for joint in joints:
        senses[joint] = slice(last, last := last + len(system.joints[joint].pair.freedoms))
    vectors = [[[first + 1 + count * i + k for k in range(count)]] for i in range(len(system.joints))]
    if system.mechanism.space == "spatial":
        sides = [[(end.seat.play.model.ends[end.number][0][0], end) for end in ends if end.seat.joint == joint]
                 for joint in system.joints]  # fmt: skip
        both = ([[row for at, end in of for row in end.rows if at == side] for side in "12"] for of in sides)
        vectors = [[rows for rows in pair if rows] for pair in both]  # of the force on either end, across the axis

    def look(time: Array) -> tuple[Array, NDArray[np.integer]]:
        back = run.solve(time, method=method)
        numbers = [part for seat in seats for load in loads_of(back, seat) for part in load]
        numbers += [reactions(back, numbers)]
        numbers += [part for joint in system.joints for part in tuple(flat(tuple(back.reactions[joint])))[:count]]
        numbers += [rate for joint in joints for rate in back.walk.signed_rates(joint)]
        rows = np.array([np.broadcast_to(np.asarray(primal(number), float), time.shape) for number in numbers])
        return rows, (status_of(back, time.shape) >= Status.NOT_CONVERGED).astype(np.intp)

    def like(sizes: Array) -> Array:
        return np.concatenate([np.full(rates, np.max(sizes[:rates])), sizes[rates:]])

    courses = run.courses(look, None, Accuracy(shortest=1e-7), like)
    return EndLoads(
        run, courses, [end for end in ends if end.radius > 0 and end.seat.given is None], first, senses, vectors
    )


# ---- seats --------------------------------------------------------------------------------------------------------


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


class Seating:
    """The seats of a run over its cycle.

    fixed: offsets that the model states; loads: of pins in the middle; courses: offsets of the pins that loads seat, m,
    by `paths`, then what their travel adds to the twist and to the acceleration of each of `links`; halts: in which
    pins are held; turned: times, s, from and to, in which the travel turns round the sense of a joint, (2, time);
    rounds: most that any seat of a panel took; change: the largest, of its clearance, that one more would make, by
    state.
    """

    def __init__(self, run: Run, method: FrictionMethod) -> None:
        self.run, self.method, self.loads = run, method, end_loads(run, method)
        self.fixed: dict[str, float] = {}
        for seat in run.seats:
            if seat.given is not None:
                offsets = seat.play.model.paths(f"seats.{seat.joint}", seat.given)
                self.fixed |= {path: single(number) for path, number in offsets.items()}
        self._seats = [seat for seat in run.seats if seat.given is None]
        keys = ((seat.joint, key) for seat in self._seats for end in seat.play.model.ends for key in end)
        self.paths = [f"seats.{joint}.{key}" for joint, key in keys]
        self.change = np.zeros(4)
        # low, high, s, polynomials and most rounds of the panels that settled
        self._panels: list[tuple[float, float, Array, int]] = []
        breaks = self.loads.courses.breaks
        if run.cycle.duration > 0:
            jumps = [cross.time for cross in self.loads.crossings if not cross.lasts]
            breaks = breaks_between(run.cycle, np.concatenate([breaks, jumps, self.loads.gaps.ravel()]))

        def like(sizes: Array) -> Array:
            """The size of what is like each row: the offsets of the same end."""
            radii = np.zeros(len(sizes))
            for end in self.loads.ends:
                radii[end.rows] = end.radius
            return radii

        if self.paths:
            self.courses = Courses.of(self._settled, breaks, like, accuracy_of(run.cycle, RESOLVED))
        else:
            edges = breaks[[0, -1]]
            self.courses = Courses(edges, np.zeros((1, 0, ORDER)), np.zeros(1, np.intp), edges, np.zeros(0), 0)
        low, high = self.courses.edges[:-1], self.courses.edges[1:]
        self.rounds = np.full(len(low), ROUNDS if self.paths else 0)  # all there are of panels that have not settled
        for first, last, _, most in self._panels:  # the last is the narrowest
            self.rounds[(first <= (high + low) / 2) & ((high + low) / 2 <= last)] = most
        self.links, self.halts, self.turned = list[str](), list[Halt](), np.zeros((2, 0))
        if self.loads.pressed and np.any(self.courses.states == SETTLED):
            self._travel()

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
        rows, states, still = np.nan_to_num(self.courses.at(time)), self.states(time), self.run.system.algebra.STILL
        added = iter(np.where(states == SETTLED, rows[len(self.paths) :], 0.0))
        travel = {link: Travel(*each(still, lambda _: next(added))) for link in self.links}
        back = self.run.at(time, self._placed(rows), method or self.method, travel=travel)
        return Seated(back, states, self.sticks(time), self.rounds[self.courses.panel(time)])

    def sticks(self, time: Array) -> NDArray[np.bool_]:
        """Where the travel of the seats turns round the sense of a joint."""
        time = self._within(time)
        return np.asarray(np.any((self.turned[0] <= time[:, None]) & (time[:, None] < self.turned[1]), axis=1))

    def offsets(self, time: Array) -> dict[str, Array]:
        """Where the pins lie at times, s, m, by the names of `shifts`."""
        return self._placed(np.nan_to_num(self.courses.at(self._within(time))))

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

    # ---- the iteration ----------------------------------------------------------------------------------------

    def _settled(self, time: Array) -> tuple[Array, NDArray[np.integer]]:
        """Offsets, (row, time), and states at the nodes of panels, s.

        A round gains about as much as the one before it, so what one more would change is known from two. The steps are
        extrapolated from the last two.
        """
        first, last = time[::ORDER], time[ORDER - 1 :: ORDER]
        middle, half = (first + last) / 2, (last - first) / 2 / POINTS[-1]
        panels = list(zip(middle - half, middle + half, np.split(np.arange(len(time)), len(first)), strict=True))
        offsets = np.zeros((len(self.paths), len(time)))
        for low, high, nodes in panels:  # from the polynomials of the last wider panel that has settled
            slack = 1e-9 * (high - low)
            wider = [panel for panel in self._panels if panel[0] <= low + slack and high - slack <= panel[1]]
            if wider:
                begin, end, polynomials, _ = wider[-1]
                offsets[:, nodes] = chebyshev.chebval(2 * (time[nodes] - begin) / (end - begin) - 1, polynomials.T)
        moment, left, smooth = time * (self.run.cycle.duration > 0), np.arange(len(time)), offsets.copy()
        rounds, change, unknown = np.zeros(len(time), np.intp), np.full(len(time), np.inf), np.zeros(len(time), bool)
        before, moved_by = None, np.full(len(time), np.nan)
        for k in range(1, ROUNDS + 1):
            here = offsets[:, left]
            goal = self._pressed(moment[left], here)
            lost = ~np.all(np.isfinite(goal), axis=0)
            goal[:, lost] = 0.0
            # the largest way of a pin from seat to seat, of the radius of its end
            ways = [norm((goal - here)[end.rows], axis=0) / end.radius for end in self.loads.ends]
            now = np.where(lost, 0.0, np.max(ways, axis=0, initial=0.0))
            rounds[left], unknown[left[lost]] = k, True
            change[left] = now * np.fmin(now / moved_by, 1.0)
            if k == 1:
                smooth = goal.copy()  # of loads without play, or those of a wider panel
            done = (change[left] <= EXACT) | lost
            offsets[:, left] = goal if before is None or k == ROUNDS else self._extrapolated(*before, here, goal)
            offsets[:, left[done]] = goal[:, done]
            before, moved_by, left = (here[:, ~done], goal[:, ~done]), now[~done], left[~done]
            if not len(left):
                break
        offsets[:, change > TOLERANCE] = smooth[:, change > TOLERANCE]
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

    def _static(self, time: Array, offsets: Array) -> Backward:
        """Motion and forces with the pins held at offsets, in the sense of the motion without play."""
        senses: dict[str, Sense] = {joint: tuple(rows) for joint, rows in self.loads.sensed(time).items()}
        return self.run.at(time, self._placed(offsets), self.method, senses, rests=dict.fromkeys(senses, False))

    def _pressed(self, time: Array, offsets: Array) -> Array:
        """Where the loads press the pins that are held at offsets, friction taken into account; NaN without loads."""
        back, senses = self._static(time, offsets), self.loads.sensed(time)
        loads = {seat.joint: loads_of(back, seat) for seat in self._seats}
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

    def _extrapolated(self, before: Array, after: Array, here: Array, goal: Array) -> Array:
        """The seats to which two rounds, before → after and here → goal, lead if the map between is a straight one; as
        far from the middle as the last.

        Anderson's method with one step of memory, D. G. Anderson, J. ACM 12 (1965) 547-560, doi:10.1145/321296.321305.
        """
        step, last = goal - here, after - before
        square = np.sum((step - last) ** 2, axis=0)
        share = np.sum(step * (step - last), axis=0) / np.where(square > 0, square, np.inf)
        ahead = np.asarray(goal - share * (goal - after))
        for end in self.loads.ends:
            size, far = (np.linalg.norm(place[end.rows], axis=0) for place in (ahead, goal))
            ahead[end.rows] *= np.where(size > 0, far / np.where(size > 0, size, 1.0), 0.0)
        return ahead

    # ---- how the links move while the seats travel ------------------------------------------------------------

    def _travel(self) -> None:
        """Add to the courses what the travel of the offsets adds to twist and acceleration of every link; find where
        pins cannot travel so, and where the travel turns round the sense of a joint.

        The twist comes of the poses, which are fed the rates of the offsets as ε parts. What play adds to the twist,
        beside that of pins in the middle, is a course by itself, and its derivative what play adds to the acceleration.
        """
        run, courses, settled = self.run, self.courses, self.courses.states == SETTLED
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
            numbers = iter(both.reshape(-1, len(time)))
            travel[link] = Travel(*each(static[link][1:], functools.partial(lambda left, _: next(left), numbers)))
            more = np.concatenate([more, *both])
        moving = run.at(time, self._placed(offsets), self.method, travel=travel)
        signs: dict[str, list[Array]] = {}
        for end, peak in self.loads.pressed:  # below 0 where the load of an end points away from the wall that its pin
            held, moved = (  # lies at, or the travel turns the load far aside, or outdoes it
                _rows(tuple(loads_of(walk, end.seat)[end.number]), time) / peak for walk in (back, moving)
            )
            sizes = norm(held, axis=0) * norm(moved, axis=0)
            signs.setdefault(end.seat.joint, []).extend([
                np.sum(held * offsets[end.rows], axis=0) / end.radius,
                np.sum(held * moved, axis=0) - ASIDE * sizes,
                np.sum(held**2 - ((moved - held) / MOST) ** 2, axis=0),
            ])  # fmt: skip
        self.halts = [Halt(joint, *times) for joint, of in signs.items() for times in _below(courses, of).T.tolist()]
        senses = []  # below 0 where joints do not move in the sense that is taken
        for joint, taken_senses in self.loads.sensed(time).items():
            for sense, number in zip(taken_senses, moving.walk.signed_rates(joint), strict=True):
                rate = np.broadcast_to(number, time.shape) / max(float(np.nanmax(np.abs(number), initial=0.0)), 1e-300)
                senses.append(np.where(sense != 0, rate * sense, -np.abs(rate)))
        self.turned = _below(courses, senses)
        self.courses, self.links = courses.extended(more, settled), list(travel)


@np.errstate(all="ignore")
def seating_of(run: Run, method: FrictionMethod | None = None) -> Seating:
    """The seats of a run, found once; what was asked of the margin of the method is left out."""
    quick = replace(method or FrictionMethod(), margin_up_to=0.0)
    return run.once(("seating", quick), lambda: Seating(run, quick))


def _below(courses: Courses, signs: Sequence[Array]) -> Array:
    """Times, s, from and to, (2, time), in which one of some numbers at the nodes of settled panels is below 0."""
    if not signs:
        return np.zeros((2, 0))
    marked = courses.extended(np.nan_to_num(signs, nan=1.0), courses.states == SETTLED, elsewhere=1.0)
    return marked.below(range(courses.coefficients.shape[1], marked.coefficients.shape[1]), ROUNDING).T


def _rows(numbers: Any, time: Array) -> Array:
    """The numbers of a tuple at every time, (row, time)."""
    return np.array([np.broadcast_to(primal(number), time.shape) for number in flat(numbers)], float)


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
