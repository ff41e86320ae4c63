"""Variance-based sensitivity: which share of the scatter of a measure each number makes, alone and with the others.

First order S_i = V(E(y | p_i))/V(y), total S_Ti = 1 − V(E(y | all but p_i))/V(y), by `scipy.stats.sobol_indices`
(estimators of A. Saltelli et al., Comput. Phys. Commun. 181 (2010) 259-270, doi:10.1016/j.cpc.2009.09.018) on scrambled
Sobol points, with percentile intervals by bootstrap. The two
coordinates of a pin in its hole, and the size and direction of a run-out, count as one number each.
"""

from __future__ import annotations

import warnings
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError
from trunnion.statistics.draws import sobol
from trunnion.studies.tolerance.sampling import Sampler

__all__ = ["Indices", "indices"]

Array = NDArray[np.float64]
BOOTSTRAPS = 200
LEAST, MOST = 64, 1 << 16


class Indices(NamedTuple):
    """First and total order, (measure, parameter), with the ends of their 95 % intervals, by the names of the result.

    lost: samples without an answer.
    """

    arrays: dict[str, Array]
    lost: int


def indices(sampler: Sampler, samples: int, seed: int) -> Indices:
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
    u = sobol(seed, 0, 2 * inputs.dims, 0, base)
    first, two = u[: inputs.dims], u[inputs.dims :]

    def analysed(points: Array) -> Array:
        size = sampler.job.block_size
        with np.errstate(all="ignore"):
            parts = [sampler.figures(points[:, low : low + size]) for low in range(0, points.shape[1], size)]
        return np.concatenate([part["figure"] for part in parts], axis=1)

    y_one, y_two = analysed(first), analysed(two)
    mixed = np.empty((len(parts), *y_one.shape))
    for i, rows in enumerate(parts):
        points = first.copy()
        points[rows] = two[rows]
        mixed[i] = analysed(points)
    lost = int(sum(np.count_nonzero(np.any(np.isnan(y), axis=0)) for y in (y_one, y_two, *mixed)))
    shares_of = _indices(_filled(y_one), _filled(y_two), _filled(mixed), seed, lost)
    for shares in shares_of.arrays.values():  # of a measure without a single answer
        shares[np.all(np.isnan(y_one) & np.isnan(y_two), axis=1)] = np.nan
    return shares_of


def _indices(y_one: Array, y_two: Array, mixed: Array, seed: int, lost: int) -> Indices:
    """Both orders with percentile intervals: scipy's own bootstrap cannot be given a seed."""
    from scipy.stats import sobol_indices  # takes longer to import than the rest

    base, rows = y_one.shape[-1], [*range(len(y_one)), 0]  # scipy fails for one measure of one number: never one
    y_one, y_two, mixed = y_one[rows], y_two[rows], mixed[:, rows]
    shape = len(rows), len(mixed)

    def both(points: Any) -> Array:
        parts = {"f_A": y_one[..., points], "f_B": y_two[..., points], "f_AB": mixed[..., points]}
        orders = sobol_indices(func=parts, n=base)
        return np.array([np.reshape(order, shape)[:-1] for order in (orders.first_order, orders.total_order)])

    rng = np.random.Generator(np.random.Philox(seed))
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a measure that nothing moves has no shares: NaN
        index = both(slice(None))
        drawn = np.array([both(rng.integers(base, size=base)) for _ in range(BOOTSTRAPS)])
        low, high = np.nanquantile(drawn, [0.025, 0.975], axis=0)
    ends = ("", index), ("_low", low), ("_high", high)
    return Indices(
        {
            f"{order}_order{name}": np.where(np.isnan(end[k]), index[k], end[k])  # the index where nothing scatters
            for k, order in enumerate(("first", "total"))
            for name, end in ends
        },
        lost,
    )


def _filled(y: Array) -> Array:
    """Without gaps: the mean of the rest in their place."""
    count = np.sum(~np.isnan(y), axis=-1, keepdims=True)
    return np.where(np.isnan(y), np.nansum(y, axis=-1, keepdims=True) / np.maximum(count, 1), y)
