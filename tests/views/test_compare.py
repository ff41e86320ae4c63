"""Figures, tables and the report of a comparison; the verb, from files of the virtual rig."""

from __future__ import annotations

import hashlib
import json
import re
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.axis import Tick
from matplotlib.text import Text
from test_report import Page

import trunnion
from rig_measurements import measured, rocker
from trunnion import MechanismError
from trunnion.cli.app import main
from trunnion.results.tables.studies import COMPARISON as TABLES
from trunnion.rig.reading.measurement import Measurement
from trunnion.views.common.bundle import web_text
from trunnion.views.compare import (
    MOST_DRAWN,
    MOST_PANELS,
    conditions,
    drive,
    efficiencies,
    figure,
    files,
    headline,
    label,
    levels,
    panels,
    report,
    results,
    sensors,
    varied,
    verdicts,
)  # fmt: skip

POWERS = ("torque", "speed", "brake", "out")
EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
FRICTION = "joint_defaults.friction.coefficient"


def outside(drawn):
    """Texts that lie beyond the edge of a figure."""
    drawn.canvas.draw()
    ticks = {id(text) for tick in drawn.findobj(Tick) for text in (tick.label1, tick.label2)}
    boxes = [(text.get_text(), text.get_window_extent()) for text in drawn.findobj(Text) if id(text) not in ticks]
    width, height = drawn.bbox.width, drawn.bbox.height
    return [text for text, box in boxes
            if text.strip() and (box.x0 < -1 or box.y0 < -1 or box.x1 > width + 1 or box.y1 > height + 1)]  # fmt: skip


def settings(torques, speeds):
    return [{"brake.resisting_torque": one, "A.speed": two} for one in torques for two in speeds]


@cache
def case(name):
    """Results by what is odd in them; nobody changes them."""
    of = {
        "family": lambda: measured(settings=settings((3.0, 5.0, 7.0), (4.0, 6.0)), channels=POWERS),
        "one curve": lambda: measured(settings=settings((3.0, 5.0, 7.0), (4.0,)), channels=POWERS),
        "nothing varied": lambda: measured(settings=[{}, {}], channels=POWERS),
        "many": lambda: measured(settings=settings(np.linspace(2, 6, 10), (3.0, 4.0)), channels=POWERS, positions=12),
        "one turn": lambda: measured(channels=POWERS, turns=1),
        "one position": lambda: measured(channels=POWERS, positions=1),
        "motion only": lambda: measured(channels=("angle",)),
        "wrong": lambda: measured(channels=POWERS, wrong=lambda channel, true: true + (channel == "torque")),
    }  # fmt: skip
    if name == "locked":
        found = measured(settings=[{}, {}, {}], channels=POWERS).conditions
        values = ({FRICTION: 0.1}, {FRICTION: 0.2}, {FRICTION: 40.0})
        return trunnion.rig.compare(
            rocker(),
            Measurement("bench", tuple(replace(one, values=told) for one, told in zip(found, values, strict=True))),
        )
    return trunnion.rig.compare(rocker(), of[name]())


NAMES = ("family", "one curve", "nothing varied", "many", "one turn", "one position", "motion only", "wrong", "locked")


@pytest.mark.spread(4)
@pytest.mark.parametrize("name", NAMES)
def test_every_figure_is_drawn_with_all_texts_in_it(name):
    assert outside(figure(case(name))) == []


@pytest.mark.parametrize("name", ["one turn", "one position", "locked"])
def test_every_course_is_drawn_with_all_texts_in_it(name):
    assert outside(figure(case(name), "overlay", "torque")) == []


def test_efficiency_has_a_curve_for_each_value_of_the_second_number():
    axes = figure(case("family")).axes[0]
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert labels == ["A.speed = 4\u00a0rad/s", "A.speed = 6\u00a0rad/s", "measured, ±U (95\u00a0%)", "model"]
    assert "resisting_torque [N m]" in axes.get_xlabel()
    assert len(axes.containers) == 2


def test_many_curves_are_told_apart_by_a_scale_of_colours():
    drawn = figure(case("many"))
    assert len(drawn.axes) == 1  # ten torques are the abscissa, two speeds the curves
    turned = case("many").copy()
    turned["value"] = turned.value.where(turned.set == "A.speed", 7.0)
    assert varied(turned)[0].name == "A.speed"


