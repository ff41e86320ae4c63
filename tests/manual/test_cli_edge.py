"""What ends a run is one line: Ctrl-C at any time, a full disk, a fault of the program itself."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest

from manual.conftest import Run
from manual.test_cli import EXAMPLES
from trunnion.cycle import analyse as analysing

FOUR_BAR = EXAMPLES / "durango-fourbar.yaml"


@pytest.mark.parametrize("fault", [KeyError("x\ny"), RecursionError("too deep"), AssertionError(), MemoryError()])
def test_an_unforeseen_exception_is_one_line(
    program: Run, monkeypatch: pytest.MonkeyPatch, fault: BaseException
) -> None:
    def broken(*_: object) -> None:
        raise fault

    monkeypatch.setattr(analysing, "analysed", broken)
    done = program("analyse", FOUR_BAR)
    assert done.code == 3
    assert done.out == ""
    assert len(done.err.splitlines()) == 1
    if not isinstance(fault, MemoryError):
        assert type(fault).__name__ in done.err
        assert "please report" in done.err


@pytest.mark.parametrize("words", [["--debug", "analyse"], ["analyse", "--debug"]])
def test_debug_shows_where(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: list[str]
) -> None:
    from trunnion.cli import app as cli

    def broken(*_: object) -> None:
        raise KeyError("x")

    monkeypatch.setattr(analysing, "analysed", broken)
    monkeypatch.setattr(sys, "argv", ["trunnion", *words, str(FOUR_BAR)])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    assert stop.value.code == 3
    err = capsys.readouterr().err
    assert "Traceback" in err
    assert "in broken" in err
    assert "please report" in err.splitlines()[-1]


@pytest.mark.slow
def test_an_interrupt_that_became_another_exception(program: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """A library whose import is broken off may raise an ImportError."""

    def broken(*_: object) -> None:
        try:
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(5)
        except KeyboardInterrupt:
            raise ImportError("numpy cannot be loaded") from None

    monkeypatch.setattr(analysing, "analysed", broken)
    done = program("analyse", FOUR_BAR)
    assert done.code == 130
    assert done.err == "stopped\n"
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.slow
@pytest.mark.parametrize("after", [0.1, 0.2, 0.4, 0.7, 1.0])
def test_ctrl_c_while_the_program_is_loaded(after: float, tmp_path: Path) -> None:
    """Counted from where Python runs the program at all; before that it is Python's own affair."""
    begin = "import os; os.write(1, b'.'); from trunnion.__main__ import main; import sys; sys.argv[0] = 'trunnion'; "
    words = ["analyse", str(FOUR_BAR), "--steps", "300000", "--report", str(tmp_path / "r.html")]
    with subprocess.Popen(
        [sys.executable, "-c", f"{begin}main()", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        process.stdout.read(1)
        time.sleep(after)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert len(err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


PARTS = ["--steps", "300000", "--variables", "drive_effort"]  # so many positions are written some at a time


def limited() -> None:
    """No file grows beyond 5 kB."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (5_000, 5_000))


@pytest.mark.spread(1, "r.xlsx")
@pytest.mark.parametrize(
    ("out", "words"),
    [
        *((f"r.{end}", ["analyse", "--steps", "1000"]) for end in ("csv", "json", "nc", "parquet", "xlsx", "zarr")),
        *((f"parts.{end}", ["analyse", *PARTS]) for end in ("csv", "nc", "parquet", "zarr")),
        *((f"r.{end}", ["plot", "--kind", "mechanism"]) for end in ("jpg", "pdf", "png", "svg")),
        ("r.html", ["report"]),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_full_disk_is_a_finding(out: str, words: list[str], tmp_path: Path) -> None:
    """A limit of the size of files stands for it: the process is not taken along, and nothing is left behind."""
    verb, *options = words
    done = subprocess.run(
        [sys.executable, "-m", "trunnion", verb, str(FOUR_BAR), *options, "--out", str(tmp_path / out)],
        capture_output=True, text=True, check=False, preexec_fn=limited,
    )  # fmt: skip
    assert done.returncode == 2, done.stderr
    assert "cannot be written" in done.stderr
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.spread(1, "zarr")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize("end", ["csv", "nc", "parquet", "zarr", "xlsx"])
def test_a_program_that_is_ended_leaves_no_draft(number: signal.Signals, end: str, tmp_path: Path) -> None:
    """The old file stays, and no other; the exit status is that of the signal."""
    out = tmp_path / f"r.{end}"
    if end != "zarr":
        out.write_text("old")
    steps = PARTS if end != "xlsx" else ["--steps", "20000"]
    before, words = list(tmp_path.iterdir()), ["analyse", str(FOUR_BAR), *steps, "--out", str(out)]
    with subprocess.Popen(
        [sys.executable, "-m", "trunnion", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(number, signal.SIG_DFL),  # under nohup, say, it is ignored
    ) as process:  # fmt: skip
        while len(list(tmp_path.iterdir())) == len(before) and process.poll() is None:
            time.sleep(0.001)
        process.send_signal(number)
        _, err = process.communicate(timeout=60)
    assert process.returncode == 128 + number
    assert err.splitlines()[-1] == "stopped"
    assert list(tmp_path.iterdir()) == before
    assert end == "zarr" or out.read_text() == "old"


class Ended:
    """Python drops what is raised while it clears up an object."""

    def __init__(self, number: int) -> None:
        self.number = number

    def __del__(self) -> None:
        os.kill(os.getpid(), self.number)
        time.sleep(0.01)


def caught(number: int) -> None:
    """A library may catch all that is raised."""
    with suppress(BaseException):
        os.kill(os.getpid(), number)
        time.sleep(10)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
@pytest.mark.parametrize("lose", [Ended, caught])
def test_a_signal_that_gets_lost_comes_again(
    program: Run, monkeypatch: pytest.MonkeyPatch, number: signal.Signals, lose: Callable[[int], object]
) -> None:
    cleared = []

    def broken(*_: object) -> None:
        try:
            lose(number)
            time.sleep(10)
        finally:
            time.sleep(0.2)  # what clears up is not broken off
            cleared.append(1)

    monkeypatch.setattr(sys, "unraisablehook", lambda _: None)  # that of the tests tells of it
    monkeypatch.setattr(analysing, "analysed", broken)
    assert program("analyse", FOUR_BAR).code == 128 + number
    assert cleared


@pytest.mark.slow
def test_workers_end_with_the_program(tmp_path: Path) -> None:
    words = ["tolerance", str(EXAMPLES / "toleranced-fourbar.yaml"), "--samples", "2000000", "--engine", "numpy"]
    with subprocess.Popen(
        [sys.executable, "-m", "trunnion", *words, "--jobs", "2", "--out", str(tmp_path / "t.csv")],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
        workers: list[str] = []
        while len(workers) < 2 and process.poll() is None:
            time.sleep(0.05)
            workers = children.read_text().split() if children.exists() else ["", ""]
        time.sleep(1.0)
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=60)  # ends when no worker holds the pipes any more
    assert process.returncode == 143
    assert list(tmp_path.iterdir()) == []


def test_a_figure_of_an_analysis_is_pointed_to_the_verb_that_draws_it(program: Run, tmp_path: Path) -> None:
    model = EXAMPLES / "slider-crank.yaml"
    code, _, err = program("analyse", model, "--out", "x.png")
    assert code == 2
    assert f"trunnion plot {model} --out x.png" in " ".join(err.split())
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("words", "seconds"),
    [
        (["simulate", "flywheel-press.yaml", "--time", "100000s"], 4.0),
        pytest.param(["tolerance", "toleranced-rssr.yaml", "--samples", "10000000", "--jobs", "1"], 5.0,
                     marks=pytest.mark.slow),
        pytest.param(["sweep", "rssr.yaml", "--over", "a=20mm:30mm:1000", "--margin"], 3.0, marks=pytest.mark.slow),
    ],
)  # fmt: skip
def test_ctrl_c_leaves_the_files_of_before(words: list[str], seconds: float, tmp_path: Path) -> None:
    """One rule for every verb: a part of a result replaces nothing, and the exit status is 130."""
    old = tmp_path / "r.csv"
    old.write_text("of before\n")
    verb, model, *more = words
    command = [sys.executable, "-m", "trunnion", verb, str(EXAMPLES / model), *more, "--out", str(old)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        time.sleep(seconds)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    assert (process.returncode, out) == (130, "")
    assert err.startswith("stopped")
    assert list(tmp_path.iterdir()) == [old]
    assert old.read_text() == "of before\n"
