"""A free motion that goes on from step to step, under efforts and loads that others state: for co-simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import single
from trunnion.dynamics.compiled_rates import Codes, rates_of
from trunnion.dynamics.findings import check_start, motion_findings, refuse, refuse_undetermined
from trunnion.dynamics.followed import Snapshot
from trunnion.dynamics.impact_motion import integration_of
from trunnion.dynamics.integrate import Integration
from trunnion.dynamics.motor import applied_to, drives
from trunnion.dynamics.opened import in_play
from trunnion.dynamics.rates import Dynamics, Walks
from trunnion.dynamics.result import Books, filled
from trunnion.dynamics.solution import CLOSE
from trunnion.dynamics.start import initial_row, places
from trunnion.dynamics.state import FreeMotion, Mode
from trunnion.errors import Finding, MechanismError
from trunnion.model.mechanism import Mechanism
from trunnion.solve.run import prepare

__all__ = ["Continued"]

Array = NDArray[np.float64]

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
        findings = motion_findings(self.motion, solution, self.run)
        self.ended = next(finding for finding in findings if finding.code == solution.ended.code)
        self.time = solution.end if solution.stretches else self.time
        self._end = filled(self.motion, solution, np.array([self.time]))
        return self._end

    @np.errstate(all="ignore")
    def _moved(self, until: float) -> Integration:
        """The integration from now to a time, s."""
        if self._applied != self.inputs:
            values = {**self.run.values, **self.inputs}
            run = replace(self.run, values=values)
            self.motion = replace(self.motion, run=run, drives=drives(run.system, values))
            self._rates, self._applied = rates_of(self.motion, self._codes, self._varied), dict(self.inputs)
        self.motion.begin(self._snapshot)
        integration = integration_of(
            self.motion, self._rates, self._places, until, self.tolerance, start=self.time, mode=self._mode
        )
        integration.run(self._row.copy())
        return integration
