"""Joints with errors as a user of the command line meets them: seats, errors, misalignment, play, files."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
import xarray as xr

from manual.conftest import Run
from manual.test_cli import EXAMPLES

SLIDER, FOUR_BAR = EXAMPLES / "toleranced-slider-crank.yaml", EXAMPLES / "fourbar-with-play.yaml"


@pytest.mark.slow
def test_seats_of_all_joints_by_an_option(program: Run, tmp_path: Path) -> None:
    """--seat loaded gives seats, errors and what they cost; free is the mechanism with its pins in the middle."""
    done = program("analyse", SLIDER, "--seat", "loaded", "--out", tmp_path / "a.csv", "--out", tmp_path / "a.nc")
    assert done.code == 0
    assert "transmission error of S" in done.out
    assert "seat iterations" in done.out
    table = pd.read_csv(tmp_path / "a.csv")
    for column in ("P.seat_1_x", "P.end_force_1_x", "P.contact_1_x", "P.seat_xi", "S.seat_2_y", "S.slide_error",
                   "piston.Q.error_x", "P.contact_lost", "seat_rounds"):  # fmt: skip
        assert column in table
    size = (table["P.seat_1_x"] ** 2 + table["P.seat_1_y"] ** 2) ** 0.5
    assert size.to_numpy() == pytest.approx(17e-6, rel=1e-9)  # 16 H7/f7: 16 to 52 µm wide
    with xr.open_dataset(tmp_path / "a.nc") as whole:
        assert whole.seat_offset.dims == ("joint", "end", "axis", "position")
    free = program("analyse", FOUR_BAR, "--seat", "free", "--out", tmp_path / "b.csv")
    assert "P.seat_1_x" not in pd.read_csv(tmp_path / "b.csv")
    assert "are at the middle of their play" in free.err + free.out


def test_a_seating_that_is_none(program: Run) -> None:
    done = program("analyse", SLIDER, "--seat", "tight")
    assert done.code == 2
    assert "loaded or free" in done.err + done.out


@pytest.mark.slow
def test_errors_and_misalignment_by_name(program: Run, tmp_path: Path) -> None:
    """Any number off nominal, any axis off: the result is told against the ideal mechanism."""
    program("analyse", FOUR_BAR, "--seat", "free", "--set", "errors.coupler=0.1mm", "--out", tmp_path / "a.nc")
    with xr.open_dataset(tmp_path / "a.nc") as found:
        assert float(abs(found.joint_rotation_error.sel(joint="D")).max()) > 1e-3
        assert "seat_offset" not in found
    done = program("analyse", EXAMPLES / "rssr.yaml", "--set", "A.misalignment.tilt=0.1deg", "--out", tmp_path / "b.nc")
    assert done.code in (0, 1)
    with xr.open_dataset(tmp_path / "b.nc") as found:
        assert float(abs(found.link_error).max()) > 1e-4


@pytest.mark.slow
def test_what_play_does_and_whether_it_assembles(program: Run) -> None:
    done = program("play", FOUR_BAR)
    assert done.code == 0
    assert "worst case" in done.out
    done = program("play", FOUR_BAR, "--at", "60deg", "--out", "play.csv")
    assert done.code == 0
    assert len(Path("play.csv").read_text(encoding="utf-8").splitlines()) == 2
    done = program("assemble", EXAMPLES / "misaligned-fourbar.yaml", "--steps", 24)
    assert done.code == 0
    assert "smallest clearance" in done.out
