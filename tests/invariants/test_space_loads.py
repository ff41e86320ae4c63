"""Loads of spatial models and losses of joints: by virtual work, closed forms, and the same as loads and dampers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import trunnion
from brief import brief
from mechanisms_space import floating
from timed import LINEAR, slider_crank, wheel
from trunnion import Mechanism, MechanismError, read, simulate, sweep

EXAMPLES = Path(__file__).parents[2] / "examples"
STEPS = 12


def massless(**changes: Any) -> Mechanism:
    """The RCCC of the examples without mass and friction, with other loads."""
    data = trunnion.read(EXAMPLES / "rccc.yaml").with_friction("off").data()
    for key in ("links", "loads", "gravity"):
        del data[key]
    return Mechanism(**{**data, **changes})


def joint(result: Any, quantity: str, name: str) -> Any:
    return result[quantity].sel(joint=name).values


def drive(result: Any) -> Any:
    return result["drive_power"].values[0]


@pytest.mark.parametrize("frame", ["global", "link"])
@pytest.mark.parametrize("key", ["force", "moment"])
def test_a_load_on_a_link_of_a_loop(frame: str, key: str) -> None:
    """The drive takes what the load gives: F·v of the joint that it acts at, M·ω of its link."""
    vector = np.array([10.0, -20.0, 30.0])
    load = {"link": "rocker", "frame": frame, key: vector.tolist()} | ({"at": "C"} if key == "force" else {})
    result = brief(massless(loads={"load": load}), STEPS)
    quaternion = result["link_rotation"].sel(link="rocker").transpose("position", "component").values
    turn = Rotation.from_quat(quaternion[:, [1, 2, 3, 0]])
    acting = turn.apply(vector) if frame == "link" else np.tile(vector, (STEPS, 1))
    moved = (
        result["point_velocity"].sel(point="rocker.C")
        if key == "force"
        else result["link_angular_velocity"].sel(link="rocker")
    ).transpose("position", "axis")
    given = np.sum(acting * moved.values, axis=1)
    np.testing.assert_allclose(drive(result), -given, rtol=0, atol=1e-12 * np.abs(given).max())
    assert np.ptp(given) > 1


@pytest.mark.parametrize(("key", "motion"), [("resisting_torque", "rotation"), ("resisting_force", "slide")])
def test_a_cylindrical_joint_is_resisted_in_either_motion(key: str, motion: str) -> None:
    result = brief(massless(loads={"load": {"joint": "D", key: 7.0}}), STEPS)
    taken = 7.0 * np.abs(joint(result, f"joint_{motion}_velocity", "D"))
    np.testing.assert_allclose(drive(result), taken, rtol=0, atol=1e-12 * taken.max())


@pytest.mark.parametrize("name", ["B", "D"])
def test_a_spring_and_a_damper_in_a_cylindrical_joint_are_torsional(name: str) -> None:
    spring = {"joint": name, "preload": 2.0, "damping": 3.0}
    result = brief(massless(springs={"spring": spring}), STEPS)
    rate = joint(result, "joint_rotation_velocity", name)
    taken = 2.0 * rate + 3.0 * rate**2
    np.testing.assert_allclose(drive(result), taken, rtol=0, atol=1e-12 * np.abs(taken).max())


def test_a_loop_is_the_same_as_its_links() -> None:
    """The table of an RCCC written out as links with points: the element of a joint behind X(twist + ε distance)."""
    loop = massless(loads={"load": {"joint": "D", "resisting_torque": 1.0}})
    values = loop.parameters()
    links: dict[str, Any] = {row.link: {"points": {}} for row in loop.loop}
    for k, row in enumerate(loop.loop):
        twist, distance = (values[f"loop.{row.joint}.{key}"] for key in ("twist", "distance"))
        slide = values.get(f"loop.{row.joint}.slide", 0.0)
        following = loop.loop[(k + 1) % 4].joint
        links[row.link]["points"][row.joint] = {"at": [0, 0, -slide], "axis": [0, 0, 1], "x": [1, 0, 0]}
        axis = [0.0, -np.sin(twist), np.cos(twist)]
        links[row.link]["points"][following] = {"at": [distance, 0, 0], "axis": axis, "x": [1, 0, 0]}
    joints = {name: {"type": one.type, "links": list(one.links)} for name, one in loop.effective_joints.items()}
    data = {key: value for key, value in loop.data().items() if key != "loop"}
    written = Mechanism(**data, links=links, joints=joints)
    one, two = brief(loop, STEPS), brief(written, STEPS)
    for quantity in ("drive_effort", "joint_rotation", "joint_slide_velocity", "reaction_force"):
        expected = one[quantity]
        if quantity == "reaction_force":  # the frame of the ground is another
            expected, found = (np.linalg.norm(each[quantity].values, axis=1) for each in (one, two))
            np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-12)
        else:
            np.testing.assert_allclose(two[quantity].values, expected.values, atol=1e-11)


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


def test_the_compiled_engine_has_them() -> None:
    base, over = lossy(slider_crank(0.1), LOSSES), {"S.losses.constant": [0.0, 20.0], "Q.losses.viscous": [0.0, 1e-3]}
    one, other = (sweep(base, over, steps=36, engine=engine) for engine in ("numpy", "compiled"))
    for name in ("drive_effort_max", "friction_power_mean", "reaction_max"):
        assert other[name].values == pytest.approx(one[name].values, rel=1e-9), name


@pytest.mark.parametrize(
    ("joint", "losses", "where"),
    [
        ("O", {}, "joints.O"),
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


LEAD = 6e-3 / (2 * np.pi)


def jack(**load: Any) -> Mechanism:
    """A driven screw of 6 mm pitch and 10 mm mean radius lifts a floating nut."""
    line, across = {"at": [0, 0, 0], "axis": [0, 0, 1]}, {"at": [0, 0, 0], "axis": [0, 1, 0]}
    links, joints = floating("nut")
    return Mechanism(
        space="spatial",
        gravity=[0, 0, 0],
        links={
            "ground": {"points": {"A": line, "P": line}},
            "screw": {"points": {"A": line, "H": line}},
            "nut": {"points": {"H": line, "U": across}},
            **links,
        },
        joints={
            **joints,
            "A": {"type": "revolute", "links": ["ground", "screw"]},
            "H": {"type": "helical", "links": ["screw", "nut"], "pitch": "6 mm", "friction": 0,
                  "pin": {"radius": "10 mm", "bearing": "50 mm"}},
        },
        drivers={"A": {"speed": 2.0}},
        loads={"load": load},
    )  # fmt: skip


@pytest.mark.parametrize(
    ("load", "torque"),
    [
        ({"joint": "P", "resisting_force": 1000.0}, 1000 * LEAD),
        ({"joint": "H", "resisting_force": 1000.0}, 1000 * LEAD),
        ({"joint": "H", "resisting_torque": 3.0}, 3.0),
    ],
)
def test_a_thread_without_friction(load: dict[str, Any], torque: float) -> None:
    result = brief(jack(**load), STEPS)
    np.testing.assert_allclose(result["drive_effort"].values[0], torque, rtol=1e-12)
    slide, rotation = (joint(result, f"joint_{motion}_velocity", "H") for motion in ("slide", "rotation"))
    np.testing.assert_allclose(slide, LEAD * rotation, rtol=1e-12)
