"""`trunnion play` as a user meets it: tables, files, figure, findings, and faults with nothing half-written."""

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
from played import four_bar
from trunnion.results.attributes import summary_of
from trunnion.results.scales import scales_in
from trunnion.views.play import figure, tables

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
SLIDER = EXAMPLES / "toleranced-slider-crank.yaml"


@pytest.fixture
def run(program: Run) -> Run:
    """The verb; a thin space is a space."""

    def call(*arguments: object) -> Outcome:
        done = program("play", *arguments)
        return Outcome(done.code, *(text.replace("\u00a0", " ") for text in done[1:]))

    return call


@pytest.mark.slow
def test_tables_and_files(run: Run, tmp_path: Path) -> None:
    files = [f"p{end}" for end in (".csv", ".json", ".nc", ".svg", ".png")]
    code, out, _ = run(SLIDER, "--steps", 36, "--units-row", *(f"--out={name}" for name in files))
    assert code == 0
    assert {path.name for path in tmp_path.iterdir()} == set(files)
    assert "stroke-position, largest at 90°" in out
    assert "all, worst case" in out
    assert all(f"wrote {name}" in out for name in files)
    with (tmp_path / "p.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert rows[0]["stroke-position"] == "m"
    result = trunnion.play(trunnion.read(SLIDER), steps=36)
    column = [float(row["drive-torque.O.worst_case"]) for row in rows[1:]]
    assert column == pytest.approx(result["worst_case"].sel(measure="drive-torque", joint="O").values)
    with xr.open_dataset(tmp_path / "p.nc") as read:
        np.testing.assert_array_equal(read["sensitivity"].values, result["sensitivity"].values)
    assert json.loads((tmp_path / "p.json").read_text())["attrs"]["drive"] == "O"
    ElementTree.parse(tmp_path / "p.svg")


def test_measures_of_the_command_line(run: Run) -> None:
    code, out, _ = run(SLIDER, "--steps", 12, "--measure", "angle:rod", "--measure", "drive-torque")
    assert code == 0
    assert "angle:rod, largest at " in out
    assert "drive-torque, largest at " in out
    assert "stroke-position" not in out


def test_a_limit_is_a_finding_with_the_line_of_the_file(run: Run, tmp_path: Path) -> None:
    data = four_bar("C").data() | {"measures": {"swing": {"rotation": "D", "limit": "0.01 deg"}}}
    trunnion.Mechanism(**data).write(tmp_path / "bar.yaml")
    code, _, err = run("bar.yaml", "--steps", 12, "--out", "bar.svg")
    assert code == 1
    assert "measures.swing.limit: the worst case to first order, " in err
    assert err.startswith("bar.yaml:")
    assert (tmp_path / "bar.svg").exists()


@pytest.mark.parametrize(
    ("arguments", "what"),
    [
        (["--measure", "rotation:Z"], "no joint 'Z'"),
        (["--measure", "Q"], "is no measure"),
        (["--out", "p.xyz"], "cannot write a result as '.xyz'"),
        (["--steps", "0"], "cannot analyse 0 positions"),
        (["--out", "p.svg", *(f"--measure=piston.{p}.{a}" for p in "QS" for a in "xy"), "--measure=angle:rod",
          "--measure=angle:crank", "--measure=rotation:P"], "7 measures do not fit one figure"),
    ],
)  # fmt: skip
def test_faults(run: Run, tmp_path: Path, arguments: list[str], what: str) -> None:
    code, _, err = run(SLIDER, *arguments)
    assert code == 2
    assert what in err
    assert not list(tmp_path.iterdir())


def test_the_figure_stacks_the_joints_up_to_the_sum() -> None:
    result = trunnion.play(trunnion.read(SLIDER), ["piston.Q.x"], steps=72)
    (axes,) = figure(result).axes
    total = next(line for line in axes.lines if line.get_label() == "sum: worst case, first order").get_xydata()
    assert total[-1, 0] == pytest.approx(360)  # the turn closes
    assert total[:-1, 1] == pytest.approx(result["worst_case_total"].values[0] * 1e6)
    assert len(axes.collections) == 4
    assert axes.get_ylabel() == "worst case of piston.Q.x [µm]"


def test_a_place_and_joints_without_effect_are_told(tmp_path: Path) -> None:
    """The table and the summary of a measure with a place have its figure there."""
    model = tmp_path / "model.yaml"
    text = (EXAMPLES / "fourbar-with-play.yaml").read_text(encoding="utf-8")
    assert "measures:" not in text
    model.write_text(
        f"{text}\nmeasures:\n  place: {{angle: rocker, at: 90 deg}}\n  held: {{angle: crank}}\n", encoding="utf-8"
    )
    result = trunnion.play(trunnion.read(model), steps=8)
    findings = {one.code: one for one in result.trunnion.findings}
    there = float(result["worst_case_total"].sel(measure="place").isel(position=2))  # 90° of 0°, 45°, 90° …
    assert float(result["extreme_worst_case"].sel(measure="place").sum()) == pytest.approx(there, rel=1e-9)
    assert there < float(result["worst_case_total"].sel(measure="place").max())
    assert summary_of(result)[0].value == pytest.approx(there, rel=1e-9)
    assert tables(result)[0].title == "place, at 90°"
    assert findings["play.no_effect"].figures["measure"] == "held"


def test_an_extreme_is_of_its_place_and_other_statistics_are_left_out(tmp_path: Path) -> None:
    """To first order an extreme changes as the course does at its place."""
    model = tmp_path / "model.yaml"
    text = (EXAMPLES / "fourbar-with-play.yaml").read_text(encoding="utf-8")
    model.write_text(
        f"{text}\nmeasures:\n  course: {{angle: rocker}}\n  least: {{angle: rocker, as: minimum}}\n"
        "  most: {angle: rocker, as: maximum}\n  swing: {angle: rocker, as: peak-to-peak}\n",
        encoding="utf-8",
    )
    result = trunnion.play(trunnion.read(model), steps=720)
    assert result["measure"].values.tolist() == ["course", "least", "most"]
    figures = {one.name: one.value for one in result.trunnion.summary}
    course = result.sel(measure="course")
    for name, pick in (("least", np.argmin), ("most", np.argmax)):
        there = course.isel(position=int(pick(course["value"].values)))
        own = result.sel(measure=name)
        assert own["extreme_worst_case"].values == pytest.approx(there["worst_case"].values, rel=1e-2, abs=1e-9)
        assert figures[f"{name}.worst_case"] == pytest.approx(float(own["extreme_worst_case"].sum()), rel=1e-12)
        assert float(own["extreme_time"]) == pytest.approx(float(there["time"]), abs=2e-3)
    assert figures["course.worst_case"] == pytest.approx(float(course["worst_case_total"].max()), rel=1e-4)
    assert "play.measures_left_out" in [one.code for one in result.trunnion.findings]
    titles = [one.title for one in tables(result)]
    assert titles[1].startswith("least, the minimum at ")
    assert figure(result).axes


def test_rounding_is_shown_as_zero() -> None:
    result = trunnion.play(trunnion.read(SLIDER), ["stroke-position"], steps=12).copy(deep=True)
    floor = scales_in(result).floor("m")
    result["extreme_worst_case"][0, 0], result["extreme_worst_case"][0, 1] = 0.9 * floor, 1.1 * floor
    shown = [row[2] for row in tables(result)[0].rows]
    assert shown[0] == "0\u00a0m"
    assert not shown[1].startswith("0\u00a0")
