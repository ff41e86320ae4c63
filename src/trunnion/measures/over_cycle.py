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
from trunnion.measures.figures import Panels, Reading, near
from trunnion.measures.measures import Measure
from trunnion.measures.positions import ends_by_name, within
from trunnion.results.scales import ROUNDING, Scales
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run
from trunnion.solve.seating import seating_of
from trunnion.solve.status import pose_status
from trunnion.solve.switches import MARGINS, SEATED, Bend, accuracy_of, breaks_between

__all__ = ["MOTION", "Followed", "alike", "figures_of", "followed", "matters", "together"]

Array = NDArray[np.float64]
TURN = 2 * np.pi
SCANNED = 24  # positions at which it is looked how large forces are
MOTION = Accuracy(1e-12, 1e-14)  # of the motion, which has neither friction nor corners but where a law has some
TURNING = Accuracy(1e-4, 1e-6, shortest=1e-6)  # of the rate of an angle, whose integral tells its whole turns


class Followed(NamedTuple):
    """The courses of some measures, the rows of each, and of angles their turns: times, s, and the angle there."""

    courses: Courses
    rows: dict[str, slice]
    angles: dict[str, tuple[Array, Array]]


@np.errstate(all="ignore")
def figures_of(
    run: Run, measures: Sequence[Measure], method: FrictionMethod, gaps: Array | None = None
) -> dict[str, float]:
    """The figures of measures of one mechanism, SI, by name; NaN where a place that one needs has no answer.

    gaps: times, s, from and to, (2, gap), which extremes leave out.
    Raises MechanismError for places and windows that are not in the cycle.
    """
    figures: dict[str, float] = {}
    for ends, group in together(run, measures):
        if len(ends) == 1:
            curves = courses_of(run, group, np.array(ends), method)[0]
            rows = {name: np.array([np.ravel(primal(part)) for part in parts]) for name, parts in curves.items()}
            panels, ends = {name: Panels.constant(parts) for name, parts in rows.items()}, ()
        else:
            course, slices, _ = _settled(run, group, method, ends, gaps)
            panels = {name: Panels.of(course, own) for name, own in slices.items()}
        for measure in group:
            figure = float(np.ravel(Reading(run, measure, ends).read(panels[measure.name]).figure)[0])
            figures[measure.name] = 0.0 * figure if measure.against_nominal(run.system) else figure
    return {measure.name: figures[measure.name] for measure in measures}


def _settled(
    run: Run, measures: Sequence[Measure], method: FrictionMethod, ends: tuple[float, ...], gaps: Array | None
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
    groups: dict[tuple[object, ...], list[Measure]] = {}
    every = ends_by_name(run, measures)
    for measure in measures:
        ends = every[measure.name]
        against = measure.of.against or measure.rule == "deviation"
        key = (ends, measure.wants_margin, measure.of_motion, against and not measure.of_motion)
        groups.setdefault(key if len(ends) != 1 else (ends,), []).append(measure)
    return [(key[0], group) for key, group in groups.items()]  # type: ignore[misc]


def matters(bend: Bend, measures: Sequence[Measure]) -> bool:
    """Whether courses may bend or jump there: those of the motion do so where a motion law does."""
    return bend.scan < 0 or not all(measure.of_motion for measure in measures)


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
    rows, first = {}, 0
    start, end = ends or (0.0, run.cycle.duration)
    gaps = np.zeros((2, 0)) if gaps is None else gaps
    parts = evaluate(within(run, np.array([start])))[0]
    for measure in measures:
        rows[measure.name] = slice(first, first := first + len(parts[measure.name]))
    angles = {measure.name: _turns(run, measure, start, end) for measure in measures if measure.turning(run.system)}

    def look(time: Array) -> tuple[Array, NDArray[np.integer]]:
        place = within(run, time)
        curves, status = evaluate(place)
        each = (part for measure in measures for part in curves[measure.name])
        numbers = np.array([np.broadcast_to(np.ravel(primal(part)), time.shape) for part in each])
        for name, (grid, angle) in angles.items():
            numbers[rows[name]] = near(numbers[rows[name]], np.interp(time, grid, angle), TURN)
        lost = np.any((gaps[0] < place[:, None]) & (place[:, None] < gaps[1]), axis=1)
        states = np.where(lost, np.maximum(status.ravel(), Status.CONTACT_LOST), status.ravel())
        return numbers, states.astype(np.intp)

    scales = np.concatenate([np.full(len(parts[measure.name]), alike(run, measure)) for measure in measures])
    between = breaks_between(run.cycle, np.concatenate([breaks, gaps.ravel()]), start, end)
    courses = Courses.of(look, between, lambda sizes: np.maximum(sizes, scales), accuracy_of(run.cycle, accuracy))
    return Followed(courses, rows, angles)


def _turns(run: Run, measure: Measure, start: float, end: float) -> tuple[Array, Array]:
    """An angle without jumps at many times, s, so that others are told by how many turns they are off: its integral."""
    coordinate = measure.coordinate(run.system)

    def look(time: Array) -> tuple[Array, NDArray[np.integer]]:
        walk = run.walk(within(run, time))
        rate = np.asarray(primal(coordinate.rate(walk)), float)
        return np.broadcast_to(rate, (1, *time.shape)), pose_status(walk, time.shape)

    knots = np.array([bend.time for bend in run.bends if bend.scan < 0])
    rates = Courses.of(look, breaks_between(run.cycle, knots, start, end), None, accuracy_of(run.cycle, TURNING))
    time, turned = rates.integral(0)
    whole = np.isfinite(rates.at(time)[0])
    known = int(np.argmax(whole))
    first = float(np.ravel(primal(measure.curve(run.walk(within(run, time[known : known + 1])))[0]))[0])
    return time, turned - turned[known] + np.nan_to_num(first)


def alike(run: Run, measure: Measure) -> float:
    """What numbers of the kind of a measure are like: what is far below it is rounding."""

    def force() -> float:
        """The largest component of a reaction force, N."""
        count, back = run.system.mechanism.coordinates, run.solve(run.cycle.times(SCANNED))
        parts = (part for load in back.reactions.values() for part in (load.u if hasattr(load, "u") else load)[:count])
        return max((float(np.nanmax(np.abs(primal(part)), initial=0.0)) for part in parts), default=0.0)

    length, pace = (float(np.ravel(primal(of(run.values)))[0]) for of in (run.system.size, run.system.pace))
    largest = run.once("largest force", force) if measure.of.of_forces else 0.0
    return Scales(length, pace, largest).floor(measure.unit(run.system)) / ROUNDING
