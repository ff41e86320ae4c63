"""Motion in time: what a mechanism does when its motors, loads and friction are let act on it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion.dynamics.checks import refuse, refuse_massless, refuse_undetermined
from trunnion.dynamics.closed import ClosedMotion, ClosedRates
from trunnion.dynamics.compiled_closed import compiled_closed
from trunnion.dynamics.compiled_rates import compiled_rates
from trunnion.dynamics.contact_motion import ContactMotion
from trunnion.dynamics.filling import Filling
from trunnion.dynamics.impact_motion import ImpactMotion
from trunnion.dynamics.integrate import Integration
from trunnion.dynamics.opened import in_play, is_rigid, opened
from trunnion.dynamics.prepared import CYCLES, FINEST, integration_of, rates_of
from trunnion.dynamics.rates import Layout, Seeing, Walks
from trunnion.dynamics.result import Books, Found, result_of
from trunnion.dynamics.solution import Solution
from trunnion.dynamics.start import initial_row, load_times, places
from trunnion.dynamics.state import FreeMotion
from trunnion.dynamics.stated_contacts import contacts_of
from trunnion.dynamics.steady import steady as steady_result
from trunnion.dynamics.stick_motion import StickMotion
from trunnion.dynamics.sticking import StickingMotion
from trunnion.errors import Finding, MechanismError
from trunnion.model.mechanism import Mechanism
from trunnion.model.names import strict_keywords
from trunnion.solve.run import Run, prepare

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.results.result import Result

__all__ = ["simulate", "simulated"]

Array = NDArray[np.float64]

MOST_STEPS = 1_000_000
ACCOUNT, MISSED = 1e-8, 10.0  # what the energy account may miss, of the energy turned over; times the tolerance
HELPS = 0.3  # of what the account missed: a finer motion that misses more is the last
BESIDE, MASSLESS = 0.1, 1e-15  # rad, or of the size: how far from the start more inertia may be; a share that is none
FINER = 2  # motions with a tenth of the tolerance of the last, at most, that are tried where it misses more


@strict_keywords
@np.errstate(all="ignore")
def simulate(
    mechanism: Mechanism,
    duration: float | None = None,
    steps: int = 1000,
    tolerance: float = 1e-9,
    progress: Callable[[float], None] | None = None,
    impact_step: float | None = None,
    steady: bool = False,
) -> xr.Dataset:
    """Motion in time of a mechanism whose drivers are free: coordinates, forces, energy and events.

    duration: s, ten cycles of the stated motion if not given; steps: equal intervals at whose ends the result stands;
    tolerance: relative, of every step of the integration; progress: called with the time that is reached, s;
    impact_step: s, of Moreau's time stepping of joints in play between rigid bodies, from event to event if not given;
    steady: instead of the motion from its start the cycle that it comes to repeat, see `dynamics.steady_cycle`.
    Returns a Dataset with the names and units of `analyse` over `time`, with works, energies and events beside them; of
    a steady cycle that of `analyse`, over as many positions as steps, equally spaced in time.
    Method: the free coordinates accelerate so that the effort the modules demand is what the motors give
    (`dynamics.state`); integrated from event to event (`dynamics.integrate`).
    Raises MechanismError if no driver is free, or if the motion cannot be found for what the joints are.
    """
    return simulated(mechanism, duration, steps, tolerance, progress, impact_step, steady).dataset


@np.errstate(all="ignore")
def simulated(
    mechanism: Mechanism,
    duration: float | None = None,
    steps: int = 1000,
    tolerance: float = 1e-9,
    progress: Callable[[float], None] | None = None,
    impact_step: float | None = None,
    steady: bool = False,
) -> Result:
    """What `simulate` does, before it becomes a Dataset."""
    refuse(mechanism)
    run = prepare(mechanism, free=True)
    playing = in_play(mechanism)
    if not playing:
        refuse_undetermined(run)
    duration = CYCLES * run.cycle.duration if duration is None else duration
    _check_numbers(duration, steps, tolerance)
    _check_step(impact_step, duration, mechanism)
    if steady:
        return steady_result(mechanism, duration, steps, tolerance, progress)
    if playing:
        return _with_play(run, duration, steps, tolerance, progress, impact_step)
    motion = StickingMotion.of(run)
    known = places(motion)
    rates, row, time = rates_of(motion, known), initial_row(motion), np.linspace(0.0, duration, steps + 1)
    _check_start(motion, row, known.limits)

    def found(tolerance: float) -> Found:
        motion.begin(None)
        solution = _run(integration_of(motion, known, duration, tolerance, progress, rates), row.copy())
        return Found.of(motion, solution, time, lambda when: Filling(motion, solution, when).books())

    return result_of(motion, _balanced(found, tolerance))


def _balanced(find: Callable[[float], Found], tolerance: float) -> Found:
    """A motion whose energy account is right to ACCOUNT, or MISSED times a coarse tolerance, if a finer one has it so.

    A step over a bend of a force that is not known beforehand, as where a reaction turns round, may be wrong by more
    than its estimate says; the account tells. What is interrupted, or stepped to the first order, is left as it is.
    """
    best, most = find(tolerance), max(ACCOUNT, MISSED * tolerance)
    for _ in range(FINER):
        tolerance = max(0.1 * tolerance, FINEST)
        if not best.share > most or best.solution.stepped or _stopped(best):
            break
        other = find(tolerance)
        if _stopped(other) or not other.share < best.share:
            break
        helps, best = other.share < HELPS * best.share, other
        if not helps:
            break
    return best


def _stopped(found: Found) -> bool:
    return found.solution.ended is not None and found.solution.ended.code == "simulate.stopped"


def _with_play(
    run: Run, duration: float, steps: int, tolerance: float, progress: Callable[[float], None] | None,
    impact_step: float | None,
) -> Result:  # fmt: skip
    """The motion of a mechanism whose joints in play are taken out, as one of the mechanism that was stated."""
    bare = opened(run)
    contacts = contacts_of(run, in_play(run.system.mechanism))
    loose = prepare(bare.mechanism, free=True)
    refuse_undetermined(loose, in_play(run.system.mechanism))
    motion = (ClosedMotion if is_rigid(run.system.mechanism) else StickingMotion).of(loose, contacts)
    row = initial_row(motion)
    refuse_massless(motion, row)
    fine = tolerance * min(1.0, contacts.least_clearance / float(np.ravel(run.system.size(run.values))[0]))
    times, time = load_times(motion, duration), np.linspace(0.0, duration, steps + 1)
    integrating = _integrating(motion, impact_step)

    def found(tolerance: float) -> Found:
        integration = integrating(duration, tolerance, progress=progress, times=times)
        solution = _run(integration, row.copy())

        def between(when: Array) -> Books:
            return Filling(motion, solution, when, bare).books()

        return Found.of(motion, solution, time, between, integration.finished())

    return result_of(motion, _balanced(found, max(fine, FINEST)), run)


def _integrating(motion: FreeMotion, impact_step: float | None) -> Callable[..., ContactMotion]:
    """What integrates a motion with joints in play."""
    if isinstance(motion, ClosedMotion):
        return partial(ImpactMotion, motion, ClosedRates(motion, compiled_closed(motion)), impact_step=impact_step)
    rates: Seeing = compiled_rates(motion) or Walks(motion)
    return partial(StickMotion if motion.resisted else ContactMotion, motion, rates)


def _run(integration: Integration, row: Array) -> Solution:
    """The motion from an initial row; of one that is interrupted what is done."""
    try:
        return integration.run(row)
    except KeyboardInterrupt:
        integration.end("stopped", integration.solution.end)
        return integration.solution


def _check_start(motion: FreeMotion, row: Array, limits: tuple[float, float]) -> None:
    """MechanismError for a start outside the range of the one free driver, or where nothing moves that has a mass."""
    if not limits[0] <= row[0] <= limits[1]:
        what = f"begins at {row[0]:g} (SI), outside its range from {limits[0]:g} to {limits[1]:g}"
        raise MechanismError(Finding(what, f"drivers.{motion.names[0]}.initial", "begin within the range"))
    if len(motion.names) != 1:
        return
    rows = np.repeat(row[:, None], 2, axis=1)
    rows[0, 1] += BESIDE * (1.0 if motion.system.turns(motion.names[0]) else motion.system.size(motion.values))
    there, beside = np.abs(motion.inertia(Layout.of(motion).moment(np.zeros(2), rows))[0, 0])
    if there < MASSLESS * beside:
        what = "begins where nothing moves that has a mass, as at a dead centre, so that it has no acceleration there"
        remedy = "state the inertia of the link or the rotor that it turns, or begin elsewhere"
        raise MechanismError(Finding(what, f"drivers.{motion.names[0]}.initial", remedy))


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
