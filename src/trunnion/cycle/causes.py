"""Why positions have no answer, noted chunk by chunk as they are solved: places, and numbers for the findings."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trunnion.algebra.namespace import Number
from trunnion.errors import Status
from trunnion.groups.dyad import DyadPose
from trunnion.solve.backward import Backward
from trunnion.solve.forward import Forward
from trunnion.solve.system import Positions, System, sticking

__all__ = ["Causes"]

Array = NDArray[np.float64]


class Causes:
    """Places without an answer by kind of cause, and by module, joint or path.

    open: by number of the module and texts of possible reasons, with the length, m, by which each of these holds there;
    locked: by number of the module, with the share of the friction at which it does; singular: by number of the module;
    undefined: by path of a load or spring; rest: by joint, its relative speed is zero; stuck: only the travel of seats
    decides the sense of a friction.
    """

    def __init__(self, system: System) -> None:
        self.system = system
        self._notes: dict[tuple[str, Any], list[tuple[Positions, Array]]] = {}

    def of(self, kind: str) -> dict[Any, tuple[Positions, Array]]:
        """Places and numbers, (…, place), of one kind."""
        return {
            key: (np.concatenate([places for places, _ in notes]), np.concatenate([part for _, part in notes], -1))
            for (what, key), notes in self._notes.items() if what == kind
        }  # fmt: skip

    def keep(self, kind: str, key: Hashable, where: ArrayLike, places: Positions, numbers: ArrayLike = 0.0) -> None:
        """Keep those of some places at which there is a cause. numbers: (…, place)."""
        lanes = np.flatnonzero(np.broadcast_to(where, places.shape))
        if len(lanes):
            numbers = np.asarray(numbers, float)
            every = np.broadcast_to(numbers, (*numbers.shape[:-1], len(places)))
            self._notes.setdefault((kind, key), []).append((places[lanes], every[..., lanes]))

    def note(self, back: Backward, status: NDArray[np.int8], places: Positions) -> None:
        """Look at some positions, by their numbers in the cycle."""
        for name in sticking(self.system):
            self.keep("rest", name, back.resting[name] & (status < Status.NOT_CONVERGED), places)
        if not np.any(status >= Status.LOCKED):
            return
        for path, where in back.undefined.items():
            self.keep("undefined", path, where & (status == Status.LOAD_UNDEFINED), places)
        modules = reversed(range(len(back.settled)))  # settled from the last module to the first
        for number, settled in zip(modules, back.settled, strict=True):
            locked = (np.asarray(settled.share) < 1.0) & (status == Status.LOCKED)
            self.keep("locked", number, locked, places, settled.share)
        if np.any(status == Status.SINGULAR):
            walk = back.walk
            conditions = [
                np.broadcast_to(np.nan_to_num(group.condition(pose), nan=np.inf), status.shape)
                for group, pose in zip(walk.system.groups, walk.poses, strict=True)
            ]
            worst = np.argmax(conditions, axis=0)
            for number in range(len(conditions)):
                self.keep("singular", number, (status == Status.SINGULAR) & (worst == number), places)
        left = status == Status.NOT_ASSEMBLED
        for number, pose in enumerate(back.walk.poses):  # the first module that does not close, and by how much
            if not np.any(left):
                break
            bad = np.zeros(status.shape, bool)
            for frame in pose.frames:
                bad |= ~np.isfinite(np.broadcast_to(_sum(frame), status.shape))
            if np.any(bad & left):
                reasons = _shortfalls(back.walk, number)
                sizes = np.array([np.broadcast_to(size, status.shape) for size in reasons.values()])
                self.keep("open", (number, *reasons), bad & left, places, sizes.reshape(len(reasons), len(places)))
            left = left & ~bad


def _sum(frame: Any) -> Number:
    """A number that is finite where every number of a frame is: of a planar one (x, y, c, s), of one of vectors."""
    return sum(_sum(part) if isinstance(part, tuple) else part for part in frame)


def _shortfalls(walk: Forward, number: int) -> dict[str, Number]:
    """Why a closed form has no position: each reason with the length by which it holds where it is positive."""
    module, pose = walk.system.plan.modules[number], walk.poses[number]
    if not isinstance(pose, DyadPose):
        return {}
    b, c, d = module.joints
    if module.kind == "RRR":
        (pin_b, b_i), (c_i, c_j), (pin_d, d_j) = walk.pairs(walk.system.places[number])
        gap, bc, cd = (
            np.hypot(two.x - first.x, two.y - first.y) for first, two in ((pin_b, pin_d), (b_i, c_i), (c_j, d_j))
        )
        return {
            f"|{b}{d}| exceeds {b}{c} + {c}{d}": gap - (bc + cd),
            f"|{b}{d}| falls short of |{b}{c} − {c}{d}|": np.abs(bc - cd) - gap,
        }
    if module.kind == "RRP":
        return {f"the path of {c} is farther from {b} than |{b}{c}|": np.abs(pose.lost) - pose.scale}
    if module.kind == "RPR":
        return {f"|{b}{d}| falls short of the offset of the slide {c}": np.abs(pose.lost) - pose.scale}
    return {}
