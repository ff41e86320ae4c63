"""`trunnion allocate` as a user meets it: tables, files, the model written, figures, report, faults."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import xarray as xr

import trunnion
from manual.conftest import Outcome, Run

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
FOURBAR, GRADES, PISTON = (
    EXAMPLES / f"{name}.yaml" for name in ("toleranced-fourbar", "fourbar-by-grades", "piston-by-cost")
)
QUICK = ("--steps", 24, "--samples", 100)


@pytest.fixture
def run(program: Run) -> Run:
    """The verb; a thin space is a space."""

    def call(*arguments: object) -> Outcome:
        done = program("allocate", *arguments)
        return Outcome(done.code, *(text.replace("\u00a0", " ") for text in done[1:]))

    return call


def test_tables_and_files(run: Run, tmp_path: Path) -> None:
    files = ["a.csv", "a.measures.csv", "a.offers.csv", "a.json", "a.nc", "a.parquet", "a.svg", "a.png"]
    code, out, err = run(
        FOURBAR,
        "--steps",
        72,
        "--samples",
        100,
        "--curve",
        3,
        *(f"--out={name}" for name in files),
        "--report",
        "a.html",
    )
    assert code == 0
    assert {path.name for path in tmp_path.iterdir()} == {*files, "a.html"}
    assert "worst case: cost 16.456705, as stated 17.054945, global optimum to first order" in out
    assert "±0.021336 mm" in out
    assert "how the limits are kept" in out
    assert "what accuracy costs" in out
    assert "rocker-angle: angle of link rocker" in out
    assert "toleranced-fourbar.yaml:36: note: measures.rocker-angle: the worst case found on the mechanism" in err
    with (tmp_path / "a.csv").open(encoding="utf-8", newline="") as file:
        rows = {row["parameter"]: row for row in csv.DictReader(file)}
    assert float(rows["dimensions.l2"]["tolerance"]) == pytest.approx(2.1336e-5, abs=5e-10)
    assert float(rows["dimensions.l2"]["cost"]) == pytest.approx(3.38885, abs=1e-5)
    with (tmp_path / "a.offers.csv").open(encoding="utf-8", newline="") as file:
        assert [float(row["factor"]) for row in csv.DictReader(file)] == pytest.approx([0.5, 1, 2])
    with xr.open_dataset(tmp_path / "a.nc") as read:
        assert float(read["cost_total"]) == pytest.approx(16.456705, abs=5e-7)
        assert read["choice"].values.tolist() == [""] * read.sizes["parameter"]
    assert json.loads((tmp_path / "a.json").read_text("utf-8"))["attrs"]["criterion"] == "worst-case"
    ElementTree.parse(tmp_path / "a.svg")
    page = (tmp_path / "a.html").read_text("utf-8")
    assert "What to buy" in page
    assert "What accuracy costs" in page


def test_the_model_is_written_with_its_comments(run: Run, tmp_path: Path) -> None:
    code, out, _ = run(GRADES, *QUICK, "--write", "bought.yaml", "--set", "rocker.mass=0.35kg")
    assert code == 0
    assert "wrote bought.yaml" in out
    assert "milled" in out
    text = (tmp_path / "bought.yaml").read_text("utf-8")
    assert "l1: 100 mm                         # ground" in text
    assert "tolerances: {l1: ±0.0435 mm, l2: ±0.03 mm, l3: ±0.0175 mm, l4: ±0.037 mm}" in text
    read = trunnion.read(tmp_path / "bought.yaml")
    assert read.parameters()["links.rocker.mass"] == pytest.approx(0.35)
    again = run("bought.yaml", *QUICK)
    assert again.code == 0
    assert "cost 28.6, as stated 28.6" in again.out


def test_plays_are_written(run: Run, tmp_path: Path) -> None:
    code, _, _ = run(PISTON, *QUICK, "--write", "bought.json", "--out", "p.png", "--kind", "cost")
    assert code == 0
    read = trunnion.read(tmp_path / "bought.json")
    assert read.parameters()["joints.Q.pin.clearance"] == pytest.approx(1.81095e-5, rel=1e-5)
    code, _, err = run(PISTON, *QUICK, "--write", "bought.toml")
    assert code == 2
    assert "write .yaml or .json" in err


def test_the_model_itself_is_not_overwritten(run: Run, tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text(FOURBAR.read_text("utf-8"), "utf-8")
    before = (tmp_path / "m.yaml").read_bytes()
    code, _, err = run("m.yaml", *QUICK, "--write", "m.yaml")
    assert code == 2
    assert "is the model itself" in err
    assert (tmp_path / "m.yaml").read_bytes() == before
    code, _, _ = run("m.yaml", *QUICK, "--write", "m.yaml", "--force")
    assert code == 0
    assert (tmp_path / "m.yaml").read_bytes() != before
    assert {path.name for path in tmp_path.iterdir()} == {"m.yaml"}


def test_yield_and_rss(run: Run) -> None:
    code, out, _ = run(FOURBAR, "--steps", 24, "--samples", 1000, "--yield", 0.95)
    assert code == 0
    assert "yield of 95.0 %" in out
    assert "trials" in out
    code, out, _ = run(FOURBAR, *QUICK, "--criterion", "rss")
    assert code == 0
    assert "root of the sum of squares: cost" in out


def test_exact(run: Run) -> None:
    code, out, err = run(FOURBAR, *QUICK, "--exact")
    assert code == 0
    assert "narrower, so that the mechanism itself keeps them" in err
    assert "100 %" in out


def test_limits_that_nothing_keeps(run: Run, tmp_path: Path) -> None:
    code, out, err = run(
        GRADES, *QUICK, "--set", "measures.rocker-angle.limit=±0.05 deg", "--out", "a.json", "--out", "a.svg",
        "--write", "b.yaml", "--report", "a.html",
    )  # fmt: skip
    assert code == 1
    assert "no allocation keeps the limits" in out
    assert "error: measures.rocker-angle: no tolerances keep the limit +0.05 deg" in err
    assert {path.name for path in tmp_path.iterdir()} == {"a.json", "a.html"}
    assert json.loads((tmp_path / "a.json").read_text("utf-8"))["attrs"]["found"] == 0


def test_names_of_the_file(run: Run) -> None:
    """A finding about a cost has the line of it, though the file has a shorter name for the number."""
    code, _, err = run(
        FOURBAR, *QUICK, "--measure", "rocker-angle", "--set", "measures.rocker-angle.limit=+0.1/-inf deg"
    )
    assert code == 2
    code, _, err = run(GRADES, *QUICK, "--choice", "continuous")
    assert code == 1
    assert "fourbar-by-grades.yaml:40: error: costs.l1: has a table of processes" in err


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (["--measure", "torque"], "none of the measures torque has a limit"),
        (["--yield", 1.5], "a yield of 1.5 cannot be asked for"),
        (["--curve", 1], "a curve of 1 points"),
        (["--kind", "pie"], "there is no figure 'pie'"),
        (["--out", "a.doc"], "cannot write a result as '.doc'"),
        (["--report", "a.pdf"], "a report is HTML"),
        (["--kind", "trade-off", "--out", "a.png"], "ask for --curve 21"),
        (["--samples", -1], "-1 samples"),
    ],
)
def test_faults(run: Run, options: list[object], text: str, tmp_path: Path) -> None:
    code, _, err = run(FOURBAR, *QUICK, *options)
    assert code == 2
    assert text in err
    assert not list(tmp_path.iterdir())


def test_models_without_costs_or_limits(run: Run) -> None:
    code, _, err = run(EXAMPLES / "toleranced-rssr.yaml", *QUICK)
    assert code == 2
    assert "no tolerance has a cost" in err or "has a limit" in err
    code, _, err = run(EXAMPLES / "slider-crank.yaml", *QUICK)
    assert code == 2
    assert "no measure is stated" in err


def test_the_figures_of_the_verification(run: Run, tmp_path: Path) -> None:
    for kind in ("cost", "histogram", "envelope", "contributions"):
        code, _, _ = run(FOURBAR, *QUICK, "--kind", kind, "--out", f"{kind}.svg")
        assert code == 0
        ElementTree.parse(tmp_path / f"{kind}.svg")
    result = trunnion.allocate(trunnion.read(FOURBAR), steps=24, samples=100)
    assert np.all(np.isfinite(result["tolerance"].values))
