"""A mechanism whose joints in play are taken out: its links are held by contacts, and more coordinates are free.

A pin in play takes no freedom away. Without its joint the linkage has more coordinates, two in the plane and five in
space, or four where the pin slides. They are coordinates of joints that remain, in the loop of the joint, chosen so
that the modules become as small as can be. A link that no joint holds any more has the place of its mass centre and
its turn for coordinates, by joints to the ground that carry nothing. In space a driver cannot move all freedoms of a
ball or a cylinder: such joints in the loop become chains of single turns and slides (`dynamics.chains`). So motion in
time needs nothing new for play: the offset of a pin in its hole follows from the coordinates.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import single
from trunnion.algebra.nested import flat
from trunnion.dynamics.chains import Chain, chain_of_joint, hanging_chain
from trunnion.dynamics.rates import Layout
from trunnion.dynamics.start import initial_row
from trunnion.dynamics.state import FreeMotion
from trunnion.errors import Finding, MechanismError
from trunnion.joints.pairs import PAIRS
from trunnion.model.mechanism import Mechanism
from trunnion.model.parameters import Numbers
from trunnion.model.parts import Driver
from trunnion.solve.forward import Forward
from trunnion.solve.run import Run
from trunnion.structure.decompose import decompose, mobility_by_formula
from trunnion.structure.passive import passive

__all__ = ["Opened", "in_play", "is_rigid", "of_several", "opened"]

Array = NDArray[np.float64]

KEPT = (
    "trunnion", "name", "space", "gravity", "dimensions", "links", "ground", "joints", "joint_defaults", "drivers",
    "loads", "tables", "springs", "gears", "assembly", "errors", "fits",
)  # fmt: skip
PARTS = ("x", "y", "turn")  # of the way to the ground of a link that no joint holds
MOST_CHOICES = 5000
BESIDE = 0.1  # of the size
SHARE = (
    1e-3  # of a radian or of the size: how far the stated motion of a coordinate that is freed goes, which is not it
)


@dataclass(frozen=True)
class Opened:
    """mechanism: without the joints in play, with more free drivers; run: of the mechanism as it is stated; parts: the
    single turns and slides that stand in for a joint of several freedoms, by joint."""

    mechanism: Mechanism
    run: Run
    parts: Mapping[str, tuple[str, ...]]


def in_play(mechanism: Mechanism) -> list[str]:
    """Joints that state a contact."""
    return [name for name, joint in mechanism.effective_joints.items() if joint.contact is not None]


def is_rigid(mechanism: Mechanism) -> bool:
    """Whether the joints in play are between bodies that do not give."""
    return any(joint.contact.of.rigid for joint in mechanism.effective_joints.values() if joint.contact is not None)


def opened(run: Run) -> Opened:
    """A prepared mechanism without its joints in play. It begins with every pin in the middle of its hole, with the
    velocities of the linkage without play."""
    mechanism, cut = run.system.mechanism, in_play(run.system.mechanism)
    walk, spatial = _start(run), mechanism.space == "spatial"
    if not all(np.all(np.isfinite(number)) for motion in walk.motions.values() for number in flat(motion[:2])):
        what = "the mechanism without play has no position at its start, from which the motion is to begin"
        raise MechanismError(Finding(what, "drivers", "begin at another coordinate: initial: {coordinate: …}"))
    data = {key: part for key, part in mechanism.data().items() if key in KEPT}
    several = of_several(mechanism)
    _leave_out(data, mechanism, [*cut, *several])
    coordinates, parts = dict[str, tuple[float, float]](), dict[str, tuple[str, ...]]()
    for joint in several:
        chain = chain_of_joint(run, walk, joint)
        _put(data, mechanism.effective_joints[joint].links, chain)
        coordinates.update(chain.coordinates)
        parts[joint] = tuple(chain.joints)
    single = list(coordinates)
    for link in _loose(data, mechanism):
        if spatial:
            chain = hanging_chain(run, walk, link)
            _put(data, (mechanism.fixed_link, link), chain)
            coordinates.update(chain.coordinates)
        else:
            coordinates.update(_hang(data, mechanism.fixed_link, link, walk))
    base = Mechanism(**data)
    hung = [name for name in coordinates if name not in single]
    missing = mobility_by_formula(base) - len(passive(base)) - len(base.drivers) - len(hung)
    chosen = _chosen(base, hung, max(missing, 0), cut, run)
    by_joint = {name: coordinates.get(name) or _coordinate(walk, name) for name in (*hung, *chosen)}
    data["drivers"] = {**data.get("drivers", {}), **_drivers(run, base, by_joint)}
    return Opened(Mechanism(**data), run, parts)


def _leave_out(data: dict[str, Any], mechanism: Mechanism, without: Sequence[str]) -> None:
    """Take joints out of what a file says."""
    data["joints"] = {name: entry for name, entry in data["joints"].items() if name not in without}
    data["assembly"] = {name: entry for name, entry in data.get("assembly", {}).items() if name not in without}
    errors = data.get("errors", {}).items()
    data["errors"] = {name: entry for name, entry in errors if not _of(mechanism.path_of(name), without)}
    data["links"] = {name: {**entry, "points": dict(entry["points"])} for name, entry in data["links"].items()}


def _of(path: str, joints: Sequence[str]) -> bool:
    """Whether a number is one of these joints."""
    return any(path.startswith(f"joints.{name}.") for name in joints)


def _start(run: Run) -> Forward:
    """The walk of the mechanism as stated at the start, with the stated initial motion of its free drivers."""
    names = [name for name, driver in run.system.mechanism.drivers.items() if driver.found]
    if not names:
        return run.walk(np.zeros(1))
    motion = FreeMotion.of(run)
    row = initial_row(motion)[:, None]
    at = Layout.of(motion).moment(np.zeros(1), row)
    return motion.walk(at, np.zeros_like(at.q))


def _coordinate(walk: Forward, joint: str) -> tuple[float, float]:
    """Coordinate of a joint and its rate at the start."""
    which = 0 if walk.system.turns(joint) else 1
    return single(walk.coordinates(joint)[which]), single(walk.rates(joint)[which])


# ---- links that no joint holds --------------------------------------------------------------------------------


def _loose(data: Mapping[str, Any], mechanism: Mechanism) -> list[str]:
    """One link of every part of the mechanism that no joint connects with the ground any more: the heaviest."""
    part = {link: {link} for link in data["links"]}
    for joint in data["joints"].values():
        first, other = (part[link] for link in joint["links"])
        if first is not other:
            first |= other
            part.update(dict.fromkeys(other, first))
    ground = part[mechanism.fixed_link]
    others = {id(links): links for links in part.values() if links is not ground}
    mass = mechanism.parameters()
    return [
        max((link for link in mechanism.links if link in links), key=lambda link: mass[f"links.{link}.mass"])
        for links in others.values()
    ]


def _hang(data: dict[str, Any], ground: str, link: str, walk: Forward) -> dict[str, tuple[float, float]]:
    """Connect a loose link with the ground by slides along x and y and a turn; their coordinates and rates."""
    along, across, turn = names = [f"{link}_in_play_{part}" for part in PARTS]
    carriers = [f"{along}_carrier", f"{across}_carrier"]
    place = _turning_point(data, link, walk)
    links = data["links"]
    x, y = {"at": [0, 0], "axis": [1, 0]}, {"at": [0, 0], "axis": [0, 1]}
    links[ground]["points"][along] = x
    links[carriers[0]] = {"points": {along: x, across: y}}
    links[carriers[1]] = {"points": {across: y, turn: [0, 0]}}
    links[link]["points"][turn] = list(place)
    ends = ([ground, carriers[0]], carriers, [carriers[1], link])
    for name, kind, pair in zip(names, ("prismatic", "prismatic", "revolute"), ends, strict=True):
        data["joints"][name] = {"type": kind, "links": pair, "friction": 0, "seat": "free"}
    at, frame, twist = walk.at(link, place), walk.motions[link].frame, walk.motions[link].twist
    angle = np.arctan2(single(frame.s), single(frame.c))
    return {
        along: (single(at.place[0]), single(at.velocity[0])),
        across: (single(at.place[1]), single(at.velocity[1])),
        turn: (float(angle), single(twist.w)),
    }


def _turning_point(data: Mapping[str, Any], link: str, walk: Forward) -> tuple[float, ...]:
    """The mass centre of a link; beside it where a joint is, for two that turn at one point move nothing."""
    x, y = (single(part) for part in walk.system.centre(walk.values, link))
    joints = [name for name, joint in data["joints"].items() if link in joint["links"]]
    places = {tuple(single(walk.values[f"links.{link}.points.{name}.{axis}"]) for axis in "xy") for name in joints}
    return (x + BESIDE * single(walk.system.size(walk.values)) if (x, y) in places else x), y


# ---- chains in space ------------------------------------------------------------------------------------------


def of_several(mechanism: Mechanism) -> list[str]:
    """Joints in loops with those in play that have more freedoms than a driver can move: chains stand in for them."""
    cut = in_play(mechanism)
    if mechanism.space != "spatial" or not cut:
        return []
    nearby, joints = _loop(mechanism, cut), mechanism.effective_joints
    return [name for name in joints if name in nearby and PAIRS[joints[name].type].count > 1]


def _put(data: dict[str, Any], links: tuple[str, str], chain: Chain) -> None:
    """Put a chain between two links."""
    for link, points in zip(links, chain.points, strict=True):
        data["links"][link]["points"].update(points)
    data["links"].update(chain.links)
    data["joints"].update(chain.joints)


# ---- coordinates ----------------------------------------------------------------------------------------------


def _chosen(base: Mechanism, hung: list[str], count: int, cut: Sequence[str], run: Run) -> tuple[str, ...]:
    """The joints whose coordinates become free: with them every module is as small as can be."""
    joints = [
        name
        for name, joint in base.effective_joints.items()
        if name not in base.drivers and name not in hung and PAIRS[joint.type].drivable
    ]
    nearby = _loop(run.system.mechanism, cut)
    joints.sort(key=lambda name: name not in nearby)
    best: tuple[tuple[int, int], tuple[str, ...]] | None = None
    for tried in itertools.islice(itertools.combinations(joints, count), MOST_CHOICES):
        drivers = dict.fromkeys((*hung, *tried), Driver(free=True))
        try:
            plan = decompose(Numbers.model_copy(base, update={"drivers": {**base.drivers, **drivers}}))  # unchecked
        except MechanismError:
            continue
        sizes = [len(module.links) for module in plan.modules]
        cost = max(sizes), -len(sizes)
        if best is None or cost < best[0]:
            best = cost, tried
        if max(sizes) == 1:
            break
    if best is None:
        what = f"without {', '.join(cut)} no {count} coordinates of other joints determine the mechanism"
        raise MechanismError(Finding(what, "joints", "let fewer joints be in play"))
    return best[1]


def _loop(mechanism: Mechanism, cut: Sequence[str]) -> set[str]:
    """Joints on the shortest ways around the joints that are cut."""
    links_of_loop: set[str] = set()
    for name in cut:
        first, second = mechanism.effective_joints[name].links
        links_of_loop.update(_way(mechanism, first, second, set(cut)))
    return links_of_loop


def _way(mechanism: Mechanism, first: str, second: str, without: set[str]) -> Iterator[str]:
    """Joints on the shortest way from a link to another."""
    came: dict[str, tuple[str, str] | None] = {first: None}
    front = [first]
    while front and second not in came:
        ahead: list[str] = []
        for name, joint in mechanism.effective_joints.items():
            for here, next_link in (joint.links, joint.links[::-1]):
                if name not in without and here in front and next_link not in came:
                    came[next_link] = (name, here)
                    ahead.append(next_link)
        front = ahead
    while (step := came.get(second)) is not None:
        yield step[0]
        second = step[1]


def _drivers(run: Run, base: Mechanism, coordinates: Mapping[str, tuple[float, float]]) -> dict[str, dict[str, Any]]:
    """Free drivers of the coordinates, from where they are at the start.

    What they are stated to do otherwise is next to nothing, in the time of one cycle: it chooses the assembly there.
    """
    size, duration = single(run.system.size(run.values)), run.cycle.duration or 1.0
    drivers_made: dict[str, dict[str, Any]] = {}
    for name, (coordinate, rate) in coordinates.items():
        span = SHARE * (1.0 if PAIRS[base.effective_joints[name].type].turns else size)
        drivers_made[name] = {
            "free": True,
            "speed": span / duration,
            "range": [coordinate, coordinate + span],
            "initial": {"coordinate": coordinate, "speed": rate},
        }
    return drivers_made
