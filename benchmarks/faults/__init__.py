"""The seeded faults of `benchmarks.mutants`: what is put wrong, and the tests of that area which are to catch it.

Each is a small slip of a kind that is made in practice: a sign, a factor, a term or a check left out, a limit off by
one. `find` stands once in its file; where the code changes, the entry follows it.
"""

from __future__ import annotations

from benchmarks.faults import data, mechanics, studio
from benchmarks.faults.fault import Fault

__all__ = ["FAULTS", "Fault"]

FAULTS: tuple[Fault, ...] = (*mechanics.FAULTS, *data.FAULTS, *studio.FAULTS)
