"""Dual numbers a + ε b, ε² = 0, and what is made of them: derivatives, lines, poses, screws, dual matrices.

A number: `Dual`, its functions `functions`; `seed`, `derivative`, `primal` for derivatives; `spatial`, `parts` for
θ + ε s in space. Of three numbers: `vectors`, and `lines` with poses and screws. Of stacks of matrices: `linalg`. On
dual angles: `ccc`, the closed chain of four cylindrical pairs.
"""

from __future__ import annotations

from trunnion.algebra import duallinalg as linalg
from trunnion.algebra import lines
from trunnion.algebra import vector as vectors
from trunnion.algebra.dual import Dual, derivative, functions, parts, primal, seed, spatial
from trunnion.groups import ccc

__all__ = [
    "Dual", "ccc", "derivative", "functions", "linalg", "lines", "parts", "primal", "seed", "spatial", "vectors",
]  # fmt: skip
