"""Whole campaigns, from data files to verdicts, efficiencies and friction: the figures may not change unawares."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trunnion
from trunnion.rig.comparison import Verdict
from trunnion.rig.modelled import RIPPLE, over_pulses
from trunnion.rig.virtual.rig_file import pulsed

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
FRICTION = "joint_defaults.friction.coefficient"
SPEED = {"unit": "rpm", "noise": "0.2 rpm", "accuracy": {"zero": "0.1 rpm"}}
TORQUE = {"range": "20 N m", "noise": "10 mN m", "bits": 16, "accuracy": {"gain": "0.1 %", "zero": "15 mN m"}}
COARSE = TORQUE | {"range": "400 N m", "bits": 12, "span": "409.6 N m", "noise": "20 mN m"}  # in steps of 0.2 N m


def cardan_rig(torque, **changes):
    """A Cardan joint between two sensors of torque and speed."""
    measures = {"torque-in": "effort:input", "torque-out": "load:brake"}
    speeds = {"speed-in": "rate:input", "speed-out": "rate:output"}
    sensors = {name: {"measures": what, **torque} for name, what in measures.items()}
    sensors |= {name: {"measures": what, **SPEED} for name, what in speeds.items()}
    rig = {"schedule": {"over": {"misalignment": "0 deg:30 deg:4"}, "turns": 10, "idle": "0.5 s"},
           "set": {"input.speed": "500 rpm"}, "rate": "2 kHz", "encoder": {"per_turn": 60}}  # fmt: skip
    return {"trunnion-rig": 1, "name": "bench", **rig, "sensors": sensors, **changes}


COMPRESSOR = {
    "trunnion-rig": 1, "name": "compressor", "rate": "5 kHz", "encoder": {"per_turn": 3600},
    "schedule": {"over": {"O.speed": ["600 rpm", "1450 rpm"]}, "turns": 25, "idle": "1 s"},
    "sensors": {
        "M": {"measures": "effort:O", "range": "200 N m", "noise": "0.2 N m", "bits": 16,
              "accuracy": {"gain": "0.1 %", "zero": "0.05 N m"}},
        "n": {"measures": "rate:O", "unit": "rpm", "noise": "0.5 rpm"},
    },
}  # fmt: skip
CAMPAIGNS = {
    "true": ("pezzuti-cardan", {}, cardan_rig(TORQUE), 4),
    "less friction": ("pezzuti-cardan", {FRICTION: 0.36}, cardan_rig(TORQUE), 4),
    "steps": (
        "pezzuti-cardan", {FRICTION: 0.36},
        cardan_rig(COARSE, schedule={"over": {"misalignment": ["5 deg", "25 deg"]}, "turns": 20, "idle": "0.5 s"}), 6,
    ),
    "compressor": ("slider-crank", {"S.friction.coefficient": 0.06}, COMPRESSOR, 5),
}  # fmt: skip


Campaign = Callable[[str], tuple[trunnion.Mechanism, Any]]


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """The model as it is in its file, and the measurement of one with another friction, by the name of the campaign."""

    @cache
    def measured(name):
        model, changes, rig, seed = CAMPAIGNS[name]
        mechanism = trunnion.read(EXAMPLES / f"{model}.yaml")
        folder = tmp_path_factory.mktemp("campaign") / "data"
        built = mechanism.with_values(dict(changes)) if changes else mechanism
        trunnion.rig.observe(built, rig, seed).write(folder)
        return mechanism, trunnion.rig.read(folder / "mapping.yaml")

    return measured


@pytest.mark.spread(3)
@pytest.mark.parametrize("name", CAMPAIGNS)
def test_verdicts(campaign, name):
    """Torque at the drive of a joint whose friction is not the model's is not within; everything else is."""
    verdicts = trunnion.rig.compare(*campaign(name)).verdict
    other = verdicts.sel(channel="torque-in").values if name in ("less friction", "steps") else np.empty(0)
    assert np.count_nonzero(verdicts.values == Verdict.WITHIN) == verdicts.size - other.size
    assert set(other.tolist()) <= {Verdict.NOT}


