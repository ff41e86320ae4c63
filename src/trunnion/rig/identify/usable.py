"""Data that nothing can be found from: without values, of a dead channel, or where the model has no answer."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Status
from trunnion.rig.identify.fit import Problem

__all__ = ["refuse_unusable"]

Array = NDArray[np.float64]
COURSE = 1e-3  # of the largest value: what the model must change by over the cycle to have a course


def refuse_unusable(problem: Problem, start: Array) -> None:
    """MechanismError where no position can be used, or a channel is dead."""
    findings = list(_dead(problem, start)) or list(_unusable(problem, start))
    if findings:
        raise MechanismError(findings)


def _any(problem: Problem, start: Array) -> bool:
    pairs = zip(problem.blocks, problem.allowed(start), strict=True)
    return any(bool(np.any(mask)) for block, mask in pairs if block.fitted)


def _unusable(problem: Problem, start: Array) -> Iterator[Finding]:
    """Why no position is used, if none is."""
    if _any(problem, start):
        return
    if not any(np.any(np.isfinite(block.mean)) for block in problem.blocks if block.fitted):
        what = "no channel has a value at any position"
        yield Finding(what, "data", "look at the gaps and columns with `trunnion data`")
        return
    bare = replace(problem, guard=0)
    if _any(bare, start):
        what = "all positions are left out: each is beside one where a friction turns round"
        yield Finding(what, "guard", "give a smaller guard, or resample to more positions")
        return
    codes = np.concatenate([np.asarray(one) for one in problem.courses(start).status])
    worst = list(Status)[int(np.bincount(codes).argmax())]
    if worst < Status.NOT_CONVERGED:
        what = "no position of the data has a sound answer of the model: a mechanism stands or is near singular there"
        yield Finding(what, "data", "measure at more positions")
        return
    what = f"no position of the data has an answer of the model: {worst.text}"
    yield Finding(what, "start", "give a start from which it runs, or look at it with analyse")


def _dead(problem: Problem, start: Array) -> Iterator[Finding]:
    """Channels that read one number, without scatter or course, where the model has a course."""
    dead: dict[str, list[tuple[int, float, float, float]]] = {}
    for k, block in enumerate(problem.blocks):
        read = block.turns[np.isfinite(block.turns)]
        said = problem.said(start, k)[0]
        said = said[np.isfinite(said)]
        if not block.fitted or block.turns.shape[1] < 3 or not read.size or not said.size or np.ptp(read) != 0:
            continue
        most, step = float(np.max(np.abs(said))), block.course.accuracy.resolution
        if np.ptp(said) > max(COURSE * most, 2 * step) or (read[0] == 0 and most > 2 * step):
            row = (block.condition, float(read[0]), float(np.min(said)), float(np.max(said)))
            dead.setdefault(block.channel, []).append(row)
    for channel, rows in dead.items():
        _, value, low, high = rows[0]
        many = f" in {len(rows)} conditions" if len(rows) > 1 else ""
        what = f"reads {value:.4g} at all positions of all turns{many}, where the model has {low:.4g} to {high:.4g}"
        remedy = "look at the sensor, its column and its gain, or name the other channels"
        yield Finding(what, f"channel {channel}", remedy)
