"""The states of positions by what friction does forward and backward, and the ranges in which one stays the same."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from math import isfinite, isnan
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Coded
from trunnion.results.quantities import readable
from trunnion.solve.friction_method import MARGIN
from trunnion.solve.system import Dial

if TYPE_CHECKING:
    from trunnion.cycle.near_locking import Passage

__all__ = [
    "HEAD",
    "NEAR",
    "ROUNDING",
    "LockingRange",
    "LockingState",
    "cells",
    "in_order",
    "pushed",
    "ranges_of",
    "rounding",
    "states",
]

ROUNDING = 1e-9  # of the largest power: what is less is no power
NEAR = 1.5  # a locking margin below it counts as near locking, unless another is stated
HEAD = ("state", "from", "to", "smallest margin", "at")  # of the table of ranges


class LockingState(Coded):
    """What friction does at a position: forward, and when all speeds are reversed.

    The loads are all that acts: loads and springs, useful or not, weight and inertia.
    """

    RUNS = 0, "runs; what acts on it pushes it neither backward nor forward"
    BACKDRIVABLE = 1, "can be backdriven: the loads drive it backward, and the drive brakes it"
    SELF_LOCKING = 2, "self-locking: the loads push it backward, but do not overcome friction"
    LOCKED_BACKWARD = 3, "locked backward: no drive effort can move it backward"
    LOCKED = 4, "locked: no drive effort can move it forward"
    JAMMED = 5, "jammed: locked forward and backward"
    UNSOLVED = 6, "not solved"
    SELF_LOCKING_FORWARD = 7, "self-locking: the loads push it forward, but do not overcome friction"
    DRIVEN_ON = 8, "the loads drive it forward, and the drive brakes it"

    @property
    def short(self) -> str:
        """The state in a word or two, for tables and legends."""
        return SHORT[self]


SHORT = {
    LockingState.RUNS: "loads do not push",
    LockingState.BACKDRIVABLE: "can be backdriven",
    LockingState.SELF_LOCKING: "self-locking",
    LockingState.LOCKED_BACKWARD: "locked backward",
    LockingState.LOCKED: "locked",
    LockingState.JAMMED: "jammed",
    LockingState.UNSOLVED: "not solved",
    LockingState.SELF_LOCKING_FORWARD: "self-locking, pushed forward",
    LockingState.DRIVEN_ON: "loads drive it on",
}
PUSHES = (
    LockingState.BACKDRIVABLE, LockingState.SELF_LOCKING, LockingState.SELF_LOCKING_FORWARD, LockingState.DRIVEN_ON,
)  # fmt: skip
NO_MARGIN = (LockingState.LOCKED, LockingState.JAMMED, LockingState.UNSOLVED)  # these are not near locking
PUSHED, HAS_MARGIN = np.isin(list(LockingState), PUSHES), ~np.isin(list(LockingState), NO_MARGIN)  # by code


class LockingRange(NamedTuple):
    """Consecutive positions in one state, or with a margin below the one that counts as near locking.

    state: None of the latter; first, last: numbers of positions; margin: the smallest locking margin in it, NaN if it
    is not known; at: its position.
    """

    state: LockingState | None
    first: int
    last: int
    margin: float
    at: int


def pushed(of: Passage, least: float | None = None) -> NDArray[np.bool_]:
    """Where what acts supplies power to a motion, and no rounding of none: more than the least, W."""
    least = rounding(of) if least is None else least
    found: NDArray[np.bool_] = of.acting > least
    return found


def rounding(of: Passage) -> float:
    """Power that is none, W."""
    return float(ROUNDING * np.nanmax(np.abs([of.acting, of.delivered]), initial=0.0))


def states(ahead: Passage, back: Passage, known: NDArray[np.bool_], least: float | None = None) -> NDArray[np.int8]:
    """The code of `LockingState` of every position. ahead, back: the positions passed forward and backward; known:
    where the forces or the cause of locking are; least: see `pushed`.
    """
    least = rounding(back) if least is None else least
    driven = pushed(back, least) & ~back.locked
    beyond = pushed(ahead, least)
    cases = [
        (~known, LockingState.UNSOLVED),
        (ahead.locked & back.locked, LockingState.JAMMED),
        (ahead.locked, LockingState.LOCKED),
        (back.locked, LockingState.LOCKED_BACKWARD),
        (driven & (back.delivered > 0), LockingState.BACKDRIVABLE),
        (beyond & (-ahead.delivered <= least), LockingState.DRIVEN_ON),
        (driven, LockingState.SELF_LOCKING),
        (beyond, LockingState.SELF_LOCKING_FORWARD),
    ]
    found = np.full(len(known), int(LockingState.RUNS), np.int8)
    for where, state in reversed(cases):
        found[where] = int(state)
    return found


def in_order(ahead: Passage, back: Passage, known: NDArray[np.bool_], least: float | None = None) -> NDArray[np.int8]:
    """`states` of the positions of a cycle in their order. Where the loads have no power at one position alone they
    turn there from backward to forward: a dead centre, which is of the state of what follows."""
    found = states(ahead, back, known, least)
    pushes = PUSHED[found]
    alone = np.zeros(len(found), bool)
    alone[1:-1] = (found[1:-1] == LockingState.RUNS) & pushes[:-2] & pushes[2:]
    held = -ahead.delivered > (rounding(back) if least is None else least)
    found[alone] = np.where(held, LockingState.SELF_LOCKING_FORWARD, LockingState.DRIVEN_ON)[alone]
    return found


def ranges_of(state: NDArray[Any], margin: NDArray[np.float64], near: float = NEAR) -> list[LockingRange]:
    """The intervals in which the state of positions stays the same, in their order; after them those that run, but with
    a margin below `near`."""
    known, states = np.where(np.isnan(margin), np.inf, margin), list(LockingState)

    def worst(first: int, beyond: int) -> tuple[int, int, float, int]:
        at = first + int(np.argmin(known[first:beyond]))
        return first, beyond - 1, float(margin[at]), at

    runs = [LockingRange(states[state[first]], *worst(first, beyond)) for first, beyond in _runs(state)]
    close = (margin < near) & HAS_MARGIN[state]
    return [*runs, *(LockingRange(None, *worst(first, beyond)) for first, beyond in _runs(close) if close[first])]


def _runs(values: NDArray[Any]) -> Iterator[tuple[int, int]]:
    """Consecutive positions of one value: the first one and the one beyond."""
    changes = np.flatnonzero(values[1:] != values[:-1]) + 1
    return itertools.pairwise([0, *changes.tolist(), len(values)])


def cells(one: LockingRange, dial: Dial, near: float = NEAR, ends: Sequence[str] | None = None) -> list[str]:
    """A range as a row of the table with HEAD. ends: of the range, if they are not its first and last position."""
    state = f"margin below {near:g}" if one.state is None else one.state.short
    ends = ends or [dial.at(one.first), dial.at(one.last)]
    if isnan(one.margin):
        return [state, *ends, "—", ""]
    margin = readable(one.margin) if isfinite(one.margin) else f"more than {MARGIN:g}"
    return [state, *ends, margin, dial.at(one.at) if isfinite(one.margin) else ""]
