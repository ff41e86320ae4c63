"""Random mechanisms by the block: drawn, analysed, counted; nothing of a sample is kept.

A block is a fixed number of samples, chosen by the number of positions alone, and is drawn, analysed and summed up by
itself: its bits depend neither on what is worked out beside it nor where. So a run has the same answer to the last bit
for any portions of blocks and any number of workers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Status
from trunnion.measures.figures import within_limits
from trunnion.measures.many import Many
from trunnion.measures.measures import Measure
from trunnion.measures.positions import plan
from trunnion.model.mechanism import Mechanism
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import prepare
from trunnion.statistics.histogram import Bins, count
from trunnion.statistics.streams import SobolStream, uniforms
from trunnion.statistics.tally import Tree, moments_of
from trunnion.studies.tolerance.inputs import Inputs, inputs_of
from trunnion.studies.tolerance.kernel import batch_of, many_of
from trunnion.version import __version__

__all__ = ["METHODS", "SampleTally", "Sampling", "towards"]

Array = NDArray[np.float64]
Counts = NDArray[np.int64]
Method = Literal["monte-carlo", "quasi-monte-carlo"]
METHODS: tuple[Method, ...] = ("monte-carlo", "quasi-monte-carlo")

BATCHES = 8  # of the kernel in a block, so that summing up costs little beside the analysis
MOST = 2048  # samples in a block, so that few of them show how figures converge
MOTIONS, MOTION = 16, 30_000  # samples in a block with motions in time; positions that take about as long as one
REPLICATES = 8  # independent scramblings, whose spread is the error
CAUSES = len(Status) + 1  # by status; the last: a figure that does not exist, such as a dead centre out of range
NOTHING, COARSE = 1e-9, 1e-2  # of the peak of a curve: scatter to first order that is none, and the scale of bins there
BAND = {"fineness": 4, "octaves": 8}  # of the histograms at every position


@dataclass(frozen=True, eq=False)
class SampleTally:
    """What is counted of some blocks.

    histogram (replicate, measure, bin), band (measure, position, bin), failed (cause): counts. trees: by replicate,
    moments over its blocks of the figures, of whether each is within its limits, and of whether all are.
    """

    histogram: Counts
    band: Counts
    failed: Counts
    trees: tuple[Tree, ...]
    per_replicate: int

    @property
    def blocks(self) -> Sequence[tuple[int, int]]:
        """The blocks done, as ranges."""
        size = self.per_replicate
        found: list[tuple[int, int]] = []
        for i, tree in enumerate(self.trees):
            for low, high in tree.ranges:
                if found and found[-1][1] == i * size + low:
                    found[-1] = (found[-1][0], i * size + high)
                else:
                    found.append((i * size + low, i * size + high))
        return found

    def merge(self, other: Self) -> Self:
        """The tally of both; integers add up, moments merge in the fixed order of the tree."""
        trees = tuple(one.merge(two) for one, two in zip(self.trees, other.trees, strict=True))
        return type(self)(
            self.histogram + other.histogram, self.band + other.band, self.failed + other.failed, trees,
            self.per_replicate,
        )  # fmt: skip

    def to_arrays(self) -> dict[str, NDArray[Any]]:
        """Everything as arrays by name."""
        found: dict[str, NDArray[Any]] = {
            "histogram": self.histogram, "band": self.band, "failed": self.failed,
            "per_replicate": np.array(self.per_replicate),
        }  # fmt: skip
        for i, tree in enumerate(self.trees):
            found |= {f"tree{i}.{name}": array for name, array in tree.to_arrays().items()}
        return found

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> Self:
        """From `to_arrays`."""
        trees = []
        for i in range(len(arrays["histogram"])):
            own = {name.partition(".")[2]: array for name, array in arrays.items() if name.startswith(f"tree{i}.")}
            trees.append(Tree.from_arrays(own))
        size = int(arrays["per_replicate"])
        return cls(arrays["histogram"], arrays["band"], arrays["failed"], tuple(trees), size)


@dataclass(frozen=True, eq=False)
class Sampling:
    """A whole run: which mechanism, what is measured where, how many samples and how they are drawn.

    model: plain data of the mechanism; spread: for each measure where its figures are expected, (centre, deviation),
    for the bins; curve_spread: nominal value and deviation of its curve over its window. rotation: see `towards`.
    """

    model: Mapping[str, Any]
    measures: tuple[Measure, ...]
    steps: int
    method: Method
    asked: int
    seed: int
    engine: str
    friction: FrictionMethod
    positions: int
    spread: tuple[tuple[float, float], ...]
    curve_spread: tuple[tuple[Array, Array], ...]
    rotation: Array | None = None

    @cached_property
    def block_size(self) -> int:
        """Samples in a block."""
        most = self.drawing
        if self.engine != "numpy":  # what pays to be compiled takes more at a time
            most *= max(1, batch_of(self.engine, self.positions) // self.drawing)
        if self.method == "monte-carlo":
            return most
        return min(1 << (most.bit_length() - 1), self._points)

    @property
    def drawing(self) -> int:
        """Samples whose random numbers are drawn together: the same by any engine."""
        if any(measure.in_time for measure in self.measures):
            return MOTIONS
        return max(1, min(BATCHES * batch_of("numpy", self.positions), MOST))

    @property
    def work(self) -> int:
        """Positions of all samples, with as many for each motion in time as take as long."""
        motions = {(measure.subject, measure.duration) for measure in self.measures if measure.in_time}
        return self.samples * (self.positions + MOTION * len(motions))

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
    def per_replicate(self) -> int:
        """Blocks of a replicate."""
        return -(-self.samples // (self.block_size * self.replicates))

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return self.per_replicate * self.replicates

    def identity(self) -> Mapping[str, Any]:
        """All that the answer depends on."""
        return {
            "model": self.model,
            "measures": [asdict(measure) for measure in self.measures],
            "steps": self.steps,
            "method": self.method,
            "samples": self.samples,
            "seed": self.seed,
            "engine": self.engine,
            "friction": asdict(self.friction),
            "block": self.block_size,
            "spread": self.spread,
            "curve_spread": self.curve_spread,
            "rotation": self.rotation,
            "version": __version__,
        }

    def empty(self) -> SampleTally:
        """The tally of no blocks."""
        return SampleTally(
            np.zeros((self.replicates, len(self.measures), Bins(0.0, 1.0).number), np.int64),
            np.zeros((len(self.measures), self.positions, Bins(0.0, 1.0, **BAND).number), np.int64),
            np.zeros(CAUSES, np.int64),
            tuple(Tree() for _ in range(self.replicates)),
            self.per_replicate,
        )

    @cached_property
    def bins(self) -> Bins:
        """Bins of the figures."""
        centres, deviations = np.array(self.spread).reshape(-1, 2).T
        return Bins.around(centres, deviations)

    def curve_bins(self, i: int) -> Bins:
        """Bins of the deviation of the curve of a measure from nominal at every position of its window."""
        nominal, deviation = self.curve_spread[i]
        peak = float(np.max(np.abs(np.nan_to_num(nominal)), initial=0.0))
        some = np.nan_to_num(deviation, posinf=0.0) > NOTHING * peak
        return Bins.around(0.0 * nominal, np.where(some, deviation, COARSE * peak), **BAND)

    def prepare(self) -> Sampler:
        """The mechanism read and prepared; once in every process."""
        run = prepare(Mechanism(**self.model))
        inputs = inputs_of(run)
        windows = plan(run, self.measures, self.steps).windows
        times = {name: window.time for name, window in windows.items()}
        return Sampler(self, inputs, many_of(run, self.measures, inputs, self.friction, self.engine), times)


def towards(gradients: Array) -> Array:
    """A rotation of the normal scores that turns the first axes to where measures change most, for Sobol points.

    gradients: of each measure by the scores, (measure, score). The rows of the rotation's transpose are their right
    singular vectors, so that the first coordinates of the points, the evenest, decide most of every measure (linear
    transformation of J. Imai, K. S. Tan, J. Comput. Finance 10 (2006) 129-155, doi:10.21314/JCF.2006.162).
    """
    scale = np.sqrt(np.sum(gradients**2, axis=1, keepdims=True))
    known = np.nan_to_num(gradients / np.where(scale > 0, scale, 1.0))
    rotation: Array = np.linalg.svd(known, full_matrices=True)[2].T
    return rotation


@dataclass(frozen=True, eq=False)
class Sampler:
    """A run ready to draw and analyse blocks. times: at which the course of each measure is shown, s."""

    job: Sampling
    inputs: Inputs
    many: Many
    times: Mapping[str, Array]

    @cached_property
    def _streams(self) -> list[SobolStream]:
        return [SobolStream(self.job.seed, i, self.inputs.dims) for i in range(self.job.replicates)]

    def drawn(self, block: int) -> Array:
        """The uniform numbers of a block, (dims, sample)."""
        job = self.job
        replicate, place = divmod(block, job.per_replicate)
        if job.method == "quasi-monte-carlo":
            return self._streams[replicate].points(place * job.block_size, job.block_size)
        first, last = block * job.block_size, min((block + 1) * job.block_size, job.samples)
        parts = [
            uniforms(job.seed, low // job.drawing, self.inputs.dims, min(job.drawing, last - low))
            for low in range(first, last, job.drawing)
        ]
        return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)

    def figures(self, u: Array) -> tuple[Array, Array, list[Array], NDArray[np.int8]]:
        """Of samples drawn: figures and whether they conform, (measure, sample), curves, gravest status, (sample,)."""
        reads = self.many.read(self.inputs.values(u, self.job.rotation), self.times)
        count, measures = u.shape[1], self.job.measures
        found, passed, curves = np.empty((len(measures), count)), np.empty((len(measures), count)), []
        status = np.zeros(count, np.int8)
        for i, measure in enumerate(measures):
            read = reads[measure.name]
            found[i], status = read.figure, np.maximum(status, read.status)
            passed[i] = within_limits(measure, found[i], read.least, read.most)
            curves.append(np.broadcast_to(np.asarray(read.shown), (count, len(self.times[measure.name]))))
        return found, passed, curves, status

    def evaluate(self, first: int, last: int) -> SampleTally:
        """The tally of blocks first, …, last − 1."""
        tally = self.job.empty()
        for block in range(first, last):
            self._add(tally, block)
        return tally

    def _add(self, tally: SampleTally, block: int) -> None:
        replicate, place = divmod(block, self.job.per_replicate)
        with np.errstate(all="ignore"):
            found, passed, curves, status = self.figures(self.drawn(block))
            lost = np.any(np.isnan(found), axis=0)
            tally.histogram[replicate] += count(found, self.job.bins)
            for i, (own, curve) in enumerate(zip(tally.band, curves, strict=True)):
                apart = np.broadcast_to(curve, (found.shape[1], curve.shape[-1])) - self.job.curve_spread[i][0]
                own[: curve.shape[-1]] += count(apart.T, self.job.curve_bins(i))
            if np.any(lost):
                gravest = status[lost]
                cause = np.where(gravest >= Status.NOT_CONVERGED, gravest, CAUSES - 1)
                tally.failed[:] += np.bincount(cause, minlength=CAUSES)
            everything = np.concatenate([found, passed, np.min(passed, axis=0)[None]])
            tally.trees[replicate].add(place, moments_of(everything))
