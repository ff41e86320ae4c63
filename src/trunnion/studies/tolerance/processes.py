"""Processes of this machine, each with its own pipe, so that it is known what a dead one was doing.

They are started anew (`spawn`), as Windows and macOS do it everywhere; the job goes to each once, at its start.
"""

from __future__ import annotations

import multiprocessing
import pickle
import signal
import traceback
from collections import Counter, deque
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from time import perf_counter
from typing import Any, Generic

from trunnion.errors import Finding, MechanismError
from trunnion.studies.tolerance.arithmetic import fingerprint
from trunnion.studies.tolerance.interruption import unheard
from trunnion.studies.tolerance.protocol import Blocks, Job, Part, T

__all__ = ["DEATHS", "Processes", "deadly"]

DEATHS = 3  # so often a range may end its worker before it is blamed
AHEAD = 2  # ranges a worker holds: the one under way and the next
PAUSE = 0.5  # s; Windows hears Ctrl-C only between two waits


def deadly(blocks: Blocks, how: str) -> MechanismError:
    """Three workers died of the same blocks."""
    first, last = blocks
    what = f"blocks {first} to {last - 1} ended {DEATHS} workers in turn ({how})"
    return MechanismError(Finding(what, "", "often too little memory: fewer --jobs, a smaller --chunk, fewer --steps"))


def _report(pipe: Connection, error: Exception) -> None:
    """Send what went wrong, with the place; in words only if it does not survive the way."""
    text = f"in a worker process:\n{traceback.format_exc()}"
    error.add_note(text)
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        error = RuntimeError(text)
    pipe.send(error)


def _serve(job: bytes, pipe: Connection) -> None:
    """Prepare the job, say so with a None, then do range after range until a None comes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with suppress(EOFError, OSError):  # the main process is gone: nobody listens
        try:
            prepared = pickle.loads(job).prepare()
        except Exception as error:
            return _report(pipe, error)
        pipe.send(None)
        while (blocks := pipe.recv()) is not None:
            start = perf_counter()
            try:
                tally = prepared.evaluate(*blocks)
            except Exception as error:
                return _report(pipe, error)
            pipe.send(Part(blocks, perf_counter() - start, tally, fingerprint()))


@dataclass
class _Worker:
    process: BaseProcess
    pipe: Connection
    given: deque[Blocks] = field(default_factory=deque)
    ready: bool = False

    @property
    def end(self) -> str:
        """How it ended."""
        self.process.join(5)
        code = self.process.exitcode
        if code is None or code >= 0:
            return f"exit status {code}"
        try:
            return f"killed by {signal.Signals(-code).name}"
        except ValueError:
            return f"killed by signal {-code}"


class Processes(Generic[T]):
    """`Crew` of so many processes."""

    def __init__(self, job: Job[T], workers: int) -> None:
        self._job = pickle.dumps(job)
        self._context = multiprocessing.get_context("spawn")
        self._deaths: Counter[Blocks] = Counter()
        self._stillborn = 0
        self._crew: list[_Worker] = []
        for _ in range(workers):
            self._crew.append(self._hired())

    def _hired(self) -> _Worker:
        ours, theirs = self._context.Pipe()
        # daemon: ended with this process, however that ends
        process = self._context.Process(target=_serve, args=(self._job, theirs), daemon=True)
        with unheard():
            process.start()
        theirs.close()  # else the end of the process would not end the pipe
        return _Worker(process, ours)

    @property
    def workers(self) -> int:
        return len(self._crew)

    @property
    def room(self) -> int:
        return sum(AHEAD - len(worker.given) for worker in self._crew)

    def give(self, blocks: Blocks) -> None:
        worker = min(self._crew, key=lambda worker: len(worker.given))
        worker.given.append(blocks)
        with suppress(OSError):  # it is dead: found out, and mended, at the next `wait`
            worker.pipe.send(blocks)

    def wait(self) -> Sequence[Part[T]]:
        waited: list[Any] = [end for worker in self._crew for end in (worker.pipe, worker.process.sentinel)]
        woken = set(wait(waited, PAUSE))
        parts = []
        for place, worker in enumerate(self._crew):
            if worker.pipe in woken:
                part = self._heard(worker)
                if part is not None:
                    parts.append(part)
                    continue
            dead = worker.process.sentinel in woken or worker.pipe.closed
            if dead and (worker.pipe.closed or not worker.pipe.poll()):  # what it said before it died comes first
                self._crew[place] = self._replaced(worker)
        return parts

    def _heard(self, worker: _Worker) -> Part[T] | None:
        try:
            message = worker.pipe.recv()
        except (EOFError, OSError):  # dead, perhaps in mid-sentence
            worker.pipe.close()
            return None
        if isinstance(message, Exception):
            raise message
        worker.ready, self._stillborn = True, 0
        if message is None:
            return None
        worker.given.remove(message.blocks)
        part: Part[T] = message
        return part

    def _replaced(self, worker: _Worker) -> _Worker:
        """A new worker that does again what the dead one had; the range it was at is remembered."""
        worker.pipe.close()
        if worker.ready and worker.given:
            blamed = worker.given[0]
            self._deaths[blamed] += 1
            if self._deaths[blamed] >= DEATHS:
                raise deadly(blamed, worker.end)
        elif not worker.ready:
            self._stillborn += 1
            if self._stillborn >= DEATHS:
                what = f"worker processes end before they have begun ({worker.end})"
                remedy = "a script calls it under `if __name__ == '__main__':`; or use one job"
                raise MechanismError(Finding(what, "", remedy))
        hired = self._hired()
        hired.given = worker.given
        with suppress(OSError):
            for blocks in hired.given:
                hired.pipe.send(blocks)
        return hired

    def close(self, finished: bool) -> None:
        for worker in self._crew:
            if finished and not worker.pipe.closed:
                with suppress(OSError):
                    worker.pipe.send(None)
            else:
                worker.process.kill()
        for worker in self._crew:
            worker.process.join(5)
            if worker.process.is_alive():
                worker.process.kill()
                worker.process.join()
            worker.process.close()
            worker.pipe.close()
