"""Accelerations while single joints stick and others slide: several free coordinates in friction.

A joint that sticks keeps its relative speed at 0, a q̈ + b = 0, under a share s of what resists it, −1 ≤ s ≤ 1.
Shares and accelerations are found together, from the efforts E(q̈, s) = T and from the joints that stay at rest:
Newton's method on the walks, one lane for each acceleration and each share. Where more joints stick than coordinates
are free the shares are not determined; of all that hold, those are taken whose largest is least, so that the joints
hold as long as they can.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.dynamics.state import ROUNDS, SETTLED, Accelerated, FreeMotion, Moment, ahead, repeated
from trunnion.solve.backward import Backward, Sense
from trunnion.solve.forward import Forward

__all__ = ["StickingMotion", "least_shares"]

Array = NDArray[np.float64]

RANK = 1e-9  # of the largest: singular values below are 0
HELD = 1e-8  # of the accelerations: a joint that sticks has none but for rounding


class _Slopes(NamedTuple):
    """Of one lane, scaled: ∂E/∂q̈ (coordinate, coordinate), ∂E/∂s (coordinate, share), relative accelerations of the
    joints that stick by q̈ (joint, coordinate)."""

    mass: Array
    shares: Array
    ways: Array


@dataclass(frozen=True)
class StickingMotion(FreeMotion):
    """A free motion whose joints stick one by one."""

    @cached_property
    def typical(self) -> Array:
        """An acceleration typical of each joint that may stick, rad/s² or m/s²."""
        pace = max(float(np.ravel(primal(self.system.pace(self.values)))[0]), 1e-300)
        size = float(np.ravel(self.system.size(self.values))[0])
        return np.array([pace * pace * (1.0 if self.system.turns(name) else size) for name in self.resisted])

    def speeds(self, walk: Forward, lanes: int) -> Array:
        """Relative speeds of the joints that may stick, (joint, lane), rad/s or m/s."""
        return self._of_joints([walk.rates(name) for name in self.resisted], lanes)

    def pulls(self, walk: Forward, lanes: int) -> Array:
        """Their relative accelerations, (joint, lane), rad/s² or m/s²."""
        return self._of_joints([walk.second_rates(name) for name in self.resisted], lanes)

    def _of_joints(self, pairs: Sequence[tuple[object, object]], lanes: int) -> Array:
        found = [np.broadcast_to(primal(pair[0 if self.system.turns(name) else 1]), lanes)
                 for name, pair in zip(self.resisted, pairs, strict=True)]  # fmt: skip
        return np.array(found, float).reshape(len(found), lanes)

    def accelerate(self, at: Moment, guess: Array | None = None, pulls: Array | None = None) -> Accelerated:
        """The accelerations, with the shares that hold what sticks; NaN where there are none. pulls: relative
        accelerations that the joints that stick are to have, (joint that sticks, 1), rad/s² or m/s²; none if not given.

        Where the search ends on a side of where a reaction turns round on which there is no answer, or on which more
        acceleration takes less effort, it is begun from far away on other sides.
        """
        found = self.searched(at, guess, pulls)
        left = found.turned | (~found.converged & (found.shares is None))
        if not np.any(left):
            return found
        second = np.nan_to_num(found.second)
        for start in self.far(second).T:
            other = self.searched(at, np.where(left, start[:, None], second), pulls)
            better = left & other.converged & ~other.turned
            second = np.where(better, other.second, second)
            left &= ~better
            if not np.any(left):
                return self.searched(at, second, pulls)
        return found

    def searched(self, at: Moment, guess: Array | None = None, pulls: Array | None = None) -> Accelerated:
        """See `accelerate`, from one place."""
        sticks = [k for k, sense in enumerate(at.senses) if sense == 0]
        if not sticks:
            return super().accelerate(at, guess)
        count, lanes = at.q.shape
        numbers = np.zeros((count + len(sticks), lanes))
        numbers[:count] = self.begun(at) if guess is None else guess
        unit = np.concatenate([self.unit, np.ones(len(sticks))])[:, None]
        turned, wanted = np.zeros(lanes, bool), np.zeros((len(sticks), 1)) if pulls is None else pulls
        for _ in range(ROUNDS):
            missed, slopes = self._linear(at, numbers, sticks)
            missed[count:] -= wanted
            for _ in range(2):  # most are there after the second step with the same slopes
                step, turned = _steps(slopes, missed, numbers, unit, self.typical[sticks])
                numbers = numbers + step
                largest = np.maximum(np.max(np.abs(numbers / unit), axis=0), 1e-6)
                settled = ~np.isfinite(step) | (np.abs(step / unit) <= SETTLED * largest)
                missed, back = self._missed(at, numbers, sticks)
                missed[count:] -= wanted
                if np.all(settled):
                    break
            if np.all(settled):
                break
        left = np.abs(missed[count:]) / self.typical[sticks][:, None]
        converged = np.all(np.isfinite(numbers) & (np.abs(step / unit) <= HELD * largest), axis=0)
        able = np.max(np.abs(slopes[:count, count:]), axis=0) > 0.0  # others have nothing to be held by
        converged &= np.all(left <= HELD * np.maximum(np.where(able, 1.0, 1e-6), largest), axis=0)
        shares = np.repeat(np.array(at.senses, float)[:, None], lanes, axis=1)
        shares[sticks] = numbers[count:]
        return Accelerated(np.where(turned, np.nan, numbers[:count]), back, turned, converged, at.onsets, shares)

    def _missed(self, at: Moment, numbers: Array, sticks: Sequence[int]) -> tuple[Array, Backward]:
        """E − T, and the relative accelerations that are to be 0."""
        count, lanes = at.q.shape
        senses: dict[str, Sense] = {name: float(one) for name, one in zip(self.resisted, at.senses, strict=True)}
        senses.update((self.resisted[k], numbers[count + row]) for row, k in enumerate(sticks))
        second = numbers[:count]
        back = self.solve(at, second, senses, sliding=True)
        efforts = self.demanded(back, at.q.shape) - self.given(at, second, senses)
        return np.vstack([efforts, self.pulls(back.walk, lanes)[list(sticks)]]), back

    def _linear(self, at: Moment, numbers: Array, sticks: Sequence[int]) -> tuple[Array, Array]:
        """What is missed (equation, lane), and its derivatives (equation, number, lane)."""
        count, lanes = at.q.shape
        size = len(numbers)
        steps = ahead(numbers, np.append(self.unit, 1e2 * np.ones(size - count))[:, None])
        tried = [numbers, *(numbers + np.where(np.arange(size)[:, None] == i, steps, 0.0) for i in range(size))]
        many = repeated(at, size + 1)
        found = self._missed(many, np.concatenate(tried, axis=1), sticks)[0].reshape(size, size + 1, lanes)
        return found[:, 0], (found[:, 1:] - found[:, :1]) / steps[None]

    # ---- what sticks at once ----------------------------------------------------------------------------------

    def stopped(self, at: Moment, sticks: Sequence[int]) -> Array:
        """Rates after joints begin to stick, (coordinate,): the momentum of what stays free is kept,
        v⁺ = v⁻ − M⁻¹Aᵀ(A M⁻¹Aᵀ)⁻¹A v⁻, and energy only falls; one lane.

        Source: A. Müller (2026), arXiv:2604.19419.
        """
        every, speeds = self.ways(at)
        ways, missed = every[list(sticks)], speeds[list(sticks)]
        spread = np.linalg.solve(self.mass(at), ways.T)
        change = spread @ np.linalg.lstsq(ways @ spread, missed, rcond=RANK)[0]
        found: Array = at.rate[:, 0] - np.sqrt(self.unit) * change
        return found

    def turning(self, at: Moment, second: Array, sticks: Sequence[int], shares: Array) -> NDArray[np.bool_]:
        """Lanes in which more acceleration takes less effort, under shares of what resists some joints,
        (joint, lane); one lane of `at`."""
        count = len(self.names)
        many = repeated(at, second.shape[1])
        slopes = self._linear(many, np.vstack([second, shares]), sticks)[1][:count, :count] * self.unit[None, :, None]
        return np.asarray(np.linalg.det(np.moveaxis(slopes, -1, 0)) <= 0.0)

    def ways(self, at: Moment) -> tuple[Array, Array]:
        """How relative speeds follow from the rates, (joint, coordinate), and these speeds, (joint,), all by what is
        typical; one lane."""
        count = len(self.names)
        many = repeated(at, count + 2)._replace(rate=np.hstack([np.eye(count, count + 1, 1), at.rate]))
        speeds = self.speeds(self.walk(many, np.zeros((count, count + 2))), count + 2)
        speeds = speeds / np.sqrt(self.typical)[:, None]
        return (speeds[:, 1:-1] - speeds[:, :1]) * np.sqrt(self.unit), speeds[:, -1]

    def mass(self, at: Moment) -> Array:
        """∂E/∂q̈ without friction, coordinates by what is typical of each, (equation, coordinate); one lane."""
        free = at._replace(rate=0.0 * at.rate, onsets=(None,) * len(at.onsets), senses=(0,) * len(self.resisted))
        none: dict[str, Sense] = dict.fromkeys(self.resisted, 0.0)
        found: Array = self._linearised(free, np.zeros_like(at.q), none)[1][:, :, 0]
        return found * np.sqrt(self.unit) * np.sqrt(self.unit)[:, None]


def _steps(
    slopes: Array, missed: Array, numbers: Array, unit: Array, typical: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """The next step of Newton's method in every lane, and lanes in which more acceleration takes less effort."""
    lanes, count = missed.shape[1], len(missed) - len(typical)
    step, turned = np.full(missed.shape, np.nan), np.zeros(lanes, bool)
    sound = np.all(np.isfinite(slopes), axis=(0, 1)) & np.all(np.isfinite(missed), axis=0)
    for lane in np.flatnonzero(sound):
        own = slopes[:, :, lane] * unit[:, 0]
        parts = _Slopes(own[:count, :count], own[:count, count:], own[count:, :count] / typical[:, None])
        wanted = missed[:count, lane], missed[count:, lane] / typical
        step[:, lane], turned[lane] = _step(parts, *wanted, numbers[count:, lane])
    return step * unit, turned


