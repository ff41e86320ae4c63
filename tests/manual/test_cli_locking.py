"""`trunnion locking` and places in plots as a user meets them: ranges, files, figures, faults."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import trunnion
from manual.conftest import Run

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
PRESS, FREE = EXAMPLES / "drawing-press.yaml", EXAMPLES / "durango-fourbar.yaml"


def test_ranges_and_files(program: Run, tmp_path: Path) -> None:
    files = ["l.csv", "l.json", "l.nc", "l.png"]
    code, out, _ = program("locking", PRESS, "--steps", 24, "--near", 5, *(f"--out={name}" for name in files))
    assert code == 0
    assert {path.name for path in tmp_path.iterdir()} == set(files)
    assert "ranges of Z" in out
    assert "margin below 5" in out
    with (tmp_path / "l.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    result = trunnion.locking(trunnion.read(PRESS), 24)
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


@pytest.mark.parametrize(
    ("place", "code", "part"),
    [
        ("30mm", 0, ""),
        ("1s", 0, ""),
        ("400mm", 2, "not in the cycle"),
        ("30deg", 2, "length"),
        ("there", 2, "no place"),
    ],
)
def test_a_place_in_plots(program: Run, tmp_path: Path, place: str, code: int, part: str) -> None:
    options = ("--friction", "off", "--steps", 24, "--kind", "torque")  # places are those of the motion
    done = program("plot", PRESS, *options, "--at", place, "--out", "t.svg")
    assert done.code == code
    assert part in done.err
    assert (tmp_path / "t.svg").exists() == (code == 0)


def test_friction_is_set_as_a_file_states_it(program: Run) -> None:
    short = program("analyse", PRESS, "--steps", 12, "--set", "K.friction=0.2")
    long = program("analyse", PRESS, "--steps", 12, "--set", "K.friction.coefficient=0.2")
    assert short.code == 0
    assert short.out == long.out
    swept = program("sweep", PRESS, "--steps", 12, "--over", "joint_defaults.friction=0.05,0.1")
    assert swept.code == 0
    several = program("analyse", PRESS, "--set", "friction=0.2")
    assert several.code == 2
    assert "joint_defaults.friction" in several.err
    assert "O.friction" in several.err
    assert program("analyse", PRESS, "--steps", 12, "--set", "O.friction=0.2").code == 0


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
