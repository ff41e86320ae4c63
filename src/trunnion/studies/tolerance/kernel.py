"""One batch of mechanisms: the curve of every measure over the positions, and a status for each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, derivative, primal, single
from trunnion.algebra.namespace import Number
from trunnion.cycle.cycle_kernel import Engine
from trunnion.dynamics.measured import MotionKernel, courses_in_time
from trunnion.errors import Finding, MechanismError
from trunnion.measures.evaluation import (
    Curves,
    NumpyKernel,
    SeatedKernel,
    lanes_of,
    shape_of,
    sides_of,
    where_known,
)  # fmt: skip
from trunnion.measures.many import Many
from trunnion.measures.measures import Measure
from trunnion.measures.positions import moved
from trunnion.solve.backward import Backward
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run
from trunnion.solve.seating import seating_of
from trunnion.solve.walk_kernel import WalkKernel
from trunnion.statistics.distributions import uniforms
from trunnion.studies.tolerance.inputs import Inputs

AT_ONCE = 1 << 20  # numbers in an array of the compiled engine
PILOTS = 24  # samples that tell how finely the courses of all have to be resolved
MOST_RUNS = 512  # mechanisms whose seats are kept
WORTH_COMPILING = 500_000  # configurations; NumPy does as many in the time that compiling takes at most


@dataclass(frozen=True)
class LoadedKernel(MotionKernel):
    """Mechanisms whose pins lie where their loads press them: each by itself, as `analyse` has it.

    Where a pin crosses its hole is another place in each, so that no panels serve all. Derivatives are central
    differences. runs: the last mechanisms by their numbers, which keep the seats that were found.
    """

    runs: dict[bytes, Run] = field(default_factory=dict, compare=False, repr=False)

    def _run(self, values: Mapping[str, Number], lane: int) -> Run:
        """One of the mechanisms, over its own cycle."""
        numbers = {path: np.ravel(np.asarray(primal(number), float)) for path, number in values.items()}
        numbers_of_lane = {path: float(number[lane if len(number) > 1 else 0]) for path, number in numbers.items()}
        key = np.array(list(numbers_of_lane.values())).tobytes()
        if key not in self.runs:
            while len(self.runs) >= MOST_RUNS:
                self.runs.pop(next(iter(self.runs)))
            end = moved(self.run, numbers_of_lane, np.array([self.run.cycle.duration]))
            cycle = replace(self.run.cycle, duration=single(end))
            self.runs[key] = replace(self.run, values=numbers_of_lane, cycle=cycle)
        return self.runs[key]

    def breaks(self, values: Mapping[str, Number]) -> list[NDArray[np.float64]]:
        """Times, s, of each mechanism at which its seats or its forces may bend or jump."""
        runs = (self._run(values, lane) for lane in range(lanes_of(values)))
        return [
            np.concatenate([[bend.time for bend in run.bends], seating_of(run, self.method).breaks]) for run in runs
        ]

    def courses(self, values: Mapping[str, Number], time: Number) -> tuple[Curves, NDArray[np.int8]]:
        """As `NumpyKernel.courses`."""
        curves, status = self._solved(values, primal(time))
        if not any(isinstance(number, Dual) for number in (time, *values.values())):
            return curves, status
        below_values, above_values, step = sides_of(self.run, values)
        sides = [
            self._solved(numbers, primal(time) + sign * step * derivative(time))[0]
            for sign, numbers in ((-1.0, below_values), (1.0, above_values))
        ]
        width = np.where(step > 0, 2 * step, np.inf)
        return {
            name: tuple(
                Dual(middle, (above - below) / width)
                for middle, below, above in zip(parts, *(side[name] for side in sides), strict=True)
            )
            for name, parts in curves.items()
        }, status

    def _solved(self, values: Mapping[str, Number], time: Any) -> tuple[Curves, NDArray[np.int8]]:
        """Courses and statuses, (sample, position), of mechanisms without derivatives."""
        shape = shape_of(values, time)
        times = np.broadcast_to(time, shape).reshape(-1, shape[-1])
        runs = [self._run(values, lane) for lane in range(lanes_of(values))]
        times = times.reshape(1, -1) if len(runs) == 1 else times  # of one mechanism all at once
        once: dict[tuple[int, bytes], tuple[Curves, NDArray[np.int8]]] = {}  # derivatives have one mechanism many times
        solved = []
        for run, place in zip(runs, times, strict=True):
            key = id(run), place.tobytes()
            if key not in once:
                once[key] = SeatedKernel(run, self.measures, self.method).courses(run.values, place)
            solved.append(once[key])
        curves = {
            measure.name: tuple(
                np.array([np.broadcast_to(part, times.shape[-1:]) for part in parts]).reshape(shape)
                for parts in zip(*(courses[measure.name] for courses, _ in solved), strict=True)
            )
            for measure in self.measures
        }
        status = np.array([codes for _, codes in solved]).reshape(shape)
        return curves | courses_in_time(self.run, self.measures, values, shape), status


@dataclass(frozen=True)
class CompiledCourses(NumpyKernel):
    """The same, compiled; what that cannot decide NumPy computes again."""

    @property
    def at_once(self) -> int:
        """Places that it takes best at a time."""
        return AT_ONCE

    @cached_property
    def _parts(self) -> dict[str, tuple[Measure, int]]:
        """Measure and number of each part of each course, by a name."""
        back = self.solved(self.run.values, np.zeros(1))
        counts = [len(measure.numbers(back)) for measure in self.measures]
        pairs = zip(self.measures, counts, strict=True)
        return {f"{measure.name} {k}": (measure, k) for measure, count in pairs for k in range(count)}

    @cached_property
    def _compiled(self) -> WalkKernel:
        def figure(measure: Measure, k: int) -> Callable[[Backward], Number]:
            return lambda back: measure.numbers(back.walk if measure.of_motion else back)[k]

        figures = {name: figure(*part) for name, part in self._parts.items()}
        return WalkKernel(self.run, figures, self.forces, self.method)

    def check(self, values: Mapping[str, Number]) -> None:
        """MechanismError for a mechanism that only NumPy takes."""
        self._compiled.check(values)

    def courses(self, values: Mapping[str, Number], time: Number) -> tuple[Curves, NDArray[np.int8]]:
        """As `NumpyKernel.courses`; that takes dual numbers."""
        if any(isinstance(number, Dual) for number in (time, *values.values())):
            return super().courses(values, time)
        place = np.asarray(time, float)
        curves, status = self._compiled.curves(values, place)
        numbers: Curves = {measure.name: () for measure in self.measures}
        for name, (measure, _) in self._parts.items():
            numbers[measure.name] += (curves[name],)
        return {
            measure.name: tuple(
                where_known(measure, status, part)
                for part in measure.joined(numbers[measure.name], self.run, values, place)
            )
            for measure in self.measures
        }, status


def kernel_of(run: Run, measures: Sequence[Measure], friction: FrictionMethod, loaded: bool = False) -> NumpyKernel:
    """The kernel in NumPy. loaded: pins lie where their loads press them."""
    return (LoadedKernel if loaded else MotionKernel)(run, measures, friction)


def engine_for(engine: Engine, kernel: NumpyKernel, values: Mapping[str, Number], configurations: int) -> Engine:
    """The engine by its name; of auto the compiled one where it pays and can take the mechanism.

    Raises MechanismError if the compiled one is asked for and cannot.
    """
    timed = next((measure.name for measure in kernel.measures if measure.in_time), None)
    if engine == "numpy" or (engine == "auto" and configurations < WORTH_COMPILING):
        return "numpy"
    try:
        if isinstance(kernel, LoadedKernel):
            raise MechanismError(Finding("the compiled engine has no pins seated by their loads", "engine"))
        if timed is not None:
            what = f"the measure '{timed}' is of a motion in time, which the compiled engine does not have"
            raise MechanismError(Finding(what, "engine", "use numpy, or auto"))
        if engine == "auto":
            CompiledCourses(kernel.run, kernel.measures, kernel.friction).check(values)
    except MechanismError:
        if engine != "auto":
            raise
        return "numpy"
    return "compiled"


def many_of(kernel: NumpyKernel, inputs: Inputs, engine: str = "numpy") -> Many:
    """The measures of the nominal mechanism, pins in the middle of their holes where they have no seat."""

    def kernels(part: Sequence[Measure]) -> NumpyKernel:
        compiled = engine == "compiled"
        return CompiledCourses(kernel.run, part, kernel.friction) if compiled else replace(kernel, measures=part)

    many = Many(kernel.run, kernel.measures, inputs.nominal, kernels)
    if not inputs.pressed:
        many.tune(inputs.values(uniforms(0, 0, inputs.dims, PILOTS)))
    return many
