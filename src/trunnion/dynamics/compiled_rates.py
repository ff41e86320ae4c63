"""Rates of a free motion as machine code: the walks recorded once.

Without friction in the joints E(q, q̇, q̈) = E₀ + M q̈: one walk at rest and one for each unit acceleration give M and E₀,
all at the same pose, so that the poses are computed once. The equation M q̈ = T − E₀ is solved by elimination as part
of the program; while contacts of rigid bodies are closed their forces are unknowns beside the accelerations, and the
accelerations of their gaps, and of the slips of those that stick, which are 0, equations beside the efforts.

With friction E is not affine: rounds of Newton's method, each with the walks for its own slopes, are a loop of the
program, and where they or the friction did not settle the walks are asked. What contacts touch, in which sense joints
slide and what is switched on decides which program it is; while a joint sticks the walks are asked.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import single
from trunnion.algebra.namespace import Number, UntraceableError, looped
from trunnion.dynamics.motor import drives
from trunnion.dynamics.rates import Dynamics, Layout, Rates, Seen, Walks, beside, bridged, seen
from trunnion.dynamics.state import DIFFERENCE, NONE, FreeMotion, Held, Moment
from trunnion.dynamics.touching import Closed, Onset
from trunnion.solve.walk_kernel import literals

if TYPE_CHECKING:
    from trunnion.engines.machine_code import MachineCode

Array = NDArray[np.float64]

ROUNDS = 5  # of Newton's method in a program
CLOSE = 1e-8  # of an acceleration: a last step of which the next is below rounding
MOST_LANES = 64  # that a program takes at a time
TRIAL = "trial."  # in the path of an acceleration, see `FreeMotion.trial`
# by what it is for, with the numbers that are compiled in; None where something cannot be recorded
Codes = dict[tuple[Any, ...], "Code | None"]


def rates_of(motion: FreeMotion, codes: Codes | None = None, varied: Collection[str] = ()) -> Dynamics:
    """The rates of a motion: by machine code where they may be, else by walks. codes, varied: see `CompiledRates`."""
    return bridged(motion, CompiledRates(motion, codes, varied))


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
        self._last = self.layout.size - self.layout.coordinates  # of what is integrated
        self._programs: dict[tuple[Any, ...], Program | None] = {}
        self._asked: tuple[Any, Program | None] = None, None

    def __call__(self, at: Moment) -> Rates:
        """The rates; one lane. This is asked for some hundred thousand times."""
        if program := self._program("rates", at):
            numbers = program.of_row(at)
            if numbers[-1] == 0.0 and math.isfinite(numbers.sum()):
                n, numbers = self.layout.coordinates, numbers.copy()
                return Rates(numbers[:n], numbers[n : self._last], True)
        return self.walks(at)

    def seconds(self, at: Moment) -> Array:
        """See `rates.Dynamics`."""
        numbers = self._numbers("rates", at)
        return self.walks.seconds(at) if numbers is None else numbers[: self.layout.coordinates]

    def look(self, at: Moment) -> Seen:
        """See `rates.Dynamics`."""
        closed = any(isinstance(onset, Closed) for onset in at.onsets)
        numbers = self._numbers("rates" if closed else "look", at)
        if numbers is None:
            return self.walks.look(at)
        return Seen(*numbers[self._last if closed else 0 :].reshape(len(Seen._fields), -1, at.q.shape[1]))

    def _numbers(self, what: str, at: Moment) -> Array | None:
        """The numbers of a program, (number, lane); None where there is any doubt."""
        program = self._program(what, at)
        numbers = None if program is None else program.run(at)
        return None if numbers is None or np.any(numbers[-1]) else numbers[:-1]

    def _program(self, what: str, at: Moment) -> Program | None:
        """The program; None where an assembly is followed, while a joint sticks, where a contact of rigid bodies is
        closed beside friction, and where something cannot be recorded."""
        asked = what, at.onsets, at.now, at.senses, at.slips
        if asked == self._asked[0]:  # some hundred thousand times it is the last one again
            return self._asked[1]
        motion, program = self.motion, None
        touching = tuple(onset if isinstance(onset, Closed) else onset is not None for onset in at.onsets)
        closed = any(isinstance(onset, Closed) for onset in at.onsets)
        senses = at.senses if what == "rates" else ()
        if not (motion.followed or 0 in senses or (closed and not motion.affine)):
            senses = senses if motion.several else ()
            switches = tuple(drive.switches(at.now) for drive in motion.drives.values())
            key = what, touching, switches, senses, at.slips
            if key not in self._programs:
                key_of_all = *key, motion.affine, bool(motion.resisted), *self.constant.items()
                if key_of_all not in self.codes:
                    self.codes[key_of_all] = _code(motion, *key, self.constant)
                code = self.codes[key_of_all]
                self._programs[key] = None if code is None else Program(motion, code)
            program = self._programs[key]
        self._asked = asked, program
        return program


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
    motion: FreeMotion, what: str, touching: Sequence[bool | Closed], switches: Sequence[tuple[bool, bool, bool]],
    senses: tuple[int, ...], slips: float, constant: Mapping[str, Any],
) -> Code | None:  # fmt: skip
    """Record some numbers of a motion, and compile what is recorded; None where something cannot be recorded.

    what: the rates, or a look at the contacts; touching: of every contact whether it touches, or how it is closed;
    constant: numbers that are compiled in.
    """
    from trunnion.engines.graph import POSITION, Graph
    from trunnion.engines.machine_code import MachineCode, vector_width
    from trunnion.engines.program import program
    from trunnion.engines.recorded import Recorded, number_of

    n, graph = len(motion.names), Graph()
    paths = tuple(path for path in _numbers(motion) if path not in constant)
    recorded: dict[str, Any] = {path: Recorded(graph, graph.input(path, 0)) for path in paths}
    clutch = ["slip"] if any(drive.clutched for drive in motion.drives.values()) else []
    variables = (*(f"{kind}{i}" for kind in ("q", "rate", "integral") for i in range(n)), *motion.bristles, *clutch)
    states = ("time", *(f"state.{name}" for name in variables), "sense")
    time, *state, sense = [Recorded(graph, graph.input(name, POSITION)) for name in states]
    slip: Any = [state.pop() for _ in clutch]
    onsets = {k: f"onset{k}" for k, touches in enumerate(touching) if touches is True}
    approach: dict[int, Any] = {k: Recorded(graph, graph.input(name, 0)) for k, name in onsets.items()}
    q, rate, integral, bristles = cast("Any", (state[:n], state[n : 2 * n], state[2 * n : 3 * n], state[3 * n :]))
    begun = tuple(each if isinstance(each, Closed) else approach.get(k) for k, each in enumerate(touching))
    at = Moment(cast("Any", time), q, rate, integral, bristles, slip, onsets=begun, senses=senses, slips=slips)
    if motion.resisted and not motion.several:  # where a speed is lost in rounding, the sense is known still
        at = at._replace(senses=(cast("Any", np.where(rate[0] != 0.0, np.sign(rate[0]), sense)),))
    try:
        with np.errstate(all="ignore"):
            of = _recorded(motion, {**constant, **recorded}, switches)
            numbers = _rates_of(of, at) if what == "rates" else [*_seen(of, at), 0.0]
    except UntraceableError:
        return None
    *outputs_asked, doubt = [graph.as_float(number_of(graph, number)) for number in numbers]
    for number in graph.doubts:
        doubt = graph.apply("max", doubt, graph.as_float(number))
    outputs = [*outputs_asked, graph.as_float(doubt)]
    machine = MachineCode(program(graph, outputs, vector_width()))
    return Code(machine, paths, states, tuple(onsets.values()), len(outputs))


def _numbers(motion: FreeMotion) -> dict[str, Any]:
    """Every number of a mechanism by its path, with accelerations by whose forces inertias are told."""
    return {**motion.values, **{f"{TRIAL}{name}": motion.trial[i] for i, name in enumerate(motion.names)}}


class Program:
    """The machine code of some numbers with the numbers of one motion, for lanes of states."""

    def __init__(self, motion: FreeMotion, code: Code) -> None:
        from trunnion.engines.machine_code import vector_width

        values = _numbers(motion)
        self.lanes, self.width, self.onsets = MOST_LANES, vector_width(), code.onsets
        self.numbers = {path: np.array([single(values[path])]) for path in code.paths}
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
        state, parts = np.vstack([at.time[None], *at[1:6], np.full((1, len(at.time)), self._sense(at))]), list[Array]()
        self._begin(at.onsets)
        for low in range(0, state.shape[1], self.lanes):
            part = state[:, low : low + self.lanes]
            self.state[:, : part.shape[1]], self.state[:, part.shape[1] :] = part, part[:, -1:]
            self._long()
            parts.append(self.found[:, : part.shape[1]].copy())
        return np.hstack(parts)

    def of_row(self, at: Moment) -> Array:
        """The numbers of one state, overwritten by the next."""
        self._begin(at.onsets)
        self.state[0, : self.width] = at.time[0]
        self.state[1:-1, : self.width] = np.concatenate(at[1:6])
        self.state[-1, : self.width] = self._sense(at)
        self._short()
        values: Array = self.found[:, 0]
        return values

    @staticmethod
    def _sense(at: Moment) -> int:
        """Of the motion of one coordinate that may rest."""
        return at.senses[0] if at.senses else 0

    def _begin(self, onsets: Sequence[Onset]) -> None:
        begun = (onset for onset in onsets if onset is not None and not isinstance(onset, Closed))
        for name, onset in zip(self.onsets, begun, strict=True):
            self.numbers[name][0] = onset


# ---- what is recorded -----------------------------------------------------------------------------------------


def _recorded(motion: FreeMotion, values: dict[str, Any], switches: Sequence[tuple[bool, bool, bool]]) -> FreeMotion:
    """The motion with numbers that write down what is done with them; what depends on their size is as it is."""
    own_drives = drives(motion.system, values, lambda value: value)
    own_drives = {name: drive.switched(*on) for (name, drive), on in zip(own_drives.items(), switches, strict=True)}
    recorded = replace(motion, run=replace(motion.run, values=values), drives=own_drives)
    trial = [values[f"{TRIAL}{name}"] for name in motion.names]
    vars(recorded).update(affine=motion.affine, resisted=motion.resisted, trial=trial, force=motion.force)
    return recorded


def _rates_of(motion: FreeMotion, at: Moment) -> list[Number]:
    """Accelerations, rates of the controllers' integrals and of deflections, works, as `rates.Walks` has them, where
    contacts of rigid bodies are closed also what `rates.Seen` has; 1 where there is doubt."""
    second, at, doubt = _affine(motion, at) if motion.affine else _by_rounds(motion, at)
    back = motion.solve(at, cast("Any", second), motion.senses(at), sliding=True)
    for settled in back.settled:
        doubt = np.maximum(doubt, np.where(settled.converged, 0.0, 1.0))
    contacts = _seen(motion, at) if any(isinstance(onset, Closed) for onset in at.onsets) else []
    return [*second, *beside(motion, at, second, back), *contacts, doubt]


def _by_rounds(motion: FreeMotion, at: Moment) -> tuple[list[Number], Moment, Number]:
    """Accelerations by Newton's method with slopes by differences, the moment, and 1 where it did not end, or where
    more acceleration takes less effort."""
    count, unit = len(motion.names), motion.trial

    def step(numbers: list[Number]) -> list[Number]:
        second = numbers[:count]
        sizes = [
            DIFFERENCE * np.maximum(np.abs(number), 1e-2 * size) for number, size in zip(second, unit, strict=True)
        ]
        ahead = [np.where(number < 0.0, -size, size) for number, size in zip(second, sizes, strict=True)]
        missed = _missed(motion, at, second)
        change, pivots = _eliminated(_slopes(motion, at, second, ahead, missed), missed)
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
    return step_and_change[:count], at, doubt


def _affine(motion: FreeMotion, at: Moment) -> tuple[list[Number], Moment, Number]:
    """Accelerations where efforts are affine in them, the moment with the forces of closed contacts, and 1 where there
    is doubt.

    The slopes are told from rest and without contacts that give, whose forces would leave no digits to the differences.
    """
    count, active = len(motion.names), motion.held(at)
    doubt: Number = 0.0
    units = [*motion.trial, *[motion.force] * (len(active.closed) + len(active.walls))]
    nothing: Any = [0.0] * len(units)
    closed = tuple(onset if isinstance(onset, Closed) else None for onset in at.onsets)
    still = at._replace(rate=nothing[:count], onsets=closed)
    matrix = _slopes(motion, still, nothing, units, _missed(motion, still, nothing, active), active)
    numbers, pivots = _eliminated(matrix, [-number for number in _missed(motion, at, nothing, active)])
    if active.closed:
        for pivot in pivots:  # where one is not above 0 the forces have no solution, or several
            doubt = np.maximum(doubt, np.where(pivot > 0.0, 0.0, 1.0))
        at = at._replace(onsets=motion.shared(motion.forced(at.onsets, numbers[count:], active), active.walls))
    return numbers[:count], at, doubt


def _missed(motion: FreeMotion, at: Moment, numbers: Any, active: Held = NONE) -> list[Number]:
    """See `FreeMotion.misses`. numbers: accelerations, then the forces of closed contacts."""
    count = len(motion.names)
    return motion.misses(at, numbers[:count], numbers[count:], active, motion.senses(at))[0]


def _slopes(
    motion: FreeMotion, at: Moment, numbers: list[Number], steps: Sequence[Number], missed: list[Number],
    active: Held = NONE,
) -> list[list[Number]]:  # fmt: skip
    """How what is missed changes with each of the numbers, (equation, number), by differences."""
    columns = []
    for k, step in enumerate(steps):
        tried = _missed(motion, at, [number + step if i == k else number for i, number in enumerate(numbers)], active)
        columns.append([(after - before) / step for after, before in zip(tried, missed, strict=True)])
    return [list(row) for row in zip(*columns, strict=True)]


def _seen(motion: FreeMotion, at: Moment) -> list[Number]:
    """What `rates.Seen` has, of every contact."""
    nothing: Any = [0.0] * len(motion.names)
    return [*itertools.chain(*seen(motion, motion.walk(at, nothing), at.onsets))]


def _eliminated(matrix: list[list[Number]], right: list[Number]) -> tuple[list[Number], list[Number]]:
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
