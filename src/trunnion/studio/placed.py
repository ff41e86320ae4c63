"""Where the points of a mechanism are over its cycle, before its forces are known: what the first picture is drawn of.

It loads a third of what the analysis does, so that a model is seen while the rest is loaded and solved.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.errors import MechanismError
from trunnion.solve.forward import Forward
from trunnion.studio.loaded import Loaded, loaded

__all__ = ["column", "placed", "plain", "tracks"]

Array = NDArray[np.float64]

STEPS = 360


def placed(text: str) -> dict[str, Any]:
    """Entries, numbers and tracks of a model's text; tracks None in space and where the start has no answer."""
    state = loaded(text)
    head = {"text": text, "entries": state.entries, "tracks": None}
    try:
        found = None if state.mechanism is None or state.mechanism.space != "planar" else _walked(state)
    except MechanismError:
        return head
    if found is None or not all(np.isfinite(track[axis][0]) for track in found.values() for axis in "xy"):
        return head
    return head | {"tracks": found, "numbers": plain(state.run.values)}


@np.errstate(all="ignore")
def _walked(state: Loaded) -> dict[str, dict[str, Array]]:
    return tracks(state.run.walk(state.run.cycle.times(STEPS)), STEPS)


def column(number: Any, steps: int) -> Array:
    """A number of a walk at every position."""
    return np.broadcast_to(np.asarray(primal(number), float), (steps,))


def tracks(walk: Forward, steps: int) -> dict[str, dict[str, Array]]:
    """Where the points of the links are over the cycle, m."""
    whole = partial(column, steps=steps)
    return {
        f"{link}.{name}": dict(zip("xy", map(whole, walk.point(link, name).place), strict=False))
        for link, name in walk.system.points
    }


def plain(numbers: Mapping[str, Any]) -> dict[str, float]:
    """Nominal numbers by their paths, SI."""
    return {path: float(np.ravel(primal(value))[0]) for path, value in numbers.items()}
