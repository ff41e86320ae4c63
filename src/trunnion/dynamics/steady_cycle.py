"""The steady cycle of a mechanism that goes round by its motors: the motion that repeats itself, cycle after cycle.

Shooting: with P(x) the state one cycle of the first free driver after the state x, the steady motion is x = P(x). It is
found by Newton's method from the last cycle of a run-up, ∂P/∂x by differences, with natural monotonicity (P. Deuflhard,
Newton Methods for Nonlinear Problems, Springer 2004, section 3.3). Its eigenvalues say what is left of a
difference after a cycle (A. H. Nayfeh, B. Balachandran, Applied Nonlinear Dynamics, Wiley 1995, sections 2.3 and 6.5).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.dynamics.compiled_rates import CompiledRates, rates_of
from trunnion.dynamics.findings import motion_findings
from trunnion.dynamics.followed import Snapshot
from trunnion.dynamics.integrate import MOST_EVALUATIONS, Integration
from trunnion.dynamics.opened import in_play
from trunnion.dynamics.prepared import FINEST, integration_of
from trunnion.dynamics.rates import Layout, Walks
from trunnion.dynamics.solution import Solution
from trunnion.dynamics.start import Places, initial_row, places
from trunnion.dynamics.started import DriveCourse
from trunnion.dynamics.state import FreeMotion
from trunnion.errors import Finding, MechanismError
from trunnion.joints.pairs import PAIRS
from trunnion.model.mechanism import Mechanism
from trunnion.results.quantities import readable

__all__ = ["INDIFFERENT", "SteadyCycle", "UnsteadyError", "refuse_unsteady", "steady_cycle"]

Array = NDArray[np.float64]

TURN = 2 * np.pi
FINER = 1e-2  # of the tolerance of a run-up: that of the cycles that are compared
LONGER = (1, 4, 16)  # times the duration: how far a run-up goes on if its end leads to no steady cycle
REPEATED = 1e-8  # of the state: by how much the end of a steady cycle may miss its begin
SURE = 1e-7  # of the state: the step that is the last, for Newton's method converges faster than by any factor
NOISE = 5.0  # times the tolerance: a miss that says nothing
ROUNDS = 15  # of Newton's method
HALVED = (1.0, 0.5, 0.25, 0.125)  # of its step, until the next with the same derivatives is shorter [Deuflhard]
FAR = 20.0  # times the speed at the end of the run-up: the steady speed is not looked for beyond
NUDGE = 1e-4  # of the state, by which ∂P/∂x is taken
INDIFFERENT = 1e-6  # what is left of a difference beyond all of it, but for rounding
BACKWARD = 1e-9  # of a turn, by which one that goes round and round may seem to go back


class UnsteadyError(MechanismError):
    """The motion does not come to repeat itself; the findings say why."""


class Passage(NamedTuple):
    """What one cycle after a state comes to: the state then, the time it takes, s, and the motion."""

    state: Array
    period: float
    solution: Solution


@dataclass
class SteadyCycle:
    """A motion that repeats: of these drivers, over one cycle from the start of the first one that goes round.

    residual: by how much of the state its end misses its begin; factor: of a difference, from cycle to cycle.
    """

    motion: FreeMotion
    solution: Solution
    first: int
    residual: float
    factor: float

    @property
    def period(self) -> float:
        """How long the cycle takes, s."""
        return self.solution.end


def refuse_unsteady(mechanism: Mechanism) -> None:
    """MechanismError with what keeps a free motion from repeating itself, or from being told as a cycle."""
    if findings := list(_findings(mechanism)):
        raise MechanismError(findings)


def _findings(mechanism: Mechanism) -> Iterator[Finding]:
    values = mechanism.parameters()
    for name, driver in mechanism.drivers.items():
        where, motor = f"drivers.{name}", driver.motor
        if not driver.found:
            what = "its motion is prescribed over time, and a steady cycle takes the time that it takes"
            yield Finding(what, where, "let it be free as well, or leave --steady out")
        if driver.range is not None and PAIRS[mechanism.effective_joints[name].type].turns:
            yield Finding("it does not go round, so it has no steady cycle", f"{where}.range", "leave --steady out")
        if motor is None:
            continue
        if motor.clutch is not None:
            what = "a clutch that may slip is not solved in a steady cycle"
            yield Finding(what, f"{where}.motor.clutch", "remove it, or leave --steady out")
        for key in ("off_from", "brake_from"):
            if getattr(motor, key) is not None:
                what = "a steady cycle knows no time at which something is switched"
                yield Finding(what, f"{where}.motor.{key}", "remove it, or leave --steady out")
        if motor.over == "time":
            yield Finding("the motor follows the time", f"{where}.motor.over", "state it over speed")
    for joint in in_play(mechanism):
        what = "it is in play: a cycle knows no contacts that come and go"
        yield Finding(what, f"joints.{joint}.contact", "leave --steady out, or remove the contact")
    timed = {"time"} | {name for name, table in mechanism.tables.items() if table.over == "time"}
    for path, entry in mechanism.parameter_set.entries.items():
        if path not in values and entry.varies and timed & set(entry.quantity.names):
            yield Finding("the load follows the time", path, "state it over drive, or leave --steady out")


def steady_cycle(
    motion: FreeMotion, duration: float, tolerance: float, progress: Callable[[float], None] | None = None,
    evaluations: int = MOST_EVALUATIONS,
) -> SteadyCycle:  # fmt: skip
    """The steady cycle that a motion comes to from its start. duration: of the run-up, s, which may take up to LONGER
    times as long; tolerance: of its steps; UnsteadyError where there is none."""
    first = next((i for i, name in enumerate(motion.names) if motion.system.turns(name)), None)
    if first is None:
        what = "no free driver goes round, so there is no steady cycle"
        raise MechanismError(Finding(what, f"drivers.{motion.names[0]}", "leave --steady out"))
    load_places = places(motion)
    rates = rates_of(motion)
    unstable = None  # one that no run-up comes to, unless it begins there
    for longer in LONGER:
        end = longer * duration
        integration = integration_of(motion, rates, load_places, end, tolerance, progress, evaluations)
        solution = integration.run(initial_row(motion))
        course = DriveCourse.of(motion, solution, first)
        if solution.ended or solution.stretches[-1].resting:
            break
        if not course.runs:
            continue
        section = Section.of(motion, load_places, rates, max(FINER * tolerance, FINEST), solution, course, first)
        repeated_cycle = section.repeated()
        if repeated_cycle is not None and repeated_cycle.factor <= 1.0 + INDIFFERENT:
            return repeated_cycle
        unstable = repeated_cycle or unstable
    if unstable is not None:
        return unstable
    raise UnsteadyError(_why(motion, solution, course, first))


def _why(motion: FreeMotion, solution: Solution, course: DriveCourse, first: int) -> list[Finding]:
    """Why there is no steady cycle, from the end of the longest run-up."""
    name, turns = motion.names[first], course.travel / TURN
    if not course.runs or solution.ended or solution.stretches[-1].resting:
        what = f"there is no steady cycle: {name} makes {turns:.3g} turns in {readable(solution.end, 's')} and does "
        what += "not go round at the end"
        remedy = "run it without --steady to see the start; give it more --time if it has not run up"
        figures = {"driver": name, "turns": turns, "time": solution.end}
        none = Finding.error("simulate.not_round", f"drivers.{name}", what, remedy, **figures)
        return [none, *motion_findings(motion, solution, motion.run)]
    takes = [course.at(course.travel - k * TURN, course.time) for k in range(3)]
    before, last = (TURN / (takes[k] - takes[k + 1]) for k in (1, 0))
    where, change = f"drivers.{name}", last - before
    what = f"there is no steady cycle: the speed of {name}, {readable(last, 'rad/s')} after "
    what += f"{readable(solution.end, 's')}, changes by {readable(change, 'rad/s')} a turn, and no speed is found that "
    what += "comes back"
    remedy = "check that its losses grow with the speed or that its motor's effort falls; or give it more --time"
    figures = {"driver": name, "speed": last, "change": change, "time": solution.end}
    return [Finding.error("simulate.not_repeating", where, what, remedy, **figures)]


@dataclass
class Section:
    """The states in which one driver begins its cycle; numbers of a state, those of others by what is typical.

    begin: its coordinate there; way: by how much it goes on in a cycle, with its sign; takes: how long a cycle took, s.
    """

    motion: FreeMotion
    known: Places
    rates: CompiledRates | Walks
    tolerance: float
    first: int
    begin: float
    way: float
    takes: float
    row: Array
    snapshot: Snapshot | None

    @classmethod
    def of(
        cls, motion: FreeMotion, load_places: Places, rates: CompiledRates | Walks, tolerance: float,
        solution: Solution, course: DriveCourse, first: int,
    ) -> Section:  # fmt: skip
        """The last passage of a run-up through the begin of the cycle."""
        span = load_places.period if load_places.period is not None else TURN
        start, gone = float(course.coordinate[0, 0]), course.travel
        sense = 1.0 if course.coordinate[-1, -1] > start else -1.0
        begin = float(np.ravel(primal(motion.system.drive(motion.values, motion.names[first], 0.0)[0]))[0])
        ahead = np.mod(sense * (begin - start), span)
        passed = ahead + span * np.floor((gone - ahead) / span)
        time, before = (course.at(max(at, 0.0), course.time) for at in (passed, passed - span))
        rows, which = solution.at(np.array([time]))
        snapshot = solution.stretches[which[0]].snapshot
        if snapshot is not None:
            snapshot = replace(snapshot, time=snapshot.time - time)
        return cls(
            motion, load_places, rates, tolerance, first, begin, sense * span, time - before, rows[:, 0], snapshot
        )

    # ---- the numbers of a state -------------------------------------------------------------------------------

    @property
    def _numbers(self) -> NDArray[np.intp]:
        """Where in a row they stand: all but the coordinate of the driver, integrals of no controller and the works."""
        layout, drives = Layout.of(self.motion), self.motion.drives.values()
        idle = [2 * layout.coordinates + i for i, drive in enumerate(drives) if not drive.controlled]
        return np.delete(np.arange(3 * layout.coordinates + layout.bristles), [self.first, *idle])

    def _turning(self) -> NDArray[np.bool_]:
        """Which of them are angles, alike after whole turns."""
        names, which = self.motion.names, self._numbers
        return np.array([k < len(names) and self.motion.system.turns(names[k]) for k in which], bool)

    def _scale(self) -> Array:
        """What is typical of each of them."""
        n, speed = len(self.motion.names), abs(float(self.row[len(self.motion.names) + self.first]))
        size = float(np.ravel(self.motion.system.size(self.motion.values))[0])
        sizes = np.array([1.0 if self.motion.system.turns(name) else size for name in self.motion.names])
        scale = np.ones(3 * n + Layout.of(self.motion).bristles)
        scale[:n], scale[n : 2 * n], scale[2 * n : 3 * n] = sizes, speed * sizes, speed * self.takes * sizes
        scale[3 * n :] = np.maximum(np.abs(self.row[3 * n : len(scale)]), 1e-6 * size)
        return scale[self._numbers]

    # ---- cycle after cycle ------------------------------------------------------------------------------------

    def after(self, state: Array) -> Passage | None:
        """One cycle after a state; None where the driver does not get there, or not one way."""
        row = np.zeros_like(self.row)
        row[self.first], row[self._numbers] = self.begin, state
        for longer in (1.5, 6.0, 24.0):
            self.motion.begin(self.snapshot)
            integration = self._integration(longer * self.takes)
            solution = integration.run(row)
            course = DriveCourse.of(self.motion, solution, self.first)
            gone = np.sign(self.way) * (course.coordinate - self.begin).ravel()
            if np.any(np.diff(gone) < -BACKWARD) or not len(solution.stretches):
                return None
            if gone[-1] >= abs(self.way):
                period = course.at(abs(self.way), course.time)
                return Passage(solution.at(np.array([period]))[0][self._numbers, 0], period, _until(solution, period))
            if solution.ended:
                return None
        return None

    def _integration(self, duration: float) -> Integration:
        return integration_of(self.motion, self.rates, self.known, duration, self.tolerance)

    def _miss(self, state: Array, passage: Passage, scale: Array) -> Array:
        """P(x) − x, in parts of what is typical."""
        miss = passage.state - state
        turning = self._turning()
        miss[turning] = np.mod(miss[turning] + np.pi, TURN) - np.pi
        misses: Array = miss / scale
        return misses

    def repeated(self) -> SteadyCycle | None:
        """The state that comes back, from the last one of the run-up; None if it is not found."""
        scale, state = self._scale(), self.row[self._numbers].copy()
        passage = self.after(state)
        for _ in range(ROUNDS):
            if passage is None or (slopes := self._slopes(state, passage, scale)) is None:
                return None
            miss = self._miss(state, passage, scale)
            step = -np.linalg.lstsq(slopes, miss, rcond=None)[0]
            most = float(np.max(np.abs(miss)))
            if np.max(np.abs(step)) <= SURE or most <= NOISE * self.tolerance:
                return self._found(state + step * scale, scale, slopes)
            for size in HALVED:
                tried = state + size * step * scale
                passage = self.after(tried) if self._near(tried) else None
                if passage is None:
                    continue
                simplified = np.linalg.lstsq(slopes, self._miss(tried, passage, scale), rcond=None)[0]
                if np.linalg.norm(simplified) < np.linalg.norm(step):
                    break
            state = tried
        return None

    def _slopes(self, state: Array, passage: Passage, scale: Array) -> Array | None:
        """∂(P − x)/∂x by differences, in parts of what is typical; None where a state near by does not come back."""
        slopes, miss = np.empty((len(state), len(state))), self._miss(state, passage, scale)
        for k, nudge in enumerate(NUDGE * scale):
            nudged = state + np.where(np.arange(len(state)) == k, nudge, 0.0)
            other = self.after(nudged)
            if other is None:
                return None
            slopes[:, k] = (self._miss(nudged, other, scale) - miss) / NUDGE
        return slopes

    def _near(self, state: Array) -> bool:
        """Whether the driver still goes round in the same sense, at a speed of the same order."""
        place = int(np.flatnonzero(self._numbers == len(self.motion.names) + self.first)[0])
        share = state[place] / self.row[len(self.motion.names) + self.first]
        return bool(np.all(np.isfinite(state)) and 1 / FAR < share < FAR)

    def _found(self, state: Array, scale: Array, slopes: Array) -> SteadyCycle | None:
        """The steady cycle from a state that comes back, with the eigenvalue that says what is left of a difference."""
        passage = self.after(state)
        if passage is None or (most := float(np.max(np.abs(self._miss(state, passage, scale))))) > REPEATED:
            return None
        factor = float(np.max(np.abs(np.linalg.eigvals(slopes + np.eye(len(state))))))
        return SteadyCycle(self.motion, passage.solution, self.first, most, factor)


def _until(solution: Solution, time: float) -> Solution:
    """A solution up to a time."""
    stretches = [item._replace(end=min(item.end, time)) for item in solution.stretches if item.begin < time]
    return replace(solution, stretches=stretches, events=[item for item in solution.events if item.time <= time])
