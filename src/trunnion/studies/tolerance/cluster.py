"""Workers beyond this machine, by Dask distributed (extra `cluster`); a local cluster of processes works the same.

The job travels once to every worker, as a worker plugin: a worker that joins late, or takes a dead one's place, gets
it on joining. Tasks carry two numbers. Nothing but the tallies comes back, and they are dropped there at once.
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
from contextlib import ExitStack, contextmanager, suppress
from time import perf_counter
from typing import Any, Generic

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.studies.tolerance.arithmetic import fingerprint
from trunnion.studies.tolerance.interruption import unheard
from trunnion.studies.tolerance.processes import DEATHS, deadly
from trunnion.studies.tolerance.protocol import Blocks, Job, Part, T
from trunnion.version import __version__

try:
    import dask
    from distributed import Client, Future, KilledWorker, LocalCluster, WorkerPlugin, as_completed, get_worker
except ImportError:
    what, remedy = "a cluster needs the package distributed", "pip install 'trunnion[cluster]'"
    raise MechanismError(Finding(what, "cluster", remedy)) from None

__all__ = ["Cluster"]

AHEAD = 2  # ranges under way for every thread of the cluster
CONNECT = 10  # s to reach the scheduler
ARRIVE = 60  # s for the first worker to be there
COUNTED = 5.0  # s between two counts of the workers


def _versions() -> dict[str, str]:
    """What has to be the same on all machines, exactly."""
    return {"trunnion": __version__, "numpy": np.__version__}


class Task(WorkerPlugin):
    """The job on a worker: sent as it is, prepared by each thread when it first does a range."""

    def __init__(self, job: bytes, local: bool) -> None:
        self._job = job
        self._local = local
        self._versions = _versions()
        self._prepared: Any = None

    def setup(self, worker: Any) -> None:
        self._prepared = threading.local()
        if self._local and threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the main process

    def prepared(self) -> Any:
        """What evaluates blocks in this thread; MechanismError if this worker would compute other bits."""
        if not hasattr(self._prepared, "job"):
            here = _versions()
            if here != self._versions:
                texts = [f"{name} {here[name]}, not {theirs}" for name, theirs in self._versions.items()]
                what = f"a worker of the cluster has other versions: {'; '.join(texts)}"
                raise MechanismError(Finding(what, "cluster", "install the same on all machines"))
            self._prepared.job = pickle.loads(self._job).prepare()
        return self._prepared.job


def _evaluate(name: str, first: int, last: int) -> bytes:
    """On a worker: the part of blocks first … last - 1, packed: histograms are mostly zeros, the network is slow."""
    task: Any = get_worker().plugins[name]
    prepared = task.prepared()
    start = perf_counter()
    tally = prepared.evaluate(first, last)
    part = Part((first, last), perf_counter() - start, tally, fingerprint())
    return zlib.compress(pickle.dumps(part, pickle.HIGHEST_PROTOCOL), 1)


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
        self._address = address
        self._name = f"trunnion-{uuid.uuid4().hex[:12]}"
        self._under_way: dict[Future[Any], Blocks] = {}
        self._stack = ExitStack()
        self._stack.enter_context(_quiet())
        try:
            self._client = self._connected(jobs)
            self._client.register_plugin(Task(pickle.dumps(job), address == "local"), name=self._name)
            self._threads = self._counted()
        except BaseException:
            self._stack.close()
            raise
        self._ready = as_completed(loop=self._client.loop)

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
                    local = LocalCluster(n_workers=jobs, silence_logs=logging.CRITICAL + 1, **options)
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
        return max(1, self._threads)

    @property
    def room(self) -> int:
        if perf_counter() > self._count_at and self._client.status == "running":
            self._count_at = perf_counter() + COUNTED
            self._threads = sum(self._client.nthreads().values())
        return AHEAD * self.workers - len(self._under_way)

    def give(self, blocks: Blocks) -> None:
        first, last = blocks
        future = self._client.submit(
            _evaluate, self._name, first, last, key=f"{self._name}-{first}-{last}", pure=False, retries=0
        )
        self._under_way[future] = blocks
        self._ready.add(future)

    def wait(self) -> Sequence[Part[T]]:
        future = next(self._ready)
        parts = [self._part(future)]
        while self._ready.has_ready():
            parts.append(self._part(next(self._ready)))
        return parts

    def _part(self, future: Future[Any]) -> Part[T]:
        blocks = self._under_way.pop(future)
        if future.status == "error":
            error = future.exception()
            if isinstance(error, KilledWorker):
                raise deadly(blocks, "workers of the cluster that died") from None
            assert error is not None
            raise error
        if future.status != "finished":
            what = f"the connection with the scheduler at {self._address} was lost"
            remedy = "start it again and go on with --resume, if there is a checkpoint"
            raise MechanismError(Finding(what, "cluster", remedy))
        part: Part[T] = pickle.loads(zlib.decompress(future.result()))
        future.release()
        return part

    def close(self, finished: bool) -> None:
        with self._stack:
            if self._client.status == "running":
                with suppress(OSError, TimeoutError):
                    if not finished:
                        self._client.cancel(list(self._under_way))
                    self._client.unregister_worker_plugin(self._name)
            self._under_way.clear()
