"""The equations of `lanes` as machine code: written on numbers, recorded once, run on vectors of lanes.

Friction forces φ = f N(r₀ + R φ) by Newton's method from the last ones; a lane that is settled stays as it is, whatever
lanes are beside it. Where the bound of the map's derivative is not below `lanes.CONTRACTION`, or the rounds do not do,
the lane is left to NumPy.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.linalg import quick_inverse, weighted
from trunnion.algebra.namespace import Number, looped, namespace
from trunnion.dynamics.tables import FIXED

__all__ = ["CompiledLanes", "Settled"]

Array = NDArray[np.float64]
Numbers = Sequence[Number]

CONTRACTION = 0.9  # as in `lanes`, of the plainer bound
CLOSE = 1e-6  # of the largest friction, as in `lanes`
ROUNDS = 8
GIVEN = ("speed", "through", "share", "free", "brake", "rotor")  # share: of the gear; free: effort of the shaft


class Settled(NamedTuple):
    """Friction forces (lane, contact), N, q̈ and mass (lane,), and which lanes are settled."""

    friction: Array
    second: Array
    mass: Array
    settled: NDArray[np.bool_]


class CompiledLanes:
    """The program for contacts in pins and in guides, and room for the numbers of at most so many lanes."""

    def __init__(self, pins: tuple[bool, ...], lanes: int) -> None:
        from trunnion.engines.machine_code import vector_width

        self.code, names = _code(pins)
        self.count, self.width = len(pins), vector_width()
        size = -(-lanes // self.width) * self.width
        self.room = np.zeros((len(names), size))
        self.inputs = dict(zip(names, self.room, strict=True))
        self.found = np.zeros((self.count + 3, size))
        self._calls: dict[int, Callable[[], None]] = {}

    def __call__(self, matrix: Array, per: Array, begin: Array, given: Sequence[Array | float]) -> Settled:
        """Of lanes: columns (lane, E and components, column), friction per normal load and where the rounds begin
        (lane, contact), and GIVEN (lane,)."""
        lanes, wide = len(matrix), self.count * 2
        room = self.room[:, :lanes]
        for row, one in zip(room, given, strict=False):
            row[:] = one
        low = len(GIVEN)
        room[low : low + self.count], room[low + self.count : low + wide] = per.T, begin.T
        room[low + wide :] = matrix.reshape(lanes, -1).T
        self._run(-(-lanes // self.width) * self.width)
        found = self.found[:, :lanes].copy()
        sound = (found[-1] != 0.0) & np.isfinite(found[self.count])
        return Settled(found[: self.count].T, found[self.count], found[self.count + 1], sound)

    def _run(self, lanes: int) -> None:
        """As many lanes of the room as there are in whole vectors."""
        if lanes not in self._calls:
            rows = [row[None] for row in self.found]
            self._calls[lanes] = self.code.bound(self.inputs, rows, (0, 1), (0, lanes))
        self._calls[lanes]()


@functools.cache
def _code(pins: tuple[bool, ...]) -> tuple[Any, list[str]]:
    """Machine code, and the names of what it takes, in order."""
    from trunnion.engines.graph import POSITION, Graph
    from trunnion.engines.machine_code import MachineCode, vector_width
    from trunnion.engines.program import program
    from trunnion.engines.recorded import Recorded, number_of

    graph, count = Graph(), len(pins)
    size, wide = 1 + 2 * count, FIXED + count
    names = [*GIVEN, *(f"{what}{k}" for what in ("per", "begin") for k in range(count))]
    names += [f"column{k}" for k in range(size * wide)]
    numbers = [Recorded(graph, graph.input(name, POSITION)) for name in names]
    low, high = len(GIVEN), len(GIVEN) + 2 * count
    rows = [numbers[high + i * wide : high + (i + 1) * wide] for i in range(size)]
    found = solved(pins, rows, numbers[low : low + count], numbers[low + count : high], *numbers[:low])
    return MachineCode(program(graph, [graph.as_float(number_of(graph, one)) for one in found], vector_width())), names


def solved(
    pins: Sequence[bool], rows: Sequence[Numbers], per: Numbers, begin: Numbers, speed: Number, through: Number,
    share: Number, free: Number, brake: Number, rotor: Number,
) -> list[Number]:  # fmt: skip
    """Friction forces, N, q̈, mass, and whether they are settled: E = T with the contacts' forces eliminated.

    rows: columns of E and of the components of every contact, see `tables`; per: friction per normal load.
    """
    xp, count = namespace(*per, speed), len(pins)
    known = [r[1] * (speed * speed) + r[2] * speed + xp.where(through > 0.0, r[3], r[4]) for r in rows]
    mass = rows[0][0] + share * rotor
    start = (share * free - brake - known[0]) / mass
    own = rows[0][FIXED:]
    influence = [[a - row[0] * (b / mass) for a, b in zip(row[FIXED:], own, strict=True)] for row in rows[1:]]
    first = [row[0] * start + one for row, one in zip(rows[1:], known[1:], strict=True)]
    certain = True
    for k in range(count):
        bound = sum((xp.abs(a) + xp.abs(b) for a, b in zip(*influence[2 * k : 2 * k + 2], strict=True)), 0.0)
        certain = certain & (xp.abs(per[k]) * bound < CONTRACTION)

    def better(state: Numbers) -> list[Number]:
        *friction, done = state
        miss, slopes = _missed(pins, per, first, influence, friction)
        step = [weighted(row, miss) for row in quick_inverse(slopes)]  # a bound below 1: the diagonal is largest
        new = [xp.where(done > 0.0, one, one + more) for one, more in zip(friction, step, strict=True)]
        close = _largest(xp, miss) <= CLOSE * _largest(xp, new)
        return [*new, xp.where(close | (done > 0.0), 1.0, 0.0)]

    *friction, done = looped(better, [*begin, 0.0 * speed], ROUNDS)
    second = start - sum((a * b for a, b in zip(own, friction, strict=True)), 0.0) / mass
    return [*friction, second, mass, xp.where(certain & (done > 0.0), 1.0, 0.0)]


def _missed(
    pins: Sequence[bool], per: Numbers, first: Numbers, influence: Sequence[Numbers], friction: Numbers
) -> tuple[list[Number], list[list[Number]]]:
    """f N − φ of every contact, and 1 less its map's derivative."""
    miss, slopes, xp = list[Number](), list[list[Number]](), namespace(*per)
    reaction = [one + sum((a * b for a, b in zip(row, friction, strict=True)), 0.0)
                for one, row in zip(first, influence, strict=True)]  # fmt: skip
    for k, pin in enumerate(pins):
        x, y = reaction[2 * k : 2 * k + 2]
        if pin:
            normal = xp.sqrt(x * x + y * y)
            size = xp.where(normal > 0.0, normal, np.inf)
            gx, gy = x / size, y / size
        else:
            across = xp.abs(x) >= xp.abs(y)
            normal = xp.where(across, xp.abs(x), xp.abs(y))
            gx, gy = xp.where(across, xp.sign(x), 0.0), xp.where(across, 0.0, xp.sign(y))
        miss.append(per[k] * normal - friction[k])
        pairs = zip(*influence[2 * k : 2 * k + 2], strict=True)
        slopes.append([(1.0 if i == k else 0.0) - per[k] * (gx * a + gy * b) for i, (a, b) in enumerate(pairs)])
    return miss, slopes


def _largest(xp: Any, numbers: Numbers) -> Number:
    return functools.reduce(xp.maximum, [xp.abs(one) for one in numbers])
