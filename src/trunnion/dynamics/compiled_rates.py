"""Rates of a free motion as machine code: the walks recorded once.

Without friction in the joints E(q, q̇, q̈) = E₀ + M q̈: one walk at rest and one for each unit acceleration give M and E₀,
all at the same pose, so that the poses are computed once. The equation M q̈ = T − E₀ is solved by elimination as part
of the program.

With friction E is not affine: rounds of Newton's method, each with the walks for its own slopes, are a loop of the
program, and where they or the friction did not settle the walks are asked. What contacts touch, in which sense joints
slide and what is switched on decides which program it is; while a joint sticks the walks are asked.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, UntraceableError, looped
from trunnion.dynamics.rates import Layout, Rates, Seen, Walks
from trunnion.dynamics.state import DIFFERENCE, FreeMotion, Moment
from trunnion.dynamics.touching import Closed, Onset
from trunnion.engines.kernel import literals
from trunnion.solve.backward import Backward

__all__ = [
    "CompiledRates",
    "Figures",
    "Kinds",
    "columns_of",
    "compilable",
    "compiled_rates",
    "eliminated",
    "errors_of",
    "missing_of",
    "works_recorded",
]

Array = NDArray[np.float64]
Figures = Callable[[FreeMotion, Moment], list[Number]]  # what a program computes, of a recorded motion

ROUNDS = 5  # of Newton's method in a program
CLOSE = 1e-8  # of an acceleration: a last step of which the next is below rounding
MOST_LANES = 64  # that a program takes at a time
TOUCHES, SLIPS, STICKS = 1, 2, 3  # how a contact touches: by a law, or closed between rigid bodies
TOLD = (TOUCHES, SLIPS)  # of which something is told
Kinds = tuple[int | None, ...]


def _kind(onset: Onset) -> int | None:
    if isinstance(onset, Closed):
        return SLIPS if onset.sense else STICKS
    return None if onset is None else TOUCHES


def _onset(kind: int | None, told: Iterator[Any]) -> Onset:
    """The contact of a kind, with what is told of it: speed of approach, or sense of the slip."""
    if kind == SLIPS:
        return Closed(next(told))
    return next(told) if kind == TOUCHES else Closed(0) if kind == STICKS else None


def compiled_rates(motion: FreeMotion) -> CompiledRates | None:
    """The rates as machine code; None where they cannot be: losses in gears, brakes, clutches, friction with a memory
    or at rest of one coordinate, an assembly that is followed."""
    resting = motion.sticking and len(motion.names) == 1
    if resting or motion.bristles or not compilable(motion):
        return None
    found = CompiledRates(motion)
    return found if found.works() else None


def compilable(motion: FreeMotion) -> bool:
    """Whether it may be: without losses in gears, brakes, clutches and an assembly that is followed."""
    lossy = any(drive.brake or drive.clutched or drive.efficiency < 1.0 for drive in motion.drives.values())
    return not (lossy or motion.followed)


class CompiledRates:
    """The rates of `motion`, one program for every set of contacts that touch."""

    def __init__(self, motion: FreeMotion) -> None:
        self.motion = motion
        self.walks = Walks(motion)
        self.layout = Layout.of(motion)
        self.last = 2 * self.layout.coordinates + len(self.layout.works_named)  # of the numbers that are integrated
        self._programs: dict[tuple[Any, ...], Program] = {}

    def works(self, onset: Onset = 1.0) -> bool:
        """Whether it can be recorded, with all contacts touching."""
        n, count = self.layout.coordinates, len(self.motion.contacts.each)
        q, rate, integral, none = (np.zeros((k, 1)) for k in (n, n, n, 0))
        senses = (1,) * len(self.motion.resisted)
        at = Moment(np.zeros(1), q, rate, integral, none, onsets=(onset,) * count, senses=senses)
        try:
            self._program("rates", at)
        except UntraceableError:
            return False
        return True

    def __call__(self, at: Moment) -> Rates:
        """The rates; one lane."""
        n = self.layout.coordinates
        if 0 in at.senses:
            return self.walks(at)
        found = self._program("rates", at).run(at)[:, 0]
        if found[-1] != 0.0 or not np.all(np.isfinite(found)):
            return self.walks(at)
        return Rates(found[:n], found[n : 2 * n], np.empty(0), found[2 * n : self.last], True)

    def derivative(
        self, time: float, row: Array, onsets: Sequence[Onset], now: float, senses: tuple[int, ...] = ()
    ) -> Array:
        """The derivative of a row, without ado: this is asked for some hundred thousand times. NaN for no answer."""
        n, found = self.layout.coordinates, np.empty(len(row))
        if 0 not in senses:
            rates = self._program_of("rates", onsets, now, senses).of_row(time, row[: 3 * n], onsets)
            found[:n], found[n : 3 * n], found[3 * n :] = row[n : 2 * n], rates[: 2 * n], rates[2 * n : self.last]
            if rates[-1] == 0.0 and math.isfinite(found.sum()):
                return found
        at = self.layout.moment(np.array([time]), row[:, None], now=now)
        at = at._replace(onsets=tuple(onsets), senses=senses)
        told = self.walks(at)
        return self.layout.row(row[n : 2 * n], told) if told.sound else np.full(len(row), np.nan)

    def margins(self, at: Moment) -> Array:
        """See `FreeMotion.margins`, (module, lane)."""
        found = self._program("margins", at).run(at)
        return self.walks.margins(at) if np.any(found[-1]) else found[:-1]

    def look(self, at: Moment) -> Seen:
        """See `rates.Seeing`."""
        found = self._program("look", at).run(at)
        if np.any(found[-1]):
            return self.walks.look(at)
        return Seen(*found[:-1].reshape(len(Seen._fields), -1, at.q.shape[1]))

    def _program(self, what: str, at: Moment) -> Program:
        return self._program_of(what, at.onsets, at.now, at.senses if what == "rates" else ())

    def _program_of(self, what: str, onsets: Sequence[Onset], now: float, senses: tuple[int, ...]) -> Program:
        kinds = tuple(map(_kind, onsets))
        key = what, kinds, now, senses
        if key not in self._programs:
            self._programs[key] = Program(self.motion, self.figures(what, kinds), kinds, now, senses)
        return self._programs[key]

    def figures(self, what: str, kinds: Kinds) -> Figures:
        """What a program computes: the rates, how near assemblies are to each other, or how the contacts are."""
        if what == "rates":
            return functools.partial(_rates_of, unit=self.motion.trial.tolist())
        return _margins if what == "margins" else _seen


class Program:
    """Some numbers of a motion as machine code, of lanes of states; the last of them: whether there is any doubt."""

    def __init__(self, motion: FreeMotion, figures: Figures, kinds: Kinds, now: float, senses: tuple[int, ...]) -> None:
        from trunnion.engines.graph import POSITION, Graph
        from trunnion.engines.machine_code import MachineCode, vector_width
        from trunnion.engines.program import program
        from trunnion.engines.recorded import Recorded, number_of

        n, graph = len(motion.names), Graph()
        constant = literals(motion.values)
        given = {path: value for path, value in motion.values.items() if path not in constant}
        recorded = {path: Recorded(graph, graph.input(path, 0)) for path in given}
        self.states = ["time", *(f"{kind}{i}" for kind in ("q", "rate", "integral") for i in range(n))]
        state = [Recorded(graph, graph.input(name, POSITION)) for name in self.states]
        self.onsets = [f"onset{k}" for k, kind in enumerate(kinds) if kind in TOLD]
        told: Any = iter([Recorded(graph, graph.input(name, 0)) for name in self.onsets])
        onsets = tuple(_onset(kind, told) for kind in kinds)
        parts: Any = [state[1 + k * n : 1 + (k + 1) * n] for k in range(3)]
        q, rate, integral = parts
        at = Moment(cast("Any", state[0]), q, rate, integral, cast("Any", []), now=now, onsets=onsets, senses=senses)
        bare = replace(motion, run=replace(motion.run, values={**constant, **recorded}))
        with np.errstate(all="ignore"):
            *wanted, doubtful = [graph.as_float(number_of(graph, one)) for one in figures(bare, at)]
        doubt = doubtful
        for one in graph.doubts:
            doubt = graph.apply("max", doubt, graph.as_float(one))
        outputs = [*wanted, graph.as_float(doubt)]
        self.lanes, width = MOST_LANES, vector_width()
        code = MachineCode(program(graph, outputs, width))
        self.numbers = {path: np.array([float(np.ravel(primal(value))[0])]) for path, value in given.items()}
        self.numbers.update({name: np.zeros(1) for name in self.onsets})
        self.state = np.zeros((len(self.states), self.lanes))
        self.numbers.update(zip(self.states, self.state, strict=True))
        self.found = np.zeros((len(outputs), self.lanes))
        rows = [row[None] for row in self.found]
        # one state is done as one vector of the same lane
        self._short = code.bound(self.numbers, rows, (0, 1), (0, width))
        self._long = code.bound(self.numbers, rows, (0, 1), (0, self.lanes))
        self.width = width

    def run(self, at: Moment) -> Array:
        """The numbers, (number, lane)."""
        state, parts = np.vstack([at.time[None], at.q, at.rate, at.integral]), list[Array]()
        self._begin(at.onsets)
        for low in range(0, state.shape[1], self.lanes):
            part = state[:, low : low + self.lanes]
            self.state[:, : part.shape[1]], self.state[:, part.shape[1] :] = part, part[:, -1:]
            self._long()
            parts.append(self.found[:, : part.shape[1]].copy())
        return np.hstack(parts)

    def of_row(self, time: float, state: Array, onsets: Sequence[Onset]) -> Array:
        """The numbers of one state: coordinates, rates, integrals; overwritten by the next."""
        self._begin(onsets)
        self.state[0, : self.width] = time
        self.state[1:, : self.width] = state[:, None]
        self._short()
        found: Array = self.found[:, 0]
        return found

    def _begin(self, onsets: Sequence[Onset]) -> None:
        told = [onset.sense if isinstance(onset, Closed) else onset for onset in onsets if _kind(onset) in TOLD]
        for name, number in zip(self.onsets, told, strict=True):
            self.numbers[name][0] = number


# ---- what is recorded -----------------------------------------------------------------------------------------


def _rates_of(motion: FreeMotion, at: Moment, unit: Sequence[float]) -> list[Number]:
    """Accelerations, rates of the controllers' integrals, works, as `rates.Walks` has them; 1 where there is doubt."""
    doubt: Number = 0.0
    if motion.affine:
        second = _affine(motion, at, unit)
    else:
        second, doubt = _by_rounds(motion, at, unit)
    back = motion.solve(at, cast("Any", second), sliding=True)
    for one in back.settled:
        doubt = np.maximum(doubt, np.where(one.converged, 0.0, 1.0))
    return [*second, *errors_of(motion, at), *works_recorded(motion, at, back), doubt]


