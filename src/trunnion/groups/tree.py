"""Which joints of a module carry its tree, and how one link hangs on the next."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import Frame, turned
from trunnion.groups.protocol import Elements
from trunnion.joints.pairs import PAIRS, Pair

__all__ = ["OUTER", "GroupJoint", "Step", "across", "grow", "size_of"]

OUTER = -1  # stands for every link outside the module: all are known, so they count as one


class GroupJoint(NamedTuple):
    """A joint of a module: its kind and the links (or OUTER) of its first and second side."""

    kind: str
    sides: tuple[int, int]

    @property
    def pair(self) -> Pair:
        """Its row of the table."""
        return PAIRS[self.kind]


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


def across(kind: str, near: Frame, value: Number) -> Frame:
    """The far element of a joint from its near one and the coordinate, seen from the near side."""
    if PAIRS[kind].turns:
        xp = namespace(value)
        c, s = turned(xp.cos(value), xp.sin(value), near.c, near.s)
        return Frame(near.x, near.y, c, s)
    return Frame(near.x + near.c * value, near.y + near.s * value, near.c, near.s)


def size_of(joints: Sequence[GroupJoint], elements: Elements) -> Number:
    """A length typical of each lane, m: the widest spread of joint elements on one link (or on all known links)."""
    places: dict[int, list[tuple[Number, Number]]] = {}
    for joint, pair in zip(joints, elements, strict=True):
        for link, frame in zip(joint.sides, pair, strict=True):
            places.setdefault(link, []).append((primal(frame.x), primal(frame.y)))
    size: Number = 0.0
    for (x0, y0), *others in places.values():
        for x, y in others:
            size = np.fmax(size, np.hypot(x - x0, y - y0))
    return np.where(size > 0, size, 1.0)
