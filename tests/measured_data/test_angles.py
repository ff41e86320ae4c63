"""Every source of the angle gives the same courses, and resampling gives back what is known as closely as stated."""

import json

import numpy as np
import pytest
from scipy.signal import lfilter

import trunnion
from measured_data.recording import IDLE, RPM, ZERO, codes, mapping, off, read, recorded, text_of
from trunnion.errors import MechanismError
from trunnion.rig.modelled import in_condition
from trunnion.rig.reading.read import read_measured, resolution

OMEGA = RPM * np.pi / 30


@pytest.fixture(scope="module")
def clean():
    columns = recorded(noise=0.0)
    columns["deg"] = np.degrees(columns["angle"]) % 360
    columns["fine"] = np.floor(columns["angle"] / (2 * np.pi) * 1440)
    columns["wrapped"] = columns["encoder"] % 256
    columns["each turn"] = columns["encoder"] % 60
    columns["z"] = (columns["angle"] / (2 * np.pi) % 1 < 0.02) * 1.0
    columns["down"] = np.floor(-columns["angle"] / (2 * np.pi) * 60)
    return columns


SOURCES = {
    "count": ({"from": "pulses", "column": "encoder", "per_turn": 60}, 0.05),
    "many a sample": ({"from": "pulses", "column": "fine", "per_turn": 1440}, 0.05),
    "wraps at 256": ({"from": "pulses", "column": "wrapped", "per_turn": 60, "wrap": 256}, 0.05),
    "set back each turn": ({"from": "pulses", "column": "each turn", "per_turn": 60, "wrap": 60}, 0.05),
    "index": ({"from": "pulses", "column": "encoder", "per_turn": 60, "index": {"column": "z"}}, 0.08),
    "counts down": ({"from": "pulses", "column": "down", "per_turn": 60, "sign": -1}, 0.05),
    "column": ({"from": "column", "column": "deg", "unit": "deg"}, 4e-3),
    "column in rad": ({"from": "column", "column": "angle"}, 4e-3),
    "time": ({"from": "time", "speed": "600 rpm", "zero": f"{ZERO - OMEGA * IDLE} rad"}, 4e-3),
}


@pytest.mark.spread(4)
@pytest.mark.parametrize("source", SOURCES)
def test_sources(clean, tmp_path, source):
    angle, within = SOURCES[source]
    changes = {"angle": angle}
    if source == "time":  # which has turns while it stands, too
        columns = {name: values[1000:] for name, values in clean.items()}
        changes["channels/torque-in/zero"] = "50 mV"
    else:
        columns = clean
    found = read(columns, tmp_path, changes)
    assert codes(found) <= {"data.unit.none"}
    (one,) = found.conditions
    assert one.courses["torque-in"].turns.shape[0] >= 18
    assert one.speed == pytest.approx(OMEGA, rel=2e-4)
    assert off(one) < within


def test_a_driver_that_runs_backward(clean, tmp_path):
    """Its cycle is gone through from the start of the model's in the direction in which it runs."""
    changes = {"angle": {"from": "pulses", "column": "down", "per_turn": 60}, "channels/speed-in/sign": -1}
    (one,) = read(
        {**clean, "T1": -(clean["T1"] - 0.05)}, tmp_path, {**changes, "channels/torque-in/zero": 0}
    ).conditions
    assert one.speed == pytest.approx(-OMEGA, rel=1e-4)
    course = one.courses["torque-in"].mean
    angle = 2 * np.pi * one.phase
    assert np.nanmax(np.abs(course + (20 + 5 * np.sin(angle) + 2 * np.cos(2 * angle)))) < 0.05


def test_cycles_of_other_lengths(clean, tmp_path):
    clean = {**clean, "T1": 0.1 * np.sin(clean["angle"] / 2)}
    base = {"angle": {"from": "column", "column": "angle"}, "channels/torque-in/zero": 0}
    (one,) = read(clean, tmp_path, {**base, "cycle": "720 deg"}).conditions
    assert one.courses["torque-in"].mean == pytest.approx(np.sin(2 * np.pi * one.phase), abs=1e-3)
    (two,) = read(clean, tmp_path, {**base, "cycle": "2 turn", "start": "180 deg"}).conditions
    assert two.courses["torque-in"].mean == pytest.approx(np.cos(2 * np.pi * two.phase), abs=1e-3)
    timed = {name: values[1000:] for name, values in clean.items()}
    (three,) = read(timed, tmp_path, {"angle": None, "cycle": "0.2 s", "channels/torque-in/zero": 0}).conditions
    assert np.isnan(three.speed)
    assert three.courses["torque-in"].mean == pytest.approx(
        np.sin(2 * np.pi * three.phase + ZERO / 2 - np.pi * 2), abs=1e-3
    )


