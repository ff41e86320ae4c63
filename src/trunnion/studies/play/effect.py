"""What a study of play has found, before it is a result."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
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
    where these do more, and so count; status. extremes: of each measure whose figure is a maximum or minimum, or at a
    stated place, by name, what play does to it alone there. figure: of a maximum or minimum the extreme itself,
    (sample,), with pins at offsets, (sample, 1), by path.
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
    extremes: Mapping[str, Effect] = field(default_factory=dict)
    figure: Callable[[Mapping[str, Array]], Array] | None = None

    def of(self, i: int) -> tuple[Effect, int]:
        """Where the figure of a measure is looked for, and its number there: at its extreme, or over the cycle."""
        there = self.extremes.get(self.measures[i].name)
        return (self, i) if there is None else (there, 0)

    @property
    def sensitivity(self) -> Array:
        """Loads that count, (measure, joint, end, axis, position)."""
        return np.where(self.on_others[:, :, None, None], self.others, self.loads)

    def by_link(self, i: int, j: int) -> Array:
        """Worst case of a joint with its seat on one link and on the other, (2, position); 0 of one that it cannot be
        on."""
        play = list(self.plays.values())[j]
        radii = np.array([np.broadcast_to(np.asarray(primal(one), float), self.time.shape) for one in play.radii])
        loads = np.stack([self.loads[i, j], self.others[i, j]])[:, : len(radii)]
        return np.asarray(np.sum(radii * np.sqrt(np.nansum(loads**2, axis=2)), axis=1))

    @property
    def total(self) -> Array:
        """Worst case of all joints together, (measure, position)."""
        found: Array = np.sum(self.worst_case, axis=1)
        return found
