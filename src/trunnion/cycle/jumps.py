"""Forces beside a jump, of a load or of friction: their extremes are at the jump itself, between two positions.

Where a drive effort is largest or least at a position, or a reaction largest, and drops at once beside it, both sides
of every place at which the model switches there (`switches`) count as positions too. Pins in seats move such places:
there it is only said.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.positions import Positions, stretch
from trunnion.errors import Finding, Status
from trunnion.results.sentences import finding_for
from trunnion.solve.run import Run
from trunnion.solve.system import Cycle

__all__ = ["beside", "courses", "dropping", "findings", "moved", "sides"]

Array = NDArray[np.float64]
FEWEST = 12  # positions among which a jump can be told from a slope
JUMP = 0.2  # of the largest effort: what drops by more beside it may be a jump
SIDE = 1e-9  # of the cycle: from the place of a jump to its sides
MOVED = 3  # steps by which pins in their seats may move a jump
FEW = 8  # part of a cycle in which a moved jump is one


def dropping(courses: Array, status: NDArray[Any], closed: bool) -> NDArray[np.bool_]:
    """Whether a course drops at once from its largest value in the gap after each position, (…, position).

    courses: (course, …, position), and their statuses; closed: whether the first position comes after the last.
    """
    count, gaps = status.shape[-1], np.zeros(status.shape, bool)
    if count < FEWEST:
        return gaps
    known = np.where(status == Status.SOLVED, courses, np.nan)
    top = np.argmax(np.where(np.isnan(known), -np.inf, known), axis=-1)[..., None]
    before, value, after = (np.take_along_axis(known, (top + k) % count, -1) for k in (-1, 0, 1))
    scale = JUMP * np.fmax.reduce(np.abs(known), axis=-1, initial=0.0)[..., None]
    for low, beyond in ((top - 1, before), (top, after)):
        there = (value - beyond > scale) & (closed | ((low >= 0) & (low < count - 1)))
        for index in np.argwhere(there[..., 0]):
            gaps[(*index[1:], int(low[(*index, 0)]) % count)] = True
    return gaps


def courses(arrays: Mapping[str, NDArray[Any]]) -> Array:
    """What the extremes of a summary are of, (course, …): efforts, their negatives, and sizes of reactions."""
    efforts = arrays["drive_effort"]
    return np.concatenate([efforts, -efforts, np.sqrt(np.sum(arrays["reaction_force"] ** 2, axis=1))])


def beside(gaps: NDArray[np.bool_], time: Array, edges: Array, cycle: Cycle) -> Array:
    """Times, s, rising, on both sides of the edges in some gaps, (position,), of equally spaced times."""
    starts, step, slack = time[gaps], time[1] - time[0], SIDE * cycle.duration
    within = np.mod(edges[:, None] - starts + slack, cycle.duration) <= step + 2 * slack
    found = (edges[np.any(within, axis=1)][:, None] + slack * np.array([-1.0, 1.0])).ravel()
    if cycle.periodic:
        return np.unique(found % cycle.duration)
    return found[(found >= 0) & (found <= cycle.duration)]


def sides(run: Run, found: Positions) -> Positions | None:
    """The two sides of jumps beside which efforts or reactions have their extremes, as positions; None if there are
    none."""
    time, cycle = found.time, run.cycle
    if len(time) < FEWEST or run.seats:
        return None
    closed = cycle.periodic and bool(time[-1] - time[0] + 1.5 * (time[1] - time[0]) > cycle.duration)
    gaps = dropping(courses(found.arrays), found.arrays["status"], closed)
    times = beside(gaps, time, run.edges, cycle) if np.any(gaps) else np.zeros(0)
    if not len(times):
        return None
    method = replace(found.method, margin_up_to=0.0)
    return run.once(("sides", method, tuple(times)), lambda: stretch(run, times, method))


def findings(run: Run, time: Array, arrays: Mapping[str, NDArray[Any]], units: list[str]) -> Iterator[Finding]:
    """With pins in seats: efforts that are largest beside a jump, and how much more they may be at the jump itself."""
    if not run.seats or len(time) < FEWEST:
        return
    step, status = time[1] - time[0], arrays["status"]
    for i, (name, unit) in enumerate(zip(run.system.mechanism.drivers, units, strict=True)):
        size = np.abs(arrays["drive_effort"][[i]])
        top = int(np.argmax(np.where(status == Status.SOLVED, size[0], -1.0)))
        around = (
            (top + np.array([-1, 1])) % len(time)
            if run.cycle.periodic
            else np.clip([top - 1, top + 1], 0, len(time) - 1)
        )
        if size[0, top] > 0 and np.any(status[around] == Status.CONTACT_LOST):
            yield finding_for(
                "effort.beside_gap", f"drivers.{name}", at=run.system.dial(run.values, time).at(top), driver=name
            )
            continue
        for low in np.flatnonzero(dropping(size, arrays["status"], run.cycle.periodic)):
            away = np.mod(run.edges - time[low] + MOVED * step, run.cycle.duration)
            k, rest = (low, low - 1) if size[0, low] > size[0, (low + 1) % len(time)] else (low + 1, low + 2)
            more = size[0, k % len(time)] - size[0, rest % len(time)]
            drop = abs(size[0, low] - size[0, (low + 1) % len(time)])
            if more < drop and np.any(away <= (2 * MOVED + 1) * step):
                at = run.system.dial(run.values, time).at(int(k) % len(time))
                yield finding_for("effort.beside_jump", f"drivers.{name}", at=at, more=float(more), unit=unit)


def moved(run: Run, at: Positions, units: list[str]) -> Iterator[Finding]:
    """Changes of an effort by the errors that are a jump at another place; and the largest change elsewhere."""
    arrays, dial = at.arrays, at.dial
    if not run.erring or len(at.time) < FEWEST:
        return
    for i, (name, unit) in enumerate(zip(run.system.mechanism.drivers, units, strict=True)):
        effort = np.where(arrays["status"] < Status.CONTACT_LOST, arrays["drive_effort"][i], np.nan)
        change = arrays["drive_effort_change"][i] + 0.0 * effort
        least, rest, first = JUMP * np.fmax.reduce(np.abs(effort), initial=0.0), np.abs(change), None
        while np.fmax.reduce(rest, initial=0.0) > least:
            found = _between(effort, effort - change, int(np.nanargmax(rest)), run.cycle.periodic)
            if found is None:
                break
            first = first or found
            rest[np.arange(found.low + 1, found.high) % len(rest)] = np.nan
        if first is not None:
            gaps = [_gap(dial.at(k % len(rest)), dial.at((k + 1) % len(rest))) for k in (first.low, first.high - 1)]
            built, meant = gaps[::-1] if first.later else gaps
            yield finding_for(
                "errors.jump_moved", f"drivers.{name}", at=dial.at(first.at), built=built, meant=meant,
                rest=float(np.fmax.reduce(rest, initial=0.0)), unit=unit,
            )  # fmt: skip


def _gap(one: str, other: str) -> str:
    return f"at {one}" if one == other else f"between {one} and {other}"


class _Between(NamedTuple):
    """A position, and those before and after it up to which an effort jumps; later: whether with the errors it does so
    after it, without them before."""

    at: int
    low: int
    high: int
    later: bool


def _between(effort: Array, meant: Array, k: int, periodic: bool) -> _Between | None:
    """The two jumps, of the effort with errors and of that without, that a position is between; None if it is not."""
    count, half = len(effort), abs(effort[k] - meant[k]) / 2
    around = k + np.arange(-(count // FEW), count // FEW + 1)
    if not periodic and (around[0] < 0 or around[-1] >= count):
        return None
    effort, meant = effort[around % count], meant[around % count]
    less = np.flatnonzero(np.abs(effort - meant) < half) - count // FEW
    before, after = less[less < 0], less[less > 0]
    if not len(before) or not len(after):
        return None
    low, high = int(before[-1]), int(after[0])
    places = np.array([low, high - 1]) + count // FEW
    built, ideal = (np.abs(np.diff(one))[places] > half for one in (effort, meant))
    if built[0] == built[1] or np.any(built == ideal):
        return None
    return _Between(k, k + low, k + high, bool(built[1]))
