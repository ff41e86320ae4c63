"""Least squares with exact derivatives: residuals of all blocks, and of the errors that are stated of the sensors.

A sensor reads (1 + g) f + z of what there is: f of the model, counted from the datum of the sensor, g and z its errors,
the same at every position. They are unknowns too, in units of their standard uncertainties, each with the observation
0 ± 1: what is stated of it, and within ± `most`: what is further off is no error that was stated. So is a delay τ of
the sensor behind the angle, of which f − τ df/dt is there to be read.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Status
from trunnion.rig.identification.blocks import OWN, Block, shared_zero
from trunnion.rig.identification.corners import corners
from trunnion.rig.identification.signals import Courses, Model

__all__ = ["FitProblem", "LeastSquaresFit", "SensorError", "fit", "sensors_of"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
MOST_EVALUATIONS = 100
TOLERANCE = 1e-10  # of cost and step: far below what data of any scatter tell
PER_GUARD = 90  # positions of a cycle for each that is left out beside a jump, which resampling smears
ANGLE = "angle of each condition"  # by the sampling of pulses
FAR = 5.0  # standard uncertainties: what a stated error may come to at most
HALF_STEP = 3**0.5  # standard uncertainties of an error that may be anything up to half a step
LEAST_GAIN = 0.1  # of the model: what a sensor reads at least, 0 would do away with the model
GUESS = 0.01  # of a course: the scatter of one without repetitions, until its residuals are known


@dataclass(frozen=True)
class SensorError:
    """One error of a sensor: its zero, its gain, or by how much it lags behind.

    sizes: its standard uncertainty in each block, in the unit of the course or relative, 0 in blocks of other sensors;
    of a sensor behind a course that is computed, what it does to that, with its sign.
    stated: whether anything is known of it; one that is not is free. group: of one of many, what they are together.
    least: of a gain, the least factor that a sensor may read of the model. most: what one that is stated may come to,
    in its standard uncertainties. angle: of an error of the crank angle, its standard uncertainty as such, rad.
    """

    name: str
    channel: str
    kind: str
    sizes: tuple[float, ...]
    stated: bool
    group: str = ""
    least: float = LEAST_GAIN
    most: float = FAR
    angle: float = 0.0

    @property
    def source(self) -> str:
        """What it counts as in the variance of an estimate."""
        return self.group or self.name


def sensors_of(
    blocks: Sequence[Block],
    own: Sequence[str] | None = None,
    delay: float | None = None,
    lags: Mapping[str, float] | None = None,
    cuts: Sequence[tuple[float, float]] = (),
) -> list[SensorError]:
    """Errors of the sensors of all blocks: one for each channel, or of each condition if these have names.

    An infinite standard uncertainty says that nothing is known of it. delay: by which a channel may lag behind the
    angle, standard uncertainty, s; none if not given. lags: the same of all channels of each condition together, by
    its name in the order of the conditions. cuts: of each condition that of its angle by readings that may be cut off,
    rad, and its speed, rad/s; those of one resolution are off alike.
    """
    found: list[SensorError] = []
    for kind in ("zero", "gain"):
        groups: dict[tuple[str, str], list[int]] = {}
        for k, block in enumerate(blocks):
            if _stated(block, kind) > 0:
                place = own[block.condition] if own else ""
                groups.setdefault((block.channel, place), []).append(k)
        for (channel, place), members in groups.items():
            stated = [_stated(blocks[k], kind) for k in members]
            free = any(np.isinf(stated))
            if free:
                turns = [np.vstack([blocks[k].turns, blocks[k].held]) for k in members]
                size = float(np.sqrt(np.nanmean(np.concatenate(turns, axis=None) ** 2))) or 1.0
                stated = [size if kind == "zero" else 1.0] * len(members)
            sizes = [0.0] * len(blocks)
            for k, size in zip(members, stated, strict=True):
                sizes[k] = float(size)
            name = f"{kind} of {channel}" + (f" in {place}" if place else "")
            found.append(SensorError(name, channel, kind, tuple(sizes), not free))
    return [
        *found,
        *_of_files(blocks),
        *_late(blocks, delay),
        *_sampled(blocks, lags or {}),
        *_cut(blocks, cuts),
        *_behind(blocks, own),
    ]


def _of_files(blocks: Sequence[Block]) -> list[SensorError]:
    """The zero that each file has by itself."""
    single: dict[tuple[str, tuple[str, ...]], list[float]] = {}
    for k, block in enumerate(blocks):
        if block.course.accuracy.own > 0:
            key = block.channel, block.files or (str(block.condition),)
            single.setdefault(key, [0.0] * len(blocks))[k] = float(block.course.accuracy.own)
    return [
        SensorError(
            f"{OWN} of {channel}: {' '.join(files)}", channel, "zero", tuple(sizes), True, f"{OWN} of {channel}"
        )
        for (channel, files), sizes in single.items()
    ]


def _late(blocks: Sequence[Block], delay: float | None) -> list[SensorError]:
    """By how much each channel with a course lags behind the angle."""
    if not delay:
        return []
    size = float(delay) if np.isfinite(delay) else 1e-3
    rows = {
        channel: tuple(size * (one.channel == channel and one.turns.shape[1] > 2) for one in blocks)
        for channel in dict.fromkeys(one.channel for one in blocks)
    }
    return [
        SensorError(f"delay of {channel}", channel, "delay", sizes, bool(np.isfinite(delay)))
        for channel, sizes in rows.items()
        if any(sizes)
    ]


def _sampled(blocks: Sequence[Block], lags: Mapping[str, float]) -> list[SensorError]:
    """By how much all channels of a condition lag together, since its angle is known to the sampling only."""
    found = []
    for index, (name, lag) in enumerate(lags.items()):
        sizes = tuple(lag * (one.condition == index and one.turns.shape[1] > 2) for one in blocks)
        if any(sizes):
            found.append(SensorError(f"{ANGLE}: {name}", "", "delay", sizes, True, ANGLE))
    return found


def _cut(blocks: Sequence[Block], cuts: Sequence[tuple[float, float]]) -> list[SensorError]:
    """By how much all channels lag since readings of the angle may be cut off: half a step in all files alike."""
    found = []
    for size in dict.fromkeys(abs(cut) for cut, _ in cuts if cut):
        late = [cut / speed if abs(cut) == size and speed else 0.0 for cut, speed in cuts]
        sizes = tuple(late[one.condition] * (one.turns.shape[1] > 2) for one in blocks)
        step = np.degrees(size * np.sqrt(12.0))
        name = f"angle in steps of {step:.4g} deg"
        found.append(SensorError(name, "", "delay", sizes, stated=True, most=HALF_STEP, angle=size))
    return [one for one in found if any(one.sizes)]


def _behind(blocks: Sequence[Block], own: Sequence[str] | None) -> list[SensorError]:
    """Errors of the sensors behind courses that are computed."""
    effects: dict[tuple[str, str, str], list[float]] = {}
    for k, block in enumerate(blocks):
        for name, size in block.effects.items():
            group = name if name.startswith(OWN) else ""
            if group:
                name = f"{name}: {' '.join(block.files or (str(block.condition),))}"
            elif own:
                name = f"{name} in {own[block.condition]}"
            effects.setdefault((name, block.channel, group), [0.0] * len(blocks))[k] = size
    return [SensorError(name, one, "zero", tuple(sizes), True, group) for (name, one, group), sizes in effects.items()]


def _stated(block: Block, kind: str) -> float:
    """What is stated of an error that a channel has in all conditions."""
    accuracy = block.course.accuracy
    return float(np.hypot(shared_zero(accuracy), accuracy.cut)) if kind == "zero" else float(accuracy.gain)


@dataclass
class FitProblem:
    """What is fitted: the model to the blocks.

    masks: positions used, by block; variances: of one turn, by block; factors: by channel, for the correlation within a
    turn; left_over: for a misfit, so that it does not outweigh what is stated of the sensors; progress: called with the
    number of models evaluated.
    """

    model: Model
    blocks: Sequence[Block]
    sensors: Sequence[SensorError]
    guard: int | None = None
    masks: list[Mask] = field(default_factory=list)
    variances: list[Array] = field(default_factory=list)
    factors: dict[str, float] = field(default_factory=dict)
    left_over: float = 1.0
    evaluations: int = 0
    progress: Callable[[int], None] | None = None

    def __post_init__(self) -> None:
        self._known: dict[bytes, Courses] = {}

    @property
    def count(self) -> int:
        """Unknowns of the model."""
        return len(self.model.unknowns)

    @property
    def prior(self) -> Array:
        """Weight of what was stated, (unknown and sensor,): 1 of sensors, 0 of what nothing is stated of."""
        return np.array([0.0] * self.count + [float(one.stated) for one in self.sensors])

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Limits of unknowns and sensors."""
        low = [one.lower for one in self.model.unknowns]
        high = [one.upper for one in self.model.unknowns]
        most = [one.most if one.stated else inf for one in self.sensors]
        pairs = zip(self.sensors, most, strict=True)
        least = [max((one.least - 1) / max(one.sizes), -far) if one.kind == "gain" else -far for one, far in pairs]
        return np.array([*low, *least]), np.array([*high, *most])

    def courses(self, x: Array) -> Courses:
        """What the model says; of the last few places it is kept."""
        at = np.asarray(x[: self.count], float)
        key = at.tobytes()
        if key not in self._known:
            while len(self._known) > 3:
                self._known.pop(next(iter(self._known)))
            self._known[key] = self.model.courses(at)
            self.evaluations += 1
            if self.progress:
                self.progress(self.evaluations)
        return self._known[key]

    def said(self, x: Array, k: int) -> tuple[Array, Array]:
        """What the sensor of a block would read, (position,), and its derivatives by all of x."""
        block = self.blocks[k]
        one = self.courses(x).said[block.condition][block.channel]
        size = block.turns.shape[1]
        value, slope = one.value[:size], one.slope[:, :size]
        errors = [(s, one.kind, one.sizes[k]) for s, one in enumerate(self.sensors, self.count) if one.sizes[k]]
        gain, late, zero = (
            float(sum(u * x[s] for s, kind, u in errors if kind == own)) for own in ("gain", "delay", "zero")
        )
        gain += 1.0
        rate = self.model.rate(block.condition, value) if any(kind == "delay" for _, kind, _ in errors) else 0.0
        if late:
            slope = slope - late * self.model.rate(block.condition, slope)
        seen = value - late * rate
        datum = block.course.accuracy.datum
        columns = np.zeros((len(x), size))
        columns[: self.count] = gain * slope
        for s, kind, u in errors:
            columns[s] = {"delay": -gain * u * rate, "gain": u * (seen - datum)}.get(kind, u)
        return gain * (seen - datum) + datum + zero, columns

    def misses(self, x: Array, k: int, data: Array) -> Array:
        """Data less what the sensor would read, (…, position); angles by the nearest turn."""
        gap = data - self.said(x, k)[0]
        measure = self.model.measures[self.blocks[k].channel]
        if measure.turning(self.model.run.system):
            return np.asarray((gap + np.pi) % (2 * np.pi) - np.pi)
        return np.asarray(gap)

    def weight(self, k: int) -> Array:
        """1/variance of the mean at each position of a block, 0 where it is not used."""
        block = self.blocks[k]
        factor = self.factors.get(block.channel, 1.0) * self.left_over
        scale = self.variances[k] * factor / np.maximum(block.count, 1)
        return np.where(self.masks[k], 1 / (scale + block.unresolved**2), 0.0)

    # ---- what is used -----------------------------------------------------------------------------------------

    def allowed(self, x: Array) -> list[Mask]:
        """Positions of each block where the model has a sound answer and the data have a value."""
        found, courses = [], self.courses(x)
        for k, block in enumerate(self.blocks):
            status, turned = courses.status[block.condition], courses.turned[block.condition]
            measure = self.model.measures[block.channel]
            size = block.turns.shape[1]
            if size == 1 < len(status):  # a figure of the whole cycle
                good = np.array([bool(np.all(status < Status.NOT_CONVERGED))])
            elif measure.of_motion:  # whatever forces do
                good = (status < Status.SINGULAR) & (status != Status.NEAR_SINGULAR)
            else:
                guard = -(-size // PER_GUARD) if self.guard is None else self.guard
                value = courses.said[block.condition][block.channel].value
                rounded = turned | self._corners(k, value, turned, guard)
                good = (status == Status.SOLVED) & ~_widened(rounded, guard)
            value = courses.said[block.condition][block.channel].value[:size]
            there = np.isfinite(block.mean) if block.fitted else np.isfinite(block.held_mean)
            found.append(good & there & np.isfinite(value))
        return found

    def _corners(self, k: int, value: Array, taken: Mask, guard: int) -> Mask:
        """Positions of a block beside corners of the model's signal that resampling rounds off visibly."""
        block, model = self.blocks[k], self.model
        uncertainty = np.sqrt(self.variances[k] / np.maximum(block.count, 1) + block.unresolved**2)
        if len(value) != len(model.phases[block.condition]) or len(uncertainty) != len(value):
            return np.zeros(len(value), bool)
        phase, shares = model.phases[block.condition], model.bends[block.condition]
        return corners(value, phase, shares, uncertainty, taken, closed=model.run.cycle.periodic, guard=guard)

    def unanswered(self, x: Array) -> int:
        """Positions with data that friction or the assembly leaves without an answer."""
        count = 0
        for status in self.courses(x).status:
            count += int(np.count_nonzero(status >= Status.NOT_CONVERGED))
        return count

    def start_scatter(self) -> None:
        """Variances by the scatter of the turns; a guess where there is none."""
        self.variances = []
        for block in self.blocks:
            if block.repeats:
                self.variances.append(block.variance)
            else:
                data = block.mean if block.fitted else block.held_mean
                size = float(np.sqrt(np.nanmean(data**2))) if np.any(np.isfinite(data)) else 0.0
                self.variances.append(np.full(len(data), (GUESS * (size or 1.0)) ** 2))

    def learn_scatter(self, x: Array) -> bool:
        """Variances of blocks without repetitions by the residuals of their channel; whether there are such."""
        single = [k for k, block in enumerate(self.blocks) if block.fitted and not block.repeats]
        for channel in dict.fromkeys(self.blocks[k].channel for k in single):
            own = [k for k in single if self.blocks[k].channel == channel]
            gaps = [self.misses(x, k, self.blocks[k].mean)[self.masks[k]] for k in own]
            gap = np.concatenate(gaps)
            if not gap.size:
                continue
            freedom = max(gap.size - len(x), 1)
            size = max(float(np.nanmax(np.abs(self.blocks[k].mean), initial=0.0)) for k in own)
            value = max(float(np.sum(gap**2)) / freedom, (1e-9 * (size or 1.0)) ** 2)
            for k in own:
                self.variances[k] = np.full(len(self.masks[k]), value)
        return bool(single)

    # ---- residuals --------------------------------------------------------------------------------------------

    def residuals(self, x: Array) -> Array:
        """Weighted residuals of all used positions, then those of the sensors."""
        rows = []
        for k, block in enumerate(self.blocks):
            if block.fitted:
                mask = self.masks[k]
                rows.append((np.sqrt(self.weight(k)) * self.misses(x, k, block.mean))[mask])
        return np.concatenate([*rows, (x * self.prior)[self.count :]])

    def jacobian(self, x: Array) -> Array:
        """Derivatives of the residuals, (residual, unknown and sensor)."""
        rows = []
        for k, block in enumerate(self.blocks):
            if block.fitted:
                mask = self.masks[k]
                rows.append(-(np.sqrt(self.weight(k)) * self.said(x, k)[1]).T[mask])
        found = np.concatenate([*rows, np.diag(self.prior)[self.count :]])
        return np.where(np.isfinite(found), found, 0.0)


def _widened(turned: Mask, guard: int) -> Mask:
    """The two positions beside each change of sense, and as many more on both sides as the guard is above 1."""
    if guard < 1:
        return np.zeros_like(turned)
    found = turned.copy()
    for _ in range(guard - 1):
        found = found | np.roll(found, 1) | np.roll(found, -1)
    return found


@dataclass(frozen=True)
class LeastSquaresFit:
    """Where a least-squares search ended. cost: sum of squares."""

    x: Array
    cost: float
    evaluations: int
    converged: bool


def fit(problem: FitProblem, start: Array) -> LeastSquaresFit:
    """The trust-region search of SciPy within the limits; steps to where there is no answer are taken back."""
    from scipy.optimize import least_squares

    low, high = problem.bounds
    inside = np.clip(start, low, high)
    found = least_squares(
        problem.residuals, inside, problem.jacobian, (low, high), "trf", ftol=TOLERANCE, xtol=TOLERANCE, gtol=TOLERANCE,
        x_scale="jac", max_nfev=MOST_EVALUATIONS,
    )  # fmt: skip
    return LeastSquaresFit(np.asarray(found.x), 2 * float(found.cost), int(found.nfev), bool(found.status > 0))
