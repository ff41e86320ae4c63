"""`trunnion assemble` as a user meets it: table, files, figure, findings, exit status."""

from __future__ import annotations

import csv
import functools
import json
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import xarray as xr

import trunnion
from manual.conftest import Run

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"


@pytest.fixture
def model(tmp_path: Path) -> Path:
    """The model of the page about the verb."""
    page = (ROOT / "docs" / "how-to" / "assemble.md").read_text("utf-8")
    found = re.search(r'```yaml title="leaning-four-bar.yaml"\n(.*?)```', page, re.DOTALL)
    assert found
    path = tmp_path / "lean.yaml"
    path.write_text(found[1], encoding="utf-8")
    return path


@pytest.fixture
def run(program: Run, monkeypatch: pytest.MonkeyPatch) -> Run:
    """The verb."""
    monkeypatch.setenv("COLUMNS", "160")
    return functools.partial(program, "assemble")


def read(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.slow
def test_too_little_clearance(run: Run, model: Path, tmp_path: Path) -> None:
    done = run(
        model, "--steps", 36, *(f"--out=f{end}" for end in (".csv", ".json", ".nc", ".svg", ".png")), "--units-row"
    )
    assert done.code == 1
    assert "0.0143451" in done.out
    assert "B 41 %" in done.out
    assert "error: joints: the stated clearances are too small to close the loops between" in done.err
    units, *rows = read(tmp_path / "f.csv")
    assert (units["A.coordinate"], units["needed_clearance"], units["B.uniform_1_x"]) == ("rad", "m", "m")
    assert len(rows) == 36
    assert {row["status"] for row in rows} == {"fits", "short"}
    again = xr.load_dataset(tmp_path / "f.nc")
    mechanism = trunnion.read(model)
    wanted = trunnion.assemble(mechanism, 36)
    np.testing.assert_array_equal(again.needed_share, wanted.needed_share)
    assert [float(row["needed_share"]) for row in rows] == wanted.needed_share.values.tolist()
    assert float(rows[3]["D.stated_2_y"]) == float(wanted.stated_offset.sel(joint="D", end="2", axis="y")[3])
    assert json.loads((tmp_path / "f.json").read_text("utf-8"))["data_vars"]["smallest_clearance"]["data"] > 1.4e-5
    assert ElementTree.parse(tmp_path / "f.svg").getroot().tag.endswith("svg")
    assert (tmp_path / "f.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_enough(run: Run, model: Path) -> None:
    every = [option for joint in "ABCD" for option in ("--set", f"joints.{joint}.pin.clearance=0.02mm")]
    done = run(model, "--steps", 12, *every)
    assert done.code == 0
    assert "note: joints: the stated clearances are sufficient" in done.err
    done = run(model, "--steps", 12, *every, "--uniform", "all", "--set", "joints.B.misalignment.tilt=0.4deg")
    assert done.code == 1


def test_nothing_to_ask(run: Run, tmp_path: Path) -> None:
    done = run(EXAMPLES / "fourbar-in-space.yaml", "--steps", 12, "--out", "f.svg")
    assert done.code == 0
    assert "the loops close without any clearance" in done.err
    done = run(EXAMPLES / "durango-fourbar.yaml", "--steps", 12, "--out", "p.svg", "--out", "p.csv")
    assert done.code == 0
    assert "in the plane no joint constrains twice" in done.err
    assert {row["status"] for row in read(tmp_path / "p.csv")} == {"fits"}


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--out", "f.txt"], "cannot write a result as '.txt'"),
        (["--steps", "0"], "cannot analyse 0 positions"),
        (["--set", "joints.X.pin.clearance=1mm"], "joints.X.pin.clearance"),
    ],
)
def test_bad_input(run: Run, model: Path, options: list[str], said: str) -> None:
    done = run(model, *options)
    assert done.code == 2
    assert said in done.err
