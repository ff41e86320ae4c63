"""Moreau's time stepping of rigid bodies in play: no events, contacts and impacts alike by the impulses of a step.

q_M = q + ½ h q̇;  q̇⁺ = q̇ + h q̈(q_M, q̇) + M⁻¹ Wᵀ Λ, Λ by the impact law of all places whose gap is not above 0 at q_M;
q⁺ = q_M + ½ h q̇⁺ (J. J. Moreau, Unilateral contact and dry friction in finite freedom dynamics, in: Nonsmooth Mechanics
and Applications, CISM 302, Springer, 1988, doi:10.1007/978-3-7091-2624-0_1). It is of the first order, and gets through
impacts without end.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.dynamics.closed import ClosedMotion, ClosedRates, Linear
from trunnion.dynamics.contact_motion import ContactMotion, Impact, OpenContact
from trunnion.dynamics.impact_law import Struck, strike
from trunnion.dynamics.solution import Event, Stretch
from trunnion.dynamics.state import Moment
from trunnion.dynamics.touching import Closed

__all__ = ["SteppedMotion"]

Array = NDArray[np.float64]


@dataclass
class SteppedMotion(ContactMotion):
    """An integration of rigid bodies in play that steps through their impacts.

    impact_step: s; None: from event to event, see `impact_motion`.
    """

    impact_step: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        assert isinstance(self.motion, ClosedMotion)
        assert isinstance(self.dynamics, ClosedRates)
        self.closed_rates = self.dynamics
        self.rigid, each = self.motion, self.motion.contacts.each
        self.count = len(each)
        self.friction = np.array([one.coefficient for one in each])
        self.restitution = np.array([one.restitution for one in each])

    # ---- impulses ---------------------------------------------------------------------------------------------

    def _law(
        self, linear: Linear, places: list[int], rates: Array, restitution: Array, old: Array | None = None
    ) -> tuple[Struck, Array] | None:
        """The law's answer at some places, and the change of the rates of the coordinates. rates: of gaps and slips of
        all contacts; old: from which the restitution counts, where forces have changed them since."""
        rows = [*places, *(self.count + k for k in places)]
        ways = linear.ways[rows]
        spread = np.linalg.solve(linear.mass, ways.T)
        own, before = restitution[places], None if old is None else old[rows]
        struck = strike(ways @ spread, rates[rows], own, self.friction[places], before)
        return None if struck is None else (struck, spread @ struck.impulse)

    def _driven(self, at: Moment, change: Array, struck: Struck, places: list[int], driven: Array) -> float:
        """Work that drivers whose motion is stated do in an impact, J."""
        names = [name for name in self.motion.system.mechanism.drivers if name not in self.motion.names]
        if not names:
            return 0.0
        free = at._replace(onsets=(None,) * self.count)
        still, struck_so = (self.motion.solve(free, second) for second in (0.0 * at.q, change[:, None]))
        given = sum(
            float(np.ravel(primal((struck_so.efforts[name] - still.efforts[name]) * still.walk.rate(name)))[0])
            for name in names
        )
        rows = [*places, *(self.count + k for k in places)]
        return given - float(struck.impulse @ driven[rows])

    def _strike_off(self, row: Array, change: Array, drive: float, loss: float) -> None:
        """Let an impact change a row: rates, and the works of drivers and contacts."""
        n, works = self.layout.coordinates, self.layout.works(row)
        row[n : 2 * n] += change
        works[0] += drive
        works[-1] += loss

    # ---- steps ------------------------------------------------------------------------------------------------

    def _move(
        self, time: float, row: Array, until: float, sense: float, now: float, step: float | None
    ) -> tuple[float, Array, float | None]:
        """Step to the next break."""
        assert self.impact_step is not None
        self.solution.stepped = True
        steps = max(1, int(np.ceil((until - time) / self.impact_step * (1 - 1e-12))))
        for end in time + (until - time) * np.arange(1, steps + 1) / steps:
            after = self._step(time, row, float(end) - time, now)
            if not np.all(np.isfinite(after)):
                return self._failed(time, row, sense, now, None)
            held = time, row
            self._add(Stretch(time, float(end), _line(*held, float(end), after), sense, False, now, None, self.onsets))
            time, row = float(end), after
        return until, row, None

    def _step(self, time: float, row: Array, step: float, now: float) -> Array:
        """One step."""
        n, after = self.layout.coordinates, row.copy()
        rate = row[n : 2 * n]
        after[:n] += 0.5 * step * rate
        at = self.moment(time + 0.5 * step, after, 0.0, now)._replace(onsets=(None,) * self.count)
        rates = self.dynamics(at)
        if not rates.sound:
            return np.full_like(row, np.nan)
        ahead = self.layout.row(rate, rates)
        after[n:] += step * ahead[n:]
        places = [k for k, gap in enumerate(self.seeing.look(at).gap[:, 0]) if gap <= 0.0]
        if places:
            linear = self.closed_rates.linear(at)
            before = linear.driven + linear.ways @ rate
            found = self._law(linear, places, before + step * linear.ways @ rates.second, self.restitution, before)
            if found is None:
                self._stop("no_contact_force", time, row)
                return after
            struck, change = found
            self._strike_off(after, change, self._driven(at, change, struck, places, linear.driven), struck.loss)
            self._follow_impulses(time, step, places, struck, before)
        else:
            self._follow_impulses(time, step, [], None, np.zeros(0))
        after[:n] += 0.5 * step * after[n : 2 * n]
        return after

    def _follow_impulses(
        self, time: float, step: float, places: list[int], struck: Struck | None, before: Array
    ) -> None:
        """Take down which contacts begin, last and end with a step."""
        onsets: list[Closed | None] = [None] * self.count
        for i, k in enumerate(places if struck else []):
            assert struck is not None
            normal, tangent = struck.impulse[i], struck.impulse[len(places) + i]
            if normal <= 0.0:
                continue
            onsets[k] = Closed(None, normal / step, tangent / step)
            one = self._open.get(k)
            if one is None:
                one = self._open[k] = OpenContact(time, max(-float(before[k]), 0.0), np.nan)
                self._say(time, "impact", k, one.approach)
            slip = 0.5 * (abs(before[self.count + k]) + abs(struck.after[len(places) + i]))
            one.impulse += float(normal)
            one.wear += float(normal * slip)
            one.separation = float(struck.after[i])
        for k in [k for k in self._open if onsets[k] is None]:
            self._end(k, time, self._open[k].separation)
        self.onsets = tuple(onsets)

    def _say(self, time: float, kind: str, k: int, figure: float) -> None:
        self.solution.events.append(Event(time, kind, self.motion.contacts.labels[k], figure, "m/s"))

    def _end(self, k: int, time: float, rate: float) -> None:
        """A contact lifts off."""
        one = self._open.pop(k)
        label = self.motion.contacts.labels[k]
        self.impacts.append(Impact(label, one.begin, time, one.approach, rate, one.force, 0.0, one.wear, one.impulse))
        self._say(time, "lift-off", k, rate)


def _line(begin: float, row: Array, end: float, after: Array) -> Callable[[Array], Array]:
    """The state between two moments, straight."""

    def state(time: Array) -> Array:
        share = (np.asarray(time) - begin) / (end - begin)
        found: Array = row[:, None] + share * (after - row)[:, None]
        return found

    return state
