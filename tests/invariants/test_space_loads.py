"""Loads of spatial models and losses of joints: by virtual work, closed forms, and the same as loads and dampers."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from brief import brief
from mechanisms_parts import example, joined
from mechanisms_space import floating
from timed import LINEAR, slider_crank, wheel
from trunnion import Mechanism, MechanismError, simulate, sweep

STEPS = 12


def massless(**changes):
    """The RCCC of the examples without mass and friction, with other loads."""
    data = example("rccc").with_friction("off").data()
    for key in ("links", "loads", "gravity"):
        del data[key]
    return Mechanism(**{**data, **changes})


def joint(result, quantity, name):
    return result[quantity].sel(joint=name).values


def drive(result):
    return result["drive_power"].values[0]


@pytest.mark.parametrize("frame", ["global", "link"])
@pytest.mark.parametrize("key", ["force", "moment"])
def test_a_load_on_a_link_of_a_loop(frame, key):
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
def test_a_cylindrical_joint_is_resisted_in_either_motion(key, motion):
    result = brief(massless(loads={"load": {"joint": "D", key: 7.0}}), STEPS)
    taken = 7.0 * np.abs(joint(result, f"joint_{motion}_velocity", "D"))
    np.testing.assert_allclose(drive(result), taken, rtol=0, atol=1e-12 * taken.max())


@pytest.mark.parametrize("name", ["B", "D"])
def test_a_spring_and_a_damper_in_a_cylindrical_joint_are_torsional(name):
    result = brief(massless(springs={"spring": {"joint": name, "preload": 2.0, "damping": 3.0}}), STEPS)
    rate = joint(result, "joint_rotation_velocity", name)
    taken = 2.0 * rate + 3.0 * rate**2
    np.testing.assert_allclose(drive(result), taken, rtol=0, atol=1e-12 * np.abs(taken).max())


LOSSES = {"S": {"constant": 20, "viscous": 3}, "Q": {"constant": "20 N mm", "viscous": "1e-3 N m s/rad"}}


def lossy(mechanism, losses):
    data = mechanism.data()
    for joint, one in losses.items():
        data["joints"][joint]["losses"] = one
    return Mechanism(**data)


def loaded(mechanism, losses):
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


@pytest.mark.parametrize(
    ("base", "losses"),
    [
        (slider_crank(0.0), LOSSES),
        (slider_crank(0.1), LOSSES),
        (example("rssr"), {"D": {"constant": 2, "viscous": 0.3}}),
    ],
    ids=["without friction", "with friction", "in space"],
)
def test_they_resist_as_loads_and_dampers_do(base, losses):
    """All forces are equal, the intervals at rest too; their power is lost in the joint and is no load's."""
    one, other = brief(lossy(base, losses), 72), brief(loaded(base, losses), 72)
    same = ("drive_effort", "reaction_force", "drive_effort_lower", "drive_effort_upper", "useful_power", "status")
    for name in same:
        largest = float(np.abs(other[name]).max())
        assert one[name].values == pytest.approx(other[name].values, abs=1e-12 * largest), name
    name = next(iter(losses))
    motion, effort = ("slide", "force") if name == "S" else ("rotation", "torque")
    speed = joint(one, f"joint_{motion}_velocity", name)
    constant, viscous = (losses[name][key] for key in ("constant", "viscous"))
    lost, pull = (joint(one - other, quantity, name) for quantity in ("friction_power", f"friction_{effort}"))
    assert lost == pytest.approx(constant * np.abs(speed) + viscous * speed**2, abs=1e-9)
    assert pull == pytest.approx(-constant * np.sign(speed) * (np.abs(speed) > 1e-9) - viscous * speed, abs=1e-9)
    assert np.abs(one["power_residual"].values).max() < 1e-10 * float(np.abs(one["drive_power"]).max())


def test_a_motion_in_time_has_them():
    """From the tables, which equal the walks; their work is friction's, and energy is kept."""
    one, other = (simulate(make(slider_crank(0.1), LOSSES), 0.1, 10) for make in (lossy, loaded))
    assert one["drive_rate"].values == pytest.approx(other["drive_rate"].values, rel=1e-7)
    for result in (one, other):
        assert np.abs(result["energy_residual"]).max() < 1e-8 * np.abs(result["work_drive"]).max()
    assert float(one["work_friction"][-1]) > float(other["work_friction"][-1]) + 0.5


def test_a_constant_loss_holds_a_wheel_at_rest():
    result = simulate(lossy(wheel({**LINEAR, "stall_effort": 0.5}, drag=0.0), {"A": {"constant": 0.6}}), 1.0, 2)
    (finding,) = result.trunnion.findings
    assert finding.code == "simulate.stays_at_rest"
    assert finding.figures["needed"] == pytest.approx(0.6)


def test_the_compiled_engine_has_them():
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
def test_losses_that_make_no_sense_are_findings(joint, losses, where):
    with pytest.raises(MechanismError) as caught:
        lossy(slider_crank(), {joint: losses})
    assert where in [one.where for one in caught.value.findings]


LEAD = 6e-3 / (2 * np.pi)


def jack(**load):
    """A driven screw of 6 mm pitch and 10 mm mean radius lifts a floating nut."""
    line, across = {"at": [0, 0, 0], "axis": [0, 0, 1]}, {"at": [0, 0, 0], "axis": [0, 1, 0]}
    links, joints = floating("nut")
    thread = {"pitch": "6 mm", "friction": 0, "pin": {"radius": "10 mm", "bearing": "50 mm"}}
    return Mechanism(
        space="spatial",
        gravity=[0, 0, 0],
        links={
            "ground": {"points": {"A": line, "P": line}},
            "screw": {"points": {"A": line, "H": line}},
            "nut": {"points": {"H": line, "U": across}},
            **links,
        },
        joints=joints | joined("ground -A- screw -H:helical- nut", H=thread),
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
def test_a_thread_without_friction(load, torque):
    result = brief(jack(**load), STEPS)
    np.testing.assert_allclose(result["drive_effort"].values[0], torque, rtol=1e-12)
    slide, rotation = (joint(result, f"joint_{motion}_velocity", "H") for motion in ("slide", "rotation"))
    np.testing.assert_allclose(slide, LEAD * rotation, rtol=1e-12)
