"""Sentences about a cycle: what the model leaves out, loads, friction, dead centres, seats."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from trunnion.errors import agreeing
from trunnion.results.quantities import between, readable
from trunnion.results.sentences.sentence import ERROR, NOTE, WARNING, Sentence

__all__ = ["CYCLE"]

NEXT = 1e-3  # of the multiple at which one group locks: another that locks at less is told beside it


def _centred(joints: Sequence[str], seatable: Sequence[str]) -> str:
    """What may be stated instead of pins in the middle of their play; seatable: where a seat may be taken."""
    if not seatable:
        return "see `trunnion play` for the effect of the play, `trunnion assemble` for whether the links fit together"
    of = f" of {', '.join(seatable)}" if len(seatable) < len(joints) else ", or analyse with --seat loaded"
    return f"for pins pressed to one side by their loads state seat: loaded{of}"


def _locked(
    at: str, share: float, joints: Sequence[str], reverse: str, decides: str, multiple: float | None, whole: float
) -> str:
    at_most = f"there is a solution only up to {share:.4g} times the friction of {', '.join(joints)}"
    jammed = {"": "", "all": "; driven backward it locks there too (jammed)"}
    return f"locked by friction {at}: {at_most}" + jammed.get(
        reverse, "; driven backward it locks at some of these positions too (jammed)"
    )


def _unlocked(
    at: str, share: float, joints: Sequence[str], reverse: str, decides: str, multiple: float | None, whole: float
) -> str:
    """whole: multiple of all friction below which no group locks."""
    if whole < (1 - NEXT) * share:
        return (
            f"lower the coefficients of all joints below {whole:.3g} times their values (where {', '.join(joints)} no "
            "longer lock, other joints do), shorten the arms or lengthen the guides"
        )
    remedy = f"lower these coefficients below {share:.3g} times their values, shorten the arms or lengthen the guides"
    if decides:
        return f"lower the coefficient of {decides} alone below {multiple:.3g} times its value; or {remedy}"
    return remedy


def _interval(joints: Sequence[str], at: str, efforts: Mapping[str, Mapping[str, float | str]], locks: bool) -> str:
    """efforts: of every driver the widest interval, from, to, unit and place."""
    bounds = ", ".join(_bounds(driver, **one) for driver, one in efforts.items())
    bounds = bounds or ("with one sign it locks, so the drive effort has no bounds" if locks else "")
    are = "is" if len(joints) == 1 else "are"
    momentarily = "" if "between" in at else "momentarily "  # it is a dwell, else
    rest = f"{', '.join(joints)} {are} {momentarily}at rest {at}; friction may act either way there"
    return rest + (f": {bounds}" if bounds else "")


def _bounds(driver: str, **one: Any) -> str:
    effort = "torque" if one["unit"] == "N m" else "force"
    return f"{effort} of {driver} {between(one['from'], one['to'], one['unit'])} {one['at']}"


def _impact(
    part: str, least: float, peak: float, at: str, number: float | None, turning: str, likely: float, count: int
) -> str:
    if number is None:
        return "expect impact there"
    its = agreeing(count, "its", "their largest")
    rest = f"elsewhere {its} contact-loss number is at most {number:.3g} rad/(N s), {turning}"
    return f"expect impact there; {rest} (impact is likely from {likely:g}: Earles and Wu)"


CYCLE: dict[str, Sentence] = {
    "measure.contact_lost": Sentence(
        NOTE,
        "the measure has no figure: a pin loses contact at its place, {at}{why}",
        "state another place or window of the measure, by at: or over:, or analyse with --seat free",
    ),
    "model.gravity": Sentence(
        NOTE,
        "gravity is not stated and taken as zero, although {links} have mass",
        "state gravity: {down}, or gravity: {none}",
        quiet=True,
    ),
    "model.no_mass": Sentence(
        NOTE, "has no effect: no link has a mass", "state mass: … and centre: … of the links, or no gravity"
    ),
    "model.point_mass": Sentence(
        NOTE,
        "{links} have a mass but no inertia: each is a point mass at its centre",
        "state inertia: …",
    ),
    "model.seat_without_play": Sentence(
        NOTE,
        "{joints} have a seat but no play at nominal size: these joints are ideal",
        "analyse with --set fits=maximum for the largest play",
    ),
    "model.play_centred": Sentence(
        NOTE,
        lambda joints, seatable: f"the pins of {', '.join(joints)} are at the middle of their play",
        _centred,
    ),
    "cycle.not_common": Sentence(
        WARNING,
        "the {whom} have no common period; the cycle is the longest period, {duration:g} s",
        "means and efficiency are over that time; choose speeds with a common period, or ranges",
    ),
    "effort.beside_gap": Sentence(
        NOTE,
        "the largest effort, at {at}, is where pins begin or end to cross their play; while they cross it is not known",
        "see `trunnion simulate` for the forces of pins that cross their play",
    ),
    "errors.jump_moved": Sentence(
        NOTE,
        "the change by the errors at {at} is that of a jump whose place they move: with them it is {built}, "
        "without them {meant}; elsewhere the effort changes by at most {rest:~{unit}}",
        "compare the extremes with and without errors, not single positions beside the jump",
    ),
    "load.drives": Sentence(
        WARNING, "this resistance is negative {at}: it drives the joint", "use max(0 N, …), or a load with a sign"
    ),
    "load.no_power": Sentence(
        WARNING,
        "{loads} {count:#is/are} useful, but {count:#takes/take} no power at any position",
        "check its size and where it acts, or that its joint moves in the sense of only: …",
    ),
    "load.not_counted": Sentence(
        NOTE,
        "beside the drive, which supplies {drive:~J}, this load supplies {work:~J} over the cycle; the efficiency does "
        "not count it as input",
        "leave out a load that stands for the drive itself, such as the force of a hand",
    ),
    "efficiency.above_one": Sentence(
        WARNING,
        "the efficiency of the cycle is {efficiency:.4g}, above 1: the drive supplies {drive:~J}, beside it {supplies}",
        "work beside the drive is not counted as input; leave out a load that stands for the drive itself",
    ),
    "load.undefined": Sentence(
        ERROR,
        "has no value {at}",
        "extend its tables over the whole cycle, or make them periodic; check divisions and roots",
    ),
    "spring.undefined": Sentence(
        ERROR, "has no value {at}", "its line has no direction where its ends coincide: move one end"
    ),
    "spring.jump": Sentence(
        WARNING,
        "its torque jumps at {at}, where its angle passes half a turn from the free angle",
        "whole turns are not counted in this joint",
    ),
    "spring.stores": Sentence(
        NOTE,
        "at the end of the range it has stored {stored:~J} of the {drive:~J} that the drive supplies; the efficiency "
        "counts them as lost",
        "mark it useful: true if it stands for the work",
    ),
    "spring.turned_round": Sentence(
        WARNING,
        "its ends pass each other at {at}: its length falls to about 0, and its force reverses",
        "move one end along its line, with the free length, so that they stay apart",
    ),
    "spring.never_acts": Sentence(
        WARNING,
        lambda only, free, nearest: (
            f"never acts: its {'longest' if only == 'pull' else 'shortest'} length is {readable(nearest, 'm')}, its "
            f"free length {readable(free, 'm')}, and it can only {only}"
        ),
        "move its ends, or change its free length or the motion, if it is to act",
    ),
    "position.singular": Sentence(
        ERROR,
        "{kind} {at}: condition number {condition:.3g}",
        "speeds have no finite value there, nor have forces without friction; limit the range of the driver",
    ),
    "position.near_singular": Sentence(
        WARNING,
        "close to a dead centre {at}: condition number up to {condition:.3g}",
        "forces there depend strongly on small changes of the dimensions",
    ),
    "friction.locked": Sentence(ERROR, _locked, _unlocked),
    "friction.not_converged": Sentence(
        ERROR,
        "the friction iteration did not converge {at}",
        "use the Newton method, a larger criterion or more iterations",
    ),
    "friction.interval": Sentence(NOTE, _interval, "the bounds are in drive_effort_lower and drive_effort_upper"),
    "friction.sense": Sentence(
        NOTE,
        "a joint with friction reverses {at} while its pin moves within its play: friction may act either way there, "
        "and the seat changes with it",
    ),
    "locking.pins_centred": Sentence(
        NOTE,
        "locking takes the seats of {joints} for the margin and for where it locks forward; all else is of pins in the "
        "middle of their play: the other states and their ranges, the motion backward, critical multiples of single "
        "joints",
    ),
    "locking.load_beside_drive": Sentence(
        NOTE,
        "{loads} {count:#acts/act} on a driven link beside the drive and {count:#is/are} not useful: backward "
        "{count:#it acts/they act} too, which moves the ranges",
        "leave out a load that stands for the drive itself, such as the force of a hand",
    ),
    "contact.lost": Sentence(
        WARNING,
        "the {part}{count:#/s} {count:#loses/lose} contact {at}: {count:#its load falls/the loads fall} to {least:~N} "
        "(peak {peak:~N}) and {count:#reverses, and the pin/reverse, and the pins} would cross {count:#its/their} play",
        _impact,
    ),
    "contact.unloaded": Sentence(
        NOTE,
        "no load presses the pins of {joints} {at}: they float in their play, and positions there are not valid",
        "expect impact where the load sets in",
    ),
    "contact.lifted": Sentence(
        WARNING,
        "the {part}{count:#/s} {count:#lifts/lift} off the wall {at}: the inertia force of {count:#its/their} motion "
        "within the play exceeds the load",
        "forces there are those of a pin that stays in contact",
    ),
    "seat.unloaded": Sentence(
        NOTE,
        "the {part} carries no load: it is at the middle of its play",
        "state the seat, or seat: free",
    ),
    "seat.unsettled": Sentence(
        WARNING,
        "the seat did not converge in {rounds} iterations {at}: it still changes by {change:.2g} times the "
        "clearance, for the load turns as the pin moves, as where a tool touches the work for only one of two "
        "positions of a pin",
        "the pin floats there: treat it as loss of contact",
    ),
}
