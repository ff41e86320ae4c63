"""Following a solution from no friction to full friction, many positions at once.

The solution that starts frictionless is the one nature takes; it is followed over the share s ∈ [0, 1] of the
friction. Where it folds back or runs to infinity (det J reaches 0), no solution continues: the module is locked
at that share, and a solution found beyond it by luck would be a wrong number.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence

import numpy as np

from trunnion.algebra import linalg
from trunnion.algebra.namespace import Number, looped

__all__ = ["System", "follow"]

System = Callable[[Sequence[Number], Number], tuple[list[Number], list[list[Number]]]]

FIRST_STEP = 0.05
LONGEST_STEP = 0.05
LAST_STEP = 1e-10  # to which the share at which a lane locks is found
NEWTON_LIMIT = 12
CLOSED = 1e-12  # of the largest unknown: residual of a solution, and about the error of a fold
TINY = 1e-300  # where all unknowns are 0
NEAR_AIM = 0.25  # of Newton's first step by which the corrected point may miss its aim
TINY_MOVE = 0.02  # of the largest unknown
MOST_TRIALS = 200  # steps of a lane; 130 is much


def follow(
    system: System, start: Sequence[Number], most: float = 1.0, wanted: Number = True
) -> tuple[list[Number], Number]:
    """The solution and the share of each lane: `most`, or the share at which its solution ceases to exist.

    Steps double until one fails; from then on the share is sought by halving, and every other time all that is left is
    tried, since it may have been a kink that smaller moves pass. A lane moves by its own numbers alone, whatever other
    lanes are followed with it, and whether it is compiled.

    Parameters
    ----------
    system : residual and Jacobian of all lanes for unknowns and a share
    start : the solution at share 0
    most : share at which a lane has arrived
    wanted : lanes to follow; the others are at `most` from the start

    Returns
    -------
    The unknowns, NaN in a lane that stops before `most`, and the shares; both NaN in one that takes more than
    MOST_TRIALS steps.
    """
    count = len(start)

    def trial(now: list[Number]) -> list[Number]:
        x, (here, step, bad, eager, going) = now[:count], now[count:]
        going, aim = going > 0, np.minimum(here + step, most)
        moved, good = _correct(system, x, aim, going)
        x = [np.where(going & good, new, old) for new, old in zip(moved, x, strict=True)]
        reached = np.where(good, aim, here)
        step_, bad_, eager_, last = _next(reached, aim, good, step, bad, eager > 0)
        still = going & (reached < most) & ~last
        old, new = (here, step, bad, eager), (reached, step_, bad_, np.where(eager_, 1.0, 0.0))
        return [*x, *(np.where(going, b, a) for a, b in zip(old, new, strict=True)), np.where(still, 1.0, 0.0)]

    lanes = np.where(wanted, 1.0, 0.0)
    first = [*start, np.where(wanted, 0.0, most), FIRST_STEP + 0.0 * lanes, np.inf + 0.0 * lanes, 0.0 * lanes, lanes]
    with np.errstate(all="ignore"):
        *x, here, _, _, _, going = looped(trial, first, MOST_TRIALS, _ended)
    share = np.where(going > 0, np.nan, here)
    return [np.where(share >= most, value, np.nan) for value in x], share


def _next(
    here: Number, trial: Number, good: Number, step: Number, bad: Number, eager: Number
) -> tuple[Number, Number, Number, Number]:
    """Step, least share that failed, whether all that is left is tried next, and whether nothing is left to be tried.

    here: share reached after `trial` was tried, which was `good` or not.
    """
    passed = good & (trial >= bad)
    last = ~good & (trial - here <= 2 * LAST_STEP)
    bad = np.where(passed, np.inf, np.where(good, bad, np.minimum(bad, trial)))
    eager = good & ~eager
    left = bad - here
    growing = np.minimum(2 * step, LONGEST_STEP * np.maximum(1.0, here))
    closing = np.where(eager | (left <= 2 * LAST_STEP), left, left / 2)
    return np.where(np.isfinite(bad), closing, growing), bad, eager, last


def _correct(system: System, start: Sequence[Number], share: Number, wanted: Number) -> tuple[list[Number], Number]:
    """Newton from `start` at the given share, and whether it stayed on the branch.

    It did if it converged with det J > 0 all the way and ended near where its first step pointed, along the tangent
    of the branch. A tiny move need not: it may cross the kink that a guide has where its load changes ends. A move may
    be larger than the first one, beyond such a kink; where that is off the branch, so is the end.
    """
    residual, jacobian = system(start, share)
    move, determinant = linalg.solve_and_determinant(jacobian, residual)
    aim = [value - delta for value, delta in zip(start, move, strict=True)]
    first, calm = _largest(move), np.where(wanted & (determinant > 0), 1.0, 0.0)

    def converged(x: Sequence[Number], residual: Sequence[Number]) -> Number:
        # not by the last move, which rounding keeps from ending where the unknowns run to infinity
        return _largest(residual) <= CLOSED * _largest(x) + TINY

    def correction(now: list[Number]) -> list[Number]:
        *x, calm, going = now
        residual, jacobian = system(x, share)
        going = ~converged(x, residual) & (calm > 0)
        move, determinant = linalg.solve_and_determinant(jacobian, residual)
        x = [np.where(going, value - delta, value) for value, delta in zip(x, move, strict=True)]
        return [*x, np.where(going & ~(determinant > 0), 0.0, calm), np.where(going, 1.0, 0.0)]

    *x, calm, _ = looped(correction, [*aim, calm, calm], NEWTON_LIMIT - 1, _ended)
    residual, jacobian = system(x, share)
    astray, size = _largest([a - b for a, b in zip(x, aim, strict=True)]), _largest(x)
    near = (astray <= NEAR_AIM * first) | (first + astray <= TINY_MOVE * size)
    good = converged(x, residual) & (calm > 0) & near & (linalg.determinant(jacobian) > 0)
    return x, good & np.isfinite(size)


def _ended(now: Sequence[Number]) -> Number:
    """Lanes that go on no longer: the last entry of their state says so."""
    return ~(now[-1] > 0)


def _largest(values: Sequence[Number]) -> Number:
    return functools.reduce(np.maximum, [np.abs(value) for value in values])
