"""Motion in time: what a mechanism does when its motors, loads and friction are let act on it; at once, or from step to
step under efforts and loads that others state, for co-simulation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import single
from trunnion.dynamics.active_motion import ActiveMotion
from trunnion.dynamics.compiled_rates import Codes, rates_of
from trunnion.dynamics.findings import check_start, motion_findings, refuse, refuse_undetermined
from trunnion.dynamics.followed import Snapshot
from trunnion.dynamics.impact_motion import integrator_of
from trunnion.dynamics.integrate import FINEST, MOST_EVALUATIONS
from trunnion.dynamics.motor import applied_to, drives
from trunnion.dynamics.opened import in_play, opened
from trunnion.dynamics.rates import Dynamics, Walks
from trunnion.dynamics.result import Books, Integrated, filled, result_of
from trunnion.dynamics.solution import CLOSE
from trunnion.dynamics.start import CYCLES, initial_row, places
from trunnion.dynamics.state import FreeMotion, Mode
from trunnion.dynamics.steady_cycle import steady as steady_result
from trunnion.dynamics.touching import contacts_of, least_clearance
from trunnion.errors import Finding, MechanismError
from trunnion.model.arguments import strict_arguments
from trunnion.model.mechanism import Mechanism
from trunnion.solve.run import prepare

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.results.dataset import Result

Array = NDArray[np.float64]

MOST_STEPS = 1_000_000
ACCOUNT, MISSED = 1e-8, 10.0  # what the energy account may miss, of the energy turned over; times the tolerance
FINER = 2  # motions with a tenth of the tolerance of the last, at most, that are tried where it misses more


@strict_arguments
@np.errstate(all="ignore")
def simulate(
    mechanism: Mechanism,
    duration: float | None = None,
    steps: int = 1000,
    tolerance: float = 1e-9,
    progress: Callable[[float], None] | None = None,
    steady: bool = False,
    evaluations: int = MOST_EVALUATIONS,
) -> xr.Dataset:
    """Motion in time of a mechanism whose drivers are free: coordinates, forces, energy and events.

    Parameters
    ----------
    mechanism
        With a driver that is free or has a motor.
    duration
        s; ten cycles of the stated motion if not given.
    steps
        Equal intervals at whose ends the result stands.
    tolerance
        Relative, of every step of the integration.
    progress
        Called with the share of the duration that is reached, from 0 to 1.
    steady
        Instead of the motion from its start the cycle that it comes to repeat, see `dynamics.steady_cycle`.
    evaluations
        Of the accelerations, at most. A motion that needs more ends there, with a finding.

    Returns
    -------
    xarray.Dataset
        With the names and units of `analyse` over `time`, with works, energies and events beside them; where the
        motion ends early the last row is its end. Of a steady cycle that of `analyse`, over as many positions as steps,
        equally spaced in time.

    Raises
    ------
    MechanismError
        If no driver is free, or if the motion cannot begin or be found for what the joints are.

    Notes
    -----
    The free coordinates accelerate so that the effort the modules demand is what the motors give (`dynamics.state`);
    integrated from event to event (`dynamics.integrate`).
    """
    return simulated(mechanism, duration, steps, tolerance, progress, steady, evaluations).dataset


@np.errstate(all="ignore")
def simulated(
    mechanism: Mechanism, duration: float | None, steps: int, tolerance: float,
    progress: Callable[[float], None] | None, steady: bool, evaluations: int,
) -> Result:  # fmt: skip
    """What `simulate` does, before it becomes a Dataset."""
    refuse(mechanism)
    run, playing = prepare(mechanism, free=True), in_play(mechanism)
    if not playing:
        refuse_undetermined(run)
    duration = CYCLES * run.cycle.duration if duration is None else duration
    checks = {
        "duration": (np.isfinite(duration) and duration > 0, duration, "a time above 0, such as 2 s"),
        "steps": (1 <= steps <= MOST_STEPS, steps, f"a whole number from 1 to {MOST_STEPS:,}"),
        "evaluations": (evaluations >= 1, evaluations, "a whole number from 1"),
        "tolerance": (1e-13 <= tolerance <= 1e-2, tolerance, "a number from 1e-13 to 1e-2"),
    }
    wrong = [(key, number, form) for key, (right, number, form) in checks.items() if not right]
    if wrong:
        raise MechanismError(Finding(f"{key} cannot be {number:g}", key, f"give {form}") for key, number, form in wrong)
    if steady:
        return steady_result(mechanism, duration, steps, tolerance, progress, evaluations)
    motion, bare = FreeMotion.of(run), None
    if playing:
        bare = opened(run)
        loose, contacts = prepare(bare.mechanism, free=True), contacts_of(run, playing)
        refuse_undetermined(loose, playing)
        motion = FreeMotion.of(loose, contacts)
        tolerance *= min(1.0, least_clearance(contacts) / single(run.system.size(run.values)))
        tolerance = max(tolerance, FINEST)
    load_places, row, rates = places(motion, mechanism.drivers), initial_row(motion), rates_of(motion)
    check_start(motion, row, load_places.limits)
    time = np.linspace(0.0, duration, steps + 1)

    def integrated(tolerance: float) -> Integrated:
        motion.begin(None)
        integration = integrator_of(motion)(motion, rates, duration, tolerance, load_places, progress, evaluations)
        solution = integration.run(row.copy())
        return Integrated.of(run, solution, time, lambda when: filled(motion, solution, when, bare))

    return result_of(motion, _balanced(integrated, tolerance), duration, run)


def _balanced(find: Callable[[float], Integrated], tolerance: float) -> Integrated:
    """A motion whose energy account is right to ACCOUNT, or MISSED times a coarse tolerance, if a finer one has it so.

    A step over a bend of a force that is not known beforehand, as where a reaction turns round, may be wrong by more
    than its estimate says; the account tells. What has used up its evaluations is left as it is.
    """
    best, most = find(tolerance), max(ACCOUNT, MISSED * tolerance)
    for _ in range(FINER):
        tolerance = max(0.1 * tolerance, FINEST)
        if best.exhausted or not best.share > most:
            break
        finer = find(tolerance)
        if finer.exhausted or not finer.share < best.share:
            break
        best = finer
    return best


# ---- step by step ----------------------------------------------------------------------------------------------

BRIEF = 1e-9  # of the cycle: for how long it is let move to tell how it is now


class Continued:
    """The motion that `simulate` finds, one step after the other.

    Parameters
    ----------
    mechanism : with a driver that is free or has a motor, without joints in play.
    tolerance : relative, of every step of the integration.

    Attributes
    ----------
    inputs : numbers that may change between steps, SI, by path: efforts on the free drivers beside their motors', and
        components of loads that are plain numbers.
    time : s, until which it has gone.
    ended : why it goes no farther; None while it does.

    Raises
    ------
    MechanismError : for what `simulate` refuses, and for joints in play.

    Examples
    --------
    >>> motion = Continued(mechanism)                       # doctest: +SKIP
    >>> motion.inputs["drivers.O.applied"] = 2.5            # doctest: +SKIP
    >>> motion.advance(0.01).at.q                           # doctest: +SKIP
    """

    def __init__(self, mechanism: Mechanism, tolerance: float = 1e-9) -> None:
        refuse(mechanism)
        if playing := in_play(mechanism):
            what = f"a motion with joints in play ({', '.join(playing)}) does not go on step by step"
            raise MechanismError(Finding(what, f"joints.{playing[0]}.contact", "remove the contact, or use `simulate`"))
        self.run = prepare(mechanism, free=True)
        refuse_undetermined(self.run)
        self.tolerance, self.time = tolerance, 0.0
        self.ended: Finding | None = None
        self.motion = FreeMotion.of(self.run)
        self.inputs = {applied_to(name): 0.0 for name in self.motion.names}
        for path, entry in mechanism.parameter_set.entries.items():
            if path.startswith("loads.") and ".resisting" not in path and not entry.varies:
                self.inputs[path] = single(self.run.values[path])
        self._varied, self._applied = frozenset(self.inputs), dict[str, float]()
        self._codes: Codes = {}
        self._places, self._row, self._mode = places(self.motion), initial_row(self.motion), Mode()
        check_start(self.motion, self._row, self._places.limits)
        self._snapshot: Snapshot | None = None
        self._rates: Dynamics = Walks(self.motion)
        self._end: Books | None = None

    @np.errstate(all="ignore")
    def now(self) -> Books:
        """How it is at `time`, under the present inputs."""
        if self._end is not None:
            return self._end
        brief = self._moved(self.time + BRIEF * self.run.cycle.duration).solution
        return filled(self.motion, brief, np.array([self.time]))

    @np.errstate(all="ignore")
    def advance(self, until: float) -> Books:
        """Go on to a time, s, under the present inputs; how it is there, or where it ends before."""
        if self.ended is not None or not until > self.time * (1.0 + 2 * CLOSE):
            return self.now()
        integration = self._moved(until)
        solution = integration.solution
        if solution.ended is None:
            self.time, self._row = integration.last
            self._mode, self._snapshot = integration.mode, integration.snapshot
            return filled(self.motion, solution, np.array([self.time]))
        *_, self.ended = motion_findings(self.motion, solution, self.run)  # why it ends is the last
        self.time = solution.end if solution.stretches else self.time
        self._end = filled(self.motion, solution, np.array([self.time]))
        return self._end

    def _moved(self, until: float) -> ActiveMotion:
        """The integration from now to a time, s."""
        if self._applied != self.inputs:
            values = {**self.run.values, **self.inputs}
            run = replace(self.run, values=values)
            self.motion = replace(self.motion, run=run, drives=drives(run.system, values))
            self._rates, self._applied = rates_of(self.motion, self._codes, self._varied), dict(self.inputs)
        self.motion.begin(self._snapshot)
        integration = integrator_of(self.motion)(
            self.motion, self._rates, until, self.tolerance, self._places, mode=self._mode, start=self.time
        )
        integration.run(self._row.copy())
        return integration
