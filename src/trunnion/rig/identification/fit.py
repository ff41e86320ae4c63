"""Least squares with exact derivatives: data, errors that are stated of the sensors, residuals and their search.

A sensor reads (1 + g) f + z of what there is: f of the model, counted from the datum of the sensor, g and z its errors,
the same at every position. They are unknowns too, in units of their standard uncertainties, each with the observation
0 ± 1 and within ± `most`: what is further off is no error that was stated. So is an error a of the crank angle, in
shares of the cycle, by which the model is read at φ − a. The turns of a condition are its independent repetitions;
within a turn neighbours may be correlated as they like.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from math import inf
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, median_filter
from scipy.optimize import least_squares

from trunnion.errors import Status
from trunnion.rig.identification.signals import Courses, Model
from trunnion.rig.reading.measurement import Accuracy, Condition, Signal, rms

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
FILE_ZERO, FILE_ANGLE = "zero of each file", "angle of each condition"  # the latter by the sampling of pulses
ROUNDING = 1e-9  # of a course, by interpolation and sums
FAR_ABOVE = 100.0  # times the rounding: scatter beside which it is nothing
MOST_EVALUATIONS = 100
TOLERANCE = 1e-10  # of cost and step: far below what data of any scatter tell
PER_GUARD = 90  # positions of a cycle for each that is left out beside a jump, which resampling smears
FAR = 5.0  # standard uncertainties: what a stated error may come to at most
LEAST = 1e-6  # of the model, that a sensor reads at least: N mm for kN m; 0 would do away with the model
GUESS = 0.01  # of a course: the scatter of one without repetitions, until its residuals are known
ROUNDS = 4  # of what is used and how much it weighs
SETTLED = 0.05  # of a variance: changes below it do not call for another round
INSIDE = 0.05  # of the size of an unknown: how far from its limit a search begins
EFFECT = 0.1  # of a course: what an unknown whose own size says nothing is to change to be counted as large


@dataclass(frozen=True)
class Block:
    """One channel in one condition. condition: its index; held: whether it is not fitted but predicted."""

    condition: int
    channel: str
    signal: Signal
    held: bool = False

    @cached_property
    def spread(self) -> Array:
        """Turns from their mean, (turn, position), larger by √((turns − 1)/(m − 1)) where only m turns have a value.

        The sum of their squares is then (turns − 1) variances of one turn, wherever values are missing.
        """
        missing = np.sqrt((len(self.signal.turns) - 1) / np.maximum(self.signal.count - 1, 1))
        return np.asarray(np.nan_to_num(self.signal.turns - self.signal.mean) * missing)

    @cached_property
    def repeats(self) -> bool:
        """Whether it shows how much turns scatter."""
        return bool(len(self.signal.turns) > 1 and np.any(self.spread != 0))

    def pooled(self, mask: Mask) -> float:
        """Variance of one turn, pooled over some positions, (position,); NaN where none of them repeats.

        Weights that follow the scatter from place to place would trust most where it happens to be small.
        """
        freedom = int(np.sum(np.maximum(self.signal.count - 1, 0)[mask]))
        squares = np.nan_to_num(self.signal.turns - self.signal.mean)[:, mask] ** 2
        return float(np.sum(squares) / freedom) if freedom else float("nan")

    @cached_property
    def variance(self) -> float:
        """Variance of one turn, pooled over all positions; NaN if it does not repeat."""
        return self.pooled(np.isfinite(self.signal.mean)) if self.repeats else float("nan")

    @cached_property
    def unresolved(self) -> float:
        """Standard uncertainty that more turns do not lessen: by steps between readings, or by rounding of numbers."""
        rounding = ROUNDING * float(np.nanmax(np.abs(self.signal.turns), initial=0.0))
        far_above = self.repeats and self.variance > (FAR_ABOVE * rounding) ** 2
        return max(float(self.signal.unresolved), 0.0 if far_above else rounding)


# ---- errors of the sensors ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class SensorError:
    """One error of a sensor, "zero" or "gain", or of the crank angle, "angle".

    channel: empty of the angle; sizes: its standard uncertainty in each block, in the unit of the course, relative, or
    in shares of the cycle; 0 in blocks of other sensors. group: of one of many, what they are together; most: what it
    may come to, in its standard uncertainties; angle: of an error of the crank angle that has one size in all
    conditions, that, rad; stated: whether anything is known of it; one that is not is free.
    """

    name: str
    channel: str
    kind: str
    sizes: Array
    group: str = ""
    most: float = FAR
    angle: float = 0.0
    stated: bool = True


def shared_zero(accuracy: Accuracy) -> float:
    """Standard uncertainty of the zero that all files share: without what each has by itself."""
    return inf if np.isinf(accuracy.zero) else float(np.sqrt(max(accuracy.zero**2 - accuracy.own**2, 0.0)))


def sensor_errors(model: Model, conditions: Sequence[Condition], blocks: Sequence[Block]) -> list[SensorError]:
    """All that is stated of the sensors; an infinite standard uncertainty says that nothing is known."""
    errors: dict[str, SensorError] = {}

    def add(k: int, size: float, name: str, channel: str, kind: str, group: str = "", *more: float) -> None:
        if size:
            error = SensorError(name, channel, kind, np.zeros(len(blocks)), group, *more)  # type: ignore[arg-type]
            errors.setdefault(name, error).sizes[k] = size

    for k, block in enumerate(blocks):
        condition, accuracy, channel = conditions[block.condition], block.signal.accuracy, block.channel
        add(k, float(np.hypot(shared_zero(accuracy), accuracy.cut)), f"zero of {channel}", channel, "zero")
        add(k, accuracy.gain, f"gain of {channel}", channel, "gain")
        group, file = f"{FILE_ZERO} of {channel}", " ".join(condition.files or (str(block.condition),))
        add(k, accuracy.own, f"{group}: {file}", channel, "zero", group)
        duration, _, turn = model.cycles[block.condition]
        add(k, condition.lag / (duration or inf), f"{FILE_ANGLE}: {condition.name}", "", "angle", FILE_ANGLE)
        if condition.cut and np.isfinite(turn):  # may be anything up to half a step
            size = abs(condition.cut)
            name = f"angle in steps of {np.degrees(size * 12**0.5):.4g} deg"
            add(k, condition.cut / turn, name, "", "angle", "", 3**0.5, size)
    for name, error in errors.items():
        if np.isinf(error.sizes).any():
            every = [np.ravel(block.signal.turns) for block in blocks if block.channel == error.channel]
            usual = (rms(np.concatenate(every)) if error.kind == "zero" and every else 0.0) or 1.0
            sizes = np.where(np.isinf(error.sizes), usual, error.sizes)
            errors[name] = replace(error, sizes=sizes, stated=False)
    order = ("zero", "gain", "angle")
    return sorted(errors.values(), key=lambda item: (bool(item.group), order.index(item.kind)))


# ---- the problem ----------------------------------------------------------------------------------------------


def evaluations(model: Model, progress: Callable[[int], None] = lambda count: None) -> Any:
    """The model as a function of the bytes of its unknowns; the last few are kept, and `cache_info` has their number.

    progress: called with how many there were.
    """

    @lru_cache(maxsize=4)
    def courses(at: bytes) -> Sequence[Courses]:
        progress(courses.cache_info().misses)
        return model.courses(np.frombuffer(at))

    return courses


@dataclass(frozen=True)
class Fit:
    """What is fitted: the model to the blocks, with errors of the sensors.

    x stands for unknowns and sensors, (unknown and sensor,). evaluate: the courses at the bytes of the unknowns, see
    `evaluations`. masks: positions used, by block; variances: of one turn,
    by block, as it is weighed; inflation: of these for a misfit, so that it does not outweigh what is stated of the
    sensors. Another choice of these is another Fit, see `refined`.
    """

    model: Model
    evaluate: Any
    blocks: Sequence[Block]
    sensors: Sequence[SensorError]
    guard: int | None = None
    masks: Sequence[Mask] = ()
    variances: Sequence[float] = ()
    inflation: float = 1.0

    @property
    def count(self) -> int:
        """Unknowns of the model."""
        return len(self.model.unknowns)

    @cached_property
    def fitted(self) -> list[int]:
        """The blocks that are not held out."""
        return [k for k, block in enumerate(self.blocks) if not block.held]

    @cached_property
    def start(self) -> Array:
        """Unknowns as stated, sensors without errors."""
        return np.append(self.model.start, np.zeros(len(self.sensors)))

    @cached_property
    def prior(self) -> Array:
        """Weight of what was stated, (unknown and sensor,): 1 of sensors, 0 of what nothing is stated of."""
        return np.array([0.0] * self.count + [float(error.stated) for error in self.sensors])

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Limits of unknowns and sensors."""
        ends = [(unknown.lower, unknown.upper) for unknown in self.model.unknowns]
        for error in self.sensors:
            most, largest = error.most if error.stated else inf, float(np.max(error.sizes))
            least = (LEAST - 1) / largest if error.kind == "gain" and largest > 0 else -inf
            ends.append((max(least, -most), most))
        low, high = np.array(ends).T
        return low, high

    def courses(self, x: Array) -> Sequence[Courses]:
        """The model at the unknowns of x, by condition."""
        return self.evaluate(np.asarray(x[: self.count], float).tobytes())  # type: ignore[no-any-return]

    def reading(self, x: Array, k: int) -> tuple[Array, Array]:
        """What the sensor of a block would read, (position,), and its derivatives, (unknown and sensor, position)."""
        block = self.blocks[k]
        modelled, datum = self.courses(x)[block.condition], block.signal.accuracy.datum
        value, slope = modelled.values[block.channel], modelled.slopes[block.channel]
        acting = [(s, error.kind, error.sizes[k]) for s, error in enumerate(self.sensors, self.count) if error.sizes[k]]
        zero, gain, angle = (float(sum(size * x[s] for s, kind, size in acting if kind == of))
                             for of in ("zero", "gain", "angle"))  # fmt: skip
        by_share = self.model.by_share(block.condition, value) if any(kind == "angle" for _, kind, _ in acting) else 0.0
        if angle:
            slope = slope - angle * self.model.by_share(block.condition, slope)
            value = value - angle * by_share
        columns = np.zeros((len(x), len(value)))
        columns[: self.count] = (1 + gain) * slope
        shapes = {"zero": 1.0, "gain": value - datum, "angle": -(1 + gain) * by_share}
        for s, kind, error in acting:
            columns[s] = error * shapes[kind]
        return (1 + gain) * (value - datum) + datum + zero, columns

    def gap(self, x: Array, k: int) -> Array:
        """Mean of the turns less what the sensor would read, (position,); angles by the nearest turn."""
        gap = self.blocks[k].signal.mean - self.reading(x, k)[0]
        turning = self.model.measures[self.blocks[k].channel].turning(self.model.run.system)
        return np.asarray((gap + np.pi) % (2 * np.pi) - np.pi if turning else gap)

    def weight(self, k: int) -> Array:
        """1/variance of the mean at each position of a block, 0 where it is not used."""
        block = self.blocks[k]
        scatter = self.variances[k] * self.inflation / np.maximum(block.signal.count, 1)
        return np.where(self.masks[k], 1 / (scatter + block.unresolved**2), 0.0)

    def residuals(self, x: Array) -> Array:
        """Weighted residuals of all used positions, then those of the sensors."""
        rows = [(np.sqrt(self.weight(k)) * self.gap(x, k))[self.masks[k]] for k in self.fitted]
        return np.concatenate([*rows, (x * self.prior)[self.count :]])

    def jacobian(self, x: Array) -> Array:
        """Derivatives of the residuals, (residual, unknown and sensor)."""
        rows = [-(np.sqrt(self.weight(k)) * self.reading(x, k)[1]).T[self.masks[k]] for k in self.fitted]
        rows.append(np.diag(self.prior)[self.count :])
        return np.nan_to_num(np.concatenate(rows), nan=0.0, posinf=0.0, neginf=0.0)

    def allowed(self, x: Array) -> list[Mask]:
        """Positions of each block where the model has a sound answer, and model and data have a reading."""
        masks, courses = [], self.courses(x)
        for k, block in enumerate(self.blocks):
            modelled = courses[block.condition]
            value, status = modelled.values[block.channel], modelled.status
            if self.model.measures[block.channel].of_motion:  # whatever forces do
                good = (status < Status.SINGULAR) & (status != Status.NEAR_SINGULAR)
            else:
                guard = -(-len(value) // PER_GUARD) if self.guard is None else self.guard
                u = np.sqrt(self.variances[k] / np.maximum(block.signal.count, 1) + block.unresolved**2)
                edges = beside(modelled.turned, guard)
                edges |= corners(value, u, closed=self.model.run.cycle.periodic, guard=guard)
                good = (status == Status.SOLVED) & ~edges
            masks.append(good & np.isfinite(self.gap(x, k)))
        return masks

    def scatter(self, x: Array | None = None) -> list[float]:
        """Variances of one turn, by block: over the positions that are used at x, over all without it.

        Of blocks without repetitions those of the residuals of their channels at x, a guess without it.
        """
        if x is None:
            guesses = [(GUESS * (rms(block.signal.mean) or 1.0)) ** 2 for block in self.blocks]
            return [block.variance if block.repeats else guesses[k] for k, block in enumerate(self.blocks)]
        variances = list(self.variances)
        for channel in dict.fromkeys(block.channel for block in self.blocks):
            used = [k for k in self.fitted if self.blocks[k].channel == channel and np.any(self.masks[k])]
            for k in (k for k in used if self.blocks[k].repeats):
                pooled = self.blocks[k].pooled(self.masks[k])
                variances[k] = pooled if pooled > 0 else variances[k]
            if single := [k for k in used if not self.blocks[k].repeats]:
                gap = np.concatenate([self.gap(x, k)[self.masks[k]] for k in single])
                least = (ROUNDING * max(float(np.nanmax(np.abs(self.blocks[k].signal.mean))) for k in single)) ** 2
                learnt = max(float(np.sum(gap**2)) / max(gap.size - len(x), 1), least, 1e-300)
                variances = [learnt if k in single else variance for k, variance in enumerate(variances)]
        return variances


NEARBY = 15  # positions about a corner, whose second differences tell it from a curve
STANDS_OUT = 1.5  # times the second differences nearby, by which a corner differs from a curve
ROUNDED = 1 / 8  # of a change of slope per position: the mean of |x|/2 over a position, at its corner
TOO_MUCH = 0.25  # of the standard uncertainty of the mean: what is rounded off by more is left out
MOST = 1 / 3  # of the positions, that are left out at corners: of a table of very many points the largest only


def corners(value: Array, uncertainty: Array, *, closed: bool, guard: int) -> Mask:
    """The positions about each corner or jump of a model's course that resampling rounds off by more than data hide.

    A value at a position is the mean of the samples about it, or lies on a cubic through four of them: a change of
    slope by d per position is rounded off by up to d/8, in every turn alike.

    Parameters
    ----------
    value, uncertainty : (position,), the course of the model, the standard uncertainty of the measured mean.
    closed : whether the cycle repeats.
    guard : positions to leave out on each side.
    """
    bend = np.nan_to_num(np.abs(np.roll(value, -1) - 2 * value + np.roll(value, 1)))
    if not closed:
        bend[[0, -1]] = 0.0
    usual = median_filter(bend, NEARBY, mode="wrap" if closed else "nearest")
    off = ROUNDED * (bend - usual) / np.maximum(uncertainty, 1e-300)
    off[(bend <= STANDS_OUT * usual) | (off <= TOO_MUCH)] = 0.0
    sizes = np.append(np.unique(off[off > 0]), np.inf)  # the least from which on not too many are left out
    k = bisect_left(range(len(sizes) - 1), True, key=lambda i: bool(np.mean(beside(off >= sizes[i], guard)) <= MOST))
    return beside(off >= sizes[k], guard)


def beside(mask: Mask, guard: int) -> Mask:
    """Positions that are fewer than so many beside one of a mask, over the end of the cycle too."""
    return np.asarray(maximum_filter1d(mask, 2 * guard - 1, mode="wrap") if guard > 0 else np.zeros_like(mask))


# ---- the search -----------------------------------------------------------------------------------------------


class Solution(NamedTuple):
    """Where a search ended, whether it converged, and whether what is used and how much it weighs came to rest."""

    x: Array
    evaluations: int
    converged: bool
    settled: bool = False


def solved(fit: Fit, start: Array) -> Solution:
    """The trust-region search of SciPy within the limits; steps to where there is no answer are taken back."""
    low, high = fit.bounds
    result = least_squares(
        fit.residuals, np.clip(start, low, high), fit.jacobian, (low, high), "trf", ftol=TOLERANCE, xtol=TOLERANCE,
        gtol=TOLERANCE, x_scale="jac", max_nfev=MOST_EVALUATIONS,
    )  # fmt: skip
    return Solution(np.asarray(result.x), int(result.nfev), bool(result.status > 0))


def refined(fit: Fit, start: Array) -> tuple[Fit, Solution]:
    """The fit whose weights and used positions are those of where it ends, from a start that is moved off the limits.

    On a limit a search would not get off.
    """
    fit = replace(fit, variances=fit.scatter())
    fit = replace(fit, masks=fit.allowed(start))
    low, high = fit.bounds
    room = np.minimum(INSIDE * sizes_of(fit, start), 0.25 * (high - low))
    best = solved(fit, np.clip(start, low + room, high - room))
    for _ in range(ROUNDS):
        other = replace(fit, variances=fit.scatter(best.x), masks=fit.allowed(best.x))
        same = all(np.array_equal(a, b) for a, b in zip(other.masks, fit.masks, strict=True))
        if same and np.allclose(other.variances, fit.variances, rtol=SETTLED, atol=0.0, equal_nan=True):
            return fit, best._replace(settled=True)
        fit, best = other, solved(other, best.x)
    return fit, best


def sizes_of(fit: Fit, x: Array) -> Array:
    """How large each unknown is: by the model or the estimate; of one that is 0, what would change the data visibly."""
    sizes = [max(unknown.size, abs(value)) for unknown, value in zip(fit.model.unknowns, x[: fit.count], strict=True)]
    pulled = np.linalg.norm(fit.jacobian(x), axis=0)
    squares = [np.sum(np.nan_to_num(fit.blocks[k].signal.mean) ** 2 * fit.weight(k)) for k in fit.fitted]
    data = float(np.sqrt(sum(squares)))
    every = [size or (EFFECT * data / by if by else 1.0) for size, by in zip(sizes, pulled[: fit.count], strict=True)]
    return np.array(every + [1.0] * len(fit.sensors))
