"""Tables of the terminal: broken between words where it is narrow, but never between a number and its unit."""

from __future__ import annotations

import pytest
from rich.cells import cell_len

from trunnion.cli.terminal import show_rows

HEAD = ["", "linear", "searched", "Monte Carlo", "of variance"]
ROWS = [
    ["peak", "286.579\u00a0N\u00a0m at 245°", "−0.9887 to +0.9784\u00a0N\u00a0m", "286.58\u00a0N\u00a0m", "46\u00a0%"],
    ["99.73 % range", "286.0893 to 287.0702\u00a0N\u00a0m", "", "286.0980 to 287.0377\u00a0N\u00a0m", "—"],
]  # fmt: skip


@pytest.mark.parametrize("columns", [80, 90, 200])
def test_numbers_keep_their_units(
    columns: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    show_rows("title", HEAD, ROWS)
    told = capsys.readouterr().out
    assert max(cell_len(line) for line in told.splitlines()) <= columns
    words = [word for row in [HEAD, *ROWS] for cell in row for word in cell.split(" ")]
    assert all(word in told for word in words)


def test_a_table_too_wide_for_whole_words_is_shown_in_parts(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each part names its rows, and no word is broken."""
    monkeypatch.setenv("COLUMNS", "40")
    show_rows("title", HEAD, ROWS)
    told = capsys.readouterr().out
    assert max(cell_len(line) for line in told.splitlines()) <= 40
    assert told.count("peak") > 1
    words = [word for row in [HEAD, *ROWS] for cell in row for word in cell.split(" ")]
    assert all(word in told for word in words)


def test_a_table_that_narrower_gaps_make_fit_stays_whole(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Six columns of 10 take 77 with gaps of 3, 71 with 2, and 65 with 1."""
    for columns, whole in ((77, True), (71, True), (65, True), (64, False)):
        monkeypatch.setenv("COLUMNS", str(columns))
        show_rows("title", [f"{k:010d}" for k in range(6)], [["x" * 10] * 6])
        told = capsys.readouterr().out
        assert max(cell_len(line.rstrip()) for line in told.splitlines()) <= columns
        assert (told.count("xxxxxxxxxx") == 6) is whole


def test_rows_that_two_columns_tell_apart_keep_both(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    rows = [["run-1", "torque", *["12345.678"] * 5], ["run-1", "speed", *["12345.678"] * 5]]
    show_rows("title", ["condition", "channel", *"abcde"], rows)
    lines = [line for line in capsys.readouterr().out.splitlines() if "run-1" in line]
    assert len(lines) > 2
    assert all("torque" in line or "speed" in line for line in lines)


def test_a_word_wider_than_the_terminal_is_folded(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "20")
    show_rows("title", ["name", "value"], [["x" * 60, "1"]])
    assert max(cell_len(line) for line in capsys.readouterr().out.splitlines()) <= 20


def test_a_file_has_room_for_whole_words(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Where no terminal sets the width, no number is broken."""
    monkeypatch.delenv("COLUMNS", raising=False)
    rows = [["1.23456789", "0.987654321"] * 8]
    show_rows("title", ["number"] * 16, rows)
    assert all(text in capsys.readouterr().out.split() for text in ("1.23456789",))
