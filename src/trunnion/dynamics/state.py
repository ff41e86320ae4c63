"""Accelerations of the free coordinates, from walks through the modules.

Free coordinates q accelerate so that the effort which the walk demands of every free driver is what its motor gives:
E(q, q̇, q̈, t) = T(q̇, q̈, t). Without friction E is affine in q̈; with it E is piecewise smooth, and the equations are
solved by Newton's method on the walks themselves: one lane for q̈ and one more for each coordinate. No mass matrix of
the whole mechanism is assembled, and nothing is solved that the analysis of a prescribed motion does not solve.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number
from trunnion.dynamics.followed import Followed, Snapshot, follows
from trunnion.dynamics.motor import Drive, drives
from trunnion.dynamics.touching import Contacts, Onset
from trunnion.errors import Finding, MechanismError
from trunnion.solve.backward import Backward, Given, Sense, solve
from trunnion.solve.forward import Assembly, Forward, forward
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.loads import LoadAction
from trunnion.solve.run import Run
from trunnion.solve.system import Cycle, System, Values, felt, freed, law_of, rubbing, sticking

__all__ = ["Accelerated", "FreeMotion", "Moment", "ahead", "repeated"]

Array = NDArray[np.float64]

ROUNDS = 30  # of Newton's method
SETTLED = 1e-11  # of the largest acceleration: where it ends
CLOSE = 1e-6  # a step of which the next is below rounding, for it converges to the square
FAR = 1e3  # times what is typical: an acceleration beyond which the step of the derivative was too short
BEYOND = 1e6  # times what is typical: an acceleration at which inertia is all there is
DIFFERENCE = 1e-4  # of the acceleration, by which the derivative is taken where E is not affine


class Moment(NamedTuple):
    """The state of some lanes: time, s, coordinates and rates (coordinate, lane), controllers' integrals likewise,
    deflections of bristles (bristle, lane), m. sense: of the motion where the speed is 0, +1 or −1, of one coordinate;
    now: a time within the stretch, which says what is switched on; onsets: of each contact of joints in play its speed
    of approach, m/s, None while it does not touch; senses: where several coordinates are free, in which sense each
    joint of `FreeMotion.resisted` slides, +1 or −1, 0 where it sticks; empty: it is as the speeds say. slip: speed of
    the rotor behind a clutch less that of the joint through the gear, (1, lane), rad/s or m/s; slips: sense in which
    the clutch slips, +1 or −1, 0 while it holds or is open.
    """

    time: Array
    q: Array
    rate: Array
    integral: Array
    bristles: Array
    sense: float = 0.0
    now: float = 0.0
    onsets: tuple[Onset, ...] = ()
    senses: tuple[int, ...] = ()
    slip: Array = np.empty((0, 1))
    slips: float = 0.0


class Accelerated(NamedTuple):
    """Second derivatives of the coordinates (coordinate, lane), the walk with them, and where there is no answer.

    back: lanes as asked for. turned: lanes in which more acceleration would take less effort: the mechanism locks
    itself under its inertia, so that there is no acceleration or there are several. converged: lanes that are solved.
    onsets: of contacts, with the forces of those that stay closed. shares: of what resists each joint of
    `FreeMotion.resisted`, (joint, lane), what acts: ±1 where it slides.
    """

    second: Array
    back: Backward
    turned: NDArray[np.bool_]
    converged: NDArray[np.bool_]
    onsets: tuple[Onset, ...] = ()
    shares: Array | None = None


@dataclass(frozen=True)
class FreeMotion:
    """A mechanism with free drivers, ready to be asked for its accelerations.

    run: prepared for the nominal cycle; drives: what drives the free coordinates, by name; assembly: of every module;
    passing: whether it goes on through change points, where it can; walked: how often forces were asked for by a walk.
    """

    run: Run
    drives: Mapping[str, Drive]
    assembly: Assembly
    method: FrictionMethod = field(default_factory=FrictionMethod)
    contacts: Contacts = field(default_factory=Contacts)
    passing: bool = False
    walked: list[int] = field(default_factory=lambda: [0], compare=False, repr=False)

    @classmethod
    def of(cls, run: Run, contacts: Contacts | None = None, passing: bool = False) -> Self:
        """The free motion of a prepared mechanism.

        Raises MechanismError where the links do not come back with the drivers, as of a nut, and no range says how far
        they go: what is known of the way is that of one period.
        """
        if run.cycle.advances:
            what = "the links do not come back with the driver, as a nut goes on along its thread"
            where, remedy = next(iter(run.system.mechanism.drivers)), "state how far it goes: range: [0 turn, 20 turn]"
            raise MechanismError(Finding(what, f"drivers.{where}.range", remedy))
        free = drives(run.system, run.values)
        assembly = follows(run, len(free) > 1, passing)
        return cls(run, free, assembly, contacts=contacts or Contacts(), passing=passing)

    @property
    def system(self) -> System:
        return self.run.system

    @property
    def values(self) -> Values:
        return self.run.values

    @property
    def cycle(self) -> Cycle:
        return self.run.cycle

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The free drivers."""
        return tuple(self.drives)

    @cached_property
    def bristles(self) -> tuple[str, ...]:
        """Joints whose friction has a memory: the deflection of its bristles."""
        system = self.system
        return tuple(name for name in rubbing(system) if law_of(system, name).relaxation is not None)

    @cached_property
    def sticking(self) -> tuple[str, ...]:
        """Joints whose friction, or a load that resists them, is an interval at rest."""
        return tuple(sticking(self.system))

    @cached_property
    def resisted(self) -> tuple[str, ...]:
        """Where several coordinates are free: joints that may stick, by friction, loads, brakes or losses of gears."""
        if len(self.names) == 1:
            return ()
        held = {name for name, drive in self.drives.items() if drive.brake or drive.efficiency < 1.0}
        held |= self.system.resisted.keys()
        held |= set(self.sticking) & set(felt(self.system, self.system.mechanism.parameter_set.nominal))
        return tuple(name for name in self.system.joints if name in held)

    @cached_property
    def rests(self) -> bool:
        """Whether the one free coordinate may rest in friction."""
        held = any(np.isfinite(drive.brake_from) or drive.efficiency < 1.0 for drive in self.drives.values())
        return len(self.names) == 1 and bool(self.sticking or held)

    @cached_property
    def affine(self) -> bool:
        """Whether efforts are affine in the accelerations."""
        return not rubbing(self.system) and all(drive.efficiency == 1.0 for drive in self.drives.values())

    @cached_property
    def unit(self) -> Array:
        """An acceleration typical of each coordinate, rad/s² or m/s²."""
        pace = max(float(np.ravel(primal(self.system.pace(self.values)))[0]), 1e-300)
        size = float(np.ravel(self.system.size(self.values))[0])
        return np.array([pace * pace * (1.0 if self.system.turns(name) else size) for name in self.names])

    @cached_property
    def trial(self) -> Array:
        """An acceleration of each coordinate by whose force its inertia is told, rad/s² or m/s².

        The typical one, or that of a fall where it is more, so that weights leave its digits.
        """
        size = float(np.ravel(self.system.size(self.values))[0])
        gravity = np.hypot.reduce([float(np.ravel(primal(g))[0]) for g in self.system.vector(self.values, "gravity")])
        fall = [gravity / (size if self.system.turns(name) else 1.0) for name in self.names]
        return np.maximum(self.unit, fall)

    @cached_property
    def meeting(self) -> tuple[int, ...]:
        """The modules of which two assemblies may meet on the way: the nominal cycle tells it of one driver alone."""
        if len(self.system.mechanism.drivers) == 1:
            return tuple(self.run.chosen.meetings)
        return tuple(number for number, module in enumerate(self.system.plan.modules) if module.rank > 1)

    def passes(self, number: int) -> bool:
        """Whether a module goes on through poses in which two of its assemblies meet: closed forms can."""
        return self.passing and bool(self.system.groups[number].BRANCHES)

    def change_point(self, number: int, coordinate: float) -> dict[str, Any]:
        """What is told of a motion that ends where two assemblies of a module meet, at a place of the first driver."""
        links = list(self.system.plan.modules[number].links)
        return {"driver": self.names[0], "coordinate": coordinate, "links": links}

    # ---- walks ------------------------------------------------------------------------------------------------

    def values_at(self, at: Moment, second: Array) -> Values:
        """The numbers of the mechanism with the motion of the free coordinates."""
        return freed(self.values, {name: (at.q[i], at.rate[i], second[i]) for i, name in enumerate(self.names)})

    def walk(self, at: Moment, second: Array) -> Forward:
        """Motion alone."""
        return forward(self.system, self.values_at(at, second), self.assembly, at.time)

    def margins(self, walk: Forward) -> list[Number]:
        """1/condition of every module of `meeting`, which is 0 where two of its assemblies meet."""
        return [1.0 / primal(self.system.groups[k].condition(walk.poses[k])) for k in self.meeting]

    def solve(
        self, at: Moment, second: Array, zero_slip: Mapping[str, Sense] | None = None, sliding: bool = False
    ) -> Backward:
        """Motion and forces. zero_slip, sliding: see `backward.Given`; of one coordinate what begins to move in its
        sense."""
        self.walked[0] += 1
        given = Given(
            self.beginning(at) if zero_slip is None else zero_slip,
            dict(zip(self.bristles, at.bristles, strict=True)),
            acting=self._acting(at.onsets),
            sliding=sliding,
            rests={joint: sense == 0 for joint, sense in zip(self.resisted, at.senses, strict=False)},
        )
        return solve(self.system, self.values_at(at, second), self.assembly, at.time, self.method, given)

    def _acting(self, onsets: Sequence[Onset]) -> Callable[[Forward], Iterable[tuple[str, LoadAction]]] | None:
        """What the contacts that touch do to the links."""
        if all(onset is None for onset in onsets):
            return None
        return lambda walk: self.contacts.actions(walk, onsets)

    def beginning(self, at: Moment, share: Number = 1.0) -> dict[str, Sense]:
        """The sense in which each joint that sticks is about to move, times a share; of several coordinates those in
        which joints slide."""
        if at.senses:
            return {joint: float(sense) for joint, sense in zip(self.resisted, at.senses, strict=True)}
        if len(self.names) != 1 or not self.sticking or not np.any(at.sense):
            return {}
        zero: Any = [0.0 * at.q[0]]
        rate: Any = [np.sqrt(self.trial[0]) + zero[0]]
        walk = self.walk(at._replace(rate=rate), zero)
        found: dict[str, Sense] = {}
        for joint in self.sticking:
            sign = np.where(walk.still(joint, self.system.turns(joint)), 0.0, np.sign(walk.speed(joint)))
            found[joint] = at.sense * share * sign
        return found

    # ---- the assembly by momentum -----------------------------------------------------------------------------

    @cached_property
    def followed(self) -> tuple[Followed, ...]:
        """The modules whose assembly is followed."""
        return tuple(one for one in self.assembly if isinstance(one, Followed))

    def step(self, at: Moment) -> None:
        """Go on from here: the assembly of the modules that are followed is this one from now on; one lane."""
        if self.followed:
            second = self.accelerate(at).second
            walk = self.walk(at, second)
            self.begin(Snapshot(float(at.time[0]), dict(walk.motions), tuple(walk.poses)))

    def begin(self, snapshot: Snapshot | None) -> None:
        """Follow the assembly from a snapshot."""
        for one in self.followed:
            one.snapshot = snapshot

    # ---- accelerations ----------------------------------------------------------------------------------------

    def driven(self, at: Moment, second: Any, senses: Mapping[str, Sense]) -> list[Number]:
        """What the motors give, less the brakes, of each coordinate. senses: shares of what resists the joints that
        stick, and senses of those that slide, where several coordinates are free."""
        efforts = list[Number]()
        for i, (name, own) in enumerate(self.drives.items()):
            rate, drive = at.rate[i], own.seen(at.now, at.slips)
            if at.senses and name in senses:
                efforts.append(drive.resisted(at.time, rate, second[i], at.integral[i], at.now, senses[name]))
                continue
            effort = drive.effort(at.time, rate, second[i], at.integral[i], at.now, at.sense)
            sense = np.where(rate != 0.0, np.sign(rate), at.sense)
            efforts.append(effort - sense * drive.braking(at.now))
        return efforts

    def given(self, at: Moment, second: Array, senses: Mapping[str, Sense] | None = None) -> Array:
        """The same of many lanes, (coordinate, lane)."""
        return np.array(self.driven(at, second, senses or {})).reshape(at.q.shape)

    def demanded(self, back: Backward, shape: tuple[int, ...]) -> Array:
        """Efforts that a walk demands of the free drivers, (coordinate, lane)."""
        found = [np.broadcast_to(primal(back.efforts[name]), shape[1:]) for name in self.names]
        return np.array(found, float).reshape(shape)

    def missing(self, at: Moment, second: Array, zero_slip: Mapping[str, Sense]) -> Array:
        """E − T, (coordinate, lane)."""
        back = self.solve(at, second, zero_slip, sliding=True)
        found: Array = self.demanded(back, at.q.shape) - self.given(at, second, zero_slip)
        return found

    def accelerate(self, at: Moment, guess: Array | None = None) -> Accelerated:
        """The accelerations at which every free driver is given what the walk demands; NaN where there are none."""
        count, lanes = at.q.shape
        second = self.begun(at) if guess is None else np.array(guess, float)
        turned, step = np.zeros(lanes, bool), np.full((count, lanes), np.inf)
        largest = np.maximum(np.max(np.abs(second), axis=0), 0.0)
        senses, before, last = self.beginning(at), second, second
        for _ in range(ROUNDS):
            miss, slopes = self._linearised(at, second, senses)
            turned = _turned(slopes)
            with np.errstate(all="ignore"):
                step = -_solved(slopes, miss)
            before, last, second = last, second, second + step
            largest = np.maximum(np.max(np.abs(second), axis=0), 1e-6 * np.min(self.unit))
            close = SETTLED if not self.affine else CLOSE
            if np.all(~np.isfinite(step) | (np.abs(step) <= close * largest)):
                break
            if self.affine and np.all(~np.isfinite(step) | (np.abs(step) <= FAR * self.unit[:, None])):
                break
            if np.all(~np.isfinite(step) | (np.abs(second - before) <= SETTLED * largest)):
                break  # to and fro: there is no solution on either side of where a reaction turns round
            if np.all(~np.isfinite(step) | (np.abs(step) <= CLOSE * DIFFERENCE * largest)):
                break
            back = self.solve(at, second, senses, sliding=True)  # most are there after one step, as this walk tells
            step = -_solved(slopes, self.demanded(back, at.q.shape) - self.given(at, second, senses))
            if np.all(np.abs(step) <= SETTLED * largest) and not np.any(turned):
                return Accelerated(second, back, turned, np.ones(lanes, bool), at.onsets)
        converged = np.all(np.isfinite(second) & (self.affine | (np.abs(step) <= 1e-8 * largest)), axis=0)
        second = np.where(turned, np.nan, second)
        return Accelerated(second, self.solve(at, second, senses, sliding=True), turned, converged, at.onsets)

    def begun(self, at: Moment) -> Array:
        """Where the search for the accelerations begins: at 0, on the side of it to which they are driven."""
        if self.affine:
            return np.zeros_like(at.q)
        return np.copysign(0.0, -self.missing(at, np.zeros_like(at.q), self.beginning(at)))

    def inertia(self, at: Moment) -> Array:
        """∂E/∂q̈, the mass matrix where efforts are affine in the accelerations, (equation, coordinate, lane)."""
        return self._linearised(at, np.zeros_like(at.q), self.beginning(at))[1]

    def far(self, second: Array) -> Array:
        """Accelerations far beyond some, one coordinate at a time, (coordinate, lane): along each, then against it."""
        size = BEYOND * np.maximum(self.unit, np.max(np.abs(second), axis=1))
        return np.hstack([np.diag(size), -np.diag(size)])

    def growth(self, at: Moment) -> Array:
        """det ∂E/∂q̈ over that without friction at the accelerations of `far` from none, (lane,); one lane of `at`.

        Where it is not above 0 friction grows faster with the acceleration than what drives it, and the mechanism locks
        itself under its inertia: no acceleration obeys, or several do (P. Painlevé, C. R. Acad. Sci. 121 (1895) 112).
        """
        far = self.far(np.zeros_like(at.q))
        many = repeated(at, far.shape[1])
        slopes = self._linearised(many, far, self.beginning(many))[1]
        still = at._replace(rate=0.0 * at.rate, sense=0.0, senses=(0,) * len(at.senses))
        none: dict[str, Sense] = dict.fromkeys((*self.resisted, *self.sticking), 0.0)
        mass = self._linearised(still, np.zeros_like(at.q), none)[1]
        stacks = [np.moveaxis(one * self.unit[None, :, None], -1, 0) for one in (slopes, mass)]
        found: Array = np.linalg.det(stacks[0]) / np.linalg.det(stacks[1])
        return found

    def _linearised(self, at: Moment, second: Array, senses: Mapping[str, Sense]) -> tuple[Array, Array]:
        """E − T (coordinate, lane) and its derivatives by the accelerations (equation, coordinate, lane)."""
        count, lanes = at.q.shape
        steps = self.unit[:, None] + np.zeros((count, lanes))
        if not self.affine:
            steps = ahead(second, steps)
        else:
            steps = np.maximum(np.maximum(steps, self.trial[:, None]), np.abs(second))
        tried = [second] + [second + np.where(np.arange(count)[:, None] == i, steps, 0.0) for i in range(count)]
        many = repeated(at, count + 1)
        wide: dict[str, Sense] = {
            joint: np.tile(sense, count + 1) if isinstance(sense, np.ndarray) else sense
            for joint, sense in senses.items()
        }
        found = self.missing(many, np.concatenate(tried, axis=1), wide).reshape(count, count + 1, lanes)
        slopes = (found[:, 1:] - found[:, :1]) / steps[None]
        miss: Array = found[:, 0]
        return miss, slopes


