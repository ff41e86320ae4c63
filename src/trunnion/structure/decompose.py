"""A mechanism as a row of modules: drivers and Assur groups, in the order in which motion flows.

Every joint takes freedoms from the two links it joins, every driver one more. Matching each of these constraints
to a freedom of one link says which link it determines; a link then depends on the other links of the
constraints that determine it. Links that depend on each other are one module (a strongly connected component),
and the modules follow each other as their dependence demands. So any class of group is found by the same graph
work.  [THEORY of the docs, "Structure"; D 17 for the formula]
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.joints.pairs import PAIRS
from trunnion.model.mechanism import Mechanism
from trunnion.structure.generic import GEAR, SPIN, Constraint, Generic
from trunnion.structure.graph import matching
from trunnion.structure.parts import Parts

__all__ = ["FREEDOMS", "Module", "Plan", "decompose", "mobility_by_formula", "passive"]

FREEDOMS = {"planar": 3, "spatial": 6}  # of a free link
# outer, inner, outer joint of the dyads in closed form, in the plane and in space
CLOSED_FORMS = {"planar": ("RRR", "RRP", "RPR", "PRP", "RPP"), "spatial": ("CCC",)}
ROMAN = {1: "I", 2: "II", 3: "III", 4: "IV", 5: "V", 6: "VI", 7: "VII", 8: "VIII", 9: "IX", 10: "X"}


@dataclass(frozen=True)
class Module:
    """A driver or an Assur group.

    kind: key of `groups.GROUPS`, or "general". links: in file order, for a closed form in its own order.
    joints: in the order of the group; `reversed_` tells which of them name their links in the file the other way
    round than the group does. driven: joints whose coordinate is prescribed. rank: the class (1 for a driver).
    gears: gear pairs that it holds; witnesses: joints between known links that these speak of. spinning: links whose
    spin about the line of their two spherical joints is free, with these; redundant: its joints constrain more than the
    links have freedoms.
    """

    kind: str
    links: tuple[str, ...]
    joints: tuple[str, ...]
    reversed_: tuple[bool, ...]
    driven: tuple[str, ...]
    rank: int
    label: str
    gears: tuple[str, ...] = ()
    witnesses: tuple[str, ...] = ()
    spinning: tuple[tuple[str, str, str], ...] = ()
    redundant: bool = False


@dataclass(frozen=True)
class Plan:
    """Ordered modules of a mechanism, with its mobility by formula.

    passive: links whose spin is free and moves nothing else; the mobility counts it.
    """

    modules: tuple[Module, ...]
    mobility: int
    passive: tuple[str, ...] = ()

    @property
    def formula(self) -> str:
        """Structural formula such as I(0,1)R → II(2,3)RRR.  [D 17]"""
        return " → ".join(module.label for module in self.modules)


def taken(mechanism: Mechanism, joint: str) -> int:
    """Freedoms that a joint takes."""
    pair = PAIRS[mechanism.effective_joints[joint].type]
    freed = len(pair.freedoms) if mechanism.space == "planar" else pair.count
    return FREEDOMS[mechanism.space] - freed


def mobility_by_formula(mechanism: Mechanism) -> int:
    """Grübler's count d (n − 1) − Σ (d − f_j) − gear pairs of n links; d = 3 in the plane, 6 in space."""
    moving = len(mechanism.effective_links) - 1
    held = sum(taken(mechanism, joint) for joint in mechanism.effective_joints)
    return FREEDOMS[mechanism.space] * moving - held - len(mechanism.gears)


def passive(mechanism: Mechanism) -> dict[str, tuple[str, str]]:
    """Links whose spin is free, with their two joints: the link can turn about a line without moving anything else.

    Both joints are spherical; or one is, and the axis of the other, which frees a turn, goes through its centre. A turn
    that is driven is not free.
    """
    found: dict[str, tuple[str, str]] = {}
    if mechanism.space == "planar" or mechanism.loop:
        return found
    table = LinkTable(mechanism)
    for link in mechanism.links:
        joints = table.joints_of.get(link, [])
        balls = [name for name in joints if PAIRS[mechanism.joints[name].type].ball]
        if link == mechanism.fixed_link or len(joints) != 2 or not balls:
            continue
        if len(balls) == 2 or _through(mechanism, link, balls[0], *(name for name in joints if name not in balls)):
            found[link] = (joints[0], joints[1])
    return found


def _through(mechanism: Mechanism, link: str, ball: str, other: str) -> bool:
    """Whether the axis of a joint that turns goes through the centre of a ball on the same link."""
    pair = PAIRS[mechanism.joints[other].type]
    if not pair.bored or other in mechanism.drivers:
        return False
    values = mechanism.parameters()
    centre, place, axis = (
        np.array([float(np.ravel(values[f"links.{link}.points.{path}.{letter}"])[0]) for letter in "xyz"])
        for path in (ball, other, f"{other}.axis")
    )
    apart = float(np.linalg.norm(np.cross(centre - place, axis / np.linalg.norm(axis))))
    return apart <= 1e-9 * max(float(np.linalg.norm(centre - place)), 1e-300)


