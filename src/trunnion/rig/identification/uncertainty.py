"""How far the estimates may be off: scatter between turns, errors of the sensors, and what the model leaves over.

With the weights W the estimate is off by H⁻¹ (Jᵀ W e − Λ a), H = Jᵀ W J + Λ: e the errors of the means, a those of the
sensors in units of their standard uncertainties, Λ 1 for each of these. W need not be right: the variance of Jᵀ W e is
taken from what it is turn by turn, whatever the correlation within a turn (clusters of Liang and Zeger, 1986). See
"Identification" in the docs' theory.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special
from scipy.sparse.csgraph import connected_components

from trunnion.rig.identification.fit import Fit, sizes_of
from trunnion.rig.reading.measurement import student
from trunnion.rig.reading.turns import covariance_of_steps

Array = NDArray[np.float64]
CONFIDENCE = 0.95
NEIGHBOURS = 5  # frequencies that a power is smoothed over
FLOOR = 0.05  # of the mean power: what is below it decides nothing
UNLIKELY = 0.001  # a chance below which the model is said not to fit
RARE = 0.01  # one below which conditions are said to disagree
GROSS = 9.0  # reduced χ² of residuals of three times the scatter
WORTH = 1.05  # reduced χ² up to which it is not
ENOUGH_PAIRS = 10  # of turns, to see whether they follow each other
PART = 0.05  # of the largest share in a direction: what is below it takes no part
SINGULAR = 1e-10  # of the largest eigenvalue of the scaled information: derivatives are exact to some 1e-12 of it


class LackOfFit(NamedTuple):
    """Whether the residuals of the means are those that the scatter between turns explains.

    reduced: χ² over its expected value; freedom: of the χ²; chance: of a larger one if the model is right; NaN without
    repeated turns.
    """

    reduced: float = np.nan
    freedom: float = np.nan
    chance: float = np.nan

    @property
    def misfit(self) -> bool:
        """Whether the model does not fit."""
        return bool(self.chance < UNLIKELY and self.reduced > WORTH)

    @property
    def gross(self) -> bool:
        """Whether it fits so badly that the estimates stand for something else."""
        return self.misfit and self.reduced > GROSS


@dataclass(frozen=True)
class Covariances:
    """Covariances of all unknowns and sensors, by where they come from.

    inverse: of the information Jᵀ W J + Λ, pseudo where that is singular; null: (direction, unknown and sensor), of
    which nothing is known; parts: covariance by source; freedom: degrees of freedom, (unknown and sensor,); follows:
    how much a turn resembles the one before it, −1 to 1, NaN if not known; apart: (unknown and sensor,), how much more
    than turns the conditions differ in what they say of it, as variances, 1 if not; excess: how much more than the
    scatter the misfit and the conditions move the estimates, as variances.
    """

    inverse: Array
    null: Array
    parts: dict[str, Array]
    freedom: Array
    test: LackOfFit
    follows: float
    apart: Array
    excess: float

    @cached_property
    def covariance(self) -> Array:
        """Of all sources."""
        return np.asarray(np.sum(list(self.parts.values()), axis=0))

    @property
    def deviation(self) -> Array:
        """Standard uncertainty, (unknown and sensor,)."""
        return np.asarray(np.sqrt(np.maximum(np.diagonal(self.covariance), 0.0)))


def quantile(freedom: Array | float, one_sided: bool = False) -> Array:
    """Student's of the intervals."""
    return student(freedom, float(special.ndtri(CONFIDENCE if one_sided else (1 + CONFIDENCE) / 2)))


