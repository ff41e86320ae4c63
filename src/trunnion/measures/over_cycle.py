"""The figures of measures of one mechanism over its cycle: read of their `Courses`, whatever positions a table has."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Accuracy, Courses, Place
from trunnion.algebra.dual import primal
from trunnion.algebra.quadrature import CANCELLED
from trunnion.errors import Status
from trunnion.measures.evaluation import courses_of
from trunnion.measures.figures import SHORTEST, follow, reference
from trunnion.measures.measures import Measure
from trunnion.measures.positions import ends_of, gain_of, path_of, plan
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run
from trunnion.solve.switches import MARGINS, SEATED, accuracy_of, breaks_between

__all__ = ["figures_of"]

Array = NDArray[np.float64]
SCANNED = 24  # positions at which it is looked how large forces are
TURNED = 360  # of a turn, between which no angle turns by half a turn
ENDLESS = 32  # beside the status of places where a number is infinite
SIGNS = {"maximum": 1.0, "minimum": -1.0, "place-of-maximum": 1.0, "place-of-minimum": -1.0, "dead centre": 1.0,
         "dead centre, least": -1.0}  # fmt: skip


def figures_of(
    run: Run, measures: Sequence[Measure], method: FrictionMethod, gaps: Array | None = None
) -> dict[str, float]:
    """The figures of measures of one mechanism, SI, by name; NaN where a place that one needs has no answer.

    gaps: times, s, from and to, (2, gap), which extremes leave out.
    Raises MechanismError for places and windows that are not in the cycle.
    """
    gaps = np.zeros((2, 0)) if gaps is None else gaps
    places = plan(run, measures, 1)
    found: dict[str, float] = {}
    groups: dict[tuple[tuple[float, ...], bool], list[Measure]] = {}
    for measure in measures:
        if run.cycle.duration <= 0 or measure.rule == "value":
            found[measure.name] = _at_one_place(run, measure, places.windows[measure.name].time, method)
        else:
            groups.setdefault((ends_of(run, measure), measure.wants_margin), []).append(measure)
    for (ends, _), together in groups.items():
        with np.errstate(all="ignore"):
            courses, rows = _courses(run, together, ends, method, gaps)
            for measure in together:
                found[measure.name] = _Over(run, measure, courses, rows[measure.name], ends).figure()
    return {measure.name: found[measure.name] for measure in measures}


def _at_one_place(run: Run, measure: Measure, time: Array, method: FrictionMethod) -> float:
    within = time % run.cycle.duration if run.cycle.periodic and run.cycle.duration > 0 else time
    window = plan(run, [measure], 1).windows[measure.name]
    return reference(measure, courses_of(run, [measure], within, method)[0][measure.name], window, run.system).figure


def _courses(
    run: Run, measures: Sequence[Measure], ends: tuple[float, ...], method: FrictionMethod, gaps: Array
) -> tuple[Courses, dict[str, slice]]:
    """The courses of some measures over the cycle or a window, and the rows of each."""
    duration, rows = run.cycle.duration, {}
    start, end = ends or (0.0, duration)
    parts = courses_of(run, measures, np.array([start % duration if run.cycle.periodic else start]), method)[0]
    first = 0
    for measure in measures:
        rows[measure.name] = slice(first, first + len(parts[measure.name]))
        first += len(parts[measure.name])
    angles = {measure.name: _followed(run, measure, start, end) for measure in measures if measure.turning(run.system)}

    def look(time: Array) -> tuple[Array, NDArray[np.integer]]:
        within = time % duration if run.cycle.periodic else time
        found, status = courses_of(run, measures, within, method)
        numbers = np.empty((first, len(time)))
        for measure in measures:
            for k, part in zip(range(first)[rows[measure.name]], found[measure.name], strict=True):
                numbers[k] = np.asarray(primal(part), float).reshape(-1)
            if measure.name in angles:
                k, (grid, angle) = rows[measure.name].start, angles[measure.name]
                numbers[k] += 2 * np.pi * np.rint((np.interp(time, grid, angle) - numbers[k]) / (2 * np.pi))
        endless = np.any(np.isinf(numbers), axis=0)
        numbers[np.isinf(numbers)] = np.nan
        lost = np.any((gaps[0] < within[:, None]) & (within[:, None] < gaps[1]), axis=1)
        states = np.where(lost, np.maximum(status.ravel(), Status.CONTACT_LOST), status.ravel())
        return numbers, states + np.where(endless, ENDLESS, 0)

    accuracy = MARGINS if measures[0].wants_margin else SEATED if run.seats else Accuracy()
    scales = np.concatenate([[_scale(run, measure)] * len(parts[measure.name]) for measure in measures])
    bends = np.concatenate([[bend.time for bend in run.bends], gaps.ravel()])
    breaks = breaks_between(run.cycle, bends, start, end)
    return Courses.of(look, breaks, lambda sizes: np.maximum(sizes, scales), accuracy_of(run.cycle, accuracy)), rows


def _followed(run: Run, measure: Measure, start: float, end: float) -> tuple[Array, Array]:
    """An angle without jumps at many times, s, so that others are told by how many turns they are off."""
    time = np.linspace(start, end, 1 + int(np.ceil(TURNED * max(1.0, run.cycle.turns))))
    walk = run.walk(time % run.cycle.duration if run.cycle.periodic else time)
    angle, rate = (
        np.array(np.broadcast_to(np.asarray(primal(number), float), time.shape))
        for number in (measure.curve(walk)[0], measure.coordinate(run.system).rate(walk))
    )
    follow(angle, rate, time)
    return time, angle


def _scale(run: Run, measure: Measure) -> float:
    """What numbers of the kind of a measure are like: what is far below it is rounding."""
    system = run.system
    length, pace = (float(np.ravel(primal(number))[0]) for number in (system.size(run.values), system.pace(run.values)))
    force = run.once("largest force", lambda: _force(run)) if measure.of.of_forces else 0.0
    units = {
        **{"N": force, "N m": force * length, "W": force * length * pace, "J": force * length, "m": length},
        **{"rad": 1.0, "m/s": length * pace, "rad/s": pace, "m/s^2": length * pace**2, "rad/s^2": pace**2},
    }
    return units.get(measure.unit(system), 0.0)


def _force(run: Run) -> float:
    """The largest component of a reaction force, N."""
    time, count = run.cycle.times(SCANNED), run.system.mechanism.coordinates
    back = run.solve(time)
    parts = (part for load in back.reactions.values() for part in (load.u if hasattr(load, "u") else load)[:count])
    return max((float(np.nanmax(np.abs(primal(part)), initial=0.0)) for part in parts), default=0.0)


@dataclass(frozen=True)
class _Over:
    """A measure over the cycle, or between two times of it, ends, s; rows: its parts among those of the courses."""

    run: Run
    measure: Measure
    courses: Courses
    rows: slice
    ends: tuple[float, ...]

    def figure(self) -> float:
        """NaN where a part of the cycle has no answer."""
        rule, endless = self.measure.rule, self.courses.states >= ENDLESS
        gone = np.any(np.isnan(self.courses.coefficients[:, self.rows]), axis=(1, 2))
        if np.any(gone & ~endless):
            return float("nan")
        if self.measure.of.against or self.measure.of_attitude(self.run.system) or rule == "deviation":
            return 0.0
        if np.any(endless) and (rule != "minimum" or np.all(endless)):
            return float("inf")
        if rule == "line":
            return self._straightness()
        if rule in ("ratio", "work", "mean", "rms"):
            return self._mean(rule)
        if rule == "dwell":
            low, high = self.measure.within or (-np.inf, np.inf)
            return self.courses.within(self.rows.start, low, high)
        if rule == "peak-to-peak":
            return self._extreme(1.0).value - self._extreme(-1.0).value
        if rule == "largest":
            return max(abs(self._extreme(sign).value) for sign in (1.0, -1.0))
        if rule == "time ratio":
            return self._time_ratio()
        place = self._extreme(SIGNS[rule])
        if rule in ("maximum", "minimum"):
            return place.value
        return self._dead_centre(place) if rule.startswith("dead") else self._coordinate(place.time)

    def _extreme(self, sign: float) -> Place:
        kept = self.courses.states % ENDLESS != Status.CONTACT_LOST
        found = self.courses.extreme(lambda rows: rows[self.rows.start], sign, kept)
        return Place(float("nan"), float("nan")) if found is None else found

    def _mean(self, rule: str) -> float:
        means = self.courses.mean()[self.rows]
        if rule == "mean":
            return float(means[0])
        if rule == "rms":
            return float(np.sqrt(self.courses.mean(lambda rows: rows[self.rows.start] ** 2)))
        if rule == "work":
            return float(means[0] * means[1] * self.courses.span / self.run.cycle.duration)
        error = np.maximum(self.courses.error()[self.rows], CANCELLED * self.courses.mean(np.abs)[self.rows])
        useful, driven = np.where(np.abs(means) <= error, 0.0, means)
        return float(useful / driven) if driven > 0 else float("nan")

    def _coordinate(self, time: float) -> float:
        """The coordinate of the first driver at a time, s, that may be beyond the cycle."""
        duration = self.run.cycle.duration
        if not self.run.cycle.periodic or not np.isfinite(time):
            return float(path_of(self.run, np.array([time]))[0]) if np.isfinite(time) else float("nan")
        laps = np.floor(time / duration + 1e-12) if self.ends else 0.0
        within = max(0.0, time - laps * duration) if self.ends else time % duration
        return float(path_of(self.run, np.array([within]))[0] + laps * gain_of(self.run))

    def _dead_centre(self, place: Place) -> float:
        """The coordinate of an extreme; NaN at an end of the range, where the motion does not turn back."""
        last, first = self.courses.ends(self.rows.start)
        turned = self.measure.turning(self.run.system) and abs(last[-1] - first[0]) > np.pi
        around = self.run.cycle.periodic and not self.ends and not turned
        edges = self.courses.edges
        at_end = min(abs(place.time - edges[0]), abs(place.time - edges[-1])) <= 1e-9 * self.courses.span
        return float("nan") if at_end and not around else self._coordinate(place.time)

    def _time_ratio(self) -> float:
        """The longer of the two ways between the places of its largest and its least value over the shorter."""
        ways = [self._dead_centre(self._extreme(sign)) for sign in (1.0, -1.0)]
        gain = gain_of(self.run)
        if not self.run.cycle.periodic or self.ends or not gain:
            return float("nan")
        share = (ways[0] - ways[1]) / gain % 1.0
        longer = max(share, 1.0 - share)
        return longer / (1.0 - longer) if longer < 1 - SHORTEST else float("nan")

    def _straightness(self) -> float:
        """Width of a path about its least-squares line; in space the diameter of the cylinder that holds it."""
        middle = self.courses.mean()[self.rows]

        def offset(rows: Array) -> Array:
            own = rows[self.rows]
            return np.asarray(own - middle.reshape(-1, *[1] * (own.ndim - 1)))

        moments = self.courses.mean(lambda rows: np.einsum("a...,b...->ab...", offset(rows), offset(rows)))
        along = np.linalg.eigh(moments).eigenvectors[:, -1]
        if len(middle) == 2:
            both = [
                self.courses.extreme(lambda rows: np.tensordot([-along[1], along[0]], offset(rows), 1), sign)
                for sign in (1.0, -1.0)
            ]
            return 0.0 if both[0] is None or both[1] is None else both[0].value - both[1].value

        def away(rows: Array) -> Array:
            own = offset(rows)
            rest = own - along.reshape(-1, *[1] * (own.ndim - 1)) * np.tensordot(along, own, 1)
            return np.asarray(np.sqrt(np.sum(rest**2, axis=0)))

        farthest = self.courses.extreme(away)
        return 0.0 if farthest is None else 2.0 * farthest.value
