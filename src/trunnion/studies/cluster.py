"""Workers beyond this machine: the executor of a Dask cluster (extra `cluster`), by its address or put up here."""

from __future__ import annotations

import logging
import signal
import warnings
from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor
from contextlib import ExitStack, contextmanager, suppress
from typing import Any

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.studies.job import DEATHS, undisturbed
from trunnion.version import __version__

try:
    import dask
    from distributed import Client, KilledWorker, LocalCluster
except ImportError:
    what, remedy = "a cluster needs the package distributed", "pip install 'trunnion[cluster]'"
    raise MechanismError(Finding(what, "cluster", remedy)) from None

__all__ = ["connected"]

CONNECT = 10  # s to reach the scheduler
ARRIVE = 60  # s for the first worker to be there
RESTARTED = 10  # s for one that died to be there again
LOST = "start it again: with a --checkpoint, the blocks that are done are not done again"


@contextmanager
def connected(address: str, jobs: int) -> Iterator[tuple[Executor, int]]:
    """The executor of the cluster at an address, or of so many processes here ("local"), and how many workers it has.

    Raises MechanismError if no scheduler or worker answers, if a worker has other versions of Trunnion or NumPy, whose
    bits may differ, or if a block ends several workers.
    """
    with _quiet(), ExitStack() as stack:
        client = _local(stack, jobs) if address == "local" else _remote(stack, address)
        try:
            client.wait_for_workers(1, timeout=ARRIVE)
        except TimeoutError:
            what = f"no worker has joined the scheduler at {address} within {ARRIVE} s"
            raise MechanismError(Finding(what, "cluster", "start some: `dask worker ADDRESS`")) from None
        versions = {"trunnion": __version__, "numpy": np.__version__}
        if any(other != versions for other in client.run(_versions).values()):
            what = f"a worker of the cluster has other versions than here: {versions}"
            raise MechanismError(Finding(what, "cluster", "install the same on all machines"))
        executor = client.get_executor(pure=False, retries=0)
        try:
            yield executor, sum(client.nthreads().values())
        except KilledWorker:
            what = f"a block ended {DEATHS} workers of the cluster in turn"
            raise MechanismError(Finding(what, "cluster", "often too little memory: fewer --steps")) from None
        except CancelledError:
            what = f"the connection with the scheduler at {address} was lost"
            raise MechanismError(Finding(what, "cluster", LOST)) from None
        finally:
            if client.status == "running":
                with suppress(OSError, TimeoutError):
                    executor.shutdown(wait=False)
                    if address == "local":  # a worker that is being started again while the cluster closes complains
                        client.wait_for_workers(jobs, timeout=RESTARTED)


def _versions() -> dict[str, str]:
    """On a worker: what has to be the same everywhere, exactly."""
    return {"trunnion": __version__, "numpy": np.__version__}


def _remote(stack: ExitStack, address: str) -> Client:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the versions that matter are compared here, ports are no matter
        try:
            client: Client = stack.enter_context(Client(address, timeout=CONNECT, set_as_default=False))
        except (OSError, ValueError, TimeoutError) as error:
            what = f"no Dask scheduler answers at {address} ({error})"
            remedy = "start one with `dask scheduler`, and state the address it prints; or `local`"
            raise MechanismError(Finding(what, "cluster", remedy)) from None
    return client


def _local(stack: ExitStack, jobs: int) -> Client:
    config = {
        "distributed.scheduler.allowed-failures": DEATHS - 1,
        # a worker that dies while it starts says so before it hears of `silence_logs`
        "distributed.nanny.pre-spawn-environ.DASK_LOGGING__DISTRIBUTED": "critical",
    }
    options: dict[str, Any] = {"threads_per_worker": 1, "dashboard_address": None, "memory_limit": 0}
    options |= {"silence_logs": logging.CRITICAL + 1, "preload": [__name__]}
    with warnings.catch_warnings(), undisturbed(), dask.config.set(config):
        warnings.simplefilter("ignore")
        cluster = stack.enter_context(LocalCluster(n_workers=jobs, **options))
        client: Client = stack.enter_context(Client(cluster, set_as_default=False))
    return client


def dask_setup(_worker: Any) -> None:
    """Dask calls it in every worker of a local cluster: Ctrl-C is for the main process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextmanager
def _quiet() -> Iterator[None]:
    """Nothing of Dask's on the terminal: what matters comes back as an exception."""
    loggers = [logging.getLogger(name) for name in ("distributed", "tornado", "asyncio")]
    before = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, before, strict=True):
            logger.setLevel(level)
