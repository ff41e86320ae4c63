"""The states of positions by what friction does forward and backward, and the ranges in which one stays the same."""

from __future__ import annotations

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
    from trunnion.cycle.near_locking import Reverse

__all__ = ["HEAD", "NEAR", "ROUNDING", "LockingRange", "LockingState", "cells", "pushed", "ranges_of", "states"]

ROUNDING = 1e-9  # of the largest power: what is less is no power
NEAR = 1.5  # a locking margin below it counts as near locking, unless another is stated
HEAD = ("state", "from", "to", "smallest margin", "at")  # of the table of ranges


class LockingState(Coded):
    """What friction does at a position: forward, and when all speeds are reversed."""

    RUNS = 0, "runs; the useful loads do not push it backward"
    BACKDRIVABLE = 1, "can be backdriven by the useful loads"
    SELF_LOCKING = 2, "self-locking: the useful loads push it backward, but do not overcome friction"
    LOCKED_BACKWARD = 3, "locked backward: no drive effort can move it backward"
    LOCKED = 4, "locked: no drive effort can move it forward"
    JAMMED = 5, "jammed: locked forward and backward"
    UNSOLVED = 6, "not solved"

    @property
    def short(self) -> str:
        """The state in a word or two, for tables and legends."""
        return SHORT[self]


SHORT = {
    LockingState.RUNS: "loads do not push back",
    LockingState.BACKDRIVABLE: "can be backdriven",
    LockingState.SELF_LOCKING: "self-locking",
    LockingState.LOCKED_BACKWARD: "locked backward",
    LockingState.LOCKED: "locked",
    LockingState.JAMMED: "jammed",
    LockingState.UNSOLVED: "not solved",
}


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


def pushed(back: Reverse, least: float | None = None) -> NDArray[np.bool_]:
    """Where the useful loads supply power backward, and no rounding of none: more than the least, W."""
    least = ROUNDING * np.nanmax(np.abs(back.given), initial=0.0) if least is None else least
    found: NDArray[np.bool_] = back.given > least
    return found


def states(
    ahead: NDArray[np.bool_], back: Reverse, known: NDArray[np.bool_], least: float | None = None
) -> NDArray[np.int8]:
    """The code of `LockingState` of every position. ahead: where it is locked forward; known: where the forces or the
    cause of locking are; least: see `pushed`."""
    behind = back.locked
    driven = pushed(back, least) & ~behind
    cases = [
        (~known, LockingState.UNSOLVED),
        (ahead & behind, LockingState.JAMMED),
        (ahead, LockingState.LOCKED),
        (behind, LockingState.LOCKED_BACKWARD),
        (driven & (back.delivered > 0), LockingState.BACKDRIVABLE),
        (driven, LockingState.SELF_LOCKING),
    ]
    return np.select([of for of, _ in cases], [int(state) for _, state in cases], int(LockingState.RUNS)).astype(
        np.int8
    )


def ranges_of(state: NDArray[Any], margin: NDArray[np.float64], near: float = NEAR) -> list[LockingRange]:
    """The intervals in which the state of positions stays the same, in their order; after them those that run, but with
    a margin below `near`."""
    runs = [LockingRange(list(LockingState)[int(state[run[0]])], *_worst(run, margin)) for run in _runs(state)]
    close = (margin < near) & (state < LockingState.LOCKED)
    return [*runs, *(LockingRange(None, *_worst(run, margin)) for run in _runs(close) if close[run[0]])]


def _runs(values: NDArray[Any]) -> Iterator[NDArray[np.intp]]:
    """Numbers of consecutive positions of one value."""
    yield from np.split(np.arange(len(values)), np.flatnonzero(np.diff(values)) + 1)


def _worst(run: NDArray[np.intp], margin: NDArray[np.float64]) -> tuple[int, int, float, int]:
    """First and last of some positions, their smallest margin and where it is."""
    own = margin[run]
    at = int(run[np.nanargmin(own)]) if np.any(np.isfinite(own)) else int(run[0])
    return int(run[0]), int(run[-1]), float(margin[at]), at


def cells(one: LockingRange, dial: Dial, near: float = NEAR, ends: Sequence[str] | None = None) -> list[str]:
    """A range as a row of the table with HEAD. ends: of the range, if they are not its first and last position."""
    state = f"margin below {near:g}" if one.state is None else one.state.short
    ends = ends or [dial.at(one.first), dial.at(one.last)]
    if isnan(one.margin):
        return [state, *ends, "—", ""]
    margin = readable(one.margin) if isfinite(one.margin) else f"more than {MARGIN:g}"
    return [state, *ends, margin, dial.at(one.at) if isfinite(one.margin) else ""]