def _by_rounds(motion: FreeMotion, at: Moment, unit: Sequence[float]) -> tuple[list[Number], Number]:
    """Accelerations by Newton's method with slopes by differences, and 1 where it did not end, or where more
    acceleration takes less effort."""
    count = len(motion.names)

    def step(numbers: list[Number]) -> list[Number]:
        second, columns = numbers[:count], []
        missed = missing_of(motion, at, second)
        for k, size in enumerate(unit):
            ahead = DIFFERENCE * np.maximum(np.abs(second[k]), 1e-2 * size)
            ahead = np.where(second[k] < 0.0, -ahead, ahead)
            tried = [one + ahead if i == k else one for i, one in enumerate(second)]
            columns.append([(a - b) / ahead for a, b in zip(missing_of(motion, at, tried), missed, strict=True)])
        change, pivots = eliminated([list(row) for row in zip(*columns, strict=True)], missed)
        turned: Number = 1.0  # the sign of the determinant, see `state.Accelerated`
        for pivot in pivots:
            turned = np.where(pivot > 0.0, turned, -turned)
        return [*(one - part for one, part in zip(second, change, strict=True)), *change, turned]

    begin = [0.0 * rate for rate in at.rate]
    *found, positive = looped(step, [*begin, *begin, 1.0], ROUNDS)
    doubt: Number = np.where(positive > 0.0, 0.0, 1.0)
    for one, change, size in zip(found[:count], found[count:], unit, strict=True):
        small = CLOSE * np.maximum(np.abs(one), 1e-2 * size)
        doubt = np.maximum(doubt, np.where(np.abs(change) <= small, 0.0, 1.0))
    return found[:count], doubt


