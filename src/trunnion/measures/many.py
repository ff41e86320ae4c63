"""Figures of measures: of one mechanism as it is, and of many that differ in their numbers from a nominal one.

The panels of the nominal mechanism's courses, found once, serve all of them: their edges go along with the places at
which each mechanism switches, so that every one has its courses between its own breaks, at a few Chebyshev points a
panel. What the polynomials do not resolve, as a load that the nominal mechanism only just does not meet, has its own
`Courses`. With dual numbers the edges move too: d/dp ∫ y dt has the part of the jumps (Leibniz), and an extreme at a
break that of its place.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Accuracy, Courses
from trunnion.algebra.dual import Dual, derivative, primal
from trunnion.algebra.namespace import Number
from trunnion.algebra.panels import FIT, ON_GAUSS, POINTS, RATE, linear
from trunnion.errors import Status
from trunnion.measures.evaluation import NumpyKernel, SeatedKernel, lanes_of, picked, sides_of
from trunnion.measures.figures import Panels, Read, Reading, combined, turn
from trunnion.measures.measures import Measure, angles, within
from trunnion.measures.positions import ends_by_name, moved
from trunnion.results.dataset import ROUNDING, Scales
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run
from trunnion.solve.seating import seating_of
from trunnion.solve.switches import (
    MARGINS,
    SEATED,
    Bend,
    Mechanisms,
    accuracy_of,
    bends,
    breaks_between,
    near,
    shifts_of,
    tracked,
)
from trunnion.solve.system import Values

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Lanes = NDArray[np.intp]
READ = 512  # mechanisms whose courses are read at a time: their arrays stay in cache
ALONE = 64  # the same of courses of their own
FINE, FINE_MOTION = 1e-8, 1e-12  # of the size of a course: how far figures may be off, of forces and of the motion
FINE_PLACE = 1e-11  # and where a place of forces is read
NONE = 1e-9  # of the largest derivative: less is none
FINE_CHANGE = 1e-6  # of the size of derivatives: how far those of figures may be off
FIRM = 0.3  # of that: where panels are tuned
MOTION = Accuracy(1e-12, 1e-14)  # of the motion, which has neither friction nor corners but where a law has some
FIRST = Accuracy(1e-4, 1e-5, rounds=2)  # of the courses whose panels are tuned
OWN = Accuracy(1e-7, 1e-8, rounds=20)  # of courses of mechanisms by themselves
GAP, GROSS = 1 / 360, 1e-3  # of the courses: panels that hide nothing; of their size: what tells of a gap
PARTED, MOST_PANELS = 7, 60  # rounds in which panels are halved; of panels that serve all
SMALL = 1e-6  # of what numbers are like: courses that are much smaller
SCANNED = 24  # positions at which it is looked how large forces are
CLOSE, LOCATED = 1e-9, 3e-10  # of the cycle: times that are one, and bends but for the error of their location
LOOKED = np.linspace(-1.0, 1.0, 25)
LOOKED[[0, -1]] *= 1 - 1e-6
SHORT = 1e-2  # of the step of a difference: what moves bends is smooth


def matters(bend: Bend, measures: Sequence[Measure]) -> bool:
    """Whether courses may bend or jump there: those of the motion do so where a motion law does."""
    return bend.scan < 0 or not all(measure.of_motion for measure in measures)


@dataclass(eq=False)
class Group:
    """Measures whose courses have the same panels.

    ends: times, s, of a place, a window, or none; values: of the nominal mechanism; figures: its own, by name.
    """

    run: Run
    measures: tuple[Measure, ...]
    ends: tuple[float, ...]
    values: Values
    kernel: NumpyKernel
    figures: dict[str, float]

    # ---- the nominal mechanism ----------------------------------------------------------------------------

    @property
    def at_place(self) -> bool:
        """Whether it is of one place, where there is no course."""
        return len(self.ends) == 1

    @cached_property
    def of_motion(self) -> bool:
        """Whether the motion alone decides the courses."""
        return all(measure.of_motion for measure in self.measures)

    @cached_property
    def against(self) -> tuple[Measure, ...]:
        """Measures that are judged against the nominal mechanism."""
        return tuple(measure for measure in self.measures if measure.against_nominal(self.run.system))

    @property
    def span(self) -> tuple[float, float]:
        """Both ends, s."""
        return (self.ends[0], self.ends[-1]) if self.ends else (0.0, self.run.cycle.duration)

    @cached_property
    def bends(self) -> list[Bend]:
        """Where the nominal mechanism switches, within its cycle."""
        run = self.run
        alone = Mechanisms(run.system, run.chosen.assembly, self.values, [run.cycle])
        every = run.bends if self.values is run.values else bends(alone)[0]
        return [bend for bend in every if matters(bend, self.measures)]

    @cached_property
    def _breaks(self) -> Array:
        """Times, s, at which courses of the nominal mechanism may bend or jump."""
        edges = self.kernel.breaks(self.values)
        return np.array([bend.time for bend in self.bends]) if edges is None else edges[0]

    @cached_property
    def course(self) -> Courses:
        """The courses of the nominal mechanism, whose panels are tuned."""
        breaks = breaks_between(self.run.cycle, self._breaks, *self.span)
        return self.courses(self.values, [breaks], FIRST, tuned=True)[0]

    @cached_property
    def edges(self) -> Array:
        """Of the panels that serve all, s, those of the stated breaks among them; see `tune`."""
        return np.array(self.ends if self.at_place else self.course.edges)

    @property
    def spots(self) -> Array:
        """Places of all panels, s, rising, the first and the last beside their edges."""
        low, half = self.edges[:-1], np.diff(self.edges) / 2
        return np.unique(low + half * (1.0 + LOOKED[:, None]))

    @cached_property
    def angles(self) -> Mapping[str, tuple[Array, Array]]:
        """Of measures that turn: times, s, and the angle of the nominal mechanism there, without jumps."""
        turning = [measure for measure in self.measures if measure.turning(self.run.system)]
        if not self.at_place:
            coordinates = {measure.name: measure.coordinate(self.run.system) for measure in turning}
            return angles(self.run, coordinates, self.span)
        parts = self._evaluated(self.values, np.array(self.ends)[:, None, None])[0]
        return {measure.name: (np.array(self.ends), np.ravel(primal(parts[measure.name][0]))) for measure in turning}

    @cached_property
    def _counts(self) -> dict[str, int]:
        """How many numbers the course of each measure has."""
        curves, _ = self.kernel.courses(self.values, within(self.run, np.array(self.span[:1])))
        return {measure.name: len(curves[measure.name]) for measure in self.measures}

    @cached_property
    def _scales(self) -> dict[str, float]:
        """What numbers of the kind of each measure are like: what is far below it is rounding."""
        run = self.run

        def force() -> float:
            """The largest component of a reaction force, N."""
            count, back = run.system.mechanism.coordinates, run.solve(run.cycle.times(SCANNED))
            loads = (load.u if hasattr(load, "u") else load for load in back.reactions.values())
            parts = (np.abs(primal(part)) for load in loads for part in load[:count])
            return max((float(np.nanmax(part, initial=0.0)) for part in parts), default=0.0)

        length, pace = (float(np.ravel(primal(of(run.values)))[0]) for of in (run.system.size, run.system.pace))
        forces = any(measure.of.of_forces for measure in self.measures)
        scales = Scales(length, pace, run.once("largest force", force) if forces else 0.0)
        return {measure.name: scales.floor(measure.unit(run.system)) / ROUNDING for measure in self.measures}

    @cached_property
    def _sizes(self) -> dict[str, float]:
        """The largest magnitude of the courses of the nominal mechanism, or of what is like them but for rounding."""
        sizes, row = {}, 0
        for measure in self.measures:
            largest = np.max(self.course.sizes[row : (row := row + self._counts[measure.name])])
            attitude = measure.of_attitude(self.run.system)
            sizes[measure.name] = 1.0 if attitude else float(max(largest, SMALL * self._scales[measure.name]))
        return sizes

    def tune(self, values: Values) -> None:
        """Part the panels until they resolve the courses of some mechanisms as far as their figures need it."""
        if self._each_alone:
            return
        bends, lost = self._own_bends(values)
        for _ in range(0 if self.at_place else PARTED):
            edges = self._own_edges(bends)
            panels = np.any(self.read_between(values, edges, {}, FIRM)[1][~lost], axis=0)
            count = len(self.edges) - 1
            if len(panels) != count:  # the bends of each are edges besides
                middle = np.median((primal(edges)[:, 1:] + primal(edges)[:, :-1]) / 2, axis=0)
                panels = np.bincount(np.searchsorted(self.edges, middle[panels], side="right") - 1, minlength=count) > 0
            if not np.any(panels) or count > MOST_PANELS:
                break
            self.edges = np.sort(np.append(self.edges, _middles(self.edges[None], panels)))

    @property
    def _each_alone(self) -> bool:
        """Whether every mechanism has courses of its own, as its breaks do not follow from the nominal ones."""
        return not self.at_place and self.kernel.breaks(self.values) is not None

    # ---- edges of others ----------------------------------------------------------------------------------

    def _own_bends(self, values: Values) -> tuple[Number | None, Flags]:
        """Times of the nominal mechanism, s, (lane, bend), at which each switches, None if they are its own; where they
        are lost."""
        none = np.zeros(lanes_of(values), bool)
        if self.at_place or values is self.values or not self.bends:
            return None, none
        run, end, times = self.run, self.span[1], np.array([bend.time for bend in self.bends])

        def at(v: Values, time: Array) -> Number:
            return moved(run, v, time)

        plain = {path: primal(value) for path, value in values.items()}
        of = Mechanisms(run.system, run.chosen.assembly, plain, [run.cycle] * lanes_of(values))
        bends: Number = tracked(of, self.bends, at)  # NaN where it is far off
        if any(isinstance(value, Dual) for value in values.values()):
            below, above, step = sides_of(run, values, SHORT)
            shifts = shifts_of(of, self.bends, bends, at, (below, above)) if np.any(step) else np.zeros_like(bends)
            bends = Dual(bends, np.divide(shifts, 2 * step, out=np.zeros_like(shifts), where=step > 0))
        lost = np.any(np.isnan(primal(bends)), axis=1)
        close = np.abs(primal(bends) - times) <= LOCATED * end  # so that the same mechanism has the same edges
        bends = bends + np.where(close, times - primal(bends), 0.0)
        same = np.all(close, axis=1) & ~np.any(derivative(bends) + 0.0 * times, axis=1)
        if np.all(same | lost):
            return None, lost
        bends = linear(bends, lambda array: np.where(lost[:, None], 0.0, array)) + np.where(lost[:, None], times, 0.0)
        return bends, lost

    def _own_edges(self, bends: Number | None) -> Number:
        """Edges of the panels of each, (lane, edge), or (1, edge) if they are those of all: the nominal ones go along
        with the bends next to them. What is taken less the nominal mechanism jumps at the bends of that too."""
        if bends is None:
            return self.edges[None]
        times = np.array([bend.time for bend in self.bends])
        (start, end), cycle, count = self.span, self.run.cycle, np.shape(primal(bends))[0]
        close, laps = CLOSE * end, np.zeros(1)
        if cycle.periodic:  # all periods that the span touches
            laps = np.arange(np.floor(start / cycle.duration) - 1, np.ceil(end / cycle.duration) + 1) * cycle.duration
        nominal = (times + laps[:, None]).ravel()
        order = np.argsort(nominal, kind="stable")
        nominal = nominal[order]
        others = linear(bends, lambda array: np.tile(array, len(laps))[:, order]) + np.repeat(laps, len(times))[order]
        fixed = np.unique(nominal[(nominal >= start - close) & (nominal <= end + close)] if self.against else [])
        if self.ends or not cycle.periodic:  # the ends of a window stay
            inner = (nominal > start + close) & (nominal < end - close)
            others = _clipped(others[:, inner], start, end)
            others = _joined(np.full((count, 1), start), others, np.full((count, 1), end))
            nominal = np.concatenate([[start], nominal[inner], [end]])
        others = _sorted(others)
        shares = np.array([np.interp(self.edges, nominal, unit) for unit in np.eye(len(nominal))])
        edges = linear(others, lambda array: array @ shares)
        ones = np.flatnonzero(np.diff(nominal) <= close)  # bends that are one of the nominal mechanism alone
        ones = ones[(nominal[ones] >= start - close) & (nominal[ones] <= end + close)]
        if not len(ones) and not len(fixed):
            return edges
        more = _joined(others[:, ones], np.tile(fixed, (count, 1)))
        return _sorted(_joined(edges, _clipped(more, primal(edges)[:, :1], primal(edges)[:, -1:])))

    # ---- courses of others --------------------------------------------------------------------------------

    def read(self, values: Values, times: Mapping[str, Array]) -> dict[str, Read]:
        """What the courses of mechanisms with other numbers say.

        Panels that do not resolve the course of one as far as its figures need it are parted; what jumps within one has
        courses of its own.
        """
        if self._each_alone:
            return self._alone({}, values, np.arange(lanes_of(values)), times)
        bends, lost = self._own_bends(values)
        edges = self._own_edges(bends)
        reads, offending, gone = self.read_between(values, edges, times)
        left = np.flatnonzero(np.any(offending, axis=1) & ~lost & ~gone)
        edges = linear(edges, lambda array: np.broadcast_to(array, (len(lost), array.shape[1]))[left])
        for _ in range(PARTED):
            if not len(left):
                break
            parted = np.any(offending[np.any(offending, axis=1)], axis=0)
            edges = _sorted(_joined(edges, _middles(edges, parted)))
            parts, offending, _ = self.read_between(picked(values, left), edges, times)
            reads = {name: _put(read, left, parts[name]) for name, read in reads.items()}
            more = np.flatnonzero(np.any(offending, axis=1))
            left, edges = left[more], _taken(edges, more)
        alone = np.union1d(left, np.flatnonzero(lost & ~gone)).astype(np.intp)
        return self._alone(reads, values, alone, times) if len(alone) else reads

    def read_between(
        self, values: Values, edges: Number, times: Mapping[str, Array], share: float = 1.0
    ) -> tuple[dict[str, Read], Flags, Flags]:
        """What the courses between some edges say; panels that do not resolve them, (lane, panel), to a share of what
        figures may be off; mechanisms with places without an answer."""
        count, panels = lanes_of(values), np.shape(primal(edges))[1] - 1
        reads: dict[str, list[Read]] = {measure.name: [] for measure in self.measures}
        offending, gone = np.zeros((count, panels), bool), np.zeros(count, bool)
        at_once = self.kernel.at_once // (len(POINTS) * max(1, panels))
        for block in _blocks(count, min(max(1, at_once), READ)):
            block_values = picked(values, block) if count > len(block) else values
            block_edges = _taken(edges, block)
            low, half = block_edges[:, :-1], (block_edges[:, 1:] - block_edges[:, :-1]) / 2
            time = block_edges[..., None] if self.at_place else low[..., None] + half[..., None] * (1.0 + POINTS)
            parts, status, moved_times = self._evaluated(block_values, time)
            nominal, weights = self._nominal(time), half[..., None]
            if moved_times is not None and not self.at_place:  # how much time of each mechanism the Gauss nodes count
                weights = linear(moved_times, lambda array: array @ FIT.T @ RATE @ ON_GAUSS)
            for measure in self.measures:
                rows = self._rows(measure, parts, nominal, time)
                if self.at_place:
                    courses = Panels.constant(rows[..., 0, 0])
                else:
                    none = np.zeros((len(block), panels), bool)
                    courses = Panels(low, half, linear(rows, lambda array: array @ FIT.T), weights, none)
                    offending[block] |= self._offending(measure, courses, primal(rows), share)
                gone[block] |= np.any(np.isnan(primal(rows)), axis=(0, 2, 3))
                reading = self._reading(measure)
                reads[measure.name].append(reading.read(courses, np.max(status, axis=(1, 2)), times.get(measure.name)))
        return {name: _joined_reads(parts) for name, parts in reads.items()}, offending, gone

    def _evaluated(
        self, values: Values, time: Number
    ) -> tuple[dict[str, list[Number]], NDArray[np.int8], Number | None]:
        """The parts at times of the nominal mechanism, s, (lane, panel, node), the statuses, and the times of each, if
        they are others."""
        run, flat = self.run, linear(time, lambda array: array.reshape(len(array), -1))
        place = within(run, flat)
        evaluated = moved(run, values, place)
        alone = len(primal(evaluated)) == 1
        curves, status = self.kernel.courses(values, evaluated[0] if alone else evaluated)
        full = (max(lanes_of(values), len(primal(evaluated))), *np.shape(primal(time))[1:])

        def shaped(array: Any) -> Any:
            array = np.asarray(array)
            if array.size != np.prod(full):
                array = np.broadcast_to(array, (full[0], np.prod(full[1:])))
            return array.reshape(full)

        parts = {measure.name: [linear(part, shaped) for part in curves[measure.name]] for measure in self.measures}
        if evaluated is place:
            return parts, shaped(status), None
        laps = np.rint((primal(flat) - primal(place)) / run.cycle.duration)
        evaluated = evaluated + moved(run, values, np.array([run.cycle.duration])) * laps
        return parts, shaped(status), linear(evaluated, lambda array: array.reshape(-1, *full[1:]))

    def _nominal(self, time: Number) -> dict[str, list[Number]]:
        """The parts of the nominal mechanism at times, s, of measures that are judged against it."""
        if not self.against:
            return {}
        real = np.asarray(primal(time))
        once = bool(np.all(real == real[:1]))  # as of mechanisms that differ in their derivatives alone
        at = (Dual(real[:1], np.ones_like(real[:1])) if isinstance(time, Dual) else real[:1]) if once else time
        parts = self._evaluated(self.values, at)[0]
        if once and isinstance(time, Dual):
            parts = {
                name: [Dual(primal(p), derivative(p) * time.dual) for p in numbers] for name, numbers in parts.items()
            }
        return {measure.name: parts[measure.name] for measure in self.against}

    def _rows(
        self,
        measure: Measure,
        parts: Mapping[str, list[Number]],
        nominal: Mapping[str, list[Number]],
        time: Number,
    ) -> Number:
        """The rows that the figure is read of, (row, lane, panel, node)."""
        numbers, before = parts[measure.name], nominal.get(measure.name)
        if measure.turning(self.run.system):
            numbers = [near(numbers[0], np.interp(primal(time), *self.angles[measure.name]))]
            before = before and [near(before[0], primal(numbers[0]))]
        if before and measure.of_attitude(self.run.system):
            numbers = [turn(numbers, before, measure.axis)]
        elif before:
            numbers = [part - was for part, was in zip(numbers, before, strict=True)]
        return combined(lambda *arrays: np.stack(np.broadcast_arrays(*arrays)), *numbers)

    def _offending(self, measure: Measure, panels: Panels, rows: Array, share: float) -> Flags:
        """Panels that do not resolve the courses as far as the figure needs it, or whose numbers are infinite; of dual
        numbers those too that do not resolve the derivatives. Wide ones that hardly resolve them at all are parted
        wherever they are, as they may hide places without an answer."""
        fine = FINE_MOTION if self.of_motion else FINE_PLACE if measure.of_place else FINE
        fine = 100.0 * MARGINS.tolerance if measure.wants_margin else fine
        tails = panels.tails()
        sizes = np.maximum(self._sizes[measure.name], np.max(np.abs(rows), axis=(0, 2, 3)))[:, None]
        excess = tails / np.where(sizes > 0.0, share * fine * sizes, np.inf)
        if isinstance(panels.coefficients, Dual):
            changes = np.abs(np.broadcast_to(panels.coefficients.dual, panels.coefficients.shape))
            most = np.max(changes, axis=(0, 2, 3))[:, None]
            most = np.maximum(most, NONE * np.max(np.nan_to_num(most)))  # what has no effect has rounding for one
            last = np.max(changes[..., -2:], axis=(0, 3))
            excess = np.maximum(excess, last / np.where(most > 0.0, share * FINE_CHANGE * most, np.inf))
        offending = np.zeros(tails.shape, bool)
        if np.any(excess > 1.0):
            answered = np.all(np.isfinite(tails), axis=1, keepdims=True)
            wide = primal(panels.half) > GAP * np.sum(primal(panels.half), axis=1, keepdims=True)
            rough = self._reading(measure).offending(panels, excess) | (wide & (tails > GROSS * sizes))
            offending |= rough & answered
        return np.asarray(offending)

    def _reading(self, measure: Measure) -> Reading:
        return Reading(self.run, measure, self.ends, self.figures.get(measure.name, np.nan))

    # ---- mechanisms by themselves -------------------------------------------------------------------------

    def _alone(
        self, reads: dict[str, Read], values: Values, lanes: Lanes, times: Mapping[str, Array]
    ) -> dict[str, Read]:
        """The same with some mechanisms read of courses of their own; derivatives are differences of them."""
        plain = {path: primal(value) for path, value in values.items()}
        alone = self._of_their_own(picked(plain, lanes), times)
        if any(isinstance(value, Dual) for value in values.values()):
            *sides, step = sides_of(self.run, values)
            below, above = (self._of_their_own(picked(side, lanes), {}) for side in sides)
            width = 2 * step[lanes, 0]
            for name, read in alone.items():
                numbers = [
                    Dual(middle, np.divide(high - low, width, out=np.zeros_like(width), where=width > 0))
                    for middle, low, high in zip(read[:3], below[name], above[name], strict=False)
                ]
                alone[name] = Read(numbers[0], numbers[1], numbers[2], *read[3:])
        return {name: _put(reads[name], lanes, read) if reads else read for name, read in alone.items()}

    def _of_their_own(self, values: Values, times: Mapping[str, Array]) -> dict[str, Read]:
        """What courses of their own say of some mechanisms, each with the places where it switches looked for."""
        run, cycle, reads = self.run, self.run.cycle, list[dict[str, Read]]()
        accuracy = SEATED if self._each_alone else MOTION if self.of_motion else OWN
        accuracy = MARGINS if self.measures[0].wants_margin else accuracy
        more = self._breaks if self.against else np.zeros(0)
        for lanes in _blocks(lanes_of(values), ALONE):
            block_values, count = picked(values, lanes), len(lanes)
            lengths = np.ravel(primal(moved(run, block_values, np.array([cycle.duration])))) / cycle.duration
            ratio, switching = np.broadcast_to(lengths, count), [np.zeros(0)] * count
            if (breaks_own := self.kernel.breaks(block_values)) is not None:
                switching = breaks_own
            elif self.bends or not self.of_motion:
                cycles = [replace(cycle, duration=cycle.duration * float(length)) for length in ratio]
                every = bends(Mechanisms(run.system, run.chosen.assembly, block_values, cycles))
                switching = [np.array([bend.time for bend in row]) for row in every]
            breaks = [
                breaks_between(cycle, np.concatenate([bend / length, more]), *self.span)
                for bend, length in zip(switching, ratio, strict=True)
            ]
            reads += [self.read_alone(course, times) for course in self.courses(block_values, breaks, accuracy)]
        return {name: _joined_reads([read[name] for read in reads]) for name in reads[0]}

    def read_alone(self, course: Courses, times: Mapping[str, Array]) -> dict[str, Read]:
        """What the courses of one mechanism say."""
        status, row, reads = np.array([np.max(course.states)], np.int8), 0, {}
        for measure in self.measures:
            count = 1 if measure.of_attitude(self.run.system) else self._counts[measure.name]
            panels = Panels.of(course, slice(row, row := row + count))
            reads[measure.name] = self._reading(measure).read(panels, status, times.get(measure.name))
        return reads

    def courses(
        self, values: Values, breaks: Sequence[Array], accuracy: Accuracy, tuned: bool = False
    ) -> list[Courses]:
        """Courses of some mechanisms between their breaks, s.

        tuned: of the nominal one for its panels: its numbers as they are, of which it matters only whether they have a
        value.
        """

        def look(lanes: Lanes, time: Array) -> tuple[Array, NDArray[np.integer]]:
            alone = len(breaks) == 1
            panels = time.reshape(1, 1, -1) if alone else time[:, None]
            parts, status, _ = self._evaluated(values if alone else picked(values, lanes), panels)
            nominal = {} if tuned else self._nominal(panels)
            rows = [np.asarray(self._rows(measure, parts, nominal, panels)) for measure in self.measures]
            numbers = np.concatenate(rows).reshape(-1, *time.shape)
            return numbers, np.zeros(time.shape, int) if tuned else status.reshape(time.shape)

        system = self.run.system
        counts = [1 if item.of_attitude(system) and not tuned else self._counts[item.name] for item in self.measures]
        scales = np.repeat([self._scales[measure.name] for measure in self.measures], counts)
        accuracy = accuracy_of(self.run.cycle, MARGINS if tuned and self.measures[0].wants_margin else accuracy)
        return Courses.many(look, breaks, lambda sizes: np.maximum(sizes, scales), accuracy)


# ---- lanes ----------------------------------------------------------------------------------------------------


def _blocks(count: int, size: int) -> Iterator[Lanes]:
    """Numbers of mechanisms, so many at a time."""
    yield from (np.arange(first, min(first + size, count)) for first in range(0, count, size))


def _middles(edges: Number, panels: Flags) -> Number:
    """Middles of some panels."""
    return ((edges[:, 1:] + edges[:, :-1]) / 2)[:, panels]


def _taken(number: Number, lanes: Lanes) -> Number:
    """Some lanes of a number, which may be one for all."""
    return number if len(primal(number)) == 1 else number[lanes]


def _sorted(number: Number) -> Number:
    """Rising along the last axis."""
    order = np.argsort(primal(number), axis=-1, kind="stable")
    return linear(number, lambda array: np.take_along_axis(np.broadcast_to(array, order.shape), order, axis=-1))


def _joined(*parts: Number) -> Number:
    """Edges beside each other."""
    return combined(lambda *arrays: np.concatenate(arrays, 1), *parts)


def _clipped(number: Number, low: float | Array, high: float | Array) -> Number:
    """A number between two others, where it has no derivative."""
    inside = (primal(number) > low) & (primal(number) < high)
    clipped = np.clip(primal(number), low, high)
    return Dual(clipped, np.where(inside, number.dual, 0.0)) if isinstance(number, Dual) else clipped


def _joined_reads(reads: Sequence[Read]) -> Read:
    """Lanes one after another."""
    return Read.of(lambda *arrays: np.concatenate(arrays), *reads)


def _put(read: Read, lanes: Lanes, single: Read) -> Read:
    """What is read of all lanes, with others in place of some."""

    def replaced(every: Array, part: Array) -> Array:
        changed = np.array(every)
        if np.shape(every)[1:] == np.shape(part)[1:]:  # there may be nothing to show
            changed[lanes] = part
        return changed

    return Read.of(replaced, read, single)


# ---- figures --------------------------------------------------------------------------------------------------


@np.errstate(all="ignore")
def figures_of(run: Run, measures: Sequence[Measure], method: FrictionMethod) -> dict[str, float]:
    """The figures of measures of one mechanism, SI, by name; NaN where a place that one needs has no answer.

    Extremes leave out where a pin loses contact, for its seat would jump there.
    Raises MechanismError for places and windows that are not in the cycle.
    """
    figures: dict[str, float] = {}
    gaps = seating_of(run, method).gaps if run.seats and measures else np.zeros((2, 0))
    for ends, grouped in together(run, measures):
        kernel = SeatedKernel(run, grouped, replace(method, margin_up_to=0.0), gaps)
        group = Group(run, grouped, ends, run.values, kernel, {})
        if group.at_place:
            reads = group.read_between(run.values, group.edges[None], {})[0]
            if any(read.status[0] == Status.CONTACT_LOST for read in reads.values()):
                reads = {name: read._replace(figure=np.nan) for name, read in reads.items()}
        else:
            breaks = [bend.time for bend in run.bends if run.seats or matters(bend, grouped)]
            breaks += [*(seating_of(run, method).breaks if run.seats else ()), *gaps.ravel()]
            between = breaks_between(run.cycle, np.array(breaks), *group.span)
            motion = MOTION if group.of_motion else Accuracy()
            accuracy = MARGINS if grouped[0].wants_margin else SEATED if run.seats else motion
            reads = group.read_alone(group.courses(run.values, [between], accuracy)[0], {})
        figures |= {name: float(np.ravel(primal(read.figure))[0]) for name, read in reads.items()}
    return {measure.name: figures[measure.name] for measure in measures}


def together(run: Run, measures: Sequence[Measure]) -> list[tuple[tuple[float, ...], tuple[Measure, ...]]]:
    """Measures whose courses have the same panels, with the place or the ends of their window, s, (0,) at rest.

    Raises MechanismError for places and windows that are not in the cycle.
    """
    groups: dict[tuple[object, ...], list[Measure]] = {}
    every = ends_by_name(run, measures)
    for measure in measures:
        ends = every[measure.name]
        against = measure.of.against or measure.rule == "deviation"
        key = (ends, measure.wants_margin, measure.of_motion, against and not measure.of_motion)
        groups.setdefault(key if len(ends) != 1 else (ends,), []).append(measure)
    return [(every[group[0].name], tuple(group)) for group in groups.values()]


class Many:
    """Measures of a nominal mechanism, ready to be read of others.

    run: the mechanism; values: its numbers, with pins where they are to be. kernels: what evaluates some measures.
    figures: of the nominal mechanism, by name; times: of those that are an extreme, s, else NaN.
    """

    def __init__(
        self, run: Run, measures: Sequence[Measure], values: Values, kernels: Callable[[Sequence[Measure]], NumpyKernel]
    ) -> None:
        self.run, self.measures, self.values, self._kernels = run, tuple(measures), values, kernels
        self.figures: dict[str, float] = {}
        self.times: dict[str, float] = {}
        groups = together(run, measures)
        self._groups = [Group(run, group, ends, values, kernels(group), self.figures) for ends, group in groups]
        self.tune(values)

    def tune(self, values: Values) -> None:
        """Let the panels resolve the courses of some mechanisms, which stand for all that are to be read."""
        self.figures.clear()
        with np.errstate(all="ignore"):
            for group in self._groups:
                group.tune(values)
        reads = self.read(self.values)
        self.figures.update((name, float(np.ravel(read.figure)[0])) for name, read in reads.items())
        self.times = {measure.name: float(reads[measure.name].time[0]) for measure in self.measures}

    def only(self, measures: Sequence[Measure]) -> Many:
        """The same of some of the measures, their panels tuned to the nominal mechanism alone."""
        return Many(self.run, measures, self.values, self._kernels)

    def angle(self, measure: Measure, times: Array) -> Array:
        """The angle of the nominal mechanism near some times, s, without jumps, of a measure that turns."""
        group = next(group for group in self._groups if measure in group.measures)
        return np.asarray(np.interp(times, *group.angles[measure.name]))

    def spots(self, measure: Measure) -> Array:
        """Times, s, rising, at which a course is looked through, both sides of every break among them."""
        group = next(group for group in self._groups if measure in group.measures)
        return group.edges if group.at_place else group.spots

    def read(self, values: Values, times: Mapping[str, Array] | None = None) -> dict[str, Read]:
        """What the courses of mechanisms with other numbers say, by measure.

        values: (lane, 1) where they vary, floats or dual numbers. times: of each measure, s, at which its course is to
        be shown.
        """
        reads: dict[str, Read] = {}
        with np.errstate(all="ignore"):
            for group in self._groups:
                reads |= group.read(values, times or {})
        return {measure.name: reads[measure.name] for measure in self.measures}
