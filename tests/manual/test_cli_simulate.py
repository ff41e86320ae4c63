"""`trunnion simulate` as a user meets it: options, files, report."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from manual.conftest import Run
from timed import LINEAR, PARALLELOGRAM, beside, driven_four_bar, swinging, two_wheels
from trunnion import Mechanism

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
PRESS = EXAMPLES / "flywheel-press.yaml"


@pytest.mark.parametrize("time", ["3mm", "soon", "0", "-1 s"])
def test_a_duration_that_is_none_is_refused(program: Run, time: str) -> None:
    code, _, err = program("simulate", PRESS, f"--time={time}")
    assert code == 2
    assert "--time" in err
    assert time.strip() in err


def test_a_steady_cycle_is_written_as_a_cycle(program: Run, tmp_path: Path) -> None:
    files = ["--out", "c.csv", "--report", "c.html", "--out", "c.svg", "--kind", "speed"]
    assert program("simulate", PRESS, "--steady", "--steps", 36, *files).code == 0
    assert (tmp_path / "c.svg").stat().st_size > 5_000
    assert len((tmp_path / "c.csv").read_text().splitlines()) == 37
    assert program("simulate", PRESS, "--steady", "--kind", "phase", "--out", "c.png").code == 2


def test_no_steady_cycle_is_a_finding_with_its_cause(program: Run) -> None:
    code, _, err = program("simulate", PRESS, "--steady", "--set", "breakdown_effort=1Nm", "--time=1s")
    assert code == 1
    assert "there is no steady cycle" in err
    assert "O does not start" in err


def test_a_press_that_stalls_is_an_error(program: Run) -> None:
    code, out, err = program("simulate", PRESS, "--set", "force=1000kN", "--set", "breakdown_effort=20Nm", "--time=2s")
    assert code == 1
    assert "error: driver O stalls at 1.129 s, at 235.6°, with the motor on: 87.69 N m act on it" in out + err
    assert "flywheel" in out + err


@pytest.mark.parametrize("name", ["b.spectrum.csv", "b.impacts.csv", "b.events.csv --steady", "b.png --kind orbit"])
def test_tables_and_figures_that_a_motion_has_not_are_refused_before_it_is_found(
    program: Run, tmp_path: Path, name: str
) -> None:
    code, _, err = program("simulate", PRESS, "--time=1h", "--out", *name.split())
    assert code == 2
    assert "there is no table" in err or "no joint of this motion is in play" in err
    assert not list(tmp_path.glob("b.*"))


def test_several_drivers_that_may_stick_have_no_steady_cycle(program: Run, tmp_path: Path) -> None:
    (tmp_path / "two.yaml").write_text(json.dumps(two_wheels(LINEAR).data()))
    code, _, err = program("simulate", "two.yaml", "--steady", "--time=1s")
    assert code == 2
    assert "joints.A: it may stick while others slide" in err
    assert "smooth at rest" in err


def play_and_clutch() -> dict[str, object]:
    data = YAML(typ="safe").load(EXAMPLES / "worn-gudgeon-pin.yaml")
    motor = {"kind": "constant", "effort": 9, "inertia": 0.01, "clutch": 5}
    data["drivers"]["O"]["motor"] = motor
    return dict(data)


def test_a_clutch_beside_joints_in_play_is_refused_with_what_to_remove(program: Run, tmp_path: Path) -> None:
    (tmp_path / "played.yaml").write_text(json.dumps(play_and_clutch()))
    code, _, err = program("simulate", "played.yaml", "--time=1ms")
    assert code == 2
    assert "remove it, or the contact of the joints in play" in err


def test_the_command_line_tells_where_a_motion_ends(program: Run, tmp_path: Path) -> None:
    data = driven_four_bar("planar", *PARALLELOGRAM).data()
    folding = Mechanism(**data | {"assembly": data["assembly"] | {"rocker": "folds"}})
    for name, mechanism in {
        "p": driven_four_bar("planar", *PARALLELOGRAM), "f": folding, "s": swinging("planar", stiffness=1e12),
        "w": beside(driven_four_bar("planar", *PARALLELOGRAM, range=[0.2, 2.0])),
    }.items():  # fmt: skip
        (tmp_path / f"{name}.json").write_text(json.dumps(mechanism.data()))
    code, _, err = program("simulate", "f.json", "--time=1s")
    assert code == 1
    assert "at 180° of A, the links coupler, rocker come to a change point" in err
    code, _, err = program("simulate", "p.json", "--time=0.7s")
    assert code == 0
    assert "change points are passed" in err
    code, _, err = program("simulate", "s.json", "--time=1s", "--evaluations", 1000, "--out", "s.csv")
    assert code == 1
    assert "1,000 evaluations of the forces are used up at" in err
    assert "springs.stop.stiffness = 1e+12" in err
    assert (tmp_path / "s.csv").read_text().splitlines()[-1].count(",") > 10
    code, _, err = program("simulate", "w.json", "--time=1s")
    assert code == 0
    assert "A reaches 114.6°, the end of its stated range" in err


def test_a_motion_that_does_not_begin_has_no_table(program: Run, tmp_path: Path) -> None:
    """The arm falls from the end of its range at once."""
    path = tmp_path / "ends.yaml"
    path.write_text("""trunnion: 1
space: planar
gravity: [0, -9.81]
links:
  ground: {points: {A: [0, 0]}}
  arm: {points: {A: [0, 0]}, mass: 5 kg, centre: [0.25, 0], inertia: 0.1}
joints: {A: {type: revolute, links: [ground, arm]}}
drivers: {A: {speed: 1, range: [0 deg, 90 deg], free: true}}
""")
    code, out, err = program("simulate", path, "--time", "1s", "--out", "m.csv")
    assert code == 0
    assert "the end of its stated range, at 0 s" in err
    assert out == "wrote m.csv\n"
