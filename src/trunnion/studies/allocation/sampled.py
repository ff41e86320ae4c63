"""An allocation corrected by samples until these have the yield, and fresh ones too.

What is cheapest of several is favoured by the samples that chose it, so other samples check it, and if they miss the
target beyond their interval the margin is raised and it is tried again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from trunnion.results.sentences import finding_for
from trunnion.studies.allocation.normal import normal_yield
from trunnion.studies.allocation.problem import FAR, AllocationProblem, Answer, SampledYield, Trial

__all__ = ["HIGHEST", "Check", "Samples", "Verify", "corrected", "furthest", "score"]

Array = NDArray[np.float64]
Verify = Callable[[Array], tuple[float, float, float]]
Check = Callable[[Array, int], tuple[float, float, float]]
TRIALS = 12
HIGHEST = 8.0  # standard score that is looked at
CHECKS = 4  # by fresh samples, each with a margin that the one before has raised
STEP = 1.0  # of z, at most, after one sampling
WORTH = 0.02  # of the cost: a saving that is worth one more sampling
LEAST = 1e-3  # in standard scores: how much more is asked at least after fresh samples have missed the target
AIMS = {"share": 0.25, "high": -0.75}  # of half an interval: where the share is aimed at
CLOSE = 1e-3  # of z: two choices of processes that lie closer are neighbours


@dataclass(frozen=True)
class Samples:
    """How half widths are judged, see `meet`.

    reserve: the narrowest half widths as an allocation, taken where all others miss; None without such. by: what of a
    sampled yield has to meet the target: its share, or the upper end of its interval where first order says that the
    target can be met, but too closely for samples to tell.
    """

    target: float
    solve: Callable[[AllocationProblem], Answer]
    verify: Verify
    check: Check | None
    reserve: Answer | None
    by: Literal["share", "high"] = "share"

    def level(self, sampled: SampledYield | None) -> float:
        """What of a sampled yield has to meet the target."""
        return float(getattr(sampled, self.by)) if sampled else 0.0

    def verified(self, answer: Answer) -> Answer:
        """The same with what the samples that choose have."""
        if answer.sampled:
            return answer
        expected = normal_yield(answer.problem, answer.tolerances)
        return replace(answer, expected=expected, sampled=SampledYield(*self.verify(answer.tolerances)))

    def checked(self, answer: Answer, stream: int) -> Answer:
        """The same with what fresh samples have, if there are such."""
        if self.check is None or answer.checked:
            return answer
        return replace(answer, checked=SampledYield(*self.check(answer.tolerances, stream)))

    def holds(self, answer: Answer) -> bool:
        """Whether the samples meet the target: both together, and those that check do not speak against it.

        By an end of the interval each of them has to meet it with that end.
        """
        checked, sampled = answer.checked, answer.sampled
        if checked is None or sampled is None:
            return self.level(sampled) >= self.target
        if self.by != "share":
            return min(self.level(sampled), self.level(checked)) >= self.target
        return checked.high >= self.target and (sampled.share + checked.share) / 2 >= self.target


def corrected(answer: Answer, samples: Samples) -> Answer:
    """The same with the margin corrected by what is sampled, until the samples meet the target, and fresh ones too.

    The margin is looked for between the widest that falls short and the narrowest that does not, until what the next
    one would save is too little for one more sampling.
    """
    z, problem, target = answer.problem.z, answer.problem, samples.target
    end = np.inf if problem.caps is None else furthest(problem)
    goal, checks, refused = score(target), 0, np.inf
    seen: dict[bytes, Answer] = {}
    trials: list[Trial] = []
    while len(trials) < TRIALS:
        if not answer.found:
            refused = z
        else:
            key = np.round(answer.tolerances, 15).tobytes()
            known = samples.verified(seen.get(key, answer))
            sampled = known.sampled or SampledYield(0.0, 0.0, 0.0)
            seen[key] = answer = replace(answer, sampled=sampled, checked=known.checked, expected=known.expected)
            trials.append(Trial(z, answer.cost, sampled))
        after = _next(trials, goal, samples, (refused, end))
        ahead = None if after is None else samples.solve(replace(problem, z=after))
        if answer.found and _enough(sampled, goal, samples) and not _cheaper(ahead, answer):
            if samples.check is None or checks == CHECKS:
                break
            checks += 1
            seen[key] = answer = samples.checked(answer, checks)
            if samples.holds(answer):
                break
            # the fresh samples are the ones without a bias: as much more of the others as those are short of
            missed = max(score(target) - score(samples.level(answer.checked)), LEAST)
            goal = score(samples.level(sampled)) + missed
            after = _next(trials, goal, samples, (refused, end))
            ahead = None if after is None else samples.solve(replace(problem, z=after))
        if after is None or ahead is None:
            break
        z, answer = after, ahead
    return replace(_chosen(list(seen.values()), samples, checks), trials=tuple(trials))


def _next(trials: list[Trial], goal: float, samples: Samples, ends: tuple[float, float]) -> float | None:
    """The margin to try next: by the line through the last trials, within the bracket; None if none is better.

    ends: a margin that no half widths have, and the largest there is.
    """
    refused, end = ends
    low = max((one.z for one in trials if score(samples.level(one.sampled)) < goal), default=0.0)
    high = min((one.z for one in trials if one.z > low), default=np.inf)
    high = min(high, refused)
    if high - low < CLOSE or low >= end:
        return None
    z = np.nan
    if trials:
        last = trials[-1]
        z = last.z + _correction(trials, goal + _above(last.sampled, samples))
        if last.z == high <= z:  # it meets the goal, and by no more than is aimed at
            return None
    if not low < z < high:
        z = (low + high) / 2 if np.isfinite(high) else low + STEP
    return min(z, end)


def _enough(sampled: SampledYield, goal: float, samples: Samples) -> bool:
    """Whether a share meets the goal, and by no more than samples can tell."""
    level, spare = samples.level(sampled), sampled.share - sampled.low
    return score(level) >= goal and (samples.by == "high" or score(level - spare) <= goal)


def _cheaper(ahead: Answer | None, answer: Answer) -> bool:
    """Whether what could be tried next costs enough less to be sampled."""
    return ahead is not None and ahead.found and ahead.cost < (1 - WORTH) * answer.cost


def _chosen(seen: list[Answer], samples: Samples, checks: int) -> Answer:
    """The cheapest of those sampled that meets the target, by fresh samples too; or the best, with what it misses."""
    known: list[Answer] = []
    tried: list[Answer] = []
    last = [] if samples.reserve is None else [samples.reserve]
    for one in [*sorted(seen, key=lambda one: one.cost), *last]:
        best = samples.verified(one)
        tried.append(best)
        if samples.level(best.sampled) < samples.target:
            continue
        if best.checked is None:
            checks += 1
            best = samples.checked(best, checks)
        if samples.holds(best):
            return best
        known.append(best)
    return _missed(known, tried, samples)


def _missed(known: list[Answer], seen: list[Answer], samples: Samples) -> Answer:
    """The best of what misses the target, with how: known: by fresh samples alone; seen: all that were sampled."""
    target = samples.target
    if known:
        best = max(known, key=lambda one: one.checked.share if one.checked else 0.0)
        checked = best.checked or SampledYield(np.nan, np.nan, np.nan)
        figures = {**checked._asdict(), "target": target, "chosen": best.sampled.share if best.sampled else np.nan}
        code = "yield.check_uncertain" if checked.high >= target else "yield.check_missed"
        return replace(best, findings=(*best.findings, finding_for(code, "yield", **figures)))
    best = max(seen, key=lambda one: one.sampled.share if one.sampled else 0.0)
    sampled = best.sampled or SampledYield(np.nan, np.nan, np.nan)
    if sampled.high >= target:
        return best
    last = samples.reserve is not None and np.array_equal(best.tolerances, samples.reserve.tolerances)
    code, of = ("yield.narrowest", {"of": "of the samples"}) if last else ("yield.best", {})
    doubt = finding_for(code, "yield", phrases=of, share=sampled.share, target=target)
    return replace(best, findings=(*best.findings, doubt))


def _above(sampled: SampledYield, samples: Samples) -> float:
    """What the share is to be above the target by, in standard scores, so as to meet it next."""
    target = samples.target
    return AIMS[samples.by] * (score(target) - score(target - (sampled.share - sampled.low)))


def _correction(trials: list[Trial], goal: float) -> float:
    """Change of z by the line through the last two trials, or from 0 through the one: scores are nearly linear in z."""
    z, own = trials[-1].z, score(trials[-1].sampled.share)
    z0, own0 = (trials[-2].z, score(trials[-2].sampled.share)) if len(trials) > 1 else (0.0, 0.0)
    rise = (own - own0) / (z - z0) if z != z0 else 1.0
    return float(np.clip((goal - own) / max(rise, 0.1), -STEP, STEP))


def furthest(problem: AllocationProblem) -> float:
    """The z beyond which no row with a cap is asked for more."""
    ratios = np.ones(1) if problem.ratios is None else problem.ratios[problem.ratios > 0]
    return FAR / float(np.min(ratios, initial=1.0))


def score(share: float) -> float:
    """The standard score whose symmetric range has this probability, within ±8."""
    return float(ndtri((1 + min(max(share, 0.0), 1 - 1e-12)) / 2))
