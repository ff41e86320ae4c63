"""The figure of a measure: one number a mechanism, read of its courses over the cycle or a window.

`Panels` are the courses of one mechanism or of many, between breaks of their own, over the times of the nominal
mechanism: other speeds of the drive change how much time a panel counts, not where it is. Angles follow those of the
nominal mechanism, from which they are less than half a turn away. A figure is NaN where a place that it needs has no
answer, and a dead centre that is not within its range is NaN. With dual numbers a figure has its exact derivatives, the
motion of the breaks included.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Courses
from trunnion.algebra.dual import Dual, derivative, primal
from trunnion.algebra.duallinalg import eigh
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.panels import (
    CANCELLED,
    ENDS,
    GAUSS_WEIGHTS,
    ON_GAUSS,
    ORDER,
    Made,
    OnGrid,
    Top,
    above,
    extreme,
    linear,
    selected,
    spread_out,
    weighted,
)  # fmt: skip
from trunnion.errors import Status
from trunnion.measures.measures import Measure
from trunnion.measures.positions import gain_of, path_of
from trunnion.solve.friction_method import MARGIN
from trunnion.solve.run import Run
from trunnion.solve.switches import near

Array = NDArray[np.float64]
SHORTEST = 1e-5  # of a period: a way back that is shorter is a jump
BESIDE = 1e-9  # of the cycle: on a side of a break
NARROW = 1e-9  # of the courses: panels that hold no place
SIGNS = {"maximum": (1.0,), "minimum": (-1.0,), "place-of-maximum": (1.0,), "place-of-minimum": (-1.0,),
         "dead centre": (1.0,), "dead centre, least": (-1.0,)}  # fmt: skip
BOTH = (1.0, -1.0)
SMALL = 1e-3  # of a turn: below it six terms of the series are exact to rounding
OVER_TIME = ("mean", "rms", "ratio", "work", "dwell")


@dataclass(frozen=True)
class Panels:
    """Courses of mechanisms, a lane each.

    low, half: start and half width of every panel, s, (lane, panel); coefficients: (row, lane, panel, coefficient);
    weights: how much time every Gauss node of a panel counts, (lane, panel, node or 1). left_out: panels where extremes
    are not looked for.
    """

    low: Number
    half: Number
    coefficients: Number
    weights: Number
    left_out: NDArray[np.bool_]

    @classmethod
    def of(cls, courses: Courses, rows: slice) -> Panels:
        """Some rows of one mechanism; where a pin loses contact is left out."""
        half = courses.half[None]
        coefficients = np.moveaxis(courses.coefficients[:, rows], 1, 0)[:, None]
        lost = courses.states == Status.CONTACT_LOST
        return cls(courses.edges[None, :-1], half, coefficients, half[..., None], lost[None])

    @classmethod
    def constant(cls, rows: Number) -> Panels:
        """Numbers at a place, (row, lane), as courses that do not change."""
        coefficients = linear(rows, lambda array: array[..., None, None] * (np.arange(ORDER) == 0))
        half = np.full((np.shape(primal(rows))[1], 1), 0.5)
        return cls(0.0 * half, half, coefficients, half[..., None], half < 0)

    def made(self, coefficients: Number) -> Panels:
        """The same panels with other rows."""
        return replace(self, coefficients=coefficients)

    def mean(self, of: Made) -> Number:
        """Mean over time of a number made of the rows, (lane,)."""
        return weighted(of(linear(self.coefficients, lambda array: array @ ON_GAUSS)), self.weights)

    def tails(self, rows: slice = slice(None)) -> Array:
        """Last coefficients of the polynomials, (lane, panel): what they may be off by."""
        return np.asarray(np.max(np.abs(primal(self.coefficients)[rows, ..., -2:]), axis=(0, -1)))

    def error(self, row: int) -> Array:
        """How far the mean of a row may be off, by the last coefficients, (lane,)."""
        tails = self.tails(slice(row, row + 1))
        half = np.broadcast_to(primal(self.half), tails.shape)
        return np.asarray(np.sum(2.0 * tails * half, axis=-1) / np.sum(2.0 * half, axis=-1))

    def wide(self) -> NDArray[np.bool_]:
        """Panels that are no sliver between two breaks, (lane, panel)."""
        half = primal(self.half)
        return np.asarray(half > NARROW * np.sum(half, -1)[:, None])

    def on_grid(self, of: Made) -> OnGrid:
        """A number made of the rows at the places of the grid, worked out once."""
        grids: dict[Made, OnGrid] = self.__dict__.setdefault("_on_grid", {})
        if of not in grids:
            grids[of] = OnGrid.of(self.coefficients, of)
        return grids[of]

    def top(self, of: Made, sign: float = 1.0) -> Top:
        """The largest value of a number made of the rows, or with sign −1 its least."""
        return extreme(self.coefficients, of, sign, self.wide() & ~self.left_out, 0.0, self.on_grid(of))

    def sides(self, top: Top) -> tuple[Number, Number]:
        """Start and half width of the panel of an extreme, s, (lane,)."""
        lanes = np.arange(len(top.panel))

        def picked(array: Array) -> Array:
            return np.broadcast_to(array, (len(lanes), np.shape(array)[-1]))[lanes, top.panel]

        return linear(self.low, picked), linear(self.half, picked)

    def time(self, top: Top) -> Number:
        """Where an extreme is, s, (lane,); that of a constant is at the start."""
        low, half = self.sides(top)
        return selected(~top.constant, low + half * (top.spot + 1.0), primal(self.low)[:, 0])

    def at(self, time: Array, period: float = 0.0) -> Number:
        """The rows at times, s, (row, lane, time). period: s, after which they come again; 0 of never."""
        low, half = np.asarray(primal(self.low)), np.asarray(primal(self.half))

        def spread(array: Array) -> Array:
            rows = spread_out(array, low, half, time)
            past_end = np.any(np.isnan(rows), axis=(0, 1)) & (period > 0.0)  # the first panel of one begins later
            for shift in (period, -period) if np.any(past_end) else ():
                again = spread_out(array, low, half, time[past_end] + shift)
                rows[..., past_end] = np.where(np.isnan(rows[..., past_end]), again, rows[..., past_end])
            return rows

        return linear(self.coefficients, spread)


def first(rows: Any) -> Number:
    """The first row, which most measures are of."""
    return rows[0]


def length(rows: Any) -> Number:
    """The length of a vector."""
    square: Number = rows[0] * rows[0]
    for k in range(1, np.shape(primal(rows))[0]):
        square = square + rows[k] * rows[k]
    return namespace(square).sqrt(square)


class Read(NamedTuple):
    """What is read of the courses of a measure, (lane,) each.

    figure; least, most: signed deviations from the nominal mechanism: of the figure, which is both, or over the courses
    where the figure is a largest |deviation|; shown: one number at the times asked for, (lane, time), none where the
    edges have derivatives; time: of an extreme, s, at a break on the side that has it, NaN of other figures, of what is
    constant and of what is judged against the nominal mechanism; status: the gravest of their places.
    """

    figure: Number
    least: Number
    most: Number
    shown: Number
    time: Array
    status: NDArray[np.int8]

    @classmethod
    def of(cls, function: Callable[..., Array], *reads: Read) -> Read:
        """A linear function of arrays of some reads, for each of their parts."""
        return cls(*(combined(function, *parts) for parts in zip(*reads, strict=True)))


@dataclass(frozen=True)
class Reading:
    """How the figure of a measure is read of its courses.

    ends: times, s, of the place or of the window; none of a whole cycle. nominal: the figure of the nominal mechanism,
    near which places lie; NaN of none.
    """

    run: Run
    measure: Measure
    ends: tuple[float, ...] = ()
    nominal: float = float("nan")

    @np.errstate(all="ignore")
    def read(self, panels: Panels, status: NDArray[np.int8], times: Array | None = None) -> Read:
        """The figure, SI, and its deviations; NaN where a part of the courses has no answer. times: to be shown, s."""
        gone = np.any(np.isnan(primal(panels.coefficients)[..., 0]), axis=0)
        lost = np.any(gone, axis=1)
        rule, (courses, of) = self.measure.rule, self.number(panels)
        if rule in ("deviation", "largest", "maximum", "minimum"):
            tops = [courses.top(of, sign) for sign in SIGNS.get(rule, BOTH)]
            sides = [self._beside(courses, top) for top in tops]
            most, least = tops[0].value, tops[-1].value
            figure, time = most, sides[0]
            if len(tops) == 2:
                figure = namespace(most, least).maximum(-least, most)
                time = np.where(primal(most) >= -primal(least), *sides)
        else:
            figure = self._figure(courses, of)
            time = np.full(np.shape(primal(figure)), np.nan)
        if self.measure.wants_margin and rule != "deviation":
            # of places at which the margin is not looked for so far ∞ of an extreme, and of a mean where it is so all
            # along; NaN of others
            end = MARGIN * (1 - NARROW)
            lowest, highest = (primal(panels.top(first, sign).value) for sign in (-1.0, 1.0))
            within = ((lowest if rule.endswith("minimum") else highest) < end) | (rule == "dwell")
            endless = (rule in ("maximum", "largest", "value")) | (lowest >= end) & (rule in ("minimum", "mean", "rms"))
            figure = selected(within, figure, np.where(endless, np.inf, np.nan))
            moving = np.isfinite(primal(figure)) | (primal(figure) != self.nominal)
            least = most = selected(moving, figure - self.nominal, 0.0)
        elif rule != "deviation":
            least = most = figure - self.nominal
        figure, least, most = (selected(~lost, number, np.nan) for number in (figure, least, most))
        shown: Number = np.zeros((len(status), 0))
        if len(self.ends) == 1:
            shown = np.asarray(primal(figure))[:, None]
        elif times is not None and not isinstance(panels.low, Dual):
            shape = len(status), len(times)
            shown = linear(self.shown(panels, times), lambda array: np.broadcast_to(array, shape))
        placed = np.isfinite(primal(figure)) & (not self.measure.against_nominal(self.run.system))
        return Read(figure, least, most, shown, np.where(placed, time, np.nan), status)

    def offending(self, panels: Panels, excess: Array) -> NDArray[np.bool_]:
        """Panels that do not resolve the courses as far as the figure needs it, (lane, panel): of an extreme those that
        may have the highest value.

        excess: by how many times what polynomials may be off by is more than the figure may be.
        """
        tails = panels.tails()
        if self.measure.rule in OVER_TIME:
            half = np.broadcast_to(primal(panels.half), tails.shape)
            parts = excess * half / np.sum(half, axis=1, keepdims=True)
            return np.asarray((np.sum(parts, axis=1, keepdims=True) > 1.0) & (parts > 1.0 / len(parts[0])))
        panels, of = self.number(panels)
        grid, near_top = panels.on_grid(of), np.zeros(tails.shape, bool)
        for sign in SIGNS.get(self.measure.rule, BOTH):
            tops = grid.most if sign > 0 else -grid.least
            near_top |= tops + 2.0 * tails >= np.max(tops, axis=1, keepdims=True)
        return np.asarray(near_top & (excess > 1.0) & panels.wide())

    def number(self, panels: Panels) -> tuple[Panels, Made]:
        """What an extreme is of: rows and the number made of them."""
        if self.measure.rule == "line":
            return _across(panels)
        return panels, length if self.measure.kind == "path_error" else first

    def shown(self, panels: Panels, time: Array) -> Number:
        """One number at times, s, (lane, time), that the figure is a statistic of; for pictures."""
        period = self.run.cycle.duration if self._around else 0.0
        if self.measure.rule == "ratio":
            rows = panels.at(time, period)
            return rows[0] / selected(primal(rows[1]) > 0, rows[1], np.nan)
        panels, of = self.number(panels)
        return of(panels.at(time, period))

    # ---- rules --------------------------------------------------------------------------------------------

    def _figure(self, panels: Panels, of: Made) -> Number:
        """The figure of a rule that is of no single place of the course."""
        match self.measure.rule:
            case "mean" | "value":
                return panels.mean(of)
            case "rms":
                square = panels.mean(lambda rows: of(rows) * of(rows))
                return namespace(square).sqrt(square)
            case "work":
                share = (self._window[1] - self._window[0]) / self.run.cycle.duration if self._window else 1.0
                return panels.mean(first) * panels.mean(lambda rows: rows[1]) * share
            case "ratio":
                return self._ratio(panels)
            case "dwell":
                return self._dwell(panels)
            case "line" if of is length:
                return 2.0 * panels.top(of).value
            case "peak-to-peak" | "line":
                return panels.top(of).value - panels.top(of, -1.0).value
            case "time ratio":
                return self._time_ratio(panels, of)
            case rule:
                place, gain = panels.time(panels.top(of, SIGNS[rule][0])), self._gain
                dead = rule.startswith("dead")
                figure = self._dead_centre(panels, place) if dead else self._coordinate(place)
                return near(figure, self.nominal, abs(gain)) if gain and np.isfinite(self.nominal) else figure

    def _beside(self, panels: Panels, top: Top) -> Array:
        """Time of an extreme, s, within its panel; NaN of a constant."""
        low, half = (primal(side) for side in panels.sides(top))
        offset = np.minimum(BESIDE * self.run.cycle.duration, half)
        time = np.clip(primal(panels.time(top)), low + offset, low + 2.0 * half - offset)
        return np.where(top.constant, np.nan, time)

    def _ratio(self, panels: Panels) -> Number:
        """Useful over drive work of the cycle; NaN where the loads drive.  [D 1]

        Of either 0 where it is no more than rounding or the error of its integral: it cancels.
        """
        works = []
        for k in (0, 1):
            mean = panels.mean(lambda rows, k=k: rows[k])  # type: ignore[misc]
            size = primal(panels.mean(lambda rows, k=k: np.abs(primal(rows[k]))))  # type: ignore[misc]
            error = np.maximum(panels.error(k), CANCELLED * size)
            works.append(selected(np.abs(primal(mean)) > error, mean, 0.0))
        return works[0] / selected(primal(works[1]) > 0, works[1], np.nan)

    def _dwell(self, panels: Panels) -> Number:
        """Share of the time within the band."""
        row = panels.coefficients[0]
        low, high = self.measure.within or (-np.inf, np.inf)
        share: Number = above(row, low) if np.isfinite(low) else 2.0
        share = share - above(row, high) if np.isfinite(high) else share
        shape = (*np.shape(primal(row))[:-1], ORDER)
        times = linear(panels.weights, lambda array: np.broadcast_to(array, shape) @ GAUSS_WEIGHTS / 2)
        within, full = (linear(number * times, lambda array: np.sum(array, -1)) for number in (share, 2.0))
        return within / full

    @property
    def _window(self) -> tuple[float, ...]:
        """Both ends, s; none of a whole cycle or a place."""
        return self.ends if len(self.ends) == 2 else ()

    @property
    def _around(self) -> bool:
        """Whether it comes again."""
        return self.run.cycle.periodic and not self._window

    @property
    def _gain(self) -> float:
        """What the coordinate of the first driver gains until it comes again; 0 if it does not."""
        return gain_of(self.run) if self._around else 0.0

    def _coordinate(self, time: Number) -> Number:
        """The coordinate of the first driver at times, s, which may be beyond the cycle."""
        duration = self.run.cycle.duration
        if not self.run.cycle.periodic:
            return path_of(self.run, time)
        laps = np.floor(primal(time) / duration + 1e-12)
        within = time - laps * duration
        return path_of(self.run, within) + (laps if self._window else 0.0) * gain_of(self.run)

    def _dead_centre(self, panels: Panels, time: Number) -> Number:
        """The coordinate of an extreme; NaN at an end of the range, where the motion does not turn back."""
        real = primal(panels.coefficients)[0]
        around = np.full(len(real), self._around)
        if self.measure.turning(self.run.system):
            around &= np.abs(real[:, -1] @ ENDS[:, 1] - real[:, 0] @ ENDS[:, 0]) <= np.pi
        start, end = self._window or (0.0, self.run.cycle.duration)
        place = np.asarray(primal(time))
        at_end = np.minimum(np.abs(place - start), np.abs(place - end)) <= NARROW * (end - start)
        return selected(around | ~at_end, self._coordinate(time), np.nan)

    def _time_ratio(self, panels: Panels, of: Made) -> Number:
        """The longer of the two ways between the places of its largest and its least value over the shorter.

        NaN where the motion does not come again, is none, or jumps.
        """
        ways = [self._dead_centre(panels, panels.time(panels.top(of, sign))) for sign in BOTH]
        share = (ways[0] - ways[1]) * (1.0 / self._gain if self._gain else np.nan)
        share = share - np.floor(primal(share))
        longer = namespace(share).maximum(share, 1.0 - share)
        return longer / selected(primal(longer) < 1 - SHORTEST, 1.0 - longer, np.nan)


def _across(panels: Panels) -> tuple[Panels, Made]:
    """Distances of a path from its least-squares line: in the plane a row, positive to the left; in space vectors."""
    count = np.shape(primal(panels.coefficients))[0]
    unit = (np.arange(ORDER) == 0) * 1.0

    middle = [panels.mean(lambda rows, k=k: rows[k])[..., None, None] for k in range(count)]  # type: ignore
    offset = [panels.coefficients[k] - middle[k] * unit for k in range(count)]
    path = panels.made(combined(_stacked, *offset))
    moments = [[path.mean(lambda rows, i=i, j=j: rows[i] * rows[j]) for j in range(count)] for i in range(count)]  # type: ignore[misc]
    along = [part[..., None, None] for part in direction(moments)]
    if count == 2:
        return panels.made(combined(_stacked, offset[1] * along[0] - offset[0] * along[1])), first
    reach = offset[0] * along[0] + offset[1] * along[1] + offset[2] * along[2]
    across = [part - reach * share for part, share in zip(offset, along, strict=True)]
    return panels.made(combined(_stacked, *across)), length


def _stacked(*arrays: Array) -> Array:
    return np.stack(np.broadcast_arrays(*arrays))


def combined(of: Callable[..., Array], *numbers: Number) -> Number:
    """A linear function of several arrays, of both parts where any of them is a dual number."""
    if not any(isinstance(number, Dual) for number in numbers):
        return of(*numbers)
    reals = [np.asarray(primal(number)) for number in numbers]
    duals = [np.broadcast_to(derivative(number), real.shape) for number, real in zip(numbers, reals, strict=True)]
    return Dual(of(*reals), of(*duals))


def within_limits(measure: Measure, figures: Array, least: Array, most: Array) -> NDArray[np.bool_]:
    """Whether each mechanism is within the limits and bounds of the measure; not where its figure is NaN.

    least, most: signed deviations from the nominal mechanism.
    """
    good = np.asarray(~np.isnan(figures))
    for number, bound in ((least, measure.lower), (figures, measure.at_least)):
        good &= True if bound is None else number >= bound
    for number, bound in ((most, measure.upper), (figures, measure.at_most)):
        good &= True if bound is None else number <= bound
    return good


# ---- the line through a path, and the turn of a link -----------------------------------------------------------


def direction(moments: Sequence[Sequence[Number]]) -> list[Number]:
    """Direction of the least-squares line through a path, of its second moments about its middle; a component each.

    ISO 12780-1:2011 has this reference line, for which the sum of the squares of the local deviations, at right angles
    to it, is least, and the straightness as the width from the lowest to the highest of them. The positions count by
    the time they stand for, so that the figure does not depend on how many there are. In space the distance is to the
    line as such, and the figure the diameter of the cylinder about it that holds the path. It has no derivative where
    the path is as wide as long. In space it is the axis of least inertia of the path, the eigenvector of the largest
    eigenvalue of its moments.
    """
    if len(moments) == 2:
        twice = 2.0 * moments[0][1], moments[0][0] - moments[1][1]
        xp = namespace(*twice)
        angle = 0.5 * xp.arctan2(*twice)
        return [xp.cos(angle), xp.sin(angle)]
    matrix = combined(lambda *n: np.moveaxis(_stacked(*n).reshape(3, 3, -1), -1, 0), *itertools.chain(*moments))
    along = eigh(matrix).vectors[..., -1]  # by rising eigenvalue; NaN where a matrix is
    return [along[:, k] if isinstance(matrix, Dual) else along.real[:, k] for k in range(3)]


def turn(axes: Sequence[Number], before: Sequence[Number], axis: str) -> Number:
    """Component about a global axis of the rotation vector, rad, from one attitude of a link to another.

    axes, before: of its frame, one after the other, nine numbers each. ½ Σ eᵢ⁰ × eᵢ is n sin θ, ½ (Σ eᵢ⁰ · eᵢ − 1) is
    cos θ; θ/sin θ by its series in 1 − cos θ where that is small, so that there is a derivative at no turn.
    """
    sines: list[Number] = [0.0, 0.0, 0.0]
    cosine: Number = -0.5
    for k in (0, 3, 6):
        x, y, z = axes[k : k + 3]
        a, b, c = before[k : k + 3]
        sines = [
            sine + 0.5 * part
            for sine, part in zip(sines, (b * z - c * y, c * x - a * z, a * y - b * x), strict=True)
        ]  # fmt: skip
        cosine = cosine + 0.5 * (a * x + b * y + c * z)
    small = 1.0 - cosine
    series = 1 + small * (1 / 3 + small * (2 / 15 + small * (2 / 35 + small * (8 / 315 + small * (8 / 693)))))
    square = sines[0] * sines[0] + sines[1] * sines[1] + sines[2] * sines[2]
    xp = namespace(square, cosine)
    far = primal(small) > SMALL
    sine = xp.sqrt(xp.where(far, square, 1.0))
    factor = xp.where(far, xp.arctan2(sine, cosine) / sine, series)
    return sines["xyz".index(axis)] * factor
