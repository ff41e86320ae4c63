"""Efficiency from measured courses: what it is, and whether its uncertainty is what many rigs would scatter by."""

from dataclasses import replace

import numpy as np
import pytest

from trunnion.errors import MechanismError
from trunnion.rig.reading.measurement import Accuracy, Condition, Signal, efficiency_of

TURNS, POSITIONS = 12, 24
PHASE = np.arange(POSITIONS) / POSITIONS
CYCLE = 2 * np.pi * PHASE
TRUE = {
    "T1": 12 + 2 * np.sin(2 * CYCLE),
    "T2": 10 + 0.5 * np.cos(CYCLE),
    "n1": 50 + 0 * CYCLE,
    "n2": 50 * (1 + 0.1 * np.cos(2 * CYCLE)),
}
MEASURES = {"T1": "effort:a", "T2": "load:brake", "n1": "rate:a", "n2": "rate:out"}
ACCURACY = {
    "T1": Accuracy(0.05, 0.002),
    "T2": Accuracy(0.04, 0.003),
    "n1": Accuracy(0.1, 0.0005),
    "n2": Accuracy(0.2, 0.001),
}
NOISE = {"T1": 0.3, "T2": 0.2, "n1": 0.5, "n2": 0.5}
ETA = float(np.mean(TRUE["T2"] * TRUE["n2"]) / np.mean(TRUE["T1"] * TRUE["n1"]))


def condition(turns, accuracy=None):
    known = ACCURACY if accuracy is None else accuracy
    courses = {
        name: Signal(name, MEASURES[name], "", values, known.get(name, Accuracy())) for name, values in turns.items()
    }
    return Condition("one", {}, PHASE, courses)


def exact(turns=3):
    return {name: np.tile(course, (turns, 1)) for name, course in TRUE.items()}


@pytest.mark.slow
def test_uncertainty_is_the_scatter_of_many_rigs():
    """2000 rigs with errors and noise as stated: their standard deviation is u, and 2 u covers 95 %."""
    random = np.random.default_rng(5)
    values, uncertainties = [], []
    for _ in range(2000):
        turns = {}
        for name, course in TRUE.items():
            gain, zero = random.standard_normal(2) * (ACCURACY[name].gain, ACCURACY[name].zero)
            noise = NOISE[name] * random.standard_normal((TURNS, POSITIONS))
            turns[name] = course * (1 + gain) + zero + noise
        found = efficiency_of(condition(turns))
        values.append(found.value)
        uncertainties.append(found.uncertainty)
    spread = float(np.std(values))
    assert np.mean(uncertainties) == pytest.approx(spread, rel=0.05)
    assert np.mean(values) == pytest.approx(ETA, abs=4 * spread / 2000**0.5)
    inside = np.abs(np.array(values) - ETA) < 2 * np.array(uncertainties)
    assert np.mean(inside) == pytest.approx(0.955, abs=0.02)


def test_contributions_are_those_of_small_changes():
    """The effect of each gain and zero is what changing the readings by it does, and their squares add up."""
    found = efficiency_of(condition(exact()))
    for one in found.contributions:
        if one.source == "repeatability":
            continue
        changed = exact()
        values = changed[one.channel]
        changed[one.channel] = values * (1 + 1e-6) if one.source == "gain" else values + 1e-6
        slope = (efficiency_of(condition(changed)).value - found.value) / 1e-6
        assert one.sensitivity == pytest.approx(slope, rel=1e-4), (one.channel, one.source)
    assert found.value == pytest.approx(ETA, rel=1e-12)
    assert found.uncertainty**2 == pytest.approx(sum(one.effect**2 for one in found.contributions))
    assert str(found).endswith("(k = 2)")
    assert found.expanded == 2 * found.uncertainty


def test_one_speed_sensor_for_both_sides_cancels():
    """A speed that is measured once stands in both powers: its gain does nothing."""
    turns = {name: exact()[name] for name in ("T1", "T2", "n1")}
    found = efficiency_of(condition(turns, {"n1": Accuracy(0.0, 0.01)}))
    assert found.value == pytest.approx(float(np.mean(TRUE["T2"]) / np.mean(TRUE["T1"])), rel=1e-12)
    assert found.uncertainty == pytest.approx(0.0, abs=1e-12)


def test_gaps_and_single_turns():
    """A turn that lacks much is left out, one that lacks little has it of the others; one turn has no scatter."""
    turns = exact(4)
    turns["T1"][1, 5] = turns["n2"][2, 7] = np.nan  # where power in and out are not those of the mean
    found = efficiency_of(condition(turns))
    assert (len(found.per_turn), found.left_out) == (4, 0)
    assert found.value == pytest.approx(ETA, rel=1e-12)
    assert found.per_turn == pytest.approx([ETA] * 4, rel=1e-12)
    assert np.isfinite(found.uncertainty)
    turns["T1"][1, 5:9] = np.nan
    found = efficiency_of(condition(turns))
    assert (len(found.per_turn), found.left_out) == (3, 1)
    assert found.value == pytest.approx(ETA)
    single = efficiency_of(condition(exact(1)))
    assert single.value == pytest.approx(ETA)
    assert np.isnan(single.uncertainty)
    turns["n2"][:] = np.nan
    with pytest.raises(MechanismError, match="no turn is whole"):
        efficiency_of(condition(turns))
    with pytest.raises(MechanismError, match="no turn is whole"):
        efficiency_of(condition({**exact(), "T1": np.where(np.arange(POSITIONS) == 3, np.nan, exact()["T1"])}))


