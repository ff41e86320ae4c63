"""How close is it to locking, which joint decides, can it be driven backward, is the answer the only one?"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.cycle.analyse import analyse_run
from trunnion.cycle.holding import holding_figures, holding_multiples, reverse_figure
from trunnion.cycle.locking_ends import told
from trunnion.cycle.locking_states import (
    NEAR,
    LockingRange,
    LockingState,
    in_order,
    ranges_of,
    rounding,
)
from trunnion.cycle.near_locking import (
    Passage,
    critical_figure,
    critical_multiples,
    least_margin,
    others,
    passage,
    reverse,
)
from trunnion.cycle.scales import scales_of
from trunnion.cycle.summary import member_units
from trunnion.cycle.uncounted import beside_the_drive
from trunnion.errors import Finding, MechanismError, Status
from trunnion.model.mechanism import Mechanism
from trunnion.model.names import strict_keywords
from trunnion.results.attributes import attribute, codes, encoded, finding_rows
from trunnion.results.dataset import Variable, described, units_along, with_variables
from trunnion.results.figure import Figure
from trunnion.results.scales import extreme_place
from trunnion.results.sentences import finding_for
from trunnion.solve.friction_method import MARGIN, FrictionMethod
from trunnion.solve.loads import NOTHING_USEFUL, STATE_USEFUL, has_useful_work
from trunnion.solve.run import Run, prepare
from trunnion.solve.system import Dial, felt, rubbing

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["MOST_STEPS", "NEAR", "LockingRange", "LockingState", "locking", "look", "ranges", "report_figures"]

MOST_STEPS = 8192
MOST_PLACES = 3  # named in one figure
HELD_AND_DRIVEN = LockingState.SELF_LOCKING_FORWARD, LockingState.DRIVEN_ON

VARIABLES = {
    "critical_multiple": Variable(
        ("joint", "position"), "1", "critical multiple of the friction of the joint alone, at which the position locks"
    ),
    "other_solutions": Variable(("position",), "1", "other solutions of the friction equations"),
    "drive_effort_reverse": Variable(
        ("driver", "position"), "effort", "drive effort of the reversed motion; NaN where it locks"
    ),
    "power_delivered_reverse": Variable(("position",), "W", "power delivered to the drivers when backdriven"),
    "power_acting_reverse": Variable(
        ("position",), "W", "power supplied by loads, springs, weight and inertia when backdriven"
    ),
    "power_given_reverse": Variable(("position",), "W", "power supplied by the useful loads when backdriven"),
    "efficiency_reverse_instant": Variable(
        ("position",), "1", "power delivered to the drivers over power supplied by the useful loads, backward"
    ),
    "holding_multiple": Variable(
        ("position",), "1", "multiple of all friction down to which it holds the loads; NaN where it does not"
    ),
    "locking_state": Variable(("position",), "1", "what friction does forward and backward", np.int8),
}


@strict_keywords
def locking(mechanism: Mechanism, steps: int = 360, progress: Callable[[int], None] | None = None) -> xr.Dataset:
    """The result of `analyse` with what is to know of locking at every position, by dims joint, driver and position.

    critical_multiple: by continuation from no friction, ∞ beyond 10; 0 for a joint without whose friction its group
    still locks; NaN for joints without friction and positions without forces for another cause. locking_state: a code
    of `LockingState`, whose words are its attribute `flag_meanings`; `ranges` has its intervals. Where pins have seats
    the margin is that of the seated pins; the rest is that of pins in the middle of their play. The names, units
    and meanings are in the Dataset. progress: called with the number of positions analysed.
    Raises MechanismError if the structure does not determine the motion, or for no steps or more than MOST_STEPS.
    """
    return look(prepare(mechanism), steps, progress)


@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN, and its status says so
def look(run: Run, steps: int = 360, progress: Callable[[int], None] | None = None, near: float = NEAR) -> xr.Dataset:
    """What `locking` does, for a mechanism that is prepared. near: the margin below which a range is near locking."""
    mechanism = run.system.mechanism
    if run.determinacy is not None:
        run.determinacy.refuse()
    if not 1 <= steps <= MOST_STEPS:
        raise MechanismError(Finding(f"the number of steps is {steps}", "steps", f"give 1 to {MOST_STEPS:,}"))
    result = analyse_run(run, steps, progress=progress)
    time, status = result["time"].values, result["status"].values
    back = run.solve(time, method=FrictionMethod())
    with np.errstate(all="ignore"):
        multiples = critical_multiples(back, MARGIN)
        more = np.where(status <= Status.LOCKED, others(back), np.nan)
        other = reverse(run, back.walk, FrictionMethod())
    known = (status < Status.NOT_CONVERGED) | (status == Status.LOCKED)
    ahead = passage(back)
    nothing = np.full(len(time), np.nan)
    efforts = [np.where(other.locked, np.nan, other.efforts[name]) for name in mechanism.drivers]
    arrays: dict[str, Any] = {
        "critical_multiple": [
            np.where(known, multiples.get(str(name), nothing), np.nan) for name in result["joint"].values
        ],
        "other_solutions": more,
        "drive_effort_reverse": np.array(efforts).reshape(len(efforts), len(time)),
        "power_delivered_reverse": np.where(other.locked, np.nan, other.delivered),
        "power_acting_reverse": other.acting,
        "power_given_reverse": other.given,
        "efficiency_reverse_instant": _efficiency_reverse(other),
        "holding_multiple": holding_multiples(run, time, ahead, other),
        "locking_state": in_order(ahead._replace(locked=status == Status.LOCKED), other, known),
    }
    found = with_variables(result, described(arrays, VARIABLES, member_units(run.system)))
    found["locking_state"].attrs.update(codes("flag", LockingState))
    said = finding_rows(_notes(run))
    findings = {"findings": [*attribute(found, "findings"), *said]} if said else {}
    return found.assign_attrs(encoded({"locking_ranges": told(run, found, near), **findings}))


def _notes(run: Run) -> list[Finding]:
    """What the states leave out: seats of pins; loads that move them."""
    notes = []
    if run.seats:
        notes.append(finding_for("locking.pins_centred", "joints", joints=[one.joint for one in run.seats]))
    mechanism = run.system.mechanism
    beside = beside_the_drive(mechanism) if rubbing(run.system) else []
    if beside:
        notes.append(finding_for("locking.load_beside_drive", "loads", loads=beside, count=len(beside)))
    return notes


def _efficiency_reverse(back: Passage) -> NDArray[np.float64]:
    """Of every position; NaN where the useful loads supply no power backward, or where that motion locks."""
    with np.errstate(all="ignore"):
        return np.where((back.given > rounding(back)) & ~back.locked, back.delivered / back.given, np.nan)


def ranges(found: xr.Dataset, near: float = NEAR) -> list[LockingRange]:
    """The intervals of a result of `locking` in which its state stays the same, in the order of the cycle; after them
    those that run, but with a margin below `near`."""
    return ranges_of(found["locking_state"].values, found["locking_margin"].values, near)


def report_figures(run: Run, found: xr.Dataset) -> list[Figure]:
    """The figures of a result of `look` that one looks at first."""
    dial = run.system.dial(run.values, found["time"].values)
    what = ", all friction together" if rubbing(run.system) else " (no joint has friction)"
    figures = [least_margin("locking_margin", f"locking margin{what}", found["locking_margin"].values, dial)]
    for joint in felt(run.system, run.values):
        figures += _of_joint(run, joint, found["critical_multiple"].sel(joint=joint).values, dial)
    more = found["other_solutions"].values
    if np.any(more > 0):
        subject = f"other solutions of the friction equations, {dial.intervals(np.flatnonzero(more > 0))}"
        figures.append(Figure("other_solutions", subject, np.nanmax(more), aspect="maximum"))
    figures += _turning(found)
    state = found["locking_state"].values
    figures += holding_figures(run, found["holding_multiple"].values, state, dial)
    figures += _reversing(run, found, dial)
    backward = reverse_figure(run)
    why = "the useful loads do no net work backward" if has_useful_work(run.system.mechanism) else NOTHING_USEFUL
    remedy = "" if has_useful_work(run.system.mechanism) else STATE_USEFUL
    stays = Figure("efficiency_reverse", f"efficiency when backdriven ({why})", None, note=remedy)
    return scales_of(run).of_figures([*figures, backward or stays])


def _turning(found: xr.Dataset) -> list[Figure]:
    """Where friction no longer holds the loads that push forward: there the drive effort changes its sign."""
    rows = [row for row in attribute(found, "locking_ranges")["rows"] if row["state"]]
    both = {one.name.lower() for one in HELD_AND_DRIVEN}
    places = [after["cells"][1] for before, after in pairwise(rows) if {before["state"], after["state"]} == both]
    if not places:
        return []
    where = ", ".join(places[:MOST_PLACES]) + (f" and {len(places) - MOST_PLACES} more" * (len(places) > MOST_PLACES))
    centred = ", pins centred," * ("seat_offset" in found)
    return [Figure("drive_effort_sign", f"the drive effort changes sign{centred} at", where)]


def _reversing(run: Run, found: xr.Dataset, dial: Dial) -> Iterator[Figure]:
    """The largest effort that each driver has to supply to go back over its range, as to open a clamp."""
    if run.cycle.periodic:
        return
    scales = scales_of(run)
    units, time = units_along(found["drive_effort"], "driver"), found["time"].values
    for name, unit in zip(found["driver"].values.tolist(), units, strict=True):
        effort = found["drive_effort_reverse"].sel(driver=name).values
        supplied = -effort * np.sign(primal(run.system.drive(run.values, name, time)[1]))
        if np.any(supplied > (floor := scales.floor(unit))):
            k = int(np.nanargmax(supplied))
            subject = f"drive {'torque' if unit == 'N m' else 'force'} of {name} to reverse the motion"
            place = extreme_place(supplied, f"at {dial.at(k)}", floor)
            yield Figure(f"{name}.effort_reverse", subject, effort[k], unit, "largest", place)


def _of_joint(run: Run, joint: str, multiple: NDArray[np.float64], dial: Dial) -> list[Figure]:
    """The least critical multiple of a joint, and its friction there."""
    least = least_margin(f"{joint}.critical_multiple", f"critical multiple of {joint} alone", multiple, dial)
    if not np.any(np.isfinite(multiple)):
        return [least]
    at = int(np.nanargmin(multiple))
    own = critical_figure(run, joint, float(multiple[at]), extreme_place(multiple, f"at {dial.at(at)}"))
    if own.name != least.name:
        return [least, own]
    return [own] if multiple[at] == 0 else [least]
