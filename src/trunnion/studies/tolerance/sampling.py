"""Random mechanisms by the block: drawn, analysed, and all their figures kept.

A block is a fixed number of samples, chosen by the number of positions and the engine alone. Its random numbers come of
the seed and its own number, so that a study has the same answer to the last bit with any number of workers.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError
from trunnion.measures.figures import within_limits
from trunnion.measures.many import Many
from trunnion.measures.measures import Measure
from trunnion.measures.positions import plan
from trunnion.model.mechanism import Mechanism
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import prepare
from trunnion.statistics.distributions import sobol, uniforms
from trunnion.studies.batch import Part
from trunnion.studies.tolerance.inputs import Inputs, inputs_of
from trunnion.studies.tolerance.kernel import kernel_of, many_of

Array = NDArray[np.float64]
Method = Literal["monte-carlo", "quasi-monte-carlo"]
METHODS: tuple[Method, ...] = ("monte-carlo", "quasi-monte-carlo")

DRAWN = 2048  # samples whose random numbers are drawn together, whatever the steps: part of what a seed means
BLOCK = {"numpy": DRAWN, "compiled": 8 * DRAWN}  # samples in a block
MOTIONS, MOTION = 16, 30_000  # samples in a block with motions in time; positions that take about as long as one
PLACES = 360  # positions that the course of a sample over the cycle takes about as long as
REPLICATES = 8  # independent scramblings, whose spread is the error
CURVES, NUMBERS = 10_000, 1 << 25  # samples whose curves are kept for the bands over the cycle; most numbers of them


@dataclass(frozen=True, eq=False)
class Samples:
    """What is known of every sample.

    figure and passed, whether it is within the limits, are (measure, sample), figures that do not exist NaN; status is
    the gravest of a sample's positions, (sample,); curves of each measure those of the first samples,
    (sample, position). Samples of one replicate stand together.
    """

    job: Sampling
    figure: Array
    passed: NDArray[np.bool_]
    status: NDArray[np.int8]
    curves: Sequence[Array]


@dataclass(frozen=True, eq=False)
class Sampling:
    """A whole run: which mechanism, what is measured where, how many samples and how they are drawn.

    model: plain data of the mechanism; places: positions that a sample takes about as long as; rotation: see `towards`;
    each_alone: whether pins lie where their loads press them, so that every sample is a mechanism by itself.
    """

    model: Mapping[str, Any]
    measures: tuple[Measure, ...]
    steps: int
    method: Method
    asked: int
    seed: int
    engine: str
    friction: FrictionMethod
    places: int
    rotation: Array | None = None
    each_alone: bool = False

    @cached_property
    def block_size(self) -> int:
        """Samples in a block."""
        size = self.drawing if self.drawing == MOTIONS else BLOCK[self.engine]
        return size if self.method == "monte-carlo" else min(1 << (size.bit_length() - 1), self._points)

    @property
    def drawing(self) -> int:
        """Samples whose random numbers are drawn together: the same by any engine and with any number of steps."""
        return MOTIONS if self.each_alone or any(measure.in_time for measure in self.measures) else DRAWN

    @property
    def work(self) -> int:
        """Positions of all samples, with as many for each motion in time as take as long."""
        motions = {(measure.subject, measure.duration) for measure in self.measures if measure.in_time}
        return self.samples * (self.places + MOTION * (len(motions) + self.each_alone))

    @cached_property
    def _points(self) -> int:
        """Points of a replicate: the power of two that uses up no more than the samples asked for."""
        return 1 << (max(1, self.asked // REPLICATES).bit_length() - 1)

    @property
    def replicates(self) -> int:
        return 1 if self.method == "monte-carlo" else REPLICATES

    @property
    def samples(self) -> int:
        """Samples in all blocks."""
        return self.asked if self.method == "monte-carlo" else REPLICATES * self._points

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return -(-self.samples // (self.block_size * self.replicates)) * self.replicates

    def identity(self) -> Mapping[str, Any]:
        """All that the answer depends on."""
        return asdict(self)

    def prepare(self) -> Sampler:
        """The mechanism read and prepared; once in every process."""
        run = prepare(Mechanism(**self.model))
        inputs = inputs_of(run)
        windows = plan(run, self.measures, self.steps).windows
        times = {name: window.time for name, window in windows.items()}
        kernel = kernel_of(run, self.measures, self.friction, self.each_alone)
        return Sampler(self, inputs, many_of(kernel, inputs, self.engine), times)

    def joined(self, parts: Sequence[Part]) -> Samples:
        """The samples of all blocks, in their order."""
        curves = [np.concatenate([part[f"curve{i}"] for part in parts]) for i in range(len(self.measures))]
        figure, passed, status = (
            np.concatenate([part[name] for part in parts], axis=-1) for name in ("figure", "passed", "status")
        )
        return Samples(self, figure, passed, status, curves)


def towards(gradients: Array) -> Array:
    """A rotation of the normal scores that turns the first axes to where measures change most, for Sobol points.

    gradients: of each measure by the scores, (measure, score). The rows of the rotation's transpose are their right
    singular vectors, so that the first coordinates of the points, the evenest, decide most of every measure (linear
    transformation of J. Imai, K. S. Tan, J. Comput. Finance 10 (2006) 129-155, doi:10.21314/JCF.2006.162).
    """
    scale = np.sqrt(np.sum(gradients**2, axis=1, keepdims=True))
    scaled = np.nan_to_num(gradients / np.where(scale > 0, scale, 1.0))
    rotation: Array = np.linalg.svd(scaled, full_matrices=True)[2].T
    return rotation


@dataclass(frozen=True, eq=False)
class Sampler:
    """A run ready to draw and analyse blocks. times: at which the course of each measure is shown, s."""

    job: Sampling
    inputs: Inputs
    many: Many
    times: Mapping[str, Array]

    def drawn(self, block: int) -> Array:
        """The uniform numbers of a block, (dims, sample)."""
        job = self.job
        if job.method == "quasi-monte-carlo":
            replicate, place = divmod(block, job.blocks // job.replicates)
            return sobol(job.seed, replicate, self.inputs.dims, place * job.block_size, job.block_size)
        first, last = block * job.block_size, min((block + 1) * job.block_size, job.samples)
        parts = [
            uniforms(job.seed, low // job.drawing, self.inputs.dims, min(job.drawing, last - low))
            for low in range(first, last, job.drawing)
        ]
        return np.concatenate(parts, axis=1)

    def figures(self, u: Array, shown: bool = False) -> Part:
        """Figures, whether they conform and gravest status of samples drawn, and their curves if they are shown."""
        reads = self.many.read(self.inputs.values(u, self.job.rotation), self.times if shown else {})
        count, measures = u.shape[1], self.job.measures
        rows = [reads[measure.name] for measure in measures]
        part: Part = {
            "figure": np.array([np.broadcast_to(read.figure, count) for read in rows], float),
            "status": np.max([np.broadcast_to(read.status, count) for read in rows], axis=0).astype(np.int8),
        }
        judged = zip(measures, part["figure"], rows, strict=True)
        passed = [within_limits(measure, figure, read.least, read.most) for measure, figure, read in judged]
        part["passed"] = np.array([np.broadcast_to(row, count) for row in passed], bool)
        for i, (measure, read) in enumerate(zip(measures, rows, strict=True)):
            length = len(self.times[measure.name])
            part[f"curve{i}"] = np.broadcast_to(read.shown, (count, length)) if shown else np.empty((0, length))
        return part

    def __call__(self, block: int) -> Part:
        """What is known of the samples of a block."""
        u, before = self.drawn(block), block * self.job.block_size
        kept = min(CURVES, NUMBERS // max(map(len, self.times.values()))) - before
        kept = min(max(kept, 0), u.shape[1])
        ends = [(0, kept, True), (kept, u.shape[1], False)]
        with np.errstate(all="ignore"):
            parts = [self.figures(u[:, low:high], shown) for low, high, shown in ends if low < high]
        return {name: np.concatenate([part[name] for part in parts], axis=0 if name.startswith("curve") else -1)
                for name in parts[0]}  # fmt: skip


# ---- indices of the variance ---------------------------------------------------------------------------------------

BOOTSTRAPS = 200
LEAST, MOST = 64, 1 << 16


class Indices(NamedTuple):
    """First and total order, (measure, parameter), with the ends of their 95 % intervals, by the names of the result.

    lost: samples without an answer.
    """

    arrays: dict[str, Array]
    lost: int


def indices(sampler: Sampler, samples: int, seed: int) -> Indices:
    """Sobol' indices of every measure by about so many samples in all. Raises MechanismError where they mean nothing.

    Of correlated numbers there is no such share. Samples without an answer are set to the mean of the others.
    """
    inputs = sampler.inputs
    correlation = inputs.population.correlation
    if not np.array_equal(correlation, np.eye(len(correlation))):
        what = "variance-based indices are of independent numbers, and some are correlated"
        raise MechanismError(Finding(what, "correlations", "leave out --method sobol, or the correlations"))
    parts = inputs.parts
    base = min(max(1 << (max(1, samples // (len(parts) + 2)).bit_length() - 1), LEAST), MOST)
    u = sobol(seed, 0, 2 * inputs.dims, 0, base)
    first, two = u[: inputs.dims], u[inputs.dims :]

    def analysed(points: Array) -> Array:
        size = sampler.job.block_size
        with np.errstate(all="ignore"):
            parts = [sampler.figures(points[:, low : low + size]) for low in range(0, points.shape[1], size)]
        return np.concatenate([part["figure"] for part in parts], axis=1)

    y_one, y_two = analysed(first), analysed(two)
    mixed = np.empty((len(parts), *y_one.shape))
    for i, rows in enumerate(parts):
        points = first.copy()
        points[rows] = two[rows]
        mixed[i] = analysed(points)
    lost = int(sum(np.count_nonzero(np.any(np.isnan(y), axis=0)) for y in (y_one, y_two, *mixed)))
    arrays = _indices(_filled(y_one), _filled(y_two), _filled(mixed), seed)
    for shares in arrays.values():  # of a measure without a single answer
        shares[np.all(np.isnan(y_one) & np.isnan(y_two), axis=1)] = np.nan
    return Indices(arrays, lost)


def _indices(y_one: Array, y_two: Array, mixed: Array, seed: int) -> dict[str, Array]:
    """Both orders with percentile intervals: scipy's own bootstrap cannot be given a seed."""
    from scipy.stats import sobol_indices  # takes longer to import than the rest

    base, rows = y_one.shape[-1], [*range(len(y_one)), 0]  # scipy fails for one measure of one number: never one
    y_one, y_two, mixed = y_one[rows], y_two[rows], mixed[:, rows]
    shape = len(rows), len(mixed)

    def both(points: Any) -> Array:
        parts = {"f_A": y_one[..., points], "f_B": y_two[..., points], "f_AB": mixed[..., points]}
        orders = sobol_indices(func=parts, n=base)
        return np.array([np.reshape(order, shape)[:-1] for order in (orders.first_order, orders.total_order)])

    rng = np.random.Generator(np.random.Philox(seed))
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a measure that nothing moves has no shares: NaN
        index = both(slice(None))
        drawn = np.array([both(rng.integers(base, size=base)) for _ in range(BOOTSTRAPS)])
        low, high = np.nanquantile(drawn, [0.025, 0.975], axis=0)
    ends = ("", index), ("_low", low), ("_high", high)
    return {
        f"{order}_order{name}": np.where(np.isnan(end[k]), index[k], end[k])  # the index where nothing scatters
        for k, order in enumerate(("first", "total"))
        for name, end in ends
    }


def _filled(y: Array) -> Array:
    """Without gaps: the mean of the rest in their place."""
    count = np.sum(~np.isnan(y), axis=-1, keepdims=True)
    return np.where(np.isnan(y), np.nansum(y, axis=-1, keepdims=True) / np.maximum(count, 1), y)
