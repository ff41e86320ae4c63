"""Numbers in nested tuples, as frames and elements are: one change for all, all in a row, some lanes of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number

__all__ = ["each", "flat", "replaced", "zipped"]


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
