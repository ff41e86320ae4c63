"""What a finding advises to write is YAML, whatever the names are, and works when it is put into the file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

from trunnion import MechanismError
from trunnion.model.mechanism import read_mechanism
from trunnion.model.names import as_key

ROOT = Path(__file__).resolve().parents[2]
NAMES = ["A", "pin 1", "left: pin", "a, b", "#1", "[x]", "{x}", "no", "12", "it's", 'the "big" one', "γ", "& more"]
FOUR_BAR = (ROOT / "examples" / "durango-fourbar.yaml").read_text("utf-8")


def load(text: str) -> Any:
    return YAML(typ="safe", pure=True).load(text)


@pytest.mark.parametrize("name", NAMES)
def test_a_name_as_a_key(name: str) -> None:
    assert list(load(f"{{{as_key(name)}: 1}}")) == [name]
    assert list(load(f"{as_key(name)}: 1")) == [name]


@pytest.mark.parametrize(
    ("before", "after", "whole"),
    [
        ("force: [0, -1 kN]", "force: [0, -1 kN * between(drive, 10 deg, 20 deg) * 2]",
         "-1 kN * between(drive, 10 deg, 20 deg) * 2"),
        ("force: [0, -1 kN]", "force: [min(1 N, 2 N), max(3 N, 4 N)]", "min(1 N, 2 N)"),
        ("force: [0, -1 kN]", "force: [0, 0], moment: 1 N m * between(drive, 10 deg, 20 deg)",
         "1 N m * between(drive, 10 deg, 20 deg)"),
    ],
)  # fmt: skip
def test_a_value_that_is_cut_at_its_comma(before: str, after: str, whole: str, tmp_path: Path) -> None:
    """In brackets and in braces: the finding shows the value in quotation marks, and so the file can be read."""
    source = FOUR_BAR[: FOUR_BAR.index("loads:")] + "loads:\n  push: {link: coupler, at: C, force: [0, -1 kN]}\n"
    path = tmp_path / "model.yaml"
    path.write_text(source, encoding="utf-8")
    assert read_mechanism(path)
    path.write_text(source.replace(before, after), encoding="utf-8")
    text = source.replace(before, after)
    with pytest.raises(MechanismError) as caught:
        read_mechanism(path)
    assert whole in caught.value.findings[0].what
    for found in caught.value.findings:
        assert "has a comma, which ends a value in br" in found.what
        quoted = found.remedy.partition("marks: ")[2]
        text = text.replace(quoted.strip('"'), quoted)
    path.write_text(text, encoding="utf-8")
    assert read_mechanism(path)
