"""A misfit over a part of the cycle, which the share of all positions hides.

Windows of a twentieth to two fifths of the cycle are moved along it by half their width. A window counts where more
than half of its positions lie beyond ±U to the same side, and its mean residual beyond what the mean of a true model
reaches: u of the mean with the scatter of the means of the turns in the window, so with the correlation of its
positions, and Student's factor for CHANCE over the number of windows (Bonferroni). So a true model has such a stretch
in at most CHANCE of the courses; with three or four turns the factor is so large that hardly any is found.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from trunnion.rig.comparison.uncertainty import Uncertainty, at_positions, expanded, mean_expanded

__all__ = ["Stretch", "worst_stretch"]

Array = NDArray[np.float64]
WIDTHS = (0.05, 0.1, 0.2, 0.4)  # of the cycle
FEWEST = 3  # positions of a window
CHANCE = 0.01  # of the courses of a true model, at most, in which a stretch is found
FREEDOM = 4.0  # effective degrees of freedom for each of the turns, at most: few turns tell little of so rare a case
HALF = 0.5  # of a window's positions, beyond U to one side


class Stretch(NamedTuple):
    """Where a course lies beyond U: its positions in their order, their share of those compared, mean residual, and U.

    expanded: the mean U of these positions.
    """

    positions: tuple[int, ...]
    share: float
    mean: float
    expanded: float


def worst_stretch(
    residual: Array, of: Uncertainty, there: NDArray[np.bool_], coverage: float, closed: bool, rounding: float
) -> Stretch | None:
    """The stretch that lies farthest beyond what chance explains; None if there is none.

    residual, of: at all positions of the cycle; there: those that are compared; closed: whether the end of the cycle
    is next to its start; rounding: a difference that is none.
    """
    wide = expanded(of.total, of.freedom, coverage)
    known = there & np.isfinite(wide) & np.isfinite(residual)
    beyond = np.where(known & (np.abs(residual) > wide + rounding), np.sign(residual), 0.0)
    windows = list(_windows(len(residual), closed))
    found: tuple[float, NDArray[np.intp]] | None = None
    for window in windows:
        own = window[known[window]]
        if len(own) < max(FEWEST, HALF * len(window)) or abs(np.sum(beyond[own])) <= HALF * len(own):
            continue
        sure = float(ndtri(1 - CHANCE / 2 / len(windows)))
        ratio = abs(float(np.mean(residual[own]))) / (mean_expanded(at_positions(of, own), sure, FREEDOM) + rounding)
        if ratio > 1 and (found is None or ratio > found[0]):
            found = ratio, own
    if found is None:
        return None
    own = _grown(found[1], beyond, closed)
    share = len(own) / np.count_nonzero(known)
    return Stretch(tuple(own.tolist()), float(share), float(np.mean(residual[own])), float(np.mean(wide[own])))


def _windows(count: int, closed: bool) -> Iterator[NDArray[np.intp]]:
    """Positions of each window, in their order along the cycle."""
    for width in dict.fromkeys(max(FEWEST, round(part * count)) for part in WIDTHS):
        if 2 * width > count:
            continue
        last = count if closed else count - width + 1
        for start in range(0, last, max(width // 2, 1)):
            yield np.arange(start, start + width) % count


def _grown(own: NDArray[np.intp], beyond: Array, closed: bool) -> NDArray[np.intp]:
    """The positions beyond U to the side of a window, from its first to its last, and those that go on beside it."""
    side, count = np.sign(np.sum(beyond[own])), len(beyond)
    off = own[beyond[own] == side]
    first, last = int(off[0]), int(off[-1])
    length = (last - first) % count + 1
    while length < count and (closed or first > 0) and beyond[(first - 1) % count] == side:
        first, length = (first - 1) % count, length + 1
    while length < count and (closed or last < count - 1) and beyond[(last + 1) % count] == side:
        last, length = (last + 1) % count, length + 1
    run = (first + np.arange(length)) % count
    return np.asarray(run[beyond[run] == side], np.intp)
