"""Measures of a motion in time in tolerances and sweeps: against closed forms of a flywheel with a motor."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import trunnion
from timed import LINEAR, slider_crank, two_wheels, wheel
from trunnion.dynamics.measured import figures_in_time
from trunnion.errors import MechanismError
from trunnion.model.mechanism import Mechanism
from trunnion.solve.run import prepare

DURATION = 12.0
MEASURE = {"starting_time": "A", "duration": DURATION}


def stated(mechanism: Mechanism, **more: Any) -> Mechanism:
    return Mechanism(**{**mechanism.data(), **more})


def starting_time(inertia: float) -> float:
    """Of J ω̇ = 4 (1 − ω/150) − 0.6, where the mean of a turn is 95 % of that of the last in DURATION."""
    tau, turn = inertia * 150 / 4, 2 * np.pi

    def gone(time: float) -> float:
        return 127.5 * float(time - tau * (1 - np.exp(-time / tau)))

    def takes(time: float) -> float:
        return time - float(brentq(lambda t: gone(t) - gone(time) + turn, 0.0, time, xtol=1e-14))

    limit = takes(DURATION) / 0.95
    return float(brentq(lambda t: takes(t) - limit, 2.0 * tau, DURATION, xtol=1e-13))


def test_first_order_of_the_starting_time() -> None:
    """The sensitivity to the inertia, by differences of the closed form; samples scatter about it."""
    mechanism = stated(wheel(LINEAR), tolerances={"links.wheel.inertia": 0.001}, measures={"start": MEASURE})
    found = trunnion.tolerance(mechanism, methods=("linear", "monte-carlo"), samples=100, jobs=1)
    slope = (starting_time(0.0505) - starting_time(0.0495)) / 0.001
    figure, sensitivity = float(found["nominal"].item()), float(np.ravel(found["sensitivity"])[0])
    assert figure == pytest.approx(starting_time(0.05), rel=1e-7)
    assert sensitivity == pytest.approx(slope, rel=1e-4)
    deviation = float(np.ravel(found["deviation"])[0])
    assert deviation == pytest.approx(float(np.ravel(found["rss"])[0]) / 3, rel=0.3)
    assert float(found["yield_all"]) == 1.0


def test_samples_that_do_not_start_are_outside_every_limit() -> None:
    """Torques about the drag: half of them do not start."""
    motor = {**LINEAR, "stall_effort": 0.6}
    mechanism = stated(
        wheel(motor),
        tolerances={"drivers.A.motor.stall_effort": {"limits": "±0.3 N m", "distribution": "uniform"}},
        measures={"peak": {"peak_effort": "A", "duration": 1.0, "at_most": 5}, "start": {**MEASURE, "at_most": 100}},
    )
    found = trunnion.tolerance(mechanism, methods=("monte-carlo",), samples=60, jobs=1)
    shares = found["yield"].values
    assert shares[0] == 1.0
    assert shares[1] < 0.7


@pytest.mark.slow
def test_samples_are_the_same_in_any_number_of_processes() -> None:
    mechanism = stated(
        wheel(LINEAR),
        tolerances={"links.wheel.inertia": 0.001},
        measures={"peak": {"peak_effort": "A", "duration": 0.1}},
    )
    one, two = (trunnion.tolerance(mechanism, methods=("monte-carlo",), samples=40, jobs=jobs) for jobs in (1, 2))
    for name in ("mean", "deviation", "histogram"):
        np.testing.assert_array_equal(one[name], two[name])


def test_a_sweep_has_the_figures_of_each_point() -> None:
    mechanism = wheel(LINEAR)
    inertias = [0.03, 0.05, 0.08]
    swept = trunnion.sweep(
        mechanism, {"links.wheel.inertia": inertias}, 24, measures=["starting_time:A", "peak_effort:A"]
    )
    # ten cycles at 100 rad/s: too short for it to run steadily, so that there is none
    assert np.all(np.isnan(swept["starting_time:A"]))
    (said,) = [one for one in swept.trunnion.findings if one.code == "sweep.not_steady"]
    assert said.where == "measures.starting_time:A"
    assert "no value at 3 of 3 points" in said.what
    assert "within 628.3 ms A does not come to run steadily" in said.what
    np.testing.assert_allclose(swept["peak_effort:A"], 4.0, rtol=1e-8)
    longer = stated(mechanism, measures={"start": MEASURE})
    found = trunnion.sweep(longer, {"links.wheel.inertia": inertias}, 24, measures=["start"])["start"].values
    np.testing.assert_allclose(found, [starting_time(one) for one in inertias], rtol=1e-7)
    assert swept["peak_effort:A"].attrs["units"] == "N m"


def test_the_summary_of_a_simulation_has_the_same_figures() -> None:
    mechanism = wheel(LINEAR)
    result = trunnion.simulate(mechanism, DURATION, 100)
    figures = {one.name: one.value for one in result.trunnion.summary}
    run = prepare(mechanism)
    own = figures_in_time(run, "A", run.values, 1, DURATION)
    for key, name in (
        ("starting_time", "starting_time"),
        ("speed_mean", "steady_speed"),
        ("fluctuation", "fluctuation"),
    ):
        assert figures[f"A.{key}"] == pytest.approx(own[name][0], rel=1e-7, abs=1e-9)


def test_a_start_beside_another_free_driver_is_that_of_the_wheel_alone() -> None:
    """Joints that stick one by one are followed by other means."""
    measures = {"start": MEASURE}
    alone, beside = stated(wheel(LINEAR), measures=measures), stated(two_wheels(LINEAR), measures=measures)
    motors = {"drivers.A.motor.stall_effort": [4.0, 5.0]}
    wanted, found = (trunnion.sweep(one, motors, 24, measures=["start"])["start"].values for one in (alone, beside))
    assert np.all(np.isfinite(wanted))
    np.testing.assert_allclose(found, wanted, rtol=1e-7)


# ---- what is refused or left out ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("measure", "where"),
    [
        ({"starting_time": "O", "duration": 0.0}, "duration"),
        ({"starting_time": "O", "duration": -1.0}, "duration"),
        ({"starting_time": "O", "over": [0.0, 1.0]}, "over"),
        ({"starting_time": "O", "at": 1.0}, "at"),
        ({"starting_time": "O", "as": "maximum"}, "as"),
        ({"starting_time": "P"}, "starting_time"),
        ({"effort": "O", "duration": 1.0}, "duration"),
    ],
)
def test_findings(measure: dict[str, Any], where: str) -> None:
    with pytest.raises(MechanismError) as caught:
        slider_crank(measures={"one": measure})
    assert any(one.where == f"measures.one.{where}" for one in caught.value.findings)


def test_a_driver_without_a_motor_has_no_motion_in_time() -> None:
    data = {**slider_crank().data(), "drivers": {"O": {"speed": 100}}}
    with pytest.raises(MechanismError) as caught:
        Mechanism(**{**data, "measures": {"one": {"starting_time": "O"}}})
    assert any(one.where == "measures.one.starting_time" for one in caught.value.findings)


def test_a_prescribed_cycle_leaves_them_out() -> None:
    mechanism = slider_crank(measures={"one": {"starting_time": "O"}})
    found = trunnion.analyse(mechanism, 24)
    assert any(one.where == "measures.one" for one in found.trunnion.findings)
    with pytest.raises(MechanismError):
        trunnion.play(stated(mechanism, joint_defaults={"pin": {"radius": 0.01, "clearance": 1e-5}}), ["one"])


@pytest.mark.slow
def test_tolerances_are_allocated_to_a_limit_of_the_starting_time() -> None:
    """Two tolerances of equal cost per share of what they do to the start: B₁/t₁ + B₂/t₂ with s₁ t₁ + s₂ t₂ = limit.

    Lagrange: t_i = limit √(B_i/s_i)/Σ √(B_j s_j), with the derivatives of the closed form.
    """
    start = starting_time(0.05)
    mechanism = stated(
        wheel(LINEAR),
        tolerances={"links.wheel.inertia": 0.001, "loads.drag.resisting_torque": 0.05},
        measures={"start": {**MEASURE, "limit": 0.1}},
        costs={name: {"model": "power", "B": cost, "k": 1, "unit": unit}
               for name, cost, unit in (("links.wheel.inertia", 1e-3, "kg m^2"),
                                        ("loads.drag.resisting_torque", 0.05, "N m"))},
    )  # fmt: skip
    found = trunnion.allocate(mechanism, samples=100, jobs=1)
    widths = dict(zip(found["parameter"].values, found["parameter_upper"].values, strict=True))
    slope = (starting_time(0.0505) - starting_time(0.0495)) / 0.001
    assert float(found["nominal"].item()) == pytest.approx(start, rel=1e-7)
    drag = np.abs(np.ravel(found["sensitivity"])[list(found["parameter"].values).index("loads.drag.resisting_torque")])
    costs, slopes = np.array([1e-3, 0.05]), np.array([abs(slope), drag])
    wanted = 0.1 * np.sqrt(costs / slopes) / np.sum(np.sqrt(costs * slopes))
    assert [widths["links.wheel.inertia"], widths["loads.drag.resisting_torque"]] == pytest.approx(wanted, rel=1e-3)
