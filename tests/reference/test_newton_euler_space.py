"""Spatial mechanisms against the Newton–Euler equations of all links at once, which share nothing with Trunnion.

The oracle has its own motion, in maximal coordinates; from Trunnion it takes only the frames of the links, which tell
its Newton the assembly, and finds friction by its own law. MuJoCo has a motion and forces of its own.
"""

from __future__ import annotations

import functools

import numpy as np
import pytest

import trunnion
from brief import brief
from mechanisms_space import MODELS, cardan, rssr
from reference.maximal_space import Array, Data, Drive, Frame, Motion, carried, unrolled
from reference.mujoco_space import Engine, quaternion
from reference.newton_euler import Solution
from reference.space_oracle import Oracle

STEPS = 9

LOOPS: dict[str, Data] = {
    "Cardan joint of Pezzuti": cardan(),
    "Cardan joint, their sum": cardan(model="pezzuti"),
    "Cardan joint at 45 degrees under gravity": {**cardan(0.08, 45.0, 0.5, 30.0), "gravity": [3.0, -5.0, 8.0]},
    "Cardan joint with clean angles": cardan(error=0.0, offset=0.0),
}
FRICTION = {"RSSR of the theory": 0.15, **dict.fromkeys(LOOPS, 0.42), "two loops in one group": 0.02}  # others 0.05
FRICTION["Cardan joint at 45 degrees under gravity"] = 0.15
NAMES = [*MODELS, "RSSR of the theory", *LOOPS]
FAST = [name for name in NAMES if name != "platform on six legs"]  # nine links, all at once: one test of it is enough


def stated(name: str, friction: bool) -> Data:
    """The model, with friction or without."""
    if name in LOOPS:
        data = {**LOOPS[name], "drivers": {"input": {"speed": 100.0, "start": 0.07}}}  # at 0 a pin is at rest
    else:
        data = dict(rssr().data if name == "RSSR of the theory" else MODELS[name]().data)
    defaults = dict(data.get("joint_defaults", {}))
    law = defaults.pop("friction", {})
    if friction:
        model = {"model": law["model"]} if isinstance(law, dict) and "model" in law else {}
        defaults["friction"] = {"coefficient": FRICTION.get(name, 0.05), **model}
        for joint in data.get("joints", {}).values():
            if joint["type"] in ("planar", "fixed"):
                joint["friction"] = 0.0
    return {**data, "joint_defaults": defaults}


def turned(q: Array) -> Array:
    """Rotation matrix of a unit quaternion."""
    w, v = q[0], q[1:]
    skew = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.asarray(np.eye(3) + 2 * w * skew + 2 * skew @ skew)


class Compared:
    """Trunnion's result of a model, and the oracle's motion at each of its positions."""

    def __init__(self, data: Data, steps: int = STEPS) -> None:
        self.result = brief(trunnion.Mechanism(trunnion=1, **data), steps)
        self.oracle = Oracle(unrolled(data) if "loop" in data else data)
        self.positions = range(self.result.sizes["position"])
        assert set(self.result.status.values) <= {0, 1, 2}

    def array(self, name: str, i: int, **where: str) -> Array:
        return np.asarray(self.result[name].sel(**where).values[..., i], float)

    def frame(self, link: str, i: int) -> Frame:
        place, q = self.array("link_position", i, link=link), self.array("link_rotation", i, link=link)
        assert np.linalg.norm(q) == pytest.approx(1.0, abs=1e-12)
        return Frame(place, turned(q))

    @functools.cache  # noqa: B019 - a dozen objects, all kept below
    def motion(self, i: int) -> dict[str, Motion]:
        """The oracle's own motion at a position."""
        frames = {link: self.frame(link, i) for link in self.oracle.moving}
        return self.oracle.move(frames, self.drive(i))

    def drive(self, i: int) -> dict[str, Drive]:
        return {
            name: Drive(*(float(self.array(f"joint_{self.way(name)}{rate}", i, joint=name)) for rate in RATES))
            for name in self.oracle.drivers
        }

    def way(self, joint: str) -> str:
        return "slide" if self.oracle.joint[joint]["type"] == "prismatic" else "rotation"

    def axis(self, joint: str, motions: dict[str, Motion]) -> Array:
        return self.oracle.elements(motions, joint)[1].frame.axes[:, 2]

    def friction(self, i: int, motions: dict[str, Motion]) -> dict[str, Array]:
        """Friction of the result, force and moment (6) on the second link about the middle of the bearing."""
        found = {}
        for joint in self.oracle.joints:
            force = self.array("friction_force", i, joint=joint) * self.axis(joint, motions)
            found[joint] = np.concatenate([force, self.array("friction_moment", i, joint=joint)])
        return found

    def forces_agree(self, i: int, found: Solution, limit: float) -> float:
        """Reactions and efforts by the largest force and the largest couple, which is given back."""
        scale = max(float(np.linalg.norm(force)) for force in found.force.values())
        couple = max(float(np.linalg.norm(moment)) for moment in found.moment.values())
        couple = max([couple, *(abs(effort) for effort in found.effort.values())])
        for joint in self.oracle.joints:
            force, moment = (self.array(f"reaction_{what}", i, joint=joint) for what in ("force", "moment"))
            np.testing.assert_allclose(force, found.force[joint], rtol=0, atol=limit * scale, err_msg=joint)
            np.testing.assert_allclose(moment, found.moment[joint], rtol=0, atol=limit * couple, err_msg=joint)
        for driver, effort in found.effort.items():
            size = scale if self.way(driver) == "slide" else couple
            given = float(self.array("drive_effort", i, driver=driver))
            assert given == pytest.approx(effort, abs=limit * size), driver
        return couple


