"""What a study of play has found, before it is a result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion.measures.measures import Measure

if TYPE_CHECKING:
    from trunnion.solve.run import Run
    from trunnion.solve.shifts import Play

__all__ = ["Effect"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Effect:
    """What play does over the cycle. measures; plays by joint; time, s, (position,); value (measure, position);
    worst_case and deviation (measure, joint, position); loads (measure, joint, end, axis, position); status.
    """

    run: Run
    measures: Sequence[Measure]
    plays: Mapping[str, Play]
    time: Array
    value: Array
    worst_case: Array
    deviation: Array
    loads: Array
    status: NDArray[np.int8]

    @property
    def total(self) -> Array:
        """Worst case of all joints together, (measure, position)."""
        found: Array = np.sum(self.worst_case, axis=1)
        return found
