"""The four-bar of Durango, Calle and Ruiz against the figures of the theory sheet, section 7."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import trunnion
from mechanisms import DURANGO, findings
from trunnion import FrictionMethod, Status
from trunnion.solve.run import prepare

RATE = 10.0  # rad/s, of the crank


@pytest.fixture(scope="module")
def results() -> dict[str, Any]:
    mechanism = trunnion.read(DURANGO)
    return {"friction": trunnion.analyse(mechanism), "ideal": trunnion.analyse(mechanism.with_friction("off"))}


def torque(result: Any) -> Any:
    return result["drive_effort"].sel(driver="A").values


def at(result: Any, degrees: int, variable: str, **where: str) -> Any:
    return result[variable].sel(**where).isel(position=degrees).values


@pytest.mark.parametrize(
    ("case", "least", "most"), [("ideal", -18747.140121, 9177.173578), ("friction", -18552.874991, 9288.302313)]
)
def test_extremes_of_the_torque(results: dict[str, Any], case: str, least: float, most: float) -> None:
    found = torque(results[case])
    assert found.min() == pytest.approx(least, abs=1e-6)
    assert found.max() == pytest.approx(most, abs=1e-6)


def test_places_of_the_extremes_without_friction(results: dict[str, Any]) -> None:
    assert np.argmin(torque(results["ideal"])) == 350
    assert np.argmax(torque(results["ideal"])) == 24


def test_friction_power(results: dict[str, Any]) -> None:
    lost = results["friction"]["friction_power"].sum("joint").values
    assert lost.mean() == pytest.approx(517.465106, abs=1e-6)
    assert lost.max() == pytest.approx(2375.340, abs=5e-4)
    assert np.argmax(lost) == 358


def test_values_at_sixty_degrees(results: dict[str, Any]) -> None:
    assert torque(results["ideal"])[60] == pytest.approx(3364.879649, abs=1e-6)
    assert torque(results["friction"])[60] == pytest.approx(3393.503681, abs=1e-6)
    lost = results["friction"]["friction_power"].sum("joint").values
    assert lost[60] == pytest.approx(286.240327, abs=1e-6)


@pytest.mark.parametrize(
    ("joint", "sign", "expected"),
    [
        ("A", 1, (-3388.683339, -2499.828824)),
        ("B", 1, (-3148.683339, -2084.136630)),
        ("C", 1, (229.965844, 905.533667)),
        ("D", 1, (-639.235315, -1207.667824)),
    ],
)
def test_reactions_at_sixty_degrees(
    results: dict[str, Any], joint: str, sign: int, expected: tuple[float, float]
) -> None:
    """Each on the second link of the joint by the first: crank, coupler, rocker, rocker."""
    found = sign * at(results["friction"], 60, "reaction_force", joint=joint)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6)


def test_friction_costs_exactly_its_power(results: dict[str, Any]) -> None:
    """T with friction − T without = P_friction/ω₁ at every position."""
    lost = results["friction"]["friction_power"].sum("joint").values
    difference = torque(results["friction"]) - torque(results["ideal"])
    np.testing.assert_allclose(difference, lost / RATE, rtol=0, atol=1e-12 * np.abs(torque(results["ideal"])).max())


@pytest.mark.parametrize("case", ["ideal", "friction"])
def test_power_residual(results: dict[str, Any], case: str) -> None:
    result = results[case]
    assert np.abs(result["power_residual"]).max() < 1e-12 * np.abs(result["drive_power"]).max()


def test_zero_slip_is_an_interval(results: dict[str, Any]) -> None:
    """At 0° and 180° the relative speed at C is exactly zero; the torque is bracketed by either sign of friction."""
    result = results["friction"]
    status = result["status"].values
    np.testing.assert_array_equal(np.flatnonzero(status == Status.ZERO_SLIP), [0, 180])
    assert np.all(status[np.setdiff1d(np.arange(360), [0, 180])] == Status.SOLVED)
    lower, upper, effort = (result[f"drive_effort{end}"].values[0] for end in ("_lower", "_upper", ""))
    here = status == Status.ZERO_SLIP
    assert np.all(lower[here] < effort[here])
    assert np.all(effort[here] < upper[here])
    np.testing.assert_array_equal(lower[~here], effort[~here])
    np.testing.assert_array_equal(upper[~here], effort[~here])
    # here the interval is 2e-5 of the peak: it is a result, and nothing to tell of
    assert not any(row["code"] == "friction.interval" for row in findings(result))


def test_a_wide_interval_is_a_finding() -> None:
    """With a pin a hundred times as thick at C the two ends differ by more than a thousandth of the peak."""
    model = trunnion.read(DURANGO).with_values({"C.pin.radius": "750 mm"})
    result = trunnion.analyse(model, 36)
    assert [row["where"] for row in findings(result) if row["code"] == "friction.interval"] == ["joints.C"]


@pytest.mark.parametrize("position", [0.0, np.pi])
def test_interval_holds_the_limits_from_both_sides(results: dict[str, Any], position: float) -> None:
    """On either side friction at C is fully on; both torques, extrapolated to the place itself, are the ends."""
    run = prepare(trunnion.read(DURANGO))
    result, index = results["friction"], round(np.degrees(position))
    step = 1e-5  # rad: what curves over it is below 1e-10 T″ ≈ 1e-4 N m
    angles = (position + step * np.array([-2.0, -1.0, 1.0, 2.0])) % (2 * np.pi)
    near = run.solve(angles / RATE).efforts["A"]
    ends = sorted([2 * near[1] - near[0], 2 * near[2] - near[3]])
    assert ends[0] == pytest.approx(float(result["drive_effort_lower"][0, index]), abs=2e-4)
    assert ends[1] == pytest.approx(float(result["drive_effort_upper"][0, index]), abs=2e-4)
    assert ends[1] - ends[0] > 2e-3


@pytest.mark.parametrize("crank", [14.361511563, 212.157208609])
def test_dead_centres_of_the_rocker(crank: float) -> None:
    """Crank and coupler in line: the rocker's speed changes its sign there, within the last digit given."""
    run = prepare(trunnion.read(DURANGO))
    angles = np.radians(np.array([crank - 2e-9, crank + 2e-9]))
    speeds = run.solve(angles / RATE).walk.motions["rocker"].twist.w
    assert speeds[0] * speeds[1] < 0


