"""The courses of measures at the positions of a cycle, of one mechanism or of many; and their figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.namespace import Number
from trunnion.errors import Status
from trunnion.measures.figures import known
from trunnion.measures.measures import Measure
from trunnion.solve.backward import Backward
from trunnion.solve.forward import Forward, forward, posed
from trunnion.solve.friction_method import MARGIN, FrictionMethod
from trunnion.solve.memory import CHUNK
from trunnion.solve.run import Run
from trunnion.solve.seating import seating_of
from trunnion.solve.status import pose_status, status_of

__all__ = ["Curves", "Kernel", "NumpyKernel", "courses_of", "shape_of", "where_known"]

Curves = dict[str, tuple[Number, ...]]  # the parts of the course of each measure


class Kernel(Protocol):
    """Evaluates batches: values of the mechanism, (sample, 1) where they vary, and times, s.

    at_once: places that it takes best at a time.
    """

    @property
    def at_once(self) -> int: ...

    def courses(self, values: Mapping[str, Number], time: Number) -> tuple[Curves, NDArray[np.int8]]: ...


@dataclass(frozen=True)
class NumpyKernel:
    """The analysis as it is, on arrays or dual numbers."""

    run: Run
    measures: Sequence[Measure]
    friction: FrictionMethod

    @property
    def at_once(self) -> int:
        """Places whose arrays stay in cache."""
        return CHUNK

    @cached_property
    def forces(self) -> bool:
        """Whether any measure asks for more than the motion."""
        return not all(measure.of_motion for measure in self.measures)

    @cached_property
    def method(self) -> FrictionMethod:
        """How friction is settled, with the margin if a measure asks for it."""
        margin = any(measure.wants_margin for measure in self.measures)
        return replace(self.friction, margin_up_to=MARGIN) if margin else self.friction

    def solved(self, values: Mapping[str, Number], time: Number) -> Backward | Forward:
        """Motion, and forces if any measure needs them."""
        with np.errstate(all="ignore"):
            if self.forces:
                return self.run.solve(time, values, self.method)
            walk = posed if all(measure.of_places for measure in self.measures) else forward
            return walk(self.run.system, values, self.run.chosen.assembly, time)

    def courses(self, values: Mapping[str, Number], time: Number) -> tuple[Curves, NDArray[np.int8]]:
        """Course of each measure by name, parts that broadcast to (sample, position), and the status of each.

        NaN where a status rules it out.
        """
        found = self.solved(values, time)
        shape = shape_of(values, time)
        with np.errstate(all="ignore"):
            status = pose_status(found, shape) if isinstance(found, Forward) else status_of(found, shape)
            courses = {measure.name: self._course(measure, found, status) for measure in self.measures}
        return courses, status

    def _course(self, measure: Measure, found: Backward | Forward, status: NDArray[np.int8]) -> tuple[Number, ...]:
        there = known(measure, status)
        return tuple(where_known(there, part) for part in measure.curve(found))


def courses_of(
    run: Run, measures: Sequence[Measure], time: NDArray[np.float64], method: FrictionMethod
) -> tuple[Curves, NDArray[np.int8]]:
    """The course of each measure of the mechanism itself at some times, s, and their statuses; pins lie in their seats.

    What was asked of the method's margin is left to the measures.
    """
    kernel = NumpyKernel(run, tuple(measures), replace(method, margin_up_to=0.0))
    if not run.seats:
        return kernel.courses(run.values, time)
    with np.errstate(all="ignore"):
        seated = seating_of(run, kernel.method).at(time, kernel.method)
        status = status_of(seated.back, time.shape)
        np.maximum(status, np.where(seated.sticks, np.int8(Status.ZERO_SLIP), np.int8(0)), out=status)
        found = {
            measure.name: tuple(where_known(known(measure, status), part) for part in measure.curve(seated.back))
            for measure in measures
        }
    return found, status


def shape_of(values: Mapping[str, Number], time: Number) -> tuple[int, ...]:
    """(sample, position) of a batch."""
    shapes = {number.shape for number in values.values() if isinstance(number, (Dual, np.ndarray))}
    return np.broadcast_shapes(np.shape(time), *shapes)


def where_known(known: NDArray[np.bool_], number: Number) -> Number:
    """The number, NaN where it is not known."""
    if np.all(known):
        return number
    hole = np.where(known, 0.0, np.nan)
    assert np.ndim(primal(number)) <= hole.ndim
    return number + hole
