"""Where a pin loses contact: the load of an end passes through zero, and its seat has to jump across the hole.

The massless-link model of play keeps the pin at the wall of its hole. That ends where the load vanishes or turns round,
which the courses of the loads without play say whatever the positions are; where the load of a pin that travels points
away from its wall; and where a seat does not settle, since there the load changes more by the seat than it presses.
Beside it the figure of a zero-clearance analysis that S. W. E. Earles and C. L. S. Wu (Predicting the occurrence of
contact loss and impact at a bearing from a zero-clearance analysis, Proc. 4th World Congress on the Theory of Machines
and Mechanisms, 1975, 1013-1018) found to tell impact: rate of turn of the reaction over its size, from about 1 rad/(N s)
on. It is empirical, and has a unit.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, Status
from trunnion.results.sentences import finding_for
from trunnion.solve.end_loads import NO_LOAD, Crossing, EndLoads
from trunnion.solve.memory import CHUNK
from trunnion.solve.run import Run
from trunnion.solve.seating import ROUNDS, UNSETTLED, Halt, Seating
from trunnion.solve.system import Dial

__all__ = ["EARLES_WU", "Loss", "find", "findings"]

EARLES_WU = 1.0  # rad/(N s)
MOST_PLACES = 6  # named in one finding
INSIDE = 1e-9  # of the cycle: positions at the ends of a time in which nothing presses a pin belong to it
ENDS = ("", " (end 1)", " (end 2)", " (along its axis)")

Array = NDArray[np.float64]
Arrays = dict[str, Array]
Positions = NDArray[np.intp]


@dataclass(frozen=True)
class Loss:
    """Loss of contact of one joint.

    crossings: where its pin crosses the hole; idle: times, s, from and to, in which nothing presses an end (1, 2, 3 along
    the axis, 0 of a play that has one); unsettled: positions whose seats did not settle, where this joint bears least;
    halts: where its own travel would take more than its load; loaded: whether anything presses it at all; turns:
    whether its load has a direction that can turn, as that of a guide has not.
    """

    joint: str
    crossings: list[Crossing]
    idle: list[tuple[int, float, float]]
    unsettled: Positions
    halts: list[Halt]
    loaded: bool
    turns: bool

    @property
    def part(self) -> str:
        """What lies in the hole."""
        return "pin" if self.turns else "slider"


def find(arrays: Arrays, seating: Seating, time: Array) -> list[Loss]:
    """Losses of contact of every joint that its load seats; written into `contact_lost` and the status."""
    run, loads, status = seating.run, seating.loads, arrays["status"]
    joints, losses = list(run.system.joints), []
    for low in range(0, len(time), CHUNK):
        window = slice(low, min(low + CHUNK, len(time)))
        _fill_numbers(arrays["contact_loss_number"][:, window], loads, time[window])
    loaded = [seat for seat in run.seats if seat.given is None]
    if not loaded:
        return losses
    answered = status < Status.NOT_CONVERGED
    late = np.flatnonzero((seating.states(time) == UNSETTLED) & answered & (status != Status.ZERO_SLIP))
    least = _least_loaded(arrays["end_force"][..., late], [joints.index(seat.joint) for seat in loaded])
    for seat in loaded:
        i = joints.index(seat.joint)
        crossings = [cross for cross in loads.passages if cross.end.seat.joint == seat.joint]
        idle = [(end.place, low, high) for end, low, high in loads.idle if end.seat.joint == seat.joint]
        presses = any(end.seat.joint == seat.joint for end, _ in loads.pressed) or not loads.largest > 0
        turns = any(len(end) > 1 for end in seat.play.model.ends)
        halts = [halt for halt in seating.halts if halt.joint == seat.joint]
        loss = Loss(seat.joint, crossings, idle, late[least == i], halts, presses, turns)
        if crossings or idle or len(loss.unsettled) or halts or not presses:
            losses.append(loss)
        lifted = [np.flatnonzero((low < time) & (time < high)) for _, low, high in halts]
        lost = np.concatenate([_nearest(run, crossings, idle, time), loss.unsettled, *lifted])
        arrays["contact_lost"][i, lost[answered[lost]]] = 1
    anywhere = np.any(arrays["contact_lost"] > 0, axis=0)
    np.maximum(status, np.where(anywhere, status.dtype.type(Status.CONTACT_LOST), status.dtype.type(0)), out=status)
    return losses


def _nearest(
    run: Run, crossings: Sequence[Crossing], idle: Sequence[tuple[int, float, float]], time: Array
) -> Positions:
    """Positions within the crossings and the times without a load, or if there are none in one that next to it."""
    duration, step = run.cycle.duration, time[1] - time[0] if len(time) > 1 else 0.0
    found = []
    for low, middle, high in [(c.low, c.time, c.high) for c in crossings] + [(a, a, b) for _, a, b in idle]:
        away = np.abs(time - middle)
        away = np.minimum(away, duration - away) if run.cycle.periodic else away
        found.append(np.flatnonzero((time >= low - INSIDE * duration) & (time <= high + INSIDE * duration)))
        if not len(found[-1]) and np.min(away) <= (0.5 + INSIDE) * step:
            found.append(np.array([np.argmin(away)]))
    return np.concatenate([*found, np.zeros(0, np.intp)])


def _fill_numbers(numbers: Array, loads: EndLoads, time: Array) -> None:
    """The figure of Earles and Wu, |F × Ḟ|/|F|³, rad/(N s), of every joint: of its reaction without play, in space of
    the force on an end."""
    forces, rates = loads.courses.at(time), loads.rates.at(time)
    for i, vectors in enumerate(loads.vectors):
        for rows in vectors:
            force, rate = forces[rows], rates[rows]
            square = np.sum(force * force, axis=0)
            with np.errstate(all="ignore"):
                across = np.sqrt(np.sum((rate - force * (np.sum(force * rate, axis=0) / square)) ** 2, axis=0))
                numbers[i] = np.fmax(
                    numbers[i], np.where(np.sqrt(square) > NO_LOAD * loads.largest, across / square, np.nan)
                )


def _least_loaded(forces: Array, rows: Sequence[int]) -> Positions:
    """Of the joints with loaded seats that whose end bears least, at each of some positions."""
    sizes = np.sqrt(np.sum(forces[rows] ** 2, axis=2))
    least = np.argmin(np.nan_to_num(np.min(np.where(np.isfinite(sizes), sizes, np.inf), axis=1)), axis=0)
    return np.array(rows, np.intp)[least]


# ---- what is told of it -----------------------------------------------------------------------------------------


def findings(losses: Sequence[Loss], arrays: Arrays, run: Run, dial: Dial) -> Iterator[Finding]:
    """One finding for all joints that lose contact at the same places, and for those that nothing presses."""
    joints = list(run.system.joints)
    yield from _unloaded(losses, run)
    lost: dict[tuple[str, str], list[Loss]] = {}
    lifted: dict[tuple[str, str], list[Loss]] = {}
    for loss in losses:
        if not loss.loaded:
            yield finding_for("seat.unloaded", f"joints.{loss.joint}", part=loss.part)
        elif loss.crossings:
            places = [f"at {_at(run, cross.time)}{ENDS[cross.end.place]}" for cross in loss.crossings]
            lost.setdefault((loss.part, _listed(places)), []).append(loss)
        if loss.halts:
            places = dict.fromkeys(_between(run, halt.low, halt.high) for halt in loss.halts)
            lifted.setdefault((loss.part, _listed(list(places))), []).append(loss)
    for (part, at), together in lost.items():
        numbers = arrays["contact_loss_number"][[joints.index(loss.joint) for loss in together]]
        yield _lost(together, part, at, numbers, dial)
    for (part, at), together in lifted.items():
        yield finding_for("contact.lifted", _where(together), part=part, at=at, count=len(together))
    for loss in losses:
        if loss.loaded and len(loss.unsettled):
            at, worst = dial.intervals(loss.unsettled), np.nanmax(arrays["seat_change"][loss.unsettled])
            yield finding_for("seat.unsettled", _where([loss]), rounds=ROUNDS, at=at, change=worst)


def _unloaded(losses: Sequence[Loss], run: Run) -> Iterator[Finding]:
    """The joints that bear no load over a range, with the end that does not where the other does."""
    ranges: dict[str, dict[str, str]] = {}
    for loss in losses:
        for end, low, high in loss.idle:
            ends = ranges.setdefault(_between(run, low, high), {})
            ends[loss.joint] = "" if loss.joint in ends else ENDS[end]
    for text, ends in ranges.items():
        yield finding_for("contact.unloaded", "joints", joints=[name + end for name, end in ends.items()], at=text)


def _lost(losses: Sequence[Loss], part: str, at: str, numbers: Array, dial: Dial) -> Finding:
    """Of joints that lose contact at the same places: the load of that where it falls nearest to zero of its peak.

    numbers: of Earles and Wu, (joint, position).
    """
    nearest = min((cross for loss in losses for cross in loss.crossings), key=lambda cross: cross.least / cross.peak)
    least = nearest.least if nearest.least > NO_LOAD * nearest.peak else 0.0  # less than that is rounding
    number, turning = None, ""
    if losses[0].turns and np.any(np.isfinite(numbers)):
        number = np.nanmax(numbers)
        turning = f"at {dial.at(int(np.nanargmax(numbers)) % numbers.shape[1])}"
    return finding_for(
        "contact.lost", _where(losses), part=part, least=least, peak=nearest.peak, at=at, likely=EARLES_WU,
        number=number, turning=turning, count=len(losses),
    )  # fmt: skip


def _listed(places: Sequence[str]) -> str:
    more = len(places) - MOST_PLACES
    return ", ".join(places[:MOST_PLACES]) + (f" and {more} more" if more > 0 else "")


def _between(run: Run, low: float, high: float) -> str:
    """A time, s, from and to, as positions are named."""
    first, last = _at(run, low), _at(run, high)
    return f"at {first}" if first == last else f"between {first} and {last}"


def _where(losses: Sequence[Loss]) -> str:
    return f"joints.{', '.join(loss.joint for loss in losses)}"


def _at(run: Run, time: float) -> str:
    """A time, s, as positions are named."""
    return run.system.dial(run.values, np.array([time, run.cycle.duration])).at(0)
