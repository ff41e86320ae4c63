"""Mechanisms with errors for the views: seats that follow the load, one that is given, errors of dimensions."""

from typing import Any

from ruamel.yaml import YAML

import trunnion
from mechanisms_parts import EXAMPLES
from trunnion import Mechanism

FOUR_BAR = """
trunnion: 1
name: Four-bar with one loose pin
space: planar
dimensions: {AB: 30 mm, BC: 90 mm, CD: 70 mm, AD: 100 mm}
links:
  ground: {points: {A: [0, 0], D: [AD, 0]}}
  crank: {points: {A: [0, 0], B: [AB, 0]}}
  coupler: {points: {B: [0, 0], C: [BC, 0]}}
  rocker: {points: {D: [0, 0], C: [CD, 0]}}
joints:
  A: {type: revolute, links: [ground, crank]}
  B: {type: revolute, links: [crank, coupler], pin: {clearance: 0.02 mm}, seat: {xi: 30 deg}}
  C: {type: revolute, links: [coupler, rocker]}
  D: {type: revolute, links: [ground, rocker]}
drivers: {A: {speed: 10 rad/s}}
loads: {brake: {joint: D, resisting_torque: 2 N m, useful: true}}
assembly: {C: [0.09, 0.06]}
"""


def four_bar(steps: int = 72, seat: str = ", seat: {xi: 30 deg}", **errors: str) -> Any:
    """The four-bar with its pin B at ξ = 30°, and with errors of dimensions, analysed."""
    data = YAML(typ="safe").load(FOUR_BAR.replace(", seat: {xi: 30 deg}", seat))
    return trunnion.analyse(Mechanism.model_validate(data | ({"errors": errors} if errors else {})), steps)


def loaded(example: str, steps: int = 72, **values: Any) -> Any:
    """An example with every pin where its load presses it."""
    mechanism = Mechanism.read(EXAMPLES / f"{example}.yaml")
    return trunnion.analyse(mechanism.with_values({"joint_defaults.seat": "loaded"} | values), steps)
