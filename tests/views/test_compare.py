"""Figures, tables and the report of a comparison; the verb, from files of the virtual rig."""

import hashlib
import json
import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from test_report import Page

import trunnion
from drawn import labels, outside, texts
from rig_measurements import measured, rocker
from trunnion.results.tables.studies import COMPARISON as TABLES
from trunnion.rig.reading.measurement import Measurement
from trunnion.views import draw
from trunnion.views.charts import Plot
from trunnion.views.compare import course, efficiencies, report
from trunnion.views.shown import plot as figure

POWERS = ("torque", "speed", "brake", "out")
FRICTION = "joint_defaults.friction.coefficient"


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
        rough = [replace(one, values={FRICTION: told}) for one, told in zip(found, (0.1, 0.2, 40.0), strict=True)]
        return trunnion.rig.compare(rocker(), Measurement("bench", tuple(rough)))
    return trunnion.rig.compare(rocker(), of[name]())


NAMES = ("family", "one curve", "nothing varied", "many", "one turn", "one position", "motion only", "wrong", "locked")


@pytest.mark.spread(4)
@pytest.mark.parametrize("name", NAMES)
def test_every_figure_is_drawn_with_all_texts_in_it(name):
    assert outside(figure(case(name))) == []


def test_a_model_without_an_answer_is_a_gap_with_its_cause():
    axes = figure(case("locked")).axes[0]
    assert any("model: locked" in text for text in texts(axes))
    assert np.isnan(axes.lines[0].get_ydata()).sum() == 1


def test_courses_have_band_model_and_residual():
    above, below = figure(case("wrong"), "overlay", channel="torque").axes
    assert labels(above) == ["±U (95\u00a0%)", "measured", "model"]
    assert "offset only" in below.get_title(loc="right")
    residual = below.lines[1].get_ydata() if len(below.lines) > 1 else below.lines[0].get_ydata()
    assert np.nanmedian(residual) == pytest.approx(1.0, abs=0.05) or np.nanmedian(residual) == 0
    assert below.get_xlabel() == "drive angle A [°]"


def test_difference_of_efficiencies_is_measured_less_model():
    """A reading of the drive torque that is too large makes the measured efficiency too small."""
    result = case("wrong")
    measured_, _, model, difference = (float(cell.replace("−", "-")) for cell in efficiencies(result)[0].rows[0][1:5])
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
    drawn = draw.figure(result, Plot("", [course(result, 0, 3, 62)]))  # as in a report
    assert str(result["condition"].values[3]) in drawn.subfigs[0].get_suptitle()


@pytest.mark.spread(1)
@pytest.mark.parametrize("name", ["wrong", "one turn", "one position", "motion only"])
def test_every_result_makes_a_page_that_fetches_and_runs_nothing(name):
    text = report(case(name))
    page = Page(text)
    assert not page.open
    assert not re.search(r"https?://", text)
    assert "<script" not in text
    for _, attrs in page.tags:
        assert attrs.get("src", "data:").startswith("data:")
        assert not [one for one in attrs if one.startswith("on") or one == "style"]


def test_files_at_hand_are_hashed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "run-1.csv").write_bytes(b"t,T\n")
    found = json.loads(trunnion.rig.compare(rocker(), measured()).attrs["data_files"])
    assert found == [{"file": "run-1.csv", "bytes": 4, "sha256": hashlib.sha256(b"t,T\n").hexdigest()}]


def test_names_are_text():
    found = measured(channels=("out",))
    odd = tuple(replace(one, name="</style><script>alert(1)</script> $x$") for one in found.conditions)
    text = report(trunnion.rig.compare(rocker(), replace(found, name="<b>曲柄</b>", conditions=odd)))
    assert "<script" not in text
    assert "<b>曲柄</b>" in " ".join(Page(text).words)
