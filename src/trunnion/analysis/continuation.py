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

__all__ = ["System", "follow"]

Array = NDArray[np.float64]
System = Callable[[Sequence[Array], Array], tuple[list[Number], list[list[Number]]]]

FIRST_STEP = 0.05
LONGEST_STEP = 0.05
LAST_STEP = 1e-9  # to which the share at which a lane locks is found
NEWTON_LIMIT = 12
CONVERGED = 1e-12  # of the largest unknown
NEAR_AIM = 0.25  # of Newton's first step by which the corrected point may miss its aim
TINY_MOVE = 0.02  # of the largest unknown


def follow(system: System, start: Sequence[Array], most: float = 1.0) -> tuple[list[Array], Array]:
    """(solution, share) of each lane: the share is `most`, or that at which the lane's solution ceases to exist.

    system(x, s) gives residual and Jacobian, lane by lane, and `start` solves it at s = 0. The solution of a lane
    that stops before `most` is NaN.
    """
    x = list(start)
    lanes = len(x[0])
    share = np.zeros(lanes)
    step = np.full(lanes, FIRST_STEP)
    active = np.ones(lanes, bool)
    while np.any(active):
        trial = np.minimum(share + step, most)
        found, good = _correct(system, x, trial)
        advance = active & good
        x = [np.where(advance, new, old) for new, old in zip(found, x, strict=True)]
        share = np.where(advance, trial, share)
        step = np.where(
            advance, np.minimum(2 * step, LONGEST_STEP * np.maximum(1.0, share)), np.where(active, step / 2, step)
        )
        active = active & (share < most) & (step > LAST_STEP)
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
        for round_ in range(NEWTON_LIMIT):
            residual, jacobian = system(x, share)
            calm &= linalg.determinant(jacobian) > 0
            (move,) = linalg.solve(jacobian, residual)
            x = [value - delta for value, delta in zip(x, move, strict=True)]
            size = np.maximum.reduce([np.abs(value) for value in x])
            error = np.maximum.reduce([np.abs(delta) for delta in move])
            if round_ == 0:
                aim, first = list(x), error
            good = error <= CONVERGED * size + 1e-300
            if np.all(good):
                break
        missed = np.maximum.reduce([np.abs(a - b) for a, b in zip(x, aim, strict=True)])
        calm &= (missed <= NEAR_AIM * first) | (first + missed <= TINY_MOVE * size)
        _, jacobian = system(x, share)
        good = good & calm & (linalg.determinant(jacobian) > 0)
    return x, good & np.isfinite(size)
