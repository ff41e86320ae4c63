"""Moments of samples, and confidence intervals: how far a figure from samples may be from the true one.

An interval (low, high) covers the true figure with a chance of 95 %; all take arrays, which broadcast. By hand, of
scipy.special: scipy.stats has Wilson's interval for one number at a time, and takes 1.6 s to import.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

Floats = NDArray[np.float64]
Interval = tuple[Floats, Floats]
TAIL = 0.025  # chance that the true figure lies below an interval, and above it


class Moments(NamedTuple):
    """Number of values, mean, standard deviation by n − 1, skewness and kurtosis (3 of a normal distribution).

    Those that do not exist are NaN: the deviation of one value, skewness and kurtosis where nothing varies, and all but
    the mean, which is infinite, of values some of which are.
    """

    number: Floats
    mean: Floats
    deviation: Floats
    skewness: Floats
    kurtosis: Floats


def moments_of(values: Floats) -> Moments:
    """Moments along the last axis; NaN are left out."""
    rows = np.full((values.size // values.shape[-1], len(Moments._fields)), np.nan)
    for place, row in enumerate(values.reshape(-1, values.shape[-1])):
        present = row[~np.isnan(row)]
        rows[place, 0] = number = len(present)
        if not number:
            continue
        with np.errstate(all="ignore"):
            mean = np.mean(present)
            if np.isfinite(mean):
                mean += np.mean(present - mean)  # what rounding left in it
            apart = present - mean
            size = np.max(np.abs(apart))
            scaled = apart / size if size > 0.0 else apart  # so that no power leaves the range of floats
            square = scaled * scaled
            second, third, fourth = (np.mean(array) for array in (square, square * scaled, square * square))
            deviation = size * np.sqrt(second * number / (number - 1)) if number > 1 else np.nan
            shape = (third / second**1.5, fourth / second**2) if second > 0 else (np.nan, np.nan)
        rows[place, 1:] = mean, deviation, *shape
    return Moments(*np.moveaxis(rows.reshape(*values.shape[:-1], len(Moments._fields)), -1, 0))


def share(passed: Any, n: Any) -> Interval:
    """Interval of a chance of which `passed` in n independent trials came out, by Wilson's score. NaN for n = 0.

    |p − p̂| = z √(p (1 − p)/n) solved for p; it stays in [0, 1] and has a width when all passed. Source: E. B. Wilson,
    Probable inference, the law of succession, and statistical inference, J. Am. Stat. Assoc. 22 (1927) 209-212,
    doi:10.1080/01621459.1927.10502953.
    """
    n = np.asarray(n, dtype=np.float64)
    with np.errstate(invalid="ignore", divide="ignore"):
        return _score(np.asarray(passed) / n, 1 / n, -special.ndtri(TAIL))


def _score(estimate: Floats, unit: Floats, z: Any) -> Interval:
    """Wilson's interval where the variance of the estimate is p (1 − p) · unit."""
    w = z * z * unit
    middle = (estimate + w / 2) / (1 + w)
    half = np.sqrt(w * (estimate * (1 - estimate) + w / 4)) / (1 + w)
    # at the ends middle and half are equal but for rounding
    low = np.where(estimate <= 0, 0.0, np.maximum(middle - half, 0.0))
    high = np.where(estimate >= 1, 1.0, np.minimum(middle + half, 1.0))
    return low, high


def by_replicates(values: Any, axis: int = -1) -> Interval:
    """Interval of a mean from independent estimates of it along `axis`, by Student's t: mean ± t s/√R. NaN for R < 2.

    Source: Student, The probable error of a mean, Biometrika 6 (1908) 1-25, doi:10.1093/biomet/6.1.1.
    """
    values = np.asarray(values, dtype=np.float64)
    number = values.shape[axis]
    deviation = values.std(axis=axis, ddof=1) if number > 1 else np.nan
    return of_mean(values.mean(axis=axis), deviation, number)


