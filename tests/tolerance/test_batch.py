"""The same bits from one process, from several and from a Dask cluster, whatever dies or stops."""

import json
import logging
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import pytest

from toy_job import ToyJob, bits
from toy_programs import ENVIRONMENT, POSIX, interrupted
from trunnion import MechanismError
from trunnion.errors import Finding
from trunnion.studies.batch import run

DASK = pytest.mark.skipif(not find_spec("distributed"), reason="the extra cluster is not installed")
EXPECTED = bits([ToyJob()(block) for block in range(37)])


WAYS = [{"jobs": 1}, {"jobs": 2}]


@pytest.mark.parametrize("way", [*WAYS, {"jobs": 1, "threads": True}, {"jobs": 2, "threads": True}])
def test_the_same_bits_in_every_way(way, capfd):
    shares = []
    parts, trouble = run(ToyJob(), progress=shares.append, **way)
    assert bits(parts) == EXPECTED
    assert not trouble
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0, 1)
    assert capfd.readouterr() == ("", "")


@POSIX
@pytest.mark.parametrize("fault", ["", "deaf"])
def test_a_killed_worker_costs_time_only(fault, tmp_path):
    """Also where others do not hear that they are to end."""
    assert bits(run(ToyJob(fatal=17, folder=tmp_path, fault=fault), jobs=2)[0]) == EXPECTED
    assert (tmp_path / "perished").exists()


@pytest.mark.slow
@POSIX
def test_a_block_that_kills_every_worker_is_an_error():
    with pytest.raises(MechanismError, match="3 workers died in turn, the next block being 0"):
        run(ToyJob(fatal=0), jobs=2)
    assert not multiprocessing.active_children()


@pytest.mark.parametrize("way", WAYS)
def test_what_a_job_raises_arrives(way, tmp_path):
    with pytest.raises(MechanismError) as caught:
        run(ToyJob(fault="prepare"), **way)
    assert caught.value.findings == (Finding("no such link", "links.x", "name one"),)
    with pytest.raises(ZeroDivisionError, match="block 5"):
        run(ToyJob(fault="evaluate"), checkpoint=tmp_path / "run.trn", **way)
    assert bits(run(ToyJob(), checkpoint=tmp_path / "run.trn")[0]) == EXPECTED
    assert not multiprocessing.active_children()


@pytest.mark.slow
@POSIX
@pytest.mark.parametrize("jobs", [1, 2])
def test_ctrl_c_from_the_terminal_is_quiet(jobs, tmp_path):
    lines, complaints = interrupted(tmp_path, jobs)
    assert lines[-1] == "stopped"
    assert complaints == ""
    job = ToyJob(blocks=400)
    assert bits(run(job, checkpoint=tmp_path / "run.trn")[0]) == bits(run(job)[0])


@pytest.mark.parametrize("jobs", [1, 2])
def test_ctrl_c_keeps_what_is_done(jobs, tmp_path):
    path = tmp_path / "run.trn"

    def press(share):
        if share > 0.3:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        run(ToyJob(), jobs=jobs, checkpoint=path, progress=press)
    assert not multiprocessing.active_children()
    shares = []
    assert bits(run(ToyJob(), jobs=3 - jobs, checkpoint=path, progress=shares.append)[0]) == EXPECTED
    assert 0.3 < shares[0] < 1.0


@POSIX
def test_workers_end_with_a_main_process_that_is_killed(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        "import multiprocessing, sys\nfrom toy_job import ToyJob\nfrom trunnion.studies.batch import run\n"
        "def tell(share):\n"
        "    if share: print(*[one.pid for one in multiprocessing.active_children()], flush=True)\n"
        "if __name__ == '__main__':\n    run(ToyJob(blocks=4000, pause=0.02), jobs=2, progress=tell)\n"
    )
    with subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True, env=ENVIRONMENT) as program:
        workers = [int(word) for word in program.stdout.readline().split()]
        program.kill()
    assert workers
    until = time.monotonic() + 20
    while any(_lives(worker) for worker in workers) and time.monotonic() < until:
        time.sleep(0.05)
    assert not any(_lives(worker) for worker in workers)


def _lives(process):
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    state = Path(f"/proc/{process}/stat")
    return not (state.exists() and state.read_text().rpartition(")")[2].split()[0] == "Z")


@contextmanager
def program(*arguments):
    """A Dask program in a process of its own."""
    command = [sys.executable, "-m", "distributed.cli." + arguments[0], *arguments[1:]]
    null = subprocess.DEVNULL
    with subprocess.Popen(command, stdout=null, stderr=null, text=True, env=ENVIRONMENT) as process:
        try:
            yield process
        finally:
            process.kill()


@contextmanager
def cluster(folder, threads):
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


@DASK
@pytest.mark.slow
def test_a_cluster_by_its_address(tmp_path, capfd):
    """Also where a block kills a worker once, or always."""
    pytest.importorskip("distributed")  # which sets its level as it is imported
    level = logging.getLogger("distributed").level
    with cluster(tmp_path, 2) as (address, _):
        assert bits(run(ToyJob(), cluster=address)[0]) == EXPECTED
        assert bits(run(ToyJob(fatal=17, folder=tmp_path), cluster=address)[0]) == EXPECTED
        with pytest.raises(MechanismError, match="a block ended one worker of the cluster after another"):
            run(ToyJob(fatal=17), cluster=address)
        with pytest.raises(ZeroDivisionError, match="block 5"):
            run(ToyJob(fault="evaluate"), cluster=address)
    assert logging.getLogger("distributed").level == level
    assert capfd.readouterr() == ("", "")


@DASK
@pytest.mark.slow
def test_a_scheduler_that_goes_away_is_an_error_and_nothing_is_lost(tmp_path, capfd, monkeypatch):
    path = tmp_path / "run.trn"
    with cluster(tmp_path, 1) as (address, scheduler):

        def kill(share):
            if share > 0.3:
                scheduler.kill()

        with pytest.raises(MechanismError, match="connection with the scheduler"):
            run(ToyJob(pause=0.01), cluster=address, checkpoint=path, progress=kill)
    shares = []
    assert bits(run(ToyJob(), checkpoint=path, progress=shares.append)[0]) == EXPECTED
    assert shares[0] > 0.3
    assert capfd.readouterr() == ("", "")


@DASK
def test_no_scheduler_is_one_finding(monkeypatch):
    from trunnion.studies import cluster as module

    monkeypatch.setattr(module, "CONNECT", 0.5)
    with pytest.raises(
        MechanismError, match=r"no Dask scheduler with workers answers at tcp://127\.0\.0\.1:9"
    ) as caught:
        run(ToyJob(), cluster="tcp://127.0.0.1:9")
    assert len(caught.value.findings) == 1


def test_without_dask_the_remedy_is_told():
    script = (
        "import sys; sys.modules['distributed'] = None\n"
        "from toy_job import ToyJob\nfrom trunnion.studies.batch import run\n"
        "run(ToyJob(), cluster='tcp://127.0.0.1:9')"
    )
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=ENVIRONMENT, check=False)
    assert ended.stderr.splitlines()[-1].endswith(
        "error: cluster: a cluster needs the package distributed — pip install 'trunnion[cluster]'"
    )
