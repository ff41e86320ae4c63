"""What curves over the drive show: each course once, whole turns, ripple, curves that coincide, one unit of length."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from stand_in import four_bar

import trunnion
from trunnion.views.charts import Line, over_drive
from trunnion.views.common.cycle import abscissa
from trunnion.views.common.drawing import cylinder, picture
from trunnion.views.cycle import plots
from trunnion.views.cycle.courses import turned_from_start

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def _line(axes, label):
    return next(line for line in axes.lines if line.get_label() == label)


def test_a_stroke_a_maximum_and_a_minimum_are_one_course_with_their_figures():
    data = trunnion.read(EXAMPLES / "slider-crank.yaml").data()
    data["measures"] = {
        "stroke": {"slide": "S", "as": "peak-to-peak"},
        "far": {"slide": "S", "as": "maximum"},
        "near": {"slide": "S", "as": "minimum"},
        "swing": {"angle": "rod"},
    }
    result = trunnion.analyse(trunnion.Mechanism(**data), 36)
    figure = plots.figure(result, "measures")
    slide, angle = figure.axes
    assert slide.get_ylabel() == "slide of S [mm]"
    assert angle.get_ylabel() == "swing [°]"
    assert _line(slide, "slide of S").get_ydata()[:-1] == pytest.approx(1e3 * result["measure_value"].values[0])
    levels = {line.get_label(): line.get_ydata()[0] for line in slide.lines if ": " in str(line.get_label())}
    assert levels["far: maximum 165.0\u00a0mm"] == pytest.approx(165.0)
    assert levels["near: minimum 95.00\u00a0mm"] == pytest.approx(95.0)
    assert np.isnan(levels["stroke: peak to peak 70.00\u00a0mm"])


def test_a_shaft_that_turns_fully_ends_a_turn_further():
    figure = plots.figure(four_bar(72), "motion")
    crank = _line(figure.axes[0], "crank").get_xydata()
    assert crank[-1] - crank[0] == pytest.approx([360.0, 360.0])
    rocker = _line(figure.axes[0], "rocker").get_xydata()
    assert rocker[-1] - rocker[0] == pytest.approx([360.0, 0.0])


def test_a_crank_in_space_turns_on_and_a_rocker_comes_back():
    angle = np.linspace(0.0, 4 * np.pi, 97)
    axis = np.array([0.6, 0.0, 0.8])
    turn = np.vstack([np.cos(angle / 2), axis[:, None] * np.sin(angle / 2)])
    flipped = turn * np.where(np.arange(97) % 3 == 0, -1.0, 1.0)  # q and −q are one orientation
    assert turned_from_start(flipped) == pytest.approx(angle, abs=1e-7)
    there_and_back = np.append(turn[:, :40], turn[:, 39::-1], axis=1)
    assert turned_from_start(there_and_back) == pytest.approx([*angle[:40], *angle[39::-1]], abs=1e-7)
    hole = flipped.copy()
    hole[:, 20:25] = np.nan
    assert np.isnan(turned_from_start(hole)[20:25]).all()
    assert turned_from_start(hole)[25:] == pytest.approx(angle[25:], abs=1e-7)


def test_ripple_is_seen():
    result = four_bar(72)
    over = abscissa(result)
    even = 100.0 + np.sin(np.radians(over.values))
    chart = over_drive(result, over, "torque", "N m", [Line(over.values, even, "even")])
    assert not chart.zero
    wide = over_drive(result, over, "torque", "N m", [Line(over.values, 20 * (even - 95.0), "wide")])
    assert wide.zero
    constant = over_drive(result, over, "torque", "N m", [Line(over.values, 0 * even + 5, "constant")])
    assert constant.zero


def test_curves_that_coincide_are_named_together_and_have_the_colour_of_the_first():
    result = four_bar(36)
    forces = result["reaction_force"].values
    forces[3] = -forces[2]
    figure = plots.figure(result.assign(reaction_force=(result["reaction_force"].dims, forces)), "reactions")
    labels = figure.axes[0].get_legend_handles_labels()[1]
    assert labels == ["A", "B", "C = D"]
    alone = plots.figure(result.isel(joint=[0, 1, 2]), "reactions")
    assert _line(figure.axes[0], "C = D").get_color() == _line(alone.axes[0], "C").get_color()


def test_a_cylinder_is_a_barrel_with_a_rod_in_it():
    """0.95 m shut, a stroke of 0.75 m: the barrel stays off the rod's eye, and the rod off the foot."""
    result = trunnion.analyse(trunnion.read(EXAMPLES / "inverted-slider-crank.yaml"), 24)
    shown = picture(result)
    parts = cylinder(shown, "S")
    assert (parts.barrel, parts.rod) == ("barrel.A", "rod.B")
    rod, barrel = parts.long
    apart = np.hypot(*(shown.tracks[parts.rod] - shown.tracks[parts.barrel]))
    assert [apart.min(), apart.max()] == pytest.approx([0.95, 1.70], rel=1e-6)
    assert barrel < apart.min()
    assert rod < apart.min()
    assert rod + barrel > apart.max()
    drawn = plots.figure(result, "mechanism", at="375 mm")
    ends = [line.get_xydata() for line in drawn.axes[0].lines if line.get_linewidth() == 17.0]
    foot = shown.tracks["barrel.A"][:, 0]
    assert [end[0] for end in ends] == [pytest.approx(foot)]
    press = picture(trunnion.analyse(trunnion.read(EXAMPLES / "slider-crank.yaml"), 12))
    assert cylinder(press, "S") is None  # on the ground
