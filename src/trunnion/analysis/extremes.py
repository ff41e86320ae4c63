"""The largest value of a curve that is known at some positions, between them too, with its place and derivatives.

Round every position that is above its neighbours goes the polynomial through the seven nearest positions; where it has
its top is found by Newton's method. With positions h apart the value is off by O(h⁷), the place by O(h⁶): what is left
out of a smooth curve is its seventh derivative. Where the curve bends unevenly over seven positions it is five, O(h⁵)
and O(h⁴); where it does over five - friction jumps, contact changes, or there are too few positions - the largest of
the positions is taken as it is, which is off by O(h).

Derivatives of dual numbers are those of the polynomial: at the top it is level, so its value changes as if the place
stayed (envelope theorem), and the place changes by −p′ of the dual part over p″.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.namespace import Number

__all__ = ["Extreme", "largest", "shape_of"]

POINTS, FEWER = 7, 5
UNEVEN = 8.0  # times the least bend the largest one may have, for a polynomial to go through
ROUNDS = 8  # of Newton's method, which starts within a step and ends at rounding after some four

Array = NDArray[np.float64]
Positions = NDArray[np.intp]


class Extreme(NamedTuple):
    """The largest value of every lane and where it is. All but `nodes` broadcast over the lanes.

    value; place: in the unit of the positions; inside: whether the curve is level there, at no end of its range.
    nodes: positions that the polynomial goes through, (lane…, point); spots: theirs, from `origin` in steps of `step`;
    spot: of the largest value, in the same way, with its derivatives; used: how many of the nodes it is made of, the
    first ones, 0 where it is a position itself.
    """

    value: Number
    place: Number
    inside: NDArray[np.bool_]
    nodes: Positions
    laps: Positions
    spots: Array
    spot: Number
    used: Positions

    def of(self, values: Array, gain: float = 0.0) -> Number:
        """What another number of the positions is at the place; gain: by how much it grows in a period."""
        known = values[self.nodes] + gain * self.laps
        columns = [self.spots[..., k] for k in range(self.spots.shape[-1])]
        coefficients = _divided([known[..., k] for k in range(len(columns))], columns, self.used)
        return _at(coefficients, columns, self.spot)[0]


def shape_of(number: Number) -> tuple[int, ...]:
    """Shape of a number of any kind."""
    return number.shape if isinstance(number, Dual) else np.shape(number)


def largest(curve: Number, at: Array, period: float | None = None) -> Extreme:
    """The largest value of a curve, (lane…, position), over its last axis.

    at: rising places of the positions, (position,); period: after which the curve repeats, if it does.
    Lanes with a NaN have NaN for an answer.
    """
    shape = shape_of(curve)
    lanes = shape[:-1]
    real = np.broadcast_to(primal(curve), shape).reshape(-1, shape[-1])
    sound = ~np.isnan(real).any(axis=1)
    rows, tops = _tops(real, periodic=period is not None)
    nodes, laps = _stencil(tops, len(at), periodic=period is not None)
    places = at[nodes] + laps * (period or 0.0) - at[tops][:, None]
    step = (places[:, -1] - places[:, 0]) / max(1, nodes.shape[1] - 1) if nodes.shape[1] > 1 else np.ones(len(tops))
    spots = places / step[:, None]
    own = np.argmax((nodes == tops[:, None]) & (laps == 0), axis=1)
    even = _even(real[rows[:, None], nodes], spots)
    reach = _neighbours(spots, own)
    order = _nearest_first(own, nodes.shape[1])
    nodes, laps, spots = (np.take_along_axis(one, order, axis=1) for one in (nodes, laps, spots))
    spot, used, value = _refined(real[rows[:, None], nodes], real[rows, tops], spots, reach, even)
    first = np.searchsorted(rows, np.arange(len(real)))
    best = np.maximum.reduceat(np.where(np.isnan(value), -np.inf, value), first)
    winners = np.flatnonzero(~(value < best[rows]))
    chosen = winners[np.searchsorted(rows[winners], np.arange(len(real)))]

    def lane(numbers: Any) -> Any:
        return numbers[chosen].reshape(lanes + numbers.shape[1:])

    nodes, laps, spots, spot, used = (lane(one) for one in (nodes, laps, spots, spot, used))
    index = np.indices(lanes, sparse=True)
    known = [curve[(*index, nodes[..., k])] for k in range(nodes.shape[-1])]
    columns = [spots[..., k] for k in range(nodes.shape[-1])]
    value, spot = _with_slopes(known, columns, spot, used)
    gone = np.where(sound.reshape(lanes), 0.0, np.nan)
    place = spot * lane(step) + lane(at[tops]) + gone
    return Extreme(value + gone, place, used > 0, nodes, laps, spots, spot, used)


def _tops(real: Array, periodic: bool) -> tuple[Positions, Positions]:
    """Row and position of every value above its neighbours that may be the largest of its row; one a row at least."""
    before, after = np.full_like(real, -np.inf), np.full_like(real, -np.inf)
    before[:, 1:], after[:, :-1] = real[:, :-1], real[:, 1:]
    if periodic:
        before[:, 0], after[:, -1] = real[:, -1], real[:, 0]
    high = (real >= before) & (real > after)
    highest = np.argmax(real, axis=1)
    every = np.arange(len(real))
    high[every, highest] = True
    rows, tops = np.nonzero(high)
    middle, left, right = real[rows, tops], before[rows, tops], after[rows, tops]
    bend = 2 * middle - np.where(np.isinf(left), right, left) - np.where(np.isinf(right), left, right)
    # the top of a parabola through three points is no more than an eighth of their bend above the highest
    near = ~(middle + bend / 4 < real[rows, highest[rows]])
    return rows[near], tops[near]


def _stencil(tops: Positions, count: int, periodic: bool) -> tuple[Positions, Positions]:
    """Positions of each polynomial, and in which period they lie: those round the top, or the last ones of a range."""
    points = min(POINTS, count)
    if periodic:
        points -= 1 - points % 2
        found = tops[:, None] + np.arange(points) - points // 2
        return found % count, found // count
    first = np.clip(tops - points // 2, 0, count - points)
    found = first[:, None] + np.arange(points)
    return found, np.zeros_like(found)


def _neighbours(spots: Array, own: Positions) -> tuple[Array, Array]:
    """Places of the neighbours of each top, between which the polynomial counts; the top's own at an end."""
    every, last = np.arange(len(own)), spots.shape[1] - 1
    return spots[every, np.maximum(own - 1, 0)], spots[every, np.minimum(own + 1, last)]


