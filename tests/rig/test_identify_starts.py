"""Identification from measured starts, against the closed form of a flywheel with a linear motor and a constant loss.

J ω̇ = M₀ (1 − ω/ω₀) − M: ω = ω∞ (1 − e^(−t/τ)), ω∞ = ω₀ (1 − M/M₀), τ = J ω₀/M₀.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from timed import LINEAR, wheel
from trunnion.errors import MechanismError
from trunnion.rig import compare, identify, read
from trunnion.rig.reading.measurement import Accuracy, Condition, Measurement, Signal

INERTIA, STALL, LOSS, IDLE = 0.06, 4.0, 0.7, 150.0  # the model has 0.05 and 0.6
DURATION = 12.0
J, M, M0 = "links.wheel.inertia", "loads.drag.resisting_torque", "drivers.A.motor.stall_effort"
UNITS = {"starting_time:A": "s", "steady_speed:A": "rad/s", "peak_effort:A": "N m"}


def speed(time: Any, inertia: float = INERTIA, stall: float = STALL, loss: float = LOSS) -> Any:
    return IDLE * (1 - loss / stall) * -np.expm1(-time * stall / (inertia * IDLE))


def figures(inertia: float = INERTIA, stall: float = STALL, loss: float = LOSS) -> dict[str, float]:
    """Starting time, mean speed of the last turn of DURATION, and the motor's torque at the start."""
    tau, steady = inertia * IDLE / stall, IDLE * (1 - loss / stall)

    def gone(time: float) -> float:
        return steady * float(time + tau * np.expm1(-time / tau))

    def takes(time: float) -> float:
        return time - float(brentq(lambda t: gone(t) - gone(time) + 2 * np.pi, 0.0, time, xtol=1e-14))

    last = takes(DURATION)
    start = float(brentq(lambda t: takes(t) - last / 0.95, 2.0 * tau, DURATION, xtol=1e-13))
    return {"starting_time:A": start, "steady_speed:A": 2 * np.pi / last, "peak_effort:A": stall}


def values(name: str, of: Mapping[str, Any], stated: float, settings: Mapping[str, float] | None = None) -> Condition:
    """A start of which values are known, each with a standard uncertainty relative to it."""
    courses = {
        key: Signal(key, key, UNITS[key], np.reshape(one, (-1, 1)), Accuracy(stated=stated * float(np.mean(one))))
        for key, one in of.items()
    }
    return Condition(name, settings or {}, np.zeros(1), courses, duration=DURATION, of_start=True)


def curve(name: str, turns: Any, duration: float, measures: str = "rate:A", unit: str = "rad/s") -> Condition:
    phase = np.arange(np.shape(turns)[1]) / np.shape(turns)[1]
    return Condition(name, {}, phase, {"c": Signal("c", measures, unit, turns)}, duration=duration, of_start=True)


def found(conditions: Sequence[Condition], *names: str, **more: Any) -> Any:
    return identify(wheel(LINEAR), Measurement("starts", tuple(conditions)), list(names), **more)


def codes(result: Any) -> set[str]:
    return {one.code for one in result.trunnion.findings}


def test_values_without_error_come_back() -> None:
    """Inertia, loss and stall torque from starting time, steady speed and peak torque."""
    result = found([values("a", figures(stall=4.4), 1e-3)], J, M, M0)
    np.testing.assert_allclose(result["estimate"], [INERTIA, LOSS, 4.4], rtol=1e-6)


def slope(key: str, by: str, step: float = 1e-4) -> float:
    """Of a figure by `inertia`, `stall` or `loss`, from the closed form."""
    at = {"inertia": INERTIA, "stall": STALL, "loss": LOSS}
    ends = [figures(**{**at, by: at[by] + sign * step})[key] for sign in (1, -1)]
    return (ends[0] - ends[1]) / (2 * step)


@pytest.mark.parametrize(("key", "name", "by"), [("steady_speed:A", M, "loss"), ("starting_time:A", J, "inertia")])
def test_the_stated_uncertainty_is_carried_over(key: str, name: str, by: str) -> None:
    """u(p) = u(y) / |∂y/∂p| of a single value, with infinite freedom since nothing of it is estimated."""
    value, model = figures()[key], wheel(LINEAR).with_values({J: INERTIA, M: LOSS})
    result = identify(model, Measurement("starts", (values("a", {key: value}, 1e-3),)), [name])
    u = float(result["standard_uncertainty"][0])
    assert u == pytest.approx(1e-3 * value / abs(slope(key, by)), rel=1e-4)
    assert float(result["upper"][0] - result["estimate"][0]) == pytest.approx(1.959964 * u, rel=1e-5)
    assert "sensor.no_accuracy" not in codes(result)


