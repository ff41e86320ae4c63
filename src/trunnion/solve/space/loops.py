"""The loops of an over-constrained mechanism with the offsets of its pins, guides and balls as further unknowns.

How far they are open is a function of the coordinates q and of the end offsets c of every joint with play. Position
by position, all lanes at once:

    gap(q + δq, c + δc) ≈ gap + J δq + C δc

J has the screws of the joints; C, of the offsets, comes from dual numbers through the same functions.
"""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.namespace import Number
from trunnion.groups.redundant import stacked
from trunnion.groups.spatial import SpatialGroup
from trunnion.groups.tree import Element
from trunnion.joints.clearance import CLEARANCE_MODELS
from trunnion.joints.pairs import PAIRS
from trunnion.joints.spatial import MOTIONS
from trunnion.solve import shifts
from trunnion.solve.system import System, Values, driven_coordinates

__all__ = ["End", "LinearLoops", "Loops", "ends_of"]

Array = NDArray[np.float64]
LARGEST = 0.3  # rad, or of the size: a coordinate goes no farther in one step
ROUNDS = 60  # of least squares, to where the loops are open least
STILL = 1e-10  # step at which they end


class End(NamedTuple):
    """One end of a joint's play: its joint, its number, the names of its components, as "1.x", the radius that is
    stated, m, and whether it is that of a pin in its hole (not an end float, a guide or a ball).
    """

    joint: str
    number: int
    keys: tuple[str, ...]
    radius: float
    pin: bool

    @property
    def axes(self) -> tuple[str, ...]:
        """The axes of its components."""
        return tuple(key.partition(".")[2] for key in self.keys)


class LinearLoops(NamedTuple):
    """gap (lane, row), J (lane, row, coordinate) and C (lane, row, component): rad and lengths over the size."""

    gap: Array
    jacobian: Array
    effect: Array


def ends_of(system: System, values: Values, every_pin: bool) -> list[End]:
    """The ends of all plays that are stated, and of pins that state none if `every_pin`; NaN lengths are left in."""
    ends: list[End] = []
    for name, (kind, _) in system.joints.items():
        model = CLEARANCE_MODELS["spatial"].get(kind)
        if model is None:
            continue
        play = shifts.play_of("spatial", kind, values, name)
        pin = PAIRS[kind].bored
        for k, keys in enumerate(model.ends):
            radius = float(np.ravel(primal(play.radii[k]))[0]) if play else 0.0
            radial = pin and k not in model.axial
            if radius > 0 or (radial and every_pin):
                ends.append(End(name, k, keys, radius, radial))
    return ends


