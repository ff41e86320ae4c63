"""Motion in time with joints in play between rigid bodies: from impact to impact, and closed in between.

A step ends where a gap closes, and Newton's law gives the rates after it (`strike`). Where the rebounds become
lower than what the gap is known to, the impacts accumulate: the contact closes, and stays so under a force that keeps
its gap at 0, until that force becomes 0. A closed contact slips or sticks; a change of that ends a step,
too. Where impacts of several places crowd without end, one without restitution ends them.

Several places may strike at once. Impulses Λ at them change the rates of gaps and slips, γ⁺ = γ⁻ + G Λ with
G = W M⁻¹ Wᵀ. At every place either nothing is exchanged and γₙ⁺ ≥ −e γₙ⁻, or γₙ⁺ = −e γₙ⁻ with an impulse Λₙ ≥ 0 and
one along the tangent, |Λₜ| ≤ f Λₙ, that is −f Λₙ times the sign of the slip γₜ⁺: a linear complementarity problem (Ch.
Glocker, F. Pfeiffer, Multibody Dynamics with Unilateral Contacts, Wiley, 1996; without tangential restitution). Its
cases change by the worst place first, see `active_set.settled`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853, OdeSolver

from trunnion.algebra.dual import single
from trunnion.dynamics.active_motion import ActiveMotion
from trunnion.dynamics.active_set import MEET as SLOW
from trunnion.dynamics.active_set import RowMode, RowModes, settled
from trunnion.dynamics.bordered import nearest
from trunnion.dynamics.solution import Impact
from trunnion.dynamics.state import FreeMotion, Linear, Moment
from trunnion.dynamics.touching import Closed, Onset, least_clearance

Array = NDArray[np.float64]

OPEN, STICK = None, 0

CLOSE = 1e-12  # of the largest speed or impulse: differences that are rounding
HALVINGS = 60
LOW, ROUNDED = 1e-11, 1e-14  # of the clearance, of the size: a rebound as low is none
MEET = 1e-8  # of the clearance: gaps that differ by less close at one time, as far as the integration can tell
CROWD, CROWDED = 100, 1e-9  # events within so much of the duration: they have no end
FLIGHT = 0.1  # of the time to the next impact: the first step after one
STILL = 1e-12  # of the speeds of an impact: a slip that is 0


class Struck(NamedTuple):
    """Impulses, N s, rates after the impact, m/s, (normals then tangents,), what every place did - None: nothing, else
    the sense of its slip, 0 where it sticks -, the loss, J, and the restitution that was kept of the one stated."""

    impulse: Array
    after: Array
    cases: RowModes
    loss: float
    kept: float = 1.0


def strike(delassus: Array, before: Array, restitution: Array, friction: Array) -> Struck | None:
    """The impact at some places; None if no case fits.

    delassus: G, 1/kg, (2 places, 2 places); before: γ⁻, m/s, (2 places,), normals first; restitution, friction: of each
    place.
    Newton's law may gain energy where friction turns the slip round (T. R. Kane, D. A. Levinson, Dynamics: Theory and
    Applications, McGraw-Hill, 1985), or no case may fit it; the restitutions are then lowered together until one does
    that gains nothing, for without any the law always loses.
    """
    struck = _struck(delassus, before, restitution, friction)
    if struck is not None:
        rounding = CLOSE * float(np.abs(struck.impulse) @ (np.abs(before) + np.abs(struck.after)))
        if struck.loss >= -rounding:
            return struck
    low, high, best = 0.0, 1.0, None
    for _ in range(HALVINGS):
        share = 0.5 * (low + high) if best is not None else 0.0
        tried = _struck(delassus, before, share * restitution, friction)
        if tried is not None and tried.loss >= 0.0:
            low, best = share, tried._replace(kept=share)
        elif best is None:
            return tried
        else:
            high = share
    return best


def _struck(delassus: Array, before: Array, restitution: Array, friction: Array) -> Struck | None:
    """The case to which no place objects; at first none exchanges anything."""
    places = len(restitution)
    back = -restitution * np.minimum(before[:places], 0.0)
    speed = CLOSE * max(float(np.max(np.abs(before))), 1e-300)
    senses = [-1 if slip < 0.0 else 1 for slip in before[places:]]

    def objections(cases: RowModes) -> Mapping[int, RowMode] | None:
        """The place that breaks its law most, and what it seems to do instead; None: the equations of a case, which
        were singular, are not kept."""
        impulse, after = _solved(delassus, before, back, friction, cases)
        size = CLOSE * max(float(np.max(np.abs(impulse))), 1e-300)
        worst: list[tuple[float, int, RowMode]] = [(1.0, -1, OPEN)]
        for k, case in enumerate(cases):
            gap, slip = (after[k] - back[k]) / speed, after[places + k] / speed
            normal, tangent = impulse[k], impulse[places + k]
            if case is OPEN:
                worst.append((-gap, k, senses[k]))
                continue
            if abs(gap) > 1.0 or (case == STICK and abs(slip) > 1.0):
                return None
            worst.append((-normal / size, k, OPEN))
            if case == STICK:
                worst.append(((abs(tangent) - friction[k] * normal) / size, k, -int(np.sign(tangent))))
            elif friction[k] > 0.0:
                worst.append((-case * slip, k, STICK))
        _, k, mode = max(worst, key=lambda miss: miss[0])
        return {} if k < 0 else {k: mode}

    choices = [(OPEN, s, STICK, -s) if f > 0.0 else (OPEN, s) for f, s in zip(friction, senses, strict=True)]
    cases = settled([OPEN] * places, objections, choices)
    if cases is None:
        return None
    impulse, after = _solved(delassus, before, back, friction, cases)
    return Struck(impulse, after, cases, -0.5 * float(impulse @ (before + after)))


def _solved(delassus: Array, before: Array, back: Array, friction: Array, cases: RowModes) -> tuple[Array, Array]:
    """Impulses and rates after of one case: as many equations as places that exchange something."""
    places = len(cases)
    unknown, targets, spread = list[int](), list[float](), np.zeros((2 * places, 2 * places))
    for k, case in enumerate(cases):
        if case is not OPEN:
            spread[k, k], spread[places + k, k] = 1.0, -friction[k] * case
            unknown.append(k)
            targets.append(back[k] - before[k])
        if case == STICK:
            spread[places + k, places + k] = 1.0
            unknown.append(places + k)
            targets.append(-before[places + k])
    if not unknown:
        return np.zeros(2 * places), before
    columns = spread[:, unknown]
    # two places may share one impulse
    numbers = np.linalg.lstsq(delassus[unknown] @ columns, np.array(targets), rcond=1e-13)[0]
    impulse: Array = columns @ numbers
    return impulse, before + delassus @ impulse


@dataclass
class ImpactMotion(ActiveMotion):
    """An integration that follows the impacts of rigid bodies from event to event."""

    recent: list[float] = field(default_factory=list)
    pauses: dict[int, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        each = self.motion.contacts
        self.friction = np.array([contact.coefficient for contact in each])
        self.restitution = np.array([contact.restitution for contact in each])
        self.meet = MEET * least_clearance(self.motion.contacts)
        self.low = np.array([max(LOW * contact.clearance, ROUNDED * self.motion.size) for contact in each])

    # ---- what ends a step -------------------------------------------------------------------------------------

    def _gaps(self, at: Moment) -> Array:
        """What stays above 0 within a step, (2 contacts, lane): gap or normal force, and slip or what friction has left
        before it slips."""
        values = np.ones((2 * self.count, len(at.time)))
        touches = self.dynamics.look(at)
        for k, onset in enumerate(self.onsets):
            values[k] = touches.normal[k] if onset else touches.gap[k]
            if isinstance(onset, Closed) and self.friction[k] > 0.0:
                left = self.friction[k] * touches.normal[k] - np.abs(touches.friction[k])
                values[self.count + k] = onset.sense * touches.slip[k] if onset.sense else left
        return values

    def _met(self, k: int, time: float, row: Array) -> float:
        """An impact, a lift-off, or a change between slip and stick; `row` is what it is after it."""
        contact = k % self.count
        self.recent = [*self.recent, time][-CROWD:]
        onset = self.onsets[contact]
        if not isinstance(onset, Closed):
            return self._impact(contact, time, row)
        if k < self.count:
            self._end(contact, time, 0.0)
            self._set({contact: None})
            return np.inf
        each = self.motion.contacts
        together = [other for other in self._closed() if each[other].surface == each[contact].surface]
        if onset.sense:  # the slip ends
            self._set(dict.fromkeys(together, Closed(0)))
            self._project(time, row)
        else:
            friction = self._look(lambda times: row[:, None], np.array([time])).friction[contact, 0]
            self._set(dict.fromkeys(together, Closed(-int(np.sign(friction)))))
        return np.inf

    def _closed(self) -> list[int]:
        return [k for k, onset in enumerate(self.onsets) if onset is not None]

    def _set(self, onsets: Mapping[int, Closed | None]) -> None:
        onsets_now = tuple(onsets.get(k, onset) for k, onset in enumerate(self.onsets))
        self.mode = self.mode._replace(onsets=onsets_now)

    # ---- impacts ----------------------------------------------------------------------------------------------

    def _impact(self, k: int, time: float, row: Array) -> float:
        """An impact at a contact, with those that are closed and those that meet at the same time; how long the first
        step after it may be, s."""
        at = self.moment(time, row)
        linear = self.motion.linear(at)
        rates = linear.driven + linear.ways @ at.rate[:, 0]
        meet = (linear.gaps <= self.meet) & (rates[: self.count] < 0.0)
        places = [i for i in range(self.count) if i == k or meet[i] or self.onsets[i] is not None]
        crowded = len(self.recent) == CROWD and self.recent[-1] - self.recent[0] < CROWDED * self.duration
        restitution = np.zeros(self.count) if crowded else self.restitution
        law, pauses = self._law(linear, places, rates, restitution), dict[int, float]()
        if law is not None:
            flights = self._flights(time, row, places, rates, *law)
            pauses = {i: pause for i, (pause, low) in flights.items() if low}
            if pauses:
                restitution = np.where([i in pauses for i in range(self.count)], 0.0, restitution)
                law = self._law(linear, places, rates, restitution)
        if law is None:
            self._stop("no_contact_force", time, row)
            return np.inf
        struck, change = law
        if crowded:
            self.recent.clear()
        if crowded or struck.kept < 1.0:  # an impact kept less than its restitution
            first = {"times": 0, "time": time, "share": 1.0}
            note = self.solution.notes.setdefault("simulate.restitution_lowered", first)
            note["times"] += 1
            note["share"] = min(note["share"], 0.0 if crowded else struck.kept)
        n, works = self.layout.coordinates, self.layout.works(row)
        row[n : 2 * n] += change
        works[0] += self._driven(at, change, struck, places, linear.driven)
        works[-1] += struck.loss
        self._after(time, row, places, rates, struck, pauses)
        return FLIGHT * min((pause for pause, low in flights.values() if not low), default=np.inf)

    def _law(self, linear: Linear, places: list[int], rates: Array, restitution: Array) -> tuple[Struck, Array] | None:
        """The law's answer at some places, and the change of the rates of the coordinates. rates: of gaps and slips of
        all contacts."""
        rows = [*places, *(self.count + k for k in places)]
        ways = linear.ways[rows]
        spread = np.linalg.solve(linear.mass, ways.T)
        struck = strike(ways @ spread, rates[rows], restitution[places], self.friction[places])
        return None if struck is None else (struck, spread @ struck.impulse)

    def _driven(self, at: Moment, change: Array, struck: Struck, places: list[int], driven: Array) -> float:
        """Work that drivers whose motion is stated do in an impact, J."""
        names = [name for name in self.motion.system.mechanism.drivers if name not in self.motion.names]
        if not names:
            return 0.0
        free = at._replace(onsets=(None,) * self.count)
        still, struck_so = (
            self.motion.solve(free, second, self.motion.senses(free)) for second in (0.0 * at.q, change[:, None])
        )
        put_in = sum(single((struck_so.efforts[name] - still.efforts[name]) * still.walk.rate(name)) for name in names)
        rows = [*places, *(self.count + k for k in places)]
        return put_in - float(struck.impulse @ driven[rows])

    def _flights(
        self, time: float, row: Array, places: Sequence[int], before: Array, struck: Struck, change: Array
    ) -> dict[int, tuple[float, bool]]:
        """Of every place that rebounds and comes back: the time until it does, s; where it goes so low, rebounding or
        let go, that this is none, that until its impacts have accumulated."""
        n, after, flights = self.layout.coordinates, row.copy(), dict[int, tuple[float, bool]]()
        after[n : 2 * n] += change
        rebounds = [i for i, k in enumerate(places) if struck.cases[i] is not OPEN and before[k] < 0.0]
        closed = [k for i, k in enumerate(places) if struck.cases[i] is not OPEN and self.onsets[k] is not None]
        free = [k for k in places if k not in closed]
        onsets = tuple(None if k in free else onset for k, onset in enumerate(self.onsets))
        walk = self.motion.accelerate(self.moment(time, after)._replace(onsets=onsets)).back.walk
        for i, k in enumerate(places):
            speed, e = max(float(struck.after[i]), 0.0), float(self.restitution[k])
            pull = -single(self.motion.contacts[k].accelerations(walk)[0])
            if pull > 0.0 and e > 0.0 and k in free:
                low = 0.5 * speed * speed / pull < self.low[k]
                if low or i in rebounds:
                    flights[k] = 2.0 * speed / pull / (1.0 - e if low and e < 1.0 else 1.0), low
        return flights

    def _after(
        self, time: float, row: Array, places: Sequence[int], before: Array, struck: Struck, pauses: Mapping[int, float]
    ) -> None:
        """Take down what an impact came to, and let the contacts close that do not rebound."""
        closed: dict[int, Closed | None] = {}
        for i, k in enumerate(places):
            case, normal = struck.cases[i], float(struck.impulse[i])
            slips = abs(before[self.count + k]), abs(struck.after[len(places) + i])
            approach, wear = max(-float(before[k]), 0.0), 0.5 * normal * float(sum(slips))
            keeps = case is not OPEN and (self.onsets[k] is not None or self.restitution[k] == 0.0)
            if keeps or k in pauses:
                still = self.friction[k] > 0.0 and slips[1] <= STILL * max(slips[0], approach)
                sense = int(np.sign(struck.after[len(places) + i])) if case is OPEN else case
                closed[k] = Closed(0 if still else sense or 1)
            if self.onsets[k] is not None:
                self._open[k].impulse += normal
                self._open[k].wear += wear
                if k not in closed:
                    self._end(k, time, float(struck.after[i]))
            elif case is not OPEN:
                label, rate = self.motion.contacts[k].label, float(struck.after[i])
                self.solution.impacts.append(
                    Impact(label, time, approach, time, rate, force=np.nan, wear=wear, impulse=normal)
                )
                self._note(time, "impact", approach, "m/s", label)
        self._set({k: closed.get(k) for k in places})
        if self.mode.senses:  # joints that stuck slide on with the speeds that it leaves them
            senses = list(self.mode.senses)
            for k, speed in enumerate(self.motion.ways(self.moment(time, row))[1]):
                if abs(speed) > SLOW and np.sign(speed) != senses[k]:
                    if senses[k] == 0:
                        self._note(time, "break-away", float(np.sign(speed)), of=self.motion.resisted[k])
                    senses[k] = int(np.sign(speed))
            self.mode = self.mode._replace(senses=tuple(senses))
        self._project(time, row, places)
        self.pauses = dict(pauses)

    # ---- closed -----------------------------------------------------------------------------------------------

    def _let(self, time: float, onsets: tuple[Onset, ...]) -> None:
        """Tell which of the contacts that could be closed are."""
        before = self._closed()
        super()._let(time, onsets)
        for k in before:
            if onsets[k] is None and k in self._open:
                self._end(k, time, 0.0)
            elif onsets[k] is not None and k not in self._open:
                self._begin(k, time + self.pauses.get(k, 0.0))
                self._note(self._open[k].begin, "closes", unit="m/s", of=self._open[k].label)
        self.pauses = {}

    def _project(self, time: float, row: Array, struck: Sequence[int] = ()) -> None:
        """Take the gaps of closed contacts, and their rates, to 0, and the gaps of those just struck that are below it:
        the nearest state in the sense of the masses."""
        n, closed, at = self.layout.coordinates, self._closed(), self.moment(time, row)
        linear = self.motion.linear(at)
        if shut := [*closed, *(k for k in struck if self.onsets[k] is None and linear.gaps[k] < 0.0)]:
            row[:n] -= nearest(linear.mass, linear.ways[shut], linear.gaps[shut])
        if closed and (stuck := [k for k, sense in enumerate(self.mode.senses) if sense == 0]):
            row[n : 2 * n] = self.motion.stopped(self.moment(time, row), stuck)
        elif closed:
            still = [*closed, *(self.count + k for k in closed if self.onsets[k] == Closed(0))]
            rates = linear.driven + linear.ways @ row[n : 2 * n]
            row[n : 2 * n] -= nearest(linear.mass, linear.ways[still], rates[still])

    def _end_step(self, solver: OdeSolver, row: Array) -> None:
        """Nothing drifts: the next step begins from closed gaps."""
        if not any(self.onsets):
            return
        time = float(solver.t)
        if isinstance(solver, DOP853) and np.array_equal(row, solver.y):
            self._project(time, row)
            solver.y = row.copy()
            solver.f = solver.fun(time, solver.y)

    def _cause(self, time: float, row: Array) -> str:
        """Why a state has no acceleration; empty if it has one."""
        cause = super()._cause(time, row)
        return "no_contact_force" if cause == "no_acceleration" and any(self.onsets) else cause


def integrator_of(motion: FreeMotion) -> type[ActiveMotion]:
    """What integrates a motion."""
    return ImpactMotion if any(contact.rigid for contact in motion.contacts) else ActiveMotion
