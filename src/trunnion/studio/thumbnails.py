"""Small pictures of the examples: links at one position and the paths of their points, for the page to draw."""

from __future__ import annotations

from functools import lru_cache
from math import cos, radians, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import MechanismError
from trunnion.studio.loaded import loaded
from trunnion.studio.placed import column

__all__ = ["thumbnail"]

Array = NDArray[np.float64]

STEPS = 60
SHOWN = 8  # position of them that is drawn: at the start many mechanisms lie in line
TURNED, TILTED = radians(35), radians(25)  # of the view of mechanisms in space, in which z is up


@lru_cache(maxsize=128)
def thumbnail(text: str) -> dict[str, Any]:
    """Links with their points, and paths, in a plane, m; no links of a model that is not placed.

    Of mechanisms in space a parallel projection.
    """
    state = loaded(text)
    try:
        if state.mechanism is None:
            return {"links": [], "paths": []}
        with np.errstate(all="ignore"):
            walk = state.run.walk(state.run.cycle.times(STEPS))
            places = {
                (link, name): _seen([column(part, STEPS) for part in walk.point(link, name).place])
                for link, name in walk.system.points
            }
    except MechanismError:
        return {"links": [], "paths": []}
    whole = [k for k in range(STEPS) if all(np.isfinite(track[:, k]).all() for track in places.values())]
    if not whole:
        return {"links": [], "paths": []}
    shown = whole[min(SHOWN, len(whole) - 1)]
    links: dict[str, list[list[float]]] = {}
    for (link, _), track in places.items():
        links.setdefault(link, []).append([float(part) for part in track[:, shown]])
    ground = walk.system.mechanism.fixed_link
    moved = [track[:, whole] for (link, _), track in places.items() if link != ground]
    return {
        "links": [{"ground": link == ground, "points": points} for link, points in links.items()],
        "paths": [{"x": track[0], "y": track[1]} for track in _different(moved)],
    }


def _seen(place: list[Array]) -> Array:
    if len(place) == 2:
        return np.array(place)
    x, y, z = place
    across, depth = cos(TURNED) * x + sin(TURNED) * y, cos(TURNED) * y - sin(TURNED) * x
    return np.array([across, cos(TILTED) * z + sin(TILTED) * depth])


def _different(tracks: list[Array]) -> list[Array]:
    """Those that move, once each: the points of a joint lie on each other."""
    kept: list[Array] = []
    for track in tracks:
        size = float(np.max(np.ptp(track, axis=1)))
        if size and not any(np.allclose(track, other, rtol=0, atol=1e-6 * size) for other in kept):
            kept.append(track)
    return kept
