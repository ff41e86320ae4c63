"""The table of what tolerances do, held against the model with its numbers at their limits; lengths as fields."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import trunnion
from browsing import CHROMIUM
from served import served
from studio.asking import ask
from studio.whitworth import TEXT
from trunnion.model.file import entries_of
from trunnion.model.mechanism import Mechanism

WHITWORTH = (Path(__file__).resolve().parents[2] / "examples" / "whitworth-quick-return.yaml").read_text("utf-8")
TOLERANCED = TEXT.replace("crank: 30 mm", "crank: 30 mm ± 0.5 mm")


def cycle(crank):
    return trunnion.analyse(Mechanism(**entries_of(TEXT.replace("crank: 30 mm", f"crank: {crank} mm"))[0]), 720)


@pytest.mark.slow
def test_worst_cases_are_those_of_the_numbers_at_their_limits():
    found = ask(ask="tolerances", text=TOLERANCED, steps=360)
    torque, stroke, ratio = found["rows"]
    ends = [cycle(crank) for crank in (29.5, 30, 30.5)]
    peaks = [float(np.abs(one["drive_effort"]).max()) for one in ends]
    ways = [float(np.ptp(one["joint_slide"].sel(joint="G").values)) for one in ends]
    for row, (low, middle, high) in ((torque, peaks), (stroke, ways)):
        assert row["nominal"] == pytest.approx(middle, rel=1e-3)
        assert row["worst"] == pytest.approx([-(high - low) / 2, (high - low) / 2], rel=0.03)
        assert row["deviation"] == pytest.approx((high - low) / 6, rel=0.03)  # limits at three standard deviations
    assert torque["label"] == "largest torque, drive A"
    assert stroke["texts"][0] == "135.0\u00a0mm"
    assert ratio["label"] == "time ratio of G"


def test_a_stroke_that_no_tolerance_changes_is_told_as_that():
    """The stroke of a Whitworth in line with its lever is 2 s whatever the crank; its time ratio is (2π − φ)/φ."""
    text = WHITWORTH.replace("r: 120 mm", "r: 120 mm ± 0.5 mm")
    stroke, ratio = ask(ask="tolerances", text=text, steps=360)["rows"][1:]
    assert stroke["texts"] == ["200.0\u00a0mm", "± 0\u00a0m", "0\u00a0m"]
    assert stroke["worst"] == [0, 0]
    short = [2 * np.arccos(60 / crank) for crank in (119.5, 120, 120.5)]
    low, middle, high = ((2 * np.pi - one) / one for one in short)
    assert ratio["nominal"] == pytest.approx(middle, rel=1e-7)
    assert ratio["worst"] == pytest.approx([-(low - high) / 2, (low - high) / 2], rel=1e-4)


if CHROMIUM:  # not a skip: the numbers are tested above

    @pytest.fixture(scope="module")
    def studio(tmp_path_factory):
        folder = tmp_path_factory.mktemp("rams")
        (folder / "ram.yaml").write_text(TOLERANCED, encoding="utf-8")
        with served(folder, "ram.yaml") as own:
            yield own

    @pytest.mark.slow
    def test_the_table_stands_under_the_plots(user):
        user.until("s.solved.value")
        user.page.click("role=tab[name=Plots]")
        words = user.page.text_content(".tolerances table")
        assert "stroke of G" in words
        assert "± 2.250" in words
        assert "Samples, yield and shares" in user.page.text_content(".tolerances p")
        user.of("actions", "m.setValue(['dimensions', 'crank'], '30 mm')")
        user.until("s.answer.value.numbers['dimensions.crank'] === 0.03 && !s.text.value.includes('±')")
        assert user.page.locator(".tolerances").count() == 0
