"""Channels that no unknown acts on: they are not fitted, but speak for or against the model and a cause of a misfit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.rig.comparison.error_sources import ENOUGH, drive_angle
from trunnion.rig.identification.blocks import Block
from trunnion.rig.identification.signals import Model

__all__ = ["Missed", "UnusedChannels"]

Array = NDArray[np.float64]
FEWEST = 12  # positions that have a shape
MISSES = 2.0  # standard uncertainties, as rms, from which a channel does not agree
HALF = 0.5  # of its mean square that a shift of the angle has to take away
ACTS = 0.05  # of it, that the shift has to change
FLAT = 1e-6  # of a course of the model, that it has to vary to have a shape


class Missed(NamedTuple):
    """A channel that the model misses: RMS of its residual and what is expected of it.

    shape: of what is left once zero and gain are fitted, against the scatter alone; drive: whether it is the
    angle of the drive; gain: relative error of the gain that explains it, NaN if none does.
    """

    rms: float
    expected: float
    shape: bool
    drive: bool
    gain: float


@dataclass(frozen=True)
class UnusedChannels:
    """The channels that are not fitted, with the model of what they measure.

    late: standard uncertainty, s, of when the angle is passed, by condition; delay: of by how much a channel lags.
    """

    model: Model
    blocks: Sequence[Block]
    late: Sequence[float] = ()
    delay: float = 0.0

    def _gap(self, at: Array, block: Block, ahead: float) -> tuple[Model, Array, Array]:
        """The model, what it says and the residual, where the angle of a condition is ahead of it by so much, rad."""
        model, k = self.model, block.condition
        if ahead:
            first, last, _ = model.driven(k, at)
            phases = list(model.phases)
            phases[k] = (phases[k] + ahead / (last - first)) % 1.0
            model = replace(model, phases=tuple(phases))
        said = model.courses(at).said[k][block.channel].value[: block.turns.shape[1]]
        gap = block.mean - said
        if model.measures[block.channel].turning(model.run.system):
            gap = (gap + np.pi) % (2 * np.pi) - np.pi
        return model, said, gap

    def off(
        self, at: Array, block: Block, ahead: float = 0.0, late: tuple[float, float] = (0.0, 0.0)
    ) -> tuple[float, float]:
        """RMS of a residual without its mean, which may be the sensor's zero, and of its standard uncertainty.

        at: the unknowns; ahead: by which the angle of the condition is ahead of the model, rad; late: by how much the
        channel is behind it, and the standard uncertainty of that, s: f − τ df/dt is there to be read.
        """
        model, said, gap = self._gap(at, block, ahead)
        rate, course = model.rate(block.condition, said), block.course
        gap = gap + late[0] * rate
        random = (course.scatter**2 / np.maximum(course.count, 1))[np.isfinite(course.scatter)]
        gap = gap[np.isfinite(gap)]
        if not gap.size or not random.size:
            return np.nan, np.nan
        gain, moved = course.accuracy.gain * float(np.nanstd(course.mean)), late[1] * float(np.nanstd(rate))
        return float(np.std(gap)), float(np.sqrt(np.mean(random) + course.unresolved**2 + gain**2 + moved**2))

    def shape(self, at: Array, block: Block, ahead: float, late: tuple[float, float]) -> tuple[float, float]:
        """RMS of a residual once zero, gain and the angle within its uncertainty are fitted, and of the scatter.

        What is left tells of an error of the model that the stated accuracy hides; of an angle no gain is fitted. NaN
        if not known.
        """
        model, said, gap = self._gap(at, block, ahead)
        rate = model.rate(block.condition, said)
        gap, slope = gap + late[0] * rate, rate * late[1]
        there = np.isfinite(gap) & np.isfinite(slope)
        said, slope, gap = said[there], slope[there], gap[there]
        if not block.repeats or said.size < FEWEST or np.ptp(said) <= FLAT * np.max(np.abs(said)):
            return np.nan, np.nan
        expected = np.sqrt(np.mean((block.variance / np.maximum(block.count, 1))[there]) + block.unresolved**2)
        around = said - np.mean(said)
        around *= not model.measures[block.channel].turning(model.run.system)
        columns = np.column_stack([np.ones(said.size), around / (np.max(np.abs(around)) or 1.0), slope])
        best = np.linalg.lstsq(np.vstack([columns, [0.0, 0.0, expected]]), np.append(gap, 0.0), rcond=None)[0]
        return float(np.sqrt(np.mean((gap - columns @ best) ** 2))), float(expected)

    def missing(self, at: Array, late: Mapping[int, tuple[float, float]]) -> dict[str, Missed]:
        """By channel that does not agree, the worst condition: as it is stated, else by its shape.

        late: by condition, how far behind the angle is as the fit has it, and the standard uncertainty of that, s.
        """
        found: dict[str, Missed] = {}
        for shape, figures in ((False, self.off), (True, self.shape)):
            for block in self.blocks:
                mean, wide = late.get(block.condition, (0.0, self.late[block.condition]))
                rms, known = figures(at, block, 0.0, (mean, float(np.hypot(wide, self.delay))))
                before = found.get(block.channel)
                if rms > MISSES * known and (before is None or (before.shape == shape and rms > before.rms)):
                    found[block.channel] = Missed(
                        rms, known, shape, self._of_drive(at, block), np.nan if shape else self._gain(at, block)
                    )
        return found

    def _gain(self, at: Array, block: Block) -> float:
        """The error of a gain, relative, that explains a residual about its mean; NaN of angles, and if none does."""
        model, said, gap = self._gap(at, block, 0.0)
        there = np.isfinite(gap) & np.isfinite(said)
        around, left = (one[there] - np.mean(one[there]) for one in (said, gap))
        square = float(np.sum(around**2))
        gain = float(np.sum(left * around)) / square if square > 0 else np.nan
        explains = gain**2 * square >= ENOUGH * float(np.sum(left**2))
        return gain if explains and not model.measures[block.channel].turning(model.run.system) else np.nan

    def moving(self, at: Array) -> list[str]:
        """Channels whose course varies over the cycle, which therefore tells of the angle."""
        found: dict[str, None] = {}
        for block, said in ((one, self._gap(at, one, 0.0)[1]) for one in self.blocks):
            known = said[np.isfinite(said)]
            if known.size >= FEWEST and np.ptp(known) > FLAT * np.max(np.abs(known)):
                found[block.channel] = None
        return list(found)

    def _of_drive(self, at: Array, block: Block) -> bool:
        """Whether the readings of an angle are those of the drive."""
        model, k = self.model, block.condition
        first, last, _ = model.driven(k, at)
        there = np.isfinite(block.mean)
        if not np.isfinite(first) or there.size != len(model.phases[k]):
            return False
        said, drive = block.mean - self._gap(at, block, 0.0)[2], first + (last - first) * model.phases[k]
        there &= np.isfinite(said) & model.measures[block.channel].turning(model.run.system)
        return any(one.explains >= ENOUGH for one in drive_angle(block.mean[there], said[there], drive[there]))

    def refute(self, at: Array, ahead: Array) -> bool:
        """Whether a channel on which shifts of the angle act, rad by condition, neither agrees with them nor better."""
        for block in self.blocks:
            if not ahead[block.condition] or block.turns.shape[1] <= 2:
                continue
            (before, known), (after, _) = self.off(at, block), self.off(at, block, float(ahead[block.condition]))
            acts = abs(after**2 - before**2) > ACTS * before**2
            if acts and after**2 > HALF * before**2:
                left, scatter = self.shape(at, block, float(ahead[block.condition]), (0.0, self.late[block.condition]))
                if after > MISSES * known or left > MISSES * scatter:
                    return True
        return False