def ahead(second: Array, unit: Array) -> Array:
    """By how much accelerations are changed to tell a derivative: away from 0, where reactions may turn round."""
    return np.copysign(DIFFERENCE * np.maximum(np.abs(second), 1e-2 * unit), second)


def repeated(at: Moment, times: int) -> Moment:
    """The same state in more lanes."""
    q, rate, integral, bristles = (np.tile(part, (1, times)) for part in (at.q, at.rate, at.integral, at.bristles))
    return at._replace(time=np.tile(at.time, times), q=q, rate=rate, integral=integral, bristles=bristles)


def _solved(matrix: Array, right: Array) -> Array:
    """x of A x = b, (equation, coordinate, lane) and (equation, lane)."""
    if len(matrix) == 1:
        quotient: Array = right / matrix[0]
        return quotient
    found = np.full(right.shape, np.nan)
    sound = np.all(np.isfinite(matrix), axis=(0, 1)) & np.all(np.isfinite(right), axis=0)
    stack = np.moveaxis(matrix[..., sound], -1, 0)
    sound[sound] = np.abs(np.linalg.det(stack)) > 0
    stack = np.moveaxis(matrix[..., sound], -1, 0)
    if len(stack):
        found[:, sound] = np.linalg.solve(stack, right[:, sound].T[..., None])[..., 0].T
    return found


def _turned(slopes: Array) -> NDArray[np.bool_]:
    """Lanes in which the determinant of ∂E/∂q̈ is not positive, as it is for any mechanism without friction."""
    with np.errstate(all="ignore"):
        if len(slopes) == 1:
            return np.asarray(slopes[0, 0] <= 0.0)
        sound = np.all(np.isfinite(slopes), axis=(0, 1))
        found = np.zeros(slopes.shape[-1], bool)
        found[sound] = np.linalg.det(np.moveaxis(slopes[..., sound], -1, 0)) <= 0.0
        return found
