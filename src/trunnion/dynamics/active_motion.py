"""Motion in time that follows what holds, slips and is open: joints at rest, contacts of joints in play, a clutch.

A step ends where a gap closes or opens, where a joint that slides comes to rest, and where one that sticks breaks away,
so that every step is taken through smooth forces. Between contacts the pin flies; the forces of a contact come with its
onset, whose speed of approach its law needs. What holds, slips or is open from then on is the answer of a
complementarity of forces and accelerations, and so is which joints lock where there is none: see `ActiveSet`. Contacts
of rigid bodies: `impact_motion`.

One free coordinate rests while what drives it lies between the efforts at which it would break away forward and
backward, every friction and resisting load against that motion, at its value for slip 0.

While a clutch is open or slips the rotor turns by itself, J ω̇ = T(ω) − σ C, with the capacity C and the sense σ of the
slip s = ω − i q̇; the coordinate is driven by σ C through the gear. While it holds, s = 0 and the rotor is part of what
the coordinate moves. It slips on from where it would have to carry more than C.
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
from trunnion.dynamics.guards import Crossing
from trunnion.dynamics.integrate import Integration
from trunnion.dynamics.rates import Seen, kinetic_energy
from trunnion.dynamics.solution import Impact, Solution, Stretch, over_steps, step_nodes
from trunnion.dynamics.state import Accelerated, FreeMotion, Moment
from trunnion.dynamics.touching import FIRST, SLOWEST, Closed, Onset, least_clearance

__all__ = ["ActiveMotion", "ActiveSet", "RowMode", "RowModes", "settled"]

Array = NDArray[np.float64]
Dense = Callable[[Array], Array]  # the state by time, (time,) -> (number, time)
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

GAP, SLIP, NORMAL = range(3)  # rows of a contact over a step
NEARLY = 1e-3  # of the largest force so far: a step that comes as near may hold a larger one
ROUNDING = 1e-12  # of the capacity: what a clutch that just holds may carry more, by rounding


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
        case does. From all sticking that may, those are let go that cannot, and taken back that would turn round."""
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
            return self._objections(moment(modes), may, contacts, brink and list(modes) == start)

        choices: list[RowModes] = [(0, 1, -1)] * len(may)
        for k, sense in contacts.items():
            sticky = self.motion.contacts[k].coefficient > 0.0
            choices.append((sense or 1, None) if sense or not sticky else (0, 1, -1, None))
        modes = settled(start, objections, choices)
        return None if modes is None else moment(modes)

    def _objections(
        self, at: Moment, may: Sequence[int], contacts: Mapping[int, int], brink: bool
    ) -> Mapping[int, RowMode] | None:
        """See `settled`: joints that may stick, then contacts that were closed. brink: whether those joints break away
        that are at the end of their share."""
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
            if most > 1.0 + SLACK or (brink and most > 1.0 - BRINK):
                return {row: int(np.sign(share)) for row, share in shares.items() if abs(share) >= most * (1.0 - BRINK)}
        back = {row: at.senses[k] * pulls[k] for row, k in enumerate(may) if at.senses[k] * pulls[k] < -small}
        return {min(back, key=lambda row: back[row]): 0} if back else {}

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
        speeds = self.motion.speeds(self.motion.walk(at, np.zeros_like(at.q)), 1)
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
        walks = (self.motion.walk(moment, np.zeros_like(at.q)) for moment in (at, after))
        before, left = (single(kinetic_energy(walk)) for walk in walks)
        return Lock(joints, after.rate[:, 0], senses, before - left)


