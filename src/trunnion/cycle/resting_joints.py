"""Least and largest drive effort where a joint rests: what resists it there may be anything between two ends.

The effort is no linear function of that resistance, for other joints rub the more the harder they are pressed, and it
bends where a guide tilts over. It may have its least or largest value anywhere between the ends, and is looked for
there, for one contact after the other.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.panels import POINTS
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run
from trunnion.solve.seating import Seating

__all__ = ["bracket"]

Array = NDArray[np.float64]

LANES = 512  # positions solved at once, each with many shares
FEW = 32  # positions: those of a joint that rests where it turns round, not throughout a dwell
SHARES = np.concatenate([[-1.0], POINTS, [1.0]])  # of the resistance of a contact; they are close at the ends
FLAT = 1e-9  # of the effort: where it rises by less between the ends it is followed no farther
CLOSER, ZOOMED = 7, 18  # places between the neighbours of the highest, and how often these are narrowed
ROUNDS = 3  # of several contacts, each by itself: they hardly depend on one another


def bracket(
    arrays: dict[str, Array],
    run: Run,
    time: Array,
    method: FrictionMethod,
    resting: Mapping[str, NDArray[np.intp]],
    seating: Seating | None,
) -> None:
    """Fill drive_effort_lower and drive_effort_upper.

    One resting joint at a position: the extremes over its resistance; several: their separate effects are added
    (first order). resting: positions at which a joint does; seating: where pins lie, if not in the middle.
    """
    if not resting or not run.system.mechanism.drivers:
        return  # both are the effort itself, or there is none
    ends = {sign: arrays["drive_effort"].copy() for sign in (-1.0, 1.0)}
    for joint, positions in resting.items():
        again = len(positions) <= FEW and not seating  # a few are asked for again and again
        for low in range(0, len(positions), LANES):
            part = positions[low : low + LANES]
            rests = _Resting(run, joint, time[part], seating.offsets(time[part]) if seating else {}, method)
            key = ("resting", joint, rests.time.tobytes(), method)
            for sign, change in (run.once(key, rests.changes) if again else rests.changes()).items():
                ends[sign][:, part] += change
    arrays["drive_effort_lower"], arrays["drive_effort_upper"] = ends.values()


@dataclass(frozen=True)
class _Resting:
    """A joint at positions at which it rests, pins held in their seats."""

    run: Run
    joint: str
    time: Array
    offsets: Mapping[str, Array]
    method: FrictionMethod

    def efforts(self, shares: Array, lanes: NDArray[np.intp]) -> Array:
        """(driver, share, lane) under shares of the resistance of each contact, −1 to 1, (contact, share, lane)."""
        count, drivers = shares.shape[1], self.run.system.mechanism.drivers
        offsets = {path: np.tile(row[lanes], count) for path, row in self.offsets.items()}
        senses = {self.joint: tuple(shares.reshape(len(shares), -1))}
        efforts = self.run.at(np.tile(self.time[lanes], count), offsets, self.method, senses).efforts
        rows = [np.broadcast_to(efforts[name], count * len(lanes)) for name in drivers]
        return np.array(rows).reshape(len(drivers), count, -1)

    def changes(self) -> dict[float, Array]:
        """By how much each effort may be less, sign −1, and more, 1, (driver, lane); NaN where it may lock."""
        contacts, lanes = self.run.system.resting(self.joint), np.arange(len(self.time))
        spots = np.zeros((contacts, 1 + len(SHARES), len(lanes)))
        spots[0, 1:] = SHARES[:, None]
        efforts = self.efforts(spots, lanes)
        return {sign: self._change(sign, efforts[:, 0], efforts[:, 1:]) for sign in (-1.0, 1.0)}

    def _change(self, sign: float, middle: Array, first: Array) -> Array:
        """first: the efforts under shares of the first contact's resistance alone, from which its search sets out."""
        contacts, every = self.run.system.resting(self.joint), np.arange(len(self.time))
        most, best = np.zeros(middle.shape), np.zeros((len(middle), contacts, len(every)))
        for driver, at_rest in enumerate(middle):
            for contact in list(range(contacts)) * (ROUNDS if contacts > 1 else 1):
                lanes, spots = every, np.repeat(SHARES[:, None], len(every), axis=1)
                for round_ in range(ZOOMED):
                    tried = np.repeat(best[driver][:, None, lanes], len(spots), axis=1)
                    tried[contact] = spots
                    alone = round_ == 0 and contact == 0 and not np.any(best[driver])
                    values = sign * ((first if alone else self.efforts(tried, lanes))[driver] - at_rest[lanes])
                    k, lane = np.argmax(values, axis=0), np.arange(len(lanes))  # of one without a value, if any
                    better = ~(values[k, lane] <= most[driver, lanes])
                    most[driver, lanes[better]] = values[k, lane][better]
                    best[driver, contact, lanes[better]] = spots[k, lane][better]
                    least = np.maximum(values[0], values[-1]) + FLAT * (np.abs(at_rest[lanes]) + np.ptp(values, axis=0))
                    rises = values[k, lane] > least
                    lanes, k, lane = lanes[rises], k[rises], lane[rises]
                    if not len(lanes):
                        break
                    spots = np.linspace(spots[k - 1, lane], spots[k + 1, lane], CLOSER)
        return sign * most
