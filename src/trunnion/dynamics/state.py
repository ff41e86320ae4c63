"""Accelerations of the free coordinates, from walks through the modules.

Free coordinates q accelerate so that the effort which the walk demands of every free driver is what its motor gives:
E(q, q̇, q̈, t) = T(q̇, q̈, t). Without friction E is affine in q̈; with it E is piecewise smooth, and the equations are
solved by Newton's method on the walks themselves: one lane for q̈ and one more for each unknown. What holds - joints
that stick, contacts of rigid bodies that stay closed - adds its forces to the unknowns and its own accelerations, which
stay 0, to the equations. No mass matrix of the whole mechanism is assembled, and nothing is solved that the analysis of
a prescribed motion does not solve.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal, single
from trunnion.algebra.namespace import Number
from trunnion.dynamics.bordered import RANK, nearest, newton_step
from trunnion.dynamics.followed import Followed, Snapshot, follows
from trunnion.dynamics.motor import Drive, drives
from trunnion.dynamics.touching import Closed, Contact, Onset, actions_of
from trunnion.errors import Finding, MechanismError
from trunnion.solve.backward import Backward, Given, Sense, solve
from trunnion.solve.forward import Assembly, Forward, forward
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run
from trunnion.solve.system import System, Values, felt, freed, law_of, rubbing, sticking

Array = NDArray[np.float64]
Senses = dict[str, Sense]  # by joint
Pattern = dict[str, tuple[int, Sense]]  # by joint, see `FreeMotion.pattern`

ROUNDS = 30  # of Newton's method
SETTLED = 1e-11  # of the largest acceleration: where it ends
HALVINGS = 20  # of a step at rest whose end is no place
HELD = 1e-8  # of the largest: what is solved may miss as much
FAR = 1e3  # times what is typical: an acceleration beyond which the step of the derivative was too short
BEYOND = 1e6  # times what is typical: an acceleration at which inertia is all there is
DIFFERENCE = 1e-4  # of the acceleration, by which the derivative is taken where E is not affine


class Mode(NamedTuple):
    """What is so until something switches.

    now: a time within the stretch, s, which says what is switched on; onsets: of each contact of joints in play its
    speed of approach, m/s, None while it does not touch; senses: in which each joint of `FreeMotion.resisted` slides,
    +1 or −1, 0 where it sticks; empty: nothing resists, or it is as the speeds say; slips: sense in which the clutch
    slips, +1 or −1, 0 while it holds or is open.
    """

    now: float = 0.0
    onsets: tuple[Onset, ...] = ()
    senses: tuple[int, ...] = ()
    slips: float = 0.0


class Moment(NamedTuple):
    """The state of some lanes: time, s, coordinates and rates (coordinate, lane), controllers' integrals likewise,
    deflections of bristles (bristle, lane), m; slip: speed of the rotor behind a clutch less that of the joint through
    the gear, (1, lane), rad/s or m/s; then what `Mode` has.
    """

    time: Array
    q: Array
    rate: Array
    integral: Array
    bristles: Array
    slip: Array = np.empty((0, 1))
    now: float = 0.0
    onsets: tuple[Onset, ...] = ()
    senses: tuple[int, ...] = ()
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


class Held(NamedTuple):
    """The rows that hold at a moment: joints of `FreeMotion.resisted` that stick, contacts that stay closed, and of
    those contacts that stick the first on every wall, which is given the friction of all."""

    joints: Sequence[int] = ()
    closed: Sequence[int] = ()
    walls: Sequence[int] = ()


NONE = Held()


class Linear(NamedTuple):
    """At one moment: masses M (coordinate, coordinate), how rates of gaps and slips follow from those of the
    coordinates, W (2 contacts, coordinate), gaps first, what they are without, (2 contacts,), m/s, and the gaps, m,
    (contact,)."""

    mass: Array
    ways: Array
    driven: Array
    gaps: Array


@dataclass(frozen=True)
class FreeMotion:
    """A mechanism with free drivers, ready to be asked for its accelerations.

    run: prepared for the nominal cycle; drives: what drives the free coordinates, by name; assembly: of every module;
    walked: how often forces were asked for by a walk.
    """

    run: Run
    drives: Mapping[str, Drive]
    assembly: Assembly
    method: FrictionMethod = field(default_factory=FrictionMethod)
    contacts: tuple[Contact, ...] = ()
    walked: list[int] = field(default_factory=lambda: [0], compare=False, repr=False)

    @classmethod
    def of(cls, run: Run, contacts: tuple[Contact, ...] = ()) -> Self:
        """The free motion of a prepared mechanism.

        Raises MechanismError where the links do not come back with the drivers, as of a nut, and no range says how far
        they go: what is known of the way is that of one period.
        """
        if run.cycle.advances:
            what = "the links do not come back with the driver, as a nut goes on along its thread"
            where, remedy = next(iter(run.system.mechanism.drivers)), "state how far it goes: range: [0 turn, 20 turn]"
            raise MechanismError(Finding(what, f"drivers.{where}.range", remedy))
        free = drives(run.system, run.values)
        return cls(run, free, follows(run, len(free) > 1), contacts=contacts)

    @property
    def system(self) -> System:
        return self.run.system

    @property
    def values(self) -> Values:
        return self.run.values

    @cached_property
    def size(self) -> float:
        """A typical length, m."""
        return single(self.system.size(self.values))

    @cached_property
    def pace(self) -> float:
        """A typical angular speed, rad/s."""
        return single(self.system.pace(self.values))

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
    def several(self) -> bool:
        """Whether several coordinates are free."""
        return len(self.names) > 1

    @cached_property
    def resisted(self) -> tuple[str, ...]:
        """Joints that may stick, by friction, loads, brakes or losses of gears; where one coordinate is free its own
        joint stands for all, for they rest with it."""
        drives = self.drives.items()
        if not self.several:
            braked = any(np.isfinite(drive.brake_from) or drive.efficiency < 1.0 for _, drive in drives)
            return self.names if self.sticking or braked else ()
        resisting = {name for name, drive in drives if drive.brake or drive.efficiency < 1.0}
        resisting |= self.system.resisted.keys()
        resisting |= set(self.sticking) & set(felt(self.system, self.system.mechanism.parameter_set.nominal))
        return tuple(name for name in self.system.joints if name in resisting)

    def rests(self, at: Moment) -> bool:
        """Whether the one free coordinate rests in what resists it."""
        return not self.several and bool(_sticking_rows(at))

    def stays(self, at: Moment) -> bool:
        """Whether everything rests: no driver moves other links meanwhile."""
        return self.rests(at) and len(self.system.mechanism.drivers) == 1

    @cached_property
    def affine(self) -> bool:
        """Whether efforts are affine in the accelerations."""
        return not rubbing(self.system) and all(drive.efficiency == 1.0 for drive in self.drives.values())

    @cached_property
    def unit(self) -> Array:
        """An acceleration typical of each coordinate, rad/s² or m/s²."""
        return self._typical(self.names)

    @cached_property
    def typical(self) -> Array:
        """An acceleration typical of each joint that may stick, rad/s² or m/s²."""
        return self._typical(self.resisted)

    def _typical(self, joints: Sequence[str]) -> Array:
        pace = max(self.pace, 1e-300)
        return np.array([pace * pace * (1.0 if self.system.turns(name) else self.size) for name in joints])

    @cached_property
    def force(self) -> float:
        """A typical force, N."""
        mass = 0.0
        for link in self.system.mechanism.effective_links:
            inertia = self.values.get(f"links.{link}.inertia", 0.0)  # in space it is told by axes
            mass += single(self.values.get(f"links.{link}.mass", 0.0)) + single(inertia) / self.size**2
        return max(mass * self.size * self.pace * self.pace, 1e-300)

    @cached_property
    def trial(self) -> Array:
        """An acceleration of each coordinate by whose force its inertia is told, rad/s² or m/s².

        The typical one, or that of a fall where it is more, so that weights leave its digits.
        """
        gravity = np.hypot.reduce([single(g) for g in self.system.vector(self.values, "gravity")])
        fall = [gravity / (self.size if self.system.turns(name) else 1.0) for name in self.names]
        return np.maximum(self.unit, fall)

    @cached_property
    def meeting(self) -> tuple[int, ...]:
        """The modules of which two assemblies may meet on the way: the nominal cycle tells it of one driver alone."""
        if len(self.system.mechanism.drivers) == 1:
            return tuple(self.run.chosen.meetings)
        return tuple(number for number, module in enumerate(self.system.plan.modules) if module.rank > 1)

    def passes(self, number: int) -> bool:
        """Whether a module goes on through poses in which two of its assemblies meet, as the file has it."""
        if len(self.system.mechanism.drivers) == 1:
            met = self.run.chosen.meetings.get(number)
            return met is not None and met.smooth
        followed = self.assembly[number]
        return isinstance(followed, Followed) and followed.passing

    def change_point(self, number: int, coordinate: float) -> dict[str, Any]:
        """What is told of a motion that ends where two assemblies of a module meet, at a place of the first driver."""
        links = list(self.system.plan.modules[number].links)
        return {"driver": self.names[0], "coordinate": coordinate, "links": links}

    # ---- walks ------------------------------------------------------------------------------------------------

    def values_at(self, at: Moment, second: Array) -> Values:
        """The numbers of the mechanism with the motion of the free coordinates."""
        return freed(self.values, {name: (at.q[i], at.rate[i], second[i]) for i, name in enumerate(self.names)})

    def walk(self, at: Moment, second: Array | None = None) -> Forward:
        """Motion alone, without accelerations if none are given."""
        second = np.zeros_like(at.q) if second is None else second
        return forward(self.system, self.values_at(at, second), self.assembly, at.time)

    def margins(self, walk: Forward) -> list[Number]:
        """1/condition of every module of `meeting`, which is 0 where two of its assemblies meet."""
        return [1.0 / primal(self.system.groups[k].condition(walk.poses[k])) for k in self.meeting]

    def solve(self, at: Moment, second: Array, senses: Mapping[str, Sense], sliding: bool = False) -> Backward:
        """Motion and forces. senses, sliding: see `backward.Given`."""
        self.walked[0] += 1
        touches = any(onset is not None for onset in at.onsets)
        given_state = Given(
            senses,
            dict(zip(self.bristles, at.bristles, strict=True)),
            acting=(lambda walk: actions_of(self.contacts, walk, at.onsets)) if touches else None,
            sliding=sliding and not self.rests(at),
            rests=dict(zip(self.resisted, (sense == 0 for sense in at.senses), strict=False)) if self.several else {},
        )
        return solve(self.system, self.values_at(at, second), self.assembly, at.time, self.method, given_state)

    def pattern(self, at: Moment) -> dict[str, tuple[int, Sense]]:
        """By joint the row of `resisted` with which it sticks or slides, and the sense in which it moves where that row
        moves forward; none where the senses are not known."""
        if self.several or not at.senses:
            return {joint: (k, 1.0) for k, joint in enumerate(self.resisted if at.senses else ())}
        if not self.sticking:
            return {self.names[0]: (0, 1.0)}
        zero: Any = [0.0 * at.q[0]]
        rate: Any = [np.sqrt(self.trial[0]) + zero[0]]
        walk = self.walk(at._replace(rate=rate), zero)
        signs: dict[str, tuple[int, Sense]] = {self.names[0]: (0, 1.0)}
        for joint in self.sticking:
            sign = np.where(walk.still(joint, self.system.turns(joint)), 0.0, np.sign(walk.speed(joint)))
            signs[joint] = (0, sign)
        return signs

    def senses(self, at: Moment, pattern: Pattern | None = None, shares: Sequence[Any] | None = None) -> Senses:
        """By joint its sense, times the share of what resists it that acts. shares: of every row, else the senses."""
        shares = at.senses if shares is None else shares
        return {joint: shares[k] * sign for joint, (k, sign) in (pattern or self.pattern(at)).items()}

    def excess(self, at: Moment) -> Array:
        """By how much what drives the one free coordinate at rest exceeds the efforts at which it would break away
        forward and backward, N m or N, (2, lane); −inf where friction has no solution: it locks that way."""
        zero, excess = np.zeros_like(at.q), np.empty((2, at.q.shape[1]))
        pattern = self.pattern(at._replace(senses=(1,)))
        with np.errstate(all="ignore"):
            for k, sense in enumerate((1, -1)):
                begins = at._replace(senses=(sense,))
                senses = self.senses(begins, pattern)
                demanded = np.asarray(primal(self.solve(begins, zero, senses).efforts[self.names[0]]), float)
                miss = sense * (self.given(begins, zero, senses)[0] - demanded)
                excess[k] = np.where(np.isfinite(demanded), miss, -np.inf)
        return excess

    # ---- the assembly by momentum -----------------------------------------------------------------------------

    @cached_property
    def followed(self) -> tuple[Followed, ...]:
        """The modules whose assembly is followed."""
        return tuple(assembly for assembly in self.assembly if isinstance(assembly, Followed))

    def step(self, at: Moment) -> None:
        """Go on from here: the assembly of the modules that are followed is this one from now on; one lane."""
        if self.followed:
            second = self.accelerate(at).second
            walk = self.walk(at, second)
            self.begin(Snapshot(float(at.time[0]), dict(walk.motions), tuple(walk.poses)))

    def begin(self, snapshot: Snapshot | None) -> None:
        """Follow the assembly from a snapshot."""
        for follower in self.followed:
            follower.snapshot = snapshot

    # ---- accelerations ----------------------------------------------------------------------------------------

    def driven(self, at: Moment, second: Any, senses: Mapping[str, Sense]) -> list[Number]:
        """What the motors give, less the brakes, of each coordinate. senses: of `senses`."""
        return [
            drive.seen(at.now, at.slips).effort(
                at.time, at.rate[i], second[i], at.integral[i], at.now, senses.get(name)
            )
            for i, (name, drive) in enumerate(self.drives.items())
        ]

    def given(self, at: Moment, second: Array, senses: Mapping[str, Sense]) -> Array:
        """The same of many lanes, (coordinate, lane)."""
        return np.array(self.driven(at, second, senses)).reshape(at.q.shape)

    def accelerate(self, at: Moment, guess: Array | None = None, pulls: Array | None = None) -> Accelerated:
        """The accelerations at which every free driver is given what the walk demands, with what holds the rows that
        hold; NaN where there are none. pulls: relative accelerations that the joints that stick are to have, (joint
        that sticks, 1), rad/s² or m/s²; none if not given.

        Where the search ends on a side of where a reaction turns round on which there is no answer, or on which more
        acceleration takes less effort, it is begun from far away on other sides.
        """
        accelerated = self.searched(at, guess, pulls)
        left = accelerated.turned | (~accelerated.converged & (accelerated.shares is None))
        if self.affine or not np.any(left):
            return accelerated
        second = np.nan_to_num(accelerated.second)
        for start in self.far(second).T:
            other = self.searched(at, np.where(left, start[:, None], second), pulls)
            better = left & other.converged & ~other.turned
            second = np.where(better, other.second, second)
            left &= ~better
            if not np.any(left):
                return self.searched(at, second, pulls)
        return accelerated

    def searched(self, at: Moment, guess: Array | None = None, pulls: Array | None = None) -> Accelerated:
        """See `accelerate`, from one place."""
        active, pattern, (count, lanes) = self.held(at), self.pattern(at), at.q.shape
        unit, typical = self._units(active)
        joints = slice(len(unit) - len(active.joints), None)
        numbers = np.zeros((len(unit), lanes))
        numbers[:count] = self._begun(at, pattern) if guess is None else guess
        pulls = np.zeros((len(active.joints), 1)) if pulls is None else pulls / typical
        last = before = numbers
        exact = self.affine and not active.joints
        for _ in range(ROUNDS):
            missed, slopes = self._linearised(at, numbers, active, pattern)
            slopes = slopes * unit
            missed[joints], slopes[joints] = missed[joints] / typical - pulls, slopes[joints] / typical[:, None]
            step, turned = newton_step(slopes, missed, numbers[joints])
            before, last, numbers = last, numbers, numbers + step * unit
            missed, back, onsets = self._missed(at, numbers, active, pattern)
            if self.rests(at):  # beyond a share of 1 friction may have no solution: nearer
                for _ in range(HALVINGS):
                    if not np.any(gone := np.any(np.isnan(missed), axis=0) & np.all(np.isfinite(step), axis=0)):
                        break
                    step = np.where(gone, 0.5 * step, step)
                    numbers = last + step * unit
                    missed, back, onsets = self._missed(at, numbers, active, pattern)
            largest = np.maximum(np.max(np.abs(numbers / unit), axis=0), 1e-6)
            missed[joints] = missed[joints] / typical - pulls
            rest = newton_step(slopes, missed, numbers[joints])[0]  # most are there after one step, as this walk tells
            if np.all(~np.isfinite(rest) | (np.abs(rest) <= SETTLED * largest)) and not np.any(turned):
                break
            if np.all(~np.isfinite(step) | (np.abs(step) <= (FAR if exact else SETTLED * largest))):
                break
            if np.all(~np.isfinite(step) | (np.abs(numbers - before) / unit <= SETTLED * largest)):
                break  # to and fro: there is no solution on either side of where a reaction turns round
        converged = np.all(np.isfinite(numbers) & (exact | (np.abs(rest) <= HELD * largest)), axis=0)
        able = np.max(np.abs(slopes[:count, joints]), axis=0) > 0.0  # others have nothing to be held by
        converged &= np.all(np.abs(missed[joints]) <= HELD * np.maximum(np.where(able, 1.0, 1e-6), largest), axis=0)
        numbers = np.where(turned, np.nan, numbers)
        if active.closed:
            onsets = self.shared(self.forced(at.onsets, numbers[count : joints.start], active), active.walls)
        if active.walls:
            back = self.solve(at._replace(onsets=onsets), numbers[:count], self.senses(at, pattern), sliding=True)
        shares = None
        if active.joints:
            shares = np.repeat(np.array(at.senses, float)[:, None], lanes, axis=1)
            shares[list(active.joints)] = numbers[joints]
        return Accelerated(numbers[:count], back, turned, converged, onsets, shares)

    def held(self, at: Moment) -> Held:
        """The rows that hold."""
        closed = [k for k, onset in enumerate(at.onsets) if isinstance(onset, Closed)]
        walls = {self.contacts[k].surface: k for k in reversed(closed) if _sticks(at.onsets[k])}
        return Held(_sticking_rows(at), closed, list(walls.values()))

    def _units(self, active: Held) -> tuple[Array, Array]:
        """What is typical of the unknowns, and of the accelerations of the joints that stick, (row, 1)."""
        forces = np.full(len(active.closed) + len(active.walls), self.force)
        unit = np.concatenate([self.unit, forces, np.ones(len(active.joints))])
        return unit[:, None], self.typical[list(active.joints)][:, None]

    def _begun(self, at: Moment, pattern: Pattern) -> Array:
        """Where the search for the accelerations begins: at 0, on the side of it to which they are driven."""
        second = np.zeros_like(at.q)
        return second if self.affine else np.copysign(0.0, -self._missed(at, second, NONE, pattern)[0])

    def _missed(
        self, at: Moment, numbers: Array, active: Held, pattern: Pattern
    ) -> tuple[Array, Backward, tuple[Onset, ...]]:
        """E − T, and the accelerations of gaps, slips and joints that are to be 0, (equation, lane); the walk, and the
        contacts with their forces."""
        count, lanes = at.q.shape
        second, forces, shares = np.split(numbers, [count, len(numbers) - len(active.joints)])
        of_rows: list[Any] = list(at.senses)
        for k, share in zip(active.joints, shares, strict=True):
            of_rows[k] = share
        rows, back, onsets = self.misses(at, second, forces, active, self.senses(at, pattern, of_rows))
        missed = np.array([np.broadcast_to(primal(row), lanes) for row in rows], float)
        if active.joints:
            missed = np.vstack([missed, self.pulls(back.walk, lanes)[list(active.joints)]])
        return missed, back, onsets

    def misses(
        self, at: Moment, second: Any, forces: Any, active: Held, senses: Senses
    ) -> tuple[list[Number], Backward, tuple[Onset, ...]]:
        """E − T of every free coordinate, and the accelerations of gaps and slips that closed contacts keep at 0; the
        walk, and the contacts with their forces."""
        onsets = self.forced(at.onsets, forces, active) if active.closed else at.onsets
        back = self.solve(at._replace(onsets=onsets), second, senses, sliding=True)
        efforts = zip(self.names, self.driven(at, second, senses), strict=True)
        moved = {k: self.contacts[k].accelerations(back.walk) for k in active.closed}
        rows: list[Number] = [back.efforts[name] - effort for name, effort in efforts]
        return [*rows, *(moved[k][0] for k in active.closed), *(moved[k][1] for k in active.walls)], back, onsets

    def _linearised(self, at: Moment, numbers: Array, active: Held, pattern: Pattern) -> tuple[Array, Array]:
        """What is missed (equation, lane), and its derivatives by the unknowns (equation, unknown, lane)."""
        (size, lanes), count = numbers.shape, len(at.q)
        if self.affine:
            steps = np.maximum(self._units(active)[0], np.abs(numbers))
            steps[:count] = np.maximum(steps[:count], self.trial[:, None])
        else:  # away from 0, where reactions may turn round
            least = 1e-2 * self._units(active)[0]
            least[count:] *= 1e2
            steps = np.copysign(DIFFERENCE * np.maximum(np.abs(numbers), least), numbers)
        tried = [numbers, *(numbers + np.where(np.arange(size)[:, None] == i, steps, 0.0) for i in range(size))]
        wide: Pattern = {
            joint: (k, np.tile(sign, size + 1) if isinstance(sign, np.ndarray) else sign)
            for joint, (k, sign) in pattern.items()
        }
        missed = self._missed(repeated(at, size + 1), np.concatenate(tried, axis=1), active, wide)[0]
        missed = missed.reshape(size, size + 1, lanes)
        return missed[:, 0].copy(), (missed[:, 1:] - missed[:, :1]) / steps[None]

    # ---- inertia --------------------------------------------------------------------------------------------------

    def inertia(self, at: Moment) -> Array:
        """∂E/∂q̈, the mass matrix where efforts are affine in the accelerations, (equation, coordinate, lane)."""
        return self._linearised(at, np.zeros_like(at.q), NONE, self.pattern(at))[1]

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
        slopes = self._linearised(many, far, NONE, self.pattern(many))[1]
        still = at._replace(rate=0.0 * at.rate, senses=(0,) * len(at.senses))
        frictionless: Pattern = dict.fromkeys((*self.resisted, *self.sticking), (0, 0.0)) if at.senses else {}
        mass = self._linearised(still, np.zeros_like(at.q), NONE, frictionless)[1]
        stacks = [np.moveaxis(matrix * self.unit[None, :, None], -1, 0) for matrix in (slopes, mass)]
        growth: Array = np.linalg.det(stacks[0]) / np.linalg.det(stacks[1])
        return growth

    # ---- joints that may stick ------------------------------------------------------------------------------------

    def speeds(self, walk: Forward, lanes: int) -> Array:
        """Relative speeds of the joints that may stick, (joint, lane), rad/s or m/s."""
        return self._of_joints([walk.rates(name) for name in self.resisted], lanes)

    def pulls(self, walk: Forward, lanes: int) -> Array:
        """Their relative accelerations, (joint, lane), rad/s² or m/s²."""
        return self._of_joints([walk.second_rates(name) for name in self.resisted], lanes)

    def _of_joints(self, pairs: Sequence[tuple[object, object]], lanes: int) -> Array:
        numbers = [np.broadcast_to(primal(pair[0 if self.system.turns(name) else 1]), lanes)
                   for name, pair in zip(self.resisted, pairs, strict=True)]  # fmt: skip
        return np.array(numbers, float).reshape(len(numbers), lanes)

    def ways(self, at: Moment) -> tuple[Array, Array]:
        """How relative speeds follow from the rates, (joint, coordinate), and these speeds, (joint,), all by what is
        typical; one lane."""
        ways, driven = _differences(self.speeds(self._by_rates(at), len(self.names) + 1))
        slow = np.sqrt(self.typical)
        return ways / slow[:, None] * np.sqrt(self.unit), (driven + ways @ at.rate[:, 0]) / slow

    def stopped(self, at: Moment, sticks: Sequence[int]) -> Array:
        """Rates after joints begin to stick, (coordinate,), beside contacts that stay closed: the momentum of what
        stays free is kept, and energy only falls; one lane."""
        (ways, speeds), scale, active = self.ways(at), np.sqrt(self.unit), self.held(at)
        ways, speeds = ways[list(sticks)], speeds[list(sticks)]
        if active.closed:
            linear, rows = self.linear(at), [*active.closed, *(len(at.onsets) + k for k in active.walls)]
            speed = self.size * self.pace
            ways = np.vstack([ways, linear.ways[rows] * scale / speed])
            speeds = np.concatenate([speeds, (linear.driven + linear.ways @ at.rate[:, 0])[rows] / speed])
        mass = self._mass(at) * scale * scale[:, None]
        rates: Array = at.rate[:, 0] - scale * nearest(mass, ways, speeds, RANK)
        return rates

    # ---- contacts of rigid bodies -----------------------------------------------------------------------------------

    def forced(self, onsets: Sequence[Onset], forces: Sequence[Any] | Array, active: Held) -> tuple[Onset, ...]:
        """The contacts with their forces: normal ones, then along the tangent of those that stick."""
        forced = list(onsets)
        for row, k in enumerate(active.closed):
            onset = forced[k]
            assert isinstance(onset, Closed)
            if k in active.walls:
                friction = forces[len(active.closed) + active.walls.index(k)]
            elif _sticks(onset):  # of those that stick on one wall the first is given all
                friction = 0.0 * forces[row]
            else:
                friction = -self.contacts[k].coefficient * forces[row] * onset.sense
            forced[k] = Closed(onset.sense, forces[row], friction)
        return tuple(forced)

    def shared(self, onsets: Sequence[Onset], walls: Sequence[int]) -> tuple[Onset, ...]:
        """What holds on one wall, shared out by the normal forces."""
        shared = list(onsets)
        for first in walls:
            surface = self.contacts[first].surface
            forces = {k: onset for k, onset in enumerate(onsets) if isinstance(onset, Closed) and _sticks(onset)
                      and self.contacts[k].surface == surface}  # fmt: skip
            normal = sum(onset.normal for onset in forces.values())
            friction = sum(onset.friction for onset in forces.values())
            for k, onset in forces.items() if len(forces) > 1 else ():
                shared[k] = Closed(0, onset.normal, friction * onset.normal / normal)
        return tuple(shared)

    def linear(self, at: Moment) -> Linear:
        """What impulses come to, at one moment: friction in other joints takes no impulses."""
        walk = self._by_rates(at)
        states = [contact.state(walk) for contact in self.contacts]
        gaps = np.array([state.gap[0] for state in states], float)
        rates = np.array([state.rate for state in states] + [state.slip for state in states], float)
        return Linear(self._mass(at), *_differences(rates), gaps)

    def _mass(self, at: Moment) -> Array:
        """∂E/∂q̈ without friction, (equation, coordinate); one lane."""
        bare = at._replace(rate=0.0 * at.rate, onsets=(None,) * len(at.onsets), senses=(0,) * len(self.resisted))
        return self.inertia(bare)[:, :, 0]

    def _by_rates(self, at: Moment) -> Forward:
        """Walks at one moment without rates, then with the unit rate of each coordinate."""
        count = len(self.names)
        many = repeated(at, count + 1)._replace(rate=np.eye(count, count + 1, 1))
        return self.walk(many)


def _differences(speeds: Array) -> tuple[Array, Array]:
    """How speeds follow from the rates, (speed, coordinate), and what they are without, (speed,), see `_by_rates`."""
    return speeds[:, 1:] - speeds[:, :1], speeds[:, 0]


def _sticking_rows(at: Moment) -> list[int]:
    """Rows that stick; a sense that is recorded is that of one that slides."""
    return [k for k, sense in enumerate(at.senses) if isinstance(sense, int) and sense == 0]


def _sticks(onset: Onset) -> bool:
    """Whether a closed contact does."""
    return isinstance(onset, Closed) and onset.sense == 0


def repeated(at: Moment, times: int) -> Moment:
    """The same state in more lanes."""
    q, rate, integral, bristles, slip = (np.tile(part, (1, times)) for part in at[1:6])
    return at._replace(time=np.tile(at.time, times), q=q, rate=rate, integral=integral, bristles=bristles, slip=slip)
