"""Every finding about a result has a code, and its sentence is made of its figures."""

from __future__ import annotations

import json
import re
from string import Formatter

import pytest

from trunnion.errors import Finding, Severity
from trunnion.results.attributes import finding_rows
from trunnion.results.sentences import finding_for
from trunnion.results.sentences.codes import SENTENCES
from trunnion.results.sentences.cycle import CYCLE
from trunnion.results.sentences.dynamics import DYNAMICS
from trunnion.results.sentences.structure import STRUCTURE
from trunnion.results.sentences.studies import STUDIES


def test_no_code_is_given_twice() -> None:
    assert len(SENTENCES) == len(CYCLE) + len(STRUCTURE) + len(STUDIES) + len(DYNAMICS)


@pytest.mark.parametrize("code", SENTENCES)
def test_a_code_has_a_sentence(code: str) -> None:
    assert re.fullmatch(r"[a-z_]+\.[a-z_]+", code)
    sentence = SENTENCES[code]
    assert isinstance(sentence.severity, Severity)
    for text in (sentence.what, sentence.remedy):
        if isinstance(text, str):
            assert not text.endswith(".")
            assert all(name is None or name for _, name, _, _ in Formatter().parse(text))


def test_a_finding_is_told_by_its_figures() -> None:
    one = finding_for("load.not_counted", "loads.F", drive=2.0, work=1.5)
    assert (one.code, one.where, one.severity) == ("load.not_counted", "loads.F", Severity.NOTE)
    assert one.figures == {"drive": 2.0, "work": 1.5}
    assert "which supplies 2 J, this load supplies 1.5 J" in one.what


def test_lists_counts_and_the_infinite_are_told_in_words() -> None:
    assert finding_for("model.point_mass", links=["a", "b"]).what.startswith("a, b have a mass")
    choice = finding_for("assembly.choice", links=["a"], ways=2, phrases={"why": "", "remedy": "", "used": ""})
    assert "have 2 assembly modes" in choice.what
    endless = finding_for("position.near_singular", at="at 3°", condition=float("inf"))
    assert endless.what.endswith("up to ∞")
    assert json.loads(json.dumps(finding_rows([endless]), allow_nan=False))[0]["figures"]["condition"] is None


def test_what_was_put_in_has_a_code_by_its_section() -> None:
    codes = [Finding("is wrong", where).code for where in ("links.crank.mass", "--kind", "parameter x", "")]
    assert codes == ["input.links", "input.kind", "input.parameter", "input.file"]


def test_a_part_named_as_a_word_keeps_its_place() -> None:
    assert str(Finding("A locks", "joints.A")) == "error: joint A locks"
    assert str(Finding("a cylindrical joint does not exist", "joints.a")).startswith("error: joints.a: a cylindrical")
