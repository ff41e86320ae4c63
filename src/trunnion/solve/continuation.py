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
from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, looped

System = Callable[[Sequence[Number], Number], tuple[list[Number], list[list[Number]]]]

FIRST_STEP = 0.05
LONGEST_STEP = 0.05
LAST_STEP = 1e-10  # to which the share at which a lane locks is found
NEWTON_LIMIT = 12
CLOSED = 1e-12  # of the largest unknown: residual of a solution, and about the error of a fold
TINY = 1e-300  # where all unknowns are 0
NEAR_AIM = 0.25  # of Newton's first step by which the corrected point may miss its aim
ALMOST = 0.98  # of what is left to the share at which a lane seems to lock
STRAIGHT = 1e-3  # of Newton's first step by which the corrected point misses its aim on a straight branch
TINY_MOVE = 0.02  # of the largest unknown
MOST_TRIALS = 200  # steps of a lane; 130 is much


def follow(
    system: System, start: Sequence[Number], most: float = 1.0, wanted: Number = True
) -> tuple[list[Number], Number]:
    """The solution and the share of each lane: `most`, or the share at which its solution ceases to exist.

    Steps double until one fails, to any length where the branch is straight. Then the share at which det J reaches 0 is
    guessed from its last fall: after a step that succeeds as for a solution that runs to infinity, or all that is left
    where det J does not fall, since it may have been a kink that smaller moves pass; after one that fails as for a
    fold, which is nearer, or half of what is left. A lane moves by its own numbers alone, whatever other lanes are
    followed with it, and whether it is compiled.

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
        x, (here, step, bad, determinant, pole, fold, going) = now[:count], now[count:]
        aim = np.minimum(here + step, most)
        moved, fresh, good, straight = _correct(system, x, aim, going > 0)
        x = [np.where(good, new, old) for new, old in zip(moved, x, strict=True)]
        last = ~good & (step <= 2 * LAST_STEP)
        bad = np.where(good, np.where(aim >= bad, np.inf, bad), np.minimum(bad, aim))
        ratio = np.minimum(fresh / determinant, 1.0)
        pole = np.where(good, step * ratio / (1 - ratio), pole)
        fold = np.where(good, pole * ratio / (1 + ratio), fold)
        here, determinant = np.where(good, aim, here), np.where(good, fresh, determinant)
        left = bad - here
        growing = np.minimum(2 * step, np.where(straight, np.inf, LONGEST_STEP * np.maximum(1.0, here)))
        # det J falls straight before solutions run to infinity, and is a square root of what is left before a fold
        closing = np.where(good, np.minimum(ALMOST * pole, left), np.minimum(ALMOST * fold, left / 2))
        step = np.where(np.isfinite(bad), np.maximum(closing, np.minimum(left, 2 * LAST_STEP)), growing)
        return [*x, here, step, bad, determinant, pole, fold, np.where((going > 0) & (here < most) & ~last, 1.0, 0.0)]

    lanes = np.where(wanted, 1.0, 0.0)
    begin, none = np.where(wanted, 0.0, most), 0.0 * lanes
    first = [*start, begin, FIRST_STEP + none, np.inf + none, 1.0 + none, np.inf + none, np.inf + none, lanes]
    with np.errstate(all="ignore"):
        *x, here, _, _, _, _, _, going = looped(trial, first, MOST_TRIALS, _ended)
    share = np.where(going > 0, np.nan, here)
    return [np.where(share >= most, value, np.nan) for value in x], share


def _correct(
    system: System, start: Sequence[Number], share: Number, lanes: Number
) -> tuple[list[Number], Number, Number, Number]:
    """Newton from `start` at the given share: the end, det J there, whether it stayed on the branch, whether straight.

    It did if it converged with det J > 0 all the way and ended near where its first step pointed, along the tangent
    of the branch. A tiny move need not: it may cross the kink that a guide has where its load changes ends. A move may
    be larger than the first one, beyond such a kink; where that is off the branch, so is the end.
    """
    residual, jacobian = system(start, share)
    (move,), determinant = linalg.solve(jacobian, residual)
    aim = [value - delta for value, delta in zip(start, move, strict=True)]
    calm = np.where(lanes & (determinant > 0), 1.0, 0.0)

    def correction(now: list[Number]) -> list[Number]:
        *x, determinant, closed, going = now
        residual, jacobian = system(x, share)
        (move,), fresh = linalg.solve(jacobian, residual)
        # not by the last move, which rounding keeps from ending where the unknowns run to infinity
        done = largest(residual) <= CLOSED * largest(x) + TINY
        ahead = (going > 0) & ~done & (fresh > 0)
        x = [np.where(ahead, value - delta, value) for value, delta in zip(x, move, strict=True)]
        determinant = np.where(going > 0, fresh, determinant)
        return [*x, determinant, np.where((going > 0) & done, 1.0, closed), np.where(ahead, 1.0, 0.0)]

    *x, determinant, closed, _ = looped(correction, [*aim, determinant, 0.0 * calm, calm], NEWTON_LIMIT, _ended)
    first, size = largest(move), largest(x)
    astray = largest([a - b for a, b in zip(x, aim, strict=True)])
    near = (astray <= NEAR_AIM * first) | (first + astray <= TINY_MOVE * size)
    good = (closed > 0) & (determinant > 0) & near & np.isfinite(size)
    return x, determinant, good, astray <= STRAIGHT * first


def _ended(now: Sequence[Number]) -> Number:
    """Lanes that go on no longer: the last entry of their state says so."""
    return ~(now[-1] > 0)


def largest(values: Sequence[Number]) -> Number:
    """Largest magnitude, elementwise; NaN if one is NaN."""
    return functools.reduce(np.maximum, [np.abs(primal(value)) for value in values])
