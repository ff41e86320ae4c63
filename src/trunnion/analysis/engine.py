"""What the analysis does differently in the plane and in space, as one row each of a table.

Everything else - the cycle, the choice of an assembly, friction, locking, power, findings - is the same code.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from trunnion.analysis import fill, kinematics, kinetostatics, scene
from trunnion.analysis.space import determinacy, forces, motion
from trunnion.analysis.space import fill as space_fill
from trunnion.analysis.space.system import SpatialSystem
from trunnion.analysis.system import System
from trunnion.errors import Finding, MechanismError
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.joints.pairs import PAIRS
from trunnion.model.mechanism import Mechanism
from trunnion.structure.decompose import decompose

__all__ = ["ENGINES", "Engine", "build"]


@dataclass(frozen=True)
class Engine:
    """system: makes a mechanism with its plan ready; start: a walk that knows the ground alone; backward: reactions and
    friction of a walk; labels, absent, fill_motion, fill_forces, unwrap: of the result; scene: for the drawings;
    determinacy: what the rank says of a run, None where the structure decides.
    """

    system: Callable[..., System]
    start: Callable[..., kinematics.Forward]
    backward: Callable[..., kinetostatics.Backward]
    labels: Callable[..., dict[str, list[str]]]
    absent: Callable[..., list[str]]
    fill_motion: Callable[..., None]
    fill_forces: Callable[..., None]
    unwrap: Callable[..., None]
    scene: Callable[..., dict[str, Any]]
    determinacy: Callable[..., Any]


ENGINES = {
    "planar": Engine(
        System,
        kinematics.on_the_ground,
        kinetostatics.backward,
        fill.labels,
        fill.absent,
        fill.fill_motion,
        fill.fill_forces,
        fill.unwrap,
        scene.planar,
        lambda *run: None,  # decided by the structure alone
    ),
    "spatial": Engine(
        SpatialSystem,
        motion.on_the_ground,
        forces.backward,
        space_fill.labels,
        space_fill.absent,
        space_fill.fill_motion,
        space_fill.fill_forces,
        space_fill.unwrap,
        scene.spatial,
        determinacy.look,
    ),
}


def build(mechanism: Mechanism) -> System:
    """Decompose a mechanism and prepare its modules. Raises MechanismError if its structure does not determine it."""
    engine = ENGINES[mechanism.space]
    if mechanism.space == "spatial" and (found := _bristles(mechanism)):
        raise MechanismError(found)
    return engine.system(mechanism, decompose(mechanism), engine)


def _bristles(mechanism: Mechanism) -> list[Finding]:
    """Laws with bristles in pairs whose slip has no one direction: a deflection is followed along one way only."""
    found = []
    for name, joint in mechanism.effective_joints.items():
        law = joint.friction.law if joint.friction else None
        if law and FRICTION_LAWS[law].relaxation is not None and PAIRS[joint.type].count > 1:
            what = f"the bristles of the law {law} bend along one way, the slip of a {joint.type} joint has several"
            found.append(
                Finding(what, f"joints.{name}.friction", "use coulomb, viscous, stribeck or brown-mcphee here")
            )
    return found
