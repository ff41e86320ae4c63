"""Work cut into numbered blocks: done in this process, in threads, in processes of this machine or on a cluster.

A block depends on its job and its number alone, and the answer of a run is the parts of all blocks in their order. So
the bits of the answer depend neither on the number of workers nor on which of them does what. Finished blocks may be
kept in a folder, so that a run that was stopped does not do them again.
"""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import os
import pickle
import signal
import threading
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, contextmanager, suppress
from functools import lru_cache, partial
from io import BytesIO
from itertools import islice
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.version import __version__

AHEAD = 2  # blocks given to every worker: the one under way and the next
PAUSE = 0.5  # s; Windows hears Ctrl-C only between two waits
DEATHS = 3  # workers that die one after another before a block is finished
HEAD = "job.json"

Part = dict[str, NDArray[Any]]  # what a block gives: arrays of numbers by name


class Job(Protocol):
    """A task in blocks. It is picklable: it is sent to the workers, and prepared there."""

    @property
    def blocks(self) -> int:
        """Number of blocks; fixed by the job alone, never by the workers."""

    def identity(self) -> Mapping[str, Any]:
        """All that the bits of the answer depend on, as JSON or NumPy's `tolist` writes it: model, seed, …"""

    def prepare(self) -> Callable[[int], Part]:
        """What works out a block by its number; called once in every process."""


def run(
    job: Job,
    *,
    jobs: int | None = 1,
    threads: bool = False,
    cluster: str | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
    progress: Callable[[float], None] | None = None,
) -> tuple[list[Part], list[Finding]]:
    """All parts of a job in their order, and a finding if the checkpoint could not be written to the end.

    Parameters
    ----------
    jobs
        Processes on this machine, one a core if None; with one, all is done in this process.
    threads
        Whether threads take the place of processes: for what leaves Python's interpreter lock most of the time.
    cluster
        The address of a Dask scheduler.
    checkpoint
        Folder that every finished block is added to; the blocks that it holds already are not done again.
    progress
        Called with the share of the blocks done, in this thread.

    Raises
    ------
    MechanismError
        The checkpoint is of another job or cannot be read, workers die one after another, or no cluster answers.
    """
    if jobs is not None and jobs < 1:
        raise MechanismError(Finding(f"{jobs} jobs", "jobs", "state 1 or more, or none for all cores"))
    tell = progress or (lambda share: None)
    done = Checkpoint(checkpoint, job)
    tell(len(done.parts) / job.blocks)
    left = [block for block in range(job.blocks) if block not in done.parts]
    with closing(_worked(job, left, jobs or os.cpu_count() or 1, threads, cluster)) as parts:
        for block, part in parts:
            done.add(block, part)
            tell(len(done.parts) / job.blocks)
    return [done.parts[block] for block in range(job.blocks)], [done.trouble] if done.trouble else []


def _worked(job: Job, blocks: list[int], jobs: int, threads: bool, cluster: str | None) -> Generator[tuple[int, Part]]:
    """Blocks with their parts, as they are finished."""
    workers = min(jobs, len(blocks))
    if cluster is not None and blocks:
        from trunnion.studies.cluster import connected  # its package is an extra

        with connected(cluster) as (executor, count):
            yield from _spread(partial(_work, pickle.dumps(job)), blocks, executor, count)
    elif workers <= 1:
        part_of = job.prepare() if blocks else None
        for block in blocks:
            assert part_of is not None
            yield block, part_of(block)
    elif threads:
        with ThreadPoolExecutor(workers) as executor:
            yield from _spread(job.prepare(), blocks, executor, workers)
    else:
        left, deaths, packed = dict.fromkeys(blocks), 0, pickle.dumps(job)
        while left:  # those that die are replaced, and the blocks under way are done again
            with _pool(workers) as pool:
                try:
                    for block, part in _spread(partial(_work, packed), list(left), pool, workers):
                        del left[block]
                        deaths = 0
                        yield block, part
                except BrokenProcessPool:
                    deaths += 1
            if deaths >= DEATHS:
                what = f"{DEATHS} workers died in turn, the next block being {next(iter(left))}"
                remedy = (
                    "often too little memory: fewer --jobs, fewer --steps; "
                    "a script calls this under `if __name__ == '__main__':`"
                )
                raise MechanismError(Finding(what, "jobs", remedy))


def _spread(
    part_of: Callable[[int], Part], blocks: Iterable[int], executor: Executor, workers: int
) -> Iterator[tuple[int, Part]]:
    """Blocks with their parts as an executor finishes them; a few are under way at a time."""
    waiting, under_way = iter(blocks), dict[Future[Part], int]()
    try:
        while True:
            for block in islice(waiting, AHEAD * workers - len(under_way)):
                with _undisturbed():  # it may start a process or a thread
                    under_way[executor.submit(part_of, block)] = block
            if not under_way:
                return
            for future in wait(under_way, PAUSE, FIRST_COMPLETED).done:
                yield under_way.pop(future), future.result()
    finally:
        for future in under_way:
            future.cancel()


