"""A function of numbers over many lanes as machine code: recorded once, run for samples and positions.

The function is run once on numbers that record what is done with them (`recorded`), and the record is compiled. A lane
that cannot be decided without values is in doubt: its function is computed again with NumPy, so that the answer is
NumPy's everywhere.
"""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import pairwise
from threading import Lock, Thread
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number
from trunnion.engines.graph import BOTH, POSITION, SAMPLE, Graph
from trunnion.engines.recorded import Recorded, number_of

if TYPE_CHECKING:
    from trunnion.engines.machine_code import MachineCode

__all__ = ["STRUCTURAL", "TIME", "Array", "Kernel", "Lanes", "lanes_of", "literals", "time_of"]

Array = NDArray[np.float64]
Values = Mapping[str, Any]
ALONE = 1 << 15  # lanes that one thread does in about the time that starting another takes
AT_ONCE = 8192  # doubtful lanes that NumPy computes at a time: its arrays stay in cache
STRUCTURAL = (0.0, 1.0, -1.0)  # numbers by which kernels save work: they are compiled in
TIME = "time"


class Lanes(NamedTuple):
    """Of every lane: figures by name, status, and whether NumPy has to decide it."""

    curves: dict[str, Any]
    status: Any
    doubtful: Any

    @property
    def arrays(self) -> list[NDArray[Any]]:
        return [*self.curves.values(), self.status, self.doubtful]


