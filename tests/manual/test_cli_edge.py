"""What ends a run is one line: Ctrl-C at any time, a full disk, a fault of the program itself."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time
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


@pytest.mark.slow
@pytest.mark.parametrize("end", ["csv", "json", "nc", "parquet", "zarr"])
def test_a_full_disk_is_a_finding(end: str, tmp_path: Path) -> None:
    """A limit of the size of files stands for it: the process is not taken along, and nothing is left behind."""

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))

    words = ["analyse", str(FOUR_BAR), "--steps", "1000", "--out", str(tmp_path / f"r.{end}")]
    done = subprocess.run(
        [sys.executable, "-m", "trunnion", *words], capture_output=True, text=True, check=False, preexec_fn=limited
    )
    assert done.returncode == 2
    assert "cannot be written" in done.stderr
    assert "Traceback" not in done.stderr
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
        pytest.param(["locking", "rssr.yaml", "--steps", "100000"], 3.0, marks=pytest.mark.slow),
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
