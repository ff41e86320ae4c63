"""Motion in time that follows what holds, slips and is open: joints at rest, contacts of joints in play, a clutch.

A step ends where a gap closes or opens, where a joint that slides comes to rest, and where one that sticks breaks away,
so that every step is taken through smooth forces. Between contacts the pin flies; the forces of a contact come with its
onset, whose speed of approach its law needs. What holds, slips or is open from then on is the answer of a
complementarity of forces and accelerations, and so is which joints lock where there is none: see `active_set`.
Contacts of rigid bodies: `impact_motion`.

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
from scipy.integrate import OdeSolver

from trunnion.dynamics.active_set import IDLE, SLACK, ActiveSet
from trunnion.dynamics.bordered import RANK
from trunnion.dynamics.guards import Crossing, first_crossing
from trunnion.dynamics.integrate import PAST, SHRUNK, Integration
from trunnion.dynamics.rates import Seen
from trunnion.dynamics.solution import CLOSE, Ended, Impact, Solution, Stretch, over_steps, step_nodes
from trunnion.dynamics.state import Moment
from trunnion.dynamics.touching import FIRST, SLOWEST, Closed, Onset, least_clearance

Array = NDArray[np.float64]
Dense = Callable[[Array], Array]  # the state by time, (time,) -> (number, time)

MOST_EVENTS = 100_000
AHEAD = 1e-6  # of a typical time: how far ahead of a step that fails one looks for what keeps it
WALK = 25  # evaluations by machine code that take about as long as a walk through the modules
CREEPING = ((400, 1e-9), (40, 1e-12))  # steps that get on by less of the duration: it does not get on
STUCK = 50  # events at one time
LOOKS, SCANNED = 12, 200  # times within a step, and within a rest, at which one looks for what changes
GAP, SLIP, NORMAL = range(3)  # rows of a contact over a step
NEARLY = 1e-3  # of the largest force so far: a step that comes as near may hold a larger one
ROUNDING = 1e-12  # of the capacity: what a clutch that just holds may carry more, by rounding


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

    # ---- from event to event ------------------------------------------------------------------------------------

    @np.errstate(all="ignore")
    def run(self, row: Array) -> Solution:
        """The motion from an initial row; contacts that last at its end have an end that is not known."""
        at = self.moment(self.start, row)
        self._limited = {i: 1.0 if self._over_limit(i, at)[0] > 0.0 else -1.0 for i in self._limited}
        self._follow(self.start, row)
        if self._begins(row):
            self._go_on(row)
        self.solution.impacts.sort(key=lambda impact: impact.begin)
        return self.solution

    def _go_on(self, row: Array) -> None:
        """Move from event to event."""
        before, time, stayed = self.start - 1.0, self.start, 0
        for _ in range(MOST_EVENTS):
            self.last = time, row
            if time >= self.duration * (1 - CLOSE) or self.solution.ended:
                return
            stayed, before = (stayed + 1 if time == before else 0), time
            if stayed > STUCK:
                self._stop("step", time, row)
                return
            k = next(k for k, time_of_break in enumerate(self.breaks) if time_of_break > time + CLOSE * self.duration)
            until, now = self.breaks[k], 0.5 * (self.breaks[k] + (self.breaks[k - 1] if k else self.start))
            self.mode = self.mode._replace(now=now)
            if not self._decided(time, row):
                return
            time, row, crossing = self._move(time, row, until)
            if crossing is not None and not self.solution.ended:
                self._follow(time, row)
                self.step = min(self._changed(crossing, row), self.step)
        self._stop("events", time, row)

    def _begins(self, row: Array) -> bool:
        """Whether there are accelerations at the start; they also tell what rates are typical."""
        n, start = self.layout.coordinates, self.start
        if self.motion.several:
            if not self._decided(start, row):
                return False
        elif self.motion.resisted:
            if row[n] == 0.0:
                if not (assembled := self._assembled(self.moment(start, row))):
                    self._stop("not_assembled", start, row)
                return assembled
            self.mode = self.mode._replace(senses=(int(np.sign(row[n])),))
        at = self.moment(start, row)
        second = self.dynamics(at).second
        if n == 1 and row[n] != 0.0 and not np.all(np.isfinite(second)):  # as where the ends of a spring meet
            ahead = at.q + np.sign(row[n]) * self._inside(row[0])
            second = self.dynamics(at._replace(q=ahead)).second
            self.bends = (*self.bends, float(row[0] % self.places.period if self.places.period else row[0]))
        if not np.all(np.isfinite(second)):
            cause = self._cause(start, row) or "no_acceleration"
            if self._locked(start, row, [cause]):
                return True
            self._stop(cause, start, row)
            return False
        self.pace = np.maximum(self.pace, np.maximum(np.sqrt(np.abs(second)), np.abs(row[n : 2 * n])))
        return True

    def _move(self, time: float, row: Array, until: float) -> tuple[float, Array, Crossing | None]:
        """Move, or rest, until the next break, until the motion ends, or until something changes within a step.

        A step that runs past a place at which a force jumps or bends is taken anew, up to that place.
        """
        self.between = self._place(float(row[0]), self.sense or float(np.sign(row[self.layout.coordinates])))
        rate, absolute, marks = self._rate(), self._absolute(row), [time]
        stays = self.motion.stays(self.moment(time, row))
        first = until - time if stays else min(self.step, until - time)
        solver = self._solver(rate, time, row, until, absolute, first)
        while solver.status == "running":
            before, row = float(solver.t), np.array(solver.y)
            marks.append(before)
            if any(len(marks) > k and before - marks[-k] < crept * self.duration for k, crept in CREEPING):
                return *self._failed(before, row), None
            solver = self._stepped(solver, rate, absolute, stays)
            if solver.status == "failed" or not np.all(np.isfinite(solver.y)):
                return *self._failed(before, row), None
            end = float(solver.t)
            stretch = Stretch(before, end, solver.dense_output(), self.mode, self.resting, self.snapshot)
            looks = SCANNED if stretch.resting and not self.motion.several else LOOKS
            times, values = np.linspace(before, end, looks + 1)[1:], self._values(stretch)
            crossing = None if values is None else first_crossing(values, before, times)
            if crossing is not None and not self.motion.several:
                near = crossing.time + PAST * (crossing.time - before)
                if near < end - PAST * (end - before):
                    solver = self._solver(rate, before, row, near, absolute, near - before)
                    continue
            self._add(stretch, crossing)
            if crossing is not None:
                return crossing.time, stretch.state(np.array([crossing.time]))[:, 0], crossing
            if self.solution.ended:
                break
            self._follow(end, np.array(solver.y))
            self._end_step(solver, np.array(solver.y))
            self._compare(before, row)
            if self._reaches_dead_centre(solver, np.diff([*marks[-SHRUNK:], end])):
                break
        return float(solver.t), np.array(solver.y), None

    def _failed(self, time: float, row: Array) -> tuple[float, Array]:
        """Say why there is no next step; a linkage that locks as it runs stops."""
        self.step = 0.0
        n, row, soon = self.layout.coordinates, row.copy(), AHEAD / float(np.max(self.pace))
        ahead, later = row.copy(), row.copy()
        ahead[:n] += 1e-6 * np.sign(row[n : 2 * n]) * np.maximum(1.0, np.abs(row[:n]))
        later[:n] += soon * row[n : 2 * n]
        causes = [self._cause(*state) for state in ((time, row), (time, ahead), (time + soon, later))]
        if self._locked(time, row, causes):
            return time, row
        code = next(filter(None, causes), "step")
        if code == "not_assembled" and not causes[0] and not self.motion.several:  # it can be assembled until then
            self._turns_round(time, {"coordinate": float(row[0]), "rate": float(row[n])})
        else:
            self._stop(code, time, row)
        return time, row

    def _add(self, full: Stretch, crossing: Crossing | None) -> None:
        """Add a step, up to where its mode changes or the motion ends in it."""
        stretch, stretches = full if crossing is None else full._replace(end=crossing.time), self.solution.stretches
        stretch, ended = self.guards.bounded(stretch, stretches[-1] if stretches else None)
        self._measured(stretch)
        stretches.append(stretch)
        while self.guards.passed:
            self._note(self.guards.passed.pop(), "change-point")
        if self.progress:
            self.progress(min(1.0, stretch.end / self.duration))
        spent = self.solution.asked + WALK * (self.motion.walked[0] - self._walked)
        if ended is None and spent > self.evaluations:
            figures = {"count": self.evaluations, "of": self.duration}
            ended = Ended("simulate.evaluations", stretch.end, figures)
        self.solution.ended = ended

    def _end_step(self, solver: OdeSolver, row: Array) -> None:
        """What contacts that are closed need at the end of a step."""

    # ---- what ends a step -------------------------------------------------------------------------------------

    def _look(self, dense: Dense, times: Array) -> Seen:
        """The contacts at times of a step."""
        return self.dynamics.look(self.layout.moment(times, np.asarray(dense(times)), self.mode))

    def _values(self, stretch: Stretch) -> Callable[[Array], Array] | None:
        mechanism = self.motion.system.mechanism
        varies = any(entry.varies for entry in mechanism.parameter_set.entries.values())
        changes = self.motion.several or len(mechanism.drivers) > 1 or varies or self._drive.timed
        if stretch.resting and not changes:
            return None

        def values(times: Array) -> Array:
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
            walk, left = self.motion.walk(at), 0.0 * senses
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
        case = ActiveSet(self.motion, float(np.max(self.pace))).of(at, before, crossed)
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
        locked = ActiveSet(self.motion, float(np.max(self.pace))).lock(self.moment(time, row), senses)
        if locked is None:
            return False
        energy = self._stopped(time, row, locked.rate)
        for k in locked.joints:  # the whole loss is told once
            figure = energy if k == locked.joints[0] else np.nan
            self._note(time, "lock", figure, "J", self.motion.resisted[k])
        self.mode = self.mode._replace(senses=locked.senses)
        return True

    def _locked(self, time: float, row: Array, causes: Sequence[str]) -> bool:
        """Let joints stop at once, as friction holds them: there is no solution, or it grows faster with the
        acceleration against the motion than what brakes it."""
        n = self.layout.coordinates
        if not self.motion.resisted:
            return False
        if self.motion.several:
            return bool({"locked", "no_acceleration"} & set(causes)) and self._jammed(time, row, self.mode.senses)
        if row[n] == 0.0:
            return False
        if "locked" not in causes:
            along, against = self.motion.growth(self.moment(time, row))[:: int(np.sign(row[n]))]
            if "no_acceleration" not in causes or not against <= 0.0 < along:
                return False
        self._note(time, "lock", self._stopped(time, row, np.zeros(n)), "J")
        return True

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
