"""How far the estimates may be off: scatter between turns, errors of the sensors, and what the model leaves over.

With the weights W the estimate is off by H⁻¹ (Jᵀ W e − Λ a), H = Jᵀ W J + Λ: e the errors of the means, a those of the
sensors in units of their standard uncertainties, Λ 1 for each of these. W need not be right: the variance of Jᵀ W e is
taken from what it is turn by turn, whatever the correlation within a turn. See "Identification" in the docs' theory.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special

from trunnion.rig.identification.blocks import Block
from trunnion.rig.identification.fit import FAR, FitProblem
from trunnion.rig.reading.repeated_steps import covariance_of_steps

__all__ = [
    "CONFIDENCE",
    "RANDOM",
    "Covariances",
    "Test",
    "correlation_factors",
    "left_over",
    "quantile",
    "spread_of",
]

Array = NDArray[np.float64]
CONFIDENCE = 0.95
NEIGHBOURS = 5  # frequencies that a power is smoothed over
RANDOM = ("scatter", "conditions", "misfit")
FLOOR = 0.05  # of the mean power: what is below it decides nothing
UNLIKELY = 0.001  # a chance below which the model is said not to fit
RARE = 0.01  # one below which conditions are said to disagree
GROSS = 9.0  # reduced χ² of residuals of three times the scatter
WORTH = 1.05  # reduced χ² up to which it is not


@dataclass(frozen=True)
class Test:
    """Whether the residuals of the means are those that the scatter between turns explains.

    reduced: χ² over its expected value; freedom: of the χ²; chance: of a larger one if the model is right; NaN without
    repeated turns.
    """

    reduced: float
    freedom: float
    chance: float

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

    information: Jᵀ W J + Λ; inverse: its inverse, pseudo where it is singular; null: (direction, unknown and sensor),
    what nothing is known of; parts: covariance by source; freedom: degrees of freedom, (unknown and sensor,);
    follows: how much a turn resembles the one before it, −1 to 1, NaN if not known; apart: (unknown,), how much more
    than turns the conditions differ in what they say of it, as variances, 1 if not; beyond: see `beyond_stated`.
    """

    information: Array
    inverse: Array
    null: Array
    parts: dict[str, Array]
    freedom: Array
    test: Test
    follows: float
    apart: Array
    beyond: dict[int, float]

    @property
    def covariance(self) -> Array:
        """Of all sources."""
        return np.asarray(np.sum(list(self.parts.values()), axis=0))


def quantile(freedom: Array | float, confidence: float = CONFIDENCE, one_sided: bool = False) -> Array:
    """Student's quantile, of the normal distribution for infinite freedom."""
    level = confidence if one_sided else (1 + confidence) / 2
    freedom = np.asarray(freedom, float)
    known = np.where(np.isfinite(freedom), np.maximum(freedom, 1.0), 1e9)
    return np.asarray(special.stdtrit(known, level))


def _parts(problem: FitProblem, x: Array, k: int, inverse: Array) -> Array:
    """What each position of each turn of a block adds to the estimates, (unknown and sensor, turn, position)."""
    block = problem.blocks[k]
    columns = inverse @ (np.nan_to_num(problem.said(x, k)[1]) * problem.weight(k))
    return np.asarray(block.spread / np.sqrt(len(block.turns) * np.maximum(block.count, 1)) * columns[:, None, :])


def _reach(block: Block) -> int:
    """Positions over which the scatter of a turn resembles itself: to the first lag with hardly any correlation."""
    size = block.deviations.shape[1]
    padded = np.fft.rfft(block.deviations, 2 * size, axis=1)
    products = np.fft.irfft(np.sum(np.abs(padded) ** 2, axis=0))[:size]
    alike = products / products[0]
    return int(np.argmax(alike < HARDLY)) if np.any(alike < HARDLY) else size


HARDLY = 0.1


