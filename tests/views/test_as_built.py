"""Figures of errors and seats: numbers, units, magnification, gaps, loss of contact; none without what they need."""

from __future__ import annotations

import numpy as np
import pytest
from as_built_models import EXAMPLES, four_bar, four_bar_model, loaded
from matplotlib.collections import LineCollection
from matplotlib.patches import Circle

import trunnion
from trunnion.errors import MechanismError, Status
from trunnion.views.cycle import plots
from trunnion.views.cycle.deviations import broken, continued, losses, seated, with_worst_case
from trunnion.views.cycle.plots import READY, drawable, save
from trunnion.views.cycle.seats import PIN
from trunnion.views.sweep import figure as sweep_figure
from trunnion.views.sweep import tables


@pytest.fixture(scope="module")
def slider():
    return loaded("toleranced-slider-crank")


@pytest.fixture(scope="module")
def cardan():
    return loaded("pezzuti-cardan")


@pytest.fixture(scope="module")
def balls():
    return loaded("rssr", 36, **{"B.pin.clearance": "0.05 mm", "C.pin.clearance": "0.05 mm"})


def _label(axes, name):
    return next(line for line in axes.lines if line.get_label() == name)


@pytest.mark.slow
@pytest.mark.parametrize("which", ["slider", "cardan", "balls"])
def test_every_figure_is_drawn(which, request, tmp_path):
    result = request.getfixturevalue(which)
    kinds = drawable(result)
    assert ("beta" in kinds) == (which != "balls")
    assert {"error", "seat"} <= set(kinds)
    for name in READY.keys() & set(kinds):
        assert save(plots.figure(result, name), tmp_path / f"{name}.svg").stat().st_size > 10_000


@pytest.mark.slow
def test_errors_are_those_of_the_result(slider):
    figure = plots.figure(slider, "error")
    place, slide = figure.axes
    size = np.linalg.norm(slider.point_error.sel(point="piston.Q").values, axis=0)
    assert _label(place, "piston.Q").get_ydata()[:-1] == pytest.approx(1e6 * size)
    assert place.get_ylabel() == "position error [µm]"
    wrong = slider.joint_slide_error.sel(joint="S").values
    assert _label(slide, "S").get_ydata()[:-1] == pytest.approx(1e6 * wrong)
    assert "slide [µm]" in slide.get_ylabel()
    dotted = [line for line in place.lines if str(line.get_linestyle()) == "--" and len(line.get_xdata()) == 2]
    assert len(dotted) >= len(np.unique(np.concatenate(list(losses(slider).values()))))
    assert "contact lost: S" in [text.get_text() for text in place.get_legend().get_texts()]


def test_the_transmission_error_of_a_four_bar_is_in_minutes_of_arc_with_its_worst_case():
    """One pin with 0.02 mm: at 60° of crank angle the output errs by at most 0.017902°."""
    result = with_worst_case(four_bar(), four_bar_model())
    wrong = result.joint_rotation_error.sel(joint="D").values
    axes = plots.figure(result, "error").axes[1]
    assert "rotation [°]" in axes.get_ylabel()
    assert _label(axes, "D").get_ydata()[:-1] == pytest.approx(np.degrees(wrong))
    (band,) = [one for one in axes.collections if one.get_label() == "worst case of the play, first order"]
    x, y = band.get_paths()[0].vertices.T
    at = y[np.isclose(x, 60.0)]
    assert [at.min(), at.max()] == pytest.approx([-0.017902, 0.017902], rel=1e-4)
    assert abs(wrong[12]) <= np.radians(0.017902)


