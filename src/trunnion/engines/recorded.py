"""Numbers that write down what is done with them: a kernel run once on them becomes a graph.

They stand in the place of NumPy arrays (`algebra.namespace.Traced`). Lanes that a kernel would treat apart are left as
they are; who compiles must find them and compute them again with NumPy.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Sequence
from itertools import count
from typing import Any

import numpy as np

from trunnion.algebra.namespace import Done, Step, Traced, UntraceableError
from trunnion.engines.graph import BOTH, Graph

STRUCTURAL = (0.0, 1.0, -1.0)  # numbers by which kernels save work: they are compiled in
MOST_RECURRING = 64  # functions of numbers whose records are kept at hand
_recurring: dict[Hashable, tuple[Graph, list[int]]] = {}
OF_ALL_LANES: dict[Any, bool] = {np.any: True, np.all: False}  # the answers that no lane contradicts


def number_of(graph: Graph, number: Any) -> int:
    """The node of a number: a recorded one's own, of a float a constant."""
    if isinstance(number, Recorded):
        return number.node
    if isinstance(number, np.ndarray):
        if number.ndim:
            raise UntraceableError(f"an array of shape {number.shape}")
        number = number[()]
    return graph.constant(number)


def _operator(op: str, turned: bool = False) -> Callable[[Recorded, Any], Any]:
    def found(self: Recorded, other: Any) -> Any:
        if hasattr(other, "dual"):  # a dual number knows how to take this one as a part
            return NotImplemented
        pair = self.node, number_of(self.graph, other)
        return Recorded(self.graph, self.graph.apply(op, *(pair[::-1] if turned else pair)))

    return found


