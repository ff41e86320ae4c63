"""Which data a misfit lies in: the channel and condition whose residual stands out, and the part of the cycle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from trunnion.rig.identification.assessment import Assessment, Misses
from trunnion.rig.reading.arcs import concentration

__all__ = ["Outstanding", "outstanding"]

APART = 3.0  # times what the scatter explains, and times the median of the other conditions


@dataclass(frozen=True)
class Outstanding:
    """Where a misfit lies.

    channel, condition: whose residual is largest beside what the scatter explains; rms, expected: of it, SI; others:
    the largest of rms over expected in the other conditions, 0 if there is none or it does not stand out among them;
    place: angles of the driver, rad, between which `share` of its mean square lies, None where it is spread.
    """

    channel: str
    condition: str
    unit: str
    rms: float
    expected: float
    others: float
    place: tuple[float, float] | None
    share: float

    @property
    def times(self) -> float:
        """RMS over what the scatter explains."""
        return self.rms / self.expected


def outstanding(judged: Assessment) -> Outstanding | None:
    """The data that a misfit lies in; None where it is spread over conditions and cycle alike."""
    rows = [one for one in judged.misses if one.expected > 0 and np.isfinite(one.after)]
    worst = max(rows, key=_times, default=None)
    if worst is None or _times(worst) < APART:
        return None
    problem = judged.problem
    block = problem.blocks[worst.block]
    alike = [one for one in rows if problem.blocks[one.block].channel == block.channel]
    rest = [_times(one) for one in alike if one is not worst]
    alone = bool(rest) and _times(worst) > APART * float(np.median(rest))
    place, share = _place(judged, worst)
    if not alone and (place is None or rest):
        return None
    condition = judged.found.measurement.conditions[block.condition].name
    others = max(rest) if alone else 0.0
    return Outstanding(block.channel, condition, block.course.unit, worst.after, worst.expected, others, place, share)


def _times(one: Misses) -> float:
    return one.after / one.expected


def _place(judged: Assessment, one: Misses) -> tuple[tuple[float, float] | None, float]:
    """Between which angles of the driver most of a residual lies, and its share there."""
    model, k = judged.problem.model, judged.problem.blocks[one.block].condition
    residual, phase = one.curves[1], model.phases[k]
    first, last, _ = model.driven(k, judged.told)
    found = concentration(residual, model.run.cycle.periodic) if len(residual) == len(phase) else None
    if found is None or not np.isfinite(first):
        return None, 0.0
    start, end = (float(first + (last - first) * phase[at]) for at in (found.first, found.last))
    return (start, end), found.share
