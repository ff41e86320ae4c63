"""Numbers in nested tuples, as frames and elements are: one change for all of them, or all of them in a row."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, TypeVar

from trunnion.algebra.namespace import Number

__all__ = ["each", "flat"]

_Nested = TypeVar("_Nested")


def each(value: _Nested, change: Callable[[Number], Number]) -> _Nested:
    """The same tuple of tuples with `change` applied to every number."""
    return _each(value, change)  # type: ignore[no-any-return]


def _each(value: Any, change: Callable[[Number], Number]) -> Any:
    if not isinstance(value, tuple):
        return change(value)
    parts = [_each(one, change) for one in value]
    return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)


def flat(value: Any) -> Iterator[Number]:
    """Every number of a tuple of tuples."""
    if isinstance(value, tuple):
        for one in value:
            yield from flat(one)
    else:
        yield value
