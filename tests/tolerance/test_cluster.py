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

from toy_job import ToyJob, bits
from toy_programs import ENVIRONMENT, POSIX, interrupted
from trunnion import MechanismError
from trunnion.studies.batch import run

pytest.importorskip("distributed")

EXPECTED = bits(run(ToyJob())[0])


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
def test_same_bits_on_a_local_cluster(jobs: int, capfd: pytest.CaptureFixture[str]) -> None:
    shares: list[float] = []
    level = logging.getLogger("distributed").level
    assert bits(run(ToyJob(), jobs=jobs, cluster="local", progress=shares.append)[0]) == EXPECTED
    assert shares[-1] == 1
    assert capfd.readouterr() == ("", "")
    assert logging.getLogger("distributed").level == level


@pytest.mark.slow
@POSIX
def test_a_killed_worker_costs_time_only(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert bits(run(ToyJob(fatal=17, folder=tmp_path), jobs=2, cluster="local")[0]) == EXPECTED
    assert (tmp_path / "perished").exists()
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
@POSIX
def test_a_block_that_kills_every_worker_is_an_error(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(MechanismError, match="a block ended 3 workers of the cluster in turn"):
        run(ToyJob(fatal=17), jobs=1, cluster="local")
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_what_a_job_raises_arrives(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(MechanismError, match=r"links\.x: no such link"):
        run(ToyJob(fault="prepare"), cluster="local")
    path = tmp_path / "run.trn"
    with pytest.raises(ZeroDivisionError, match="block 5"):
        run(ToyJob(fault="evaluate"), cluster="local", checkpoint=path)
    assert bits(run(ToyJob(), checkpoint=path)[0]) == EXPECTED
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
@POSIX
def test_ctrl_c_from_the_terminal_is_quiet(tmp_path: Path) -> None:
    lines, complaints = interrupted(tmp_path, 2, "local")
    assert lines[-1] == "stopped"
    assert complaints == ""
    job = ToyJob(blocks=400)
    assert bits(run(job, checkpoint=tmp_path / "run.trn")[0]) == bits(run(job)[0])


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
        assert bits(run(ToyJob(), cluster=address)[0]) == EXPECTED
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_a_scheduler_that_goes_away_is_an_error_and_nothing_is_lost(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run.trn"
    with cluster(tmp_path, 1) as (address, scheduler):

        def kill(share: float) -> None:
            if share > 0.3:
                scheduler.kill()

        with pytest.raises(MechanismError, match="connection with the scheduler"):
            run(ToyJob(pause=0.01), cluster=address, checkpoint=path, progress=kill)
    shares: list[float] = []
    assert bits(run(ToyJob(), checkpoint=path, progress=shares.append)[0]) == EXPECTED
    assert shares[0] > 0.3
    assert capfd.readouterr() == ("", "")


def test_no_scheduler_is_one_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    from trunnion.studies import cluster as module

    monkeypatch.setattr(module, "CONNECT", 0.5)
    with pytest.raises(MechanismError, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:9") as caught:
        run(ToyJob(), cluster="tcp://127.0.0.1:9")
    assert len(caught.value.findings) == 1


def test_without_dask_the_remedy_is_told() -> None:
    script = (
        "import sys; sys.modules['distributed'] = None\n"
        "from toy_job import ToyJob\nfrom trunnion.studies.batch import run\n"
        "run(ToyJob(), cluster='local')"
    )
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=ENVIRONMENT, check=False)
    assert ended.stderr.splitlines()[-1].endswith(
        "error: cluster: a cluster needs the package distributed — pip install 'trunnion[cluster]'"
    )


def test_dask_is_not_imported_unasked() -> None:
    script = "import sys, trunnion.studies.batch; print('distributed' in sys.modules)"
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=ENVIRONMENT, check=True)
    assert ended.stdout == "False\n"
