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
import operator
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.namespace import Number
from trunnion.algebra.nested import each, zipped
from trunnion.analysis import kinematics
from trunnion.analysis.kinematics import Travel
from trunnion.analysis.kinetostatics import Backward
from trunnion.analysis.system import Cycle, System, rubbing

if TYPE_CHECKING:
    from trunnion.analysis.analyse import Run

__all__ = ["Lanes", "lanes", "part_of", "travel"]

FINE = 720  # positions of a cycle whose neighbours are near enough for differences, and no nearer than that

Lane = NDArray[np.intp]


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
    if 0 < apart <= 2 * near and count > step:
        around = apart * np.arange(1, 2 * step + 1)
        times = np.concatenate([time[0] - around[::-1], time, time[-1] + around])
        return Lanes(_within(times, cycle), 2 * step + np.arange(count), step)
    times = np.concatenate([time + k * near for k in (-2, -1, 0, 1, 2)])
    return Lanes(_within(times, cycle), 2 * count + np.arange(count), count)


def _within(times: NDArray[np.float64], cycle: Cycle) -> NDArray[np.float64]:
    """Times that the drivers know: on a cycle that ends none before its start or after its end."""
    return times if cycle.periodic else np.clip(times, 0.0, cycle.duration)


def travel(run: Run, seen: Lanes, offsets: Mapping[str, NDArray[np.float64]], start: Backward) -> dict[str, Travel]:
    """How every link also moves at the positions of the lanes.

    offsets: of the pins at all lanes; start: the ideal mechanism there. Where a seat jumps, or a joint with friction
    turns round and the seats of all with it, differences are taken on the side of the position; where neither side
    has any, the pins are held.
    """
    rates, even = _rates(run, seen, offsets, start)
    if not rates:
        return {}
    inside = {path: numbers[seen.inner] for path, numbers in offsets.items()}
    values = {**run.values, **inside}
    time = seen.times[seen.inner]
    with np.errstate(all="ignore"):
        held = kinematics.forward(run.system, values, run.chosen.assembly, time)
        seeded = {**values, **{path: Dual(inside[path], rate) for path, rate in rates.items()}}
        added = _travelling(run, seeded, time)
    own = seen.own - seen.step
    one, two = _pairs(even, own, seen.step)
    span = time[two] - time[one]
    there = span > 0
    found: dict[str, Travel] = {}
    for link, extra in added.items():
        meant, motion = start.walk.motions[link], held.motions[link]
        play = zipped(lambda a, b, c: a + b - sliced(c, seen.inner), motion.twist, extra, meant.twist)
        change = each(play, functools.partial(_difference, one=one, two=two, span=np.where(there, span, 1.0)))
        second = zipped(
            lambda a, b, c: np.where(there, sliced(a, seen.own) + b, sliced(c, own)),
            meant.acceleration, change, motion.acceleration,
        )  # fmt: skip
        found[link] = Travel(each(extra, lambda number: sliced(number, own)), second)
    return found


def sliced(number: Number, lanes: Any) -> Number:
    """Some lanes of a number; one that is the same in all is itself."""
    return number[lanes] if np.ndim(number) else number


def _difference(number: Number, one: Lane, two: Lane, span: NDArray[np.float64]) -> Number:
    return (sliced(number, two) - sliced(number, one)) / span


def _travelling(run: Run, values: Mapping[str, Number], time: NDArray[np.float64]) -> dict[str, Any]:
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
        walk.poses.append(pose)
    return found


def _rates(
    run: Run, seen: Lanes, offsets: Mapping[str, NDArray[np.float64]], start: Backward
) -> tuple[dict[str, NDArray[np.float64]], NDArray[np.bool_]]:
    """How fast the seats travel at the inner lanes, m/s, and at which of them by differences to both sides.

    0 where a seat turns by more than a right angle: it jumps. So it does, by twice atan μ, where a friction has another
    sense: there the difference is taken on the side of the lane.
    """
    inner = np.arange(len(seen.times))[seen.inner]
    one, two = _alike(run.system, inner, seen, start)
    span = seen.times[two] - seen.times[one]
    smooth = span > 0
    ends = [[f"seats.{seat.joint}.{key}" for key in end] for seat in run.seats for end in seat.play.model.ends]
    for paths in ends:
        products = (offsets[path][one] * offsets[path][two] for path in paths)
        still = functools.reduce(operator.and_, (offsets[path][one] == offsets[path][two] for path in paths))
        smooth = smooth & (still | (functools.reduce(operator.add, products) > 0))
    found = {
        path: np.where(smooth, (offsets[path][two] - offsets[path][one]) / np.where(span > 0, span, 1.0), 0.0)
        for paths in ends
        for path in paths
    }
    even = smooth & (one != inner) & (two != inner)
    return {path: rate for path, rate in found.items() if np.any(rate)}, even


def _alike(system: System, inner: Lane, seen: Lanes, start: Backward) -> tuple[Lane, Lane]:
    """Lanes before and after each inner lane, or that itself where a friction has another sense on that side."""
    before, after = inner - seen.step, inner + seen.step
    for joint in rubbing(system):
        sense = np.broadcast_to(np.sign(primal(start.slips[joint].speed)), seen.times.shape)
        before = np.where(sense[before] == sense[inner], before, inner)
        after = np.where(sense[after] == sense[inner], after, inner)
    return before, after


def _pairs(even: NDArray[np.bool_], own: Lane, step: int) -> tuple[Lane, Lane]:
    """Between which inner lanes the velocities of each position are told apart; the same twice where there are none."""
    before = np.where(even[own] & even[own - step], own - step, own)
    after = np.where(even[own] & even[own + step], own + step, own)
    return before, after


def part_of(found: Mapping[str, Travel], lanes: Sequence[int] | Lane) -> dict[str, Travel]:
    """The velocities at some of the positions, as if the links were not accelerated by it."""
    return {link: Travel(each(one.twist, lambda number: sliced(number, lanes))) for link, one in found.items()}
