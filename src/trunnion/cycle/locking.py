"""How close is it to locking, which joint decides, and can it be driven backward?"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trunnion.cycle.locking_course import (
    NEAR,
    LockingState,
    critical_multiples,
    holding_multiples,
    locking_course,
    multiples_at,
    passed,
)  # fmt: skip
from trunnion.cycle.positions import positions
from trunnion.cycle.scales import scales_of
from trunnion.cycle.summary import member_units, result_of
from trunnion.errors import Finding, MechanismError, Status
from trunnion.model.arguments import strict_arguments
from trunnion.model.mechanism import Mechanism
from trunnion.results.attributes import Figure, codes, encoded
from trunnion.results.dataset import described, with_variables
from trunnion.results.variables import LOCKING, along_positions
from trunnion.solve.friction_method import MARGIN, FrictionMethod
from trunnion.solve.loads import NOTHING_USEFUL, STATE_USEFUL, has_useful_work
from trunnion.solve.run import Run, prepare
from trunnion.solve.seating import seating_of
from trunnion.solve.system import Values, felt, rubbing, scale_of

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]

MOST_STEPS = 8192
METHOD = FrictionMethod(margin_up_to=MARGIN)


@strict_arguments
def locking(mechanism: Mechanism, steps: int = 360, progress: Callable[[int], None] | None = None) -> xr.Dataset:
    """The result of `analyse` with what is to know of locking at every position, by dims joint, driver and position.

    critical_multiple: by continuation from no friction, ∞ beyond 10; 0 for a joint without whose friction its group
    still locks; NaN for joints without friction and positions without forces for another cause. locking_state: a code
    of `LockingState`, whose words are its attribute `flag_meanings`; the attribute `locking_ranges` has its ranges over
    the cycle, which depend on no steps. Where pins have seats the margin is that of the seated pins; the rest is that
    of pins in the middle of their play. The names, units and meanings are in the Dataset. progress: called with the
    number of positions analysed.
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
    result = result_of(run, positions(run, steps, progress=progress)).dataset
    time, status = result["time"].values, result["status"].values
    other, multiples = passed(run, run.walk(time).backward(), FrictionMethod()), multiples_at(run, time, MARGIN)
    answered = (status < Status.NOT_CONVERGED) | (status == Status.LOCKED)
    course, nothing = locking_course(run, METHOD), np.full(len(time), np.nan)
    state = np.full(len(time), int(LockingState.RUNS)) if course is None else course.states_at(time)
    efforts = [np.where(other.locked, np.nan, other.efforts[name]) for name in mechanism.drivers]
    giving = (other.given > scales_of(run).floor("W")) & ~other.locked
    arrays: dict[str, Any] = {
        "critical_multiple": [
            np.where(answered, multiples.get(str(name), nothing), np.nan) for name in result["joint"].values
        ],
        "drive_effort_reverse": np.array(efforts).reshape(len(efforts), len(time)),
        "power_delivered_reverse": np.where(other.locked, np.nan, other.delivered),
        "power_acting_reverse": other.acting,
        "power_given_reverse": other.given,
        "efficiency_reverse_instant": np.where(giving, other.delivered / other.given, np.nan),
        "holding_multiple": holding_multiples(run, time),
        "locking_state": np.where(answered, state, int(LockingState.UNSOLVED)).astype(np.int8),
    }
    result = with_variables(result, described(arrays, along_positions(LOCKING), member_units(run.system)))
    result["locking_state"].attrs.update(codes("flag", LockingState))
    return result if course is None else result.assign_attrs(encoded({"locking_ranges": course.attribute(time, near)}))


def report_figures(run: Run) -> list[Figure]:
    """The figures of locking over the cycle that one looks at first."""
    course, useful = locking_course(run, METHOD), has_useful_work(run.system.mechanism)
    why = "the useful loads do no net work backward" if useful else NOTHING_USEFUL
    none = Figure(
        "efficiency_reverse", f"efficiency when backdriven ({why})", None, note="" if useful else STATE_USEFUL
    )
    if course is None:
        return [none]
    what = ", all friction together" if rubbing(run.system) else " (no joint has friction)"
    figures = [
        course.margin_figure(f"locking margin{what}", ""),
        *course.critical_figures(),
        *course.holding_figures(),
        *course.reversing_figures(),
        course.reverse_figure() or none,
    ]
    return scales_of(run).of_figures([figure for figure in figures if figure is not None])


# ---- which joints lock, and what each group has to do with the margin ----------------------------------------


@np.errstate(all="ignore")
def locks_of(run: Run, time: Array, status: ArrayLike, values: Values | None = None) -> dict[str, Array]:
    """Joints that lock at some of the times, with the multiple of the friction at which they do; NaN where they do not.

    It is the joint whose own friction need be lowered the least, and the multiple is of that alone. Where no joint
    alone can be lowered enough, it is every joint of the group, and the multiple is of all of them.

    Parameters
    ----------
    run : Run
    time : array
        s.
    status : array
        That of the run at each of them.
    values : mapping, optional
        Other numbers than those of the run, SI, by path.
    """
    lanes = np.flatnonzero(np.asarray(status) == Status.LOCKED)
    if not len(lanes):
        return {}
    method = FrictionMethod(name="newton")
    seated = run.seats and values is None
    back = seating_of(run, method).at(time[lanes], method).back if seated else run.solve(time[lanes], values, method)
    multiples = critical_multiples(back, 1.0)
    if not multiples:
        return {}
    alone = np.array([np.where(multiple < 1.0, multiple, 0.0) for multiple in multiples.values()])
    columns = {joint: np.full(len(time), np.nan) for joint in multiples}
    best = np.argmax(alone, axis=0)
    for number, settled in zip(reversed(range(len(run.system.plan.modules))), back.settled, strict=True):
        share = np.broadcast_to(np.asarray(settled.share, float), len(lanes))
        for joint in multiples.keys() & set(run.system.plan.modules[number].joints):
            row = list(multiples).index(joint)
            decides = (best == row) & (alone[row] > 0)
            together = (share < 1.0) & ~(np.max(alone, axis=0) > 0)
            columns[joint][lanes] = np.where(decides, alone[row], np.where(together, share, np.nan))
    return {joint: column for joint, column in columns.items() if np.any(np.isfinite(column))}


def margins_without(run: Run, steps: int) -> list[Array | None]:
    """For each group of the plan the locking margin over the cycle without the friction of its joints; None where a law
    has no number that takes it away.
    """
    modules, mechanism = run.system.plan.modules, run.system.mechanism
    rubs, margins = felt(run.system, run.values), list[Array | None]()
    for module in modules:
        scales = {joint: scale_of(run.system, run.values, joint) for joint in module.joints if joint in rubs}
        if not all(scales.values()):
            margins.append(None)
            continue
        quiet = mechanism.with_values({f"joints.{joint}.friction.{scale}": 0.0 for joint, scale in scales.items()})
        with np.errstate(all="ignore"):
            margin = positions(prepare(quiet), steps, averaged=False).arrays["locking_margin"]
        margins.append(np.minimum(margin, MARGIN))
    return margins
