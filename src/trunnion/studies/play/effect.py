"""What a study of play has found, before it is a result."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
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
    worst_case and deviation (measure, joint, position); loads (measure, joint, end, axis, position), others: the same
    with seats on the other links, where the model does not say which carry them; on_others (measure, joint, position):
    where these do more, and so count; status. there: of each measure, by name, what play does to it at the one place
    that counts: a stated one, that of a maximum or minimum, else where its worst case is largest in the cycle. figure:
    of a maximum or minimum the extreme itself, (sample,), with pins at offsets, (sample, 1), by path.
    """

    run: Run
    measures: Sequence[Measure]
    plays: Mapping[str, Play]
    time: Array
    value: Array
    worst_case: Array
    deviation: Array
    loads: Array
    others: Array
    on_others: NDArray[np.bool_]
    status: NDArray[np.int8]
    there: Mapping[str, Effect] = field(default_factory=dict)
    figure: Callable[[Mapping[str, Array]], Array] | None = None

    @property
    def sensitivity(self) -> Array:
        """Loads that count, (measure, joint, end, axis, position)."""
        return np.where(self.on_others[:, :, None, None], self.others, self.loads)

    @property
    def total(self) -> Array:
        """Worst case of all joints together, (measure, position)."""
        found: Array = np.sum(self.worst_case, axis=1)
        return found
