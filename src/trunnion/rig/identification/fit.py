"""Least squares with exact derivatives: data, errors that are stated of the sensors, residuals and their search.

A sensor reads (1 + g) f + z of what there is: f of the model, counted from the datum of the sensor, g and z its errors,
the same at every position. They are unknowns too, in units of their standard uncertainties, each with the observation
0 ± 1 and within ± `most`: what is further off is no error that was stated. So is an error a of the crank angle, in
shares of the cycle, by which the model is read at φ − a. The turns of a condition are its independent repetitions;
within a turn neighbours may be correlated as they like.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.optimize import least_squares

from trunnion.errors import Status
from trunnion.rig.identification.signals import Courses, Model
from trunnion.rig.reading.measurement import Accuracy, Condition, Signal, rms

__all__ = ["FAR", "FILE_ZERO", "Block", "Fit", "SensorError", "Solution", "corners", "refined",
           "sensor_errors", "shared_zero", "sizes_of", "solved"]  # fmt: skip

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
    in shares of the cycle; 0 in blocks of other sensors. group: of one of many, what they are together; most:
    what it may come to, in its standard uncertainties;
    angle: of an error of the crank angle that has one size in all conditions, that, rad; stated: whether anything is
    known of it; one that is not is free.
    """

    name: str
    channel: str
    kind: str
    sizes: Array
    group: str = ""
    most: float = FAR
    angle: float = 0.0
    stated: bool = True

    @property
    def limits(self) -> tuple[float, float]:
        """In its standard uncertainties."""
        most, largest = self.most if self.stated else inf, float(np.max(self.sizes))
        return (max((LEAST - 1) / largest, -most) if self.kind == "gain" and largest > 0 else -most), most


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


class Evaluations:
    """The model at values of the unknowns; the last few are kept. progress: called with the number of evaluations."""

    def __init__(self, model: Model, progress: Callable[[int], None] = lambda count: None) -> None:
        self.model, self.progress, self.count = model, progress, 0
        self._last: dict[bytes, Courses] = {}

    def __call__(self, at: Array) -> Courses:
        key = at.tobytes()
        if key not in self._last:
            while len(self._last) > 3:
                self._last.pop(next(iter(self._last)))
            self._last[key] = self.model.courses(at)
            self.count += 1
            self.progress(self.count)
        return self._last[key]


