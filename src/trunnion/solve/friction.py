"""Friction and reactions of one module, settled with each other.

The reactions are linear in the friction loads, R(φ) = R₀ + Σ_l G_l φ_l, so a module is asked once for R₀ and once
for each G_l; what remains is φ_k = law(N_k(R), slip_k), one equation for each joint with friction. φ is the
friction force at the contact, N: the friction torque of a pin is φ r.

Two methods: [D]'s successive approximation, steps 1 to 5, and Newton (default). Where the friction is too
strong for the map φ → law(N(R(φ))) to be a contraction, the solution is followed from no friction to full
friction; where it ceases to exist on the way, the module is locked, and the share of the friction at which that
happens is reported.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Hashable, Sequence
from itertools import islice
from typing import Any, NamedTuple

import numpy as np

from trunnion.algebra import linalg
from trunnion.algebra.literal import plus
from trunnion.algebra.namespace import Number, apart, looped, recurring
from trunnion.joints.contact_loads import Reaction
from trunnion.solve import continuation
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.friction_problem import Contact, FrictionProblem, largest

__all__ = ["Contact", "FrictionMethod", "FrictionProblem", "Settled", "frictionless", "scaled", "settle", "with_own"]

OBEYED = 1e-10  # of the largest friction: by how much a friction may miss its law where it is called settled
SETTLED = 1e-11  # of the largest friction: where the iteration ends
STUBBORN = 20  # rounds of Newton's method: a lane that takes more goes back and forth between the sides of a kink


class Settled(NamedTuple):
    """Reactions (friction not included) and friction forces, with the figures of the iteration.

    share: largest share of the friction for which a solution that starts frictionless was found, 1 unless the
    module locks; contraction: ∞-norm of the derivative of φ → law(N(R(φ))) (Newton), or the ratio of the last two
    changes (successive approximation). residual: largest difference between a friction and what its law says for the
    load that is found, N; where converged below OBEYED of the largest friction, unless a criterion is given. certain:
    whether it is proved that there is no other solution; bound: that of the equations, which are the problem.
    """

    reactions: Sequence[Reaction]
    forces: list[Number]
    iterations: Number
    change: Number
    contraction: Number
    converged: Number
    residual: Number = 0.0
    share: Number = 1.0
    certain: Number = True
    bound: Number = 0.0
    problem: FrictionProblem | None = None


def settle(
    reactions: Callable[[Sequence[Any]], list[Reaction]],
    loads: Sequence[Any],
    contacts: Sequence[Contact],
    method: FrictionMethod,
) -> Settled:
    """Reactions and friction forces of one module, whose reactions to loads are linear, under `loads`."""
    start = reactions(loads)
    if not contacts:
        return Settled(start, [], 0, 0.0, 0.0, True)
    if method.multiple is not None:
        contacts = [
            contact._replace(slope=method.multiple * contact.slope) if contact.rubs else contact for contact in contacts
        ]
    influence = [with_own(contact, reactions(contact.unit_loads)) for contact in contacts]
    problem = FrictionProblem(contacts, start, influence)
    if problem.one_way and method.name == "newton":  # no law looks at what friction changes
        forces = problem.target(problem.state([0.0] * len(contacts)).normals)
        return Settled(problem.reactions(forces), forces, 1, 0.0, 0.0, True, problem=problem.real)
    return _recurring(problem, method) or _iterated(problem, method)


def _recurring(problem: FrictionProblem, method: FrictionMethod) -> Settled | None:
    """`_iterated` of numbers that are recorded, once for all equations of a form; None of others."""
    sizes = [len(reaction) for reaction in problem.start]

    def figures(numbers: list[Number]) -> list[Number]:
        each = iter(numbers)
        settled = _iterated(problem.mapped(lambda _: next(each)), method)
        return [*settled.forces, *settled[2:-1], *(part for reaction in settled.reactions for part in reaction)]

    def about() -> Hashable:
        forms = (Contact(c.joint, (), c.load.mapped(lambda _: 0.0), 0.0, c.rubs) for c in problem.contacts)
        return method, *sizes, *forms

    figures_made = recurring(figures, problem.numbers, about)
    if figures_made is None:
        return None
    row = iter(figures_made)
    forces, others = list(islice(row, len(problem.contacts))), list(islice(row, len(Settled._fields) - 3))
    return Settled._make([[tuple(islice(row, size)) for size in sizes], forces, *others, problem])


def with_own(contact: Contact, column: list[Reaction]) -> list[Reaction]:
    """What 1 N of friction changes in the reactions of a module, with what the joint itself feels of it."""
    if contact.own is not None:
        column[contact.joint] = tuple(plus(*both) for both in zip(column[contact.joint], contact.own, strict=True))
    return column


def _iterated(problem: FrictionProblem, method: FrictionMethod) -> Settled:
    """From no friction by rounds of the method; Newton's follows lanes without the certificate of `bound` afterwards.

    So it does certain lanes that kinks keep from settling: their continuation leads to the same, only solution. A
    followed lane gets as many rounds, not counted, as it needs to obey its laws. Lanes that cannot be treated apart
    stay as they are, for whoever compiles to compute again.
    """
    real, newton = problem.real, method.name == "newton"
    shares: Number = 1.0
    rounds = min(method.limit, STUBBORN) if newton else method.limit
    none: list[Number] = [0.0] * len(real.contacts)
    state = real.state(none)
    # a lane whose loads are no numbers, because another module locked or opened, is not this module's affair
    bound = real.bound()
    certain = ~(np.where(np.isfinite(largest(state.normals)), bound, 0.0) >= 1.0)
    at = _Iterate(none, state.normals, real.gaps(state, none))
    if newton:  # a lane without the certificate goes nowhere by itself
        at = at._replace(done=np.where(certain, 0.0, 1.0))
    at = _rounds(real, at, rounds, method)
    if newton:
        left = ~certain
        if method.limit >= STUBBORN:
            left = left | ~((at.done > 0) | _obeyed(real, at))
        if apart(left):
            *forces, shares = real.in_lanes(_followed, left, [*at.forces, 1.0])
            state = real.state(forces)
            at = at._replace(forces=forces, normals=state.normals, gaps=real.gaps(state, forces))
            at = at._replace(done=np.where(left, 0.0, 1.0))
            at = _rounds(real, at, rounds, method)
    converged = (at.done > 0) if method.criterion is not None else _obeyed(real, at)
    forces = at.forces
    if problem.depth:  # Newton's method at the solution gives the derivatives, one level of ε a round
        slopes = real.map_derivative(real.state(forces, at.normals))
        for _ in range(problem.depth):
            forces = _corrected(forces, problem.gaps(problem.state(forces), forces), slopes)
    return Settled(
        reactions=problem.reactions(forces),
        forces=forces,
        iterations=at.rounds,
        change=at.change,
        contraction=at.contraction,
        converged=converged & (shares >= 1.0 if newton else np.isfinite(at.change)),  # not so where it ran off
        residual=real.misfit(at.gaps),
        share=shares,
        certain=certain,
        bound=bound,
        problem=real,
    )


class _Iterate(NamedTuple):
    """Where an iteration is: forces, and normal loads and law − force under them.

    change: of a normal load in the last round, N; contraction: ∞-norm of the A of Newton's last round, or the ratio of
    the last two changes; done: 1 where there is no further round; rounds: so many were made.
    """

    forces: list[Number]
    normals: list[Number]
    gaps: list[Number]
    change: Number = np.inf
    contraction: Number = 0.0
    done: Number = np.float64(0.0)
    rounds: Number = 0.0

    def in_row(self) -> list[Number]:
        """Its numbers, as `looped` has them."""
        return [*self.forces, *self.normals, *self.gaps, *self[3:]]

    def of_row(self, row: Sequence[Number]) -> _Iterate:
        """Such a one with other numbers."""
        n = len(self.forces)
        return _Iterate(list(row[:n]), list(row[n : 2 * n]), list(row[2 * n : 3 * n]), *row[3 * n :])


def _obeyed(real: FrictionProblem, at: _Iterate) -> Number:
    """Where every law is obeyed as closely as a solved position promises; NaN is no answer and breaks no promise."""
    return ~(real.excess(at.gaps, at.forces) > OBEYED)


def _rounds(real: FrictionProblem, start: _Iterate, rounds: int, method: FrictionMethod) -> _Iterate:
    """At most so many rounds in the lanes that are not done; those that are stay as they are."""

    def step(row: list[Number]) -> list[Number]:
        return _round(real, start.of_row(row), method).in_row()

    return start.of_row(looped(step, start.in_row(), rounds, lambda row: row[-2] > 0))


def _round(real: FrictionProblem, at: _Iterate, method: FrictionMethod) -> _Iterate:
    """One round: [D] steps 2-5, friction from the last loads, or a step of Newton's method.

    Its A is that of the side of each kink on which the normal loads are. What a lane comes to does not depend on the
    lanes beside it. It is done when every friction is what its law says for the load, whatever the last round changed.
    """
    goes_on = ~(at.done > 0)
    if method.name == "newton":
        rows = real.map_derivative(real.state(at.forces, at.normals))
        forces = _corrected(at.forces, at.gaps, rows)
        contraction = largest([functools.reduce(operator.add, map(np.abs, row)) for row in rows])
    else:
        forces = real.target(at.normals)
    forces = _chosen(goes_on, forces, at.forces)
    state = real.state(forces)
    gaps = real.gaps(state, forces)
    change = largest([a - b for a, b in zip(state.normals, at.normals, strict=True)])
    if method.name != "newton":
        measurable = np.isfinite(at.change) & (at.change > 0)
        contraction = np.where(measurable, change / np.where(measurable, at.change, 1.0), 0.0)
    # a lane of NaN has nothing to wait for
    left = real.excess(gaps, forces) > SETTLED if method.criterion is None else change > method.criterion
    change, contraction = _chosen(goes_on, [change, contraction], [at.change, at.contraction])
    return _Iterate(forces, state.normals, gaps, change, contraction, 1.0 - (goes_on & left), at.rounds + goes_on)


def _chosen(lanes: Number, row: Sequence[Number], others: Sequence[Number]) -> list[Number]:
    """The numbers of the row in the chosen lanes, the others elsewhere."""
    return list(row) if np.all(lanes) else [np.where(lanes, a, b) for a, b in zip(row, others, strict=True)]


def _corrected(forces: Sequence[Number], gaps: Sequence[Number], slopes: Sequence[Sequence[Number]]) -> list[Number]:
    """φ + (1 − A)⁻¹ (law − φ)."""
    (moves,) = linalg.solve(_identity_minus(slopes), gaps)
    return [plus(force, move) for force, move in zip(forces, moves, strict=True)]


def _followed(part: FrictionProblem, lanes: Number) -> list[Number]:
    """Forces followed from no friction, NaN where they lock, and the share of the friction reached."""
    forces, share = continuation.follow(scaled(part), frictionless(part), 1.0, lanes)
    return [*forces, share]


def scaled(
    problem: FrictionProblem, weights: Callable[[Number], Sequence[Number]] | None = None
) -> continuation.System:
    """Residual φ − w(s) law(N(φ)) and its Jacobian. weights: multiple of each contact's friction at a share, or s."""

    def system(forces: Sequence[Number], share: Number) -> tuple[list[Number], list[list[Number]]]:
        multiples = [share] * len(problem.contacts) if weights is None else weights(share)
        shares = [s if contact.rubs else 1.0 for s, contact in zip(multiples, problem.contacts, strict=True)]
        state = problem.state(forces)
        residual = [f - s * t for f, s, t in zip(forces, shares, problem.target(state.normals), strict=True)]
        slopes = problem.map_derivative(state)
        return residual, _identity_minus([[s * entry for entry in row] for s, row in zip(shares, slopes, strict=True)])

    return system


def frictionless(problem: FrictionProblem) -> list[Number]:
    """Forces without friction: none but those that push gears apart."""
    target = problem.target(problem.state([0.0] * len(problem.contacts)).normals)
    return [0.0 if contact.rubs else load for contact, load in zip(problem.contacts, target, strict=True)]


def _identity_minus(rows: Sequence[Sequence[Number]]) -> list[list[Number]]:
    return [[(1.0 if k == j else 0.0) - entry for j, entry in enumerate(row)] for k, row in enumerate(rows)]
