"""What one error of the crank angle or of a sensor would explain of a misfit, and what the estimates would be without.

Each is one more free error of the fit: the same machinery finds its size, its uncertainty and the estimates with it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from trunnion.rig.identification.fit import FitProblem, LeastSquaresFit, SensorError
from trunnion.rig.identification.search import inside, refined
from trunnion.rig.identification.uncertainty import Test, lack_of_fit, quantile, spread_of

__all__ = ["MisfitCause", "explanations"]

Array = NDArray[np.float64]
ENOUGH = 0.8  # of a misfit, that a cause has to explain
ALIKE = 3.0  # standard deviations of χ², within which two causes explain the same
DEGREE = np.radians(1.0)
SETTLED = np.radians(0.01)
ROUNDS = 5
LEAST = 1e-6  # of the model, that a wrong unit may have a sensor read: N mm for kN m


@dataclass(frozen=True)
class MisfitCause:
    """One explanation of a misfit.

    kind: zero, gain or angle; channel: empty of the angle; size: in the unit of the channel, relative, or rad by which
    the readings are ahead of the model; expanded: U of it, 95 %; explains: share of the part of χ² above what scatter
    leads to expect; estimates, halves: of the unknowns with it, and U of each, 95 %, (unknown,); left: how well the
    model fits with it.
    """

    kind: str
    channel: str
    size: float
    expanded: float
    explains: float
    estimates: Array
    halves: Array
    left: Test


def explanations(problem: FitProblem, start: Array, test: Test) -> list[MisfitCause]:
    """Errors that explain most of a misfit, and about as much as each other, the simplest first; empty if none does.

    One whose size is 0 within its uncertainty explains nothing, nor does a gain at the end of its range.
    """
    begin = np.concatenate([start, np.zeros(len(problem.sensors))])
    tried = [one for one in _candidates(problem, begin, test) if not (one.kind == "gain" and one.size < 2 * LEAST - 1)]
    chance = 1 + ALIKE * np.sqrt(2 / max(test.freedom, 2.0))  # of the ratio of two reduced χ²
    most = chance * max(min((one.left.reduced for one in tried), default=np.nan), 1.0)
    return [
        one for one in tried if one.explains >= ENOUGH and one.left.reduced <= most and abs(one.size) > one.expanded
    ]


def _candidates(problem: FitProblem, start: Array, test: Test) -> Iterator[MisfitCause]:
    """Fits with a zero or a gain of each channel, beyond what is stated of it, and with an offset of the angle."""
    model = problem.model
    for kind in ("zero", "gain"):
        for channel in dict.fromkeys(block.channel for block in problem.blocks if block.fitted):
            turns = [block.turns for block in problem.blocks if block.channel == channel]
            if kind == "gain" and model.measures[channel].turning(model.run.system):
                continue
            size = 0.01 * (kind == "gain" or float(np.sqrt(np.nanmean(np.concatenate(turns, axis=None) ** 2))) or 1.0)
            sizes = tuple(size * (block.channel == channel) for block in problem.blocks)
            error = SensorError(f"{kind} of {channel}", channel, kind, sizes, stated=False, least=LEAST)
            more, found = _with(problem, start, error)
            if np.isfinite(found.cost):
                yield _cause(kind, channel, more, found, size, 0.0, test)
    yield from _turned(problem, start, test)


def _turned(problem: FitProblem, start: Array, test: Test) -> Iterator[MisfitCause]:
    """An offset of the crank angle, the same in all conditions; the positions follow it until it is settled."""
    model = problem.model
    driven = [model.driven(k, start[: problem.count]) for k in range(len(model.phases))]
    sizes = [-DEGREE / driven[one.condition][2] * (one.turns.shape[1] > 2) for one in problem.blocks]
    if not np.isfinite(sizes).all() or not any(sizes):
        return
    error, ahead = SensorError("offset of the drive angle", "", "delay", tuple(sizes), stated=False), 0.0
    for _ in range(ROUNDS):
        phases = tuple((phase + ahead / (last - first)) % 1.0
                       for phase, (first, last, _) in zip(model.phases, driven, strict=True))  # fmt: skip
        moved = replace(problem, model=replace(model, phases=phases) if ahead else model)
        more, found = _with(moved, start, error)
        step = float(found.x[-1]) * DEGREE
        if not np.isfinite(found.cost) or abs(step) > np.pi:
            return
        if not model.run.cycle.periodic or abs(step) < SETTLED:
            break
        ahead, start = ahead + step, found.x[:-1]
    else:
        step = 0.0  # it is in `ahead` already
    yield _cause("angle", "", more, found, DEGREE, ahead + step, test)


def _with(problem: FitProblem, start: Array, error: SensorError) -> tuple[FitProblem, LeastSquaresFit]:
    """The problem with one error more, and its fit from a start; of infinite cost where it has none."""
    more = FitProblem(
        problem.model, problem.blocks, [*problem.sensors, error], problem.guard, progress=problem.progress
    )
    more.start_scatter()
    begin = np.append(start, 0.0)
    try:
        return more, refined(more, inside(more, begin))[0]
    except ValueError:  # no answer of the model there
        return more, LeastSquaresFit(begin, float("inf"), 0, converged=False)


def _cause(
    kind: str, channel: str, problem: FitProblem, found: LeastSquaresFit, scale: float, size: float, test: Test
) -> MisfitCause:
    """A candidate with its uncertainty. scale: of the error fitted last; size: where it is not that times x."""
    left, spread = lack_of_fit(problem, found.x), spread_of(problem, found.x)
    half = quantile(spread.freedom) * np.sqrt(np.maximum(np.diagonal(spread.covariance), 0.0))
    explains = min((test.reduced - left.reduced) / (test.reduced - 1), 1.0)
    n = problem.count
    return MisfitCause(
        kind,
        channel,
        size or float(found.x[-1]) * scale,
        float(half[-1]) * scale,
        explains,
        found.x[:n],
        half[:n],
        left,
    )