def test_successive_approximation_agrees_with_newton() -> None:
    mechanism = trunnion.read(DURANGO)
    newton = trunnion.analyse(mechanism)
    named = trunnion.analyse(mechanism, friction_method=FrictionMethod("successive-approximation", 1e-10))
    for name in ("reaction_force", "drive_effort", "friction_torque"):
        scale = np.abs(newton[name]).max()
        np.testing.assert_allclose(named[name], newton[name], rtol=0, atol=1e-9 * float(scale), err_msg=name)
    assert int(named["friction_iterations"].max()) > int(newton["friction_iterations"].max())


@pytest.mark.parametrize(("limit", "share"), [(3, 1e-3), (1, 5e-2)])
def test_three_iterations_suffice(limit: int, share: float) -> None:
    """The paper's statement: after three iterations within 0.1 % at ten equally spaced positions."""
    run = prepare(trunnion.read(DURANGO))
    time = run.cycle.times(10)
    few = run.solve(time, method=FrictionMethod("successive-approximation", None, limit))
    exact = run.solve(time)
    assert all(np.max(settled.iterations) <= limit for settled in few.settled)
    for joint, reaction in exact.reactions.items():
        size = np.hypot(reaction.x, reaction.y)
        error = np.hypot(few.reactions[joint].x - reaction.x, few.reactions[joint].y - reaction.y)
        assert np.all(error < share * size), joint
    assert np.max(few.settled[0].iterations) == limit


def test_iteration_figures(results: dict[str, Any]) -> None:
    result = results["friction"]
    assert np.all(result["friction_iterations"] >= 1)
    assert np.all(result["friction_contraction"] < 0.2)
    assert np.all(result["friction_contraction"] > 0)
    assert np.all(result["friction_change"] < 1e-6 * np.abs(result["reaction_force"]).max())


def test_structure(results: dict[str, Any]) -> None:
    assert results["friction"].attrs["formula"] == "I(0,1)R → II(2,3)RRR"
    assert results["friction"].attrs["mobility"] == 1


def test_loads_do_no_net_work(results: dict[str, Any]) -> None:
    """Constant force and moment over a closed cycle give back what they take: useful work and efficiency are 0."""
    assert float(results["friction"]["efficiency"]) == 0.0
