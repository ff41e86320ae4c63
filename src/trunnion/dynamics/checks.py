"""What motion in time cannot do for a mechanism, said before it begins."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.model.mechanism import Mechanism

__all__ = ["refuse"]


def refuse(mechanism: Mechanism) -> None:
    """MechanismError with what keeps a mechanism from being let move."""
    if findings := list(_findings(mechanism)):
        raise MechanismError(findings)


def _inert(mechanism: Mechanism) -> Iterator[bool]:
    """Whether each mass and inertia of what moves is one."""
    values = mechanism.parameters()
    for path, value in values.items():
        section, name, *rest = path.split(".")
        if section == "links" and name != mechanism.fixed_link and rest and rest[0] in ("mass", "inertia"):
            yield bool(np.any(np.asarray(value) != 0))
        if section == "drivers" and rest == ["motor", "inertia"]:
            yield bool(np.any(np.asarray(value) != 0))


def _findings(mechanism: Mechanism) -> Iterator[Finding]:
    free = [name for name, driver in mechanism.drivers.items() if driver.found]
    if not free:
        first = next(iter(mechanism.drivers), "")
        what = "no driver is free, so there is no motion to find"
        remedy = "state a motor, such as motor: {kind: constant, effort: 4 N m}, or free: true"
        yield Finding(what, f"drivers.{first}" if first else "drivers", remedy)
        return
    if not any(_inert(mechanism)):
        remedy = "state a mass or an inertia of a link that it moves, or the inertia of its motor"
        yield Finding("no mass moves with it, so it has no acceleration", f"drivers.{free[0]}", remedy)
    if len(free) > 1:
        yield from _sticking(mechanism, free)


def _sticking(mechanism: Mechanism, free: Sequence[str]) -> Iterator[Finding]:
    """What may hold one joint at rest while others move."""
    for name in free:
        motor = mechanism.drivers[name].motor
        if motor is not None and motor.efficiency is not None and motor.efficiency.source != 1:
            what = (
                f"the gear's loss may hold its joint at rest, and with {len(free)} free drivers joints stick one by one"
            )
            yield Finding(what, f"drivers.{name}.motor.efficiency", "remove it, or use one free driver")
    smooth = [name for name, law in FRICTION_LAWS.items() if not law.interval_at_rest]
    for name, joint in mechanism.effective_joints.items():
        law = joint.friction.law if joint.friction else None
        if law and FRICTION_LAWS[law].interval_at_rest:
            what = f"the law {law} lets a joint stick, and with {len(free)} free drivers joints stick one by one"
            yield Finding(what, f"joints.{name}.friction", f"use a law that is smooth at rest: {', '.join(smooth)}")
        if joint.losses is not None and joint.losses.constant is not None:
            what = f"it may hold the joint at rest, and with {len(free)} free drivers joints stick one by one"
            yield Finding(what, f"joints.{name}.losses.constant", "state viscous instead, or use one free driver")
    for name, load in mechanism.loads.items():
        if load.joint is not None:
            what = f"it may hold its joint at rest, and with {len(free)} free drivers joints stick one by one"
            yield Finding(what, f"loads.{name}", "use a damper (springs: damping) instead, or one free driver")
    for name in free:
        motor = mechanism.drivers[name].motor
        if motor is not None and motor.brake is not None:
            what = f"a brake may hold its joint at rest, and with {len(free)} free drivers joints stick one by one"
            yield Finding(what, f"drivers.{name}.motor.brake", "remove it, or use one free driver")
