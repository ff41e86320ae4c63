"""Products and sums in which a literal 0 or 1, as most local coordinates are one, costs no pass over an array."""

from __future__ import annotations

from trunnion.algebra.namespace import Number


def is_zero(number: Number) -> bool:
    """A literal zero."""
    return isinstance(number, float) and number == 0.0


def times(a: Number, b: Number) -> Number:
    """a b."""
    if isinstance(a, float):
        if a == 0.0:
            return 0.0
        if a == 1.0:
            return b
    if isinstance(b, float):
        if b == 0.0:
            return 0.0
        if b == 1.0:
            return a
    return a * b


def plus(a: Number, b: Number) -> Number:
    """a + b."""
    if isinstance(a, float) and a == 0.0:  # `is_zero` written out: a call costs as much as a sum of few numbers
        return b
    return a if isinstance(b, float) and b == 0.0 else a + b


def less(a: Number, b: Number) -> Number:
    """a − b."""
    if isinstance(b, float) and b == 0.0:
        return a
    return -b if isinstance(a, float) and a == 0.0 else a - b
