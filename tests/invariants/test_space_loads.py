"""Loads, springs, hints and forms of spatial models mean what the reference says: by virtual work and closed forms."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import trunnion
from brief import brief
from mechanisms_space import floating
from trunnion import Mechanism

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


# ---- loads ----------------------------------------------------------------------------------------------------


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


def test_a_spring_between_joints_of_a_loop() -> None:
    spring = {"between": ["ground.A", "rocker.C"], "stiffness": 40.0, "free_length": 1.0}
    result = brief(massless(springs={"spring": spring}), STEPS)
    ends = [result["point_position"].sel(point=name).transpose("axis", "position").values for name in spring["between"]]  # type: ignore[attr-defined]
    speed = result["point_velocity"].sel(point="rocker.C").transpose("axis", "position").values
    length = np.linalg.norm(ends[1] - ends[0], axis=0)
    taken = 40.0 * (length - 1.0) * np.sum((ends[1] - ends[0]) * speed, axis=0) / length
    np.testing.assert_allclose(drive(result), taken, rtol=0, atol=1e-12 * np.abs(taken).max())


# ---- a screw --------------------------------------------------------------------------------------------------


def jack(friction: float, **load: Any) -> Mechanism:
    """A driven screw of 6 mm pitch and 10 mm mean radius lifts a floating nut that is kept from turning."""
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
            "H": {"type": "helical", "links": ["screw", "nut"], "pitch": "6 mm", "friction": friction,
                  "pin": {"radius": "10 mm", "bearing": "50 mm"}},
        },
        drivers={"A": {"speed": 2.0}},
        loads={"load": load},
    )  # fmt: skip


LEAD = 6e-3 / (2 * np.pi)


@pytest.mark.parametrize(
    ("load", "torque"),
    [
        ({"joint": "P", "resisting_force": 1000.0}, 1000 * LEAD),
        ({"joint": "H", "resisting_force": 1000.0}, 1000 * LEAD),
        ({"joint": "H", "resisting_torque": 3.0}, 3.0),
    ],
)
def test_a_thread_without_friction(load: dict[str, Any], torque: float) -> None:
    result = brief(jack(0.0, **load), STEPS)
    np.testing.assert_allclose(result["drive_effort"].values[0], torque, rtol=1e-12)
    slide, rotation = (joint(result, f"joint_{motion}_velocity", "H") for motion in ("slide", "rotation"))
    np.testing.assert_allclose(slide, LEAD * rotation, rtol=1e-12)


def test_a_thread_with_friction() -> None:
    """M = F r tan(λ + φ), the square thread of the textbooks."""
    result = brief(jack(0.1, joint="P", resisting_force=1000.0), STEPS)
    expected = 1000 * 0.01 * np.tan(np.arctan(LEAD / 0.01) + np.arctan(0.1))
    np.testing.assert_allclose(result["drive_effort"].values[0], expected, rtol=1e-9)


# ---- hints and forms ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("hint", "sign"),
    [
        ({"D": "100 deg"}, 1),
        ({"D": "-100 deg"}, -1),
        ({"coupler": "way-1"}, -1),
        ({"rocker": "way-2"}, 1),
        ({"C": [1, 1, 0]}, 1),
        ({"coupler.C": [-1, -1, 0]}, -1),
    ],
)
def test_hints_choose_the_assembly(hint: dict[str, Any], sign: int) -> None:
    """The two ways to close an RCCC differ by the sign of its angles; a place is that of the nearest."""
    found = brief(massless(assembly=hint, loads={}), STEPS)
    assert np.sign(joint(found, "joint_rotation", "D")[0]) == sign
    if any(isinstance(one, list) for one in hint.values()):
        other = brief(massless(assembly={"D": f"{-sign * 100} deg"}, loads={}), STEPS)
        place = np.array(next(iter(hint.values())))
        apart = [np.linalg.norm(one["point_position"].sel(point="coupler.C").values[:, 0] - place)
                 for one in (found, other)]  # fmt: skip
        assert apart[0] < apart[1]


def test_a_loop_may_begin_anywhere() -> None:
    """Its first row only says where the file begins; the frame of the ground is that of its own row's end."""
    data = massless(loads={"load": {"joint": "D", "resisting_torque": 1.0}}).data()
    other = copy.deepcopy(data)
    other["loop"] = other["loop"][2:] + other["loop"][:2]
    one, two = (brief(Mechanism(**each), STEPS) for each in (data, other))
    for quantity in ("drive_effort", "joint_slide", "joint_rotation"):
        np.testing.assert_allclose(
            two[quantity].sel({one[quantity].dims[0]: one[quantity][one[quantity].dims[0]]}), one[quantity], atol=1e-12
        )


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


def test_points_are_those_of_the_model() -> None:
    mechanism = massless(links={"coupler": {"points": {"tip": [0, 0, 1]}}}, loads={})
    result = brief(mechanism, 3)
    named = {f"{link}.{point}" for link, points in mechanism.points.items() for point in points}
    assert set(result["point"].values) == named


# ---- the plane in space ---------------------------------------------------------------------------------------


def test_a_planar_linkage_in_space_is_the_planar_one() -> None:
    """With the smallest reactions: the forces of the plane, and nothing across it without a load there."""
    data = trunnion.read(EXAMPLES / "fourbar-in-space.yaml").data()
    data |= {"over_constraint": "minimum-norm", "gravity": [0, -9.81, 0]}
    flat = copy.deepcopy(data)
    del flat["over_constraint"]
    flat |= {"space": "planar", "gravity": [0, -9.81]}
    for link in flat["links"].values():
        link["points"] = {name: point["at"][:2] for name, point in link["points"].items()}
        if "centre" in link:
            link |= {"centre": link["centre"][:2], "inertia": link["inertia"]["zz"]}
    space, plane = (brief(Mechanism(**each), STEPS) for each in (data, flat))
    np.testing.assert_allclose(space["drive_effort"], plane["drive_effort"], rtol=0, atol=1e-11)
    np.testing.assert_allclose(space["joint_rotation"], plane["joint_rotation"], rtol=0, atol=1e-11)
    forces = space["reaction_force"]
    np.testing.assert_allclose(forces.sel(axis=["x", "y"]), plane["reaction_force"], rtol=0, atol=1e-9)
    np.testing.assert_allclose(forces.sel(axis="z"), 0, atol=1e-11)
    np.testing.assert_allclose(space["reaction_moment"], 0, atol=1e-11)
