"""What a tally says: moments, quantiles, yield and capability of every figure, with their confidence intervals.

Of plain samples the intervals are those of independent values; of Sobol points they come from the spread of the
independently scrambled replicates (Student's t).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.statistics import intervals
from trunnion.statistics.histogram import Bins, quantile
from trunnion.statistics.tally import Moments
from trunnion.studies.tolerance.first_order import ToleranceStudy
from trunnion.studies.tolerance.sampling import SampleTally, Sampling

__all__ = ["QUANTILES", "Sampled", "sampled"]

Array = NDArray[np.float64]
FEWEST = 4.0  # points of a replicate expected beyond a quantile, from which its interval is told
QUANTILES = (0.00135, 0.005, 0.025, 0.05, 0.25, 0.5, 0.75, 0.95, 0.975, 0.995, 0.99865)


@dataclass(frozen=True, eq=False)
class Sampled:
    """Arrays by the names of `result.VARIABLES`; done: samples; passed: within all limits."""

    arrays: dict[str, Any]
    done: int
    passed: int


def sampled(job: Sampling, tally: SampleTally, study: ToleranceStudy) -> Sampled | None:
    """All figures of a tally; None of an empty one."""
    count = len(job.measures)
    totals = [total for tree in tally.trees if (total := tree.total()) is not None]
    if not totals:
        return None
    whole = totals[0]
    for one in totals[1:]:
        whole = whole.merged(one)
    figures, passes = _part(whole, slice(0, count)), _part(whole, slice(count, None))
    done = int(np.max(passes.count))
    replicated = job.replicates > 1 and len(totals) == job.replicates
    arrays: dict[str, Any] = {
        "samples": np.array(done),
        "mean": np.where(figures.count > 0, figures.mean, np.nan),
        "deviation": figures.deviation,
        "skewness": figures.skewness,
        "kurtosis": figures.kurtosis,
        "least": np.where(figures.count > 0, figures.least, np.nan),
        "most": np.where(figures.count > 0, figures.most, np.nan),
        "failed": tally.failed,
        "histogram": np.sum(tally.histogram, axis=0),
        "edge": job.bins.edges(),
    }
    ends = _replicated(totals, count) if replicated else _independent(figures, done)
    for key, (low, high) in ends.items():
        arrays |= {f"{key}_low": low, f"{key}_high": high}
    arrays |= _quantiles(job, tally, figures, replicated)
    arrays |= _yields(totals, passes, done, count, replicated)
    arrays |= _capability(job, study, figures)
    arrays["band"] = _bands(job, tally, study)
    arrays |= _convergence(job, tally, count)
    passed = int(np.rint(passes.mean[-1] * done)) if done else 0
    return Sampled(_cut(arrays), done, passed)


def _part(moments: Moments, rows: slice) -> Moments:
    return Moments.unpacked(moments.packed()[:, rows])


def _independent(figures: Moments, done: int) -> dict[str, Any]:
    return {
        "mean": intervals.of_mean(figures.mean, figures.deviation, figures.count),
        "deviation": intervals.of_deviation(figures.deviation, figures.kurtosis, figures.count),
    }


def _replicated(totals: list[Moments], count: int) -> dict[str, Any]:
    own = [_part(total, slice(0, count)) for total in totals]
    return {
        "mean": intervals.by_replicates(np.array([one.mean for one in own]), axis=0),
        "deviation": intervals.by_replicates(np.array([_of_even_points(one) for one in own]), axis=0),
    }


def _of_even_points(one: Moments) -> Array:
    """Standard deviation of the points of a replicate, by n: their mean is all but true and uses none up."""
    return one.deviation * np.sqrt(np.maximum(one.count - 1, 0) / np.maximum(one.count, 1))


def _quantiles(job: Sampling, tally: SampleTally, figures: Moments, replicated: bool) -> dict[str, Any]:
    q = np.array(QUANTILES)
    counts = np.sum(tally.histogram, axis=0)
    found = quantile(counts, job.bins, q, figures.least, figures.most)
    if replicated:
        each = np.array([quantile(own, job.bins, q, figures.least, figures.most) for own in tally.histogram])
        low, high = intervals.by_replicates(each, axis=0)
        # even points tell a share to half of one: an error that the replicates have in common
        half = 0.5 * job.replicates / np.maximum(np.max(figures.count), 1.0)
        below, above = (quantile(counts, job.bins, q + sign * half, figures.least, figures.most) for sign in (-1, 1))
        low, high = np.minimum(low, below), np.maximum(high, above)
        # the quantile of a replicate with hardly a point beyond it is its extreme
        few = figures.count[:, None] / job.replicates * np.minimum(q, 1 - q) < FEWEST
        low, high = np.where(few, np.nan, low), np.where(few, np.nan, high)
    else:
        low, high = np.empty_like(found), np.empty_like(found)
        for i, n in enumerate(figures.count):
            shares = intervals.of_quantile(q, n)
            for ends, share in zip((low, high), shares, strict=True):
                ends[i] = quantile(counts[i], _alone(job.bins, i), share, figures.least[i], figures.most[i])
    return {"quantile_value": found, "quantile_low": low, "quantile_high": high}


def _alone(bins: Bins, i: int) -> Bins:
    return Bins(float(np.ravel(bins.centre)[i]), float(np.ravel(bins.scale)[i]), bins.fineness, bins.octaves)


def _yields(totals: list[Moments], passes: Moments, done: int, count: int, replicated: bool) -> dict[str, Any]:
    passed = np.rint(passes.mean * passes.count)
    if replicated:
        each = np.array([np.rint(one.mean[count:] * one.count[count:]) for one in totals])
        # turned to where a measure changes most, a replicate's count is all but one of two numbers: on the safe side
        low, high = intervals.share_by_replicates(each, int(np.max(totals[0].count)), axis=0, least=0.25)
    else:
        low, high = intervals.share(passed, passes.count)
    share = passed / done if done else np.full(count + 1, np.nan)
    return {
        "yield": share[:-1], "yield_low": low[:-1], "yield_high": high[:-1],
        "yield_all": share[-1], "yield_all_low": low[-1], "yield_all_high": high[-1],
    }  # fmt: skip


def _capability(job: Sampling, study: ToleranceStudy, figures: Moments) -> dict[str, Any]:
    """C_p and C_pk of the figure between its limits; of a largest |deviation|, towards the limits' smaller side."""
    cp, cpk = np.full(len(job.measures), np.nan), np.full(len(job.measures), np.nan)
    for i, measure in enumerate(job.measures):
        nominal = study.references[measure.name].figure
        low, high = limits_of(measure, nominal)
        if np.isfinite(low) or np.isfinite(high):
            cp[i], cpk[i] = intervals.capability(low, high, figures.mean[i], figures.deviation[i])
    return {"cp": cp, "cpk": cpk}


