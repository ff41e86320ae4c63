"""The variables of a motion in time at the times of its rows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle import fill
from trunnion.cycle.fill import fill_chunk
from trunnion.dynamics.energy import kinetic_energy, potential_energy
from trunnion.dynamics.opened import Opened
from trunnion.dynamics.rest import Rest
from trunnion.dynamics.result import Books
from trunnion.dynamics.shown import Stated, Touches
from trunnion.dynamics.solution import Solution, Stretch
from trunnion.dynamics.state import FreeMotion, Moment
from trunnion.dynamics.touching import Onset
from trunnion.errors import Status
from trunnion.solve.backward import Backward
from trunnion.solve.memory import CHUNK

__all__ = ["Filling"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Filling:
    """The variables of a result at the times of its rows, from the state by walks, as `analyse` has them."""

    motion: FreeMotion
    solution: Solution
    time: Array
    stated: Opened | None = None

    def books(self) -> Books:
        """Every variable, over the rows up to where the motion ends; NaN after it."""
        motion, stated = self.motion, None if self.stated is None else Stated(self.stated, self.motion.contacts)
        system = (motion.run if stated is None else stated.run).system
        labels = fill.labels(system)
        arrays = fill.allocate(system, len(self.time))
        rows, which = self.solution.at(self.time)
        layout = self.solution.layout
        seconds, energies = np.full((layout.coordinates, len(self.time)), np.nan), np.full((2, len(self.time)), np.nan)
        touches = Touches.empty(len(motion.contacts.each), len(system.axes), len(self.time))
        arrays["status"][...] = Status.NOT_CONVERGED
        for lanes, stretch in self._alike(which):
            at = layout.moment(self.time[lanes], rows[:, lanes], stretch.sense, stretch.now, stretch.slips)
            at = at._replace(onsets=stretch.onsets, senses=stretch.senses)
            second, back, onsets = self._solved(at, stretch)
            seconds[:, lanes] = second
            window = slice(int(lanes[0]), int(lanes[-1]) + 1)
            energies[0, lanes], energies[1, lanes] = kinetic_energy(back.walk), potential_energy(back.walk)
            touched = motion.contacts.pushes(back.walk, onsets)
            touches.fill(lanes, touched, onsets)
            shown = back if stated is None else stated.back(back, touched)
            fill_chunk(arrays, shown, at.time, window)
            if stated is not None:
                stated.fill(arrays, shown.walk, touched, window)
        moments = layout.moment(self.time, rows)
        for array in arrays.values():  # there is no motion any more
            if array.dtype == np.float64:
                array[..., which < 0] = np.nan
        fill.unwrap(arrays, system, motion.values_at(moments, np.nan_to_num(seconds)), self.time)
        resting = np.array([k >= 0 and self.solution.stretches[k].resting for k in which])
        if stated is not None:
            energies = np.vstack([energies, touches.stored.sum(axis=0)])
        works, sticking = layout.works(rows), self._sticking(which)
        return Books(self.time, arrays, labels, moments, seconds, energies, works, resting, touches, sticking)

    def _sticking(self, which: NDArray[np.intp]) -> NDArray[np.bool_] | None:
        """Which joints stick, (joint, row), where they do one by one; of joints in play none does."""
        if not self.motion.resisted:
            return None
        joints = list((self.stated.run if self.stated else self.motion.run).system.joints)
        sticks = np.zeros((len(joints), len(which)), bool)
        for i, name in enumerate(self.motion.resisted):
            sticks[joints.index(name)] = [k >= 0 and self.solution.stretches[k].senses[i] == 0 for k in which]
        return sticks

    def _alike(self, which: NDArray[np.intp]) -> list[tuple[NDArray[np.intp], Stretch]]:
        """Runs of rows that one walk can solve: of the same sense, switches and assembly."""
        groups: list[tuple[NDArray[np.intp], Stretch]] = []
        stretches = self.solution.stretches

        def key(k: int) -> object:
            stretch = stretches[k]
            snapshot = None if stretch.snapshot is None else id(stretch.snapshot)
            return stretch.sense, stretch.resting, stretch.now, stretch.onsets, stretch.senses, stretch.slips, snapshot

        begin = 0
        for i in range(1, len(which) + 1):
            same = i < len(which) and i - begin < CHUNK and which[i] >= 0 and key(which[i]) == key(which[begin])
            if which[begin] >= 0 and not same:
                groups.append((np.arange(begin, i), stretches[which[begin]]))
            if not same:
                begin = i
            if begin < len(which) and which[begin] < 0:
                break
        return groups

    def _solved(self, at: Moment, stretch: Stretch) -> tuple[Array, Backward, tuple[Onset, ...]]:
        """Accelerations and the walk; at rest with the shares of the friction that hold it."""
        self.motion.begin(stretch.snapshot)
        if not stretch.resting or self.motion.resisted:
            accelerated = self.motion.accelerate(at)
            return accelerated.second, accelerated.back, accelerated.onsets
        rest = Rest(self.motion, self.solution.layout, stretch.slips)
        return np.zeros_like(at.q), rest.back(at), ()