@pytest.mark.spread(2)
@pytest.mark.parametrize(
    ("name", "efficiency", "expanded"),
    [
        ("true", [0.90343, 0.89241, 0.84817, 0.79544], [0.00448, 0.004409, 0.004131, 0.003811]),
        ("less friction", [0.92633, 0.91149, 0.87271, 0.82615], [0.004629, 0.004532, 0.004284, 0.003996]),
        ("steps", [0.92507, 0.84794], [0.016642, 0.015445]),
    ],
)
def test_efficiencies(campaign, name, efficiency, expanded):
    found = trunnion.rig.compare(*campaign(name))
    assert found.efficiency.values == pytest.approx(efficiency, abs=2e-5)
    assert found.efficiency_expanded.values == pytest.approx(expanded, rel=2e-3)


@pytest.mark.spread(2)
@pytest.mark.parametrize(
    ("name", "path", "estimate", "uncertainty", "reduced"),
    [
        ("less friction", FRICTION, 0.359740, 1.6695e-4, 1.149),
        ("steps", FRICTION, 0.354908, 4.259e-3, 0.7186),
        ("compressor", "S.friction.coefficient", 0.060825, 1.7229e-3, 0.9779),
    ],
)
def test_friction(campaign, name, path, estimate, uncertainty, reduced):
    """Estimate, standard uncertainty and reduced χ²; the interval holds the true value but once in twenty."""
    found = trunnion.rig.identify(*campaign(name), {"mu": path})
    assert found.estimate.item() == pytest.approx(estimate, abs=0.02 * uncertainty)
    assert found.standard_uncertainty.item() == pytest.approx(uncertainty, rel=2e-3)
    assert found.reduced_chi_squared.item() == pytest.approx(reduced, rel=2e-3)
    true = CAMPAIGNS[name][1].get(path, 0.42)
    assert found.lower.item() < true < found.upper.item()


PULSES = {name: {"measures": what, "unit": "rpm", "per_turn": 60, "noise": "0.2 rpm"}
          for name, what in {"speed-in": "rate:input", "speed-out": "rate:output"}.items()}  # fmt: skip


def test_speeds_of_pulses_are_compared_as_their_sensor_shows_them(tmp_path):
    """60 pulses smooth the speed of a Cardan joint at 30° by 0.7 rpm: the true model agrees, one 1° off does not."""
    schedule = {"over": {"misalignment": ["15 deg", "30 deg"]}, "turns": 20, "idle": "0.5 s"}
    mechanism = trunnion.read(EXAMPLES / "pezzuti-cardan.yaml")
    trunnion.rig.observe(mechanism, cardan_rig({}, sensors=PULSES, schedule=schedule), 1).write(tmp_path)
    data = trunnion.rig.read(tmp_path / "mapping.yaml")
    assert np.all(trunnion.rig.compare(mechanism, data).verdict == Verdict.WITHIN)
    bent = [one.values | {"misalignment": one.values["misalignment"] + np.radians(1)} for one in data.conditions]
    pairs = zip(data.conditions, bent, strict=True)
    other = replace(data, conditions=tuple(replace(one, values=values) for one, values in pairs))
    assert np.all(trunnion.rig.compare(mechanism, other).verdict.sel(channel="speed-out") != Verdict.WITHIN)


@pytest.mark.parametrize("per_turn", [24, 60])
def test_pulses_at_any_angle_show_the_mean_of_a_speed(per_turn):
    """The sensor of the virtual rig, begun at 40 places of a pulse: the mean of what it shows, and its scatter."""
    count, duration = 36_000, 0.12
    phase = np.arange(count) / count
    speed = (
        np.cos(np.radians(30)) / (1 - (np.sin(np.radians(30)) * np.cos(2 * np.pi * phase)) ** 2) * 2 * np.pi / duration
    )
    three = np.tile(speed, 4)
    begins = np.searchsorted(np.cumsum(speed) * duration / count, 2 * np.pi / per_turn * np.arange(40) / 40)
    shown = [
        pulsed(three[k:], slice(0, three.size - k), per_turn, count / duration)[count - k :][:count] for k in begins
    ]
    every = slice(None, None, count // 360)
    mean = over_pulses(speed[every], phase[every], duration, per_turn)
    taken = speed[every] - mean
    assert mean == pytest.approx(np.mean(shown, axis=0)[every], abs=0.01 * np.max(np.abs(taken)))
    assert np.sqrt(np.mean(np.var(shown, axis=0))) == pytest.approx(RIPPLE * np.sqrt(np.mean(taken**2)), rel=0.02)
