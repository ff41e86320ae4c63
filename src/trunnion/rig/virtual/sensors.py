"""Sensors of a virtual rig: from the true course to the readings in a file.

In order: pulses (of a speed told by them), first-order low-pass, gain, zero and drift, noise, clipping at the range,
steps of the converter. All is worked out in the SI unit of what is measured; a reading is that times one factor.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError
from trunnion.model.measure_table import MEASURES
from trunnion.model.units import UnitError
from trunnion.rig.reading.units import SensorScale, alike, dimensions, multiplied
from trunnion.rig.reading.units import scale as scale_of
from trunnion.rig.virtual.rig_file import Sensor

__all__ = ["SensorChannel", "SensorErrors", "converted", "draw", "pulsed", "pulses", "readings", "resolved", "stream"]

Array = NDArray[np.float64]
READINGS = ("V", "A", "Hz")  # what the reading of a sensor with a sensitivity may be in
FINE = 1e-3  # of a step of the converter, or of the noise: decimals of a reading beyond are not written


@dataclass(frozen=True)
class SensorChannel:
    """A sensor put to a mechanism: its numbers in the SI unit of what it measures.

    sensor: as in the file; unit: SI, of what is measured; reading: unit of the file; per: readings per SI unit, below 0
    where the sensitivity is; range and span: inf without one; zero: standard uncertainty while it runs; offset: of what
    it reads at rest; drift: per second.
    """

    name: str
    sensor: Sensor
    column: str
    unit: str
    reading: str
    per: float
    range: float
    span: float
    noise: float
    offset: float
    zero: float
    drift: float

    @property
    def gain(self) -> float:
        """Its standard uncertainty, relative."""
        return self.sensor.accuracy.gain.value

    @property
    def step(self) -> float:
        """Of its converter; 0 without one."""
        return 2 * self.span / 2**self.sensor.bits if self.sensor.bits else 0.0

    @property
    def at_rest(self) -> bool:
        """Whether it reads zero in an idle machine: what it measures is a force, a torque or a speed."""
        kind = MEASURES.get(self.sensor.measures.partition(":")[0])
        return kind is not None and kind.at_rest

    @property
    def zeroed(self) -> bool:
        """Whether its zero is taken from an idle stretch: pulses have none."""
        return self.at_rest and not self.sensor.per_turn

    @property
    def limit(self) -> float:
        """Largest magnitude that it can tell."""
        return min(self.range, self.span)

    @property
    def decimals(self) -> int:
        """Of a reading in its unit, so that what is left out is nothing beside step and noise."""
        least = min((item for item in (self.step, self.noise) if item > 0), default=0.0) * abs(self.per) * FINE
        step = self.limit * abs(self.per) * 1e-9 if math.isfinite(self.limit) else 1e-9
        return int(np.clip(-math.floor(math.log10(least or step)), 0, 15))


@dataclass(frozen=True)
class SensorErrors:
    """The errors that a sensor has in fact: gain, relative; zero while it runs and offset, in the unit measured."""

    gain: float
    zero: float
    offset: float


def stream(seed: int, condition: int, name: str, purpose: str) -> np.random.Generator:
    """Random numbers of their own for each condition, sensor and purpose: the same seed, the same bits.

    Whatever else is added to the rig, they stay. condition: 0 of what all have in common.
    """
    key = (condition, crc32(name.encode()), crc32(purpose.encode()))
    return np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=key)))


def draw(channel: SensorChannel, seed: int) -> SensorErrors:
    """The actual errors of a sensor, normal with the stated standard uncertainties; the same in all conditions."""
    normal = stream(seed, 0, channel.name, "accuracy").standard_normal(3)
    return SensorErrors(*(float(row) + 0.0 for row in normal * (channel.gain, channel.zero, channel.offset)))


# ---- what is stated, in one unit ------------------------------------------------------------------------------


def resolved(name: str, sensor: Sensor, column: str, unit: str) -> SensorChannel:
    """A sensor of what is measured in an SI unit; MechanismError for quantities that do not fit it."""
    try:
        reading, scale = _scale(sensor, unit)
    except UnitError as error:
        where = f"sensors.{name}.{'sensitivity' if sensor.sensitivity else 'unit'}"
        raise MechanismError(Finding(error.what, where, error.remedy)) from None
    amounts = {"range": sensor.range, "span": sensor.span or sensor.range, "noise": sensor.noise,
               "offset": sensor.offset, "accuracy.zero": sensor.accuracy.zero, "drift": sensor.drift}  # fmt: skip
    sizes, findings = dict.fromkeys(amounts, math.inf), list[Finding]()
    for key, amount in amounts.items():
        if amount is None or (key == "span" and not sensor.bits):
            continue
        over = "/s" * (key == "drift")  # which has a sign; others have none
        per_second = replace(amount, dimensions=multiplied(amount.dimensions, {"s": Fraction(bool(over))}))
        factor = scale.factor if over else abs(scale.factor)
        try:  # of what is measured, or of the readings
            sizes[key] = amount.value if amount.plain else factor * scale.reading(per_second, "zero" if over else key)
        except UnitError:
            units = " or as a reading in ".join(dict.fromkeys(f"{item}{over}" for item in (unit, reading)))
            findings.append(Finding(f"'{amount.source}' is not in {units}", f"sensors.{name}.{key}"))
    if findings:
        raise MechanismError(findings)
    return SensorChannel(name, sensor, column, unit, reading, 1 / scale.factor, *sizes.values())


def _scale(sensor: Sensor, unit: str) -> tuple[str, SensorScale]:
    """Unit of the reading, and how readings become what is measured."""
    sensitivity = sensor.sensitivity
    if sensor.unit or sensitivity is None:
        readings = [sensor.unit or unit]
        dimensions(readings[0])
    else:  # `mV` of `mV/(N m)`, `V` of `N m/V`
        first, last = sensitivity.unit.partition("/")[0].strip(), sensitivity.unit.rpartition("/")[2].strip("() ")
        readings = [first, last, *READINGS]
    for reading in filter(None, readings):
        with suppress(UnitError):
            of_sensor = scale_of(sensor.measures, reading, sensitivity)
            if alike(of_sensor.of_quantity, dimensions(unit)[1]):
                return reading, of_sensor
    if sensitivity is None:
        remedy = f"state a unit of {unit}, or the sensitivity: 100 mV/({unit})"
        raise UnitError(f"'{readings[0]}' does not measure a quantity in {unit}", remedy)
    what = f"'{sensitivity.source}' does not turn {unit} into {sensor.unit or 'a reading in volt, ampere or hertz'}"
    raise UnitError(what, f"write a reading per {unit}, such as 100 mV/({unit}), and the `unit` of the reading")


# ---- readings -------------------------------------------------------------------------------------------------


def smoothed(true: Array, bandwidth: float, rate: float) -> Array:
    """A first-order low-pass of this bandwidth, Hz, exact for what runs straight between samples; at rest before."""
    from scipy.signal import lfilter  # brings scipy.stats: longer to import than all the rest

    step = 2 * np.pi * bandwidth / rate  # h/τ
    decay = math.exp(-step)
    last = 1 - (1 - decay) / step
    start = np.array([(1 - last) * true[0]])  # as if it had always been at its first value
    return np.asarray(lfilter([last, 1 - decay - last], [1.0, -decay], true, zi=start)[0])


def pulsed(true: Array, running: slice, per_turn: int, rate: float) -> Array:
    """A speed as worked out from recorded pulses: the pitch over the time from one to the next, at the middle between
    them, and straight in between; before the first and after the last pulses as there."""
    part = np.abs(true[running])
    turned = np.concatenate([[0.0], np.cumsum((part[1:] + part[:-1]) / (2 * rate))])
    pitch = 2 * np.pi / per_turn
    count = int(turned[-1] / pitch) + 1
    counts = true.copy()
    if count < 2:
        counts[running] = 0.0
        return counts
    time = np.arange(len(part)) / rate
    passed = np.interp(pitch * np.arange(count), turned, time)
    speeds = np.interp(time, (passed[1:] + passed[:-1]) / 2, pitch / np.diff(passed))
    counts[running] = speeds * np.sign(true[running][len(part) // 2])
    return counts


def readings(
    channel: SensorChannel, true: Array, running: slice, rate: float, drawn: SensorErrors, noise: Array | None
) -> Array:
    """What a sensor makes of a true course, in the unit of its readings.

    true: in SI at the samples, the idle stretch included; running: those in which the machine runs; noise: standard
    normal numbers, None without.
    """
    sensor, value = channel.sensor, true
    if sensor.per_turn:
        value = pulsed(value, running, sensor.per_turn, rate)
    if sensor.bandwidth:
        value = smoothed(value, sensor.bandwidth.value, rate)
    value = value * (1 + drawn.gain) + drawn.offset
    value[running] += drawn.zero
    if channel.drift:
        value += channel.drift / rate * np.arange(len(value))
    if noise is not None and channel.noise:
        value += channel.noise * noise
    return converted(channel, value)


def converted(channel: SensorChannel, value: Array) -> Array:
    """Clipped, in steps, in the unit of the reading, with the decimals that a file has."""
    value, step = np.clip(value, -channel.range, channel.range), channel.step
    if step:  # the upper end of a converter is one step short
        sense = math.copysign(1.0, channel.per)
        value = sense * np.clip(np.rint(sense * value / step) * step, -channel.span, channel.span - step)
    return np.round(value * channel.per, channel.decimals) + 0.0  # + 0.0: no negative zero


def pulses(angle: Array, per_turn: int) -> tuple[NDArray[np.int64], Array]:
    """Running count of an encoder at the coordinates (rad) of the driver, and the part of the pulse that has passed.

    Its level is high in the first half of each pulse, its index for the first pulse of each turn.
    """
    passed = angle * (per_turn / (2 * np.pi)) + 1e-9
    count = np.floor(passed)
    return count.astype(np.int64), np.asarray(passed - count)
