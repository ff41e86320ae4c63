"""A model beside a measurement: verdicts, what is named, and what has no answer."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

import trunnion
from rig_measurements import course, measured, rocker
from trunnion import MechanismError, Status
from trunnion.errors import Severity
from trunnion.rig.comparison import CAUSES, VARIABLES, Verdict, causes, independent, judge
from trunnion.rig.reading.measurement import Accuracy, Condition, Measurement, Signal, student

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
POWERS = ("torque", "speed", "brake", "out")


def compare(measurement, mechanism=None, **options):
    return trunnion.rig.compare(mechanism or rocker(), measurement, **options)


def said(result, *words):
    """The findings that have all these words."""
    rows = json.loads(result.attrs["findings"])
    return [row for row in rows if all(word in " ".join(map(str, row.values())) for word in words)]


def codes(result):
    return set(result.verdict.values.ravel().tolist())


# ---- judging --------------------------------------------------------------------------------------------------


COVERED = stats.norm.cdf(2) - stats.norm.cdf(-2)  # of k = 2


def test_scatter_between_turns_is_that_of_a_sample():
    """1, 2, 4: s² = (16 + 1 + 25)/9/2 = 7/3, of the mean s²/3."""
    one = course("torque", np.array([[1.0], [2.0], [4.0]]))
    assert one.scatter == pytest.approx((7 / 3) ** 0.5)
    assert one.uncertainty == pytest.approx((7 / 9) ** 0.5)
    assert np.isnan(course("torque", np.array([[1.0]])).scatter).all()


@pytest.mark.parametrize("resolution", [0.0, 0.9, 3.0])
@pytest.mark.parametrize("zero", [0.0, 0.05])
def test_uncertainty_of_a_bias(resolution, zero):
    """Means of turns scatter by s/√n; steps of the readings give step/√12 at each of the positions, each its own, so
    /√N in the mean; the zero is that of all of them. k is Student's for (n − 1) u⁴/u_A⁴."""
    offsets, positions = np.array([-0.2, 0.1, 0.3, -0.2]), 25
    found = judge(
        course("torque", 5.0 + offsets[:, None] + np.zeros((4, positions)), Accuracy(zero, 0.0, resolution)),
        np.full(positions, 4.0),
        np.ones(positions, bool),
        np.arange(positions),
    )
    own = float(np.sum(offsets**2)) / 3 / 4
    steps = resolution**2 / 12 / positions
    total = own + steps + zero**2
    factor = stats.t.ppf(0.5 + COVERED / 2, 3 * total**2 / own**2)
    assert found["bias"] == pytest.approx(1.0)
    assert found["bias_expanded"] == pytest.approx(factor * total**0.5, rel=1e-6)


@pytest.mark.spread(5)
@pytest.mark.parametrize("turns", [3, 12])
@pytest.mark.parametrize(("zero", "gain", "off"), [(0, 0, 0), (0.3, 0, 0), (0.05, 0.01, 0), (0, 0, 0.05)])
@pytest.mark.parametrize("smooth", [1, 9])
def test_a_true_model_is_within_in_about_95_percent(turns, zero, gain, off, smooth):
    """Of courses with noise, correlated or not, and sensors whose zero, gain and angle are off as stated, in rad."""
    random, count = np.random.default_rng(4), 60
    drive = 2 * np.pi * np.arange(count) / count
    true = 10 + 3 * np.sin(drive)
    kernel = np.fft.rfft(np.ones(smooth) / smooth**0.5, count)
    shares, within = [], 0
    for _ in range(150):
        noise = np.fft.irfft(np.fft.rfft(random.normal(size=(turns, count)), axis=1) * kernel, count)
        found = true * (1 + gain * random.normal()) + zero * random.normal() + 0.2 * noise
        found += 3 * (np.sin(drive + off * random.normal()) - np.sin(drive)) if off else 0
        slope = 3 * off * np.cos(drive)
        one = judge(course("torque", found, Accuracy(zero, gain)), true, np.ones(count, bool), true, angle=slope)
        shares.append(one["within"])
        within += one["verdict"] is Verdict.WITHIN
    assert np.mean(shares) == pytest.approx(0.9545, abs=0.035)
    assert within / 150 >= 0.90


