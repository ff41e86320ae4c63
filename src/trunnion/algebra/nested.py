"""Numbers in nested tuples, as frames and elements are: one change for all, all in a row, some lanes of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number

__all__ = ["each", "flat", "replaced", "zipped"]

_Nested = TypeVar("_Nested")


def each(value: _Nested, change: Callable[[Number], Number]) -> _Nested:
    """The same tuple of tuples with `change` applied to every number."""
    return _each(value, change)  # type: ignore[no-any-return]


def _each(value: Any, change: Callable[[Number], Number]) -> Any:
    if not isinstance(value, tuple):
        return change(value)
    parts = [_each(part, change) for part in value]
    return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)


def zipped(change: Callable[..., Number], first: _Nested, *others: Any) -> _Nested:
    """A tuple of tuples like the first, each number from those at its place in all."""
    return _zipped(change, first, *others)  # type: ignore[no-any-return]


def _zipped(change: Callable[..., Number], *values: Any) -> Any:
    first = values[0]
    if not isinstance(first, tuple):
        return change(*values)
    parts = [_zipped(change, *group) for group in zip(*values, strict=True)]
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
