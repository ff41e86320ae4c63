"""Where forces and powers jump or bend along a cycle, as the model says it: between these places they are smooth.

Loads jump at the ends of a `between` and bend at the points of a table or where a `max` goes over to its other side;
friction and what resists a joint turn round where its relative speed does; a spring that only pulls lets go at its free
length; motion laws go from one function to the next. A number of the motion belongs to each of these, which passes a
level there. They are looked for on a scan of the cycle - also where such a number only dips through its level between
two places of it - and located to rounding. What no model states, such as a guide that tilts over, is not looked for.

[C] T. R. Chandrupatla, Adv. Eng. Softw. 28 (1997) 145-149, doi:10.1016/S0965-9978(96)00051-8.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Accuracy, Courses
from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number
from trunnion.model.parts import Spring
from trunnion.solve import loads
from trunnion.solve.forward import Assembly, Forward, forward
from trunnion.solve.loads import Stated, Switch, placed, stated_walk
from trunnion.solve.system import Cycle, System, Values, rubbing

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

SCANNED = 180  # places of a turn at which the motion is looked at; what the model states of it takes less
STATED_SCANNED = 1440
MOST_SCANNED = 20_000
MOST_LEVELS = 720  # of one table in a turn: of more points every n-th, so that no node of a panel is far from any
PANELS = 6  # of a turn: the widest that is integrated in one go
MOST_EDGES = 2000  # of a cycle of very many turns: the error of its means is told
TRACKED = 72  # of a turn: how far to either side a bend of one mechanism is looked for in others
SEATED = Accuracy(1e-7, 1e-9, shortest=1e-7, rounds=16)  # what the travel of seats adds is known to so many digits
MARGINS = Accuracy(1e-4, 1e-6, shortest=1e-5, rounds=8)  # a margin is followed, which takes long
SETTLED = 1e-11  # of the cycle
SLOPED = 1e-6  # of the cycle: step of a difference
CLOSE = 1e-10  # of the cycle: edges that are one
NOISE = 1e-9  # of the largest value: zero but for rounding
ROOT_ROUNDS = 60
TURN = 2 * np.pi
TURNING = Accuracy(1e-4, 1e-6, shortest=1e-6)  # of the rates, whose integrals tell whole turns


@dataclass(frozen=True)
class Mechanisms:
    """One mechanism, or many that differ in numbers alone: their values, (mechanism, 1) where they vary, and cycles."""

    system: System
    assembly: Assembly
    values: Values
    cycles: Sequence[Cycle]

    def picked(self, rows: Rows) -> Values:
        """The values of some of them, one for each lane."""
        if len(self.cycles) == 1:
            return self.values
        return {path: value[rows] if np.ndim(primal(value)) == 2 else value for path, value in self.values.items()}

    def lanes(self, time: Array) -> Array:
        """Times, (lane, place), as a walk takes them: those of one mechanism in a row."""
        return time.ravel() if len(self.cycles) == 1 else time

    def shaped(self, number: Number, time: Array) -> Array:
        """A number that a walk at `lanes` has, (lane, place)."""
        shape = (1, time.size) if len(self.cycles) == 1 else time.shape
        reshaped: Array = np.broadcast_to(np.asarray(primal(number), float), shape).reshape(time.shape)
        return reshaped

    def row(self, number: Number) -> Array:
        """A number that does not change along the way, (mechanism,)."""
        return np.broadcast_to(np.asarray(primal(number), float), (len(self.cycles), 1))[:, 0]


class Bend(NamedTuple):
    """A time, s, at which forces may jump or bend; by which scan, which function of it passes which level there.

    scan: -1 where the model states the time itself.
    """

    time: float
    scan: int = -1
    function: int = 0
    level: float = 0.0


class _Scan(NamedTuple):
    """Numbers of a walk that pass levels: what is read of it, and at how many places of a turn it is looked at."""

    walk: Callable[[System, Values, Assembly, Number], Forward]
    look: Callable[[Forward], Iterator[Switch]]
    places: int
    noise: float

    def switches(self, of: Mechanisms, rows: Rows, times: Array) -> list[Switch]:
        """The switches of some mechanisms, a lane each, at times, (lane, place), s."""
        return list(self.look(self.walk(of.system, of.picked(rows), of.assembly, of.lanes(times))))

    def number(self, of: Mechanisms, rows: Rows, function: Rows, time: Array) -> Array:
        """The number of one switch of each of some mechanisms at one time, s; (lane,)."""
        numbers = [of.shaped(switch.number, time[:, None]) for switch in self.switches(of, rows, time[:, None])]
        return np.asarray(np.array(numbers)[function, np.arange(len(rows)), 0])


def _scans(system: System) -> list[_Scan]:
    """One of the numbers that the model states by the motion, one of the motion itself, as far as there are such."""
    scans, springs = [], system.mechanism.springs.values()
    if any(entry.varies for entry in system.mechanism.parameter_set.entries.values()):
        quiet = NOISE if placed(system.mechanism) else 0.0
        scans.append(_Scan(stated_walk, lambda walk: Stated(walk).switches(), STATED_SCANNED, quiet))
    if _followed(system) or any(_lets_go(system, spring) for spring in springs):
        scans.append(_Scan(forward, _of_motion, SCANNED, NOISE))
    return scans


def bends(of: Mechanisms) -> list[list[Bend]]:
    """Where the forces of every mechanism may jump or bend, in no order; those of one can be `tracked` in others."""
    of_each: list[list[Bend]] = [[] for _ in of.cycles]
    for row, moment in knots_of(of):
        of_each[row].append(Bend(moment))
    duration = np.array([cycle.duration for cycle in of.cycles])
    turns = max(1.0, np.ceil(max(cycle.turns for cycle in of.cycles) - 1e-9))
    for number, scan in enumerate(_scans(of.system)):
        time = duration[:, None] * np.linspace(0.0, 1.0, int(min(scan.places * turns, MOST_SCANNED)) + 1)
        switches = scan.switches(of, np.arange(len(duration)), time)
        if not switches:
            continue
        courses = np.array([of.shaped(switch.number, time) for switch in switches])
        noise = scan.noise * np.nanmax(np.abs(np.nan_to_num(courses)), axis=-1, keepdims=True)
        courses = np.where(np.abs(courses) <= noise, 0.0, courses)
        single = np.array([len(switch.levels) == 1 for switch in switches])
        crossings = [_dips(single, courses, time, partial(scan.number, of))]
        for k, (switch, course) in enumerate(zip(switches, courses, strict=True)):
            crossings += [_passed(k, course, level, time) for level in _levels(of, switch, course, turns)]
        every = _Crossing(*(np.concatenate(parts) for parts in zip(*crossings, strict=True)))
        if len(every.row):
            times = _located(every, partial(scan.number, of, every.row, every.function), duration[every.row])
            for row, moment, function, level in zip(every.row, times, every.function, every.level, strict=True):
                of_each[row].append(Bend(float(moment), number, int(function), float(level)))
    return of_each


def tracked(of: Mechanisms, bends: Sequence[Bend], moved: Callable[[Values, Array], Number]) -> Array:
    """Times, s, (mechanism, bend), at which other mechanisms have the bends of one; NaN where it is not near the same.

    They are times of the one, `moved` to those of the others by their values; cycles: that of the one, for each.
    """
    cycle, tracks = of.cycles[0], np.tile([bend.time for bend in bends], (len(of.cycles), 1))
    levels, most = np.array([bend.level for bend in bends]), cycle.duration / (TRACKED * max(1.0, cycle.turns))
    like = [[other for other in bends if other[1:3] == bend[1:3] and other is not bend] for bend in bends]
    # to either side of each, and not beyond the next one of its kind
    widths = [min([most, *(abs(of.time - b.time) / 2 for of in near)]) for b, near in zip(bends, like, strict=True)]
    for scan, rows, function, which in _by_scan(of, bends):
        number = partial(_moved, of, scan, moved, rows, function)
        low, high = (tracks[rows, which] + side * np.array(widths)[which] for side in (-1.0, 1.0))
        crossing = _Crossing(rows, function, levels[which], low, high, number(low), number(high))
        passed = (crossing.at_low >= crossing.level) != (crossing.at_high >= crossing.level)
        times = _located(crossing, number, np.full(len(rows), cycle.duration))
        tracks[rows, which] = np.where(passed, times, np.nan)
    return tracks


def shifts_of(
    of: Mechanisms,
    bends: Sequence[Bend],
    times: Array,
    moved: Callable[[Values, Array], Number],
    sides: tuple[Values, Values],
) -> Array:
    """How far times of bends that were `tracked`, (mechanism, bend), go from one side of the values to the other.

    What passes its level there goes on to do so: to first order δt = −δg/(∂g/∂t), g being its number.
    """
    shifts, step = np.zeros(times.shape), SLOPED * of.cycles[0].duration
    for scan, rows, function, which in _by_scan(of, bends):
        time = times[rows, which]
        below, here, above = (
            partial(_moved, replace(of, values=numbers), scan, moved, rows, function)
            for numbers in (sides[0], of.values, sides[1])
        )
        # on both sides in time too, as what is noise beside its own size counts as zero
        change = [above(moment) - below(moment) for moment in (time - step, time + step)]
        rate = (here(time + step) - here(time - step)) / (2 * step)
        shifts[rows, which] = -(change[0] + change[1]) / 2 / rate
    return shifts


def _by_scan(of: Mechanisms, bends: Sequence[Bend]) -> Iterator[tuple[_Scan, Rows, Rows, Rows]]:
    """Of every scan the mechanisms, lane by lane, and the functions and numbers of its bends among those known."""
    functions = np.array([bend.function for bend in bends])
    for k, scan in enumerate(_scans(of.system)):
        bends_own = np.flatnonzero([bend.scan == k for bend in bends])
        which = np.tile(bends_own, len(of.cycles))
        if len(bends_own):
            yield scan, np.repeat(np.arange(len(of.cycles)), len(bends_own)), functions[which], which


def _moved(
    of: Mechanisms, scan: _Scan, moved: Callable[[Values, Array], Number], rows: Rows, function: Rows, time: Array
) -> Array:
    """Numbers of a scan at times of the cycle of one mechanism that are moved to those of each."""
    cycle = of.cycles[0]
    time = time % cycle.duration if cycle.periodic else np.clip(time, 0.0, cycle.duration)
    return scan.number(of, rows, function, np.asarray(primal(moved(of.picked(rows), time[:, None])), float)[:, 0])


def breaks_between(cycle: Cycle, times: Array, start: float = 0.0, end: float | None = None) -> Array:
    """Two times of a cycle, s, its own ends if not given, and the bends between them, those that are one taken once.

    end: may be beyond that of a cycle that comes again.
    """
    duration, end = cycle.duration, cycle.duration if end is None else end
    laps = np.arange(start // duration, end // duration + 1) if cycle.periodic else np.zeros(1)
    again = (times[:, None] + laps * duration).ravel()
    inner = np.unique(np.concatenate([again, duration * laps if end > duration else []]))
    inner = inner[(inner > start + CLOSE * duration) & (inner < end - CLOSE * duration)]
    inner = inner[np.append(np.diff(inner) > CLOSE * duration, True)] if len(inner) else inner
    return np.concatenate([[start], inner, [end]])


def accuracy_of(cycle: Cycle, accuracy: Accuracy) -> Accuracy:
    """The same with panels no wider than a part of a turn."""
    turns = max(1.0, np.ceil(cycle.turns - 1e-9))
    return accuracy._replace(widest=1.0 / min(PANELS * turns, MOST_EDGES))


def knots_of(of: Mechanisms) -> Iterator[tuple[int, float]]:
    """Times at which a motion law goes from one function to the next."""
    for name in of.system.mechanism.drivers:
        knots, span = of.system.knots(of.values, name), of.system.span(of.values, name)
        if not knots:
            continue
        each, periods = np.array([of.row(knot) for knot in knots]).T, of.row(span.duration)
        for row, (times, period, cycle) in enumerate(zip(each, periods, of.cycles, strict=True)):
            most = max(1.0, MOST_EDGES / len(times))
            laps = np.arange(min(np.ceil(cycle.duration / period), most)) if span.periodic else np.zeros(1)
            again = np.mod(times, period) if span.periodic else times
            yield from ((row, float(moment)) for moment in (again[:, None] + laps * period).ravel())


# ---- numbers of the motion that pass a level -------------------------------------------------------------------


def _of_motion(walk: Forward) -> Iterator[Switch]:
    """Relative speeds that friction or a load follows, and elongations of springs that switch."""
    for joint in _followed(walk.system):
        yield from (Switch(rate) for rate in walk.signed_rates(joint))
    springs = walk.system.mechanism.springs
    if any(_lets_go(walk.system, spring) for spring in springs.values()):
        elongations = ((springs[name], state.elongation) for name, _, state in loads.springs(walk))
        yield from (Switch(elongation) for spring, elongation in elongations if _lets_go(walk.system, spring))


def _followed(system: System) -> list[str]:
    """Joints whose sense of motion decides a friction or a load."""
    return list(dict.fromkeys([*rubbing(system), *system.resisted]))


def _lets_go(system: System, spring: Spring) -> bool:
    """Whether a spring acts one way only, or jumps by a turn half a turn from its free angle."""
    turns = spring.joint is not None and system.turns(spring.joint) and spring.joint not in system.mechanism.drivers
    return turns or spring.only is not None


# ---- where they do ---------------------------------------------------------------------------------------------


class _Crossing(NamedTuple):
    """Functions that pass a level between two times, with their values there; one entry each."""

    row: Rows
    function: Rows
    level: Array
    low: Array
    high: Array
    at_low: Array
    at_high: Array


def _levels(of: Mechanisms, switch: Switch, course: Array, turns: float) -> Array:
    """The levels of a switch, (level, mechanism), that the courses of some mechanisms may pass."""
    levels = np.array([of.row(level) for level in switch.levels])
    if len(levels) == 1 and switch.period is None:
        return levels
    finite = np.isfinite(course)
    least, most = np.min(np.where(finite, course, np.inf), 1), np.max(np.where(finite, course, -np.inf), 1)
    if switch.period is not None and np.any(finite):
        period = of.row(switch.period)
        first, last = (((side - levels[0]) / period)[np.isfinite(side)] for side in (least, most))
        again = np.arange(np.floor(np.min(first)), np.ceil(np.max(last)) + 1)
        levels = (levels[:-1] + period * again[:, None, None]).reshape(-1, len(course))
    levels = levels[np.any((levels >= least) & (levels <= most), axis=1)]
    return np.asarray(levels[:: max(1, int(np.ceil(len(levels) / min(MOST_LEVELS * turns, MOST_SCANNED))))])


def _passed(function: int, course: Array, level: Array, time: Array) -> _Crossing:
    """Where a function passes a level, (mechanism,), between two places."""
    above, finite = course >= level[:, None], np.isfinite(course)
    row, low = np.nonzero((above[:, 1:] != above[:, :-1]) & finite[:, 1:] & finite[:, :-1])
    sides = (numbers[row, low + k] for numbers in (time, course) for k in (0, 1))
    return _Crossing(row, np.full(len(row), function), level[row], *sides)


def _dips(
    single: NDArray[np.bool_], courses: Array, time: Array, number: Callable[[Rows, Rows, Array], Array]
) -> _Crossing:
    """Where a course goes through its only level and back between two places: its parabola does, and so does itself."""
    before, here, after = courses[..., :-2], courses[..., 1:-1], courses[..., 2:]
    with np.errstate(all="ignore"):
        bend = before - 2 * here + after
        least = here - (after - before) ** 2 / (8 * bend)
        shift = (before - after) / (2 * bend)
        inside = (np.abs(here) <= np.abs(before)) & (np.abs(here) <= np.abs(after)) & (before * after > 0)
        function, row, place = np.nonzero(inside & (before * here > 0) & (least * here < 0) & single[:, None, None])
    if not len(row):
        return _Crossing(row, function, *np.zeros((5, 0)))
    at, low, high = (function, row, place), time[row, place], time[row, place + 2]
    middle = time[row, place + 1] + shift[at] * (time[row, place + 1] - low)
    least = number(row, function, middle)
    over = np.tile(least * here[at] < 0, 2)
    pairs = (low, middle), (middle, high), (before[at], least), (least, after[at])
    sides = (np.concatenate(pair)[over] for pair in pairs)
    return _Crossing(np.tile(row, 2)[over], np.tile(function, 2)[over], np.zeros(int(np.sum(over))), *sides)


def _located(every: _Crossing, number: Callable[[Array], Array], duration: Array) -> Array:
    """The times of all crossings."""
    low, high = every.at_low - every.level, every.at_high - every.level
    return root(lambda time: number(time) - every.level, every.low, every.high, low, high, SETTLED * duration)


def root(
    off: Callable[[Array], Array], low: Array, high: Array, at_low: Array, at_high: Array, settled: Array
) -> Array:
    """Where a number is 0 between two places at which it has other signs, by inverse quadratic interpolation where that
    is sure to converge, else bisection [C]. at_low, at_high: the number there; settled: how near it is to be found."""
    a, b, fa, fb = low.copy(), high.copy(), at_low, at_high
    with np.errstate(all="ignore"):
        share = np.clip(fa / (fa - fb), 0.0, 1.0)
        for _ in range(ROOT_ROUNDS):
            at = a + share * (b - a)
            value = off(at)
            same = np.sign(value) == np.sign(fa)
            c, fc = np.where(same, a, b), np.where(same, fa, fb)
            b, fb = np.where(same, b, a), np.where(same, fb, fa)
            a, fa = at, value
            if np.all((np.abs(b - a) <= settled) | (fa == 0) | (fb == 0) | np.isnan(fa)):
                break
            xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
            sure = (phi**2 < xi) & ((1 - phi) ** 2 < 1 - xi)
            inverse = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
            least = np.minimum(0.5, settled / np.abs(b - c))
            share = np.clip(np.where(sure & np.isfinite(inverse), inverse, 0.5), least, 1 - least)
    return np.where(np.abs(fa) <= np.abs(fb), a, b)


# ---- angles without jumps --------------------------------------------------------------------------------------


def near(number: Number, to: Any, turn: float = TURN) -> Number:
    """The number and so many whole turns that it is as near as can be to another."""
    return number - turn * np.rint((primal(number) - to) / turn)


def turned(
    cycle: Cycle,
    look: Callable[[Array], tuple[Array, NDArray[np.integer]]],
    firsts: Callable[[Array], Sequence[Number]],
    knots: Array,
    span: tuple[float, float],
) -> list[tuple[Array, Array]]:
    """Times, s, and angles over a span, of each row of rates that `look` gives at times with the states there.

    firsts: the angles of all rows at times, one a row, from which each goes on; knots: times, s, at which rates may
    bend.
    """
    rates = Courses.of(look, breaks_between(cycle, knots, *span), None, accuracy_of(cycle, TURNING))
    rows = [rates.integral(row) for row in range(len(rates.sizes))]
    nodes = rows[0][0]
    starts = np.argmax(np.isfinite(rates.at(nodes)), axis=1)
    begins = [
        float(np.broadcast_to(primal(angle), starts.shape)[row]) for row, angle in enumerate(firsts(nodes[starts]))
    ]
    return [
        (time, angle - angle[start] + np.nan_to_num(begin))
        for (time, angle), start, begin in zip(rows, starts, begins, strict=True)
    ]


def unwrap_row(angle: NDArray[np.float64], rate: NDArray[np.float64], step: float) -> None:
    """Add whole turns in place so that the angle follows its rate from position to position (`step` s apart).

    A gap of NaN is bridged to the nearest turn.
    """
    solved = np.flatnonzero(np.isfinite(angle))
    values, rates = angle[solved], np.nan_to_num(rate[solved])
    expected = np.where(np.diff(solved) == 1, (rates[1:] + rates[:-1]) / 2 * step, 0.0)
    turns = np.cumsum(np.rint((expected - np.diff(values)) / (2 * np.pi)))
    angle[solved[1:]] = values[1:] + 2 * np.pi * turns
