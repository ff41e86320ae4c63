"""The kernel of many samples or positions as machine code for vectors of lanes, by LLVM."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from threading import Lock, Thread
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.solve.compiled import Array, CompiledKernel, Lanes, lanes_of
from trunnion.solve.system import Values, law_of, rubbing

if TYPE_CHECKING:
    from trunnion.engines.graph import Graph
    from trunnion.engines.machine_code import MachineCode

__all__ = ["VectorKernel", "arrays_of", "inputs_of", "literals"]

ALONE = 1 << 15  # lanes that one thread does in about the time that starting another takes
STRUCTURAL = (0.0, 1.0, -1.0)  # numbers by which kernels save work: they are compiled in
TIME = "time"


class _Inputs(NamedTuple):
    """What a kernel is given: the numbers by path, those that stand for themselves, and what each differs by."""

    numbers: dict[str, Array]
    literal: dict[str, Any]
    differs: dict[str, int]

    @property
    def structure(self) -> tuple[Any, ...]:
        """What a program is compiled for."""
        return tuple(self.literal.items()), tuple(self.differs.items())


class VectorKernel(CompiledKernel):
    """Recorded once and compiled by LLVM for vectors of lanes: one program for all values of the same numbers."""

    def __init__(self, *asked: Any, **more: Any) -> None:
        super().__init__(*asked, **more)
        self._programs: dict[tuple[Any, ...], MachineCode] = {}
        self._recording = Lock()
        self._graphs: dict[tuple[Any, ...], tuple[Graph, list[int]]] = {}

    def check(self, values: Values, time: Array | None = None) -> None:
        """See `CompiledKernel.check`."""
        inputs = inputs_of(values, np.zeros(1) if time is None else time)
        if self._known(inputs) is None:
            self._graphs[inputs.structure] = self._recorded(inputs)

    def fill(self, values: Values, time: Array, found: Lanes) -> None:
        """All lanes, a part of the samples or positions in each thread."""
        from trunnion.engines.machine_code import vector_width

        samples, positions = found.status.shape
        if positions >= vector_width():
            self._filled(values, time, found)
            return
        # rows too short for a vector: all lanes as one row, which ends with itself again where it is too short too
        row = np.resize(np.arange(samples * positions), max(samples * positions, vector_width()))
        lanes = {path: lanes_of(value, row // positions, row % positions) for path, value in values.items()}
        lanes = {path: value[None, :] if np.ndim(value) else value for path, value in lanes.items()}
        times = np.ascontiguousarray(np.broadcast_to(time, (samples, positions)).ravel()[row])
        flat = _empty(list(found.curves), (1, len(row)))
        self._filled(lanes, times, flat)
        for into, came in zip(arrays_of(found), arrays_of(flat), strict=True):
            into[:] = came[0, : samples * positions].reshape(samples, positions)

    def _filled(self, values: Values, time: Array, found: Lanes) -> None:
        inputs = inputs_of(values, time)
        program, arrays = self.program(inputs), arrays_of(found)
        parts = _parts(found.status.shape, self.threads)
        first, *others = [program.bound(inputs.numbers, arrays, *part) for part in parts]
        threads = [Thread(target=part) for part in others]
        for thread in threads:
            thread.start()
        first()
        for thread in threads:
            thread.join()

    def program(self, inputs: _Inputs) -> MachineCode:
        """The machine code for numbers of this structure."""
        with self._recording:
            return self._program(inputs)

    def _program(self, inputs: _Inputs) -> MachineCode:
        code = self._known(inputs)
        if code is None:
            graph = self._graphs.pop(inputs.structure, None) or self._recorded(inputs)
            code = self._programs[inputs.structure] = self._made(*graph)
            if key := self._key(inputs):
                code.keep_as(key)
        return code

    def _made(self, graph: Graph, outputs: list[int]) -> MachineCode:
        from trunnion.engines.machine_code import MachineCode, vector_width
        from trunnion.engines.program import program

        return MachineCode(program(graph, outputs, vector_width()))

    def _known(self, inputs: _Inputs) -> MachineCode | None:
        """The machine code if it needs no recording: that of this model and these figures was kept."""
        from trunnion.engines.machine_code import MachineCode

        key = None if inputs.structure in self._programs else self._key(inputs)
        if key and (kept := MachineCode.known(key)):
            self._programs[inputs.structure] = kept
        return self._programs.get(inputs.structure)

    def _key(self, inputs: _Inputs) -> str | None:
        """What decides the program: model, figures, and what they are computed from; None where that is not all."""
        run = self.run
        laws = (law_of(run.system, joint).function.__module__ for joint in rubbing(run.system))
        if self.described is None or not all(name.startswith("trunnion.") for name in laws):
            return None
        model = run.system.mechanism.model_dump_json()
        asked = self.described, self.forces, self.method, self.gravest, sorted(self.undefined)
        return "\0".join((model, *map(repr, (run.chosen.assembly, asked, inputs.structure))))

    def _recorded(self, inputs: _Inputs) -> tuple[Graph, list[int]]:
        """Run the walk once on numbers that write down what is done with them: figures, status, doubt."""
        from trunnion.engines.graph import Graph
        from trunnion.engines.recorded import Recorded, number_of

        graph = Graph()
        numbers = {path: Recorded(graph, graph.input(path, differs)) for path, differs in inputs.differs.items()}
        found = self.walked({**inputs.literal, **numbers}, numbers.pop(TIME))
        curves = [graph.as_float(number_of(graph, curve)) for curve in found.curves.values()]
        doubtful = graph.as_boolean(number_of(graph, found.doubtful))
        for doubt in graph.doubts:
            doubtful = graph.apply("or", doubtful, doubt)
        zero = nothing = graph.constant(0.0)
        for name, curve in zip(found.curves, curves, strict=True):
            if name not in self.undefined:  # 0 times what is not finite is NaN
                nothing = graph.apply("add", nothing, graph.apply("mul", curve, zero))
        doubtful = graph.apply("or", doubtful, graph.apply("not", graph.apply("eq", nothing, zero)))
        status = graph.node("byte", (graph.as_float(number_of(graph, found.status)),))
        return graph, [*curves, status, doubtful]


# ---- lanes in arrays ------------------------------------------------------------------------------------------


def _empty(names: list[str], shape: tuple[int, ...]) -> Lanes:
    return Lanes({name: np.empty(shape) for name in names}, np.empty(shape, np.int8), np.empty(shape, bool))


def arrays_of(found: Lanes) -> list[NDArray[Any]]:
    return [*found.curves.values(), found.status, found.doubtful]


def _single(value: Any) -> bool:
    return isinstance(value, float) or not np.ndim(value)  # asked of each number in each call: floats first


def literals(values: Values) -> dict[str, Any]:
    """What is compiled in, by path: texts, and numbers by which kernels save work."""
    return {
        path: value
        for path, value in values.items()
        if isinstance(value, str) or (_single(value) and float(value) in STRUCTURAL)
    }


def inputs_of(values: Values, time: Array) -> _Inputs:
    """What a program is given."""
    from trunnion.engines.graph import BOTH, POSITION, SAMPLE

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
    one = time.ndim == 1 or len(time) == 1
    numbers[TIME] = np.ascontiguousarray(time, float) if not one else np.ascontiguousarray(time, float).ravel()
    differs[TIME] = POSITION if one else BOTH
    return _Inputs(numbers, literal, differs)


def _parts(shape: tuple[int, ...], threads: int) -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
    """Samples and positions of the parts of a job, one for each thread that pays, as even as may be."""
    samples, positions = shape
    divided = samples if samples > 1 else positions
    count = max(1, min(threads, samples * positions // ALONE, divided))
    edges = np.linspace(0, divided, count + 1).astype(int).tolist()
    for part in pairwise(edges):
        yield (part, (0, positions)) if samples > 1 else ((0, 1), part)
