"""Mobility by rank: what the joints really leave free at one position."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ["mobility_by_rank"]

RANK_TOLERANCE = 1e-9  # of the largest singular value


def mobility_by_rank(
    links: Sequence[str],
    ground: str,
    joints: Mapping[str, tuple[str, tuple[str, str]]],
    places: Mapping[str, tuple[float, float, float, float]],
    size: float,
) -> int:
    """Freedoms of the links less the rank of the joints' constraints on their twists.

    joints: kind and links by name; places: of each joint its point and the direction of its slide (x, y, c, s),
    global, m; size: a length by which lengths are made comparable with angles, m.
    It exceeds Grübler's count where constraints repeat each other, as in a parallelogram with a third crank.
    """
    number = {link: i for i, link in enumerate(link for link in links if link != ground)}
    rows: list[NDArray[np.float64]] = []
    for name, (kind, (first, second)) in joints.items():
        x, y, c, s = _scaled(places[name], size)
        # twist of a link as (v_x, v_y of its point at the origin, ω): velocity at (x, y) is v + ω (−y, x)
        at_x, at_y, turn = np.array([1, 0, -y]), np.array([0, 1, x]), np.array([0.0, 0.0, 1.0])
        constraints = [at_x, at_y] if kind == "revolute" else [c * at_y - s * at_x, turn]
        for constraint in constraints:
            row = np.zeros(3 * len(number))
            for link, sign in ((first, -1.0), (second, 1.0)):
                if link != ground:
                    row[3 * number[link] : 3 * number[link] + 3] += sign * constraint
            rows.append(row)
    if not rows:
        return 3 * len(number)
    values = np.linalg.svd(np.array(rows), compute_uv=False)
    return 3 * len(number) - int(np.sum(values > RANK_TOLERANCE * values[0]))


def _scaled(place: tuple[float, float, float, float], size: float) -> tuple[float, float, float, float]:
    x, y, c, s = place
    return x / size, y / size, c, s
