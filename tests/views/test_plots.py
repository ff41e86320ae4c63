"""Figures over the drive: every kind of result, its numbers, units, gaps, places, peaks, locking; written whole."""

from xml.etree import ElementTree

import numpy as np
import pytest
from stand_in import four_bar, slider

import trunnion
from drawn import line
from mechanisms_parts import example, joined
from trunnion.cycle.locking_course import LockingState
from trunnion.errors import MechanismError, Status
from trunnion.views.axis import abscissa
from trunnion.views.cycle import PLOTS, READY, mechanism
from trunnion.views.draw import save
from trunnion.views.shown import plot

PLAIN = [name for name in PLOTS if name not in READY]  # of results without errors


@pytest.mark.spread(1)
@pytest.mark.sample(9)
@pytest.mark.parametrize("name", PLAIN)
def test_every_figure_of_every_result(name, case, tmp_path):
    kind, result = case
    if (name, kind) == ("mechanism", "nowhere"):
        with pytest.raises(MechanismError, match="nothing to draw"):
            plot(result, name)
        return
    figure = plot(result, name)
    assert save(figure, tmp_path / "figure.png").stat().st_size > 5_000
    figure.set_layout_engine("none")  # it is arranged by now
    root = ElementTree.parse(save(figure, tmp_path / "figure.svg")).getroot()
    assert root.tag.endswith("svg")
    links = [value for element in root.iter() for key, value in element.attrib.items() if key.endswith("href")]
    assert all(link.startswith("#") for link in links)  # nothing is fetched


def _texts(figure):
    return [text.get_text() for axes in figure.axes for text in [*axes.texts, axes.xaxis.label, axes.yaxis.label]]


def _curve(figure, label, panel=0):
    return next(line for line in figure.axes[panel].lines if line.get_label() == label).get_xydata()


def test_torque_is_that_of_the_result_in_kilonewton_metres_and_closes_the_turn(plain, ideal):
    figure = plot(plain, "torque", ideal=ideal)
    drawn = _curve(figure, "with friction")
    assert drawn[:-1, 1] == pytest.approx(plain.drive_effort.values[0] / 1000)
    assert (drawn[-1] == (pytest.approx(360.0), pytest.approx(drawn[0, 1]))).all()
    assert {"torque A [kN m]", "drive angle A [°]"} <= set(_texts(figure))
    assert _curve(figure, "without friction")[:-1, 1] == pytest.approx(ideal.drive_effort.values[0] / 1000)


def test_what_locks_at_every_position_is_drawn_as_it_is_without_friction():
    mechanism = example("pezzuti-cardan-10mm")
    locked, ideal = trunnion.analyse(mechanism, 12), trunnion.analyse(mechanism.with_friction("off"), 12)
    panels = plot(locked, "reactions", ideal=ideal).axes
    labels = [[curve.get_label() for curve in axes.lines] for axes in panels]
    assert [panel.count("without friction") for panel in labels] == [1, 1, 1]  # force, moment, load on an end


def test_the_range_of_an_effort_where_friction_rests_is_drawn():
    result = slider()
    peak = float(np.abs(result["drive_effort"]).max())
    result["drive_effort_lower"] -= 0.4 * peak
    result["drive_effort_upper"] += 0.6 * peak
    (bars,) = plot(result, "torque").axes[0].containers
    assert bars.get_label() == "range, friction at rest"
    ends = np.array([segment[:, 1] for segment in bars[2][0].get_segments()])
    expected = np.transpose([result[f"drive_effort_{end}"].values[0] for end in ("lower", "upper")])
    assert ends * 1e3 == pytest.approx(expected)  # kN


def test_a_gap_breaks_the_curve_and_names_its_cause():
    figure = plot(four_bar(gap=(132, 229, Status.NOT_ASSEMBLED)), "torque")
    drawn = _curve(figure, "torque")
    assert np.isnan(drawn[132:229, 1]).all()
    assert np.isfinite(drawn[131, 1])
    assert "cannot be assembled" in _texts(figure)


def test_friction_power_adds_up(plain):
    figure = plot(plain, "friction-power")
    lines = {line.get_label().split(",")[0]: line.get_ydata() for line in figure.axes[0].lines}
    assert sum(lines[joint] for joint in "ABCD") == pytest.approx(lines["all joints"])


def test_a_position_without_an_answer_says_so():
    figure = mechanism(four_bar(gap=(10, 20, Status.LOCKED)), index=12)
    assert "locked by friction" in figure.axes[0].get_title(loc="left")