def spread_of(fit: Fit, x: Array) -> Covariances:
    """Covariance of the estimates by source, with its degrees of freedom."""
    rows = fit.jacobian(x)
    information = rows.T @ rows
    size = np.sqrt(np.diagonal(information))
    size = np.where(size <= 1e-14 * np.max(size, initial=0.0), 1.0, size)
    values, vectors = np.linalg.eigh(information / np.outer(size, size))
    lost = values <= SINGULAR * max(float(values[-1]), 1.0)  # directions along which there is nothing to invert
    inverse = (vectors[:, ~lost] / values[~lost]) @ vectors[:, ~lost].T / np.outer(size, size)
    null = (vectors[:, lost] / size[:, None]).T
    # what a deviation at each position does to the estimates, (unknown and sensor, position), by block
    pulls = {k: inverse @ (np.nan_to_num(fit.reading(x, k)[1]) * fit.weight(k)) for k in fit.fitted}
    steps = {}  # covariance by readings that stick to steps: of a mean that does not get finer by more turns
    for k, pull in pulls.items():
        signal = fit.blocks[k].signal
        step, left = signal.accuracy.resolution, signal.accuracy.left
        if left is not None and left.every and signal.unresolved:
            steps[k] = covariance_of_steps(pull, np.nan_to_num(fit.reading(x, k)[0]) / step, left) * step**2
        else:
            steps[k] = np.asarray(pull @ pull.T * fit.blocks[k].unresolved ** 2)
    scatter, freedom, follows, by_condition = _between_turns(fit, pulls, steps)
    apart, test = _apart(fit, x, pulls, by_condition), lack_of_fit(fit, x)
    single, pieces = _left_over(fit, x, pulls, repeats=False)
    parts = {"scatter": scatter + single}
    random = [(scatter, freedom), (single, np.full(len(x), pieces))]
    if np.any(apart > 1):
        parts["conditions"] = scatter * np.sqrt(np.outer(apart - 1, apart - 1))
        random.append((parts["conditions"], np.full(len(x), max(len(by_condition) - 1.0, 1.0))))
    if any(np.any(covariance) for covariance in steps.values()):
        parts["resolution"] = np.asarray(np.sum(list(steps.values()), axis=0))
    if test.misfit:
        parts["misfit"], pieces = _left_over(fit, x, pulls, repeats=True)
        random.append((parts["misfit"], np.full(len(x), pieces)))
    more = np.diagonal(np.sum([part for part, _ in random], axis=0))[: fit.count]
    spread = np.diagonal(parts["scatter"])[: fit.count]
    excess = float(np.mean(more[spread > 0] / spread[spread > 0])) if np.any(spread > 0) else 1.0
    for s, sensor in enumerate(fit.sensors, fit.count):
        if sensor.stated:
            source = sensor.group or sensor.name
            parts[source] = parts.get(source, 0.0) + np.outer(inverse[:, s], inverse[:, s])
    total = np.diagonal(np.sum(list(parts.values()), axis=0))
    with np.errstate(all="ignore"):  # Welch and Satterthwaite; what was stated has infinite freedom
        below = sum(np.diagonal(part) ** 2 / free for part, free in random)
        freedom = np.where(below > 0, total**2 / below, np.inf)
    return Covariances(inverse, null, parts, freedom, test, follows, apart, excess)


