"""Sentences about motion in time."""

from __future__ import annotations

from trunnion.results.sentences.sentence import ERROR, NOTE, WARNING, Sentence

__all__ = ["DYNAMICS"]

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
    "simulate.range": Sentence(
        WARNING,
        "{driver} reaches {coordinate:.6g} {unit}, the end of its stated range, at {time:~s}: the motion ends there",
        "widen drivers.{driver}.range, or stop the motion before by a load or a brake",
    ),
    "simulate.no_acceleration": Sentence(
        ERROR,
        "there is no acceleration, or there are several, at {time:~s} (coordinate {coordinate:.6g}, rate {rate:.6g}): "
        "friction grows faster with the acceleration than what drives it",
        "lower the friction or the inertia behind the joints that lock; see `trunnion locking`",
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
    "simulate.events": Sentence(
        ERROR,
        "there are {count:.0f} events up to {time:~s}: the motion is not followed farther",
        "ask for a shorter time",
    ),
    "simulate.stopped": Sentence(WARNING, "stopped at {time:~s}: the motion until then is kept"),
    "simulate.locks": Sentence(
        WARNING,
        "the mechanism locks as it runs, at {time:~s}: it stops at once, and loses {energy:~J}",
        "see `trunnion locking` for where and by how much",
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
        "in {times:#impact}, the first at {time:~s}, friction and the stated restitution would gain energy: the "
        "restitution is lowered there, to {share:.3g} of itself at the most",
    ),
    "simulate.stepped": Sentence(
        WARNING,
        "there are impacts without end at {time:~s}: from there on the motion is stepped by Moreau's scheme, in steps "
        "of {step:~s}; it is exact to the first order of the step",
        "compare with half the step: --impact-step",
    ),
    "simulate.energy_stepped": Sentence(
        NOTE,
        "stepped by Moreau's scheme, works and energies differ by {share:.2g} of the energy turned over",
        "ask for a smaller --impact-step",
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
