"""The courses of measures of one mechanism, and their figures, whatever positions a table has."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Accuracy, Courses
from trunnion.algebra.dual import primal
from trunnion.errors import Status
from trunnion.measures.evaluation import Curves, courses_of
from trunnion.measures.figures import Panels, Reading, columns, follow
from trunnion.measures.measures import Measure
from trunnion.measures.positions import ends_of, plan
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run
from trunnion.solve.seating import seating_of
from trunnion.solve.switches import MARGINS, SEATED, Bend, accuracy_of, breaks_between

__all__ = ["Followed", "alike", "endless_and_lost", "figures_of", "followed", "matters", "settled", "together"]

Array = NDArray[np.float64]
SCANNED = 24  # positions at which it is looked how large forces are
MOTION = Accuracy(1e-12, 1e-14)  # of the motion, which has neither friction nor corners but where a law has some
TURNED = 360  # of a turn, between which no angle turns by half a turn
ENDLESS = 32  # beside the status of places where a number is infinite


class Followed(NamedTuple):
    """The courses of some measures, the rows of each, and of angles their turns: times, s, and the angle there."""

    courses: Courses
    rows: dict[str, slice]
    angles: dict[str, tuple[Array, Array]]


def figures_of(
    run: Run, measures: Sequence[Measure], method: FrictionMethod, gaps: Array | None = None
) -> dict[str, float]:
    """The figures of measures of one mechanism, SI, by name; NaN where a place that one needs has no answer.

    gaps: times, s, from and to, (2, gap), which extremes leave out.
    Raises MechanismError for places and windows that are not in the cycle.
    """
    found: dict[str, float] = {}
    for ends, group in together(run, measures):
        with np.errstate(all="ignore"):
            if len(ends) == 1:
                curves = courses_of(run, group, np.array(ends), method)[0]
                panels = {
                    one.name: Panels.constant(columns([primal(part) for part in curves[one.name]], 1)) for one in group
                }
            else:
                course, rows, _ = settled(run, group, method, ends, gaps)
                whole = Panels.of(course, *endless_and_lost(course))
                panels = {one.name: whole.rows(rows[one.name]) for one in group}
            for one in group:
                figure = float(np.ravel(Reading(run, one, ends[: 2 * (len(ends) > 1)]).figure(panels[one.name]))[0])
                against = one.of.against or one.of_attitude(run.system) or one.rule == "deviation"
                found[one.name] = 0.0 * figure if against else figure
    return {measure.name: found[measure.name] for measure in measures}


def settled(
    run: Run,
    measures: Sequence[Measure],
    method: FrictionMethod,
    ends: tuple[float, ...] = (),
    gaps: Array | None = None,
) -> Followed:
    """The courses of some measures of the mechanism itself, its pins in their seats, over the cycle or a window."""
    motion = MOTION if all(measure.of_motion for measure in measures) else Accuracy()
    accuracy = MARGINS if measures[0].wants_margin else SEATED if run.seats else motion
    breaks = np.array([bend.time for bend in run.bends if run.seats or matters(bend, measures)])
    breaks = np.concatenate([breaks, seating_of(run, method).breaks]) if run.seats else breaks
    return followed(run, measures, ends, partial(courses_of, run, measures, method=method), breaks, accuracy, gaps)


def together(run: Run, measures: Sequence[Measure]) -> list[tuple[tuple[float, ...], list[Measure]]]:
    """Measures whose courses have the same panels, with the place or the ends of their window, s, (0,) at rest.

    Raises MechanismError for places and windows that are not in the cycle.
    """
    plan(run, measures, 1)
    groups: dict[tuple[object, ...], list[Measure]] = {}
    for measure in measures:
        ends = (0.0,) if run.cycle.duration <= 0 else ends_of(run, measure)
        against = measure.of.against or measure.rule == "deviation"
        key = (ends, measure.wants_margin, measure.of_motion, against and not measure.of_motion)
        groups.setdefault(key if len(ends) != 1 else (ends,), []).append(measure)
    return [(key[0], group) for key, group in groups.items()]  # type: ignore[misc]


def matters(bend: Bend, measures: Sequence[Measure]) -> bool:
    """Whether courses may bend or jump there: those of the motion do so where a motion law does."""
    return bend.scan < 0 or not all(measure.of_motion for measure in measures)


def endless_and_lost(courses: Courses) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Panels in which a number is infinite, and those where a pin loses contact."""
    return courses.states >= ENDLESS, courses.states % ENDLESS == Status.CONTACT_LOST


