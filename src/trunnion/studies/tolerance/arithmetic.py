"""Whether two machines compute the same bits: their functions, tried on a thousand numbers.

Sums, products and roots are the same on every machine (IEEE 754); sines, logarithms and the like are not: NumPy picks
their code by the processor it finds, and the last bit may differ. So it is not the versions that are compared but what
comes out.
"""

from __future__ import annotations

import hashlib
from functools import cache

import numpy as np
from scipy.special import ndtri

from trunnion.errors import Finding
from trunnion.results.sentences import told

__all__ = ["fingerprint", "mixed"]


@cache
def fingerprint() -> str:
    """Twelve hexadecimal digits, equal where the functions give the same bits."""
    x = np.arange(1, 1025) * 0.618033988749895  # exact products: the same numbers everywhere
    u = np.arange(1, 1025) / 1025
    tried = [np.sin(x), np.cos(x), np.tan(x), np.arcsin(u), np.arctan2(u, 1 - u), np.exp(u), np.log(x), np.log1p(u)]
    tried += [np.hypot(x, u), np.power(x, u), np.tanh(u), np.arcsinh(x), ndtri(u)]
    return hashlib.sha256(b"".join(values.tobytes() for values in tried)).hexdigest()[:12]


def mixed(seen: set[str]) -> tuple[Finding, ...]:
    """A note, if machines of more than one kind took part."""
    if len(seen) < 2:
        return ()
    return (told("samples.machines", "cluster", kinds=len(seen)),)
