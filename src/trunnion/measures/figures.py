"""The figure of a measure: one number a mechanism, read of its courses over the cycle or a window.

`Panels` are the courses of one mechanism or of many, between breaks of their own, over the times of the nominal
mechanism: other speeds of the drive change how much time a panel counts, not where it is. Angles follow those of the
nominal mechanism, from which they are less than half a turn away. A figure is NaN where a place that it needs has no
answer, and a dead centre that is not within its range is NaN. With dual numbers a figure has its exact derivatives, the
motion of the breaks included.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Courses
from trunnion.algebra.dual import Dual, primal
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
from trunnion.algebra.unwrap import unwrap_row
from trunnion.errors import Status
from trunnion.measures.lines import direction, turn
from trunnion.measures.measures import Measure
from trunnion.measures.positions import gain_of, path_of
from trunnion.solve.run import Run

__all__ = ["Panels", "Reading", "columns", "follow", "known", "near", "rows_of", "within_limits"]

Array = NDArray[np.float64]
TURN = 2 * np.pi
SHORTEST = 1e-5  # of a period: a way back that is shorter is a jump
BESIDE = 1e-9  # of the cycle: on a side of a break
NARROW = 1e-9  # of the courses: panels that hold no place
SIGNS = {"maximum": 1.0, "minimum": -1.0, "place-of-maximum": 1.0, "place-of-minimum": -1.0, "dead centre": 1.0,
         "dead centre, least": -1.0}  # fmt: skip


@dataclass(frozen=True)
class Panels:
    """Courses of mechanisms, a lane each.

    low, half: start and half width of every panel, s, (lane, panel); coefficients: (row, lane, panel, coefficient);
    weights: how much time every Gauss node of a panel counts, (lane, panel, node or 1). endless: panels where a number
    is infinite; left_out: where extremes are not looked for.
    """

    low: Number
    half: Number
    coefficients: Number
    weights: Number
    endless: NDArray[np.bool_]
    left_out: NDArray[np.bool_]

    @classmethod
    def of(cls, courses: Courses, endless: NDArray[np.bool_], left_out: NDArray[np.bool_]) -> Panels:
        """Those of one mechanism."""
        low, half = courses.edges[None, :-1], courses.half[None]
        coefficients = np.moveaxis(courses.coefficients, 1, 0)[:, None]
        return cls(low, half, coefficients, half[..., None], endless[None], left_out[None])

    @classmethod
    def constant(cls, rows: Number) -> Panels:
        """Numbers at a place, (row, lane), as courses that do not change."""
        coefficients = linear(rows, lambda array: array[..., None, None] * (np.arange(ORDER) == 0))
        half = np.full((np.shape(primal(rows))[1], 1), 0.5)
        return cls(0.0 * half, half, coefficients, half[..., None], half < 0, half < 0)

    def rows(self, rows: slice) -> Panels:
        """Some of the rows."""
        return replace(self, coefficients=linear(self.coefficients, lambda array: array[rows]))

    def made(self, coefficients: Number) -> Panels:
        """The same panels with other rows."""
        return replace(self, coefficients=coefficients)

    def mean(self, of: Made) -> Number:
        """Mean over time of a number made of the rows, (lane,)."""
        return weighted(of(linear(self.coefficients, lambda array: array @ ON_GAUSS)), self.weights)

    def tails(self, rows: slice = slice(None)) -> Array:
        """Last coefficients of the polynomials, (lane, panel): what they may be off by."""
        return np.asarray(np.max(np.abs(primal(self.coefficients)[rows, ..., -2:]), axis=(0, -1)))

    def error(self, rows: slice = slice(None)) -> Array:
        """How far means of rows may be off, by the last coefficients, (lane,)."""
        tails = self.tails(rows)
        half = np.broadcast_to(primal(self.half), tails.shape)
        return np.asarray(np.sum(2.0 * tails * half, axis=-1) / np.sum(2.0 * half, axis=-1))

    def on_grid(self, of: Made) -> OnGrid:
        """A number made of the rows at the places of the grid, worked out once."""
        known: dict[Made, OnGrid] = self.__dict__.setdefault("_on_grid", {})
        if of not in known:
            known[of] = OnGrid.of(self.coefficients, of)
        return known[of]

    def top(self, of: Made, sign: float = 1.0) -> Top:
        """The largest value of a number made of the rows, or with sign −1 its least."""
        half = primal(self.half)
        wide = half > NARROW * np.sum(half, -1)[:, None]
        return extreme(self.coefficients, of, sign, wide & ~self.left_out, 0.0, self.on_grid(of))

    def time(self, top: Top) -> Number:
        """Where an extreme is, s, (lane,); that of a constant is at the start."""
        lanes = np.arange(len(top.panel))
        low, half = (
            linear(part, lambda array: np.broadcast_to(array, (len(lanes), np.shape(array)[-1]))[lanes, top.panel])
            for part in (self.low, self.half)
        )
        start = np.broadcast_to(primal(self.low), np.shape(primal(self.coefficients))[1:3])[:, 0]
        return selected(~top.constant, low + half * (top.spot + 1.0), start)

    def at(self, time: Array) -> Number:
        """The rows at times, s, (row, lane, time)."""
        low, half = np.asarray(primal(self.low)), np.asarray(primal(self.half))
        return linear(self.coefficients, lambda array: spread_out(array, low, half, time))


def first(rows: Any) -> Number:
    """The first row, which most measures are of."""
    return rows[0]


def length(rows: Any) -> Number:
    """The length of a vector."""
    square: Number = rows[0] * rows[0]
    for k in range(1, np.shape(primal(rows))[0]):
        square = square + rows[k] * rows[k]
    return namespace(square).sqrt(square)


@dataclass(frozen=True)
class Reading:
    """How the figure of a measure is read of its courses.

    ends: times, s, of the window; none of a whole cycle. nominal: the figure of the nominal mechanism, near which
    places lie; NaN of none.
    """

    run: Run
    measure: Measure
    ends: tuple[float, ...] = ()
    nominal: float = float("nan")

    def figure(self, panels: Panels) -> Number:
        """SI, (lane,); NaN where a part of the courses has no answer."""
        return self.read(panels)[0]

    def read(self, panels: Panels) -> tuple[Number, Number, Number]:
        """The figure, and the least and largest signed deviation from the nominal mechanism: of the figure, which is
        both, or over the courses where the figure is a largest |deviation|."""
        rule = self.measure.rule
        gone = np.any(np.isnan(primal(panels.coefficients)[..., 0]), axis=0)
        lost = np.any(gone & ~panels.endless, axis=1)
        with np.errstate(all="ignore"):
            if rule == "deviation":
                panels, of = self.number(panels)
                ends = [selected(~lost, panels.top(of, sign).value, np.nan) for sign in (-1.0, 1.0)]
                return namespace(*ends).maximum(-ends[0], ends[1]), ends[0], ends[1]
            found = selected(~lost, self._of_rule(panels), np.nan)
            if np.any(panels.endless):
                endless = np.all(panels.endless, axis=1) if rule == "minimum" else np.any(panels.endless, axis=1)
                found = selected(lost | ~endless, found, np.inf)
        return found, found - self.nominal, found - self.nominal

    def offending(self, panels: Panels, excess: Array) -> NDArray[np.bool_]:
        """Panels that do not resolve the courses as far as the figure needs it, (lane, panel): of an extreme those that
        may have the highest value.

        excess: by how many times what polynomials may be off by is more than the figure may be.
        """
        rule, tails = self.measure.rule, panels.tails()
        half = np.broadcast_to(primal(panels.half), tails.shape)
        if rule in ("mean", "rms", "ratio", "work", "dwell"):
            parts = excess * half / np.sum(half, axis=1, keepdims=True)
            return np.asarray((np.sum(parts, axis=1, keepdims=True) > 1.0) & (parts > 1.0 / len(parts[0])))
        panels, of = self.number(panels)
        grid, found = panels.on_grid(of), np.zeros(tails.shape, bool)
        for sign in (SIGNS[rule],) if rule in SIGNS else (1.0, -1.0):
            tops = grid.most if sign > 0 else -grid.least
            found |= tops + 2.0 * tails >= np.max(tops, axis=1, keepdims=True)
        return np.asarray(found & (excess > 1.0) & (half > NARROW * np.sum(half, axis=1, keepdims=True)))

    def number(self, panels: Panels) -> tuple[Panels, Made]:
        """What an extreme is of: rows and the number made of them."""
        if self.measure.rule == "line":
            return _across(panels)
        return panels, length if self.measure.kind == "path_error" else first

    def shown(self, panels: Panels, time: Array) -> Number:
        """One number at times, s, (lane, time), that the figure is a statistic of; for pictures."""
        if self.measure.rule == "ratio":
            rows = panels.at(time)
            return rows[0] / selected(primal(rows[1]) > 0, rows[1], np.nan)
        panels, of = self.number(panels)
        return of(panels.at(time))

    def time(self, panels: Panels) -> float:
        """Time, s, of the extreme that is the figure of the first lane, at a break on the side that has it; NaN of
        other figures, and of a constant."""
        rule = self.measure.rule
        if rule not in ("maximum", "minimum", "largest"):
            return float("nan")
        panels, of = self.number(panels)
        sign = SIGNS.get(rule, 1.0)
        if rule == "largest":
            above, below = (float(panels.top(of, way).value[0]) for way in (1.0, -1.0))
            sign = 1.0 if above >= -below else -1.0
        top = panels.top(of, sign)
        if top.constant[0]:
            return float("nan")
        low, width = primal(panels.low)[0, top.panel[0]], 2.0 * primal(panels.half)[0, top.panel[0]]
        beside = min(BESIDE * self.run.cycle.duration, width / 2)
        return float(np.clip(np.ravel(primal(panels.time(top)))[0], low + beside, low + width - beside))

    # ---- rules --------------------------------------------------------------------------------------------

    def _of_rule(self, panels: Panels) -> Number:
        rule = self.measure.rule
        if rule == "ratio":
            return self._ratio(panels)
        if rule == "work":
            return panels.mean(first) * panels.mean(lambda rows: rows[1]) * self._share
        panels, of = self.number(panels)
        if rule in ("mean", "value"):
            return panels.mean(of)
        if rule == "rms":
            square = panels.mean(lambda rows: of(rows) * of(rows))
            return namespace(square).sqrt(square)
        if rule == "dwell":
            return self._dwell(panels)
        if rule in ("maximum", "minimum"):
            return panels.top(of, SIGNS[rule]).value
        if rule == "line" and of is length:
            return 2.0 * panels.top(of).value
        if rule in ("peak-to-peak", "line"):
            return panels.top(of).value - panels.top(of, -1.0).value
        if rule == "largest":
            ends = panels.top(of).value, -panels.top(of, -1.0).value
            return namespace(*ends).maximum(*ends)
        if rule == "time ratio":
            return self._time_ratio(panels, of)
        place = panels.time(panels.top(of, SIGNS[rule]))
        found = self._dead_centre(panels, place) if rule.startswith("dead") else self._coordinate(place)
        gain = abs(gain_of(self.run))
        return near(found, self.nominal, gain) if self._around and gain and np.isfinite(self.nominal) else found

    @property
    def _around(self) -> bool:
        """Whether it comes again."""
        return self.run.cycle.periodic and not self.ends

    @property
    def _share(self) -> float:
        """Of the cycle."""
        return (self.ends[1] - self.ends[0]) / self.run.cycle.duration if self.ends else 1.0

    def _ratio(self, panels: Panels) -> Number:
        """Useful over drive work of the cycle; NaN where the loads drive.  [D 1]

        Of either 0 where it is no more than rounding or the error of its integral: it cancels.
        """
        means = [panels.mean(lambda rows, k=k: rows[k]) for k in (0, 1)]  # type: ignore[misc]
        sizes = [primal(panels.mean(lambda rows, k=k: np.abs(primal(rows[k])))) for k in (0, 1)]  # type: ignore[misc]
        errors = [np.maximum(panels.error(slice(k, k + 1)), CANCELLED * sizes[k]) for k in (0, 1)]
        useful, driven = (
            selected(np.abs(primal(mean)) > error, mean, 0.0) for mean, error in zip(means, errors, strict=True)
        )
        return useful / selected(primal(driven) > 0, driven, np.nan)

    def _dwell(self, panels: Panels) -> Number:
        """Share of the time within the band."""
        row = linear(panels.coefficients, lambda array: array[0])
        low, high = self.measure.within or (-np.inf, np.inf)
        share: Number = above(row, low) if np.isfinite(low) else 2.0
        share = share - above(row, high) if np.isfinite(high) else share
        shape = np.shape(primal(row))[:-1]
        times = linear(panels.weights, lambda array: np.broadcast_to(array, (*shape, ORDER)) @ GAUSS_WEIGHTS / 2)
        return linear(share * times, lambda array: np.sum(array, -1)) / linear(
            2.0 * times, lambda array: np.sum(array, -1)
        )

    def _coordinate(self, time: Number) -> Number:
        """The coordinate of the first driver at times, s, which may be beyond the cycle."""
        duration = self.run.cycle.duration
        if not self.run.cycle.periodic:
            return path_of(self.run, time)
        laps = np.floor(primal(time) / duration + 1e-12)
        within = time - laps * duration
        return path_of(self.run, within) + (laps if self.ends else 0.0) * gain_of(self.run)

    def _dead_centre(self, panels: Panels, time: Number) -> Number:
        """The coordinate of an extreme; NaN at an end of the range, where the motion does not turn back."""
        real = primal(panels.coefficients)[0]
        around = np.full(len(real), self._around)
        if self.measure.turning(self.run.system):
            around &= np.abs(real[:, -1] @ ENDS[:, 1] - real[:, 0] @ ENDS[:, 0]) <= np.pi
        start, end = self.ends or (0.0, self.run.cycle.duration)
        place = np.asarray(primal(time))
        at_end = np.minimum(np.abs(place - start), np.abs(place - end)) <= NARROW * (end - start)
        return selected(around | ~at_end, self._coordinate(time), np.nan)

    def _time_ratio(self, panels: Panels, of: Made) -> Number:
        """The longer of the two ways between the places of its largest and its least value over the shorter.

        NaN where the motion does not come again, is none, or jumps.
        """
        ways = [self._dead_centre(panels, panels.time(panels.top(of, sign))) for sign in (1.0, -1.0)]
        gain = gain_of(self.run)
        if not self._around or not gain:
            return (ways[0] - ways[1]) * np.nan
        share = (ways[0] - ways[1]) * (1.0 / gain)
        share = share - np.floor(primal(share))
        longer = namespace(share).maximum(share, 1.0 - share)
        return longer / selected(primal(longer) < 1 - SHORTEST, 1.0 - longer, np.nan)


def _across(panels: Panels) -> tuple[Panels, Made]:
    """Distances of a path from its least-squares line: in the plane a row, positive to the left; in space vectors."""
    count = np.shape(primal(panels.coefficients))[0]
    unit = (np.arange(ORDER) == 0) * 1.0
    rows = [linear(panels.coefficients, lambda array, k=k: array[k]) for k in range(count)]  # type: ignore[misc]
    offset = [row - _wide(panels.mean(lambda rows, k=k: rows[k])) * unit for k, row in enumerate(rows)]  # type: ignore[misc]
    path = panels.made(_stacked(offset))
    moments = [[path.mean(lambda rows, i=i, j=j: rows[i] * rows[j]) for j in range(count)] for i in range(count)]  # type: ignore[misc]
    along = [_wide(part) for part in direction(moments)]
    if count == 2:
        return panels.made(_stacked([offset[1] * along[0] - offset[0] * along[1]])), first
    way: Number = 0.0
    for part, share in zip(offset, along, strict=True):
        way = way + part * share
    return panels.made(_stacked([part - way * share for part, share in zip(offset, along, strict=True)])), length


def _wide(number: Number) -> Number:
    """A number of the lanes with axes for panels and coefficients."""
    return linear(number, lambda array: np.asarray(array)[..., None, None])


def _stacked(rows: Sequence[Number]) -> Number:
    """Rows along a new first axis."""
    if any(isinstance(row, Dual) for row in rows):
        parts = [(row.real, row.dual) if isinstance(row, Dual) else (row, 0.0 * row) for row in rows]
        return Dual(*(np.stack(np.broadcast_arrays(*side)) for side in zip(*parts, strict=True)))
    return np.stack(np.broadcast_arrays(*rows))


# ---- deviations, limits ---------------------------------------------------------------------------------------


def rows_of(parts: Sequence[Number], nominal: Sequence[Number] | None, axis: str = "") -> Number:
    """The rows that a figure is read of, (row, …), from the parts of a course.

    nominal: those of the nominal mechanism, which are taken off where a measure is judged against that; axis: of the
    turn from them, where the parts are the axes of a link in space.
    """
    if nominal is None:
        return _stacked(parts)
    if axis:
        return _stacked([turn(parts, nominal, axis)])
    return _stacked([part - before for part, before in zip(parts, nominal, strict=True)])


def columns(parts: Sequence[Number], lanes: int) -> Number:
    """Numbers at one place, (row, lane)."""
    return _stacked(
        [linear(part, lambda array: np.broadcast_to(np.asarray(array, float).reshape(-1), lanes)) for part in parts]
    )


def near(number: Number, to: Any, turn: float) -> Number:
    """The number and so many whole turns that it is as near as can be to another."""
    return number - turn * np.rint((primal(number) - to) / turn)


def within_limits(measure: Measure, figures: Array, least: Array, most: Array) -> NDArray[np.bool_]:
    """Whether each mechanism is within the limits and bounds of the measure; not where its figure is NaN.

    least, most: signed deviations from the nominal mechanism.
    """
    good = np.isfinite(figures)
    if measure.lower is not None:
        good &= least >= measure.lower
    if measure.upper is not None:
        good &= most <= measure.upper
    if measure.at_least is not None:
        good &= figures >= measure.at_least
    if measure.at_most is not None:
        good &= figures <= measure.at_most
    return np.asarray(good)


def known(measure: Measure, status: NDArray[np.int8]) -> NDArray[np.bool_]:
    """Where a course has an answer, by the status of the positions; it is to be NaN elsewhere."""
    if measure.of_motion:
        return status < (Status.NOT_ASSEMBLED if measure.of_places else Status.SINGULAR)
    if measure.wants_margin:
        return status < Status.LOAD_UNDEFINED
    return status < Status.NOT_CONVERGED


def follow(angles: Array, rate: Array, time: Array) -> None:
    """Whole turns in place so that every angle follows the rates from the one before."""
    steps = np.diff(time)
    if len(steps) and np.allclose(steps, steps[0], rtol=1e-9, atol=0):
        unwrap_row(angles, rate, float(steps[0]))
        return
    ahead = (rate[:-1] + rate[1:]) / 2 * steps
    turns = np.cumsum(np.nan_to_num(np.rint((ahead - np.diff(angles)) / TURN)))
    angles[1:] += TURN * turns
