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
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra import linalg
from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.namespace import Number, compiled
from trunnion.algebra.nested import replaced
from trunnion.algebra.traced import looped
from trunnion.analysis import continuation
from trunnion.analysis.friction_method import FrictionMethod, method_named, peak
from trunnion.groups.planar import is_zero, less
from trunnion.joints.friction import FrictionLaw
from trunnion.joints.pairs import ContactLoad, Reaction

__all__ = [
    "Contact",
    "FrictionMethod",
    "Problem",
    "Settled",
    "frictionless",
    "identity_minus",
    "method_named",
    "scaled",
    "settle",
]

DOUBTFUL_ROUNDS = 20  # of Newton's method, where no certificate says that it ends at the solution that is looked for
COMPILED_ROUNDS = 3  # of Newton's method where the numbers have no values to tell when to end; one more beyond FEW
FEW = 3  # contacts of a dyad
EXTRAPOLATED = 1e-2  # of the tolerance: what the change after the last round may be, as its like is guessed


class Reacting(Protocol):
    """A module, as far as its reactions go: flat tuples, linear in the loads on its links."""

    def reactions(self, pose: Any, loads: Sequence[Any]) -> Sequence[Reaction]: ...


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


class Settled(NamedTuple):
    """Reactions (friction not included) and friction forces, with the figures of the iteration.

    share: largest share of the friction for which a solution that starts frictionless was found, 1 unless the
    module locks; margin: multiple of the friction at which it would lock, ∞ beyond what was asked for;
    contraction: ∞-norm of the derivative of φ → law(N(R(φ))) (Newton), or the ratio of the last two
    changes (successive approximation). certain: whether it is proved that there is no other solution; problem: the
    equations themselves.
    """

    reactions: Sequence[Reaction]
    forces: list[Number]
    iterations: Number
    change: Number
    contraction: Number
    converged: Number
    share: Number
    margin: Number = np.inf
    certain: Number = True
    problem: Problem | None = None


def settle(
    group: Reacting, pose: object, loads: Sequence[Any], contacts: Sequence[Contact], method: FrictionMethod
) -> Settled:
    """Reactions and friction forces of one module under `loads` (about the link origins, friction not included)."""
    start = group.reactions(pose, loads)
    if not contacts:
        return Settled(start, [], 0, 0.0, 0.0, True, 1.0)
    influence = [_with_own(contact, list(group.reactions(pose, contact.unit_loads))) for contact in contacts]
    problem = Problem(contacts, start, influence)
    if method.name == "successive-approximation":
        return _successive(problem, method)
    if problem.one_way:
        return _at_once(problem)
    return _unrolled(problem, method) if problem.compiled else _newton(problem, method)


def _with_own(contact: Contact, column: list[Reaction]) -> list[Reaction]:
    if contact.own is not None:
        column[contact.joint] = _added(column[contact.joint], contact.own)
    return column


class Felt(NamedTuple):
    """What one contact feels of the frictionless reactions, and of each friction force of 1 N."""

    start: Reaction
    columns: list[Reaction]


class State(NamedTuple):
    """What every contact feels of the reactions, and its normal load."""

    reactions: list[Reaction]
    normals: list[Number]


