"""Least cost that keeps a yield: the margin z of all rows, first for normal deviations, then as sampled.

The yield of all rows together, linearly and with normal deviations, is a normal probability of a polytope. With the
deviations in polar form its radius is integrated exactly (chi distribution) and its direction by a Sobol sequence
(I. Deák, Three digit accurate multiple normal probabilities, Numerische Mathematik 35 (1980) 369–380). Rows of one
measure at neighbouring positions fail together, so this is far closer than the sum of their failures (Bonferroni),
which bounds z from above. The margin found is then corrected until the yield that the caller samples meets the target.
What is cheapest of several is favoured by the samples that chose it, so other samples check it, and if they miss the
target beyond their interval the margin is raised and it is tried again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import chdtr, ndtr, ndtri

from trunnion.results.sentences import finding_for
from trunnion.statistics.streams import SobolStream, factor
from trunnion.studies.allocation.problem import AllocationProblem, Answer, SampledYield, Trial
from trunnion.studies.allocation.splits import split

__all__ = ["Check", "Verify", "meet", "normal_yield"]

Array = NDArray[np.float64]
Verify = Callable[[Array], tuple[float, float, float]]
Check = Callable[[Array, int], tuple[float, float, float]]
DIRECTIONS = 2048
ROWS = 128  # worked on at once
FAR = 6.0  # standard deviations: a row with more room than that never fails
TRIALS = 12
HIGHEST = 8.0  # standard score, and z, that is looked at
CHECKS = 4  # by fresh samples, each with a margin that the one before has raised
STEP = 1.0  # of z, at most, after one sampling
CLOSE = 1e-3  # of z: two choices of processes that lie closer are neighbours
NEAR = 1e-6  # of z: how close splits of the margins are settled
AROUND = 0.1  # of z: how far a split of the margins moves their mean
SURE = 1e-9  # of the target, in standard scores


def normal_yield(problem: AllocationProblem, tolerances: Array) -> float:
    """Share of mechanisms within all limits, for normal deviations and linear rows.

    The row that fails most is reckoned exactly, and the directions only say what the others add to it.
    """
    sigma, room = _spread_and_room(problem, tolerances)
    each = np.sqrt(np.sum(sigma**2, axis=1))
    still = each == 0
    if np.any(room[:, still] < 0):
        return 0.0
    rows = np.flatnonzero((np.min(room, axis=0) < FAR * each) & ~still)
    parts = np.flatnonzero(np.any(sigma[rows] != 0, axis=0))
    if not len(rows):
        return 1.0
    fails = np.sum(ndtr(-room[:, rows] / each[rows]), axis=0)
    worst = int(np.argmax(fails))
    within = _within(sigma[np.ix_(rows, parts)], room[:, rows])
    alone = _within(sigma[np.ix_(rows[worst : worst + 1], parts)], room[:, rows[worst : worst + 1]])
    return float(np.clip(1 - fails[worst] + within - alone, 0.0, 1.0))


def _spread_and_room(problem: AllocationProblem, tolerances: Array) -> tuple[Array, Array]:
    """Deviation of each row by independent numbers (row, part), and its room to both sides (side, row)."""
    effects = problem.effects
    sigma = effects.sigma() * tolerances
    if effects.correlation is not None:
        sigma = sigma @ factor(effects.correlation)
    middle = effects.middle() + effects.drift() @ tolerances
    return sigma, np.stack([effects.upper - middle, middle - effects.lower])


def _plain_yield(problem: AllocationProblem, tolerances: Array) -> float:
    """The yield by the directions alone: less exact, but it changes steadily with the rooms."""
    sigma, room = _spread_and_room(problem, tolerances)
    parts = np.flatnonzero(np.any(sigma != 0, axis=0))
    return _within(sigma[:, parts], room) if len(parts) else 1.0


def _within(sigma: Array, room: Array) -> float:
    """Share of the directions' rays that lies within all rows: sigma (row, part), room (side, row)."""
    dims = sigma.shape[1]
    directions = _directions(dims)
    first, last = np.zeros(directions.shape[1]), np.full(directions.shape[1], np.inf)
    for start in range(0, len(sigma), ROWS):
        part = slice(start, start + ROWS)
        along = sigma[part] @ directions
        for slope, free in ((along, room[0, part, None]), (-along, room[1, part, None])):
            with np.errstate(divide="ignore", invalid="ignore"):
                radius = free / slope
            last = np.minimum(last, np.min(np.where(slope > 0, radius, np.inf), axis=0))
            if np.any(free < 0):
                first = np.maximum(first, np.max(np.where(slope < 0, radius, -np.inf), axis=0))
    inside = chdtr(dims, np.maximum(last, 0.0) ** 2) - chdtr(dims, first**2)
    return float(np.mean(np.where(last > first, inside, 0.0)))


