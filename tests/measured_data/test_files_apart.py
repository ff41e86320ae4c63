"""Files of one measurement that differ: units of headings, settings of an amplifier, what a logger writes below."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from trunnion.errors import Finding, MechanismError
from trunnion.rig.reading.measurement import Measurement
from trunnion.rig.reading.read import read_measured
from trunnion.rig.reading.units import dimensions
from trunnion.views.measured import tables

RATE, SPEED, TURNS = 1000.0, 120.0, 12  # Hz, rpm
FOOT_POUND = 1.3558179483314003


def torque(angle: Any) -> Any:
    return 4 + 13 * np.sin(angle)


def written(path: Path, unit: str = "N m", size: float = 1.0, limit: float = np.inf, gap: slice | None = None) -> Path:
    """A run with a torque in a unit of a size in N m, read up to a limit, with a clock, without the rows of a gap."""
    noise = np.random.default_rng(3)
    t = np.arange(int(RATE * 60 / SPEED * (TURNS + 0.5))) / RATE
    angle = SPEED * np.pi / 30 * t
    read = np.clip(torque(angle) / size + 0.05 * noise.normal(size=t.size), -limit, limit)
    rows = [f"Zeit;Winkel [°];Moment [{unit}]"]
    told_at = [divmod(one, 60.0) for one in t + 3600 * 9]
    rows += [
        f"23.11.2026 09:{int(minute) % 60:02d}:{second:06.3f};{a:.2f};{m:.2f}"
        for (minute, second), a, m in zip(told_at, np.degrees(angle) % 360, read, strict=True)
    ]
    if gap is not None:
        del rows[gap]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


def mapping(folder: Path, files: Sequence[dict[str, Any]], **channel: Any) -> Measurement:
    """The measurement of files below a folder."""
    text = {
        "trunnion-data": 1,
        "files": list(files),
        "time": {"column": "Zeit"},
        "angle": {"from": "column", "column": "Winkel", "resolution": "0.01 deg"},
        "channels": {"M": {"column": "Moment", "measures": "effort:A", **channel}},
        "positions": 90,
    }
    (folder / "mapping.json").write_text(json.dumps(text))
    return read_measured(folder / "mapping.json")


def of(found: Measurement, code: str) -> list[Finding]:
    return [one for one in found.findings if one.code == code]


# ---- units ----------------------------------------------------------------------------------------------------


def test_a_table_has_one_unit_for_each_channel(tmp_path: Path) -> None:
    written(tmp_path / "a.csv")
    written(tmp_path / "b.csv", "lbf ft", FOOT_POUND)
    found = mapping(tmp_path, [{"file": "a.csv"}, {"file": "b.csv"}])
    conditions, channels = tables(found)
    column = [head.replace("\u00a0", " ") for head in conditions.head].index("M N m")
    means = [float(row[column]) for row in conditions.rows]
    assert means == pytest.approx([4.0, 4.0], abs=0.02)
    assert [float(one) for one in channels.rows[0][3:5]] == pytest.approx([-9, 17], abs=0.1)


@pytest.mark.parametrize("text", ["ft-lb", "ft lb", "lb-ft", "lbf-ft", "ft·lbf", "ft-lbs", "lb ft", "ft.lb", "ftlb"])
def test_pound_feet_as_they_are_written(text: str) -> None:
    assert dimensions(text)[0] == pytest.approx(FOOT_POUND)
    assert dimensions(text)[1] == dimensions("N m")[1]


# ---- settings of an amplifier ---------------------------------------------------------------------------------


def test_a_file_has_settings_of_its_own(tmp_path: Path) -> None:
    written(tmp_path / "a.csv", "V", 2.0)
    written(tmp_path / "b.csv", "V", 4.0, limit=3.5)
    own = {"gain": "4 N m/V", "range": "14 N m", "accuracy": {"gain": 0.01}}
    found = mapping(
        tmp_path, [{"file": "a.csv"}, {"file": "b.csv", "channels": {"M": own}}],
        gain="2 N m/V", range="50 N m", accuracy={"gain": 0.001},
    )  # fmt: skip
    first, second = (one.courses["M"] for one in found.conditions)
    assert np.nanmean(first.mean) == pytest.approx(4.0, abs=0.02)
    there = torque(2 * np.pi * found.conditions[1].phase) < 13
    assert second.mean[there] == pytest.approx(first.mean[there], abs=0.3)
    assert (first.accuracy.gain, second.accuracy.gain) == (0.001, 0.01)
    (clip,) = of(found, "data.readings.clipped")
    assert clip.file.endswith("b.csv")


@pytest.mark.parametrize(
    ("own", "told_of", "remedy"),
    [
        ({"T": {"range": 3}}, "files.0.channels.T", "known: 'M'"),
        ({"M": {"range": "3 V"}}, "files.0.channels.M", "write it in N m"),
        ({"M": {"rnge": 3}}, "files.0.channels.M.rnge", "range"),
        ({"M": {"unit": "lbm"}}, "files.0.channels.M.unit", ""),
    ],
)
def test_settings_that_cannot_be_are_told(tmp_path: Path, own: dict[str, Any], told_of: str, remedy: str) -> None:
    written(tmp_path / "a.csv")
    with pytest.raises(MechanismError) as caught:
        mapping(tmp_path, [{"file": "a.csv", "channels": own}], unit="N m")
    (one,) = caught.value.findings
    assert one.where == told_of
    assert remedy in one.remedy
    assert one.line


# ---- what a logger leaves behind ------------------------------------------------------------------------------


def test_a_gap_in_a_turn_is_not_the_drives(tmp_path: Path) -> None:
    """Over 0.3 s of a turn of 0.5 s the angle is lost: two turns go, and are told."""
    found = mapping(tmp_path, [{"file": written(tmp_path / "a.csv", gap=slice(2600, 2900)).name}])
    (one,) = of(found, "data.turns.unusual")
    assert "2 turns left out" in one.what
    turns = found.conditions[0].courses["M"].turns.shape[0]
    assert turns == TURNS - 2
    assert found.done[0].startswith(f"{turns} whole turns;")
    found = mapping(tmp_path, [{"file": "a.csv"}, {"file": written(tmp_path / "b.csv").name}])
    assert found.done[0].startswith(f"{turns} to {TURNS} whole turns in each of 2 conditions;")
