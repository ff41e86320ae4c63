"""The rows of an allocation from first order of a mechanism: every place of every measure with limits.

A figure that is a deviation from the nominal mechanism has a row at many places of its course, which the panels of the
course choose and no table, and at the worst place between them; any other figure has one row. What moves a row is
linear in the half widths, and so is what a play does in its radius, with a few exceptions: where a course is worst,
which way a point is off most, which two places a peak-to-peak deviation lies between, a distribution whose shape
changes with its limits. These are taken as they are with the tolerances of the study, and again with those that are
found, see `allocate`.
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
from trunnion.statistics.distributions import Marginal
from trunnion.studies.allocation.problem import AllocationProblem, Criterion, RowEffects
from trunnion.studies.tolerance.effects import FirstOrder
from trunnion.studies.tolerance.linear import MeasureOrder, Table, ToleranceStudy, sound

Array = NDArray[np.float64]
ANY = 1e-6  # half width, SI, at which the shape of a distribution is taken where there is none yet
NUMBERS = ("linear", "spread", "drift", "lower", "upper", "offset")  # of effects, by row
TEXTS = ("labels", "units")


@dataclass(frozen=True)
class Rows:
    """Effects with what their rows are: the measure of each by number.

    moving: rows whose effects depend on the tolerances themselves; ends: least and largest deviation that each measure
    may have, (measure, end); unknown: measures of which first order has no row.
    """

    effects: RowEffects
    measure: NDArray[np.intp]
    moving: NDArray[np.bool_]
    ends: Array
    unknown: tuple[str, ...] = ()

    def picked(self, which: NDArray[np.bool_]) -> Rows:
        """Some of the rows."""
        columns: dict[str, Any] = {key: getattr(self.effects, key)[which] for key in NUMBERS}
        columns |= {key: tuple(compress(getattr(self.effects, key), which)) for key in TEXTS}
        effects = replace(self.effects, **columns)
        return replace(self, effects=effects, measure=self.measure[which], moving=self.moving[which])


def joined(parts: Sequence[Rows]) -> Rows:
    """All rows of several."""
    effects = [part.effects for part in parts]
    columns: dict[str, Any] = {key: np.concatenate([getattr(each, key) for each in effects]) for key in NUMBERS}
    columns |= {key: tuple(chain(*(getattr(each, key) for each in effects))) for key in TEXTS}
    measure, moving = (np.concatenate([getattr(part, key) for part in parts]) for key in ("measure", "moving"))
    return replace(parts[0], effects=replace(effects[0], **columns), measure=measure, moving=moving)


def rows_of(
    study: ToleranceStudy, bought: Mapping[str, float], criterion: Criterion, tight: Mapping[str, float]
) -> Rows:
    """The rows of a study. bought: half widths as they are in it, of what is to be chosen, by path.

    Effects of these are per unit of half width, of all others those of the whole tolerance (their half width being 1).
    tight: what the limits of a measure are multiplied by.
    """
    orders, system, values = study.orders, study.run.system, study.run.values
    ends = np.array([tight.get(order.measure.name, 1.0) * np.array(order.limits) for order in orders])
    halves = np.array([bought.get(name, 1.0) for name in study.inputs.names])
    of_worst = criterion == "worst-case"
    parts: list[Rows] = []

    def add(k: int, first: FirstOrder, moves: bool) -> None:
        effects = _effects(study, bought, criterion, k, first, ends[k])
        count = len(effects.offset)
        effects = replace(
            effects,
            labels=(f"measures.{orders[k].measure.name}",) * count,
            units=(orders[k].measure.figure_unit(system, values),) * count,
        )
        finite = np.any(np.isfinite(ends[k])) & np.all(np.isfinite(effects.linear + effects.spread), axis=1)
        parts.append(Rows(effects, np.full(count, k), np.full(count, moves), ends).picked(finite))

    for k, order in enumerate(orders):
        if not _everywhere(order):
            first = order.worst if of_worst and order.by_place else order.figure
            add(k, first, order.by_place)
            continue
        _, course, status = study.scanned(order.measure, of_worst)
        add(k, FirstOrder(study.effects, course.slope[:, sound(status)]), order.measure.kind == "path_error")

        def used(first: FirstOrder, k: int = k) -> Array:
            effects = _effects(study, bought, criterion, k, first, ends[k])
            return AllocationProblem((), effects).used(halves)

        worst = study.worst_place(order.measure, used, of_worst)
        add(k, worst.worst if of_worst else worst.scatter, True)
    rows = joined(parts)
    limited = [k for k in range(len(orders)) if np.any(np.isfinite(ends[k]))]
    unknown = tuple(orders[k].measure.name for k in limited if k not in rows.measure)
    correlation = None
    if criterion == "yield" and study.effects.correlated:  # of all that varies, by their covariance
        covariance = study.inputs.population.covariance()
        size, count = np.sqrt(np.outer(np.diag(covariance), np.diag(covariance))), len(covariance)
        correlation = np.eye(len(study.inputs.names))
        correlation[:count, :count] = np.divide(covariance, size, out=np.zeros_like(covariance), where=size > 0)
        np.fill_diagonal(correlation, 1.0)
    return replace(rows, effects=replace(rows.effects, correlation=correlation), unknown=unknown)


def used_curve(
    study: ToleranceStudy, table: Table, rows: Rows, criterion: Criterion, problem: AllocationProblem, t: Array, k: int
) -> Array:
    """Share of its limits that a measure uses at each position of a table, by the criterion; NaN outside its window."""
    order, window = study.orders[k], table.plan.windows[study.measures[k].name]
    used = np.full(len(table.plan.times), np.nan)
    if (_everywhere(order) or order.placed) and k in rows.measure:
        bought = {item.name: half for item, half in zip(problem.contributions, t, strict=True) if not item.fixed}
        course = (table.worst if criterion == "worst-case" else table.courses)[k]
        effects = _effects(study, bought, criterion, k, course, rows.ends[k])
        margin = float(problem.margins()[rows.measure == k][0])
        effects = replace(effects, correlation=problem.effects.correlation)
        used[window.index] = replace(problem, effects=effects, z=margin, caps=None).used(t)
    return used


def _everywhere(order: MeasureOrder) -> bool:
    """Whether a measure has rows all over its course."""
    rule, path_error = order.measure.rule, order.measure.kind == "path_error"
    # without a derivative, but no further off than the worst place: kept where every place keeps it
    root = (order.is_deviation and rule == "rms") or (path_error and rule in ("mean", "minimum", "peak-to-peak"))
    return root or (order.by_place and order.placed)


def _effects(
    study: ToleranceStudy, bought: Mapping[str, float], criterion: Criterion, k: int, first: FirstOrder, ends: Array
) -> RowEffects:
    """Effects (row, contribution) on a measure, with its limits."""
    unit, count = study.orders[k].measure.figure_unit(study.run.system, study.run.values), len(study.inputs.names)
    spread = np.array(first.spread).reshape(5, count, -1)
    # a slope of rounding would bound a tolerance at kilometres
    still = (spread[2] > 0) & (spread[2] <= scales_of(study.run).floor(unit))
    slopes = np.where(still, 0.0, first.sensitivity.reshape(count, -1))
    lower, worst, half, shift, deviation = np.where(still, 0.0, spread)
    offset, mean = np.zeros(slopes.shape[1]), np.zeros_like(slopes)
    for i, name in enumerate(study.inputs.names):
        if study.effects.is_zone(i):
            size = bought.get(name, 1.0)
            offset += shift[i]  # of what turns about another place than its nominal one, and is not bought
            worst[i] = 0.5 * (worst[i] - lower[i]) / size
            half[i], deviation[i] = half[i] / size, deviation[i] / size
            continue
        tolerance = study.inputs.tolerances[i]
        scatter, rate, constant = _rates(tolerance)
        size = 1.0 if name in bought else tolerance.half_width
        offset += slopes[i] * ((tolerance.lower + tolerance.upper) / 2 + (constant if criterion == "yield" else 0.0))
        worst[i], half[i] = np.abs(slopes[i]) * size, slopes[i] * size
        deviation[i], mean[i] = slopes[i] * scatter * size, slopes[i] * rate * size
    nothing, (least, most) = np.zeros_like(mean), np.repeat(ends[:, None], len(offset), axis=1)
    linear, spread, drift = {
        "worst-case": (worst, nothing, nothing),
        "rss": (nothing, half, nothing),
        "yield": (nothing, deviation, mean),
    }[criterion]
    return RowEffects(linear.T, spread.T, drift.T, least, most, offset)


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