def test_a_dead_sensor_is_told():
    with pytest.raises(MechanismError, match="there is no input power: T1 or n1 reads 0 throughout"):
        efficiency_of(condition({**exact(), "T1": np.zeros((3, POSITIONS))}))


def test_resolution_counts_where_noise_does_not_carry_over_the_steps():
    """Readings that never change are known to step/√12; noisy ones average out."""
    coarse = {"T2": Accuracy(resolution=0.1)}
    still = efficiency_of(condition(exact(), coarse))
    assert [(one.channel, one.source) for one in still.contributions] == [("T2", "resolution")]
    assert still.contributions[0].input == pytest.approx(0.1 / 12**0.5)
    noisy = exact()
    noisy["T2"] = noisy["T2"] + 0.2 * np.random.default_rng(1).standard_normal(noisy["T2"].shape)
    assert "resolution" not in {one.source for one in efficiency_of(condition(noisy, coarse)).contributions}


@pytest.mark.parametrize("swing", [0.02, 0.1, 0.3])
def test_powers_are_means_over_time_where_the_speed_varies(swing):
    """Against energies over a turn, integrated in time: positions are equal steps of the angle."""
    fine = 2 * np.pi * (np.arange(20_000) + 0.5) / 20_000
    torque, speed = (lambda at: 10 + 8 * np.sin(2 * at)), (lambda at: 19 * (1 + swing * np.sin(2 * at)))
    duration = np.mean(1 / speed(fine))
    turns = {
        "T1": torque(CYCLE), "T2": np.full(POSITIONS, 9.0), "n1": speed(CYCLE), "n2": speed(CYCLE)
    }  # fmt: skip
    one = condition({name: np.tile(course, (3, 1)) for name, course in turns.items()})
    found = efficiency_of(replace(one, speed=1 / duration))
    assert found.value == pytest.approx(np.mean(9.0) / np.mean(torque(fine)), abs=1e-5)  # ∫ T ω dt = ∫ T dθ
    assert found.power_in == pytest.approx(np.mean(torque(fine)) / duration, rel=1e-5)
    timed = efficiency_of(one)  # positions are equal steps of time, and no speed is known of the angle
    assert timed.value == pytest.approx(9 * np.mean(speed(CYCLE)) / np.mean(torque(CYCLE) * speed(CYCLE)))


def test_few_turns_have_the_factor_of_student():
    """GUM, Table G.2: 13.97 for one degree of freedom, 4.53 for two; 2 where a sensor's own uncertainty prevails."""
    noise = np.random.default_rng(3).standard_normal((3, POSITIONS))
    turns = {**exact(), "T1": exact()["T1"] + noise}
    alone = efficiency_of(condition(turns, {}))
    assert alone.freedom == pytest.approx(2)
    assert alone.expanded == pytest.approx(4.53 * alone.uncertainty, rel=2e-3)
    assert str(alone).endswith("(k = 4.5)")
    two = efficiency_of(condition({name: course[:2] for name, course in turns.items()}, {}))
    assert two.factor() == pytest.approx(13.97, rel=1e-3)
    assert efficiency_of(condition(turns, {"T2": Accuracy(zero=10.0)})).factor() == pytest.approx(2, abs=1e-3)


def test_scatter_of_the_efficiency_is_that_of_a_sample_of_turns():
    """Brake torques of 0.9, 1 and 1.2 times the same course: η by as much, and s/√3 with s² of the three over 2."""
    shares = np.array([0.9, 1.0, 1.2])
    found = efficiency_of(condition({**exact(), "T2": shares[:, None] * TRUE["T2"]}, {}))
    assert found.per_turn == pytest.approx(ETA * shares, rel=1e-12)
    assert found.value == pytest.approx(ETA * 3.1 / 3, rel=1e-12)
    spread = (np.sum(shares**2) - 3.1**2 / 3) / 2
    assert found.uncertainty == pytest.approx(ETA * (spread / 3) ** 0.5, rel=1e-9)


def test_contributions_count_what_a_speed_does_to_the_time():
    """Where the driver's speed gives each position its time, small changes of it are those of the ratio too."""
    turns = exact()
    turns["n1"] = turns["n1"] * (1 + 0.2 * np.sin(2 * CYCLE + 0.4))
    found = efficiency_of(replace(condition(turns), speed=-50.0))
    for one in found.contributions:
        changed = {**turns}
        values = changed[one.channel]
        changed[one.channel] = values * (1 + 1e-6) if one.source == "gain" else values + 1e-6
        slope = (efficiency_of(replace(condition(changed), speed=-50.0)).value - found.value) / 1e-6
        assert one.sensitivity == pytest.approx(slope, rel=1e-4, abs=1e-7), (one.channel, one.source)
