"""One job on one core, on all of them or on a cluster: the same tally to the last bit.

`run` cuts the blocks of a job into portions, has a crew do them, a bounded number at a time, and merges what comes
back. Memory does not grow with the number of samples. A worker that dies is replaced and its blocks are done again;
what a checkpoint holds need not be done again; Ctrl-C ends the run and keeps what is done.
"""

from __future__ import annotations

import math
import os
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from typing import Generic

from trunnion.errors import Finding, MechanismError
from trunnion.studies.tolerance.checkpoint import Checkpoint
from trunnion.studies.tolerance.processes import Interruption, Processes, unheard
from trunnion.studies.tolerance.protocol import Blocks, Crew, Job, Portion, Prepared, T, Tally, mixed, part_of
from trunnion.studies.tolerance.ranges import Portions

__all__ = ["Crew", "Job", "JobRun", "Portion", "Prepared", "Tally", "run"]

AHEAD = 2  # portions given to every worker: the one under way and the next
NEAR, FAR = 1.0, 10.0  # s: what a portion takes on this machine, and on a cluster, unless `chunk` says otherwise


@dataclass(frozen=True)
class JobRun(Generic[T]):
    """The tally of what was done; `stopped`: by Ctrl-C, before the end.

    notes: a checkpoint that could not be written; machines whose last bits differ.
    """

    tally: T
    stopped: bool
    notes: tuple[Finding, ...] = ()


class Here(Generic[T]):
    """`Crew` of this process alone."""

    workers = 1

    def __init__(self, job: Job[T]) -> None:
        self._prepared = job.prepare()
        self._given: deque[Blocks] = deque()

    def give(self, blocks: Blocks) -> None:
        self._given.append(blocks)

    def wait(self) -> Sequence[Portion[T]]:
        return [part_of(self._prepared, self._given.popleft())]

    def close(self, finished: bool) -> None:
        pass


class Threads(Generic[T]):
    """`Crew` of several threads of this process, for what leaves Python's interpreter lock most of the time."""

    def __init__(self, job: Job[T], jobs: int) -> None:
        self.workers = jobs
        self._prepared = job.prepare()
        with unheard():  # Ctrl-C is for the main thread
            self._pool = ThreadPoolExecutor(jobs)
        self._given: set[Future[Portion[T]]] = set()

    def give(self, blocks: Blocks) -> None:
        with unheard():
            self._given.add(self._pool.submit(part_of, self._prepared, blocks))

    def wait(self) -> Sequence[Portion[T]]:
        done, self._given = wait(self._given, return_when=FIRST_COMPLETED)
        return [future.result() for future in done]

    def close(self, finished: bool) -> None:
        self._pool.shutdown(cancel_futures=True)


def _crew(job: Job[T], jobs: int, cluster: str | None, left: int, threads: bool) -> Crew[T]:
    if cluster is not None:
        from trunnion.studies.tolerance.cluster import Cluster  # its package is an extra

        return Cluster(job, cluster, min(jobs, left))
    if min(jobs, left) <= 1:
        return Here(job)
    return Threads(job, min(jobs, left)) if threads else Processes(job, min(jobs, left))


def _checked(jobs: int | None, chunk: int | None, resume: bool, checkpoint: object) -> int:
    """Number of jobs; MechanismError if the arguments make no sense."""
    findings = []
    if jobs is not None and jobs < 1:
        findings.append(Finding(f"{jobs} jobs", "jobs", "state 1 or more, or none for all cores"))
    if chunk is not None and chunk < 1:
        findings.append(
            Finding(f"a portion of {chunk} samples", "chunk", "state 1 or more; it is rounded up to blocks")
        )
    if resume and checkpoint is None:
        findings.append(Finding("there is no checkpoint", "resume", "name the file: --checkpoint FILE"))
    if findings:
        raise MechanismError(findings)
    return jobs or os.cpu_count() or 1


def run(
    job: Job[T],
    *,
    jobs: int | None = 1,
    chunk: int | None = None,
    cluster: str | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
    resume: bool = False,
    progress: Callable[[int], None] | None = None,
    threads: bool = False,
) -> JobRun[T]:
    """Do the job, or what a checkpoint leaves of it.

    jobs: processes on this machine (None: one per core); one job and no cluster needs none beside this.
    chunk: samples handed out at a time, rounded up to whole blocks; by default what takes about a second (on a
    cluster ten). cluster: "local" (a Dask cluster of `jobs` processes here) or the address of a Dask scheduler.
    checkpoint: file that the tally is written to every 30 s or more, at Ctrl-C, at an error and at the end.
    resume: go on from that file if it is there. progress: called with the samples done, in this thread. threads: of
    this process in place of processes.

    Raises MechanismError, with one finding each, if the checkpoint is damaged or of another job, if the same blocks
    end three workers in turn, if the cluster cannot be reached. Whatever is raised, what is done is kept first.
    """
    jobs = _checked(jobs, chunk, resume, checkpoint)
    done = Checkpoint(checkpoint, job)
    done.begin(resume)
    stated = None if chunk is None else math.ceil(chunk / job.block_size)
    portions = Portions(done.tally.blocks, job.blocks, stated, NEAR if cluster is None else FAR)

    def tell() -> None:
        if progress is not None:
            progress(round(job.samples * (1 - done.left / job.blocks)))

    with Interruption() as interruption:
        tell()
        if portions.left:
            crew = _crew(job, jobs, cluster, portions.left, threads)
            try:
                _spread(crew, portions, done, tell, interruption)
            finally:
                try:
                    done.keep()
                finally:
                    crew.close(finished=not done.left)
    trouble = () if done.trouble is None else (done.trouble,)
    return JobRun(done.tally, done.left > 0, trouble + mixed(done.arithmetic))


def _spread(
    crew: Crew[T], portions: Portions, done: Checkpoint[T], tell: Callable[[], None], interruption: Interruption
) -> None:
    """Until all blocks are done or Ctrl-C is pressed."""
    under_way = 0
    while not interruption.asked:
        while portions.left and under_way < AHEAD * crew.workers:
            crew.give(portions.take(crew.workers))
            under_way += 1
        if not under_way:
            break
        for part in interruption.during(crew.wait) or ():
            under_way -= 1
            done.add(part)
            portions.seen(part.blocks, part.seconds)
            tell()
        if done.left:
            done.perhaps()
    assert interruption.asked or not done.left
