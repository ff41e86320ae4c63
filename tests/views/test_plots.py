"""Every figure bears every kind of result, says what it shows, and is written whole or not at all."""

from __future__ import annotations

import json
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.figure import Figure
from stand_in import four_bar, slider

from trunnion.errors import MechanismError, Status
from trunnion.views.cycle import plots
from trunnion.views.cycle.plots import PLOTS, READY, mechanism, save

PLAIN = [name for name in PLOTS if name not in READY]  # of results without errors
SIGNATURES = {".png": b"\x89PNG", ".pdf": b"%PDF", ".svg": b"<?xml"}


@pytest.mark.sample(9)
@pytest.mark.spread(3)
@pytest.mark.parametrize("name", PLAIN)
def test_every_figure_of_every_result(name, case, tmp_path):
    kind, result = case
    if (name, kind) == ("mechanism", "nowhere"):
        with pytest.raises(MechanismError, match="nothing to draw"):
            plots.figure(result, name)
        return
    figure = plots.figure(result, name)
    assert save(figure, tmp_path / "figure.png").stat().st_size > 5_000
    figure.set_layout_engine("none")  # it is arranged by now
    root = ElementTree.parse(save(figure, tmp_path / "figure.svg")).getroot()
    assert root.tag.endswith("svg")
    links = [value for element in root.iter() for key, value in element.attrib.items() if key.endswith("href")]
    assert all(link.startswith("#") for link in links)  # nothing is fetched


@pytest.mark.parametrize("name", ["torque", "reactions"])
def test_overlaid_comparison_changes_no_limits_of_the_drive(name, plain, ideal):
    alone, both = plots.figure(plain, name), plots.figure(plain, name, ideal)
    assert isinstance(both, Figure)
    assert alone.axes[0].get_xlim() == pytest.approx(both.axes[0].get_xlim(), rel=0.05, abs=0.1)


def _texts(figure):
    return [text.get_text() for axes in figure.axes for text in [*axes.texts, axes.xaxis.label, axes.yaxis.label]]


def _curve(figure, label, panel=0):
    return next(line for line in figure.axes[panel].lines if line.get_label() == label).get_xydata()


def test_torque_is_that_of_the_result_in_kilonewton_metres_and_closes_the_turn(plain, ideal):
    figure = plots.figure(plain, "torque", ideal)
    drawn = _curve(figure, "with friction")
    assert drawn[:-1, 1] == pytest.approx(plain.drive_effort.values[0] / 1000)
    assert (drawn[-1] == (pytest.approx(360.0), pytest.approx(drawn[0, 1]))).all()
    assert {"torque A [kN m]", "drive angle A [°]"} <= set(_texts(figure))
    assert _curve(figure, "without friction")[:-1, 1] == pytest.approx(ideal.drive_effort.values[0] / 1000)


def test_a_sliding_drive_has_a_force_over_millimetres():
    figure = plots.figure(slider(), "torque")
    assert {"force S [N]", "drive slide S [mm]"} <= set(_texts(figure))


def test_the_range_of_an_effort_where_friction_rests_is_drawn():
    result = slider()
    result["drive_effort_lower"] -= 4.0
    result["drive_effort_upper"] += 6.0
    (bars,) = plots.figure(result, "torque").axes[0].containers
    assert bars.get_label() == "range, friction at rest"
    middle = result.drive_effort.values[0] + 1.0
    ends = np.array([segment[:, 1] for segment in bars[2][0].get_segments()])
    assert ends == pytest.approx(np.transpose([middle - 5.0, middle + 5.0]))


def test_a_gap_breaks_the_curve_and_names_its_cause():
    figure = plots.figure(four_bar(gap=(132, 229, Status.NOT_ASSEMBLED)), "torque")
    drawn = _curve(figure, "torque")
    assert np.isnan(drawn[132:229, 1]).all()
    assert np.isfinite(drawn[131, 1])
    assert "cannot be assembled" in _texts(figure)


def test_friction_power_adds_up(plain):
    figure = plots.figure(plain, "friction-power")
    lines = {line.get_label().split(",")[0]: line.get_ydata() for line in figure.axes[0].lines}
    assert sum(lines[joint] for joint in "ABCD") == pytest.approx(lines["all joints"])


def test_a_position_that_is_not_there_is_refused(plain):
    with pytest.raises(MechanismError, match="no position 360 among the 360 — name one from 0 to 359"):
        mechanism(plain, index=360)


def test_a_position_without_an_answer_says_so():
    figure = mechanism(four_bar(gap=(10, 20, Status.LOCKED)), index=12)
    assert "locked by friction" in figure.axes[0].get_title(loc="left")


def test_the_same_figure_gives_the_same_file(plain, tmp_path):
    first, second = (save(plots.figure(plain, "power"), tmp_path / name).read_bytes() for name in ("a.svg", "b.svg"))
    assert first == second


@pytest.mark.spread(2)
@pytest.mark.parametrize("suffix", SIGNATURES)
def test_formats(suffix, plain, tmp_path):
    path = save(plots.figure(plain, "polar"), tmp_path / f"polar{suffix}")
    assert path.read_bytes().startswith(SIGNATURES[suffix])
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_an_unknown_format_is_refused_before_anything_is_written(plain, tmp_path):
    with pytest.raises(MechanismError, match=r"\.png, \.svg, \.pdf or \.jpg"):
        save(plots.figure(plain, "torque"), tmp_path / "torque.bmp")
    assert not list(tmp_path.iterdir())


def test_a_failed_write_leaves_the_old_file_and_no_draft(plain, tmp_path, monkeypatch):
    target = tmp_path / "torque.png"
    target.write_text("old")
    figure = plots.figure(plain, "torque")
    monkeypatch.setattr(figure, "savefig", lambda *_, **__: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(MechanismError, match="disk full"):
        save(figure, target)
    assert [file.name for file in tmp_path.iterdir()] == ["torque.png"]
    assert target.read_text() == "old"


def test_a_spring_is_dotted_where_it_does_not_act() -> None:
    result = four_bar(36)
    stated = json.loads(result.attrs["scene"])
    stated["springs"] = {"S": {"between": ["ground.A", "coupler.E"], "joint": None}}
    pull = np.where(np.arange(36) < 18, 0.0, 5.0)[np.newaxis]
    result = result.assign_coords(spring=["S"]).assign(spring_force=(("spring", "position"), pull))
    result.attrs["scene"] = json.dumps(stated)
    for index, line in ((3, ":"), (20, "-")):
        coils = [one for one in mechanism(result, index=index).axes[0].lines if len(one.get_xdata()) == 20]
        assert [one.get_linestyle() for one in coils] == [line]
