"""The rounds of friction in one module as machine code: of a row of many modules they take most of the time.

A module's equations are a few dozen numbers a position, for which NumPy's calls cost far more than the arithmetic. The
rounds are compiled for a kind of equations once, and serve every module of that kind in every mechanism.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from trunnion.algebra.namespace import Number, UntraceableError
from trunnion.engines.graph import BOTH, Graph
from trunnion.engines.kernel import STRUCTURAL
from trunnion.engines.machine_code import MachineCode, vector_width
from trunnion.engines.program import program
from trunnion.engines.recorded import Recorded, number_of
from trunnion.solve.friction_problem import Contact, FrictionProblem

__all__ = ["settled_by_code"]

MOST_KINDS = 64  # of equations whose code is kept at hand
MOST_CONTACTS = 8  # code grows with their square, and takes as much longer to compile
PLAIN = frozenset({float, int, np.float64, np.ndarray})  # whose numbers have values and no derivatives
Rounds = Callable[[FrictionProblem], Sequence[Number]]


class _Code(NamedTuple):
    """Code of a kind of equations: which of their numbers it is given, and of what it makes the row, or the number."""

    code: MachineCode
    given: list[int]
    made: list[int | None]
    fixed: list[Number]


_codes: dict[tuple[Any, ...], _Code | None] = {}


def settled_by_code(problem: FrictionProblem, rounds: Rounds, about: tuple[Any, ...]) -> list[Number] | None:
    """What `rounds` makes of some equations, by machine code; None where that is for NumPy.

    Parameters
    ----------
    problem
        Equations of numbers that are scalars or arrays (position,).
    rounds
        Numbers made of equations, of the same form for all that are of a kind; what is true or false becomes 1 or 0.
    about
        What else tells the numbers apart, as the limit of the rounds.
    """
    numbers = problem.numbers
    if len(problem.contacts) > MOST_CONTACTS or not {type(number) for number in numbers} <= PLAIN:
        return None
    shape = np.broadcast_shapes(*{number.shape for number in numbers if type(number) is np.ndarray})
    if len(shape) > 1:
        return None
    literal = tuple([number if isinstance(number, float) and number in STRUCTURAL else None for number in numbers])
    sizes = tuple([len(reaction) for reaction in problem.start])
    kind = (about, literal, sizes, *[_form(contact) for contact in problem.contacts])
    if kind not in _codes:
        if len(_codes) >= MOST_KINDS:
            _codes.clear()
        _codes[kind] = _compiled(problem, rounds, literal)
    code = _codes[kind]
    return None if code is None else _run(code, numbers, shape)


def _form(contact: Contact) -> tuple[Any, ...]:
    """What a contact is but for its numbers."""
    return contact.joint, contact.rubs, contact.load.mapped(lambda _: 0.0)


def _compiled(problem: FrictionProblem, rounds: Rounds, literal: Sequence[float | None]) -> _Code | None:
    """The rounds recorded and compiled; None where they cannot be, or not as exactly as NumPy does them."""
    graph = Graph()
    numbers = iter([Recorded(graph, graph.input(str(k), BOTH)) if n is None else n for k, n in enumerate(literal)])
    try:
        found = rounds(problem.mapped(lambda _: next(numbers)))
    except UntraceableError:
        return None
    recorded = [number for number in found if isinstance(number, Recorded)]
    if graph.doubts or not recorded:
        return None
    rows = iter(range(len(recorded)))
    made = [next(rows) if isinstance(number, Recorded) else None for number in found]
    text = program(graph, [graph.as_float(number_of(graph, number)) for number in recorded], vector_width())
    fixed = [0.0 if isinstance(number, Recorded) else number for number in found]
    return _Code(MachineCode(text), [int(name) for name in text.inputs[BOTH]], made, fixed)


def _run(code: _Code, numbers: Sequence[Number], shape: tuple[int, ...]) -> list[Number]:
    """The code for some numbers, which have this shape together."""
    lanes = math.prod(shape)
    given = np.empty((len(code.given), max(lanes, code.code.width)))
    for row, k in enumerate(code.given):
        given[row, :lanes] = numbers[k]
    given[:, lanes:] = given[:, :1]  # a vector is filled
    rows = code.code.rows_of(given, 1 + max(row for row in code.made if row is not None))
    both = zip(code.made, code.fixed, strict=True)
    return [fixed if row is None else rows[row, :lanes].reshape(shape) for row, fixed in both]
