"""The report and the figures of a motion in time: time everywhere, events marked, what came in and what is left."""

from __future__ import annotations

import json
import math
import re
import subprocess
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from test_browser import NODE, run
from test_report import Page

from mechanisms import four_bar
from timed import slider_crank, three_posts, wheel
from trunnion import analyse, simulate
from trunnion.errors import MechanismError
from trunnion.model.mechanism import Mechanism
from trunnion.views.cycle import plots
from trunnion.views.cycle.scene import scene
from trunnion.views.motion.figure import KINDS, OF_CONTACTS, figure
from trunnion.views.motion.report import MOST_ROWS, _account, motion_scene, report
from trunnion.views.motion.shown import shown

FREE = {"O": {"speed": 100, "free": True, "initial": {"speed": 60}}}


@cache
def start() -> xr.Dataset:
    return simulate(slider_crank(), 0.5, 100)


@cache
def run_down() -> xr.Dataset:
    return simulate(slider_crank(drivers=FREE), 2.0, 80)


@cache
def stays() -> xr.Dataset:
    return simulate(wheel({"kind": "constant", "effort": 0.5}), 1.0, 10)


@cache
def swing() -> xr.Dataset:
    """Without friction and motor: rounding is all that the effort is."""
    return simulate(three_posts(), 1.0, 50)


@cache
def ends_early() -> xr.Dataset:
    return simulate(wheel({"kind": "constant", "effort": 4}, range=[-1, 2]), 1.0, 40)


CASES: dict[str, Callable[[], xr.Dataset]] = {
    "start": start, "run-down": run_down, "stays": stays, "swing": swing, "ends early": ends_early,
}  # fmt: skip
EVENTS = {
    "start": [("starts", "forward")], "run-down": [("rests", "")], "stays": [("rests", "")],
    "swing": [("change point", "")],
    "ends early": [("starts", "forward"), ("ends", "")],
}  # fmt: skip


@pytest.fixture(scope="module", params=CASES)
def motion(request: pytest.FixtureRequest) -> tuple[str, xr.Dataset]:
    return request.param, CASES[request.param]()


@pytest.mark.spread(0, "stays", "ends early")
def test_the_page_is_well_formed_and_speaks_of_time(motion: tuple[str, xr.Dataset]) -> None:
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
def test_speeds_and_energies_are_those_of_the_result(motion: tuple[str, xr.Dataset]) -> None:
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


@pytest.mark.slow
def test_what_came_in_is_what_is_left() -> None:
    """The figures of the account add up, those of the table as those of the result."""
    page = Page(report(start()))
    lines = "Work of the drivers|Lost to friction|Change of the kinetic energy"
    rows = re.findall(rf"({lines})\s*([−\d.]+)\s(\S*J)", " ".join(page.words))
    scale = {"J": 1.0, "kJ": 1e3, "mJ": 1e-3}
    told = {label: float(text.replace("−", "-")) * scale[unit] for label, text, unit in rows}
    result = start()
    assert told["Work of the drivers"] == pytest.approx(float(result["work_drive"][-1]), rel=1e-3)
    assert told["Lost to friction"] == pytest.approx(-float(result["work_friction"][-1]), rel=1e-3)
    change = float(result["kinetic_energy"][-1] - result["kinetic_energy"][0])
    assert told["Change of the kinetic energy"] == pytest.approx(change, rel=1e-3)


def test_what_contacts_take_goes_out_and_what_they_hold_is_left() -> None:
    rows = shown(ends_early()).rows
    ramp = xr.DataArray(np.linspace(0.0, 1.0, rows.sizes["position"]), dims="position")
    told = _account(rows.assign(work_contact=2 * ramp, contact_energy=ramp))
    assert dict(told["works"])["Lost in contacts"] == "−2.000\u00a0J"
    assert dict(told["held"])["Change of the elastic energy of contacts"] == "1.000\u00a0J"


def test_a_motion_that_ends_early_is_shown_to_its_end() -> None:
    result = ends_early()
    motion = shown(result)
    # 3.4 N m on 0.05 kg m² over 3 rad
    assert motion.end == pytest.approx(math.sqrt(2 * 3 * 0.05 / 3.4), rel=1e-8)
    assert motion.events[-1].time == pytest.approx(motion.end, rel=1e-12)
    assert motion.early
    assert np.isfinite(motion.rows["drive_rate"].values).all()
    words = " ".join(Page(report(result)).words)
    assert "then the motion ends" in words


def test_many_rows_are_thinned_and_events_are_not() -> None:
    result = simulate(wheel({"kind": "constant", "effort": 4}), 1.0, 3 * MOST_ROWS)
    scene = motion_scene(shown(result))
    assert scene["count"] <= MOST_ROWS
    assert scene["thinned"] == 3 * MOST_ROWS + 1
    assert [one["word"] for one in scene["motion"]["events"]] == ["starts"]
    assert f"{scene['count']} rows shown with every peak" in " ".join(report(result).split())
    assert scene["time"][-1] == pytest.approx(1.0)


