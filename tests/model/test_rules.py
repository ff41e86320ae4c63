"""Rules that stand with the fields: what they say, and who reads them."""

from __future__ import annotations

import math
from typing import Any

import pytest

from trunnion import Mechanism, MechanismError
from trunnion.model.parts import Driver, Link, Motor, Pin, Point
from trunnion.model.rules import Directed, NotNegative, Positive, Within, limit_findings, markers
from trunnion.model.schema import json_schema
from trunnion.model.units import KINDS

SHARE = Within(0, 1, "(]", "such as 0.95")
TILT = Within(-math.pi / 4, math.pi / 4)


@pytest.mark.parametrize(
    ("rule", "kind", "value", "what", "remedy"),
    [
        (NotNegative, "mass", -1.0, "is -1 kg, which is negative", "give a value of at least 0"),
        (Positive, "time", 0.0, "is 0 s, which is not above 0", "give a value above 0"),
        (SHARE, "number", 1.1, "is 1.1, which is not above 0 and at most 1", "above 0 and at most 1; such as 0.95"),
        (TILT, "angle", 0.8, "is 45.84 deg, which is not at least -45 deg and at most 45 deg", "of at least -45 deg"),
    ],
)
def test_a_number_outside_its_limits(rule: Within, kind: str, value: float, what: str, remedy: str) -> None:
    (finding,) = limit_findings((rule,), value, KINDS[kind], "here")
    assert (finding.where, finding.what) == ("here", what)
    assert remedy in finding.remedy
    for inside in (math.nan, 0.5, math.nextafter(0.5, 1)):
        assert not list(limit_findings((rule,), inside, KINDS[kind], "here"))


def test_a_limit_is_not_missed_by_rounding() -> None:
    assert not TILT.what(math.nextafter(math.pi / 4, 1), KINDS["angle"])


def test_where_rules_stand() -> None:
    assert markers(Pin)["radius"] == markers(Link)["mass"] == (NotNegative,)
    assert markers(Driver)["period"] == (Positive,)
    assert Directed() in markers(Point)["axis"]
    assert markers(Motor)["effort"] == ()


def test_the_schema_has_the_limits() -> None:
    parts: dict[str, Any] = json_schema()["$defs"]
    assert parts["Link"]["properties"]["mass"]["minimum"] == 0
    assert parts["Driver"]["properties"]["period"]["exclusiveMinimum"] == 0
    efficiency = parts["Motor"]["properties"]["efficiency"]
    assert (efficiency["exclusiveMinimum"], efficiency["maximum"]) == (0, 1)


def test_one_rule_does_not_hide_another() -> None:
    """Names that mean nothing are found beside what the same entry states in vain."""
    data = {
        "links": {"ground": {"points": {"A": [0, 0]}}, "arm": {"points": {"A": [0, 0], "B": [1, 0]}}},
        "joints": {"A": {"type": "revolute", "links": ["ground", "arm"]}},
        "drivers": {"A": {"speed": 1, "dwell": 1}},
        "loads": {"weight": {"link": "arms", "at": "B", "force": [0, -1, 0]}},
        "springs": {"S": {"between": ["ground.A", "arm.C"], "damping": 1}},
    }
    with pytest.raises(MechanismError) as caught:
        Mechanism(**data)
    where = {finding.where for finding in caught.value.findings}
    assert where == {"drivers.A.dwell", "loads.weight.link", "loads.weight.force", "springs.S.between"}
