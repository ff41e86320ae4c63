"""How often 95 % intervals hold true frictions where a torque is read in steps and sampled alike in every turn."""

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

import trunnion

Array = NDArray[np.float64]
TRUE = {"A": 0.08, "B": 0.14, "C": 0.11, "D": 0.06}
RADII = {"A": "15 mm", "B": "10 mm", "C": "10 mm", "D": "12 mm"}
LINKS = {"A": ["ground", "crank"], "B": ["crank", "coupler"], "C": ["coupler", "rocker"], "D": ["ground", "rocker"]}
MODEL = {
    "trunnion": 1,
    "space": "planar",
    "gravity": [0, -9.81],
    "dimensions": {"AB": "60 mm", "BC": "220 mm", "CD": "140 mm", "AD": "200 mm"},
    "links": {
        "ground": {"points": {"A": [0, 0], "D": ["AD", 0], "F": ["330 mm", "120 mm"]}},
        "crank": {"points": {"A": [0, 0], "B": ["AB", 0]}, "mass": 1.2, "centre": [0.02, 0], "inertia": 0.002},
        "coupler": {"points": {"B": [0, 0], "C": ["BC", 0]}, "mass": 1.8, "centre": [0.11, 0], "inertia": 0.009},
        "rocker": {"points": {"D": [0, 0], "C": ["CD", 0]}, "mass": 1.5, "centre": [0.07, 0], "inertia": 0.004},
    },
    "joints": {key: {"type": "revolute", "links": LINKS[key], "pin": {"radius": RADII[key]}} for key in TRUE},
    "joint_defaults": {"friction": 0.1},
    "drivers": {"A": {"speed": "120 rpm"}},
    "springs": {"s": {"between": ["ground.F", "rocker.C"], "stiffness": "6 N/mm", "free_length": "60 mm"}},
    "assembly": {"C": ["180 mm", "140 mm"]},
}
COEFFICIENTS = [f"{joint}.friction.coefficient" for joint in TRUE]
STEP = 0.2  # N m


@cache
def torque(rpm):
    """Of the drive with the true frictions, at 3600 angles, N m."""
    values = {**dict(zip(COEFFICIENTS, TRUE.values(), strict=True)), "A.speed": f"{rpm} rpm"}
    found = trunnion.analyse(trunnion.Mechanism(**MODEL).with_values(values), steps=3600)
    return np.asarray(found["drive_effort"].values, float).ravel()


def identified(folder, seed, noise, rpm=120.0, positions=360):
    """The frictions by 12 turns of a sensor with errors of its own, sampled at 1 kHz; noise: in steps."""
    random = np.random.default_rng(seed)
    time = np.arange(int(12.7 * 60 / rpm * 1000)) / 1000
    angle = random.uniform(0, 360) + 6 * rpm * time
    true = np.interp(angle, np.arange(3600) / 10, torque(rpm), period=360)
    read = true * (1 + 0.001 * random.normal()) + random.normal() + noise * STEP * random.normal(size=time.size)
    rows = zip(time, angle % 360, STEP * np.rint(read / STEP), strict=True)
    (folder / "a.csv").write_text("\n".join(["t;phi;M", *(f"{t:.3f};{a:.4f};{m:.3f}" for t, a, m in rows)]))
    accuracy = {"gain": "0.1 %", "zero": "1 N m"}
    mapping = {
        "trunnion-data": 1,
        "time": {"column": "t", "unit": "s"},
        "angle": {"from": "column", "column": "phi", "unit": "deg"},
        "channels": {"M": {"column": "M", "measures": "effort:A", "unit": "N m", "accuracy": accuracy}},
        "set": {"A.speed": f"{rpm} rpm"},
        "positions": positions,
    }
    return trunnion.rig.identify(
        trunnion.Mechanism(**MODEL), trunnion.rig.read(mapping, [folder / "a.csv"]), COEFFICIENTS
    )


def held(result):
    """Whether each interval holds."""
    true = np.array(list(TRUE.values()))
    return np.asarray((result["lower"].values <= true) & (true <= result["upper"].values))


def test_steps_that_repeat_are_a_source(tmp_path):
    """Of the friction at D they are most of the variance, but of turns that are not sampled alike."""
    found = {rpm: [identified(tmp_path, seed, 0.25, rpm) for seed in (1, 2, 3)] for rpm in (120.0, 118.3)}
    shares = {
        rpm: np.mean([one["share"].sel(parameter=COEFFICIENTS[-1], source="resolution") for one in results])
        for rpm, results in found.items()
    }
    assert shares[120.0] > 0.5
    assert shares[118.3] < 0.2
    assert np.mean([held(one) for results in found.values() for one in results]) > 0.8
    assert 0.6 < np.mean([float(one["reduced_chi_squared"]) for one in found[120.0]]) < 1.2


@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.02, pytest.param(0.1, marks=pytest.mark.slow)])
def test_a_file_that_spans_three_steps_has_those_of_the_others(tmp_path, noise):
    """The torque into a Cardan joint at 5°, whose two levels tell no step; of 12 rigs of a true 95 % one misses."""
    friction, cardan = "joint_defaults.friction.coefficient", trunnion.read("examples/pezzuti-cardan.yaml")
    torque = {"measures": "effort:input", "range": "25 N m", "span": "25.6 N m", "bits": 8,
              "noise": f"{noise * STEP} N m", "accuracy": {"gain": "0.1 %", "zero": "0.1 N m"}}  # fmt: skip
    schedule = {"over": {"misalignment": ["5 deg", "25 deg"]}, "turns": 10, "idle": "0.3 s"}
    rig = {"trunnion-rig": 1, "schedule": schedule, "set": {"input.speed": "500 rpm"}, "rate": "2 kHz",
           "encoder": {"per_turn": 360}, "sensors": {"T": torque}}  # fmt: skip
    seen = trunnion.rig.observe(cardan.with_values({friction: 0.36}), rig)
    hits = 0
    for seed in range(12):
        seen.seeded(seed).write(tmp_path)
        data = trunnion.rig.read(tmp_path / "mapping.yaml")
        assert [one.courses["T"].accuracy.resolution for one in data.conditions] == pytest.approx([STEP, STEP])
        result = trunnion.rig.identify(cardan, data, [friction], channels=["T"])
        hits += bool(result["lower"].item() <= 0.36 <= result["upper"].item())
    assert hits >= 11


def test_fewer_positions_than_unknowns(tmp_path):
    found = identified(tmp_path, 1, 0.25, positions=8)
    assert "parameter.not_told_apart" in {one.code for one in found.trunnion.findings}
    assert np.isnan(found.estimate.values).any()


@pytest.mark.slow
@pytest.mark.parametrize(("noise", "seeds"), [(0.25, 300), (0.1, 150)])
def test_coverage_where_steps_repeat(tmp_path, noise, seeds):
    """Of 300 measurements 88 % at least: of a true 93 % that fails in 0.03 % of cases, of 80 % in all but 0.03 %."""
    every = np.array([held(identified(tmp_path, seed, noise)) for seed in range(seeds)])
    assert np.all(np.mean(every, axis=0) >= 0.88), np.mean(every, axis=0)
    assert 0.9 <= np.mean(every) <= 0.99
