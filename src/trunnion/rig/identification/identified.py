"""What the estimates are worth: intervals, limits, residuals before and after, and what was held out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trunnion.model.mechanism import Mechanism
from trunnion.rig.identification.fit import FAR, Fit, Solution, rms
from trunnion.rig.identification.identifiability import InseparableUnknowns
from trunnion.rig.identification.misfit import MisfitCause
from trunnion.rig.identification.uncertainty import Covariances, quantile
from trunnion.rig.reading.measurement import Measurement

__all__ = ["HeldOut", "Identified", "Misses"]

Array = NDArray[np.float64]
AT_LIMIT = 0.05  # of the standard uncertainty: nearer than this to a limit is on it


@dataclass(frozen=True)
class Misses:
    """How far the model is from the data of a block, (position,): before and after, and what the scatter explains.

    used, out: positions.
    """

    before: Array
    after: Array
    expected: Array
    used: int
    out: int


@dataclass(frozen=True)
class HeldOut:
    """How well data that were not fitted are predicted, rms; expected: by their scatter and the estimates'."""

    before: float
    after: float
    expected: float


@dataclass(frozen=True)
class Identified:
    """An identification, with the figures of it, (unknown,) unless said.

    starts: places that the search began at; other: another that fits as well; groups: what the data do not tell apart;
    causes: what would explain a misfit, best first; unused: channels that no unknown acts on.
    """

    mechanism: Mechanism
    measurement: Measurement
    fit: Fit
    solution: Solution
    starts: int
    other: Array | None
    spread: Covariances
    groups: Sequence[InseparableUnknowns]
    causes: Sequence[MisfitCause]
    unused: Sequence[str]

    @property
    def x(self) -> Array:
        """Estimates of the unknowns, then of the sensors' errors."""
        return self.solution.x

    @cached_property
    def times_stated(self) -> float:
        """Size of the first cause of a misfit in standard uncertainties that are stated of it; 0 where none is."""
        if not self.causes:
            return 0.0
        first, sensors = self.causes[0], [one for one in self.fit.sensors if one.stated]
        alike = [max(map(abs, one.sizes)) for one in sensors if (one.kind, one.channel) == (first.kind, first.channel)]
        stated = max([one.angle for one in sensors] if first.kind == "angle" else alike, default=0.0)
        return abs(first.size) / stated if stated else 0.0

    @property
    def refuted(self) -> bool:
        """Whether the estimates stand for something else: a gross misfit, or an error beyond what is stated of it."""
        return self.spread.test.gross or bool(self.spread.beyond) or self.times_stated > FAR

    @cached_property
    def lost(self) -> NDArray[np.bool_]:
        """Unknowns that the data do not tell, (unknown and sensor,)."""
        members = [one for group in self.groups for one in group.members]
        return np.isin(np.arange(len(self.x)), members)

    @property
    def values(self) -> Array:
        """Estimates, of what the data do not tell the start."""
        return np.asarray(np.where(self.lost, self.fit.start, self.x)[: self.fit.count])

    @cached_property
    def deviation(self) -> Array:
        """Standard uncertainty, (unknown and sensor,); NaN of what the data do not tell."""
        return np.asarray(np.where(self.lost, np.nan, self.spread.deviation))

    @cached_property
    def _step(self) -> Array:
        """Where the next step would go without limits, (unknown and sensor,)."""
        return np.asarray(-self.spread.inverse @ (self.fit.jacobian(self.x).T @ self.fit.residuals(self.x)))

    @cached_property
    def limit(self) -> NDArray[np.int8]:
        """−1 of an unknown on its lower limit, 1 on its upper, 0 of others."""
        (low, high), x = self.fit.bounds, self.x
        near = AT_LIMIT * np.nan_to_num(self.deviation) + 1e-9 * np.abs(x)
        limit = np.where(
            (high - x <= near) & (self._step >= 0), 1, np.where((x - low <= near) & (self._step <= 0), -1, 0)
        )
        return np.asarray(np.where(self.lost, 0, limit)[: self.fit.count], np.int8)

    @cached_property
    def estimate(self) -> Array:
        """Estimates; on a limit the limit itself, NaN of what the data do not tell."""
        n = self.fit.count
        low, high = (end[:n] for end in self.fit.bounds)
        at = np.where(self.limit < 0, low, np.where(self.limit > 0, high, self.x[:n]))
        return np.asarray(np.where(self.lost[:n], np.nan, at))

    @cached_property
    def interval(self) -> tuple[Array, Array]:
        """95 %, within the limits; one-sided of an unknown on one, from where a step without limits ends if inside."""
        n = self.fit.count
        low, high = (end[:n] for end in self.fit.bounds)
        u, freedom, free = self.deviation[:n], self.spread.freedom[:n], (self.x + self._step)[:n]
        half, one_sided = quantile(freedom) * u, quantile(freedom, one_sided=True) * u
        lower = np.where(self.limit > 0, np.minimum(free, high) - one_sided, self.estimate - half)
        upper = np.where(self.limit < 0, np.maximum(free, low) + one_sided, self.estimate + half)
        return np.maximum(np.where(self.limit < 0, low, lower), low), np.minimum(
            np.where(self.limit > 0, high, upper), high
        )

    # ---- residuals --------------------------------------------------------------------------------------------

    @cached_property
    def misses(self) -> dict[int, Misses]:
        """Of every block that was fitted."""
        misses = {}
        for k in self.fit.fitted():
            block, mask = self.fit.blocks[k], self.fit.masks[k]
            before, after = (np.where(mask, self.fit.gap(x, k), np.nan) for x in (self.fit.start, self.x))
            # beside jumps turns scatter more
            scatter = np.sqrt(block.pooled(mask) / np.maximum(block.count, 1) + block.unresolved**2)
            expected = np.where(mask & block.repeats, scatter, np.nan)
            out = int(np.count_nonzero(np.isfinite(block.mean) & ~mask))
            misses[k] = Misses(before, after, expected, int(np.count_nonzero(mask)), out)
        return misses

    @cached_property
    def held_out(self) -> dict[int, HeldOut]:
        """Of every block of which turns were held out."""
        held, allowed = {}, self.fit.allowed(self.x)
        for k, block in enumerate(self.fit.blocks):
            if not len(block.held):
                continue
            where = allowed[k] & np.isfinite(block.held_mean)
            before, after = (
                rms(np.where(where, self.fit.gap(x, k, block.held_mean), np.nan)) for x in (self.fit.start, self.x)
            )
            columns = np.nan_to_num(self.fit.reading(self.x, k)[1])
            predicted = np.einsum("pi,pq,qi->i", columns, self.spread.covariance, columns)
            count = np.maximum(np.count_nonzero(np.isfinite(block.held), axis=0), 1)
            expected = np.where(where, np.sqrt(self._scatter(k) / count + predicted), np.nan)
            held[k] = HeldOut(before, after, rms(expected))
        return held

    def _scatter(self, k: int) -> float:
        """Variance of one turn of a block of which turns are held out."""
        block, mask = self.fit.blocks[k], self.fit.masks[k]
        if block.repeats:
            return block.pooled(mask)
        if len(block.held) > 1:
            return float(np.nanmean(np.nanvar(block.held[:, mask], axis=0, ddof=1)))
        alike = [one for one in self.fit.fitted() if self.fit.blocks[one].channel == block.channel]
        return float(np.mean([self.fit.variances[one] for one in alike])) if alike else float("nan")

    @property
    def hold_out_ratio(self) -> float:
        """Rms of all predictions over what is expected of them; NaN if nothing is held out."""
        held = self.held_out.values()
        rows = [(one.after / one.expected) ** 2 for one in held if one.expected > 0 and np.isfinite(one.after)]
        return float(np.sqrt(np.mean(rows))) if rows else float("nan")
