"""Where the pins lie in their holes over the cycle: seats that are given, and those that the reactions press them into.

A seat and the reactions depend on each other: the seat moves the links by some ρ/l of their size, the reactions change
by as much, and so does the seat. So both are iterated at any time by itself, from the loads of pins in the middle
(`end_loads`); the reactions are those of pins held in their seats. Between the places at which a load jumps, a joint
turns round or a pin crosses its hole, the offsets are smooth: they are courses, found once. How fast the seats travel,
and with them the links, are derivatives of these.

Held pins take what resists a joint in the sense in which it moves without play. Where the travel of the pins turns that
sense round, for the little while before or after the joint does, no seat agrees with its own friction.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from trunnion.algebra.course import FIT, ORDER, POINTS, Accuracy, Courses
from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.namespace import Number
from trunnion.algebra.nested import each, flat
from trunnion.joints.clearance import pressed, turned_by_friction
from trunnion.solve import forward as kinematics
from trunnion.solve.backward import Backward, Sense
from trunnion.solve.end_loads import NO_LOAD, EndLoads, end_loads, loads_of, reactions
from trunnion.solve.forward import Travel
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.switches import accuracy_of, breaks_between
from trunnion.solve.system import Values

if TYPE_CHECKING:
    from trunnion.solve.run import Run

__all__ = ["ROUNDS", "SETTLED", "UNSETTLED", "Halt", "Seated", "Seating", "seating_of"]

ROUNDS = 12  # most of the iteration
EXACT = 1e-12  # change that one more round would make of a seat, of its clearance, at which it has settled
TOLERANCE = 1e-6  # likewise, beyond which it has not, however many the rounds
SETTLED, FLOATING, UNSETTLED, UNKNOWN = range(4)  # states of the courses
RESOLVED = Accuracy(1e-10, 1e-10, shortest=1e-6, rounds=12)  # second derivatives of offsets lose four digits
IDLE = 1e-3  # of the largest load of the cycle: positions with less are like those without
ASIDE, MOST = 0.5, 3.0  # cosine by which the travel of a pin may turn its load, and how many times that it may change it
SIGNS = 3  # of every end
ROUNDING = 1e-9  # of load and offset: a load that points away from the wall, not along it but for rounding

Array = NDArray[np.float64]
Vector = tuple[Number, ...]


@dataclass(frozen=True)
class Seated:
    """Pins in their seats at some times.

    back: motion and forces, as the pins travel; offsets: by the names of `shifts`, m; states: how the seats came to be;
    sticks: where the travel of the seats turns round the sense of a joint.
    """

    back: Backward
    offsets: dict[str, Array]
    states: NDArray[np.intp]
    sticks: NDArray[np.bool_]

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Where every pin has settled and presses against its wall."""
        return np.asarray((self.states != FLOATING) & (self.states != UNSETTLED))


class Halt(NamedTuple):
    """A time, s, from and to, in which the pin of a joint cannot travel as its seat does: its load does not hold it."""

    joint: str
    low: float
    high: float


