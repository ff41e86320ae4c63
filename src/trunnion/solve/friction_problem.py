"""The equations of friction in one module: φ = law(N(R₀ + G φ)), and what is known of them beforehand.

The reactions are linear in the friction forces φ, each normal load N is a seminorm of a joint's reaction, and every
law is proportional to N. So the derivative of the map φ → law(N(R(φ))) has a bound that holds for all reactions.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.linalg import weighted
from trunnion.algebra.literal import less, plus, times
from trunnion.algebra.namespace import Number, apart
from trunnion.algebra.nested import replaced
from trunnion.joints.contact_loads import ContactLoad, Reaction

__all__ = ["Contact", "FrictionProblem", "Rubbing", "State", "largest"]

WEIGHTED, LIGHTEST = 6, 1e-3  # norms that are tried; least weight, of the largest row sum


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
    on the second link, about what the joint's own wrench is about, and where the speed is zero but for rounding.

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
        self,
        function: Callable[[FrictionProblem, Number], Sequence[Number]],
        lanes: Number,
        others: Sequence[Number],
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


def largest(values: Sequence[Number]) -> Number:
    """Largest magnitude, elementwise; NaN if one is NaN."""
    return functools.reduce(np.maximum, [np.abs(primal(value)) for value in values])