class Recorded(Traced):
    """A node of a graph that behaves as a NumPy array does in a kernel."""

    __slots__ = ("graph", "node")
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, graph: Graph, node: int) -> None:
        self.graph = graph
        self.node = node

    def __repr__(self) -> str:
        return f"Recorded({self.graph.nodes[self.node]})"

    @property
    def shape(self) -> tuple[int, ...]:
        return ()

    @property
    def ndim(self) -> int:
        return 0

    @property
    def dtype(self) -> Any:
        return np.dtype(bool if self.graph.booleans[self.node] else float)

    def astype(self, kind: Any) -> Recorded:
        if np.dtype(kind) == bool:
            return Recorded(self.graph, self.graph.as_boolean(self.node))
        return Recorded(self.graph, self.graph.as_float(self.node))

    @classmethod
    def looped(cls, step: Step, start: Sequence[Any], rounds: int, done: Done | None) -> list[Any]:
        graph = _graph_of(start)

        def recorded(numbers: Sequence[int]) -> list[Any]:
            return [Recorded(graph, number) for number in numbers]

        def further(numbers: list[int]) -> list[int]:
            return [number_of(graph, number) for number in step(recorded(numbers))]

        def stays(numbers: list[int]) -> int:
            assert done is not None
            return graph.as_boolean(number_of(graph, done(recorded(numbers))))

        first = [number_of(graph, number) for number in start]
        return recorded(graph.loop(further, first, rounds, stays if done is not None else None))

    def cut(self) -> None:
        self.graph.cut()

    @classmethod
    def recurring(cls, function: Step, numbers: Sequence[Any], about: Callable[[], Hashable]) -> list[Any] | None:
        graph = _graph_of(numbers)
        if not graph.in_parts:
            return None
        nodes = [graph.as_float(number_of(graph, number)) for number in numbers]
        constants = tuple(graph.values[node] for node in nodes)
        key = about(), constants
        if key not in _recurring:
            if len(_recurring) >= MOST_RECURRING:
                _recurring.clear()
            inner, places = Graph(), count()
            given = [Recorded(inner, inner.input(str(next(places)), BOTH)) if n is None else n for n in constants]
            made = function(list(given))
            _recurring[key] = inner, [number_of(inner, number) for number in made]
        inner, results = _recurring[key]
        graph.cut()
        varying = tuple(node for node, constant in zip(nodes, constants, strict=True) if constant is None)
        call = graph.node("call", varying, (inner, tuple(inner.as_float(result) for result in results)))
        fixed = [inner.values[result] for result in results]
        rows = [Recorded(graph, graph.node("result", (call,), k)) if n is None else n for k, n in enumerate(fixed)]
        graph.cut()
        return [row != 0.0 if inner.booleans[result] and n is None else row
                for row, result, n in zip(rows, results, fixed, strict=True)]  # fmt: skip

    def all(self, axis: Any = None) -> Any:
        return np.all(self, axis=axis)

    def __getitem__(self, index: Any) -> Recorded:
        if index in ((), ...):
            return self
        raise UntraceableError("a part of an array")

    # ---- what needs a value -------------------------------------------------------------------------------------

    def _refuse(self, *_: Any, **__: Any) -> Any:
        raise UntraceableError("a number that is being compiled has no value yet")

    __bool__ = __float__ = __int__ = __index__ = __len__ = __iter__ = __array__ = _refuse

    # ---- NumPy's functions --------------------------------------------------------------------------------------

    def __array_namespace__(self, api_version: str | None = None) -> Any:
        """The functions that go with this number, as the array standard names the hook."""
        return functions

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        if any(hasattr(number, "dual") for number in inputs):
            return NotImplemented
        if method != "__call__" or options:
            raise UntraceableError(f"np.{ufunc.__name__} with {method} {', '.join(options)} is not compiled")
        return getattr(functions, ufunc.__name__)(*inputs)

    def __array_function__(self, function: Any, types: Any, args: Sequence[Any], options: dict[str, Any]) -> Any:
        if function in OF_ALL_LANES and not any(value is not None for value in (*args[1:], *options.values())):
            return OF_ALL_LANES[function]
        return getattr(functions, function.__name__)(*args, **options)

    # ---- operators ----------------------------------------------------------------------------------------------

    __add__ = _operator("add")
    __radd__ = _operator("add", turned=True)
    __sub__ = _operator("sub")
    __rsub__ = _operator("sub", turned=True)
    __mul__ = _operator("mul")
    __rmul__ = _operator("mul", turned=True)
    __truediv__ = _operator("div")
    __rtruediv__ = _operator("div", turned=True)
    __and__ = __rand__ = _operator("and")
    __or__ = __ror__ = _operator("or")
    __xor__ = __rxor__ = _operator("xor")
    __lt__ = _operator("lt")
    __le__ = _operator("le")
    __gt__ = _operator("gt")
    __ge__ = _operator("ge")
    __eq__ = _operator("eq")
    __ne__ = _operator("ne")

    def __mod__(self, other: Any) -> Any:
        return functions.remainder(self, other)

    def __pow__(self, power: Any) -> Any:
        return functions.power(self, power)

    def __rpow__(self, base: Any) -> Any:
        raise UntraceableError("a number to a power that varies")

    def __neg__(self) -> Recorded:
        return Recorded(self.graph, self.graph.apply("neg", self.node))

    def __pos__(self) -> Recorded:
        return self

    def __abs__(self) -> Recorded:
        return Recorded(self.graph, self.graph.apply("abs", self.node))

    def __invert__(self) -> Recorded:
        return Recorded(self.graph, self.graph.apply("not", self.node))


def _graph_of(numbers: Sequence[Any]) -> Graph:
    for number in numbers:
        if isinstance(number, Recorded):
            return number.graph
    raise UntraceableError("no number that is recorded")


# ---- NumPy's functions ----------------------------------------------------------------------------------------


def _direct(op: str) -> Callable[..., Any]:
    """A function of NumPy that is an operation of the graph."""

    def function(*numbers: Any) -> Any:
        graph = _graph_of(numbers)
        return Recorded(graph, graph.apply(op, *(number_of(graph, number) for number in numbers)))

    return function


def _where(condition: Any, a: Any, b: Any) -> Any:
    graph = _graph_of((condition, a, b))
    return Recorded(graph, graph.where(*(number_of(graph, number) for number in (condition, a, b))))


