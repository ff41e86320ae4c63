"""What is to be known of a motion in time: how it rests, locks or ends, and what of it is doubtful."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.findings import effort_units
from trunnion.dynamics.solution import Ended, Solution
from trunnion.dynamics.state import FreeMotion
from trunnion.dynamics.touching import SLOWEST
from trunnion.errors import Finding, Status, agreeing, counted
from trunnion.joints.contact import restitution_of
from trunnion.results.quantities import readable
from trunnion.solve.run import Run

__all__ = ["motion_findings", "stated_drivers", "undefined"]

Array = NDArray[np.float64]

DIFFERS = 0.01  # of a restitution, of a loss: a difference that is worth a note
FEW = 2  # contacts that begin slowly, of which nothing is said


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
    yield from _locks(motion, solution)
    name = next(iter(stated_drivers(motion, run)), next(iter(motion.system.mechanism.drivers)))
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
    place = f"coordinate {own['coordinate']:.6g}" if "coordinate" in own else ""
    state = f"{place}, rate {own['rate']:.6g}" if "rate" in own else place
    where, figures = f"drivers.{driver}", {**own, "driver": driver, "unit": unit, "time": ended.time}
    remedy = "check the forces there: one of them has no value, jumps, or grows without bound"
    match ended.code.removeprefix("simulate."):
        case "range":
            what = f"{driver} reaches {readable(own['coordinate'], unit)}, the end of its stated range, at {at}: the "
            what += "motion ends there"
            remedy = f"widen drivers.{driver}.range, or stop the motion before by a load or a brake"
            return Finding.warning("simulate.range", where, what, remedy, **figures)
        case "no_acceleration":
            what = f"there is no acceleration at {at} ({state}), as the mechanism locks itself under its inertia: the "
            what += f"effort that an acceleration takes (det ∂E/∂q̈) is {own['growth']:.4g} of that without friction, "
            what += "and must be above 0"
            remedy = "lower the friction or the inertia behind the joints that lock; see `trunnion locking`"
            return Finding.error("simulate.no_acceleration", where, what, remedy, **figures)
        case "unsolved":
            what = f"the accelerations are not found at {at} ({state})"
            return Finding.error("simulate.unsolved", where, what, remedy, **figures)
        case "step":
            what = f"the integration needs steps below rounding at {at} ({state})"
            return Finding.error("simulate.step", where, what, remedy, **figures)
        case "dead_centre":
            what = f"{driver} reaches its dead centre, {own['coordinate']:.6g} {unit}, at {at}: the links cannot be "
            what += f"assembled beyond it, and go on as {driver} reverses; the motion ends there"
            remedy = "drive a joint that has no dead centre there, or limit the motion by a stop or a load"
            return Finding.error("simulate.dead_centre", where, what, remedy, **figures)
        case "not_assembled":
            what = f"the links cannot be assembled beyond {at} ({place}): the motion ends there"
            remedy = "limit the motion by a stop or a load, or drive a joint that has no dead centre there"
            return Finding.error("simulate.not_assembled", where, what, remedy, **figures)
        case "events":
            what = f"there are {own['count']:.0f} events up to {at}: the motion is not followed farther"
            remedy = "ask for a shorter time"
            return Finding.error("simulate.events", where, what, remedy, **figures)
        case "change_point":
            what = f"at {at}, at {readable(own['coordinate'], unit)} of {driver}, the links {', '.join(own['links'])} "
            what += "come to a change point, where two of their assembly modes coincide: neither reactions nor what "
            what += "follows are determined, and the motion ends there"
            remedy = f"change a length, or stop the motion before it by drivers.{driver}.range, a load or a brake"
            return Finding.error("simulate.change_point", where, what, remedy, **figures)
        case "evaluations":
            what = f"{own['count']:,} evaluations of the forces are used up at {at} of {readable(own['of'], 's')}: the "
            what += "motion ends there"
            remedy = "look for a stiff spring, damper or contact on a small mass; ask for a shorter --time or more "
            remedy += "--evaluations"
            return Finding.error("simulate.evaluations", where, what, remedy, **figures)
        case _:
            what = f"there are no forces or impulses of the contacts that touch at {at} ({state}) under which nothing "
            what += "sinks in (Painlevé's paradox): the motion is kept until then"
            remedy = "lower the friction of the joints in play, or state a stiffness instead of law: rigid"
            return Finding.error("simulate.no_contact_force", where, what, remedy, **figures)


def _locks(motion: FreeMotion, solution: Solution) -> Iterator[Finding]:
    """What locks as it runs."""
    locks = [event for event in solution.events if event.kind == "lock"]
    if not locks:
        return
    joints, times = list(dict.fromkeys(event.of for event in locks)), len({event.time for event in locks})
    energy = float(np.nansum([event.figure for event in locks]))
    what = f"{', '.join(joints)} {agreeing(len(joints), 'locks', 'lock')} as the mechanism runs, "
    what += f"{counted(times, 'time')}, first at {readable(locks[0].time, 's')}: "
    what += f"{agreeing(len(joints), 'it stops', 'they stop')} at once, and {readable(energy, 'J')} is lost"
    remedy = "see `trunnion locking` for where and by how much"
    figures = {"joints": joints, "times": times, "time": locks[0].time, "energy": energy}
    if motion.several:
        yield Finding.warning("simulate.joints_lock", f"joints.{joints[0]}", what, remedy, **figures)
    else:
        yield Finding.warning("simulate.locks", f"drivers.{joints[0]}", what, remedy, **figures)


def _rests(motion: FreeMotion, solution: Solution, name: str) -> Iterator[Finding]:
    """What holds it where it rests at the end."""
    rests = [event.time for event in solution.events if event.kind == "rest"]
    if not (rests and solution.stretches and solution.stretches[-1].resting):
        return
    last = solution.stretches[-1]
    at = last.at(solution.layout, np.array([last.begin]))
    if motion.several:
        shares = np.abs(np.asarray(motion.accelerate(at).shares)[:, 0])
        joint, share = motion.resisted[int(np.argmax(shares))], float(np.max(shares))
        where, subject = f"joints.{joint}", "every free driver"
        acts = f"what acts needs {share:.2%} of what resists it at rest in {joint}, and no more in the other joints"
        figures: dict[str, Any] = {"joint": joint, "share": share}
    else:
        effort = effort_units(motion.system)[list(motion.system.mechanism.drivers).index(name)]
        acting, (forward, backward) = float(motion.given(at, 0.0 * at.q, {})[0, 0]), motion.excess(at)[:, 0]
        needed = acting - forward if acting > 0 or (acting == 0 and forward >= backward) else acting + backward
        where, subject = f"drivers.{name}", name
        acts = f"{readable(acting, effort)} act on it, and it breaks away from {readable(needed, effort)} on"
        figures = {"driver": name, "given": acting, "needed": needed, "unit": effort}
    since = readable(rests[-1], "s")
    if all(stretch.resting for stretch in solution.stretches):
        remedy = "use a stronger motor or a gear, lower the friction, or begin elsewhere"
        what = f"{subject} does not start: {acts}"
        if motion.several:
            yield Finding.warning("simulate.none_starts", where, what, remedy, **figures)
        else:
            yield Finding.warning("simulate.stays_at_rest", where, what, remedy, **figures)
    elif on := _on(motion, solution):
        turns, place = motion.system.turns(motion.names[0]), float(at.q[0, 0])
        place, unit = (place % (2 * np.pi), "rad") if turns else (place, "m")
        at_place, of = (f", at {readable(place, unit)}", "") if not motion.several else ("", f" of {', '.join(on)}")
        what = f"{subject} stalls at {since}{at_place}, with the motor{of} on: {acts}"
        remedy = "use a larger flywheel, a stronger motor or a gear, or lower the load there"
        figures["time"] = rests[-1]
        if motion.several:
            yield Finding.error("simulate.all_stall", where, what, remedy, **figures, drivers=on)
        else:
            yield Finding.error("simulate.stalls", where, what, remedy, **figures, coordinate=place, place=unit)
    else:
        what = f"{subject} comes to rest {counted(len(rests), 'time')}, for the last time at {since}: {acts}"
        figures |= {"time": rests[-1], "times": len(rests)}
        if motion.several:
            yield Finding.note("simulate.all_rest", where, what, **figures)
        else:
            yield Finding.note("simulate.rests", where, what, **figures)


def _on(motion: FreeMotion, solution: Solution) -> list[str]:
    """The free drivers whose motor still acts at the end, through its clutch if it has one, and is not braked."""
    last, time = solution.stretches[-1], np.array([solution.end])
    at = solution.layout.moment(time, solution.at(time)[0], last.mode)
    return [
        name
        for i, (name, drive) in enumerate(motion.drives.items())
        if not drive.braking(at.now)
        and np.any(drive.seen(at.now, at.slips).shaft(time, at.rate[i], at.integral[i], at.now) != 0.0)
    ]


def _of_contacts(motion: FreeMotion, run: Run, solution: Solution) -> Iterator[Finding]:
    """What the laws of the contacts return, where that is not what was stated; how deep soft surfaces sink in; what is
    lost in contacts that begin so slowly that their law is not followed."""
    for contact in motion.contacts.each:
        where = f"joints.{contact.joint}.contact"
        of_contact = [impact for impact in solution.impacts if impact.label == contact.label]
        slow = [impact for impact in of_contact if impact.approach < SLOWEST]
        lost, total = (sum(impact.loss for impact in group) for group in (slow, of_contact))
        if len(slow) > FEW and lost > DIFFERS * total:
            what = f"{contact.label}: {len(slow)} of {len(of_contact)} contacts begin slower than "
            what += f"{readable(SLOWEST, 'm/s')} and are treated as beginning at that speed; {lost / total:.2%} of "
            what += "what the contact law loses is lost in them"
            remedy = "compare with another restitution: the law is one of impacts, and tells little of slow pressing"
            yield Finding.note("simulate.slow_onsets", where, what, remedy, count=len(slow), share=lost / total)
        depth = max((impact.depth for impact in of_contact), default=0.0)
        if depth > contact.clearance:
            what = f"{contact.label}: the surfaces sink {readable(depth, 'm')} into each other, more than the "
            what += f"clearance of {readable(contact.clearance, 'm')}"
            remedy = "check the stiffness of the contact; a contact law holds for small penetrations"
            yield Finding.warning("simulate.soft", where, what, remedy, depth=depth, clearance=contact.clearance)
    for contact in {contact.joint: contact for contact in motion.contacts.each}.values():
        law = run.system.mechanism.effective_joints[contact.joint].contact
        returned = restitution_of(contact.factor)
        if law is not None and not law.of.rigid and abs(returned - contact.restitution) > DIFFERS:
            what = f"{contact.joint}: with a stated restitution of {contact.restitution:.3g} the contact law {law.law} "
            what += f"returns {returned:.3g}"
            remedy = "state law: restitution to get back what is stated"
            figures = {"joint": contact.joint, "stated": contact.restitution, "returned": returned}
            yield Finding.note("simulate.restitution", f"joints.{contact.joint}.contact", what, remedy, **figures)
