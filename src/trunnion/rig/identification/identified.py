"""What the estimates are worth: intervals, limits, sensors, residuals before and after, and what was held out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trunnion.model.mechanism import Mechanism
from trunnion.rig.identification.fit import FAR, FitProblem
from trunnion.rig.identification.identifiability import InseparableUnknowns
from trunnion.rig.identification.misfit import MisfitCause
from trunnion.rig.identification.search import Search
from trunnion.rig.identification.uncertainty import Covariances, quantile
from trunnion.rig.reading.measurement import Measurement

__all__ = ["HeldOut", "Identified", "Misses"]

Array = NDArray[np.float64]
AT_LIMIT = 0.05  # of the standard uncertainty: nearer than this to a limit is on it


@dataclass(frozen=True)
class Misses:
    """How far the model is from the data of one block, rms: before and after, and what the scatter explains.

    used, out: positions; curves: (position,) of the residual before, after and the uncertainty of the mean.
    """

    block: int
    before: float
    after: float
    expected: float
    used: int
    out: int
    curves: tuple[Array, Array, Array]


@dataclass(frozen=True)
class HeldOut:
    """How well data that were not fitted are predicted, rms; expected: by their scatter and the estimates'."""

    block: int
    before: float
    after: float
    expected: float
    turns: int


