"""The error by steps that all turns repeat, against readings that are rounded one by one; the steps of a channel."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import ndtr

from measured_data.four_bar import rocker
from trunnion.rig.reading import turns as steps
from trunnion.rig.reading.read import read_measured
from trunnion.rig.reading.turns import LeftOfSteps, covariance_of_steps, left_of_steps, noise_before

Array = NDArray[np.float64]


@pytest.mark.parametrize("noise", [0.0, 0.02, 0.1, 0.25, 0.4])
def test_what_rounding_leaves_of_a_mean(noise):
    random = np.random.default_rng(1)
    true = random.uniform(0, 1, 20_000)
    off = np.rint(true + noise * random.normal(size=(100, true.size))) - true
    within = float(np.mean(np.var(off, axis=0, ddof=1)))
    left = float(np.mean(np.mean(off, axis=0) ** 2)) - within / len(off)
    assert 12 * left == pytest.approx(float(left_of_steps(noise)), rel=0.03, abs=1e-3)
    assert noise_before(within**0.5) == pytest.approx(noise, rel=0.03, abs=1e-3)


def rounded_mean(true, noise):
    """Mean of true + noise, rounded to whole numbers: by the chances of each."""
    steps = np.arange(np.floor(true.min()) - 3, np.ceil(true.max()) + 3)
    return np.asarray(steps[0] + np.sum(ndtr((true[:, None] - steps - 0.5) / noise), axis=1))


@pytest.mark.spread(1)
@pytest.mark.parametrize("samples", [250.0, 2000.0])  # interpolated, and means of some
@pytest.mark.parametrize("noise", [0.05, 0.25])
def test_errors_of_samples_that_gain_whole_steps_are_alike(samples, noise):
    """About its steepest place the course gains one step from sample to sample, or an eighth, and the errors add up."""
    positions, random = 180, np.random.default_rng(2)
    turn = np.arange(positions) / positions
    height = 250 / (2 * np.pi)
    columns = np.exp(-((turn - [[0.5], [0.25]]) ** 2) / 0.002)  # at the steepest place, and at the top
    found = []
    for _ in range(400):
        place = (np.arange(-2, samples + 2) + random.uniform()) / samples
        true = height * np.sin(2 * np.pi * place) + random.uniform()
        error = rounded_mean(true, noise) - true
        if samples < 4 * positions:
            error = np.interp(turn, place, error)
        else:
            at = np.rint(place * positions).astype(int) % positions
            error = np.bincount(at, error) / np.bincount(at)
        found.append(columns @ error)
    told = covariance_of_steps(columns, height * np.sin(2 * np.pi * turn), LeftOfSteps(1.0, noise, samples, True))
    assert np.sqrt(np.diag(told)) == pytest.approx(np.std(found, axis=0), rel=0.12)
    if samples == 250:  # far more than independent errors would
        assert told[0, 0] > 4 * np.sum(columns[0] ** 2) * left_of_steps(noise) / 12


MAPPING = {
    "trunnion-data": 1,
    "time": {"column": "t", "unit": "s"},
    "angle": {"from": "column", "column": "phi", "unit": "deg"},
    "channels": {"psi": {"column": "psi", "measures": "rotation:D", "unit": "deg"}},
}


def recorded(path, time, angle, psi, decimals=3, **changes):
    """Times, s, angles of the crank, rad, and readings of the rocker, deg, as a file that is read."""
    rows = zip(time, np.degrees(angle) % 360, psi, strict=True)
    path.write_text("\n".join(["t;phi;psi", *(f"{t:.6f};{a:.6f};{x:.{decimals}f}" for t, a, x in rows)]))
    return read_measured(MAPPING | changes, [path])


def repeated(path, values, decimals):
    """`values`, deg, of a turn that all twelve repeat, at 60 rpm."""
    place = np.arange(13 * values.size)
    return recorded(path, place / values.size, 2 * np.pi * place / values.size, np.resize(values, place.size), decimals)


@pytest.mark.parametrize(("rpm", "noise", "same"), [(60, 0.2, True), (60, 0.0, True), (59.1, 0.2, False)])
def test_turns_that_are_sampled_at_the_same_places(tmp_path, rpm, noise, same):
    """What is said to be uncertain in the mean of a position is what it is off by, whatever repeats of it."""
    time = np.arange(int(14 * 60 / rpm * 200)) / 200  # at 60 rpm all turns are sampled at the same places
    angle = rpm * np.pi / 30 * time + 1
    noisy = np.degrees(rocker(angle)) + noise * 0.1 * np.random.default_rng(3).normal(size=time.size)
    (condition,) = recorded(tmp_path / "a.csv", time, angle, 0.1 * np.rint(noisy / 0.1), positions=180).conditions
    course = condition.courses["psi"]
    assert course.accuracy.resolution == pytest.approx(np.radians(0.1))
    assert course.accuracy.left is not None
    assert course.accuracy.left.every == same
    off = course.mean - rocker(2 * np.pi * condition.phase)
    off -= np.mean(off)
    own = np.hypot(course.scatter / np.sqrt(course.count), course.unresolved)
    assert np.std(off) == pytest.approx(float(np.sqrt(np.mean(own**2))), rel=0.25)


def test_turns_shorter_than_half_a_row(monkeypatch):
    """Readings ±½ in turn scatter by ½: row differences of ±1 have √(1/2) = σ, and steps take 1/12 of its square."""
    monkeypatch.setattr(steps, "in_step", lambda *_: 1.0)
    rows, times = np.ones(100, dtype=bool), np.arange(10.0)
    short = SimpleNamespace(begin=times, end=times + 0.2, line=SimpleNamespace(step=1.0), rows=rows)
    left = steps.left_in_turns(short, np.zeros((10, 4)), np.arange(100) % 2 - 0.5, 0.0)
    assert left.noise == pytest.approx((1 / 2 - 1 / 12) ** 0.5, rel=1e-3)


TURN = np.radians(360 * np.arange(1000) / 1000)


@pytest.mark.spread(6)
@pytest.mark.parametrize("samples", [20, 200, 1000, 4000])
@pytest.mark.parametrize("step", [0.001, 0.1, 0.5, 2.0, 20 / 2**7])
def test_steps_count_where_turns_repeat(tmp_path, step, samples):
    """Each reading is off by what is rounded, all by what may be cut off: step/√12 each (GUM F.2.2.1)."""
    true = np.degrees(rocker(TURN[:: 1000 // samples] if samples <= 1000 else np.arange(4000) * np.pi / 2000))
    found = repeated(tmp_path / "a.csv", np.floor(true / step) * step, 6)
    course = found.conditions[0].courses["psi"]
    levels = np.unique(np.floor(true / step)).size  # of few that lie apart, the last decimal is known alone
    told = course.accuracy.resolution / np.radians(step)
    assert told == pytest.approx(1.0, rel=1e-3) or (samples == 20 and told <= 1.001 and levels < 30)
    if samples > 20:
        assert np.median(course.scatter) < 1e-3 * np.radians(step)
        assert np.median(course.uncertainty) == pytest.approx(np.radians(step) / np.sqrt(6.0), rel=1e-3)


def test_a_channel_has_one_step_of_all_its_files(tmp_path):
    """One file spans three steps, and by itself hardly shows them; the other many."""
    psi = np.degrees(rocker(TURN[::2]))
    few = 100 + 0.15 * (psi - psi.min()) / np.ptp(psi)
    paths = [tmp_path / "a.csv", tmp_path / "b.csv"]
    for path, values in zip(paths, (few, psi), strict=True):
        repeated(path, np.rint(10 * values) / 10, 1)
    for files in (paths, paths[:1]):
        for condition in read_measured(MAPPING, files).conditions:
            course = condition.courses["psi"]
            assert course.accuracy.resolution == pytest.approx(np.radians(0.1))
            assert np.median(course.uncertainty) == pytest.approx(np.radians(0.1) / np.sqrt(6.0), rel=0.01)
