"""What samples say: moments, quantiles, yield and capability of every figure, with their confidence intervals.

Of plain samples the intervals are those of independent values; of Sobol points they come from the spread of the
independently scrambled replicates (Student's t).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Status
from trunnion.measures.measures import Measure
from trunnion.statistics import intervals
from trunnion.statistics.intervals import Moments, moments_of
from trunnion.studies.tolerance.linear import Table, ToleranceStudy
from trunnion.studies.tolerance.sampling import Samples

__all__ = ["CAUSES", "QUANTILES", "limits_of", "sampled"]

Array = NDArray[np.float64]
Interval = tuple[Any, Any]
QUANTILES = (0.00135, 0.005, 0.025, 0.05, 0.25, 0.5, 0.75, 0.95, 0.975, 0.995, 0.99865)
CAUSES = len(Status) + 1  # by status; the last: a figure that does not exist, such as a dead centre out of range
FEWEST = 4.0  # points of a replicate expected beyond a quantile, from which its interval is given
BINS = 240
CORE, FAR = 0.005, 1.5  # share of the samples at either end, and widths of the others, beyond which bins do not reach
LEAST = 1e-9, 1e-12  # width of the bins of a figure that does not scatter: of the figure, and SI
SIZES = 12  # at which it is shown how figures converge


def sampled(samples: Samples, study: ToleranceStudy, table: Table) -> dict[str, Any]:
    """All figures of the samples: arrays by the names of `result.VARIABLES`."""
    job, figure, passed = samples.job, samples.figure, samples.passed
    count, done = figure.shape
    everything = np.concatenate([passed, np.all(passed, axis=0)[None]])
    moments = moments_of(figure)
    ordered = [np.sort(row[~np.isnan(row)]) for row in figure]
    replicates = (job.replicates, -1)
    each = [moments_of(part) for part in np.moveaxis(figure.reshape(count, *replicates), 1, 0)]
    yields = np.mean(everything, axis=1)
    if job.replicates > 1:
        ends = {
            "mean": intervals.by_replicates(np.array([moment.mean for moment in each]), axis=0),
            "deviation": intervals.by_replicates(np.array([_of_even_points(moment) for moment in each]), axis=0),
        }
        right = np.sum(everything.reshape(count + 1, *replicates), axis=2)
        # turned to where a measure changes most, a replicate's count is all but one of two numbers: on the safe side
        ends["yield"] = intervals.share_by_replicates(right, done // job.replicates, axis=1, least=0.25)
    else:
        ends = {
            "mean": intervals.of_mean(moments.mean, moments.deviation, moments.number),
            "deviation": intervals.of_deviation(moments.deviation, moments.kurtosis, moments.number),
            "yield": intervals.share(np.sum(everything, axis=1), done),
        }
    ends["quantile"] = _quantile_ends(ordered, figure.reshape(count, *replicates))
    histogram, edge = _histogram(ordered)
    arrays: dict[str, Any] = {
        "samples": np.array(done),
        "mean": moments.mean,
        "deviation": moments.deviation,
        "skewness": moments.skewness,
        "kurtosis": moments.kurtosis,
        "least": np.array([row[0] if row.size else np.nan for row in ordered]),
        "most": np.array([row[-1] if row.size else np.nan for row in ordered]),
        "failed": _failed(samples),
        "histogram": histogram,
        "edge": edge,
        "quantile_value": np.array([_quantiles(row, np.array(QUANTILES)) for row in ordered]),
        "yield": yields[:-1],
        "yield_all": yields[-1],
        "yield_all_low": ends["yield"][0][-1],
        "yield_all_high": ends["yield"][1][-1],
        **_capability(job.measures, study, moments),
        "band": _bands(samples, study, table),
        **_convergence(samples),
    }
    for name, (low, high) in ends.items():
        arrays |= {f"{name}_low": low[:count], f"{name}_high": high[:count]}
    return arrays


def _of_even_points(moments: Moments) -> Array:
    """Standard deviation of the points of a replicate, by n: their mean is all but true and uses none up."""
    return moments.deviation * np.sqrt(np.maximum(moments.number - 1, 0) / np.maximum(moments.number, 1))


def _failed(samples: Samples) -> NDArray[np.int64]:
    """Samples without an answer, by the gravest status of their positions."""
    gravest = samples.status[np.any(np.isnan(samples.figure), axis=0)]
    return np.bincount(np.where(gravest >= Status.NOT_CONVERGED, gravest, CAUSES - 1), minlength=CAUSES)


def _quantiles(ordered: Array, shares: Array) -> Array:
    """Quantiles of figures in order, of which the k-th stands for the share (k − ½)/n; linear between two of them."""
    if not ordered.size:
        return np.full(shares.shape, np.nan)
    values = np.quantile(ordered, np.clip(np.nan_to_num(shares), 0.0, 1.0), method="hazen")
    values = np.where(np.isnan(values), _of_rank(ordered, shares), values)
    return np.where(np.isnan(shares), np.nan, values)


def _of_rank(ordered: Array, shares: Array) -> Array:
    """The figures that so large shares do not exceed, NaN of a share that is not known."""
    rank = np.ceil(np.nan_to_num(shares) * len(ordered) - 1e-9).astype(int) - 1
    return np.where(np.isnan(shares), np.nan, ordered[np.clip(rank, 0, len(ordered) - 1)])


def _quantile_ends(ordered: list[Array], figure: Array) -> Interval:
    """Intervals of the quantiles. figure: (measure, replicate, sample)."""
    shares = np.array(QUANTILES)
    ends = np.full((2, len(ordered), len(shares)), np.nan)
    for i, row in enumerate(ordered):
        if not row.size:
            continue
        if figure.shape[1] == 1:
            ends[:, i] = [_of_rank(row, end) for end in intervals.of_quantile(shares, len(row))]
            continue
        each = np.array([_quantiles(np.sort(part[~np.isnan(part)]), shares) for part in figure[i]])
        low, high = intervals.by_replicates(each, axis=0)
        # even points tell a share to half of one: an error that the replicates have in common
        half = 0.5 * figure.shape[1] / len(row)
        low, high = np.minimum(low, _quantiles(row, shares - half)), np.maximum(high, _quantiles(row, shares + half))
        # the quantile of a replicate with hardly a point beyond it is its extreme
        few = len(row) / figure.shape[1] * np.minimum(shares, 1 - shares) < FEWEST
        ends[:, i] = np.where(few, np.nan, [low, high])
    return ends[0], ends[1]


def _histogram(ordered: list[Array]) -> tuple[NDArray[np.int64], Array]:
    """Samples in even bins, (measure, bin), and their edges; what lies far out is in the outermost bins."""
    counts, edges = np.zeros((len(ordered), BINS), np.int64), np.empty((len(ordered), BINS + 1))
    for i, row in enumerate(ordered):
        finite = row[np.isfinite(row)]
        least, low, high, most = np.quantile(finite, [0.0, CORE, 1 - CORE, 1.0]) if finite.size else np.zeros(4)
        room = FAR * (high - low)
        least, most = max(least, low - room), min(most, high + room)
        if not most - least > (slight := max(LEAST[0] * abs(least), LEAST[1])):
            least, most = least - slight, most + slight
        edges[i] = np.linspace(least, most, BINS + 1)
        counts[i] = np.histogram(np.clip(row, edges[i, 0], edges[i, -1]), edges[i])[0]
    return counts, edges


def _capability(measures: tuple[Measure, ...], study: ToleranceStudy, moments: Moments) -> dict[str, Any]:
    """C_p and C_pk of the figure between its limits; of a largest |deviation|, towards the limits' smaller side."""
    cp, cpk = np.full(len(measures), np.nan), np.full(len(measures), np.nan)
    for i, measure in enumerate(measures):
        low, high = limits_of(measure, study.orders[i].nominal)
        if np.isfinite(low) or np.isfinite(high):
            cp[i], cpk[i] = intervals.capability(low, high, moments.mean[i], moments.deviation[i])
    return {"cp": cp, "cpk": cpk}


