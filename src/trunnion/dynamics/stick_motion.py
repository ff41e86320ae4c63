"""Motion in time of several free coordinates whose joints stick one by one, with contacts of joints in play or without.

A step ends where a joint that slides comes to rest, and where one that sticks breaks away. Which joints stick from then
on is the answer of a complementarity of friction and acceleration: what sticks needs no more than what resists it, what
begins to slide does so in the sense that its friction opposes.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from trunnion.dynamics.contact_motion import ContactMotion, Crossing, Dense
from trunnion.dynamics.solution import Event
from trunnion.dynamics.state import Moment
from trunnion.dynamics.sticking import StickingMotion

__all__ = ["StickMotion"]

Array = NDArray[np.float64]
Senses = tuple[int, ...]

MEET = 1e-8  # of a typical speed: joints that are as slow may stick
SLACK = 1e-10  # of a typical speed, of a share: what a joint may miss before it counts
BRINK = 1e-8  # of a share: as near to its end a joint breaks away
TINY = 1e-9  # of the accelerations: what is none
SOON = 1e-3  # of a typical time: how far ahead one looks for the sense of what does not move now
IDLE = 1e-7  # of a typical speed for a typical rate: what moves a joint as little does not, now
MOST_CASES = 729  # of joints that stick or slide, which are tried one after the other


@dataclass
class StickMotion(ContactMotion):
    """An integration that follows what sticks."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.free = cast("StickingMotion", self.motion)
        self.count = len(self.motion.contacts.each)
        self.now = 0.5 * self.breaks[0]
        self._crossed: int | None = None
        self._slow = np.sqrt(self.free.typical)

    def moment(self, time: float, row: Array, sense: float, now: float) -> Moment:
        """The state of a row, with contacts and joints as they are."""
        return super().moment(time, row, sense, now)._replace(senses=self.senses)

    def _begins(self, row: Array) -> bool:
        return self._decided(0.0, row) and super()._begins(row)

    def _move(
        self, time: float, row: Array, until: float, sense: float, now: float, step: float | None
    ) -> tuple[float, Array, float | None]:
        """Move until a joint begins to stick or to slide, a contact begins or ends, or the next break."""
        self.now = now
        if not self._decided(time, row):
            return time, row, None
        return super()._move(time, row, until, sense, now, step)

    # ---- what ends a step -------------------------------------------------------------------------------------

    def _gaps(self, dense: Dense, times: Array) -> Array:
        """What stays above 0 within a step, (contact and joint, time): gaps, then speeds in their sense of the joints
        that slide, and what is left to those that stick before they break away."""
        at = self.layout.moment(times, np.asarray(dense(times)), 0.0, self.now)
        at = at._replace(onsets=self.onsets, senses=self.senses)
        senses = np.array(self.senses)[:, None]
        with np.errstate(all="ignore"):
            if np.all(senses != 0):
                walk, left = self.motion.walk(at, np.zeros_like(at.q)), 0.0 * senses
            else:
                found = self.motion.accelerate(at)
                shares = np.asarray(found.shares, float)
                walk, left = found.back.walk, 1.0 + SLACK - np.abs(np.nan_to_num(shares, nan=np.inf))
            ahead = senses * self.free.speeds(walk, len(times)) / self._slow[:, None] + SLACK
        own = np.where(senses == 0, left, ahead)
        return np.vstack([super()._gaps(dense, times), own]) if self.count else own

    def _changed(self, crossing: Crossing, row: Array) -> float:
        """Let a contact begin or end; of a joint that is decided before the next step."""
        if crossing.contact < self.count:
            return super()._changed(crossing, row)
        self._crossed = crossing.contact - self.count
        return np.inf

    # ---- what sticks and what slides --------------------------------------------------------------------------

    def _decided(self, time: float, row: Array) -> bool:
        """Find what sticks and what slides from here; `row` is what it is after it."""
        before, crossed = self.senses, self._crossed
        at, self._crossed = self.moment(time, row, 0.0, self.now), None
        with np.errstate(all="ignore"):
            ways, speeds = self.free.ways(at)
            slow = {k for k, speed in enumerate(speeds) if abs(speed) <= MEET or k == crossed}
            slow |= {k for k, sense in enumerate(before) if sense == 0}
            may = [k for k in sorted(slow) if np.max(np.abs(ways[k])) > IDLE]  # others turn round as they must
            base = [0 if k in may else int(np.sign(speed)) or 1 for k, speed in enumerate(speeds)]
            brink = crossed is not None and before[crossed] == 0
            senses = self._consistent(at, base, may, brink)
            if senses is not None and (idle := [k for k in slow if k not in may and k != crossed]):
                ahead = self._ahead(at._replace(senses=senses))
                base = [int(np.sign(ahead[k])) or 1 if k in idle else sense for k, sense in enumerate(base)]
                senses = self._consistent(at, base, may, brink)
            if senses is None:
                self._stop("no_acceleration", time, row)
                return False
            sticks, n = [k for k in may if senses[k] == 0], self.layout.coordinates
            self.senses = senses
            if not before or any(before[k] for k in sticks):
                row[n : 2 * n] = self.free.stopped(self.moment(time, row, 0.0, self.now), sticks)
        for k in may:
            was, joint = before[k] if before else None, self.free.resisted[k]
            if senses[k] == 0 and was != 0:
                self.solution.events.append(Event(time, "stick", joint))
            elif senses[k] != 0 and not was:
                self.solution.events.append(Event(time, "break-away", joint, float(senses[k])))
        return True

    def _ahead(self, at: Moment) -> Array:
        """Relative speeds of all joints a little later, as the accelerations have it."""
        second, soon = self.motion.accelerate(at).second, SOON / np.max(self.pace)
        rate = at.rate + second * soon
        walk = self.motion.walk(at._replace(q=at.q + 0.5 * (at.rate + rate) * soon, rate=rate), second)
        return self.free.speeds(walk, 1)[:, 0]

    def _consistent(self, at: Moment, base: Sequence[int], may: Sequence[int], brink: bool) -> Senses | None:
        """The senses of all joints of which those that may stick agree with shares and accelerations; None: no case
        does. From all that may sticking, those are let go that cannot, and taken back that would turn round."""
        senses, tried = list(base), set[Senses]()
        while tuple(senses) not in tried:
            tried.add(tuple(senses))
            objections = self._objections(at, senses, may, brink and len(tried) == 1)
            if objections == {}:
                return tuple(senses)
            for k, sense in (objections or {}).items():
                senses[k] = sense
        if 3 ** len(may) > MOST_CASES:
            return None
        for case in itertools.product((0, 1, -1), repeat=len(may)):
            for k, sense in zip(may, case, strict=True):
                senses[k] = sense
            if tuple(senses) not in tried and self._objections(at, senses, may, False) == {}:
                return tuple(senses)
        return None

    def _objections(self, at: Moment, senses: Sequence[int], may: Sequence[int], brink: bool) -> dict[int, int] | None:
        """Joints that do not do what a case says, with what they seem to do instead; None: it has no accelerations.
        brink: whether those break away that are at the end of their share."""
        found = self.motion.accelerate(at._replace(senses=tuple(senses)))
        pulls = self.free.pulls(found.back.walk, 1)[:, 0] / self.free.typical
        small = TINY * max(1.0, float(np.max(np.abs(found.second / self.motion.unit[:, None]))))
        stuck = [k for k in may if senses[k] == 0]
        if not np.all(found.converged & ~found.turned):
            moved = [k for k in stuck if abs(pulls[k]) > small]  # nothing can hold it
            worst = max(moved, key=lambda k: abs(pulls[k]), default=None)
            return None if worst is None else {worst: int(np.sign(pulls[worst]))}
        if stuck:
            assert found.shares is not None
            shares = found.shares[:, 0]
            most = float(np.max(np.abs(shares[stuck])))
            if most > 1.0 + SLACK or (brink and most > 1.0 - BRINK):
                return {k: int(np.sign(shares[k])) for k in stuck if abs(shares[k]) >= most * (1.0 - BRINK)}
        back = [k for k in may if senses[k] * pulls[k] < -small]
        return {min(back, key=lambda k: senses[k] * pulls[k]): 0} if back else {}
