"""Integration of a free motion in time, from event to event.

SciPy's integrators take the steps: DOP853 (E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations
I, 2nd ed., Springer, 1993) or, where bristles make the equations stiff, LSODA (L. Petzold, SIAM J. Sci. Stat. Comput. 4
(1983) 136-148, doi:10.1137/0904010). Where a force jumps or bends - a joint turns round, a load begins, a motor is
switched - the step ends, and the next begins from there, so that every step is taken through smooth forces. Such places
are located on the dense output to rounding.

What holds, slips and is open until then: see `active_motion`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853, LSODA, OdeSolver

from trunnion.algebra.dual import single
from trunnion.dynamics.followed import Snapshot
from trunnion.dynamics.guards import Crossing, DeadCentre, Guards, first_crossing
from trunnion.dynamics.rates import WORKS, Dynamics, Layout, kinetic_energy
from trunnion.dynamics.solution import CLOSE, Ended, Event, Solution, Stretch, by_time
from trunnion.dynamics.start import Places
from trunnion.dynamics.state import FreeMotion, Mode, Moment
from trunnion.errors import Status
from trunnion.solve.status import pose_status

__all__ = ["FINEST", "MOST_EVALUATIONS", "Integration"]

Array = NDArray[np.float64]

FINEST = 3e-14  # the least relative tolerance of SciPy's integrators
MOST_EVENTS = 100_000
MOST_EVALUATIONS = 2_000_000  # of the forces, if not stated otherwise
WALK = 25  # evaluations by machine code that take about as long as a walk through the modules
CREEPING = ((400, 1e-9), (40, 1e-12))  # steps that get on by less of the duration: it does not get on
SEVERAL, LOOKED = "simulate.several_accelerations", 32  # steps after which one looks for other accelerations
AHEAD = 1e-6  # of a typical time: how far ahead of a step that fails one looks for what keeps it
STUCK = 50  # events at one time
LOOKS, SCANNED = 12, 200  # times within a step, and within a rest, at which one looks for what changes
RETRIES = 5  # first steps, each 100 times shorter than the last, of an integrator that has asked where nothing is known
NEAR = 1e-8  # of the coordinate: places that are one
SLIGHT = 1e-6  # of a typical acceleration: one that may be rounding
INSIDE = 1e-9  # of the coordinate: how far from a bend forces are asked of walks, which take less for rest
MEETING = 1e-3  # likewise, of a bend at which assemblies meet: the digits of the accelerations are lost like its square


class _Over(Exception):  # noqa: N818 (it is no error)
    """The motion ends with the last step; `Solution.ended` says why."""


class _Changed(Exception):  # noqa: N818 (it is no error)
    """A row of the motion has changed within a step, which ends there. stretch: of the step to its end."""

    def __init__(self, crossing: Crossing, stretch: Stretch) -> None:
        super().__init__()
        self.crossing, self.stretch = crossing, stretch


class Passing(NamedTuple):
    """A number of the state, by its place in the row, and the value that it passes."""

    number: int
    value: float


@dataclass
class Integration(ABC):
    """One motion from its initial state.

    progress: told the share of the duration that is reached; times: s, at which a load jumps or bends; evaluations: of
    the forces, at most, a walk counted as WALK; start: time, s, at which it begins; duration: at which it ends; mode:
    what is so until something switches; resting: whether all free coordinates rest.
    """

    motion: FreeMotion
    dynamics: Dynamics
    duration: float
    tolerance: float
    places: Places = field(default_factory=Places)
    progress: Callable[[float], None] | None = None
    times: Sequence[float] = ()
    evaluations: int = MOST_EVALUATIONS
    mode: Mode = field(default_factory=Mode)
    start: float = 0.0
    resting: bool = False

    def __post_init__(self) -> None:
        self.layout, self.bends = Layout.of(self.motion), self.places.bends
        self.solution = Solution(self.layout)
        switch_times = [time for drive in self.motion.drives.values() for time in drive.times]
        times = {time for time in (*switch_times, *self.times) if self.start < time < self.duration}
        self.pace = np.sqrt(self.motion.unit)  # typical rates
        self.turned_over, self.asked_for = 0.0, 0
        self.last = self.start, np.empty(0)  # time and row from which it is to go on
        self._doubts = 0
        self.breaks = [*sorted(times), self.duration]
        self.mode = self.mode._replace(now=0.5 * (self.start + self.breaks[0]))
        self.ends = np.array([self.places.limits.get(name, (-np.inf, np.inf)) for name in self.motion.names], float).T
        self._walked = self.motion.walked[0]
        self.guards = Guards(self.motion, self.layout, self.places.limits, self.dynamics.margins)

    # ---- the whole way ----------------------------------------------------------------------------------------

    def run(self, row: Array) -> Solution:
        """The motion from an initial row."""
        with suppress(_Over):
            self._run(row)
        return self.solution

    def _run(self, row: Array) -> None:
        self._follow(self.start, row)
        if not self._begins(row):
            return
        before, time, step, stayed = self.start - 1.0, self.start, None, 0
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
            try:
                time, row, step = self._move(time, row, until, step)
            except _Changed as change:
                time, stretch = change.crossing.time, change.stretch
                row = stretch.state(np.array([time]))[:, 0]
                self._follow(time, row)
                step = min(self._changed(change.crossing, row), stretch.end - stretch.begin)
        self.end("events", time, {"count": float(MOST_EVENTS)})

    def moment(self, time: float, row: Array) -> Moment:
        """The state of a row."""
        return self.layout.moment(np.array([time]), row[:, None], self.mode)

    # ---- what holds, slips or is open: see `active_motion` ---------------------------------------------------------

    @abstractmethod
    def _decided(self, time: float, row: Array) -> bool:
        """Find the mode from here on; `row` is what it is after it. Whether there is one."""

    @abstractmethod
    def _values(self, stretch: Stretch) -> Callable[[Array], Array] | None:
        """By time what stays above 0 within a step while its mode lasts, (number, time); None: there is nothing."""

    @abstractmethod
    def _changed(self, crossing: Crossing, row: Array) -> float:
        """Let one change, and `row` with it; how long the first step after it may be, s."""

    @abstractmethod
    def _measured(self, stretch: Stretch) -> None:
        """What contacts come to in a step."""

    def _end_step(self, solver: OdeSolver, row: Array) -> None:  # noqa: B027 (what is closed needs it)
        """What they need at the end of a step."""

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
        with np.errstate(all="ignore"):
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

    def end(self, code: str, time: float, figures: dict[str, Any] | None = None) -> None:
        self.solution.ended = Ended(f"simulate.{code}", time, figures or {})

    def _note(self, time: float, kind: str, figure: float = np.nan, unit: str = "") -> None:
        self.solution.events.append(Event(time, kind, self.motion.names[0], figure, unit))

    def _add(self, begin: float, end: float, state: Callable[[Array], Array]) -> None:
        """Add a step, up to where its mode changes or the motion ends in it."""
        full = stretch = Stretch(begin, end, state, self.mode, self.resting, self.snapshot)
        stretches, crossing = self.solution.stretches, None
        if values := self._values(stretch):
            looks = SCANNED if stretch.resting and not self.motion.several else LOOKS
            times = np.linspace(stretch.begin, stretch.end, looks + 1)[1:]
            crossing = first_crossing(values, stretch.begin, times)
        if crossing is not None:
            stretch = stretch._replace(end=crossing.time)
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
        if ended is not None:
            self.solution.ended = ended
            raise _Over
        if crossing is not None:
            raise _Changed(crossing, full)

    @property
    def snapshot(self) -> Snapshot | None:
        """From which the assembly goes on; None where it is not followed."""
        return self.motion.followed[0].snapshot if self.motion.followed else None

    def _follow(self, time: float, row: Array) -> None:
        with np.errstate(all="ignore"):
            self.motion.step(self.moment(time, row))

    # ---- in motion --------------------------------------------------------------------------------------------

    def _move(self, time: float, row: Array, until: float, step: float | None) -> tuple[float, Array, float | None]:
        """Move, or rest, until the next place where a force jumps or bends, a rest, or the next break."""
        n = self.layout.coordinates
        between = self._place(float(row[0]), self.sense or float(np.sign(row[n])))
        rate = self._rate(between)
        if row[n] == 0.0 and row[0] in self.ends[:, 0]:
            outward = np.sign(row[0] - np.mean(self.ends[:, 0])) * rate(time, row)[n]
            if outward > SLIGHT * self.motion.unit[0]:  # else it is rounding, or ends by the steps that follow
                self._end_at(time, float(row[0]))
                return time, row, None
        first = min(step, 0.5 * (until - time)) if step else None
        if self.motion.stays(self.moment(time, row)):
            first = until - time
        absolute, marks = self._absolute(row), [time]
        solver = self._solver(rate, time, row, until, absolute, first)
        dead_centre = DeadCentre(self.motion, self.layout)
        while solver.status == "running":
            before, row = float(solver.t), np.array(solver.y)
            marks.append(before)
            if any(len(marks) > k and before - marks[-k] < crept * self.duration for k, crept in CREEPING):
                return self._failed(before, row)
            size = float(getattr(solver, "h_abs", None) or solver.step_size or 0.0)  # of the step that comes
            near = self._near(row, between, min(size, until - before), rate, before)
            solver = solver if near else self._stepped(solver, rate, absolute)
            if near is None and (solver.status == "failed" or not np.all(np.isfinite(solver.y))):
                return self._failed(before, row)
            if near is None and (end := self._left_range(row, np.array(solver.y))) is not None:
                self._end_at(before, end)
                return before, row, None
            passed = near or self._passed(row, np.array(solver.y), between)
            if passed is not None and passed.number == 0 and row[n] == 0.0:  # from rest: nearer first
                size = 0.25 * (float(solver.t) - before)
                solver = self._solver(rate, before, row, until, self._absolute(row), size)
                continue
            if passed is not None:
                last = float(solver.step_size or 0.0)
                return (*self._approach(before, row, passed, until, rate), last or None)
            self._add(before, float(solver.t), solver.dense_output())
            self._follow(float(solver.t), np.array(solver.y))
            self._end_step(solver, np.array(solver.y))
            self._compare(before, row)
            if event := dead_centre.reached(solver, float(solver.t) - before):
                self._turns_round(*event)
                break
        return float(solver.t), np.array(solver.y), float(solver.step_size or 0.0) or None

    @property
    def sense(self) -> int:
        """Of the motion of one free coordinate that may rest; else 0."""
        return self.mode.senses[0] if self.mode.senses and not self.motion.several else 0

    def _rate(self, between: tuple[float, float]) -> Callable[[float, Array], Array]:
        """The derivative of a row by time, within one stretch: nothing beyond its ends is asked for."""
        n, sense = self.layout.coordinates, self.sense
        low, high = (end + side * self._inside(end) for end, side in zip(between, (1.0, -1.0), strict=True))

        def rate(moment: float, numbers: Array) -> Array:
            self.solution.asked += 1
            speeds = numbers[n : 2 * n]
            numbers_asked = numbers.copy()
            if self.motion.several:
                if self.places.limits:  # no force may be known beyond
                    numbers_asked[:n] = np.clip(numbers[:n], *self.ends)
            elif not self.resting:
                numbers_asked[0] = min(max(numbers[0], low), high)
                if sense and sense * speeds[0] < 0.0:
                    numbers_asked[n] = 0.0
            with np.errstate(all="ignore"):
                second, others, sound, _ = self.dynamics(self.moment(moment, numbers_asked))
            return np.concatenate([speeds, second, others]) if sound else np.full(len(numbers), np.nan)

        return rate

    def _inside(self, end: float) -> float:
        """How far from the end of a stretch forces are asked for."""
        if not np.isfinite(end):
            return 0.0
        return (INSIDE if self._meeting(end) is None else MEETING) * max(1.0, abs(end))

    def _solver(
        self, rate: Callable[[float, Array], Array], begin: float, row: Array, end: float, absolute: Array,
        first: float | None = None,
    ) -> OdeSolver:  # fmt: skip
        kind = LSODA if self.motion.bristles else DOP853
        if first is None and not np.all(np.isfinite(rate(begin, row))):
            first = 1e-12 * abs(end - begin)  # SciPy would look for one without end; so the first step fails
        return kind(rate, begin, row, end, rtol=self.tolerance, atol=absolute, first_step=first)

    def _stepped(self, solver: OdeSolver, rate: Callable[[float, Array], Array], absolute: Array) -> OdeSolver:
        """One step. LSODA does not get over an unknown rate: it begins anew, shorter."""
        begin, state = float(solver.t), np.array(solver.y)
        solver.step()
        for k in range(1, RETRIES + 1 if self.motion.bristles else 0):
            if solver.status != "failed" and np.all(np.isfinite(solver.y)):
                break
            end = float(solver.t_bound)
            solver = self._solver(rate, begin, state, end, absolute, 0.01**k * abs(end - begin))
            solver.step()
        return solver

    def _near(
        self, row: Array, between: tuple[float, float], step: float, rate: Callable[[float, Array], Array], time: float
    ) -> Passing | None:
        """The bend that the next step would pass, foreseen by the speed; not if it turns round before."""
        n = self.layout.coordinates
        speed = float(row[n])
        level = between[1] if speed > 0 else between[0]
        if self.motion.several or not np.isfinite(level) or speed == 0.0:
            return None
        if not (level - row[0]) / speed < step:
            return None
        reached = speed * speed + 2.0 * float(rate(time, row)[n]) * (level - float(row[0]))
        return Passing(0, level) if reached > 0.0 else None

    def _left_range(self, before: Array, after: Array) -> float | None:
        """The end of its range that one coordinate, which stood there, has left by more than rounding."""
        for end, outward in zip(self.ends[:, 0], (-1.0, 1.0), strict=True) if not self.motion.several else ():
            slack = NEAR * max(1.0, abs(end))
            if abs(before[0] - end) <= slack < outward * (after[0] - end):
                return float(end)
        return None

    def _passed(self, before: Array, after: Array, between: tuple[float, float]) -> Passing | None:
        """What a step has passed: the speed 0, or else a bend; the step is then taken anew, up to it."""
        n = self.layout.coordinates
        if self.sense and self.sense * after[n] <= 0.0:
            return Passing(n, 0.0)
        if not self.motion.several:
            low, high = self.ends[:, 0]
            for level in between:
                if level in (low, high) and low <= after[0] <= high:  # it comes back by rounding
                    continue
                if np.isfinite(level) and (before[0] - level) * (after[0] - level) < 0:
                    ahead = (level - before[0]) * before[n] > 0.0
                    return Passing(0, level) if ahead or before[n] == 0.0 else Passing(n, 0.0)
        return None

    def _approach(
        self, time: float, row: Array, to: Passing, until: float, rate: Callable[[float, Array], Array]
    ) -> tuple[float, Array]:
        """Move exactly to where a number of the state has a value: that number takes the place of the time.

        M. Hénon, On the numerical computation of Poincaré maps, Physica D 5 (1982) 412-414,
        doi:10.1016/0167-2789(82)90034-3. No force beyond the place is asked for. Where another number gets to its own
        place first, as a speed that becomes 0 before the bend, that one is approached instead.
        """
        n, k = self.layout.coordinates, to.number

        def by_number(value: float, numbers: Array) -> Array:
            state = numbers.copy()
            moment, state[k] = float(numbers[k]), value
            if k == 0 and self.sense and self.sense * state[n] <= 0.0:
                return np.full_like(state, np.nan)  # it turns round before
            numbers_at = rate(moment, state)
            pace = numbers_at[k]
            if not pace * (to.value - begin) > 0.0:
                return np.full_like(state, np.nan)  # it does not go there
            with np.errstate(all="ignore"):
                slopes: Array = numbers_at / pace
                slopes[k] = 1.0 / pace
            return slopes

        begin, state = float(row[k]), row.copy()
        if begin == to.value:
            if k == 0:
                self._end_at(time, to.value)
            return time, row
        state[k], absolute = time, self._absolute(row)
        absolute[k] = self.tolerance / max(float(np.max(self.pace)), 1e-300)
        solver = self._solver(by_number, begin, state, to.value, absolute)
        while solver.status == "running":
            last, last_row = float(solver.t), np.array(solver.y)
            if last == begin:
                solver = self._stepped(solver, by_number, absolute)
            else:
                solver.step()
            wrong, before = solver.status == "failed" or not np.all(np.isfinite(solver.y)), last_row.copy()
            before[k] = last
            if wrong and k == 0 and before[n] != 0.0:  # it turns round before the place
                return self._approach(float(last_row[k]), before, Passing(n, 0.0), until, rate)
            if wrong:
                return self._failed(float(last_row[k]), before)[:2]
            if solver.y[k] > until:
                return self._plain(float(last_row[k]), before, until, rate)
            along = by_time(solver.dense_output(), last, float(solver.t), k)
            self._add(float(last_row[k]), float(solver.y[k]), along)
        numbers_at = np.array(solver.y)
        end, numbers_at[k] = float(numbers_at[k]), to.value
        self._follow(end, numbers_at)
        if k == 0:
            self._end_at(end, to.value)
        return end, numbers_at

    def _end_at(self, time: float, coordinate: float) -> None:
        """End the motion where a coordinate is the end of the range, or that of a change point."""
        if coordinate in self.ends[:, 0]:
            self.end("range", time, {"driver": self.motion.names[0], "coordinate": coordinate})
        elif (module := self._meeting(coordinate)) is not None:
            self.end("change_point", time, self.motion.change_point(module, coordinate))

    def _meeting(self, coordinate: float) -> int | None:
        """The module of which two assemblies meet at a bend, if they do."""
        for meeting, module in self.places.meetings:
            apart, period = coordinate - meeting, self.places.period
            apart -= period * round(apart / period) if period and np.isfinite(apart) else 0.0
            if abs(apart) < NEAR * max(1.0, abs(coordinate)):
                return module
        return None

    def _plain(
        self, time: float, row: Array, until: float, rate: Callable[[float, Array], Array]
    ) -> tuple[float, Array]:
        """Up to a break in time that comes before the place is reached."""
        solver = self._solver(rate, time, row, until, self._absolute(row))
        while solver.status == "running":
            before = float(solver.t)
            solver.step()
            if solver.status == "failed":
                return self._failed(before, np.array(solver.y))[:2]
            self._add(before, float(solver.t), solver.dense_output())
        return float(solver.t), np.array(solver.y)

    def _absolute(self, row: Array) -> Array:
        """Absolute tolerances: a share of what is typical of each number."""
        n, system = self.layout.coordinates, self.motion.system
        sizes = np.array([1.0 if system.turns(name) else self.motion.size for name in self.motion.names])
        tolerances = np.full(len(row), self.tolerance)
        tolerances[:n] *= 0.01 * sizes
        tolerances[n : 2 * n] *= 0.01 * self.pace
        tolerances[2 * n : 3 * n] *= sizes
        tolerances[3 * n : 3 * n + self.layout.bristles] *= 1e-9
        self.turned_over = max(self.turned_over, float(np.max(np.abs(row[-len(self.layout.works_named) :]))))
        self.asked_for += 1
        if self.asked_for & (self.asked_for - 1) == 0:  # the 1st, 2nd, 4th … time: energy may be large and no work done
            self.turned_over = max(self.turned_over, self._kinetic(self.start, row))
        # at the start nothing is turned over: the works follow the motion then
        tolerances[-len(self.layout.works_named) :] = self.tolerance * self.turned_over if self.turned_over else np.inf
        return tolerances

    def _place(self, q: float, sense: float) -> tuple[float, float]:
        """The coordinates on either side of q at which a step ends; a coordinate that is one of them is left behind."""
        bends = np.asarray(self.bends, float)
        low, high = (float(end) for end in self.ends[:, 0])
        if len(bends):
            period = self.places.period or 0.0
            laps = np.floor(q / period) * period + period * np.arange(-1, 2) if period else [0.0]
            every = np.sort((bends[None] + np.asarray(laps)[:, None]).ravel())
            near = 1e-12 * max(1.0, abs(q))
            # one at q itself is behind, by the way it goes
            below = every[every < q + (near if sense > 0 else -near)]
            above = every[every > q - (near if sense < 0 else -near)]
            low = max(low, below[-1]) if len(below) else low
            high = min(high, above[0]) if len(above) else high
        return low, high

    def _failed(self, time: float, row: Array) -> tuple[float, Array, None]:
        """Say why there is no next step; a linkage that locks as it runs stops."""
        n, row, soon = self.layout.coordinates, row.copy(), AHEAD / float(np.max(self.pace))
        ahead, later = row.copy(), row.copy()
        ahead[:n] += 1e-6 * np.sign(row[n : 2 * n]) * np.maximum(1.0, np.abs(row[:n]))
        later[:n] += soon * row[n : 2 * n]
        causes = [self._cause(*state) for state in ((time, row), (time, ahead), (time + soon, later))]
        if self._locked(time, row, causes):
            return time, row, None
        code = next(filter(None, causes), "step")
        if code == "not_assembled" and not causes[0] and not self.motion.several:  # it can be assembled until then
            self._turns_round(time, {"coordinate": float(row[0]), "rate": float(row[n])})
        else:
            self._stop(code, time, row)
        return time, row, None

    def _turns_round(self, time: float, figures: dict[str, float]) -> None:
        """End at the dead centre of the driven joint."""
        self._note(time, "dead-centre")
        self.end("dead_centre", time, figures)

    def _locked(self, time: float, row: Array, causes: Sequence[str]) -> bool:
        """Let the one free coordinate stop at once, as friction holds it: it has no solution, or it grows faster with
        the acceleration against the motion than what brakes it."""
        n = self.layout.coordinates
        if self.motion.several or not self.motion.resisted or row[n] == 0.0:
            return False
        if "locked" not in causes:
            along, against = self.motion.growth(self.moment(time, row))[:: int(np.sign(row[n]))]
            if "no_acceleration" not in causes or not against <= 0.0 < along:
                return False
        self._note(time, "lock", self._stopped(time, row, np.zeros(n)), "J")
        return True

    def _compare(self, time: float, row: Array) -> None:
        """Tell where there are several accelerations, every few steps: E − T, which is continuous, has other roots than
        that which is followed where its determinant changes its sign far out."""
        if self.motion.affine or 0 in self.mode.senses or SEVERAL in self.solution.notes:
            return
        self._doubts += 1
        if self._doubts % LOOKED == 1 and np.any(self.motion.growth(self.moment(time, row)) < 0.0):
            self.solution.notes[SEVERAL] = {"time": time}

    def _stopped(self, time: float, row: Array, rates: Array) -> float:
        """Change rates at once, by friction: the energy lost, J, of rotors too, which is work of friction. That behind
        a clutch keeps its speed."""
        n, works = self.layout.coordinates, self.layout.size - len(self.layout.works_named)
        before, rates_before = self._kinetic(time, row), row[n : 2 * n].copy()
        if self.layout.clutched:
            (drive,) = self.motion.drives.values()
            row[self.layout.slip] += drive.ratio * (rates_before[0] - rates[0])
        rotors = sum(
            0.5 * drive.inertia * drive.ratio**2 * (old * old - new * new)
            for drive, old, new in zip(self.motion.drives.values(), rates_before, rates, strict=True)
            if not drive.clutched
        )
        row[n : 2 * n] = rates
        lost = before - self._kinetic(time, row) + float(rotors)
        row[works + WORKS.index("drive")] += float(rotors)
        row[works + WORKS.index("friction")] += lost
        return lost

    def _stop(self, code: str, time: float, row: Array) -> None:
        figures = {"coordinate": float(row[0]), "rate": float(row[self.layout.coordinates])}
        if code in ("no_acceleration", "locked"):
            with np.errstate(all="ignore"):
                growth = float(np.min(self.motion.growth(self.moment(time, row))))
            code = "no_acceleration" if growth <= 0.0 else "unsolved"
            figures |= {"growth": growth} if growth <= 0.0 else {}
        self.end(code, time, figures)

    def _cause(self, time: float, row: Array) -> str:
        """Why a state has no acceleration; empty if it has one."""
        at = self.moment(time, row)
        if not self._assembled(at):
            return "not_assembled"
        with np.errstate(all="ignore"):
            rates = self.dynamics(at)
        return "" if rates.sound else "locked" if rates.locked else "no_acceleration"

    def _assembled(self, at: Moment) -> bool:
        with np.errstate(all="ignore"):
            status = pose_status(self.motion.walk(at, np.zeros_like(at.q)), (1,))
        return int(status[0]) != Status.NOT_ASSEMBLED

    def _kinetic(self, time: float, row: Array) -> float:
        at = self.moment(time, row)
        return single(kinetic_energy(self.motion.walk(at, np.zeros_like(at.q))))