def test_ten_curves_have_a_colour_bar():
    result = case("many")
    stretched = result.copy()
    values = result.value.values.copy()
    values[1] = np.tile(np.linspace(3, 4, 10), 2)
    values[0] = np.repeat(np.linspace(2, 6, 11)[:10], 2)
    stretched["value"] = (result.value.dims, values)
    assert len(figure(stretched).axes) == 2


def test_without_anything_varied_the_conditions_are_named():
    axes = figure(case("nothing varied")).axes[0]
    assert [tick.get_text() for tick in axes.get_xticklabels()] == ["run 1", "run 2"]


def test_a_model_without_an_answer_is_a_gap_with_its_cause():
    axes = figure(case("locked")).axes[0]
    assert any("model: locked" in text.get_text() for text in axes.texts)
    assert np.isnan(axes.lines[0].get_ydata()).sum() == 1


def test_courses_have_band_model_and_residual():
    above, below = figure(case("wrong"), "overlay", channel="torque").axes
    assert [text.get_text() for text in above.get_legend().get_texts()] == ["±U (95\u00a0%)", "measured", "model"]
    assert "offset only" in below.get_title(loc="right")
    residual = below.lines[1].get_ydata() if len(below.lines) > 1 else below.lines[0].get_ydata()
    assert np.nanmedian(residual) == pytest.approx(1.0, abs=0.05) or np.nanmedian(residual) == 0
    assert below.get_xlabel() == "drive angle A [°]"


def test_gaps_are_drawn_as_gaps():
    result = case("wrong").copy(deep=True)
    result["measured"][0, 0, 5:9] = np.nan
    above, _ = figure(result, "overlay", channel="torque").axes
    lines = {line.get_label(): line for line in above.lines}
    assert np.isnan(lines["measured"].get_ydata()[5:9]).all()
    assert np.isfinite(lines["model"].get_ydata()[5:9]).all()


def test_a_figure_says_how_many_courses_it_leaves_out():
    assert len(panels(case("family"))) == 24
    drawn = figure(case("family"), "overlay")
    assert f"{MOST_PANELS} of 24 signals" in drawn._suptitle.get_text()


def test_what_cannot_be_drawn_is_said():
    with pytest.raises(MechanismError, match="there is no figure 'polar'"):
        figure(case("wrong"), "polar")
    with pytest.raises(MechanismError, match="the efficiency was not measured"):
        figure(case("motion only"), "efficiency")
    with pytest.raises(MechanismError, match="did you mean 'torque'"):
        figure(case("wrong"), channel="torke")


def test_settings_that_were_measured_are_levels():
    found = levels(np.array([100.1, 99.9, 200.2, 199.8, np.nan]))
    assert found == pytest.approx([100, 100, 200, 200, np.nan], nan_ok=True)
    assert levels(np.array([0.26180, 0.26181])) == pytest.approx([0.261805] * 2)


def test_the_drive_closes_over_a_turn():
    over = drive(case("family"), 0)
    assert over.closed
    assert over.period == pytest.approx(360)
    assert label(case("family"), 0).startswith("run 1: ")


def test_tables_are_of_texts():
    result = case("wrong")
    assert len(results(result).rows) == 4
    row = results(result).rows[0]
    assert row[:2] == ["1", "torque"]
    assert row[-1] == "offset only"
    assert row[5].startswith(("1.00", "0.99"))
    assert len(results(result, 1).rows[0]) == len(results(result, 1).head)
    assert efficiencies(result).rows[0][-1] in ("within", "not within")
    assert efficiencies(case("motion only")) is None
    assert verdicts(result).head == ["run", *POWERS]
    assert conditions(case("family")).rows[0][1:3] == ["3\u00a0N\u00a0m", "4\u00a0rad/s"]
    assert sensors(result).rows[0][:3] == ["torque", "effort:A", "N m"]
    assert files(result).rows == [["run-1.csv", "—", "—"]]
    assert headline(result)[0][1][0][0] == "3 of 4"
    assert "—" in results(case("one turn")).rows[0]


