"""Every finding about a result has a code, and its sentence is made of its figures."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import trunnion
from trunnion.errors import Finding, Severity
from trunnion.results.attributes import finding_rows

# place of the code
MAKERS = {
    "Finding.note": 0,
    "Finding.warning": 0,
    "Finding.error": 0,
    "Finding.weighed": 1,
    "draft.note": 0,
    "draft.warn": 0,
}


def made() -> Iterator[tuple[str, int, ast.Call]]:
    """Every call that makes a finding with a code: the module, the place of the code, the call."""
    for path in sorted(Path(trunnion.__file__).parent.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.Call) and (place := MAKERS.get(ast.unparse(node.func))) is not None:
                yield path.name, place, node


def test_every_code_is_written_out() -> None:
    """So that the list of codes in the manual, which is read of the source, is whole."""
    calls = [(file, call.args[place], call) for file, place, call in made() if file not in ("errors.py", "draft.py")]
    assert len(calls) > 100
    for file, code, call in calls:
        assert isinstance(code, ast.Constant), f"{file}:{call.lineno}"
        assert re.fullmatch(r"[a-z_]+\.[a-z_]+", str(code.value)), code.value


@pytest.mark.slow
def test_no_sentence_ends_with_a_full_stop() -> None:
    for path in sorted(Path(trunnion.__file__).parent.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            named = isinstance(node, ast.Assign | ast.AugAssign) and ast.unparse(node).startswith(("what ", "remedy "))
            texts = [node.value] if named else node.args if isinstance(node, ast.Call) and _makes(node) else []
            for text in texts:
                last = text.values[-1] if isinstance(text, ast.JoinedStr) else text
                if isinstance(last, ast.Constant):
                    assert not str(last.value).endswith("."), f"{path.name}:{node.lineno}"


def _makes(call: ast.Call) -> bool:
    return ast.unparse(call.func) in MAKERS


@pytest.mark.parametrize("severity", Severity)
def test_a_finding_has_code_place_and_figures(severity: Severity) -> None:
    make = {Severity.NOTE: Finding.note, Severity.WARNING: Finding.warning, Severity.ERROR: Finding.error}[severity]
    finding = make("load.not_counted", "loads.F", "this load supplies 2 J", "leave it out", work=2.0)
    assert (finding.code, finding.where, finding.severity) == ("load.not_counted", "loads.F", severity)
    assert str(finding) == f"{severity}: loads.F: this load supplies 2 J — leave it out"
    assert finding.figures == {"work": 2.0}
    assert finding == Finding.weighed(severity, "load.not_counted", "loads.F", finding.what, finding.remedy, work=2.0)


def test_figures_can_be_written_as_json() -> None:
    import numpy as np

    finding = Finding.note("a.b", "", "x", condition=np.inf, count=np.int64(3), work=np.float64(0.5))
    assert type(finding.figures["count"]) is int
    row = json.loads(json.dumps(finding_rows([finding]), allow_nan=False))[0]
    assert row["figures"] == {"condition": None, "count": 3, "work": 0.5}


def test_what_was_put_in_has_a_code_by_its_section() -> None:
    codes = [Finding("is wrong", where).code for where in ("links.crank.mass", "--kind", "parameter x", "")]
    assert codes == ["input.links", "input.kind", "input.parameter", "input.file"]


def test_a_part_named_as_a_word_keeps_its_place() -> None:
    assert str(Finding("A locks", "joints.A")) == "error: joint A locks"
    assert str(Finding("a cylindrical joint does not exist", "joints.a")).startswith("error: joints.a: a cylindrical")
