"""Numbers as they are shown; the browser's own rules are held to the same cases in `format.test.mjs`."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from trunnion.results.quantities import common, number, prefixed, quantity

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


def test_a_page_has_one_unit_for_a_quantity():
    """That of its largest figure; what would need more than two zeros, or five digits before the point, has its own."""
    units = common([(4.2, "W"), (0.1136, "W"), (15e3, "N"), (math.nan, "N"), (0.5, "1"), (0.0, "N m")])
    assert units.keys() == {"W", "N"}
    figures = [
        (0.1136, "W"),
        (0.004, "W"),
        (2e4, "W"),
        (950.0, "N"),
        (-950.0, "N"),
        (0.31, "N"),
        (3.0, "N m"),
        (0.5, "1"),
    ]
    texts = ["0.1136 W", "4.000 mW", "20.00 kW", "0.9500 kN", "−0.9500 kN", "310.0 mN", "3.000 N m", "0.5000"]
    assert [quantity(value, unit, units).replace("\u00a0", " ") for value, unit in figures] == texts


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [(4, "1", "4"), (4.0, "", "4"), ("A to B", "", "A to B"), (None, "N", ""), ("2.0", "mm", "2.0\u00a0mm"),
     (math.inf, "N", "∞\u00a0N"), (True, "", "True"), (0, "N", "0\u00a0N")],
)  # fmt: skip
def test_what_tables_also_hold(value, unit, text):
    assert quantity(value, unit) == text