def share_by_replicates(passed: Any, size: int, axis: int = -1, least: float = 1 / 12) -> Interval:
    """Interval of a chance from the counts `passed` of R > 1 independent replicates of `size` points each.

    Wilson's score with the variance that the replicates show and Student's t for z, so that it stays in [0, 1]; where
    no count is near its ends it is `by_replicates` of the shares. Counts are whole, so their variance is taken as at
    least 1/12 (or `least`: 1/4, the most that a count which is one of two neighbours has, covers more often); if all or
    none passed, it is `share` of all points as if they were independent, which is wider. Where hardly any point failed,
    the counts are 0 or 1 and t alone covers far too seldom; this does not.
    """
    passed = np.asarray(passed, dtype=np.float64)
    number = passed.shape[axis]
    total = passed.sum(axis=axis)
    plain = share(total, number * size)
    estimate = total / (number * size)
    variance = np.maximum(passed.var(axis=axis, ddof=1), least) / (number * size * size)
    spread = estimate * (1 - estimate)
    inside = spread > 0
    t = special.stdtrit(number - 1, 1 - TAIL)
    low, high = _score(estimate, variance / np.where(inside, spread, 1.0), t)
    return np.where(inside, low, plain[0]), np.where(inside, high, plain[1])


def of_mean(mean: Any, deviation: Any, n: Any) -> Interval:
    """Interval of a mean of n independent values with sample standard deviation s: mean ± t s/√n. NaN for n < 2."""
    n = np.asarray(n, dtype=np.float64)
    number = np.where(n > 1, n, np.nan)
    half = special.stdtrit(number - 1, 1 - TAIL) * np.asarray(deviation) / np.sqrt(number)
    return np.asarray(mean - half, dtype=np.float64), np.asarray(mean + half, dtype=np.float64)


def of_deviation(deviation: Any, kurtosis: Any, n: Any) -> Interval:
    """Interval of a standard deviation from n independent values, of any distribution with the kurtosis given.

    The variance of s² is σ⁴ (κ − (n − 3)/(n − 1))/n; ν s²/σ² is taken as chi-square with the ν of that variance,
    ν = 2 n/(κ − (n − 3)/(n − 1)), which is n − 1 for a normal distribution (κ = 3). Approximate for small n.
    Source of the variance: H. Cramér, Mathematical methods of statistics (1946), chapter 27. NaN for n < 4.
    """
    n, kurtosis = np.asarray(n, dtype=np.float64), np.asarray(kurtosis, dtype=np.float64)
    number = np.where(n > 3, n, np.nan)
    freedom = 2 * number / np.maximum(kurtosis - (number - 3) / (number - 1), 1e-12)
    low, high = (np.asarray(deviation) * np.sqrt(freedom / special.chdtri(freedom, p)) for p in (TAIL, 1 - TAIL))
    return low, high


def of_quantile(q: Any, n: Any) -> Interval:
    """Shares (low, high) of n independent values whose quantiles in the sample enclose the true quantile q.

    The number of values below the true quantile is binomial (n, q), whatever the distribution: the interval is from
    the lth to the uth smallest value, each tail at most 2.5 %. NaN where n is too small for one to exist.
    Source: W. J. Conover, Practical nonparametric statistics, 3rd ed. (1999), section 3.2.
    """
    q, n = np.broadcast_arrays(np.asarray(q, dtype=np.float64), np.asarray(n, dtype=np.float64))
    number, ranks = np.maximum(n, 1), []
    for p in (TAIL, 1 - TAIL):  # the least k with P(X ≤ k) ≥ p
        k = np.maximum(np.ceil(special.bdtrik(p, number, q)), 0.0)
        before = np.maximum(k - 1, 0.0)
        ranks.append(np.where((k > 0) & (special.bdtr(before, number.astype(np.int64), q) >= p), before, k))
    low, high = ranks[0], ranks[1] + 1
    return np.where((low >= 1) & (n > 0), low / number, np.nan), np.where((high <= n) & (n > 0), high / number, np.nan)


def capability(lower: float, upper: float, mean: float, sigma: float) -> tuple[float, float]:
    """(C_p, C_pk) between limits that may be infinite: what they leave, and the nearer of them, against 6 σ and 3 σ.

    NaN where there is no such limit or no spread. Source: V. E. Kane, Process capability indices, J. Quality Technology
    18 (1986) 41-52, doi:10.1080/00224065.1986.11978984.
    """
    with np.errstate(all="ignore"):
        indices = np.array([(upper - lower) / 2, min(upper - mean, mean - lower)]) / (3 * np.float64(sigma))
    cp, cpk = np.where(np.isfinite(indices), indices, np.nan).tolist()
    return cp, cpk
