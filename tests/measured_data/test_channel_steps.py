"""Readings in steps, sampled in step with the turn: every turn reads the same, and no scatter tells the uncertainty."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from measured_data.four_bar import rocker
from trunnion.rig.reading.measurement import Measurement
from trunnion.rig.reading.read import read_measured

Array = NDArray[np.float64]


def recorded(
    folder: Path, values: Array, decimals: int, changes: Mapping[str, Any] | None = None, **channel: Any
) -> Measurement:
    """`values`, deg, of a turn that all twelve repeat, or (turn, sample), at 60 rpm."""
    count, turns, rpm = values.shape[-1], 12, 60.0
    rows = np.resize(np.broadcast_to(values, (turns, count)).ravel(), (turns + 1) * count)
    time = np.arange(rows.size) / count * 60 / rpm
    angle = 360 * (np.arange(rows.size) % count) / count
    lines = [f"{t:.6f};{a:.6f};{row:.{decimals}f}" for t, a, row in zip(time, angle, rows, strict=True)]
    (folder / "a.csv").write_text("\n".join(["t;Winkel;psi", *lines]))
    mapping = {
        "trunnion-data": 1,
        "time": {"column": "t", "unit": "s"},
        "angle": {"from": "column", "column": "Winkel", "unit": "deg"},
        "channels": {"psi": {"column": "psi", "measures": "rotation:D", "unit": "deg", **channel}},
        "set": {"A.speed": f"{rpm} rpm"},
        **(changes or {}),
    }
    return read_measured(mapping, [folder / "a.csv"])


TURN = np.radians(360 * np.arange(1000) / 1000)


@pytest.mark.spread(6)
@pytest.mark.parametrize("samples", [20, 200, 1000, 4000])
@pytest.mark.parametrize("step", [0.001, 0.1, 0.5, 2.0, 20 / 2**7])
def test_steps_count_where_turns_repeat(tmp_path: Path, step: float, samples: int) -> None:
    """Each reading is off by what is rounded, all by what may be cut off: step/√12 each (GUM F.2.2.1)."""
    true = np.degrees(rocker(TURN[:: 1000 // samples] if samples <= 1000 else np.arange(4000) * np.pi / 2000))
    found = recorded(tmp_path, np.floor(true / step) * step, 6)
    course = found.conditions[0].courses["psi"]
    levels = np.unique(np.floor(true / step)).size  # of few that lie apart, the last decimal is known alone
    told = course.accuracy.resolution / np.radians(step)
    assert told == pytest.approx(1.0, rel=1e-3) or (samples == 20 and told <= 1.001 and levels < 30)
    if samples > 20:
        assert np.median(course.scatter) < 1e-3 * np.radians(step)
        assert np.median(course.uncertainty) == pytest.approx(np.radians(step) / np.sqrt(6.0), rel=1e-3)


def test_a_channel_has_one_step_of_all_its_files(tmp_path: Path) -> None:
    """One file spans three steps, and by itself hardly shows them; the other many."""
    psi = np.degrees(rocker(TURN[::2]))
    few = 100 + 0.15 * (psi - psi.min()) / np.ptp(psi)
    for name, values in (("a", few), ("b", psi)):
        (tmp_path / name).mkdir()
        recorded(tmp_path / name, np.rint(10 * values) / 10, 1)
    mapping = {
        "trunnion-data": 1,
        "time": {"column": "t", "unit": "s"},
        "angle": {"from": "column", "column": "Winkel", "unit": "deg"},
        "channels": {"psi": {"column": "psi", "measures": "rotation:D", "unit": "deg"}},
    }
    paths = [tmp_path / name / "a.csv" for name in ("a", "b")]
    for files in (paths, paths[:1]):
        for condition in read_measured(mapping, files).conditions:
            course = condition.courses["psi"]
            assert course.accuracy.resolution == pytest.approx(np.radians(0.1))
            assert np.median(course.uncertainty) == pytest.approx(np.radians(0.1) / np.sqrt(6.0), rel=0.01)
