"""Whole mechanisms in MuJoCo, which has a motion and forces of its own; in space without friction."""

import numpy as np
import pytest

import mechanisms_space
from brief import brief
from mechanisms import MODELS, build, model
from reference.maximal_space import Drive, published, unrolled
from reference.mujoco_engine import Engine as PlanarEngine
from reference.mujoco_space import Engine, quaternion
from trunnion import Mechanism
from trunnion.solve.run import prepare

STEPS = 24
RADIUS, GUIDE = 0.01, 0.4  # of all pins, length of all guides, m


def here(number, i):
    """The number of one of the positions."""
    return float(np.broadcast_to(number, (STEPS,))[i])


def guess(run, back, engine, i):
    """Tree coordinates of one position, rounded, which tells the assembly."""
    q = np.zeros(engine.size)
    for name, dof in engine.dof.items():
        one, two = (back.walk.element(link, name) for link in engine.joints[name]["links"])
        turn = np.arctan2(one.c * two.s - one.s * two.c, one.c * two.c + one.s * two.s)
        slide = one.c * (two.x - one.x) + one.s * (two.y - one.y)
        value = turn if engine.joints[name]["type"] == "revolute" else slide
        q[dof] = engine.sense[name] * np.round(here(value, i), 1)
    return q


def compared(run, back, engine, i, friction):
    """What is compared in one position: its kind, Trunnion's numbers, MuJoCo's."""
    for link, point in run.system.points:
        if link == "ground":
            continue
        moved, motion = back.walk.point(link, point), back.walk.motions[link]
        velocity, second = engine.motion(link, point)
        yield "place", moved.place, engine.place(link, point)[:2]
        yield "velocity", moved.velocity, velocity[:2]
        yield "acceleration", moved.acceleration, second[:2]
        yield "angular velocity", [motion.twist.w], velocity[2:]
        yield "angular acceleration", [motion.acceleration.w], second[2:]
    reactions, rubbing, efforts = engine.forces(friction)
    for joint, reaction in reactions.items():
        yield "force", back.reactions[joint][:2], reaction[:2]
        at = engine.place(engine.joints[joint]["links"][1], joint)
        yield "moment", back.reactions[joint][2:], [reaction[2] + at[0] * reaction[1] - at[1] * reaction[0]]
        yield f"friction of the {engine.joints[joint]['type']} joints", [back.friction[joint]], [rubbing[joint]]
    for driver, effort in efforts.items():
        yield f"drive of {driver}", [back.efforts[driver]], [effort]


@pytest.mark.spread(4)
@pytest.mark.parametrize("friction", [0.0, 0.15])
@pytest.mark.parametrize("name", [name for name, data in MODELS.items() if "gears" not in data()])
def test_in_the_plane(name, friction):
    """Motion and, without friction, forces to 1e-12 of the largest of their kind; with friction forces to 1e-8.

    Reached: 8e-14, and 1e-9 with friction, whose iteration ends where no normal load changes by more than 1e-8.
    """
    options = {"friction": friction, "radius": RADIUS, "guide": GUIDE}
    run = prepare(build(MODELS[name](), **options))
    engine = PlanarEngine(model(MODELS[name](), **options), RADIUS, GUIDE)
    time = (np.arange(STEPS) + 0.37) / STEPS * run.cycle.duration
    back = run.solve(time)
    drives = [run.system.drive(run.values, driver, time) for driver in engine.drivers]
    pairs = {}
    for i in range(STEPS):
        engine.move(guess(run, back, engine, i), [(float(q[i]), float(rate)) for q, rate, _ in drives])
        for kind, ours, theirs in compared(run, back, engine, i, friction):
            pairs.setdefault(kind, []).append(np.array([[here(n, i) for n in ours], theirs], float))
    for kind, found in pairs.items():
        ours, theirs = np.concatenate(found, axis=1)
        rubs = friction and kind.startswith(("force", "moment", "friction", "drive"))
        limit = (1e-8 if rubs else 1e-12) * np.max(np.abs(theirs))
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=limit, err_msg=kind)


IN_SPACE = [
    "RSSR of the theory", "Cardan joint of Pezzuti", "Cardan joint at 45 degrees under gravity",
    *("RSSP", "RCCC", "RRRSR", "RSUR", "PSUR", "CRSR", "RCSC, two drivers", "RRRRRRR"),
]  # fmt: skip


@pytest.mark.spread(1)
@pytest.mark.parametrize("name", IN_SPACE)
def test_in_space(name):
    """Motion and forces without friction to 1e-11 of the largest of their kind; no free spin needs a moment."""
    data = mechanisms_space.with_friction(name, False)
    result, engine = brief(Mechanism(**data), 9), Engine(unrolled(data))
    ways = {name: "slide" if joint["type"] == "prismatic" else "rotation" for name, joint in engine.joints.items()}
    for i in range(9):

        def given(variable, i=i, **where):
            return np.asarray(result[variable].sel(**where).values[..., i], float)

        frames = {link: published(result, link, i) for link in engine.oracle.moving}
        rates = ("", "_velocity", "_acceleration")
        drive = {name: Drive(*(float(given(f"joint_{ways[name]}{rate}", joint=name)) for rate in rates))
                 for name in data["drivers"]}  # fmt: skip
        motions = engine.move(frames, drive)
        pace = max(1.0, *(float(np.max(np.abs(motion.spin))) for motion in motions.values()))
        for link, motion in motions.items():
            centre = frames[link].place + frames[link].axes @ np.asarray(engine.links[link]["centre"], float)
            np.testing.assert_allclose(centre, engine.oracle.centre(link, motion)[0], rtol=0, atol=1e-11)
            w, second = (given(f"link_angular_{what}", link=link) for what in ("velocity", "acceleration"))
            np.testing.assert_allclose(w, motion.spin, rtol=0, atol=1e-11 * pace)
            np.testing.assert_allclose(second, motion.spin_rate, rtol=0, atol=1e-10 * pace**2)
            if link not in engine.oracle.free:
                assert abs(abs(quaternion(frames[link].axes @ motion.frame.axes.T)[0]) - 1) < 1e-12
        forces = engine.forces()
        scale = max(float(np.linalg.norm(force)) for force, _ in forces.reactions.values())
        couple = max(float(np.linalg.norm(moment)) for _, moment in forces.reactions.values())
        couple = max(couple, *(abs(effort) for effort in forces.efforts.values()))
        for joint, (force, moment) in forces.reactions.items():
            np.testing.assert_allclose(given("reaction_force", joint=joint), force, rtol=0, atol=1e-11 * scale)
            np.testing.assert_allclose(given("reaction_moment", joint=joint), moment, rtol=0, atol=1e-11 * couple)
        for driver, effort in forces.efforts.items():
            size = scale if ways[driver] == "slide" else couple
            assert float(given("drive_effort", driver=driver)) == pytest.approx(effort, abs=1e-11 * size), driver
        assert all(abs(moment) < 1e-11 * couple for moment in forces.spins.values())
