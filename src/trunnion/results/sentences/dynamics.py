"""Sentences about motion in time."""

from __future__ import annotations

from math import isfinite

from trunnion.results.quantities import readable
from trunnion.results.sentences.sentence import ERROR, NOTE, WARNING, Sentence

__all__ = ["DYNAMICS"]


def _exhausted(time: float, count: int, of: float, constant: float, causes: list[str]) -> str:
    ends = f"{count:,} evaluations of the forces are used up at {readable(time, 's')} of {readable(of, 's')}: "
    if not isfinite(constant):
        return f"{ends}the motion ends there"
    why = f", by {' and '.join(causes)}" if causes else ""
    share = f"{of / constant:.3g} of which fit into the stated time"
    return f"{ends}the motion ends there. Its shortest time constant is {readable(constant, 's')}{why}, {share}"


DYNAMICS: dict[str, Sentence] = {
    "simulate.stays_at_rest": Sentence(
        WARNING,
        "{driver} does not start: {given:~{unit}} act on it, and it breaks away from {needed:~{unit}} on",
        "use a stronger motor or a gear, lower the friction, or begin elsewhere",
    ),
    "simulate.rests": Sentence(
        NOTE,
        "{driver} comes to rest {times:#time}, for the last time at {time:~s}: {given:~{unit}} act on it then, "
        "and it breaks away from {needed:~{unit}} on",
    ),
    "simulate.stalls": Sentence(
        ERROR,
        "{driver} stalls at {time:~s}, at {coordinate:~{place}}, with the motor on: {given:~{unit}} act on it then, "
        "and it breaks away from {needed:~{unit}} on",
        "use a larger flywheel, a stronger motor or a gear, or lower the load there",
    ),
    "simulate.none_starts": Sentence(
        WARNING,
        "nothing starts: what acts needs {share:.2%} of what resists it at rest in {joint}, and no more in the other "
        "joints",
        "use a stronger motor or a gear, lower the friction, or begin elsewhere",
    ),
    "simulate.all_rest": Sentence(
        NOTE,
        "all free drivers come to rest {times:#time}, for the last time at {time:~s}: what acts then needs {share:.2%} "
        "of what resists it at rest in {joint}, and no more in the other joints",
    ),
    "simulate.all_stall": Sentence(
        ERROR,
        "all free drivers rest from {time:~s} on, with the motor of {drivers} on: what acts then needs {share:.2%} of "
        "what resists it at rest in {joint}, and no more in the other joints",
        "use a larger flywheel, a stronger motor or a gear, or lower the load there",
    ),
    "simulate.range": Sentence(
        WARNING,
        "{driver} reaches {coordinate:~{unit}}, the end of its stated range, at {time:~s}: the motion ends there",
        "widen drivers.{driver}.range, or stop the motion before by a load or a brake",
    ),
    "simulate.no_acceleration": Sentence(
        ERROR,
        "there is no acceleration at {time:~s} (coordinate {coordinate:.6g}, rate {rate:.6g}), as the mechanism locks "
        "itself under its inertia: the effort that an acceleration takes (det ∂E/∂q̈) is {growth:.4g} of that without "
        "friction, and must be above 0",
        "lower the friction or the inertia behind the joints that lock; see `trunnion locking`",
    ),
    "simulate.unsolved": Sentence(
        ERROR,
        "the accelerations are not found at {time:~s} (coordinate {coordinate:.6g}, rate {rate:.6g})",
        "check the forces there: one of them has no value, jumps, or grows without bound",
    ),
    "simulate.dead_centre": Sentence(
        ERROR,
        "{driver} reaches its dead centre, {coordinate:.6g} {unit}, at {time:~s}: the links cannot be assembled beyond "
        "it, and go on as {driver} reverses; the motion ends there",
        "drive a joint that has no dead centre there, or limit the motion by a stop or a load",
    ),
    "simulate.not_assembled": Sentence(
        ERROR,
        "the links cannot be assembled beyond {time:~s} (coordinate {coordinate:.6g}): the motion ends there",
        "limit the motion by a stop or a load, or drive a joint that has no dead centre there",
    ),
    "simulate.step": Sentence(
        ERROR,
        "the integration needs steps below rounding at {time:~s} (coordinate {coordinate:.6g}, rate {rate:.6g})",
        "check the forces there: one of them jumps or grows without bound",
    ),
    "simulate.undefined": Sentence(
        ERROR,
        "a load or spring has no value in {count:#row} of the result, first at {time:~s}: there are no forces there",
        "extend its tables, check divisions and roots; the line of a spring has no direction where its ends coincide",
    ),
    "simulate.events": Sentence(
        ERROR,
        "there are {count:.0f} events up to {time:~s}: the motion is not followed farther",
        "ask for a shorter time",
    ),
    "simulate.not_round": Sentence(
        ERROR,
        "there is no steady cycle: {driver} makes {turns:.3g} turns in {time:~s} and does not go round at the end",
        "run it without --steady to see the start; give it more --time if it has not run up",
    ),
    "simulate.not_repeating": Sentence(
        ERROR,
        "there is no steady cycle: the speed of {driver}, {speed:~rad/s} after {time:~s}, changes by {change:~rad/s} a "
        "turn, and no speed is found that comes back",
        "check that its losses grow with the speed or that its motor's effort falls; or give it more --time",
    ),
    "simulate.unstable": Sentence(
        WARNING,
        "the steady cycle is not stable: a difference from it grows by the factor {factor:.4g} with every cycle",
        "run it without --steady to see how it leaves this cycle",
    ),
    "simulate.cycle_differs": Sentence(
        ERROR,
        "the cycle takes efforts that differ from those of the motors by up to {share:.2g} of the largest: it is not "
        "the motion that was found",
        "run it without --steady to see the motion from its start",
    ),
    "simulate.change_point": Sentence(
        ERROR,
        "at {time:~s}, at {coordinate:~{unit}} of {driver}, the links {links} come to a change point, where two of "
        "their assembly modes coincide: neither reactions nor what follows are determined, and the motion ends there",
        "change a length, or stop the motion before it by drivers.{driver}.range, a load or a brake; or pass it "
        "with the velocities that the links have: --pass-change-points",
    ),
    "simulate.passed": Sentence(
        WARNING,
        "change points are passed {times:#time}, first at {time:~s}, with the velocities that the links have: "
        "reactions have no bound there, so that no largest ones are told",
    ),
    "simulate.evaluations": Sentence(
        ERROR,
        _exhausted,
        "check what makes it so fast, ask for a shorter --time or more --evaluations",
    ),
    "simulate.locks": Sentence(
        WARNING,
        "the mechanism locks as it runs, at {time:~s}: it stops at once, and loses {energy:~J}",
        "see `trunnion locking` for where and by how much",
    ),
    "simulate.joints_lock": Sentence(
        WARNING,
        "{joints} {count:#locks/lock} as the mechanism runs, {times:#time}, first at {time:~s}: {count:#it stops/they "
        "stop} at once, {energy:~J} is lost, and what is still free moves on",
        "see `trunnion locking` for where and by how much",
    ),
    "simulate.several_accelerations": Sentence(
        WARNING,
        "from {time:~s} on there are several accelerations: friction that grows with the acceleration allows others "
        "than that which is followed (Painlevé's paradox)",
        "lower the friction or the inertia behind the joints that could lock",
    ),
    "simulate.centred": Sentence(
        NOTE,
        "pins of {joints} are taken in the middle of their holes: a seat that follows the load is left out",
        quiet=True,
    ),
    "simulate.soft": Sentence(
        WARNING,
        "{contact}: the surfaces sink {depth:~m} into each other, more than the clearance of {clearance:~m}",
        "check the stiffness of the contact; a contact law holds for small penetrations",
    ),
    "simulate.slow_onsets": Sentence(
        NOTE,
        "{contact}: {count:.0f} of {of:.0f} contacts begin slower than {slowest:~m/s} and are treated as beginning at "
        "that speed; {share:.2%} of what the contact law loses is lost in them",
        "compare with another restitution: the law is one of impacts, and tells little of slow pressing",
    ),
    "simulate.restitution": Sentence(
        NOTE,
        "{joint}: with a stated restitution of {stated:.3g} the contact law {law} returns {returned:.3g}",
        "state law: restitution to get back what is stated",
    ),
    "simulate.restitution_lowered": Sentence(
        NOTE,
        "in {times:#impact}, the first at {time:~s}, the stated restitution would gain energy by friction, or the "
        "impacts have no end: the restitution is lowered there, to {share:.3g} of itself at the most",
    ),
    "simulate.no_contact_force": Sentence(
        ERROR,
        "there are no forces or impulses of the contacts that touch at {time:~s} (coordinate {coordinate:.6g}, rate "
        "{rate:.6g}) under which nothing sinks in (Painlevé's paradox): the motion is kept until then",
        "lower the friction of the joints in play, or state a stiffness instead of law: rigid",
    ),
    "simulate.energy": Sentence(
        WARNING,
        "works and energies differ by {share:.2g} of the energy turned over",
        "ask for a smaller --tolerance",
    ),
}
