"""The equations of friction in one module: φ = law(N(R₀ + G φ)), and what is known of them beforehand.

The reactions are linear in the friction forces φ, each normal load N is a seminorm of a joint's reaction, and every
law is proportional to N. So the derivative of the map φ → law(N(R(φ))) has a bound that holds for all reactions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.literal import is_zero, less, plus
from trunnion.algebra.namespace import Number, apart
from trunnion.algebra.nested import replaced
from trunnion.joints.friction import FrictionLaw
from trunnion.joints.pairs import ContactLoad, Reaction

__all__ = ["Contact", "FrictionProblem", "Rubbing", "State", "added", "largest", "total"]


Part = tuple[int, Number]  # an entry with its place


class Contact(NamedTuple):
    """A contact with friction in a joint, as its module sees it.

    joint: its number in the module; unit_loads: what a friction force of 1 N on the second side does to the
    links; load: normal load and its gradient from the joint's reaction; law with parameters; slip: m/s.
    rubs: False for the separating force of a gear pair, which follows the tooth force as friction follows the
    normal load, but is there in full whatever the friction. own: what the unit load adds to what the joint itself
    carries, where its load depends on that.
    """

    joint: int
    unit_loads: Sequence[Any]
    load: ContactLoad
    law: FrictionLaw
    parameters: dict[str, Number]
    slip: Number
    rubs: bool = True
    own: Reaction | None = None

    def mapped(self, change: Callable[[Number], Number]) -> Contact:
        """The same with `change` applied to every number that the laws see."""
        parameters = {name: change(value) for name, value in self.parameters.items()}
        load: ContactLoad = self.load.mapped(change)
        return self._replace(load=load, parameters=parameters, slip=change(self.slip))


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
        found: list[Number] = []

        def note(number: Number) -> Number:
            found.append(number)
            return number

        for contact in self.contacts:
            contact.load.mapped(note)
            found += [contact.slip, *contact.parameters.values()]
        return [*found, *(n for wrenches in (self.start, *self.influence) for wrench in wrenches for n in wrench)]

    def picked(self, lanes: Number) -> tuple[FrictionProblem, NDArray[np.bool_]]:
        """The problem of the chosen lanes alone, each number a flat array, and the choice in full shape."""
        shape = np.broadcast_shapes(np.shape(lanes), *(np.shape(number) for number in self.numbers))
        chosen = np.broadcast_to(lanes, shape)
        return self.mapped(lambda number: np.broadcast_to(np.asarray(number, float), shape)[chosen]), chosen

    def in_lanes(self, function: Callable[[FrictionProblem, Number], Number], lanes: Number, others: Number) -> Number:
        """function(problem, lanes that count) in some lanes, computed apart where that can be; `others` elsewhere."""
        if not np.any(lanes):
            return others
        if not apart(lanes):
            return np.where(lanes, function(self, lanes), others)
        part, chosen = self.picked(lanes)
        return replaced(others, chosen, function(part, True))

    @cached_property
    def felt(self) -> list[Felt]:
        """What the load of each contact makes of the reactions of its joint: only that is followed in the iteration."""
        return [
            Felt(
                contact.load.felt(self.start[contact.joint]),
                [contact.load.felt(column[contact.joint]) for column in self.influence],
            )
            for contact in self.contacts
        ]

    @cached_property
    def one_way(self) -> bool:
        """Whether friction changes no load of a pin with friction, as in a driver on a pin: nothing to iterate then."""
        return not any(
            contact.load.feels(column)
            for contact, felt in zip(self.contacts, self.felt, strict=True)
            for column in felt.columns
        )

    @cached_property
    def _alike(self) -> list[int]:
        """For each contact the first one whose reaction every friction force changes just as much."""
        found: list[int] = []
        numbers = [[n for column in one.columns for n in column] for one in self.felt]
        for k, own in enumerate(numbers):
            same = (i for i in range(k) if all(a is b for a, b in zip(own, numbers[i], strict=False)))
            found.append(next(same, k))
        return found

    def reactions(self, forces: Sequence[Number], known: State) -> list[Reaction]:
        """Reactions of all joints; where a contact feels the whole of it, it is in the state of the forces."""
        found = {
            contact.joint: reaction
            for contact, felt, reaction in zip(self.contacts, self.felt, known.reactions, strict=True)
            if felt.start is self.start[contact.joint]
        }
        still = all(is_zero(force) for force in forces)
        for joint, start in enumerate(self.start):
            if joint not in found:
                found[joint] = start if still else added(start, _changes([c[joint] for c in self.influence], forces))
        return [found[joint] for joint in range(len(self.start))]

    def state(self, forces: Sequence[Number], normals: list[Number] | None = None) -> State:
        """Reactions and normal loads at the contacts under friction forces. normals: where they are known."""
        if all(is_zero(force) for force in forces):
            at = [one.start for one in self.felt]
        else:
            changes = {k: _combined(self._crossed[k], forces) for k in set(self._alike)}
            at = [added(one.start, changes[k]) for one, k in zip(self.felt, self._alike, strict=True)]
        if normals is None:
            normals = [c.load.normal(reaction) for c, reaction in zip(self.contacts, at, strict=True)]
        return State(at, normals)

    @cached_property
    def slopes(self) -> list[Number]:
        """Friction force for each newton of normal load: every law is proportional to it."""
        return [contact.law.function(1.0, contact.slip, **contact.parameters) for contact in self.contacts]

    def target(self, normals: Sequence[Number]) -> list[Number]:
        """What the laws say for these normal loads."""
        return [slope * normal for slope, normal in zip(self.slopes, normals, strict=True)]

    def gaps(self, state: State, forces: Sequence[Number]) -> list[Number]:
        """What the laws say less what the forces are: 0 where they are settled."""
        return [less(a, b) for a, b in zip(self.target(state.normals), forces, strict=True)]

    def excess(self, gaps: Sequence[Number], forces: Sequence[Number]) -> Number:
        """Largest miss of a friction from its law, of the largest friction; NaN where there is none, and no answer.

        What pushes gears apart is held against the largest force of all, as it does not get small with friction.
        """
        rubbing = [k for k, contact in enumerate(self.contacts) if contact.rubs]
        if len(rubbing) == len(gaps):
            return largest(gaps) / largest(forces)
        whole = largest(gaps) / largest(forces)
        if not rubbing:
            return whole
        return np.fmax(whole, largest([gaps[k] for k in rubbing]) / largest([forces[k] for k in rubbing]))

    def misfit(self, gaps: Sequence[Number]) -> Number:
        """Largest difference between a friction and what its law says, N."""
        return largest([gap for gap, contact in zip(gaps, self.contacts, strict=True) if contact.rubs] or [0.0])

    def map_derivative(self, state: State) -> list[list[Number]]:
        """A with A_kl = ∂ law_k / ∂ φ_l."""
        rows = []
        each = zip(self.contacts, *state, self.slopes, self._filled, strict=True)
        for contact, reaction, normal, slope, filled in each:
            gradient = contact.load.gradient(reaction, normal)
            scaled = [entry if is_zero(entry) else slope * entry for entry in gradient]
            there = None if all(type(entry) is np.ndarray for entry in scaled) else [not is_zero(g) for g in scaled]
            rows.append([_along(scaled, column, there) for column in filled])
        return rows

    @cached_property
    def _filled(self) -> list[list[list[Part]]]:
        """Of each contact, for each friction force: what 1 N of it changes, by its place; literal zeros left out."""
        return [
            [[(i, entry) for i, entry in enumerate(column) if not is_zero(entry)] for column in felt.columns]
            for felt in self.felt
        ]

    @cached_property
    def _crossed(self) -> list[list[list[Part]]]:
        """The same for each place, by the number of the friction force."""
        return [
            [
                [(k, entry) for k, entry in enumerate(entries) if not is_zero(entry)]
                for entries in zip(*felt.columns, strict=True)
            ]
            for felt in self.felt
        ]

    def bound(self, multiples: Sequence[float] | None = None) -> Number:
        """Largest row sum of |A| over all reactions: below 1 the solution exists, alone, for any share of friction.

        multiples: of the friction of each contact, 1 if not given.
        """
        factors = multiples or [1.0] * len(self.contacts)
        rows = [
            np.abs(factor * slope) * total([contact.load.bound(column) for column in felt.columns])
            for contact, slope, factor, felt in zip(self.contacts, self.slopes, factors, self.felt, strict=True)
        ]
        return largest(rows)


def _changes(columns: Sequence[Reaction], forces: Sequence[Number]) -> Reaction:
    """What friction forces change in a reaction. columns: what 1 N of each does."""
    return tuple(
        total([entry * force for entry, force in zip(entries, forces, strict=True) if not is_zero(entry)])
        for entries in zip(*columns, strict=True)
    )


def _combined(crossed: Sequence[Sequence[Part]], forces: Sequence[Number]) -> Reaction:
    """`_changes` of columns whose literal zeros are left out."""
    return tuple(total([entry * forces[k] for k, entry in parts]) for parts in crossed)


def _along(gradient: Sequence[Number], column: Sequence[Part], there: Sequence[bool] | None) -> Number:
    """Derivative of a normal load along a change of the reaction; there: where the gradient is no literal zero."""
    if there is None:
        return total([gradient[i] * entry for i, entry in column])
    return total([gradient[i] * entry for i, entry in column if there[i]])


def added(a: Reaction, b: Reaction) -> Reaction:
    """a + b; a literal zero costs nothing."""
    return tuple(plus(p, q) for p, q in zip(a, b, strict=True))


def total(parts: Sequence[Number]) -> Number:
    """Sum; of nothing a literal zero. The built-in sum would add the first part to 0."""
    if not parts:
        return 0.0
    found = parts[0]
    for part in parts[1:]:
        found = found + part
    return found


def largest(values: Sequence[Number]) -> Number:
    """Largest magnitude, elementwise; NaN if one is NaN."""
    largest = np.abs(primal(values[0]))
    for value in values[1:]:
        largest = np.maximum(largest, np.abs(primal(value)))
    return largest
