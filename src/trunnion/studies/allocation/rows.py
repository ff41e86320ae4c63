"""The rows of an allocation from first order of a mechanism: every position of every measure with limits.

A figure that is a deviation from the nominal mechanism has a row at each position, and at the worst place between them,
any other figure one row. What moves a row is linear in the half widths, and so is what a play does in its radius, with
a few exceptions: where a course is worst, which way a point is off most, which two positions a peak-to-peak deviation
lies between, a distribution whose shape changes with its limits. These are taken as they are with the tolerances of the
study, and again with those that are found, see `allocate`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, compress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.scales import scales_of
from trunnion.model.tolerances import Tolerance
from trunnion.statistics.population import Marginal
from trunnion.studies.allocation.problem import AllocationProblem, Criterion, RowEffects
from trunnion.studies.tolerance.effects import FirstOrder
from trunnion.studies.tolerance.first_order import ToleranceStudy
from trunnion.studies.tolerance.linear import Of, against, by_position, limits, worst_place

__all__ = ["Rows", "rows_of"]

Array = NDArray[np.float64]
ANY = 1e-6  # half width, SI, at which the shape of a distribution is taken where there is none yet
NUMBERS = ("worst", "lower", "upper", "half", "deviation", "mean", "offset")  # of effects, by row
TEXTS = ("labels", "places", "units")


@dataclass(frozen=True)
class Rows:
    """Effects with what their rows are: measure and position by number, −1 where a figure is of no position of these.

    moving: rows whose effects depend on the tolerances themselves; unknown: measures of which first order has no row.
    """

    effects: RowEffects
    measure: NDArray[np.intp]
    position: NDArray[np.intp]
    moving: NDArray[np.bool_]
    unknown: tuple[str, ...] = ()

    def picked(self, which: NDArray[np.bool_]) -> Rows:
        """Some of the rows."""
        columns: dict[str, Any] = {key: getattr(self.effects, key)[which] for key in NUMBERS}
        columns |= {key: tuple(compress(getattr(self.effects, key), which)) for key in TEXTS}
        return Rows(replace(self.effects, **columns), self.measure[which], self.position[which], self.moving[which])

    def with_moving(self, other: Rows) -> Rows:
        """These rows, and those of others that move."""
        return replace(_joined([self, other.picked(other.moving)]), unknown=self.unknown)


def _joined(parts: Sequence[Rows]) -> Rows:
    """All rows of several."""
    effects = [part.effects for part in parts]
    columns: dict[str, Any] = {key: np.concatenate([getattr(each, key) for each in effects]) for key in NUMBERS}
    columns |= {key: tuple(chain(*(getattr(each, key) for each in effects))) for key in TEXTS}
    measure, position, moving = (
        np.concatenate([getattr(part, key) for part in parts]) for key in ("measure", "position", "moving")
    )
    return Rows(replace(effects[0], **columns), measure, position, moving)


def rows_of(
    study: ToleranceStudy, bought: Mapping[str, float], criterion: Criterion, tight: Mapping[str, float]
) -> Rows:
    """The rows of a study. bought: half widths as they are in it, of what is to be chosen, by path.

    Effects of these are per unit of half width, of all others those of the whole tolerance (their half width being 1).
    tight: what the limits of a measure are multiplied by.
    """
    measures = study.linear.measures
    ends = [tight.get(of.measure.name, 1.0) * np.array(limits(of)) for of in measures]
    rows = _joined([_of_measure(study, bought, criterion, k, ends[k]) for k in range(len(measures))])
    limited = [k for k in range(len(measures)) if np.any(np.isfinite(ends[k]))]
    unknown = tuple(measures[k].measure.name for k in limited if k not in rows.measure)
    correlation = _correlation(study) if criterion == "yield" and study.effects.correlated else None
    return replace(rows, effects=replace(rows.effects, correlation=correlation), unknown=unknown)


def _of_measure(study: ToleranceStudy, bought: Mapping[str, float], criterion: Criterion, k: int, ends: Array) -> Rows:
    """The rows of one measure, none if it has no limits. ends: of its deviation, (end,).

    A course has a row at every position, and one at the place between them where most of the room is taken: limits are
    kept over the whole cycle, whatever the steps.
    """
    of, system, values = study.linear.measures[k], study.run.system, study.run.values
    window, limited = of.reference.window, bool(np.any(np.isfinite(ends)))
    halves = np.array([bought.get(name, 1.0) for name in study.inputs.names])
    unit = of.measure.figure_unit(system, values)
    floor = scales_of(study.run).floor(unit)

    def effects_of(first: FirstOrder) -> RowEffects:
        effects = _effects(study, bought, criterion, first, floor)
        lower, upper = np.repeat(ends[:, None], len(effects.worst), axis=1)
        return replace(effects, lower=lower, upper=upper)

    def rows(first: FirstOrder, time: Array, position: NDArray[np.intp], moves: bool) -> Rows:
        count, several = len(time), len(study.plan.times) > 1 and study.run.cycle.duration > 0
        dial = system.dial(values, np.append(time, study.plan.times))
        effects = replace(
            effects_of(first),
            labels=(f"measures.{of.measure.name}",) * count,
            places=tuple(f" at {dial.at(i)}" if several and np.isfinite(time[i]) else "" for i in range(count)),
            units=(unit,) * count,
        )
        finite = limited & np.all(np.isfinite(effects.spread()), axis=1)
        return Rows(effects, np.full(count, k), position, np.full(count, moves)).picked(finite)

    if not _everywhere(of):
        time, position = (of.time, window.index[of.place]) if of.place >= 0 else (np.nan, -1)
        return rows(of.figure, np.array([time]), np.array([position]), by_position(of.reference))
    course = rows(of.course, window.time, window.index, of.measure.kind == "path_error")
    if not limited or len(window.time) == 1:
        return course

    def used(first: FirstOrder) -> Array:
        return AllocationProblem((), effects_of(first), criterion).used(halves)

    time, slope = worst_place(study.kernel, study.effects.values(), study.effects, of.reference, study.many, used)
    between = rows(FirstOrder(study.effects, slope), np.array([time]), np.array([-1]), True)
    return _joined([course, between])


def _everywhere(of: Of) -> bool:
    """Whether a measure has a row at every position."""
    rule, path_error = of.measure.rule, of.measure.kind == "path_error"
    # without a derivative, but no further off than the worst position: kept where every position keeps it
    root = (against(of) and rule == "rms") or (path_error and rule in ("mean", "minimum", "peak-to-peak"))
    return root or (by_position(of.reference) and of.place >= 0)


def _effects(
    study: ToleranceStudy, bought: Mapping[str, float], criterion: Criterion, first: FirstOrder, floor: float
) -> RowEffects:
    """Effects (row, contribution) without their limits. floor: what is rounding of the measure."""
    count = len(study.inputs.names)
    spread = np.array(first.spread).reshape(5, count, -1)
    still = (spread[2] > 0) & (spread[2] <= floor)  # a slope of rounding would bound a tolerance at kilometres
    slopes = np.where(still, 0.0, first.sensitivity.reshape(count, -1))
    lower, upper, half, shift, deviation = np.where(still, 0.0, spread)
    offset, mean = np.zeros(slopes.shape[1]), np.zeros_like(slopes)
    for i, name in enumerate(study.inputs.names):
        if study.effects.is_zone(i):
            size = bought.get(name, 1.0)
            offset += shift[i]  # of what turns about another place than its nominal one, and is not bought
            upper[i] = 0.5 * (upper[i] - lower[i]) / size
            half[i], deviation[i] = half[i] / size, deviation[i] / size
            continue
        tolerance = study.inputs.tolerances[i]
        scatter, drift, constant = _rates(tolerance)
        size = 1.0 if name in bought else tolerance.half_width
        offset += slopes[i] * (tolerance.lower + tolerance.upper) / 2
        if criterion == "yield":
            offset += slopes[i] * constant
        upper[i], half[i] = np.abs(slopes[i]) * size, slopes[i] * size
        deviation[i], mean[i] = slopes[i] * scatter * size, slopes[i] * drift * size
    nothing = np.zeros(0)
    return RowEffects(upper.T, nothing, nothing, half.T, deviation.T, mean.T, offset)


def _rates(tolerance: Tolerance) -> tuple[float, float, float]:
    """Standard deviation and drift of the mean from the middle of the limits per half width, and drift without any."""
    middle, half = (tolerance.lower + tolerance.upper) / 2, tolerance.half_width or ANY
    if "values" in tolerance.options:  # as measured: there is nothing to choose
        marginal = Marginal(tolerance.distribution, tolerance.lower, tolerance.upper, tolerance.options)
        return (marginal.deviation / half if tolerance.half_width else 0.0), 0.0, marginal.mean - middle
    wide, narrow = (
        Marginal(tolerance.distribution, middle - width, middle + width, tolerance.options)
        for width in (half, half / 2)
    )
    drift = (wide.mean - narrow.mean) / (half / 2)
    return wide.deviation / half, drift, wide.mean - middle - drift * half


def _correlation(study: ToleranceStudy) -> Array:
    """Correlation of all that varies, by their covariance."""
    covariance = study.inputs.population.covariance()
    size = np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    matrix, count = np.eye(len(study.inputs.names)), len(covariance)
    matrix[:count, :count] = np.divide(covariance, size, out=np.zeros_like(covariance), where=size > 0)
    np.fill_diagonal(matrix, 1.0)
    return matrix