def _affine(motion: FreeMotion, at: Moment, unit: Sequence[float]) -> list[Number]:
    """Accelerations where efforts are affine in them."""
    nothing: Any = [0.0] * len(motion.names)
    matrix = [list(row) for row in zip(*columns_of(motion, at, unit), strict=True)]
    return eliminated(matrix, [-one for one in missing_of(motion, at, nothing)])[0]


def columns_of(motion: FreeMotion, at: Moment, unit: Sequence[float]) -> list[list[Number]]:
    """The columns of M, from rest and without contacts, whose forces would leave no digits to the differences."""
    count = len(motion.names)
    nothing: Any = [0.0] * count
    still = at._replace(rate=nothing, onsets=(None,) * len(at.onsets))
    zero, columns = missing_of(motion, still, nothing), []
    for k, size in enumerate(unit):
        step = [size if i == k else 0.0 for i in range(count)]
        columns.append([(one - rest) / size for one, rest in zip(missing_of(motion, still, step), zero, strict=True)])
    return columns


def errors_of(motion: FreeMotion, at: Moment) -> list[Number]:
    """Rates of the controllers' integrals."""
    drives: Any = enumerate(motion.drives.values())
    return [drive.error(at.time, at.rate[i], at.integral[i], at.now) for i, drive in drives]


