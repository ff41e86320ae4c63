"""Ctrl-C, a full disk and faults end in one line; no output is an input, links stay links, pipes are written to."""

import json
import os
import resource
import signal
import stat
import subprocess
import sys
import threading
import time
from pathlib import Path
from unittest.mock import Mock

import pytest
import typer

from manual.test_cli import EXAMPLES, FOUR_BAR
from trunnion import read
from trunnion.cli import app as cli
from trunnion.cli.options import outputs
from trunnion.cycle import analyse as analysing


@pytest.mark.parametrize("fault", [KeyError("x\ny"), RecursionError("too deep"), AssertionError(), MemoryError()])
def test_an_unforeseen_exception_is_one_line(program, monkeypatch, fault):
    monkeypatch.setattr(analysing, "analysed", Mock(side_effect=fault))
    done = program("analyse", FOUR_BAR)
    assert done.code == 3
    assert done.out == ""
    assert len(done.err.splitlines()) == 1
    if not isinstance(fault, MemoryError):
        assert type(fault).__name__ in done.err
        assert "please report" in done.err


@pytest.mark.parametrize("words", [["--debug", "analyse"], ["analyse", "--debug"]])
def test_debug_shows_where(monkeypatch, capsys, words):
    def broken(*_, **__):
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


PARTS = ["--steps", "100000"]  # so many positions are written some at a time


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
def test_a_full_disk_is_a_finding(out, words, tmp_path):
    """A limit of 5 kB a file stands for it: the process is not taken along, and nothing is left behind."""
    verb, *options = words
    done = subprocess.run(
        [sys.executable, "-m", "trunnion", verb, str(FOUR_BAR), *options, "--out", str(tmp_path / out)],
        capture_output=True, text=True, check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (5_000, 5_000)),
    )  # fmt: skip
    assert done.returncode == 2, done.stderr
    assert "cannot be written" in done.stderr
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.spread(1, "zarr")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize("end", ["csv", "nc", "parquet", "zarr", "xlsx"])
def test_a_program_that_is_ended_leaves_no_draft(number, end, tmp_path):
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


@pytest.mark.slow
def test_workers_end_with_the_program(tmp_path):
    words = ["tolerance", str(EXAMPLES / "toleranced-fourbar.yaml"), "--samples", "2000000", "--engine", "numpy"]
    with subprocess.Popen(
        [sys.executable, "-m", "trunnion", *words, "--jobs", "2", "--out", str(tmp_path / "t.csv")],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
        workers = []
        while len(workers) < 2 and process.poll() is None:
            time.sleep(0.05)
            workers = children.read_text().split() if children.exists() else ["", ""]
        time.sleep(1.0)
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=60)  # ends when no worker holds the pipes any more
    assert process.returncode == 143
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "seconds"),
    [
        (["simulate", "flywheel-press.yaml", "--time", "100000s"], 4.0),
        pytest.param(["tolerance", "toleranced-rssr.yaml", "--samples", "10000000", "--jobs", "1"], 5.0,
                     marks=pytest.mark.slow),
        pytest.param(["sweep", "rssr.yaml", "--over", "a=20mm:30mm:1000", "--margin"], 3.0, marks=pytest.mark.slow),
    ],
)  # fmt: skip
def test_ctrl_c_leaves_the_files_of_before(words, seconds, tmp_path):
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


TOLERANCED = EXAMPLES / "toleranced-fourbar.yaml"

# verb, then what it needs beside the model
VERBS = {
    "analyse": ["--steps", 4],
    "assemble": ["--steps", 4],
    "play": ["--measure", "rocker-angle", "--steps", 4],
    "sweep": ["--over", "l2=30mm,31mm", "--steps", 4],
    "tolerance": ["--method", "linear", "--steps", 4],
    "allocate": ["--samples", 0, "--steps", 4],
}


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("analyse", "--out", "a.csv", "--out", "a.xyz"), "cannot write a result as '.xyz'"),
        (("analyse", "--out", "a.svg"), "cannot write a result as '.svg'"),
        (("tolerance", "--out", "a.svg", "--report", "a.txt"), "a report is not written as"),
        (("tolerance", "--out", "a.contributions.csv"), "there is no table 'contributions'"),
        (("tolerance", "--kind", "pie"), "there is no figure 'pie'"),
    ],
)
def test_files_are_refused_before_anything_is_computed(program, monkeypatch, words, text, tmp_path):
    monkeypatch.delattr(analysing, "analysed")
    verb, *options = words
    done = program(verb, TOLERANCED, *options)
    assert (done.code, done.out, list(tmp_path.iterdir())) == (2, "", [])
    assert text in done.err


