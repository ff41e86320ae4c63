"""Sentences about how a mechanism is built and assembled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from trunnion.results.quantities import readable
from trunnion.results.sentences.sentence import ERROR, NOTE, WARNING, Sentence

__all__ = ["STRUCTURE"]

MOBILITY = "the mobility is {formula} by Grübler's formula and {rank} by rank"


def _gap(at: str, everywhere: bool, gaps: Mapping[str, float]) -> str:
    by = "; ".join(f"{name} by up to {readable(size, 'm')}" for name, size in gaps.items())
    where = "at any position" if everywhere else at
    return f"cannot be assembled {where}: {by or 'an earlier group has no position'}"


def _ranges(ranges: Sequence[str], starts: Sequence[str]) -> str:
    of = f"extremes are of the one that holds the start, {starts[0]}" if starts else "none of them holds the start"
    return (
        f"it can be assembled in {len(ranges)} ranges that are not reached from each other: {', '.join(ranges)}; {of}"
    )


def _elsewhere(ranges: Sequence[str], starts: Sequence[str]) -> str:
    return "start the driver in another range to have the extremes of that" if starts else "start the driver in one"


def _open(at: str, everywhere: bool, redundant: bool, errors: bool, start: bool = False) -> str:
    why = "these links do not close" + (" there, where the motion starts" if start and not everywhere else "")
    if not everywhere and not start:
        why = "these links cannot reach it from the start without being taken apart"
    elif everywhere and redundant and errors:
        why = "these links are over-constrained; with their errors they need play to fit together, and as rigid parts "
        why += "they cannot be analysed"
    return f"cannot be assembled {'at any position' if everywhere else at}: {why}"


def _mend(at: str, everywhere: bool, redundant: bool, errors: bool, start: bool = False) -> str:
    if not (everywhere and redundant):
        return "change the lengths or the range of the driver"
    if errors:
        return "see `trunnion assemble FILE` for the play that they need"
    special = "the group is over-constrained and closes with special dimensions only: check them, "
    return f"{special}or use joints with more freedoms (cylindrical, spherical)"


def _overdriven(formula: int, rank: int, spins: int, drivers: int) -> str:
    beside = f", {spins} of them spins of a single link" if spins else ""
    are = "is 1 driver" if drivers == 1 else f"are {drivers:,} drivers"
    return f"{MOBILITY.format(formula=formula, rank=rank)}{beside}, but there {are}"


def _dragged(link: str, points: Sequence[str], torque: float | None) -> str:
    drag = f"; friction of its joints would drag it with up to {readable(torque, 'N m')}" if torque is not None else ""
    return f"the analysis sets this spin to zero{drag}"


def _meeting(places: Sequence[str], links: Sequence[str], joint: str) -> str:
    """places: coordinates, and ranges of them."""
    alone = [place for place in places if not place.startswith("between")]
    where = ", ".join([f"at {', '.join(alone)}"] * bool(alone) + [place for place in places if place not in alone])
    return f"change point {where}: two assembly modes of the links {', '.join(links)} coincide there"


STRUCTURE: dict[str, Sentence] = {
    "assembly.gap": Sentence(ERROR, _gap, "change the lengths or the range of the driver"),
    "assembly.open": Sentence(ERROR, _open, _mend),
    "assembly.ranges": Sentence(NOTE, _ranges, _elsewhere),
    "assembly.choice": Sentence(
        WARNING, "links {links} have {ways} assembly modes and {why}; {used} is used", "{remedy}"
    ),
    "assembly.anew": Sentence(
        WARNING,
        "links {links} cannot stay assembled throughout the cycle and are assembled again {at}",
        "the assembly mode of the same sense nearest to the last one is used there; limit the range of the driver",
    ),
    "assembly.never": Sentence(
        WARNING,
        "links {links} cannot be assembled at any position of the cycle",
        "check the lengths, or give a better assembly hint",
    ),
    "assembly.never_rigid": Sentence(
        WARNING,
        "links {links} with their errors do not close as rigid parts at any position of the cycle",
        "they need play to fit together: see `trunnion assemble FILE` for how much",
    ),
    "assembly.over_constrained": Sentence(
        WARNING,
        "links {links} cannot be assembled at any position of the cycle; the mobility is {formula} by Grübler's "
        "formula{spinning} and the number of drivers {drivers}",
        "check the lengths, or give a better assembly hint; so many constraints are consistent with special "
        "dimensions only: remove a driver or free a joint",
    ),
    "assembly.far_hint": Sentence(
        WARNING,
        "the hint for {point} is {distance:~m} from where {point} is at the start",
        "check the hint or the lengths; at the start it is at {place}",
    ),
    "assembly.told_twice": Sentence(
        NOTE, "the assembly mode of the links {links} is stated by name and by the place of {places}", "one is enough"
    ),
    "assembly.contradiction": Sentence(
        WARNING,
        "the assembly mode of the links {links} is stated by name, {name}, and by the place of {places}, which means "
        "{way}; the name is used",
        "remove one of the two",
    ),
    "assembly.change_point": Sentence(
        ERROR,
        _meeting,
        "the motion beyond it is not determined; here {joint} stays on its side. Change a length, or limit the range "
        "of the driver",
    ),
    "assembly.misfit": Sentence(
        NOTE,
        "the stated axes and lengths do not close the loops, even without the errors",
        "errors count from the position with the smallest opening; state the difference as misalignment or errors",
    ),
    "mobility.spin": Sentence(
        NOTE, "the link '{link}' can spin about the line {points[0]}-{points[1]} (a passive freedom)", _dragged
    ),
    "mobility.spin_loaded": Sentence(
        WARNING,
        "the link '{link}' is free to spin about {points[0]}-{points[1]}, but a torque of up to {torque:~N m} acts "
        "about that line",
        "make the link symmetric about the line, or use a universal joint at one end",
    ),
    "mobility.overdriven": Sentence(ERROR, _overdriven, "remove a driver"),
    "mobility.undetermined": Sentence(
        ERROR,
        MOBILITY + ": {freedoms} {freedoms:#freedom is/freedoms are} not determined, of the links {links}",
        "add drivers or joints to these links",
    ),
    "mobility.redundant": Sentence(
        ERROR,
        MOBILITY + ": {constraints} {constraints:#constraint is/constraints are} redundant, in the joints {joints}; "
        "statics does not determine their reactions",
        "use a joint with more freedoms (cylindrical, spherical), or state over_constraint: minimum-norm for the "
        "smallest reactions",
    ),
    "mobility.redundant_least": Sentence(
        WARNING,
        MOBILITY + ": {constraints} {constraints:#constraint is/constraints are} redundant, in the joints {joints}; "
        "the reactions given are the smallest that satisfy equilibrium",
        "misfit and preload add to them: they depend on errors and stiffness",
    ),
    "mobility.friction_open": Sentence(
        ERROR,
        "statics does not determine the forces on which the friction in the joints {joints} depends",
        "give the joints {constraints:#freedom} more (cylindrical, spherical), state bearings on one line as one joint "
        "with pin.bearing (guide.length) from end to end, or friction: 0",
    ),
    "mobility.special": Sentence(
        WARNING,
        "the mobility is {formula} by Grübler's formula and {rank} by the rank of the constraints",
        "the geometry is special: reactions or motion are not determined",
    ),
}