def decompose(mechanism: Mechanism) -> Plan:
    """The modules in order.

    Raises MechanismError with a finding for every part that is not determined or determined twice.
    """
    ground = mechanism.fixed_link
    mobility = mobility_by_formula(mechanism)
    table = LinkTable(mechanism)
    bodies = [link for link in mechanism.effective_links if link != ground]
    spinning = passive(mechanism)
    determines, unmatched = _match(mechanism, bodies, ground, spinning)
    if mechanism.space == "spatial":
        findings = _undriven(mechanism, mobility - len(spinning), len(spinning))
        unheld = FREEDOMS["spatial"] * len(bodies) > len(determines)
        if not findings and (unheld or mobility - len(spinning) < len(mechanism.drivers)):
            return Plan((_whole(table, bodies, spinning),), mobility, tuple(spinning))
    else:
        findings = _undriven(mechanism, mobility, 0, exactly=True) if mobility != len(mechanism.drivers) else []
    if findings:
        raise MechanismError(findings)
    dependence = [
        (other, body)
        for constraint, body in determines.items()
        for other in _links_of(mechanism, constraint)
        if other not in (body, ground)
    ]
    parts = Parts(bodies, dependence)
    if mechanism.space == "planar":
        findings = Generic(mechanism, bodies, determines).fault(unmatched, parts)
        if findings:
            raise MechanismError(findings)
    gears: dict[int, list[str]] = {}
    for (name, number), body in determines.items():
        if number == GEAR:
            gears.setdefault(parts.part_of[body], []).append(name)
    known = {ground}
    modules: list[Module] = []
    for part in parts.ordered():
        modules.append(_module(table, parts.members[part], known, gears.get(part, []), spinning))
        known |= set(parts.members[part])
    return Plan(tuple(modules), mobility, tuple(spinning))


