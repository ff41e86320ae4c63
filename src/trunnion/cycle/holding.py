"""Do the loads drive it backward: how well over the cycle the useful ones do, and which friction holds all of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.quadrature import CANCELLED, integrals
from trunnion.algebra.roots import root
from trunnion.cycle.locking_states import PUSHES, LockingState, pushed
from trunnion.cycle.near_locking import Passage, passed, reverse
from trunnion.errors import counted
from trunnion.results.figure import Figure
from trunnion.results.scales import extreme_place
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.loads import has_useful_work, useful_loads, useful_springs
from trunnion.solve.system import Dial, felt, law_of

if TYPE_CHECKING:
    from trunnion.solve.run import Run

__all__ = ["holding_figures", "holding_multiples", "reverse_figure"]

Array = NDArray[np.float64]
LITTLE = 1e-3  # of what the useful loads give: what masses, other loads and springs may supply beside it
HELD = LockingState.SELF_LOCKING, LockingState.SELF_LOCKING_FORWARD


def reverse_figure(run: Run, back: Passage, state: NDArray[np.int8]) -> Figure | None:
    """Power that reaches the drivers over that of the useful loads and springs, backward; None if these do not drive.

    A mean, so it is called self-locking only if friction holds the loads wherever they push. state: codes of
    `LockingState`.
    """
    name, subject = "efficiency_reverse", "efficiency when backdriven by the useful loads" + _centred(run)
    if not has_useful_work(run.system.mechanism):
        return None
    delivered, given, beside, error = _reversed_means(run, back)
    if np.all(np.isfinite(back.given)) and not given > 0:
        return None
    if np.any(back.locked):
        places = counted(int(np.count_nonzero(back.locked)), "position")
        return Figure(name, subject, None, place=f"at {places}", note="it locks")
    if not np.isfinite(delivered + given) or not np.all(np.isfinite(back.given + back.delivered)):
        return Figure(name, subject, None, note="not every position is solved")
    if beside > max(error, LITTLE * given):
        return Figure(name, subject, None, note=_beside(run))
    states = {one for one in PUSHES if one in state}
    value, held = min(delivered / given, 1.0), states <= {LockingState.SELF_LOCKING}
    if value <= 0 and held:
        return Figure(name, subject, value, note="self-locking")
    if value <= 0:
        return Figure(name, subject, value, note="it takes work on the whole; see the ranges of `locking`")
    differ = len(states) > 1 and felt(run.system, run.values)
    return Figure(name, subject, value, note="the mean; see the ranges of `locking`" * bool(differ))


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


def _reversed_means(run: Run, back: Passage) -> tuple[float, float, float, float]:
    """Mean powers, W, delivered, given by the useful loads, and by all else that acts, backward, 0 where they cancel,
    and the error of the first two; that of the useful loads is known where it locks."""
    if run.cycle.duration <= 0:
        delivered, given, acting = (float(part[0]) for part in (back.delivered, back.given, back.acting))
        return delivered, given, acting - given, CANCELLED * abs(given)
    if np.any(back.locked):  # then there is no mean to be delivered, and of the other one the sign is asked for
        return float("nan"), float(np.mean(back.given)), 0.0, 0.0

    def powers(rows: NDArray[np.intp], time: Array) -> Array:
        there = reverse(run, run.walk(time.ravel()), FrictionMethod())
        return np.stack([there.delivered, there.given, there.acting - there.given]).reshape(3, *time.shape)

    found = run.once("back", lambda: integrals(powers, [run.edges]))
    value, error = found.value[:, 0], np.maximum(found.error[:, 0], CANCELLED * found.size[:, 0])
    delivered, given, beside = (np.where(np.abs(value) <= error, 0.0, value) / run.cycle.duration).tolist()
    return delivered, given, beside, float(np.sum(error[:2])) / run.cycle.duration


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
