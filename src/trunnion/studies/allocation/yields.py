"""Least cost that keeps a yield: the margin z of all rows, first for normal deviations, then as sampled.

The yield of all rows together, linearly and with normal deviations, is that of `normal`; the sum of their failures
(Bonferroni) bounds z from above. The margins stay below what each row can have at all (`narrowest`), so that a yield is
found wherever the narrowest half widths have it. They are split over the measures by cost (`splits`), and corrected
until the yield that the caller samples meets the target (`sampled`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import ndtri

from trunnion.errors import Severity
from trunnion.results.sentences import finding_for
from trunnion.studies.allocation.narrowest import bought_at, freed, with_caps
from trunnion.studies.allocation.normal import by_measure, failing, normal_yield, plain_yield
from trunnion.studies.allocation.problem import FAR, AllocationProblem, Answer
from trunnion.studies.allocation.sampled import HIGHEST, Check, Samples, Verify, corrected, furthest, score
from trunnion.studies.allocation.splits import split

__all__ = ["Check", "Verify", "meet", "normal_yield"]

Array = NDArray[np.float64]
Solve = Callable[[AllocationProblem], Answer]
NEAR = 1e-6  # of z: how close splits of the margins are settled
AROUND = 0.1  # of z: how far a split of the margins moves their mean
SURE = 1e-9  # of the target, in standard scores
EVEN = 1e-3  # of z: margins that differ less are the same
LEAST = 1e-3  # of z: how far beside the limit of what can be it is looked for
CLOSELY = 0.25  # of the permitted failures: if the narrowest half widths have more, samples of these are looked at
EASED = (0.0, 0.5, 1.0)  # of what a limit can have with the narrowest half widths: margins asked of one that is short
FEW = 0.5  # of the permitted failures: what measures fail together that are judged as normal ones


def meet(
    problem: AllocationProblem, target: float, solve: Solve, verify: Verify | None = None, check: Check | None = None
) -> Answer:
    """The allocation of least cost whose yield meets the target.

    solve: of a problem with z given; verify: half widths (contribution,) → yield, and its interval, low and high;
    check: the same of other samples, with the number of their stream, from 1.
    """
    low, most = _ends(problem, target)
    problem, best = with_caps(problem, most, solve)
    fails = failing(problem, best) if best is not None else {}
    alone = None  # each row alone has to fail less than all may together
    if problem.ratios is None and ndtri(target) > LEAST:
        alone = solve(replace(problem, z=low, caps=None))
    floor = alone.bound if alone else np.nan
    reserve = bought_at(replace(problem, z=furthest(problem)), best, floor) if best is not None else None
    if alone and not alone.found:
        first = alone
    else:
        first = replace(_expected(problem, target, solve, reserve=reserve), floor=floor)
    if not first.found or _refused(first):
        sure = None if verify is None else Samples(target, solve, verify, check, reserve)
        answer = first if sure is None else _beyond_normal(first, problem, fails, sure)
        return replace(answer, alone=fails)
    found = first
    if not first.findings and (problem.ratios is None or np.all(problem.ratios > 0)):
        found = split(freed(first), lambda one: _expected(one, target, solve, AROUND), plain_yield)
    answer = found if verify is None else _sampled(found, Samples(target, solve, verify, check, reserve), fails)
    even = np.ptp(first.problem.margins()) < EVEN * first.problem.z
    saved = 1 - found.cost / first.cost if found is not first and even else np.nan
    excess = found.cost / floor - 1 if floor > 0 else np.nan
    return replace(answer, saved=saved, excess=excess, alone=fails, floor=floor)


def _sampled(answer: Answer, samples: Samples, fails: dict[str, float]) -> Answer:
    """The answer corrected by samples; where these cannot tell that any half widths meet the target, hardly.

    With the narrowest ones next to the target, luck of the samples would decide between the half widths of first order
    and the dearest of all. They stay those of first order then, unless the samples speak against them.
    fails: what each measure fails with the narrowest half widths.
    """
    if samples.reserve is None or sum(fails.values()) < CLOSELY * (1 - samples.target):
        return corrected(answer, samples)
    reserve = samples.verified(samples.reserve)
    samples, ends = replace(samples, reserve=reserve), reserve.sampled
    if ends is None or not ends.low < samples.target <= ends.high:
        return corrected(answer, samples)
    found = corrected(answer, replace(samples, by="high"))
    if _refused(found):
        return found
    doubt = finding_for("yield.unresolved", "yield", **ends._asdict(), target=samples.target, normal=found.expected)
    return replace(found, findings=(*found.findings, doubt))


def _refused(answer: Answer) -> bool:
    return any(one.severity is Severity.ERROR for one in answer.findings)


def _ends(problem: AllocationProblem, target: float) -> tuple[float, float]:
    """Margins between which the one is that all rows together need: of one row alone, and if no two fail together."""
    rows = len(problem.effects.worst)
    least, most = float(ndtri(target)) - LEAST, float(ndtri(1 - (1 - target) / (2 * rows))) + LEAST
    return max(least, LEAST), most


def _expected(
    problem: AllocationProblem, target: float, solve: Solve, around: float = np.inf, reserve: Answer | None = None
) -> Answer:
    """The cheapest allocation that meets the target for normal deviations, the margins being in the stated ratios.

    around: how far from the z of the problem it is looked for, before it is looked for everywhere; reserve: the
    narrowest half widths, where no others meet it.
    """
    tried: list[Answer] = []

    def over(z: float) -> float:
        answer = solve(replace(problem, z=z))
        if not answer.found:
            return HIGHEST
        answer = replace(answer, expected=normal_yield(problem, answer.tolerances))
        tried.append(answer)
        return score(answer.expected) - score(target)

    least, most = _ends(problem, target)
    ratios = np.ones(1) if problem.ratios is None else problem.ratios
    if not np.all(ratios > 0):  # rows that samples alone decide over: what they fail is no matter of the margin
        ratios, most = np.where(ratios > 0, ratios, 1.0), HIGHEST
    ends = (least / float(np.max(ratios)), most / float(np.min(ratios)))
    near = (max(ends[0], problem.z - around), min(ends[1], problem.z + around))
    tries = [near, ends] if problem.caps is None else [near, ends, (ends[0], max(ends[1], furthest(problem)))]
    for low, high in dict.fromkeys(tries):
        if over(low) < 0 and over(high) > 0:
            brentq(over, low, high, xtol=1e-9 if around == np.inf else NEAR, rtol=1e-12)
            break
    if not tried:
        return solve(replace(problem, z=ends[0]))
    enough = [one for one in tried if score(one.expected) >= score(target) - SURE * 10]
    if enough:
        return min(enough, key=lambda one: one.cost)
    best = max(tried, key=lambda one: one.expected)
    if reserve:
        best = replace(reserve, expected=normal_yield(problem, reserve.tolerances))
        if best.expected >= target:
            return best
    of = {"of": "of normal deviations"}
    doubt = finding_for("yield.narrowest", "yield", phrases=of, share=best.expected, target=target)
    return replace(best, findings=(*best.findings, doubt))


def _beyond_normal(first: Answer, problem: AllocationProblem, fails: dict[str, float], samples: Samples) -> Answer:
    """Where no half widths keep the limits for normal deviations: those that samples keep, as without tails they may.

    That normal deviations do not is a reason to be sure of it: the narrowest half widths have to meet the target with
    the lower end of their interval. The measures that are short get a smaller margin, however large that of the
    others: none, then more, up to that of the others; the cheapest that meets the target is taken.
    `first` if no such allocation meets the target with samples; fails: what each measure fails with the narrowest.
    """
    reserve = samples.reserve or samples.solve(replace(problem, z=furthest(problem)))
    if not reserve.found:
        return first
    least = samples.verified(reserve)
    if least.sampled is None or least.sampled.low < samples.target:
        return replace(first, sampled=least.sampled) if first.found else first
    short = _short(fails, samples.target)
    if not short:
        return first
    own = np.zeros(len(problem.effects.worst), bool)
    own[np.concatenate([rows for label, rows in by_measure(problem).items() if label in short])] = True
    caps = np.full(len(own), FAR) if problem.caps is None else np.clip(problem.caps, 0.0, FAR)

    def eased(one: AllocationProblem, share: float) -> Answer:
        asked = np.where(own, np.minimum(share * caps / one.z, 1.0), 1.0)
        return samples.solve(replace(one, ratios=asked))

    begin = min(first.problem.z, _ends(problem, samples.target)[1])
    ways = [replace(samples, reserve=least)]
    if not np.all(own):
        ways += [replace(samples, solve=partial(eased, share=share), reserve=None) for share in EASED]
    kept = [answer for way in ways if (answer := _along(way, problem, begin)) is not None]
    if not kept:
        return replace(first, sampled=least.sampled) if first.found else first
    found = min(kept, key=lambda one: one.cost)
    note = finding_for(
        "yield.not_normal", "yield", measures=sorted(name.removeprefix("measures.") for name in short),
        share=found.sampled.share if found.sampled else np.nan, normal=found.expected,
    )  # fmt: skip
    return replace(found, findings=(note,))


def _along(way: Samples, problem: AllocationProblem, z: float) -> Answer | None:
    """The allocation that meets the target with samples, the margin of its problem being changed; None without one."""
    most, begin = (way.solve(replace(problem, z=one)) for one in (furthest(problem), z))
    if not most.found or not begin.found or way.level(way.verified(most).sampled) < way.target:
        return None
    found = corrected(begin, way)
    return found if not _refused(found) and way.holds(found) else None


def _short(fails: dict[str, float], target: float) -> set[str]:
    """The measures that fail most, until what the others fail together leaves room for the target."""
    short: set[str] = set()
    for label in sorted(fails, key=lambda label: -fails[label]):
        if sum(fails[other] for other in fails if other not in short) < FEW * (1 - target):
            break
        short.add(label)
    return short
