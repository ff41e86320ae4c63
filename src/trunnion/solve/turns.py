"""Angles without jumps, as integrals of their rates: by how many whole turns those in (−π, π] are off."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Accuracy, Courses
from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number
from trunnion.solve.switches import accuracy_of, breaks_between
from trunnion.solve.system import Cycle

__all__ = ["near", "turned"]

Array = NDArray[np.float64]
TURN = 2 * np.pi
TURNING = Accuracy(1e-4, 1e-6, shortest=1e-6)  # of the rates, whose integrals tell whole turns


def near(number: Number, to: Any, turn: float = TURN) -> Number:
    """The number and so many whole turns that it is as near as can be to another."""
    return number - turn * np.rint((primal(number) - to) / turn)


def turned(
    cycle: Cycle,
    look: Callable[[Array], tuple[Array, NDArray[np.integer]]],
    firsts: Callable[[Array], Sequence[Number]],
    knots: Array,
    span: tuple[float, float],
) -> list[tuple[Array, Array]]:
    """Times, s, and angles over a span, of each row of rates that `look` gives at times with the states there.

    firsts: the angles of all rows at times, one a row, from which each goes on; knots: times, s, at which rates may
    bend.
    """
    rates = Courses.of(look, breaks_between(cycle, knots, *span), None, accuracy_of(cycle, TURNING))
    rows = [rates.integral(row) for row in range(len(rates.sizes))]
    nodes = rows[0][0]
    starts = np.argmax(np.isfinite(rates.at(nodes)), axis=1)
    begins = [
        float(np.broadcast_to(primal(angle), starts.shape)[row]) for row, angle in enumerate(firsts(nodes[starts]))
    ]
    return [
        (time, angle - angle[start] + np.nan_to_num(begin))
        for (time, angle), start, begin in zip(rows, starts, begins, strict=True)
    ]
