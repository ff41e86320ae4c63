"""Pulses that are known to a sample: what the smoothest values that agree with them are off."""

import numpy as np
import pytest
from numpy.typing import NDArray

from trunnion.rig.reading.angle import coordinate, local_polynomials, seen_edges, smoothed, unresolved
from trunnion.rig.reading.mapping import AngleSource
from trunnion.rig.reading.tables import Column, DataTable
from trunnion.rig.reading.turns import Timeline

Array = NDArray[np.float64]
STEP = 1 / 5000


def sampled(times):
    """In the middle between the two samples that a pulse lies between."""
    return np.asarray((np.floor(times / STEP) + 0.5) * STEP)


@pytest.mark.parametrize(("per_turn", "rate"), [(360, 5.0), (360, 10.0), (60, 5.0), (60, 15.167), (100, 10.0)])
def test_steady_pulses_in_step_with_the_sampling(per_turn, rate):
    """What is left is a shift of all pulses alike, and as large as it is said to be at most; exactly 5 samples a pulse
    leave half a sample.
    """
    true = 0.0123456 + np.arange(20 * per_turn) / (per_turn * rate)
    raw = sampled(true)
    found, spans = smoothed(raw, 0.5 * STEP, per_turn)
    assert np.all(spans == 2.0)
    off = (found - true)[per_turn:-per_turn]
    assert np.std(off) < 0.06 * STEP
    assert abs(off.mean()) < 1.8 * unresolved(raw - found, STEP)  # a rectangle is √3 wide


@pytest.mark.parametrize(
    ("count", "width", "order"), [(5, 5, 3), (200, 21, 3), (3000, 721, 3), (721, 721, 3), (50, 7, 0)]
)
def test_local_polynomials_are_those_of_scipy(count, width, order):
    from scipy.signal import savgol_filter

    values = np.cumsum(np.random.default_rng(count).normal(size=count))
    theirs = savgol_filter(values, width, order)
    np.testing.assert_allclose(local_polynomials(values, width, order), theirs, rtol=0, atol=1e-11 * np.ptp(values))


@pytest.mark.parametrize("per_sample", [0.97, 1.01, 1.2, 1.5, 2.4])
def test_a_count_about_as_fast_as_the_sampling(per_sample):
    """A running count of 1.2 a sample steps by 1, 1, 1, 1, 2: the angle is right to a small part of a count."""
    per_turn, samples = 360, 20_000
    time = STEP * np.arange(samples)
    true = (per_sample * np.arange(samples) + 0.37) / per_turn
    table = DataTable({"n": Column(np.floor(true * per_turn), "", 0, "")})
    source = AngleSource(**{"from": "pulses"}, column="n", per_turn=per_turn)
    line = Timeline(time, slice(None), STEP)
    found = coordinate(source, table, line, lambda finding: None).values / (2 * np.pi)
    off = (found - true)[2000:-2000] * per_turn
    assert np.std(off) < 0.03
    assert np.ptp(off) < 0.15


def test_uneven_running_stays():
    """A ripple of the speed of 3 % twice a turn is the shaft's: it is followed to a fraction of a sample."""
    angle = np.arange(0, 40 * np.pi, np.pi / 180)
    true = (angle + 0.03 * np.sin(2 * angle) / 2) / (2 * np.pi * 5) + 0.1
    raw = sampled(true)
    found, spans = smoothed(raw, 0.5 * STEP, 360)
    assert 0 < np.median(spans) < 1
    assert np.abs(found - true)[20:-20].max() < 0.6 * STEP
    assert np.std(found - true) < np.std(raw - true) / 2


@pytest.mark.parametrize("width", [0.2, 0.6])
def test_an_index_narrower_than_a_sample(width):
    """Seen in some turns only; the edges are right in the mean."""
    true = 0.05 + np.arange(4000) * 0.100013
    first = np.ceil(true / STEP) * STEP
    seen = first < true + width * STEP
    edges = seen_edges(first[seen] - 0.5 * STEP, (true[seen][-1] - true[seen][0]) / 0.100013, STEP)
    assert abs(np.mean(edges - true[seen])) < 0.02 * STEP
