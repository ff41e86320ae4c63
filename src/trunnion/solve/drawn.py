"""Where in the cycle an assembly is told: where its hints hold, or where its links are drawn.

Links that are all given in one frame, with their joints where they meet, are meant to be assembled as drawn.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra import space
from trunnion.algebra.dual import primal
from trunnion.algebra.nested import each
from trunnion.algebra.space import ORIGIN
from trunnion.joints.pairs import PAIRS
from trunnion.model.parts import AT
from trunnion.solve.forward import Forward
from trunnion.solve.system import System, Values

__all__ = ["drawn_at", "hinted_at", "off_drawing"]

Array = NDArray[np.float64]
ALIKE = 1e-6  # rad, or of the size, and of how far off: positions as near as the nearest
MEETS = 1e-6  # of the size, and of unit vectors: elements that coincide as drawn


def drawn_at(walk: Forward, times: Array) -> int | None:
    """The position of some at which the drivers are nearest to where they are drawn; None if links are not drawn so."""
    system, values = walk.system, walk.values
    if not _in_one_frame(system, values, float(np.max(primal(walk.size)))):
        return None
    elements, driven = system.stated_elements(values), dict[str, float]()
    for name in system.mechanism.drivers:
        first, second = (elements[link, name] for link in system.joints[name][1])
        driven[name] = float(np.ravel(walk.coordinate(name, first, second))[0])
    return _nearest(walk, times, driven)


def hinted_at(walk: Forward, times: Array) -> int:
    """The position of some at which the first driver is nearest to where the hints hold; the start if that is open."""
    time_stated, drivers = walk.values.get(f"assembly.{AT}"), list(walk.system.mechanism.drivers)
    if time_stated is None or not drivers or AT in walk.system.joints:
        return 0
    return _nearest(walk, times, {drivers[0]: float(np.ravel(primal(time_stated))[0])})


def _nearest(walk: Forward, times: Array, driven: Mapping[str, float]) -> int:
    """The first position of some at which drivers are nearest to these coordinates."""
    system, away = walk.system, np.zeros(len(times))
    for name, coordinate in driven.items():
        apart = np.ravel(primal(system.drive(walk.values, name, times)[0])) - coordinate
        size = 1.0 if system.turns(name) else float(np.max(primal(walk.size)))
        away = away + (np.arctan2(np.sin(apart), np.cos(apart)) if system.turns(name) else apart / size) ** 2
    return int(np.argmax(away <= (1 + ALIKE) * np.min(away) + ALIKE**2))  # of the turns of a cycle the first


def off_drawing(walk: Forward, frames: Sequence[Any], spun: Sequence[int], unturned: Sequence[Any]) -> Array:
    """Sum of the squared distances of links from where they are drawn, m².

    frames: of the links of a module; spun: those that spin freely, of which only what a spin leaves alone counts;
    unturned: its lengths, and those that are drawn.
    """
    size, total = float(np.max(primal(walk.size))), np.zeros(())
    for link, frame in enumerate(frames):
        if link in spun:
            continue
        if isinstance(frame, space.Frame):
            parts = zip(frame, ORIGIN, (size, size, size, 1.0), strict=True)
            total = total + sum(
                (scale * (primal(is_) - was)) ** 2
                for axis, drawn, scale in parts
                for is_, was in zip(axis, drawn, strict=True)
            )
        else:
            x, y, c, s = (primal(part) for part in frame)
            total = total + x**2 + y**2 + (size * (c - 1.0)) ** 2 + (size * s) ** 2
    for is_, was in unturned:
        total = total + (is_ - was) ** 2
    return np.asarray(total, float)


def _in_one_frame(system: System, values: Values, size: float) -> bool:
    """Whether the elements of every joint coincide where the frames of all links do."""
    mechanism = system.mechanism
    if mechanism.loop or mechanism.gears or not mechanism.drivers:
        return False
    drawn_elements = system.stated_elements(values)
    elements = {key: each(frame, lambda n: float(np.ravel(primal(n))[0])) for key, frame in drawn_elements.items()}
    return all(
        _meets(system, kind, elements[first, name], elements[second, name], size)
        for name, (kind, (first, second)) in system.joints.items()
    )


def _meets(system: System, kind: str, first: Any, second: Any, size: float) -> bool:
    pair = PAIRS[kind]
    if not system.spatial:
        away = np.array([second.x - first.x, second.y - first.y]) / size
        along = np.array([first.c, first.s])
        if not pair.guided:
            return bool(np.linalg.norm(away) < MEETS)
        across = abs(float(away @ [-along[1], along[0]]))
        return across < MEETS and bool(np.linalg.norm(along - [second.c, second.s]) < MEETS)
    if pair.threaded:
        return False
    away, x, z = (np.subtract(second[k], first[k]) / scale for k, scale in ((3, size), (0, 1.0), (2, 1.0)))
    axis = np.array(first.z)
    if pair.name == "planar":
        return bool(abs(away @ axis) < MEETS and np.linalg.norm(z) < MEETS)
    if pair.slides:
        away = away - (away @ axis) * axis
    turned = [] if pair.ball else [float(axis @ second.z)] if pair.crossed else [*z]
    kept_axis = [*x] if pair.name in ("prismatic", "fixed") else []
    return bool(np.linalg.norm([*away, *turned, *kept_axis]) < MEETS)