def _between_turns(
    fit: Fit, pulls: dict[int, Array], steps: dict[int, Array]
) -> tuple[Array, Array, float, dict[int, tuple[Array, int]]]:
    """Covariance by what each turn would have changed, its freedom, how turns follow each other, and the variances with
    the number of turns by condition."""
    size, n = fit.count + len(fit.sensors), fit.count
    total, fourth = np.zeros((size, size)), np.zeros(size)
    products, squares, pairs = 0.0, 0, 0
    by_condition: dict[int, tuple[Array, int]] = {}
    for condition in dict.fromkeys(block.condition for block in fit.blocks):
        own_blocks = [k for k in pulls if fit.blocks[k].condition == condition and fit.blocks[k].repeats]
        if not own_blocks:
            continue
        turns = max(len(fit.blocks[k].spread) for k in own_blocks)
        moved = np.zeros((turns, size))
        for k in own_blocks:  # the channels of a turn belong together
            spread, count = fit.blocks[k].spread, fit.blocks[k].signal.count
            moved[: len(spread)] += spread / np.sqrt(len(spread) * np.maximum(count, 1)) @ pulls[k].T
        covariance = moved.T @ moved * (turns / (turns - 1))
        total += covariance
        fourth += np.diagonal(covariance) ** 2 / (turns - 1)
        by_condition[condition] = np.diagonal(covariance), turns
        length = np.sqrt(np.maximum(np.sum(moved**2, axis=0), 1e-300))[:n]
        telling = length > np.sqrt(sum(np.diagonal(steps[k]) for k in own_blocks))[:n] + 1e-140  # else it is rounding
        unit = (moved[:, :n] / length)[:, telling]
        products += float(np.sum(unit[1:] * unit[:-1])) + unit.shape[1] / turns  # its bias is −1/turns
        squares += unit.shape[1]
        pairs += (turns - 1) * bool(np.any(telling))
    with np.errstate(all="ignore"):
        freedom = np.where(fourth > 0, np.diagonal(total) ** 2 / fourth, np.inf)
    follows = products / squares if pairs >= ENOUGH_PAIRS else float("nan")
    if follows > 2 / np.sqrt(max(pairs, 1)):  # as if there were fewer turns, for a first-order process
        wider = (1 + min(follows, 0.95)) / (1 - min(follows, 0.95))
        return total * wider, np.maximum(freedom / wider, 1.0), follows, by_condition
    return total, freedom, follows, by_condition


def _apart(fit: Fit, x: Array, pulls: dict[int, Array], by_condition: dict[int, tuple[Array, int]]) -> Array:
    """How much the conditions disagree in what they add to each unknown, over what their turns explain; 1 if by chance.

    What they add is 0 in all, so that of C conditions the sum of squares over variances is χ² of C − 1, or F for
    variances from few turns.
    """
    if len(by_condition) < 3:
        return np.ones(len(x))
    squares = np.zeros(len(x))
    for condition, (variance, turns) in by_condition.items():
        added, expected = np.zeros(len(x)), variance.copy()
        for k, pull in pulls.items():
            if fit.blocks[k].condition == condition and fit.blocks[k].repeats:
                added += pull @ np.where(fit.masks[k], fit.gap(x, k), 0.0)
                expected += np.sum((pull * fit.blocks[k].unresolved) ** 2, axis=1)
        fair = (turns - 3) / (turns - 1) if turns > 3 else 0.3
        squares += fair * added**2 / np.where(expected > 0, expected, np.inf)
    freedom = len(by_condition) - 1.0
    usual = float(np.median([turns - 1.0 for _, turns in by_condition.values()]))
    chance = special.fdtrc(freedom, max(freedom * usual, 4.0), squares / freedom)
    return np.asarray(np.where(chance < RARE, np.maximum(squares / freedom, 1.0), 1.0))


# ---- what the model leaves over -------------------------------------------------------------------------------


