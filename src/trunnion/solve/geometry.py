"""What solving does differently in the plane and in space, as one row each of a table.

Everything else - the cycle, the choice of an assembly, friction, locking, power, findings - is the same code.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from trunnion.errors import Finding, MechanismError
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.joints.pairs import PAIRS
from trunnion.model.mechanism import Mechanism
from trunnion.solve import plane
from trunnion.solve.forward import Forward
from trunnion.solve.friction_problem import Rubbing
from trunnion.solve.space import contacts, determinacy, motion
from trunnion.solve.space.system import SpatialSystem
from trunnion.solve.system import System
from trunnion.structure.decompose import decompose

__all__ = ["GEOMETRIES", "Geometry", "build"]


@dataclass(frozen=True)
class Geometry:
    """system: makes a mechanism with its plan ready; walk: the walk forward; contacts: with friction, of a joint;
    determinacy: what the rank says of a run, None where the structure decides.
    """

    system: type[System]
    walk: type[Forward]
    contacts: Callable[..., Iterator[Rubbing]]
    determinacy: Callable[..., Any]


GEOMETRIES = {
    "planar": Geometry(System, plane.PlaneWalk, plane.contacts, lambda *run: None),  # decided by the structure alone
    "spatial": Geometry(SpatialSystem, motion.SpatialWalk, contacts.contacts, determinacy.look),
}


def build(mechanism: Mechanism) -> System:
    """Decompose a mechanism and prepare its modules. Raises MechanismError if its structure does not determine it."""
    geometry = GEOMETRIES[mechanism.space]
    if mechanism.space == "spatial" and (found := _bristles(mechanism)):
        raise MechanismError(found)
    return geometry.system(mechanism, decompose(mechanism), geometry)


def _bristles(mechanism: Mechanism) -> list[Finding]:
    """Laws with bristles in pairs whose slip has no one direction: a deflection is followed along one way only."""
    found = []
    for name, joint in mechanism.effective_joints.items():
        law = joint.friction.law if joint.friction else None
        if law and FRICTION_LAWS[law].relaxation is not None and PAIRS[joint.type].count > 1:
            what = f"the bristles of the law {law} bend in one direction, the slip of a {joint.type} joint has several"
            found.append(
                Finding(what, f"joints.{name}.friction", "use coulomb, viscous, stribeck or brown-mcphee here")
            )
    return found
