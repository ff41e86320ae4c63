"""The share of the time that a curve is within a band: its dwell there.

Between two positions of which one is above an end of the band and one below, the time at which it crosses is that of
the cubic through the four nearest positions, which is off by O(h⁴), h the step. A curve that crosses and comes back
between two positions is not seen to have done so.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.namespace import Number
from trunnion.measures.extremes import Grid, shape_of

__all__ = ["share_within"]

Array = NDArray[np.float64]
NODES = 4
HALVINGS, NEWTONS = 6, 4


def share_within(curve: Number, grid: Grid, band: tuple[float, float]) -> Number:
    """Share of the time that a curve, (lane…, position), is within the band; NaN of lanes with a NaN.

    Of a dual number with its derivative: a crossing moves by −ẏ′/ẏ, the dual part over the slope.
    """
    low, high = band
    return _above(curve, grid, low) - _above(curve, grid, high)


def _above(curve: Number, grid: Grid, level: float) -> Number:
    """Share of the time that a curve is above a level."""
    shape = shape_of(curve)
    rows = np.broadcast_to(primal(curve), shape).reshape(-1, shape[-1]) - level
    gone = np.where(np.isnan(rows.sum(axis=1)), np.nan, 0.0)
    if not np.isfinite(level) or shape[-1] == 1:
        alone = (np.where(rows[:, 0] >= 0, 1.0, 0.0) + gone).reshape(shape[:-1])
        return Dual(alone, 0.0 * alone) if isinstance(curve, Dual) else alone
    nodes, spots, step = _gaps(grid)
    ends = rows[:, nodes[0]], rows[:, nodes[1]]
    share = np.where((ends[0] >= 0) & (ends[1] >= 0), 1.0, 0.0)
    lane, gap = np.nonzero((ends[0] >= 0) != (ends[1] >= 0))
    near = nodes[2:][:, gap]
    maps = np.linalg.inv(spots[gap][..., None] ** np.arange(near.shape[0]))
    powers = np.einsum("gij,gj->ig", maps, rows[lane[:, None], near.T])
    falls = ends[0][lane, gap] >= 0
    spot = _crossing(powers, falls)
    share[lane, gap] = np.where(falls, spot, 1 - spot)
    weights = step / step.sum()
    found = (share @ weights + gone).reshape(shape[:-1])
    if not isinstance(curve, Dual):
        return found
    slopes = np.broadcast_to(curve.dual, shape).reshape(-1, shape[-1])
    pushed = np.einsum("gij,gj->ig", maps, slopes[lane[:, None], near.T])
    moved = np.zeros(share.shape)
    moved[lane, gap] = _at(pushed, spot) / np.abs(_slope(powers, spot))
    return Dual(found, (moved @ weights + gone).reshape(shape[:-1]))


def _gaps(grid: Grid) -> tuple[NDArray[np.intp], Array, Array]:
    """Of every gap between two positions: both ends and the positions near it, places of these in it, its length."""
    count, near = len(grid.at), min(NODES, len(grid.at))
    if grid.period is None:
        first = np.arange(count - 1)
        found = np.clip(first - 1, 0, count - near)[:, None] + np.arange(near)
        ends, laps = np.array([first, first + 1]), np.zeros_like(found)
    else:
        first = np.arange(count)
        found = first[:, None] + np.arange(near) - (near - 1) // 2
        ends, laps = np.array([first, (first + 1) % count]), found // count
    step = np.diff(grid.at) if grid.period is None else np.diff(np.append(grid.at, grid.at[0] + grid.period))
    places = grid.at[found % count] + laps * (grid.period or 0.0) - grid.at[first][:, None]
    return np.concatenate([ends, (found % count).T]), places / step[:, None], step


def _crossing(powers: Array, falls: NDArray[np.bool_]) -> Array:
    """Where in its gap, from 0 to 1, a polynomial passes zero, from above to below if it falls."""
    low, high = np.zeros(powers.shape[1]), np.ones(powers.shape[1])
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        before = (_at(powers, middle) >= 0) == falls
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    spot = 0.5 * (low + high)
    for _ in range(NEWTONS):
        slope = _slope(powers, spot)
        spot = np.clip(spot - _at(powers, spot) / np.where(slope == 0, np.inf, slope), low, high)
    return spot


def _at(powers: Array, spot: Array) -> Array:
    found = np.zeros_like(spot)
    for coefficient in powers[::-1]:
        found = found * spot + coefficient
    return found


def _slope(powers: Array, spot: Array) -> Array:
    return _at(powers[1:] * np.arange(1, len(powers))[:, None], spot)
