"""Figures of the walk forward and back over many lanes as machine code: recorded once, run for samples and positions.

The walk is run once on numbers that record what is done with them (`engines.recorded`), and the record is compiled. A
lane that is not plainly solved, or without proof that its friction has one solution, is in doubt: NumPy computes it
again, so that the answer is NumPy's everywhere.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from itertools import pairwise
from threading import Lock, Thread
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number, UntraceableError
from trunnion.engines.graph import BOTH, POSITION, SAMPLE, Graph
from trunnion.engines.recorded import STRUCTURAL, Recorded, number_of
from trunnion.errors import Finding, MechanismError, Status
from trunnion.solve.backward import NEAR_SINGULAR, Backward, pose_status, pose_status_number, status_number, status_of
from trunnion.solve.forward import forward
from trunnion.solve.friction import STUBBORN
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.margin import locking_margin
from trunnion.solve.run import Run
from trunnion.solve.system import Values, law_of, rubbing

if TYPE_CHECKING:
    from trunnion.engines.machine_code import MachineCode

Array = NDArray[np.float64]
Figure = Callable[[Backward], Number]  # one number of every position, of the motion (`back.walk`) or of the forces
BORDER = 0.99 * NEAR_SINGULAR  # condition from which NumPy decides what a position is
ALONE = 1 << 15  # lanes that one thread does in about the time that starting another takes
AT_ONCE = 8192  # doubtful lanes that NumPy computes at a time: its arrays stay in cache
TIME = "time"


class Lanes(NamedTuple):
    """Of every lane, (sample, position): figures by name, status, and whether NumPy has to decide it."""

    curves: dict[str, Array]
    status: NDArray[Any]
    doubtful: NDArray[np.bool_]

    @classmethod
    def empty(cls, names: Sequence[str], shape: tuple[int, ...]) -> Lanes:
        """Arrays to be filled."""
        return cls({name: np.empty(shape) for name in names}, np.empty(shape, np.int8), np.empty(shape, bool))

    @property
    def arrays(self) -> list[NDArray[Any]]:
        """All of them, in order."""
        return [*self.curves.values(), self.status, self.doubtful]


class WalkKernel:
    """Figures of a mechanism over samples and positions. `again` counts the lanes that NumPy computed again.

    run: the prepared mechanism; figures: by name, what to read off each walk; forces: whether one of them needs more
    than the motion; threads: at a time, by default one for each core; gravest: status from which on NumPy computes a
    lane again; undefined: figures that may have no finite value. Raises MechanismError if the mechanism has what only
    NumPy does.
    """

    def __init__(
        self,
        run: Run,
        figures: Mapping[str, Figure],
        forces: bool = True,
        method: FrictionMethod | None = None,
        threads: int | None = None,
        gravest: Status = Status.ZERO_SLIP,
        undefined: Collection[str] = (),
    ) -> None:
        self.run, self.figures, self.forces = run, dict(figures), forces
        self.method, self.gravest, self.undefined = method or FrictionMethod(), gravest, undefined
        self.threads = threads or os.cpu_count() or 1
        self.again = 0
        if reason := _by_numpy_alone(run, self.method):
            raise _refusal(reason)
        self._programs: dict[tuple[Any, ...], MachineCode] = {}
        self._graphs: dict[tuple[Any, ...], tuple[Graph, list[int]]] = {}
        self._recording = Lock()

    def back(self, values: Values, time: Number) -> Backward:
        """One walk, back again only where forces are asked for."""
        run = self.run
        try:
            if self.forces:
                return run.solve(time, values, self.method)
            return Backward(forward(run.system, values, run.chosen.assembly, time), {})
        except UntraceableError as error:
            raise _refusal(str(error)) from error

    def curves(self, values: Values, time: Array) -> tuple[dict[str, Array], NDArray[np.int8]]:
        """Figures by name, and the status, both (sample, position).

        values: every number by path; floats are the same in all samples, arrays are (sample, 1).
        time: (position,) s, or (sample, position).
        """
        counts = [len(value) for value in (*values.values(), np.atleast_2d(time)) if np.ndim(value)]
        into = Lanes.empty(list(self.figures), (max(counts), time.shape[-1]))
        self.fill(values, time, into)
        self.decide(values, time, into)
        return into.curves, into.status

    def fill(self, values: Values, time: Array, into: Lanes) -> None:
        """Compute all lanes, (sample, position), into arrays: a part of the samples or positions in each thread.

        time: (position,) or (sample, position), s.
        """
        from trunnion.engines.machine_code import vector_width

        samples, positions = into.status.shape
        if positions < vector_width():  # all lanes as one row, which ends with itself again where it is too short too
            row = np.resize(np.arange(samples * positions), max(samples * positions, vector_width()))
            lanes = {path: lanes_of(value, row // positions, row % positions) for path, value in values.items()}
            lanes = {path: value[None, :] if np.ndim(value) else value for path, value in lanes.items()}
            flat = Lanes.empty(list(self.figures), (1, len(row)))
            self.fill(lanes, np.ascontiguousarray(np.broadcast_to(time, (samples, positions)).ravel()[row]), flat)
            for array, filled in zip(into.arrays, flat.arrays, strict=True):
                array[:] = filled[0, : samples * positions].reshape(samples, positions)
            return
        inputs = _inputs_of(values, time)
        code, arrays = self._code(inputs), into.arrays
        first, *others = [code.bound(inputs.numbers, arrays, *part) for part in _parts(into.status.shape, self.threads)]
        threads = [Thread(target=call) for call in others]
        for thread in threads:
            thread.start()
        first()
        for thread in threads:
            thread.join()

    def decide(self, values: Values, time: Array, into: Lanes) -> None:
        """Compute the doubtful lanes with NumPy, some at a time."""
        if not into.doubtful.any():  # as a rule; to list them takes longer
            return
        rows, columns = np.nonzero(into.doubtful)
        self.again += len(rows)
        for low in range(0, len(rows), AT_ONCE):
            row, column = rows[low : low + AT_ONCE], columns[low : low + AT_ONCE]
            part = {path: lanes_of(value, row, column) for path, value in values.items()}
            with np.errstate(all="ignore"):
                back = self.back(part, time_of(time, row, column))
                status = status_of(back, row.shape) if self.forces else pose_status(back.walk, row.shape)
                for name, figure in self.figures.items():
                    into.curves[name][row, column] = figure(back)
            into.status[row, column] = status

    # ---- machine code -----------------------------------------------------------------------------------------------

    def check(self, values: Values, time: Array | None = None) -> None:
        """Record the walk for a time, s, of the shape that will be asked for; MechanismError where that cannot be."""
        inputs = _inputs_of(values, np.zeros(1) if time is None else time)
        if inputs.structure not in self._programs:
            self._graphs[inputs.structure] = self._recorded(inputs)

    def _code(self, inputs: _Inputs) -> MachineCode:
        """The machine code for numbers of this structure."""
        from trunnion.engines.machine_code import MachineCode, vector_width
        from trunnion.engines.program import program

        with self._recording:
            if inputs.structure not in self._programs:
                recorded = inputs.structure in self._graphs
                graph, outputs = self._graphs.pop(inputs.structure) if recorded else self._recorded(inputs)
                self._programs[inputs.structure] = MachineCode(program(graph, outputs, vector_width()))
            return self._programs[inputs.structure]

    @np.errstate(all="ignore")
    def _recorded(self, inputs: _Inputs) -> tuple[Graph, list[int]]:
        """Walk once on numbers that write down what is done with them: figures, status, doubt."""
        graph = Graph()
        numbers = {path: Recorded(graph, graph.input(path, differs)) for path, differs in inputs.differs.items()}
        back = self.back({**inputs.literal, **numbers}, numbers.pop(TIME))
        status = status_number(back) if self.forces else pose_status_number(back.walk)
        doubtful = (status > self.gravest) | (back.walk.condition > BORDER) | np.isnan(locking_margin(back))
        for settled in back.settled:
            doubtful = doubtful | np.logical_not(settled.certain)
        doubt = graph.as_boolean(number_of(graph, doubtful))
        for more in graph.doubts:
            doubt = graph.apply("or", doubt, more)
        curves, zero = list[int](), graph.constant(0.0)
        nothing = zero
        for name, figure in self.figures.items():
            curves.append(graph.as_float(number_of(graph, figure(back))))
            if name not in self.undefined:  # 0 times what is not finite is NaN
                nothing = graph.apply("add", nothing, graph.apply("mul", curves[-1], zero))
        doubt = graph.apply("or", doubt, graph.apply("not", graph.apply("eq", nothing, zero)))
        return graph, [*curves, graph.node("byte", (graph.as_float(number_of(graph, status)),)), doubt]


def _refusal(reason: str) -> MechanismError:
    return MechanismError(Finding(f"this is not compiled: {reason}", "engine", "use the engine numpy"))


def _by_numpy_alone(run: Run, method: FrictionMethod) -> str:
    """What of a mechanism, or of what is asked of it, only NumPy does; empty if nothing."""
    if method.name != "newton" or method.criterion is not None or method.limit < STUBBORN:
        return "friction by successive approximation, or with a criterion or limit of its own"
    if run.system.inverse:
        return f"the driver {next(iter(run.system.inverse.moves))} moves another joint by its law"
    for module in run.system.plan.modules:
        if module.redundant:
            return f"the links {', '.join(module.links)} are over-constrained, which is solved by least squares"
    for joint in rubbing(run.system):
        if law_of(run.system, joint).relaxation is not None:
            return f"the friction of {joint} has a memory along the cycle"
    return ""


# ---- numbers of lanes -----------------------------------------------------------------------------------------------


class _Inputs(NamedTuple):
    """What a program is given: the numbers by path, those that stand for themselves, and what each differs by."""

    numbers: dict[str, Array]
    literal: dict[str, Any]
    differs: dict[str, int]

    @property
    def structure(self) -> tuple[Any, ...]:
        """What a program is compiled for."""
        return tuple(self.literal.items()), tuple(self.differs.items())


def _inputs_of(values: Values, time: Array) -> _Inputs:
    literal = literals(values)
    numbers: dict[str, Array] = {}
    differs: dict[str, int] = {}
    for path, value in values.items():
        if path in literal:
            continue
        if _single(value) or np.size(value) == 1:
            numbers[path], differs[path] = np.array(value, float).reshape(1), 0
        else:
            numbers[path] = np.ascontiguousarray(value, float).ravel()
            differs[path] = POSITION if np.ndim(value) == 2 and np.shape(value)[1] > 1 else SAMPLE
    alike = time.ndim == 1 or len(time) == 1
    numbers[TIME] = np.ascontiguousarray(time, float).ravel() if alike else np.ascontiguousarray(time, float)
    differs[TIME] = POSITION if alike else BOTH
    return _Inputs(numbers, literal, differs)


def literals(values: Values) -> dict[str, Any]:
    """What is compiled in, by path: texts, and numbers by which kernels save work."""
    return {
        path: value
        for path, value in values.items()
        if isinstance(value, str) or (_single(value) and float(value) in STRUCTURAL)
    }


def _single(value: Any) -> bool:
    return isinstance(value, float) or not np.ndim(value)  # asked of each number in each call: floats first


def lanes_of(value: Number, rows: NDArray[np.intp], columns: NDArray[np.intp] | None = None) -> Number:
    """The number in some lanes, one after the other: (sample, 1) or, with columns, (1, position)."""
    if not np.ndim(value):
        return value
    flat = np.ravel(value)
    if columns is not None and len(flat) > 1 and np.shape(value)[0] == 1 < np.ndim(value):
        return flat[columns]
    return flat[rows] if len(flat) > 1 else float(flat[0])


def time_of(time: Array, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Array:
    """The time of some lanes, one after the other: (position,) or (sample, position)."""
    return time[columns] if time.ndim == 1 else time[rows, columns]


def _parts(shape: tuple[int, ...], threads: int) -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
    """Samples and positions of the parts of a job, one for each thread that pays, as even as may be."""
    samples, positions = shape
    divided = samples if samples > 1 else positions
    count = max(1, min(threads, samples * positions // ALONE, divided))
    edges = np.linspace(0, divided, count + 1).astype(int).tolist()
    for part in pairwise(edges):
        yield (part, (0, positions)) if samples > 1 else ((0, 1), part)
