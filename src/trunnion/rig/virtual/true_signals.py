"""True courses of a working condition: what the model does at the instants at which a rig samples.

Where sampling rate and cycle are commensurate within the recorded cycles, samples fall on the same phases again and
again: the model is solved at exactly these. Where that is not so, or there are more than MOST_EXACT, it is solved on a
fine grid of the cycle and interpolated between, if that is finer than the sensors tell; else at every sample.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.positions import positions
from trunnion.errors import Status
from trunnion.measures.measures import Measure
from trunnion.solve.backward import Backward
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run
from trunnion.solve.seating import seating_of
from trunnion.solve.status import status_of

__all__ = ["MOST_EXACT", "SampledSignals", "Solved", "cycle_efficiency", "phases", "sampled", "solved"]

Array = NDArray[np.float64]

MOST_EXACT = 20_000  # instants at which a model is solved without asking
GRID, FINEST = 8_192, 131_072  # positions of the cycle to interpolate between
CHUNK = 8_192
EFFICIENCY_STEPS = 720
ALIKE = 1e-6  # of a sample: instants nearer than that are one
WORST = 0.999  # share of the positions that the error of interpolation is told of: it has no bound at a jump


@dataclass(frozen=True)
class Solved:
    """Courses at some instants, SI: one row for each measure; mended: positions where a course has no single value."""

    values: Array
    status: NDArray[np.int8]
    mended: int = 0


def solved(run: Run, measures: Sequence[Measure], time: Array) -> Solved:
    """The courses of measures at ascending times (s) of the cycle, with pins in their seats.

    Where a load or friction is an interval, at a speed of zero, a course is the mean of its neighbours; a load whose
    joint rests at several positions on end is 0 there: nothing moves against it.
    """
    values = np.empty((len(measures), len(time)))
    status = np.empty(len(time), np.int8)
    for low in range(0, len(time), CHUNK):
        window = slice(low, min(low + CHUNK, len(time)))
        back, shape = _back(run, time[window]), time[window].shape
        status[window] = status_of(back, shape)
        with np.errstate(all="ignore"):
            for i, measure in enumerate(measures):
                values[i, window] = np.broadcast_to(measure.curve(back)[0], shape)
    values[:, status >= Status.NOT_CONVERGED] = np.nan
    mended: int = 0
    if not np.any(status >= Status.NOT_CONVERGED):
        gaps = ~np.isfinite(values)
        mended = len(np.flatnonzero(gaps.any(axis=0)))
        for row in np.flatnonzero(gaps.any(axis=1)).tolist():
            if measures[row].kind == "load":
                values[row, _rests(gaps[row], run.cycle.periodic)] = 0.0
            values[row] = _bridged(values[row], time, run.cycle.duration if run.cycle.periodic else None)
    return Solved(values, status, mended)


def _back(run: Run, time: Array) -> Backward:
    if not run.seats:
        return run.solve(time)
    method = FrictionMethod()
    return seating_of(run, method).at(time, method).back


def cycle_efficiency(run: Run) -> float:
    """Useful work over drive work of the cycle, of the model; NaN where the loads drive it."""
    return positions(run, EFFICIENCY_STEPS, margin=False).means.efficiency


def _rests(gaps: NDArray[np.bool_], periodic: bool) -> NDArray[np.bool_]:
    """Gaps of more than one position; those at the ends of a period are one."""
    before, after = np.roll(gaps, 1), np.roll(gaps, -1)
    if not periodic:
        before[0] = after[-1] = False
    found: NDArray[np.bool_] = gaps & (before | after)
    return found


def _bridged(row: Array, time: Array, period: float | None) -> Array:
    there = np.isfinite(row)
    if not np.any(there):
        return row
    found: Array = np.where(there, row, np.interp(time, time[there], row[there], period=period))
    return found


@dataclass(frozen=True)
class SampledSignals:
    """The courses of one condition at the samples of its run.

    values: (measure, instant) at `time`; place: of each sample among the instants, None to interpolate at `phase`;
    exact: whether every sample is an instant that was solved; error: of the interpolation, of each measure.
    """

    time: Array
    values: Array
    status: NDArray[np.int8]
    place: NDArray[np.intp] | None
    phase: Array
    period: float | None
    error: Array
    mended: int = 0

    @property
    def exact(self) -> bool:
        return self.place is not None

    def at_samples(self, i: int) -> Array:
        """The course of one measure at every sample."""
        if self.place is not None:
            return np.asarray(self.values[i][self.place])
        return np.asarray(np.interp(self.phase, self.time, self.values[i], period=self.period))


def phases(duration: float, rate: float, count: int, lead: float = 0.0) -> tuple[Array, NDArray[np.intp]] | None:
    """Distinct times (s) in the cycle of `count` samples, ascending, and the place of each sample among them.

    lead: how many sampling intervals the first comes before the start of the cycle. None if samples never fall on the
    same phases again.
    """
    per_cycle = duration * rate
    for cycles in range(1, int(count / per_cycle) + 2):
        whole = round(cycles * per_cycle)
        if whole and abs(cycles * per_cycle - whole) < ALIKE * max(cycles, 1):
            # sample k is at (k − lead)·cycles/whole of a cycle, k·cycles mod whole of them after the first
            number, place = np.unique((np.arange(count, dtype=np.int64) * cycles) % whole, return_inverse=True)
            time = np.mod((number - lead * cycles) / whole, 1.0) * duration
            order = np.argsort(time)
            return time[order], np.argsort(order)[place]
    return None


def sampled(
    run: Run,
    measures: Sequence[Measure],
    rate: float,
    count: int,
    lead: float = 0.0,
    tolerances: Mapping[int, float] | None = None,
) -> SampledSignals:
    """The courses at `count` samples at a rate (Hz), the first `lead` sampling intervals before the start of the cycle.

    tolerances: of each measure by its place, SI: how far interpolation may be off.
    """
    duration = run.cycle.duration
    time: Array = np.asarray((np.arange(count) - lead) / rate, float)
    if not run.cycle.periodic:
        time = np.minimum(time, duration)
        found = (time, np.arange(count))
    else:
        found = phases(duration, rate, count, lead) or _sorted(np.mod(time, duration))
    instants, place = found
    period = duration if run.cycle.periodic else None
    if len(instants) > MOST_EXACT and run.cycle.periodic:
        between = _interpolated(run, measures, np.mod(time, duration), tolerances or {})
        if between is not None:
            return between
    answer = solved(run, measures, instants)
    none = np.zeros(len(measures))
    return SampledSignals(instants, answer.values, answer.status, place, time, period, none, answer.mended)


def _sorted(time: Array) -> tuple[Array, NDArray[np.intp]]:
    used, place = np.unique(time, return_inverse=True)
    return used, place


def _interpolated(
    run: Run, measures: Sequence[Measure], phase: Array, tolerances: Mapping[int, float]
) -> SampledSignals | None:
    """The courses between positions of a grid; None if no grid is fine enough."""
    duration = run.cycle.duration
    grid = GRID
    while grid <= FINEST:
        time: Array = np.linspace(0.0, duration, grid, endpoint=False)
        answer = solved(run, measures, time)
        error = np.array([_error(row, time, duration) for row in answer.values])
        fine = all(not error[i] > limit for i, limit in tolerances.items() if limit > 0)
        if fine or np.any(answer.status >= Status.NOT_CONVERGED):
            return SampledSignals(time, answer.values, answer.status, None, phase, duration, error, answer.mended)
        grid *= 4
    return None


def _error(row: Array, time: Array, duration: float) -> float:
    """Error of straight lines between the positions: a quarter of that between every other one, at its middle."""
    middle = np.interp(time[1::2], time[::2], row[::2], period=duration)
    return float(np.quantile(np.abs(middle - row[1::2]), WORST)) / 4
