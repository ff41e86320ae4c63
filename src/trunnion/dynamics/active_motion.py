"""Motion in time that follows what holds, slips and is open: joints at rest, contacts of joints in play, a clutch.

A step ends where a gap closes or opens, where a joint that slides comes to rest, and where one that sticks breaks away,
so that every step is taken through smooth forces. Between contacts the pin flies; the forces of a contact come with its
onset, whose speed of approach its law needs. What holds, slips or is open from then on is the answer of a
complementarity, and so is which joints lock where there is none: see `active`. Contacts of rigid bodies:
`impact_motion`.

One free coordinate rests while what drives it lies between the efforts at which it would break away forward and
backward, every friction and resisting load against that motion, at its value for slip 0.

While a clutch is open or slips the rotor turns by itself, J ω̇ = T(ω) − σ C, with the capacity C and the sense σ of the
slip s = ω − i q̇; the coordinate is driven by σ C through the gear. While it holds, s = 0 and the rotor is part of what
the coordinate moves. It slips on from where it would have to carry more than C.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trunnion.dynamics.active import IDLE, SLACK, ActiveSet
from trunnion.dynamics.bordered import RANK
from trunnion.dynamics.guards import Crossing
from trunnion.dynamics.integrate import Integration
from trunnion.dynamics.rates import Seen
from trunnion.dynamics.solution import Event, Impact, Solution, Stretch, over_steps, step_nodes
from trunnion.dynamics.state import Moment
from trunnion.dynamics.touching import FIRST, SLOWEST, Closed, Onset

__all__ = ["ActiveMotion", "OpenContact"]

Array = NDArray[np.float64]
Dense = Callable[[Array], Array]  # the state by time, (time,) -> (number, time)

GAP, SLIP, NORMAL = range(3)  # rows of a contact over a step
NEARLY = 1e-3  # of the largest force so far: a step that comes as near may hold a larger one
ROUNDING = 1e-12  # of the capacity: what a clutch that just holds may carry more, by rounding


@dataclass
class OpenContact:
    """A contact that lasts: its onset, and what it has come to so far."""

    begin: float
    approach: float
    force: float = 0.0
    depth: float = 0.0
    wear: float = 0.0
    impulse: float = 0.0


@dataclass
class ActiveMotion(Integration):
    """An integration that follows contacts and what sticks."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.count = self.rows = len(self.motion.contacts.each)  # rows of `_gaps`
        self.mode = self.mode._replace(onsets=(None,) * self.count)
        self._open: dict[int, OpenContact] = {}
        self._crossed: int | None = None  # joint that has changed
        self._let_go = 0.0  # sense in which a clutch that held begins to slip
        self._drive = next(iter(self.motion.drives.values()))
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
        """Those of contacts, then those of joints, then that of the clutch."""
        senses = stretch.mode.senses
        waits = senses[:1] == (0,) and self._may_change()
        if not (self.motion.several or self.count or self.layout.clutched or waits):
            return None

        def values(times: Array) -> Array:
            at = stretch.at(self.layout, times)
            with np.errstate(all="ignore"):
                return np.vstack([self._gaps(at), self._of_joints(at), self._of_clutch(at)])

        return values

    def _may_change(self) -> bool:
        """Whether anything may change while the one free coordinate rests."""
        system, driven = self.motion.system, len(self.motion.system.mechanism.drivers) > 1
        varies = any(entry.varies for entry in system.mechanism.parameter_set.entries.values())
        return driven or varies or self._drive.timed

    def _gaps(self, at: Moment) -> Array:
        """Gaps, m, (contact, lane), negative where a contact that touches is open or another has closed."""
        sign = np.array([1.0 if onset is None else -1.0 for onset in self.onsets])
        gaps: Array = sign[:, None] * self.dynamics.look(at).gap if self.count else np.empty((0, len(at.time)))
        return gaps

    def _of_joints(self, at: Moment) -> Array:
        """Speeds in their sense of the joints that slide, and what is left to those that stick before they break away,
        (joint, lane)."""
        senses = np.array(at.senses)[:, None]
        if not self.motion.several:  # where it comes to rest is approached by the steps themselves
            rests = self.motion.rests(at)
            return -np.max(self.motion.excess(at), axis=0)[None] if rests else np.ones((len(at.senses), len(at.time)))
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

    def _of_clutch(self, at: Moment) -> Array:
        """What is left of the slip of a clutch, or of the capacity of one that holds, (0 or 1, lane)."""
        if at.slips:
            return at.slips * at.slip
        if not (self.layout.clutched and self._drive.engaged(at.now)):
            return np.empty((0, len(at.time)))
        return (self._capacity - np.abs(self._carried(at)))[None]

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
        if crossing.row < self.rows:
            return self._met(crossing.row, crossing.time, row)
        joint = crossing.row - self.rows
        if joint < len(self.mode.senses):
            self._crossed = joint
        elif self.mode.slips:
            row[self.layout.slip] = 0.0
        else:
            at = self.solution.stretches[-1].at(self.layout, np.array([crossing.time]))
            self._let_go = float(np.sign(self._carried(at)[0]))
        return np.inf

    def _met(self, k: int, time: float, row: Array) -> float:
        """Let a contact begin or end; how long the first step after it may be, s."""
        rate = float(self._look(lambda times: row[:, None], np.array([time])).rate[k, 0])
        onsets = list(self.onsets)
        if onsets[k] is None:
            onsets[k] = max(-rate, SLOWEST)
            self._open[k] = OpenContact(time, max(-rate, 0.0))
            self._say(time, "impact", k, -rate)
        else:
            onsets[k] = None
            self._end(k, time, rate)
        self.mode = self.mode._replace(onsets=tuple(onsets))
        return FIRST * self.motion.contacts.least_clearance / max(abs(rate), SLOWEST)

    def _say(self, time: float, kind: str, k: int, figure: float) -> None:
        self.solution.events.append(Event(time, kind, self.motion.contacts.labels[k], figure, "m/s"))

    def _end(self, k: int, time: float, rate: float) -> None:
        """A contact lifts off."""
        self.solution.impacts.append(self._impact_of(k, self._open.pop(k), time, rate))
        self._say(time, "lift-off", k, rate)

    def _impact_of(self, k: int, contact: OpenContact, end: float, rate: float) -> Impact:
        label, figures = self.motion.contacts.labels[k], (contact.force, contact.depth, contact.wear, contact.impulse)
        return Impact(label, contact.begin, end, contact.approach, rate, *figures)

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
                    self.solution.events.append(Event(time, "stick", joint))
                elif case.senses[k] != 0 and not was:
                    self.solution.events.append(Event(time, "break-away", joint, float(case.senses[k])))
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
            self.solution.events.append(Event(time, "lock", self.motion.resisted[k], figure, "J"))
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
            if np.max(numbers[NORMAL]) > (1.0 - NEARLY) * opening.force and (place := courses.extreme(_normal)):
                opening.force = max(opening.force, place.value)
            if self.motion.contacts.each[k].rigid:
                continue
            if np.max(-numbers[GAP]) > (1.0 - NEARLY) * opening.depth and (place := courses.extreme(_depth)):
                opening.depth = max(opening.depth, place.value)

    def run(self, row: Array) -> Solution:
        """The motion from an initial row; contacts that last at its end have an end that is not known."""
        super().run(row)
        self.solution.impacts += [self._impact_of(k, contact, np.nan, np.nan) for k, contact in self._open.items()]
        self.solution.impacts.sort(key=lambda impact: impact.begin)
        return self.solution


def _normal(rows: Array) -> Array:
    return np.asarray(rows[NORMAL])


def _depth(rows: Array) -> Array:
    return np.asarray(-rows[GAP])
