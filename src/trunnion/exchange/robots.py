"""What MJCF, SDF and URDF have in common: XML, frames, trees of bodies, and pairs as chains of simple joints."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import Element, ElementTree, ParseError, indent

import numpy as np
from defusedxml import DefusedXmlException
from defusedxml.ElementTree import fromstring

from trunnion.algebra.dual import primal
from trunnion.exchange.draft import (
    PARALLEL,
    Array,
    Body,
    Draft,
    Pair,
    Positions,
    components,
    few,
    free_name,
    perpendicular,
    refused,
)

MOST_BYTES, MOST_TAGS, MOST_PARTS = 10_000_000, 200_000, 2_000
LONGEST = 1000  # characters of a row of numbers
MEETING = 1e-8  # m, between the axes of joints that count as crossing
APART = 1e-5  # m, between points of two bodies that a loop holds together, as a program writes their places
WORLD = "world"
LOST = ("loads", "springs", "measures", "variations", "errors")  # sections of a model that no robot format holds


def parsed(path: Path, name: str) -> Element:
    """The root of an XML file; MechanismError if it is none, or its root has another name.

    Entities of its own and references to other files are refused, and so is a file that would fill the memory.
    """
    few(path.stat().st_size, MOST_BYTES, "bytes")
    text = path.read_bytes()
    few(text.count(b"<"), MOST_TAGS, "tags")
    try:
        root: Element = fromstring(text)
    except DefusedXmlException:
        raise refused("declares entities of its own, which are not read", remedy="remove the DOCTYPE") from None
    except ParseError as error:
        raise refused(f"is no sound XML: {error}") from None
    except (LookupError, ValueError):
        raise refused("has an unknown encoding", remedy="save it as UTF-8") from None
    if root.tag != name:
        raise refused(f"begins with <{root.tag}>, not with <{name}>")
    return root


def numbers(text: str | None, where: str, count: int, default: Sequence[float] | None = None) -> Array:
    """The numbers of a text, (count,), or of any count if it is 0; MechanismError if they are none or too few."""
    if not text or text.isspace():
        if default is None:
            raise refused("is not stated", where)
        return np.array(default, dtype=float)
    try:
        values = np.array(text.split() if len(text) < LONGEST else "", dtype=float)
    except ValueError:
        raise refused(f"is {text[:40]!r}, which is no row of numbers", where) from None
    if count and len(values) != count:
        raise refused(f"has {len(values)} numbers instead of {count}", where)
    if not np.isfinite(values).all():
        raise refused(f"is {text[:40]!r}, which is not finite", where)
    return values


def number(text: str | None, where: str, default: float | None = None) -> float:
    """The one number of a text."""
    return float(numbers(text, where, 1, None if default is None else (default,))[0])


def unit(vector: Array, where: str) -> Array:
    """A direction of length 1."""
    length = np.linalg.norm(vector)
    if not length > 0:
        raise refused("has no direction", where)
    return np.asarray(vector / length)


def tensor(xx: float, yy: float, zz: float, xy: float, xz: float, yz: float) -> Array:
    """A symmetric matrix of its entries."""
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def text_of(values: float | Sequence[float] | Array) -> str:
    """Numbers as they are written: every digit, no sign of a zero."""
    return " ".join(repr(float(value) + 0.0) for value in np.ravel(np.asarray(values)))


def written(root: Element, path: Path) -> None:
    """Write an element and all in it as a file."""
    indent(root)
    ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)


# Out: a tree of bodies, with pairs as chains of simple joints


def spanning(draft: Draft) -> tuple[list[Pair], list[Pair]]:
    """The pairs of a tree from the ground, outwards, each with the inner body first, and the pairs that close loops.

    Loops are cut at a ball if they have one, else at a pin: those are what formats can close. A driven pair is the last
    to be cut, since an actuator acts in the tree.
    """
    weights = {"spherical": 3, "revolute": 2, "fixed": 0}
    rest = sorted(draft.pairs.values(), key=lambda pair: 0 if pair.name in draft.drives else weights.get(pair.type, 1))
    tree: list[Pair] = []
    inside = {draft.ground}
    while next_pairs := [pair for pair in rest if len(inside & set(pair.links)) == 1]:
        pair = next_pairs[0]  # the one of least weight: Prim's tree
        tree.append(pair if pair.links[0] in inside else turned(pair))
        inside |= set(pair.links)
    names = {pair.name for pair in tree}
    return tree, [pair for name, pair in draft.pairs.items() if name not in names]


def turned(pair: Pair) -> Pair:
    """The same pair with its bodies in the other order: its coordinate stays."""
    axis, second = -pair.axis, pair.second_axis
    if second is not None:
        axis, second = second, pair.axis
    return replace(pair, links=pair.links[::-1], axis=axis, second_axis=second)


def steps(pair: Pair) -> list[Pair]:
    """A pair as a chain of hinges and slides, the first on its first body; those between are `name.1`, `name.2`."""
    axis, across = pair.axis / np.linalg.norm(pair.axis), perpendicular(pair.axis)
    second = pair.second_axis if pair.second_axis is not None else across
    chains = {
        "cylindrical": (("slide", axis), ("turn", axis)),
        "helical": (("slide", axis), ("turn", axis)),
        "universal": (("turn1", axis), ("turn2", second)),
        "spherical": (("turn1", across), ("turn2", np.cross(axis, across)), ("turn3", axis)),
        "planar": (("slide1", across), ("slide2", np.cross(axis, across)), ("turn", axis)),
    }
    chain = chains.get(pair.type)
    if chain is None:
        return [pair]
    ends = [pair.links[0], *(f"{pair.name}.{number + 1}" for number in range(len(chain) - 1)), pair.links[1]]
    return [
        Pair(
            f"{pair.name}.{step}",
            "prismatic" if step.startswith("slide") else "revolute",
            (ends[place], ends[place + 1]),
            pair.at,
            direction,
            pitch=pair.pitch,
            limits=pair.limits if step == "turn" else None,
        )
        for place, (step, direction) in enumerate(chain)
    ]


def laid_out(
    draft: Draft, lacking: tuple[str, ...]
) -> tuple[dict[str, Array], list[Pair], list[Pair], dict[str, float]]:
    """How a format without pairs of the lacking types holds a draft, all bodies with the global axes.

    Returns the origin of every body, at the joint that carries it, the joints of the tree, those that close its loops,
    and the rates of the driven joints by name. Bodies that the draft has not only hold two joints.
    """
    tree, cuts = spanning(draft)
    origins, inner, closing = {draft.ground: np.zeros(3)}, list[Pair](), list[Pair]()
    for pair in [*tree, *cuts]:
        for step in steps(pair) if pair.type in lacking else [pair]:
            (closing if step.links[1] in origins else inner).append(step)
            origins.setdefault(step.links[1], pair.at)
    rates = {f"{name}.turn" if draft.pairs[name].type in lacking else name: rate for name, rate in draft.drives.items()}
    return origins, inner, closing, rates


def opening(positions: Positions, also: str = "") -> Draft:
    """The draft to write, with notes on what the format cannot hold; also: what else that is."""
    draft, mechanism = positions.draft(), positions.mechanism
    places = (path.split(".") for path, value in mechanism.parameters().items() if np.any(primal(value)))
    entries = {place[2] for place in places if place[0] == "joints" and place[-1] != "pair_factor"}
    lost = [name for name in LOST if getattr(mechanism, name)] + sorted(entries - {"pitch"})
    if any(driver.moves or driver.law != "constant" for driver in mechanism.drivers.values()):
        lost.append("laws of motion")
    if lost := [*lost, *([also] if also else [])]:
        draft.note("exchange.lost", "", f"is written without {', '.join(lost)}")
    draft.name = "".join(sign for sign in draft.name if sign.isprintable())  # XML has no other signs
    for body in draft.bodies.values():
        a, b, c = np.linalg.eigvalsh(body.inertia)
        if a + b - c < 1e-12 * c:  # of a plate, which rounding would make impossible
            body.inertia = body.inertia + 1e-12 * c * np.eye(3)
    if WORLD in draft.bodies and draft.ground != WORLD:
        other = free_name(f"{WORLD}-link", draft.bodies)
        what = f"is written as {other!r}, for {WORLD!r} is the ground of the format"
        draft.note("exchange.name", f"links.{WORLD}", what)
        _rename(draft, {name: other if name == WORLD else name for name in draft.bodies})
    massless = [name for name, body in draft.bodies.items() if name != draft.ground and not body.mass > 0]
    if massless:
        what = f"have no mass, which engines in time refuse: {', '.join(massless)}"
        draft.note("exchange.massless", "links", what, "state masses in the model")
    return draft


def _rename(draft: Draft, names: Mapping[str, str], joints: Mapping[str, str] | None = None) -> None:
    """Give bodies, and joints, other names."""
    joints = joints or {name: name for name in draft.pairs}
    draft.bodies = {names[name]: replace(body, name=names[name]) for name, body in draft.bodies.items()}
    draft.pairs = {
        joints[name]: replace(pair, name=joints[name], links=(names[pair.links[0]], names[pair.links[1]]))
        for name, pair in draft.pairs.items()
    }
    draft.drives = {joints[name]: rate for name, rate in draft.drives.items() if name in joints}
    draft.ground = names.get(draft.ground, "")


# In: chains made pairs again, and names and grounds as a model has them


class Scene:
    """What a file holds, as it is read.

    Parameters
    ----------
    name : of the model.
    draft : bodies, pairs and drives by their names in the file.
    between : bodies that are only there to hold two joints of a row.
    couplings : pairs of joints of which the first moves by a ratio of the second.
    """

    def __init__(self, name: str) -> None:
        self.draft = Draft(name)
        self.between: set[str] = set()
        self.couplings: list[tuple[str, str, float]] = []

    def add_body(self, name: str) -> Body:
        """A new body."""
        if name in self.draft.bodies:
            raise refused(f"the body {name!r} stands in it twice")
        self.draft.bodies[name] = Body(name)
        return self.draft.bodies[name]

    def add_pair(self, pair: Pair) -> None:
        """A new pair."""
        if pair.name in self.draft.pairs:
            raise refused(f"the joint {pair.name!r} stands in it twice")
        if pair.links[0] == pair.links[1]:
            raise refused(f"joins {pair.links[0]!r} to itself", f"joint {pair.name}")
        self.draft.pairs[pair.name] = pair

    def settled(self, world: str, ground: str) -> Draft:
        """The draft: its chains joined, its ground named, its names as a model has them.

        world: the body that does not move, if the draft has it; it has the name of a body that is fixed to it if it
        carries nothing else. ground: of the options, which goes before it.
        """
        draft = self.draft
        if not draft.pairs:
            raise refused("has no joints")
        few(max(len(draft.bodies), len(draft.pairs)), MOST_PARTS, "bodies or joints")
        for name, other, ratio in self.couplings:  # a thread turns and slides one body; others are gears
            coupled, ends = ratio, [draft.pairs[key] for key in (name, other) if key in draft.pairs]
            if len(ends) == 2 and ratio:
                slide, turn = ends
                if slide.type == "revolute":
                    slide, turn, coupled = turn, slide, 1 / ratio
                along = float(slide.axis @ turn.axis / (np.linalg.norm(slide.axis) * np.linalg.norm(turn.axis)))
                common = set(slide.links) & set(turn.links) & self.between
                if (slide.type, turn.type) == ("prismatic", "revolute") and common and abs(along) > 1 - PARALLEL:
                    turn.pitch = 2 * math.pi * coupled * along
                    continue
            what = f"are coupled, which is not read: {name} moves by {ratio:.6g} of {other}"
            draft.warn("exchange.gears", "joints", what, "state it under gears in the model")
        self._join()
        busiest = max(draft.bodies, key=lambda name: len(draft.pairs_of(name)))
        start = next(name for name in (ground, world, busiest) if draft.pairs_of(name))
        groups = components(draft.bodies, [pair.links for pair in draft.pairs.values()])
        reached = next(group for group in groups if start in group)
        free = [name for name in draft.bodies if name not in reached]
        if free:
            listed = ", ".join(free[:10]) + " …" * (len(free) > 10)
            what = f"are joined to nothing that is fixed, and left out: {listed}"
            draft.warn("exchange.free", "links", what, "join them to the ground, or state another one with --ground")
        draft.bodies = {name: body for name, body in draft.bodies.items() if name in reached}
        draft.pairs = {name: pair for name, pair in draft.pairs.items() if pair.links[0] in reached}
        draft.ground = start if start in (ground, world) else ""
        base = draft.pairs_of(WORLD)
        if draft.ground == WORLD and base and all(pair.type == "fixed" for pair in base):
            draft.ground = next(link for link in base[0].links if link != WORLD)
        names, joints = dict[str, str](), dict[str, str]()
        for name in draft.bodies:
            names[name] = free_name(name, names.values(), "body")
        for name in draft.pairs:
            joints[name] = free_name(name, joints.values(), "joint")
        for name, body in draft.bodies.items():  # points without the name of the body, which they have in a file
            points: dict[str, Array] = {}
            for key, place in body.points.items():
                points[free_name(key.removeprefix(f"{name}."), [*points, *joints.values()], "point")] = place
            body.points = points
        _rename(draft, names, joints)
        return draft

    def _join(self) -> None:
        """Make one pair of joints in a row, where there is such a pair."""
        draft = self.draft
        outward = {pair.links[0]: pair for pair in draft.pairs.values() if pair.links[0] in self.between}
        inner = {pair.links[1] for pair in draft.pairs.values()} & outward.keys()
        pairs: dict[str, Pair] = {}
        for name, pair in draft.pairs.items():
            if pair.links[0] in inner:
                continue
            chain = [pair]
            while chain[-1].links[1] in inner:
                chain.append(outward[chain[-1].links[1]])
            made = _pair_of(chain, draft.drives) if len(chain) > 1 else None
            if made is None:
                pairs |= {step.name: step for step in chain}
                continue
            made.name = made.name if made.name not in draft.pairs else name
            pairs[made.name] = made
            for step in chain:
                if step.name in draft.drives:
                    draft.drives[made.name] = draft.drives.pop(step.name)
                if step.links[1] in inner:
                    del draft.bodies[step.links[1]]
        draft.pairs = pairs


def stem(names: Sequence[str]) -> str:
    """What names of parts of a joint begin with, such as B of B.turn1 and B.turn2; the first if that is nothing."""
    stems = {name.rpartition(".")[0] for name in names}
    begin = stems.pop() if len(stems) == 1 else os.path.commonprefix(names)  # noqa: RUF071, of letters
    return begin.rstrip("._-: ") or names[0]


def _pair_of(chain: list[Pair], drives: Mapping[str, float]) -> Pair | None:
    """The pair that joints in a row are; None if they are none."""
    turns = [step for step in chain if step.type == "revolute"]
    slides = [step for step in chain if step.type == "prismatic"]
    name = stem([step.name for step in chain])
    links = (chain[0].links[0], chain[-1].links[1])
    driven = [step for step in chain if step.name in drives]
    if len(turns) + len(slides) < len(chain) or (driven and driven != turns):
        return None
    axes = [step.axis / np.linalg.norm(step.axis) for step in [*turns, *slides]]
    counts = len(turns), len(slides)
    if counts == (1, 1) and np.linalg.norm(np.cross(axes[0], axes[1])) < PARALLEL:
        kind = "cylindrical" if turns[0].pitch is None else "helical"
        return replace(turns[0], name=name, type=kind, links=links)
    if counts == (1, 2) and not driven and np.linalg.norm(np.cross(axes[1], axes[2])) > PARALLEL:
        square = max(abs(axes[0] @ axes[1]), abs(axes[0] @ axes[2])) < PARALLEL
        return Pair(name, "planar", links, turns[0].at, axes[0]) if square else None
    if slides or driven or len(turns) not in (2, 3):
        return None
    normal = [np.eye(3) - np.outer(axis, axis) for axis in axes]
    place, _, rank, _ = np.linalg.lstsq(
        np.concatenate(normal), np.concatenate([n @ step.at for n, step in zip(normal, turns, strict=True)]), rcond=1e-9
    )
    gaps = [float(np.linalg.norm(n @ (place - step.at))) for n, step in zip(normal, turns, strict=True)]
    if rank < 3 or max(gaps) > MEETING:
        return None
    if counts == (2, 0):
        return Pair(name, "universal", links, place, axes[0], axes[1]) if abs(axes[0] @ axes[1]) < PARALLEL else None
    return Pair(name, "spherical", links, place) if abs(np.linalg.det(axes)) > PARALLEL else None
