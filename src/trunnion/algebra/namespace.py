"""One kernel, any number: pick the functions that fit the numbers a kernel was given.

A kernel writes `xp = namespace(x, y)` and then `xp.sqrt(x)`; with floats and NumPy arrays that is NumPy, with
dual numbers `trunnion.algebra.dual`, with JAX arrays `jax.numpy`. Nothing else in a kernel depends on the kind.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from trunnion.algebra.dual import Dual
from trunnion.algebra.dual import functions as dual_functions
from trunnion.algebra.traced import Traced

__all__ = ["Number", "apart", "compiled", "namespace"]

# A float, a NumPy or JAX array, or a dual number of them. Operators and `namespace` are all that is assumed.
Number = Any


def namespace(*numbers: Number) -> Any:
    """Functions (`sin`, `sqrt`, `hypot`, `where`, …) for the most general kind among `numbers`."""
    found: Any = np
    for number in numbers:
        if isinstance(number, Dual):
            return dual_functions
        if not isinstance(number, (np.ndarray, float, int)) and hasattr(number, "__array_namespace__"):
            found = number.__array_namespace__()
    return found


def compiled(numbers: Iterable[Number]) -> bool:
    """Whether one of the numbers is compiled: it has no value to decide by."""
    return any(isinstance(number, Traced) for number in numbers)


def apart(lanes: Number) -> bool:
    """Whether there are lanes to go on with apart from the others.

    Never among numbers that are compiled: such lanes stay unsolved there, and are computed again with NumPy.
    """
    return not isinstance(lanes, Traced) and bool(np.any(lanes))