@pytest.mark.spread(4)
@pytest.mark.parametrize("positions", [36, 90, 360, 500])
@pytest.mark.parametrize("harmonic", [1, 3, 8])
def test_resampling_of_a_known_sinus(clean, tmp_path, harmonic, positions):
    """Mean about a position: too small by (π h/p)²/6; interpolated: by less than (2π h/n)⁴/40, n samples a turn."""
    columns = {**clean, "T1": 0.1 * np.sin(harmonic * clean["angle"])}
    changes = {"angle": {"from": "column", "column": "angle"}, "channels/torque-in/zero": 0, "positions": positions}
    (one,) = read(columns, tmp_path, changes).conditions
    samples = 500
    error = np.abs(one.courses["torque-in"].mean - np.sin(2 * np.pi * harmonic * one.phase)).max()
    averaged = samples >= 4 * positions
    bound = 1.5 * (np.pi * harmonic / positions) ** 2 / 6 if averaged else (2 * np.pi * harmonic / samples) ** 4 / 40
    assert error < bound + 1e-9


def test_nothing_is_interpolated_across_a_jump(clean, tmp_path):
    """A torque of 4 N m that turns its sign twice a turn: a cubic through both sides would be off by up to 0.5 N m."""
    jumps = np.where(np.sin(clean["angle"] + 0.3) > 0, 0.4, -0.4) + 0.01 * np.sin(clean["angle"])
    changes = {"angle": {"from": "column", "column": "angle"}, "channels/torque-in/zero": 0, "positions": 360}
    (one,) = read({**clean, "T1": jumps}, tmp_path, changes).conditions
    angle = 2 * np.pi * one.phase
    beside = np.abs(np.sin(angle + 0.3)) > np.sin(2 * np.pi / 500)
    true = np.where(np.sin(angle + 0.3) > 0, 4.0, -4.0) + 0.1 * np.sin(angle)
    assert np.max(np.abs(one.courses["torque-in"].turns - true)[:, beside]) < 1e-3


@pytest.mark.parametrize("width", [0.005, 0.01, 0.02])
def test_a_narrow_peak_is_no_jump(clean, tmp_path, width):
    """A normal peak of 4 N m, its standard deviation a share of a turn of 500 samples: by cubics, h⁴/40 of d⁴/dt⁴."""
    peak = np.exp(-((np.mod(clean["angle"] / (2 * np.pi), 1.0) - 0.4) ** 2) / (2 * width**2))
    changes = {"angle": {"from": "column", "column": "angle"}, "channels/torque-in/zero": 0, "positions": 360}
    (one,) = read({**clean, "T1": 0.4 * peak}, tmp_path, changes).conditions
    true = 4 * np.exp(-((one.phase - 0.4) ** 2) / (2 * width**2))
    assert np.max(np.abs(one.courses["torque-in"].mean - true)) < 4 * 3 / (500 * width) ** 4 / 40


def test_averaging_lessens_noise(tmp_path):
    """Of n samples a position and N turns the mean scatters by σ/√(n N), and the standard uncertainty says so."""
    columns = recorded(turns=60, noise=0.5, seed=3)
    (one,) = read(columns, tmp_path, {"positions": 36, "channels/torque-in/zero": "50 mV"}).conditions
    course = one.courses["torque-in"]
    expected = 0.5 / np.sqrt(500 / 36)
    assert np.sqrt(np.mean(course.scatter**2)) == pytest.approx(expected, rel=0.05)
    angle = 2 * np.pi * one.phase
    error = course.mean - (20 + 5 * np.sin(angle) + 2 * np.cos(2 * angle))
    assert np.sqrt(np.mean((error / course.uncertainty) ** 2)) == pytest.approx(1, abs=0.4)