def limits_of(measure: Any, nominal: float) -> tuple[float, float]:
    """Least and largest figure within limits and bounds; ±∞ where there is none."""
    low = -np.inf if measure.at_least is None else measure.at_least
    high = np.inf if measure.at_most is None else measure.at_most
    if measure.rule == "deviation":
        if measure.lower is not None and measure.upper is not None:
            high = min(high, min(-measure.lower, measure.upper))
        return low, high
    if measure.lower is not None:
        low = max(low, nominal + measure.lower)
    if measure.upper is not None:
        high = min(high, nominal + measure.upper)
    return low, high


def _bands(job: Sampling, tally: SampleTally, study: ToleranceStudy) -> Array:
    """Quantiles of the deviation of the course at every position."""
    found = np.full((len(job.measures), len(QUANTILES), job.positions), np.nan)
    for i, measure in enumerate(job.measures):
        index = study.plan.windows[measure.name].index
        counts = tally.band[i, : len(index)]
        found[i][:, index] = quantile(counts, job.curve_bins(i), np.array(QUANTILES)).T
    return found


def _convergence(job: Sampling, tally: SampleTally, count: int) -> dict[str, Any]:
    """Figures of the first 1, 2, 4, … blocks, and of all; of replicates, of the first blocks of each together."""
    levels = sorted(set.intersection(*(set(tree.prefixes) for tree in tally.trees)))
    rows = []
    for level in levels:
        whole = tally.trees[0].prefixes[level]
        for tree in tally.trees[1:]:
            whole = whole.merged(tree.prefixes[level])
        rows.append(whole)
    ends = [total for tree in tally.trees if (total := tree.total()) is not None]
    if ends:
        last = ends[0]
        for one in ends[1:]:
            last = last.merged(one)
        if not rows or np.max(last.count) > np.max(rows[-1].count):
            rows.append(last)
    return {
        "convergence_samples": np.array([np.max(row.count[count:]) for row in rows], np.int64),
        "convergence_mean": np.array([row.mean[:count] for row in rows]).reshape(-1, count).T,
        "convergence_deviation": np.array([row.deviation[:count] for row in rows]).reshape(-1, count).T,
        "convergence_yield": np.array([row.mean[count : 2 * count] for row in rows]).reshape(-1, count).T,
    }


def _cut(arrays: dict[str, Any]) -> dict[str, Any]:
    """Without the bins that no measure uses, at both ends."""
    used = np.flatnonzero(np.any(arrays["histogram"] > 0, axis=0))
    low, high = (used[0], used[-1] + 1) if len(used) else (0, 1)
    return {**arrays, "histogram": arrays["histogram"][:, low:high], "edge": arrays["edge"][:, low : high + 1]}
