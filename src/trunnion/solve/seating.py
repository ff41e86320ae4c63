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
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number
from trunnion.algebra.nested import flat
from trunnion.joints.clearance import pressed, turned_by_friction
from trunnion.solve import eccentricity_rate as rate
from trunnion.solve.backward import Backward
from trunnion.solve.eccentricity_rate import Lanes, Moved, part_of, travel
from trunnion.solve.forward import Travel
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.system import rubbing

if TYPE_CHECKING:
    from trunnion.solve.run import Run

from trunnion.solve.seats import GivenSeat

__all__ = [
    "ROUNDS", "TOLERANCE", "Seated", "loads_of", "settle",
]  # fmt: skip

ROUNDS = 10  # most of the iteration
MARGIN = 50.0  # by which a second round may gain less than the first
SLUGGISH = 0.1  # of the change before: rounds that gain less than this are helped
SLOW = 0.01  # of its largest speed: below it the travel of the seats may turn the slip of a joint round
TOLERANCE = 1e-6  # change of a seat that one more round would make, of its clearance
NO_LOAD = 1e-9  # of the largest reaction of a position: a load below it is rounding and presses nothing anywhere

Vector = tuple[Number, ...]
Array = NDArray[np.float64]


class Pressed(NamedTuple):
    """What a walk says of the seats: those its reactions press the pins into, m, by the names of `shifts`, and the
    speeds of the joints with friction, (joint, lane).
    """

    offsets: dict[str, Array]
    speeds: Array


@dataclass(frozen=True)
class Seated:
    """Where the pins of some positions lie, and the walk with them there.

    offsets: by the names of `shifts` (`seats.JOINT.1.x`), m; rounds: of the iteration; change: that one more round
    would make, of the clearances; sticks: positions at which only the travel of the seats decides the sense of a
    friction, the joint itself being all but at rest; told: at which the accelerations contain the travel of the seats;
    loads: of the pin on each end of its hole, N, by joint.
    """

    offsets: dict[str, Array]
    rounds: NDArray[np.intp]
    change: Array
    sticks: NDArray[np.bool_]
    told: NDArray[np.bool_]
    back: Backward
    loads: dict[str, list[Vector]]


def loads_of(back: Backward, seat: GivenSeat) -> list[Vector]:
    """Load of the pin on each end of its hole, N, in the hole's frame."""
    force, moment = back.on_hole(seat.joint)
    return seat.play.model.loads(force, moment, seat.play.length)


def _pressed(back: Backward, seat: GivenSeat, loads: Sequence[Vector], least: Number) -> list[Vector]:
    """Where the loads press the pin at its ends, friction taken into account."""
    share = _share(back, seat.joint)
    spin = back.walk.hole_spin(seat.joint)
    return [
        pressed(turned_by_friction(load, share, spin) if share is not None else load, radius, least)
        for load, radius in zip(loads, seat.play.radii, strict=True)
    ]


def _share(back: Backward, joint: str) -> Number | None:
    """Friction force about the axis, against the slip, over the normal force at a contact; None without friction.

    Negative where it drives, as bristles do that have not yet bent round after a reversal.

    The coefficient itself: a pair factor stands for a spread contact, whose resultant is turned by atan μ all the
    same.
    """
    if joint not in back.turning:
        return None
    contact, turning = back.turning[joint]
    slope = contact.law.function(1.0, contact.slip, **contact.parameters)
    return -primal(slope * turning) * np.sign(primal(contact.slip)) / contact.parameters.get("pair_factor", 1.0)


def settle(run: Run, seen: Lanes, method: FrictionMethod, ideal: Backward | None = None) -> Seated:
    """The positions of some lanes with every pin in its seat.

    The seats are those of the loads with the pins held; their travel comes with the last walk. ideal: motion and
    reactions of the ideal mechanism at all lanes, if they are solved already.
    """
    quick = replace(method, margin_up_to=0.0)
    ideal = ideal or run.ideal(seen.times, quick)
    count, time = len(seen.times), seen.times[seen.own]
    offsets, speeds = _told(run, ideal, count)
    rounds, change = np.zeros(count, np.intp), np.zeros(count)
    loaded = any(seat.given is None for seat in run.seats)
    sticks = np.zeros(len(time), bool)
    senses = np.zeros((len(rubbing(run.system)), count))
    if loaded:
        _iterate(run, seen.times, quick, offsets, rounds, change, np.arange(count), senses)

    def moved(time: Array, offsets: Mapping[str, Array], rates: Mapping[str, Array]) -> Mapping[str, Moved]:
        return rate.moved(run, {**run.values, **offsets}, rates, time)

    moving, told = travel(run, seen, offsets, ideal.walk.motions, moved)
    mine = {path: numbers[seen.own] for path, numbers in offsets.items()}
    rounds, change = rounds[seen.own], change[seen.own]
    if loaded and moving:  # where a joint turns round, the travel of the seats decides the sense of its friction
        left = np.flatnonzero(_slow(speeds)[seen.own] & (rounds < ROUNDS))
        part = {path: numbers[left] for path, numbers in mine.items()}
        turned = np.sign(_pressed_at(run, time[left], part, quick, part_of(moving, left)).speeds)
        left = left[np.any(turned != senses[:, seen.own[left]], axis=0)]
        sticks[left] = True
        _iterate(run, time, quick, mine, rounds, change, left, senses[:, seen.own], moving)
    back = run.at(time, mine, method, travel=moving)
    return Seated(mine, rounds, change, sticks, told, back, {seat.joint: loads_of(back, seat) for seat in run.seats})


def _slow(speeds: Array) -> NDArray[np.bool_]:
    """Where a joint with friction is about to turn round."""
    sizes = np.abs(speeds)
    return np.asarray(np.any(sizes <= SLOW * np.nanmax(sizes, axis=1, keepdims=True, initial=0.0), axis=0))