@dataclass(frozen=True)
class Seating:
    """The seats of a run over its cycle.

    given: offsets that are stated; loads: of pins in the middle; courses: offsets of the pins that loads seat, m, by
    `paths`, then what their travel adds to the twist and to the acceleration of each of `links`, None if all are
    stated; halts: in which pins are held, for they cannot travel so; rounds: most that any seat of a panel took, and the
    change, of its clearance, that one more would make.
    """

    run: Run
    method: FrictionMethod
    given: dict[str, float]
    loads: EndLoads
    courses: Courses | None = None
    paths: Sequence[str] = ()
    links: Sequence[str] = ()
    halts: Sequence[Halt] = ()
    rounds: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, np.intp))
    change: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def breaks(self) -> Array:
        """Times, s, at which seats or their rates may jump."""
        halts = [time for halt in self.halts for time in halt[1:]]
        return np.array(halts) if self.courses is None else np.concatenate([self.courses.breaks, halts])

    @property
    def gaps(self) -> Array:
        """Times, s, from and to, in which a pin does not lie at its wall; (2, gap)."""
        return np.concatenate([self.loads.gaps, np.array([halt[1:] for halt in self.halts], float).reshape(-1, 2).T], 1)

    def at(self, time: Array, method: FrictionMethod | None = None) -> Seated:
        """Motion and forces at times, s, with every pin in its seat; method: that of the seats if not given."""
        offsets, travel = self.offsets(time), self._travel(time)
        back = self.run.at(self._within(time), offsets, method or self.method, travel=travel)
        return Seated(back, offsets, self.states(time), self._sticks(back, time))

    def offsets(self, time: Array) -> dict[str, Array]:
        """Where the pins lie at times, s, m, by the names of `shifts`."""
        found = {path: np.full(time.shape, number) for path, number in self.given.items()}
        if self.courses is None:
            return found
        return found | dict(zip(self.paths, np.nan_to_num(self._rows(time)), strict=False))

    def states(self, time: Array) -> NDArray[np.intp]:
        """How the seats of times, s, came to be."""
        if self.courses is None:
            return np.full(time.shape, SETTLED)
        states: NDArray[np.intp] = self.courses.states[self.courses.panel(self._within(time))]
        return np.where(self._halted(time) & (states == SETTLED), FLOATING, states)

    def _halted(self, time: Array) -> NDArray[np.bool_]:
        """At which times, s, a pin is held."""
        halted, within = np.zeros(time.shape, bool), self._within(time)
        for _, low, high in self.halts:
            halted |= (low < within) & (within < high)
        return halted

    def iterated(self, time: Array) -> tuple[NDArray[np.intp], Array]:
        """Rounds that the seats about times, s, took, and the change of one more, of the clearance."""
        if self.courses is None:
            return np.zeros(time.shape, np.intp), np.zeros(time.shape)
        panel = self.courses.panel(self._within(time))
        return self.rounds[panel], self.change[panel]

    def _within(self, time: Array) -> Array:
        """Times of the cycle that stand for any."""
        duration = self.run.cycle.duration
        if duration <= 0:
            return 0.0 * time
        return np.asarray(np.mod(time, duration) if self.run.cycle.periodic else np.clip(time, 0.0, duration))

    def _rows(self, time: Array) -> Array:
        assert self.courses is not None
        return self.courses.at(self._within(time))

    def _travel(self, time: Array) -> dict[str, Travel]:
        """What the travel of the seats adds to the motion of every link that it moves."""
        if not self.links:
            return {}
        rows = iter(np.where(self._halted(time), 0.0, np.nan_to_num(self._rows(time)[len(self.paths) :])))
        still = self.run.system.geometry.walk.algebra.STILL
        return {link: Travel(*each(still, lambda _: next(rows))) for link in self.links}

    def _sticks(self, back: Backward, time: Array) -> NDArray[np.bool_]:
        found = np.zeros(time.shape, bool)
        for joint, senses in (self.loads.sensed(self._within(time)) if self.paths else {}).items():
            for sense, rate in zip(senses, back.walk.signed_rates(joint), strict=True):
                found |= np.sign(rate) != sense
        return found & (self.states(time) != UNKNOWN)


def seating_of(run: Run, method: FrictionMethod | None = None) -> Seating:
    """The seats of a run, found once; what was asked of the margin of the method is left out."""
    quick = replace(method or FrictionMethod(), margin_up_to=0.0)
    return run.once(("seating", quick), lambda: _seating(run, quick))


def _seating(run: Run, method: FrictionMethod) -> Seating:
    given: dict[str, Number] = {}
    for seat in run.seats:
        if seat.given is not None:
            given |= seat.play.model.paths(f"seats.{seat.joint}", seat.given)
    plain = {path: float(np.ravel(primal(number))[0]) for path, number in given.items()}
    loads = end_loads(run, method)
    if all(seat.given is not None for seat in run.seats):
        return Seating(run, method, plain, loads)
    with np.errstate(all="ignore"):
        settling = _Settling(run, method, plain, loads)
        courses = Courses.of(settling, settling.breaks(), settling.like, accuracy_of(run.cycle, RESOLVED))
        courses, links, halts = settling.travelling(courses)
    rounds, change = settling.iterated(courses.edges)
    return Seating(run, method, plain, loads, courses, settling.paths, links, halts, rounds, change)


