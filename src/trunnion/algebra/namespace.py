"""One kernel, any number: pick the functions that fit the numbers a kernel was given, alone or in nested tuples.

A kernel writes `xp = namespace(x, y)` and then `xp.sqrt(x)`; with floats and NumPy arrays that is NumPy, with
dual numbers `trunnion.algebra.dual`, with numbers that are recorded those of their engine. Nothing else in a kernel
depends on the kind.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual
from trunnion.algebra.dual import functions as dual_functions

# A float, a NumPy array, a dual number of them, or one that is recorded. Operators and `namespace` are all that is
# assumed.
Number = Any
Step = Callable[[list[Any]], list[Any]]  # one round of a loop
Done = Callable[[list[Any]], Any]  # of its state, by lane


class UntraceableError(TypeError):
    """A kernel asks for what only numbers with values have: it cannot be compiled as it stands."""


class Traced:
    """A number that records what a kernel does with it, in the place of a NumPy array.

    It has no value yet, so nothing can be decided by it. Where a kernel looks at all lanes to save work, `np.any` is
    True and `np.all` is False: the answers that no lane contradicts.
    """

    __slots__ = ()

    @classmethod
    def looped(cls, step: Step, start: Sequence[Any], rounds: int, done: Done | None) -> list[Any]:
        """See the function `looped`; rounds: at least 1, and one of the start at least is of this kind."""
        raise NotImplementedError

    @classmethod
    def recurring(cls, function: Step, numbers: Sequence[Any], about: Callable[[], Hashable]) -> list[Any] | None:
        """See the function `recurring`."""
        raise NotImplementedError

    def cut(self) -> None:
        """See the function `cut`."""
        raise NotImplementedError


def recurring(function: Step, numbers: Sequence[Number], about: Callable[[], Hashable]) -> list[Number] | None:
    """function(numbers), recorded once for all that are alike in what they are about; None if that saves nothing."""
    kind = next((type(number) for number in numbers if isinstance(number, Traced)), None)
    return None if kind is None else kind.recurring(function, numbers, about)


def cut(number: Number) -> None:
    """A part of a long computation ends: what is recorded from here on may be compiled by itself."""
    if isinstance(number, Traced):
        number.cut()


def namespace(*numbers: Number) -> Any:
    """Functions (`sin`, `sqrt`, `hypot`, `where`, …) for the most general kind among `numbers`."""
    library: Any = np
    for number in numbers:
        if isinstance(number, Dual):
            return dual_functions
        if not isinstance(number, (np.ndarray, float, int)) and hasattr(number, "__array_namespace__"):
            library = number.__array_namespace__()
    return library


def apart(lanes: Number) -> bool:
    """Whether there are lanes to go on with apart from the others.

    Never among numbers that are compiled: such lanes stay unsolved there, and are computed again with NumPy.
    """
    return not isinstance(lanes, Traced) and bool(np.any(lanes))


def looped(step: Step, start: Sequence[Number], rounds: int, done: Done | None = None) -> list[Number]:
    """step(… step(start)), at most so many rounds. start, and what a step makes of it: lists of numbers.

    done: whether a lane is done. Where all are no further round is made; a step leaves those that are as they are,
    whatever the lanes beside them need. Numbers that are recorded have the step compiled once.
    """
    state = list(start)
    for k in range(rounds):
        kind = next((type(number) for number in state if isinstance(number, Traced)), None)
        if kind is not None:
            return kind.looped(step, state, rounds - k, done)
        if done is not None and np.all(done(state)):
            break
        state = step(state)
    return state


# ---- numbers in nested tuples, as frames and elements are --------------------------------------------------------


def each(value: Any, change: Callable[[Number], Number]) -> Any:
    """The same tuple of tuples with `change` applied to every number."""
    return zipped(change, value)


def zipped(change: Callable[..., Number], first: Any, *others: Any) -> Any:
    """A tuple of tuples like the first, each number from those at its place in all."""
    if not isinstance(first, tuple):
        return change(first, *others)
    parts = [zipped(change, *group) for group in zip(first, *others, strict=True)]
    return type(first)(*parts) if hasattr(first, "_fields") else tuple(parts)


def flat(value: Any) -> Iterator[Number]:
    """Every number of a tuple of tuples."""
    if isinstance(value, tuple):
        for part in value:
            yield from flat(part)
    else:
        yield value


def replaced(number: Number, lanes: NDArray[np.bool_], new: Number) -> NDArray[np.float64]:
    """The number in the shape of `lanes`, with others in the lanes that are chosen."""
    full = np.array(np.broadcast_to(number, lanes.shape), float)
    full[lanes] = new
    return full
