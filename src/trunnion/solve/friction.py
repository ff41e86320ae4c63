"""Friction and reactions of one module, settled with each other.

The reactions are linear in the friction loads, R(φ) = R₀ + Σ_l G_l φ_l, so a module is asked once for R₀ and once
for each G_l; what remains is φ_k = law(N_k(R), slip_k), one equation for each joint with friction. φ is the
friction force at the contact, N: the friction torque of a pin is φ r. Each normal load N is a seminorm of a joint's
reaction, and every law is proportional to N: so the derivative of the map φ → law(N(R(φ))) has a bound that holds for
all reactions.

Two methods: [D]'s successive approximation, steps 1 to 5, and Newton (default). Where the friction is too
strong for the map to be a contraction, the solution is followed from no friction to full friction; where it ceases to
exist on the way, the module is locked, and the share of the friction at which that happens is reported.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra import linalg
from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.linalg import weighted
from trunnion.algebra.literal import less, plus, times
from trunnion.algebra.namespace import Number, apart, looped, recurring, replaced
from trunnion.joints.contact_loads import ContactLoad, Reaction
from trunnion.solve import continuation
from trunnion.solve.continuation import largest
from trunnion.solve.friction_method import FrictionMethod

WEIGHTED, LIGHTEST = 6, 1e-3  # norms that are tried; least weight, of the largest row sum
OBEYED = 1e-10  # of the largest friction: by how much a friction may miss its law where it is called settled
SETTLED = 1e-11  # of the largest friction: where the iteration ends
STUBBORN = 20  # rounds of Newton's method: a lane that takes more goes back and forth between the sides of a kink


# ---- the equations ------------------------------------------------------------------------------------------------


class Contact(NamedTuple):
    """A contact with friction in a joint, as its module sees it.

    joint: its number in the module; unit_loads: what a friction force of 1 N on the second side does to the
    links; load: normal load and its gradient from the joint's reaction; slope: friction force for each newton of normal
    load, as every law is proportional to it. rubs: False for the separating force of a gear pair, which follows the
    tooth force as friction follows the normal load, but is there in full whatever the friction. own: what the unit load
    adds to what the joint itself carries, where its load depends on that.
    """

    joint: int
    unit_loads: Sequence[Any]
    load: ContactLoad
    slope: Number
    rubs: bool = True
    own: Reaction | None = None

    def mapped(self, change: Callable[[Number], Number]) -> Contact:
        """The same with `change` applied to every number that friction depends on."""
        return self._replace(load=self.load.mapped(change), slope=change(self.slope))


class Rubbing(NamedTuple):
    """One contact of a joint, before its law is asked: load, slip speed, m/s, wrench of a unit friction along the slip
    on the second link, and where the speed is zero but for rounding.

    amount: what a unit friction is of the joint's friction torque, m, or force; felt: whether the joint itself feels
    its friction; turning: the share of the friction that acts about the joint's own axis and so turns the pin's seat,
    None if it does not.
    """

    load: ContactLoad
    slip: Number
    unit: Any
    zero: Number
    amount: Number = 1.0
    felt: bool = False
    turning: Number | None = None


class Felt(NamedTuple):
    """What one contact feels of the frictionless reactions, and of each friction force of 1 N."""

    start: Reaction
    columns: list[Reaction]

    def under(self, forces: Sequence[Number]) -> Reaction:
        """What it is under friction forces."""
        return tuple(
            plus(n, weighted(row, forces)) for n, row in zip(self.start, zip(*self.columns, strict=True), strict=True)
        )


class State(NamedTuple):
    """What every contact feels of the reactions, and its normal load."""

    reactions: list[Reaction]
    normals: list[Number]


@dataclass(frozen=True)
class FrictionProblem:
    """φ = law(N(R₀ + G φ)): the friction forces of one module, φ, with its reactions R."""

    contacts: Sequence[Contact]
    start: Sequence[Reaction]
    influence: Sequence[Sequence[Reaction]]

    def mapped(self, change: Callable[[Number], Number]) -> FrictionProblem:
        """The same with `change` applied to every number."""

        def each(wrenches: Sequence[Reaction]) -> list[Reaction]:
            return [tuple(change(n) for n in wrench) for wrench in wrenches]

        contacts = [contact.mapped(change) for contact in self.contacts]
        return FrictionProblem(contacts, each(self.start), [each(column) for column in self.influence])

    @cached_property
    def numbers(self) -> list[Number]:
        """All numbers of the problem."""
        numbers: list[Number] = []

        def note(number: Number) -> Number:
            numbers.append(number)
            return number

        self.mapped(note)
        return numbers

    @cached_property
    def depth(self) -> int:
        """Levels of ε among its numbers: each costs one Newton step at the solution."""
        return max((number.depth for number in self.numbers if isinstance(number, Dual)), default=0)

    @property
    def real(self) -> FrictionProblem:
        """The problem without derivatives."""
        return self.mapped(primal) if self.depth else self

    def picked(self, lanes: Number) -> tuple[FrictionProblem, NDArray[np.bool_]]:
        """The problem of the chosen lanes alone, each number a flat array, and the choice in full shape."""
        shape = np.broadcast_shapes(np.shape(lanes), *(np.shape(number) for number in self.numbers))
        chosen = np.broadcast_to(lanes, shape)
        return self.mapped(lambda number: np.broadcast_to(np.asarray(number, float), shape)[chosen]), chosen

    def in_lanes(
        self, function: Callable[[FrictionProblem, Number], Sequence[Number]], lanes: Number, others: Sequence[Number]
    ) -> list[Number]:
        """function(problem, lanes that count) in some lanes, computed apart where that can be; `others` elsewhere."""
        if not np.any(lanes):
            return list(others)
        if not apart(lanes):
            return [np.where(lanes, *both) for both in zip(function(self, lanes), others, strict=True)]
        part, chosen = self.picked(lanes)
        return [replaced(old, chosen, new) for old, new in zip(others, function(part, True), strict=True)]

    @cached_property
    def felt(self) -> list[Felt]:
        """What the load of each contact makes of the reactions of its joint: only that is followed in the iteration."""
        joints = [(contact.load.felt, contact.joint) for contact in self.contacts]
        return [Felt(felt(self.start[k]), [felt(column[k]) for column in self.influence]) for felt, k in joints]

    @cached_property
    def one_way(self) -> bool:
        """Whether friction changes no load of a pin with friction, as in a driver on a pin: nothing to iterate then."""
        return not any(
            contact.load.feels(column)
            for contact, felt in zip(self.contacts, self.felt, strict=True)
            for column in felt.columns
        )

    def reactions(self, forces: Sequence[Number]) -> list[Reaction]:
        """Reactions of all joints under friction forces."""
        joints = enumerate(self.start)
        return [Felt(start, [column[k] for column in self.influence]).under(forces) for k, start in joints]

    def state(self, forces: Sequence[Number], normals: list[Number] | None = None) -> State:
        """Reactions and normal loads at the contacts under friction forces. normals: where they are known."""
        reactions = [felt.under(forces) for felt in self.felt]
        if normals is None:
            normals = [c.load.normal(reaction) for c, reaction in zip(self.contacts, reactions, strict=True)]
        return State(reactions, normals)

    def target(self, normals: Sequence[Number]) -> list[Number]:
        """What the laws say for these normal loads."""
        return [contact.slope * normal for contact, normal in zip(self.contacts, normals, strict=True)]

    def gaps(self, state: State, forces: Sequence[Number]) -> list[Number]:
        """What the laws say less what the forces are: 0 where they are settled."""
        return [less(a, b) for a, b in zip(self.target(state.normals), forces, strict=True)]

    def excess(self, gaps: Sequence[Number], forces: Sequence[Number]) -> Number:
        """Largest miss of a friction from its law, of the largest friction; NaN where there is none, and no answer.

        What pushes gears apart is held against the largest force of all, as it does not get small with friction.
        """
        miss = largest(gaps) / largest(forces)
        rubbing = [k for k, contact in enumerate(self.contacts) if contact.rubs]
        if len(rubbing) in (0, len(gaps)):
            return miss
        return np.fmax(miss, largest([gaps[k] for k in rubbing]) / largest([forces[k] for k in rubbing]))

    def misfit(self, gaps: Sequence[Number]) -> Number:
        """Largest difference between a friction and what its law says, N."""
        return largest([gap for gap, contact in zip(gaps, self.contacts, strict=True) if contact.rubs] or [0.0])

    def map_derivative(self, state: State) -> list[list[Number]]:
        """A with A_kl = ∂ law_k / ∂ φ_l."""
        rows = []
        for contact, felt, *at in zip(self.contacts, self.felt, *state, strict=True):
            rates = [times(contact.slope, entry) for entry in contact.load.gradient(*at)]
            rows.append([weighted(rates, column) for column in felt.columns])
        return rows

    def bound(self, multiples: Sequence[float] | None = None) -> Number:
        """At least a norm of |A| over all reactions: below 1 the solution exists, alone, for any share of friction.

        The largest row sum; where that is not below 1, in norms weighted by rising powers of the sums, which come down
        to the spectral radius: max (L x)_i/x_i of any x > 0 (L. Collatz, Math. Z. 48 (1942) 221-226).
        multiples: of the friction of each contact, 1 if not given.
        """
        factors = multiples or [1.0] * len(self.contacts)
        rows = [
            [np.abs(factor * contact.slope) * contact.load.bound(column) for column in felt.columns]
            for contact, factor, felt in zip(self.contacts, factors, self.felt, strict=True)
        ]
        sums = [functools.reduce(operator.add, row) for row in rows]
        plain = bound = largest(sums)
        for _ in range(WEIGHTED if len(rows) > 1 and np.any(plain >= 1.0) else 0):
            weights = [total + LIGHTEST * plain for total in sums]
            sums = [weighted(row, weights) for row in rows]
            bound = np.minimum(bound, largest([a / b for a, b in zip(sums, weights, strict=True)]))
        return np.where(plain >= 1.0, bound, plain)


# ---- their solution -----------------------------------------------------------------------------------------------


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
    """At most so many rounds in the lanes that are not done; those that are stay as they are.

    A round is [D] steps 2-5, friction from the last loads, or a step of Newton's method, whose A is that of the side of
    each kink on which the normal loads are. What a lane comes to does not depend on the lanes beside it. It is done
    when every friction is what its law says for the load, whatever the last round changed.
    """

    def step(row: list[Number]) -> list[Number]:
        at = start.of_row(row)
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
        done, count = 1.0 - (goes_on & left), at.rounds + goes_on
        return _Iterate(forces, state.normals, gaps, change, contraction, done, count).in_row()

    return start.of_row(looped(step, start.in_row(), rounds, lambda row: row[-2] > 0))


def _chosen(lanes: Number, row: Sequence[Number], others: Sequence[Number]) -> list[Number]:
    """The numbers of the row in the chosen lanes, the others elsewhere."""
    return list(row) if np.all(lanes) else [np.where(lanes, a, b) for a, b in zip(row, others, strict=True)]


def _corrected(forces: Sequence[Number], gaps: Sequence[Number], slopes: Sequence[Sequence[Number]]) -> list[Number]:
    """φ + (1 − A)⁻¹ (law − φ)."""
    (moves,), _ = linalg.solve(_identity_minus(slopes), gaps)
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
