"""Which data a misfit lies in, and what acts like the zero of a sensor: friction, and a unit taken for another."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import trunnion
from rig_measurements import measured, rocker
from trunnion.errors import Finding
from trunnion.rig.comparison.assessment import Verdict
from trunnion.rig.comparison.error_sources import Cause, beyond_stated, causes
from trunnion.rig.reading.arcs import arcs, concentration
from trunnion.rig.reading.measurement import Accuracy, Measurement
from trunnion.rig.reading.units_taken import read_as

SPEEDS = ({"A.speed": 4.0}, {"A.speed": 5.0}, {"A.speed": 6.0})
FRICTION = "joint_defaults.friction.coefficient"
NEWTON_METRES = ("N m", 1.0)


def told(result: Any, code: str) -> list[Finding]:
    return [one for one in result.trunnion.findings if one.code == code]


def spoilt(found: Measurement, which: int, change: Any) -> Measurement:
    """A measurement whose torque is changed in one condition."""
    one = found.conditions[which]
    torque = one.courses["torque"]
    changed = replace(one, courses={**one.courses, "torque": replace(torque, turns=change(torque.turns))})
    return replace(
        found, conditions=tuple(changed if k == which else other for k, other in enumerate(found.conditions))
    )


# ---- friction beside a zero -----------------------------------------------------------------------------------


def test_friction_is_told_from_an_offset_and_its_size_is_found() -> None:
    """A torque of 0.2 where the model has 0.12: mostly an offset, and that is beyond what is stated of the zero."""
    data = measured(rocker(friction=0.2), noise=0.02, accuracy=Accuracy(zero=1e-3))
    result = trunnion.rig.compare(rocker(), data)
    (one,) = (one for one in told(result, "compare.not_within") if one.where == "channels.torque")
    assert one.figures["cause"] == "friction"
    assert one.figures["explains"] > 0.95
    assert "friction 1.6" in one.what or "friction 1.7" in one.what  # 0.2/0.12, to first order
    assert "identify" in one.remedy


def test_an_offset_that_the_sensor_may_have_stays_one() -> None:
    offset = lambda channel, true: true + 1.5 * (channel == "torque")  # noqa: E731
    for accuracy, beyond in ((Accuracy(), False), (Accuracy(zero=1e-3), True)):
        result = trunnion.rig.compare(rocker(), measured(wrong=offset, accuracy=accuracy))
        (one,) = told(result, "compare.offset")
        assert ("1,500 times the stated standard uncertainty of the zero" in one.what) == beyond
        assert ("identify" in one.remedy) == beyond
        assert result.verdict.sel(channel="torque").values == Verdict.OFFSET


def test_a_model_without_friction_has_none_to_fit() -> None:
    data = measured(rocker(friction=0.2), channels=("torque",), noise=0.02, accuracy=Accuracy(zero=1e-3))
    result = trunnion.rig.compare(rocker().with_friction("off"), data)
    kinds = {one.figures.get("cause") for one in told(result, "compare.not_within")}
    assert "friction" not in kinds


def test_friction_fits_by_its_share_of_the_model() -> None:
    phase = np.arange(72) / 72
    without = 5 * np.sin(2 * np.pi * phase)
    model = without + 1 + 0.3 * np.cos(4 * np.pi * phase)
    measured_course = without + 1.5 * (model - without)
    found = causes(measured_course, model, phase, closed=True, without=without)
    one = next(one for one in found if one.kind == "friction")
    assert one.size == pytest.approx(1.5)
    assert one.explains == pytest.approx(1.0)
    assert not [one for one in causes(measured_course, model, phase, closed=True, without=model)
                if one.kind == "friction"]  # fmt: skip
    assert beyond_stated(Cause("zero", -0.3, 1.0), 0.1, 0.0) == pytest.approx(3.0)
    assert np.isnan(beyond_stated(Cause("gain", 0.3, 1.0), 0.1, 0.0))


# ---- a unit taken for another ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("gain", "unit", "size", "other"),
    [
        (0.7376, "N m", 1.0, "lbf ft"), (0.75, "N m", 1.0, "lbf ft"), (1.3558, "lbf ft", 1.3558179, "N m"),
        (8.85, "N m", 1.0, "lbf in"), (0.10197, "N m", 1.0, "kgf m"), (100.0, "N m", 1.0, "N cm"),
        (0.2248, "N", 1.0, "lbf"), (9.5493, "rad/s", 1.0, "rpm"), (1.05, "N m", 1.0, ""), (0.6, "N m", 1.0, ""),
        (3.6, "m/s", 1.0, "km/h"), (1.111, "deg", np.pi / 180, "gon"), (25.4, "in", 0.0254, "mm"), (30.0, "N", 1.0, ""),
        (0.7376, "V", 1.0, ""),
    ],
)  # fmt: skip
def test_a_gain_near_a_ratio_of_units(gain: float, unit: str, size: float, other: str) -> None:
    found = read_as([gain], unit, size)
    assert (f"as of {other} read as {unit}" in found) if other else not found


@pytest.mark.parametrize(
    ("gains", "unit", "told"),
    [
        ([9.81, 9.84], "N m", "near 9.807, as of N m read as kgf m"),
        ([1.37], "N m", "near 1.356, as of N m read as lbf ft"),
        ([9.9, 9.91], "N", "near 9.807, as of N read as kgf"), ([0.01], "N m", "near 0.01, as of N m read as N cm"),
        ([4.5], "N", "near 4.448, as of N read as lbf"), ([0.1047], "rad/s", "near 0.1047, as of rad/s read as rpm"),
        ([1011.0], "N", "near 1000, as of mN read as N"), ([57.3], "rad/s", "near 57.3, as of deg/s read as rad/s"),
    ],
)  # fmt: skip
def test_the_opposite_mistake_is_told_too_whatever_gain_the_sensor_has(
    gains: list[float], unit: str, told: str
) -> None:
    assert told in read_as(gains, unit, 1.0)


def test_a_gain_of_pound_feet_is_told_as_such() -> None:
    data = spoilt(measured(settings=SPEEDS, accuracy=Accuracy(gain=0.001)), 1, lambda turns: turns / 1.3558)
    (one,) = told(trunnion.rig.compare(rocker(), data), "compare.not_within")
    assert one.figures["cause"] == "gain"
    assert "0.7376, as of lbf ft read as N m" in one.what
    assert "run 2" in one.what


# ---- where a misfit is ----------------------------------------------------------------------------------------


def test_the_part_of_the_cycle_with_most_of_a_residual() -> None:
    residual = 0.1 * np.ones(100)
    assert concentration(residual) is None
    residual[10:18] = 3.0
    found = concentration(residual)
    assert found is not None
    assert (found.first, found.last) == (10, 17)
    assert found.share > 0.98
    around = concentration(np.roll(residual, -14))
    assert around is not None
    assert (around.first, around.last) == (96, 3)
    assert concentration(np.full(100, np.nan)) is None
    assert concentration(np.zeros(100)) is None
    residual[40:45] = np.nan
    found = concentration(residual, closed=False)
    assert found is not None
    assert (found.first, found.last) == (10, 17)


def test_ranges_of_an_angle() -> None:
    deg = np.radians
    at = deg(np.concatenate([np.arange(300, 330.0), np.arange(100, 120.0), [200.0]]))
    found = np.degrees(arcs(at + deg(720), 0.0, 2 * np.pi))
    assert found == pytest.approx(np.array([[100, 119], [300, 329]]))
    over = np.degrees(arcs(deg(np.r_[350:360, 0:10]), 0.0, 2 * np.pi))
    assert over == pytest.approx(np.array([[350, 9]]))
    assert arcs(deg(np.arange(360)), 0.0, 2 * np.pi) == [(0.0, 2 * np.pi)]
    assert arcs(np.array([np.nan]), 0.0, 2 * np.pi) == []


def clipped(turns: Any) -> Any:
    limit = np.quantile(turns, 0.88)
    return np.minimum(turns, limit)


def test_identify_names_the_condition_and_the_angle_of_a_misfit() -> None:
    """One of three conditions is clipped: it, and the angles, are named in place of a general advice."""
    data = measured(settings=SPEEDS, positions=72, noise=0.02)
    clean = trunnion.rig.identify(rocker(0.1), data, {"mu": [FRICTION]}, ["torque"])
    assert not told(clean, "fit.stands_out")
    result = trunnion.rig.identify(rocker(0.1), spoilt(data, 1, clipped), {"mu": [FRICTION]}, ["torque"])
    (one,) = told(result, "fit.stands_out")
    assert (one.figures["channel"], one.figures["condition"]) == ("torque", "run 2")
    assert one.figures["rms"] > 3 * one.figures["expected"]
    peak = data.conditions[1].phase[np.argmax(data.conditions[1].courses["torque"].mean)]
    start, end = np.degrees(one.figures["start"]), np.degrees(one.figures["end"])
    assert start < 360 * peak < end
    assert end - start < 120
    (disagree,) = told(result, "fit.conditions_disagree")
    assert "run 2" in disagree.remedy


def test_compare_names_the_angle_of_a_misfit_without_a_cause() -> None:
    data = measured(rocker(friction=0.14), settings=SPEEDS[:1], positions=72, noise=0.002)
    result = trunnion.rig.compare(rocker(), spoilt(data, 0, clipped))
    found = [one for one in told(result, "compare.not_within") if one.where == "channels.torque"]
    peak = float(result.drive.values[0][np.argmax(data.conditions[0].courses["torque"].mean)])
    (one,) = found
    assert one.figures["cause"] == ""
    assert one.figures["start"] < peak < one.figures["end"]
    assert one.figures["share"] > 0.5
