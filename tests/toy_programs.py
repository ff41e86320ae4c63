"""The toy job in programs of their own, with signals as a terminal sends them."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parent
ENVIRONMENT = os.environ | {"PYTHONPATH": os.pathsep.join([str(TESTS), str(TESTS.parent / "src")])}
POSIX = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")

SCRIPT = """
import sys
from toy_job import ToyJob
from trunnion.studies.batch import run

if __name__ == "__main__":
    job = ToyJob(blocks=400, pause=0.02)
    tell = lambda share: print(share, flush=True)
    jobs, path = int(sys.argv[1]), sys.argv[2]
    try:
        run(job, jobs=jobs, checkpoint=path, progress=tell)
    except KeyboardInterrupt:
        print("stopped")
"""


def interrupted(folder: Path, jobs: int) -> tuple[list[str], str]:
    """Lines and complaints of a program that is sent a Ctrl-C, with all its processes, in mid-run."""
    script = folder / "script.py"
    script.write_text(SCRIPT)
    command = [sys.executable, "-W", "error", str(script), str(jobs), str(folder / "run.trn")]
    pipe = subprocess.PIPE
    with subprocess.Popen(
        command, stdout=pipe, stderr=pipe, text=True, env=ENVIRONMENT, start_new_session=True
    ) as program:
        lines = [program.stdout.readline().strip() for _ in range(8)]
        time.sleep(0.1)
        os.killpg(program.pid, signal.SIGINT)  # as a terminal does it: to the workers too
        lines += program.stdout.read().split("\n")
        complaints = program.stderr.read()
        assert program.wait() == 0
    return [line for line in lines if line], complaints