class Kernel(ABC):
    """Figures and a status of numbers and a time, over samples and positions.

    names: of the figures; threads: at a time, by default one for each core; undefined: figures that may have no finite
    value; key: tells the function from all others, so that machine code that was kept is found without recording
    anything, None if nothing does. A subclass has the function. `again` counts the lanes that NumPy computed again.
    """

    def __init__(
        self,
        names: Sequence[str],
        threads: int | None = None,
        undefined: Collection[str] = (),
        key: str | None = None,
    ) -> None:
        self.names, self.undefined, self.key = list(names), undefined, key
        self.threads = threads or os.cpu_count() or 1
        self.again = 0
        self._programs: dict[tuple[Any, ...], MachineCode] = {}
        self._graphs: dict[tuple[Any, ...], tuple[Graph, list[int]]] = {}
        self._recording = Lock()

    @abstractmethod
    def walked(self, values: Values, time: Number) -> Lanes:
        """Figures, status and doubt of numbers of whatever kind."""

    @abstractmethod
    def decided(self, values: Values, time: Array) -> tuple[Mapping[str, Any], NDArray[np.int8]]:
        """Figures by name and status of some lanes by NumPy: numbers and times of one after the other."""

    # ---- all lanes --------------------------------------------------------------------------------------------------

    def curves(self, values: Values, time: Array) -> tuple[dict[str, Array], NDArray[np.int8]]:
        """Figures by name, and the status, both (sample, position).

        values: every number by path; floats are the same in all samples, arrays are (sample, 1).
        time: (position,) s, or (sample, position).
        """
        counts = [len(value) for value in (*values.values(), np.atleast_2d(time)) if np.ndim(value)]
        into = _empty(self.names, (max(counts), time.shape[-1]))
        self.fill(values, time, into)
        self.decide(values, time, into)
        return into.curves, into.status

    def fill(self, values: Values, time: Array, into: Lanes) -> None:
        """Compute all lanes, (sample, position), into arrays: a part of the samples or positions in each thread.

        time: (position,) or (sample, position), s.
        """
        from trunnion.engines.machine_code import vector_width

        samples, positions = into.status.shape
        if positions >= vector_width():
            self._run(values, time, into)
            return
        # rows too short for a vector: all lanes as one row, which ends with itself again where it is too short too
        row = np.resize(np.arange(samples * positions), max(samples * positions, vector_width()))
        lanes = {path: lanes_of(value, row // positions, row % positions) for path, value in values.items()}
        lanes = {path: value[None, :] if np.ndim(value) else value for path, value in lanes.items()}
        times = np.ascontiguousarray(np.broadcast_to(time, (samples, positions)).ravel()[row])
        flat = _empty(self.names, (1, len(row)))
        self._run(lanes, times, flat)
        for array, filled in zip(into.arrays, flat.arrays, strict=True):
            array[:] = filled[0, : samples * positions].reshape(samples, positions)

    def decide(self, values: Values, time: Array, into: Lanes) -> None:
        """Compute the doubtful lanes with NumPy, some at a time."""
        if not into.doubtful.any():  # as a rule; to list them takes longer
            return
        rows, columns = np.nonzero(into.doubtful)
        self.again += len(rows)
        for low in range(0, len(rows), AT_ONCE):
            row, column = rows[low : low + AT_ONCE], columns[low : low + AT_ONCE]
            part = {path: lanes_of(value, row, column) for path, value in values.items()}
            curves, into.status[row, column] = self.decided(part, time_of(time, row, column))
            for name, curve in curves.items():
                into.curves[name][row, column] = curve

    def _run(self, values: Values, time: Array, into: Lanes) -> None:
        inputs = _inputs_of(values, time)
        code, arrays = self._code(inputs), into.arrays
        first, *others = [code.bound(inputs.numbers, arrays, *part) for part in _parts(into.status.shape, self.threads)]
        threads = [Thread(target=call) for call in others]
        for thread in threads:
            thread.start()
        first()
        for thread in threads:
            thread.join()

    # ---- machine code -----------------------------------------------------------------------------------------------

    def check(self, values: Values, time: Array | None = None) -> None:
        """Record the function, if its code is not kept; raises what the function does where it cannot be recorded.

        time: one that it will be asked for, s, by whose shape code that is kept is found.
        """
        inputs = _inputs_of(values, np.zeros(1) if time is None else time)
        if self._kept(inputs) is None:
            self._graphs[inputs.structure] = self._recorded(inputs)

    def _code(self, inputs: _Inputs) -> MachineCode:
        """The machine code for numbers of this structure."""
        from trunnion.engines.machine_code import MachineCode, vector_width
        from trunnion.engines.program import program

        with self._recording:
            code = self._kept(inputs)
            if code is None:
                if inputs.structure not in self._graphs:
                    self._graphs[inputs.structure] = self._recorded(inputs)
                graph, outputs = self._graphs.pop(inputs.structure)
                code = self._programs[inputs.structure] = MachineCode(program(graph, outputs, vector_width()))
                if self.key is not None:
                    code.keep_as(self._key(inputs))
            return code

    def _kept(self, inputs: _Inputs) -> MachineCode | None:
        """The machine code if it needs no recording."""
        from trunnion.engines.machine_code import MachineCode

        if inputs.structure not in self._programs and self.key is not None:
            code = MachineCode.known(self._key(inputs))
            if code is not None:
                self._programs[inputs.structure] = code
        return self._programs.get(inputs.structure)

    def _key(self, inputs: _Inputs) -> str:
        return f"{self.key}\0{inputs.structure!r}"

    def _recorded(self, inputs: _Inputs) -> tuple[Graph, list[int]]:
        """Run the function once on numbers that write down what is done with them: figures, status, doubt."""
        graph = Graph()
        numbers = {path: Recorded(graph, graph.input(path, differs)) for path, differs in inputs.differs.items()}
        lanes = self.walked({**inputs.literal, **numbers}, numbers.pop(TIME))
        curves = [graph.as_float(number_of(graph, curve)) for curve in lanes.curves.values()]
        doubtful = graph.as_boolean(number_of(graph, lanes.doubtful))
        for doubt in graph.doubts:
            doubtful = graph.apply("or", doubtful, doubt)
        zero = nothing = graph.constant(0.0)
        for name, curve in zip(lanes.curves, curves, strict=True):
            if name not in self.undefined:  # 0 times what is not finite is NaN
                nothing = graph.apply("add", nothing, graph.apply("mul", curve, zero))
        doubtful = graph.apply("or", doubtful, graph.apply("not", graph.apply("eq", nothing, zero)))
        status = graph.node("byte", (graph.as_float(number_of(graph, lanes.status)),))
        return graph, [*curves, status, doubtful]


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
        elif np.ndim(value) == 2 and np.shape(value)[1] > 1:
            numbers[path], differs[path] = np.ascontiguousarray(value, float).ravel(), POSITION
        else:
            numbers[path], differs[path] = np.ascontiguousarray(value, float).ravel(), SAMPLE
    alike = time.ndim == 1 or len(time) == 1
    numbers[TIME] = np.ascontiguousarray(time, float) if not alike else np.ascontiguousarray(time, float).ravel()
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


def _empty(names: Sequence[str], shape: tuple[int, ...]) -> Lanes:
    return Lanes({name: np.empty(shape) for name in names}, np.empty(shape, np.int8), np.empty(shape, bool))


def _parts(shape: tuple[int, int], threads: int) -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
    """Samples and positions of the parts of a job, one for each thread that pays, as even as may be."""
    samples, positions = shape
    divided = samples if samples > 1 else positions
    count = max(1, min(threads, samples * positions // ALONE, divided))
    edges = np.linspace(0, divided, count + 1).astype(int).tolist()
    for part in pairwise(edges):
        yield (part, (0, positions)) if samples > 1 else ((0, 1), part)
