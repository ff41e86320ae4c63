"""What a kernel computes, as a graph: each operation once, constants folded.

A node is an operation on earlier nodes; two equal operations are one node. What a loop repeats are the nodes that
depend on its state; all others are outside of it, so nothing is computed twice there either.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

SINE_RANGE = 1e5  # rad, within which the sine of a compiled kernel is exact
EXP_RANGE = 700.0  # neither overflow nor loss of digits
RANGES = {"sin": SINE_RANGE, "cos": SINE_RANGE, "exp": EXP_RANGE}
SAMPLE, POSITION = 1, 2  # what a number differs by
BOTH = SAMPLE | POSITION
BOOLEAN = frozenset({"lt", "le", "gt", "ge", "eq", "ne", "and", "or", "xor", "not", "finite", "bool"})
COMMUTATIVE = frozenset({"add", "mul", "max", "min", "and", "or", "xor", "eq", "ne"})
OF_BOOLEANS = frozenset({"and", "or", "xor", "not"})


class Node(NamedTuple):
    """An operation on nodes by number; what belongs to it beside them: a constant, a name, a table, a loop."""

    op: str
    args: tuple[int, ...] = ()
    extra: Any = None


@dataclass(frozen=True)
class Loop:
    """A part of the graph that is run `rounds` times: its state before a round and what the round makes of it.

    done: whether a lane is done after the round, so that no further one is made where all are; if it is not given, the
    loop ends where a round changes nothing any more.
    """

    rounds: int
    states: tuple[int, ...]
    results: tuple[int, ...]
    done: int | None = None

    @property
    def outputs(self) -> tuple[int, ...]:
        """All that a round is to compute."""
        return self.results if self.done is None else (*self.results, self.done)


FOLDED: dict[str, Callable[..., Any]] = {
    "neg": np.negative, "abs": np.abs, "sqrt": np.sqrt, "sin": np.sin, "cos": np.cos, "exp": np.exp, "tanh": np.tanh,
    "sign": np.sign, "floor": np.floor, "rint": np.rint, "finite": np.isfinite, "not": np.logical_not, "add": np.add,
    "sub": np.subtract, "mul": np.multiply, "div": np.divide, "max": np.maximum, "min": np.minimum,
    "atan2": np.arctan2, "lt": np.less, "le": np.less_equal, "gt": np.greater, "ge": np.greater_equal,
    "eq": np.equal, "ne": np.not_equal, "and": np.logical_and, "or": np.logical_or, "xor": np.logical_xor,
}  # fmt: skip


class Graph:
    """Nodes in the order of their making.

    inputs: name and what it differs by, in order. doubts: conditions under which an operation is not as exact as
    elsewhere, so that NumPy has to decide. in_parts: whether it is compiled part by part, between its cuts.
    """

    def __init__(self, in_parts: bool = False) -> None:
        self.in_parts = in_parts
        self.nodes: list[Node] = []
        self.values: list[float | bool | None] = []  # of each node that is a constant; None of others
        self.booleans: list[bool] = []  # of each node, whether it is true or false rather than a number
        self.differs: list[int] = []  # of each node, by SAMPLE and POSITION
        self.within: list[int] = []  # of each node the loops whose state it depends on, a bit each
        self.loops: list[Loop] = []
        self.inputs: dict[str, int] = {}
        self.doubts: list[int] = []
        self.cuts: list[int] = []  # nodes that begin a part which may be compiled by itself
        self._numbers: dict[Any, int] = {}

    def cut(self) -> None:
        """End a part here."""
        self.cuts.append(len(self.nodes))

    # ---- making nodes -----------------------------------------------------------------------------------------

    def node(self, op: str, args: tuple[int, ...] = (), extra: Any = None, differs: int = 0, within: int = 0) -> int:
        """The number of this node, which is made if there is none such."""
        key = Node(op, args, extra)
        if key in self._numbers:
            return self._numbers[key]
        for arg in args:
            differs |= self.differs[arg]
            within |= self.within[arg]
        number = self._numbers[key] = len(self.nodes)
        self.nodes.append(key)
        self.values.append(None)
        self.booleans.append(op in BOOLEAN)
        self.differs.append(differs)
        self.within.append(within)
        return number

    def constant(self, value: Any) -> int:
        """A float or a bool that is known now. 0 and −0 are two."""
        if isinstance(value, (bool, np.bool_)):
            value = bool(value)
            number = self.node("bool", (), value)
        else:
            value = float(value)
            sign = math.copysign(1.0, value)
            number = self.node("float", (), (value, sign) if value == value else ("nan", 1.0))
        self.values[number] = value
        return number

    def input(self, name: str, differs: int) -> int:
        """A number that is given when the kernel is run."""
        self.inputs[name] = differs
        return self.node("input", (), name, differs)

    def as_boolean(self, number: int) -> int:
        return number if self.booleans[number] else self.apply("ne", number, self.constant(0.0))

    def as_float(self, number: int) -> int:
        return self.where(number, self.constant(1.0), self.constant(0.0)) if self.booleans[number] else number

    # ---- operations -------------------------------------------------------------------------------------------

    def apply(self, op: str, *args: int) -> int:
        """An operation, simpler where what it is applied to allows."""
        booleans = [self.booleans[arg] for arg in args]
        if op in OF_BOOLEANS:
            args = tuple(map(self.as_boolean, args))
        elif True in booleans and not (op in ("eq", "ne") and False not in booleans):
            args = tuple(map(self.as_float, args))
        constants = [self.values[arg] for arg in args]
        if None not in constants:
            with np.errstate(all="ignore"):
                return self.constant(FOLDED[op](*constants))
        inner = self.nodes[args[0]]
        if op in ("neg", "not") and inner.op == op:
            return inner.args[0]
        if op == "neg" and inner.op == "sub":
            return self.apply("sub", *inner.args[::-1])
        if op == "abs" and inner.op in ("neg", "abs"):
            return self.apply("abs", inner.args[0])
        if len(args) == 2 and (simpler := self._of_two(op, args, constants)) is not None:
            return simpler
        if op in RANGES and not self.within[args[0]]:  # within a loop it is NaN there
            self.doubts.append(self.apply("not", self.apply("le", self.apply("abs", *args), self.constant(RANGES[op]))))
        return self.node(op, tuple(sorted(args)) if op in COMMUTATIVE else args)

    def _of_two(self, op: str, args: tuple[int, ...], constants: Sequence[Any]) -> int | None:
        """What an operation on two nodes comes to where one is a constant or a negative, or both are the same."""
        (a, b), (first, second) = args, constants
        if a == b and op in ("max", "min", "and", "or"):
            return a
        if op in ("max", "min") and any(value != value for value in constants):
            return self.constant(math.nan)
        if op in ("and", "or"):
            identity = op == "and"  # the value that leaves the other as it is
            for value, other in ((first, b), (second, a)):
                if value is not None:
                    return other if value is identity else self.constant(not identity)
        if op in ("add", "sub"):
            if second == 0.0:
                return a
            if first == 0.0:
                return b if op == "add" else self.apply("neg", b)
            if self.nodes[b].op == "neg":
                return self.apply("sub" if op == "add" else "add", a, self.nodes[b].args[0])
            return self.apply("sub", b, self.nodes[a].args[0]) if op == "add" and self.nodes[a].op == "neg" else None
        return self._product(op, args, constants) if op in ("mul", "div") else None

    def _product(self, op: str, args: tuple[int, ...], constants: Sequence[Any]) -> int | None:
        (a, b), (first, second) = args, constants
        if second in (1.0, -1.0):
            return a if second == 1.0 else self.apply("neg", a)
        if op == "mul" and first in (1.0, -1.0):
            return b if first == 1.0 else self.apply("neg", b)
        if op == "div" and first != 1.0:  # one division serves all that are divided by the same
            return self.apply("mul", a, self.apply("div", self.constant(1.0), b))
        for place, number in enumerate(args):
            if self.nodes[number].op == "neg":
                inner = list(args)
                inner[place] = self.nodes[number].args[0]
                return self.apply("neg", self.apply(op, *inner))
        return None

    def where(self, condition: int, a: int, b: int) -> int:
        """a where the condition holds, b elsewhere."""
        condition = self.as_boolean(condition)
        constant = self.values[condition]
        if constant is not None or a == b:
            return b if constant is False else a
        if self.booleans[a] and self.booleans[b]:
            other = self.apply("and", self.apply("not", condition), b)
            return self.apply("or", self.apply("and", condition, a), other)
        return self.node("where", (condition, self.as_float(a), self.as_float(b)))

    # ---- loops ------------------------------------------------------------------------------------------------

    def loop(
        self,
        step: Callable[[list[int]], list[int]],
        start: Sequence[int],
        rounds: int,
        done: Callable[[list[int]], int] | None = None,
    ) -> list[int]:
        """step(… step(start)): the nodes of one step, made once and run `rounds` times at most.

        done: by lane, of a state; where all are no further round is made.
        """
        start = [self.as_float(number) for number in start]
        if rounds < 1:
            return start
        differs = 0
        for number in start:
            differs |= self.differs[number]
        while True:
            index = len(self.loops)
            self.loops.append(Loop(0, (), ()))  # its number is taken, also for loops within
            states = tuple(self.node("state", (), (index, k), differs, 1 << index) for k in range(len(start)))
            results = tuple(self.as_float(number) for number in step(list(states)))
            ends = None if done is None else done(list(results))
            most = differs
            for number in results:
                most |= self.differs[number]
            if most == differs:
                break
            differs = most
        made = self.loops[index] = Loop(rounds, states, results, ends)
        # the nodes from outside of the loop that it is made of directly
        reached = sorted(self._reached(made.outputs, index))
        outer = [n for n in reached if not self.within[n] >> index & 1 and self.values[n] is None]
        loop = self.node("loop", (*start, *outer), index)
        return [self.node("result", (loop,), k) for k in range(len(start))]

    def inside(self, numbers: Iterable[int], index: int) -> list[int]:
        """The nodes of a loop that these are made of, in order."""
        return sorted(n for n in self._reached(numbers, index) if self.within[n] >> index & 1)

    def _reached(self, numbers: Iterable[int], index: int) -> set[int]:
        """Nodes that these are made of, down to the first outside of the loop."""
        return self._made_of(numbers, lambda number: bool(self.within[number] >> index & 1))

    def live(self, numbers: Iterable[int]) -> list[int]:
        """The nodes that these are made of, in order, without what only the rounds of a loop need."""
        return sorted(self._made_of(numbers, lambda number: True))

    def _made_of(self, numbers: Iterable[int], further: Callable[[int], bool]) -> set[int]:
        """These nodes, and what they are made of beyond those that are to be gone through further."""
        nodes_used: set[int] = set()
        left = list(numbers)
        while left:
            number = left.pop()
            if number not in nodes_used:
                nodes_used.add(number)
                left += self.nodes[number].args if further(number) else ()
        return nodes_used
