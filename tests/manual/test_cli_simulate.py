"""`trunnion simulate` as a user meets it: options, files, report."""

from __future__ import annotations

from pathlib import Path

import pytest

from manual.conftest import Run

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
PRESS = EXAMPLES / "flywheel-press.yaml"


@pytest.mark.parametrize("time", ["3mm", "soon", "0", "-1 s"])
def test_a_duration_that_is_none_is_refused(program: Run, time: str) -> None:
    code, _, err = program("simulate", PRESS, f"--time={time}")
    assert code == 2
    assert "--time" in err
    assert time.strip() in err


@pytest.mark.parametrize("time", ["0.004", "4ms", "4 ms"])
def test_a_duration_is_a_number_of_seconds_or_has_a_unit(program: Run, tmp_path: Path, time: str) -> None:
    assert program("simulate", PRESS, f"--time={time}", "--steps", 2, "--out", "m.csv").code == 0
    assert float((tmp_path / "m.csv").read_text().splitlines()[-1].split(",")[0]) == pytest.approx(0.004)
