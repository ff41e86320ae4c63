"""The loops of an over-constrained mechanism with the offsets of its pins, guides and balls as further unknowns.

How far they are open is a function of the coordinates q and of the end offsets c of every joint with play. Position
by position, all lanes at once:

    gap(q + δq, c + δc) ≈ gap + J δq + C δc

J has the screws of the joints; C, of the offsets, comes from dual numbers through the same functions. The least play
that closes the loops is that of a second-order cone programme, linearised anew until the closure is exact:

    minimise t   subject to   gap + J δq + C (c − c₀) = 0,   |c_i| ≤ b_i + t s_i  at every end

Play b_i + t s_i: of stated clearances r_i it is t r_i; of one clearance for all pins it is t, and what is stated of
other joints stays. One linearised problem is convex: the value of its dual is a lower bound, and the multipliers say
what each end contributes. The next linearisation is at the q and c found; it ends when the gap, computed without any
linearisation, is at rounding and t stands still. The first is at poses of the mechanism without errors, or where its
loops are open least.
"""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import clarabel
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, MechanismError
from trunnion.groups.redundant import RANK, stacked
from trunnion.groups.spatial import SpatialGroup
from trunnion.groups.tree import Element
from trunnion.joints.clearance import CLEARANCE_MODELS
from trunnion.solve import shifts
from trunnion.solve.assembly import choose
from trunnion.solve.forward import posed, start
from trunnion.solve.hints import distance
from trunnion.solve.space.determinacy import look
from trunnion.solve.system import Cycle, System, Values, driven_coordinates
from trunnion.solve.track import GUESSES, SEED, guess_reaches

Array = NDArray[np.float64]
LARGEST = 0.3  # rad, or of the size: a coordinate goes no farther in one step
ROUNDS = 60  # of least squares, to where the loops are open least
STILL = 1e-10  # step at which they end
NEARLY = 0.05  # rad, or of the size: an assembly open by more is none
FOLLOWED = 180  # positions of a cycle through which the one that is open least is followed
JUMP = 0.5  # rad, or of the size: farther from one of them to the next it is another assembly
CLOSED = 1e-12  # rad, or of the size: a gap that counts as closed
SETTLED = 1e-9  # of t
CONES = 60  # linearised problems
PATIENCE = 12
NOTHING = 1e-13  # of the size: a play below it is rounding
FINE = 1e-12  # tolerances of the cone programme
SOUND = ("Solved", "AlmostSolved", "InsufficientProgress")


class End(NamedTuple):
    """One end of a joint's play: its joint, its number, the names of its components, as "1.x", the radius that is
    stated, m, and whether it is that of a pin in its hole (not an end float, a guide or a ball).
    """

    joint: str
    number: int
    keys: tuple[str, ...]
    radius: float
    pin: bool

    @property
    def axes(self) -> tuple[str, ...]:
        """The axes of its components."""
        return tuple(key.partition(".")[2] for key in self.keys)


class LinearLoops(NamedTuple):
    """gap (lane, row), J (lane, row, coordinate) and C (lane, row, component): rad and lengths over the size."""

    gap: Array
    jacobian: Array
    effect: Array


def ends_of(system: System, values: Values, every_pin: bool) -> list[End]:
    """The ends of all plays that are stated, and of pins that state none if `every_pin`; NaN lengths are left in."""
    ends: list[End] = []
    for name, joint in system.joints.items():
        model = CLEARANCE_MODELS["spatial"].get(joint.type)
        if model is None:
            continue
        play = shifts.play_of("spatial", joint.type, values, name)
        pin = joint.pair.bored
        for k, keys in enumerate(model.ends):
            radius = float(np.ravel(primal(play.radii[k]))[0]) if play else 0.0
            radial = pin and k not in model.axial
            if radius > 0 or (radial and every_pin):
                ends.append(End(name, k, keys, radius, radial))
    return ends


