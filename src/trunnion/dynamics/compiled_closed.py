"""Machine code of contacts of rigid bodies that stay closed: their forces are unknowns beside the accelerations.

  M q̈ − W_f λ = T − E₀,  W q̈ = −w₀

with λ the normal forces and, where a contact sticks, those along the tangent; W the accelerations of gaps and of the
slips that stay 0 by q̈, W_f the efforts of the forces, friction of those that slip included. All is affine, so that
every column is a difference of two walks at the same pose, from rest; see `compiled_rates`.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from trunnion.algebra.namespace import Number, namespace
from trunnion.dynamics.compiled_rates import (
    CompiledRates,
    Figures,
    Kinds,
    columns_of,
    compilable,
    eliminated,
    errors_of,
    missing_of,
)
from trunnion.dynamics.rates import Seen, works_of
from trunnion.dynamics.state import FreeMotion, Held, Linear, Moment
from trunnion.dynamics.touching import ContactState
from trunnion.solve.forward import Forward

__all__ = ["CompiledClosed", "compiled_closed"]


def compiled_closed(motion: FreeMotion) -> CompiledClosed | None:
    """The rates as machine code; None where they cannot be."""
    sure = motion.affine and not motion.sticking
    return CompiledClosed(motion) if sure and compilable(motion) else None


class CompiledClosed(CompiledRates):
    """The rates with contacts that fly or stay closed, one program for every set of those that are closed."""

    def figures(self, what: str, kinds: Kinds) -> Figures:
        """Rates and contacts of closed ones come from one program."""
        if what == "linear":
            return _linear
        if what == "rates" and any(kinds):
            return functools.partial(_closed, force=self.motion.force)
        return super().figures(what, kinds)

    def look(self, at: Moment) -> Seen:
        """See `rates.Seeing`; without forces."""
        return super().look(at._replace(onsets=(None,) * len(at.onsets)))

    def touches(self, at: Moment) -> Seen:
        """See `rates.Rigid`; by walks where there is any doubt."""
        program = self._program("rates", at)
        rates = None if program is None else program.run(at)
        if rates is None or np.any(rates[-1]) or not np.all(np.isfinite(rates)):
            return self.walks.touches(at)
        return Seen(*rates[self.last : -1].reshape(len(Seen._fields), -1, at.q.shape[1]))

    def linear(self, at: Moment) -> Linear:
        """See `rates.Rigid`; by walks where there is any doubt."""
        count, contacts = self.layout.coordinates, len(at.onsets)
        free = at._replace(onsets=(None,) * contacts)
        program = self._program("linear", free)
        numbers = None if program is None else program.run(free)[:, 0]
        if numbers is None or numbers[-1] or not np.all(np.isfinite(numbers)):
            return self.walks.linear(at)
        mass, rest = numbers[: count * count].reshape(count, count).T, numbers[count * count : -1]
        ways = rest[: 2 * contacts * count].reshape(count, 2 * contacts).T
        return Linear(mass, ways, *np.split(rest[2 * contacts * count :], [2 * contacts]))


# ---- what is recorded -----------------------------------------------------------------------------------------


def _linear(motion: FreeMotion, at: Moment) -> list[Number]:
    """Columns of M, of W for rates of gaps and slips, these at rest, and gaps."""
    count = len(motion.names)
    nothing: Any = [0.0] * count

    def states(rate: Any) -> list[ContactState]:
        return motion.contacts.states(motion.walk(at._replace(rate=rate), nothing))

    still = states(nothing)
    rest, columns = _rates(still), list[Number]()
    for k in range(count):
        moved = _rates(states([1.0 if i == k else 0.0 for i in range(count)]))
        columns += [number - zero for number, zero in zip(moved, rest, strict=True)]
    mass = [number for column in columns_of(motion, at) for number in column]
    return [*mass, *columns, *rest, *(state.gap for state in still), 0.0]


def _rates(states: Sequence[ContactState]) -> list[Number]:
    return [*(state.rate for state in states), *(state.slip for state in states)]


def _closed(motion: FreeMotion, at: Moment, force: float) -> list[Number]:
    """What the rates are, and of every contact what `rates.Seen` has."""
    nothing: Any = [0.0] * len(motion.names)
    free = at._replace(onsets=(None,) * len(at.onsets))
    still = free._replace(rate=nothing)
    active = motion.held(at)
    contacts = len(active.closed) + len(active.walls)
    columns = [column + more for column, more in zip(columns_of(motion, at),
               _driven(motion, still, active), strict=True)]  # fmt: skip
    zero = missing_of(motion, still, nothing)
    for k in range(contacts):
        forces = [force if i == k else 0.0 for i in range(contacts)]
        pushed = missing_of(motion, still._replace(onsets=motion.forced(at.onsets, forces, active)), nothing)
        stiffness: list[Number] = [(number - rest) / force for number, rest in zip(pushed, zero, strict=True)]
        columns.append(stiffness + [0.0] * contacts)
    right = [*missing_of(motion, free, nothing), *_kept(motion, motion.walk(free, nothing), active)]
    numbers, pivots = eliminated([list(row) for row in zip(*columns, strict=True)], [-number for number in right])
    second: Any = numbers[: len(nothing)]
    onsets = motion.forced(at.onsets, numbers[len(nothing) :], active)
    done = at._replace(onsets=motion.shared(onsets, active.walls))
    pushes = motion.contacts.pushes(motion.walk(at, nothing), done.onsets)
    touches = [(state.gap, state.rate, state.slip, push.normal, push.friction) for state, push in pushes]
    columns_seen = [number[i] for i in range(len(Seen._fields)) for number in touches]
    xp = namespace(pivots[0])
    least = functools.reduce(xp.minimum, pivots)
    second = [xp.where(least > 0.0, number, np.nan) for number in second]
    back = motion.solve(done, second, sliding=True)
    return [*second, *errors_of(motion, at), *works_of(back, done, motion.contacts), *columns_seen, 0.0]


def _driven(motion: FreeMotion, still: Moment, active: Held) -> list[list[Number]]:
    """W: accelerations of gaps and of slips that stay 0, by those of the coordinates; a list for each coordinate."""
    unit, nothing = motion.trial, cast("Any", [0.0] * len(motion.trial))
    zero, columns = _kept(motion, motion.walk(still, nothing), active), []
    for k, size in enumerate(unit):
        step: Any = [size if i == k else 0.0 for i in range(len(unit))]
        moved = _kept(motion, motion.walk(still, step), active)
        columns.append([(number - rest) / size for number, rest in zip(moved, zero, strict=True)])
    return columns


def _kept(motion: FreeMotion, walk: Forward, active: Held) -> list[Number]:
    """Accelerations that closed contacts keep at 0: of gaps, and of slips of those that stick."""
    moved = {k: motion.contacts.each[k].accelerations(walk) for k in active.closed}
    return [*(moved[k][0] for k in active.closed), *(moved[k][1] for k in active.walls)]
