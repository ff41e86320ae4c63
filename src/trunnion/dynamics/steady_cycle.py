"""The steady cycle of a mechanism that goes round by its motors: the motion that repeats itself, cycle after cycle.

Shooting: with P(x) the state one cycle of the first free driver after the state x, the steady motion is x = P(x). It is
found by Newton's method from the last cycle of a run-up, ∂P/∂x by differences. Its eigenvalues say what is left of a
difference after a cycle (A. H. Nayfeh, B. Balachandran, Applied Nonlinear Dynamics, Wiley 1995, sections 2.3 and 6.5).
What was found becomes the motion law of the drivers (`Repeated`), so that the cycle is analysed as any other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Courses
from trunnion.algebra.dual import primal, single
from trunnion.algebra.namespace import Number
from trunnion.cycle import summary
from trunnion.cycle.positions import positions
from trunnion.dynamics.compiled_rates import rates_of
from trunnion.dynamics.findings import motion_findings
from trunnion.dynamics.impact_motion import integrator_of
from trunnion.dynamics.integrate import FINEST, MOST_EVALUATIONS
from trunnion.dynamics.measured import BACKWARD, SPEED, TURN, DriveCourse
from trunnion.dynamics.opened import in_play
from trunnion.dynamics.rates import Dynamics, Layout
from trunnion.dynamics.result import filled
from trunnion.dynamics.solution import Solution, over_steps, step_nodes
from trunnion.dynamics.start import Places, initial_row, places
from trunnion.dynamics.state import FreeMotion
from trunnion.errors import Finding, MechanismError, Status
from trunnion.joints.motion import Drive, MotionLaw, Parameters, Span
from trunnion.model.mechanism import Mechanism
from trunnion.results.attributes import Figure, encoded, finding_rows, findings_of, summary_of
from trunnion.results.dataset import Result, scales_in
from trunnion.results.quantities import readable
from trunnion.solve.run import prepare

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Repeated:
    """Coordinate, rate and second derivative over one cycle, step by step.

    advance: of the coordinate, rad or m, from cycle to cycle.
    """

    courses: Courses
    advance: float

    @classmethod
    def of(cls, motion: FreeMotion, solution: Solution) -> list[Repeated]:
        """Those of the free coordinates, over a solution that ends as it begins but for whole turns."""
        begins = np.array([stretch.begin for stretch in solution.stretches] + [solution.end])
        time = step_nodes(begins)
        books = filled(motion, solution, time.ravel())
        numbers = np.array([books.at.q, books.at.rate, books.seconds]).reshape(3, -1, *time.shape)
        ends, _ = solution.at(np.array([0.0, solution.end]))
        return [
            cls(over_steps(begins, numbers[:, i]), float(ends[i, 1] - ends[i, 0])) for i in range(len(motion.names))
        ]

    @property
    def period(self) -> float:
        """How long a cycle takes, s."""
        return self.courses.span

    def at(self, time: Number, parameters: Parameters) -> Drive:
        """As a motion law has it; `parameters` are not looked at. Of a dual time with its derivative."""
        moment = np.asarray(primal(time), float)
        cycles = np.floor(moment / self.period)
        rows = self.courses.at(np.ravel(moment - cycles * self.period))
        value, rate, second = rows.reshape(3, *moment.shape)
        zero = time - primal(time)  # 0, and the derivative of a dual time
        return Drive(value + cycles * self.advance + rate * zero, rate + second * zero, second + 0.0 * zero)

    def span(self, parameters: Parameters) -> Span:
        """One cycle, from the nodes of the steps."""
        values, rates = self.courses.on_nodes(self.courses.half > 0.0)[:2]
        one_way = bool(np.all(rates > 0.0) or np.all(rates < 0.0))
        return Span(self.period, True, False, one_way, float(np.max(np.abs(rates))), float(np.ptp(values)))


FINER = 1e-2  # of the tolerance of a run-up: that of the cycles that are compared
LONGER = (1, 4, 16)  # times the duration: how far a run-up goes on if its end leads to no steady cycle
REPEATED = 1e-8  # of the state: by how much the end of a steady cycle may miss its begin
SURE = 1e-7  # of the state: the step that is the last, for Newton's method converges faster than by any factor
NOISE = 5.0  # times the tolerance: a miss that says nothing
ROUNDS = 15  # of Newton's method
FAR = 20.0  # times the speed at the end of the run-up: the steady speed is not looked for beyond
NUDGE = 1e-4  # of the state, by which ∂P/∂x is taken
INDIFFERENT = 1e-6  # what is left of a difference beyond all of it, but for rounding
DIFFERS = 1e-3  # of the largest effort: a cycle that is not the one that was found


class UnsteadyError(MechanismError):
    """The motion does not come to repeat itself; the findings say why."""


class SteadyCycle(NamedTuple):
    """A motion that repeats, over one cycle from the start of its first driver that goes round.

    residual: by how much of the state its end misses its begin; factor: of a difference, from cycle to cycle.
    """

    solution: Solution
    first: int
    residual: float
    factor: float


@np.errstate(all="ignore")
def steady(
    mechanism: Mechanism, duration: float, steps: int, tolerance: float,
    progress: Callable[[float], None] | None = None, evaluations: int = MOST_EVALUATIONS,
) -> Result:  # fmt: skip
    """The steady cycle of a mechanism as `analyse` gives a cycle: with the speed that varies as it was found.

    Positions are equally spaced in time. Raises MechanismError where a cycle cannot be asked for, UnsteadyError where
    there is none.
    """
    motion = FreeMotion.of(prepare(mechanism))
    if findings := list(_refused(mechanism, motion)):
        raise MechanismError(findings)
    solution, first, residual, factor = _steady_cycle(motion, duration, tolerance, progress, evaluations)
    each, name = Repeated.of(motion, solution), motion.names[first]
    source, validity = "motion in time", "the mechanism it was found for"
    laws = {
        driver: MotionLaw(repeated.at, repeated.span, needs=(), source=source, validity=validity)
        for driver, repeated in zip(motion.names, each, strict=True)
    }
    run = prepare(mechanism.with_motions(laws))
    at = positions(run, steps, engine="numpy")
    cycle, notes = summary.result_of(run, at), list[Finding]()
    # efforts of cycle and motors; a joint at rest for a moment may rub either way: such positions tell nothing
    efforts = filled(motion, solution, at.time).arrays["drive_effort"]
    differences = np.abs(at.arrays["drive_effort"] - efforts)[:, at.arrays["status"] == Status.SOLVED]
    missing = float(np.nanmax(differences, initial=0.0)) / max(float(np.max(np.abs(efforts))), 1e-300)
    if factor > 1.0 + INDIFFERENT:
        what = f"the steady cycle is not stable: a difference from it grows by the factor {factor:.4g} with every cycle"
        remedy = "run it without --steady to see how it leaves this cycle"
        notes.append(Finding.warning("simulate.unstable", f"drivers.{name}", what, remedy, factor=factor))
    if not missing <= DIFFERS:
        what = f"the cycle takes efforts that differ from those of the motors by up to {missing:.2g} of the largest: "
        what += "it is not the motion that was found"
        remedy = "run it without --steady to see the motion from its start"
        notes.append(Finding.error("simulate.cycle_differs", "", what, remedy, share=missing))
    course, subject, period = DriveCourse.of(motion, solution, first), f"speed of {name}", each[first].period
    least, most = sorted((abs(course.largest(SPEED)), abs(course.largest(SPEED, -1.0))))
    mean = abs(each[first].advance) / period
    figures = [
        Figure("cycle_time", "time of the cycle", period, "s"),
        Figure(f"{name}.speed_mean", subject, mean, "rad/s", "mean"),
        Figure(f"{name}.speed_max", subject, most, "rad/s", "largest"),
        Figure(f"{name}.speed_min", subject, least, "rad/s", "smallest"),
        Figure(f"{name}.fluctuation", f"coefficient of fluctuation of {name}", (most - least) / mean, "1"),
        Figure("decay", "what is left of a difference after a cycle", factor, "1"),
        Figure("repeats", "by how much the end misses the begin", residual, "1", "of the state"),
        Figure("efforts_differ", "efforts of cycle and motors, difference", missing, "1", "of the largest"),
        *summary_of(cycle),
    ]
    attributes = encoded({
        **cycle.attrs,
        "findings": finding_rows([*findings_of(cycle), *notes]),
        **scales_in(cycle).summary(figures),
        "steady": 1,
    })  # fmt: skip
    return Result(attributes, lambda: cycle.dataset.assign_attrs(attributes))


def _refused(mechanism: Mechanism, motion: FreeMotion) -> Iterator[Finding]:
    """What keeps a free motion from repeating itself, or from being told as a cycle."""
    values, joints = mechanism.parameters(), mechanism.effective_joints
    follows = "it follows the time, and a steady cycle takes the time that it takes"
    reasons = {f"joints.{joint}.contact": "it is in play: contacts come and go" for joint in in_play(mechanism)}
    for name, driver in mechanism.drivers.items():
        where, motor = f"drivers.{name}", driver.motor
        if not driver.found:
            reasons[where] = follows
        if driver.range is not None and joints[name].pair.turns:
            reasons[f"{where}.range"] = "it does not go round"
        if motor is not None:
            if motor.clutch is not None:
                reasons[f"{where}.motor.clutch"] = "a clutch may slip"
            timed = {"off_from": motor.off_from, "brake_from": motor.brake_from, "over": motor.over == "time" or None}
            reasons |= {f"{where}.motor.{key}": follows for key, value in timed.items() if value is not None}
    clocks = {"time"} | {name for name, table in mechanism.tables.items() if table.over == "time"}
    for path, entry in mechanism.parameter_set.entries.items():
        if path not in values and entry.varies and clocks & set(entry.quantity.names):
            reasons[path] = follows
    if motion.several:
        sticks = "it may stick while others slide, as several drivers are free; use laws that are smooth at rest"
        reasons |= {f"joints.{joint}": sticks for joint in motion.resisted}
    for where, what in reasons.items():
        yield Finding(f"{what}: there is no steady cycle", where, "remove it, or leave --steady out")


def _steady_cycle(
    motion: FreeMotion, duration: float, tolerance: float, progress: Callable[[float], None] | None, evaluations: int
) -> SteadyCycle:
    """The steady cycle that a motion comes to from its start. duration: of the run-up, s, which may take up to LONGER
    times as long; tolerance: of its steps; UnsteadyError where there is none."""
    first = next((i for i, name in enumerate(motion.names) if motion.system.turns(name)), None)
    if first is None:
        what = "no free driver goes round, so there is no steady cycle"
        raise MechanismError(Finding(what, f"drivers.{motion.names[0]}", "leave --steady out"))
    load_places, rates = places(motion), rates_of(motion)
    unstable = None  # one that no run-up comes to, unless it begins there
    for longer in LONGER:
        end = longer * duration
        integration = integrator_of(motion)(motion, rates, end, tolerance, load_places, progress, evaluations)
        solution = integration.run(initial_row(motion))
        if not solution.end > 0.0:
            raise UnsteadyError(motion_findings(motion, solution, motion.run))
        course = DriveCourse.of(motion, solution, first)
        if solution.ended or solution.stretches[-1].resting:
            break
        if not course.runs:
            continue
        section = Section(motion, load_places, rates, max(FINER * tolerance, FINEST), solution, course, first)
        cycle = section.repeated()
        if cycle is not None and cycle.factor <= 1.0 + INDIFFERENT:
            return cycle
        unstable = cycle or unstable
    if unstable is not None:
        return unstable
    # why there is none, from the end of the longest run-up
    name, after = motion.names[first], readable(solution.end, "s")
    if not course.runs or solution.ended or solution.stretches[-1].resting:
        turns = course.travel / TURN
        what = f"there is no steady cycle: {name} makes {turns:.3g} turns in {after} and does not go round at the end"
        remedy = "run it without --steady to see the start; give it more --time if it has not run up"
        figures = {"driver": name, "turns": turns, "time": solution.end}
        none = Finding.error("simulate.not_round", f"drivers.{name}", what, remedy, **figures)
        raise UnsteadyError([none, *motion_findings(motion, solution, motion.run)])
    what = f"there is no steady cycle: {name} goes round for {after}, and no speed is found that comes back"
    remedy = "check that its losses grow with the speed or that its motor's effort falls; or give it more --time"
    figures = {"driver": name, "time": solution.end}
    raise UnsteadyError([Finding.error("simulate.not_repeating", f"drivers.{name}", what, remedy, **figures)])


class Section:
    """The states in which one driver begins its cycle, from the last passage of a run-up through its begin.

    A state is what a row holds but the driver's coordinate, integrals of no controller and the works: which says where
    its numbers stand in a row, turning which are angles, scale what is typical of each. way: by how much the driver
    goes on in a cycle, with its sign; takes: how long a cycle took, s.
    """

    def __init__(
        self, motion: FreeMotion, load_places: Places, rates: Dynamics, tolerance: float, solution: Solution,
        course: DriveCourse, first: int,
    ) -> None:  # fmt: skip
        self.motion, self.places, self.rates, self.tolerance, self.first = motion, load_places, rates, tolerance, first
        span = load_places.period if load_places.period is not None else TURN
        start, gone, sense = float(solution.at(np.zeros(1))[0][first, 0]), course.travel, course.sense
        self.begin = single(motion.system.drive(motion.values, motion.names[first], 0.0)[0])
        ahead = np.mod(sense * (self.begin - start), span)
        passed = ahead + span * np.floor((gone - ahead) / span)
        time, before = (course.when(max(at, 0.0)) for at in (passed, passed - span))
        self.way, self.takes = sense * span, time - before
        rows, which = solution.at(np.array([time]))
        self.row, snapshot = rows[:, 0], solution.stretches[which[0]].snapshot
        self.snapshot = None if snapshot is None else replace(snapshot, time=snapshot.time - time)
        self.layout, names = Layout.of(motion), motion.names
        n, drives = self.layout.coordinates, enumerate(motion.drives.values())
        idle = [2 * n + i for i, drive in drives if not drive.controlled]
        self.which = np.delete(np.arange(3 * n + self.layout.bristles), [first, *idle])
        self.turning = np.array([k < n and motion.system.turns(names[k]) for k in self.which], bool)
        speed, size = abs(float(self.row[n + first])), motion.size
        sizes = np.array([1.0 if motion.system.turns(name) else size for name in names])
        bristles = np.maximum(np.abs(self.row[3 * n : self.layout.slip]), 1e-6 * size)
        self.scale = np.concatenate([sizes, speed * sizes, speed * self.takes * sizes, bristles])[self.which]

    def after(self, state: Array) -> tuple[Array, Solution] | None:
        """What one cycle after a state misses it by, P(x) − x, in parts of what is typical, and the motion; None where
        the driver does not get there, or not one way."""
        row = np.zeros_like(self.row)
        row[self.first], row[self.which] = self.begin, state
        for longer in (1.5, 6.0, 24.0):
            self.motion.begin(self.snapshot)
            duration = longer * self.takes
            solution = integrator_of(self.motion)(self.motion, self.rates, duration, self.tolerance, self.places).run(
                row
            )
            if not solution.end > 0.0:
                return None
            course = DriveCourse.of(self.motion, solution, self.first)
            if course.sense != np.sign(self.way) or np.any(np.diff(course.gone) < -BACKWARD):
                return None
            if course.travel >= abs(self.way):
                period = course.when(abs(self.way))
                miss = solution.at(np.array([period]))[0][self.which, 0] - state
                miss[self.turning] = np.mod(miss[self.turning] + np.pi, TURN) - np.pi
                steps = [step._replace(end=min(step.end, period)) for step in solution.stretches if step.begin < period]
                events = [event for event in solution.events if event.time <= period]
                return miss / self.scale, replace(solution, stretches=steps, events=events)
            if solution.ended:
                return None
        return None

    def repeated(self) -> SteadyCycle | None:
        """The state that comes back, from the last one of the run-up, with the eigenvalue that says what is left of a
        difference; None if it is not found."""
        state = begin = self.row[self.which]
        speed, factor = self.which == self.layout.coordinates + self.first, np.nan
        last = False
        for _ in range(ROUNDS):
            passage = self.after(state) if 1 / FAR < (state / begin)[speed][0] < FAR else None
            if passage is None:
                return None
            miss, solution = passage
            if last:
                most = float(np.max(np.abs(miss)))
                return SteadyCycle(solution, self.first, most, factor) if most <= REPEATED else None
            near_by = [self.after(state + nudge) for nudge in np.diag(NUDGE * self.scale)]
            slopes = np.transpose([(other[0] - miss) / NUDGE for other in near_by if other is not None])
            if slopes.shape != (len(state), len(state)):  # a state near by does not come back
                return None
            factor = float(np.max(np.abs(np.linalg.eigvals(slopes + np.eye(len(state))))))
            step = -np.linalg.lstsq(slopes, miss, rcond=None)[0]
            last = bool(np.max(np.abs(step)) <= SURE or np.max(np.abs(miss)) <= NOISE * self.tolerance)
            state = state + step * self.scale
        return None
