"""Least and largest drive effort where a relative speed is zero: friction may act either way there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion.analysis import diagnosis
from trunnion.analysis.friction import FrictionMethod

if TYPE_CHECKING:
    from trunnion.analysis.analyse import Run

__all__ = ["bracket"]

CHUNK = 8192  # positions at a time

Arrays = dict[str, NDArray[np.float64]]


def bracket(
    arrays: Arrays, run: Run, time: NDArray[np.float64], method: FrictionMethod, causes: diagnosis.Causes
) -> None:
    """Least and largest drive effort: where a relative speed is zero, friction may act either way.

    Exact for one such joint at a position; with several, their separate effects are added (first order).
    """
    if not causes.zero_slip():
        return  # both are the effort itself
    lower = arrays["drive_effort_lower"] = arrays["drive_effort"].copy()
    upper = arrays["drive_effort_upper"] = arrays["drive_effort"].copy()
    seated = causes.seats()
    for joint, positions in causes.zero_slip().items():
        for low in range(0, len(positions), CHUNK):
            part = positions[low : low + CHUNK]
            _widen(lower, upper, arrays["drive_effort"], run, time[part], part, joint, method, seated)


def _widen(
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    effort: NDArray[np.float64],
    run: Run,
    time: NDArray[np.float64],
    positions: NDArray[np.intp],
    joint: str,
    method: FrictionMethod,
    seated: Mapping[str, NDArray[np.float64]],
) -> None:
    """Widen the interval by what the friction of one joint can do with either sign."""
    offsets = {path: numbers[positions] for path, numbers in seated.items()}
    ends = [run.at(time, offsets, method, {joint: sign}).efforts for sign in run.system.senses(joint)]
    # with pins held in both, so that what their travel adds to the effort is none of the interval
    middle = run.at(time, offsets, method).efforts if offsets else None
    for i, name in enumerate(run.system.mechanism.drivers):
        own = effort[i, positions] if middle is None else middle[name]
        changes = [np.broadcast_to(end[name] - own, time.shape) for end in ends]
        lower[i, positions] += np.minimum(0.0, np.min(changes, axis=0))
        upper[i, positions] += np.maximum(0.0, np.max(changes, axis=0))
