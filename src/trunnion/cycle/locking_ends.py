"""Where one state of locking gives way to the next: between two positions, found by bisection."""

from __future__ import annotations

from collections.abc import Sequence
from math import floor, log10
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.locking_states import ROUNDING, LockingRange, LockingState, cells, ranges_of, states
from trunnion.cycle.near_locking import passage, reverse
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["ends", "told"]

Array = NDArray[np.float64]
Ends = tuple[float | None, float | None]
CLOSE = 1e-3  # degrees of the drive: two decimals are shown
SHARE = 1e-5  # of the drive's travel, where that is not in degrees
ROUNDS = 40


def told(run: Run, found: xr.Dataset, near: float) -> dict[str, Any]:
    """The ranges of a result of `locking` for its attribute `locking_ranges`: see `docs/reference/results.md`."""
    of = ranges_of(found["locking_state"].values, found["locking_margin"].values, near)
    dial = run.system.dial(run.values, found["time"].values)
    places, accuracy = _places(run, found, of, near), _accuracy(run, dial.unit)
    rows = [
        {"state": "" if one.state is None else one.state.name.lower(), "first": one.first,
         "count": one.last - one.first + 1, "cells": cells(one, dial, near, text),
         "ends": [None if end is None else _rounded(end, accuracy) for end in own]}
        for one, own, text in zip(of, places, _texts(run, found, of, places), strict=True)
    ]  # fmt: skip
    return {"of": dial.of, "unit": dial.unit.strip(), "positions": found.sizes["position"], "near": near, "rows": rows}


def ends(run: Run, found: xr.Dataset, of: Sequence[LockingRange], near: float) -> list[tuple[str, str]]:
    """First and last coordinate of each range, as a person reads them; of states to 0.01° of the drive.

    found: a result of `locking`; near: the margin below which a range without a state is. With seats of pins, which lie
    elsewhere at each position, ends are positions.
    """
    return _texts(run, found, of, _places(run, found, of, near))


def _texts(run: Run, found: xr.Dataset, of: Sequence[LockingRange], places: Sequence[Ends]) -> list[tuple[str, str]]:
    """The ends of ranges in words."""
    dial = run.system.dial(run.values, found["time"].values)
    accuracy = _accuracy(run, dial.unit)
    return [
        (_text(low, dial.unit, accuracy, dial.at(one.first)), _text(high, dial.unit, accuracy, dial.at(one.last)))
        for one, (low, high) in zip(of, places, strict=True)
    ]


def _places(run: Run, found: xr.Dataset, of: Sequence[LockingRange], near: float) -> list[Ends]:
    """The ends of ranges that lie between positions; None of those that are positions."""
    if run.seats:
        return [(None, None)] * len(of)
    time, state = found["time"].values, found["locking_state"].values
    behind = np.flatnonzero(np.diff(state) != 0)
    behind = behind[(state[behind] != LockingState.UNSOLVED) & (state[behind + 1] != LockingState.UNSOLVED)]
    places: dict[int, float] = {}  # coordinate of the end behind a position
    if len(behind):
        powers = [found[f"power_{name}_reverse"].values for name in ("acting", "delivered")]
        least = float(ROUNDING * np.nanmax(np.abs(powers), initial=0.0))
        at = _bisected(run, time[behind], time[behind + 1], state[behind], least)
        places = dict(zip(behind.tolist(), run.system.dial(run.values, at).values.tolist(), strict=True))
    values, margin = run.system.dial(run.values, time).values, found["locking_margin"].values
    own = [places if one.state is not None else _crossed(values, margin, near) | places for one in of]
    return [(known.get(one.first - 1), known.get(one.last)) for one, known in zip(of, own, strict=True)]


def _accuracy(run: Run, unit: str) -> float:
    """To which ends are found, in the unit of the drive."""
    return CLOSE if unit == "°" else SHARE * float(np.ptp(run.system.dial(run.values, run.cycle.times(2)).values))


def _bisected(run: Run, low: Array, high: Array, before: NDArray[np.int8], least: float) -> Array:
    """Times, s, at which the state is no longer the one before. least: power that is none, W."""
    for _ in range(ROUNDS):
        dial = run.system.dial(run.values, np.concatenate([low, high]))
        first, last = np.split(dial.values, 2)
        if np.all(np.abs(last - first) <= _accuracy(run, dial.unit)):
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
    return states(passage(back), other, np.isfinite(other.acting), least)


def _crossed(values: Array, margin: Array, near: float) -> dict[int, float]:
    """Coordinates at which the margin passes the one that is near, linear between positions, by the position before."""
    known = np.isfinite(margin)
    passes = np.flatnonzero(known[:-1] & known[1:] & ((margin[:-1] < near) != (margin[1:] < near)))
    share = (near - margin[passes]) / (margin[passes + 1] - margin[passes])
    places = values[passes] + share * (values[passes + 1] - values[passes])
    return dict(zip(passes.tolist(), places.tolist(), strict=True))


def _rounded(value: float, accuracy: float) -> float:
    """A coordinate to the decimal that is above its accuracy, so that an end at 0 is 0."""
    return round(value, floor(-log10(accuracy))) + 0.0 if accuracy > 0 else value


def _text(value: float | None, unit: str, accuracy: float, position: str) -> str:
    """A coordinate; that of the position where it has none of its own."""
    if value is None:
        return position
    if unit == "°":
        return f"{round(value, 2) + 0.0:.2f}".rstrip("0").rstrip(".") + unit
    return f"{_rounded(value, accuracy):.5g}{unit}"
