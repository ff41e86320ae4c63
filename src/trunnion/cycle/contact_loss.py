"""Where a pin loses contact: the load of an end passes through zero, and its seat has to jump across the hole.

The massless-link model of play keeps the pin at the wall of its hole. That ends where the load vanishes or turns round,
which the courses of the loads without play say whatever the positions are; where the load of a pin that travels points
away from its wall; and where a seat does not settle, since there the load changes more by the seat than it presses.
Beside it the figure of a zero-clearance analysis that S. W. E. Earles and C. L. S. Wu (Predicting the occurrence of
contact loss and impact at a bearing from a zero-clearance analysis, Proc. 4th World Congress on the Theory of Machines
and Mechanisms, 1975, 1013-1018) found to tell impact: rate of turn of the reaction over its size, from about
1 rad/(N s) on. It is empirical, and has a unit.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Status
from trunnion.solve.end_loads import NO_LOAD, EndLoads
from trunnion.solve.memory import CHUNK
from trunnion.solve.seating import UNSETTLED, Seating

__all__ = ["find"]

INSIDE = 1e-9  # of the cycle: positions at the ends of a time belong to it

Array = NDArray[np.float64]
Arrays = dict[str, Array]


def find(arrays: Arrays, seating: Seating, time: Array) -> None:
    """Write the losses of contact of joints that their loads seat into `contact_lost`, the status and the numbers."""
    run, loads, status = seating.run, seating.loads, arrays["status"]
    for first in range(0, len(time), CHUNK):
        window = slice(first, min(first + CHUNK, len(time)))
        _fill_numbers(arrays["contact_loss_number"][:, window], loads, time[window])
    joints, duration, lost = list(run.system.joints), run.cycle.duration, arrays["contact_lost"]
    step = time[1] - time[0] if len(time) > 1 else 0.0
    for halt in seating.halts:
        lost[joints.index(halt.joint), (halt.low <= time) & (time < halt.high)] = 1
    times = [(cross.end, cross.low, cross.time, cross.high) for cross in loads.passages]
    for end, low, middle, high in times + [(end, low, low, high) for end, low, high in loads.idle]:
        row, away = joints.index(end.seat.joint), np.abs(time - middle)
        away = np.minimum(away, duration - away) if run.cycle.periodic else away
        lost[row, (time >= low - INSIDE * duration) & (time <= high + INSIDE * duration)] = 1
        if np.min(away) <= (0.5 + INSIDE) * step:  # the position next to it, if it lies between two
            lost[row, np.argmin(away)] = 1
    late = np.flatnonzero((seating.states(time) == UNSETTLED) & (status != Status.ZERO_SLIP))
    if len(late):  # of the joint whose end bears least
        rows = [joints.index(seat.joint) for seat in run.seats if seat.given is None]
        sizes = np.sqrt(np.sum(arrays["end_force"][rows][..., late] ** 2, axis=2))
        least = np.argmin(np.nan_to_num(np.min(np.where(np.isfinite(sizes), sizes, np.inf), axis=1)), axis=0)
        lost[np.array(rows)[least], late] = 1
    lost[:, status >= Status.NOT_CONVERGED] = 0
    anywhere = np.any(lost > 0, axis=0)
    np.maximum(status, np.where(anywhere, status.dtype.type(Status.CONTACT_LOST), status.dtype.type(0)), out=status)


def _fill_numbers(numbers: Array, loads: EndLoads, time: Array) -> None:
    """The figure of Earles and Wu, |F × Ḟ|/|F|³, rad/(N s), of every joint: of its reaction without play, in space of
    the force on an end."""
    forces, rates = loads.courses.at(time), loads.rates.at(time)
    for number, vectors in zip(numbers, loads.vectors, strict=True):
        for rows in vectors:
            force, rate = forces[rows], rates[rows]
            square = np.sum(force * force, axis=0)
            with np.errstate(all="ignore"):
                across = np.linalg.norm(rate - force * (np.sum(force * rate, axis=0) / square), axis=0)
                pressed = np.sqrt(square) > NO_LOAD * loads.largest
                number[...] = np.fmax(number, np.where(pressed, across / square, np.nan))
