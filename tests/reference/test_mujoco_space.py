"""Frictionless spatial mechanisms against MuJoCo: motion, reactions, efforts.

The engine is given the model's data and, to tell the assembly, the links' frames rounded (0.1 of a quaternion's parts,
0.01 rad and m) and no other result of Trunnion's.
"""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import trunnion
from brief import brief
from mechanisms_space import MODELS, cardan, rssr
from reference.maximal_space import Data, Drive, Frame, unrolled
from reference.mujoco_space import Engine, quaternion

STEPS = 8
LOOPS: dict[str, Data] = {
    "Cardan joint of Pezzuti": cardan(),
    "Cardan joint at 45 degrees under gravity": {**cardan(0.08, 45.0, 0.5, 30.0), "gravity": [3.0, -5.0, 8.0]},
}
NAMES = [
    "RSSR of the theory",
    *LOOPS,
    *("RSSP", "RCCC", "RRRSR", "RSUR", "PSUR", "CRSR", "RCSC, two drivers", "RRRRRRR"),
]


def stated(name: str) -> Data:
    """The model without friction; the Cardan joints start off the position where a pin is at rest."""
    if name in LOOPS:
        data = {**LOOPS[name], "drivers": {"input": {"speed": 100.0, "start": 0.07}}}
    else:
        data = dict(rssr().data if name == "RSSR of the theory" else MODELS[name]().data)
    defaults = {key: part for key, part in data.get("joint_defaults", {}).items() if key != "friction"}
    return {**data, "joint_defaults": defaults}


@pytest.mark.spread(1)
@pytest.mark.parametrize("name", NAMES)
def test_agrees_with_mujoco(name: str) -> None:
    """Motion and forces to 1e-11 of the largest of their kind."""
    data = stated(name)
    result = brief(trunnion.Mechanism(trunnion=1, **data), STEPS)
    engine = Engine(unrolled(data) if "loop" in data else data)
    for i in range(STEPS):
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
