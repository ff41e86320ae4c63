"""Which peaks a view may cut: those of positions next to a dead centre or to locking, where forces have no bound.

There a curve would flatten all else. The peak of a working load is never cut, however short the stroke.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Status
from trunnion.views.common.cycle import Array, abscissa, column

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["BESIDE", "UNCUT", "ease", "ease_of_status", "peak", "usual_peak", "whole_peaks"]

UNCUT = "uncut"  # attribute of a result whose views cut nothing
BESIDE = frozenset({Status.NEAR_SINGULAR, Status.LOCKED, Status.SINGULAR, Status.NOT_ASSEMBLED})

GROWN = 5.0  # times what is usual: from here on a position may be next to one that has no bound
CLOSE = 50.0  # so much more friction than without it is close to locking, as a degree of transmission angle is
FASTEST = 4  # power of 1/distance that efforts grow with at most: those of masses, driven at constant speed
TOWERS = 4.0  # times the rest: lower peaks are shown whole
BEYOND = 1.25  # of the rest is shown of those that tower


def ease(result: xr.Dataset) -> Array:
    """(position,): 1, but next to a dead centre or to locking less, by as much as what forces grow with has grown.

    Next to it are positions at which the condition or the friction is GROWN times the usual one, in one run with a
    position that is near singular, or right beside one that is singular, locked or cannot be assembled.
    """
    count = int(result.sizes["position"])
    status = column(result, "status")
    if status is None or UNCUT in result.attrs:
        return np.ones(count)
    if "condition" not in result:
        return ease_of_status(result, status)
    condition, margin = np.asarray(result["condition"].values, float), column(result, "locking_margin")
    finite = condition[np.isfinite(condition)]
    friction = np.ones(count)  # by how much friction that feeds on its own reactions raises them: ∞ where it locks
    if margin is not None:
        more = 1.0 / np.maximum(margin - 1.0, 1e-300)
        friction = np.where(np.isinf(margin), 1.0, np.where(margin > 1.0, 1.0 + more, 1.0))
    grown = np.fmax(condition / float(np.median(finite)) if finite.size else 1.0, friction)
    grown = np.where(np.isfinite(grown), grown, 1.0)
    unbounded = np.isin(status, [Status.LOCKED, Status.SINGULAR, Status.NOT_ASSEMBLED])
    core = np.isin(status, [int(code) for code in BESIDE]) | (friction > CLOSE)
    within = (grown > GROWN) | unbounded
    near = _touched(within, core, abscissa(result).closed) & ~unbounded
    return np.where(near, GROWN / grown, 1.0)


def ease_of_status(result: xr.Dataset, status: NDArray[np.generic]) -> Array:
    """Where only the status tells: 0 where that is near singular or has no answer for such a cause, else 1."""
    return np.where(np.isin(status, [int(code) for code in BESIDE]) & (UNCUT not in result.attrs), 0.0, 1.0)


def whole_peaks(result: xr.Dataset, uncut: bool = True) -> xr.Dataset:
    """The result whose views cut no peak, if that is wanted."""
    return result.assign_attrs({UNCUT: 1}) if uncut else result


def _touched(within: NDArray[np.bool_], core: NDArray[np.bool_], closed: bool) -> NDArray[np.bool_]:
    """The runs of `within` that hold one of `core`; closed: after the last comes the first."""
    marks = np.zeros_like(within)
    if within.all():
        return within & core.any()
    first = int(np.flatnonzero(~within)[0]) if closed else 0
    inside, at = np.roll(within, -first), np.roll(core, -first)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(int)))
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        marks[start:stop] = at[start:stop].any()
    return np.roll(marks, first)


def peak(*columns: Array | None) -> float:
    """The greatest magnitude in all columns; 0 if none is finite."""
    sizes = [np.abs(values[np.isfinite(values)]).max(initial=0.0) for values in columns if values is not None]
    return float(max(sizes, default=0.0))


def usual_peak(easy: Array, *columns: Array | None) -> float:
    """The magnitude a view should show: the greatest, unless it is next to a dead centre and towers over all others.

    easy: of `ease`, (position,); columns: (…, position). What does not grow towards the dead centre as forces do is a
    load that works there, and all is shown.
    """
    limits = [np.broadcast_to(easy, values.shape) for values in columns if values is not None]
    shares = np.concatenate([share.ravel() for share in limits]) if limits else np.empty(0)
    sizes = np.concatenate([np.abs(values).ravel() for values in columns if values is not None]) if limits else shares
    finite = np.isfinite(sizes)
    shares, sizes = shares[finite], sizes[finite]
    most = float(sizes.max(initial=0.0))
    rest = float(sizes[shares == 1.0].max(initial=0.0))
    works = float((sizes * shares**FASTEST).max(initial=0.0)) > 2.0 * rest
    return most if works or most <= TOWERS * rest or rest == 0.0 else BEYOND * rest
