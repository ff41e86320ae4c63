"""Integration of a free motion in time, from event to event.

SciPy's integrators take the steps: DOP853 (E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations
I, 2nd ed., Springer, 1993) or, where bristles make the equations stiff, LSODA (L. Petzold, SIAM J. Sci. Stat. Comput. 4
(1983) 136-148, doi:10.1137/0904010). Where a force jumps or bends - a joint turns round, a load begins, a motor is
switched - the step ends, and the next begins from there, so that every step is taken through smooth forces. Such places
are located on the dense output to rounding.

What holds, slips and is open until then: see `active_motion`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853, LSODA, OdeSolver

from trunnion.algebra.dual import single
from trunnion.dynamics.followed import Snapshot
from trunnion.dynamics.guards import Guards, dead_centre
from trunnion.dynamics.rates import WORKS, Dynamics, Layout, kinetic_energy
from trunnion.dynamics.solution import Ended, Event, Solution
from trunnion.dynamics.start import Places, times_of_loads
from trunnion.dynamics.state import FreeMotion, Mode, Moment
from trunnion.errors import Status
from trunnion.solve.backward import pose_status

Array = NDArray[np.float64]

FINEST = 3e-14  # the least relative tolerance of SciPy's integrators
MOST_EVALUATIONS = 2_000_000  # of the forces, if not stated otherwise
SEVERAL, LOOKED = "simulate.several_accelerations", 32  # steps after which one looks for other accelerations
SHRUNK = 4  # steps, each no longer than the last, from which a dead centre is looked for
RETRIES = 5  # first steps, each 100 times shorter than the last, of an integrator that has asked where nothing is known
NEAR = 1e-8  # of the coordinate: places that are one
PAST = 1e-6  # of a step: by how much one that is taken anew goes past the place at which it is to end
INSIDE = 1e-9  # of the coordinate: how far from a bend forces are asked of walks, which take less for rest
MEETING = 1e-3  # likewise, of a bend at which assemblies meet: the digits of the accelerations are lost like its square


@dataclass
class Integration:
    """One motion from its initial state.

    progress: told the share of the duration that is reached; evaluations: of the forces, at most, a walk counted as
    several; start: time, s, at which it begins; duration: at which it ends; mode: what is so until something switches;
    resting: whether all free coordinates rest.
    """

    motion: FreeMotion
    dynamics: Dynamics
    duration: float
    tolerance: float
    places: Places = field(default_factory=Places)
    progress: Callable[[float], None] | None = None
    evaluations: int = MOST_EVALUATIONS
    mode: Mode = field(default_factory=Mode)
    start: float = 0.0
    resting: bool = False

    def __post_init__(self) -> None:
        self.step = 0.0  # size of the next step, s; 0: it is to be looked for
        self.between = -np.inf, np.inf  # the bends on either side of one free coordinate
        self.layout, self.bends = Layout.of(self.motion), self.places.bends
        self.solution = Solution(self.layout)
        switch_times = [time for drive in self.motion.drives.values() for time in drive.times]
        load_times = times_of_loads(self.motion, self.duration)
        times = {time for time in (*switch_times, *load_times) if self.start < time < self.duration}
        self.pace = np.sqrt(self.motion.unit)  # typical rates
        self.turned_over, self.asked_for = 0.0, 0
        self.last = self.start, np.empty(0)  # time and row from which it is to go on
        self._doubts = 0
        self.breaks = [*sorted(times), self.duration]
        self.mode = self.mode._replace(now=0.5 * (self.start + self.breaks[0]))
        self.ends = np.array([self.places.limits.get(name, (-np.inf, np.inf)) for name in self.motion.names], float).T
        self._walked = self.motion.walked[0]
        self.guards = Guards(self.motion, self.layout, self.places.limits)

    def moment(self, time: float, row: Array) -> Moment:
        """The state of a row."""
        return self.layout.moment(np.array([time]), row[:, None], self.mode)

    def end(self, code: str, time: float, figures: dict[str, Any] | None = None) -> None:
        self.solution.ended = Ended(f"simulate.{code}", time, figures or {})

    def _note(self, time: float, kind: str, figure: float = np.nan, unit: str = "", of: str = "") -> None:
        """Take down an event. of: what it happens to, the first free driver if not given."""
        self.solution.events.append(Event(time, kind, of or self.motion.names[0], figure, unit))

    @property
    def snapshot(self) -> Snapshot | None:
        """From which the assembly goes on; None where it is not followed."""
        return self.motion.followed[0].snapshot if self.motion.followed else None

    def _follow(self, time: float, row: Array) -> None:
        self.motion.step(self.moment(time, row))

    # ---- in motion --------------------------------------------------------------------------------------------

    def _reaches_dead_centre(self, solver: OdeSolver, sizes: Array) -> bool:
        """End the motion at a dead centre that steps, each no longer than the last, run into; sizes: of the last, s."""
        if self.motion.several or not isinstance(solver, DOP853) or len(sizes) < SHRUNK or np.any(np.diff(sizes) > 0.0):
            return False
        time, row = float(solver.t), np.array(solver.y)
        place = dead_centre(self.motion, self.moment(time, row), float(solver.f[self.layout.coordinates]))
        if place is not None:
            self._turns_round(time + place[0], {"coordinate": place[1], "rate": 0.0})
        return place is not None

    def _foreseen(self, row: Array, second: float) -> float:
        """Time, s, until one free coordinate comes to a bend or to rest, as its acceleration has it."""
        speed = float(row[self.layout.coordinates])
        if self.motion.several or self.resting or speed == 0.0 or not np.isfinite(second):
            return np.inf
        left = (self.between[1] if speed > 0.0 else self.between[0]) - float(row[0])
        turns = -speed / second if self.sense and speed * second < 0.0 else np.inf
        root = speed * speed + 2.0 * second * left
        if not np.isfinite(left) or root < 0.0:
            return turns
        return min(turns, 2.0 * left / (speed + math.copysign(math.sqrt(root), speed)))

    @property
    def sense(self) -> int:
        """Of the motion of one free coordinate that may rest; else 0."""
        return self.mode.senses[0] if self.mode.senses and not self.motion.several else 0

    def _rate(self) -> Callable[[float, Array], Array]:
        """The derivative of a row by time, within one stretch: nothing beyond its ends is asked for."""
        n, sense = self.layout.coordinates, self.sense
        low, high = max(self.between[0], self.ends[0, 0]), min(self.between[1], self.ends[1, 0])
        low, high = low + self._inside(low), high - self._inside(high)

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
        first: float = 0.0,
    ) -> OdeSolver:  # fmt: skip
        """first: how long the first step is tried, s; 0: it is to be looked for."""
        kind = LSODA if self.motion.bristles else DOP853
        if not first and not np.all(np.isfinite(rate(begin, row))):
            first = 1e-12 * abs(end - begin)  # SciPy would look for one without end; so the first step fails
        return kind(rate, begin, row, end, rtol=self.tolerance, atol=absolute, first_step=first or None)

    def _stepped(
        self, solver: OdeSolver, rate: Callable[[float, Array], Array], absolute: Array, stays: bool
    ) -> OdeSolver:
        """One step, no farther than a bend that is foreseen; the size that it may have else is that of the next.

        LSODA does not get over an unknown rate: it begins anew, shorter.
        """
        begin, state, end = float(solver.t), np.array(solver.y), float(solver.t_bound)
        if isinstance(solver, DOP853):
            size = max(self.step, solver.h_abs)
            reach = min(self._foreseen(state, float(solver.f[self.layout.coordinates])), end - begin)
            solver.h_abs = min(size, reach)
            solver.step()
            if not stays:
                reached = reach < size and solver.t >= begin + (1.0 - PAST) * reach
                self.step = size if reached else float(solver.h_abs)
            return solver
        solver.step()
        for k in range(1, RETRIES + 1):
            if solver.status != "failed" and np.all(np.isfinite(solver.y)):
                break
            solver = self._solver(rate, begin, state, end, absolute, 0.01**k * abs(end - begin))
            solver.step()
        self.step = float(solver.step_size or 0.0)
        return solver

    def _meeting(self, coordinate: float) -> int | None:
        """The module of which two assemblies meet at a bend, if they do."""
        for meeting, module in self.places.meetings:
            apart, period = coordinate - meeting, self.places.period
            apart -= period * round(apart / period) if period and np.isfinite(apart) else 0.0
            if abs(apart) < NEAR * max(1.0, abs(coordinate)):
                return module
        return None

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
        """The bends on either side of q, at which a step ends; one at q itself is left behind, by the way it goes."""
        period, near = self.places.period or 0.0, 1e-12 * max(1.0, abs(q))
        laps = np.floor(q / period) * period + period * np.arange(-1, 2) if period else np.zeros(1)
        every = np.sort((np.asarray(self.bends, float) + laps[:, None]).ravel())
        below, above = (
            every[every < q + (near if sense > 0 else -near)],
            every[every > q - (near if sense < 0 else -near)],
        )
        return float(below[-1]) if len(below) else -np.inf, float(above[0]) if len(above) else np.inf

    def _turns_round(self, time: float, figures: dict[str, float]) -> None:
        """End at the dead centre of the driven joint."""
        self._note(time, "dead-centre")
        self.end("dead_centre", time, figures)

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
            growth = float(np.min(self.motion.growth(self.moment(time, row))))
            code = "no_acceleration" if growth <= 0.0 else "unsolved"
            figures |= {"growth": growth} if growth <= 0.0 else {}
        self.end(code, time, figures)

    def _cause(self, time: float, row: Array) -> str:
        """Why a state has no acceleration; empty if it has one."""
        at = self.moment(time, row)
        if not self._assembled(at):
            return "not_assembled"
        rates = self.dynamics(at)
        return "" if rates.sound else "locked" if rates.locked else "no_acceleration"

    def _assembled(self, at: Moment) -> bool:
        return int(pose_status(self.motion.walk(at), (1,))[0]) != Status.NOT_ASSEMBLED

    def _kinetic(self, time: float, row: Array) -> float:
        return single(kinetic_energy(self.motion.walk(self.moment(time, row))))
