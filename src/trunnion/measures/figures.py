"""The figure of a measure: one number a sample, made of its course over the positions.

A course is what `Measure.curve` gives at the positions of a `positions.Plan`; `reference` keeps that of the
nominal mechanism once, `figure` makes the numbers of many samples. Angles follow those of the nominal mechanism, from
which they are less than half a turn away. Extremes lie between positions too (`extremes`: value off by O(h⁷), place by
O(h⁶), h the step, where the course is smooth); means are integrals between the places where the mechanism switches
(`quadrature`, `averages`). A figure is NaN where a position that it needs has no answer, and a dead centre that is not
within its range is NaN.

With dual numbers a figure has its exact derivatives. That of a largest |deviation| or of a distance from the nominal
place has none at the nominal mechanism itself, where it is 0 whatever way one goes: take those of the course there.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.quadrature import CANCELLED
from trunnion.algebra.unwrap import unwrap_row
from trunnion.errors import Status
from trunnion.measures.dwell import share_within
from trunnion.measures.extremes import FLAT, Extreme, Grid, largest, shape_of
from trunnion.measures.lines import distances, total, turn
from trunnion.measures.measures import Measure
from trunnion.measures.positions import Window
from trunnion.solve.switches import Bend
from trunnion.solve.system import System

__all__ = [
    "RULES", "SHORTEST", "Curve", "Reference", "course_of", "figure", "follow", "judged", "kept",
    "known", "moment", "reference", "shown", "span",
]  # fmt: skip

Array = NDArray[np.float64]
TURN = 2 * np.pi
SHORTEST = 1e-5  # of a period: a way back that is shorter is a jump


class Curve(NamedTuple):
    """What a figure is made of: one number, (…, position), at rising times, s.

    coordinate: of the first driver there, which gains so much in a period; there is no period of a range. band: of a
    dwell.
    """

    number: Number
    grid: Grid
    coordinate: Array
    gain: float
    band: tuple[float, float] = (-np.inf, np.inf)

    def largest(self, sign: float = 1.0) -> Extreme:
        """The largest value, or the least one with its sign changed."""
        return largest(self.number if sign == 1.0 else sign * self.number, self.grid)

    def both(self) -> tuple[Number, Number]:
        """The largest value, and the least one with its sign changed."""
        found = largest(_both_ways(self.number), self.grid).value
        return found[0], found[1]

    def place(self, sign: float = 1.0) -> Number:
        """The coordinate at which it is largest."""
        return self.largest(sign).of(self.coordinate, self.gain)


def _both_ways(number: Number, shape: tuple[int, ...] | None = None) -> Number:
    """The number and its negative, one after the other along a new first axis."""
    shape = shape or shape_of(number)
    if isinstance(number, Dual):
        return Dual(_both_ways(number.real, shape), _both_ways(number.dual, shape))
    found = np.empty((2, *shape))
    found[0] = number
    np.negative(found[0], out=found[1])
    return found


# ---- rules ----------------------------------------------------------------------------------------------------


def _largest(course: Curve) -> Number:
    """The largest |value|."""
    above, below = course.both()
    return namespace(above, below).maximum(above, below)


def _dead_centre(course: Curve, sign: float = 1.0) -> Number:
    """The place of the largest value within the range; NaN if it is at an end, where the motion does not turn back."""
    found = course.largest(sign)
    return found.of(course.coordinate, course.gain) + np.where(found.inside, 0.0, np.nan)


def _time_ratio(course: Curve) -> Number:
    """The longer of the two ways between the places of its largest and its least value over the shorter.

    At an even drive it is that of their times: (1 − s)/s or s/(1 − s), s being their distance over that of a period.
    NaN where the motion does not come again, is none, or jumps.
    """
    ways = _dead_centre(course) - _dead_centre(course, -1.0)
    if course.grid.period is None or not course.gain:
        return ways * np.nan
    share = ways * (1.0 / course.gain)
    share = share - np.floor(primal(share))
    xp = namespace(share)
    longer = xp.maximum(share, 1.0 - share)
    return longer / xp.where(primal(longer) < 1 - SHORTEST, 1.0 - longer, np.nan)


def _rms(course: Curve) -> Number:
    square = total(course.number * course.number, course.grid.weights)
    return namespace(square).sqrt(square)


RULES: dict[str, Callable[[Curve], Number]] = {
    "value": lambda course: course.number[..., 0],
    "maximum": lambda course: course.largest().value,
    "minimum": lambda course: -course.largest(-1.0).value,
    "peak-to-peak": lambda course: operator.add(*course.both()),
    "mean": lambda course: total(course.number, course.grid.weights),
    "rms": _rms,
    "largest": _largest,
    "place-of-maximum": lambda course: course.place(),
    "place-of-minimum": lambda course: course.place(-1.0),
    "dead centre": _dead_centre,
    "dead centre, least": lambda course: _dead_centre(course, -1.0),
    "time ratio": _time_ratio,
    "deviation": _largest,  # of the course less that of the nominal mechanism
    "dwell": lambda course: share_within(course.number, course.grid, course.band),
}


def _ratio(useful: Number, driven: Number, course: Curve) -> Number:
    """Useful over drive work of the cycle; NaN where the loads drive.  [D 1]"""
    work = total(driven, course.grid.weights)
    share = _net(useful, course) / namespace(work).where(primal(work) > 0, work, np.nan)
    return namespace(share, work).where(primal(_net(driven, course)) > 0, share, np.nan)


def _net(power: Number, course: Curve) -> Number:
    """The mean of a power, 0 where it is no more than rounding or the error of its integral: it cancels.

    The error as QUADPACK tells it from two rules; see `quadrature`.
    """
    value, real = total(power, course.grid.weights), primal(power)
    size = total(np.abs(real), course.grid.weights)
    off = np.abs(primal(value) - total(real, course.grid.rough)) / np.where(size > 0, size, 1.0)
    error = size * np.maximum(CANCELLED, np.minimum(off, (200 * off) ** 1.5))
    return namespace(value).where(np.abs(primal(value)) <= error, 0.0, value)


# ---- the nominal mechanism and others -------------------------------------------------------------------------


@dataclass(frozen=True)
class Reference:
    """A measure of the nominal mechanism.

    parts: its course, (position,) each, angles without jumps; turning: whether it is an angle; attitude: whether it is
    the turn of a link in space; turns: what an angle gains in a period, rad; figure: its figure, 0 for what is a
    deviation by itself; NaN where it has none. corner: whether that is an extreme at a corner of the course, `corners`;
    bends: of the forces, beside which it may be.
    """

    measure: Measure
    window: Window
    positions: int
    turning: bool
    attitude: bool
    parts: tuple[Array, ...]
    turns: float = 0.0
    figure: float = 0.0
    corner: bool = False
    bends: tuple[Bend, ...] = ()

    @property
    def against(self) -> bool:
        """Whether the course is taken less that of the nominal mechanism."""
        return self.measure.of.against or self.attitude or self.measure.rule == "deviation"

    @property
    def opened(self) -> bool:
        """Whether the course gains whole turns in a period, so that its end is another value than its start."""
        return bool(self.window.period is not None and self.turns and not self.against)

    @cached_property
    def grid(self) -> Grid:
        """The positions as the places of a curve."""
        time, period = self.window.time, self.window.period
        if not self.opened or period is None:
            return Grid(time, period, self.window.weights)
        return Grid(np.append(time, time[0] + period))


def reference(
    measure: Measure, curve: Sequence[Number], window: Window, system: System, rate: Number | None = None
) -> Reference:
    """A measure of the nominal mechanism from its course over all positions of the plan.

    rate: of the course by time, `Measure.rate`, so that an angle is followed over more than half a turn a step.
    """
    positions = max(shape_of(part)[-1] if shape_of(part) else 1 for part in curve)
    positions = max(positions, int(np.max(window.index)) + 1)
    parts = tuple(_row(window.of(primal(part), positions), len(window.index)) for part in curve)
    turning, turns = measure.turning(system), 0.0
    if turning:
        rates = None if rate is None else _row(window.of(primal(rate), positions), len(window.index))
        followed, turns = _followed(parts[0], window, rates)
        parts = (followed,)
    found = Reference(measure, window, positions, turning, measure.of_attitude(system), parts, turns)
    if measure.rule == "deviation":
        return replace(found, figure=0.0 if all(np.all(np.isfinite(part)) for part in parts) else np.nan)
    return replace(found, figure=float(np.ravel(_figure(found, parts))[0]))


def figure(curve: Sequence[Number], nominal: Reference) -> Number:
    """The figure of a measure, (sample,), from its course, (sample, position) each, over all positions of the plan.

    Floats, arrays or dual numbers; any leading axes. NaN where a position needed has no answer.
    """
    with np.errstate(all="ignore"):
        return _turned(_figure(nominal, _parts(curve, nominal)), nominal)


def _turned(found: Number, nominal: Reference) -> Number:
    """A figure, or a place in the period in which the nominal mechanism has it."""
    if nominal.measure.of_place and nominal.window.period is not None and nominal.window.gain:
        return _near(found, nominal.figure, abs(nominal.window.gain))
    return found


def shown(curve: Sequence[Number], nominal: Reference) -> Number:
    """One number a position of the window, (sample, position), that the figure is a statistic of; for pictures.

    Of a path error the distance, of the efficiency of the cycle that of the instant, of a straightness the distance
    from the line through the path, of what is judged against the nominal mechanism the deviation from it.
    """
    with np.errstate(all="ignore"):
        parts, measure = _parts(curve, nominal), nominal.measure
        if measure.rule == "line":
            return distances(parts, nominal.grid.weights)
        if measure.rule == "ratio":
            useful, driven = parts
            xp = namespace(driven)
            return useful / xp.where(primal(driven) > 0, driven, np.nan)
        return _single(nominal, parts)


def moment(nominal: Reference) -> float:
    """Time, s, at which the nominal mechanism has the extreme that is its figure; NaN of other figures.

    Rising with the times of the window; NaN as well where the course does not change, or is a deviation, so 0.
    """
    rule = nominal.measure.rule
    if rule not in ("maximum", "minimum", "largest") or nominal.against or len(nominal.window.index) < 2:
        return float("nan")
    with np.errstate(all="ignore"):
        course = course_of(nominal, _single(nominal, nominal.parts))
        sizes = np.abs(course.number)
        if not np.ptp(course.number) > FLAT * np.max(sizes):
            return float("nan")
        sign = -1.0 if rule == "minimum" else 1.0
        if rule == "largest":
            above, below = course.both()
            sign = 1.0 if above >= below else -1.0
        return float(np.ravel(course.largest(sign).place)[0])


def span(curve: Sequence[Number], nominal: Reference) -> tuple[Number, Number]:
    """Least and largest signed deviation of each sample from the nominal mechanism: of its figure, which is both, or
    over the positions where the figure is a largest |deviation|."""
    if nominal.measure.rule != "deviation":
        change = figure(curve, nominal) - nominal.figure
        return change, change
    with np.errstate(all="ignore"):
        course = course_of(nominal, _single(nominal, _parts(curve, nominal)))
        most, least = course.both()
        return -least, most


def kept(curve: Sequence[Number], nominal: Reference, figures: Number | None = None) -> NDArray[np.bool_]:
    """Whether each sample is within the limits and bounds of the measure; not where its figure is NaN."""
    figures = primal(figure(curve, nominal) if figures is None else figures)
    if nominal.measure.rule != "deviation":
        return _within(nominal.measure, figures, figures - nominal.figure, figures - nominal.figure)
    least, most = span(curve, nominal)
    return _within(nominal.measure, figures, primal(least), primal(most))


def _within(measure: Measure, figures: Array, least: Array, most: Array) -> NDArray[np.bool_]:
    """least, most: signed deviations from the nominal mechanism."""
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


def judged(curve: Sequence[Number], nominal: Reference) -> tuple[Number, NDArray[np.bool_], Number]:
    """`figure`, `kept` and `shown` of plain numbers at once, each piece worked out once."""
    measure = nominal.measure
    if measure.rule in ("line", "ratio", "work"):
        figures = figure(curve, nominal)
        return figures, kept(curve, nominal, figures), shown(curve, nominal)
    with np.errstate(all="ignore"):
        number = _single(nominal, _parts(curve, nominal))
        course = course_of(nominal, number)
        if measure.rule == "deviation":
            above, below = course.both()
            figures = np.maximum(above, below)
            return figures, _within(measure, figures, -below, above), number
        figures = _turned(RULES[measure.rule](course), nominal)
        return figures, _within(measure, figures, figures - nominal.figure, figures - nominal.figure), number


def known(measure: Measure, status: NDArray[np.int8]) -> NDArray[np.bool_]:
    """Where a course has an answer, by the status of the positions; it is to be NaN elsewhere."""
    if measure.of_motion:
        return status < (Status.NOT_ASSEMBLED if measure.of_places else Status.SINGULAR)
    if measure.wants_margin:
        return status < Status.LOAD_UNDEFINED
    return status < Status.NOT_CONVERGED


# ---- from course to figure ------------------------------------------------------------------------------------


def _figure(nominal: Reference, parts: Sequence[Number]) -> Number:
    rule = nominal.measure.rule
    if rule == "line":
        course = course_of(nominal, parts[0])
        away = course._replace(number=distances(parts, course.grid.weights))
        return RULES["peak-to-peak"](away) if len(parts) == 2 else 2.0 * RULES["maximum"](away)
    if rule == "ratio":
        return _ratio(parts[0], parts[1], course_of(nominal, parts[0]))
    if rule == "work":
        course = course_of(nominal, parts[0])
        mean, duration = (total(part, course.grid.weights) for part in parts)
        return mean * duration * nominal.window.share
    number = _single(nominal, parts)
    return RULES[rule](course_of(nominal, number))


def _single(nominal: Reference, parts: Sequence[Number]) -> Number:
    """The one number of the course, less that of the nominal mechanism where it is judged against that."""
    if nominal.measure.kind == "path_error":
        square: Number = 0.0
        for part, meant in zip(parts, nominal.parts, strict=True):
            square = square + (part - meant) * (part - meant)
        return namespace(square).sqrt(square)
    if nominal.attitude:
        return turn(parts, nominal.parts, nominal.measure.axis)
    return parts[0] - nominal.parts[0] if nominal.against else parts[0]


def course_of(nominal: Reference, number: Number) -> Curve:
    """A course over the window; one that gains whole turns in a period with the end of the period, as a range."""
    window, band = nominal.window, nominal.measure.within or (-np.inf, np.inf)
    if not nominal.opened:
        return Curve(number, nominal.grid, window.coordinate, window.gain, band)
    again = np.append(np.arange(len(window.time)), 0)
    gains = np.append(np.zeros(len(window.time)), nominal.turns)
    coordinate = np.append(window.coordinate, window.coordinate[0] + window.gain)
    return Curve(number[..., again] + gains, nominal.grid, coordinate, window.gain, band)


def _parts(curve: Sequence[Number], nominal: Reference) -> tuple[Number, ...]:
    """The course over the window; an angle as near as can be to that of the nominal mechanism."""
    parts = tuple(nominal.window.of(part, nominal.positions) for part in curve)
    return (_near(parts[0], nominal.parts[0], TURN),) if nominal.turning else parts


def _near(number: Number, to: Number, turn: float) -> Number:
    return number - turn * np.rint((primal(number) - to) / turn)


def _row(number: Number, count: int) -> Array:
    """One row of plain numbers, a copy."""
    return np.array(np.broadcast_to(np.asarray(number, float).reshape(-1, np.shape(number)[-1])[0], count))


def _followed(angle: Array, window: Window, rate: Array | None) -> tuple[Array, float]:
    """An angle without jumps, and the whole turns that it gains in a period, rad."""
    periodic = window.period is not None and len(angle) > 1
    time = np.append(window.time, window.time[0] + (window.period or 0.0)) if periodic else window.time
    angles = np.append(angle, angle[0]) if periodic else angle
    if rate is None:
        sound = np.isfinite(angles)
        angles[sound] = np.unwrap(angles[sound])
    else:
        # rates for a step of 1: the step of a window is another at its ends
        ahead = np.append(rate, rate[0]) if periodic else rate
        follow(angles, ahead, time)
    if not periodic:
        return angles, 0.0
    gained = angles[-1] - angles[0]
    return angles[:-1], float(TURN * np.rint(gained / TURN)) if np.isfinite(gained) else 0.0


def follow(angles: Array, rate: Array, time: Array) -> None:
    """Whole turns in place so that every angle follows the rates from the one before."""
    steps = np.diff(time)
    if len(steps) and np.allclose(steps, steps[0], rtol=1e-9, atol=0):
        unwrap_row(angles, rate, float(steps[0]))
        return
    ahead = (rate[:-1] + rate[1:]) / 2 * steps
    turns = np.cumsum(np.nan_to_num(np.rint((ahead - np.diff(angles)) / TURN)))
    angles[1:] += TURN * turns
