"""What a comparison is made of: a channel beside the model, an efficiency beside the model's, a condition with both."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trunnion.model.mechanism import Mechanism
from trunnion.rig.comparison.assessment import SignalAssessment, Verdict
from trunnion.rig.comparison.error_sources import Cause
from trunnion.rig.modelled import Modelled
from trunnion.rig.reading.measurement import Condition, Signal
from trunnion.solve.loads import useful_loads, useful_springs

__all__ = ["ChannelComparison", "Compared", "Efficient", "unmeasured"]


@dataclass(frozen=True, eq=False)
class ChannelComparison:
    """One channel in one condition: what was measured, what the model has, what it comes to.

    friction: what other friction would explain by its course; NaN where it was not tried.
    """

    course: Signal
    model: NDArray[np.float64]
    comparable: NDArray[np.bool_]
    judged: SignalAssessment
    cause: Cause | None
    others: tuple[Cause, ...] = ()
    friction: float = np.nan

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


def unmeasured(mechanism: Mechanism, condition: Condition) -> tuple[str, ...]:
    """Drivers, useful loads and springs that no channel tells the effort of, by their entries in the model."""
    told = {course.measures for course in condition.courses.values()}
    drivers = (f"drivers.{name}" for name in mechanism.drivers if f"effort:{name}" not in told)
    loads = (f"loads.{name}" for name in useful_loads(mechanism) if f"load:{name}" not in told)
    return (*drivers, *loads, *(f"springs.{name}" for name in useful_springs(mechanism)))
