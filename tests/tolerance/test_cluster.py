"""A Dask cluster gives what one process gives, in silence."""

from __future__ import annotations

import json
import logging
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from toy_job import ToyJob
from toy_programs import ENVIRONMENT, POSIX, interrupted
from trunnion import MechanismError
from trunnion.studies.tolerance.runner import run

pytest.importorskip("distributed")

EXPECTED = run(ToyJob()).tally.bits()


@pytest.mark.slow
@pytest.mark.parametrize(("jobs", "chunk"), [(1, None), (2, 1), (3, 3500)])
def test_same_bits_on_a_local_cluster(jobs: int, chunk: int | None, capfd: pytest.CaptureFixture[str]) -> None:
    told: list[int] = []
    level = logging.getLogger("distributed").level
    done = run(ToyJob(), jobs=jobs, chunk=chunk, cluster="local", progress=told.append)
    assert done.tally.bits() == EXPECTED
    assert not done.stopped
    assert told[-1] == ToyJob().samples
    assert capfd.readouterr() == ("", "")
    assert logging.getLogger("distributed").level == level


@pytest.mark.slow
@POSIX
def test_a_killed_worker_costs_time_only(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    done = run(ToyJob(fatal=17, folder=tmp_path), jobs=2, chunk=1500, cluster="local")
    assert (tmp_path / "perished").exists()
    assert done.tally.bits() == EXPECTED
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
@POSIX
def test_blocks_that_kill_every_worker_are_an_error(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(MechanismError, match=r"blocks \d+ to \d+ ended 3 workers in turn"):
        run(ToyJob(fatal=17), jobs=1, chunk=2000, cluster="local")
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_what_a_job_raises_arrives(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(MechanismError, match=r"links\.x: no such link"):
        run(ToyJob(fault="prepare"), cluster="local")
    path = tmp_path / "run.npz"
    with pytest.raises(ZeroDivisionError, match="block 5"):
        run(ToyJob(fault="evaluate"), chunk=500, cluster="local", checkpoint=path)
    assert run(ToyJob(), checkpoint=path, resume=True).tally.bits() == EXPECTED
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
@POSIX
def test_ctrl_c_from_the_terminal_is_quiet(tmp_path: Path) -> None:
    lines, complaints = interrupted(tmp_path, 2, "local")
    assert lines[-1] == "stopped True"
    assert complaints == ""
    job = ToyJob(blocks=400)
    assert run(job, checkpoint=tmp_path / "run.npz", resume=True).tally.bits() == run(job).tally.bits()


@contextmanager
def program(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    """A Dask program in a process of its own."""
    command = [sys.executable, "-m", "distributed.cli." + arguments[0], *arguments[1:]]
    null = subprocess.DEVNULL
    with subprocess.Popen(command, stdout=null, stderr=null, text=True, env=ENVIRONMENT) as process:
        try:
            yield process
        finally:
            process.kill()


@contextmanager
def cluster(folder: Path, threads: int) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """The address and the process of a scheduler with one worker of so many threads."""
    told = folder / "scheduler.json"
    here = ("--scheduler-file", str(told))
    with (
        program("dask_scheduler", *here, "--host", "127.0.0.1", "--port", "0", "--no-dashboard") as scheduler,
        program("dask_worker", *here, "--nthreads", str(threads), "--no-dashboard", "--nworkers", "1"),
    ):
        while not told.exists() or not told.read_text():
            time.sleep(0.05)
        yield json.loads(told.read_text())["address"], scheduler


@pytest.mark.slow
def test_a_cluster_by_its_address(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with cluster(tmp_path, 2) as (address, _):
        for chunk in (None, 1000):
            assert run(ToyJob(), cluster=address, chunk=chunk).tally.bits() == EXPECTED
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_a_scheduler_that_goes_away_is_an_error_and_nothing_is_lost(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run.npz"
    with cluster(tmp_path, 1) as (address, scheduler):

        def kill(samples: int) -> None:
            if samples > 5000:
                scheduler.kill()

        with pytest.raises(MechanismError, match="connection with the scheduler"):
            run(ToyJob(pause=0.01), cluster=address, chunk=500, checkpoint=path, progress=kill)
    told: list[int] = []
    assert run(ToyJob(), checkpoint=path, resume=True, progress=told.append).tally.bits() == EXPECTED
    assert told[0] > 5000
    assert capfd.readouterr() == ("", "")


def test_no_scheduler_is_one_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    from trunnion.studies.tolerance import cluster as module

    monkeypatch.setattr(module, "CONNECT", 0.5)
    with pytest.raises(MechanismError, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:9") as caught:
        run(ToyJob(), cluster="tcp://127.0.0.1:9")
    assert len(caught.value.findings) == 1


def test_without_dask_the_remedy_is_told() -> None:
    script = (
        "import sys; sys.modules['distributed'] = None\n"
        "from toy_job import ToyJob\nfrom trunnion.studies.tolerance.runner import run\n"
        "run(ToyJob(), cluster='local')"
    )
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=ENVIRONMENT, check=False)
    assert ended.stderr.splitlines()[-1].endswith(
        "error: cluster: a cluster needs the package distributed — pip install 'trunnion[cluster]'"
    )


def test_dask_is_not_imported_unasked() -> None:
    script = "import sys, trunnion.studies.tolerance.runner; print('distributed' in sys.modules)"
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=ENVIRONMENT, check=True)
    assert ended.stdout == "False\n"
