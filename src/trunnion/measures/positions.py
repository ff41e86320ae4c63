"""At which positions measures have to be known: the grid of a cycle, single places, ends of windows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, MechanismError, Severity
from trunnion.measures.measures import Measure, within
from trunnion.model.checks.check import in_radians
from trunnion.model.fields import place_kind
from trunnion.model.mechanism import Mechanism
from trunnion.model.quantity import Quantity
from trunnion.model.units import UnitError
from trunnion.solve.system import System, Values

if TYPE_CHECKING:
    from trunnion.solve.run import Run

Array = NDArray[np.float64]

CLOSE = 0.25  # of a step: a position of the grid that is closer to the end of a window gives way to it
SAME = 1e-9  # of a step: times that are one
NEWTONS = 4  # steps to a time, one of which is exact at a constant speed, before bisections
BISECTIONS = 60


@dataclass(frozen=True)
class Window:
    """The positions of one measure.

    index: into the times of the plan, in order; time: theirs, s, rising (beyond the end of the cycle where the window
    runs over it).
    """

    index: NDArray[np.intp]
    time: Array


class PositionPlan(NamedTuple):
    """Times to evaluate, s, rising, (position,), and the window of each measure, by name."""

    times: Array
    windows: Mapping[str, Window]


def moved(run: Run, values: Values, times: Number) -> Number:
    """Times, s, with other numbers of the drivers, (position,) or (sample, position): of the same positions.

    The first driver has the same coordinates if it runs one way; else times are the same parts of its cycle. Dual
    numbers give derivatives of the times, of a law that runs one way.
    """
    system, before = run.system, run.values

    def changed(number: Number, was: Number) -> bool:
        return number is not was and (isinstance(number, Dual) or bool(np.any(np.asarray(number) != np.asarray(was))))

    if not any(changed(values[path], before[path]) for path in before if path.startswith("drivers.")):
        return times
    name = next(iter(system.mechanism.drivers))
    before_span, span = system.span(before, name), system.span(values, name)
    scaled = times * (span.duration / before_span.duration)
    if not span.one_way:
        return scaled
    return _reached(system, values, name, system.drive(before, name, times)[0], primal(scaled), primal(span.duration))


def plan(run: Run, measures: Sequence[Measure], steps: int) -> PositionPlan:
    """The positions that measures need: the grid of `steps` positions only if one is of all positions or of a window.

    Raises MechanismError for places and windows that are not in the cycle.
    """
    ends = ends_by_name(run, measures)
    grid = run.cycle.times(steps) if any(len(lane_ends) != 1 for lane_ends in ends.values()) else np.zeros(0)
    times = np.unique(np.concatenate([grid, *(within(run, np.array(lane_ends)) for lane_ends in ends.values())]))
    return PositionPlan(times, {name: _window(run, lane_ends, times, grid) for name, lane_ends in ends.items()})


def place_of(mechanism: Mechanism, at: float | str) -> tuple[float, bool]:
    """A position as a user writes it: a coordinate of the first driver, rad or m, or a time, s; whether it is a time.

    Raises MechanismError for what is none.
    """
    remedy = "write 60deg, 20mm or 0.1s, as the driver turns or slides"
    try:
        quantity = Quantity.read(at)
        kind = place_kind(mechanism, quantity, {})
        quantity.check({}, kind)
        value = float(quantity.evaluate())
    except UnitError as error:
        raise MechanismError(Finding(f"'{at}' is not a position: {error.what}", "at", remedy)) from None
    except KeyError:
        raise MechanismError(Finding(f"'{at}' is not a position", "at", remedy)) from None
    if kind.unit == "rad" and not isinstance(at, str) and (doubts := [*in_radians("at", value)]):
        raise MechanismError(replace(doubts[0], severity=Severity.ERROR))
    return value, kind.unit == "s"


def _window(run: Run, ends: tuple[float, ...], times: Array, grid: Array) -> Window:
    """The positions of one measure: a place, a window between two times, or all of the grid."""
    duration, time = run.cycle.duration, grid
    step = duration / max(1, len(grid) - (0 if run.cycle.periodic else 1))
    if ends:  # a window may run on into the next cycle
        inner = np.concatenate([grid, grid + duration])
        inner = inner[(inner > ends[0] + CLOSE * step) & (inner < ends[-1] - CLOSE * step)]
        time = np.concatenate([ends[:1], inner, ends[1:]])
    return Window(np.searchsorted(times, within(run, time) - SAME * step) % len(times), time)


# ---- places and windows as they are stated --------------------------------------------------------------------


def ends_by_name(run: Run, measures: Sequence[Measure]) -> dict[str, tuple[float, ...]]:
    """Times, s, of the place or of both ends of the window of each measure; none if it is of the whole cycle.

    Raises MechanismError for places and windows that are not in the cycle.
    """
    ends: dict[str, tuple[float, ...]] = {}
    findings: list[Finding] = []
    for measure in measures:
        try:
            ends[measure.name] = _ends_of(run, measure)
        except MechanismError as error:
            findings += error.findings
    if findings:
        raise MechanismError(findings)
    return ends


def _ends_of(run: Run, measure: Measure) -> tuple[float, ...]:
    where = f"measures.{measure.name}"
    if run.cycle.duration <= 0:
        if measure.of_place or measure.at is not None or measure.over is not None:
            raise MechanismError(Finding("nothing moves: a cycle has no positions", where, "remove at and over"))
        return (0.0,)
    name = next(iter(run.system.mechanism.drivers))
    if measure.of_place and not run.system.span(run.values, name).one_way:
        what = f"the figure is a coordinate of '{name}', which is not unique: it moves back and forth"
        raise MechanismError(Finding(what, where, "let it move in one direction, or measure something else"))
    if measure.in_time:
        return (0.0,)
    if measure.at is not None:
        return (time_of(run, measure.at, measure.timed, f"{where}.at"),)
    return () if measure.over is None else _window_ends(run, measure, measure.over, f"{where}.over")


def _window_ends(run: Run, measure: Measure, over: tuple[float, float], where: str) -> tuple[float, ...]:
    """Both ends of a window, s; none of a window as wide as the cycle."""
    duration, (first, last) = run.cycle.duration, (time_of(run, place, measure.timed, where) for place in over)
    if run.cycle.periodic:
        length, full = over[1] - over[0], duration if measure.timed else abs(gain_of(run))
        # [300, 60] and [-60, 60] deg are the same of a driver that turns on: from the first place to the second; one
        # that turns backward passes the upper end first
        if not measure.timed and length >= 0 and gain_of(run) < 0:
            first, last = last, first
        if abs(abs(length) - full) <= 1e-9 * full:
            return ()
        if abs(length) > full:
            what = f"the window is {abs(length):g} wide, the cycle {full:g} (SI)"
            raise MechanismError(Finding(what, where, "state a window within one cycle"))
        first %= duration
        last = first + (last - first) % duration
    elif last < first:
        first, last = last, first
    if not last > first:
        raise MechanismError(Finding("the window is empty", where, "state two places apart, or at: one"))
    return first, last


def time_of(run: Run, place: float, timed: bool, where: str) -> float:
    """The time, s, of a place: a time itself, or a coordinate of a driver that runs one way.

    Raises MechanismError for a place that is not in the cycle, or at no one time of it.
    """
    duration, periodic, system, values = run.cycle.duration, run.cycle.periodic, run.system, run.values
    if timed:
        if not periodic and not -1e-12 * duration <= place <= duration * (1 + 1e-12):
            what = f"{place:g} s is not in the cycle, which lasts {duration:g} s"
            raise MechanismError(Finding(what, where, "state a time within it"))
        return place % duration if periodic else min(max(place, 0.0), duration)
    name = next(iter(system.mechanism.drivers))
    if not system.span(values, name).one_way:
        what = f"the coordinate of '{name}' is not unique: it moves back and forth"
        raise MechanismError(Finding(what, where, "state a time, such as 0.2 s"))
    start, end = (float(np.ravel(primal(system.drive(values, name, time)[0]))[0]) for time in (0.0, duration))
    low, high = min(start, end), max(start, end)
    slack = 1e-9 * (high - low)
    if periodic:
        turn = 2 * np.pi if system.turns(name) else high - low
        place += turn * np.ceil((low - slack - place) / turn)
        place -= turn * max(0.0, np.ceil((place - high - slack) / turn))
    if not low - slack <= place <= high + slack:
        factor, unit = (180 / np.pi, "deg") if system.turns(name) else (1e3, "mm")
        what = f"{factor * place:.6g} {unit} is outside the range of '{name}', "
        what += f"{factor * low:.6g} to {factor * high:.6g} {unit}"
        raise MechanismError(Finding(what, where, "state a place within the range"))
    target = np.array(min(max(place, low), high))
    return float(_reached(system, values, name, target, duration * (target - start) / (end - start), duration))


def _reached(system: System, values: Values, name: str, target: Number, guess: Number, duration: Number) -> Number:
    """Times, s, at which a driver that runs one way has the target coordinates: by Newton's method, then by bisection.

    With the derivatives that the numbers carry: t = t₀ − (q(t₀) − target)/q̇.
    """
    low, high = 0.0 * guess, 0.0 * guess + duration
    first, last = (np.asarray(primal(system.drive(values, name, time)[0])) for time in (low, high))
    exact = 4e-15 * (np.max(np.abs(last - first)) + np.max(np.abs(primal(target))))
    time = guess
    for k in range(NEWTONS + BISECTIONS):
        off, rate = (np.asarray(primal(number)) for number in system.drive(values, name, time)[:2])
        off = off - primal(target)
        if np.all(np.abs(off) <= exact):
            break
        if k < NEWTONS:
            time = time - off / np.where(rate == 0, np.inf, rate)
            continue
        late, place = np.sign(last - first) * off > 0, np.clip(time, low, high)
        low, high = np.where(late, low, place), np.where(late, place, high)
        time = (low + high) / 2
    value, rate, _ = system.drive(values, name, time)
    off = value - target
    if isinstance(off, Dual):
        return time - Dual(np.zeros(off.shape), off.dual) / primal(rate)
    return np.asarray(time)


def gain_of(run: Run) -> float:
    """What `path_of` gains over the cycle."""
    ends = path_of(run, np.array([0.0, run.cycle.duration]))
    return float(ends[1] - ends[0])


def path_of(run: Run, times: Number) -> Number:
    """Coordinate of the first driver if it runs one way, else the time."""
    name = next(iter(run.system.mechanism.drivers), "")
    if not name or not run.system.span(run.values, name).one_way:
        return times
    place = run.system.drive(run.values, name, times)[0]
    return place if isinstance(place, Dual) else np.array(np.broadcast_to(np.asarray(place, float), np.shape(times)))
