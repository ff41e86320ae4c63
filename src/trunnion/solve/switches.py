"""Where forces and powers jump or bend along a cycle, as the model says it: between these places they are smooth.

Loads jump at the ends of a `between` and bend at the points of a table or where a `max` goes over to its other side;
friction and what resists a joint turn round where its relative speed does; a spring that only pulls lets go at its free
length; motion laws go from one function to the next. A number of the motion belongs to each of these, which passes a
level there. They are looked for on a scan of the cycle - also where such a number only dips through its level between
two places of it - and located to rounding. What no model states, such as a guide that tilts over, is not looked for.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Accuracy
from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number
from trunnion.algebra.roots import root
from trunnion.model.parts import Spring
from trunnion.solve import loads
from trunnion.solve.forward import Assembly, Forward, forward
from trunnion.solve.loads import Stated, Switch, placed, stated_walk
from trunnion.solve.system import Cycle, System, Values, rubbing

__all__ = [
    "MARGINS", "SEATED", "Bend", "Mechanisms", "accuracy_of", "bends", "breaks_between", "edges", "knots_of",
    "parted", "shifts_of", "stated_bends", "tracked",
]  # fmt: skip

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
        found: Array = np.broadcast_to(np.asarray(primal(number), float), shape).reshape(time.shape)
        return found

    def row(self, number: Number) -> Array:
        """A number that does not change along the way, (mechanism,)."""
        return np.broadcast_to(np.asarray(primal(number), float), (len(self.cycles), 1))[:, 0]


Look = Callable[[Forward], Iterator[Switch]]


class Bend(NamedTuple):
    """A time, s, at which forces may jump or bend; by which scan, which function of it passes which level there.

    scan: -1 where the model states the time itself.
    """

    time: float
    scan: int = -1
    function: int = 0
    level: float = 0.0


class _Scan(NamedTuple):
    """How switches are worked out: a walk at the times of some mechanisms, and what is read from it."""

    walk: Callable[[System, Values, Assembly, Number], Forward]
    look: Look
    wanted: Callable[[System], bool]
    places: int
    noise: float


def edges(of: Mechanisms) -> list[Array]:
    """Times, s, of every mechanism between which its forces are smooth as far as the model says it, both ends included.

    No two are farther apart than a PANELS-th of a turn.
    """
    return [parted(times, cycle) for times, cycle in zip(bends(of), of.cycles, strict=True)]


def bends(of: Mechanisms) -> list[Array]:
    """Times, s, of every mechanism at which its forces may jump or bend, in no order."""
    found: list[list[float]] = [[] for _ in of.cycles]
    for row, one in _bends(of):
        found[row].append(one.time)
    return [np.array(times, float) for times in found]


def stated_bends(of: Mechanisms) -> list[Bend]:
    """Where the forces of one mechanism may jump or bend, with what it is that does, so that it can be `tracked`."""
    return [one for _, one in _bends(of)]


def tracked(of: Mechanisms, known: Sequence[Bend], moved: Callable[[Values, Array], Number]) -> Array:
    """Times, s, (mechanism, bend), at which other mechanisms have the bends of one; NaN where it is not near the same.

    They are times of the one, `moved` to those of the others by their values; cycles: that of the one, for each.
    """
    cycle, count, found = of.cycles[0], len(of.cycles), np.tile([one.time for one in known], (len(of.cycles), 1))
    for k, scan in enumerate(_scans(of.system)):
        own = np.flatnonzero([one.scan == k for one in known])
        if not len(own):
            continue
        rows, which = np.repeat(np.arange(count), len(own)), np.tile(own, count)
        bend = [known[i] for i in own.tolist()]
        widths = np.array([_width(one, known, cycle) for one in bend])
        function, level = (np.tile([one[i] for one in bend], count) for i in (2, 3))

        def values(rows: Rows, times: Array, scan: _Scan = scan) -> Array:
            times = times % cycle.duration if cycle.periodic else np.clip(times, 0.0, cycle.duration)
            own = of.picked(rows)
            walk = scan.walk(of.system, own, of.assembly, of.lanes(np.asarray(primal(moved(own, times)), float)))
            return np.stack([of.shaped(switch.number, times) for switch in scan.look(walk)])

        low, high = (found[rows, which] + way * np.tile(widths, count) for way in (-1.0, 1.0))
        lanes = np.arange(len(rows))
        ends = [values(rows, time[:, None])[function, lanes, 0] for time in (low, high)]
        passed = (ends[0] >= level) != (ends[1] >= level)
        crossing = _Crossing(rows, function, level, low, high, *ends)
        found[rows, which] = np.where(passed, _located(crossing, values, np.full(len(rows), cycle.duration)), np.nan)
    return found


def shifts_of(
    of: Mechanisms,
    known: Sequence[Bend],
    times: Array,
    moved: Callable[[Values, Array], Number],
    sides: tuple[Values, Values],
) -> Array:
    """How far times of bends that were `tracked`, (mechanism, bend), go from one side of the values to the other.

    What passes its level there goes on to do so: to first order δt = −δg/(∂g/∂t), g being its number.
    """
    cycle, found = of.cycles[0], np.zeros(times.shape)
    for k, scan in enumerate(_scans(of.system)):
        own = np.flatnonzero([one.scan == k for one in known])
        if not len(own):
            continue
        rows, which = np.repeat(np.arange(len(times)), len(own)), np.tile(own, len(times))
        function, time = np.array([known[i].function for i in which]), times[rows, which][:, None]

        def number(
            values: Values, time: Array, scan: _Scan = scan, rows: Rows = rows, function: Rows = function
        ) -> Array:
            own = replace(of, values=values).picked(rows)
            time = time % cycle.duration if cycle.periodic else np.clip(time, 0.0, cycle.duration)
            walk = scan.walk(of.system, own, of.assembly, of.lanes(np.asarray(primal(moved(own, time)), float)))
            numbers = [of.shaped(switch.number, time) for switch in scan.look(walk)]
            return np.array([numbers[k][lane, 0] for lane, k in enumerate(function)])

        # on both sides in time too, as what is noise beside its own size counts as zero
        step = SLOPED * cycle.duration
        change = [sum(sign * number(values, time + way) for values, sign in zip(sides, (-0.5, 0.5), strict=True))
                  for way in (-step, step)]  # fmt: skip
        rate = (number(of.values, time + step) - number(of.values, time - step)) / (2 * step)
        found[rows, which] = -(change[0] + change[1]) / rate
    return found


def _width(of: Bend, known: Sequence[Bend], cycle: Cycle) -> float:
    """How far to either side of a bend it is looked for in other mechanisms, s: not beyond the next one of its kind."""
    like = [abs(one.time - of.time) / 2 for one in known if one[1:3] == of[1:3] and one is not of]
    return min(cycle.duration / (TRACKED * max(1.0, cycle.turns)), *like, cycle.duration)


def _scans(system: System) -> tuple[_Scan, _Scan]:
    quiet = NOISE if placed(system.mechanism) else 0.0
    return (
        _Scan(stated_walk, lambda walk: Stated(walk).switches(), _varies, STATED_SCANNED, quiet),
        _Scan(forward, _of_motion, _switches, SCANNED, NOISE),
    )


def _bends(of: Mechanisms) -> Iterator[tuple[int, Bend]]:
    yield from ((row, Bend(moment)) for row, moment in knots_of(of))
    for k, scan in enumerate(_scans(of.system)):
        yield from ((row, Bend(time, k, function, level)) for row, time, function, level in _passages(of, scan))


def parted(times: Array, cycle: Cycle) -> Array:
    """Edges from the times of the bends: rising, those that are one taken once, wide gaps parted evenly."""
    times = np.sort(np.concatenate([[0.0, cycle.duration], times[(times >= 0) & (times <= cycle.duration)]]))
    kept = times[np.append(np.diff(times) > CLOSE * cycle.duration, True)]
    kept[0] = 0.0
    widest = cycle.duration / min(PANELS * max(1.0, np.ceil(cycle.turns - 1e-9)), MOST_EDGES)
    counts = np.ceil(np.diff(kept) / widest * (1 - 1e-9)).astype(int)
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    parts = within * np.repeat(np.diff(kept) / counts, counts) + np.repeat(kept[:-1], counts)
    return np.append(parts, kept[-1])


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


def _varies(system: System) -> bool:
    """Whether any number of the model varies with the motion."""
    return any(entry.varies for entry in system.mechanism.parameter_set.entries.values())


def _switches(system: System) -> bool:
    """Whether anything in the mechanism switches as it moves."""
    return bool(_followed(system)) or any(_lets_go(system, spring) for spring in system.mechanism.springs.values())


def _followed(system: System) -> list[str]:
    """Joints whose sense of motion decides a friction or a load."""
    return list(dict.fromkeys([*rubbing(system), *system.resisted]))


def _lets_go(system: System, spring: Spring) -> bool:
    """Whether a spring acts one way only, or jumps by a turn half a turn from its free angle."""
    turns = spring.joint is not None and system.turns(spring.joint) and spring.joint not in system.mechanism.drivers
    return turns or spring.only is not None


# ---- where they do ---------------------------------------------------------------------------------------------


class _Crossing(NamedTuple):
    """A function that passes a level between two times, with its values there; one entry each."""

    row: Rows
    function: Rows
    level: Array
    low: Array
    high: Array
    at_low: Array
    at_high: Array


def _passages(of: Mechanisms, scan: _Scan) -> Iterator[tuple[int, float, int, float]]:
    """(mechanism, time, function, level) of every passage that a scan shows."""
    duration = np.array([cycle.duration for cycle in of.cycles])
    turns = max(cycle.turns for cycle in of.cycles)
    count = int(min(scan.places * max(1.0, np.ceil(turns - 1e-9)), MOST_SCANNED))
    time = duration[:, None] * np.linspace(0.0, 1.0, count + 1)
    if not scan.wanted(of.system):
        return

    def look(rows: Rows, times: Array) -> list[Switch]:
        return list(scan.look(scan.walk(of.system, of.picked(rows), of.assembly, of.lanes(times))))

    switches = look(np.arange(len(duration)), time)
    if not switches:
        return

    def values(rows: Rows, times: Array) -> Array:
        return np.stack([of.shaped(switch.number, times) for switch in look(rows, times)])

    courses = np.stack([of.shaped(switch.number, time) for switch in switches])
    noise = scan.noise * np.nanmax(np.abs(np.nan_to_num(courses)), axis=-1, keepdims=True)
    courses = np.where(np.abs(courses) <= noise, 0.0, courses)
    found: list[tuple[float, ...]] = []
    for k, (switch, course) in enumerate(zip(switches, courses, strict=True)):
        if len(switch.levels) == 1 and switch.period is None:
            found += _passed_once(course, of.row(switch.levels[0]), time, k)
            continue
        for row in range(len(duration)):
            levels = _levels(of, switch, row, course[row])
            found += [(row, k, *one) for one in _passed(course[row], levels, time[row])]
    dips = list(_dips(switches, courses, time, values))
    if found or dips:
        columns = [np.array(column) for column in zip(*found, *dips, strict=True)]
        one = _Crossing(columns[0].astype(np.intp), columns[1].astype(np.intp), *columns[2:])
        times = _located(one, values, duration[one.row])
        yield from zip(one.row.tolist(), times.tolist(), one.function.tolist(), one.level.tolist(), strict=True)


def _levels(of: Mechanisms, switch: Switch, row: int, course: Array) -> Array:
    """The levels of a switch that its course may pass, rising."""
    levels = np.array([of.row(level)[row] for level in switch.levels])
    known = course[np.isfinite(course)]
    if switch.period is not None and len(known):
        period = of.row(switch.period)[row]
        first, last = np.floor((np.min(known) - levels[0]) / period), np.ceil((np.max(known) - levels[0]) / period)
        levels = np.unique((levels[:-1] + period * np.arange(first, last + 1)[:, None]).ravel())
    if len(known):
        levels = levels[(levels >= np.min(known)) & (levels <= np.max(known))]
    most = min(MOST_LEVELS * max(1.0, np.ceil(of.cycles[row].turns - 1e-9)), MOST_SCANNED)
    return levels[:: max(1, int(np.ceil(len(levels) / most)))]


def _passed_once(course: Array, level: Array, time: Array, function: int) -> Iterator[tuple[float, ...]]:
    """What a `_Crossing` holds, wherever a function passes its only level, (mechanism,), between two places."""
    above, there = course >= level[:, None], np.isfinite(course)
    rows, low = np.nonzero((above[:, 1:] != above[:, :-1]) & there[:, 1:] & there[:, :-1])
    high = low + 1
    columns = level[rows], time[rows, low], time[rows, high], course[rows, low], course[rows, high]
    return zip(rows, itertools.repeat(function), *columns, strict=False)


def _passed(course: Array, levels: Array, time: Array) -> Iterator[tuple[float, ...]]:
    """Level, time before and after, value before and after, wherever a course passes a level between two places."""
    above = np.searchsorted(levels, course, side="right")
    there = np.isfinite(course)
    for k in np.flatnonzero((above[1:] != above[:-1]) & there[1:] & there[:-1]):
        between = slice(min(above[k], above[k + 1]), max(above[k], above[k + 1]))
        yield from ((level, time[k], time[k + 1], course[k], course[k + 1]) for level in levels[between])


def _dips(
    switches: Sequence[Switch], courses: Array, time: Array, values: Callable[[Rows, Array], Array]
) -> Iterator[tuple[float, ...]]:
    """Where a course goes through its only level and back between two places: its parabola does, and so does itself."""
    single = np.array([len(switch.levels) == 1 for switch in switches])
    before, here, after = courses[..., :-2], courses[..., 1:-1], courses[..., 2:]
    with np.errstate(all="ignore"):
        bend = before - 2 * here + after
        least = here - (after - before) ** 2 / (8 * bend)
        inside = (np.abs(here) <= np.abs(before)) & (np.abs(here) <= np.abs(after)) & (before * after > 0)
        dips = inside & (before * here > 0) & (least * here < 0) & single[:, None, None]
    functions, rows, places = np.nonzero(dips)
    if not len(rows):
        return
    one, two, three = (
        np.array([time[row, place + k] for row, place in zip(rows, places, strict=True)]) for k in range(3)
    )
    with np.errstate(all="ignore"):
        shift = (before - after)[dips] / (2 * bend[dips])
    middle = two + shift * (two - one)
    there = values(rows, middle[:, None])[functions, np.arange(len(rows)), 0]
    for i in np.flatnonzero(there * here[dips] < 0):
        yield rows[i], functions[i], 0.0, one[i], middle[i], before[dips][i], there[i]
        yield rows[i], functions[i], 0.0, middle[i], three[i], there[i], after[dips][i]


def _located(one: _Crossing, values: Callable[[Rows, Array], Array], duration: Array) -> Array:
    """The times of all crossings."""
    lanes = np.arange(len(one.row))

    def off(time: Array) -> Array:
        number: Array = values(one.row, time[:, None])[one.function, lanes, 0] - one.level
        return number

    return root(off, one.low, one.high, one.at_low - one.level, one.at_high - one.level, SETTLED * duration)
