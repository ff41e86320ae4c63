"""What is asked of work that is done in blocks, and how its workers leave Ctrl-C to the main process."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Protocol

from numpy.typing import NDArray

__all__ = ["DEATHS", "Job", "Part", "undisturbed"]

Part = dict[str, NDArray[Any]]  # what a block gives: arrays of numbers by name
DEATHS = 3  # workers that die one after another before a block is finished


class Job(Protocol):
    """A task in blocks. It is picklable: it is sent to the workers, and prepared there."""

    @property
    def blocks(self) -> int:
        """Number of blocks; fixed by the job alone, never by the workers."""

    def identity(self) -> Mapping[str, Any]:
        """All that the bits of the answer depend on, as JSON or NumPy's `tolist` writes it: model, seed, …"""

    def prepare(self) -> Callable[[int], Part]:
        """What works out a block by its number; called once in every process."""


@contextmanager
def undisturbed() -> Iterator[None]:
    """Processes and threads started inside never hear Ctrl-C: they inherit that it is blocked (not on Windows)."""
    if not hasattr(signal, "pthread_sigmask"):  # pragma: no cover - Windows: a worker ignores it once it runs
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