def test_a_drive_turning_backwards_closes_too(plain):
    back = plain.assign_coords(drive=-plain.drive)
    back.drive.attrs = plain.drive.attrs
    assert abscissa(back).period == pytest.approx(-360.0)


def test_a_stroke_a_maximum_and_a_minimum_are_one_course_with_their_figures():
    data = example("slider-crank").data()
    of = {"stroke": "peak-to-peak", "far": "maximum", "near": "minimum"}
    data["measures"] = {name: {"slide": "S", "as": rule} for name, rule in of.items()} | {"swing": {"angle": "rod"}}
    result = trunnion.analyse(trunnion.Mechanism(**data), 36)
    slide, angle = plot(result, "measures").axes
    assert slide.get_ylabel() == "slide of S [mm]"
    assert angle.get_ylabel() == "swing [°]"
    assert line(slide, "slide of S").get_ydata()[:-1] == pytest.approx(1e3 * result["measure_value"].values[0])
    levels = {line.get_label(): line.get_ydata()[0] for line in slide.lines if ": " in str(line.get_label())}
    assert levels["far: maximum 165.0\u00a0mm"] == pytest.approx(165.0)
    assert levels["near: minimum 95.00\u00a0mm"] == pytest.approx(95.0)
    assert np.isnan(levels["stroke: peak to peak 70.00\u00a0mm"])


def test_a_shaft_that_turns_fully_ends_a_turn_further():
    figure = plot(four_bar(72), "motion")
    crank = line(figure.axes[0], "crank").get_xydata()
    assert crank[-1] - crank[0] == pytest.approx([360.0, 360.0])
    rocker = line(figure.axes[0], "rocker").get_xydata()
    assert rocker[-1] - rocker[0] == pytest.approx([360.0, 0.0])


STEPS = 24
HOIST = {
    "trunnion": 1,
    "links": {"ground": {"points": {"A": [0, 0]}}, "crank": {"points": {"A": [0, 0], "P": [0.02, 0]}}},
    "joints": joined("ground -A- crank", A={"pin": {"radius": 0.012}, "friction": 0.5}),
    "drivers": {"A": {"speed": 1.0, "range": [0.0, 2.5]}},
    "loads": {"weight": {"link": "crank", "at": "P", "force": [0.0, -100.0], "useful": True}},
}


@pytest.fixture(scope="module")
def press():
    return example("drawing-press")


def test_margin_and_multiples_are_drawn_as_computed(press):
    found = trunnion.locking(press, STEPS)
    upper, lower = plot(found, "locking").axes
    lines = {line.get_label(): line for line in upper.lines}
    margin = found["locking_margin"].values
    drawn = np.asarray(lines["locking margin, all friction"].get_ydata(), float)
    assert drawn == pytest.approx(np.where(np.isfinite(margin), margin, np.nan), nan_ok=True)
    alone = found["critical_multiple"].sel(joint="B").values
    shown = np.asarray(lines["B alone"].get_ydata(), float)
    assert shown[np.isfinite(shown)] == pytest.approx(alone[np.isfinite(alone)])
    assert lower.get_legend_handles_labels()[1][0] == "forward"
    ahead = np.asarray(lower.lines[1].get_ydata(), float)
    assert ahead == pytest.approx(100 * found["efficiency_instant"].values)


def test_colours_change_where_the_state_does_and_the_drive_effort_its_sign():
    """Ends of the shaded ranges are those found between the positions."""
    upper = plot(trunnion.locking(trunnion.Mechanism.model_validate(HOIST), STEPS), "locking").axes[0]
    spans = {patch.get_label(): patch for patch in upper.patches}
    limit = np.degrees(np.arccos(0.3))
    held = spans[LockingState.SELF_LOCKING_FORWARD.text]
    assert (held.get_x(), held.get_x() + held.get_width()) == pytest.approx((90, 180 - limit), abs=0.01)
    (line,) = [line for line in upper.lines if line.get_label() == "drive effort changes sign"]
    assert line.get_xdata()[0] == pytest.approx(180 - limit, abs=0.01)
    assert len({patch.get_facecolor() for patch in upper.patches}) == 4


def test_the_mechanism_is_drawn_at_a_place(press):
    cycle = trunnion.analyse(press, STEPS)
    place = cycle["drive"].values[12]
    drawn = plot(cycle, "mechanism", at=float(place) / 1000)  # a plain number is SI
    assert f"{place:.4g} mm" in drawn.axes[0].get_title(loc="left")
    turning = trunnion.analyse(example("durango-fourbar"), 36)
    assert "= 350°" in plot(turning, "mechanism", at="-10 deg").axes[0].get_title(loc="left")
