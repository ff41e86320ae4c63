"""Integration of a motion whose motor drives through a clutch: open, slipping or holding.

While the clutch is open or slips the rotor turns by itself, J ω̇ = T(ω) − σ C, with the capacity C and the sense σ of
the slip s = ω − i q̇; the coordinate is driven by σ C through the gear. While it holds, s = 0 and the rotor is part of
what the coordinate moves. It slips on from where it would have to carry more than C. The sense is stated of every
stretch, so that forces are smooth beyond its end, and the end is found on the dense output to rounding.

Source: Ch. Glocker, F. Pfeiffer, Multibody Dynamics with Unilateral Contacts, Wiley, 1996 (stick and slip as a
complementarity); of one contact of given normal force the cases are tried one after the other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from trunnion.dynamics.guards import Crossing
from trunnion.dynamics.integrate import Integration
from trunnion.dynamics.motor import Drive
from trunnion.dynamics.rates import WORKS, Dynamics, Rates
from trunnion.dynamics.rest import Rest
from trunnion.dynamics.solution import Stretch
from trunnion.dynamics.state import Moment

__all__ = ["ClutchMotion"]

Array = NDArray[np.float64]

ROUNDING = 1e-12  # of the capacity: what a clutch that just holds may carry more, by rounding


class ClutchRates:
    """The rates of a motion with those of the slip and of what is lost in it beside them."""

    def __init__(self, drive: Drive, inner: Dynamics) -> None:
        self.drive, self.inner = drive, inner
        self.seconds, self.look, self.margins = inner.seconds, inner.look, inner.margins

    def __call__(self, at: Moment) -> Rates:
        """The rates; one lane."""
        return self._with_rotor(at, self.inner(at))

    def resting(self, at: Moment, works: Array) -> Rates:
        """Those while the coordinate rests, with the powers meanwhile: the rotor moves; one lane."""
        n = len(at.q)
        return self._with_rotor(at, Rates(np.zeros(n), np.zeros(n), np.zeros(len(at.bristles)), works, True))

    def _with_rotor(self, at: Moment, rates: Rates) -> Rates:
        drive = self.drive
        if not drive.loose(at.now, at.slips):
            return rates._replace(slip=np.zeros(1), works=np.append(rates.works, 0.0))
        rotor = at.slip[0] + drive.ratio * at.rate[0]
        spin = drive.spin(at.time, rotor, at.integral[0], at.now, at.slips)
        lost = drive.carried(at.now, at.slips) * at.slip[0]
        error = drive.error(at.time, rotor / drive.ratio, at.integral[0], at.now)
        works = np.append(rates.works, lost)
        works[0] += lost[0]  # the motor's, of which the joint gets the rest
        return rates._replace(slip=spin - drive.ratio * rates.second, integral=error, works=works)


class ClutchMotion(Integration):
    """One motion, of one free coordinate, whose motor has a clutch."""

    def __post_init__(self) -> None:
        super().__post_init__()
        (self.drive,) = self.motion.drives.values()
        self.dynamics = self.rates = ClutchRates(self.drive, self.dynamics)
        self.let_go = 0.0  # sense in which a clutch that held begins to slip
        self.known = "holds" if self.drive.engaged(self.start) else "opens"

    # ---- how the clutch is --------------------------------------------------------------------------------------

    def _couple(self, time: float, row: Array, now: float) -> None:
        """Whether the clutch is open, slips or holds from here on."""
        slip, engaged = float(row[self.layout.slip]), self.drive.engaged(now)
        self.slips = float(np.sign(slip)) if engaged else 0.0
        if engaged and slip == 0.0:
            self.slips = self.let_go or self._overloaded(time, row, now)
        self.let_go = 0.0
        if self.rest is not None:
            self.rest = replace(self.rest, slips=self.slips)
        change = "opens" if not engaged else "slips" if self.slips else "holds"
        if change != self.known:
            turns = self.motion.system.turns(self.motion.names[0])
            figure = (slip, "rad/s" if turns else "m/s") if change == "slips" else (np.nan, "")
            self._note(time, f"clutch-{change}", *figure)
            self.known = change

    def _overloaded(self, time: float, row: Array, now: float) -> float:
        """The sense in which a clutch without slip begins to slip, 0 if it holds."""
        n = self.layout.coordinates
        sense, rests = (float(np.sign(row[n])) if self.motion.rests else 0.0), False
        if self.rest is not None and row[n] == 0.0:
            sense = Rest(self.motion, self.layout).sense(time, row, now)
            rests = sense == 0.0
        at = self.layout.moment(np.array([time]), row[:, None], sense, now)
        carried = float(self._carried(at, rests)[0])
        return float(np.sign(carried)) if abs(carried) > self._capacity else 0.0

    @property
    def _capacity(self) -> float:
        return self.drive.clutch * (1.0 + ROUNDING)

    def _carried(self, at: Moment, rests: bool) -> Array:
        """Effort through a clutch that holds, (lane,): the motor's, less what the rotor takes."""
        second = 0.0 * at.rate[0] if rests else self.dynamics.seconds(at)[0]
        shaft = self.drive.shaft(at.time, at.rate[0], at.integral[0], at.now)
        effort: Array = shaft - self.drive.inertia * self.drive.ratio * second
        return effort

    # ---- where that changes -------------------------------------------------------------------------------------

    def _values(self, stretch: Stretch) -> Callable[[Array], Array] | None:
        """What is left of the slip, or of the capacity of a clutch that holds."""
        if self.slips:
            return lambda times: self.slips * stretch.state(times)[[self.layout.slip]]
        if not self.drive.engaged(stretch.now):
            return None
        return lambda times: (self._capacity - np.abs(self._through(stretch, times)))[None]

    def _changed(self, crossing: Crossing, row: Array) -> float:
        """The slip becomes 0, or a clutch that holds carries its capacity."""
        if self.slips:
            row[self.layout.slip] = 0.0
        else:
            carried = self._through(self.solution.stretches[-1], np.array([crossing.time]))
            self.let_go = float(np.sign(carried[0]))
        return np.inf

    def _through(self, stretch: Stretch, times: Array) -> Array:
        """Effort through a clutch that holds at times of a step."""
        at = self.layout.moment(times, stretch.state(times), stretch.sense, stretch.now)
        return self._carried(at, stretch.resting)

    # ---- the steps ----------------------------------------------------------------------------------------------

    def _rest(self, time: float, row: Array, until: float, now: float) -> tuple[float, Array]:
        """Stay; the rotor goes on where the clutch is open or slips."""
        if not self.drive.loose(now, self.slips):
            return super()._rest(time, row, until, now)
        assert self.rest is not None
        if not self.solution.stretches or not self.solution.stretches[-1].resting:
            self._note(time, "rest")
        end = self.rest.until(time, row, until, now)
        self.resting = True
        try:
            return self._move(time, row, end, 0.0, now, None)[:2]
        finally:
            self.resting = False

    def _rate(self, sense: float, now: float, between: tuple[float, float]) -> Callable[[float, Array], Array]:
        rest = self.rest
        if not self.resting or rest is None:
            return super()._rate(sense, now, between)

        def rate(moment: float, numbers: Array) -> Array:
            self.solution.asked += 1
            at = self.moment(moment, numbers, 0.0, now)
            works = rest.powers(at)[:, 0] if rest.driven else np.zeros(len(WORKS))
            return self.layout.row(np.zeros(1), self.rates.resting(at, works))

        return rate

    def _failed(
        self, time: float, row: Array, sense: float, now: float, message: str | None
    ) -> tuple[float, Array, None]:
        """As without a clutch; of a mechanism that locks the rotor keeps its speed."""
        speed = float(row[self.layout.coordinates])
        time, row, _ = super()._failed(time, row, sense, now, message)
        row[self.layout.slip] += self.drive.ratio * (speed - float(row[self.layout.coordinates]))
        return time, row, None
