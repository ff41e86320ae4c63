"""Measurements of models as a perfect or a mistaken rig would have them: the model's own courses and noise."""

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np

from mechanisms import four_bar, model
from trunnion import FrictionMethod, Mechanism
from trunnion.rig.modelled import modelled
from trunnion.rig.reading.measurement import Accuracy, Condition, Measurement, Signal

CHANNELS = {"torque": "effort:A", "speed": "rate:A", "brake": "load:brake", "out": "rate:D", "angle": "rotation:D"}
SURE = Accuracy()
UNITS = {"effort": "N m", "rate": "rad/s", "rotation": "rad", "load": "N m", "x": "m"}


@cache
def rocker(friction: float = 0.12, torque: float = 7.0) -> Mechanism:
    """A crank and rocker that turns a brake."""
    data = model(four_bar(), friction=friction, radius=0.02)
    data["loads"] = {"brake": {"joint": "D", "resisting_torque": torque, "useful": True}}
    return Mechanism(trunnion=1, name="crank and rocker", **data)


def exact(mechanism: Mechanism, values: tuple[tuple[str, float], ...], names: tuple[str, ...], count: int) -> Any:
    """The model's courses of the channels under a condition, and its phases."""
    phase = np.arange(count) / count
    blank = {one: course(one, np.zeros((1, count))) for one in names}
    condition = Condition("exact", dict(values), phase, blank)
    return phase, modelled(mechanism, condition, {one: CHANNELS[one] for one in names}, FrictionMethod()).courses


def course(channel: str, turns: Any, accuracy: Accuracy = SURE) -> Signal:
    measures = CHANNELS[channel]
    return Signal(channel, measures, UNITS[measures.partition(":")[0]], turns, accuracy)


def measured(
    mechanism: Mechanism | None = None,
    settings: Sequence[Mapping[str, float]] = ({},),
    channels: Sequence[str] = ("torque", "out"),
    *,
    turns: int = 8,
    positions: int = 36,
    noise: float = 0.02,
    accuracy: Accuracy = SURE,
    seed: int = 1,
    wrong: Callable[[str, Any], Any] = lambda channel, course: course,
) -> Measurement:
    """What a rig would have found of a model. wrong: what it does to the course of a channel."""
    mechanism, random = mechanism or rocker(), np.random.default_rng(seed)
    conditions = []
    for number, values in enumerate(settings, 1):
        phase, theirs = exact(mechanism, tuple(values.items()), tuple(channels), positions)
        found = {}
        for channel in channels:
            true = wrong(channel, theirs[channel])
            true = true * (1 + accuracy.gain * random.normal()) + accuracy.zero * random.normal()
            found[channel] = course(channel, true + noise * random.normal(size=(turns, positions)), accuracy)
        conditions.append(Condition(f"run {number}", dict(values), phase, found, (f"run-{number}.csv",)))
    return Measurement("bench", tuple(conditions))
