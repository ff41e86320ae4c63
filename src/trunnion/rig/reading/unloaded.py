"""Whether the stretches of time from which zeros are taken are unloaded: the machine stands, readings only scatter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Severity
from trunnion.rig.reading.channels import mean_uncertainty
from trunnion.rig.reading.log import Account, few_digits

__all__ = ["check_unloaded"]

Array = NDArray[np.float64]
MOVES = np.radians(5.0)  # more than play, jitter of an encoder, and what the integral of a speed gathers at rest
BLOCKS = 10  # parts of a stretch whose means are compared
FAR = 10.0  # standard uncertainties of these
WORTH = 0.03  # of the readings of the run: what a zero may be off by before it matters
ALIKE = 0.3  # of the same: a stretch that varies by so much is one of the run
NOISY = 3.0  # times the scatter from row to row
SURE = 0.95  # of the time up to when it is seen to move: before that it starts
FEW = 50  # readings, from which this can be told


def check_unloaded(
    where: str,
    stretch: tuple[float, float],
    seconds: Array,
    angle: Array | None,
    readings: Array,
    run: slice,
    shown: tuple[str, float],
    account: Account,
) -> None:
    """Tell of a stretch of time, s, in which the machine moves or a channel varies far more than by its noise.

    angle: of the driver by row, rad; None where nothing measures it; run: the rows of the turns that are used; shown:
    unit for what is told, and its size in readings. Readings that only scatter while it moves are a note: it may be
    uncoupled.
    """
    low, high = np.searchsorted(seconds, stretch)
    part = readings[low:high]
    moved, since = _moved(seconds[low:high], angle[low:high]) if angle is not None else (0.0, float("nan"))
    varies = _varies(part[np.isfinite(part)], readings[run])
    if moved <= MOVES and not varies:
        return
    told = f"in the unloaded stretch {stretch[0]:g} to {stretch[1]:g} s"
    found = [f"the angle moves by {few_digits(np.degrees(moved), 3)}°"] if moved > MOVES else []
    if varies:
        unit, size = shown
        wide = float(np.subtract(*np.nanpercentile(part, (99, 1)))) / size
        found.append(f"the readings vary by {few_digits(wide, 3)} {unit}, far more than their noise")
    remedy = "state a stretch in which the machine stands and nothing loads the sensor"
    if since - stretch[0] > 0.1 * (stretch[1] - stretch[0]):
        sure = stretch[0] + SURE * (since - stretch[0])
        remedy = f"{remedy}, such as up to {sure:.3g} s"
    severity = Severity.WARNING if varies else Severity.NOTE
    account.warn("data.zero.loaded", where, f"{told} {' and '.join(found)}", remedy, severity)


def _moved(seconds: Array, angle: Array) -> tuple[float, float]:
    """How far an angle moves in a stretch, rad, and up to when it stands there, s; NaN if it does not move."""
    known = np.flatnonzero(np.isfinite(angle))
    if known.size < 2:
        return 0.0, float("nan")
    away = np.abs(angle[known] - angle[known[0]])
    first = int(np.argmax(away > 0.1 * MOVES))
    return float(np.ptp(angle[known])), float(seconds[known[first]]) if first else float("nan")


def _varies(part: Array, run: Array) -> bool:
    """Whether readings of a stretch vary as those of a run do, or their mean changes by far more than scatter explains.

    The scatter of a mean is that of the quietest parts: where the machine starts within the stretch, those before.
    """
    run = run[np.isfinite(run)]
    if part.size < FEW or run.size < FEW:
        return False
    usual = float(np.median(part))
    size = float(np.sqrt(np.mean((run - usual) ** 2)))
    noise = float(np.sqrt(np.mean(np.diff(part) ** 2) / 2))
    spread = float(np.std(part))
    if spread > ALIKE * size and spread > NOISY * noise:
        return True
    blocks = np.array_split(part, BLOCKS)
    errors = np.sort([mean_uncertainty(one) for one in blocks])
    change = float(np.ptp([np.mean(one) for one in blocks]))
    return change > WORTH * size and change > FAR * float(errors[1])
