"""No output of a run is one of its inputs; links stay links; pipes and devices are written to."""

from __future__ import annotations

import json
import os
import stat
import threading
from pathlib import Path

import pytest
import typer

from manual.conftest import Run
from manual.test_cli import EXAMPLES
from trunnion import read
from trunnion.cli import app as cli
from trunnion.cli.files import outputs

FOUR_BAR = EXAMPLES / "toleranced-fourbar.yaml"

# verb, then what it needs beside the model
VERBS = {
    "analyse": ["--steps", 4],
    "assemble": ["--steps", 4],
    "play": ["--measure", "rocker-angle", "--steps", 4],
    "sweep": ["--over", "l2=30mm,31mm", "--steps", 4],
    "tolerance": ["--method", "linear", "--steps", 4],
    "allocate": ["--samples", 0, "--steps", 4],
}


@pytest.fixture
def model(tmp_path: Path) -> Path:
    """A model whose name ends as a result's may."""
    path = tmp_path / "a.json"
    read(FOUR_BAR).write(path)
    return path


@pytest.mark.spread(21)
@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("way", ["same", "dots", "symlink", "hard link"])
def test_model_is_not_written_over(program: Run, model: Path, verb: str, way: str) -> None:
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


def test_report_and_figures_are_not_written_over_the_model(program: Run, model: Path) -> None:
    before = model.read_bytes()
    Path("r.html").symlink_to(model)
    Path("figures").mkdir()
    Path("figures/torque.png").symlink_to(model)
    for words in (["analyse", model, "--report", "r.html"], ["report", model, "--out", "r.html"],
                  ["plot", model, "--out", "figures"]):  # fmt: skip
        done = program(*words, "--steps", 12)
        assert (done.code, "would be written over" in done.err) == (2, True), words
        assert model.read_bytes() == before


def test_table_and_sample_are_not_written_over(program: Run, model: Path) -> None:
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


def test_two_outputs_are_two_files(program: Run, model: Path) -> None:
    Path("link.csv").symlink_to("x.csv")
    for one, two in (("x.csv", "x.csv"), ("x.csv", "./x.csv"), ("x.csv", "link.csv")):
        done = program("analyse", model, "--steps", 4, "--out", one, "--out", two)
        assert (done.code, "written by --out already" in done.err) == (2, True)
        assert not Path("x.csv").exists()
    done = program("allocate", model, "--samples", 0, "--write", "b.json", "--out", "b.json")
    assert (done.code, "--out" in done.err) == (2, True)


def test_model_is_written_in_place_where_that_is_asked_for(program: Run, model: Path) -> None:
    done = program("allocate", model, "--samples", 100, "--steps", 72, "--write", model)
    assert (done.code, "--force" in done.err) == (2, True)
    before = model.read_bytes()
    done = program("allocate", model, "--samples", 100, "--steps", 72, "--write", model, "--force")
    assert done.code == 0
    assert model.read_bytes() != before
    read(model)


def test_a_link_stays_a_link(program: Run, model: Path) -> None:
    Path("real").mkdir()
    Path("out.csv").symlink_to("real/out.csv")
    for _ in range(2):  # there is nothing behind it at first
        assert program("analyse", model, "--steps", 4, "--out", "out.csv").code == 0
        assert Path("out.csv").is_symlink()
        assert Path("real/out.csv").read_text().startswith("time,")
    assert [one.name for one in Path("real").iterdir()] == ["out.csv"]


def test_a_pipe_is_written_to(program: Run, model: Path) -> None:
    os.mkfifo("pipe.json")
    got: list[bytes] = []
    reader = threading.Thread(target=lambda: got.append(Path("pipe.json").read_bytes()))
    reader.start()
    assert program("analyse", model, "--steps", 4, "--out", "pipe.json").code == 0
    reader.join(10)
    assert stat.S_ISFIFO(os.stat("pipe.json").st_mode)
    assert json.loads(got[0])["dims"]["position"] == 4


def test_a_device_is_written_to(program: Run, model: Path) -> None:
    Path("null.csv").symlink_to("/dev/null")
    assert program("analyse", model, "--steps", 4, "--out", "null.csv").code == 0
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)
    assert Path("null.csv").is_symlink()
    Path("full.csv").symlink_to("/dev/full")
    done = program("analyse", model, "--steps", 4, "--out", "full.csv")
    assert (done.code, "No space left" in done.err) == (2, True)
    done = program("schema", "--out", "/dev/null")
    assert done.code == 0


def test_every_option_that_takes_a_path_is_an_output() -> None:
    """What a verb writes is known from its options alone; a verb that is registered otherwise is not guarded."""
    found = set()
    for command in cli.app.registered_commands:
        assert command.callback is not None
        assert command.callback.__wrapped__  # type: ignore[attr-defined]
        found |= set(outputs(command.callback))
    assert found == {"assemblies", "checkpoint", "out", "report", "to", "write", "write_mapping"}
    assert isinstance(cli.app, typer.Typer)
