"""From where a spatial mechanism is looked at, in parallel projection."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from trunnion.views.common.cycle import Array
from trunnion.views.space.bodies import Space

__all__ = ["Camera", "best", "looking"]

HEIGHTS = (20.0, 28.0, 36.0, 46.0, 58.0)  # degrees above the horizon that are tried
SIDES = (
    -155.0,
    -145.0,
    -135.0,
    -125.0,
    -115.0,
    -65.0,
    -55.0,
    -45.0,
    -35.0,
    -25.0,
    25.0,
    35.0,
    45.0,
    55.0,
    65.0,
    115.0,
    125.0,
    135.0,
    145.0,
    155.0,
)  # degrees around z: no axis seen end-on
MOST_SPOTS = 3000  # that are weighed


@dataclass(frozen=True)
class Camera:
    """Rows of `matrix`: right, up and towards the viewer, in the global frame."""

    matrix: Array

    def seen(self, points: Array) -> Array:
        """Right, up and towards the viewer (m) of points (…, 3)."""
        return np.asarray(points @ self.matrix.T, dtype=float)


def looking(around: float, above: float) -> Camera:
    """The camera at an angle around z (0: on the x axis, rad) and above the x–y plane; z points up in the picture."""
    c, s = np.cos(around), np.sin(around)
    towards = np.array([np.cos(above) * c, np.cos(above) * s, np.sin(above)])
    right = np.array([-s, c, 0.0])
    return Camera(np.array([right, np.cross(towards, right), towards]))


def best(shown: Space) -> tuple[float, float]:
    """Angles (rad) around z and above the horizon from which the mechanism is spread widest, never seen on its edge.

    The widest spread is the largest area of the ellipse of inertia of all places in the picture. A view from the front
    right at 28° is preferred where others gain little.
    """
    spots = shown.spots[:: -(-len(shown.spots) // MOST_SPOTS) or 1]
    seats = [shown.seated(name)[:, shown.drawable].T for name in shown.joints]
    spots = np.concatenate([spots, *(one[:: -(-len(one) // 50) or 1] for one in seats)])
    spots = spots - spots.mean(axis=0)
    scores = {}
    for above in np.radians(HEIGHTS):
        for around in np.radians(SIDES):
            x, y, _ = looking(around, above).seen(spots).T
            spread = np.linalg.det(np.cov(x, y)) if len(spots) > 2 else 0.0
            gentle = 1.0 - 0.15 * (1 - np.cos(around + np.radians(60))) / 2 - 0.1 * abs(above - np.radians(28))
            scores[float(around), float(above)] = np.sqrt(max(spread, 0.0)) * gentle + 1e-9 * gentle
    return max(scores, key=scores.__getitem__)
