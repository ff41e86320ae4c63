"""The yield of normal deviations: a normal probability of a polytope.

With the deviations in polar form its radius is integrated exactly (chi distribution) and its direction by a Sobol
sequence (I. Deák, Three digit accurate multiple normal probabilities, Numerische Mathematik 35 (1980) 369–380). Rows of
one measure at neighbouring positions fail together, so this is far closer than the sum of their failures (Bonferroni).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtr, ndtr, ndtri

from trunnion.statistics.streams import SobolStream, factor
from trunnion.studies.allocation.problem import AllocationProblem

__all__ = ["by_measure", "failing", "normal_yield", "plain_yield", "spread_and_room"]

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
DIRECTIONS = 2048
ROWS = 128  # worked on at once
FAR = 6.0  # standard deviations: a row with more room than that never fails


def normal_yield(problem: AllocationProblem, tolerances: Array, own: Rows | None = None) -> float:
    """Share of mechanisms within all limits, for normal deviations and linear rows; own: of these rows alone.

    The row of each measure that fails most is reckoned exactly, and the directions only say what the others add, and
    how many mechanisms break several at once.
    """
    sigma, room = spread_and_room(problem, tolerances)
    owner = np.zeros(len(sigma), np.intp)
    for k, rows in enumerate(by_measure(problem).values()):
        owner[rows] = k
    if own is not None:
        sigma, room, owner = sigma[own], room[:, own], owner[own]
    each = np.sqrt(np.sum(sigma**2, axis=1))
    still = each == 0
    if np.any(room[:, still] < 0):
        return 0.0
    rows = np.flatnonzero((np.min(room, axis=0) < FAR * each) & ~still)
    parts = np.flatnonzero(np.any(sigma[rows] != 0, axis=0))
    if not len(rows):
        return 1.0
    fails = np.sum(ndtr(-room[:, rows] / each[rows]), axis=0)
    share = _within(sigma[np.ix_(rows, parts)], room[:, rows])
    for k in np.unique(owner[rows]):
        of = np.flatnonzero(owner[rows] == k)
        worst = of[int(np.argmax(fails[of]))]
        one = rows[worst : worst + 1]
        share += 1 - fails[worst] - _within(sigma[np.ix_(one, parts)], room[:, one])
    return float(np.clip(share, 0.0, 1.0))


def failing(problem: AllocationProblem, tolerances: Array) -> dict[str, float]:
    """Share of mechanisms that break the limits of each measure, by the label of its rows."""
    return {label: 1 - normal_yield(problem, tolerances, rows) for label, rows in by_measure(problem).items()}


def by_measure(problem: AllocationProblem) -> dict[str, Rows]:
    """Rows of each label, (row,); all, by an empty one, where rows have no labels."""
    labels = np.array(problem.effects.labels or [""] * len(problem.effects.worst))
    return {name: np.flatnonzero(labels == name) for name in dict.fromkeys(labels.tolist())}


def spread_and_room(problem: AllocationProblem, tolerances: Array) -> tuple[Array, Array]:
    """Deviation of each row by independent numbers (row, part), and its room to both sides (side, row)."""
    effects = problem.effects
    sigma = effects.sigma() * tolerances
    if effects.correlation is not None:
        sigma = sigma @ factor(effects.correlation)
    middle = effects.middle() + effects.drift() @ tolerances
    return sigma, np.stack([effects.upper - middle, middle - effects.lower])


def plain_yield(problem: AllocationProblem, tolerances: Array) -> float:
    """The yield by the directions alone: less exact, but it changes steadily with the rooms."""
    sigma, room = spread_and_room(problem, tolerances)
    parts = np.flatnonzero(np.any(sigma != 0, axis=0))
    return _within(sigma[:, parts], room) if len(parts) else 1.0


def _within(sigma: Array, room: Array) -> float:
    """Share of the directions' rays that lies within all rows: sigma (row, part), room (side, row)."""
    dims = sigma.shape[1]
    directions = _directions(dims)
    first, last = np.zeros(directions.shape[1]), np.full(directions.shape[1], np.inf)
    for start in range(0, len(sigma), ROWS):
        part = slice(start, start + ROWS)
        along = sigma[part] @ directions
        for slope, free in ((along, room[0, part, None]), (-along, room[1, part, None])):
            with np.errstate(divide="ignore", invalid="ignore"):
                radius = free / slope
            last = np.minimum(last, np.min(np.where(slope > 0, radius, np.inf), axis=0))
            if np.any(free < 0):
                first = np.maximum(first, np.max(np.where(slope < 0, radius, -np.inf), axis=0))
    inside = chdtr(dims, np.maximum(last, 0.0) ** 2) - chdtr(dims, first**2)
    return float(np.mean(np.where(last > first, inside, 0.0)))


@lru_cache(maxsize=8)
def _directions(dims: int) -> Array:
    """Unit vectors, each with its opposite, (component, direction)."""
    if dims == 1:
        return np.array([[1.0, -1.0]])
    points = ndtri(SobolStream(seed=0, replicate=0, dims=dims).points(0, DIRECTIONS // 2))
    points = points / np.sqrt(np.sum(points**2, axis=0))
    return np.concatenate([points, -points], axis=1)
