"""Every fault of a recording is named, with channel, figure and remedy, and a sound recording has none."""

import numpy as np
import pytest

from measured_data.recording import codes, off, read, recorded
from trunnion.errors import MechanismError, Severity


@pytest.fixture(scope="module")
def sound():
    return recorded()


@pytest.fixture
def run(sound):
    return {name: values.copy() for name, values in sound.items()}


def test_a_sound_recording_has_no_finding(run, tmp_path):
    found = read(run, tmp_path)
    assert found.findings == ()
    (one,) = found.conditions
    assert one.courses["torque-in"].turns.shape == (19, 90)  # of 20 turns from 21° on
    assert one.speed == pytest.approx(600 * np.pi / 30, rel=2e-6)  # of 1.9 s, pulses known to a part of 0.2 ms
    assert off(one) < 0.06  # noise of 0.05 N m
    assert found.done[0].startswith("19 whole turns; rows before")


def _cells(run):
    run["T1"][5000:5200] = np.nan
    run["T1"][6000] = np.inf


def _spikes(run):
    run["T1"][[4100, 5250, 7001]] += 5  # at 0.2, 0.5 and 0 of a turn


def _stuck(run):
    run["T1"][5000:5400] = run["T1"][5000]


def _drift(run):
    run["T1"] += 0.05 * run["t"]


def _gap(run):
    keep = np.r_[0:5000, 5300 : run["t"].size]
    for name in run:
        run[name] = run[name][keep]


def _repeated(run):
    run["t"][5000:5003] = run["t"][5000]


def _blank(run):
    for values in run.values():
        values[[3000, 5000, 5001, -2, -1]] = np.nan


def _backward(run):
    run["t"][6000:] -= 0.02


def _unsteady(run):
    run["t"] = run["t"] + 0.02 * run["t"] ** 2


FAULTS = [
    (_cells, "channels.torque-in", ("dropouts: 201 cells", "at 1, 1.2 s"), "cable"),
    (_spikes, "channels.torque-in", ("spikes: 3 readings", "0.82, 1.05, 1.4002 s"), "shielding"),
    (_stuck, "channels.torque-in", ("stuck: 399 readings", "at 1.0002 s"), "sensor"),
    (_drift, "channels.torque-in", ("drift", "N m in 1.8 s"), "drift: remove"),
    (_gap, "time", ("1 gap", "300 samples missing", "0.0602 s at 0.9998 s"), "buffer"),
    (_repeated, "time", ("2 rows of 11,000 left out", "does not rise, at 1, 1 s"), "logger"),
    (_blank, "time", ("5 rows of 11,000 left out: 5 have no time",), "logger"),
    (_backward, "time", ("100 rows", "backward 1 time", "0.0198 s"), "split the file"),
    (_unsteady, "turns", ("speed is not steady",), "over:"),
]


def test_a_narrow_peak_of_the_signal_is_no_spike(run, tmp_path):
    """Narrower than the samples lie apart, so that few turns have a reading on it, in the same place of each."""
    run["T1"][[4000, 5001, 7000, 8001]] += 5
    assert read(run, tmp_path).findings == ()


@pytest.mark.spread(7)
@pytest.mark.parametrize(("spoil", "where", "figures", "remedy"), FAULTS, ids=[one[0].__name__ for one in FAULTS])
def test_faults_are_named(run, tmp_path, spoil, where, figures, remedy):
    spoil(run)
    found = read(run, tmp_path)
    named = [one for one in found.findings if one.where == where and all(text in one.what for text in figures)]
    assert len(named) == 1, [str(one) for one in found.findings]
    assert remedy in named[0].remedy
    assert named[0].severity is Severity.WARNING
    assert named[0].file.endswith("run.csv")
    if spoil not in (_drift, _unsteady):  # these stay in the means, all others are left out of them
        assert off(found.conditions[0]) < 0.12


def test_clipped_at_the_range(run, tmp_path):
    """A few readings are left out; of a range that nearly all exceed, as of a unit taken for another, nothing is."""
    with pytest.raises(MechanismError) as refused:
        read(run, tmp_path, {"channels/torque-in/range": "24 mN m"})
    (one,) = (one for one in refused.value.findings if one.code == "data.readings.clipped")
    assert (one.severity, one.where) == (Severity.ERROR, "channels.torque-in")
    assert one.figures["count"] > 0.9 * one.figures["readings"]
    run["T1"] = np.clip(run["T1"], -2.4, 2.4)
    (one,) = read(run, tmp_path, {"channels/torque-in/range": "24 N m"}).findings
    assert one.code == "data.readings.clipped"
    assert "range of 2.4 V" in one.what


@pytest.mark.parametrize("code", [99999.0, -187.3])
def test_a_code_for_an_overload_changes_nothing_else(run, tmp_path, code):
    """Neither the steps that the readings tell nor an uncertainty; it is no end of a range."""
    run["T2"] = np.round(run["T2"] / 0.2) * 0.2
    sound = read(run, tmp_path).conditions[0].courses["brake"].accuracy
    run["T2"][[4000, 5250, 7001]] = code
    for changes in ({}, {"channels/brake/range": "50 N m"}):
        found = read(run, tmp_path, changes)
        assert codes(found) == {"data.readings.clipped" if changes else "data.readings.spikes"}
        assert "3 readings of" in found.findings[0].what
        accuracy = found.conditions[0].courses["brake"].accuracy
        assert (accuracy.resolution, accuracy.cut) == (sound.resolution, sound.cut)
        assert accuracy.left.share == pytest.approx(sound.left.share, rel=0.01)
        assert float(np.nanmax(found.conditions[0].courses["brake"].turns)) < 25
    assert sound.resolution == pytest.approx(0.2)


