"""What holds, slips and is open in a motion from a moment on: a complementarity of forces and accelerations.

Its rows are the joints that may stick and the contacts of rigid bodies that are closed. Where it has no answer, joints
lock.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import single
from trunnion.dynamics.bordered import RANK
from trunnion.dynamics.rates import kinetic_energy
from trunnion.dynamics.state import Accelerated, FreeMotion, Moment
from trunnion.dynamics.touching import Closed, Onset

Array = NDArray[np.float64]
RowMode = int | None  # of a row: 0 it holds, +1 or −1 it slips in that sense, None it is open
RowModes = tuple[RowMode, ...]
Senses = tuple[int, ...]

MEET = 1e-8  # of a typical speed: joints that are as slow may stick
SLACK = 1e-10  # of a typical speed, of a share: what a joint may miss before it counts
BRINK = 1e-8  # of a share: as near to its end a joint breaks away
TINY = 1e-9  # of the accelerations and forces: what is none
SOON = 1e-3  # of a typical time: how far ahead one looks for the sense of what does not move now
IDLE = 1e-7  # of a typical speed for a typical rate: what moves a joint as little does not, now
MOST_CASES = 4096  # which are tried one after the other where changing the worst row comes round
INSTANT = 1e-12  # of a typical time: in which a joint locks


def settled(
    start: Sequence[RowMode],
    objections: Callable[[RowModes], Mapping[int, RowMode] | None],
    choices: Sequence[RowModes],
) -> RowModes | None:
    """Modes to which no row objects: from a start rows change as they object; where that comes round, all cases are
    tried. None: there are none.

    objections: rows that do not do what a case says, the worst of them, with what they seem to do instead; None: the
    case has no answer. choices: of every row.
    """
    modes, tried = tuple(start), set[RowModes]()
    while modes not in tried:
        tried.add(modes)
        changes = objections(modes)
        if changes == {}:
            return modes
        modes = tuple((changes or {}).get(row, mode) for row, mode in enumerate(modes))
    if math.prod(map(len, choices)) > MOST_CASES:
        return None
    every = (case for case in itertools.product(*choices) if case not in tried)
    return next((case for case in every if objections(case) == {}), None)


class Case(NamedTuple):
    """In which sense every joint slides, +1 or −1, 0 where it sticks, None where no case agrees; contacts; joints that
    may stick; senses that those have which do not."""

    senses: Senses | None
    onsets: tuple[Onset, ...]
    may: Sequence[int]
    base: Senses


class Lock(NamedTuple):
    """Joints that lock, rates and senses after it, and the kinetic energy lost, J."""

    joints: Sequence[int]
    rate: Array
    senses: Senses
    loss: float


@dataclass(frozen=True)
class ActiveSet:
    """The rows of a motion, which are the joints that may stick and the contacts of rigid bodies that are closed.

    What sticks needs no more than what resists it, what begins to slide does so in the sense that its friction opposes,
    a closed contact pushes, and one that is let go does not sink in. The worst row changes first (Ch. Glocker, F.
    Pfeiffer, Multibody Dynamics with Unilateral Contacts, Wiley, 1996, state the problem). Where no case agrees, a
    joint locks: see `lock`. Moments are of one lane. pace: a typical rate.
    """

    motion: FreeMotion
    pace: float

    def of(self, at: Moment, before: Senses, crossed: int | None = None) -> Case:
        """What holds, slips and is open, of joints and of contacts that are closed. before: senses of the joints until
        now, () at the start; crossed: joint that has changed."""
        ways, speeds = self.motion.ways(at) if self.motion.resisted else (np.empty((0, 0)), np.empty(0))
        slow = {k for k, speed in enumerate(speeds) if abs(speed) <= MEET or k == crossed}
        slow |= {k for k, sense in enumerate(before) if sense == 0}
        may = [k for k in sorted(slow) if np.max(np.abs(ways[k])) > IDLE]  # others turn round as they must
        base = [0 if k in may else int(np.sign(speed)) or 1 for k, speed in enumerate(speeds)]
        brink = crossed is not None and bool(before) and before[crossed] == 0
        case = self._consistent(at, base, may, brink)
        if case is not None and (idle := [k for k in slow if k not in may and k != crossed]):
            # relative speeds of all joints a little later, as the accelerations have it
            second, soon = self.motion.accelerate(case).second, SOON / self.pace
            rate = case.rate + second * soon
            later = case._replace(q=case.q + 0.5 * (case.rate + rate) * soon, rate=rate)
            ahead = self.motion.speeds(self.motion.walk(later, second), 1)[:, 0]
            base = [int(np.sign(ahead[k])) or 1 if k in idle else sense for k, sense in enumerate(base)]
            case = self._consistent(at, base, may, brink)
        return Case(None if case is None else case.senses, at.onsets if case is None else case.onsets, may, tuple(base))

    def _consistent(self, at: Moment, base: Sequence[int], may: Sequence[int], brink: bool) -> Moment | None:
        """The moment with the senses of all joints and the contacts that agree with forces and accelerations; None: no
        case does. From all sticking that may, those are let go that cannot, and taken back that would turn round.

        brink: whether those joints break away at first that are at the end of their share.
        """
        contacts = {k: onset.sense for k, onset in enumerate(at.onsets) if isinstance(onset, Closed)}
        start: list[RowMode] = [*(base[k] for k in may), *contacts.values()]

        def moment(modes: Sequence[RowMode]) -> Moment:
            senses, onsets = list(base), list(at.onsets)
            for k, mode in zip(may, modes, strict=False):
                senses[k] = mode or 0
            for k, mode in zip(contacts, modes[len(may) :], strict=True):
                onsets[k] = None if mode is None else Closed(mode)
            return at._replace(senses=tuple(senses), onsets=tuple(onsets))

        def objections(modes: RowModes) -> Mapping[int, RowMode] | None:
            """See `settled`: joints that may stick, then contacts that were closed."""
            at = moment(modes)
            if not self._alike(at):
                return None
            answer = self.motion.accelerate(at)
            pulls = self.motion.pulls(answer.back.walk, 1)[:, 0] / self.motion.typical
            small = TINY * max(1.0, float(np.max(np.abs(answer.second / self.motion.unit[:, None]))))
            stuck = [row for row, k in enumerate(may) if at.senses[k] == 0]
            if not np.all(answer.converged & ~answer.turned):
                moved = [row for row in stuck if abs(pulls[may[row]]) > small]  # nothing can hold it
                worst = max(moved, key=lambda row: abs(pulls[may[row]]), default=None)
                return None if worst is None else {worst: int(np.sign(pulls[may[worst]]))}
            if changes := self._of_contacts(at, answer, contacts, small):
                return {len(may) + list(contacts).index(k): mode for k, mode in changes.items()}
            if stuck:
                assert answer.shares is not None
                shares = {row: float(answer.shares[may[row], 0]) for row in stuck}
                most = max(map(abs, shares.values()))
                if most > 1.0 + SLACK or (brink and list(modes) == start and most > 1.0 - BRINK):
                    return {
                        row: int(np.sign(share)) for row, share in shares.items() if abs(share) >= most * (1.0 - BRINK)
                    }
            back = {row: at.senses[k] * pulls[k] for row, k in enumerate(may) if at.senses[k] * pulls[k] < -small}
            return {min(back, key=lambda row: back[row]): 0} if back else {}

        choices: list[RowModes] = [(0, 1, -1)] * len(may)
        for k, sense in contacts.items():
            sticky = self.motion.contacts[k].coefficient > 0.0
            choices.append((sense or 1, None) if sense or not sticky else (0, 1, -1, None))
        modes = settled(start, objections, choices)
        return None if modes is None else moment(modes)

    # ---- contacts of rigid bodies -----------------------------------------------------------------------------

    def _alike(self, at: Moment) -> bool:
        """Whether what lies on one wall sticks or slips as one."""
        each = self.motion.contacts
        senses = {(each[k].surface, onset.sense) for k, onset in enumerate(at.onsets) if isinstance(onset, Closed)}
        return len(senses) == len({surface for surface, _ in senses})

    def _of_contacts(
        self, at: Moment, answer: Accelerated, contacts: Mapping[int, int], small: float
    ) -> dict[int, RowMode]:
        """The worst of the contacts that pull, sink in, or slip or stick against their friction, with those on its
        wall, and what they seem to do instead. contacts: those that were closed, with their senses."""
        pull = self.motion.size * small * self.motion.pace**2
        force, worst = TINY * self.motion.force, list[tuple[float, int, RowMode]]()
        for k, before in contacts.items():
            contact, onset = self.motion.contacts[k], answer.onsets[k]
            gap, slip = (single(part) for part in contact.accelerations(answer.back.walk))
            if not isinstance(onset, Closed):
                worst.append((-gap / pull, k, before))
                continue
            normal, friction = (single(part) for part in (onset.normal, onset.friction))
            worst.append((-normal / force, k, None))
            if onset.sense == 0:
                worst.append(((abs(friction) - contact.coefficient * normal) / force, k, -int(np.sign(friction))))
            elif before == 0:
                worst.append((-onset.sense * slip / pull, k, 0))
        missed, k, mode = max(worst, key=lambda miss: miss[0], default=(0.0, 0, None))
        if missed <= 1.0:
            return {}
        wall = self.motion.contacts[k].surface
        alike = [other for other in contacts if other == k or (mode is not None and at.onsets[other] is not None
                 and self.motion.contacts[other].surface == wall)]  # fmt: skip
        return dict.fromkeys(alike, mode)

    # ---- what locks -------------------------------------------------------------------------------------------

    def lock(self, at: Moment, senses: Senses) -> Lock | None:
        """What locks where there are no accelerations: of the least sets of joints that friction can stop at once, and
        after which there are accelerations, the one that loses least; None: there is none."""
        locks = [lock for lock in self._locks(at, senses) if lock is not None]
        return min(locks, key=lambda lock: (len(lock.joints), lock.loss), default=None)

    def _locks(self, at: Moment, senses: Senses) -> Iterator[Lock | None]:
        """What may lock, by joints that are stopped: with them all that then can no longer move."""
        ways, _ = self.motion.ways(at)
        slides = [k for k, sense in enumerate(senses) if sense != 0 and np.max(np.abs(ways[k])) > IDLE]
        sticks, tried = [k for k, sense in enumerate(senses) if sense == 0], set[tuple[int, ...]]()
        for size in range(1, min(len(slides), len(self.motion.names)) + 1):
            for chosen in itertools.combinations(slides, size):
                inside = [*sticks, *chosen]
                rows = np.linalg.svd(ways[inside])[2][: np.linalg.matrix_rank(ways[inside], tol=RANK)]
                left = ways - ways @ rows.T @ rows
                joints = tuple(k for k in slides if np.max(np.abs(left[k])) <= IDLE)
                if joints not in tried:
                    tried.add(joints)
                    yield self._stopped(at, senses, joints)

    def _stopped(self, at: Moment, senses: Senses, joints: Sequence[int]) -> Lock | None:
        """The stop of some joints as an acceleration over an instant, in which loads are nothing and friction is what
        the reactions to the inertia make it; None where friction cannot hold them."""
        after, instant = [0 if k in joints else sense for k, sense in enumerate(senses)], INSTANT / self.pace
        speeds = self.motion.speeds(self.motion.walk(at), 1)
        for _ in senses:
            sticks = [k for k, sense in enumerate(after) if sense == 0]
            guess = (self.motion.stopped(at, sticks)[:, None] - at.rate) / instant
            stop = self.motion.accelerate(at._replace(senses=tuple(after)), guess, -speeds[sticks] / instant)
            assert stop.shares is not None
            if np.all(stop.converged) and np.all(np.isfinite(stop.second)):
                torn = {k: stop.shares[k, 0] for k in sticks if abs(stop.shares[k, 0]) > 1.0 + SLACK}
                if not torn:
                    return self._after(at, stop, tuple(after), joints, instant)
            else:  # as nothing to speak of resists some, they go on as if they had not stuck
                loose = self.motion.ways(at._replace(rate=self.motion.stopped(at, joints)[:, None]))[1]
                torn = {k: loose[k] for k in sticks if abs(loose[k]) > MEET}
            torn = {k: sense for k, sense in torn.items() if k not in joints}  # they stuck until now
            if not torn:
                return None
            for k, sense in torn.items():
                after[k] = int(np.sign(sense))
        return None

    def _after(
        self, at: Moment, stop: Accelerated, senses: Senses, joints: Sequence[int], instant: float
    ) -> Lock | None:
        """What is so after a stop; None where something else would turn round, or there are no accelerations."""
        sticks = [k for k, sense in enumerate(senses) if sense == 0]
        after = at._replace(rate=at.rate + instant * stop.second, senses=senses)
        after = after._replace(rate=self.motion.stopped(after, sticks)[:, None])
        _, speeds = self.motion.ways(after)
        if any(sense * speeds[k] < -MEET for k, sense in enumerate(senses)):
            return None
        if self.of(after, senses).senses is None:
            return None
        walks = (self.motion.walk(moment) for moment in (at, after))
        before, left = (single(kinetic_energy(walk)) for walk in walks)
        return Lock(joints, after.rate[:, 0], senses, before - left)
