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

from trunnion.algebra.dual import primal
from trunnion.algebra.quadrature import nodes
from trunnion.measures.corners import BESIDE
from trunnion.measures.figures import Reference, figure
from trunnion.solve.switches import Mechanisms, bends, nearly_passed, tracked

if TYPE_CHECKING:
    from trunnion.measures.positions import PositionPlan
    from trunnion.solve.system import Values

__all__ = ["LookAtParts", "averaged", "own_edges", "with_jumps"]

Array = NDArray[np.float64]
LookAtParts = Callable[[Array], Sequence[Array]]  # from times, s, to the parts of a course there, all (row, place)
JUMP = 1e-6  # of the size of a course: what is less is none
AT_ONCE = 64  # mechanisms whose bends are looked for at a time
MOST = 32  # bends beside jumps that are followed too, as to points of a table


def with_jumps(known: Reference, look: LookAtParts, plan: PositionPlan, values: Values) -> Reference:
    """The same nominal mechanism, with the places at which the course bends if its figure is a mean and it jumps.

    values: its numbers, with pins in their seats, which move these places. Without places, every mechanism has its own
    looked for over the cycle: a load that the nominal one only just does not meet begins in others.
    """
    run = plan.run
    if known.against or known.measure.in_time or known.measure.of_motion or run.cycle.duration <= 0:
        return known
    of = Mechanisms(run.system, run.chosen.assembly, values, [run.cycle])
    if nearly_passed(of):
        return _with_figure(replace(known, bends=(), corner=True), look, of, plan)
    time = plan.bends(values)
    if not len(time):
        return known
    sides = look((time + BESIDE * run.cycle.duration * np.array([[-1.0], [1.0]])).reshape(1, -1))
    jumps = np.zeros(len(time), bool)
    for part, whole in zip(sides, known.parts, strict=True):
        jumps |= ~(np.abs(np.diff(part.reshape(2, -1), axis=0)[0]) <= JUMP * np.max(np.abs(whole), initial=0.0))
    if not np.any(jumps):
        return known
    told = run.bends
    if len(told) > MOST and len(told) == len(time):
        told = [told[i] for i in np.flatnonzero(jumps)]
    return _with_figure(replace(known, bends=tuple(told), corner=True), look, of, plan)


def _with_figure(known: Reference, look: LookAtParts, of: Mechanisms, plan: PositionPlan) -> Reference:
    return replace(known, figure=float(averaged(known, look, own_edges(known, of, plan))[0]))


def averaged(known: Reference, look: LookAtParts, edges: Array) -> Array:
    """The figure, (row,), of mechanisms with their edges, (row, edge)."""
    rule = nodes(edges)
    window = replace(known.window, index=np.arange(rule.at.shape[-1]), weights=(rule.weights, rule.inside))
    there = replace(known, window=window, positions=rule.at.shape[-1])
    return np.asarray(figure(look(rule.at), there), float)


def own_edges(known: Reference, of: Mechanisms, plan: PositionPlan) -> Array:
    """The edges of the mean of every mechanism, times of the nominal one, s, (row, edge): those of the nominal one and
    its own jumps.

    A jump that is not found near that of the nominal mechanism, as it is far away or none, is looked for over the
    cycle. Those outside the window are one at its end.
    """
    edges, cycle = known.window.edges, of.cycles[0]
    assert edges is not None
    own = tracked(of, known.bends, lambda values, time: replace(plan, times=time).moved(values))
    lost = np.flatnonzero(np.any(np.isnan(own), axis=1)) if known.bends else np.arange(len(own))
    if len(lost):
        anew = _anew(of, lost, plan)
        own = np.pad(own, ((0, 0), (0, max(0, anew.shape[1] - own.shape[1]))), constant_values=np.nan)
        own[lost] = np.nan
        own[lost, : anew.shape[1]] = anew
    first, last = edges[0], edges[-1]
    if cycle.periodic:
        own = first + (own - first) % cycle.duration
    own = np.clip(np.where(np.isnan(own), last, own), first, last)
    return np.sort(np.concatenate([np.broadcast_to(edges, (len(own), len(edges))), own], axis=1), axis=1)


def _anew(of: Mechanisms, rows: NDArray[np.intp], plan: PositionPlan) -> Array:
    """Where some mechanisms bend, looked for over the cycle, as times of the nominal one, s; NaN after the last."""
    run, cycle = plan.run, of.cycles[0]
    ratio, name = np.ones(len(of.cycles)), next(iter(run.system.mechanism.drivers), "")
    if name and plan.moved(of.values) is not plan.times:
        own, nominal = (run.system.span(values, name).duration for values in (of.values, run.values))
        ratio = of.row(np.asarray(primal(own), float) / np.asarray(primal(nominal), float))
    cycles = [replace(cycle, duration=cycle.duration * float(ratio[row])) for row in rows]
    found = []
    for low in range(0, len(rows), AT_ONCE):
        part = slice(low, low + AT_ONCE)
        found += bends(Mechanisms(of.system, of.assembly, of.picked(rows[part]), cycles[part]))
    whole = np.full((len(rows), max((len(one) for one in found), default=0)), np.nan)
    for row, (one, times) in enumerate(zip(rows, found, strict=True)):
        whole[row, : len(times)] = times / ratio[one]
    return whole
