"""Where a free motion begins, between which coordinates it may go, and where forces jump or bend on its way."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import single
from trunnion.dynamics.rates import Layout
from trunnion.dynamics.state import FreeMotion
from trunnion.solve.switches import Mechanisms, bends

Array = NDArray[np.float64]

SCANNED = 4001  # times at which ends of loads are looked for: most are linear in the time, and found exactly
CLOSE = 1e-9  # of the way: bends that are one
CYCLES = 10  # of the nominal motion: the duration if none is stated


@dataclass(frozen=True)
class Places:
    """Coordinates of the one free driver at which a force jumps or bends, and the period after which they come again.

    limits: coordinates between which free drivers may move, by name; meetings: coordinates at which two assemblies of a
    module meet and the motion ends, with its number; they are among the bends.
    """

    bends: tuple[float, ...] = ()
    period: float | None = None
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    meetings: tuple[tuple[float, int], ...] = ()


def initial_row(motion: FreeMotion) -> Array:
    """The state at the start: coordinates and speeds as stated, else at rest where the driver starts."""
    values, layout = motion.values, Layout.of(motion)
    row = np.zeros(layout.size)
    for i, name in enumerate(motion.names):
        path = f"drivers.{name}"
        begin = motion.system.mechanism.drivers[name].motion.function(0.0, motion.system.motion_of(values, name)).value
        row[i] = single(values.get(f"{path}.initial.coordinate", begin))
        row[layout.coordinates + i] = single(values.get(f"{path}.initial.speed", 0.0))
    return row


def times_of_loads(motion: FreeMotion, duration: float) -> list[float]:
    """Times, s, at which loads that vary with the time jump or bend: ends of a `between`, points of a table."""
    mechanism = motion.system.mechanism
    instants, grid = list[float](), np.linspace(0.0, duration, SCANNED)
    for name, table in mechanism.tables.items():
        if table.over == "time":
            knots = np.array([single(motion.values[f"tables.{name}.points.{k}.at"]) for k in range(len(table.points))])
            period = single(motion.values.get(f"tables.{name}.period", knots[-1] - knots[0]))
            laps = np.arange(int(duration / period) + 2) * period if table.repeats and period > 0 else np.zeros(1)
            instants += list((knots + laps[:, None]).ravel())
    for entry in mechanism.parameter_set.entries.values():
        if not entry.varies or entry.quantity.expression is None or "time" not in entry.quantity.names:
            continue
        sizes = [name for name in entry.quantity.names if name in mechanism.dimensions]
        dimensions = {name: motion.values[f"dimensions.{name}"] for name in sizes}
        for kink in entry.quantity.expression.kinks:
            try:
                level = np.broadcast_to(np.asarray(kink({**dimensions, "time": grid}), float), grid.shape)
            except KeyError:  # it depends on the motion as well
                continue
            k = np.flatnonzero(np.diff(np.sign(level)) != 0)
            instants += list(grid[k] - level[k] * (grid[k + 1] - grid[k]) / (level[k + 1] - level[k]))
    return instants


def places(motion: FreeMotion, drivers: Collection[str] | None = None) -> Places:
    """Of one free driver that alone moves the mechanism; of several, ranges alone are known beforehand. drivers: those
    whose ranges count, all if not given."""
    if len(motion.system.mechanism.drivers) != 1:
        limits = {}
        for name in motion.names:
            ends = [motion.values.get(f"drivers.{name}.range.{end}") for end in ("from", "to")]
            if None not in ends and (drivers is None or name in drivers):
                limits[name] = min(map(single, ends)), max(map(single, ends))
        return Places(limits=limits)
    run, cycle, (name,) = motion.run, motion.run.cycle, motion.names
    nominal = motion.system.mechanism.drivers[name].motion.function(0.0, motion.system.motion_of(run.values, name))
    begin, speed = single(nominal.value), single(nominal.rate)
    meetings = [
        (time, module)
        for module, each in run.chosen.meetings.items()
        if not motion.passes(module)
        for meeting in each.at
        for time in sorted(set(meeting))
    ]
    met = tuple((begin + speed * time, module) for time, module in meetings)
    (stated,) = bends(Mechanisms(run.system, run.chosen.assembly, run.values, [cycle]))
    times = np.array([*(bend.time for bend in stated), *(time for time, _ in meetings)])
    coordinates, span = begin + speed * times, abs(speed) * cycle.duration
    if cycle.periodic:
        return Places(_apart(np.mod(coordinates, span), span), span, {name: (-np.inf, np.inf)}, met)
    low, high = sorted((begin, begin + speed * cycle.duration))
    inside = coordinates[(coordinates > low) & (coordinates < high)]
    return Places(_apart(inside, span), None, {name: (low, high)}, met)


def _apart(coordinates: Array, span: float) -> tuple[float, ...]:
    """Rising, those that are one but for rounding taken once."""
    ordered = np.sort(coordinates)
    return tuple(
        float(coordinate)
        for coordinate in ordered[np.append(True, np.diff(ordered) > CLOSE * abs(span))[: len(ordered)]]
    )
