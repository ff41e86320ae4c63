"""Processes of this machine: the pool of the standard library, put up again when a worker dies.

They are started anew (`spawn`), as Windows and macOS do it everywhere; the job goes to each once, at its start. A pool
does not say which of its blocks ended a worker, so those that were lost are done again one range at a time.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import cache
from multiprocessing.process import BaseProcess
from types import FrameType
from typing import Any, Generic, Self, TypeVar

from trunnion.errors import Finding, MechanismError
from trunnion.studies.tolerance.protocol import Blocks, Job, Portion, T, part_of

__all__ = ["DEATHS", "PAUSE", "Interruption", "Processes", "deadly", "unheard"]

A = TypeVar("A")
DEATHS = 3  # so often a range may end its worker before it is blamed
GRACE = 5.0  # s; a pool that is broken terminates its workers, but one that has hardly begun may not hear it
PAUSE = 0.5  # s; Windows hears Ctrl-C only between two waits
_given: list[bytes] = []  # in a worker: the job


def deadly(blocks: Blocks, how: str) -> MechanismError:
    """Three workers died of the same blocks."""
    first, last = blocks
    what = f"blocks {first} to {last - 1} ended {DEATHS} workers in turn ({how})"
    return MechanismError(Finding(what, "", "often too little memory: fewer --jobs, a smaller --chunk, fewer --steps"))


def _begin(job: bytes) -> None:
    """In a worker: keep the job; leave Ctrl-C to the main process, and end when that ends, however it does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _given[:] = [job]
    threading.Thread(target=_follow, daemon=True).start()


def _follow() -> None:
    main = multiprocessing.parent_process()
    if main is not None:
        main.join()
        os._exit(1)


@cache
def _prepared() -> Any:
    return pickle.loads(_given[0]).prepare()


def _evaluated(blocks: Blocks) -> Portion[Any]:
    return part_of(_prepared(), blocks)


class Processes(Generic[T]):
    """`Crew` of so many processes."""

    def __init__(self, job: Job[T], workers: int) -> None:
        self.workers = workers
        self._job = pickle.dumps(job)
        self._queue: deque[Blocks] = deque()
        self._under_way: dict[Future[Portion[T]], Blocks] = {}
        self._deaths: Counter[Blocks] = Counter()
        self._stillborn = 0
        self._begin()

    def _begin(self) -> None:
        self._processes: set[BaseProcess] = set()
        self._pool = ProcessPoolExecutor(self.workers, multiprocessing.get_context("spawn"), _begin, (self._job,))
        self._born = self._submitted(int)

    def _submitted(self, work: Callable[..., A], *arguments: object) -> Future[A]:
        with unheard():  # it may start a process
            future = self._pool.submit(work, *arguments)
        # Not `multiprocessing.active_children()`, which forgets a worker that has ended already, and how it ended.
        self._processes |= set((self._pool._processes or {}).values())
        return future

    def give(self, blocks: Blocks) -> None:
        self._queue.append(blocks)

    def wait(self) -> Sequence[Portion[T]]:
        parts, lost, broken = [], [], False
        try:
            while self._queue and not (self._under_way and self._suspect()):
                self._under_way[self._submitted(_evaluated, self._queue[0])] = self._queue[0]
                self._queue.popleft()
        except BrokenProcessPool:
            broken = True
        for future in wait(self._under_way, PAUSE, FIRST_COMPLETED).done:
            blocks = self._under_way.pop(future)
            try:
                parts.append(future.result())
            except BrokenProcessPool:
                lost.append(blocks)
        if parts:
            self._stillborn = 0
        if lost or broken:
            self._replace([*lost, *self._under_way.values()])
        return parts

    def _suspect(self) -> bool:
        """Whether the next blocks, or those under way, have been there when a worker died."""
        return any(self._deaths[blocks] for blocks in (self._queue[0], *self._under_way.values()))

    def _replace(self, lost: Sequence[Blocks]) -> None:
        """Another pool for one whose worker died; the blocks that it had are remembered and done again."""
        self._under_way.clear()
        for one in self._processes:
            one.join(GRACE)
        how = self._end()
        for one in self._processes:
            if one.is_alive():
                one.kill()  # else the pool would wait for it without end
        self._pool.shutdown()
        if self._born.exception() is not None:
            self._stillborn += 1
            if self._stillborn >= DEATHS:
                what = f"worker processes end before they have begun ({how})"
                remedy = "a script calls it under `if __name__ == '__main__':`; or use one job"
                raise MechanismError(Finding(what, "", remedy))
        else:
            self._deaths.update(lost)
        self._queue.extendleft(sorted(lost, reverse=True))
        for blocks in lost:
            if self._deaths[blocks] >= DEATHS:
                raise deadly(blocks, how)
        self._begin()

    def _end(self) -> str:
        """How the worker ended that ended the pool; the pool then terminates the others."""
        codes: list[int] = []
        for _ in range(20):  # while another thread has waited for it and not yet noted how it ended, there is no code
            codes = [one.exitcode for one in self._processes if one.exitcode]
            if any(code != -signal.SIGTERM for code in codes):
                break
            time.sleep(GRACE / 200)
        code = next((code for code in codes if code != -signal.SIGTERM), codes[0] if codes else None)
        if code is None or code >= 0:
            return f"exit status {code}"
        try:
            return f"killed by {signal.Signals(-code).name}"
        except ValueError:
            return f"killed by signal {-code}"

    def close(self, finished: bool) -> None:
        if not finished:
            for one in self._processes:
                one.kill()
        self._pool.shutdown(cancel_futures=True)


class Interruption:
    """While it is entered, Ctrl-C sets `asked`; it raises only inside `during`, or if pressed a second time.

    A handler that the calling program has set itself stays, and so does what it raises.
    """

    def __init__(self) -> None:
        self.asked = False
        self._open = False
        self._previous: Any = None

    def __enter__(self) -> Self:
        ours = threading.current_thread() is threading.main_thread()
        if ours and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            self._previous = signal.signal(signal.SIGINT, self._hear)
        return self

    def __exit__(self, *_: object) -> None:
        if self._previous is not None:
            signal.signal(signal.SIGINT, self._previous)

    def _hear(self, _number: int, _frame: FrameType | None) -> None:
        again, self.asked = self.asked, True
        if self._open or again:
            self._open = False
            raise KeyboardInterrupt

    def during(self, waiting: Callable[[], A]) -> A | None:
        """What `waiting` returns; None if Ctrl-C ended it."""
        try:
            try:
                self._open = True
                return waiting()
            finally:
                self._open = False
        except KeyboardInterrupt:
            self.asked = True
            return None


@contextmanager
def unheard() -> Iterator[None]:
    """Processes and threads started inside never see a Ctrl-C: they inherit that it is blocked (not on Windows)."""
    if not hasattr(signal, "pthread_sigmask"):  # pragma: no cover - Windows: the worker ignores it once it runs
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