def _nearest_first(own: Positions, count: int) -> Positions:
    """Order of the nodes: the FEWER ones round the top, then the others."""
    if count <= FEWER:
        return np.broadcast_to(np.arange(count), (len(own), count))
    first = np.clip(own - FEWER // 2, 0, count - FEWER)[:, None]
    every = np.arange(count)
    outside = (every < first) | (every >= first + FEWER)
    return np.argsort(outside, axis=1, kind="stable")


def _even(known: Array, spots: Array) -> NDArray[np.bool_]:
    """Where a curve bends down at all nodes, nowhere much more than elsewhere."""
    slopes = np.diff(known, axis=1) / np.diff(spots, axis=1)
    bends = np.diff(slopes, axis=1)
    if not bends.shape[1]:
        return np.zeros(len(known), bool)
    most, least = np.min(bends, axis=1), np.max(bends, axis=1)
    return np.asarray((least < 0) & (most >= UNEVEN * least))


def _refined(
    known: Array, value: Array, spots: Array, reach: tuple[Array, Array], even: NDArray[np.bool_]
) -> tuple[Array, Positions, Array]:
    """Place of the top of every curve, of how many nodes it is made, and its value; value: of the position."""
    points = known.shape[1]
    columns = [spots[:, k] for k in range(points)]
    spot, used = np.zeros(len(known)), np.zeros(len(known), np.intp)
    tiers = [(points, even)] if points >= 3 else []
    if points > FEWER:
        tiers.append((FEWER, _even(known[:, :FEWER], spots[:, :FEWER])))
    for count, fits in tiers:
        coefficients = _divided([known[:, k] for k in range(count)], columns)
        at = np.zeros(len(known))
        for _ in range(ROUNDS):
            _, slope, second = _at(coefficients, columns, at)
            at = np.clip(at - slope / np.where(second < 0, second, -np.inf), *reach)
        top, slope, second = _at(coefficients, columns, at)
        level = (reach[0] < at) & (at < reach[1]) & (np.abs(slope) <= 1e-9 * np.abs(second)) & (second < 0)
        good = (used == 0) & fits & level & (top >= value)
        spot, used, value = np.where(good, at, spot), np.where(good, count, used), np.where(good, top, value)
    return spot, used, value


def _with_slopes(
    known: Sequence[Number], columns: Sequence[Array], spot: Array, used: Positions
) -> tuple[Number, Number]:
    """Value and place of the top with their derivatives."""
    value, slope, second = _at(_divided(known, columns, used), columns, spot)
    if not isinstance(slope, Dual):
        return value, spot
    bend = np.where(used > 0, primal(second), -np.inf)
    return value, spot - Dual(0.0 * spot, slope.dual) / bend


def _divided(known: Sequence[Number], spots: Sequence[Array], used: Positions | None = None) -> list[Number]:
    """Newton's divided differences; used: by how many of the nodes each polynomial goes, FEWER at least."""
    found = list(known)
    for order in range(1, len(found)):
        for k in range(len(found) - 1, order - 1, -1):
            found[k] = (found[k] - found[k - 1]) * (1.0 / (spots[k] - spots[k - order]))
    if used is not None:
        for k in range(FEWER, len(found)):
            found[k] = np.where(k < used, 1.0, 0.0) * found[k]
    return found


def _at(coefficients: Sequence[Number], spots: Sequence[Array], at: Number) -> tuple[Number, Number, Number]:
    """Value, first and second derivative of Newton's polynomial, by Horner's rule."""
    value: Number = coefficients[-1]
    slope: Number = 0.0 * value
    second: Number = 0.0 * value
    for coefficient, spot in zip(coefficients[:-1][::-1], spots[: len(coefficients) - 1][::-1], strict=True):
        way = at - spot
        second = second * way + 2 * slope
        slope = slope * way + value
        value = value * way + coefficient
    return value, slope, second
