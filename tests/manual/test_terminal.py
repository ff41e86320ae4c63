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