def test_thinned_rows_keep_the_peaks() -> None:
    """A force that is large in a single row is drawn in its full size."""
    result = simulate(wheel({"kind": "constant", "effort": 4}), 1.0, 3 * MOST_ROWS)
    forces = np.zeros(result["reaction_force"].shape)
    forces[0, 0, 1000] = 17.0
    scene = motion_scene(shown(result.assign(reaction_force=(result["reaction_force"].dims, forces))))
    assert max(abs(value) for value in scene["joints"][0]["reaction"]["x"]) == 17.0


def test_the_speed_over_a_cycle_is_drawn_where_it_varies() -> None:
    """Cycloidal: (φ/T) (1 − cos 2π t/T)."""
    data = four_bar()
    law = {"law": "cycloidal", "range": [0.3, 1.2], "duration": 2.0, "returns": False}
    result = analyse(Mechanism(**{**data, "drivers": {"A": law}}), 20)
    wanted = 0.45 * (1 - np.cos(np.pi * result["time"].values))
    (line,) = (one for one in plots.figure(result, "speed").axes[0].lines if len(one.get_ydata()) == 20)
    assert line.get_ydata() == pytest.approx(wanted, abs=1e-12)
    assert scene(result)["drivers"][0]["speed"] == pytest.approx(wanted, abs=1e-6)
    even = analyse(Mechanism(**data), 12)
    assert scene(even)["drivers"][0]["speed"] == []
    with pytest.raises(MechanismError, match="the speed of no driver varies"):
        plots.figure(even, "speed")


@pytest.mark.sample(6)
@pytest.mark.spread(0, "ends early-sheet", "ends early-phase", "stays-energy")
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in OF_CONTACTS])
def test_every_figure_bears_every_motion(motion: tuple[str, xr.Dataset], kind: str) -> None:
    name, result = motion
    drawn = figure(result, kind)
    drawn.canvas.draw()
    marks = [text.get_text() for axes in drawn.axes for text in axes.texts]
    panels = len(drawn.axes) if kind != "phase" else 0
    assert marks == [word for _ in range(panels) for word, _ in EVENTS[name]]
    if kind != "phase":
        end = shown(result).end
        low, high = drawn.axes[-1].get_xlim()
        unit = 1e3 if "[ms]" in drawn.axes[-1].get_xlabel() else 1.0
        assert (low, high) == (pytest.approx(0.0), pytest.approx(end * unit, rel=0.08))
    plt.close(drawn)


def _with_events(times: dict[float, str]) -> xr.Dataset:
    """A motion of which other things are told to happen."""
    result = ends_early().drop_vars("event_time")
    result.attrs["events"] = json.dumps([[kind, "A", None, ""] for kind in times.values()])
    return result.assign(event_time=("event", np.array(list(times))))


CLOSE_BY = {0.05: "motor-off", 0.06: "brake", 0.07: "clutch-slips", 0.25: "rest", 0.251: "impact"}


if NODE:

    def test_words_of_events_on_the_page_stand_in_rows(tmp_path: Path) -> None:
        told = page(_with_events(CLOSE_BY), tmp_path)["motion"]
        assert told["lines"] == 5 * len(told["titles"])
        assert told["marks"] == 6 * len(told["titles"])  # an impact has a mark on the axis alone
        words = told["words"][:5]
        assert [word for word, *_ in words] == ["motor off", "brake on", "clutch slips", "rests", "ends"]
        rows = [y for *_, y in words]
        assert rows[0] - 12 == rows[1] == rows[2] + 12
        assert rows[3] == rows[0]
        for k, (word, x, y) in enumerate(words):
            for other, left, height in words[:k]:
                assert height != y or abs(x - left) >= 3 * (len(word) + len(other))

    def page(result: xr.Dataset, folder: Path) -> Any:
        path = folder / "scene.json"
        path.write_text(json.dumps(motion_scene(shown(result))), encoding="utf-8")
        return json.loads(run("page.test.mjs", path))

    @pytest.mark.spread(0, "ends early")
    def test_the_page_draws_it(motion: tuple[str, xr.Dataset], tmp_path: Path) -> None:
        name, result = motion
        seen = page(result, tmp_path)
        told = seen["motion"]
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
    def test_it_is_played_in_real_time_and_stops_at_its_end(tmp_path: Path) -> None:
        told = page(run_down(), tmp_path)["motion"]
        assert told["speed"] == "real time"
        assert told["played"]["half"] == pytest.approx(told["last"] / 2, abs=1)  # after half its time
        assert told["played"]["after"] == told["last"]
        assert not told["played"]["playing"]
        assert told["played"]["again"] == 0

    def test_speeds_that_can_be_seen() -> None:
        script = (
            "import('{}').then(({{speeds}}) => "
            "console.log(JSON.stringify([0.01, 0.3, 2, 30, 600].map((seconds) => speeds(seconds)))))"
        )
        module = Path(__file__).resolve().parents[2] / "src/trunnion/views/web/player.js"
        done = subprocess.run([NODE, "-e", script.format(module.as_uri())], capture_output=True, text=True, timeout=60)
        found = json.loads(done.stdout)
        assert [one["usual"] for one in found] == [0.001, 0.05, 1, 1, 10]
        assert all(1 in one["list"] and one["usual"] in one["list"] for one in found)


def _full(series: list[float], count: int) -> list[float]:
    return series * count if len(series) == 1 else series