def _iterate(
    run: Run,
    time: Array,
    method: FrictionMethod,
    offsets: dict[str, Array],
    rounds: NDArray[np.intp],
    change: Array,
    left: NDArray[np.intp],
    senses: Array,
    moving: Mapping[str, Travel] | None = None,
) -> None:
    """Seats and reactions in turn, in place, until the positions `left` have settled or had their rounds.

    senses: of the slips of the joints with friction in the last round, kept too.

    A round gains about as much as the one before it, so `change`, what one more round would change, is known from
    two; of the first alone, that took the pin into its seat, it is its square with a margin. Where rounds gain
    little the step is extrapolated from the last two (Anderson's method with one step of memory, D. G. Anderson, J.
    ACM 12 (1965) 547-560, doi:10.1145/321296.321305).
    """
    paths = list(offsets)
    last, earlier, kept = np.full(len(left), 1 / MARGIN), None, left
    while len(left):
        part = {path: numbers[left] for path, numbers in offsets.items()}
        goal, speeds = _pressed_at(run, time[left], part, method, part_of(moving, left) if moving else None)
        senses[:, left] = np.sign(speeds)
        rounds[left] += 1
        now = _change(run.seats, part, goal)
        change[left] = now * np.minimum(now / np.where(last > 0, last, 1.0), 1.0)
        for path in paths:
            offsets[path][left] = goal[path]
        if earlier:
            slow = np.flatnonzero(now > SLUGGISH * last)
            steps = ((earlier, kept[slow]), ((part, goal), slow))
            before, after, here, there = (
                np.array([one[path][places] for path in paths]) for both, places in steps for one in both
            )
            ahead = _at_the_wall(run.seats, paths, _extrapolated(before, after, here, there), there)
            for path, numbers in zip(paths, ahead, strict=True):
                offsets[path][left[slow]] = numbers
        earlier, kept = (part, goal), np.flatnonzero((change[left] > TOLERANCE) & (rounds[left] < ROUNDS))
        last, left = now[kept], left[kept]


def _extrapolated(
    before: NDArray[np.float64], after: NDArray[np.float64], here: NDArray[np.float64], there: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The seats to which two rounds, before → after and here → there, lead if the map between is a straight one."""
    step, last = there - here, after - before
    turn = step - last
    square = np.sum(turn * turn, axis=0)
    share = np.sum(step * turn, axis=0) / np.where(square > 0, square, np.inf)
    return np.asarray(there - share * (there - after))


def _at_the_wall(
    found: Sequence[GivenSeat], paths: Sequence[str], ahead: NDArray[np.float64], there: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Extrapolated offsets with the lengths that pins pressed to the wall have."""
    row = {path: i for i, path in enumerate(paths)}
    for seat in found:
        for end in seat.play.model.ends:
            rows = [row[f"seats.{seat.joint}.{key}"] for key in end]
            size, wanted = (np.sqrt(np.sum(one[rows] ** 2, axis=0)) for one in (ahead, there))
            ahead[rows] = np.where(size > 0, ahead[rows] * (wanted / np.where(size > 0, size, 1.0)), there[rows])
    return ahead


def _pressed_at(
    run: Run,
    time: Array,
    offsets: Mapping[str, Array],
    method: FrictionMethod,
    travel: Mapping[str, Travel] | None = None,
) -> Pressed:
    """What reactions press with the pins at offsets, as they travel there."""
    return _told(run, run.at(time, offsets, method, travel=travel), len(time))


def _told(run: Run, back: Backward, count: int) -> Pressed:
    """What a walk says of the seats; a pin whose load is not known (locked, not assembled) is left in the middle."""
    rows = {path: _row(number, count) for path, number in _wanted(run.seats, back).items()}
    offsets = {path: np.where(np.isfinite(row), row, 0.0) for path, row in rows.items()}
    speeds = [_row(back.slips[joint].speed, count) for joint in rubbing(run.system)]
    return Pressed(offsets, np.array(speeds).reshape(len(speeds), count))


def _row(number: Number, count: int) -> Array:
    return np.array(np.broadcast_to(primal(number), (count,)), float)


def _wanted(found: Sequence[GivenSeat], back: Backward) -> dict[str, Number]:
    """The seats into which the reactions of a walk press the pins, and those that are given."""
    least = NO_LOAD * _largest_reaction(back)
    offsets: dict[str, Number] = {}
    for seat in found:
        own = seat.given if seat.given is not None else _pressed(back, seat, loads_of(back, seat), least)
        offsets |= seat.play.model.paths(f"seats.{seat.joint}", own)
    return offsets


def _largest_reaction(back: Backward) -> Number:
    """Largest component of a force in any joint, N."""
    count = back.walk.system.mechanism.coordinates
    parts = (np.abs(primal(part)) for one in back.reactions.values() for part in tuple(flat(tuple(one)))[:count])
    return functools.reduce(np.fmax, parts, 0.0)


def _change(
    found: Sequence[GivenSeat], before: Mapping[str, NDArray[np.float64]], after: Mapping[str, NDArray[np.float64]]
) -> NDArray[np.float64]:
    """Largest way of a pin from seat to seat, of the radius of its end."""
    worst: Number = 0.0
    for seat in found:
        for end, radius in zip(seat.play.model.ends, seat.play.radii, strict=True):
            paths = [f"seats.{seat.joint}.{key}" for key in end]
            square = functools.reduce(operator.add, ((after[path] - before[path]) ** 2 for path in paths))
            size = np.asarray(primal(radius), float)
            worst = np.maximum(worst, np.sqrt(square) / np.where(size > 0, size, 1.0))
    return np.asarray(worst)