@pytest.mark.spread(2)
@pytest.mark.parametrize("rate", [400.0, 5000.0])  # a cubic between samples, and means of them
@pytest.mark.parametrize("changes", [{}, {"channels/torque-in/range": "30 N m"}], ids=["spikes", "range"])
@pytest.mark.parametrize("low_pass", [{}, {"filter": {"cut_off": "100 Hz", "order": 2}}], ids=["plain", "filtered"])
def test_a_bad_reading_beside_the_turns_does_not_reach_into_them(tmp_path, rate, changes, low_pass):
    """In the last rows before the first turn, the first ones of it, and about the end of the last one."""
    run = recorded(rate=rate, turns=8.5)
    angle = run["angle"] / (2 * np.pi)
    first, last = (int(np.searchsorted(angle, turn)) for turn in (1.0, 8.0))
    changes = {**changes, **low_pass, "positions": 90}
    best = off(read(run, tmp_path, changes).conditions[0])
    for row in [*range(first - 3, first + 2), *range(last - 3, last + 3)]:
        spoilt = {**run, "T1": run["T1"].copy()}
        spoilt["T1"][row] = 9999.0
        found = read(spoilt, tmp_path, changes)
        assert off(found.conditions[0]) < best + (0.1 if rate > 1000 else 0.5), row - first
        assert any("left out" in one.what for one in found.findings), row - first


def test_a_spike_in_an_unloaded_stretch_does_not_move_the_zero(run, tmp_path):
    run["T1"][300] = 9999.0
    found = read(run, tmp_path)
    (one,) = found.findings
    assert (one.code, one.where) == ("data.readings.spikes", "channels.torque-in.zero")
    assert "1 reading of 950, at 0.06 s" in one.what
    assert off(found.conditions[0]) < 0.06


def test_coarse_readings_are_no_faults(run, tmp_path):
    """A signal of a few dozen levels stays long on each, and long at its largest."""
    for name in ("T1", "T2"):
        run[name] = np.rint(run[name] / 0.02) * 0.02
    run["n1"] = np.rint(run["n1"])
    (one,) = read(run, tmp_path).findings
    assert (one.code, one.severity) == ("data.readings.constant", Severity.NOTE)


@pytest.mark.parametrize("turns", [2, 3, 20])
def test_what_comes_back_every_turn_is_the_signals_own(run, tmp_path, turns):
    """A load that works over half a turn, without noise, is zero or constant there and steps."""
    phase = run["angle"] % (2 * np.pi)
    run["T2"] = np.where(run["t"] < 0.2, 0.0, np.where(phase < 2, 30.0 + np.sin(phase), 0.0))
    knocks = np.diff(np.floor(run["angle"] / (2 * np.pi)), append=3) > 0
    run["T1"][knocks if turns == 20 else 2000] += 1.0
    found = read({name: values[: 1500 + 500 * turns] for name, values in run.items()}, tmp_path)
    assert not [one for one in found.findings if "left out" in one.what]
    for course in found.conditions[0].courses.values():
        assert np.isfinite(course.turns).all()


@pytest.mark.parametrize(
    ("column", "channel", "figures"),
    [
        ("T1", "torque-in", "negative in 19 of 19 turns (-1257 W)"),
        ("n1", "speed-in", "the angle turns at 600 rpm, -1 times"),
        ("T2", "brake", "negative in 19 of 19 turns"),
    ],
)
def test_wrong_signs(run, tmp_path, column, channel, figures):
    run[column] *= -1
    (one,) = read(run, tmp_path).findings
    assert one.where == f"channels.{channel}"
    assert figures in one.what
    assert "write sign: -1" in one.remedy
    assert read(run, tmp_path, {f"channels/{channel}/sign": -1}).findings == ()


@pytest.mark.parametrize("zero", [["0 s", "0.19 s"], ["-20 s", "0.19 s"]])
def test_drift_is_removed_from_when_the_zero_was_read(run, tmp_path, zero):
    """Also of a stretch that is stated far longer than the file has it before."""
    run["T1"] += 0.05 * (run["t"] - 0.1)
    found = read(run, tmp_path, {"channels/torque-in/zero": {"over": zero}, "drift": "remove"})
    assert codes(found) == {"data.zero.drift_files"}
    assert off(found.conditions[0]) < 0.06
    assert found.conditions[0].courses["torque-in"].accuracy.zero > 0


def test_lost_pulses_by_the_index(run, tmp_path):
    run["z"] = (run["angle"] / (2 * np.pi) % 1 < 0.02) * 1.0
    changes = {"angle/index": {"column": "z"}}
    assert read(run, tmp_path, changes).findings == ()
    edges = np.flatnonzero(np.diff(run["encoder"])) + 1
    for after, many in ((4000, 1), (7000, 3)):
        run["encoder"][edges[edges > after][0] :] -= many
    run["encoder"] = np.maximum.accumulate(run["encoder"])
    found = read(run, tmp_path, changes)
    (one,) = found.findings
    assert "4 pulses lost, 0 too many in 2 turns" in one.what
    assert found.conditions[0].courses["torque-in"].turns.shape[0] == 17
    assert off(found.conditions[0]) < 0.06


def test_sampling_too_slow(run, tmp_path):
    thin = {name: values[::100] for name, values in run.items()}
    assert "data.sampling.slow" in codes(read(thin, tmp_path))
    with pytest.raises(MechanismError, match=r"sampling is too slow for the filter: 50 Hz, a cut-off of 40 Hz"):
        read(thin, tmp_path, {"filter": {"cut_off": "40 Hz"}})
    with pytest.raises(MechanismError):
        read(thin, tmp_path, {"filter": {"cut_off": "2e-298 Hz"}})
