"""The least play that closes the loops: a second-order cone programme, linearised anew until the closure is exact.

    minimise t   subject to   gap + J δq + C (c − c₀) = 0,   |c_i| ≤ b_i + t s_i  at every end

Play b_i + t s_i: of stated clearances r_i it is t r_i; of one clearance for all pins it is t, and what is stated of
other joints stays. One linearised problem is convex: the value of its dual is a lower bound, and the multipliers say
what each end contributes. The next linearisation is at the q and c found; it ends when the gap, computed without any
linearisation, is at rounding and t stands still.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import clarabel
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from trunnion.solve.space.loops import LARGEST, LinearLoops, Loops

__all__ = ["CLOSED", "Ask", "LeastPlay", "least_play"]

Array = NDArray[np.float64]
CLOSED = 1e-12  # rad, or of the size: a gap that counts as closed
SETTLED = 1e-9  # of t
ROUNDS = 60
PATIENCE = 12
NOTHING = 1e-13  # of the size: a play below it is rounding
FINE = 1e-12  # tolerances of the cone programme
SOUND = ("Solved", "AlmostSolved", "InsufficientProgress")


class Ask(NamedTuple):
    """Play b + t s allowed at each end (end,), and how many components each has."""

    base: Array
    share: Array
    widths: tuple[int, ...]


class ConeAnswer(NamedTuple):
    """Of one linearised problem: steps, offsets, t, the dual's lower bound of t, and what each end contributes."""

    steps: Array
    offsets: Array
    least: float
    bound: float
    weights: Array


@dataclass(frozen=True)
class LeastPlay:
    """Least t of every lane, its lower bound by the dual, coordinates, offsets, contributions (lane, end), opening.

    t is ∞ where no play of this kind closes the loops, NaN where the sequence did not settle.
    """

    least: Array
    bound: Array
    q: Array
    offsets: Array
    weights: Array
    opening: Array
    rounds: int


def least_play(loops: Loops, q: Array, c: Array, ask: Ask) -> LeastPlay:
    """The least t at every lane, from coordinates (lane, kept) and offsets (lane, component).

    A step is halved where the gap grew, from the round PATIENCE on.
    """
    lanes, ends = len(q), len(ask.widths)
    q, c = q.copy(), c.copy()
    least, bound = np.full(lanes, np.nan), np.full(lanes, np.nan)
    weights, before, gaps = np.zeros((lanes, ends)), np.full(lanes, np.nan), np.full(lanes, np.inf)
    active = np.flatnonzero(np.isfinite(q).all(axis=1))
    rounds = 0
    while len(active) and rounds < ROUNDS:
        part = loops.at(active)
        linear = part.linear(q[active], c[active])
        gap = np.max(np.abs(linear.gap), axis=1, initial=0.0)
        grew = (gap > gaps[active]) & (rounds >= PATIENCE)
        gaps[active] = gap
        settled = (gap <= CLOSED) & (np.abs(least[active] - before[active]) <= SETTLED * np.abs(least[active]))
        steps = np.zeros((len(active), linear.jacobian.shape[2]))
        done = settled.copy()
        for place, lane in enumerate(active):
            if settled[place]:
                continue
            answer = _solve(LinearLoops(*(one[place] for one in linear)), c[lane], ask, loops.size)
            if answer is None:
                least[lane], done[place] = np.inf, True
                continue
            before[lane], least[lane], bound[lane] = least[lane], answer.least, answer.bound
            weights[lane] = answer.weights
            largest = float(np.max(np.abs(answer.steps), initial=0.0))
            length = (0.5 if grew[place] else 1.0) * min(1.0, LARGEST / max(largest, 1e-300))
            steps[place] = length * answer.steps
            c[lane] += length * (answer.offsets - c[lane])
        moving = ~done
        q[active[moving]] = part.at(np.flatnonzero(moving)).moved(q[active[moving]], steps[moving])
        active = active[moving]
        rounds += 1
    least[active] = np.nan
    return LeastPlay(least, bound, q, c, weights, loops.opening(q, c), rounds)


def _solve(linear: LinearLoops, c: Array, ask: Ask, size: float) -> ConeAnswer | None:
    """One linearised problem; None if nothing closes it. Unknowns in units of what has to be taken up."""
    gap, jacobian, effect = linear
    side = effect @ c - gap
    unit = float(np.max(np.abs(side), initial=0.0))
    columns, components, ends = jacobian.shape[1], effect.shape[1], len(ask.widths)
    lever = float(np.max(np.abs(effect), initial=0.0))
    if unit <= NOTHING:
        return ConeAnswer(np.zeros(columns), np.zeros(components), 0.0, 0.0, np.zeros(ends))
    if not lever:
        return None
    length = unit / lever  # m: an offset of 1
    share = float(np.max(ask.share, initial=0.0))
    if share == 0:
        return None
    rows, right = _cones(ask, columns, share, length)
    table = np.zeros((len(gap), columns + components + 1))
    table[:, :columns], table[:, columns:-1] = jacobian, effect / lever
    aim = np.zeros(table.shape[1])
    aim[-1] = 1.0
    cones = [clarabel.ZeroConeT(len(gap)), *(clarabel.SecondOrderConeT(width + 1) for width in ask.widths)]
    matrix = sparse.csc_matrix(np.vstack([table, rows]))
    none = sparse.csc_matrix((len(aim), len(aim)))
    b = np.concatenate([side / unit, right])
    solution = clarabel.DefaultSolver(none, aim, matrix, b, cones, _settings()).solve()
    if str(solution.status) not in SOUND:
        return None
    x, z = np.asarray(solution.x), np.asarray(solution.z)
    firsts = len(gap) + np.cumsum([0, *(width + 1 for width in ask.widths[:-1])])
    return ConeAnswer(
        unit * x[:columns],
        length * x[columns:-1],
        length / share * float(x[-1]),
        length / share * float(solution.obj_val_dual),
        z[firsts] * ask.share / share,
    )


def _cones(ask: Ask, columns: int, share: float, length: float) -> tuple[Array, Array]:
    """Rows A x + s = b of the ends: s = (b_i + t s_i, c_i)."""
    count = sum(ask.widths)
    rows, right = np.zeros((count + len(ask.widths), columns + count + 1)), np.zeros(count + len(ask.widths))
    row, column = 0, columns
    for base, one, width in zip(ask.base, ask.share, ask.widths, strict=True):
        rows[row, -1], right[row] = -one / share, base / length
        for k in range(width):
            rows[row + 1 + k, column + k] = -1.0
        row, column = row + width + 1, column + width
    return rows, right


def _settings() -> clarabel.DefaultSettings:
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = FINE
    settings.max_iter = 100
    return settings