def test_the_band_lies_about_the_error_of_the_dimensions():
    """A crank 0.1 mm too long: without play it errs by the middle of the band, with any seat it stays inside."""
    result = with_worst_case(four_bar(AB="0.1 mm"), four_bar_model(AB="0.1 mm"))
    centre, reach = (result[f"transmission_{name}"].sel(joint="D").values for name in ("centre", "reach"))
    free = trunnion.analyse(four_bar_model(AB="0.1 mm").with_values({"B.pin.clearance": 0}), 72)
    assert centre == pytest.approx(free.joint_rotation_error.sel(joint="D").values, abs=1e-12)
    assert (np.abs(result.joint_rotation_error.sel(joint="D").values - centre) <= reach * (1 + 1e-3)).all()
    assert np.isnan(result["transmission_centre"].sel(joint="B")).all()


@pytest.mark.slow
def test_positions_without_an_answer_are_gaps(slider, tmp_path):
    blank = slider.copy(deep=True)
    hole = np.arange(blank.sizes["position"]) // 10 == 2
    for name in ("point_error", "joint_slide_error", "seat_offset", "seat_xi", "seat_beta", "end_force"):
        blank[name] = blank[name].where(~np.asarray(hole))
    blank["status"] = ("position", np.where(hole, int(Status.LOCKED), 0).astype(np.int8))
    drawn = _label(plots.figure(blank, "error").axes[0], "piston.Q").get_ydata()
    assert np.isnan(drawn[20:30]).all()
    assert np.isfinite(drawn[[19, 30]]).all()
    save(plots.figure(blank, "seat"), tmp_path / "seat.png")
    curve = _label(plots.figure(blank, "beta").axes[0], "Q")
    inside = (curve.get_xdata() > 100) & (curve.get_xdata() < 145)
    assert np.isnan(curve.get_ydata()[inside]).all()
    everywhere = blank.assign(seat_offset=blank["seat_offset"] * np.nan)
    assert "seat" not in drawable(everywhere)
    with pytest.raises(MechanismError, match="no position is solved"):
        plots.figure(everywhere, "seat")


# ---- seats ----------------------------------------------------------------------------------------------------


def _drawn(figure):
    """Diagrams by title."""
    return {axes.get_title(loc="left"): axes for axes in figure.axes if axes.get_title(loc="left")}


@pytest.mark.slow
def test_ends_stand_side_by_side_and_their_pins_touch_the_wall(cardan):
    diagrams = _drawn(plots.figure(cardan, "seat"))
    assert list(diagrams) == [
        f"{joint}, end {end}" for joint in ("input", "pin-1", "pin-2", "output") for end in (1, 2)
    ]
    for name, axes in diagrams.items():
        assert axes.get_xlabel().startswith("x [µm]\npin of ")
        circles = [patch for patch in axes.patches if isinstance(patch, Circle)]
        hole = next(one for one in circles if one.get_radius() == pytest.approx((1 + PIN) * 10))
        for pin in (one for one in circles if one.get_radius() == pytest.approx(PIN * 10)):
            assert np.hypot(*pin.center) + pin.get_radius() == pytest.approx(hole.get_radius(), rel=1e-4), name


def test_the_locus_has_the_offsets_and_no_jump(slider):
    axes = _drawn(plots.figure(slider, "seat"))["Q"]
    loci = [one for one in axes.collections if isinstance(one, LineCollection)]
    offset = 1e6 * slider.seat_offset.sel(joint="Q", end="1").transpose("position", "axis").values
    pieces = [piece for locus in loci for piece in locus.get_segments()]
    drawn = np.concatenate(pieces)
    assert all(np.min(np.linalg.norm(offset - place, axis=1)) < 1e-9 for place in drawn)
    assert max(np.linalg.norm(np.diff(piece, axis=0)) for piece in pieces) < 20


def test_a_seat_that_is_given_is_drawn_where_it_is():
    result = four_bar()
    (one,) = seated(result)
    assert (one.joint, one.kind, one.clearance, one.links) == ("B", "pin", pytest.approx(2e-5), ("crank", "coupler"))
    axes = plots.figure(result, "beta").axes
    assert len(axes) == 1  # no β in the plane
    assert axes[0].lines[1].get_ydata() == pytest.approx(30.0)


# ---- β and ξ --------------------------------------------------------------------------------------------------


