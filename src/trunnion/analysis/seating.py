"""Where the pins lie in their holes: the seats that are given, and those that the reactions press the pins into.

A seat and the reactions depend on each other: the seat moves the links by some ρ/l of their size, the reactions
change by as much, and so does the seat. The iteration starts from the reactions of the ideal mechanism and gains
three or four digits a round, but where the load of an end comes near zero: there the seat would have to jump, and
contact is lost.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number
from trunnion.algebra.nested import flat
from trunnion.analysis.friction import FrictionMethod
from trunnion.analysis.kinetostatics import Backward
from trunnion.analysis.shifts import Play, play_of
from trunnion.analysis.system import Cycle, System, Values, rubbing
from trunnion.joints.clearance import described, pressed, turned_by_friction

if TYPE_CHECKING:
    from trunnion.analysis.analyse import Run

__all__ = ["ROUNDS", "Lanes", "Seat", "Seated", "lanes", "loads_of", "seats", "settle"]

ROUNDS = 10  # most of the iteration
FINE = 720  # positions of a cycle whose neighbours are near enough to tell how fast a seat travels
SLOW = 0.01  # of its largest speed: below it the travel of the seats may turn the slip of a joint round
TOLERANCE = 1e-6  # change of a seat, of its clearance; the next one is as much smaller again
NO_LOAD = 1e-9  # of the largest reaction of a position: a load below it is rounding and presses nothing anywhere

Vector = tuple[Number, ...]


class Seat(NamedTuple):
    """A joint whose pin does not lie in the middle of its hole: its play, and the offsets at its ends if given."""

    joint: str
    play: Play
    given: list[Vector] | None


@dataclass(frozen=True)
class Seated:
    """What the positions of one walk came to with their pins in their seats.

    offsets: by the names of `shifts` (`seats.JOINT.1.x`), m; loads: of the pin on each end of its hole, N, by joint;
    rounds: of the iteration; change: of the seats in the last round, of their clearances; turning: positions at which a
    joint with friction is about to turn round.
    """

    back: Backward
    offsets: dict[str, NDArray[np.float64]]
    loads: dict[str, list[Vector]]
    rounds: NDArray[np.intp]
    change: NDArray[np.float64]
    turning: NDArray[np.bool_]

    @property
    def sticks(self) -> NDArray[np.bool_]:
        """Positions whose seats do not come to rest since a joint turns round there: either sense turns it back.

        The pin travels across its hole while the joint itself is at rest, and its friction is an interval.
        """
        return (self.change > TOLERANCE) & self.turning


def seats(system: System, values: Values) -> list[Seat]:
    """The joints whose seat is given or follows the load."""
    found = []
    space = system.mechanism.space
    for joint, stated in system.mechanism.seated.items():
        play = play_of(space, system.joints[joint][0], values, joint)
        if play is not None:
            found.append(Seat(joint, play, _given(values, joint, play) if not isinstance(stated, str) else None))
    return found


def _given(values: Values, joint: str, play: Play) -> list[Vector]:
    """Offsets of a seat that is stated: by β and ξ of a pin, of a guide from its normal, by a direction of a ball."""
    path = f"joints.{joint}.seat"
    found: list[Vector] = []
    for end, radius in zip(play.model.ends, play.radii, strict=True):
        if len(end) == 3:
            direction = tuple(values[f"{path}.direction.{axis}"] for axis in "xyz")
            found.append(pressed(direction, radius))
            continue
        both = described(radius, values.get(f"{path}.beta", 0.0), values.get(f"{path}.xi", 0.0))
        place = both[1 if end[0].startswith("2") else 0]
        if len(end) == 2:
            found.append(place)
        elif end[0].startswith("3"):  # nothing is said of the end float
            found.append((0.0,))
        else:  # the guide of a plane counts ξ from its normal
            across = end[0].endswith("y") and len(play.model.ends) > 2
            found.append((place[1 if across else 0],))
    return found


def loads_of(back: Backward, seat: Seat) -> list[Vector]:
    """Load of the pin on each end of its hole, N, in the hole's frame."""
    force, moment = back.on_hole(seat.joint)
    return seat.play.model.loads(force, moment, seat.play.length)


def _pressed(back: Backward, seat: Seat, loads: Sequence[Vector], least: Number) -> list[Vector]:
    """Where the loads press the pin at its ends, friction taken into account."""
    share = _share(back, seat.joint)
    spin = back.walk.hole_spin(seat.joint)
    return [
        pressed(turned_by_friction(load, share, spin) if share is not None else load, radius, least)
        for load, radius in zip(loads, seat.play.radii, strict=True)
    ]


