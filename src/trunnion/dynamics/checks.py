"""What motion in time cannot do for a mechanism, said before it begins."""

from __future__ import annotations

from collections.abc import Iterator

from trunnion.errors import Finding, MechanismError
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.model.mechanism import Mechanism

__all__ = ["refuse"]


def refuse(mechanism: Mechanism) -> None:
    """MechanismError with what keeps a mechanism from being let move."""
    if findings := list(_findings(mechanism)):
        raise MechanismError(findings)


def _findings(mechanism: Mechanism) -> Iterator[Finding]:
    free = [name for name, driver in mechanism.drivers.items() if driver.found]
    if not free:
        first = next(iter(mechanism.drivers), "")
        what = "no driver is free, so there is no motion to find"
        remedy = "state a motor, such as motor: {kind: constant, effort: 4 N m}, or free: true"
        yield Finding(what, f"drivers.{first}" if first else "drivers", remedy)
        return
    if len(free) < 2:
        return
    smooth = [name for name, law in FRICTION_LAWS.items() if not law.interval_at_rest]
    for name, joint in mechanism.effective_joints.items():
        law = joint.friction.law if joint.friction else None
        if law and FRICTION_LAWS[law].interval_at_rest:
            what = f"the law {law} lets a joint stick, and with {len(free)} free drivers joints stick one by one"
            yield Finding(what, f"joints.{name}.friction", f"use a law that is smooth at rest: {', '.join(smooth)}")
    for name, load in mechanism.loads.items():
        if load.joint is not None:
            what = f"it may hold its joint at rest, and with {len(free)} free drivers joints stick one by one"
            yield Finding(what, f"loads.{name}", "use a damper (springs: damping) instead, or one free driver")
    for name in free:
        motor = mechanism.drivers[name].motor
        if motor is not None and motor.brake is not None:
            what = f"a brake may hold its joint at rest, and with {len(free)} free drivers joints stick one by one"
            yield Finding(what, f"drivers.{name}.motor.brake", "remove it, or use one free driver")
