"""What a comparison is made of: a channel beside the model, an efficiency beside the model's, a condition with both."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from trunnion.rig.comparison.assessment import SignalAssessment, Verdict
from trunnion.rig.comparison.causes import Cause
from trunnion.rig.modelled import Modelled
from trunnion.rig.reading.measurement import Condition, Signal

__all__ = ["ChannelComparison", "Compared", "Efficient"]


@dataclass(frozen=True, eq=False)
class ChannelComparison:
    """One channel in one condition: what was measured, what the model has, what it comes to.

    causes: what would explain the residual, by kind; empty where the model is within U.
    """

    course: Signal
    model: NDArray[np.float64]
    comparable: NDArray[np.bool_]
    judged: SignalAssessment
    causes: Mapping[str, Cause] = field(default_factory=dict)

    @property
    def within(self) -> bool:
        return self.judged.verdict is Verdict.WITHIN


@dataclass(frozen=True)
class Efficient:
    """Efficiency of a condition by the channels: measured, its expanded uncertainty, and of the model.

    reason: why one of them is not known, with what to do about it; both empty if they are.
    """

    measured: float = np.nan
    expanded: float = np.nan
    model: float = np.nan
    reason: tuple[str, str] = ("", "")

    @property
    def known(self) -> bool:
        """Whether the two can be compared."""
        return bool(np.isfinite([self.measured, self.expanded, self.model]).all())

    @property
    def within(self) -> bool:
        """Whether the model lies within ±U; not where one of them is unknown."""
        return bool(abs(self.measured - self.model) <= self.expanded)


@dataclass(frozen=True, eq=False)
class Compared:
    """A condition with its model and its channels.

    unmeasured: drivers, useful loads and springs whose power no channel tells, where others do: no efficiency then.
    """

    condition: Condition
    model: Modelled
    pairs: Mapping[str, ChannelComparison]
    efficiency: Efficient | None
    unmeasured: tuple[str, ...] = ()
