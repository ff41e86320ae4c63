"""Courses: numbers over time, smooth between breaks, known there as polynomials; what a cycle is asked is read here.

A break is a time at which something switches: a load begins, friction turns round, positions cease to have an answer.
Between two breaks lie panels, on each of which every number, a row, is the polynomial through its values at Chebyshev
points; none of these points is a break, so both one-sided limits of a jump count and the instant between them does not.
Panels are parted until the last coefficients are small. Where a row still jumps or bends at a break that nobody stated,
or the state of the positions changes, the panels shrink about it until it is located to rounding.

Piecewise smooth functions as polynomials between breaks: R. Pachón, R. B. Platte, L. N. Trefethen, Piecewise-smooth
chebfuns, IMA J. Numer. Anal. 30 (2010) 898-916, doi:10.1093/imanum/drp008.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from trunnion.algebra import panels as reading
from trunnion.algebra.panels import ENDS, FIT, GAUSS_WEIGHTS, ON_GAUSS, ON_GRID, ON_POINTS, ORDER, POINTS

Array = NDArray[np.float64]
Labels = NDArray[np.intp]
# mechanisms (lane,) and times (lane, node), s, to the rows there, (row, lane, node), and the states, (lane, node)
Solve = Callable[[Labels, Array], tuple[Array, NDArray[np.integer]]]

CHECKED, TORN = 5, 1e3  # times that edges are looked at; of what is small: a row that changes by more at one jumps
TOSSED = 1e-3  # of the whole: width of panels whose state may be the gravest that they have
CROWDED, CROWD = 1e-7, 4  # of the whole: in one place; panels of mixed states there: a break has one or two
HALVED = 2  # rounds in which a panel is halved; then it is parted about the place where a row bends most
BESIDE = 1e-8  # of the whole: an extreme is at a break if it is no farther from it
ONE = 1e-7  # of the whole: passages that are one, as where a row touches a level
REAL = 1e-7  # imaginary part of a root that counts as real: of a double root it is the square root of rounding


class Accuracy(NamedTuple):
    """How well panels are resolved.

    tolerance: last coefficients of a row, of its size; floor: of what is like the row, below which is rounding;
    widest, shortest: panel at first, and about a break that is located, of the whole; rounds; most: panels that may be
    parted in one round, beyond which the tolerance is loosened, for what is rough everywhere is noise.
    """

    tolerance: float = 1e-8
    floor: float = 1e-12
    widest: float = 1 / 6
    shortest: float = 1e-10
    rounds: int = 24
    most: int = 64


class Place(NamedTuple):
    """An extreme: its value, its time, s, and whether it is beside a break.

    everywhere: of a constant, NaN s; side: of an inner break, −1 before it, 1 after it.
    """

    value: float
    time: float
    at_break: bool = False
    everywhere: bool = False
    side: float = 0.0


@dataclass(frozen=True)
class Courses:
    """Rows of numbers over time.

    edges: of the panels, rising, s, (edge,); coefficients: of Chebyshev polynomials, (panel, row, coefficient), NaN
    where a row has no value; states: what every panel was said to be by who solved it; breaks: edges at which rows may
    jump or bend; sizes: the largest magnitude of what is like each row; asked: how many times were solved; loosened: by
    how many times the tolerance was loosened, as rows are rough everywhere, see `Accuracy.most`.
    """

    edges: Array
    coefficients: Array
    states: Labels
    breaks: Array
    sizes: Array
    asked: int
    loosened: float = 1.0

    @classmethod
    def of(
        cls,
        solve: Callable[[Array], tuple[Array, NDArray[np.integer]]],
        breaks: Array,
        like: Callable[[Array], Array] | None = None,
        accuracy: Accuracy | None = None,
    ) -> Courses:
        """The rows of one mechanism, (row, time) at times (time,), with the state of each time; see `many`."""

        def lanes(_: Labels, time: Array) -> tuple[Array, NDArray[np.integer]]:
            rows, states = solve(time.ravel())
            return rows.reshape(len(rows), *time.shape), states.reshape(time.shape)

        return cls.many(lanes, [breaks], like, accuracy)[0]

    @classmethod
    def many(
        cls,
        solve: Solve,
        breaks: Sequence[Array],
        like: Callable[[Array], Array] | None = None,
        accuracy: Accuracy | None = None,
    ) -> list[Courses]:
        """The rows of some mechanisms, each from the first of its breaks to the last.

        Parameters
        ----------
        solve
            Rows and states at some times of some mechanisms. A state is a number that names what a position came to;
            where it changes, or a row ceases to have a value, is a break.
        breaks
            Of every mechanism, rising, s.
        like
            From the largest magnitudes of the rows to those of what is like them, (row,): that a row is much smaller
            than a number of its kind is rounding. Each row is by itself if not given.
        accuracy
            See `Accuracy`.
        """
        return _Resolving(solve, breaks, like, accuracy or Accuracy()).courses()

    @cached_property
    def half(self) -> Array:
        """Half widths of the panels, s."""
        return np.diff(self.edges) / 2

    @property
    def span(self) -> float:
        """From the first edge to the last, s."""
        return float(self.edges[-1] - self.edges[0])

    @cached_property
    def tails(self) -> Array:
        """Last coefficients, (panel, row): what the polynomials may be off by."""
        tails: Array = np.max(np.abs(self.coefficients[..., -2:]), axis=-1)
        return tails

    def panel(self, time: Array) -> Labels:
        """The panel of every time, s; at an edge that after it."""
        return np.clip(np.searchsorted(self.edges, time, side="right") - 1, 0, len(self.half) - 1)

    def at(self, time: Array) -> Array:
        """The rows at times, s, (row, time); at a break those after it."""
        panel = self.panel(time)
        basis = chebyshev.chebvander((time - self.edges[panel]) / self.half[panel] - 1.0, ORDER - 1)
        rows = np.empty((self.coefficients.shape[1], len(time)))
        order = np.argsort(panel, kind="stable")
        for lanes in np.split(order, np.flatnonzero(np.diff(panel[order])) + 1) if len(time) else []:
            rows[:, lanes] = self.coefficients[panel[lanes[0]]] @ basis[lanes].T
        return rows

    def share(self, panels: NDArray[np.bool_]) -> float:
        """Share of the time that some panels take."""
        return float(np.sum(self.half[panels]) / np.sum(self.half))

    def picked(self, rows: Labels) -> Courses:
        """Some of the rows."""
        return replace(self, coefficients=self.coefficients[:, rows], sizes=self.sizes[rows])

    def parted(self, times: Array) -> Courses:
        """The same rows with edges at some times, s, too, as where a part of them begins or ends."""
        edges = np.union1d(self.edges, times[(times > self.edges[0]) & (times < self.edges[-1])])
        low, half = edges[:-1], np.diff(edges) / 2
        panel = np.searchsorted(self.edges, low, side="right") - 1
        spots = (low + half)[:, None] + half[:, None] * POINTS
        spots = (spots - self.edges[panel][:, None]) / self.half[panel][:, None] - 1.0
        basis = np.moveaxis(chebyshev.chebvander(spots, ORDER - 1), 2, 1)
        coefficients = (self.coefficients[panel] @ basis) @ FIT.T
        return replace(self, edges=edges, coefficients=coefficients, states=self.states[panel])

    def between(self, low: float, high: float) -> Courses:
        """The same rows from one time to another, s."""
        cut = self.parted(np.array([low, high]))
        begin, end = np.searchsorted(cut.edges, [low, high])
        return replace(
            cut,
            edges=cut.edges[begin : end + 1],
            coefficients=cut.coefficients[begin:end],
            states=cut.states[begin:end],
        )

    # ---- means ------------------------------------------------------------------------------------------------

    def mean(self, of: Callable[[Array], Array] | None = None) -> Array:
        """Means over time of every row, or of what is made of the rows, (row, …) to (…) or (number, …)."""
        rows = np.moveaxis(self.coefficients @ ON_GAUSS, 1, 0)
        numbers = rows if of is None else of(rows)  # (…, panel, node)
        return self._averaged(np.moveaxis(numbers @ GAUSS_WEIGHTS, -1, 0))

    def error(self) -> Array:
        """How far the means of the rows may be off, by the last coefficients of their polynomials."""
        return self._averaged(2.0 * self.tails)

    def _averaged(self, integrals: Array) -> Array:
        """Of integrals over the panels as if they were two long, (panel, …)."""
        return np.asarray(np.tensordot(self.half, integrals, 1) / (2.0 * np.sum(self.half)))

    # ---- extremes, passages, sides ----------------------------------------------------------------------------

    def extreme(
        self,
        of: Callable[[Array], Array],
        sign: float = 1.0,
        panels: NDArray[np.bool_] | None = None,
        floor: float = 0.0,
    ) -> Place | None:
        """The largest value of a number that is made of the rows, (row, …) to (…), or with sign −1 its least one.

        Parameters
        ----------
        of
            Such as `lambda rows: rows[3]`.
        panels
            Among which it is looked for, all if not given.
        floor
            What is rounding of the number: a smaller change is none.

        Returns
        -------
        Place
            The first of several; None where no panel has a value.
        """
        allowed = True if panels is None else panels
        peak = reading.extreme(np.moveaxis(self.coefficients, 1, 0)[:, None], of, sign, allowed, floor)
        value, panel, spot = float(np.ravel(peak.value)[0]), int(peak.panel[0]), float(np.ravel(peak.spot)[0])
        if not np.isfinite(value):
            return None
        if peak.constant[0]:
            return Place(value, float("nan"), everywhere=True)
        time = float(self.edges[panel] + self.half[panel] * (spot + 1.0))
        nearest = float(self.breaks[np.argmin(np.abs(self.breaks - time))])
        at_break = abs(nearest - time) <= BESIDE * self.span
        inner = self.edges[0] < nearest < self.edges[-1]
        side = float(inner * np.sign(self.edges[panel] + self.half[panel] - nearest))
        return Place(value, nearest, True, side=side) if at_break else Place(value, time)

    def passages(self, row: int, level: float = 0.0) -> Array:
        """Times, s, rising, at which a row passes a level; where it jumps over it that of the jump."""
        row_coefficients = self.coefficients[:, row].copy()
        row_coefficients[:, 0] -= level
        passages = []
        for k in np.flatnonzero(np.abs(row_coefficients[:, 0]) <= np.sum(np.abs(row_coefficients[:, 1:]), axis=1)):
            series = chebyshev.chebtrim(row_coefficients[k], 1e-14 * np.max(np.abs(row_coefficients[k])))
            roots = chebyshev.chebroots(series) if len(series) > 1 else np.zeros(0)
            real = np.real(roots[(np.abs(np.imag(roots)) <= REAL) & (np.abs(np.real(roots)) <= 1.0 + 1e-12)])
            passages.append(self.edges[k] + self.half[k] * (real + 1.0))
        before, after = self.sides(row)
        passages.append(self.edges[1:-1][(before - level) * (after - level) < 0.0])
        times = np.sort(np.concatenate(passages))
        return times[np.append(np.diff(times) > ONE * self.span, True)] if len(times) else times

    def below(self, rows: Sequence[int], floor: float) -> Array:
        """Times, s, from and to, (range, 2), in which any of some rows is below 0. floor: what is rounding of them."""
        edges = np.unique(np.concatenate([self.edges, *(self.passages(row) for row in rows)]))
        below = np.any(self.at((edges[1:] + edges[:-1]) / 2)[rows] < -floor, axis=0)
        ends: Array = edges[np.flatnonzero(np.diff(below, prepend=False, append=False))]
        return ends.reshape(-1, 2)

    def sides(self, row: int) -> tuple[Array, Array]:
        """The values before and after every inner edge; they differ where the row jumps."""
        last, first = self.ends(row)
        return last[:-1], first[1:]

    def ends(self, row: int) -> tuple[Array, Array]:
        """The values at the end and at the begin of every panel."""
        ends = self.coefficients[:, row] @ ENDS
        return ends[:, 1], ends[:, 0]

    def nodes(self, panels: NDArray[np.bool_]) -> Array:
        """Times, s, through whose values the polynomials of some panels go, in a row."""
        nodes: Array = self.edges[:-1][panels, None] + self.half[panels, None] * (POINTS + 1.0)
        return nodes.ravel()

    def on_nodes(self, panels: NDArray[np.bool_]) -> Array:
        """The rows at these times."""
        values = self.coefficients[panels] @ ON_POINTS  # (panel, row, node)
        return np.moveaxis(values, 1, 0).reshape(values.shape[1], values.shape[0] * ORDER)

    def rates(self, rows: Array, panels: NDArray[np.bool_]) -> Array:
        """The rates, at these times, of rows by their values there, (row, time)."""
        slopes = chebyshev.chebder(_fitted(rows), axis=-1) / self.half[panels, None]
        return np.asarray(slopes @ ON_POINTS[:-1]).reshape(rows.shape)

    def integral(self, row: int) -> tuple[Array, Array]:
        """Times, s, of the nodes of all panels, and the integral of a row up to each; 0 over panels without a value."""
        grown = chebyshev.chebint(np.nan_to_num(self.coefficients[:, row]), axis=-1) * self.half[:, None]
        start, end, *inside = np.moveaxis(grown @ chebyshev.chebvander([-1.0, 1.0, *POINTS], ORDER).T, 1, 0)
        before = np.cumsum(np.append(0.0, end - start))[:-1]
        return self.nodes(np.ones(len(self.half), bool)), np.ravel(np.transpose(inside) + (before - start)[:, None])

    def extended(self, rows: Array, panels: NDArray[np.bool_], elsewhere: float = 0.0) -> Courses:
        """With more rows, by their values at these times; a number on all other panels."""
        more = np.zeros((len(self.half), len(rows), ORDER))
        more[..., 0] = elsewhere
        more[panels] = np.moveaxis(_fitted(rows), 0, 1)
        sizes = np.concatenate([self.sizes, np.max(np.abs(rows), axis=1, initial=0.0)])
        return replace(self, coefficients=np.concatenate([self.coefficients, more], axis=1), sizes=sizes)

    def derivative(self) -> Courses:
        """The courses of the rates of all rows."""
        rates = np.zeros_like(self.coefficients)
        rates[..., :-1] = chebyshev.chebder(self.coefficients, axis=-1) / self.half[:, None, None]
        sizes = np.nanmax(np.abs(rates @ ON_GRID), axis=(0, 2), initial=0.0)
        return Courses(self.edges, rates, self.states, self.breaks, sizes, self.asked)


class _Panels(NamedTuple):
    """Panels of some mechanisms: which one, ends, s, coefficients (panel, row, coefficient) and labels."""

    mechanism: Labels
    low: Array
    high: Array
    coefficients: Array
    labels: Labels

    def picked(self, chosen: NDArray[np.bool_] | Labels) -> _Panels:
        return _Panels(
            self.mechanism[chosen], self.low[chosen], self.high[chosen], self.coefficients[chosen], self.labels[chosen]
        )


class _Resolving:
    """How the panels of some mechanisms are found."""

    def __init__(
        self, solve: Solve, breaks: Sequence[Array], like: Callable[[Array], Array] | None, accuracy: Accuracy
    ) -> None:
        self._solve, self._like, self._accuracy = solve, like, accuracy
        self._breaks = [np.array(edges, float) for edges in breaks]
        self._span = np.array([edges[-1] - edges[0] for edges in breaks])
        self._asked = np.zeros(len(breaks), np.intp)
        self._loosened = np.ones(len(breaks))
        self._rows = self._sizes = np.zeros((0, len(breaks)))
        self._done: list[_Panels] = []

    def courses(self) -> list[Courses]:
        count, edges = len(self._breaks), list[Array]()
        for breaks in self._breaks:  # wide gaps are parted evenly
            counts = np.ceil(np.diff(breaks) / (self._accuracy.widest * (breaks[-1] - breaks[0])) * (1 - 1e-9))
            gaps = zip(breaks, breaks[1:], counts.astype(int), strict=False)
            edges.append(np.append(np.concatenate([np.linspace(a, b, n + 1)[:-1] for a, b, n in gaps]), breaks[-1]))
        left = _between(edges, np.arange(count))
        for _ in range(CHECKED):
            self._resolve(*left)
            left = self._torn()
            if not len(left[0]):
                break
        panels = self._together()
        return [self._courses(k, panels.picked(panels.mechanism == k)) for k in range(count)]

    def _resolve(self, mechanism: Labels, low: Array, high: Array) -> None:
        """Part panels until each is resolved, or as narrow as a break is located."""
        for round_ in range(self._accuracy.rounds + 1):
            time = (low + high)[:, None] / 2 + (high - low)[:, None] / 2 * POINTS
            rows, states = self._solve(mechanism, time)
            self._asked += ORDER * np.bincount(mechanism, minlength=len(self._asked))
            values = np.moveaxis(rows, 0, 1)  # (lane, row, node)
            coefficients = values @ FIT.T
            # what every place of a panel is: its state, and whether any row of it has no value
            labels = 2 * states.astype(np.intp) + np.any(~np.isfinite(values), axis=1)
            mixed = np.any(labels != labels[:, :1], axis=1)
            # narrow panels of mechanisms with many of mixed states toss as rounding will, and have no breaks
            many = np.bincount(mechanism[mixed], minlength=len(self._asked)) > self._accuracy.most
            tossed = mixed & many[mechanism] & (high - low < TOSSED * self._span[mechanism])
            labels[tossed] = np.max(labels[tossed], axis=1, keepdims=True, initial=0)
            coefficients[tossed] = np.nan
            mixed &= ~tossed
            if not len(self._rows):
                self._scale(mechanism, values, labels)
            rough, worst = self._rough(mechanism, values, coefficients)
            unresolved = mixed | rough
            tiny = high - low <= self._accuracy.shortest * self._span[mechanism]
            tiny |= self._crowded(mechanism, mixed, low, high)
            for k in np.unique(mechanism[unresolved & tiny]):
                self._breaks[k] = np.union1d(self._breaks[k], high[unresolved & tiny & (mechanism == k)])
            done = ~unresolved if round_ < self._accuracy.rounds else ~mixed
            panels = _Panels(mechanism, low, high, coefficients, labels[:, 0])
            self._done.append(panels.picked(done))
            left = np.flatnonzero(unresolved & ~tiny)
            if not len(left):
                break
            even = left[~mixed[left]]
            middle = ((low + high) / 2)[even, None]
            if round_ >= HALVED:
                middle = _bending(time[even], values[even, worst[even]])
            edges = [*np.column_stack([low[even], middle, high[even]])]
            changing = left[mixed[left]]
            for k in changing:  # the places on both sides of each change of the labels
                after = np.flatnonzero(labels[k, 1:] != labels[k, :-1])
                edges.append(np.array([low[k], *time[k, np.unique(np.concatenate([after, after + 1]))], high[k]]))
            left = np.concatenate([even, changing])
            mechanism, low, high = _between(edges, mechanism[left])

    def _crowded(self, mechanism: Labels, mixed: NDArray[np.bool_], low: Array, high: Array) -> NDArray[np.bool_]:
        """Panels of mixed states of which there are several in one place, too narrow for so many breaks."""
        span, crowded = self._span[mechanism], np.zeros(len(mixed), bool)
        close = np.flatnonzero(mixed & (high - low < CROWDED * span))
        close = close[np.lexsort((low[close], mechanism[close]))]
        apart = (np.diff(low[close]) > CROWDED * span[close[1:]]) | (np.diff(mechanism[close]) != 0)
        place = np.cumsum(np.append(0, apart))[: len(close)]
        crowded[close] = np.bincount(place, minlength=1)[place] > CROWD
        return crowded

    def _scale(self, mechanism: Labels, values: Array, labels: Labels) -> None:
        """How large every row is, and what is like it, (row, mechanism): in the least state that there is."""
        sizes = np.zeros((values.shape[1], len(self._asked)))
        for k in range(len(self._asked)):
            lanes = mechanism == k
            numbers = np.abs(np.moveaxis(values[lanes], 1, 0).reshape(values.shape[1], -1))
            counted = labels[lanes].ravel() == np.min(labels[lanes])
            sizes[:, k] = np.max(np.where(np.isfinite(numbers) & counted, numbers, 0.0), axis=1, initial=0.0)
        self._rows = sizes
        self._sizes = sizes if self._like is None else np.array([self._like(column) for column in sizes.T]).T

    def _limits(self, mechanism: Labels, largest: Array) -> Array:
        """What is small of every row on panels where these are its largest values, (lane, row)."""
        size = np.maximum(self._rows.T[mechanism], np.nan_to_num(largest))
        limits = np.maximum(self._accuracy.tolerance * size, self._accuracy.floor * self._sizes.T[mechanism])
        return np.asarray(np.where(limits > 0, limits, np.inf))

    def _rough(self, mechanism: Labels, values: Array, coefficients: Array) -> tuple[NDArray[np.bool_], Labels]:
        """Whether a row is not yet resolved on a panel, (lane,), and which is it the least."""
        tails = np.max(np.abs(coefficients[..., -2:]), axis=-1)
        limits = self._limits(mechanism, np.max(np.abs(values), axis=-1))
        excesses = np.nan_to_num(tails / limits)
        excess = np.max(excesses, axis=1, initial=0.0)
        for k in np.flatnonzero(np.bincount(mechanism[excess > self._loosened[mechanism]]) > self._accuracy.most):
            self._loosened[k] = np.sort(excess[mechanism == k])[-(self._accuracy.most // 4)]
        return excess > self._loosened[mechanism], np.argmax(excesses, axis=1)

    def _together(self) -> _Panels:
        """All resolved panels, those of each mechanism in the order of time."""
        mechanism, low, high, coefficients, labels = zip(*self._done, strict=True)
        numbers = [np.concatenate(part) for part in (low, high, coefficients)]
        panels = _Panels(np.concatenate(mechanism), numbers[0], numbers[1], numbers[2], np.concatenate(labels))
        return panels.picked(np.lexsort((panels.low, panels.mechanism)))

    def _torn(self) -> tuple[Labels, Array, Array]:
        """Panels in place of those beside an edge at which a row jumps, or the state changes, but none of their places
        shows it: it does so between the edge and the place next to it, or at the edge itself."""
        panels = self._together()
        ends = panels.coefficients @ ENDS
        largest = np.max(np.abs(ends), axis=-1)
        limits = self._limits(panels.mechanism, largest)[1:] * self._loosened[panels.mechanism[1:], None]
        torn = np.any(np.abs(ends[:-1, :, 1] - ends[1:, :, 0]) > TORN * limits, axis=1)
        torn |= panels.labels[1:] != panels.labels[:-1]
        torn &= panels.mechanism[1:] == panels.mechanism[:-1]
        edges, owner, width = panels.low[1:], panels.mechanism[1:], panels.high - panels.low
        near = [np.min(np.abs(self._breaks[k] - edges[i])) for i, k in enumerate(owner)]
        torn &= np.array(near) > 10 * self._accuracy.shortest * self._span[owner]
        chosen = np.flatnonzero(torn)
        chosen = chosen[np.diff(chosen, prepend=-2) > 1]  # of neighbours the next time
        sides = np.array([width[chosen], width[chosen + 1]])
        jumps = panels.labels[chosen] == panels.labels[chosen + 1]  # between the edge and the place next to it
        before, after = np.array([[0.02], [0.014]]) * np.where(jumps, sides, np.min(sides, axis=0))
        gone = np.concatenate([chosen, chosen + 1])
        self._done = [panels.picked(np.setdiff1d(np.arange(len(edges) + 1), gone))]
        parts = [panels.low[chosen], edges[chosen] - before, edges[chosen] + after, panels.high[chosen + 1]]
        return _between([*np.column_stack(parts)], owner[chosen])

    def _courses(self, k: int, panels: _Panels) -> Courses:
        """The courses of one mechanism; the panels about located breaks have shrunk to nothing."""
        edges = np.append(panels.low, self._breaks[k][-1])
        edges[0] = self._breaks[k][0]
        changes = edges[1:-1][panels.labels[1:] != panels.labels[:-1]]
        breaks = np.unique(np.concatenate([self._breaks[k], changes]))
        states, sizes = panels.labels // 2, self._sizes[:, k]
        return Courses(edges, panels.coefficients, states, breaks, sizes, int(self._asked[k]), float(self._loosened[k]))


def _fitted(rows: Array) -> Array:
    """Polynomials through values at the nodes of panels, (row, panel, coefficient)."""
    return np.asarray(rows.reshape(len(rows), rows.shape[1] // ORDER, ORDER) @ FIT.T)


def _between(edges: Sequence[Array], mechanism: Labels) -> tuple[Labels, Array, Array]:
    """Mechanism, low and high of the panels between the edges of each part."""
    low, high = (
        np.concatenate([edge[part] for edge in edges] or [np.zeros(0)]) for part in (slice(-1), slice(1, None))
    )
    return np.repeat(mechanism, [len(edge) - 1 for edge in edges]), low, high


def _bending(time: Array, values: Array) -> Array:
    """The times of panels about the one at which a row bends most, (lane, 2): it may have a corner there, or jump."""
    slopes = np.diff(values) / np.diff(time)
    bends = np.nan_to_num(np.abs(np.diff(slopes) / (time[:, 2:] - time[:, :-2])))
    k = np.argmax(bends, axis=1)
    lanes = np.arange(len(time))
    return np.column_stack([time[lanes, k], time[lanes, k + 2]])
