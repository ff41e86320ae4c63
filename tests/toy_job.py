"""A job whose answer is easily told: random numbers counted and summed in floats, block by block."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError

Nodes = dict[tuple[int, int], float]


def union(ranges: Iterable[tuple[int, int]]) -> tuple[tuple[int, int], ...]:
    """Disjoint ranges sorted, neighbours joined."""
    joined: list[tuple[int, int]] = []
    for first, last in sorted(ranges):
        if joined and first == joined[-1][1]:
            joined[-1] = (joined[-1][0], last)
        else:
            joined.append((first, last))
    return tuple(joined)


def _closed(nodes: Nodes) -> Nodes:
    """Siblings of the binary tree added, left + right, as far as it goes."""
    waiting = sorted(nodes)
    nodes = dict(nodes)
    while waiting:
        level, index = waiting.pop()
        left, right = (level, index & ~1), (level, index | 1)
        if left in nodes and right in nodes:
            nodes[level + 1, index >> 1] = nodes.pop(left) + nodes.pop(right)
            waiting.append((level + 1, index >> 1))
    return nodes


@dataclass(frozen=True)
class ToyTally:
    counts: NDArray[np.int64]
    nodes: Nodes
    blocks: tuple[tuple[int, int], ...]

    def merge(self, other: ToyTally) -> ToyTally:
        joined = union((*self.blocks, *other.blocks))
        if any(one[1] > two[0] for one, two in pairwise(joined)):
            raise AssertionError("a block was done twice")
        return ToyTally(self.counts + other.counts, _closed(self.nodes | other.nodes), joined)

    def to_arrays(self) -> dict[str, NDArray[Any]]:
        return {
            "counts": self.counts,
            "places": np.array(sorted(self.nodes), np.int64).reshape(-1, 2),
            "sums": np.array([self.nodes[place] for place in sorted(self.nodes)]),
            "blocks": np.array(self.blocks, np.int64).reshape(-1, 2),
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> ToyTally:
        nodes = {(int(k), int(i)): float(x) for (k, i), x in zip(arrays["places"], arrays["sums"], strict=True)}
        return cls(arrays["counts"], nodes, tuple((int(a), int(b)) for a, b in arrays["blocks"]))

    def bits(self) -> tuple[bytes, list[tuple[tuple[int, int], str]]]:
        return self.counts.tobytes(), sorted((place, value.hex()) for place, value in self.nodes.items())


@dataclass(frozen=True)
class ToyJob:
    """blocks of block_size numbers; `fatal`: a block that ends its worker, once (if `folder`) or always."""

    blocks: int = 37
    seed: int = 1
    pause: float = 0.0  # s a block
    fatal: int = -1
    folder: Path | None = None
    fault: str = ""
    model: dict[str, Any] = field(default_factory=lambda: {"AB": 2.0})
    block_size = 500

    @property
    def samples(self) -> int:
        return self.blocks * self.block_size - 77

    def identity(self) -> dict[str, Any]:
        return {"seed": self.seed, "blocks": self.blocks, "model": self.model}

    def empty(self) -> ToyTally:
        return ToyTally(np.zeros(16, np.int64), {}, ())

    def prepare(self) -> ToyPrepared:
        if self.fault == "prepare":
            raise MechanismError(Finding("no such link", "links.x", "name one"))
        if self.fault == "deaf":  # as a process that is told to end before it has begun
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
        return ToyPrepared(self)


class ToyPrepared:
    def __init__(self, job: ToyJob) -> None:
        self.job = job

    def evaluate(self, first: int, last: int) -> ToyTally:
        tally = self.job.empty()
        for block in range(first, last):
            tally = tally.merge(self._block(block))
        return tally

    def _block(self, block: int) -> ToyTally:
        job = self.job
        time.sleep(job.pause)
        if block == job.fatal:
            self._perish()
        if job.fault == "evaluate" and block == 5:
            raise ZeroDivisionError("block 5")
        stream = np.random.Generator(np.random.Philox(key=job.seed, counter=[0, 0, 0, block]))
        values = stream.standard_normal(job.block_size) * 10.0 ** stream.integers(-8, 8)
        counts, _ = np.histogram(values, np.linspace(-1, 1, 17))
        return ToyTally(counts.astype(np.int64), {(0, block): float(values.sum())}, ((block, block + 1),))

    def _perish(self) -> None:
        if self.job.folder is not None:
            try:
                (self.job.folder / "perished").touch(exist_ok=False)
            except FileExistsError:
                return
        os.kill(os.getpid(), signal.SIGKILL)
