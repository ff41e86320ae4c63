"""Variance-based sensitivity: which share of the scatter of a measure each number makes, alone and with the others.

First order S_i = V(E(y | p_i))/V(y), total S_Ti = 1 − V(E(y | all but p_i))/V(y), by `scipy.stats.sobol_indices`
(estimators of A. Saltelli et al., Comput. Phys. Commun. 181 (2010) 259-270, doi:10.1016/j.cpc.2009.09.018) on scrambled
Sobol points, with intervals by bootstrap. The two
coordinates of a pin in its hole, and the size and direction of a run-out, count as one number each.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trunnion.analysis.tolerance.sampling import Sampler
from trunnion.errors import Finding, MechanismError
from trunnion.statistics.streams import SobolStream

__all__ = ["Indices", "indices"]

Array = NDArray[np.float64]
BOOTSTRAPS = 200
LEAST, MOST = 64, 1 << 16


@dataclass(frozen=True)
class Indices:
    """First and total order, (measure, parameter), with the ends of their 95 % intervals; base: points of a matrix."""

    first: Array
    first_low: Array
    first_high: Array
    total: Array
    total_low: Array
    total_high: Array
    base: int
    lost: int


def indices(sampler: Sampler, samples: int, seed: int, progress: Callable[[int], None] | None = None) -> Indices:
    """Sobol' indices of every measure by about so many samples in all. Raises MechanismError where they mean nothing.

    Of correlated numbers there is no such share. Samples without an answer are set to the mean of the others.
    """
    inputs = sampler.inputs
    correlation = inputs.population.correlation
    if not np.array_equal(correlation, np.eye(len(correlation))):
        what = "variance-based indices are of independent numbers, and some are correlated"
        raise MechanismError(Finding(what, "correlations", "leave out --method sobol, or the correlations"))
    parts = inputs.parts
    base = min(max(1 << (max(1, samples // (len(parts) + 2)).bit_length() - 1), LEAST), MOST)
    u = SobolStream(seed, 0, 2 * inputs.dims).points(0, base)
    one, two = u[: inputs.dims], u[inputs.dims :]
    done = 0

    def analysed(points: Array) -> Array:
        nonlocal done
        size = sampler.job.block_size
        found = np.empty((len(sampler.job.measures), points.shape[1]))
        for low in range(0, points.shape[1], size):
            with np.errstate(all="ignore"):
                found[:, low : low + size] = sampler.figures(points[:, low : low + size])[0]
            done += min(size, points.shape[1] - low)
            if progress:
                progress(done)
        return found

    y_one, y_two = analysed(one), analysed(two)
    mixed = np.empty((len(parts), *y_one.shape))
    for i, rows in enumerate(parts):
        points = one.copy()
        points[rows] = two[rows]
        mixed[i] = analysed(points)
    lost = int(sum(np.count_nonzero(np.any(np.isnan(y), axis=0)) for y in (y_one, y_two, *mixed)))
    from scipy.stats import sobol_indices  # takes longer to import than the rest

    parts_of = {"f_A": _filled(y_one), "f_B": _filled(y_two), "f_AB": _filled(mixed)}
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a number without any effect has no scatter to draw from: NaN
        found = sobol_indices(func=parts_of, n=base)
        spread = found.bootstrap(confidence_level=0.95, n_resamples=BOOTSTRAPS)
    first, total = spread.first_order.confidence_interval, spread.total_order.confidence_interval
    shape = len(y_one), len(parts)  # of one measure scipy leaves out the axis
    ends = [
        _closed(end, own)
        for end, own in zip(
            (first.low, first.high, total.low, total.high),
            (found.first_order,) * 2 + (found.total_order,) * 2,
            strict=True,
        )
    ]
    arrays = (found.first_order, *ends[:2], found.total_order, *ends[2:])
    one, one_low, one_high, all_, all_low, all_high = (np.reshape(array, shape) for array in arrays)
    return Indices(one, one_low, one_high, all_, all_low, all_high, base, lost)


def _closed(end: Array, index: Array) -> Array:
    """An end of an interval, the index itself where nothing scatters."""
    return np.where(np.isnan(end), index, end)


def _filled(y: Array) -> Array:
    """Without gaps: the mean of the rest in their place."""
    with np.errstate(all="ignore"):
        mean = np.nan_to_num(np.nanmean(y, axis=-1, keepdims=True)) if np.any(np.isnan(y)) else 0.0
    return np.where(np.isnan(y), mean, y)
