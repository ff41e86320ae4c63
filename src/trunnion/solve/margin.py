"""The locking margin: the multiple of all friction of a mechanism at which one of its modules locks.

The friction of every module grows at once, so a module is loaded by what those behind it pass on at the same multiple.
The reactions of the whole row are linear in the friction forces, as those of one module are; their equations are one
problem, φ = s law(N(R₀ + G φ)), whose G is triangular by modules, and it is followed from s = 0.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number
from trunnion.joints.contact_loads import Reaction
from trunnion.solve import continuation
from trunnion.solve.backward import Backward, pass_on, unloaded
from trunnion.solve.continuation import largest
from trunnion.solve.friction import Contact, FrictionProblem, frictionless, scaled, with_own
from trunnion.solve.system import Cycle

Array = NDArray[np.float64]

BESIDE = 1e-8  # of the cycle: how far before and after a time a figure is looked at


def locking_margin(back: Backward) -> Number:
    """Multiple of all friction at which a position locks, ∞ where it does not up to the method's `margin_up_to`.

    Below 1 where the position is locked; NaN of numbers that are compiled where the search does not come to an end.
    """
    if back.margin is None:
        back.margin = margin_in(back, back.margin_up_to)
    return back.margin


def margin_in(back: Backward, most: float, lanes: Number = np.True_) -> Number:
    """Multiple of all friction at which a position locks, looked for up to `most` in some lanes; ∞ in all others."""
    margin: Number = np.inf
    left = lanes
    for k in reversed(range(len(back.settled) if most > 0 else 0)):
        problem, share = back.settled[k].problem, back.settled[k].share
        if problem is None or problem.one_way:
            continue
        # a module without a certificate is followed with those that load it
        doubtful = left & (problem.bound() * most >= 1.0)
        left = left & ~doubtful
        if not np.any(doubtful):
            continue
        if any(back.rubbed[:k]):
            problem, share = _together(back, k + 1), 1.0
        margin = np.where(doubtful, _followed(problem, doubtful, most, share), margin)
    return margin


def margin_for_sure(back: Backward, most: float) -> Number:
    """A multiple of all friction up to which no module locks, by the bounds of their equations alone; ∞ above `most`.

    The margin is more than this. To follow a long row takes seconds. NaN where it is locked.
    """
    with np.errstate(divide="ignore"):
        sure = 1.0 / np.asarray(back.bound, float)
    return np.where(np.less(back.share, 1.0), np.nan, np.where(sure > most, np.inf, sure))


def least_beside(
    figure: Callable[[Backward], Number], solve: Callable[[Array], Backward], time: Array, cycle: Cycle
) -> Array:
    """A figure of positions at times, s, at which a joint turns round: the less of those just before and just after.

    Its friction may act either way there, and is taken as none: with that alone a margin would jump at one position.
    figure: of positions that are solved, with these last in its shape. NaN where neither side has one.
    """
    sides = time + BESIDE * cycle.duration * np.array([[-1.0], [1.0]])
    inside = cycle.periodic | ((sides >= 0) & (sides <= cycle.duration))
    times = (sides % cycle.duration if cycle.periodic else np.clip(sides, 0.0, cycle.duration)).ravel()
    figures = np.asarray(figure(solve(times)), float)
    figures = np.broadcast_to(figures, (*figures.shape[:-1], len(times))).reshape(*figures.shape[:-1], *sides.shape)
    least: Array = np.fmin.reduce(np.where(inside, figures, np.nan), axis=-2)
    return least


def _together(back: Backward, count: int) -> FrictionProblem:
    """The equations of the first `count` modules that were settled, as one problem."""
    walk = back.walk
    bare, flows = Backward(walk, dict(back.stated)), list[Backward]()  # without friction, and 1 N of each friction
    contacts, start, influence = list[Contact](), list[Reaction](), list[list[Reaction]]()
    for number, rubbed in zip(reversed(range(len(walk.poses))), back.rubbed[:count], strict=False):
        links = walk.system.plan.modules[number].links
        before = len(start)
        for total, flow in [(start, bare), *zip(influence, flows, strict=True)]:
            reactions = walk.reactions(number, [flow.loads[link] for link in links])
            total += reactions
            pass_on(flow, number, reactions, (), ())
        for contact, rub in rubbed:
            column = with_own(contact, walk.reactions(number, contact.unit_loads))
            flows.append(Backward(walk, unloaded(walk)))
            pass_on(flows[-1], number, column, [(contact, rub)], [1.0])
            influence.append([(0.0,) * len(reaction) for reaction in start[:before]] + column)
            contacts.append(contact._replace(joint=before + contact.joint))
    return FrictionProblem(contacts, start, influence).real


def _followed(problem: FrictionProblem, doubtful: Number, most: float, shares: Number) -> Number:
    """The multiple for each lane. shares: those at which lanes are known to lock, 1 of the others."""
    locked = np.asarray(shares) < 1.0

    def reached(part: FrictionProblem, lanes: Number) -> list[Number]:
        _, share = continuation.follow(scaled(part), frictionless(part), most, lanes)
        return [np.where(share >= most, np.inf, share)]

    loaded = np.isfinite(largest(problem.state([0.0] * len(problem.contacts)).normals))
    return problem.in_lanes(reached, doubtful & ~locked & loaded, [np.where(locked, shares, np.inf)])[0]
