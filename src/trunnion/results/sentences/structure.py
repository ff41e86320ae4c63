"""Sentences about how a mechanism is built and assembled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from trunnion.results.sentences.sentence import ERROR, NOTE, WARNING, Sentence, length

__all__ = ["STRUCTURE"]

MOBILITY = "the mobility is {formula} by Grübler's formula and {rank} by rank"


def _gap(at: str, everywhere: bool, gaps: Mapping[str, float]) -> str:
    by = "; ".join(f"{name} by up to {length(size)}" for name, size in gaps.items())
    where = "at any position" if everywhere else at
    return f"cannot be assembled {where}: {by or 'an earlier module has no position'}"


def _open(at: str, everywhere: bool, redundant: bool, errors: bool) -> str:
    why = "do not close" if everywhere else "do not get there from their start without being taken apart"
    if everywhere and redundant and errors:
        why = "are over-constrained, and with their errors they go together only by their play, if at all: "
        why += "they cannot be analysed as rigid parts"
    return f"cannot be assembled {'at any position' if everywhere else at}: these links {why}"


def _mend(at: str, everywhere: bool, redundant: bool, errors: bool) -> str:
    if not (everywhere and redundant):
        return "change the lengths or the range of the driver"
    if errors:
        return "`trunnion assemble FILE` tells whether they go together, and how much play that takes"
    special = "its joints constrain more than they free, so it closes with special dimensions only: check them, "
    return f"{special}or let joints slide or tilt (cylindrical, spherical)"


def _overdriven(formula: int, rank: int, spins: int, drivers: int) -> str:
    beside = f", {spins} of it spins of a link alone" if spins else ""
    are = "is 1 driver" if drivers == 1 else f"are {drivers:,} drivers"
    return f"{MOBILITY.format(formula=formula, rank=rank)}{beside}, but there {are}"


def _dragged(link: str, points: Sequence[str], torque: float | None) -> str:
    drag = f"; friction of its joints would drag it round with up to {torque:.3g} N m" if torque is not None else ""
    return f"it is taken not to spin{drag}"


STRUCTURE: dict[str, Sentence] = {
    "assembly.gap": Sentence(ERROR, _gap, "change the lengths or the range of the driver"),
    "assembly.open": Sentence(ERROR, _open, _mend),
    "assembly.choice": Sentence(
        WARNING, "links {links} can be assembled in {ways} ways and {why}; one was taken", "{remedy}"
    ),
    "assembly.anew": Sentence(
        WARNING,
        "links {links} come apart on the way and are put together anew {at}",
        "there the assembly of the same sense nearest to the one before is shown; limit the range of the driver",
    ),
    "assembly.never": Sentence(
        WARNING,
        "links {links} cannot be assembled anywhere along the cycle",
        "check the lengths, or give a better assembly hint",
    ),
    "assembly.never_rigid": Sentence(
        WARNING,
        "links {links} with their errors do not close as rigid parts anywhere along the cycle",
        "if they go together it is by their play only: `trunnion assemble FILE` tells how much that takes",
    ),
    "assembly.over_constrained": Sentence(
        WARNING,
        "links {links} cannot be assembled anywhere along the cycle; the mobility is {formula} by Grübler's formula"
        "{spinning} and the number of drivers {drivers}",
        "check the lengths, or give a better assembly hint; only special dimensions let so many constraints agree: "
        "remove a driver or free a joint",
    ),
    "assembly.told_twice": Sentence(
        NOTE, "the links {links} are chosen by name and by where {places} is", "one of them is enough"
    ),
    "assembly.contradiction": Sentence(
        WARNING,
        "the links {links} are chosen by name and by where {places} is, which would be {way}; the name, {name}, is "
        "taken",
        "remove one of them",
    ),
    "assembly.change_point": Sentence(
        ERROR,
        "passes a change point at {places}: two assemblies of the links {links} meet there",
        "which way it goes on is not determined; here {joint} stays on its side. Change a length, or drive it over a "
        "range that ends before",
    ),
    "assembly.misfit": Sentence(
        NOTE,
        "the axes and lengths as stated do not fit, and neither do they without the errors",
        "what is off counts from where the loops are open least; it may be stated as misalignment or errors",
    ),
    "mobility.spin": Sentence(
        NOTE, "the link '{link}' can spin about the line of {points[0]} and {points[1]} (a passive freedom)", _dragged
    ),
    "mobility.spin_loaded": Sentence(
        WARNING,
        "nothing keeps the link '{link}' from spinning about {points[0]}-{points[1]}: it would take up to "
        "{torque:.3g} N m",
        "make it symmetric about that line, or hold its spin by a universal joint at one end",
    ),
    "mobility.overdriven": Sentence(ERROR, _overdriven, "remove a driver"),
    "mobility.undetermined": Sentence(
        ERROR,
        MOBILITY + ": {freedoms} {freedoms:#freedom is/freedoms are} not determined, of the links {links}",
        "drive them, or give these links joints that hold them",
    ),
    "mobility.redundant": Sentence(
        ERROR,
        MOBILITY + ": {constraints} {constraints:#constraint is/constraints are} redundant, in the joints {joints}; "
        "statics does not determine their reactions",
        "free a joint (cylindrical, spherical), or state over_constraint: minimum-norm for the smallest",
    ),
    "mobility.redundant_least": Sentence(
        WARNING,
        MOBILITY + ": {constraints} {constraints:#constraint is/constraints are} redundant, in the joints {joints}; "
        "their reactions are the smallest that hold the balance",
        "misfit and preload come on top: they depend on errors and stiffness",
    ),
    "mobility.special": Sentence(
        WARNING,
        "the mobility is {formula} by Grübler's formula and {rank} by the rank of the constraints",
        "a special geometry: reactions or motion are not determined",
    ),
}