@dataclass(frozen=True)
class Loops:
    """The loops of one module whose other links all lie still.

    holes: local elements with the errors of the mechanism, pins in the middle; drive: driven coordinates, each a number
    or (lane,).
    """

    system: System
    values: Values
    ends: tuple[End, ...]
    holes: Mapping[tuple[str, str], Any]
    drive: tuple[Number, ...]
    size: float

    @classmethod
    def of(cls, system: System, values: Values, ends: Sequence[End], time: Array) -> Loops:
        """The loops at the given times, s."""
        holes, module = system.holes(values), system.plan.modules[0]
        drive = driven_coordinates(system, module, system.places[0], values, time)[0]
        return cls(system, values, tuple(ends), holes, tuple(drive), float(np.ravel(system.size(values, holes))[0]))

    @cached_property
    def group(self) -> SpatialGroup:
        """The module."""
        group: SpatialGroup = self.system.groups[0]
        return group

    @cached_property
    def components(self) -> list[str]:
        """Path of every offset among the values."""
        return [f"seats.{end.joint}.{key}" for end in self.ends for key in end.keys]

    def at(self, lanes: NDArray[np.intp]) -> Loops:
        """The same at some of the lanes."""
        return replace(self, drive=tuple(q[lanes] if np.ndim(q) else q for q in self.drive))

    # ---- geometry -------------------------------------------------------------------------------------------

    def _elements(self, offsets: Sequence[Number]) -> list[Element]:
        values = ChainMap(dict(zip(self.components, offsets, strict=True)), dict(self.values))
        elements = []
        for place in self.system.places[0]:
            (first, second), name = place.links, place.joint
            lain = shifts.seated("spatial", self.holes[second, name], place.kind, values, name)
            elements.append(Element(self.holes[first, name], lain, self.system.lead(self.values, name)))
        return elements

    def _coordinates(self, q: Array, deep: bool = False) -> list[list[Number]]:
        """Coordinates (lane, kept) joint by joint, each (lane,), or (lane, 1) if `deep`."""

        def column(value: Number) -> Number:
            return np.asarray(value, float)[:, None] if deep and np.ndim(value) else value

        return self.group.coordinates([column(row) for row in q.T], [column(value) for value in self.drive])

    def linear(self, q: Array, c: Array) -> LinearLoops:
        """Gap and its derivatives at coordinates (lane, kept) and offsets (lane, component), m."""
        group, count = self.group, c.shape[1]
        joints = self._coordinates(q)
        _, placed, screws = self.place(q, c)
        gap = _full(group.gaps(placed, joints, self.size), (len(q),))
        jacobian = np.broadcast_to(
            stacked(group.jacobian(placed, screws, self.size)), (len(q), gap.shape[1], len(group.free))
        )
        if not count:
            return LinearLoops(gap, jacobian, np.zeros((*gap.shape, 0)))
        seeds = [Dual(offset[:, None], row[None, :]) for offset, row in zip(c.T, np.eye(count), strict=True)]
        deep = self._coordinates(q, deep=True)
        opened = group.gaps(group.place(self._elements(seeds), deep)[1], deep, self.size)
        effect = _full([n.dual if isinstance(n, Dual) else 0.0 for n in opened], (len(q), count))
        return LinearLoops(gap, jacobian, effect)

    def opening(self, q: Array, c: Array) -> Array:
        """Largest opening of a loop at every lane, in units of the size; rad."""
        joints, (_, placed, _) = self._coordinates(q), self.place(q, c)
        return np.broadcast_to(self.group.opening(placed, joints, self.size), (len(q),)) / self.size

    def place(self, q: Array, c: Array) -> tuple[Any, ...]:
        """Frames of the links, elements of the joints and their screws."""
        placed: tuple[Any, ...] = self.group.place(self._elements(list(c.T)), self._coordinates(q))
        return placed

    def moved(self, q: Array, steps: Array) -> Array:
        """Coordinates (lane, kept) after steps (lane, free) in every free coordinate, slides in units of the size."""
        group = self.group
        by_joint = group.unmoved()
        for (k, i), step in zip(group.free, steps.T, strict=True):
            by_joint[k][i] = step
        coordinates = [n for joint in group.advanced(self._coordinates(q), by_joint, self.size) for n in joint]
        return np.stack([np.broadcast_to(coordinates[i], (len(q),)) for i in group.kept], axis=-1)

    def least_open(self, q: Array, c: Array) -> tuple[Array, Array]:
        """Coordinates near by at which the loops are open least (least squares), and by how much: (lane,)."""
        lanes = np.flatnonzero(np.isfinite(q).all(axis=1))
        part, near = self.at(lanes), q[lanes]
        for _ in range(ROUNDS):
            linear = part.linear(near, c[lanes])
            steps = -(np.linalg.pinv(linear.jacobian) @ linear.gap[..., None])[..., 0]
            largest = np.max(np.abs(steps), axis=-1, initial=0.0)
            near = part.moved(near, steps * np.minimum(1.0, LARGEST / np.maximum(largest, 1e-300))[:, None])
            if not np.any(largest > STILL):
                break
        nearest, gap = q.copy(), np.full(len(q), np.nan)
        nearest[lanes] = near
        gap[lanes] = np.max(np.abs(part.linear(near, c[lanes]).gap), axis=-1, initial=0.0)
        return nearest, gap