@dataclass(frozen=True)
class Loops:
    """The loops of one module whose other links all lie still.

    holes: local elements with the errors of the mechanism, pins in the middle; drive: driven coordinates, each a number
    or (lane,).
    """

    system: System
    values: Values
    ends: tuple[End, ...]
    holes: Mapping[tuple[str, str], Any]
    drive: tuple[Number, ...]
    size: float

    @classmethod
    def of(cls, system: System, values: Values, ends: Sequence[End], time: Array) -> Loops:
        """The loops at the given times, s."""
        holes, module = system.holes(values), system.plan.modules[0]
        drive = driven_coordinates(system, module, system.places[0], values, time)[0]
        return cls(system, values, tuple(ends), holes, tuple(drive), float(np.ravel(system.size(values, holes))[0]))

    @cached_property
    def group(self) -> SpatialGroup:
        """The module."""
        group: SpatialGroup = self.system.groups[0]
        return group

    @cached_property
    def components(self) -> list[str]:
        """Path of every offset among the values."""
        return [f"seats.{end.joint}.{key}" for end in self.ends for key in end.keys]

    def at(self, lanes: NDArray[np.intp]) -> Loops:
        """The same at some of the lanes."""
        return replace(self, drive=tuple(q[lanes] if np.ndim(q) else q for q in self.drive))

    # ---- geometry -------------------------------------------------------------------------------------------

    def _elements(self, offsets: Sequence[Number]) -> list[Element]:
        values = ChainMap(dict(zip(self.components, offsets, strict=True)), dict(self.values))
        elements = []
        for place in self.system.places[0]:
            (first, second), name = place.links, place.joint
            lain = shifts.seated("spatial", self.holes[second, name], place.kind, values, name)
            elements.append(Element(self.holes[first, name], lain, self.system.lead(self.values, name)))
        return elements

    def _coordinates(self, q: Array, deep: bool = False) -> list[list[Number]]:
        """Coordinates (lane, kept) joint by joint, each (lane,), or (lane, 1) if `deep`."""

        def column(value: Number) -> Number:
            return np.asarray(value, float)[:, None] if deep and np.ndim(value) else value

        return self.group.coordinates([column(row) for row in q.T], [column(value) for value in self.drive])

    def linear(self, q: Array, c: Array) -> LinearLoops:
        """Gap and its derivatives at coordinates (lane, kept) and offsets (lane, component), m."""
        group, count = self.group, c.shape[1]
        joints = self._coordinates(q)
        _, placed, screws = self._place(q, c)
        gap = _full(group.gaps(placed, joints, self.size), (len(q),))
        jacobian = np.broadcast_to(
            stacked(group.jacobian(placed, screws, self.size)), (len(q), gap.shape[1], len(group.free))
        )
        if not count:
            return LinearLoops(gap, jacobian, np.zeros((*gap.shape, 0)))
        seeds = [Dual(offset[:, None], row[None, :]) for offset, row in zip(c.T, np.eye(count), strict=True)]
        deep = self._coordinates(q, deep=True)
        opened = group.gaps(group.place(self._elements(seeds), deep)[1], deep, self.size)
        effect = _full([n.dual if isinstance(n, Dual) else 0.0 for n in opened], (len(q), count))
        return LinearLoops(gap, jacobian, effect)

    def opening(self, q: Array, c: Array) -> Array:
        """Largest opening of a loop at every lane, in units of the size; rad."""
        joints, (_, placed, _) = self._coordinates(q), self._place(q, c)
        return np.broadcast_to(self.group.opening(placed, joints, self.size), (len(q),)) / self.size

    def frames(self, q: Array, c: Array) -> tuple[Any, ...]:
        """Frames of the links."""
        frames: tuple[Any, ...] = self._place(q, c)[0]
        return frames

    def _place(self, q: Array, c: Array) -> tuple[Any, ...]:
        placed: tuple[Any, ...] = self.group.place(self._elements(list(c.T)), self._coordinates(q))
        return placed

    def moved(self, q: Array, steps: Array) -> Array:
        """Coordinates (lane, kept) after steps (lane, free) in every free coordinate, slides in units of the size."""
        group = self.group
        parts: list[list[Number]] = [[0.0] * len(MOTIONS[joint.kind].steps) for joint in group.joints]
        for (k, i), step in zip(group.free, steps.T, strict=True):
            parts[k][i] = step * self.size if group.slides(k, i) else step
        coordinates: list[Number] = []
        for joint, values, step in zip(group.joints, self._coordinates(q), parts, strict=True):
            coordinates += MOTIONS[joint.kind].advanced(values, step)
        return np.stack([np.broadcast_to(coordinates[i], (len(q),)) for i in group.kept], axis=-1)

    def least_open(self, q: Array, c: Array) -> tuple[Array, Array]:
        """Coordinates near by at which the loops are open least (least squares), and by how much: (lane,)."""
        lanes = np.flatnonzero(np.isfinite(q).all(axis=1))
        part, near = self.at(lanes), q[lanes]
        for _ in range(ROUNDS):
            linear = part.linear(near, c[lanes])
            steps = -(np.linalg.pinv(linear.jacobian) @ linear.gap[..., None])[..., 0]
            largest = np.max(np.abs(steps), axis=-1, initial=0.0)
            near = part.moved(near, steps * np.minimum(1.0, LARGEST / np.maximum(largest, 1e-300))[:, None])
            if not np.any(largest > STILL):
                break
        nearest, gap = q.copy(), np.full(len(q), np.nan)
        nearest[lanes] = near
        gap[lanes] = np.max(np.abs(part.linear(near, c[lanes]).gap), axis=-1, initial=0.0)
        return nearest, gap


def _full(rows: Sequence[Number], shape: tuple[int, ...]) -> Array:
    """(lane, row, …) of rows that broadcast to (lane, …)."""
    return np.stack([np.broadcast_to(np.asarray(row, float), shape) for row in rows], axis=1)