def _step(slopes: _Slopes, efforts: Array, pulls: Array, shares: Array) -> tuple[Array, bool]:
    """Step of accelerations and shares of one lane, scaled, and whether more acceleration takes less effort.

    The accelerations are x + Z z, x those of the joints that stick and Z what these leave free; the shares are what
    E − T leaves to them outside the columns of ∂E/∂q̈ Z, so that ∂E/∂q̈ itself may be singular. A joint that nothing
    resists, as nothing presses on it, is not held.
    """
    able = np.max(np.abs(slopes.shares), axis=0) > 0.0
    left, sizes, right = np.linalg.svd(slopes.ways * able[:, None])
    rank, count = int(np.sum(sizes > RANK)), len(efforts)
    known = -right[:rank].T @ ((left[:, :rank].T @ (pulls * able)) / sizes[:rank])
    free = slopes.mass @ right[rank:].T
    whole = np.block([[slopes.mass, slopes.shares], [slopes.ways, np.zeros((len(pulls), len(pulls)))]])
    over = np.linalg.det(right[rank:] @ free) if len(pulls) > rank else np.linalg.det(whole) * (-1.0) ** rank
    if not np.all(np.linalg.svd(free, compute_uv=False) > 0.0):
        return np.full(count + len(pulls), np.nan), True
    outside = np.linalg.svd(free)[0][:, count - rank :].T
    own, rest = outside @ slopes.shares, efforts + slopes.mass @ known
    change = least_shares(own, own @ shares - outside @ rest) - shares
    along = np.linalg.lstsq(free, -rest - slopes.shares @ change, rcond=None)[0]
    return np.concatenate([known + right[rank:].T @ along, change]), bool(over < 0.0)


