"""Tolerances of a mechanism whose pins lie where their loads press them: as `analyse` has it, sample by sample."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trunnion
from trunnion.model.mechanism import Mechanism
from trunnion.studies.tolerance.first_order import study

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
PLAYS = ("O", "A", "P", "K")
ALPHA = np.arcsin(1.02 / 200)  # of both toggle links to the line: 1 mm from it, and the play of the cylinder's pin


def press(seat: str | None = "loaded") -> Mechanism:
    """The toggle press without friction, 0.02 ± 0.01 mm of play in its pins; it dwells from 1.5 to 2 s."""
    data = trunnion.read(EXAMPLES / "toggle-press.yaml").data()
    data["joint_defaults"] = {"pin": {"radius": "20 mm"}}
    for name in PLAYS:
        data["joints"][name]["pin"] = {"radius": "20 mm", "clearance": "0.02 mm"}
    data["tolerances"] = {f"{name}.pin.clearance": "±0.01 mm" for name in PLAYS}
    data["measures"] = {"height": {"point": "punch.P", "axis": "y", "at": "1.7 s", "at_least": "50.06 mm"}}
    mechanism = Mechanism(**data)
    return mechanism if seat is None else mechanism.with_seats(seat)


def test_the_plays_of_a_press_add_up_by_virtual_work() -> None:
    """By Σ Q·c = F δ each pin moves the punch by ρ |Q|/F: 1/cos α of a toggle's pins, 2 tan α of the cylinder's."""
    found = trunnion.tolerance(press(), methods=["linear", "worst-case", "monte-carlo"], samples=24, jobs=1)
    closed = np.array([1 / np.cos(ALPHA)] * 3 + [2 * np.tan(ALPHA)])
    names = [f"joints.{name}.pin.clearance" for name in PLAYS]
    sensitivity = found.sensitivity.sel(parameter=names).values[0]
    assert sensitivity == pytest.approx(closed, abs=5e-6)
    worst = 1e-5 * np.sum(closed)
    assert found.worst_case_upper.values[0] == pytest.approx(worst, rel=1e-3)
    assert found.searched_upper.values[0] == pytest.approx(worst, rel=1e-3)
    free = trunnion.tolerance(press("free"), methods=["linear"], samples=0)
    assert found.nominal.values[0] - free.nominal.values[0] == pytest.approx(2e-5 * np.sum(closed), rel=1e-3)


def test_samples_are_what_analyse_has_of_each() -> None:
    """Figures of a loaded four-bar, at a place, over the turn, and against the nominal one, sample by sample."""
    data = trunnion.read(EXAMPLES / "fourbar-with-play.yaml").data()
    data["tolerances"] = {"crank": "±0.02 mm", "rocker": "±0.03 mm", "B.pin.clearance": "±0.005 mm"}
    data["measures"] = {
        "torque": {"effort": "A", "as": "maximum"}, "lean": {"rotation": "D", "at": "60 deg"},
        "fast": {"rate": "D", "as": "maximum"}, "off": {"rotation": "D", "over": ["60 deg", "150 deg"]},
    }  # fmt: skip
    mechanism = Mechanism(**data)
    sampler = study(mechanism).sampling("monte-carlo", 3, 1).prepare()
    u = sampler.drawn(0)
    values, part = sampler.inputs.values(u), sampler.figures(u)
    nominal = trunnion.analyse(mechanism, steps=720)
    for k in range(3):  # no pin changes sides between 60° and 150°
        numbers: dict[str, Any] = {path: float(np.ravel(values[path])[k]) for path in sampler.inputs.names}
        alone = trunnion.analyse(mechanism.with_values(numbers), steps=720)
        assert part["figure"][:3, k] == pytest.approx(alone.measure_figure.values[:3], rel=1e-7)
        turned = [one.joint_rotation.sel(joint="D").values[120:301] for one in (alone, nominal)]
        assert part["figure"][3, k] == pytest.approx(np.max(np.abs(turned[0] - turned[1])), rel=1e-4)


def test_play_alone_is_about_the_middle_of_the_holes() -> None:
    """The worst case over all positions of the pins does not depend on where loads press them."""
    mechanism = trunnion.read(EXAMPLES / "fourbar-with-play.yaml")
    loaded, free = (trunnion.play(mechanism.with_seats(seat), steps=36) for seat in ("loaded", "free"))
    assert loaded.worst_case.values == pytest.approx(free.worst_case.values, rel=1e-9)


def test_a_position_that_locks_has_no_place_of_its_pins() -> None:
    """No load presses a pin there, so that a figure of the place is not that of pins in the middle."""
    data = trunnion.read(EXAMPLES / "fourbar-with-play.yaml").data()
    data["joint_defaults"]["friction"] = 9.0
    data["tolerances"] = {"crank": "±0.02 mm"}
    data["measures"] = {"lean": {"rotation": "D", "at": "60 deg"}}
    mechanism = Mechanism(**data)
    assert np.isnan(trunnion.analyse(mechanism, steps=12).measure_figure.values).all()
    found = trunnion.tolerance(mechanism, methods=["monte-carlo"], samples=2, jobs=1)
    assert np.isnan(found["nominal"].values).all()