@dataclass
class ActiveMotion(Integration):
    """An integration that follows contacts and what sticks."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.count = len(self.motion.contacts)
        self.mode = self.mode._replace(onsets=(None,) * self.count)
        self._open: dict[int, Impact] = {}  # contacts that last
        self._crossed: int | None = None  # joint that has changed
        self._let_go = 0.0  # sense in which a clutch that held begins to slip
        self._drive = next(iter(self.motion.drives.values()))
        # controllers, by number, with +1 while they are at their limit, else −1
        self._limited = {i: -1.0 for i, drive in enumerate(self.motion.drives.values()) if drive.controlled}
        self._clutch = "holds" if self._drive.engaged(self.start) else "opens"

    @property
    def onsets(self) -> tuple[Onset, ...]:
        """How the contacts are."""
        return self.mode.onsets

    # ---- what ends a step -------------------------------------------------------------------------------------

    def _look(self, dense: Dense, times: Array) -> Seen:
        """The contacts at times of a step."""
        with np.errstate(all="ignore"):
            return self.dynamics.look(self.layout.moment(times, np.asarray(dense(times)), self.mode))

    def _values(self, stretch: Stretch) -> Callable[[Array], Array] | None:
        mechanism = self.motion.system.mechanism
        varies = any(entry.varies for entry in mechanism.parameter_set.entries.values())
        changes = self.motion.several or len(mechanism.drivers) > 1 or varies or self._drive.timed
        if stretch.resting and not changes:
            return None

        def values(times: Array) -> Array:
            with np.errstate(all="ignore"):
                rows = [row for *_, row in self._guards(stretch.at(self.layout, times))]
            return np.array(rows).reshape(len(rows), len(times))

        return values

    def _guards(self, at: Moment) -> list[tuple[str, int, Array]]:
        """What stays above 0 while a mode lasts: its kind, which one it is, and its values, (lane,)."""
        guards: list[tuple[str, int, Array]] = [("contact", k, row) for k, row in enumerate(self._gaps(at))]
        guards += [("joint", k, row) for k, row in enumerate(self._of_joints(at))]
        if at.slips:
            guards.append(("clutch", 0, at.slips * at.slip[0]))
        elif self.layout.clutched and self._drive.engaged(at.now):
            guards.append(("clutch", 0, self._capacity - np.abs(self._carried(at))))
        guards += [("limit", i, sign * self._over_limit(i, at)) for i, sign in self._limited.items()]
        if not (self.motion.several or self.resting):  # the bends on either side of the coordinate
            guards += [("bend", 0, at.q[0] - self.between[0]), ("bend", 1, self.between[1] - at.q[0])]
        return guards

    def _gaps(self, at: Moment) -> Array:
        """Gaps, m, (contact, lane), negative where a contact that touches is open or another has closed."""
        sign = np.array([1.0 if onset is None else -1.0 for onset in self.onsets])
        gaps: Array = sign[:, None] * self.dynamics.look(at).gap if self.count else np.empty((0, len(at.time)))
        return gaps

    def _of_joints(self, at: Moment) -> Array:
        """Speeds in their sense of the joints that slide, and what is left to those that stick before they break away,
        (joint, lane)."""
        senses = np.array(at.senses)[:, None]
        if not self.motion.several:
            return -np.max(self.motion.excess(at), axis=0)[None] if self.motion.rests(at) else senses * at.rate
        if not at.senses:
            return np.empty((0, len(at.time)))
        if np.all(senses != 0):
            walk, left = self.motion.walk(at, np.zeros_like(at.q)), 0.0 * senses
        else:
            accelerated = self.motion.accelerate(at)
            shares = np.asarray(accelerated.shares, float)
            walk, left = accelerated.back.walk, 1.0 + SLACK - np.abs(np.nan_to_num(shares, nan=np.inf))
        slow = np.sqrt(self.motion.typical)[:, None]
        return np.where(senses == 0, left, senses * self.motion.speeds(walk, len(at.time)) / slow + SLACK)

    def _over_limit(self, i: int, at: Moment) -> Array:
        """By how much what a controller aims at is beyond its limit, where its effort bends."""
        drive = list(self.motion.drives.values())[i]
        return drive.excess(at.time, at.rate[i], at.integral[i], at.slip)

    @property
    def _capacity(self) -> float:
        return self._drive.clutch * (1.0 + ROUNDING)

    def _carried(self, at: Moment) -> Array:
        """Effort through a clutch that holds, (lane,): the motor's, less what the rotor takes."""
        shaft = self._drive.shaft(at.time, at.rate[0], at.integral[0], at.now)
        effort: Array = shaft - self._drive.inertia * self._drive.ratio * self.dynamics.seconds(at)[0]
        return effort

    def _changed(self, crossing: Crossing, row: Array) -> float:
        """Let a contact begin or end, or a clutch; of a joint that is decided before the next step."""
        at = self.moment(crossing.time, row)
        with np.errstate(all="ignore"):
            kind, k, _ = self._guards(at)[crossing.row]
        match kind:
            case "contact":
                return self._met(k, crossing.time, row)
            case "joint" if self.motion.several:
                self._crossed = k
            case "joint" if not self.resting:
                row[self.layout.coordinates] = 0.0
            case "clutch" if self.mode.slips:
                row[self.layout.slip] = 0.0
            case "clutch":
                self._let_go = float(np.sign(self._carried(at)[0]))
            case "limit":
                self._limited[k] *= -1.0
            case "bend":
                row[0] = self.between[k]
                if (module := self._meeting(row[0])) is not None:
                    self.end("change_point", crossing.time, self.motion.change_point(module, float(row[0])))
        return np.inf

    def _met(self, k: int, time: float, row: Array) -> float:
        """Let a contact begin or end; how long the first step after it may be, s."""
        rate = float(self._look(lambda times: row[:, None], np.array([time])).rate[k, 0])
        onsets = list(self.onsets)
        if onsets[k] is None:
            onsets[k] = max(-rate, SLOWEST)
            self._begin(k, time, max(-rate, 0.0))
            self._note(time, "impact", -rate, "m/s", self.motion.contacts[k].label)
        else:
            onsets[k] = None
            self._end(k, time, rate)
        self.mode = self.mode._replace(onsets=tuple(onsets))
        return FIRST * least_clearance(self.motion.contacts) / max(abs(rate), SLOWEST)

    def _begin(self, k: int, time: float, approach: float = 0.0) -> None:
        """A contact begins that lasts."""
        self._open[k] = Impact(self.motion.contacts[k].label, time, approach)
        self.solution.impacts.append(self._open[k])

    def _end(self, k: int, time: float, rate: float) -> None:
        """A contact lifts off."""
        impact = self._open.pop(k)
        impact.end, impact.separation = time, rate
        self._note(time, "lift-off", rate, "m/s", impact.label)

    # ---- what holds, slips and is open ------------------------------------------------------------------------

    @property
    def _active(self) -> ActiveSet:
        return ActiveSet(self.motion, float(np.max(self.pace)))

    def _decided(self, time: float, row: Array) -> bool:
        """Find what sticks, slides, is open and locks from here; `row` is what it is after it."""
        if not self.motion.several:
            self._alone(time, row)
            return True
        before, crossed, n = self.mode.senses, self._crossed, self.layout.coordinates
        at, self._crossed = self.moment(time, row), None
        closed = any(isinstance(onset, Closed) for onset in self.onsets)
        if not (self.motion.resisted or closed):
            return True
        with np.errstate(all="ignore"):
            case = self._active.of(at, before, crossed)
            if case.senses is None:
                if self._jammed(time, row, case.base):
                    return self._decided(time, row)
                self._stop("no_contact_force" if closed else "no_acceleration", time, row)
                return False
            sticks = [k for k in case.may if case.senses[k] == 0]
            self.mode = self.mode._replace(senses=case.senses)
            self._let(time, case.onsets)
            if sticks and (not before or any(before[k] for k in sticks)):
                row[n : 2 * n] = self.motion.stopped(self.moment(time, row), sticks)
            for k in case.may:
                was, joint = before[k] if before else None, self.motion.resisted[k]
                if case.senses[k] == 0 and was != 0:
                    self._note(time, "stick", of=joint)
                elif case.senses[k] != 0 and not was:
                    self._note(time, "break-away", float(case.senses[k]), of=joint)
            self._rests(time, row, sticks)
        return True

    def _alone(self, time: float, row: Array) -> None:
        """Whether the clutch of one free coordinate is open, slips or holds from here on, and whether it rests, or in
        which sense it moves."""
        engaged = self.layout.clutched and self._drive.engaged(self.mode.now)
        slip = float(row[self.layout.slip]) if self.layout.clutched else 0.0
        self.mode = self.mode._replace(slips=float(np.sign(slip)) if engaged else 0.0)
        self._sense(time, row)
        if engaged and slip == 0.0:
            carried = float(self._carried(self.moment(time, row))[0])
            slips = self._let_go or (float(np.sign(carried)) if abs(carried) > self._capacity else 0.0)
            if slips:
                self.mode = self.mode._replace(slips=slips)
                self._sense(time, row)
        self._let_go = 0.0
        change = "opens" if not engaged else "slips" if self.mode.slips else "holds"
        if self.layout.clutched and change != self._clutch:
            turns = self.motion.system.turns(self.motion.names[0])
            figure = (slip, "rad/s" if turns else "m/s") if change == "slips" else (np.nan, "")
            self._note(time, f"clutch-{change}", *figure)
            self._clutch = change
        stays, rested = self.sense == 0, bool(self.solution.stretches and self.solution.stretches[-1].resting)
        self.resting = bool(self.mode.senses) and stays
        if self.resting and not rested:
            self._note(time, "rest")
        elif not stays and row[self.layout.coordinates] == 0.0:
            self._note(time, "break-away", float(self.sense))

    def _sense(self, time: float, row: Array) -> None:
        """The sense in which the one free coordinate moves on, 0 if it stays."""
        if not self.motion.resisted:
            return
        sense = int(np.sign(row[self.layout.coordinates]))
        if sense == 0:
            forward, backward = self.motion.excess(self.moment(time, row))[:, 0]
            if max(forward, backward) > 0.0:
                sense = 1 if forward >= backward else -1
        self.mode = self.mode._replace(senses=(sense,))

    def _let(self, time: float, onsets: tuple[Onset, ...]) -> None:
        """Let contacts be as they are from here on."""
        self.mode = self.mode._replace(onsets=onsets)

    def _jammed(self, time: float, row: Array, senses: tuple[int, ...]) -> bool:
        """Let joints lock, if they can: they stop at once."""
        locked = self._active.lock(self.moment(time, row), senses)
        if locked is None:
            return False
        energy = self._stopped(time, row, locked.rate)
        for k in locked.joints:  # the whole loss is told once
            figure = energy if k == locked.joints[0] else np.nan
            self._note(time, "lock", figure, "J", self.motion.resisted[k])
        self.mode = self.mode._replace(senses=locked.senses)
        return True

    def _locked(self, time: float, row: Array, causes: Sequence[str]) -> bool:
        """As of any motion; where several coordinates are free, some joints lock."""
        if not (self.motion.several and self.motion.resisted):
            return super()._locked(time, row, causes)
        with np.errstate(all="ignore"):
            return bool({"locked", "no_acceleration"} & set(causes)) and self._jammed(time, row, self.mode.senses)

    def _rests(self, time: float, row: Array, sticks: Sequence[int]) -> None:
        """Whether all free coordinates rest from here on, in what resists the joints."""
        n, before, self.resting = self.layout.coordinates, self.resting, False
        at = self.moment(time, row)
        if set(self.motion.names) != set(self.motion.system.mechanism.drivers) or not sticks:
            return
        ways = self.motion.ways(at)[0][sticks]
        if np.linalg.matrix_rank(ways, tol=RANK) < n or np.any(np.abs(row[n : 2 * n]) > IDLE * self.pace):
            return
        row[n : 2 * n], self.resting = 0.0, True
        if not before:
            self._note(time, "rest")

    # ---- what a contact comes to ------------------------------------------------------------------------------

    def _measured(self, stretch: Stretch) -> None:
        """Peaks, impulse and wear of the contacts that last, of a step."""
        if not (self._open and stretch.end > stretch.begin):
            return
        begins = np.array([stretch.begin, stretch.end])
        touches = self._look(stretch.state, step_nodes(begins)[0])
        for k, opening in self._open.items():
            numbers = np.array([touches.gap[k], touches.slip[k], touches.normal[k]])
            courses = over_steps(begins, numbers[:, None])
            parted = courses.parted(courses.passages(SLIP))
            opening.impulse += courses.span * float(courses.mean()[NORMAL])
            opening.wear += courses.span * float(parted.mean(lambda rows: np.abs(rows[SLIP] * rows[NORMAL])))
            for key, number, sign in (("force", NORMAL, 1.0), ("depth", GAP, -1.0)):
                if key == "depth" and self.motion.contacts[k].rigid:
                    continue
                most = getattr(opening, key)
                if np.max(sign * numbers[number]) > (1.0 - NEARLY) * most:
                    place = courses.extreme(lambda rows, number=number: rows[number], sign)  # type: ignore[misc]
                    setattr(opening, key, most if place is None else max(most, sign * place.value))

    def run(self, row: Array) -> Solution:
        """The motion from an initial row; contacts that last at its end have an end that is not known."""
        at = self.moment(self.start, row)
        self._limited = {i: 1.0 if self._over_limit(i, at)[0] > 0.0 else -1.0 for i in self._limited}
        super().run(row)
        self.solution.impacts.sort(key=lambda impact: impact.begin)
        return self.solution
