"""Which joints of a module carry its tree and which close its loops."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

__all__ = ["OUTER", "GroupJoint", "Step", "grow"]

OUTER = -1  # stands for every link outside the module: all are known, so they count as one


class GroupJoint(NamedTuple):
    """A joint of a module: its kind and the links (or OUTER) of its first and second side."""

    kind: str
    sides: tuple[int, int]


class Step(NamedTuple):
    """One edge of the tree: `child` hangs on `parent` by `joint`, whose side `near` belongs to the parent."""

    joint: int
    parent: int
    child: int
    near: int


def grow(links: int, joints: Sequence[GroupJoint], first: Sequence[int]) -> tuple[Step, ...]:
    """Spanning tree rooted at the outer links, parents before children; joints in `first` go in if they can.

    Raises ValueError if a link hangs on nothing.
    """
    leader = {link: link for link in (OUTER, *range(links))}

    def lead(link: int) -> int:
        while leader[link] != link:
            link = leader[link]
        return link

    chosen: list[int] = []
    for k in [*first, *(k for k in range(len(joints)) if k not in first)]:
        a, b = (lead(link) for link in joints[k].sides)
        if a != b:
            leader[a] = b
            chosen.append(k)
    steps: list[Step] = []
    reached = {OUTER}
    while len(reached) <= links:
        before = len(reached)
        for k in chosen:
            for near in (0, 1):
                parent, child = joints[k].sides[near], joints[k].sides[1 - near]
                if parent in reached and child not in reached:
                    steps.append(Step(k, parent, child, near))
                    reached.add(child)
        if len(reached) == before:
            raise ValueError("a link of the module is joined to nothing")
    return tuple(steps)
