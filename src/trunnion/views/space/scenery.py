"""A mechanism in space as it is looked at: its solids, the camera, and the size of the picture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from trunnion.views.common.cycle import Array
from trunnion.views.space.bodies import Space
from trunnion.views.space.camera import Camera, best, looking
from trunnion.views.space.solids import Solid, solids

__all__ = ["Scenery", "scenery"]


@dataclass(frozen=True)
class Scenery:
    """A mechanism with its solids and the camera; box: left, below, right, above (m) of all that may be seen."""

    shown: Space
    solids: list[Solid]
    camera: Camera
    box: tuple[float, float, float, float]

    @property
    def diagonal(self) -> float:
        """Size of the picture, m."""
        left, below, right, above = self.box
        return float(np.hypot(right - left, above - below))


def scenery(shown: Space, camera: Camera | None = None) -> Scenery:
    """Look at a mechanism, from the best side if not told."""
    camera = camera or looking(*best(shown))
    found = solids(shown)
    corners = []
    picked = np.flatnonzero(shown.drawable)
    picked = picked[:: max(1, picked.size // 60)]
    for solid in found:
        pose = shown.poses[solid.link]
        points = solid.points if solid.kind != "box" else _corners(solid.points)
        places = np.einsum("ijn,kj->nki", pose.matrix[:, :, picked], points) + pose.origin[:, picked].T[:, None]
        seen = camera.seen(places.reshape(-1, 3))[:, :2]
        corners += [seen.min(axis=0) - solid.radius, seen.max(axis=0) + solid.radius]
    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    return Scenery(shown, found, camera, (float(low[0]), float(low[1]), float(high[0]), float(high[1])))


def _corners(points: Array) -> Array:
    middle, *halves = points
    signs = np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)], dtype=float)
    return np.asarray(middle + signs @ np.array(halves), dtype=float)
