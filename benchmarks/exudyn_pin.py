"""The rattling gudgeon pin of `tests.playing` in Exudyn: the peer of `benchmarks.motions`, where it is installed.

Crank, rod and slider are rigid bodies in the plane, held by joints and constraints at velocity level; the crank keeps
its speed by a constraint. The contact is Exudyn's own of a sphere in a hollow one, by Hunt and Crossley with the
restitution that makes their factor, 3 (1 − c)/2, that of Lankarani and Nikravesh, 3 (1 − 0.9²)/4. Steps of one size by
Newmark's trapezoidal rule.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from tests.playing import SPEED

from trunnion.joints.contact import hertz_stiffness

__all__ = ["Contacts", "contacts", "moved"]

Array = NDArray[np.float64]

CRANK, ROD, ROD_MASS, ROD_INERTIA, SLIDER_MASS = 0.05, 0.12, 0.21, 2.5e-4, 0.14
PIN, HOLE = 9.5e-3, 10e-3
RESTITUTION = 1 - (1 - 0.9**2) / 2


class Contacts(NamedTuple):
    """Begin, s, duration, s, and penetration, m, of the first contact; how many there are."""

    begin: float
    duration: float
    penetration: float
    count: int


def moved(step: float, duration: float) -> None:
    """A motion without any output, to be timed."""
    system, settings, _ = _prepared(step, duration, recorded=False)
    system.SolveDynamic(settings)


def contacts(step: float, duration: float) -> Contacts:
    """What the contacts were, from the pin's place in its hole at every step."""
    system, settings, sensors = _prepared(step, duration, recorded=True)
    system.SolveDynamic(settings)
    pin, hole = (system.GetSensorStoredData(one) for one in sensors)
    times, depth = pin[:, 0], np.hypot(*(pin - hole)[:, 1:3].T) - (HOLE - PIN)
    begins, ends = (np.flatnonzero(np.diff(np.sign(depth)) * sense > 0) for sense in (1, -1))
    first, last = begins[0], ends[ends > begins[0]][0]
    begin, end = (times[i] - depth[i] * step / (depth[i + 1] - depth[i]) for i in (first, last))
    top = first + int(np.argmax(depth[first:last]))
    before, most, after = depth[top - 1 : top + 2]
    vertex = most + (after - before) ** 2 / (8 * (2 * most - before - after))
    return Contacts(begin, end - begin, float(vertex), len(begins))


def _prepared(step: float, duration: float, recorded: bool) -> tuple[Any, Any, list[Any]]:
    import exudyn
    import exudyn.itemInterface

    items = exudyn.itemInterface

    system = exudyn.SystemContainer().AddSystem()
    still = system.AddMarker(
        items.MarkerNodeCoordinate(nodeNumber=system.AddNode(items.NodePointGround()), coordinate=0)
    )

    def body(x: float, mass: float, inertia: float, speed: float, turning: float) -> tuple[Any, Any]:
        node = system.AddNode(
            items.NodeRigidBody2D(referenceCoordinates=[x, 0, 0], initialVelocities=[0, speed, turning])
        )
        return node, system.AddObject(items.ObjectRigidBody2D(nodeNumber=node, mass=mass, inertia=inertia))

    def held(node: Any, coordinate: int, **rate: Any) -> None:
        own = system.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))
        system.AddObject(items.ObjectConnectorCoordinate(markerNumbers=[still, own], **rate))

    def marker(kind: Any, body: Any, x: float) -> Any:
        return system.AddMarker(kind(bodyNumber=body, localPosition=[x, 0, 0]))

    (crank, turned), (_, rod), (slider, slid) = (
        body(0, 1, 1, 0, SPEED),
        body(CRANK + ROD / 2, ROD_MASS, ROD_INERTIA, CRANK * SPEED / 2, -CRANK * SPEED / ROD),
        body(CRANK + ROD, SLIDER_MASS, 1, 0, 0),
    )
    for node, coordinate in ((crank, 0), (crank, 1), (slider, 1), (slider, 2)):
        held(node, coordinate)
    held(crank, 2, velocityLevel=True, offset=SPEED)
    ends = [marker(items.MarkerBodyPosition, turned, CRANK), marker(items.MarkerBodyPosition, rod, -ROD / 2)]
    system.AddObject(items.ObjectJointRevolute2D(markerNumbers=ends))
    memory = system.AddNode(items.NodeGenericData(initialCoordinates=[HOLE - PIN, 0, 0, 0], numberOfDataCoordinates=4))
    system.AddObject(
        items.ObjectContactSphereSphere(
            markerNumbers=[marker(items.MarkerBodyRigid, rod, ROD / 2), marker(items.MarkerBodyRigid, slid, 0)],
            nodeNumber=memory, spheresRadii=[PIN, HOLE], isHollowSphere1=True, impactModel=1,
            contactStiffness=hertz_stiffness(PIN, HOLE, 207e9, 207e9, 0.3, 0.3), contactStiffnessExponent=1.5,
            restitutionCoefficient=RESTITUTION, minimumImpactVelocity=1e-6,
        )
    )  # fmt: skip
    position = exudyn.OutputVariableType.Position
    sensors = [
        system.AddSensor(
            items.SensorBody(bodyNumber=one, localPosition=[x, 0, 0], outputVariableType=position,
                             storeInternal=True, writeToFile=False)
        )
        for one, x in ((rod, ROD / 2), (slid, 0))
        if recorded
    ]  # fmt: skip
    system.Assemble()
    return system, _settings(exudyn, step, duration), sensors


def _settings(exudyn: Any, step: float, duration: float) -> Any:
    """Newmark's rule at velocity level; the force that begins within a step is settled without parting the step."""
    found = exudyn.SimulationSettings()
    own = found.timeIntegration
    own.numberOfSteps, own.endTime, own.verboseMode, own.adaptiveStep = math.ceil(duration / step), duration, 0, False
    own.generalizedAlpha.useIndex2Constraints = own.generalizedAlpha.useNewmark = True
    own.generalizedAlpha.computeInitialAccelerations = True
    own.newton.absoluteTolerance, own.newton.relativeTolerance = 1e-5, 1e-6
    own.discontinuous.ignoreMaxIterations, own.discontinuous.useRecommendedStepSize = True, False
    found.solution.file.write, found.solution.sensors.writePeriod = False, step
    return found
