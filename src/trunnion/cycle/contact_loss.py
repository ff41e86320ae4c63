"""Where a pin loses contact: the load of an end passes through zero, and its seat has to jump across the hole.

The massless-link model of play keeps the pin at the wall of its hole. That ends where the load vanishes or turns round,
which the courses of the loads without play say whatever the positions are; where the load of a pin that travels points
away from its wall; and where a seat does not settle, since there the load changes more by the seat than it presses.
Beside it the figure of a zero-clearance analysis that S. W. E. Earles and C. L. S. Wu (Predicting the occurrence of
contact loss and impact at a bearing from a zero-clearance analysis, Proc. 4th World Congress on the Theory of Machines
and Mechanisms, 1975, 1013-1018) found to tell impact: rate of turn of the reaction over its size, from about
1 rad/(N s) on. It is empirical, and has a unit.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, Status
from trunnion.results.sentences import finding_for
from trunnion.solve.end_loads import NO_LOAD, Crossing, EndLoads
from trunnion.solve.memory import CHUNK
from trunnion.solve.run import Run
from trunnion.solve.seating import ROUNDS, UNSETTLED, Seating
from trunnion.solve.system import Dial

__all__ = ["EARLES_WU", "find", "findings"]

EARLES_WU = 1.0  # rad/(N s)
MOST_PLACES = 6  # named in one finding
APART = 2e-3  # of the cycle: times of lifting off that are nearer to each other are told as one
INSIDE = 1e-9  # of the cycle: positions at the ends of a time belong to it
ENDS = ("", " (end 1)", " (end 2)", " (along its axis)")

Array = NDArray[np.float64]
Arrays = dict[str, Array]


def find(arrays: Arrays, seating: Seating, time: Array) -> None:
    """Write the losses of contact of joints that their loads seat into `contact_lost`, the status and the numbers."""
    run, loads, status = seating.run, seating.loads, arrays["status"]
    for first in range(0, len(time), CHUNK):
        window = slice(first, min(first + CHUNK, len(time)))
        _fill_numbers(arrays["contact_loss_number"][:, window], loads, time[window])
    joints, duration, lost = list(run.system.joints), run.cycle.duration, arrays["contact_lost"]
    step = time[1] - time[0] if len(time) > 1 else 0.0
    for halt in seating.halts:
        lost[joints.index(halt.joint), (halt.low <= time) & (time < halt.high)] = 1
    times = [(cross.end, cross.low, cross.time, cross.high) for cross in loads.passages]
    for end, low, middle, high in times + [(end, low, low, high) for end, low, high in loads.idle]:
        row, away = joints.index(end.seat.joint), np.abs(time - middle)
        away = np.minimum(away, duration - away) if run.cycle.periodic else away
        lost[row, (time >= low - INSIDE * duration) & (time <= high + INSIDE * duration)] = 1
        if np.min(away) <= (0.5 + INSIDE) * step:  # the position next to it, if it lies between two
            lost[row, np.argmin(away)] = 1
    late = np.flatnonzero((seating.states(time) == UNSETTLED) & (status != Status.ZERO_SLIP))
    if len(late):  # of the joint whose end bears least
        rows = [joints.index(seat.joint) for seat in run.seats if seat.given is None]
        sizes = np.sqrt(np.sum(arrays["end_force"][rows][..., late] ** 2, axis=2))
        least = np.argmin(np.nan_to_num(np.min(np.where(np.isfinite(sizes), sizes, np.inf), axis=1)), axis=0)
        lost[np.array(rows)[least], late] = 1
    lost[:, status >= Status.NOT_CONVERGED] = 0
    anywhere = np.any(lost > 0, axis=0)
    np.maximum(status, np.where(anywhere, status.dtype.type(Status.CONTACT_LOST), status.dtype.type(0)), out=status)


def _fill_numbers(numbers: Array, loads: EndLoads, time: Array) -> None:
    """The figure of Earles and Wu, |F × Ḟ|/|F|³, rad/(N s), of every joint: of its reaction without play, in space of
    the force on an end."""
    forces, rates = loads.courses.at(time), loads.rates.at(time)
    for number, vectors in zip(numbers, loads.vectors, strict=True):
        for rows in vectors:
            force, rate = forces[rows], rates[rows]
            square = np.sum(force * force, axis=0)
            with np.errstate(all="ignore"):
                across = np.linalg.norm(rate - force * (np.sum(force * rate, axis=0) / square), axis=0)
                pressed = np.sqrt(square) > NO_LOAD * loads.largest
                number[...] = np.fmax(number, np.where(pressed, across / square, np.nan))


# ---- what is told of it -----------------------------------------------------------------------------------------


def findings(arrays: Arrays, seating: Seating, time: Array, dial: Dial) -> Iterator[Finding]:
    """One finding for all joints that lose contact at the same places, and for those that nothing presses."""
    run, loads, joints = seating.run, seating.loads, list(seating.run.system.joints)
    yield from _unloaded(loads)
    lost: dict[tuple[str, str], list[str]] = {}
    lifted: dict[tuple[str, str], list[str]] = {}
    for seat in run.seats:
        joint, part = seat.joint, "pin" if any(len(end) > 1 for end in seat.play.model.ends) else "slider"
        crossings = [cross for cross in loads.passages if cross.end.seat.joint == joint]
        halts = [
            (halt.low, halt.high) for halt in seating.halts
            if halt.joint == joint and not any(halt.low <= cross.high and cross.low <= halt.high for cross in crossings)
        ]  # fmt: skip
        if crossings:
            at = _listed([f"at {_at(run, cross.time)}{ENDS[cross.end.place]}" for cross in crossings])
            lost.setdefault((part, at), []).append(joint)
        elif seat.given is None and loads.largest > 0 and all(end.seat.joint != joint for end, _ in loads.pressed):
            yield finding_for("seat.unloaded", f"joints.{joint}", part=part)
        if halts:
            places = [_between(run, *span) for span in _joined(halts, APART * run.cycle.duration)]
            lifted.setdefault((part, _listed(places)), []).append(joint)
    for (part, at), names in lost.items():
        numbers = arrays["contact_loss_number"][[joints.index(name) for name in names]]
        crossings = [cross for cross in loads.passages if cross.end.seat.joint in names]
        yield _lost(names, crossings, part, at, numbers, dial)
    for (part, at), names in lifted.items():
        yield finding_for("contact.lifted", f"joints.{', '.join(names)}", part=part, at=at, count=len(names))
    unsettled = (arrays["contact_lost"] > 0) & (seating.states(time) == UNSETTLED)
    for i in np.flatnonzero(np.any(unsettled, axis=1)):
        at, change = dial.intervals(np.flatnonzero(unsettled[i])), np.max(arrays["seat_change"][unsettled[i]])
        yield finding_for("seat.unsettled", f"joints.{joints[i]}", rounds=ROUNDS, at=at, change=change)


def _unloaded(loads: EndLoads) -> Iterator[Finding]:
    """The joints that bear no load over a range, with the end that does not where the other does."""
    ranges: dict[str, dict[str, str]] = {}
    for end, low, high in loads.idle:
        ends = ranges.setdefault(_between(loads.run, low, high), {})
        ends[end.seat.joint] = "" if end.seat.joint in ends else ENDS[end.place]
    for text, ends in ranges.items():
        yield finding_for("contact.unloaded", "joints", joints=[name + end for name, end in ends.items()], at=text)


def _lost(
    names: Sequence[str], crossings: Sequence[Crossing], part: str, at: str, numbers: Array, dial: Dial
) -> Finding:
    """Of joints that lose contact at the same places: the load of that where it falls nearest to zero of its peak.

    numbers: of Earles and Wu, (joint, position).
    """
    nearest = min(crossings, key=lambda cross: cross.least / cross.peak)
    least = nearest.least if nearest.least > NO_LOAD * nearest.peak else 0.0  # less than that is rounding
    number, turning = None, ""
    if part == "pin" and np.any(np.isfinite(numbers)):  # the load of a slider has no direction that can turn
        number = np.nanmax(numbers)
        turning = f"at {dial.at(int(np.nanargmax(numbers)) % numbers.shape[1])}"
    return finding_for(
        "contact.lost", f"joints.{', '.join(names)}", part=part, least=least, peak=nearest.peak, at=at,
        likely=EARLES_WU, number=number, turning=turning, count=len(names),
    )  # fmt: skip


def _joined(spans: Sequence[tuple[float, float]], apart: float) -> list[tuple[float, float]]:
    """Times from and to, s, in their order; those that are hardly apart as one."""
    joined: list[tuple[float, float]] = []
    for low, high in sorted(spans):
        if joined and low - joined[-1][1] <= apart:
            joined[-1] = joined[-1][0], max(joined[-1][1], high)
        else:
            joined.append((low, high))
    return joined


def _listed(places: Sequence[str]) -> str:
    more = len(places) - MOST_PLACES
    return ", ".join(places[:MOST_PLACES]) + (f" and {more} more" if more > 0 else "")


def _between(run: Run, low: float, high: float) -> str:
    """A time, s, from and to, as positions are named."""
    first, last = _at(run, low), _at(run, high)
    return f"at {first}" if first == last else f"between {first} and {last}"


def _at(run: Run, time: float) -> str:
    """A time, s, as positions are named."""
    return run.system.dial(run.values, np.array([time, run.cycle.duration])).at(0)
