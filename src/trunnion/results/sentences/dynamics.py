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
    "simulate.restitution": Sentence(
        NOTE,
        "{joint}: with a stated restitution of {stated:.3g} the contact law {law} returns {returned:.3g}",
        "state law: restitution to get back what is stated",
    ),
    "simulate.energy": Sentence(
        WARNING,
        "works and energies differ by {share:.2g} of the energy turned over",
        "ask for a smaller --tolerance",
    ),
}
