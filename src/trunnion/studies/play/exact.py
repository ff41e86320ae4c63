"""What play does to coordinates and angles exactly, with the pins where first order has its worst case.

First order adds ρ |Q| of every joint. The pins are put there, ρ Q/|Q| from the middle of their holes, on either side,
and the mechanism is assembled again: what the measure changes by can be more, near a dead centre above all, and pins
that lie in seats can reach it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.errors import Finding, Severity
from trunnion.measures.motion import MOTIONS
from trunnion.results.sentences import finding_for
from trunnion.solve.forward import forward
from trunnion.studies.play.result import relied_on

if TYPE_CHECKING:
    from trunnion.studies.play.effect import Effect

__all__ = ["beyond_first_order", "exact_changes"]

Array = NDArray[np.float64]
SLIGHT, GRAVE = 0.01, 0.05  # of the worst case to first order: by how much it is exceeded, to be a note, and a warning


def exact_changes(effect: Effect, i: int) -> Array:
    """Largest magnitude of the change of a measure, (position,), with the pins at the worst of first order."""
    run, measure = effect.run, effect.measures[i]
    found: Array = np.full(len(effect.time), np.nan)
    for side in (-1.0, 1.0):
        offsets: dict[str, Array] = {}
        for j, (name, one) in enumerate(effect.plays.items()):
            for k, (end, radius) in enumerate(zip(one.model.ends, one.radii, strict=True)):
                load = {key: effect.loads[i, j, k, "xyz".index(key.rpartition(".")[2])] for key in end}
                size = np.sqrt(np.sum([part**2 for part in load.values()], axis=0))
                scale = side * np.asarray(primal(radius), float) / np.where(size > 0, size, np.inf)
                offsets |= {f"seats.{name}.{key}": scale * part for key, part in load.items()}
        walk = forward(run.system, {**run.values, **offsets}, run.chosen.assembly, effect.time)
        change = np.broadcast_to(np.asarray(primal(measure.value(walk)), float), effect.time.shape) - effect.value[i]
        if measure.turning(run.system):
            change = change - 2 * np.pi * np.round(change / (2 * np.pi))
        found = np.fmax(found, np.abs(change))
    return found


def beyond_first_order(effect: Effect) -> Iterator[Finding]:
    """Measures that pins in their holes can change by more than the worst case of first order says."""
    for i, measure in enumerate(effect.measures):
        if measure.kind not in MOTIONS:
            continue
        own, k = effect.of(i)
        dial, totals = own.run.system.dial(own.run.values, own.time), relied_on(own.total, own.status)[k]
        with np.errstate(all="ignore"):
            exact = np.where(np.isfinite(totals), exact_changes(own, k), np.nan)
            largest = np.nanmax(totals, initial=0.0)
        if not largest > 0 or not np.any(np.isfinite(exact)):
            continue
        at = int(np.nanargmax(exact))
        over = float(exact[at]) / largest - 1
        if over > SLIGHT:
            severity = Severity.WARNING if over > GRAVE else Severity.NOTE
            yield finding_for(
                "play.beyond_first_order", f"measures.{measure.name}", severity=severity, exact=float(exact[at]),
                first=float(largest), unit=measure.unit(effect.run.system), percent=100 * over, at=dial.at(at),
            )  # fmt: skip
