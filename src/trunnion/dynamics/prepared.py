"""What integrates a free motion without play, and its rates through change points.

Where the links go on smoothly through a pose in which two assemblies meet, so do the rates of one free coordinate, if
nothing rubs: beside it they are read from those on both sides of it. For the digits of the accelerations are lost there
like the third power of the distance: the place of a pin that two links in line hold is known across them only as well
as rounding over the distance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from trunnion.algebra.dual import single
from trunnion.dynamics.active_motion import ActiveMotion
from trunnion.dynamics.impact_motion import ImpactMotion
from trunnion.dynamics.integrate import MOST_EVALUATIONS, Integration
from trunnion.dynamics.rates import Dynamics, Rates
from trunnion.dynamics.start import Places, load_times
from trunnion.dynamics.state import FreeMotion, Mode, Moment
from trunnion.solve.system import felt
from trunnion.solve.track import carried_on

__all__ = ["CYCLES", "FINEST", "Bridged", "bridged", "integration_of"]

WIDTH = 0.02  # rad, or of the size: from a change point to the first place at which rates are asked for
PLACES = np.array([-3.0, -2.0, -1.0, 1.0, 2.0, 3.0])  # in such widths
APART = 8.0  # widths to the next change point


@dataclass(frozen=True)
class Bridged:
    """Rates of one free coordinate, beside some of its places by the polynomial through those farther off.

    places: of change points; period: after which they come again, None if they do not.
    """

    inner: Dynamics
    places: Sequence[float]
    period: float | None
    width: float

    def __call__(self, at: Moment) -> Rates:
        """The rates; one lane."""
        away = float(at.q[0, 0]) - np.array(self.places)
        if self.period is not None:
            away -= self.period * np.round(away / self.period)
        nearest = float(away[np.argmin(np.abs(away))])
        if not abs(nearest) < self.width:
            return self.inner(at)
        about = [self.inner(at._replace(q=at.q - nearest + place * self.width)) for place in PLACES]
        second, others = (
            carried_on(self.width * PLACES, np.array(numbers, float).T, nearest)
            for numbers in ([state.second for state in about], [state.others for state in about])
        )
        return Rates(second, others, all(state.sound for state in about), any(state.locked for state in about))

    def __getattr__(self, name: str) -> Any:
        return getattr(self.inner, name)


def bridged(motion: FreeMotion, rates: Dynamics) -> Dynamics:
    """The rates of a motion, through the change points that it passes where nothing rubs."""
    system, run = motion.system, motion.run
    if len(system.mechanism.drivers) != 1 or felt(system, motion.values):
        return rates
    times = [time for number, met in run.chosen.meetings.items() if motion.passes(number) for time in met.crossed]
    if not times:
        return rates
    (name,) = system.mechanism.drivers
    places = [single(system.drive(run.values, name, time)[0]) for time in times]
    span, periodic = single(system.span(run.values, name).peak) * run.cycle.duration, run.cycle.periodic
    width = WIDTH if system.turns(name) else WIDTH * motion.size
    ordered = np.sort(places)
    gaps = np.diff([*ordered, ordered[0] + span] if periodic else ordered)
    width = min([width, *(gap / APART for gap in gaps)])
    return Bridged(rates, places, span if periodic else None, width)


FINEST = 3e-14  # the least relative tolerance of SciPy's integrators
CYCLES = 10  # of the nominal motion: the duration if none is stated


def integration_of(
    motion: FreeMotion, rates: Dynamics, load_places: Places, duration: float, tolerance: float,
    progress: Callable[[float], None] | None = None, evaluations: int = MOST_EVALUATIONS, start: float = 0.0,
    mode: Mode | None = None,
) -> Integration:  # fmt: skip
    """What integrates a motion. duration, evaluations, start, mode: see `Integration`."""
    kind = ImpactMotion if any(contact.rigid for contact in motion.contacts.each) else ActiveMotion
    return kind(
        motion, bridged(motion, rates), duration, tolerance, load_places, progress, load_times(motion, duration),
        evaluations, mode or Mode(), start,
    )  # fmt: skip