@lru_cache(maxsize=8)
def _directions(dims: int) -> Array:
    """Unit vectors, each with its opposite, (component, direction)."""
    if dims == 1:
        return np.array([[1.0, -1.0]])
    points = ndtri(SobolStream(seed=0, replicate=0, dims=dims).points(0, DIRECTIONS // 2))
    points = points / np.sqrt(np.sum(points**2, axis=0))
    return np.concatenate([points, -points], axis=1)


def meet(
    problem: AllocationProblem,
    target: float,
    solve: Callable[[AllocationProblem], Answer],
    verify: Verify | None = None,
    check: Check | None = None,
) -> Answer:
    """The allocation of least cost whose yield meets the target.

    solve: of a problem with z given; verify: half widths (contribution,) → yield, and its interval, low and high;
    check: the same of other samples, with the number of their stream, from 1.
    """
    first = _expected(problem, target, solve)
    if not first.found:
        return first if verify is None else _beyond_normal(first, target, solve, verify, check)
    best = first
    if not first.findings and (problem.ratios is None or np.all(problem.ratios > 0)):
        best = split(first, lambda one: _expected(one, target, solve, AROUND), _plain_yield)
    answer = best if verify is None else _sampled(best, target, solve, verify, check)
    saved = 1 - best.cost / first.cost if best is not first else np.nan
    return replace(answer, saved=saved, excess=best.cost / first.floor - 1 if first.floor > 0 else np.nan)


def _expected(
    problem: AllocationProblem, target: float, solve: Callable[[AllocationProblem], Answer], around: float = np.inf
) -> Answer:
    """The cheapest allocation that meets the target for normal deviations, the margins being in the stated ratios.

    around: how far from the z of the problem it is looked for, before it is looked for everywhere.
    """
    tried: list[Answer] = []

    def over(z: float) -> float:
        answer = solve(replace(problem, z=z))
        if not answer.found:
            return HIGHEST
        answer = replace(answer, expected=normal_yield(problem, answer.tolerances))
        tried.append(answer)
        return _score(answer.expected) - _score(target)

    rows, ratios = len(problem.effects.worst), np.ones(1) if problem.ratios is None else problem.ratios
    least, most = float(ndtri(target)) - 1e-3, float(ndtri(1 - (1 - target) / (2 * rows))) + 1e-3
    if not np.all(ratios > 0):  # rows that samples alone decide over: what they fail is no matter of the margin
        ratios, most = np.where(ratios > 0, ratios, 1.0), HIGHEST
    ends = (max(least, 1e-3) / float(np.max(ratios)), most / float(np.min(ratios)))
    near = (max(ends[0], problem.z - around), min(ends[1], problem.z + around))
    for low, high in dict.fromkeys((near, ends)):
        if over(low) < 0 and over(high) > 0:
            brentq(over, low, high, xtol=1e-9 if around == np.inf else NEAR, rtol=1e-12)
            break
    if not tried:
        return solve(replace(problem, z=ends[0]))
    floor = tried[0].bound if problem.ratios is None and least > 0 else np.nan
    enough = [one for one in tried if _score(one.expected) >= _score(target) - SURE * 10]
    if enough:
        return replace(min(enough, key=lambda one: one.cost), floor=floor)
    best = max(tried, key=lambda one: one.expected)
    doubt = finding_for("yield.narrowest", "yield", share=best.expected, target=target)
    return replace(best, findings=(*best.findings, doubt))


def _beyond_normal(
    first: Answer,
    target: float,
    solve: Callable[[AllocationProblem], Answer],
    verify: Verify,
    check: Check | None,
) -> Answer:
    """Where no half widths keep the limits for normal deviations: those that samples keep, as without tails they may.

    The measures that are short get a smaller margin, however large that of the others: first none, then more.
    `first` if no such allocation meets the target with samples.
    """
    short = {one.where for one in first.findings}
    own = np.array([first.problem.effects.label(row) in short for row in range(len(first.problem.effects.worst))])

    def capped(problem: AllocationProblem, most: float) -> Answer:
        return solve(replace(problem, ratios=np.where(own, np.minimum(most / problem.z, 1.0), 1.0)))

    low, high = 0.0, first.problem.z
    while own.any() and high - low > CLOSE:
        middle = (low + high) / 2
        low, high = (middle, high) if capped(first.problem, middle).found else (low, middle)
    for more in (
        (STEP, STEP / 2) if low > 0 else ()
    ):  # where the least half widths miss it, there is nothing to look for
        least = capped(replace(first.problem, z=first.problem.z + more), low)
        if least.found:
            if SampledYield(*verify(least.tolerances)).high < target:
                return first
            break
    for most in (0.0, low / 2, low) if low > 0 else ():
        best = capped(first.problem, most)
        if not best.found:
            continue
        best = replace(best, expected=normal_yield(best.problem, best.tolerances))
        found = _sampled(best, target, partial(capped, most=most), verify, check)
        if not found.findings and _share_of(found.sampled) >= target:
            note = finding_for(
                "yield.not_normal", "yield", measures=sorted(name.removeprefix("measures.") for name in short),
                share=_share_of(found.sampled), normal=found.expected,
            )  # fmt: skip
            return replace(found, findings=(note,))
    return first


def _sampled(
    answer: Answer,
    target: float,
    solve: Callable[[AllocationProblem], Answer],
    verify: Verify,
    check: Check | None,
) -> Answer:
    """The same with the margin corrected by what is sampled, until the samples meet the target, and fresh ones too."""
    low, high = 0.0, np.inf
    z, problem = answer.problem.z, answer.problem
    goal, checks = _score(target), 0
    seen: dict[bytes, Answer] = {}
    trials: list[Trial] = []
    while len(trials) < TRIALS:
        if answer.found:
            key = np.round(answer.tolerances, 15).tobytes()
            known = seen.get(key, answer)
            sampled = known.sampled or SampledYield(*verify(answer.tolerances))
            seen[key] = answer = replace(answer, sampled=sampled, checked=known.checked)
            trials.append(Trial(z, answer.cost, sampled))
            short = _score(sampled.share) < goal
            if not short and _score(sampled.low) <= goal:
                if check is None or checks == CHECKS:
                    break
                checks += 1
                seen[key] = answer = _checked(answer, check, checks)
                if _holds(answer, target):
                    break
                # the fresh samples are the ones without a bias: as much more of the others as those are short of
                goal = _score(sampled.share) + max(_score(target) - _score(_share_of(answer.checked)), 0.0)
                short = True
            step = _correction(trials, goal + _half(sampled, target))
        else:
            short, step = False, np.nan
        low, high = (z, high) if short else (low, z)
        if high - low < CLOSE:
            break
        z = z + step
        if not low < z < high:
            z = (low + high) / 2 if np.isfinite(high) else low + STEP
        answer = solve(replace(problem, z=z))
        if answer.found:
            answer = replace(answer, expected=normal_yield(problem, answer.tolerances))
    return replace(_chosen(list(seen.values()), target, check, checks), trials=tuple(trials))


def _chosen(seen: list[Answer], target: float, check: Check | None, checks: int) -> Answer:
    """The cheapest of those sampled that meets the target, by fresh samples too; or the best, with what it misses."""
    known: list[Answer] = []
    for one in sorted((one for one in seen if _share_of(one.sampled) >= target), key=lambda one: one.cost):
        best = one
        if check is not None and one.checked is None:
            checks += 1
            best = _checked(one, check, checks)
        if _holds(best, target):
            return best
        known.append(best)
    if known:
        best = max(known, key=lambda one: _share_of(one.checked))
        checked = best.checked or SampledYield(np.nan, np.nan, np.nan)
        figures = {**checked._asdict(), "target": target, "chosen": _share_of(best.sampled)}
        code = "yield.check_uncertain" if checked.high >= target else "yield.check_missed"
        return replace(best, findings=(*best.findings, finding_for(code, "yield", **figures)))
    best = max(seen, key=lambda one: _share_of(one.sampled))
    if best.sampled is not None and best.sampled.high >= target:
        return best
    doubt = finding_for("yield.best", "yield", share=_share_of(best.sampled), target=target)
    return replace(best, findings=(*best.findings, doubt))


def _checked(answer: Answer, check: Check, stream: int) -> Answer:
    return replace(answer, checked=SampledYield(*check(answer.tolerances, stream)))


def _holds(answer: Answer, target: float) -> bool:
    """Whether both samples together meet the target, and those that check do not speak against it."""
    if answer.checked is None:
        return True
    return answer.checked.high >= target and (_share_of(answer.sampled) + answer.checked.share) / 2 >= target


def _share_of(sampled: SampledYield | None) -> float:
    return sampled.share if sampled else 0.0


def _half(sampled: SampledYield, target: float) -> float:
    """What to aim above the target by, in standard scores: half of the interval, so as to be above it next."""
    return (_score(target) - _score(target - (sampled.share - sampled.low))) / 2


def _correction(trials: list[Trial], goal: float) -> float:
    """Change of z by the line through the last two trials, or from 0 through the one: scores are nearly linear in z."""
    z, score = trials[-1].z, _score(trials[-1].sampled.share)
    z0, score0 = (trials[-2].z, _score(trials[-2].sampled.share)) if len(trials) > 1 else (0.0, 0.0)
    rise = (score - score0) / (z - z0) if z != z0 else 1.0
    return float(np.clip((goal - score) / max(rise, 0.1), -STEP, STEP))


def _score(share: float) -> float:
    """The standard score whose symmetric range has this probability, within ±8."""
    return float(ndtri((1 + min(max(share, 0.0), 1 - 1e-12)) / 2))