def _full(rows: Sequence[Number], shape: tuple[int, ...]) -> Array:
    """(lane, row, …) of rows that broadcast to (lane, …)."""
    return np.stack([np.broadcast_to(np.asarray(row, float), shape) for row in rows], axis=1)


# ---- the least play that closes them -------------------------------------------------------------------------------


class Ask(NamedTuple):
    """Play b + t s allowed at each end (end,), and how many components each has."""

    base: Array
    share: Array
    widths: tuple[int, ...]


ConeAnswer = tuple[Array, Array, float, float, Array]  # steps, offsets, t, lower bound of t, what each end contributes


@dataclass(frozen=True)
class LeastPlay:
    """Least t of every lane, its lower bound by the dual, coordinates, offsets, contributions (lane, end), opening.

    t is ∞ where no play of this kind closes the loops, NaN where the sequence did not settle.
    """

    least: Array
    bound: Array
    q: Array
    offsets: Array
    weights: Array
    opening: Array
    rounds: int


def least_play(loops: Loops, q: Array, c: Array, ask: Ask) -> LeastPlay:
    """The least t at every lane, from coordinates (lane, kept) and offsets (lane, component).

    A step is halved where the gap grew, from the round PATIENCE on.
    """
    lanes, ends = len(q), len(ask.widths)
    q, c = q.copy(), c.copy()
    least, bound = np.full(lanes, np.nan), np.full(lanes, np.nan)
    weights, before, gaps = np.zeros((lanes, ends)), np.full(lanes, np.nan), np.full(lanes, np.inf)
    active = np.flatnonzero(np.isfinite(q).all(axis=1))
    rounds = 0
    while len(active) and rounds < CONES:
        part = loops.at(active)
        linear = part.linear(q[active], c[active])
        gap = np.max(np.abs(linear.gap), axis=1, initial=0.0)
        grew = (gap > gaps[active]) & (rounds >= PATIENCE)
        gaps[active] = gap
        settled = (gap <= CLOSED) & (np.abs(least[active] - before[active]) <= SETTLED * np.abs(least[active]))
        steps = np.zeros((len(active), linear.jacobian.shape[2]))
        done = settled.copy()
        for place, lane in enumerate(active):
            if settled[place]:
                continue
            answer = _solve(LinearLoops(*(number[place] for number in linear)), c[lane], ask, loops.size)
            if answer is None:
                least[lane], done[place] = np.inf, True
                continue
            before[lane], (step, offsets, least[lane], bound[lane], weights[lane]) = least[lane], answer
            largest = float(np.max(np.abs(step), initial=0.0))
            length = (0.5 if grew[place] else 1.0) * min(1.0, LARGEST / max(largest, 1e-300))
            steps[place] = length * step
            c[lane] += length * (offsets - c[lane])
        moving = ~done
        q[active[moving]] = part.at(np.flatnonzero(moving)).moved(q[active[moving]], steps[moving])
        active = active[moving]
        rounds += 1
    least[active] = np.nan
    return LeastPlay(least, bound, q, c, weights, loops.opening(q, c), rounds)


def _solve(linear: LinearLoops, c: Array, ask: Ask, size: float) -> ConeAnswer | None:
    """One linearised problem; None if nothing closes it. Unknowns in units of what has to be taken up."""
    gap, jacobian, effect = linear
    side = effect @ c - gap
    unit = float(np.max(np.abs(side), initial=0.0))
    columns, components, ends = jacobian.shape[1], effect.shape[1], len(ask.widths)
    lever = float(np.max(np.abs(effect), initial=0.0))
    if unit <= NOTHING:
        return np.zeros(columns), np.zeros(components), 0.0, 0.0, np.zeros(ends)
    if not lever:
        return None
    length = unit / lever  # m: an offset of 1
    share = float(np.max(ask.share, initial=0.0))
    if share == 0:
        return None
    # rows A x + s = b of the ends: s = (b_i + t s_i, c_i)
    firsts = np.cumsum([0, *(width + 1 for width in ask.widths[:-1])])
    rows, right = np.zeros((components + ends, columns + components + 1)), np.zeros(components + ends)
    rows[firsts, -1], right[firsts] = -ask.share / share, ask.base / length
    rows[np.setdiff1d(np.arange(len(rows)), firsts), columns + np.arange(components)] = -1.0
    table = np.zeros((len(gap), columns + components + 1))
    table[:, :columns], table[:, columns:-1] = jacobian, effect / lever
    aim = np.zeros(table.shape[1])
    aim[-1] = 1.0
    cones = [clarabel.ZeroConeT(len(gap)), *(clarabel.SecondOrderConeT(width + 1) for width in ask.widths)]
    matrix = sparse.csc_matrix(np.vstack([table, rows]))
    none = sparse.csc_matrix((len(aim), len(aim)))
    b = np.concatenate([side / unit, right])
    settings = clarabel.DefaultSettings()
    settings.verbose, settings.max_iter = False, 100
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = FINE
    solution = clarabel.DefaultSolver(none, aim, matrix, b, cones, settings).solve()
    if str(solution.status) not in SOUND:
        return None
    x, z = np.asarray(solution.x), np.asarray(solution.z)
    least, bound = length / share * float(x[-1]), length / share * float(solution.obj_val_dual)
    return unit * x[:columns], length * x[columns:-1], least, bound, z[len(gap) + firsts] * ask.share / share


