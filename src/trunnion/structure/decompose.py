"""A mechanism as a row of modules: drivers and Assur groups, in the order in which motion flows.

Every joint takes freedoms from the two links it joins, every driver one more. Matching each of these constraints
to a freedom of one link says which link it determines; a link then depends on the other links of the
constraints that determine it. Links that depend on each other are one module (a strongly connected component),
and the modules follow each other as their dependence demands. So any class of group is found by the same graph
work.  [THEORY of the docs, "Structure"; D 17 for the formula]
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from trunnion.errors import Finding, MechanismError, counted
from trunnion.model.mechanism import Mechanism
from trunnion.structure.generic import GEAR, SPIN, Constraint, Gears, Joints, Places, constraints, fault, rank
from trunnion.structure.graph import components, longest_loop, matching, ordered
from trunnion.structure.passive import passive

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
    spin is free, with the two joints between which it is, see `structure.passive`; redundant: its joints constrain
    more than the links have freedoms.
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
    pair = mechanism.effective_joints[joint].pair
    freed = len(pair.freedoms) if mechanism.space == "planar" else pair.count
    return FREEDOMS[mechanism.space] - freed


def mobility_by_formula(mechanism: Mechanism) -> int:
    """Grübler's count d (n − 1) − Σ (d − f_j) − gear pairs of n links; d = 3 in the plane, 6 in space."""
    moving = len(mechanism.effective_links) - 1
    constrained = sum(taken(mechanism, joint) for joint in mechanism.effective_joints)
    return FREEDOMS[mechanism.space] * moving - constrained - len(mechanism.gears)


def mobility_by_rank(
    links: Sequence[str],
    ground: str,
    joints: Joints,
    places: Places,
    gears: Gears | None = None,
    modules: Sequence[Module] = (),
) -> int:
    """Freedoms of the links less the rank of the joints' constraints at one position.

    It exceeds Grübler's count where constraints repeat each other, as in a parallelogram with a third crank. modules:
    all links and joints in the order in which they are determined. One that holds its own links firmly takes from them
    what it should, unless a later one that does not hangs on it: so few constraints of a row are looked at at once.
    """
    gears = gears or {}
    weak: list[Module] = []
    needed: set[str] = set()
    firm = 0
    for module in reversed(modules):
        meshed = {name: gears[name] for name in module.gears}
        spoken = (joint for pair, _ in meshed.values() for joint in pair)
        members = {name: joints[name] for name in dict.fromkeys((*module.joints, *spoken))}
        matrix, _ = constraints(module.links, ground, members, places, module.driven, meshed)
        if needed.isdisjoint(module.links) and rank(matrix) == int(matrix.shape[1]):
            firm += len(module.driven)
        else:
            weak.append(module)
            needed.update(link for _, sides in members.values() for link in sides)
    if modules:
        links = [link for module in weak for link in module.links]
        joints = {name: joints[name] for module in weak for name in module.joints}
        gears = {name: gears[name] for module in weak for name in module.gears}
    matrix, _ = constraints(links, ground, joints, places, gears=gears)
    return firm + int(matrix.shape[1]) - rank(matrix)


