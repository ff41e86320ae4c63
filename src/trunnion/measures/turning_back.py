"""Positions about the dead centres of a joint, for a motion that turns back sharply.

A lever whose pivot lies close to the circle of its crank swings over within a few degrees of the crank: the polynomial
through seven positions (`extremes`) does not follow it. Of a motion q the place of an extreme is off by q̇/q̈ there, as
Newton's method tells it. Where that is more than OFF of the cycle, the gaps on both sides are parted, again and again
until it is less or the gaps are LEAST of the cycle: at a corner of the motion, or where it jumps.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.measures.extremes import FLAT, Extreme, Grid, largest
from trunnion.measures.measures import Measure

if TYPE_CHECKING:
    from trunnion.solve.forward import Forward
    from trunnion.solve.run import Run

__all__ = ["REVERSING", "turning_back"]

REVERSING = ("stroke", "dead_centre", "time_ratio")  # kinds of measures of dead centres
PARTS = 8  # of a gap in a round
FEWEST = 8  # positions from which the shape of a course is known
OFF, LEAST = 1e-8, 1e-9  # of the cycle

Array = NDArray[np.float64]


def turning_back(run: Run, measure: Measure, time: Array, period: float | None) -> Array:
    """Times, s, to be added to those of a window, so that the dead centres of its joint lie among near ones."""
    added = np.zeros(0)
    while len(time) >= FEWEST and (course := _course(run, measure, time, period)) is not None:
        tops = [largest(sign * course, Grid(time, period)) for sign in (1.0, -1.0)]
        more = np.concatenate([_between(top, run) for top in tops if _off(run, measure, top)] or [added[:0]])
        if not len(more):
            break
        time, added = np.union1d(time, more), np.union1d(added, more)
    return added


def _walk(run: Run, time: Array) -> Forward:
    """The motion at times of a window, s."""
    with np.errstate(all="ignore"):
        return run.walk(time % run.cycle.duration if run.cycle.periodic else time)


def _course(run: Run, measure: Measure, time: Array, period: float | None) -> Array | None:
    """The motion of the joint; None where it has no dead centre: it does not move, turns round, or is not solved."""
    motion = primal(measure.curve(_walk(run, time))[0])
    course = np.array(np.broadcast_to(np.asarray(motion, float), time.shape))
    if measure.turning(run.system):
        followed = np.unwrap(course if period is None else np.append(course, course[0]))
        if period is not None and abs(followed[-1] - followed[0]) > np.pi:
            return None
        course = followed[: len(time)]
    return course if np.ptp(course) > FLAT * np.max(np.abs(course)) else None  # no NaN either


def _off(run: Run, measure: Measure, top: Extreme) -> bool:
    """Whether the place of an extreme within the range is not that of a dead centre."""
    walk, part = _walk(run, np.array([float(top.place)])), 0 if run.system.turns(measure.subject) else 1
    rate, second = (float(np.ravel(primal(one(measure.subject)[part]))[0]) for one in (walk.rates, walk.second_rates))
    return bool(top.inside) and not abs(rate) <= OFF * run.cycle.duration * abs(second)


def _between(top: Extreme, run: Run) -> Array:
    """Times, s, that part the gaps beside the position next to an extreme; none where they are as small as can be."""
    at, period, middle = top.grid.at, top.grid.period, int(top.top)
    low, high = at[middle - 1], at[(middle + 1) % len(at)]
    if period is not None:
        low, high = at[middle] - (at[middle] - low) % period, at[middle] + (high - at[middle]) % period
    if high - low < LEAST * run.cycle.duration:
        return np.zeros(0)
    sides = ((low, at[middle]), (at[middle], high))
    found = np.concatenate([np.linspace(*side, PARTS + 1)[1:-1] for side in sides])
    return found if period is None else at[0] + (found - at[0]) % period
