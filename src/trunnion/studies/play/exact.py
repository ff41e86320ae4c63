"""What play does to a measure exactly, with the pins where first order has its worst case.

First order adds ρ |Q| of every joint. The pins are put there, ρ Q/|Q| from the middle of their holes, on either side,
and the mechanism is assembled again. What the measure changes by can be more, near a dead centre above all, and pins
that lie in seats can reach it; it can be less, and not the same on both sides, as of a spring that comes free.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.errors import Finding, Severity, Status
from trunnion.measures import curves
from trunnion.measures.curves import MOTIONS
from trunnion.measures.many import Many
from trunnion.measures.measures import Measure
from trunnion.results.sentences import finding_for
from trunnion.solve.forward import forward
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.shifts import HOLE, carriers_of

if TYPE_CHECKING:
    from trunnion.solve.run import Run
    from trunnion.studies.play.effect import Effect

__all__ = ["beyond_first_order", "exact_changes", "figures_with"]

Array = NDArray[np.float64]
SLIGHT, GRAVE = 0.01, 0.05  # of the worst case to first order: how far off is a note, how much more a warning


def exact_changes(effect: Effect, i: int, at: NDArray[np.intp]) -> tuple[Array, Array]:
    """Changes of a measure, (side, position), with the pins at the worst of first order, and what that has of them.

    at: numbers of the positions. Pins lie on the link on which they do more, if the model does not say which. Of an
    extreme the change is that of the extreme, wherever the pins move its place.
    """
    run, measure, first = effect.run, effect.measures[i], np.zeros(len(at))
    offsets: tuple[dict[str, Array], dict[str, Array]] = {}, {}
    for j, (name, one) in enumerate(effect.plays.items()):
        carriers = (HOLE,) if measure.kind in MOTIONS else carriers_of(run.system.mechanism, name)
        radii = np.array([np.broadcast_to(np.asarray(primal(radius), float), at.shape) for radius in one.radii])
        both = np.array([loads[i, j][: len(radii), :, at] for loads in (effect.loads, effect.others)[: len(carriers)]])
        size = np.sqrt(np.nansum(both**2, axis=2))  # (carrier, end, position)
        work = np.sum(radii * size, axis=1)
        first = first + np.max(work, axis=0)
        here = np.argmax(work, axis=0) == np.arange(len(carriers))[:, None]
        places = np.nan_to_num(
            both * np.where(here[:, None], radii / np.where(size > 0, size, np.inf), 0.0)[:, :, None]
        )
        for carrier, place in zip(carriers, places, strict=True):
            for parts, end in zip(place, one.model.ends, strict=True):
                own = {f"{carrier}.{name}.{key}": parts["xyz".index(key.rpartition(".")[2])] for key in end}
                offsets[0].update((path, -part) for path, part in own.items())
                offsets[1].update(own)
    if effect.figure is None:
        found = np.array([_value(run, measure, effect.time[at], own) for own in offsets]) - effect.value[i, at]
    else:
        sides = {path: np.stack([own[path] for own in offsets]) for path in offsets[0]}
        found = (effect.figure(sides) - effect.figure({}))[:, None]
    if measure.turning(run.system):
        found = found - 2 * np.pi * np.round(found / (2 * np.pi))
    return found, first


def figures_with(many: Many, measure: Measure, offsets: Mapping[str, Array]) -> Array:
    """An extreme, (sample,), with pins at offsets by path, m, (sample, 1)."""
    return np.asarray(many.read({**many.run.values, **offsets})[measure.name].figure)


def _value(run: Run, measure: Measure, time: Array, offsets: dict[str, Array]) -> Array:
    """A measure at some times, s, with the pins at offsets in their holes."""
    if not measure.of_motion:
        value = measure.curve(run.at(time, offsets, FrictionMethod()))[0]
    else:
        walk = forward(run.system, {**run.values, **offsets}, run.chosen.assembly, time)
        value = curves.value(measure, walk) if measure.kind in MOTIONS else measure.curve(walk)[0]
    return np.broadcast_to(np.asarray(primal(value), float), time.shape)


def beyond_first_order(effect: Effect) -> Iterator[Finding]:
    """A measure that pins in their holes change otherwise than first order says, at the one position of an effect.

    One of forces is not looked at where a joint is at rest: there the pins turn the sense of its friction.
    """
    run, (measure,) = effect.run, effect.measures
    with np.errstate(all="ignore"):
        changes, (first,) = exact_changes(effect, 0, np.zeros(1, np.intp))
    low, high = np.sort(changes[:, 0]).tolist()
    if not (first > 0 and np.isfinite(high - low)) or not (measure.of_motion or effect.status[0] == Status.SOLVED):
        return
    off = max(abs(low + first), abs(high - first)) / first
    if off > SLIGHT:
        yield finding_for(
            "play.beyond_first_order", f"measures.{measure.name}", low=low, high=high, first=float(first),
            severity=Severity.WARNING if max(-low, high) > (1 + GRAVE) * first else Severity.NOTE,
            unit=measure.unit(run.system), at=run.system.dial(run.values, effect.time).at(0),
        )  # fmt: skip
