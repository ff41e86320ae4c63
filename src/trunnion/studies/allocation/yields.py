"""Least cost that keeps a yield: one margin of all limits, in standard deviations, found by bisection.

With a margin z of every limit the cheapest half widths are a convex or a mixed-integer problem. What share of
mechanisms they keep within all limits rises with z, as it is counted on the same samples each time; without samples
it is that of normal deviations and linear rows. Samples that chose flatter what they chose, so fresh ones check it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import chdtr, ndtr, ndtri

from trunnion.errors import Finding, Severity
from trunnion.statistics.distributions import factor, sobol
from trunnion.studies.allocation.problem import AllocationProblem, Answer, SampledYield
from trunnion.studies.allocation.solve import cheapest

Array = NDArray[np.float64]
Verify = Callable[[Array, int], SampledYield]
DIRECTIONS = 2048
ROWS = 128  # rows that are multiplied by all directions at once
FAR = 6.0  # standard deviations: a row with more room than that never fails
LEAST, MOST = 0.05, 8.0  # standard deviations: margins that are looked at
NEAR = 0.25  # standard deviations: how far normal deviations are usually off
CLOSE, CLOSE_SAMPLED = 1e-7, 1e-2  # standard deviations: where the bisection ends, by normal deviations and samples
CHECKS = 4  # by fresh samples, each with a margin that the one before has raised
RAISED = 1e-3  # in standard scores: how much more is asked at least after fresh samples have missed the target
ROUNDING = 1e-9  # of a yield and of its standard score
UNKNOWN = SampledYield(np.nan, np.nan, np.nan)


def meet(problem: AllocationProblem, target: float, verify: Verify | None = None, sure: bool = False) -> Answer:
    """The allocation of least cost whose yield meets a target.

    Parameters
    ----------
    problem : its margin z is replaced
    target : share of mechanisms within all limits
    verify : the sampled yield of half widths (contribution,), from samples of a number: 0 for those that choose,
        1, 2, … for fresh ones; without it the yield is that of normal deviations and linear rows
    sure : whether the lower end of the interval of the fresh samples has to meet the target, and not only not miss it

    Returns
    -------
    The answer, with a finding `yield.missed` where no margin meets the target or fresh samples speak against it.
    """
    # the margin that each row can have at most, with the narrowest half widths: of a measure the least
    sigma, room = _spread_and_room(problem, problem.narrowest())
    deviation = np.sqrt(np.sum(sigma**2, axis=1))
    with np.errstate(divide="ignore", invalid="ignore"):
        caps = np.where(deviation > 0, np.min(room, axis=0) / deviation, np.inf)
    labels = np.array(problem.effects.labels or [""] * len(caps))
    for label in set(labels.tolist()):
        caps[labels == label] = np.min(caps[labels == label])
    problem = replace(problem, caps=np.maximum(caps, LEAST))

    def normal(tolerances: Array) -> SampledYield:
        share = normal_yield(problem, tolerances)
        return SampledYield(share, share, share)

    linear = _Margins(problem, normal)
    steps = any(contribution.options for contribution in problem.contributions)  # where the yield is no steady one
    answer = linear.cheapest(target, _score(target), CLOSE_SAMPLED if steps else CLOSE)
    if not answer.found:
        return answer
    if verify is None:
        reckoned = answer.sampled or UNKNOWN
        return _judged(replace(answer, sampled=None), target, reckoned, sure)
    chosen = _Margins(problem, lambda tolerances: verify(tolerances, 0), sure)
    goal = target
    for number in range(1, CHECKS + 1):
        answer = chosen.cheapest(goal, answer.problem.z, CLOSE_SAMPLED)
        sampled = answer.sampled or UNKNOWN
        if chosen.level(sampled) < target:  # whatever the margin
            return _judged(answer, target, sampled, sure)
        checked = verify(answer.tolerances, number)
        answer = replace(answer, checked=checked)
        level = checked.low if sure else checked.high
        if level >= target:
            break
        goal = _share(_score(chosen.level(sampled)) + max(_score(target) - _score(level), RAISED))
    return _judged(answer, target, checked, sure)


def _judged(answer: Answer, target: float, sampled: SampledYield, sure: bool) -> Answer:
    """The same with a finding if a yield misses the target: a note if that may be chance, its interval having it."""
    if (sampled.low if sure else sampled.share) >= target - ROUNDING:
        return answer
    severity = Severity.ERROR if sure or sampled.high < target else Severity.NOTE
    interval = f" (95 % interval {sampled.low:.6g} to {sampled.high:.6g})" if sampled.low < sampled.high else ""
    what = f"the yield found is {sampled.share:.6g}{interval}, the required one {target:g}"
    remedy = "take more samples; --sure (in Python sure=True) asks the lower end of the interval to meet it"
    if sampled.high < target:
        remedy = "allow narrower tolerances, widen a limit or ask for a lower yield"
    figures = {**sampled._asdict(), "target": target}
    missed = Finding.weighed(severity, "yield.missed", "yield", what, remedy, **figures)
    return replace(answer, findings=(missed,) if severity is Severity.ERROR else (*answer.findings, missed))


@dataclass
class _Margins:
    """Answers by their margin, each with its yield. sure: whether the lower end of its interval counts."""

    problem: AllocationProblem
    judge: Callable[[Array], SampledYield]
    sure: bool = False
    answers: dict[float, Answer] = field(default_factory=dict)
    yields: dict[bytes, SampledYield] = field(default_factory=dict)

    def level(self, sampled: SampledYield) -> float:
        """What of a yield has to meet the target."""
        return sampled.low if self.sure else sampled.share

    def cheapest(self, goal: float, start: float, close: float) -> Answer:
        """The cheapest answer with a yield, its margin being looked for around a start; else that of most yield."""

        def excess(z: float) -> float:
            answer = self.at(z)
            return MOST if answer.sampled is None else _score(self.level(answer.sampled)) - _score(goal)

        low = max((z for z in self.answers if excess(z) < 0), default=max(start - NEAR, LEAST))
        above = (z for z in self.answers if z > low and excess(z) >= 0)
        high, step = min(above, default=min(max(low, start) + NEAR, MOST)), NEAR
        while low > LEAST and excess(low) >= 0:
            low, high, step = max(low - step, LEAST), low, 2 * step
        while high < MOST and excess(high) < 0:
            low, high, step = high, min(high + step, MOST), 2 * step
        if excess(low) < 0 <= excess(high):
            brentq(excess, low, high, xtol=close)
        feasible = [answer for answer in self.answers.values() if answer.found]
        if not feasible:
            return self.at(low)
        levels = [self.level(answer.sampled or UNKNOWN) for answer in feasible]
        enough = [answer for answer, level in zip(feasible, levels, strict=True)
                  if _score(level) >= _score(goal) - ROUNDING]  # fmt: skip
        return min(enough, key=lambda each: each.cost) if enough else feasible[int(np.argmax(levels))]

    def at(self, z: float) -> Answer:
        """The cheapest answer with a margin, and its yield."""
        if z not in self.answers:
            answer = cheapest(replace(self.problem, z=z))
            if answer.found:
                key = np.round(answer.tolerances, 15).tobytes()
                if key not in self.yields:
                    self.yields[key] = self.judge(answer.tolerances)
                expected = normal_yield(self.problem, answer.tolerances)
                answer = replace(answer, expected=expected, sampled=self.yields[key])
            self.answers[z] = answer
        return self.answers[z]


def _spread_and_room(problem: AllocationProblem, tolerances: Array) -> tuple[Array, Array]:
    """Deviation of each row by independent numbers (row, part), and its room to both sides (side, row)."""
    effects = problem.effects
    sigma = effects.spread * tolerances
    if effects.correlation is not None:
        sigma = sigma @ factor(effects.correlation)
    middle = effects.offset + effects.drift @ tolerances
    return sigma, np.stack([effects.upper - middle, middle - effects.lower])


def normal_yield(problem: AllocationProblem, tolerances: Array) -> float:
    """Share of mechanisms within all limits, for normal deviations and linear rows.

    The row of each measure that fails most is reckoned exactly. With the deviations in polar form, their radius
    integrated exactly (chi distribution) and their direction by a Sobol sequence, follows what the others add
    (I. Deák, Three digit accurate multiple normal probabilities, Numerische Mathematik 35 (1980) 369–380).
    """
    sigma, room = _spread_and_room(problem, tolerances)
    deviation = np.sqrt(np.sum(sigma**2, axis=1))
    if np.any(room[:, deviation == 0] < 0):
        return 0.0
    rows = np.flatnonzero((np.min(room, axis=0) < FAR * deviation) & (deviation > 0))
    if not len(rows):
        return 1.0
    sigma, room = sigma[np.ix_(rows, np.any(sigma[rows] != 0, axis=0))], room[:, rows]
    fails = np.sum(ndtr(-room / deviation[rows]), axis=0)
    share = _within(sigma, room)
    labels = np.array(problem.effects.labels or [""] * len(deviation))[rows]
    for label in dict.fromkeys(labels.tolist()):
        worst = max(np.flatnonzero(labels == label), key=lambda row: fails[row])
        share += 1 - fails[worst] - _within(sigma[[worst]], room[:, [worst]])
    return float(np.clip(share, 0.0, 1.0))


def _within(sigma: Array, room: Array) -> float:
    """Share of normal numbers that rows keep within their room, by directions: sigma (row, part), room (side, row)."""
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
    points = ndtri(sobol(0, 0, dims, 0, DIRECTIONS // 2))
    points = points / np.sqrt(np.sum(points**2, axis=0))
    return np.concatenate([points, -points], axis=1)


def _score(share: float) -> float:
    """The standard score whose symmetric range has this probability, within ±8."""
    return float(ndtri((1 + min(max(share, 0.0), 1 - 1e-12)) / 2))


def _share(score: float) -> float:
    """The probability of the symmetric range of a standard score."""
    return float(chdtr(1, score**2))
