"""Extremes at a corner of a course: where a load begins or ends at a place, or friction turns round.

The corner lies between two positions and moves with the numbers p of the mechanism. The largest of the positions is off
by O(h), h their distance, and the envelope theorem does not hold: dy/dp = ∂y/∂p + (∂y/∂t) dt/dp, t the time of the
corner. So the gaps on both sides of the largest position are looked through, again and again about the largest value,
until the corner is known to h/4^ROUNDS; differences of such figures have both terms.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from trunnion.measures.figures import FLAT, Reference, course_of

__all__ = ["extreme", "with_corner"]

Array = NDArray[np.float64]
Look = Callable[[Array], Array]  # from times in the cycle, s, to the course there, both (row, place)
SIGNS = {"maximum": (1.0,), "minimum": (-1.0,), "largest": (1.0, -1.0), "peak-to-peak": (1.0, -1.0)}
ROUNDS, PLACES = 12, 9  # of the places in a round the next one takes the two gaps about the best
FEWEST = 8  # positions from which the shape of a course is known


def with_corner(known: Reference, look: Look) -> Reference:
    """The same nominal mechanism, its figure that of the corner where it is an extreme of forces at one."""
    if not _cornered(known):
        return known
    return replace(known, corner=True, figure=float(extreme(known, known.parts[0][None], look)[0]))


def _cornered(known: Reference) -> bool:
    """Whether no polynomial goes through an extreme of the nominal mechanism, within the range."""
    measure = known.measure
    signs = SIGNS.get(measure.rule, ())
    if not signs or known.against or known.turning or measure.of_motion or measure.in_time or len(known.parts) != 1:
        return False
    if len(known.window.index) < FEWEST or not np.all(np.isfinite(known.parts[0])):
        return False
    course = course_of(known, known.parts[0])
    if not np.ptp(course.number) > FLAT * np.max(np.abs(course.number)):
        return False
    tops = [course.largest(sign) for sign in signs]
    return any(bool(top.inside) and int(top.used) == 0 for top in tops)


def extreme(known: Reference, course: Array, look: Look) -> Array:
    """The figure, (row,), of courses over the window, (row, position), with their corners; NaN as `figures.figure`."""
    tops = [_highest(known, course, look, sign) for sign in SIGNS[known.measure.rule]]
    if known.measure.rule == "peak-to-peak":
        return np.asarray(tops[0] + tops[1])
    return -tops[0] if known.measure.rule == "minimum" else np.asarray(np.max(tops, axis=0))


def _highest(known: Reference, course: Array, look: Look, sign: float) -> Array:
    """The largest value of each row, times a sign."""
    time, period, last = known.window.time, known.window.period, course.shape[-1] - 1
    gaps = np.diff(time, append=time[-1] if period is None else time[0] + period)
    signed = sign * course
    top, rows = np.argmax(np.nan_to_num(signed, nan=-np.inf), axis=-1), np.arange(len(course))
    best, low, high = np.max(signed, axis=-1), time[top] - gaps[top - 1], time[top] + gaps[top]
    if period is None:
        low, high = np.where(top == 0, time[0], low), np.where(top == last, time[-1], high)
    shares = np.linspace(0.0, 1.0, PLACES)
    for _ in range(ROUNDS):
        places = low[:, None] + (high - low)[:, None] * shares
        found = sign * look(places if period is None else places % period)
        found = np.nan_to_num(found, nan=-np.inf)
        most = np.argmax(found, axis=-1)
        best = np.maximum(best, np.max(found, axis=-1))  # NaN stays
        low, high = places[rows, np.maximum(most - 1, 0)], places[rows, np.minimum(most + 1, PLACES - 1)]
    return np.asarray(best)
