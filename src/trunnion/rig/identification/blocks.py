"""The data of an identification: one block for each channel in each condition, what is used of it, and its scatter.

The turns of a condition are its independent repetitions; within a turn neighbours may be correlated as they like.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError
from trunnion.rig.reading.efficiency import efficiency_of, pairs_of
from trunnion.rig.reading.measurement import Accuracy, Condition, Measurement, Signal

__all__ = ["EFFICIENCY", "OWN", "Block", "blocks_of", "channels_of", "finite", "shared_zero"]

Array = NDArray[np.float64]
EFFICIENCY = "efficiency"  # the channel that is computed from torques and speeds, one figure a turn
OWN = "zero of each file"
ROUNDING = 1e-9  # of a course, by interpolation and sums
FAR_ABOVE = 100.0


@dataclass(frozen=True)
class Block:
    """One channel in one condition.

    condition: its index; turns, held: (turn, position), those to fit and those held out; effects: of a course that is
    computed from others, what a standard uncertainty of each of their errors does to it, by the name of the error;
    files: where it comes from.
    """

    condition: int
    channel: str
    course: Signal
    turns: Array
    held: Array
    effects: Mapping[str, float] = field(default_factory=dict)
    files: tuple[str, ...] = ()

    @property
    def unresolved(self) -> float:
        """Standard uncertainty by steps between readings that the scatter does not carry it over, or by rounding."""
        return max(float(self.course.unresolved), self._rounding)

    @cached_property
    def _rounding(self) -> float:
        """What computing rounds off; 0 where the scatter is far above it."""
        least = ROUNDING * float(np.nanmax(np.abs(self.turns), initial=0.0))
        return 0.0 if self.repeats and float(self.variance[0]) > (FAR_ABOVE * least) ** 2 else least

    @property
    def fitted(self) -> bool:
        """Whether any of it is used."""
        return len(self.turns) > 0

    @cached_property
    def mean(self) -> Array:
        """Mean of the turns that are fitted, (position,); NaN where there is nothing."""
        return _mean(self.turns)

    @cached_property
    def held_mean(self) -> Array:
        """Mean of those held out."""
        return _mean(self.held)

    @cached_property
    def count(self) -> NDArray[np.intp]:
        """Turns that have a value, (position,)."""
        return np.asarray(np.count_nonzero(np.isfinite(self.turns), axis=0))

    @cached_property
    def deviations(self) -> Array:
        """Turns from their mean, (turn, position); 0 where there is nothing."""
        return np.nan_to_num(self.turns - self.mean)

    @cached_property
    def spread(self) -> Array:
        """Deviations, (turn, position), larger by √((turns − 1)/(m − 1)) where only m turns have a value; 0 of one.

        The sum of their squares is then (turns − 1) variances of one turn, wherever values are missing.
        """
        missing = np.sqrt((len(self.turns) - 1) / np.maximum(self.count - 1, 1))
        return np.asarray(self.deviations * missing)

    @cached_property
    def repeats(self) -> bool:
        """Whether it tells how much turns scatter."""
        return bool(self.turns.shape[0] > 1 and np.any(self.deviations != 0))

    @cached_property
    def variance(self) -> Array:
        """Variance of one turn, (position,): pooled over the positions; NaN if it does not repeat.

        One for all of them: weights that follow the scatter from place to place would trust most where it happens to
        be small, and the covariance, which is made of the same scatter, would come out too small.
        """
        return np.full(self.turns.shape[1], self.pooled(np.isfinite(self.mean)) if self.repeats else np.nan)

    def pooled(self, mask: NDArray[np.bool_]) -> float:
        """Variance of one turn, pooled over some positions, (position,); NaN where none of them repeats."""
        freedom = int(np.sum(np.maximum(self.count - 1, 0)[mask]))
        return float(np.sum(self.deviations[:, mask] ** 2) / freedom) if freedom else float("nan")


def _mean(turns: Array) -> Array:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return np.asarray(np.nanmean(turns, axis=0)) if len(turns) else np.full(turns.shape[1], np.nan)


def finite(measurement: Measurement) -> Measurement:
    """The measurement with NaN for readings that are infinite."""
    found = []
    for one in measurement.conditions:
        courses = {
            name: replace(course, turns=np.where(np.isinf(course.turns), np.nan, course.turns))
            for name, course in one.courses.items()
        }
        found.append(replace(one, courses=courses))
    return replace(measurement, conditions=tuple(found))


def channels_of(measurement: Measurement, wanted: Sequence[str] | None, joints: Mapping[str, str]) -> list[str]:
    """Channels to fit, in the order of the data; all if none is named. MechanismError for one that is not there."""
    known = list(dict.fromkeys(name for one in measurement.conditions for name in one.courses))
    if not known:
        raise MechanismError(Finding("the measurement has no channels", measurement.name, "map one to a measure"))
    told = any(pairs_of(one, joints) for one in measurement.conditions)
    missing = [name for name in wanted or () if name not in known and not (name == EFFICIENCY and told)]
    if missing:
        what = f"there is no channel '{missing[0]}'"
        computed = f", and {EFFICIENCY} of them" if told else ""
        raise MechanismError(Finding(what, "channels", f"the measurement has {', '.join(known)}{computed}"))
    if wanted is None:
        return known
    return [name for name in dict.fromkeys([*known, EFFICIENCY]) if name in wanted]


def _efficiency(condition: Condition, joints: Mapping[str, str]) -> tuple[Signal, dict[str, float]]:
    """The efficiency of each turn as a course of one position, and what the errors of its sensors do to it."""
    found = efficiency_of(condition, joints)
    effects: dict[str, float] = {}
    for one in found.contributions:
        accuracy = condition.courses[one.channel].accuracy if one.channel in condition.courses else Accuracy()
        if one.source == "gain":
            effects[f"gain of {one.channel}"] = one.sensitivity * one.input
        elif one.source == "zero":
            shared = shared_zero(accuracy)
            effects |= {f"zero of {one.channel}": one.sensitivity * shared} if shared else {}
            effects |= {f"{OWN} of {one.channel}": one.sensitivity * accuracy.own} if accuracy.own else {}
    return Signal(EFFICIENCY, "efficiency:cycle", "1", found.per_turn[:, None]), effects


def shared_zero(accuracy: Accuracy) -> float:
    """Standard uncertainty of the zero that all files share: without what each has by itself."""
    if not np.isfinite(accuracy.zero):
        return float(accuracy.zero)
    return float(np.sqrt(max(accuracy.zero**2 - accuracy.own**2, 0.0)))


def blocks_of(
    measurement: Measurement, channels: Sequence[str], held: frozenset[str], share: float, joints: Mapping[str, str]
) -> list[Block]:
    """The blocks, with what is held out: whole conditions by name, and a share of the turns of each, the last ones.

    joints: of the loads, for the efficiency.
    """
    found = []
    for index, condition in enumerate(measurement.conditions):
        for channel in channels:
            course = condition.courses.get(channel)
            effects: dict[str, float] = {}
            if course is None and channel == EFFICIENCY and pairs_of(condition, joints):
                course, effects = _efficiency(condition, joints)
            if course is None:
                continue
            turns = np.atleast_2d(np.asarray(course.turns, float))
            keep = 0 if condition.name in held else len(turns) - _share(turns, share, condition)
            found.append(Block(index, channel, course, turns[:keep], turns[keep:], effects, tuple(condition.files)))
    if not any(block.fitted for block in found):
        raise MechanismError(Finding("all conditions are held out", "hold_out", "leave some to fit"))
    return found


def _share(turns: Array, share: float, condition: Condition) -> int:
    """How many turns of a condition are held out."""
    if share == 0:
        return 0
    count = max(1, round(share * len(turns)))
    if count >= len(turns):
        what = f"has {len(turns)} turn{'s' * (len(turns) != 1)}: none would be left to fit"
        remedy = "name whole conditions to hold out, or give a smaller share"
        raise MechanismError(Finding(what, f"condition {condition.name}", remedy))
    return count