@pytest.fixture
def model(tmp_path):
    """A model whose name ends as a result's may."""
    path = tmp_path / "a.json"
    read(TOLERANCED).write(path)
    return path


@pytest.mark.spread(21)
@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("way", ["same", "dots", "symlink", "hard link"])
def test_model_is_not_written_over(program, model, verb, way):
    before = model.read_bytes()
    out = {"same": Path("a.json"), "dots": Path(".") / ".." / model.parent.name / "a.json"}.get(way, Path("b.json"))
    if way == "symlink":
        out.symlink_to("a.json")
    elif way == "hard link":
        os.link(model, out)
    done = program(verb, "a.json", *VERBS[verb], "--out", out)
    assert done.code == 2
    assert "is read here, and would be written over" in done.err
    assert "--out" in done.err
    assert model.read_bytes() == before


def test_report_and_figures_are_not_written_over_the_model(program, model):
    before = model.read_bytes()
    Path("r.html").symlink_to(model)
    Path("figures").mkdir()
    Path("figures/torque.png").symlink_to(model)
    for words in (["analyse", model, "--report", "r.html"], ["report", model, "--out", "r.html"],
                  ["plot", model, "--out", "figures"]):  # fmt: skip
        done = program(*words, "--steps", 12)
        assert (done.code, "would be written over" in done.err) == (2, True), words
        assert model.read_bytes() == before


def test_table_and_sample_are_not_written_over(program, model):
    points = Path("tab.csv")
    points.write_text("t [s],angle [deg]\n0,0\n0.5,90\n1,180\n")
    deviations = Path("dev.csv")
    deviations.write_text("deviation [mm]\n0.01\n-0.01\n0.02\n")
    for words, path in ((["analyse", model, "--table", "A=tab.csv", "--out", "tab.csv"], points),
                        (["tolerance", model, "--sample", "l3=dev.csv", "--out", "dev.csv"], deviations)):  # fmt: skip
        before = path.read_bytes()
        done = program(*words, "--steps", 4)
        assert (done.code, "would be written over" in done.err) == (2, True)
        assert path.read_bytes() == before


def test_two_outputs_are_two_files(program, model):
    Path("link.csv").symlink_to("x.csv")
    for one, two in (("x.csv", "x.csv"), ("x.csv", "./x.csv"), ("x.csv", "link.csv")):
        done = program("analyse", model, "--steps", 4, "--out", one, "--out", two)
        assert (done.code, "written by --out already" in done.err) == (2, True)
        assert not Path("x.csv").exists()
    done = program("allocate", model, "--samples", 0, "--write", "b.json", "--out", "b.json")
    assert (done.code, "--out" in done.err) == (2, True)


def test_model_is_written_in_place_where_that_is_asked_for(program, model):
    done = program("allocate", model, "--samples", 100, "--steps", 72, "--write", model)
    assert (done.code, "--force" in done.err) == (2, True)
    before = model.read_bytes()
    done = program("allocate", model, "--samples", 100, "--steps", 72, "--write", model, "--force")
    assert done.code == 0
    assert model.read_bytes() != before
    read(model)


def test_a_link_stays_a_link(program, model):
    Path("real").mkdir()
    Path("out.csv").symlink_to("real/out.csv")
    for _ in range(2):  # there is nothing behind it at first
        assert program("analyse", model, "--steps", 4, "--out", "out.csv").code == 0
        assert Path("out.csv").is_symlink()
        assert Path("real/out.csv").read_text().startswith("time,")
    assert [one.name for one in Path("real").iterdir()] == ["out.csv"]


def test_a_pipe_is_written_to(program, model):
    os.mkfifo("pipe.json")
    got = []
    reader = threading.Thread(target=lambda: got.append(Path("pipe.json").read_bytes()))
    reader.start()
    assert program("analyse", model, "--steps", 4, "--out", "pipe.json").code == 0
    reader.join(10)
    assert stat.S_ISFIFO(os.stat("pipe.json").st_mode)
    assert json.loads(got[0])["dims"]["position"] == 4


def test_every_option_that_takes_a_path_is_an_output():
    """What a verb writes is known from its options alone; a verb that is registered otherwise is not guarded."""
    found = set()
    for command in cli.app.registered_commands:
        assert command.callback.__wrapped__
        found |= set(outputs(command.callback))
    assert found == {"assemblies", "checkpoint", "out", "report", "to", "write"}
    assert isinstance(cli.app, typer.Typer)
