"""True courses of a working condition: what the model does at the instants at which a rig samples.

Where sampling rate and cycle are commensurate, samples fall on the same phases again and again: the model is solved
once at each of these.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.positions import positions
from trunnion.errors import Status
from trunnion.measures.evaluation import courses_of
from trunnion.measures.measures import Measure
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run

__all__ = ["SampledSignals", "cycle_efficiency", "phases", "sampled"]

Array = NDArray[np.float64]
EFFICIENCY_STEPS = 720
CHUNK = 8_192  # instants at once: memory and cache
DIGITS = 12  # of a share of the cycle, in which instants that are one agree


@dataclass(frozen=True)
class SampledSignals:
    """The courses of one condition, SI.

    time: ascending instants of the cycle, s; values: (measure, instant); status: of the instants; place: of each sample
    of the run among them.
    """

    time: Array
    values: Array
    status: NDArray[np.int8]
    place: NDArray[np.intp]

    def at_samples(self, i: int) -> Array:
        """The course of one measure at every sample."""
        return np.asarray(self.values[i][self.place])


def sampled(run: Run, measures: Sequence[Measure], rate: float, count: int, lead: float = 0.0) -> SampledSignals:
    """Solve the model at the samples of a rig.

    Parameters
    ----------
    run : a prepared mechanism.
    measures : what its sensors measure.
    rate, count : of the samples, Hz.
    lead : sampling intervals that the first of them lies before the start of the cycle.
    """
    if run.cycle.periodic:
        time, place = phases(run.cycle.duration, rate, count, lead)
    else:
        time, place = np.minimum((np.arange(count) - lead) / rate, run.cycle.duration), np.arange(count)
    return SampledSignals(time, *_solved(run, measures, time), place)


def phases(duration: float, rate: float, count: int, lead: float = 0.0) -> tuple[Array, NDArray[np.intp]]:
    """Distinct times (s) in the cycle of `count` samples, ascending, and the place of each sample among them.

    lead: how many sampling intervals the first comes before the start of the cycle.
    """
    share = np.round(np.mod((np.arange(count) - lead) / (duration * rate), 1.0), DIGITS) % 1.0
    distinct, place = np.unique(share, return_inverse=True)
    return distinct * duration, place


def _solved(run: Run, measures: Sequence[Measure], time: Array) -> tuple[Array, NDArray[np.int8]]:
    """Courses of measures at ascending times (s) of the cycle, with pins in their seats; status.

    Where a load or friction is an interval, at a speed of zero, a course is the mean of its neighbours; a load whose
    joint rests at several positions on end is 0 there: nothing moves against it.
    """
    alike, parts = list({one.name: one for one in measures}.values()), np.array_split(time, -(-len(time) // CHUNK))
    solved = [courses_of(run, alike, part, FrictionMethod()) for part in parts]
    status = np.concatenate([codes for _, codes in solved])
    rows = [
        [np.broadcast_to(np.asarray(curves[one.name][0], float), part.shape)
         for (curves, _), part in zip(solved, parts, strict=True)]
        for one in measures
    ]  # fmt: skip
    values = np.array([np.concatenate(row) for row in rows])
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
