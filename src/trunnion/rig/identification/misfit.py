"""What one error of the crank angle or of a sensor would explain of a misfit, and what the estimates would be without.

The candidates are those of a comparison (`rig.comparison.error_sources`), each as one more unknown of the fit: the same
machinery finds its size, its uncertainty and the estimates that go with it. The simplest one is named that explains
enough.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from trunnion.rig.comparison.error_sources import ENOUGH, Cause, causes
from trunnion.rig.identification.blocks import Block
from trunnion.rig.identification.fit import FitProblem, LeastSquaresFit, SensorError
from trunnion.rig.identification.search import Search, inside, refined
from trunnion.rig.identification.uncertainty import Test, lack_of_fit, quantile, spread_of

__all__ = ["MisfitCause", "explanations"]

Array = NDArray[np.float64]
DEGREE = np.radians(1.0)
MILLISECOND = 1e-3
FAR = np.radians(5.0)  # an offset of the angle from which derivatives at the start lead nowhere
SETTLED = np.radians(0.01)
ROUNDS = 5
OTHER = 0.05  # of a speed, by which conditions differ enough to tell a delay from an offset of the angle
ALIKE = 3.0  # standard deviations of χ², within which two candidates explain the same


@dataclass(frozen=True)
class MisfitCause:
    """One explanation of a misfit.

    kind: as in `error_sources.KINDS`, or "delay"; channel: empty of what all channels have in common; size: of a shift
    rad by which the readings are ahead of the model, of a delay s, of a zero in the unit of the channel, of a gain
    relative; expanded: U of it, 95 %; explains: share of the misfit, the part of χ² above what scatter leads to expect;
    estimates, halves: of the unknowns with it, (unknown,), and U of each, 95 %.
    """

    kind: str
    channel: str
    size: float
    expanded: float
    explains: float
    estimates: Array
    halves: Array


@dataclass(frozen=True)
class _Refit:
    """A fit with one candidate more: its place among what was fitted, None if it is none of these, and its size."""

    kind: str
    channel: str
    problem: FitProblem
    fit: LeastSquaresFit
    size: float
    scale: float
    place: int | None


def explanations(problem: FitProblem, search: Search, test: Test) -> list[MisfitCause]:
    """The simplest error that explains most of a misfit, and others that explain as much; empty if none does."""
    tried = [one for one in _candidates(problem, search) if np.isfinite(one.fit.cost)]
    left = [lack_of_fit(one.problem, one.fit.x).reduced for one in tried]
    explained = [min((test.reduced - one) / (test.reduced - 1), 1.0) for one in left]
    chance = 1 + ALIKE * np.sqrt(2 / max(test.freedom, 2.0))  # of the ratio of two reduced χ²
    least = min((one for one in left if np.isfinite(one)), default=float("nan"))
    rows = zip(tried, left, explained, strict=True)
    return [_cause(one, share) for one, rest, share in rows if share >= ENOUGH and rest <= chance * max(least, 1.0)]


def _cause(one: _Refit, explains: float) -> MisfitCause:
    """A candidate with its uncertainty."""
    spread = spread_of(one.problem, one.fit.x)
    half = quantile(spread.freedom) * np.sqrt(np.maximum(np.diagonal(spread.covariance), 0.0))
    count = one.problem.count
    wide = float(half[one.place] * one.scale) if one.place is not None else 0.0
    return MisfitCause(one.kind, one.channel, one.size, wide, explains, one.fit.x[:count], half[:count])


# ---- candidates, the simplest first ---------------------------------------------------------------------------


def _candidates(problem: FitProblem, search: Search) -> Iterator[_Refit]:
    """Fits with a wrong sign, an offset or a wrong gain of each channel, a shift of the angle, a delay."""
    start = np.concatenate([search.start, np.zeros(len(problem.sensors))])
    channels = list(dict.fromkeys(block.channel for block in problem.blocks if block.fitted))
    for channel in channels:
        yield from _turned(problem, start, channel)
    for kind in ("zero", "gain"):
        for channel in channels:
            yield from _sensor(problem, start, kind, channel)
    yield from _shifted(problem, start)
    yield from _late(problem, start)


def _refit(problem: FitProblem, start: Array) -> LeastSquaresFit:
    """The fit of a problem from a start; of infinite cost where it has none."""
    problem.start_scatter()
    try:
        return refined(problem, inside(problem, start))[0]
    except ValueError:  # no answer of the model there
        return LeastSquaresFit(start, float("inf"), 0, converged=False)


def _with(problem: FitProblem, start: Array, extra: SensorError) -> tuple[FitProblem, LeastSquaresFit]:
    """The problem with one error more, and its fit."""
    more = FitProblem(
        problem.model, problem.blocks, [*problem.sensors, extra], problem.guard, progress=problem.progress
    )
    return more, _refit(more, np.append(start, 0.0))


def _turned(problem: FitProblem, start: Array, channel: str) -> Iterator[_Refit]:
    """A channel with the other sign, where it runs against the model."""
    k = next(k for k, block in enumerate(problem.blocks) if block.channel == channel and block.fitted)
    if float(np.nansum(problem.blocks[k].mean * problem.said(start, k)[0])) >= 0:
        return
    blocks = [replace(one, turns=-one.turns, held=-one.held) if one.channel == channel else one
              for one in problem.blocks]  # fmt: skip
    other = FitProblem(problem.model, blocks, problem.sensors, problem.guard, progress=problem.progress)
    yield _Refit("sign", channel, other, _refit(other, start), -1.0, 1.0, None)


def _sensor(problem: FitProblem, start: Array, kind: str, channel: str) -> Iterator[_Refit]:
    """A zero or a gain of a channel, beyond what is stated of it."""
    if kind == "gain" and problem.model.measures[channel].turning(problem.model.run.system):
        return
    own = [block for block in problem.blocks if block.channel == channel]
    size = 0.01 if kind == "gain" else 0.01 * float(np.sqrt(np.nanmean(np.concatenate(
        [np.ravel(block.turns) for block in own]) ** 2))) or 1.0  # fmt: skip
    sizes = tuple(size * (block.channel == channel) for block in problem.blocks)
    more, found = _with(problem, start, SensorError(f"{kind} of {channel}", channel, kind, sizes, stated=False))
    place = len(found.x) - 1
    yield _Refit(kind, channel, more, found, float(found.x[place]) * size, size, place)


def _of_course(block: Block) -> bool:
    return bool(block.turns.shape[1] > 2)


def _shifted(problem: FitProblem, start: Array) -> Iterator[_Refit]:
    """An offset of the crank angle, the same in all conditions; far ones from where a comparison sees them."""
    model = problem.model
    at = start[: problem.count]
    driven = [model.driven(k, at) for k in range(len(model.phases))]
    speeds = [driven[block.condition][2] for block in problem.blocks]
    if not np.isfinite(speeds).all() or not any(map(_of_course, problem.blocks)):
        return
    spans = [last - first for first, last, _ in driven]
    sizes = tuple(-DEGREE / speed * _of_course(b) for b, speed in zip(problem.blocks, speeds, strict=True))
    extra = SensorError("offset of the drive angle", "", "delay", sizes, stated=False)
    ahead = _seen(problem, start, spans) if model.run.cycle.periodic else 0.0
    for _ in range(ROUNDS):
        phases = tuple((phase + ahead / span) % 1.0 for phase, span in zip(model.phases, spans, strict=True))
        moved = replace(problem, model=replace(model, phases=phases) if ahead else model)
        more, found = _with(moved, start, extra)
        step = float(found.x[-1]) * DEGREE
        if not np.isfinite(found.cost) or abs(step) > np.pi:
            return
        if not model.run.cycle.periodic or abs(step) < SETTLED:
            break
        ahead += step
        start = found.x[:-1]
    yield _Refit("shift", "", more, found, ahead + (step if abs(step) < SETTLED or not ahead else 0.0), DEGREE,
                 len(found.x) - 1)  # fmt: skip


def _seen(problem: FitProblem, start: Array, spans: Sequence[float]) -> float:
    """The shift, rad, that a comparison with the model at the start sees in the first condition of a channel; 0 of one
    that the fit finds by itself."""
    seen: list[Cause] = []
    for channel in dict.fromkeys(block.channel for block in problem.blocks):
        k = next((k for k, one in enumerate(problem.blocks) if one.channel == channel and one.fitted), None)
        if k is None or problem.model.measures[channel].turning(problem.model.run.system):
            continue
        measured, theirs = problem.blocks[k].mean, problem.said(start, k)[0]
        phase, span = problem.model.phases[problem.blocks[k].condition], spans[problem.blocks[k].condition]
        there = np.isfinite(measured) & np.isfinite(theirs)
        found = causes(measured[there], theirs[there], phase[there], closed=True)
        seen += [one._replace(size=one.size * span) for one in found if one.kind == "shift"]
    most = max(seen, key=lambda one: one.explains, default=None)
    return most.size if most is not None and abs(most.size) > FAR else 0.0


def _late(problem: FitProblem, start: Array) -> Iterator[_Refit]:
    """A delay of all channels, where the conditions differ in speed: at one speed it is an offset of the angle."""
    model = problem.model
    speeds = np.abs([model.driven(k, start[: problem.count])[2] for k in range(len(model.phases))])
    if not np.isfinite(speeds).all() or np.ptp(speeds) < OTHER * np.max(speeds):
        return
    sizes = tuple(MILLISECOND * _of_course(block) for block in problem.blocks)
    more, found = _with(problem, start, SensorError("delay of all channels", "", "delay", sizes, stated=False))
    place = len(found.x) - 1
    yield _Refit("delay", "", more, found, float(found.x[place]) * MILLISECOND, MILLISECOND, place)
