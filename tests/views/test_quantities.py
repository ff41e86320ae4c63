"""Numbers as they are shown, in units of the model; the browser is held to the same cases in `format.test.mjs`."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

import trunnion
from mechanisms_parts import joined
from trunnion import Mechanism
from trunnion.model.units import shown_as
from trunnion.results.attributes import units_of
from trunnion.results.quantities import between, common, drawn_in, number, parts, prefixed, quantity, read_in, readable

CASES = json.loads((Path(__file__).parent / "number_cases.json").read_text(encoding="utf-8"))


def _given(value):
    return math.nan if value is None else value


@pytest.mark.parametrize(("peak", "unit", "factor", "shown"), CASES["prefixed"])
def test_prefix(peak, unit, factor, shown):
    assert prefixed(peak, unit) == (pytest.approx(factor), shown)


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
    texts = {
        "0.1136 W": (0.1136, "W"), "4.000 mW": (0.004, "W"), "20.00 kW": (2e4, "W"), "0.9500 kN": (950.0, "N"),
        "−0.9500 kN": (-950.0, "N"), "310.0 mN": (0.31, "N"), "3.000 N m": (3.0, "N m"), "0.5000": (0.5, "1"),
    }  # fmt: skip
    assert [quantity(*figure, units).replace("\u00a0", " ") for figure in texts.values()] == [*texts]


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [(4, "1", "4"), (4.0, "", "4"), ("A to B", "", "A to B"), (None, "N", ""), ("2.0", "mm", "2.0\u00a0mm"),
     (math.inf, "N", "∞\u00a0N"), (True, "", "True"), (0, "N", "0\u00a0N")],
)  # fmt: skip
def test_what_tables_also_hold(value, unit, text):
    assert quantity(value, unit) == text


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [(0.0882063, "m", "88.21 mm"), (0.00148177, "rad", "0.0849°"), (-10605.9, "N m", "−10.61 kN m"), (0.5, "1", "0.5"),
     (4.70609e-16, "1", "4.71×10⁻¹⁶"), (0.5, "mm", "0.5 mm"), (0.00872665, "mm", "8.727 µm"), (12, "deg", "12°")],
)  # fmt: skip
def test_a_finding_has_its_quantities_in_a_unit_that_fits(value, unit, text):
    assert readable(value, unit).startswith(text)


def test_two_ends_are_told_apart_in_one_unit():
    assert between(-10605.9, -10605.5, "N m") == "between −10.6059 and −10.6055 kN m"
    assert between(0.0, 12.0, "N") == "between 0 and 12 N"


FEET = {"m": "ft", "N": "lbf", "rad": "deg"}


def test_units_by_hand():
    """1 lbf = 4.4482216152605 N, 1 ft = 0.3048 m."""
    with shown_as(FEET):
        assert parts(4.4482216152605, "N") == ("1", "lbf")
        assert parts(1.3558179483314004, "N m") == ("1", "lbf ft")
        assert parts(0.3048, "m") == ("1", "ft")
        assert parts(304.8, "mm") == ("1", "ft")
        assert readable(6894.757293168361, "Pa") == "1 psi"
        assert readable(1.3558179483314004, "W") == "1 lbf ft/s"
        assert between(4.4482216152605, 8.896443230521, "N") == "between 1 and 2 lbf"
        assert drawn_in(1.0, "m")[1] == read_in("m")[1] == "ft"
        assert quantity(np.pi, "rad") == "180.0°"
    assert parts(4.4482216152605, "N") == ("4.44822", "N")
    with shown_as({"m": "in", "N": "N"}):
        assert parts(0.0254, "m") == ("1", "in")
        assert parts(5000.0, "N") == ("5", "kN")
    with shown_as({"m": "inch", "N m": "in lbf"}):
        assert parts(0.1129848290276167, "N m") == ("1", "in lbf")
    with shown_as({"m": "mm", "N": "kN"}):
        assert parts(0.02, "m") == ("20", "mm")


def test_a_result_is_shown_as_its_model_is_stated():
    crank = Mechanism(
        gravity=["0 ft/s^2", "-32.174 ft/s^2"],
        links={
            "ground": {"points": {"A": ["0 ft", "0 ft"]}},
            "crank": {"points": {"A": ["0 ft", "0 ft"], "B": ["2 ft", "0 ft"]}, "mass": "10 lb", "centre": ["2 ft", 0]},
        },
        joints=joined("ground -A- crank", A={"pin": {"radius": "0.1 ft"}, "friction": 0.1}),
        drivers={"A": {"speed": "60 rpm"}},
        loads={"side": {"link": "crank", "at": "B", "force": ["5 lbf", "0 lbf"]}},
    )
    found = trunnion.analyse(crank, steps=8)
    assert {units_of(found)[si][1] for si in ("m", "N", "N m", "W")} == {"ft", "lbf", "lbf ft", "lbf ft/s"}
    page = trunnion.report(found)
    assert "lbf ft" in page
    assert " N m" not in page.replace("kN m", " N m").split("<script")[0]
    assert "lbf ft" in trunnion.plot(found, "torque").axes[0].get_ylabel()
    assert float(found["drive_effort"].max()) > 20  # the numbers themselves are SI: 10 lb 2 ft are 27 N m
