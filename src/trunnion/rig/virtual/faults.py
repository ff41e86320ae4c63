"""What goes wrong on rigs, put into readings on request: for training and for tests of what reads them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding
from trunnion.rig.reading.rig_file import Fault, Rig
from trunnion.rig.reading.sensor_quantity import Amount, alike, dimensions
from trunnion.rig.virtual.sensors import SensorChannel, stream

__all__ = ["faulty", "misfits"]

Columns = dict[str, NDArray[Any]]


def misfits(rig: Rig, channels: Mapping[str, SensorChannel]) -> Iterator[Finding]:
    """Sizes of faults that are in no unit of the sensors they befall."""
    for number, fault in enumerate(rig.faults):
        for name in _befallen(fault, rig) if fault.by else ():
            if name in channels and fault.by and _size(fault.by, channels[name]) is None:
                unit = channels[name].unit
                what = f"'{fault.by.source}' is not in {unit}, which {name} measures, nor in its reading"
                yield Finding(what, f"faults.{number}.by", f"state it in {unit}, and one fault for each unit")


def _befallen(fault: Fault, rig: Rig) -> tuple[str, ...]:
    return fault.sensors or tuple(rig.sensors)


def _size(by: Amount, channel: SensorChannel) -> float | None:
    """The size of a fault in the unit of the readings; None if it has another."""
    if by.plain or alike(by.dimensions, dimensions(channel.unit)[1]):
        return by.value * channel.per
    factor, of_reading = dimensions(channel.reading)
    return by.value / factor if alike(by.dimensions, of_reading) else None


def faulty(
    columns: Columns, rig: Rig, channels: Mapping[str, SensorChannel], condition: int, seed: int, rate: float
) -> Columns:
    """The columns of one condition with the faults of the rig that befall it, in the order of the file.

    Empty cells are NaN; rows of a gap are missing.
    """
    lost = np.zeros(len(columns[rig.time.column]), bool)
    found = dict(columns)
    for number, fault in enumerate(rig.faults):
        if fault.conditions and condition not in fault.conditions:
            continue
        if fault.kind == "gap":
            lost |= _between(fault, len(lost), rate)
        elif fault.kind == "lost-pulses":
            assert rig.encoder is not None  # checked when the file is read
            random = stream(seed, condition, f"{number}", fault.kind)
            found[rig.encoder.column] = _without(found[rig.encoder.column], _share(fault), rig.encoder.kind, random)
        else:
            for name in _befallen(fault, rig):
                channel = channels[name]
                random = stream(seed, condition, f"{number}.{name}", fault.kind)
                found[channel.column] = _befall(found[channel.column], fault, channel, rate, random)
    return {name: values[~lost] for name, values in found.items()} if np.any(lost) else found


def _befall(
    values: NDArray[Any], fault: Fault, channel: SensorChannel, rate: float, random: np.random.Generator
) -> NDArray[Any]:
    """One fault of one sensor."""
    by = (_size(fault.by, channel) or 0.0) if fault.by else 0.0
    match fault.kind:
        case "wrong-sign":
            return -values + 0.0
        case "drift":
            moved = values + np.linspace(0.0, by, len(values))
            step = channel.step * channel.per
            return np.round(np.rint(moved / step) * step if step else moved, channel.decimals) + 0.0
        case "dropouts":
            starts = random.random(len(values)) < _share(fault) / fault.length
            hit = np.convolve(starts, np.ones(fault.length))[: len(values)] > 0
            return np.where(hit, np.nan, values)
        case "spikes":
            hit = random.random(len(values)) < _share(fault)
            sign = np.where(random.random(len(values)) < 0.5, -by, by)
            return np.round(values + np.where(hit, sign, 0.0), channel.decimals) + 0.0
        case _:  # stuck
            inside = np.flatnonzero(_between(fault, len(values), rate))
            found = values.copy()
            found[inside] = values[inside[0]] if len(inside) else 0.0
            return found


def _share(fault: Fault) -> float:
    return float(fault.share.evaluate()) if fault.share else 0.0


def _between(fault: Fault, count: int, rate: float) -> NDArray[np.bool_]:
    """Samples within the times of a fault."""
    start, end = (float(one.evaluate()) if one else 0.0 for one in (fault.start, fault.end))
    time = np.arange(count) / rate
    return (time >= start) & (time < end)


def _without(signal: NDArray[Any], share: float, kind: str, random: np.random.Generator) -> NDArray[Any]:
    """Pulses of an encoder with a share of them lost."""
    steps = np.diff(signal, prepend=signal[:1])
    if kind == "count":
        gone = (random.random(len(signal)) < share) * steps
        return signal - np.cumsum(gone)
    number = np.cumsum(steps > 0)
    gone = random.random(int(number[-1]) + 1) < share
    return np.where(gone[number], 0, signal)
