"""Channels and sensors that measure what the model calls a measure: followed where it is of every position."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import trunnion
from rig_measurements import measured, rocker
from trunnion import Mechanism, MechanismError
from trunnion.rig.reading.measurement import Measurement
from trunnion.rig.reading.rig_file import Rig

RIG = Path(__file__).resolve().parents[2] / "examples" / "rig" / "fourbar-rig.yaml"
STATED = {
    "turned": {"rotation": "D"},
    "peak": {"rotation": "D", "as": "maximum"},
    "there": {"rotation": "D", "at": "60 deg"},
    "span": {"rotation": "D", "over": ["0 deg", "90 deg"]},
}
NAMED = dict.fromkeys(("peak", "there", "span"), "is no n") | {"turn": "the model's measures are turned, peak"}


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


def planned(name: str) -> object:
    """A rig whose only sensor measures a measure of the model."""
    rig = Rig.read(RIG)
    key, sensor = next(iter(rig.sensors.items()))
    schedule = rig.schedule.model_copy(update={"over": {}, "conditions": ()})
    changed = {"sensors": {key: sensor.model_copy(update={"measures": name})}, "set_": {}}
    return trunnion.rig.observe(model(), rig.model_copy(update={**changed, "schedule": schedule}))


VERBS = {
    "compare": lambda name: trunnion.rig.compare(model(), with_channel(name)),
    "identify": lambda name: trunnion.rig.identify(model(), with_channel(name), ["rocker.mass"], ["angle"]),
    "rig": planned,
}


@pytest.mark.parametrize("name", NAMED)
@pytest.mark.parametrize("verb", VERBS)
def test_what_cannot_be_followed_is_named(verb: str, name: str) -> None:
    """A statistic, a place or a window is no course; an unknown name is answered by the nearest one."""
    with pytest.raises(MechanismError) as caught:
        VERBS[verb](name)
    told = " ".join(str(one) for one in caught.value.findings)
    assert name in told
    assert ("did you mean 'turned'" if name == "turn" else "the model gives it") in told
