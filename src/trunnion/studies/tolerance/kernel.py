"""One batch of mechanisms: the curve of every measure over the positions, and a status for each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual
from trunnion.algebra.namespace import Number
from trunnion.cycle.cycle_kernel import Engine
from trunnion.dynamics.measured import MotionKernel
from trunnion.errors import Finding, MechanismError
from trunnion.measures.evaluation import Curves, Kernel, NumpyKernel, where_known
from trunnion.measures.many import Many
from trunnion.measures.measures import Measure
from trunnion.solve.backward import Backward
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run
from trunnion.solve.walk_kernel import WalkKernel
from trunnion.statistics.streams import uniforms
from trunnion.studies.tolerance.inputs import Inputs

__all__ = ["batch_of", "engine_for", "kernel_of", "many_of"]

AT_ONCE = {"numpy": 10_000, "compiled": 1 << 20}  # numbers in an array, by engine
PILOTS = 24  # samples that tell how finely the courses of all have to be resolved
WORTH_COMPILING = 500_000  # configurations; NumPy does as many in the time that compiling takes at most


@dataclass(frozen=True)
class CompiledCourses:
    """The same, compiled; what that cannot decide NumPy computes again. numpy: the kernel it stands for."""

    numpy: NumpyKernel

    @property
    def at_once(self) -> int:
        """Places that it takes best at a time."""
        return AT_ONCE["compiled"]

    @cached_property
    def _parts(self) -> dict[str, tuple[Measure, int]]:
        """Measure and number of each part of each course, by a name."""
        kernel = self.numpy
        back = kernel.solved(kernel.run.values, np.zeros(1))
        counts = [len(measure.numbers(back)) for measure in kernel.measures]
        pairs = zip(kernel.measures, counts, strict=True)
        return {f"{measure.name} {k}": (measure, k) for measure, count in pairs for k in range(count)}

    @cached_property
    def _compiled(self) -> WalkKernel:
        def figure(measure: Measure, k: int) -> Callable[[Backward], Number]:
            return lambda back: measure.numbers(back.walk if measure.of_motion else back)[k]

        figures = {name: figure(*part) for name, part in self._parts.items()}
        description = repr(list(self._parts.items()))
        return WalkKernel(self.numpy.run, figures, self.numpy.forces, self.numpy.method, described=description)

    def check(self, values: Mapping[str, Number]) -> None:
        """MechanismError for a mechanism that only NumPy takes."""
        self._compiled.check(values)

    def courses(self, values: Mapping[str, Number], time: Number) -> tuple[Curves, NDArray[np.int8]]:
        """As `NumpyKernel.courses`; that takes dual numbers."""
        if any(isinstance(number, Dual) for number in (time, *values.values())):
            return self.numpy.courses(values, time)
        place = np.asarray(time, float)
        curves, status = self._compiled.curves(values, place)
        numbers: Curves = {measure.name: () for measure in self.numpy.measures}
        for name, (measure, _) in self._parts.items():
            numbers[measure.name] += (curves[name],)
        return {
            measure.name: tuple(
                where_known(measure, status, part)
                for part in measure.joined(numbers[measure.name], self.numpy.run, values, place)
            )
            for measure in self.numpy.measures
        }, status


def engine_for(engine: Engine, numpy: NumpyKernel, values: Mapping[str, Number], configurations: int) -> Engine:
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
    """The kernel of an engine by its name. Raises MechanismError if it cannot."""
    numpy = MotionKernel(run, measures, friction)
    if engine == "numpy":
        return numpy
    timed = next((measure.name for measure in measures if measure.in_time), None)
    if timed is not None:
        what = f"the measure '{timed}' is of a motion in time"
        raise MechanismError(Finding(what, "engine", "use numpy, which has motions in time, or auto"))
    return CompiledCourses(numpy)


def many_of(run: Run, measures: Sequence[Measure], inputs: Inputs, friction: FrictionMethod, engine: str) -> Many:
    """The measures of the nominal mechanism, pins in the middle of their holes where no seat is given."""

    def kernels(part: Sequence[Measure]) -> Kernel:
        return kernel_of(engine, run, part, friction)

    many = Many(run, measures, inputs.nominal, kernels)
    many.tune(inputs.values(uniforms(0, 0, inputs.dims, PILOTS)))
    return many
