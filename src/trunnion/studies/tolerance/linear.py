"""Linear tolerance analysis: exact sensitivities of every measure, worst case, RSS, contributions.

∂y/∂p are dual parts, carried through the whole analysis at once: motion, friction, what makes a figure of a course.
A largest deviation, or a distance from the nominal place, has no derivative at the nominal mechanism, where it is 0:
of these the derivatives are those of the course at the place where the worst case is largest, of a peak-to-peak
deviation between the two places where it is worst. A distance has them along two directions: its worst case along the
one in which that is largest, its scatter along that of the largest scatter. Places are looked for on the panels of the
measure's courses, so that no figure depends on the rows of a table.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, primal, single
from trunnion.algebra.namespace import Number
from trunnion.algebra.panels import selected
from trunnion.cycle.cycle_kernel import Engine
from trunnion.errors import Finding, MechanismError, Status
from trunnion.measures.evaluation import NumpyKernel
from trunnion.measures.figures import Read, turn
from trunnion.measures.many import Many
from trunnion.measures.measures import Measure, chosen, outputs, within
from trunnion.measures.positions import PositionPlan, moved, place_of, plan
from trunnion.model.mechanism import Mechanism
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run, prepare
from trunnion.solve.switches import near
from trunnion.studies.tolerance.effects import (
    NOBODY,
    Corner,
    EffectRow,
    Effects,
    FirstOrder,
    Spread,
    effects_of,
    search,
)
from trunnion.studies.tolerance.inputs import Inputs, inputs_of
from trunnion.studies.tolerance.kernel import engine_for, kernel_of, many_of
from trunnion.studies.tolerance.sampling import PLACES, Sampling, towards

Array = NDArray[np.float64]
AT_ONCE = 20_000  # numbers in an array of one walk with dual numbers
MOST_PAIRS = 720  # places between which a peak-to-peak deviation is looked for
ROUNDS, AROUND = 7, 17  # in which the worst place of a course is looked for, and places about it in each
TURNS = 8  # in which the direction of a worst case settles


class Walked(NamedTuple):
    """Parts of the course of a measure, dual numbers (row, time), and the status of the nominal mechanism, (time,)."""

    parts: list[Dual]
    status: NDArray[np.int8]


class WorstPlace(NamedTuple):
    """Time, s, NaN of two places; first order there, of the worst case and of the scatter; status of the mechanism."""

    time: float
    worst: FirstOrder
    scatter: FirstOrder
    status: int


@dataclass(frozen=True)
class MeasureOrder:
    """The figure of one measure to first order.

    nominal: of the nominal mechanism, 0 of what is a deviation by itself, NaN where there is none; against: whether it
    is judged against the nominal mechanism. by_place: whether the figure is 0 of the nominal mechanism, without a
    derivative, but has that of the course somewhere. figure: its derivatives; worst: those of the worst case, other
    ones of a distance, and what the search of it begins with where the figure has none; total: all together. time: of
    its place, s, NaN if it is of no single one; rests: whether a joint is at rest there.
    """

    measure: Measure
    nominal: float
    against: bool
    by_place: bool
    figure: FirstOrder
    worst: FirstOrder
    total: Spread
    time: float
    rests: bool

    @property
    def placed(self) -> bool:
        """Whether the figure is that of the course at one place."""
        at_place = self.measure.rule == "value" and not self.measure.in_time
        return bool(np.isfinite(self.time)) and (at_place or self.by_place)

    @property
    def is_deviation(self) -> bool:
        """Whether the figure is made of deviations from the nominal mechanism and is 0 there."""
        return self.measure.kind == "path_error" or (self.against and self.measure.rule != "value")

    @property
    def limits(self) -> tuple[float, float]:
        """Least and largest deviation from nominal that the measure may have; infinite where there is no limit."""
        measure, rule = self.measure, self.measure.rule
        lower = -np.inf if measure.lower is None else measure.lower
        upper = np.inf if measure.upper is None else measure.upper
        least = -np.inf if measure.at_least is None else measure.at_least
        most = np.inf if measure.at_most is None else measure.at_most
        if rule == "deviation":
            return max(lower, -most), min(upper, most)
        if not self.is_deviation:
            return max(lower, least - self.nominal), min(upper, most - self.nominal)
        if measure.kind != "path_error" and rule in ("maximum", "minimum", "mean"):
            ends = max(lower, least), min(upper, most)
            return -np.inf if rule == "maximum" else ends[0], np.inf if rule == "minimum" else ends[1]
        return -min(upper, most), min(upper, most)  # what has a size and no sign


@dataclass(frozen=True)
class Table:
    """The courses at the positions of a table: of every measure, within its window, the nominal one, its first order
    and that of its worst case; the status of the nominal mechanism, (position,)."""

    plan: PositionPlan
    curves: Sequence[Array]
    courses: Sequence[FirstOrder]
    worst: Sequence[FirstOrder]
    status: NDArray[np.int8]

    def spread(self, arrays: Sequence[Array]) -> Array:
        """Numbers over the windows of measures as one array over all positions, NaN outside."""
        rows = np.full((len(arrays), *arrays[0].shape[:-1], len(self.plan.times)), np.nan)
        for row, array, window in zip(rows, arrays, self.plan.windows.values(), strict=True):
            row[..., window.index] = array
        return rows


@dataclass(frozen=True, eq=False)
class ToleranceStudy:
    """A mechanism whose numbers vary, with what is measured, made ready: evaluate it by any method.

    notes: what there is to say of the choice of measures.
    """

    run: Run
    inputs: Inputs
    measures: tuple[Measure, ...]
    friction: FrictionMethod
    notes: tuple[Finding, ...] = ()
    _scans: dict[str, Walked] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def kernel(self) -> NumpyKernel:
        """The analysis of the mechanism and of others like it."""
        return kernel_of(self.run, self.measures, self.friction, bool(self.inputs.pressed))

    @cached_property
    def effects(self) -> Effects:
        """Rows of the batch that first order takes."""
        return effects_of(self.inputs)

    @cached_property
    def many(self) -> Many:
        """The measures of the nominal mechanism, to be read of others."""
        return many_of(self.kernel, self.inputs)

    @cached_property
    def orders(self) -> list[MeasureOrder]:
        """First order of every measure about the nominal mechanism."""
        rated = [
            measure for measure in self.measures
            if measure.kind != "path_error" and not self._by_place(measure)
            and (measure.rule in ("mean", "value") or not measure.against_nominal(self.run.system))
        ]  # fmt: skip
        reading = self.many if len(rated) == len(self.measures) else self.many.only(rated)
        reads = reading.read(self.effects.values()) if rated else {}
        return [self._order(measure, reads.get(measure.name)) for measure in self.measures]

    def _by_place(self, measure: Measure) -> bool:
        """See `MeasureOrder`. Of a distance neither the mean, the least nor any spread has a derivative somewhere; of
        other deviations the root of the mean square has not; and nothing is largest or least of what is 0 throughout.
        """
        if measure.kind == "path_error":
            return measure.rule in ("deviation", "value", "maximum", "largest")
        extremes = ("maximum", "minimum", "largest", "peak-to-peak")
        return measure.rule == "deviation" or (measure.rule in extremes and measure.against_nominal(self.run.system))

    def worst(self) -> list[tuple[Corner, Corner]]:
        """Least and largest deviation of every measure on the mechanism itself, with the numbers there.

        Of a figure over all positions: the least and the largest deviation of the course from nominal anywhere.
        """
        return [self.searched(order) for order in self.orders]

    def searched(self, order: MeasureOrder) -> tuple[Corner, Corner]:
        """The same of one measure."""
        alone, name = self.many.only([order.measure]), order.measure.name

        def end(sign: float) -> Corner:
            def objective(values: Mapping[str, Number], effects: Effects) -> tuple[Array, Array]:
                read = alone.read(values)[name]
                return effects.slopes(read.most if sign > 0 else read.least, ())

            start = order.worst.corner(sign)
            alone.tune(self.effects.values(start))
            return search(self.effects, objective, start, sign, bool(np.isfinite(order.nominal)))

        return end(-1.0), end(1.0)

    def sampling(self, method: Any, samples: int, seed: int, engine: Engine = "numpy", steps: int = 360) -> Sampling:
        """The run of a sampling method. engine auto: see `engine_for`; steps: positions of the curves that are kept."""
        places = len(plan(self.run, self.measures, PLACES).times)
        engine = engine_for(engine, self.kernel, self.run.values, samples * places)
        rotation = None
        if method == "quasi-monte-carlo" and self.inputs.tolerances:
            rotation = towards(np.array([order.figure.gradient() for order in self.orders]))
        return Sampling(
            self.run.system.mechanism.data(), self.measures, steps, method, samples, seed, engine, self.friction,
            places, rotation, bool(self.inputs.pressed),
        )  # fmt: skip

    # ---- courses ------------------------------------------------------------------------------------------

    def table(self, steps: int) -> Table:
        """The courses of all measures at the positions of a table."""
        positions, system = plan(self.run, self.measures, steps), self.run.system
        walked, curves = self._walked(self.measures, positions.times), list[Array]()
        courses, worst = list[FirstOrder](), list[FirstOrder]()
        lines = {measure.name: positions.windows[measure.name].time
                 for measure in self.measures if measure.rule == "line"}  # fmt: skip
        reads = self.many.read(self.effects.values(), lines) if lines else {}
        for measure in self.measures:
            window = positions.windows[measure.name]
            parts = [Dual(part.real[:, window.index], part.dual[:, window.index])
                     for part in walked[measure.name].parts]  # fmt: skip
            curve = parts[0].real[0]
            if measure.name in lines:
                shown, slope = self.effects.slopes(reads[measure.name].shown, window.time.shape)
                curves.append(shown[0])
                courses.append(FirstOrder(self.effects, self.effects.without_noise(slope)))
                worst.append(courses[-1])
                continue
            if measure.kind == "path_error" or measure.of_attitude(system) or measure.of.against:
                curve = 0.0 * curve
            elif len(parts) > 1:
                curve = parts[0].real[0] / np.where(parts[1].real[0] > 0, parts[1].real[0], np.nan)
            elif measure.turning(system):
                curve = near(curve, self.many.angle(measure, window.time))
            curves.append(curve)
            for orders, of_worst in ((courses, False), (worst, True)):
                orders.append(self._course(measure, parts, of_worst))
        return Table(positions, curves, courses, worst, walked[self.measures[0].name].status)

    def scanned(self, measure: Measure, of_worst: bool) -> tuple[Array, FirstOrder, NDArray[np.int8]]:
        """Times, s, at which a course is looked through, whatever the steps; its first order there, and statuses.

        of_worst: whether first order is that of the worst case; see `_course`.
        """
        time = self.many.spots(measure)
        if measure.name not in self._scans:
            self._scans[measure.name] = self._walked([measure], time)[measure.name]
        walked = self._scans[measure.name]
        return time, self._course(measure, walked.parts, of_worst), walked.status

    def worst_place(self, measure: Measure, size: Callable[[FirstOrder], Array], of_worst: bool = True) -> WorstPlace:
        """Where a course is worst, NaN s of a peak-to-peak deviation, which is of two places.

        size: how bad a course is, (time,), by its first order, `of_worst` as for `scanned`.
        """
        time, course, status = self.scanned(measure, of_worst)
        if measure.rule == "peak-to-peak" and self._by_place(measure):
            widest = FirstOrder(self.effects, _widest(course))
            return WorstPlace(np.nan, widest, widest, Status.SOLVED)
        walked = self._scans[measure.name]
        for round_ in range(ROUNDS):
            if round_:
                walked = self._walked([measure], time)[measure.name]
                course, status = self._course(measure, walked.parts, of_worst), walked.status
            top = int(np.argmax(np.where(sound(status), np.nan_to_num(size(course), nan=-np.inf), -np.inf)))
            place = float(time[top])
            if len(time) == 1:
                break
            time = np.linspace(time[max(top - 1, 0)], time[min(top + 1, len(time) - 1)], AROUND)
            time = np.sort(np.append(time, place))
        parts = [Dual(part.real[:, [top]], part.dual[:, [top]]) for part in walked.parts]
        worst, scatter = (
            FirstOrder(self.effects, self._course(measure, parts, each).slope[:, 0]) for each in (True, False)
        )
        return WorstPlace(place, worst, scatter, int(status[top]))

    def _walked(self, measures: Sequence[Measure], time: Array) -> dict[str, Walked]:
        """The courses of some measures with their derivatives at times, s, some of the times at once."""
        kernel, effects = replace(self.kernel, measures=list(measures)), self.effects
        values, rows = effects.values(), len(effects.rows)
        at, step = moved(self.run, values, within(self.run, time)), max(1, AT_ONCE // rows)
        parts: dict[str, list[list[tuple[Array, Array]]]] = {measure.name: [] for measure in measures}
        codes = []
        for low in range(0, len(time), step):
            high = min(low + step, len(time))
            courses, status = kernel.courses(values, at[..., low:high])
            codes.append(np.broadcast_to(status, (rows, high - low))[0])
            for name, course in courses.items():
                parts[name].append([effects.slopes(part, (high - low,)) for part in course])
        return {
            name: Walked(
                [Dual(*(np.concatenate(side, axis=1) for side in zip(*chunks, strict=True)))
                 for chunks in zip(*course, strict=True)],
                np.concatenate(codes),
            )
            for name, course in parts.items()
        }  # fmt: skip

    def _course(self, measure: Measure, parts: Sequence[Dual], of_worst: bool) -> FirstOrder:
        """First order of the one number a position that stands for a course.

        of_worst: of a distance along the direction in which its worst case is largest, not its scatter.
        """
        slope = parts[0].dual
        if measure.kind == "path_error":
            slopes = np.array([part.dual for part in parts])  # (axis, row, time)
            scaled = np.nan_to_num(slopes * self.effects.weights[:, None])
            along = np.linalg.eigh(np.einsum("art,brt->tab", scaled, scaled))[1][:, :, -1]  # (time, axis)
            for _ in range(TURNS if of_worst else 0):  # Σ |u·s| does not fall from one to the next
                total = np.einsum("art,rt->ta", scaled, np.sign(np.einsum("art,ta->rt", scaled, along)))
                size = np.linalg.norm(total, axis=1, keepdims=True)
                along = np.divide(total, size, out=along, where=size > 0)
            slope = np.einsum("art,ta->rt", slopes, along)
        elif measure.of_attitude(self.run.system):
            turned = turn(parts, [part.real[0] for part in parts], measure.axis)
            slope = self.effects.slopes(turned, slope.shape[1:])[1]
        elif len(parts) > 1:
            useful, driven = parts
            ratio = useful / selected(primal(driven) > 0, driven, np.nan)
            slope = self.effects.slopes(ratio, slope.shape[1:])[1]
        return FirstOrder(self.effects, self.effects.without_noise(slope))

    # ---- figures ------------------------------------------------------------------------------------------

    def _order(self, measure: Measure, read: Read | None) -> MeasureOrder:
        """First order of one measure. read: of its figure, where that has derivatives."""
        effects, name, by_place = self.effects, measure.name, self._by_place(measure)
        time, status = self.many.times[name], int(Status.SOLVED)
        if read is not None:
            value, slope = effects.slopes(read.figure, ())
            slope = np.where(np.isfinite(value), slope, np.nan)  # of what does not exist
            if measure.rule == "value" and not measure.in_time:
                time, status = float(self.many.spots(measure)[0]), int(read.status[0])
            figure = worst = FirstOrder(effects, effects.without_noise(slope))
        else:
            place = self.worst_place(measure, lambda course: course.total.worst)
            figure, worst = FirstOrder(effects, np.full(len(effects.rows), np.nan)), place.worst
            if by_place:
                time, figure, status = place.time, place.scatter, place.status
        total = figure.total
        if by_place:
            total = self._ends(measure, total._replace(lower=worst.total.lower, upper=worst.total.upper))
        against, rests = measure.against_nominal(self.run.system), status == Status.ZERO_SLIP
        return MeasureOrder(measure, self.many.figures[name], against, by_place, figure, worst, total, time, rests)

    def _ends(self, measure: Measure, total: Spread) -> Spread:
        """Least and largest deviation of a figure that is made of the deviations at all places.

        A distance and a spread are at least 0; a maximum over the cycle is at least the largest of what each place can
        be at least.
        """

        def extreme(end: str, sign: float) -> Array:
            place = self.worst_place(measure, lambda course: sign * getattr(course.total, end))
            return np.asarray(getattr(place.worst.total, end))

        lower, upper = total.lower, total.upper
        if measure.kind == "path_error" or measure.rule in ("peak-to-peak", "largest"):
            # to either side: a distance has a direction that has no sign, a largest |deviation| none either
            upper = upper if measure.rule == "peak-to-peak" else np.maximum(-lower, upper)
            lower = np.zeros_like(lower)
        elif measure.rule in ("maximum", "minimum"):
            lower, upper = (extreme(end, 1.0 if measure.rule == "maximum" else -1.0) for end in ("lower", "upper"))
        return total._replace(lower=lower, upper=upper)


def study(
    mechanism: Mechanism,
    measures: Sequence[str] | None = None,
    at: float | str | None = None,
    friction: FrictionMethod | None = None,
) -> ToleranceStudy:
    """A study of a mechanism. Raises MechanismError as `tolerance` does."""
    run = prepare(mechanism)
    inputs = inputs_of(run)
    picked, notes = stated_or_outputs(run, chosen(mechanism, measures, run.values))
    if run.determinacy is not None and not all(measure.of_motion for measure in picked):
        run.determinacy.refuse()
    if run.cycle.duration <= 0:  # there is one position
        picked = [replace(measure, statistic="value") if measure.rule == "deviation" else measure for measure in picked]
    if at is not None:
        value, timed = place_of(mechanism, at)
        located = [
            replace(measure, at=value, timed=timed) if measure.everywhere and measure.rule == "deviation" else measure
            for measure in picked
        ]
        if located == picked:
            what = "every measure has a place, a window or a figure of its own, which this does not change"
            raise MechanismError(Finding(what, "at", "leave it out, or change at: of the measure"))
        picked = located
    return ToleranceStudy(run, inputs, tuple(picked), friction or FrictionMethod(), tuple(notes))


def stated_or_outputs(run: Run, measures: Sequence[Measure]) -> tuple[list[Measure], list[Finding]]:
    """The measures, or outputs with a note if there are none; MechanismError if there is no output either."""
    if measures:
        return list(measures), []
    remedy, outputs_taken = "state measures: in the model, or use --measure link.point.x", outputs(run.system)
    if not outputs_taken:
        what = "no measure is stated, and no joint to the ground is an output"
        raise MechanismError(Finding(what, "measures", remedy))
    names = [measure.name for measure in outputs_taken]
    what = f"the model states no measure; {', '.join(names)} are used (joints to the ground without a driver)"
    return outputs_taken, [Finding.note("measure.none_stated", "measures", what, remedy, measures=names)]


def limited(measure: Measure) -> bool:
    """Whether a measure has a limit or a bound."""
    return any(end is not None for end in (measure.lower, measure.upper, measure.at_least, measure.at_most))


def sound(status: NDArray[np.int8]) -> NDArray[np.bool_]:
    """Places away from dead centres, of which first order says little; all if there are no others."""
    solved = status < Status.NEAR_SINGULAR
    return solved | ~np.any(solved)


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


# ---- the worst corner of one measure -------------------------------------------------------------------------------

SIDES = ("least", "largest")


@dataclass(frozen=True)
class WorstCorner:
    """A corner of the tolerances and plays of a mechanism.

    deviations: least and largest of the measure, in `unit`; side: that of this corner, 0 or 1; time: where it stands
    there, s, NaN of a figure of the whole cycle; numbers: of the mechanism there, SI, by path; rows: of those that
    matter path, unit, nominal value and that of the corner.
    """

    prepared: ToleranceStudy
    deviations: tuple[float, float]
    unit: str
    side: int
    time: float
    numbers: Mapping[str, float]
    rows: list[tuple[str, str, float, float]]


@np.errstate(all="ignore")
def worst_corner(mechanism: Mechanism, name: str, side: str | None) -> WorstCorner:
    """Return the corner at which a measure is "least" or "largest", or whichever of both is farther from nominal.

    Pins that loads would press to one side may lie anywhere in their holes, as in `tolerance --seat free`.
    """
    if "loaded" in mechanism.seated.values():
        mechanism = mechanism.with_seats("free")
    prepared = study(mechanism, [name])
    run, (of,), effects = prepared.run, prepared.orders, prepared.effects
    ends = prepared.searched(of)
    least, largest = (corner.value for corner in ends)
    if not np.isfinite([least, largest]).all():
        raise MechanismError(Finding("has no worst corner: the figure is undefined", f"measures.{name}"))
    side_index = SIDES.index(side) if side in SIDES else int(abs(largest) >= abs(least))
    values_there = replace(effects, rows=(EffectRow(NOBODY, 0, {}, ""),)).values(ends[side_index].at)
    numbers = {path: single(number) for path, number in values_there.items()}
    kinds, rows = mechanism.parameter_kinds(), []
    for i, tolerance in enumerate(prepared.inputs.tolerances):
        if of.figure.spread.half[i] != 0:  # else it does nothing to the measure
            kind = kinds.get(tolerance.path)
            rows.append((tolerance.path, kind.unit if kind else "m", effects.nominal(i), numbers[tolerance.path]))
    unit, time = of.measure.figure_unit(run.system, run.values), _place(prepared, of, values_there, 2 * side_index - 1)
    return WorstCorner(prepared, (least, largest), unit, side_index, time, numbers, rows)


def _place(prepared: ToleranceStudy, order: MeasureOrder, values_there: Mapping[str, Number], sign: int) -> float:
    """Time, s, at which a figure stands at its corner; NaN of one of the whole cycle."""
    measure, kernel = order.measure, prepared.kernel
    time, at = order.time, prepared.many.spots(measure)
    for _ in range(ROUNDS if measure.rule == "deviation" else 0):
        parts, nominal = (
            kernel.courses(numbers, at)[0][measure.name] for numbers in (values_there, prepared.inputs.nominal)
        )
        if len(parts) > 1:
            break
        change = np.broadcast_to(np.ravel(primal(parts[0])) - np.ravel(primal(nominal[0])), at.shape)
        if measure.turning(prepared.run.system):
            change = change - 2 * np.pi * np.round(change / (2 * np.pi))
        top, last = int(np.nanargmax(sign * change)), len(at) - 1
        time = float(at[top])
        at = np.linspace(at[max(top - 1, 0)], at[min(top + 1, last)], AROUND if last else 1)
    return time
