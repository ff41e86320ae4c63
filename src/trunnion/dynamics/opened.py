"""A mechanism whose joints in play are taken out: its links are held by contacts, and more coordinates are free.

A pin in play takes no freedom away. Without its joint the linkage has more coordinates, two in the plane and five in
space, or four where the pin slides. They are coordinates of joints that remain, in the loop of the joint, chosen so
that the modules become as small as can be. A link that no joint holds any more has the place of its mass centre and
its turn for coordinates, by joints to the ground that carry nothing. In space a driver cannot move all freedoms of a
ball or a cylinder: such joints in the loop become chains of single turns and slides. So motion in
time needs nothing new for play: the offset of a pin in its hole follows from the coordinates.

Every freedom of a chain is a coordinate that a driver can move. Its joints carry nothing but what the joint itself
carried. All are counted from the pose at the start, about axes at right angles to each other there. Three turns leave a
direction in which the links cannot turn where the third axis lies along the first: the axes are chosen so that this is
as far as can be from all poses of the cycle.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal, single
from trunnion.algebra.namespace import each, flat
from trunnion.algebra.space import moment_at
from trunnion.dynamics.rates import Layout
from trunnion.dynamics.start import initial_row
from trunnion.dynamics.state import FreeMotion
from trunnion.errors import Finding, MechanismError
from trunnion.model.mechanism import Mechanism
from trunnion.model.parameters import Numbers
from trunnion.model.parts import Driver
from trunnion.solve.forward import Forward, SpatialWalk
from trunnion.solve.run import Run
from trunnion.structure.decompose import decompose, mobility_by_formula
from trunnion.structure.graph import reached
from trunnion.structure.passive import passive

Array = NDArray[np.float64]


KEPT = (
    "trunnion", "name", "space", "gravity", "dimensions", "links", "ground", "joints", "joint_defaults", "drivers",
    "loads", "tables", "springs", "gears", "assembly", "errors", "fits",
)  # fmt: skip
MOST_CHOICES = 5000
BESIDE = 0.1  # of the size
SHARE = 1e-3  # of a radian or of the size: how far a coordinate that is freed is stated to go, which it does not
LOOKS = 73  # poses of the cycle at which axes of three turns are tried
MEETING = 0.99  # cosine of the angle of first and third axis: nearer they are as good as one
ANGLES = 24  # of the third axis about the first, and directions of the first beside those of the motion
Starts = dict[str, tuple[float, float]]  # coordinates and their rates at the start, by joint


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


def opened(run: Run) -> Opened:
    """A prepared mechanism without its joints in play. It begins with every pin in the middle of its hole, with the
    velocities of the linkage without play."""
    mechanism, cut = run.system.mechanism, in_play(run.system.mechanism)
    walk = _start(run)
    if not all(np.all(np.isfinite(number)) for motion in walk.motions.values() for number in flat(motion[:2])):
        what = "the mechanism without play has no position at its start, from which the motion is to begin"
        raise MechanismError(Finding(what, "drivers", "begin at another coordinate: initial: {coordinate: …}"))
    data = {key: part for key, part in mechanism.data().items() if key in KEPT}
    several = of_several(mechanism)
    without = [*cut, *several]
    paths = tuple(f"joints.{name}." for name in without)
    data["joints"] = {name: entry for name, entry in data["joints"].items() if name not in without}
    data["assembly"] = {name: entry for name, entry in data.get("assembly", {}).items() if name not in without}
    errors = data.get("errors", {}).items()
    data["errors"] = {name: entry for name, entry in errors if not mechanism.path_of(name).startswith(paths)}
    data["links"] = {name: {**entry, "points": dict(entry["points"])} for name, entry in data["links"].items()}
    chains = {joint: _chain_of_joint(data, run, walk, joint) for joint in several}
    hung: Starts = {}
    for link in _loose(data, mechanism):
        hung |= _hang(data, run, walk, link)
    base = Mechanism(**data)
    missing = mobility_by_formula(base) - len(passive(base)) - len(base.drivers) - len(hung)
    starts = {name: start for chain in chains.values() for name, start in chain.items()} | hung
    for name in _chosen(base, list(hung), max(missing, 0), cut, run):
        if name not in starts:
            which = 0 if run.system.turns(name) else 1
            starts[name] = single(walk.coordinates(name)[which]), single(walk.rates(name)[which])
        hung[name] = starts[name]
    data["drivers"] = {**data.get("drivers", {}), **_drivers(run, base, hung)}
    return Opened(Mechanism(**data), run, {joint: tuple(chain) for joint, chain in chains.items()})


def _start(run: Run) -> Forward:
    """The walk of the mechanism as stated at the start, with the stated initial motion of its free drivers."""
    if not any(driver.found for driver in run.system.mechanism.drivers.values()):
        return run.walk(np.zeros(1))
    motion = FreeMotion.of(run)
    at = Layout.of(motion).moment(np.zeros(1), initial_row(motion)[:, None])
    return motion.walk(at)


def of_several(mechanism: Mechanism) -> list[str]:
    """Joints in loops with those in play that have more freedoms than a driver can move: chains stand in for them."""
    cut = in_play(mechanism)
    if mechanism.space != "spatial" or not cut:
        return []
    nearby, joints = _loop(mechanism, cut), mechanism.effective_joints
    return [name for name in joints if name in nearby and joints[name].pair.count > 1]


# ---- links and joints -----------------------------------------------------------------------------------------


def _loop(mechanism: Mechanism, cut: Sequence[str]) -> set[str]:
    """Joints on the shortest ways around the joints that are cut."""
    edges = {name: joint.links for name, joint in mechanism.effective_joints.items() if name not in cut}
    nearby = set[str]()
    for cut_joint in cut:
        first, last = mechanism.effective_joints[cut_joint].links
        came, ahead = dict[str, tuple[str, str]](), [first]
        for link in ahead:
            for name, (one_end, other_end) in edges.items():
                farther = other_end if link == one_end else one_end if link == other_end else first
                if farther != first and farther not in came:
                    came[farther] = name, link
                    ahead.append(farther)
        while last in came:
            name, last = came[last]
            nearby.add(name)
    return nearby


def _loose(data: Mapping[str, Any], mechanism: Mechanism) -> list[str]:
    """One link of every part of the mechanism that no joint connects with the ground any more: the heaviest."""
    pairs, mass = [joint["links"] for joint in data["joints"].values()], mechanism.parameters()
    parts = [
        reached([link], lambda link: (at for pair in pairs if link in pair for at in pair)) for link in data["links"]
    ]
    return [
        max((link for link in mechanism.links if link in part), key=lambda link: mass[f"links.{link}.mass"])
        for part in dict.fromkeys(map(frozenset, parts))
        if mechanism.fixed_link not in part
    ]


def _chosen(base: Mechanism, hung: list[str], count: int, cut: Sequence[str], run: Run) -> tuple[str, ...]:
    """The joints whose coordinates become free: with them every module is as small as can be."""
    nearby = _loop(run.system.mechanism, cut)
    joints = [
        name
        for name, joint in base.effective_joints.items()
        if name not in base.drivers and name not in hung and joint.pair.one_axis
    ]
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


def _drivers(run: Run, base: Mechanism, coordinates: Mapping[str, tuple[float, float]]) -> dict[str, dict[str, Any]]:
    """Free drivers of the coordinates, from where they are at the start.

    What they are stated to do otherwise is next to nothing, in the time of one cycle: it chooses the assembly there.
    """
    size, duration = single(run.system.size(run.values)), run.cycle.duration or 1.0
    spans = {name: SHARE * (1.0 if base.effective_joints[name].pair.turns else size) for name in coordinates}
    return {
        name: {
            "free": True,
            "speed": spans[name] / duration,
            "range": [coordinate, coordinate + spans[name]],
            "initial": {"coordinate": coordinate, "speed": rate},
        }
        for name, (coordinate, rate) in coordinates.items()
    }


# ---- chains ---------------------------------------------------------------------------------------------------


def _chained(
    data: dict[str, Any], name: str, links: tuple[str, str], kinds: str, ends: tuple[Any, Any], inside: Sequence[Any],
    starts: Sequence[tuple[float, float]],
) -> Starts:  # fmt: skip
    """Put a chain of turns and slides between two links. kinds: of its joints, R or P; ends: its points on the first
    and on the last link; inside: points of its joints on the links between; starts: coordinates and rates."""
    names = [f"{name}_in_play_{k}" for k in range(1, len(kinds) + 1)]
    row = [links[0], *(f"{joint}_carrier" for joint in names[:-1]), links[1]]
    for link in row[1:-1]:
        data["links"][link] = {"points": {}}
    for k, (joint, kind) in enumerate(zip(names, kinds, strict=True)):
        pair = {"R": "revolute", "P": "prismatic"}[kind]
        data["joints"][joint] = {"type": pair, "links": row[k : k + 2], "friction": 0, "seat": "free"}
        first = ends[0] if k == 0 else inside[k]
        last = ends[1] if k == len(kinds) - 1 else inside[k]
        data["links"][row[k]]["points"][joint], data["links"][row[k + 1]]["points"][joint] = first, last
    return dict(zip(names, starts, strict=True))


def _hang(data: dict[str, Any], run: Run, walk: Forward, link: str) -> Starts:
    """Connect a loose link with the ground by slides along x and y and a turn about its mass centre; beside it where a
    joint is, for two that turn at one point move nothing. In space by three slides of that centre and three turns."""
    ground = run.system.mechanism.fixed_link
    if run.system.spatial:
        centre = walk.at(link, run.system.centre(walk.values, link)).place
        return _counted(data, walk, link, (ground, link), "PPPRRR", _turning(run, walk, ground, link), centre)
    x, y = (single(part) for part in run.system.centre(walk.values, link))
    joints = [name for name, joint in data["joints"].items() if link in joint["links"]]
    if (x, y) in {tuple(single(walk.values[f"links.{link}.points.{name}.{axis}"]) for axis in "xy") for name in joints}:
        x += BESIDE * single(run.system.size(walk.values))
    at, (frame, twist, *_) = walk.at(link, (x, y)), walk.motions[link]
    inside = [{"at": [0, 0], "axis": [1, 0]}, {"at": [0, 0], "axis": [0, 1]}, [0, 0]]
    starts = [(single(place), single(speed)) for place, speed in zip(at.place[:2], at.velocity[:2], strict=True)]
    starts.append((float(np.arctan2(single(frame.s), single(frame.c))), single(twist.w)))
    return _chained(data, link, (ground, link), "PPR", (inside[0], [x, y]), inside, starts)


def _chain_of_joint(data: dict[str, Any], run: Run, walk: Forward, joint: str) -> Starts:
    """Single slides and turns for a joint of several freedoms. walk: at the start."""
    assert isinstance(walk, SpatialWalk)
    kind, links = run.system.joints[joint].type, run.system.joints[joint].links
    first, second = (each(element, single) for element in walk.ends(joint))
    if kind == "cylindrical":  # it keeps its elements, and with them its turn and its slide
        motion = zip(walk.coordinates(joint), walk.rates(joint), strict=True)
        starts = [(single(place), single(rate)) for place, rate in motion]
        local = [each(walk.local[link, joint], single) for link in links]
        at = [_point(np.array(frame.place), np.array(frame.z), np.array(frame.x)) for frame in local]
        along = _point(np.zeros(3), *np.eye(3)[[2, 0]])
        return _chained(data, joint, links, "RP", (at[0], at[1]), [along, along], starts)
    if kind == "universal":
        kinds, basis = "RR", np.array([first.z, second.z, np.cross(first.z, second.z)])
    elif kind == "planar":
        kinds, basis = "PPR", np.array([second.x, second.y, second.z])
    else:
        kinds, basis = "RRR", _turning(run, walk, *links)
    return _counted(data, walk, joint, links, kinds, basis, second.place)


def _counted(
    data: dict[str, Any], walk: Forward, name: str, links: tuple[str, str], kinds: str, basis: Array,
    place: Sequence[Any],
) -> Starts:  # fmt: skip
    """A chain whose coordinates are 0 at the start, along and about the rows of `basis`, from a place, m."""
    order = [kinds[:k].count(kind) if kinds != "PPR" or kind == "P" else 2 for k, kind in enumerate(kinds)]
    at = np.array([single(part) for part in place])
    frames = [each(walk.motions[link].frame, single) for link in links]
    twists = [each(walk.motions[link].twist, single) for link in links]
    spin = np.subtract(twists[1].u, twists[0].u)
    speed = np.subtract(moment_at(twists[1], tuple(at)), moment_at(twists[0], tuple(at)))
    starts = [(0.0, float(basis[i] @ (spin if kind == "R" else speed))) for i, kind in zip(order, kinds, strict=True)]
    ends, sides = [], np.eye(3)
    for frame, i in zip(frames, (order[0], order[-1]), strict=True):
        axes = np.array(frame[:3])  # rows: axes of the link
        ends.append(_point(axes @ (at - np.array(frame.place)), axes @ basis[i], axes @ basis[(i + 1) % 3]))
    inside = [_point(np.zeros(3), sides[i], sides[(i + 1) % 3]) for i in order]
    return _chained(data, name, links, kinds, (ends[0], ends[1]), inside, starts)


def _point(at: Array, axis: Array, x: Array) -> dict[str, Any]:
    return {"at": at.tolist(), "axis": axis.tolist(), "x": x.tolist()}


def _turning(run: Run, walk: Forward, first: str, second: str) -> Array:
    """Rows: three axes at right angles at the start, of which first and last keep apart over the cycle."""
    start = _relative(walk, first, second)[0]
    moving = _relative(run.walk(np.linspace(0.0, run.cycle.duration, LOOKS)), first, second)
    # as the first link sees it
    turned = np.array([rotation @ start.T for rotation in (start, *moving) if np.all(np.isfinite(rotation))])
    home = np.array(each(walk.motions[first].frame, single)[:3]).T
    halves = np.array([[turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]] for turn in turned])
    best, least = np.eye(3), np.inf
    # about which the links turn most, then those of the first link
    for axis in (*np.linalg.eigh(halves.T @ halves)[1].T[::-1], *np.eye(3)):
        rotation = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
        rotation /= np.linalg.norm(rotation)
        other = np.cross(axis, rotation)
        for angle in np.arange(ANGLES) * np.pi / ANGLES:
            last = np.cos(angle) * rotation + np.sin(angle) * other
            near = float(np.max(np.abs(axis @ turned @ last)))
            if near < least - 1e-9:
                best, least = np.array([axis, np.cross(last, axis), last]), near
    if least > MEETING:
        what = f"{second} turns so far against {first} that no three axes of its turns keep apart over the cycle"
        remedy = "let fewer joints of this link be in play, or it turn less"
        raise MechanismError(Finding(what, f"links.{second}", remedy))
    axes: Array = best @ home.T
    return axes


def _relative(walk: Forward, first: str, second: str) -> Array:
    """How the second link is turned as the first sees it, (time, row, column)."""
    first_axis, other = (
        np.array([[np.broadcast_to(primal(part), np.shape(walk.time)).ravel() for part in axis]
                  for axis in walk.motions[link].frame[:3]])
        for link in (first, second)
    )  # fmt: skip
    products: Array = np.einsum("art,brt->tab", first_axis, other)  # axis of the first, of the second
    return products
