"""What a measurement is to the analysis: courses over the cycle, turn by turn, with what is known of their accuracy.

Everything is SI. A measurement has conditions, a condition has courses, a course has one row for each turn.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, stdtrit

from trunnion.errors import Finding
from trunnion.results.attributes import finding_rows
from trunnion.results.dataset import MemberUnits, Variable, dataset_of, described
from trunnion.rig.reading.steps import LeftOfSteps

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Accuracy", "Condition", "Measurement", "Signal", "between_turns", "dataset", "rms", "student"]

Array = NDArray[np.float64]
COURSE = ("condition", "channel", "position")
VARIABLES = {
    "mean": Variable(COURSE, "channel", "mean over the turns"),
    "scatter": Variable(COURSE, "channel", "standard deviation between turns"),
    "uncertainty": Variable(COURSE, "channel", "its standard uncertainty"),
    "turns": Variable(COURSE, "1", "turns with a value at the position"),
    "set": Variable(("condition", "setting"), "SI", "what was set"),
    "speed": Variable(("condition",), "rad/s", "mean speed of the driver"),
    "phase": Variable(("position",), "1", "share of the cycle"),
}


@dataclass(frozen=True)
class Accuracy:
    """Standard uncertainties of a channel that averaging does not lessen.

    zero: of its zero, in the unit of the course; gain: of its gain, relative; they are the same at every position of
    all turns of a file. resolution: step from one reading to the next, in the unit of the course, 0 if it is not known.
    own: the part of `zero` that each file has by itself, such as that of the mean of its unloaded stretch; what is left
    of `zero` is the same in all files. datum: value at which the sensor reads 0, in the unit of the course; an error of
    its gain acts on value − datum. cut: of what all readings are off by
    alike where they may be rounded or cut off to a step that noise does not carry them over, beside `zero`. left:
    what of the error by the resolution all turns repeat, so that averaging leaves it; None for all of step/√12.
    """

    zero: float = 0.0
    gain: float = 0.0
    resolution: float = 0.0
    own: float = 0.0
    cut: float = 0.0
    left: LeftOfSteps | None = None
    datum: float = 0.0


@dataclass(frozen=True)
class Signal:
    """One channel in one condition.

    channel: its name in the mapping; measures: what it measures, as `measures.measures.named` reads it (`effort:input`,
    `rate:output`, `load:brake`); unit: SI; turns: (turn, position), NaN where there is nothing to be had.
    read_in: unit of the readings for people, factor to SI, where they are in a unit of what is measured: U/min.
    per_turn: pulses of a speed that is worked out from them, 0 of others; local: standard uncertainty of each position
    by itself, beside that of the accuracy.
    """

    channel: str
    measures: str
    unit: str
    turns: Array
    accuracy: Accuracy = Accuracy()
    read_in: tuple[str, float] = ("", 1.0)
    per_turn: int = 0
    local: Array | float = 0.0

    @property
    def shown(self) -> tuple[str, float]:
        """Unit in which values are shown, and its factor to SI: that of the readings, else SI."""
        return self.read_in if self.read_in[0] else (self.unit, 1.0)

    @cached_property
    def count(self) -> NDArray[np.intp]:
        """Turns that have a value, (position,)."""
        return np.asarray(np.count_nonzero(np.isfinite(self.turns), axis=0))

    @cached_property
    def mean(self) -> Array:
        """Mean over the turns, (position,); NaN where no turn has a value."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            return np.asarray(np.nanmean(self.turns, axis=0))

    @property
    def read(self) -> Array:
        """Mean of what the sensor reads, in the unit of the course, (position,): on which an error of its gain acts."""
        return self.mean - self.accuracy.datum

    @cached_property
    def scatter(self) -> Array:
        """Standard deviation between turns, (position,); NaN with fewer than two."""
        return between_turns(self.turns)

    @cached_property
    def unresolved(self) -> float:
        """Standard uncertainty by the resolution, what turns repeat of step/√12 (GUM F.2.2.1), where they scatter by
        less than half a step; more carries them over the steps, and their mean is finer."""
        step = self.accuracy.resolution
        if not step:
            return 0.0
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            scatter = float(np.nanmedian(self.scatter))
        share = self.accuracy.left.share if self.accuracy.left is not None else 1.0
        return 0.0 if scatter > step / 2 else share * step / 12**0.5

    @cached_property
    def uncertainty(self) -> Array:
        """Standard uncertainty of the mean, (position,): scatter/√n, zero, gain and resolution.

        GUM (JCGM 100:2008), 4.2 and 5.1. NaN with fewer than two turns.
        """
        repeated = self.scatter / np.sqrt(np.maximum(self.count, 1))
        with np.errstate(over="ignore"):  # of numbers near the end of the floats
            known = np.square(self.accuracy.zero) + np.square(self.accuracy.cut) + np.square(self.unresolved)
            return np.asarray(np.sqrt(repeated**2 + known + (self.accuracy.gain * self.read) ** 2))


