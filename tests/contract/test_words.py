"""Sentences agree with their numbers, and say what is so."""

import json
import re

import numpy as np
import pytest
from ruamel.yaml import YAML

from trunnion import Mechanism, analyse, check, sweep
from trunnion.results.attributes import summary_of
from trunnion.views.cycle.deviations import continued

ENGINE = """
trunnion: 1
space: planar
gravity: [0, 0]
links:
  frame: {points: {O: [0, 0], S: {at: [0, 0], axis: [1, 0]}}}
  crank: {points: {O: [0, 0], P: [35 mm, 0]}, mass: 1 kg, inertia: 0.001}
  rod: {points: {P: [0, 0], Q: [130 mm, 0]}}
  piston: {points: {Q: [0, 0], S: {at: [0, 0], axis: [1, 0]}}}
joints:
  O: {type: revolute, links: [frame, crank], pin: {radius: 10 mm}, friction: 0.1}
  P: {type: revolute, links: [crank, rod]}
  Q: {type: revolute, links: [rod, piston]}
  S: {type: prismatic, links: [frame, piston]}
drivers: {S: {speed: 0.01 m/s, range: [95 mm, 150 mm]}}
"""
FOUR_BAR = """
trunnion: 1
space: planar
gravity: [0, 0]
links:
  ground: {points: {A: [0, 0], D: [100 mm, 0]}}
  crank: {points: {A: [0, 0], B: [40 mm, 0]}}
  coupler: {points: {B: [0, 0], C: [80 mm, 0]}}
  rocker: {points: {D: [0, 0], C: [80 mm, 0]}}
joints:
  A: {type: revolute, links: [ground, crank], pin: {radius: 10 mm}, friction: 0.1}
  B: {type: revolute, links: [crank, coupler]}
  C: {type: revolute, links: [coupler, rocker]}
  D: {type: revolute, links: [ground, rocker]}
drivers: {A: {speed: 1 rad/s}}
"""


def model(text, **more):
    return Mechanism.model_validate(YAML(typ="safe").load(text) | more)


def said(mechanism, steps=24):
    return json.loads(analyse(mechanism, steps).attrs["findings"])


def told_of_assembly(mechanism):
    return [one["what"] for one in said(mechanism) if one["code"] == "assembly.choice"]


@pytest.mark.slow
def test_a_hint_that_starts_in_a_dead_centre_decides_beside_it():
    """At 95 mm both assemblies are one; the pin goes up if the hint lies above, else down."""
    for side in (1.0, -1.0):
        mechanism = model(ENGINE, assembly={"P": ["0 mm", f"{35 * side} mm"]})
        assert told_of_assembly(mechanism) == []
        place = analyse(mechanism, 24)["point_position"].sel(point="crank.P", axis="y").values
        assert np.sign(np.nanmean(place)) == side


def test_no_locking_margin_where_nothing_can_be_assembled():
    mechanism = model(FOUR_BAR).with_values({"links.coupler.points.C.x": "5 mm", "links.rocker.points.C.x": "5 mm"})
    result = analyse(mechanism, 24)
    assert np.isnan(result["locking_margin"].values).all()
    (figure,) = [one for one in summary_of(result) if one.name == "locking_margin"]
    assert (figure.value, figure.aspect) == (None, "")


def test_one_point_of_a_sweep_has_no_figures():
    result = sweep(model(FOUR_BAR), {"links.coupler.points.C.x": ["80 mm", "5 mm"]}, 24)
    (what,) = [one["what"] for one in json.loads(result.attrs["findings"]) if one["code"] == "sweep.no_answer"]
    assert re.match(r"1 of 2 points has no result", what)


def test_beta_stays_within_a_turn():
    """Ends of which one goes round and round against the other."""
    way = np.linspace(0.0, 6 * np.pi, 400)
    beta = np.angle(np.exp(1j * way))  # as it is told, in (−π, π]
    xi = np.angle(np.exp(1j * (0.3 + np.round((beta - way) / (2 * np.pi)) * np.pi)))
    shown, direction = continued(beta, xi)
    assert np.abs(shown).max() <= 2 * np.pi * (1 + 1e-6)
    for sign in (1.0, -1.0):  # the same places of both ends
        one, other = xi + sign * beta / 2, direction + sign * shown / 2
        assert np.allclose(np.cos(one - other), 1.0)
    steps = np.abs(np.diff(shown))
    assert np.count_nonzero(steps > 1.0) <= 3  # whole turns only, at which the curve is broken


def test_a_check_says_what_the_hint_is():
    assert not [one for one in check(model(ENGINE, assembly={"P": ["0 mm", "35 mm"]})).findings if "hint" in one.what]
