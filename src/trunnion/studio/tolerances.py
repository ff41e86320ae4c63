"""What the tolerances of a model do to its largest effort and its strokes, to first order: a table that comes soon."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from trunnion.errors import Severity
from trunnion.joints.pairs import GUIDED
from trunnion.model.mechanism import Mechanism
from trunnion.results.attributes import findings_of
from trunnion.results.dataset import units_along
from trunnion.results.quantities import quantity
from trunnion.results.scales import without_noise
from trunnion.solve.run import prepare
from trunnion.studio.ways import ways

__all__ = ["signed", "tolerated"]

MOST = 4  # strokes that are told


def tolerated(mechanism: Mechanism, steps: int) -> dict[str, Any]:
    """Rows of the table: label, and texts of the nominal value, the worst case and the standard deviation.

    MechanismError where the study has no answer; `why` says what first order does not describe.
    """
    from trunnion.studies.tolerance.study import tolerance  # not for the first picture

    told = dict(_measures(mechanism, steps))
    if not told:
        return {"rows": [], "why": []}
    study = without_noise(tolerance(mechanism, list(told), methods=("linear",), steps=steps, jobs=1, engine="numpy"))
    units = units_along(study["nominal"], "measure")
    values = (study[name].values for name in ("nominal", "worst_case_lower", "worst_case_upper", "deviation_linear"))
    rows = []
    for label, unit, nominal, lower, upper, deviation in zip(told.values(), units, *values, strict=True):
        even = np.isclose(-lower, upper, rtol=1e-3)
        worst = f"± {quantity(float(upper), unit)}" if even else f"{signed(lower, unit)} / {signed(upper, unit)}"
        texts = [quantity(float(nominal), unit), worst, quantity(float(deviation), unit)]
        numbers = {"nominal": float(nominal), "worst": [float(lower), float(upper)], "deviation": float(deviation)}
        rows.append({"label": label, "texts": texts, **numbers})
    doubts = [one.what for one in findings_of(study) if one.severity is not Severity.NOTE]
    return {"rows": rows, "why": doubts[:1]}


def signed(value: float, unit: str) -> str:
    """A change with its sign and unit."""
    return f"{'−' if value < 0 else '+'}{quantity(abs(float(value)), unit)}"


def _measures(mechanism: Mechanism, steps: int) -> Iterator[tuple[str, str]]:
    """Measures by their names on the command line, with what they are called here."""
    run = prepare(mechanism)
    system = run.system
    for driver in mechanism.drivers:
        yield f"largest:effort:{driver}", f"largest {'torque' if system.turns(driver) else 'force'}, drive {driver}"
    held = [
        name
        for name, (kind, links) in system.joints.items()
        if mechanism.fixed_link in links and name not in mechanism.drivers and kind in GUIDED
    ]
    for joint in held[:MOST]:
        yield f"stroke:{joint}", f"stroke of {joint}"
    for way in ways(run, steps):
        if way.ratio > 0 and way.joint in held[:MOST]:
            yield f"time_ratio:{way.joint}", f"time ratio of {way.joint}"
