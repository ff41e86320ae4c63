"""Corners and jumps of the model's signals, which the resampling of measured data rounds off.

A value at a position is the mean of the samples about it, or lies on a cubic through four of them (`reading.turns`).
Where a signal is smooth that is its value there; at the point of a load table or the end of a `between` it is not: a
change of slope by d per position is rounded off by up to d/8. With many turns that is far more than the scatter, the
same in every turn, and would be taken for the effect of a parameter.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["corners"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Places = NDArray[np.intp]
ROUNDED = 1 / 8  # of a change of slope per position: the mean of |x|/2 over a position, at its corner
TOO_MUCH = 0.25  # of the standard uncertainty of the mean: what is rounded off by more is left out
STANDS_OUT = 1.5  # times the second differences nearby, by which a corner differs from a curve
NEAR, FAR = 2, 7  # positions from a corner, between which the signal is looked at for them
MOST = 1 / 3  # of the positions, that are left out at corners: of a table of very many points the largest only


def corners(
    value: Array, phase: Array, bends: Array, uncertainty: Array, taken: Mask, *, closed: bool, guard: int
) -> Mask:
    """The positions before and after each corner or jump that is rounded off by more than the data hide.

    value, phase, uncertainty: (position,), the model's signal, the share of the cycle, the standard uncertainty of the
    measured mean; bends: shares of the cycle at which the model may bend or jump; taken: (position,), where it is known
    to jump already; closed: whether the cycle repeats; guard: positions that will be left out on each side.
    """
    size = len(value)
    found = np.zeros(size, bool)
    if size < 2 * FAR or not bends.size:
        return found
    bend = np.abs(np.roll(value, -1) - 2 * value + np.roll(value, 1))
    if not closed:
        bend[[0, -1]] = 0.0
    order = np.argsort(phase)
    before = np.searchsorted(phase[order], bends + CLOSE, side="right") - 1  # at the bend, or the last before it
    before = order[before % size] if closed else before
    rounded: list[tuple[float, Places]] = []
    for place in np.unique(before if closed else before[(before >= 0) & (before < size)]):
        at = _there(place + np.arange(2), size, closed)
        if np.any(taken[at]):
            continue
        nearby = bend[_there(place + BESIDE, size, closed)]
        nearby = nearby[np.isfinite(nearby)]
        level = float(np.median(nearby)) if nearby.size else 0.0
        peak = float(np.max(np.nan_to_num(bend[at])))
        off = ROUNDED * (peak - level) / max(float(np.min(uncertainty[at])), 1e-300)
        if peak > STANDS_OUT * level and off > TOO_MUCH:
            rounded.append((off, at))
    rounded.sort(key=lambda one: -one[0])
    for _, at in rounded[: max(1, int(MOST * size / (2 * max(guard, 1))))]:
        found[at] = True
    return found


def _there(places: Places, size: int, closed: bool) -> Places:
    """Places of a cycle that repeats, or those that a range has."""
    return places % size if closed else places[(places >= 0) & (places < size)]


CLOSE = 1e-9  # of the cycle: a bend at a position
BESIDE = np.concatenate([np.arange(-FAR, 1 - NEAR), np.arange(NEAR + 1, FAR + 2)])
