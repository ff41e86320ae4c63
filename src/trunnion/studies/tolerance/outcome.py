"""All that the methods of a tolerance study have found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from trunnion.studies.tolerance.first_order import ToleranceStudy
from trunnion.studies.tolerance.indices import Indices
from trunnion.studies.tolerance.sampling import Samples
from trunnion.studies.tolerance.search import Corner

__all__ = ["Outcome"]


@dataclass(frozen=True, eq=False)
class Outcome:
    """What the methods that were asked for found; None of those that were not. target: the yield asked for."""

    study: ToleranceStudy
    methods: tuple[str, ...]
    worst: Sequence[tuple[Corner, Corner]] | None = None
    samples: Samples | None = None
    indices: Indices | None = None
    target: float | None = None