def test_expanded_uncertainty_is_that_of_the_gum():
    """k_p for 95.45 %: GUM, Table G.2."""
    freedom = np.array([1.0, 2.0, 5.0, 10.0, 50.0, np.inf])
    assert student(freedom, 2.0) == pytest.approx([13.97, 4.53, 2.65, 2.28, 2.05, 2.0], abs=0.005)


def test_degrees_of_freedom_count_what_scatters_only():
    turns = np.random.default_rng(0).normal(size=(4, 10))
    alone = course("torque", turns).parts()
    assert alone.freedom == pytest.approx(3.0)
    with_zero = course("torque", turns, Accuracy(zero=100.0)).parts()
    assert (with_zero.freedom > 1e6).all()
    assert with_zero.total == pytest.approx(np.hypot(alone.total, 100.0))
    assert with_zero.total == pytest.approx(course("torque", turns, Accuracy(zero=100.0)).uncertainty)


def test_positions_that_vary_together_count_as_one():
    random = np.random.default_rng(2)
    apart = course("torque", random.normal(size=(40, 50))).parts()
    together = course("torque", np.repeat(random.normal(size=(40, 1)), 50, axis=1)).parts()
    assert independent(apart) > 35
    assert independent(together) == pytest.approx(1.0, abs=0.2)


# ---- what is found --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("clip", "verdict"), [(13.2, Verdict.NOT), (12.99, Verdict.WITHIN)])
def test_a_clipped_peak_is_not_within_though_most_positions_are(clip, verdict):
    """An uncertain zero makes the positions one, so that two thirds of them suffice; a tenth that is 30 U off is not
    chance. 13 is the height of the peak: what is clipped at 12.99 loses less than U."""
    random, count = np.random.default_rng(4), 60
    true = 10 + 3 * np.sin(2 * np.pi * np.arange(count) / count)
    true[13:18] += 30 if verdict is Verdict.NOT else 0
    turns = np.minimum(true + random.normal(0, 0.05, (12, count)), clip)
    found = judge(course("torque", turns, Accuracy(0.3, 0.0)), true, np.ones(count, bool), np.arange(count))
    assert found["within"] >= found["within_least"]
    assert found["verdict"] is verdict


def test_a_model_beside_itself_is_within():
    result = compare(measured(settings=({"A.speed": 4.0}, {"A.speed": 6.0}), channels=POWERS, noise=0.05, seed=5))
    assert codes(result) == {Verdict.WITHIN}
    assert (result.efficiency_within.values == 1).all()
    assert result.attrs["all_within"] == 1
    assert not [row for row in json.loads(result.attrs["findings"]) if row["severity"] == "error"]
    assert result.residual.values == pytest.approx(result.measured.values - result.model.values, nan_ok=True)
    for name, one in result.data_vars.items():
        assert one.dims == VARIABLES[name].dims
        assert one.attrs["long_name"] == VARIABLES[name].long_name


def test_model_and_efficiency_are_those_of_analyse():
    mechanism = rocker().with_values({"A.speed": 6.0})
    whole = trunnion.analyse(mechanism, 36)
    result = compare(measured(settings=({"A.speed": 6.0},), channels=POWERS, noise=0.0))
    assert result.model.sel(channel="torque").values[0] == pytest.approx(whole.drive_effort.values[0], nan_ok=True)
    # like a rig, of the positions that were measured
    at_them = float(whole.useful_power.mean() / whole.drive_power.sum("driver").mean())
    assert result.efficiency_model.values[0] == pytest.approx(at_them, rel=1e-9)
    assert result.efficiency.values[0] == pytest.approx(at_them, rel=1e-9)


