"""Workers beyond this machine, by Dask distributed (extra `cluster`); a local cluster of processes works the same.

The executor of its client does the blocks. The job travels once to every worker, a task of its own that all others
need. Nothing but the tallies comes back, and they are dropped there at once.
"""

from __future__ import annotations

import logging
import pickle
import signal
import threading
import uuid
import warnings
import zlib
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from contextlib import ExitStack, contextmanager, suppress
from time import perf_counter
from typing import Any, Generic

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.studies.tolerance.processes import DEATHS, PAUSE, deadly, unheard
from trunnion.studies.tolerance.protocol import Blocks, Job, Portion, T, part_of
from trunnion.version import __version__

try:
    import dask
    from distributed import Client, KilledWorker, LocalCluster
except ImportError:
    what, remedy = "a cluster needs the package distributed", "pip install 'trunnion[cluster]'"
    raise MechanismError(Finding(what, "cluster", remedy)) from None

__all__ = ["Cluster"]

CONNECT = 10  # s to reach the scheduler
ARRIVE = 60  # s for the first worker to be there
RESTARTED = 10  # s for one that died to be there again
COUNTED = 5.0  # s between two counts of the workers


_here = threading.local()  # of each thread of a worker: the job that it has prepared


def _versions() -> dict[str, str]:
    """What has to be the same on all machines, exactly."""
    return {"trunnion": __version__, "numpy": np.__version__}


def _evaluated(job: bytes, name: str, versions: dict[str, str], blocks: Blocks) -> bytes:
    """On a worker: a part, packed: histograms are mostly zeros, the network is slow."""
    if getattr(_here, "name", None) != name:
        here = _versions()
        if here != versions:
            texts = [f"{package} {here[package]}, not {theirs}" for package, theirs in versions.items()]
            what = f"a worker of the cluster has other versions: {'; '.join(texts)}"
            raise MechanismError(Finding(what, "cluster", "install the same on all machines"))
        _here.prepared, _here.name = pickle.loads(job).prepare(), name
    return zlib.compress(pickle.dumps(part_of(_here.prepared, blocks), pickle.HIGHEST_PROTOCOL), 1)


def dask_setup(_worker: Any) -> None:
    """Dask calls it in every worker of a local cluster: Ctrl-C is for the main process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextmanager
def _quiet() -> Iterator[None]:
    """Nothing of Dask's on the terminal: what matters comes back as an exception."""
    names = ("distributed", "tornado", "asyncio")
    before = {name: logging.getLogger(name).level for name in names}
    for name in names:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)


class Cluster(Generic[T]):
    """`Crew` on a Dask cluster: `address` of its scheduler, or "local" for so many processes here."""

    def __init__(self, job: Job[T], address: str, jobs: int) -> None:
        self._address, self._jobs = address, jobs
        self._name = f"trunnion-{uuid.uuid4().hex[:12]}"
        self._under_way: dict[Future[bytes], Blocks] = {}
        self._stack = ExitStack()
        self._stack.enter_context(_quiet())
        try:
            self._client = self._connected(jobs)
            self._threads = self._counted()
        except BaseException:
            self._stack.close()
            raise
        # a task like any other: done again where its result is lost
        self._job = self._client.submit(bytes, pickle.dumps(job), key=f"{self._name}-job")
        self._executor = self._client.get_executor(pure=False, retries=0)

    def _connected(self, jobs: int) -> Client:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # versions are compared by the workers, ports are no matter
            if self._address == "local":
                # a range that ends its third worker is given up, as `Processes` does it
                config = {
                    "distributed.scheduler.allowed-failures": DEATHS - 1,
                    # a worker that dies while it starts tells so before it hears of `silence_logs`
                    "distributed.nanny.pre-spawn-environ.DASK_LOGGING__DISTRIBUTED": "critical",
                }
                with unheard(), dask.config.set(config):
                    options: dict[str, Any] = {"threads_per_worker": 1, "dashboard_address": None, "memory_limit": 0}
                    options |= {"silence_logs": logging.CRITICAL + 1, "preload": [__name__]}
                    local = LocalCluster(n_workers=jobs, **options)
                    self._stack.callback(local.close)
                    client = Client(local, set_as_default=False)
                self._stack.enter_context(client)
                return client
            try:
                client = Client(self._address, timeout=CONNECT, set_as_default=False)
            except (OSError, ValueError, TimeoutError) as error:
                what = f"no Dask scheduler answers at {self._address} ({error})"
                remedy = "start one with `dask scheduler`, and state the address it prints; or `local`"
                raise MechanismError(Finding(what, "cluster", remedy)) from None
            self._stack.enter_context(client)
            return client

    def _counted(self) -> int:
        """Threads of all workers; waits for the first worker."""
        try:
            self._client.wait_for_workers(1, timeout=ARRIVE)
        except TimeoutError:
            what = f"no worker has joined the scheduler at {self._address} within {ARRIVE} s"
            raise MechanismError(Finding(what, "cluster", "start some: `dask worker ADDRESS`")) from None
        self._count_at = perf_counter() + COUNTED
        return int(sum(self._client.nthreads().values()))

    @property
    def workers(self) -> int:
        if perf_counter() > self._count_at and self._client.status == "running":
            self._count_at = perf_counter() + COUNTED
            self._threads = sum(self._client.nthreads().values())
        return max(1, self._threads)

    def give(self, blocks: Blocks) -> None:
        future = self._executor.submit(_evaluated, self._job, self._name, _versions(), blocks)
        self._under_way[future] = blocks

    def wait(self) -> Sequence[Portion[T]]:
        return [self._part(future) for future in wait(self._under_way, PAUSE, FIRST_COMPLETED).done]

    def _part(self, future: Future[bytes]) -> Portion[T]:
        blocks = self._under_way.pop(future)
        try:
            part: Portion[T] = pickle.loads(zlib.decompress(future.result()))
        except KilledWorker:
            raise deadly(blocks, "workers of the cluster that died") from None
        except CancelledError:
            what = f"the connection with the scheduler at {self._address} was lost"
            remedy = "start it again and continue with --resume, if there is a checkpoint"
            raise MechanismError(Finding(what, "cluster", remedy)) from None
        return part

    def close(self, finished: bool) -> None:
        with self._stack:
            if self._client.status == "running":
                with suppress(OSError, TimeoutError):
                    self._executor.shutdown(wait=finished)
                    if self._address == "local" and not finished:
                        # one that is being started again while the cluster closes says so on the terminal
                        self._client.wait_for_workers(self._jobs, timeout=RESTARTED)
            self._under_way.clear()
