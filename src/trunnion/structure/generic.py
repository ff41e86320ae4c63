"""Whether drivers determine the motion of a planar mechanism, for dimensions without any special relation.

The count may be right though one part is held twice and another is loose. What the matching of constraints to freedoms
leaves over tells most of it; the rest is the rank of each part by itself, at random places of its joints. Part by part,
since the rank of a long row of parts taken at once drowns in rounding.  [THEORY of the docs, "Structure"]
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding
from trunnion.joints.pairs import PAIRS
from trunnion.model.mechanism import Mechanism
from trunnion.structure.graph import reached

__all__ = ["GEAR", "SPIN", "Constraint", "Gears", "Generic", "Joints", "Places", "constraints", "rank"]

GEAR, SPIN = -1, -2
Constraint = tuple[str, int]  # of a joint, the number of a freedom it takes; of a gear pair, GEAR; of a link, SPIN
Joints = Mapping[str, tuple[str, tuple[str, str]]]  # kind and links, by name
Gears = Mapping[str, tuple[tuple[str, str], float]]  # joints and ratio by name; of a rack or screw m, what turns first
Places = Mapping[str, tuple[float, float, float, float]]  # point and direction of the slide (x, y, c, s), by joint
TURN = np.array([0.0, 0.0, 1.0])  # the constraint that a turn is held
RANK_TOLERANCE = 1e-9  # of the largest singular value
SEED = 1916  # of the generic dimensions
MOST_LINKS = 40  # whose constraints are looked at row by row; of more, rounding and time go beyond what it is worth
MOST_NAMED = 12


def constraints(
    links: Sequence[str],
    ground: str,
    joints: Joints,
    places: Places,
    drivers: Sequence[str] = (),
    gears: Gears | None = None,
) -> tuple[NDArray[np.float64], list[str]]:
    """Constraints on the twists of the links, one row each, and the joint or gear pair that each row belongs to.

    Columns: (v_x, v_y at the mean of the places, ω · length) of every link but the ground, lengths in units of the
    spread of the places, so that the rows do not depend on where the mechanism stands nor on its size. Links of the
    joints that are not among `links` are held.
    """
    number = {link: i for i, link in enumerate(link for link in links if link != ground)}
    points = np.array([places[name][:2] for name in joints]).reshape(-1, 2)
    middle = points.mean(axis=0) if len(points) else np.zeros(2)
    spread = float(np.max(np.abs(points - middle), initial=0.0)) or 1.0
    rows: list[NDArray[np.float64]] = []
    owners: list[str] = []

    def add(owner: str, *parts: tuple[Sequence[str], NDArray[np.float64]]) -> None:
        """A row of what the second link of each pair does against the first."""
        row = np.zeros((len(number), 3))
        for sides, constraint in parts:
            for link, sign in zip(sides, (-1.0, 1.0), strict=True):
                if link in number:
                    row[number[link]] += sign * constraint
        rows.append(row)
        owners.append(owner)

    along_slides: dict[str, NDArray[np.float64]] = {}
    for name, (kind, sides) in joints.items():
        x, y = (np.asarray(places[name][:2]) - middle) / spread
        c, s = places[name][2:]
        at_x, at_y = np.array([1.0, 0.0, -y]), np.array([0.0, 1.0, x])
        across, along = c * at_y - s * at_x, c * at_x + s * at_y
        constrained = [at_x, at_y, TURN] if PAIRS[kind].turns else [across, TURN, along]
        along_slides |= {} if PAIRS[kind].turns else {name: along}
        for constraint in constrained[: 3 if name in drivers else 2]:
            add(name, (sides, constraint))
    for name, ((first, second), ratio) in (gears or {}).items():
        scale = spread if second in along_slides else 1.0
        add(name, (joints[first][1], -ratio / scale * TURN), (joints[second][1], along_slides.get(second, TURN)))
    return np.array(rows).reshape(len(rows), 3 * len(number)), owners


def rank(matrix: NDArray[np.float64]) -> int:
    """Rank by singular values."""
    if not matrix.size:
        return 0
    values = np.linalg.svd(matrix, compute_uv=False)
    return int(np.sum(values > RANK_TOLERANCE * values[0]))


class Generic:
    """The constraints of joints, gear pairs and drivers on links, at random places and directions of the joints.

    determines: each constraint that is matched, with the link whose freedom it takes; links_of: the moving links that
    each constraint relates.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        bodies: list[str],
        determines: Mapping[Constraint, str],
        links_of: Mapping[Constraint, list[str]],
    ) -> None:
        self.mechanism, self.bodies, self.determines, self.links_of = mechanism, bodies, determines, links_of
        self.joints = {name: (joint.type, joint.links) for name, joint in mechanism.effective_joints.items()}
        self.order = {name: k for k, name in enumerate(self.joints)}
        rng = np.random.default_rng(SEED)
        angles = rng.uniform(0.0, 2 * np.pi, len(self.joints))
        self.places = {
            name: (*rng.uniform(-1.0, 1.0, 2), float(np.cos(angle)), float(np.sin(angle)))
            for name, angle in zip(self.joints, angles, strict=True)
        }
        self.gears = {name: (mechanism.coupled(name), float(rng.uniform(0.3, 0.9))) for name in mechanism.gears}

    def fault(
        self, left_over: list[Constraint], parts: Sequence[list[str]], before: Sequence[set[int]]
    ) -> Finding | None:
        """What is constrained twice and what is loose, if anything is.

        left_over: constraints that are not matched; parts: links that depend on each other; before: of every part those
        that it depends on.
        """
        if left_over:
            few = len(self.bodies) <= MOST_LINKS
            return self._finding(*((set(self.bodies), set(self.bodies)) if few else self._reached(left_over)))
        part_of = {body: k for k, links in enumerate(parts) for body in links}
        of_part: list[list[Constraint]] = [[] for _ in parts]
        for constraint, body in self.determines.items():
            of_part[part_of[body]].append(constraint)
        # a part is firm if its constraints leave its links no motion while all others are held
        matrices = (self._matrix(links, of_part[k])[0] for k, links in enumerate(parts))
        weak = [k for k, matrix in enumerate(matrices) if rank(matrix) < int(matrix.shape[1])]
        if not weak:
            return None
        after: list[set[int]] = [set() for _ in parts]
        for k, earlier in enumerate(before):
            for other in earlier:
                after[other].add(k)
        numbers = reached(weak, before.__getitem__), reached(weak, after.__getitem__)
        return self._finding(*({body for k in several for body in parts[k]} for several in numbers))

    def _matrix(
        self, links: Collection[str], constraints_: Iterable[Constraint]
    ) -> tuple[NDArray[np.float64], list[str]]:
        """Constraints of some joints and gear pairs on some links, all others held, and whose each row is."""
        constraints_ = list(constraints_)
        gears = {name: self.gears[name] for name, number in constraints_ if number == GEAR}
        named = {name for name, number in constraints_ if number != GEAR}
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
        tight: dict[str, set[str]] = {body: set() for body in self.bodies}  # links of the constraints that determine it
        slack: dict[str, set[str]] = {body: set() for body in self.bodies}  # links that the constraints on it determine
        for constraint, body in self.determines.items():
            tight[body].update(self.links_of[constraint])
            for link in self.links_of[constraint]:
                slack[link].add(body)
        counts = Counter(self.determines.values())
        twice = reached((link for constraint in left_over for link in self.links_of[constraint]), tight.__getitem__)
        return twice, reached((body for body in self.bodies if counts[body] < 3), slack.__getitem__)

    def _finding(self, twice: set[str], loose: set[str]) -> Finding:
        """The finding about a part that is constrained twice and one that is loose, both among the given links.

        Rows that depend on each other are those of the first; motions left free are those of the second.
        """
        within = [constraint for constraint, links in self.links_of.items() if twice.issuperset(links)]
        matrix, owners = self._matrix([body for body in self.bodies if body in twice], within)
        joints = list(dict.fromkeys(owners))
        if len(twice) <= MOST_LINKS and matrix.size:
            rows = np.abs(_null(matrix.T)).max(axis=0, initial=0.0) > RANK_TOLERANCE
            joints = (
                list(dict.fromkeys(name for name, strained in zip(owners, rows, strict=True) if strained)) or joints
            )
        links = [body for body in self.bodies if body in loose]
        matrix, _ = self._matrix(links, [joint for joint, on in self.links_of.items() if not loose.isdisjoint(on)])
        if len(links) <= MOST_LINKS and matrix.size:
            columns = np.abs(_null(matrix)).max(axis=0, initial=0.0).reshape(-1, 3).max(axis=1) > RANK_TOLERANCE
            links = [body for body, free in zip(links, columns, strict=True) if free] or links
        named = _listed([f"{name} (driven)" if name in self.mechanism.drivers else name for name in joints])
        loosely = f"while the links {_listed(links)} stay undetermined"
        remedy = "move a joint or a driver from the part that is constrained twice to the undetermined one, or, if its "
        remedy += "geometry lets it move all the same, state over_constraint: minimum-norm"
        return Finding(f"one part is constrained twice, by the joints {named}, {loosely}", "joints", remedy)


def _null(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Vectors that a matrix takes to zero, one a row."""
    _, values, right = np.linalg.svd(matrix)
    return np.asarray(right[int(np.sum(values > RANK_TOLERANCE * values[0])) :])


def _listed(names: list[str]) -> str:
    more = len(names) - MOST_NAMED
    return ", ".join(names[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
