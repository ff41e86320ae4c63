"""Report and figures of a motion in time: events, what came in and what is left, joints in play, spectra."""

import functools
import json
import math
from functools import cache

import matplotlib.pyplot as plt
import numpy as np
import pytest
from test_report import Page
from test_scene import NODE, run

import trunnion
from mechanisms import four_bar
from playing import rattling
from playing_space import rattling_in_space
from timed import slider_crank, three_posts, wheel
from trunnion import analyse, simulate
from trunnion.dynamics.result import spectrum
from trunnion.errors import MechanismError
from trunnion.model.mechanism import Mechanism
from trunnion.results.tables import columns
from trunnion.views.motion import KINDS, OF_CONTACTS, shown
from trunnion.views.report import motion_scene, report
from trunnion.views.scene import scene
from trunnion.views.shown import plot

FREE = {"O": {"speed": 100, "free": True, "initial": {"speed": 60}}}


@cache
def start():
    return simulate(slider_crank(), 0.5, 100)


@cache
def run_down():
    return simulate(slider_crank(drivers=FREE), 2.0, 80)


@cache
def stays():
    return simulate(wheel({"kind": "constant", "effort": 0.5}), 1.0, 10)


@cache
def swing():
    """Without friction and motor: rounding is all that the effort is."""
    return simulate(three_posts(), 1.0, 50)


@cache
def ends_early():
    return simulate(wheel({"kind": "constant", "effort": 4}, range=[-1, 2]), 1.0, 40)


CASES = {
    "start": start, "run-down": run_down, "stays": stays, "swing": swing, "ends early": ends_early,
}  # fmt: skip
EVENTS = {
    "start": [("starts", "forward")], "run-down": [("rests", "")], "stays": [("rests", "")],
    "swing": [("change point", "")],
    "ends early": [("starts", "forward"), ("ends", "")],
}  # fmt: skip


@pytest.fixture(scope="module", params=CASES)
def motion(request):
    return request.param, CASES[request.param]()


@pytest.mark.spread(0, "stays", "ends early")
def test_the_page_is_well_formed_and_speaks_of_time(motion):
    name, result = motion
    page = Page(report(result))
    assert not page.open
    words = " ".join(" ".join(page.words).split())
    for other in ("position", "twelfth", "crank at", "comparison", "did not converge"):
        assert other not in words.replace("work of the", ""), other
    assert "Motion in time" in words
    scene = page.scene()
    assert (scene["abscissa"]["label"], scene["abscissa"]["closed"]) == ("time", False)
    times = [attrs["data-time"] for _, attrs in page.tags if "data-time" in attrs]
    events = shown(result).events
    assert [(one.word, one.figure) for one in events] == EVENTS[name]
    assert [float(time) for time in times] == pytest.approx([one.time for one in events], rel=1e-8, abs=1e-12)


@pytest.mark.spread(0, "ends early")
def test_speeds_and_energies_are_those_of_the_result(motion):
    _, result = motion
    scene = motion_scene(shown(result))
    (free,) = scene["motion"]["free"]
    count = scene["count"]
    known = result["drive_rate"].values[0]
    assert count == np.count_nonzero(np.isfinite(known))
    assert _full(free["rate"], count) == pytest.approx(known[:count], rel=1e-6)
    for one in scene["motion"]["energies"]:
        assert max(abs(value) for value in one["values"]) > 1e-9 * float(np.nanmax(result["kinetic_energy"]))
    assert len(json.dumps(scene, allow_nan=False)) < 1_500_000


def test_a_motion_that_ends_early_is_shown_to_its_end():
    result = ends_early()
    motion = shown(result)
    # 3.4 N m on 0.05 kg m² over 3 rad
    assert motion.end == pytest.approx(math.sqrt(2 * 3 * 0.05 / 3.4), rel=1e-8)
    assert motion.events[-1].time == pytest.approx(motion.end, rel=1e-12)
    assert motion.early
    assert np.isfinite(motion.rows["drive_rate"].values).all()
    assert "then the motion ends" in " ".join(Page(report(result)).words)


