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
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number
from trunnion.algebra.nested import flat
from trunnion.joints.clearance import pressed, turned_by_friction
from trunnion.solve.backward import Backward
from trunnion.solve.eccentricity_rate import Lanes, part_of, travel
from trunnion.solve.forward import Travel
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.system import System, rubbing

if TYPE_CHECKING:
    from trunnion.solve.run import Run

from trunnion.solve.seats import GivenSeat

__all__ = ["ROUNDS", "TOLERANCE", "Seated", "loads_of", "settle"]

ROUNDS = 10  # most of the iteration
MARGIN = 50.0  # by which a second round may gain less than the first
SLUGGISH = 0.1  # of the change before: rounds that gain less than this are helped
SLOW = 0.01  # of its largest speed: below it the travel of the seats may turn the slip of a joint round
TOLERANCE = 1e-6  # change of a seat that one more round would make, of its clearance
NO_LOAD = 1e-9  # of the largest reaction of a position: a load below it is rounding and presses nothing anywhere

Vector = tuple[Number, ...]


@dataclass(frozen=True)
class Seated:
    """What the positions of one walk came to with their pins in their seats.

    offsets: by the names of `shifts` (`seats.JOINT.1.x`), m; loads: of the pin on each end of its hole, N, by joint;
    rounds: of the iteration; change: that one more round would make, of the clearances; sticks: positions
    at which only the travel of the seats decides the sense of a friction, the joint itself being all but at rest;
    told: at which the accelerations contain the travel of the seats.
    """

    back: Backward
    offsets: dict[str, NDArray[np.float64]]
    loads: dict[str, list[Vector]]
    rounds: NDArray[np.intp]
    change: NDArray[np.float64]
    sticks: NDArray[np.bool_]
    told: NDArray[np.bool_]


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


def settle(run: Run, seen: Lanes, method: FrictionMethod, start: Backward) -> Seated:
    """The positions of some lanes with every pin in its seat.

    start: motion and reactions of the ideal mechanism at the times of all lanes; the first guess. The seats are
    those of the loads with the pins held; the travel of the seats comes with the last walk.
    """
    quick, time = replace(method, margin_up_to=0.0), seen.times[seen.own]
    offsets = _next(run, start, len(seen.times))
    rounds, change = np.zeros(len(seen.times), np.intp), np.zeros(len(seen.times))
    loaded = any(seat.given is None for seat in run.seats)
    sticks = np.zeros(len(time), bool)
    senses = np.zeros((len(rubbing(run.system)), len(seen.times)))
    held = None
    if loaded:
        held = _iterate(run, seen.times, quick, offsets, rounds, change, np.arange(len(seen.times)), senses)
    moving, told = travel(run, seen, offsets, start, held)
    mine = {path: numbers[seen.own] for path, numbers in offsets.items()}
    rounds, change = rounds[seen.own], change[seen.own]
    if loaded:  # where a joint turns round, the travel of the seats decides the sense of its friction
        turning = _slow(run.system, start)[seen.own] & (rounds < ROUNDS)
        left = np.flatnonzero(turning) if moving else np.zeros(0, np.intp)
        turned = run.at(time[left], {path: numbers[left] for path, numbers in mine.items()}, quick,
                        travel=part_of(moving, left))  # fmt: skip
        left = left[np.any(_senses(turned) != senses[:, seen.own[left]], axis=0)]
        sticks[left] = True
        _iterate(run, time, quick, mine, rounds, change, left, senses[:, seen.own], moving)
    back = run.at(time, mine, method, travel=moving)
    return Seated(back, mine, _loads(run, back), rounds, change, sticks, told)


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
    left: NDArray[np.intp],
    senses: NDArray[np.float64],
    moving: Mapping[str, Travel] | None = None,
) -> Backward | None:
    """Seats and reactions in turn, in place, until the positions `left` have settled or had their rounds.

    senses: of the slips of the joints with friction in the last round, kept too. Returns the last round of all
    positions.

    A round gains about as much as the one before it, so `change`, what one more round would change, is known from
    two; of the first alone, that took the pin into its seat, it is its square with a margin. Where rounds gain
    little the step is extrapolated from the last two (Anderson's method with one step of memory, D. G. Anderson, J.
    ACM 12 (1965) 547-560, doi:10.1145/321296.321305).
    """
    paths = list(offsets)
    before = after = np.zeros((len(paths), 0))
    last = np.full(len(left), 1 / MARGIN)
    whole: Backward | None = None
    while len(left):
        part = {path: numbers[left] for path, numbers in offsets.items()}
        found = run.at(time[left], part, method, travel=part_of(moving, left) if moving else None)
        whole = found if len(left) == len(time) else whole
        wanted = _next(run, found, len(left))
        senses[:, left] = _senses(found)
        rounds[left] += 1
        now = _change(run.seats, part, wanted)
        change[left] = now * np.minimum(now / np.where(last > 0, last, 1.0), 1.0)
        here, there = (np.array([one[path] for path in paths]) for one in (part, wanted))
        following = there
        if after.size:
            ahead = _at_the_wall(run.seats, paths, _extrapolated(before, after, here, there), there)
            following = np.where(now > SLUGGISH * last, ahead, there)
        for path, numbers in zip(paths, following, strict=True):
            offsets[path][left] = numbers
        open_ = (change[left] > TOLERANCE) & (rounds[left] < ROUNDS)
        before, after, last, left = here[:, open_], there[:, open_], now[open_], left[open_]
    return whole


def _senses(found: Backward) -> NDArray[np.float64]:
    """Sense of the slip of every joint with friction at each position."""
    shape = np.shape(found.walk.time)
    names = rubbing(found.walk.system)
    return np.array([np.broadcast_to(np.sign(primal(found.slips[name].speed)), shape) for name in names]).reshape(
        len(names), *shape
    )


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


def _loads(run: Run, back: Backward) -> dict[str, list[Vector]]:
    return {seat.joint: loads_of(back, seat) for seat in run.seats}


def _next(run: Run, back: Backward, count: int) -> dict[str, NDArray[np.float64]]:
    """The seats into which the reactions of a walk press the pins, and those that are given."""
    least = NO_LOAD * _largest_reaction(back)
    found: dict[str, NDArray[np.float64]] = {}
    for seat in run.seats:
        offsets = seat.given if seat.given is not None else _pressed(back, seat, loads_of(back, seat), least)
        for path, number in seat.play.model.paths(f"seats.{seat.joint}", offsets).items():
            offset = np.array(np.broadcast_to(primal(number), (count,)), float)
            # where the load is not known (locked, not assembled) the pin is left in the middle
            offset[~np.isfinite(offset)] = 0.0
            found[path] = offset
    return found


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