@pytest.mark.parametrize("stated", [1e-9, 5e-3])
def test_repetitions_lessen_the_scatter_and_not_what_is_stated(stated: float) -> None:
    time = figures()["starting_time:A"]
    scattered = time * (1 + 0.01 * np.array([-1.0, 0.0, 1.0, 0.5, -0.5]))
    model = wheel(LINEAR).with_values({M: LOSS})
    data = Measurement("starts", (values("a", {"starting_time:A": scattered}, stated),))
    u = float(identify(model, data, [J])["standard_uncertainty"][0])
    mean = np.hypot(np.std(scattered, ddof=1) / 5**0.5, stated * time)
    assert u == pytest.approx(mean / slope("starting_time:A", "inertia"), rel=1e-3)


def test_a_course_over_time_comes_back() -> None:
    """The speed, with the same inertia over stall torque: the stated stall torque tells the two apart."""
    time = np.arange(60) / 60 * 6.0
    result = found([curve("a", speed(time)[None], 6.0)], J, M)
    np.testing.assert_allclose(result["estimate"], [INERTIA, LOSS], rtol=1e-7)
    torque = STALL * (1 - speed(time) / IDLE)
    result = found([curve("a", torque[None], 6.0, "effort:A", "N m")], J, M)
    np.testing.assert_allclose(result["estimate"], [INERTIA, LOSS], rtol=1e-7)


def test_the_speed_does_not_tell_the_inertia_from_the_torques() -> None:
    time = np.arange(40) / 40 * 6.0
    result = found([curve("a", speed(time)[None], 6.0)], J, M, M0)
    assert np.all(np.isnan(result["estimate"]))
    assert "parameter.not_told_apart" in codes(result)


@pytest.mark.slow
def test_values_that_contradict_the_model_are_a_misfit() -> None:
    off = [values(f"{k}", {"starting_time:A": figures()["starting_time:A"] * k}, 1e-3) for k in (0.9, 1.0, 1.1)]
    result = found(off, J)
    assert float(result["reduced_chi_squared"]) > 100
    assert "fit.misfit" in codes(result)
    good = found([values(f"{k}", figures(), 1e-3) for k in range(3)], J, M)
    assert "fit.misfit" not in codes(good)


def test_a_model_that_stalls_says_so() -> None:
    stalled = wheel({**LINEAR, "stall_effort": 0.5})
    data = Measurement("starts", (values("a", figures(), 1e-3),))
    with pytest.raises(MechanismError, match="no start with all that was measured"):
        identify(stalled, data, [J])


@pytest.mark.slow
def test_intervals_of_values_cover() -> None:
    random, true = np.random.default_rng(5), [INERTIA, LOSS]
    settings = [{M0: stall} for stall in (4.0, 5.0)]
    exact = [figures(stall=one[M0]) for one in settings]
    inside = []
    for _ in range(40):
        noisy = [{key: one * (1 + 2e-3 * random.normal()) for key, one in row.items() if key != "peak_effort:A"}
                 for row in exact]  # fmt: skip
        result = found([values(f"{k}", row, 2e-3, settings[k]) for k, row in enumerate(noisy)], J, M)
        inside.append((result["lower"].values <= true) & (true <= result["upper"].values))
    assert 0.86 <= np.mean(inside) <= 1.0


@pytest.mark.slow
@pytest.mark.parametrize("repetitions", [1, 8])
def test_intervals_of_courses_cover(repetitions: int) -> None:
    random, true = np.random.default_rng(6), [INERTIA, LOSS]
    time, inside = np.arange(60) / 60 * 6.0, []
    for _ in range(25):
        turns = speed(time) + random.normal(size=(repetitions, 60))
        result = found([curve("a", turns, 6.0)], J, M)
        inside.append((result["lower"].values <= true) & (true <= result["upper"].values))
    assert 0.84 <= np.mean(inside) <= 1.0


# ---- as they are read -----------------------------------------------------------------------------------------


