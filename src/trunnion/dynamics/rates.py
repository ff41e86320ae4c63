"""Rates of everything that is integrated in time, how it stands in one row of numbers, and the energy of a motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal, single
from trunnion.algebra.namespace import Number
from trunnion.dynamics.state import FreeMotion, Mode, Moment
from trunnion.dynamics.touching import Closed, Onset, pushes_of
from trunnion.solve.backward import Backward
from trunnion.solve.forward import Forward, Motion
from trunnion.solve.system import felt, law_of, law_parameters
from trunnion.solve.track import carried_on

Array = NDArray[np.float64]


# what is integrated to make the books: by the drivers (freed or not), loads and springs into the mechanism, to
# friction, and of joints in play to the contacts
WORKS = ("drive", "loads", "springs", "friction")
CONTACT = "contact"
CLUTCH = "clutch"  # lost in a clutch that slips


class Rates(NamedTuple):
    """Second derivatives (coordinate,), and after them the rates of what `Layout` has: of the controllers' integrals,
    deflections, a clutch's slip and works. sound: whether there is one acceleration; locked: whether friction has no
    solution.
    """

    second: Array
    others: Array
    sound: bool
    locked: bool = False


class Seen(NamedTuple):
    """Of every contact, (contact, lane): gap, m, its rate and slip, m/s, normal force and friction, N."""

    gap: Array
    rate: Array
    slip: Array
    normal: Array
    friction: Array


class Dynamics(Protocol):
    """What tells how a motion goes on: the rates at one moment and, of many lanes, the accelerations, (coordinate,
    lane), and the contacts."""

    def __call__(self, at: Moment) -> Rates: ...

    def seconds(self, at: Moment) -> Array: ...

    def look(self, at: Moment) -> Seen: ...


class Layout(NamedTuple):
    """Where what stands in a row: coordinates, rates, integrals of controllers, deflections, a clutch's slip, works."""

    coordinates: int
    bristles: int
    touching: bool = False
    clutched: bool = False

    @classmethod
    def of(cls, motion: FreeMotion) -> Layout:
        """The row of a free motion."""
        clutched = any(drive.clutched for drive in motion.drives.values())
        return cls(len(motion.names), len(motion.bristles), bool(motion.contacts), clutched)

    @property
    def works_named(self) -> tuple[str, ...]:
        """The works in a row."""
        return (*WORKS, *((CONTACT,) if self.touching else (CLUTCH,) if self.clutched else ()))

    @property
    def slip(self) -> int:
        """Where the slip of a clutch stands, before the works."""
        return 3 * self.coordinates + self.bristles

    @property
    def size(self) -> int:
        return self.slip + self.clutched + len(self.works_named)

    def moment(self, time: Array, rows: Array, mode: Mode | None = None) -> Moment:
        """The state of lanes, (number, lane)."""
        n, slip = self.coordinates, self.slip
        numbers = rows[:n], rows[n : 2 * n], rows[2 * n : 3 * n], rows[3 * n : slip], rows[slip : slip + self.clutched]
        return Moment(time, *numbers, *(mode or Mode()))

    def works(self, rows: Array) -> Array:
        """The works, (work, lane)."""
        return rows[self.slip + self.clutched :]


class Walks:
    """The rates by walks through the modules: works for every mechanism, and is what faster ways are held against."""

    def __init__(self, motion: FreeMotion) -> None:
        self.motion, self.layout = motion, Layout.of(motion)
        self._last: Array | None = None
        self._unknown = np.full(self.layout.size - 2 * self.layout.coordinates, np.nan)

    def __call__(self, at: Moment) -> Rates:
        """The rates; one lane."""
        motion = self.motion
        if not (np.all(np.isfinite(at.q)) and np.all(np.isfinite(at.rate))):  # of a step one of whose rates is unknown
            return Rates(np.full(self.layout.coordinates, np.nan), self._unknown, False)
        if motion.stays(at):
            nothing = np.zeros(self.layout.coordinates)
            return Rates(nothing, np.array(list(map(single, beside(motion, at, nothing, None)))), True)
        accelerated = motion.accelerate(at, self._last)
        if self._last is not None and not np.all(accelerated.converged & ~accelerated.turned):
            accelerated = motion.accelerate(at)  # the last may lie on the wrong side of where a reaction turns round
        if np.all(np.isfinite(accelerated.second)):
            self._last = accelerated.second
        sound = bool(np.all(accelerated.converged & ~accelerated.turned))
        locked = any(bool(np.any(np.less(settled.share, 1.0))) for settled in accelerated.back.settled)
        second = accelerated.second[:, 0]
        others = beside(motion, at._replace(onsets=accelerated.onsets), second, accelerated.back)
        return Rates(second, np.array(list(map(single, others))), sound, locked)

    def seconds(self, at: Moment) -> Array:
        """See `Dynamics`."""
        return np.zeros_like(at.q) if self.motion.stays(at) else self.motion.accelerate(at).second

    def look(self, at: Moment) -> Seen:
        """See `Dynamics`."""
        motion, onsets, lanes = self.motion, at.onsets, at.q.shape[1]
        if any(isinstance(onset, Closed) for onset in onsets):
            accelerated = motion.accelerate(at)
            walk, onsets = accelerated.back.walk, accelerated.onsets
        else:
            walk = motion.walk(at)
        rows = seen(motion, walk, onsets)
        return Seen(*(np.array([np.broadcast_to(number, lanes) for number in row]) for row in rows))


