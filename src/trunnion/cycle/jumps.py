"""Forces beside a jump, of a load or of friction: their extremes are at the jump itself, between two positions.

Where a drive effort is largest or least at a position and drops at once beside it, both sides of every place at which
the model switches there (`switches`) count as positions too. Pins in seats move such places: there it is only said.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.positions import Positions, stretch
from trunnion.errors import Finding, Status
from trunnion.results.sentences import finding_for
from trunnion.solve.run import Run
from trunnion.solve.system import Cycle

__all__ = ["beside", "dropping", "findings", "sides"]

Array = NDArray[np.float64]
FEWEST = 12  # positions among which a jump can be told from a slope
JUMP = 0.2  # of the largest effort: what drops by more beside it may be a jump
SIDE = 1e-9  # of the cycle: from the place of a jump to its sides
MOVED = 3  # steps by which pins in their seats may move a jump


def dropping(arrays: Mapping[str, NDArray[Any]], closed: bool) -> NDArray[np.bool_]:
    """Whether a drive effort drops from its largest or least value in the gap after each position, (…, position).

    arrays: `drive_effort` (driver, …, position) and `status`; closed: whether the first position comes after the last.
    """
    status, effort = arrays["status"], arrays["drive_effort"]
    count, gaps = status.shape[-1], np.zeros(status.shape, bool)
    if count < FEWEST:
        return gaps
    effort = np.where(status == Status.SOLVED, effort, np.nan)
    ends = np.stack([effort, -effort])
    top = np.argmax(np.where(np.isnan(ends), -np.inf, ends), axis=-1)[..., None]
    before, value, after = (np.take_along_axis(ends, (top + k) % count, -1) for k in (-1, 0, 1))
    scale = JUMP * np.fmax.reduce(np.abs(effort), axis=-1, initial=0.0)[..., None]
    for low, drop, other in ((top - 1, value - before, value - after), (top, value - after, value - before)):
        there = (drop > scale) & (drop > other) & (closed | ((top > 0) & (top < count - 1)))
        for index in np.argwhere(there[..., 0]):
            gaps[(*index[2:], int(low[(*index, 0)]) % count)] = True
    return gaps


def beside(gaps: NDArray[np.bool_], time: Array, edges: Array, cycle: Cycle) -> Array:
    """Times, s, rising, on both sides of the edges in some gaps, (position,), of equally spaced times."""
    starts, step, slack = time[gaps], time[1] - time[0], SIDE * cycle.duration
    within = np.mod(edges[:, None] - starts + slack, cycle.duration) <= step + 2 * slack
    found = (edges[np.any(within, axis=1)][:, None] + slack * np.array([-1.0, 1.0])).ravel()
    if cycle.periodic:
        return np.unique(found % cycle.duration)
    return found[(found >= 0) & (found <= cycle.duration)]


def sides(run: Run, found: Positions) -> Positions | None:
    """The two sides of jumps beside which drive efforts have their extremes, as positions; None if there are none."""
    time, cycle = found.time, run.cycle
    if len(time) < FEWEST or run.seats:
        return None
    closed = cycle.periodic and bool(time[-1] - time[0] + 1.5 * (time[1] - time[0]) > cycle.duration)
    gaps = dropping(found.arrays, closed)
    times = beside(gaps, time, run.edges, cycle) if np.any(gaps) else np.zeros(0)
    if not len(times):
        return None
    method = replace(found.method, margin_up_to=0.0)
    return run.once(("sides", method, tuple(times)), lambda: stretch(run, times, method))


def findings(run: Run, time: Array, arrays: Mapping[str, NDArray[Any]], units: list[str]) -> Iterator[Finding]:
    """With pins in seats: efforts that are largest beside a jump, and how much more they may be at the jump itself."""
    if not run.seats or len(time) < FEWEST:
        return
    step = time[1] - time[0]
    for i, (name, unit) in enumerate(zip(run.system.mechanism.drivers, units, strict=True)):
        size = np.abs(arrays["drive_effort"][[i]])
        gaps = np.flatnonzero(dropping({"drive_effort": size, "status": arrays["status"]}, run.cycle.periodic))
        for low in gaps[:1]:
            away = np.mod(run.edges - time[low] + MOVED * step, run.cycle.duration)
            k, rest = (low, low - 1) if size[0, low] > size[0, (low + 1) % len(time)] else (low + 1, low + 2)
            more = size[0, k % len(time)] - size[0, rest % len(time)]
            if np.any(away <= (2 * MOVED + 1) * step):
                at = run.system.dial(run.values, time).at(int(k) % len(time))
                yield finding_for("effort.beside_jump", f"drivers.{name}", at=at, more=float(more), unit=unit)