def least_shares(ways: Array, wanted: Array) -> Array:
    """s of W s = c, (equation, share), whose largest |s| is least; W of as many shares or more as equations.

    By duality the largest |s| is the maximum of |ν·c| / Σ|ν·W_j| over all ν, which is found among those that are
    orthogonal to r − 1 of the columns W_j, of r equations. All other shares are ± that, as ν·W_j says.
    """
    rank, count = ways.shape
    if rank == 0:
        return np.zeros(count)
    if rank == count:
        return np.asarray(np.linalg.lstsq(ways, wanted, rcond=1e-12)[0], float)
    best, found = -1.0, np.zeros(count)
    for inside in itertools.combinations(range(count), rank - 1):
        normal = np.linalg.svd(ways[:, inside].T)[2][-1] if inside else np.ones(1)
        along = normal @ ways
        along[list(inside)] = 0.0
        if (whole := float(np.sum(np.abs(along)))) == 0.0 or abs(normal @ wanted) / whole <= best:
            continue
        best = float(abs(normal @ wanted)) / whole
        found = best * np.sign(along) * np.sign(normal @ wanted)
        if inside:
            rest = wanted - ways @ found
            found[list(inside)] = np.linalg.lstsq(ways[:, inside], rest, rcond=1e-12)[0]
    return found