def _share(back: Backward, joint: str) -> Number | None:
    """Friction force about the axis over the normal force at a contact of a joint; None without friction.

    The coefficient itself: a pair factor stands for a spread contact, whose resultant is turned by atan μ all the
    same.
    """
    if joint not in back.turning:
        return None
    contact, turning = back.turning[joint]
    slope = contact.law.function(1.0, contact.slip, **contact.parameters)
    return np.abs(primal(slope * turning)) / contact.parameters.get("pair_factor", 1.0)


class Lanes(NamedTuple):
    """The times (s) that are looked at for some positions: their own, and those before and after, for differences."""

    times: NDArray[np.float64]
    own: NDArray[np.intp]
    before: NDArray[np.intp]
    after: NDArray[np.intp]


def lanes(time: NDArray[np.float64], cycle: Cycle) -> Lanes:
    """The positions with their neighbours; finer ones where the positions are far apart or alone."""
    count, step = len(time), cycle.duration / FINE
    apart = np.diff(time)
    if count > 2 and np.all(apart > 0) and np.max(apart) <= 2 * step:
        times = _within(np.concatenate([[2 * time[0] - time[1]], time, [2 * time[-1] - time[-2]]]), cycle)
        own = np.arange(1, count + 1)
        return Lanes(times, own, own - 1, own + 1)
    times = _within(np.concatenate([time - step, time, time + step]), cycle)
    own = np.arange(count, 2 * count)
    return Lanes(times, own, own - count, own + count)


def _within(times: NDArray[np.float64], cycle: Cycle) -> NDArray[np.float64]:
    """Times that the drivers know: on a cycle that ends none before its start or after its end."""
    return times if cycle.periodic else np.clip(times, 0.0, cycle.duration)


def settle(run: Run, seen: Lanes, method: FrictionMethod, start: Backward) -> Seated:
    """The positions of some lanes with every pin in its seat.

    start: motion and reactions of the ideal mechanism at the times of all lanes; the first guess.
    """
    quick, time = replace(method, margin_up_to=0.0), seen.times[seen.own]
    offsets = _next(run, start, len(seen.times))
    rounds, change = np.zeros(len(seen.times), np.intp), np.zeros(len(seen.times))
    loaded = any(seat.given is None for seat in run.seats)
    turning = _slow(run.system, start)[seen.own]
    if loaded:
        _iterate(run, seen.times, quick, offsets, rounds, change, np.sqrt(TOLERANCE))
    rates = _rates(run, seen, offsets, start)
    mine = {path: numbers[seen.own] for path, numbers in offsets.items()}
    rounds, change = rounds[seen.own], change[seen.own]
    if loaded:  # where a joint turns round, the travel of the seats decides the sense of its friction
        _iterate(run, time, quick, mine, rounds, change, TOLERANCE, np.flatnonzero(turning), rates)
    back = run.at(time, mine, method, rates=rates)
    if loaded:  # this walk shows whether the seats have settled
        rounds += rounds < ROUNDS
        change = _change(run.seats, mine, _next(run, back, len(time)), np.arange(len(time)))
        left = np.flatnonzero((change > TOLERANCE) & (rounds < ROUNDS))
        if len(left):
            _iterate(run, time, quick, mine, rounds, change, TOLERANCE, left, rates)
            back = run.at(time, mine, method, rates=rates)
    return Seated(back, mine, _loads(run, back), rounds, change, turning)


def _slow(system: System, start: Backward) -> NDArray[np.bool_]:
    """Where a joint with friction is about to turn round."""
    found: Number = False
    for joint in rubbing(system):
        speed = np.abs(primal(start.slips[joint].speed))
        found = found | (speed <= SLOW * np.nanmax(speed, initial=0.0))
    return np.broadcast_to(np.asarray(found, bool), np.shape(start.walk.time))


