"""Following a solution from no friction to full friction, many positions at once.

The solution that starts frictionless is the one nature takes; it is followed over the share s ∈ [0, 1] of the
friction. Where it folds back or runs to infinity (det J reaches 0), no solution continues: the module is locked
at that share, and a solution found beyond it by luck would be a wrong number.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra import linalg
from trunnion.algebra.namespace import Number

__all__ = ["Family", "System", "follow"]

Array = NDArray[np.float64]
System = Callable[[Sequence[Array], Array], tuple[list[Number], list[list[Number]]]]
Family = Callable[[NDArray[np.intp]], System]

FIRST_STEP = 0.05
LONGEST_STEP = 0.05
LAST_STEP = 1e-9  # to which the share at which a lane locks is found
NEWTON_LIMIT = 12
CONVERGED = 1e-9  # of the largest unknown: last move and residual
TINY = 1e-300  # where all unknowns are 0
NEAR_AIM = 0.25  # of Newton's first step by which the corrected point may miss its aim
TINY_MOVE = 0.02  # of the largest unknown


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
        passed = good & (trial >= bad)
        last = ~good & (trial - here <= 2 * LAST_STEP)
        bad = np.where(passed, np.inf, np.where(good, bad, np.minimum(bad, trial)))
        eager = good & ~eager
        left = bad - here
        growing = np.minimum(2 * step, LONGEST_STEP * np.maximum(1.0, here))
        closing = np.where(eager | (left <= 2 * LAST_STEP), left, left / 2)
        step = np.where(np.isfinite(bad), closing, growing)
        going = (here < most) & ~last
        if not np.all(going):
            lanes, step, bad, eager = lanes[going], step[going], bad[going], eager[going]
            system = family(lanes)
    solved = share >= most
    return [np.where(solved, value, np.nan) for value in x], share


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
