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
from trunnion.measures.evaluation import NumpyKernel
from trunnion.measures.many import Many
from trunnion.measures.measures import Measure
from trunnion.measures.motion import MOTIONS
from trunnion.results.sentences import finding_for
from trunnion.solve.forward import forward
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.shifts import HOLE, carriers_of
from trunnion.studies.play.result import relied_on

if TYPE_CHECKING:
    from trunnion.solve.run import Run
    from trunnion.studies.play.effect import Effect

__all__ = ["beyond_first_order", "exact_changes", "figures_with", "on_other_links", "one_sided"]

Array = NDArray[np.float64]
TRIED = ((16, 1.0), (64, 1.0), (64, 0.5), (64, 0.25), (64, 0.12), (64, 0.06))  # places of pins, how far about the best
PLACES, NONE = 720, 1e-6  # positions at which they are; of the largest value: a change that is none
MUCH = 1.2  # times as much on the other link as on that of the hole
SLIGHT, GRAVE = (
    0.01,
    0.05,
)  # of the worst case to first order: how much more is a note, and a warning; so much less is a note


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


def on_other_links(effect: Effect, i: int) -> Iterator[Finding]:
    """Joints whose effect, where it is largest, is that of a pin whose place is not fixed on the link with the hole."""
    joints, links = effect.run.system.mechanism.effective_joints, {}
    for j, name in enumerate(effect.plays):
        course = effect.worst_case[i, j]
        if not np.any(np.isfinite(course)):
            continue
        hole, other = effect.by_link(i, j)[:, int(np.nanargmax(course))]
        if other > MUCH * hole:
            links[name] = f"{joints[name].links[0]} ({name}: {hole / other:.2g} times on {joints[name].links[1]})"
    if links:
        where = f"measures.{effect.measures[i].name}"
        yield finding_for("play.on_other_links", where, links=list(links.values()), joint=next(iter(links)))


def one_sided(effect: Effect, i: int) -> Iterator[Finding]:
    """A measure of forces that does not change to first order, but does with the pins on the rims of their holes.

    So does that of a spring or contact that is just open. The rims are searched: directions by chance, and about the
    best of them.
    """
    run, measure = effect.run, effect.measures[i]
    known = np.flatnonzero(np.isfinite(effect.value[i]))
    if measure.kind in MOTIONS or np.any(effect.total[i] > 0) or not len(known):
        return
    at = known[:: -(-len(known) // PLACES)]
    kernel, rng = NumpyKernel(run, [measure], FrictionMethod()), np.random.default_rng(1)
    ends = [(name, end, one.radii[k]) for name, one in effect.plays.items() for k, end in enumerate(one.model.ends)]
    best: list[Array] = [np.zeros((1, len(end))) for _, end, _ in ends]
    most, time, size = 0.0, 0.0, float(np.max(np.abs(effect.value[i, known])))
    for tried, width in TRIED:
        ways = [place + width * rng.standard_normal((tried, place.shape[1])) for place in best]
        ways = [way / np.sqrt(np.sum(way**2, axis=1, keepdims=True)) for way in ways]
        offsets = {
            f"{HOLE}.{name}.{key}": float(np.ravel(primal(radius))[0]) * way[:, k : k + 1]
            for (name, end, radius), way in zip(ends, ways, strict=True)
            for k, key in enumerate(end)
        }
        course = kernel.courses({**run.values, **offsets}, effect.time[at])[0][measure.name][0]
        value = np.nan_to_num(np.broadcast_to(np.asarray(primal(course), float), (tried, len(at))))
        change, size = np.abs(value - effect.value[i, at]), max(size, float(np.max(np.abs(value))))
        row, column = np.unravel_index(int(np.argmax(change)), change.shape)
        if change[row, column] > most:
            most, best = float(change[row, column]), [way[row : row + 1] for way in ways]
            time, at = float(effect.time[at[column]]), at[max(0, int(column) - 1) : int(column) + 2]
    if most > NONE * size:
        where, dial = f"measures.{measure.name}", run.system.dial(run.values, np.array([time]))
        yield finding_for("play.one_sided", where, found=most, unit=measure.unit(run.system), at=dial.at(0))


def figures_with(many: Many, measure: Measure, offsets: Mapping[str, Array]) -> Array:
    """An extreme, (sample,), with pins at offsets by path, m, (sample, 1)."""
    return np.asarray(many.read({**many.run.values, **offsets})[measure.name].figure)


def _value(run: Run, measure: Measure, time: Array, offsets: dict[str, Array]) -> Array:
    """A measure at some times, s, with the pins at offsets in their holes."""
    if not measure.of_motion:
        value = measure.curve(run.at(time, offsets, FrictionMethod()))[0]
    else:
        walk = forward(run.system, {**run.values, **offsets}, run.chosen.assembly, time)
        value = measure.value(walk) if measure.kind in MOTIONS else measure.curve(walk)[0]
    return np.broadcast_to(np.asarray(primal(value), float), time.shape)


def beyond_first_order(effect: Effect, i: int) -> Iterator[Finding]:
    """A measure that pins in their holes can change by more than the worst case of first order says, or by less on a
    side where that is largest.

    One of forces is looked at where its worst case is largest alone, and not where a joint is at rest: elsewhere the
    pins turn the sense of the friction of joints that hardly move.
    """
    run, measure = effect.run, effect.measures[i]
    dial, totals = run.system.dial(run.values, effect.time), relied_on(effect.total, effect.status)[i]
    largest = float(np.nanmax(totals, initial=0.0))
    if not largest > 0:
        return
    top = int(np.nanargmax(totals))
    places = np.flatnonzero(np.isfinite(totals)) if measure.of_motion else np.array([top])
    with np.errstate(all="ignore"):
        both, own = exact_changes(effect, i, places)
        exact = np.fmax(*np.abs(both))
    if not np.any(np.isfinite(exact)) or not (measure.of_motion or effect.status[top] == Status.SOLVED):
        return
    at, there = int(np.nanargmax(exact)), int(np.searchsorted(places, top))
    over = float(exact[at]) / largest - 1
    where, unit = f"measures.{measure.name}", measure.unit(run.system)
    if over > SLIGHT:
        severity = Severity.WARNING if over > GRAVE else Severity.NOTE
        yield finding_for(
            "play.beyond_first_order", where, severity=severity, exact=float(exact[at]), first=largest, unit=unit,
            percent=100 * over, at=dial.at(int(places[at])),
        )  # fmt: skip
    elif np.all(np.isfinite(both[:, there])) and np.any(np.abs(both[:, there]) < (1 - GRAVE) * own[there]):
        low, high = np.sort(both[:, there]).tolist()
        yield finding_for(
            "play.below_first_order", where, low=low, high=high, first=largest, unit=unit, at=dial.at(top)
        )
