"""Losses of joints that do not follow the load: the same as loads and dampers that resist, but counted as friction."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from brief import brief
from timed import LINEAR, slider_crank, wheel
from trunnion import MechanismError, read, simulate, sweep
from trunnion.model.mechanism import Mechanism

EXAMPLES = Path(__file__).parents[2] / "examples"
LOSSES: dict[str, dict[str, Any]] = {
    "S": {"constant": 20, "viscous": 3},
    "Q": {"constant": "20 N mm", "viscous": "1e-3 N m s/rad"},
}


def lossy(mechanism: Mechanism, losses: dict[str, dict[str, Any]]) -> Mechanism:
    data = mechanism.data()
    for joint, one in losses.items():
        data["joints"][joint]["losses"] = one
    return Mechanism(**data)


def loaded(mechanism: Mechanism, losses: dict[str, dict[str, Any]]) -> Mechanism:
    """The same as loads and dampers."""
    data = mechanism.data()
    loads, springs = dict(data.get("loads", {})), dict(data.get("springs", {}))
    for name in mechanism.loads:
        loads[name] = {**loads[name], "useful": True}
    for joint, one in losses.items():
        turns = data["joints"][joint]["type"] == "revolute"
        loads[f"of_{joint}"] = {"joint": joint, f"resisting_{'torque' if turns else 'force'}": one["constant"]}
        springs[f"of_{joint}"] = {"joint": joint, "damping": one["viscous"]}
    return Mechanism(**{**data, "loads": loads, "springs": springs})


@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_they_resist_as_loads_and_dampers_do(friction: float) -> None:
    """All forces are equal, the intervals at rest too; their power is lost in the joint and is no load's."""
    base = slider_crank(friction)
    one, other = brief(lossy(base, LOSSES), 72), brief(loaded(base, LOSSES), 72)
    same = ("drive_effort", "reaction_force", "drive_effort_lower", "drive_effort_upper", "useful_power", "status")
    for name in same:
        largest = float(np.abs(other[name]).max())
        assert one[name].values == pytest.approx(other[name].values, abs=1e-12 * largest), name
    lost = one["friction_power"] - other["friction_power"]
    speed = one["joint_slide_velocity"].sel(joint="S").values
    assert lost.sel(joint="S").values == pytest.approx(20 * np.abs(speed) + 3 * speed**2, abs=1e-9)
    force = one["friction_force"] - other["friction_force"]
    wanted = -20 * np.sign(speed) * (np.abs(speed) > 1e-9) - 3 * speed
    assert force.sel(joint="S").values == pytest.approx(wanted, abs=1e-9)
    assert np.abs(one["power_residual"].values).max() < 1e-10 * float(np.abs(one["drive_power"]).max())


def test_they_resist_in_space() -> None:
    base = read(EXAMPLES / "rssr.yaml")
    joint = next(name for name, one in base.joints.items() if one.type == "revolute" and name not in base.drivers)
    losses = {joint: {"constant": 2, "viscous": 0.3}}
    one, other = brief(lossy(base, losses), 36), brief(loaded(base, losses), 36)
    largest = float(np.abs(other["drive_effort"]).max())
    assert one["drive_effort"].values == pytest.approx(other["drive_effort"].values, abs=1e-12 * largest)
    lost = (one["friction_power"] - other["friction_power"]).sel(joint=joint).values
    speed = one["joint_rotation_velocity"].sel(joint=joint).values
    assert lost == pytest.approx(2 * np.abs(speed) + 0.3 * speed**2, abs=1e-9)
    assert np.abs(one["power_residual"].values).max() < 1e-10 * float(np.abs(one["drive_power"]).max())


def test_a_motion_in_time_has_them() -> None:
    """From the tables, which equal the walks; their work is friction's, and energy is kept."""
    one, other = (simulate(make(slider_crank(0.1), LOSSES), 0.1, 10) for make in (lossy, loaded))
    assert one["drive_rate"].values == pytest.approx(other["drive_rate"].values, rel=1e-7)
    for result in (one, other):
        assert np.abs(result["energy_residual"]).max() < 1e-8 * np.abs(result["work_drive"]).max()
    assert float(one["work_friction"][-1]) > float(other["work_friction"][-1]) + 0.5


def test_a_constant_loss_holds_a_wheel_at_rest() -> None:
    result = simulate(lossy(wheel({**LINEAR, "stall_effort": 0.5}, drag=0.0), {"A": {"constant": 0.6}}), 1.0, 2)
    (finding,) = result.trunnion.findings
    assert finding.code == "simulate.stays_at_rest"
    assert finding.figures["needed"] == pytest.approx(0.6)


def test_they_are_parameters() -> None:
    """They are set and swept by name, and their units are those of the joint's freedom."""
    base = lossy(slider_crank(0.0, loads={}), {"S": {"constant": 20}, "O": {"constant": 1, "viscous": 0.1}})
    assert base.parameter_set.entries["joints.S.losses.constant"].kind.unit == "N"
    assert base.parameter_set.entries["joints.O.losses.viscous"].kind.unit == "N m s/rad"
    assert base.with_values({"O.losses.constant": "2 N m"}).joints["O"].losses.constant.source == "2 N m"
    found = sweep(base, {"O.losses.constant": [0.0, 1.0, 2.0]}, steps=36)
    lost = found["friction_power_mean"].values
    assert np.diff(lost) == pytest.approx(100.0, rel=1e-9)  # 1 N m more at 100 rad/s


def test_the_compiled_engine_has_them() -> None:
    base, over = lossy(slider_crank(0.1), LOSSES), {"S.losses.constant": [0.0, 20.0], "Q.losses.viscous": [0.0, 1e-3]}
    one, other = (sweep(base, over, steps=36, engine=engine) for engine in ("numpy", "compiled"))
    for name in ("drive_effort_max", "friction_power_mean", "reaction_max"):
        assert other[name].values == pytest.approx(one[name].values, rel=1e-9), name


@pytest.mark.parametrize(
    ("joint", "losses", "where"),
    [
        ("O", {}, "joints.O.losses"),
        ("O", {"constant": "2 N"}, "joints.O.losses.constant"),
        ("S", {"viscous": "0.1 N m s/rad"}, "joints.S.losses.viscous"),
        ("O", {"constant": -1}, "joints.O.losses.constant"),
        ("O", {"drag": 1}, "joints.O.losses.drag"),
    ],
)
def test_losses_that_make_no_sense_are_findings(joint: str, losses: dict[str, Any], where: str) -> None:
    with pytest.raises(MechanismError) as caught:
        lossy(slider_crank(), {joint: losses})
    assert where in [one.where for one in caught.value.findings]


def test_a_ball_has_no_axis_to_lose_about() -> None:
    data = read(EXAMPLES / "rssr.yaml").data()
    ball = next(name for name, one in data["joints"].items() if one["type"] == "spherical")
    data["joints"][ball]["losses"] = {"constant": 1}
    with pytest.raises(MechanismError) as caught:
        Mechanism(**data)
    assert caught.value.findings[0].where == f"joints.{ball}.losses"
