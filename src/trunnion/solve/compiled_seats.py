"""The walks by which pins settle in their seats, compiled: the rounds, how links move as seats travel, and the last."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from trunnion.algebra.namespace import Number
from trunnion.algebra.nested import each, flat
from trunnion.errors import Status
from trunnion.solve.backward import Backward, Sense
from trunnion.solve.compiled import Array
from trunnion.solve.compiled_vectors import VectorKernel
from trunnion.solve.eccentricity_rate import Moved, moved
from trunnion.solve.forward import Travel
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run
from trunnion.solve.seating import ByNumpy, Pressed, centred, wanted
from trunnion.solve.system import Values, rubbing

__all__ = ["CompiledLooks", "Travelling", "as_inputs"]

FEW = 256  # positions that NumPy does as quickly; they are those that are hard to settle, where rounding decides
RATE, SPEED = "rate ", "speed "  # before the path of an offset, the name of a joint
Tell = Callable[[Backward], dict[str, Number]]


class _Motion(NamedTuple):
    twist: Any
    acceleration: Any


class SeatKernels:
    """The kernels of a run whose pins lie in seats. MechanismError as `CompiledKernel` raises it."""

    def __init__(self, run: Run, method: FrictionMethod) -> None:
        self.run, self.method = run, method
        self.loaded = [seat for seat in run.seats if seat.given is None]
        start = run.ideal(np.zeros(1), method)
        self.links = [link for module in run.system.plan.modules for link in module.links]
        self.motion = {link: start.walk.motions[link] for link in self.links}
        self.paths = list(wanted(run.seats, start))
        offsets = {path: np.zeros((1, 2)) for path in self.paths}
        rates = {RATE + path: np.zeros((1, 2)) for path in self.paths}
        own = list(self._tell(start))
        self.ideal = self._kernel(self._tell_ideal, [*own, *self._names(2)], run.ideal_values)
        if self.loaded:
            lain = {**run.values, **offsets}
            self.rounds = self._kernel(self._tell, own, lain)
            self.moved = self._kernel(self._tell_moved, self._names(3), {**lain, **rates}, forces=False)

    def _kernel(self, tell: Tell, names: Iterable[str], values: Values, forces: bool = True) -> VectorKernel:
        last: tuple[Backward | None, dict[str, Number]] = None, {}

        def told(back: Backward) -> dict[str, Number]:
            """All figures of a walk; those of the last one are remembered, for they are asked for one by one."""
            nonlocal last
            if last[0] is not back:
                last = back, tell(back)
            return last[1]

        figures = {name: lambda back, name=name: told(back)[name] for name in names}
        what = f"seats {tell.__name__}"
        kernel = VectorKernel(self.run, figures, forces, self.method, gravest=Status.SOLVED, described=what)
        kernel.check(values, np.zeros(2))
        return kernel

    def _tell(self, back: Backward) -> dict[str, Number]:
        speeds = {SPEED + joint: back.slips[joint].speed for joint in rubbing(self.run.system)}
        return {**wanted(self.loaded, back), **speeds}

    def _tell_ideal(self, back: Backward) -> dict[str, Number]:
        return self._tell(back) | _numbered((link, back.walk.motions[link][1:]) for link in self.links)

    def _tell_moved(self, back: Backward) -> dict[str, Number]:
        values = back.walk.values
        found = moved(self.run, values, {path: values[RATE + path] for path in self.paths}, back.walk.time)
        return _numbered(found.items())

    def _names(self, parts: int) -> list[str]:
        return [name for link in self.links for name in _names(link, parts * _size(self.motion[link]))]

    def motions(self, found: Mapping[str, Array], parts: int) -> dict[str, tuple[Any, ...]]:
        """So many twists or accelerations of every link, from the rows of their numbers."""
        told = {}
        for link in self.links:
            rows = iter(found[name][0] for name in _names(link, parts * _size(self.motion[link])))
            told[link] = tuple(_like(self.motion[link].twist, rows) for _ in range(parts))
        return told


class CompiledLooks(ByNumpy):
    """`Looks` by the kernels of a run, made once; the ideal mechanism at these times of all lanes, s."""

    def __init__(self, run: Run, times: Array, method: FrictionMethod) -> None:
        quick = replace(method, margin_up_to=0.0)
        self._kernels = kernels = run.once(("seats", quick), lambda: SeatKernels(run, quick))
        found = kernels.ideal.curves(run.ideal_values, times)[0]
        super().__init__(run, kernels.method, self._pressed(found), {
            link: _Motion(*parts) for link, parts in kernels.motions(found, 2).items()
        })  # fmt: skip

    def pressed(self, time: Array, offsets: Mapping[str, Array], travel: Mapping[str, Travel] | None = None) -> Pressed:
        if travel or len(time) < FEW:
            return super().pressed(time, offsets, travel)
        values = {**self._kernels.run.values, **as_inputs(offsets, {})}
        return self._pressed(self._kernels.rounds.curves(values, time)[0])

    def moved(self, time: Array, offsets: Mapping[str, Array], rates: Mapping[str, Array]) -> Mapping[str, Moved]:
        none = np.zeros((1, len(time)))
        rated = {RATE + path: rates[path][None] if path in rates else none for path in offsets}
        values = {**self._kernels.run.values, **as_inputs(offsets, {}), **rated}
        found = self._kernels.moved.curves(values, time)[0]
        return {link: Moved(*parts) for link, parts in self._kernels.motions(found, 3).items()}

    def _pressed(self, found: Mapping[str, Array]) -> Pressed:
        kernels = self._kernels
        count = np.shape(next(iter(found.values())))[-1]
        given = [seat for seat in kernels.run.seats if seat.given is not None]
        stated = {
            path: number
            for seat in given
            for path, number in seat.play.model.paths(f"seats.{seat.joint}", seat.given or []).items()
        }
        offsets = {
            path: np.full(count, float(stated[path])) if path in stated
            else centred(found[path][0])
            for path in kernels.paths
        }  # fmt: skip
        speeds = [found[SPEED + joint][0] for joint in rubbing(kernels.run.system)]
        return Pressed(offsets, np.array(speeds).reshape(len(speeds), count))


@dataclass(frozen=True)
class Travelling(Run):
    """A run among whose numbers is how its links also move (`travel.LINK.0` …, see `as_inputs`)."""

    def solve(
        self,
        time: Number,
        values: Values | None = None,
        method: FrictionMethod | None = None,
        zero_slip: Mapping[str, Sense] | None = None,
    ) -> Backward:
        """See `Run.solve`."""
        values = self.values if values is None else values
        return self._solve(time, values, {}, method, zero_slip, self._travel(values))

    @functools.cached_property
    def _still(self) -> dict[str, Any]:
        ground = self.system.mechanism.fixed_link
        motions = self.walk(np.zeros(1)).motions.items()
        return {link: motion for link, motion in motions if link != ground}

    def _travel(self, values: Values) -> dict[str, Travel]:
        found = {}
        for link, motion in self._still.items():
            count = 2 * _size(motion)
            if f"travel.{link} 0" in values:
                rows = iter(values[f"travel.{name}"] for name in _names(link, count))
                found[link] = Travel(*(_like(motion.twist, rows) for _ in range(2)))
        return found


def as_inputs(offsets: Mapping[str, Array], moving: Mapping[str, Travel]) -> dict[str, Array]:
    """Seats and what their travel does as numbers of a kernel, (1, position) by path."""
    count = len(next(iter(offsets.values())))
    numbers = _numbered((f"travel.{link}", tuple(own)) for link, own in moving.items())
    both = {**offsets, **numbers}
    return {path: np.broadcast_to(np.asarray(number, float), (count,))[None] for path, number in both.items()}


def _numbered(parts: Iterable[tuple[str, Any]]) -> dict[str, Number]:
    """The numbers in nested tuples, each under its name and its place."""
    return {f"{name} {k}": number for name, part in parts for k, number in enumerate(flat(tuple(part)))}


def _size(motion: Any) -> int:
    """Numbers of a twist."""
    return len(list(flat(motion.twist)))


def _like(twist: Any, rows: Iterator[Number]) -> Any:
    """The next numbers as a twist."""
    return each(twist, lambda _: next(rows))


def _names(name: str, count: int) -> list[str]:
    return [f"{name} {k}" for k in range(count)]
