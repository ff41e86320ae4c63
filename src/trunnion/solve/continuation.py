"""Following a solution from no friction to full friction, many positions at once.

The solution that starts frictionless is the one nature takes; it is followed over the share s ∈ [0, 1] of the
friction. Where it folds back or runs to infinity (det J reaches 0), no solution continues: the module is locked
at that share, and a solution found beyond it by luck would be a wrong number.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra import linalg
from trunnion.algebra.namespace import Number, looped

__all__ = ["Family", "System", "follow", "followed"]

Array = NDArray[np.float64]
System = Callable[[Sequence[Number], Number], tuple[list[Number], list[list[Number]]]]
Family = Callable[[NDArray[np.intp]], System]

FIRST_STEP = 0.05
LONGEST_STEP = 0.05
LAST_STEP = 1e-9  # to which the share at which a lane locks is found
NEWTON_LIMIT = 12
CONVERGED = 1e-9  # of the largest unknown: last move and residual
TINY = 1e-300  # where all unknowns are 0
NEAR_AIM = 0.25  # of Newton's first step by which the corrected point may miss its aim
TINY_MOVE = 0.02  # of the largest unknown
MOST_TRIALS = 240  # steps of a lane that is compiled; 130 is much


def follow(family: Family, start: Sequence[Array], most: float = 1.0) -> tuple[list[Array], Array]:
    """(solution, share) of each lane: the share is `most`, or that at which the lane's solution ceases to exist.

    family(lanes)(x, s) gives residual and Jacobian of some lanes, and `start` solves them at s = 0. The solution of a
    lane that stops before `most` is NaN.

    Steps double until one fails; from then on the share is sought by halving, and every other time all that is left is
    tried, since it may have been a kink that smaller moves pass.
    """
    x = [value.copy() for value in start]
    share = np.zeros(len(x[0]))
    lanes = np.arange(len(share))
    system, step = family(lanes), np.full(len(share), FIRST_STEP)
    bad, eager = np.full(len(share), np.inf), np.zeros(len(share), bool)
    while len(lanes):
        here = share[lanes]
        trial = np.minimum(here + step, most)
        found, good = _correct(system, [value[lanes] for value in x], trial)
        for value, new in zip(x, found, strict=True):
            value[lanes] = np.where(good, new, value[lanes])
        share[lanes] = here = np.where(good, trial, here)
        step, bad, eager, last = _next(here, trial, good, step, bad, eager)
        going = (here < most) & ~last
        if not np.all(going):
            lanes, step, bad, eager = lanes[going], step[going], bad[going], eager[going]
            system = family(lanes)
    solved = share >= most
    return [np.where(solved, value, np.nan) for value in x], share


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


def followed(system: System, start: Sequence[Number], wanted: Number, most: float) -> Number:
    """The share of `follow` for numbers that are compiled: of the lanes that are wanted, `most` of the others.

    NaN in a lane that would take more than MOST_TRIALS.
    """
    count = len(start)

    def trial(now: list[Number]) -> list[Number]:
        x, (here, step, bad, eager, going) = now[:count], now[count:]
        going, aim = going > 0, np.minimum(here + step, most)
        found, good = _corrected(system, x, aim)
        x = [np.where(going & good, new, old) for new, old in zip(found, x, strict=True)]
        reached = np.where(good, aim, here)
        step_, bad_, eager_, last = _next(reached, aim, good, step, bad, eager > 0)
        still = going & (reached < most) & ~last
        old, new = (here, step, bad, eager), (reached, step_, bad_, np.where(eager_, 1.0, 0.0))
        return [*x, *(np.where(going, b, a) for a, b in zip(old, new, strict=True)), np.where(still, 1.0, 0.0)]

    first = [*start, np.where(wanted, 0.0, most), FIRST_STEP, np.inf, 0.0, np.where(wanted, 1.0, 0.0)]
    here, _, _, _, going = looped(trial, first, MOST_TRIALS)[count:]
    return np.where(going > 0, np.nan, here)


def _corrected(system: System, start: Sequence[Number], share: Number) -> tuple[list[Number], Number]:
    """What `_correct` does, for numbers that are compiled: a lane that is done, or astray, moves no more."""
    residual, jacobian = system(start, share)
    move, determinant = linalg.solve_and_determinant(jacobian, residual)
    aim = [value - delta for value, delta in zip(start, move, strict=True)]
    first = _largest(move)

    def judged(x: Sequence[Number], residual: Sequence[Number], error: Number) -> Number:
        enough = CONVERGED * _largest(x) + TINY
        return (error <= enough) & (_largest(residual) <= enough)

    def correction(now: list[Number]) -> list[Number]:
        *x, error, calm = now
        residual, jacobian = system(x, share)
        going = ~judged(x, residual, error) & (calm > 0) & ~(error > first)
        move, determinant = linalg.solve_and_determinant(jacobian, residual)
        x = [np.where(going, value - delta, value) for value, delta in zip(x, move, strict=True)]
        calm = np.where(going & ~(determinant > 0), 0.0, calm)
        return [*x, np.where(going, _largest(move), error), calm]

    *x, error, calm = looped(correction, [*aim, first, np.where(determinant > 0, 1.0, 0.0)], NEWTON_LIMIT - 1)
    residual, jacobian = system(x, share)
    astray, size = _largest([a - b for a, b in zip(x, aim, strict=True)]), _largest(x)
    near = (astray <= NEAR_AIM * first) | (first + astray <= TINY_MOVE * size)
    return x, judged(x, residual, error) & (calm > 0) & near & (linalg.determinant(jacobian) > 0) & np.isfinite(size)


def _largest(values: Sequence[Number]) -> Number:
    return functools.reduce(np.maximum, [np.abs(value) for value in values])


def _correct(system: System, start: Sequence[Array], share: Array) -> tuple[list[Array], NDArray[np.bool_]]:
    """Newton from `start` at the given share, and whether it stayed on the branch.

    It did if it converged with det J > 0 all the way and ended near where its first step pointed, along the tangent
    of the branch. A tiny move need not: it may cross the kink that a guide has where its load changes ends.
    """
    x = list(start)
    good = np.zeros(share.shape, bool)
    calm = np.ones(share.shape, bool)
    aim, first = x, np.zeros(share.shape)
    with np.errstate(all="ignore"):
        residual, jacobian = system(x, share)
        for round_ in range(NEWTON_LIMIT):
            move, determinant = linalg.solve_and_determinant(jacobian, residual)
            calm &= determinant > 0
            x = [value - delta for value, delta in zip(x, move, strict=True)]
            size = np.maximum.reduce([np.abs(value) for value in x])
            error = np.maximum.reduce([np.abs(delta) for delta in move])
            if round_ == 0:
                aim, first = list(x), error
            residual, jacobian = system(x, share)
            # by the residual: a small move may have crossed a kink, beyond which the Jacobian was another
            missed = np.maximum.reduce([np.abs(part) for part in residual])
            good = (error <= CONVERGED * size + TINY) & (missed <= CONVERGED * size + TINY)
            if np.all(good | ~calm | (error > first)):  # a lane that moves farther than at first has left the branch
                break
        astray = np.maximum.reduce([np.abs(a - b) for a, b in zip(x, aim, strict=True)])
        calm &= (astray <= NEAR_AIM * first) | (first + astray <= TINY_MOVE * size)
        good = good & calm & (linalg.determinant(jacobian) > 0)
    return x, good & np.isfinite(size)