def test_filter_has_no_delay_and_halves_the_power_at_its_cut_off(clean, tmp_path):
    columns = {**clean, "T1": 0.1 * (np.sin(clean["angle"]) + np.sin(20 * clean["angle"]))}
    changes = {"angle": {"from": "column", "column": "angle"}, "channels/torque-in/zero": 0}
    found = read(columns, tmp_path, {**changes, "positions": 360, "filter": {"cut_off": "200 Hz"}})
    course = found.conditions[0].courses["torque-in"].turns[5:-3].mean(axis=0)
    phase = 2 * np.pi * found.conditions[0].phase
    parts = [2 * np.mean(course * np.exp(-1j * h * phase)) * 1j for h in (1, 20)]
    assert abs(parts[0]) == pytest.approx(1, abs=2e-3)
    assert abs(parts[1]) == pytest.approx(np.sqrt(0.5), abs=0.02)  # 20 turns of 10 a second: at the cut-off
    assert np.abs(np.angle(parts)).max() < 5e-3
    assert any("200 Hz" in sentence for sentence in found.done)


def test_a_mean_of_a_channel_is_over_time(tmp_path):
    """Of a speed that varies within the turn the mean over equal angles is too high, by half its share squared."""
    angle = np.linspace(0, 40 * np.pi, 400_001)
    speed = OMEGA * (1 + 0.3 * np.sin(2 * angle))
    at = np.concatenate([[0.0], np.cumsum(np.diff(angle) * 2 / (speed[1:] + speed[:-1]))])
    t = np.arange(0, at[-1], 1 / 5000)
    there = np.interp(t, at, angle)
    columns = {"t": t, "angle": np.degrees(there), "n": OMEGA * (1 + 0.3 * np.sin(2 * there))}
    changes = {
        "angle": {"from": "column", "column": "angle", "unit": "deg"},
        "channels": {"speed-in": {"column": "n", "measures": "rate:input", "unit": "rad/s"}},
        "set": {"input.speed": {"mean": "speed-in"}},
    }
    (one,) = read(columns, tmp_path, changes).conditions
    assert one.values["input.speed"] == pytest.approx(40 * np.pi / at[-1], rel=3e-4)
    assert one.courses["speed-in"].turns.mean() == pytest.approx(OMEGA, rel=3e-4)


def test_units_of_what_is_set_stay_with_it(clean, tmp_path):
    settings = {"misalignment": "15 deg", "load": "3 N m", "a": {"mean": "brake"}, "b": 2}
    (one,) = read(clean, tmp_path, {"set": settings}).conditions
    assert one.units == {"misalignment": "rad", "load": "N m", "a": "N m"}
    (warm,) = read(clean, tmp_path, {"set": {"misalignment": "15 degC"}}).conditions
    with pytest.raises(MechanismError, match="'K' is not one of mechanics \\(in condition misalignment 15 degC\\)"):
        in_condition(trunnion.read("examples/pezzuti-cardan.yaml"), warm)
    with pytest.raises(MechanismError, match="± 1 deg"):
        read(clean, tmp_path, {"set": {"misalignment": "15 ± 1 deg"}})


@pytest.mark.sample(6)
@pytest.mark.spread(3)
@pytest.mark.parametrize("wrap", [50, 60, 61, 100, 250, 256, 300, 360])
@pytest.mark.parametrize("per_turn", [60, 1440])
@pytest.mark.parametrize("way", [1, -1])
def test_a_counter_that_wraps_anywhere(clean, tmp_path, wrap, per_turn, way):
    """With three counts a sample as well as with one in eight."""
    counts = np.floor(way * clean["angle"] / (2 * np.pi) * per_turn)
    changes = {"angle": {"from": "pulses", "column": "encoder", "per_turn": per_turn, "sign": way, "wrap": wrap}}
    found = read({**clean, "encoder": counts % wrap}, tmp_path, changes)
    shift = way * 2 * np.pi * np.floor(counts[0] / wrap) * wrap / per_turn  # nothing tells what was lost before
    assert not found.findings
    (one,) = found.conditions
    assert one.speed == pytest.approx(OMEGA, rel=2e-4)
    assert one.courses["torque-in"].turns.shape[0] >= 18
    if abs(shift) < 1e-9:
        assert off(one) < 0.08


def test_a_counter_that_is_set_back_is_refused(clean, tmp_path):
    """What follows has no zero."""
    counts = clean["encoder"].copy()
    counts[6000:] -= counts[6000]
    with pytest.raises(MechanismError, match=r"is set back 1 time, at 1.1998 s — state wrap"):
        read({**clean, "encoder": counts}, tmp_path)


