"""The variables of a cycle, or of the cycles of many mechanisms, by the compiled engine.

What is written of one walk into the arrays of a result is recorded once and run everywhere.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Accuracy, Courses, Solve
from trunnion.algebra.namespace import Number
from trunnion.cycle.course import CycleCourse, followed, like, margin_rows, stacked
from trunnion.cycle.fill import COMPARED, CONDITIONS, Arrays, Causes, allocate, cells, fill_chunk, fill_errors
from trunnion.errors import Finding, MechanismError, Status
from trunnion.results.variables import OF_SOME_JOINTS, VARIABLES
from trunnion.solve.backward import Backward
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import CHUNK, Run
from trunnion.solve.switches import MARGINS, Mechanisms, accuracy_of, bends, breaks_between
from trunnion.solve.system import Values
from trunnion.solve.walk_kernel import Figure, Lanes, WalkKernel, lanes_of, literals, time_of

Cell = tuple[str, tuple[int, ...]]  # variable, and place in its array but for the position

Engine = Literal["auto", "numpy", "compiled"]
WORTH_COMPILING = 200_000  # positions; NumPy does as many in the time that compiling takes
MARGIN_WEIGHT = 50.0  # as many plain positions take NumPy as long as one whose locking margin is followed to its end
PROBED = 64  # positions at which it is seen whether margins are followed
# variables that may have no finite value in a solved position
UNDEFINED = ("efficiency_instant", "locking_margin", "contact_position")


class CycleKernel:
    """Every variable of a cycle at many positions.

    run: the prepared mechanism, with these values; time: one that will be asked for, s; arrays: those of a result, for
    what is read of them. Raises MechanismError as `WalkKernel` does.
    """

    def __init__(
        self, run: Run, values: Values, time: NDArray[np.float64], arrays: Arrays, method: FrictionMethod
    ) -> None:
        # not the arrays: the kernel and its figures hold each other, so whatever they hold is freed late
        self._read = set(arrays)
        self._last: tuple[Backward | None, Mapping[Cell, Number]] = None, {}
        with np.errstate(all="ignore"):
            numbers = self._cells(run.solve(np.zeros(1), values, FrictionMethod()))
        # what is 0 whatever the values are, as most arrays are before they are filled, is left out
        zero = [cell for cell, number in numbers.items() if isinstance(number, (int, float)) and number == 0]
        empty = {cell for cell in zero if VARIABLES[cell[0]].part not in OF_SOME_JOINTS}
        self._names = {f"{cell[0]}{list(cell[1])}": cell for cell in numbers if cell not in empty}
        self._kernel = WalkKernel(
            run,
            {name: self._figure(cell) for name, cell in self._names.items()},
            method=method,
            gravest=Status.SOLVED,
            undefined=[name for name, (variable, _) in self._names.items() if variable in UNDEFINED],
        )
        self._kernel.check(values, time)

    def fill(self, arrays: Arrays, values: Values, time: NDArray[np.float64], causes: Causes | None = None) -> None:
        """Fill arrays, (…, position) or (…, mechanism, position), at these times, s; by NumPy where that decides.

        causes: to note what the positions decided by NumPy have to say.
        """
        several = arrays["status"].ndim == 2
        shape = arrays["status"].shape if several else (1, *arrays["status"].shape)
        doubtful, curves = np.empty(shape, bool), {}
        for name, (variable, place) in self._names.items():
            flags = arrays[variable].dtype != float
            curves[name] = np.empty(shape) if flags else arrays[variable][place].reshape(shape)
        self._kernel.fill(values, time, Lanes(curves, arrays["status"].reshape(shape), doubtful))
        for name, (variable, place) in self._names.items():
            if arrays[variable].dtype != float:
                arrays[variable][place] = curves[name].reshape(arrays["status"].shape)
        rows, columns = np.nonzero(doubtful)
        for low in range(0, len(rows), CHUNK):
            row, column = rows[low : low + CHUNK], columns[low : low + CHUNK]
            times = time_of(time, row, column)
            back = self._kernel.back({path: lanes_of(value, row) for path, value in values.items()}, times)
            fill_chunk(arrays, back, (row, column) if several else (column,), causes)

    def _cells(self, back: Backward) -> Mapping[Cell, Number]:
        """The number of every cell that is read, of one walk; of the last one, for figures are asked one by one."""
        if self._last[0] is not back:
            numbers = {(name, place): number for name, place, number in cells(back, self._read) if name in self._read}
            self._last = back, numbers
        return self._last[1]

    def _figure(self, cell: Cell) -> Figure:
        return lambda back: self._cells(back)[cell]


def kernel_of(
    run: Run, engine: str, values: Values, time: NDArray[np.float64], arrays: Arrays, method: FrictionMethod
) -> CycleKernel | None:
    """The compiled kernel of what is read of some arrays, made once for numbers of one kind.

    None of the engine auto, MechanismError of the engine compiled, if there is none.
    """

    def made() -> CycleKernel | None:
        try:
            return CycleKernel(run, values, time, arrays, method)
        except MechanismError:
            if engine == "compiled":
                raise
            return None

    constants = frozenset(literals(values).items())  # what is 0 with these is left out
    return run.once(("compiled", engine, method, tuple(arrays), constants), made)


def compiles(engine: str, run: Run, positions: int, method: FrictionMethod | None = None) -> bool:
    """Whether the compiled engine is to be tried. MechanismError if it cannot.

    method: of friction, where a locking margin is asked for at each position.
    """
    if engine == "compiled" and run.seats:
        what = "pins in seats settle in rounds, at each position as many as it needs: that is not compiled"
        raise MechanismError(Finding(what, f"joints.{run.seats[0].joint}.seat", "use the engine numpy"))
    if engine != "auto":
        return engine == "compiled"
    if run.seats:
        return False
    if method is None or not method.margin_up_to or positions * MARGIN_WEIGHT < WORTH_COMPILING:
        return positions >= WORTH_COMPILING

    def share() -> float:
        """Of the positions those without a bound on their friction that would say at once that none locks."""
        with np.errstate(all="ignore"):
            back = run.solve(run.cycle.times(PROBED), method=replace(method, margin_up_to=0.0))
            problems = [settled.problem for settled in back.settled if settled.problem is not None]
            shares = [np.mean(np.asarray(problem.bound()) * method.margin_up_to >= 1.0) for problem in problems]
        return float(max(shares, default=0.0))

    weight = 1.0 + MARGIN_WEIGHT * run.once(("margins followed", method), share)
    return positions * weight >= WORTH_COMPILING


@dataclass
class Many:
    """Mechanisms with the structure and the assembly of a run.

    engine: see `compiles`; auto falls back on NumPy where a mechanism cannot be compiled. configurations:
    about how many there will be.
    """

    run: Run
    engine: str = "auto"
    configurations: int = 0

    def __post_init__(self) -> None:
        self.compiled = compiles(self.engine, self.run, self.configurations)

    def filled(
        self,
        values: Values,
        ideal: Values | None,
        time: NDArray[np.float64],
        shape: tuple[int, int],
        variables: Collection[str],
        method: FrictionMethod,
    ) -> tuple[Arrays, Arrays]:
        """Variables of `results` by name, (…, mechanism, position); the same of the mechanisms without errors.

        values: every number, (mechanism, 1) where they vary; ideal: without errors, if any has some; the first arrays
        then hold the differences too. time: (mechanism, position) or (position,), s; variables: the only ones that are
        filled.
        """
        if ideal is None:
            return self.arrays(values, time, shape, variables, method), {}
        variables, parts = {*variables, *COMPARED}, ["errors"]
        arrays_filled, meant = (
            self.arrays(numbers, time, shape, variables, method, parts) for numbers in (values, ideal)
        )
        fill_errors(arrays_filled, meant, self.run.system, slice(None))
        return arrays_filled, meant

    def arrays(
        self,
        values: Values,
        time: NDArray[np.float64],
        shape: tuple[int, int],
        variables: Collection[str],
        method: FrictionMethod,
        parts: Sequence[str] = (),
    ) -> Arrays:
        """Variables by name, and the condition of every module."""
        flat = allocate(self.run.system, shape[0] * shape[1], parts, {*variables, "status"})
        arrays = {name: array.reshape(*array.shape[:-1], *shape) for name, array in flat.items()}
        arrays[CONDITIONS] = np.zeros((len(self.run.system.plan.modules), *shape))
        kernel = kernel_of(self.run, self.engine, values, time, arrays, method) if self.compiled else None
        if kernel is None:
            self.compiled = False
            fill_chunk(arrays, self.run.solve(time, values, method), slice(None))
            return arrays
        kernel.fill(arrays, values, time)
        return arrays

    def courses(self, of: Mechanisms, ideal: Values | None, method: FrictionMethod) -> list[CycleCourse]:
        """The courses of some mechanisms over their cycles. ideal: their numbers without errors, if any has some."""
        names = followed(self.run.system, ideal is not None)
        shapes: dict[str, tuple[int, ...]] = {}
        without = None if ideal is None else replace(of, values=ideal)

        def look(mechanism: NDArray[np.intp], time: NDArray[np.float64]) -> tuple[Any, Any]:
            shape = (1, time.size) if len(of.cycles) == 1 else time.shape
            ideal_values = None if without is None else without.picked(mechanism)
            solved = self.filled(of.picked(mechanism), ideal_values, of.lanes(time), shape, names, method)[0]
            arrays = {name: array.reshape(*array.shape[:-2], *time.shape) for name, array in solved.items()}
            again, rows = stacked(arrays, names, 2)
            shapes.update(again)
            return rows, arrays["status"]

        solved = self._resolved(look, of, without, Accuracy(), lambda sizes: like(self.run, shapes, sizes))
        return [CycleCourse(self.run, shapes, item) for item in solved]

    def margins(self, of: Mechanisms, method: FrictionMethod) -> list[CycleCourse]:
        """The courses of the locking margins of some mechanisms; see `margin_of`."""

        def look(mechanism: NDArray[np.intp], time: NDArray[np.float64]) -> tuple[Any, Any]:
            shape = (1, time.size) if len(of.cycles) == 1 else time.shape
            arrays = self.arrays(of.picked(mechanism), of.lanes(time), shape, ("locking_margin",), method)
            margin, status = (arrays[name].reshape(time.shape) for name in ("locking_margin", "status"))
            return margin_rows(margin, status.astype(np.intp))

        solved = self._resolved(look, of, None, MARGINS)
        return [CycleCourse(self.run, {"locking_margin": ()}, item) for item in solved]

    def _resolved(
        self,
        look: Solve,
        of: Mechanisms,
        without: Mechanisms | None,
        accuracy: Accuracy,
        sizes: Callable[[NDArray[np.float64]], NDArray[np.float64]] | None = None,
    ) -> list[Courses]:
        """Courses of some mechanisms between the places where they, or the same without errors, switch."""
        every = [bends(item) for item in (of, without) if item is not None]
        breaks = [
            breaks_between(cycle, np.array([bend.time for row in bends_each for bend in row]))
            for cycle, *bends_each in zip(of.cycles, *every, strict=True)
        ]
        with np.errstate(all="ignore"):
            return Courses.many(look, breaks, sizes, accuracy_of(self.run.cycle, accuracy))