@dataclass(frozen=True)
class Problem:
    """φ = law(N(R₀ + G φ)): the friction forces of one module, φ, with its reactions R."""

    contacts: Sequence[Contact]
    start: Sequence[Reaction]
    influence: Sequence[Sequence[Reaction]]

    def mapped(self, change: Callable[[Number], Number]) -> Problem:
        """The same with `change` applied to every number."""

        def each(wrenches: Sequence[Reaction]) -> list[Reaction]:
            return [tuple(change(n) for n in wrench) for wrench in wrenches]

        contacts = [contact.mapped(change) for contact in self.contacts]
        return Problem(contacts, each(self.start), [each(column) for column in self.influence])

    def numbers(self) -> list[Number]:
        """All numbers of the problem."""
        found: list[Number] = []

        def note(number: Number) -> Number:
            found.append(number)
            return number

        self.mapped(note)
        return found

    def picked(self, lanes: Number) -> tuple[Problem, NDArray[np.bool_]]:
        """The problem of the chosen lanes alone, each number a flat array, and the choice in full shape."""
        shape = np.broadcast_shapes(np.shape(lanes), *(np.shape(number) for number in self.numbers()))
        chosen = np.broadcast_to(lanes, shape)
        return self.mapped(lambda number: np.broadcast_to(np.asarray(number, float), shape)[chosen]), chosen

    @cached_property
    def compiled(self) -> bool:
        """Whether its numbers have no values yet."""
        return compiled(self.numbers())

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
                found[joint] = start if still else _added(start, _changes([c[joint] for c in self.influence], forces))
        return [found[joint] for joint in range(len(self.start))]

    def state(self, forces: Sequence[Number]) -> State:
        """Reactions and normal loads at the contacts under friction forces."""
        if all(is_zero(force) for force in forces):
            at = [one.start for one in self.felt]
        else:
            changes = {k: _changes(self.felt[k].columns, forces) for k in set(self._alike)}
            at = [_added(one.start, changes[k]) for one, k in zip(self.felt, self._alike, strict=True)]
        return State(at, [c.load.normal(reaction) for c, reaction in zip(self.contacts, at, strict=True)])

    @cached_property
    def slopes(self) -> list[Number]:
        """Friction force for each newton of normal load: every law is proportional to it."""
        return [contact.law.function(1.0, contact.slip, **contact.parameters) for contact in self.contacts]

    def target(self, normals: Sequence[Number]) -> list[Number]:
        """What the laws say for these normal loads."""
        return [slope * normal for slope, normal in zip(self.slopes, normals, strict=True)]

    def map_derivative(self, state: State) -> list[list[Number]]:
        """A with A_kl = ∂ law_k / ∂ φ_l."""
        rows = []
        for contact, reaction, normal, slope, felt in zip(self.contacts, *state, self.slopes, self.felt, strict=True):
            gradient = contact.load.gradient(reaction, normal)
            scaled = tuple(entry if is_zero(entry) else slope * entry for entry in gradient)
            rows.append([_along(scaled, column) for column in felt.columns])
        return rows

    def bound(self, multiples: Sequence[float] | None = None) -> Number:
        """Largest row sum of |A| over all reactions: below 1 the solution exists, alone, for any share of friction.

        multiples: of the friction of each contact, 1 if not given.
        """
        factors = multiples or [1.0] * len(self.contacts)
        rows = [
            np.abs(factor * slope) * _total([contact.load.bound(column) for column in felt.columns])
            for contact, slope, factor, felt in zip(self.contacts, self.slopes, factors, self.felt, strict=True)
        ]
        return _largest(rows)


def _newton(problem: Problem, method: FrictionMethod) -> Settled:
    """Newton from no friction; lanes without the certificate of `bound` are followed by continuation.

    The rounds counted are Newton's; the continuation that such lanes then go through settles which solution it is.
    The matrix is kept while a round reduces the change a hundredfold, which in all but the worst cases is always.
    """
    real = _primal(problem)
    forces: list[Number] = [0.0] * len(real.contacts)
    state = real.state(forces)
    # a lane whose loads are no numbers, because another module locked or opened, is not this module's affair
    bound = np.where(np.isfinite(peak(state.normals)), real.bound(), 0.0)
    certain = ~(bound >= 1.0)
    rows: list[list[Number]] = []
    inverse: list[list[Number]] = []
    change: Number = np.inf
    rounds: Number = 0
    done: Number = np.False_
    renew = True
    for _ in range(method.limit):
        rounds = rounds + ~done
        if renew:
            rows = real.map_derivative(state)
            inverse = linalg.quick_inverse(identity_minus(rows))
        forces = _corrected(real, state, forces, inverse)
        before, state = state, real.state(forces)
        previous, change = change, _changed(state, before)
        # a lane of NaN has nothing to wait for, nor has one for long that is followed all the same
        done = ~(change > method.tolerance(state.normals)) | (~certain & (rounds >= DOUBTFUL_ROUNDS))
        if np.all(done):
            break
        renew = bool(np.any((change > 0.01 * previous) & ~done))
    shares: Number = 1.0
    if not np.all(certain):
        forces, shares = _follow(real, forces, ~certain)
        state = real.state(forces)
        done = np.where(certain, done, shares >= 1.0)
        rows = real.map_derivative(state)
        inverse = linalg.quick_inverse(identity_minus(rows))
    depth = _depth(problem)
    if depth:  # the ε parts need the matrix of the solution, not that of the way there
        rows = real.map_derivative(state)
        inverse = linalg.quick_inverse(identity_minus(rows))
    for _ in range(depth):
        forces = _corrected(problem, problem.state(forces), forces, inverse)
        state = problem.state(forces)
    contraction = _largest([_total([np.abs(entry) for entry in row]) for row in rows])
    margin = _margin(real, bound, method.margin_up_to)
    reactions = problem.reactions(forces, state)
    return Settled(reactions, forces, rounds, change, contraction, done, shares, margin, certain, real)