def test_levels_of_a_signal_are_no_steps_of_a_converter():
    time = np.arange(4000) / 4000
    assert resolution(np.where(np.sin(40 * time) > 0, 12.0, 6.0)) == 0
    assert resolution(np.select([time < 0.2, time < 0.7], [3.0, 5.0], 9.0)) == 0
    assert resolution(np.repeat(np.arange(20) ** 2, 200)[:1200]) == 0  # of six levels
    assert resolution(np.rint(10 * np.sin(20 * time)) * 0.5) == pytest.approx(0.5)


def test_a_file_may_have_a_zero_of_its_own(clean, tmp_path):
    """The encoder was mounted 20° further in the second file; the first keeps the zero of `angle`."""
    moved = {**clean, "deg": (clean["deg"] - 20) % 360}
    for name, columns in (("first.csv", clean), ("second.csv", moved)):
        (tmp_path / name).write_text(text_of(columns), "utf-8")
    stated = mapping({"angle": {"from": "column", "column": "deg", "unit": "deg"}})
    files = [{"file": "first.csv"}, {"file": "second.csv", "angle": {"zero": "20 deg"}}]
    path = tmp_path / "rig.json"
    path.write_text(json.dumps({**stated, "files": files}), "utf-8")
    found = read_measured(path)
    assert len(found.conditions) == 2
    for one in found.conditions:
        assert off(one) < 4e-3
    del files[1]["angle"]
    path.write_text(json.dumps({**stated, "files": files}), "utf-8")
    assert off(read_measured(path).conditions[1]) > 1.0


def test_zero_of_an_unloaded_stretch(tmp_path):
    """Its uncertainty is that of the mean of samples that depend on each other."""
    rng = np.random.default_rng(5)
    columns = recorded(noise=0.0)
    slow = lfilter([1.0], [1.0, -0.95], 0.01 * rng.normal(size=columns["t"].size))
    columns["T1"] = columns["T1"] + slow
    (one,) = read(columns, tmp_path, {"channels/torque-in/accuracy": {"zero": "0.3 N m", "gain": "0.1 %"}}).conditions
    accuracy = one.courses["torque-in"].accuracy
    # of an AR(1): σ²/n · (1 + ρ)/(1 − ρ), n = 950, σ² = 1e-4/(1 − ρ²); 10 N m a volt
    expected = 10 * np.sqrt(1e-4 / (1 - 0.95**2) / 950 * (1.95 / 0.05))
    assert np.sqrt(accuracy.zero**2 - 0.3**2) == pytest.approx(expected, rel=0.6)
    assert accuracy.gain == pytest.approx(0.001)


def test_filter_keeps_gaps(clean, tmp_path):
    """Nothing is carried over a long gap, short ones are bridged, and all stay gaps."""
    columns = {**clean, "T1": clean["T1"].copy()}
    columns["T1"][5000:5400] = np.nan
    columns["T1"][7000] = np.nan
    changes = {"angle": {"from": "column", "column": "angle"}, "filter": {"cut_off": "100 Hz"}}
    (one,) = read(columns, tmp_path, changes).conditions
    assert np.count_nonzero(np.isnan(one.courses["torque-in"].turns)) == pytest.approx(400 / 500 * 90, abs=2)
    assert off(one) < 0.03


TOLD = [
    ({"angle/per_turn": 30}, {"data.rate.ratio"}, "1200 rpm, 2 times what 'speed-in' reads"),
    ({"angle/sign": -1, "channels/torque-in/zero": "50 mV"}, {"data.rate.ratio"}, "-600 rpm, -1 times"),
    ({"angle/index": {"column": "none"}}, {"data.index.none"}, "has no pulse"),
    ({"angle/index": {"column": "z"}, "angle/per_turn": 59}, {"data.pulses.lost"}, "usual are 60 a turn"),
    ({"angle": {"from": "column", "column": "angle [°]", "unit": "rad"}}, {"data.unit.differs"}, "the mapping 'rad'"),
    ({"angle": {"from": "column", "column": "angle [°]", "unit": "deg"}}, set(), ""),
]


@pytest.mark.parametrize(("changes", "told", "what"), TOLD)
def test_what_is_told_of_an_angle(clean, tmp_path, changes, told, what):
    columns = {**clean, "none": 0 * clean["t"], "angle [°]": np.degrees(clean["angle"])}
    try:
        findings = read(columns, tmp_path, changes).findings
    except MechanismError as error:  # pulses too many in every turn
        findings = tuple(error.findings)
    assert told <= {one.code for one in findings}
    assert what in " ".join(one.what for one in findings)
    assert told or not findings
