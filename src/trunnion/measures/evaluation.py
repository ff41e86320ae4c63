"""The courses of measures at the positions of a cycle, of one mechanism or of many; and their figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, derivative, primal
from trunnion.algebra.namespace import Number
from trunnion.errors import Status
from trunnion.measures.measures import Measure
from trunnion.solve.backward import Backward, pose_status, status_of
from trunnion.solve.forward import Forward, forward, posed
from trunnion.solve.friction_method import MARGIN, FrictionMethod
from trunnion.solve.run import CHUNK, Run
from trunnion.solve.seating import seating_of
from trunnion.solve.system import Values

Array = NDArray[np.float64]
Curves = dict[str, tuple[Number, ...]]  # the parts of the course of each measure
STEP, STEP_OF_NONE = 1e-3, 1e-4  # of a number, and of the size of the mechanism for one that is 0: of a difference


@dataclass(frozen=True)
class NumpyKernel:
    """Evaluates batches, on arrays or dual numbers: values, (sample, 1) where they vary, and times, s."""

    run: Run
    measures: Sequence[Measure]
    friction: FrictionMethod

    @property
    def at_once(self) -> int:
        """Places that it takes best at a time: their arrays stay in cache."""
        return CHUNK

    def breaks(self, values: Values) -> list[Array] | None:
        """Times, s, of each mechanism at which its courses may bend or jump; None where they follow from those of the
        nominal one."""
        return None

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
        solved, shape = self.solved(values, time), shape_of(values, time)
        with np.errstate(all="ignore"):
            status = pose_status(solved, shape) if isinstance(solved, Forward) else status_of(solved, shape)
            return self.curves(solved, status), status

    def curves(self, solved: Backward | Forward, status: NDArray[np.int8]) -> Curves:
        """The parts of the courses of what is solved."""
        return {
            measure.name: tuple(where_known(measure, status, part) for part in measure.curve(solved))
            for measure in self.measures
        }


@dataclass(frozen=True)
class SeatedKernel(NumpyKernel):
    """The mechanism itself at times of its cycle, s, pins in their seats. gaps: from and to, s, (2, gap), where one is
    to have lost contact."""

    gaps: Array = field(default_factory=lambda: np.zeros((2, 0)))

    def courses(self, values: Mapping[str, Number], time: Number) -> tuple[Curves, NDArray[np.int8]]:
        """As `NumpyKernel.courses`."""
        if not self.run.seats:
            return super().courses(values, time)
        place = np.asarray(time)
        with np.errstate(all="ignore"):
            seated = seating_of(self.run, self.method).at(place, self.method)
            status = status_of(seated.back, place.shape)
            np.maximum(status, np.where(seated.sticks, np.int8(Status.ZERO_SLIP), np.int8(0)), out=status)
            curves = self.curves(seated.back, status)
        locked = status == Status.LOCKED  # no load presses a pin there, so that nothing is known of its place
        curves = {name: tuple(np.where(locked, np.nan, part) for part in parts) for name, parts in curves.items()}
        lost = np.any((self.gaps[0] < place[:, None]) & (place[:, None] < self.gaps[1]), axis=1)
        return curves, np.where(lost, np.maximum(status, np.int8(Status.CONTACT_LOST)), status)


def courses_of(
    run: Run, measures: Sequence[Measure], time: Array, method: FrictionMethod
) -> tuple[Curves, NDArray[np.int8]]:
    """The course of each measure of the mechanism itself at some times, s, and their statuses; pins lie in their seats.

    What was asked of the method's margin is left to the measures.
    """
    return SeatedKernel(run, tuple(measures), replace(method, margin_up_to=0.0)).courses(run.values, time)


def shape_of(values: Mapping[str, Number], time: Number) -> tuple[int, ...]:
    """(sample, position) of a batch."""
    shapes = {number.shape for number in values.values() if isinstance(number, (Dual, np.ndarray))}
    return np.broadcast_shapes(np.shape(time), *shapes)


def lanes_of(values: Mapping[str, Number]) -> int:
    """How many mechanisms values are of."""
    shape = shape_of(values, np.zeros(1))
    return shape[0] if len(shape) == 2 else 1


def picked(values: Mapping[str, Number], lanes: NDArray[np.intp]) -> dict[str, Number]:
    """The numbers of some mechanisms."""
    return {
        path: value[lanes] if np.ndim(primal(value)) == 2 and len(primal(value)) > 1 else value
        for path, value in values.items()
    }


def step_of(run: Run, values: Mapping[str, Number], count: int) -> Array:
    """By how much each mechanism is moved along its derivatives for a difference, (lane, 1); 0 of one without any."""
    size = float(np.ravel(primal(run.system.size(run.values)))[0])
    step = np.zeros((count, 1))
    for value in values.values():
        if not isinstance(value, Dual):
            continue
        slope = np.abs(np.broadcast_to(derivative(value), (count, 1)))
        number = np.abs(np.broadcast_to(primal(value), (count, 1)))
        with np.errstate(all="ignore"):
            step_size = np.where(number > 1e-9 * size, STEP * number / slope, STEP_OF_NONE * size / slope)
        step = np.where((slope > 0) & ((step_size < step) | (step == 0)), step_size, step)
    return step


def sides_of(run: Run, values: Values, share: float = 1.0) -> tuple[Values, Values, Array]:
    """Numbers of mechanisms moved along their derivatives to either side, and by how much, (lane, 1): a share of the
    step of a difference, 0 without derivatives."""
    step = share * step_of(run, values, lanes_of(values))
    below, above = (
        {
            path: primal(value) + sign * step * derivative(value) if isinstance(value, Dual) else value
            for path, value in values.items()
        }
        for sign in (-1.0, 1.0)
    )
    return below, above, step


def where_known(measure: Measure, status: NDArray[np.int8], number: Number) -> Number:
    """The course of a measure, NaN where the status of the positions says that it has no answer."""
    if measure.of_motion:
        valid = status < (Status.NOT_ASSEMBLED if measure.of_places else Status.SINGULAR)
    else:
        valid = status < (Status.LOAD_UNDEFINED if measure.wants_margin else Status.NOT_CONVERGED)
    return number if np.all(valid) else number + np.where(valid, 0.0, np.nan)