def _unrolled(problem: Problem, method: FrictionMethod) -> Settled:
    """Newton with a fixed number of rounds, for numbers that are compiled; the last one carries the derivatives.

    Lanes that need more, and those without the certificate, are for whoever compiles to compute again.
    """
    real = _primal(problem)
    forces: list[Number] = [0.0] * len(real.contacts)
    state = real.state(forces)
    bound = np.where(np.isfinite(peak(state.normals)), real.bound(), 0.0)
    certain = ~(bound >= 1.0)

    def step(now: list[Number]) -> list[Number]:
        at = real.state(now)
        return _corrected(real, at, now, _matrix(real, at))

    if len(forces) <= FEW:  # written out: quicker to run, but not to compile
        for _ in range(COMPILED_ROUNDS - 2):
            forces = step(forces)
    else:
        forces = looped(step, forces, COMPILED_ROUNDS - 1)
    state = real.state(forces)
    forces = step(forces)
    before, state = state, real.state(forces)
    previous = _changed(state, before)
    forces = _corrected(problem, problem.state(forces), forces, _matrix(real, state))
    before, state = state, problem.state(forces)
    change = _changed(state, before)
    # of a quadratic method: the next round would change less than change · (change/previous)
    done = certain & ~(change * change > EXTRAPOLATED * method.tolerance(state.normals) * previous)
    reactions = problem.reactions(forces, state)
    return Settled(reactions, forces, COMPILED_ROUNDS, change, 0.0, done, 1.0, np.inf, certain, real)


def _matrix(problem: Problem, state: State) -> list[list[Number]]:
    """(1 − A)⁻¹ at a state where the rows of |A| add up to less than 1: no pivots are needed."""
    matrix = identity_minus(problem.map_derivative(state))
    return linalg.quick_inverse(matrix) if len(matrix) <= FEW else linalg.inverse(matrix, pivoting=False)


def _at_once(problem: Problem) -> Settled:
    """Friction from the frictionless reactions, which it does not change but in what no law looks at."""
    forces = problem.target(problem.state([0.0] * len(problem.contacts)).normals)
    reactions = problem.reactions(forces, problem.state(forces))
    return Settled(reactions, forces, 1, 0.0, 0.0, True, 1.0, problem=_primal(problem))


def _corrected(
    problem: Problem, state: State, forces: Sequence[Number], inverse: Sequence[Sequence[Number]]
) -> list[Number]:
    """φ + (1 − A)⁻¹ (law − φ)."""
    residual = [less(a, b) for a, b in zip(problem.target(state.normals), forces, strict=True)]
    moves = [_total([entry * part for entry, part in zip(row, residual, strict=True)]) for row in inverse]
    return [move if is_zero(force) else force + move for force, move in zip(forces, moves, strict=True)]


def _changed(state: State, before: State) -> Number:
    """Largest change of a normal load, N."""
    return _largest([a - b for a, b in zip(state.normals, before.normals, strict=True)])


def _successive(problem: Problem, method: FrictionMethod) -> Settled:
    """[D] steps 1-5: friction from the last reactions, reactions from the last friction, until they rest."""
    forces: list[Number] = [0.0] * len(problem.contacts)
    state = problem.state(forces)
    change: Number = np.inf
    previous: Number = np.inf
    done: Number = np.False_
    rounds: Number = 0
    for _ in range(method.limit):
        rounds = rounds + ~done
        forces = problem.target(state.normals)
        before, state = state, problem.state(forces)
        previous, change = change, _changed(state, before)
        done = ~(change > method.tolerance(state.normals))
        if np.all(done):
            break
    done = change <= method.tolerance(state.normals)  # not so where it ran off to infinity
    measurable = np.isfinite(previous) & (previous > 0)
    ratio = np.where(measurable, change / np.where(measurable, previous, 1.0), 0.0)
    real = _primal(problem)
    bound = np.where(np.isfinite(peak(real.state([0.0] * len(real.contacts)).normals)), real.bound(), 0.0)
    margin = _margin(real, bound, method.margin_up_to)
    reactions = problem.reactions(forces, state)
    return Settled(reactions, forces, rounds, change, ratio, done, 1.0, margin, ~(bound >= 1.0), real)


