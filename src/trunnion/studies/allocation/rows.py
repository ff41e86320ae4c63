"""The rows of an allocation from first order of a mechanism: every position of every measure with limits.

A figure that is a deviation from the nominal mechanism has a row at each position, any other figure one row. What moves
a row is linear in the half widths, and so is what a play does in its radius, with a few exceptions: which way a point
is off most, which two positions a peak-to-peak deviation lies between, a distribution whose shape changes with its
limits. These are taken as they are with the tolerances of the study, and again with those that are found, see
`allocate`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.model.tolerances import Tolerance
from trunnion.statistics.population import Marginal
from trunnion.studies.allocation.problem import Criterion, RowEffects
from trunnion.studies.tolerance.effects import Spread
from trunnion.studies.tolerance.first_order import ToleranceStudy
from trunnion.studies.tolerance.linear import Of, against, by_position, limits

__all__ = ["Rows", "joined", "part_of", "rows_of"]

Array = NDArray[np.float64]
Rates = tuple[float, float, float]
Texts = tuple[str, ...]
ANY = 1e-6  # half width, SI, at which the shape of a distribution is taken where there is none yet


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


@dataclass(frozen=True)
class _Block:
    """Rows of one measure: sensitivities and spread (parameter, row), limits and positions (row,)."""

    sensitivity: Array
    spread: Spread
    lower: float
    upper: float
    position: NDArray[np.intp]
    moving: bool


def _block(of: Of) -> _Block:
    measure = of.measure
    # without a derivative, but no further off than the worst position: kept where every position keeps it
    root = against(of) and measure.rule == "rms"
    root |= measure.kind == "path_error" and measure.rule in ("mean", "minimum", "peak-to-peak")
    lower, upper = limits(of)
    if (by_position(of.reference) and of.place >= 0) or root:
        index = np.asarray(of.reference.window.index, np.intp)
        moving = measure.kind == "path_error"
        return _Block(of.course.sensitivity, of.course.spread, lower, upper, index, moving)
    spread = Spread(*(np.asarray(part)[:, None] for part in of.figure.spread))
    place = of.reference.window.index[of.place] if of.place >= 0 else -1
    return _Block(of.figure.sensitivity[:, None], spread, lower, upper, np.array([place]), by_position(of.reference))


def rows_of(
    study: ToleranceStudy, bought: Mapping[str, float], criterion: Criterion, tight: Mapping[str, float] | None = None
) -> Rows:
    """The rows of a study. bought: half widths as they are in it, of what is to be chosen, by path.

    Effects of these are per unit of half width, of all others those of the whole tolerance (their half width being 1).
    tight: what the limits of a measure are multiplied by.
    """
    blocks, which, unknown = [], [], []
    for k, of in enumerate(study.linear.measures):
        if not np.any(np.isfinite(limits(of))):
            continue
        block = _block(of)
        finite = np.all(np.isfinite(block.spread.upper), axis=0)
        if not np.any(finite):
            unknown.append(of.measure.name)
            continue
        share = (tight or {}).get(of.measure.name, 1.0)
        blocks.append(replace(_taken(block, finite), lower=share * block.lower, upper=share * block.upper))
        which.append(k)
    none = np.zeros(0, np.intp)
    if not blocks:
        empty = RowEffects(np.zeros((0, len(study.inputs.names))), np.zeros(0), np.zeros(0))
        return Rows(empty, none, none, none.astype(bool), tuple(unknown))
    sizes = [len(block.position) for block in blocks]
    position = np.concatenate([block.position for block in blocks])
    measure = np.repeat(np.array(which, np.intp), sizes)
    labels, places, units = _texts(study, measure, position)
    effects = replace(
        _parts(study, bought, criterion, blocks),
        lower=np.repeat([block.lower for block in blocks], sizes),
        upper=np.repeat([block.upper for block in blocks], sizes),
        correlation=_correlation(study) if criterion == "yield" else None,
        labels=labels,
        places=places,
        units=units,
    )
    return Rows(effects, measure, position, np.repeat([block.moving for block in blocks], sizes), tuple(unknown))


def _taken(block: _Block, finite: NDArray[np.bool_]) -> _Block:
    """The rows that have an answer."""
    spread = Spread(*(part[:, finite] for part in block.spread))
    return replace(block, sensitivity=block.sensitivity[:, finite], spread=spread, position=block.position[finite])


def _parts(
    study: ToleranceStudy, bought: Mapping[str, float], criterion: Criterion, blocks: Sequence[_Block]
) -> RowEffects:
    """Effects (row, contribution) without their limits."""
    slopes = np.concatenate([block.sensitivity for block in blocks], axis=1)
    lower, upper, half, shift, deviation = (
        np.concatenate([getattr(block.spread, key) for block in blocks], axis=1)
        for key in ("lower", "upper", "half", "shift", "deviation")
    )
    offset, mean = np.zeros(slopes.shape[1]), np.zeros_like(slopes)
    for i, name in enumerate(study.inputs.names):
        tolerance = study.inputs.tolerances[i] if i < len(study.inputs.tolerances) else None
        if tolerance is None or tolerance.direction or tolerance.distribution == "direction":  # a zone
            size = bought.get(name, 1.0)
            offset += shift[i]  # of what turns about another place than its nominal one, and is not bought
            upper[i] = 0.5 * (upper[i] - lower[i]) / size
            half[i], deviation[i] = half[i] / size, deviation[i] / size
            continue
        scatter, drift, constant = _rates(tolerance)
        size = 1.0 if name in bought else tolerance.half_width
        offset += slopes[i] * (tolerance.lower + tolerance.upper) / 2
        if criterion == "yield":
            offset += slopes[i] * constant
        upper[i], half[i] = np.abs(slopes[i]) * size, slopes[i] * size
        deviation[i], mean[i] = slopes[i] * scatter * size, slopes[i] * drift * size
    nothing = np.zeros(0)
    return RowEffects(upper.T, nothing, nothing, half.T, deviation.T, mean.T, offset)


def _rates(tolerance: Tolerance) -> Rates:
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


def _correlation(study: ToleranceStudy) -> Array | None:
    """Correlation of all that varies, by their covariance; None if there is none."""
    covariance = study.inputs.population.covariance()
    deviations = np.sqrt(np.diag(covariance))
    if not np.any(covariance - np.diag(np.diag(covariance))):
        return None
    count = len(study.inputs.names)
    matrix = np.eye(count)
    size = np.outer(deviations, deviations)
    inner = np.divide(covariance, size, out=np.zeros_like(covariance), where=size > 0)
    np.fill_diagonal(inner, 1.0)
    matrix[: len(inner), : len(inner)] = inner
    return matrix


def _texts(study: ToleranceStudy, measure: NDArray[np.intp], position: NDArray[np.intp]) -> tuple[Texts, Texts, Texts]:
    """Names, places and units of rows."""
    system, values = study.run.system, study.run.values
    dial = system.dial(values, study.plan.times)
    several = len(study.plan.times) > 1 and study.run.cycle.duration > 0
    names = [f"measures.{of.measure.name}" for of in study.linear.measures]
    units = [of.measure.figure_unit(system, values) for of in study.linear.measures]
    places = tuple(f" at {dial.at(int(p))}" if several and p >= 0 else "" for p in position)
    return tuple(names[k] for k in measure), places, tuple(units[k] for k in measure)


NUMBERS = ("worst", "lower", "upper", "half", "deviation", "mean", "offset")  # of effects, by row
TEXTS = ("labels", "places", "units")


def joined(one: Rows, more: Rows) -> Rows:
    """The rows of both."""
    first, second = one.effects, more.effects
    numbers: dict[str, Any] = {key: np.concatenate([getattr(first, key), getattr(second, key)]) for key in NUMBERS}
    texts: dict[str, Any] = {key: getattr(first, key) + getattr(second, key) for key in TEXTS}
    return Rows(
        replace(first, **numbers, **texts),
        np.concatenate([one.measure, more.measure]),
        np.concatenate([one.position, more.position]),
        np.concatenate([one.moving, more.moving]),
        one.unknown,
    )


def part_of(rows: Rows, which: NDArray[np.bool_]) -> Rows:
    """Some of the rows."""
    of, places = rows.effects, np.flatnonzero(which).tolist()
    numbers: dict[str, Any] = {key: getattr(of, key)[which] for key in NUMBERS}
    texts: dict[str, Any] = {key: tuple(getattr(of, key)[k] for k in places) for key in TEXTS}
    return Rows(
        replace(of, **numbers, **texts), rows.measure[which], rows.position[which], rows.moving[which], rows.unknown
    )
