"""From the start to the estimates: where the model has an answer, several starts, what is used, how much it weighs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Status
from trunnion.rig.identification.fit import FitProblem, LeastSquaresFit, fit
from trunnion.rig.identification.identifiability import sizes_of
from trunnion.rig.identification.uncertainty import correlation_factors, lack_of_fit

__all__ = ["Search", "inside", "refined", "refuse_unusable", "search"]

Array = NDArray[np.float64]
HALVINGS = 8
ROUNDS = 4  # of what is used and how much it weighs
INSIDE = 0.05  # of the size of an unknown: how far from its limit a search begins
OTHERS = (0.3, 3.0)  # times the start: where else a search begins if the model does not fit
CLOSE = 1e-3  # of the sizes: two searches ended at one place
AS_GOOD = 4.0  # sum of squares: another place is told if it is not worse by more
COURSE = 1e-3  # of the largest value: what the model must change by over the cycle to have a course


@dataclass(frozen=True)
class Search:
    """How the search went.

    start: (unknown,), with less friction than stated where that locks; fit: where it ended; starts: how many; other:
    another place that fits as well.
    """

    start: Array
    fit: LeastSquaresFit
    starts: int
    other: Array | None
    settled: bool


def search(problem: FitProblem, starts: int | None) -> Search:
    """The estimates. starts: how many places to begin at; 1, and more if the model does not fit, if not given."""
    problem.start_scatter()
    first = _runnable(problem)
    best, settled = refined(problem, inside(problem, first))
    count, other = 1, None
    wanted = len(OTHERS) if starts is None else max(0, starts - 1)
    if starts is None and best.converged and not lack_of_fit(problem, best.x).misfit:
        wanted = 0
    kept = problem.masks, problem.variances, problem.factors
    for place in _others(problem, first, wanted):
        count += 1
        problem.masks, problem.variances, problem.factors = kept
        found = _tried(problem, place)
        if found is None or not found.converged:
            continue
        sizes = sizes_of(problem, best.x)
        away = float(np.max(np.abs(found.x - best.x)[: problem.count] / sizes[: problem.count]))
        if found.cost < best.cost * (1 - 1e-6) - 1e-6 and away > CLOSE:
            worse, (best, settled) = best, refined(problem, found.x)
            kept = problem.masks, problem.variances, problem.factors
            other = worse.x if worse.cost < best.cost + AS_GOOD else None
        elif away > CLOSE and found.cost < best.cost + AS_GOOD:
            other = found.x
    problem.masks, problem.variances, problem.factors = kept
    return Search(first[: problem.count], best, count, other, settled)


def _runnable(problem: FitProblem) -> Array:
    """The start, with less friction where that locks. MechanismError if nothing runs."""
    start = np.array([one.start for one in problem.model.unknowns] + [0.0] * len(problem.sensors))
    rubs = np.array([any(".friction." in path for path in one.paths) for one in problem.model.unknowns], bool)
    low = np.array([one.lower for one in problem.model.unknowns])
    lost, best = problem.unanswered(start), start
    for k in range(1, HALVINGS + 1):
        if not lost or not np.any(rubs):
            break
        less = start.copy()
        less[: problem.count][rubs] = np.maximum(start[: problem.count][rubs] * 0.5**k, low[rubs])
        found = problem.unanswered(less)
        if found < lost:
            lost, best = found, less
    refuse_unusable(problem, best)
    return best


def inside(problem: FitProblem, start: Array) -> Array:
    """A start that is not on a limit: there a search would not get off."""
    problem.masks = problem.allowed(start)
    sizes = sizes_of(problem, start)
    low, high = problem.bounds
    room = np.minimum(INSIDE * sizes, 0.25 * (high - low))
    return np.asarray(np.clip(start, low + room, high - room))


def refined(problem: FitProblem, start: Array) -> tuple[LeastSquaresFit, bool]:
    """A fit whose weights and used positions are those of where it ends; whether they came to rest."""
    problem.masks, problem.factors = problem.allowed(start), {}
    found = fit(problem, start)
    for _ in range(ROUNDS):
        again = problem.learn_scatter(found.x)
        factors = correlation_factors(problem, found.x)
        masks = problem.allowed(found.x)
        same = all(np.array_equal(a, b) for a, b in zip(masks, problem.masks, strict=True))
        near = all(abs(factors[name] / problem.factors.get(name, 1.0) - 1) < 0.05 for name in factors)
        if same and near and not again:
            return found, True
        before = found
        problem.masks, problem.factors = masks, factors
        found = replace(fit(problem, found.x), evaluations=before.evaluations)
        if again and same and np.allclose(found.x, before.x, rtol=1e-6, atol=1e-12):
            return found, True
    return found, False


def _others(problem: FitProblem, first: Array, wanted: int) -> list[Array]:
    """Other places to begin at: the start times and divided by 3, then at random between a tenth and ten times."""
    low, high = problem.bounds
    found = []
    random = np.random.default_rng(1)
    for k in range(wanted):
        factors = np.full(problem.count, OTHERS[k]) if k < len(OTHERS) else 10 ** random.uniform(-1, 1, problem.count)
        place = first.copy()
        place[: problem.count] *= factors
        found.append(inside(problem, np.clip(place, low, high)))
    return found


def _tried(problem: FitProblem, place: Array) -> LeastSquaresFit | None:
    """A fit from a place; None if the model has no answer there."""
    kept = problem.masks
    problem.masks = problem.allowed(place)
    if not np.all(np.isfinite(problem.residuals(place))) or not any(map(np.any, problem.masks)):
        problem.masks = kept
        return None
    problem.masks = kept
    if not np.all(np.isfinite(problem.residuals(place))):
        return None
    return fit(problem, place)


def refuse_unusable(problem: FitProblem, start: Array) -> None:
    """MechanismError where no position can be used, or a channel is dead."""
    findings = list(_dead(problem, start)) or list(_unusable(problem, start))
    if findings:
        raise MechanismError(findings)


def _any(problem: FitProblem, start: Array) -> bool:
    pairs = zip(problem.blocks, problem.allowed(start), strict=True)
    return any(bool(np.any(mask)) for block, mask in pairs if block.fitted)


def _unusable(problem: FitProblem, start: Array) -> Iterator[Finding]:
    """Why no position is used, if none is."""
    if _any(problem, start):
        return
    if not any(np.any(np.isfinite(block.mean)) for block in problem.blocks if block.fitted):
        what = "no channel has a value at any position"
        yield Finding(what, "data", "check the gaps and columns with `trunnion data`")
        return
    bare = replace(problem, guard=0)
    if _any(bare, start):
        what = "all positions are left out: each is next to a friction reversal"
        yield Finding(what, "guard", "give a smaller guard, or resample to more positions")
        return
    codes = np.concatenate([np.asarray(one) for one in problem.courses(start).status])
    worst = list(Status)[int(np.bincount(codes).argmax())]
    if worst < Status.NOT_CONVERGED:
        what = "no position of the data has a sound answer of the model: a mechanism stands or is near singular there"
        yield Finding(what, "data", "measure at more positions")
        return
    what = f"no position of the data has an answer of the model: {worst.text}"
    yield Finding(what, "start", "give start values with which the model has a solution, see `trunnion analyse`")


def _dead(problem: FitProblem, start: Array) -> Iterator[Finding]:
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
        remedy = "check the sensor, its column and its gain, or name the other channels"
        yield Finding(what, f"channel {channel}", remedy)
