"""The linear system of a mechanism some of whose rows hold, and the changes of rates that momentum makes.

  [ M   −C   S ] [ q̈ ]
  [ W    0   0 ] [ λ ]  =  right-hand side
  [ A    0   0 ] [ s ]

Contacts of rigid bodies that stay closed keep their gaps, W q̈ + … = 0, under forces λ. Joints that stick keep their
relative speeds, A q̈ + … = 0, under shares s of what resists them, −1 ≤ s ≤ 1. Where more joints stick than coordinates
are free the shares are not determined; of all that hold, those are taken whose largest is least, so that the joints
hold as long as they can.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

RANK = 1e-9  # of the largest: singular values below are 0


def newton_step(slopes: Array, missed: Array, shares: Array) -> tuple[Array, Flags]:
    """The next step of Newton's method in every lane, and lanes in which more acceleration takes less effort.

    slopes: (equation, unknown, lane), both scaled by what is typical of the unknowns; missed: (equation, lane); shares:
    (joint that sticks, lane), so far: the last unknowns and equations are theirs.
    """
    step, turned = np.full(missed.shape, np.nan), np.zeros(missed.shape[1], bool)
    sound = np.all(np.isfinite(slopes), axis=(0, 1)) & np.all(np.isfinite(missed), axis=0)
    if len(shares) == 1 and len(missed) == 2:  # one coordinate that rests
        (_, resisting), (way, _) = slopes
        step[0] = -missed[1] / way
        step[1] = -(missed[0] + slopes[0, 0] * step[0]) / np.where(resisting != 0.0, resisting, np.nan)
        return step, sound & (resisting * way < 0.0)
    if len(shares):
        for lane in np.flatnonzero(sound):
            step[:, lane], turned[lane] = _with_shares(slopes[:, :, lane], missed[:, lane], shares[:, lane])
        return step, turned
    size = np.max(np.abs(slopes), axis=1)  # rows are of different units
    sound &= np.all(size > 0.0, axis=0)
    matrix = np.moveaxis(slopes[..., sound] / size[:, None, sound], -1, 0)
    signs = np.linalg.det(matrix)
    turned[sound] = signs <= 0.0
    regular = np.flatnonzero(sound)[signs != 0.0]
    right = (missed[:, regular] / size[:, regular]).T[..., None]
    step[:, regular] = -np.linalg.solve(matrix[signs != 0.0], right)[..., 0].T
    return step, turned


def _with_shares(slopes: Array, missed: Array, shares: Array) -> tuple[Array, bool]:
    """Step of one lane with joints that stick, and whether more acceleration takes less effort.

    The accelerations, and with them the forces of contacts, are x + Z z, x those of the joints that stick and Z what
    these leave free; the shares are what E − T leaves to them outside the columns of ∂E/∂q̈ Z, so that ∂E/∂q̈ itself may
    be singular. A joint that nothing resists, as nothing presses on it, is not held.
    """
    count = len(missed) - len(shares)
    mass, friction, ways = slopes[:count, :count], slopes[:count, count:], slopes[count:, :count]
    efforts, pulls = missed[:count], missed[count:]
    able = np.max(np.abs(friction), axis=0) > 0.0
    left, sizes, right = np.linalg.svd(ways * able[:, None])
    rank = int(np.sum(sizes > RANK))
    along_ways = -right[:rank].T @ ((left[:, :rank].T @ (pulls * able)) / sizes[:rank])
    free = mass @ right[rank:].T
    if not np.all(np.linalg.svd(free, compute_uv=False) > 0.0):
        return np.full(len(missed), np.nan), True
    over = np.linalg.det(right[rank:] @ free) if len(pulls) > rank else np.linalg.det(slopes) * (-1.0) ** rank
    outside = np.linalg.svd(free)[0][:, count - rank :].T
    resisting, rest = outside @ friction, efforts + mass @ along_ways
    change = least_shares(resisting, resisting @ shares - outside @ rest) - shares
    along_free = np.linalg.lstsq(free, -rest - friction @ change, rcond=None)[0]
    return np.concatenate([along_ways + right[rank:].T @ along_free, change]), bool(over < 0.0)


def least_shares(ways: Array, target: Array) -> Array:
    """s of W s = c, (equation, share), whose largest |s| is least; W of as many shares or more as equations.

    By duality the largest |s| is the maximum of |ν·c| / Σ|ν·W_j| over all ν, which is found among those that are
    orthogonal to r − 1 of the columns W_j, of r equations. All other shares are ± that, as ν·W_j says.
    """
    rank, count = ways.shape
    if rank == 0:
        return np.zeros(count)
    if rank == count:
        return np.asarray(np.linalg.lstsq(ways, target, rcond=1e-12)[0], float)
    best, shares = -1.0, np.zeros(count)
    for inside in itertools.combinations(range(count), rank - 1):
        normal = np.linalg.svd(ways[:, inside].T)[2][-1] if inside else np.ones(1)
        along = normal @ ways
        along[list(inside)] = 0.0
        if (total := float(np.sum(np.abs(along)))) == 0.0 or abs(normal @ target) / total <= best:
            continue
        best = float(abs(normal @ target)) / total
        shares = best * np.sign(along) * np.sign(normal @ target)
        if inside:
            rest = target - ways @ shares
            shares[list(inside)] = np.linalg.lstsq(ways[:, inside], rest, rcond=1e-12)[0]
    return shares


def nearest(mass: Array, ways: Array, missed: Array, rank: float = 1e-13) -> Array:
    """The least change x of coordinates or rates, in the sense of the masses, with W x = missed.

    Of rates it is what keeps the momentum of what stays free, M⁻¹Wᵀ(W M⁻¹Wᵀ)⁻¹ missed (A. Müller (2026),
    arXiv:2604.19419).
    """
    spread = np.linalg.solve(mass, ways.T)
    change: Array = spread @ np.linalg.lstsq(ways @ spread, missed, rcond=rank)[0]
    return change
