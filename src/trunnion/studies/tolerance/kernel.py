"""One batch of mechanisms: the curve of every measure over the positions, and a status for each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number
from trunnion.dynamics.measured import MotionKernel
from trunnion.errors import Finding, MechanismError
from trunnion.measures.evaluation import Courses, Kernel, NumpyKernel, sharpened, where_known
from trunnion.measures.figures import Reference, known, reference
from trunnion.measures.measures import Measure
from trunnion.measures.positions import PositionPlan
from trunnion.solve.backward import Backward
from trunnion.solve.forward import forward
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run
from trunnion.solve.walk_kernel import WalkKernel
from trunnion.studies.tolerance.inputs import Inputs

__all__ = ["batch_of", "engine_for", "kernel_of", "references"]

AT_ONCE = {"numpy": 10_000, "compiled": 1 << 20}  # numbers in an array, by engine
WORTH_COMPILING = 500_000  # configurations; NumPy does as many in the time that compiling takes at most


@dataclass(frozen=True)
class CompiledCourses:
    """The same, compiled; what that cannot decide NumPy computes again. numpy: the kernel it stands for."""

    numpy: NumpyKernel

    @cached_property
    def _parts(self) -> dict[str, tuple[Measure, int]]:
        """Measure and number of each part of each course, by a name."""
        kernel = self.numpy
        back = kernel.solved(kernel.run.values, np.zeros(1))
        counts = [len(measure.curve(back)) for measure in kernel.measures]
        pairs = zip(kernel.measures, counts, strict=True)
        return {f"{measure.name} {k}": (measure, k) for measure, count in pairs for k in range(count)}

    @cached_property
    def _compiled(self) -> WalkKernel:
        def figure(measure: Measure, k: int) -> Callable[[Backward], Number]:
            return lambda back: measure.curve(back.walk if measure.of_motion else back)[k]

        figures = {name: figure(*part) for name, part in self._parts.items()}
        told = repr(list(self._parts.items()))
        return WalkKernel(self.numpy.run, figures, self.numpy.forces, self.numpy.method, described=told)

    def check(self, values: Mapping[str, Number]) -> None:
        """MechanismError for a mechanism that only NumPy takes."""
        self._compiled.check(values)

    def courses(self, values: Mapping[str, Number], time: Number) -> tuple[Courses, NDArray[np.int8]]:
        """As `NumpyKernel.courses`, of plain numbers."""
        curves, status = self._compiled.curves(values, np.asarray(time, float))
        found: Courses = {measure.name: () for measure in self.numpy.measures}
        for name, (measure, _) in self._parts.items():
            found[measure.name] += (where_known(known(measure, status), curves[name]),)
        return found, status


def engine_for(engine: str, numpy: NumpyKernel, values: Mapping[str, Number], configurations: int) -> str:
    """The engine by its name; of auto the compiled one where it pays and can take the mechanism."""
    if engine != "auto":
        return engine
    if configurations < WORTH_COMPILING or any(measure.in_time for measure in numpy.measures):
        return "numpy"
    try:
        CompiledCourses(numpy).check(values)
    except MechanismError:
        return "numpy"
    return "compiled"


def batch_of(engine: str, positions: int) -> int:
    """Samples that an engine takes best at a time: of NumPy in arrays that stay in cache."""
    return max(1, AT_ONCE[engine] // positions)


def kernel_of(engine: str, run: Run, measures: Sequence[Measure], friction: FrictionMethod) -> Kernel:
    """The kernel of an engine by its name. Raises MechanismError if there is none, or its package is missing."""
    numpy = MotionKernel(run, measures, friction)
    if engine == "numpy":
        return numpy
    timed = next((measure.name for measure in measures if measure.in_time), None)
    if timed is not None:
        what = f"the measure '{timed}' is of a motion in time"
        raise MechanismError(Finding(what, "engine", "use numpy, which has motions in time, or auto"))
    if engine in AT_ONCE:
        return CompiledCourses(numpy)
    raise MechanismError(Finding(f"there is no engine '{engine}'", "engine", f"use {' or '.join(AT_ONCE)}"))


def references(kernel: NumpyKernel, plan: PositionPlan, inputs: Inputs) -> dict[str, Reference]:
    """Every measure of the nominal mechanism, pins in the middle of their holes where no seat is given."""
    run = kernel.run
    values = inputs.nominal
    walk = forward(run.system, values, run.chosen.assembly, plan.times)
    courses, _ = kernel.courses(values, plan.times)
    system, found = run.system, {}
    for measure in kernel.measures:
        turns = measure.of_motion and measure.turning(system)
        rate = measure.coordinate(system).rate(walk) if turns else None
        one = reference(measure, courses[measure.name], plan.windows[measure.name], system, rate)
        found[measure.name] = sharpened(one, kernel, plan, values)
    return found
