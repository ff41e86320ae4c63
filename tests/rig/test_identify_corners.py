"""Corners of a load table in measured data: they do not bias a friction coefficient, and its interval holds."""

import numpy as np
import pytest

import trunnion
from trunnion.rig.identification.fit import corners
from trunnion.rig.virtual.rig_file import Rig

GUIDE = "S.friction.coefficient"
TRUE = 0.08
PRESSURE = {"at": "Q", "link": "piston", "force": ["-pressure * pi / 4 * bore^2", 0], "useful": True}
JUMP = {"at": "Q", "link": "piston", "force": ["-1.5 kN * between(drive, 290 deg, 355 deg)", 0], "useful": True}


def marked(value, u=1e-3, guard=1):
    return np.flatnonzero(corners(value, np.full(len(value), u), closed=True, guard=guard)).tolist()


def test_a_corner_marks_the_positions_beside_it_where_it_shows():
    """|x − 30.4| over positions: a change of slope by 2 is rounded off by up to 2/8 = 0.25, 4 u is a quarter of it."""
    roof = 5 * np.abs((np.arange(90) - 30.4 + 45) % 90 - 45)
    assert marked(roof, u=1.0) == [30, 31, 75, 76]
    assert marked(roof, u=10.0) == []
    assert marked(100 * np.sin(2 * np.pi * np.arange(90) / 90)) == []  # a curve


def test_a_jump_is_a_corner():
    wave = 100 * np.sin(2 * np.pi * np.arange(90) / 90)
    step = (np.arange(90) > 50) * 10.0
    assert {50, 51, 0, 89} <= set(marked(wave + step))


def test_of_very_many_corners_the_largest_are_left_out():
    """At most a third of the positions, with the guard on both sides."""
    x = np.arange(360)
    found = marked(np.where(x % 12 == 0, 1.0 + x / 360, 0.0), guard=4)
    assert 90 < len(found) <= 120
    assert min(found) > 150


def rig(rate, noise):
    """A compressor on a rig: torque and an encoder, three speeds."""
    torque = {"measures": "effort:O", "range": "200 N m", "noise": noise, "bits": 16,
              "accuracy": {"gain": "0.1 %", "zero": "0.05 N m"}}  # fmt: skip
    data = {
        "trunnion-rig": 1,
        "schedule": {"over": {"O.speed": ["600 rpm", "1000 rpm", "1450 rpm"]}, "turns": 20, "idle": "0.3 s"},
        "rate": rate,
        "encoder": {"per_turn": 360, "index": "z"},
        "sensors": {"M": torque, "n": {"measures": "rate:O", "unit": "rpm", "noise": "0.5 rpm"}},
    }
    return Rig(**data)


def compressor(load):
    data = trunnion.read("examples/slider-crank.yaml").model_dump(by_alias=True, exclude_unset=True)
    return trunnion.Mechanism(**{**data, "loads": {"air": load}})


@pytest.mark.slow
def test_the_corners_of_a_pressure_table_are_left_out(tmp_path):
    """With them the model does not fit: χ² is 1.7, for the resampling rounds the corners off by up to 13 u."""
    machine = trunnion.read("examples/slider-crank.yaml")
    trunnion.rig.observe(machine, rig("5 kHz", "0.2 N m"), seed=1).write(tmp_path)
    measurement = trunnion.rig.read(tmp_path / "mapping.yaml")
    found = trunnion.rig.identify(machine, measurement, [GUIDE], ["M"])
    size = found.sizes["position"]
    for mask in np.isfinite(found["residual_after"].values[0]):
        for degrees in (40, 240, 280, 312):
            assert not np.any(mask[int(degrees / 360 * size) + np.arange(2)]), degrees
        assert np.count_nonzero(mask) > 0.6 * size
    assert found["reduced_chi_squared"] < 1.3
    raw = trunnion.rig.identify(machine, measurement, [GUIDE], ["M"], guard=0)
    assert raw["reduced_chi_squared"] > 1.5
    assert {one.code for one in raw.trunnion.findings} >= {"fit.misfit"}
    assert not {one.code for one in found.trunnion.findings} & {"fit.misfit"}


@pytest.mark.slow
@pytest.mark.parametrize(("load", "rate", "noise"), [(PRESSURE, "5 kHz", "0.2 N m"), (JUMP, "5 kHz", "0.1 N m")])
def test_coverage_with_a_load_that_has_corners(tmp_path, load, rate, noise):
    """Of 60 rigs with errors of their own, read from their files, 90 to 99 % of the 95 % intervals hold."""
    machine = compressor(load)
    observed = trunnion.rig.observe(machine, rig(rate, noise))
    held = []
    for seed in range(1, 61):
        folder = tmp_path / str(seed)
        observed.seeded(seed).write(folder)
        result = trunnion.rig.identify(machine, trunnion.rig.read(folder / "mapping.yaml"), [GUIDE], ["M"])
        held.append(bool(result["lower"].values[0] <= TRUE <= result["upper"].values[0]))
    assert 0.9 <= np.mean(held) <= 0.99
