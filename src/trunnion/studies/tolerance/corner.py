"""The mechanism at the worst corner of its tolerances and plays for a measure, as the search of the study finds it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, MechanismError
from trunnion.model.measure_units import dimension_kinds
from trunnion.model.mechanism import Mechanism
from trunnion.studies.tolerance.effects import NOBODY, EffectRow
from trunnion.studies.tolerance.linear import MeasureOrder, ToleranceStudy, study

__all__ = ["WorstCorner", "worst_corner"]

SIDES = ("least", "largest")
ROUNDS, AROUND = 4, 17  # in which the place is looked for, and places about it in each


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
    numbers = {path: float(np.ravel(primal(number))[0]) for path, number in values_there.items()}
    dimensions = {f"dimensions.{dimension}": kind for dimension, kind in dimension_kinds(mechanism).items()}
    kinds = {**mechanism.parameter_kinds(), **dimensions}
    rows = []
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
