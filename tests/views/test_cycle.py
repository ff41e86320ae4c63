"""What the curves are drawn over, where they are silent, and that thinning keeps the peaks."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from stand_in import blank, slider

from trunnion.errors import Status
from trunnion.views.common.cycle import abscissa, intervals, thin


def test_a_turning_drive_is_drawn_over_its_angle_and_the_turn_closes(plain):
    over = abscissa(plain)
    assert (over.title, over.closed, over.period) == ("drive angle A [°]", True, pytest.approx(360.0))
    assert over.values[90] == pytest.approx(90.0)


def test_a_drive_turning_backwards_closes_too(plain):
    back = plain.assign_coords(drive=-plain.drive)
    back.drive.attrs = plain.drive.attrs
    assert abscissa(back).period == pytest.approx(-360.0)


def test_a_sliding_drive_is_drawn_over_its_slide_in_millimetres():
    over = abscissa(slider())
    assert over.title == "drive slide S [mm]"
    assert over.values[-1] == pytest.approx(80.0)


def test_a_gap_in_the_answers_is_none_in_the_drive(plain):
    over = abscissa(blank(plain, 100, 150, Status.NOT_ASSEMBLED))
    assert over.values == pytest.approx(np.arange(360.0))


def test_where_no_drive_is_stated_time_serves(plain):
    assert abscissa(plain.drop_vars("drive")).title == "time [ms]"
    timed = plain.assign_coords(drive=plain.time)
    timed.drive.attrs = {"units": "s", "long_name": "time"}
    assert abscissa(timed).title == "time [ms]"


def test_intervals_name_each_run_without_an_answer(plain):
    twice = blank(blank(plain, 10, 20, Status.LOCKED), 300, 360, Status.NOT_ASSEMBLED)
    twice["status"][5] = Status.ZERO_SLIP  # solved, only flagged
    runs = intervals(twice)
    assert [(run.start, run.stop, run.text) for run in runs] == [
        (10, 20, Status.LOCKED.text),
        (300, 360, Status.NOT_ASSEMBLED.text),
    ]


@given(st.lists(st.floats(-1e6, 1e6) | st.just(np.nan), min_size=1, max_size=400), st.integers(4, 60))
def test_thinning_keeps_both_peaks_and_every_long_gap(values, most):
    column = np.array(values)
    picked = thin(column, most)
    kept = column[picked]
    assert (np.diff(picked) > 0).all()
    assert picked.size <= 2 * most + 2 or picked.size == column.size
    if np.isfinite(column).any():
        assert np.nanmax(kept) == np.nanmax(column)
        assert np.nanmin(kept) == np.nanmin(column)
    assert np.isnan(kept).any() == np.isnan(column).any()
