"""A misfit over a part of the cycle: found with its place, and hardly ever of a true model."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trunnion
from rig_measurements import course, measured, rocker
from trunnion.rig.comparison.assessment import SignalAssessment, Verdict, judge
from trunnion.rig.comparison.stretches import CHANCE
from trunnion.rig.reading.measurement import Accuracy
from trunnion.rig.reading.rig_file import Rig

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
COUNT = 60
TRUE = 10 + 3 * np.sin(2 * np.pi * np.arange(COUNT) / COUNT)
ACCURACY = [(0.0, 0.0), (0.3, 0.0), (0.05, 0.01)]


def judged(random: Any, turns: int, zero: float, gain: float, smooth: int, off: Any = 0.0) -> SignalAssessment:
    """A course of a true model, or of one that is off by so much, with noise that goes on over `smooth` positions."""
    kernel = np.fft.rfft(np.ones(smooth) / smooth**0.5, COUNT)
    noise = np.fft.irfft(np.fft.rfft(random.normal(size=(turns, COUNT)), axis=1) * kernel, COUNT)
    found = TRUE * (1 + gain * random.normal()) + zero * random.normal() + 0.2 * noise
    return judge(course("torque", found, Accuracy(zero, gain)), TRUE + off, np.ones(COUNT, bool), closed=True)


@pytest.mark.spread(5)
@pytest.mark.parametrize("turns", [3, 5, 30])
@pytest.mark.parametrize(("zero", "gain"), ACCURACY)
@pytest.mark.parametrize("smooth", [1, 9, 12])
def test_a_true_model_hardly_ever_misses_over_a_stretch(turns: int, zero: float, gain: float, smooth: int) -> None:
    """In CHANCE of the courses at most: of 150 that is 1.5, and more than 6 one in a thousand times."""
    random = np.random.default_rng(11)
    found = [judged(random, turns, zero, gain, smooth) for _ in range(150)]
    assert sum(one.stretch is not None for one in found) <= 4 * CHANCE * 150
    assert np.mean([one.verdict is Verdict.WITHIN for one in found]) >= 0.9


@pytest.mark.parametrize(("zero", "gain"), ACCURACY[1:])
@pytest.mark.parametrize("start", [10, 57])
def test_a_tenth_of_the_positions_is_found_where_it_is(zero: float, gain: float, start: int) -> None:
    """Six of sixty positions off by 8 u, which their share alone lets pass; also over the end of the cycle."""
    random, places = np.random.default_rng(3), (start + np.arange(6)) % COUNT
    off = np.zeros(COUNT)
    off[places] = -8 * np.hypot(0.2 / 12**0.5, np.hypot(zero, 10 * gain))
    found = [judged(random, 12, zero, gain, 1, off) for _ in range(40)]
    passed = [one for one in found if one.within >= one.least]
    assert len(passed) >= 30
    named = [one.stretch for one in found if one.stretch is not None]
    assert len(named) >= 36
    assert all(one.verdict is Verdict.NOT for one in found if one.stretch is not None)
    assert np.mean([set(one.positions) == set(places.tolist()) for one in named]) > 0.7
    assert all(one.mean > one.expanded for one in named)


def test_a_stretch_is_told_with_its_place() -> None:
    """From 90° to 120°, an eleventh of the cycle, the torque is 1.5 N m more than the model has."""

    def wrong(channel: str, true: Any) -> Any:
        more = np.zeros(36)
        more[9:13] = 1.5
        return true + more if channel == "torque" else true

    result = trunnion.rig.compare(rocker(), measured(accuracy=Accuracy(zero=0.1), turns=12, wrong=wrong))
    torque = result.sel(channel="torque").isel(condition=0)
    assert torque.within >= torque.within_least
    assert torque.verdict == Verdict.NOT
    assert not result.attrs["all_within"]
    (told,) = (one for one in result.trunnion.findings if one.code == "compare.local")
    assert told.where == "channels.torque"
    assert np.degrees([told.figures["start"], told.figures["end"]]) == pytest.approx([90, 120])
    assert told.figures["mean"] == pytest.approx(1.5, abs=0.3)
    assert told.figures["percent"] == pytest.approx(100 * 4 / int(torque.compared.sum()), abs=0.01)
    assert "compare.not_within" not in {one.code for one in result.trunnion.findings}


def test_true_models_on_virtual_rigs_pass() -> None:
    """Of forty rigs with errors of their sensors as stated, at most a few channels of 80 miss over a stretch alone."""
    torque = {"range": "10 N m", "noise": "10 mN m", "bits": 14, "accuracy": {"gain": "0.5 %", "zero": "20 mN m"}}
    sensors = {"T1": {"measures": "effort:A", **torque}, "T2": {"measures": "load:work", **torque},
               "n1": {"measures": "rate:A", "unit": "rpm", "noise": "0.2 rpm"}}  # fmt: skip
    bench: dict[str, Any] = {"trunnion-rig": 1, "schedule": {"turns": 6, "idle": "0.2 s"}, "rate": "500 Hz",
                             "encoder": {"per_turn": 90}, "sensors": sensors}  # fmt: skip
    mechanism, flipped = trunnion.read(EXAMPLES / "toleranced-fourbar.yaml"), 0
    for seed in range(40):
        seen = trunnion.rig.observe(mechanism, Rig(**bench), seed=seed)
        result = trunnion.rig.compare(mechanism, seen.measurement(90))
        flipped += int(np.sum((result.within >= result.within_least) & (result.verdict == Verdict.NOT)))
    assert flipped <= 3
