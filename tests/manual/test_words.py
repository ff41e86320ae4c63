"""Retired phrases stay out of what users read, and help fits a terminal."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer import Context
from typer.main import get_command

from trunnion.cli.app import EXAMPLES, GROUPS, app
from trunnion.cli.terminal import QUIET
from trunnion.errors import Finding, Severity

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "src" / "trunnion"
COLUMNS = 80
SCRIPT_TEXT = re.compile(r"\"[^\"\n]* [^\"\n]*\"|`[^`\n]* [^`\n]*`")


def retired() -> list[str]:
    """The phrases on the left of `retired_phrases.txt`."""
    lines = (Path(__file__).parent / "retired_phrases.txt").read_text("utf-8").splitlines()
    return [line.split(" | ")[0] for line in lines if not line.startswith("#")]


def written(path: Path) -> Iterator[tuple[int, str]]:
    """Line and text of every string of a module that is not its documentation; {…} where an f-string has a value."""
    nodes = list(ast.walk(ast.parse(path.read_text("utf-8"))))
    parts: set[int] = set()
    for node in nodes:
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            parts.add(id(node.value))
        if isinstance(node, ast.JoinedStr):
            parts |= {id(part) for part in node.values}
            yield (
                node.lineno,
                "".join(str(part.value) if isinstance(part, ast.Constant) else "{…}" for part in node.values),
            )
    for node in nodes:
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in parts:
            yield node.lineno, node.value


def shown() -> Iterator[tuple[str, str]]:
    """Place and text of everything that a user can be shown: messages, help, table heads, titles, pages."""
    for path in sorted(SOURCE.rglob("*.py")):
        for line, text in written(path):
            if " " in text:
                yield f"{path.relative_to(ROOT)}:{line}", text
    for path in sorted((SOURCE / "views" / "web").glob("*")):
        if path.suffix == ".j2":
            yield str(path.relative_to(ROOT)), re.sub(r"<[^>]*>|{[{%].*?[}%]}", " ", path.read_text("utf-8"))
        elif path.suffix == ".js":
            for text in SCRIPT_TEXT.findall(path.read_text("utf-8")):
                yield str(path.relative_to(ROOT)), text
    for name, command in get_command(app).commands.items():  # type: ignore[attr-defined]
        yield f"trunnion {name} --help", command.help or ""


def test_no_retired_phrase_comes_back() -> None:
    phrases = re.compile("|".join(rf"\b{re.escape(phrase)}\b" for phrase in retired()), re.IGNORECASE)
    found = [f"{place}: '{hit[0]}' in {text!r}" for place, text in shown() for hit in phrases.finditer(text)]
    assert not found, "\n".join(found)


def test_every_verb_is_described_in_one_line() -> None:
    commands = get_command(app).commands  # type: ignore[attr-defined]
    room = COLUMNS - 2 - 2 - 2 - max(map(len, commands))  # Click's margins
    for name, command in commands.items():
        text = command.get_short_help_str(room)
        assert not text.endswith(("…", "...")), name
        assert text.endswith("."), name


@pytest.mark.parametrize("code", sorted(QUIET))
def test_what_nearly_every_run_has_is_a_note(code: str, capsys: pytest.CaptureFixture[str]) -> None:
    """It is left to the report and to `check`; of the same code a warning is shown."""
    from trunnion.cli.terminal import say

    note = Finding("x", code=code, severity=Severity.NOTE)
    say([note])
    assert not capsys.readouterr().err
    say([note], every=True)
    say([Finding("x", code=code, severity=Severity.WARNING)])
    assert capsys.readouterr().err.count("x") == 2


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [(0.0882063, "m", "88.21 mm"), (0.00148177, "rad", "0.0849°"), (-10605.9, "N m", "−10.61 kN m"), (0.5, "1", "0.5"),
     (4.70609e-16, "1", "4.71×10⁻¹⁶"), (0.5, "mm", "0.5 mm"), (0.00872665, "mm", "8.727 µm"), (12, "deg", "12°")],
)  # fmt: skip
def test_a_finding_has_its_quantities_in_a_unit_that_fits(value: float, unit: str, text: str) -> None:
    from trunnion.results.quantities import readable

    assert readable(value, unit).startswith(text)


def test_two_ends_are_told_apart_in_one_unit() -> None:
    from trunnion.results.quantities import between

    assert between(-10605.9, -10605.5, "N m") == "between −10.6059 and −10.6055 kN m"
    assert between(0.0, 12.0, "N") == "between 0 and 12 N"


def test_the_help_has_each_verb_once_under_a_question_with_examples_that_are_read() -> None:
    commands = get_command(app).commands  # type: ignore[attr-defined]
    assert sorted(name for names in GROUPS.values() for name in names) == sorted(commands)
    for name, command in commands.items():
        for example in EXAMPLES[name]:
            command.make_context(name, example.split(), resilient_parsing=False)


def test_the_help_calls_values_of_options_file_number_or_text() -> None:
    for name, command in get_command(app).commands.items():  # type: ignore[attr-defined]
        assert not re.search(
            r"<(path|int|float|str|list\[\w+\])>", command.get_help(Context(command)).partition("Options:")[2]
        ), name
