"""Sensors of the virtual rig, each step of the chain against what it is by definition."""

import numpy as np
import pytest
from pydantic import ValidationError

from trunnion.errors import MechanismError
from trunnion.rig.reading.units import read_amount, scale
from trunnion.rig.virtual.observe import phases
from trunnion.rig.virtual.rig_file import (
    Sensor,
    SensorErrors,
    draw,
    pulsed,
    readings,
    resolved,
    smoothed,
    stream,
)  # fmt: skip


def channel(si="N m", **stated):
    return resolved("s", Sensor(**{"measures": "effort:A", **stated}), si)


@pytest.mark.parametrize("given", ["100 mV/(N m)", "0.01 N m/mV", "10 N m/V"])
def test_sensitivity_either_way_round(given):
    """Reading per quantity or quantity per reading; sizes in either unit come to the same."""
    found = channel(
        sensitivity=given, range="10 V", noise="5 mV", offset="0.2 N m", drift="360 mV/h", span="10 V", bits=12
    )
    of = {"mV": 100.0, "V": 0.1}[found.reading]
    assert found.per == pytest.approx(of, rel=1e-12)
    assert found.range == pytest.approx(100.0)
    assert found.noise == pytest.approx(0.05)
    assert found.offset == pytest.approx(0.2)
    assert found.drift == pytest.approx(0.001)
    assert found.step == pytest.approx(200 / 4096)
    assert channel(sensitivity=given, unit="V").reading == "V"


@pytest.mark.parametrize("given", ["60 Hz/(rev/s)", "1 Hz/rpm", "1 rpm/Hz", "0.001 kHz/rpm"])
def test_speed_by_pulse_frequency(given):
    """60 pulses a turn give 60 Hz at a turn a second, and the mapping reads them so."""
    found = channel("rad/s", measures="rate:A", sensitivity=given, range="4000 rpm", noise="0.5 Hz", unit="Hz")
    assert found.per == pytest.approx(60 / (2 * np.pi))
    assert found.noise == pytest.approx(0.5 * 2 * np.pi / 60)
    assert found.range == pytest.approx(4000 * 2 * np.pi / 60)
    assert scale("rate:A", "Hz", read_amount(given)).factor == pytest.approx(2 * np.pi / 60)
    along = channel("m/s", measures="rate:S", sensitivity="1 kHz/(m/s)")
    assert (along.reading, along.per) == ("kHz", pytest.approx(1.0))
    for other in ("1 Hz/N", "1 Hz s", "1 N m/Hz"):
        with pytest.raises((MechanismError, ValidationError)):
            channel("rad/s", measures="rate:A", sensitivity=other)


@pytest.mark.parametrize(
    ("stated", "where", "what"),
    [
        ({"noise": "5 mV"}, "noise", "is not in N m"),
        ({"drift": "1 N m"}, "drift", "is not in N m/s"),
        ({"sensitivity": "100 mV/N"}, "sensitivity", "does not turn N m into"),
        ({"sensitivity": "100 mV/(N m)", "unit": "rpm"}, "sensitivity", "does not turn N m into rpm"),
        ({"unit": "rpm"}, "unit", "does not measure a quantity in N m"),
    ],
)
def test_what_does_not_fit(stated, where, what):
    with pytest.raises(MechanismError) as error:
        channel(**stated)
    (finding,) = error.value.findings
    assert finding.where == f"sensors.s.{where}"
    assert what in finding.what


def test_low_pass_is_that_of_first_order():
    """Amplitude 1/√(1 + (f/f₀)²) and phase −atan(f/f₀) of a sine; a constant stays."""
    rate, cut, frequency = 2000.0, 50.0, 40.0
    time = np.arange(4000) / rate
    found = smoothed(np.sin(2 * np.pi * frequency * time), cut, rate)[2000:]
    answer = np.mean(found * np.exp(-2j * np.pi * frequency * time[2000:])) * 2j
    wanted = 1 / (1 + 1j * frequency / cut)
    assert abs(answer) == pytest.approx(abs(wanted), rel=2e-3)
    assert np.angle(answer) == pytest.approx(np.angle(wanted), abs=2e-3)
    assert smoothed(np.full(10, 3.0), cut, rate) == pytest.approx(3.0)
    straight = smoothed(np.arange(20000.0), 1e6, rate)  # beyond half the rate: next to no delay
    assert straight[-1] == pytest.approx(19999.0, abs=0.01)


