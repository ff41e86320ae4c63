"""Spatial mechanisms against the Newton–Euler equations of all links at once, which share nothing with Trunnion.

The oracle has its own motion, in maximal coordinates; from Trunnion it takes only the frames of the links, which tell
its Newton the assembly. Friction is given from the result in one test, and found by the oracle's own law in another.
Velocities and accelerations of the result are differences of its own poses too.
"""

from __future__ import annotations

import functools

import numpy as np
import pytest
import xarray as xr

import trunnion
from brief import brief
from mechanisms_space import MODELS, cardan, rssr
from reference.maximal_space import Array, Data, Drive, Frame, Motion, rotation, unrolled
from reference.mujoco_space import Engine, quaternion
from reference.newton_euler_space import Body, Joint, Load, Solution, solve
from reference.space_oracle import Oracle

STEPS = 9
FIRST = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
SECOND = np.array([-1 / 560, 8 / 315, -1 / 5, 8 / 5, -205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560])

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
        drive = {
            name: Drive(*(float(self.array(f"joint_{self.way(name)}{rate}", i, joint=name)) for rate in RATES))
            for name in self.oracle.drivers
        }
        return self.oracle.move({link: self.frame(link, i) for link in self.oracle.moving}, drive)

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

    def forces_agree(self, i: int, found: Solution, limit: float) -> None:
        """Reactions and efforts, by the largest force and the size of the mechanism."""
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


@functools.cache
def comparison(name: str, friction: bool) -> Compared:
    """Made once for all tests of it."""
    return Compared(stated(name, friction))


RATES = ("", "_velocity", "_acceleration")
POINT = ("position", "velocity", "acceleration")


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


@pytest.mark.spread(2)
@pytest.mark.parametrize("name", FAST)
def test_rates_are_differences_of_poses(name: str) -> None:
    """Eighth-order central differences of the result's own points, and of the matrices of the links.

    The angle of a free spin is anything, so the matrix of such a link is not compared, but its points on the line are.
    """
    compared = Compared(stated(name, False), 241)
    h = float(compared.result.time[1] - compared.result.time[0])
    for i in (40, 131, 220):
        around = slice(i - 4, i + 5)
        places, velocity, acceleration = (compared.result[f"point_{what}"].values for what in POINT)
        pace = max(1.0, float(np.max(np.abs(compared.result.link_angular_velocity.values[..., i]))))
        np.testing.assert_allclose(places[..., around] @ FIRST / h, velocity[..., i], rtol=0, atol=1e-9 * pace)
        np.testing.assert_allclose(
            places[..., around] @ SECOND / h**2, acceleration[..., i], rtol=0, atol=3e-8 * pace**2
        )
        for link in set(compared.oracle.moving) - set(compared.oracle.free):
            axes = np.array([compared.frame(link, n).axes for n in range(i - 4, i + 5)])
            spin, rate = (
                skew_part(np.tensordot(weights, axes, axes=1) @ axes[4].T)  # of R̈ Rᵀ = [α]× + [ω]×² too
                for weights in (FIRST / h, SECOND / h**2)
            )
            given = compared.array("link_angular_velocity", i, link=link)
            np.testing.assert_allclose(given, spin, rtol=0, atol=1e-9 * pace, err_msg=link)
            given = compared.array("link_angular_acceleration", i, link=link)
            np.testing.assert_allclose(given, rate, rtol=0, atol=3e-8 * pace**2, err_msg=link)


def skew_part(matrix: Array) -> Array:
    """w of the antisymmetric part [w]×."""
    half = (matrix - matrix.T) / 2
    return np.array([half[2, 1], half[0, 2], half[1, 0]])


def test_skew_rotor() -> None:
    """A disc fixed askew on a shaft that turns at Ω: the couple ½ (C − A) Ω² sin 2φ across the shaft."""
    phi, spin, a, c = 0.3, 20.0, 0.02, 0.035
    tilt = rotation([0, 1, 0], phi)
    inertia = tilt @ np.diag([a, a, c]) @ tilt.T
    disc = Body(2.0, inertia, np.zeros(3), np.zeros(3), [0, 0, spin], np.zeros(3))
    found = solve({"disc": disc}, {"shaft": Joint("revolute", None, "disc", np.zeros(3), driven=True)})
    expected = [0, 0.5 * (c - a) * spin**2 * np.sin(2 * phi) * -1, 0]
    np.testing.assert_allclose(np.abs(found.moment["shaft"]), np.abs(expected), rtol=1e-13, atol=1e-13)
    axis = tilt[:, 2]
    exact = np.cross([0, 0, spin], a * np.array([0, 0, spin]) + (c - a) * (axis @ [0, 0, spin]) * axis)
    np.testing.assert_allclose(found.moment["shaft"], exact, rtol=1e-13, atol=1e-13)
    assert abs(found.effort["shaft"]) < 1e-13


