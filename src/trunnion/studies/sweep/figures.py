"""The figures of a cycle: what its positions come to, and the reduction that every point of a sweep goes through."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Place
from trunnion.cycle.course import CycleCourse, Means, magnitude
from trunnion.errors import Finding, MechanismError, Status, agreeing
from trunnion.joints.pairs import PAIRS
from trunnion.measures.measures import Measure, named
from trunnion.model.mechanism import Mechanism
from trunnion.results.dataset import Variable
from trunnion.solve.run import Run
from trunnion.solve.system import System

__all__ = ["FIGURES", "Reduced", "left_out", "measures_of", "reduced"]

Arrays = Mapping[str, NDArray[Any]]


# dims before the swept names; part: "errors" of those that only mechanisms with errors have, "margin" of the one that
# is looked for only if asked
FIGURES: dict[str, Variable] = {
    "efficiency": Variable((), "1", "useful work over drive work of the cycle"),
    "efficiency_error": Variable(
        (), "1", "how far the errors of its integrals and pins that do not settle may have moved it"
    ),
    "efficiency_ideal": Variable((), "1", "efficiency of the mechanism without errors", part="errors"),
    "drive_effort_min": Variable(("driver",), "effort", "minimum drive effort"),
    "drive_effort_max": Variable(("driver",), "effort", "maximum drive effort"),
    "drive_effort_rms": Variable(("driver",), "effort", "root mean square of the drive effort"),
    "drive_power_mean": Variable((), "W", "mean power of all drivers"),
    "useful_power_mean": Variable((), "W", "mean power delivered to the useful loads"),
    "friction_power_mean": Variable((), "W", "mean power lost to friction"),
    "reaction_max": Variable(("joint",), "N", "maximum reaction"),
    "transmission_error_max": Variable(
        ("joint",),
        "transmission_error",
        "largest error of the joint's rotation, of a prismatic joint its slide",
        part="errors",
    ),
    "locking_margin": Variable(
        (), "1", "least multiple of the friction at which a position locks, ∞ if beyond 10", part="margin"
    ),
    "without_answer": Variable((), "1", "positions not solved", np.int32),
    "not_valid": Variable(
        (), "1", "positions at which a pin loses contact, left out of the figures", np.int32, part="errors"
    ),
    "status": Variable((), "1", "code of the gravest status of a position; see the attribute flag_meanings", np.int8),
}
Reduced = dict[str, Any]


def reduced(arrays: Arrays, course: CycleCourse | None, ideal: Means | None, system: System, margin: bool) -> Reduced:
    """The figures of FIGURES of one cycle; numbers, or rows over drivers or joints.

    arrays: over positions, by the names of `results.VARIABLES`: status, and with a margin locking_margin;
    course: over the cycle, None where a position has no answer; ideal: means of the mechanism without errors, None if
    it has none.
    """
    status = arrays["status"]
    missing = int(np.count_nonzero(status >= Status.NOT_CONVERGED))
    figures: Reduced = {"status": int(np.max(status)), "without_answer": missing}
    figures["not_valid"] = int(np.count_nonzero(status == Status.CONTACT_LOST))
    if margin:
        valid = status != Status.CONTACT_LOST
        figures["locking_margin"] = float(np.min(arrays["locking_margin"][valid], initial=np.inf))
    if ideal:
        figures["efficiency_ideal"] = ideal.efficiency
    if missing or course is None or not np.any(course.sound):  # contact is lost everywhere
        return figures
    means = course.means
    joints, drivers = range(len(system.joints)), range(len(system.mechanism.drivers))
    if ideal:
        slides = [PAIRS[kind].guided for kind, _ in system.joints.values()]
        names = [f"joint_{'slide' if slide else 'rotation'}_error" for slide in slides]
        figures["transmission_error_max"] = [
            _value(course.extreme(name, i, of=magnitude)) for i, name in enumerate(names)
        ]
    else:  # beside points with errors
        figures |= {"efficiency_ideal": means.efficiency, "transmission_error_max": 0.0}
    ends = [[_value(course.extreme("drive_effort", i, sign=sign)) for i in drivers] for sign in (-1.0, 1.0)]
    return figures | {
        "efficiency": means.efficiency,
        "efficiency_error": means.efficiency_error,
        "drive_effort_min": ends[0],
        "drive_effort_max": ends[1],
        "drive_effort_rms": means.drive_effort_rms,
        "drive_power_mean": means.drive_power_mean,
        "useful_power_mean": means.useful_power_mean,
        "friction_power_mean": means.friction_power.net,
        "reaction_max": [_value(course.extreme("reaction_force", i, of=magnitude)) for i in joints],
    }


def _value(place: Place | None) -> float:
    """An extreme; NaN where there is none."""
    return float("nan") if place is None else place.value


# ---- measures of the model -------------------------------------------------------------------------------------


def measures_of(run: Run, names: Sequence[str]) -> list[Measure]:
    """Measures by their names, each with one figure a cycle; MechanismError with all that cannot be swept, and why."""
    measures = named(run.system.mechanism, names, run.values)
    findings = []
    for measure in measures:
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
    return measures


def left_out(mechanism: Mechanism, names: Sequence[str]) -> list[Finding]:
    """A note that names the measures of the model that a sweep does not have."""
    others = [name for name in mechanism.measures if name not in names]
    if not others:
        return []
    what = f"the model's {agreeing(len(others), 'measure', 'measures')} {', '.join(others)} "
    what += f"{agreeing(len(others), 'is', 'are')} not in this sweep"
    remedy = f"add {agreeing(len(others), 'it', 'them')} with --measure, in Python with measures=[…]"
    return [Finding.note("sweep.measures_left_out", "measures", what, remedy, measures=others)]
