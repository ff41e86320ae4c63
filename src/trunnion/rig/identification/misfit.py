"""What one error of the crank angle or of a sensor would explain of a misfit, and what the estimates would be without.

The candidates are those of a comparison (`rig.comparison.error_sources`), and lengths of the model that act like the
residuals, each as one more unknown of the fit: the same machinery finds its size, its uncertainty and the estimates
that go with it. The simplest one is named that explains enough: first those that all conditions share, then those of
which each condition has its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.rig.comparison.error_sources import ENOUGH, Cause, causes
from trunnion.rig.identification.blocks import Block
from trunnion.rig.identification.fit import FitProblem, LeastSquaresFit, SensorError
from trunnion.rig.identification.lengths import likely_lengths
from trunnion.rig.identification.search import Search, inside, refined
from trunnion.rig.identification.uncertainty import Test, lack_of_fit, quantile, spread_of
from trunnion.rig.identification.unknowns import Unknown
from trunnion.rig.identification.unused import UnusedChannels

__all__ = ["MisfitCause", "OwnSize", "explanations"]

Array = NDArray[np.float64]
DEGREE = np.radians(1.0)
MILLISECOND = 1e-3
FAR = np.radians(5.0)  # an offset of the angle from which derivatives at the start lead nowhere
SETTLED = np.radians(0.01)
ROUNDS = 5
BEYOND = 4.0  # standard uncertainties: an error of one condition so far from what is stated explains the misfit itself
OTHER = 0.05  # of a speed, by which conditions differ enough to tell a delay from an offset of the angle
LEAST = 1e-6  # of the model, that a wrong unit may have a sensor read: N mm for kN m
NEARLY = 0.95  # of a misfit that a length has to explain which leaves one
ALIKE = 3.0  # standard deviations of χ², within which two candidates explain the same


class OwnSize(NamedTuple):
    """What an error comes to in one condition, by its index; size and U as of a MisfitCause."""

    condition: int
    size: float
    expanded: float


@dataclass(frozen=True)
class MisfitCause:
    """One explanation of a misfit.

    kind: as in `error_sources.KINDS`, "delay" or "length"; channel: empty of what all channels have in common, of a
    length its name; size: of a length by how much it is larger than the model's, m, of a shift
    rad by which the readings are ahead of the model, of a delay s, of a zero in the unit of the channel, of a gain
    relative; expanded: U of it, 95 %; explains: share of the misfit, the part of χ² above what scatter leads to expect;
    estimates, halves: of the unknowns with it, (unknown,), and U of each, 95 %; left: how well the model fits with it;
    own: of each condition by itself, of an error that conditions do not share; size and expanded are then those of the
    largest.
    """

    kind: str
    channel: str
    size: float
    expanded: float
    explains: float
    estimates: Array
    halves: Array
    left: Test
    own: tuple[OwnSize, ...] = ()


@dataclass(frozen=True)
class _Refit:
    """A fit with one candidate more.

    size: of the one that all conditions share; where each of `conditions` has its own, sizes of these. What was fitted
    of it is last in x, in units of `scale`, of a length the last unknown; nothing of it where that is 0.
    """

    kind: str
    channel: str
    problem: FitProblem
    fit: LeastSquaresFit
    sizes: tuple[float, ...]
    scale: float
    conditions: tuple[int, ...] = ()

    @property
    def bounded(self) -> bool:
        """Whether a gain ended where the search does: such a size is none that was found."""
        return self.kind == "gain" and min(self.sizes) < 2 * LEAST - 1

    @property
    def strange(self) -> bool:
        """Whether what is stated of a single condition or file is far off with it: these then explain the misfit."""
        first, count = self.problem.count, len(self.sizes) * (self.scale != 0 and self.kind != "length")
        told = zip(self.problem.sensors[: len(self.problem.sensors) - count], self.fit.x[first:], strict=False)
        return any(one.stated and bool(one.group) and abs(x) > BEYOND for one, x in told)


def explanations(
    problem: FitProblem, search: Search, test: Test, unused: UnusedChannels | None = None
) -> list[MisfitCause]:
    """The simplest error that explains most of a misfit, and others that explain as much; empty if none does.

    One whose size is 0 within its uncertainty explains nothing; what each condition has by itself is named only where
    nothing that they share explains as much; a length, of which there are many, where it explains nearly all.
    unused: channels that are not fitted; they may speak against a shift.
    """
    tried = [
        one for one in _candidates(problem, search) if np.isfinite(one.fit.cost) and not one.strange and not one.bounded
    ]
    tests = [lack_of_fit(one.problem, one.fit.x) for one in tried]
    left = [one.reduced for one in tests]
    explained = [min((test.reduced - one) / (test.reduced - 1), 1.0) for one in left]
    chance = 1 + ALIKE * np.sqrt(2 / max(test.freedom, 2.0))  # of the ratio of two reduced χ²
    least = min((one for one in left if np.isfinite(one)), default=float("nan"))
    rows, most = zip(tried, tests, explained, strict=True), chance * max(least, 1.0)
    found = [
        _cause(one, share, rest) for one, rest, share in rows
        if share >= (NEARLY if one.kind == "length" and rest.misfit else ENOUGH) and rest.reduced <= most
    ]  # fmt: skip
    found = [one for one in found if one.kind == "sign" or abs(one.size) > one.expanded]
    if unused is not None:
        found = [one for one in found if one.kind != "shift" or not unused.refute(one.estimates, _ahead(problem, one))]
    return [one for one in found if not one.own] or found


def _ahead(problem: FitProblem, one: MisfitCause) -> Array:
    """By how much a shift says that the angle of each condition is ahead, rad."""
    found = np.full(len(problem.model.phases), 0.0 if one.own else one.size)
    for own in one.own:
        found[own.condition] = own.size
    return found


def _cause(one: _Refit, explains: float, left: Test) -> MisfitCause:
    """A candidate with its uncertainty."""
    spread = spread_of(one.problem, one.fit.x)
    half = quantile(spread.freedom) * np.sqrt(np.maximum(np.diagonal(spread.covariance), 0.0))
    count = one.problem.count - (one.kind == "length")
    own_half = half[count : count + 1] if one.kind == "length" else half[-len(one.sizes) :]
    wide = [float(row) for row in own_half * one.scale]
    k = int(np.argmax(np.abs(one.sizes)))
    own = tuple(map(OwnSize, one.conditions, one.sizes, wide))
    return MisfitCause(
        one.kind, one.channel, one.sizes[k], wide[k], explains, one.fit.x[:count], half[:count], left, own
    )


# ---- candidates, the simplest first ---------------------------------------------------------------------------


def _candidates(problem: FitProblem, search: Search) -> Iterator[_Refit]:
    """Fits with a wrong sign, an offset or a wrong gain of each channel, a shift of the angle, a delay, a length; then
    the same of each condition by itself."""
    start = np.concatenate([search.start, np.zeros(len(problem.sensors))])
    channels = list(dict.fromkeys(block.channel for block in problem.blocks if block.fitted))
    for channel in channels:
        yield from _turned(problem, start, channel)
    everywhere = tuple(dict.fromkeys(block.condition for block in problem.blocks if block.fitted))
    kinds = [(kind, channel) for kind in ("zero", "gain") for channel in channels]
    for kind, channel in kinds:
        yield from _sensor(problem, start, kind, channel)
    yield from _shifted(problem, start)
    yield from _late(problem, start)
    for length in likely_lengths(problem, search.fit.x):
        yield _length(problem, start, length)
    if len(everywhere) > 1:
        yield from _shifted(problem, start, everywhere)
        for kind, channel in kinds:
            yield from _sensor(problem, start, kind, channel, everywhere)


def _refit(problem: FitProblem, start: Array) -> LeastSquaresFit:
    """The fit of a problem from a start; of infinite cost where it has none."""
    problem.start_scatter()
    try:
        return refined(problem, inside(problem, start))[0]
    except ValueError:  # no answer of the model there
        return LeastSquaresFit(start, float("inf"), 0, converged=False)


def _with(problem: FitProblem, start: Array, extra: Sequence[SensorError]) -> tuple[FitProblem, LeastSquaresFit]:
    """The problem with some errors more, and its fit."""
    more = FitProblem(
        problem.model, problem.blocks, [*problem.sensors, *extra], problem.guard, progress=problem.progress
    )
    return more, _refit(more, np.append(start, np.zeros(len(extra))))


def _apart(problem: FitProblem, error: SensorError, conditions: Sequence[int]) -> list[SensorError]:
    """An error as each of the conditions has it by itself; as it is if none is named."""
    if not conditions:
        return [error]
    rows = [[size * (block.condition == k) for block, size in zip(problem.blocks, error.sizes, strict=True)]
            for k in conditions]  # fmt: skip
    return [
        replace(error, name=f"{error.name} in {k}", sizes=tuple(row)) for k, row in zip(conditions, rows, strict=True)
    ]


def _turned(problem: FitProblem, start: Array, channel: str) -> Iterator[_Refit]:
    """A channel with the other sign, where it runs against the model."""
    k = next(k for k, block in enumerate(problem.blocks) if block.channel == channel and block.fitted)
    if float(np.nansum(problem.blocks[k].mean * problem.said(start, k)[0])) >= 0:
        return
    blocks = [replace(one, turns=-one.turns, held=-one.held) if one.channel == channel else one
              for one in problem.blocks]  # fmt: skip
    other = FitProblem(problem.model, blocks, problem.sensors, problem.guard, progress=problem.progress)
    yield _Refit("sign", channel, other, _refit(other, start), (-1.0,), 0.0)


def _sensor(
    problem: FitProblem, start: Array, kind: str, channel: str, conditions: tuple[int, ...] = ()
) -> Iterator[_Refit]:
    """A zero or a gain of a channel, beyond what is stated of it; of each of the conditions named by itself."""
    if kind == "gain" and problem.model.measures[channel].turning(problem.model.run.system):
        return
    own = [block for block in problem.blocks if block.channel == channel]
    conditions = tuple(k for k in conditions if any(one.condition == k and one.fitted for one in own))
    size = 0.01 if kind == "gain" else 0.01 * float(np.sqrt(np.nanmean(np.concatenate(
        [np.ravel(block.turns) for block in own]) ** 2))) or 1.0  # fmt: skip
    sizes = tuple(size * (block.channel == channel) for block in problem.blocks)
    error = SensorError(f"{kind} of {channel}", channel, kind, sizes, stated=False, least=LEAST)
    extra = _apart(problem, error, conditions)
    more, found = _with(problem, start, extra)
    told = tuple(float(one) * size for one in found.x[-len(extra) :])
    yield _Refit(kind, channel, more, found, told, size, conditions)


def _of_course(block: Block) -> bool:
    return bool(block.turns.shape[1] > 2)


def _shifted(problem: FitProblem, start: Array, conditions: tuple[int, ...] = ()) -> Iterator[_Refit]:
    """An offset of the crank angle, the same in all conditions or of each named by itself; far ones from where a
    comparison sees them."""
    model = problem.model
    at = start[: problem.count]
    driven = [model.driven(k, at) for k in range(len(model.phases))]
    speeds = [driven[block.condition][2] for block in problem.blocks]
    if not np.isfinite(speeds).all() or not any(map(_of_course, problem.blocks)):
        return
    conditions = tuple(k for k in conditions if any(
        one.condition == k and one.fitted and _of_course(one) for one in problem.blocks))  # fmt: skip
    spans = np.array([last - first for first, last, _ in driven])
    sizes = tuple(-DEGREE / speed * _of_course(b) for b, speed in zip(problem.blocks, speeds, strict=True))
    extra = _apart(problem, SensorError("offset of the drive angle", "", "delay", sizes, stated=False), conditions)
    ahead = _begun(problem, start, spans, conditions)
    for _ in range(ROUNDS):
        phases = tuple((phase + a / span) % 1.0 for phase, a, span in zip(model.phases, ahead, spans, strict=True))
        moved = replace(problem, model=replace(model, phases=phases) if np.any(ahead) else model)
        more, found = _with(moved, start, extra)
        step = found.x[-len(extra) :] * DEGREE
        if not np.isfinite(found.cost) or np.any(np.abs(step) > np.pi):
            return
        if not model.run.cycle.periodic or np.all(np.abs(step) < SETTLED):
            break
        places = list(conditions) or list(range(len(ahead)))
        ahead[places] += step
        start = found.x[: -len(extra)]
    # what was not settled in so many rounds is in `ahead` already
    known = ahead[list(conditions)] if conditions else ahead[:1]
    told = known + np.where((np.abs(step) < SETTLED) | (known == 0), step, 0.0)
    yield _Refit("shift", "", more, found, tuple(map(float, told)), DEGREE, conditions)


def _begun(problem: FitProblem, start: Array, spans: Array, conditions: Sequence[int]) -> Array:
    """Where the search for an offset of the angle begins, rad, by condition."""
    found = np.zeros(len(spans))
    if not problem.model.run.cycle.periodic:
        return found
    if not conditions:
        return found + _seen(problem, start, spans)
    for k in conditions:
        found[k] = _seen(problem, start, spans, k)
    return found


def _seen(problem: FitProblem, start: Array, spans: Array, condition: int | None = None) -> float:
    """The shift, rad, that a comparison with the model at the start sees in a condition of a channel, the first unless
    told; 0 of one that the fit finds by itself."""
    seen: list[Cause] = []
    for channel in dict.fromkeys(block.channel for block in problem.blocks):
        own = (k for k, one in enumerate(problem.blocks) if one.channel == channel and one.fitted)
        k = next((k for k in own if condition in (None, problem.blocks[k].condition)), None)
        if k is None:
            continue
        measured, theirs = problem.blocks[k].mean, problem.said(start, k)[0]
        if np.size(theirs) != len(problem.model.phases[problem.blocks[k].condition]):
            continue
        phase, span = problem.model.phases[problem.blocks[k].condition], spans[problem.blocks[k].condition]
        there = np.isfinite(measured) & np.isfinite(theirs)
        turning = problem.model.measures[channel].turning(problem.model.run.system)
        found = causes(measured[there], theirs[there], phase[there], closed=True, turning=turning)
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
    more, found = _with(problem, start, [SensorError("delay of all channels", "", "delay", sizes, stated=False)])
    yield _Refit("delay", "", more, found, (float(found.x[-1]) * MILLISECOND,), MILLISECOND)


def _length(problem: FitProblem, start: Array, length: Unknown) -> _Refit:
    """A length of the model, as one unknown more."""
    n = problem.count
    model = replace(problem.model, unknowns=(*problem.model.unknowns, length))
    more = FitProblem(model, problem.blocks, problem.sensors, problem.guard, progress=problem.progress)
    found = _refit(more, np.insert(start, n, length.start))
    return _Refit("length", length.name, more, found, (float(found.x[n]) - length.start,), 1.0)