def wrong_in(name, change):
    return lambda channel, true: change(true) if channel == name else true


def causes_of(result, channel):
    """Size and share of each cause of a channel in the first condition."""
    one = result.sel(channel=channel).isel(condition=0)
    return {kind: (float(one[f"{kind}_error"]), float(one[f"{kind}_explains"])) for kind in CAUSES}


@pytest.mark.parametrize("gain", [1.05, 10.0, 1e-3])
def test_a_gain_has_its_size(gain):
    result = compare(measured(wrong=wrong_in("out", lambda course: gain * course), noise=1e-6))
    assert causes_of(result, "out")["gain"] == pytest.approx((gain - 1, 1.0), abs=1e-3)


def test_a_gain_acts_from_where_the_sensor_reads_nothing():
    true = 3 + np.sin(2 * np.pi * np.arange(36) / 36)
    found = causes(0.1 * (true - 2), true, datum=2.0)
    assert found["gain"] == pytest.approx((0.1, 1.0))
    assert found["zero"] == pytest.approx((0.1, 1 / 1.5))


def test_a_shift_of_the_angle_has_its_size():
    """Readings 5° behind the model; of a course in time no angle is looked for."""
    result = compare(measured(positions=72, wrong=lambda channel, true: np.roll(true, 1), noise=0.005))
    size, share = causes_of(result, "torque")["angle"]
    assert np.degrees(size) == pytest.approx(-5, abs=0.5)
    assert share > 0.9
    assert "angle" not in causes(np.ones(5), np.arange(5.0))


def test_friction_has_its_size_and_a_model_without_has_none():
    """A torque of 0.2 where the model has 0.12, to first order 0.67 more: mostly an offset too."""
    data = measured(rocker(friction=0.2), noise=0.02, accuracy=Accuracy(zero=1e-3))
    size, share = causes_of(compare(data), "torque")["friction"]
    assert size == pytest.approx(0.67, abs=0.1)
    assert share > 0.95
    without = compare(data, rocker().with_friction("off"), channels=["torque"])
    assert np.isnan(causes_of(without, "torque")["friction"]).all()
    assert np.isfinite(causes_of(without, "torque")["zero"]).all()


def test_a_driver_at_another_speed_is_named():
    other = measured(settings=({"A.speed": 6.0},), channels=("speed", "out"))
    conditions = tuple(replace(one, values={}, speed=6.0) for one in other.conditions)
    result = compare(replace(other, conditions=conditions))
    rpm = np.pi / 30
    assert said(result, "drivers.A", f"{6 / rpm:.4g} rpm measured, {4 / rpm:.4g} rpm in the model")
    told = [
        replace(one, courses={name: replace(row, read_in=("U/min", rpm)) if name == "speed" else row
                              for name, row in one.courses.items()})
        for one in conditions
    ]  # fmt: skip
    result = compare(replace(other, conditions=tuple(told)))
    (found,) = (one for one in result.trunnion.findings if one.code == "compare.speed")
    assert found.figures["measured"] == pytest.approx(6.0)
    assert found.severity is Severity.ERROR
    assert f"{6 / rpm:.4g} U/min measured" in found.what
    near = replace(other, conditions=tuple(replace(one, speed=6.1) for one in other.conditions))
    (found,) = (one for one in compare(near).trunnion.findings if one.code == "compare.speed")
    assert found.severity is Severity.WARNING


# ---- no answer ------------------------------------------------------------------------------------------------


