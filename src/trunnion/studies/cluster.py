"""Workers beyond this machine: the executor of a Dask cluster (extra `cluster`) by the address of its scheduler."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor
from contextlib import contextmanager, suppress

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.version import __version__

try:
    from distributed import Client, KilledWorker
except ImportError:
    what, remedy = "a cluster needs the package distributed", "pip install 'trunnion[cluster]'"
    raise MechanismError(Finding(what, "cluster", remedy)) from None

CONNECT = 10  # s to reach the scheduler
ARRIVE = 60  # s for the first worker to be there
START = "start it with `dask scheduler` and `dask worker ADDRESS`: with a --checkpoint, no block is done twice"


@contextmanager
def connected(address: str) -> Iterator[tuple[Executor, int]]:
    """The executor of the cluster at an address, and how many threads its workers have.

    Raises MechanismError if no scheduler or worker answers, if a worker has other versions of Trunnion or NumPy, whose
    bits may differ, or if a block ends several workers.
    """
    loggers = [logging.getLogger(name) for name in ("distributed", "tornado", "asyncio")]
    before = [logger.level for logger in loggers]
    for logger in loggers:  # nothing of Dask's on the terminal: what matters comes back as an exception
        logger.setLevel(logging.CRITICAL + 1)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the versions that matter are compared here, ports are no matter
            try:
                client: Client = Client(address, timeout=CONNECT, set_as_default=False)
                client.wait_for_workers(1, timeout=ARRIVE)
            except (OSError, ValueError, TimeoutError) as error:
                what = f"no Dask scheduler with workers answers at {address} ({error})"
                raise MechanismError(Finding(what, "cluster", START)) from None
        with client:
            if any(versions != _versions() for versions in client.run(_versions).values()):
                what = f"a worker of the cluster has other versions than here: {_versions()}"
                raise MechanismError(Finding(what, "cluster", "install the same on all machines"))
            executor = client.get_executor(pure=False, retries=0)
            try:
                yield executor, sum(client.nthreads().values())
            finally:
                if client.status == "running":
                    with suppress(OSError, TimeoutError):
                        executor.shutdown(wait=False)
    except KilledWorker:
        what = "a block ended one worker of the cluster after another"
        raise MechanismError(Finding(what, "cluster", "often too little memory: fewer --steps")) from None
    except CancelledError:
        what = f"the connection with the scheduler at {address} was lost"
        raise MechanismError(Finding(what, "cluster", START)) from None
    finally:
        for logger, level in zip(loggers, before, strict=True):
            logger.setLevel(level)


def _versions() -> dict[str, str]:
    """On a worker: what has to be the same everywhere, exactly."""
    return {"trunnion": __version__, "numpy": np.__version__}
