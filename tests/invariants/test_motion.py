"""Motion laws of drivers: published factors, exact derivatives, and what the analysis makes of them."""

import json

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from brief import brief
from mechanisms import analyse, build, class_three, five_bar, model, slider_crank
from trunnion import Mechanism
from trunnion.algebra.dual import Dual, derivative, primal
from trunnion.algebra.spline import spline
from trunnion.errors import MechanismError, Status
from trunnion.joints.motion import MOTION_LAWS
from trunnion.solve.run import prepare

PROFILES = {name: law for name, law in MOTION_LAWS.items() if law.profile}
TABLE = [[0.0, 0.1], [0.1, 0.5], [0.25, 0.9], [0.4, 0.3], [0.6, 0.1]]
DRIVERS = {
    "constant": {"speed": -6.0},
    "range": {"speed": 2.0, "range": [0.2, 1.4]},
    "harmonic": {"law": "harmonic", "mean": 0.3, "amplitude": 0.7, "period": 0.5, "phase": "90 deg"},
    **{
        name: {"law": name, "range": [0.2, 1.9], "duration": 0.2, "dwell": 0.1, "delay": 0.05} for name in PROFILES
    },
    "slow return": {"law": "modified-sine", "range": [0.2, 1.9], "duration": 0.2, "return_duration": 0.5,
                    "dwell": 0.1, "delay": 0.05},
    "one rise": {"law": "cycloidal", "range": [1.9, 0.2], "duration": 0.2, "returns": False},
    "late rise": {"law": "cycloidal", "range": [0.2, 1.9], "duration": 0.2, "dwell": 0.1, "delay": 0.05,
                  "returns": False},
    "periodic table": {"law": "table", "points": TABLE, "periodic": True, "delay": 0.02},
    "whole turns": {"law": "table", "points": [[0, 0.1], [0.3, 3.0], [0.5, 0.1 + 2 * np.pi]], "periodic": True},
    "clamped table": {"law": "table", "points": TABLE, "delay": 0.05},
    "natural table": {"law": "table", "points": TABLE, "ends": "natural"},
}  # fmt: skip


def driven(driver, data=None, name="A", **options):
    """A slider-crank, or another mechanism, with one driver replaced."""
    data = data or slider_crank()
    data["drivers"] = {**data["drivers"], name: driver}
    return build(data, **options)


# the laws
@pytest.mark.parametrize(
    ("name", "peak_rate", "peak_second"),
    [("cycloidal", 2.0, 6.2832), ("polynomial-345", 1.875, 5.7735), ("modified-sine", 1.7596, 5.5280)],
)
def test_peaks_are_the_published_factors(name, peak_rate, peak_second):
    law = PROFILES[name]
    _, rate, second = law.profile(np.linspace(0, 1, 100_001))
    assert np.max(rate) == pytest.approx(peak_rate, abs=6e-5)
    assert np.max(np.abs(second)) == pytest.approx(peak_second, abs=6e-5)
    assert law.peak_rate == pytest.approx(np.max(rate), rel=1e-9)
    assert law.peak_second == pytest.approx(np.max(np.abs(second)), rel=1e-9)


