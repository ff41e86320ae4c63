"""Where the points of a mechanism are over its cycle, without its forces; small pictures of the examples."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from math import cos, radians, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.nested import flat
from trunnion.errors import MechanismError
from trunnion.solve.forward import Forward
from trunnion.studio.loaded import Loaded, loaded

__all__ = ["column", "columns", "plain", "thumbnail", "tracked", "tracks"]

Array = NDArray[np.float64]

SMALL_STEPS = 60  # of a small picture
SHOWN = 8  # position of them that is drawn: at the start many mechanisms lie in line
TURNED, TILTED = radians(35), radians(25)  # of the view of mechanisms in space, in which z is up


@lru_cache(maxsize=4)
@np.errstate(all="ignore")
def tracked(state: Loaded, steps: int) -> dict[str, dict[str, Array]]:
    """Tracks of a model's points; MechanismError where its structure does not determine them."""
    return tracks(state.run.posed(state.run.cycle.times(steps), state.run.values), steps)


def column(number: Any, steps: int) -> Array:
    """A number of a walk at every position."""
    return np.broadcast_to(np.asarray(primal(number), float), (steps,))


def columns(numbers: Sequence[Any], steps: int) -> Array:
    """Numbers of a walk at every position, (number, position): a call for each takes longer than all of them."""
    table = np.empty((len(numbers), steps))
    for row, number in zip(table, numbers, strict=True):
        row[:] = primal(number)
    return table


def tracks(walk: Forward, steps: int, points: Iterable[tuple[str, str]] | None = None) -> dict[str, dict[str, Array]]:
    """Where points (link, name) are over the positions of a walk, m, by "link.name"; all if none are named."""
    points = list(walk.system.points if points is None else points)
    order = {link: k for k, link in enumerate(dict.fromkeys(link for link, _ in points))}
    numbers = columns([number for link in order for number in flat(walk.frames[link])], steps)
    frames = numbers.reshape(len(order), -1, steps).swapaxes(0, 1)
    if walk.system.spatial:
        axes, origin = frames[:9].reshape(3, 3, len(order), steps), frames[9:]
    else:
        x, y, c, s = frames
        axes, origin = np.array([[c, s], [-s, c]]), np.array([x, y])
    of = [order[link] for link, _ in points]
    local = np.array([walk.local_place(link, name) for link, name in points], float).reshape(len(of), -1).T
    places = origin[:, of] + sum(part[:, None] * axis[:, of] for part, axis in zip(local, axes, strict=True))
    return {f"{link}.{name}": dict(zip(walk.system.axes, place, strict=True))
            for (link, name), place in zip(points, places.swapaxes(0, 1), strict=True)}  # fmt: skip


def plain(numbers: Mapping[str, Any]) -> dict[str, float]:
    """Nominal numbers by their paths, SI."""
    return {path: float(np.ravel(primal(value))[0]) for path, value in numbers.items()}


# ---- small pictures of the examples -----------------------------------------------------------------------------


@lru_cache(maxsize=128)
def thumbnail(text: str) -> dict[str, Any]:
    """Links with their points at one position, and paths, in a plane, m; none of a model not placed.

    Of mechanisms in space a parallel projection.
    """
    state = loaded(text)
    try:
        places = {key: _projected(list(track.values())) for key, track in tracked(state, SMALL_STEPS).items()}
    except MechanismError:
        places = {}
    complete = np.all([np.isfinite(track).all(axis=0) for track in places.values()], axis=0) if places else [False]
    if not np.any(complete):
        return {"links": [], "paths": []}
    reached, ground = np.flatnonzero(complete), state.run.system.mechanism.fixed_link
    index = reached[min(SHOWN, len(reached) - 1)]
    links: dict[str, list[list[float]]] = {}
    for key, track in places.items():
        links.setdefault(key.rpartition(".")[0], []).append([float(part) for part in track[:, index]])
    moved = [track[:, reached] for key, track in places.items() if key.rpartition(".")[0] != ground]
    return {
        "links": [{"ground": link == ground, "points": points} for link, points in links.items()],
        "paths": [{"x": x, "y": y} for x, y in moved if np.ptp(x) + np.ptp(y) > 0],
    }  # fmt: skip


def _projected(place: list[Array]) -> Array:
    if len(place) == 2:
        return np.array(place)
    x, y, z = place
    across, depth = cos(TURNED) * x + sin(TURNED) * y, cos(TURNED) * y - sin(TURNED) * x
    return np.array([across, cos(TILTED) * z + sin(TILTED) * depth])
