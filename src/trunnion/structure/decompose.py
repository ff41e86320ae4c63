"""A mechanism as a row of modules: drivers and Assur groups, in the order in which motion flows.

Every joint takes freedoms from the two links it joins, every driver one more. Matching each of these constraints
to a freedom of one link says which link it determines; a link then depends on the other links of the
constraints that determine it. Links that depend on each other are one module (a strongly connected component),
and the modules follow each other as their dependence demands. So any class of group is found by the same graph
work.  [THEORY of the docs, "Structure"; D 17 for the formula]
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import networkx as nx
import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError
from trunnion.joints.pairs import PAIRS
from trunnion.model.mechanism import Mechanism
from trunnion.structure.mobility import RANK_TOLERANCE, constraints, rank

__all__ = ["FREEDOMS", "Module", "Plan", "decompose", "mobility_by_formula", "passive"]

FREEDOMS = {"planar": 3, "spatial": 6}  # of a free link
SEED = 1916  # of the generic dimensions
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
    for link in mechanism.links:
        joints = [name for name, joint in mechanism.joints.items() if link in joint.links]
        balls = [name for name in joints if mechanism.joints[name].type == "spherical"]
        if link == mechanism.fixed_link or len(joints) != 2 or not balls:
            continue
        if len(balls) == 2 or _through(mechanism, link, balls[0], *(name for name in joints if name not in balls)):
            found[link] = (joints[0], joints[1])
    return found


def _through(mechanism: Mechanism, link: str, ball: str, other: str) -> bool:
    """Whether the axis of a joint that turns goes through the centre of a ball on the same link."""
    if mechanism.joints[other].type not in ("revolute", "cylindrical") or other in mechanism.drivers:
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
    bodies = [link for link in mechanism.effective_links if link != ground]
    spinning = passive(mechanism)
    determines = _match(mechanism, bodies, ground, spinning)
    if mechanism.space == "spatial":
        findings = _undriven(mechanism, mobility - len(spinning), len(spinning))
        unheld = FREEDOMS["spatial"] * len(bodies) > len(determines)
        if not findings and (unheld or mobility - len(spinning) < len(mechanism.drivers)):
            return Plan((_whole(mechanism, bodies, spinning),), mobility, tuple(spinning))
    else:
        findings = _undetermined(mechanism, mobility, bodies)
    if findings:
        raise MechanismError(findings)
    dependence = nx.DiGraph()
    dependence.add_nodes_from(bodies)
    for constraint, body in determines.items():
        for other in _links_of(mechanism, constraint):
            if other not in (body, ground):
                dependence.add_edge(other, body)
    parts = nx.condensation(dependence)
    place = {body: i for i, body in enumerate(bodies)}
    order = nx.lexicographical_topological_sort(
        parts, key=lambda part: min(place[b] for b in parts.nodes[part]["members"])
    )
    known = {ground}
    modules: list[Module] = []
    for part in order:
        members = sorted(parts.nodes[part]["members"], key=place.__getitem__)
        gears = [name for (name, i), body in determines.items() if i == GEAR and body in members]
        modules.append(_module(mechanism, members, known, gears, spinning))
        known |= set(members)
    return Plan(tuple(modules), mobility, tuple(spinning))


GEAR, SPIN = -1, -2
Constraint = tuple[str, int]  # of a joint, the number of a freedom it takes; of a gear pair, GEAR; of a link, SPIN


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


def _match(mechanism: Mechanism, bodies: list[str], ground: str, spinning: Iterable[str]) -> dict[Constraint, str]:
    """Each constraint with the link it determines: a maximum matching onto the links' freedoms."""
    graph = nx.Graph()
    constraints = _constraints(mechanism) + [(link, SPIN) for link in spinning]
    graph.add_nodes_from(constraints)
    for constraint in constraints:
        for link in _links_of(mechanism, constraint):
            if link != ground:
                graph.add_edges_from((constraint, ("freedom", link, i)) for i in range(FREEDOMS[mechanism.space]))
    matching = nx.bipartite.maximum_matching(graph, top_nodes=constraints)
    return {c: matching[c][1] for c in constraints if c in matching}