class LinkTable:
    """The links and joints of a mechanism, looked up rather than searched for."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.joints = mechanism.effective_joints

    @cached_property
    def numbers(self) -> dict[str, int]:
        """Link numbers of the formula: 0 for the ground, the others in file order."""
        others = [link for link in self.mechanism.effective_links if link != self.mechanism.fixed_link]
        return {self.mechanism.fixed_link: 0, **{link: i for i, link in enumerate(others, 1)}}

    @cached_property
    def joints_of(self) -> dict[str, list[str]]:
        """The joints of each link, in file order."""
        found: dict[str, list[str]] = {}
        for name, joint in self.joints.items():
            for link in dict.fromkeys(joint.links):
                found.setdefault(link, []).append(name)
        return found

    @cached_property
    def order(self) -> dict[str, int]:
        """Where the joints stand in the file."""
        return {name: i for i, name in enumerate(self.joints)}

    def inside(self, links: list[str], known: set[str]) -> list[str]:
        """Joints among some links, or between them and the known ones, in file order."""
        own = set(links)
        touching = {name for link in links for name in self.joints_of.get(link, [])}
        found = (name for name in touching if all(link in own or link in known for link in self.joints[name].links))
        return sorted(found, key=self.order.__getitem__)

    def symbol(self, joint: str) -> str:
        """The letter of a joint in the formula."""
        return PAIRS[self.joints[joint].type].symbol


def _constraints(mechanism: Mechanism) -> list[Constraint]:
    """Every freedom that joints, gear pairs and drivers take."""
    found: list[Constraint] = []
    for name in mechanism.effective_joints:
        found += [(name, i) for i in range(taken(mechanism, name))]
    found += [(name, GEAR) for name in mechanism.gears]
    return found + [(name, FREEDOMS[mechanism.space]) for name in mechanism.drivers]


def _links_of(mechanism: Mechanism, constraint: Constraint) -> list[str]:
    """Links whose motion a constraint relates."""
    name, number = constraint
    if number == SPIN:
        return [name]
    joints = mechanism.gears[name].joints if number == GEAR else (name,)
    return list(dict.fromkeys(link for joint in joints for link in mechanism.effective_joints[joint].links))


def _match(
    mechanism: Mechanism, bodies: list[str], ground: str, spinning: Iterable[str]
) -> tuple[dict[Constraint, str], list[Constraint]]:
    """Each constraint with the link it determines, by a maximum matching onto the links' freedoms; those left over."""
    constraints = _constraints(mechanism) + [(link, SPIN) for link in spinning]
    size = FREEDOMS[mechanism.space]
    number = {body: i for i, body in enumerate(bodies)}
    wanted: list[list[int]] = []
    for constraint in constraints:
        moving = (number[link] for link in _links_of(mechanism, constraint) if link != ground)
        wanted.append([size * link + freedom for link in moving for freedom in range(size)])
    matched = matching(wanted, size * len(bodies))
    found = {one: bodies[k // size] for one, k in zip(constraints, matched, strict=True) if k >= 0}
    return found, [one for one, k in zip(constraints, matched, strict=True) if k < 0]


def _undriven(mechanism: Mechanism, mobility: int, spins: int, exactly: bool = False) -> list[Finding]:
    """Whether the drivers are fewer than the freedoms that have an effect, or not as many."""
    drivers = len(mechanism.drivers)
    if mobility <= drivers and not (exactly and mobility < drivers):
        return []
    has = "is no driver" if drivers == 0 else "is one driver" if drivers == 1 else f"are {drivers} drivers"
    remedy = (
        "drive a joint for each freedom left, as A: {speed: 10 rad/s}, or add a link or joint that removes it"
        if mobility > drivers
        else "remove a driver, or a joint or link that constrains twice"
    )
    beside = f" beside {spins} that spin a link alone" if spins else ""
    what = f"the mobility is {mobility} by Grübler's formula{beside}, but there {has}"
    return [Finding(what, "drivers", remedy)]


def _whole(table: LinkTable, links: list[str], spinning: Mapping[str, tuple[str, str]]) -> Module:
    """All links as one module, whose joints constrain more than its links have freedoms."""
    module = _module(table, links, {table.mechanism.fixed_link}, [], spinning)
    return replace(module, kind="general", redundant=True)


def _module(
    table: LinkTable, links: list[str], known: set[str], gears: list[str], spinning: Mapping[str, tuple[str, str]]
) -> Module:
    """The module that the given links form on the links known so far, and through these gear pairs."""
    mechanism, numbers = table.mechanism, table.numbers
    joints = table.inside(links, known)
    driven = [name for name in joints if name in mechanism.drivers]
    symbols = (f"[{table.symbol(name)}]" if name in driven else table.symbol(name) for name in joints)
    letters = "".join(symbols) + "G" * len(gears)
    if len(links) == 1 and driven == joints and not gears:
        base = next(link for link in mechanism.effective_joints[joints[0]].links if link not in links)
        letter = table.symbol(joints[0])
        label = f"I({numbers[base]},{numbers[links[0]]}){letter}"
        return _assembled(mechanism, letter, links, joints, driven, 1, label)
    rank = _class(mechanism, links, joints)
    dyad = _dyad(mechanism, links, joints) if not driven and not gears else None
    if dyad:
        kind, links, joints = dyad
        letters = kind
    else:
        kind = "general"
    listed = ",".join(str(numbers[link]) for link in links)
    label = f"{ROMAN.get(rank, rank)}({listed}){letters}"
    module = _assembled(mechanism, kind, links, joints, driven, rank, label)
    spoken = dict.fromkeys(joint for gear in gears for joint in mechanism.gears[gear].joints)
    witnesses = tuple(joint for joint in spoken if joint not in joints)
    spins = tuple((link, *spinning[link]) for link in links if link in spinning)
    return replace(module, gears=tuple(gears), witnesses=witnesses, spinning=spins)


def _dyad(mechanism: Mechanism, links: list[str], joints: list[str]) -> tuple[str, list[str], list[str]] | None:
    """(kind, links, joints) of a class II group with a closed form: outer joint, inner joint, outer joint."""
    if len(links) != 2 or len(joints) != 3:
        return None
    pairs = {name: mechanism.effective_joints[name].links for name in joints}
    inner = [name for name in joints if all(link in links for link in pairs[name])]
    if len(inner) != 1:
        return None
    first, last = (name for name in joints if name != inner[0])
    if pairs[first][0] in links and pairs[first][0] in pairs[last]:
        return None
    if links[0] not in pairs[first]:
        first, last = last, first
    for order, sides in (([first, inner[0], last], links), ([last, inner[0], first], links[::-1])):
        kind = "".join(PAIRS[mechanism.effective_joints[name].type].symbol for name in order)
        if kind in CLOSED_FORMS[mechanism.space]:
            return kind, sides, order
    return None


def _class(mechanism: Mechanism, links: list[str], joints: list[str]) -> int:
    """Class after Assur and Artobolevski: joints of the richest link, or of the longest loop of links, at least 2."""
    own, held = set(links), Counter(link for name in joints for link in mechanism.effective_joints[name].links)
    most = max(2, *(held[link] for link in links))
    within = {tuple(sorted(mechanism.effective_joints[name].links)) for name in joints}
    if len(links) <= 3:
        return most  # no loop of more than three links
    import networkx as nx  # loaded where it is needed: it takes a tenth of a small analysis

    loops = nx.minimum_cycle_basis(nx.Graph([pair for pair in sorted(within) if own.issuperset(pair)]))
    return max([most, *(len(loop) for loop in loops if len(loop) > 3)])


def _assembled(
    mechanism: Mechanism, kind: str, links: list[str], joints: list[str], driven: list[str], rank: int, label: str
) -> Module:
    place = {link: i for i, link in enumerate(links)}

    def reversed_(name: str) -> bool:
        """A closed form takes the outer link first, and inside the group the link it lists first."""
        first, second = mechanism.effective_joints[name].links
        if kind == "general":
            return False  # its joints are as the file has them
        return first in place and (second not in place or place[first] > place[second])

    flags = tuple(reversed_(name) for name in joints)
    return Module(kind, tuple(links), tuple(joints), flags, tuple(driven), rank, label)
