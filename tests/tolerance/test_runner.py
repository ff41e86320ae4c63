"""The same bits from one process and from several, whatever dies, stops or is done in which order."""

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

from toy_job import ToyJob
from toy_programs import ENVIRONMENT, POSIX, interrupted
from trunnion import MechanismError
from trunnion.errors import Finding, Severity
from trunnion.studies.tolerance import processes
from trunnion.studies.tolerance.checkpoint import Checkpoint
from trunnion.studies.tolerance.ranges import Portions, count, gaps
from trunnion.studies.tolerance.runner import run


def test_one_process_gives_the_blocks_in_order() -> None:
    job = ToyJob()
    whole = job.prepare().evaluate(0, job.blocks)
    done = run(job)
    assert done.tally.bits() == whole.bits()
    assert done.tally.blocks == ((0, job.blocks),)
    assert not done.stopped
    assert done.notes == ()


@pytest.mark.spread(1)
@pytest.mark.parametrize("jobs", [1, 2, 3])
@pytest.mark.parametrize("chunk", [None, 1, 3500])
def test_same_bits_for_any_workers_and_portions(jobs: int, chunk: int | None) -> None:
    assert run(ToyJob(), jobs=jobs, chunk=chunk).tally.bits() == run(ToyJob()).tally.bits()


@POSIX
def test_a_killed_worker_costs_time_only(tmp_path: Path) -> None:
    done = run(ToyJob(fatal=17, folder=tmp_path), jobs=2, chunk=1500)
    assert (tmp_path / "perished").exists()
    assert done.tally.bits() == run(ToyJob()).tally.bits()


@POSIX
def test_a_worker_that_outlives_its_pool_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(processes, "GRACE", 0.2)
    done = run(ToyJob(fatal=17, folder=tmp_path, fault="deaf"), jobs=2, chunk=1500)
    assert done.tally.bits() == run(ToyJob()).tally.bits()


@pytest.mark.slow
@pytest.mark.parametrize("at", [1, 9000])
def test_workers_killed_from_outside(at: int) -> None:
    killed = []

    def kill(samples: int) -> None:
        if samples >= at and len(killed) < 2:
            victim = multiprocessing.active_children()[0]
            killed.append(victim.pid)
            victim.kill()

    job = ToyJob(pause=0.005)
    assert run(job, jobs=2, chunk=1000, progress=kill).tally.bits() == run(ToyJob()).tally.bits()
    assert len(killed) == 2


@pytest.mark.slow
@POSIX
def test_blocks_that_kill_every_worker_are_named() -> None:
    with pytest.raises(MechanismError, match=r"blocks 16 to 19 ended 3 workers in turn \(killed by SIGKILL\)"):
        run(ToyJob(fatal=17), jobs=2, chunk=2000)
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


def test_machines_of_several_kinds_are_told(tmp_path: Path) -> None:
    path = tmp_path / "run.npz"
    saved = Checkpoint(path, ToyJob())
    saved.arithmetic.add("another")
    saved.tally = ToyJob().prepare().evaluate(0, 10)
    saved.keep()
    (note,) = run(ToyJob(), checkpoint=path, resume=True).notes
    assert note.figures["kinds"] == 2
    assert note.severity == Severity.NOTE


def test_findings_survive_pickling() -> None:
    error = MechanismError([Finding("one", "a"), Finding("two", "b", "c")])
    again = pickle.loads(pickle.dumps(error))
    assert again.findings == error.findings
    assert str(again) == str(error)


def test_what_is_done_before_an_error_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "run.npz"
    with pytest.raises(ZeroDivisionError):
        run(ToyJob(fault="evaluate"), chunk=500, checkpoint=path)
    assert run(ToyJob(), checkpoint=path, resume=True).tally.bits() == run(ToyJob()).tally.bits()


@pytest.mark.parametrize("jobs", [1, 2])
def test_progress_rises_to_all_samples(jobs: int) -> None:
    told: list[int] = []
    job = ToyJob()
    run(job, jobs=jobs, chunk=1500, progress=told.append)
    assert told[0] == 0
    assert told[-1] == job.samples
    assert told == sorted(told)