def _undetermined(mechanism: Mechanism, mobility: int, bodies: list[str]) -> list[Finding]:
    """What keeps the drivers from determining the motion exactly."""
    drivers = len(mechanism.drivers)
    if mobility != drivers:
        return _undriven(mechanism, mobility, 0, exactly=True)
    matrix, owners = _generic_constraints(mechanism)
    if rank(matrix) == matrix.shape[1]:
        return []
    left, values, right = np.linalg.svd(matrix)
    free = values <= RANK_TOLERANCE * max(values, default=0.0)
    strained = np.abs(left[:, : len(values)][:, free]).max(axis=1) > RANK_TOLERANCE
    loose = np.abs(right[: len(values)][free]).max(axis=0).reshape(-1, FREEDOMS["planar"]).max(axis=1) > RANK_TOLERANCE
    twice = list(dict.fromkeys(name for name, bad in zip(owners, strained, strict=True) if bad))
    links = [body for body, bad in zip(bodies, loose, strict=True) if bad]
    told = ", ".join(f"{name} (driven)" if name in mechanism.drivers else name for name in twice)
    what = f"one part is constrained twice, by the joints {told}, while the links {', '.join(links)} stay undetermined"
    return [Finding(what, "joints", "move a joint or a driver from the part that is held twice to the loose one")]


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


def _generic_constraints(mechanism: Mechanism) -> tuple[NDArray[np.float64], list[str]]:
    """Constraints of joints and drivers for dimensions without any special relation."""
    rng = np.random.default_rng(SEED)
    joints = {name: (joint.type, joint.links) for name, joint in mechanism.effective_joints.items()}
    angles = rng.uniform(0.0, 2 * np.pi, len(joints))
    places = {
        name: (*rng.uniform(-1.0, 1.0, 2), float(np.cos(angle)), float(np.sin(angle)))
        for name, angle in zip(joints, angles, strict=True)
    }
    gears = {name: (gear.joints, float(rng.uniform(0.3, 0.9))) for name, gear in mechanism.gears.items()}
    return constraints(
        list(mechanism.effective_links), mechanism.fixed_link, joints, places, list(mechanism.drivers), gears
    )


def _whole(mechanism: Mechanism, links: list[str], spinning: Mapping[str, tuple[str, str]]) -> Module:
    """All links as one module, whose joints constrain more than its links have freedoms."""
    module = _module(mechanism, links, {mechanism.fixed_link}, [], spinning)
    return replace(module, kind="general", redundant=True)


def _module(
    mechanism: Mechanism, links: list[str], known: set[str], gears: list[str], spinning: Mapping[str, tuple[str, str]]
) -> Module:
    """The module that the given links form on the links known so far, and through these gear pairs."""
    joints = [name for name, joint in mechanism.effective_joints.items() if _belongs(joint.links, links, known)]
    driven = [name for name in joints if name in mechanism.drivers]
    numbers = _numbers(mechanism)
    letters = "".join(
        f"[{PAIRS[mechanism.effective_joints[name].type].symbol}]"
        if name in driven
        else PAIRS[mechanism.effective_joints[name].type].symbol
        for name in joints
    ) + "G" * len(gears)
    if len(links) == 1 and driven == joints and not gears:
        base = next(link for link in mechanism.effective_joints[joints[0]].links if link not in links)
        letter = PAIRS[mechanism.effective_joints[joints[0]].type].symbol
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


def _belongs(pair: tuple[str, str], links: list[str], known: set[str]) -> bool:
    """Whether a joint is inside the module or between it and the known links."""
    return any(link in links for link in pair) and all(link in links or link in known for link in pair)


def _numbers(mechanism: Mechanism) -> dict[str, int]:
    """Link numbers of the formula: 0 for the ground, the others in file order."""
    others = [link for link in mechanism.effective_links if link != mechanism.fixed_link]
    return {mechanism.fixed_link: 0, **{link: i for i, link in enumerate(others, 1)}}


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
    inner = nx.Graph()
    inner.add_nodes_from(links)
    most = 2
    for link in links:
        most = max(most, sum(link in mechanism.effective_joints[name].links for name in joints))
    for name in joints:
        a, b = mechanism.effective_joints[name].links
        if a in links and b in links:
            inner.add_edge(a, b)
    loops = nx.minimum_cycle_basis(inner)
    return max([most, *(len(loop) for loop in loops if len(loop) > 3)])


def _assembled(
    mechanism: Mechanism, kind: str, links: list[str], joints: list[str], driven: list[str], rank: int, label: str
) -> Module:
    def reversed_(name: str) -> bool:
        """A closed form takes the outer link first, and inside the group the link it lists first."""
        first, second = mechanism.effective_joints[name].links
        if kind == "general":
            return False  # its joints are as the file has them
        return first in links and (second not in links or links.index(first) > links.index(second))

    flags = tuple(reversed_(name) for name in joints)
    return Module(kind, tuple(links), tuple(joints), flags, tuple(driven), rank, label)
