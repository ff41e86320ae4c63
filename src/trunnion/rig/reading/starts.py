"""Starts as conditions of a measurement: values that were measured of them, and repetitions put together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from trunnion.rig.reading.mapping import DataMapping, Measured, Start
from trunnion.rig.reading.measurement import Accuracy, Condition, Signal
from trunnion.rig.reading.scale import scale
from trunnion.rig.reading.settings import constant, name_of

__all__ = ["repeated", "valued", "with_values"]

Array = NDArray[np.float64]


def valued(mapping: DataMapping, entry: Start, number: int) -> Condition:
    """The condition of a start without a file."""
    values, texts, known_as = constant(mapping, entry)
    name = name_of(texts) or f"start {number + 1}"
    return with_values(Condition(name, values, np.zeros(1), {}, dimensions=known_as, of_start=True), entry)


def with_values(condition: Condition, entry: Start) -> Condition:
    """A condition with the values that were measured of its start, and how long that is followed."""
    courses = {**condition.courses, **{measures: _signal(measures, one) for measures, one in entry.measured.items()}}
    return replace(condition, courses=courses, duration=entry.followed, of_start=True)


def _signal(measures: str, measured: Measured) -> Signal:
    """A quantity of a start, (repetition, 1)."""
    told = scale(measures, measured.values[0].unit, None)
    accuracy = Accuracy(
        measured.accuracy.zero.value,
        float(measured.accuracy.gain.evaluate()),
        stated=measured.uncertainty.value if measured.uncertainty else 0.0,
    )
    turns = np.array([[one.value] for one in measured.values])
    return Signal(measures, measures, told.unit, turns, accuracy, (measured.values[0].unit, told.factor))


def repeated(conditions: Sequence[Condition]) -> list[Condition]:
    """Starts of the same setting, duration and channels as repetitions in one condition."""
    groups: dict[object, list[Condition]] = {}
    for one in conditions:
        channels = tuple((name, course.accuracy, course.turns.shape[1]) for name, course in one.courses.items())
        key = (tuple(one.values.items()), str(one.duration), channels) if one.of_start else id(one)
        groups.setdefault(key, []).append(one)
    return [_together(group) for group in groups.values()]


def _together(group: Sequence[Condition]) -> Condition:
    first = group[0]
    courses = {
        name: replace(course, turns=np.vstack([one.courses[name].turns for one in group]))
        for name, course in first.courses.items()
    }
    return replace(first, courses=courses, files=tuple(_files(group)))


def _files(group: Sequence[Condition]) -> Iterator[str]:
    for one in group:
        yield from one.files
