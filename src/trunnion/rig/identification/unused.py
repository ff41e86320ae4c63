"""Channels that no unknown acts on: they are not fitted, but speak for or against the model and a cause of a misfit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from trunnion.rig.identification.blocks import Block
from trunnion.rig.identification.signals import Model

__all__ = ["UnusedChannels"]

Array = NDArray[np.float64]
MISSES = 2.0  # standard uncertainties, as rms, from which a channel does not agree
HALF = 0.5  # of its mean square that a shift of the angle has to take away
ACTS = 0.05  # of it, that the shift has to change


@dataclass(frozen=True)
class UnusedChannels:
    """The channels that are not fitted, with the model of what they measure."""

    model: Model
    blocks: Sequence[Block]

    def off(self, at: Array, block: Block, ahead: float = 0.0) -> tuple[float, float]:
        """RMS of a residual without its mean, which may be the sensor's zero, and of its standard uncertainty.

        at: the unknowns; ahead: by which the angle of the condition is ahead of the model, rad.
        """
        model, k = self.model, block.condition
        if ahead:
            first, last, _ = model.driven(k, at)
            phases = list(model.phases)
            phases[k] = (phases[k] + ahead / (last - first)) % 1.0
            model = replace(model, phases=tuple(phases))
        gap = block.mean - model.courses(at).said[k][block.channel].value
        if model.measures[block.channel].turning(model.run.system):
            gap = (gap + np.pi) % (2 * np.pi) - np.pi
        known = block.course.uncertainty
        gap, known = gap[np.isfinite(gap)], known[np.isfinite(known)]
        return (float(np.std(gap)) if gap.size else np.nan, float(np.sqrt(np.mean(known**2))) if known.size else np.nan)

    def missing(self, at: Array) -> dict[str, tuple[float, float]]:
        """By channel that does not agree: RMS of the residual and of its uncertainty, of the worst condition."""
        found: dict[str, tuple[float, float]] = {}
        for block in self.blocks:
            rms, known = self.off(at, block)
            if rms > max(MISSES * known, found.get(block.channel, (0.0, 0.0))[0]):
                found[block.channel] = rms, known
        return found

    def refute(self, at: Array, ahead: Array) -> bool:
        """Whether a channel on which shifts of the angle act, rad by condition, neither agrees with them nor better."""
        for block in self.blocks:
            if not ahead[block.condition] or block.turns.shape[1] <= 2:
                continue
            (before, known), (after, _) = self.off(at, block), self.off(at, block, float(ahead[block.condition]))
            acts = abs(after**2 - before**2) > ACTS * before**2
            if acts and after > MISSES * known and after**2 > HALF * before**2:
                return True
        return False
