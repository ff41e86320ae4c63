"""Reports of play, sweep and assembly: one page each, with the numbers of the terminal and nothing that could run."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from trunnion import assemble, play, read, sweep
from trunnion.cli.app import app
from trunnion.errors import MechanismError
from trunnion.views.play import tables as play_tables
from trunnion.views.shown import report

EXAMPLES = Path(__file__).parents[2] / "examples"
JOINT = "joints.A.friction.coefficient"


def _page(text: str) -> str:
    """A page that fetches nothing and runs nothing."""
    assert text.startswith("\n<!doctype html>") or text.startswith("<!doctype html>")
    assert "<script" not in text
    assert not re.search(r'(?:src|href)="(?!data:|#)', text)
    return text


def test_play() -> None:
    result = play(read(EXAMPLES / "fourbar-with-play.yaml"), ["rotation:C", "rotation:D"], steps=12)
    page = _page(report(result))
    assert page.count("<img") == 2
    for table in play_tables(result):
        assert all(f">{cell}</td>" in page for row in table.rows for cell in row if cell)
    assert "0.02 mm" in page  # the input data


def test_sweep() -> None:
    result = sweep(read(EXAMPLES / "toleranced-fourbar.yaml"), {JOINT: [0.0, 0.1, 0.2]}, steps=12)
    page = _page(report(result, measures=["efficiency", "friction_power_mean"]))
    assert page.count("<img") == 2
    for value in result["efficiency"].values:
        assert f">{value:.6g}</td>" in page


@pytest.mark.slow
def test_assembly() -> None:
    result = assemble(read(EXAMPLES / "misaligned-hinges.yaml"), steps=6)
    page = _page(report(result))
    share = float(result["largest_share"])
    assert np.isclose(share, 0.672, atol=1e-3)  # so the page cannot hold it by chance
    assert f">{share:.6g}</td>" in page
    assert "smallest clearance" in page


@pytest.mark.slow
@pytest.mark.parametrize(
    "line",
    [
        ["play", str(EXAMPLES / "fourbar-with-play.yaml"), "--steps", "6"],
        ["sweep", str(EXAMPLES / "toleranced-fourbar.yaml"), "--over", f"{JOINT}=0:0.1:2", "--steps", "6"],
        ["assemble", str(EXAMPLES / "misaligned-hinges.yaml"), "--steps", "6"],
    ],
)
def test_command_line(line: list[str], tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    run = CliRunner().invoke(app, [*line, "--report", str(page)])
    assert run.exit_code == 0, run.output
    _page(page.read_text("utf-8"))
    with pytest.raises(MechanismError, match="a report is HTML"):
        CliRunner().invoke(app, [*line, "--report", str(tmp_path / "page.pdf")], catch_exceptions=False)
    assert not (tmp_path / "page.pdf").exists()


def test_names_cannot_become_code(tmp_path: Path) -> None:
    text = (EXAMPLES / "fourbar-with-play.yaml").read_text("utf-8")
    named = re.sub(r"^name:.*$", 'name: "<script>alert(1)</script>"', text, count=1, flags=re.MULTILINE)
    (tmp_path / "model.yaml").write_text(named, "utf-8")
    page = _page(report(play(read(tmp_path / "model.yaml"), steps=6)))
    assert "&lt;script&gt;" in page
