"""The report of a tolerance analysis is one file that fetches nothing, runs nothing and holds every figure."""

from __future__ import annotations

import base64
import hashlib
import re
from xml.etree import ElementTree

import pytest
from stand_in_tolerances import CASES, odd_names
from test_report import Page

from trunnion.views.common.bundle import web_text
from trunnion.views.readings import readings
from trunnion.views.tolerance import drawable, report

SOURCE = "data:image/svg+xml;base64,"


@pytest.mark.sample(6)
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


def test_print_shows_tables_and_figures_whole():
    printed = web_text("page.css").partition("@media print")[2]
    assert "overflow: visible" in printed
    assert "break-inside: avoid" in printed
