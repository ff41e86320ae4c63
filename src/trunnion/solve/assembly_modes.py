"""The ways in which the groups of a mechanism can be put together: their names, and where they put the joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from trunnion.model.mechanism import Mechanism
from trunnion.model.names import as_key
from trunnion.model.parts import FOLDS
from trunnion.solve.assembly import grid, ways_of
from trunnion.solve.forward import posed
from trunnion.solve.hints import joint_rows, way_name
from trunnion.solve.run import Run
from trunnion.solve.track import Track


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

    def line(self, mode: AssemblyMode) -> str:
        """What to write into the model file to take one of its ways."""
        return f"assembly: {{{as_key(self.link)}: {mode.name}}}"


@np.errstate(all="ignore")
def choices(run: Run) -> tuple[GroupModes, ...]:
    """Every group that can be assembled, and in several ways, with where its inner joints lie in each of them.

    That is at the position at which its hints are compared: the start of the cycle, if the group can be assembled there
    and its ways are apart, else the first at which that is so.
    """
    if max(run.chosen.found, default=0) < 2:
        return ()
    times, groups, hints_stated = grid(run.cycle), list[GroupModes](), run.system.mechanism.assembly
    walk = posed(run.system, run.values, run.chosen.assembly, times)
    for number, module in enumerate(run.system.plan.modules):
        assembly, count = run.chosen.assembly[number], run.chosen.found[number]
        if count < 2:
            continue
        branches = run.system.groups[number].BRANCHES
        if not branches:
            lane, frames, branch = int(np.searchsorted(times, assembly.begin)), assembly.ways, assembly.taken
        else:
            first, frames = ways_of(walk, number, times)
            if first is None:
                continue
            here = assembly.sense(times[first]) if isinstance(assembly, Track) else assembly
            lane, branch = first, branches.index(here)
        rows = joint_rows(walk, module, count, frames, lane)
        if not rows:
            continue
        ways = []
        for i in range(count):
            joints = {name: tuple(float(n[i]) for n in numbers) for name, (turns, numbers) in rows.items() if not turns}
            turned = {name: float(numbers[0][i]) for name, (turns, numbers) in rows.items() if turns}
            ways.append(AssemblyMode(way_name(i), joints, i == branch, turned))
        named = [link for link in module.links if isinstance(hints_stated.get(link), str)]
        free = [link for link in module.links if link not in hints_stated]
        link = (*named, *free, *module.links)[0]
        where = ""
        if lane:
            dial = run.system.dial(run.values, times[lane : lane + 1])
            where = dial.at(0) + (f" of {dial.of}" if dial.of else "")
        groups.append(GroupModes(number, module.label, module.links, link, float(times[lane]), where, tuple(ways)))
    return tuple(groups)


def put_together(mechanism: Mechanism, choice: GroupModes, mode: AssemblyMode) -> Mechanism:
    """The mechanism with one group assembled in another way, chosen by name; its hints by place stay."""
    data = mechanism.data()
    others = {
        key: hint
        for key, hint in data.get("assembly", {}).items()
        if key not in choice.links or mechanism.assembly[key] == FOLDS or not isinstance(mechanism.assembly[key], str)
    }
    return Mechanism(**{**data, "assembly": {**others, choice.link: mode.name}})
