"""The report of a tolerance analysis is one file that fetches nothing, runs nothing and holds every figure."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from xml.etree import ElementTree

import pytest
from stand_in_tolerances import CASES, odd_names, toleranced
from test_report import Page

from trunnion.views.common.bundle import web_text
from trunnion.views.page import Section
from trunnion.views.readings import readings
from trunnion.views.table import Table
from trunnion.views.tolerance import NOTES, drawable, figure, report

SOURCE = "data:image/svg+xml;base64,"


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in CASES if name != "twelve measures"])
def test_every_kind_of_result_makes_a_well_formed_page(name):
    result = CASES[name]()
    page = Page(report(result))
    assert not page.open
    pictures = [attrs["src"] for tag, attrs in page.tags if tag == "img"]
    assert len(pictures) == len(drawable(readings(result)[0]))
    for picture in pictures:
        ElementTree.fromstring(base64.b64decode(picture.removeprefix(SOURCE)))


@pytest.mark.slow
def test_several_measures_are_told_together_first():
    words = " ".join(Page(report(toleranced(24, 300, measures=2))).words)
    assert words.index("All limits together") < words.index("Measures") < words.index("Toleranced parameters")
    assert words.count("Results") == 2


@pytest.mark.slow
def test_nothing_is_fetched_and_nothing_runs():
    text = report(odd_names())
    assert not re.search(r"https?://", text)
    assert "<script" not in text
    page = Page(text)
    policy = next(attrs["content"] for _, attrs in page.tags if attrs.get("http-equiv") == "Content-Security-Policy")
    style = page.raw[0]
    digest = base64.b64encode(hashlib.sha256(style.encode()).digest()).decode()
    assert policy == f"default-src 'none'; img-src data:; style-src 'sha256-{digest}'"
    for _, attrs in page.tags:
        assert attrs.get("src", SOURCE).startswith(SOURCE)
        assert attrs.get("href", "data:,") in ("data:,", "#notes")
        assert not [name for name in attrs if name.startswith("on") or name == "style"]
    assert "url(" not in style


@pytest.mark.slow
def test_names_are_text():
    words = " ".join(Page(report(odd_names())).words)
    assert "</script><script>alert(1)</script>" in words
    assert "_$ω$ <b>曲柄</b>" in words


@pytest.mark.slow
def test_methods_that_were_run_are_explained():
    words = " ".join(Page(report(CASES["sobol"]())).words)
    assert all(NOTES[name][1] in words for name in ("linear", "quasi-monte-carlo", "sobol"))
    assert NOTES["monte-carlo"][1] not in words
    assert "Wilson" in words
    assert "Wilson" not in " ".join(Page(report(CASES["linear only"]())).words)


@pytest.mark.slow
def test_findings_notes_and_inputs_are_told():
    result = toleranced(24, 300)
    rows = json.loads(result.attrs["findings"])
    result.attrs["findings"] = json.dumps([*rows, {**rows[0], "severity": "note", "what": "a note of its own"}])
    result.attrs["inputs"] = json.dumps([{"path": "links.crank.length", "text": "30 mm", "value": 0.03, "unit": "m"}])
    words = " ".join(Page(report(result)).words)
    assert words.index("the worst case is 0.19°") < words.index("a note of its own") < words.index("Input data")


@pytest.mark.slow
def test_other_parts_may_come_first():
    result = toleranced(24, 300)
    table = Table("chosen", ["tolerance", "cost"], [["AB", "4.507"]])
    part = Section("Allocation", "least cost", [("a picture", figure(result, "contributions"))], [table])
    page = Page(report(result, [part], "What tolerances to buy"))
    words = " ".join(page.words)
    assert words.index("What tolerances to buy") < words.index("Allocation") < words.index("4.507")
    assert words.index("4.507") < words.index("angle of rocker")


def test_every_class_of_the_page_has_a_style():
    style = web_text("report.css") + web_text("page.css")
    classes = set(re.findall(r'class="([a-z-]+)"', web_text("page.html.j2")))
    assert not [name for name in classes if f".{name}" not in style]


def test_print_shows_tables_and_figures_whole():
    printed = web_text("page.css").partition("@media print")[2]
    assert "overflow: visible" in printed
    assert "break-inside: avoid" in printed
