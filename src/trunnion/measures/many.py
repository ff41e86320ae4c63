"""Figures of many mechanisms that differ in their numbers from a nominal one.

The panels of the nominal mechanism's courses, found once, serve all of them: their edges go along with the places at
which each mechanism switches, so that every one has its courses between its own breaks, at a few Chebyshev points a
panel. What the polynomials do not resolve, as a load that the nominal mechanism only just does not meet, has its own
`Courses`. With dual numbers the edges move too: d/dp ∫ y dt has the part of the jumps (Leibniz), and an extreme at a
break that of its place.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Accuracy, Courses
from trunnion.algebra.dual import Dual, derivative, primal
from trunnion.algebra.namespace import Number
from trunnion.algebra.panels import FIT, ON_GAUSS, POINTS, RATE, linear
from trunnion.measures.evaluation import Curves, Kernel, shape_of
from trunnion.measures.figures import Panels, Reading, columns, near, rows_of
from trunnion.measures.measures import Measure
from trunnion.measures.over_cycle import ENDLESS, MOTION, Followed, alike, endless_and_lost, followed, matters, together
from trunnion.measures.positions import moved
from trunnion.solve.run import Run
from trunnion.solve.switches import (
    MARGINS,
    Bend,
    Mechanisms,
    accuracy_of,
    bends,
    breaks_between,
    shifts_of,
    stated_bends,
    tracked,
)
from trunnion.solve.system import Values

__all__ = ["Many", "Read", "step_of"]

Array = NDArray[np.float64]
Lanes = NDArray[np.intp]
TURN = 2 * np.pi
READ = 512  # mechanisms whose courses are read at a time: their arrays stay in cache
FINE, FINE_MOTION = 1e-8, 1e-12  # of the size of a course: how far figures may be off, of forces and of the motion
FINE_PLACE = 1e-11  # and where a place of forces is read
NONE = 1e-9  # of the largest derivative: less is none
FINE_CHANGE = 1e-6  # of the size of derivatives: how far those of figures may be off
FIRM = 0.3  # of that: where panels are tuned
FIRST = Accuracy(1e-4, 1e-5, rounds=2)  # of the courses whose panels are tuned
OWN = Accuracy(1e-7, 1e-8, rounds=20)  # of courses of mechanisms by themselves
GAP, GROSS = 1 / 360, 1e-3  # of the courses: panels that hide nothing; of their size: what tells of a gap
PARTED, MOST_PANELS = 7, 60  # rounds in which panels are halved; of panels that serve all
ROUNDING = 1e-6  # of what numbers are like: courses that are much smaller
CLOSE, LOCATED = 1e-9, 3e-10  # of the cycle: times that are one, and bends but for the error of their location
LOOKED = np.linspace(-1.0, 1.0, 25)
LOOKED[[0, -1]] *= 1 - 1e-6
SHORT = 1e-2  # of the step of a difference: what moves bends is smooth
STEP, STEP_OF_NONE = 1e-3, 1e-4  # of a number, and of the size of the mechanism for one that is 0: of a difference


class Read(NamedTuple):
    """What is read of the courses of a measure, (lane,) each.

    figure; least, most: its signed deviations from the nominal mechanism, over the courses of a largest |deviation|;
    status: the gravest of their places; shown: one number at the times asked for, (lane, time), none where the edges
    have derivatives.
    """

    figure: Number
    least: Number
    most: Number
    status: NDArray[np.int8]
    shown: Number


class Many:
    """Measures of a nominal mechanism, ready to be read of others.

    run: the mechanism; values: its numbers, with pins where they are to be. kernels: what evaluates some measures, of
    plain numbers; duals: the same, of dual numbers. figures: of the nominal mechanism, by name; times: of those that
    are an extreme, s, else NaN.
    """

    def __init__(
        self,
        run: Run,
        measures: Sequence[Measure],
        values: Values,
        kernels: Callable[[Sequence[Measure]], Kernel],
        duals: Callable[[Sequence[Measure]], Kernel] | None = None,
    ) -> None:
        self.run, self.measures, self.values = run, tuple(measures), values
        self._kernels = kernels, duals
        self._groups = [
            _Group(run, tuple(group), ends, values, kernels(group), (duals or kernels)(group))
            for ends, group in together(run, measures)
        ]
        self.tune(values)

    @property
    def nodes(self) -> int:
        """Places at which a mechanism is evaluated."""
        return sum(group.nodes for group in self._groups)

    def spots(self, measure: Measure) -> Array:
        """Times, s, rising, at which a course is looked through, both sides of every break among them."""
        group = next(one for one in self._groups if measure in one.measures)
        return np.array(group.ends) if group.at_place else group.spots

    def tune(self, values: Values) -> None:
        """Let the panels resolve the courses of some mechanisms, which stand for all that are to be read."""
        with np.errstate(all="ignore"):
            for group in self._groups:
                group.tune(values)
            nominal = {name: both for group in self._groups for name, both in group.nominal().items()}
        self.figures = {measure.name: nominal[measure.name][0] for measure in self.measures}
        self.times = {measure.name: nominal[measure.name][1] for measure in self.measures}

    def alone(self, measure: Measure) -> Many:
        """The same of one of the measures."""
        return Many(self.run, [measure], self.values, *self._kernels)

    def read(self, values: Values, times: Mapping[str, Array] | None = None) -> dict[str, Read]:
        """What the courses of mechanisms with other numbers say, by measure.

        values: (lane, 1) where they vary, floats or dual numbers. times: of each measure, s, at which its course is to
        be shown.
        """
        found: dict[str, Read] = {}
        with np.errstate(all="ignore"):
            for group in self._groups:
                found |= group.read(values, times or {})
        return {measure.name: found[measure.name] for measure in self.measures}


class _Piece(NamedTuple):
    """The courses of a measure of some mechanisms, with the panels that do not resolve them, (lane, panel), whether
    places are without an answer, and the gravest status."""

    measure: Measure
    lanes: Lanes
    panels: Panels
    offending: NDArray[np.bool_]
    gone: NDArray[np.bool_]
    status: NDArray[np.int8]


@dataclass(frozen=True, eq=False)
class _Group:
    """Measures whose courses have the same panels. ends: times, s, of a place, a window, or none; figures: nominal."""

    run: Run
    measures: tuple[Measure, ...]
    ends: tuple[float, ...]
    values: Values
    kernel: Kernel
    dual_kernel: Kernel
    figures: dict[str, float] = field(default_factory=dict)

    # ---- the nominal mechanism ----------------------------------------------------------------------------

    @property
    def at_place(self) -> bool:
        return len(self.ends) == 1

    @property
    def nodes(self) -> int:
        return 1 if self.at_place else len(POINTS) * (len(self.edges) - 1)

    def against(self, measure: Measure) -> bool:
        """Whether a measure is judged against the nominal mechanism."""
        return measure.of.against or measure.of_attitude(self.run.system) or measure.rule == "deviation"

    @cached_property
    def bends(self) -> list[Bend]:
        """Where the nominal mechanism switches, within its cycle."""
        run = self.run
        alone = Mechanisms(run.system, run.chosen.assembly, self.values, [run.cycle])
        found = run.bends if self.values is run.values else stated_bends(alone)
        return [bend for bend in found if matters(bend, self.measures)]

    @cached_property
    def course(self) -> Followed:
        """The courses of the nominal mechanism, whose panels are tuned."""
        times = np.array([bend.time for bend in self.bends])
        accuracy = MARGINS if self.measures[0].wants_margin else FIRST
        return followed(self.run, self.measures, self.ends, self._stateless, times, accuracy)

    def _stateless(self, time: Array) -> tuple[Curves, NDArray[np.int8]]:
        """The parts of the nominal mechanism at times, s; what matters of their states is whether they have a value."""
        curves, status = self.kernel.courses(self.values, time)
        return curves, np.zeros_like(status)

    def fine(self, measure: Measure) -> float:
        """Of the size of courses: how far figures may be off; a place is off by the root of that."""
        if measure.wants_margin:
            return 100.0 * MARGINS.tolerance
        return FINE_MOTION if self.of_motion else FINE_PLACE if measure.of_place else FINE

    @cached_property
    def of_motion(self) -> bool:
        """Whether the motion alone decides the courses."""
        return all(measure.of_motion for measure in self.measures)

    @cached_property
    def edges(self) -> Array:
        """Of the panels that serve all, s, those of the stated breaks among them; see `tune`."""
        return np.array(self.course.courses.edges)

    def tune(self, values: Values) -> None:
        """Part the panels until they resolve the courses of some mechanisms as far as their figures need it."""
        if self.at_place:
            return
        for _ in range(PARTED):
            edges, lost = self.own_edges(values, lanes_of(values))
            offending = self._on(self.dual_kernel, values, edges, {}, FIRM)[1]
            panels = np.any(offending[~lost], axis=0)
            count = len(self.edges) - 1
            if np.shape(primal(edges))[1] - 1 != count:  # the bends of each are edges besides
                middle = np.median((primal(edges)[:, 1:] + primal(edges)[:, :-1]) / 2, axis=0)
                panels = np.bincount(np.searchsorted(self.edges, middle[panels], side="right") - 1, minlength=count) > 0
            if not np.any(panels) or count > MOST_PANELS:
                break
            middle = (self.edges[1:] + self.edges[:-1])[panels] / 2
            self.__dict__["edges"] = np.sort(np.append(self.edges, middle))

    @cached_property
    def spots(self) -> Array:
        """Places of all panels, s, rising, the first and the last beside their edges."""
        low, half = self.edges[:-1], np.diff(self.edges) / 2
        return np.unique(low + half * (1.0 + LOOKED[:, None]))

    @property
    def span(self) -> tuple[float, float]:
        """Both ends, s."""
        return (self.ends[0], self.ends[1]) if self.ends else (0.0, self.run.cycle.duration)

    def nominal(self) -> dict[str, tuple[float, float]]:
        """The figures of the nominal mechanism and, of extremes, their times, s; found again as panels are tuned."""
        self.figures.clear()
        found = {}
        if self.at_place:
            reads = self._at_place(self.kernel, self.values, 1)
            found = {name: (float(np.ravel(read.figure)[0]), float("nan")) for name, read in reads.items()}
        else:
            pieces = list(self._pieces(self.kernel, self.values, self.edges[None]))
            if any(np.any(piece.offending) for piece in pieces):
                pieces = list(self._pieces_alone(self.values))
            for piece in pieces:
                reading = self.reading(piece.measure)
                figure = float(np.ravel(reading.figure(piece.panels))[0])
                sure = np.isfinite(figure) and not self.against(piece.measure)
                found[piece.measure.name] = figure, reading.time(piece.panels) if sure else float("nan")
        self.figures.update({name: figure for name, (figure, _) in found.items()})
        return found

    def reading(self, measure: Measure, nominal: float = float("nan")) -> Reading:
        return Reading(self.run, measure, self.ends if len(self.ends) == 2 else (), nominal)

    # ---- edges of others ----------------------------------------------------------------------------------

    def own_bends(self, values: Values, count: int) -> Number:
        """Times of the nominal mechanism, s, (lane, bend), at which each switches; NaN where it is far off."""
        run, plain = self.run, {path: primal(value) for path, value in values.items()}

        def at(own: Values, time: Array) -> Number:
            return moved(run, own, time)

        of = Mechanisms(run.system, run.chosen.assembly, plain, [run.cycle] * count)
        times = tracked(of, self.bends, at)
        slopes = {path: derivative(value) for path, value in values.items() if isinstance(value, Dual)}
        if not slopes:
            return times
        if not any(np.any(slope) for slope in slopes.values()):
            return Dual(times, np.zeros_like(times))
        step = SHORT * step_of(run, values, count)
        below, above = (
            {**plain, **{path: plain[path] + way * step * slope for path, slope in slopes.items()}}
            for way in (-1.0, 1.0)
        )
        shifts = shifts_of(of, self.bends, times, at, (below, above))
        return Dual(times, np.divide(shifts, 2 * step, out=np.zeros_like(shifts), where=step > 0))

    def own_edges(self, values: Values, count: int) -> tuple[Number, NDArray[np.bool_]]:
        """Edges of the panels of each, (lane, edge), or (1, edge) if they are those of all; where bends are lost."""
        none = np.zeros(count, bool)
        if not self.bends:
            return self.edges[None], none
        own, end = self.own_bends(values, count), self.span[1]
        times = np.array([bend.time for bend in self.bends])
        lost = np.any(np.isnan(primal(own)), axis=1)
        near = np.abs(primal(own) - times) <= LOCATED * end  # so that the same mechanism has the same edges
        own = own + np.where(near, times - primal(own), 0.0)
        same = np.all(near, axis=1) & ~np.any(derivative(own) + 0.0 * times, axis=1)
        if np.all(same | lost):
            return self.edges[None], lost
        own = linear(own, lambda array: np.where(lost[:, None], 0.0, array))
        own = own + np.where(lost[:, None], times, 0.0)
        if any(self.against(one) for one in self.measures):
            return self._parted(own, times), lost
        return self._moved(own, times), lost

    def _laps(self, own: Number, times: Array) -> tuple[Number, Array]:
        """Bends within the span, rising, of others and of the nominal mechanism, in all periods that it touches."""
        start, end = self.span
        duration = self.run.cycle.duration
        laps = (
            np.arange(np.floor(start / duration) - 1, np.ceil(end / duration) + 1)
            if self.run.cycle.periodic
            else np.zeros(1)
        )
        nominal = (times + laps[:, None] * duration).ravel()
        others = linear(own, lambda array: np.tile(array, len(laps)))
        others = others + np.repeat(laps * duration, len(times))
        order = np.argsort(nominal, kind="stable")
        return linear(others, lambda array: array[:, order]), nominal[order]

    def _moved(self, own: Number, times: Array) -> Number:
        """The nominal edges as they go along with the bends next to them."""
        others, nominal = self._laps(own, times)
        start, end = self.span
        if self.ends or not self.run.cycle.periodic:  # the ends of a window stay
            inner = (nominal > start + CLOSE * end) & (nominal < end - CLOSE * end)
            count = np.shape(primal(others))[0]
            low, high = np.full((count, 1), start), np.full((count, 1), end)
            others = linear(others, lambda array: array[:, inner])
            others = _joined(low, _clipped(others, start, end), high)
            nominal = np.concatenate([[start], nominal[inner], [end]])
        others = _sorted(others)
        place = np.clip(np.searchsorted(nominal, self.edges + CLOSE * end, side="right") - 1, 0, len(nominal) - 2)
        share = np.clip(
            (self.edges - nominal[place]) / np.maximum(nominal[place + 1] - nominal[place], CLOSE * end), 0.0, 1.0
        )
        share[self.edges - nominal[place] <= CLOSE * end] = 0.0
        edges = linear(others, lambda array: array[:, place] * (1.0 - share) + array[:, place + 1] * share)
        ones = np.flatnonzero(np.diff(nominal) <= CLOSE * end)  # bends that are one of the nominal mechanism alone
        ones = ones[(nominal[ones] >= start - CLOSE * end) & (nominal[ones] <= end + CLOSE * end)]
        if len(ones) == 0:
            return edges
        low, high = primal(edges)[:, :1], primal(edges)[:, -1:]
        return _sorted(_joined(edges, _clipped(linear(others, lambda array: array[:, ones]), low, high)))

    def _parted(self, own: Number, times: Array) -> Number:
        """The nominal edges and the bends of each: what is taken less the nominal mechanism jumps at both."""
        others = self._laps(own, times)[0]
        start, end = self.span
        fixed = np.broadcast_to(self.edges, (np.shape(primal(others))[0], len(self.edges)))
        inside = np.any((primal(others) > start) & (primal(others) < end), axis=0)
        return _sorted(_joined(fixed, _clipped(linear(others, lambda array: array[:, inside]), start, end)))

    # ---- courses of others --------------------------------------------------------------------------------

    def read(self, values: Values, times: Mapping[str, Array]) -> dict[str, Read]:
        """What the courses of mechanisms with other numbers say.

        Panels that do not resolve the course of one as far as its figures need it are parted; what jumps within one has
        courses of its own.
        """
        count, dual = lanes_of(values), any(isinstance(value, Dual) for value in values.values())
        kernel = self.dual_kernel if dual else self.kernel
        if self.at_place:
            return self._at_place(kernel, values, count)
        edges, lost = self.own_edges(values, count)
        reads, offending, gone = self._on(kernel, values, edges, times)
        left, width = np.flatnonzero(np.any(offending, axis=1) & ~lost & ~gone), np.shape(primal(edges))[1]
        edges = _taken(linear(edges, lambda array: np.broadcast_to(array, (count, width))), left)
        for _ in range(PARTED):
            if not len(left):
                break
            edges = _sorted(_joined(edges, _middle(edges, np.any(offending[np.any(offending, axis=1)], axis=0))))
            own, offending, _ = self._on(kernel, _picked(values, left), edges, times)
            reads = {name: _put(read, left, own[name]) for name, read in reads.items()}
            more = np.any(offending, axis=1)
            left, edges = left[more], _taken(edges, np.flatnonzero(more))
        alone = np.union1d(left, np.flatnonzero(lost & ~gone)).astype(np.intp)
        return self._alone(reads, values, alone, times, dual) if len(alone) else reads

    def _on(
        self, kernel: Kernel, values: Values, edges: Number, times: Mapping[str, Array], share: float = 1.0
    ) -> tuple[dict[str, Read], NDArray[np.bool_], NDArray[np.bool_]]:
        """What the courses between some edges say; panels that do not resolve them, (lane, panel), to a share of what
        figures may be off; mechanisms with places without an answer."""
        count, panels = lanes_of(values), np.shape(primal(edges))[1] - 1
        offending, gone = np.zeros((count, panels), bool), np.zeros(count, bool)
        found: dict[str, list[Read]] = {measure.name: [] for measure in self.measures}
        for piece in self._pieces(kernel, values, edges, share):
            offending[piece.lanes] |= piece.offending
            gone[piece.lanes] |= piece.gone
            found[piece.measure.name].append(self._read(piece.measure, piece.panels, piece.status, times))
        return {name: _whole(parts) for name, parts in found.items()}, offending, gone

    def _pieces(self, kernel: Kernel, values: Values, edges: Number, share: float = 1.0) -> Iterator[_Piece]:
        """The courses of every measure between some edges, so many mechanisms at a time."""
        low, half = linear(edges, lambda array: array[:, :-1]), linear(edges, lambda array: np.diff(array) / 2)
        time = _wide(low) + _wide(half) * (1.0 + POINTS)
        curves, status, own = self._evaluated(kernel, values, time)
        count = lanes_of(values)
        full = (count, *np.shape(primal(low))[1:], len(POINTS))
        gravest = np.max(np.broadcast_to(status.reshape(-1, full[1] * full[2]), (count, full[1] * full[2])), axis=1)
        nominal, weights = self._nominal_at(time), self._weights(half, own)
        for first in range(0, count, READ):
            lanes = np.arange(first, min(first + READ, count))
            none = np.zeros((len(lanes), full[1]), bool)
            sides = [_taken(part, lanes) for part in (low, half, weights)]
            for measure in self.measures:
                parts = [_taken(_shaped(part, full), lanes) for part in curves[measure.name]]
                rows = self._rows(measure, parts, nominal, time, lanes)
                coefficients = linear(rows, lambda array: array @ FIT.T)
                panels = Panels(sides[0], sides[1], coefficients, sides[2], none, none)
                offending = self._offending(measure, panels, primal(rows), share)
                gone = np.any(np.isnan(primal(rows)), axis=(0, 2, 3))
                yield _Piece(measure, lanes, panels, offending, gone, gravest[lanes])

    def _evaluated(
        self, kernel: Kernel, values: Values, time: Number
    ) -> tuple[Curves, NDArray[np.int8], Number | None]:
        """The parts at times of the nominal mechanism, s, (lane, panel, node), the statuses, and the times of each, if
        they are others."""
        flat = linear(time, lambda array: array.reshape(len(array), -1))
        rows, width = np.shape(primal(flat))
        duration, laps = self.run.cycle.duration, np.zeros((rows, width))
        if self.run.cycle.periodic:
            laps = np.floor(primal(flat) / duration)
            flat = flat - laps * duration
        own, count = moved(self.run, values, flat), max(lanes_of(values), rows)
        size = max(1, kernel.at_once // width)
        pieces = []
        for low in range(0, count, size):
            lanes = np.arange(low, min(low + size, count))
            some = _picked(values, lanes) if count > size else values
            there = _taken(own, lanes)
            pieces.append(
                kernel.courses(some, linear(there, lambda array: array[0]) if len(primal(there)) == 1 else there)
            )
        curves = {
            one.name: _pieced(
                [part[0][one.name] for part in pieces], [len(np.atleast_2d(part[1])) for part in pieces], width
            )
            for one in self.measures
        }
        status = np.concatenate([np.atleast_2d(part[1]) for part in pieces])
        if own is flat:
            return curves, status, None
        return curves, status, own + moved(self.run, values, np.array([duration])) * laps

    def _nominal_at(self, time: Number) -> Mapping[str, tuple[Number, ...]]:
        """The parts of the nominal mechanism at times, s, of measures that are judged against it."""
        if not any(self.against(one) for one in self.measures):
            return {}
        kernel = self.dual_kernel if isinstance(time, Dual) else self.kernel
        shape = np.shape(primal(time))
        curves = self._evaluated(kernel, self.values, time)[0]
        return {
            one.name: tuple(_shaped(part, shape) for part in curves[one.name])
            for one in self.measures
            if self.against(one)
        }

    def _rows(
        self,
        measure: Measure,
        parts: Sequence[Number],
        nominal: Mapping[str, tuple[Number, ...]],
        time: Number,
        lanes: Lanes,
    ) -> Number:
        """The rows that the figure is read of, (row, lane, panel, node)."""
        before = nominal.get(measure.name)
        if before is not None:
            before = tuple(_taken(part, lanes) for part in before)
        if measure.turning(self.run.system):
            grid, angle = self.course.angles[measure.name]
            parts = [near(parts[0], np.interp(primal(_taken(time, lanes)), grid, angle), TURN)]
            before = None if before is None else (near(before[0], primal(parts[0]), TURN),)
        return rows_of(parts, before, measure.axis if measure.of_attitude(self.run.system) else "")

    def _weights(self, half: Number, own: Number | None) -> Number:
        """How much time of each mechanism the Gauss nodes count, (lane, panel, node or 1)."""
        if own is None:
            return _wide(half)
        panels = np.shape(primal(half))[-1]
        return linear(own, lambda array: np.asarray(array).reshape(-1, panels, len(POINTS)) @ FIT.T @ RATE @ ON_GAUSS)

    def _offending(self, measure: Measure, panels: Panels, rows: Array, share: float) -> NDArray[np.bool_]:
        """Panels that do not resolve the courses as far as the figure needs it, or whose numbers are infinite; of dual
        numbers those too that do not resolve the derivatives. Wide ones that hardly resolve them at all are parted
        wherever they are, as they may hide places without an answer."""
        tails = panels.tails()
        sizes = np.maximum(self._sizes[measure.name], np.max(np.abs(rows), axis=(0, 2, 3)))[:, None]
        excess = tails / np.where(sizes > 0.0, share * self.fine(measure) * sizes, np.inf)
        if isinstance(panels.coefficients, Dual):
            changes = np.abs(np.broadcast_to(panels.coefficients.dual, panels.coefficients.shape))
            most = np.max(changes, axis=(0, 2, 3))[:, None]
            most = np.maximum(most, NONE * np.max(np.nan_to_num(most)))  # what has no effect has rounding for one
            last = np.max(changes[..., -2:], axis=(0, 3))
            excess = np.maximum(excess, last / np.where(most > 0.0, share * FINE_CHANGE * most, np.inf))
        found = np.any(np.isinf(rows), axis=(0, 3))
        if np.any(excess > 1.0):
            known = np.all(np.isfinite(tails), axis=1, keepdims=True)
            wide = primal(panels.half) > GAP * np.sum(primal(panels.half), axis=1, keepdims=True)
            found |= (self.reading(measure).offending(panels, excess) | (wide & (tails > GROSS * sizes))) & known
        return np.asarray(found)

    @cached_property
    def _sizes(self) -> dict[str, float]:
        """The largest magnitude of the courses of the nominal mechanism, or of what is like them but for rounding."""
        found = {}
        for one, scale in zip(self.measures, self._scales, strict=True):
            own = self.course.courses.sizes[self.course.rows[one.name]]
            found[one.name] = 1.0 if one.of_attitude(self.run.system) else float(max(np.max(own), ROUNDING * scale))
        return found

    @cached_property
    def _scales(self) -> Array:
        """What the numbers of each measure are like."""
        return alike(self.run, self.measures, {one.name: slice(k, k + 1) for k, one in enumerate(self.measures)})

    def _read(self, measure: Measure, panels: Panels, status: NDArray[np.int8], times: Mapping[str, Array]) -> Read:
        reading = self.reading(measure, self.figures.get(measure.name, float("nan")))
        figure, least, most = reading.read(panels)
        shown: Number = np.zeros((len(status), 0))
        if measure.name in times and not isinstance(panels.low, Dual):
            time = times[measure.name]
            shown = linear(reading.shown(panels, time), lambda array: np.broadcast_to(array, (len(status), len(time))))
        return Read(figure, least, most, np.asarray(status, np.int8), shown)

    def _at_place(self, kernel: Kernel, values: Values, count: int) -> dict[str, Read]:
        time = (
            np.array(self.ends) % self.run.cycle.duration
            if self.run.cycle.periodic and self.run.cycle.duration > 0
            else np.array(self.ends)
        )
        curves, status = kernel.courses(values, moved(self.run, values, time))
        gravest = np.broadcast_to(np.asarray(status).reshape(-1), count).astype(np.int8)
        nominal = self.kernel.courses(self.values, time)[0]
        found = {}
        for measure in self.measures:
            parts = columns(curves[measure.name], count)
            before = columns([primal(part) for part in nominal[measure.name]], count)
            each = [linear(parts, lambda array, k=k: array[k]) for k in range(len(curves[measure.name]))]  # type: ignore[misc]
            if measure.turning(self.run.system):
                each = [near(each[0], before[0], TURN)]
            rows = rows_of(
                each,
                list(before) if self.against(measure) else None,
                measure.axis if measure.of_attitude(self.run.system) else "",
            )
            reading = self.reading(measure, self.figures.get(measure.name, float("nan")))
            figure, least, most = reading.read(Panels.constant(rows))
            found[measure.name] = Read(figure, least, most, gravest, np.asarray(primal(figure))[:, None])
        return found

    # ---- mechanisms by themselves -------------------------------------------------------------------------

    def _alone(
        self, reads: dict[str, Read], values: Values, lanes: Lanes, times: Mapping[str, Array], dual: bool
    ) -> dict[str, Read]:
        """The same with some mechanisms read of courses of their own; derivatives are differences of them."""
        plain = {path: primal(value) for path, value in values.items()}
        own = self._of_their_own(_picked(plain, lanes), times)
        if dual:
            step = step_of(self.run, values, len(next(iter(reads.values())).status))
            slopes = {path: derivative(value) for path, value in values.items() if isinstance(value, Dual)}

            def beside(way: float) -> dict[str, Read]:
                moves = {path: plain[path] + way * step * slope for path, slope in slopes.items()}
                return self._of_their_own(_picked({**plain, **moves}, lanes), {})

            own = _differing(own, beside(-1.0), beside(1.0), step[lanes, 0])
        return {name: _put(read, lanes, own[name]) for name, read in reads.items()}

    def _of_their_own(self, values: Values, times: Mapping[str, Array]) -> dict[str, Read]:
        """What courses of their own say of some mechanisms."""
        found: dict[str, list[Read]] = {measure.name: [] for measure in self.measures}
        for piece in self._pieces_alone(values):
            found[piece.measure.name].append(self._read(piece.measure, piece.panels, piece.status, times))
        return {name: _whole(parts) for name, parts in found.items()}

    def _pieces_alone(self, values: Values) -> Iterator[_Piece]:
        """Courses of their own of some mechanisms, one after the other."""
        first = np.cumsum([0, *(len(self._row_counts[measure.name]) for measure in self.measures)])
        for lane, course in enumerate(self._courses(values, lanes_of(values))):
            whole = Panels.of(course, *endless_and_lost(course))
            none, status = np.zeros((1, len(course.half)), bool), np.array([np.max(course.states % ENDLESS)])
            for k, measure in enumerate(self.measures):
                rows = whole.rows(slice(first[k], first[k + 1]))
                yield _Piece(measure, np.array([lane]), rows, none, none[:, 0], status)

    @cached_property
    def _row_counts(self) -> dict[str, range]:
        """How many rows the figure of each measure is read of."""
        rows = self.course.rows
        return {
            one.name: range(1)
            if one.of_attitude(self.run.system)
            else range(rows[one.name].stop - rows[one.name].start)
            for one in self.measures
        }

    def _courses(self, values: Values, count: int) -> list[Courses]:
        """Courses of some mechanisms, each with the places where it switches looked for over its cycle."""
        run, (start, end) = self.run, self.span
        lengths = np.ravel(primal(moved(run, values, np.array([run.cycle.duration])))) / run.cycle.duration
        ratio = np.broadcast_to(lengths, count)
        cycles = [replace(run.cycle, duration=run.cycle.duration * float(one)) for one in ratio]
        switching = (
            bends(Mechanisms(run.system, run.chosen.assembly, values, cycles))
            if self.bends or not all(one.of_motion for one in self.measures)
            else [np.zeros(0)] * count
        )
        more = (
            np.array([bend.time for bend in self.bends])
            if any(self.against(one) for one in self.measures)
            else np.zeros(0)
        )
        breaks = [
            breaks_between(run.cycle, np.concatenate([own / one, more]), start, end)
            for own, one in zip(switching, ratio, strict=True)
        ]

        def solve(lanes: Lanes, time: Array) -> tuple[Array, NDArray[np.integer]]:
            curves, status, _ = self._evaluated(self.kernel, _picked(values, lanes), time)
            shape, nominal = time.shape, self._nominal_at(time)
            every, parts = np.arange(len(lanes)), []
            for one in self.measures:
                own = [_shaped(part, shape) for part in curves[one.name]]
                parts.append(self._rows(one, own, nominal, time, every))
            numbers = np.concatenate(parts)
            endless = np.any(np.isinf(numbers), axis=0)
            numbers[np.isinf(numbers)] = np.nan
            return numbers, np.where(endless, ENDLESS, 0) + 0 * np.broadcast_to(status.reshape(-1, shape[1]), shape)

        rows = {one.name: slice(k, k + len(self._row_counts[one.name])) for k, one in enumerate(self.measures)}
        scales = alike(run, self.measures, rows)
        accuracy = MARGINS if self.measures[0].wants_margin else MOTION if self.of_motion else OWN
        return Courses.many(solve, breaks, lambda sizes: np.maximum(sizes, scales), accuracy_of(run.cycle, accuracy))


def _differing(reads: dict[str, Read], below: dict[str, Read], above: dict[str, Read], step: Array) -> dict[str, Read]:
    """What is read with derivatives by differences."""
    found = {}
    for name, read in reads.items():
        numbers = []
        for middle, low, high in zip(read[:3], below[name][:3], above[name][:3], strict=True):
            change = np.divide(high - low, 2 * step, out=np.zeros_like(step), where=step > 0)
            numbers.append(Dual(middle, change))
        found[name] = Read(numbers[0], numbers[1], numbers[2], read.status, read.shown)
    return found


def _pieced(parts: Sequence[Sequence[Number]], counts: Sequence[int], width: int) -> tuple[Number, ...]:
    """The parts of a course, (lane, time), of pieces one after another."""
    if len(parts) == 1:
        return tuple(parts[0])

    def wide(part: Number, count: int) -> Number:
        return linear(part, lambda array: np.broadcast_to(array, (count, width)))

    return tuple(
        _joined(*(wide(part, count) for part, count in zip(each, counts, strict=True)), axis=0)
        for each in zip(*parts, strict=True)
    )


def lanes_of(values: Values) -> int:
    """How many mechanisms values are of."""
    shape = shape_of(values, np.zeros(1))
    return shape[0] if len(shape) == 2 else 1


def _middle(edges: Number, panels: NDArray[np.bool_]) -> Number:
    """Middles of some panels."""
    return linear(edges, lambda array: (array[:, 1:] + array[:, :-1])[:, panels] / 2)


# ---- lanes ----------------------------------------------------------------------------------------------------


def step_of(run: Run, values: Values, count: int) -> Array:
    """By how much each mechanism is moved along its derivatives for a difference, (lane, 1); 0 of one without any."""
    size = float(np.ravel(primal(run.system.size(run.values)))[0])
    step = np.zeros((count, 1))
    for value in values.values():
        if not isinstance(value, Dual):
            continue
        slope = np.abs(np.broadcast_to(derivative(value), (count, 1)))
        whole = np.abs(np.broadcast_to(primal(value), (count, 1)))
        with np.errstate(all="ignore"):
            own = np.where(whole > 1e-9 * size, STEP * whole / slope, STEP_OF_NONE * size / slope)
        step = np.where((slope > 0) & ((own < step) | (step == 0)), own, step)
    return step


def _picked(values: Values, lanes: Lanes) -> dict[str, Number]:
    """The numbers of some mechanisms."""
    return {
        path: value[lanes] if np.ndim(primal(value)) == 2 and len(primal(value)) > 1 else value
        for path, value in values.items()
    }


def _taken(number: Number, lanes: Lanes) -> Number:
    """Some lanes of a number, which may be one for all."""
    return linear(number, lambda array: array if len(array) == 1 else array[lanes])


def _shaped(number: Number, shape: tuple[int, ...]) -> Number:
    """A number that a kernel gave, (lane, panel, node)."""
    flat = (shape[0], int(np.prod(shape[1:])))

    def of(array: Array) -> Array:
        array = np.asarray(array, float)
        return array.reshape(shape) if array.size == flat[0] * flat[1] else np.broadcast_to(array, flat).reshape(shape)

    return linear(number, of)


def _wide(number: Number) -> Number:
    return linear(number, lambda array: array[..., None])


def _sorted(number: Number) -> Number:
    """Rising along the last axis."""
    order = np.argsort(primal(number), axis=-1, kind="stable")
    return linear(number, lambda array: np.take_along_axis(np.broadcast_to(array, order.shape), order, axis=-1))


def _joined(*parts: Number, axis: int = 1) -> Number:
    """Numbers one after another."""
    if any(isinstance(part, Dual) for part in parts):
        reals = [np.asarray(primal(part)) for part in parts]
        duals = [np.broadcast_to(derivative(part), real.shape) for part, real in zip(parts, reals, strict=True)]
        return Dual(np.concatenate(reals, axis), np.concatenate(duals, axis))
    return np.concatenate(parts, axis)


def _clipped(number: Number, low: float | Array, high: float | Array) -> Number:
    """A number held between two others, where it has no derivative."""
    inside = (primal(number) > low) & (primal(number) < high)
    if isinstance(number, Dual):
        return Dual(np.clip(number.real, low, high), np.where(inside, number.dual, 0.0))
    return np.clip(number, low, high)


def _whole(parts: Sequence[Read]) -> Read:
    """Of all lanes one after another."""
    figure, least, most, shown = (_joined(*(part[k] for part in parts), axis=0) for k in (0, 1, 2, 4))
    return Read(figure, least, most, np.concatenate([part.status for part in parts]), shown)


def _put(read: Read, lanes: Lanes, own: Read) -> Read:
    """What is read of all lanes, with others in place of some."""

    def replaced(whole: Number, part: Number) -> Number:
        if isinstance(whole, Dual):
            dual = np.broadcast_to(derivative(part), np.shape(primal(part)))
            return Dual(replaced(whole.real, primal(part)), replaced(whole.dual, dual))
        changed = np.array(whole)
        if np.shape(whole)[1:] == np.shape(part)[1:]:  # there may be nothing to show
            changed[lanes] = part
        return changed

    numbers = [replaced(read[k], own[k]) for k in (0, 1, 2, 4)]
    status = np.array(read.status)
    status[lanes] = own.status
    return Read(numbers[0], numbers[1], numbers[2], status, numbers[3])
