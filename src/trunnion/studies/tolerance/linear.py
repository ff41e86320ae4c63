"""Linear tolerance analysis: exact sensitivities of every measure at every position, worst case, RSS, contributions.

∂y/∂p are dual parts, carried through the whole analysis at once: motion, friction, what makes a figure of a course.
A largest deviation, or a distance from the nominal place, has no derivative at the nominal mechanism, where it is 0:
of these the derivatives are those of the course at the position where the worst case is largest, of a distance along
the direction of the largest scatter, of a peak-to-peak deviation between the two positions where it is worst.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, derivative, primal
from trunnion.algebra.namespace import Number
from trunnion.measures.corners import change_by_step
from trunnion.measures.evaluation import NumpyKernel, at_corner
from trunnion.measures.figures import Reference, figure, shown, span
from trunnion.measures.measures import Measure
from trunnion.measures.positions import PositionPlan
from trunnion.studies.tolerance.effects import Effects, FirstOrder
from trunnion.studies.tolerance.search import Corner, search
from trunnion.studies.tolerance.zones import Spread

__all__ = ["Linear", "Of", "by_position", "linear", "searched"]

Array = NDArray[np.float64]
AT_ONCE = 20_000  # numbers in an array of one walk with dual numbers
STEP, STEP_OF_NONE = 1e-4, 1e-5  # of a number, and of the size of the mechanism for one that is 0: of a difference
MOST_PAIRS = 720  # positions between which a peak-to-peak deviation is looked for


@dataclass(frozen=True)
class Of:
    """One measure to first order.

    figure: of its figure; course: of the course at every position of the window, curve: the nominal one. total: of the
    figure, all together. place: position in the window at which the figure is taken, −1 if it is of no single one.
    lead: what the search of the worst case begins with, figure where that has derivatives.
    """

    reference: Reference
    figure: FirstOrder
    course: FirstOrder
    total: Spread
    curve: Array
    place: int
    lead: FirstOrder

    @property
    def measure(self) -> Measure:
        return self.reference.measure


@dataclass(frozen=True)
class Linear:
    """All measures to first order."""

    effects: Effects
    plan: PositionPlan
    measures: Sequence[Of]
    status: NDArray[np.int8]


def linear(kernel: NumpyKernel, plan: PositionPlan, effects: Effects, known: Mapping[str, Reference]) -> Linear:
    """First order of every measure about the nominal mechanism."""
    values = effects.values()
    courses, status = _courses(kernel, plan, effects, values)
    found = []
    for measure in kernel.measures:
        one = known[measure.name]
        steep = _at_corner(kernel, plan, effects, values, one)[1] if one.corner else None
        found.append(_of(one, effects, courses[measure.name], steep))
    return Linear(effects, plan, found, status[0])


Course = list[Dual]  # parts, (row, position) each


def _courses(
    kernel: NumpyKernel, plan: PositionPlan, effects: Effects, values: Mapping[str, Number]
) -> tuple[dict[str, Course], NDArray[np.int8]]:
    """Every course over all positions with its derivatives, a part of the positions at a time."""
    rows, times = len(effects.rows), plan.moved(values)
    count = len(plan.times)
    step = max(1, AT_ONCE // rows)
    found: dict[str, Course] = {}
    status = np.empty((rows, count), np.int8)
    for low in range(0, count, step):
        window = slice(low, min(low + step, count))
        courses, status[:, window] = kernel.courses(values, times[..., window])
        for name, course in courses.items():
            if name not in found:
                found[name] = [Dual(np.empty((rows, count)), np.empty((rows, count))) for _ in course]
            for whole, part in zip(found[name], course, strict=True):
                whole.real[:, window], whole.dual[:, window] = effects.slopes(part, (window.stop - low,))
    return found, status


def _at_corner(
    kernel: NumpyKernel, plan: PositionPlan, effects: Effects, values: Mapping[str, Number], known: Reference
) -> tuple[Array, Array]:
    """A figure at a corner of the course and its derivatives, (row,): differences, as the corner moves too."""
    alone = replace(kernel, measures=[known.measure])
    step = _steps(effects)

    def figures(way: float) -> Array:
        moved = {path: primal(one) + way * step[:, None] * derivative(one) for path, one in values.items()}
        course = _courses(alone, plan, effects, moved)[0][known.measure.name][0].real
        return at_corner(alone, plan, moved, known, course[:, known.window.index], course[:, 0])

    middle, moving = figures(0.0), step > 0
    if not np.any(moving):
        return middle, 0.0 * step
    found = change_by_step(figures(-1.0), middle, figures(1.0))
    return middle, np.divide(found, step, out=np.zeros_like(found), where=moving)


def _steps(effects: Effects) -> Array:
    """By how much the number of each row is moved for a difference, (row,), whatever its tolerance; 0: not at all."""
    run = effects.inputs.run
    size = float(np.ravel(primal(run.system.size(run.values)))[0])
    known = [abs(float(np.ravel(primal(run.values.get(row.seed, 0.0)))[0])) for row in effects.rows]
    return np.array([
        (STEP * value if value else STEP_OF_NONE * size) if row.seed else 0.0
        for row, value in zip(effects.rows, known, strict=True)
    ])  # fmt: skip


def _of(known: Reference, effects: Effects, course: Course, steep_at_corner: Array | None = None) -> Of:
    measure, window = known.measure, known.window
    parts = [Dual(part.real[:, window.index], part.dual[:, window.index]) for part in course]
    real, slope = _scalar(known, effects, course, parts)
    whole = FirstOrder(effects, effects.without_noise(slope))
    lead = None
    if by_position(known):
        place, steep = _worst(measure, whole)
    elif (known.against and measure.rule not in ("mean", "value")) or measure.kind == "path_error":
        place, steep = -1, np.full(len(real), np.nan)
        lead = FirstOrder(effects, whole.slope[:, _top(whole.total.upper)])
    elif steep_at_corner is not None:
        place, steep = -1, steep_at_corner
    else:
        value, steep = effects.slopes(figure(course, known), ())
        place = 0 if measure.rule == "value" and not measure.in_time else -1
        steep = np.where(np.isfinite(value), steep, np.nan)  # of what does not exist
    one = FirstOrder(effects, effects.without_noise(steep))
    total = _ends(measure, whole.total, one.total) if by_position(known) else one.total
    return Of(known, one, whole, total, real[0], place, lead or one)


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


def by_position(known: Reference) -> bool:
    """Whether the figure is 0 of the nominal mechanism, without a derivative, but has that of the course somewhere.

    Of a distance neither the mean, the least nor any spread has; of other deviations the root of the mean square has
    not; and nothing is largest or least of a course that is 0 throughout.
    """
    rule = known.measure.rule
    if known.measure.kind == "path_error":
        return rule in ("deviation", "value", "maximum", "largest")
    return rule == "deviation" or (known.against and rule in ("maximum", "minimum", "largest", "peak-to-peak"))


def _scalar(known: Reference, effects: Effects, course: Course, parts: Sequence[Dual]) -> tuple[Array, Array]:
    """One number a position, (row, position), with its derivative, that stands for the course."""
    if len(parts) == 1:
        real = parts[0].real.copy()
        if known.turning:
            real += known.parts[0] - real[0]
        return real, parts[0].dual
    if known.measure.kind == "path_error":
        slopes = np.array([part.dual for part in parts])  # (axis, row, position)
        scaled = slopes * effects.weights[:, None]
        scatter = np.einsum("arp,brp->pab", scaled, scaled)
        along = np.linalg.eigh(np.nan_to_num(scatter))[1][:, :, -1]  # (position, axis)
        return np.zeros_like(parts[0].real), np.einsum("arp,pa->rp", slopes, along)
    number = shown(course, known)
    return effects.slopes(number, (len(known.window.index),))


def _worst(measure: Measure, course: FirstOrder) -> tuple[int, Array]:
    """Where the worst case of a course is largest, and the derivatives of the figure there."""
    slope = course.slope
    if measure.rule == "peak-to-peak":
        pick = np.unique(np.linspace(0, slope.shape[1] - 1, min(slope.shape[1], MOST_PAIRS)).astype(int))
        best, found = -1.0, slope[:, 0] * 0.0
        for i in pick:
            change = slope[:, pick] - slope[:, [i]]
            upper = np.nan_to_num(FirstOrder(course.effects, change).total.upper)
            top = int(np.argmax(upper))
            if upper[top] > best:
                best, found = float(upper[top]), change[:, top]
        return -1, found
    size = course.total.worst
    place = int(np.nanargmax(size)) if np.any(np.isfinite(size)) else 0
    return place, slope[:, place]


def searched(kernel: NumpyKernel, found: Linear, of: Of) -> tuple[Corner, Corner]:
    """The least and the largest deviation of the figure on the mechanism itself, with the numbers there.

    Of a figure over all positions: the least and the largest deviation of the course from nominal anywhere.
    """
    plan, known = found.plan, of.reference
    alone = replace(kernel, measures=[of.measure])

    def ends(sign: float) -> Corner:
        def objective(values: Mapping[str, Number], effects: Effects) -> tuple[Array, Array]:
            if known.corner:
                figures, slope = _at_corner(kernel, plan, effects, values, known)
                return figures - known.figure, slope
            courses, _ = _courses(alone, plan, effects, values)
            course = courses[of.measure.name]
            ends_of = span([part.real for part in course], known)
            whole = np.broadcast_to(ends_of[1] if sign > 0 else ends_of[0], (len(effects.rows),))
            if of.place < 0 or by_position(of.reference):
                return whole, _slope_at(of, effects, course, sign)
            return whole, effects.slopes(figure(course, known), ())[1]

        start = of.lead.corner(sign)
        return search(found.effects, objective, start, sign, bool(np.isfinite(known.figure)))

    return ends(-1.0), ends(1.0)


def _slope_at(of: Of, effects: Effects, course: Course, sign: float) -> Array:
    """Derivatives of the figure by rows, at a corner."""
    if not by_position(of.reference):
        return effects.slopes(figure(course, of.reference), ())[1]
    known = of.reference
    if of.measure.kind == "path_error":
        slopes = np.array([part.dual[:, known.window.index] for part in course])
        change = np.array([part.real[0, known.window.index] for part in course]) - np.array(known.parts)
        size = np.sqrt(np.sum(change**2, axis=0))
        place = _top(size)
        along: Array = sign * np.einsum("ar,a->r", slopes[:, :, place], change[:, place]) / (size[place] or 1.0)
        return along
    real, slope = effects.slopes(shown(course, known), (len(known.window.index),))
    if of.measure.rule == "peak-to-peak":
        between: Array = slope[:, _top(real[0])] - slope[:, _top(-real[0])]
        return between
    return np.asarray(slope[:, _top(sign * real[0])])


def _top(numbers: Array) -> int:
    """Place of the largest; the first of none."""
    return int(np.nanargmax(numbers)) if np.any(np.isfinite(numbers)) else 0