def _margin(problem: Problem, bound: Number, most: float) -> Number:
    """Multiple of the friction at which the module locks; ∞ where it does not up to `most`."""
    doubtful = bound * most >= 1.0
    if most <= 0 or not np.any(doubtful):
        return np.inf
    part, chosen = problem.picked(doubtful)
    _, reached = continuation.follow(scaled(part), frictionless(part, chosen), most)
    margin = np.full(chosen.shape, np.inf)
    margin[chosen] = np.where(reached >= most, np.inf, reached)
    return margin


def _follow(problem: Problem, forces: Sequence[Number], lanes: Number) -> tuple[list[Number], NDArray[np.float64]]:
    """Forces with the chosen lanes followed from no friction; NaN where they lock, and the share reached."""
    part, chosen = problem.picked(lanes)
    shape = chosen.shape
    found, reached = continuation.follow(scaled(part), frictionless(part, chosen))
    result = [replaced(force, chosen, value) for force, value in zip(forces, found, strict=True)]
    shares = np.ones(shape)
    shares[chosen] = reached
    return result, shares


Weights = Callable[[NDArray[np.float64], NDArray[np.intp]], Sequence[Number]]


def scaled(problem: Problem, weights: Weights | None = None) -> continuation.Family:
    """Residual φ − w(s) law(N(φ)) and its Jacobian; w(s, lanes): multiple of each contact's friction, or s."""

    def family(lanes: NDArray[np.intp]) -> continuation.System:
        part = problem.mapped(lambda number: number[lanes])

        def system(
            forces: Sequence[NDArray[np.float64]], share: NDArray[np.float64]
        ) -> tuple[list[Number], list[list[Number]]]:
            found = [share] * len(part.contacts) if weights is None else weights(share, lanes)
            shares = [weight if contact.rubs else 1.0 for weight, contact in zip(found, part.contacts, strict=True)]
            state = part.state(forces)
            residual = [f - s * t for f, s, t in zip(forces, shares, part.target(state.normals), strict=True)]
            slopes = part.map_derivative(state)
            rows = [[s * entry for entry in row] for s, row in zip(shares, slopes, strict=True)]
            return residual, identity_minus(rows)

        return system

    return family


def frictionless(problem: Problem, chosen: NDArray[np.bool_]) -> list[NDArray[np.float64]]:
    """Forces without friction, lane by lane: none but those that push gears apart."""
    none = [np.zeros(int(np.count_nonzero(chosen))) for _ in problem.contacts]
    target = problem.target(problem.state(none).normals)
    return [zero if c.rubs else zero + t for zero, c, t in zip(none, problem.contacts, target, strict=True)]


def identity_minus(rows: Sequence[Sequence[Number]]) -> list[list[Number]]:
    return [[(1.0 if k == j else 0.0) - entry for j, entry in enumerate(row)] for k, row in enumerate(rows)]


def _changes(columns: Sequence[Reaction], forces: Sequence[Number]) -> Reaction:
    """What friction forces change in a reaction. columns: what 1 N of each does."""
    return tuple(
        _total([entry * force for entry, force in zip(entries, forces, strict=True) if not is_zero(entry)])
        for entries in zip(*columns, strict=True)
    )


def _along(gradient: Reaction, column: Reaction) -> Number:
    """Derivative of a normal load along a change of the reaction."""
    return _total([g * c for g, c in zip(gradient, column, strict=True) if not (is_zero(g) or is_zero(c))])


def _added(a: Reaction, b: Reaction) -> Reaction:
    """a + b; a literal zero costs nothing."""
    return tuple(p if is_zero(q) else q if is_zero(p) else p + q for p, q in zip(a, b, strict=True))


def _total(parts: Sequence[Number]) -> Number:
    """Sum; of nothing a literal zero. The built-in sum would add the first part to 0."""
    return functools.reduce(operator.add, parts) if parts else 0.0


def _largest(values: Sequence[Number]) -> Number:
    """Largest magnitude, elementwise; NaN if one is NaN."""
    largest = np.abs(primal(values[0]))
    for value in values[1:]:
        largest = np.maximum(largest, np.abs(primal(value)))
    return largest


def _depth(problem: Problem) -> int:
    """Levels of ε among the inputs: each costs one Newton step at the solution."""
    return max((n.depth for n in problem.numbers() if isinstance(n, Dual)), default=0)


def _primal(problem: Problem) -> Problem:
    """The problem without derivatives."""
    return problem.mapped(primal) if _depth(problem) or problem.compiled else problem
