"""A long row of computations as machine code in parts: parts that are alike share their code.

What is recorded of a row of modules is too long to be compiled as one function. It is cut where a module ends
(`Graph.cut`); a part takes numbers of the parts before it from a table, and leaves there what later ones take.
"""

from __future__ import annotations

import sys
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from functools import cache
from threading import Lock
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.engines.graph import BOTH, Graph, Loop
from trunnion.engines.machine_code import MachineCode, vector_width
from trunnion.engines.program import program, row_program

Array = NDArray[np.float64]
MOST_KINDS = 512  # of parts whose code is kept at hand

MOST_KEPT = 2**24  # numbers of a table whose memory is used again
ALONE = 2  # references of what nothing else refers to: its name, and that of `getrefcount`

_kept: list[Array] = []
_codes: dict[tuple[Any, ...], MachineCode] = {}
_compiling = Lock()


class _Part(NamedTuple):
    """A part of a graph that stands alone: its inputs and outputs are nodes of the whole."""

    graph: Graph
    inputs: list[int]
    outputs: list[int]
    made: list[int]  # the outputs as nodes of its own

    def code(self) -> MachineCode:
        """Its machine code, compiled for the first part of its kind."""
        loops = [(loop.rounds, loop.states, loop.results, loop.done) for loop in self.graph.loops]
        kind = (tuple(self.graph.nodes), tuple(loops), tuple(self.made))
        with _compiling:
            if kind not in _codes:
                if len(_codes) >= MOST_KINDS:
                    _codes.clear()
                _codes[kind] = MachineCode(program(self.graph, self.made, vector_width()))
            return _codes[kind]


class Parts:
    """Machine code of a graph that is cut into parts.

    Parameters
    ----------
    graph
        Recorded with inputs that differ by position.
    outputs
        Nodes that are wanted.

    inputs: names of those that it needs, in the order of their rows; rows: of the table, by node.
    """

    def __init__(self, graph: Graph, outputs: Sequence[int]) -> None:
        self.rows: dict[int, int] = {}
        self.inputs = list(graph.inputs)
        for name in self.inputs:
            self.rows[graph.input(name, BOTH)] = len(self.rows)
        calls, lines = [], list[NDArray[np.intp]]()
        self.ends: list[int] = []  # of the rows, after each part
        for part in _parts(graph, outputs):
            for output in part.outputs:
                self.rows[output] = len(self.rows)
            if part.outputs:
                code = part.code()
                given = [self.rows[part.inputs[int(name)]] for name in code.inputs[-1]]
                calls.append((code, len(given)))
                lines.append(np.array([*given, *(self.rows[output] for output in part.outputs)], np.intp))
                self.ends.append(len(self.rows))
        self._codes = [code for code, _ in calls]  # as long as their functions are called
        self._functions = np.array([code.address for code in self._codes], np.uintp)
        starts = np.cumsum([0, *(len(line) for line in lines)])[: len(lines)]
        self._starts = np.array([starts, starts + [count for _, count in calls]], np.uintp)  # of inputs and outputs
        self._places = np.concatenate(lines) if lines else np.zeros(0, np.intp)

    def run(self, given: Sequence[float | Array], positions: int, last: int | None = None) -> Array:
        """The table, (row, position), of numbers that are given, in the order of `inputs`; its rows fill a vector.

        last: the row with which the computation may end.
        """
        lanes = max(positions, vector_width())
        table = _memory(len(self.rows) * lanes).reshape(len(self.rows), lanes)
        alike = [number if isinstance(number, (float, int)) else number[0] for number in given]
        table[: len(given)] = np.array(alike)[:, None]
        for row, number in zip(table, given, strict=False):
            if not isinstance(number, (float, int)):
                row[:positions] = number
        calls = len(self.ends) if last is None else min(bisect_right(self.ends, last) + 1, len(self.ends))
        addresses = (self._places * table.strides[0] + table.ctypes.data).astype(np.uintp)
        inputs, outputs = self._starts * np.uintp(8) + np.uintp(addresses.ctypes.data)
        pointers = (array.ctypes.data for array in (self._functions, inputs, outputs))
        _row().function(0, calls, lanes, 0, 0, *pointers, None, None, None)
        return table


