"""Sentences about a cycle: what the model leaves out, loads, friction, dead centres, seats."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from trunnion.results.sentences.sentence import ERROR, NOTE, WARNING, Sentence

__all__ = ["CYCLE"]


def _centred(joints: Sequence[str], seatable: Sequence[str]) -> str:
    """What may be stated instead of pins in the middle of their play; seatable: where a seat may be taken."""
    if not seatable:
        return "the play verb tells what the play can do; `trunnion assemble FILE` whether the links go together"
    of = f" of {', '.join(seatable)}" if len(seatable) < len(joints) else ", or analyse with --seat loaded"
    return f"state seat: loaded{of}; the play verb tells what the play can do"


def _locked(at: str, share: float, joints: Sequence[str], reverse: str, decides: str, multiple: float | None) -> str:
    what = f"locked by friction {at}: no solution beyond {share:.4g} of the friction in joints {', '.join(joints)}"
    return what + {"": "", "all": "; it locks in reverse too: jammed"}.get(
        reverse, "; it locks in reverse too: jammed at some of them"
    )


def _unlocked(at: str, share: float, joints: Sequence[str], reverse: str, decides: str, multiple: float | None) -> str:
    remedy = f"lower these coefficients below {share:.3g} of their values, shorten the arms or lengthen the guides"
    if decides:
        return f"{decides} decides: below {multiple:.3g} of its coefficient alone it runs; or {remedy}"
    return remedy


def _interval(at: str, efforts: Mapping[str, Mapping[str, float | str]], locks: bool) -> str:
    """efforts: of every driver the widest interval, from, to, unit and place."""
    told = [f"effort of {name} {one['from']:.6g} … {one['to']:.6g} {one['unit']} {one['at']}"
            for name, one in efforts.items()]  # fmt: skip
    bounds = ", ".join(told) or ("with one sign it locks, so the effort has no bounds" if locks else "")
    return f"relative speed zero {at}: what resists it is an interval" + (f"; {bounds}" if bounds else "")


def _impact(part: str, least: float, peak: float, at: str, number: float | None, turning: str, likely: float) -> str:
    if number is None:
        return "expect impact there"
    rest = f"elsewhere its reaction turns at up to {number:.3g} rad/(N s), {turning}"
    return f"expect impact there; {rest} (impact is likely from {likely:g}: Earles and Wu)"


CYCLE: dict[str, Sentence] = {
    "model.gravity": Sentence(
        NOTE,
        "gravity is not stated and taken as none, though {links} have mass",
        "state gravity: {down}, or {none} to say so",
    ),
    "model.point_mass": Sentence(
        NOTE,
        "{links} have a mass but no inertia: they are taken as point masses at their centres",
        "state inertia: …",
    ),
    "model.seat_without_play": Sentence(
        NOTE,
        "{joints} have a seat but no play at their nominal sizes: the joints are ideal",
        "analyse with --set fits=maximum for the widest",
    ),
    "model.play_centred": Sentence(
        NOTE,
        lambda joints, seatable: f"the pins of {', '.join(joints)} are taken to lie in the middle of their play",
        _centred,
    ),
    "cycle.not_common": Sentence(
        WARNING,
        "the {whom} do not come back together; the cycle is the slowest period, {duration:g} s",
        "means and efficiency are of that time; choose speeds with a common period, or ranges",
    ),
    "effort.peak_missed": Sentence(
        WARNING,
        "its RMS over the cycle, {rms:.4g} {unit}, is above the largest at any position, {largest:.4g} {unit}",
        "use more --steps: what acts between two positions is in the means, not in the extremes",
    ),
    "load.drives": Sentence(
        WARNING, "is negative {at}: it drives the joint there", "use max(0 N, …), or a load with a sign"
    ),
    "load.undefined": Sentence(
        ERROR,
        "has no value {at}",
        "let its tables reach over the whole cycle, or be periodic; check divisions and roots",
    ),
    "spring.undefined": Sentence(ERROR, "has no value {at}", "its line has no direction where its ends meet: move one"),
    "spring.jump": Sentence(
        WARNING,
        "turns through half a turn from its free angle at {at} and jumps there",
        "no whole turns are counted in this joint",
    ),
    "position.singular": Sentence(
        ERROR,
        "{kind} {at}: condition {condition:.3g}",
        "speeds and forces have no finite value there; keep out of it",
    ),
    "position.near_singular": Sentence(
        WARNING,
        "close to a dead centre {at}: condition up to {condition:.3g}",
        "forces there are very sensitive to the dimensions",
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
        "a joint with friction turns round while its pin travels {at}: its friction may act either way, and its seat "
        "with it",
    ),
    "friction.other_solutions": Sentence(
        NOTE,
        "friction allows up to {count} other {count:#solution/solutions} {at}",
        "the one that grows from no friction is given; started otherwise it may wedge",
    ),
    "contact.lost": Sentence(
        WARNING,
        "its {part} loses contact {at}: the load comes down to {least:.3g} of {peak:.4g} N, turns round and the seat "
        "would jump",
        _impact,
    ),
    "contact.lifted": Sentence(
        WARNING,
        "its {part} lifts off the wall {at}: the inertia of its travel across the hole outweighs the load",
        "forces there are those of one that stays",
    ),
    "seat.unloaded": Sentence(
        NOTE,
        "no load presses its {part}: it is taken to lie in the middle of its hole",
        "give the seat, or leave it free",
    ),
    "seat.unsettled": Sentence(
        WARNING,
        "its seat did not settle in {rounds} rounds {at}: it still changes by {change:.2g} of its clearance, as the "
        "load there changes more with the seat than it presses",
        "there the pin floats: contact is lost",
    ),
    "seat.held": Sentence(
        NOTE,
        "the seats turn too fast to tell how they travel {at}: velocities and accelerations there are those of pins "
        "held in their seats",
    ),
}