def _powers(rows: Array) -> tuple[Array, Array]:
    """By frequency of courses, (…, frequency), and how many real numbers each has: 2 but for the first and an even
    last."""
    size = rows.shape[-1]
    numbers = np.where(np.arange(size // 2 + 1) * 2 % size == 0, 1.0, 2.0)
    return np.asarray(np.abs(np.fft.rfft(rows, axis=-1)) ** 2), numbers


def _smooth(power: Array) -> Array:
    """Means over neighbouring frequencies."""
    weights = np.ones(min(NEIGHBOURS, len(power)))
    return np.asarray(np.convolve(power, weights, "same") / np.convolve(np.ones(len(power)), weights, "same"))


def lack_of_fit(fit: Fit, x: Array) -> LackOfFit:
    """χ² of the residuals of the means, frequency by frequency, against the scatter between turns.

    A frequency of the residual has the variance that it has between turns, over their number: noise may be coloured as
    it likes. What the sum comes to if the model is right, and how much it varies, is seen from the same sum of each
    turn; it is taken as g χ²_h with the g and h of that mean and variance (Satterthwaite).
    """
    value, mean, variance = 0.0, 0.0, 0.0
    for condition in dict.fromkeys(block.condition for block in fit.blocks):
        sums: dict[int, Array] = {}
        least = 0.0
        for k in fit.fitted:
            block, mask = fit.blocks[k], fit.masks[k] & (fit.blocks[k].signal.count > 1)
            if block.condition != condition or not block.repeats or not np.any(mask):
                continue
            count, steps = len(block.spread), np.count_nonzero(mask) * block.unresolved**2
            left, numbers = _powers(np.where(mask, fit.gap(x, k), 0.0))
            powers, _ = _powers(np.where(mask, block.spread / np.sqrt(np.maximum(block.signal.count, 1)), 0.0))
            powers *= count / (count - 1)
            scatter = _smooth(np.mean(powers, axis=0)) + steps
            floor = np.maximum(scatter, FLOOR * float(np.mean(scatter)))
            weights = numbers / floor
            freedom = min(NEIGHBOURS, len(scatter)) * 2.0 * (count - 1)
            fair = (freedom - 2) / freedom if freedom > 4 else 0.5  # 1/variance is too large on average
            value += fair * float(np.sum(left * weights))
            sums[count] = sums.get(count, 0.0) + powers @ weights + steps * float(np.sum(weights))
            least += 2 * float(np.sum(weights * scatter * (scatter / floor)))  # of normal noise
        mean += sum(float(np.mean(each)) for each in sums.values())
        if sums:
            most = max(sums)
            variance += max(float(np.var(sums[most], ddof=1)), least) * (1 + 1 / most)
    mean -= min(float(fit.count), 0.5 * mean)
    if mean <= 0 or variance <= 0:
        return LackOfFit()
    freedom = 2 * mean**2 / variance
    return LackOfFit(value / mean, freedom, float(special.chdtrc(freedom, value / mean * freedom)))


def _left_over(fit: Fit, x: Array, pulls: dict[int, Array], repeats: bool) -> tuple[Array, float]:
    """Covariance by the residuals of the means, as correlated as they are along the cycle, and its freedom.

    repeats: of blocks with repetitions, as a misfit of the model beside their scatter; it is larger by as much as the
    conditions resemble each other, up to their number if all have one. Else of blocks without.
    """
    total, pieces, alike = np.zeros((len(x), len(x))), 0.0, 1.0
    gaps: dict[str, list[Array]] = {}
    for k, pull in pulls.items():
        block, mask = fit.blocks[k], fit.masks[k]
        if block.repeats == repeats and np.any(mask):
            gap = np.where(mask, fit.gap(x, k), 0.0)
            gaps.setdefault(block.channel, []).append(gap)
            power, numbers = _powers(gap)
            power = numbers * _smooth(power)
            spectrum = np.fft.rfft(pull, axis=-1)
            total += np.real((spectrum * power / len(gap) ** 2) @ spectrum.conj().T)
            if np.any(power):
                pieces += float(np.sum(power) ** 2 / np.sum(power**2 / numbers))
    if not gaps:
        return total, np.inf
    for rows in gaps.values() if repeats else ():
        own = sum(float(np.sum(row**2)) for row in rows)
        several = len({len(row) for row in rows}) > 1
        together = own * len(rows) if several else float(np.sum(np.sum(rows, axis=0) ** 2))
        alike = max(alike, together / own if own > 0 else 1.0)
    left = max(pieces - len(x), 1.0)
    return total * alike * max(pieces, 1.0) / left, max(left / alike, 1.0)


# ---- what the data do not tell apart ---------------------------------------------------------------------------


def inseparable(fit: Fit, x: Array, spread: Covariances) -> list[tuple[int, ...]]:
    """Places of unknowns and sensors that the data do not separate: groups that take part in directions of which
    nothing is known, together if they share one."""
    basis, _ = np.linalg.qr((spread.null / sizes_of(fit, x)).T)
    projector = basis @ basis.T
    share = np.diagonal(projector)
    takes = np.flatnonzero((share > PART**2 * np.max(share, initial=0.0)) & (share > 0))
    count, labels = connected_components(np.abs(projector[np.ix_(takes, takes)]) > PART**2)
    return [tuple(takes[labels == label].tolist()) for label in range(count)]
