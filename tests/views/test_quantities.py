"""Numbers as they are shown; the browser's own rules are held to the same cases in `format.test.mjs`."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from trunnion.results.quantities import number, prefixed, quantity

CASES = json.loads((Path(__file__).parent / "number_cases.json").read_text(encoding="utf-8"))


def _given(value):
    return math.nan if value is None else value


@pytest.mark.parametrize(("peak", "unit", "factor", "shown"), CASES["prefixed"])
def test_prefix(peak, unit, factor, shown):
    got = prefixed(peak, unit)
    assert got == (pytest.approx(factor), shown)


@pytest.mark.parametrize(("value", "text"), CASES["number"])
def test_number(value, text):
    assert number(_given(value)) == text


@pytest.mark.parametrize(("value", "unit", "text"), CASES["quantity"])
def test_quantity(value, unit, text):
    assert quantity(_given(value), unit).replace(" ", "\u00a0") == text


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [(4, "1", "4"), (4.0, "", "4"), ("A to B", "", "A to B"), (None, "N", ""), ("2.0", "mm", "2.0\u00a0mm"),
     (math.inf, "N", "∞\u00a0N"), (True, "", "True"), (0, "N", "0\u00a0N")],
)  # fmt: skip
def test_what_tables_also_hold(value, unit, text):
    assert quantity(value, unit) == text