@dataclass(frozen=True)
class Condition:
    """One working condition: what was set, and what was measured over the cycle.

    values: numbers of the model that were set or measured once, by name, SI, for `Mechanism.with_values`;
    phase: (position,), share of the cycle from the start of the model's, in [0, 1); files: where it comes from;
    speed: of the driver, mean over the turns, rad/s, below zero where its coordinate falls; NaN if the cycle is a time.
    start, cycle: coordinate of the driver at phase 0, and how far it goes in a cycle, rad; NaN where that is not known.
    lag: standard uncertainty, s, of when the coordinate is passed, of all channels together, by the sampling of pulses;
    cut: that of the angle, rad with its sign, by readings that may be cut off, alike in all files of that resolution.
    units: SI, of those of `values` that were stated with a unit; the others are plain numbers.
    duration: of a cycle that is a time, s; NaN of one that is an angle.
    """

    name: str
    values: Mapping[str, float]
    phase: Array
    courses: Mapping[str, Signal]
    files: Sequence[str] = ()
    speed: float = float("nan")
    start: float = float("nan")
    cycle: float = float("nan")
    lag: float = 0.0
    cut: float = 0.0
    units: Mapping[str, str] = field(default_factory=dict)
    duration: float = float("nan")


def between_turns(turns: Array) -> Array:
    """Standard deviation between turns, (position,) of (turn, position); NaN with fewer than two."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return np.asarray(np.nanstd(turns, axis=0, ddof=1))


def rms(values: Array) -> float:
    """Root mean square of what is there; NaN of nothing."""
    finite = values[np.isfinite(values)]
    with np.errstate(over="ignore"):  # of numbers near the end of the floats
        return float(np.sqrt(np.mean(finite**2))) if finite.size else float("nan")


def student(freedom: Array | float, coverage: float) -> Array:
    """k_p of U = k_p u by Student's distribution, with the probability that ± coverage has of a normal one, which it is
    for infinite degrees of freedom; GUM, G.3.2."""
    freedom = np.asarray(freedom, float)
    factor = stdtrit(np.where(np.isfinite(freedom), np.maximum(freedom, 1.0), 1.0), ndtr(coverage))
    return np.asarray(np.where(np.isfinite(freedom), factor, coverage))


@dataclass(frozen=True)
class Measurement:
    """All conditions of a measurement, what there is to say of the data, and what was done to them.

    done: sentences for a report, such as the filter and its cut-off.
    """

    name: str
    conditions: tuple[Condition, ...]
    findings: tuple[Finding, ...] = ()
    done: Sequence[str] = field(default_factory=tuple)

    @property
    def channels(self) -> dict[str, Signal]:
        """The first course of each channel."""
        return {name: course for one in reversed(self.conditions) for name, course in one.courses.items()}


def dataset(measurement: Measurement) -> xr.Dataset:
    """Means over the turns with scatter and standard uncertainty, by condition, channel and position; SI.

    `set` has what was set, by the names of the model's values; NaN where a condition has none.
    """
    conditions, first = measurement.conditions, measurement.channels
    channels, phase = list(first), max((one.phase for one in conditions), key=len)
    names = list(dict.fromkeys(name for one in conditions for name in one.values))
    figures = {"mean": "mean", "scatter": "scatter", "uncertainty": "uncertainty", "turns": "count"}
    courses = {
        name: np.full((len(conditions), len(channels), len(phase)), 0 if name == "turns" else np.nan,
                      np.intp if name == "turns" else float)
        for name in figures
    }  # fmt: skip
    for i, one in enumerate(conditions):
        for channel, course in one.courses.items():
            for name, figure in figures.items():
                row = getattr(course, figure)
                courses[name][i, channels.index(channel), : len(row)] = row
    values = np.array([[one.values.get(name, np.nan) for name in names] for one in conditions])
    speeds = np.array([one.speed for one in conditions])
    arrays = {**courses, "set": values.reshape(len(conditions), len(names)), "speed": speeds}
    units = {"channel": MemberUnits("channel", [first[name].unit for name in channels])}
    variables = described(arrays, VARIABLES, units)
    labels = {"condition": [one.name for one in conditions], "channel": channels, "setting": names}
    attributes = {
        "name": measurement.name,
        "measured": [first[name].measures for name in channels],
        "done": list(measurement.done),
        "findings": finding_rows(measurement.findings),
    }
    return dataset_of("measurement", variables, labels, attributes, described({"phase": phase}, VARIABLES))