def seen(motion: FreeMotion, walk: Forward, onsets: Sequence[Onset]) -> list[list[Number]]:
    """The rows of `Seen`, of every contact."""
    pushes = pushes_of(motion.contacts, walk, onsets)
    states = [[state.gap, state.rate, state.slip, push.normal, push.friction] for state, push in pushes]
    return [[numbers[i] for numbers in states] for i in range(len(Seen._fields))]


WIDTH = 0.02  # rad, or of the size: from a change point to the first place at which rates are asked for
PLACES = np.array([-3.0, -2.0, -1.0, 1.0, 2.0, 3.0])  # in such widths
APART = 8.0  # widths to the next change point


@dataclass(frozen=True)
class Bridged:
    """Rates of one free coordinate, beside some of its places by the polynomial through those farther off.

    Where the links go on smoothly through a pose in which two assemblies meet, so do the rates, if nothing rubs. But
    the digits of the accelerations are lost there like the third power of the distance: the place of a pin that two
    links in line hold is known across them only as well as rounding over the distance.

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
    places = np.sort([single(system.drive(run.values, name, time)[0]) for time in times])
    span = single(system.span(run.values, name).peak) * run.cycle.duration if run.cycle.periodic else None
    gaps = np.diff(places if span is None else [*places, places[0] + span])
    width = min(WIDTH if system.turns(name) else WIDTH * motion.size, *(gap / APART for gap in gaps), np.inf)
    return Bridged(rates, list(places), span, width)


def beside(motion: FreeMotion, at: Moment, second: Sequence[Number] | Array, back: Backward | None) -> list[Number]:
    """Rates of the controllers' integrals, of the deflections of bristles, ż = v − d(v) z, m/s, of the slip of a
    clutch, and of the works, W. back: the forces; None while everything rests."""
    errors, slips, lost = list[Number](), list[Number](), list[Number]()
    works: list[Number] = [0.0] * len(WORKS)
    if back is not None:
        loads, touching = motion.system.mechanism.loads, pushes_of(motion.contacts, back.walk, at.onsets)
        works = [
            sum((effort * back.walk.rate(name) for name, effort in back.efforts.items()), 0.0),
            sum((power for name, power in back.load_powers.items() if name in loads), 0.0),
            sum((state.power for state in back.springs.values()), 0.0),
            sum((back.losses[joint] for joint in motion.system.joints), 0.0),
            *([sum((push.loss for _, push in touching), 0.0)] if touching else []),
        ]
    for i, drive in enumerate(motion.drives.values()):
        speed: Any = at.rate[i]
        if drive.loose(at.now, at.slips):
            rotor: Any = at.slip[0] + drive.ratio * at.rate[i]
            speed = rotor / drive.ratio
            spin = drive.spin(at.time, rotor, at.integral[i], at.now, at.slips)
            slips.append(spin - drive.ratio * second[i])
            lost.append(drive.carried(at.now, at.slips) * at.slip[0])
            works[0] = works[0] + lost[0]  # the motor's, of which the joint gets the rest
        elif drive.clutched:
            slips, lost = [0.0], [0.0]
        errors.append(drive.error(at.time, speed, at.integral[i], at.now))
    bristles = list[Number]()
    for joint, deflection in zip(motion.bristles, at.bristles, strict=True):
        law, slip = law_of(motion.system, joint), 0.0 if back is None else primal(back.contacts[joint][0].slip)
        assert law.relaxation is not None  # or it would have no bristles
        decay = law.relaxation(slip, **law_parameters(law, motion.values, joint))
        bristles.append(slip - decay * deflection)
    return [*errors, *bristles, *slips, *works, *lost]


def kinetic_energy(walk: Forward) -> Number:
    """T = ½ Σ (m v² + ωᵀ J ω), J.

    Worked out from the momenta, as the inertia loads of links that stand still and are accelerated at their velocities:
    so that a body is described once, by its inertia load.
    """
    algebra, system = walk.algebra, walk.system
    moved = {
        link: Motion(motion.frame, algebra.times(0.0, motion.twist), type(motion.acceleration)(*motion.twist))
        for link, motion in walk.motions.items()
    }
    still, energy = replace(walk, motions=moved), 0.0
    for link in system.mechanism.effective_links:
        if link == system.mechanism.fixed_link:
            continue
        mass, moment = walk.values[f"links.{link}.mass"], still.inertia_moment(link)
        centre = still.at(link, system.centre(walk.values, link))
        force = tuple(-mass * a for a in centre.acceleration)
        load = algebra.about(force, algebra.NO_MOMENT if moment is None else moment, centre.place)
        energy = energy - 0.5 * algebra.power(load, walk.motions[link].twist)
    return energy


def potential_energy(walk: Forward) -> Number:
    """−Σ m g·r, J: of gravity, against the origin of the ground."""
    system, energy = walk.system, 0.0
    gravity = system.vector(walk.values, "gravity")
    if not any(np.any(part) for part in gravity):
        return 0.0
    for link in system.mechanism.effective_links:
        if link != system.mechanism.fixed_link:
            place = walk.at(link, system.centre(walk.values, link)).place
            for g, coordinate in zip(gravity, place, strict=True):
                energy = energy - walk.values[f"links.{link}.mass"] * g * coordinate
    return energy