@pytest.mark.parametrize("name", PROFILES)
def test_a_profile_takes_nested_duals_and_is_smooth(name):
    profile = PROFILES[name].profile
    u = np.linspace(0.001, 0.999, 333)
    s, rate, second = profile(u)
    nested = profile(Dual(Dual(u, 1.0), Dual(1.0, 0.0))).value
    np.testing.assert_allclose(primal(nested), s, rtol=1e-14)
    np.testing.assert_allclose(derivative(nested.real), rate, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(derivative(derivative(nested)), second, rtol=1e-10, atol=1e-10)
    for joint in (0.125, 0.875):  # where the pieces of the modified sine meet
        below, above = profile(joint - 1e-12), profile(joint + 1e-12)
        np.testing.assert_allclose(below, above, atol=1e-9)


@pytest.mark.parametrize("name", DRIVERS)
def test_derivatives_by_time_are_exact(name):
    """Closed-form rate and second derivative against nested duals of the coordinate."""
    run = prepare(driven(DRIVERS[name]))
    time = np.linspace(0.003, 1.7 * run.cycle.duration, 211)
    q, rate, second = run.system.drive(run.values, "A", time)
    nested = run.system.drive(run.values, "A", Dual(Dual(time, 1.0), Dual(1.0, 0.0)))[0]
    np.testing.assert_allclose(primal(nested), q, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(np.broadcast_to(derivative(nested).real, time.shape), rate * np.ones(211), atol=1e-9)
    curved = np.broadcast_to(derivative(derivative(nested)), time.shape)
    np.testing.assert_allclose(curved, second * np.ones(211), atol=1e-7)


@pytest.mark.parametrize("ends", ["clamped", "natural", "periodic"])
@pytest.mark.parametrize("count", [2, 3, 4, 30])
def test_splines_are_those_of_scipy(ends, count):
    if ends == "periodic" and count == 2:
        return
    rng = np.random.default_rng(count)
    knots, values = np.cumsum(rng.uniform(0.1, 1, count)), rng.normal(size=count)
    values[-1] = values[0] if ends == "periodic" else values[-1]
    place = np.linspace(knots[0], knots[-1], 97)
    oracle = CubicSpline(knots, values, bc_type=ends)
    plain = spline(list(map(float, knots)), list(map(float, values)), ends).at(place)
    stacked = spline(list(knots[:, None, None]), list(values[:, None, None]), ends).at(place)
    for order, (one, other) in enumerate(zip(plain, stacked, strict=True)):
        np.testing.assert_allclose(one, oracle(place, order), rtol=1e-9, atol=1e-11)
        np.testing.assert_allclose(other[0], one, rtol=1e-9, atol=1e-11)


def test_rise_dwell_return_dwell():
    run = prepare(driven({"law": "polynomial-345", "range": [0.5, 1.5], "duration": 0.2, "dwell": 0.1}))
    assert run.cycle.duration == pytest.approx(0.6)
    assert run.cycle.periodic
    q, rate, second = run.system.drive(run.values, "A", np.array([0.0, 0.1, 0.2, 0.25, 0.31, 0.4, 0.51, 0.55, 0.7]))
    np.testing.assert_allclose(q, [0.5, 1.0, 1.5, 1.5, 1.498841875, 1.0, 0.5, 0.5, 1.0], atol=1e-12)
    np.testing.assert_array_equal((rate == 0)[[0, 2, 3, 6, 7]], True)
    np.testing.assert_array_equal((second == 0)[[0, 2, 3, 6, 7]], True)
    np.testing.assert_allclose(rate[[1, 5, 8]], np.array([1, -1, 1]) * 1.875 / 0.2, rtol=1e-12)


@pytest.mark.parametrize("name", PROFILES)
def test_a_return_of_its_own_duration(name):
    """Rise, dwell, return, dwell one after the other; the largest rate is that of the quicker of the two."""
    stated = {"law": name, "range": [0.5, 1.5], "duration": 0.4, "return_duration": 0.1, "dwell": 0.05}
    run = prepare(driven(stated))
    assert run.cycle.duration == pytest.approx(0.6)
    times = np.array([0.0, 0.2, 0.42, 0.45, 0.5, 0.55, 0.58, 0.6, 0.8])
    q, rate, _ = run.system.drive(run.values, "A", times)
    np.testing.assert_allclose(q, [0.5, 1.0, 1.5, 1.5, 1.0, 0.5, 0.5, 0.5, 1.0], atol=1e-12)
    peak = PROFILES[name].peak_rate
    np.testing.assert_allclose(rate[[1, 4, 8]], [peak / 0.4, -peak / 0.1, peak / 0.4], rtol=1e-12)
    assert run.system.span(run.values, "A").peak == pytest.approx(peak / 0.1)
    alike = prepare(driven({**stated, "return_duration": 0.4}))
    plain = prepare(driven({key: value for key, value in stated.items() if key != "return_duration"}))
    for one, other in zip(*(r.system.drive(r.values, "A", times) for r in (alike, plain)), strict=True):
        np.testing.assert_array_equal(one, other)


# parameters
NUMBERS = [
    ("harmonic", "amplitude"), ("harmonic", "period"), ("harmonic", "phase"), ("harmonic", "mean"),
    ("cycloidal", "duration"), ("modified-sine", "dwell"), ("slow return", "return_duration"),
    ("slow return", "duration"), ("polynomial-345", "range.to"), ("cycloidal", "delay"),
    ("periodic table", "points.2.coordinate"), ("clamped table", "points.1.time"), ("natural table", "points.4.time"),
    ("constant", "speed"),
]  # fmt: skip


@pytest.mark.parametrize(("law", "key"), NUMBERS)
def test_every_number_has_a_path_samples_and_a_derivative(law, key):
    mechanism = driven(DRIVERS[law])
    run = prepare(mechanism)
    path, time, h = f"drivers.A.{key}", run.cycle.times(31) + 0.0037, 1e-6
    nominal = float(run.values[path])

    def drive(value):
        return run.system.drive(mechanism.parameters({path: value}), "A", time)

    samples = drive(np.array([[nominal - h], [nominal], [nominal + h]]))
    for one, plain in zip(samples, drive(nominal), strict=True):
        np.testing.assert_allclose(np.broadcast_to(one, (3, 31))[1], plain, rtol=1e-12, atol=1e-12)
    low, _, high = np.broadcast_to(samples[0], (3, 31))
    slope = derivative(drive(Dual(nominal, 1.0))[0])
    np.testing.assert_allclose(np.broadcast_to(slope, (31,)), (high - low) / (2 * h), rtol=1e-4, atol=1e-5)


# the analysis
@pytest.mark.spread(5)
@pytest.mark.parametrize("name", DRIVERS)
def test_power_balances_and_the_motion_is_the_prescribed_one(name):
    mechanism = driven(DRIVERS[name])
    result = brief(mechanism, 72)
    assert set(np.unique(result.status)) <= {Status.SOLVED, Status.ZERO_SLIP}
    power = result.drive_power.sum("driver")
    assert float(np.abs(result.power_residual).max()) < 1e-10 * float(np.abs(power).max())
    run = prepare(mechanism)
    q, rate, second = (np.broadcast_to(n, 72) for n in run.system.drive(run.values, "A", result.time.values))
    crank = result.sel(joint="A")
    np.testing.assert_allclose(crank.joint_rotation, q, rtol=1e-12)
    np.testing.assert_allclose(crank.joint_rotation_velocity, rate, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(crank.joint_rotation_acceleration, second, rtol=1e-10, atol=1e-8)
    np.testing.assert_allclose(result.drive_power[0], result.drive_effort[0] * rate, rtol=1e-12, atol=1e-12)


def test_in_a_dwell_every_joint_rests_and_the_effort_is_an_interval():
    result = analyse({**slider_crank(), "drivers": {"A": DRIVERS["cycloidal"]}}, 60)
    resting = result.joint_rotation_velocity.sel(joint="A").values == 0
    assert 15 <= np.count_nonzero(resting) <= 25
    assert np.all(result.status.values[resting] == Status.ZERO_SLIP)
    assert np.all(result.friction_power.values[:, resting] == 0)
    assert np.all(result.drive_power.values[:, resting] == 0)
    lower, upper = result.drive_effort_lower[0].values, result.drive_effort_upper[0].values
    assert np.all(np.isfinite([lower, upper]))
    assert np.all(upper[resting] - lower[resting] > 1e-3)
    told = [row for row in json.loads(result.attrs["findings"]) if row["code"] == "friction.interval"]
    assert any(row["where"] == "joints.A, B, P, C" for row in told)  # once for all


def test_periods_and_ranges_that_do_not_fit():
    data = five_bar()
    data["drivers"] = {"A": {"speed": 2 * np.pi}, "E": DRIVERS["harmonic"]}
    assert prepare(build(data)).cycle.duration == pytest.approx(1.0)
    data["drivers"]["E"] = DRIVERS["one rise"]  # it waits at its end
    run = prepare(build(data))
    assert (run.cycle.duration, run.cycle.periodic) == (pytest.approx(1.0), False)
    data["drivers"]["E"] = DRIVERS["natural table"]
    with pytest.raises(MechanismError, match=r"lasts 0\.6 s, the whole cycle lasts 1 s"):
        prepare(build(data))


@pytest.mark.spread(1)
@pytest.mark.parametrize("name", ["harmonic", "modified-sine", "periodic table", "late rise", "clamped table"])
def test_a_general_group_follows_any_law(name):
    """Its track, read by time, and a slower run of the same motion."""
    mechanism = driven(DRIVERS[name], class_three())
    run = prepare(mechanism)
    result = brief(mechanism, 50)
    assert result.status.values.max() <= Status.ZERO_SLIP
    assert float(np.abs(result.power_residual).max()) < 1e-9 * float(np.abs(result.drive_power).max())
    slower = {path: 3 * value for path, value in run.values.items() if path in TIMES and path.startswith("drivers.A")}
    slower |= {p: 3 * v for p, v in run.values.items() if p.startswith("drivers.A.points") and p.endswith("time")}
    time = run.cycle.times(50)
    plain, slow = run.solve(time), run.solve(3 * time, mechanism.parameters(slower))
    for link, motion in plain.walk.motions.items():
        for one, other in zip(motion.frame, slow.walk.motions[link].frame, strict=True):
            np.testing.assert_allclose(np.broadcast_to(other, 50), np.broadcast_to(one, 50), atol=1e-9)


TIMES = {f"drivers.A.{key}" for key in ("period", "duration", "return_duration", "dwell", "delay")}


# bad input
RISE = {"law": "cycloidal", "range": [0.2, 1.0], "duration": 0.2}
BAD = [
    ({"law": "cycloidal", "range": [0.2, 1.0]}, "drivers.A", "'duration' is missing"),
    ({"law": "harmonic", "amplitude": 0.1, "period": -0.5}, "drivers.A.period", "is -0.5 s, which is not above 0"),
    ({"law": "harmonic", "amplitude": 0, "period": 0.5}, "drivers.A.amplitude", "never moves"),
    ({"law": "harmonic", "amplitude": "20 mm", "period": 0.5}, "drivers.A.amplitude", "is a length where an angle"),
    ({**RISE, "speed": 3.0}, "drivers.A.speed", "'speed' has no effect on the motion law cycloidal"),
    ({"speed": 3.0, "duration": 0.2}, "drivers.A.duration", "has no effect on the motion law constant"),
    ({**RISE, "return_duration": 0}, "drivers.A.return_duration", "is 0 s, which is not above 0"),
    ({**RISE, "return_duration": 1, "returns": False}, "drivers.A.return_duration", "has no effect without returns"),
    ({**RISE, "law": "cycloid"}, "drivers.A.law", "'cycloid' is not a motion law"),
    ({"law": "table", "points": [[0, 0]]}, "drivers.A.points", "at least 2 are needed"),
    ({"law": "table", "points": [[0, "0 mm"], ["1 s", "3 mm"]]}, "drivers.A.points.1.coordinate", "is a length"),
    ({"law": "table", "points": [[0, 0], [1, 1], [2, 2]], "periodic": True}, "drivers.A.points", "ends at 2 (SI)"),
    ({"law": "table", "points": [[0, 0], [1, 0]], "periodic": True}, "drivers.A.points", "needs at least three points"),
    ({"law": "table", "points": [[0, 0], [1, 2]], "ends": "natural", "delay": 1}, "drivers.A.delay", "natural ends"),
]


@pytest.mark.parametrize(("driver", "where", "what"), BAD)
def test_bad_input_is_told(driver, where, what):
    with pytest.raises(MechanismError) as raised:
        Mechanism(**model({**slider_crank(), "drivers": {"A": driver}}))
    found = [one for one in raised.value.findings if one.where == where and what in one.what]
    assert found, [f"{one.where}: {one.what}" for one in raised.value.findings]


def test_a_single_rise_stays_and_a_delay_shifts_it():
    run = prepare(driven(DRIVERS["late rise"]))
    assert (run.cycle.duration, run.cycle.periodic) == (pytest.approx(0.35), False)
    q, rate, _ = run.system.drive(run.values, "A", np.array([0.0, 0.05, 0.15, 0.25, 0.35, 2.0]))
    np.testing.assert_allclose(q, [0.2, 0.2, 1.05, 1.9, 1.9, 1.9], rtol=1e-14)
    np.testing.assert_allclose(rate, [0, 0, 2 * 1.7 / 0.2, 0, 0, 0], atol=1e-12)


def test_a_periodic_table_may_gain_whole_turns():
    run = prepare(driven(DRIVERS["whole turns"]))
    time = np.linspace(0, 0.5, 40)
    here, there = (np.array(run.system.drive(run.values, "A", t)) for t in (time, time + 1.0))
    np.testing.assert_allclose(there[0] - here[0], 4 * np.pi, rtol=1e-12)
    np.testing.assert_allclose(there[1:], here[1:], rtol=1e-9, atol=1e-9)
    assert run.system.dial(run.values, time).unit == "°"  # it runs one way
