"""How links move while the seats of their pins travel across the holes.

A position has its seats, and the motion of the linkage with its pins held there comes from the modules. The seats
change along the way as the load turns: that adds velocities of the order ρ ψ̇ and accelerations of the order ρ ψ̈,
as large beside the ideal motion as all that play does. The velocities come from the poses: the seats are fed their
rates as ε parts, and the ε parts of the frames are what they add. The accelerations are differences of what play
adds to the velocities, between the neighbours of a position: small numbers, so that the error of the difference is
small as well.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual
from trunnion.algebra.namespace import Number
from trunnion.algebra.nested import each, zipped
from trunnion.solve import forward as kinematics
from trunnion.solve.forward import Travel
from trunnion.solve.system import Cycle, Values

if TYPE_CHECKING:
    from trunnion.solve.run import Run

__all__ = ["Lanes", "Moved", "around", "lanes", "moved", "part_of", "travel"]

BEND = 0.005  # rad: change of the angle that a seat turns from one lane to the next; more is no even turning
ALIKE = 1e-6  # by which the ways of the seats on both sides of a lane may differ by rounding
QUICK = 0.1  # rad from one lane to the next, likewise
FINE = 1440  # positions of a cycle whose neighbours are near enough for differences, and no nearer than that

Lane = NDArray[np.intp]
Offsets = Mapping[str, NDArray[np.float64]]


class Lanes(NamedTuple):
    """The times (s) that are looked at for some positions: their own, and those around them for differences.

    own: the positions among them; step: how many lanes before and after a lane its neighbours are. There are two of
    them on either side of each position.
    """

    times: NDArray[np.float64]
    own: Lane
    step: int

    @property
    def inner(self) -> slice:
        """The lanes that have both neighbours."""
        return slice(self.step, len(self.times) - self.step)


def lanes(time: NDArray[np.float64], cycle: Cycle) -> Lanes:
    """The positions with their neighbours: positions themselves where they are close together, else others."""
    count, near = len(time), cycle.duration / FINE
    apart = (time[-1] - time[0]) / (count - 1) if count > 1 else 0.0
    step = max(1, round(near / apart)) if apart > 0 else 0
    even = bool(np.all(np.abs(np.diff(time) - apart) <= 1e-6 * apart))
    if even and 0 < apart <= 1.5 * near and count > step:
        beyond = apart * np.arange(1, 2 * step + 1)
        times = np.concatenate([time[0] - beyond[::-1], time, time[-1] + beyond])
        return Lanes(_within(times, cycle), 2 * step + np.arange(count), step)
    return around(time, cycle)


def around(time: NDArray[np.float64], cycle: Cycle) -> Lanes:
    """Any times, in any order, with neighbours of their own."""
    count, near = len(time), cycle.duration / FINE
    times = np.concatenate([time + k * near for k in (-2, -1, 0, 1, 2)])
    return Lanes(_within(times, cycle), 2 * count + np.arange(count), count)


def _within(times: NDArray[np.float64], cycle: Cycle) -> NDArray[np.float64]:
    """Times that the drivers know: on a cycle that ends none before its start or after its end."""
    return times if cycle.periodic else np.clip(times, 0.0, cycle.duration)


def travel(
    run: Run, seen: Lanes, offsets: Offsets, ideal: Mapping[str, Any], look: Callable[..., Mapping[str, Moved]]
) -> tuple[dict[str, Travel], NDArray[np.bool_]]:
    """How every link also moves at the positions of the lanes, and at which of them accelerations tell it.

    offsets: of the pins at all lanes; ideal: motion of every link of the ideal mechanism there; look: `moved`, or what
    stands for it, `(time, offsets, rates)`. Accelerations are told only between lanes where all seats travel evenly;
    else the links have those of pins that are held.
    """
    rates, even = _rates(run, seen, offsets)
    if not rates:
        return {}, np.ones(len(seen.own), bool)
    time = seen.times[seen.inner]
    with np.errstate(all="ignore"):
        moving = look(time, {path: numbers[seen.inner] for path, numbers in offsets.items()}, rates)
    own = seen.own - seen.step
    one, two = _pairs(even, own, seen.step)
    span = time[two] - time[one]
    there = span > 0
    found: dict[str, Travel] = {}
    for link, (twist, acceleration, extra) in moving.items():
        meant = ideal[link]
        play = zipped(lambda a, b, c: a + b - sliced(c, seen.inner), twist, extra, meant.twist)
        change = each(play, functools.partial(_difference, one=one, two=two, span=np.where(there, span, 1.0)))
        second = zipped(
            lambda a, b, c: np.where(there, sliced(a, seen.own) + b, sliced(c, own)),
            meant.acceleration, change, acceleration,
        )  # fmt: skip
        found[link] = Travel(each(extra, lambda number: sliced(number, own)), second)
    return found, there


class Moved(NamedTuple):
    """How a link moves with its pins held, and the twist that the travel of the seats adds."""

    twist: Any
    acceleration: Any
    extra: Any


def moved(run: Run, values: Values, rates: Mapping[str, Number], time: Number) -> dict[str, Moved]:
    """How every link moves with the pins at the offsets among the values, and what the rates of these add."""
    walk = kinematics.forward(run.system, values, run.chosen.assembly, time)
    added = _travelling(run, {**values, **{path: Dual(values[path], rate) for path, rate in rates.items()}}, time)
    return {
        link: Moved(walk.motions[link].twist, walk.motions[link].acceleration, extra) for link, extra in added.items()
    }


def sliced(number: Number, lanes: Any) -> Number:
    """Some lanes of a number; one that is the same in all is itself."""
    return number[lanes] if np.ndim(number) else number


def _difference(number: Number, one: Lane, two: Lane, span: NDArray[np.float64]) -> Number:
    return (sliced(number, two) - sliced(number, one)) / span


def _travelling(run: Run, values: Values, time: Number) -> dict[str, Any]:
    """Twist of every link by the ε parts of the values; poses alone are worked out."""
    system = run.system
    walk = kinematics.start(system, values)
    walk.time = time
    found: dict[str, Any] = {}
    still = walk.motions[system.mechanism.fixed_link]
    for number, module in enumerate(system.plan.modules):
        pose = kinematics.pose_of(walk, number, run.chosen.assembly[number], time)
        for link, frame in zip(module.links, pose.frames, strict=True):
            found[link] = walk.frame_rate(frame)
            walk.motions[link] = still._replace(frame=frame)
        found.update(walk.unspun(number, pose, found))
        walk.poses.append(pose)
    return found


def _rates(run: Run, seen: Lanes, offsets: Offsets) -> tuple[dict[str, NDArray[np.float64]], NDArray[np.bool_]]:
    """How fast the seats travel at the inner lanes, m/s, and at which of them all seats do so evenly.

    A seat that jumps, since its load turns round or a friction does, or that turns too quickly for differences,
    bends by more than BEND from a lane to the next and the one after; so does one that is known on one side alone.
    There the rate is taken on the side on which all turn least, and is 0 where that is more than QUICK.
    """
    count, step = len(seen.times), seen.step
    sides = slice(0, count - 2 * step), seen.inner, slice(2 * step, count)
    before, inner, after = (np.arange(count)[side] for side in sides)
    ends = [[f"seats.{seat.joint}.{key}" for key in end] for seat in run.seats for end in seat.play.model.ends]
    bend = back = ahead = np.zeros(len(inner))
    for paths in ends:
        was, is_, will = ([offsets[path][side] for path in paths] for side in sides)
        # a pin whose load is not known lies in the middle: from there to its wall is a jump, not a way
        far = np.sqrt(sum(offsets[path] ** 2 for path in paths))
        size = np.maximum(np.maximum(far[sides[0]], far[sides[1]]), far[sides[2]])
        scale = 1 / np.where(size > 0, size, np.inf)
        back = np.maximum(back, scale * _apart(was, is_))
        ahead = np.maximum(ahead, scale * _apart(is_, will))
        middle = [0.5 * (a + b) for a, b in zip(was, will, strict=True)]
        bend = np.maximum(bend, 2 * scale * _apart(middle, is_))
    even = bend <= BEND
    behind = back <= (1 + ALIKE) * ahead
    one = np.where(even | behind, before, inner)
    two = np.where(even | ~behind, after, inner)
    span = seen.times[two] - seen.times[one]
    still = (span <= 0) | (~even & (np.minimum(back, ahead) > QUICK))
    found = {
        path: np.where(still, 0.0, (offsets[path][two] - offsets[path][one]) / np.where(still, 1.0, span))
        for paths in ends
        for path in paths
    }
    return {path: rate for path, rate in found.items() if np.any(rate)}, even & (span > 0)


def _apart(one: Sequence[NDArray[np.float64]], two: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    return np.asarray(np.sqrt(sum((a - b) ** 2 for a, b in zip(one, two, strict=True))))


def _pairs(even: NDArray[np.bool_], own: Lane, step: int) -> tuple[Lane, Lane]:
    """Between which inner lanes the velocities of each position are told apart; the same twice where there are none."""
    before = np.where(even[own] & even[own - step], own - step, own)
    after = np.where(even[own] & even[own + step], own + step, own)
    return before, after


def part_of(found: Mapping[str, Travel], lanes: Lane) -> dict[str, Travel]:
    """The velocities at some of the positions, as if the links were not accelerated by it."""
    return {
        link: Travel(each(travelling.twist, lambda number: sliced(number, lanes)), None)
        for link, travelling in found.items()
    }
