"""Extremes at a corner of a course: where a load begins or ends at a place, or friction turns round.

The corner lies between two positions and moves with the numbers p of the mechanism. The largest of the positions is off
by O(h), h their distance, and the envelope theorem does not hold: dy/dp = ∂y/∂p + (∂y/∂t) dt/dp, t the time of the
corner. So the course is taken on both sides of every place at which the model says that forces jump or bend, of each
mechanism its own, and the gaps beside the highest of these and of the positions are looked through, again and again
about the largest value, until the corner is known to h/4^ROUNDS, also one that no model states. Differences of such
figures have both terms.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.measures.extremes import FLAT, Extreme
from trunnion.measures.figures import Reference, course_of
from trunnion.solve.switches import Bend
from trunnion.solve.system import Cycle

if TYPE_CHECKING:
    from trunnion.solve.run import Run

__all__ = ["Sides", "change_by_step", "extreme", "raised", "sides_of", "switch", "with_corner"]

Array = NDArray[np.float64]
Look = Callable[[Array], Array]  # from times in the cycle, s, to the course there, both (row, place)
SIGNS = {"maximum": (1.0,), "minimum": (-1.0,), "largest": (1.0, -1.0), "peak-to-peak": (1.0, -1.0)}
ROUNDS, PARTS = 12, 4  # of either gap about the best place in a round; the next one takes the two about its best
BESIDE = 1e-9  # of the cycle: on the sides of a place at which the model switches
SAME = 1e-6  # of the range of a course: figures that are one
REACH, ALIKE = 3.5, 1e-6  # steps that a polynomial reaches; of the range of a course: what it may be off
TOPS, NEAR = 3, 0.02  # places that are looked about, and of the range of a course what they may be lower than the best
BENDS, LOW = 16, 0.25  # the same of the places of the nominal mechanism that are looked at in others
KINK = 0.1  # of a change: what that to the other side may differ by and the course still be smooth
FEWEST = 8  # positions from which the shape of a course is known


class Sides(NamedTuple):
    """Times, s, (row, place), on both sides of bends, NaN outside the window; how far apart those of one bend are."""

    at: Array
    apart: float


def with_corner(known: Reference, look: Look, run: Run) -> Reference:
    """The same nominal mechanism, its figure that of the corner where it is an extreme of forces at one.

    It is at one where no polynomial goes through the positions, or the course is higher where the model bends or jumps;
    near an edge of the run also where what one makes of the positions is not found there, as it may round off an obtuse
    corner. Of few positions only the bends and jumps of the model tell. Where it is not at one, the places remain at
    which the course jumps from nearly as high.
    """
    tops = _tops(known)
    if not tops:
        return known
    bends, above, jumps = _bends(known, look, run, [float(top.value) for top in tops])
    enough = len(known.window.index) >= FEWEST
    sharp = bool(np.any(above > ALIKE)) or (enough and any(bool(top.inside) and int(top.used) == 0 for top in tops))
    if sharp or (enough and any(_beside(known, float(np.ravel(top.place)[0]), run.edges) for top in tops)):
        times = np.array([[one.time for one in bends]]).reshape(1, -1)
        corner = replace(known, corner=True, bends=tuple(bends))
        figure = float(extreme(corner, known.parts[0][None], look, sides_of(known, times, run.cycle))[0])
        if sharp or abs(figure - known.figure) > ALIKE * np.ptp(known.parts[0]):
            return replace(corner, figure=figure)
    return replace(known, bends=tuple(bends[i] for i in np.flatnonzero(jumps & (above > -NEAR))))


def switch(known: Reference, look: Look, edges: Array, cycle: Cycle, time: float) -> float:
    """Time, s, of that of the places, s, at which the model switches where the course has its figure; else as given."""
    window = known.window
    beside = (edges[:, None] + BESIDE * cycle.duration * np.array([-1.0, 1.0])).ravel()
    beside = beside if window.period else beside[(beside >= window.time[0]) & (beside <= window.time[-1])]
    if not len(beside):
        return time
    course = look(beside)
    course = np.abs(course) if known.measure.rule == "largest" else course
    off = np.nan_to_num(np.abs(course - known.figure), nan=np.inf)
    best = int(np.argmin(off))
    return float(beside[best]) if off[best] <= SAME * np.ptp(known.parts[0]) else time


def _bends(
    known: Reference, look: Look, run: Run, tops: Sequence[float]
) -> tuple[list[Bend], Array, NDArray[np.bool_]]:
    """Where the model bends or jumps, the highest first, if no lower than LOW; by how much of the range of the course
    its higher side is above the tops, and whether it jumps, (bend,) each."""
    bends = [Bend(0.0), *run.bends] if run.cycle.periodic else run.bends
    at = sides_of(known, np.array([[one.time for one in bends]]).reshape(1, -1), run.cycle).at
    found = np.where(np.isnan(at), np.nan, _at(known, np.where(np.isnan(at), known.window.time[0], at), look))
    found = found.reshape(len(bends), at.size // (2 * len(bends) or 1), 2) / np.ptp(known.parts[0])
    signs = np.array(SIGNS[known.measure.rule])[:, None, None, None]
    above = signs * found - np.reshape(tops, signs.shape) / np.ptp(known.parts[0])
    above = np.fmax.reduce(np.nan_to_num(above, nan=-np.inf), axis=(0, 2, 3), initial=-np.inf)
    jumps = np.fmax.reduce(np.abs(np.diff(found)), axis=(1, 2), initial=0.0) > ALIKE
    order = np.argsort(-above, kind="stable")[:BENDS]
    order = order[above[order] > -LOW]
    return [bends[i] for i in order], above[order], jumps[order]


def sides_of(known: Reference, times: Array, cycle: Cycle) -> Sides:
    """Both sides of bends at times in the cycle, s, (row, bend)."""
    time, period = known.window.time, known.window.period
    laps = np.arange(1 + time[-1] // cycle.duration) if period is None and cycle.periodic else np.zeros(1)
    around = laps[:, None] * cycle.duration + BESIDE * cycle.duration * np.array([-1.0, 1.0])
    found = (times[..., None, None] + around).reshape(len(times), -1)
    apart = 4 * BESIDE * cycle.duration
    if period is None:
        return Sides(np.where((found >= time[0]) & (found <= time[-1]), found, np.nan), apart)
    begin = time[0] - apart  # so that the sides of a bend where the period ends are together
    return Sides((found - begin) % period + begin, apart)


def _at(known: Reference, time: Array, look: Look) -> Array:
    """The course at times, (row, place), of the window."""
    return look(time if known.window.period is None else time % known.window.period)


def _tops(known: Reference) -> list[Extreme]:
    """The extremes that a figure of forces is made of, by polynomials; none of other figures."""
    measure = known.measure
    signs = SIGNS.get(measure.rule, ())
    if not signs or known.against or known.turning or measure.of_motion or measure.in_time or len(known.parts) != 1:
        return []
    if len(known.window.index) < 2 or not np.all(np.isfinite(known.parts[0])):
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
    return bool(np.any(np.abs(away) <= REACH * (time[-1] - time[0]) / (len(time) - 1)))


def extreme(known: Reference, course: Array, look: Look, sides: Sides) -> Array:
    """The figure, (row,), of courses over the window, (row, position), with their corners; NaN as `figures.figure`."""
    sides, there = _beyond(known, sides, look)
    return _figure(known, [_highest(known, course, sides, there, look, sign) for sign in SIGNS[known.measure.rule]])


def raised(known: Reference, course: Array, look: Look, sides: Sides, figures: Array) -> Array:
    """The same where the nominal mechanism is at no corner, but jumps nearly as high: what polynomials make of the
    positions, the figures, (row,), and what is beside the jumps."""
    there, rule = _beyond(known, sides, look)[1], known.measure.rule
    if rule != "peak-to-peak":
        tops = [-figures if rule == "minimum" else figures] * len(SIGNS[rule])
    else:
        tops = list(course_of(known, course).both())
    highest = (np.fmax.reduce(sign * there, axis=1) for sign in SIGNS[rule])
    return _figure(known, [np.where(high > top, high, top) for top, high in zip(tops, highest, strict=True)])


def change_by_step(before: Array, figures: Array, after: Array) -> Array:
    """Of figures by one step, from those a step before and after, (row,): half their difference; where two corners are
    as high, as of a crank that turns past a load both ways, one rises as the other falls, and it is the larger of both.
    """
    ahead, behind = after - figures, figures - before
    larger = np.where(np.abs(ahead) >= np.abs(behind), ahead, behind)
    return np.where(np.abs(ahead - behind) > KINK * np.abs(larger), larger, (ahead + behind) / 2)


def _figure(known: Reference, tops: Sequence[Array]) -> Array:
    """The figure of the largest values of each row, each times its sign."""
    if known.measure.rule == "peak-to-peak":
        return np.asarray(tops[0] + tops[1])
    return -tops[0] if known.measure.rule == "minimum" else np.asarray(np.max(tops, axis=0))


def _beyond(known: Reference, sides: Sides, look: Look) -> tuple[Sides, Array]:
    """The times beside bends, for those that are none others in the first gap of positions; the course there."""
    first, second = known.window.time[:2]
    gap = np.linspace(first, second, sides.at.shape[1] + 2)[1:-1]
    at = np.where(np.isnan(sides.at), gap, sides.at)
    return sides._replace(at=at), _at(known, at, look) if at.size else at


def _highest(known: Reference, course: Array, sides: Sides, there: Array, look: Look, sign: float) -> Array:
    """The largest value of each row, times a sign: about its highest places, of positions none that are neighbours.

    course: at the positions; there: beside bends, both sides of which are one place.
    """
    beside, apart = sides
    time, period = known.window.time, known.window.period
    rows, count, index = np.arange(len(course)), len(time), np.arange(len(time))
    around = np.concatenate([index[-1:], index, index[:1]]) if period is not None else index[[0, *index, -1]]
    extended = time[around]
    if period is not None:
        extended[[0, -1]] += -period, period
    at = np.concatenate([np.broadcast_to(time, course.shape), beside], axis=1)
    signed = sign * np.concatenate([course, there], axis=1)
    signed[np.isnan(signed)] = -np.inf
    best, near = np.max(signed, axis=1) + 0.0 * np.sum(course, axis=1), NEAR * np.ptp(known.parts[0])  # NaN stays
    for _ in range(TOPS):
        top = np.argmax(signed, axis=1)
        place, value = at[rows, top], signed[rows, top]
        if not np.any(value > best - near):
            break
        before = np.maximum(np.searchsorted(extended, place - apart, side="left") - 1, 0)
        after = np.minimum(np.searchsorted(extended, place + apart, side="right"), count + 1)
        away = beside - place[:, None]
        if period is not None:
            away -= period * np.rint(away / period)
        low = np.maximum(extended[before], place + np.max(away, axis=1, initial=-np.inf, where=away < -apart))
        high = np.minimum(extended[after], place + np.min(away, axis=1, initial=np.inf, where=away > apart))
        best = np.maximum(best, _about(known, (low, place, high), value, look, sign))
        signed[rows, top] = -np.inf
        signed[:, count:][np.abs(away) <= apart] = -np.inf
        for beyond, reached in ((before, low), (after, high)):
            gone = np.flatnonzero(extended[beyond] == reached)
            signed[gone, around[beyond[gone]]] = -np.inf
    return np.asarray(best)


def _about(known: Reference, within: tuple[Array, Array, Array], value: Array, look: Look, sign: float) -> Array:
    """The largest value of each row, times a sign, between two times about a third with its value."""
    (low, middle, high), rows, shares = within, np.arange(len(value)), np.arange(1, PARTS) / PARTS
    for _ in range(ROUNDS):
        left, right = (one[:, None] + (other - one)[:, None] * shares for one, other in ((low, middle), (middle, high)))
        found = np.nan_to_num(sign * _at(known, np.concatenate([left, right], axis=1), look), nan=-np.inf)
        found = np.insert(found, PARTS - 1, value, axis=1)
        places = np.concatenate([low[:, None], left, middle[:, None], right, high[:, None]], axis=1)
        most = np.argmax(found, axis=1)
        low, middle, high = (places[rows, most + k] for k in range(3))
        value = found[rows, most]
    return np.asarray(value)