def _memory(count: int) -> Array:
    """Memory of so many numbers: that of a table which nothing uses any more, for new pages take as long as to compute.

    What is a view of a table refers to its memory, so it is free once the list alone does.
    """
    if count > MOST_KEPT:
        return np.empty(count)
    kept = _kept.pop() if _kept else np.empty(0)
    if kept.size < count or sys.getrefcount(kept) > ALONE:
        kept = np.empty(count)
    _kept.append(kept)
    return kept[:count]


@cache
def _row() -> MachineCode:
    """What runs many parts, one after the other."""
    return MachineCode(row_program())


def _parts(graph: Graph, outputs: Sequence[int]) -> Iterator[_Part]:
    """The parts of a graph between its cuts, in order; of each what later parts or the outputs need of it."""
    numbers = _with_loops(graph, outputs)
    of_part: dict[int, list[int]] = {}
    needed = set(outputs)
    part_of = np.searchsorted(graph.cuts, np.arange(len(graph.nodes)), side="right").tolist()
    for number in numbers:
        part = part_of[number]
        of_part.setdefault(part, []).append(number)
        needed.update(arg for arg in graph.nodes[number].args if part_of[arg] < part)
    for part in sorted(of_part):
        call = next((number for number in of_part[part] if graph.nodes[number].op == "call"), None)
        if call is None:
            yield _copied(graph, of_part[part], needed)
            continue
        inner, results = graph.nodes[call].extra
        outputs = [number for number in of_part[part] if number != call and number in needed]
        yield _Part(inner, list(graph.nodes[call].args), outputs, [results[graph.nodes[n].extra] for n in outputs])


def _with_loops(graph: Graph, outputs: Sequence[int]) -> list[int]:
    """The nodes that the outputs are made of, with those within loops, in order."""
    numbers, left = set[int](), list(outputs)
    while left:
        number = left.pop()
        if number in numbers:
            continue
        numbers.add(number)
        node = graph.nodes[number]
        left += node.args
        if node.op == "loop":
            left += [*graph.loops[node.extra].states, *graph.loops[node.extra].outputs]
    return sorted(numbers)


def _copied(graph: Graph, numbers: Sequence[int], needed: set[int]) -> _Part:
    """Some nodes as a graph of their own."""
    copy, inputs, copies = Graph(), list[int](), dict[int, int]()
    loops = dict[int, int]()  # by their numbers in the whole

    def copied(number: int) -> int:
        if number not in copies:
            constant = graph.values[number]
            if constant is not None:
                copies[number] = copy.constant(constant)
            else:  # of an earlier part
                inputs.append(number)
                copies[number] = copy.input(str(len(inputs) - 1), BOTH)
                if graph.booleans[number]:
                    copies[number] = copy.as_boolean(copies[number])
        return copies[number]

    def loop_of(number: int) -> int:
        if number not in loops:
            loops[number] = len(copy.loops)
            copy.loops.append(Loop(0, (), ()))
        return loops[number]

    for number in numbers:
        op, args, extra = graph.nodes[number]
        if op == "input" or graph.values[number] is not None:
            continue
        if op == "state":
            index = loop_of(extra[0])
            copies[number] = copy.node(op, (), (index, extra[1]), BOTH, 1 << index)
        else:
            extra = loop_of(extra) if op == "loop" else extra
            copies[number] = copy.node(op, tuple(map(copied, args)), extra, BOTH)
    for number, index in loops.items():
        loop = graph.loops[number]
        states, results = (tuple(map(copied, row)) for row in (loop.states, loop.results))
        copy.loops[index] = Loop(loop.rounds, states, results, None if loop.done is None else copied(loop.done))
    made = [number for number in numbers if graph.nodes[number].op != "input" and number in copies]
    outputs = [number for number in made if number in needed]
    return _Part(copy, inputs, outputs, [copy.as_float(copies[number]) for number in outputs])
