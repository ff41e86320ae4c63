"""Linear tolerance analysis: exact sensitivities of every measure at every position, worst case, RSS, contributions.

∂y/∂p are dual parts, carried through the whole analysis at once: motion, friction, what makes a figure of a course.
A largest deviation, or a distance from the nominal place, has no derivative at the nominal mechanism, where it is 0:
of these the derivatives are those of the course at the position where the worst case is largest, of a distance along
the direction of the largest scatter, of a peak-to-peak deviation between the two positions where it is worst.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.namespace import Number
from trunnion.algebra.panels import selected
from trunnion.errors import Status
from trunnion.measures.angles import near, within
from trunnion.measures.evaluation import NumpyKernel
from trunnion.measures.lines import turn
from trunnion.measures.many import Many, Read
from trunnion.measures.measures import Measure
from trunnion.measures.positions import PositionPlan, Window, moved
from trunnion.studies.tolerance.effects import Effects, FirstOrder, Spread
from trunnion.studies.tolerance.search import Corner, search

__all__ = [
    "Linear",
    "Of",
    "Reference",
    "against",
    "by_position",
    "limited",
    "limits",
    "linear",
    "references",
    "searched",
    "worst_place",
]

Array = NDArray[np.float64]
AT_ONCE = 20_000  # numbers in an array of one walk with dual numbers
MOST_PAIRS = 720  # positions between which a peak-to-peak deviation is looked for
ROUNDS, AROUND = 4, 17  # in which the worst position is looked for, and places about it in each


@dataclass(frozen=True)
class Reference:
    """A measure of the nominal mechanism.

    parts: its course at the positions of the window, angles without jumps; figure: 0 for what is a deviation by itself,
    NaN where it has none; time: of an extreme, s, else NaN; turning: whether it is an angle; attitude: whether it is
    the turn of a link in space; against: whether it is judged against the nominal mechanism.
    """

    measure: Measure
    window: Window
    parts: tuple[Array, ...]
    figure: float
    time: float
    turning: bool
    attitude: bool
    against: bool


@dataclass(frozen=True)
class Of:
    """One measure to first order.

    figure: of its figure; course: of the course at every position of the window, curve: the nominal one. total: of the
    figure, all together. place: position in the window nearest to where the figure is taken, −1 if it is of no single
    one; time: of that place, and of an extreme, s.
    lead: what the search of the worst case begins with, figure where that has derivatives.
    """

    reference: Reference
    figure: FirstOrder
    course: FirstOrder
    total: Spread
    curve: Array
    place: int
    time: float
    lead: FirstOrder

    @property
    def measure(self) -> Measure:
        return self.reference.measure


@dataclass(frozen=True)
class Linear:
    """All measures to first order."""

    effects: Effects
    measures: Sequence[Of]
    status: NDArray[np.int8]


def references(kernel: NumpyKernel, plan: PositionPlan, many: Many) -> dict[str, Reference]:
    """Every measure of the nominal mechanism, at the positions of the plan too."""
    system, values = kernel.run.system, many.values
    curves, _ = kernel.courses(values, plan.times)
    references_of = {}
    for measure in kernel.measures:
        window, turning = plan.windows[measure.name], measure.turning(system)
        parts = [
            np.array(np.broadcast_to(np.asarray(primal(part), float), plan.times.shape)[window.index])
            for part in curves[measure.name]
        ]
        if turning:
            parts[0] = near(parts[0], many.angle(measure, window.time))
        attitude = measure.of_attitude(system)
        against = measure.against_nominal(system)
        figure, time = many.figures[measure.name], many.times[measure.name]
        references_of[measure.name] = Reference(measure, window, tuple(parts), figure, time, turning, attitude, against)
    return references_of


def linear(
    kernel: NumpyKernel, plan: PositionPlan, effects: Effects, nominal: Mapping[str, Reference], many: Many
) -> Linear:
    """First order of every measure about the nominal mechanism."""
    values = effects.values()
    courses, status = _courses(kernel, plan, effects, values)
    lines = {name: reference.window.time for name, reference in nominal.items() if reference.measure.rule == "line"}
    rated = [measure for measure in kernel.measures if _rated(nominal[measure.name]) or measure.name in lines]
    reading = many if len(rated) == len(kernel.measures) else many.only(rated)
    reads, orders = reading.read(values, lines), []
    for measure in kernel.measures:
        reference, read = nominal[measure.name], reads.get(measure.name)
        place = None
        if by_position(reference):
            place = worst_place(kernel, values, effects, reference, many, lambda course: course.total.worst)
        orders.append(_of(reference, effects, courses[measure.name], read, place))
    return Linear(effects, orders, status[0])


Course = list[Dual]  # parts, (row, position) each


def _courses(
    kernel: NumpyKernel, plan: PositionPlan, effects: Effects, values: Mapping[str, Number]
) -> tuple[dict[str, Course], NDArray[np.int8]]:
    """Every course over all positions with its derivatives, a part of the positions at a time."""
    rows, times = len(effects.rows), moved(kernel.run, values, plan.times)
    count = len(plan.times)
    step = max(1, AT_ONCE // rows)
    by_measure: dict[str, Course] = {}
    status = np.empty((rows, count), np.int8)
    for low in range(0, count, step):
        window = slice(low, min(low + step, count))
        courses, status[:, window] = kernel.courses(values, times[..., window])
        for name, course in courses.items():
            if name not in by_measure:
                by_measure[name] = [Dual(np.empty((rows, count)), np.empty((rows, count))) for _ in course]
            for row, part in zip(by_measure[name], course, strict=True):
                row.real[:, window], row.dual[:, window] = effects.slopes(part, (window.stop - low,))
    return by_measure, status


def _of(
    reference: Reference, effects: Effects, course: Course, read: Read | None, placed: tuple[float, Array] | None
) -> Of:
    """First order of one measure. read: of its figure, or of the line that it is of; placed: where a figure is that
    is taken at the worst position, and its derivatives."""
    measure, window, time = reference.measure, reference.window, reference.time
    parts = [Dual(part.real[:, window.index], part.dual[:, window.index]) for part in course]
    real, slope = _scalar(reference, effects, parts, read.shown if read else 0.0)
    over_course = FirstOrder(effects, effects.without_noise(slope))
    lead, place = None, -1
    if placed is not None:
        time, steep = placed
        place = int(np.argmin(np.abs(window.time - time))) if np.isfinite(time) else -1
    elif read is None or not _rated(reference):
        steep = np.full(len(real), np.nan)
        lead = FirstOrder(effects, over_course.slope[:, _top(over_course.total.upper)])
    else:
        value, steep = effects.slopes(read.figure, ())
        place = 0 if measure.rule == "value" and not measure.in_time else -1
        time = float(window.time[0]) if place == 0 else time
        steep = np.where(np.isfinite(value), steep, np.nan)  # of what does not exist
    figure = FirstOrder(effects, effects.without_noise(steep))
    total = _ends(measure, over_course.total, figure.total) if by_position(reference) else figure.total
    return Of(reference, figure, over_course, total, real[0], place, time, lead or figure)


def _ends(measure: Measure, course: Spread, total: Spread) -> Spread:
    """Least and largest deviation of a figure that is made of the deviations at all positions.

    A distance and a spread are at least 0; a maximum over the positions is at least the largest of what each can be at
    least.
    """
    lower, upper = total.lower, total.upper
    if measure.kind == "path_error" or measure.rule in ("peak-to-peak", "largest"):
        # to either side: a distance has a direction that has no sign, a largest |deviation| none either
        upper = upper if measure.rule == "peak-to-peak" else np.maximum(-lower, upper)
        lower = np.zeros_like(lower)
    elif measure.rule == "maximum":
        lower, upper = (np.asarray(np.max(np.nan_to_num(end, nan=-np.inf))) for end in (course.lower, course.upper))
    elif measure.rule == "minimum":
        lower, upper = (np.asarray(np.min(np.nan_to_num(end, nan=np.inf))) for end in (course.lower, course.upper))
    return total._replace(lower=lower, upper=upper)


def by_position(reference: Reference) -> bool:
    """Whether the figure is 0 of the nominal mechanism, without a derivative, but has that of the course somewhere.

    Of a distance neither the mean, the least nor any spread has; of other deviations the root of the mean square has
    not; and nothing is largest or least of a course that is 0 throughout.
    """
    rule = reference.measure.rule
    if reference.measure.kind == "path_error":
        return rule in ("deviation", "value", "maximum", "largest")
    return rule == "deviation" or (reference.against and rule in ("maximum", "minimum", "largest", "peak-to-peak"))


def limited(measure: Measure) -> bool:
    """Whether a measure has a limit or a bound."""
    return any(end is not None for end in (measure.lower, measure.upper, measure.at_least, measure.at_most))


def limits(of: Of) -> tuple[float, float]:
    """Least and largest deviation from nominal that a measure may have; infinite where there is no limit."""
    measure = of.measure
    lower = -np.inf if measure.lower is None else measure.lower
    upper = np.inf if measure.upper is None else measure.upper
    least = -np.inf if measure.at_least is None else measure.at_least
    most = np.inf if measure.at_most is None else measure.at_most
    if measure.rule == "deviation":
        return max(lower, -most), min(upper, most)
    if not against(of):
        return max(lower, least - of.reference.figure), min(upper, most - of.reference.figure)
    if measure.rule == "maximum" and measure.kind != "path_error":
        return -np.inf, min(upper, most)
    if measure.rule == "minimum" and measure.kind != "path_error":
        return max(lower, least), np.inf
    if measure.rule == "mean" and measure.kind != "path_error":
        return max(lower, least), min(upper, most)
    return -min(upper, most), min(upper, most)  # what has a size and no sign


def against(of: Of) -> bool:
    """Whether the figure is made of deviations from the nominal mechanism and is 0 there."""
    return of.measure.kind == "path_error" or (of.reference.against and of.measure.rule != "value")


def _rated(reference: Reference) -> bool:
    """Whether the figure has derivatives at the nominal mechanism, which those of most deviations from it have not."""
    rule, kind = reference.measure.rule, reference.measure.kind
    return not by_position(reference) and kind != "path_error" and (rule in ("mean", "value") or not reference.against)


def _scalar(reference: Reference, effects: Effects, parts: Sequence[Dual], line: Number = 0.0) -> tuple[Array, Array]:
    """One number a position, (row, position), with its derivative, that stands for the course.

    line: the distances from the line of a path.
    """
    count = np.shape(parts[0].real)[1]
    if reference.measure.kind == "path_error":
        slopes = np.array([part.dual for part in parts])  # (axis, row, position)
        scaled = slopes * effects.weights[:, None]
        scatter = np.einsum("arp,brp->pab", scaled, scaled)
        along = np.linalg.eigh(np.nan_to_num(scatter))[1][:, :, -1]  # (position, axis)
        return np.zeros_like(parts[0].real), np.einsum("arp,pa->rp", slopes, along)
    if reference.measure.rule == "line":
        return effects.slopes(line, (count,))
    if reference.attitude:
        return effects.slopes(turn(parts, [primal(part)[0] for part in parts], reference.measure.axis), (count,))
    if len(parts) > 1:
        useful, driven = parts
        return effects.slopes(useful / selected(primal(driven) > 0, driven, np.nan), (count,))
    real = parts[0].real.copy()
    if reference.turning and len(reference.parts[0]) == count:
        real += reference.parts[0] - real[0]
    if reference.measure.of.against:
        real -= real[:1]
    return real, parts[0].dual


def worst_place(
    kernel: NumpyKernel, values: Mapping[str, Number], effects: Effects, reference: Reference, many: Many,
    size: Callable[[FirstOrder], Array],
) -> tuple[float, Array]:  # fmt: skip
    """Time, s, at which a course is worst, whatever the steps, and the derivatives of the measure there, (row,).

    NaN s of a peak-to-peak deviation, which is of two places. kernel: of all measures; values: of the rows of the
    effects; size: how bad a course is, (position,).
    """
    run, measure, time = kernel.run, reference.measure, many.spots(reference.measure)
    kernel = replace(kernel, measures=[measure])
    for _ in range(ROUNDS):
        curves, status = kernel.courses(values, moved(run, values, within(run, time)))
        parts = [Dual(*effects.slopes(part, (len(time),))) for part in curves[measure.name]]
        course = FirstOrder(effects, effects.without_noise(_scalar(reference, effects, parts)[1]))
        if measure.rule == "peak-to-peak" and by_position(reference):
            return float("nan"), _widest(course)
        sound = np.broadcast_to(status, (len(effects.rows), len(time)))[0] < Status.NEAR_SINGULAR
        sizes = np.nan_to_num(size(course)) * (sound | ~np.any(sound))  # first order says little at a dead centre
        top = int(np.argmax(sizes))
        place, steep = float(time[top]), course.slope[:, top]
        if len(time) == 1:
            break
        time = np.linspace(time[max(top - 1, 0)], time[min(top + 1, len(time) - 1)], AROUND)
        time = np.sort(np.append(time, place))
    return place, steep


def _widest(course: FirstOrder) -> Array:
    """Derivatives of the difference of a course between the two of its places where that is worst."""
    slope = course.slope
    best, widest = -1.0, slope[:, 0] * 0.0
    for i in np.unique(np.linspace(0, slope.shape[1] - 1, min(slope.shape[1], MOST_PAIRS)).astype(int)):
        change = slope - slope[:, [i]]
        upper = np.nan_to_num(FirstOrder(course.effects, change).total.upper)
        top = int(np.argmax(upper))
        if upper[top] > best:
            best, widest = float(upper[top]), change[:, top]
    return widest


def searched(many: Many, first: Linear, of: Of) -> tuple[Corner, Corner]:
    """The least and the largest deviation of the figure on the mechanism itself, with the numbers there.

    Of a figure over all positions: the least and the largest deviation of the course from nominal anywhere.
    """
    alone = many.only([of.measure])

    def ends(sign: float) -> Corner:
        def objective(values: Mapping[str, Number], effects: Effects) -> tuple[Array, Array]:
            read = alone.read(values)[of.measure.name]
            return effects.slopes(read.most if sign > 0 else read.least, ())

        start = of.lead.corner(sign)
        alone.tune(first.effects.values(start))
        return search(first.effects, objective, start, sign, bool(np.isfinite(of.reference.figure)))

    return ends(-1.0), ends(1.0)


def _top(numbers: Array) -> int:
    """Place of the largest; the first of none."""
    return int(np.nanargmax(numbers)) if np.any(np.isfinite(numbers)) else 0
