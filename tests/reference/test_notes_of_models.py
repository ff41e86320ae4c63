"""Notes and refusals of what a model states in vain, with what to write instead."""

from __future__ import annotations

from math import pi

import pytest

from mechanisms_parts import Data, revolute
from toleranced import slider_crank
from trunnion import Mechanism, analyse, play


def lever(**options: object) -> Mechanism:
    data: Data = {
        "links": {"ground": {"points": {"A": [0, 0]}}, "lever": {"points": {"A": [0, 0], "P": [1, 0]}}},
        "joints": {"A": {**revolute("ground", "lever"), "pin": {"radius": 0.01}, "friction": 0.1}},
        "drivers": {"A": {"speed": 1.0, "range": [0.0, pi / 2]}},
        **options,
    }
    return Mechanism(trunnion=1, **data)


def rubbing() -> Mechanism:
    return slider_crank(joint_defaults={"pin": {"radius": "5 mm"}, "guide": {"length": "20 mm"}, "friction": 0.1})


@pytest.mark.parametrize(("gravity", "told"), [([0, -9.81], True), ([0, 0], False), (None, False)])
def test_gravity_without_any_mass_is_told(gravity: list[float] | None, told: bool) -> None:
    model = lever(gravity=gravity) if gravity else lever()
    codes = [one.code for one in analyse(model, steps=4).trunnion.findings]
    assert ("model.no_mass" in codes) == told


@pytest.mark.parametrize(
    ("statistic", "reason"), [({}, "no maximum within"), ({"as": "place-of-minimum"}, "no minimum within")]
)
def test_a_dead_centre_that_is_not_passed_says_why(statistic: Data, reason: str) -> None:
    """From 10° to 80° a slider moves one way."""
    measures = {"dead": {"dead_centre": "C", **statistic}}
    model = slider_crank(measures=measures, drivers={"A": {"speed": 5.0, "range": ["10 deg", "80 deg"]}})
    (figure,) = [one for one in analyse(model, steps=36).trunnion.summary if one.name == "dead"]
    assert figure.value is None
    assert reason in figure.note


def test_play_that_is_the_mean_of_a_fit_tells_the_largest() -> None:
    """50 H7/f7: hole +25/0 µm, shaft −25/−50 µm in diameter, so 25 µm on the radius in the mean and 37.5 at most."""
    fits = {"pin": {"fit": "50 mm H7/f7"}}
    for choice, told in (("mean", [37.5e-6]), ("maximum", [])):
        model = slider_crank(joint_defaults=fits, fits=choice)
        found = play(model, ["slide:C"], steps=8).trunnion.findings
        assert [one.figures["largest"] for one in found if one.code == "play.mean_of_fits"] == pytest.approx(told)
