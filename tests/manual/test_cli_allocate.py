"""`trunnion allocate` as a user meets it: tables, files, the model written, figures, report, faults."""

import csv
import json
import re
from xml.etree import ElementTree

import numpy as np
import pytest
import xarray as xr

import trunnion
from mechanisms_parts import EXAMPLES

FOURBAR, GRADES = EXAMPLES / "toleranced-fourbar.yaml", EXAMPLES / "fourbar-by-grades.yaml"
QUICK = ("--steps", 24, "--samples", 100)


@pytest.mark.slow
def test_tables_and_files(program, tmp_path):
    files = ["a.csv", "a.measures.csv", "a.offers.csv", "a.json", "a.nc", "a.parquet", "a.svg", "a.png"]
    asked = ("--steps", 72, "--samples", 100, "--curve", 3, "--report", "a.html")
    code, out, err = program("allocate", FOURBAR, *asked, *(f"--out={name}" for name in files))
    assert code == 0
    assert {path.name for path in tmp_path.iterdir()} == {*files, "a.html"}
    assert "worst case: cost 16.45688, as stated 17.054945, global optimum to first order" in out
    assert "±0.021374 mm" in out
    assert "share of the limits that is used" in out
    assert "cost over accuracy" in out
    assert "rocker-angle: angle of link rocker" in out
    assert "toleranced-fourbar.yaml:36: note: measures.rocker-angle: the worst case of the mechanism, −0" in err
    with (tmp_path / "a.csv").open(encoding="utf-8", newline="") as file:
        rows = {row["parameter"]: row for row in csv.DictReader(file)}
    assert float(rows["dimensions.l2"]["tolerance"]) == pytest.approx(2.1374e-5, abs=5e-10)
    assert float(rows["dimensions.l2"]["cost"]) == pytest.approx(3.38611, abs=1e-5)
    with (tmp_path / "a.offers.csv").open(encoding="utf-8", newline="") as file:
        assert [float(row["factor"]) for row in csv.DictReader(file)] == pytest.approx([0.5, 1, 2])
    with xr.open_dataset(tmp_path / "a.nc") as read:
        assert float(read["cost_total"]) == pytest.approx(16.4568797, abs=5e-7)
        assert read["choice"].values.tolist() == [""] * read.sizes["parameter"]
    assert json.loads((tmp_path / "a.json").read_text("utf-8"))["attrs"]["criterion"] == "worst-case"
    ElementTree.parse(tmp_path / "a.svg")
    page = (tmp_path / "a.html").read_text("utf-8")
    assert "Allocated tolerances" in page
    assert "Cost over accuracy" in page


def test_the_model_is_written_with_its_comments(program, tmp_path):
    code, out, _ = program("allocate", GRADES, *QUICK, "--write", "bought.yaml", "--set", "rocker.mass=0.35kg")
    assert code == 0
    assert "wrote bought.yaml" in out
    assert "milled" in out
    text = (tmp_path / "bought.yaml").read_text("utf-8")
    assert "l1: 100 mm                         # ground" in text
    assert "tolerances: {l1: ±0.0435 mm, l2: ±0.03 mm, l3: ±0.0175 mm, l4: ±0.037 mm}" in text
    read = trunnion.read(tmp_path / "bought.yaml")
    assert read.parameters()["links.rocker.mass"] == pytest.approx(0.35)
    again = program("allocate", "bought.yaml", *QUICK)
    assert again.code == 0
    assert "cost 28.6, as stated 28.6" in again.out


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (["--measure", "torque"], "none of the measures torque has a limit"),
        (["--yield", 1.5], "a yield of 1.5 is not possible"),
        (["--sure"], "only a yield can be sure"),
        (["--criterion", "rss", "--yield", 0.99], "--yield: the criterion rss does not use a yield of 0.99"),
        (["--kind", "pie"], "there is no figure 'pie'"),
        (["--kind", "trade-off", "--out", "a.png"], "add --curve 21"),
        (["--samples", -1], "-1 samples"),
    ],
)
def test_faults(program, options, text, tmp_path):
    code, _, err = program("allocate", FOURBAR, *QUICK, *options)
    assert code == 2
    assert text in err
    assert not list(tmp_path.iterdir())


