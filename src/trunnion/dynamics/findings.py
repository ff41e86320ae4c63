"""What motion in time cannot do for a mechanism, and what is to be known of a motion: how it rests, locks or ends."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import single
from trunnion.cycle.findings import effort_units
from trunnion.dynamics.opened import in_play, of_several
from trunnion.dynamics.rates import Layout
from trunnion.dynamics.solution import Ended, Solution
from trunnion.dynamics.state import FreeMotion
from trunnion.errors import Finding, MechanismError, Status, counted
from trunnion.joints.contact import restitution_of
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.model.mechanism import Mechanism
from trunnion.results.quantities import readable
from trunnion.solve.run import Run
from trunnion.solve.track import TOUCHING

Array = NDArray[np.float64]

SINGULAR = 1e12  # condition of a mass matrix, coordinates by what is typical of each, that is none
BESIDE, MASSLESS = 0.1, 1e-15  # rad, or of the size: how far from the start more inertia may be; a share that is none
SMOOTH = [name for name, law in FRICTION_LAWS.items() if not law.interval_at_rest]
DIFFERS = 0.01  # of a restitution: a difference that is worth a note


# ---- before it begins -------------------------------------------------------------------------------------------


def refuse(mechanism: Mechanism) -> None:
    """MechanismError with what keeps a mechanism from being let move."""
    if findings := list(_refused(mechanism)):
        raise MechanismError(findings)


def refuse_undetermined(run: Run, playing: Sequence[str] = ()) -> None:
    """MechanismError where the joints of a mechanism in space do not determine its motion or its reactions. playing:
    joints in play, without which it is."""
    determinacy = run.determinacy
    redundant = [joint for part in determinacy.parts if part.redundant for joint in part.joints] if determinacy else []
    if redundant and playing:
        what = f"{', '.join(redundant)} constrain each other more than once also while {', '.join(playing)} is in play"
        raise MechanismError(Finding(what, "joints", "use a joint with more freedoms there (cylindrical, spherical)"))
    if determinacy is not None:
        determinacy.refuse()


def check_start(motion: FreeMotion, row: Array, limits: Mapping[str, tuple[float, float]]) -> None:
    """MechanismError for a start outside a range, at a change point, or where nothing moves that has a mass."""

    def refused(name: str, what: str) -> MechanismError:
        return MechanismError(Finding(f"begins {what}", f"drivers.{name}.initial", "begin elsewhere"))

    for name, (low, high) in limits.items():
        place = row[motion.names.index(name)]
        if not low <= place <= high:
            raise refused(name, f"at {place:g} (SI), outside its range from {low:g} to {high:g}")
    layout, first = Layout.of(motion), motion.names[0]
    at = layout.moment(np.zeros(1), row[:, None])
    for module, margin in zip(motion.meeting, motion.margins(motion.walk(at)), strict=True):
        if single(margin) < TOUCHING:
            links = ", ".join(motion.system.plan.modules[module].links)
            raise refused(first, f"at a change point: two assembly modes of the links {links} coincide there")
    rows = np.repeat(row[:, None], 2, axis=1)
    rows[0, 1] += BESIDE * (1.0 if motion.system.turns(first) else motion.size)
    mass, nearby = np.moveaxis(motion.inertia(layout.moment(np.zeros(2), rows)) * motion.unit[:, None], -1, 0)
    inertia, beside = (np.abs(np.diag(np.nan_to_num(matrix))) for matrix in (mass, nearby))
    scale = np.sqrt(inertia)
    none = np.any(inertia <= MASSLESS * beside) or np.linalg.cond(mass / scale[:, None] / scale) >= SINGULAR
    if not (none and np.all(np.isfinite(mass))):
        return
    keys = ["mass", *(f"inertia{axis}" for axis in ([".xx", ".yy", ".zz"] if motion.system.spatial else [""]))]
    moving = [link for link in motion.system.mechanism.links if link != motion.system.mechanism.fixed_link]
    light = [link for link in moving if not all(np.any(motion.values.get(f"links.{link}.{key}", 0.0)) for key in keys)]
    what = "nothing moves that has a mass with some coordinate where it begins (no mass or no inertia: "
    what += f"{', '.join(light) or 'none'}; a dead centre is such a place): it has no acceleration there"
    where = f"links.{light[0]}" if motion.contacts and light else f"drivers.{first}"
    raise MechanismError(Finding(what, where, "state the mass and inertia of its links, or begin elsewhere"))


def _refused(mechanism: Mechanism) -> Iterator[Finding]:
    free, playing = [name for name, driver in mechanism.drivers.items() if driver.found], in_play(mechanism)
    first = next(iter([*free, *mechanism.drivers]), "")
    where = f"drivers.{first}" if first else "drivers"
    if not free and not playing:
        what = "no driver is free, so there is no motion to find"
        yield Finding(what, where, "state a motor, such as motor: {kind: constant, effort: 4 N m}, or free: true")
        return
    yield from _in_play(mechanism, playing)
    if len(free) < 2 and not playing:
        return
    values, joints = mechanism.parameter_set.nominal, mechanism.effective_joints
    rough = any(contact.of.rigid and values.get(f"joints.{name}.friction.coefficient", 0.0) != 0.0
                for name in playing if (contact := joints[name].contact) is not None)  # fmt: skip
    for where, joint in _resisting(mechanism, free):
        if where.endswith(".clutch") or joint in playing or rough or joints[joint].pair.count != 1:
            what = f"it may slip or hold joint {joint}, and more than one coordinate is free: this is not solved for a "
            what += "clutch, a joint in play or of several freedoms, nor beside friction between rigid bodies in play"
            yield Finding(what, where, f"leave it out, or use a law that is smooth at rest: {', '.join(SMOOTH)}")


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


def _resisting(mechanism: Mechanism, free: Sequence[str]) -> Iterator[tuple[str, str]]:
    """What may slip, or hold a joint at rest: its path, and the joint."""
    for name in free:
        if (motor := mechanism.drivers[name].motor) is not None:
            losing = motor.efficiency is not None and motor.efficiency.source != 1
            parts = {"clutch": motor.clutch is not None, "efficiency": losing, "brake": motor.brake is not None}
            yield from ((f"drivers.{name}.motor.{key}", name) for key, resists in parts.items() if resists)
    for name, joint in mechanism.effective_joints.items():
        law = joint.friction.law if joint.friction else None
        if law and joint.contact is None and FRICTION_LAWS[law].interval_at_rest:
            yield f"joints.{name}.friction", name
        if joint.losses is not None and joint.losses.constant is not None:
            yield f"joints.{name}.losses.constant", name
    for name, load in mechanism.loads.items():
        if load.joint is not None:
            yield f"loads.{name}", load.joint


# ---- of a motion ------------------------------------------------------------------------------------------------


def stated_drivers(motion: FreeMotion, run: Run) -> list[str]:
    """The free drivers that the file states."""
    return [name for name in motion.names if name in run.system.mechanism.drivers]


def motion_findings(motion: FreeMotion, solution: Solution, run: Run) -> Iterator[Finding]:
    """What is to be known of a motion. run: of the mechanism as it is stated."""
    yield from (finding for finding in motion.run.chosen.findings if finding.code != "assembly.change_point")
    if centred := [finding.joint for finding in motion.run.seats]:
        what = f"pins of {', '.join(centred)} are taken in the middle of their holes: a seat that follows the load is "
        what += "left out"
        yield Finding.note("simulate.centred", "", what, joints=centred)
    yield from _of_contacts(motion, run, solution)
    if several := solution.notes.get("simulate.several_accelerations"):
        what = f"from {readable(several['time'], 's')} on there are several accelerations: friction that grows with "
        what += "the acceleration allows others than that which is followed (Painlevé's paradox)"
        remedy = "lower the friction or the inertia behind the joints that could lock"
        yield Finding.warning("simulate.several_accelerations", "joints", what, remedy, **several)
    if lowered := solution.notes.get("simulate.restitution_lowered"):
        what = f"in {counted(lowered['times'], 'impact')}, the first at {readable(lowered['time'], 's')}, the stated "
        what += "restitution would gain energy by friction, or the impacts have no end: the restitution is lowered "
        what += f"there, to {lowered['share']:.3g} of itself at the most"
        yield Finding.note("simulate.restitution_lowered", "joints", what, **lowered)
    if passed := [event.time for event in solution.events if event.kind == "change-point"]:
        what = f"change points are passed {counted(len(passed), 'time')}, first at {readable(passed[0], 's')}, with "
        what += "the velocities that the links have: reactions have no bound there, so that no largest ones are told"
        yield Finding.warning("simulate.passed", "assembly", what, times=len(passed), time=passed[0])
    if locks := [event for event in solution.events if event.kind == "lock"]:
        joints, times = list(dict.fromkeys(event.of for event in locks)), len({event.time for event in locks})
        energy = float(np.nansum([event.figure for event in locks]))
        what = f"{counted(times, 'time')}, first at {readable(locks[0].time, 's')}, friction locks {', '.join(joints)} "
        what += f"as the mechanism runs, which stops at once, and {readable(energy, 'J')} is lost"
        where, remedy = f"{'joints' if motion.several else 'drivers'}.{joints[0]}", "see `trunnion locking` for where"
        figures = {"joints": joints, "times": times, "time": locks[0].time, "energy": energy}
        yield Finding.warning("simulate.locks", where, what, remedy, **figures)
    name = next(iter(stated_drivers(motion, run)), next(iter(motion.system.mechanism.drivers)))
    if solution.stretches and solution.stretches[-1].resting:
        yield from _rests(motion, solution, name)
    if solution.ended is not None:
        driver = solution.ended.figures.get("driver", name)
        yield _end(solution.ended, driver, "rad" if motion.system.turns(driver) else "m")


def undefined(time: Array, status: NDArray[Any]) -> Iterator[Finding]:
    """Rows of a motion that goes on, without forces. time: s, and the status of each row."""
    rows = np.flatnonzero(status == Status.LOAD_UNDEFINED)
    if len(rows):
        first = float(time[rows[0]])
        what = f"a load or spring has no value in {counted(len(rows), 'row')} of the result, first at "
        what += f"{readable(first, 's')}: there are no forces there"
        remedy = "extend its tables, check divisions and roots; the line of a spring has no direction where its ends "
        remedy += "coincide"
        yield Finding.error("simulate.undefined", "loads", what, remedy, count=len(rows), time=first)


def _end(ended: Ended, driver: str, unit: str) -> Finding:
    """Why a motion ended before its time. driver: the one concerned; unit: of its coordinate."""
    at, own = readable(ended.time, "s"), ended.figures
    state = ", ".join(f"{key} {own[key]:.6g}" for key in ("coordinate", "rate") if key in own)
    where, figures = f"drivers.{driver}", {**own, "driver": driver, "unit": unit, "time": ended.time}
    forces = "check the forces there: one of them has no value, jumps, or grows without bound"
    dead = "limit the motion by a stop or a load, or drive a joint that has no dead centre there"
    match ended.code.removeprefix("simulate."):
        case "range":
            what = f"{driver} reaches {readable(own['coordinate'], unit)}, the end of its stated range, at {at}"
            remedy = f"widen drivers.{driver}.range, or stop the motion before by a load or a brake"
            return Finding.warning("simulate.range", where, what, remedy, **figures)
        case "no_acceleration":
            what = f"there is no acceleration at {at} ({state}), as the mechanism locks itself under its inertia: the "
            what += f"effort that an acceleration takes (det ∂E/∂q̈) is {own['growth']:.4g} of that without friction, "
            what += "and must be above 0"
            remedy = "lower the friction or the inertia behind the joints that lock; see `trunnion locking`"
            return Finding.error("simulate.no_acceleration", where, what, remedy, **figures)
        case "unsolved" | "step" | "events":
            what = f"the motion is not found beyond {at} ({state})"
            return Finding.error("simulate.unsolved", where, what, forces, **figures)
        case "dead_centre":
            what = f"{driver} reaches its dead centre, {own['coordinate']:.6g} {unit}, at {at}: the links cannot be "
            what += f"assembled beyond it, and go on as {driver} reverses"
            return Finding.error("simulate.dead_centre", where, what, dead, **figures)
        case "not_assembled":
            what = f"the links cannot be assembled beyond {at} ({state})"
            return Finding.error("simulate.not_assembled", where, what, dead, **figures)
        case "change_point":
            what = f"at {at}, at {readable(own['coordinate'], unit)} of {driver}, the links {', '.join(own['links'])} "
            what += "come to a change point, where two of their assembly modes coincide: neither reactions nor what "
            what += "follows are determined"
            remedy = f"change a length, or stop the motion before it by drivers.{driver}.range, a load or a brake"
            return Finding.error("simulate.change_point", where, what, remedy, **figures)
        case "evaluations":
            what = f"{own['count']:,} evaluations of the forces are used up at {at} of {readable(own['of'], 's')}"
            remedy = "look for a stiff spring, damper or contact on a small mass; ask for more --evaluations"
            return Finding.error("simulate.evaluations", where, what, remedy, **figures)
        case _:
            what = f"there are no forces or impulses of the contacts that touch at {at} ({state}) under which nothing "
            what += "sinks in (Painlevé's paradox)"
            remedy = "lower the friction of the joints in play, or state a stiffness instead of law: rigid"
            return Finding.error("simulate.no_contact_force", where, what, remedy, **figures)


def _rests(motion: FreeMotion, solution: Solution, name: str) -> Iterator[Finding]:
    """What holds it where it rests at the end."""
    last, rests = solution.stretches[-1], [event.time for event in solution.events if event.kind == "rest"]
    at = last.at(solution.layout, np.array([last.begin]))
    figures: dict[str, Any]
    if motion.several:
        shares = np.abs(np.asarray(motion.accelerate(at).shares)[:, 0])
        joint, share = motion.resisted[int(np.argmax(shares))], float(np.max(shares))
        where, subject, at_place = f"joints.{joint}", "every free driver", ""
        acts = f"what acts needs {share:.2%} of what resists it at rest in {joint}, and no more in the other joints"
        figures = {"joint": joint, "share": share}
    else:
        effort = effort_units(motion.system)[list(motion.system.mechanism.drivers).index(name)]
        acting, (forward, backward) = float(motion.given(at, 0.0 * at.q, {})[0, 0]), motion.excess(at)[:, 0]
        needed = acting - forward if acting > 0 or (acting == 0 and forward >= backward) else acting + backward
        turns, place = motion.system.turns(motion.names[0]), float(at.q[0, 0])
        place, unit = (place % (2 * np.pi), "rad") if turns else (place, "m")
        where, subject, at_place = f"drivers.{name}", name, f", at {readable(place, unit)}"
        acts = f"{readable(acting, effort)} act on it, and it breaks away from {readable(needed, effort)} on"
        figures = {
            "driver": name,
            "given": acting,
            "needed": needed,
            "unit": effort,
            "coordinate": place,
            "place": unit,
        }
    since, final = readable(rests[-1], "s"), last.at(solution.layout, np.array([solution.end]))
    on = [
        driver
        for i, (driver, drive) in enumerate(motion.drives.items())
        if not drive.braking(final.now)
        and np.any(drive.seen(final.now, final.slips).shaft(final.time, final.rate[i], final.integral[i], final.now))
    ]  # motors that give an effort, without a brake
    if all(stretch.resting for stretch in solution.stretches):
        remedy = "use a stronger motor or a gear, lower the friction, or begin elsewhere"
        yield Finding.warning("simulate.stays_at_rest", where, f"{subject} does not start: {acts}", remedy, **figures)
    elif on:
        what = f"{subject} stalls at {since}{at_place}, with the motor of {', '.join(on)} on: {acts}"
        remedy = "use a larger flywheel, a stronger motor or a gear, or lower the load there"
        yield Finding.error("simulate.stalls", where, what, remedy, **figures, time=rests[-1], drivers=on)
    else:
        what = f"{subject} comes to rest {counted(len(rests), 'time')}, for the last time at {since}: {acts}"
        yield Finding.note("simulate.rests", where, what, **figures, time=rests[-1], times=len(rests))


def _of_contacts(motion: FreeMotion, run: Run, solution: Solution) -> Iterator[Finding]:
    """What the laws of the contacts return, where that is not what was stated; how deep soft surfaces sink in."""
    for contact in motion.contacts:
        depth = max((impact.depth for impact in solution.impacts if impact.label == contact.label), default=0.0)
        if depth > contact.clearance:
            what = f"{contact.label}: the surfaces sink {readable(depth, 'm')} into each other, more than the "
            what += f"clearance of {readable(contact.clearance, 'm')}; a contact law holds for small penetrations"
            where, remedy = f"joints.{contact.joint}.contact", "check the stiffness of the contact"
            yield Finding.warning("simulate.soft", where, what, remedy, depth=depth, clearance=contact.clearance)
    for contact in {contact.joint: contact for contact in motion.contacts}.values():
        law = run.system.joints[contact.joint].contact
        returned = restitution_of(contact.factor)
        if law is not None and not law.of.rigid and abs(returned - contact.restitution) > DIFFERS:
            what = f"{contact.joint}: with a stated restitution of {contact.restitution:.3g} the contact law {law.law} "
            what += f"returns {returned:.3g}"
            remedy = "state law: restitution to get back what is stated"
            figures = {"joint": contact.joint, "stated": contact.restitution, "returned": returned}
            yield Finding.note("simulate.restitution", f"joints.{contact.joint}.contact", what, remedy, **figures)
