"""Whether drivers determine the motion of a planar mechanism, for dimensions without any special relation.

The count may be right though one part is held twice and another is loose. What the matching of constraints to freedoms
leaves over tells most of it; the rest is the rank of each part by itself, at random places of its joints. Part by part,
since the rank of a long row of parts taken at once drowns in rounding.  [THEORY of the docs, "Structure"]
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding
from trunnion.model.mechanism import Mechanism
from trunnion.structure.mobility import RANK_TOLERANCE, constraints, rank
from trunnion.structure.parts import Parts

__all__ = ["GEAR", "SPIN", "Constraint", "Generic"]

GEAR, SPIN = -1, -2
Constraint = tuple[str, int]  # of a joint, the number of a freedom it takes; of a gear pair, GEAR; of a link, SPIN
SEED = 1916  # of the generic dimensions
MOST_LINKS = 40  # whose constraints are looked at row by row; of more, rounding and time go beyond what it is worth
MOST_NAMED = 12


class Generic:
    """The constraints of joints, gear pairs and drivers on links, at random places and directions of the joints.

    determines: each constraint that is matched, with the link whose freedom it takes.
    """

    def __init__(self, mechanism: Mechanism, bodies: list[str], determines: Mapping[Constraint, str]) -> None:
        self.mechanism, self.bodies, self.determines = mechanism, bodies, determines
        self.joints = {name: (joint.type, joint.links) for name, joint in mechanism.effective_joints.items()}
        self.order = {name: k for k, name in enumerate(self.joints)}
        rng = np.random.default_rng(SEED)
        angles = rng.uniform(0.0, 2 * np.pi, len(self.joints))
        self.places = {
            name: (*rng.uniform(-1.0, 1.0, 2), float(np.cos(angle)), float(np.sin(angle)))
            for name, angle in zip(self.joints, angles, strict=True)
        }
        self.gears = {name: (gear.joints, float(rng.uniform(0.3, 0.9))) for name, gear in mechanism.gears.items()}

        self.links_of = {one: self._links_of(one) for one in determines}

    def _links_of(self, constraint: Constraint) -> list[str]:
        """The moving links that a constraint relates."""
        name, number = constraint
        joints = self.gears[name][0] if number == GEAR else (name,)
        links = dict.fromkeys(link for joint in joints for link in self.joints[joint][1])
        return [link for link in links if link != self.mechanism.fixed_link]

    def fault(self, unmatched: Iterable[Constraint], parts: Parts) -> list[Finding]:
        """What is held twice and what is loose, if anything is.

        unmatched: constraints that the matching leaves over; parts: links that depend on each other, in their order.
        """
        if left_over := list(unmatched):
            self.links_of |= {one: self._links_of(one) for one in left_over}
            few = len(self.bodies) <= MOST_LINKS
            return [self._told(*((set(self.bodies), set(self.bodies)) if few else self._reached(left_over)))]
        own: dict[int, list[Constraint]] = {}
        for constraint, body in self.determines.items():
            own.setdefault(parts.part_of[body], []).append(constraint)
        weak = [k for k, links in enumerate(parts.members) if not self._firm(links, own.get(k, []))]
        if not weak:
            return []
        some = (parts.reached(weak, backward=True), parts.reached(weak))
        held, loose = ({body for k in numbers for body in parts.members[k]} for numbers in some)
        return [self._told(held, loose)]

    def _firm(self, links: Collection[str], own: Iterable[Constraint]) -> bool:
        """Whether the constraints of a part leave its links no motion while all others are held."""
        matrix, _ = self._matrix(links, own)
        return rank(matrix) == int(matrix.shape[1])

    def _matrix(self, links: Collection[str], own: Iterable[Constraint]) -> tuple[NDArray[np.float64], list[str]]:
        """Constraints of some joints and gear pairs on some links, all others held, and whose each row is."""
        own = list(own)
        gears = {name: self.gears[name] for name, number in own if number == GEAR}
        named = {name for name, number in own if number != GEAR}
        spoken = {joint for pair, _ in gears.values() for joint in pair}
        joints = {name: self.joints[name] for name in sorted(named | spoken, key=self.order.__getitem__)}
        matrix, owners = constraints(
            list(links), self.mechanism.fixed_link, joints, self.places, list(self.mechanism.drivers), gears
        )
        rows = [k for k, name in enumerate(owners) if name in named or name in gears]
        return matrix[rows], [owners[k] for k in rows]

    def _reached(self, left_over: Iterable[Constraint]) -> tuple[set[str], set[str]]:
        """Links that are held by too many constraints, and those that have too few.

        By alternating paths: from what is left over to the links it is on, on to what determines these, and so on; and
        from links with a freedom left to what is on them, to the links that this determines instead, and so on.
        """
        by_link: dict[str, list[Constraint]] = {}
        on: dict[str, list[Constraint]] = {}
        for one, links in self.links_of.items():
            for link in links:
                on.setdefault(link, []).append(one)
        for one, body in self.determines.items():
            by_link.setdefault(body, []).append(one)
        first = [link for one in left_over for link in self.links_of[one]]
        held = _closed(first, lambda body: [link for one in by_link.get(body, []) for link in self.links_of[one]])
        first = [body for body in self.bodies if len(by_link.get(body, [])) < 3]
        loose = _closed(
            first, lambda body: [self.determines[one] for one in on.get(body, []) if one in self.determines]
        )
        return held, loose

    def _told(self, held: set[str], loose: set[str]) -> Finding:
        """The finding about a part that is held twice and one that is loose, both among the links that are given.

        Rows that depend on each other are those of the first; motions left free are those of the second.
        """
        within = [one for one, links in self.links_of.items() if held.issuperset(links)]
        matrix, owners = self._matrix([body for body in self.bodies if body in held], within)
        twice = list(dict.fromkeys(owners))
        if len(held) <= MOST_LINKS and matrix.size:
            rows = np.abs(_null(matrix.T)).max(axis=0, initial=0.0) > RANK_TOLERANCE
            twice = list(dict.fromkeys(name for name, strained in zip(owners, rows, strict=True) if strained)) or twice
        links = [body for body in self.bodies if body in loose]
        matrix, _ = self._matrix(links, [one for one, on in self.links_of.items() if not loose.isdisjoint(on)])
        if len(links) <= MOST_LINKS and matrix.size:
            columns = np.abs(_null(matrix)).max(axis=0, initial=0.0).reshape(-1, 3).max(axis=1) > RANK_TOLERANCE
            links = [body for body, free in zip(links, columns, strict=True) if free] or links
        told = _listed([f"{name} (driven)" if name in self.mechanism.drivers else name for name in twice])
        what = (
            f"one part is constrained twice, by the joints {told}, while the links {_listed(links)} stay undetermined"
        )
        return Finding(
            what, "joints", "move a joint or a driver from the part that is constrained twice to the undetermined one"
        )


def _null(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Vectors that a matrix takes to zero, one a row."""
    _, values, right = np.linalg.svd(matrix)
    return np.asarray(right[int(np.sum(values > RANK_TOLERANCE * values[0])) :])


def _closed(first: Iterable[str], after: Callable[[str], Iterable[str]]) -> set[str]:
    """All that is reached."""
    found: set[str] = set()
    held = list(first)
    while held:
        one = held.pop()
        if one not in found:
            found.add(one)
            held += after(one)
    return found


def _listed(names: list[str]) -> str:
    more = len(names) - MOST_NAMED
    return ", ".join(names[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
