"""Rates of a free motion as machine code: the walks recorded once.

Without friction in the joints E(q, q̇, q̈) = E₀ + M q̈: one walk at rest and one for each unit acceleration give M and E₀,
all at the same pose, so that the poses are computed once. The equation M q̈ = T − E₀ is solved by elimination as part
of the program.

With friction E is not affine: rounds of Newton's method, each with the walks for its own slopes, are a loop of the
program, and where they or the friction did not settle the walks are asked. What contacts touch, in which sense joints
slide and what is switched on decides which program it is; while a joint sticks the walks are asked.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, UntraceableError, looped
from trunnion.dynamics.motor import drives
from trunnion.dynamics.rates import WORKS, Layout, Rates, Seen, Walks, bristle_rates, works_of
from trunnion.dynamics.state import DIFFERENCE, FreeMotion, Moment
from trunnion.dynamics.touching import Closed, Onset
from trunnion.engines.kernel import literals

if TYPE_CHECKING:
    from trunnion.engines.machine_code import MachineCode

__all__ = [
    "Codes",
    "CompiledRates",
    "Figures",
    "Kinds",
    "columns_of",
    "compilable",
    "eliminated",
    "errors_of",
    "missing_of",
    "rates_of",
]

Array = NDArray[np.float64]
Figures = Callable[[FreeMotion, Moment], list[Number]]  # what a program computes, of a recorded motion

ROUNDS = 5  # of Newton's method in a program
CLOSE = 1e-8  # of an acceleration: a last step of which the next is below rounding
MOST_LANES = 64  # that a program takes at a time
TOUCHES, SLIPS, STICKS = 1, 2, 3  # how a contact touches: by a law, or closed between rigid bodies
TOLD = (TOUCHES, SLIPS)  # of which something is told
TRIAL = "trial."  # in the path of an acceleration, see `FreeMotion.trial`
Kinds = tuple[int | None, ...]
# by what it is for, with the numbers that are compiled in; None where something cannot be recorded
Codes = dict[tuple[Any, ...], "Code | None"]


def _kind(onset: Onset) -> int | None:
    if isinstance(onset, Closed):
        return SLIPS if onset.sense else STICKS
    return None if onset is None else TOUCHES


def _onset(kind: int | None, onsets_given: Iterator[Any]) -> Onset:
    """The contact of a kind, with what is told of it: speed of approach, or sense of the slip."""
    if kind == SLIPS:
        return Closed(next(onsets_given))
    return next(onsets_given) if kind == TOUCHES else Closed(0) if kind == STICKS else None


def rates_of(motion: FreeMotion, codes: Codes | None = None, varied: Collection[str] = ()) -> CompiledRates | Walks:
    """The rates of a motion: by machine code where they may be, else by walks. codes, varied: see `CompiledRates`."""
    return CompiledRates(motion, codes, varied) if compilable(motion) else Walks(motion)


def compilable(motion: FreeMotion) -> bool:
    """Whether its rates may be machine code: without an assembly that is followed."""
    return not motion.followed


class CompiledRates:
    """The rates of `motion`, one program for every set of contacts that touch, senses and switches.

    codes: of motions of mechanisms that differ in numbers alone, to be added to; varied: paths of those numbers, none
    of which is compiled in. What cannot be recorded is told by walks.
    """

    def __init__(self, motion: FreeMotion, codes: Codes | None = None, varied: Collection[str] = ()) -> None:
        self.motion = motion
        self.codes: Codes = {} if codes is None else codes
        self.constant = literals({path: value for path, value in motion.values.items() if path not in varied})
        self.walks = Walks(motion)
        self.layout = Layout.of(motion)
        self._works = 2 * self.layout.coordinates + self.layout.bristles  # where they begin
        self.last = self._works + len(WORKS) + self.layout.touching  # of the numbers that are integrated
        self._programs: dict[tuple[Any, ...], Program | None] = {}

    def __call__(self, at: Moment) -> Rates:
        """The rates; one lane."""
        if program := self._program("rates", at):
            state = np.concatenate([at.q, at.rate, at.integral, at.bristles])[:, 0]
            rates = program.of_row(float(at.time[0]), state, at.onsets, at.sense)
            if rates[-1] == 0.0 and math.isfinite(rates.sum()):
                n, memory, rates_last = self.layout.coordinates, self._works, rates[: self.last].copy()
                return Rates(
                    rates_last[:n], rates_last[n : 2 * n], rates_last[2 * n : memory], rates_last[memory:], True
                )
        return self.walks(at)

    def seconds(self, at: Moment) -> Array:
        """See `Walks.seconds`."""
        if program := self._program("rates", at):
            numbers = program.run(at)
            if np.all(numbers[-1] == 0.0) and np.all(np.isfinite(numbers)):
                return numbers[: self.layout.coordinates]
        return self.walks.seconds(at)

    def derivative(
        self, time: float, row: Array, onsets: Sequence[Onset], now: float, senses: tuple[int, ...] = ()
    ) -> Array:
        """The derivative of a row, without ado: this is asked for some hundred thousand times. NaN for no answer."""
        if program := self._program_of("rates", onsets, now, senses):
            n, slopes = self.layout.coordinates, np.empty(len(row))
            rates = program.of_row(time, row[: self.layout.slip], onsets)
            slopes[:n], slopes[n:] = row[n : 2 * n], rates[: self.last]
            if rates[-1] == 0.0 and math.isfinite(slopes.sum()):
                return slopes
        return self.walks.derivative(time, row, onsets, now, senses)

    def margins(self, at: Moment) -> Array:
        """See `FreeMotion.margins`, (module, lane)."""
        if program := self._program("margins", at):
            numbers = program.run(at)
            if not np.any(numbers[-1]):
                return numbers[:-1]
        return self.walks.margins(at)

    def look(self, at: Moment) -> Seen:
        """See `rates.Seeing`."""
        if program := self._program("look", at):
            numbers = program.run(at)
            if not np.any(numbers[-1]):
                return Seen(*numbers[:-1].reshape(len(Seen._fields), -1, at.q.shape[1]))
        return self.walks.look(at)

    def _program(self, what: str, at: Moment) -> Program | None:
        return self._program_of(what, at.onsets, at.now, at.senses if what == "rates" else (), at.slips)

    def _program_of(
        self, what: str, onsets: Sequence[Onset], now: float, senses: tuple[int, ...], slips: float = 0.0
    ) -> Program | None:
        """The program; None while a joint sticks, and where something cannot be recorded."""
        if 0 in senses:
            return None
        kinds, switches = tuple(map(_kind, onsets)), tuple(drive.switches(now) for drive in self.motion.drives.values())
        key = what, kinds, switches, senses, slips
        if key not in self._programs:
            key_of_all = *key, self.motion.affine, self.motion.rests, *self.constant.items()
            if key_of_all not in self.codes:
                figures = self.figures(what, kinds)
                self.codes[key_of_all] = _code(self.motion, figures, kinds, switches, senses, slips, self.constant)
            code = self.codes[key_of_all]
            self._programs[key] = None if code is None else Program(self.motion, code)
        return self._programs[key]

    def figures(self, what: str, kinds: Kinds) -> Figures:
        """What a program computes: the rates, how near assemblies are to each other, or how the contacts are."""
        return {"rates": _rates_of, "margins": _margins, "look": _seen}[what]


class Code(NamedTuple):
    """Machine code of some numbers of a motion; the last of them: whether there is any doubt.

    paths: of the numbers of the mechanism that it takes; states: names of what it takes of every state; onsets: names
    of what is told of contacts; size: how many numbers it gives.
    """

    machine: MachineCode
    paths: tuple[str, ...]
    states: tuple[str, ...]
    onsets: tuple[str, ...]
    size: int


def _code(
    motion: FreeMotion, figures: Figures, kinds: Kinds, switches: Sequence[tuple[bool, bool, bool]],
    senses: tuple[int, ...], slips: float, constant: Mapping[str, Any],
) -> Code | None:  # fmt: skip
    """Record some numbers of a motion, and compile what is recorded; None where something cannot be recorded.

    constant: numbers that are compiled in.
    """
    from trunnion.engines.graph import POSITION, Graph
    from trunnion.engines.machine_code import MachineCode, vector_width
    from trunnion.engines.program import program
    from trunnion.engines.recorded import Recorded, number_of

    n, graph = len(motion.names), Graph()
    paths = tuple(path for path in _numbers(motion) if path not in constant)
    recorded: dict[str, Any] = {path: Recorded(graph, graph.input(path, 0)) for path in paths}
    variables = (*(f"{kind}{i}" for kind in ("q", "rate", "integral") for i in range(n)), *motion.bristles)
    states = ("time", *(f"state.{name}" for name in variables), "sense")
    time, *state, sense = [Recorded(graph, graph.input(name, POSITION)) for name in states]
    onsets = tuple(f"onset{k}" for k, kind in enumerate(kinds) if kind in TOLD)
    onsets_given: Any = iter([Recorded(graph, graph.input(name, 0)) for name in onsets])
    q, rate, integral, bristles = cast("Any", (state[:n], state[n : 2 * n], state[2 * n : 3 * n], state[3 * n :]))
    touching = tuple(_onset(kind, onsets_given) for kind in kinds)
    at = Moment(cast("Any", time), q, rate, integral, bristles, onsets=touching, senses=senses, slips=slips)
    if motion.rests:  # also where a speed is lost in rounding, it is known in which sense joints slide
        at = at._replace(sense=cast("Any", np.where(rate[0] != 0.0, np.sign(rate[0]), sense)))
    try:
        with np.errstate(all="ignore"):
            numbers = figures(_recorded(motion, {**constant, **recorded}, switches), at)
    except UntraceableError:
        return None
    *outputs_asked, doubt = [graph.as_float(number_of(graph, number)) for number in numbers]
    for number in graph.doubts:
        doubt = graph.apply("max", doubt, graph.as_float(number))
    outputs = [*outputs_asked, graph.as_float(doubt)]
    return Code(MachineCode(program(graph, outputs, vector_width())), paths, states, onsets, len(outputs))


def _numbers(motion: FreeMotion) -> dict[str, Any]:
    """Every number of a mechanism by its path, with accelerations by whose forces inertias are told."""
    return {**motion.values, **{f"{TRIAL}{name}": motion.trial[i] for i, name in enumerate(motion.names)}}


class Program:
    """The machine code of some numbers with the numbers of one motion, for lanes of states."""

    def __init__(self, motion: FreeMotion, code: Code) -> None:
        from trunnion.engines.machine_code import vector_width

        values = _numbers(motion)
        self.lanes, self.width, self.onsets = MOST_LANES, vector_width(), code.onsets
        self.numbers = {path: np.array([float(np.ravel(primal(values[path]))[0])]) for path in code.paths}
        self.numbers.update({name: np.zeros(1) for name in code.onsets})
        self.state = np.zeros((len(code.states), self.lanes))
        self.numbers.update(zip(code.states, self.state, strict=True))
        self.found = np.zeros((code.size, self.lanes))
        rows = [row[None] for row in self.found]
        # one state is done as one vector of the same lane
        self._short = code.machine.bound(self.numbers, rows, (0, 1), (0, self.width))
        self._long = code.machine.bound(self.numbers, rows, (0, 1), (0, self.lanes))

    def run(self, at: Moment) -> Array:
        """The numbers, (number, lane)."""
        sense = np.full((1, len(at.time)), at.sense)
        state, parts = np.vstack([at.time[None], at.q, at.rate, at.integral, at.bristles, sense]), list[Array]()
        self._begin(at.onsets)
        for low in range(0, state.shape[1], self.lanes):
            part = state[:, low : low + self.lanes]
            self.state[:, : part.shape[1]], self.state[:, part.shape[1] :] = part, part[:, -1:]
            self._long()
            parts.append(self.found[:, : part.shape[1]].copy())
        return np.hstack(parts)

    def of_row(self, time: float, state: Array, onsets: Sequence[Onset], sense: float = 0.0) -> Array:
        """The numbers of one state: coordinates, rates, integrals, deflections; overwritten by the next."""
        self._begin(onsets)
        self.state[0, : self.width] = time
        self.state[1:-1, : self.width] = state[:, None]
        self.state[-1, : self.width] = sense
        self._short()
        values: Array = self.found[:, 0]
        return values

    def _begin(self, onsets: Sequence[Onset]) -> None:
        onsets_given = [onset.sense if isinstance(onset, Closed) else onset for onset in onsets if _kind(onset) in TOLD]
        for name, number in zip(self.onsets, onsets_given, strict=True):
            self.numbers[name][0] = number


# ---- what is recorded -----------------------------------------------------------------------------------------


def _recorded(motion: FreeMotion, values: dict[str, Any], switches: Sequence[tuple[bool, bool, bool]]) -> FreeMotion:
    """The motion with numbers that write down what is done with them; what depends on their size is as it is."""
    own_drives = drives(motion.system, values, lambda value: value)
    own_drives = {name: drive.switched(*on) for (name, drive), on in zip(own_drives.items(), switches, strict=True)}
    recorded = replace(motion, run=replace(motion.run, values=values), drives=own_drives)
    trial = [values[f"{TRIAL}{name}"] for name in motion.names]
    vars(recorded).update(affine=motion.affine, resisted=motion.resisted, trial=trial)
    return recorded


def _rates_of(motion: FreeMotion, at: Moment) -> list[Number]:
    """Accelerations, rates of the controllers' integrals and of deflections, works, as `rates.Walks` has them; 1 where
    there is doubt."""
    doubt: Number = 0.0
    if motion.affine:
        second = _affine(motion, at)
    else:
        second, doubt = _by_rounds(motion, at)
    back = motion.solve(at, cast("Any", second), sliding=True)
    for settled in back.settled:
        doubt = np.maximum(doubt, np.where(settled.converged, 0.0, 1.0))
    memory = bristle_rates(motion, at, back)
    return [*second, *errors_of(motion, at), *memory, *works_of(back, at, motion.contacts), doubt]


def _by_rounds(motion: FreeMotion, at: Moment) -> tuple[list[Number], Number]:
    """Accelerations by Newton's method with slopes by differences, and 1 where it did not end, or where more
    acceleration takes less effort."""
    count, unit = len(motion.names), motion.trial

    def step(numbers: list[Number]) -> list[Number]:
        second, columns = numbers[:count], []
        missed = missing_of(motion, at, second)
        for k, size in enumerate(unit):
            ahead = DIFFERENCE * np.maximum(np.abs(second[k]), 1e-2 * size)
            ahead = np.where(second[k] < 0.0, -ahead, ahead)
            tried = [number + ahead if i == k else number for i, number in enumerate(second)]
            columns.append([(a - b) / ahead for a, b in zip(missing_of(motion, at, tried), missed, strict=True)])
        change, pivots = eliminated([list(row) for row in zip(*columns, strict=True)], missed)
        turned: Number = 1.0  # the sign of the determinant, see `state.Accelerated`
        for pivot in pivots:
            turned = np.where(pivot > 0.0, turned, -turned)
        return [*(number - part for number, part in zip(second, change, strict=True)), *change, turned]

    begin = [0.0 * rate for rate in at.rate]
    *step_and_change, positive = looped(step, [*begin, *begin, 1.0], ROUNDS)
    doubt: Number = np.where(positive > 0.0, 0.0, 1.0)
    for number, change, size in zip(step_and_change[:count], step_and_change[count:], unit, strict=True):
        small = CLOSE * np.maximum(np.abs(number), 1e-2 * size)
        doubt = np.maximum(doubt, np.where(np.abs(change) <= small, 0.0, 1.0))
    return step_and_change[:count], doubt


def _affine(motion: FreeMotion, at: Moment) -> list[Number]:
    """Accelerations where efforts are affine in them."""
    nothing: Any = [0.0] * len(motion.names)
    matrix = [list(row) for row in zip(*columns_of(motion, at), strict=True)]
    return eliminated(matrix, [-number for number in missing_of(motion, at, nothing)])[0]


def columns_of(motion: FreeMotion, at: Moment) -> list[list[Number]]:
    """The columns of M, from rest and without contacts, whose forces would leave no digits to the differences."""
    count = len(motion.names)
    nothing: Any = [0.0] * count
    still = at._replace(rate=nothing, onsets=(None,) * len(at.onsets))
    zero, columns = missing_of(motion, still, nothing), []
    for k, size in enumerate(motion.trial):
        step = [size if i == k else 0.0 for i in range(count)]
        columns.append(
            [(number - rest) / size for number, rest in zip(missing_of(motion, still, step), zero, strict=True)]
        )
    return columns


def errors_of(motion: FreeMotion, at: Moment) -> list[Number]:
    """Rates of the controllers' integrals."""
    drives: Any = enumerate(motion.drives.values())
    return [drive.error(at.time, at.rate[i], at.integral[i], at.now) for i, drive in drives]


def missing_of(motion: FreeMotion, at: Moment, second: Any) -> list[Number]:
    """E − T of every free coordinate."""
    back = motion.solve(at, second, sliding=True)
    driven = motion.driven(at, second, motion.beginning(at))
    return [back.efforts[name] - effort for name, effort in zip(motion.names, driven, strict=True)]


def _seen(motion: FreeMotion, at: Moment) -> list[Number]:
    """What `rates.Seen` has, of every contact."""
    nothing: Any = [0.0] * len(motion.names)
    pushes = motion.contacts.pushes(motion.walk(at, nothing), at.onsets)
    parts = [(state.gap, state.rate, state.slip, push.normal, push.friction) for state, push in pushes]
    return [*(part[i] for i in range(len(Seen._fields)) for part in parts), 0.0]


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
    solution: list[Number] = [0.0] * count
    for i in reversed(range(count)):
        rest = sum((matrix[i][j] * solution[j] for j in range(i + 1, count)), 0.0)
        solution[i] = (right[i] - rest) / matrix[i][i]
    return solution, pivots
