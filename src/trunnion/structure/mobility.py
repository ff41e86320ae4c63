"""Mobility by rank: what the joints really leave free."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.joints.pairs import PAIRS

__all__ = ["Gears", "Joints", "Places", "Subsystem", "constraints", "mobility_by_rank", "rank"]

RANK_TOLERANCE = 1e-9  # of the largest singular value

Joints = Mapping[str, tuple[str, tuple[str, str]]]  # kind and links, by name
Gears = Mapping[str, tuple[tuple[str, str], float]]  # joints and ratio, by name
Places = Mapping[str, tuple[float, float, float, float]]  # point and direction of the slide (x, y, c, s), by joint


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
    for name, (kind, sides) in joints.items():
        x, y = (np.asarray(places[name][:2]) - middle) / spread
        c, s = places[name][2:]
        at_x, at_y, turn = np.array([1.0, 0.0, -y]), np.array([0.0, 1.0, x]), np.array([0.0, 0.0, 1.0])
        across, along = c * at_y - s * at_x, c * at_x + s * at_y
        held = [at_x, at_y] if PAIRS[kind].turns else [across, turn]
        if name in drivers:
            held.append(turn if PAIRS[kind].turns else along)
        for constraint in held:
            row = np.zeros(3 * len(number))
            for link, sign in zip(sides, (-1.0, 1.0), strict=True):
                if link in number:
                    row[3 * number[link] : 3 * number[link] + 3] += sign * constraint
            rows.append(row)
            owners.append(name)
    for name, (pair, ratio) in (gears or {}).items():
        row = np.zeros(3 * len(number))
        for joint, factor in zip(pair, (-ratio, 1.0), strict=True):
            for link, sign in zip(joints[joint][1], (-1.0, 1.0), strict=True):
                if link in number:
                    row[3 * number[link] + 2] += sign * factor
        rows.append(row)
        owners.append(name)
    return np.array(rows).reshape(len(rows), 3 * len(number)), owners


def rank(matrix: NDArray[np.float64]) -> int:
    """Rank by singular values."""
    if not matrix.size:
        return 0
    values = np.linalg.svd(matrix, compute_uv=False)
    return int(np.sum(values > RANK_TOLERANCE * values[0]))


class Subsystem(NamedTuple):
    """Links that are determined together, with what holds them: joints, those of them that are driven, gear pairs."""

    links: tuple[str, ...]
    joints: tuple[str, ...]
    driven: tuple[str, ...] = ()
    gears: tuple[str, ...] = ()


def mobility_by_rank(
    links: Sequence[str],
    ground: str,
    joints: Joints,
    places: Places,
    gears: Gears | None = None,
    parts: Sequence[Subsystem] = (),
) -> int:
    """Freedoms of the links less the rank of the joints' constraints at one position.

    It exceeds Grübler's count where constraints repeat each other, as in a parallelogram with a third crank. parts: all
    links and joints in the order in which they are determined. One that holds its own links firmly takes from them what
    it should, unless a later one that does not hangs on it: so few constraints of a long row are looked at together.
    """
    gears = gears or {}
    weak: list[Subsystem] = []
    needed: set[str] = set()
    firm = 0
    for part in reversed(parts):
        spoken = (joint for name in part.gears for joint in gears[name][0])
        own = {name: joints[name] for name in dict.fromkeys((*part.joints, *spoken))}
        matrix, _ = constraints(
            part.links, ground, own, places, part.driven, {name: gears[name] for name in part.gears}
        )
        if needed.isdisjoint(part.links) and rank(matrix) == int(matrix.shape[1]):
            firm += len(part.driven)
        else:
            weak.append(part)
            needed.update(link for _, sides in own.values() for link in sides)
    if parts:
        links = [link for part in weak for link in part.links]
        joints = {name: joints[name] for part in weak for name in part.joints}
        gears = {name: gears[name] for part in weak for name in part.gears}
    matrix, _ = constraints(links, ground, joints, places, gears=gears)
    return firm + int(matrix.shape[1]) - rank(matrix)
