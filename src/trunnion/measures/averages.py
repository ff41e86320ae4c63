"""Means of a course that jumps: where a load begins or ends, or friction turns round.

The places of the rule of a mean lie between the edges of the nominal mechanism. Where another mechanism jumps
elsewhere, the course at some of them is that of the wrong side, and its mean off by as much as the rule makes of a
jump within a panel. So every mechanism has the edges moved to its own jumps, and the rule between them; differences of
such means have the part of the edges too, Leibniz's rule: d/dp ∫ y dt = ∫ ∂y/∂p dt − Σ [y] dt/dp over the jumps [y].
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.quadrature import nodes
from trunnion.measures.figures import Reference, figure
from trunnion.solve.switches import Mechanisms, bends, parted, tracked

if TYPE_CHECKING:
    from trunnion.measures.positions import PositionPlan
    from trunnion.solve.system import Values

__all__ = ["LookAtParts", "averaged", "own_edges", "settled", "with_jumps"]

Array = NDArray[np.float64]
LookAtParts = Callable[[Array], Sequence[Array]]  # from times, s, to the parts of a course there, all (row, place)
BESIDE = 1e-9  # of the cycle: on the sides of a place at which the model switches
JUMP = 1e-6  # of the size of a course: what is less is none
ROUNDS, PARTS, SMALL = 7, 8, 1e-9  # so often a panel is parted, into how many, from which share of the mean it errs
MOST = 32  # bends beside jumps that are followed too, as to points of a table


def with_jumps(known: Reference, look: LookAtParts, plan: PositionPlan, values: Values) -> Reference:
    """The same nominal mechanism, with the places at which the course bends if its figure is a mean and it jumps.

    values: its numbers, with pins in their seats, which move these places.
    """
    run = plan.run
    if known.against or known.measure.in_time or not run.bends:
        return known
    time = plan.bends(values)
    sides = look((time + BESIDE * run.cycle.duration * np.array([[-1.0], [1.0]])).reshape(1, -1))
    jumps = np.zeros(len(time), bool)
    for part, whole in zip(sides, known.parts, strict=True):
        jumps |= ~(np.abs(np.diff(part.reshape(2, -1), axis=0)[0]) <= JUMP * np.max(np.abs(whole), initial=0.0))
    if not np.any(jumps):
        return known
    followed = np.flatnonzero(jumps | (len(time) <= MOST))
    sharp = replace(known, bends=tuple(run.bends[i] for i in followed), corner=True)
    of = Mechanisms(run.system, run.chosen.assembly, values, [run.cycle])
    return replace(sharp, figure=float(averaged(sharp, look, own_edges(sharp, of, plan))[0]))


def settled(known: Reference, look: LookAtParts) -> Reference:
    """The same mechanism, its mean by panels that are parted where the rule errs: pins in seats move the jumps."""
    edges = known.window.edges
    assert edges is not None
    for _ in range(ROUNDS):
        rule = nodes(edges)
        parts = np.array(look(rule.at[None])).reshape(len(known.parts), len(edges) - 1, -1)
        inside, whole = (one.reshape(len(edges) - 1, -1) for one in (rule.inside, rule.weights))
        off = np.abs(np.sum(parts * (whole - inside), axis=-1))
        wide = np.any(off > SMALL * np.sum(np.abs(parts) * whole, axis=(1, 2))[:, None], axis=0)
        if not np.any(wide):
            break
        new = np.linspace(edges[:-1][wide], edges[1:][wide], PARTS + 1)[1:-1]
        edges = np.sort(np.concatenate([edges, new.ravel()]))
    return replace(known, figure=float(averaged(known, look, edges[None])[0]))


def averaged(known: Reference, look: LookAtParts, edges: Array) -> Array:
    """The figure, (row,), of mechanisms with their edges, (row, edge)."""
    rule = nodes(edges)
    window = replace(known.window, index=np.arange(rule.at.shape[-1]), weights=(rule.weights, rule.inside))
    there = replace(known, window=window, positions=rule.at.shape[-1])
    return np.asarray(figure(look(rule.at), there), float)


def own_edges(known: Reference, of: Mechanisms, plan: PositionPlan) -> Array:
    """The edges of the mean of every mechanism, times of the nominal one, s, (row, edge): at its own jumps.

    A jump that is not found near that of the nominal mechanism, as it is far away or none, is looked for over the cycle
    where the drivers are those of the nominal mechanism; edges that are too many are one at the end.
    """
    edges, cycle = known.window.edges, of.cycles[0]
    assert edges is not None
    own = tracked(of, known.bends, lambda values, time: replace(plan, times=time).moved(values))
    if cycle.periodic:
        laps = np.arange(edges[0] // cycle.duration, edges[-1] // cycle.duration + 1) * cycle.duration
    else:
        laps = np.zeros(1)
    time = (np.array([one.time for one in known.bends])[:, None] + laps).ravel()
    moved = (own[:, :, None] + laps).reshape(len(own), -1)
    lost = np.any(np.isnan(moved), axis=1)
    found = _carried(edges, time, np.where(np.isnan(moved), time, moved))
    if np.any(lost) and plan.moved(of.values) is plan.times:
        found = _with_anew(found, np.flatnonzero(lost), of, edges)
    return found


def _carried(edges: Array, time: Array, moved: Array) -> Array:
    """Edges, (row, edge), carried along with some times between them, (time,), that are moved, (row, time)."""
    within = (time > edges[0]) & (time < edges[-1])
    order = np.argsort(time[within])
    first, last = edges[0], edges[-1]
    ends = np.ones((len(moved), 1))
    knots = np.concatenate([[first], time[within][order], [last]])
    there = np.sort(np.clip(moved[:, within][:, order], first, last), axis=1)
    there = np.concatenate([first * ends, there, last * ends], axis=1)
    gap = np.clip(np.searchsorted(knots, edges, side="right") - 1, 0, len(knots) - 2)
    share = (edges - knots[gap]) / (knots[gap + 1] - knots[gap])
    return np.asarray(there[:, gap] + share * (there[:, gap + 1] - there[:, gap]))


def _with_anew(found: Array, rows: NDArray[np.intp], of: Mechanisms, edges: Array) -> Array:
    """The edges with those of some mechanisms found from nothing."""
    some = Mechanisms(of.system, of.assembly, of.picked(rows), [of.cycles[int(row)] for row in rows])
    cycle, first, last = of.cycles[0], edges[0], edges[-1]
    anew = [np.clip(_over(parted(times, cycle), cycle.duration, first, last), first, last) for times in bends(some)]
    count = max(found.shape[1], *(len(one) for one in anew))
    whole = np.pad(found, ((0, 0), (0, count - found.shape[1])), mode="edge")
    for row, one in zip(rows, anew, strict=True):
        whole[row] = np.pad(one, (0, count - len(one)), mode="edge")
    return whole


def _over(edges: Array, duration: float, first: float, last: float) -> Array:
    """The edges of a cycle in all laps that a window touches, rising, with its ends."""
    laps = np.arange(first // duration, last // duration + 1) * duration
    return np.concatenate([[first], np.unique(edges + laps[:, None]), [last]])