def test_the_speed_over_a_cycle_is_drawn_where_it_varies():
    """Cycloidal: (φ/T) (1 − cos 2π t/T)."""
    data = four_bar()
    law = {"law": "cycloidal", "range": [0.3, 1.2], "duration": 2.0, "returns": False}
    result = analyse(Mechanism(**{**data, "drivers": {"A": law}}), 20)
    wanted = 0.45 * (1 - np.cos(np.pi * result["time"].values))
    (line,) = (one for one in plot(result, "speed").axes[0].lines if len(one.get_ydata()) == 20)
    assert line.get_ydata() == pytest.approx(wanted, abs=1e-12)
    assert scene(result)["drivers"][0]["speed"] == pytest.approx(wanted, abs=1e-6)
    even = analyse(Mechanism(**data), 12)
    assert scene(even)["drivers"][0]["speed"] == []
    with pytest.raises(MechanismError, match="the speed of no driver varies"):
        plot(even, "speed")


@pytest.mark.sample(6)
@pytest.mark.spread(0, "ends early-sheet", "ends early-phase", "stays-energy")
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in OF_CONTACTS])
def test_every_figure_bears_every_motion(motion, kind):
    name, result = motion
    drawn = plot(result, kind)
    drawn.canvas.draw()
    for axes in drawn.axes if kind != "phase" else ():
        labels = [text.get_text() for text in axes.get_legend().get_texts()] if axes.get_legend() else []
        assert {word for word, _ in EVENTS[name]} <= set(labels)
    if kind != "phase":
        end = shown(result).end
        low, high = drawn.axes[-1].get_xlim()
        unit = 1e3 if "[ms]" in drawn.axes[-1].get_xlabel() else 1.0
        assert (low, high) == (pytest.approx(0.0), pytest.approx(end * unit, rel=0.08))
    plt.close(drawn)


if NODE:

    def page(result, folder):
        path = folder / "scene.json"
        path.write_text(json.dumps(motion_scene(shown(result))), encoding="utf-8")
        return json.loads(run("page.test.mjs", path))

    @pytest.mark.spread(0, "ends early")
    def test_the_page_draws_it(motion, tmp_path):
        name, result = motion
        told = page(result, tmp_path)["motion"]
        ends = "Larger load on an end of bearing or guide"
        wanted = {
            "start": ["Speed", "Drive torque O", "Works and energies", "Joint reactions, magnitude", ends,
                      "Friction power by joint", "Power", "Slide of joints"],
            "run-down": ["Speed", "Works and energies", "Joint reactions, magnitude", ends, "Friction power by joint",
                         "Power", "Slide of joints"],
            "stays": ["Speed", "Drive torque A", "Joint reactions, magnitude"],
            "swing": ["Speed", "Works and energies", "Joint reactions, magnitude"],
            "ends early": ["Speed", "Drive torque A", "Works and energies", "Joint reactions, magnitude", "Power"],
        }[name]  # fmt: skip
        assert told["titles"] == wanted
        assert told["marks"] == len(wanted) * len(EVENTS[name])
        assert told["axes"] == ["time"]
        end, rows = shown(result).end, motion_scene(shown(result))["count"]
        assert told["clicked"] == [pytest.approx(one.time / end * (rows - 1), abs=1) for one in shown(result).events]

    @pytest.mark.slow
    def test_it_is_played_in_real_time_and_stops_at_its_end(tmp_path):
        told = page(run_down(), tmp_path)["motion"]
        assert told["speed"] == "real time"
        assert told["played"]["half"] == pytest.approx(told["last"] / 2, abs=1)  # after half its time
        assert told["played"]["after"] == told["last"]
        assert not told["played"]["playing"]
        assert told["played"]["again"] == 0


def _full(series, count):
    return series * count if len(series) == 1 else series


@functools.cache
def rattled():
    return trunnion.simulate(rattling(), duration=7e-4, steps=700)


def test_the_path_of_the_pin_lies_in_its_hole():
    (axes,) = plot(rattled(), "orbit").axes
    (wall,), path = axes.patches, {len(line.get_xdata()): line for line in axes.lines}[701]
    assert wall.get_radius() == pytest.approx(500.0)  # µm
    assert np.nanmax(np.hypot(*path.get_data())) == pytest.approx(500 + 77.9, abs=0.3)
    assert "45.8" in axes.get_title(loc="left")