def test_speed_by_pulses():
    """Exact at a constant speed; otherwise the means over each pitch, at its middle: what is quicker is lost."""
    running = slice(100, 2100)
    true = np.zeros(2200)
    true[running] = -50.0
    found = pulsed(true, running, 60, 1000.0)
    assert found[running] == pytest.approx(-50.0)
    assert not np.any(found[:100])
    assert not np.any(found[2100:])
    time = np.arange(2000) / 1000.0
    true[running] = 50 + 5 * np.sin(10 * time)
    found = pulsed(true, running, 600, 1000.0)
    assert found[running][200:-200] == pytest.approx(true[running][200:-200], abs=0.01)
    few = pulsed(true, running, 5, 1000.0)[running][200:-200]
    wave = np.exp(-10j * time[200:-200])
    kept = np.mean((few - np.mean(few)) * wave) / np.mean((true[running][200:-200] - 50) * wave)
    assert 0.9 < abs(kept) < 0.99
    assert np.angle(kept) == pytest.approx(0.0, abs=0.02)
    slow = np.full(50, 1e-3)
    assert not np.any(pulsed(slow, slice(0, 50), 60, 1000.0))  # no second pulse


def test_converter():
    """Steps of the span, clipped at the range, one step short at the upper end of the converter."""
    found = channel(range="8 N m", span="10 N m", bits=4)
    assert found.step == 1.25
    true, none = np.array([0.6, 0.7, -0.7, 9.0, -9.0, -0.1, 11.0, -11.0]), SensorErrors(0, 0, 0)
    assert readings(found, true, slice(0, 8), 1.0, none, None).tolist() == [0.0, 1.25, -1.25, 7.5, -7.5, 0.0, 7.5, -7.5]
    wide = channel(span="10 N m", bits=4, range="20 N m")
    assert readings(wide, true, slice(0, 8), 1.0, none, None)[-2:].tolist() == [8.75, -10.0]
    assert channel().decimals == 9
    assert channel(noise="0.05 N m").decimals == 5


def test_order_of_the_chain():
    """Gain and drift on the true value, offset always, the zero of the running sensor while it runs."""
    found = channel(drift="0.1 N m/s", sensitivity="1 V/(N m)")
    true = np.array([0.0, 0.0, 10.0, 10.0, 0.0])
    answer = readings(found, true, slice(2, 4), 10.0, SensorErrors(0.1, 0.5, 0.2), None)
    assert answer == pytest.approx([0.2, 0.21, 11 + 0.5 + 0.2 + 0.02, 11 + 0.5 + 0.2 + 0.03, 0.24])


def test_streams_are_apart_and_the_same_again():
    one = stream(1, 1, "a", "noise").standard_normal(1000)
    assert np.array_equal(one, stream(1, 1, "a", "noise").standard_normal(1000))
    for other in ((2, 1, "a", "noise"), (1, 2, "a", "noise"), (1, 1, "b", "noise"), (1, 1, "a", "spikes")):
        assert abs(np.corrcoef(one, stream(*other).standard_normal(1000))[0, 1]) < 0.1
    stated = channel(accuracy={"gain": "1 %", "zero": "2 N m"}, offset="3 N m")
    drawn = np.array([(d.gain, d.zero, d.offset) for d in (draw(stated, seed) for seed in range(500))])
    assert drawn.std(axis=0) == pytest.approx([0.01, 2.0, 3.0], rel=0.1)
    assert np.abs(np.corrcoef(drawn.T)[np.triu_indices(3, 1)]).max() < 0.15


@pytest.mark.parametrize(
    ("duration", "rate", "count", "lead"), [(0.12, 2000, 500, 24.5), (0.07, 1000, 800, 3.0), (0.3, 7, 90, 0.5)]
)
def test_phases_are_those_of_the_samples(duration, rate, count, lead):
    time, place = phases(duration, rate, count, lead)
    wanted = np.mod((np.arange(count) - lead) / rate, duration)
    apart = np.abs(time[place] - wanted)
    assert np.minimum(apart, duration - apart).max() < 1e-12
    assert np.all(np.diff(time) > 0)
    assert len(time) < count