def _iterate(
    run: Run,
    time: NDArray[np.float64],
    method: FrictionMethod,
    offsets: dict[str, NDArray[np.float64]],
    rounds: NDArray[np.intp],
    change: NDArray[np.float64],
    enough: float,
    left: NDArray[np.intp] | None = None,
    rates: Mapping[str, NDArray[np.float64]] | None = None,
) -> None:
    """Seats and reactions in turn, in place, until the positions have settled or had their rounds.

    enough: change at which to end; the next one is about its square. left: positions, all if not given.
    """
    left = np.arange(len(time)) if left is None else left[rounds[left] < ROUNDS]
    while len(left):
        part = {path: numbers[left] for path, numbers in offsets.items()}
        found = run.at(time[left], part, method, rates={path: rate[left] for path, rate in (rates or {}).items()})
        wanted = _next(run, found, len(left))
        rounds[left] += 1
        change[left] = _change(run.seats, offsets, wanted, left)
        moved = change[left] > (TOLERANCE if enough == TOLERANCE else 0.0)
        for path, numbers in wanted.items():
            offsets[path][left[moved]] = numbers[moved]
        left = left[(change[left] > enough) & (rounds[left] < ROUNDS)]


def _rates(
    run: Run, seen: Lanes, offsets: Mapping[str, NDArray[np.float64]], start: Backward
) -> dict[str, NDArray[np.float64]]:
    """How fast the seats travel, m/s, by central differences; 0 where one jumps, and where nothing moves.

    Where a joint with friction turns round between the neighbours of a position its seat jumps by twice atan μ:
    there the difference is taken on the side of the position. So it is 0 where a seat turns by more than a right angle.
    """
    one, two = _alike(run.system, seen, start)
    span = seen.times[two] - seen.times[one]
    found: dict[str, NDArray[np.float64]] = {}
    for seat in run.seats:
        for end in seat.play.model.ends:
            paths = [f"seats.{seat.joint}.{key}" for key in end]
            was, is_ = ([offsets[path][side] for path in paths] for side in (one, two))
            smooth = (functools.reduce(operator.add, (a * b for a, b in zip(was, is_, strict=True))) > 0) & (span > 0)
            for path, a, b in zip(paths, was, is_, strict=True):
                found[path] = np.where(smooth, (b - a) / np.where(span > 0, span, 1.0), 0.0)
    return {path: rate for path, rate in found.items() if np.any(rate)}


def _alike(system: System, seen: Lanes, start: Backward) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Lanes before and after each position, or the position itself where a friction has another sense on that side."""
    before, after = seen.before.copy(), seen.after.copy()
    for joint in rubbing(system):
        sense = np.broadcast_to(np.sign(primal(start.slips[joint].speed)), seen.times.shape)
        before = np.where(sense[before] == sense[seen.own], before, seen.own)
        after = np.where(sense[after] == sense[seen.own], after, seen.own)
    return before, after


def _loads(run: Run, back: Backward) -> dict[str, list[Vector]]:
    return {seat.joint: loads_of(back, seat) for seat in run.seats}


def _next(run: Run, back: Backward, count: int) -> dict[str, NDArray[np.float64]]:
    """The seats into which the reactions of a walk press the pins, and those that are given."""
    least = NO_LOAD * _largest_reaction(back)
    found: dict[str, NDArray[np.float64]] = {}
    for seat in run.seats:
        offsets = seat.given if seat.given is not None else _pressed(back, seat, loads_of(back, seat), least)
        for path, number in seat.play.model.paths(f"seats.{seat.joint}", offsets).items():
            # where the load is not known (locked, not assembled) the pin is left in the middle
            found[path] = np.nan_to_num(np.array(np.broadcast_to(np.asarray(primal(number), float), (count,))))
    return found


def _largest_reaction(back: Backward) -> Number:
    """Largest force in any joint, N."""
    sizes = (np.hypot.reduce([np.abs(primal(part)) for part in _force(one)]) for one in back.reactions.values())
    return functools.reduce(np.fmax, sizes, 0.0)


def _force(reaction: Any) -> tuple[Number, ...]:
    parts = tuple(np.asarray(number, float) for number in flat(tuple(reaction)))
    force = parts[: 2 if len(parts) == 3 else 3]
    return tuple(np.broadcast_arrays(*force))


def _change(
    found: Sequence[Seat], before: Mapping[str, Number], after: Mapping[str, Number], lanes: NDArray[np.intp]
) -> NDArray[np.float64]:
    """Largest way of a pin from seat to seat, of the radius of its end."""
    worst = np.zeros(len(lanes))
    for seat in found:
        for end, radius in zip(seat.play.model.ends, seat.play.radii, strict=True):
            paths = [f"seats.{seat.joint}.{key}" for key in end]
            square = functools.reduce(operator.add, ((after[path] - before[path][lanes]) ** 2 for path in paths))
            size = np.asarray(primal(radius), float)
            worst = np.maximum(worst, np.sqrt(square) / np.where(size > 0, size, 1.0))
    return worst