def missing_of(motion: FreeMotion, at: Moment, second: Any) -> list[Number]:
    """E − T of every free coordinate."""
    back = motion.solve(at, second, sliding=True)
    found = []
    for i, (name, drive) in enumerate(motion.drives.items()):
        given = drive.effort(at.time, at.rate[i], second[i], at.integral[i], at.now)
        found.append(back.efforts[name] - given)
    return found


def works_recorded(motion: FreeMotion, at: Moment, back: Backward) -> list[Number]:
    """Powers, as `rates.works_of` has them."""
    stated = motion.system.mechanism.loads
    drive = sum((effort * back.walk.rate(name) for name, effort in back.efforts.items()), 0.0)
    loads = sum((power for name, power in back.load_powers.items() if name in stated), 0.0)
    springs = sum((state.power for state in back.springs.values()), 0.0)
    friction = sum((back.losses[joint] for joint in back.walk.system.joints), 0.0)
    found = [drive, loads, springs, friction]
    if motion.contacts.each:
        found.append(sum((push.loss for _, push in motion.contacts.pushes(back.walk, at.onsets)), 0.0))
    return found


def _seen(motion: FreeMotion, at: Moment) -> list[Number]:
    """What `rates.Seen` has, of every contact."""
    nothing: Any = [0.0] * len(motion.names)
    found = motion.contacts.pushes(motion.walk(at, nothing), at.onsets)
    parts = [(state.gap, state.rate, state.slip, push.normal, push.friction) for state, push in found]
    return [*(one[i] for i in range(len(Seen._fields)) for one in parts), 0.0]


def _margins(motion: FreeMotion, at: Moment) -> list[Number]:
    """What `FreeMotion.margins` has."""
    nothing: Any = [0.0] * len(motion.names)
    return [*motion.margins(motion.walk(at, nothing)), 0.0]


def eliminated(matrix: list[list[Number]], right: list[Number]) -> tuple[list[Number], list[Number]]:
    """x of A x = b and the pivots, without exchange of rows: all positive of a mass matrix, and of one with the forces
    of contacts behind it where these have a solution."""
    count, pivots = len(right), list[Number]()
    for k in range(count):
        pivots.append(matrix[k][k])
        for i in range(k + 1, count):
            share = matrix[i][k] / matrix[k][k]
            matrix[i] = [a - share * b for a, b in zip(matrix[i], matrix[k], strict=True)]
            right[i] = right[i] - share * right[k]
    found: list[Number] = [0.0] * count
    for i in reversed(range(count)):
        rest = sum((matrix[i][j] * found[j] for j in range(i + 1, count)), 0.0)
        found[i] = (right[i] - rest) / matrix[i][i]
    return found, pivots
