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

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.namespace import Number

__all__ = ["FLAT", "Extreme", "Grid", "largest", "shape_of"]

FLAT = 1e-9  # of its size: a course that changes less has no extremes to tell the place of
POINTS, FEWER = 7, 5
CUBIC = 4  # positions through which the curve goes that a mean over a range is of
UNEVEN = 8.0  # times the least bend the largest one may have, for a polynomial to go through
RISE, SHARE = 2.0, 0.05  # of the rise and of the bend of a parabola: more is no top of a smooth curve
ROUNDING = 1e-14
ROUNDS = 8  # of Newton's method, which ends at rounding after some three
SETTLED = 1e-13  # of a step: the last step of Newton's method
ALIKE = 1e-9  # of a step: grids of positions whose polynomials are made of the same numbers

Array = NDArray[np.float64]
Positions = NDArray[np.intp]


class Stencils(NamedTuple):
    """The nodes of the polynomial about each position, and what it is made of: powers of steps from that position.

    nodes, laps: which positions, and in which period they lie, (position, node); step: mean distance of them,
    (position,); reach: neighbours between which the polynomial counts, in steps, (2, position); kind: of the position
    among those that lie alike, (position,). Maps of each kind take values at the nodes, (kind, …, node): whole, fewer:
    to coefficients of powers; bends: to second differences; few: which of these FEWER nodes have.
    """

    nodes: Positions
    laps: Positions
    step: Array
    reach: Array
    kind: Positions
    whole: Array
    fewer: Array
    bends: Array
    few: NDArray[np.bool_]


