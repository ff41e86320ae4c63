"""Extremes at a corner of a course: where a load begins or ends at a place, or friction turns round.

The corner lies between two positions and moves with the numbers p of the mechanism. The largest of the positions is off
by O(h), h their distance, and the envelope theorem does not hold: dy/dp = ∂y/∂p + (∂y/∂t) dt/dp, t the time of the
corner. So the gaps on both sides of the largest position are looked through, again and again about the largest value,
until the corner is known to h/4^ROUNDS; differences of such figures have both terms.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion.measures.extremes import Extreme
from trunnion.measures.figures import FLAT, Reference, course_of

if TYPE_CHECKING:
    from trunnion.solve.run import Run

__all__ = ["extreme", "with_corner"]

Array = NDArray[np.float64]
Look = Callable[[Array], Array]  # from times in the cycle, s, to the course there, both (row, place)
SIGNS = {"maximum": (1.0,), "minimum": (-1.0,), "largest": (1.0, -1.0), "peak-to-peak": (1.0, -1.0)}
ROUNDS, PLACES = 12, 9  # of the places in a round the next one takes the two gaps about the best
BESIDE, ALIKE = 3.5, 1e-6  # steps that a polynomial reaches; of the range of a course: what it may be off
TOPS, NEAR = (
    3,
    0.02,
)  # positions that are looked about, and of the range of a course what they may be lower than the best
FEWEST = 8  # positions from which the shape of a course is known


def with_corner(known: Reference, look: Look, run: Run) -> Reference:
    """The same nominal mechanism, its figure that of the corner where it is an extreme of forces at one.

    It is at one where no polynomial goes through the positions; near an edge of the run also where what one makes of
    them is not found there, as it may round off an obtuse corner.
    """
    tops = _tops(known)
    sharp = any(bool(top.inside) and int(top.used) == 0 for top in tops)
    if not sharp and not any(_beside(known, float(np.ravel(top.place)[0]), run.edges) for top in tops):
        return known
    figure = float(extreme(known, known.parts[0][None], look)[0])
    if not sharp and abs(figure - known.figure) <= ALIKE * np.ptp(known.parts[0]):
        return known
    return replace(known, corner=True, figure=figure)


def _tops(known: Reference) -> list[Extreme]:
    """The extremes that a figure of forces is made of, by polynomials; none of other figures."""
    measure = known.measure
    signs = SIGNS.get(measure.rule, ())
    if not signs or known.against or known.turning or measure.of_motion or measure.in_time or len(known.parts) != 1:
        return []
    if len(known.window.index) < FEWEST or not np.all(np.isfinite(known.parts[0])):
        return []
    course = course_of(known, known.parts[0])
    if not np.ptp(course.number) > FLAT * np.max(np.abs(course.number)):
        return []
    return [course.largest(sign) for sign in signs]


def _beside(known: Reference, place: float, edges: Array) -> bool:
    """Whether an edge is so near to a place, s, that the polynomial there goes over it."""
    time, period = known.window.time, known.window.period
    away = edges - place
    if period is not None:
        away = away - period * np.rint(away / period)
    return bool(np.any(np.abs(away) <= BESIDE * (time[-1] - time[0]) / (len(time) - 1)))


def extreme(known: Reference, course: Array, look: Look) -> Array:
    """The figure, (row,), of courses over the window, (row, position), with their corners; NaN as `figures.figure`."""
    tops = [_highest(known, course, look, sign) for sign in SIGNS[known.measure.rule]]
    if known.measure.rule == "peak-to-peak":
        return np.asarray(tops[0] + tops[1])
    return -tops[0] if known.measure.rule == "minimum" else np.asarray(np.max(tops, axis=0))


def _highest(known: Reference, course: Array, look: Look, sign: float) -> Array:
    """The largest value of each row, times a sign: about its highest positions that are no neighbours."""
    signed = sign * np.where(np.isnan(course), -sign * np.inf, course)
    rows, last = np.arange(len(course)), course.shape[-1] - 1
    best, near = np.max(sign * course, axis=-1), NEAR * np.ptp(known.parts[0])  # NaN stays
    for _ in range(TOPS):
        top = np.argmax(signed, axis=-1)
        if not np.any(signed[rows, top] > best - near):
            break
        best = np.maximum(best, _about(known, top, look, sign))
        for beside in (top - 1, top, top + 1):
            signed[rows, beside % (last + 1) if known.window.period is not None else np.clip(beside, 0, last)] = -np.inf
    return np.asarray(best)


def _about(known: Reference, top: NDArray[np.intp], look: Look, sign: float) -> Array:
    """The largest value of each row in the gaps beside a position, times a sign."""
    time, period = known.window.time, known.window.period
    gaps = np.diff(time, append=time[-1] if period is None else time[0] + period)
    rows, best = np.arange(len(top)), np.full(len(top), -np.inf)
    low, high = time[top] - gaps[top - 1], time[top] + gaps[top]
    if period is None:
        low, high = np.where(top == 0, time[0], low), np.where(top == len(time) - 1, time[-1], high)
    shares = np.linspace(0.0, 1.0, PLACES)
    for _ in range(ROUNDS):
        places = low[:, None] + (high - low)[:, None] * shares
        found = np.nan_to_num(sign * look(places if period is None else places % period), nan=-np.inf)
        most = np.argmax(found, axis=-1)
        best = np.maximum(best, np.max(found, axis=-1))
        low, high = places[rows, np.maximum(most - 1, 0)], places[rows, np.minimum(most + 1, PLACES - 1)]
    return best
