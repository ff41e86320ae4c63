"""Motion in time: what a mechanism does when its motors, loads and friction are let act on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.variables import fill_of
from trunnion.cycle.written import fill_chunk
from trunnion.dynamics.checks import refuse, refuse_massless
from trunnion.dynamics.closed import ClosedMotion, ClosedRates
from trunnion.dynamics.compiled_rates import compiled_rates
from trunnion.dynamics.contact_motion import ContactMotion
from trunnion.dynamics.energy import kinetic_energy, potential_energy
from trunnion.dynamics.impact_motion import ImpactMotion
from trunnion.dynamics.integrate import INSIDE, Integration, Solution, Stretch
from trunnion.dynamics.opened import in_play, is_rigid, opened
from trunnion.dynamics.rates import Seeing, Walks
from trunnion.dynamics.rest import Rest
from trunnion.dynamics.result import Books, result_of
from trunnion.dynamics.shown import Touches, as_stated
from trunnion.dynamics.start import Places, initial_row, load_times, places
from trunnion.dynamics.state import FreeMotion, Moment
from trunnion.dynamics.stick_motion import StickMotion
from trunnion.dynamics.sticking import StickingMotion
from trunnion.dynamics.tables import tabulated
from trunnion.dynamics.tabulated import TabulatedRates
from trunnion.dynamics.touching import Onset, contacts_of
from trunnion.errors import Finding, MechanismError, Status
from trunnion.model.mechanism import Mechanism
from trunnion.results import variables as results
from trunnion.solve.backward import Backward
from trunnion.solve.memory import CHUNK
from trunnion.solve.run import Run, prepare

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.results.result import Result

__all__ = ["CYCLES", "integration_of", "simulate", "simulated"]

Array = NDArray[np.float64]

MOST_STEPS = 1_000_000
TABLED = 1e-12  # as `integrate.INSIDE`, of tables, which know on which side they are asked
FINEST = 3e-14  # the least relative tolerance of SciPy's integrators
CYCLES = 10  # of the nominal motion: the duration if none is stated


@np.errstate(all="ignore")
def simulate(
    mechanism: Mechanism,
    duration: float | None = None,
    steps: int = 1000,
    tolerance: float = 1e-9,
    progress: Callable[[float], None] | None = None,
    impact_step: float | None = None,
) -> xr.Dataset:
    """Motion in time of a mechanism whose drivers are free: coordinates, forces, energy and events.

    duration: s, ten cycles of the stated motion if not given; steps: equal intervals at whose ends the result stands;
    tolerance: relative, of every step of the integration; progress: called with the time that is reached, s;
    impact_step: s, of Moreau's time stepping of joints in play between rigid bodies, from event to event if not given.
    Returns a Dataset with the names and units of `analyse` over `time`, with works, energies and events beside them.
    Method: the free coordinates accelerate so that the effort the modules demand is what the motors give
    (`dynamics.state`); integrated from event to event (`dynamics.integrate`).
    Raises MechanismError if no driver is free, or if the motion cannot be found for what the joints are.
    """
    return simulated(mechanism, duration, steps, tolerance, progress, impact_step).dataset


@np.errstate(all="ignore")
def simulated(
    mechanism: Mechanism,
    duration: float | None = None,
    steps: int = 1000,
    tolerance: float = 1e-9,
    progress: Callable[[float], None] | None = None,
    impact_step: float | None = None,
) -> Result:
    """What `simulate` does, before it becomes a Dataset."""
    refuse(mechanism)
    run = prepare(mechanism)
    if run.determinacy is not None:
        run.determinacy.refuse()
    duration = CYCLES * run.cycle.duration if duration is None else duration
    _check_numbers(duration, steps, tolerance)
    _check_step(impact_step, duration, mechanism)
    if in_play(mechanism):
        return _with_play(run, duration, steps, tolerance, progress, impact_step)
    motion = StickingMotion.of(run)
    known = places(motion)
    integration = integration_of(motion, known, duration, tolerance, progress)
    row = initial_row(motion)
    _check_start(motion, row, known.limits)
    solution = _run(integration, row)
    time = np.linspace(0.0, duration, steps + 1)
    return result_of(motion, solution, Filling(motion, solution, time).books())


def _with_play(
    run: Run, duration: float, steps: int, tolerance: float, progress: Callable[[float], None] | None,
    impact_step: float | None,
) -> Result:  # fmt: skip
    """The motion of a mechanism whose joints in play are taken out, as one of the mechanism that was stated."""
    bare = opened(run)
    contacts = contacts_of(run, in_play(run.system.mechanism))
    rigid = is_rigid(run.system.mechanism)
    motion = (ClosedMotion if rigid else StickingMotion).of(prepare(bare.mechanism), contacts)
    row = initial_row(motion)
    refuse_massless(motion, row)
    fine = tolerance * min(1.0, contacts.least_clearance / float(np.ravel(run.system.size(run.values))[0]))
    rates: Seeing = compiled_rates(motion) or Walks(motion)
    tolerances, times = max(fine, FINEST), load_times(motion, duration)
    integration: ContactMotion
    if isinstance(motion, ClosedMotion):
        rates = ClosedRates(motion, rates)
        integration = ImpactMotion(motion, rates, duration, tolerances, progress=progress, times=times)
        integration.impact_step = impact_step
    else:
        kind = StickMotion if motion.resisted else ContactMotion
        integration = kind(motion, rates, duration, tolerances, progress=progress, times=times)
    solution = _run(integration, row)
    time = np.linspace(0.0, duration, steps + 1)
    books = Filling(motion, solution, time, run).books()
    return result_of(motion, solution, books, run, integration.finished())


def _run(integration: Integration, row: Array) -> Solution:
    """The motion from an initial row; of one that is interrupted what is done."""
    try:
        return integration.run(row)
    except KeyboardInterrupt:
        integration.end("stopped", integration.solution.end)
        return integration.solution


def integration_of(
    motion: FreeMotion, known: Places, duration: float, tolerance: float,
    progress: Callable[[float], None] | None = None,
) -> Integration:  # fmt: skip
    """What integrates a motion: from tables where it has them, else by walks."""
    tables, walks = tabulated(motion, known), Walks(motion)
    if motion.resisted:
        seeing: Seeing = compiled_rates(motion) or walks
        return StickMotion(motion, seeing, duration, tolerance, progress=progress, times=load_times(motion, duration))
    rates = (compiled_rates(motion) or walks) if tables is None else TabulatedRates(tables, walks)
    return Integration(
        motion, rates, duration, tolerance, known.bends, known.period, known.limits, progress,
        INSIDE if tables is None else TABLED, load_times(motion, duration),
    )  # fmt: skip


def _check_start(motion: FreeMotion, row: Array, limits: tuple[float, float]) -> None:
    """MechanismError for a start outside the range of the one free driver."""
    if not limits[0] <= row[0] <= limits[1]:
        what = f"begins at {row[0]:g} (SI), outside its range from {limits[0]:g} to {limits[1]:g}"
        raise MechanismError(Finding(what, f"drivers.{motion.names[0]}.initial", "begin within the range"))


def _check_step(step: float | None, duration: float, mechanism: Mechanism) -> None:
    """MechanismError for a step that makes no sense, or that nothing takes."""
    if step is None:
        return
    if not is_rigid(mechanism):
        what = "no joint is in play between rigid bodies, so that there is nothing to step through"
        raise MechanismError(
            Finding(what, "impact_step", "remove it, or state contact: {law: rigid, restitution: 0.5}")
        )
    if not duration / MOST_STEPS <= step <= duration:
        remedy = f"give a time from {duration / MOST_STEPS:g} s to {duration:g} s"
        raise MechanismError(Finding(f"a step of {step:g} s", "impact_step", remedy))


def _check_numbers(duration: float, steps: int, tolerance: float) -> None:
    """MechanismError for numbers that make no sense."""
    found = []
    if not (np.isfinite(duration) and duration > 0):
        found.append(Finding(f"a duration of {duration:g} s", "duration", "give a time above 0, such as 2 s"))
    if not isinstance(steps, (int, np.integer)) or not 1 <= steps <= MOST_STEPS:
        found.append(Finding(f"cannot give {steps} steps", "steps", f"give a whole number from 1 to {MOST_STEPS:,}"))
    if not 1e-13 <= tolerance <= 1e-2:
        found.append(Finding(f"a tolerance of {tolerance:g}", "tolerance", "give a number from 1e-13 to 1e-2"))
    if found:
        raise MechanismError(found)


@dataclass(frozen=True)
class Filling:
    """The variables of a result at the times of its rows, from the state by walks, as `analyse` has them."""

    motion: FreeMotion
    solution: Solution
    time: Array
    stated: Run | None = None

    def books(self) -> Books:
        """Every variable, over the rows up to where the motion ends; NaN after it."""
        motion, system = self.motion, self.motion.system
        fill = fill_of(system)
        labels = fill.labels(system)
        arrays = results.allocate(labels, len(self.time), fill.absent(system))
        rows, which = self.solution.at(self.time)
        layout = self.solution.layout
        seconds, energies = np.full((layout.coordinates, len(self.time)), np.nan), np.full((2, len(self.time)), np.nan)
        touches = Touches.empty(len(motion.contacts.each), len(self.time))
        arrays["status"][...] = Status.NOT_CONVERGED
        for lanes, stretch in self._alike(which):
            at = layout.moment(self.time[lanes], rows[:, lanes], stretch.sense, stretch.now)
            at = at._replace(onsets=stretch.onsets, senses=stretch.senses)
            second, back, onsets = self._solved(at, stretch)
            seconds[:, lanes] = second
            window = slice(int(lanes[0]), int(lanes[-1]) + 1)
            fill_chunk(arrays, back, at.time, window)
            energies[0, lanes], energies[1, lanes] = kinetic_energy(back.walk), potential_energy(back.walk)
            touches.fill(lanes, motion.contacts.pushes(back.walk, onsets), onsets)
        whole = layout.moment(self.time, rows)
        for array in arrays.values():  # there is no motion any more
            if array.flags.writeable and array.dtype == np.float64:
                array[..., which < 0] = np.nan
        fill.unwrap(arrays, system, motion.values_at(whole, np.nan_to_num(seconds)), self.time)
        resting = np.array([k >= 0 and self.solution.stretches[k].resting for k in which])
        if self.stated is not None:
            arrays, labels = as_stated(self.stated, motion.contacts, touches, arrays, labels)
            energies = np.vstack([energies, touches.stored.sum(axis=0)])
        works, sticking = layout.works(rows), self._sticking(which)
        return Books(self.time, arrays, labels, whole, seconds, energies, works, resting, touches, sticking)

    def _sticking(self, which: NDArray[np.intp]) -> NDArray[np.bool_] | None:
        """Which joints stick, (joint, row), where they do one by one; of joints in play none does."""
        if not self.motion.resisted:
            return None
        joints = list((self.stated or self.motion.run).system.joints)
        found = np.zeros((len(joints), len(which)), bool)
        for i, name in enumerate(self.motion.resisted):
            found[joints.index(name)] = [k >= 0 and self.solution.stretches[k].senses[i] == 0 for k in which]
        return found

    def _alike(self, which: NDArray[np.intp]) -> list[tuple[NDArray[np.intp], Stretch]]:
        """Runs of rows that one walk can solve: of the same sense, switches and assembly."""
        found: list[tuple[NDArray[np.intp], Stretch]] = []
        stretches = self.solution.stretches

        def key(k: int) -> object:
            one = stretches[k]
            return (
                one.sense,
                one.resting,
                one.now,
                one.onsets,
                one.senses,
                None if one.snapshot is None else id(one.snapshot),
            )

        begin = 0
        for i in range(1, len(which) + 1):
            same = i < len(which) and i - begin < CHUNK and which[i] >= 0 and key(which[i]) == key(which[begin])
            if which[begin] >= 0 and not same:
                found.append((np.arange(begin, i), stretches[which[begin]]))
            if not same:
                begin = i
            if begin < len(which) and which[begin] < 0:
                break
        return found

    def _solved(self, at: Moment, stretch: Stretch) -> tuple[Array, Backward, tuple[Onset, ...]]:
        """Accelerations and the walk; at rest with the share of the friction that holds it."""
        self.motion.begin(stretch.snapshot)
        if not stretch.resting:
            found = self.motion.accelerate(at)
            return found.second, found.back, found.onsets
        share = Rest(self.motion, self.solution.layout).shares(at)
        zero = np.zeros_like(at.q)
        return zero, self.motion.solve(at, zero, self.motion.beginning(at._replace(sense=1.0), share)), ()
