"""Courses of a motion in time over its steps, and what they tell of one that goes round and round: how it starts, how
evenly it then runs, how it runs down; the measures of that, which have no course over a cycle.

Of dual numbers the derivatives of measures are central differences of the motions themselves.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray
from scipy.optimize import brentq

from trunnion.algebra.course import Courses
from trunnion.algebra.dual import Dual, derivative, primal, single
from trunnion.algebra.namespace import Number
from trunnion.algebra.panels import FIT, ON_POINTS, ORDER
from trunnion.dynamics.compiled_rates import Codes, rates_of
from trunnion.dynamics.impact_motion import integrator_of
from trunnion.dynamics.solution import Solution, over_steps, step_nodes
from trunnion.dynamics.start import CYCLES, initial_row, places
from trunnion.dynamics.state import FreeMotion
from trunnion.errors import MechanismError
from trunnion.measures.evaluation import Curves, NumpyKernel, shape_of, step_of
from trunnion.measures.measures import Measure
from trunnion.results.attributes import Figure
from trunnion.results.quantities import readable
from trunnion.solve.run import Run
from trunnion.solve.system import Values

Array = NDArray[np.float64]

FIGURES = ("starting_time", "steady_speed", "fluctuation", "peak_effort")
TURN = 2 * np.pi
STEADY = 0.02  # of the mean speed: by how much the turn before the last may differ where it runs steadily
STARTED = 0.95  # of the mean speed of the last turn: from then on it has started
BEGUN = 0.5  # of that: a motion that begins faster does not start
FEWEST = 3  # whole turns of which one speaks of a steady one
BACKWARD = 1e-9  # of a turn, by which one that goes round and round may seem to go back
COORDINATE, SPEED, EFFORT = range(3)  # rows of a drive

# from values at the nodes of a panel two long to those of the derivative there
DERIVED: Array = np.asarray(ON_POINTS[:-1].T @ chebyshev.chebder(FIT), np.float64)


@dataclass(frozen=True)
class DriveCourse:
    """Coordinate, speed and effort of a drive as courses over the steps; a time is found from a coordinate, or a
    largest speed, as exactly as the motion itself is known.

    sense: in which the coordinate goes, +1 or −1.
    """

    courses: Courses
    sense: float

    @classmethod
    def of(cls, motion: FreeMotion, solution: Solution, i: int) -> DriveCourse:
        """That of one free coordinate; the motion has a step."""
        steps = [stretch for stretch in solution.stretches if stretch.end > stretch.begin]
        begins = np.array([*(stretch.begin for stretch in steps), solution.end])
        numbers = np.empty((3, len(steps), ORDER))
        for k, (stretch, time) in enumerate(zip(steps, step_nodes(begins), strict=True)):
            at = stretch.at(solution.layout, time)
            second = at.rate @ DERIVED.T / (0.5 * (stretch.end - stretch.begin))
            senses = {} if motion.rests(at) else motion.senses(at)
            effort = motion.given(at, 0.0 * second if stretch.resting else second, senses)[i]
            numbers[:, k] = at.q[i], at.rate[i], effort
        courses = over_steps(begins, numbers)
        first, last = courses.at(begins[[0, -1]])[COORDINATE]
        return cls(courses, -1.0 if last < first else 1.0)

    @cached_property
    def time(self) -> Array:
        """Nodes and ends of the steps, s."""
        return np.union1d(self.courses.edges, step_nodes(self.courses.edges).ravel())

    @cached_property
    def gone(self) -> Array:
        """How far the coordinate has gone at these times from where it began, in its sense."""
        coordinates = self.courses.at(self.time)[COORDINATE]
        return np.asarray(self.sense * (coordinates - coordinates[0]))

    @property
    def travel(self) -> float:
        """How far it has gone at the end."""
        return float(self.gone[-1])

    @cached_property
    def runs(self) -> bool:
        """Whether it goes round and round, one way, to the end."""
        onward = bool(np.all(np.diff(self.gone) >= -BACKWARD))
        return onward and self.travel >= FEWEST * TURN and bool(self.courses.at(self.time[-1:])[SPEED, 0] != 0.0)

    def when(self, gone: float) -> float:
        """The first time at which the coordinate has gone so far, s."""
        first, last = self.courses.edges[[0, -1]]
        times = self.courses.passages(
            COORDINATE, float(self.courses.at(first[None])[COORDINATE, 0] + self.sense * gone)
        )
        return float(times[0] if len(times) else last if gone > 0.0 else first)

    def largest(self, row: int, sign: float = 1.0, since: float | None = None) -> float:
        """The largest value of a row, or of its opposite, since a time, s."""
        courses = self.courses if since is None else self.courses.between(since, self.courses.edges[-1])
        place = courses.extreme(lambda rows: rows[row], sign)
        return np.nan if place is None else sign * place.value

    @cached_property
    def last_turn(self) -> float:
        """The time at which the last whole turn begins, s; NaN where it does not run steadily, round and round."""
        if not self.runs:
            return np.nan
        begin, before = (self.when(self.travel - turns * TURN) for turns in (1, 2))
        steady = abs((begin - before) / (self.time[-1] - begin) - 1.0) <= STEADY
        return begin if steady else np.nan

    @np.errstate(all="ignore")
    def figures(self) -> dict[str, float]:
        """Every figure of `FIGURES`; NaN where the motion has none.

        starting_time: the first time, s, at which the mean speed of the turn that ends there is STARTED of that of the
        last one; steady_speed: of the last whole turn, 2π over the time that it takes, rad/s; fluctuation: its
        coefficient, (ω_max − ω_min)/ω_mean; peak_effort: the largest |effort|, N m or N.
        """
        figures = dict.fromkeys(FIGURES, np.nan)
        figures["peak_effort"] = max(self.largest(EFFORT), self.largest(EFFORT, -1.0))
        if np.isfinite(self.last_turn):
            steady = float(TURN / (self.time[-1] - self.last_turn))
            change = sum(self.largest(SPEED, sign, self.last_turn) for sign in (1.0, -1.0))
            figures |= {"steady_speed": steady, "fluctuation": change / steady}
            limit = TURN / (STARTED * steady)

            def longer(gone: float) -> float:
                """By how much the turn that ends here takes longer than it may, s."""
                return self.when(gone) - self.when(gone - TURN) - limit

            if abs(self.courses.at(self.time[:1])[SPEED, 0]) < BEGUN * steady:
                takes = self.time - np.interp(self.gone - TURN, self.gone, self.time)
                first = int(np.argmax((takes <= limit) & (self.gone >= TURN)))
                low = max(TURN, float(self.gone[max(first - ORDER, 0)]))
                high = float(self.gone[min(first + ORDER, len(self.gone) - 1)])
                inside = longer(high) < 0.0 < longer(low)
                gone = brentq(longer, low, high, rtol=1e-15) if inside else low if longer(low) <= 0.0 else high
                figures["starting_time"] = self.when(gone)
        return figures


def steady_figures(motion: FreeMotion, solution: Solution, i: int) -> list[Figure]:
    """Mean speed, starting time and coefficient of fluctuation of a free coordinate, see `FIGURES`; where it rests at
    the end its run-down: how long, and how far, it still moves after its motor is switched off, or from the start if it
    has none, until all rest. None of a slide, of less than three turns, or where it does not run steadily."""
    name, drive = list(motion.drives.items())[i]
    turns = motion.system.turns(name)
    if solution.stretches and solution.stretches[-1].resting:
        off = 0.0 if drive.motor is None else drive.off_from
        rest = next((event.time for event in reversed(solution.events) if event.kind == "rest"), np.nan)
        if not off < rest:
            return []
        (begin, end), subject = solution.at(np.array([off, rest]))[0][i], f"run-down of {name}"
        return [
            Figure(f"{name}.run_down", subject, rest - off, "s", "until it rests"),
            Figure(f"{name}.run_down_way", subject, end - begin, "rad" if turns else "m", "on its way"),
        ]
    figures = DriveCourse.of(motion, solution, i).figures() if turns and solution.end > 0.0 else {}
    told = [
        ("steady_speed", "speed_mean", f"speed of {name}", "rad/s", "mean of the last turn"),
        ("starting_time", "starting_time", f"starting time of {name}", "s", f"to {STARTED:.0%} of that speed"),
        ("fluctuation", "fluctuation", f"coefficient of fluctuation of {name}", "1", "last turn"),
    ]
    return [
        Figure(f"{name}.{short}", subject, figures[key], unit, which)
        for key, short, subject, unit, which in told
        if np.isfinite(figures.get(key, np.nan))
    ]


# ---- measures ---------------------------------------------------------------------------------------------------

LONGER = "state a longer duration of the measure in the model; `trunnion simulate` with these values shows the motion"
TOLERANCE = 1e-10  # of the steps, relative: figures to 1e-7 and better, a coordinate being many turns


class MotionKernel(NumpyKernel):
    """The analysis, with the figures of motions in time."""

    def courses(self, values: Mapping[str, Number], time: Number) -> tuple[Curves, NDArray[np.int8]]:
        """As `NumpyKernel.courses`; a measure of a motion in time is one number a sample."""
        rows, status = super().courses(values, time)
        return rows | courses_in_time(self.run, self.measures, values, shape_of(values, time)), status


def not_steady(run: Run, measure: Measure) -> str:
    """Why a measure of a motion in time has no value."""
    duration = CYCLES * run.cycle.duration if measure.duration is None else measure.duration
    lasting = readable(duration, "s")
    return f"within {lasting} {measure.subject} does not come to run steadily, or its motion ends before"


def courses_in_time(
    run: Run, measures: Iterable[Measure], values: Mapping[str, Number], shape: tuple[int, ...]
) -> dict[str, tuple[Number, ...]]:
    """Those measures that are of a motion in time, by name: one number a sample, to broadcast to the shape."""
    in_time = [measure for measure in measures if measure.in_time]
    motions = {
        motion: _numbers_in_time(run, *motion, values, shape)
        for motion in dict.fromkeys((measure.subject, measure.duration) for measure in in_time)
    }
    return {measure.name: (motions[measure.subject, measure.duration][measure.kind],) for measure in in_time}


def _numbers_in_time(
    run: Run, driver: str, duration: float | None, values: Mapping[str, Number], shape: tuple[int, ...]
) -> dict[str, Number]:
    """What `figures_in_time` tells, one number a sample, with derivatives where values are dual."""
    count = shape[0] if len(shape) == 2 else 1
    column = (count, 1) if len(shape) == 2 else (1,)
    step, dual = step_of(run, values, count), any(isinstance(value, Dual) for value in values.values())

    def figures(steps: float) -> dict[str, Array]:
        """Of mechanisms that are moved along their derivatives; a search asks for the same measure by measure."""
        moved = {
            path: primal(value) + steps * step * derivative(value) if isinstance(value, Dual) else value
            for path, value in values.items()
        }
        key = driver, duration, *((path, np.asarray(value, float).tobytes()) for path, value in moved.items())
        of = run.once(key, lambda: figures_in_time(run, driver, moved, count, duration))
        return {name: figure.reshape(column) for name, figure in of.items()}

    middle = figures(0.0)
    if not dual:
        return dict(middle)
    below, above = figures(-1.0), figures(1.0)
    return {name: Dual(middle[name], (above[name] - below[name]) / (2.0 * step.reshape(column))) for name in middle}


@np.errstate(all="ignore")
def figures_in_time(
    run: Run, driver: str, values: Values, count: int, duration: float | None = None, tolerance: float = TOLERANCE
) -> dict[str, Array]:
    """Every figure of `FIGURES` of a free driver, (sample,); NaN of a motion that has none.

    values: of the mechanism, (sample, 1) or (1, 1) where they vary; duration: s, ten cycles of the stated motion if not
    given. A motion that cannot begin, or that ends before its time because it can go no farther, has no figures.
    """
    duration = CYCLES * run.cycle.duration if duration is None else duration
    varied = frozenset(path for path, value in values.items() if np.ndim(value) == 2)
    codes: Codes = run.once("machine code of motions", dict)
    figures = {name: np.full(count, np.nan) for name in FIGURES}
    for i in range(count):
        alone = {
            path: float(value[i if len(value) > 1 else 0, 0]) if path in varied else single(value)
            for path, value in values.items()
        }
        try:
            motion = FreeMotion.of(Run(run.system, alone, run.system.cycle(alone), run.chosen))
            load_places, row = places(motion), initial_row(motion)
            limits = load_places.limits.items()
            if any(not low <= row[motion.names.index(name)] <= high for name, (low, high) in limits):
                continue
            rates = rates_of(motion, codes, varied)
            solution = integrator_of(motion)(motion, rates, duration, tolerance, load_places).run(row)
        except MechanismError:
            continue
        if solution.ended is None and solution.stretches:
            course = DriveCourse.of(motion, solution, motion.names.index(driver))
            for name, figure in course.figures().items():
                figures[name][i] = figure
    return figures