def limits_of(measure: Measure, nominal: float) -> tuple[float, float]:
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


def _bands(samples: Samples, study: ToleranceStudy, table: Table) -> Array:
    """Quantiles of the deviation of the course at every position, of the samples whose curves are kept."""
    bands = np.full((len(samples.curves), len(QUANTILES), len(table.plan.times)), np.nan)
    for i, (curves, order) in enumerate(zip(samples.curves, study.orders, strict=True)):
        ordered = np.sort(curves - (0.0 if order.against else np.nan_to_num(table.curves[i])), axis=0)  # NaN last
        index = table.plan.windows[order.measure.name].index
        for position, column in zip(index, ordered.T, strict=True):
            bands[i, :, position] = _quantiles(column[~np.isnan(column)], np.array(QUANTILES))
    return bands


def _convergence(samples: Samples) -> dict[str, Any]:
    """Figures of all samples, of half of them, of a quarter, …; of replicates, of the first of each together."""
    count, done = samples.figure.shape
    each = done // samples.job.replicates
    sizes = sorted({-(-each >> k) for k in range(SIZES)} - {0, 1}) or [each]
    replicates = (count, samples.job.replicates, each)
    figure, passed = samples.figure.reshape(replicates), samples.passed.reshape(replicates)
    rows = [moments_of(figure[..., :size].reshape(count, -1)) for size in sizes]
    return {
        "convergence_samples": np.array(sizes, np.int64) * samples.job.replicates,
        "convergence_mean": np.array([row.mean for row in rows]).T,
        "convergence_deviation": np.array([row.deviation for row in rows]).T,
        "convergence_yield": np.array([np.mean(passed[..., :size], axis=(1, 2)) for size in sizes]).T,
    }