@dataclass(frozen=True)
class Identified:
    """An identification: the model, the data, what was found, and the figures of it, (unknown,) unless said.

    causes: what would explain a misfit, best first; unused: channels that no unknown acts on.
    """

    mechanism: Mechanism
    measurement: Measurement
    problem: FitProblem
    search: Search
    spread: Covariances
    groups: Sequence[InseparableUnknowns]
    causes: Sequence[MisfitCause] = ()
    unused: Sequence[str] = ()

    @property
    def x(self) -> Array:
        """Estimates of the unknowns, then of the sensors' errors."""
        return self.search.fit.x

    @cached_property
    def refuted(self) -> bool:
        """Whether the estimates stand for something else: by the residuals, or since an error of a sensor that explains
        them is beyond what is stated of it."""
        return self.spread.test.gross or bool(self.spread.beyond) or self.times_stated > FAR

    @cached_property
    def times_stated(self) -> float:
        """Size of the first cause of a misfit in standard uncertainties that are stated of it; 0 where none is."""
        first = next(iter(self.causes), None)
        if first is None:
            return 0.0
        sensors = [one for one in self.problem.sensors if one.stated]
        alike = [max(map(abs, one.sizes)) for one in sensors if (one.kind, one.channel) == (first.kind, first.channel)]
        stated = max([one.angle for one in sensors] if first.kind == "angle" else alike, default=0.0)
        return abs(first.size) / stated if stated else 0.0

    @cached_property
    def lost(self) -> NDArray[np.bool_]:
        """Unknowns that the data do not tell, (unknown and sensor,)."""
        lost = np.zeros(len(self.x), bool)
        for group in self.groups:
            lost[list(group.members)] = True
        return lost

    @property
    def told(self) -> Array:
        """Values of the unknowns: estimates, of what the data do not tell the start, (unknown,)."""
        return np.asarray(np.where(self.lost, self.start, self.x)[: self.problem.count])

    @cached_property
    def deviation(self) -> Array:
        """Standard uncertainty, (unknown and sensor,)."""
        found = np.sqrt(np.maximum(np.diagonal(self.spread.covariance), 0.0))
        return np.asarray(np.where(self.lost, np.nan, found))

    @cached_property
    def limit(self) -> NDArray[np.int8]:
        """−1 of an unknown on its lower limit, 1 on its upper, 0 of others."""
        low, high = self.problem.bounds
        n = self.problem.count
        x, u = self.x[:n], np.nan_to_num(self.deviation[:n])
        near = AT_LIMIT * u + 1e-9 * np.abs(x)
        found = np.where((x - low[:n] <= near) & (self._pull[:n] <= 0), -1, 0)
        found = np.where((high[:n] - x <= near) & (self._pull[:n] >= 0), 1, found)
        return np.asarray(np.where(self.lost[:n], 0, found), np.int8)

    @cached_property
    def _pull(self) -> Array:
        """Where the next step would go without limits."""
        x = self.x
        return np.asarray(-self.spread.inverse @ (self.problem.jacobian(x).T @ self.problem.residuals(x)))

    @cached_property
    def estimate(self) -> Array:
        """Estimates; on a limit the limit itself, NaN of what the data do not tell."""
        low, high = self.problem.bounds
        n = self.problem.count
        at = np.where(self.limit < 0, low[:n], np.where(self.limit > 0, high[:n], self.x[:n]))
        return np.asarray(np.where(self.lost[:n], np.nan, at))

    @cached_property
    def interval(self) -> tuple[Array, Array]:
        """95 %, within the limits; one-sided of an unknown on one, from where a step without limits ends if inside."""
        low, high = (one[: self.problem.count] for one in self.problem.bounds)
        n = self.problem.count
        u, freedom = self.deviation[:n], self.spread.freedom[:n]
        half, one_sided = quantile(freedom) * u, quantile(freedom, one_sided=True) * u
        free = self.x[:n] + self._pull[:n]
        lower = np.where(self.limit > 0, np.minimum(free, high) - one_sided, self.estimate - half)
        upper = np.where(self.limit < 0, np.maximum(free, low) + one_sided, self.estimate + half)
        lower, upper = np.where(self.limit < 0, low, lower), np.where(self.limit > 0, high, upper)
        return np.maximum(lower, low), np.minimum(upper, high)

    @cached_property
    def correlation(self) -> Array:
        """Between the estimates; NaN of what the data do not tell."""
        n = self.problem.count
        u = self.deviation[:n]
        with np.errstate(all="ignore"):
            found = self.spread.covariance[:n, :n] / np.outer(u, u)
        return np.asarray(np.clip(found, -1.0, 1.0))

    @cached_property
    def budget(self) -> tuple[list[str], Array]:
        """Sources, and the share of each in the variance of every estimate, (unknown, source)."""
        n = self.problem.count
        names = list(self.spread.parts)
        parts = np.array([np.diagonal(one)[:n] for one in self.spread.parts.values()]).T
        with np.errstate(all="ignore"):
            shares = parts / np.sum(parts, axis=1, keepdims=True)
        return names, np.where(self.lost[:n, None], np.nan, shares)

    @cached_property
    def singular_values(self) -> Array:
        """Of the derivatives with every column scaled to 1, the largest first: near 0 something is not told apart."""
        rows = self.problem.jacobian(self.x)[:, : self.problem.count]
        size = np.linalg.norm(rows, axis=0)
        found = np.linalg.svd(rows / np.where(size > 0, size, 1.0), compute_uv=False)
        return np.concatenate([found, np.zeros(len(size) - len(found))])  # fewer data than unknowns

    # ---- residuals --------------------------------------------------------------------------------------------

    @cached_property
    def start(self) -> Array:
        """Unknowns as the search began, before friction was lessened, sensors without errors."""
        stated = [one.start for one in self.problem.model.unknowns]
        return np.array(stated + [0.0] * len(self.problem.sensors))

    @cached_property
    def misses(self) -> list[Misses]:
        """Of every block that was fitted."""
        found = []
        for k, block in enumerate(self.problem.blocks):
            if not block.fitted:
                continue
            mask = self.problem.masks[k]
            before = np.where(mask, self.problem.misses(self.start, k, block.mean), np.nan)
            after = np.where(mask, self.problem.misses(self.x, k, block.mean), np.nan)
            scatter = np.sqrt(self._variance(k) / np.maximum(block.count, 1) + block.unresolved**2)
            known = scatter if block.repeats else np.full(len(mask), np.nan)
            out = int(np.count_nonzero(np.isfinite(block.mean) & ~mask))
            row = (before, after, np.where(mask, known, np.nan))
            found.append(Misses(k, _rms(before), _rms(after), _rms(row[2]), int(np.count_nonzero(mask)), out, row))
        return found

    @cached_property
    def held_out(self) -> list[HeldOut]:
        """Of every block of which turns were held out."""
        found = []
        allowed = self.problem.allowed(self.x)
        covariance = self.spread.covariance
        for k, block in enumerate(self.problem.blocks):
            if not len(block.held):
                continue
            there = allowed[k] & np.isfinite(block.held_mean)
            before, after = (
                np.where(there, self.problem.misses(x, k, block.held_mean), np.nan) for x in (self.start, self.x)
            )
            columns = np.nan_to_num(self.problem.said(self.x, k)[1])
            predicted = np.einsum("pi,pq,qi->i", columns, covariance, columns)
            count = np.maximum(np.count_nonzero(np.isfinite(block.held), axis=0), 1)
            expected = np.where(there, self._scatter(k) / count + predicted, np.nan)
            found.append(HeldOut(k, _rms(before), _rms(after), _rms(np.sqrt(expected)), len(block.held)))
        return found

    def _variance(self, k: int) -> Array:
        """Variance of one turn of a block, at the positions that are used: beside jumps turns scatter more."""
        block = self.problem.blocks[k]
        used = block.pooled(self.problem.masks[k]) if block.repeats else self.problem.variances[k]
        return np.broadcast_to(used, len(self.problem.masks[k]))

    def _scatter(self, k: int) -> Array:
        """Variance of one turn of a block, from all its turns."""
        block = self.problem.blocks[k]
        if block.repeats:
            return self._variance(k)
        if len(block.held) > 1:
            gaps = (block.held - block.held_mean)[:, self.problem.masks[k]]
            return np.full(block.held.shape[1], float(np.nanmean(gaps**2)) * len(gaps) / (len(gaps) - 1))
        same = [self._variance(i) for i in self._alike(k)]
        return np.full(block.held.shape[1], float(np.mean([np.mean(one) for one in same])) if same else np.nan)

    def _alike(self, k: int) -> Sequence[int]:
        channel = self.problem.blocks[k].channel
        return [i for i, one in enumerate(self.problem.blocks) if one.channel == channel and one.fitted]

    @property
    def trust(self) -> float:
        """Rms of all predictions over what is expected of them; NaN if nothing is held out."""
        rows = [(one.after / one.expected) ** 2 for one in self.held_out if one.expected > 0 and np.isfinite(one.after)]
        return float(np.sqrt(np.mean(rows))) if rows else float("nan")


def _rms(row: Array) -> float:
    known = row[np.isfinite(row)]
    return float(np.sqrt(np.mean(known**2))) if known.size else float("nan")