@functools.cache
def comparison(name: str, friction: bool) -> Compared:
    """Made once for all tests of it."""
    return Compared(stated(name, friction))


RATES = ("", "_velocity", "_acceleration")


@pytest.mark.spread(1)
@pytest.mark.parametrize("name", FAST)
def test_motion(name: str) -> None:
    """Places to 1e-12, rates to 1e-10: a link's free spin is zero, so its rates are compared too."""
    compared = comparison(name, False)
    for i in compared.positions:
        motions = compared.motion(i)
        for link, motion in motions.items():
            frame = compared.frame(link, i)
            np.testing.assert_allclose(frame.place, motion.frame.place, rtol=0, atol=1e-12)
            np.testing.assert_allclose(frame.axes, motion.frame.axes, rtol=0, atol=1e-12)
            spin, rate = motion.spin, motion.spin_rate
            size = max(1.0, float(np.linalg.norm(spin)))
            given = compared.array("link_angular_velocity", i, link=link)
            np.testing.assert_allclose(given, spin, rtol=0, atol=1e-10 * size)
            given = compared.array("link_angular_acceleration", i, link=link)
            np.testing.assert_allclose(given, rate, rtol=0, atol=1e-10 * max(size**2, float(np.linalg.norm(rate))))
        for label in compared.result.point.values:
            link, _, point = str(label).partition(".")
            if link not in motions:
                continue
            stated = compared.oracle.links[link]["points"][point]
            place = np.asarray(stated["at"] if isinstance(stated, dict) else stated, float)
            moved = carried(motions[link], Frame(place, np.eye(3)))
            for what, own in (("velocity", moved.velocity), ("acceleration", moved.acceleration)):
                size = max(1.0, float(np.linalg.norm(own)))
                given = compared.array(f"point_{what}", i, point=label)
                np.testing.assert_allclose(given, own, rtol=0, atol=1e-10 * size, err_msg=label)
        for joint in compared.oracle.joints:
            slip = compared.oracle.slip(motions, joint)
            if compared.oracle.joint[joint]["type"] in ("revolute", "cylindrical", "helical", "prismatic"):
                turn, slide = (
                    float(compared.array(f"joint_{w}_velocity", i, joint=joint)) for w in ("rotation", "slide")
                )
                assert turn == pytest.approx(slip.turn, abs=1e-10 * max(1.0, abs(slip.turn)))
                assert slide == pytest.approx(slip.slide, abs=1e-10 * max(1.0, abs(slip.turn)))


@pytest.mark.spread(1)
@pytest.mark.parametrize("name", FAST)
def test_forces_without_friction(name: str) -> None:
    compared = comparison(name, False)
    for i in compared.positions:
        found = compared.oracle.balance(compared.motion(i))
        compared.forces_agree(i, found, 1e-10)


@pytest.mark.spread(1, "RSUR")  # the only one with a cross, whose two pins are felt by each other
@pytest.mark.parametrize("name", NAMES)
def test_forces_with_friction_by_its_law(name: str) -> None:
    """The oracle finds friction by its own formulas and its own Newton."""
    compared = comparison(name, True)
    for i in compared.positions:
        motions = compared.motion(i)
        found, friction = compared.oracle.rub(motions)
        compared.forces_agree(i, found, 1e-8)
        scale = max(float(np.linalg.norm(load)) for load in friction.values())
        for joint, given in compared.friction(i, motions).items():
            np.testing.assert_allclose(given, friction[joint], rtol=0, atol=1e-8 * scale, err_msg=joint)


IN_MUJOCO = [
    "RSSR of the theory",
    "Cardan joint of Pezzuti",
    "Cardan joint at 45 degrees under gravity",
    *("RSSP", "RCCC", "RRRSR", "RSUR", "PSUR", "CRSR", "RCSC, two drivers", "RRRRRRR"),
]


@pytest.mark.spread(1)
@pytest.mark.parametrize("name", IN_MUJOCO)
def test_agrees_with_mujoco(name: str) -> None:
    """Motion and forces to 1e-11 of the largest of their kind."""
    compared, data = comparison(name, False), stated(name, False)
    engine = Engine(unrolled(data) if "loop" in data else data)
    for i in compared.positions:
        frames = {link: compared.frame(link, i) for link in engine.oracle.moving}
        motions = engine.move(frames, compared.drive(i))
        pace = max(1.0, *(float(np.max(np.abs(motion.spin))) for motion in motions.values()))
        for link, motion in motions.items():
            centre, _ = engine.oracle.centre(link, motion)
            c = np.asarray(engine.links[link]["centre"], float)
            w, second = (compared.array(f"link_angular_{what}", i, link=link) for what in ("velocity", "acceleration"))
            np.testing.assert_allclose(frames[link].place + frames[link].axes @ c, centre, rtol=0, atol=1e-11)
            np.testing.assert_allclose(w, motion.spin, rtol=0, atol=1e-11 * pace)
            np.testing.assert_allclose(second, motion.spin_rate, rtol=0, atol=1e-10 * pace**2)
            if link not in engine.oracle.free:
                turn = quaternion(frames[link].axes @ motion.frame.axes.T)
                assert abs(abs(turn[0]) - 1) < 1e-12
        forces = engine.forces()
        reactions = {joint: force for joint, (force, _) in forces.reactions.items()}
        moments = {joint: moment for joint, (_, moment) in forces.reactions.items()}
        couple = compared.forces_agree(i, Solution(reactions, moments, forces.efforts, forces.spins), 1e-11)
        assert all(abs(moment) < 1e-11 * couple for moment in forces.spins.values())
