"""What motion in time cannot do for a mechanism, said before it begins."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import single
from trunnion.dynamics.opened import in_play, of_several
from trunnion.dynamics.rates import Layout
from trunnion.dynamics.state import FreeMotion
from trunnion.errors import Finding, MechanismError
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.joints.pairs import PAIRS
from trunnion.model.mechanism import Mechanism
from trunnion.solve.run import Run
from trunnion.solve.track import TOUCHING

__all__ = ["check_start", "refuse", "refuse_massless", "refuse_undetermined"]

Array = NDArray[np.float64]

SINGULAR = 1e12  # condition of a mass matrix, coordinates by what is typical of each, that is none
BESIDE, MASSLESS = 0.1, 1e-15  # rad, or of the size: how far from the start more inertia may be; a share that is none
SMOOTH = [name for name, law in FRICTION_LAWS.items() if not law.interval_at_rest]


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
    links = dict.fromkeys(link for contact in motion.contacts.each for link in (contact.body, contact.other))
    light = [link for link in links if link != motion.system.mechanism.fixed_link and not _heavy(motion, link)]
    names = ", ".join(light or links)
    what = f"{names} has no mass, or no inertia about some axis, where nothing holds it while the pins of "
    what += f"{', '.join(joints)} are in play"
    remedy = "state its mass and inertia, or let fewer of its joints be in play"
    raise MechanismError(Finding(what, f"links.{(light or list(links))[0]}", remedy))


def check_start(motion: FreeMotion, row: Array, limits: Mapping[str, tuple[float, float]]) -> None:
    """MechanismError for a start outside a range, at a change point, or where nothing moves that has a mass."""
    for name, (low, high) in limits.items():
        place = row[motion.names.index(name)]
        if not low <= place <= high:
            what = f"begins at {place:g} (SI), outside its range from {low:g} to {high:g}"
            raise MechanismError(Finding(what, f"drivers.{name}.initial", "begin within the range"))
    at = Layout.of(motion).moment(np.zeros(1), row[:, None])
    for module, margin in zip(motion.meeting, motion.margins(motion.walk(at, np.zeros_like(at.q))), strict=True):
        if single(margin) < TOUCHING:
            links = ", ".join(motion.system.plan.modules[module].links)
            what = f"begins at a change point: two assembly modes of the links {links} coincide there"
            raise MechanismError(Finding(what, f"drivers.{motion.names[0]}.initial", "begin elsewhere"))
    if len(motion.names) != 1:
        return
    rows = np.repeat(row[:, None], 2, axis=1)
    rows[0, 1] += BESIDE * (1.0 if motion.system.turns(motion.names[0]) else motion.size)
    inertia, shifted = np.abs(motion.inertia(Layout.of(motion).moment(np.zeros(2), rows))[0, 0])
    if inertia < MASSLESS * shifted:
        what = "begins where nothing moves that has a mass, as at a dead centre, so that it has no acceleration there"
        remedy = "state the inertia of the link or the rotor that it turns, or begin elsewhere"
        raise MechanismError(Finding(what, f"drivers.{motion.names[0]}.initial", remedy))


def _heavy(motion: FreeMotion, link: str) -> bool:
    """Whether a link has a mass, and an inertia about every axis."""
    axes = [".xx", ".yy", ".zz"] if motion.system.spatial else [""]
    paths = [f"links.{link}.mass", *(f"links.{link}.inertia{axis}" for axis in axes)]
    return all(bool(np.any(motion.values.get(path, 0.0))) for path in paths)


def _findings(mechanism: Mechanism) -> Iterator[Finding]:
    free, playing = [name for name, driver in mechanism.drivers.items() if driver.found], in_play(mechanism)
    first = next(iter([*free, *mechanism.drivers]), "")
    where = f"drivers.{first}" if first else "drivers"
    if not free and not playing:
        what = "no driver is free, so there is no motion to find"
        yield Finding(what, where, "state a motor, such as motor: {kind: constant, effort: 4 N m}, or free: true")
        return
    ground, inert = f"links.{mechanism.fixed_link}.", (".mass", ".inertia")
    numbers = {path: value for path, value in mechanism.parameters().items() if not path.startswith(ground)}
    links = (path for path in numbers if path.startswith("links.") and any(part in path for part in inert))
    motors = (path for path in numbers if path.startswith("drivers.") and path.endswith(".motor.inertia"))
    if not any(np.any(numbers[path] != 0) for path in (*links, *motors)):
        remedy = "state a mass or an inertia of a link that it moves, or the inertia of its motor"
        yield Finding("no mass moves with it, so it has no acceleration", where, remedy)
    yield from _in_play(mechanism, playing)
    if len(free) < 2 and not playing:
        return
    for name in free:
        motor = mechanism.drivers[name].motor
        if motor is not None and motor.clutch is not None:
            what = "a clutch that may slip is solved with one free coordinate, and without joints in play"
            yield Finding(what, f"drivers.{name}.motor.clutch", "remove it, or let this driver alone be free")
    rough = next((name for name in playing if _is_rough(mechanism, name)), "")
    for where, joint in _resisting(mechanism, free):
        if joint in playing:
            yield Finding(f"it may hold joint {joint}, which is in play", where, "remove it, or the contact")
        elif rough:
            what = f"it may hold joint {joint} beside friction between rigid bodies in {rough}; how they share is not "
            what += "solved"
            remedy = f"leave out the friction in {rough}, or use laws that are smooth at rest: {', '.join(SMOOTH)}"
            yield Finding(what, where, remedy)
        elif PAIRS[mechanism.effective_joints[joint].type].count != 1:
            what = f"it may hold joint {joint}, which has more than one freedom, and {len(free)} coordinates are free"
            yield Finding(what, where, f"use a law that is smooth at rest: {', '.join(SMOOTH)}; or one free driver")


def _in_play(mechanism: Mechanism, playing: Sequence[str]) -> Iterator[Finding]:
    """What joints in play cannot have, nor those of their loops that chains of single turns and slides stand for."""
    joints, values = mechanism.effective_joints, mechanism.parameters()
    rigid = {name: contact.of.rigid for name in playing if (contact := joints[name].contact) is not None}
    if len(set(rigid.values())) > 1:
        other = next(name for name, is_rigid in rigid.items() if not is_rigid)
        what = "it is in play beside joints in play between rigid bodies"
        yield Finding(what, f"joints.{other}.contact.law", "use law: rigid for all joints in play, or for none")
    for name in playing:
        friction = joints[name].friction
        plain = ["coulomb"] if rigid[name] else [law for law in SMOOTH if FRICTION_LAWS[law].relaxation is None]
        if friction and friction.law and friction.law not in plain:
            what = f"the law {friction.law} is not one of a contact that comes and goes"
            yield Finding(what, f"joints.{name}.friction", f"use {' or '.join(plain)}")
    for name in of_several(mechanism):
        path, friction = f"joints.{name}", joints[name].friction
        rubs = any(values[f"{path}.friction.{key}"] != 0 for key in (friction.parameters if friction else ()))
        losing = joints[name].losses is not None
        springs = [f"springs.{spring}" for spring, entry in mechanism.springs.items() if entry.joint == name]
        for where in [*([f"{path}.friction"] * rubs), *([f"{path}.losses"] * losing), *springs]:
            what = f"it is not modelled in a {joints[name].type} joint of a loop with {', '.join(playing)} in play"
            yield Finding(what, where, "leave it out: 0 for friction, a spring between two points")


def _is_rough(mechanism: Mechanism, joint: str) -> bool:
    """Whether a joint in play between rigid bodies has friction."""
    contact = mechanism.effective_joints[joint].contact
    coefficient = mechanism.parameter_set.nominal.get(f"joints.{joint}.friction.coefficient", 0.0)
    return contact is not None and contact.of.rigid and coefficient != 0.0


def _resisting(mechanism: Mechanism, free: Sequence[str]) -> Iterator[tuple[str, str]]:
    """What may hold a joint at rest: its path, and the joint."""
    for name in free:
        motor = mechanism.drivers[name].motor
        if motor is not None and motor.efficiency is not None and motor.efficiency.source != 1:
            yield f"drivers.{name}.motor.efficiency", name
        if motor is not None and motor.brake is not None:
            yield f"drivers.{name}.motor.brake", name
    for name, joint in mechanism.effective_joints.items():
        law = joint.friction.law if joint.friction else None
        if law and joint.contact is None and FRICTION_LAWS[law].interval_at_rest:
            yield f"joints.{name}.friction", name
        if joint.losses is not None and joint.losses.constant is not None:
            yield f"joints.{name}.losses.constant", name
    for name, load in mechanism.loads.items():
        if load.joint is not None:
            yield f"loads.{name}", load.joint
