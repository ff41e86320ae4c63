"""Steps of an angle that the mapping does not state: how wide they are, and what half a step is worth to a channel.

An angle that is cut off to its last digit is late by half a step in the mean. That moves the course of a channel by
half a step times its slope over the angle, alike in all turns: no scatter shows it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, Severity
from trunnion.rig.reading.log import Account
from trunnion.rig.reading.measurement import Signal

__all__ = ["stated_as", "tell_slopes", "unstated_step"]

Array = NDArray[np.float64]
TURN = 2 * np.pi
LOOKED_AT = 50_000  # readings of which steps are sought
FEWEST = 20  # levels from which their distance is a step
WHOLE = 0.05  # of a step, by which a distance between levels may be off a multiple of it
WORTH = 0.5  # of the standard uncertainty of a channel: what half a step is told from
STEPS = 8  # over which a slope is taken, lest scatter passes for one


def unstated_step(angle: Array) -> float:
    """Step, rad, of which all readings of an angle, rad, are multiples; 0 if there is none.

    An angle of which each sample gains the same is one that was sampled by it: its multiples are no rounding.
    """
    part = angle[:LOOKED_AT]
    gained = np.abs(np.diff(part))
    gained = gained[np.isfinite(gained) & (gained > 0)]
    levels = np.unique(np.round(part[np.isfinite(part)] % TURN, 9))
    if gained.size < FEWEST or levels.size < FEWEST:
        return 0.0
    apart = np.diff(levels)
    apart = apart[apart > 1e-7]  # a turn away the same level is another float
    step = float(apart.min(initial=np.inf))
    if not np.isfinite(step):
        return 0.0
    step = float(np.median(apart[apart < 1.5 * step]))
    low, high = np.percentile(gained, (1, 99))
    whole = apart[apart < step / WHOLE] / step  # the rounding of wider ones to 1e-9 rad is no test
    if high - low < 0.5 * step or np.any(np.abs(whole - np.rint(whole)) > WHOLE):
        return 0.0
    return step


def stated_as(step: float) -> str:
    """A step, rad, as the mapping states it."""
    return f"{np.degrees(step):.4g} deg"


def tell_slopes(column: str, step: float, cycle: float, courses: Mapping[str, Signal], account: Account) -> bool:
    """Tell of steps of the angle, rad, half of one of which moves a channel by much of its uncertainty.

    cycle: rad; courses: of one condition. Returns whether it was told; the channel is that of which it moves the most.
    """
    rows = [(name, *_moved(one, step, cycle)) for name, one in courses.items()]
    name, share, off = max(rows, key=lambda row: row[1], default=("", 0.0, 0.0))
    if share <= WORTH:
        return False
    unit, size = courses[name].shown
    told = stated_as(step)
    what = (
        f"the column '{column}' is read in steps of {told}, which are not stated: half a step moves {name} by up to "
        f"{off / size:.2g}{f' {unit}' if unit != '1' else ''}, {share:.2g} times its standard uncertainty"
    )
    remedy = f"state angle: {{resolution: {told}}}: the angle is then smoothed, and half a step counts as uncertain"
    figures = {"step": step, "channel": name, "off": off, "times": share}
    account.findings.append(
        Finding(what, "angle", remedy, Severity.NOTE, file=account.file, code="data.angle.steps", figures=figures)
    )
    return True


def _moved(course: Signal, step: float, cycle: float) -> tuple[float, float]:
    """By what half a step moves a course at most: as a multiple of its standard uncertainty there, and in its unit."""
    mean, each = course.mean, cycle / course.mean.size
    to = max(int(np.ceil(0.5 * STEPS * step / each)), 1)
    slope = np.abs(np.roll(mean, -to) - np.roll(mean, to))[to:-to] / (2 * to * each)
    off = 0.5 * step * slope
    with np.errstate(invalid="ignore", divide="ignore"):
        shares = off / course.uncertainty[to:-to]
    known = np.isfinite(shares)
    if not known.any():
        return 0.0, 0.0
    k = int(np.argmax(np.where(known, shares, -1.0)))
    return float(shares[k]), float(off[k])
