"""Channels and sensors that measure what the model calls a measure: followed where it is of every position."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import trunnion
from rig_measurements import measured, rocker
from trunnion import Mechanism, MechanismError
from trunnion.rig.reading.measurement import Measurement

STATED = {
    "turned": {"rotation": "D"},
    "peak": {"rotation": "D", "as": "maximum"},
    "there": {"rotation": "D", "at": "60 deg"},
    "span": {"rotation": "D", "over": ["0 deg", "90 deg"]},
}


def model() -> Mechanism:
    return Mechanism(**{**rocker().data(), "measures": STATED})


def with_channel(name: str) -> Measurement:
    """What a rig has found of the rotation of D, in a channel that measures a measure of the model."""
    found = measured(channels=("angle",))
    renamed = []
    for condition in found.conditions:
        courses = {"angle": replace(condition.courses["angle"], measures=name)}
        renamed.append(replace(condition, courses=courses))
    return replace(found, conditions=tuple(renamed))


def test_a_measure_of_every_position_is_a_channel() -> None:
    one = trunnion.rig.compare(model(), with_channel("turned"))
    two = trunnion.rig.compare(model(), with_channel("rotation:D"))
    np.testing.assert_array_equal(one["residual"], two["residual"])


@pytest.mark.parametrize("name", ["peak", "there", "span", "turn"])
def test_what_cannot_be_followed_is_named(name: str) -> None:
    """A statistic, a place or a window is no course; an unknown name is answered by the nearest one."""
    with pytest.raises(
        MechanismError, match="did you mean 'turned'" if name == "turn" else "no number of a single position"
    ):
        trunnion.rig.compare(model(), with_channel(name))
