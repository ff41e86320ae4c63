"""Which joints lock, at what multiple of their friction, and what each group has to do with the locking margin."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trunnion.cycle.locking_course import critical_multiples
from trunnion.cycle.positions import positions
from trunnion.errors import Status
from trunnion.solve.friction_method import MARGIN, FrictionMethod
from trunnion.solve.run import Run, prepare
from trunnion.solve.seating import seating_of
from trunnion.solve.system import Values, felt, scale_of

__all__ = ["locks_of", "margins_without"]

Array = NDArray[np.float64]


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