def test_each_end_of_a_pin_in_space_has_its_hole():
    result = trunnion.simulate(rattling_in_space(), duration=3e-4, steps=100)
    panels = plot(result, "orbit").axes
    assert [axes.get_title(loc="left").partition(":")[0] for axes in panels] == ["Q.end_1", "Q.end_2"]
    for axes in panels:
        path = next(line for line in axes.lines if len(line.get_xdata()) == 101)
        assert np.nanmax(np.hypot(*path.get_data())) == pytest.approx(500 + 77.9, abs=0.5)
    named = [name for name, *_ in columns(result) if "offset" in name]
    assert named[:3] == [f"Q.end_1.contact_offset.{axis}" for axis in "xyz"]
    assert len(named) == 3 * 4


@pytest.mark.slow
def test_the_report_has_force_gap_and_orbit():
    page = Page(report(rattled()))
    assert not page.open
    (contact,) = page.scene()["motion"]["contacts"]
    assert contact["name"] == "Q"
    assert max(contact["force"]) == pytest.approx(float(rattled()["contact_normal_force"].max()), rel=1e-6)
    assert contact["gap"] == pytest.approx(rattled()["contact_gap"].values[0], rel=1e-6)
    pictures = [attrs["alt"] for tag, attrs in page.tags if tag == "img"]
    assert len(pictures) == 1
    assert "holes" in pictures[0]


def test_columns_of_contacts_and_impacts():
    times = {name: (unit, values) for name, unit, values in columns(rattled())}
    assert times["Q.contact_gap"][0] == "m"
    assert times["Q.contact_gap"][1][0] == pytest.approx(5e-4)
    assert times["Q.contact_offset.x"][1][0] == pytest.approx(0.0, abs=1e-15)
    assert {"work_contact", "contact_energy", "Q.reaction_x"} <= times.keys()
    impacts = {name: (unit, values) for name, unit, values in columns(rattled(), "impacts")}
    assert list(impacts["contact"][1]) == ["Q", "Q"]
    assert impacts["approach"][0] == "m/s"
    assert impacts["approach"][1][0] == pytest.approx(4.38578315, rel=1e-8)


def test_the_spectrum_of_harmonics_is_theirs():
    """Hann's window: a constant, and amplitudes on frequencies, each with half of it beside; Parseval's equation."""
    count, step = 400, 1e-3
    time = step * np.arange(count)
    forces = 7.0 + 3.0 * np.cos(2 * np.pi * 50 * time + 0.4) + 0.5 * np.sin(2 * np.pi * 180 * time)
    frequency, amplitude = spectrum(time, forces)
    assert frequency[[1, -1]] == pytest.approx([2.5, 500])
    at = {place: k for k, place in enumerate(np.round(frequency, 6))}
    assert amplitude[[at[0.0], at[50.0], at[180.0]]] == pytest.approx([7.0, 3.0, 0.5], rel=1e-12)
    assert amplitude[[at[47.5], at[52.5]]] == pytest.approx([1.5, 1.5], rel=1e-12)
    assert amplitude[at[100.0]] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("last", [700, 701])
def test_the_spectrum_holds_the_square_of_the_force(last):
    """Parseval: Σ (w F)²/(Σw)² N is the sum of the squares of the two-sided amplitudes, for even and odd numbers."""
    time, force = rattled()["time"].values[:last], rattled()["contact_normal_force"].values[:, :last]
    window = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(last) / last)
    _, amplitude = spectrum(time, force)
    ends = amplitude[0, 0] ** 2 + (amplitude[0, -1] ** 2 if last % 2 == 0 else 0.0)
    inner = np.sum(amplitude[0, 1 : -1 if last % 2 == 0 else None] ** 2) / 2
    assert ends + inner == pytest.approx(last * np.sum((window * force[0]) ** 2) / np.sum(window) ** 2, rel=1e-12)
    assert rattled()["contact_force_amplitude"].shape == (1, rattled().sizes["frequency"])
