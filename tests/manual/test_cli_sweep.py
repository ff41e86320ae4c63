"""`trunnion sweep`, `play` and `assemble` as a user meets them: tables, files, figures, findings, faults."""

import json
import re
from xml.etree import ElementTree

import numpy as np
import pytest
import xarray as xr

import trunnion
from manual.test_cli import EXAMPLES, FOUR_BAR, files
from manual.test_cli import table as rows
from played import four_bar
from trunnion.views.shown import plot as figure


@pytest.mark.slow
def test_table_csv_netcdf_and_figure(program, tmp_path):
    written = [f"--out=s{end}" for end in (".csv", ".nc", ".svg")]
    done = program("sweep", FOUR_BAR, "--over", "AB=1.6m:2.4m:3", "--steps", 36, *written)
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


def test_options_of_the_model_come_first(program, tmp_path):
    same = ("--over", "AB=2m,2.1m", "--steps", 12)
    program("sweep", FOUR_BAR, *same, "--friction", "off", "--set", "BC=6.2m", "--out", "s.csv")
    mechanism = trunnion.read(FOUR_BAR).with_values({"BC": "6.2 m"}).with_friction("off")
    wanted = trunnion.sweep(mechanism, {"AB": [2.0, 2.1]}, 12)
    found = rows(tmp_path / "s.csv")
    assert [float(row["A.effort_max"]) for row in found] == wanted["drive_effort_max"].values[0].tolist()
    assert {row["friction_power_mean"] for row in found} == {"0.0"}


BAD = {
    "no range": (["--over", "AB"], "FROM:TO:COUNT"),
    "a broken count": (["--over", "AB=1m:2m:many"], "FROM:TO:COUNT"),
    "an empty value": (["--over", "AB=1m,,2m"], "AB"),
    "unknown name": (["--over", "AX=1m,2m"], "no number named 'AX'"),
    "one without unit": (["--over", "AB=1000:2m:3"], "1000.0 has no unit"),
    "a count of 1": (["--over", "AB=1m:2m:1"], "AB: 1m:2m:1 is not from, to and a count of 2 or more"),
    "too many": (["--over", "AB=1m:2m:100001"], "100,001 points"),
    "impossible": (["--over", "crank.mass=1kg,-1kg"], "negative"),
    "unknown measure": (["--over", "AB=1m,2m", "--measure", "efficency"], "did you mean 'efficiency'"),
    "measure of a stranger": (["--over", "AB=1m,2m", "--measure", "Z.reaction_max"], "reaction_max"),
    "unknown format": (["--over", "AB=1m,2m", "--out", "r.xyz"], ".svg"),
    "two in one file": (
        ["--over", "AB=1m", *(f"--measure={one}" for one in ("efficiency", "status")), "--out=a.svg"],
        "2 figures do not fit one file — give one --measure",
    ),
    "axis of a stranger": (["--over", "AB=1m,2m", "--x", "BC"], "'BC' is not swept over"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_sweeps_are_refused_with_a_message(program, tmp_path, case):
    options, word = BAD[case]
    done = program("sweep", FOUR_BAR, *options, "--out", "r.csv")
    assert done.code == 2
    assert word in done.err
    assert not files(tmp_path)


SLIDER = EXAMPLES / "toleranced-slider-crank.yaml"


def test_a_limit_is_a_finding_with_the_line_of_the_file(program, tmp_path):
    data = four_bar("C").data() | {"measures": {"swing": {"rotation": "D", "limit": "0.01 deg"}}}
    trunnion.Mechanism(**data).write(tmp_path / "bar.yaml")
    code, _, err = program("play", "bar.yaml", "--steps", 12, "--out", "bar.svg")
    assert code == 1
    assert "measures.swing.limit: the worst case to first order, " in err
    assert err.startswith("bar.yaml:")
    assert (tmp_path / "bar.svg").exists()


def test_the_figure_stacks_the_joints_up_to_the_sum():
    result = trunnion.play(trunnion.read(SLIDER), ["piston.Q.x"], steps=72)
    (axes,) = figure(result).axes
    total = next(line for line in axes.lines if line.get_label() == "sum: worst case, first order").get_xydata()
    assert total[-1, 0] == pytest.approx(360)  # the turn closes
    assert total[:-1, 1] == pytest.approx(result["worst_case_total"].values[0] * 1e6)
    assert len(axes.collections) == 4
    assert axes.get_ylabel() == "worst case of piston.Q.x [µm]"


@pytest.fixture
def model(tmp_path):
    """The model of the page about the verb."""
    page = (EXAMPLES.parent / "docs" / "how-to" / "assemble.md").read_text("utf-8")
    found = re.search(r'```yaml title="leaning-four-bar.yaml"\n(.*?)```', page, re.DOTALL)
    assert found
    path = tmp_path / "lean.yaml"
    path.write_text(found[1], encoding="utf-8")
    return path


@pytest.mark.slow
def test_too_little_clearance(program, model, tmp_path):
    written = [f"--out=f{end}" for end in (".csv", ".json", ".nc", ".svg", ".png")]
    done = program("assemble", model, "--steps", 36, *written, "--units-row")
    assert done.code == 1
    assert "0.0143451" in done.out
    assert "B 41 %" in done.out
    assert "error: joints: the stated clearances are too small to close the loops between" in done.err
    units, *found = rows(tmp_path / "f.csv")
    assert (units["A.coordinate"], units["needed_clearance"], units["B.uniform_1_x"]) == ("rad", "m", "m")
    assert len(found) == 36
    assert {row["status"] for row in found} == {"fits", "short"}
    again = xr.load_dataset(tmp_path / "f.nc")
    wanted = trunnion.assemble(trunnion.read(model), 36)
    np.testing.assert_array_equal(again.needed_share, wanted.needed_share)
    assert [float(row["needed_share"]) for row in found] == wanted.needed_share.values.tolist()
    assert float(found[3]["D.stated_2_y"]) == float(wanted.stated_offset.sel(joint="D", end="2", axis="y")[3])
    assert json.loads((tmp_path / "f.json").read_text("utf-8"))["data_vars"]["smallest_clearance"]["data"] > 1.4e-5
    assert ElementTree.parse(tmp_path / "f.svg").getroot().tag.endswith("svg")
    assert (tmp_path / "f.png").read_bytes().startswith(b"\x89PNG")


def test_nothing_to_ask(program, tmp_path):
    done = program("assemble", EXAMPLES / "fourbar-in-space.yaml", "--steps", 12, "--out", "f.svg")
    assert done.code == 0
    assert "the loops close without any clearance" in done.err
    done = program("assemble", EXAMPLES / "durango-fourbar.yaml", "--steps", 12, "--out", "p.svg", "--out", "p.csv")
    assert done.code == 0
    assert "in the plane no joint constrains twice" in done.err
    assert {row["status"] for row in rows(tmp_path / "p.csv")} == {"fits"}
