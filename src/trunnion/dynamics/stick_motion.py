"""Motion in time of several free coordinates whose joints stick one by one, with contacts of joints in play or without.

A step ends where a joint that slides comes to rest, and where one that sticks breaks away. Which joints stick from then
on is the answer of a complementarity of friction and acceleration, and so is which of them lock where there is none:
see `active`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import OdeSolver

from trunnion.dynamics.active import IDLE, SLACK, ActiveSet, Case, Senses
from trunnion.dynamics.bordered import RANK
from trunnion.dynamics.contact_motion import ContactMotion, Dense
from trunnion.dynamics.guards import Crossing
from trunnion.dynamics.integrate import AHEAD, SEVERAL
from trunnion.dynamics.solution import Event

__all__ = ["StickMotion"]

Array = NDArray[np.float64]

FEW = 8  # steps after which one looks for other accelerations


@dataclass
class StickMotion(ContactMotion):
    """An integration that follows what sticks."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.free = self.motion
        self.count = len(self.motion.contacts.each)
        self.now = 0.5 * self.breaks[0]
        self._crossed: int | None = None
        self._slow = np.sqrt(self.free.typical)
        self._steps = 0

    def _begins(self, row: Array) -> bool:
        return self._decided(0.0, row) and super()._begins(row)

    def _couple(self, time: float, row: Array, now: float) -> None:
        self.now = now
        self._decided(time, row)

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
        if crossing.row < self.count:
            return super()._changed(crossing, row)
        self._crossed = crossing.row - self.count
        return np.inf

    # ---- what sticks and what slides --------------------------------------------------------------------------

    @property
    def _active(self) -> ActiveSet:
        return ActiveSet(self.free, float(np.max(self.pace)))

    def _decided(self, time: float, row: Array) -> bool:
        """Find what sticks, slides and locks from here; `row` is what it is after it."""
        before, crossed, n = self.senses, self._crossed, self.layout.coordinates
        at, self._crossed = self.moment(time, row, 0.0, self.now), None
        with np.errstate(all="ignore"):
            case = self._active.of(at, before, crossed)
            if case.senses is None:
                if self._jammed(time, row, case.base):
                    return self._decided(time, row)
                self._stop("no_acceleration", time, row)
                return False
            sticks = [k for k in case.may if case.senses[k] == 0]
            self.senses = case.senses
            if not before or any(before[k] for k in sticks):
                row[n : 2 * n] = self.free.stopped(self.moment(time, row, 0.0, self.now), sticks)
            for k in case.may:
                was, joint = before[k] if before else None, self.free.resisted[k]
                if case.senses[k] == 0 and was != 0:
                    self.solution.events.append(Event(time, "stick", joint))
                elif case.senses[k] != 0 and not was:
                    self.solution.events.append(Event(time, "break-away", joint, float(case.senses[k])))
            self._rests(time, row, sticks)
            self._others(time, row, case)
        return True

    def _jammed(self, time: float, row: Array, senses: Senses) -> bool:
        """Let joints lock, if they can: they stop at once."""
        found = self._active.lock(self.moment(time, row, 0.0, self.now), senses)
        if found is None:
            return False
        energy = self._stopped(time, row, found.rate, 0.0, self.now)
        for k in found.joints:  # the whole loss is told once
            figure = energy if k == found.joints[0] else np.nan
            self.solution.events.append(Event(time, "lock", self.free.resisted[k], figure, "J"))
        self.senses = found.senses
        return True

    def _failed(
        self, time: float, row: Array, sense: float, now: float, message: str | None
    ) -> tuple[float, Array, None]:
        """As of any motion; where there are no accelerations ahead, joints lock."""
        with np.errstate(all="ignore"):
            ahead = row.copy()
            soon, at = AHEAD / float(np.max(self.pace)), self.moment(time, row, sense, now)
            n, second = self.layout.coordinates, np.nan_to_num(self.free.accelerate(at).second[:, 0])
            ahead[:n] += soon * row[n : 2 * n]
            ahead[n : 2 * n] += soon * second
            causes = {self._cause(when, one, sense, now) for when, one in ((time, row), (time + soon, ahead))}
            if causes & {"locked", "no_acceleration"} and self._jammed(time, row, self.senses):
                return time, row, None
        return super()._failed(time, row, sense, now, message)

    def _rests(self, time: float, row: Array, sticks: Sequence[int]) -> None:
        """Whether all free coordinates rest from here on, in what resists the joints."""
        n, before, self.resting = self.layout.coordinates, self.resting, False
        at = self.moment(time, row, 0.0, self.now)
        if set(self.motion.names) != set(self.motion.system.mechanism.drivers) or not sticks:
            return
        ways = self.free.ways(at)[0][sticks]
        if np.linalg.matrix_rank(ways, tol=RANK) < n or np.any(np.abs(row[n : 2 * n]) > IDLE * self.pace):
            return
        row[n : 2 * n], self.resting = 0.0, True
        if not before:
            self._note(time, "rest")

    # ---- other accelerations ----------------------------------------------------------------------------------

    def _others(self, time: float, row: Array, case: Case) -> None:
        """Tell where there are several accelerations."""
        if SEVERAL not in self.solution.notes and self._active.several(self.moment(time, row, 0.0, self.now), case.may):
            self.solution.notes[SEVERAL] = {"time": time}

    def _end_step(self, solver: OdeSolver, row: Array) -> None:
        """Look for other accelerations at the end of every few steps."""
        super()._end_step(solver, row)
        self._steps += 1
        if self._steps % FEW:
            return
        with np.errstate(all="ignore"):
            self._others(float(solver.t), row, Case(self.senses, self.onsets, (), self.senses))
