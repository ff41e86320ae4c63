"""What it costs to spread a run: portions, tallies on the way, merged and saved: `python -m benchmarks.spread`.

The work itself takes no time here: what is measured is what comes on top of it, as processor time of the main process
(with `--cluster local` the scheduler of Dask is part of it) and as time by the clock.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from trunnion.studies.tolerance.checkpoint import Checkpoint
from trunnion.studies.tolerance.ranges import union
from trunnion.studies.tolerance.runner import run

FIGURES = 5120  # bins of a figure
BAND = 256  # bins of a position
CREWS: dict[str, dict[str, Any]] = {
    "this process": {"jobs": 1},
    "2 processes": {"jobs": 2},
    "Dask, 2 local workers": {"jobs": 2, "cluster": "local"},
}


@dataclass(frozen=True)
class Counts:
    """A tally of counts alone."""

    counts: NDArray[np.int64]
    blocks: tuple[tuple[int, int], ...]

    def merge(self, other: Counts) -> Counts:
        return Counts(self.counts + other.counts, union((*self.blocks, *other.blocks)))

    def to_arrays(self) -> dict[str, NDArray[Any]]:
        return {"counts": self.counts, "blocks": np.array(self.blocks, np.int64).reshape(-1, 2)}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> Counts:
        return cls(arrays["counts"], tuple((int(first), int(last)) for first, last in arrays["blocks"]))


@dataclass(frozen=True)
class Nothing:
    """A job of so many blocks that take no time, with a tally of so many counts."""

    blocks: int
    size: int
    block_size = 1

    @property
    def samples(self) -> int:
        return self.blocks

    def identity(self) -> dict[str, int]:
        return {"blocks": self.blocks, "size": self.size}

    def empty(self) -> Counts:
        return Counts(np.zeros(self.size, np.int64), ())

    def prepare(self) -> Nothing:
        return self

    def evaluate(self, first: int, last: int) -> Counts:
        return Counts(np.full(self.size, last - first), ((first, last),))


def portion(crew: dict[str, Any], size: int, portions: int) -> tuple[float, float]:
    """ms a portion: processor time of the main process, and by the clock; starting and ending are not counted."""
    seen: list[tuple[int, float, float]] = []

    def note(done: int) -> None:
        if done >= portions // 4 and (not seen or done == portions):
            seen.append((done, time.process_time(), time.perf_counter()))

    run(Nothing(portions, size), chunk=1, progress=note, **crew)
    (early, *before), (late, *after) = seen[0], seen[-1]
    processor, clock = (1e3 * (b - a) / (late - early) for a, b in zip(before, after, strict=True))
    return processor, clock


def checkpoint(measures: int, positions: int) -> tuple[float, float, float]:
    """Bytes of a tally in memory, bytes and seconds of its checkpoint: normal samples in all histograms."""
    stream = np.random.default_rng(1)
    rows = []
    for bins, count in ((FIGURES, measures), (BAND, measures * positions)):
        values = np.clip(np.floor(bins / 2 + stream.standard_normal((count, 4000)) * bins / 40), 0, bins - 1)
        rows += [np.bincount(row.astype(int), minlength=bins) * 1_000_003 for row in values]
    tally = Counts(np.concatenate(rows), ((0, 1),))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.npz"
        start = time.perf_counter()
        kept = Checkpoint(path, Nothing(1, tally.counts.size))
        kept.tally = tally
        kept.keep()
        return tally.counts.nbytes, path.stat().st_size, time.perf_counter() - start


def main() -> None:
    """Both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--portions", type=int, default=2000)
    portions = parser.parse_args().portions
    console = Console()
    table = Table("crew", "tally, MB", "main process, ms", "by the clock, ms", title="A portion that does nothing")
    for name, crew in CREWS.items():
        for size in (16, 200_000):
            processor, clock = portion(crew, size, portions)
            table.add_row(name, f"{8e-6 * size:.3g}", f"{processor:.3g}", f"{clock:.3g}")
    console.print(table)
    console.print(f"peak of the main process: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3:.0f} MB")
    table = Table("measures", "positions", "tally, MB", "file, MB", "written in, s", title="A checkpoint")
    for measures, positions in ((1, 36), (2, 360), (10, 360)):
        memory, size, seconds = checkpoint(measures, positions)
        table.add_row(f"{measures}", f"{positions}", f"{memory / 1e6:.3g}", f"{size / 1e6:.3g}", f"{seconds:.2g}")
    console.print(table)


if __name__ == "__main__":
    main()
