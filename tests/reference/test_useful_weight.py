"""A weight that is lifted as the purpose, against the same weight stated as a load."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

import trunnion
from trunnion import Mechanism, MechanismError

G, MASS = 9.81, 1500.0


def lift(space: str, friction: float, weight: dict[str, Any], gravity: float, **more: Any) -> Mechanism:
    """A slider on an inclined guide, driven up it by a motion that begins and ends at rest."""
    guide = {"guide": {"length": 0.8}}
    slope = [np.cos(0.6), np.sin(0.6)]
    flat = [0.0] if space == "spatial" else []
    centre = [0.1, 0.3, *flat]
    element = {"at": [0, 0, *flat], "axis": [*slope, *flat]}
    load = {"loads": {"weight": {"link": "cage", "at": "C", "force": [0, -MASS * G, *flat], "useful": True}}}
    return Mechanism(
        space=space,
        gravity=[0, -gravity, *flat],
        links={
            "ground": {"points": {"S": element}},
            "cage": {"points": {"S": element, "C": centre}, "mass": MASS, "centre": centre, **weight},
        },
        joints={"S": {"type": "prismatic", "links": ["ground", "cage"], "friction": friction, **guide}},
        drivers={"S": {"law": "cycloidal", "range": [0, 2], "duration": 4, "returns": False}},
        **({} if gravity else load),
        **more,
    )


@pytest.mark.parametrize("space", ["planar", "spatial"])
@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_a_weight_is_useful_as_a_load_is(space: str, friction: float) -> None:
    one = trunnion.analyse(lift(space, friction, {"useful": True}, G), steps=20)
    other = trunnion.analyse(lift(space, friction, {}, 0.0), steps=20)
    for name in ("efficiency", "useful_power", "efficiency_instant"):
        assert one[name].values == pytest.approx(other[name].values, rel=1e-9, nan_ok=True), name
    assert float(one.efficiency) == pytest.approx(1.0, rel=1e-9) if friction == 0 else 0.3 < float(one.efficiency) < 1


def test_locking_counts_it() -> None:
    """Backward the weight drives: the efficiency backward of an incline of 0.6 rad is 2 − 1/η, of useful weight too."""
    numbers = [
        {row["name"]: row["value"] for row in json.loads(trunnion.locking(model, steps=12).attrs["summary"])}
        for model in (lift("planar", 0.05, {"useful": True}, G), lift("planar", 0.05, {}, 0.0))
    ]
    assert 0 < numbers[0]["efficiency_reverse"] < 1
    assert numbers[0]["efficiency_reverse"] == pytest.approx(numbers[1]["efficiency_reverse"], rel=1e-6)


def test_without_a_weight_it_is_a_finding() -> None:
    with pytest.raises(MechanismError, match="no weight"):
        lift("planar", 0.0, {"useful": True, "mass": 0.0}, G)
    with pytest.raises(MechanismError, match="no weight"):
        lift("planar", 0.0, {"useful": True}, 0.0)
