"""Which unknowns the data tell apart, and what they know of two that they do not."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from trunnion.rig.identification.fit import Fit, sizes_of
from trunnion.rig.identification.uncertainty import Covariances, quantile

__all__ = ["Combination", "InseparableUnknowns", "inseparable"]

Array = NDArray[np.float64]
PART = 0.05  # of the largest share in a direction: what is below it takes no part
ALONE = 10.0  # times better known, were the others fixed: then it is they that it cannot be told from
SAME = 0.02  # of 1: how near a factor is to it to be called it


@dataclass(frozen=True)
class Combination:
    """What is known of two unknowns that cannot be told apart: a sum with factors, a product or a ratio.

    form: "sum", "product" or "ratio"; factors: of the two, the first 1; value, uncertainty: expanded, 95 %, SI.
    """

    form: str
    factors: tuple[float, ...]
    value: float
    uncertainty: float


@dataclass(frozen=True)
class InseparableUnknowns:
    """Unknowns (and sensors, by their place behind them) that the data do not tell apart.

    determined: the combination of two that they do; exact: whether nothing at all is known of the rest, or only too
    little. A single member has no effect on the data.
    """

    members: tuple[int, ...]
    determined: Combination | None
    exact: bool


def inseparable(fit: Fit, x: Array, spread: Covariances) -> list[InseparableUnknowns]:
    """The groups of unknowns that the data do not tell apart."""
    sizes = sizes_of(fit, x)
    groups = []
    for exact, directions in ((True, _blind(spread, sizes)), (False, _vague(fit, spread, sizes))):
        for members, direction in directions:
            pair = len(members) == 2
            determined = _determined(fit, x, spread, members, direction * sizes[list(members)], sizes) if pair else None
            groups.append(InseparableUnknowns(members, determined, exact))
    return groups


def _blind(spread: Covariances, sizes: Array) -> Iterator[tuple[tuple[int, ...], Array]]:
    """Unknowns that take part in a direction of which nothing is known, together if they share one, and how far each
    goes along it, in its size."""
    basis, _ = np.linalg.qr((spread.null / sizes).T)
    projector = basis @ basis.T
    share = np.diagonal(projector)
    takes = np.flatnonzero((share > PART**2 * np.max(share, initial=0.0)) & (share > 0))
    _, labels = connected_components(np.abs(projector[np.ix_(takes, takes)]) > PART**2)
    for label in range(labels.max(initial=-1) + 1):
        members = takes[labels == label]
        yield tuple(int(one) for one in members), projector[members, members[0]]


def _vague(fit: Fit, spread: Covariances, sizes: Array) -> Iterator[tuple[tuple[int, ...], Array]]:
    """Unknowns that would be known well were others fixed, and together are known to no better than their size."""
    blind = {one for members, _ in _blind(spread, sizes) for one in members}
    own = [p for p in range(fit.count) if p not in blind]
    covariance = spread.covariance[np.ix_(own, own)]
    with np.errstate(all="ignore"):
        alone = 1 / np.sqrt(np.diagonal(np.linalg.pinv(covariance)))
    half = quantile(spread.freedom[own]) * spread.deviation[own]
    vague = np.flatnonzero((half > sizes[own]) & (spread.deviation[own] > ALONE * alone))
    if len(vague) > 1:
        scaled = (covariance / np.outer(sizes[own], sizes[own]))[np.ix_(vague, vague)]
        direction = np.linalg.eigh(scaled)[1][:, -1]
        part = np.abs(direction) > PART * np.max(np.abs(direction))
        if np.count_nonzero(part) > 1:
            yield tuple(own[i] for i in vague[part]), direction[part]


def _determined(
    fit: Fit, x: Array, spread: Covariances, members: Sequence[int], direction: Array, sizes: Array
) -> Combination | None:
    """The combination of two that does not change along the direction that is not known; None if it is vague too."""
    index = np.array(members)
    factors = np.array([1.0, -direction[0] / direction[1]])
    variance = float(factors @ spread.covariance[np.ix_(index, index)] @ factors)
    half = float(quantile(spread.freedom[index[0]])) * float(np.sqrt(max(variance, 0.0)))
    return _named(fit, x, index, factors, half) if half < float(np.abs(factors) @ sizes[index]) else None


def _named(fit: Fit, x: Array, index: Array, factors: Array, half: float) -> Combination:
    """A combination of two as a product or a ratio where it is one: p q moves by q dp + p dq.

    Two of one kind, such as the frictions of two joints, add.
    """
    values = x[index]
    if max(index) < fit.count and np.all(values != 0):
        kinds = {fit.model.unknowns[i].paths[0].rpartition(".")[2] for i in index}
        relative = float(factors[1] * values[1] / values[0])
        if len(kinds) > 1 and abs(abs(relative) - 1) < SAME:
            form = "product" if relative > 0 else "ratio"
            value = float(values[0] * values[1]) if relative > 0 else float(values[0] / values[1])
            return Combination(form, (1.0, 1.0 if relative > 0 else -1.0), value, half * abs(value / values[0]))
    near = np.where(np.abs(np.abs(factors) - 1) < SAME, np.sign(factors), factors)
    return Combination("sum", tuple(float(one) for one in near), float(near @ values), half)
