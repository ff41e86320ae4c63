"""Loads of the ends of pins in the middle of their holes, as courses: where they press, and where contact is lost.

The seats follow these loads but for the little that the seats themselves change. So they say beforehand where a seat
has to jump: where the load of an end jumps across the hole, or falls to what the play itself changes of it. There the
pin crosses its hole, and a massless link stands for it no longer.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from trunnion.algebra.course import Accuracy, Courses
from trunnion.algebra.dual import primal, single
from trunnion.algebra.namespace import Number
from trunnion.algebra.nested import flat
from trunnion.algebra.panels import ON_GRID
from trunnion.errors import Status
from trunnion.joints.pairs import PAIRS
from trunnion.solve.backward import Backward, status_of
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.shifts import GivenSeat
from trunnion.solve.system import rubbing

if TYPE_CHECKING:
    from trunnion.solve.run import Run

__all__ = ["NO_LOAD", "Crossing", "End", "EndLoads", "end_loads", "loads_of", "reactions"]

Array = NDArray[np.float64]
NO_LOAD = 1e-9  # of the largest reaction: a load below it is rounding and presses nothing anywhere
JUMP = 0.1  # of the largest load of an end: a jump that passes as near to zero crosses the hole
CROSSING = 5.0  # times play over size, of the reactions: a load that is less changes by the seat nearly as it presses
QUIET = 0.01  # of the largest reaction of the cycle: what counts as one where all are small
WIDEST = 1 / 480  # of the cycle: to either side of a crossing
ROUNDING = 1e-7  # of the largest load of an end: zero
STILL = 1e-9  # of the largest rate of a joint: below it, it stands
EDGE = 1e-9  # of a panel: beyond its ends


class End(NamedTuple):
    """An end of a joint that its load seats: its number among those of its play, rows of its load, radius, m."""

    seat: GivenSeat
    number: int
    rows: list[int]
    radius: float

    @property
    def spread(self) -> bool:
        """Whether its play has ends at a distance, over which a moment is a pair of loads."""
        return self.seat.play.model.size is not None

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
        most = self.courses.extreme(lambda all_rows: _size(all_rows[rows]))
        return 0.0 if most is None else abs(most.value)

    @functools.cached_property
    def pressed(self) -> list[tuple[End, float]]:
        """The ends that anything presses, with their largest load, N."""
        peaks = [(end, self.peak(end.rows)) for end in self.ends]
        return [(end, peak) for end, peak in peaks if peak > NO_LOAD * self.largest]

    @functools.cached_property
    def crossings(self) -> list[Crossing]:
        """Where pins cross their holes, in the order of time; those of each end that touch are one."""
        crossings = []
        for end, peak in self.pressed:
            crossings += [*self._jumps(end, peak), *_merged(list(self._dips(end, peak)))]
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

    def _jumps(self, end: End, peak: float) -> Iterator[Crossing]:
        """Where a load jumps to the other side of the hole."""
        ends = np.array([self.courses.ends(row) for row in end.rows])
        before, after = ends[:, 0], np.roll(ends[:, 1], -1, axis=1)  # of the last panel that after a period
        step = after - before
        with np.errstate(all="ignore"):
            share = np.clip(-np.sum(before * step, axis=0) / np.sum(step * step, axis=0), 0.0, 1.0)
        least = _size(before + share * step)
        over = (np.sum(before * after, axis=0) < 0) & (least <= JUMP * peak)
        over &= np.minimum(_size(before), _size(after)) > self._level(end, self.courses.edges[1:])
        over[-1] &= self.run.cycle.periodic
        for k in np.flatnonzero(over):
            time = float(self.courses.edges[k + 1])
            yield Crossing(end, time, time, time, float(least[k]), peak, 0.0)

    def _level(self, end: End, time: Array) -> Array:
        """The load of an end, N, that the play itself changes nearly as much as it is."""
        size = self.courses.at(time)[self.total]
        play = end.radius / max(
            single(self.run.system.size(self.run.values)), single(end.seat.play.length) * end.spread
        )
        return np.asarray(CROSSING * play * np.maximum(np.nan_to_num(size), QUIET * self.largest))

    def _dips(self, end: End, peak: float) -> Iterator[Crossing]:
        """Where a load falls to zero within what the play changes of it, and rises again."""
        courses = self.courses
        shallow = np.min(_size(courses.coefficients[:, end.rows] @ ON_GRID, axis=1), axis=1) <= 2 * JUMP * peak
        for k in np.flatnonzero(shallow & ~self._empty(end)):
            spots, loads, rates = _least(courses.coefficients[k, end.rows])
            times = courses.edges[k] + courses.half[k] * (spots + 1.0)
            level = self._level(end, np.clip(times, courses.edges[k], courses.edges[k + 1] * (1 - 1e-15)))
            for time, load, rate, most in zip(times, _size(loads), _size(rates) / courses.half[k], level, strict=True):
                if load < most and (len(loads) > 1 or load <= ROUNDING * peak):
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


def _size(vector: Array, axis: int = 0) -> Array:
    return np.asarray(np.sqrt(np.sum(vector * vector, axis=axis)))


def loads_of(back: Backward, seat: GivenSeat) -> list[tuple[Number, ...]]:
    """Load of the pin on each end of its hole, N, in the hole's frame."""
    force, moment = back.on_hole(seat.joint)
    return seat.play.model.loads(force, moment, seat.play.length)


def reactions(back: Backward, loads: Sequence[Number]) -> Number:
    """Size of all reaction forces and loads of ends together, N."""
    count = back.walk.system.mechanism.coordinates
    forces = (part for reaction in back.reactions.values() for part in tuple(flat(tuple(reaction)))[:count])
    return np.sqrt(functools.reduce(operator.add, (primal(part) ** 2 for part in (*loads, *forces)), 0.0))


def end_loads(run: Run, method: FrictionMethod) -> EndLoads:
    """The loads of the ends of all joints that their loads seat, found once."""
    return run.once(("end loads", method), lambda: _end_loads(run, method))


def _end_loads(run: Run, method: FrictionMethod) -> EndLoads:
    seats, joints = sorted(run.seats, key=lambda seat: seat.given is not None), list[str]()
    system, count = run.system, run.system.mechanism.coordinates
    for joint in dict.fromkeys([*rubbing(system), *system.resisted]):  # each contact of them is that of one freedom
        pair, summed = PAIRS[system.joints[joint][0]], system.summed(joint) and joint not in system.resisted
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
        senses[joint] = slice(last, last := last + len(PAIRS[system.joints[joint][0]].freedoms))
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
