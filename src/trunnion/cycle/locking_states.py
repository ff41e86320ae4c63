"""The states of locking: what friction does forward and backward, and the ranges in which one stays the same."""

from __future__ import annotations

from collections.abc import Sequence
from math import floor, isfinite, isnan, log10
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Coded
from trunnion.results.quantities import readable
from trunnion.solve.friction_method import MARGIN

if TYPE_CHECKING:
    from trunnion.cycle.passage import Passage
    from trunnion.solve.run import Run

__all__ = ["HEAD", "NEAR", "LockingRange", "LockingState", "on_dial", "states"]

Array = NDArray[np.float64]
NEAR = 1.5  # a locking margin below it counts as near locking, unless another is stated
HEAD = ("state", "from", "to", "smallest margin", "at")  # of the table of ranges
CLOSE = 1e-3  # degrees of the drive to which an end is told: two decimals are shown
SHARE = 1e-5  # of the drive's travel, where that is not in degrees


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
PUSHES = {
    LockingState.BACKDRIVABLE, LockingState.SELF_LOCKING, LockingState.SELF_LOCKING_FORWARD, LockingState.DRIVEN_ON,
}  # fmt: skip
HELD = {LockingState.SELF_LOCKING, LockingState.SELF_LOCKING_FORWARD}
HELD_AND_DRIVEN = {LockingState.SELF_LOCKING_FORWARD, LockingState.DRIVEN_ON}
NO_MARGIN = (LockingState.LOCKED, LockingState.JAMMED, LockingState.UNSOLVED)  # these are not near locking
BACK_LOCKED = (LockingState.LOCKED_BACKWARD, LockingState.JAMMED)


class LockingRange(NamedTuple):
    """A part of the cycle in one state, or with a margin below the one that counts as near locking.

    state: None of the latter; low, high: its ends, s; margin: the smallest locking margin in it, ∞ beyond what is
    looked for, NaN if it is not known; at: where, in words; ends, places: on the dial of the drive, and in words.
    """

    state: LockingState | None
    low: float
    high: float
    margin: float
    at: str
    ends: list[float]
    places: list[str]

    def cells(self, near: float = NEAR) -> list[str]:
        """The row of the table with HEAD."""
        state = f"margin below {near:g}" if self.state is None else self.state.short
        margin = (
            "—" if isnan(self.margin) else readable(self.margin) if isfinite(self.margin) else f"more than {MARGIN:g}"
        )
        return [state, *self.places, margin, self.at]


def on_dial(run: Run, times: Sequence[float]) -> tuple[list[float], list[str]]:
    """Times, s, on the dial of the drive, as accurately as they are known, and as a person reads them."""
    dial = run.system.dial(run.values, np.array([*times, 0.0, run.cycle.duration]))
    accuracy = CLOSE if dial.unit == "°" else SHARE * float(np.ptp(dial.values[-2:]))
    digits = floor(-log10(accuracy)) if accuracy > 0 else 15
    values = [round(float(value), digits) + 0.0 for value in dial.values[:-2]]  # so that an end at 0 is 0
    if dial.unit == "°":
        return values, [f"{round(value, 2) + 0.0:.2f}".rstrip("0").rstrip(".") + "°" for value in values]
    return values, [f"{value:.5g}{dial.unit}" for value in values]


def states(ahead: Passage, back: Passage, known: NDArray[np.bool_], least: float) -> NDArray[np.int8]:
    """The code of `LockingState` at some times.

    Parameters
    ----------
    ahead, back
        The mechanism as it is passed forward and backward.
    known
        Where the forces, or the cause of locking, are.
    least
        Power, W, that is rounding of none.
    """
    driven, beyond = (back.acting > least) & ~back.locked, ahead.acting > least
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
    where, codes = zip(*cases, strict=True)
    return np.select(where, [int(code) for code in codes], int(LockingState.RUNS)).astype(np.int8)