def test_difference_of_efficiencies_is_measured_less_model():
    """A reading of the drive torque that is too large makes the measured efficiency too small."""
    result = case("wrong")
    measured_, _, model, difference = (float(cell.replace("−", "-")) for cell in efficiencies(result).rows[0][1:5])
    assert measured_ < model - 0.01
    assert difference == pytest.approx(measured_ - model, abs=1.5e-4)
    assert difference == pytest.approx(float(result.efficiency[0] - result.efficiency_model[0]), abs=6e-5)


def test_what_was_set_stands_beside_the_courses_of_its_condition():
    result = case("family")
    columns = {name: values for name, _, values in TABLES["courses"](result)}
    for name in ("brake.resisting_torque", "A.speed"):
        own = dict(zip(result["condition"].values, result["value"].sel({"set": name}).values, strict=True))
        assert len(set(own.values())) > 1
        assert columns[name].tolist() == [own[one] for one in columns["condition"]]


@cache
def page_of(name):
    return report(case(name))


@pytest.mark.spread(1)
@pytest.mark.parametrize("name", ["wrong", "one turn", "one position", "motion only"])
def test_every_result_makes_a_page_that_fetches_and_runs_nothing(name):
    text = page_of(name)
    page = Page(text)
    assert not page.open
    assert not re.search(r"https?://", text)
    assert "<script" not in text
    for _, attrs in page.tags:
        assert attrs.get("src", "data:").startswith("data:")
        assert not [one for one in attrs if one.startswith("on") or one == "style"]


@pytest.mark.slow
def test_the_report_has_what_a_laboratory_files(tmp_path):
    result = case("wrong")
    words = " ".join(Page(page_of("wrong")).words)
    for told in ("bench", "crank and rocker", result.attrs["model_hash"], "Sensors", "Conditions", "Verdicts",
                 "Efficiency", "Expanded uncertainty", "JCGM 100:2008", "counts as exact", "SHA-256",
                 "Checked by", "What would explain the residual"):  # fmt: skip
        assert told in words, told


def test_files_at_hand_are_hashed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "run-1.csv").write_bytes(b"t,T\n")
    found = json.loads(trunnion.rig.compare(rocker(), measured()).attrs["files"])
    digest = hashlib.sha256(b"t,T\n").hexdigest()
    assert found == [{"file": "run-1.csv", "bytes": 4, "sha256": digest}]


@pytest.mark.slow
def test_many_conditions_are_limited_and_said():
    found = measured(settings=settings(np.linspace(2, 6, 10), (3.0, 4.0)), channels=POWERS, positions=12)
    page = Page(report(trunnion.rig.compare(rocker(), found, ["out"])))
    assert f"{MOST_DRAWN} of 20 conditions are drawn" in " ".join(page.words)
    assert len([tag for tag, _ in page.tags if tag == "img"]) == 1 + MOST_DRAWN


def test_names_are_text():
    found = measured(channels=("out",))
    odd = tuple(replace(one, name="</style><script>alert(1)</script> $x$") for one in found.conditions)
    text = report(trunnion.rig.compare(rocker(), replace(found, name="<b>曲柄</b>", conditions=odd)))
    assert "<script" not in text
    assert "<b>曲柄</b>" in " ".join(Page(text).words)


def test_the_page_is_printed_on_a4_with_the_heads_of_tables_repeated():
    assert "size: A4" in web_text("report.css")
    printed = web_text("page.css").partition("@media print")[2]
    for rule in ("display: table-header-group", "break-inside: avoid"):
        assert rule in printed


# ---- files and the verb ---------------------------------------------------------------------------------------