@dataclass(frozen=True)
class Grid:
    """Positions of a curve: rising places; period: after which the curve repeats, if it does.

    given: weights of the positions in a mean and those of a rougher rule, if they are places of a rule of their own.
    """

    at: Array
    period: float | None = None
    given: tuple[Array, Array] | None = None

    @cached_property
    def weights(self) -> Array:
        """Of the positions in a mean; their sum is 1. All alike over a period; over a range the integral of the cubic
        through the four positions about each gap, which is off by O(h⁴) where the curve is smooth."""
        count = len(self.at)
        if self.given is not None:
            return self.given[0]
        if count == 1 or self.period is not None:
            return np.full(count, 1 / count)
        points = min(CUBIC, count)
        first = np.clip(np.arange(count - 1) - points // 2 + 1, 0, count - points)
        nodes = first[:, None] + np.arange(points)
        step = np.diff(self.at)[:, None]
        spots = (self.at[nodes] - self.at[:-1, None]) / step
        powers = np.vander(np.ones(1), points, increasing=True)[0] / np.arange(1, points + 1)
        shares = np.linalg.solve(np.swapaxes(spots[..., None] ** np.arange(points), 1, 2), powers[:, None])[..., 0]
        weights = np.zeros(count)
        np.add.at(weights, nodes, shares * step / (self.at[-1] - self.at[0]))
        return weights

    @cached_property
    def rough(self) -> Array:
        """Weights of a rougher rule, which tells the error: of every other position of a period, of trapezoids."""
        count = len(self.at)
        if self.given is not None:
            return self.given[1]
        if count == 1:
            return self.weights
        if self.period is not None:
            return np.where(np.arange(count) % 2 == 0, 1.0, 0.0) / ((count + 1) // 2)
        weights: Array = np.convolve(np.diff(self.at), [0.5, 0.5]) / (self.at[-1] - self.at[0])
        return weights

    @cached_property
    def stencils(self) -> Stencils:
        """Polynomials about every position, made once."""
        count, tops = len(self.at), np.arange(len(self.at))
        points = min(POINTS, count)
        if self.period is not None:
            points -= 1 - points % 2
            found = tops[:, None] + np.arange(points) - points // 2
        else:
            found = np.clip(tops - points // 2, 0, count - points)[:, None] + np.arange(points)
        nodes, laps = found % count, found // count
        places = self.at[nodes] + laps * (self.period or 0.0) - self.at[:, None]
        step = (places[:, -1] - places[:, 0]) / max(points - 1, 1) if points > 1 else np.ones(count)
        spots = places / step[:, None]
        own = np.argmax(found == tops[:, None], axis=1)
        reach = np.array([spots[tops, np.maximum(own - 1, 0)], spots[tops, np.minimum(own + 1, points - 1)]])
        _, first, kind = np.unique(np.rint(spots / ALIKE), axis=0, return_index=True, return_inverse=True)
        maps = [_maps(spots[k], int(own[k])) for k in first]
        return Stencils(
            nodes, laps, step, reach, kind.ravel(), *(np.array([one[k] for one in maps]) for k in range(4))
        )  # fmt: skip


def _maps(spots: Array, own: int) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
    """Coefficients of a polynomial through all nodes and through FEWER about the top, second differences; see above."""
    points = len(spots)
    whole = _inverse(np.vander(spots, increasing=True))
    few = min(FEWER, points)
    first = int(np.clip(own - few // 2, 0, points - few))
    inner = slice(first, first + few)
    fewer = np.zeros((points, points))
    fewer[:few, inner] = _inverse(np.vander(spots[inner], increasing=True))
    bends = np.zeros((max(points - 2, 0), points))
    for k in range(len(bends)):
        left, right = spots[k + 1] - spots[k], spots[k + 2] - spots[k + 1]
        bends[k, k : k + 3] = 1 / left, -1 / left - 1 / right, 1 / right
    index = np.arange(len(bends))
    return whole, fewer, bends, (index >= first) & (index + 3 <= first + few)


def _inverse(powers: Array) -> Array:
    """Inverse to rounding on any processor: what it leaves, taken in long floats, corrects it once."""
    found = np.asarray(np.linalg.inv(powers), np.longdouble)
    left = np.eye(len(powers)) - powers.astype(np.longdouble) @ found
    return np.asarray(found + found @ left, float)


class Extreme(NamedTuple):
    """The largest value of every lane and where it is.

    value; place: in the unit of the positions; inside: whether the curve turns back there, at no end of its range.
    top: the position next to it; spot: how far from there it is, in steps, with its derivatives; used: how many nodes
    its polynomial has, 0 where it is a position itself.
    """

    value: Number
    place: Number
    inside: NDArray[np.bool_]
    grid: Grid
    top: Positions
    spot: Number
    used: Positions

    def of(self, values: Array, gain: float = 0.0) -> Number:
        """What another number of the positions is at the place; gain: by how much it grows in a period."""
        stencils = self.grid.stencils
        known = values[stencils.nodes[self.top]] + gain * stencils.laps[self.top]
        gone = np.where(np.isnan(primal(self.value)), np.nan, 0.0)
        return _at(_coefficients(known, stencils, self.top, self.used), self.spot)[0] + gone


def shape_of(number: Number) -> tuple[int, ...]:
    """Shape of a number of any kind."""
    return number.shape if isinstance(number, Dual) else np.shape(number)


class Tops(NamedTuple):
    """Positions of rows of numbers that may have the largest value of their row next to them, one a row at least.

    row, top: which; rising by both. about: values at the nodes of the polynomial, (top, node); value: at the position;
    sides: at those beside it (`_sides`); gone: of every row, whether a value of it is NaN.
    """

    row: Positions
    top: Positions
    about: Array
    value: Array
    sides: tuple[Array, Array]
    gone: NDArray[np.bool_]


def largest(curve: Number, grid: Grid) -> Extreme:
    """The largest value of a curve, (lane…, position), over its last axis. Lanes with a NaN have NaN for an answer."""
    shape, stencils = shape_of(curve), grid.stencils
    lanes = shape[:-1]
    real = np.broadcast_to(primal(curve), shape).reshape(-1, shape[-1])
    rows, tops = _tops(real, periodic=grid.period is not None)
    about, sides = real[rows[:, None], stencils.nodes[tops]], _sides(real, rows, tops)
    gone = np.isnan(real.sum(axis=1))
    plain = highest(Tops(rows, tops, about, real[rows, tops], sides, gone), grid)
    top, used, inside = plain.top.reshape(lanes), plain.used.reshape(lanes), plain.inside.reshape(lanes)
    value, place, moved = (array.reshape(lanes) for array in (plain.value, plain.place, plain.spot))
    if isinstance(curve, Dual):
        known = curve[(*(n[..., None] for n in np.indices(lanes, sparse=True)), stencils.nodes[top])]
        value, slope, second = _at(_coefficients(known, stencils, top, used), moved)
        bend = np.where(used > 0, primal(second), -np.inf)
        moved = moved - Dual(0.0 * moved, slope.dual) * (1.0 / bend)
        lost = np.where(gone, np.nan, 0.0).reshape(lanes)
        value, place = value + lost, moved * stencils.step[top] + grid.at[top] + lost
    return Extreme(value, place, inside, grid, top, moved, used)


def highest(found: Tops, grid: Grid) -> Extreme:
    """The largest value of every row, of plain numbers, between positions too."""
    stencils, rows, tops = grid.stencils, found.row, found.top
    spot, used, value = _refined(found.about, found.value, found.sides, stencils, tops)
    if len(rows) > len(found.gone):
        chosen = _highest(rows, value, len(found.gone))
        tops, spot, used, value = tops[chosen], spot[chosen], used[chosen], value[chosen]
    lost = np.where(found.gone, np.nan, 0.0)
    place = spot * stencils.step[tops] + grid.at[tops] + lost
    between = (stencils.reach[0, tops] < 0) & (stencils.reach[1, tops] > 0)
    return Extreme(value + lost, place, (used > 0) | between, grid, tops, spot, used)


def _tops(real: Array, periodic: bool) -> tuple[Positions, Positions]:
    """Row and position of every value above its neighbours that may be the largest of its row; one a row at least."""
    rising = np.empty((len(real), real.shape[1] + 1), bool)  # from the position before to that after each boundary
    rising[:, 1:-1] = real[:, 1:] >= real[:, :-1]
    rising[:, 0] = real[:, 0] >= real[:, -1] if periodic else True
    rising[:, -1] = rising[:, 0] if periodic else False
    high = rising[:, :-1] & ~rising[:, 1:]
    highest = np.argmax(real, axis=1)
    high[np.arange(len(real)), highest] = True
    rows, tops = np.divmod(np.flatnonzero(high), real.shape[1])
    if len(rows) == len(real):
        return rows, tops
    last = real.shape[1] - 1
    left = real[rows, tops - 1] if periodic else real[rows, np.maximum(tops - 1, 0)]
    right = real[rows, (tops + 1) % (last + 1)] if periodic else real[rows, np.minimum(tops + 1, last)]
    middle = real[rows, tops]
    # the top of a parabola is no more than half the larger drop to its neighbours above the highest position
    near = ~(middle + np.maximum(middle - left, middle - right) / 2 < real[rows, highest[rows]])
    return rows[near], tops[near]


def _highest(rows: Positions, value: Array, count: int) -> Positions:
    """Of all tops the highest of each row, the first of several."""
    best = np.maximum.reduceat(np.where(np.isnan(value), -np.inf, value), np.searchsorted(rows, np.arange(count)))
    winners = np.flatnonzero(~(value < best[rows]))
    return winners[np.searchsorted(rows[winners], np.arange(count))]


def _sides(real: Array, rows: Positions, tops: Positions) -> tuple[Array, Array]:
    """Values at the positions before and after each top; of the other end where there is none."""
    count = real.shape[1]
    return real[rows, (tops - 1) % count], real[rows, (tops + 1) % count]


def _highest_top(value: Array, sides: tuple[Array, Array], reach: Array) -> Array:
    """The most that a polynomial may make of a top: RISE times what the parabola through its neighbours rises, and a
    SHARE of its bend; anything at the end of a range.
    """
    with np.errstate(all="ignore"):
        before, after = (value - sides[0]) / -reach[0], (sides[1] - value) / reach[1]
        bend = (after - before) / (reach[1] - reach[0])
        slope = (before * reach[1] - after * reach[0]) / (reach[1] - reach[0])
        rise = -slope * slope / (4 * bend) * RISE - bend * SHARE
    return np.where((reach[0] < 0) & (reach[1] > 0), value + rise, np.inf)


def _refined(
    known: Array, value: Array, sides: tuple[Array, Array], stencils: Stencils, tops: Positions
) -> tuple[Array, Positions, Array]:
    """Place of every top from its position, in steps; how many nodes make it; its value.

    value: of the position; sides: of those beside it.
    """
    points = known.shape[1]
    spot, used = np.zeros(len(known)), np.zeros(len(known), np.intp)
    if points < 3:
        return spot, used, value
    value, kind = value.copy(), stencils.kind[tops]
    most = _highest_top(value, sides, stencils.reach[:, tops])
    bends = np.einsum("cij,cj->ic", stencils.bends[kind], known)
    todo = np.flatnonzero(_even(bends))
    into = (spot, used, value)
    _newton(todo, into, stencils.whole[kind[todo]], known[todo], stencils.reach[:, tops[todo]], most[todo])
    if points > FEWER and np.any(used == 0):
        bends = np.where(stencils.few[kind].T, bends, np.nan)
        todo = np.flatnonzero((used == 0) & _even(bends))
        _newton(todo, into, stencils.fewer[kind[todo]], known[todo], stencils.reach[:, tops[todo]], most[todo])
        used[todo[used[todo] > 0]] = FEWER
    return spot, used, value


def _even(bends: Array) -> NDArray[np.bool_]:
    """Where a curve bends down at all nodes, (node, lane), nowhere much more than elsewhere; NaN: not looked at."""
    most, least = np.fmin.reduce(bends, axis=0), np.fmax.reduce(bends, axis=0)
    return np.asarray((least < 0) & (most >= UNEVEN * least))


def _newton(
    todo: Positions, into: tuple[Array, Positions, Array], maps: Array, known: Array, reach: Array, most: Array
) -> None:
    """Tops of the polynomials of some lanes, put where they are level, no lower than the position and no higher than
    the most."""
    if not len(todo):
        return
    spot, used, value = into
    coefficients = np.einsum("cij,cj->ic", maps, known)
    at = np.clip(-coefficients[1] / (2 * coefficients[2]), *reach)
    for _ in range(ROUNDS):
        _, slope, second = _at(coefficients, at)
        last, at = at, np.clip(at - slope / np.where(second < 0, second, -np.inf), *reach)
        if np.all(np.abs(at - last) <= SETTLED):
            break
    top, slope, second = _at(coefficients, at)
    level = (reach[0] < at) & (at < reach[1]) & (np.abs(slope) <= 1e-9 * np.abs(second)) & (second < 0)
    least = value[todo] - ROUNDING * np.max(np.abs(known), axis=1)  # a top right at a position is it but for rounding
    good = level & (top >= least) & (top <= most)
    lanes = todo[good]
    spot[lanes], used[lanes], value[lanes] = at[good], known.shape[1], top[good]


def _coefficients(known: Number, stencils: Stencils, top: Positions, used: Positions) -> Number:
    """Coefficients of the polynomials that were used, (power, lane…), of values at their nodes, (lane…, node)."""
    if isinstance(known, Dual):
        real, dual = (_coefficients(part, stencils, top, used) for part in (known.real, known.dual))
        return Dual(real, dual)
    kind = stencils.kind[top]
    maps = np.where((used > FEWER)[..., None, None], stencils.whole[kind], stencils.fewer[kind])
    return np.einsum("...ij,...j->i...", maps, np.broadcast_to(known, (*top.shape, maps.shape[-1])))


def _at(coefficients: Number, at: Number) -> tuple[Number, Number, Number]:
    """Value, first and second derivative of a polynomial, by Horner's rule."""
    power = shape_of(coefficients)[0] - 1
    value: Number = coefficients[power]
    slope: Number = 0.0 * value
    second: Number = 0.0 * value
    for k in range(power - 1, -1, -1):
        second = second * at + 2.0 * slope
        slope = slope * at + value
        value = value * at + coefficients[k]
    return value, slope, second