@pytest.mark.parametrize("jobs", [1, 2])
def test_ctrl_c_keeps_what_is_done(jobs: int, tmp_path: Path) -> None:
    path = tmp_path / "run.npz"

    pressed: list[int] = []

    def press(samples: int) -> None:
        """Once: two portions may come in at the same time, and a second Ctrl-C ends everything."""
        if samples > 5000 and not pressed:
            pressed.append(samples)
            signal.raise_signal(signal.SIGINT)

    before = signal.getsignal(signal.SIGINT)
    done = run(ToyJob(), jobs=jobs, chunk=500, checkpoint=path, progress=press)
    assert done.stopped
    assert 10 < count(done.tally.blocks) < 37
    assert signal.getsignal(signal.SIGINT) is before
    assert not multiprocessing.active_children()
    told: list[int] = []
    rest = run(ToyJob(), jobs=3 - jobs, chunk=1500, checkpoint=path, resume=True, progress=told.append)
    assert told[0] > 5000
    assert rest.tally.bits() == run(ToyJob()).tally.bits()
    assert not rest.stopped


@pytest.mark.slow
@POSIX
@pytest.mark.parametrize("jobs", [1, 2])
def test_ctrl_c_from_the_terminal_is_quiet(jobs: int, tmp_path: Path) -> None:
    lines, complaints = interrupted(tmp_path, jobs, "")
    assert lines[-1] == "stopped True"
    assert complaints == ""
    job = ToyJob(blocks=400)
    assert run(job, checkpoint=tmp_path / "run.npz", resume=True).tally.bits() == run(job).tally.bits()


@POSIX
def test_workers_end_with_a_main_process_that_is_killed(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        "import multiprocessing, sys\nfrom toy_job import ToyJob\n"
        "from trunnion.studies.tolerance.runner import run\n"
        "def tell(samples):\n"
        "    if samples: print(*[one.pid for one in multiprocessing.active_children()], flush=True)\n"
        "if __name__ == '__main__':\n    run(ToyJob(blocks=4000, pause=0.02), jobs=2, chunk=500, progress=tell)\n"
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
    script.write_text(
        "from toy_job import ToyJob\nfrom trunnion.studies.tolerance.runner import run\nrun(ToyJob(), jobs=2)\n"
    )
    ended = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, env=ENVIRONMENT, check=False)
    assert ended.returncode == 1
    assert "MechanismError: error: worker processes end before they have begun (exit status 1)" in ended.stderr
    assert "if __name__ == '__main__':" in ended.stderr


def test_arguments_that_make_no_sense_are_findings() -> None:
    with pytest.raises(MechanismError) as caught:
        run(ToyJob(), jobs=0, chunk=0, resume=True)
    assert [finding.where for finding in caught.value.findings] == ["jobs", "chunk", "resume"]


def test_gaps_and_portions() -> None:
    assert gaps([], 5) == [(0, 5)]
    assert gaps([(0, 5)], 5) == []
    assert gaps([(1, 2), (4, 5)], 7) == [(0, 1), (2, 4), (5, 7)]
    portions = Portions([(1, 2), (4, 5)], 16, 4, 1.0)
    taken = []
    while portions.left:
        taken.append(portions.take(1))
    assert taken == [(0, 1), (2, 4), (5, 9), (9, 13), (13, 16)]


def test_aligned_portions_are_nodes_of_the_tree() -> None:
    portions = Portions([(3, 5)], 100, None, 17.0)
    portions.seen((0, 1), 1.0)
    taken = []
    while portions.left:
        taken.append(portions.take(1))
    assert sorted(block for first, last in taken for block in range(first, last)) == [0, 1, 2, *range(5, 100)]
    for first, last in taken:
        size = last - first
        assert size & (size - 1) == 0
        assert first % size == 0
        assert size <= 16
    assert max(last - first for first, last in taken) == 16


def test_portions_follow_the_pace() -> None:
    def size(blocks: int, workers: int) -> int:
        portions = Portions([], blocks, None, 1.0)
        assert portions.size(workers) == 1  # nothing is known yet
        portions.seen((0, 1), 0.01)
        return portions.size(workers)

    assert size(10**6, 2) == 100
    assert size(10**8, 1000) == 5000  # none comes more often than it can be merged
    assert size(40, 2) == 10  # the end is shared out
    assert size(10, 2) == 6  # but not endlessly
    assert Portions([], 1000, 7, 1.0).size(2) == 7
