"""The measures of a model at the points of a sweep: their figures, each of the mechanism of its point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.measures.figures import known, reference
from trunnion.measures.measures import MEASURES, Measure, named
from trunnion.measures.positions import plan
from trunnion.model.mechanism import Mechanism
from trunnion.results.sentences import told
from trunnion.solve.forward import forward
from trunnion.solve.friction_method import MARGIN, FrictionMethod
from trunnion.solve.run import Run
from trunnion.solve.seating import settle
from trunnion.solve.status import status_of
from trunnion.solve.travel import lanes
from trunnion.studies.sweep.figures import FIGURES
from trunnion.studies.tolerance.kernel import Courses, NumpyKernel

__all__ = ["left_out", "measures_of", "of_point"]


def measures_of(run: Run, names: Sequence[str]) -> list[Measure]:
    """Measures by their names, each with one figure a cycle; MechanismError with all that cannot be swept, and why."""
    found = named(run.system.mechanism, names, run.values)
    findings = []
    for measure in found:
        where = f"measures.{measure.name}"
        if measure.name in FIGURES:
            what = f"the measure '{measure.name}' has the name of a figure of the sweep"
            findings.append(Finding(what, where, "call it otherwise in the model"))
        elif MEASURES[measure.kind].against or measure.of_attitude(run.system):
            what = f"the measure '{measure.name}' is a deviation from the nominal mechanism, and each point is its own"
            findings.append(Finding(what, where, "sweep another; `trunnion tolerance` tells what tolerances do to it"))
        elif measure.rule == "deviation":
            what = f"the measure '{measure.name}' has a number at every position and none of the cycle"
            findings.append(Finding(what, where, "state where, as at: 60 deg, or what of it, as as: maximum"))
    if findings:
        raise MechanismError(findings)
    return found


def of_point(run: Run, names: Sequence[str], steps: int, method: FrictionMethod) -> dict[str, float]:
    """The figures of measures of one mechanism, SI, by name; NaN where a position that one needs has no answer."""
    measures = measures_of(run, names)
    places = plan(run, measures, steps)
    if any(one.wants_margin for one in measures):
        method = replace(method, margin_up_to=MARGIN)
    courses, system = _courses(run, measures, places.times, method), run.system
    walk = forward(system, run.values, run.chosen.assembly, places.times)
    found = {}
    for measure in measures:
        turns = measure.of_motion and measure.turning(system)
        rate = measure.coordinate(system).rate(walk) if turns else None
        found[measure.name] = reference(
            measure, courses[measure.name], places.windows[measure.name], system, rate
        ).figure
    return found


def _courses(run: Run, measures: Sequence[Measure], time: np.ndarray, method: FrictionMethod) -> Courses:
    """The course of each measure at the times; pins with a seat lie in it."""
    if not run.seats:
        return NumpyKernel(run, tuple(measures), method).courses(run.values, time)[0]
    seen = lanes(time, run.cycle)
    with np.errstate(all="ignore"):
        seated = settle(run, seen, method, run.ideal(seen.times, replace(method, margin_up_to=0.0)))
        status = status_of(seated.back, time.shape)
        return {
            measure.name: tuple(
                np.where(known(measure, status), part, np.nan)
                for part in measure.curve(seated.back.walk if measure.of_motion else seated.back)
            )
            for measure in measures
        }


def left_out(mechanism: Mechanism, names: Sequence[str]) -> list[Finding]:
    """A note that names the measures of the model that a sweep does not have."""
    others = [name for name in mechanism.measures if name not in names]
    return [told("sweep.measures_left_out", "measures", measures=others)] if others else []
