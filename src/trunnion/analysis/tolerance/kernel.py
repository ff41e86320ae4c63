"""One batch of mechanisms: the curve of every measure over the positions, and a status for each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.namespace import Number
from trunnion.analysis.account import MARGIN
from trunnion.analysis.analyse import Run, pose_status, status_of
from trunnion.analysis.friction import FrictionMethod
from trunnion.analysis.kinematics import Forward, forward, posed
from trunnion.analysis.kinetostatics import Backward
from trunnion.analysis.measure_figures import Reference, known, reference
from trunnion.analysis.measure_positions import Plan
from trunnion.analysis.measures import Measure
from trunnion.analysis.tolerance.inputs import Inputs
from trunnion.errors import Finding, MechanismError

__all__ = ["Courses", "Kernel", "NumpyKernel", "batch_of", "kernel_of", "references"]


AT_ONCE = 10_000  # numbers in an array
Courses = dict[str, tuple[Number, ...]]


class Kernel(Protocol):
    """Evaluates batches: values of the mechanism, (sample, 1) where they vary, and times, s."""

    def courses(self, values: Mapping[str, Number], time: Number) -> tuple[Courses, NDArray[np.int8]]: ...


@dataclass(frozen=True)
class NumpyKernel:
    """The analysis as it is, on arrays or dual numbers."""

    run: Run
    measures: Sequence[Measure]
    friction: FrictionMethod

    @cached_property
    def forces(self) -> bool:
        """Whether any measure asks for more than the motion."""
        return not all(measure.of_motion for measure in self.measures)

    @cached_property
    def _method(self) -> FrictionMethod:
        margin = any(measure.wants_margin for measure in self.measures)
        return replace(self.friction, margin_up_to=MARGIN) if margin else self.friction

    def solved(self, values: Mapping[str, Number], time: Number) -> Backward | Forward:
        """Motion, and forces if any measure needs them."""
        with np.errstate(all="ignore"):
            if self.forces:
                return self.run.solve(time, values, self._method)
            return posed(self.run.system, values, self.run.chosen.assembly, time)

    def courses(self, values: Mapping[str, Number], time: Number) -> tuple[Courses, NDArray[np.int8]]:
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
        return tuple(_where(there, part) for part in measure.curve(found))


def batch_of(engine: str, positions: int) -> int:
    """Samples that an engine takes best at a time: of NumPy in arrays that stay in cache."""
    return max(1, AT_ONCE // positions)


def kernel_of(engine: str, run: Run, measures: Sequence[Measure], friction: FrictionMethod) -> Kernel:
    """The kernel of an engine by its name. Raises MechanismError if there is none, or its package is missing."""
    if engine == "numpy":
        return NumpyKernel(run, measures, friction)
    raise MechanismError(Finding(f"there is no engine '{engine}'", "engine", "use numpy or jax"))


def references(kernel: NumpyKernel, plan: Plan, inputs: Inputs) -> dict[str, Reference]:
    """Every measure of the nominal mechanism, pins in the middle of their holes where no seat is given."""
    run = kernel.run
    values = {**run.values}
    for joint in inputs.held:
        values.update(inputs.seat(joint, run.values))
    walk = forward(run.system, values, run.chosen.assembly, plan.times)
    courses, _ = kernel.courses(values, plan.times)
    system = run.system
    return {
        measure.name: reference(
            measure, courses[measure.name], plan.windows[measure.name], system,
            measure.coordinate(system).rate(walk) if measure.of_motion and measure.turning(system) else None,
        )
        for measure in kernel.measures
    }  # fmt: skip


def shape_of(values: Mapping[str, Number], time: Number) -> tuple[int, ...]:
    """(sample, position) of a batch."""
    shapes = {number.shape for number in values.values() if isinstance(number, (Dual, np.ndarray))}
    return np.broadcast_shapes(np.shape(time), *shapes)


def _where(known: NDArray[np.bool_], number: Number) -> Number:
    """The number, NaN where it is not known."""
    if np.all(known):
        return number
    hole = np.where(known, 0.0, np.nan)
    assert np.ndim(primal(number)) <= hole.ndim
    return number + hole