def _power(x: Any, power: Any) -> Any:
    if isinstance(power, Recorded) or power not in (0.5, 1, 2, 3, 4, 5, 6, -1, -2):
        raise UntraceableError(f"the power {power}")
    if power == 0.5:
        return functions.sqrt(x)
    product = x
    for _ in range(abs(int(power)) - 1):
        product = product * x
    return product if power > 0 else 1.0 / product


def _searchsorted(table: Any, x: Any, side: str = "left") -> Any:
    graph = x.graph
    entries = tuple(float(value) for value in np.ravel(table))
    return Recorded(graph, graph.node("search", (graph.as_float(x.node),), (entries, side)))


def _take(row: Any, index: Any, **_: Any) -> Any:
    if any(isinstance(item, Recorded) for item in np.ravel(np.asarray(row, object))):
        raise UntraceableError("an entry of a table whose numbers vary")
    graph = index.graph
    entries = tuple(float(value) for value in np.ravel(row))
    return Recorded(graph, graph.node("take", (graph.as_float(index.node),), entries))


def _same(x: Any, *_: Any, **__: Any) -> Any:
    return x


NAMES: dict[str, Callable[..., Any]] = {
    **{name: _direct(op) for name, op in {
        "sqrt": "sqrt", "sin": "sin", "cos": "cos", "exp": "exp", "tanh": "tanh", "sign": "sign", "floor": "floor",
        "rint": "rint", "abs": "abs", "absolute": "abs", "fabs": "abs", "negative": "neg", "isfinite": "finite",
        "logical_not": "not", "invert": "not", "bitwise_not": "not", "add": "add", "subtract": "sub",
        "multiply": "mul", "divide": "div", "true_divide": "div", "maximum": "max", "minimum": "min",
        "arctan2": "atan2", "less": "lt", "less_equal": "le", "greater": "gt", "greater_equal": "ge",
        "equal": "eq", "not_equal": "ne", "logical_and": "and", "logical_or": "or", "logical_xor": "xor",
        "bitwise_and": "and", "bitwise_or": "or",
    }.items()},
    "where": _where, "power": _power, "searchsorted": _searchsorted, "take": _take,
    "fmax": lambda a, b: _where(functions.isnan(a), b, _where(functions.isnan(b), a, functions.maximum(a, b))),
    "fmin": lambda a, b: _where(functions.isnan(a), b, _where(functions.isnan(b), a, functions.minimum(a, b))),
    "square": lambda x: x * x,
    "reciprocal": lambda x: 1.0 / x,
    "hypot": lambda a, b: functions.sqrt(a * a + b * b),
    "isnan": lambda x: x != x,
    "degrees": lambda x: x * (180 / math.pi),
    "radians": lambda x: x * (math.pi / 180),
    "tan": lambda x: functions.sin(x) / functions.cos(x),
    "arcsin": lambda x: functions.arctan2(x, functions.sqrt((1 - x) * (1 + x))),
    "arccos": lambda x: functions.arctan2(functions.sqrt((1 - x) * (1 + x)), x),
    "arctan": lambda x: functions.arctan2(x, 1.0),
    "remainder": lambda x, m: x - functions.floor(x / m) * m,
    "mod": lambda x, m: x - functions.floor(x / m) * m,
    "clip": lambda x, low, high: functions.minimum(functions.maximum(x, low), high),
    "shape": lambda x: (), "ndim": lambda x: 0, "copy": _same, "ravel": _same, "asarray": _same, "array": _same,
    "broadcast_to": _same, "float64": _same, "real": _same, "positive": _same,
}  # fmt: skip


class _Functions:
    """NumPy's functions on recorded numbers, by their names; of plain numbers alone they are NumPy's own."""

    def __getattr__(self, name: str) -> Any:
        override = NAMES.get(name)
        numpy = getattr(np, name, None)

        def function(*args: Any, **options: Any) -> Any:
            if not any(isinstance(item, Recorded) for item in (*args, *options.values())):
                return numpy(*args, **options)  # type: ignore[misc]
            if override is None:
                raise UntraceableError(f"np.{name}")
            return override(*args, **options)

        if override is None and not callable(numpy):
            return numpy  # np.pi and the like
        setattr(self, name, function)
        return function


functions: Any = _Functions()
