"""From a graph to a program of LLVM: loops over samples and positions around vectors of lanes.

kernel(s0, s1, p0, p1, P, given, by_sample, by_position, by_both, outputs, table) fills outputs[k][s, p] for the samples
s0 to s1 and the positions p0 to p1 of P. What is made of given numbers alone is computed once a call, what differs by
sample alone once a sample, both as plain numbers; what differs by position alone once a call, into a table of the
caller. The last vector of a row is moved back to end with
it: so a row holds at least as many positions as a vector.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

from llvmlite import ir

from trunnion.engines.graph import BOTH, POSITION, SAMPLE, Graph
from trunnion.engines.lanes import BYTE, DOUBLE, LONG, Lanes

KINDS = (0, SAMPLE, POSITION, BOTH)  # what numbers differ by
COMPARED = {"lt": "<", "le": "<=", "gt": ">", "ge": ">=", "eq": "==", "ne": "!="}
Value = Any  # of llvmlite, which has no types


@dataclass(frozen=True)
class Program:
    """What tells a program from others; names of the inputs, given and by sample, position and both; rows of the table
    it needs; width: positions at a time, and so the fewest in a row; write: what makes the text of its module."""

    key: str
    inputs: tuple[tuple[str, ...], ...]
    rows: int
    width: int
    write: Callable[[], str]


def program(graph: Graph, outputs: Sequence[int], width: int) -> Program:
    """A program that computes some nodes. Numbers become floats of 64 bits, what is true or false and "byte" bytes."""
    writer = _Writer(graph, outputs, width)
    key = repr((graph.nodes, graph.loops, graph.inputs, list(outputs), width))
    return Program(key, writer.names, len(writer.tabled), width, writer.write)


def row_program() -> Program:
    """A program that runs kernels on their own inputs by sample and position, one after the other.

    kernel(first, last, P, …, kernels, inputs, outputs, …) runs those from the first to before the last on P positions.
    """
    module, nothing = ir.Module(name="trunnion"), ir.VoidType()
    pointers = DOUBLE.as_pointer().as_pointer()
    kernel = ir.FunctionType(nothing, [*[LONG] * 5, *[pointers] * 5, DOUBLE.as_pointer()]).as_pointer()
    arrays = [kernel.as_pointer(), *[pointers.as_pointer()] * 2, *[pointers] * 3]
    function = ir.Function(module, ir.FunctionType(nothing, [*[LONG] * 5, *arrays]), name="kernel")
    first, last, positions, *_ = function.args
    builder, zero = ir.IRBuilder(function.append_basic_block("entry")), ir.Constant(LONG, 0)

    def run(k: Value) -> None:
        entry, given, made = (builder.load(builder.gep(array, [k])) for array in function.args[5:8])
        none = ir.Constant(pointers, None)
        whole = (zero, ir.Constant(LONG, 1), zero, positions, positions)
        builder.call(entry, [*whole, none, none, none, given, made, ir.Constant(DOUBLE.as_pointer(), None)])

    _counted(builder, first, last, 1, run)
    builder.ret_void()
    return Program(str(module), ((), (), (), ()), 0, 1, module.__str__)


def _counted(builder: Any, low: Value, high: Value, step: int, body: Callable[[Value], None]) -> None:
    """for i in range(low, high, step): body(i)."""
    before = builder.block
    head, inside, after = (builder.append_basic_block() for _ in range(3))
    builder.branch(head)
    builder.position_at_end(head)
    i = builder.phi(LONG)
    i.add_incoming(low, before)
    builder.cbranch(builder.icmp_signed("<", i, high), inside, after)
    builder.position_at_end(inside)
    body(i)
    i.add_incoming(builder.add(i, ir.Constant(LONG, step)), builder.block)
    builder.branch(head)
    builder.position_at_end(after)


@dataclass
class _Writer:
    """One module as it is written."""

    graph: Graph
    outputs: Sequence[int]
    width: int
    module: Any = field(default_factory=lambda: ir.Module(name="trunnion"))

    def __post_init__(self) -> None:
        graph, live = self.graph, self.graph.live(self.outputs)
        inputs = [graph.nodes[n].extra for n in live if graph.nodes[n].op == "input"]
        self.names = tuple(tuple(name for name in inputs if graph.inputs[name] == kind) for kind in KINDS)
        level = {n: graph.differs[n] for n in live}
        if not any(differs & SAMPLE for differs in level.values()):  # one sample: no table is needed for it
            level = {n: BOTH if differs == POSITION else differs for n, differs in level.items()}
        self.nodes = [[n for n in live if level[n] == kind] for kind in KINDS]
        # what differs by position alone and is read where samples are gone through
        *_, ahead, each = self.nodes
        read = {arg for n in each for arg in graph.nodes[n].args} | set(self.outputs)
        self.tabled = sorted(read & {n for n in ahead if graph.nodes[n].op not in ("input", "loop")})

    def write(self) -> str:
        double = DOUBLE.as_pointer()
        kinds = [*[LONG] * 5, *[double.as_pointer()] * 5, double]
        function = ir.Function(self.module, ir.FunctionType(ir.VoidType(), kinds), name="kernel")
        self.arguments = function.args
        self.b = ir.IRBuilder(function.append_basic_block("entry"))
        tables: dict[tuple[float, ...], Value] = {}
        self.lanes, self.scalar = Lanes(self.b, self.width, tables), Lanes(self.b, 1, tables)
        self.pointers = [
            {name: self._pointer(argument, k) for k, name in enumerate(array_names)}
            for argument, array_names in zip(self.arguments[5:9], self.names, strict=True)
        ]
        self.out = [self._pointer(self.arguments[9], k) for k in range(len(self.outputs))]
        stated_nodes, once, ahead, each = self.nodes
        plain: dict[int, Value] = self._loaded(0, ir.Constant(LONG, 0))
        self._emit(stated_nodes, plain, self.scalar)
        wide = self._spread(plain, [*ahead, *each])
        if self.tabled:
            self._fill_table(ahead, wide)
        self._samples(once, each, plain, wide)
        self.b.ret_void()
        return str(self.module)

    def _spread(self, plain: dict[int, Value], readers: Iterable[int]) -> dict[int, Value]:
        """Plain numbers in all lanes, those that some nodes read or that are outputs."""
        read = {arg for n in readers for arg in self.graph.nodes[n].args} | set(self.outputs)
        return {n: self.lanes.splat(plain[n]) for n in sorted(read & plain.keys())}

    def _pointer(self, array: Value, k: int) -> Value:
        return self.b.load(self.b.gep(array, [ir.Constant(LONG, k)]))

    # ---- loops ----------------------------------------------------------------------------------------------------

    def _positions(self, body: Callable[[Value], None]) -> None:
        """Vectors of positions, the last one moved back to end with the row."""
        low, high = self.arguments[2:4]
        last = self.b.sub(high, ir.Constant(LONG, self.width))

        def moved(i: Value) -> None:
            body(self.b.select(self.b.icmp_signed(">", i, last), last, i))

        _counted(self.b, low, high, self.width, moved)

    def _tabled_place(self, k: int, p: Value) -> Value:
        """Where the k-th number of the table is at a position."""
        low, high = self.arguments[2:4]
        return self.b.add(self.b.mul(self.b.sub(high, low), ir.Constant(LONG, k)), self.b.sub(p, low))

    def _fill_table(self, ahead: Sequence[int], wide: dict[int, Value]) -> None:
        def body(p: Value) -> None:
            values = {**wide, **self._loaded(POSITION, p)}
            self._emit(ahead, values, self.lanes)
            for k, n in enumerate(self.tabled):
                bit = values[n].type == self.lanes.bit
                number = self.b.uitofp(values[n], self.lanes.double) if bit else values[n]
                self._store(self.arguments[10], self._tabled_place(k, p), number)

        self._positions(body)

    def _samples(
        self, once: Sequence[int], each: Sequence[int], constants: dict[int, Value], all_samples: dict[int, Value]
    ) -> None:
        first, last, _, _, stride = self.arguments[:5]

        def sample(s: Value) -> None:
            plain = {**constants, **self._loaded(SAMPLE, s)}
            self._emit(once, plain, self.scalar)
            local = {n: value for n, value in plain.items() if n not in constants}
            wide = {**all_samples, **self._spread(local, each)}
            start = self.b.mul(s, stride)

            def position(p: Value) -> None:
                place = self.b.add(start, p)
                values = {**wide, **self._loaded(POSITION, p), **self._loaded(BOTH, place)}
                for k, n in enumerate(self.tabled):
                    entry = self._load(self.arguments[10], self._tabled_place(k, p))
                    bit = self.graph.booleans[n]
                    values[n] = self.lanes.compare("!=", entry, self.lanes.constant(0.0)) if bit else entry
                self._emit(each, values, self.lanes)
                for k, n in enumerate(self.outputs):
                    number = self._of(n, values, self.lanes)
                    if number.type == self.lanes.double:
                        self._store(self.out[k], place, number)
                        continue
                    byte = self.b.zext(number, self.lanes.byte) if number.type == self.lanes.bit else number
                    at = self.b.gep(self.b.bitcast(self.out[k], BYTE.as_pointer()), [place])
                    self.b.store(byte, self.b.bitcast(at, byte.type.as_pointer()), align=1)

            self._positions(position)

        _counted(self.b, first, last, 1, sample)

    # ---- memory ------------------------------------------------------------------------------------------------------

    def _loaded(self, differs: int, place: Value) -> dict[int, Value]:
        """The inputs of a kind at a place."""
        pointers = self.pointers[KINDS.index(differs)]
        loaded = {}
        for name, pointer in pointers.items():
            number = self.graph.input(name, self.graph.inputs[name])
            plain = differs in (0, SAMPLE)
            loaded[number] = self.b.load(self.b.gep(pointer, [place])) if plain else self._load(pointer, place)
        return loaded

    def _load(self, pointer: Value, place: Value) -> Value:
        at = self.b.bitcast(self.b.gep(pointer, [place]), self.lanes.double.as_pointer())
        return self.b.load(at, align=8)

    def _store(self, pointer: Value, place: Value, value: Value) -> None:
        self.b.store(value, self.b.bitcast(self.b.gep(pointer, [place]), value.type.as_pointer()), align=8)

    # ---- nodes -------------------------------------------------------------------------------------------------------

    def _of(self, n: int, values: dict[int, Value], lanes: Lanes) -> Value:
        constant = self.graph.values[n]
        return values[n] if constant is None else lanes.constant(constant)

    def _emit(self, numbers: Iterable[int], values: dict[int, Value], lanes: Lanes) -> None:
        """Instructions for nodes, in their order; what is known already is not computed again."""
        angles: dict[int, tuple[Value, Value]] = {}
        for n in numbers:
            op, args, extra = self.graph.nodes[n]
            if n in values or self.graph.values[n] is not None:
                continue
            if op == "loop":
                values[n] = self._loop(args, extra, values, lanes)
            elif op == "result":
                values[n] = values[args[0]][extra]
            elif op in ("sin", "cos"):
                if args[0] not in angles:
                    angles[args[0]] = lanes.sincos(self._of(args[0], values, lanes))
                values[n] = angles[args[0]][op == "cos"]
            else:
                values[n] = self._operation(n, [self._of(arg, values, lanes) for arg in args], lanes)

    def _operation(self, n: int, a: list[Value], lanes: Lanes) -> Value:
        op, _, extra = self.graph.nodes[n]
        if op in COMPARED:
            if a[0].type == lanes.bit:
                return self.b.icmp_signed(COMPARED[op], *a)
            return lanes.compare(COMPARED[op], *a)
        match op:
            case "and" | "or":
                return getattr(self.b, f"{op}_")(*a)
            case "xor":
                return self.b.xor(*a)
            case "not":
                return self.b.xor(a[0], lanes.constant(True))
            case "where":
                return lanes.select(*a)
            case "max":
                return lanes.larger(a[0], a[1])
            case "min":
                return lanes.larger(a[0], a[1], "<")
            case "byte":
                return self.b.fptosi(a[0], lanes.byte)
            case "take":
                return lanes.take(extra, a[0])
            case "search":
                entries, side = extra
                return lanes.search(entries, side, a[0])
        return getattr(lanes, op)(*a)

    def _loop(self, args: tuple[int, ...], index: int, values: dict[int, Value], lanes: Lanes) -> list[Value]:
        """A loop of the graph: what it comes to after its rounds, or those after which all lanes are done."""
        loop, int_ = self.graph.loops[index], ir.IntType(32)
        start = [self._of(n, values, lanes) for n in args[: len(loop.states)]]
        before = self.b.block
        body, after = self.b.append_basic_block(), self.b.append_basic_block()
        self.b.branch(body)
        self.b.position_at_end(body)
        count = self.b.phi(int_)
        count.add_incoming(ir.Constant(int_, 0), before)
        states = [self.b.phi(lanes.double) for _ in start]
        inner = dict(values) | dict(zip(loop.states, states, strict=True))
        self._emit(self.graph.inside(loop.outputs, index), inner, lanes)
        results = [self._of(n, inner, lanes) for n in loop.results]
        for state, first, next_ in zip(states, start, results, strict=True):
            state.add_incoming(first, before)
            state.add_incoming(next_, self.b.block)
        further = self.b.add(count, ir.Constant(int_, 1))
        count.add_incoming(further, self.b.block)
        more = self.b.icmp_signed("<", further, ir.Constant(int_, loop.rounds))
        if loop.done is None:
            left = lanes.differ(states, results)
        else:
            left = lanes.any(self.b.xor(self._of(loop.done, inner, lanes), lanes.constant(True)))
        self.b.cbranch(self.b.and_(more, left), body, after)
        self.b.position_at_end(after)
        return results
