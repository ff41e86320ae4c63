"""The assembly by momentum: where a motion is to pass poses in which two assemblies meet, links go on as they move.

A closed-form group keeps its branch as long as nothing brings it to where its two branches meet. A motion that passes
such a pose (rods in line) goes on with the velocity that the links have, which is that of one branch only. So both
branches are worked out, and that one is taken whose places and velocities are nearest to what the links would do with
their last accelerations. A general group is solved by Newton's method from its last pose.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from trunnion.algebra.dual import primal, single
from trunnion.algebra.namespace import Number, flat
from trunnion.solve.change_points import folds
from trunnion.solve.forward import Forward, Motion
from trunnion.solve.run import Run
from trunnion.solve.track import Track


@dataclass(frozen=True)
class Snapshot:
    """A walk at a time, s, at the end of a step: motions of all links, and poses of the modules; one lane."""

    time: float
    motions: dict[str, Motion]
    poses: tuple[Any, ...]


@dataclass
class Followed:
    """The assembly of one module, as a walk asks for it: a pose from the last one.

    passing: whether it goes on where two assemblies meet.
    """

    number: int
    chosen: Any
    pace: float
    passing: bool
    snapshot: Snapshot | None = None

    def pose(self, group: Any, elements: Any, drive: Sequence[Number], walk: Forward, time: Number) -> Any:
        """The pose that goes on from the snapshot; that of the chosen assembly before there is one."""
        if self.snapshot is None:
            if hasattr(self.chosen, "pose"):
                return self.chosen.pose(group, elements, drive, walk, time)
            return group.position(elements, self.chosen, drive)
        if not group.BRANCHES:
            last = self.snapshot.poses[self.number]
            return group.position(elements, [single(last.q[i]) for i in group.kept], drive)
        first_branch, other = group.BRANCHES
        misses = [
            self._miss(group, group.position(elements, branch, drive), walk, time) for branch in (first_branch, other)
        ]
        return group.position(elements, np.where(misses[1] < misses[0], other, first_branch), drive)

    def _miss(self, group: Any, pose: Any, walk: Forward, time: Number) -> Number:
        """How far places and velocities are from the last ones, and from what they would be with the accelerations.

        Near where two branches meet the places tell nothing and the velocities everything; at rest it is the reverse.
        """
        assert self.snapshot is not None
        system, module = walk.system, walk.system.plan.modules[self.number]
        rates = [system.drive(walk.values, name, time)[1] for name in module.driven]
        outer = [walk.outside(place) for place in system.places[self.number]]
        outer_motions = [twist for twist, _ in outer], [second for _, second in outer]
        twists, _ = group.moved(pose, *outer_motions, rates, (0.0,) * len(rates))
        since, missed = time - self.snapshot.time, 0.0
        for link, frame, twist in zip(module.links, pose.frames, twists, strict=True):
            before = self.snapshot.motions[link]
            for was, is_ in zip(flat(before.frame), flat(frame), strict=True):
                missed = missed + self.pace * np.abs(primal(is_) - was)
            for was, second, is_ in zip(flat(before.twist), flat(before.acceleration), flat(twist), strict=True):
                missed = missed + np.abs(primal(is_) - was - since * second)
        return missed


def follows(run: Run, several: bool) -> tuple[Any, ...]:
    """The assembly of every module, followed where free drivers may lead it past a pose in which two meet.

    several: whether there is more than one free driver, so that the nominal cycle is not the way it goes.
    """
    if not several:
        return run.chosen.assembly
    pace = single(run.system.pace(run.values))
    following: list[Any] = []
    for number, chosen in enumerate(run.chosen.assembly):
        closed = chosen is not None and len(run.system.groups[number].BRANCHES) == 2
        passing = closed and not folds(run.system, run.system.plan.modules[number])
        following.append(Followed(number, chosen, pace, passing) if closed or isinstance(chosen, Track) else chosen)
    return tuple(following)
