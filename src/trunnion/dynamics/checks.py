"""What motion in time cannot do for a mechanism, said before it begins."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from trunnion.dynamics.opened import in_play
from trunnion.dynamics.rates import Layout
from trunnion.dynamics.state import FreeMotion
from trunnion.errors import Finding, MechanismError
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.joints.pairs import PAIRS
from trunnion.model.mechanism import Mechanism

__all__ = ["refuse", "refuse_massless"]

Array = NDArray[np.float64]


def refuse(mechanism: Mechanism) -> None:
    """MechanismError with what keeps a mechanism from being let move."""
    if findings := list(_findings(mechanism)):
        raise MechanismError(findings)


SINGULAR = 1e12  # condition of a mass matrix, coordinates by what is typical of each, that is none


def refuse_massless(motion: FreeMotion, row: Array) -> None:
    """MechanismError where a force on some free coordinate would accelerate nothing: links without mass that no joint
    holds. row: the state at the start."""
    at = Layout.of(motion).moment(np.zeros(1), row[:, None])._replace(onsets=(None,) * len(motion.contacts.each))
    matrix = motion.inertia(at)[:, :, 0] * motion.unit
    scale = np.sqrt(np.abs(np.diag(matrix)))
    with np.errstate(all="ignore"):
        condition = np.linalg.cond(matrix / scale[:, None] / scale) if np.all(scale > 0) else np.inf
    if condition < SINGULAR:
        return
    values, joints = motion.values, dict.fromkeys(one.joint for one in motion.contacts.each)
    light = [
        link
        for one in motion.contacts.each
        for link in (one.body, one.other)
        if link != motion.system.mechanism.fixed_link
        and not np.any(values[f"links.{link}.mass"]) and not np.any(values[f"links.{link}.inertia"])
    ]  # fmt: skip
    light = [link for link in light if any(name.startswith(f"{link}_in_play_") for name in motion.names)] or light
    names = ", ".join(dict.fromkeys(light)) or "some link"
    what = f"{names} has no mass and is held by nothing while the pins of {', '.join(joints)} are in play"
    remedy = "state its mass and inertia, or let fewer of its joints be in play"
    raise MechanismError(Finding(what, f"links.{light[0]}" if light else "links", remedy))


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
    if not free and not in_play(mechanism):
        first = next(iter(mechanism.drivers), "")
        what = "no driver is free, so there is no motion to find"
        remedy = "state a motor, such as motor: {kind: constant, effort: 4 N m}, or free: true"
        yield Finding(what, f"drivers.{first}" if first else "drivers", remedy)
        return
    if not any(_inert(mechanism)):
        remedy = "state a mass or an inertia of a link that it moves, or the inertia of its motor"
        yield Finding("no mass moves with it, so it has no acceleration", f"drivers.{free[0]}", remedy)
    playing = in_play(mechanism)
    yield from _unlike(mechanism, playing)
    if len(free) < 2 and not playing:
        return
    yield from _contacts(mechanism, playing)
    if any(joint.contact.of.rigid for joint in mechanism.effective_joints.values() if joint.contact is not None):
        why = "joints stick one by one, which is not solved beside joints in play between rigid bodies"
        yield from _sticking(mechanism, free, why, "use another law of contact, or remove it")
        return
    for where, joint, what in _resisting(mechanism, free):
        if joint in playing:
            yield Finding(
                f"{what} joint {joint}, which is in play", where, "remove it, or let another joint be in play"
            )
        elif PAIRS[mechanism.effective_joints[joint].type].count != 1:
            why = f"{what} joint {joint}, which has more than one freedom, and {len(free)} coordinates are free"
            remedy = f"use a law that is smooth at rest: {', '.join(_smooth())}; or one free driver"
            yield Finding(why, where, remedy)


def _smooth() -> list[str]:
    """Friction laws without an interval at rest."""
    return [name for name, law in FRICTION_LAWS.items() if not law.interval_at_rest]


def _unlike(mechanism: Mechanism, playing: list[str]) -> Iterator[Finding]:
    """Contacts of rigid bodies beside others."""
    rigid = {name: mechanism.effective_joints[name].contact for name in playing}
    stiff = [name for name, contact in rigid.items() if contact is not None and contact.of.rigid]
    if stiff and len(stiff) < len(playing):
        other = next(name for name in playing if name not in stiff)
        what = f"{stiff[0]} is in play between rigid bodies, and {other} is not"
        yield Finding(what, f"joints.{other}.contact.law", "use law: rigid for all joints in play, or for none")


def _contacts(mechanism: Mechanism, playing: list[str]) -> Iterator[Finding]:
    """Friction laws that are none of a contact which comes and goes."""
    plain = [name for name in _smooth() if FRICTION_LAWS[name].relaxation is None]
    for name in playing:
        joint = mechanism.effective_joints[name]
        law = joint.friction.law if joint.friction else None
        may = ["coulomb"] if joint.contact and joint.contact.of.rigid else plain
        if law and law not in may:
            what = f"the law {law} is not one of a contact that comes and goes"
            yield Finding(what, f"joints.{name}.friction", f"use {' or '.join(may)}")


def _resisting(mechanism: Mechanism, free: list[str]) -> Iterator[tuple[str, str, str]]:
    """What may hold a joint at rest: its path, the joint, and words that end before the joint."""
    for name in free:
        motor = mechanism.drivers[name].motor
        if motor is not None and motor.efficiency is not None and motor.efficiency.source != 1:
            yield f"drivers.{name}.motor.efficiency", name, "the gear's loss may hold"
        if motor is not None and motor.brake is not None:
            yield f"drivers.{name}.motor.brake", name, "a brake may hold"
    for name, joint in mechanism.effective_joints.items():
        law = joint.friction.law if joint.friction else None
        if law and joint.contact is None and FRICTION_LAWS[law].interval_at_rest:
            yield f"joints.{name}.friction", name, f"the law {law} may hold"
        if joint.losses is not None and joint.losses.constant is not None:
            yield f"joints.{name}.losses.constant", name, "the constant loss may hold"
    for name, load in mechanism.loads.items():
        if load.joint is not None:
            yield f"loads.{name}", load.joint, "the load may hold"


def _sticking(mechanism: Mechanism, free: list[str], why: str, remedy: str) -> Iterator[Finding]:
    """What may hold a joint at rest, where that is not solved."""
    for where, joint, what in _resisting(mechanism, free):
        smooth = f"use a law that is smooth at rest: {', '.join(_smooth())}" if where.endswith("friction") else remedy
        yield Finding(f"{what} joint {joint}, and {why}", where, smooth)
