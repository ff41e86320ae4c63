"""A coordinate at rest in friction: what would break it away, and for how long it stays."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.dynamics.guards import first_crossing
from trunnion.dynamics.rates import Layout, works_of
from trunnion.dynamics.state import FreeMotion, Moment
from trunnion.solve.backward import Backward

__all__ = ["Rest"]

Array = NDArray[np.float64]

SCANNED = 200  # times of a rest at which what drives it is looked at, where that changes
SHARES = 40  # bisections of the share of the friction that acts at rest
PANELS, NODES = 16, 8  # of a rest, and places in each at which powers are asked for


@dataclass(frozen=True)
class Rest:
    """The one free coordinate of a mechanism at rest: all joints rest with it, unless others are driven.

    It stays while what drives it lies between the efforts that the walk demands at the brink of moving backward and
    forward, every friction and resisting load against that motion, at its value for slip 0. slips: sense in which a
    clutch of its motor slips meanwhile.
    """

    motion: FreeMotion
    layout: Layout
    slips: float = 0.0

    def _moment(self, time: Array, row: Array, begin: float, sense: float, now: float) -> Moment:
        rows = self.held(begin, row, time)
        return self.layout.moment(time, rows, sense, now, self.slips)

    def held(self, begin: float, row: Array, time: Array) -> Array:
        """The state at times of a rest that began at a time in a row: only controllers move on."""
        rows = np.repeat(row[:, None], len(time), axis=1)
        (drive,), n = self.motion.drives.values(), self.layout.coordinates
        rows[2 * n] = drive.waiting(time - begin, row[2 * n], begin)
        return rows

    def beyond(self, time: Array, row: Array, begin: float, now: float) -> tuple[Array, Array]:
        """By how much what drives it exceeds the break-away effort forward and backward, N m or N; both < 0 at rest."""
        efforts = []
        for sense in (1.0, -1.0):
            at = self._moment(time, row, begin, sense, now)
            zero = np.zeros_like(at.q)
            with np.errstate(all="ignore"):
                demanded = self.motion.demanded(self.motion.solve(at, zero), at.q.shape)
                drive_given = self.motion.given(at, zero)
            miss = sense * (drive_given - demanded)[0]
            efforts.append(np.where(np.isfinite(demanded[0]), miss, -np.inf))  # no solution: it locks, that way
        return efforts[0], efforts[1]

    def sense(self, time: float, row: Array, now: float) -> float:
        """+1, −1: which way it moves on; 0: it stays."""
        forward, backward = (float(effort[0]) for effort in self.beyond(np.array([time]), row, time, now))
        if forward <= 0.0 and backward <= 0.0:
            return 0.0
        return 1.0 if forward >= backward else -1.0

    def until(self, time: float, row: Array, until: float, now: float) -> float:
        """The time at which it breaks away, or the end of the stretch."""
        if not self._changes:
            return until
        times = np.linspace(time, until, SCANNED + 1)[1:]
        crossing = first_crossing(lambda moments: -np.maximum(*self.beyond(moments, row, time, now))[None], time, times)
        return until if crossing is None else crossing.time

    @property
    def _changes(self) -> bool:
        """Whether anything may change while it rests."""
        system = self.motion.system
        varies = any(entry.varies for entry in system.mechanism.parameter_set.entries.values())
        return self.driven or varies or any(drive.timed for drive in self.motion.drives.values())

    def shares(self, at: Moment) -> Array:
        """The share of the friction, of the same part in every joint, that holds each lane at rest; from −1 to 1."""
        zero = np.zeros_like(at.q)
        low, high = np.full(at.q.shape[1], -1.0), np.full(at.q.shape[1], 1.0)
        drive_given = self.motion.given(at._replace(sense=0.0), zero)[0]
        for _ in range(SHARES):
            middle = 0.5 * (low + high)
            senses = self.motion.beginning(at._replace(sense=1.0), middle)
            demanded = self.motion.demanded(self.motion.solve(at, zero, senses), at.q.shape)[0]
            less = demanded < drive_given
            low, high = np.where(less, middle, low), np.where(less, high, middle)
        shares: Array = 0.5 * (low + high)
        return shares

    # ---- what is done meanwhile -------------------------------------------------------------------------------

    @property
    def driven(self) -> bool:
        """Whether prescribed drivers move other links meanwhile, so that work is done."""
        return any(name not in self.motion.drives for name in self.motion.system.mechanism.drivers)

    def back(self, at: Moment) -> Backward:
        """Motion and forces at rest, with the share of the friction that holds it."""
        senses = self.motion.beginning(at._replace(sense=1.0), self.shares(at))
        return self.motion.solve(at, np.zeros_like(at.q), senses)

    def powers(self, at: Moment) -> Array:
        """What goes into the works of `rates.WORKS`, W, (work, lane)."""
        with np.errstate(all="ignore"):
            powers = works_of(self.back(at), at, self.motion.contacts)
            return np.array([np.broadcast_to(primal(power), at.q.shape[1]) for power in powers], float)

    def meanwhile(self, begin: float, row: Array, end: float, now: float) -> Callable[[Array], Array] | None:
        """Works since the begin of a rest by time, J, (work, time), where work is done; all powers are asked for at
        once, and go over into works as Chebyshev polynomials."""
        if not (self.driven and end > begin):
            return None
        nodes, edges = chebyshev.chebpts1(NODES), np.linspace(begin, end, PANELS + 1)
        half = 0.5 * (edges[1] - edges[0])
        times = (edges[:-1, None] + half * (1.0 + nodes)).ravel()
        powers = self.powers(self._moment(times, row, begin, 0.0, now)).reshape(-1, PANELS, NODES)
        vander = chebyshev.chebvander(nodes, NODES - 1)
        through = np.linalg.solve(vander, np.moveaxis(powers, -1, 0).reshape(NODES, -1)).reshape(NODES, -1, PANELS)
        integrals: Array = np.asarray(half * chebyshev.chebint(through, lbnd=-1), np.float64)
        each = integrals.sum(axis=0)  # every polynomial is 1 at 1
        before = np.cumsum(each, axis=1) - each

        def works(time: Array) -> Array:
            panel = np.clip(np.searchsorted(edges, time, side="right") - 1, 0, PANELS - 1)
            place = (time - edges[panel]) / half - 1.0
            return np.asarray(before[:, panel] + chebyshev.chebval(place, integrals[:, :, panel], tensor=False))

        return works
