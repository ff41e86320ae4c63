"""Whole mechanisms against MuJoCo. The engine is given the model's data and no result of Trunnion's but, to tell one
assembly from the other, the links' angles rounded to 0.1 rad and the slides to 0.1 m.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from mechanisms import MODELS, Array, Data, build, model
from reference.mujoco_engine import Engine
from trunnion.solve.run import prepare

STEPS = 24
RADIUS, GUIDE = 0.01, 0.4  # of all pins, length of all guides, m


def guess(run: Any, back: Any, engine: Engine, i: int) -> Array:
    """Tree coordinates of one position, rounded, which tells the assembly."""
    q = np.zeros(engine.size)
    for name, dof in engine.dof.items():
        one, two = (back.walk.element(link, name) for link in engine.joints[name]["links"])
        turn = np.arctan2(one.c * two.s - one.s * two.c, one.c * two.c + one.s * two.s)
        slide = one.c * (two.x - one.x) + one.s * (two.y - one.y)
        value = turn if engine.joints[name]["type"] == "revolute" else slide
        q[dof] = engine.sense[name] * np.round(np.broadcast_to(value, (STEPS,))[i], 1)
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


@pytest.mark.spread(5)
@pytest.mark.parametrize("friction", [0.0, 0.15])
@pytest.mark.parametrize("name", [name for name, data in MODELS.items() if "gears" not in data()])
def test_agrees_with_mujoco(name: str, friction: float) -> None:
    """Motion and, without friction, forces to 1e-12 of the largest of their kind; with friction forces to 1e-8.

    Reached: 8e-14, and 1e-9 with friction, whose iteration ends where no normal load changes by more than 1e-8.
    """
    options: Data = {"friction": friction, "radius": RADIUS, "guide": GUIDE}
    run, engine = (prepare(build(MODELS[name](), **options)), Engine(model(MODELS[name](), **options), RADIUS, GUIDE))
    time = (np.arange(STEPS) + 0.37) / STEPS * run.cycle.duration
    back = run.solve(time)
    drives = [run.system.drive(run.values, driver, time) for driver in engine.drivers]
    pairs: dict[str, list[Array]] = {}
    for i in range(STEPS):
        engine.move(guess(run, back, engine, i), [(float(q[i]), float(rate)) for q, rate, _ in drives])
        for kind, ours, theirs in compared(run, back, engine, i, friction):
            here = [np.broadcast_to(n, (STEPS,))[i] for n in ours]
            pairs.setdefault(kind, []).append(np.array([here, theirs], float))
    for kind, found in pairs.items():
        ours, theirs = np.concatenate(found, axis=1)
        rubs = friction and kind.startswith(("force", "moment", "friction", "drive"))
        limit = (1e-8 if rubs else 1e-12) * np.max(np.abs(theirs))
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=limit, err_msg=kind)
