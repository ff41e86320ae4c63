"""Where one state of locking gives way to the next: between two positions, found by bisection."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.locking_states import ROUNDING, LockingRange, LockingState, states
from trunnion.cycle.near_locking import locks, reverse
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["ends"]

Array = NDArray[np.float64]
CLOSE = 1e-3  # degrees of the drive: two decimals are shown
SHARE = 1e-5  # of the drive's travel, where that is not in degrees
ROUNDS = 40


def ends(run: Run, found: xr.Dataset, of: Sequence[LockingRange], near: float) -> list[tuple[str, str]]:
    """First and last coordinate of each range, as a person reads them; of states to 0.01° of the drive.

    found: a result of `locking`; near: the margin below which a range without a state is. With seats of pins, which lie
    elsewhere at each position, ends are positions.
    """
    time, state = found["time"].values, found["locking_state"].values
    dial = run.system.dial(run.values, time)
    told = [(dial.at(one.first), dial.at(one.last)) for one in of]
    if run.seats:
        return told
    places: dict[int, float] = {}  # coordinate of the end behind a position
    behind = np.flatnonzero(np.diff(state) != 0)
    behind = behind[(state[behind] != LockingState.UNSOLVED) & (state[behind + 1] != LockingState.UNSOLVED)]
    if len(behind):
        most = float(np.nanmax(np.abs(found["power_given_reverse"].values), initial=0.0))
        at = _bisected(run, time[behind], time[behind + 1], state[behind], ROUNDING * most)
        places = dict(zip(behind.tolist(), run.system.dial(run.values, at).values.tolist(), strict=True))
    margin = found["locking_margin"].values
    own = [places if one.state is not None else _crossed(dial.values, margin, near) | places for one in of]
    return [
        (_text(known.get(one.first - 1), dial.unit, first), _text(known.get(one.last), dial.unit, last))
        for one, known, (first, last) in zip(of, own, told, strict=True)
    ]


def _bisected(run: Run, low: Array, high: Array, before: NDArray[np.int8], least: float) -> Array:
    """Times, s, at which the state is no longer the one before. least: power that is none, W."""
    for _ in range(ROUNDS):
        dial = run.system.dial(run.values, np.concatenate([low, high]))
        first, last = np.split(dial.values, 2)
        travel = np.ptp(run.system.dial(run.values, run.cycle.times(2)).values)
        if np.all(np.abs(last - first) <= (CLOSE if dial.unit == "°" else SHARE * travel)):
            break
        middle = (low + high) / 2
        same = _state(run, middle, least) == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    middle_of_both: Array = (low + high) / 2
    return middle_of_both


@np.errstate(all="ignore")
def _state(run: Run, time: Array, least: float) -> NDArray[np.int8]:
    """The codes of `LockingState` at some times."""
    back = run.solve(time, method=FrictionMethod())
    other = reverse(run, back.walk, FrictionMethod())
    return states(locks(back), other, np.isfinite(other.given), least)


def _crossed(values: Array, margin: Array, near: float) -> dict[int, float]:
    """Coordinates at which the margin passes the one that is near, linear between positions, by the position before."""
    known = np.isfinite(margin)
    passes = np.flatnonzero(known[:-1] & known[1:] & ((margin[:-1] < near) != (margin[1:] < near)))
    share = (near - margin[passes]) / (margin[passes + 1] - margin[passes])
    places = values[passes] + share * (values[passes + 1] - values[passes])
    return dict(zip(passes.tolist(), places.tolist(), strict=True))


def _text(value: float | None, unit: str, position: str) -> str:
    """A coordinate; that of the position where it has none of its own."""
    if value is None:
        return position
    if unit == "°":
        return f"{round(value, 2) + 0.0:.2f}".rstrip("0").rstrip(".") + unit
    return f"{value:.5g}{unit}"