def test_top_in_steady_precession() -> None:
    """A heavy top on its tip, at 90°: m g l = C n Ω (slow precession), so the tip needs no moment."""
    c, a, n, m, length, g = 0.02, 0.05, 80.0, 1.2, 0.3, 9.81
    big = m * g * length / (c * n)
    about, spin, arm = np.array([0, 0, big]), np.array([n, 0, 0]), np.array([length, 0, 0])
    centre = np.cross(about, np.cross(about, arm))
    top = Body(m, np.diag([c, a, a]), arm, centre, about + spin, np.cross(about, spin))
    found = solve({"top": top}, {"tip": Joint("fixed", None, "top", np.zeros(3))}, [0, 0, -g])
    np.testing.assert_allclose(found.moment["tip"], 0, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.force["tip"], [-m * big**2 * length, 0, m * g], rtol=1e-13)


def test_screw_press() -> None:
    """A screw pushed by W along its axis: the torque W p/2π of the driven thread, and no reaction turns it."""
    push, pitch = 500.0, 0.01
    screw = Body(0.0, np.zeros((3, 3)), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), [Load(force=[0, 0, -push])])
    joint = Joint("helical", None, "screw", np.zeros(3), pitch=pitch, driven=True)
    found = solve({"screw": screw}, {"thread": joint})
    assert found.effort["thread"] == pytest.approx(push * pitch / (2 * np.pi), rel=1e-14)
    np.testing.assert_allclose(found.force["thread"], [0, 0, push], rtol=1e-14)


FEW = 8
SHAFTS: dict[str, Data] = {
    "Cardan joint of Pezzuti": cardan(),
    "Cardan joint at 45 degrees under gravity": {**cardan(0.08, 45.0, 0.5, 30.0), "gravity": [3.0, -5.0, 8.0]},
}
IN_MUJOCO = [
    "RSSR of the theory",
    *SHAFTS,
    *("RSSP", "RCCC", "RRRSR", "RSUR", "PSUR", "CRSR", "RCSC, two drivers", "RRRRRRR"),
]


def without_friction(name: str) -> Data:
    """The model without friction; the Cardan joints start off the position where a pin is at rest."""
    if name in SHAFTS:
        data = {**SHAFTS[name], "drivers": {"input": {"speed": 100.0, "start": 0.07}}}
    else:
        data = dict(rssr().data if name == "RSSR of the theory" else MODELS[name]().data)
    defaults = {key: part for key, part in data.get("joint_defaults", {}).items() if key != "friction"}
    return {**data, "joint_defaults": defaults}


@pytest.mark.spread(1)
@pytest.mark.parametrize("name", IN_MUJOCO)
def test_agrees_with_mujoco(name: str) -> None:
    """Motion and forces to 1e-11 of the largest of their kind."""
    data = without_friction(name)
    result = brief(trunnion.Mechanism(trunnion=1, **data), FEW)
    engine = Engine(unrolled(data) if "loop" in data else data)
    for i in range(FEW):
        here = result.isel(position=i)
        frames = {}
        for link in engine.oracle.moving:
            w, x, y, z = here.link_rotation.sel(link=link).values
            axes = np.array(
                [
                    [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
                ]
            )
            frames[link] = Frame(here.link_position.sel(link=link).values, axes)
        drive = {}
        for driver in engine.drivers:
            kind = "slide" if engine.joints[driver]["type"] == "prismatic" else "rotation"
            values = (
                float(here[f"joint_{kind}{rate}"].sel(joint=driver)) for rate in ("", "_velocity", "_acceleration")
            )
            drive[driver] = Drive(*values)
        motions = engine.move(frames, drive)
        pace = max(1.0, *(float(np.max(np.abs(motion.spin))) for motion in motions.values()))
        for link, motion in motions.items():
            centre, _ = engine.oracle.centre(link, motion)
            c = np.asarray(engine.links[link]["centre"], float)
            w, second = (here[f"link_angular_{what}"].sel(link=link).values for what in ("velocity", "acceleration"))
            np.testing.assert_allclose(frames[link].place + frames[link].axes @ c, centre, rtol=0, atol=1e-11)
            np.testing.assert_allclose(w, motion.spin, rtol=0, atol=1e-11 * pace)
            np.testing.assert_allclose(second, motion.spin_rate, rtol=0, atol=1e-10 * pace**2)
            if link not in engine.oracle.free:
                turn = quaternion(frames[link].axes @ motion.frame.axes.T)
                assert abs(abs(turn[0]) - 1) < 1e-12
        compare_forces(here, engine)


def compare_forces(here: xr.Dataset, engine: Engine) -> None:
    """Reactions, efforts and moments of free spins of one position."""
    forces = engine.forces()
    scale = max(float(np.linalg.norm(force)) for force, _ in forces.reactions.values())
    couple = max(float(np.linalg.norm(moment)) for _, moment in forces.reactions.values())
    couple = max([couple, *map(abs, forces.efforts.values())])
    for joint, (force, moment) in forces.reactions.items():
        given = here.sel(joint=joint)
        np.testing.assert_allclose(given.reaction_force.values, force, rtol=0, atol=1e-11 * scale, err_msg=joint)
        np.testing.assert_allclose(given.reaction_moment.values, moment, rtol=0, atol=1e-11 * couple, err_msg=joint)
    for driver, effort in forces.efforts.items():
        size = scale if engine.joints[driver]["type"] == "prismatic" else couple
        assert float(here.drive_effort.sel(driver=driver)) == pytest.approx(effort, abs=1e-11 * size), driver
    assert all(abs(moment) < 1e-11 * couple for moment in forces.spins.values())
