"""Whole mechanisms against the Newton–Euler equations of all links at once, which share nothing with Trunnion.

The oracle is given accelerations differentiated here from Trunnion's positions only, so that a consistent error of
velocity, acceleration and force could not cancel; friction is given from the reactions found. MuJoCo has its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mechanisms import MODELS, Array, Data, build, model
from reference import newton_euler
from reference.mujoco_engine import Engine
from trunnion.solve.run import Run, prepare

STEPS = 24
STEP = 2e-3  # rad-like share of the cycle for the sixth-order differences below


def times(run: Run) -> Array:
    """Times away from the ends of a range, where central differences have no room."""
    return (np.arange(STEPS) + 0.37) / STEPS * run.cycle.duration


def here(number: Any, i: int) -> float:
    """The number of one of the positions."""
    return float(np.broadcast_to(number, (STEPS,))[i])


def accelerations(run: Run, time: Array) -> dict[str, Array]:
    """Second derivatives (x, y, angle) of the poses of the centres of mass, of moving links, by eighth-order central
    differences of positions."""
    h = STEP * run.cycle.duration
    weights = np.array([-1 / 560, 8 / 315, -1 / 5, 8 / 5, -205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560]) / h**2
    walks = [run.solve(row).walk for row in time + h * np.arange(-4, 5)[:, None]]
    second = {}
    for link in set(walks[0].motions) - {run.system.mechanism.fixed_link}:
        cx, cy = run.system.centre(run.values, link)
        frames = [walk.motions[link].frame for walk in walks]
        x, y, c, s = (np.array([np.broadcast_to(frame[k], time.shape) for frame in frames]) for k in range(4))
        poses = x + c * cx - s * cy, y + s * cx + c * cy, np.unwrap(np.arctan2(s, c), axis=0)
        second[link] = np.array([np.tensordot(weights, n, axes=1) for n in poses])
    return second


def bodies_at(run: Run, data: Data, back: Any, second: dict[str, Array], i: int) -> dict[str, newton_euler.Body]:
    walk, values, bodies = back.walk, run.values, {}
    for link, acceleration in second.items():
        loads = []
        for load in data.get("loads", {}).values():
            if load.get("link") == link:
                at = walk.point(link, load["at"]).place if "at" in load else (0.0, 0.0)
                place, force = [here(n, i) for n in at], load.get("force", (0.0, 0.0))
                loads.append(newton_euler.Load(place, force, load.get("moment", 0.0)))
        centre = [here(n, i) for n in walk.at(link, run.system.centre(values, link)).place]
        mass, inertia = (values[f"links.{link}.{what}"] for what in ("mass", "inertia"))
        bodies[link] = newton_euler.Body(
            mass, inertia, centre, acceleration[:2, i], acceleration[2, i], loads=loads
        )  # fmt: skip
    return bodies


def joints_at(run: Run, back: Any, i: int) -> dict[str, newton_euler.Joint]:
    mechanism, joints = run.system.mechanism, {}
    for name, (kind, links) in run.system.joints.items():
        at, axis = back.walk.element(links[1], name), back.walk.element(links[0], name)
        first, second = (None if link == mechanism.fixed_link else link for link in links)
        point, slide = (here(at.x, i), here(at.y, i)), (here(axis.c, i), here(axis.s, i))
        joint = newton_euler.Joint(kind, first, second, point, slide, driven=name in mechanism.drivers)
        joints[name] = replace(joint, friction=here(back.friction[name], i) * newton_euler.wrenches(joint)[1])
    teeth = {name: teeth_at(run, back, name, i) for name, gear in mechanism.gears.items() if gear.teeth}
    return {**joints, **teeth}


def teeth_at(run: Run, back: Any, name: str, i: int) -> newton_euler.Joint:
    """The teeth of a gear pair or rack: they touch where both have one velocity, which is along them.

    What pushes the gears apart is given as found, and checked against its law in `test_gears`.
    """
    joints, twists = run.system.joints, {link: motion.twist for link, motion in back.walk.motions.items()}
    pair = sorted(run.system.mechanism.gears[name].joints, key=lambda joint: joints[joint][0] == "prismatic")
    (carrier,) = set(joints[pair[0]][1]) & set(joints[pair[1]][1])
    gears = [next(link for link in joints[joint][1] if link != carrier) for joint in pair]
    one = np.array([here(n, i) for n in back.walk.algebra.minus(twists[gears[0]], twists[carrier])])
    x, y, w = (here(part, i) for part in back.walk.algebra.minus(twists[gears[1]], twists[gears[0]]))
    point = np.array([-y, x]) / w
    velocity = one[:2] + one[2] * np.array([-point[1], point[0]])
    tangent = velocity / np.hypot(*velocity)
    across = np.array([-tangent[1], tangent[0]])
    apart = across * (across @ [here(part, i) for part in back.gears[name].force])
    first, second = (None if link == run.system.mechanism.fixed_link else link for link in gears)
    return newton_euler.Joint("contact", first, second, point, tangent, friction=[*apart, 0.0])


NO_CONTACT = ("rocker train", "screwed strut")  # torques alone; a screw against a driven slide in `test_gears`


@pytest.mark.spread(12)
@pytest.mark.parametrize("friction", [None, 0.15])
@pytest.mark.parametrize("name", [name for name in MODELS if name not in NO_CONTACT])
def test_reactions_and_efforts(name: str, friction: float | None) -> None:
    """Same reactions and efforts to 1e-8: eighth-order differences are good to about 1e-10 of the accelerations."""
    data = model(MODELS[name](), friction=friction)
    run = prepare(build(MODELS[name](), friction=friction))
    time = times(run)
    back = run.solve(time)
    second = accelerations(run, time)
    scale = max(float(np.max(np.hypot(r.x, r.y))) for r in back.reactions.values())
    arm = float(run.system.size(run.values))
    for i in range(STEPS):
        joints = joints_at(run, back, i)
        oracle = newton_euler.solve(bodies_at(run, data, back, second, i), joints, data["gravity"])
        for joint, reaction in back.reactions.items():
            found = [here(n, i) for n in (reaction.x, reaction.y, reaction.m)]
            np.testing.assert_allclose(found[:2], oracle.force[joint], rtol=0, atol=1e-8 * scale, err_msg=joint)
            np.testing.assert_allclose(found[2], oracle.moment[joint], rtol=0, atol=1e-8 * scale * arm, err_msg=joint)
        for driver, effort in back.efforts.items():
            size = scale * (arm if joints[driver].kind == "revolute" else 1.0)
            np.testing.assert_allclose(here(effort, i), oracle.effort[driver], rtol=0, atol=1e-8 * size, err_msg=driver)


@pytest.mark.parametrize("name", MODELS)
def test_friction_obeys_its_law(name: str) -> None:
    """|M| = f r |F| at a pin, |F_t| = f (|F_n/2 + M/L| + |F_n/2 − M/L|) in a guide, against the slip.

    In a thread |M| = f r N cos λ, N being the part of the force between screw and nut that is square to its flank.
    """
    coefficient, radius, guide = 0.15, 0.01, 0.4
    run = prepare(build(MODELS[name](), friction=coefficient, radius=radius, guide=guide))
    back = run.solve(times(run))
    normals = {}
    for joint, (kind, (first, _)) in run.system.joints.items():
        reaction = back.reactions[joint]
        normals[joint] = np.hypot(reaction.x, reaction.y)
        if kind == "prismatic":
            axis = back.walk.element(first, joint)
            across = axis.c * reaction.y - axis.s * reaction.x
            normals[joint] = np.abs(across / 2 + reaction.m / guide) + np.abs(across / 2 - reaction.m / guide)
    levers = {joint: radius if kind == "revolute" else 1.0 for joint, (kind, _) in run.system.joints.items()}
    for name, gear in run.system.mechanism.gears.items():
        if gear.lead is not None:
            turning, sliding = gear.joints
            axis, slope = back.walk.ends(sliding)[0], np.arctan2(run.values[f"gears.{name}.lead"] / (2 * np.pi), radius)
            x, y = back.gears[name].force
            square = (axis.c * x + axis.s * y) * np.cos(slope) - back.gears[name].torque / radius * np.sin(slope)
            normals[turning], levers[turning] = np.abs(square), radius * np.cos(slope)
    largest = max(float(np.max(normal)) for normal in normals.values())
    for joint, lever in levers.items():
        expected = -np.sign(back.walk.speed(joint)) * coefficient * lever * normals[joint]
        # the iteration rests where no normal load changes by more than 1e-8 of the largest
        np.testing.assert_allclose(
            np.broadcast_to(back.friction[joint], (STEPS,)),
            np.broadcast_to(expected, (STEPS,)),
            rtol=0,
            atol=1e-8 * coefficient * lever * largest,
        )


RADIUS, GUIDE = 0.01, 0.4  # of all pins, length of all guides, m


def guess(run: Any, back: Any, engine: Engine, i: int) -> Array:
    """Tree coordinates of one position, rounded, which tells the assembly."""
    q = np.zeros(engine.size)
    for name, dof in engine.dof.items():
        one, two = (back.walk.element(link, name) for link in engine.joints[name]["links"])
        turn = np.arctan2(one.c * two.s - one.s * two.c, one.c * two.c + one.s * two.s)
        slide = one.c * (two.x - one.x) + one.s * (two.y - one.y)
        value = turn if engine.joints[name]["type"] == "revolute" else slide
        q[dof] = engine.sense[name] * np.round(here(value, i), 1)
    return q


def compared(run: Any, back: Any, engine: Engine, i: int, friction: float) -> Iterator[tuple[str, Any, Any]]:
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
        yield "moment", back.reactions[joint][2:], reaction[2:]
        yield f"friction of the {engine.joints[joint]['type']} joints", [back.friction[joint]], [rubbing[joint]]
    for driver, effort in efforts.items():
        yield f"drive of {driver}", [back.efforts[driver]], [effort]


@pytest.mark.spread(4)
@pytest.mark.parametrize("friction", [0.0, 0.15])
@pytest.mark.parametrize("name", [name for name, data in MODELS.items() if "gears" not in data()])
def test_agrees_with_mujoco(name: str, friction: float) -> None:
    """Motion and, without friction, forces to 1e-12 of the largest of their kind; with friction forces to 1e-8.

    Reached: 8e-14, and 1e-9 with friction, whose iteration ends where no normal load changes by more than 1e-8.
    """
    options: Data = {"friction": friction, "radius": RADIUS, "guide": GUIDE}
    run, engine = (prepare(build(MODELS[name](), **options)), Engine(model(MODELS[name](), **options), RADIUS, GUIDE))
    time = times(run)
    back = run.solve(time)
    drives = [run.system.drive(run.values, driver, time) for driver in engine.drivers]
    pairs: dict[str, list[Array]] = {}
    for i in range(STEPS):
        engine.move(guess(run, back, engine, i), [(float(q[i]), float(rate)) for q, rate, _ in drives])
        for kind, ours, theirs in compared(run, back, engine, i, friction):
            pairs.setdefault(kind, []).append(np.array([[here(n, i) for n in ours], theirs], float))
    for kind, found in pairs.items():
        ours, theirs = np.concatenate(found, axis=1)
        rubs = friction and kind.startswith(("force", "moment", "friction", "drive"))
        limit = (1e-8 if rubs else 1e-12) * np.max(np.abs(theirs))
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=limit, err_msg=kind)