@dataclass(frozen=True)
class Fit:
    """What is fitted: the model to the blocks, with errors of the sensors.

    x stands for unknowns and sensors, (unknown and sensor,). masks: positions used, by block; variances: of one turn,
    by block, as it is weighed; inflation: of these for a misfit, so that it does not outweigh what is stated of the
    sensors. Another choice of these is another Fit, see `refined`.
    """

    courses_at: Evaluations
    blocks: Sequence[Block]
    sensors: Sequence[SensorError]
    guard: int | None = None
    masks: Sequence[Mask] = ()
    variances: Sequence[float] = ()
    inflation: float = 1.0

    @property
    def model(self) -> Model:
        return self.courses_at.model

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
        return np.array([unknown.start for unknown in self.model.unknowns] + [0.0] * len(self.sensors))

    @cached_property
    def prior(self) -> Array:
        """Weight of what was stated, (unknown and sensor,): 1 of sensors, 0 of what nothing is stated of."""
        return np.array([0.0] * self.count + [float(error.stated) for error in self.sensors])

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Limits of unknowns and sensors."""
        ends = [(unknown.lower, unknown.upper) for unknown in self.model.unknowns]
        low, high = np.array([*ends, *(error.limits for error in self.sensors)]).T
        return low, high

    def courses(self, x: Array) -> Courses:
        """The model at the unknowns of x."""
        return self.courses_at(np.asarray(x[: self.count], float))

    def reading(self, x: Array, k: int) -> tuple[Array, Array]:
        """What the sensor of a block would read, (position,), and its derivatives, (unknown and sensor, position)."""
        block = self.blocks[k]
        modelled, datum = self.courses(x).by_condition[block.condition][block.channel], block.signal.accuracy.datum
        value, slope = modelled.value, modelled.slope
        acting = [(s, error.kind, error.sizes[k]) for s, error in enumerate(self.sensors, self.count) if error.sizes[k]]
        zero, gain, angle = (
            float(sum(size * x[s] for s, kind, size in acting if kind == of)) for of in ("zero", "gain", "angle")
        )
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

    # ---- what is used, and how much it weighs -----------------------------------------------------------------

    def allowed(self, x: Array) -> list[Mask]:
        """Positions of each block where the model has a sound answer and the data have a value."""
        masks, courses = [], self.courses(x)
        for k, block in enumerate(self.blocks):
            status, turned = courses.status[block.condition], courses.turned[block.condition]
            value = courses.by_condition[block.condition][block.channel].value
            if self.model.measures[block.channel].of_motion:  # whatever forces do
                good = (status < Status.SINGULAR) & (status != Status.NEAR_SINGULAR)
            else:
                guard = -(-len(value) // PER_GUARD) if self.guard is None else self.guard
                u = np.sqrt(self.variances[k] / np.maximum(block.signal.count, 1) + block.unresolved**2)
                phase, bends = self.model.phases[block.condition], self.model.bends[block.condition]
                closed = self.model.run.cycle.periodic
                edges = turned | corners(value, phase, bends, u, turned, closed=closed, guard=guard)
                for _ in range(guard - 1):
                    edges = edges | np.roll(edges, 1) | np.roll(edges, -1)
                good = (status == Status.SOLVED) & ~(edges & (guard > 0))
            masks.append(good & np.isfinite(block.signal.mean) & np.isfinite(value))
        return masks

    def first_scatter(self) -> list[float]:
        """Variances by the scatter of the turns; a guess where there is none."""
        return [
            block.variance if block.repeats else (GUESS * (rms(block.signal.mean) or 1.0)) ** 2 for block in self.blocks
        ]

    def learnt_scatter(self, x: Array) -> list[float]:
        """Variances by channel: of blocks without repetitions by their residuals, of others by how far neighbours of a
        turn vary together.

        There it is the variance of the scores between turns over what independent positions would give, in all
        directions that the unknowns move the course in; 1 for white noise.
        """
        variances = self.first_scatter()
        for channel in dict.fromkeys(block.channel for block in self.blocks):
            every = [k for k in self.fitted if self.blocks[k].channel == channel and np.any(self.masks[k])]
            if single := [k for k in every if not self.blocks[k].repeats]:
                gap = np.concatenate([self.gap(x, k)[self.masks[k]] for k in single])
                least = (ROUNDING * max(float(np.nanmax(np.abs(self.blocks[k].signal.mean))) for k in single)) ** 2
                learnt = max(float(np.sum(gap**2)) / max(gap.size - len(x), 1), least, 1e-300)
                variances = [learnt if k in single else variance for k, variance in enumerate(variances)]
            scores, white = 0.0, 0.0
            for k in set(every) - set(single):
                mask, block = self.masks[k], self.blocks[k]
                basis = _basis(np.nan_to_num(self.reading(x, k)[1][:, mask]))
                scores += float(np.sum((block.spread[:, mask] @ basis) ** 2)) / block.variance
                white += basis.shape[1] * (len(block.signal.turns) - 1)
            for k, block in enumerate(self.blocks):
                if block.channel == channel and block.repeats and white:
                    variances[k] *= max(scores / white, 0.05)
        return variances


def _basis(rows: Array) -> Array:
    """Orthonormal directions that rows span, (position, direction)."""
    size = np.linalg.norm(rows, axis=1)
    large = size > 1e-12 * np.max(size, initial=0.0)
    _, sizes, directions = np.linalg.svd(rows[large] / size[large, None], full_matrices=False)
    return np.asarray(directions[sizes > 1e-6 * np.max(sizes, initial=0.0)].T)


NEARBY = 15  # positions about a corner, whose second differences tell it from a curve
STANDS_OUT = 1.5  # times the second differences nearby, by which a corner differs from a curve
ROUNDED = 1 / 8  # of a change of slope per position: the mean of |x|/2 over a position, at its corner
TOO_MUCH = 0.25  # of the standard uncertainty of the mean: what is rounded off by more is left out
MOST = 1 / 3  # of the positions, that are left out at corners: of a table of very many points the largest only


def corners(
    value: Array, phase: Array, bends: Array, uncertainty: Array, excluded: Mask, *, closed: bool, guard: int
) -> Mask:
    """The positions before and after each corner or jump that resampling rounds off by more than the data hide.

    A value at a position is the mean of the samples about it, or lies on a cubic through four of them: a change of
    slope by d per position is rounded off by up to d/8, in every turn alike.

    Parameters
    ----------
    value, phase, uncertainty : (position,), the course of the model, the share of the cycle, the standard uncertainty
        of the measured mean.
    bends : shares of the cycle at which the model may bend or jump.
    excluded : (position,), where it is known to jump already.
    closed : whether the cycle repeats.
    guard : positions that will be left out on each side.
    """
    size, marked = len(value), np.zeros(len(value), bool)
    if size < NEARBY or not bends.size:
        return marked
    bend = np.nan_to_num(np.abs(np.roll(value, -1) - 2 * value + np.roll(value, 1)))
    if not closed:
        bend[[0, -1]] = 0.0
    usual = median_filter(bend, NEARBY, mode="wrap" if closed else "nearest")
    order = np.argsort(phase)
    before = np.unique(np.searchsorted(phase[order], bends + 1e-9, side="right") - 1)  # a bend at a position is after
    if not closed:
        before = before[(before >= 0) & (before < size - 1)]
    pairs = order[np.stack([before, before + 1]) % size]
    level, peak = np.min(usual[pairs], axis=0), np.max(bend[pairs], axis=0)
    off = ROUNDED * (peak - level) / np.maximum(np.min(uncertainty[pairs], axis=0), 1e-300)
    off[(peak <= STANDS_OUT * level) | (off <= TOO_MUCH) | np.any(excluded[pairs], axis=0)] = 0.0
    largest = np.argsort(-off)[: max(1, int(MOST * size / (2 * max(guard, 1))))]
    marked[pairs[:, largest[off[largest] > 0]]] = True
    return marked


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
    fit = replace(fit, variances=fit.first_scatter())
    fit = replace(fit, masks=fit.allowed(start))
    low, high = fit.bounds
    room = np.minimum(INSIDE * sizes_of(fit, start), 0.25 * (high - low))
    best = solved(fit, np.clip(start, low + room, high - room))
    for _ in range(ROUNDS):
        other = replace(fit, variances=fit.learnt_scatter(best.x), masks=fit.allowed(best.x))
        same = all(np.array_equal(a, b) for a, b in zip(other.masks, fit.masks, strict=True))
        if same and np.allclose(other.variances, fit.variances, rtol=SETTLED, atol=0.0, equal_nan=True):
            return fit, best._replace(settled=True)
        fit, best = other, solved(other, best.x)
    return fit, best


def sizes_of(fit: Fit, x: Array) -> Array:
    """How large each unknown is: by the model or the estimate; of one that is 0, what would change the data visibly."""
    sizes = [max(unknown.size, abs(value)) for unknown, value in zip(fit.model.unknowns, x[: fit.count], strict=True)]
    pulled = np.linalg.norm(fit.jacobian(x), axis=0)
    data = float(
        np.sqrt(sum(np.sum(np.nan_to_num(fit.blocks[k].signal.mean) ** 2 * fit.weight(k)) for k in fit.fitted))
    )
    every = [size or (EFFECT * data / by if by else 1.0) for size, by in zip(sizes, pulled[: fit.count], strict=True)]
    return np.array(every + [1.0] * len(fit.sensors))