INLINE = """\
trunnion: 1
dimensions:
  l1:   100 mm +0.04/-0.02 mm   # ground
  l2:    30 mm ± 0.02 mm        # crank
  l3:   "90 mm ± 30 um"
  l4:    70 mm
links:
  ground:  {points: {A: [0, 0],  D: [l1, 0]}}
  crank:   {points: {A: [0, 0],  B: [l2, 0]}}
  coupler: {points: {B: [0, 0],  C: [l3, 0]}}
  rocker:  {points: {D: [0, 0],  C: [l4, 0]}}
joints:
  A: {type: revolute,   links: [ground, crank]}
  B: {type: revolute,   links: [crank, coupler]}
  C: {type: revolute,   links: [coupler, rocker], pin: {fit: 12 mm H7/g6}}
  D: {type: revolute,   links: [ground, rocker]}
drivers: {A: {speed: 120 rpm}}
assembly: {C: [94 mm, 70 mm]}
measures:
  angle: {angle: rocker, limit: ±0.2 deg}
  place: {point: coupler.C, axis: x, at: 60 deg, limit: ±0.25 mm}
tolerances:
  l4: ±0.03 mm   # turned
costs:
  l1: {model: power, B: 1,   k: 0.45, unit: mm, least: 1 um}
  l2: {model: power, B: 0.6, k: 0.45, unit: mm, least: 1 um}
  l3: {model: power, B: 1,   k: 0.45, unit: mm, least: 1 um}
  l4: {model: power, B: 0.8, k: 0.45, unit: mm, least: 1 um}
"""


def test_limits_are_written_under_tolerances(program, tmp_path):
    """Nothing but the limits is changed, rounded down to five digits: the model that is written keeps its limits."""
    (tmp_path / "m.yaml").write_text(INLINE, "utf-8")
    code, _, err = program("allocate", "m.yaml", "--steps", 24, "--samples", 0, "--write", "b.yaml")
    assert code == 0, err
    text = (tmp_path / "b.yaml").read_text("utf-8")
    gone = [line for line in INLINE.split("\n") if line not in text.split("\n")]
    assert [line.split(":")[0] for line in gone] == ["  l1", "  l2", "  l3", "  l4"]
    stated, read = (trunnion.read(tmp_path / name) for name in ("m.yaml", "b.yaml"))
    result = trunnion.allocate(stated, steps=24, samples=0)
    found = dict(zip(result["parameter"].values.tolist(), result["tolerance"].values.tolist(), strict=True))
    for one in read.tolerated():
        if one.path.startswith("dimensions."):
            assert found[one.path] * (1 - 1e-4) <= one.half_width <= found[one.path] * (1 + 1e-9)
            assert (one.lower + one.upper) / 2 == pytest.approx(1e-5 if one.path.endswith("l1") else 0, abs=1e-15)
    for line in (
        "  l1:   100 mm                  # ground",
        "  l2:    30 mm                  # crank",
        '  l3:   "90 mm"',
    ):
        assert line in text.split("\n")
    assert re.search(r"\n  l4: ±0.06\d+ mm # turned\n  dimensions.l1: \+0.07\d+ mm/-0.05\d+ mm\n", text)
    again = trunnion.allocate(read, steps=24, samples=0)
    assert float(again["cost_total_before"]) == pytest.approx(float(result["cost_total"]), rel=1e-4)
    worst = trunnion.tolerance(read, ["angle"], ["linear"], steps=90)["worst_case_upper"]  # over the whole cycle
    assert float(worst.max()) <= np.radians(0.2)


def test_no_model_of_limits_that_are_not_kept(program, tmp_path):
    (tmp_path / "m.yaml").write_text(INLINE, "utf-8")
    narrow = ("--set", "measures.angle.limit=±0.01 deg", "--set", "measures.place.limit=±0.001 mm")
    code, _, err = program("allocate", "m.yaml", "--steps", 24, "--samples", 0, *narrow, "--write", "b.yaml")
    assert code == 1
    assert "'b.yaml' is not written: there is no allocation" in err
    assert not (tmp_path / "b.yaml").exists()
    for name in ("angle", "place"):  # each measure that cannot be kept
        assert any(f"measures.{name}: the limit " in line and "is infeasible" in line for line in err.split("\n"))
