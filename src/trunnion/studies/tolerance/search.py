"""The worst case on the mechanism itself: the corner of the tolerance box that first order names, followed and re-run.

From the linear corner, derivatives are taken again at the corner until it stays the same or gains nothing; then every
number is moved to its other limit alone, and to nominal, and the best of these is kept as long as it is better. Pins
lie at the rims of their holes, turned as the loads at the corner say. It finds the worst corner of a measure that is
monotone in each number over its tolerance, and of others the best that such steps reach.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number
from trunnion.studies.tolerance.effects import NOBODY, EffectRow, Effects, FirstOrder

__all__ = ["Corner", "search"]

Array = NDArray[np.float64]
MOST_ROUNDS = 12
SETTLED = 1e-7  # of the figure: a step that gains less is the last

# (real, slope) of the figure for a batch of values, (row,): what is made as large as can be
Objective = Callable[[Mapping[str, Number], Effects], tuple[Array, Array]]


class Corner(NamedTuple):
    """The largest (least) figure found, the numbers there by path, and how many batches it took.

    assembles: whether the corner that first order names has an answer.
    """

    value: float
    at: dict[str, float]
    rounds: int
    assembles: bool = True


def search(effects: Effects, objective: Objective, start: Mapping[str, float], sign: float, is_finite: bool) -> Corner:
    """The corner with the largest figure (sign 1) or the least (−1), from that of first order.

    is_finite: whether the nominal mechanism has the figure. NaN if none is found.
    """
    among = is_finite and all(tolerance.lower <= 0.0 <= tolerance.upper for tolerance in effects.inputs.tolerances)
    at, best, assembles = dict(start), Corner(0.0 if among else np.nan, {}, 0), True  # the nominal mechanism
    for rounds in range(1, MOST_ROUNDS + 1):
        real, slope = objective(effects.values(at), effects)
        before, best = best, _better(best, Corner(float(real[0]), at, rounds), sign)
        assembles = assembles and (rounds > 1 or bool(np.isfinite(real[0])))
        settled = rounds > 1 and abs(best.value - before.value) <= SETTLED * abs(best.value)
        if settled or not np.all(np.isfinite(slope)):
            break
        turned = FirstOrder(effects, slope).corner(sign, at)
        if all(abs(value - at[path]) <= 1e-9 * max(1.0, abs(value)) for path, value in turned.items()):
            break
        at = turned
    for rounds in range(best.rounds + 1, best.rounds + 1 + MOST_ROUNDS):
        flips: list[dict[str, float]] = []  # each number alone at its other limit, or nominal if its limits let it
        for i, tolerance in enumerate(effects.inputs.tolerances):
            if not (tolerance.direction or tolerance.distribution == "direction"):
                nominal = effects.nominal(i)
                places = {nominal + tolerance.lower, nominal + tolerance.upper}
                places |= {nominal} if tolerance.lower <= 0.0 <= tolerance.upper else set()
                flips += [{tolerance.path: to} for to in sorted(places - {best.at.get(tolerance.path, nominal)})]
        if not flips:
            break
        batch = replace(effects, rows=tuple(EffectRow(NOBODY, 0, flip, "") for flip in flips))
        real, _ = objective(batch.values(best.at), batch)
        if not np.any(np.isfinite(real)):
            break
        top = int(np.nanargmax(sign * real))
        trial = _better(best, Corner(float(real[top]), {**best.at, **flips[top]}, rounds), sign)
        if trial is best:
            break
        best = trial
    return best._replace(assembles=assembles)


def _better(best: Corner, trial: Corner, sign: float) -> Corner:
    gain = sign * (trial.value - best.value)
    least = 1e-12 * abs(best.value) if np.isfinite(best.value) else 0.0
    return trial if np.isfinite(trial.value) and (not np.isfinite(best.value) or gain > least) else best