def decompose(mechanism: Mechanism) -> Plan:
    """The modules in order.

    Raises MechanismError with a finding for every part that is not determined or determined twice.
    """
    planar, drivers = mechanism.space == "planar", len(mechanism.drivers)
    mobility, spinning = mobility_by_formula(mechanism), passive(mechanism)
    table = LinkTable(mechanism, spinning)
    bodies = list(table.numbers)[1:]
    # constraints with the link that each determines, matched onto the links' freedoms; those left over
    size = FREEDOMS[mechanism.space]
    freedoms = {body: range(size * i, size * (i + 1)) for i, body in enumerate(bodies)}
    suitable = [[freedom for link in links for freedom in freedoms[link]] for links in table.links_of.values()]
    places = dict(zip(table.links_of, matching(suitable, size * len(bodies)), strict=True))
    determines = {constraint: bodies[k // size] for constraint, k in places.items() if k >= 0}
    left_over = [constraint for constraint, k in places.items() if k < 0]
    moved = mobility - len(spinning)
    # in space axes that are parallel or meet are common, and the rank at a pose tells; in the plane the count does
    by_rank = not planar or mechanism.over_constraint == "minimum-norm"
    if moved > drivers or (moved < drivers and not by_rank):
        suffix = f" beside {counted(len(spinning), 'passive spin')}" if spinning else ""
        has = "is no driver" if drivers == 0 else "is one driver" if drivers == 1 else f"are {drivers} drivers"
        what = f"the mobility is {moved} by Grübler's formula{suffix}, but there {has}"
        more = "drive a joint for each freedom left, or add a link or joint that removes it"
        fewer = (
            "remove a driver, or a joint or link that constrains twice; if it moves all the same, as a parallelogram "
        )
        fewer += "with a third crank does, state over_constraint: minimum-norm"
        raise MechanismError([Finding(what, "drivers", more if moved > drivers else fewer)])
    if by_rank and (moved < drivers or size * len(bodies) > len(determines)):
        return _as_one(table, mobility, spinning)
    after: list[set[int]] = [set() for _ in bodies]
    for constraint, body in determines.items():
        for link in {*table.links_of[constraint], *table.about(constraint)} - {body}:
            after[table.numbers[link] - 1].add(table.numbers[body] - 1)
    part_of = components(after)
    parts: list[list[str]] = [[] for _ in set(part_of)]
    before: list[set[int]] = [set() for _ in parts]
    for k, part in enumerate(part_of):
        parts[part].append(bodies[k])
        for other in after[k]:
            before[part_of[other]] |= {part} - {part_of[other]}
    if planar and (finding := fault(mechanism, determines, table.links_of, left_over, parts)):
        if by_rank:
            return _as_one(table, mobility, spinning)
        raise MechanismError([finding])
    placed = {mechanism.fixed_link}
    modules: list[Module] = []
    for part in ordered(before, [table.numbers[links[0]] for links in parts]):
        gears = [name for (name, number), body in determines.items() if number == GEAR and body in parts[part]]
        modules.append(table.module(parts[part], placed, gears))
        placed.update(parts[part])
    return Plan(tuple(modules), mobility, tuple(spinning))


def _as_one(table: LinkTable, mobility: int, spinning: Mapping[str, tuple[str, str]]) -> Plan:
    """All links as one module whose joints may constrain more than the links have freedoms."""
    bodies = list(table.numbers)[1:]
    module = table.module(bodies, {table.mechanism.fixed_link}, list(table.mechanism.gears))
    return Plan((replace(module, kind="general", redundant=True),), mobility, tuple(spinning))


class LinkTable:
    """The links, joints and constraints of a mechanism, looked up rather than searched for.

    spinning: links whose spin is free, with their two joints. numbers: of the links in the formula, 0 for the ground,
    the others in file order; joints_of: the joints of each link; links_of: the moving links of each constraint.
    """

    def __init__(self, mechanism: Mechanism, spinning: Mapping[str, tuple[str, str]]) -> None:
        self.mechanism, self.spinning = mechanism, spinning
        self.joints, ground = mechanism.effective_joints, mechanism.fixed_link
        self.order = {name: i for i, name in enumerate(self.joints)}
        links = [ground, *(link for link in mechanism.effective_links if link != ground)]
        self.numbers = {link: i for i, link in enumerate(links)}
        self.joints_of: dict[str, list[str]] = {}
        for name, joint in self.joints.items():
            for link in dict.fromkeys(joint.links):
                self.joints_of.setdefault(link, []).append(name)
        numbered = [(name, (name, i)) for name in self.joints for i in range(taken(mechanism, name))]
        numbered += [(joint, (name, GEAR)) for name, gear in mechanism.gears.items() for joint in gear.joints]
        numbered += [(name, (name, FREEDOMS[mechanism.space])) for name in mechanism.drivers]
        self.links_of: dict[Constraint, list[str]] = {}
        for name, constraint in numbered:
            related = self.links_of.setdefault(constraint, [])
            related += [link for link in dict.fromkeys(self.joints[name].links) if link not in (ground, *related)]
        self.links_of |= {(link, SPIN): [link] for link in spinning}

    def about(self, constraint: Constraint) -> list[str]:
        """The moving links that the line of a spin goes through."""
        ends = self.spinning[constraint[0]] if constraint[1] == SPIN else ()
        return [link for name in ends for link in self.joints[name].links if self.numbers[link]]

    def inside(self, links: list[str], placed: set[str]) -> list[str]:
        """Joints among some links, or between them and the known ones, in file order."""
        reach = placed.union(links)
        touching = {name for link in links for name in self.joints_of.get(link, [])}
        return sorted(
            (name for name in touching if reach.issuperset(self.joints[name].links)), key=self.order.__getitem__
        )

    def symbol(self, joint: str) -> str:
        """The letter of a joint in the formula."""
        return self.joints[joint].pair.symbol

    def module(self, links: list[str], placed: set[str], gears: list[str]) -> Module:
        """The module that the given links form on the links known so far, and through these gear pairs."""
        mechanism, numbers = self.mechanism, self.numbers
        joints = self.inside(links, placed)
        driven = [name for name in joints if name in mechanism.drivers]
        letters = "".join(f"[{self.symbol(name)}]" if name in driven else self.symbol(name) for name in joints)
        letters += "G" * len(gears)
        kind, rank, listed = "general", self.rank(links, joints), ",".join(str(numbers[link]) for link in links)
        if len(links) == 1 and driven == joints and not gears:
            base = next(link for link in self.joints[joints[0]].links if link not in links)
            kind, rank, listed = self.symbol(joints[0]), 1, f"{numbers[base]},{listed}"
            letters = kind
        elif not driven and not gears and (dyad := self.dyad(links, joints)):
            kind, links, joints = dyad
            letters = kind
        place = {link: i for i, link in enumerate(links)}

        def turned_round(name: str) -> bool:
            """A closed form takes the outer link first, and inside the group the link it lists first."""
            first, second = self.joints[name].links
            return kind != "general" and first in place and (second not in place or place[first] > place[second])

        spoken = dict.fromkeys(joint for gear in gears for joint in mechanism.gears[gear].joints)
        return Module(
            kind,
            tuple(links),
            tuple(joints),
            tuple(turned_round(name) for name in joints),
            tuple(driven),
            rank,
            f"{ROMAN.get(rank, rank)}({listed}){letters}",
            gears=tuple(gears),
            witnesses=tuple(joint for joint in spoken if joint not in joints),
            spinning=tuple((link, *self.spinning[link]) for link in links if link in self.spinning),
        )

    def dyad(self, links: list[str], joints: list[str]) -> tuple[str, list[str], list[str]] | None:
        """(kind, links, joints) of a class II group with a closed form: outer joint, inner joint, outer joint."""
        inner = [name for name in joints if set(self.joints[name].links) == set(links)]
        if len(links) != 2 or len(joints) != 3 or len(inner) != 1:
            return None
        first, last = (name for name in joints if name != inner[0])
        outer_links = [link for name in (first, last) for link in self.joints[name].links if link in links]
        if sorted(outer_links) != sorted(links):
            return None
        if outer_links[0] != links[0]:
            first, last = last, first
        for order, sides in (([first, inner[0], last], links), ([last, inner[0], first], links[::-1])):
            kind = "".join(self.symbol(name) for name in order)
            if kind in CLOSED_FORMS[self.mechanism.space]:
                return kind, sides, order
        return None

    def rank(self, links: list[str], joints: list[str]) -> int:
        """Class after Assur and Artobolevski: joints of the richest link, or of the longest loop of links, at least 2.

        A loop of three links counts as one link.
        """
        ends = Counter(link for name in joints for link in self.joints[name].links)
        pairs = {(min(pair), max(pair)) for pair in (self.joints[name].links for name in joints)}
        loop = longest_loop(sorted(pair for pair in pairs if set(pair) <= set(links)))
        return max(2, *(ends[link] for link in links), loop if loop > 3 else 0)
