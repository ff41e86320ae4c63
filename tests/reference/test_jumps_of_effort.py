"""A largest effort beside a jump of a load: it depends on where the positions are, and that is said with a bound."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import trunnion

PRESS: dict[str, Any] = {
    "trunnion": 1,
    "space": "planar",
    "gravity": [0, 0],
    "links": {
        "frame": {"points": {"O": [0, 0], "S": {"at": [0, 0], "axis": [1, 0]}}},
        "crank": {"points": {"O": [0, 0], "P": ["30 mm", 0]}},
        "rod": {"points": {"P": [0, 0], "Q": ["200 mm", 0]}},
        "ram": {"points": {"Q": [0, 0], "S": {"at": [0, 0], "axis": [1, 0]}}},
    },
    "joints": {
        "O": {"type": "revolute", "links": ["frame", "crank"]},
        "P": {"type": "revolute", "links": ["crank", "rod"]},
        "Q": {"type": "revolute", "links": ["rod", "ram"]},
        "S": {"type": "prismatic", "links": ["frame", "ram"], "guide": {"length": "150 mm"}},
    },
    "drivers": {"O": {"speed": "60 rpm", "start": "180 deg"}},
    "loads": {"cut": {"link": "ram", "at": "Q", "force": ["-50 kN * between(drive, 320.3 deg, 350 deg)", 0]}},
    "assembly": {"Q": ["170 mm", 0]},
}


def told(force: str, steps: int) -> tuple[float, list[Any]]:
    """The largest effort, and what is said of it."""
    data = {**PRESS, "loads": {"cut": {**PRESS["loads"]["cut"], "force": [force, 0]}}}
    result = trunnion.analyse(trunnion.Mechanism.model_validate(data), steps)
    found = [one for one in result.trunnion.findings if one.code == "effort.beside_jump"]
    return float(np.abs(result["drive_effort"]).max()), found


@pytest.mark.parametrize("steps", [45, 180])
def test_the_bound_holds(steps: int) -> None:
    force = PRESS["loads"]["cut"]["force"][0]
    coarse, (finding,) = told(force, steps)
    fine, _ = told(force, 36_000)
    assert 0 < fine - coarse <= 1.05 * finding.figures["more"]


def test_a_load_that_rises_is_no_jump() -> None:
    assert told("-50 kN * max(sin(drive), 0)", 180)[1] == []


def test_sweeps_and_tolerances_tell_it_too() -> None:
    """With the bound that `analyse` has; a tolerance only of an extreme of the effort."""
    _, (one,) = told(PRESS["loads"]["cut"]["force"][0], 180)
    tolerances = {"rod.points.Q.x": "±0.05 mm"}
    model = trunnion.Mechanism.model_validate({**PRESS, "tolerances": tolerances})
    swept = trunnion.sweep(model, {"rod.points.Q.x": [0.2, 0.201]}, steps=180).trunnion.findings
    assert [found.figures for found in swept if found.code == "effort.beside_jump"] == [one.figures]
    for measure, expected in (("effort:O", []), ("maximum:effort:O", [("warning", one.figures)])):
        found = trunnion.tolerance(model, [measure], methods=("linear",), steps=180).trunnion.findings
        assert [(f.severity, f.figures) for f in found if f.code == "tolerance.beside_jump"] == expected


def test_play_and_allocations_tell_it_too() -> None:
    """Of the extreme of an effort, with the same bound."""
    _, (one,) = told(PRESS["loads"]["cut"]["force"][0], 180)
    joints = {**PRESS["joints"], "P": {**PRESS["joints"]["P"], "pin": {"radius": "25 mm", "clearance": "20 um"}}}
    measures = {"torque": {"effort": "O", "as": "maximum", "limit": "±50 N m"}}
    more = {
        "tolerances": {"rod.points.Q.x": "±0.05 mm"},
        "costs": {"rod.points.Q.x": {"model": "power", "B": 1, "k": 1}},
    }
    model = trunnion.Mechanism.model_validate({**PRESS, "joints": joints, "measures": measures, **more})
    for result in (trunnion.play(model, steps=180), trunnion.allocate(model, steps=180, samples=0)):
        (found,) = (one for one in result.trunnion.findings if one.code.endswith("beside_jump"))
        assert (found.severity, found.figures) == ("warning", one.figures)
