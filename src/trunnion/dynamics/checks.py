"""What motion in time cannot do for a mechanism, said before it begins."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from trunnion.dynamics.opened import in_play, of_several
from trunnion.dynamics.rates import Layout
from trunnion.dynamics.state import FreeMotion
from trunnion.errors import Finding, MechanismError
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.joints.pairs import PAIRS
from trunnion.model.mechanism import Mechanism
from trunnion.solve.run import Run

__all__ = ["refuse", "refuse_massless", "refuse_undetermined"]

Array = NDArray[np.float64]


def refuse(mechanism: Mechanism) -> None:
    """MechanismError with what keeps a mechanism from being let move."""
    if findings := list(_findings(mechanism)):
        raise MechanismError(findings)


def refuse_undetermined(run: Run, playing: Sequence[str] = ()) -> None:
    """MechanismError where the joints of a mechanism in space do not determine its motion or its reactions. playing:
    joints in play, without which it is."""
    determinacy = run.determinacy
    redundant = [joint for part in determinacy.parts if part.redundant for joint in part.joints] if determinacy else []
    if redundant and playing:
        of = f"{', '.join(redundant)} constrain each other more than once also while {', '.join(playing)} is in play"
        what = f"{of}: statics does not determine their reactions"
        raise MechanismError(Finding(what, "joints", "use a joint with more freedoms there (cylindrical, spherical)"))
    if determinacy is not None:
        determinacy.refuse()


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
    joints = dict.fromkeys(contact.joint for contact in motion.contacts.each)
    touching = dict.fromkeys(link for contact in motion.contacts.each for link in (contact.body, contact.other))
    light = [link for link in touching if not _weighs(motion, link)]
    light = [link for link in light if any(name.startswith(f"{link}_in_play_") for name in motion.names)] or light
    if not light:  # what turns without inertia
        weakest = motion.names[int(np.argmax(np.abs(np.linalg.eigh(matrix)[1][:, 0])))]
        chain = weakest.partition("_in_play_")[0]
        ends = [motion.system.joints[name][1] for name in motion.names if name.partition("_in_play_")[0] == chain]
        light = [
            link
            for links in ends
            for link in links
            if "_in_play_" not in link and not _weighs(motion, link, whole=True)
        ]
    if not light:  # what only slides: its inertia does not help it
        ground, values = motion.system.mechanism.fixed_link, motion.values
        light = [link for link in touching if link != ground and not np.any(values[f"links.{link}.mass"])]
    names = ", ".join(dict.fromkeys(light)) or "some link"
    what = (
        f"{names} has no mass, or no inertia, where nothing holds it while the pins of {', '.join(joints)} are in play"
    )
    remedy = "state its mass and inertia, or let fewer of its joints be in play"
    raise MechanismError(Finding(what, f"links.{light[0]}" if light else "links", remedy))


def _weighs(motion: FreeMotion, link: str, whole: bool = False) -> bool:
    """Whether a link has a mass or an inertia, or inertia about every axis; the ground needs none."""
    path, values = f"links.{link}", motion.values
    axes = [f"{path}.inertia.{axis}{axis}" for axis in "xyz"] if len(motion.system.axes) > 2 else [f"{path}.inertia"]
    turning = [bool(np.any(values.get(axis, 0.0))) for axis in axes]
    enough = all(turning) if whole else any(turning) or bool(np.any(values[f"{path}.mass"]))
    return enough or link == motion.system.mechanism.fixed_link


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
    yield from _of_several(mechanism)
    if len(free) < 2 and not playing:
        return
    yield from _clutches(mechanism, free)
    yield from _contacts(mechanism, playing)
    rough = _rough(mechanism)
    for where, joint, what in _resisting(mechanism, free):
        if joint in playing:
            yield Finding(
                f"{what} joint {joint}, which is in play", where, "remove it, or let another joint be in play"
            )
        elif rough:
            why = f"{what} joint {joint} beside friction between rigid bodies in {rough}; how they share is not solved"
            remedy = (
                f"leave out the friction in {rough}, use another law of contact, or one here that is smooth at rest"
            )
            yield Finding(why, where, remedy)
        elif PAIRS[mechanism.effective_joints[joint].type].count != 1:
            why = f"{what} joint {joint}, which has more than one freedom, and {len(free)} coordinates are free"
            remedy = f"use a law that is smooth at rest: {', '.join(_smooth())}; or one free driver"
            yield Finding(why, where, remedy)


def _clutches(mechanism: Mechanism, free: list[str]) -> Iterator[Finding]:
    """Clutches beside several free coordinates."""
    subject, remedy = f"{len(free)} coordinates are free", "remove it, or let this driver alone be free"
    if len(free) < 2:
        subject, remedy = "joints are in play", "remove it, or the contact of the joints in play"
    for name in free:
        motor = mechanism.drivers[name].motor
        if motor is not None and motor.clutch is not None:
            what = f"a clutch that may slip is solved with one free coordinate, and {subject}"
            yield Finding(what, f"drivers.{name}.motor.clutch", remedy)


def _rough(mechanism: Mechanism) -> str:
    """A joint in play between rigid bodies with friction; empty without one."""
    values = mechanism.parameter_set.nominal
    for name, joint in mechanism.effective_joints.items():
        rigid = joint.contact is not None and joint.contact.of.rigid
        if rigid and values.get(f"joints.{name}.friction.coefficient", 0.0) != 0.0:
            return name
    return ""


def _smooth() -> list[str]:
    """Friction laws without an interval at rest."""
    return [name for name, law in FRICTION_LAWS.items() if not law.interval_at_rest]


def _of_several(mechanism: Mechanism) -> Iterator[Finding]:
    """What acts in joints that chains of single turns and slides stand in for, which have no such place."""
    playing, values = ", ".join(in_play(mechanism)), mechanism.parameters()
    for name in of_several(mechanism):
        joint, path = mechanism.effective_joints[name], f"joints.{name}"
        what = f"in a {joint.type} joint of a loop with {playing} in play it is not modelled"
        rubs = (f"{path}.friction.{key}" for key in joint.friction.parameters) if joint.friction else ()
        if any(values[joint_name] != 0 for joint_name in rubs):
            yield Finding(f"friction: {what}", f"{path}.friction", "state friction: 0 for this joint")
        if joint.losses is not None:
            yield Finding(what, f"{path}.losses", "remove it")
        for spring, joint_name in mechanism.springs.items():
            if joint_name.joint == name:
                yield Finding(what, f"springs.{spring}", "state it between two points")


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
