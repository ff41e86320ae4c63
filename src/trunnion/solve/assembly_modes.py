"""The ways in which the groups of a mechanism can be put together: their names, and where they put the joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.nested import each
from trunnion.joints.pairs import PAIRS
from trunnion.model.mechanism import Mechanism
from trunnion.model.names import as_key
from trunnion.solve.branches import Track
from trunnion.solve.forward import Forward, forward, pose_of
from trunnion.solve.hints import way_name
from trunnion.solve.run import Run
from trunnion.solve.system import System
from trunnion.structure.decompose import Module

__all__ = ["AssemblyMode", "GroupModes", "choices", "put_together"]

Array = NDArray[np.float64]

STEPS = 360  # positions among which one is looked for where the ways are apart
APART = 1e-3  # of the largest coordinate: nearer ways read alike


@dataclass(frozen=True)
class AssemblyMode:
    """One assembly of a group.

    name: what chooses it, `assembly: {LINK: NAME}`. joints: (x, y), in space (x, y, z), of pins and balls inside the
    group, global, m, and (slide,) of its slides, m, in the order of the file. taken: whether it is the one that is
    analysed. turns: of its joints about an axis in space, rad.
    """

    name: str
    joints: Mapping[str, tuple[float, ...]]
    taken: bool
    turns: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class GroupModes:
    """A group with more than one assembly.

    module: its place in the plan; label: in the structural formula; links: of the group; link: the one to name it by.
    time: when the joints lie as the ways say, s; where: that position in words, empty if it is the start.
    """

    module: int
    label: str
    links: tuple[str, ...]
    link: str
    time: float
    where: str
    ways: tuple[AssemblyMode, ...]

    def line(self, way: AssemblyMode) -> str:
        """What to write into the model file to take one of its ways."""
        return f"assembly: {{{as_key(self.link)}: {way.name}}}"


def choices(run: Run) -> tuple[GroupModes, ...]:
    """Every group that can be assembled, and in several ways, with where its inner joints lie in each of them.

    That is at the start of the cycle, if the group can be assembled there and its ways are apart; else at the first
    position at which that is so, for a general group the one at which its assemblies are looked for.
    """
    times = run.cycle.times(STEPS)
    walk = forward(run.system, run.values, run.chosen.assembly, times)
    found: list[GroupModes] = []
    for number, module in enumerate(run.system.plan.modules):
        assembly = run.chosen.assembly[number]
        with np.errstate(all="ignore"):
            if isinstance(assembly, Track):
                moment, taken = assembly.begin, assembly.taken
                rows = _joints(walk, module, assembly.ways, int(np.argmin(np.abs(times - moment))))
            elif run.chosen.found[number] > 1:
                rows, moment = _closed(walk, number, times)
                taken = list(run.system.groups[number].BRANCHES).index(assembly)
            else:
                continue
        if rows and run.chosen.found[number] > 1:
            ways = _ways(rows, run.chosen.found[number], taken, turning(run.system))
            where = _where(run, moment)
            found.append(GroupModes(number, module.label, module.links, _name_of(run, module), moment, where, ways))
    return tuple(found)


def put_together(mechanism: Mechanism, choice: GroupModes, way: AssemblyMode) -> Mechanism:
    """The mechanism with one group assembled in another way, chosen by name; its hints by place stay."""
    data = mechanism.data()
    stated = data.get("assembly", {})
    kept = {key: hint for key, hint in stated.items() if key not in choice.links or key in _by_place(mechanism)}
    return Mechanism(**{**data, "assembly": {**kept, choice.link: way.name}})


def _by_place(mechanism: Mechanism) -> list[str]:
    return [key for key, hint in mechanism.assembly.items() if not isinstance(hint, str)]


def _name_of(run: Run, module: Module) -> str:
    """The link that names the group's assembly in the file, else its first whose name is not that of a hint."""
    stated = run.system.mechanism.assembly
    named = [link for link in module.links if isinstance(stated.get(link), str)]
    free = [link for link in module.links if link not in stated]
    return (*named, *free, *module.links)[0]


def _where(run: Run, moment: float) -> str:
    if moment == 0.0:
        return ""
    dial = run.system.dial(run.values, np.array([moment]))
    return dial.at(0) + (f" of {dial.of}" if dial.of else "")


def _closed(walk: Forward, number: int, times: Array) -> tuple[dict[str, Array], float]:
    """Joints (number, way) of a closed form at the first position at which all its ways exist and are apart.

    Nothing if it never closes.
    """
    module, group = walk.system.plan.modules[number], walk.system.groups[number]
    rows = [_joints(walk, module, pose_of(walk, number, branch, times).frames) for branch in group.BRANCHES]
    shape = np.shape(times)
    table = np.array([[np.broadcast_to(n, shape) for joint in row.values() for n in joint] for row in rows])
    known = np.isfinite(table).all(axis=(0, 1))
    if not np.any(known):
        return {}, 0.0
    size = np.max(np.abs(table[:, :, known]))
    apart = known & (np.ptp(table, axis=0).max(axis=0) > APART * size)
    lane = int(np.argmax(apart if np.any(apart) else known))
    at = {joint: np.array([[_at(n, lane) for n in row[joint]] for row in rows]).T for joint in rows[0]}
    return at, float(times[lane])


def _at(number: Array, lane: int) -> float:
    return float(np.ravel(number)[lane if np.size(number) > 1 else 0])


def _joints(walk: Forward, module: Module, frames: Sequence[Any], lane: int | None = None) -> dict[str, Array]:
    """Where the joints of a module are, from its links' frames: (x, y[, z]) of every pin or ball between two of them,
    (slide,) of every slide; (turn,) of every joint about an axis in space, those on known links included.

    lane: the position that the frames are at, None if at all of them.
    """
    place = dict(zip(module.links, frames, strict=False))  # a general group that never closes has no frames
    turned = turning(walk.system)

    def element(link: str, name: str) -> Any:
        if link in place:
            return walk.composed(place[link], link, name)
        known = walk.element(link, name)
        return known if lane is None else each(known, lambda n: n[lane] if np.ndim(n) else n)

    found: dict[str, Array] = {}
    own = set(module.joints).difference(module.driven) if place else ()
    for name in sorted(own, key=walk.system.order.__getitem__):
        kind, links = walk.system.joints[name]
        if not (all(link in place for link in links) or name in turned):
            continue
        if PAIRS[kind].guided or name in turned:
            found[name] = np.array([primal(walk.coordinate(name, *(element(link, name) for link in links)))])
        else:
            found[name] = np.array([primal(n) for n in walk.placed(place[links[0]], links[0], name)])
    return found


def turning(system: System) -> list[str]:
    """Joints that are told by their turn: those about an axis in space."""
    if system.mechanism.space == "planar":
        return []
    return [name for name, (kind, _) in system.joints.items() if PAIRS[kind].turns and not PAIRS[kind].ball]


def _ways(rows: Mapping[str, Array], count: int, taken: int, turned: Sequence[str]) -> tuple[AssemblyMode, ...]:
    """The ways of joints (number, way); turned: those whose number is an angle."""
    found = []
    for i in range(count):
        told = {name: tuple(float(n[i]) for n in numbers) for name, numbers in rows.items()}
        turns = {name: numbers[0] for name, numbers in told.items() if name in turned}
        places = {name: numbers for name, numbers in told.items() if name not in turned}
        found.append(AssemblyMode(way_name(i), places, i == taken, turns))
    return tuple(found)
