"""What a rig will show before it exists: readings to expect of each sensor, how well the efficiency will be known.

Readings are those of a sensor without random errors in a steady cycle. The uncertainty of the efficiency is the one
that `efficiency_of` will find from the data, worked out from what is stated of the sensors.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, counted
from trunnion.rig.reading.efficiency import Efficiency, efficiency_of, load_joints, pairs_of
from trunnion.rig.reading.measurement import Accuracy, Condition, Signal
from trunnion.rig.virtual.observation import Case
from trunnion.rig.virtual.observe import Observation

__all__ = ["Expected", "Forecast", "RigPlan", "plan"]

Array = NDArray[np.float64]
SMALL_RANGE, FEW_STEPS = 0.05, 100


@dataclass(frozen=True)
class Expected:
    """What a sensor will show over all conditions.

    least, most: readings, in `unit`; share: largest magnitude over what it can tell, NaN without a range; steps: of
    its converter from least to most, NaN without one; noise: standard deviation of a reading; clipped: conditions, by
    number, in which it cannot follow.
    """

    sensor: str
    measures: str
    unit: str
    least: float
    most: float
    share: float
    steps: float
    noise: float
    clipped: tuple[int, ...]


@dataclass(frozen=True)
class Forecast:
    """What a condition will come to. model: efficiency of the model, NaN if it has none; measured: as the sensors will
    tell it, None if they do not tell both powers."""

    case: Case
    model: float
    measured: Efficiency | None

    @property
    def bias(self) -> float:
        """How far the sensors are off without any random error: by their bandwidth, their pulses, or by clipping."""
        return self.measured.value - self.model if self.measured else float("nan")

    @property
    def dominant(self) -> str:
        """The channel, or the source of one channel, that most of the uncertainty comes from, with its share of u²."""
        if self.measured is None or not self.measured.uncertainty > 0:
            return ""
        largest = max(self.measured.contributions, key=lambda one: one.effect)
        part = largest.effect / self.measured.uncertainty
        share = part * part
        source = {"repeatability": "noise"}.get(largest.source, largest.source)
        return f"{largest.channel} {source} {100 * share:.0f}\N{NO-BREAK SPACE}%"


@dataclass(frozen=True)
class RigPlan:
    """What to expect of a rig: sensor by sensor, condition by condition, and what is to be thought about."""

    sensors: tuple[Expected, ...]
    conditions: tuple[Forecast, ...]
    findings: tuple[Finding, ...]


@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN or infinite
def plan(observation: Observation) -> RigPlan:
    """What to expect of the sensors of an observation, and of the efficiency in each of its conditions."""
    expected: dict[str, list[tuple[int, float, float, bool]]] = {name: [] for name in observation.channels}
    forecasts = []
    for case in observation.cases:
        steady = _steady(observation, case)
        for i, (name, channel) in enumerate(observation.channels.items()):
            true = case.true.values[i]
            beyond = bool(np.max(np.abs(true)) > channel.limit)
            expected[name].append((case.number, float(np.min(steady[name])), float(np.max(steady[name])), beyond))
        forecasts.append(_forecast(observation, case, steady))
    sensors = tuple(_expected(observation, name, rows) for name, rows in expected.items())
    return RigPlan(sensors, tuple(forecasts), tuple(_findings(sensors, forecasts)))


def _steady(observation: Observation, case: Case) -> dict[str, Array]:
    """Readings of whole cycles without random errors, in their units; of several cycles without the first, in which a
    sensor comes to its steady state."""
    found = observation.perfect(case)
    cycle = case.run.cycle.duration * observation.rate
    turns = observation.rig.schedule.turns
    low = case.before + case.first + (round(cycle) if turns > 1 else 0)
    high = case.before + case.first + max(round(turns * cycle), 2)
    return {name: values[low:high] for name, values in found.items()}


def _forecast(observation: Observation, case: Case, steady: dict[str, Array]) -> Forecast:
    courses = {}
    noise = {}
    turns = observation.rig.schedule.turns
    for name, channel in observation.channels.items():
        accuracy = observation.accuracy(name)
        carried = channel.noise > channel.step / 2  # over the steps of the converter
        step = Accuracy(accuracy.zero, accuracy.gain, 0.0 if carried else channel.step)
        values = steady[name] / channel.per
        courses[name] = Signal(name, channel.measures, channel.unit, values[None, :], step)
        variance = channel.noise * channel.noise + (channel.step * channel.step / 12 if carried else 0.0)
        readings = max(turns * case.run.cycle.duration * observation.rate, 1.0)
        noise[name] = math.sqrt(variance / readings)
    count = len(next(iter(steady.values())))
    condition = Condition(case.name, {}, np.arange(count) / count, courses)
    joints = load_joints(observation.mechanism)
    if pairs_of(condition, joints) is None:
        return Forecast(case, case.efficiency, None)
    return Forecast(case, case.efficiency, efficiency_of(condition, joints, noise))


def _expected(observation: Observation, name: str, rows: list[tuple[int, float, float, bool]]) -> Expected:
    channel = observation.channels[name]
    least, most = min(row[1] for row in rows), max(row[2] for row in rows)
    per = abs(channel.per)
    limit = channel.limit * per
    share = max(abs(least), abs(most)) / limit if math.isfinite(limit) else float("nan")
    steps = (most - least) / (channel.step * per) if channel.step else float("nan")
    clipped = tuple(row[0] for row in rows if row[3])
    return Expected(name, channel.measures, channel.reading, least, most, share, steps, channel.noise * per, clipped)


def _findings(sensors: tuple[Expected, ...], forecasts: list[Forecast]) -> Iterator[Finding]:
    """What to think about before the rig is built."""
    for one in sensors:
        where = f"sensors.{one.sensor}"
        if one.share < SMALL_RANGE:
            what = f"the readings use {100 * one.share:.2g} % of the range: errors in % of full scale dominate"
            remedy = "use a sensor with a smaller range"
            yield Finding.note("rig.range_wide", f"{where}.range", what, remedy, percent=100 * one.share)
        if 0 < one.steps < FEW_STEPS:
            what = f"the readings cover only {one.steps:.3g} steps of the converter"
            remedy = "use a converter with more bits, or a smaller span"
            yield Finding.note("rig.steps_few", f"{where}.bits", what, remedy, steps=one.steps)
    measured = [one for one in forecasts if one.measured]
    off = [one for one in measured if one.measured and abs(one.bias) > one.measured.uncertainty]
    if off:
        worst = max(off, key=lambda one: abs(one.bias))
        what = f"in {len(off)} of {counted(len(measured), 'condition')} the bias of the efficiency exceeds its "
        what += f"standard uncertainty, at most {worst.bias:+.2g} in condition {worst.case.number}: the sensors "
        what += "are too slow for the cycle, or clipped"
        remedy = "use sensors with a larger bandwidth or range, more pulses, or a lower speed"
        figures = {"count": len(off), "of": len(measured), "condition": worst.case.number, "bias": worst.bias}
        yield Finding.warning("rig.biased", "sensors", what, remedy, **figures)
    if not measured:
        what = "the sensors do not measure input and output power: no efficiency is predicted"
        remedy = "measure effort: and rate: of the driver, load: of a load on a joint and rate: of that joint"
        yield Finding.note("rig.no_efficiency", "sensors", what, remedy)
