"""`trunnion simulate` and `locking` as a user meets them: options, files, ranges, reports."""

import json

import pytest

from mechanisms_parts import EXAMPLES
from timed import PARALLELOGRAM, beside, driven_four_bar, swinging
from trunnion import Mechanism

PRESS = EXAMPLES / "flywheel-press.yaml"


def test_a_steady_cycle_is_written_as_a_cycle(program, tmp_path):
    files = ["--out", "c.csv", "--report", "c.html", "--out", "c.svg", "--kind", "speed"]
    assert program("simulate", PRESS, "--steady", "--steps", 36, *files).code == 0
    assert (tmp_path / "c.svg").stat().st_size > 5_000
    assert len((tmp_path / "c.csv").read_text().splitlines()) == 37
    assert program("simulate", PRESS, "--steady", "--kind", "phase", "--out", "c.png").code == 2


@pytest.mark.slow
def test_a_press_that_stalls_is_an_error(program):
    code, out, err = program("simulate", PRESS, "--set", "force=1000kN", "--set", "breakdown_effort=20Nm", "--time=2s")
    assert code == 1
    assert "error: driver O stalls at 1.129 s, at 235.6°, with the motor of O on: 87.69 N m act on it" in out + err
    assert "flywheel" in out + err


@pytest.mark.parametrize("name", ["b.spectrum.csv", "b.impacts.csv", "b.events.csv --steady", "b.png --kind orbit"])
def test_tables_and_figures_that_a_motion_has_not_are_refused_before_it_is_found(program, tmp_path, name):
    code, _, err = program("simulate", PRESS, "--time=1h", "--out", *name.split())
    assert code == 2
    assert "there is no table" in err or "no joint of this motion is in play" in err
    assert not list(tmp_path.glob("b.*"))


def test_the_command_line_tells_where_a_motion_ends(program, tmp_path):
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
    assert (tmp_path / "s.csv").read_text().splitlines()[-1].count(",") > 10
    code, _, err = program("simulate", "w.json", "--time=1s")
    assert code == 0
    assert "A reaches 114.6°, the end of its stated range" in err


FREE = EXAMPLES / "durango-fourbar.yaml"


def test_without_friction_the_ranges_are_those_of_coefficients_of_zero(program):
    off = program("locking", FREE, "--friction", "off", "--steps", 24).out.splitlines()
    zero = program("locking", FREE, "--set", "joint_defaults.friction=0", "--steps", 24).out.splitlines()
    start = next(k for k, line in enumerate(zero) if line.startswith("ranges of "))
    assert len(zero) - start > 3
    assert off[-len(zero[start:]) :] == zero[start:]