def _seam(parts: Array, reach: int) -> Array:
    """Covariance between the end of each turn and the beginning of the next, of positions within reach."""
    reach = min(reach, parts.shape[2] // 2)
    if reach < 2 or parts.shape[1] < 2:
        return np.zeros((len(parts), len(parts)))
    ends = np.cumsum(parts[:, :-1, : -reach - 1 : -1], axis=2)[:, :, ::-1]  # sums from each position to the end
    product = np.einsum("pkj,qkj->pq", ends, parts[:, 1:, :reach])
    return np.asarray(product + product.T)


def correlation_factors(problem: FitProblem, x: Array) -> dict[str, float]:
    """By channel, how much more neighbours of a turn tell the same than if they were independent.

    The variance of the scores between turns over what independent positions would give, in all directions that the
    unknowns move the course in; 1 for white noise.
    """
    found: dict[str, float] = {}
    for channel in dict.fromkeys(block.channel for block in problem.blocks):
        actual, white = 0.0, 0.0
        for k, block in enumerate(problem.blocks):
            if block.channel != channel or not (block.fitted and block.repeats):
                continue
            mask = problem.masks[k]
            columns = np.nan_to_num(problem.said(x, k)[1][:, mask] / np.sqrt(problem.variances[k][mask]))
            basis = _basis(columns)
            turns = block.spread[:, mask] / np.sqrt(problem.variances[k][mask])
            actual += float(np.sum((turns @ basis) ** 2))
            white += basis.shape[1] * (len(turns) - 1)
        found[channel] = max(actual / white, 0.05) if white else 1.0
    return found


def _basis(columns: Array) -> Array:
    """Orthonormal directions that the rows span, (position, direction)."""
    size = np.linalg.norm(columns, axis=1)
    rows = columns[size > 1e-12 * np.max(size, initial=0.0)]
    if not len(rows):
        return np.zeros((columns.shape[1], 0))
    rows = rows / np.linalg.norm(rows, axis=1)[:, None]
    _, sizes, directions = np.linalg.svd(rows, full_matrices=False)
    return np.asarray(directions[sizes > 1e-6 * sizes[0]].T)


# ---- the whole ------------------------------------------------------------------------------------------------


def spread_of(problem: FitProblem, x: Array) -> Covariances:
    """Covariance of the estimates by source, with its degrees of freedom."""
    count = len(x)
    rows = problem.jacobian(x)
    information = rows.T @ rows
    inverse, null = _inverse(information)
    turns, freedom, follows, alone = _between_turns(problem, x, inverse)
    test = lack_of_fit(problem, x)
    parts = {"scatter": turns}
    apart = _apart(problem, x, inverse, alone)
    if np.any(apart > 1):
        wider = np.sqrt(apart - 1)
        parts["conditions"] = turns * np.outer(wider, wider)
        between = np.full(count, max(len(alone) - 1.0, 1.0))
        freedom = _joined([(turns, freedom), (parts["conditions"], between)])
    steps = _steps(problem, x, inverse, range(len(problem.blocks)))
    if np.any(steps):
        parts["resolution"] = steps
    left, pieces = _left_over(problem, x, inverse, again=False)
    if np.any(left):
        freedom = _joined([(turns + parts.get("conditions", 0.0), freedom), (left, np.full(count, pieces))])
        parts["scatter"] = turns + left
    if test.misfit:
        found, pieces = _left_over(problem, x, inverse, again=True)
        freedom = _joined([(parts["scatter"] + parts.get("conditions", 0.0), freedom), (found, np.full(count, pieces))])
        parts["misfit"] = found
    for s, sensor in enumerate(problem.sensors, problem.count):
        if sensor.stated:
            parts[sensor.source] = parts.get(sensor.source, 0.0) + np.outer(inverse[:, s], inverse[:, s])
    whole = np.diagonal(np.sum(list(parts.values()), axis=0))
    random = np.diagonal(np.sum([parts[key] for key in RANDOM if key in parts], axis=0))
    with np.errstate(all="ignore"):  # Welch and Satterthwaite; what was stated has infinite freedom
        freedom = np.where(random > 0, freedom * (whole / random) ** 2, np.inf)
    beyond = beyond_stated(problem, x, information)
    return Covariances(information, inverse, null, parts, freedom, test, follows, apart[: problem.count], beyond)


def beyond_stated(problem: FitProblem, x: Array, information: Array) -> dict[int, float]:
    """What errors of sensors on a limit would come to without it, where that is more than any stated error may be.

    In standard uncertainties, by the place among the sensors. Of each the Newton step in which it alone leaves its
    limit, beside all that are on none: with what is stated of it more than `FAR`, and its size without that.
    """
    low, high = problem.bounds
    size = np.sqrt(np.maximum(np.diagonal(information), 1e-300))
    on = np.minimum(x - low, high - x) <= ON_LIMIT / size + 1e-9 * np.abs(x)
    places = [s for s in range(problem.count, len(x)) if on[s] and problem.sensors[s - problem.count].stated]
    slope = problem.jacobian(x).T @ problem.residuals(x) if places else x
    found = {}
    for s in places:
        own = np.flatnonzero(~on | (np.arange(len(x)) == s))
        stated = (own == s) * 1.0
        rows = information[np.ix_(own, own)]
        free, alone = (
            float(x[s] - stated @ _inverse(rows - left * np.diag(stated))[0] @ (slope[own] - left * stated * x[s]))
            for left in (0.0, 1.0)
        )
        if abs(free) >= FAR and free * x[s] > 0:
            found[s - problem.count] = alone
    return found


def _steps(problem: FitProblem, x: Array, inverse: Array, blocks: Sequence[int]) -> Array:
    """Covariance by readings that stick to steps: of a mean that does not get finer by more turns; of some blocks."""
    total = np.zeros_like(inverse)
    for k in blocks:
        block = problem.blocks[k]
        if block.fitted and block.unresolved:
            said, slopes = problem.said(x, k)
            columns = inverse @ (np.nan_to_num(slopes) * problem.weight(k))
            step, left = block.course.accuracy.resolution, block.course.accuracy.left
            if left is not None and left.every and block.course.unresolved:
                total += covariance_of_steps(columns, np.nan_to_num(said) / step, left) * step**2
            else:
                total += columns @ columns.T * block.unresolved**2
    return total


def _inverse(information: Array) -> tuple[Array, Array]:
    """Inverse, and the directions, in units of the unknowns, along which there is nothing to invert."""
    size = np.sqrt(np.diagonal(information))
    dead = size <= 1e-14 * np.max(size, initial=0.0)
    size = np.where(dead, 1.0, size)
    values, vectors = np.linalg.eigh(information / np.outer(size, size))
    lost = values <= SINGULAR * max(float(values[-1]), 1.0)
    kept = np.where(lost, 0.0, 1 / np.where(lost, 1.0, values))
    inverse = (vectors * kept) @ vectors.T / np.outer(size, size)
    return inverse, (vectors[:, lost] / size[:, None]).T


ON_LIMIT = 0.05  # of how well an unknown would be known by itself
SINGULAR = 1e-10  # of the largest eigenvalue of the scaled information: derivatives are exact to some 1e-12 of it


def _joined(parts: Sequence[tuple[Array, Array]]) -> Array:
    """Freedom of a sum of independent variances by Welch and Satterthwaite."""
    variances = [np.diagonal(covariance) for covariance, _ in parts]
    with np.errstate(all="ignore"):
        below = sum(v**2 / freedom for v, (_, freedom) in zip(variances, parts, strict=True))
        found = np.where(below > 0, sum(variances) ** 2 / below, np.inf)
    return np.asarray(found)


def _between_turns(problem: FitProblem, x: Array, inverse: Array) -> tuple[Array, Array, float, dict[int, Array]]:
    """Covariance by what each turn would have changed, its freedom, how turns follow each other, and its variances
    by condition, with their freedom last."""
    count = len(x)
    total, fourth = np.zeros((count, count)), np.zeros(count)
    products, squares, pairs = 0.0, 0.0, 0
    alone: dict[int, Array] = {}
    for condition in dict.fromkeys(block.condition for block in problem.blocks):
        own = [k for k, one in enumerate(problem.blocks) if one.condition == condition and one.fitted and one.repeats]
        if not own:
            continue
        turns = max(len(problem.blocks[k].turns) for k in own)
        moved, seam, rounding = np.zeros((turns, count)), np.zeros((count, count)), np.zeros(count)
        for k in own:  # the channels of a turn belong together
            part = _parts(problem, x, k, inverse)
            rounding += np.diagonal(_steps(problem, x, inverse, [k]))
            moved[: part.shape[1]] += np.sum(part, axis=2).T
            seam += _seam(part, _reach(problem.blocks[k]))
        covariance = moved.T @ moved * (turns / (turns - 1))
        seamed = covariance + seam
        if np.all(np.diagonal(seamed) >= 0.5 * np.diagonal(covariance)):
            covariance = seamed
        total += covariance
        alone[condition] = np.append(np.diagonal(covariance), turns - 1.0)
        fourth += np.diagonal(covariance) ** 2 / (turns - 1)
        size = np.sqrt(np.maximum(np.sum(moved**2, axis=0), 1e-300))[: problem.count]
        telling = size > np.sqrt(rounding[: problem.count]) + 1e-140  # else it is rounding that repeats
        unit = (moved[:, : problem.count] / size)[:, telling]
        products += float(np.sum(unit[1:] * unit[:-1])) + unit.shape[1] / turns  # its bias is −1/turns
        squares += unit.shape[1]
        pairs += (turns - 1) * bool(np.any(telling))
    variance = np.diagonal(total)
    with np.errstate(all="ignore"):
        freedom = np.where(fourth > 0, variance**2 / fourth, np.inf)
    follows = products / squares if pairs >= ENOUGH_PAIRS else float("nan")
    if follows > 2 / np.sqrt(max(pairs, 1)):  # as if there were fewer turns, for a first-order process
        wider = (1 + min(follows, 0.95)) / (1 - min(follows, 0.95))
        return total * wider, np.maximum(freedom / wider, 1.0), follows, alone
    return total, freedom, follows, alone


def _apart(problem: FitProblem, x: Array, inverse: Array, alone: dict[int, Array]) -> Array:
    """How much the conditions disagree in what they add to each unknown, over what their turns explain; 1 if by chance.

    What they add is 0 in all, so that of C conditions the sum of squares over variances is χ² of C − 1, or F for
    variances from few turns.
    """
    count = len(x)
    found = np.ones(count)
    if len(alone) < 3:
        return found
    squares = np.zeros(count)
    for condition, variances in alone.items():
        added, steps = np.zeros(count), np.zeros(count)
        for k, block in enumerate(problem.blocks):
            if block.condition == condition and block.fitted and block.repeats:
                gap = np.where(problem.masks[k], problem.misses(x, k, block.mean), 0.0)
                columns = inverse @ (np.nan_to_num(problem.said(x, k)[1]) * problem.weight(k))
                added += columns @ gap
                steps += np.sum((columns * block.unresolved) ** 2, axis=1)
        freedom = variances[-1]
        fair = (freedom - 2) / freedom if freedom > 2 else 0.3
        expected = variances[:-1] + steps
        squares += fair * added**2 / np.where(expected > 0, expected, np.inf)
    freedom = len(alone) - 1.0
    turns = float(np.median([one[-1] for one in alone.values()]))
    chance = special.fdtrc(freedom, max(freedom * turns, 4.0), squares / freedom)
    return np.asarray(np.where(chance < RARE, np.maximum(squares / freedom, 1.0), 1.0))


ENOUGH_PAIRS = 10  # of turns, to see whether they follow each other


# ---- what the model leaves over -------------------------------------------------------------------------------


def _powers(row: Array) -> Array:
    return np.asarray(np.abs(np.fft.rfft(row, axis=-1)) ** 2)


def _smooth(power: Array) -> Array:
    """Means over neighbouring frequencies."""
    width = min(NEIGHBOURS, len(power))
    weights = np.ones(width)
    return np.asarray(np.convolve(power, weights, "same") / np.convolve(np.ones(len(power)), weights, "same"))


def _doubled(size: int) -> Array:
    """How many real numbers a frequency of a course of this size has: 2 but for the first and a last even one."""
    found = np.full(size // 2 + 1, 2.0)
    found[0] = 1.0
    if size % 2 == 0 and size > 1:
        found[-1] = 1.0
    return found


def lack_of_fit(problem: FitProblem, x: Array) -> Test:
    """χ² of the residuals of the means, frequency by frequency, against the scatter between turns.

    A frequency of the residual has the variance that it has between turns, over their number: noise may be coloured as
    it likes. What the sum comes to if the model is right, and how much it varies, is seen from the same sum of each
    turn; it is taken as g χ²_h with the g and h of that mean and variance (Satterthwaite).
    """
    value, mean, variance = 0.0, 0.0, 0.0
    for condition in dict.fromkeys(block.condition for block in problem.blocks):
        own = [k for k, one in enumerate(problem.blocks) if one.condition == condition and one.fitted and one.repeats]
        found = [_weighed(problem, x, k) for k in own if np.any(problem.masks[k])]
        if not found:
            continue
        value += sum(one[0] for one in found)
        each = np.sum([one[1] for one in found if len(one[1]) == len(found[0][1])], axis=0)
        turns = len(each)
        mean += float(np.mean(each)) + sum(float(np.mean(one[1])) for one in found if len(one[1]) != turns)
        least = sum(one[2] for one in found)
        variance += max(float(np.var(each, ddof=1)), least) * (1 + 1 / turns)
    mean -= min(float(problem.count), 0.5 * mean)
    if mean <= 0 or variance <= 0:
        return Test(float("nan"), float("nan"), float("nan"))
    scale = variance / (2 * mean)
    freedom = mean / scale
    return Test(value / mean, freedom, float(special.chdtrc(freedom, value / scale)))


def _weighed(problem: FitProblem, x: Array, k: int) -> tuple[float, Array, float]:
    """Sum over the frequencies of the residual, that of each turn, and the least variance it has, of normal noise."""
    block = problem.blocks[k]
    mask, count = problem.masks[k] & (block.count > 1), len(block.turns)
    gap = np.where(mask, problem.misses(x, k, block.mean), 0.0)
    turns = np.where(mask, block.spread * np.sqrt(count / np.maximum(block.count, 1)), 0.0)  # fewer: a larger variance
    powers = _powers(turns) / (count - 1)  # the mean has that of one turn over their number
    steps = np.count_nonzero(mask) * block.unresolved**2
    scatter = _smooth(np.sum(powers, axis=0) / count) + steps
    floor = np.maximum(scatter, FLOOR * float(np.mean(scatter)))
    weights = _doubled(len(mask)) / floor
    many = min(NEIGHBOURS, len(scatter)) * 2.0 * (count - 1)
    fair = (many - 2) / many if many > 4 else 0.5  # 1/variance is too large on average
    least = 2 * float(np.sum(weights * scatter * (scatter / floor)))
    each = powers @ weights + float(np.sum(weights * steps))
    return float(np.sum(weights * fair * _powers(gap))), np.asarray(each), least


def left_over(problem: FitProblem, spread: Covariances) -> float:
    """How much more than the scatter the misfit and the conditions move the estimates, as variances; 1 without."""
    more = np.diagonal(np.sum([spread.parts[key] for key in RANDOM if key in spread.parts], axis=0))
    scatter = np.diagonal(spread.parts["scatter"])
    known = scatter[: problem.count] > 0
    return (
        float(np.mean((more / np.where(scatter > 0, scatter, 1.0))[: problem.count][known])) if np.any(known) else 1.0
    )


def _left_over(problem: FitProblem, x: Array, inverse: Array, again: bool) -> tuple[Array, float]:
    """Covariance by the residuals of the means, as correlated as they are along the cycle, and its freedom.

    again: beside the scatter between turns, as a misfit of the model; it is larger by as much as the conditions
    resemble each other. Else of blocks without repetitions.
    """
    count = len(x)
    total = np.zeros((count, count))
    pieces, gaps = 0.0, []
    for k, block in enumerate(problem.blocks):
        mask = problem.masks[k]
        if not block.fitted or block.repeats != again or not np.any(mask):
            continue
        gap = np.where(mask, problem.misses(x, k, block.mean), 0.0)
        power = _smooth(_powers(gap))
        columns = np.nan_to_num(problem.said(x, k)[1]) * problem.weight(k)
        spectrum = np.fft.rfft(inverse @ columns, axis=-1)
        own = _doubled(len(mask)) * power / len(mask) ** 2
        total += np.real((spectrum * own) @ spectrum.conj().T)
        real = _doubled(len(mask)) * power
        pieces += float(np.sum(real) ** 2 / np.sum(real * power)) if np.any(power) else 0.0
        gaps.append((block.channel, gap))
    if not gaps:
        return total, np.inf
    left = max(pieces - count, 1.0)
    if not again:
        return total * max(pieces, 1.0) / left, left
    alike = _alike(gaps)
    return total * alike * max(pieces, 1.0) / left, max(left / alike, 1.0)


def _alike(gaps: Sequence[tuple[str, Array]]) -> float:
    """How many conditions tell the same of a misfit: 1 if each has its own, their number if all have one."""
    most = 1.0
    for channel in dict.fromkeys(name for name, _ in gaps):
        rows = [gap for name, gap in gaps if name == channel]
        if len({len(row) for row in rows}) > 1:
            most = max(most, float(len(rows)))
            continue
        own = float(sum(np.sum(row**2) for row in rows))
        together = float(np.sum(np.sum(rows, axis=0) ** 2))
        most = max(most, together / own if own > 0 else 1.0)
    return most