# ---- processes ------------------------------------------------------------------------------------------------


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Processes that are started anew (`spawn`), as Windows and macOS do it everywhere, and are gone at the end."""
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), _begin)
    try:
        yield pool
    finally:
        for process in list((pool._processes or {}).values()):
            process.kill()  # one may be in the middle of a long block, or deaf to being terminated
        pool.shutdown(cancel_futures=True)


def _begin() -> None:
    """In a worker: leave Ctrl-C to the main process, and end when that ends, however it does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_follow, daemon=True).start()


def _follow() -> None:
    main = multiprocessing.parent_process()
    if main is not None:
        main.join()
        os._exit(1)


def _work(packed: bytes, block: int) -> Part:
    """In a worker: the part of a block of a pickled job, which is prepared once."""
    return _prepared(packed)(block)


@lru_cache(maxsize=1)
def _prepared(packed: bytes) -> Callable[[int], Part]:
    job: Job = pickle.loads(packed)
    return job.prepare()


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Processes and threads started inside never hear Ctrl-C: they inherit that it is blocked (not on Windows)."""
    if not hasattr(signal, "pthread_sigmask"):  # pragma: no cover - Windows: a worker ignores it once it runs
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


# ---- checkpoints -----------------------------------------------------------------------------------------------


class Checkpoint:
    """The parts of a job that are done, in memory by block, and in a folder if there is a path.

    `job.json` says of which job the folder is; every block is a file in the format of `numpy.savez`, which is moved to
    its place whole. Its checksums tell a file that was damaged: that block is done again.

    trouble: why the folder could not be written to the end; the run goes on without it.
    """

    def __init__(self, path: str | os.PathLike[str] | None, job: Job) -> None:
        self.parts: dict[int, Part] = {}
        self.trouble: Finding | None = None
        self.folder = None if path is None else Path(path)
        if self.folder is not None:
            try:
                self._open(self.folder, job)
            except OSError as error:
                what = f"cannot be used as a checkpoint: {error.strerror or error}"
                raise MechanismError(Finding(what, str(path), "name another folder")) from None

    def add(self, block: int, part: Part) -> None:
        """Keep the part of one more block."""
        self.parts[block] = part
        if self.folder is None or self.trouble is not None:
            return
        stream = BytesIO()
        np.savez(stream, allow_pickle=False, **part)
        try:
            _write(self.folder / f"{block}.npz", stream.getvalue())
        except OSError as error:  # a full disk is no reason to lose the run
            what = f"blocks are not kept from here on: {error.strerror or error}"
            self.trouble = Finding(what, str(self.folder), severity=Severity.WARNING)

    def _open(self, folder: Path, job: Job) -> None:
        """Read what the folder holds, or begin it. MechanismError if it is of another job, or no checkpoint."""
        folder.mkdir(exist_ok=True)
        now = settings(job)
        if not any(folder.iterdir()):
            _write(folder / HEAD, json.dumps(now).encode())
        try:
            before = json.loads((folder / HEAD).read_bytes())
            differing = [key for key in sorted({*before, *now}) if before.get(key) != now.get(key)]
        except (FileNotFoundError, ValueError, TypeError, AttributeError):  # no text, no JSON, or not of a job
            remedy = "name the folder that the run was begun with, or another for a new run"
            raise MechanismError(Finding("is no checkpoint", str(folder), remedy)) from None
        if differing:
            texts = (f"{key} is {before.get(key)} there and {now.get(key)} here" for key in differing)
            what, remedy = "a checkpoint of another job: " + "; ".join(texts), "run it as it was begun, or name another"
            raise MechanismError(Finding(what, str(folder), f"{remedy} folder"))
        for block in range(job.blocks):
            place = folder / f"{block}.npz"  # if it is damaged, which raises almost anything, it is done again
            with suppress(Exception), place.open("rb") as stream, np.load(stream, allow_pickle=False) as arrays:
                self.parts[block] = dict(arrays)


def _write(place: Path, raw: bytes) -> None:
    """Write a file that is there whole or not at all."""
    partial = place.with_suffix(".part")
    partial.write_bytes(raw)
    partial.replace(place)


def settings(job: Job) -> dict[str, Any]:
    """All that the answer depends on, by name; what is not a single value stands by its SHA-256, in 12 digits."""
    single = (str, int, float, bool, type(None))
    identity = {"version": __version__, **job.identity()}
    for key, value in identity.items():
        if not isinstance(value, single):
            text = json.dumps(value, sort_keys=True, separators=(",", ":"), default=lambda array: array.tolist())
            identity[key] = hashlib.sha256(text.encode()).hexdigest()[:12]
    return identity