# ---- where to start -------------------------------------------------------------------------------------------------


Start = Callable[[Array], Array]  # coordinates (lane, kept) near those of the closed loops at times, s, or NaN


def start_of(system: System, values: Values, ideal: Values, cycle: Cycle) -> tuple[Start, list[Finding]]:
    """Where to start from, and what there is to say of it.

    Raises MechanismError where the mechanism leaves a freedom undetermined, or is nowhere even nearly closed.
    """
    chosen = choose(system, ideal, cycle)
    wrong = [error for error in look(system, ideal, chosen, cycle).findings() if error.where == "drivers"]
    if wrong:
        raise MechanismError(wrong)
    if chosen.found[0]:
        kept = system.groups[0].kept

        def closing(time: Array) -> Array:
            pose = posed(system, ideal, chosen.assembly, time).poses[0]
            return np.stack([np.broadcast_to(pose.q[i], time.shape) for i in kept], axis=-1)

        return closing, list(chosen.findings)
    nearly = _followed(system, values, cycle)
    what = "the stated axes and lengths do not close the loops, even without the errors"
    remedy = "errors count from the position with the smallest opening; state the difference as misalignment or "
    remedy += "errors"
    misfit = Finding.note("assembly.misfit", "links", what, remedy)
    if nearly is None:
        what = f"{misfit.what}: the loops are not nearly closed at any position"
        raise MechanismError(Finding(what, "links", "check the lengths"))
    return nearly, [misfit]


def _followed(system: System, values: Values, cycle: Cycle) -> Start | None:
    """A mechanism that closes nowhere, along the poses in which it is open least.

    From the first position at which an assembly is nearly closed on, and back: that nearest the hints.
    """
    time = np.linspace(0.0, cycle.duration, FOLLOWED + 1 if cycle.duration else 1)
    loops = Loops.of(system, values, (), time)
    rows = np.full((len(time), len(loops.group.kept)), np.nan)
    for begin in sorted({int(i) for i in np.linspace(0, len(time) - 1, 13)}):
        first = _nearest(system, values, loops.at(np.full(GUESSES, begin)))
        if first is not None:
            break
    else:
        return None
    for order in (range(begin, len(time)), range(begin, -1, -1)):
        q = first
        for place in order:
            coordinates_, gap = loops.at(np.array([place])).least_open(q[None], np.zeros((1, 0)))
            if not gap[0] <= NEARLY or not np.max(np.abs(coordinates_[0] - q)) <= JUMP:
                break
            rows[place] = q = coordinates_[0]

    def coordinates(at: Array) -> Array:
        moment = np.mod(at, time[-1]) if cycle.periodic and time[-1] else np.asarray(at)
        return np.asarray(rows[np.argmin(np.abs(moment[:, None] - time), axis=1)])

    return coordinates


def _nearest(system: System, values: Values, loops: Loops) -> Array | None:
    """Coordinates of the assembly nearest the hints at one position, from many guesses; None if none nearly closes."""
    rng = np.random.default_rng(SEED)
    guesses = [rng.uniform(-reach, reach, GUESSES) for reach in guess_reaches(loops.group, loops.size)]
    none = np.zeros((GUESSES, 0))
    with np.errstate(all="ignore"):
        q, gap = loops.least_open(np.stack(guesses, axis=-1), none)
    good = np.flatnonzero(gap <= NEARLY)
    if not len(good):
        return None
    part = loops.at(good)
    singular = np.linalg.svd(part.linear(q[good], none[good]).jacobian, compute_uv=False)
    if loops.group.free and np.all(singular[:, -1] <= RANK * singular[:, 0]):
        what = "the joints leave a freedom undetermined"
        raise MechanismError(Finding(what, "drivers", "add a driver, or joints to these links"))
    far = distance(start(system, values), system.plan.modules[0], part.place(q[good], none[good])[0])
    order = np.lexsort((gap[good], np.round(np.broadcast_to(far, good.shape) / loops.size**2, 6)))
    return np.asarray(q[good[order[0]]])