def mapping(**more: Any) -> dict[str, Any]:
    measured = {"starting_time:A": {"values": ["6.5 s", "6.6 s", "6.55 s"], "uncertainty": "10 ms"},
                "steady_speed:A": {"values": "1176 rpm", "uncertainty": "2 rpm"}}  # fmt: skip
    return {"trunnion-data": 1, "starts": [{"duration": "12 s", "measured": measured, **more}]}


def test_values_are_read_with_their_units() -> None:
    (one,) = read(mapping(set={M0: "4 N m"})).conditions
    assert one.of_start
    assert (one.duration, one.values) == (12.0, {M0: 4.0})
    time, steady = one.courses["starting_time:A"], one.courses["steady_speed:A"]
    assert time.turns.tolist() == [[6.5], [6.6], [6.55]]
    assert (time.accuracy.stated, time.unit) == (0.01, "s")
    assert steady.mean[0] == pytest.approx(1176 * np.pi / 30, rel=1e-12)
    assert steady.accuracy.stated == pytest.approx(2 * np.pi / 30, rel=1e-12)


def test_files_of_starts_are_repetitions(tmp_path: Path) -> None:
    """From where each begins in its file, and put together where the same was set."""
    time = np.arange(0, 7, 2e-3)
    for k, begin in enumerate((0.5, 0.7)):
        rows = np.c_[time, speed(np.maximum(time - begin, 0)) * 30 / np.pi]
        np.savetxt(tmp_path / f"s{k}.csv", rows, delimiter=",", header="t [s],n [rpm]", comments="")
    text = """
trunnion-data: 1
starts:
  - {file: s0.csv, over: [0.5 s, 6.5 s]}
  - {file: s1.csv, over: [0.7 s, 6.7 s]}
time: {column: t}
channels: {n: {column: n, measures: "rate:A"}}
positions: 240
"""
    path = tmp_path / "starts.yaml"
    path.write_text(text, encoding="utf-8")
    measurement = read(path)
    (one,) = measurement.conditions
    assert one.courses["n"].turns.shape == (2, 240)
    assert not measurement.findings
    expected = speed(np.arange(240) / 240 * 6.0)
    np.testing.assert_allclose(one.courses["n"].turns[:, 1:], np.tile(expected[1:], (2, 1)), rtol=1e-4, atol=2e-3)
    result = identify(wheel(LINEAR), measurement, [J, M])
    np.testing.assert_allclose(result["estimate"], [INERTIA, LOSS], rtol=2e-4)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"starts": [{"set": {M0: "4 N m"}}]}, "nothing was measured"),
        ({"starts": [{"file": "a.csv"}]}, "when the start begins in the file"),
        ({"starts": [{"measured": {"steady_speed:A": {"values": "3 s", "uncertainty": "1 s"}}}]}, "do not give"),
        ({"starts": [{"measured": {"starting_time:A": {"values": "3 s"}}}]}, "the uncertainty of the value is unknown"),
        ({"starts": [{"measured": {"starting_time:A": {"values": "3 s", "uncertainty": "0 s"}}}]}, "not above zero"),
        ({"files": [{"file": "a.csv"}]}, "is of cycles"),
        ({"starts": [], "files": [{"file": "a.csv"}]}, "'channels' is missing"),
    ],
)
def test_what_cannot_be_read_is_a_finding(change: Mapping[str, Any], told: str) -> None:
    with pytest.raises(MechanismError, match=told):
        read({**mapping(), **change})


def test_what_is_none_of_a_start_is_a_finding() -> None:
    crank = wheel(LINEAR)
    with pytest.raises(MechanismError, match="no one value of a start"):
        identify(crank, read({"trunnion-data": 1, "starts": [{"measured": {
            "rate:A": {"values": "3 rpm", "uncertainty": "1 rpm"}}}]}), [J])  # fmt: skip
    with pytest.raises(MechanismError, match="no number at each time"):
        found([curve("a", np.ones((1, 10)), 3.0, "load:drag", "N m")], J)
    with pytest.raises(MechanismError, match="no free driver"):
        identify(wheel(free=False), read(mapping()), [J])
    with pytest.raises(MechanismError, match="no cycle to compare"):
        compare(crank, read(mapping()))


def test_a_figure_of_a_start_is_no_channel_of_cycles() -> None:
    turns = Signal("t", "starting_time:A", "s", np.ones((2, 10)))
    data = Measurement("cycles", (Condition("a", {}, np.arange(10) / 10, {"t": turns}),))
    with pytest.raises(MechanismError, match="under starts: in the mapping"):
        identify(wheel(LINEAR), data, [J])
