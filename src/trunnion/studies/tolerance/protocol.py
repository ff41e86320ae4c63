"""What the runner asks of the work it spreads: a job cut into numbered blocks, and the tally of some of them.

The answer of a run is one tally. It has to be the same to the last bit however the blocks were grouped, wherever and
in whatever order they were done, so `Tally.merge` must not depend on the order: integers are added, and sums of floats
are kept as nodes of a fixed binary tree over the blocks.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from time import perf_counter
from typing import Any, Generic, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from trunnion.errors import Finding
from trunnion.results.sentences import finding_for

__all__ = ["Blocks", "Crew", "Job", "Portion", "Prepared", "Tally", "fingerprint", "mixed", "part_of"]

Blocks = tuple[int, int]  # blocks first, first + 1, …, last - 1


class Tally(Protocol):
    """What is kept of the blocks done; its size does not grow with their number."""

    @property
    def blocks(self) -> Sequence[Blocks]:
        """The blocks done: sorted, disjoint, none adjacent."""

    def merge(self, other: Self) -> Self:
        """The tally of the blocks of both; neither changes."""

    def to_arrays(self) -> dict[str, NDArray[Any]]:
        """Everything, as arrays of numbers by name (no objects), for a file."""

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> Self:
        """The inverse of `to_arrays`, to the last bit."""


T = TypeVar("T", bound=Tally)
T_co = TypeVar("T_co", bound=Tally, covariant=True)


class Prepared(Protocol[T_co]):
    """A job ready to run in this process: compiled, allocated; it need not be picklable."""

    def evaluate(self, first: int, last: int) -> T_co:
        """The tally of blocks first, …, last - 1."""


class Job(Protocol[T_co]):
    """The whole task, picklable: it is sent once to every worker, and prepared there."""

    @property
    def blocks(self) -> int:
        """Number of blocks; fixed by the job alone, never by the workers."""

    @property
    def block_size(self) -> int:
        """Samples in a block (the last may have fewer)."""

    @property
    def samples(self) -> int:
        """Samples in all blocks."""

    def identity(self) -> Mapping[str, Any]:
        """All that the bits of the answer depend on; JSON or NumPy's `tolist` writes it: model, seed, block, …"""

    def empty(self) -> T_co:
        """The tally of no blocks."""

    def prepare(self) -> Prepared[T_co]:
        """What evaluates blocks; called once in every process."""


@dataclass(frozen=True)
class Portion(Generic[T_co]):
    """Blocks done, the seconds they took where they were done, their tally, and `fingerprint` of that machine."""

    blocks: Blocks
    seconds: float
    tally: T_co
    arithmetic: str


def part_of(prepared: Prepared[T], blocks: Blocks) -> Portion[T]:
    """These blocks, done here."""
    start = perf_counter()
    tally = prepared.evaluate(*blocks)
    return Portion(blocks, perf_counter() - start, tally, fingerprint())


class Crew(Protocol[T_co]):
    """Who does the blocks: this process, processes of this machine, or a cluster."""

    @property
    def workers(self) -> int:
        """How many blocks can be under way at the same time."""

    def give(self, blocks: Blocks) -> None:
        """Have these blocks done; again if who does them dies."""

    def wait(self) -> Sequence[Portion[T_co]]:
        """Parts that have become ready since; may be none after a while. KeyboardInterrupt may be raised inside."""

    def close(self, finished: bool) -> None:
        """Let everybody go; at once, if not everything given was finished."""


@cache
def fingerprint() -> str:
    """Twelve hexadecimal digits, equal where the functions give the same bits.

    Sums, products and roots are the same on every machine (IEEE 754); the code of sines and logarithms is picked by the
    processor, and the last bit may differ. So it is not versions that are compared but what comes out.
    """
    x = np.arange(1, 1025) * 0.618033988749895  # exact products: the same numbers everywhere
    u = np.arange(1, 1025) / 1025
    tried = [np.sin(x), np.cos(x), np.tan(x), np.arcsin(u), np.arctan2(u, 1 - u), np.exp(u), np.log(x), np.log1p(u)]
    tried += [np.hypot(x, u), np.power(x, u), np.tanh(u), np.arcsinh(x), ndtri(u)]
    return hashlib.sha256(b"".join(values.tobytes() for values in tried)).hexdigest()[:12]


def mixed(seen: set[str]) -> tuple[Finding, ...]:
    """A note, if machines of more than one kind took part."""
    if len(seen) < 2:
        return ()
    return (finding_for("samples.machines", "cluster", kinds=len(seen)),)
