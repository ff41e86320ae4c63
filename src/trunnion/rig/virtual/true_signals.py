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
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run
from trunnion.solve.seating import seating_of
from trunnion.solve.status import status_of

__all__ = ["MOST_EXACT", "SampledSignals", "cycle_efficiency", "phases", "sampled"]

Array = NDArray[np.float64]
MOST_EXACT = 20_000  # instants at which a model is solved without asking
GRID, FINEST = 8_192, 131_072  # positions of the cycle to interpolate between
CHUNK = 8_192
EFFICIENCY_STEPS = 720
DIGITS = 12  # of a share of the cycle, in which instants that are one agree
WORST = 0.999  # share of the positions that the error of interpolation is told of: it has no bound at a jump


@dataclass(frozen=True)
class SampledSignals:
    """The courses of one condition at the samples of its run, SI.

    values: (measure, instant) at `time`; place: of each sample among the instants, None to interpolate at `phase`.
    """

    time: Array
    values: Array
    status: NDArray[np.int8]
    place: NDArray[np.intp] | None
    phase: Array
    period: float | None

    @property
    def exact(self) -> bool:
        """Whether every sample is an instant that was solved."""
        return self.place is not None

    def at_samples(self, i: int) -> Array:
        """The course of one measure at every sample."""
        if self.place is not None:
            return np.asarray(self.values[i][self.place])
        return np.asarray(np.interp(self.phase, self.time, self.values[i], period=self.period))


def sampled(
    run: Run,
    measures: Sequence[Measure],
    rate: float,
    count: int,
    lead: float = 0.0,
    tolerances: Mapping[int, float] | None = None,
) -> SampledSignals:
    """Solve the model at the samples of a rig.

    Parameters
    ----------
    run : a prepared mechanism.
    measures : what its sensors measure.
    rate, count : of the samples, Hz.
    lead : sampling intervals that the first of them lies before the start of the cycle.
    tolerances : of each measure by its place, SI: how far interpolation may be off.
    """
    duration, periodic = run.cycle.duration, run.cycle.periodic
    time: Array = np.asarray((np.arange(count) - lead) / rate, float)
    if not periodic:
        instants, place = np.minimum(time, duration), np.arange(count)
    else:
        instants, place = phases(duration, rate, count, lead)
    if periodic and len(instants) > MOST_EXACT:
        grid = GRID
        while grid <= FINEST:
            at = np.linspace(0.0, duration, grid, endpoint=False)
            values, status = _solved(run, measures, at)
            limits = {i: limit for i, limit in (tolerances or {}).items() if limit > 0}
            fine = all(not _error(values[i], at, duration) > limit for i, limit in limits.items())
            if fine or np.any(status >= Status.NOT_CONVERGED):
                return SampledSignals(at, values, status, None, np.mod(time, duration), duration)
            grid *= 4
    return SampledSignals(instants, *_solved(run, measures, instants), place, time, duration if periodic else None)


def phases(duration: float, rate: float, count: int, lead: float = 0.0) -> tuple[Array, NDArray[np.intp]]:
    """Distinct times (s) in the cycle of `count` samples, ascending, and the place of each sample among them.

    lead: how many sampling intervals the first comes before the start of the cycle.
    """
    share = np.round(np.mod((np.arange(count) - lead) / (duration * rate), 1.0), DIGITS) % 1.0
    distinct, place = np.unique(share, return_inverse=True)
    return distinct * duration, place


def _error(row: Array, time: Array, duration: float) -> float:
    """Error of straight lines between the positions: a quarter of that between every other one, at its middle."""
    middle = np.interp(time[1::2], time[::2], row[::2], period=duration)
    return float(np.quantile(np.abs(middle - row[1::2]), WORST)) / 4


def _solved(run: Run, measures: Sequence[Measure], time: Array) -> tuple[Array, NDArray[np.int8]]:
    """Courses of measures at ascending times (s) of the cycle, with pins in their seats; status.

    Where a load or friction is an interval, at a speed of zero, a course is the mean of its neighbours; a load whose
    joint rests at several positions on end is 0 there: nothing moves against it.
    """
    values, status = np.empty((len(measures), len(time))), np.empty(len(time), np.int8)
    method = FrictionMethod()
    for low in range(0, len(time), CHUNK):
        window = slice(low, min(low + CHUNK, len(time)))
        part = time[window]
        back = seating_of(run, method).at(part, method).back if run.seats else run.solve(part)
        status[window] = status_of(back, part.shape)
        with np.errstate(all="ignore"):
            for i, measure in enumerate(measures):
                values[i, window] = np.broadcast_to(measure.curve(back)[0], part.shape)
    lost = status >= Status.NOT_CONVERGED
    values[:, lost] = np.nan
    gaps = ~np.isfinite(values)
    if lost.any() or not gaps.any():
        return values, status
    for row in np.flatnonzero(gaps.any(axis=1)).tolist():
        if measures[row].kind == "load":
            before, after = np.roll(gaps[row], 1), np.roll(gaps[row], -1)
            if not run.cycle.periodic:
                before[0] = after[-1] = False
            values[row, gaps[row] & (before | after)] = 0.0  # of more than one position; at the ends of a period too
        known = np.isfinite(values[row])
        if known.any():
            period = run.cycle.duration if run.cycle.periodic else None
            values[row, ~known] = np.interp(time[~known], time[known], values[row, known], period=period)
    return values, status


def cycle_efficiency(run: Run) -> float:
    """Useful work over drive work of the cycle, of the model; NaN where the loads drive it."""
    return positions(run, EFFICIENCY_STEPS, margin=False).means.efficiency
