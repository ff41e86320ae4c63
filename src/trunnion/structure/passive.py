"""Passive freedoms in space: links that spin freely about the line of two joints, which moves nothing else.

Where two joints alone join some links to all others, and both let these turn about one line whatever their pose, J has
a null vector that moves them as one. A row for each of these spins, of a link that no smaller spin moves, makes J
regular.  [THEORY of the docs, "Free spins"]
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.joints.pairs import Pair
from trunnion.model.mechanism import Mechanism
from trunnion.structure.graph import reached

IN_LINE = 1e-9  # of the distance: a point that lies on an axis


def passive(mechanism: Mechanism) -> dict[str, tuple[str, str]]:
    """Links that name the free spins, each with the two joints between which its links spin as one.

    The line goes through two balls, or through one ball along the normal of a planar joint or the axis of a turn that
    nothing drives. Spins that follow from smaller ones, such as that of both halves of a strut with a turning slide
    along its line, are left out.
    """
    spins: dict[str, tuple[str, str]] = {}
    if mechanism.space == "planar" or mechanism.loop:
        return spins
    pairs = {name: joint.pair for name, joint in mechanism.joints.items()}
    turning = [
        name
        for name, pair in pairs.items()
        if pair.ball or pair.name == "planar" or (pair.bored and name not in mechanism.drivers)
    ]
    sets = [
        (members, ends)
        for ends in combinations(turning, 2)
        if pairs[ends[0]].ball or pairs[ends[1]].ball
        for members in _between(mechanism, *ends)
        if not any(pairs[name].bored for name in ends) or _in_line(mechanism, pairs, members, *ends)
    ]
    moved: set[str] = set()
    for members, ends in sorted(sets, key=lambda spin: len(spin[0])):
        if alone := [link for link in mechanism.links if link in members - moved]:
            spins[alone[0]] = ends
            moved |= members
    return {link: spins[link] for link in mechanism.links if link in spins}


def _between(mechanism: Mechanism, first: str, second: str) -> Iterator[set[str]]:
    """Links that hang together without two joints, and by both of these on all others."""
    neighbours: dict[str, list[str]] = {link: [] for link in mechanism.links}
    for name, joint in mechanism.joints.items():
        if name not in (first, second):
            for link, other in (joint.links, joint.links[::-1]):
                neighbours[link].append(other)
    sides = [set(mechanism.joints[name].links) for name in (first, second)]
    for link in mechanism.joints[first].links:
        members = reached([link], neighbours.__getitem__)
        if mechanism.fixed_link not in members and all(len(members & pair) == 1 for pair in sides):
            yield members


def _in_line(mechanism: Mechanism, pairs: Mapping[str, Pair], members: set[str], first: str, second: str) -> bool:
    """Whether the axis of one joint goes through the ball of the other, whatever the pose of the links between them.

    On each link of the chain between them both joints have, as far as they have one, the same axis.
    """
    values = mechanism.parameters()
    (link,) = members.intersection(mechanism.joints[first].links)
    before, passed = first, {link}
    while second not in (inner := [name for name, joint in mechanism.joints.items() if link in joint.links]):
        ahead = [name for name in inner if name != before and members.issuperset(mechanism.joints[name].links)]
        if len(ahead) != 1 or not pairs[ahead[0]].one_axis or not _coaxial(values, pairs, link, before, ahead[0]):
            return False
        before = ahead[0]
        link = next(other for other in mechanism.joints[before].links if other != link)
        if link in passed:
            return False
        passed.add(link)
    return _coaxial(values, pairs, link, before, second)


def _coaxial(values: Mapping[str, Any], pairs: Mapping[str, Pair], link: str, *joints: str) -> bool:
    """Whether two joints of a link have one axis, or that which has one goes through the centre of the ball."""

    def vector(path: str) -> NDArray[np.float64]:
        return np.array([float(np.ravel(values[f"links.{link}.points.{path}.{letter}"])[0]) for letter in "xyz"])

    first, second = joints
    apart = vector(second) - vector(first)
    axes: Sequence[NDArray[np.float64]] = [vector(f"{name}.axis") for name in joints if not pairs[name].ball]
    units = [axis / np.linalg.norm(axis) for axis in axes]
    off = [np.linalg.norm(np.cross(apart, axis)) > IN_LINE * np.linalg.norm(apart) for axis in units]
    return not any(off) and (len(units) < 2 or bool(np.linalg.norm(np.cross(units[0], units[1])) <= IN_LINE))
