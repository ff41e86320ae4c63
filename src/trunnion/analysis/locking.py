"""How close is it to locking, which joint decides, can it be driven backward, is the answer the only one?"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.analysis.account import MARGIN, effort_units, useful_loads
from trunnion.analysis.analyse import Run, prepare
from trunnion.analysis.friction import FrictionMethod
from trunnion.analysis.near_locking import critical_multiples, others, reverse
from trunnion.analysis.system import law_of, rubbing
from trunnion.errors import Finding, MechanismError
from trunnion.model.mechanism import Mechanism

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["MOST_STEPS", "locking", "report_rows"]

MOST_STEPS = 8192

_NAMES = {
    "locking_margin": ("1", "multiple of all friction at which the position locks"),
    "critical_multiple": ("1", "multiple of the joint's own friction at which the position locks"),
    "other_solutions": ("1", "solutions found at full friction beside the one given"),
    "drive_effort": ("N m", "drive effort on the second link by the first"),
    "drive_effort_reverse": ("N m", "drive effort with the motion run backward; NaN where that locks"),
    "power_delivered_reverse": ("W", "power that the drivers take out with the motion run backward"),
    "power_given_reverse": ("W", "power that the useful loads put in with the motion run backward"),
}


def locking(mechanism: Mechanism, steps: int = 360, most: float = MARGIN) -> xr.Dataset:
    """Locking over the cycle, by dims joint, driver and position; the names, units and meanings are in the Dataset.

    Margins and multiples are found by continuation from no friction up to `most`, ∞ beyond; 0 for a joint without
    whose friction its group still locks. Units of the efforts are N for a slide (attribute driver_units).
    Raises MechanismError if the structure does not determine the motion, or for no steps or more than MOST_STEPS.
    """
    import xarray as xr

    if not 1 <= steps <= MOST_STEPS:
        raise MechanismError(Finding(f"cannot look at {steps} positions", "steps", f"give 1 to {MOST_STEPS:,}"))
    run = prepare(mechanism)
    time = run.cycle.times(steps if run.cycle.duration > 0 else 1)
    method = FrictionMethod(margin_up_to=most)
    back = run.solve(time, method=method)
    with np.errstate(all="ignore"):
        multiples = critical_multiples(back, most)
        other = reverse(run, back, FrictionMethod(), useful_loads(mechanism))
        margin = np.minimum.reduce([np.broadcast_to(one.margin, time.shape) for one in back.settled])
        more = others(back)
    drivers = list(mechanism.drivers)
    efforts = [np.broadcast_to(back.efforts[name], time.shape) for name in drivers]
    arrays: dict[str, tuple[tuple[str, ...], Any]] = {
        "locking_margin": ((), margin),
        "critical_multiple": (("joint",), np.array(list(multiples.values())).reshape(len(multiples), len(time))),
        "other_solutions": ((), more),
        "drive_effort": (("driver",), np.array(efforts).reshape(len(drivers), len(time))),
        "drive_effort_reverse": (
            ("driver",),
            np.array([np.where(other.locked, np.nan, other.efforts[name]) for name in drivers]).reshape(-1, len(time)),
        ),
        "power_delivered_reverse": ((), np.where(other.locked, np.nan, other.delivered)),
        "power_given_reverse": ((), other.given),
    }
    variables = {
        name: xr.Variable((*dims, "position"), values, dict(zip(("units", "long_name"), _NAMES[name], strict=True)))
        for name, (dims, values) in arrays.items()
    }
    times = xr.Variable("position", time, {"units": "s", "long_name": "time from the start of the cycle"})
    coordinates = {"joint": list(multiples), "driver": drivers, "time": times}
    return xr.Dataset(variables, coordinates, {"driver_units": " ".join(effort_units(run.system)), "most": most})


def report_rows(mechanism: Mechanism, steps: int) -> list[dict[str, Any]]:
    """The figures of `locking` that one looks at first, as label, value and unit."""
    run = prepare(mechanism)
    found = locking(mechanism, steps)
    dial = run.system.dial(run.values, found["time"].values)
    most = found.attrs["most"]
    if not rubbing(run.system):
        return [{"label": "there is no friction: nothing locks", "value": None, "unit": "1"}]
    rows = [_least("locking margin, all friction together", found["locking_margin"].values, dial, most)]
    for joint in found["joint"].values:
        multiple = found["critical_multiple"].sel(joint=joint).values
        rows.append(_least(f"critical multiple of {joint} alone", multiple, dial, most))
        coefficient = _coefficient(run, str(joint))
        least = float(np.min(multiple, initial=np.inf))
        if coefficient is not None and np.isfinite(least):
            label = f"critical friction coefficient of {joint} alone"
            rows.append({"label": label, "value": least * coefficient, "unit": "1"})
    more = found["other_solutions"].values
    if np.any(more > 0):
        where = dial.intervals(np.flatnonzero(more > 0))
        rows.append(
            {"label": f"other solutions at full friction, {where}, most", "value": float(more.max()), "unit": "1"}
        )
    return rows + _backward(run, found)


def _least(label: str, values: Any, dial: Any, most: float) -> dict[str, Any]:
    known = np.isfinite(values)
    if not np.any(known):
        return {"label": f"{label}, more than", "value": most, "unit": "1"}
    at = int(np.flatnonzero(known)[np.argmin(values[known])])
    return {"label": f"{label}, least, at {dial.at(at)}", "value": float(values[at]), "unit": "1"}


def _coefficient(run: Run, joint: str) -> float | None:
    """The friction coefficient of a joint, if its friction is proportional to it."""
    path = f"joints.{joint}.friction.coefficient"
    if not law_of(run.system, joint).interval_at_rest or path not in run.values:
        return None
    return float(np.ravel(run.values[path])[0])


def _backward(run: Run, found: Any) -> list[dict[str, Any]]:
    """Whether the useful loads can drive it backward."""
    given, delivered = found["power_given_reverse"].values, found["power_delivered_reverse"].values
    work, size = run.cycle.mean(given), run.cycle.mean(np.abs(given))
    if not work > 1e-9 * size:
        return [{"label": "the useful loads do not drive it backward over the cycle", "value": None, "unit": "1"}]
    locked = int(np.count_nonzero(np.isnan(delivered)))
    if locked:
        return [{"label": "positions that lock when driven backward", "value": locked, "unit": "1"}]
    value = run.cycle.mean(delivered) / work
    text = "" if value > 0 else " (it holds itself)"
    return [{"label": f"efficiency driven backward by the useful loads{text}", "value": value, "unit": "1"}]