def test_locked_conditions_are_nan_and_said():
    fine, locked = {"joint_defaults.friction.coefficient": 0.12}, {"joint_defaults.friction.coefficient": 40.0}
    result = compare(
        Measurement(
            "bench",
            tuple(
                replace(one, values=values, name=name)
                for one, values, name in zip(
                    measured(settings=({}, {}), channels=POWERS, seed=5).conditions,
                    (fine, locked),
                    ("fine", "tight"),
                    strict=True,
                )
            ),
        )
    )
    status = result.status.values
    assert (status[1] == Status.LOCKED).any()
    assert np.isnan(result.model.values[0, 1][status[1] == Status.LOCKED]).all()
    assert np.isnan(result.efficiency_model.values[1])
    assert result.efficiency_within.values.tolist() == [1, -1]
    assert said(result, "no solution in 1 of 2 conditions (tight)", "locked by friction", "--set")
    assert result.verdict.values[0, 0] == Verdict.WITHIN
    assert result.attrs["all_within"] == 0


def test_positions_with_a_speed_of_zero_are_left_out_of_forces():
    result = compare(measured(channels=("torque", "angle")))
    zero = result.status.values[0] == Status.ZERO_SLIP
    assert (result.compared.sel(channel="torque").values[0][zero] == 0).all()
    assert result.compared.sel(channel="angle").values[0].all()


@pytest.mark.parametrize("start", [0.0, 0.5])
def test_a_brake_that_turns_its_torque_is_within_a_true_model(start):
    """Resampling smears the jump at a reversal over the positions beside it, wherever these are."""
    mechanism = trunnion.read(EXAMPLES / "toleranced-fourbar.yaml").with_values({"A.start": f"{start} deg"})
    observed = trunnion.rig.observe(mechanism, EXAMPLES / "rig" / "fourbar-rig.yaml", seed=3)
    result = compare(observed.measurement(), mechanism, channels=["torque-rocker"])
    assert codes(result) == {Verdict.WITHIN}
    assert np.abs(result.largest.values).max() < 0.05  # of jumps by 4 N m and more


# ---- odd input ------------------------------------------------------------------------------------------------


def test_one_turn_is_no_uncertainty():
    result = compare(measured(turns=1, channels=POWERS))
    assert codes(result) == {Verdict.UNKNOWN}
    assert np.isfinite(result.rms.values).all()
    assert np.isnan(result.within.values).all()
    assert result.efficiency_within.values.tolist() == [-1]
    assert said(result, "channels.torque", "no values of two turns", "warning")
    assert said(result, "efficiency", "not known in run 1: there is only one turn", "more turns")


def test_a_timed_cycle_is_the_models():
    """A turn at 4 rad/s lasts π/2 s."""
    whole = measured()

    def lasting(seconds):
        return compare(replace(whole, conditions=tuple(replace(one, duration=seconds) for one in whole.conditions)))

    assert codes(lasting(np.pi / 2 * 1.001)) == {Verdict.WITHIN}
    with pytest.raises(MechanismError, match=r"the cycle of the data is 1\.7 s, that of the model 1\.570796327 s"):
        lasting(1.7)


def test_a_channel_without_a_value_has_nothing_to_compare():
    whole = measured()
    condition = whole.conditions[0]
    empty = course("out", np.full((8, 36), np.nan))
    result = compare(replace(whole, conditions=(replace(condition, courses={**condition.courses, "out": empty}),)))
    assert result.verdict.values.ravel().tolist() == [Verdict.WITHIN, Verdict.NOTHING]
    assert said(result, "channels.out", "not compared")


@pytest.mark.parametrize(
    ("measures", "words"),
    [
        ("effort:B", ("channels.torque", "'B'")),
        ("torque:A", ("channels.torque.measures", "no measure")),
        ("rate:nothing", ("channels.torque", "nothing")),
        ("maximum:effort:A", ("channels.torque.measures", "no number of a single position")),
        ("efficiency:cycle", ("channels.torque.measures", "no number of a single position")),
        ("stroke:D", ("channels.torque.measures", "no number of a single position")),
        ("peak", ("channels.torque.measures", "no measure")),
        ("starting_time:A", ("channels.torque.measures",)),
        ("rotation:D", ("channels.torque", "is in N m, and rotation:D is in rad")),
    ],
)
def test_a_measure_that_the_model_lacks_is_refused(measures, words):
    whole = measured()
    condition = whole.conditions[0]
    odd = replace(condition.courses["torque"], measures=measures)
    bad = replace(whole, conditions=(replace(condition, courses={**condition.courses, "torque": odd}),))
    with pytest.raises(MechanismError) as caught:
        compare(bad)
    text = str(caught.value)
    assert all(word in text for word in words), text
    assert compare(bad, channels=["out"]).channel.values.tolist() == ["out"]