class _Settling:
    """The seats that loads press pins into, at any times: rows of offsets, m."""

    def __init__(self, run: Run, method: FrictionMethod, given: Mapping[str, float], loads: EndLoads) -> None:
        self.run, self.method, self.given, self.loads = run, method, given, loads
        self.seats = [seat for seat in run.seats if seat.given is None]
        self.paths = [f"seats.{seat.joint}.{key}" for seat in self.seats for end in seat.play.model.ends for key in end]
        self._history: list[tuple[Array, NDArray[np.intp], Array]] = []
        self._panels: list[tuple[float, float, Array]] = []  # low, high, s, and polynomials of those that settled

    def breaks(self) -> Array:
        """Both ends of the cycle and what lies between them, s."""
        edges = self.loads.courses.breaks
        jumps = [cross.time for cross in self.loads.crossings if not cross.lasts]
        times = np.concatenate([edges, jumps, self.loads.gaps.ravel()])
        return breaks_between(self.run.cycle, times) if self.run.cycle.duration > 0 else edges

    def like(self, sizes: Array) -> Array:
        """The size of what is like each row: the offsets of the same end."""
        radii = np.zeros(len(sizes))
        for end in self.loads.ends:
            radii[end.rows] = end.radius
        return radii

    def iterated(self, edges: Array) -> tuple[NDArray[np.intp], Array]:
        """Rounds and change of the seats between edges, s, the most of each panel."""
        time, rounds, change = (np.concatenate(part) for part in zip(*self._history, strict=True))
        panel, count = np.clip(np.searchsorted(edges, time) - 1, 0, len(edges) - 2), len(edges) - 1
        most, last = np.zeros(count, np.intp), np.zeros(count)
        np.maximum.at(most, panel, rounds)
        np.maximum.at(last, panel, change)
        return most, last

    def __call__(self, time: Array) -> tuple[Array, NDArray[np.integer]]:
        """Offsets, (row, time), and states at times, s."""
        offsets, rounds, change, unknown = self._settled(time * (self.run.cycle.duration > 0), self._near(time))
        states = np.where(change > TOLERANCE, UNSETTLED, SETTLED)
        for low, high in self.loads.gaps.T:
            states[(time > low) & (time < high)] = FLOATING
        states[unknown] = UNKNOWN
        self._history.append((time, rounds, np.where(states == SETTLED, change, 0.0)))
        for own, places in zip(np.split(np.arange(len(time)), len(time) // ORDER), self._panels_of(time), strict=True):
            if np.all(states[own] == SETTLED):
                self._panels.append((*places, offsets[:, own] @ FIT.T))
        return offsets, states

    def _near(self, time: Array) -> Array:
        """Offsets to begin with: those of the polynomials of a wider panel, if any has settled."""
        found = np.zeros((len(self.paths), len(time)))
        for k, (low, high) in enumerate(self._panels_of(time)):
            within = [panel for panel in self._panels if panel[0] <= low and high <= panel[1]]
            if within:
                first, last, polynomials = within[-1]
                nodes = slice(k * ORDER, (k + 1) * ORDER)
                spots = 2.0 * (time[nodes] - first) / (last - first) - 1.0
                found[:, nodes] = chebyshev.chebval(spots, polynomials.T)
        return found

    @staticmethod
    def _panels_of(time: Array) -> list[tuple[float, float]]:
        """Ends of the panels whose nodes the times are, but for rounding."""
        first, last = time[::ORDER], time[ORDER - 1 :: ORDER]
        middle, half = (first + last) / 2, (last - first) / 2 / POINTS[-1] * (1 - 1e-9)
        return list(zip((middle - half).tolist(), (middle + half).tolist(), strict=True))

    def _settled(self, time: Array, start: Array) -> tuple[Array, NDArray[np.intp], Array, NDArray[np.bool_]]:
        """Offsets, rounds, change that one more would make, and where there are no loads.

        A round gains about as much as the one before it, so what one more would change is known from two. The steps are
        extrapolated from the last two (Anderson's method with one step of memory, D. G. Anderson, J. ACM 12 (1965)
        547-560, doi:10.1145/321296.321305).
        """
        offsets = start
        rounds, change, unknown = np.zeros(len(time), np.intp), np.full(len(time), np.inf), np.zeros(len(time), bool)
        left, first, before, last = np.arange(len(time)), offsets.copy(), None, np.zeros(len(time))
        for k in range(1, ROUNDS + 1):
            here = offsets[:, left]
            goal = self._pressed(time[left], here)
            lost = ~np.all(np.isfinite(goal), axis=0)
            goal[:, lost] = 0.0
            now = np.where(lost, 0.0, self._apart(here, goal))
            rounds[left], unknown[left[lost]] = k, True
            change[left] = now * np.minimum(now / np.where(last > 0, last, np.inf), 1.0) if k > 1 else now
            first[:, left] = goal if k == 1 else first[:, left]
            offsets[:, left] = goal if before is None else self._extrapolated(*before, here, goal)
            done = (change[left] <= EXACT) | lost
            offsets[:, left[done]] = goal[:, done]
            before, last, left = (here[:, ~done], goal[:, ~done]), now[~done], left[~done]
            if not len(left):
                break
        offsets[:, left] = before[1] if before else 0.0
        unsettled = change > TOLERANCE
        offsets[:, unsettled] = first[:, unsettled]  # of loads without play, which are smooth
        return offsets, rounds, change, unknown

    def _held(self, time: Array, offsets: Array) -> Backward:
        """Motion and forces with the pins held at offsets, in the sense of the motion without play."""
        senses = self.loads.sensed(time)
        zero_slip: dict[str, Sense] = {joint: tuple(rows) for joint, rows in senses.items()}
        return self.run.at(time, self._places(offsets), self.method, zero_slip, rests=dict.fromkeys(senses, False))

    def _places(self, offsets: Array) -> dict[str, Array | float]:
        return {**self.given, **dict(zip(self.paths, offsets, strict=True))}

    def _pressed(self, time: Array, offsets: Array) -> Array:
        """Where the loads press the pins that are held at offsets, friction taken into account; NaN without loads."""
        back, senses = self._held(time, offsets), self.loads.sensed(time)
        loads = {seat.joint: loads_of(back, seat) for seat in self.seats}
        size = reactions(back, [part for own in loads.values() for load in own for part in load])
        least = NO_LOAD * np.maximum(size, IDLE * self.loads.largest)
        found = np.zeros_like(offsets) + 0.0 * size
        for end in self.loads.ends:
            joint = end.seat.joint
            load, floor = self.loads.across(end, time, loads[joint][end.number], least)
            if (share := _share(back, joint)) is not None:
                spin = back.walk.hole_spin(joint)  # about one axis with the sense that is taken
                load = turned_by_friction(load, share, (*spin[:-1], senses[joint][0]) if joint in senses else spin)
            for row, number in zip(range(*end.rows.indices(len(found))), pressed(load, end.radius, floor), strict=True):
                found[row] = number
        return found

    def _ends(self) -> list[tuple[slice, float]]:
        return [(end.rows, end.radius) for end in self.loads.ends]

    def _apart(self, before: Array, after: Array) -> Array:
        """The largest way of a pin from seat to seat, of the radius of its end."""
        ways = (np.sqrt(np.sum((after[rows] - before[rows]) ** 2, axis=0)) / radius for rows, radius in self._ends())
        return functools.reduce(np.maximum, ways)

    def _extrapolated(self, before: Array, after: Array, here: Array, there: Array) -> Array:
        """The seats to which two rounds, before → after and here → there, lead if the map between is a straight one; as
        far from the middle as the last."""
        step, last = there - here, after - before
        turn = step - last
        square = np.sum(turn * turn, axis=0)
        ahead = there - np.sum(step * turn, axis=0) / np.where(square > 0, square, np.inf) * (there - after)
        for rows, _ in self._ends():
            sizes, far = (np.sqrt(np.sum(place[rows] ** 2, axis=0)) for place in (ahead, there))
            ahead[rows] = np.where(sizes > 0, ahead[rows] * (far / np.where(sizes > 0, sizes, 1.0)), there[rows])
        return ahead

    # ---- how the links move while the seats travel ----------------------------------------------------------------

    def travelling(self, courses: Courses) -> tuple[Courses, list[str], list[Halt]]:
        """More rows: what the travel of the offsets adds to twist and acceleration of every link; these links, and where
        the pins are held.

        The twist comes of the poses, which are fed the rates of the offsets as ε parts. What play adds to the twist,
        beside that of pins in the middle, is a course by itself, and its derivative what play adds to the acceleration.
        """
        settled, run = courses.states == SETTLED, self.run
        if not np.any(settled):
            return courses, [], []
        time, offsets = courses.nodes[settled].ravel(), _lanes(courses.on_nodes()[:, settled])
        rates = _lanes(courses.derivative().on_nodes()[:, settled])
        back, more = self._held(time, offsets), np.zeros((0, *courses.nodes.shape))
        travel: dict[str, Travel] = {}
        if np.any(rates):
            middle, still = run.walk(time), run.system.geometry.walk.algebra.STILL
            places = {path: Dual(*both) for path, *both in zip(self.paths, offsets, rates, strict=True)}
            added = _added_twists(run, {**run.values, **self.given, **places}, time)
            for link, twist in added.items():
                held, ideal, extra = back.walk.motions[link], middle.motions[link], _rows(twist, time)
                play = _parted(_rows(held.twist, time) + extra - _rows(ideal.twist, time))
                second = _rows(ideal.acceleration, time) - _rows(held.acceleration, time)
                rows = np.nan_to_num(np.concatenate([extra, second + _lanes(courses.rate(play, settled))]))
                parts = iter(rows)
                travel[link] = Travel(*each(still, lambda _, parts=parts: next(parts)))
                values = np.zeros((len(rows), *courses.nodes.shape))
                values[:, settled] = _parted(rows)
                more = np.concatenate([more, values])
        signs = np.ones((SIGNS * len(self.loads.pressed), *courses.nodes.shape))
        signs[:, settled] = _parted(self._signs(time, offsets, back, travel))
        halts = self._halts(courses.extended(signs), len(self.paths))
        return courses.extended(more), list(travel), halts

    def _signs(self, time: Array, offsets: Array, back: Backward, travel: Mapping[str, Travel]) -> Array:
        """Of every end that is pressed numbers below 0 where its pin cannot lie at its wall as it does: where the load
        points away from there, where its travel turns it far aside, and where it outdoes it; back: with pins held."""
        found = []
        moving = self.run.at(time, self._places(offsets), self.method, travel=travel)
        for end, peak in self.loads.pressed:
            held, carried = (
                np.array([np.broadcast_to(primal(part), time.shape) for part in loads_of(walk, end.seat)[end.number]])
                for walk in (back, moving)
            )
            found.append(np.sum(held * offsets[end.rows], axis=0) / (peak * end.radius))
            sizes = np.sqrt(np.sum(held**2, axis=0) * np.sum(carried**2, axis=0))
            found.append((np.sum(held * carried, axis=0) - ASIDE * sizes) / peak**2)
            found.append(np.sum((MOST * held) ** 2 - (carried - held) ** 2, axis=0) / (MOST * peak) ** 2)
        return np.nan_to_num(np.array(found), nan=1.0)

    def _halts(self, courses: Courses, first: int) -> list[Halt]:
        """Where signs, the rows from the first on, are below 0."""
        halts = []
        for joint in dict.fromkeys(end.seat.joint for end, _ in self.loads.pressed):
            own = [k for k, (end, _) in enumerate(self.loads.pressed) if end.seat.joint == joint]
            rows = [first + SIGNS * k + sign for k in own for sign in range(SIGNS)]
            times = np.unique(np.concatenate([courses.edges, *(courses.passages(row) for row in rows)]))
            below = np.any(courses.at((times[1:] + times[:-1]) / 2)[rows] < -ROUNDING, axis=0)
            turns = np.flatnonzero(np.diff(below, prepend=False, append=False))
            halts += [Halt(joint, times[low], times[high]) for low, high in turns.reshape(-1, 2).tolist()]
        return halts


def _lanes(values: Array) -> Array:
    """Values at the nodes of panels, (row, panel, node), in a row."""
    return values.reshape(len(values), -1)


def _parted(rows: Array) -> Array:
    """The same the other way."""
    return rows.reshape(len(rows), -1, ORDER)


def _rows(numbers: Any, time: Array) -> Array:
    """The numbers of a twist at every time."""
    return np.array([np.broadcast_to(number, time.shape) for number in flat(numbers)])


def _share(back: Backward, joint: str) -> Number | None:
    """Friction force about the axis, against the slip, over the normal force at a contact; None without friction.

    Negative where it drives, as bristles do that have not yet bent round after a reversal.

    The coefficient itself: a pair factor stands for a spread contact, whose resultant is turned by atan μ all the
    same.
    """
    if joint not in back.turning:
        return None
    contact, turning = back.turning[joint]
    slope = contact.law.function(1.0, contact.slip, **contact.parameters)
    return -primal(slope * turning) * np.sign(primal(contact.slip)) / contact.parameters.get("pair_factor", 1.0)


def _added_twists(run: Run, values: Values, time: Array) -> dict[str, Any]:
    """Twist of every link by the ε parts of the values; poses alone are worked out."""
    system = run.system
    walk = kinematics.start(system, values)
    walk.time = time
    found: dict[str, Any] = {}
    still = walk.motions[system.mechanism.fixed_link]
    for number, module in enumerate(system.plan.modules):
        pose = kinematics.pose_of(walk, number, run.chosen.assembly[number], time)
        for link, frame in zip(module.links, pose.frames, strict=True):
            found[link] = walk.frame_rate(frame)
            walk.motions[link] = still._replace(frame=frame)
        found.update(walk.unspun(number, pose, found))
        walk.poses.append(pose)
    return found