def followed(
    run: Run,
    measures: Sequence[Measure],
    ends: tuple[float, ...],
    evaluate: Callable[[Array], tuple[Curves, NDArray[np.int8]]],
    breaks: Array,
    accuracy: Accuracy,
    gaps: Array | None = None,
) -> Followed:
    """The courses of some measures over the cycle, or between two times, s.

    evaluate: their parts at times of the cycle, s, and the statuses; breaks: times, s, where they may bend or jump.
    """
    duration, rows = run.cycle.duration, {}
    start, end = ends or (0.0, duration)
    gaps = np.zeros((2, 0)) if gaps is None else gaps
    parts, first = evaluate(np.array([start % duration if run.cycle.periodic else start]))[0], 0
    for measure in measures:
        rows[measure.name] = slice(first, first + len(parts[measure.name]))
        first += len(parts[measure.name])
    angles = {measure.name: _turns(run, measure, start, end) for measure in measures if measure.turning(run.system)}

    def look(time: Array) -> tuple[Array, NDArray[np.integer]]:
        within = time % duration if run.cycle.periodic else time
        curves, status = evaluate(within)
        numbers = np.empty((first, len(time)))
        for measure in measures:
            for k, part in zip(range(first)[rows[measure.name]], curves[measure.name], strict=True):
                numbers[k] = np.asarray(primal(part), float).reshape(-1)
            if measure.name in angles:
                k, (grid, angle) = rows[measure.name].start, angles[measure.name]
                numbers[k] += 2 * np.pi * np.rint((np.interp(time, grid, angle) - numbers[k]) / (2 * np.pi))
        endless = np.any(np.isinf(numbers), axis=0)
        numbers[np.isinf(numbers)] = np.nan
        lost = np.any((gaps[0] < within[:, None]) & (within[:, None] < gaps[1]), axis=1)
        states = np.where(lost, np.maximum(status.ravel(), Status.CONTACT_LOST), status.ravel())
        return numbers, states.astype(np.intp) + ENDLESS * endless

    scales = alike(run, measures, rows)
    between = breaks_between(run.cycle, np.concatenate([breaks, gaps.ravel()]), start, end)
    courses = Courses.of(look, between, lambda sizes: np.maximum(sizes, scales), accuracy_of(run.cycle, accuracy))
    return Followed(courses, rows, angles)


def _turns(run: Run, measure: Measure, start: float, end: float) -> tuple[Array, Array]:
    """An angle without jumps at many times, s, so that others are told by how many turns they are off."""
    time = np.linspace(start, end, 1 + int(np.ceil(TURNED * max(1.0, run.cycle.turns))))
    walk = run.walk(time % run.cycle.duration if run.cycle.periodic else time)
    angle, rate = (
        np.array(np.broadcast_to(np.asarray(primal(number), float), time.shape))
        for number in (measure.curve(walk)[0], measure.coordinate(run.system).rate(walk))
    )
    follow(angle, rate, time)
    return time, angle


def alike(run: Run, measures: Sequence[Measure], rows: dict[str, slice]) -> Array:
    """What numbers of the kind of each row are like: what is far below it is rounding."""
    return np.concatenate([np.full(rows[one.name].stop - rows[one.name].start, _scale(run, one)) for one in measures])


def _scale(run: Run, measure: Measure) -> float:
    """The same of a measure."""
    system = run.system
    length, pace = (float(np.ravel(primal(number))[0]) for number in (system.size(run.values), system.pace(run.values)))
    force = run.once("largest force", lambda: _force(run)) if measure.of.of_forces else 0.0
    units = {
        **{"N": force, "N m": force * length, "W": force * length * pace, "J": force * length, "m": length},
        **{"rad": 1.0, "m/s": length * pace, "rad/s": pace, "m/s^2": length * pace**2, "rad/s^2": pace**2},
    }
    return units.get(measure.unit(system), 0.0)


def _force(run: Run) -> float:
    """The largest component of a reaction force, N."""
    time, count = run.cycle.times(SCANNED), run.system.mechanism.coordinates
    back = run.solve(time)
    parts = (part for load in back.reactions.values() for part in (load.u if hasattr(load, "u") else load)[:count])
    return max((float(np.nanmax(np.abs(primal(part)), initial=0.0)) for part in parts), default=0.0)
