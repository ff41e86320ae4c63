"""The same bits from one process and from several, whatever dies or stops."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from toy_job import ToyJob, bits
from toy_programs import ENVIRONMENT, POSIX, interrupted
from trunnion import MechanismError
from trunnion.errors import Finding
from trunnion.studies.batch import run

EXPECTED = bits([ToyJob()(block) for block in range(37)])


@pytest.mark.parametrize("jobs", [1, 2, pytest.param(3, marks=pytest.mark.slow)])
@pytest.mark.parametrize("threads", [False, True])
def test_same_bits_for_any_workers(jobs: int, threads: bool) -> None:
    parts, trouble = run(ToyJob(), jobs=jobs, threads=threads)
    assert bits(parts) == EXPECTED
    assert not trouble


@POSIX
@pytest.mark.parametrize("fault", ["", "deaf"])
def test_a_killed_worker_costs_time_only(tmp_path: Path, fault: str) -> None:
    """Also where others do not hear that they are to end."""
    assert bits(run(ToyJob(fatal=17, folder=tmp_path, fault=fault), jobs=2)[0]) == EXPECTED
    assert (tmp_path / "perished").exists()


@pytest.mark.slow
@pytest.mark.parametrize("at", [0.01, 0.5])
def test_workers_killed_from_outside(at: float) -> None:
    killed = []

    def kill(share: float) -> None:
        if share >= at and len(killed) < 2:
            victim = multiprocessing.active_children()[0]
            killed.append(victim.pid)
            victim.kill()

    assert bits(run(ToyJob(pause=0.005), jobs=2, progress=kill)[0]) == EXPECTED
    assert len(killed) == 2


@pytest.mark.slow
@POSIX
def test_a_block_that_kills_every_worker_is_named() -> None:
    with pytest.raises(MechanismError, match=r"3 workers died in turn, the next block being 17"):
        run(ToyJob(fatal=17), jobs=2)
    assert not multiprocessing.active_children()


@pytest.mark.spread(1)
@pytest.mark.parametrize("jobs", [1, 2])
def test_what_a_job_raises_arrives(jobs: int) -> None:
    with pytest.raises(MechanismError) as caught:
        run(ToyJob(fault="prepare"), jobs=jobs)
    assert caught.value.findings == (Finding("no such link", "links.x", "name one"),)
    with pytest.raises(ZeroDivisionError, match="block 5"):
        run(ToyJob(fault="evaluate"), jobs=jobs)
    assert not multiprocessing.active_children()


def test_findings_survive_pickling() -> None:
    error = MechanismError([Finding("one", "a"), Finding("two", "b", "c")])
    again = pickle.loads(pickle.dumps(error))
    assert again.findings == error.findings
    assert str(again) == str(error)


@pytest.mark.parametrize("jobs", [1, 2])
def test_progress_rises_to_the_end(jobs: int) -> None:
    shares: list[float] = []
    run(ToyJob(), jobs=jobs, progress=shares.append)
    assert shares[0] == 0
    assert shares[-1] == 1
    assert shares == sorted(shares)


@pytest.mark.parametrize("jobs", [1, 2])
def test_ctrl_c_keeps_what_is_done(jobs: int, tmp_path: Path) -> None:
    path = tmp_path / "run.trn"

    def press(share: float) -> None:
        if share > 0.3:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        run(ToyJob(), jobs=jobs, checkpoint=path, progress=press)
    assert not multiprocessing.active_children()
    shares: list[float] = []
    assert bits(run(ToyJob(), jobs=3 - jobs, checkpoint=path, progress=shares.append)[0]) == EXPECTED
    assert 0.3 < shares[0] < 1.0


@pytest.mark.slow
@POSIX
@pytest.mark.parametrize("jobs", [1, 2])
def test_ctrl_c_from_the_terminal_is_quiet(jobs: int, tmp_path: Path) -> None:
    lines, complaints = interrupted(tmp_path, jobs, "")
    assert lines[-1] == "stopped"
    assert complaints == ""
    job = ToyJob(blocks=400)
    assert bits(run(job, checkpoint=tmp_path / "run.trn")[0]) == bits(run(job)[0])


@POSIX
def test_workers_end_with_a_main_process_that_is_killed(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        "import multiprocessing, sys\nfrom toy_job import ToyJob\nfrom trunnion.studies.batch import run\n"
        "def tell(share):\n"
        "    if share: print(*[one.pid for one in multiprocessing.active_children()], flush=True)\n"
        "if __name__ == '__main__':\n    run(ToyJob(blocks=4000, pause=0.02), jobs=2, progress=tell)\n"
    )
    with subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True, env=ENVIRONMENT) as program:
        assert program.stdout is not None
        workers = [int(word) for word in program.stdout.readline().split()]
        program.kill()
    assert workers
    until = time.monotonic() + 20
    while any(_lives(worker) for worker in workers) and time.monotonic() < until:
        time.sleep(0.05)
    assert not any(_lives(worker) for worker in workers)


def _lives(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    state = Path(f"/proc/{process}/stat")
    return not (state.exists() and state.read_text().rpartition(")")[2].split()[0] == "Z")


@pytest.mark.slow
def test_a_script_without_a_guard_is_told_so(tmp_path: Path) -> None:
    script = tmp_path / "bare.py"
    script.write_text("from toy_job import ToyJob\nfrom trunnion.studies.batch import run\nrun(ToyJob(), jobs=2)\n")
    ended = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, env=ENVIRONMENT, check=False)
    assert ended.returncode == 1
    assert "a script calls this under `if __name__ == '__main__':`" in ended.stderr


def test_no_jobs_are_a_finding() -> None:
    with pytest.raises(MechanismError, match="0 jobs"):
        run(ToyJob(), jobs=0)