def test_no_line_crosses_a_jump_and_losses_are_marked(slider, cardan):
    for result, jump in ((slider, 60.0), (cardan, 60.0)):
        figure = plots.figure(result, "beta")
        for axes in figure.axes:
            if "[°]" not in axes.get_ylabel():
                continue
            for joint in result.joint.values:
                for line in (one for one in axes.lines if one.get_label() == joint):
                    step = np.abs(np.diff(line.get_ydata()))
                    assert np.nanmax(step, initial=0.0) < jump
    marks = _label(plots.figure(slider, "beta").axes[1], "contact lost").get_xdata()
    assert sorted(marks) == pytest.approx(sorted(5.0 * np.repeat(losses(slider)["S"], 1)))


def test_the_seam_of_the_description_is_no_jump():
    """A pin whose ends lie opposite each other: β goes through π and ξ turns by half a turn, the seat hardly moves."""
    true = np.pi + 0.1 * np.sin(np.linspace(0, 6, 50))
    wrapped = np.where(true > np.pi, true - 2 * np.pi, true)
    xi = np.where(true > np.pi, 0.3 - np.pi + 2 * np.pi, 0.3)
    beta, direction = continued(wrapped, xi)
    assert beta == pytest.approx(true)
    assert direction == pytest.approx(np.full(50, 0.3))
    hole = continued(np.array([np.nan, 3.1, -3.1]), np.array([np.nan, 0.0, np.pi]))
    assert np.isnan(hole[0][0])
    assert hole[0][1:] == pytest.approx([3.1, 2 * np.pi - 3.1])


def test_a_jump_is_a_step_far_above_its_neighbours():
    x = np.arange(8.0)
    steady = np.array([0.0, 20, 40, 60, 80, 100, 120, 140])
    assert not np.isnan(broken(x, steady, 60.0)[1]).any()
    small = np.array([0.0, 1, 2, 30, 31, 32, 33, 34])
    cut_x, cut_y = broken(x, small, 60.0)
    assert np.flatnonzero(np.isnan(cut_y)).tolist() == [3]
    assert cut_x[3] == 2.5
    halfway = np.array([0.0, 1, 2, 20, 40, 41, 42, 43])  # a jump that a position without contact lies inside of
    assert not np.isnan(broken(x, halfway, 60.0)[1]).any()
    assert np.flatnonzero(np.isnan(broken(x, halfway, 60.0, np.array([3]))[1])).tolist() == [3, 5]


# ---- sweeps ---------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_sweep_is_drawn_beside_the_ideal_mechanism(slider, tmp_path):
    mechanism = trunnion.Mechanism.read(EXAMPLES / "pezzuti-cardan-as-built.yaml")
    swept = trunnion.sweep(mechanism, {"misalignment": ["0 deg", "20 deg"]}, 18)
    axes = sweep_figure(swept).axes[0]
    built, ideal = (_label(axes, name).get_ydata() for name in ("as built", "ideal"))
    assert built == pytest.approx(swept["efficiency"].values)
    assert ideal == pytest.approx(swept["efficiency_ideal"].values)
    lost = swept["status"].values == Status.CONTACT_LOST
    told = [text.get_text() for text in axes.get_legend().get_texts()]
    assert ("contact lost at some position" in told) == lost.any()
    table = tables(swept)[0]
    assert table.head[:3] == ["misalignment [deg]", "efficiency", "efficiency ideal"]
    assert ([row[-1] == "contact lost" for row in table.rows] == lost).all()
    save(sweep_figure(swept, "output.transmission_error_max"), tmp_path / "error.png")
    free = trunnion.sweep(mechanism.with_values({"joint_defaults.friction.coefficient": 0.1}),
                          {"misalignment": ["10 deg", "20 deg"], "input.speed": [10, 100]}, 12)  # fmt: skip
    assert "ideal, dashed" in [text.get_text() for text in sweep_figure(free).axes[0].get_legend().get_texts()]