def test_unknown_channels_values_and_factors_are_refused():
    whole = measured()
    with pytest.raises(MechanismError, match="did you mean 'torque'"):
        compare(whole, channels=["torqe"])
    with pytest.raises(MechanismError, match="coverage factor"):
        compare(whole, coverage=0.0)
    odd = tuple(replace(one, values={"A.spede": 1.0}) for one in whole.conditions)
    with pytest.raises(MechanismError, match=r"in condition run 1"):
        compare(replace(whole, conditions=odd))
    with pytest.raises(MechanismError, match="no condition"):
        compare(Measurement("bench", ()))
    bare = Condition(
        "bare", {}, whole.conditions[0].phase, {"x": replace(course("torque", np.zeros((2, 36))), measures="")}
    )
    with pytest.raises(MechanismError, match="no channel measures anything"):
        compare(Measurement("bench", (bare,)))


def test_a_load_that_rests_takes_no_power():
    """A load has no torque where its joint stands still: the efficiency of the model is known all the same."""
    mechanism = trunnion.read(EXAMPLES / "scotch-yoke.yaml")
    name, load = next((name, load) for name, load in mechanism.loads.items() if load.joint)
    force = "N" if load.resisting_torque is None else "N m"
    speed = "m/s" if force == "N" else "rad/s"
    driver = next(iter(mechanism.drivers))
    kinds = {"T": (f"effort:{driver}", "N m"), "w": (f"rate:{driver}", "rad/s"), "L": (f"load:{name}", force),
             "v": (f"rate:{load.joint}", speed)}  # fmt: skip
    blank = {key: Signal(key, what, unit, np.ones((3, 24))) for key, (what, unit) in kinds.items()}
    result = compare(Measurement("bench", (Condition("a", {}, np.arange(24) / 24, blank),)), mechanism)
    assert np.isnan(result.model.sel(channel="L").values).any()
    assert np.isfinite(result.efficiency_model.values).all()


def test_an_angle_that_runs_backwards_is_refused():
    data = measured(channels=("speed", "out"))
    back = replace(data, conditions=tuple(replace(one, speed=-4.0) for one in data.conditions))
    with pytest.raises(MechanismError) as caught:
        compare(back)
    assert {one.code for one in caught.value.findings} == {"data.angle.backwards"}
    assert caught.value.findings[0].figures["measured"] == -4.0


def test_another_cycle_or_start_is_refused():
    whole = measured()
    for start, cycle, words in ((0.5, 2 * np.pi, "state start: 0 deg"), (0.0, 4 * np.pi, "state cycle: 360 deg")):
        other = tuple(replace(one, start=start, cycle=cycle) for one in whole.conditions)
        with pytest.raises(MechanismError, match=words):
            compare(replace(whole, conditions=other))
    same = tuple(replace(one, start=2 * np.pi, cycle=2 * np.pi) for one in whole.conditions)
    assert codes(compare(replace(whole, conditions=same))) == {Verdict.WITHIN}


@pytest.mark.parametrize(
    "verb", [trunnion.rig.compare, lambda model, data: trunnion.rig.identify(model, data, ["A.friction"])]
)
def test_a_force_in_place_of_a_torque_is_refused(verb):
    data = measured(rocker())
    torque = replace(data.conditions[0].courses["torque"], unit="N")
    one = replace(data.conditions[0], courses={**data.conditions[0].courses, "torque": torque})
    with pytest.raises(MechanismError, match=r"is in N, and effort:A is in N m — name another column"):
        verb(rocker(), replace(data, conditions=(one,)))
