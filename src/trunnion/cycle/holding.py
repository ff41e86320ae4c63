"""Do the loads drive it backward: how well over the cycle the useful ones do, and which friction holds all of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Accuracy, Courses
from trunnion.algebra.dual import primal
from trunnion.algebra.quadrature import CANCELLED
from trunnion.algebra.roots import root
from trunnion.cycle.locking_states import PUSHES, ROUNDING, LockingState, pushed, states
from trunnion.cycle.near_locking import Passage, passage, passed, reverse
from trunnion.results.figure import Figure
from trunnion.results.scales import extreme_place
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.loads import has_useful_work, useful_loads, useful_springs
from trunnion.solve.switches import accuracy_of, breaks_between
from trunnion.solve.system import Dial, felt, law_of

if TYPE_CHECKING:
    from trunnion.solve.run import Run

__all__ = ["holding_figures", "holding_multiples", "reverse_figure"]

Array = NDArray[np.float64]
LITTLE = 1e-3  # of what the useful loads give: what masses, other loads and springs may supply beside it
BACK = Accuracy(1e-7, shortest=1e-8, rounds=14, most=32)  # beside a locked position each one takes long
SCANNED = 360  # positions at which it is looked how much the loads give
BACK_LOCKED = LockingState.LOCKED_BACKWARD, LockingState.JAMMED
HELD = LockingState.SELF_LOCKING, LockingState.SELF_LOCKING_FORWARD


def reverse_figure(run: Run) -> Figure | None:
    """Power that reaches the drivers over that of the useful loads and springs, backward; None if these do not drive.

    A mean over the cycle, so it is called self-locking only if friction holds the loads wherever they push.
    """
    name, subject = "efficiency_reverse", "efficiency when backdriven by the useful loads" + _centred(run)
    if not has_useful_work(run.system.mechanism):
        return None
    courses = run.once("back", lambda: _reversed(run))
    delivered, given, beside = courses.mean()
    error = np.maximum(courses.error(), CANCELLED * courses.mean(np.abs))
    delivered, given, beside = np.where(np.abs([delivered, given, beside]) <= error, 0.0, [delivered, given, beside])
    if np.isfinite(given) and not given > 0:
        return None
    found = {state for state in LockingState if int(state) in courses.states}
    locked = courses.share(np.isin(courses.states, BACK_LOCKED))
    if locked > 0:
        return Figure(name, subject, None, place=f"in {locked:.2%} of the cycle", note="it locks")
    if LockingState.UNSOLVED in found or not np.isfinite(delivered + given):
        return Figure(name, subject, None, note="not every position is solved")
    if beside > max(np.sum(error[:2]), LITTLE * given):
        return Figure(name, subject, None, note=_beside(run))
    states = found & set(PUSHES)
    value, held = min(float(delivered / given), 1.0), states <= {LockingState.SELF_LOCKING}
    if value <= 0 and held:
        return Figure(name, subject, value, note="self-locking")
    if value <= 0:
        return Figure(name, subject, value, note="it takes work on the whole; see the ranges of `locking`")
    differ = len(states) > 1 and felt(run.system, run.values)
    return Figure(name, subject, value, note="the mean; see the ranges of `locking`" * bool(differ))


@np.errstate(all="ignore")
def _reversed(run: Run) -> Courses:
    """Powers, W, delivered to the drivers, given by the useful loads and by others, backward over the cycle; the states
    of its panels are codes of `LockingState`."""

    def both(time: Array) -> tuple[Passage, Passage]:
        back = run.solve(time if run.cycle.duration > 0 else 0.0 * time, method=FrictionMethod())
        return passage(back), reverse(run, back.walk, FrictionMethod())

    scan = both(run.cycle.times(SCANNED if run.cycle.duration > 0 else 1))[1]
    least = ROUNDING * float(np.nanmax(np.abs(scan.acting), initial=0.0))

    def look(time: Array) -> tuple[Array, NDArray[np.int8]]:
        ahead, other = both(time)
        known = np.isfinite(other.acting)
        powers = np.stack([other.delivered, other.given, other.acting - other.given])
        return powers, states(ahead, other, known, least)

    breaks = breaks_between(run.cycle, run.edges) if run.cycle.duration > 0 else np.array([0.0, 1.0])
    return Courses.of(look, breaks, lambda sizes: 0.0 * sizes + np.max(sizes), accuracy_of(run.cycle, BACK))


def _centred(run: Run) -> str:
    """What the way back is: that of the mechanism without play."""
    return ", pins centred" * bool(run.seats)


def _beside(run: Run) -> str:
    """What supplies work beside the useful loads."""
    mechanism = run.system.mechanism
    loads, springs = useful_loads(mechanism), useful_springs(mechanism)
    sources = {
        "masses": any(link.mass.source != 0 for link in mechanism.effective_links.values()),
        "springs": any(name not in springs for name in mechanism.springs),
        "loads that are not useful": any(name not in loads for name in mechanism.loads),
    }
    others = [source for source, there in sources.items() if there]
    return f"{', '.join(others)} supply work too" if others else "more than 1: not solved accurately enough"


def holding_multiples(run: Run, time: Array, ahead: Passage, back: Passage) -> Array:
    """Multiple of all friction down to which friction holds the loads, at each time, s; NaN where it does not.

    There the power delivered to the drivers, in the direction in which the loads push, rises from 0. 0 where it is
    held without the friction that follows loads. ahead, back: the positions passed forward and backward.
    """
    found = np.full(len(time), np.nan)
    for way, turned in ((ahead, False), (back, True)):
        at = np.flatnonzero(pushed(way) & (way.locked | (way.delivered <= 0)))
        if len(at):
            found[at] = root(_released(run, time[at], turned), np.zeros(len(at)), np.ones(len(at)))
    return found


def _released(run: Run, time: Array, turned: bool) -> Callable[[Array], Array]:
    """Power delivered to the drivers at these times, W, for multiples of all friction; turned: when run backward."""
    walk = run.walk(time).backward() if turned else run.walk(time)

    @np.errstate(all="ignore")
    def off(multiple: Array) -> Array:
        there = passed(run, walk, FrictionMethod(multiple=multiple))
        return np.where(there.locked, -np.abs(there.acting), there.delivered)

    return off


def holding_figures(run: Run, multiples: Array, state: NDArray[np.int8], dial: Dial) -> list[Figure]:
    """From which friction on it holds: wherever the loads push, if it does, else at the end of its range, if there.

    None where it holds even without, as where masses take more than the loads give.
    """
    held = np.flatnonzero(np.isfinite(multiples))
    everywhere = len(held) and {one for one in PUSHES if one in state} <= set(HELD)
    if not everywhere and (run.cycle.periodic or len(multiples) - 1 not in held):
        return []
    at = int(np.nanargmax(multiples)) if everywhere else len(multiples) - 1
    if not multiples[at] > 0:
        return []
    aspect, subject = "maximum" * bool(everywhere), "down to which it is self-locking" + _centred(run)
    place, multiple = extreme_place(multiples, f"at {dial.at(at)}"), float(multiples[at])
    forward = state[at] == LockingState.SELF_LOCKING_FORWARD
    note = "below it the loads drive it on, onto a stop there" * bool(forward and not run.cycle.periodic)
    figures = [Figure("holding_multiple", f"multiple of all friction {subject}", multiple, "1", aspect, place, note)]
    paths = {f"joints.{joint}.friction.{law_of(run.system, joint).scale}" for joint in felt(run.system, run.values)}
    same = {float(np.ravel(primal(run.values[path]))[0]) if path in run.values else np.nan for path in paths}
    if len(same) == 1 and np.isfinite(value := same.pop()):
        figures.append(
            Figure("holding_coefficient", f"friction coefficient {subject}", multiple * value, "1", aspect, place, note)
        )
    return figures
