"""What a finding advises to write is YAML, whatever the names are, and works when it is put into the file."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

from trunnion import Mechanism, MechanismError
from trunnion.model.mechanism import read_mechanism
from trunnion.model.names import as_key

ROOT = Path(__file__).resolve().parents[2]
NAMES = ["A", "pin 1", "left: pin", "a, b", "#1", "[x]", "{x}", "no", "12", "it's", 'the "big" one', "γ", "& more"]
FOUR_BAR = (ROOT / "examples" / "durango-fourbar.yaml").read_text("utf-8")


def load(text: str) -> Any:
    return YAML(typ="safe", pure=True).load(text)


def snippets(text: str) -> list[str]:
    """Every `key: {…}` and `key: […]` of a text, with its brackets closed."""
    found = []
    for start in re.finditer(r'("[^"]*"|[\w.-]+): (?=[{\[])', text):
        depth = 0
        for place in range(start.end(), len(text)):
            depth += (text[place] in "{[") - (text[place] in "}]")
            if depth == 0:
                found.append(text[start.start() : place + 1])
                break
    return found


@pytest.mark.parametrize("name", NAMES)
def test_a_name_as_a_key(name: str) -> None:
    assert list(load(f"{{{as_key(name)}: 1}}")) == [name]
    assert list(load(f"{as_key(name)}: 1")) == [name]


@pytest.mark.parametrize("name", NAMES)
def test_advice_with_any_name_can_be_read(name: str) -> None:
    """A point that is missing, one without an axis, a way of assembly that is to be chosen."""
    joints = {name: {"type": "prismatic", "links": ["ground", "ram"]}}
    links: dict[str, Any] = {"ground": {"points": {}}, "ram": {"points": {name: [0, 0]}}}
    with pytest.raises(MechanismError) as caught:
        Mechanism(space="planar", gravity=[0, 0], links=links, joints=joints)
    advised = [
        re.sub(r"^(?:write|add) (.*?)(?: to the points.*)?$", r"\1", one.remedy) for one in caught.value.findings
    ]
    assert [list(load(one)) for one in advised[:2]] == [[name], [name]], advised


def test_what_is_in_the_source_is_yaml() -> None:
    """Every group or list that a message of the program shows, its variables filled in."""
    faults = []
    for path in sorted((ROOT / "src" / "trunnion").rglob("*.py")):
        for line in path.read_text("utf-8").splitlines():
            for text in (
                re.findall(r'f?"(?:[^"\\]|\\.)*"', line) if re.search(r"(remedy|Finding|problem)", line) else ()
            ):
                plain = (
                    text[1:-1]
                    if text[0] == '"'
                    else re.sub(r"\{[^{}]*\}", "1", text[2:-1].replace("{{", "⟨").replace("}}", "⟩"))
                )
                for one in snippets(plain.replace("⟨", "{").replace("⟩", "}")):
                    try:
                        load(one)
                    except Exception as error:  # whatever YAML says
                        faults.append(f"{path.name}: {one}: {error}")
    assert not faults


def test_every_example_of_the_pages_can_be_read() -> None:
    faults, count = [], 0
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]:
        for head, block in re.findall(
            r"^```yaml([^\n]*)\n(.*?)^```", page.read_text("utf-8"), re.MULTILINE | re.DOTALL
        ):
            count += 1
            try:
                data = load(block)
            except Exception as error:
                faults.append(f"{page.name}: {error}")
                continue
            cut = [
                one for one in re.findall(r'"[^"]*"', json.dumps(data, default=str)) if one.count("(") != one.count(")")
            ]
            if 'title="unquoted.yaml"' in head:  # shows what happens without the marks
                assert cut
                continue
            faults += [f"{page.name}: {one} is cut at a comma" for one in cut]
    assert count > 25
    assert not faults


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
