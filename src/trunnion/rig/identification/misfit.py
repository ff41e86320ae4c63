"""What one error of the crank angle or of a sensor would explain of a misfit, and what the estimates would be without.

Each is one more free error of the fit: the same machinery finds its size, its uncertainty and the estimates with it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from trunnion.rig.identification.fit import Evaluations, Fit, SensorError, refined, rms
from trunnion.rig.identification.uncertainty import LackOfFit, lack_of_fit, quantile, spread_of

__all__ = ["MisfitCause", "explanations"]

Array = NDArray[np.float64]
ENOUGH = 0.8  # of a misfit, that a cause has to explain
ALIKE = 3.0  # standard deviations of χ², within which two causes explain the same
DEGREE = np.radians(1.0)
SETTLED = np.radians(0.01)
ROUNDS = 5


@dataclass(frozen=True)
class MisfitCause:
    """One explanation of a misfit.

    kind: zero, gain or angle; channel: empty of the angle; size: in the unit of the channel, relative, or rad by which
    the readings are ahead of the model; expanded: U of it, 95 %; explains: share of the part of χ² above what scatter
    leads to expect; estimates, halves: of the unknowns with it, and U of each, 95 %, (unknown,); left: how well the
    model fits with it.
    """

    kind: str
    channel: str
    size: float
    expanded: float
    explains: float
    estimates: Array
    halves: Array
    left: LackOfFit


def explanations(fit: Fit, start: Array, test: LackOfFit) -> list[MisfitCause]:
    """Errors that explain most of a misfit, and about as much as each other, the simplest first; empty if none does.

    One whose size is 0 within its uncertainty explains nothing, nor does a gain that leaves nothing of the model.
    """
    causes = [one for one in _candidates(fit, start, test) if not (one.kind == "gain" and one.size < 2e-6 - 1)]
    chance = 1 + ALIKE * np.sqrt(2 / max(test.freedom, 2.0))  # of the ratio of two reduced χ²
    most = chance * max(min((one.left.reduced for one in causes), default=np.nan), 1.0)
    return [
        one for one in causes if one.explains >= ENOUGH and one.left.reduced <= most and abs(one.size) > one.expanded
    ]


def _candidates(fit: Fit, start: Array, test: LackOfFit) -> Iterator[MisfitCause]:
    """Fits with a zero or a gain of each channel, beyond what is stated of it, and with an offset of the angle."""
    model = fit.model
    for kind, channel in product(("zero", "gain"), dict.fromkeys(fit.blocks[k].channel for k in fit.fitted())):
        if kind == "gain" and model.measures[channel].turning(model.run.system):
            continue
        turns = np.concatenate([block.turns.ravel() for block in fit.blocks if block.channel == channel])
        unit = 0.01 * (1.0 if kind == "gain" else rms(turns) or 1.0)
        sizes = tuple(unit * (block.channel == channel) for block in fit.blocks)
        error = SensorError(f"{kind} of {channel}", channel, kind, sizes, stated=False)
        if cause := _with(fit, start, error, unit, test)[0]:
            yield cause
    ahead = 0.0
    sizes = tuple(-DEGREE / model.turns[block.condition] * (block.turns.shape[1] > 2) for block in fit.blocks)
    if not np.isfinite(sizes).all() or not any(sizes):
        return
    error = SensorError("offset of the drive angle", "", "angle", sizes, stated=False)
    for _ in range(ROUNDS):  # the positions follow the angle until it is settled
        phases = tuple((phase + ahead / turn) % 1.0 for phase, turn in zip(model.phases, model.turns, strict=True))
        moved = replace(fit, courses_at=Evaluations(replace(model, phases=phases))) if ahead else fit
        cause, start = _with(moved, start, error, DEGREE, test)
        if cause is None or abs(cause.size) > np.pi:
            return
        ahead += cause.size
        if not model.run.cycle.periodic or abs(cause.size) < SETTLED:
            break
    if cause:
        yield replace(cause, size=ahead)


def _with(fit: Fit, start: Array, error: SensorError, unit: float, test: LackOfFit) -> tuple[MisfitCause | None, Array]:
    """What a fit with one error more comes to, None where the model has no answer; and its place without the error.

    unit: standard uncertainty of the error.
    """
    try:
        more, best = refined(replace(fit, sensors=[*fit.sensors, error], inflation=1.0), np.append(start, 0.0))
    except ValueError:  # no answer of the model there
        return None, start
    left, spread, count = lack_of_fit(more, best.x), spread_of(more, best.x), fit.count
    half = quantile(spread.freedom) * spread.deviation
    explains = min((test.reduced - left.reduced) / (test.reduced - 1), 1.0)
    size, wide = float(best.x[-1]) * unit, float(half[-1]) * unit
    cause = MisfitCause(error.kind, error.channel, size, wide, explains, best.x[:count], half[:count], left)
    return cause, best.x[:-1]
