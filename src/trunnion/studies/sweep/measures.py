"""The measures of a model at the points of a sweep: their figures, each of the mechanism of its point."""

from __future__ import annotations

from collections.abc import Sequence

from trunnion.errors import Finding, MechanismError, agreeing
from trunnion.measures.measures import Measure, named
from trunnion.model.mechanism import Mechanism
from trunnion.solve.run import Run
from trunnion.studies.sweep.figures import FIGURES

__all__ = ["left_out", "measures_of"]


def measures_of(run: Run, names: Sequence[str]) -> list[Measure]:
    """Measures by their names, each with one figure a cycle; MechanismError with all that cannot be swept, and why."""
    found = named(run.system.mechanism, names, run.values)
    findings = []
    for measure in found:
        where = f"measures.{measure.name}"
        if measure.name in FIGURES:
            what = f"the measure '{measure.name}' has the name of a figure of the sweep"
            findings.append(Finding(what, where, "call it otherwise in the model"))
        elif measure.of.against or measure.of_attitude(run.system):
            what = f"the measure '{measure.name}' is a deviation from the nominal mechanism, and each point is its own"
            findings.append(
                Finding(what, where, "sweep another; see `trunnion tolerance` for the effect of tolerances on it")
            )
        elif measure.rule == "deviation":
            what = f"the measure '{measure.name}' has a number at every position and none of the cycle"
            findings.append(Finding(what, where, "state a position, at: 60 deg, or a statistic, as: maximum"))
    if findings:
        raise MechanismError(findings)
    return found


def left_out(mechanism: Mechanism, names: Sequence[str]) -> list[Finding]:
    """A note that names the measures of the model that a sweep does not have."""
    others = [name for name in mechanism.measures if name not in names]
    if not others:
        return []
    what = f"the model's {agreeing(len(others), 'measure', 'measures')} {', '.join(others)} "
    what += f"{agreeing(len(others), 'is', 'are')} not in this sweep"
    remedy = f"add {agreeing(len(others), 'it', 'them')} with --measure, in Python with measures=[…]"
    return [Finding.note("sweep.measures_left_out", "measures", what, remedy, measures=others)]
