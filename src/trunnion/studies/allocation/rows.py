"""The rows of an allocation from first order of a mechanism: every position of every measure with limits.

A figure that is a deviation from the nominal mechanism has a row at each position, any other figure one row. What moves
a row is linear in the half widths, and so is what a play does in its radius, with a few exceptions: which way a point
is off most, which two positions a peak-to-peak deviation lies between, a distribution whose shape changes with its
limits. These are taken as they are with the tolerances of the study, and again with those that are found, see
`allocate`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import compress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.scales import scales_of
from trunnion.model.tolerances import Tolerance
from trunnion.statistics.population import Marginal
from trunnion.studies.allocation.problem import Criterion, RowEffects
from trunnion.studies.tolerance.first_order import ToleranceStudy
from trunnion.studies.tolerance.linear import Of, against, by_position, limits

__all__ = ["Rows", "rows_of"]

Array = NDArray[np.float64]
ANY = 1e-6  # half width, SI, at which the shape of a distribution is taken where there is none yet
NUMBERS = ("worst", "lower", "upper", "half", "deviation", "mean", "offset")  # of effects, by row
TEXTS = ("labels", "places", "units")


@dataclass(frozen=True)
class Rows:
    """Effects with what their rows are: measure and position by number, −1 where a figure is of no one position.

    moving: rows whose effects depend on the tolerances themselves; unknown: measures of which first order has no row.
    """

    effects: RowEffects
    measure: NDArray[np.intp]
    position: NDArray[np.intp]
    moving: NDArray[np.bool_]
    unknown: tuple[str, ...] = ()

    def with_moving(self, other: Rows) -> Rows:
        """These rows, and those of others that move."""
        first, more, which = self.effects, other.effects, other.moving
        columns: dict[str, Any] = {
            key: np.concatenate([getattr(first, key), getattr(more, key)[which]]) for key in NUMBERS
        }
        columns |= {key: getattr(first, key) + tuple(compress(getattr(more, key), which)) for key in TEXTS}
        measure, position, moving = (
            np.concatenate([getattr(self, key), getattr(other, key)[which]])
            for key in ("measure", "position", "moving")
        )
        return Rows(replace(first, **columns), measure, position, moving, self.unknown)


def rows_of(
    study: ToleranceStudy, bought: Mapping[str, float], criterion: Criterion, tight: Mapping[str, float]
) -> Rows:
    """The rows of a study. bought: half widths as they are in it, of what is to be chosen, by path.

    Effects of these are per unit of half width, of all others those of the whole tolerance (their half width being 1).
    tight: what the limits of a measure are multiplied by.
    """
    names, system, values = study.inputs.names, study.run.system, study.run.values
    slopes, spreads, ends = [np.zeros((len(names), 0))], [np.zeros((5, len(names), 0))], [np.zeros((2, 0))]
    measure, position, moving, unknown = list[int](), list[int](), list[bool](), list[str]()
    for k, of in enumerate(study.linear.measures):
        if not np.any(np.isfinite(limits(of))):
            continue
        first, index, moves = (of.course, of.reference.window.index, of.measure.kind == "path_error")
        if not _everywhere(of):
            first, moves = of.figure, by_position(of.reference)
            index = np.array([index[of.place] if of.place >= 0 else -1])
        spread = np.array(first.spread).reshape(5, len(names), -1)
        finite = np.all(np.isfinite(spread[1]), axis=0)
        count = int(np.sum(finite))
        if not count:
            unknown.append(of.measure.name)
        floor = scales_of(study.run).floor(of.measure.figure_unit(system, values))
        size = np.abs(spread[2])
        still = (size > 0) & (size <= floor)  # a slope of rounding would bound a tolerance at kilometres
        slopes.append(np.where(still, 0.0, first.sensitivity.reshape(len(names), -1))[:, finite])
        spreads.append(np.where(still, 0.0, spread)[..., finite])
        ends.append(np.repeat(tight.get(of.measure.name, 1.0) * np.array([limits(of)]).T, count, axis=1))
        measure, position, moving = measure + count * [k], position + index[finite].tolist(), moving + count * [moves]

    effects = _effects(study, bought, criterion, np.concatenate(slopes, axis=1), np.concatenate(spreads, axis=2))
    lower, upper = np.concatenate(ends, axis=1)
    dial, several = system.dial(values, study.plan.times), len(study.plan.times) > 1 and study.run.cycle.duration > 0
    measures = [study.linear.measures[k].measure for k in measure]
    effects = replace(
        effects,
        lower=lower,
        upper=upper,
        correlation=_correlation(study) if criterion == "yield" and study.effects.correlated else None,
        labels=tuple(f"measures.{each.name}" for each in measures),
        places=tuple(f" at {dial.at(place)}" if several and place >= 0 else "" for place in position),
        units=tuple(each.figure_unit(system, values) for each in measures),
    )
    return Rows(effects, np.array(measure, int), np.array(position, int), np.array(moving, bool), tuple(unknown))


def _everywhere(of: Of) -> bool:
    """Whether a measure has a row at every position."""
    rule, path_error = of.measure.rule, of.measure.kind == "path_error"
    # without a derivative, but no further off than the worst position: kept where every position keeps it
    root = (against(of) and rule == "rms") or (path_error and rule in ("mean", "minimum", "peak-to-peak"))
    return root or (by_position(of.reference) and of.place >= 0)


def _effects(
    study: ToleranceStudy, bought: Mapping[str, float], criterion: Criterion, slopes: Array, spreads: Array
) -> RowEffects:
    """Effects (row, contribution) without their limits, from what is (parameter, row)."""
    lower, upper, half, shift, deviation = spreads
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
