"""`trunnion simulate` and `locking` as a user meets them: options, files, ranges, reports."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import trunnion
from manual.conftest import Run
from timed import PARALLELOGRAM, beside, driven_four_bar, swinging
from trunnion import Mechanism

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
PRESS = EXAMPLES / "flywheel-press.yaml"


def test_a_steady_cycle_is_written_as_a_cycle(program: Run, tmp_path: Path) -> None:
    files = ["--out", "c.csv", "--report", "c.html", "--out", "c.svg", "--kind", "speed"]
    assert program("simulate", PRESS, "--steady", "--steps", 36, *files).code == 0
    assert (tmp_path / "c.svg").stat().st_size > 5_000
    assert len((tmp_path / "c.csv").read_text().splitlines()) == 37
    assert program("simulate", PRESS, "--steady", "--kind", "phase", "--out", "c.png").code == 2


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
    assert (tmp_path / "s.csv").read_text().splitlines()[-1].count(",") > 10
    code, _, err = program("simulate", "w.json", "--time=1s")
    assert code == 0
    assert "A reaches 114.6°, the end of its stated range" in err


DRAWING, FREE = EXAMPLES / "drawing-press.yaml", EXAMPLES / "durango-fourbar.yaml"


def test_ranges_and_files(program: Run, tmp_path: Path) -> None:
    files = ["l.csv", "l.json", "l.nc", "l.png"]
    code, out, _ = program("locking", DRAWING, "--steps", 24, "--near", 5, *(f"--out={name}" for name in files))
    assert code == 0
    assert {path.name for path in tmp_path.iterdir()} == set(files)
    assert "ranges of Z" in out
    assert "margin below 5" in out
    with (tmp_path / "l.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    result = trunnion.locking(trunnion.read(DRAWING), 24)
    margins = [float(row["locking_margin"]) for row in rows]
    assert margins == pytest.approx(result["locking_margin"].values)
    assert {"time", "drive", "B.critical_multiple", "Z.effort", "Z.effort_reverse", "locking_state"} <= set(rows[0])
    meanings = result["locking_state"].attrs["flag_meanings"].split()
    assert [row["locking_state"] for row in rows] == [meanings[code] for code in result["locking_state"].values]
    assert "locking_state" in json.loads((tmp_path / "l.json").read_text())["data_vars"]
    with xr.open_dataset(tmp_path / "l.nc") as read:
        np.testing.assert_array_equal(read["locking_state"].values, result["locking_state"].values)


def test_without_friction_the_ranges_are_those_of_coefficients_of_zero(program: Run) -> None:
    off = program("locking", FREE, "--friction", "off", "--steps", 24).out.splitlines()
    zero = program("locking", FREE, "--set", "joint_defaults.friction=0", "--steps", 24).out.splitlines()
    start = next(k for k, line in enumerate(zero) if line.startswith("ranges of "))
    assert len(zero) - start > 3
    assert off[-len(zero[start:]) :] == zero[start:]


def test_friction_is_set_as_a_file_states_it(program: Run) -> None:
    short = program("analyse", DRAWING, "--steps", 12, "--set", "K.friction=0.2")
    long = program("analyse", DRAWING, "--steps", 12, "--set", "K.friction.coefficient=0.2")
    assert short.code == 0
    assert short.out == long.out
    swept = program("sweep", DRAWING, "--steps", 12, "--over", "joint_defaults.friction=0.05,0.1")
    assert swept.code == 0
    several = program("analyse", DRAWING, "--set", "friction=0.2")
    assert several.code == 2
    assert "joint_defaults.friction" in several.err
    assert "O.friction" in several.err
    assert program("analyse", DRAWING, "--steps", 12, "--set", "O.friction=0.2").code == 0


def test_a_weight_that_is_a_mass_has_the_ranges_of_the_same_load(program: Run, tmp_path: Path) -> None:
    """And no efficiency, with what to write; it was 0."""
    joint = {"type": "revolute", "links": ["ground", "lever"], "pin": {"radius": 0.012}, "friction": 0.5}
    told = {}
    for name in ("mass", "load"):
        heavy = {"mass": 10.0, "centre": [0.02, 0]} if name == "mass" else {}
        weight = {"weight": {"link": "lever", "at": "P", "force": [0, -98.1]}} if name == "load" else {}
        model = {
            "trunnion": 1,
            "gravity": [0, -9.81],
            "links": {"ground": {"points": {"A": [0, 0]}}, "lever": {"points": {"A": [0, 0], "P": [0.02, 0]}, **heavy}},
            "joints": {"A": joint},
            "drivers": {"A": {"speed": 1e-4, "range": [0.0, 2.5]}},
            "loads": weight,
        }
        (tmp_path / f"{name}.json").write_text(json.dumps(model))
        locked = program("locking", f"{name}.json", "--steps", 41)
        assert locked.code == 0
        told[name] = locked.out.partition("ranges of A")[2]
        for out in (locked.out, program("analyse", f"{name}.json", "--steps", 41).out):
            assert ("undefined" in out and "of what it lifts" in out) == (name == "mass")
    assert told["mass"] == told["load"]
    assert "self-locking │  72.54°" in told["mass"]
