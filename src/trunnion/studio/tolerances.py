"""The worst corner of tolerances and plays for a measure, as `tolerance` finds it, with the mechanism there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, MechanismError
from trunnion.measures.measures import chosen, outputs
from trunnion.model.measure_kinds import dimension_kinds
from trunnion.model.mechanism import Mechanism
from trunnion.results.quantities import quantity
from trunnion.solve.run import Run, prepare
from trunnion.solve.shifts import play_of
from trunnion.views.cycle.scene import scene

if TYPE_CHECKING:
    from trunnion.studies.tolerance.first_order import ToleranceStudy
    from trunnion.studies.tolerance.linear import Of

__all__ = ["measured", "worst_corner"]

Array = NDArray[np.float64]

SIDES = ("least", "largest")
ROUNDS, AROUND = 4, 17  # in which the place is looked for, and places about it in each


def measured(run: Run) -> dict[str, list[str]]:
    """What the page offers: `worst`, measures that have a worst corner, none where nothing has a tolerance or a play;
    `unseated`, joints whose pins lie nowhere in their play.
    """
    system, mechanism = run.system, run.system.mechanism
    loose = [name for name, (kind, _) in system.joints.items()
             if play_of(mechanism.space, kind, run.values, name) is not None]  # fmt: skip
    varies = loose or mechanism.tolerated()
    measures = (chosen(mechanism, None, run.values) or outputs(system)) if varies else []
    unseated = [name for name in loose if name not in mechanism.seated]
    return {"worst": [measure.name for measure in measures], "unseated": unseated}


@np.errstate(all="ignore")
def worst_corner(mechanism: Mechanism, name: str, side: str | None, steps: int) -> dict[str, Any]:
    """Return the corner at which a measure is least or largest, or whichever of both is farther from nominal.

    Pins that loads would press to one side may lie anywhere in their holes, as in `tolerance --seat free`.

    Returns
    -------
    dict
        values: least and largest deviation, SI, as the search of `tolerance` has them, and their texts; side: the
        shown one, 0 or 1; index, at: position nearest to where it stands, and that in words, None of a figure of the
        whole cycle; rows: numbers that matter, [name, nominal, change]; scene: of the mechanism there, its errors
        being those against the nominal one.
    """
    from trunnion.studies.tolerance.effects import NOBODY, EffectRow  # not for the first picture
    from trunnion.studies.tolerance.first_order import study
    from trunnion.studies.tolerance.linear import searched

    if "loaded" in mechanism.seated.values():
        mechanism = mechanism.with_seats("free")
    prepared = study(mechanism, [name], steps)
    run, (of,), effects = prepared.run, prepared.linear.measures, prepared.effects
    ends = searched(prepared.many, prepared.linear, of)
    values = [corner.value for corner in ends]
    if not np.all(np.isfinite(values)):
        raise MechanismError(Finding("has no worst corner: the figure is undefined", f"measures.{name}"))
    shown = SIDES.index(side) if side in SIDES else int(abs(values[1]) >= abs(values[0]))
    corner = ends[shown]
    there = replace(effects, rows=(EffectRow(NOBODY, 0, {}, ""),)).values(corner.at)
    numbers = {path: float(np.ravel(primal(number))[0]) for path, number in there.items()}
    unit = of.measure.figure_unit(run.system, run.values)
    time, index = _place(prepared, of, there, 2 * shown - 1, run.cycle.times(steps))
    dimensions = {f"dimensions.{dimension}": kind for dimension, kind in dimension_kinds(mechanism).items()}
    kinds = {**mechanism.parameter_kinds(), **dimensions}
    rows = []
    for i, tolerance in enumerate(prepared.inputs.tolerances):
        if of.figure.spread.half[i] == 0:
            continue  # it does nothing to the measure
        kind, nominal = kinds.get(tolerance.path), effects.nominal(i)
        of_number = kind.unit if kind else "m"
        rows.append(
            [tolerance.path, quantity(nominal, of_number), signed(numbers[tolerance.path] - nominal, of_number)]
        )
    return {
        "values": values,
        "texts": [signed(value, unit) for value in values],
        "side": shown,
        "index": index,
        "at": None if index is None else run.system.dial(run.values, np.array([time])).at(0),
        "rows": rows,
        "scene": _scene(prepared, numbers, steps),
    }


def _place(prepared: ToleranceStudy, of: Of, there: Mapping[str, Number], sign: int, times: Array) -> Any:
    """Time, s, at which a figure stands at its corner, and the nearest position; None of one of the whole cycle."""
    time = of.time
    if of.measure.rule == "deviation" and len(of.reference.parts) == 1:
        at = of.reference.window.time
        for _ in range(ROUNDS):
            courses = (prepared.kernel.courses(numbers, at)[0] for numbers in (there, prepared.inputs.nominal))
            moved, nominal = (np.ravel(primal(course[of.measure.name][0])) for course in courses)
            change = np.broadcast_to(moved - nominal, at.shape)
            if of.reference.turning:
                change = change - 2 * np.pi * np.round(change / (2 * np.pi))
            top = int(np.nanargmax(sign * change))
            time, last = float(at[top]), len(at) - 1
            at = np.linspace(at[max(top - 1, 0)], at[min(top + 1, last)], AROUND if last else 1)
    return (time, int(np.argmin(np.abs(times - time)))) if np.isfinite(time) else (None, None)


def _scene(prepared: ToleranceStudy, numbers: Mapping[str, float], steps: int) -> dict[str, Any]:
    """The scene of a mechanism with other numbers, beside the nominal one and with its holes as wide as they are.

    Its places alone count: it is solved without friction, with which it might lock.
    """
    from trunnion.cycle.positions import positions
    from trunnion.cycle.summary import result_of

    inputs, bare = prepared.inputs, prepare(prepared.run.system.mechanism.with_friction("off"))
    run = replace(bare, values={**bare.values, **numbers})
    run.__dict__.update(ideal_values=inputs.nominal, erring=True, seats=[])  # its pins lie where the corner has them
    shown = scene(result_of(run, positions(run, steps, margin=False, averaged=False)).dataset, max_positions=steps)
    for joint in inputs.loose:
        play, links = inputs.play(joint, numbers), run.system.joints[joint][1]
        assert play is not None  # else it would not be loose
        guide = play.model.size is not None and play.model.size[0] == "guide"
        shown["built"]["seats"].append({
            "joint": joint, "kind": "guide" if guide else "pin", "clearance": float(np.ravel(primal(play.radii[0]))[0]),
            "length": float(np.ravel(primal(play.length))[0]) if guide else None, "links": list(links), "ends": [],
        })  # fmt: skip
    return shown


def signed(value: float, unit: str) -> str:
    """A change with its sign and unit."""
    return f"{'−' if value < 0 else '+'}{quantity(abs(float(value)), unit)}"
