"""Whether drivers determine the motion of a planar mechanism, for dimensions without any special relation.

The count may be right though one part is held twice and another is loose. What the matching of constraints to freedoms
leaves over tells most of it; the rest is the rank of each part by itself, at random places of its joints. Part by part,
since the rank of a long row of parts taken at once drowns in rounding.  [THEORY of the docs, "Structure"]
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding
from trunnion.joints.pairs import PAIRS
from trunnion.model.mechanism import Mechanism
from trunnion.structure.graph import reached

GEAR, SPIN = -1, -2
Constraint = tuple[str, int]  # of a joint, the number of a freedom it takes; of a gear pair, GEAR; of a link, SPIN
Joints = Mapping[str, tuple[str, tuple[str, str]]]  # kind and links, by name
Gears = Mapping[str, tuple[tuple[str, str], float]]  # joints and ratio by name; of a rack or screw m, what turns first
Places = Mapping[str, tuple[float, float, float, float]]  # point and direction of the slide (x, y, c, s), by joint
TURN = np.array([0.0, 0.0, 1.0])  # the constraint that a turn is held
RANK_TOLERANCE = 1e-9  # of the largest singular value
SEED = 1916  # of the generic dimensions
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


def fault(
    mechanism: Mechanism,
    determines: Mapping[Constraint, str],
    links_of: Mapping[Constraint, list[str]],
    left_over: Sequence[Constraint],
    parts: Sequence[list[str]],
) -> Finding | None:
    """What is constrained twice and what is loose in a planar mechanism, if anything is.

    determines: each constraint that is matched, with the link whose freedom it takes; links_of: the moving links that
    each constraint relates; left_over: constraints that are not matched; parts: links that depend on each other.
    """
    twice: list[Constraint] = []
    loose: set[str] = set()
    if left_over:
        # by alternating paths: from what is left over to the links it is on, on to what determines these, and so on;
        # and from links with a freedom left to what is on them, to the links that this determines instead, and so on
        bodies = [body for links in parts for body in links]
        tight: dict[str, set[str]] = {body: set() for body in bodies}  # links of the constraints that determine it
        slack: dict[str, set[str]] = {body: set() for body in bodies}  # links that the constraints on it determine
        for constraint, body in determines.items():
            tight[body].update(links_of[constraint])
            for link in links_of[constraint]:
                slack[link].add(body)
        counts = Counter(determines.values())
        over = reached((link for constraint in left_over for link in links_of[constraint]), tight.__getitem__)
        twice = [constraint for constraint, links in links_of.items() if over.issuperset(links)]
        loose = reached((body for body in bodies if counts[body] < 3), slack.__getitem__)
    else:  # at random places: a part is firm if its constraints leave its links no motion while all others are held
        kinds, rng = (
            {name: joint.type for name, joint in mechanism.effective_joints.items()},
            np.random.default_rng(SEED),
        )
        angles = dict(zip(kinds, rng.uniform(0.0, 2 * np.pi, len(kinds)), strict=True))
        places = {name: (*rng.uniform(-1.0, 1.0, 2), np.cos(angle), np.sin(angle)) for name, angle in angles.items()}
        gears = {name: (mechanism.coupled(name), float(rng.uniform(0.3, 0.9))) for name in mechanism.gears}
        of_link: dict[str, list[Constraint]] = {}
        for constraint, body in determines.items():
            of_link.setdefault(body, []).append(constraint)
        for links in parts:
            of_part = [constraint for link in links for constraint in of_link[link]]
            meshed = {name: gears[name] for name, number in of_part if number == GEAR}
            named = {name for name, number in of_part if number != GEAR}
            spoken = named.union(*(pair for pair, _ in meshed.values()))
            joints = {name: (kinds[name], mechanism.effective_joints[name].links) for name in kinds if name in spoken}
            matrix, owners = constraints(links, mechanism.fixed_link, joints, places, list(mechanism.drivers), meshed)
            rows = [k for k, name in enumerate(owners) if name in named or name in meshed]
            if rank(matrix[rows]) < 3 * len(links):
                twice, loose = twice + of_part, loose.union(links)
    if not twice:
        return None
    driven = mechanism.drivers
    named_joints = [f"{name} (driven)" if name in driven else name for name in dict.fromkeys(name for name, _ in twice)]
    named_links = [link for link in mechanism.effective_links if link in loose]
    what = f"one part is constrained twice, by the joints {_listed(named_joints)}, while the links "
    remedy = "move a joint or a driver from the part that is constrained twice to the undetermined one, or, if its "
    remedy += "geometry lets it move all the same, state over_constraint: minimum-norm"
    return Finding(f"{what}{_listed(named_links)} stay undetermined", "joints", remedy)


def _listed(names: list[str]) -> str:
    more = len(names) - MOST_NAMED
    return ", ".join(names[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
