"""`trunnion sweep` as a user meets it: table, files, figure, findings, and faults with nothing half-written."""

from __future__ import annotations

import csv
import functools
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import xarray as xr

import trunnion
from manual.conftest import Run
from trunnion.views import sweep as view

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
FOUR_BAR = EXAMPLES / "durango-fourbar.yaml"
SLIDER = EXAMPLES / "inverted-slider-crank.yaml"


@pytest.fixture
def run(program: Run) -> Run:
    """The verb."""
    return functools.partial(program, "sweep")


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def files(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_table_csv_netcdf_and_figure(run: Run, tmp_path: Path) -> None:
    done = run(
        FOUR_BAR, "--over", "AB=1.6m:2.4m:3", "--steps", 36, *(f"--out=s{end}" for end in (".csv", ".nc", ".svg"))
    )
    assert done.code == 0
    assert files(tmp_path) == {"s.csv", "s.nc", "s.svg"}
    for name in ("s.csv", "s.nc", "s.svg"):
        assert f"wrote {name}" in done.out
    found = rows(tmp_path / "s.csv")
    assert [float(row["AB"]) for row in found] == [1.6, 2.0, 2.4]
    again = xr.load_dataset(tmp_path / "s.nc")
    mechanism = trunnion.read(FOUR_BAR)
    for i, row in enumerate(found):
        one = trunnion.analyse(mechanism.with_values({"AB": float(row["AB"])}), 36)
        power = float(one["friction_power_mean"].sum("joint"))
        assert float(row["friction_power_mean"]) == pytest.approx(power, rel=1e-9)
        assert float(row["A.effort_max"]) == float(again["drive_effort_max"].sel(driver="A")[i])
        assert float(row["C.reaction_max"]) == float(again["reaction_max"].sel(joint="C")[i])
        assert f"{power:.6g}" in done.out
        assert row["status"] in ("solved", "zero_slip")
        assert row["without_answer"] == "0"
    assert ElementTree.parse(tmp_path / "s.svg").getroot().tag.endswith("svg")


def test_a_grid_in_csv_has_a_row_a_point(run: Run, tmp_path: Path) -> None:
    options = ("--over", "B.friction.coefficient=0.1,0.3", "--over", "AB=1.6m,2.6 m", "--steps", 72)
    done = run(FOUR_BAR, *options, "--out", "g.csv", "--out", "g.png", "--units-row")
    assert done.code == 1  # AB = 2.6 m cannot be assembled all the way
    units, *found = rows(tmp_path / "g.csv")
    assert (units["AB"], units["A.effort_max"], units["B.reaction_max"], units["status"]) == ("m", "N m", "N", "")
    points = [(float(row["B.friction.coefficient"]), float(row["AB"])) for row in found]
    assert points == [(0.1, 1.6), (0.1, 2.6), (0.3, 1.6), (0.3, 2.6)]
    assert [row["status"] for row in found][1::2] == ["not_assembled"] * 2
    assert [row["efficiency"] for row in found][1::2] == ["", ""]
    assert [row["A.effort_max"] == "" for row in found] == [False, True, False, True]
    assert "cannot be assembled" in done.out
    assert (
        "2 of 4 points have no result, the first at B.friction.coefficient = 0.1, AB = 2.6 m (5 positions" in done.err
    )
    assert (tmp_path / "g.png").read_bytes().startswith(b"\x89PNG")


def test_options_of_the_model_come_first(run: Run, tmp_path: Path) -> None:
    same = ("--over", "AB=2m,2.1m", "--steps", 12)
    run(FOUR_BAR, *same, "--friction", "off", "--set", "BC=6.2m", "--out", "s.csv")
    mechanism = trunnion.read(FOUR_BAR).with_values({"BC": "6.2 m"}).with_friction("off")
    wanted = trunnion.sweep(mechanism, {"AB": [2.0, 2.1]}, 12)
    found = rows(tmp_path / "s.csv")
    assert [float(row["A.effort_max"]) for row in found] == wanted["drive_effort_max"].values[0].tolist()
    assert {row["friction_power_mean"] for row in found} == {"0.0"}


BAD = {
    "no range": (["--over", "AB"], "FROM:TO:COUNT"),
    "two parts": (["--over", "AB=1m:2m"], "FROM:TO:COUNT"),
    "an empty end": (["--over", "AB=1m::3"], "FROM:TO:COUNT"),
    "a broken count": (["--over", "AB=1m:2m:many"], "'many' is no whole number"),
    "zero count": (["--over", "AB=1m:2m:0"], "range of 0 values"),
    "an empty value": (["--over", "AB=1m,,2m"], "AB"),
    "unknown name": (["--over", "AX=1m,2m"], "no number named 'AX'"),
    "wrong unit": (["--over", "AB=1kg,2kg"], "length"),
    "one without unit": (["--over", "AB=1000:2m:3"], "1000.0 has no unit"),
    "twice": (["--over", "AB=1m,2m", "--over", "AB=3m,4m"], "given twice"),
    "seven": ([text for i in range(7) for text in ("--over", f"n{i}=1m")], "7 names"),
    "too many": (["--over", "AB=1m:2m:100001"], "100,001 points"),
    "impossible": (["--over", "crank.mass=1kg,-1kg"], "negative"),
    "unknown measure": (["--over", "AB=1m,2m", "--measure", "efficency"], "did you mean 'efficiency'"),
    "measure of a stranger": (["--over", "AB=1m,2m", "--measure", "Z.reaction_max"], "reaction_max"),
    "unknown format": (["--over", "AB=1m,2m", "--out", "r.xyz"], ".svg"),
    "no folder": (["--over", "AB=1m,2m", "--steps", "4", "--out", "missing/r.svg"], "missing/r.svg"),
    "no steps": (["--over", "AB=1m,2m", "--steps", "0"], "0 positions"),
    "no over": ([], "--over"),
    "two in one file": (
        ["--over", "AB=1m", *(f"--measure={one}" for one in ("efficiency", "status")), "--out=a.svg"],
        "2 figures do not fit one file — --out a makes a folder",
    ),
    "axis of a stranger": (["--over", "AB=1m,2m", "--x", "BC"], "'BC' is not swept over"),
    "curves along the axis": (["--over", "AB=1m,2m", "--x", "AB", "--family", "AB"], "both the axis and the curves"),
    "unknown kind": (["--over", "AB=1m,2m", "--kind", "contour"], "no figure 'contour'"),
    "map over one": (["--over", "AB=1m,2m", "--over", "BC=6m", "--kind", "map"], "needs two names that vary"),
    "unknown picture": (["--over", "AB=1m,2m", "--out", "folder", "--format", "bmp"], "no kind of figure"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_sweeps_are_refused_with_a_message(run: Run, tmp_path: Path, case: str) -> None:
    options, word = BAD[case]
    done = run(FOUR_BAR, *options, *(["--out", "r.csv"] if case != "no folder" else []))
    assert done.code == 2
    assert word in done.err
    assert not files(tmp_path)


def test_a_figure_shows_units_and_gaps() -> None:
    """One curve a value, its label as it was written; a gap is shaded and named, no line crosses it."""
    mechanism = trunnion.read(FOUR_BAR)
    grid = trunnion.sweep(mechanism, {"AB": ("2 m", "2.8 m", 5), "A.pin.radius": ["50 mm", "100 mm"]}, 36)
    axes = view.figure(grid, "A.effort_max").axes[0]
    labels = axes.get_legend_handles_labels()[1]
    assert labels == ["A.pin.radius = 50 mm", "A.pin.radius = 100 mm"]
    assert axes.get_xlabel() == "AB [m]"
    assert axes.get_ylabel() == "maximum drive effort of A [kN m]"
    curve = axes.get_lines()[0]
    assert np.isnan(curve.get_ydata()).tolist() == np.isnan(grid["drive_effort_max"].values[0, :, 0]).tolist()
    assert "cannot be assembled" in [text.get_text() for text in axes.texts]
    for k, name in enumerate(("A.pin.radius = 50 mm", "A.pin.radius = 100 mm")):
        shown = next(line for line in axes.get_lines() if line.get_label() == name)
        assert np.allclose(shown.get_ydata() * 1e3, grid["drive_effort_max"].values[0, :, k], equal_nan=True)
