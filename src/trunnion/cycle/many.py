"""The variables of many mechanisms that differ in numbers alone, by NumPy or by the compiled engine."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Accuracy, Courses
from trunnion.cycle.compiled import CycleKernel, compiles
from trunnion.cycle.course import COMPARED_ROWS, FOLLOWED, CycleCourse, like, stacked
from trunnion.cycle.deviations import COMPARED, fill_errors
from trunnion.cycle.positions import IDEAL
from trunnion.cycle.unanswered import blank
from trunnion.cycle.variables import fill_of
from trunnion.cycle.written import CONDITIONS, Arrays, fill_chunk, fill_lanes, link_numbers, write
from trunnion.errors import Finding, MechanismError
from trunnion.results import variables as results
from trunnion.solve.compiled import lanes_of
from trunnion.solve.compiled_vectors import literals
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.memory import CHUNK
from trunnion.solve.run import Run
from trunnion.solve.switches import Mechanisms, accuracy_of, bends, breaks_between
from trunnion.solve.system import System, Values

__all__ = ["Many"]


@dataclass
class Many:
    """Mechanisms with the structure and the assembly of a run.

    engine: see `compiled.compiles`; auto falls back on NumPy where a mechanism cannot be compiled. configurations:
    about how many there will be.
    """

    run: Run
    engine: str = "auto"
    configurations: int = 0
    _kernels: dict[object, CycleKernel] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.engine == "compiled" and self.run.seats:
            what = "pins in seats follow the load: of many mechanisms that is not compiled"
            raise MechanismError(Finding(what, f"joints.{self.run.seats[0].joint}.seat", "use the engine numpy"))
        self.compiled = compiles(self.engine, self.run, self.configurations)

    def filled(
        self,
        values: Values,
        ideal: Values | None,
        time: NDArray[np.float64],
        shape: tuple[int, int],
        wanted: Collection[str],
        method: FrictionMethod,
        quick: FrictionMethod,
    ) -> tuple[Arrays, Arrays]:
        """Variables of `results` by name, (…, mechanism, position); the same of the mechanisms without errors.

        values: every number, (mechanism, 1) where they vary; ideal: without errors, if any has some; the first arrays
        then hold the differences too. time: (mechanism, position) or (position,), s; wanted: what will be read, of the
        rest there is nothing. method, quick: for the mechanisms and for those without errors.
        """
        if ideal is None:
            return self.arrays(values, time, shape, wanted, method), {}
        wanted, parts, system = {*wanted, *IDEAL, *COMPARED}, ["errors"], self.run.system
        own = self.arrays(values, time, shape, wanted, method, parts)
        meant = self.arrays(ideal, time, shape, wanted, quick, parts)
        fill_errors(own, meant, link_numbers(system), slice(None))
        blank(own, own["status"].astype(np.int8), slice(None))
        return own, meant

    def arrays(
        self,
        values: Values,
        time: NDArray[np.float64],
        shape: tuple[int, int],
        wanted: Collection[str],
        method: FrictionMethod,
        parts: Sequence[str] = (),
    ) -> Arrays:
        """Variables by name, and the condition of every module."""
        arrays = _allocated(self.run.system, shape, {*wanted, "status"}, parts)
        known = frozenset(literals(values).items())  # what is 0 with these is left out
        kernel = self._kernel(arrays, values, time, method, (frozenset(wanted), tuple(parts), method, known))
        if kernel is None:
            fill_chunk(arrays, self.run.solve(time, values, method), time, slice(None))
            return arrays
        rows, columns = kernel.fill(arrays, values, time)
        for low in range(0, len(rows), CHUNK):
            row, column = rows[low : low + CHUNK], columns[low : low + CHUNK]
            times = time[column] if time.ndim == 1 else time[row, column]
            some = {path: lanes_of(value, row) for path, value in values.items()}
            fill_lanes(arrays, self.run.solve(times, some, method), times, (row, column))
        return arrays

    def courses(self, of: Mechanisms, ideal: Values | None, method: FrictionMethod) -> list[CycleCourse]:
        """The courses of some mechanisms over their cycles. ideal: their numbers without errors, if any has some."""
        names = [*FOLLOWED, *(COMPARED_ROWS if ideal is not None else ())]
        shapes: dict[str, tuple[int, ...]] = {}
        without = None if ideal is None else replace(of, values=ideal)

        def look(mechanism: NDArray[np.intp], time: NDArray[np.float64]) -> tuple[Any, Any]:
            shape = (1, time.size) if len(of.cycles) == 1 else time.shape
            meant = None if without is None else without.picked(mechanism)
            found = self.filled(of.picked(mechanism), meant, of.lanes(time), shape, names, method, method)[0]
            arrays = {name: array.reshape(*array.shape[:-2], *time.shape) for name, array in found.items()}
            again, rows = stacked(arrays, names, 2)
            shapes.update(again)
            return rows, arrays["status"]

        every = [bends(one) for one in (of, without) if one is not None]
        breaks = [breaks_between(cycle, np.concatenate(own)) for cycle, *own in zip(of.cycles, *every, strict=True)]
        accuracy = accuracy_of(self.run.cycle, Accuracy())
        with np.errstate(all="ignore"):
            found = Courses.many(look, breaks, lambda sizes: like(self.run, shapes, sizes), accuracy)
        return [CycleCourse(self.run, shapes, one) for one in found]

    def _kernel(
        self, arrays: Arrays, values: Values, time: NDArray[np.float64], method: FrictionMethod, key: object
    ) -> CycleKernel | None:
        if not self.compiled:
            return None
        if key not in self._kernels:
            try:
                self._kernels[key] = CycleKernel(self.run, values, time, arrays, write, method)
            except MechanismError:
                if self.engine == "compiled":
                    raise
                self.compiled = False
                return None
        return self._kernels[key]


def _allocated(system: System, shape: tuple[int, int], wanted: Collection[str], parts: Sequence[str]) -> Arrays:
    """Arrays to be filled, (…, mechanism, position)."""
    labels, absent = fill_of(system).labels(system), fill_of(system).absent(system)
    flat = results.allocate(labels, shape[0] * shape[1], absent, parts, wanted)
    found = {name: array.reshape(*array.shape[:-1], *shape) for name, array in flat.items()}
    return found | {CONDITIONS: np.zeros((len(system.plan.modules), *shape))}
