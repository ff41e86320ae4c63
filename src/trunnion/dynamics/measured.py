"""Measures of a motion in time: starting time, steady speed, coefficient of fluctuation, largest effort.

They have no course over a cycle. Of dual numbers the derivatives are central differences of the motions themselves.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, derivative, primal, single
from trunnion.algebra.namespace import Number
from trunnion.dynamics.compiled_rates import Codes, rates_of
from trunnion.dynamics.impact_motion import integration_of
from trunnion.dynamics.start import CYCLES, initial_row, places
from trunnion.dynamics.started import FIGURES, DriveCourse
from trunnion.dynamics.state import FreeMotion
from trunnion.errors import MechanismError
from trunnion.measures.evaluation import Curves, NumpyKernel, shape_of, step_of
from trunnion.measures.measures import Measure
from trunnion.results.quantities import readable
from trunnion.solve.run import Run
from trunnion.solve.system import Values

__all__ = ["LONGER", "MotionKernel", "courses_in_time", "figures_in_time", "not_steady", "numbers_in_time"]

Array = NDArray[np.float64]

LONGER = "state a longer duration of the measure in the model; `trunnion simulate` with these values shows the motion"
TOLERANCE = 1e-10  # of the steps, relative: figures to 1e-7 and better, a coordinate being many turns
FEW = 256  # samples of which figures are kept


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
        motion: numbers_in_time(run, *motion, values, shape)
        for motion in dict.fromkeys((measure.subject, measure.duration) for measure in in_time)
    }
    return {measure.name: (motions[measure.subject, measure.duration][measure.kind],) for measure in in_time}


@np.errstate(all="ignore")
def numbers_in_time(
    run: Run, driver: str, duration: float | None, values: Mapping[str, Number], shape: tuple[int, ...]
) -> dict[str, Number]:
    """What `figures_in_time` tells, one number a sample, with derivatives where values are dual."""
    count = shape[0] if len(shape) == 2 else 1
    column = (count, 1) if len(shape) == 2 else (1,)
    plain = {path: _column(primal(value), count) for path, value in values.items()}
    slopes = {
        path: np.broadcast_to(np.asarray(derivative(value), float), (count, 1))
        for path, value in values.items()
        if isinstance(value, Dual)
    }
    if not slopes:
        figures = _known(run, driver, plain, count, duration)
        return {name: figure.reshape(column) for name, figure in figures.items()}
    step = step_of(run, values, count)
    moved = np.flatnonzero(np.any(np.array(list(slopes.values())) != 0.0, axis=(0, 2)))

    def tried(value: Number, slope: Array | None) -> Number:
        """A number of every row, and of those moved up and down."""
        if slope is None and not np.ndim(value):
            return value
        full = np.broadcast_to(value, step.shape)
        change = 0.0 if slope is None else (slope * step)[moved]
        return np.concatenate([full, full[moved] + change, full[moved] - change])

    rows = {path: tried(value, slopes.get(path)) for path, value in plain.items()}
    numbers: dict[str, Number] = {}
    for name, figure in _known(run, driver, rows, count + 2 * len(moved), duration).items():
        change = np.zeros(count)
        above, below = figure[count:].reshape(2, len(moved))
        change[moved] = (above - below) / (2.0 * np.ravel(step[moved]))
        numbers[name] = Dual(figure[:count].reshape(column), change.reshape(column))
    return numbers


def _known(run: Run, driver: str, values: Mapping[str, Number], count: int, duration: float | None) -> dict[str, Array]:
    """`figures_in_time`; those of few samples are kept, as a search asks for the same ones measure by measure."""
    if count > FEW:
        return figures_in_time(run, driver, values, count, duration)
    numbers = tuple((path, np.asarray(value, float).tobytes()) for path, value in values.items())
    key = "figures in time", driver, duration, count, numbers
    return run.once(key, lambda: figures_in_time(run, driver, values, count, duration))


def _column(value: Number, count: int) -> Number:
    """A number of every sample, (sample, 1), or of all."""
    return np.broadcast_to(np.asarray(value, float), (count, 1)) if np.size(value) > 1 else single(value)


@np.errstate(all="ignore")
def figures_in_time(
    run: Run, driver: str, values: Values, count: int, duration: float | None = None, tolerance: float = TOLERANCE
) -> dict[str, Array]:
    """Every figure of `started.FIGURES` of a free driver, (sample,); NaN of a motion that has none.

    values: of the mechanism, (sample, 1) where they vary; duration: s, ten cycles of the stated motion if not given.
    A motion that cannot begin, or that ends before its time because it can go no farther, has no figures.
    """
    duration = CYCLES * run.cycle.duration if duration is None else duration
    varied = frozenset(path for path, value in values.items() if np.ndim(value) == 2)
    codes: Codes = run.once("machine code of motions", dict)
    figures = {name: np.full(count, np.nan) for name in FIGURES}
    for i in range(count):
        alone = {path: float(value[i, 0]) if path in varied else value for path, value in values.items()}
        try:
            motion = FreeMotion.of(Run(run.system, alone, run.system.cycle(alone), run.chosen))
            load_places, row = places(motion), initial_row(motion)
            limits = load_places.limits.items()
            if any(not low <= row[motion.names.index(name)] <= high for name, (low, high) in limits):
                continue
            rates = rates_of(motion, codes, varied)
            solution = integration_of(motion, rates, load_places, duration, tolerance).run(row)
        except MechanismError:
            continue
        if solution.ended is None and solution.stretches:
            course = DriveCourse.of(motion, solution, motion.names.index(driver))
            for name, figure in course.figures().items():
                figures[name][i] = figure
    return figures
