"""Which unknowns the data tell apart, and what they know of those that they do not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trunnion.rig.identification.fit import FitProblem
from trunnion.rig.identification.uncertainty import Covariances, quantile

__all__ = ["Combination", "InseparableUnknowns", "inseparable", "known_of", "sizes_of"]

Array = NDArray[np.float64]
PART = 0.05  # of the largest share in a direction: what is below it takes no part
ALONE = 10.0  # times better known, were the others fixed: then it is they that it cannot be told from
EFFECT = 0.1  # of a course: what an unknown whose own size says nothing is to change to be counted as large
SAME = 0.02  # of 1: how near a factor is to it to be called it


@dataclass(frozen=True)
class Combination:
    """What is known of unknowns that cannot be told apart: a sum with factors, a product or a ratio.

    form: "sum", "product" or "ratio"; factors: of the members, the first 1; value, uncertainty: expanded, 95 %, SI.
    """

    form: str
    factors: tuple[float, ...]
    value: float
    uncertainty: float


@dataclass(frozen=True)
class InseparableUnknowns:
    """Unknowns (and sensors, by their place behind them) that the data do not tell apart.

    known: combinations that they do; exact: whether nothing at all is known of the rest, or only too little.
    A single member without a known combination has no effect on the data.
    """

    members: tuple[int, ...]
    known: tuple[Combination, ...]
    exact: bool


def sizes_of(problem: FitProblem, x: Array) -> Array:
    """How large each unknown is: by the model or the estimate; of one that is 0, what would change the data visibly."""
    found = [max(one.size, abs(value)) for one, value in zip(problem.model.unknowns, x[: problem.count], strict=True)]
    for p in range(problem.count):
        if found[p] > 0:
            continue
        pulled, data = 0.0, 0.0
        for k, block in enumerate(problem.blocks):
            if block.fitted:
                weight = problem.weight(k)
                pulled += float(np.sum(np.nan_to_num(problem.said(x, k)[1][p]) ** 2 * weight))
                data += float(np.sum(np.nan_to_num(block.mean) ** 2 * weight))
        found[p] = EFFECT * float(np.sqrt(data / pulled)) if pulled > 0 else 1.0
    return np.array(found + [1.0] * len(problem.sensors))


def inseparable(problem: FitProblem, x: Array, spread: Covariances) -> list[InseparableUnknowns]:
    """The groups of unknowns that the data do not tell apart."""
    sizes = sizes_of(problem, x)
    found: list[InseparableUnknowns] = []
    lost: set[int] = set()
    for members in _connected(spread.null * 1.0, sizes):
        found.append(InseparableUnknowns(members, known_of(problem, x, spread, members, sizes), exact=True))
        lost |= set(members)
    vague = _vague(problem, spread, sizes, lost)
    return [
        *found,
        *(InseparableUnknowns(members, known_of(problem, x, spread, members, sizes), exact=False) for members in vague),
    ]


def _connected(null: Array, sizes: Array) -> list[tuple[int, ...]]:
    """Unknowns that take part in a direction of which nothing is known, together if they share one."""
    if not len(null):
        return []
    basis, _ = np.linalg.qr((null / sizes).T)
    projector = basis @ basis.T
    takes = np.diagonal(projector) > PART**2 * np.max(np.diagonal(projector))
    left, groups = [int(i) for i in np.flatnonzero(takes)], []
    while left:
        members, grown = {left[0]}, True
        while grown:
            more = {i for i in left if any(abs(projector[i, j]) > PART**2 for j in members)} - members
            members |= more
            grown = bool(more)
        groups.append(tuple(sorted(members)))
        left = [i for i in left if i not in members]
    return groups


def _vague(problem: FitProblem, spread: Covariances, sizes: Array, lost: set[int]) -> list[tuple[int, ...]]:
    """Unknowns that would be known well were others fixed, and together are known to no better than their size."""
    own = [p for p in range(problem.count) if p not in lost]
    covariance = spread.covariance[np.ix_(own, own)]
    half = quantile(spread.freedom[own]) * np.sqrt(np.diagonal(covariance))
    with np.errstate(all="ignore"):
        fixed = 1 / np.sqrt(np.diagonal(np.linalg.pinv(covariance)))
        alone = quantile(spread.freedom[own]) * fixed
    vague = [i for i in range(len(own)) if half[i] > sizes[own[i]] and half[i] > ALONE * alone[i]]
    groups: list[tuple[int, ...]] = []
    left = list(vague)
    scaled = covariance / np.outer(sizes[own], sizes[own])
    while left:
        _, vectors = np.linalg.eigh(scaled[np.ix_(left, left)])
        direction = np.abs(vectors[:, -1])
        members = [left[i] for i in np.flatnonzero(direction > PART * np.max(direction))]
        if len(members) > 1:
            groups.append(tuple(own[i] for i in members))
        left = [i for i in left if i not in members]
    return groups


# ---- what is known --------------------------------------------------------------------------------------------


def known_of(
    problem: FitProblem, x: Array, spread: Covariances, members: Sequence[int], sizes: Array
) -> tuple[Combination, ...]:
    """Combinations of the members that the data know, the best known first."""
    index = np.array(members)
    marginal = _marginal(spread.information, index)
    scale = sizes[index]
    values, vectors = np.linalg.eigh(marginal * np.outer(scale, scale))
    covariance = spread.covariance[np.ix_(index, index)]
    found = []
    for value, vector in list(zip(values, vectors.T, strict=True))[::-1]:
        factors = vector / scale
        if value <= 1e-8 * values[-1] or not np.any(np.abs(factors) > 0):
            break
        lead = factors[np.flatnonzero(np.abs(vector) > PART * np.max(np.abs(vector)))[0]]
        factors = np.where(np.abs(vector) > 1e-6 * np.max(np.abs(vector)), factors / lead, 0.0)
        half = quantile(spread.freedom[index[0]]) * float(np.sqrt(max(factors @ covariance @ factors, 0.0)))
        size = float(np.abs(factors) @ scale)
        if float(half) < size:  # known to some purpose
            found.append(_named(problem, x, index, factors, float(half)))
    return tuple(found[: len(members) - 1])


def _marginal(information: Array, index: Array) -> Array:
    """Information on some when all others are unknown too."""
    others = np.setdiff1d(np.arange(len(information)), index)
    own = information[np.ix_(index, index)]
    if not len(others):
        return np.asarray(own)
    cross = information[np.ix_(index, others)]
    size = np.sqrt(np.maximum(np.diagonal(information)[others], 1e-300))
    rest = np.linalg.pinv(information[np.ix_(others, others)] / np.outer(size, size), rcond=1e-10)
    return np.asarray(own - (cross / size) @ rest @ (cross / size).T)


def _named(problem: FitProblem, x: Array, index: Array, factors: Array, half: float) -> Combination:
    """A combination of two as a product or a ratio where it is one: p q moves by q dp + p dq.

    Two of one kind, such as the frictions of two joints, add.
    """
    values = x[index]
    if len(index) == 2 and max(index) < problem.count and np.all(values != 0):
        units = {problem.model.unknowns[i].paths[0].rpartition(".")[2] for i in index}
        relative = float(factors[1] * values[1] / values[0])
        if len(units) > 1 and abs(abs(relative) - 1) < SAME:
            form = "product" if relative > 0 else "ratio"
            value = float(values[0] * values[1]) if relative > 0 else float(values[0] / values[1])
            return Combination(form, (1.0, 1.0 if relative > 0 else -1.0), value, half * abs(value / values[0]))
    near = np.where(np.abs(np.abs(factors) - 1) < SAME, np.sign(factors), factors)
    return Combination("sum", tuple(float(one) for one in near), float(near @ values), half)
