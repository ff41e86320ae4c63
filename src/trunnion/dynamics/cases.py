"""Which joints stick and which slide where several coordinates are free, from one moment on.

It is the answer of a complementarity of friction and acceleration: what sticks needs no more than what resists it, what
begins to slide does so in the sense that its friction opposes. Where no case agrees, a joint locks: see `Cases.lock`.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.dynamics.bordered import RANK
from trunnion.dynamics.energy import kinetic_energy
from trunnion.dynamics.state import Accelerated, FreeMotion, Moment, repeated

__all__ = ["Case", "Cases", "Lock", "Senses"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Senses = tuple[int, ...]

MEET = 1e-8  # of a typical speed: joints that are as slow may stick
SLACK = 1e-10  # of a typical speed, of a share: what a joint may miss before it counts
BRINK = 1e-8  # of a share: as near to its end a joint breaks away
TINY = 1e-9  # of the accelerations: what is none
SOON = 1e-3  # of a typical time: how far ahead one looks for the sense of what does not move now
IDLE = 1e-7  # of a typical speed for a typical rate: what moves a joint as little does not, now
MOST_CASES = 729  # of joints that stick or slide, which are tried one after the other
INSTANT = 1e-12  # of a typical time: in which a joint locks
APART = 1e-6  # of the accelerations: those that differ by as much are two


class Case(NamedTuple):
    """In which sense every joint slides, +1 or −1, 0 where it sticks, None where no case agrees; joints that may
    stick; senses that those have which do not."""

    senses: Senses | None
    may: Sequence[int]
    base: Senses


class Lock(NamedTuple):
    """Joints that lock, rates and senses after it, and the kinetic energy lost, J."""

    joints: Sequence[int]
    rate: Array
    senses: Senses
    loss: float


@dataclass(frozen=True)
class Cases:
    """The cases of a motion whose joints stick one by one; moments of one lane. pace: a typical rate."""

    free: FreeMotion
    pace: float

    def of(self, at: Moment, before: Senses, crossed: int | None = None) -> Case:
        """What sticks and what slides. before: senses until now, () at the start; crossed: joint that has changed."""
        ways, speeds = self.free.ways(at)
        slow = {k for k, speed in enumerate(speeds) if abs(speed) <= MEET or k == crossed}
        slow |= {k for k, sense in enumerate(before) if sense == 0}
        may = [k for k in sorted(slow) if np.max(np.abs(ways[k])) > IDLE]  # others turn round as they must
        base = [0 if k in may else int(np.sign(speed)) or 1 for k, speed in enumerate(speeds)]
        brink = crossed is not None and bool(before) and before[crossed] == 0
        senses = self._consistent(at, base, may, brink)
        if senses is not None and (idle := [k for k in slow if k not in may and k != crossed]):
            ahead = self._ahead(at._replace(senses=senses))
            base = [int(np.sign(ahead[k])) or 1 if k in idle else sense for k, sense in enumerate(base)]
            senses = self._consistent(at, base, may, brink)
        return Case(senses, may, tuple(base))

    def _ahead(self, at: Moment) -> Array:
        """Relative speeds of all joints a little later, as the accelerations have it."""
        second, soon = self.free.accelerate(at).second, SOON / self.pace
        rate = at.rate + second * soon
        walk = self.free.walk(at._replace(q=at.q + 0.5 * (at.rate + rate) * soon, rate=rate), second)
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
        for case in self._every(base, may):
            if case not in tried and self._objections(at, case, may, False) == {}:
                return case
        return None

    def _every(self, base: Sequence[int], may: Sequence[int]) -> Iterator[Senses]:
        """All cases; none where they are too many."""
        senses = list(base)
        for case in itertools.product((0, 1, -1), repeat=len(may)) if 3 ** len(may) <= MOST_CASES else ():
            for k, sense in zip(may, case, strict=True):
                senses[k] = sense
            yield tuple(senses)

    def _objections(self, at: Moment, senses: Sequence[int], may: Sequence[int], brink: bool) -> dict[int, int] | None:
        """Joints that do not do what a case says, with what they seem to do instead; None: it has no accelerations.
        brink: whether those break away that are at the end of their share."""
        found = self.free.accelerate(at._replace(senses=tuple(senses)))
        pulls = self.free.pulls(found.back.walk, 1)[:, 0] / self.free.typical
        small = TINY * max(1.0, float(np.max(np.abs(found.second / self.free.unit[:, None]))))
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

    # ---- what locks -------------------------------------------------------------------------------------------

    def lock(self, at: Moment, senses: Senses) -> Lock | None:
        """What locks where there are no accelerations: of the least sets of joints that friction can stop at once, and
        after which there are accelerations, the one that loses least; None: there is none."""
        found = [one for one in self._locks(at, senses) if one is not None]
        least = min((len(one.joints) for one in found), default=0)
        return min((one for one in found if len(one.joints) == least), key=lambda one: one.loss, default=None)

    def _locks(self, at: Moment, senses: Senses) -> Iterator[Lock | None]:
        """What may lock, by joints that are stopped: with them all that then can no longer move."""
        ways, _ = self.free.ways(at)
        slides = [k for k, sense in enumerate(senses) if sense != 0 and np.max(np.abs(ways[k])) > IDLE]
        held, tried = [k for k, sense in enumerate(senses) if sense == 0], set[tuple[int, ...]]()
        for size in range(1, min(len(slides), len(self.free.names)) + 1):
            for chosen in itertools.combinations(slides, size):
                inside = [*held, *chosen]
                rows = np.linalg.svd(ways[inside])[2][: np.linalg.matrix_rank(ways[inside], tol=RANK)]
                left = ways - ways @ rows.T @ rows
                joints = tuple(k for k in slides if np.max(np.abs(left[k])) <= IDLE)
                if joints not in tried:
                    tried.add(joints)
                    yield self._stopped(at, senses, joints)

    def _stopped(self, at: Moment, senses: Senses, joints: Sequence[int]) -> Lock | None:
        """The stop of some joints as an acceleration over an instant, in which loads are nothing and friction is what
        the reactions to the inertia make it; None where friction cannot hold them."""
        own, instant = [0 if k in joints else sense for k, sense in enumerate(senses)], INSTANT / self.pace
        speeds = self.free.speeds(self.free.walk(at, np.zeros_like(at.q)), 1)
        for _ in senses:
            sticks = [k for k, sense in enumerate(own) if sense == 0]
            stopping = at._replace(senses=tuple(own))
            guess = (self.free.stopped(at, sticks)[:, None] - at.rate) / instant
            found = self.free.accelerate(stopping, guess, -speeds[sticks] / instant)
            assert found.shares is not None
            if np.all(found.converged) and np.all(np.isfinite(found.second)):
                torn = {k: found.shares[k, 0] for k in sticks if abs(found.shares[k, 0]) > 1.0 + SLACK}
                if not torn:
                    return self._after(at, found, tuple(own), joints, instant)
            else:  # as nothing to speak of resists some, they go on as if they had not stuck
                loose = at._replace(rate=self.free.stopped(at, joints)[:, None])
                torn = {k: one for k, one in enumerate(self.free.ways(loose)[1]) if abs(one) > MEET and k in sticks}
            torn = {k: one for k, one in torn.items() if k not in joints}  # they stuck until now
            if not torn:
                return None
            for k, one in torn.items():
                own[k] = int(np.sign(one))
        return None

    def _after(
        self, at: Moment, found: Accelerated, senses: Senses, joints: Sequence[int], instant: float
    ) -> Lock | None:
        """What is so after a stop; None where something else would turn round, or there are no accelerations."""
        sticks = [k for k, sense in enumerate(senses) if sense == 0]
        after = at._replace(rate=at.rate + instant * found.second, senses=senses)
        after = after._replace(rate=self.free.stopped(after, sticks)[:, None])
        _, speeds = self.free.ways(after)
        if any(sense * speeds[k] < -MEET for k, sense in enumerate(senses)):
            return None
        if self.of(after, senses).senses is None:
            return None
        energies = [kinetic_energy(self.free.walk(one, np.zeros_like(at.q))) for one in (at, after)]
        return Lock(joints, after.rate[:, 0], senses, float(np.ravel(energies[0])[0] - np.ravel(energies[1])[0]))

    # ---- other accelerations ----------------------------------------------------------------------------------

    def several(self, at: Moment, may: Sequence[int] = ()) -> bool:
        """Whether friction allows other accelerations than those of the senses of `at`. They are looked for, from far
        away, where more of some acceleration takes less effort there."""
        count, starts = len(self.free.names), self.free.far(np.zeros_like(at.q))
        ends = np.array(list(itertools.product((1.0, -1.0), repeat=len(may)))).T
        if 3 ** len(may) > MOST_CASES or not np.any(
            self.free.turning(at, np.repeat(starts, ends.shape[1], axis=1), may, np.tile(ends, (1, 2 * count)))
        ):
            return False
        known = self.free.accelerate(at).second
        size = np.maximum(self.free.unit[:, None], np.max(np.abs(known)))
        many = repeated(at, 2 * count)
        for case in self._every(at.senses, may):
            found = self.free.searched(many._replace(senses=case), starts)
            apart = np.max(np.abs(found.second - known) / size, axis=0) > APART
            if np.any(self._agrees(found, case, may) & (found.turned | apart)):
                return True
        return False

    def _agrees(self, found: Accelerated, senses: Senses, may: Sequence[int]) -> Flags:
        """Lanes in which the joints that may stick do what a case says."""
        fine = np.array(found.converged)
        pulls = self.free.pulls(found.back.walk, len(fine)) / self.free.typical[:, None]
        small = TINY * np.maximum(1.0, np.max(np.abs(pulls), axis=0))
        for k in may:
            if senses[k]:
                fine &= senses[k] * pulls[k] >= -small
            elif found.shares is not None:
                fine &= np.abs(found.shares[k]) <= 1.0 + SLACK
        return fine
