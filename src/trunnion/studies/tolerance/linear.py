"""Linear tolerance analysis: exact sensitivities of every measure, worst case, RSS, contributions.

∂y/∂p are dual parts, carried through the whole analysis at once: motion, friction, what makes a figure of a course.
A largest deviation, or a distance from the nominal place, has no derivative at the nominal mechanism, where it is 0:
of these the derivatives are those of the course at the place where the worst case is largest, of a distance along the
direction of the largest scatter, of a peak-to-peak deviation between the two places where it is worst. Places are
looked for on the panels of the measure's courses, so that no figure depends on the rows of a table.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.namespace import Number
from trunnion.algebra.panels import selected
from trunnion.cycle.cycle_kernel import Engine
from trunnion.errors import Finding, MechanismError, Status
from trunnion.measures.angles import near, within
from trunnion.measures.evaluation import NumpyKernel
from trunnion.measures.lines import turn
from trunnion.measures.many import Many, Read
from trunnion.measures.measures import Measure, chosen, outputs
from trunnion.measures.positions import PositionPlan, moved, place_of, plan
from trunnion.model.mechanism import Mechanism
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run, prepare
from trunnion.studies.tolerance.effects import Effects, FirstOrder, Spread, effects_of
from trunnion.studies.tolerance.inputs import Inputs, inputs_of
from trunnion.studies.tolerance.kernel import engine_for, kernel_of, many_of
from trunnion.studies.tolerance.sampling import PLACES, Sampling, towards
from trunnion.studies.tolerance.search import Corner, search

__all__ = ["MeasureOrder", "Table", "ToleranceStudy", "limited", "stated_or_outputs", "study"]

Array = NDArray[np.float64]
Direction = Literal["scatter", "worst"]  # of a distance: along which it scatters most, or is farthest in the worst case
AT_ONCE = 20_000  # numbers in an array of one walk with dual numbers
MOST_PAIRS = 720  # places between which a peak-to-peak deviation is looked for
ROUNDS, AROUND = 7, 17  # in which the worst place is looked for, and places about it in each
TURNS = 8  # in which the direction of a worst case settles


class Walked(NamedTuple):
    """Parts of the course of a measure, dual numbers (row, time), and the status of the nominal mechanism, (time,)."""

    parts: list[Dual]
    status: NDArray[np.int8]


class WorstPlace(NamedTuple):
    """Time, s, NaN of two places; derivatives of the measure there, (row,); status of the nominal mechanism."""

    time: float
    slope: Array
    status: int


@dataclass(frozen=True)
class MeasureOrder:
    """The figure of one measure to first order.

    nominal: of the nominal mechanism, 0 of what is a deviation by itself, NaN where there is none; against: whether it
    is judged against the nominal mechanism. figure: its derivatives, total: all together. time: of its place, s, NaN if
    it is of no single one; rests: whether a joint is at rest there. lead: what the search of the worst case begins
    with, `figure` where that has derivatives.
    """

    measure: Measure
    nominal: float
    against: bool
    figure: FirstOrder
    total: Spread
    time: float
    rests: bool
    lead: FirstOrder

    @property
    def by_place(self) -> bool:
        """Whether the figure is 0 of the nominal mechanism, without a derivative, but has that of the course somewhere.

        Of a distance neither the mean, the least nor any spread has; of other deviations the root of the mean square
        has not; and nothing is largest or least of a course that is 0 throughout.
        """
        return _by_place(self.measure, self.against)

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
            return -np.inf if rule == "maximum" else max(lower, least), np.inf if rule == "minimum" else min(
                upper, most
            )
        return -min(upper, most), min(upper, most)  # what has a size and no sign


@dataclass(frozen=True)
class Table:
    """The courses at the positions of a table: of every measure, within its window, the nominal one and first order;
    the status of the nominal mechanism, (position,)."""

    plan: PositionPlan
    curves: Sequence[Array]
    courses: Sequence[FirstOrder]
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
        against = [measure.against_nominal(self.run.system) for measure in self.measures]
        rated = [measure for measure, is_against in zip(self.measures, against, strict=True)
                 if _rated(measure, is_against)]  # fmt: skip
        reading = self.many if len(rated) == len(self.measures) else self.many.only(rated)
        reads = reading.read(self.effects.values()) if rated else {}
        return [self._order(measure, is_against, reads.get(measure.name))
                for measure, is_against in zip(self.measures, against, strict=True)]  # fmt: skip

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

            start = order.lead.corner(sign)
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
        walked, curves, courses = self._walked(self.measures, positions.times), list[Array](), list[FirstOrder]()
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
                continue
            if measure.kind == "path_error" or measure.of_attitude(system) or measure.of.against:
                curve = 0.0 * curve
            elif len(parts) > 1:
                curve = parts[0].real[0] / np.where(parts[1].real[0] > 0, parts[1].real[0], np.nan)
            elif measure.turning(system):
                curve = near(curve, self.many.angle(measure, window.time))
            curves.append(curve)
            courses.append(self._course(measure, parts))
        return Table(positions, curves, courses, walked[self.measures[0].name].status)

    @cached_property
    def _scans(self) -> dict[str, Walked]:
        return {}

    def scanned(self, measure: Measure, direction: Direction = "scatter") -> tuple[Array, FirstOrder, NDArray[np.int8]]:
        """Times, s, at which a course is looked through, whatever the steps; its first order there, and statuses."""
        time = self.many.spots(measure)
        if measure.name not in self._scans:
            self._scans[measure.name] = self._walked([measure], time)[measure.name]
        walked = self._scans[measure.name]
        return time, self._course(measure, walked.parts, direction), walked.status

    def worst_place(
        self, measure: Measure, size: Callable[[FirstOrder], Array], direction: Direction = "scatter"
    ) -> WorstPlace:
        """Where a course is worst, NaN s of a peak-to-peak deviation, which is of two places.

        size: how bad a course is, (time,).
        """
        time, course, status = self.scanned(measure, direction)
        if measure.rule == "peak-to-peak" and _by_place(measure, measure.against_nominal(self.run.system)):
            return WorstPlace(np.nan, _widest(course), Status.SOLVED)
        for round_ in range(ROUNDS):
            if round_:
                walked = self._walked([measure], time)[measure.name]
                course, status = self._course(measure, walked.parts, direction), walked.status
            top = int(np.argmax(np.where(sound(status), np.nan_to_num(size(course), nan=-np.inf), -np.inf)))
            worst = WorstPlace(float(time[top]), course.slope[:, top], int(status[top]))
            if len(time) == 1:
                break
            time = np.linspace(time[max(top - 1, 0)], time[min(top + 1, len(time) - 1)], AROUND)
            time = np.sort(np.append(time, worst.time))
        return worst

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

    def _course(self, measure: Measure, parts: Sequence[Dual], direction: Direction = "scatter") -> FirstOrder:
        """First order of the one number a position that stands for a course."""
        slope = parts[0].dual
        if measure.kind == "path_error":
            slopes = np.array([part.dual for part in parts])  # (axis, row, time)
            scaled = np.nan_to_num(slopes * self.effects.weights[:, None])
            along = np.linalg.eigh(np.einsum("art,brt->tab", scaled, scaled))[1][:, :, -1]  # (time, axis)
            for _ in range(TURNS if direction == "worst" else 0):  # Σ |u·s| does not fall from one to the next
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

    def _order(self, measure: Measure, against: bool, read: Read | None) -> MeasureOrder:
        """First order of one measure. read: of its figure, where that has derivatives."""
        effects, name = self.effects, measure.name
        nominal, time, lead, status = self.many.figures[name], self.many.times[name], None, int(Status.SOLVED)
        if read is not None:
            value, slope = effects.slopes(read.figure, ())
            slope = np.where(np.isfinite(value), slope, np.nan)  # of what does not exist
            if measure.rule == "value" and not measure.in_time:
                time, status = float(self.many.spots(measure)[0]), int(read.status[0])
        else:
            place = self.worst_place(measure, lambda course: course.total.worst)
            lead = FirstOrder(effects, place.slope)
            slope = np.full(len(place.slope), np.nan)
            if _by_place(measure, against):
                time, slope, status = place.time, place.slope, place.status
        figure = FirstOrder(effects, effects.without_noise(slope))
        total = self._ends(measure, figure.total) if _by_place(measure, against) else figure.total
        rests = status == Status.ZERO_SLIP
        return MeasureOrder(measure, nominal, against, figure, total, time, rests, lead or figure)

    def _ends(self, measure: Measure, total: Spread) -> Spread:
        """Least and largest deviation of a figure that is made of the deviations at all places.

        A distance and a spread are at least 0; a maximum over the cycle is at least the largest of what each place can
        be at least.
        """

        def extreme(end: str, sign: float) -> Array:
            place = self.worst_place(measure, lambda course: sign * getattr(course.total, end))
            return np.asarray(getattr(FirstOrder(self.effects, place.slope).total, end))

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


def _by_place(measure: Measure, against: bool) -> bool:
    """See `MeasureOrder.by_place`."""
    if measure.kind == "path_error":
        return measure.rule in ("deviation", "value", "maximum", "largest")
    return measure.rule == "deviation" or (
        against and measure.rule in ("maximum", "minimum", "largest", "peak-to-peak")
    )


def _rated(measure: Measure, against: bool) -> bool:
    """Whether the figure has derivatives at the nominal mechanism, which those of most deviations from it have not."""
    if _by_place(measure, against) or measure.kind == "path_error":
        return False
    return measure.rule in ("mean", "value") or not against


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
