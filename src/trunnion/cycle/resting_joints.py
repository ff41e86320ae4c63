"""Least and largest drive effort where a joint rests: what resists it there may be anything between two ends.

The effort is no linear function of that resistance, for other joints rub the more the harder they are pressed. It may
have its least or largest value anywhere between the ends, and is looked for there.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion.solve.friction_method import FrictionMethod

if TYPE_CHECKING:
    from trunnion.solve.run import Run

__all__ = ["bracket"]

Array = NDArray[np.float64]
Arrays = dict[str, NDArray[np.float64]]
Positions = NDArray[np.intp]

LANES = 8192  # solved at once
FEW = 32  # positions: those of a joint that rests where it turns round, not throughout a dwell
GRID = (-1.0, -0.5, 0.0, 0.5, 1.0)  # shares of the resistance of each contact that are tried first
STEP = 0.5  # of the grid
FLAT = 1e-9  # of the interval: a rise beside a grid point that is less is not followed
# of the search about the highest: points along each contact, rounds, and what is left of the window after each: the
# place is found to some 1e-8 for one contact and 1e-6 for two, the value at a smooth top to the square of that
SEARCH = {1: (9, 16, 0.3), 2: (7, 12, 0.35)}


def bracket(
    arrays: Arrays,
    run: Run,
    time: Array,
    method: FrictionMethod,
    resting: Mapping[str, Positions],
    seats: Mapping[str, Array],
) -> None:
    """Fill drive_effort_lower and drive_effort_upper.

    One resting joint at a position: the extremes over its resistance; several: their separate effects are added
    (first order). resting: positions at which a joint does; seats: of the pins, by path, over all positions.
    """
    if not resting or not run.system.mechanism.drivers:
        return  # both are the effort itself, or there is none
    lower = arrays["drive_effort_lower"] = arrays["drive_effort"].copy()
    upper = arrays["drive_effort_upper"] = arrays["drive_effort"].copy()
    for joint, positions in resting.items():
        some = LANES // len(GRID) ** run.system.resting(joint)
        for low in range(0, len(positions), some):
            part = positions[low : low + some]
            offsets = {path: numbers[part] for path, numbers in seats.items()}
            one = _Resting(run, joint, time[part], offsets, method)
            # with pins held in both, so that what their travel adds to the effort is none of the interval
            own = one.efforts(np.zeros((one.count, len(part)))) if offsets else arrays["drive_effort"][:, part]
            least, most = _once(one, own, part)
            lower[:, part] += least
            upper[:, part] += most


def _once(one: _Resting, own: Array, positions: Positions) -> tuple[Array, Array]:
    """The extremes, found once for a few positions that are asked for again."""
    if len(positions) > FEW or one.offsets:
        return one.extremes(own)
    key = "resting", one.joint, one.time.tobytes(), own.tobytes(), one.method
    return one.run.once(key, lambda: one.extremes(own))


@dataclass(frozen=True)
class _Resting:
    """A joint at positions at which it rests."""

    run: Run
    joint: str
    time: Array
    offsets: Mapping[str, Array]
    method: FrictionMethod

    @property
    def count(self) -> int:
        """Contacts that may rest."""
        return self.run.system.resting(self.joint)

    def efforts(self, shares: Array, lanes: Positions | None = None) -> Array:
        """(driver, lane) under these shares of the resistance of each contact, (contact, lane), from −1 to 1."""
        chosen = np.arange(len(self.time)) if lanes is None else lanes
        offsets = {path: numbers[chosen] for path, numbers in self.offsets.items()}
        found = self.run.at(self.time[chosen], offsets, self.method, {self.joint: tuple(shares)}).efforts
        drivers = self.run.system.mechanism.drivers
        return np.array([np.broadcast_to(found[name], chosen.shape) for name in drivers]).reshape(len(drivers), -1)

    def extremes(self, own: Array) -> tuple[Array, Array]:
        """By how much the effort may be less and more than its own, (driver, position) each; NaN where it may lock."""
        tried = np.array(list(itertools.product(GRID, repeat=self.count))).T  # (contact, share)
        change = self._at(tried[:, :, None], np.arange(len(self.time))) - own[:, None, :]
        change[:, ~np.any(tried, axis=0)] = 0.0
        ends = [[sign * self._highest(sign * change[i], own[i], i, sign) for i in range(len(own))] for sign in (-1, 1)]
        return np.array(ends[0]).reshape(own.shape), np.array(ends[1]).reshape(own.shape)

    def _at(self, shares: Array, lanes: Positions) -> Array:
        """(driver, share, lane) of shares (contact, share, lane)."""
        shape = (shares.shape[1], len(lanes))
        each = np.broadcast_to(shares, (self.count, *shape)).reshape(self.count, -1)
        found: Array = self.efforts(each, np.tile(lanes, shape[0])).reshape(-1, *shape)
        return found

    def _highest(self, change: Array, own: Array, driver: int, sign: float) -> Array:
        """Largest of sign · (effort of one driver − its own) from its values on the grid, (share, lane)."""
        shape = (len(GRID),) * self.count
        top = np.array(np.unravel_index(np.argmax(_known(change), axis=0), shape))  # (contact, lane)
        spot: Array = np.array(GRID)[top]
        value: Array = np.max(change, axis=0)
        cube = change.reshape(*shape, -1)
        rising = [_rises(np.moveaxis(cube, i, 0), np.delete(top, i, 0), top[i]) for i in range(self.count)]
        lanes = np.flatnonzero(np.any(rising, axis=0) & np.isfinite(value))
        if not len(lanes):
            return value
        points, rounds, left = SEARCH[self.count]
        window = STEP * np.array(list(itertools.product(np.linspace(-1.0, 1.0, points), repeat=self.count))).T
        at, most = spot[:, lanes], value[lanes]
        for _ in range(rounds):
            shares = np.clip(at[:, None, :] + window[:, :, None], -1.0, 1.0)
            found = _known(sign * (self._at(shares, lanes)[driver] - own[lanes]))
            best, lane = np.argmax(found, axis=0), np.arange(len(lanes))
            better = found[best, lane] > most
            at = np.where(better, shares[:, best, lane], at)
            most = np.where(better, found[best, lane], most)
            window = left * window
        value[lanes] = most
        return value


def _known(values: Array) -> Array:
    return np.where(np.isnan(values), -np.inf, values)


def _rises(cube: Array, others: Positions, top: Positions) -> NDArray[np.bool_]:
    """Whether a parabola through the highest grid point and its neighbours along one contact rises above it.

    cube: (share of that contact, shares of the others…, lane); at an end the two points beside it are taken.
    """
    line = cube[(slice(None), *others, np.arange(len(top)))]
    middle = np.clip(top, 1, len(GRID) - 2)
    lane = np.arange(len(top))
    before, here, after = (line[middle + step, lane] for step in (-1, 0, 1))
    bend, slope = after - 2.0 * here + before, (after - before) / 2.0
    with np.errstate(all="ignore"):
        vertex = np.where(bend < 0.0, -slope / bend, np.inf) + middle
        height = here - slope * slope / (2.0 * np.where(bend < 0.0, bend, -np.inf))
    inside = (vertex > 0.0) & (vertex < len(GRID) - 1)
    span = np.ptp(line, axis=0)
    return np.asarray(inside & (height > line[top, lane] + FLAT * span))