def test_tables_of_files(tmp_path):
    for package in ("h5netcdf", "pyarrow"):
        pytest.importorskip(package)
    result = case("family")
    trunnion.save(result, tmp_path / "x.csv")
    trunnion.save(result, tmp_path / "x.figures.csv", units_row=True)
    trunnion.save(result, tmp_path / "x.parquet")
    trunnion.save(result, tmp_path / "x.nc")
    courses = pd.read_csv(tmp_path / "x.csv")
    assert len(courses) == 6 * 36
    assert {"condition", "brake.resisting_torque", "phase", "drive", "status", "torque.residual"} <= set(
        courses.columns
    )
    assert courses["torque.measured"].to_numpy()[:36] == pytest.approx(result.measured.values[0, 0], nan_ok=True)
    figures = pd.read_csv(tmp_path / "x.figures.csv", skiprows=[1])
    assert len(figures) == 6 * 4
    assert set(figures["verdict"]) <= {"within", "offset", "not"}
    assert figures["rms"].to_numpy() == pytest.approx(result.rms.values.T.ravel())
    assert len(pd.read_parquet(tmp_path / "x.parquet")) == 6 * 36


RIG = """\
trunnion-rig: 1
name: bench
schedule: {conditions: [{work.resisting_torque: 5 N m}, {work.resisting_torque: 2 N m}], turns: 6, idle: 0.3 s}
rate: 500 Hz
encoder: {per_turn: 60, kind: count}
sensors:
  torque: {measures: "effort:A", range: 10 N m, sensitivity: 0.5 V/(N m), noise: 4 mV, accuracy: {zero: 20 mN m}}
  brake: {measures: "load:work", range: 10 N m, sensitivity: 0.5 V/(N m), noise: 4 mV, accuracy: {zero: 20 mN m}}
  speed: {measures: "rate:A", unit: rpm, noise: 0.05 rpm, accuracy: {zero: 0.05 rpm}}
  out: {measures: "rate:D", unit: rpm, noise: 0.05 rpm, accuracy: {zero: 0.05 rpm}}
"""


def run(monkeypatch, capsys, *arguments):
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setattr(sys, "argv", ["trunnion", *map(str, arguments)])
    with pytest.raises(SystemExit) as end:
        main()
    return end.value.code, *capsys.readouterr()


@pytest.mark.slow
def test_the_verb_from_the_files_of_a_virtual_rig(tmp_path, monkeypatch, capsys):
    model = EXAMPLES / "toleranced-fourbar.yaml"
    (tmp_path / "rig.yaml").write_text(RIG, encoding="utf-8")
    code, _, errors = run(
        monkeypatch, capsys, "rig", model, tmp_path / "rig.yaml", "--out", tmp_path / "data", "--seed", 3
    )
    assert code == 0, errors
    mapping = tmp_path / "data" / "mapping.yaml"
    coarse = re.sub(r"(?m)^positions: .*\n", "", mapping.read_text("utf-8")) + "positions: 36\n"
    mapping.write_text(coarse, encoding="utf-8")
    page = tmp_path / "r.html"
    code, shown, errors = run(
        monkeypatch,
        capsys,
        "compare",
        model,
        mapping,
        "--channel",
        "torque",
        "--report",
        page,
        "--out",
        tmp_path / "e.svg",
    )
    assert code == 0, shown + errors
    assert "within" in shown
    assert "η measured" in shown
    assert page.read_text("utf-8").startswith("\n<!doctype html>") or "<!doctype html>" in page.read_text("utf-8")[:40]
    assert "<svg" in (tmp_path / "e.svg").read_text("utf-8")
    wrong = mapping.read_text("utf-8").replace("measures: effort:A\n", "measures: effort:A\n    sign: -1\n", 1)
    (tmp_path / "data" / "wrong.yaml").write_text(wrong, encoding="utf-8")
    code, shown, errors = run(
        monkeypatch, capsys, "compare", model, tmp_path / "data" / "wrong.yaml", "--out", tmp_path / "x.csv"
    )
    assert code == 1
    assert "does not agree within U" in errors
    assert (tmp_path / "x.csv").exists()


def test_wrong_options_are_told_before_anything_is_read(tmp_path, monkeypatch, capsys):
    model = EXAMPLES / "toleranced-fourbar.yaml"
    for options, words in (
        (("--report", "r.pdf"), "a report is HTML"),
        (("--kind", "polar"), "there is no figure 'polar'"),
        (("--out", "x.doc"), "cannot write a result as '.doc'"),
    ):
        code, _, errors = run(monkeypatch, capsys, "compare", model, tmp_path / "none.yaml", *options)
        assert code == 2
        assert words in errors
